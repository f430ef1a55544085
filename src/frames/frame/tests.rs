//! Frames are read from files made here: every format, depth and orientation, and every way in which a file can be wrong.

use std::io::Write;

use image::{ExtendedColorType, ImageBuffer, Luma, LumaA, Rgba};
use proptest::prelude::*;

use super::*;

/// 5 × 3, every pixel another colour.
fn picture() -> RgbImage {
    RgbImage::from_fn(5, 3, |x, y| Rgb([(x * 50) as u8, (y * 80) as u8, (x * 10 + y) as u8]))
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn decode(bytes: &[u8]) -> Result<Frame, FrameError> {
    Frame::decode(Path::new("frame"), bytes)
}

#[test]
fn lossless_formats_come_back_to_the_bit_under_any_name() {
    let folder = tempfile::tempdir().unwrap();
    for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tiff, ImageFormat::WebP] {
        let path = folder.path().join("frame.dat");
        std::fs::write(&path, encoded(&picture().into(), format)).unwrap();
        let frame = Frame::read(&path).unwrap();
        assert_eq!(frame.image(), &picture(), "{format:?}");
        assert_eq!(frame.sha256(), Frame::sha256_of(&path).unwrap());
    }
}

#[test]
fn jpeg_comes_back_within_its_own_loss() {
    let grey = RgbImage::from_pixel(40, 30, Rgb([90, 120, 150]));
    let frame = decode(&encoded(&grey.clone().into(), ImageFormat::Jpeg)).unwrap();
    assert_eq!((frame.width(), frame.height()), (40, 30));
    let worst = frame.image().iter().zip(grey.iter()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst <= 3, "{worst}");
}

#[test]
fn the_hash_is_that_of_the_bytes() {
    // FIPS 180-2, appendix B.1: SHA-256 of "abc".
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"abc").unwrap();
    assert_eq!(
        Frame::sha256_of(file.path()).unwrap(),
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    );
}

#[test]
fn every_depth_becomes_eight_bits() {
    let grey8: DynamicImage = ImageBuffer::from_pixel(2, 2, Luma([77_u8])).into();
    assert_eq!(decode(&encoded(&grey8, ImageFormat::Png)).unwrap().image().get_pixel(1, 1).0, [77; 3]);

    // 0x8000 / 0xffff × 255 = 127.5019, which rounds to 128; 0x1234 → 18.13 → 18.
    let rgb16: DynamicImage = ImageBuffer::from_pixel(2, 2, Rgb([0x8000_u16, 0x1234, 0xffff])).into();
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        assert_eq!(decode(&encoded(&rgb16, format)).unwrap().image().get_pixel(0, 1).0, [128, 18, 255]);
    }

    let grey16: DynamicImage = ImageBuffer::from_pixel(2, 2, Luma([0x4040_u16])).into();
    assert_eq!(decode(&encoded(&grey16, ImageFormat::Tiff)).unwrap().image().get_pixel(0, 1).0, [64; 3]);

    // Float: 0 to 1; outside is clamped, and not-a-number does not panic.
    let float: Vec<f32> = vec![0.5, -3.0, 7.0, f32::NAN, 0.25, 1.0];
    let bytes: Vec<u8> = float.iter().flat_map(|v| v.to_ne_bytes()).collect();
    let mut file = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut file, &bytes, 2, 1, ExtendedColorType::Rgb32F, ImageFormat::Tiff).unwrap();
    let frame = decode(&file.into_inner()).unwrap();
    assert_eq!(frame.image().get_pixel(0, 0).0, [128, 0, 255]);
    assert_eq!(frame.image().get_pixel(1, 0).0[1..], [64, 255]);
}

#[test]
fn transparency_lies_over_white() {
    // 100 at half opacity over white: (100 × 128 + 255 × 127) / 255 = 177.2.
    let rgba: DynamicImage = ImageBuffer::from_pixel(2, 2, Rgba([100_u8, 0, 255, 128])).into();
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        assert_eq!(decode(&encoded(&rgba, format)).unwrap().image().get_pixel(0, 0).0, [177, 127, 255]);
    }
    let clear: DynamicImage = ImageBuffer::from_pixel(2, 2, LumaA([0_u8, 0])).into();
    assert_eq!(decode(&encoded(&clear, ImageFormat::Png)).unwrap().image().get_pixel(0, 0).0, [255; 3]);
}

