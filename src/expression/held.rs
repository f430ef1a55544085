//! What stays on its bone when a face moves: the rim of its skin, and the corners of its eyes.

use nalgebra::Point3;

use crate::face::FaceModel;
use crate::simulate::rim;

/// Landmarks that ligaments hold on the bone.
const LIGAMENTS: [&str; 4] = ["eye_inner_left", "eye_inner_right", "eye_outer_left", "eye_outer_right"];

/// Whether each vertex stays: the rim of the face with its vertices at rest (mm), and the corners of the eyes where it has those
/// landmarks.
pub fn held(face: &FaceModel, rest: &[Point3<f64>]) -> Vec<bool> {
    let mut held = rim(face.mesh(), rest);
    for corner in LIGAMENTS.iter().filter_map(|id| face.landmark(id)) {
        held[corner.vertex as usize] = true;
    }
    held
}
