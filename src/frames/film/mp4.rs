//! Films in MP4 and QuickTime files with H.264 pictures, decoded here: from the nearest frame at which decoding can begin.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::{ControlFlow, Range};
use std::path::Path;

use openh264::OpenH264API;
use openh264::decoder::{DecodedYUV, Decoder, DecoderConfig, Flush};
use openh264::formats::YUVSource;

use super::boxes::{self, MAX_INDEX_BYTES, TopBox, be16};
use super::colour::{Coding, Planes};
use super::index::{NoIndex, Sample, Track, video_track};
use super::parameters::Parameters;
use super::{Compression, FilmError, Pictures, Take, Upright, check_size};

/// Most boxes on the top level: a live recording has one fragment a second.
const MOST_BOXES: usize = 500_000;

/// A film of H.264 frames.
pub(super) struct H264 {
    file: File,
    track: Track,
    /// Runs of samples that begin with a key, in the order of decoding.
    runs: Vec<Range<usize>>,
    /// Every frame in the order of showing.
    shown: Vec<Shown>,
    /// Bytes of a length before a unit in a sample.
    length_bytes: usize,
    /// Both parameter sets as the decoder takes them.
    headers: Vec<u8>,
    coding: Coding,
    size: [u32; 2],
    /// Frames that the index names and the file has not.
    missing: usize,
}

/// A frame: its run, its place within it in the order of showing, and its sample.
type Shown = (u32, u32, u32);

/// What an MP4 file turned out to be.
pub(super) enum Found {
    /// A film that is decoded here.
    Film(Box<H264>, Upright),
    /// One of another kind: what it is.
    Other(String),
}

impl H264 {
    /// Reads the index of the film.
    pub(super) fn open(mut file: File, file_size: u64, path: &Path) -> Result<Found, FilmError> {
        let unreadable = |reason| FilmError::Unreadable { path: path.to_owned(), reason };
        let damaged = |what: &str| FilmError::Damaged { path: path.to_owned(), what: what.to_owned() };
        let top = boxes::top_level(&mut file, file_size, MOST_BOXES).map_err(unreadable)?;
        let moov = top.iter().find(|b| &b.kind == b"moov").ok_or_else(|| {
            let cut = top.iter().any(|b| b.cut_short);
            damaged(if cut { "it is cut short before its index" } else { "it has no index" })
        })?;
        let too_large = |b: &TopBox| b.length > MAX_INDEX_BYTES;
        if moov.cut_short || too_large(moov) {
            return Err(damaged(if moov.cut_short {
                "its index is cut short"
            } else {
                "its index is larger than any film's"
            }));
        }
        let index = boxes::read_content(&mut file, moov).map_err(unreadable)?;
        let refused = |e: NoIndex| match e {
            NoIndex::NoVideo => FilmError::NoVideo { path: path.to_owned() },
            NoIndex::TooMany(count) => FilmError::TooManyFrames { path: path.to_owned(), count },
            NoIndex::Damaged(table) => damaged(&format!("its table `{table}` is missing or contradicts the file")),
        };
        let mut track = video_track(&index, file_size).map_err(refused)?;
        for fragment in top.iter().filter(|b| &b.kind == b"moof" && !b.cut_short && !too_large(b)) {
            let content = boxes::read_content(&mut file, fragment).map_err(unreadable)?;
            track.add_fragment(&index, &content, fragment.start).map_err(refused)?;
        }
        if !matches!(&track.codec, b"avc1" | b"avc3") {
            return Ok(Found::Other(codec_name(track.codec)));
        }
        let Some((length_bytes, sets)) = configuration(&track.configuration) else {
            return Ok(Found::Other("H.264 video without its parameters in the index".to_owned()));
        };
        let parameters =
            sets.iter().filter(|s| s.first().is_some_and(|b| b & 31 == 7)).find_map(|s| Parameters::read(s));
        let Some(parameters) = parameters else { return Err(damaged("its picture parameters cannot be read")) };
        if let Some(what) = not_decoded(&parameters) {
            return Ok(Found::Other(what));
        }
        let [width, height] = parameters.size;
        check_size(path, width, height)?;
        let (matrix, full) =
            track.colour.map_or((None, None), |(m, f)| (Some(u32::from(m)).filter(|m| *m != 2), Some(f)));
        let matrix = parameters.matrix.filter(|m| *m != 2).or(matrix);
        let coding = Coding::new(matrix, parameters.full_range.or(full).unwrap_or(false), height);
        let aspect = track.pixel_aspect.or(parameters.pixel_aspect).filter(|a| a[0] > 0 && a[1] > 0);
        let upright = Upright { quarter_turns: track.quarter_turns, pixel_aspect: aspect.unwrap_or([1, 1]) };

        let declared = track.samples.len();
        // A recording that broke off has its frames up to there.
        let there = |s: &Sample| s.offset.checked_add(u64::from(s.size)).is_some_and(|end| end <= file_size);
        let kept = track.samples.iter().take_while(|s| there(s)).count();
        track.samples.truncate(kept);
        let first = track.samples.iter().position(|s| s.key).unwrap_or(kept);
        let (runs, shown) = in_order_of_showing(&track, first);
        let headers = sets.iter().flat_map(|s| [0, 0, 0, 1].into_iter().chain(s.iter().copied())).collect();
        let size = parameters.size;
        let missing = declared - kept;
        let film = Self { file, track, runs, shown, length_bytes, headers, coding, size, missing };
        Ok(Found::Film(Box::new(film), upright))
    }

