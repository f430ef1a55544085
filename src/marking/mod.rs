//! Helps a hand that marks points: finds the same skin again in another picture.
//!
//! Nothing here changes a project. What is found is a proposal with its doubt: a place, a standard error, a confidence.
//!
//! ```text
//!  picture ─▶ prepared ─┬▶ patch: one neighbourhood, sub-pixel ──────┬▶ registration: all the skin at once ─▶ tracking: many points ─▶ confidence
//!                       └▶ grid_crossing ─▶ grid: which one is which ┘
//! ```

pub mod compressed;
pub mod confidence;
pub mod consistency;
mod cubic;
pub mod gray;
pub mod grid;
pub mod grid_crossing;
mod lanes;
pub mod lead;
pub mod patch;
pub mod prepared;
pub mod registration;
pub mod tracking;

pub use gray::{Gray, Spline};
