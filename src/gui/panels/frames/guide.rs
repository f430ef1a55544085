//! The guide: which point comes next, where it lies on a face, and how to recognise it.

use egui::{ProgressBar, RichText, Vec2};

use super::points::{self, STILL_REGION};
use super::{FramesView, Tool, face_picture, marks};
use crate::gui::action_state::ActionState;
use crate::gui::face_drawing::FaceDrawing;
use crate::gui::{Action, Command, Focus, Scene, theme};
use crate::project::{PointId, Role};

/// The first landmark without a mark after `after` in the order of the face, starting over at the end. `after` itself
/// counts as marked.
pub fn next_unmarked_landmark(scene: Scene<'_>, after: Option<&str>) -> Option<String> {
    let all = scene.face.landmarks();
    let start = after.and_then(|id| all.iter().position(|l| l.id == id)).map_or(0, |i| i + 1);
    let mut from = all.iter().cycle().skip(start).take(all.len());
    from.find(|l| !scene.project.landmarks.contains_key(&l.id) && after != Some(l.id.as_str())).map(|l| l.id.clone())
}

/// The same for the chosen vertices in the last frame.
pub fn next_to_mark(scene: Scene<'_>, chosen: &[u32], after: Option<u32>) -> Option<u32> {
    let start = after.and_then(|v| chosen.iter().position(|&c| c == v)).map_or(0, |i| i + 1);
    let mut from = chosen.iter().cycle().skip(start).take(chosen.len());
    from.find(|&&v| scene.project.features.get(&v).is_none_or(|f| f.last.is_none()) && after != Some(v)).copied()
}

/// Shows the guide.
#[expect(clippy::too_many_arguments, reason = "what a panel may read, its own view, and the commands")]
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    drawing: &FaceDrawing,
    chosen: &[u32],
    view: &mut FramesView,
    focus: &mut Focus,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    ui.horizontal(|ui| {
        for action in [Action::ToolLandmarks, Action::ToolFeatures] {
            let on = state.on(action) == Some(true);
            if ui.add(egui::Button::selectable(on, action.label())).on_hover_text(tooltip(action)).clicked() {
                commands.push(Command::Do(if on { Action::ToolSelect } else { action }));
            }
        }
    });
    ui.add_space(4.0);
    let current = current_vertex(scene, chosen, view, focus);
    let pulses = matches!(view.tool, Tool::Landmarks | Tool::Features);
    let side = ui.available_width().min(300.0);
    face_picture::show(
        ui,
        Vec2::new(side, side * 0.98),
        scene,
        drawing,
        chosen,
        current,
        pulses,
        view.tool == Tool::Features,
        focus,
    );

    let (done, of, what) = match view.tool {
        Tool::Features => {
            let done =
                chosen.iter().filter(|v| scene.project.features.get(v).is_some_and(|f| f.last.is_some())).count();
            (done, chosen.len(), "points marked")
        }
        _ => (placed_landmarks(scene), scene.face.landmarks().len(), "landmarks placed"),
    };
    let share = if of == 0 { 0.0 } else { done as f32 / of as f32 };
    let bar = ProgressBar::new(share).desired_height(6.0).fill(theme::palette(ui.visuals()).accent);
    let bar = ui.add(bar);
    bar.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, format!("{done} of {of} {what}"))
    });
    ui.label(RichText::new(format!("{done} of {of} {what}")).small().weak());
    describe(ui, scene, view, focus, current, done == of);
    ui.horizontal(|ui| {
        for (action, label) in
            [(Action::Previous, "Back"), (Action::Next, "Skip"), (Action::Accept, "Accept prediction")]
        {
            let button = ui.add_enabled(state.can(action), egui::Button::new(label));
            if button.on_hover_text(tooltip(action)).clicked() {
                commands.push(Command::Do(action));
            }
        }
    });
    ui.add_space(6.0);
    ui.separator();
    regions(ui, scene, view);
    ui.add_space(2.0);
    egui::CollapsingHeader::new("Legend").default_open(true).show(ui, marks::legend_ui);
}

