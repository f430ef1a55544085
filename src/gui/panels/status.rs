//! The status bar: what was last said, what is going on, and where the pointer is.

use std::time::Duration;

use egui::{ProgressBar, RichText};

use super::frames::SideTab;
use super::frames::{Tool, guide, points};
use crate::displacement::VertexState;
use crate::gui::height_map::options::{fixed, with_error};
use crate::gui::jobs::{About, Job, Jobs};
use crate::gui::keys::{self, KeyMap};
use crate::gui::suggesting::{crossing_words, to_accept};
use crate::gui::view_state::{NoticeKind, Workspace};
use crate::gui::{Action, Command, Scene, ViewState, theme};
use crate::project::Which;

/// Side of the sign that something is under way, ui points.
const SPINNER: f32 = 14.0;

/// Shows the bar.
pub fn show(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut ViewState, jobs: &Jobs, commands: &mut Vec<Command>) {
    let p = theme::palette(ui.visuals());
    ui.horizontal_centered(|ui| {
        if let Some(n) = &view.notice {
            let colour = if n.kind == NoticeKind::Refused { p.warn } else { p.good };
            ui.colored_label(colour, &n.text);
        } else if let Some(press) = press_now(scene, view, &keys::of(ui.ctx())) {
            ui.label(press);
        } else {
            let marked = scene.project.measured_count();
            let (placed, of) = (scene.project.landmarks.len(), scene.face.landmarks().len());
            ui.label(RichText::new(format!("{placed} of {of} landmarks, {marked} points marked")).weak());
        }
        for job in jobs.running().iter().filter(|j| told(j)) {
            ui.separator();
            // No higher than the words: a bar that grows would move the panes under the pointer.
            ui.add(egui::Spinner::new().size(SPINNER));
            ui.label(&job.name);
            let share = job.progress.share();
            if share > 0.0 {
                ui.add(ProgressBar::new(share).desired_width(80.0).desired_height(6.0));
            }
            if ui.small_button("Stop").clicked() {
                commands.push(Command::CancelJob(job.id));
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let count = scene.outcome.warnings.len();
            if count > 0 {
                let text = if count == 1 { "1 warning".to_owned() } else { format!("{count} warnings") };
                let button = egui::Button::new(RichText::new(text).color(p.warn)).frame_when_inactive(false).small();
                let first = scene.outcome.warnings[0].to_string();
                if ui.add(button).on_hover_text(first).clicked() {
                    view.frames.side = SideTab::Results;
                    view.workspace = Workspace::Frames;
                }
                ui.separator();
            }
            if let Some(text) = under_pointer(ui, scene, view) {
                // What stands at the left needs its room: the rest is cut.
                ui.add(egui::Label::new(RichText::new(text).monospace().size(11.5).weak()).truncate());
            }
        });
    });
}

/// Whether a work is told of: suggestions are made anew after every mark, and that need not flicker by unless it takes long.
fn told(job: &Job) -> bool {
    !matches!(
        job.about,
        About::Suggestions
            | About::Field
            | About::Muscles
            | About::Subjects
            | About::Replay
            | About::Expressions
            | About::Skin
    ) || job.began.elapsed() > Duration::from_millis(500)
}

/// What a press does, while a guide asks for points.
fn press_now(scene: Scene<'_>, view: &ViewState, keys: &KeyMap) -> Option<String> {
    if view.workspace != Workspace::Frames {
        return None;
    }
    let chosen = points::chosen_vertices(scene, &view.frames.regions);
    let press = guide::what_a_press_does(scene, &chosen, &view.frames, &view.focus)?;
    let frame = if view.frames.tool == Tool::Landmarks { "First frame" } else { "Last frame" };
    // Only where there is a place to take: a locked point, or one without a prediction, has none.
    let asked = guide::asked(scene, &chosen, view.frames.tool, view.focus.selected.as_ref()).ok().flatten();
    let takes = to_accept(scene, view, asked).and_then(|id| points::of(scene, &id)).map(|(look, _)| look.word());
    let accept = takes.zip(keys.text(Action::Accept)).map(|(look, key)| format!("   ·   {key}: its {look} place"));
    let accept = accept.unwrap_or_default();
    Some(format!("{frame}: {press}{accept}   ·   Ctrl+press: another point"))
}

/// The pixel under the pointer, or the vertex with its force.
fn under_pointer(ui: &egui::Ui, scene: Scene<'_>, view: &ViewState) -> Option<String> {
    let mut parts = Vec::new();
    if let Some(v) = view.focus.hovered() {
        let i = v as usize;
        let state = scene.outcome.states.get(i).copied().unwrap_or_default();
        parts.push(format!("vertex {v} ({}, {})", points::kind_of(scene, v).word(), state.word()));
        if matches!(state, VertexState::Measured | VertexState::Inferred)
            && let (Some(f), Some(s)) = (scene.outcome.field.force.get(i), scene.outcome.field.sigma.get(i))
        {
            parts.push(format!("{} {}", with_error(f.norm(), Some(*s)), scene.outcome.unit()));
        }
    }
    let pointer = ui.input(|i| i.pointer.hover_pos())?;
    for which in [Which::First, Which::Last] {
        let frames = &scene.project.frames;
        let named = if which == Which::First { &frames.first } else { &frames.last };
        let pane = &view.frames.panes[which as usize];
        if named.is_none() {
            continue;
        }
        if view.workspace == Workspace::Frames && pane.rect.contains(pointer) {
            let [x, y] = pane.view.at(pane.rect).image_from_ui(pointer);
            // As near as a hand points: a few points of the screen.
            if let Some(crossing) = scene.suggested.crossing_at(which, [x, y], 6.0 / pane.view.zoom.max(0.01)) {
                parts.push(format!("crossing {}", crossing_words(crossing)));
            }
            parts.push(format!(
                "{} {}, {} px   {:.0} %",
                which.word(),
                fixed(x, 2),
                fixed(y, 2),
                pane.view.zoom * 100.0
            ));
        }
    }
    (!parts.is_empty()).then(|| parts.join("   "))
}
