//! What the commands of the selected point do: clear it, say what it is worth, nudge it.

use super::action::{Action, Direction, Step, TABLE};
use super::app::App;
use super::keys::Bound;
use super::panels::frames::points;
use crate::project::{Edit, MarkState, PointId, Role, edit};

impl App {
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

    /// Whether a key that nudges is held down still.
    pub(super) fn nudge_key_is_down(&self, ctx: &egui::Context) -> bool {
        let nudges = || TABLE.iter().map(|s| s.action).filter(|a| matches!(a, Action::Nudge(..)));
        ctx.input(|i| nudges().any(|a| self.keys.is_down(i, Bound::Press(a))))
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
