//! A folder of numbered frames: its pictures in the order of their numbers, with the first and the last of a motion proposed.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Endings of the picture files that a folder is searched for, lower case.
const ENDINGS: [&str; 7] = ["png", "jpg", "jpeg", "bmp", "tif", "tiff", "webp"];

/// The pictures of a folder, and the two of them that stand for the start and the end of an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameSequence {
    paths: Vec<PathBuf>,
    first: usize,
    last: usize,
}

/// Why a folder did not become a sequence: which folder, what is wrong, what to do, in one line.
#[derive(Debug, thiserror::Error)]
pub enum SequenceError {
    /// No such folder.
    #[error("{}: there is no such folder; check the path", folder.display())]
    NotFound {
        /// The folder.
        folder: PathBuf,
    },
    /// A file stands where a folder was expected.
    #[error("{}: this is a file, not a folder; choose the folder that holds the frames", folder.display())]
    NotAFolder {
        /// What was named.
        folder: PathBuf,
    },
    /// The system did not let it be listed.
    #[error("{}: the folder cannot be listed ({reason}); check the permissions", folder.display())]
    Unreadable {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        reason: std::io::Error,
    },
    /// No picture in it.
    #[error("{}: no PNG, JPEG, BMP, TIFF or WebP picture in this folder; choose the one that holds the frames", folder.display())]
    NoPictures {
        /// The folder.
        folder: PathBuf,
    },
    /// A motion needs a start and an end.
    #[error("{}: only one picture in this folder ({}); a motion needs a first and a last frame", folder.display(), only.display())]
    OnlyOne {
        /// The folder.
        folder: PathBuf,
        /// Name of the one picture.
        only: PathBuf,
    },
    /// The choice names a frame that is not there, or one frame twice.
    #[error("frames {} and {} of {count} cannot be the first and the last; choose two different ones", first + 1, last + 1)]
    Choice {
        /// Index of the first frame, from 0.
        first: usize,
        /// Index of the last frame, from 0.
        last: usize,
        /// Number of frames.
        count: usize,
    },
}

impl FrameSequence {
    /// Lists the pictures of a folder (not of the folders in it; hidden files are passed over).
    ///
    /// The first and the last of the longest run of files that differ by their number alone are proposed, so that a stray
    /// `overview.png` is neither; where no file bears a number, the first and the last of all.
    ///
    /// # Errors
    /// Fewer than two pictures, or a folder that cannot be listed.
    pub fn open(folder: &Path) -> Result<Self, SequenceError> {
        let owned = || folder.to_owned();
        let unreadable = |reason: std::io::Error| match reason.kind() {
            std::io::ErrorKind::NotFound => SequenceError::NotFound { folder: owned() },
            std::io::ErrorKind::NotADirectory => SequenceError::NotAFolder { folder: owned() },
            _ => SequenceError::Unreadable { folder: owned(), reason },
        };
        let mut named = Vec::new();
        for entry in folder.read_dir().map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            if is_picture(&name) && path.is_file() {
                named.push((name, path));
            }
        }
        named.sort_by(|(a, _), (b, _)| natural(a, b));
        match named.as_slice() {
            [] => Err(SequenceError::NoPictures { folder: owned() }),
            [(name, _)] => Err(SequenceError::OnlyOne { folder: owned(), only: name.into() }),
            _ => {
                let names: Vec<&str> = named.iter().map(|(n, _)| n.as_str()).collect();
                let (first, last) = proposal(&names);
                Ok(Self { paths: named.into_iter().map(|(_, p)| p).collect(), first, last })
            }
        }
    }

    /// The pictures in the natural order of their names (2 before 10).
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Index of the first frame of the motion.
    pub fn first(&self) -> usize {
        self.first
    }

    /// Index of the last frame of the motion.
    pub fn last(&self) -> usize {
        self.last
    }

    /// The first and the last frame of the motion.
    pub fn chosen(&self) -> [&Path; 2] {
        [&self.paths[self.first], &self.paths[self.last]]
    }

    /// Chooses other frames; the last may stand before the first (an expression that relaxes, played backwards).
    ///
    /// # Errors
    /// [`SequenceError::Choice`] for an index that does not exist and for one frame twice; the choice then stays as it was.
    pub fn choose(&mut self, first: usize, last: usize) -> Result<(), SequenceError> {
        let count = self.paths.len();
        if first >= count || last >= count || first == last {
            return Err(SequenceError::Choice { first, last, count });
        }
        (self.first, self.last) = (first, last);
        Ok(())
    }
}

fn is_picture(name: &str) -> bool {
    let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase());
    !name.starts_with('.') && ending.is_some_and(|e| ENDINGS.contains(&e.as_str()))
}

