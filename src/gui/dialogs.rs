//! Asking the person for files: behind a trait, so that a test can answer in the person's place.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// What files are asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A project to open.
    OpenProject,
    /// Where to save the project, then what to do.
    SaveProject {
        /// File name to begin with.
        suggested: String,
        /// What waits for it.
        then: Option<super::command::After>,
    },
    /// The two frames.
    Frames,
    /// One frame.
    Frame(crate::project::Which),
    /// A file of marks.
    Marks,
    /// Another project to compare with.
    Compare,
    /// Projects of other subjects.
    Subjects,
    /// A film.
    Film,
    /// A folder for two frames of a film, whose own takes none.
    StillsFolder(super::film_work::Stills),
    /// A folder of numbered frames.
    FrameFolder,
    /// A folder for the results.
    ExportFolder,
    /// An expression file.
    OpenExpression,
    /// Where to save the expression.
    SaveExpression {
        /// File name to begin with.
        suggested: String,
    },
    /// A folder for a play.
    PlayFolder,
    /// The table of a study.
    OpenStudy,
    /// A folder for a study.
    StudyFolder,
    /// A mesh of another program.
    OpenMesh,
    /// A face model.
    OpenFace,
    /// Where to save the face model, then what to do.
    SaveFace {
        /// File name to begin with.
        suggested: String,
        /// What waits for it.
        then: Option<super::command::After>,
    },
}

impl Purpose {
    /// Title of the dialog.
    pub fn title(&self) -> &'static str {
        match self {
            Self::OpenProject => "Open project",
            Self::SaveProject { .. } => "Save project",
            Self::Frames => "Choose the first and the last frame",
            Self::Frame(crate::project::Which::First) => "Choose the first frame",
            Self::Frame(crate::project::Which::Last) => "Choose the last frame",
            Self::Marks => "Import marks",
            Self::Compare => "Compare with project",
            Self::Subjects => "Open other subjects",
            Self::Film => "Open film",
            Self::StillsFolder(_) => "Choose a folder for the two frames",
            Self::FrameFolder => "Choose a folder of numbered frames",
            Self::ExportFolder => "Choose a folder for the results",
            Self::OpenExpression => "Open expression",
            Self::SaveExpression { .. } => "Save expression",
            Self::PlayFolder => "Choose a folder for the play",
            Self::OpenStudy => "Open study",
            Self::StudyFolder => "Choose a folder for the study",
            Self::OpenMesh => "Open mesh",
            Self::OpenFace => "Open face model",
            Self::SaveFace { .. } => "Save face model",
        }
    }

    /// What to do where the path has to be typed.
    pub fn how_to_type(&self) -> &'static str {
        match self {
            Self::OpenProject => "Type the path of the project, or drop its file on the window.",
            Self::SaveProject { .. } => "Type the path of the file to save to.",
            Self::Frames => "Type the paths of the two pictures, or drop them on the window.",
            Self::Frame(_) => "Type the path of the picture, or drop it on the window.",
            Self::Marks => "Type the path of a CSV, TPS or COCO file of marks.",
            Self::Compare => "Type the path of the project to compare with.",
            Self::Subjects => "Type the path of another subject's project.",
            Self::Film => "Type the path of the film, or drop it on the window.",
            Self::StillsFolder(_) => {
                "The film's folder cannot be written. Type the path of a folder for the two frames, as pictures."
            }
            Self::FrameFolder => "Type the path of the folder, or drop it on the window.",
            Self::OpenExpression => "Type the path of the expression file.",
            Self::SaveExpression { .. } => "Type the path of the file to save the expression to.",
            Self::PlayFolder => {
                "Type the path of the folder that the play is to be written into, as a folder of its own."
            }
            Self::OpenStudy => "Type the path of the table of a study (CSV).",
            Self::StudyFolder => "Type the path of the folder that the study is to be written to.",
            Self::OpenMesh => "Type the path of the mesh (OBJ, PLY or WFM), or drop it on the window.",
            Self::OpenFace => "Type the path of the face model, or drop it on the window.",
            Self::SaveFace { .. } => "Type the path of the file to save the face model to.",
            Self::ExportFolder => "Type the path of the folder that the results are to be written to.",
        }
    }

    /// Names of the paths to type.
    pub fn paths(&self) -> &'static [&'static str] {
        match self {
            Self::OpenProject | Self::Compare | Self::Subjects => &["Project"],
            Self::SaveProject { .. } | Self::SaveFace { .. } | Self::SaveExpression { .. } => &["File"],
            Self::OpenExpression => &["Expression"],
            Self::OpenStudy => &["Table"],
            Self::OpenMesh => &["Mesh"],
            Self::OpenFace => &["Face model"],
            Self::Frames => &["First frame", "Last frame"],
            Self::Frame(crate::project::Which::First) => &["First frame"],
            Self::Frame(crate::project::Which::Last) => &["Last frame"],
            Self::Marks => &["Marks"],
            Self::Film => &["Film"],
            Self::FrameFolder | Self::ExportFolder | Self::StillsFolder(_) | Self::PlayFolder | Self::StudyFolder => {
                &["Folder"]
            }
        }
    }
}

