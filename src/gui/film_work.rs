//! A film while its first and last frame are chosen: looked through by one job, read for previews by another, both without holding the window up.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::RgbImage;

use super::app::App;
use super::dialogs::Purpose;
use super::jobs::{About, Finished, Progress};
use super::modal::Modal;
use super::panels::film_strip::FilmView;
use super::pictures::file_name;
use super::{Command, pictures};
use crate::frames::film::{Film, FilmError, still_png};
use crate::frames::motion::Motion;
use crate::frames::{FrameSequence, strip};
use crate::project::Which;
use crate::project::whole_file::{self, Durability, folder_of};

/// Longer side of a preview, px: larger than it is shown on most screens.
const PREVIEW_PX: u32 = 960;

/// Frames read about the one asked for, so that the next steps are there at once.
const AROUND: usize = 6;

/// Previews kept in memory: some 60 MB.
const KEPT: usize = 36;

/// A film that is looked through; shared between the window and its jobs.
#[derive(Clone)]
pub struct Looking(Arc<Shared>);

struct Shared {
    path: PathBuf,
    /// Pictures of a folder, which need not be copied.
    sequence: Option<FrameSequence>,
    given_up: AtomicBool,
    known: Mutex<Known>,
    /// The film for previews, while no job has it.
    film: Mutex<Option<Film>>,
}

/// What is known of a film so far.
#[derive(Debug, Default)]
pub struct Known {
    /// Size of its frames, px; absent until it is open.
    pub size: Option<[u32; 2]>,
    /// When each frame is shown, s; empty where the file does not say so.
    pub times_s: Vec<f64>,
    /// Its key frames; empty where all are alike, or nothing says.
    pub keys: Vec<usize>,
    /// How many frames it has.
    pub count: usize,
    /// Frames looked at.
    pub seen: usize,
    /// Small pictures by frame.
    pub thumbnails: Vec<(usize, RgbImage)>,
    /// What changed from frame to frame, so far: frame, grey levels.
    pub speed: Vec<(usize, f64)>,
    /// Once it is looked through.
    pub motion: Option<Motion>,
    /// What should be said of it.
    pub remark: Option<String>,
    /// Larger pictures by frame.
    pub previews: BTreeMap<usize, RgbImage>,
    /// Frames whose preview cannot be had: why.
    pub unreadable: BTreeMap<usize, String>,
    /// Frames whose preview is wanted.
    pub wanted: [usize; 2],
    /// A job is reading previews.
    reading: bool,
}

impl std::fmt::Debug for Looking {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Looking({})", self.0.path.display())
    }
}

impl PartialEq for Looking {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Looking {
    /// The film or folder.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// Whether it is a folder of pictures.
    pub fn is_folder(&self) -> bool {
        self.0.sequence.is_some()
    }

    /// The frames proposed before anything is known of the motion: those of a folder by their numbers.
    pub fn proposed_by_names(&self) -> Option<[usize; 2]> {
        self.0.sequence.as_ref().map(|s| [s.first(), s.last()])
    }

    /// What is known so far.
    pub fn known(&self) -> MutexGuard<'_, Known> {
        self.0.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Nobody wants it any more: its jobs end.
    pub fn give_up(&self) {
        self.0.given_up.store(true, Ordering::Relaxed);
    }

    fn given_up(&self) -> bool {
        self.0.given_up.load(Ordering::Relaxed)
    }

    /// Looks the film through; `progress` follows.
    fn look(&self, ctx: &egui::Context, progress: &Progress) -> Result<(), FilmError> {
        let stop = || self.given_up() || progress.is_cancelled();
        let mut film = Film::open(&self.0.path, &stop)?;
        let count = film.len();
        {
            let mut known = self.known();
            known.size = Some(film.size());
            known.times_s = (0..count).map_while(|i| film.time_s(i)).collect();
            known.keys = film.key_frames();
            known.count = count;
            known.remark = film.remark().map(str::to_owned);
        }
        let mut due = std::time::Instant::now();
        let scan = strip::scan(&mut film, &stop, &mut |seen| {
            let mut known = self.known();
            known.seen = seen.index + 1;
            known.speed.extend(seen.speed.map(|s| (seen.index, s)));
            known.thumbnails.extend(seen.thumbnail.map(|t| (seen.index, t)));
            progress.set((seen.index + 1) as f64 / count as f64);
            if due.elapsed().as_millis() > 60 {
                due = std::time::Instant::now();
                ctx.request_repaint();
            }
        })?;
        let mut known = self.known();
        known.count = scan.count;
        if let Some(why) = scan.broken {
            known.remark = Some(why.to_string());
        }
        known.motion = Some(scan.motion);
        drop(known);
        *self.0.film.lock().unwrap_or_else(PoisonError::into_inner) = Some(film);
        Ok(())
    }

