//! The ladder of models, with the rung beyond which nothing more is gained.

use egui::Ui;

use super::{Shown, table};
use crate::export::muscle_tables;
use crate::gui::Command;
use crate::gui::muscle_work::MuscleWork;

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
    if let Some(rung) = ladder.recommended.and_then(|r| ladder.rungs.get(r)) {
        ui.label(format!(
            "Recommended: {} ({} numbers). No rung does better by more than the standard error of the difference.",
            rung.name, rung.parameters
        ));
        ui.separator();
    }
    table::show(ui, "ladder", &muscle_tables::ladder(ladder), None);
}
