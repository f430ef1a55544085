//! The journal: the project as it was after the last gesture, kept beside its file until the file is saved.
//!
//! It is a project file like any other, so that it can be opened by hand when all else fails. It is written whole after
//! every committed gesture; a program that is killed loses at most the gesture in progress.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};

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
    /// Whether the project's file was saved since, by another window or another program.
    pub older: bool,
}

/// The journal of a project with a file: beside it. Further windows on the same file have others, see [`Named`].
pub fn beside(project: &Path) -> PathBuf {
    with_ending(project, ENDING)
}

/// Where windows on this file keep their journals.
fn places(project: &Path) -> impl Iterator<Item = PathBuf> {
    let first = beside(project);
    (1..=MOST_WINDOWS).map(move |n| if n == 1 { first.clone() } else { with_ending(&first, &n.to_string()) })
}

/// The newest journal beside this file that can be read.
pub fn newest_beside(project: &Path) -> Option<Recovered> {
    places(project).filter_map(|p| read(&p)).max_by_key(|r| r.saved_at)
}

/// The place where a window keeps the journal of a project with a file. No other window on the same file has the same one, so that
/// neither writes over, takes or removes the other's work.
#[derive(Debug)]
pub struct Named {
    journal: PathBuf,
    /// Locked while the window lives; absent where locks cannot be kept.
    _lock: Option<File>,
}

impl Named {
    /// Takes a place beside the file that no living window holds: the one with the newest work of a window that died, if there is any.
    ///
    /// Locks lie in `locks`, under a hash of the file's path: the project's own folder stays clean. Without such a folder, or where all
    /// places are held, the first place is taken.
    pub fn take(project: &Path, locks: Option<&Path>) -> Self {
        let first = || Self { journal: beside(project), _lock: None };
        let Some(locks) = locks.filter(|l| fs::create_dir_all(l).is_ok()) else { return first() };
        // Two windows that name one file differently still mean one file.
        let real =
            project.canonicalize().or_else(|_| std::path::absolute(project)).unwrap_or_else(|_| project.to_owned());
        let hash = Sha256::digest(real.as_os_str().as_encoded_bytes());
        let name = hash.iter().take(16).fold(0_u128, |number, b| number << 8 | u128::from(*b));
        let mut free: Vec<Self> = Vec::new();
        for (n, journal) in places(project).enumerate() {
            let path = locks.join(format!("{name:032x}-{}.lock", n + 1));
            let Ok(lock) = File::options().create(true).truncate(false).write(true).open(&path) else { continue };
            if lock.try_lock().is_ok() {
                free.push(Self { journal, _lock: Some(lock) });
            }
        }
        let written = |place: &Self| fs::metadata(&place.journal).and_then(|m| m.modified()).ok();
        // Of those without work in them the first.
        let newest = (0..free.len()).rev().max_by_key(|&i| written(&free[i]));
        newest.map_or_else(first, |i| free.swap_remove(i))
    }

    /// Its journal.
    pub fn journal(&self) -> &Path {
        &self.journal
    }
}

/// Windows on one file that are told apart.
const MOST_WINDOWS: usize = 8;

/// The place where a window keeps the journal of a project that has no file yet. No other window has the same one.
#[derive(Debug)]
pub struct Unnamed {
    journal: PathBuf,
    /// Locked while the window lives; the system frees it when the program ends, however it ends.
    _lock: File,
}

impl Unnamed {
    /// Takes a place in the folder that no living window holds: one with work left by a window that died, if there is any.
    ///
    /// Absent where the folder cannot be written.
    pub fn take(folder: &Path) -> Option<Self> {
        fs::create_dir_all(folder).ok()?;
        let mut free = None;
        for n in 1..=MOST_UNNAMED {
            let name = if n == 1 { "unnamed".to_owned() } else { format!("unnamed-{n}") };
            let journal = folder.join(format!("{name}.{}.{ENDING}", file::EXTENSION));
            let path = folder.join(format!("{name}.lock"));
            let fresh = !path.exists() && !journal.exists();
            let Ok(lock) = File::options().create(true).truncate(false).write(true).open(&path) else { continue };
            if lock.try_lock().is_err() {
                continue;
            }
            let left = journal.exists();
            if left || free.is_none() {
                free = Some(Self { journal, _lock: lock });
            }
            if left || fresh {
                break;
            }
        }
        free
    }

    /// Its journal.
    pub fn journal(&self) -> &Path {
        &self.journal
    }
}

/// Windows without a project file that are told apart; a further one keeps no journal.
const MOST_UNNAMED: usize = 64;

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

/// What was not saved: the journal, where it differs from the project's file. A file that is newer was saved by another window: the
/// journal is still somebody's work, and the person is told so.
///
/// A damaged journal is none.
pub fn recover(journal: &Path, project_path: Option<&Path>) -> Option<Recovered> {
    let mut found = read(journal)?;
    if let Some(saved) = project_path {
        match file::load(saved) {
            Ok(same) if same == found.project => return None,
            Ok(_) => found.older = fs::metadata(saved).and_then(|m| m.modified()).is_ok_and(|at| found.saved_at < at),
            // Of a file that is gone or spoilt the age says nothing.
            Err(_) => {}
        }
    } else if found.project == Project::default() {
        return None;
    }
    Some(found)
}

