//! `report.json`: what was solved, with what, how well, and what to beware of. Fields and units: `docs/file-formats.md`.

use serde::Serialize;

use crate::camera::Scale;
use crate::displacement::VertexState;
use crate::face::FaceModel;
use crate::pipeline::{MuscleForces, Outcome, Peak};
use crate::project::{CameraSettings, FaceSource, FramePair, Project, Settings};

/// What the caller knows and the outcome does not.
#[derive(Clone, Debug, Default)]
pub struct Circumstances {
    /// The command line that gives the same files again.
    pub command: String,
    /// Stages and how long each took, ms.
    pub timings_ms: Vec<(&'static str, f64)>,
    /// Sentences beside the outcome's own warnings: a frame that has changed.
    pub remarks: Vec<String>,
}

/// Where a report comes from: its first fields.
#[derive(Serialize)]
pub(super) struct Origin<'a> {
    program: &'static str,
    version: &'static str,
    command: &'a str,
    project: &'a str,
}

impl<'a> Origin<'a> {
    pub(super) fn of(project: &'a Project, circumstances: &'a Circumstances) -> Self {
        let (program, version) = (env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"));
        Self { program, version, command: &circumstances.command, project: &project.name }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: Origin<'a>,
    face: Face<'a>,
    frames: &'a FramePair,
    vertices_by_state: ByState,
    landmarks: Landmarks<'a>,
    scale: ScaleReport<'a>,
    force_unit: &'static str,
    head_motion: Head,
    eye_midpoint_mm: Option<[f64; 3]>,
    peak: Option<PeakReport>,
    peak_in_words: String,
    median_force_over_sigma: Option<f64>,
    smoothing: Option<SmoothingReport>,
    muscles: Option<MusclesReport<'a>>,
    self_check: SelfCheck,
    outside_skin_table: Vec<usize>,
    folded_triangles: Folded<'a>,
    warnings: Vec<String>,
    settings: &'a Settings,
    camera: &'a CameraSettings,
    timings_ms: std::collections::BTreeMap<&'static str, f64>,
}

#[derive(Serialize)]
struct Face<'a> {
    name: &'a str,
    source: &'a FaceSource,
    vertices: usize,
    triangles: usize,
}

#[derive(Serialize)]
struct SmoothingReport {
    distance_from_marks_sigma: f64,
    freedoms: f64,
    marks: usize,
}

#[derive(Serialize)]
struct ByState {
    measured: usize,
    inferred: usize,
    fixed: usize,
    unmeasured: usize,
    border: usize,
}

#[derive(Serialize)]
struct Landmarks<'a> {
    placed: usize,
    of: usize,
    rms_before_px: f64,
    rms_after_px: f64,
    residuals_before_px: std::collections::BTreeMap<&'a str, f64>,
    scale_xyz: [f64; 3],
}

#[derive(Serialize)]
struct ScaleReport<'a> {
    measured: bool,
    px_per_mm: f64,
    given: &'a Scale,
}

#[derive(Serialize)]
struct Head {
    removed: bool,
    still_points: usize,
    rotation_deg: f64,
    rotation_xyz_deg: [f64; 3],
    translation_mm: [f64; 3],
    residuals_px: Vec<f64>,
    noise_floor_px: Option<f64>,
}

#[derive(Serialize)]
struct PeakReport {
    vertex: usize,
    force: f64,
    sigma: f64,
    at_mm: [f64; 3],
    state: &'static str,
    border: bool,
}

/// The muscles whose forces the field is.
#[derive(Serialize)]
struct MusclesReport<'a> {
    law: &'static str,
    share_of_motion_explained: f64,
    left_px: f64,
    left_over_stated_error: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    besides: Option<BesidesReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    jaw: Option<JawReport>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    shape: Vec<ShapeReport>,
    pulling: Vec<Pulling<'a>>,
}

/// A parameter of the law's shape.
#[derive(Serialize)]
struct ShapeReport {
    parameter: &'static str,
    value: f64,
    low: f64,
    high: f64,
    usual: f64,
}