fn tooltip(action: Action) -> String {
    let key = action.key_text().map(|k| format!(" ({k})")).unwrap_or_default();
    format!("{}{key}", action.spec().map_or("", |s| s.tooltip))
}

fn placed_landmarks(scene: Scene<'_>) -> usize {
    scene.face.landmarks().iter().filter(|l| scene.project.landmarks.contains_key(&l.id)).count()
}

/// The vertex that the guide speaks of: the selected point's, or the next to place.
fn current_vertex(scene: Scene<'_>, chosen: &[u32], view: &FramesView, focus: &Focus) -> Option<u32> {
    if let Some(id) = &focus.selected {
        return points::place(scene, id).map(|(_, v)| v);
    }
    match view.tool {
        Tool::Features => next_to_mark(scene, chosen, None),
        _ => next_unmarked_landmark(scene, None).and_then(|id| scene.face.landmark(&id)).map(|l| l.vertex),
    }
}

fn describe(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    view: &FramesView,
    focus: &Focus,
    current: Option<u32>,
    complete: bool,
) {
    // A fixed height, so that the buttons under it do not jump from one point to the next.
    ui.allocate_ui(Vec2::new(ui.available_width(), 58.0), |ui| {
        ui.set_min_height(58.0);
        let selected_landmark = match &focus.selected {
            Some(PointId::Landmark(id)) => scene.face.landmark(id),
            Some(_) => None,
            None if view.tool == Tool::Features => None,
            None => current.and_then(|v| scene.face.landmarks().iter().find(|l| l.vertex == v)),
        };
        match (selected_landmark, current) {
            _ if complete && focus.selected.is_none() => {
                let text = if view.tool == Tool::Features {
                    "All chosen points are marked."
                } else {
                    "All landmarks are placed."
                };
                ui.colored_label(theme::palette(ui.visuals()).good, text);
            }
            (Some(l), _) => {
                ui.label(RichText::new(&l.name).strong().size(14.0));
                ui.label(RichText::new(&l.hint).weak());
            }
            (None, Some(v)) => {
                let kind = points::kind_of(scene, v);
                let region = scene.face.regions().iter().find(|r| r.vertices.contains(&v));
                let place = region.map(|r| format!(", {}", words(&r.id))).unwrap_or_default();
                ui.label(RichText::new(format!("{} {v}{place}", capital(kind.word()))).strong().size(14.0));
                ui.label(RichText::new("Find the same spot of skin in the last frame.").weak());
            }
            (None, None) => _ = ui.label(RichText::new("Nothing is left to place.").weak()),
        }
    });
}

fn regions(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut FramesView) {
    ui.label(RichText::new("Points to mark").strong());
    for region in scene.face.regions() {
        // A still point counts with the still points alone, even where it lies in a region of moving skin.
        let (mut marked, mut of) = (0, 0);
        for v in &region.vertices {
            if (points::kind_of(scene, *v) == points::Kind::Still) == (region.id == STILL_REGION) {
                of += 1;
                marked += usize::from(scene.project.features.get(v).is_some_and(|f| f.last.is_some()));
            }
        }
        let mut ticked = view.regions.contains(&region.id);
        ui.horizontal(|ui| {
            let mut name = capital(&words(&region.id));
            if region.id == STILL_REGION {
                name.push_str(" points");
            }
            if ui.checkbox(&mut ticked, name).changed() {
                if ticked {
                    view.regions.insert(region.id.clone());
                } else {
                    view.regions.remove(&region.id);
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(RichText::new(format!("{marked}/{of}")).weak());
            });
        });
    }
    let still = scene.project.features.values().filter(|f| f.role == Role::Still && f.last.is_some()).count();
    let needed = format!("{still} still points marked; 3 remove the head's motion, 4 also tell the noise floor.");
    ui.label(RichText::new(needed).small().weak());
}

/// "forehead_and_brows" as "forehead and brows".
fn words(id: &str) -> String {
    id.replace('_', " ")
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_uppercase().chain(chars).collect()).unwrap_or_default()
}
