//! Triangles that the morph turned over, and the landmark that did it.

use nalgebra::{Point3, Vector3};

use super::{Anchor, CustomizeSettings};
use crate::face::Mesh;
use crate::face::mesh::doubled_area_vector;

/// Triangles whose normals before and after are more than a right angle apart.
pub(super) fn turned_over(mesh: &Mesh, before: &[Point3<f64>], after: &[Point3<f64>]) -> Vec<u32> {
    let normal = |x: &[Point3<f64>], t: &[u32; 3]| -> Vector3<f64> { doubled_area_vector(x, *t) };
    let turned = |t: &[u32; 3]| normal(before, t).dot(&normal(after, t)) < 0.0;
    mesh.triangles().iter().enumerate().filter(|(_, t)| turned(t)).map(|(i, _)| i as u32).collect()
}

/// For each folded triangle the anchor to blame (its index): the one without which the triangle would lie most nearly as it did.
pub(super) fn to_blame(
    mesh: &Mesh,
    before: &[Point3<f64>],
    anchors: &[Anchor],
    folded: &[u32],
    settings: &CustomizeSettings,
) -> Vec<usize> {
    let corners: Vec<[Point3<f64>; 3]> =
        folded.iter().map(|&t| mesh.triangles()[t as usize].map(|i| before[i as usize])).collect();
    let across = |[a, b, c]: [Point3<f64>; 3]| (b - a).cross(&(c - a));
    let mut best = vec![(f64::NEG_INFINITY, 0); folded.len()];
    if folded.is_empty() {
        return Vec::new();
    }
    for k in 0..anchors.len() {
        let others: Vec<Anchor> = anchors.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, a)| *a).collect();
        let mut moved: Vec<Point3<f64>> = corners.as_flattened().to_vec();
        super::morph(&mut moved, &others, settings);
        for ((triangle, after), best) in corners.iter().zip(moved.as_chunks::<3>().0).zip(&mut best) {
            let (was, is) = (across(*triangle), across(*after));
            let likeness = was.dot(&is) / (was.norm_squared() + f64::MIN_POSITIVE);
            if likeness > best.0 {
                *best = (likeness, k);
            }
        }
    }
    best.into_iter().map(|(_, k)| k).collect()
}