/// How far the jaw is open.
#[derive(Serialize)]
struct JawReport {
    deg: f64,
    low: f64,
    high: f64,
}

/// What pulls besides them.
#[derive(Serialize)]
struct BesidesReport {
    spread_over_traction: f64,
    sum_n: f64,
    share_of_all: f64,
}

#[derive(Serialize)]
struct Pulling<'a> {
    muscle: &'a str,
    activation: f64,
    low: f64,
    high: f64,
    strength_n: f64,
    moves_rms_px: f64,
}

#[derive(Serialize)]
struct SelfCheck {
    sum_of_internal_forces: [f64; 3],
    ratio_to_largest_force: f64,
}

#[derive(Serialize)]
struct Folded<'a> {
    first_frame: &'a [u32],
    last_frame: &'a [u32],
}

fn muscles(found: &MuscleForces) -> MusclesReport<'_> {
    let pulling = found.pulling.iter().map(|p| Pulling {
        muscle: &p.id,
        activation: p.activation,
        low: p.between[0],
        high: p.between[1],
        strength_n: p.strength_n,
        moves_rms_px: p.moves_px,
    });
    let shape = found.shape.iter().map(|p| ShapeReport {
        parameter: p.name,
        value: p.value,
        low: p.between[0],
        high: p.between[1],
        usual: p.usual,
    });
    MusclesReport {
        law: found.law.name(),
        share_of_motion_explained: found.explained,
        left_px: found.left_px,
        left_over_stated_error: found.misfit,
        besides: found.besides.map(|b| BesidesReport {
            spread_over_traction: b.share,
            sum_n: b.newton,
            share_of_all: b.of_all,
        }),
        jaw: found.jaw.map(|j| JawReport { deg: j.deg, low: j.between[0], high: j.between[1] }),
        shape: shape.collect(),
        pulling: pulling.collect(),
    }
}

/// The text of `report.json`.
pub fn report(project: &Project, face: &FaceModel, outcome: &Outcome, circumstances: &Circumstances) -> String {
    let count = |state| outcome.states.iter().filter(|s| **s == state).count();
    let residuals = outcome.fit.residuals_before_px.iter().map(|(id, r)| (id.as_str(), *r)).collect();
    let report = Report {
        origin: Origin::of(project, circumstances),
        face: Face {
            name: face.name(),
            source: &project.face,
            vertices: face.mesh().len(),
            triangles: face.mesh().triangles().len(),
        },
        frames: &project.frames,
        vertices_by_state: ByState {
            measured: count(VertexState::Measured),
            inferred: count(VertexState::Inferred),
            fixed: count(VertexState::Fixed),
            unmeasured: count(VertexState::Unmeasured),
            border: outcome.border.iter().filter(|b| **b).count(),
        },
        landmarks: Landmarks {
            placed: outcome.fit.placed,
            of: outcome.fit.of,
            rms_before_px: outcome.fit.rms_before_px,
            rms_after_px: outcome.fit.rms_after_px,
            residuals_before_px: residuals,
            scale_xyz: outcome.fit.scale,
        },
        scale: ScaleReport {
            measured: outcome.scale_measured,
            px_per_mm: outcome.camera.px_per_mm,
            given: &project.scale,
        },
        force_unit: outcome.unit(),
        head_motion: head(outcome, project.settings.remove_head_motion),
        eye_midpoint_mm: outcome.eye_midpoint(face).map(|p| p.coords.into()),
        peak: peak(outcome),
        peak_in_words: outcome.peak().in_words(outcome.unit()),
        median_force_over_sigma: outcome.median_over_error(),
        smoothing: outcome.smoothing.as_ref().map(|s| SmoothingReport {
            distance_from_marks_sigma: s.weighed.residual,
            freedoms: s.weighed.freedoms,
            marks: s.marks,
        }),
        muscles: outcome.muscles.as_ref().map(muscles),
        self_check: self_check(outcome),
        outside_skin_table: places(&outcome.field.outside_table),
        folded_triangles: Folded { first_frame: &outcome.fit.folded, last_frame: &outcome.field.folded },
        warnings: outcome.warnings.iter().map(ToString::to_string).chain(circumstances.remarks.clone()).collect(),
        settings: &project.settings,
        camera: &project.camera,
        timings_ms: circumstances.timings_ms.iter().copied().collect(),
    };
    // Keys are strings and numbers that are not finite become null: nothing here can fail to be written.
    serde_json::to_string_pretty(&report).unwrap_or_default() + "\n"
}

