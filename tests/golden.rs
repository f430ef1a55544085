//! The whole chain against golden files, which `tests/golden/make.py` works out a second time from the same projects by other means.

#![allow(clippy::unwrap_used, reason = "a test that cannot read its own files should stop there")]

use std::fs;
use std::path::{Path, PathBuf};

use frontalis::export::csv;
use frontalis::face::FaceModel;
use frontalis::pipeline::{self, Outcome, Workspace};
use frontalis::project::{FaceSource, Project, file, paths};

/// Agreement of positions, strains, forces, scale and head motion, relative.
const EXACT: f64 = 1e-9;
/// Agreement of standard errors: the difference quotients of the script at a step of 0.001 px.
const QUOTIENTS: f64 = 1e-6;
/// The same where still points tell the head's motion: the program's slopes of the motion are those of Gauss and Newton, without
/// the curvature times the residual, which for the 0.4 px left in these scenes is up to 0.9 % of an error.
const WITH_HEAD: f64 = 0.01;

/// Size of the patch.
const SIZE_MM: f64 = 100.0;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// The fields of every row of a table below its header.
fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// A case solved by the program, as `frontalis solve` would.
struct Case {
    name: &'static str,
    project: Project,
    face: FaceModel,
    outcome: Outcome,
}

impl Case {
    fn solve(name: &'static str) -> Self {
        let path = golden(&format!("{name}.frontalis.json"));
        let project = file::load(&path).unwrap();
        let FaceSource::File { path: face, .. } = &project.face else { panic!("{name} names no face file") };
        let face = frontalis::face::file::read(&paths::resolve_text(&path, face)).unwrap();
        file::check_bindings(&path, &project, &face).unwrap();
        let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        Self { name, project, face, outcome }
    }

    fn table(&self, kind: &str) -> Vec<Vec<String>> {
        rows(&fs::read_to_string(golden(&format!("{}.{kind}.csv", self.name))).unwrap())
    }
}

const CASES: [&str; 5] = ["held_uniform", "slide_inferred_head", "fixed_depth_head", "pose_radial", "defaults"];

/// Fails where two numbers differ by more than `tolerance` of themselves or, near zero, of a thousandth of `scale`.
fn agree(found: f64, golden: f64, tolerance: f64, scale: f64, what: &str) {
    let within = tolerance * golden.abs().max(1e-3 * scale);
    let same = (found.is_nan() && golden.is_nan()) || (found - golden).abs() <= within;
    assert!(same, "{what}: the program has {found:e}, the golden file {golden:e}");
}

fn number(field: &str) -> f64 {
    field.parse().unwrap()
}

#[test]
fn positions_forces_and_states_are_those_of_the_golden_files() {
    for case in CASES.map(Case::solve) {
        let found = rows(&csv::forces(&case.outcome));
        let golden = case.table("vertices");
        assert_eq!(found.len(), golden.len());
        let peak = golden.iter().map(|r| number(&r[10])).filter(|f| f.is_finite()).fold(0.0, f64::max);
        assert!(peak > 0.0);
        for (v, (f, g)) in found.iter().zip(&golden).enumerate() {
            assert_eq!(f[12], g[12], "{}: state of vertex {v}", case.name);
            for k in 1..11 {
                let scale = if k < 7 { SIZE_MM } else { peak };
                agree(number(&f[k]), number(&g[k]), EXACT, scale, &format!("{}: vertex {v}, column {k}", case.name));
            }
            if g[12] != "unmeasured" {
                let field = &case.outcome.field;
                for (k, value) in [(13, field.normal[v]), (14, field.tangential[v]), (15, field.depth_change[v])] {
                    agree(value, number(&g[k]), EXACT, peak, &format!("{}: vertex {v}, column {k}", case.name));
                }
            }
        }
    }
}

#[test]
fn strains_and_tensions_are_those_of_the_golden_files() {
    for case in CASES.map(Case::solve) {
        let settings = &case.project.settings;
        let (mesh, outcome) = (case.face.mesh(), &case.outcome);
        let springs =
            frontalis::forces::Springs::new(mesh, &outcome.first, settings.springs, settings.skin_thickness_mm);
        let known: Vec<usize> = (0..mesh.edges().len()).filter(|&e| outcome.field.strain[e].is_some()).collect();
        let golden = case.table("edges");
        assert_eq!(known.len(), golden.len(), "{}", case.name);
        let largest = golden.iter().map(|r| number(&r[3]).abs()).fold(0.0, f64::max);
        for (&e, g) in known.iter().zip(&golden) {
            let [a, b] = mesh.edges()[e];
            assert_eq!([a.to_string(), b.to_string()], [g[0].clone(), g[1].clone()]);
            let what = format!("{}: spring {a}-{b}", case.name);
            agree(outcome.field.strain[e].unwrap(), number(&g[2]), EXACT, 1.0, &what);
            let length = (outcome.last[a as usize] - outcome.last[b as usize]).norm();
            agree(springs.tension(e, &settings.skin, length), number(&g[3]), EXACT, largest, &what);
        }
    }
}

#[test]
fn scale_fit_and_head_motion_are_those_of_the_golden_files() {
    let summary = rows(&fs::read_to_string(golden("summary.csv")).unwrap());
    for case in CASES.map(Case::solve) {
        let (o, motion) = (&case.outcome, &case.outcome.head.motion);
        let (turn, shift) = (motion.rotation.scaled_axis(), motion.translation_mm);
        let mut compared = 0;
        for row in summary.iter().filter(|row| row[0] == case.name) {
            let found = match row[1].as_str() {
                "px_per_mm" => o.camera.px_per_mm,
                "rms_before_px" => o.fit.rms_before_px,
                "noise_floor_px" => o.head.noise_floor_px.unwrap(),
                "scale_x" => o.fit.scale[0],
                "scale_y" => o.fit.scale[1],
                "scale_z" => o.fit.scale[2],
                "rotation_x_rad" => turn.x,
                "rotation_y_rad" => turn.y,
                "rotation_z_rad" => turn.z,
                "translation_x_mm" => shift.x,
                "translation_y_mm" => shift.y,
                "translation_z_mm" => shift.z,
                other => panic!("the golden files know a quantity {other} that this test does not"),
            };
            agree(found, number(&row[2]), EXACT, 1.0, &format!("{}: {}", case.name, row[1]));
            compared += 1;
        }
        assert!(compared >= 11, "{}: {compared} quantities", case.name);
    }
}

/// The script disturbs every mark and goes through the whole chain again; the program multiplies slopes.
#[test]
fn standard_errors_are_those_of_the_golden_files() {
    for case in CASES.map(Case::solve) {
        let tolerance = if case.outcome.head.still_points > 0 { WITH_HEAD } else { QUOTIENTS };
        for (v, g) in case.table("vertices").iter().enumerate().filter(|(_, g)| g[12] != "unmeasured") {
            let what = format!("{}: standard error of vertex {v}", case.name);
            agree(case.outcome.field.sigma[v], number(&g[11]), tolerance, 0.0, &what);
        }
    }
}
