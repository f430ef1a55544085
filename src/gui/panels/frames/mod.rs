//! The workspace of the two frames.

use crate::gui::{Command, Focus, Scene};

/// What the workspace of the frames remembers about showing.
#[derive(Debug, Default)]
pub struct FramesView {}

/// Shows the workspace in the whole of `ui`.
pub fn show(
    ui: &mut egui::Ui,
    _scene: Scene<'_>,
    _view: &mut FramesView,
    _focus: &mut Focus,
    _commands: &mut Vec<Command>,
) {
    ui.heading("Frames");
}
