//! Moving pictures in one picture file: GIF and APNG.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use image::codecs::gif::GifDecoder;
use image::codecs::png::PngDecoder;
use image::{AnimationDecoder, Frames, ImageDecoder, ImageResult, Limits};

use super::index::MAX_FRAMES;
use super::{Compression, FilmError, Pictures, Take, check_size, shrunk};
use crate::frames::frame::over_white;

/// An animated picture.
pub(super) struct Animation {
    kind: Kind,
    size: [u32; 2],
    /// When each frame begins, s.
    times_s: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Gif,
    Apng,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Gif => "GIF",
            Self::Apng => "APNG",
        }
    }
}

impl Animation {
    /// Counts the frames of a GIF or an animated PNG by its blocks; absent when a PNG does not move.
    pub(super) fn open(file: File, path: &Path, kind: Kind) -> Result<Option<Self>, FilmError> {
        let mut reader = BufReader::new(file);
        let walked = match kind {
            Kind::Gif => walk_gif(&mut reader),
            Kind::Apng => walk_png(&mut reader),
        };
        let damaged =
            || FilmError::Damaged { path: path.to_owned(), what: format!("its {} header is cut short", kind.name()) };
        let Walked { size, delays_s, deep } = walked.ok_or_else(damaged)?;
        check_size(path, size[0], size[1])?;
        if deep {
            return Err(FilmError::Unsupported {
                path: path.to_owned(),
                what: "an APNG with 16 bits a colour".to_owned(),
            });
        }
        if kind == Kind::Apng && delays_s.is_empty() {
            return Ok(None);
        }
        let mut times_s = Vec::with_capacity(delays_s.len());
        let mut at = 0.0;
        for delay_s in delays_s {
            times_s.push(at);
            at += delay_s;
        }
        Ok(Some(Self { kind, size, times_s }))
    }

    fn frames(&self, path: &Path) -> ImageResult<Frames<'static>> {
        let reader = BufReader::new(File::open(path)?);
        let mut limits = Limits::default();
        limits.max_image_width = Some(self.size[0]);
        limits.max_image_height = Some(self.size[1]);
        limits.max_alloc = Some(64 * u64::from(self.size[0]) * u64::from(self.size[1]) + (1 << 20));
        Ok(match self.kind {
            Kind::Gif => {
                let mut decoder = GifDecoder::new(reader)?;
                decoder.set_limits(limits)?;
                decoder.into_frames()
            }
            Kind::Apng => PngDecoder::with_limits(reader, limits)?.apng()?.into_frames(),
        })
    }
}

impl Pictures for Animation {
    fn count(&self) -> usize {
        self.times_s.len()
    }

    fn time_s(&self, index: usize) -> Option<f64> {
        self.times_s.get(index).copied()
    }

    fn compression(&self, _: usize) -> Compression {
        Compression::Intra
    }

    fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Every frame is laid over those before it, so that reading begins at the first.
    fn each(
        &mut self,
        path: &Path,
        from: usize,
        by: usize,
        stop: &dyn Fn() -> bool,
        take: Take<'_>,
    ) -> Result<(), FilmError> {
        let broken = |index: usize, e: &image::ImageError| FilmError::BadFrame {
            path: path.to_owned(),
            number: index + 1,
            reason: super::one_line(&e.to_string()),
        };
        let frames = self.frames(path).map_err(|e| broken(0, &e))?;
        let mut came = 0;
        for (index, frame) in frames.enumerate().take(self.count()) {
            if stop() {
                return Err(FilmError::Stopped);
            }
            let frame = frame.map_err(|e| broken(index, &e))?;
            came = index + 1;
            if index >= from && take(index, shrunk(over_white(&frame.into_buffer()), by)).is_break() {
                return Ok(());
            }
        }
        if came < self.count() {
            let reason = format!("the file ends after {came} of {} frames", self.count());
            return Err(FilmError::BadFrame { path: path.to_owned(), number: came + 1, reason });
        }
        Ok(())
    }
}