fn head(outcome: &Outcome, wanted: bool) -> Head {
    let head = &outcome.head;
    Head {
        removed: wanted && head.still_points > 0,
        still_points: head.still_points,
        rotation_deg: head.motion.rotation.angle().to_degrees(),
        rotation_xyz_deg: head.motion.rotation.scaled_axis().map(f64::to_degrees).into(),
        translation_mm: head.motion.translation_mm.into(),
        residuals_px: head.residuals_px.clone(),
        noise_floor_px: head.noise_floor_px,
    }
}

fn peak(outcome: &Outcome) -> Option<PeakReport> {
    let Peak::Stands { vertex, force, sigma } = outcome.peak() else { return None };
    Some(PeakReport {
        vertex,
        force,
        sigma,
        at_mm: outcome.first.get(vertex)?.coords.into(),
        state: outcome.states.get(vertex)?.word(),
        border: *outcome.border.get(vertex)?,
    })
}

/// The internal forces of springs sum to zero; what is left is rounding, or something is wrong.
fn self_check(outcome: &Outcome) -> SelfCheck {
    let largest = outcome.field.largest(&outcome.states).map_or(0.0, |(_, force)| force);
    let sum = outcome.field.internal_sum;
    SelfCheck {
        sum_of_internal_forces: sum.into(),
        ratio_to_largest_force: if largest > 0.0 { sum.norm() / largest } else { 0.0 },
    }
}

fn places(flags: &[bool]) -> Vec<usize> {
    flags.iter().enumerate().filter(|(_, set)| **set).map(|(v, _)| v).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;
    use crate::pipeline::Warning;

    #[test]
    fn the_report_says_what_was_found() {
        let (project, face, mut outcome) = scene_of_one_triangle();
        outcome.field.internal_sum = nalgebra::Vector3::new(0.0, 0.0, 5e-12);
        outcome.field.outside_table[1] = true;
        outcome.warnings.push(Warning::RelativeScale);
        let circumstances = Circumstances {
            command: "frontalis solve p --out d".into(),
            timings_ms: vec![("solve", 0.5)],
            remarks: vec!["first.png: there is no such file".into()],
        };
        let r: serde_json::Value = serde_json::from_str(&report(&project, &face, &outcome, &circumstances)).unwrap();
        assert_eq!(r["vertices_by_state"]["measured"], 1);
        assert_eq!(r["vertices_by_state"]["unmeasured"], 1);
        assert_eq!(r["force_unit"], "N");
        // The only vertex that nothing speaks against is inferred; with none believed it may speak, and 5 > 2 × 0.25.
        assert_eq!(r["peak"]["force"], 5.0);
        assert!(r["peak_in_words"].as_str().unwrap().starts_with("largest force 5.0"), "{}", r["peak_in_words"]);
        // 5e-12 over the largest force, 5.
        assert!((r["self_check"]["ratio_to_largest_force"].as_f64().unwrap() - 1e-12).abs() < 1e-24);
        assert_eq!(r["outside_skin_table"], serde_json::json!([1]));
        assert_eq!(r["warnings"].as_array().unwrap().len(), 2);
        assert_eq!(r["frames"]["last"]["sha256"].as_str().unwrap().len(), 64);
        assert_eq!(r["command"], "frontalis solve p --out d");
    }
}
