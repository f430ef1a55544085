//! The stress–strain curve of facial skin.

use serde::{Deserialize, Serialize};

/// What happens below the table's wrinkling strain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contraction {
    /// Wrinkled skin carries no more.
    #[default]
    Saturating,
    /// The table goes on.
    Fung,
}

/// A piecewise-linear stress–strain table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StressStrainCurve {
    rows: Vec<[f64; 2]>,
    contraction: Contraction,
}
