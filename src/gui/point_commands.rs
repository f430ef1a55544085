//! What the commands of the selected point do: select it, step from it, accept, clear and nudge it.

use super::action::{Direction, Step};
use super::app::App;
use super::panels::frames::{SideTab, Tool, guide, points};
use super::view_state::Workspace;
use crate::project::{Edit, MarkState, PointId, Role, Which, edit};

impl App {
    pub(super) fn select(&mut self, point: Option<PointId>) {
        if let Some(id) = &point {
            self.view.frames.active = if matches!(id, PointId::FeatureLast(_)) { Which::Last } else { Which::First };
        }
        self.view.focus.selected = point;
    }

    pub(super) fn jump_to(&mut self, id: PointId) {
        let scene = self.scene();
        let (place, known) = (points::place(scene, &id), points::of(scene, &id));
        if let (Some((which, vertex)), Some((_, at))) = (place, known) {
            let first = points::predicted(scene, Which::First, vertex);
            self.view.frames.bring_to_view(which, at);
            if which == Which::Last && !self.view.frames.linked {
                self.view.frames.bring_to_view(Which::First, first);
            }
            self.view.workspace = Workspace::Frames;
        }
        self.select(Some(id));
    }

    pub(super) fn start_tool(&mut self, tool: Tool) {
        self.view.frames.tool = tool;
        self.view.workspace = Workspace::Frames;
        self.view.frames.side = SideTab::Guide;
        let scene = self.scene();
        let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
        let next = match tool {
            Tool::Landmarks => guide::next_unmarked_landmark(scene, None).map(PointId::Landmark),
            Tool::Features => guide::next_to_mark(scene, &chosen, None).map(PointId::FeatureLast),
            _ => None,
        };
        self.select(next);
    }

    /// The points that the tool places, in the order of the guide, and whether each has its mark.
    fn guided(&self) -> Vec<(PointId, bool)> {
        let scene = self.scene();
        let list: Vec<PointId> = match self.view.frames.tool {
            Tool::Landmarks => scene.face.landmarks().iter().map(|l| PointId::Landmark(l.id.clone())).collect(),
            Tool::Features => {
                let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
                chosen.into_iter().map(PointId::FeatureLast).collect()
            }
            _ => Vec::new(),
        };
        let marked = |id: &PointId| edit::mark(scene.project, id).is_some();
        list.into_iter()
            .map(|id| {
                let has = marked(&id);
                (id, has)
            })
            .collect()
    }

    /// Does what may take marks away or bring them back, and lets the guide follow: it asks for the first point that
    /// lost its mark, or for the next after those that got one.
    pub(super) fn in_step_with_guide(&mut self, act: impl FnOnce(&mut Self)) {
        let before = self.guided();
        act(self);
        let after = self.guided();
        let was_marked = |id: &PointId| before.iter().any(|(b, marked)| *marked && b == id);
        let is_marked = |id: &PointId| after.iter().any(|(a, marked)| *marked && a == id);
        if let Some((lost, _)) = before.iter().find(|(id, marked)| *marked && !is_marked(id)) {
            self.select(Some(lost.clone()));
        } else if let Some(got) = after.iter().rposition(|(id, marked)| *marked && !was_marked(id)) {
            let next = after[got + 1..].iter().chain(&after[..got]).find(|(_, marked)| !marked);
            let next = next.map(|(id, _)| id.clone());
            self.select(next);
        }
    }

    /// Goes to the next point, or the one before, in the list that the selected one belongs to.
    pub(super) fn step_point(&mut self, forward: bool) {
        let scene = self.scene();
        let landmarks: Vec<PointId> = scene.face.landmarks().iter().map(|l| PointId::Landmark(l.id.clone())).collect();
        let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
        let list: Vec<PointId> = match (&self.view.focus.selected, self.view.frames.tool) {
            (Some(PointId::FeatureFirst(_)), _) => chosen.iter().map(|v| PointId::FeatureFirst(*v)).collect(),
            (Some(PointId::FeatureLast(_)), _) | (None, Tool::Features) => {
                chosen.iter().map(|v| PointId::FeatureLast(*v)).collect()
            }
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

    /// Takes the predicted place of the selected point for its mark, and goes on to the next.
    pub(super) fn accept(&mut self, ctx: &egui::Context) {
        let scene = self.scene();
        let Some(id) = self.view.focus.selected.clone() else { return };
        let Some((look, at)) = points::of(scene, &id) else { return };
        if look != points::Look::Predicted {
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
        self.edit(&Edit::Put(id, at), ctx);
        self.document.history.commit_gesture();
        self.step_point(true);
    }

    pub(super) fn on_selected(&mut self, ctx: &egui::Context, make: impl FnOnce(PointId, Option<MarkState>) -> Edit) {
        if let Some(id) = self.view.focus.selected.clone() {
            let state = edit::mark(self.project(), &id).map(|m| m.state);
            self.edit(&make(id, state), ctx);
        }
    }

    pub(super) fn toggle_state(&mut self, state: MarkState, ctx: &egui::Context) {
        self.on_selected(ctx, |id, now| Edit::SetState(id, if now == Some(state) { MarkState::Marked } else { state }));
    }

    pub(super) fn set_role(&mut self, role: Role, ctx: &egui::Context) {
        if let Some(v) = self.view.focus.selected_vertex() {
            self.edit(&Edit::SetRole(v, role), ctx);
        }
    }

    pub(super) fn nudge(&mut self, direction: Direction, step: Step, ctx: &egui::Context) {
        let Some(id) = self.view.focus.selected.clone() else { return };
        let Some((_, at)) = points::of(self.scene(), &id) else { return };
        if !self.document.nudging {
            self.document.history.begin_gesture();
            self.document.nudging = true;
        }
        let [dx, dy] = direction.unit();
        self.edit(&Edit::Put(id, [at[0] + dx * step.px(), at[1] + dy * step.px()]), ctx);
    }
}
