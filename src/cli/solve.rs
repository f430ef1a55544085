//! `frontalis solve`: the forces of a project, as a table, a picture, a surface and a report.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use super::shell_word;
use crate::draw::height_map::{self, HeightMapOptions};
use crate::export::{csv, report, vtk};
use crate::pipeline::{self, Outcome, Workspace};

/// What `solve` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file).
    project: PathBuf,
    /// Folder for the results; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Compute from the marks alone, even where a frame is missing or has changed.
    #[arg(long)]
    ignore_frames: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let frames = if arguments.ignore_frames { Frames::Ignored } else { Frames::Required };
    let scene = Scene::open(&arguments.project, frames)?;
    let mut output = Output::folder(&arguments.out)?;
    let ignored = if arguments.ignore_frames { " --ignore-frames" } else { "" };
    let command =
        format!("frontalis solve {} --out {}{ignored}", shell_word(&arguments.project), shell_word(&arguments.out));
    let outcome = results(&scene, command, &mut output, &mut progress)?;
    output.finish()?;
    drop(progress);
    say(&outcome, &arguments.out);
    Ok(())
}

/// Solves a scene and adds the four files of results.
pub(super) fn results(
    scene: &Scene,
    command: String,
    output: &mut Output,
    progress: &mut Progress,
) -> Result<Outcome, CliError> {
    progress.stage("solve");
    let (project, face) = (&scene.project, scene.face.as_ref());
    let outcome = pipeline::solve(project, face, scene.image_size_px, &mut Workspace::default());
    progress.stage("draw");
    let options = HeightMapOptions {
        unit: if outcome.scale_measured { "N".to_owned() } else { "N (relative)".to_owned() },
        title: project.name.clone(),
        ..HeightMapOptions::default()
    };
    let (first, values) = (outcome.first_from_eyes(face), outcome.magnitude_inside_border());
    let picture = height_map::render(&first, face.mesh().triangles(), &values, &options)?;
    progress.stage("write");
    output.write("forces.csv", csv::forces(&outcome).as_bytes())?;
    output.write("forces.vtp", vtk::vtp(face.mesh(), &outcome).as_bytes())?;
    output.write_png("height_map.png", &picture)?;
    let timings_ms = progress.timings_ms();
    let circumstances = report::Circumstances { command, timings_ms, remarks: scene.remarks.clone() };
    output.write("report.json", report::report(project, face, &outcome, &circumstances).as_bytes())?;
    Ok(outcome)
}

/// The result in a few lines.
pub(super) fn say(outcome: &Outcome, out: &Path) {
    let unit = outcome.unit();
    match outcome.peak() {
        Some((vertex, force)) => {
            let sigma = outcome.field.sigma.get(vertex).copied().unwrap_or(f64::NAN);
            println!("largest force {force:.3} ± {sigma:.3} {unit} at vertex {vertex}");
        }
        None => println!("no vertex is measured: mark feature points in the last frame"),
    }
    for warning in &outcome.warnings {
        println!("warning: {warning}");
    }
    println!("written to {}", out.display());
}
