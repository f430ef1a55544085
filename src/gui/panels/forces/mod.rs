//! The workspace of the forces.

use crate::gui::{Command, Focus, Scene};

/// What the workspace of the forces remembers about showing.
#[derive(Debug, Default)]
pub struct ForcesView {}

/// Shows the workspace in the whole of `ui`.
pub fn show(
    ui: &mut egui::Ui,
    _scene: Scene<'_>,
    _view: &mut ForcesView,
    _focus: &mut Focus,
    _commands: &mut Vec<Command>,
) {
    ui.heading("Forces");
}
