//! The guide: which point comes next, where it lies on a face, and how to recognise it.

use egui::{ProgressBar, RichText, Vec2};

use super::points::{self, STILL_REGION};
use super::{FramesView, Tool, face_picture, marks, suggestions};
use crate::draw::words::capital;
use crate::gui::action_state::ActionState;
use crate::gui::face_drawing::FaceDrawing;
use crate::gui::keys::{self, KeyMap};
use crate::gui::suggesting::crossing_words;
use crate::gui::{Action, Command, Focus, Scene, theme};
use crate::project::{PointId, Role};

/// Height of what is said of a point, ui points.
const TEXT: f32 = 84.0;

/// What is said where a press finds the guide at its end.
pub const NOTHING_ASKED: &str =
    "The guide is at the end of its list and asks for nothing: choose Mark them or Done, or select a point.";

/// The first landmark without a mark after `after` in the order of the face; it never starts over.
pub fn next_unmarked_landmark(scene: Scene<'_>, after: Option<&str>) -> Option<String> {
    let all = scene.face.landmarks();
    let start = after.and_then(|id| all.iter().position(|l| l.id == id)).map_or(0, |i| i + 1);
    all.iter().skip(start).find(|l| !scene.project.landmarks.contains_key(&l.id)).map(|l| l.id.clone())
}

/// The same for the chosen vertices in the last frame.
pub fn next_to_mark(scene: Scene<'_>, chosen: &[u32], after: Option<u32>) -> Option<u32> {
    let start = after.and_then(|v| chosen.iter().position(|&c| c == v)).map_or(0, |i| i + 1);
    let unmarked = |v: &&u32| scene.project.features.get(v).is_none_or(|f| f.last.is_none());
    chosen.iter().skip(start).find(unmarked).copied()
}

/// The point that the guide asks for after this one was placed; none at the end of its list.
pub fn next_after(scene: Scene<'_>, chosen: &[u32], id: &PointId) -> Option<PointId> {
    match id {
        PointId::Landmark(id) => next_unmarked_landmark(scene, Some(id)).map(PointId::Landmark),
        PointId::FeatureFirst(v) | PointId::FeatureLast(v) => {
            next_to_mark(scene, chosen, Some(*v)).map(PointId::FeatureLast)
        }
    }
}

/// The point that the guide asks for: the selected one, in whichever frame and by whichever name it was selected. None while nothing
/// is placed, and at the end of the list.
///
/// # Errors
/// The selected landmark is not among the points to mark: one line.
pub fn asked(
    scene: Scene<'_>,
    chosen: &[u32],
    tool: Tool,
    selected: Option<&PointId>,
) -> Result<Option<PointId>, String> {
    match (tool, selected) {
        (Tool::Landmarks, Some(id @ PointId::Landmark(_))) => Ok(Some(id.clone())),
        (Tool::Landmarks, Some(_)) => Ok(next_unmarked_landmark(scene, None).map(PointId::Landmark)),
        (Tool::Features, Some(PointId::FeatureFirst(v) | PointId::FeatureLast(v))) => {
            Ok(Some(PointId::FeatureLast(*v)))
        }
        (Tool::Features, Some(id @ PointId::Landmark(name))) => match points::place(scene, id) {
            Some((_, v)) if chosen.contains(&v) => Ok(Some(PointId::FeatureLast(v))),
            _ => Err(format!("{name} is not among the points to mark. Select a feature point.")),
        },
        _ => Ok(None),
    }
}

/// The point that *Uncertain* speaks of: the selected one, or, while the guide asks for a point without a mark, the one placed last.
pub fn in_doubt(scene: Scene<'_>, view: &FramesView, selected: Option<&PointId>) -> Option<PointId> {
    let has_mark = |id: &&PointId| crate::project::edit::mark(scene.project, id).is_some();
    let placed = view.placed.as_ref().filter(|_| matches!(view.tool, Tool::Landmarks | Tool::Features));
    selected.filter(has_mark).or(placed.filter(has_mark)).cloned()
}

