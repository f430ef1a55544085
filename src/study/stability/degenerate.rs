//! The map of degenerate triangles: one triangle of a sheet is made flatter and flatter, and every stage is asked for an answer.

use nalgebra::{Matrix3x2, Point3, Vector3};

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::sheet;
use super::super::table::Run;
use super::{case, cause_of, run};
use crate::customize::nnwa::{self, Anchor};
use crate::displacement::fill_in;
use crate::face::Mesh;
use crate::forces::{Influence, MarkInfluence, Skin, SkinModel, SkinSpec, SpringRule, standard_errors};
use crate::simulate::{Ended, Equilibrium, EquilibriumSolver, Method, SkinAtRest, Stepper, System, SystemOptions};
use crate::skin::StressStrainCurve;

/// The part of this map.
const PART: usize = 4;
/// The sheet and its edges, mm.
const SIDE_MM: f64 = 60.0;
const EDGE_MM: f64 = 8.0;
/// Steps of a run and their length, s: half of what the regular sheet allows symplectic Euler, and a frame of a screen.
const STEPS: usize = 60;
const SHORT_S: f64 = 5e-4;
const FRAME_S: f64 = 1.0 / 60.0;
const THICKNESS_MM: f64 = 1.5;

/// A stage that is asked.
#[derive(Clone, Copy)]
enum Stage {
    Forces(SkinModel),
    Errors(SkinModel),
    Morph,
    FillIn,
    Rest,
    Settled,
    Stepped(Method, f64),
}

impl Stage {
    const ALL: [Self; 11] = [
        Self::Forces(SkinModel::Springs),
        Self::Forces(SkinModel::Membrane),
        Self::Errors(SkinModel::Springs),
        Self::Errors(SkinModel::Membrane),
        Self::Morph,
        Self::FillIn,
        Self::Rest,
        Self::Settled,
        Self::Stepped(Method::ImplicitEuler, FRAME_S),
        Self::Stepped(Method::VertexBlockDescent, FRAME_S),
        Self::Stepped(Method::SymplecticEuler, SHORT_S),
    ];

    fn label(self) -> &'static str {
        match self {
            Self::Forces(SkinModel::Springs) => "F = −KX",
            Self::Forces(SkinModel::Membrane) => "F = −KX, membrane",
            Self::Errors(SkinModel::Springs) => "Standard errors",
            Self::Errors(SkinModel::Membrane) => "Standard errors, membrane",
            Self::Morph => "NNWA",
            Self::FillIn => "Harmonic inference",
            Self::Rest => "Static equilibrium",
            Self::Settled => "Static equilibrium, membrane",
            Self::Stepped(method, _) => method.label(),
        }
    }
}

/// The cases: flatness from that of a regular triangle down to none.
pub(super) fn cases(options: &Options) -> Vec<Case> {
    let flat: &[f64] = if options.quick { &[1.0, 1e-6, 0.0] } else { &[1.0, 0.1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 0.0] };
    let mut cases = Vec::new();
    for stage in Stage::ALL {
        for &height in flat {
            let setting = [("height_share", height)];
            cases.push(case(PART, stage.label(), &setting, move || vec![answer(stage, height)]));
        }
    }
    cases
}

/// A lattice with one inner vertex moved into the line between two neighbours, up to this share of its distance from it.
fn flattened(height: f64) -> Option<(Mesh, usize)> {
    let mesh = sheet::lattice(SIDE_MM, EDGE_MM).ok()?;
    let middle = (0..mesh.len()).min_by(|&a, &b| {
        let far = |i: usize| mesh.positions()[i].coords.norm();
        far(a).total_cmp(&far(b))
    })?;
    let t = mesh.triangles().iter().find(|t| t.contains(&(middle as u32)))?;
    let other: Vec<Point3<f64>> =
        t.iter().filter(|&&v| v as usize != middle).map(|&v| mesh.positions()[v as usize]).collect();
    let foot = nalgebra::center(other.first()?, other.get(1)?);
    let mut positions = mesh.positions().to_vec();
    positions[middle] = foot + (positions[middle] - foot) * height;
    Some((mesh.with_positions(positions).ok()?, middle))
}

