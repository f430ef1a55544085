//! What a press, a drag and a release on a frame do: place the next point, move a point, or select one.

use egui::{Event, Key, PointerButton, Pos2, Response};

use super::guide::{next_to_mark, next_unmarked_landmark};
use super::pane::{Pane, REACH};
use super::points::{self, Kind, Look, ShownPoint};
use super::{FramesView, Tool};
use crate::camera::Scale;
use crate::gui::view_state::NoticeKind;
use crate::gui::{Command, Focus};
use crate::project::{Edit, PointId, Role, Which};

/// How far the pointer must go before a press on a point becomes a drag, ui points: a click that selects moves nothing.
const THRESHOLD: f32 = 3.0;

/// How near to a predicted point a press means that very place, ui points.
const ON_POINT: f32 = 4.0;

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
    /// The point at the same place that a release without motion selects instead.
    behind: Option<PointId>,
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

/// What the pointer did in this pass, in order; of a run of motions only the last.
#[derive(Clone, Copy)]
enum Stroke {
    Press(Pos2),
    Motion(Pos2),
    Release(Pos2),
}

fn strokes(ui: &egui::Ui) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    ui.input(|i| {
        for event in &i.events {
            match *event {
                Event::PointerMoved(at) => {
                    if matches!(strokes.last(), Some(Stroke::Motion(_))) {
                        strokes.pop();
                    }
                    strokes.push(Stroke::Motion(at));
                }
                Event::PointerButton { pos, button: PointerButton::Primary, pressed, .. } => {
                    strokes.push(if pressed { Stroke::Press(pos) } else { Stroke::Release(pos) });
                }
                _ => {}
            }
        }
    });
    strokes
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
    let (down, pointer, shift, escape) = ui.input(|i| {
        let p = &i.pointer;
        (p.primary_down(), p.latest_pos(), i.modifiers.shift, i.key_pressed(Key::Escape))
    });
    let tool = view.tool;
    let mut selected = focus.selected.clone();
    let holds = |view: &FramesView| view.drag.as_ref().is_some_and(|d| d.which == pane.which);
    if escape
        && holds(view)
        && let Some(drag) = view.drag.take()
        && drag.began
    {
        commands.push(Command::CancelGesture);
    }
    // One pass may bring a whole press, motion and release, so each is taken where it happened.
    for stroke in strokes(ui) {
        let before = commands.len();
        match stroke {
            Stroke::Press(at) => {
                let here = pane.rect.contains(at)
                    && (response.contains_pointer() || ui.ctx().layer_id_at(at) == Some(response.layer_id));
                if here && ui.is_enabled() && view.drag.is_none() {
                    view.active = pane.which;
                    response.request_focus();
                    press(at, pane, chosen, view, selected.as_ref(), commands);
                }
            }
            Stroke::Motion(at) if holds(view) => {
                follow(Hand { down: true, pointer: Some(at), shift }, pane, chosen, view, commands);
            }
            Stroke::Release(at) if holds(view) => {
                follow(Hand { down: false, pointer: Some(at), shift }, pane, chosen, view, commands);
            }
            _ => {}
        }
        for command in &commands[before..] {
            if let Command::Select(id) = command {
                selected.clone_from(id);
            }
        }
    }
    if !down && holds(view) {
        follow(Hand { down, pointer, shift }, pane, chosen, view, commands);
    }
    let nearest = |at: Pos2| pane.pick(at, tool, selected.as_ref());
    if response.double_clicked() && tool == Tool::Select && pointer.is_some_and(|p| nearest(p).is_none()) {
        view.fit();
    }
    if response.secondary_clicked()
        && let Some(point) = pointer.and_then(nearest)
    {
        commands.push(Command::Select(Some(point.id.clone())));
    }
}

