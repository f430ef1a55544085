//! How a twin's skin goes from the first frame to the last: a prescribed slide over the face, or every vertex to a place of its own.

use nalgebra::{Point3, Vector3};

use super::brow_raise::BrowRaise;
use super::surface::{OnSurface, Surface, smooth_normals};
use crate::face::Mesh;

/// What moves the skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    /// The brow raise of the settings' amplitude, over the first frame's surface.
    Raise,
    /// Every vertex straight to its place in the last frame, and the skin between as the triangle goes.
    Places,
}

/// A place of the skin in the first frame: between three vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    pub corners: [usize; 3],
    pub weights: [f64; 3],
}

impl Between {
    pub(super) fn blend(&self, of: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        (0..3).map(|k| of(self.corners[k]) * self.weights[k]).sum()
    }
}

/// The skin when a share of the motion is done.
pub(super) enum Moment {
    Raise(BrowRaise),
    Places { at: Vec<Point3<f64>>, normals: Vec<Vector3<f64>> },
}

impl Moment {
    pub(super) fn places(mesh: &Mesh, first: &[Point3<f64>], last: &[Point3<f64>], share: f64) -> Self {
        let at: Vec<_> = first.iter().zip(last).map(|(a, b)| a + (b - a) * share).collect();
        Self::Places { normals: smooth_normals(mesh, &at), at }
    }

    /// Where a vertex is.
    pub(super) fn vertex(&self, surface: &Surface, v: usize) -> Point3<f64> {
        self.inside(surface, &Between { corners: [v; 3], weights: [1.0, 0.0, 0.0] }).point
    }

    /// Where a place of the skin is, and its normal.
    pub(super) fn inside(&self, surface: &Surface, place: &Between) -> OnSurface {
        let unit = |n: Vector3<f64>| n.try_normalize(1e-12).unwrap_or_else(Vector3::z);
        match self {
            Self::Raise(raise) => {
                let from = surface.at(place);
                surface.slide(&from, &raise.displacement(&from.point.xy()))
            }
            Self::Places { at, normals } => OnSurface {
                point: Point3::from(place.blend(|v| at[v].coords)),
                normal: unit(place.blend(|v| normals[v])),
            },
        }
    }
}
