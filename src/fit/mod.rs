//! Fits: from a measured field of forces to laws, strengths and muscles. Knows samples and fibres, no face.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

/// One measured force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Where the skin was in the first frame, mm.
    pub position: Point3<f64>,
    /// The force on it, N.
    pub force: Vector3<f64>,
    /// Its standard error, N: the root mean square length of the error vector. 0 where it is not known.
    pub sigma: f64,
    /// The skin's outward unit normal.
    pub normal: Vector3<f64>,
}

/// What of the forces is compared with a law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compare {
    /// All three components.
    #[default]
    Vectors,
    /// The part in the skin's surface, of both force and law: what a frame shows.
    Tangential,
    /// The component along the nearest fibre, with its sign.
    Along,
    /// The length of the force and of the sum of all muscles' forces, as the thesis fits. Noise makes lengths too long.
    Magnitudes,
}

impl Compare {
    /// Word of files and of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vectors => "vectors",
            Self::Tangential => "tangential",
            Self::Along => "along",
            Self::Magnitudes => "magnitudes",
        }
    }
}

/// Whose strengths are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strengths {
    /// A strength for each fibre.
    #[default]
    EachFibre,
    /// One for all: the fibres of one muscle.
    Shared,
}

pub mod activations;
mod cholesky;
pub mod comparison;
pub mod design;
mod estimate;
pub mod field;
pub mod held_out;
pub mod law_fit;
mod law_model;
mod law_sums;
pub mod levenberg_marquardt;
pub mod nelder_mead;
pub mod non_negative;
pub mod patches;
mod planes;
pub mod selection;
mod sharp_side;
pub mod student;
mod together;

pub use activations::{Activation, Activations, activations};
pub use comparison::{Candidate, Comparison, candidates, compare_laws};
pub use design::{Design, DesignError};
pub use estimate::{Estimate, LawFit, Misfit, Passed, Strength, WeakDirection};
pub use field::{Field, FieldError};
pub use held_out::{HeldOut, Patches, Pulling};
pub use law_fit::{FailedFit, LawFitOptions, Method, NoFit, Noise, fit_law, fit_law_to, fit_law_with};
pub use selection::{Selection, SelectionSettings, smallest_set};

#[cfg(test)]
mod tests;
