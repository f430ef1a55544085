//! The embedded sample: a rendered brow raise with a painted grid, marked at the truth.
//!
//! It is what `frontalis twin --seed 1 --stated-sigma-px 0.1` writes, its pictures packed tighter without changing a pixel.

use std::path::Path;

use super::document::{FrameRef, Project};
use super::file::{self, ProjectFileError};

/// Name of the project file among the sample's files.
pub const PROJECT_NAME: &str = "sample.frontalis.json";
/// Name of the first frame.
pub const FIRST_NAME: &str = "first.png";
/// Name of the last frame.
pub const LAST_NAME: &str = "last.png";

const PROJECT: &[u8] = include_bytes!("../../assets/samples/brow_raise/sample.frontalis.json");
const FIRST: &[u8] = include_bytes!("../../assets/samples/brow_raise/first.png");
const LAST: &[u8] = include_bytes!("../../assets/samples/brow_raise/last.png");

/// The files of the sample, by name: the project and its two frames.
pub fn files() -> [(&'static str, &'static [u8]); 3] {
    [(PROJECT_NAME, PROJECT), (FIRST_NAME, FIRST), (LAST_NAME, LAST)]
}

/// The sample's project; its frames' paths are the bare names of [`files`].
///
/// # Errors
/// Never in a program whose tests pass: they read the same embedded bytes.
pub fn project() -> Result<Project, ProjectFileError> {
    file::parse(Path::new(PROJECT_NAME), PROJECT)
}

/// The bytes of one of the sample's frames, known by its hash.
pub fn frame_bytes(frame: &FrameRef) -> Option<&'static [u8]> {
    let sample = project().ok()?;
    let is = |named: &Option<FrameRef>| named.as_ref().is_some_and(|f| f.sha256.eq_ignore_ascii_case(&frame.sha256));
    if is(&sample.frames.first) {
        Some(FIRST)
    } else if is(&sample.frames.last) {
        Some(LAST)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Frame;
    use crate::project::faults;

    #[test]
    fn the_sample_is_whole() {
        let sample = project().unwrap();
        assert!(faults::of_values(&sample).is_empty());
        assert!(faults::of_bindings(&sample, &crate::face::generic()).is_empty());
        assert!(faults::of_extent(&sample).is_empty());
        assert_eq!(sample.landmarks.len(), 32);
        for named in [sample.frames.first.unwrap(), sample.frames.last.unwrap()] {
            let bytes = frame_bytes(&named).unwrap();
            let frame = Frame::decode(Path::new(&named.path), bytes).unwrap();
            assert_eq!((frame.sha256(), frame.width()), (named.sha256.as_str(), named.width_px));
            assert!(bytes.len() < 1_500_000, "{} bytes", bytes.len());
        }
    }
}