/// A journal, or the copy that a save has kept, if it can be read.
pub fn read(path: &Path) -> Option<Recovered> {
    let saved_at = fs::metadata(path).ok()?.modified().ok()?;
    Some(Recovered { project: file::load(path).ok()?, saved_at, older: false })
}

/// Where this system keeps what should survive programs but is no document; absent where it names no such folder.
pub fn state_folder() -> Option<PathBuf> {
    state_folder_of(&|name| std::env::var_os(name))
}

fn state_folder_of(variable: &dyn Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
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
        let journal = beside(&saved);
        assert_eq!(journal, dir.path().join("p.frontalis.json.autosave"));
        assert_eq!(recover(&journal, Some(&saved)), None);
        file::save(&named("saved"), &saved).unwrap();
        write(&named("saved"), &journal).unwrap();
        assert_eq!(recover(&journal, Some(&saved)), None);
        write(&named("later"), &journal).unwrap();
        assert_eq!(recover(&journal, Some(&saved)).unwrap().project, named("later"));
        // The file itself may be gone or spoilt, even after the journal was written: the journal is all the more wanted.
        fs::write(&saved, "spoilt").unwrap();
        assert_eq!(recover(&journal, Some(&saved)).unwrap().project, named("later"));
        remove(&journal);
        assert_eq!(recover(&journal, Some(&saved)), None);
    }

    #[test]
    fn a_damaged_journal_is_none_and_an_older_one_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let saved = dir.path().join("p.frontalis.json");
        let journal = beside(&saved);
        write(&named("later"), &journal).unwrap();
        let whole = fs::read(&journal).unwrap();
        for length in 0..whole.len() - 1 {
            fs::write(&journal, &whole[..length]).unwrap();
            assert_eq!(recover(&journal, Some(&saved)), None);
        }
        fs::write(&journal, &whole).unwrap();
        file::save(&named("saved"), &saved).unwrap();
        let old = SystemTime::now() - std::time::Duration::from_mins(1);
        fs::File::options().write(true).open(&journal).unwrap().set_modified(old).unwrap();
        // Saved since by another window: the work in the journal is not in the file.
        let found = recover(&journal, Some(&saved)).unwrap();
        assert!(found.older && found.project == named("later"));
        file::save(&named("later"), &saved).unwrap();
        assert_eq!(recover(&journal, Some(&saved)), None);
    }

    #[test]
    fn windows_on_one_file_have_journals_of_their_own_and_the_newest_left_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let (saved, locks) = (dir.path().join("p.frontalis.json"), dir.path().join("state"));
        file::save(&named("saved"), &saved).unwrap();
        let take = || Named::take(&saved, Some(&locks));
        let (one, two) = (take(), take());
        assert_eq!(
            (one.journal(), two.journal()),
            (beside(&saved).as_path(), with_ending(&beside(&saved), "2").as_path())
        );
        write(&named("of one"), one.journal()).unwrap();
        write(&named("of two"), two.journal()).unwrap();
        let later = SystemTime::now() + std::time::Duration::from_secs(5);
        fs::File::options().write(true).open(two.journal()).unwrap().set_modified(later).unwrap();
        assert_eq!(newest_beside(&saved).unwrap().project, named("of two"));
        // While both live, neither's work is offered to a third.
        let three = take();
        assert_eq!(recover(three.journal(), Some(&saved)), None);
        drop((one, two));
        let four = take();
        assert_eq!(recover(four.journal(), Some(&saved)).unwrap().project, named("of two"));
        remove(four.journal());
        drop((three, four));
        assert_eq!(recover(take().journal(), Some(&saved)).unwrap().project, named("of one"));
        // Without a place for locks there is one journal, as ever.
        assert_eq!(Named::take(&saved, None).journal(), beside(&saved));
    }

    #[test]
    fn an_unnamed_project_has_a_place_too() {
        let home =
            |name: &str| (name == "HOME" || name == "LOCALAPPDATA").then(|| OsString::from(std::env::temp_dir()));
        assert!(state_folder_of(&home).unwrap().ends_with("frontalis"));
        assert_eq!(state_folder_of(&|_| None), None);
        assert_eq!(state_folder_of(&|_| Some(OsString::from("relative"))), None);
    }

    #[test]
    fn two_windows_without_a_file_have_two_journals_and_what_a_dead_one_left_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let one = Unnamed::take(dir.path()).unwrap();
        let two = Unnamed::take(dir.path()).unwrap();
        assert_ne!(one.journal(), two.journal());
        write(&named("of the second"), two.journal()).unwrap();
        let left = two.journal().to_owned();
        drop(two);
        // The first window lives, so its place is not taken; the second one's work waits for whoever comes next.
        let three = Unnamed::take(dir.path()).unwrap();
        assert_eq!(three.journal(), left);
        assert_eq!(recover(three.journal(), None).unwrap().project, named("of the second"));
        drop((one, three));
        // With both places free, the one with work in it comes first.
        assert_eq!(Unnamed::take(dir.path()).unwrap().journal(), left);
    }
}
