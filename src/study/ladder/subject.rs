//! On whom the rungs are measured: a project as it is marked, or the forehead of a face without one.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::super::scene;
use super::super::twin::{Twin, TwinError, TwinSettings};
use crate::face::FaceModel;
use crate::project::Project;

/// Side of the frames of a face without a project, px: that of the twins.
const SIZE_PX: u32 = 1036;
/// Marking error of a face without a project, px.
const SIGMA_PX: f64 = 1.0;
/// What is marked of a face without a project.
const REGION: &str = "forehead_and_brows";

/// A project, the face model that it is fitted with, and the size of its first frame.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Marks, camera, scale, stated marking error and choices of the chain.
    pub project: Project,
    /// The face model before it is customised.
    pub face: Arc<FaceModel>,
    /// Width and height of the first frame, px.
    pub size_px: [u32; 2],
}

impl Subject {
    /// A face without a project: seen by the camera of the twins, landmarks, forehead, brows and still points marked, σ = 1 px.
    ///
    /// # Errors
    /// None for the settings of the twins.
    pub fn of_face(face: &Arc<FaceModel>) -> Result<Self, TwinError> {
        let settings = TwinSettings { head_motion: false, size_px: SIZE_PX, ..TwinSettings::default() };
        let twin = Twin::displaced(face, face.mesh().positions().to_vec(), &settings)?;
        let frames = scene::unseen_frames(SIZE_PX);
        let mut project = scene::membrane_project(&twin, face, frames, SIGMA_PX, face.name(), 0.0);
        scene::mark_only(&mut project, face.region(REGION));
        Ok(Self { project, face: Arc::clone(face), size_px: [SIZE_PX; 2] })
    }

    /// What decides the rows, in a few letters: marks, choices, camera and scale of the project.
    pub fn digest(&self) -> String {
        let Project { landmarks, features, settings, camera, scale, .. } = &self.project;
        let text = serde_json::to_string(&(landmarks, features, settings, camera, scale, self.size_px));
        let digest = Sha256::digest(text.unwrap_or_default().as_bytes());
        format!("{:02x}{:02x}{:02x}", digest[0], digest[1], digest[2])
    }
}
