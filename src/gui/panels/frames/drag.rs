//! What a press, a drag and a release on a frame do: place the next point, move a point, or select one.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Response};

use super::guide;
use super::pane::{Pane, REACH};
use super::points::{self, Kind, Look};
use super::{FramesView, Tool};
use crate::camera::Scale;
use crate::gui::snapping::Trace;
use crate::gui::view_state::NoticeKind;
use crate::gui::{Command, Focus, snapping};
use crate::project::{Edit, PointId, Role, Which};
use crate::suggest::Refined;

/// How far the hand may shake during a click, ui points: a click that selects, or places, moves nothing.
const SHAKE: f32 = 3.0;

/// How long a click may last, s. Whoever holds the button longer means every motion, however small.
const CLICK_S: f64 = 0.2;

/// Share of the pointer's motion that a point follows while Shift is held.
const FINE: f64 = 0.2;

/// A point in the hand.
#[derive(Clone, Debug)]
pub struct Drag {
    /// In which frame.
    pub which: Which,
    /// What is dragged.
    pub target: Target,
    /// Where the hand has it now, px.
    pub at: [f64; 2],
    /// The crossing of painted lines that it has gone to instead.
    pub snapped: Option<Refined>,
    /// Whether a step of the history is open for it.
    pub began: bool,
    /// Whether the hand is more than a click: the point follows it from then on.
    follows: bool,
    /// Whether the release goes on to the next point.
    places: bool,
    /// The point at the same place that a release without motion selects instead.
    behind: Option<PointId>,
    /// The point that the guide asked for when this one was taken: it asks for it again afterwards.
    asked: Option<PointId>,
    pressed_at: Pos2,
    pressed_at_s: f64,
    last: Pos2,
}

impl Drag {
    /// Where the mark is now, px.
    pub fn mark(&self) -> [f64; 2] {
        self.snapped.map_or(self.at, |f| [f.at.x, f.at.y])
    }
}

/// What is dragged.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A point of the project.
    Point(PointId),
    /// One of the two ends of the scale.
    ScaleEnd(usize),
    /// The second, blind mark of a vertex.
    Again(u32),
}

