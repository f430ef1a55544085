//! Films: their frames by number, in the order of showing, read from the file one at a time; never a whole film in memory.
//!
//! H.264 in MP4, Motion JPEG and uncompressed AVI, GIF, APNG and folders of numbered pictures are decoded here. Any other film goes through the
//! program `ffmpeg`, where there is one on the search path.

mod animation;
mod avi;
mod boxes;
mod colour;
mod ffmpeg;
mod index;
mod mp4;
mod parameters;
mod still;
mod write;

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use image::RgbImage;
use image::imageops::{self, FilterType};

use super::frame::MAX_SIDE_PX;
use super::{Compression, Frame, FrameSequence};

pub use still::{Origin, still_png};
pub use write::{FilmWriter, WriteError};

/// Endings of the films that are offered to be opened; any file can be.
pub const ENDINGS: &[&str] = &["mp4", "mov", "m4v", "avi", "gif", "apng", "mkv", "webm", "mpg", "mpeg", "mts", "wmv"];

/// Takes a frame with its number; breaks when it has seen enough.
pub type Take<'a> = &'a mut dyn FnMut(usize, RgbImage) -> ControlFlow<()>;

/// A film, opened. Numbers of frames begin at 0 here and at 1 for people.
pub struct Film {
    path: PathBuf,
    pictures: Box<dyn Pictures>,
    upright: Upright,
    /// What should be said of it: "the file is cut short".
    remark: Option<String>,
}

/// Why a film cannot be opened or read: which file, what is wrong, what to do, in one line.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// No such file.
    #[error("{}: there is no such file; check the path", path.display())]
    NotFound {
        /// The file.
        path: PathBuf,
    },
    /// The system did not let it be read, or it is no ordinary file.
    #[error("{}: it cannot be read ({reason}); check the permissions and the disk", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: std::io::Error,
    },
    /// Nothing in it.
    #[error("{}: the file is empty; copy it again from its source", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The folder is no sequence of pictures.
    #[error(transparent)]
    Folder(#[from] super::SequenceError),
    /// A picture of a folder cannot be read.
    #[error(transparent)]
    Picture(#[from] super::FrameError),
    /// There are no moving pictures in it.
    #[error("{}: there is no video in this file; choose the film itself", path.display())]
    NoVideo {
        /// The file.
        path: PathBuf,
    },
    /// No frame can be read.
    #[error("{}: the film has no frame that can be read; copy it again from its source", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
    },
    /// A motion needs two frames.
    #[error("{}: there is only one frame in it; a motion needs a first and a last", path.display())]
    OnlyOne {
        /// The file.
        path: PathBuf,
    },
    /// More pixels than are accepted; nothing was decoded.
    #[error("{}: its frames are {width} × {height} px and the limit is {MAX_SIDE_PX} × {MAX_SIDE_PX} px; scale the film down", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Declared width, px.
        width: u32,
        /// Declared height, px.
        height: u32,
    },
    /// More frames than any film has.
    #[error("{}: it declares {count} frames and the limit is {}; cut the film, or copy it again", path.display(), index::MAX_FRAMES)]
    TooManyFrames {
        /// The file.
        path: PathBuf,
        /// How many.
        count: u64,
    },
    /// The file contradicts itself or breaks off.
    #[error("{}: the film is damaged ({what}); copy or export it again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// One frame cannot be read.
    #[error("{}: frame {number} cannot be read ({reason}); choose frames before it, or copy the film again", path.display())]
    BadFrame {
        /// The file.
        path: PathBuf,
        /// Its number, from 1.
        number: usize,
        /// What the decoder says.
        reason: String,
    },
    /// Not read here, and nobody else is there to do it.
    #[error("{}: this is {what}, which is not read here; install ffmpeg (its programs ffmpeg and ffprobe on the search path), or convert the film to H.264 in an MP4 file", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// "HEVC video".
        what: String,
    },
    /// The program that was to decode it could not.
    #[error("{}: ffmpeg cannot read it ({reason}); convert the film to H.264 in an MP4 file", path.display())]
    Ffmpeg {
        /// The file.
        path: PathBuf,
        /// What it says.
        reason: String,
    },
    /// Such a frame does not exist.
    #[error("{}: there is no frame {number}; the film has frames 1 to {count}", path.display())]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// The person did not want it any more.
    #[error("the reading was stopped")]
    Stopped,
}

