//! Places known on the generic face, carried to another face by its landmarks.

use nalgebra::{Point3, Vector3};

use crate::face::{self, FaceModel};

/// Landmarks without which sphincters, lids and jaw have no place.
pub const NEEDED: [&str; 12] = [
    "eye_inner_left",
    "eye_inner_right",
    "eye_outer_left",
    "eye_outer_right",
    "eye_top_left",
    "eye_top_right",
    "mouth_corner_left",
    "mouth_corner_right",
    "upper_lip",
    "lower_lip",
    "nose_tip",
    "chin",
];

/// A scale and a shift along each axis: the one that brings the generic face's landmarks nearest to a face's (least squares).
///
/// Nothing is turned: faces stand upright in face space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carry {
    scale: Vector3<f64>,
    shift: Vector3<f64>,
}

impl Carry {
    /// From the generic face to this one at rest; `Err` names the landmarks of [`NEEDED`] that it lacks.
    pub fn onto(face: &FaceModel, rest: &[Point3<f64>]) -> Result<Self, Vec<&'static str>> {
        let missing: Vec<_> = NEEDED.into_iter().filter(|id| face.landmark(id).is_none()).collect();
        if !missing.is_empty() {
            return Err(missing);
        }
        let generic = face::generic();
        let pairs: Vec<_> = generic
            .landmarks()
            .iter()
            .filter_map(|l| {
                let there = rest.get(face.landmark(&l.id)?.vertex as usize)?;
                Some((generic.mesh().positions()[l.vertex as usize], *there))
            })
            .collect();
        let count = pairs.len().max(1) as f64;
        let from = pairs.iter().map(|(p, _)| p.coords).sum::<Vector3<f64>>() / count;
        let to = pairs.iter().map(|(_, q)| q.coords).sum::<Vector3<f64>>() / count;
        let scale = Vector3::from_fn(|a, _| {
            let (mut product, mut square) = (0.0, 0.0);
            for (p, q) in &pairs {
                product += (p[a] - from[a]) * (q[a] - to[a]);
                square += (p[a] - from[a]) * (p[a] - from[a]);
            }
            // Landmarks in one plane say nothing about the third axis, and a flat face has no depth to scale by.
            if square > 0.0 && product > 0.0 { product / square } else { 1.0 }
        });
        Ok(Self { scale, shift: to - from.component_mul(&scale) })
    }

    /// A place of the generic face on this one.
    pub fn there(&self, p: Point3<f64>) -> Point3<f64> {
        Point3::from(p.coords.component_mul(&self.scale) + self.shift)
    }

    /// A place of this face on the generic one.
    pub fn back(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from((p.coords - self.shift).component_div(&self.scale))
    }

    /// How much larger this face is, along x, y and z.
    pub fn scale(&self) -> Vector3<f64> {
        self.scale
    }
}

/// The vertex nearest to a place seen from the front, among those that face the camera.
pub(super) fn nearest_seen(at: [f64; 2], rest: &[Point3<f64>], normals: &[Vector3<f64>]) -> Option<u32> {
    let off = |i: usize| (rest[i].x - at[0]).hypot(rest[i].y - at[1]);
    let seen = (0..rest.len()).filter(|&i| normals[i].z > 0.0);
    seen.min_by(|&i, &j| off(i).total_cmp(&off(j))).map(|i| i as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_that_was_scaled_and_shifted_is_found_again() {
        let face = face::generic();
        let moved = |p: &Point3<f64>| Point3::new(1.1 * p.x + 3.0, 0.9 * p.y - 5.0, 1.2 * p.z + 100.0);
        let rest: Vec<_> = face.mesh().positions().iter().map(moved).collect();
        let carry = Carry::onto(&face, &rest).unwrap();
        let condyle = Point3::new(55.0, -18.0, -70.0);
        assert!((carry.there(condyle) - moved(&condyle)).norm() < 1e-9);
        assert!((carry.back(&moved(&condyle)) - condyle).norm() < 1e-9);
        assert!((carry.scale() - Vector3::new(1.1, 0.9, 1.2)).norm() < 1e-12);
    }

    #[test]
    fn missing_landmarks_are_named() {
        let face = face::generic();
        let mut parts = face.to_parts();
        parts.landmarks.retain(|l| l.id != "chin" && l.id != "nose_tip");
        let without = FaceModel::new(face.mesh().clone(), parts).unwrap();
        assert_eq!(Carry::onto(&without, face.mesh().positions()), Err(vec!["nose_tip", "chin"]));
    }
}