/// What the blocks of a file say.
struct Walked {
    size: [u32; 2],
    delays_s: Vec<f64>,
    /// More than 8 bits a colour.
    deep: bool,
}

/// Frames shown faster than this are slowed down by every browser, s.
const SHORTEST_S: f64 = 0.011;
const SLOWED_S: f64 = 0.1;

fn delay(hundredths: f64) -> f64 {
    let s = hundredths / 100.0;
    if s < SHORTEST_S { SLOWED_S } else { s }
}

fn walk_gif(reader: &mut BufReader<File>) -> Option<Walked> {
    let mut head = [0; 13];
    reader.read_exact(&mut head).ok()?;
    let word = |low: u8, high: u8| u16::from_le_bytes([low, high]);
    let table = |flags: u8| if flags & 0x80 == 0 { 0 } else { 3_i64 << ((flags & 7) + 1) };
    let size = [word(head[6], head[7]), word(head[8], head[9])].map(u32::from);
    reader.seek_relative(table(head[10])).ok()?;
    let mut walked = Walked { size, delays_s: Vec::new(), deep: false };
    let mut next = SLOWED_S;
    // A file that breaks off has the frames up to there.
    let _ = (|| -> Option<()> {
        while walked.delays_s.len() < MAX_FRAMES {
            match byte(reader)? {
                0x21 => {
                    if byte(reader)? == 0xf9 {
                        let mut control = [0; 5];
                        reader.read_exact(&mut control).ok()?;
                        next = delay(f64::from(word(control[2], control[3])));
                    }
                    skip_blocks(reader)?;
                }
                0x2c => {
                    let mut place = [0; 9];
                    reader.read_exact(&mut place).ok()?;
                    reader.seek_relative(table(place[8]) + 1).ok()?;
                    skip_blocks(reader)?;
                    walked.delays_s.push(next);
                }
                _ => return None,
            }
        }
        None
    })();
    Some(walked)
}

fn byte(reader: &mut BufReader<File>) -> Option<u8> {
    let mut one = [0];
    reader.read_exact(&mut one).ok()?;
    Some(one[0])
}

fn skip_blocks(reader: &mut BufReader<File>) -> Option<()> {
    loop {
        match byte(reader)? {
            0 => return Some(()),
            n => {
                // Read, not sought: beyond the end of the file there is nothing.
                let mut block = [0; 255];
                reader.read_exact(block.get_mut(..usize::from(n))?).ok()?;
            }
        }
    }
}

fn walk_png(reader: &mut BufReader<File>) -> Option<Walked> {
    let length = reader.seek(SeekFrom::End(0)).ok()?;
    let mut walked = Walked { size: [0; 2], delays_s: Vec::new(), deep: false };
    let (mut at, mut animated) = (8_u64, false);
    while at + 12 <= length && walked.delays_s.len() < MAX_FRAMES {
        reader.seek(SeekFrom::Start(at)).ok()?;
        let mut head = [0; 8 + 26];
        let have = head.len().min((length - at) as usize);
        reader.read_exact(head.get_mut(..have)?).ok()?;
        let number = |at: usize| u32::from_be_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let short = |at: usize| f64::from(u16::from_be_bytes([head[at], head[at + 1]]));
        match &head[4..8] {
            b"IHDR" => {
                walked.size = [number(8), number(12)];
                walked.deep = head[16] > 8;
            }
            b"acTL" => animated = true,
            b"fcTL" if animated => {
                let per_s = if short(30) == 0.0 { 100.0 } else { short(30) };
                walked.delays_s.push(delay(100.0 * short(28) / per_s));
            }
            b"IEND" => break,
            _ => {}
        }
        at += 12 + u64::from(number(0));
    }
    walked.deep &= animated;
    (walked.size[0] > 0).then_some(walked)
}
