//! The row above the charts: what is studied, on which face, start and stop, and how far it is.

use egui::{ComboBox, ProgressBar, Ui};

use super::StudyView;
use crate::gui::Command;
use crate::gui::action::Action;
use crate::gui::action_state::ActionState;
use crate::gui::panels::name_combo;
use crate::gui::study_work::StudyWork;
use crate::study::Kind;

/// Shows the row; it wraps where the window is narrow.
pub(super) fn show(
    ui: &mut Ui,
    work: &StudyWork,
    view: &mut StudyView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        ui.add_enabled_ui(work.is_free(), |ui| {
            ui.horizontal(|ui| {
                let label = view.kind.label();
                let combo = ComboBox::from_id_salt("study").width(120.0).selected_text(label).show_ui(ui, |ui| {
                    for kind in Kind::ALL {
                        ui.selectable_value(&mut view.kind, kind, kind.label()).on_hover_text(kind.asks());
                    }
                });
                name_combo(&combo.response, "Study", label);
                combo.response.on_hover_text(view.kind.asks());
                ui.checkbox(&mut view.quick, "Quick").on_hover_text("Coarser, with fewer seeds: a first look");
                ui.checkbox(&mut view.own_face, "This face").on_hover_text(
                    "Measure on the face of this project, customised to its landmarks, instead of the generic one",
                );
                let mut own = view.seeds.is_some();
                if ui.checkbox(&mut own, "Seeds").on_hover_text("Your own number of seeds").changed() {
                    view.seeds = own.then_some(5);
                }
                if let Some(seeds) = &mut view.seeds {
                    ui.add(egui::DragValue::new(seeds).range(1..=1000));
                }
            });
        });
        ui.separator();
        if work.is_running() {
            button(ui, Action::StopStudy, state, commands);
        } else {
            let words = if work.stopped().is_some() { "Go on" } else { "Start" };
            let spec = Action::StartStudy.spec().map_or("", |s| s.tooltip);
            if ui.add_enabled(work.is_free(), egui::Button::new(words)).on_hover_text(spec).clicked() {
                commands.push(Command::Do(Action::StartStudy));
            }
            if work.stopped().is_some() {
                button(ui, Action::StartStudyAnew, state, commands);
            }
        }
        button(ui, Action::OpenStudy, state, commands);
        button(ui, Action::ExportStudy, state, commands);
        if let Some(p) = work.progress() {
            ui.separator();
            let words = format!("{} of {} cases{}", p.finished, p.of, p.left_in_words());
            ui.add(ProgressBar::new(p.share as f32).desired_width(150.0).show_percentage());
            ui.label(words);
        } else if let Some(p) = work.stopped() {
            ui.separator();
            let after = if work.is_free() { "" } else { " Finishing its case…" };
            ui.label(format!("Stopped at {} of {} cases.{after}", p.finished, p.of));
        } else if work.is_running() {
            ui.spinner();
        }
    });
    ui.add_space(3.0);
}

fn button(ui: &mut Ui, action: Action, state: &ActionState, commands: &mut Vec<Command>) {
    let tooltip = action.spec().map_or("", |s| s.tooltip);
    let button = egui::Button::new(action.label());
    if ui.add_enabled(state.can(action), button).on_hover_text(tooltip).clicked() {
        commands.push(Command::Do(action));
    }
}
