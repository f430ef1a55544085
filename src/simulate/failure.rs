//! When, where and why a simulation failed, and what to change.

use super::integrator::Method;

/// A run that came to no end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{method} failed at step {step} ({time_ms:.1} ms), vertex {vertex}: {cause}. {advice}", method = method.label())]
pub struct Failure {
    /// What stepped.
    pub method: Method,
    /// The step, from 1.
    pub step: usize,
    /// Time reached, ms.
    pub time_ms: f64,
    /// The vertex at which it showed first.
    pub vertex: usize,
    /// A triangle at that vertex that has turned over, if one has.
    pub triangle: Option<usize>,
    /// Why.
    pub cause: Cause,
    /// What to change.
    pub advice: String,
}

/// Why a run failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// A place or velocity is NaN or infinite.
    #[error("its place is no number any more")]
    NotFinite,
    /// A vertex left the face.
    #[error("it lies {distance_mm:.0} mm from its place at rest")]
    RanAway {
        /// How far.
        distance_mm: f64,
    },
    /// Energy came from nowhere.
    #[error("{mj:.3} mJ of energy came from nowhere")]
    EnergyGrew {
        /// How much.
        mj: f64,
    },
    /// The denominator of (4.17) is not positive.
    #[error("the denominator of (4.17) stays at {value:.2e} N s²/mm even with a step of {step_ms:.3} ms")]
    Denominator {
        /// Its value.
        value: f64,
        /// The smallest step tried.
        step_ms: f64,
    },
    /// The stiffness matrix has no Cholesky factor.
    #[error("the stiffness matrix has no factor")]
    NoFactor,
}
