//! The dialogs inside the window.

use std::path::PathBuf;

use egui::{Id, RichText};

use super::{film_strip, key_settings, key_sheet};
use crate::gui::dialogs::Purpose;
use crate::gui::import_marks::ReadMarks;
use crate::gui::modal::Modal;
use crate::gui::new_frames::NewFrame;
use crate::gui::pictures::file_name;
use crate::gui::{Command, theme};
use crate::project::FrameRef;

/// Shows the open dialog; false when it is to be closed.
pub fn show(ctx: &egui::Context, modal: &mut Modal, commands: &mut Vec<Command>) -> bool {
    let mut close = false;
    // Esc may be for a key that is waited for.
    let waited = matches!(modal, Modal::SetKeys(view) if key_settings::waits_for_key(view));
    // Each dialog has its own place: the first sight of one is not that of the size of the one before.
    let id = Id::unique(("modal", title(modal)));
    let shown = egui::Modal::new(id).frame(theme::dialog_frame(&ctx.global_style())).show(ctx, |ui| {
        ui.set_width(match modal {
            Modal::Keys => 700.0,
            Modal::Film(_) => (ctx.content_rect().width() - 80.0).clamp(440.0, 1240.0),
            Modal::SetKeys(_) => 620.0,
            _ => 440.0,
        });
        ui.label(RichText::new(title(modal)).heading().strong());
        ui.add_space(6.0);
        close = match modal {
            Modal::Error { text, again, .. } => {
                ui.label(text.as_str());
                ui.add_space(8.0);
                ui.button(if again.is_some() { "Change the paths" } else { "Close" }).clicked()
            }
            Modal::OtherFrames(frames) => other_frames(ui, frames, commands),
            Modal::Unsaved(after) => {
                let choices = [Command::SaveThen(after.clone()), Command::Proceed(after.clone())];
                unsaved(ui, "The project has changes that are not saved.", choices, commands)
            }
            Modal::UnsavedFace(after) => {
                let choices = [Command::SaveFaceThen(after.clone()), Command::DropFace(after.clone())];
                unsaved(ui, "The face model has changes that are not saved.", choices, commands)
            }
            Modal::Recover { when, older } => {
                let file = if *older {
                    "The project's file was saved since, perhaps by another window."
                } else {
                    "It is newer than the project's file."
                };
                ui.label(format!("Work that was not saved was found{when}. {file}"));
                ui.add_space(8.0);
                let mut chosen = false;
                ui.horizontal(|ui| {
                    if primary(ui, "Recover it").clicked() || enter(ui) {
                        commands.push(Command::Recover(true));
                        chosen = true;
                    }
                    if ui.button("Throw it away").clicked() {
                        commands.push(Command::Recover(false));
                        chosen = true;
                    }
                });
                chosen
            }
            Modal::Spoilt { path, why, found } => {
                ui.label(why.as_str());
                ui.add_space(4.0);
                ui.label("The file stays as it is. This lies beside it and can be read:");
                ui.add_space(8.0);
                let mut chosen = false;
                for (i, (rescue, when)) in found.iter().enumerate() {
                    let label = format!("{}{when}", rescue.label());
                    if if i == 0 { primary(ui, &label) } else { ui.button(label) }.clicked() {
                        commands.push(Command::Rescue(path.clone(), *rescue));
                        chosen = true;
                    }
                }
                chosen | ui.button("Cancel").clicked()
            }
            Modal::Path { purpose, typed, focused } => path(ui, purpose, typed, focused, commands),
            Modal::Marks(read) => marks(ui, read, commands),
            Modal::Film(view) => film_strip::show(ui, view, commands),
            Modal::Keys => key_sheet::show(ui, commands),
            Modal::SetKeys(view) => key_settings::show(ui, view, commands),
            Modal::About => about(ui),
        };
    });
    // Unsaved work is never answered by a click beside the dialog.
    let leave = match modal {
        Modal::Recover { .. } | Modal::Spoilt { .. } => false,
        Modal::OtherFrames(_) => ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)),
        // Nor are two frames that were looked for.
        Modal::Film(_) => ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)),
        // Nor is a path that is half typed thrown away by one.
        Modal::Path { .. } => ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)),
        Modal::SetKeys(_) if waited => false,
        _ => shown.should_close(),
    };
    let closed = close || leave;
    if closed && let Modal::Film(view) = modal {
        view.looking().give_up();
    }
    if closed && let Modal::Error { again: Some(again), .. } = modal {
        commands.push(Command::Show((**again).clone()));
    }
    !closed
}