/// How many points of a guided tool are marked, of how many.
pub fn progress(scene: Scene<'_>, chosen: &[u32], tool: Tool) -> (usize, usize) {
    if tool == Tool::Features {
        let marked = |v: &&u32| scene.project.features.get(v).is_some_and(|f| f.last.is_some());
        return (chosen.iter().filter(marked).count(), chosen.len());
    }
    let all = scene.face.landmarks();
    (all.iter().filter(|l| scene.project.landmarks.contains_key(&l.id)).count(), all.len())
}

/// What a press does now, in a few words for the pane it does it in: "press places: Tip of the nose".
pub fn what_a_press_does(scene: Scene<'_>, chosen: &[u32], view: &FramesView, focus: &Focus) -> Option<String> {
    match (view.tool, asked(scene, chosen, view.tool, focus.selected.as_ref()).ok().flatten()) {
        (Tool::Landmarks | Tool::Features, None) => Some("end of the list".to_owned()),
        (Tool::Landmarks, Some(PointId::Landmark(id))) => {
            let name = scene.face.landmark(&id).map_or(id.as_str(), |l| l.name.as_str());
            Some(format!("press places: {name}"))
        }
        (Tool::Features, Some(PointId::FeatureLast(v))) => {
            Some(format!("press marks: {} {v}", points::kind_of(scene, v).word()))
        }
        _ => None,
    }
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
    let keys = keys::of(ui.ctx());
    // One of the three is always on, and a second click leaves it on: nothing is switched off in silence.
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (action, label) in [
            (Action::ToolSelect, "Select"),
            (Action::ToolLandmarks, Action::ToolLandmarks.label()),
            (Action::ToolFeatures, Action::ToolFeatures.label()),
        ] {
            let on = state.on(action) == Some(true);
            if ui.add(egui::Button::selectable(on, label)).on_hover_text(keys.tooltip(action)).clicked() {
                commands.push(Command::Do(action));
            }
        }
    });
    ui.add_space(4.0);
    let asked = asked(scene, chosen, view.tool, focus.selected.as_ref()).ok().flatten();
    let spoken_of = asked.or_else(|| focus.selected.clone().filter(|_| view.tool == Tool::Select));
    let current = spoken_of.as_ref().and_then(|id| points::place(scene, id)).map(|(_, v)| v);
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

    let (done, of) = progress(scene, chosen, view.tool);
    let what = if view.tool == Tool::Features { "points marked" } else { "landmarks placed" };
    let share = if of == 0 { 0.0 } else { done as f32 / of as f32 };
    let bar = ProgressBar::new(share).desired_height(6.0).fill(theme::palette(ui.visuals()).accent);
    let bar = ui.add(bar);
    bar.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, format!("{done} of {of} {what}"))
    });
    ui.label(RichText::new(format!("{done} of {of} {what}")).small().weak());
    // Above the text, whose length they must not follow.
    ui.horizontal(|ui| {
        for (action, label) in [(Action::Previous, "Back"), (Action::Next, "Skip"), (Action::Accept, "Accept place")] {
            let button = ui.add_enabled(pulses && state.can(action), egui::Button::new(label));
            if button.on_hover_text(keys.tooltip(action)).clicked() {
                commands.push(Command::Do(action));
            }
        }
    });
    // Of a height that holds nearly every text, so that what is under it seldom moves.
    ui.allocate_ui(Vec2::new(ui.available_width(), TEXT), |ui| {
        ui.set_min_height(TEXT);
        match (view.tool, &spoken_of) {
            (_, Some(id)) => describe(ui, scene, &keys, view.tool, id),
            (Tool::Landmarks | Tool::Features, None) => at_end(ui, view.tool, done, of, commands),
            _ => {
                ui.label(RichText::new("Nothing is being placed.").strong().size(14.0));
                let how = "A press selects, a drag moves. Choose above what to place.";
                ui.label(RichText::new(how).weak());
            }
        }
    });
    ui.add_space(6.0);
    ui.separator();
    suggestions::show(ui, scene, chosen, view, state, commands);
    ui.separator();
    regions(ui, scene, view, state, commands);
    ui.add_space(2.0);
    egui::CollapsingHeader::new("Legend").default_open(true).show(ui, marks::legend_ui);
}