    /// Frames that the index names and the file has not.
    pub(super) fn missing(&self) -> usize {
        self.missing
    }
}

impl Pictures for H264 {
    fn count(&self) -> usize {
        self.shown.len()
    }

    fn time_s(&self, index: usize) -> Option<f64> {
        let sample = |i: usize| self.shown.get(i).and_then(|s| self.track.samples.get(s.2 as usize));
        let since = sample(index)?.shown_at.saturating_sub(sample(0)?.shown_at);
        Some(since as f64 / f64::from(self.track.timescale))
    }

    fn compression(&self, index: usize) -> Compression {
        let sample = self.shown.get(index).and_then(|s| self.track.samples.get(s.2 as usize));
        match sample {
            Some(s) if s.key => Compression::Intra,
            Some(_) => Compression::Inter,
            None => Compression::Unknown,
        }
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
        let Some(&(first_run, ..)) = self.shown.get(from) else { return Ok(()) };
        let refused = |e: openh264::Error| FilmError::Damaged { path: path.to_owned(), what: e.to_string() };
        let headers = self.headers.clone();
        let begin = || {
            let config = DecoderConfig::new().flush_after_decode(Flush::NoFlush);
            let mut decoder = Decoder::with_api_config(OpenH264API::from_source(), config).map_err(refused)?;
            decoder.decode(&headers).map_err(refused)?;
            Ok::<_, FilmError>(decoder)
        };
        let mut decoder = begin()?;
        let mut at = self.shown.iter().position(|s| s.0 == first_run).unwrap_or(from);
        for run in first_run as usize..self.runs.len() {
            let samples = self.runs.get(run).cloned().unwrap_or_default();
            let number = at + 1;
            let broken = |reason: String| FilmError::BadFrame { path: path.to_owned(), number, reason };
            // Pictures of this run that came out, of which those before the first edit are not shown.
            let mut came = 0_u32;
            let expected = samples.len() as u32;
            let mut out = |picture: &DecodedYUV<'_>, at: &mut usize| {
                let here = came;
                came += 1;
                match self.shown.get(*at) {
                    Some(&(r, rank, _)) if r as usize == run && rank == here => {}
                    _ => return Ok(ControlFlow::Continue(())),
                }
                let index = *at;
                *at += 1;
                if index < from {
                    return Ok(ControlFlow::Continue(()));
                }
                let size = picture.dimensions();
                if [size.0 as u32, size.1 as u32] != self.size {
                    return Err(broken(format!("its pictures change their size to {} × {} px", size.0, size.1)));
                }
                let strides = picture.strides();
                let (strides, size) = ([strides.0, strides.1], [size.0, size.1]);
                let planes = Planes { y: picture.y(), u: picture.u(), v: picture.v(), strides, size };
                let image = if by == 1 { planes.full(&self.coding) } else { planes.small(&self.coding, by) };
                Ok(take(index, image))
            };
            let samples: Vec<Sample> = self.track.samples.get(samples).unwrap_or_default().to_vec();
            for sample in samples {
                if stop() {
                    return Err(FilmError::Stopped);
                }
                let unit = read_unit(&mut self.file, self.length_bytes, sample, path)?;
                if let Some(picture) = decoder.decode(&unit).map_err(|e| broken(e.to_string()))?
                    && out(&picture, &mut at)?.is_break()
                {
                    return Ok(());
                }
            }
            let rest = decoder.flush_remaining().map_err(|e| broken(e.to_string()))?;
            let flushed = !rest.is_empty();
            for picture in rest {
                if out(&picture, &mut at)?.is_break() {
                    return Ok(());
                }
            }
            if came != expected {
                return Err(broken(format!("{came} of {expected} pictures from there could be decoded")));
            }
            // A decoder that was emptied by force runs out of pictures a few frames later.
            if flushed {
                decoder = begin()?;
            }
        }
        Ok(())
    }
}

