//! The muscle-based way to the forces: those of the muscles under which the skin comes to rest nearest to where it was seen.

mod discrepancy;
mod motion;
mod shape;

use std::collections::BTreeMap;

use nalgebra::{DVector, Point2, Point3, Vector3};

use self::discrepancy::{Alone, Completed, complete};
use self::motion::{Body, Found, Seen, find, together};
use self::shape::{ShapeErrors, Shaped, Shaping};
use super::{CustomizeInput, Kept, Outcome, Warning, kept, stages};
use crate::expression::jaw::{WIDEST_DEG, jaw_of};
use crate::expression::{Actuator, TractionMesh, held};
use crate::face::{FaceModel, Mesh};
use crate::fit::design::Design;
use crate::fit::selection::{SelectionSettings, smallest_set};
use crate::fit::{Compare, Noise, Sample, student};
use crate::forces::{self, SkinSpec};
use crate::muscle::{LawKind, MuscleLaw, Parameter};
use crate::project::{MuscleWay, Project, Role};
use crate::simulate::SkinAtRest;

/// The muscles that stand for the measured forces.
#[derive(Clone, Debug, PartialEq)]
pub struct MuscleForces {
    /// How each pulls.
    pub law: LawKind,
    /// Those that pull, in the order of the face's actuators.
    pub pulling: Vec<Pulling>,
    /// How far the jaw is open; absent where the points do not feel it, or the face has none.
    pub jaw: Option<JawOpen>,
    /// Muscles among which they were chosen: those that the points can tell anything of.
    pub among: usize,
    /// Share of the points' motion (its squares in the picture, head motion left out) that they explain.
    pub explained: f64,
    /// Root mean square distance of the points from where they take the skin, px.
    pub left_px: f64,
    /// The same over what the marks, the head's motion and the landmarks are said to err by, of one coordinate: 1 where these muscles are all that
    /// moved the skin.
    pub misfit: f64,
    /// What pulls besides them; absent where it was not asked for.
    pub besides: Option<Besides>,
    /// The parameters of the law's shape that the points were asked for; empty where it is the usual one.
    pub shape: Vec<ShapeParameter>,
    /// The measured force on every vertex, N, which fits and profiles of muscles go on being made from.
    pub measured: Vec<Vector3<f64>>,
    /// Its standard error, N.
    pub measured_sigma: Vec<f64>,
}

/// A muscle that pulls.
#[derive(Clone, Debug, PartialEq)]
pub struct Pulling {
    /// Its id, as [`Actuator::id`].
    pub id: String,
    /// Its name for people, with the side.
    pub name: String,
    /// Share of its full strength.
    pub activation: f64,
    /// 95 % interval of the activation.
    pub between: [f64; 2],
    /// The sum of what it puts on the skin, N.
    pub strength_n: f64,
    /// How far it alone moves the points, root mean square, px.
    pub moves_px: f64,
}

/// A parameter of the law's shape as the points tell it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeParameter {
    /// Its short name: `sr`.
    pub name: &'static str,
    /// What it is, for people.
    pub label: &'static str,
    /// Its value.
    pub value: f64,
    /// 95 % interval of the value.
    pub between: [f64; 2],
    /// Its value in the law's usual shape.
    pub usual: f64,
}

/// How far the jaw is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JawOpen {
    /// Its angle, degrees; 0 is shut.
    pub deg: f64,
    /// 95 % interval of the angle.
    pub between: [f64; 2],
}

/// The pulls on the skin that are of no muscle, or of a muscle that does not pull as its law says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Besides {
    /// How large they may be, of the muscles' traction nearby: its standard deviation as the points tell it.
    pub share: f64,
    /// The sum of their lengths, N.
    pub newton: f64,
    /// The same as a share of all that pulls, 0 to 1.
    pub of_all: f64,
}

/// What a skin at rest is made from.
#[derive(Debug, PartialEq)]
pub(super) struct RestInput {
    first: Vec<Point3<f64>>,
    held: Vec<bool>,
    spec: SkinSpec,
}

/// How a landmark's mark moves every vertex of the first frame, mm per px, along each axis of the picture.
type LandmarkSlopes = [Vec<Vector3<f64>>; 2];

