//! What a press, a drag and a release on a frame do: place the next point, move a point, or select one.

use egui::{Key, Pos2, Response};

use super::guide::{next_to_mark, next_unmarked_landmark};
use super::pane::{Pane, REACH};
use super::points::{Kind, Look};
use super::{FramesView, Tool};
use crate::camera::Scale;
use crate::gui::view_state::NoticeKind;
use crate::gui::{Command, Focus};
use crate::project::{Edit, PointId, Role, Which};

/// How far the pointer must go before a press on a point becomes a drag, ui points: a click that selects moves nothing.
const THRESHOLD: f32 = 3.0;

/// Share of the pointer's motion that a point follows while Shift is held.
const FINE: f64 = 0.2;

/// A point in the hand.
#[derive(Clone, Debug)]
pub struct Drag {
    /// In which frame.
    pub which: Which,
    /// What is dragged.
    pub target: Target,
    /// Where it is now, px.
    pub at: [f64; 2],
    /// Whether the point follows already.
    pub began: bool,
    /// Whether the release goes on to the next point.
    places: bool,
    pressed_at: Pos2,
    last: Pos2,
}

/// What is dragged.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A point of the project.
    Point(PointId),
    /// One of the two ends of the scale.
    ScaleEnd(usize),
}

/// Handles the pointer on a pane.
pub fn handle(
    ui: &egui::Ui,
    response: &Response,
    pane: &Pane<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    focus: &Focus,
    commands: &mut Vec<Command>,
) {
    let (pressed, down, pointer, shift, escape) = ui.input(|i| {
        let p = &i.pointer;
        (p.primary_pressed(), p.primary_down(), p.latest_pos(), i.modifiers.shift, i.key_pressed(Key::Escape))
    });
    if pressed && response.contains_pointer() && view.drag.is_none() {
        view.active = pane.which;
        response.request_focus();
        if let Some(at) = pointer {
            press(at, pane, chosen, view, focus, commands);
        }
    } else if response.double_clicked()
        && view.tool == Tool::Select
        && pointer.is_some_and(|p| pane.nearest(p).is_none())
    {
        view.fit();
    }
    if response.secondary_clicked()
        && let Some(point) = pointer.and_then(|p| pane.nearest(p))
    {
        commands.push(Command::Select(Some(point.id.clone())));
    }
    if view.drag.as_ref().is_some_and(|d| d.which == pane.which) {
        follow(Hand { down, pointer, shift, escape }, pane, chosen, view, commands);
    }
}

fn press(at: Pos2, pane: &Pane<'_>, chosen: &[u32], view: &mut FramesView, focus: &Focus, commands: &mut Vec<Command>) {
    let in_image = pane.transform.image_from_ui(at);
    if let Tool::ScalePoints { grid, first } = view.tool {
        if pane.which == Which::First {
            scale_press(grid, first, in_image, pane, view, commands);
        }
        return;
    }
    let hit = pane.nearest(at);
    // A mark under the pointer is moved, whatever the tool: nobody places two points on one place.
    if let Some(point) = hit.filter(|p| p.look.is_mark()) {
        commands.push(Command::Select(Some(point.id.clone())));
        if point.look == Look::Locked {
            commands
                .push(Command::Tell(NoticeKind::Refused, format!("{} is locked. Press L to free it.", point.label)));
        } else {
            view.drag = Some(Drag::take(pane.which, Target::Point(point.id.clone()), point.at, at));
        }
        return;
    }
    if let Some(end) = scale_end(at, pane) {
        view.drag = Some(Drag::take(pane.which, Target::ScaleEnd(end.0), end.1, at));
        return;
    }
    let placed = match (view.tool, pane.which) {
        (Tool::Landmarks, Which::First) => current_landmark(pane, focus),
        (Tool::Features, Which::Last) => hit.map(|p| p.id.clone()).or_else(|| current_feature(pane, chosen, focus)),
        _ => None,
    };
    if let Some(id) = placed {
        commands.push(Command::BeginGesture);
        commands.push(Command::Select(Some(id.clone())));
        put(&id, in_image, pane, commands);
        let drag = Drag::take(pane.which, Target::Point(id), in_image, at);
        view.drag = Some(Drag { began: true, places: true, ..drag });
    } else if let Some(point) = hit {
        commands.push(Command::Select(Some(point.id.clone())));
        view.drag = Some(Drag::take(pane.which, Target::Point(point.id.clone()), point.at, at));
    } else {
        commands.push(Command::Select(None));
    }
}

impl Drag {
    fn take(which: Which, target: Target, at: [f64; 2], pressed_at: Pos2) -> Self {
        Self { which, target, at, began: false, places: false, pressed_at, last: pressed_at }
    }
}

/// What the hand does in this frame.
#[derive(Clone, Copy)]
struct Hand {
    down: bool,
    pointer: Option<Pos2>,
    shift: bool,
    escape: bool,
}

