//! Writing a film: pictures become H.264 frames in an MP4 file (ISO/IEC 14496-12 and -15) that any player shows.

use image::RgbImage;
use openh264::OpenH264API;
use openh264::encoder::{
    Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, Profile, QpRange, RateControlMode, VuiConfig,
};
use openh264::formats::{RgbSliceU8, YUVBuffer};

/// Units of time in a second, for every picture a second.
const UNITS: u32 = 1000;
/// The quantiser of every frame of a film that people look at, 0 to 51: fine enough for lines of one pixel.
const QUANTISER: u8 = 18;
/// Every so many seconds a frame from which decoding can begin.
const KEY_S: u32 = 2;
/// An identity matrix of a header, 16.16 and 2.30.
const UPRIGHT: [u32; 9] = [0x1_0000, 0, 0, 0, 0x1_0000, 0, 0, 0, 0x4000_0000];

/// Why a film could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The encoder gave up.
    #[error("the encoder of the film failed ({0}); choose the moving picture (GIF) instead")]
    Encoder(#[from] openh264::Error),
    /// A frame of another size than the first.
    #[error("a frame of the film has {found:?} px, the first had {first:?}")]
    Size {
        /// Its width and height, px.
        found: [u32; 2],
        /// Those of the first.
        first: [u32; 2],
    },
    /// The encoder left a frame out.
    #[error("the encoder left frame {0} of the film out; choose the moving picture (GIF) instead")]
    LeftOut(usize),
    /// More than such a file can hold.
    #[error("the film is larger than 4 GB; make it shorter")]
    TooLarge,
}

/// A film that is being written, in memory: coded frames are small.
pub struct FilmWriter {
    encoder: Encoder,
    /// As given, and with an even number of columns and rows: the last ones are doubled.
    size: [u32; 2],
    even: [u32; 2],
    per_second: u32,
    /// Sequence and picture parameters.
    sets: [Vec<u8>; 2],
    /// Length, and whether decoding can begin there.
    samples: Vec<(u32, bool)>,
    data: Vec<u8>,
}

impl FilmWriter {
    /// A film of pictures of this size, so many a second.
    ///
    /// # Errors
    /// Where the encoder refuses them.
    pub fn new(size: [u32; 2], per_second: u32) -> Result<Self, WriteError> {
        Self::with_quantiser(size, per_second, QUANTISER)
    }

