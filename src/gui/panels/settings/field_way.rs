//! How the forces are found from the marks: the choice of the way, how smooth it is, and the L-curve behind that.

use egui::{RichText, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::rules;
use crate::displacement::regularised::{FEWEST_MARKS, MOST_MARKS, Weighed, WeightRule};
use crate::draw::numbers::significant;
use crate::gui::{Command, Scene};
use crate::muscle::LawKind;
use crate::pipeline::Smoothing;
use crate::project::{FieldWay, MuscleWay};

/// Height of the L-curve, points.
const HEIGHT: f32 = 120.0;
/// Decades that the curve shows, and those of them above its largest value.
const DECADES: f64 = 3.0;
const HEADROOM: f64 = 0.2;

pub(super) fn show(ui: &mut Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    // The ways by name: choosing the one that is on keeps its own choices.
    let ways: Vec<(&str, &str, &str)> = FieldWay::ALL.iter().map(|w| (w.name(), w.label(), w.hint())).collect();
    rules(ui, settings, settings.field.name(), &ways, commands, |s, name| {
        if let Some(way) = FieldWay::ALL.into_iter().find(|w| w.name() == name && s.field.name() != name) {
            s.field = way;
        }
    });
    let Some(weight) = settings.field.weight() else { return };
    if let FieldWay::Muscles(way) = settings.field {
        ui.add_space(4.0);
        ui.label("How a muscle pulls");
        let nearest = (
            None,
            "By the law that leaves least",
            "All four laws are tried, and that which takes the skin nearest to the points is kept: four times the time of one",
        );
        let named = LawKind::ALL.map(|law| {
            (Some(law), law.label(), "The law by which a muscle's force spreads over the skin about its fibre")
        });
        let laws: Vec<_> = std::iter::once(nearest).chain(named).collect();
        rules(ui, settings, way.law, &laws, commands, |s, law| s.field = FieldWay::Muscles(MuscleWay { law, ..way }));
        ui.label("The law's shape");
        let shapes = [
            (false, "As usual", "Each law has the shape that suits the faces that it was made for"),
            (
                true,
                "Found with the muscles",
                "How steep and how wide a pull is spread is found too, one shape for all muscles, within about a factor of two of the usual one. Several times as slow; nearer where this person's muscles spread otherwise",
            ),
        ];
        rules(ui, settings, way.shape, &shapes, commands, |s, shape| {
            s.field = FieldWay::Muscles(MuscleWay { shape, ..way });
        });
        ui.label("How many muscles");
        let numbers = [
            (
                false,
                "All that pull",
                "Every muscle gets the strength with which the skin comes to rest nearest to the points, none below zero.",
            ),
            (
                true,
                "The fewest that explain the motion",
                "A muscle is added only while it earns its place, by an information criterion and by the error on points left out.",
            ),
        ];
        rules(ui, settings, way.most.is_some(), &numbers, commands, |s, few| {
            s.field = FieldWay::Muscles(MuscleWay { most: few.then_some(u8::MAX), ..way });
        });
        ui.label("What the muscles leave");
        let besides = [
            (
                false,
                "Pulls besides them",
                "What they leave is taken for pulls along the skin near them, as large as the points ask for: the field is nearer where the law is not how these muscles pull, and its error bars count that",
            ),
            (
                true,
                "Nothing: the muscles alone",
                "The field is theirs alone. Faster, and far off with narrow error bars where the law is wrong",
            ),
        ];
        rules(ui, settings, way.alone, &besides, commands, |s, alone| {
            s.field = FieldWay::Muscles(MuscleWay { alone, ..way });
        });
        ui.add_space(4.0);
        found(ui, scene);
    }
    ui.add_space(4.0);
    ui.label("How smooth");
    let weights = WeightRule::ALL.map(|w| (w, w.label(), hint(w)));
    rules(ui, settings, weight, &weights, commands, |s, weight| s.field = s.field.with_weight(weight));
    ui.add_space(4.0);
    if let Some(smoothing) = &scene.outcome.smoothing {
        said(ui, smoothing);
        l_curve(ui, smoothing);
    } else {
        let (few, many) = (FEWEST_MARKS, MOST_MARKS);
        ui.label(
            RichText::new(format!("Needs {few} to {many} marks in the last frame; with others the field is direct."))
                .weak(),
        );
    }
}

fn hint(rule: WeightRule) -> &'static str {
    match rule {
        WeightRule::Discrepancy => {
            "As smooth as it can be while it misses the marks by no more than their stated error. Gave the smallest errors of the force"
        }
        WeightRule::Evidence => {
            "The smoothness under which these marks with their stated error were the most likely. Keeps more detail"
        }
        WeightRule::CrossValidation => {
            "The smoothness that foretells a left out mark best. Asks for no stated error; now and then takes noise for motion"
        }
    }
}