/// What the pointer did in this pass, in order; of a run of motions only the last.
#[derive(Clone, Copy)]
enum Stroke {
    Press(Pos2, Modifiers),
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
                Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers } => {
                    strokes.push(if pressed { Stroke::Press(pos, modifiers) } else { Stroke::Release(pos) });
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
    let (down, pointer, modifiers, escape, now) = ui.input(|i| {
        let p = &i.pointer;
        (p.primary_down(), p.latest_pos(), i.modifiers, i.key_pressed(Key::Escape), i.time)
    });
    let tool = view.tool;
    let mut selected = focus.selected.clone();
    let holds = |view: &FramesView| view.drag.as_ref().is_some_and(|d| d.which == pane.which);
    if escape
        && holds(view)
        && let Some(drag) = view.drag.take()
    {
        if drag.began {
            commands.push(Command::CancelGesture);
        }
        if drag.asked.is_some() {
            commands.push(Command::Select(drag.asked));
        }
    }
    // One pass may bring a whole press, motion and release, so each is taken where it happened.
    for stroke in strokes(ui) {
        let before = commands.len();
        match stroke {
            Stroke::Press(at, modifiers) => {
                let here = pane.rect.contains(at)
                    && (response.contains_pointer() || ui.ctx().layer_id_at(at) == Some(response.layer_id));
                if here && ui.is_enabled() && view.drag.is_none() {
                    (view.active, view.trace) = (pane.which, None);
                    response.request_focus();
                    let press = Press { at, at_s: now, takes: modifiers.command, alone: alone(modifiers) };
                    press.act(pane, chosen, view, selected.as_ref(), commands);
                    ui.ctx().request_repaint_after_secs(CLICK_S as f32);
                }
            }
            Stroke::Motion(at) if holds(view) => {
                follow(Hand { down: true, pointer: Some(at), modifiers, now }, pane, chosen, view, commands);
            }
            Stroke::Release(at) if holds(view) => {
                follow(Hand { down: false, pointer: Some(at), modifiers, now }, pane, chosen, view, commands);
            }
            _ => {}
        }
        for command in &commands[before..] {
            match command {
                Command::Select(id) => selected.clone_from(id),
                Command::JumpTo(id) => selected = Some(id.clone()),
                _ => {}
            }
        }
    }
    // The button may be held without a motion, or have been released outside the window.
    if holds(view) {
        follow(Hand { down, pointer, modifiers, now }, pane, chosen, view, commands);
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

/// A press of the button on a pane.
struct Press {
    at: Pos2,
    at_s: f64,
    /// Ctrl is held: it takes what is there, whatever the guide asks for.
    takes: bool,
    /// Nothing snaps.
    alone: bool,
}

/// Whether the hand wants no help: Alt is held, or Shift for a fine drag.
fn alone(modifiers: Modifiers) -> bool {
    modifiers.alt || modifiers.shift
}

impl Press {
    fn act(
        &self,
        pane: &Pane<'_>,
        chosen: &[u32],
        view: &mut FramesView,
        selected: Option<&PointId>,
        commands: &mut Vec<Command>,
    ) {
        if let Some(v) = view.doubt.asked() {
            if pane.which == Which::Last {
                let at = pane.transform.image_from_ui(self.at);
                commands.push(Command::BeginGesture);
                let mut drag = Drag { began: true, places: true, ..self.drag(pane.which, Target::Again(v), at) };
                drag.snap(pane, view.snap && !self.alone);
                drag.put(pane, commands);
                view.drag = Some(drag);
            }
        } else if let Tool::ScalePoints { grid, first } = view.tool {
            if pane.which == Which::First {
                let hand = pane.transform.image_from_ui(self.at);
                let snaps = grid && view.snap && !self.alone;
                let target = Target::ScaleEnd(0);
                let found = snaps.then(|| snapping::crossing(pane.scene, &target, hand, pane.transform.zoom)).flatten();
                scale_press(grid, first, found.map_or(hand, |f| [f.at.x, f.at.y]), pane, view, commands);
            }
        } else if view.tool.places_in(pane.which) && !self.takes {
            self.place(pane, chosen, view, selected, commands);
        } else {
            self.take(pane, chosen, view, selected, commands);
        }
    }

    /// Places the point that the guide asks for exactly here, whatever else lies under the pointer.
    fn place(
        &self,
        pane: &Pane<'_>,
        chosen: &[u32],
        view: &mut FramesView,
        selected: Option<&PointId>,
        commands: &mut Vec<Command>,
    ) {
        let refuse = |text: String| Command::Tell(NoticeKind::Refused, text);
        let id = match guide::asked(pane.scene, chosen, view.tool, selected) {
            Ok(Some(id)) => id,
            Ok(None) => return commands.push(refuse(guide::NOTHING_ASKED.to_owned())),
            Err(text) => return commands.push(refuse(text)),
        };
        if points::of(pane.scene, &id).is_some_and(|(look, _)| look == Look::Locked) {
            return commands.push(refuse(format!("{id} is locked. Unlock it first.")));
        }
        let at = pane.transform.image_from_ui(self.at);
        commands.push(Command::BeginGesture);
        commands.push(Command::Select(Some(id.clone())));
        view.placed = Some(id.clone());
        let mut drag = Drag { began: true, places: true, ..self.drag(pane.which, Target::Point(id), at) };
        drag.snap(pane, view.snap && !self.alone);
        drag.put(pane, commands);
        view.drag = Some(drag);
    }

    /// Takes the point under the pointer, or selects none.
    fn take(
        &self,
        pane: &Pane<'_>,
        chosen: &[u32],
        view: &mut FramesView,
        selected: Option<&PointId>,
        commands: &mut Vec<Command>,
    ) {
        let asked = guide::asked(pane.scene, chosen, view.tool, selected).ok().flatten();
        // In the other pane the guide asks for nothing, and what is selected there is what it asks for next.
        let asked = asked.filter(|_| view.tool.places_in(pane.which));
        let hit = pane.pick(self.at, view.tool, selected);
        if let Some(point) = hit.filter(|p| p.look.is_mark()) {
            commands.push(Command::Select(Some(point.id.clone())));
            if point.look == Look::Locked {
                let text = format!("{} is locked. Unlock it first.", point.label);
                commands.push(Command::Tell(NoticeKind::Refused, text));
            } else {
                let drag = self.drag(pane.which, Target::Point(point.id.clone()), point.at);
                let again = selected == Some(&point.id);
                let behind = again.then(|| pane.behind(point, self.at, view.tool)).flatten().map(|p| p.id.clone());
                view.drag = Some(Drag { behind, asked, ..drag });
            }
        } else if let Some((end, at)) = scale_end(self.at, pane) {
            view.drag = Some(self.drag(pane.which, Target::ScaleEnd(end), at));
        } else if let Some(point) = hit {
            commands.push(Command::Select(Some(point.id.clone())));
            view.drag = Some(Drag { asked, ..self.drag(pane.which, Target::Point(point.id.clone()), point.at) });
        } else if view.tool == Tool::Select {
            commands.push(Command::Select(None));
        } else if view.tool == Tool::Landmarks && pane.which == Which::Last {
            let text = "Landmarks are placed in the first frame.".to_owned();
            commands.push(Command::Tell(NoticeKind::Refused, text));
        }
    }

    fn drag(&self, which: Which, target: Target, at: [f64; 2]) -> Drag {
        Drag {
            which,
            target,
            at,
            snapped: None,
            began: false,
            follows: false,
            places: false,
            behind: None,
            asked: None,
            pressed_at: self.at,
            pressed_at_s: self.at_s,
            last: self.at,
        }
    }
}

/// What the hand does in this frame.
#[derive(Clone, Copy)]
struct Hand {
    down: bool,
    pointer: Option<Pos2>,
    modifiers: Modifiers,
    now: f64,
}

fn follow(
    Hand { down, pointer, modifiers, now }: Hand,
    pane: &Pane<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    commands: &mut Vec<Command>,
) {
    let Some(mut drag) = view.drag.take() else { return };
    if let Some(pointer) = pointer {
        drag.follows |= drag.pressed_at.distance(pointer) >= SHAKE || now - drag.pressed_at_s >= CLICK_S;
        if drag.follows && !drag.began {
            commands.push(Command::BeginGesture);
            drag.began = true;
        }
        // From the place of the press on, so that what was moved before the hand was more than a click is not lost.
        if drag.follows && drag.last != pointer {
            // Steps are added up, so that taking Shift or letting it go makes no jump.
            let speed = if modifiers.shift { FINE } else { 1.0 } / pane.transform.zoom;
            drag.at[0] += f64::from(pointer.x - drag.last.x) * speed;
            drag.at[1] += f64::from(pointer.y - drag.last.y) * speed;
            drag.last = pointer;
            if let Some(size) = pane.picture.size() {
                drag.at = [drag.at[0].clamp(0.0, f64::from(size[0])), drag.at[1].clamp(0.0, f64::from(size[1]))];
            }
            drag.snap(pane, view.snap && !alone(modifiers));
            drag.put(pane, commands);
        } else if drag.began && drag.snapped.is_some() && alone(modifiers) {
            // Let go without a motion of the hand.
            drag.snap(pane, false);
            drag.put(pane, commands);
        }
    }
    if down {
        view.drag = Some(drag);
        return;
    }
    if drag.began {
        commands.push(Command::CommitGesture);
        if let (Some(found), Target::Point(id)) = (drag.snapped, &drag.target) {
            let trace = Trace { id: id.clone(), from: drag.at, found };
            commands.push(Command::Tell(NoticeKind::Done, format!("Snapped {}.", trace.words())));
            view.trace = Some(trace);
        }
    }
    if drag.last == drag.pressed_at {
        if let Some(behind) = drag.behind {
            commands.push(Command::Select(Some(behind)));
        }
    } else if drag.asked.is_some() {
        commands.push(Command::Select(drag.asked));
    }
    match &drag.target {
        Target::Point(id) if drag.places => {
            commands.push(guide::next_after(pane.scene, chosen, id).map_or(Command::EndGuide, Command::JumpTo));
        }
        Target::Again(_) => commands.push(Command::NextAgain),
        _ => {}
    }
}

impl Drag {
    /// Lets what is in the hand go to the crossing of painted lines beside it, if it is to snap and there is one.
    fn snap(&mut self, pane: &Pane<'_>, wanted: bool) {
        let grid = matches!(pane.scene.project.scale, Scale::GridPitch { .. });
        let can = wanted && (grid || matches!(self.target, Target::Point(_) | Target::Again(_)));
        let found = || snapping::crossing(pane.scene, &self.target, self.at, pane.transform.zoom);
        self.snapped = can.then(found).flatten();
    }

    /// Puts what is in the hand where it is now.
    fn put(&self, pane: &Pane<'_>, commands: &mut Vec<Command>) {
        match &self.target {
            Target::Point(id) => put(id, self.mark(), pane, commands),
            Target::ScaleEnd(end) => move_scale_end(*end, self.mark(), pane, commands),
            Target::Again(v) => commands.push(Command::Edit(Edit::Repeat(*v, self.mark()))),
        }
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