    /// A wanted frame without a preview.
    fn missing(&self) -> Option<usize> {
        let known = self.known();
        let there = |i: &usize| known.previews.contains_key(i) || known.unreadable.contains_key(i) || *i >= known.count;
        known.wanted.iter().copied().find(|i| !there(i))
    }

    /// Reads previews until none is wanted.
    fn read_previews(&self, ctx: &egui::Context, progress: &Progress) {
        let stop = || self.given_up() || progress.is_cancelled();
        let held = self.0.film.lock().unwrap_or_else(PoisonError::into_inner).take();
        let opened = held.map_or_else(|| Film::open(&self.0.path, &stop), Ok);
        if let Ok(mut film) = opened {
            let by = film.divisor(PREVIEW_PX);
            while let Some(wanted) = self.missing().filter(|_| !stop()) {
                let from = wanted.saturating_sub(AROUND);
                let done = film.each(from, by, &stop, &mut |index, image| {
                    let mut known = self.known();
                    known.previews.insert(index, image);
                    known.forget_far_ones();
                    // Another frame may be wanted by now.
                    let enough = index >= wanted + AROUND || (index >= wanted && !known.wanted.contains(&wanted));
                    ctx.request_repaint();
                    if enough { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) }
                });
                if !self.known().previews.contains_key(&wanted) {
                    let why = done.err().map_or_else(|| "it is not there".to_owned(), |e| e.to_string());
                    self.known().unreadable.insert(wanted, why);
                }
            }
            *self.0.film.lock().unwrap_or_else(PoisonError::into_inner) = Some(film);
        }
        self.known().reading = false;
        ctx.request_repaint();
    }
}

impl Known {
    /// Of too many previews, those farthest from the frames wanted go.
    fn forget_far_ones(&mut self) {
        let wanted = self.wanted;
        let far = |i: usize| wanted.iter().map(|w| w.abs_diff(i)).min().unwrap_or(0);
        while self.previews.len() > KEPT {
            let Some(&farthest) = self.previews.keys().max_by_key(|i| far(**i)) else { return };
            self.previews.remove(&farthest);
        }
    }
}

/// Two frames of a film that are to become pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stills {
    /// The film.
    pub film: PathBuf,
    /// Indices of the first and the last frame.
    pub frames: [usize; 2],
}

impl App {
    /// Opens a film or a folder of numbered pictures, to choose two of its frames.
    pub(super) fn open_film(&mut self, path: PathBuf, ctx: &egui::Context) {
        let sequence = if path.is_dir() {
            match FrameSequence::open(&path) {
                Ok(sequence) => Some(sequence),
                Err(e) => return self.fail("The folder cannot be used", e.to_string()),
            }
        } else {
            None
        };
        let name = format!("Looking through {}", file_name(&path));
        self.suggesting.know_film(&path);
        let looking = Looking(Arc::new(Shared {
            path,
            sequence,
            given_up: AtomicBool::new(false),
            known: Mutex::default(),
            film: Mutex::default(),
        }));
        self.view.modal = Some(Modal::Film(FilmView::new(looking.clone())));
        let shared = ctx.clone();
        self.jobs.start(ctx, name, About::Person, move |progress| {
            let result = looking.look(&shared, progress);
            if result.is_err() {
                looking.give_up();
            }
            match result {
                Err(FilmError::Stopped) => None,
                result => Some(Finished::Film(looking, result.map_err(|e| e.to_string()))),
            }
        });
    }

    /// A film was looked through, or cannot be.
    pub(super) fn film_looked_through(&mut self, looking: &Looking, result: Result<(), String>) {
        let shown = matches!(&self.view.modal, Some(Modal::Film(view)) if view.looking() == looking);
        if let Err(why) = result
            && shown
        {
            self.view.modal = None;
            self.fail("The film cannot be used", why);
        }
    }

