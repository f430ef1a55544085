//! Simulated against seen: the muscles that were found pull on the skin of the first frame, and where it comes to rest is compared with
//! the last frame.

use nalgebra::{Point2, Point3, Vector3};

use super::analysis::{Analysis, Pull};
use crate::displacement::VertexState;
use crate::expression::jaw::jaw_of;
use crate::face::FaceModel;
use crate::muscle::Fibre;
use crate::pipeline::{Outcome, held_by};
use crate::project::Project;
use crate::simulate::{Ended, RestError, SkinAtRest};

/// The last frame twice: as it was marked, and as the forces make it.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The measured vertices, ascending; every list of a [`Simulated`] over points is in this order.
    pub points: Vec<u32>,
    /// How far each point went, mm.
    pub motion_mm: Vec<f64>,
    /// The same in the picture, head motion left out, px.
    pub motion_px: Vec<f64>,
    /// Under the activations of all muscles.
    pub of_muscles: Simulated,
    /// Under the measured forces themselves: what is left is due to the simulation, not to the muscles.
    pub of_forces: Simulated,
}

/// Skin at rest under some forces.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// Every vertex, mm, head motion left out.
    pub positions: Vec<Point3<f64>>,
    /// The same in the last frame's picture, px.
    pub in_image: Vec<Point2<f64>>,
    /// Distance of each point from where it was seen, px.
    pub distance_px: Vec<f64>,
    /// The same along the skin, mm: the depth, which one camera does not see, is left out.
    pub distance_mm: Vec<f64>,
    /// Why the search for the rest ended.
    pub ended: Ended,
    /// Triangles that turned over.
    pub folded: usize,
}

/// Why there is nothing to compare.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// No measured vertex.
    #[error("no feature point is measured, so there is nothing to compare a simulation with")]
    NothingSeen,
    /// The skin cannot come to rest.
    #[error(transparent)]
    Rest(#[from] RestError),
}

/// A list of distances in three numbers, all 0 for an empty one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Their mean.
    pub mean: f64,
    /// The root of their mean square.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
}

impl Spread {
    /// Of these distances.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        Self {
            mean: values.iter().sum::<f64>() / count,
            rms: (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
            largest: values.iter().copied().fold(0.0, f64::max),
        }
    }
}

