//! `frontalis export`: marks and results for other programs.

use std::path::PathBuf;

use clap::ValueEnum;

use super::error::CliError;
use super::scene::{Frames, Scene};
use crate::export::{coco, csv, obj, tps, vtk};
use crate::pipeline::{self, Workspace};
use crate::project::Which;
use crate::project::whole_file::{self, Durability};

/// What `export` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file).
    project: PathBuf,
    /// csv: marks as a table; tps: both frames as specimens; coco: keypoints; obj: the fitted face; vtk: the forces.
    #[arg(long, value_enum)]
    format: Format,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Frame of the fitted face (obj).
    #[arg(long, value_enum, default_value_t = FrameChoice::First)]
    frame: FrameChoice,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    Csv,
    Tps,
    Coco,
    Obj,
    Vtk,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FrameChoice {
    First,
    Last,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let out = &arguments.out;
    // Marks are of use even when a picture has been moved.
    let Scene { project, face, image_size_px, .. } = Scene::open(&arguments.project, Frames::Ignored)?;
    if out.exists() && out.canonicalize().ok() == arguments.project.canonicalize().ok() {
        return Err(CliError::WouldReplaceInput(out.clone()));
    }
    let outcome = pipeline::solve(&project, &face, image_size_px, &mut Workspace::default());
    let text = match arguments.format {
        Format::Csv => csv::marks(&project, &face),
        Format::Tps => tps::tps(&project, &face, &outcome)?,
        Format::Coco => coco::coco(&project, &face, &outcome)?,
        Format::Obj => {
            let which = match arguments.frame {
                FrameChoice::First => Which::First,
                FrameChoice::Last => Which::Last,
            };
            obj::obj(&face, &outcome, which)
        }
        Format::Vtk => vtk::vtp(face.mesh(), &outcome),
    };
    let failed = |source| CliError::Write { path: out.clone(), source };
    whole_file::write(out, text.as_bytes(), Durability::Process).map_err(failed)?;
    println!("written to {}", out.display());
    Ok(())
}
