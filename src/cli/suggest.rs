//! `frontalis suggest`: where tracking would put every feature point that is not marked yet.

use std::path::PathBuf;

use super::error::CliError;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use crate::export::csv;
use crate::frames::Frame;
use crate::pipeline::{self, Workspace};
use crate::project::paths;
use crate::project::whole_file::{self, Durability};
use crate::suggest;

/// What `suggest` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file); it is not changed.
    project: PathBuf,
    /// The CSV file to write.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let scene = Scene::open(&arguments.project, Frames::Required)?;
    let frames = &scene.project.frames;
    let (Some(first), Some(last)) = (&frames.first, &frames.last) else { return Err(CliError::NoFrames) };
    let [first, last] =
        [first, last].map(|f| Frame::read(&paths::resolve(&arguments.project, f)).map(Frame::into_image));
    let (first, last) = (first?, last?);
    progress.stage("track");
    let outcome = pipeline::solve(&scene.project, &scene.face, scene.image_size_px, &mut Workspace::default());
    let found = suggest::suggestions(&scene.project, &scene.face, &outcome, &first, &last);
    let text = csv::suggestions(&found, &scene.face);
    let failed = |source| CliError::Write { path: arguments.out.clone(), source };
    whole_file::write(&arguments.out, text.as_bytes(), Durability::Process).map_err(failed)?;
    drop(progress);
    let sure = found.iter().filter(|s| s.confidence >= 0.9).count();
    println!("{} points suggested, {sure} of them at 90 % confidence or more", found.len());
    println!("written to {}", arguments.out.display());
    Ok(())
}
