//! Forces from marks: the ways to the field, their rules, and the marking error, on scenes whose forces are known.

use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::applied::method;
use super::super::kind::Options;
use super::super::membrane_truth::{MembraneFace, MembraneSettings};
use super::super::runner::Case;
use super::super::scene;
use super::super::table::Run;
use super::super::twin::{Twin, TwinSettings, normal_pair};
use super::super::yardstick::{after_a_drag_ms, covered, gentle, relative_error, squares};
use super::{case, run};
use crate::displacement::regularised::WeightRule;
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::expression::{Basic, Expression, Refined};
use crate::face::FaceModel;
use crate::forces::{SkinModel, SpringRule};
use crate::muscle::{LawError, LawKind, MuscleLaw, Parameter};
use crate::pipeline::{self, Workspace};
use crate::project::{FieldWay, MuscleWay, Project, Role, Settings};
use crate::simulate::Ended;

/// Marks moved one after the other while the chain is timed.
const DRAGS: usize = 9;
/// The same where an answer takes tens of milliseconds.
const SLOW_DRAGS: usize = 3;
/// Side of the twin's frames, px.
const SIZE: u32 = 1036;
/// The rough motion: bumps, their height, and their radius, mm.
const BUMPS: usize = 24;
const BUMP_MM: [f64; 2] = [2.5, 12.0];

/// Share of its full strength at which an expression is a truth: at the whole of it skin is stretched to where the table is steepest.
const INTENSITY: f64 = 0.6;
/// The expressions that move the forehead, and where they are marked.
const EXPRESSIONS: [Basic; 4] = [Basic::Surprise, Basic::Sad, Basic::Anger, Basic::Fear];
/// Marking errors tried on whole faces, px.
const WHOLE_NOISES: [f64; 3] = [0.0, 0.3, 1.0];
/// Powers of two by which a law of another shape differs.
const SHAPED: f64 = 1.0;
const REGION: &str = "forehead_and_brows";

/// Where the true forces come from.
#[derive(Clone, Copy, PartialEq)]
enum Truth {
    /// A prescribed brow raise, and the project's own springs.
    Raise,
    /// Bumps, and the project's own springs.
    Rough,
    /// One of four expressions, by the seed: membrane elements of a finer mesh in equilibrium under muscles.
    Membrane,
    /// The same by muscles that are not where the face has them ([`scene::muscles_elsewhere`]).
    Elsewhere,
    /// The same by muscles whose law spreads their pull otherwise than it usually does.
    Spread,
    /// As the membranes, of a face marked as a whole: with lids, lips and an open jaw.
    Whole,
    WholeElsewhere,
}

impl Truth {
    const ALL: [Self; 7] =
        [Self::Raise, Self::Rough, Self::Membrane, Self::Elsewhere, Self::Spread, Self::Whole, Self::WholeElsewhere];

    /// Whether it is of a membrane.
    fn settles(self) -> bool {
        !matches!(self, Self::Raise | Self::Rough)
    }

    fn is_whole(self) -> bool {
        matches!(self, Self::Whole | Self::WholeElsewhere)
    }

    /// How long a case takes beside others.
    fn weight(self) -> f64 {
        match self {
            Self::Raise | Self::Rough => 0.05,
            Self::Membrane | Self::Elsewhere | Self::Spread => 0.3,
            Self::Whole | Self::WholeElsewhere => 3.0,
        }
    }

    fn is_elsewhere(self) -> bool {
        matches!(self, Self::Elsewhere | Self::WholeElsewhere)
    }

    fn part(self) -> usize {
        Self::ALL.iter().position(|t| *t == self).unwrap_or(0)
    }
}

/// A person, where an expression takes every vertex (mm), and its forces (N).
struct Made {
    person: FaceModel,
    name: &'static str,
    last: Vec<Point3<f64>>,
    force: Vec<Vector3<f64>>,
    /// Whether no spring there is stretched by so much that the vertex is not compared.
    gentle: Vec<bool>,
}

/// The expressions of the seeds, each made once.
type Membranes = Arc<Vec<OnceLock<Result<Made, String>>>>;