/// What the muscles' loads are made on, and actuators by the name of the law; or why there are none.
#[derive(Debug)]
struct LoadsOfLaws {
    mesh: Result<TractionMesh, String>,
    actuators: BTreeMap<&'static str, Result<Vec<Actuator>, String>>,
}

/// Kept from the last run.
#[derive(Debug, Default)]
pub(super) struct Ready {
    errors: Option<Kept<CustomizeInput, Vec<LandmarkSlopes>>>,
    rest: Option<Kept<RestInput, Result<SkinAtRest, String>>>,
    /// The muscles' loads, by the first frame; of each law that was asked for.
    loads: Option<Kept<Vec<Point3<f64>>, LoadsOfLaws>>,
}

/// A muscle is asked for where it moves a point by at least this share of its largest motion of the skin: one that the points hardly feel would
/// be made strong to explain a little noise, and would tear at the skin around.
const FELT: f64 = 0.2;
/// Newton steps of the skin shorter than this, mm, are none.
const REST_MM: f64 = 1e-3;
/// What the mesh misses of a force, of the root mean square of those around: on independent truths of finer meshes, exact marks and the law that made
/// them left 7 % (`docs/accuracy.md`).
const OF_MESH: f64 = 0.07;

/// What stays on its bone in a project's simulation: the rim and the corners of the eyes, the still points, for they are skin that the
/// expression cannot move, and the fixed ones.
pub fn held_by(project: &Project, face: &FaceModel, first: &[Point3<f64>]) -> Vec<bool> {
    let mut all = held(face, first);
    for (&v, feature) in &project.features {
        if let (Role::Still | Role::Fixed, Some(one)) = (feature.role, all.get_mut(v as usize)) {
            *one = true;
        }
    }
    all
}

