//! Frames: what a camera saw, read from files into plain 8-bit pixels.

pub mod adjust;
pub mod between;
pub mod compression;
pub mod film;
pub mod frame;
pub mod motion;
pub mod sequence;
pub mod strip;

pub use adjust::Adjustment;
pub use between::{Between, Way};
pub use compression::Compression;
pub use film::{Film, FilmError};
pub use frame::{Frame, FrameError};
pub use sequence::{FrameSequence, SequenceError};