/// Ends of the longest run of names that are equal but for their last number; all names where there is no such run.
fn proposal(names: &[&str]) -> (usize, usize) {
    let mut runs: BTreeMap<(&str, &str), (usize, usize, usize)> = BTreeMap::new();
    for (i, name) in names.iter().enumerate() {
        if let Some(around) = around_last_number(name) {
            let run = runs.entry(around).or_insert((0, i, i));
            *run = (run.0 + 1, run.1, i);
        }
    }
    // Of equal runs the one that comes first.
    let longest = runs.values().copied().filter(|r| r.0 > 1).min_by_key(|r| (std::cmp::Reverse(r.0), r.1));
    longest.map_or((0, names.len() - 1), |(_, first, last)| (first, last))
}

/// What stands before and behind the last run of digits of a name.
fn around_last_number(name: &str) -> Option<(&str, &str)> {
    let end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let before = name[..end].trim_end_matches(|c: char| c.is_ascii_digit());
    Some((before, &name[end..]))
}

/// Compares names as people count: runs of digits by value, the rest letter by letter without regard to case.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a, b);
    while !x.is_empty() && !y.is_empty() {
        let (number_x, rest_x) = split_number(x);
        let (number_y, rest_y) = split_number(y);
        let order = if number_x.is_empty() || number_y.is_empty() {
            let (p, q) = (x.chars().next(), y.chars().next());
            (x, y) = (after_first_letter(x), after_first_letter(y));
            p.map(char::to_lowercase).into_iter().flatten().cmp(q.map(char::to_lowercase).into_iter().flatten())
        } else {
            (x, y) = (rest_x, rest_y);
            // Without leading zeros the longer number is the larger one: no number is too long to compare.
            let (p, q) = (number_x.trim_start_matches('0'), number_y.trim_start_matches('0'));
            p.len().cmp(&q.len()).then_with(|| p.cmp(q))
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    x.len().cmp(&y.len()).then_with(|| a.cmp(b))
}

fn split_number(text: &str) -> (&str, &str) {
    text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()))
}

fn after_first_letter(text: &str) -> &str {
    let mut letters = text.chars();
    letters.next();
    letters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_of(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            std::fs::write(folder.path().join(name), b"x").unwrap();
        }
        folder
    }

    fn names(sequence: &FrameSequence) -> Vec<String> {
        sequence.paths().iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn frames_stand_in_the_order_of_their_numbers() {
        let folder = folder_of(&["f10.png", "f2.PNG", "f1.png", "f002.png", "notes.txt", ".f3.png", "f100.jpeg"]);
        std::fs::create_dir(folder.path().join("f0.png")).unwrap();
        let sequence = FrameSequence::open(folder.path()).unwrap();
        assert_eq!(names(&sequence), ["f1.png", "f002.png", "f2.PNG", "f10.png", "f100.jpeg"]);
    }

    #[test]
    fn the_longest_numbered_run_is_proposed_and_both_ends_can_be_changed() {
        let folder =
            folder_of(&["a_1.png", "a_2.png", "take2_0009.png", "take2_0010.png", "take2_0011.png", "zoo.png"]);
        let mut sequence = FrameSequence::open(folder.path()).unwrap();
        let chosen = sequence.chosen().map(|p| p.file_name().unwrap().to_string_lossy().into_owned());
        assert_eq!(chosen, ["take2_0009.png", "take2_0011.png"]);
        sequence.choose(1, 0).unwrap();
        assert_eq!((sequence.first(), sequence.last()), (1, 0));
        assert!(sequence.choose(3, 3).is_err() && sequence.choose(0, 6).is_err());
        assert_eq!((sequence.first(), sequence.last()), (1, 0));
    }

    #[test]
    fn pictures_without_numbers_give_the_first_and_the_last() {
        let folder = folder_of(&["neutral.png", "surprise.png"]);
        let sequence = FrameSequence::open(folder.path()).unwrap();
        assert_eq!((sequence.first(), sequence.last()), (0, 1));
    }

    #[test]
    fn a_folder_that_is_no_sequence_says_why() {
        let message = |p: &Path| FrameSequence::open(p).unwrap_err().to_string();
        let none = folder_of(&["notes.txt"]);
        assert!(message(none.path()).contains("no PNG"));
        assert!(message(&none.path().join("notes.txt")).contains("not a folder"));
        assert!(message(&none.path().join("gone")).contains("no such folder"));
        let one = folder_of(&["f1.png"]);
        assert!(message(one.path()).contains("only one picture in this folder (f1.png)"));
    }

    #[test]
    fn the_natural_order_is_an_order() {
        // Sorted by hand; every pair must agree with its place.
        let sorted = ["", "a", "a1", "a01", "a1b", "A2", "a10", "a99999999999999999999999", "b", "é1", "é2"];
        let by_value_then_text = |i: usize, j: usize| natural(sorted[i], sorted[j]);
        for i in 0..sorted.len() {
            for j in 0..sorted.len() {
                // "a1" and "a01" are the same number: the text decides, whichever way, but always the same way.
                if (i, j) != (2, 3) && (i, j) != (3, 2) {
                    assert_eq!(by_value_then_text(i, j), i.cmp(&j), "{} {}", sorted[i], sorted[j]);
                }
                assert_eq!(by_value_then_text(i, j), by_value_then_text(j, i).reverse());
            }
        }
    }
}
