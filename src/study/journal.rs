//! The journal of a study under way: every finished case is a line of a file, so that a study that was stopped goes on where it was.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::table::Run;

/// What a journal is of. Only the very same study goes on from it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heading {
    /// The study.
    pub study: String,
    /// What decides its rows: size, seeds, face.
    pub question: String,
    /// What decides its times: machine and build.
    pub machine: String,
}

impl Heading {
    /// A name of a few letters that is the same for the same study alone.
    pub fn short(&self) -> String {
        let mut hash = Sha256::new();
        for word in [&self.study, &self.question, &self.machine] {
            hash.update(word.as_bytes());
            hash.update([0]);
        }
        let digest = hash.finalize();
        let letter = |half: u8| char::from_digit(u32::from(half), 16).unwrap_or('0');
        digest.iter().take(6).flat_map(|b| [letter(b >> 4), letter(b & 15)]).collect()
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    case: String,
    runs: Vec<Run>,
}

/// Why there is no journal.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The file cannot be read or written.
    #[error("{}: the journal of the study cannot be {what} ({source}); choose another folder, or free it for writing", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// "read" or "written".
        what: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// Another study was begun there.
    #[error("{}: a study was begun here {what}; finish it as it was begun, choose another folder, or start anew without it", .path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// How it differs.
        what: String,
    },
}

/// The finished cases of a study, on disk or in memory alone.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: Option<File>,
    finished: BTreeMap<String, Vec<Run>>,
}

impl Journal {
    /// A journal that is kept nowhere.
    pub fn in_memory() -> Self {
        Self { path: PathBuf::new(), file: None, finished: BTreeMap::new() }
    }

    /// Opens the journal of a study, or begins it. A last line that was not finished is cut off.
    ///
    /// # Errors
    /// [`JournalError`]; the file of another study is left as it is.
    pub fn open(path: &Path, heading: &Heading) -> Result<Self, JournalError> {
        let failed = |what| move |source| JournalError::File { path: path.to_owned(), what, source };
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = file.map_err(failed("written"))?;
        let mut lines = BufReader::new(&file);
        let (mut text, mut whole, mut finished) = (String::new(), 0_u64, BTreeMap::new());
        let length = lines.read_line(&mut text).map_err(failed("read"))?;
        if text.ends_with('\n') {
            let other = |what: String| JournalError::Other { path: path.to_owned(), what };
            let found: Heading =
                serde_json::from_str(&text).map_err(|_| other("by another version, or it is no journal".into()))?;
            if let Some(what) = difference(&found, heading) {
                return Err(other(what));
            }
            whole = length as u64;
            loop {
                text.clear();
                // Half a letter at the end is an unfinished line like any other.
                let Ok(length) = lines.read_line(&mut text) else { break };
                let Some(line) = text.strip_suffix('\n').and_then(|l| serde_json::from_str::<Line>(l).ok()) else {
                    break;
                };
                whole += length as u64;
                finished.insert(line.case, line.runs);
            }
        } else if !text.is_empty() && !text.starts_with('{') {
            return Err(JournalError::Other { path: path.to_owned(), what: "that is no study".into() });
        }
        drop(lines);
        file.set_len(whole).map_err(failed("written"))?;
        file.seek(SeekFrom::End(0)).map_err(failed("written"))?;
        if whole == 0 {
            let line = serde_json::to_string(heading).map_err(io::Error::other).map_err(failed("written"))?;
            file.write_all(format!("{line}\n").as_bytes()).map_err(failed("written"))?;
        }
        Ok(Self { path: path.to_owned(), file: Some(file), finished })
    }

    /// The rows of a finished case.
    pub fn finished(&self, case: &str) -> Option<&[Run]> {
        self.finished.get(case).map(Vec::as_slice)
    }

    /// Notes a case as finished, on disk before it counts.
    ///
    /// # Errors
    /// A disk that takes no more.
    pub fn note(&mut self, case: &str, runs: Vec<Run>) -> Result<(), JournalError> {
        let line = Line { case: case.to_owned(), runs };
        if let Some(file) = &mut self.file {
            let text = serde_json::to_string(&line).map_err(io::Error::other);
            // One call: a program that is killed leaves the line whole or cut off, never mixed with another.
            let written = text.and_then(|text| file.write_all(format!("{text}\n").as_bytes()));
            written.map_err(|source| JournalError::File { path: self.path.clone(), what: "written", source })?;
        }
        self.finished.insert(line.case, line.runs);
        Ok(())
    }

    /// The study is done: its journal goes.
    pub fn remove(self) {
        if self.file.is_some() {
            drop(self.file);
            // One that stays is only a study that would begin at its end.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn difference(found: &Heading, asked: &Heading) -> Option<String> {
    if found.study != asked.study {
        return Some(format!("of another kind ({})", found.study));
    }
    if found.question != asked.question {
        return Some(format!("with other settings ({}, now {})", found.question, asked.question));
    }
    (found.machine != asked.machine).then(|| format!("on {}, now {}", found.machine, asked.machine))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heading() -> Heading {
        Heading { study: "stability".into(), question: "3 seeds".into(), machine: "a machine".into() }
    }

    fn run(method: &str) -> Vec<Run> {
        vec![Run::new("stability", "p", method, "x=1".into()).erring(0.1 + 0.2)]
    }

    #[test]
    fn a_journal_goes_on_after_a_line_that_was_cut_off() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        let mut journal = Journal::open(&path, &heading()).unwrap();
        journal.note("a", run("A")).unwrap();
        journal.note("b", run("B")).unwrap();
        drop(journal);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        let mut journal = Journal::open(&path, &heading()).unwrap();
        assert_eq!(journal.finished("a"), Some(run("A").as_slice()));
        assert_eq!(journal.finished("b"), None);
        journal.note("b", run("B")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), whole);
        journal.remove();
        assert!(!path.exists());
    }

    #[test]
    fn the_journal_of_another_study_is_left_as_it_is() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        drop(Journal::open(&path, &heading()).unwrap());
        let before = fs::read(&path).unwrap();
        let mut others = [heading(), heading(), heading()];
        others[0].study = "scaling".into();
        others[1].question = "4 seeds".into();
        others[2].machine = "another".into();
        for other in others {
            assert!(matches!(Journal::open(&path, &other), Err(JournalError::Other { .. })));
        }
        assert_eq!(fs::read(&path).unwrap(), before);
        let mut other = heading();
        other.question = "3 seed".into();
        assert!(other.short() != heading().short() && heading().short().len() == 12);
        fs::write(&path, "my notes").unwrap();
        assert!(matches!(Journal::open(&path, &heading()), Err(JournalError::Other { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "my notes");
        assert!(matches!(Journal::open(&dir.path().join("no/j"), &heading()), Err(JournalError::File { .. })));
    }
}
