//! The muscles, each with its strength as a bar with its interval, and a switch that says whether the laws are fitted to it.

use egui::{Align2, Color32, FontId, Rect, RichText, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::{MusclesView, Shown};
use crate::draw::numbers::{fixed, significant};
use crate::face::{Muscle, Side};
use crate::fit::activations::{Activation, Standing};
use crate::muscle_field::fibres::muscle_name;

const BAR_HEIGHT: f32 = 17.0;
/// Room beside a bar for the switch and for the number, points.
const SIDES: [f32; 2] = [44.0, 74.0];

/// Shows all muscles.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView) {
    let analysis = shown.analysis;
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        ui.strong("Strength");
        ui.weak(format!("{}, with 95 % interval", shown.unit));
    });
    ui.horizontal_wrapped(|ui| {
        if view.question.muscles.is_some() {
            if ui
                .button("Back to the smallest set")
                .on_hover_text("Fit the laws to the fewest muscles that explain the field")
                .clicked()
            {
                view.question.muscles = None;
            }
            ui.weak("fitted: as switched on");
        } else if analysis.explains {
            ui.weak("fitted: the smallest set, switched on");
        } else {
            let words = "no muscle explains the field on patches left out";
            ui.colored_label(ui.visuals().warn_fg_color, words);
        }
    });
    ui.add_space(4.0);
    let end = scale_end(shown);
    for pair in pairs(shown) {
        let muscle = &shown.scene.face.muscles()[analysis.fibres[pair[0]].muscle];
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.label(RichText::new(plain_name(muscle)).size(12.5));
            ui.weak(RichText::new(format!("AU {}", muscle.action_unit)).size(11.0));
        });
        for f in pair {
            row(ui, shown, view, f, end);
        }
        ui.add_space(3.0);
    }
    ui.separator();
    notes(ui, shown);
}

/// "frontalis, pars medialis".
fn plain_name(muscle: &Muscle) -> &str {
    muscle.latin.trim_start_matches("Musculus ")
}

/// Muscles of one name together, right before left, as they lie in the picture.
fn pairs(shown: &Shown<'_>) -> Vec<Vec<usize>> {
    let muscles = shown.scene.face.muscles();
    let mut pairs: Vec<Vec<usize>> = Vec::new();
    for (f, of) in shown.analysis.fibres.iter().enumerate() {
        let latin = &muscles[of.muscle].latin;
        match pairs.iter_mut().find(|p| muscles[shown.analysis.fibres[p[0]].muscle].latin == *latin) {
            Some(pair) => pair.push(f),
            None => pairs.push(vec![f]),
        }
    }
    for pair in &mut pairs {
        pair.sort_by_key(|&f| muscles[shown.analysis.fibres[f].muscle].side == Side::Left);
    }
    pairs
}

/// The strength at the end of the bars: the largest upper end of an active muscle's interval.
fn scale_end(shown: &Shown<'_>) -> f64 {
    let muscles = &shown.analysis.activations.muscles;
    let active = muscles.iter().filter(|m| m.standing == Standing::Active);
    let most = active.map(|m| m.high_n.min(3.0 * m.strength_n)).fold(0.0, f64::max);
    if most > 0.0 { most } else { 1.0 }
}

fn row(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView, f: usize, end: f64) {
    let of = shown.analysis.fibres[f].muscle;
    let muscle = &shown.scene.face.muscles()[of];
    let one = &shown.analysis.activations.muscles[f];
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 4.0, BAR_HEIGHT), Sense::click());
    let chosen = shown.muscle == Some(of);
    if chosen {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().selection.bg_fill.gamma_multiply(0.5));
    } else if response.hovered() {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
    }
    let side = if muscle.side == Side::Left { "L" } else { "R" };
    let mut fitted = shown.analysis.set.contains(&f);
    let switch = Rect::from_min_size(rect.min + vec2(2.0, 0.0), vec2(SIDES[0] - 6.0, BAR_HEIGHT));
    let hint = format!("Fit the laws to {}", muscle_name(muscle));
    let switched = ui.put(switch, egui::Checkbox::new(&mut fitted, side));
    switched.widget_info(|| WidgetInfo::selected(egui::Role::CheckBox, true, fitted, &hint));
    if switched.on_hover_text(&hint).changed() {
        let of_set = shown.analysis.set.iter().map(|&f| shown.analysis.fibres[f].muscle);
        let mut muscles: Vec<usize> = view.question.muscles.clone().unwrap_or_else(|| of_set.collect());
        muscles.retain(|m| *m != of);
        muscles.extend(fitted.then_some(of));
        muscles.sort_unstable();
        view.question.muscles = Some(muscles);
    }
    let bar = Rect::from_min_max(
        pos2(rect.left() + SIDES[0], rect.top() + 4.0),
        pos2(rect.right() - SIDES[1], rect.bottom() - 4.0),
    );
    strength_bar(ui, bar, one, end, shown.analysis.set.contains(&f));
    let at = pos2(rect.right() - 4.0, rect.center().y);
    let colour =
        if one.standing == Standing::Active { ui.visuals().text_color() } else { ui.visuals().weak_text_color() };
    ui.painter().text(at, Align2::RIGHT_CENTER, number(one), FontId::proportional(12.0), colour);
    if response.clicked() {
        view.muscle = Some(of);
    }
    let words = format!("{}: {}", muscle_name(muscle), in_words(one, shown.unit));
    response.widget_info(|| WidgetInfo::selected(egui::Role::Row, true, chosen, &words));
    response.on_hover_text(words);
}