/// Where frames come from.
trait Pictures: Send {
    /// How many there are.
    fn count(&self) -> usize;
    /// When a frame is shown, s from the first; absent where the file does not say so.
    fn time_s(&self, index: usize) -> Option<f64>;
    /// What a frame owes to others.
    fn compression(&self, _index: usize) -> Compression {
        Compression::Unknown
    }
    /// Size as coded, px.
    fn size(&self) -> [u32; 2];
    /// Hands over every frame from `from` on, with its sides divided by `by`.
    fn each(
        &mut self,
        path: &Path,
        from: usize,
        by: usize,
        stop: &dyn Fn() -> bool,
        take: Take<'_>,
    ) -> Result<(), FilmError>;
}

/// What makes a coded picture upright and its pixels square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Upright {
    quarter_turns: u8,
    pixel_aspect: [u32; 2],
}

impl Upright {
    const AS_IT_LIES: Self = Self { quarter_turns: 0, pixel_aspect: [1, 1] };

    /// The size of a picture whose pixels have become square; unlikely aspects are passed over.
    fn squared(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        let [a, b] = self.pixel_aspect;
        let wide = (u64::from(width) * u64::from(a) + u64::from(b) / 2) / u64::from(b.max(1));
        let sensible = a > 0 && b > 0 && a / b < 4 && b / a < 4 && wide > 0 && wide <= u64::from(MAX_SIDE_PX);
        if sensible { [wide as u32, height] } else { [width, height] }
    }

    fn size(&self, size: [u32; 2]) -> [u32; 2] {
        let [width, height] = self.squared(size);
        if self.quarter_turns % 2 == 1 { [height, width] } else { [width, height] }
    }

    fn apply(&self, image: RgbImage) -> RgbImage {
        let size = [image.width(), image.height()];
        let squared = self.squared(size);
        let image = if squared == size {
            image
        } else {
            imageops::resize(&image, squared[0], squared[1], FilterType::CatmullRom)
        };
        match self.quarter_turns {
            1 => imageops::rotate90(&image),
            2 => imageops::rotate180(&image),
            3 => imageops::rotate270(&image),
            _ => image,
        }
    }
}

/// What a file turned out to be.
enum Own {
    /// A film that is read here.
    Film(Film),
    /// Something else: what.
    Other(String),
}

impl Film {
    /// Opens a film, or a folder of numbered pictures. `stop` is asked now and then whether to give up.
    ///
    /// # Errors
    /// Every case of [`FilmError`] but [`FilmError::BadFrame`]: nothing is decoded yet, but for a film that `ffmpeg` reads.
    pub fn open(path: &Path, stop: &dyn Fn() -> bool) -> Result<Self, FilmError> {
        let film = Self::open_any(path, stop)?;
        match film.len() {
            0 => Err(FilmError::NoFrames { path: path.to_owned() }),
            1 => Err(FilmError::OnlyOne { path: path.to_owned() }),
            _ => Ok(film),
        }
    }

    fn open_any(path: &Path, stop: &dyn Fn() -> bool) -> Result<Self, FilmError> {
        let what = match Self::open_own(path)? {
            Own::Film(film) => return Ok(film),
            Own::Other(what) => what,
        };
        match ffmpeg::Piped::open(path, stop)? {
            Some(film) => Ok(Self::new(path, Box::new(film), Upright::AS_IT_LIES)),
            None => Err(FilmError::Unsupported { path: path.to_owned(), what }),
        }
    }