    /// The same with another quantiser, 0 to 51: what is smaller than its step (5 grey levels at 18, twice that for each 6 more) is lost.
    ///
    /// # Errors
    /// Where the encoder refuses them.
    pub fn with_quantiser(size: [u32; 2], per_second: u32, quantiser: u8) -> Result<Self, WriteError> {
        let per_second = per_second.max(1);
        let even = size.map(|s| s + s % 2);
        let config = EncoderConfig::new()
            // Without rate control the encoder has a quantiser of its own; under this one the bounds hold.
            .rate_control_mode(RateControlMode::Bufferbased)
            .max_frame_rate(FrameRate::from_hz(per_second as f32))
            .qp(QpRange::new(quantiser, quantiser))
            .skip_frames(false)
            .profile(Profile::Baseline)
            .intra_frame_period(IntraFramePeriod::from_num_frames(KEY_S * per_second))
            .vui(VuiConfig::bt601())
            .num_threads(1);
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config)?;
        Ok(Self {
            encoder,
            size,
            even,
            per_second,
            sets: [Vec::new(), Vec::new()],
            samples: Vec::new(),
            data: Vec::new(),
        })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// A picture of another size, and what the encoder says.
    pub fn frame(&mut self, picture: &RgbImage) -> Result<(), WriteError> {
        let found = picture.dimensions().into();
        if found != self.size {
            return Err(WriteError::Size { found, first: self.size });
        }
        let [width, height] = self.even;
        let last = |i: u32, count: u32| i.min(count.saturating_sub(1));
        let doubled =
            || RgbImage::from_fn(width, height, |x, y| *picture.get_pixel(last(x, found[0]), last(y, found[1])));
        let source = if found == self.even { picture.clone() } else { doubled() };
        let planes = YUVBuffer::from_rgb8_source(RgbSliceU8::new(source.as_raw(), (width as usize, height as usize)));
        let coded = self.encoder.encode(&planes)?;
        let key = matches!(coded.frame_type(), FrameType::IDR);
        let before = self.data.len();
        let bytes = coded.to_vec();
        for unit in units(&bytes) {
            match unit[0] & 31 {
                7 => self.sets[0] = unit.to_vec(),
                8 => self.sets[1] = unit.to_vec(),
                1 | 5 => {
                    self.data.extend((unit.len() as u32).to_be_bytes());
                    self.data.extend(unit);
                }
                _ => {}
            }
        }
        if self.data.len() == before {
            return Err(WriteError::LeftOut(self.samples.len() + 1));
        }
        self.samples.push(((self.data.len() - before) as u32, key));
        Ok(())
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// A film of more than 4 GB.
    pub fn finish(self) -> Result<Vec<u8>, WriteError> {
        let head = boxed(*b"ftyp", &[b"isom", &be(&[0x200]), b"isomiso2avc1mp41"]);
        let index = self.index(0).len();
        let begin = head.len() + index + 8;
        if u32::try_from(begin + self.data.len()).is_err() {
            return Err(WriteError::TooLarge);
        }
        let mut file = head;
        file.extend(self.index(begin as u32));
        file.extend(be(&[self.data.len() as u32 + 8]));
        file.extend(b"mdat");
        file.extend(self.data);
        Ok(file)
    }

    /// The index of a film whose frames begin at an offset.
    fn index(&self, begin: u32) -> Vec<u8> {
        let count = self.samples.len() as u32;
        let (scale, lasts) = (UNITS * self.per_second, UNITS * count);
        let movie =
            [be(&[0, 0, 0, scale, lasts, 0x1_0000, 0x100_0000, 0, 0]), be(&UPRIGHT), be(&[0; 6]), be(&[2])].concat();
        let [width, height] = self.even;
        let track = [be(&[7, 0, 0, 1, 0, lasts, 0, 0, 0, 0]), be(&UPRIGHT), be(&[width << 16, height << 16])].concat();
        // 0x55c4 is no language.
        let media = be(&[0, 0, 0, scale, lasts, 0x55c4_0000]);
        let handler = [be(&[0, 0]), b"vide".to_vec(), be(&[0, 0, 0]), b"film\0".to_vec()].concat();
        let here = boxed(*b"dref", &[&be(&[0, 1]), &boxed(*b"url ", &[&be(&[1])])]);
        let keys: Vec<u32> = (1..=count).filter(|k| self.samples[*k as usize - 1].1).collect();
        let lengths: Vec<u32> = self.samples.iter().map(|s| s.0).collect();
        let table = boxed(
            *b"stbl",
            &[
                &boxed(*b"stsd", &[&be(&[0, 1]), &self.description()]),
                &boxed(*b"stts", &[&be(&[0, 1, count, UNITS])]),
                &boxed(*b"stss", &[&be(&[0, keys.len() as u32]), &be(&keys)]),
                // All in one chunk.
                &boxed(*b"stsc", &[&be(&[0, 1, 1, count, 1])]),
                &boxed(*b"stsz", &[&be(&[0, 0, count]), &be(&lengths)]),
                &boxed(*b"stco", &[&be(&[0, 1, begin])]),
            ],
        );
        let information = boxed(*b"minf", &[&boxed(*b"vmhd", &[&be(&[1, 0, 0])]), &boxed(*b"dinf", &[&here]), &table]);
        let media = boxed(*b"mdia", &[&boxed(*b"mdhd", &[&media]), &boxed(*b"hdlr", &[&handler]), &information]);
        boxed(*b"moov", &[&boxed(*b"mvhd", &[&movie]), &boxed(*b"trak", &[&boxed(*b"tkhd", &[&track]), &media])])
    }

    /// The sample entry: size, parameters and colours.
    fn description(&self) -> Vec<u8> {
        let [sequence, picture] = &self.sets;
        let length = |set: &[u8]| (set.len() as u16).to_be_bytes();
        let profile = sequence.get(1..4).unwrap_or(&[66, 0, 10]);
        let parameters = boxed(
            *b"avcC",
            &[&[1], profile, &[0xff, 0xe1], &length(sequence), sequence, &[1], &length(picture), picture],
        );
        // Primaries, transfer and matrix of BT.601, limited range.
        let colours = boxed(*b"colr", &[b"nclx", &[0, 6, 0, 6, 0, 6, 0]]);
        let sides = self.even.map(|s| (s as u16).to_be_bytes()).concat();
        let entry = [
            be(&[0, 1]),
            be(&[0; 4]),
            sides,
            be(&[0x48_0000, 0x48_0000, 0]),
            vec![0, 1],
            vec![0; 32],
            vec![0, 0x18, 0xff, 0xff],
        ];
        boxed(*b"avc1", &[&entry.concat(), &parameters, &colours])
    }
}

/// A box: its length, its kind, and what is inside.
fn boxed(kind: [u8; 4], content: &[&[u8]]) -> Vec<u8> {
    let length = 8 + content.iter().map(|c| c.len()).sum::<usize>();
    let mut out = (length as u32).to_be_bytes().to_vec();
    out.extend(kind);
    out.extend(content.concat());
    out
}

/// Numbers of four bytes each.
fn be(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_be_bytes()).collect()
}

