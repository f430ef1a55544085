//! Maps of the forward model: time step and stiffness, skin pressed together, folded skin, skin whose table has steep slopes.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::table::Run;
use super::{case, cause_of, run};
use crate::face::FaceModel;
use crate::simulate::{
    Ended, EquilibriumSolver, Method, SkinLaw, State, Stepper, System, SystemError, SystemOptions, rim,
};
use crate::skin::{Contraction, StressStrainCurve};

/// Sum of the lengths of the loads, N: one strong muscle.
const PULL_N: f64 = 1.0;
/// Radius of the pulled skin, mm.
const PULLED_MM: f64 = 25.0;
/// Largest speed at the start, mm/s.
const PUSH_MM_S: f64 = 20.0;
/// A run lasts so long, s, within these numbers of steps.
const LASTS_S: f64 = 0.1;
const STEPS: [usize; 2] = [40, 100];
/// What a method is given where its step is no axis of the map: this share of its limit, or one frame of a screen.
const SHARE_OF_LIMIT: f64 = 0.5;
const FRAME_S: f64 = 1.0 / 60.0;
/// Strain beyond which the table of the contrast map is steeper, and its slope before, kPa.
const KNEE: f64 = 0.1;
const SLOPE_KPA: f64 = 45.0;

/// The cases of the four maps.
pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let face = &options.face;
    let (steps, stiffnesses, shares): (&[f64], &[f64], &[f64]) = if options.quick {
        (&[0.01, 0.1, 1.0, 10.0], &[0.01, 1.0, 100.0], &[100.0, 70.0, 40.0])
    } else {
        (
            &[0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 33.0],
            &[0.01, 0.1, 1.0, 10.0, 100.0],
            &[100.0, 95.0, 90.0, 80.0, 60.0, 40.0, 20.0],
        )
    };
    let (thrown, contrasts): (&[f64], &[f64]) = if options.quick {
        (&[1.0, 20.0, 100.0], &[1.0, 30.0, 1000.0])
    } else {
        (&[1.0, 3.0, 10.0, 30.0, 100.0, 300.0], &[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
    };
    let mut cases = Vec::new();
    for method in Method::ALL {
        for &stiffness in stiffnesses {
            for &step_ms in steps {
                let setting = [("step_ms", step_ms), ("stiffness", stiffness)];
                cases.push(cell(0, face, Way::Stepped(method), setting.to_vec(), seeds, move |face, _, _| {
                    let system = pulled(face, SystemOptions { stiffness, ..SystemOptions::default() }, 1.0)?;
                    let state = system.at_rest();
                    Ok(Start { system, state, step_s: Some(1e-3 * step_ms), must_unfold: false })
                }));
            }
        }
        for &share in shares {
            for &step_ms in steps {
                let setting = [("step_ms", step_ms), ("pressed_to_percent", share)];
                cases.push(cell(1, face, Way::Stepped(method), setting.to_vec(), seeds, move |face, _, _| {
                    let system = pulled(face, SystemOptions::default(), 0.0)?;
                    let state = pressed(&system, share / 100.0);
                    Ok(Start { system, state, step_s: Some(1e-3 * step_ms), must_unfold: false })
                }));
            }
        }
    }
    for way in Way::all() {
        for &count in thrown {
            let setting = vec![("vertices_thrown", count)];
            cases.push(cell(2, face, way, setting, seeds, move |face, random, _| {
                let system = pulled(face, SystemOptions::default(), 0.0)?;
                let state = folded(&system, face, count as usize, random);
                Ok(Start { system, state, step_s: None, must_unfold: true })
            }));
        }
        for &contrast in contrasts {
            let setting = vec![("slope_ratio", contrast)];
            cases.push(cell(3, face, way, setting, seeds, move |face, _, _| {
                let law = SkinLaw::Table(kneed(contrast));
                let options = SystemOptions { law, pre_tension_kpa: 0.0, ..SystemOptions::default() };
                let system = pulled(face, options, 5.0)?;
                let state = system.at_rest();
                Ok(Start { system, state, step_s: None, must_unfold: false })
            }));
        }
    }
    cases
}

/// What goes on in a cell.
#[derive(Clone, Copy)]
pub(super) enum Way {
    Stepped(Method),
    Rest,
}

impl Way {
    fn all() -> impl Iterator<Item = Self> {
        Method::ALL.into_iter().map(Self::Stepped).chain([Self::Rest])
    }

    fn label(self) -> &'static str {
        match self {
            Self::Stepped(method) => method.label(),
            Self::Rest => "Static equilibrium",
        }
    }
}

/// Where a run begins.
pub(super) struct Start {
    pub(super) system: System,
    pub(super) state: State,
    /// The map's step; the method's own where absent.
    pub(super) step_s: Option<f64>,
    /// Whether turned triangles must have turned back at the end.
    pub(super) must_unfold: bool,
}

fn cell(
    part: usize,
    face: &Arc<FaceModel>,
    way: Way,
    setting: Vec<(&'static str, f64)>,
    seeds: u64,
    make: impl Fn(&FaceModel, &mut Pcg64, u64) -> Result<Start, SystemError> + Send + Sync + 'static,
) -> Case {
    let face = Arc::clone(face);
    let own = setting.clone();
    case(part, way.label(), &own, move || {
        let one = |seed: u64| {
            let mut random = random(seed);
            let row = Run { vertices: face.mesh().len(), seed, ..run(part, way.label(), &setting) };
            match make(&face, &mut random, seed) {
                Ok(start) => went(way, start, &mut random, row),
                Err(e) => row.failing(Some(e.to_string())),
            }
        };
        (1..=seeds).map(one).collect()
    })
}

/// What is random in a run.
pub(super) fn random(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed ^ 0x7374_6162)
}

