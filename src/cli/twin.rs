//! `frontalis twin`: a scene of known truth, as a project with two rendered frames and the truth beside it.

use std::path::PathBuf;

use image::RgbImage;
use nalgebra::Vector3;
use serde::Serialize;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use crate::export::csv::{self, TruthRow};
use crate::face;
use crate::frames::Frame;
use crate::project::{FrameRef, file};
use crate::study::{Twin, TwinSettings, scene};

const PROJECT: &str = "twin.frontalis.json";

/// What `twin` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for the scene; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
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
    kind: &'static str,
    activations: &'static str,
    forces: &'static str,
    depth: &'static str,
    seed: u64,
    camera: CameraTruth,
    head_motion: HeadTruth,
    settings: &'a TwinSettings,
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
    let twin = Twin::generate(&person, &settings)?;
    let mut output = Output::folder(&arguments.out)?;

    progress.stage("draw the frames");
    let [first, last] = twin.render(&person);
    let frames = [add_frame(&mut output, "first.png", &first)?, add_frame(&mut output, "last.png", &last)?];

    progress.stage("write");
    let project = scene::project(&twin, &person, frames, sigma_px);
    output.write(PROJECT, &file::to_bytes(PROJECT.as_ref(), &project)?)?;
    let forces = scene::true_forces(&twin, &person, &project.settings);
    output.write("truth.csv", csv::truth(rows(&twin, &forces)).as_bytes())?;
    let truth = serde_json::to_string_pretty(&truth(&twin)).unwrap_or_default() + "\n";
    output.write("truth.json", truth.as_bytes())?;
    output.finish()?;
    drop(progress);

    let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
    println!("{} marks, largest true force {largest:.3} N", project.measured_count());
    println!("the project is {}", arguments.out.join(PROJECT).display());
    Ok(())
}

/// Writes a frame, and names it as a project does.
fn add_frame(output: &mut Output, name: &'static str, picture: &RgbImage) -> Result<FrameRef, CliError> {
    let bytes = output.write_png(name, picture)?;
    let sha256 = Frame::decode(name.as_ref(), &bytes)?.sha256().to_owned();
    let (width_px, height_px) = picture.dimensions();
    Ok(FrameRef { path: name.to_owned(), sha256, width_px, height_px })
}

fn rows<'a>(twin: &'a Twin, forces: &'a [Vector3<f64>]) -> impl Iterator<Item = TruthRow> + 'a {
    let places = twin.first.iter().zip(&twin.last).zip(twin.first_in_image.iter().zip(&twin.last_in_image));
    places.zip(forces).map(|(((x0, x1), (p0, p1)), f)| TruthRow {
        first: *x0,
        last: *x1,
        first_in_image: *p0,
        last_in_image: *p1,
        force: *f,
    })
}

fn truth(twin: &Twin) -> Truth<'_> {
    Truth {
        program: "frontalis",
        version: env!("CARGO_PKG_VERSION"),
        kind: "brow raise",
        activations: "none: the displacement is prescribed",
        forces: "those of the project's own springs over the whole mesh at the true positions",
        depth: "the skin slides on the surface of the first frame",
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
