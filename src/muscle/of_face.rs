//! The muscles of a face as fibres, where the face stands in a subject's first frame.

use nalgebra::Point3;

use super::{Fibre, FibreError};
use crate::face::{FaceModel, Muscle};

/// One muscle of the face as a fibre.
#[derive(Clone, Debug, PartialEq)]
pub struct FibreOf {
    /// Index in [`FaceModel::muscles`].
    pub muscle: usize,
    /// Its fibre in the first frame.
    pub fibre: Fibre,
}

/// All muscles that have a fibre in this first frame, and why the others have none.
pub fn fibres(face: &FaceModel, first: &[Point3<f64>]) -> (Vec<FibreOf>, Vec<(usize, FibreError)>) {
    let (mut all, mut without) = (Vec::new(), Vec::new());
    for (muscle, m) in face.muscles().iter().enumerate() {
        match fibre_of(face, m, first) {
            Ok(fibre) => all.push(FibreOf { muscle, fibre }),
            Err(why) => without.push((muscle, why)),
        }
    }
    (all, without)
}

/// A face model binds its muscles to vertices that it has.
fn fibre_of(face: &FaceModel, muscle: &Muscle, first: &[Point3<f64>]) -> Result<Fibre, FibreError> {
    let ends = [muscle.attachment as usize, muscle.insertion as usize];
    let normals = ends.map(|v| face.mesh().normal_at(first, v));
    let zone = muscle.zone_half_angle_deg.map(f64::to_radians);
    Fibre::new(first[ends[0]], first[ends[1]], muscle.half_width_mm, zone, normals)
}