    fn new(path: &Path, pictures: Box<dyn Pictures>, upright: Upright) -> Self {
        Self { path: path.to_owned(), pictures, upright, remark: None }
    }

    /// A film of a kind that is read here, or what it is otherwise.
    fn open_own(path: &Path) -> Result<Own, FilmError> {
        let unreadable = |reason: std::io::Error| match reason.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => FilmError::NotFound { path: path.to_owned() },
            _ => FilmError::Unreadable { path: path.to_owned(), reason },
        };
        let made = |pictures: Box<dyn Pictures>| Ok(Own::Film(Self::new(path, pictures, Upright::AS_IT_LIES)));
        let only_one = || FilmError::OnlyOne { path: path.to_owned() };
        let metadata = path.metadata().map_err(unreadable)?;
        if metadata.is_dir() {
            return Ok(Own::Film(Self::of_folder(path, FrameSequence::open(path)?)?));
        }
        if !metadata.is_file() {
            return Err(unreadable(std::io::Error::new(ErrorKind::InvalidInput, "it is not an ordinary file")));
        }
        if metadata.len() == 0 {
            return Err(FilmError::Empty { path: path.to_owned() });
        }
        let mut file = File::open(path).map_err(unreadable)?;
        let mut head = Vec::new();
        file.by_ref().take(16).read_to_end(&mut head).map_err(unreadable)?;
        file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
        let what = match head.get(4..8) {
            _ if head.starts_with(b"GIF8") => {
                let film = animation::Animation::open(file, path, animation::Kind::Gif)?;
                return made(Box::new(film.ok_or_else(only_one)?));
            }
            _ if head.starts_with(b"\x89PNG") => {
                let film = animation::Animation::open(file, path, animation::Kind::Apng)?;
                return made(Box::new(film.ok_or_else(only_one)?));
            }
            _ if head.starts_with(b"RIFF") && head.get(8..12) == Some(b"AVI ") => {
                match avi::Avi::open(file, metadata.len(), path)? {
                    avi::Found::Film(film) => return made(Box::new(film)),
                    avi::Found::Other(what) => what,
                }
            }
            Some(b"ftyp" | b"moov" | b"mdat" | b"wide" | b"free" | b"skip") => {
                match mp4::H264::open(file, metadata.len(), path)? {
                    mp4::Found::Film(film, upright) => {
                        let missing = film.missing();
                        let remark = format!("the file is cut short: {missing} of its frames are missing");
                        let film = Self::new(path, film, upright);
                        return Ok(Own::Film(Self { remark: (missing > 0).then_some(remark), ..film }));
                    }
                    mp4::Found::Other(what) => what,
                }
            }
            _ if image::guess_format(&head).is_ok() => return Err(only_one()),
            _ if head.starts_with(&[0x1a, 0x45, 0xdf, 0xa3]) => "a Matroska or WebM film".to_owned(),
            _ => "a file of a kind that is not known here".to_owned(),
        };
        Ok(Own::Other(what))
    }

    /// A folder of pictures as a film without times.
    fn of_folder(path: &Path, sequence: FrameSequence) -> Result<Self, super::FrameError> {
        let first = sequence.paths().first().map(|p| Frame::read(p)).transpose()?;
        let size = first.map_or([0, 0], |f| [f.width(), f.height()]);
        Ok(Self::new(path, Box::new(Numbered { sequence, size }), Upright::AS_IT_LIES))
    }

    /// The file or folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many frames it has.
    #[allow(clippy::len_without_is_empty, reason = "a film without frames is refused when it is opened")]
    pub fn len(&self) -> usize {
        self.pictures.count()
    }

    /// Size of its frames, upright and with square pixels, px.
    pub fn size(&self) -> [u32; 2] {
        self.upright.size(self.pictures.size())
    }

    /// When a frame is shown, s from the first; absent where the file does not say so.
    pub fn time_s(&self, index: usize) -> Option<f64> {
        self.pictures.time_s(index)
    }

    /// What a frame owes to others.
    pub fn compression(&self, index: usize) -> Compression {
        self.pictures.compression(index)
    }

    /// Where a frame comes from, as its still says it.
    pub fn origin(&self, index: usize) -> Origin {
        Origin {
            film: self.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            number: index + 1,
            time_s: self.time_s(index),
            compression: self.compression(index),
        }
    }

    /// The frames that are pictures of their own among others that are predicted from them; none where all are alike, or nothing says.
    pub fn key_frames(&self) -> Vec<usize> {
        let of = |wanted| (0..self.len()).filter(move |i| self.compression(*i) == wanted);
        if of(Compression::Inter).next().is_some() { of(Compression::Intra).collect() } else { Vec::new() }
    }

    /// What should be said of it, although it can be read.
    pub fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// One frame in full size.
    ///
    /// # Errors
    /// A frame that does not exist or cannot be decoded; [`FilmError::Stopped`] when `stop` says so.
    pub fn frame(&mut self, index: usize, stop: &dyn Fn() -> bool) -> Result<RgbImage, FilmError> {
        let (path, count) = (self.path.clone(), self.len());
        let mut found = None;
        self.each(index, 1, stop, &mut |_, image| {
            found = Some(image);
            ControlFlow::Break(())
        })?;
        found.ok_or(FilmError::NoSuchFrame { path, number: index + 1, count })
    }

    /// Hands over every frame from `from` on, its sides divided by the whole number `by`, decoding from the nearest frame before it at
    /// which that can begin. One frame is in memory at a time.
    ///
    /// # Errors
    /// At the first frame that cannot be decoded; those before it were handed over.
    pub fn each(&mut self, from: usize, by: usize, stop: &dyn Fn() -> bool, take: Take<'_>) -> Result<(), FilmError> {
        let upright = self.upright;
        self.pictures.each(&self.path, from, by.max(1), stop, &mut |index, image| take(index, upright.apply(image)))
    }

    /// The whole number by which the frames must be divided so that neither side is longer than `most` px.
    pub fn divisor(&self, most: u32) -> usize {
        let [width, height] = self.size();
        width.max(height).div_ceil(most.max(1)).max(1) as usize
    }
}