/// A TIFF block with the orientation tag alone, as EXIF stores it.
fn exif(orientation: u8) -> Vec<u8> {
    let mut block = b"MM\0\x2a\0\0\0\x08".to_vec();
    block.extend([0, 1]); // one entry
    block.extend([0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0]);
    block.extend([0; 4]);
    block
}

/// Where the stored pixel (x, y) of a w × h picture is shown, from the words of the EXIF standard:
/// which side the 0th row and the 0th column lie on.
fn shown_at(orientation: u8, x: u32, y: u32, w: u32, h: u32) -> (u32, u32) {
    match orientation {
        1 => (x, y),                 // row 0 top, column 0 left
        2 => (w - 1 - x, y),         // top, right
        3 => (w - 1 - x, h - 1 - y), // bottom, right
        4 => (x, h - 1 - y),         // bottom, left
        5 => (y, x),                 // left, top
        6 => (h - 1 - y, x),         // right, top
        7 => (h - 1 - y, w - 1 - x), // right, bottom
        _ => (y, w - 1 - x),         // left, bottom
    }
}

#[test]
fn all_eight_orientations_are_turned_upright() {
    // Blocks of 16 × 16 px, so that JPEG keeps their centres.
    let stored = RgbImage::from_fn(48, 32, |x, y| Rgb([(x / 16 * 100) as u8, (y / 16 * 200) as u8, 60]));
    let (w, h) = stored.dimensions();
    let jpeg = encoded(&stored.clone().into(), ImageFormat::Jpeg);
    let png = encoded(&stored.clone().into(), ImageFormat::Png);
    for orientation in 1..=8 {
        let block = exif(orientation);
        // JPEG: an APP1 segment behind the start-of-image marker.
        let mut app1 = vec![0xff, 0xe1];
        app1.extend((block.len() as u16 + 8).to_be_bytes());
        app1.extend(b"Exif\0\0");
        app1.extend(&block);
        let tagged_jpeg = [&jpeg[..2], &app1, &jpeg[2..]].concat();
        // PNG: an eXIf chunk behind the 33 bytes of signature and header.
        let mut chunk = b"eXIf".to_vec();
        chunk.extend(&block);
        let crc = crc32(&chunk);
        let tagged_png =
            [&png[..33], &(block.len() as u32).to_be_bytes(), &chunk, &crc.to_be_bytes(), &png[33..]].concat();
        for bytes in [tagged_jpeg, tagged_png, tiff(&stored, u16::from(orientation))] {
            let frame = decode(&bytes).unwrap();
            let turned = orientation >= 5;
            assert_eq!((frame.width(), frame.height()), if turned { (h, w) } else { (w, h) });
            for (x, y) in [(8, 8), (24, 8), (40, 8), (8, 24), (40, 24)] {
                let (u, v) = shown_at(orientation, x, y, w, h);
                let (a, b) = (stored.get_pixel(x, y), frame.image().get_pixel(u, v));
                assert!(a.0.iter().zip(b.0).all(|(a, b)| a.abs_diff(b) < 8), "{orientation}: {a:?} {b:?}");
            }
        }
    }
}

/// CRC of a PNG chunk (PNG specification, annex D).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