fn made(generic: &FaceModel, truth: Truth, seed: u64) -> Result<Made, String> {
    let basic = EXPRESSIONS[(seed as usize).wrapping_sub(1) % EXPRESSIONS.len()];
    let distance_mm = TwinSettings::default().distance_mm;
    let person = scene::person(generic, seed, distance_mm).map_err(|e| e.to_string())?;
    let elsewhere = truth.is_elsewhere().then(|| scene::muscles_elsewhere(&person, seed));
    let elsewhere = elsewhere.transpose().map_err(|e| e.to_string())?;
    let mut settings = MembraneSettings::default();
    if truth == Truth::Spread {
        settings.law = spread_otherwise(&settings.law, seed).map_err(|e| e.to_string())?;
    }
    let mut face = MembraneFace::new(elsewhere.as_ref().unwrap_or(&person), &settings).map_err(|e| e.to_string())?;
    let expression = Expression::basic(basic, face.actuators()).times(INTENSITY);
    let truth = face.truth(&expression).map_err(|e| e.to_string())?;
    if truth.ended != Ended::Converged {
        return Err(format!("no truth: {}", truth.ended.label()));
    }
    let gentle = gentle(person.mesh(), &truth.last, Settings::default().skin_thickness_mm);
    Ok(Made { person, name: basic.name(), last: truth.last, force: truth.force, gentle })
}

/// A law of another shape: each of its parameters over where its scale begins by up to twice as much or half.
fn spread_otherwise(law: &MuscleLaw, seed: u64) -> Result<MuscleLaw, LawError> {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x7368_6170);
    let mut other = |p: &Parameter| {
        let times = random.random_range(-SHAPED..SHAPED).exp2();
        (p.origin + (p.value - p.origin) * times).clamp(p.low, p.high)
    };
    law.with_parameters(&law.parameters().iter().map(&mut other).collect::<Vec<f64>>())
}

/// The ways to the field, by name; in a quick study muscles only by the law that leaves least.
fn ways(quick: bool) -> Vec<(String, FieldWay)> {
    let weight = WeightRule::Discrepancy;
    let mut all = vec![FieldWay::Direct];
    all.extend(WeightRule::ALL.map(|weight| FieldWay::Regularised { weight }));
    let laws = [None, Some(LawKind::WatersSheet), Some(LawKind::Anatomical)];
    for alone in [false, true] {
        let tried = laws.iter().take(if quick { 1 } else { laws.len() });
        all.extend(tried.map(|&law| FieldWay::Muscles(MuscleWay { weight, law, alone, ..MuscleWay::default() })));
        let law = Some(LawKind::Anatomical);
        let shaped = MuscleWay { weight, law, alone, shape: true, ..MuscleWay::default() };
        all.extend((!quick).then_some(FieldWay::Muscles(shaped)));
    }
    all.into_iter().map(|way| (method(way), way)).collect()
}

