//! Outputs that appear whole or not at all: a command writes into a hidden folder of its own, which is moved in place at the end.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use tempfile::TempDir;

use super::error::CliError;
use crate::project::whole_file;

/// A folder in the making. Dropped, it leaves nothing behind; so does Ctrl-C.
pub(super) struct Output {
    goal: PathBuf,
    /// The working folder, until it is moved: shared with the Ctrl-C handler.
    work: Arc<Mutex<Option<TempDir>>>,
    place: PathBuf,
    names: Vec<String>,
}

impl Output {
    /// Opens a hidden working folder on the disk of `goal`; no file of `goal` is touched yet.
    pub(super) fn folder(goal: &Path) -> Result<Self, CliError> {
        let refuse = |source| failed(goal.to_owned(), source);
        if goal.exists() && !goal.is_dir() {
            return Err(refuse(io::Error::new(io::ErrorKind::NotADirectory, "it is a file, not a folder")));
        }
        let work = Arc::new(Mutex::new(None));
        let at_interrupt = Arc::clone(&work);
        // Set before the working folder is made. Where no handler can be set, Ctrl-C leaves that hidden folder, and still
        // nothing half-written at the goal.
        let _ = ctrlc::set_handler(move || {
            // The lock is held while files are moved: they arrive whole, and then there is nothing to remove.
            let held: Option<TempDir> = at_interrupt.lock().unwrap_or_else(PoisonError::into_inner).take();
            drop(held);
            std::process::exit(130);
        });
        let place = {
            let mut held = work.lock().unwrap_or_else(PoisonError::into_inner);
            let made = tempfile::Builder::new().prefix(".frontalis-").suffix(".part").tempdir_in(nearest_folder(goal));
            held.insert(made.map_err(refuse)?).path().to_owned()
        };
        Ok(Self { goal: goal.to_owned(), work, place, names: Vec::new() })
    }

    /// Adds a file.
    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), CliError> {
        fs::write(self.place.join(name), bytes).map_err(|source| failed(self.goal.join(name), source))?;
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Adds a picture as PNG; gives its bytes.
    pub(super) fn write_png(&mut self, name: &'static str, picture: &image::RgbImage) -> Result<Vec<u8>, CliError> {
        let bytes = crate::export::png(picture).map_err(|source| CliError::Encode { name, source })?;
        self.write(name, &bytes)?;
        Ok(bytes)
    }

    /// Moves everything in place: the whole folder where there was none, otherwise file by file, replacing files of the
    /// same names only. When one cannot be moved, those before it are taken back.
    pub(super) fn finish(self) -> Result<(), CliError> {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(folder) = work.take() else { return Ok(()) };
        if !self.goal.exists() {
            let parent = crate::project::whole_file::folder_of(&self.goal);
            fs::create_dir_all(&parent).map_err(|source| failed(self.goal.clone(), source))?;
            whole_file::open_to_others(folder.path()).map_err(|source| failed(self.goal.clone(), source))?;
            fs::rename(folder.path(), &self.goal).map_err(|source| failed(self.goal.clone(), source))?;
            let _ = folder.keep();
            return Ok(());
        }
        for name in &self.names {
            let at = self.goal.join(name);
            if at.is_dir() {
                return Err(failed(at, io::Error::new(io::ErrorKind::IsADirectory, "a folder of this name is there")));
            }
        }
        let mut moved = Vec::new();
        for name in &self.names {
            let (new, at, former) =
                (folder.path().join(name), self.goal.join(name), folder.path().join(format!("{name}.former")));
            let kept = at.exists();
            let done = if kept { fs::rename(&at, &former) } else { Ok(()) };
            if let Err(source) = done.and_then(|()| fs::rename(&new, &at)) {
                if kept && former.exists() {
                    let _ = fs::rename(&former, &at);
                }
                take_back(&moved);
                return Err(failed(at, source));
            }
            moved.push((at, kept.then_some(former)));
        }
        Ok(())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        // The handler of Ctrl-C shares the folder, which therefore does not go by itself.
        drop(self.work.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

fn failed(path: PathBuf, source: io::Error) -> CliError {
    CliError::Write { path, source }
}

fn take_back(moved: &[(PathBuf, Option<PathBuf>)]) {
    for (at, former) in moved {
        let _ = match former {
            Some(former) => fs::rename(former, at),
            None => fs::remove_file(at),
        };
    }
}

/// `goal` where it exists, otherwise the nearest folder above it that does: the same disk, and a place that may be written.
fn nearest_folder(goal: &Path) -> PathBuf {
    let mut above = goal.to_owned();
    while !above.exists() {
        let next = crate::project::whole_file::folder_of(&above);
        if next == above {
            break;
        }
        above = next;
    }
    above
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_appears_at_the_end_and_nothing_before() {
        let dir = tempfile::tempdir().unwrap();
        let goal = dir.path().join("a/b/out");
        let mut output = Output::folder(&goal).unwrap();
        output.write("x.csv", b"1").unwrap();
        assert!(!dir.path().join("a").exists());
        output.finish().unwrap();
        assert_eq!(fs::read(goal.join("x.csv")).unwrap(), b"1");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        assert_eq!(fs::read_dir(&goal).unwrap().count(), 1);

        let mut dropped = Output::folder(&dir.path().join("never")).unwrap();
        dropped.write("x.csv", b"1").unwrap();
        drop(dropped);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_is_there_keeps_its_other_files() {
        let dir = tempfile::tempdir().unwrap();
        let goal = dir.path().join("out");
        fs::create_dir(&goal).unwrap();
        fs::write(goal.join("mine.txt"), "mine").unwrap();
        fs::write(goal.join("x.csv"), "old").unwrap();
        let mut output = Output::folder(&goal).unwrap();
        output.write("x.csv", b"new").unwrap();
        output.write("y.csv", b"new").unwrap();
        output.finish().unwrap();
        assert_eq!(fs::read_to_string(goal.join("mine.txt")).unwrap(), "mine");
        assert_eq!(fs::read_to_string(goal.join("x.csv")).unwrap(), "new");
        assert_eq!(fs::read_dir(&goal).unwrap().count(), 3);
    }

    #[test]
    fn a_name_that_cannot_be_taken_leaves_everything_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let goal = dir.path().join("out");
        fs::create_dir_all(goal.join("y.csv")).unwrap();
        fs::write(goal.join("x.csv"), "old").unwrap();
        let mut output = Output::folder(&goal).unwrap();
        output.write("x.csv", b"new").unwrap();
        output.write("y.csv", b"new").unwrap();
        assert!(matches!(output.finish(), Err(CliError::Write { .. })));
        assert_eq!(fs::read_to_string(goal.join("x.csv")).unwrap(), "old");
        let file = dir.path().join("file.txt");
        fs::write(&file, "").unwrap();
        assert!(Output::folder(&file).is_err());
        assert!(Output::folder(&file.join("out")).is_err());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