fn title(modal: &Modal) -> &str {
    match modal {
        Modal::Error { title, .. } => title,
        Modal::OtherFrames(_) => "Other pictures than those that were marked",
        Modal::Unsaved(_) | Modal::UnsavedFace(_) => "Save changes?",
        Modal::Recover { .. } => "Recover unsaved work?",
        Modal::Spoilt { .. } => "The project cannot be read",
        Modal::Path { purpose, .. } => purpose.title(),
        Modal::Marks(_) => "Import marks",
        Modal::Film(_) => "First and last frame",
        Modal::Keys => "Keys",
        Modal::SetKeys(_) => "Change keys",
        Modal::About => "Frontalis",
    }
}

/// What becomes of marks that were made on other pictures; true when one of the three was chosen.
fn other_frames(ui: &mut egui::Ui, frames: &[NewFrame], commands: &mut Vec<Command>) -> bool {
    for frame in frames {
        let FrameRef { width_px, height_px, .. } = frame.named;
        let name = file_name(&frame.path);
        ui.label(format!("{name}, {width_px} × {height_px} px, is to be the {} frame.", frame.which.word()));
    }
    ui.label("The marks of this project were made on another picture. A new project leaves it as it is.");
    ui.add_space(8.0);
    let mut chosen = false;
    ui.horizontal(|ui| {
        let new = primary(ui, "New project");
        if new.clicked() {
            commands.push(Command::NewProjectWith(frames.to_vec()));
            chosen = true;
        }
        let hint = "The same picture from another file, turned up or packed anew: the marks are in the same places.";
        let keep = ui.button("Keep the marks").on_hover_text(hint);
        let cancel = ui.button("Cancel");
        // The keyboard speaks to the three buttons alone: Enter takes the first, Tab goes on.
        if ![&new, &keep, &cancel].iter().any(|b| b.has_focus()) && !ui.is_sizing_pass() {
            new.request_focus();
        }
        if keep.clicked() {
            commands.push(Command::KeepMarks(frames.to_vec()));
            chosen = true;
        }
        chosen |= cancel.clicked();
    });
    chosen
}

/// What becomes of marks that were read; true when one of the three was chosen.
fn marks(ui: &mut egui::Ui, read: &ReadMarks, commands: &mut Vec<Command>) -> bool {
    let points = &read.import.points;
    let suggested = points.iter().filter(|p| p.suggestion().is_some()).count();
    let counted = if points.len() == 1 { "1 point".to_owned() } else { format!("{} points", points.len()) };
    ui.label(format!("{} holds {counted} of this face, {suggested} visible in the last frame.", read.name));
    let passed_over = &read.import.passed_over;
    if let Some(first) = passed_over.first() {
        let more = if passed_over.len() > 1 { format!(", and {} more", passed_over.len() - 1) } else { String::new() };
        ui.colored_label(ui.visuals().warn_fg_color, format!("Passed over: {first}{more}."));
    }
    ui.label("Marks that are there stay, whichever you choose.");
    ui.add_space(8.0);
    let mut chosen = false;
    ui.horizontal(|ui| {
        let suggest = primary_if(ui, suggested > 0, "Show as suggestions");
        if suggest.on_hover_text("Points of the last frame, each to be accepted by your hand.").clicked() {
            commands.push(Command::TakeMarks(read.clone(), false));
            chosen = true;
        }
        let accept = ui.button("Accept all");
        if accept.on_hover_text("Every point without a mark, landmarks too, in one step.").clicked() {
            commands.push(Command::TakeMarks(read.clone(), true));
            chosen = true;
        }
        chosen |= ui.button("Cancel").clicked();
    });
    chosen
}

