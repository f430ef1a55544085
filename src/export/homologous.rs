//! The points that both frames share, in one order: what a study of shapes compares.

use nalgebra::Point2;

use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::{Mark, Project};

/// A vertex with what a hand has said of it in either frame.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedPoint {
    /// The vertex.
    pub vertex: u32,
    /// The landmark's id, or `vertex_17`.
    pub name: String,
    /// The hand's mark in the first frame.
    pub first: Option<Mark>,
    /// The hand's mark in the last frame.
    pub last: Option<Mark>,
    /// Where the fitted wireframe has the vertex in the first frame, px.
    pub fitted_in_image: Point2<f64>,
}

/// Landmarks in the order of the face, then marked feature points by vertex. A vertex that is both stands once, as the landmark.
pub fn points(project: &Project, face: &FaceModel, outcome: &Outcome) -> Vec<SharedPoint> {
    let mut points = Vec::new();
    let mut push = |vertex: u32, name: String, first: Option<Mark>| {
        let feature = project.features.get(&vertex).copied().unwrap_or_default();
        let first = first.or(feature.first);
        if (first.is_some() || feature.last.is_some())
            && let Some(&fitted_in_image) = outcome.first_in_image.get(vertex as usize)
        {
            points.push(SharedPoint { vertex, name, first, last: feature.last, fitted_in_image });
        }
    };
    for landmark in face.landmarks() {
        push(landmark.vertex, landmark.id.clone(), project.landmarks.get(&landmark.id).copied());
    }
    for &vertex in project.features.keys() {
        if !face.landmarks().iter().any(|l| l.vertex == vertex) {
            push(vertex, format!("vertex_{vertex}"), None);
        }
    }
    points
}
