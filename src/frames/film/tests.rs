//! Films made here or rendered from a twin: order, random access, and what becomes of damaged files.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};
use rand::{RngExt, SeedableRng};

use super::*;

const WHOLE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4"));
const FRAGMENTED: &[u8] =
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise_fragmented.mp4"));

fn never() -> bool {
    false
}

fn file(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The film of a file, read here or not at all.
fn own(path: &Path) -> Result<Film, String> {
    match Film::open_own(path) {
        Ok(Own::Film(film)) => Ok(film),
        Ok(Own::Other(what)) => Err(what),
        Err(e) => {
            let text = e.to_string();
            assert!(!text.contains('\n') && text.chars().count() < 500, "{text}");
            Err(text)
        }
    }
}

fn all(film: &mut Film, by: usize) -> Result<Vec<RgbImage>, FilmError> {
    let mut images = Vec::new();
    film.each(0, by, &never, &mut |index, image| {
        assert_eq!(index, images.len());
        images.push(image);
        ControlFlow::Continue(())
    })?;
    Ok(images)
}

/// The films have a white bar of 4 px a frame in their topmost rows.
fn bar(image: &RgbImage) -> usize {
    (0..image.width()).filter(|&x| image.get_pixel(x, 3).0[1] > 225).count().div_ceil(4)
}

#[test]
fn frames_of_h264_come_in_the_order_of_showing_from_any_place() {
    let folder = tempfile::tempdir().unwrap();
    let films = [("whole.mp4", WHOLE), ("fragmented.mp4", FRAGMENTED)];
    let mut films = films.map(|(name, bytes)| own(&file(&folder, name, bytes)).unwrap());
    let [whole, fragmented] = films.each_mut().map(|film| {
        assert_eq!((film.len(), film.size(), film.remark()), (24, [96, 96], None));
        all(film, 1).unwrap()
    });
    // B-frames are decoded in another order than they are shown in; every bar is one step longer than the one before.
    assert_eq!(whole.iter().map(bar).collect::<Vec<_>>(), (1..=24).collect::<Vec<_>>());
    assert!(whole == fragmented);
    for index in [23, 0, 11, 10, 9, 19] {
        assert!(films[0].frame(index, &never).unwrap() == whole[index], "{index}");
    }
    assert!((films[0].time_s(10).unwrap() - 0.4).abs() < 1e-9, "25 frames a second");
    assert!(matches!(films[0].frame(24, &never), Err(FilmError::NoSuchFrame { number: 25, count: 24, .. })));
    assert!(matches!(films[0].frame(3, &|| true), Err(FilmError::Stopped)));
    let small = all(&mut films[0], 2).unwrap();
    assert!(small.iter().all(|i| i.dimensions() == (48, 48)));
}

/// The index is read here; another reader of the format must find the same frames.
#[test]
fn the_index_agrees_with_another_reader() {
    let folder = tempfile::tempdir().unwrap();
    for bytes in [WHOLE, FRAGMENTED] {
        let other = re_mp4::Mp4::read_bytes(bytes).unwrap();
        let theirs = &other.tracks().values().next().unwrap().samples;
        let path = file(&folder, "film.mp4", bytes);
        let mut open = fs::File::open(&path).unwrap();
        let size = bytes.len() as u64;
        let top = boxes::top_level(&mut open, size, 100).unwrap();
        let moov = top.iter().find(|b| &b.kind == b"moov").unwrap();
        let index = boxes::read_content(&mut open, moov).unwrap();
        let mut track = index::video_track(&index, size).unwrap();
        for b in top.iter().filter(|b| &b.kind == b"moof") {
            let content = boxes::read_content(&mut open, b).unwrap();
            track.add_fragment(&index, &content, b.start).unwrap();
        }
        assert_eq!(track.samples.len(), theirs.len());
        let first = track.samples.iter().map(|s| s.shown_at).min().unwrap();
        let first_of_theirs = theirs.iter().map(|s| s.composition_timestamp).min().unwrap();
        for (ours, theirs) in track.samples.iter().zip(theirs) {
            assert_eq!((ours.offset, u64::from(ours.size), ours.key), (theirs.offset, theirs.size, theirs.is_sync));
            assert_eq!(ours.shown_at - first, theirs.composition_timestamp - first_of_theirs);
        }
    }
}

fn at(bytes: &[u8], kind: &[u8]) -> usize {
    bytes.windows(4).position(|w| w == kind).unwrap()
}

#[test]
fn a_turned_film_is_turned_upright() {
    let folder = tempfile::tempdir().unwrap();
    let lying = own(&file(&folder, "a.mp4", WHOLE)).unwrap().frame(5, &never).unwrap();
    let mut bytes = WHOLE.to_vec();
    // The matrix [0 1 0; -1 0 0; 0 0 1] of a phone held upright, 40 bytes into the track header.
    let matrix = at(&bytes, b"tkhd") + 4 + 40;
    for (place, value) in [(0, 0_i32), (4, 0x1_0000), (12, -0x1_0000), (16, 0)] {
        bytes[matrix + place..matrix + place + 4].copy_from_slice(&value.to_be_bytes());
    }
    let turned = own(&file(&folder, "b.mp4", &bytes)).unwrap().frame(5, &never).unwrap();
    assert!(turned == image::imageops::rotate90(&lying));
}

#[test]
fn pixels_become_square() {
    let upright = Upright { quarter_turns: 1, pixel_aspect: [4, 3] };
    assert_eq!(upright.size([1440, 1080]), [1080, 1920]);
    assert_eq!(upright.apply(RgbImage::new(12, 5)).dimensions(), (5, 16));
    assert_eq!(Upright { pixel_aspect: [u32::MAX, 1], ..upright }.size([10, 20]), [20, 10]);
}

#[test]
fn what_cannot_be_read_says_so_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let message = |bytes: &[u8]| own(&file(&folder, "x.mp4", bytes)).err().unwrap();
    let changed = |kind: &[u8; 4], offset: usize, to: &[u8]| {
        let mut bytes = WHOLE.to_vec();
        let place = at(&bytes, kind) + offset;
        bytes[place..place + to.len()].copy_from_slice(to);
        bytes
    };
    assert!(message(&changed(b"hdlr", 12, b"soun")).contains("no video"));
    let mut other = WHOLE.to_vec();
    let place = at(&other, b"stsd") + 16;
    other[place..place + 4].copy_from_slice(b"hvc1");
    assert_eq!(message(&other), "HEVC (H.265) video");
    // A thousand million frames: in a list that is not there, and of one byte each.
    let many = 1_000_000_000_u32.to_be_bytes();
    assert!(message(&changed(b"stsz", 12, &many)).contains("`stsz`"));
    let one_byte = [1_u32.to_be_bytes(), many].concat();
    assert!(message(&changed(b"stsz", 8, &one_byte)).contains("1000000000 frames"));
    assert!(message(&WHOLE[..500]).contains("cut short before its index"), "{}", message(&WHOLE[..500]));
    assert!(message(b"").contains("is empty"));
    assert!(message(b"no film at all").contains("not known here"));
    let gone = Film::open(&folder.path().join("gone.mp4"), &never).err().unwrap();
    assert!(gone.to_string().contains("no such file"));
    let none = Film::open(folder.path(), &never).err().unwrap();
    assert!(none.to_string().contains("no PNG"), "{none}");
}

