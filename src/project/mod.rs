//! The project: what an annotator has said, how it changes, and how nothing of it is lost.

pub mod autosave;
pub mod document;
pub mod edit;
pub mod faults;
pub mod file;
pub mod frames_check;
pub mod history;
pub(crate) mod json;
pub mod paths;
pub mod recent;
pub mod sample;
pub mod whole_file;

pub use document::{
    CameraSettings, FaceSource, Feature, FieldWay, FramePair, FrameRef, Mark, MarkState, MuscleWay, Project, Role,
    Settings,
};
pub use edit::{Edit, EditError, PointId, Which};
pub use file::ProjectFileError;
pub use frames_check::{FrameStatus, find_by_hash};
pub use history::History;
pub use paths::resolve;