/// One thing about the chain that is not as in the scene.
type Change = (&'static str, fn(&mut Settings));

/// The scene's own rules, and each other rule alone.
const CHANGES: [Change; 8] = [
    ("rules=as the scene", |_| {}),
    ("depth=fixed", |s| s.depth = DepthRule::FixedDepth),
    ("depth=height", |s| s.depth = DepthRule::KeepHeight),
    ("depth=half", |s| s.depth = DepthRule::HalfWay),
    ("springs=one for all", |s| s.springs = SpringRule::Uniform),
    ("unmarked=held", |s| s.unmarked = UnmarkedRule::Held),
    (MEMBRANE, |s| s.skin_model = SkinModel::Membrane),
    (FINER, |s| s.skin_model = SkinModel::Membrane),
];
/// The setting of a membrane on the face's own mesh, and of one on the mesh with every triangle cut into four.
const MEMBRANE: &str = "skin=membrane";
const FINER: &str = "skin=membrane; mesh=finer";

impl Truth {
    /// What is tried on a truth: every rule on the first, of which muscles ask none, and on the others what its skin is; the mesh level on foreheads
    /// that a membrane moves, but for muscles; the shape of a law on
    /// foreheads of a membrane.
    fn tries(self, setting: &str, way: FieldWay) -> bool {
        if matches!(way, FieldWay::Muscles(MuscleWay { shape: true, .. })) {
            return matches!(self, Self::Membrane | Self::Elsewhere | Self::Spread) && setting == MEMBRANE;
        }
        match self {
            Self::Raise if matches!(way, FieldWay::Muscles(_)) => setting == CHANGES[0].0,
            Self::Raise => ![MEMBRANE, FINER].contains(&setting),
            Self::Rough => setting == CHANGES[0].0,
            Self::Membrane if matches!(way, FieldWay::Muscles(_)) => setting == CHANGES[0].0 || setting == MEMBRANE,
            Self::Membrane => [CHANGES[0].0, MEMBRANE, FINER].contains(&setting),
            _ => setting == MEMBRANE,
        }
    }
}

pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let noises: &[f64] = if options.quick { &[0.0, 0.3, 1.0] } else { &[0.0, 0.1, 0.3, 1.0, 2.0, 3.0] };
    let mut cases = Vec::new();
    for truth in Truth::ALL {
        let membranes: Membranes = Arc::new((0..seeds).map(|_| OnceLock::new()).collect());
        // A whole face takes ten times as long.
        for &noise in noises.iter().filter(|n| !truth.is_whole() || WHOLE_NOISES.contains(n)) {
            for (name, way) in ways(options.quick) {
                for (setting, change) in CHANGES {
                    if !truth.tries(setting, way) {
                        continue;
                    }
                    let (face, of, membranes) = (Arc::clone(&options.face), name.clone(), Arc::clone(&membranes));
                    let key = format!("{setting} · {noise} px");
                    let work = move || {
                        let finer = (setting == FINER).then(|| scene::finer(&face)).transpose();
                        let one = |seed| {
                            let mesh =
                                finer.as_ref().ok().and_then(Option::as_ref).map_or(face.mesh(), |f| f.face.mesh());
                            let row = run(truth.part(), &of, setting);
                            let row = Run { noise_px: noise, vertices: mesh.len(), seed, ..row };
                            let scene = scene(&face, truth, &membranes, noise, seed);
                            match scene.and_then(|s| Ok((s, finer.as_ref().map_err(Clone::clone)?))) {
                                Ok((scene, finer)) => measured(scene, finer.as_ref(), way, change, row),
                                Err(why) => row.failing(Some(why)),
                            }
                        };
                        (1..=seeds).map(one).collect()
                    };
                    cases.push(case(truth.part(), &name, &key, work).weighing(truth.weight()));
                }
            }
        }
    }
    cases
}

/// A scene: who, what moved, the marks, and the true forces.
struct Scene {
    face: FaceModel,
    project: Project,
    truth: Vec<Vector3<f64>>,
    /// Whether a vertex is compared.
    counts: Vec<bool>,
}

fn scene(
    generic: &FaceModel,
    truth: Truth,
    membranes: &[OnceLock<Result<Made, String>>],
    noise_px: f64,
    seed: u64,
) -> Result<Scene, String> {
    let settings = TwinSettings { seed, noise_px, ..TwinSettings::default() };
    let frames = scene::unseen_frames(SIZE);
    if truth.settles() {
        let slot = membranes.get(seed as usize - 1).ok_or("no such seed")?;
        let made = slot.get_or_init(|| made(generic, truth, seed)).as_ref().map_err(Clone::clone)?;
        let twin = Twin::displaced(&made.person, made.last.clone(), &settings).map_err(|e| e.to_string())?;
        let mut project = scene::membrane_project(&twin, &made.person, frames, noise_px, made.name, 0.0);
        if !truth.is_whole() {
            scene::mark_only(&mut project, made.person.region(REGION));
        }
        // Every vertex of the membrane keeps its own height above the skull.
        project.settings.depth = DepthRule::KeepHeight;
        let (truth, counts) = (made.force.clone(), made.gentle.clone());
        return Ok(Scene { face: generic.clone(), project, truth, counts });
    }
    let person = scene::person(generic, seed, settings.distance_mm).map_err(|e| e.to_string())?;
    let mut twin = Twin::generate(&person, &settings).map_err(|e| e.to_string())?;
    if truth == Truth::Rough {
        roughen(&mut twin, &person, seed);
    }
    let mut project = scene::project(&twin, &person, frames, noise_px);
    if truth == Truth::Rough {
        // Its points leave the surface: the depth of the first frame is the truth here.
        project.settings.depth = DepthRule::FixedDepth;
    }
    let truth = scene::true_forces(&twin, &person, &project.settings);
    let counts = vec![true; truth.len()];
    Ok(Scene { face: generic.clone(), project, truth, counts })
}

