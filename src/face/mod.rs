//! The face: a mesh with named landmarks and muscles bound to its vertices.

pub mod check;
pub mod closest;
pub mod draft;
pub mod file;
pub mod generic;
pub mod import;
pub mod landmark;
pub mod mesh;
pub mod mirror;
pub mod muscle;
#[cfg(test)]
pub(crate) mod patches;
pub mod skull;

pub use generic::generic;
pub use landmark::Landmark;
pub use mesh::{Mesh, MeshError};
pub use muscle::{Muscle, MusclePreset, Side};
pub use skull::Skull;

use serde::{Deserialize, Serialize};

/// A mesh plus what gives it meaning. Built by [`FaceModel::new`], which refuses what does not fit together.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceModel {
    name: String,
    mesh: Mesh,
    landmarks: Vec<Landmark>,
    muscles: Vec<Muscle>,
    muscle_presets: Vec<MusclePreset>,
    mirror: Vec<Option<u32>>,
    regions: Vec<Region>,
}

/// A named set of vertices, such as the forehead.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Short name, unique in a face: `forehead`, `brows`, `still`.
    pub id: String,
    /// Its vertices, in the order in which a hand would mark them.
    pub vertices: Vec<u32>,
}

/// The parts of a face model, before they are checked.
#[derive(Clone, Debug, Default)]
pub struct FaceParts {
    /// Name for people.
    pub name: String,
    /// The named vertices.
    pub landmarks: Vec<Landmark>,
    /// The muscles.
    pub muscles: Vec<Muscle>,
    /// Other choices of muscles.
    pub muscle_presets: Vec<MusclePreset>,
    /// For each vertex the one across the midline (itself on the midline), where there is one.
    pub mirror: Vec<Option<u32>>,
    /// Named sets of vertices.
    pub regions: Vec<Region>,
}