fn follow(
    Hand { down, pointer, shift, escape }: Hand,
    pane: &Pane<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    commands: &mut Vec<Command>,
) {
    let Some(mut drag) = view.drag.take() else { return };
    if escape {
        if drag.began {
            commands.push(Command::CancelGesture);
        }
        return;
    }
    if let Some(pointer) = pointer {
        let far = drag.pressed_at.distance(pointer) >= THRESHOLD;
        // A place that was just given follows the hand only once the hand means it.
        let still_placing = drag.places && drag.last == drag.pressed_at;
        if far && !drag.began {
            commands.push(Command::BeginGesture);
            drag.began = true;
        }
        if drag.began && drag.last != pointer && (far || !still_placing) {
            // Steps are added up, so that taking Shift or letting it go makes no jump.
            let speed = if shift { FINE } else { 1.0 } / pane.transform.zoom;
            drag.at[0] += f64::from(pointer.x - drag.last.x) * speed;
            drag.at[1] += f64::from(pointer.y - drag.last.y) * speed;
            drag.last = pointer;
            if let Some(size) = pane.picture.size() {
                drag.at = [drag.at[0].clamp(0.0, f64::from(size[0])), drag.at[1].clamp(0.0, f64::from(size[1]))];
            }
            match &drag.target {
                Target::Point(id) => put(id, drag.at, pane, commands),
                Target::ScaleEnd(end) => move_scale_end(*end, drag.at, pane, commands),
            }
        }
    }
    if down {
        view.drag = Some(drag);
        return;
    }
    if drag.began {
        commands.push(Command::CommitGesture);
    }
    if drag.places
        && let Target::Point(id) = &drag.target
    {
        let next = next_after(id, pane, chosen);
        if next.is_none() {
            view.tool = Tool::Select;
            let all =
                if pane.which == Which::First { "All landmarks are placed." } else { "All chosen points are marked." };
            commands.push(Command::Tell(NoticeKind::Done, all.to_owned()));
        } else {
            commands.push(Command::Select(next));
        }
    }
}

/// The point to place after this one, which the project may not know as marked yet.
fn next_after(id: &PointId, pane: &Pane<'_>, chosen: &[u32]) -> Option<PointId> {
    match id {
        PointId::Landmark(id) => next_unmarked_landmark(pane.scene, Some(id)).map(PointId::Landmark),
        PointId::FeatureFirst(v) | PointId::FeatureLast(v) => {
            next_to_mark(pane.scene, chosen, Some(*v)).map(PointId::FeatureLast)
        }
    }
}

fn current_landmark(pane: &Pane<'_>, focus: &Focus) -> Option<PointId> {
    match &focus.selected {
        Some(id @ PointId::Landmark(_)) => Some(id.clone()),
        _ => next_unmarked_landmark(pane.scene, None).map(PointId::Landmark),
    }
}

fn current_feature(pane: &Pane<'_>, chosen: &[u32], focus: &Focus) -> Option<PointId> {
    match focus.selected {
        Some(PointId::FeatureLast(v)) => Some(PointId::FeatureLast(v)),
        _ => next_to_mark(pane.scene, chosen, None).map(PointId::FeatureLast),
    }
}

/// Puts a mark; a vertex of the still region that nobody has touched becomes a still point with its first mark.
fn put(id: &PointId, at: [f64; 2], pane: &Pane<'_>, commands: &mut Vec<Command>) {
    commands.push(Command::Edit(Edit::Put(id.clone(), at)));
    if let PointId::FeatureFirst(v) | PointId::FeatureLast(v) = id
        && !pane.scene.project.features.contains_key(v)
        && super::points::kind_of(pane.scene, *v) == Kind::Still
    {
        // The role first, so that the step is named for the mark.
        let at = commands.len() - 1;
        commands.insert(at, Command::Edit(Edit::SetRole(*v, Role::Still)));
    }
}

fn scale_press(
    grid: bool,
    first: Option<[f64; 2]>,
    at: [f64; 2],
    pane: &Pane<'_>,
    view: &mut FramesView,
    commands: &mut Vec<Command>,
) {
    let Some(a_px) = first else {
        view.tool = Tool::ScalePoints { grid, first: Some(at) };
        return;
    };
    if a_px == at {
        return;
    }
    let (b_px, old) = (at, pane.scene.project.scale);
    let scale = if grid {
        let (cells, pitch_mm) =
            if let Scale::GridPitch { cells, pitch_mm, .. } = old { (cells, pitch_mm) } else { (1.0, 8.0) };
        Scale::GridPitch { a_px, b_px, cells, pitch_mm }
    } else {
        let mm = if let Scale::TwoPoints { mm, .. } = old { mm } else { 50.0 };
        Scale::TwoPoints { a_px, b_px, mm }
    };
    commands.push(Command::Edit(Edit::SetScale(scale)));
    let ask = "Now give the true length in Settings, Scale.".to_owned();
    commands.push(Command::Tell(NoticeKind::Done, ask));
    view.tool = Tool::Select;
}

fn scale_end(at: Pos2, pane: &Pane<'_>) -> Option<(usize, [f64; 2])> {
    let (Scale::TwoPoints { a_px, b_px, .. } | Scale::GridPitch { a_px, b_px, .. }) = pane.scene.project.scale else {
        return None;
    };
    let near = |p: [f64; 2]| pane.transform.ui_from_image(p).distance(at) <= REACH;
    let ends = [a_px, b_px];
    (pane.which == Which::First).then(|| ends.iter().position(|p| near(*p))).flatten().map(|i| (i, ends[i]))
}

fn move_scale_end(end: usize, at: [f64; 2], pane: &Pane<'_>, commands: &mut Vec<Command>) {
    let mut scale = pane.scene.project.scale;
    if let Scale::TwoPoints { a_px, b_px, .. } | Scale::GridPitch { a_px, b_px, .. } = &mut scale {
        *(if end == 0 { a_px } else { b_px }) = at;
        commands.push(Command::Edit(Edit::SetScale(scale)));
    }
}