/// How an asking ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// These files.
    Files(Vec<PathBuf>),
    /// The person thought better of it.
    Cancelled,
    /// The system has no file dialog.
    Unavailable,
}

/// Asks the person for files, and answers later.
pub trait Dialogs {
    /// Begins to ask; an asking that is under way is dropped.
    fn ask(&mut self, ctx: &egui::Context, purpose: Purpose);
    /// The answer, once it is there.
    fn poll(&mut self) -> Option<(Purpose, Answer)>;
}

/// The system's own file dialogs, on a thread of their own so that the window lives on.
#[derive(Default)]
pub struct NativeDialogs {
    waiting: Option<(Purpose, Receiver<Answer>)>,
}

/// A dialog that "was cancelled" faster than a person can was never shown: there is neither a portal nor zenity.
const FASTER_THAN_A_PERSON: Duration = Duration::from_millis(300);

/// Endings of the meshes that can be read.
pub const MESHES: &[&str] = &["obj", "ply", "wfm"];

/// Endings of the films that can be read.
pub const FILMS: &[&str] = crate::frames::film::ENDINGS;

/// Endings of the pictures that can be read.
pub const PICTURES: &[&str] = &["png", "jpg", "jpeg", "bmp", "tif", "tiff", "webp"];

impl Dialogs for NativeDialogs {
    fn ask(&mut self, ctx: &egui::Context, purpose: Purpose) {
        let (sender, receiver) = channel();
        self.waiting = Some((purpose.clone(), receiver));
        let ctx = ctx.clone();
        let thread = std::thread::Builder::new().name("file dialog".into());
        let spawned = thread.spawn(move || ask_and_send(&purpose, &sender, &ctx));
        if spawned.is_err() {
            // The receiver finds its sender gone, which is answered as "unavailable".
        }
    }

    fn poll(&mut self) -> Option<(Purpose, Answer)> {
        let (purpose, receiver) = self.waiting.take()?;
        match receiver.try_recv() {
            Ok(answer) => Some((purpose, answer)),
            Err(std::sync::mpsc::TryRecvError::Empty) => {
                self.waiting = Some((purpose, receiver));
                None
            }
            Err(std::sync::mpsc::TryRecvError::Disconnected) => Some((purpose, Answer::Unavailable)),
        }
    }
}

fn ask_and_send(purpose: &Purpose, sender: &Sender<Answer>, ctx: &egui::Context) {
    let begun = Instant::now();
    let dialog = rfd::FileDialog::new().set_title(purpose.title());
    let files = match purpose {
        Purpose::OpenProject | Purpose::Compare => {
            dialog.add_filter("Frontalis project", &["frontalis", "json"]).pick_file().map(|f| vec![f])
        }
        Purpose::Subjects => dialog.add_filter("Frontalis project", &["frontalis", "json"]).pick_files(),
        Purpose::SaveProject { suggested, .. } => {
            dialog.add_filter("Frontalis project", &["frontalis"]).set_file_name(suggested).save_file().map(|f| vec![f])
        }
        Purpose::Frames => dialog.add_filter("Pictures", PICTURES).pick_files(),
        Purpose::Frame(_) => dialog.add_filter("Pictures", PICTURES).pick_file().map(|f| vec![f]),
        Purpose::OpenMesh => dialog.add_filter("Meshes", MESHES).pick_file().map(|f| vec![f]),
        Purpose::OpenStudy => dialog.add_filter("Table of a study", &["csv"]).pick_file().map(|f| vec![f]),
        Purpose::OpenFace => dialog.add_filter("Face model", &["json"]).pick_file().map(|f| vec![f]),
        Purpose::SaveFace { suggested, .. } => {
            dialog.add_filter("Face model", &["json"]).set_file_name(suggested).save_file().map(|f| vec![f])
        }
        Purpose::OpenExpression => dialog.add_filter("Expression", &["json"]).pick_file().map(|f| vec![f]),
        Purpose::SaveExpression { suggested } => {
            dialog.add_filter("Expression", &["json"]).set_file_name(suggested).save_file().map(|f| vec![f])
        }
        Purpose::Marks => dialog.add_filter("Marks", &["csv", "tps", "json"]).pick_file().map(|f| vec![f]),
        Purpose::Film => dialog.add_filter("Films", FILMS).add_filter("All files", &["*"]).pick_file().map(|f| vec![f]),
        Purpose::FrameFolder
        | Purpose::ExportFolder
        | Purpose::StillsFolder(_)
        | Purpose::PlayFolder
        | Purpose::StudyFolder => dialog.pick_folder().map(|f| vec![f]),
    };
    let answer = match files {
        Some(files) => Answer::Files(files),
        None if begun.elapsed() < FASTER_THAN_A_PERSON => Answer::Unavailable,
        None => Answer::Cancelled,
    };
    // The window may have been closed meanwhile; then nobody waits for the answer.
    let _ = sender.send(answer);
    ctx.request_repaint();
}
