//! Frames: what a camera saw, read from files into plain 8-bit pixels.

pub mod adjust;
pub mod frame;
pub mod sequence;

pub use adjust::Adjustment;
pub use frame::{Frame, FrameError};
pub use sequence::{FrameSequence, SequenceError};
