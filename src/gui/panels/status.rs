//! The status bar: what was last said, what is going on, and where the pointer is.

use crate::gui::view_state::NoticeKind;
use crate::gui::{Command, Scene, ViewState, theme};

/// Shows the bar.
pub fn show(ui: &mut egui::Ui, scene: Scene<'_>, view: &ViewState, _commands: &mut Vec<Command>) {
    let p = theme::palette(ui.visuals());
    ui.horizontal_centered(|ui| match &view.notice {
        Some(n) => {
            let colour = if n.kind == NoticeKind::Refused { p.warn } else { p.good };
            ui.colored_label(colour, &n.text);
        }
        None => {
            let marked = scene.project.measured_count();
            ui.weak(format!(
                "{} of {} landmarks, {marked} points marked",
                scene.project.landmarks.len(),
                scene.face.landmarks().len()
            ));
        }
    });
}
