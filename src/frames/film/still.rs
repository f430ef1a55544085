//! A frame of a film as a picture file: PNG, with where it comes from written in it.

use image::{ImageError, ImageFormat, RgbImage};

use crate::frames::Compression;

/// Where a frame comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// Name of the film.
    pub film: String,
    /// Number of the frame, from 1.
    pub number: usize,
    /// When it is shown, s from the first.
    pub time_s: Option<f64>,
    /// What it owes to other frames.
    pub compression: Compression,
}

/// What stands before it in the chunk: keyword, no compression, no language; PNG specification 11.3.4.5.
const BEFORE: &[u8] = b"iTXtSource\0\0\0\0\0";

impl Origin {
    /// Where the head of a PNG file says that the picture was taken from, if [`still_png`] wrote it.
    pub fn in_png(head: &[u8]) -> Option<Self> {
        let (length, rest) = head.get(PNG_HEAD..)?.split_at_checked(4)?;
        let length = u32::from_be_bytes(length.try_into().ok()?) as usize;
        let text = rest.get(..length.checked_add(4)?)?.strip_prefix(BEFORE)?;
        let (film, rest) = std::str::from_utf8(text).ok()?.rsplit_once(", frame ")?;
        let mut said = rest.split(", ");
        let number = said.next()?.parse().ok().filter(|n| *n > 0)?;
        let (mut time_s, mut compression) = (None, Compression::Unknown);
        for words in said {
            match Compression::of_words(words) {
                Some(known) => compression = known,
                None => time_s = words.strip_suffix(" s").and_then(|t| t.parse().ok()),
            }
        }
        Some(Self { film: film.to_owned(), number, time_s, compression })
    }
}

/// The bytes of a PNG file with the picture and, as its text `Source`, where it comes from. The same frame gives the same bytes, and so
/// the same hash in a project.
///
/// # Errors
/// Those of the encoder; an 8-bit RGB picture with pixels has none.
pub fn still_png(image: &RgbImage, origin: &Origin) -> Result<Vec<u8>, ImageError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    let mut bytes = bytes.into_inner();
    let time = origin.time_s.map(|t| format!(", {t:.3} s")).unwrap_or_default();
    let kind = origin.compression.words().map(|w| format!(", {w}")).unwrap_or_default();
    let text = format!("{}, frame {}{time}{kind}", origin.film, origin.number);
    let (kind, before) = BEFORE.split_at(4);
    let at = PNG_HEAD.min(bytes.len());
    bytes.splice(at..at, chunk(kind, &[before, text.as_bytes()].concat()));
    Ok(bytes)
}

/// Bytes of the signature and the first chunk, which is always the header.
const PNG_HEAD: usize = 8 + 25;

pub(super) fn chunk(kind: &[u8], content: &[u8]) -> Vec<u8> {
    let mut bytes = (content.len() as u32).to_be_bytes().to_vec();
    bytes.extend_from_slice(kind);
    bytes.extend_from_slice(content);
    let sum = crc32(bytes.get(4..).unwrap_or_default());
    bytes.extend_from_slice(&sum.to_be_bytes());
    bytes
}

/// The sum of PNG, bit by bit: a text of a hundred letters needs no table.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, b| {
        (0..8).fold(sum ^ u32::from(*b), |s, _| if s & 1 == 1 { s >> 1 ^ 0xedb8_8320 } else { s >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_still_is_the_picture_and_says_where_it_comes_from() {
        // The check value of this sum, as every catalogue of them has it.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        let image = RgbImage::from_fn(5, 4, |x, y| image::Rgb([x as u8 * 9, y as u8 * 7, 3]));
        let origin =
            Origin { film: "smile é.mp4".to_owned(), number: 57, time_s: Some(1.9), compression: Compression::Inter };
        let bytes = still_png(&image, &origin).unwrap();
        assert_eq!(image::load_from_memory(&bytes).unwrap().into_rgb8(), image);
        let text = "smile é.mp4, frame 57, 1.900 s, predicted frame".as_bytes();
        assert!(bytes.windows(text.len()).any(|w| w == text));
        assert_eq!(bytes, still_png(&image, &origin).unwrap());
        assert_eq!(Origin::in_png(&bytes), Some(origin.clone()));
        let untimed =
            Origin { film: "a, frame 9, b.gif".to_owned(), number: 2, time_s: None, compression: Compression::Unknown };
        assert_eq!(Origin::in_png(&still_png(&image, &untimed).unwrap()), Some(untimed));
        for end in 0..PNG_HEAD + 20 {
            assert_eq!(Origin::in_png(&bytes[..end]), None, "cut off after {end} bytes");
        }
    }
}
