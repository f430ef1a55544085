//! From displacement to force.

use serde::{Deserialize, Serialize};

/// How an edge becomes a spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringRule {
    /// A strip of skin.
    #[default]
    Strip,
    /// One law for all edges.
    Uniform,
}