#[test]
fn a_film_that_broke_off_has_its_frames_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    // The index goes before the frames, as a film for the web has it.
    let (moov, mdat) = (at(WHOLE, b"moov") - 4, at(WHOLE, b"mdat") - 4);
    assert!(mdat < moov);
    let mut bytes = WHOLE[..mdat].to_vec();
    let mut index = WHOLE[moov..].to_vec();
    let stco = at(&index, b"stco") + 12;
    let shift = (WHOLE.len() - moov) as u32;
    let offset = u32::from_be_bytes(index[stco..stco + 4].try_into().unwrap());
    index[stco..stco + 4].copy_from_slice(&(offset + shift).to_be_bytes());
    bytes.extend_from_slice(&index);
    bytes.extend_from_slice(&WHOLE[mdat..moov]);
    let whole = own(&file(&folder, "web.mp4", &bytes)).unwrap();
    assert_eq!((whole.len(), whole.remark()), (24, None));
    let mut short = own(&file(&folder, "short.mp4", &bytes[..bytes.len() - 900])).unwrap();
    let count = short.len();
    assert!((10..24).contains(&count));
    assert!(short.remark().unwrap().contains(&format!("{} of its frames are missing", 24 - count)));
    assert!((0..10).all(|i| bar(&short.frame(i, &never).unwrap()) == i + 1));
}