impl Replay {
    /// Lets the muscles that were found pull ([`pull_of_muscles`], N on every vertex), and the measured forces.
    ///
    /// The skin is that of the project's settings, without tension at rest, since F = −K X has none either; it slides over the skull,
    /// and what the project holds stays ([`held_by`]). The jaw is as far open as it was found with the muscles, where it was
    /// ([`crate::pipeline::MuscleForces::jaw`]), and else shut.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn new(
        project: &Project,
        face: &FaceModel,
        outcome: &Outcome,
        pull: Vec<Vector3<f64>>,
    ) -> Result<Self, ReplayError> {
        let is_measured = |v: &usize| outcome.states[*v] == VertexState::Measured;
        let points: Vec<u32> = (0..outcome.states.len()).filter(is_measured).map(|v| v as u32).collect();
        if points.is_empty() {
            return Err(ReplayError::NothingSeen);
        }
        let mesh = face.mesh();
        let (fixed, settings) = (held_by(project, face, &outcome.first), &project.settings);
        let open = outcome.muscles.as_ref().and_then(|found| found.jaw);
        let jaw = open.and_then(|_| jaw_of(face, &outcome.first));
        let mut rest = SkinAtRest::new(mesh, &outcome.first, &fixed, jaw, &settings.skin_spec())?;
        if let Some(open) = open {
            rest.open_jaw(open.deg.to_radians());
        }
        let normals = mesh.vertex_normals(&outcome.first);
        let mut simulated = |loads: Vec<Vector3<f64>>| -> Result<Simulated, ReplayError> {
            let found = rest.solve(loads, &outcome.first).map_err(RestError::from)?;
            Ok(compared(outcome, &points, &normals, found))
        };
        let seen = |v: u32| (outcome.last[v as usize], outcome.first[v as usize]);
        let still = |v: u32| outcome.camera.image_from_face(&outcome.head.motion.last_from_first(&seen(v).1));
        Ok(Self {
            motion_mm: points.iter().map(|&v| (seen(v).0 - seen(v).1).norm()).collect(),
            motion_px: points.iter().map(|&v| (outcome.last_in_image[v as usize] - still(v)).norm()).collect(),
            of_muscles: simulated(pull)?,
            of_forces: simulated(known_forces(outcome, &mesh.vertex_normals(&outcome.last)))?,
            points,
        })
    }

    /// Share of the motion seen (its sum of squares in the picture) that a simulation gives back: 1 is all of it, 0 no more than skin
    /// that stays.
    pub fn explained(&self, simulated: &Simulated) -> f64 {
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        1.0 - square(&simulated.distance_px) / square(&self.motion_px).max(f64::MIN_POSITIVE)
    }

    /// What a person should know about a simulation before its distances are believed: a sentence, or nothing.
    pub fn doubt(simulated: &Simulated) -> Option<String> {
        let unfinished = (simulated.ended != Ended::Converged)
            .then(|| format!("It did not come to rest: {}", simulated.ended.label()));
        let folded = match simulated.folded {
            0 => None,
            1 => Some("1 triangle has turned over".to_owned()),
            n => Some(format!("{n} triangles have turned over")),
        };
        match (unfinished, folded) {
            (Some(a), Some(b)) => Some(format!("{a}; {b}.")),
            (one, other) => one.or(other).map(|words| format!("{words}.")),
        }
    }

    /// The point that lies furthest from where it was seen in the picture.
    pub fn worst(&self, simulated: &Simulated) -> Option<u32> {
        let pairs = self.points.iter().zip(&simulated.distance_px);
        pairs.max_by(|a, b| a.1.total_cmp(b.1)).map(|(v, _)| *v)
    }
}

/// What the muscles of an analysis' set ([`Analysis::strengths_of_set`]) together do to every vertex, N, within the skin.
pub fn pull_of_muscles(face: &FaceModel, outcome: &Outcome, analysis: &Analysis) -> Vec<Vector3<f64>> {
    let fibres = analysis.fibres.iter().map(|of| &of.fibre);
    let muscles = analysis.strengths_of_set().map(|found| found.muscles).unwrap_or_default();
    pull(face, &outcome.first, &analysis.shape, fibres.zip(muscles.iter().map(|one| one.strength_n)))
}

/// What fibres with these strengths put on every vertex within the skin of the first frame, N.
pub(super) fn pull<'a>(
    face: &FaceModel,
    first: &[Point3<f64>],
    shape: &Pull,
    fibres: impl Iterator<Item = (&'a Fibre, f64)>,
) -> Vec<Vector3<f64>> {
    let normals = face.mesh().vertex_normals(first);
    let mut loads = vec![Vector3::zeros(); first.len()];
    for (fibre, strength_n) in fibres.filter(|(_, strength)| *strength != 0.0) {
        for ((load, x), n) in loads.iter_mut().zip(first).zip(&normals) {
            let f = shape.force(fibre, x) * strength_n;
            *load += f - n * n.dot(&f);
        }
    }
    loads
}

/// The forces of every vertex of which one is known, N, within the skin of the last frame: across it lies what the skull bears.
fn known_forces(outcome: &Outcome, normals: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let all = outcome.measured().0.iter().zip(&outcome.states).zip(normals);
    all.map(|((f, state), n)| if state.is_known() { f - n * n.dot(f) } else { Vector3::zeros() }).collect()
}

