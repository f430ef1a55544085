//! The guide at work: which point is asked for next, after a mark, a skip, a step back or an undo.

use super::Scene;
use super::app::App;
use super::panels::frames::{SideTab, Tool, guide, points};
use super::suggesting;
use super::view_state::{NoticeKind, Workspace};
use crate::draw::words::capital;
use crate::project::{Edit, MarkState, PointId, Role, Which, edit};

impl App {
    pub(super) fn select(&mut self, point: Option<PointId>) {
        if let Some(id) = &point {
            self.view.frames.active = if matches!(id, PointId::FeatureLast(_)) { Which::Last } else { Which::First };
        }
        self.view.focus.selected = point;
    }

    /// Selects a point, and moves the panes if it is out of view.
    pub(super) fn jump_to(&mut self, id: PointId) {
        let scene = self.scene();
        let (place, known) = (points::place(scene, &id), points::of(scene, &id));
        if let (Some((which, vertex)), Some((look, at))) = (place, known) {
            let first = points::predicted(scene, Which::First, vertex);
            // A point that nothing predicts is nowhere in particular.
            if look != points::Look::Unset {
                self.view.frames.bring_to_view(which, at);
                if which == Which::Last && !self.view.frames.linked {
                    self.view.frames.bring_to_view(Which::First, first);
                }
            }
            self.view.workspace = Workspace::Frames;
        }
        self.select(Some(id));
    }

    /// Takes a guided tool into the hand: it asks for the first point without a mark.
    pub(super) fn start_tool(&mut self, tool: Tool) {
        self.view.frames.tool = tool;
        self.view.frames.placed = None;
        self.view.frames.finished = None;
        // One thing is marked at a time.
        self.view.frames.doubt.again = None;
        self.view.workspace = Workspace::Frames;
        self.view.frames.side = SideTab::Guide;
        match self.guided().into_iter().find(|(_, marked)| !marked) {
            Some((id, _)) => self.jump_to(id),
            None => self.select(None),
        }
    }

    /// Whether a tool is in the hand that places one point after the other.
    fn is_guided(&self) -> bool {
        matches!(self.view.frames.tool, Tool::Landmarks | Tool::Features)
    }

    fn chosen(&self) -> Vec<u32> {
        points::chosen_vertices(self.scene(), &self.view.frames.regions)
    }

    /// The points that the tool places, in the order of the guide, and whether each has its mark.
    fn guided(&self) -> Vec<(PointId, bool)> {
        let scene = self.scene();
        let list: Vec<PointId> = match self.view.frames.tool {
            Tool::Landmarks => scene.face.landmarks().iter().map(|l| PointId::Landmark(l.id.clone())).collect(),
            Tool::Features => self.chosen().into_iter().map(PointId::FeatureLast).collect(),
            _ => Vec::new(),
        };
        let marked = |id: PointId| {
            let has = edit::mark(scene.project, &id).is_some();
            (id, has)
        };
        list.into_iter().map(marked).collect()
    }

    /// Does what may take marks away or bring them back, and lets the guide follow: it asks for the first point that
    /// lost its mark, or for the next after the one that got one. Where many got one at once it goes on from the point that it
    /// asked for, so that those left out are asked for, too. A guide that had come to its end goes on where a point of its list loses its mark.
    pub(super) fn in_step_with_guide(&mut self, act: impl FnOnce(&mut Self)) {
        let put_down = self.view.frames.finished.filter(|_| self.view.frames.tool == Tool::Select);
        if let Some(tool) = put_down {
            self.view.frames.tool = tool;
        }
        let before = self.guided();
        act(self);
        let after = self.guided();
        let was_marked = |id: &PointId| before.iter().any(|(b, marked)| *marked && b == id);
        let is_marked = |id: &PointId| after.iter().any(|(a, marked)| *marked && a == id);
        if let Some((lost, _)) = before.iter().find(|(id, marked)| *marked && !is_marked(id)) {
            self.select(Some(lost.clone()));
            self.view.frames.finished = None;
            return;
        }
        if put_down.is_some() {
            self.view.frames.tool = Tool::Select;
            return;
        }
        let got = |(id, marked): &(PointId, bool)| *marked && !was_marked(id);
        let many = after.iter().filter(|p| got(p)).count() > 1;
        let asked = self.view.focus.selected.as_ref().and_then(|id| after.iter().position(|(a, _)| a == id));
        if let Some(last) = after.iter().rposition(got) {
            let from = if many { asked.unwrap_or(0) } else { last + 1 };
            let next = after.iter().skip(from).find(|(_, marked)| !marked).map(|(id, _)| id.clone());
            self.select(next);
        }
    }

    /// Goes to the next point, or the one before. While a guide runs, forwards means the next without a mark, and the list ends;
    /// otherwise it is the list that the selected point belongs to, round and round.
    pub(super) fn step_point(&mut self, forward: bool, ctx: &egui::Context) {
        if self.is_guided() {
            self.step_guide(forward, ctx);
            return;
        }
        let scene = self.scene();
        let landmarks: Vec<PointId> = scene.face.landmarks().iter().map(|l| PointId::Landmark(l.id.clone())).collect();
        let chosen = self.chosen();
        let list: Vec<PointId> = match &self.view.focus.selected {
            Some(PointId::FeatureFirst(_)) => chosen.iter().map(|v| PointId::FeatureFirst(*v)).collect(),
            Some(PointId::FeatureLast(_)) => chosen.iter().map(|v| PointId::FeatureLast(*v)).collect(),
            _ => landmarks,
        };
        let at = self.view.focus.selected.as_ref().and_then(|id| list.iter().position(|p| p == id));
        let count = list.len().max(1);
        let next = match (at, forward) {
            (Some(i), true) => (i + 1) % count,
            (Some(i), false) => (i + count - 1) % count,
            (None, true) => 0,
            (None, false) => count - 1,
        };
        if let Some(id) = list.into_iter().nth(next) {
            self.jump_to(id);
        }
    }

