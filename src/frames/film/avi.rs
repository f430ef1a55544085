//! AVI films whose frames stand for themselves: Motion JPEG and uncompressed pictures.

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use image::{ImageDecoder, Rgb, RgbImage};

use super::index::MAX_FRAMES;
use super::{Compression, FilmError, Pictures, Take, check_size, one_line, shrunk};

/// Deepest nesting of lists: `RIFF`, `LIST movi`, `LIST rec `.
const MAX_DEPTH: usize = 4;

/// A film of single pictures.
pub(super) struct Avi {
    file: File,
    layout: Layout,
    size: [u32; 2],
    frame_s: f64,
    /// Offset and length of every frame.
    frames: Vec<(u64, u32)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    Jpeg,
    /// Bytes of a pixel (blue, green, red, and perhaps one of no use), and whether the first row is the lowest.
    Raw {
        bytes: usize,
        upside_down: bool,
    },
}

/// What an AVI file turned out to be.
pub(super) enum Found {
    Film(Avi),
    Other(String),
}

#[derive(Default)]
struct Walk {
    /// The stream of the pictures: its number, s a frame, and its format.
    video: Option<(usize, f64, Vec<u8>)>,
    streams: usize,
    /// The header of the stream whose format comes next.
    header: Vec<u8>,
    frames: Vec<(u64, u32)>,
}

impl Avi {
    pub(super) fn open(file: File, file_size: u64, path: &Path) -> Result<Found, FilmError> {
        let mut walk = Walk::default();
        let mut reader = BufReader::new(file);
        let read = walk.list(&mut reader, 0, file_size, 0);
        read.map_err(|reason| FilmError::Unreadable { path: path.to_owned(), reason })?;
        let Some((_, frame_s, format)) = walk.video else { return Err(FilmError::NoVideo { path: path.to_owned() }) };
        let number = |at: usize| {
            let part = format.get(at..at + 4).and_then(|p| p.try_into().ok());
            part.map_or(0, u32::from_le_bytes)
        };
        let height = number(8).cast_signed();
        let size = [number(4), height.unsigned_abs()];
        check_size(path, size[0], size[1])?;
        let layout = match (format.get(16..20).unwrap_or_default(), number(12) >> 16) {
            (b"MJPG" | b"mjpg" | b"JPEG" | b"jpeg", _) => Layout::Jpeg,
            ([0, 0, 0, 0], bits @ (24 | 32)) => Layout::Raw { bytes: bits as usize / 8, upside_down: height > 0 },
            (other, _) => {
                return Ok(Found::Other(format!("AVI video of the kind `{}`", String::from_utf8_lossy(other).trim())));
            }
        };
        Ok(Found::Film(Self { file: reader.into_inner(), layout, size, frame_s, frames: walk.frames }))
    }

    fn decode(&self, bytes: &[u8]) -> Result<RgbImage, String> {
        let [width, height] = self.size;
        match self.layout {
            Layout::Jpeg => {
                let said = |e: image::ImageError| one_line(&e.to_string());
                let decoder = image::codecs::jpeg::JpegDecoder::new(Cursor::new(bytes)).map_err(said)?;
                if decoder.dimensions() != (width, height) {
                    return Err(format!("it has {} × {} px", decoder.dimensions().0, decoder.dimensions().1));
                }
                image::DynamicImage::from_decoder(decoder).map(image::DynamicImage::into_rgb8).map_err(said)
            }
            Layout::Raw { bytes: per, upside_down } => {
                // Rows begin at multiples of four bytes.
                let stride = (width as usize * per).next_multiple_of(4);
                if bytes.len() < stride * height as usize {
                    return Err("it is cut short".to_owned());
                }
                Ok(RgbImage::from_fn(width, height, |x, y| {
                    let y = if upside_down { height - 1 - y } else { y };
                    let at = y as usize * stride + x as usize * per;
                    let part = bytes.get(at..at + 3).unwrap_or(&[0; 3]);
                    Rgb([part[2], part[1], part[0]])
                }))
            }
        }
    }
}

impl Walk {
    /// Walks the chunks between two places of the file; what breaks off ends the walk.
    fn list(&mut self, reader: &mut BufReader<File>, mut at: u64, end: u64, depth: usize) -> std::io::Result<()> {
        while at + 8 <= end && depth < MAX_DEPTH && self.frames.len() < MAX_FRAMES {
            reader.seek(SeekFrom::Start(at))?;
            let mut head = [0; 12];
            let have = if at + 12 <= end { 12 } else { 8 };
            reader.read_exact(head.get_mut(..have).unwrap_or_default())?;
            let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
            let content = at + 8;
            let last = content + u64::from(length);
            match (&head[..4], &head[8..]) {
                (b"RIFF" | b"LIST", kind) if depth > 0 || kind.starts_with(b"AVI") => {
                    self.list(reader, content + 4, last.min(end), depth + 1)?;
                }
                (b"strh", _) => self.header = chunk(reader, content, length.min(64))?,
                (b"strf", _) => {
                    let format = chunk(reader, content, length.min(64))?;
                    if self.header.starts_with(b"vids") && self.video.is_none() {
                        let number = |at: usize| {
                            let part = self.header.get(at..at + 4).and_then(|p| p.try_into().ok());
                            f64::from(part.map_or(0, u32::from_le_bytes))
                        };
                        let frame_s = number(20) / number(24);
                        self.video = Some((self.streams, if frame_s.is_finite() { frame_s } else { 0.0 }, format));
                    }
                    self.streams += 1;
                }
                ([a, b, b'd', b'b' | b'c'], _) if last <= end && length > 0 => {
                    let stream = std::str::from_utf8(&[*a, *b]).ok().and_then(|n| n.parse::<usize>().ok());
                    if stream.is_some() && stream == self.video.as_ref().map(|v| v.0) {
                        self.frames.push((content, length));
                    }
                }
                _ => {}
            }
            // Chunks begin at even places.
            at = last + u64::from(length % 2);
        }
        Ok(())
    }
}

fn chunk(reader: &mut BufReader<File>, at: u64, length: u32) -> std::io::Result<Vec<u8>> {
    reader.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    reader.by_ref().take(u64::from(length)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Pictures for Avi {
    fn count(&self) -> usize {
        self.frames.len()
    }

    fn time_s(&self, index: usize) -> Option<f64> {
        (self.frame_s > 0.0).then_some(index as f64 * self.frame_s)
    }

    fn compression(&self, _: usize) -> Compression {
        Compression::Intra
    }

    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn each(
        &mut self,
        path: &Path,
        from: usize,
        by: usize,
        stop: &dyn Fn() -> bool,
        take: Take<'_>,
    ) -> Result<(), FilmError> {
        for index in from..self.frames.len() {
            if stop() {
                return Err(FilmError::Stopped);
            }
            let Some(&(at, length)) = self.frames.get(index) else { break };
            let mut bytes = Vec::new();
            let read = self.file.seek(SeekFrom::Start(at));
            let read = read.and_then(|_| self.file.by_ref().take(u64::from(length)).read_to_end(&mut bytes));
            read.map_err(|reason| FilmError::Unreadable { path: path.to_owned(), reason })?;
            let image = self.decode(&bytes);
            let image =
                image.map_err(|reason| FilmError::BadFrame { path: path.to_owned(), number: index + 1, reason })?;
            if take(index, shrunk(image, by)).is_break() {
                break;
            }
        }
        Ok(())
    }
}