/// Cut anywhere and with any byte changed, a film is read or refused; it never panics, and never asks for more memory than a film may.
#[test]
fn damaged_films_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let films: [(&str, Vec<u8>); 5] = [
        ("a.mp4", WHOLE.to_vec()),
        ("b.mp4", FRAGMENTED.to_vec()),
        ("c.gif", gif(&numbered(4))),
        ("d.png", apng(&numbered(4))),
        ("e.avi", avi_of_jpegs(&numbered(4))),
    ];
    let mut random = rand_pcg::Pcg32::seed_from_u64(7);
    for (name, bytes) in films {
        let try_it = |bytes: &[u8]| {
            if let Ok(mut film) = own(&file(&folder, name, bytes)) {
                assert!(film.len() <= index::MAX_FRAMES);
                let mut left = 40;
                let done = film.each(0, 4, &never, &mut |_, image| {
                    assert!(image.width() <= MAX_SIDE_PX);
                    left -= 1;
                    if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                });
                assert!(done.err().is_none_or(|e| !e.to_string().contains('\n')));
            }
        };
        for length in (0..bytes.len()).step_by(bytes.len() / 50) {
            try_it(&bytes[..length]);
        }
        // Headers and index decide; half of the changes go there.
        let from = bytes.windows(4).position(|w| w == b"moov").unwrap_or(0);
        let index_end = (from + 1200).min(bytes.len());
        for round in 0..120 {
            let mut changed = bytes.clone();
            for _ in 0..=round % 3 {
                let place = if round % 2 == 0 {
                    random.random_range(from..index_end)
                } else {
                    random.random_range(0..bytes.len())
                };
                changed[place] = random.random();
            }
            try_it(&changed);
        }
    }
}

/// Pictures that can be told apart, exactly also in a palette of 256 colours.
fn numbered(count: u8) -> Vec<RgbImage> {
    (0..count).map(|n| RgbImage::from_fn(24, 16, |x, _| Rgb([if x < 12 { 0 } else { 255 }, n * 50, 90]))).collect()
}

fn gif(images: &[RgbImage]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::gif::GifEncoder::new(&mut bytes);
    for image in images {
        let rgba = image::DynamicImage::ImageRgb8(image.clone()).into_rgba8();
        let delay = image::Delay::from_numer_denom_ms(40, 1);
        encoder.encode_frame(image::Frame::from_parts(rgba, 0, 0, delay)).unwrap();
    }
    drop(encoder);
    bytes
}

/// An animated PNG, put together from the chunks of single ones.
fn apng(images: &[RgbImage]) -> Vec<u8> {
    let mut number = 0_u32;
    let mut out = Vec::new();
    for (i, image) in images.iter().enumerate() {
        let mut png = std::io::Cursor::new(Vec::new());
        image.write_to(&mut png, image::ImageFormat::Png).unwrap();
        let png = png.into_inner();
        if i == 0 {
            out.extend_from_slice(&png[..33]);
            let count = images.len() as u32;
            out.extend(still::chunk(b"acTL", &[count.to_be_bytes(), 0_u32.to_be_bytes()].concat()));
        }
        let mut control = Vec::new();
        for value in [number, image.width(), image.height(), 0, 0] {
            control.extend_from_slice(&value.to_be_bytes());
        }
        // 40 ms; nothing is cleared or blended.
        control.extend_from_slice(&[0, 40, 3, 232, 0, 0]);
        number += 1;
        out.extend(still::chunk(b"fcTL", &control));
        let mut at = 33;
        while at < png.len() {
            let length = u32::from_be_bytes(png[at..at + 4].try_into().unwrap()) as usize;
            if &png[at + 4..at + 8] == b"IDAT" {
                let data = &png[at + 8..at + 8 + length];
                if i == 0 {
                    out.extend(still::chunk(b"IDAT", data));
                } else {
                    out.extend(still::chunk(b"fdAT", &[&number.to_be_bytes()[..], data].concat()));
                    number += 1;
                }
            }
            at += 12 + length;
        }
    }
    out.extend(still::chunk(b"IEND", &[]));
    out
}

fn riff(kind: [u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = [&kind[..], &(content.len() as u32).to_le_bytes(), content].concat();
    if content.len() % 2 == 1 {
        bytes.push(0);
    }
    bytes
}

/// An AVI file of frames at 25 a second.
fn avi(size: [u32; 2], compression: [u8; 4], bits: u16, frames: &[Vec<u8>]) -> Vec<u8> {
    let list = |kind: [u8; 4], content: Vec<u8>| riff(*b"LIST", &[&kind[..], &content].concat());
    let mut header = b"vids\0\0\0\0".to_vec();
    for value in [0_u32, 0, 0, 1, 25, 0, frames.len() as u32] {
        header.extend_from_slice(&value.to_le_bytes());
    }
    let mut format = 40_u32.to_le_bytes().to_vec();
    format.extend_from_slice(&[size[0].to_le_bytes(), size[1].to_le_bytes()].concat());
    format.extend_from_slice(&[1_u16.to_le_bytes(), bits.to_le_bytes()].concat());
    format.extend_from_slice(&compression);
    format.resize(40, 0);
    let stream = list(*b"strl", [riff(*b"strh", &header), riff(*b"strf", &format)].concat());
    let headers = list(*b"hdrl", [riff(*b"avih", &[0; 56]), stream].concat());
    let kind = if compression == [0; 4] { *b"00db" } else { *b"00dc" };
    let movie = list(*b"movi", frames.iter().flat_map(|f| riff(kind, f)).collect());
    riff(*b"RIFF", &[b"AVI ".to_vec(), headers, movie].concat())
}

fn avi_of_jpegs(images: &[RgbImage]) -> Vec<u8> {
    let frames: Vec<Vec<u8>> = images
        .iter()
        .map(|image| {
            let mut bytes = Vec::new();
            image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100).encode_image(image).unwrap();
            bytes
        })
        .collect();
    avi([24, 16], *b"MJPG", 24, &frames)
}

