//! The commands of doubt: go to the point worth most, mark points again blind, compare with another annotator.

use std::path::Path;

use super::app::App;
use super::panels::frames::doubt::{Again, Other};
use super::panels::frames::{SideTab, Tool, points};
use super::pictures::file_name;
use super::view_state::{NoticeKind, Workspace};
use super::{Action, Command};
use crate::doubt::{agreement, repeats};
use crate::project::{Edit, PointId, file};

impl App {
    /// Does one of the actions of doubt.
    pub(super) fn act_in_doubt(&mut self, action: Action, ctx: &egui::Context) {
        self.view.workspace = Workspace::Frames;
        match action {
            Action::ShowDoubt => {
                let frames = &mut self.view.frames;
                frames.side = if frames.side == SideTab::Doubt { SideTab::Guide } else { SideTab::Doubt };
            }
            Action::NextWorth => self.go_to_worth(ctx),
            Action::Again => self.toggle_again(ctx),
            _ if self.view.frames.doubt.other.is_some() => {
                self.view.frames.doubt.other = None;
                self.view.frames.doubt.forget();
            }
            _ => self.dialogs.ask(ctx, super::dialogs::Purpose::Compare),
        }
    }

    fn go_to_worth(&mut self, ctx: &egui::Context) {
        let mut doubt = std::mem::take(&mut self.view.frames.doubt);
        let scene = self.scene();
        let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
        let next = doubt.worth(scene, &chosen).first().map(|w| w.vertex);
        self.view.frames.doubt = doubt;
        match next {
            Some(v) => self.commands.push(Command::JumpTo(PointId::FeatureLast(v))),
            None => self.tell(NoticeKind::Done, "Every chosen point is marked, and none in doubt.".to_owned(), ctx),
        }
    }

    /// Begins to mark points again, or stops; what was marked again stays.
    fn toggle_again(&mut self, ctx: &egui::Context) {
        if self.view.frames.doubt.again.take().is_some() {
            return;
        }
        // Another choice each time, and the same one for the same marks and number of steps: a test can follow it.
        let seed = self.document.history.revision();
        let points = repeats::propose(self.project(), repeats::PROPOSED, seed);
        if points.len() < repeats::FEWEST {
            let text = format!("Mark at least {} points in the last frame first.", repeats::FEWEST);
            return self.tell(NoticeKind::Refused, text, ctx);
        }
        if !self.project().repeats.is_empty() {
            self.edit(&Edit::ClearRepeats, ctx);
        }
        self.view.frames.tool = Tool::Select;
        self.view.frames.finished = None;
        self.view.frames.side = SideTab::Doubt;
        self.view.frames.doubt.again = Some(Again { points, done: 0 });
        self.commands.push(Command::Select(None));
        self.show_asked_again();
    }

    /// The next point to mark again; after the last one the result.
    pub(super) fn next_again(&mut self, ctx: &egui::Context) {
        let doubt = &mut self.view.frames.doubt;
        if doubt.again.is_none() {
            return;
        }
        doubt.follow(self.document.history.project());
        if doubt.asked().is_some() {
            return self.show_asked_again();
        }
        self.view.frames.doubt.again = None;
        if let Some(hand) = repeats::hand_error(self.project()) {
            let text = format!(
                "{} points are marked twice: your marks err by {:.2} px along each axis.",
                hand.points, hand.sigma_px
            );
            self.tell(NoticeKind::Done, text, ctx);
        }
    }

    /// Brings the point asked for into view in the first frame; the other pane follows only as far as it is linked.
    fn show_asked_again(&mut self) {
        let Some(v) = self.view.frames.doubt.asked() else { return };
        if let Some(at) = self.outcome.first_in_image.get(v as usize) {
            self.view.frames.bring_to_view(crate::project::Which::First, [at.x, at.y]);
        }
    }

    /// Reads the project of another annotator and compares.
    pub(super) fn compare_with(&mut self, path: &Path) {
        let title = "The projects cannot be compared";
        let project = match file::load(path) {
            Ok(project) => project,
            Err(e) => return self.fail(title, e.to_string()),
        };
        if let Err(why) = agreement::compare(self.project(), &project) {
            return self.fail(title, format!("{}: {why}.", file_name(path)));
        }
        let doubt = &mut self.view.frames.doubt;
        doubt.other = Some(Other { name: file_name(path), project });
        doubt.forget();
        self.view.frames.side = SideTab::Doubt;
    }
}
