//! Maps of the way from marks to forces: noise and the size of the mesh, distance of the camera, share of the points that are marked.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::table::Run;
use super::super::twin::{Twin, TwinSettings, normal_pair};
use super::super::{scene, sheet};
use super::{case, cause_of_error, run};
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::face::FaceModel;
use crate::forces::{ForceSlopes, Skin, SkinModel, SkinSpec, SpringRule};
use crate::pipeline::{self, Workspace};
use crate::project::{Project, Role};
use crate::skin::StressStrainCurve;

const SIDE_MM: f64 = 100.0;
const THICKNESS_MM: f64 = 1.5;
/// Scale of the pictures of the noise map.
const PX_PER_MM: f64 = 4.0;
/// The smooth motion of the noise map: its height and its radius, mm.
const BUMP_MM: [f64; 2] = [3.0, 30.0];
/// An error below this is an answer.
const GOOD: f64 = 0.1;
/// The distance that one who did not measure it takes, mm.
const TAKEN_MM: f64 = 1000.0;
/// A field of fewer vertices is none.
const FEWEST: usize = 10;

/// The cases of the three maps.
pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let quick = options.quick;
    let mut cases = Vec::new();
    let edges: &[f64] = if quick { &[5.0, 7.0, 10.0] } else { &[5.0, 7.0, 8.6, 10.0, 14.0, 20.0] };
    let noises: &[f64] = if quick { &[0.0, 0.25, 0.5] } else { &[0.0, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0] };
    for (method, model) in SKINS {
        for &edge in edges {
            for &noise in noises {
                let setting = [("noise_px", noise), ("edge_mm", edge)];
                let work = move || (1..=seeds).map(|seed| noisy((method, model), edge, noise, seed)).collect();
                cases.push(case(5, method, &setting, work));
            }
        }
    }
    let distances: &[f64] =
        if quick { &[300.0, 1000.0, 5000.0] } else { &[300.0, 400.0, 600.0, 800.0, 1000.0, 1300.0, 2000.0, 5000.0] };
    for (method, depth, taken) in DEPTHS {
        for &distance in distances {
            let face = Arc::clone(&options.face);
            let work = move || (1..=seeds).map(|seed| seen_from(&face, method, depth, taken, distance, seed)).collect();
            cases.push(case(6, method, &[("distance_mm", distance)], work));
        }
    }
    let shares: &[f64] = if quick { &[100.0, 50.0, 10.0] } else { &[100.0, 90.0, 80.0, 60.0, 40.0, 20.0, 10.0, 5.0] };
    for (method, rule) in UNMARKED {
        for &share in shares {
            let face = Arc::clone(&options.face);
            let work = move || (1..=seeds).map(|seed| marked(&face, method, rule, share, seed)).collect();
            cases.push(case(7, method, &[("marked_percent", share)], work));
        }
    }
    cases
}

const SKINS: [(&str, SkinModel); 2] =
    [("Direct F = −KX", SkinModel::Springs), ("Direct, membrane", SkinModel::Membrane)];

const DEPTHS: [(&str, DepthRule, bool); 3] = [
    ("Frozen depth", DepthRule::FixedDepth, false),
    ("Slide on surface", DepthRule::SlideOnSurface, false),
    ("Slide, distance taken for 1 m", DepthRule::SlideOnSurface, true),
];

const UNMARKED: [(&str, UnmarkedRule); 3] = [
    ("Inferred within 12 mm", UnmarkedRule::Inferred { reach_mm: 12.0 }),
    ("Inferred within 25 mm", UnmarkedRule::Inferred { reach_mm: 25.0 }),
    ("Held at rest", UnmarkedRule::Held),
];

/// F = −KX of a smooth motion on a lattice, with and without errors of the marks. Depth is known, so that noise alone is seen.
fn noisy((method, model): (&str, SkinModel), edge_mm: f64, noise_px: f64, seed: u64) -> Run {
    let row = Run { noise_px, seed, ..run(5, method, &[("noise_px", noise_px), ("edge_mm", edge_mm)]) };
    let Ok(mesh) = sheet::lattice(SIDE_MM, edge_mm) else { return row.failing(Some("no such mesh".to_owned())) };
    let curve = StressStrainCurve::default();
    let spec = SkinSpec { model, rule: SpringRule::Strip, thickness_mm: THICKNESS_MM, curve };
    let skin = Skin::new(&mesh, mesh.positions(), &spec);
    let active = vec![true; mesh.len()];
    let [height, radius] = BUMP_MM;
    let bump = |p: &Point3<f64>| p + Vector3::y() * (height * (-p.coords.norm_squared() / (radius * radius)).exp());
    let mut x: Vec<Point3<f64>> = mesh.positions().iter().map(bump).collect();
    let (mut truth, mut found) = (Vec::new(), Vec::new());
    skin.muscle_forces(&x, &active, &mut truth);
    let mut random = Pcg64::seed_from_u64(seed ^ 0x6e6f_6973);
    for p in &mut x {
        let [a, b] = normal_pair(&mut random);
        *p += Vector3::new(a, b, 0.0) * (noise_px / PX_PER_MM);
    }
    skin.muscle_forces(&x, &active, &mut found);
    let border = mesh.on_border();
    let inner = || (0..mesh.len()).filter(|&i| !border[i]);
    let squares = |f: &dyn Fn(usize) -> f64| inner().map(f).sum::<f64>();
    let all = squares(&|i| truth[i].norm_squared());
    let error = (squares(&|i| (found[i] - truth[i]).norm_squared()) / all).sqrt();
    // The noise at which the error that the linear law of the skin at rest foretells is a tenth of the force.
    let slopes = skin.slopes(mesh.positions(), &active);
    let per_mm = squares(&|i| error_per_mm(&slopes, i).powi(2)).sqrt();
    let limit_px = GOOD * all.sqrt() / per_mm * PX_PER_MM;
    Run { vertices: mesh.len(), ..row }.erring(error).failing(cause_of_error(error)).with("limit_px", limit_px)
}

