//! What lies between two frames: the film that they were taken from is found again, and its frames on the way are read in order.

use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use image::RgbImage;

use super::film::{Film, FilmError, Origin};
use super::sequence::FrameSequence;

/// So many frames on the way are read at most; of more every second or third one.
const MOST: usize = 40;

/// A frame of the film that differs from the picture by more than this, grey levels in the mean, is one of another film.
const OTHER: f64 = 4.0;

/// A film, or a folder of numbered pictures, and the numbers of two of its frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Between {
    /// The film or folder.
    pub film: PathBuf,
    /// Numbers of the first and the last frame, from 0; there is one between them.
    pub frames: [usize; 2],
}

/// Where the frames between two pictures are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Way {
    /// There is no film, or no frame between the two.
    None,
    /// In a film.
    Through(Between),
    /// In a film of this name, which is not where it is looked for.
    Missing(String),
}

impl Way {
    /// Looks for what two pictures were taken from: the film that is named in them both, among `films` or in the folder of the first; or
    /// one of `films` that is a folder and has them both.
    pub fn of(pictures: [&Path; 2], films: &[PathBuf]) -> Self {
        let between = |film: PathBuf, frames: [usize; 2]| {
            if frames[1] > frames[0] + 1 { Self::Through(Between { film, frames }) } else { Self::None }
        };
        let folders = films.iter().filter(|f| pictures.iter().all(|p| p.parent() == Some(f.as_path())));
        for folder in folders {
            if let Ok(sequence) = FrameSequence::open(folder)
                && let [Some(first), Some(last)] = pictures.map(|p| sequence.paths().iter().position(|q| q == p))
            {
                return between(folder.clone(), [first, last]);
            }
        }
        let [Some(first), Some(last)] = pictures.map(origin) else { return Self::None };
        if first.film != last.film || last.number <= first.number + 1 {
            return Self::None;
        }
        let beside = pictures[0].with_file_name(&first.film);
        let named = films.iter().filter(|f| f.file_name().is_some_and(|n| *n == *first.film));
        match named.chain([&beside]).find(|f| f.is_file()) {
            Some(film) => between(film.clone(), [first.number - 1, last.number - 1]),
            None => Self::Missing(first.film),
        }
    }
}

/// Why the frames on the way cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum BetweenError {
    /// The film.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// Its frame is not the picture.
    #[error("{}: frame {number} is not the first frame of the project; it may be another film of that name", path.display())]
    OtherFilm {
        /// The film.
        path: PathBuf,
        /// Number of the frame, from 1.
        number: usize,
    },
    /// The reader gave up without a word.
    #[error("{}: reading it broke off", path.display())]
    BrokeOff {
        /// The film.
        path: PathBuf,
    },
}

impl Between {
    /// How many of the frames on the way are read.
    pub fn count(&self) -> usize {
        let on_the_way = self.frames[1] - self.frames[0] - 1;
        on_the_way / self.step()
    }

    /// Every how many frames one is read.
    fn step(&self) -> usize {
        (self.frames[1] - self.frames[0] - 1).div_ceil(MOST).max(1)
    }