fn compared(
    outcome: &Outcome,
    points: &[u32],
    normals: &[Vector3<f64>],
    found: crate::simulate::Equilibrium,
) -> Simulated {
    let motion = &outcome.head.motion;
    let in_image: Vec<Point2<f64>> =
        found.positions.iter().map(|x| outcome.camera.image_from_face(&motion.last_from_first(x))).collect();
    let apart_px = |&v: &u32| (in_image[v as usize] - outcome.last_in_image[v as usize]).norm();
    let apart_mm = |&v: &u32| {
        let (d, n) = (found.positions[v as usize] - outcome.last[v as usize], normals[v as usize]);
        (d - n * n.dot(&d)).norm()
    };
    Simulated {
        distance_px: points.iter().map(apart_px).collect(),
        distance_mm: points.iter().map(apart_mm).collect(),
        ended: found.ended,
        folded: found.folded.len(),
        positions: found.positions,
        in_image,
    }
}

#[cfg(test)]
mod tests {
    use super::super::fibres::fibres;
    use super::*;
    use crate::face;
    use crate::fit::activations::activations;
    use crate::fit::{Compare, Noise, Sample};
    use crate::forces::{Skin, SkinModel};
    use crate::muscle::{LawKind, MuscleLaw};
    use crate::pipeline::{self, ForceField, JawOpen, MuscleForces, Workspace};
    use crate::project::{Feature, Role};
    use crate::simulate::{EquilibriumSolver, MembraneSolver, System, SystemOptions};

    /// A closed loop that knows nothing of itself: two muscles pull, Newton's method says where the skin goes, F = −K X measures the
    /// forces there, the fit finds the strengths, and the simulation must lead to the same place again.
    #[test]
    fn what_two_muscles_did_is_given_back_by_the_forces_and_by_the_muscles_found() {
        SkinModel::ALL.into_iter().for_each(two_muscles);
    }