/// The point that the guide speaks of: its name, how to find it, and what a press does.
fn describe(ui: &mut egui::Ui, scene: Scene<'_>, keys: &KeyMap, tool: Tool, id: &PointId) {
    let look = points::of(scene, id).map_or(points::Look::Unset, |(look, _)| look);
    let (name, hint) = match id {
        PointId::Landmark(id) => {
            let l = scene.face.landmark(id);
            (l.map_or_else(|| id.clone(), |l| l.name.clone()), l.map_or("", |l| l.hint.as_str()))
        }
        PointId::FeatureFirst(v) | PointId::FeatureLast(v) => {
            let region = scene.face.regions().iter().find(|r| r.vertices.contains(v));
            let place = region.map(|r| format!(", {}", words(&r.id))).unwrap_or_default();
            let hint = if tool == Tool::Features { "Press the same spot of skin in the last frame." } else { "" };
            (format!("{} {v}{place}", capital(points::kind_of(scene, *v).word())), hint)
        }
    };
    ui.label(RichText::new(name).strong().size(14.0));
    if tool == Tool::Select {
        let how = if look.is_mark() { "drag it, or nudge it with the arrows." } else { "drag it to mark it." };
        ui.label(RichText::new(format!("{}: {how}", capital(look.word()))).weak());
        return;
    }
    ui.label(RichText::new(hint).weak());
    let accept = keys.text(Action::Accept).unwrap_or_else(|| "Accept place".to_owned());
    let how = match look {
        points::Look::Locked => {
            format!("It is locked. {} frees it.", keys.text(Action::Lock).unwrap_or_else(|| "Lock".to_owned()))
        }
        look if look.is_mark() => "It has its mark: a press places it anew.".to_owned(),
        points::Look::Predicted => format!("{accept} takes the predicted place. Ctrl+press takes another point."),
        points::Look::Suggested => format!("{accept} takes the suggested place. Ctrl+press takes another point."),
        points::Look::Unset => "Ctrl+press takes another point.".to_owned(),
        _ => String::new(),
    };
    let suggested = points::place(scene, id).and_then(|(_, v)| points::suggestion(scene, v));
    if let PointId::FeatureFirst(v) | PointId::FeatureLast(v) = id
        && let Some(crossing) = points::crossing_of(scene, *v)
    {
        let words = format!("On the painted grid: {}.", crossing_words(crossing));
        ui.label(RichText::new(words).weak())
            .on_hover_text("Counted from the top and from the left, from 0, as in files.");
    }
    let how = match suggested.filter(|_| look == points::Look::Suggested) {
        Some(s) => {
            format!("{how} It is {} sure to be within 1 px ({}).", points::percent(s.confidence), s.method.word())
        }
        None => how,
    };
    ui.label(RichText::new(how).weak().small());
}

/// The end of the list: what was skipped can be gone through again.
fn at_end(ui: &mut egui::Ui, tool: Tool, done: usize, of: usize, commands: &mut Vec<Command>) {
    let (again, all, action) = match tool {
        Tool::Features => ("Mark them", "All chosen points are marked.", Action::ToolFeatures),
        _ => ("Place them", "All landmarks are placed.", Action::ToolLandmarks),
    };
    let good = theme::palette(ui.visuals()).good;
    if of == 0 {
        ui.label(RichText::new("No points are chosen: tick below what is to be marked.").weak());
    } else if done == of {
        ui.colored_label(good, all);
    } else {
        ui.colored_label(good, format!("The list is at its end: {} skipped.", of - done));
    }
    ui.horizontal(|ui| {
        if done < of && ui.button(again).clicked() {
            commands.push(Command::Do(action));
        }
        if ui.button("Done").clicked() {
            commands.push(Command::Do(Action::ToolSelect));
        }
    });
}

fn regions(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    view: &mut FramesView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    ui.label(RichText::new("Points to mark").strong());
    for region in points::regions_in_order(scene) {
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
                ui.add_space(8.0);
                ui.label(RichText::new(format!("{marked}/{of}")).weak());
            });
        });
    }
    suggestions::still(ui, scene, state, commands);
    let still = scene.project.features.values().filter(|f| f.role == Role::Still && f.last.is_some()).count();
    let needed = format!("{still} still points marked; 3 remove the head's motion, 4 also tell the noise floor.");
    ui.label(RichText::new(needed).small().weak());
}

/// "forehead_and_brows" as "forehead and brows".
fn words(id: &str) -> String {
    id.replace('_', " ")
}
