//! `frontalis twin`: a scene of known truth, as a project with two rendered frames and the truth beside it.

use std::path::PathBuf;

use image::RgbImage;
use nalgebra::Vector3;
use serde::Serialize;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::simulate::{named, within};
use crate::export::csv::{self, TruthRow};
use crate::face::{self, FaceModel};
use crate::forces::{Material, Sheet};
use crate::frames::Frame;
use crate::project::{FrameRef, Project, file};
use crate::simulate::Ended;
use crate::study::membrane_truth::{MembraneFace, MembraneSettings, MembraneTruth};
use crate::study::{Twin, TwinSettings, Wish, scene};

const PROJECT: &str = "twin.frontalis.json";

/// What `twin` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for the scene; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What moves the skin: `slide`, a prescribed brow raise whose forces are those of the project's own springs; or `membrane`, muscles
    /// that pull on a finer mesh of membrane elements, whose forces are not.
    #[arg(long, value_name = "WHAT", default_value = "slide")]
    truth: String,
    /// What a membrane shows: brow_raise, surprise, happy, sad, anger, disgust, fear, or random (one to five muscles by the seed).
    #[arg(long, value_name = "NAME", default_value = "brow_raise")]
    expression: String,
    /// Share of the expression's activations and of the jaw's angle (0.05 to 1); half of a brow raise lifts the brow by 8 mm.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    intensity: f64,
    /// How often a membrane's triangles are cut into four (0 to 2).
    #[arg(long, value_name = "N", default_value_t = 1)]
    levels: u32,
    /// What a membrane is made of: fibres (in every direction) or principal (stretches that do not know each other).
    #[arg(long, value_name = "WHAT", default_value = "fibres")]
    material: String,
    /// Share of a membrane's vertices that nobody marked (0 to 0.9).
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    unmarked: f64,
    /// Seed of the person, the head's motion, the marking noise and the picture's noise: the same seed, the same files.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the marks along each axis, px (0 to 20).
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    noise_px: f64,
    /// Standard deviation that the project states of its marks, px; without it, that of --noise-px.
    #[arg(long, value_name = "S")]
    stated_sigma_px: Option<f64>,
    /// Side of the square frames, px (64 to 4096).
    #[arg(long, value_name = "PX", default_value_t = 1036)]
    size: u32,
    /// Strength of the brow raise: 1 lifts the middle of the brow by 10.3 mm (0 to 1.2).
    #[arg(long, value_name = "SHARE", default_value_t = 0.8)]
    amplitude: f64,
    /// Distance of the camera, mm (300 to 10000).
    #[arg(long, value_name = "MM", default_value_t = 1000.0)]
    distance_mm: f64,
    /// Distance of the painted grid's lines, mm (3 to 40).
    #[arg(long, value_name = "MM", default_value_t = 8.0)]
    grid_pitch_mm: f64,
    /// Width of the painted grid's lines, mm (0.2 to 3).
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    grid_line_mm: f64,
    /// Paint no grid: bare skin.
    #[arg(long, conflicts_with_all = ["grid_pitch_mm", "grid_line_mm"])]
    no_grid: bool,
    /// Standard deviation of the camera's noise in each channel, of 255 (0 to 20).
    #[arg(long, value_name = "S", default_value_t = 1.2)]
    sensor_noise: f64,
    /// Share by which each lamp becomes stronger or weaker in the last frame (0 to 0.5).
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    light_change: f64,
    /// Largest turn of the head, degrees (0.5 to 10).
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    head_turn_deg: f64,
    /// Largest shift of the head, mm (0 to 20).
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    head_shift_mm: f64,
    /// Keep the head where it was.
    #[arg(long, conflicts_with_all = ["head_turn_deg", "head_shift_mm"])]
    no_head_motion: bool,
}

/// `truth.json`.
#[derive(Serialize)]
struct Truth<'a> {
    program: &'static str,
    version: &'static str,
    kind: String,
    activations: serde_json::Value,
    forces: &'static str,
    depth: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    membrane: Option<MembraneFacts>,
    seed: u64,
    camera: CameraTruth,
    head_motion: HeadTruth,
    settings: &'a TwinSettings,
}