/// Which muscles stand for the measured forces, and how near they take the skin to the points.
fn found(ui: &mut Ui, scene: Scene<'_>) {
    let Some(muscles) = &scene.outcome.muscles else {
        let why = if scene.fitting { "The muscles are still to come: until then" } else { "No muscles are found, so" };
        ui.label(RichText::new(format!("{why} the field is the measured one.")).weak());
        return;
    };
    let most = muscles.pulling.iter().max_by(|a, b| a.moves_px.total_cmp(&b.moves_px));
    let named = most.map_or(String::new(), |p| {
        format!("; the {} moves them most, at {:.0} % of its strength", p.name, 100.0 * p.activation)
    });
    let besides = muscles
        .besides
        .map_or(String::new(), |b| format!(" Pulls besides theirs are {:.0} % of all that pulls.", 100.0 * b.of_all));
    let jaw = muscles.jaw.filter(|j| j.deg > 0.0).map_or(String::new(), |j| {
        format!(" The jaw is open by {:.1}° ({:.1} to {:.1}).", j.deg, j.between[0], j.between[1])
    });
    let shape: Vec<String> = muscles
        .shape
        .iter()
        .map(|p| {
            let [value, low, high] = [p.value, p.between[0], p.between[1]].map(|v| significant(v, 3));
            format!("{} {value} ({low} to {high})", p.label.to_lowercase())
        })
        .collect();
    let shape = if shape.is_empty() { String::new() } else { format!(" Its shape: {}.", shape.join(", ")) };
    let text = format!(
        "{} of {} muscles move the points ({}){named}.{jaw} They leave the points {:.2} px off, {:.1} times what marks, head and landmarks err by, and explain {:.0} % of the motion.{besides}{shape}",
        muscles.pulling.len(),
        muscles.among,
        muscles.law.label(),
        muscles.left_px,
        muscles.misfit,
        100.0 * muscles.explained.max(0.0)
    );
    ui.label(RichText::new(text).weak());
}

fn said(ui: &mut Ui, smoothing: &Smoothing) {
    let w = smoothing.weighed;
    let text = format!(
        "Misses the marks by {:.2} of their stated error and keeps {:.0} of {} degrees of freedom.",
        w.residual, w.freedoms, smoothing.marks
    );
    ui.label(RichText::new(text).weak());
}

/// Bending against distance from the marks, both on logarithmic axes; the weight taken is the dot.
fn l_curve(ui: &mut Ui, smoothing: &Smoothing) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), HEIGHT), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "L-curve of the smoothing"));
    let visuals = ui.visuals();
    let (ink, faint) = (visuals.text_color(), visuals.weak_text_color());
    let font = egui::TextStyle::Small.resolve(ui.style());
    let largest =
        |value: fn(&Weighed) -> f64| smoothing.curve.iter().map(value).fold(f64::MIN_POSITIVE, f64::max).log10();
    let tops = [largest(|w| w.residual), largest(|w| w.bending)];
    let frame = response.rect.shrink2(vec2(4.0, 4.0));
    let plot = egui::Rect::from_min_max(frame.min + vec2(16.0, 0.0), frame.max - vec2(0.0, 18.0));
    let share = |value: f64, top: f64| ((value.max(f64::MIN_POSITIVE).log10() - top - HEADROOM) / DECADES + 1.0) as f32;
    let at = |w: &Weighed| {
        let [x, y] = [share(w.residual, tops[0]), share(w.bending, tops[1])];
        (x >= 0.0 && y >= 0.0).then(|| pos2(plot.left() + x * plot.width(), plot.bottom() - y * plot.height()))
    };
    painter.rect_filled(plot, 2.0, visuals.extreme_bg_color);
    let points: Vec<egui::Pos2> = smoothing.curve.iter().filter_map(at).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, ink)));
    // One stated error from the marks.
    let one = plot.left() + share(1.0, tops[0]) * plot.width();
    if plot.x_range().contains(one) {
        painter.vline(one, plot.y_range(), Stroke::new(1.0, faint));
        painter.text(pos2(one - 3.0, plot.top() + 2.0), egui::Align2::RIGHT_TOP, "1 σ", font.clone(), faint);
    }
    if let Some(p) = at(&smoothing.weighed) {
        painter.circle_filled(p, 4.0, visuals.selection.bg_fill);
        painter.circle_stroke(p, 4.0, Stroke::new(1.0, ink));
    }
    painter.text(
        pos2(plot.center().x, frame.bottom()),
        egui::Align2::CENTER_BOTTOM,
        "Distance from the marks",
        font.clone(),
        faint,
    );
    let bending = painter.layout_no_wrap("Bending".to_owned(), font, faint);
    let corner = pos2(frame.left(), plot.center().y + bending.size().x / 2.0);
    painter.add(egui::epaint::TextShape::new(corner, bending, faint).with_angle(-std::f32::consts::FRAC_PI_2));
    response.on_hover_text(
        "The L-curve: what every smoothness would cost. To the left the marks are followed with their error, to the right they are smoothed away; the dot is the one taken",
    );
}
