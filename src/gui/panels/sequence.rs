//! Choosing the first and the last frame of a folder of numbered pictures.

use egui::{RichText, ScrollArea, Slider};

use crate::frames::FrameSequence;
use crate::gui::pictures::file_name;
use crate::gui::{Command, theme};
use crate::project::Which;

/// The folder while it is being chosen from.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceView {
    names: Vec<std::path::PathBuf>,
    first: usize,
    last: usize,
}

impl SequenceView {
    /// Begins with what the folder proposes.
    pub fn new(sequence: &FrameSequence) -> Self {
        Self { names: sequence.paths().to_vec(), first: sequence.first(), last: sequence.last() }
    }
}

/// Shows the choice; true when it is to be closed.
pub fn show(ui: &mut egui::Ui, view: &mut SequenceView, commands: &mut Vec<Command>) -> bool {
    let end = view.names.len().saturating_sub(1);
    ui.label(format!("{} pictures, in the order of their numbers.", view.names.len()));
    ui.spacing_mut().slider_width = 300.0;
    ui.add(Slider::new(&mut view.first, 0..=end).text("First frame (neutral)"));
    ui.add(Slider::new(&mut view.last, 0..=end).text("Last frame (apex)"));
    ui.add_space(4.0);
    let accent = theme::palette(ui.visuals()).accent;
    ScrollArea::vertical().max_height(240.0).auto_shrink([false, true]).show_rows(
        ui,
        22.0,
        view.names.len(),
        |ui, rows| {
            for i in rows {
                ui.horizontal(|ui| {
                    ui.push_id(i, |ui| {
                        ui.radio_value(&mut view.first, i, "first");
                        ui.radio_value(&mut view.last, i, "last");
                    });
                    let text = RichText::new(view.names.get(i).map(|p| file_name(p)).unwrap_or_default());
                    ui.label(if i == view.first || i == view.last { text.color(accent) } else { text });
                });
            }
        },
    );
    let same = view.first == view.last;
    if same {
        ui.colored_label(ui.visuals().warn_fg_color, "The first and the last frame must be different pictures.");
    }
    let mut close = false;
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        if ui.add_enabled(!same, egui::Button::new("Use these frames")).clicked() {
            for (which, at) in [(Which::First, view.first), (Which::Last, view.last)] {
                if let Some(path) = view.names.get(at) {
                    commands.push(Command::LoadFrame(which, path.clone()));
                }
            }
            close = true;
        }
        close |= ui.button("Cancel").clicked();
    });
    close
}
