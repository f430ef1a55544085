//! The skin: how much stress a strain takes.

pub mod stress_strain;

pub use stress_strain::{Contraction, CurveError, StressStrainCurve};
