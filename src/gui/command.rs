//! What a panel may ask for. Panels push commands; `App` alone runs them.

use std::path::PathBuf;

use super::action::{Action, Chord};
use super::dialogs::Purpose;
use super::film_work::Looking;
use super::import_marks::ReadMarks;
use super::keys::Bound;
use super::modal::Modal;
use super::new_frames::NewFrame;
use super::rescue::Rescue;
use super::view_state::NoticeKind;
use crate::face::draft::DraftEdit;
use crate::project::{Edit, PointId, Which};

/// A request of a panel to the application.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Do what a menu entry, a shortcut or the palette names.
    Do(Action),
    /// Change the project. One entry of the history, or part of the open gesture.
    Edit(Edit),
    /// Change the project in several ways at once, as one entry of the history.
    Edits(Vec<Edit>),
    /// A drag begins: what follows until the commit is one entry of the history.
    BeginGesture,
    /// The drag ends.
    CommitGesture,
    /// The drag is given up: the project is as it was when it began.
    CancelGesture,
    /// Select a point, or none; it is selected in every pane and in the table.
    Select(Option<PointId>),
    /// Select a point and move the panes so that it can be seen.
    JumpTo(PointId),
    /// A point was marked again, blind: go to the next.
    NextAgain,
    /// The guide has no further point to ask for: put the tool down, or say how many points were skipped.
    EndGuide,
    /// Go to the state after so many steps of the history.
    GoToStep(usize),
    /// Ask the person for files.
    AskFiles(Purpose),
    /// The person has named these files (or none, having thought better of it).
    FilesChosen(Purpose, Vec<PathBuf>),
    /// These paths were typed for that purpose: should they be wrong, they can be mended.
    Typed(Purpose, String),
    /// Begin a new project with these pictures.
    NewProjectWith(Vec<NewFrame>),
    /// Make these pictures the frames and keep the marks that were made on others.
    KeepMarks(Vec<NewFrame>),
    /// Read a picture and make it a frame of the project.
    LoadFrame(Which, PathBuf),
    /// Make these two frames of a film the frames of the project.
    UseFilmFrames(Looking, [usize; 2]),
    /// Take marks that were read: as marks, or as suggestions.
    TakeMarks(ReadMarks, bool),
    /// Files were dropped on the window, on a pane of the frames or elsewhere.
    Dropped(Vec<PathBuf>, Option<Which>),
    /// Give these keys to it, and take them from whatever has them.
    BindKeys(Bound, Vec<Chord>),
    /// Put every key back.
    ResetKeys,
    /// Show a dialog in the window.
    Show(Modal),
    /// Close the dialog.
    CloseModal,
    /// Go on with what unsaved changes had stopped: the changes are saved or given up.
    Proceed(After),
    /// Save, then go on.
    SaveThen(After),
    /// Take the work that was found, or throw it away.
    Recover(bool),
    /// Change the face that is being made.
    EditFace(DraftEdit),
    /// Save the face, then go on.
    SaveFaceThen(After),
    /// Give up the changes of the face, then go on.
    DropFace(After),
    /// Open what lies beside a project that cannot be read.
    Rescue(PathBuf, Rescue),
    /// Open a project of the list of recent ones.
    OpenRecent(PathBuf),
    /// Forget the recent projects.
    ForgetRecent,
    /// Say something in the status bar.
    Tell(NoticeKind, String),
    /// Build the ladder of models on the muscles shown.
    BuildLadder,
    /// Take another subject off the list.
    RemoveSubject(u64),
    /// Try the laws on the other subjects, where that was stopped.
    TrySubjects,
    /// Stop a long work.
    CancelJob(u64),
}

/// What waits until unsaved changes are saved or given up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum After {
    /// A new, empty project.
    New,
    /// A new project with these pictures.
    NewWith(Vec<(Which, PathBuf)>),
    /// The embedded sample.
    Sample,
    /// A dialog that asks which project to open.
    AskOpen,
    /// This project.
    Open(PathBuf),
    /// A dialog that asks for a mesh.
    AskMesh,
    /// A dialog that asks for a face model.
    AskFace,
    /// This mesh or face model.
    ReadFace(PathBuf),
    /// The face given to the project.
    UseFace,
    /// The end of the program.
    Quit,
}
