//! A project file that cannot be read, with work beside it that can: the journal of unsaved work, and the copy of the last save.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::app::App;
use super::files::face_of;
use super::modal::Modal;
use crate::project::autosave::{self, Recovered};
use crate::project::whole_file::with_ending;
use crate::project::{Project, ProjectFileError, file};

/// What can stand for a spoilt file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rescue {
    /// The journal: the project after the last gesture.
    Journal,
    /// The copy of the save before the last.
    Copy,
}

impl Rescue {
    /// Both, the newer work first.
    pub const ALL: [Self; 2] = [Self::Journal, Self::Copy];

    /// Words of the button.
    pub fn label(self) -> &'static str {
        match self {
            Self::Journal => "Take the unsaved work",
            Self::Copy => "Take the copy before the last save",
        }
    }

    fn read(self, path: &Path) -> Option<Recovered> {
        match self {
            Self::Journal => autosave::newest_beside(path),
            Self::Copy => autosave::read(&with_ending(path, "bak")),
        }
    }
}

/// What can stand for the project at `path`, each with its age; nothing where the file itself can be read, or is a newer program's.
pub fn found_beside(path: &Path) -> Vec<(Rescue, String)> {
    if matches!(file::load(path), Ok(_) | Err(ProjectFileError::Newer { .. })) {
        return Vec::new();
    }
    Rescue::ALL.into_iter().filter_map(|r| r.read(path).map(|found| (r, age(found.saved_at)))).collect()
}

/// ", 5 minutes old".
pub(super) fn age(written: SystemTime) -> String {
    match written.elapsed().map_or(0, |age| age.as_secs() / 60) {
        0 => ", written a moment ago".to_owned(),
        1 => ", a minute old".to_owned(),
        minutes @ ..120 => format!(", {minutes} minutes old"),
        minutes @ ..2880 => format!(", {} hours old", minutes / 60),
        minutes => format!(", {} days old", minutes / 1440),
    }
}

impl App {
    /// Says why a project cannot be opened, and offers what lies beside it.
    pub fn offer_rescue(&mut self, path: &Path, why: String) {
        let found = found_beside(path);
        if found.is_empty() {
            self.fail("The project cannot be opened", why);
        } else {
            self.view.modal = Some(Modal::Spoilt { path: path.to_owned(), why, found });
        }
    }

    /// Opens what stands for a spoilt file, as unsaved work under a name of its own: the spoilt file is never overwritten.
    pub(super) fn rescue(&mut self, path: &Path, which: Rescue) {
        let Some(Recovered { project, .. }) = which.read(path) else {
            self.fail("The project cannot be opened", format!("{}: is no longer there", path.display()));
            return;
        };
        match face_of(&project, path) {
            Ok(face) => {
                self.set_face(&project.face, face);
                self.open_document(project, Some(free_name_beside(path)));
                self.document.saved = Project::default();
            }
            Err(why) => self.fail("The project cannot be opened", why),
        }
    }
}

/// `a-recovered.frontalis.json`, or with a number, where there is no file yet: in the same folder, so that relative paths stay right.
fn free_name_beside(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.strip_suffix(&format!(".{}", file::EXTENSION)).unwrap_or(&name).to_owned();
    let numbered = |n: usize| if n == 1 { String::new() } else { format!("-{n}") };
    let candidates = (1..).map(|n| path.with_file_name(format!("{stem}-recovered{}.{}", numbered(n), file::EXTENSION)));
    candidates.into_iter().find(|p| !p.exists()).unwrap_or_else(|| path.to_owned())
}