/// Bumps of random place and height on the motion of the forehead, within the plane of the picture: what has bumps as narrow as one edge
/// and a half is as rough as the mesh can show.
fn roughen(twin: &mut Twin, person: &FaceModel, seed: u64) {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x726f_7567);
    let region = person.region("forehead");
    let Some(&first) = region.first() else { return };
    let bumps: Vec<(usize, [f64; 2])> = (0..BUMPS)
        .map(|_| {
            let at = region.get(random.random_range(0..region.len())).copied().unwrap_or(first);
            (at as usize, normal_pair(&mut random))
        })
        .collect();
    let still = person.region("still");
    for v in 0..twin.last.len() {
        let here = twin.first[v];
        let moves = if still.contains(&(v as u32)) { 0.0 } else { BUMP_MM[0] };
        for (at, height) in &bumps {
            let far = (here.xy() - twin.first[*at].xy()).norm_squared() / (BUMP_MM[1] * BUMP_MM[1]);
            let by = Vector3::new(height[0], height[1], 0.0) * (moves * (-far).exp());
            twin.last[v] += by;
        }
        // Depth is as the chain takes it, so that what is left is due to the marks.
        twin.last[v].z = here.z;
        twin.last_in_image[v] = twin.camera.image_from_face(&twin.head_motion.last_from_first(&twin.last[v]));
    }
}

/// A row with the error and the time of a way on the face's own mesh or on a finer one. A mark is a mark of the same vertex there; forces are compared
/// on the face's own vertices, gathered; their stated errors are not, for those of neighbours are not independent.
fn measured(scene: Scene, finer: Option<&Refined>, way: FieldWay, change: fn(&mut Settings), row: Run) -> Run {
    let mut project = scene.project;
    change(&mut project.settings);
    project.settings.field = way;
    let size = [SIZE, SIZE];
    let mut workspace = Workspace::default();
    let face = finer.map_or(&scene.face, |f| &f.face);
    let outcome = pipeline::solve(&project, face, size, &mut workspace);
    if matches!(way, FieldWay::Muscles(_)) && outcome.muscles.is_none() {
        return row.failing(Some("the muscles cannot be fitted".to_owned()));
    }
    let force = finer.map_or_else(|| outcome.field.force.clone(), |f| f.gathered(&outcome.field.force));
    // Still points, the rim and the corners of the eyes are held by bones: the force on them is no muscle's.
    let held = pipeline::held_by(&project, face, &outcome.first);
    let skin = |v: usize| project.features.get(&(v as u32)).is_some_and(|f| f.role == Role::Skin);
    let inner: Vec<usize> =
        (0..force.len()).filter(|&v| scene.counts[v] && outcome.is_believed(v) && skin(v) && !held[v]).collect();
    let size_of_truth = squares(&scene.truth, &inner);
    let error = relative_error(&force, &scene.truth, &inner);
    let stated: f64 = inner.iter().map(|&v| outcome.field.sigma[v].powi(2)).sum();
    let drags = if matches!(way, FieldWay::Muscles(_)) { SLOW_DRAGS } else { DRAGS };
    let time = after_a_drag_ms(&project, drags, |dragged| {
        std::hint::black_box(pipeline::solve(dragged, face, size, &mut workspace));
    });
    let row = row.erring(error).timed(time);
    if stated == 0.0 || finer.is_some() {
        return row;
    }
    let covered = covered(&force, &scene.truth, &outcome.field.sigma, &inner);
    row.with("error_over_stated", error * (size_of_truth / stated).sqrt()).with("covered_percent", 100.0 * covered)
}
