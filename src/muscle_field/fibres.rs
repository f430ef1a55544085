//! Which muscle's fibre runs through a vertex, and which way.

use nalgebra::{Point3, Vector3};

use crate::face::{FaceModel, Muscle, Side};
use crate::pipeline::Outcome;

pub use crate::muscle::{FibreOf, fibres};

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
