//! The point that is picked: what it is, what it would change in the open project, and the two maps that show it.

use egui::Ui;

use super::{StudyView, face_maps};
use crate::gui::action::Action;
use crate::gui::action_state::ActionState;
use crate::gui::height_map::quantity::Direction;
use crate::gui::height_map::range::range_of;
use crate::gui::height_map::{Exaggeration, Layer, Quantity, RangeMode};
use crate::gui::study_work::{Preview, StudyWork};
use crate::gui::{Command, Focus, Scene};
use crate::study::table::in_words;

/// A line about what is picked, with the button that applies it.
pub(super) fn line(ui: &mut Ui, work: &StudyWork, view: &StudyView, state: &ActionState, commands: &mut Vec<Command>) {
    let Some(picked) = &view.picked else { return };
    ui.horizontal_wrapped(|ui| {
        ui.strong(&picked.method);
        ui.label(in_words(&picked.setting));
        match work.preview() {
            Some(preview) => {
                let label = Action::ApplyStudy.label();
                let button = egui::Button::new(label);
                let tooltip = Action::ApplyStudy.spec().map_or("", |s| s.tooltip);
                if ui.add_enabled(state.can(Action::ApplyStudy), button).on_hover_text(tooltip).clicked() {
                    commands.push(Command::Do(Action::ApplyStudy));
                }
                ui.label(&preview.applied.words);
            }
            None => _ = ui.weak("This is no choice of a project: nothing of it can be applied here."),
        }
    });
    ui.separator();
}

/// The forces with the method that is picked, and how they differ from those of the project.
pub(super) fn maps(ui: &mut Ui, scene: Scene<'_>, preview: &Preview, view: &mut StudyView, focus: &mut Focus) {
    let of = |outcome| Layer::new(outcome, scene.face, Quantity::Magnitude, Direction::Up, None);
    let (now, with) = (of(scene.outcome), of(&preview.outcome));
    let change = changed(&now, &with);
    let first = scene.outcome.first_from_eyes(scene.face);
    let canvas = ui.available_rect_before_wrap();
    ui.advance_cursor_after_rect(canvas);
    let room = (canvas.width() / 2.0).floor();
    let halves = [
        egui::Rect::from_min_size(canvas.min, egui::vec2(room - 1.0, canvas.height())),
        egui::Rect::from_min_max(egui::pos2(canvas.left() + room, canvas.top()), canvas.max),
    ];
    let (mut orbit, mut kept) = (view.orbit, std::mem::take(&mut view.kept));
    // Forces and their change are of different size: each has its own bar.
    let lengths = range_of(RangeMode::Auto, &with, &|_| true);
    let scenes = [
        (halves[0], "Forces with this method", &with, lengths, Scene { outcome: &preview.outcome, ..scene }),
        (
            halves[1],
            "Change against the project as it is",
            &change,
            range_of(RangeMode::Auto, &change, &|_| true),
            scene,
        ),
    ];
    for (rect, title, layer, range, scene) in scenes {
        let shared = face_maps::Shared {
            scene,
            first: &first,
            in_view: &layer.values,
            options: &view.options,
            range,
            mm_per_unit: Exaggeration::Auto.mm_per_unit(range),
            fibres: &[],
            muscles: &[],
            chosen: None,
            selected: focus.selected_vertex().map(|v| v as usize),
        };
        let map = face_maps::Map { title, layer };
        let inner = egui::Rect::from_min_max(rect.min, egui::pos2(rect.right() - face_maps::BAR, rect.bottom()));
        face_maps::show(ui, inner, &map, &shared, &mut orbit, &mut kept, focus);
        face_maps::bar(ui, rect, layer, &view.options, range);
    }
    (view.orbit, view.kept) = (orbit, kept);
}

/// How much longer each force becomes; nothing where one of the two is unknown.
fn changed(now: &Layer, with: &Layer) -> Layer {
    let difference = |(a, b): (&Option<f64>, &Option<f64>)| Some((*b)? - (*a)?);
    Layer {
        title: "Change of the force".to_owned(),
        short: "Change",
        signed: true,
        values: now.values.iter().zip(&with.values).map(difference).collect(),
        sigma: None,
        ..with.clone()
    }
}