/// Puts the forces of muscles in the place of the measured ones: F = −K X of the skin where the muscles that bring it nearest to the marked
/// points let it come to rest ([`find`]), of all that the points feel or of the smallest set of at most `most`; by one law, or by the one that leaves
/// the points nearest.
///
/// Skin that a bone holds gets the muscles' pull without the bone's reaction, and counts as border.
///
/// Neither smoothing nor a rule of depth is asked: an equilibrium has its own depth. Standard errors are those of the marks and of the head's
/// motion, carried through the linearised equilibrium, and times the misfit where that is above 1 (Birge 1932): what the muscles do not explain
/// counts as error of their strengths.
///
/// # Errors
/// A sentence that says why the field is left as it was measured; one of them that `stop` asked for it.
pub(super) fn explain(
    project: &Project,
    face: &FaceModel,
    outcome: &mut Outcome,
    way: MuscleWay,
    customized: &CustomizeInput,
    ready: &mut Ready,
    stop: &dyn Fn() -> bool,
) -> Result<(), String> {
    let slopes = kept(&mut ready.errors, customized.clone(), |input| landmark_slopes(face, input));
    let errors = stages::landmark_sigmas(project, face).zip(slopes.iter());
    let mut errors: Vec<Vec<Vector3<f64>>> = errors
        .flat_map(|(sigma, slopes)| slopes.iter().map(move |slope| slope.iter().map(|d| d * sigma).collect()))
        .collect();
    // A vertex that the hand has put in its place in the first frame errs by that mark instead.
    let own = |v: usize| project.features.get(&(v as u32)).and_then(|f| f.first.as_ref()).filter(|m| m.state.is_data());
    for v in (0..outcome.first.len()).filter(|v| own(*v).is_some()) {
        for moved in &mut errors {
            moved[v] = Vector3::zeros();
        }
    }
    let seen = stages::skin_marks(project, &outcome.states).map(|(v, mark)| {
        let first = own(v).map_or(0.0, |m| project.sigma_px(m));
        (v, Point2::from(mark.at_px), project.sigma_px(mark).hypot(first))
    });
    let Some(seen) = Seen::new(&outcome.camera, &outcome.head, &outcome.first, seen, &errors) else {
        return Err("no point of the skin is marked".to_owned());
    };
    let first = outcome.first.clone();
    let input = RestInput { held: held_by(project, face, &first), spec: project.settings.skin_spec(), first };
    let rest = kept(&mut ready.rest, input, |input| {
        let jaw = jaw_of(face, &input.first);
        let mut rest =
            SkinAtRest::new(face.mesh(), &input.first, &input.held, jaw, &input.spec).map_err(|why| why.to_string())?;
        rest.within(REST_MM);
        Ok(rest)
    });
    let rest = rest.as_mut().map_err(|why| why.clone())?;
    let LoadsOfLaws { mesh, actuators: loads } = kept(&mut ready.loads, outcome.first.clone(), |first| {
        let mesh = TractionMesh::new(face, first).map_err(|why| why.to_string());
        LoadsOfLaws { mesh, actuators: BTreeMap::new() }
    });
    let mesh = mesh.as_ref().map_err(Clone::clone)?;
    let mut nearest: Option<(LawKind, Tried)> = None;
    let mut why = NO_REST.to_owned();
    let laws = way.law.as_ref().map_or(&LawKind::ALL[..], std::slice::from_ref);
    for &law in laws {
        loads
            .entry(law.name())
            .or_insert_with(|| mesh.actuators(&MuscleLaw::default_of(law)).map_err(|why| why.to_string()));
    }
    for (law, actuators) in laws.iter().filter_map(|law| Some((*law, loads.get(law.name())?))) {
        if stop() {
            return Err(STOPPED.to_owned());
        }
        match actuators.as_ref().map_err(Clone::clone).and_then(|all| {
            let near = nearest.as_ref().map(|(_, tried)| tried);
            let tried = Tried::new(rest, all, &seen, near, &outcome.first)?;
            if !way.shape {
                return Ok(tried);
            }
            tried.shaped(rest, (mesh, MuscleLaw::default_of(law)), &seen, &outcome.first, stop)
        }) {
            Ok(tried) if nearest.as_ref().is_none_or(|(_, best)| tried.cost() < best.cost()) => {
                nearest = Some((law, tried));
            }
            Ok(_) => {}
            Err(reason) => why = reason,
        }
    }
    let (law, mut tried) = nearest.ok_or(why)?;
    let mut chosen = None;
    if let Some(most) = way.most {
        let few = fewest(&tried, &seen, &outcome.first, most).map_err(|why| why.to_string())?;
        let from = Some((tried.found.activations.clone(), &tried.found.positions[..]));
        let body = &mut Body { rest, jaw: tried.jaw() };
        tried.found = find(body, &tried.loads, &seen, Some(&few), from, &outcome.first).ok_or(NO_REST)?;
        chosen = Some(few);
    }
    let whole = if way.alone {
        None
    } else {
        let alone = Alone { loads: &tried.loads, found: &tried.found, allowed: chosen.as_deref() };
        let body = &mut Body { rest, jaw: tried.jaw() };
        let whole = complete(body, face.mesh(), &outcome.first, &seen, &alone, stop);
        whole.map_err(|why| outcome.warnings.push(Warning::NothingBesides { why })).ok()
    };
    let body = &mut Body { rest, jaw: tried.jaw() };
    if let Some(shape) = &mut tried.shape {
        shape.errors = Some(shape.of.errors(body, &seen, &shape.logs, (&tried.loads, &tried.found))?);
    }
    let (force, sigma, muscles) = said(outcome, face, rest, &seen, law, &tried, whole).ok_or(NO_REST)?;
    // What a bone holds carries its reaction, of which the muscles tell nothing.
    for ((border, free), state) in outcome.border.iter_mut().zip(rest.free()).zip(&outcome.states) {
        *border |= !free && state.is_known();
    }
    let normals = face.mesh().vertex_normals(&outcome.first);
    let (in_surface, normal) = forces::split(&force, &normals);
    let field = &mut outcome.field;
    field.tangential = in_surface.iter().map(Vector3::norm).collect();
    field.normal = normal;
    // No depth of a mark is asked.
    field.depth_change.fill(0.0);
    let measured = std::mem::replace(&mut field.force, force);
    let measured_sigma = std::mem::replace(&mut field.sigma, sigma);
    outcome.muscles = Some(MuscleForces { measured, measured_sigma, ..muscles });
    Ok(())
}

/// One law's muscles.
struct Tried<'a> {
    felt: Vec<&'a Actuator>,
    /// What each puts on every vertex at full strength, N; then, where the points feel it, the jaw, which puts nothing there ([`Body::jaw`]).
    loads: Vec<Vec<Vector3<f64>>>,
    found: Found,
    /// Of the law, where it was asked for.
    shape: Option<Shape<'a>>,
}