    fn two_muscles(model: SkinModel) {
        let face = face::generic();
        let (mesh, mut project) = (face.mesh(), Project::default());
        project.settings.skin_model = model;
        let mut outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        let (all, _) = fibres(&face, &outcome.first);
        let all: Vec<Fibre> = all.into_iter().map(|of| of.fibre).collect();
        let is_medial = |m: usize| if face.muscles()[m].id.starts_with("frontalis_medial") { 0.01 } else { 0.0 };
        let shape = Pull::plain(MuscleLaw::default_of(LawKind::Anatomical));
        let loads = pull(&face, &outcome.first, &shape, all.iter().zip((0..all.len()).map(is_medial)));
        let options = SystemOptions { pre_tension_kpa: 0.0, ..SystemOptions::default() };
        // On the forehead one point is still and one fixed: neither may move, though the skin around them does.
        let near = |x: f64, y: f64| {
            let away = |v: &usize| (outcome.first[*v] - Point3::new(x, y, outcome.first[*v].z)).norm();
            (0..mesh.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap() as u32
        };
        let (still, fixed) = (near(30.0, 40.0), near(-30.0, 40.0));
        for (v, role) in [(still, Role::Still), (fixed, Role::Fixed)] {
            project.features.insert(v, Feature { role, ..Feature::default() });
        }
        let held = held_by(&project, &face, &outcome.first);
        assert!(held[still as usize] && held[fixed as usize]);
        let mut system = System::new(mesh, &outcome.first, &held, None, options).unwrap();
        system.set_loads(loads).unwrap();
        let skin = Skin::new(mesh, &outcome.first, &project.settings.skin_spec());
        let truth = match skin.membrane() {
            None => EquilibriumSolver::new(&system).unwrap().solve(&system, &outcome.first),
            Some(membrane) => MembraneSolver::new(membrane, &system).unwrap().solve(membrane, &system, &outcome.first),
        }
        .positions;
        let mut force = Vec::new();
        skin.muscle_forces(&truth, &vec![true; mesh.len()], &mut force);
        outcome.states = vec![VertexState::Measured; mesh.len()];
        outcome.field = ForceField { force, ..ForceField::default() };
        outcome.last_in_image = truth.iter().map(|x| outcome.camera.image_from_face(x)).collect();
        outcome.last = truth;

        let normals = mesh.vertex_normals(&outcome.first);
        let inside = held.iter().map(|h| !h);
        let every = outcome.first.iter().zip(&outcome.field.force).zip(&normals).zip(inside);
        let samples: Vec<Sample> = every
            .filter(|(_, inside)| *inside)
            .map(|(((x, f), n), _)| Sample { position: *x, force: *f, sigma: 1e-3, normal: *n })
            .collect();
        let found = activations(&shape.design(&all, &samples, Compare::Tangential).unwrap(), None, Noise::default());
        let strengths = found.muscles.iter().map(|one| one.strength_n);
        let again = pull(&face, &outcome.first, &shape, all.iter().zip(strengths));
        let replay = Replay::new(&project, &face, &outcome, again).unwrap();
        assert!(replay.motion_px.iter().copied().fold(0.0, f64::max) > 2.0, "the test would say nothing");
        assert_eq!(replay.of_forces.ended, Ended::Converged);
        // What is left is due to normals: the mesh's in one place, the smooth skull's in the other.
        let share = replay.explained(&replay.of_forces);
        assert!(share > 0.998, "{model:?} {share} of the motion under the forces themselves");
        let share = replay.explained(&replay.of_muscles);
        assert!(share > 0.98, "{model:?} {share} of the motion under the muscles found");
        let (left, went) = (Spread::of(&replay.of_muscles.distance_mm), Spread::of(&replay.motion_mm));
        assert!(left.rms < 0.15 * went.rms && left.mean <= left.rms && left.rms <= left.largest);
        for v in [still as usize, fixed as usize] {
            assert!((replay.of_muscles.positions[v] - outcome.first[v]).norm() < 1e-9, "vertex {v} is held");
        }
    }

    /// A mouth that opens without any pull: with the jaw that was found the whole motion is given back, with a shut one hardly any.
    #[test]
    fn a_jaw_that_was_found_open_is_opened_again() {
        let (face, project) = (face::generic(), Project::default());
        let mut outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        let none = vec![Vector3::zeros(); face.mesh().len()];
        let held = held_by(&project, &face, &outcome.first);
        let jaw = jaw_of(&face, &outcome.first);
        let spec = project.settings.skin_spec();
        let mut rest = SkinAtRest::new(face.mesh(), &outcome.first, &held, jaw, &spec).unwrap();
        rest.open_jaw(8.0_f64.to_radians());
        outcome.last = rest.solve(none.clone(), &outcome.first).unwrap().positions;
        outcome.last_in_image = outcome.last.iter().map(|x| outcome.camera.image_from_face(x)).collect();
        outcome.states = vec![VertexState::Measured; face.mesh().len()];
        let mut explained = |jaw: Option<JawOpen>| {
            outcome.muscles = Some(MuscleForces {
                law: LawKind::Anatomical,
                pulling: Vec::new(),
                jaw,
                among: 0,
                explained: 0.0,
                left_px: 0.0,
                misfit: 1.0,
                shape: Vec::new(),
                besides: None,
                measured: none.clone(),
                measured_sigma: vec![0.0; none.len()],
            });
            let replay = Replay::new(&project, &face, &outcome, none.clone()).unwrap();
            replay.explained(&replay.of_muscles)
        };
        let open = explained(Some(JawOpen { deg: 8.0, between: [7.0, 9.0] }));
        let shut = explained(None);
        assert!(open > 0.999_999 && shut.abs() < 0.01, "open {open}, shut {shut}");
    }

    #[test]
    fn without_a_measured_point_there_is_nothing_to_compare() {
        let face = face::generic();
        let outcome = pipeline::solve(&Project::default(), &face, [1036, 1036], &mut Workspace::default());
        let none = vec![Vector3::zeros(); face.mesh().len()];
        assert_eq!(Replay::new(&Project::default(), &face, &outcome, none), Err(ReplayError::NothingSeen));
    }
}
