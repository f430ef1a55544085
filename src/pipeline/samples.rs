//! The forces that a fit may use: vertices whose force can be believed, each with its standard error.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Outcome;
use crate::displacement::VertexState;
use crate::face::FaceModel;
use crate::fit::Sample;
use crate::forces::Cause;

/// Which vertices a fit uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Include {
    /// Measured by hand, not on the border, no spring beyond the skin table ([`Outcome::is_believed`]).
    #[default]
    Believed,
    /// All that were measured, also on the border, which carries the reaction of skin that nobody measured.
    Measured,
    /// Measured and inferred ones.
    Known,
}

impl Include {
    /// In the order of a chooser.
    pub const ALL: [Self; 3] = [Self::Believed, Self::Measured, Self::Known];

    /// Word of files and of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Believed => "believed",
            Self::Measured => "measured",
            Self::Known => "known",
        }
    }

    /// Words for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Believed => "Measured inside the border",
            Self::Measured => "Measured, border too",
            Self::Known => "Measured and inferred",
        }
    }

    /// Whether a vertex counts.
    pub fn takes(self, outcome: &Outcome, vertex: usize) -> bool {
        match self {
            Self::Believed => outcome.is_believed(vertex),
            Self::Measured => outcome.states.get(vertex) == Some(&VertexState::Measured),
            Self::Known => {
                matches!(outcome.states.get(vertex), Some(VertexState::Measured | VertexState::Inferred))
            }
        }
    }
}

/// The samples of an outcome, and the vertices that they are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// The vertex of each sample.
    pub vertices: Vec<u32>,
    /// Position (mm, first frame), force (N or relative), standard error, outward normal.
    pub samples: Vec<Sample>,
}

impl Samples {
    /// Those of an outcome. Forces that are no numbers are left out.
    pub fn of(outcome: &Outcome, face: &FaceModel, include: Include) -> Self {
        let normals = face.mesh().vertex_normals(&outcome.first);
        let (forces, sigmas) = outcome.measured();
        let mut all = Self::default();
        for v in (0..outcome.states.len()).filter(|&v| include.takes(outcome, v)) {
            let (Some(position), Some(force), Some(normal)) = (outcome.first.get(v), forces.get(v), normals.get(v))
            else {
                continue;
            };
            if force.iter().all(|c| c.is_finite()) {
                let sigma = sigmas.get(v).copied().unwrap_or(0.0);
                all.vertices.push(v as u32);
                all.samples.push(Sample { position: *position, force: *force, sigma, normal: *normal });
            }
        }
        all
    }

    /// Causes of error by vertices, as causes by samples.
    pub fn causes(&self, by_vertex: &[Cause]) -> Vec<Cause> {
        let place: BTreeMap<u32, u32> = self.vertices.iter().copied().zip(0..).collect();
        let one = |cause: &Cause| cause.iter().filter_map(|(v, f)| Some((*place.get(v)?, *f))).collect();
        by_vertex.iter().map(one).filter(|cause: &Cause| !cause.is_empty()).collect()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}