/// The shape of a law that the points tell.
struct Shape<'a> {
    of: Shaping<'a>,
    logs: DVector<f64>,
    /// What was minimised.
    cost: f64,
    /// Once they are asked for.
    errors: Option<ShapeErrors>,
}

impl Shape<'_> {
    /// The parameters, with intervals that are `widened` so many times.
    fn parameters(&self, widened: f64) -> Vec<ShapeParameter> {
        let rows = self.errors.as_ref().map_or(0, |e| e.errors.activations.nrows());
        let t = student::two_sided_95(None) * widened;
        let parameter = |(k, (p, &log)): (usize, (Parameter, &f64))| {
            let row = (rows + k).checked_sub(self.logs.len())?;
            let error = t * self.errors.as_ref()?.errors.of_activation(row);
            Some(ShapeParameter {
                name: p.name,
                label: p.label,
                value: Shaping::value(&p, log),
                between: [log - error, log + error].map(|log| Shaping::value(&p, log)),
                usual: p.value,
            })
        };
        self.of.unknowns().zip(&self.logs).enumerate().filter_map(parameter).collect()
    }
}

impl<'a> Tried<'a> {
    /// Fits the muscles of one law, and the jaw, from what another law's muscles come near with.
    fn new(
        rest: &mut SkinAtRest,
        all: &'a [Actuator],
        seen: &Seen<'_>,
        near: Option<&Tried<'_>>,
        first: &[Point3<f64>],
    ) -> Result<Self, String> {
        let mut loads: Vec<Vec<Vector3<f64>>> = all.iter().map(|a| dense(a, first.len())).collect();
        let jaw = rest.has_jaw().then_some(all.len());
        loads.extend(jaw.map(|_| vec![Vector3::zeros(); first.len()]));
        let shares = seen.felt(&mut Body { rest, jaw }, &loads, first).ok_or(NO_REST)?;
        let felt: Vec<&Actuator> = all.iter().zip(&shares).filter(|(_, s)| **s >= FELT).map(|(a, _)| a).collect();
        let loads: Vec<Vec<Vector3<f64>>> =
            loads.into_iter().zip(shares).filter(|(_, s)| *s >= FELT).map(|(load, _)| load).collect();
        if felt.is_empty() {
            return Err("no muscle moves a marked point".to_owned());
        }
        let start = near.map(|other| {
            let of = |j: usize| {
                let same = match felt.get(j) {
                    Some(actuator) => other.felt.iter().position(|a| a.id == actuator.id),
                    None => other.jaw(),
                };
                same.map_or(0.0, |k| other.found.activations[k])
            };
            (DVector::from_iterator(loads.len(), (0..loads.len()).map(of)), &other.found.positions[..])
        });
        let body = &mut Body { rest, jaw: jaw_column(felt.len(), loads.len()) };
        let found = find(body, &loads, seen, None, start, first).ok_or(NO_REST)?;
        Ok(Self { felt, loads, found, shape: None })
    }

