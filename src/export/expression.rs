//! A played expression as files: tables of places and energies, a mesh, a picture, and a report of how it went.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use image::RgbImage;
use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::{face_paint, obj};
use crate::draw::ColourMap;
use crate::draw::robust_range::robust_largest;
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::draw::svg::SvgError;
use crate::expression::player::Pace;
use crate::expression::{Expression, Player, Sample, Setup, Shown};
use crate::face::FaceModel;
use crate::simulate::creases::{creases, in_words};
use crate::simulate::{Equilibrium, Failure};

/// Header of [`positions`].
pub const POSITIONS_HEADER: &str = "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,f_N";

/// Header of [`energy`].
pub const ENERGY_HEADER: &str = "time_s,kinetic_mJ,elastic_mJ,loads_mJ";

/// `positions.csv`: one row a vertex; 0 is at rest, 1 at the end; `f_N` is the length of the muscles' pull on it.
pub fn positions(rest: &[Point3<f64>], last: &[Point3<f64>], loads: &[Vector3<f64>]) -> String {
    let mut text = format!("{POSITIONS_HEADER}\n");
    for (v, ((x0, x1), f)) in rest.iter().zip(last).zip(loads).enumerate() {
        let _ = writeln!(text, "{v},{},{},{},{},{},{},{}", x0.x, x0.y, x0.z, x1.x, x1.y, x1.z, f.norm());
    }
    text
}

/// `energy.csv`: one row a step, the first at rest.
pub fn energy<'a>(samples: impl Iterator<Item = &'a Sample>) -> String {
    let mut text = format!("{ENERGY_HEADER}\n");
    for s in samples {
        // Adding 0 takes the sign from a zero.
        let [kinetic, elastic, loads] = [s.energy.kinetic, s.energy.elastic, s.energy.loads].map(|e| e + 0.0);
        let _ = writeln!(text, "{},{kinetic},{elastic},{loads}", s.time_s);
    }
    text
}

/// A moment of the play as a Wavefront OBJ mesh, mm.
pub fn mesh(face: &FaceModel, expression: &str, time_s: f64, positions: &[Point3<f64>]) -> String {
    let mut text = format!("# {}, {}, {time_s:.4} s\n", obj::one_line(face.name()), obj::one_line(expression));
    obj::surface(&mut text, positions, face.mesh().triangles());
    text
}

/// How a moment of the play is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOptions {
    /// The value on the skin; without one brows and lips are painted, on a face without their landmarks nothing.
    pub shown: Option<Shown>,
    /// The value at the end of the colours; the largest, rounded up, without one.
    pub most: Option<f64>,
    /// Turns about the vertical axis, rad, one a view.
    pub turns: Vec<f64>,
    /// Heading.
    pub title: String,
    /// Size of a view, px.
    pub view_px: [u32; 2],
    /// Points that find place in every view; the surface's own where there are none.
    pub within: Vec<Point3<f64>>,
}

/// The value at the end of the colours that holds these values.
pub fn end_of_colours(values: &[f64]) -> f64 {
    let most = robust_largest(values.iter().copied());
    if most > 1e-6 { crate::draw::robust_range::round_up(most) } else { 1.0 }
}

/// Draws a moment of the play.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted.
pub fn picture(
    face: &FaceModel,
    rest: &[Point3<f64>],
    positions: &[Point3<f64>],
    loads: &[Vector3<f64>],
    options: &PictureOptions,
) -> Result<RgbImage, SvgError> {
    let [view_width_px, height_px] = options.view_px;
    let mut surface = SurfaceOptions {
        view_width_px,
        height_px,
        turns: options.turns.clone(),
        wireframe: false,
        title: options.title.clone(),
        fills: face_paint::fills(face, rest, positions),
        within: options.within.clone(),
        ..SurfaceOptions::default()
    };
    if options.shown.is_none() {
        surface.paint = face_paint::paint(face, rest);
    }
    let values = options.shown.map(|shown| {
        let values = shown.values(face.mesh(), rest, positions, loads);
        let high = options.most.unwrap_or_else(|| end_of_colours(&values));
        surface.range = [if shown.is_signed() { -high } else { 0.0 }, high];
        surface.colour_map = if shown.is_signed() { ColourMap::CoolWarm } else { ColourMap::Viridis };
        surface.quantity = format!("{}, {}", shown.label(), shown.unit());
        values.into_iter().map(|v| v.is_finite().then_some(v)).collect::<Vec<_>>()
    });
    surface_picture::render(positions, face.mesh().triangles(), values.as_deref(), &surface)
}