/// A folder of pictures.
struct Numbered {
    sequence: FrameSequence,
    size: [u32; 2],
}

impl Pictures for Numbered {
    fn count(&self) -> usize {
        self.sequence.paths().len()
    }

    fn time_s(&self, _: usize) -> Option<f64> {
        None
    }

    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn each(
        &mut self,
        _: &Path,
        from: usize,
        by: usize,
        stop: &dyn Fn() -> bool,
        take: Take<'_>,
    ) -> Result<(), FilmError> {
        for (index, path) in self.sequence.paths().iter().enumerate().skip(from) {
            if stop() {
                return Err(FilmError::Stopped);
            }
            if take(index, shrunk(Frame::read(path)?.into_image(), by)).is_break() {
                break;
            }
        }
        Ok(())
    }
}

/// Refuses frames that are larger than any picture, or nothing.
fn check_size(path: &Path, width: u32, height: u32) -> Result<(), FilmError> {
    if width == 0 || height == 0 {
        let what = format!("it declares frames of {width} × {height} px");
        return Err(FilmError::Damaged { path: path.to_owned(), what });
    }
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(FilmError::TooLarge { path: path.to_owned(), width, height });
    }
    Ok(())
}

/// The picture with its sides divided.
fn shrunk(image: RgbImage, by: usize) -> RgbImage {
    if by <= 1 {
        return image;
    }
    let side = |s: u32| (s / by as u32).max(1);
    imageops::thumbnail(&image, side(image.width()), side(image.height()))
}

/// What a decoder says, in a line that a dialog can hold.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect()
}

#[cfg(test)]
mod tests;
