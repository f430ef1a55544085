//! The field in a few lines: peak, counts, self-check, warnings.

use egui::Ui;
use nalgebra::Point3;

use super::findings::Findings;
use super::select;
use crate::draw::words::sentence;
use crate::gui::height_map::options::{significant, with_error};
use crate::gui::{Command, Focus, Scene};
use crate::muscle_field::fibres::{fibre_through, muscle_name};
use crate::pipeline::{Outcome, Peak};

/// Shows the lines.
pub(super) fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    findings: &Findings,
    first: &[Point3<f64>],
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let outcome = scene.outcome;
    let unit = outcome.unit();
    ui.add_space(6.0);
    ui.strong("Largest force");
    match findings.peak {
        Peak::Stands { vertex, force, sigma } => {
            let at = first.get(vertex).copied().unwrap_or_default();
            ui.label(format!("{} {unit}", with_error(force, Some(sigma))));
            let place = format!("x {:.0}, y {:.0} mm", at.x, at.y).replace('-', "−");
            link(ui, format!("vertex {vertex} at {place}"), "Select it", vertex, focus, commands);
            if let Some(fibre) = fibre_through(scene.face, &outcome.first, vertex) {
                ui.weak(format!("in {}", muscle_name(&scene.face.muscles()[fibre.muscle])));
            }
        }
        finding => _ = ui.label(sentence(&finding.in_words(unit))),
    }
    if let Some((vertex, force)) = findings.larger {
        let (place, why) = why_not(outcome, vertex);
        let words = format!("{} {unit} {place}, vertex {vertex}", significant(force, 3));
        link(ui, words, why, vertex, focus, commands);
    }
    ui.separator();

    ui.strong("Vertices");
    let parts: Vec<String> = findings.counts.iter().map(|(n, state)| format!("{n} {}", state.word())).collect();
    ui.label(parts.join(", "));
    if findings.on_border > 0 {
        ui.weak(format!("{} of them on the border", findings.on_border));
    }
    ui.separator();

    ui.strong("Self-check");
    let sum = outcome.field.internal_sum.norm();
    let largest = findings.largest.map_or(0.0, |(_, f)| f);
    // Rounding adds up over the springs; a thousandth of a millionth of the largest force is far above it.
    let holds = sum <= 1e-9 * largest.max(f64::MIN_POSITIVE) || sum == 0.0;
    let verdict = if holds { "holds" } else { "is broken" };
    let text = format!(
        "Sum of internal forces {sum:.1e} {unit}, of forces up to {} {unit}: {verdict}",
        significant(largest, 3)
    );
    if holds {
        ui.label(text.replace("e-", "e−"));
    } else {
        ui.colored_label(ui.visuals().error_fg_color, text.replace("e-", "e−"));
    }
    if !outcome.warnings.is_empty() {
        ui.separator();
        ui.strong("Warnings");
        for warning in &outcome.warnings {
            ui.colored_label(ui.visuals().warn_fg_color, warning.to_string());
        }
    }
}

/// A line that lights a vertex up under the pointer, and selects it by a click.
fn link(ui: &mut Ui, words: String, hint: &str, vertex: usize, focus: &mut Focus, commands: &mut Vec<Command>) {
    let link = ui.link(words).on_hover_text(hint);
    if link.hovered() {
        focus.hover(vertex as u32);
    }
    if link.clicked() {
        select(commands, vertex);
    }
}

/// Why a larger force is not the largest: where it stands, and what that means.
fn why_not(outcome: &Outcome, vertex: usize) -> (&'static str, &'static str) {
    if outcome.border.get(vertex) == Some(&true) {
        return (
            "on the border",
            "Larger, but it carries the reaction of skin that nobody measured. Click to select it.",
        );
    }
    if outcome.field.outside_table.get(vertex) == Some(&true) {
        return (
            "beyond the skin table",
            "Larger, but the skin there is strained beyond its table. Click to select it.",
        );
    }
    if !outcome.stands_above_error(vertex) {
        return (
            "below twice its error",
            "Larger, but it cannot be told from the noise of marking. Click to select it.",
        );
    }
    ("inferred", "Larger, but nobody marked this vertex. Click to select it.")
}
