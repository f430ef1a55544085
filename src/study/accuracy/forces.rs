//! Forces from marks: the ways to the field, their rules, and the marking error, on scenes whose forces are known.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::kind::Options;
use super::super::points::median;
use super::super::runner::Case;
use super::super::scene;
use super::super::table::Run;
use super::super::twin::{Twin, TwinSettings, normal_pair};
use super::{case, run};
use crate::displacement::regularised::WeightRule;
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::face::FaceModel;
use crate::forces::SpringRule;
use crate::muscle::{LawKind, MuscleLaw};
use crate::muscle_field::activation_field;
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::{FieldWay, FrameRef, Project, Role, Settings};

/// Marks moved one after the other while the chain is timed.
const DRAGS: usize = 9;
/// Side of the twin's frames, px.
const SIZE: u32 = 1036;
/// The rough motion: bumps, their height, and their radius, mm.
const BUMPS: usize = 24;
const BUMP_MM: [f64; 2] = [2.5, 12.0];

/// A way to the field.
#[derive(Clone, Copy)]
enum Way {
    Chain(FieldWay),
    /// The muscles fitted to the regularised field, by one law.
    Muscles(LawKind),
}

impl Way {
    fn all() -> Vec<(String, Self)> {
        let chain = FieldWay::Regularised { weight: WeightRule::Discrepancy };
        let mut all = vec![("Direct".to_owned(), Self::Chain(FieldWay::Direct))];
        all.extend(WeightRule::ALL.map(|weight| {
            let name = format!("{}, {}", chain.label(), weight.label().to_lowercase());
            (name, Self::Chain(FieldWay::Regularised { weight }))
        }));
        all.extend(
            [LawKind::WatersSheet, LawKind::Anatomical]
                .map(|law| (format!("Muscles, {}", law.label().to_lowercase()), Self::Muscles(law))),
        );
        all
    }

    fn field(self) -> FieldWay {
        match self {
            Self::Chain(way) => way,
            Self::Muscles(_) => FieldWay::Regularised { weight: WeightRule::Discrepancy },
        }
    }
}

/// One thing about the chain that is not as in the scene.
type Change = (&'static str, fn(&mut Settings));

/// The scene's own rules, and each other rule alone.
const CHANGES: [Change; 4] = [
    ("rules=as the scene", |_| {}),
    ("depth=fixed", |s| s.depth = DepthRule::FixedDepth),
    ("springs=one for all", |s| s.springs = SpringRule::Uniform),
    ("unmarked=held", |s| s.unmarked = UnmarkedRule::Held),
];

pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let noises: &[f64] = if options.quick { &[0.0, 0.3, 1.0] } else { &[0.0, 0.1, 0.3, 1.0, 2.0, 3.0] };
    let mut cases = Vec::new();
    for part in [0, 1] {
        for &noise in noises {
            for (name, way) in Way::all() {
                for (setting, change) in CHANGES {
                    // The rough motion is there for the ways; the rules were tried on the first scene.
                    if part == 1 && setting != CHANGES[0].0 {
                        continue;
                    }
                    let (face, of) = (Arc::clone(&options.face), name.clone());
                    let key = format!("{setting} · {noise} px");
                    let work = move || {
                        let one = |seed| {
                            let row = run(part, &of, setting);
                            let row = Run { noise_px: noise, vertices: face.mesh().len(), seed, ..row };
                            measured(&face, part == 1, way, change, row)
                        };
                        (1..=seeds).map(one).collect()
                    };
                    let case = case(part, &name, &key, work);
                    cases.push(case.weighing(0.05));
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
}

fn scene(generic: &FaceModel, rough: bool, noise_px: f64, seed: u64) -> Result<Scene, String> {
    let settings = TwinSettings { seed, noise_px, ..TwinSettings::default() };
    let person = scene::person(generic, seed, settings.distance_mm).map_err(|e| e.to_string())?;
    let mut twin = Twin::generate(&person, &settings).map_err(|e| e.to_string())?;
    if rough {
        roughen(&mut twin, &person, seed);
    }
    let frame =
        |name: &str| FrameRef { path: name.to_owned(), sha256: "0".repeat(64), width_px: SIZE, height_px: SIZE };
    let project = scene::project(&twin, &person, [frame("first.png"), frame("last.png")], noise_px);
    let truth = scene::true_forces(&twin, &person, &project.settings);
    Ok(Scene { face: generic.clone(), project, truth })
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

fn measured(generic: &FaceModel, rough: bool, way: Way, change: fn(&mut Settings), row: Run) -> Run {
    let scene = match scene(generic, rough, row.noise_px, row.seed) {
        Ok(scene) => scene,
        Err(why) => return row.failing(Some(why)),
    };
    let mut project = scene.project;
    if rough {
        // Its points leave the surface: the depth of the first frame is the truth here.
        project.settings.depth = DepthRule::FixedDepth;
    }
    change(&mut project.settings);
    project.settings.field = way.field();
    let size = [SIZE, SIZE];
    let mut workspace = Workspace::default();
    let outcome = pipeline::solve(&project, &scene.face, size, &mut workspace);
    let find = |outcome: &Outcome| match way {
        Way::Chain(_) => Some(outcome.field.force.clone()),
        Way::Muscles(law) => activation_field(&scene.face, outcome, &MuscleLaw::default_of(law)),
    };
    let Some(force) = find(&outcome) else { return row.failing(Some("the muscles cannot be fitted".to_owned())) };
    let inner: Vec<usize> = (0..force.len()).filter(|&v| outcome.is_believed(v)).collect();
    let square = |of: &dyn Fn(usize) -> Vector3<f64>| inner.iter().map(|&v| of(v).norm_squared()).sum::<f64>();
    let size_of_truth = square(&|v| scene.truth[v]);
    let error = (square(&|v| force[v] - scene.truth[v]) / size_of_truth).sqrt();
    let stated: f64 = inner.iter().map(|&v| outcome.field.sigma[v].powi(2)).sum();
    let row = row.erring(error).timed(time(&project, &scene.face, size, &mut workspace, &find));
    match way {
        Way::Chain(_) if stated > 0.0 => row.with("error_over_stated", error * (size_of_truth / stated).sqrt()),
        _ => row,
    }
}

/// Median time of the whole chain after a mark was dragged, and of what follows it, ms.
fn time(
    project: &Project,
    face: &FaceModel,
    size: [u32; 2],
    workspace: &mut Workspace,
    find: &dyn Fn(&Outcome) -> Option<Vec<Vector3<f64>>>,
) -> f64 {
    let mut dragged = project.clone();
    let skin: Vec<u32> = dragged.features.iter().filter(|(_, f)| f.role == Role::Skin).map(|(v, _)| *v).collect();
    let mut times = Vec::with_capacity(DRAGS);
    for k in 0..DRAGS {
        let Some(v) = skin.get(k * skin.len() / DRAGS) else { continue };
        if let Some(mark) = dragged.features.get_mut(v).and_then(|f| f.last.as_mut()) {
            mark.at_px[0] += 0.1;
        }
        let begun = Instant::now();
        let outcome = pipeline::solve(&dragged, face, size, workspace);
        std::hint::black_box(find(&outcome));
        times.push(begun.elapsed().as_secs_f64() * 1e3);
    }
    median(&mut times).unwrap_or(f64::NAN)
}
