//! A face whose every triangle is cut into four, once or more: where something is worked out that the face's own mesh cannot hold.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::{ActuatorError, Actuators};
use crate::face::{FaceError, FaceModel, Mesh};

/// A face with a finer mesh. Its first vertices are those of the face, in their order.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The finer face, at the first face's places, with its landmarks, regions and muscles, and those that expressions add to it.
    pub face: FaceModel,
    /// For every vertex those of the first face between which it lies, and their weights, which sum to 1.
    pub between: Vec<Vec<(u32, f64)>>,
    /// Vertices of the first face.
    pub coarse: usize,
}

/// Why a face cannot be refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// The finer mesh is no face.
    #[error(transparent)]
    Face(#[from] FaceError),
    /// It has no actuators.
    #[error(transparent)]
    Actuators(#[from] ActuatorError),
}

impl Refined {
    /// Cuts every triangle into four at the middles of its sides, `levels` times. Triangles stay where they are: nothing is rounded.
    ///
    /// The muscles that expressions add to a face are added before, so that they do not move to other vertices.
    ///
    /// # Errors
    /// A face without the landmarks of the actuators, or too large.
    pub fn new(face: &FaceModel, levels: u32) -> Result<Self, RefineError> {
        let coarse = face.mesh().len();
        let mut mesh = face.mesh().clone();
        let mut between: Vec<Vec<(u32, f64)>> = (0..coarse as u32).map(|v| vec![(v, 1.0)]).collect();
        for _ in 0..levels {
            let middles = mesh.edges().iter().map(|e| {
                let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
                for (v, w) in e.iter().flat_map(|end| &between[*end as usize]) {
                    *sum.entry(*v).or_default() += 0.5 * w;
                }
                sum.into_iter().collect()
            });
            let middles: Vec<_> = middles.collect();
            between.extend(middles);
            mesh = halved(&mesh).map_err(FaceError::from)?;
        }
        let mut parts = face.to_parts();
        parts.muscles = Actuators::muscles(face, face.mesh().positions())?;
        parts.mirror.resize(mesh.len(), None);
        Ok(Self { face: FaceModel::new(mesh, parts)?, between, coarse })
    }

    /// What the first face's vertices have of a quantity that every vertex has a part of (a force, N; an area, mm²): Σ Nₖ(v) f_v with the hat
    /// functions of the first face, so that sums are kept.
    pub fn gathered<T: Copy + Default + std::ops::AddAssign + std::ops::Mul<f64, Output = T>>(
        &self,
        of: &[T],
    ) -> Vec<T> {
        let mut sum = vec![T::default(); self.coarse];
        for (row, part) in self.between.iter().zip(of) {
            for &(k, w) in row {
                sum[k as usize] += *part * w;
            }
        }
        sum
    }
}

/// The mesh with a vertex on the middle of every edge (in the order of the edges, after its own) and four triangles for each.
pub(crate) fn halved(mesh: &Mesh) -> Result<Mesh, crate::face::MeshError> {
    let mut positions: Vec<Point3<f64>> = mesh.positions().to_vec();
    let at = |v: u32| mesh.positions()[v as usize];
    positions.extend(mesh.edges().iter().map(|&[a, b]| nalgebra::center(&at(a), &at(b))));
    let middle = |a: u32, b: u32| {
        let edge = mesh.edges().binary_search(&[a.min(b), a.max(b)]).unwrap_or(0);
        (mesh.len() + edge) as u32
    };
    let four = mesh.triangles().iter().flat_map(|&[a, b, c]| {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    Mesh::new(positions, four.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use nalgebra::Vector3;

    #[test]
    fn a_refined_face_is_the_same_surface_with_the_same_first_vertices() {
        let face = face::generic();
        let mesh = face.mesh();
        let fine = Refined::new(&face, 2).unwrap();
        // V + E, three times: E' = 2 E + 3 T, T' = 4 T.
        assert_eq!(
            mesh.len() + mesh.edges().len() + 2 * mesh.edges().len() + 3 * mesh.triangles().len(),
            fine.face.mesh().len()
        );
        assert_eq!(&fine.face.mesh().positions()[..612], mesh.positions());
        for (row, p) in fine.between.iter().zip(fine.face.mesh().positions()) {
            let there: Vector3<f64> = row.iter().map(|(v, w)| mesh.positions()[*v as usize].coords * *w).sum();
            assert!((there - p.coords).norm() < 1e-12 && row.len() <= 3);
        }
        // The muscles that expressions add are bound to vertices of the first face.
        assert_eq!(fine.face.muscles().len(), 26);
        assert!(fine.face.muscles().iter().all(|m| m.attachment < 612 && m.insertion < 612));
    }

    #[test]
    fn what_is_gathered_keeps_its_sum_and_its_moment() {
        let face = face::generic();
        let fine = Refined::new(&face, 1).unwrap();
        let forces: Vec<Vector3<f64>> = (0..fine.face.mesh().len())
            .map(|i| Vector3::new((i % 7) as f64, (i % 5) as f64 - 2.0, (i % 3) as f64))
            .collect();
        let gathered = fine.gathered(&forces);
        assert_eq!(gathered.len(), 612);
        assert!((gathered.iter().sum::<Vector3<f64>>() - forces.iter().sum::<Vector3<f64>>()).norm() < 1e-9);
        let moment = |x: &[Point3<f64>], f: &[Vector3<f64>]| -> Vector3<f64> {
            x.iter().zip(f).map(|(x, f)| x.coords.cross(f)).sum()
        };
        let (a, b) = (moment(face.mesh().positions(), &gathered), moment(fine.face.mesh().positions(), &forces));
        assert!((a - b).norm() < 1e-9 * b.norm());
    }
}
