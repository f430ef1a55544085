//! The journal: the project as it was after the last gesture, kept beside its file until the file is saved.
//!
//! It is a project file like any other, so that it can be opened by hand when all else fails. It is written whole after
//! every committed gesture; a program that is killed loses at most the gesture in progress.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::document::Project;
use super::file::{self, ProjectFileError};
use super::whole_file::{self, Durability, with_ending};

/// What the name of a journal ends in.
pub const ENDING: &str = "autosave";

/// A project that was not saved.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovered {
    /// As it was after the last gesture.
    pub project: Project,
    /// When that was.
    pub saved_at: SystemTime,
}

/// The journal of a project: beside its file, or in the user's folder for such things while it has none.
///
/// Absent only where the system names no such folder.
pub fn path(project_path: Option<&Path>) -> Option<PathBuf> {
    match project_path {
        Some(project) => Some(with_ending(project, ENDING)),
        None => {
            Some(state_folder(&|name| std::env::var_os(name))?.join(format!("unnamed.{}.{ENDING}", file::EXTENSION)))
        }
    }
}

/// Writes the journal: whole or not at all, without waiting for the disk (a few hundred microseconds).
pub fn write(project: &Project, journal: &Path) -> Result<(), ProjectFileError> {
    let bytes = file::to_bytes(journal, project)?;
    let failed = |source| ProjectFileError::Write { path: journal.to_owned(), source };
    fs::create_dir_all(whole_file::folder_of(journal)).map_err(failed)?;
    whole_file::write(journal, &bytes, Durability::Process).map_err(failed)
}

/// Removes the journal after a save or when the user lets the changes go.
pub fn remove(journal: &Path) {
    // One that cannot be removed is offered again at the next start, and nothing is lost.
    let _ = fs::remove_file(journal);
}

/// What was not saved: the journal of a project, where it is not older than the project's file and differs from it.
///
/// A damaged journal is none.
pub fn recover(project_path: Option<&Path>) -> Option<Recovered> {
    recover_from(&path(project_path)?, project_path)
}

fn recover_from(journal: &Path, project_path: Option<&Path>) -> Option<Recovered> {
    let saved_at = fs::metadata(journal).ok()?.modified().ok()?;
    let project = file::load(journal).ok()?;
    if let Some(saved) = project_path {
        let older = fs::metadata(saved).and_then(|m| m.modified()).is_ok_and(|at| saved_at < at);
        if older || file::load(saved).is_ok_and(|s| s == project) {
            return None;
        }
    } else if project == Project::default() {
        return None;
    }
    Some(Recovered { project, saved_at })
}

/// Where programs keep what should survive them but is no document.
fn state_folder(variable: &dyn Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let folder = |name: &str| variable(name).map(PathBuf::from).filter(|p| p.is_absolute());
    let base = if cfg!(windows) {
        folder("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        folder("HOME").map(|h| h.join("Library/Application Support"))
    } else {
        folder("XDG_STATE_HOME").or_else(|| folder("HOME").map(|h| h.join(".local/state")))
    };
    Some(base?.join("frontalis"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Project {
        Project { name: name.into(), ..Project::default() }
    }

    #[test]
    fn what_was_not_saved_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let saved = dir.path().join("p.frontalis.json");
        let journal = path(Some(&saved)).unwrap();
        assert_eq!(journal, dir.path().join("p.frontalis.json.autosave"));
        assert_eq!(recover(Some(&saved)), None);
        file::save(&named("saved"), &saved).unwrap();
        write(&named("saved"), &journal).unwrap();
        assert_eq!(recover(Some(&saved)), None);
        write(&named("later"), &journal).unwrap();
        assert_eq!(recover(Some(&saved)).unwrap().project, named("later"));
        // The file itself may be gone or spoilt: the journal is all the more wanted.
        fs::write(&saved, "spoilt").unwrap();
        write(&named("later"), &journal).unwrap();
        assert_eq!(recover(Some(&saved)).unwrap().project, named("later"));
        remove(&journal);
        assert_eq!(recover(Some(&saved)), None);
    }

    #[test]
    fn a_damaged_or_older_journal_is_none() {
        let dir = tempfile::tempdir().unwrap();
        let saved = dir.path().join("p.frontalis.json");
        let journal = path(Some(&saved)).unwrap();
        write(&named("later"), &journal).unwrap();
        let whole = fs::read(&journal).unwrap();
        for length in 0..whole.len() - 1 {
            fs::write(&journal, &whole[..length]).unwrap();
            assert_eq!(recover(Some(&saved)), None);
        }
        fs::write(&journal, &whole).unwrap();
        file::save(&named("saved"), &saved).unwrap();
        let old = SystemTime::now() - std::time::Duration::from_mins(1);
        fs::File::options().write(true).open(&journal).unwrap().set_modified(old).unwrap();
        assert_eq!(recover(Some(&saved)), None);
    }

    #[test]
    fn an_unnamed_project_has_a_place_too() {
        let home =
            |name: &str| (name == "HOME" || name == "LOCALAPPDATA").then(|| OsString::from(std::env::temp_dir()));
        assert!(state_folder(&home).unwrap().ends_with("frontalis"));
        assert_eq!(state_folder(&|_| None), None);
        assert_eq!(state_folder(&|_| Some(OsString::from("relative"))), None);
    }
}
