//! The ladder of models, with the rung beyond which nothing more is gained.

use egui::Ui;

use super::{Shown, table};
use crate::draw::numbers::{fixed, significant};
use crate::gui::Command;
use crate::gui::muscle_work::MuscleWork;

/// Titles of the table, each with what it means.
const HEAD: [(&str, &str); 6] = [
    ("Rung", "From one muscle with one number upwards"),
    ("New", "What changes on this rung"),
    ("Numbers", "Fitted"),
    (
        "Held-out error",
        "Root of the share of the squared force missed on patches left out; with another skin, of the forces that it gives",
    ),
    ("R²", "Share of the squared force explained"),
    ("Time", "Of one fit"),
];

/// Shows the ladder, or the button that builds it.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, work: &MuscleWork, commands: &mut Vec<Command>) {
    let Some(ladder) = work.ladder() else {
        ui.add_space(8.0);
        ui.label("How much model does this field need? The ladder fits one model after another, from one muscle with one number upwards, and tests each on patches of skin that it has not seen.");
        ui.add_space(6.0);
        let words = if work.is_building() { "Building the ladder…" } else { "Build the ladder" };
        let button = ui.add_enabled(!work.is_building() && !shown.looking, egui::Button::new(words));
        if button.clicked() {
            commands.push(Command::BuildLadder);
        }
        return;
    };
    let rows: Vec<Vec<String>> = ladder
        .rungs
        .iter()
        .map(|rung| {
            let number = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| fixed(x, 3));
            let name =
                rung.failed.as_ref().map_or_else(|| rung.name.clone(), |why| format!("{} (no fit: {why})", rung.name));
            vec![
                name,
                rung.step.to_owned(),
                rung.parameters.to_string(),
                rung.held_out.as_ref().map_or_else(|| "–".to_owned(), |h| super::laws::error_text(h.error)),
                number(rung.r2),
                format!("{} ms", significant(rung.time_ms, 2)),
            ]
        })
        .collect();
    if let Some(rung) = ladder.recommended.and_then(|r| ladder.rungs.get(r)) {
        ui.label(format!(
            "Recommended: {} ({} numbers). No rung does better by more than the standard error of the difference.",
            rung.name, rung.parameters
        ));
        ui.separator();
    }
    table::show(ui, "ladder", &HEAD, &rows, ladder.recommended, None);
}
