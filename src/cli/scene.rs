//! A project with everything it names, opened and checked.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::CliError;
use crate::face::{self, FaceModel, import};
use crate::frames::Frame;
use crate::project::{FaceSource, FrameRef, FrameStatus, Project, file, frames_check, paths};

/// Size of the picture that is taken where a project names no first frame, px: that of the twins.
const SIZE_WITHOUT_FRAME: [u32; 2] = [1036, 1036];

/// A project, its face, and its first frame's size.
pub(super) struct Scene {
    pub(super) project: Project,
    pub(super) face: Arc<FaceModel>,
    pub(super) image_size_px: [u32; 2],
    /// What the report should say of the frames.
    pub(super) remarks: Vec<String>,
}

/// Whether the frames must be there and be the ones that were marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frames {
    Required,
    Ignored,
}

impl Scene {
    /// Opens a project; refuses values, marks and frames that cannot be right.
    pub(super) fn open(path: &Path, frames: Frames) -> Result<Self, CliError> {
        let project = file::load(path)?;
        let face = face_of(path, &project)?;
        file::check_bindings(path, &project, &face)?;
        let mut remarks = Vec::new();
        for (which, frame) in named_frames(&project) {
            match check_frame(path, which, frame) {
                Ok(()) => {}
                Err(e) if frames == Frames::Required => return Err(e),
                Err(CliError::FrameFile { which, status }) => remarks.push(format!("The {which} frame {status}.")),
                Err(e) => remarks.push(format!("{e}.")),
            }
        }
        let image_size_px = image_size_px(&project);
        Ok(Self { project, face, image_size_px, remarks })
    }

    /// The picture of the last frame, where it is there and the one that was marked.
    pub(super) fn last_frame(&self, path: &Path) -> Option<image::RgbImage> {
        let frame = self.project.frames.last.as_ref()?;
        check_frame(path, "last", frame).ok()?;
        Some(Frame::read(&paths::resolve(path, frame)).ok()?.into_image())
    }
}

/// The frames that a project names.
pub(super) fn named_frames(project: &Project) -> impl Iterator<Item = (&'static str, &FrameRef)> {
    let frames = &project.frames;
    [("first", frames.first.as_ref()), ("last", frames.last.as_ref())].into_iter().filter_map(|(w, f)| Some((w, f?)))
}

/// The size of the first frame.
pub(super) fn image_size_px(project: &Project) -> [u32; 2] {
    project.frames.first.as_ref().map_or(SIZE_WITHOUT_FRAME, |f| [f.width_px, f.height_px])
}

/// The face that a project is fitted with.
pub(super) fn face_of(path: &Path, project: &Project) -> Result<Arc<FaceModel>, CliError> {
    match &project.face {
        FaceSource::Generic => Ok(face::generic()),
        FaceSource::File { path: text, sha256 } => {
            let at = paths::resolve_text(path, text);
            match frames_check::status_at(at.clone(), sha256) {
                FrameStatus::Ok => Ok(Arc::new(face::file::read(&at)?)),
                status => Err(CliError::FaceChanged(status)),
            }
        }
    }
}

/// Refuses a frame that is missing, another one, damaged, or of another size.
pub(super) fn check_frame(path: &Path, which: &'static str, frame: &FrameRef) -> Result<(), CliError> {
    match frames_check::status(path, frame) {
        FrameStatus::Ok => {}
        status => return Err(CliError::FrameFile { which, status }),
    }
    let at = paths::resolve(path, frame);
    let picture = Frame::read(&at)?;
    if (picture.width(), picture.height()) == (frame.width_px, frame.height_px) {
        return Ok(());
    }
    Err(CliError::FrameSize {
        path: at,
        found_w: picture.width(),
        found_h: picture.height(),
        said_w: frame.width_px,
        said_h: frame.height_px,
    })
}

/// The face of an option `--face FILE` (a face model or a mesh), or the generic one.
pub(super) fn face_at(file: Option<&PathBuf>) -> Result<Arc<FaceModel>, CliError> {
    match file.filter(|path| !is_generic(path)) {
        None => Ok(face::generic()),
        Some(path) => any_face(path).map(Arc::new),
    }
}

/// Whether a path is the name by which `face list` calls the embedded face. A file of that name is the file.
pub(super) fn is_generic(path: &Path) -> bool {
    path.as_os_str() == "generic" && !path.exists()
}

/// A face model file, or a mesh of another program as a face without landmarks and muscles; what was repaired is said on stderr.
fn any_face(path: &Path) -> Result<FaceModel, CliError> {
    let bytes = face::file::read_bytes(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if import::Format::of(&bytes, &name).is_none() {
        return Ok(face::file::parse(&bytes, path)?);
    }
    let mesh = |source| CliError::Mesh { path: path.to_owned(), source };
    let imported = import::read(&bytes, &name, &import::ImportOptions::default()).map_err(mesh)?;
    for repair in &imported.repairs {
        eprintln!("note: {repair}");
    }
    imported.into_face(&name).map_err(|source| mesh(source.into()))
}