    fn step_guide(&mut self, forward: bool, ctx: &egui::Context) {
        let asked = self.asked();
        if forward {
            match asked.as_ref().map(|id| guide::next_after(self.scene(), &self.chosen(), id)) {
                Some(Some(next)) => self.jump_to(next),
                Some(None) => self.end_guide(ctx),
                None => self.start_tool(self.view.frames.tool),
            }
            return;
        }
        let list = self.guided();
        let at = asked.and_then(|id| list.iter().position(|(p, _)| *p == id)).unwrap_or(list.len());
        // Where many were accepted at once, the point placed last is not the one before in the list: back to it, unless points were skipped
        // between, or the one asked for has a mark and the list is walked.
        let new = list.get(at).is_none_or(|(_, marked)| !marked);
        let placed = self.view.frames.placed.as_ref().filter(|_| new);
        let placed = placed.and_then(|id| list.iter().position(|(p, _)| p == id));
        let all_marked = |from: &usize| list.get(*from..at).is_some_and(|l| l.iter().all(|(_, marked)| *marked));
        let back = placed.filter(|from| *from < at && all_marked(from)).or(at.checked_sub(1));
        if let Some((id, _)) = back.and_then(|i| list.into_iter().nth(i)) {
            self.jump_to(id);
        }
    }

    /// The point that the guide asks for.
    fn asked(&self) -> Option<PointId> {
        let selected = self.view.focus.selected.as_ref();
        guide::asked(self.scene(), &self.chosen(), self.view.frames.tool, selected).ok().flatten()
    }

    /// The list of the guide is at its end: the tool is put down when all is done; otherwise the guide says how many were skipped,
    /// and asks for nothing.
    pub(super) fn end_guide(&mut self, ctx: &egui::Context) {
        let left = self.guided().into_iter().filter(|(_, marked)| !marked).count();
        let landmarks = self.view.frames.tool == Tool::Landmarks;
        if left > 0 {
            self.select(None);
            self.tell(NoticeKind::Done, format!("The list is at its end: {left} skipped."), ctx);
            return;
        }
        self.view.frames.finished = Some(self.view.frames.tool);
        self.view.frames.tool = Tool::Select;
        let all = if landmarks { "All landmarks are placed." } else { "All chosen points are marked." };
        self.tell(NoticeKind::Done, all.to_owned(), ctx);
    }

    /// Takes the predicted place of the point asked for, or of the selected one, for its mark, and goes on to the next.
    pub(super) fn accept(&mut self, ctx: &egui::Context) {
        let guided = self.is_guided();
        let Some(id) = suggesting::to_accept(self.scene(), &self.view, self.asked()) else { return };
        let scene = self.scene();
        let Some((look, at)) = points::of(scene, &id) else { return };
        if let (points::Look::Suggested, PointId::FeatureLast(v)) = (look, &id)
            && let Some(suggestion) = points::suggestion(scene, *v)
        {
            let still = points::kind_of(scene, *v) == points::Kind::Still;
            let edit = Edit::Accept(vec![suggesting::accepted(suggestion, still)]);
            self.edit(&edit, ctx);
            self.accepted(id, guided, ctx);
            return;
        }
        let still = match &id {
            PointId::FeatureFirst(v) | PointId::FeatureLast(v) => {
                let untouched = !scene.project.features.contains_key(v);
                (untouched && points::kind_of(scene, *v) == points::Kind::Still).then_some(*v)
            }
            PointId::Landmark(_) => None,
        };
        self.document.history.begin_gesture();
        if let Some(v) = still {
            self.edit(&Edit::SetRole(v, Role::Still), ctx);
        }
        self.edit(&Edit::Put(id.clone(), at), ctx);
        self.document.history.commit_gesture();
        self.accepted(id, guided, ctx);
    }

    /// Goes on to the next point without a mark.
    fn accepted(&mut self, id: PointId, guided: bool, ctx: &egui::Context) {
        if guided {
            self.select(Some(id.clone()));
            self.view.frames.placed = Some(id);
            self.step_point(true, ctx);
            return;
        }
        match guide::next_after(self.scene(), &self.chosen(), &id) {
            Some(next) => self.jump_to(next),
            None => self.select(Some(id)),
        }
    }

    /// Says of the selected mark, or of the one that the guide has placed last, that it is in doubt, or takes that back.
    pub(super) fn toggle_uncertain(&mut self, ctx: &egui::Context) {
        let Some(id) = in_doubt(self.scene(), &self.view) else { return };
        let now = edit::mark(self.project(), &id).map(|m| m.state);
        let state = if now == Some(MarkState::Uncertain) { MarkState::Marked } else { MarkState::Uncertain };
        self.edit(&Edit::SetState(id.clone(), state), ctx);
        if self.view.focus.selected.as_ref() != Some(&id) {
            let word = if state == MarkState::Uncertain { "uncertain" } else { "certain again" };
            self.tell(NoticeKind::Done, format!("{}, placed last, is {word}.", capital(&id.to_string())), ctx);
        }
    }
}

/// The point that *Uncertain* speaks of.
pub(super) fn in_doubt(scene: Scene<'_>, view: &super::ViewState) -> Option<PointId> {
    guide::in_doubt(scene, &view.frames, view.focus.selected.as_ref())
}
