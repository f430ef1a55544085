//! `frontalis suggest`: where tracking would put every feature point that is not marked yet.

use std::path::PathBuf;

use super::error::CliError;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use crate::export::csv;
use crate::frames::{Frame, Way};
use crate::marking::Gray;
use crate::marking::tracking::Prepared;
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::paths;
use crate::project::whole_file::{self, Durability};
use crate::suggest::{self, Followed, Found};

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
    let files = [first, last].map(|f| paths::resolve(&arguments.project, f));
    let [first, last] = files.each_ref().map(|f| Frame::read(f));
    let pictures = [first?, last?];
    progress.stage("track");
    let outcome = pipeline::solve(&scene.project, &scene.face, scene.image_size_px, &mut Workspace::default());
    let (found, way) = found(&scene, &outcome, &files, &pictures);
    let Found { suggestions: found, compressed_px, .. } = found;
    let text = csv::suggestions(&found, &scene.face);
    let failed = |source| CliError::Write { path: arguments.out.clone(), source };
    whole_file::write(&arguments.out, text.as_bytes(), Durability::Process).map_err(failed)?;
    drop(progress);
    let sure = found.iter().filter(|s| s.confidence >= 0.9).count();
    println!("{} points suggested, {sure} of them at 90 % confidence or more", found.len());
    if let Some(way) = way {
        println!("{way}");
    }
    if compressed_px > 0.0 {
        println!("compressed frames add ± {compressed_px:.1} px to every place; key frames of the film are better");
    }
    println!("written to {}", arguments.out.display());
    Ok(())
}

/// Suggestions, through the film that both frames were taken from where it lies beside them, and a line about it.
fn found(scene: &Scene, outcome: &Outcome, files: &[PathBuf; 2], pictures: &[Frame; 2]) -> (Found, Option<String>) {
    let prepare = |f: &Frame| Gray::of(f.image()).map(|gray| Prepared::of(gray).compressed(f.compression()));
    let [Some(prepared), Some(last)] = pictures.each_ref().map(prepare) else { return (Found::default(), None) };
    let (followed, way) = match Way::of([&files[0], &files[1]], &[]) {
        Way::None => (Followed::default(), None),
        Way::Missing(film) => {
            let told = format!("the film {film}, from which the frames come, is not beside them: followed at once");
            (Followed::default(), Some(told))
        }
        Way::Through(between) => {
            let mut seen = 0;
            let first = pictures[0].image();
            let way = suggest::follow_film(&between, first, &scene.face, outcome, &prepared, &|| false, |n| seen = n);
            match way {
                Ok(followed) => {
                    (followed, Some(format!("followed through {seen} frames of {}", between.film.display())))
                }
                Err(e) => (Followed::default(), Some(format!("followed at once: {e}"))),
            }
        }
    };
    let found = suggest::found_after(&scene.project, &scene.face, outcome, &prepared, &followed, &last);
    (found, way)
}
