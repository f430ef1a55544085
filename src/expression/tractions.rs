//! What muscles do to the vertices of a face when their forces are tractions: a force an area, whatever the mesh.

use nalgebra::{Point3, Vector3};

use super::actuator::{Actuator, ActuatorSettings, Actuators};
use super::refined::{RefineError, Refined};
use crate::face::FaceModel;
use crate::muscle::MuscleLaw;

impl Actuators {
    /// Takes what a law says at a place for a traction: a vertex gets it for its area (mm²). The lengths still sum to the muscle's strength, so
    /// that the whole pull of a muscle does not depend on the mesh.
    pub fn become_tractions(&mut self, areas: &[f64]) {
        for actuator in &mut self.all {
            for (v, f) in &mut actuator.loads {
                *f *= areas[*v as usize];
            }
            let sum: f64 = actuator.loads.iter().map(|(_, f)| f.norm()).sum();
            if sum > 0.0 {
                for (_, f) in &mut actuator.loads {
                    *f *= actuator.strength_n / sum;
                }
                actuator.sum_per_law_newton = sum;
            }
        }
    }
}

/// A face at rest whose every triangle is cut into four: tractions are laid out on it, and gathered to the face's own vertices by its hat functions
/// ([`Refined::gathered`]). A band as narrow as an edge of the mesh loses little of what it does.
#[derive(Clone, Debug)]
pub struct TractionMesh {
    refined: Refined,
    areas: Vec<f64>,
}

impl TractionMesh {
    /// Of a face at rest at `rest` (mm).
    ///
    /// # Errors
    /// Where the finer mesh is no face.
    pub fn new(face: &FaceModel, rest: &[Point3<f64>]) -> Result<Self, RefineError> {
        let refined = Refined::new(&face.with_positions(rest.to_vec())?, 1)?;
        let mesh = refined.face.mesh();
        let areas = mesh.vertex_areas(mesh.positions());
        Ok(Self { refined, areas })
    }

    /// The face's actuators with what their tractions put on its own vertices.
    ///
    /// # Errors
    /// As [`Actuators::of`].
    pub fn actuators(&self, law: &MuscleLaw) -> Result<Vec<Actuator>, RefineError> {
        let mesh = self.refined.face.mesh();
        let mut fine = Actuators::of(&self.refined.face, mesh.positions(), law, ActuatorSettings::default())?;
        fine.become_tractions(&self.areas);
        let mut all = fine.all;
        for actuator in &mut all {
            let mut newton = vec![Vector3::zeros(); mesh.len()];
            for (v, f) in &actuator.loads {
                newton[*v as usize] = *f;
            }
            let gathered = self.refined.gathered(&newton).into_iter().enumerate();
            actuator.loads = gathered.filter(|(_, f)| *f != Vector3::zeros()).map(|(v, f)| (v as u32, f)).collect();
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::muscle::LawKind;

    /// Gathering keeps sums and moments, and cutting the mesh changes nothing of what a muscle does as a whole. A law's values taken for forces of
    /// vertices, as they are, do depend on how large the triangles are.
    #[test]
    fn a_muscle_does_the_same_on_a_mesh_cut_once_more() {
        let face = face::generic();
        let law = MuscleLaw::default_of(LawKind::Anatomical);
        let rest = face.mesh().positions();
        let own = TractionMesh::new(&face, rest).unwrap().actuators(&law).unwrap();
        let cut = Refined::new(&face, 1).unwrap();
        let finer = TractionMesh::new(&cut.face, cut.face.mesh().positions()).unwrap().actuators(&law).unwrap();
        let sum = |a: &Actuator| a.loads.iter().map(|(_, f)| f).sum::<Vector3<f64>>();
        let moment = |a: &Actuator, x: &[Point3<f64>]| -> Vector3<f64> {
            a.loads.iter().map(|(v, f)| x[*v as usize].coords.cross(f)).sum()
        };
        for id in ["frontalis_medial_left", "zygomaticus_major_right", "corrugator_left"] {
            let of = |all: &[Actuator]| all.iter().find(|a| a.id == id).unwrap().clone();
            let (a, b) = (of(&own), of(&finer));
            assert!((sum(&a) - sum(&b)).norm() < 0.04 * sum(&b).norm(), "{id} {} {}", sum(&a), sum(&b));
            let (m, n) = (moment(&a, rest), moment(&b, cut.face.mesh().positions()));
            assert!((m - n).norm() < 0.04 * n.norm(), "{id} {m} {n}");
            // Lengths of sums are no longer than sums of lengths.
            let lengths: f64 = a.loads.iter().map(|(_, f)| f.norm()).sum();
            assert!(lengths <= a.strength_n + 1e-9 && lengths > 0.9 * a.strength_n, "{id} {lengths}");
        }
    }
}
