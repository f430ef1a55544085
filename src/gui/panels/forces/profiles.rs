//! The two profiles under the map: one up the face or along a muscle's fibre, one across it.

use egui::{Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use nalgebra::Point3;

use super::chart::{self, Chart};
use super::prepared::Prepared;
use super::{ForcesView, select};
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::range::round_up;
use crate::gui::height_map::{Direction, Quantity};
use crate::gui::{Command, Focus, Scene, Stamp};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::section::{Line, ProfilePoint, Section, section};

/// What two profiles were cut from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutFrom {
    stamp: Stamp,
    shown: (Quantity, Direction, Option<usize>),
    lines: [Line; 2],
}

/// Shows both charts side by side; `first` are the vertices from the eyes, mm.
pub(super) fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    view: &mut ForcesView,
    prepared: &Prepared,
    selected: Option<usize>,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let (layer, first) = (&prepared.layer, &prepared.first[..]);
    let through = selected.or(prepared.findings.look_at);
    ui.horizontal_wrapped(|ui| {
        ui.weak(match (selected, through) {
            (Some(v), _) => format!("through vertex {v}"),
            (None, Some(v)) if prepared.findings.peak.vertex() == Some(v) => format!("through the peak, vertex {v}"),
            // No force stands above its error, so there is no peak.
            (None, Some(v)) => format!("through vertex {v}, where the force is largest, though within its error"),
            (None, None) => "no vertex is measured".to_owned(),
        });
        ui.separator();
        ui.selectable_value(&mut view.profile_along_fibre, false, "Vertical");
        let fibre = view.options.muscle.and_then(|m| scene.face.muscles().get(m));
        let words = fibre.map_or_else(|| "Along a fibre".to_owned(), |m| format!("Along {}", muscle_name(m)));
        let hint = "From the muscle's attachment to its insertion; the muscle is chosen on the right of it";
        ui.selectable_value(&mut view.profile_along_fibre, true, words).on_hover_text(hint);
        muscle_chooser(ui, scene, view);
    })
    .response
    .on_hover_text("Points are vertices near the line, with ± one standard error; the line is the surface, cut");
    let Some((at, [upper, lateral])) = lines(scene, view, prepared, selected) else { return };
    let (upper_title, upper_axis) = if upper.along == nalgebra::Vector2::y() && !view.profile_along_fibre {
        (format!("Vertical, x = {:.0} mm", at.x).replace('-', "−"), "y, mm")
    } else {
        ("Along the fibre".to_owned(), "from attachment towards insertion, mm")
    };
    let lateral_title = format!("Lateral, y = {:.0} mm", at.y).replace('-', "−");
    let cut = |line: &Line| section(scene.face.mesh(), first, &|v| layer.value_and_error(v), line);
    let o = &view.options;
    let from = CutFrom { stamp: scene.stamp, shown: (o.quantity, o.direction, o.muscle), lines: [upper, lateral] };
    let cuts = match view.cuts.take() {
        Some(cuts) if cuts.0 == from => cuts,
        _ => (from, [cut(&upper), cut(&lateral)]),
    };
    let sections = &cuts.1;
    let titles = [(upper_title, upper_axis), (lateral_title, "x, mm")];

    let rect = ui.available_rect_before_wrap();
    let inks = Inks::new(ui.visuals(), layer.signed);
    let response = ui.allocate_rect(rect, Sense::click());
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|p| rect.contains(*p));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 4.0, inks.canvas);
    let range = prepared.range(view.options.range);
    let palette = view.options.palette(layer, range);
    let values = limits(sections, layer.signed);
    let up = layer.axis_title();
    let lit = [selected, focus.hovered().map(|v| v as usize)];
    let half = (rect.width() / 2.0).floor();
    for (k, (section, (title, across))) in sections.iter().zip(&titles).enumerate() {
        let part = Rect::from_min_size(pos2(rect.left() + half * k as f32, rect.top()), vec2(half, rect.height()));
        let chart = Chart {
            title,
            across,
            along: None,
            up: &up,
            section,
            curves: &[],
            values,
            colour: &|v| palette.colour(v),
            lit,
        };
        if let Some(v) = chart::draw(&painter, part, &chart, pointer, &inks) {
            focus.hover(v as u32);
            if response.clicked() {
                select(commands, v);
            }
        }
    }
    view.cuts = Some(cuts);
    let words = format!("Profiles, {} and {}", titles[0].0, titles[1].0);
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &words));
}

/// The point that the profiles run through, and their lines: up the face or along the chosen fibre, and across.
pub(super) fn lines(
    scene: Scene<'_>,
    view: &ForcesView,
    prepared: &Prepared,
    selected: Option<usize>,
) -> Option<(Point3<f64>, [Line; 2])> {
    let (first, findings) = (&prepared.first, &prepared.findings);
    let through = selected.or(findings.look_at)?;
    let at = *first.get(through)?;
    let band = 0.5 * findings.mean_edge_mm;
    let muscle = view.options.muscle.and_then(|m| scene.face.muscles().get(m)).filter(|_| view.profile_along_fibre);
    let fibre = muscle.and_then(|muscle| {
        let (a, i) = (first.get(muscle.attachment as usize)?, first.get(muscle.insertion as usize)?);
        Line::between(a, i, muscle.half_width_mm)
    });
    Some((at, [fibre.unwrap_or_else(|| Line::vertical(&at, band)), Line::lateral(&at, band)]))
}

fn muscle_chooser(ui: &mut Ui, scene: Scene<'_>, view: &mut ForcesView) {
    ui.menu_button("Muscle…", |ui| {
        egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
            for (m, muscle) in scene.face.muscles().iter().enumerate() {
                if ui.selectable_label(view.options.muscle == Some(m), muscle_name(muscle)).clicked() {
                    view.options.muscle = Some(m);
                    view.profile_along_fibre = true;
                    view.options.fibre = true;
                }
            }
        });
    });
}

/// Limits of the vertical axis that hold both charts with their error bars, so that they can be compared.
fn limits(sections: &[Section; 2], signed: bool) -> [f64; 2] {
    let reach = |p: &ProfilePoint| {
        let error = p.error.unwrap_or(0.0);
        [p.value - error, p.value + error]
    };
    let ends = sections.iter().flat_map(|s| {
        s.points.iter().flat_map(reach).chain(s.pieces.iter().flatten().map(|p| p[1])).collect::<Vec<_>>()
    });
    let (low, high) = ends.filter(|v| v.is_finite()).fold((0.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    let (up, down) = (if high > 0.0 { round_up(high) } else { 0.0 }, if low < 0.0 { round_up(-low) } else { 0.0 });
    match (up == 0.0 && down == 0.0, signed) {
        (true, _) => [0.0, 1.0],
        (false, true) => [-down, up],
        // A magnitude is never negative; its bar may reach a little below zero.
        (false, false) => [-down.min(0.25 * up), up],
    }
}
