//! What the window shows and how: nothing of it is part of the project, and none of it changes a result.

use super::dialogs::Purpose;
use super::modal::Modal;
use super::panels;
use crate::project::PointId;

/// Everything the window remembers about showing.
#[derive(Default)]
pub struct ViewState {
    /// The workspace shown.
    pub workspace: Workspace,
    /// What is hovered and selected, in every panel at once.
    pub focus: Focus,
    /// The workspace of the frames.
    pub frames: panels::frames::FramesView,
    /// The workspace of the forces.
    pub forces: panels::forces::ForcesView,
    /// The workspace of the muscles.
    pub muscles: panels::muscles::MusclesView,
    /// The workspace of the expressions.
    pub expressions: panels::expressions::ExpressionsView,
    /// The workspace of the studies.
    pub study: panels::study::StudyView,
    /// The workspace of the face.
    pub face: panels::face::FaceView,
    /// The dialog that is open.
    pub modal: Option<Modal>,
    /// Paths that were typed and are not yet known to be good: after an error they can be mended.
    pub typed: Option<(Purpose, String)>,
    /// The palette, while it is open.
    pub palette: Option<panels::palette::PaletteView>,
    /// What was last said in the status bar.
    pub notice: Option<Notice>,
}

/// The workspaces, as tabs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Workspace {
    /// The two frames.
    #[default]
    Frames,
    /// The height map of the forces.
    Forces,
    /// The muscles behind them.
    Muscles,
    /// The face that moves.
    Expressions,
    /// The face model.
    Face,
    /// The studies.
    Study,
}

/// What is hovered and selected. A panel tells what lies under its pointer; every panel lights it up in the next pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Focus {
    hovered: Option<u32>,
    next: Option<u32>,
    /// The selected point; changed by `Command::Select` alone.
    pub selected: Option<PointId>,
}

impl Focus {
    /// The vertex under the pointer, wherever the pointer is.
    pub fn hovered(&self) -> Option<u32> {
        self.hovered
    }

    /// Says that the pointer is on this vertex.
    pub fn hover(&mut self, vertex: u32) {
        self.next = Some(vertex);
    }

    /// Ends the pass; true when another vertex is hovered than before.
    pub(super) fn end_pass(&mut self) -> bool {
        let changed = self.hovered != self.next;
        self.hovered = self.next.take();
        changed
    }

    /// Vertex of the selected point, for a feature point.
    pub fn selected_vertex(&self) -> Option<u32> {
        match self.selected {
            Some(PointId::FeatureFirst(v) | PointId::FeatureLast(v)) => Some(v),
            _ => None,
        }
    }
}

/// A sentence in the status bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// How it is meant.
    pub kind: NoticeKind,
    /// The sentence.
    pub text: String,
    /// Time of the window at which it goes away, s.
    pub until: f64,
}

/// How a notice is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoticeKind {
    /// Something was done.
    Done,
    /// Something was not done, and why.
    Refused,
}