#[test]
fn gif_apng_and_avi_are_films() {
    let folder = tempfile::tempdir().unwrap();
    let images = numbered(5);
    let raw: Vec<Vec<u8>> = images
        .iter()
        .map(|i| i.rows().rev().flat_map(|r| r.flat_map(|p| [p.0[2], p.0[1], p.0[0]]).collect::<Vec<_>>()).collect())
        .collect();
    let films = [
        ("a.gif", gif(&images), 0),
        ("b.png", apng(&images), 0),
        ("c.avi", avi([24, 16], [0; 4], 24, &raw), 0),
        ("d.avi", avi_of_jpegs(&images), 12),
    ];
    for (name, bytes, tolerance) in films {
        let mut film = own(&file(&folder, name, &bytes)).unwrap();
        assert_eq!((film.len(), film.size()), (5, [24, 16]), "{name}");
        assert!((film.time_s(3).unwrap() - 0.12).abs() < 1e-9, "{name}: 40 ms a frame");
        let near = |a: &RgbImage, b: &RgbImage| a.iter().zip(b.iter()).all(|(a, b)| a.abs_diff(*b) <= tolerance);
        let read = all(&mut film, 1).unwrap();
        assert!(read.iter().zip(&images).all(|(a, b)| near(a, b)), "{name}");
        assert!(near(&film.frame(3, &never).unwrap(), &images[3]), "{name}");
    }
    let absurd = avi([70_000, 16], *b"MJPG", 24, &[vec![0]]);
    assert!(own(&file(&folder, "e.avi", &absurd)).err().unwrap().contains("70000 × 16"));
    let unknown = avi([24, 16], *b"XVID", 24, &[vec![0]]);
    assert_eq!(own(&file(&folder, "f.avi", &unknown)).err().unwrap(), "AVI video of the kind `XVID`");
    let one = file(&folder, "one.gif", &gif(&numbered(1)));
    assert!(Film::open(&one, &never).err().unwrap().to_string().contains("only one frame"));
    let png = folder.path().join("plain.png");
    images[0].save(&png).unwrap();
    assert!(own(&png).err().unwrap().contains("only one frame"));
}

#[test]
fn a_folder_of_pictures_is_a_film_without_times() {
    let folder = tempfile::tempdir().unwrap();
    let images = numbered(3);
    for (i, image) in images.iter().enumerate() {
        image.save(folder.path().join(format!("f{i}.png"))).unwrap();
    }
    let mut film = Film::open(folder.path(), &never).unwrap();
    assert_eq!((film.len(), film.size(), film.time_s(1), film.divisor(10)), (3, [24, 16], None, 3));
    assert!(all(&mut film, 1).unwrap() == images);
}

/// Only where the program is; its frames of the same film are the same pictures but for rounding.
#[test]
fn ffmpeg_gives_the_same_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, "-film 1.mp4", WHOLE);
    let Some(mut piped) = ffmpeg::Piped::open(&path, &never).unwrap() else {
        eprintln!("skipped: there is no ffmpeg on the search path");
        return;
    };
    let mut ours = own(&path).unwrap();
    assert_eq!((piped.count(), piped.size()), (24, [96, 96]));
    let mut left = 3;
    piped
        .each(&path, 9, 1, &never, &mut |index, image| {
            let own = ours.frame(index, &never).unwrap();
            let mean = image.iter().zip(own.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / 27648.0;
            assert!(mean < 1.5, "{index}: {mean}");
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    let text = file(&folder, "text.mkv", b"no film");
    let said = ffmpeg::Piped::open(&text, &never).err().unwrap().to_string();
    assert!(said.contains("ffmpeg cannot read it") && !said.contains('\n'), "{said}");
}
