//! The pixels of the two frames: read when the project names them, adjusted when the person wants, shown by the panes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbImage;

use super::jobs::{About, Finished, Jobs};
use super::texture::Tiles;
use crate::frames::{Adjustment, Frame};
use crate::project::{FrameRef, Project, Which, sample};

/// The pictures of both frames.
pub struct Pictures {
    pictures: [Picture; 2],
}

/// The picture of one frame. Its pixels live on the graphics card; here only while they are adjusted.
pub struct Picture {
    /// What the project names.
    wanted: Option<FrameRef>,
    state: State,
    tiles: Tiles,
}

enum State {
    Empty,
    Reading,
    Ready(Ready),
    Failed(String),
}

struct Ready {
    sha256: String,
    source: Source,
    /// The pixels as they are in the file, while a slider is moved.
    pixels: Option<Arc<RgbImage>>,
    shown: Adjustment,
    adjusting: bool,
    /// Time of the window at which another adjustment was last wanted, s.
    changed_at: f64,
}

/// So long after the last change the pixels beside the graphics card are given up, s: reading them again takes less than that.
const KEPT_S: f64 = 4.0;

/// Where the bytes of a picture are.
#[derive(Clone, Debug)]
pub enum Source {
    /// In a file.
    File(PathBuf),
    /// In the program: a frame of the sample, under that name.
    Sample(PathBuf, &'static [u8]),
}

impl Source {
    /// Where the frame of a project is, when its path leads there.
    fn of(frame: &FrameRef, path: PathBuf) -> Self {
        match sample::frame_bytes(frame) {
            Some(bytes) => Self::Sample(path, bytes),
            None => Self::File(path),
        }
    }

    /// Its path, which serves messages alone for a frame of the sample.
    pub fn path(&self) -> &Path {
        match self {
            Self::File(path) | Self::Sample(path, _) => path,
        }
    }

    /// Reads the picture; long work.
    pub(super) fn read(&self) -> Result<Frame, String> {
        let frame = match self {
            Self::File(path) => Frame::read(path),
            Self::Sample(path, bytes) => Frame::decode(path, bytes),
        };
        frame.map_err(|e| e.to_string())
    }
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
    pub fn frame_read(&mut self, which: Which, source: Source, result: Result<Frame, String>) {
        self.pictures[which as usize].take(source, result);
    }

    /// Takes an adjusted picture, with the pixels that it was made from.
    pub fn adjusted(&mut self, which: Which, of: &str, adjustment: Adjustment, result: Result<Adjusted, String>) {
        let picture = &mut self.pictures[which as usize];
        let State::Ready(ready) = &mut picture.state else { return };
        if ready.sha256 != of {
            return;
        }
        ready.adjusting = false;
        match result {
            Ok(Adjusted { original, shown }) => {
                (ready.shown, ready.pixels) = (adjustment, original);
                picture.tiles.set(Arc::new(shown));
            }
            Err(why) => picture.state = State::Failed(why),
        }
    }

    /// Gives up what the person has stopped; returns how the picture is shown now.
    pub fn stopped(&mut self, which: Which) -> Adjustment {
        let state = &mut self.pictures[which as usize].state;
        match state {
            State::Ready(ready) => {
                ready.adjusting = false;
                return ready.shown;
            }
            State::Reading => *state = State::Failed("The reading was stopped.".to_owned()),
            State::Empty | State::Failed(_) => {}
        }
        Adjustment::default()
    }
}

impl Picture {
    /// What can be said of it.
    pub fn status(&self) -> PictureStatus<'_> {
        match &self.state {
            State::Empty => PictureStatus::Empty,
            State::Reading => PictureStatus::Reading,
            State::Ready(ready) => {
                PictureStatus::Ready { changed: self.wanted.as_ref().is_some_and(|w| w.sha256 != ready.sha256) }
            }
            State::Failed(why) => PictureStatus::Failed(why),
        }
    }

    /// Where its pixels come from, and their hash, once it is there.
    pub(super) fn source(&self) -> Option<(&Source, &str)> {
        if let State::Ready(ready) = &self.state { Some((&ready.source, &ready.sha256)) } else { None }
    }

