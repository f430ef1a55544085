//! The muscles with a slider each, grouped by the part of the face that they move.

use std::fmt::Write as _;

use egui::{RichText, Slider, Ui, WidgetInfo, vec2};

use super::ExpressionsView;
use super::choices::{exact, percent};
use crate::draw::numbers::significant;
use crate::draw::words::capital;
use crate::expression::jaw::WIDEST_DEG;
use crate::expression::{Actuator, Kind};
use crate::face::Side;
use crate::gui::expression_work::Ready;

/// Width of the slider of a muscle, points.
const SLIDER_WIDTH: f32 = 98.0;
/// Width of its name.
const NAME_WIDTH: f32 = 156.0;

/// Parts of the face, from above.
const GROUPS: [&str; 4] = ["Forehead", "Eyes", "Nose", "Mouth"];

/// The part that an action unit moves.
fn group(action_unit: u8) -> usize {
    match action_unit {
        1 | 2 | 4 => 0,
        5..=7 | 41..=46 => 1,
        9 | 11 | 38 | 39 => 2,
        _ => 3,
    }
}

/// The muscles that one row moves.
struct Row<'a> {
    name: String,
    members: Vec<&'a Actuator>,
}

/// Left and right as one row where they are linked, otherwise a row each.
fn rows<'a>(ready: &'a Ready, of: usize, linked: bool) -> Vec<Row<'a>> {
    let mut rows: Vec<Row<'a>> = Vec::new();
    for actuator in ready.actuators.all.iter().filter(|a| group(a.action_unit) == of) {
        let name = short_name(actuator);
        if linked && let Some(row) = rows.iter_mut().find(|r| stem(&r.members[0].id) == stem(&actuator.id)) {
            row.members.push(actuator);
            continue;
        }
        let side = match actuator.side {
            Some(Side::Left) if !linked => " L",
            Some(Side::Right) if !linked => " R",
            _ => "",
        };
        rows.push(Row { name: format!("{name}{side}"), members: vec![actuator] });
    }
    if !linked {
        rows.sort_by(|a, b| stem(&a.members[0].id).cmp(stem(&b.members[0].id)));
    }
    rows
}

fn stem(id: &str) -> &str {
    id.strip_suffix("_left").or_else(|| id.strip_suffix("_right")).unwrap_or(id)
}

/// "Frontalis, medialis"; the whole name stands in the hint.
fn short_name(actuator: &Actuator) -> String {
    let words = [(", pars ", ", "), ("superioris", "sup."), ("inferioris", "inf."), ("Orbicularis", "Orbic.")];
    let name = capital(actuator.name.trim_start_matches("Musculus "));
    words.iter().fold(name, |name, (long, short)| name.replace(long, short))
}

/// Shows all groups, and the jaw.
pub(super) fn show(ui: &mut Ui, ready: &Ready, view: &mut ExpressionsView) {
    ui.horizontal(|ui| {
        ui.strong("Muscles");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.toggle_value(&mut view.linked, "Both sides").on_hover_text("Left and right move together");
        });
    });
    for (of, title) in GROUPS.into_iter().enumerate() {
        let rows = rows(ready, of, view.linked);
        if rows.is_empty() {
            continue;
        }
        ui.add_space(2.0);
        ui.label(RichText::new(title).weak().size(12.0));
        for row in rows {
            muscle(ui, &row, view);
        }
    }
    ui.add_space(2.0);
    ui.label(RichText::new("Jaw").weak().size(12.0));
    ui.horizontal(|ui| {
        name(ui, "Open", "The angle by which the jaw turns about its joints (AU 26). It is no muscle force.");
        ui.spacing_mut().slider_width = SLIDER_WIDTH;
        let slider = Slider::new(&mut view.expression.jaw_deg, 0.0..=WIDEST_DEG).suffix("°");
        let response = ui.add(exact(slider, 0));
        response.widget_info(|| WidgetInfo::slider(true, view.expression.jaw_deg, "Jaw"));
        if response.changed() {
            touched(view);
        }
    });
}

fn muscle(ui: &mut Ui, row: &Row<'_>, view: &mut ExpressionsView) {
    ui.horizontal(|ui| {
        name(ui, &row.name, &hint(row));
        let mut value = view.expression.activation(&row.members[0].id);
        if percent(ui, &mut value, &row.name, SLIDER_WIDTH) {
            for member in &row.members {
                if value > 0.0 {
                    view.expression.activations.insert(member.id.clone(), value);
                } else {
                    view.expression.activations.remove(&member.id);
                }
            }
            touched(view);
        }
    });
}

/// What was moved by hand is none of the six any more.
fn touched(view: &mut ExpressionsView) {
    if let Some(basic) = view.basic.take() {
        view.expression.name = format!("{}, changed", basic.name());
    }
}

fn name(ui: &mut Ui, words: &str, hint: &str) {
    let height = ui.spacing().interact_size.y;
    ui.allocate_ui_with_layout(vec2(NAME_WIDTH, height), egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_width(NAME_WIDTH);
        ui.add(egui::Label::new(RichText::new(words).size(12.5)).truncate()).on_hover_text(hint);
    });
}

/// Name, action unit, strength and where it is from.
fn hint(row: &Row<'_>) -> String {
    let one = row.members[0];
    let kind = match one.kind {
        Kind::Fibre => "a fibre from bone to skin",
        Kind::Sphincter => "a ring of fibres",
        Kind::Lid => "the lifter of the lid",
    };
    let newton = significant(one.strength_n, 3);
    let mut words = format!(
        "{}, AU {}: {kind}\n{newton} N at 100 %, {} ({})",
        one.name,
        one.action_unit,
        one.evidence.label(),
        one.source
    );
    for member in &row.members {
        if let Some(note) = &member.note {
            let _ = write!(words, "\n{}: {note}", member.id);
        }
    }
    words
}
