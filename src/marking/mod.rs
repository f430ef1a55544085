//! Helps a hand that marks points: finds the same skin again in another picture.
//!
//! Nothing here changes a project. What is found is a proposal with its doubt: a place, a standard error, a confidence.
//!
//! ```text
//!  picture ─▶ Gray ─▶ Spline ─┬▶ patch (one neighbourhood, sub-pixel) ─▶ tracking (many points, led by their neighbours, checked)
//!                             └▶ grid_crossing (two painted lines, sub-pixel)
//! ```

pub mod gray;
pub mod grid_crossing;
pub mod patch;
pub mod tracking;

pub use gray::{Gray, Spline};