    /// Reads the previews that the open dialog wants.
    pub(super) fn follow_film(&mut self, ctx: &egui::Context) {
        let Some(Modal::Film(view)) = &self.view.modal else { return };
        let looking = view.looking().clone();
        if looking.missing().is_none() || std::mem::replace(&mut looking.known().reading, true) {
            return;
        }
        let shared = ctx.clone();
        self.jobs.start(ctx, "Reading frames", About::Person, move |progress| {
            looking.read_previews(&shared, progress);
            None
        });
    }

    /// Makes two frames of a film the frames of the project.
    pub(super) fn use_film_frames(&mut self, looking: &Looking, frames: [usize; 2], ctx: &egui::Context) {
        if let Some(sequence) = &looking.0.sequence {
            for (which, at) in [Which::First, Which::Last].into_iter().zip(frames) {
                if let Some(path) = sequence.paths().get(at) {
                    self.commands.push(Command::LoadFrame(which, path.clone()));
                }
            }
            return;
        }
        let stills = Stills { film: looking.path().to_owned(), frames };
        let folder = folder_of(self.document.path.as_deref().unwrap_or(&stills.film));
        self.write_stills(stills, folder, ctx);
    }

    /// Writes two frames of a film into a folder as pictures.
    pub(super) fn write_stills(&mut self, stills: Stills, folder: PathBuf, ctx: &egui::Context) {
        let name = format!("Taking two frames out of {}", file_name(&stills.film));
        self.jobs.start(ctx, name, About::Person, move |progress| {
            let result = write_stills(&stills, &folder, progress);
            (!progress.is_cancelled()).then_some(Finished::Stills(stills, result))
        });
    }

    /// The two pictures are written, or the folder does not take them.
    pub(super) fn stills_written(
        &mut self,
        stills: Stills,
        result: Result<[PathBuf; 2], NotWritten>,
        ctx: &egui::Context,
    ) {
        match result {
            Ok(paths) => {
                for (which, path) in [Which::First, Which::Last].into_iter().zip(paths) {
                    pictures::read(which, pictures::Source::File(path), true, ctx, &mut self.jobs);
                }
            }
            Err(NotWritten::Folder(_)) => self.dialogs.ask(ctx, Purpose::StillsFolder(stills)),
            Err(NotWritten::Film(why)) => self.fail("The frames cannot be used", why),
        }
    }
}

/// Why two frames did not become pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NotWritten {
    /// The folder does not take them: what the system says. Another folder may.
    Folder(String),
    /// The film does not give them: one line.
    Film(String),
}

fn write_stills(stills: &Stills, folder: &Path, progress: &Progress) -> Result<[PathBuf; 2], NotWritten> {
    let stop = || progress.is_cancelled();
    let said = |e: FilmError| NotWritten::Film(e.to_string());
    let mut film = Film::open(&stills.film, &stop).map_err(said)?;
    let stem = stills.film.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut write = |index: usize| {
        let image = film.frame(index, &stop).map_err(said)?;
        let bytes = still_png(&image, &film.origin(index)).map_err(|e| NotWritten::Film(e.to_string()))?;
        let numbered = |n: usize| if n == 1 { String::new() } else { format!("-{n}") };
        let names = (1..=MOST_OF_A_NAME).map(|n| folder.join(format!("{stem}-{:06}{}.png", index + 1, numbered(n))));
        // A picture that is there and is another one is never overwritten; the same one is used again.
        let same = |path: &Path| std::fs::read(path).is_ok_and(|there| there == bytes);
        let path = names.into_iter().find(|p| !p.exists() || same(p));
        let path = path.ok_or_else(|| NotWritten::Folder("too many pictures of that name".to_owned()))?;
        if !path.exists() {
            let written = whole_file::write(&path, &bytes, Durability::Disk);
            written.map_err(|e| NotWritten::Folder(e.to_string()))?;
        }
        progress.set(0.5);
        Ok(path)
    };
    Ok([write(stills.frames[0])?, write(stills.frames[1])?])
}

/// Pictures of one name in a folder before another folder is asked for.
const MOST_OF_A_NAME: usize = 99;
