//! `frontalis solve`: the forces of a project, as a table, a picture, a surface and a report.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use super::shell_word;
use crate::export::{csv, height_map, report, vtk};
use crate::pipeline::{self, Outcome, Peak, Workspace};

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
    let picture = height_map::picture(project, face, &outcome)?;
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
        Peak::Unmeasured => println!("no vertex is measured: mark feature points in the last frame"),
        finding => println!("{}", finding.in_words(unit)),
    }
    for warning in &outcome.warnings {
        println!("warning: {warning}");
    }
    println!("written to {}", out.display());
}