fn press(
    at: Pos2,
    pane: &Pane<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    selected: Option<&PointId>,
    commands: &mut Vec<Command>,
) {
    let in_image = pane.transform.image_from_ui(at);
    if let Tool::ScalePoints { grid, first } = view.tool {
        if pane.which == Which::First {
            scale_press(grid, first, in_image, pane, view, commands);
        }
        return;
    }
    let hit = pane.pick(at, view.tool, selected);
    // A mark under the pointer is moved, whatever the tool: nobody places two points on one place.
    if let Some(point) = hit.filter(|p| p.look.is_mark()) {
        commands.push(Command::Select(Some(point.id.clone())));
        if point.look == Look::Locked {
            commands
                .push(Command::Tell(NoticeKind::Refused, format!("{} is locked. Press L to free it.", point.label)));
        } else {
            let drag = Drag::take(pane.which, Target::Point(point.id.clone()), point.at, at);
            let again = selected == Some(&point.id);
            let behind = again.then(|| pane.behind(point, at, view.tool)).flatten().map(|p| p.id.clone());
            view.drag = Some(Drag { behind, ..drag });
        }
        return;
    }
    if let Some(end) = scale_end(at, pane) {
        view.drag = Some(Drag::take(pane.which, Target::ScaleEnd(end.0), end.1, at));
        return;
    }
    let placed = match (view.tool, pane.which) {
        (Tool::Landmarks, Which::First) => current_landmark(pane, selected).map(|id| (id, in_image)),
        (Tool::Features, Which::Last) => match accepted(at, pane, hit, selected) {
            Some(point) => Some((point.id.clone(), point.at)),
            None => match current_feature(pane, chosen, selected) {
                Ok(current) => current.map(|id| (id, in_image)),
                Err(text) => {
                    commands.push(Command::Tell(NoticeKind::Refused, text));
                    return;
                }
            },
        },
        _ => None,
    };
    if let Some((id, place)) = placed {
        commands.push(Command::BeginGesture);
        commands.push(Command::Select(Some(id.clone())));
        put(&id, place, pane, commands);
        let drag = Drag::take(pane.which, Target::Point(id), place, at);
        view.drag = Some(Drag { began: true, places: true, ..drag });
    } else if let Some(point) = hit {
        commands.push(Command::Select(Some(point.id.clone())));
        view.drag = Some(Drag::take(pane.which, Target::Point(point.id.clone()), point.at, at));
    } else {
        commands.push(Command::Select(None));
    }
}

/// The predicted point that a press is on, to be marked where it is. Another than the one that was selected in the
/// first frame is none: that one is being placed.
fn accepted<'a>(
    at: Pos2,
    pane: &Pane<'_>,
    hit: Option<&'a ShownPoint>,
    selected: Option<&PointId>,
) -> Option<&'a ShownPoint> {
    let chosen_by_hand = match selected {
        Some(id @ (PointId::FeatureFirst(_) | PointId::Landmark(_))) => points::place(pane.scene, id).map(|(_, v)| v),
        _ => None,
    };
    hit.filter(|p| chosen_by_hand.is_none_or(|v| v == p.vertex))
        .filter(|p| pane.transform.ui_from_image(p.at).distance(at) <= ON_POINT)
}

impl Drag {
    fn take(which: Which, target: Target, at: [f64; 2], pressed_at: Pos2) -> Self {
        Self { which, target, at, began: false, places: false, behind: None, pressed_at, last: pressed_at }
    }
}

/// What the hand does in this frame.
#[derive(Clone, Copy)]
struct Hand {
    down: bool,
    pointer: Option<Pos2>,
    shift: bool,
}

fn follow(
    Hand { down, pointer, shift }: Hand,
    pane: &Pane<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    commands: &mut Vec<Command>,
) {
    let Some(mut drag) = view.drag.take() else { return };
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
    } else if let Some(behind) = drag.behind {
        commands.push(Command::Select(Some(behind)));
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

fn current_landmark(pane: &Pane<'_>, selected: Option<&PointId>) -> Option<PointId> {
    match selected {
        Some(id @ PointId::Landmark(_)) => Some(id.clone()),
        _ => next_unmarked_landmark(pane.scene, None).map(PointId::Landmark),
    }
}

/// The feature point that a click in the last frame marks: the selected one, in whichever frame and by whichever name it
/// was selected; the next of the guide only while nothing is selected.
fn current_feature(pane: &Pane<'_>, chosen: &[u32], selected: Option<&PointId>) -> Result<Option<PointId>, String> {
    match selected {
        Some(PointId::FeatureFirst(v) | PointId::FeatureLast(v)) => Ok(Some(PointId::FeatureLast(*v))),
        Some(id @ PointId::Landmark(name)) => match points::place(pane.scene, id) {
            Some((_, v)) if chosen.contains(&v) => Ok(Some(PointId::FeatureLast(v))),
            _ => Err(format!("{name} is not among the points to mark. Select a feature point.")),
        },
        None => Ok(next_to_mark(pane.scene, chosen, None).map(PointId::FeatureLast)),
    }
}

/// Puts a mark; a vertex of the still region that nobody has touched becomes a still point with its first mark.
fn put(id: &PointId, at: [f64; 2], pane: &Pane<'_>, commands: &mut Vec<Command>) {
    commands.push(Command::Edit(Edit::Put(id.clone(), at)));
    if let PointId::FeatureFirst(v) | PointId::FeatureLast(v) = id
        && !pane.scene.project.features.contains_key(v)
        && points::kind_of(pane.scene, *v) == Kind::Still
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