    /// Its tiles, to draw.
    pub fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Its size, px; that of the project's frame while it is being read.
    pub fn size(&self) -> Option<[u32; 2]> {
        match &self.state {
            State::Ready(_) => Some(self.tiles.size()),
            _ => self.wanted.as_ref().map(|w| [w.width_px, w.height_px]),
        }
    }

    fn take(&mut self, source: Source, result: Result<Frame, String>) {
        self.state = match result {
            Ok(frame) => {
                let sha256 = frame.sha256().to_owned();
                self.tiles.set(Arc::new(frame.into_image()));
                State::Ready(Ready {
                    sha256,
                    source,
                    pixels: None,
                    shown: Adjustment::default(),
                    adjusting: false,
                    changed_at: f64::NEG_INFINITY,
                })
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
        if matches!(&self.state, State::Ready(ready) if ready.sha256 == named.sha256) {
            return;
        }
        self.state = State::Reading;
        read(which, Source::of(named, resolve(named)), false, ctx, jobs);
    }

    fn adjust(&mut self, which: Which, wanted: Adjustment, ctx: &egui::Context, jobs: &mut Jobs) {
        let State::Ready(ready) = &mut self.state else { return };
        let now = ctx.input(|i| i.time);
        if ready.adjusting {
            return;
        }
        if ready.shown == wanted {
            if ready.pixels.is_some() && now - ready.changed_at > KEPT_S {
                ready.pixels = None;
            } else if ready.pixels.is_some() {
                ctx.request_repaint_after_secs((KEPT_S + 0.1) as f32);
            }
            return;
        }
        // A second change soon after the first is a slider in motion, for which the file is not read again and again.
        let keeps = now - ready.changed_at < KEPT_S;
        ready.changed_at = now;
        if wanted.is_identity()
            && let Some(pixels) = ready.pixels.take()
        {
            ready.shown = wanted;
            self.tiles.set(pixels);
            return;
        }
        ready.adjusting = true;
        let (sha256, source, kept) = (ready.sha256.clone(), ready.source.clone(), ready.pixels.clone());
        jobs.start(ctx, format!("Adjusting the {} frame", which.word()), About::Picture(which), move |progress| {
            let result = adjusted(kept, &source, &sha256, wanted, keeps);
            (!progress.is_cancelled()).then_some(Finished::Adjusted { which, sha256, adjustment: wanted, result })
        });
    }
}

/// An adjusted picture.
#[derive(Debug)]
pub struct Adjusted {
    /// As it is in its file, if it will soon be wanted again.
    pub original: Option<Arc<RgbImage>>,
    /// As it is to be shown.
    pub shown: RgbImage,
}

/// Adjusts the pixels that are kept, or those of the file. Unless they are to be kept, there is never more than one picture in memory.
fn adjusted(
    kept: Option<Arc<RgbImage>>,
    source: &Source,
    sha256: &str,
    wanted: Adjustment,
    keeps: bool,
) -> Result<Adjusted, String> {
    if let Some(original) = kept {
        let shown = wanted.apply(&original);
        return Ok(Adjusted { original: Some(original), shown });
    }
    let frame = source.read()?;
    if frame.sha256() != sha256 {
        return Err(format!("{}: was replaced by another picture meanwhile; open it again", source.path().display()));
    }
    let mut shown = frame.into_image();
    let original = keeps.then(|| Arc::new(shown.clone()));
    wanted.apply_in_place(&mut shown);
    Ok(Adjusted { original, shown })
}

/// Begins to read a picture; `chosen`: because a person named it now.
pub fn read(which: Which, source: Source, chosen: bool, ctx: &egui::Context, jobs: &mut Jobs) {
    let name = format!("Reading {}", file_name(source.path()));
    jobs.start(ctx, name, About::Picture(which), move |progress| {
        let result = source.read();
        (!progress.is_cancelled()).then_some(Finished::Frame { which, source, chosen, result })
    });
}

/// The last part of a path, for people.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
