//! The automatic choice: the accuracy that is wanted, the time that is allowed, what is chosen for each, and the button that applies it.

use egui::{DragValue, Ui};

use super::StudyView;
use super::plot::Chosen;
use super::shown::Shown;
use crate::export::study_ladder::goal_words;
use crate::gui::view_state::NoticeKind;
use crate::gui::{Command, Scene};
use crate::project::Edit;
use crate::study::applied::applied;
use crate::study::ladder::{Goal, Goals, choose};

/// Shows both goals of a ladder with what is chosen for them.
pub(super) fn show(ui: &mut Ui, scene: Scene<'_>, shown: &Shown, view: &mut StudyView, commands: &mut Vec<Command>) {
    if shown.rungs.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        let mut percent = 100.0 * view.goals.accuracy.unwrap_or(0.1);
        let field = DragValue::new(&mut percent).range(0.1..=1000.0).speed(1.0).max_decimals(1).suffix(" %");
        let label = ui.label("Accuracy wanted");
        let changed =
            ui.add(field).labelled_by(label.id).on_hover_text("Forces within so much of the truth, on 95 % of twins");
        if changed.changed() || view.goals.accuracy.is_none() {
            view.goals.accuracy = Some(percent / 100.0);
        }
        ui.add_space(12.0);
        let mut ms = view.goals.time_ms.unwrap_or(16.0);
        let field = DragValue::new(&mut ms).range(0.01..=10_000.0).speed(0.1).max_decimals(2).suffix(" ms");
        let label = ui.label("Time allowed");
        let changed = ui.add(field).labelled_by(label.id).on_hover_text("From a dragged point to the forces");
        if changed.changed() || view.goals.time_ms.is_none() {
            view.goals.time_ms = Some(ms);
        }
    });
    if shown.rungs.iter().all(|r| r.time_ms.is_none()) {
        ui.weak("The rungs are timed after all twins: the choice follows then.");
        return;
    }
    for goal in view.goals.all() {
        said(ui, scene, shown, goal, commands);
    }
    ui.separator();
}

fn said(ui: &mut Ui, scene: Scene<'_>, shown: &Shown, goal: Goal, commands: &mut Vec<Command>) {
    let choice = choose(goal, &shown.rungs, 1.0);
    ui.horizontal_wrapped(|ui| {
        if let Some(rung) = choice.picked.and_then(|k| shown.rungs.get(k)) {
            let now = &scene.project.settings;
            let applied = applied(&rung.method, &rung.setting, now);
            let tooltip =
                applied.as_ref().map_or("A project is solved on its own mesh: this cannot be applied", |a| &a.words);
            let new = applied.as_ref().filter(|a| a.settings != *now);
            let button = ui.add_enabled(new.is_some(), egui::Button::new("Apply"));
            let button = button.on_hover_text(tooltip).on_disabled_hover_text(tooltip);
            let words = format!("Apply what is chosen {}", goal_words(goal));
            button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, new.is_some(), &words));
            if let Some(applied) = new.filter(|_| button.clicked()) {
                commands.push(Command::Edit(Edit::SetSettings(applied.settings.clone())));
                commands.push(Command::Tell(NoticeKind::Done, applied.words.clone()));
            }
        }
        ui.label(choice.words(goal, &shown.rungs));
    });
}

/// The rungs that are chosen at the marking error shown, each once.
pub(super) fn chosen(shown: &Shown, goals: Goals) -> Vec<Chosen> {
    let noises = shown.rungs.iter().flat_map(|r| &r.noises);
    let Some(times) = noises.filter(|n| Some(n.noise_px) == shown.asked.noise).map(|n| n.times_stated).next() else {
        return Vec::new();
    };
    let mut all: Vec<Chosen> = Vec::new();
    for goal in goals.all() {
        let Some(rung) = choose(goal, &shown.rungs, times).picked.and_then(|k| shown.rungs.get(k)) else { continue };
        let words = goal_words(goal);
        match all.iter_mut().find(|c| c.method == rung.method && c.setting == rung.setting) {
            Some(same) => same.words = format!("{}, {words}", same.words),
            None => all.push(Chosen { method: rung.method.clone(), setting: rung.setting.clone(), words }),
        }
    }
    all
}
