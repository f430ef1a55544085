//! Writing the results into a folder: what `frontalis solve` writes, the marks, and what `frontalis fit` writes where the muscles are known.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::jobs::Progress;
use super::pictures::Source;
use crate::export::muscles::Subject;
use crate::export::{csv, height_map, muscle_report, png, report, vtk};
use crate::face::FaceModel;
use crate::frames::Frame;
use crate::muscle_field::subjects::Other;
use crate::muscle_field::{Analysis, Ladder};
use crate::pipeline::Outcome;
use crate::project::Project;
use crate::project::whole_file::{self, Durability};

/// What is written.
pub struct Results {
    /// What was marked.
    pub project: Project,
    /// The face.
    pub face: Arc<FaceModel>,
    /// What the chain made of it.
    pub outcome: Outcome,
    /// The muscles behind it and the ladder, where they were looked for.
    pub muscles: Option<(Arc<Analysis>, Option<Arc<Ladder>>)>,
    /// Other subjects that their laws were tried on, each with its file.
    pub others: Vec<(PathBuf, Other)>,
    /// The last frame, where it is the one that was marked.
    pub last_frame: Option<Source>,
    /// How the project's file and the folder stand in a line for the shell.
    pub named: [String; 2],
}

/// Writes `forces.csv`, `marks.csv`, `forces.vtp`, `height_map.png` and `report.json`, and the files of [`muscle_report::files`] where
/// the muscles are known; each whole or not at all. The reports name the line that gives the same results without a window.
///
/// # Errors
/// One line: which file, why, what to do.
pub fn write(folder: &Path, results: &Results, progress: &Progress) -> Result<(), String> {
    let Results { project, face, outcome, muscles, others, last_frame, named: [from, to] } = results;
    let made_by = |command: String| report::Circumstances { command, ..report::Circumstances::default() };
    let circumstances = made_by(format!("frontalis solve {from} --out {to}"));
    let mut files = vec![
        ("forces.csv", csv::forces(outcome).into_bytes()),
        ("marks.csv", csv::marks(project, face).into_bytes()),
        ("forces.vtp", vtk::vtp(face.mesh(), outcome).into_bytes()),
        ("report.json", report::report(project, face, outcome, &circumstances).into_bytes()),
        ("height_map.png", picture(project, face, outcome)?),
    ];
    if let Some((analysis, ladder)) = muscles {
        // A frame that cannot be read leaves out the pictures over it; the pane of the frame says why.
        let last = last_frame.as_ref().and_then(|source| source.read().ok()).map(Frame::into_image);
        let (ladder, last_frame) = (ladder.as_deref(), last.as_ref());
        let tried: Vec<Other> = others.iter().map(|(_, other)| other.clone()).collect();
        let subject = Subject { project, face, outcome, analysis, ladder, last_frame, others: &tried };
        let mut words = vec![format!("frontalis fit {from} --out {to}")];
        words.extend(analysis.question.arguments(face));
        words.extend(others.iter().map(|(path, _)| format!("--test '{}'", path.display())));
        words.extend(ladder.is_some().then(|| "--ladder".to_owned()));
        files.extend(muscle_report::files(&subject, &made_by(words.join(" "))).map_err(|e| e.to_string())?);
    }
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
    let drawn = height_map::picture(project, face, outcome).map_err(|e| e.to_string())?;
    png(&drawn).map_err(|e| format!("the height map cannot be written as PNG ({e})"))
}