/// What a report is made of.
pub struct Run<'a> {
    /// The line for the shell that makes the same files again.
    pub command: &'a str,
    /// Name of the project; none for the generic face.
    pub project: Option<&'a str>,
    /// The face.
    pub face: &'a FaceModel,
    /// What it was built with.
    pub setup: &'a Setup,
    /// What was played, with its intensity.
    pub expression: &'a Expression,
    /// The factor that is already in the expression.
    pub intensity: f64,
    /// How long was asked for, s.
    pub seconds: f64,
    /// The play, at its end.
    pub player: &'a Player,
    /// Places at the end, mm.
    pub last: &'a [Point3<f64>],
    /// The muscles' pull at the end, N.
    pub loads: &'a [Vector3<f64>],
    /// What was measured at the end.
    pub end: Sample,
    /// Speed of the fastest vertex at the end, mm/s.
    pub fastest_mm_s: f64,
    /// How the play ended, if it failed.
    pub failure: Option<&'a Failure>,
    /// Where the skin comes to rest, if it was looked for.
    pub equilibrium: Option<&'a Equilibrium>,
    /// Names in the expression that the face does not have.
    pub unknown: &'a [String],
    /// Stages and how long each took, ms.
    pub timings_ms: Vec<(&'static str, f64)>,
}

#[derive(Serialize)]
struct Report<'a> {
    program: &'static str,
    version: &'static str,
    command: &'a str,
    project: Option<&'a str>,
    face: Face<'a>,
    expression: &'a Expression,
    intensity: f64,
    settings: Settings,
    play: Play,
    equilibrium: Option<Rest>,
    largest_displacement: Moved,
    landmarks: BTreeMap<&'a str, Moved>,
    largest_force_n: f64,
    sum_of_forces_n: f64,
    folded_triangles: Vec<u32>,
    creases: Vec<Crease>,
    crease_advice: Option<String>,
    unknown_actuators: &'a [String],
    notes: &'a [String],
    failure: Option<Failed>,
    timings_ms: BTreeMap<&'static str, f64>,
}

#[derive(Serialize)]
struct Face<'a> {
    name: &'a str,
    vertices: usize,
    triangles: usize,
}

#[derive(Serialize)]
struct Settings {
    method: &'static str,
    step_ms: f64,
    seconds: f64,
    ramp_s: f64,
    law: &'static str,
    hold: &'static str,
    stiffness: f64,
    lids_and_corners_differ: bool,
    thickness_mm: f64,
    density_kg_m3: f64,
    damping_per_s: f64,
    pre_tension_kpa: f64,
}

#[derive(Serialize)]
struct Play {
    steps: usize,
    time_s: f64,
    kinetic_mj: f64,
    elastic_mj: f64,
    loads_mj: f64,
    largest_speed_mm_s: f64,
}

#[derive(Serialize)]
struct Rest {
    iterations: usize,
    residual_n: f64,
    energy_mj: f64,
    ended: &'static str,
    folded_triangles: Vec<u32>,
    /// Farthest that the end of the play lies from it.
    farthest_from_play_mm: Option<f64>,
}

#[derive(Serialize)]
struct Crease {
    vertices: [u32; 2],
    bent_deg: f64,
}

#[derive(Serialize)]
struct Moved {
    vertex: usize,
    by_mm: [f64; 3],
    length_mm: f64,
}

#[derive(Serialize)]
struct Failed {
    step: usize,
    time_ms: f64,
    vertex: usize,
    triangle: Option<usize>,
    cause: String,
    advice: String,
}

