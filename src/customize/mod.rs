//! Fitting the generic face to a person.

use serde::{Deserialize, Serialize};

/// Choices of the customisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CustomizeSettings {
    /// Factor of depth over the factor of width.
    pub z_factor: f64,
    /// Power of the inverse distance.
    pub power: f64,
    /// Only so many nearest landmarks.
    pub nearest: Option<usize>,
}

impl Default for CustomizeSettings {
    fn default() -> Self {
        Self { z_factor: 1.15, power: 2.0, nearest: None }
    }
}
