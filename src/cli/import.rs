//! `frontalis import`: marks of another program or another project as proposals, compared with those of a project, or accepted into a copy of it.

use std::path::PathBuf;

use super::error::CliError;
use super::scene::{Frames, Scene};
use crate::import;
use crate::project::{file, paths};

/// What `import` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file); it is not changed.
    project: PathBuf,
    /// The marks: CSV as `export` or `suggest` writes it, TPS, or COCO keypoints.
    marks: PathBuf,
    /// Accept the points for which the project has no mark, and write that project. Without it the points are only counted and compared.
    #[arg(long, value_name = "NEW.frontalis.json")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Scene { project, face, .. } = Scene::open(&arguments.project, Frames::Ignored)?;
    let import = import::read(&arguments.marks, &project, &face)?;
    for line in import.passed_over.iter().take(MOST_TOLD) {
        eprintln!("note: {line}");
    }
    if import.passed_over.len() > MOST_TOLD {
        eprintln!("note: and {} more like these", import.passed_over.len() - MOST_TOLD);
    }
    let new = import.new_points(&project).count();
    println!("{} points, {new} of them not marked in the project", import.points.len());
    if let Some((count, rms, largest)) = import.against(&project) {
        println!("{count} are marked: {rms:.3} px apart (root mean square), {largest:.3} px at most");
    }
    let Some(out) = &arguments.out else { return Ok(()) };
    if out.exists() && out.canonicalize().ok() == arguments.project.canonicalize().ok() {
        return Err(CliError::WouldReplaceInput(out.clone()));
    }
    let mut accepted = project.clone();
    for edit in import.accept(&project).into_iter().chain(paths::rebase(&project, Some(&arguments.project), out)) {
        // Places were checked when they were read, and nothing that is locked is among them.
        let _ = edit.apply(&mut accepted);
    }
    file::save(&accepted, out)?;
    println!("{new} points accepted, written to {}", out.display());
    Ok(())
}

/// Lines of what was passed over that are told.
const MOST_TOLD: usize = 10;
