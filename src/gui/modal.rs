//! The dialogs inside the window: one is open at a time, and nothing else is answered meanwhile.

use std::path::PathBuf;

use super::command::After;
use super::dialogs::Purpose;
use super::import_marks::ReadMarks;
use super::new_frames::NewFrame;
use super::panels::film_strip::FilmView;
use super::panels::key_settings::KeysView;
use super::rescue::Rescue;

/// Which dialog is open, with what has been typed into it.
#[derive(Clone, Debug, PartialEq)]
pub enum Modal {
    /// Something could not be done; nothing was lost.
    Error {
        /// What could not be done.
        title: String,
        /// Why, and what to do: one line.
        text: String,
        /// The dialog with the paths that were typed, to be mended.
        again: Option<Box<Modal>>,
    },
    /// Pictures were chosen that are not those that were marked.
    OtherFrames(Vec<NewFrame>),
    /// There are unsaved changes in the way.
    Unsaved(After),
    /// The face that is being made has unsaved changes, which are in the way.
    UnsavedFace(After),
    /// The system has no file dialog: type the path.
    Path {
        /// What the files are for.
        purpose: Purpose,
        /// What has been typed, a path a line.
        typed: String,
        /// Whether its field has been given the keyboard.
        focused: bool,
    },
    /// First and last frame of a film, or of a folder of numbered pictures.
    Film(FilmView),
    /// Marks were read from a file.
    Marks(ReadMarks),
    /// Work that was not saved was found.
    Recover {
        /// When it was written: ", 5 minutes old".
        when: String,
        /// The project's file was saved since.
        older: bool,
    },
    /// A project cannot be read, and something beside it can.
    Spoilt {
        /// The project.
        path: PathBuf,
        /// Why it cannot be read: one line.
        why: String,
        /// What can be read, each with its age.
        found: Vec<(Rescue, String)>,
    },
    /// Every key.
    Keys,
    /// Giving other keys to commands.
    SetKeys(KeysView),
    /// What this program is.
    About,
}
