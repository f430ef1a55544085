//! `frontalis export`: marks and results for other programs.

use std::path::{Path, PathBuf};

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
    /// The file to write. For vtk its ending is .vtp; another one is put right.
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
    let out = &with_known_ending(&arguments.out, arguments.format);
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
    let why = if *out == arguments.out { "" } else { " (programs know VTK XML PolyData by the ending .vtp)" };
    println!("written to {}{why}", out.display());
    Ok(())
}

/// The file to write: programs tell VTK's XML from its older format by the ending alone, so another one is put right.
fn with_known_ending(out: &Path, format: Format) -> PathBuf {
    match out.extension() {
        _ if !matches!(format, Format::Vtk) => out.to_owned(),
        Some(ending) if ending == "vtp" => out.to_owned(),
        Some(ending) if ending == "vtk" => out.with_extension("vtp"),
        _ => whole_file::with_ending(out, "vtp"),
    }
}
