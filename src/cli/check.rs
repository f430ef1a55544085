//! `frontalis check`: everything that is wrong with a project, not only the first of it.

use std::path::PathBuf;

use super::error::CliError;
use super::one_line;
use super::scene::{check_frame, face_of, image_size_px, named_frames};
use crate::pipeline::{self, Workspace};
use crate::project::{faults, file};

/// What `check` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file).
    project: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.project;
    let project = file::load_unchecked(path)?;
    let values = faults::of_values(&project);
    let computable = values.is_empty();
    let mut errors: Vec<String> = values.iter().map(ToString::to_string).collect();
    let mut warnings = Vec::new();

    for (which, frame) in named_frames(&project) {
        // A frame whose hash is no hash has been named above.
        if faults::is_sha256(&frame.sha256) {
            match check_frame(path, which, frame) {
                Ok(()) => {}
                Err(CliError::FrameFile { which, status }) => errors.push(format!("frames.{which}: {status}")),
                Err(e) => errors.push(format!("frames.{which}: {e}")),
            }
        }
    }
    for (which, frame) in [("first", &project.frames.first), ("last", &project.frames.last)] {
        if frame.is_none() {
            warnings.push(format!("No {which} frame is chosen."));
        }
    }
    errors.extend(faults::of_extent(&project).iter().map(ToString::to_string));

    match face_of(path, &project) {
        Ok(face) => {
            errors.extend(faults::of_bindings(&project, &face).iter().map(ToString::to_string));
            if computable {
                let outcome = pipeline::solve(&project, &face, image_size_px(&project), &mut Workspace::default());
                let known = |w: &&pipeline::Warning| !matches!(w, pipeline::Warning::NotInFace { .. });
                warnings.extend(outcome.warnings.iter().filter(known).map(ToString::to_string));
            }
        }
        Err(e) => errors.push(format!("face: {e}")),
    }

    for error in &errors {
        println!("error: {}", one_line(error));
    }
    for warning in &warnings {
        println!("warning: {}", one_line(warning));
    }
    if errors.is_empty() {
        println!("{}: no errors, {} warnings", path.display(), warnings.len());
        Ok(())
    } else {
        Err(CliError::Faulty { path: path.clone(), errors: errors.len() })
    }
}