/// The units of a stream that are parted by start codes (ITU-T H.264, annex B); none is empty.
fn units(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let starts: Vec<usize> =
        (0..stream.len().saturating_sub(2)).filter(|&i| stream[i..i + 3] == [0, 0, 1]).map(|i| i + 3).collect();
    let ends: Vec<usize> = starts.iter().skip(1).map(|s| s - 3).chain([stream.len()]).collect();
    starts.into_iter().zip(ends).filter_map(|(from, to)| {
        // A zero before a start code belongs to it.
        let unit = stream.get(from..to)?;
        let used = unit.iter().rposition(|b| *b != 0)?;
        unit.get(..=used)
    })
}

#[cfg(test)]
mod tests {
    use super::super::Film;
    use super::*;
    use image::Rgb;
    use rand::{RngExt, SeedableRng};

    /// A bright square of 12 px that goes 3 px to the right a frame over a slope of colours.
    fn moving(size: [u32; 2], frames: u32) -> Vec<RgbImage> {
        let one = |k: u32| {
            RgbImage::from_fn(size[0], size[1], |x, y| {
                if (3 * k..3 * k + 12).contains(&x) && (8..20).contains(&y) {
                    Rgb([250, 240, 60])
                } else {
                    Rgb([(40 + x) as u8, 90, (60 + 2 * y) as u8])
                }
            })
        };
        (0..frames).map(one).collect()
    }

    /// Noise of every pixel, different in every frame: its bits are a matter of the quantiser alone. Three times 6 more is a step eight times as
    /// large, and a film of such frames is less than half as long.
    #[test]
    fn the_quantiser_is_kept_to() {
        let mut random = rand_pcg::Pcg32::seed_from_u64(3);
        let mut noisy = || RgbImage::from_fn(64, 64, |_, _| Rgb([random.random_range(108..148_u8); 3]));
        let frames: Vec<RgbImage> = (0..6).map(|_| noisy()).collect();
        let length = |quantiser: u8| {
            let mut writer = FilmWriter::with_quantiser([64, 64], 25, quantiser).unwrap();
            for frame in &frames {
                writer.frame(frame).unwrap();
            }
            writer.finish().unwrap().len()
        };
        let (fine, coarse) = (length(18), length(36));
        assert!(fine > 2 * coarse, "{fine} and {coarse} bytes");
    }

    /// Read back by the reader of films, and its index by another one: every frame, in order, at its time, within what coding loses.
    #[test]
    fn what_is_written_is_read_back_frame_by_frame() {
        let folder = tempfile::tempdir().unwrap();
        for (size, even) in [([96, 64], [96, 64]), ([75, 49], [76, 50])] {
            let frames = moving(size, 20);
            let mut writer = FilmWriter::new(size, 8).unwrap();
            for frame in &frames {
                writer.frame(frame).unwrap();
            }
            let bytes = writer.finish().unwrap();
            let samples = re_mp4::Mp4::read_bytes(&bytes).unwrap().tracks().values().next().unwrap().samples.len();
            assert_eq!(samples, 20);
            let path = folder.path().join("film.mp4");
            std::fs::write(&path, &bytes).unwrap();
            let mut film = Film::open(&path, &|| false).unwrap();
            assert_eq!((film.len(), film.size(), film.remark()), (20, even, None));
            // Out of order, so that decoding begins at a key in the middle.
            for k in [19, 0, 1, 16, 15, 7] {
                assert!((film.time_s(k).unwrap() - k as f64 / 8.0).abs() < 1e-9);
                let read = film.frame(k, &|| false).unwrap();
                let off = |(x, y, p): (u32, u32, &Rgb<u8>)| {
                    let q = read.get_pixel(x, y).0;
                    p.0.iter().zip(q).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0
                };
                let mean = frames[k].enumerate_pixels().map(off).sum::<f64>() / f64::from(size[0] * size[1]);
                assert!(mean < 3.0, "frame {k}: {mean}");
                let neighbour = frames[if k == 0 { 1 } else { k - 1 }].enumerate_pixels().map(off).sum::<f64>();
                assert!(neighbour / f64::from(size[0] * size[1]) > mean + 1.0, "frame {k} is none of its neighbours");
            }
        }
    }

    #[test]
    fn a_frame_of_another_size_is_refused() {
        let mut writer = FilmWriter::new([32, 32], 25).unwrap();
        let said = writer.frame(&RgbImage::new(32, 34)).unwrap_err().to_string();
        assert_eq!(said, "a frame of the film has [32, 34] px, the first had [32, 32]");
    }

    /// Units by hand: start codes of three and of four bytes, and zeros at the end.
    #[test]
    fn units_are_parted_at_start_codes() {
        let stream = [0, 0, 0, 1, 0x67, 9, 0, 0, 1, 0x68, 7, 0, 0, 0, 1, 0x65, 0, 3, 0, 0];
        let found: Vec<&[u8]> = units(&stream).collect();
        assert_eq!(found, [&[0x67, 9][..], &[0x68, 7], &[0x65, 0, 3]]);
    }
}
