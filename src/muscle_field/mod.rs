//! The muscles behind a force field: which pulled, how hard, by which law, and how sure that is.
//!
//! ```text
//! Outcome ─▶ samples ─▶ activations ─▶ the smallest set ─▶ the four laws ─▶ ladder, profiles, two subjects
//! ```
//! Stands between the chain, which knows pixels and skin, and the fits, which know neither: here vertices become samples and muscles of
//! the face become fibres.

pub mod analysis;
pub mod fibres;
pub mod fields;
pub mod ladder;
pub mod maps;
pub mod profiles;
pub mod replay;
pub mod section;
pub mod subjects;

pub use crate::pipeline::samples::{Include, Samples};
pub use analysis::{Analysis, LawRow, Nothing, Pull, Question};
pub use fibres::{FibreAt, FibreOf};
pub use ladder::{Ladder, Rung};
pub use replay::{Replay, ReplayError, Simulated};

#[cfg(test)]
mod tests;