/// A sample with start codes in the place of lengths.
fn read_unit(file: &mut File, length_bytes: usize, sample: Sample, path: &Path) -> Result<Vec<u8>, FilmError> {
    let unreadable = |reason| FilmError::Unreadable { path: path.to_owned(), reason };
    file.seek(SeekFrom::Start(sample.offset)).map_err(unreadable)?;
    let mut bytes = Vec::with_capacity(sample.size as usize);
    file.by_ref().take(u64::from(sample.size)).read_to_end(&mut bytes).map_err(unreadable)?;
    let mut unit = Vec::with_capacity(bytes.len() + 16);
    let mut rest = bytes.as_slice();
    while let Some((length, after)) = rest.split_at_checked(length_bytes) {
        let length = length.iter().fold(0_usize, |n, b| n << 8 | usize::from(*b));
        unit.extend_from_slice(&[0, 0, 0, 1]);
        unit.extend_from_slice(after.get(..length.min(after.len())).unwrap_or_default());
        rest = after.get(length..).unwrap_or_default();
    }
    Ok(unit)
}

/// Runs that begin with a key, and every frame in the order of showing.
fn in_order_of_showing(track: &Track, first: usize) -> (Vec<Range<usize>>, Vec<Shown>) {
    let samples = &track.samples;
    let keys: Vec<usize> = (first..samples.len()).filter(|&i| samples[i].key).collect();
    let ends = keys.iter().skip(1).copied().chain([samples.len()]);
    let runs: Vec<Range<usize>> = keys.iter().copied().zip(ends).map(|(a, b)| a..b).collect();
    let mut shown = Vec::with_capacity(samples.len());
    for (run, range) in runs.iter().enumerate() {
        let mut order: Vec<usize> = range.clone().collect();
        order.sort_by_key(|&i| samples[i].shown_at);
        // A decoder gives out the pictures of a run in the order of showing.
        shown.extend(order.iter().enumerate().map(|(rank, &i)| (run as u32, rank as u32, i as u32)));
    }
    // What ends before the first edit begins is there for the decoder alone.
    shown.retain(|s| {
        let sample = &samples[s.2 as usize];
        sample.shown_at.saturating_add(i64::from(sample.lasts.max(1))) > track.begins_at
    });
    (runs, shown)
}

/// Bytes of a unit's length, and the parameter sets, of an `avcC` box.
fn configuration(avcc: &[u8]) -> Option<(usize, Vec<&[u8]>)> {
    let length_bytes = usize::from(avcc.get(4)? & 3) + 1;
    let mut sets = Vec::new();
    let mut at = 5;
    for mask in [31, 255] {
        let count = avcc.get(at)? & mask;
        at += 1;
        for _ in 0..count {
            let length = usize::from(be16(avcc, at)?);
            sets.push(avcc.get(at + 2..at + 2 + length)?);
            at += 2 + length;
        }
    }
    (!sets.is_empty()).then_some((length_bytes, sets))
}

/// What of H.264 is not decoded here.
fn not_decoded(p: &Parameters) -> Option<String> {
    let what = if p.bits != 8 {
        format!("H.264 video with {} bits a colour", p.bits)
    } else if p.chroma != 1 {
        format!(
            "H.264 video in {}",
            ["grey", "4:2:0", "4:2:2", "4:4:4"].get(p.chroma as usize).unwrap_or(&"an unknown format")
        )
    } else if p.interlaced {
        "interlaced H.264 video".to_owned()
    } else {
        return None;
    };
    Some(what)
}

/// A codec as people call it.
fn codec_name(codec: [u8; 4]) -> String {
    let name = match &codec {
        b"hvc1" | b"hev1" => "HEVC (H.265) video",
        b"av01" => "AV1 video",
        b"vp09" => "VP9 video",
        b"mp4v" => "MPEG-4 Visual video",
        b"jpeg" | b"mjpa" | b"mjpb" => "Motion JPEG video in MP4",
        b"apch" | b"apcn" | b"apcs" | b"apco" | b"ap4h" | b"ap4x" => "ProRes video",
        b"encv" => "encrypted video",
        other => return format!("video of the kind `{}`", String::from_utf8_lossy(other).trim()),
    };
    name.to_owned()
}