/// Why the parts of a face model do not fit together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaceError {
    /// The mesh itself was refused.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Something is bound to a vertex that does not exist.
    #[error("{what} is bound to vertex {vertex}, but there are only {vertices} vertices")]
    Unbound {
        /// What is bound: "landmark nose_tip".
        what: String,
        /// The vertex named.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A name stands twice.
    #[error("{what} stands twice")]
    Duplicate {
        /// The thing named twice.
        what: String,
    },
    /// A landmark names a mirror partner that does not exist or does not answer.
    #[error("landmark {id} names {mirror} as its mirror, which does not name it back")]
    Mirror {
        /// The landmark.
        id: String,
        /// The partner it names.
        mirror: String,
    },
    /// The mirror table has another length than the mesh.
    #[error("the mirror table has {found} rows for {vertices} vertices")]
    MirrorLength {
        /// Rows found.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A muscle without a fibre.
    #[error("muscle {id} has no length or no width")]
    EmptyMuscle {
        /// The muscle.
        id: String,
    },
    /// A zone that is no cone.
    #[error("the zone of muscle {id} must have a half angle between 0 and 90 degrees")]
    Zone {
        /// The muscle.
        id: String,
    },
}

impl FaceModel {
    /// Checks that every name is unique and every binding exists.
    pub fn new(mesh: Mesh, parts: FaceParts) -> Result<Self, FaceError> {
        let n = mesh.len();
        let bound = |what: String, vertex: u32| bound(what, vertex, n);
        let mut seen = std::collections::BTreeSet::new();
        for l in &parts.landmarks {
            bound(format!("landmark {}", l.id), l.vertex)?;
            if !seen.insert(l.id.as_str()) {
                return Err(FaceError::Duplicate { what: format!("landmark {}", l.id) });
            }
        }
        for l in &parts.landmarks {
            if let Some(mirror) = &l.mirror
                && !parts.landmarks.iter().any(|m| &m.id == mirror && m.mirror.as_ref() == Some(&l.id))
            {
                return Err(FaceError::Mirror { id: l.id.clone(), mirror: mirror.clone() });
            }
        }
        muscles_fit(&parts.muscles, n)?;
        let mut seen = std::collections::BTreeSet::new();
        for preset in &parts.muscle_presets {
            if !seen.insert(preset.id.as_str()) {
                return Err(FaceError::Duplicate { what: format!("muscle preset {}", preset.id) });
            }
            muscles_fit(&preset.muscles, n)?;
        }
        if parts.mirror.len() != n {
            return Err(FaceError::MirrorLength { found: parts.mirror.len(), vertices: n });
        }
        for v in parts.mirror.iter().flatten() {
            bound("a mirror pair".to_owned(), *v)?;
        }
        let mut seen = std::collections::BTreeSet::new();
        for r in &parts.regions {
            if !seen.insert(r.id.as_str()) {
                return Err(FaceError::Duplicate { what: format!("region {}", r.id) });
            }
            for &v in &r.vertices {
                bound(format!("region {}", r.id), v)?;
            }
        }
        let FaceParts { name, landmarks, muscles, muscle_presets, mirror, regions } = parts;
        Ok(Self { name, mesh, landmarks, muscles, muscle_presets, mirror, regions })
    }

    /// Name for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The mesh, mm.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The landmarks, in the order in which they are placed.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// The landmark of that name.
    pub fn landmark(&self, id: &str) -> Option<&Landmark> {
        self.landmarks.iter().find(|l| l.id == id)
    }

    /// The muscles.
    pub fn muscles(&self) -> &[Muscle] {
        &self.muscles
    }

    /// Other choices of muscles for this face.
    pub fn muscle_presets(&self) -> &[MusclePreset] {
        &self.muscle_presets
    }

    /// This face with the muscles of one of its presets in place of its own; none where there is no such preset.
    pub fn with_preset(&self, id: &str) -> Option<Self> {
        let preset = self.muscle_presets.iter().find(|p| p.id == id)?;
        Some(Self { muscles: preset.muscles.clone(), ..self.clone() })
    }

    /// This face at other places (mm): the same in everything else.
    ///
    /// # Errors
    /// Places that make no mesh.
    pub fn with_positions(&self, positions: Vec<nalgebra::Point3<f64>>) -> Result<Self, FaceError> {
        Self::new(self.mesh.with_positions(positions)?, self.to_parts())
    }

    /// The parts again, to change one and put them together anew.
    pub fn to_parts(&self) -> FaceParts {
        FaceParts {
            name: self.name.clone(),
            landmarks: self.landmarks.clone(),
            muscles: self.muscles.clone(),
            muscle_presets: self.muscle_presets.clone(),
            mirror: self.mirror.clone(),
            regions: self.regions.clone(),
        }
    }

    /// For each vertex the one across the midline, where there is one.
    pub fn mirror(&self) -> &[Option<u32>] {
        &self.mirror
    }

    /// The named sets of vertices.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The vertices of a region, or none.
    pub fn region(&self, id: &str) -> &[u32] {
        self.regions.iter().find(|r| r.id == id).map_or(&[], |r| &r.vertices)
    }
}

fn bound(what: String, vertex: u32, vertices: usize) -> Result<(), FaceError> {
    if (vertex as usize) < vertices { Ok(()) } else { Err(FaceError::Unbound { what, vertex, vertices }) }
}

/// Whether muscles have unique names, both ends on the mesh, a length and a width.
fn muscles_fit(muscles: &[Muscle], vertices: usize) -> Result<(), FaceError> {
    let mut seen = std::collections::BTreeSet::new();
    for m in muscles {
        bound(format!("the attachment of muscle {}", m.id), m.attachment, vertices)?;
        bound(format!("the insertion of muscle {}", m.id), m.insertion, vertices)?;
        if !seen.insert(m.id.as_str()) {
            return Err(FaceError::Duplicate { what: format!("muscle {}", m.id) });
        }
        if m.attachment == m.insertion || !(m.half_width_mm > 0.0 && m.half_width_mm.is_finite()) {
            return Err(FaceError::EmptyMuscle { id: m.id.clone() });
        }
        if m.zone_half_angle_deg.is_some_and(|angle| !(angle > 0.0 && angle < 90.0)) {
            return Err(FaceError::Zone { id: m.id.clone() });
        }
    }
    Ok(())
}