/// The smallest uncompressed TIFF with an orientation tag.
fn tiff(image: &RgbImage, orientation: u16) -> Vec<u8> {
    let (w, h) = image.dimensions();
    let pixels = image.as_raw();
    let entries: [(u16, u16, u32, u32); 10] = [
        (256, 4, 1, w),
        (257, 4, 1, h),
        (258, 3, 3, 8 + pixels.len() as u32),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (273, 4, 1, 8),
        (274, 3, 1, u32::from(orientation)),
        (277, 3, 1, 3),
        (278, 4, 1, h),
        (279, 4, 1, pixels.len() as u32),
    ];
    let mut bytes = b"II\x2a\0".to_vec();
    bytes.extend((8 + pixels.len() as u32 + 6).to_le_bytes());
    bytes.extend(pixels);
    bytes.extend([8_u16, 8, 8].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    bytes
}

#[test]
fn a_file_cut_short_anywhere_is_refused_in_one_line() {
    let picture =
        RgbImage::from_fn(60, 40, |x, y| Rgb([((x * 37) ^ (y * 11)) as u8, (x * y) as u8, (x + 91 * y) as u8]));
    for (format, _) in READ {
        let whole = encoded(&picture.clone().into(), format);
        for length in (0..whole.len()).step_by((whole.len() / 300).max(1)) {
            // JPEG shows what it has of a scan, and a few bytes of padding may be missing from any format.
            if let Err(error) = decode(&whole[..length]) {
                let text = error.to_string();
                assert!(text.starts_with("frame: ") && !text.contains('\n'), "{text}");
            }
        }
        assert!(decode(&whole[..whole.len() / 4]).is_err() || format == ImageFormat::Jpeg, "{format:?}");
    }
}

/// A PNG of nothing but a header that declares a size.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 2, 0, 0, 0]);
    let crc = crc32(&header);
    let start = [&b"\x89PNG\r\n\x1a\n"[..], &13_u32.to_be_bytes(), &header, &crc.to_be_bytes()].concat();
    // The start of a data chunk, without which a reader waits for more header.
    [&start[..], &8_u32.to_be_bytes(), b"IDAT", &[0x78, 0x9c, 1, 0, 0, 0, 0, 0], &[0; 4]].concat()
}

#[test]
fn a_picture_over_the_limit_is_refused_by_its_header() {
    let error = decode(&png_header(100_000, 100_000)).unwrap_err();
    assert!(matches!(error, FrameError::TooLarge { width: 100_000, height: 100_000, .. }), "{error}");
    assert!(error.to_string().contains("8192 × 8192"));
    assert!(matches!(decode(&png_header(8193, 1)), Err(FrameError::TooLarge { .. })));
    // At the limit the size is accepted, and only then is the missing data found.
    assert!(matches!(decode(&png_header(8192, 4)), Err(FrameError::Damaged { .. })));

    let mut bmp = encoded(&picture().into(), ImageFormat::Bmp);
    bmp[18..22].copy_from_slice(&90_000_u32.to_le_bytes());
    assert!(matches!(decode(&bmp), Err(FrameError::TooLarge { width: 90_000, .. } | FrameError::Damaged { .. })));
}

#[test]
fn what_is_not_a_picture_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Frame::read(&path).unwrap_err().to_string()
    };
    assert!(message("empty.png", b"").contains("the file is empty"));
    assert!(message("notes.png", b"x,y\n1,2\n").contains("a text file; PNG, JPEG, BMP, TIFF and WebP"));
    assert!(message("anim.gif", b"GIF89a\x01\0\x01\0\0\0\0").contains("a GIF picture"));
    assert!(message("phone.jpg", b"\0\0\0\x18ftypheic\0\0\0\0").contains("a HEIC picture"));
    assert!(message("film.png", b"\0\0\0\x18ftypisom\0\0\0\0").contains("a film"));
    assert!(message("noise.png", &[0xfe, 0, 1, 2]).contains("not a picture that is known here"));
    assert!(Frame::read(folder.path()).unwrap_err().to_string().contains("this is a folder"));
    assert!(matches!(Frame::read(&folder.path().join("gone.png")), Err(FrameError::NotFound { .. })));
    // A path that goes through a file.
    assert!(matches!(Frame::read(&folder.path().join("notes.png/x.png")), Err(FrameError::NotFound { .. })));
    assert!(matches!(Frame::sha256_of(&folder.path().join("gone.png")), Err(FrameError::NotFound { .. })));
}

#[cfg(unix)]
#[test]
fn a_device_is_refused_without_being_read() {
    assert!(matches!(Frame::read(Path::new("/dev/zero")), Err(FrameError::NotAFile { .. })));
}

proptest! {
    #[test]
    fn flipped_bytes_never_panic(which in 0..READ.len(), flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let mut bytes = encoded(&picture().into(), READ[which].0);
        for (index, value) in flips {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        // A result of either kind is an answer.
        let _ = decode(&bytes);
    }
}