/// How the truth of a membrane was found.
#[derive(Serialize)]
struct MembraneFacts {
    levels: u32,
    material: &'static str,
    intensity: f64,
    jaw_deg: f64,
    newton_steps: usize,
    residual_n: f64,
    folded_triangles: usize,
    least_and_largest_stretch: [f64; 2],
}

#[derive(Serialize)]
struct CameraTruth {
    principal_point_px: [f64; 2],
    distance_mm: f64,
    view_plane_z_mm: f64,
    px_per_mm: f64,
}

#[derive(Serialize)]
struct HeadTruth {
    rotation_vector_rad: [f64; 3],
    translation_mm: [f64; 3],
    pivot_mm: [f64; 3],
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let settings = TwinSettings {
        seed: arguments.seed,
        noise_px: arguments.noise_px,
        size_px: arguments.size,
        amplitude: arguments.amplitude,
        distance_mm: arguments.distance_mm,
        grid: !arguments.no_grid,
        grid_pitch_mm: arguments.grid_pitch_mm,
        grid_line_mm: arguments.grid_line_mm,
        sensor_noise: arguments.sensor_noise,
        light_change: arguments.light_change,
        head_motion: !arguments.no_head_motion,
        head_turn_deg: arguments.head_turn_deg,
        head_shift_mm: arguments.head_shift_mm,
    };
    let mut progress = Progress::new();
    progress.stage("make the scene");
    let sigma_px = arguments.stated_sigma_px.unwrap_or(settings.noise_px);
    // The settings are judged before the person is made from one of them.
    Twin::generate(&face::generic(), &settings)?;
    let person = scene::person(&face::generic(), settings.seed, settings.distance_mm)?;
    let membrane = match arguments.truth.as_str() {
        "slide" => None,
        "membrane" => Some(arguments.membrane(&person)?),
        other => return Err(CliError::Question(format!("--truth is {other}; choose slide or membrane"))),
    };
    let twin = match &membrane {
        Some(m) => Twin::displaced(&person, m.truth.last.clone(), &settings)?,
        None => Twin::generate(&person, &settings)?,
    };
    let mut output = Output::folder(&arguments.out)?;

    progress.stage("draw the frames");
    let [first, last] = twin.render(&person);
    let frames = [add_frame(&mut output, "first.png", &first)?, add_frame(&mut output, "last.png", &last)?];

    progress.stage("write");
    let project = match &membrane {
        Some(m) => {
            scene::membrane_project(&twin, &person, frames, sigma_px, &m.truth.expression.name, arguments.unmarked)
        }
        None => scene::project(&twin, &person, frames, sigma_px),
    };
    output.write(PROJECT, &file::to_bytes(PROJECT.as_ref(), &project)?)?;
    let forces = write_truth(&mut output, &twin, &person, &project, membrane)?;
    output.finish()?;
    drop(progress);

    let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
    println!("{} marks, largest true force {largest:.3} N", project.measured_count());
    println!("the project is {}", arguments.out.join(PROJECT).display());
    Ok(())
}

/// An expression of a membrane, and what it is made of.
struct OfMembrane {
    truth: MembraneTruth,
    facts: MembraneFacts,
}

impl Arguments {
    fn membrane(&self, person: &FaceModel) -> Result<OfMembrane, CliError> {
        let wish = named("expression", &self.expression, &Wish::ALL, Wish::word)?;
        let material = named("material", &self.material, &MATERIALS, |m| m.0.to_owned())?;
        let intensity = within("intensity", self.intensity, [0.05, 1.0])?;
        within("levels", f64::from(self.levels), [0.0, 2.0])?;
        within("unmarked", self.unmarked, [0.0, 0.9])?;
        let sheet = Sheet { material: material.1, ..Sheet::default() };
        let settings = MembraneSettings { levels: self.levels, sheet, ..MembraneSettings::default() };
        let mut face = MembraneFace::new(person, &settings)?;
        let expression = wish.expression(&face.actuators, self.seed).times(intensity);
        let truth = face.truth(&expression)?;
        if truth.ended != Ended::Converged {
            let why = truth.ended.label();
            return Err(CliError::Question(format!("the skin found no rest ({why}); ask for a smaller --intensity")));
        }
        let facts = MembraneFacts {
            levels: self.levels,
            material: material.0,
            intensity,
            jaw_deg: expression.jaw_deg,
            newton_steps: truth.iterations,
            residual_n: truth.residual_n,
            folded_triangles: truth.folded,
            least_and_largest_stretch: truth.stretch,
        };
        Ok(OfMembrane { truth, facts })
    }
}