    /// Hands over the frames on the way, one at a time, in order; `first` is the picture that was taken from the film, `stop` is asked
    /// whether to give up.
    ///
    /// # Errors
    /// A film that cannot be read or is another one; [`FilmError::Stopped`]. The frames before were handed over.
    pub fn each(
        &self,
        first: &RgbImage,
        stop: &dyn Fn() -> bool,
        take: &mut dyn FnMut(RgbImage) -> ControlFlow<()>,
    ) -> Result<(), BetweenError> {
        let [from, to] = self.frames;
        let step = self.step();
        let mut film = Film::open(&self.film, stop)?;
        let mut other = false;
        film.each(from, 1, stop, &mut |index, image| {
            if index == from {
                other = differs(first, &image);
                return if other { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            }
            match index {
                _ if index >= to => ControlFlow::Break(()),
                _ if (index - from) % step == 0 => take(image),
                _ => ControlFlow::Continue(()),
            }
        })?;
        if other { Err(BetweenError::OtherFilm { path: self.film.clone(), number: from + 1 }) } else { Ok(()) }
    }
}

/// Whether two pictures are not the same one, but for what another decoder may round otherwise.
fn differs(a: &RgbImage, b: &RgbImage) -> bool {
    let apart: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    a.dimensions() != b.dimensions() || apart as f64 > OTHER * a.as_raw().len().max(1) as f64
}

/// Where a picture says that it was taken from, if it is a frame of a film that was written by this program.
fn origin(picture: &Path) -> Option<Origin> {
    // The text stands at the head of the file.
    const HEAD: u64 = 4096;
    let mut head = Vec::new();
    File::open(picture).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
    Origin::in_png(&head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Compression;
    use crate::frames::film::still_png;
    use image::codecs::gif::GifEncoder;

    /// A film of nine frames, each with a grey of its own, and stills of its frames `numbers`.
    fn film(folder: &Path, name: &str, numbers: [usize; 2]) -> [PathBuf; 2] {
        let frame = |k: usize| RgbImage::from_fn(16, 12, |x, _| image::Rgb([(20 * k + x as usize) as u8; 3]));
        let mut gif = GifEncoder::new(File::create(folder.join(name)).unwrap());
        for k in 0..9 {
            let rgba = image::DynamicImage::from(frame(k)).into_rgba8();
            gif.encode_frame(image::Frame::new(rgba)).unwrap();
        }
        numbers.map(|number| {
            let path = folder.join(format!("still-{number}.png"));
            let origin = Origin {
                film: name.to_owned(),
                number,
                time_s: Some(0.1 * number as f64),
                compression: Compression::Inter,
            };
            std::fs::write(&path, still_png(&frame(number - 1), &origin).unwrap()).unwrap();
            path
        })
    }

    fn read(way: &Way, first: &Path) -> Result<Vec<u8>, BetweenError> {
        let Way::Through(between) = way else { panic!("{way:?}") };
        let mut seen = Vec::new();
        between.each(&image::open(first).unwrap().into_rgb8(), &|| false, &mut |image| {
            seen.push(image.get_pixel(0, 0).0[0]);
            ControlFlow::Continue(())
        })?;
        assert_eq!(seen.len(), between.count());
        Ok(seen)
    }

    #[test]
    fn stills_lead_back_to_the_frames_between_them() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = film(folder.path(), "smile, frame 3.gif", [3, 7]);
        let way = Way::of([&a, &b], &[]);
        assert_eq!(read(&way, &a).unwrap(), [60, 80, 100], "the greys of frames 4, 5 and 6");
        assert_eq!(Way::of([&b, &a], &[]), Way::None, "backwards there is no way");
        // Elsewhere it is found once it was opened, and its name is told until then.
        let other = tempfile::tempdir().unwrap();
        let moved = other.path().join("smile, frame 3.gif");
        std::fs::rename(folder.path().join("smile, frame 3.gif"), &moved).unwrap();
        assert_eq!(Way::of([&a, &b], &[]), Way::Missing("smile, frame 3.gif".to_owned()));
        assert_eq!(read(&Way::of([&a, &b], &[moved]), &a).unwrap().len(), 3);
        // Of another film with this name nothing is taken.
        let [c, _] = film(folder.path(), "smile, frame 3.gif", [8, 9]);
        assert!(matches!(read(&Way::of([&a, &b], &[]), &c), Err(BetweenError::OtherFilm { number: 3, .. })));
    }

    #[test]
    fn a_folder_is_a_film_once_it_was_opened_as_one() {
        let folder = tempfile::tempdir().unwrap();
        let paths: Vec<PathBuf> = (1..=120).map(|k| folder.path().join(format!("f{k:03}.png"))).collect();
        for (k, path) in paths.iter().enumerate() {
            RgbImage::from_pixel(4, 4, image::Rgb([2 * k as u8; 3])).save(path).unwrap();
        }
        let ends = [paths[0].as_path(), paths[119].as_path()];
        assert_eq!(Way::of(ends, &[]), Way::None, "numbered pictures may be of anything");
        let seen = read(&Way::of(ends, &[folder.path().to_owned()]), &paths[0]).unwrap();
        // 118 on the way: every third, 39 of them.
        assert_eq!((seen.len(), seen[0], seen[38]), (39, 6, 234));
    }
}
