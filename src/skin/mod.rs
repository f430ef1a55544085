//! The skin as a material.

pub mod stress_strain;

pub use stress_strain::{Contraction, StressStrainCurve};