fn answer(stage: Stage, height: f64) -> Run {
    let row = Run { seed: 1, ..run(PART, stage.label(), &[("height_share", height)]) };
    let Some((mesh, middle)) = flattened(height) else {
        return row.failing(Some("no such mesh".to_owned()));
    };
    let row = Run { vertices: mesh.len(), ..row };
    // A motion of which every part is known: 5 % longer along x, 3 % shorter along y.
    let moved: Vec<Point3<f64>> = mesh.positions().iter().map(|p| Point3::new(1.05 * p.x, 0.97 * p.y, p.z)).collect();
    let active = vec![true; mesh.len()];
    let skin = |model| Skin::new(&mesh, mesh.positions(), &spec(model));
    let numbers = |all: &mut dyn Iterator<Item = f64>| {
        let worst = all.fold(0.0, |w: f64, v| if v.is_finite() { w.max(v.abs()) } else { f64::INFINITY });
        (!worst.is_finite()).then(|| "no numbers".to_owned())
    };
    match stage {
        Stage::Forces(model) => {
            let mut forces = Vec::new();
            skin(model).muscle_forces(&moved, &active, &mut forces);
            let cause = numbers(&mut forces.iter().flat_map(|f| f.iter().copied()));
            let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
            row.failing(cause).with("largest_N", largest)
        }
        Stage::Errors(model) => {
            let influence = MarkInfluence {
                weights: Influence::from_rows((0..mesh.len() as u32).map(|i| [(i, 1.0)])),
                slope_mm_per_px: vec![Matrix3x2::identity() * 0.25; mesh.len()],
                sigma_px: vec![0.5; mesh.len()],
                common: None,
            };
            let mut sigma = Vec::new();
            standard_errors(&skin(model).slopes(&moved, &active), &influence, &mut sigma);
            let largest = sigma.iter().copied().fold(0.0, f64::max);
            row.failing(numbers(&mut sigma.iter().copied())).with("largest_N", largest)
        }
        Stage::Morph => {
            let anchors: Vec<Anchor> = [0, middle, mesh.len() - 1]
                .map(|i| Anchor { at: mesh.positions()[i], shift: Vector3::new(1.0, 2.0, 0.0) })
                .to_vec();
            let mut x = mesh.positions().to_vec();
            nnwa::morph(&mut x, &anchors, 2.0, None);
            row.failing(numbers(&mut x.iter().flat_map(|p| p.coords.iter().copied().collect::<Vec<_>>())))
        }
        Stage::FillIn => {
            let unknown: Vec<bool> =
                (0..mesh.len()).map(|i| i == middle || mesh.neighbours(middle).contains(&(i as u32))).collect();
            let source: Vec<bool> = unknown.iter().map(|u| !u).collect();
            let weights = fill_in::harmonic_weights(&mesh, mesh.positions(), &unknown, &source, None);
            let cause = numbers(&mut weights.rows.iter().flatten().map(|w| w.1));
            // Weights of a vertex are shares of one.
            let off =
                weights.rows.iter().filter(|r| !r.is_empty()).map(|r| (r.iter().map(|w| w.1).sum::<f64>() - 1.0).abs());
            let off = off.fold(0.0, f64::max);
            row.failing(cause).failing((off > 1e-6).then(|| "weights do not sum to one".to_owned()))
        }
        Stage::Settled => settled(&mesh, row),
        Stage::Rest | Stage::Stepped(..) => moving(stage, &mesh, row),
    }
}

fn spec(model: SkinModel) -> SkinSpec {
    SkinSpec { model, rule: SpringRule::Strip, thickness_mm: THICKNESS_MM, curve: StressStrainCurve::default() }
}

/// A pull on a place of the sheet, N.
fn pull(p: &Point3<f64>) -> Vector3<f64> {
    Vector3::x() * (2e-3 * (-p.coords.norm_squared() / 400.0).exp())
}

fn settled(mesh: &Mesh, row: Run) -> Run {
    let (rest, held) = (mesh.positions(), mesh.on_border());
    let found = SkinAtRest::new(mesh, rest, &held, None, &spec(SkinModel::Membrane))
        .and_then(|mut skin| Ok(skin.solve(rest.iter().map(pull).collect(), rest)?));
    match found {
        Err(e) => row.failing(Some(e.to_string())),
        Ok(found) => ended(&found, row),
    }
}

fn ended(found: &Equilibrium, row: Run) -> Run {
    let well = found.ended == Ended::Converged || found.residual_n < 1e-9;
    row.failing((!well).then(|| found.ended.label().to_owned())).with("newton_steps", found.iterations as f64)
}

fn moving(stage: Stage, mesh: &Mesh, row: Run) -> Run {
    let fixed = mesh.on_border();
    let mut system = match System::new(mesh, mesh.positions(), &fixed, None, SystemOptions::default()) {
        Ok(system) => system,
        Err(e) => return row.failing(Some(e.to_string())),
    };
    if let Err(e) = system.set_loads(mesh.positions().iter().map(pull).collect()) {
        return row.failing(Some(e.to_string()));
    }
    if let Stage::Stepped(method, step_s) = stage {
        let mut state = system.at_rest();
        let mut stepper = Stepper::new(method);
        let failed = (0..STEPS).find_map(|_| stepper.step(&system, &mut state, step_s).err());
        let row = method.limit_s(&system).map_or(row.clone(), |l| row.with("limit_ms", 1e3 * l));
        return row.failing(failed.as_ref().map(cause_of));
    }
    let Ok(mut solver) = EquilibriumSolver::new(&system) else {
        return row.failing(Some("out of memory".to_owned()));
    };
    ended(&solver.solve(&system, mesh.positions()), row)
}
