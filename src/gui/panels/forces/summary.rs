//! The field in a few lines: peak, counts, self-check, warnings.

use egui::Ui;
use nalgebra::Point3;

use super::select;
use crate::displacement::VertexState;
use crate::gui::height_map::options::{significant, with_error};
use crate::gui::height_map::quantity::{muscle_at, muscle_name};
use crate::gui::{Command, Focus, Scene};

/// Shows the lines.
pub(super) fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    first: &[Point3<f64>],
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let outcome = scene.outcome;
    let unit = outcome.unit();
    let peak = outcome.peak();
    let of_all = outcome.field.peak(&outcome.states);
    ui.add_space(6.0);
    ui.strong("Peak force");
    match peak {
        Some((v, force)) => {
            let at = first.get(v).copied().unwrap_or_default();
            let sigma = outcome.field.sigma.get(v).copied();
            ui.label(format!("{} {unit}", with_error(force, sigma)));
            let place = format!("x {:.0}, y {:.0} mm", at.x, at.y).replace('-', "−");
            let link = ui.link(format!("vertex {v} at {place}")).on_hover_text("Select it");
            if link.hovered() {
                focus.hover(v as u32);
            }
            if link.clicked() {
                select(commands, v);
            }
            if let Some(m) = muscle_at(outcome, scene.face, v) {
                ui.weak(format!("in {}", muscle_name(&scene.face.muscles()[m])));
            }
            if let Some((border, force)) = of_all.filter(|all| all.0 != v) {
                let words = format!("{} {unit} on the border, vertex {border}", significant(force, 3));
                let hint = "Larger, but it carries the reaction of skin that nobody measured. Click to select it.";
                let link = ui.link(words).on_hover_text(hint);
                if link.hovered() {
                    focus.hover(border as u32);
                }
                if link.clicked() {
                    select(commands, border);
                }
            }
        }
        None => _ = ui.weak("none: no vertex is measured"),
    }
    ui.separator();

    ui.strong("Vertices");
    let count = |state: VertexState| outcome.states.iter().filter(|s| **s == state).count();
    let border = outcome.border.iter().filter(|b| **b).count();
    let parts: Vec<String> =
        [VertexState::Measured, VertexState::Inferred, VertexState::Fixed, VertexState::Unmeasured]
            .into_iter()
            .map(|state| (count(state), state.word()))
            .filter(|(n, _)| *n > 0)
            .map(|(n, word)| format!("{n} {word}"))
            .collect();
    ui.label(parts.join(", "));
    if border > 0 {
        ui.weak(format!("{border} of the measured on the border"));
    }
    ui.separator();

    ui.strong("Self-check");
    let sum = outcome.field.internal_sum.norm();
    let largest = of_all.map_or(0.0, |(_, f)| f);
    // Rounding adds up over the springs; a thousandth of a millionth of the largest force is far above it.
    let holds = sum <= 1e-9 * largest.max(f64::MIN_POSITIVE) || sum == 0.0;
    let verdict = if holds { "holds" } else { "is broken" };
    let text =
        format!("Sum of internal forces {sum:.1e} {unit}, largest force {} {unit}: {verdict}", significant(largest, 3));
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