    /// The same muscles with the shape of their law found too.
    fn shaped(
        self,
        rest: &mut SkinAtRest,
        (mesh, law): (&'a TractionMesh, MuscleLaw),
        seen: &Seen<'_>,
        first: &[Point3<f64>],
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, String> {
        let jaw = self.jaw();
        let muscles = self.felt.iter().map(|a| a.id.as_str()).collect();
        let of = Shaping::new(mesh, law, muscles, jaw.is_some());
        let Shaped { logs, loads, found, cost } =
            of.fit(&mut Body { rest, jaw }, seen, first, (self.loads, self.found), stop)?;
        Ok(Self { felt: self.felt, loads, found, shape: Some(Shape { of, logs, cost, errors: None }) })
    }

    /// What was minimised.
    fn cost(&self) -> f64 {
        self.shape.as_ref().map_or(self.found.cost, |shape| shape.cost)
    }

    /// The jaw's column.
    fn jaw(&self) -> Option<usize> {
        jaw_column(self.felt.len(), self.loads.len())
    }
}

/// The column after those of the muscles, if there is one.
fn jaw_column(muscles: usize, columns: usize) -> Option<usize> {
    (columns > muscles).then_some(muscles)
}

const NO_REST: &str = "the skin finds no rest under the muscles";
const STOPPED: &str = "the fit was stopped";

/// [`LandmarkSlopes`] of all landmarks, by differences of whole fits. A landmark whose fit cannot be made moves nothing.
fn landmark_slopes(face: &FaceModel, input: &CustomizeInput) -> Vec<LandmarkSlopes> {
    const STEP_PX: f64 = 0.5;
    let base = stages::customized(face.mesh(), input).positions;
    let moved = |target: usize, axis: usize| {
        let mut targets = input.targets.clone();
        targets[target].at_in_image[axis] += STEP_PX;
        let there = stages::customized(face.mesh(), &CustomizeInput { targets, ..input.clone() }).positions;
        there.iter().zip(&base).map(|(a, b)| (a - b) / STEP_PX).collect()
    };
    (0..input.targets.len()).map(|target| [moved(target, 0), moved(target, 1)]).collect()
}

/// An actuator's loads at full strength on every vertex, N.
fn dense(actuator: &Actuator, vertices: usize) -> Vec<Vector3<f64>> {
    let mut newton = vec![Vector3::zeros(); vertices];
    actuator.add_loads(1.0, &mut newton);
    newton
}

/// The smallest set of muscles by the motion of the points, made linear where all of them were fitted ([`smallest_set`]); the jaw stays where it is,
/// and is no muscle.
fn fewest(
    tried: &Tried<'_>,
    seen: &Seen<'_>,
    first: &[Point3<f64>],
    most: u8,
) -> Result<Vec<bool>, crate::fit::design::DesignError> {
    let (found, muscles) = (&tried.found, tried.felt.len());
    let aim = &found.off + found.slopes.columns(0, muscles) * found.activations.rows(0, muscles);
    // Two coordinates of the picture as a vector that has none across it; the standard error of a vector of two.
    let at = |v: &nalgebra::DVector<f64>, k: usize, sigma: f64| Vector3::new(v[2 * k], v[2 * k + 1], 0.0) * sigma;
    let sample = |(k, &(v, _, sigma)): (usize, &(usize, Point2<f64>, f64))| Sample {
        position: first[v],
        force: at(&aim, k, sigma),
        sigma: sigma * std::f64::consts::SQRT_2,
        normal: Vector3::z(),
    };
    let samples: Vec<Sample> = seen.points().iter().enumerate().map(sample).collect();
    let mut design = Design::new(&samples, Compare::Tangential)?;
    for slope in found.slopes.column_iter().take(muscles) {
        let column = slope.into_owned();
        design.add(seen.points().iter().enumerate().map(|(k, point)| at(&column, k, point.2)));
    }
    let positions: Vec<Point3<f64>> = samples.iter().map(|s| s.position).collect();
    let settings = SelectionSettings { most: most.into(), noise: Noise::Estimated, ..SelectionSettings::default() };
    let chosen = smallest_set(&design, &positions, &settings).chosen;
    Ok((0..found.activations.len()).map(|j| j >= muscles || chosen.contains(&j)).collect())
}

/// Variance of a force by what the mesh misses ([`OF_MESH`]), N².
fn of_mesh(mesh: &Mesh, force: &[Vector3<f64>], vertex: usize) -> f64 {
    let around = mesh.neighbours(vertex).iter().map(|u| *u as usize).chain([vertex]);
    let (sum, count) = around.fold((0.0, 0.0), |(sum, count), u| (sum + force[u].norm_squared(), count + 1.0));
    OF_MESH * OF_MESH * sum / count
}

/// The muscles' field and its standard errors, N, and the muscles themselves; `whole` is what they are with what they leave.
fn said(
    outcome: &Outcome,
    face: &FaceModel,
    rest: &SkinAtRest,
    seen: &Seen<'_>,
    law: LawKind,
    tried: &Tried<'_>,
    whole: Option<Completed>,
) -> Option<(Vec<Vector3<f64>>, Vec<f64>, MuscleForces)> {
    let (n, jaw, Tried { felt, loads, found, shape }) = (outcome.first.len(), tried.jaw(), tried);
    let degrees = |activations: &DVector<f64>| {
        let pulls = activations.iter().filter(|a| **a > 0.0).count() + shape.as_ref().map_or(0, |s| s.logs.len());
        (2 * seen.len()).saturating_sub(pulls).max(1) as f64
    };
    let misfit = (found.square / degrees(&found.activations)).sqrt();
    let left_px = seen.rms_px(|row| found.off[row]);
    let share = whole.as_ref().map(|w| w.share);
    let whole = if let Some(whole) = whole {
        whole
    } else {
        let with_shape = shape.as_ref().and_then(|s| Some(s.errors.as_ref()?.errors.clone()));
        Completed::alone(found, n, with_shape.or_else(|| found.errors())?)
    };
    let widened = (whole.square / degrees(&whole.activations)).sqrt().max(1.0);
    let x = &whole.positions;
    let (known, all) = (outcome.states.iter().map(|s| s.is_known()).collect::<Vec<bool>>(), vec![true; n]);
    let pulls = together(loads, &whole.activations);
    let mut force = Vec::new();
    rest.skin().muscle_forces(x, &all, &mut force);
    for v in 0..n {
        if !known[v] {
            force[v] = Vector3::zeros();
        } else if !rest.free()[v] {
            // What is left there is the bone's.
            force[v] = pulls[v];
        }
    }
    let slopes = rest.skin().slopes(x, &all);
    // δF_i = Σ_j B_ij (δx_i − δx_j).
    let errors = &whole.errors;
    // Of the fit with what the muscles leave the shape counts as known.
    let by_shape = shape.as_ref().and_then(|s| s.errors.as_ref()).map_or(&[][..], |e| &e.pulls);
    let columns = loads.iter().take(felt.len()).zip(0..).chain(by_shape.iter().zip(loads.len()..));
    let columns: Vec<_> = columns.filter(|(_, row)| *row < errors.activations.nrows()).collect();
    let variance = |v: usize| -> f64 {
        let rows: Vec<_> = slopes.at(v).collect();
        let change = |c: usize| {
            if !rest.free()[v] {
                return columns.iter().map(|(pull, row)| pull[v] * errors.activations[(*row, c)]).sum::<Vector3<f64>>();
            }
            let at = |v: usize| errors.places.fixed_view::<3, 1>(3 * v, c);
            rows.iter().map(|(j, block)| block * (at(v) - at(*j))).sum::<Vector3<f64>>()
        };
        (0..errors.places.ncols()).map(|c| change(c).norm_squared()).sum()
    };
    let sigma = |v: usize| {
        if known[v] { (widened * widened * variance(v) + of_mesh(face.mesh(), &force, v)).sqrt() } else { 0.0 }
    };
    let sigma: Vec<f64> = (0..n).map(sigma).collect();
    let t = student::two_sided_95(None);
    let between = |j: usize| {
        let (a, error) = (whole.activations[j], widened * errors.of_activation(j));
        [(a - t * error).max(0.0), a + t * error]
    };
    let jaw = jaw.map(|j| JawOpen {
        deg: WIDEST_DEG * whole.activations[j].min(1.0),
        between: between(j).map(|a| WIDEST_DEG * a.min(1.0)),
    });
    let pulling = felt.iter().enumerate().filter(|(j, _)| whole.activations[*j] > 0.0).map(|(j, actuator)| {
        let a = whole.activations[j];
        Pulling {
            id: actuator.id.clone(),
            name: actuator.label(),
            activation: a,
            between: between(j),
            strength_n: a * actuator.strength_n,
            moves_px: seen.rms_px(|row| a * found.slopes[(row, j)]),
        }
    });
    let pulling = pulling.collect();
    let still = |(v, at, _): &(usize, Point2<f64>, f64)| {
        let there = outcome.head.motion.last_from_first(&outcome.first[*v]);
        (at - outcome.camera.image_from_face(&there)).norm_squared()
    };
    let motion: f64 = seen.points().iter().map(still).sum();
    let explained = 1.0 - left_px * left_px * seen.len() as f64 / motion.max(f64::MIN_POSITIVE);
    let besides = share.map(|share| {
        let sum = |all: &[Vector3<f64>]| all.iter().map(Vector3::norm).sum::<f64>();
        let newton = sum(&whole.besides);
        Besides { share, newton, of_all: newton / (newton + sum(&pulls)).max(f64::MIN_POSITIVE) }
    });
    let muscles = MuscleForces {
        law,
        pulling,
        jaw,
        among: felt.len(),
        explained,
        left_px,
        misfit,
        besides,
        shape: shape.as_ref().map_or_else(Vec::new, |s| s.parameters(widened)),
        measured: Vec::new(),
        measured_sigma: Vec::new(),
    };
    Some((force, sigma, muscles))
}

#[cfg(test)]
mod tests;
