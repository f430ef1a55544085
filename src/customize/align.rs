//! Alignment and scaling: the generic face is put where the marks are, and made as wide and as high.

use nalgebra::{Point2, Point3, Rotation3, Vector2, Vector3};

use crate::camera::Camera;

/// A scaling along the axes, a turn and a shift: x ↦ to + turn (scale ∘ (x − from)), mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// The point of the generic face whose projection is the centre of the landmarks' projections.
    pub from: Point3<f64>,
    /// Where it goes.
    pub to: Point3<f64>,
    /// Factors along x, y, z of the generic face.
    pub scale: Vector3<f64>,
    /// The turn of the head. The thesis has none.
    pub turn: Rotation3<f64>,
}

impl Alignment {
    /// Where a vertex goes.
    pub fn apply(&self, x: &Point3<f64>) -> Point3<f64> {
        self.to + self.turn * (x - self.from).component_mul(&self.scale)
    }
}

/// A range tells a scale only if it is at least this share of the longer one: below it, a few pixels of marking error (the tilt
/// of a row of two) would stretch the face beyond recognition. Eyes and brows together reach 0.26, a row of eye corners 0.02.
const SMALLEST_RANGE: f64 = 0.2;

/// Shift and scale that bring `landmarks` (mm, in front of the camera) to their `marks` (px, in the same order). Thesis §4.2.
///
/// The shift brings the centre of the landmarks' projections to the centre of the marks (`docs/errata.md`: the thesis's
/// "projection of the centre of gravity" is another point). With a_i = (z_prp − z_vp)/(z_prp − z_i), the factor of (4.7), that is
///
/// c ↦ f_p⁻¹(centre of the marks, c_z),   (c_x, c_y) = Σ a_i (x_i, y_i) / Σ a_i,   c_z where the factor is the mean of the a_i
///
/// and then, about c, in one pass (perspective leaves a per cent, which the morph takes up),
///
/// s_x = range of the marks' x / range of the projections' x,   s_y alike,   s_z = `z_factor` · s_x
///
/// An axis whose range is too small uses the other's factor. Nothing is scaled where neither says anything, nor anything moved
/// where nothing was marked.
pub fn align(landmarks: &[Point3<f64>], marks: &[Point2<f64>], camera: &Camera, z_factor: f64) -> Alignment {
    if landmarks.is_empty() {
        let (from, to) = (Point3::origin(), Point3::origin());
        return Alignment { from, to, scale: Vector3::repeat(1.0), turn: Rotation3::identity() };
    }
    let n = landmarks.len() as f64;
    let to_plane = camera.z_prp_mm - camera.z_vp_mm;
    let factor = |x: &Point3<f64>| to_plane / (camera.z_prp_mm - x.z);
    let factors: f64 = landmarks.iter().map(factor).sum();
    let weighted: Vector3<f64> = landmarks.iter().map(|x| x.coords * factor(x)).sum();
    let from = Point3::new(weighted.x / factors, weighted.y / factors, camera.z_prp_mm - to_plane * n / factors);
    let centre = Point2::from(marks.iter().map(|p| p.coords / n).sum::<Vector2<f64>>());
    let to = camera.face_from_image(&centre, from.z);
    let projected: Vec<Point2<f64>> = landmarks.iter().map(|x| camera.image_from_face(&(x + (to - from)))).collect();
    let (model, marked) = (ranges(&projected), ranges(marks));
    let told = |axis: usize| {
        let enough = |range: [f64; 2]| range[axis] > 0.0 && range[axis] >= SMALLEST_RANGE * range[1 - axis];
        (enough(model) && enough(marked)).then(|| marked[axis] / model[axis])
    };
    let scale = match (told(0), told(1)) {
        (Some(x), Some(y)) => Vector3::new(x, y, z_factor * x),
        (Some(one), None) | (None, Some(one)) => Vector3::new(one, one, z_factor * one),
        (None, None) => Vector3::repeat(1.0),
    };
    Alignment { from, to, scale, turn: Rotation3::identity() }
}

/// Width and height of the smallest upright rectangle around the points.
fn ranges(points: &[Point2<f64>]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let (low, high) =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
        high - low
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four points on the view plane, 60 wide and 40 high about (10, 20), marked 120 × 100 mm about the principal point at
    /// 2 px/mm: shift (−10, −20), factors 2 and 2.5, depth 1.15 · 2.
    #[test]
    fn by_hand_on_the_view_plane() {
        let camera =
            Camera { principal_point_px: Point2::new(300.0, 200.0), z_prp_mm: 500.0, z_vp_mm: 0.0, px_per_mm: 2.0 };
        let landmarks = [(-20.0, 20.0), (40.0, 20.0), (10.0, 0.0), (10.0, 40.0)].map(|(x, y)| Point3::new(x, y, 0.0));
        let marks = [(180.0, 200.0), (420.0, 200.0), (300.0, 300.0), (300.0, 100.0)].map(|(x, y)| Point2::new(x, y));
        let a = align(&landmarks, &marks, &camera, 1.15);
        assert!((a.from - Point3::new(10.0, 20.0, 0.0)).norm() < 1e-12 && a.to.coords.norm() < 1e-12);
        assert!((a.scale - Vector3::new(2.0, 2.5, 2.3)).norm() < 1e-12);
        for (x, p) in landmarks.iter().zip(&marks) {
            assert!((camera.image_from_face(&a.apply(x)) - p).norm() < 1e-9);
        }
    }

    #[test]
    fn the_projections_of_landmarks_at_different_depths_are_centred_on_the_marks() {
        let camera =
            Camera { principal_point_px: Point2::new(300.0, 200.0), z_prp_mm: 400.0, z_vp_mm: 10.0, px_per_mm: 2.0 };
        let landmarks =
            [(-20.0, 20.0, 30.0), (40.0, 21.0, -50.0), (11.0, 0.0, 0.0)].map(|(x, y, z)| Point3::new(x, y, z));
        let marks = [(180.0, 200.0), (420.0, 230.0), (330.0, 310.0)].map(|(x, y)| Point2::new(x, y));
        let a = align(&landmarks, &marks, &camera, 1.15);
        let shifted: Vector2<f64> =
            landmarks.iter().map(|x| camera.image_from_face(&(x + (a.to - a.from))).coords / 3.0).sum();
        assert!((shifted - Vector2::new(310.0, 740.0 / 3.0)).norm() < 1e-9);
    }
}