/// The face under one load along y, over skin that slides on the skull, with its rim fixed.
pub(in crate::study) fn pulled(face: &FaceModel, options: SystemOptions, newton: f64) -> Result<System, SystemError> {
    let (mesh, rest) = (face.mesh(), face.mesh().positions());
    let mut system = System::new(mesh, rest, &rim(mesh, rest), None, options)?;
    let areas = mesh.vertex_areas(rest);
    let normals = mesh.vertex_normals(rest);
    let (mut low, mut high) = (rest[0], rest[0]);
    for p in rest {
        (low, high) = (low.inf(p), high.sup(p));
    }
    // The brow: three quarters of the way up.
    let brow = Point3::new(0.5 * (low.x + high.x), low.y + 0.75 * (high.y - low.y), high.z);
    let pull = |i: usize| {
        let far = (rest[i].xy() - brow.xy()).norm_squared() / (PULLED_MM * PULLED_MM);
        let up = Vector3::y() - normals[i] * normals[i].y;
        up * (areas[i] * (-far).exp())
    };
    let loads: Vec<Vector3<f64>> = (0..rest.len()).map(pull).collect();
    let sum: f64 = loads.iter().map(Vector3::norm).sum();
    system.set_loads(loads.into_iter().map(|f| f * (newton * PULL_N / sum.max(1e-300))).collect())?;
    Ok(system)
}

/// Everything drawn towards the middle to this share, and put back where it may be.
fn pressed(system: &System, share: f64) -> State {
    let mut state = system.at_rest();
    let n = state.positions.len().max(1) as f64;
    let middle = Point3::from(system.rest().iter().map(|p| p.coords).sum::<Vector3<f64>>() / n);
    for x in &mut state.positions {
        *x = middle + (*x - middle) * share;
    }
    system.settle(&mut state);
    state
}

/// Some free vertices thrown to the other side of a neighbour.
fn folded(system: &System, face: &FaceModel, count: usize, random: &mut Pcg64) -> State {
    let mut state = system.at_rest();
    let mut free: Vec<usize> = (0..system.len()).filter(|&i| system.free()[i]).collect();
    for _ in 0..count.min(free.len()) {
        let i = free.swap_remove(random.random_range(0..free.len()));
        let around = face.mesh().neighbours(i);
        if let Some(&to) = around.get(random.random_range(0..around.len().max(1))) {
            let d = system.rest()[to as usize] - system.rest()[i];
            state.positions[i] = system.rest()[i] + d * 1.5;
        }
    }
    system.settle(&mut state);
    state
}

/// A table that is `contrast` times steeper beyond 10 % strain, pressed and stretched alike.
fn kneed(contrast: f64) -> StressStrainCurve {
    let (at, beyond) = (SLOPE_KPA * KNEE, SLOPE_KPA * KNEE * (1.0 + 9.0 * contrast));
    let rows = vec![[-1.0, -beyond], [-KNEE, -at], [0.0, 0.0], [KNEE, at], [1.0, beyond]];
    StressStrainCurve::new(rows, Contraction::Fung).unwrap_or_default()
}

/// Runs it and says how it ended.
pub(super) fn went(way: Way, start: Start, random: &mut Pcg64, row: Run) -> Run {
    let Start { system, mut state, step_s, must_unfold } = start;
    let turned = |x: &[Point3<f64>]| system.doubled_areas(x).iter().filter(|a| **a < 0.0).count();
    let before = turned(&state.positions);
    // A run that was too short for skin to come back says nothing about folds.
    let mut whole = true;
    let (end, failure, row) = match way {
        Way::Rest => {
            let Ok(mut solver) = EquilibriumSolver::new(&system) else {
                return row.failing(Some("out of memory".to_owned()));
            };
            let found = solver.solve(&system, &state.positions);
            let cause = match found.ended {
                Ended::Converged => None,
                Ended::Stalled if found.residual_n < 1e-6 * PULL_N => None,
                ended => Some(ended.label().to_owned()),
            };
            (turned(&found.positions), cause, row.with("newton_steps", found.iterations as f64))
        }
        Way::Stepped(method) => {
            for (v, free) in state.velocities.iter_mut().zip(system.free()) {
                let push = Vector3::from_fn(|_, _| random.random_range(-PUSH_MM_S..=PUSH_MM_S));
                *v = if *free { push } else { Vector3::zeros() };
            }
            system.settle(&mut state);
            let limit = method.limit_s(&system);
            let step_s = step_s.unwrap_or_else(|| limit.map_or(FRAME_S, |l| SHARE_OF_LIMIT * l));
            let most = if must_unfold { 60 * STEPS[1] } else { STEPS[1] };
            let steps = ((LASTS_S / step_s).ceil() as usize).clamp(STEPS[0], most);
            whole = must_unfold || steps as f64 * step_s >= 0.999 * LASTS_S;
            let mut stepper = Stepper::new(method);
            let failed = (0..steps).find_map(|_| stepper.step(&system, &mut state, step_s).err());
            let row = limit.map_or(row.clone(), |l| row.with("limit_ms", 1e3 * l));
            let row = match &failed {
                Some(f) => row.with("failed_at_step", f.step as f64).with("failed_at_vertex", f.vertex as f64),
                None => row,
            };
            (turned(&state.positions), failed.as_ref().map(cause_of), row)
        }
    };
    let row = row.with("turned_before", before as f64).with("turned_after", end as f64).failing(failure);
    let folded = whole && if must_unfold { end > 0 } else { end > before };
    row.failing(folded.then(|| "triangles stay turned over".to_owned()))
}
