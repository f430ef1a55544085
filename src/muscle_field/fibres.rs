//! The fibres of a face's muscles in a subject's first frame, and which of them runs through a vertex.

use nalgebra::{Point3, Vector3};

use crate::face::{FaceModel, Muscle, Side};
use crate::muscle::{Fibre, FibreError};
use crate::pipeline::Outcome;

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

/// The fibre that runs through a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibreAt {
    /// Index in [`FaceModel::muscles`].
    pub muscle: usize,
    /// Unit vector in the surface, towards the attachment: the way the muscle pulls.
    pub direction: Vector3<f64>,
}

/// For each vertex the muscle in whose band it lies (of several the nearest), with the direction of its fibre laid into the surface there;
/// none where no muscle runs, or where its fibre stands upright on the skin.
///
/// The force's component along it is signed: a frontalis raises the lower forehead and lowers the upper one, so that one muscle leaves
/// forces of both signs along its fibre (Cotofana et al. 2020), which the length of the force cannot show.
pub fn fibre_field(face: &FaceModel, first: &[Point3<f64>]) -> Vec<Option<FibreAt>> {
    let normals = face.mesh().vertex_normals(first);
    let (fibres, _) = fibres(face, first);
    first.iter().zip(&normals).map(|(x, normal)| nearest(&fibres, x, normal)).collect()
}

/// The same for one vertex.
pub fn fibre_through(face: &FaceModel, first: &[Point3<f64>], vertex: usize) -> Option<FibreAt> {
    let x = first.get(vertex)?;
    let normal = face.mesh().normal_at(first, vertex);
    nearest(&fibres(face, first).0, x, &normal)
}

fn nearest(fibres: &[FibreOf], x: &Point3<f64>, normal: &Vector3<f64>) -> Option<FibreAt> {
    let within = fibres.iter().map(|f| (f, f.fibre.distance_mm(x))).filter(|(f, d)| *d <= f.fibre.half_width_mm);
    let (f, _) = within.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let pull = f.fibre.pull();
    let direction = (pull - normal * normal.dot(&pull)).try_normalize(1e-6)?;
    Some(FibreAt { muscle: f.muscle, direction })
}

/// The force's component along its own fibre at each vertex, N or relative; absent where nothing is known or no fibre runs.
pub fn along_fibres(outcome: &Outcome, field: &[Option<FibreAt>]) -> Vec<Option<f64>> {
    let known = |v: usize| outcome.states.get(v).is_some_and(|s| s.is_known());
    field
        .iter()
        .enumerate()
        .map(|(v, at)| Some(outcome.field.force.get(v).filter(|_| known(v))?.dot(&at.as_ref()?.direction)))
        .collect()
}

/// "frontalis, pars medialis (left, AU 1)".
pub fn muscle_name(muscle: &Muscle) -> String {
    let side = match muscle.side {
        Side::Left => "left",
        Side::Right => "right",
    };
    format!("{} ({side}, AU {})", muscle.latin.trim_start_matches("Musculus "), muscle.action_unit)
}
