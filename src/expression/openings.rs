//! The openings of a face, known for eyes and mouth: what is seen through them tells lids and lips apart from skin.

use nalgebra::{Point3, Vector3};

use crate::face::FaceModel;
use crate::face::check::borders_of;

/// Radius of an iris, mm.
pub const IRIS_MM: f64 = 5.9;
/// Radius of a pupil, mm.
pub const PUPIL_MM: f64 = 2.4;
/// How far behind the lids the iris lies, mm.
const BEHIND_MM: f64 = 3.0;
/// An opening farther from eyes and mouth than this is neither, mm.
const FARTHEST_MM: f64 = 15.0;

/// An eye, or the mouth.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Its border, in order.
    pub border: Vec<u32>,
    /// Middle of the iris, face space; none in the mouth. It stays where it is when the lids move.
    pub iris: Option<Point3<f64>>,
}

/// Eyes and mouth of a face at `rest`; of its borders the longest is the rim. Without landmarks none is known for what it is.
pub fn openings(face: &FaceModel, rest: &[Point3<f64>]) -> Vec<Opening> {
    let at = |id: &str| face.landmark(id).and_then(|l| rest.get(l.vertex as usize).copied());
    let middle = |a: &str, b: &str| Some(nalgebra::center(&at(a)?, &at(b)?));
    let known = (
        middle("mouth_corner_left", "mouth_corner_right"),
        middle("eye_inner_left", "eye_outer_left"),
        middle("eye_inner_right", "eye_outer_right"),
    );
    let (Some(mouth), Some(left), Some(right)) = known else { return Vec::new() };
    let borders = borders_of(face.mesh());
    let found = borders.into_iter().skip(1).filter_map(|border| {
        let sum: Vector3<f64> = border.vertices.iter().map(|&v| rest[v as usize].coords).sum();
        let centre = Point3::from(sum / border.vertices.len().max(1) as f64);
        let distance = |p: &Point3<f64>| (p - centre).norm();
        let eye = distance(&left).min(distance(&right));
        // Nostrils and what else a mesh may have stay open.
        if eye.min(distance(&mouth)) > FARTHEST_MM {
            return None;
        }
        let iris = (eye < distance(&mouth)).then(|| centre - Vector3::z() * BEHIND_MM);
        Some(Opening { border: border.vertices, iris })
    });
    found.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generic_face_has_two_eyes_and_a_mouth() {
        let face = crate::face::generic();
        let found = openings(&face, face.mesh().positions());
        let mut eyes: Vec<f64> = found.iter().filter_map(|o| Some(o.iris?.x)).collect();
        eyes.sort_by(f64::total_cmp);
        assert_eq!((found.len(), eyes.len()), (3, 2));
        assert!(eyes[0] < -20.0 && (eyes[0] + eyes[1]).abs() < 1e-9, "{eyes:?}");
    }
}
