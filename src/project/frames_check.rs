//! Whether the files that a project names are still what they were, told by their hash, and where a lost one may be.

use std::path::{Path, PathBuf};

use super::document::FrameRef;
use super::paths::resolve;
use crate::frames::{Frame, FrameError};

/// What became of a frame's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameStatus {
    /// The very file that was marked.
    Ok,
    /// No file at the path.
    Missing {
        /// The path.
        path: PathBuf,
    },
    /// A file, but another one.
    Changed {
        /// The path.
        path: PathBuf,
        /// Its hash.
        found: String,
    },
    /// A file that cannot be read.
    Unreadable {
        /// The path.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
}

impl FrameStatus {
    /// Whether the marks can be trusted to lie on this file's picture.
    pub fn is_ok(&self) -> bool {
        *self == Self::Ok
    }
}

impl std::fmt::Display for FrameStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ok => f.write_str("unchanged"),
            Self::Missing { path } => {
                write!(f, "{}: there is no such file; find it again, or put it back there", path.display())
            }
            Self::Changed { path, found } => {
                let short = found.get(..12).unwrap_or(found);
                let path = path.display();
                write!(
                    f,
                    "{path}: is not the picture that was marked (its SHA-256 begins with {short}); find that picture again"
                )
            }
            Self::Unreadable { path, reason } => write!(f, "{}: cannot be read ({reason})", path.display()),
        }
    }
}

/// Compares the file of a frame with the hash that the project holds.
pub fn status(project_path: &Path, frame: &FrameRef) -> FrameStatus {
    status_at(resolve(project_path, frame), &frame.sha256)
}

/// Compares a file with a hash.
pub fn status_at(path: PathBuf, sha256: &str) -> FrameStatus {
    match Frame::sha256_of(&path) {
        Ok(found) if found.eq_ignore_ascii_case(sha256) => FrameStatus::Ok,
        Ok(found) => FrameStatus::Changed { path, found },
        Err(FrameError::NotFound { .. }) => FrameStatus::Missing { path },
        Err(e) => FrameStatus::Unreadable { path, reason: e.to_string() },
    }
}

/// How deep [`find_by_hash`] goes into folders below the one given.
pub const SEARCH_DEPTH: usize = 4;
/// How many pictures [`find_by_hash`] reads at most.
pub const SEARCH_FILES: usize = 5_000;

/// Endings of the files that [`find_by_hash`] reads.
const PICTURES: &[&str] = &["png", "jpg", "jpeg", "bmp", "tif", "tiff", "webp"];

/// The picture with this hash in a folder or below it, nearest folders first.
///
/// Reads at most [`SEARCH_FILES`] pictures and goes at most [`SEARCH_DEPTH`] folders deep; links to folders are not followed.
pub fn find_by_hash(folder: &Path, sha256: &str) -> Option<PathBuf> {
    let mut level = vec![folder.to_owned()];
    let mut left = SEARCH_FILES;
    for _ in 0..=SEARCH_DEPTH {
        let mut deeper = Vec::new();
        for folder in &level {
            let Ok(entries) = std::fs::read_dir(folder) else { continue };
            let mut entries: Vec<_> = entries.filter_map(Result::ok).collect();
            entries.sort_by_key(std::fs::DirEntry::file_name);
            for entry in entries {
                let Ok(kind) = entry.file_type() else { continue };
                let path = entry.path();
                if kind.is_dir() {
                    deeper.push(path);
                } else if is_picture(&path) {
                    if left == 0 {
                        return None;
                    }
                    left -= 1;
                    if Frame::sha256_of(&path).is_ok_and(|found| found.eq_ignore_ascii_case(sha256)) {
                        return Some(path);
                    }
                }
            }
        }
        level = deeper;
    }
    None
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    PICTURES.iter().any(|p| ending.eq_ignore_ascii_case(p)) && path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// SHA-256 of "abc", FIPS 180-2, appendix B.1.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn a_frame_is_known_by_its_hash_and_found_again() {
        let dir = tempfile::tempdir().unwrap();
        let project = dir.path().join("p.frontalis.json");
        let frame = FrameRef { path: "a.png".into(), sha256: ABC.into(), width_px: 1, height_px: 1 };
        let path = dir.path().join("a.png");
        assert_eq!(status(&project, &frame), FrameStatus::Missing { path: path.clone() });
        fs::write(&path, "abc").unwrap();
        assert_eq!(status(&project, &frame), FrameStatus::Ok);
        fs::write(&path, "abd").unwrap();
        let changed = status(&project, &frame);
        assert!(matches!(changed, FrameStatus::Changed { .. }));
        assert!(changed.to_string().contains("is not the picture that was marked"));

        assert_eq!(find_by_hash(dir.path(), ABC), None);
        let deep = dir.path().join("x/y");
        fs::create_dir_all(&deep).unwrap();
        fs::write(deep.join("moved.PNG"), "abc").unwrap();
        fs::write(deep.join("text.txt"), "abc").unwrap();
        assert_eq!(find_by_hash(dir.path(), ABC), Some(deep.join("moved.PNG")));
    }

    #[test]
    fn the_search_ends() {
        let dir = tempfile::tempdir().unwrap();
        let too_deep = dir.path().join("1/2/3/4/5");
        fs::create_dir_all(&too_deep).unwrap();
        fs::write(too_deep.join("a.png"), "abc").unwrap();
        assert_eq!(find_by_hash(dir.path(), ABC), None);
        assert_eq!(find_by_hash(&dir.path().join("gone"), ABC), None);
    }
}
