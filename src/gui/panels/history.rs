//! The history as a list of named steps: click one to go there.

use egui::RichText;

use crate::gui::Command;
use crate::project::History;

/// Shows the list, newest first; what was taken back stands above, in grey.
pub fn show(ui: &mut egui::Ui, history: &History, commands: &mut Vec<Command>) {
    let done = history.done().len();
    let names: Vec<&str> = std::iter::once("As opened").chain(history.done()).chain(history.undone()).collect();
    ui.label(RichText::new(format!("{done} steps done, {} taken back", history.undone().len())).weak());
    ui.add_space(4.0);
    for (step, name) in names.into_iter().enumerate().rev() {
        let text = if step > done { RichText::new(name).weak() } else { RichText::new(name) };
        let width = ui.available_width();
        let button = egui::Button::selectable(step == done, text).min_size(egui::vec2(width, 20.0)).truncate();
        ui.push_id(step, |ui| {
            if ui.add(button).clicked() {
                commands.push(Command::GoToStep(step));
            }
        });
    }
}