/// Save, discard or cancel; true when one was chosen.
fn unsaved(ui: &mut egui::Ui, text: &str, [save, discard]: [Command; 2], commands: &mut Vec<Command>) -> bool {
    ui.label(text);
    ui.add_space(8.0);
    let mut chosen = false;
    ui.horizontal(|ui| {
        if primary(ui, "Save").clicked() {
            commands.push(save);
            chosen = true;
        }
        if ui.button("Discard").clicked() {
            commands.push(discard);
            chosen = true;
        }
        chosen |= ui.button("Cancel").clicked();
    });
    chosen
}

/// The button that goes on, grey while that is not possible.
pub(super) fn primary_if(ui: &mut egui::Ui, possible: bool, label: &str) -> egui::Response {
    ui.add_enabled_ui(possible, |ui| primary(ui, label)).inner
}

/// Whether Enter was pressed where no button has the keyboard: it means the one that goes on.
pub(super) fn enter(ui: &egui::Ui) -> bool {
    let free = ui.memory(|m| m.focused().is_none());
    free && ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Enter))
}

fn primary(ui: &mut egui::Ui, label: &str) -> egui::Response {
    let p = theme::palette(ui.visuals());
    ui.add(egui::Button::new(RichText::new(label).color(p.on_accent)).fill(p.accent))
}

/// Fields for paths, where the system has no file dialog of its own: `typed` holds a path a line.
fn path(
    ui: &mut egui::Ui,
    purpose: &Purpose,
    typed: &mut String,
    focused: &mut bool,
    commands: &mut Vec<Command>,
) -> bool {
    ui.label(purpose.how_to_type());
    ui.add_space(4.0);
    let names = purpose.paths();
    let mut lines: Vec<String> = typed.split('\n').map(str::to_owned).collect();
    lines.resize(names.len(), String::new());
    let mut enter = false;
    let mut fields = Vec::new();
    for (name, line) in names.iter().zip(&mut lines) {
        let label = ui.label(RichText::new(*name).weak());
        let hint = if *name == "Folder" { "/path/to/folder" } else { "/path/to/file" };
        let mut edit = egui::TextEdit::singleline(line).desired_width(f32::INFINITY).hint_text(hint).show(ui);
        let response = edit.response.response.labelled_by(label.id);
        // The first pass only measures the dialog.
        if !*focused && !ui.is_sizing_pass() {
            *focused = true;
            response.request_focus();
            edit.state.cursor.set_char_range(Some(egui::text::CCursorRange::select_all_str(line)));
            edit.state.store(ui.ctx(), response.id);
        }
        enter |= response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        fields.push(response);
    }
    *typed = lines.join("\n");
    ui.add_space(8.0);
    let files: Vec<PathBuf> = lines.iter().map(|l| l.trim()).filter(|l| !l.is_empty()).map(PathBuf::from).collect();
    let complete = files.len() == names.len();
    if enter
        && !complete
        && let Some((field, _)) = fields.iter().zip(&lines).find(|(_, line)| line.trim().is_empty())
    {
        field.request_focus();
    }
    let mut close = false;
    let word = if matches!(purpose, Purpose::SaveProject { .. } | Purpose::SaveFace { .. }) { "Save" } else { "Go on" };
    ui.horizontal(|ui| {
        let go_on = ui.add_enabled(complete, egui::Button::new(word)).clicked();
        if (go_on || enter) && complete {
            commands.push(Command::Typed(purpose.clone(), typed.clone()));
            commands.push(Command::FilesChosen(purpose.clone(), files));
            close = true;
        }
        close |= ui.button("Cancel").clicked();
    });
    close
}

fn about(ui: &mut egui::Ui) -> bool {
    ui.label(format!("Version {}", env!("CARGO_PKG_VERSION")));
    ui.label("Measures the muscle forces of a facial expression from its first and its last frame.");
    ui.label("The method is that of Ağdoğan's thesis (2015); every equation is listed in docs/equations.md.");
    ui.label(RichText::new("MIT or Apache-2.0").weak());
    ui.add_space(8.0);
    ui.button("Close").clicked()
}
