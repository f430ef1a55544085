//! The whole chain, from a project to its outcome.

pub mod outcome;

pub use outcome::{ForceField, LandmarkFit, Outcome, Warning};
