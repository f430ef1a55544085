//! Where the painted lines of a twin truly cross, in both pictures.

use nalgebra::{Point2, Point3};

use super::Twin;
use super::render;
use super::surface::Surface;
use crate::face::FaceModel;

/// A crossing of the painted grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueCrossing {
    /// Number of the upright line, in pitches to the right of the face's middle.
    pub column: i32,
    /// Number of the level line, in pitches above the inner eye corners.
    pub row: i32,
    /// Where it lies in the first frame, px.
    pub first_in_image: Point2<f64>,
    /// Where it lies in the last frame, px.
    pub last_in_image: Point2<f64>,
}

/// Cosine between the skin's normal and the direction to the camera from which a crossing counts as seen.
const SEEN: f64 = 0.25;
/// Share of hair or lip over the paint from which a crossing is hidden, there and up to [`AROUND_MM`] beside it.
const HIDDEN: f64 = 0.2;
const AROUND_MM: f64 = 1.5;

pub(super) fn of(twin: &Twin, face: &FaceModel) -> Vec<TrueCrossing> {
    let surface = Surface::new(face.mesh());
    let paint = render::paint(twin, face);
    let moment = twin.skin_at(face.mesh(), 1.0);
    let pitch = twin.settings.grid_pitch_mm;
    let farthest = face.mesh().positions().iter().map(|p| p.x.abs().max(p.y.abs())).fold(0.0, f64::max);
    let most = (farthest / pitch).ceil() as i32;
    let hidden = |p: &Point2<f64>| {
        let beside = [[0.0, 0.0], [AROUND_MM, 0.0], [-AROUND_MM, 0.0], [0.0, AROUND_MM], [0.0, -AROUND_MM]];
        beside.iter().any(|d| paint.over_grid(&Point2::new(p.x + d[0], p.y + d[1])) > HIDDEN)
    };
    let mut found = Vec::new();
    for row in -most..=most {
        for column in -most..=most {
            let flat = Point2::new(f64::from(column) * pitch, f64::from(row) * pitch);
            // The surface nearest to the camera is the one that is seen.
            let Some(place) = surface.between(&flat, 1e3) else { continue };
            let first = surface.at(&place);
            let around = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            let whole = around.iter().all(|d| {
                let beside = Point2::new(flat.x + d[0] * AROUND_MM, flat.y + d[1] * AROUND_MM);
                surface.over(&beside, 1e3).is_some()
            });
            let to_eye = (Point3::new(0.0, 0.0, twin.camera.z_prp_mm) - first.point).normalize();
            if !whole || first.normal.dot(&to_eye) < SEEN || hidden(&flat) {
                continue;
            }
            let last = moment.inside(&surface, &place).point;
            found.push(TrueCrossing {
                column,
                row,
                first_in_image: twin.camera.image_from_face(&first.point),
                last_in_image: twin.camera.image_from_face(&twin.head_motion.last_from_first(&last)),
            });
        }
    }
    found
}
