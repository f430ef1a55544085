//! `frontalis demo`: the main job on the embedded sample, without a window and without any file.

use std::path::PathBuf;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Scene, image_size_px};
use super::{shell_word, solve};
use crate::face;
use crate::project::sample;

/// What `demo` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for the sample and the results; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let project = sample::project()?;
    let image_size_px = image_size_px(&project);
    let scene = Scene { project, face: face::generic(), image_size_px, remarks: Vec::new() };
    let mut output = Output::folder(&arguments.out)?;
    for (name, bytes) in sample::files() {
        output.write(name, bytes)?;
    }
    let command = format!("frontalis demo --out {}", shell_word(&arguments.out));
    let outcome = solve::results(&scene, command, &mut output, &mut progress)?;
    output.finish()?;
    drop(progress);
    solve::say(&outcome, &arguments.out);
    println!("the project is {}", arguments.out.join(sample::PROJECT_NAME).display());
    Ok(())
}