fn strength_bar(ui: &Ui, bar: Rect, one: &Activation, end: f64, fitted: bool) {
    let painter = ui.painter_at(bar.expand(3.0));
    let x = |strength: f64| bar.left() + bar.width() * (strength / end).clamp(0.0, 1.0) as f32;
    painter.rect_filled(bar, 2.0, ui.visuals().widgets.noninteractive.bg_stroke.color.gamma_multiply(0.5));
    let red = Color32::from_rgb(196, 62, 58);
    let fill = if fitted { red } else { red.gamma_multiply(0.45) };
    painter.rect_filled(Rect::from_min_max(bar.min, pos2(x(one.strength_n), bar.bottom())), 2.0, fill);
    if matches!(one.standing, Standing::Active | Standing::AtZero) && one.high_n.is_finite() {
        let stroke = Stroke::new(1.2, ui.visuals().text_color());
        let (low, high, y) = (x(one.low_n), x(one.high_n), bar.center().y);
        painter.line_segment([pos2(low, y), pos2(high, y)], stroke);
        for (at, inside) in [(low, true), (high, one.high_n <= end)] {
            if inside {
                painter.line_segment([pos2(at, y - 3.5), pos2(at, y + 3.5)], stroke);
            }
        }
    }
}

fn number(one: &Activation) -> String {
    match one.standing {
        Standing::Active => significant(one.strength_n, 3),
        Standing::AtZero => format!("< {}", significant(one.high_n, 2)),
        Standing::Collinear => "not told".to_owned(),
        Standing::Silent => "no data".to_owned(),
    }
}

fn in_words(one: &Activation, unit: &str) -> String {
    let [strength, low, high] = [one.strength_n, one.low_n, one.high_n].map(|n| significant(n, 3));
    match one.standing {
        Standing::Active => format!("{strength} {unit}, 95 % between {low} and {high}"),
        Standing::AtZero => format!("none; with 95 % less than {high} {unit}"),
        Standing::Collinear => "the data cannot tell it from other muscles".to_owned(),
        Standing::Silent => "no measured force lies where it pulls".to_owned(),
    }
}

/// What the bars cannot show: action units, the share explained, what cannot be told apart.
fn notes(ui: &mut Ui, shown: &Shown<'_>) {
    let analysis = shown.analysis;
    let muscles = shown.scene.face.muscles();
    let units: Vec<u8> = analysis.fibres.iter().map(|f| muscles[f.muscle].action_unit).collect();
    let mut told: Vec<_> = analysis.activations.by_unit(&units);
    told.retain(|u| u.strength_n > 0.0);
    told.sort_by(|a, b| b.strength_n.total_cmp(&a.strength_n));
    if !told.is_empty() {
        ui.strong("Action units");
        for unit in told.iter().take(6) {
            let [strength, low, high] = [unit.strength_n, unit.low_n, unit.high_n].map(|n| significant(n, 2));
            ui.label(format!("AU {}: {strength} ({low} to {high}) {}", unit.unit, shown.unit));
        }
        ui.add_space(4.0);
    }
    ui.label(format!(
        "All muscles at once explain {} % of the squared force of {} vertices.",
        fixed(100.0 * analysis.activations.r_squared, 0),
        analysis.samples.len()
    ));
    for confusable in analysis.activations.confusable.iter().take(4) {
        let name = |f: usize| muscle_name(&muscles[analysis.fibres[f].muscle]);
        let others: Vec<String> = confusable.with.iter().map(|(f, _)| name(*f)).collect();
        let words = format!("{} is hard to tell from {}.", name(confusable.muscle), others.join("; "));
        ui.weak(words);
    }
}
