//! The pixels of the two frames: read when the project names them, adjusted when the person wants, shown by the panes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbImage;

use super::jobs::{Finished, Jobs};
use super::texture::Tiles;
use crate::frames::{Adjustment, Frame};
use crate::project::{FrameRef, Project, Which, sample};

/// The pictures of both frames.
pub struct Pictures {
    pictures: [Picture; 2],
}

/// The picture of one frame.
pub struct Picture {
    /// What the project names.
    wanted: Option<FrameRef>,
    state: State,
    tiles: Tiles,
}

enum State {
    Empty,
    Reading,
    Ready { sha256: String, pixels: Arc<RgbImage>, shown: Adjustment, adjusting: bool },
    Failed(String),
}

/// What a pane can say of its picture.
pub enum PictureStatus<'a> {
    /// The project names none.
    Empty,
    /// It is being read.
    Reading,
    /// It is there; `changed` when its file is not the one that was marked.
    Ready {
        /// Whether the file has another hash than the project says.
        changed: bool,
    },
    /// It cannot be read: one line.
    Failed(&'a str),
}

impl Default for Pictures {
    fn default() -> Self {
        let picture = |name| Picture { wanted: None, state: State::Empty, tiles: Tiles::new(name) };
        Self { pictures: [picture("first frame"), picture("last frame")] }
    }
}

impl Pictures {
    /// The picture of a frame.
    pub fn get(&self, which: Which) -> &Picture {
        &self.pictures[which as usize]
    }

    /// Reads what the project names and is not here yet, adjusts what is to be shown otherwise, and uploads the next tiles.
    pub fn follow(
        &mut self,
        project: &Project,
        resolve: &dyn Fn(&FrameRef) -> PathBuf,
        wanted: [Adjustment; 2],
        ctx: &egui::Context,
        jobs: &mut Jobs,
    ) {
        for which in [Which::First, Which::Last] {
            let picture = &mut self.pictures[which as usize];
            let named = match which {
                Which::First => project.frames.first.as_ref(),
                Which::Last => project.frames.last.as_ref(),
            };
            picture.follow_project(which, named, resolve, ctx, jobs);
            picture.adjust(which, wanted[which as usize], ctx, jobs);
            if picture.tiles.upload_next(ctx) {
                ctx.request_repaint();
            }
        }
    }

    /// Takes what a job has brought back for the picture that is wanted; another one is dropped.
    pub fn frame_read(&mut self, which: Which, result: Result<Frame, String>) {
        self.pictures[which as usize].take(result);
    }

    /// Takes an adjusted picture.
    pub fn adjusted(&mut self, which: Which, of: &str, adjustment: Adjustment, new: RgbImage) {
        let picture = &mut self.pictures[which as usize];
        if let State::Ready { sha256, shown, adjusting, .. } = &mut picture.state
            && sha256 == of
        {
            (*shown, *adjusting) = (adjustment, false);
            picture.tiles.set(Arc::new(new));
        }
    }

    /// Tries again to read a picture that could not be read.
    pub fn forget(&mut self, which: Which) {
        self.pictures[which as usize].wanted = None;
        self.pictures[which as usize].state = State::Empty;
    }
}

impl Picture {
    /// What can be said of it.
    pub fn status(&self) -> PictureStatus<'_> {
        match &self.state {
            State::Empty => PictureStatus::Empty,
            State::Reading => PictureStatus::Reading,
            State::Ready { sha256, .. } => {
                PictureStatus::Ready { changed: self.wanted.as_ref().is_some_and(|w| &w.sha256 != sha256) }
            }
            State::Failed(why) => PictureStatus::Failed(why),
        }
    }

    /// Its tiles, to draw.
    pub fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Its size, px; that of the project's frame while it is being read.
    pub fn size(&self) -> Option<[u32; 2]> {
        match &self.state {
            State::Ready { .. } => Some(self.tiles.size()),
            _ => self.wanted.as_ref().map(|w| [w.width_px, w.height_px]),
        }
    }

    fn take(&mut self, result: Result<Frame, String>) {
        self.state = match result {
            Ok(frame) => {
                let sha256 = frame.sha256().to_owned();
                let pixels = Arc::new(frame.into_image());
                self.tiles.set(Arc::clone(&pixels));
                State::Ready { sha256, pixels, shown: Adjustment::default(), adjusting: false }
            }
            Err(why) => State::Failed(why),
        };
    }

    fn follow_project(
        &mut self,
        which: Which,
        named: Option<&FrameRef>,
        resolve: &dyn Fn(&FrameRef) -> PathBuf,
        ctx: &egui::Context,
        jobs: &mut Jobs,
    ) {
        if self.wanted.as_ref() == named {
            return;
        }
        self.wanted = named.cloned();
        let Some(named) = named else {
            self.state = State::Empty;
            self.tiles = Tiles::new(which.word());
            return;
        };
        // Only moved on disk, or just read because a person chose it.
        if matches!(&self.state, State::Ready { sha256, .. } if sha256 == &named.sha256) {
            return;
        }
        self.state = State::Reading;
        let path = resolve(named);
        match sample::frame_bytes(named) {
            Some(bytes) => jobs.start(ctx, format!("Reading the sample's {} frame", which.word()), move |_| {
                let result = Frame::decode(&path, bytes).map_err(|e| e.to_string());
                Some(Finished::Frame { which, path, chosen: false, result })
            }),
            None => read(which, path, false, ctx, jobs),
        }
    }

    fn adjust(&mut self, which: Which, wanted: Adjustment, ctx: &egui::Context, jobs: &mut Jobs) {
        let State::Ready { sha256, pixels, shown, adjusting } = &mut self.state else { return };
        if *adjusting || *shown == wanted {
            return;
        }
        if wanted.is_identity() {
            *shown = wanted;
            self.tiles.set(Arc::clone(pixels));
            return;
        }
        *adjusting = true;
        let (sha256, pixels) = (sha256.clone(), Arc::clone(pixels));
        jobs.start(ctx, format!("Adjusting the {} frame", which.word()), move |_| {
            let pixels = wanted.apply(&pixels);
            Some(Finished::Adjusted { which, sha256, adjustment: wanted, pixels })
        });
    }
}

/// Begins to read a picture.
pub fn read(which: Which, path: PathBuf, chosen: bool, ctx: &egui::Context, jobs: &mut Jobs) {
    let name = format!("Reading {}", file_name(&path));
    jobs.start(ctx, name, move |progress| {
        let result = Frame::read(&path).map_err(|e| e.to_string());
        (!progress.is_cancelled()).then_some(Finished::Frame { which, path, chosen, result })
    });
}

/// The last part of a path, for people.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