/// Standard error of the force on a vertex for an error of 1 mm along x and along y of every vertex, N: of δF_i = Σ_j B_ij (δx_i − δx_j) at rest.
///
/// In a regular lattice of springs it is √24 k (6 springs of stiffness k, each with the error of its own and the common end).
fn error_per_mm(slopes: &ForceSlopes, vertex: usize) -> f64 {
    let along = |block: &Matrix3<f64>| block.fixed_columns::<2>(0).norm_squared();
    let (own, others) = slopes
        .at(vertex)
        .fold((Matrix3::zeros(), 0.0), |(own, others), (_, block)| (own + block, others + along(&block)));
    (along(&own) + others).sqrt()
}

/// A person that raises the brows, and the project with marks at the truth.
fn twin(face: &FaceModel, distance_mm: f64, seed: u64) -> Result<(Twin, FaceModel, Project), String> {
    let settings = TwinSettings { seed, distance_mm, ..TwinSettings::default() };
    let person = scene::person(face, seed, distance_mm).map_err(|e| e.to_string())?;
    let twin = Twin::generate(&person, &settings).map_err(|e| e.to_string())?;
    let project = scene::project(&twin, &person, scene::unseen_frames(settings.size_px), 0.5);
    Ok((twin, person, project))
}

/// Forces of a project against the truth of its twin.
fn judged(face: &FaceModel, twin: &Twin, person: &FaceModel, project: &Project, row: Run) -> Run {
    let size = [twin.settings.size_px; 2];
    let outcome = pipeline::solve(project, face, size, &mut Workspace::default());
    let truth = scene::true_forces(twin, person, &project.settings);
    let (count, error) = scene::force_error(person, &outcome, &truth, true);
    let row = Run { vertices: face.mesh().len(), ..row }.with("judged_vertices", count as f64);
    if count < FEWEST {
        return row.failing(Some("too few vertices are known".to_owned()));
    }
    row.erring(error).failing(cause_of_error(error))
}

fn seen_from(face: &FaceModel, method: &str, depth: DepthRule, taken: bool, distance_mm: f64, seed: u64) -> Run {
    let row = Run { seed, ..run(6, method, &[("distance_mm", distance_mm)]) };
    match twin(face, distance_mm, seed) {
        Err(e) => row.failing(Some(e)),
        Ok((twin, person, mut project)) => {
            project.settings.depth = depth;
            if taken {
                project.camera.distance_mm = TAKEN_MM;
            }
            judged(face, &twin, &person, &project, row)
        }
    }
}

fn marked(face: &FaceModel, method: &str, rule: UnmarkedRule, percent: f64, seed: u64) -> Run {
    let row = Run { seed, ..run(7, method, &[("marked_percent", percent)]) };
    match twin(face, TwinSettings::default().distance_mm, seed) {
        Err(e) => row.failing(Some(e)),
        Ok((twin, person, mut project)) => {
            project.settings.unmarked = rule;
            let mut skin: Vec<u32> =
                project.features.iter().filter(|(_, f)| f.role == Role::Skin).map(|(v, _)| *v).collect();
            skin.shuffle(&mut Pcg64::seed_from_u64(seed ^ 0x6d61_726b));
            let kept = (skin.len() as f64 * percent / 100.0).round() as usize;
            for v in skin.iter().skip(kept) {
                project.features.remove(v);
            }
            judged(face, &twin, &person, &project, row)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each force of a lattice of springs errs by √24 k σ, k = E h √3/2 of the skin at rest.
    #[test]
    fn the_error_of_a_lattice_of_springs_is_that_of_six_springs() {
        let mesh = sheet::lattice(SIDE_MM, 10.0).unwrap();
        let curve = StressStrainCurve::default();
        let k = curve.slope_kpa(0.0) * 1e-3 * THICKNESS_MM * 3.0_f64.sqrt() / 2.0;
        let spec = SkinSpec { model: SkinModel::Springs, rule: SpringRule::Strip, thickness_mm: THICKNESS_MM, curve };
        let skin = Skin::new(&mesh, mesh.positions(), &spec);
        let slopes = skin.slopes(mesh.positions(), &vec![true; mesh.len()]);
        let middle = (0..mesh.len()).min_by_key(|&i| mesh.positions()[i].coords.norm() as u64).unwrap();
        assert!((error_per_mm(&slopes, middle) / (24.0_f64.sqrt() * k) - 1.0).abs() < 1e-6);
    }
}