const MATERIALS: [(&str, Material); 2] = [("fibres", Material::Fibres), ("principal", Material::Principal)];

/// Writes `truth.csv` and `truth.json`; the true forces.
fn write_truth(
    output: &mut Output,
    twin: &Twin,
    person: &FaceModel,
    project: &Project,
    membrane: Option<OfMembrane>,
) -> Result<Vec<Vector3<f64>>, CliError> {
    let mesh = person.mesh();
    let (truth, force, area, muscle) = if let Some(OfMembrane { truth, facts }) = membrane {
        let activations = serde_json::to_value(&truth.expression.activations).unwrap_or_default();
        let kind = truth.expression.name;
        (of_twin(twin, kind, activations, Some(facts)), truth.force, truth.area_mm2, Some(truth.muscle))
    } else {
        let activations = "none: the displacement is prescribed".into();
        let force = scene::true_forces(twin, person, &project.settings);
        (of_twin(twin, "brow raise".to_owned(), activations, None), force, mesh.vertex_areas(mesh.positions()), None)
    };
    let rows = (0..twin.first.len()).map(|v| TruthRow {
        first: twin.first[v],
        last: twin.last[v],
        first_in_image: twin.first_in_image[v],
        last_in_image: twin.last_in_image[v],
        force: force[v],
        area_mm2: area[v],
        muscle: muscle.as_ref().map(|m| m[v]),
    });
    output.write("truth.csv", csv::truth(rows).as_bytes())?;
    let text = serde_json::to_string_pretty(&truth).unwrap_or_default() + "\n";
    output.write("truth.json", text.as_bytes())?;
    Ok(force)
}

/// Writes a frame, and names it as a project does.
fn add_frame(output: &mut Output, name: &'static str, picture: &RgbImage) -> Result<FrameRef, CliError> {
    let bytes = output.write_png(name, picture)?;
    let sha256 = Frame::decode(name.as_ref(), &bytes)?.sha256().to_owned();
    let (width_px, height_px) = picture.dimensions();
    Ok(FrameRef { path: name.to_owned(), sha256, width_px, height_px })
}

fn of_twin(twin: &Twin, kind: String, activations: serde_json::Value, membrane: Option<MembraneFacts>) -> Truth<'_> {
    let (forces, depth) = match membrane {
        None => (
            "those of the project's own springs over the whole mesh at the true positions",
            "the skin slides on the surface of the first frame",
        ),
        Some(_) => (
            "what holds a finer membrane in its shape (muscles, skull and held vertices; mx_N to mz_N the muscles alone), gathered by hat functions",
            "every vertex keeps its height above a smooth skull",
        ),
    };
    Truth {
        program: "frontalis",
        version: env!("CARGO_PKG_VERSION"),
        kind,
        activations,
        forces,
        depth,
        membrane,
        seed: twin.settings.seed,
        camera: CameraTruth {
            principal_point_px: twin.camera.principal_point_px.into(),
            distance_mm: twin.camera.z_prp_mm - twin.camera.z_vp_mm,
            view_plane_z_mm: twin.camera.z_vp_mm,
            px_per_mm: twin.camera.px_per_mm,
        },
        head_motion: HeadTruth {
            rotation_vector_rad: twin.head_motion.rotation.scaled_axis().into(),
            translation_mm: twin.head_motion.translation_mm.into(),
            pivot_mm: twin.head_motion.pivot.coords.into(),
        },
        settings: &twin.settings,
    }
}