/// The text of `report.json`.
///
/// # Errors
/// What the writer of JSON says.
pub fn report(run: &Run<'_>) -> Result<String, serde_json::Error> {
    let system = &run.player.stage().system;
    let rest = system.rest();
    let moved = |vertex: usize| {
        let by = run.last[vertex] - rest[vertex];
        Moved { vertex, by_mm: by.into(), length_mm: by.norm() }
    };
    let far = |i: &usize| (run.last[*i] - rest[*i]).norm();
    let farthest = (0..rest.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
    let options = system.options();
    let Pace { method, step_s, ramp_s } = run.player.pace();
    let apart = |places: &[Point3<f64>]| places.iter().zip(run.last).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let played = run.seconds > 0.0 && run.failure.is_none();
    let areas = system.doubled_areas(run.last);
    let mesh = run.face.mesh();
    let creased = creases(mesh, rest, run.last);
    let report = Report {
        program: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        command: run.command,
        project: run.project,
        face: Face {
            name: run.face.name(),
            vertices: run.face.mesh().len(),
            triangles: run.face.mesh().triangles().len(),
        },
        expression: run.expression,
        intensity: run.intensity,
        settings: Settings {
            method: method.name(),
            step_ms: 1e3 * step_s,
            seconds: run.seconds,
            ramp_s,
            law: run.setup.law.name(),
            hold: run.setup.holding.name(),
            stiffness: run.setup.stiffness,
            lids_and_corners_differ: run.setup.tissues,
            thickness_mm: options.thickness_mm,
            density_kg_m3: options.density_kg_m3,
            damping_per_s: options.damping_per_s,
            pre_tension_kpa: options.pre_tension_kpa,
        },
        play: Play {
            steps: run.player.steps(),
            time_s: run.player.time_s(),
            kinetic_mj: run.end.energy.kinetic,
            elastic_mj: run.end.energy.elastic,
            loads_mj: run.end.energy.loads,
            largest_speed_mm_s: run.fastest_mm_s,
        },
        equilibrium: run.equilibrium.map(|e| Rest {
            iterations: e.iterations,
            residual_n: e.residual_n,
            energy_mj: e.energy_mj,
            ended: e.ended.label(),
            folded_triangles: e.folded.clone(),
            farthest_from_play_mm: played.then(|| apart(&e.positions)),
        }),
        largest_displacement: moved(farthest),
        landmarks: run.face.landmarks().iter().map(|l| (l.id.as_str(), moved(l.vertex as usize))).collect(),
        largest_force_n: run.loads.iter().map(Vector3::norm).fold(0.0, f64::max),
        sum_of_forces_n: run.loads.iter().map(Vector3::norm).sum(),
        crease_advice: in_words(mesh, &creased, options.hold).map(|[_, advice]| advice),
        creases: creased
            .iter()
            .map(|(e, rad)| Crease { vertices: mesh.edges()[*e as usize], bent_deg: rad.to_degrees() })
            .collect(),
        folded_triangles: areas.iter().enumerate().filter(|(_, a)| **a < 0.0).map(|(t, _)| t as u32).collect(),
        unknown_actuators: run.unknown,
        notes: &run.player.stage().actuators.notes,
        failure: run.failure.map(|f| Failed {
            step: f.step,
            time_ms: f.time_ms,
            vertex: f.vertex,
            triangle: f.triangle,
            cause: f.cause.to_string(),
            advice: f.advice.clone(),
        }),
        timings_ms: run.timings_ms.iter().copied().collect(),
    };
    let mut text = serde_json::to_string_pretty(&report)?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Energy;

    #[test]
    fn tables_have_their_columns_and_bring_the_same_numbers_back() {
        let (rest, last) = ([Point3::new(1.0, 2.0, -0.5)], [Point3::new(1.25, 2.0, -0.5)]);
        let text = positions(&rest, &last, &[Vector3::new(0.3, 0.4, 0.0)]);
        assert_eq!(text, format!("{POSITIONS_HEADER}\n0,1,2,-0.5,1.25,2,-0.5,0.5\n"));
        let sample = Sample { time_s: 0.25, energy: Energy { kinetic: 0.1, elastic: 2.0, loads: -3.5 }, picked: None };
        assert_eq!(energy([sample].iter()), format!("{ENERGY_HEADER}\n0.25,0.1,2,-3.5\n"));
    }

    #[test]
    fn a_moment_is_a_mesh_and_a_picture() {
        let face = crate::face::generic();
        let rest = face.mesh().positions();
        let text = mesh(&face, "Happy\n", 0.5, rest);
        assert!(text.contains(", Happy , 0.5000 s\n") && text.lines().filter(|l| l.starts_with("f ")).count() == 1128);
        let options = PictureOptions {
            shown: Some(Shown::Displacement),
            most: None,
            turns: vec![0.0],
            title: "Happy".to_owned(),
            view_px: [120, 160],
            within: Vec::new(),
        };
        let loads = vec![Vector3::zeros(); rest.len()];
        let drawn = picture(&face, rest, rest, &loads, &options).unwrap();
        assert!(drawn.width() > 120 && drawn.height() > 160);
    }
}
