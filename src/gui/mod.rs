//! The window: panels that read the project and ask for changes, and the one place that makes them.

pub mod action;
pub mod action_state;
pub mod action_table;
pub mod app;
pub mod command;
pub mod dialogs;
mod doubting;
pub mod export_expression;
pub mod export_results;
mod expression_commands;
mod expression_follow;
pub mod expression_ready;
pub mod expression_work;
pub mod face_drawing;
pub mod face_work;
pub mod files;
pub mod film_work;
mod guided;
pub mod height_map;
pub mod import_marks;
pub mod jobs;
pub mod keyboard;
pub mod keys;
pub mod modal;
pub mod muscle_work;
pub mod new_frames;
pub mod orbit_view;
pub mod panels;
pub mod pictures;
mod point_commands;
pub mod replay_work;
pub mod rescue;
mod run_command;
pub mod snapping;
mod solving;
pub mod study_work;
pub mod subjects_work;
pub mod suggesting;
pub mod texture;
pub mod theme;
pub mod view_state;
pub mod wheel;

pub use action::Action;
pub use app::App;
pub use command::Command;
pub use view_state::{Focus, ViewState, Workspace};

use std::path::PathBuf;
use std::sync::Arc;

use crate::face::FaceModel;
use crate::forces::Skin;
use crate::pipeline::Outcome;
use crate::project::Project;

/// What every panel may read.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// What the annotator has said.
    pub project: &'a Project,
    /// What the chain makes of it.
    pub outcome: &'a Outcome,
    /// The face that is fitted.
    pub face: &'a FaceModel,
    /// Places that are suggested for points without a mark: shown, never data.
    pub suggested: &'a suggesting::Suggested,
    /// The skin of the outcome.
    pub skin: Option<&'a Skin>,
    /// Whether the field is the measured one, and the muscles that the project asks for are still to come.
    pub fitting: bool,
    /// The simulated last frame, while it is to be shown.
    pub replay: Option<replay_work::Replayed<'a>>,
    /// Which face and which outcome these are.
    pub stamp: Stamp,
}

/// Tells a face and an outcome from those of other frames, so that what was made of them need not be made again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Changes with the face.
    pub face: u64,
    /// Changes with the outcome.
    pub outcome: u64,
}

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// The system gave none.
    #[error("no window could be opened: {0}")]
    NoWindow(String),
    /// The project cannot be opened: one line.
    #[error("{0}")]
    Project(String),
}

/// Opens the window on a project file, or on the embedded sample, and returns when it is closed.
///
/// # Errors
/// When the project cannot be opened, or there is no display or no way to draw on it.
pub fn start(path: Option<PathBuf>) -> Result<(), WindowError> {
    let Some(path) = path else {
        let sample = crate::project::sample::project().map_err(|e| WindowError::Project(e.to_string()))?;
        return run(sample, None, crate::face::generic(), None);
    };
    match files::read_project(&path) {
        Ok((project, face)) => run(project, Some(path), face, None),
        // With work beside it that can be taken instead, the window opens and asks.
        Err(why) if !rescue::found_beside(&path).is_empty() => {
            run(Project::default(), None, crate::face::generic(), Some((path, why)))
        }
        Err(why) => Err(WindowError::Project(why)),
    }
}

/// Opens the window on a project and returns when it is closed. Unsaved work is kept safe meanwhile. `spoilt` is a project that cannot
/// be read, with the reason.
fn run(
    project: Project,
    path: Option<PathBuf>,
    face: Arc<FaceModel>,
    spoilt: Option<(PathBuf, String)>,
) -> Result<(), WindowError> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Frontalis")
        .with_app_id("frontalis")
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([900.0, 600.0])
        .with_drag_and_drop(true);
    // Pixels are shown as they are in the file: dithering would change them by a level here and there.
    let options = eframe::NativeOptions { viewport, dithering: false, ..eframe::NativeOptions::default() };
    let create = move |cc: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, BoxedError> {
        theme::install(&cc.egui_ctx);
        let mut app = App::new(project, path, face, Box::<dialogs::NativeDialogs>::default()).with_autosave();
        if let Some((path, why)) = spoilt {
            app.offer_rescue(&path, why);
        }
        Ok(Box::new(app))
    };
    eframe::run_native("Frontalis", options, Box::new(create)).map_err(|e| WindowError::NoWindow(e.to_string()))
}

type BoxedError = Box<dyn std::error::Error + Send + Sync>;
