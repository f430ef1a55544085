//! The project file, version 1: JSON that is read whole and checked, or refused with one line; written whole or not at all.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};

use super::document::Project;
use super::faults::{self, Fault};
use super::json::{self, JsonFault, Without};
use super::whole_file::{self, Durability, with_ending};
use crate::face::FaceModel;

/// The version that this program writes, and the highest that it reads.
pub const VERSION: u64 = 1;

/// What the names of project files end in.
pub const EXTENSION: &str = "frontalis.json";

/// Largest file that is opened. A project with 100 000 marks is under 20 MB.
pub const MAX_BYTES: u64 = 64 << 20;

/// The field that says what the file is, and of which version.
const VERSION_FIELD: &str = "frontalis_project";

/// Why a project could not be read or written. `Display` is one line: the file, the place, the reason, the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ProjectFileError {
    /// The file cannot be read.
    #[error("{}: cannot be read ({source}); check the path and its permissions", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is larger than any project.
    #[error("{}: is larger than {} MB, which no project is; check that this is a project file", .path.display(), MAX_BYTES >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The bytes are no text.
    #[error("{}: is not text (byte {at} is not UTF-8); check that this is a project file", .path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first bad byte.
        at: usize,
    },
    /// The text is not JSON, or a field is missing, unknown, twice, or of the wrong type.
    #[error("{}: line {line}, column {column}{}: {reason}; mend it there, or take the copy {}", .path.display(), in_field(.place), with_ending(.path, "bak").display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field; empty where there is none.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// JSON, but no project.
    #[error("{}: is not a Frontalis project (it has no field `{VERSION_FIELD}`); choose a file that ends in .{EXTENSION}", .path.display())]
    NotAProject {
        /// The file.
        path: PathBuf,
    },
    /// A newer program wrote it.
    #[error("{}: made by a newer Frontalis (format {found}, this one reads up to {VERSION}): update Frontalis", .path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
    },
    /// A value that makes no sense.
    #[error("{}: {fault}{}", .path.display(), and_more(.path, *.more))]
    Value {
        /// The file.
        path: PathBuf,
        /// The first such value.
        fault: Fault,
        /// How many there are besides.
        more: usize,
    },
    /// The file cannot be written; what was there is still there.
    #[error("{}: cannot be written ({source}); choose another folder, or free it for writing", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// What stands at the path is no project that this program can read, and might be somebody's work.
    #[error("{}: holds something that is not a readable project and is not overwritten; save under another name", .path.display())]
    WouldOverwrite {
        /// The file.
        path: PathBuf,
    },
}

fn in_field(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!(", field {place}") }
}

fn and_more(path: &Path, more: usize) -> String {
    if more == 0 {
        String::new()
    } else {
        format!(" (and {more} more: `frontalis check {}` lists them)", path.display())
    }
}

/// Reads a project; refuses whatever is not one, down to single values.
pub fn load(path: &Path) -> Result<Project, ProjectFileError> {
    let project = parse(path, &read_bytes(path)?)?;
    refuse(path, faults::of_values(&project))?;
    Ok(project)
}

/// Reads a project whose values may make no sense, so that [`faults`] can list all of them.
pub fn load_unchecked(path: &Path) -> Result<Project, ProjectFileError> {
    parse(path, &read_bytes(path)?)
}

/// Refuses a project that marks landmarks or vertices which its face does not have.
pub fn check_bindings(path: &Path, project: &Project, face: &FaceModel) -> Result<(), ProjectFileError> {
    refuse(path, faults::of_bindings(project, face))
}

/// Writes a project: whole or not at all, what was there kept as `<name>.bak`.
///
/// Something at the path that cannot be read as a project is never overwritten, and a project that could not be
/// read back is not written.
pub fn save(project: &Project, path: &Path) -> Result<(), ProjectFileError> {
    let bytes = to_bytes(path, project)?;
    let failed = |source| ProjectFileError::Write { path: path.to_owned(), source };
    if let Ok(former) = fs::symlink_metadata(path) {
        let unreadable = || ProjectFileError::WouldOverwrite { path: path.to_owned() };
        if former.is_dir() {
            return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")));
        }
        let kept = read_bytes(path).map_err(|_| unreadable())?;
        parse(path, &kept).map_err(|_| unreadable())?;
        if kept == bytes {
            return Ok(());
        }
        whole_file::write(&with_ending(path, "bak"), &kept, Durability::Disk).map_err(failed)?;
    }
    whole_file::write(path, &bytes, Durability::Disk).map_err(failed)
}

/// The bytes of a project file, checked: what is written can be read back. `path` serves the messages alone.
pub fn to_bytes(path: &Path, project: &Project) -> Result<Vec<u8>, ProjectFileError> {
    refuse(path, faults::of_values(project))?;
    let too_strange = |e: serde_json::Error| ProjectFileError::Write { path: path.to_owned(), source: e.into() };
    json::write(&WriteOne { frontalis_project: VERSION, project }).map_err(too_strange)
}

/// A project from the bytes of a file, version first.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Project, ProjectFileError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| ProjectFileError::NotText { path: path.to_owned(), at: e.valid_up_to() })?;
    // A byte order mark is what some editors put before a text.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let syntax = |JsonFault { line, column, place, reason }| ProjectFileError::Syntax {
        path: path.to_owned(),
        line,
        column,
        place,
        reason,
    };
    let head: Head = json::with_place(text).map_err(syntax)?;
    match head.frontalis_project {
        None => Err(ProjectFileError::NotAProject { path: path.to_owned() }),
        Some(VERSION) => json::read::<ReadOne>(text).map(|ReadOne(project)| project).map_err(syntax),
        Some(0) => {
            let fault = Fault { place: VERSION_FIELD.to_owned(), reason: "versions begin at 1".to_owned() };
            Err(ProjectFileError::Value { path: path.to_owned(), fault, more: 0 })
        }
        Some(found) => Err(ProjectFileError::Newer { path: path.to_owned(), found }),
    }
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, ProjectFileError> {
    let failed = |source| ProjectFileError::Read { path: path.to_owned(), source };
    // A pipe or a device has no end, and reading a folder fails with a riddle.
    let found = fs::metadata(path).map_err(failed)?;
    if !found.is_file() {
        let what = if found.is_dir() { "it is a folder" } else { "it is not a file" };
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, what)));
    }
    let file = fs::File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(ProjectFileError::TooLarge { path: path.to_owned() });
    }
    Ok(bytes)
}

fn refuse(path: &Path, faults: Vec<Fault>) -> Result<(), ProjectFileError> {
    let more = faults.len().saturating_sub(1);
    match faults.into_iter().next() {
        Some(fault) => Err(ProjectFileError::Value { path: path.to_owned(), fault, more }),
        None => Ok(()),
    }
}

/// The one field that is read before anything else.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    frontalis_project: Option<u64>,
}

/// Version 1 as written: the version, then the fields of the project.
#[derive(Serialize)]
struct WriteOne<'a> {
    frontalis_project: u64,
    #[serde(flatten)]
    project: &'a Project,
}

/// Version 1 as read: the fields of the project beside the version, each with its line and column.
struct ReadOne(Project);

impl<'de> Deserialize<'de> for ReadOne {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = Project;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a project")
            }

            fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<Project, A::Error> {
                Project::deserialize(MapAccessDeserializer::new(Without { entries, key: VERSION_FIELD }))
            }
        }
        deserializer.deserialize_map(Fields).map(ReadOne)
    }
}

#[cfg(test)]
mod tests;
