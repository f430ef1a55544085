//! Writing the results into a folder: what `frontalis solve` writes, and the marks.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use super::jobs::Progress;
use crate::export::{csv, height_map, report, vtk};
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::Project;
use crate::project::whole_file::{self, Durability};

/// Writes `forces.csv`, `marks.csv`, `forces.vtp`, `height_map.png` and `report.json`, each whole or not at all.
///
/// `command` is the line that gives the same results without a window.
///
/// # Errors
/// One line: which file, why, what to do.
pub fn write(
    folder: &Path,
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    command: String,
    progress: &Progress,
) -> Result<(), String> {
    let circumstances = report::Circumstances { command, ..report::Circumstances::default() };
    let files = [
        ("forces.csv", csv::forces(outcome).into_bytes()),
        ("marks.csv", csv::marks(project, face).into_bytes()),
        ("forces.vtp", vtk::vtp(face.mesh(), outcome).into_bytes()),
        ("report.json", report::report(project, face, outcome, &circumstances).into_bytes()),
        ("height_map.png", picture(project, face, outcome)?),
    ];
    let refused = |path: &Path, e: std::io::Error| {
        format!("{}: cannot be written ({e}); choose another folder, or free it for writing", path.display())
    };
    fs::create_dir_all(folder).map_err(|e| refused(folder, e))?;
    for (i, (name, bytes)) in files.iter().enumerate() {
        if progress.is_cancelled() {
            return Ok(());
        }
        progress.set((i + 1) as f64 / files.len() as f64);
        let path = folder.join(name);
        whole_file::write(&path, bytes, Durability::Disk).map_err(|e| refused(&path, e))?;
    }
    Ok(())
}

fn picture(project: &Project, face: &FaceModel, outcome: &Outcome) -> Result<Vec<u8>, String> {
    let drawn = height_map::picture(project, face, outcome);
    let mut bytes = Cursor::new(Vec::new());
    let png = drawn.map_err(|e| e.to_string())?.write_to(&mut bytes, image::ImageFormat::Png);
    png.map_err(|e| format!("the height map cannot be written as PNG ({e})"))?;
    Ok(bytes.into_inner())
}
