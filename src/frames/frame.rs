//! One frame: a picture file decoded, turned upright and known by the hash of its bytes.

use std::fs::File;
use std::io::{Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgb, RgbImage, RgbaImage};
use sha2::{Digest, Sha256};

use super::Compression;
use super::film::Origin;

/// Widest and highest frame accepted, px. Checked before a pixel is decoded.
pub const MAX_SIDE_PX: u32 = 8192;

/// Largest file accepted, bytes: an uncompressed frame of the largest size with 16-bit alpha, and its metadata.
pub const MAX_FILE_BYTES: u64 = 8 * (MAX_SIDE_PX as u64) * (MAX_SIDE_PX as u64) + (16 << 20);

/// Most memory that a decoder may ask for, bytes: the largest frame with four 32-bit channels, and as much again in parts.
const MAX_DECODER_BYTES: u64 = 24 * (MAX_SIDE_PX as u64) * (MAX_SIDE_PX as u64);

/// What is read; the order is that of the messages.
const READ: [(ImageFormat, &str); 5] = [
    (ImageFormat::Png, "PNG"),
    (ImageFormat::Jpeg, "JPEG"),
    (ImageFormat::Bmp, "BMP"),
    (ImageFormat::Tiff, "TIFF"),
    (ImageFormat::WebP, "WebP"),
];

/// A decoded picture: 8-bit RGB, upright, with the hash by which a project knows its file again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    image: RgbImage,
    sha256: String,
    compression: Compression,
}

/// Why a file did not become a frame: which file, what is wrong, what to do, in one line.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// No such file.
    #[error("{}: there is no such file; check the path, or choose the frame again", path.display())]
    NotFound {
        /// The file.
        path: PathBuf,
    },
    /// A folder stands where a file was expected.
    #[error("{}: this is a folder; choose one picture in it, or open it as a folder of numbered frames", path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// A pipe, a socket or a device.
    #[error("{}: this is not an ordinary file; copy the picture to a file first", path.display())]
    NotAFile {
        /// What was named.
        path: PathBuf,
    },
    /// The system did not let it be read.
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
    /// More bytes than a frame can need.
    #[error(
        "{}: the file has {megabytes} MB and the limit is {} MB; crop or scale the picture",
        path.display(),
        MAX_FILE_BYTES / 1_000_000
    )]
    FileTooLarge {
        /// The file.
        path: PathBuf,
        /// Its size, millions of bytes.
        megabytes: u64,
    },
    /// More pixels than are accepted; nothing was decoded.
    #[error(
        "{}: the picture is {width} × {height} px and the limit is {MAX_SIDE_PX} × {MAX_SIDE_PX} px; crop or scale it",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Declared width, px.
        width: u32,
        /// Declared height, px.
        height: u32,
    },
    /// Not a picture, or one of a kind that is not read.
    #[error(
        "{}: this is {found}; PNG, JPEG, BMP, TIFF and WebP pictures are read, so save it as one of these",
        path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What its first bytes say: "a GIF picture", "not a picture that is known here".
        found: String,
    },
    /// The format is read, but not this variant of it.
    #[error("{}: this variant of {format} is not read ({reason}); save it as an 8-bit or 16-bit RGB picture", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// "TIFF".
        format: &'static str,
        /// What the decoder says.
        reason: String,
    },
    /// The file breaks off or contradicts itself.
    #[error("{}: the {format} data is damaged or cut short ({reason}); copy or export it again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// "PNG".
        format: &'static str,
        /// What the decoder says.
        reason: String,
    },
}

impl Frame {
    /// Reads a PNG, JPEG, BMP, TIFF or WebP file of any depth; the format is told by the bytes, not by the name.
    ///
    /// 16-bit and float channels are rounded to 8 bits (float: 0 to 1, clamped), grey becomes three equal channels,
    /// transparency is laid over white, and the orientation tag (EXIF or TIFF) is applied.
    ///
    /// # Errors
    /// Every case of [`FrameError`]. A picture over [`MAX_SIDE_PX`] is refused before it is decoded.
    pub fn read(path: &Path) -> Result<Self, FrameError> {
        let (mut file, length) = open(path)?;
        let mut bytes = Vec::with_capacity(length as usize);
        // One byte more than the limit tells a file that grew while it was read.
        let read = file.by_ref().take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|reason| FrameError::Unreadable { path: path.to_owned(), reason })?;
        Self::decode(path, &bytes)
    }

    /// Decodes the bytes of a picture file; `path` serves the messages alone.
    ///
    /// # Errors
    /// As [`Frame::read`], apart from the file system's own.
    pub fn decode(path: &Path, bytes: &[u8]) -> Result<Self, FrameError> {
        if bytes.is_empty() {
            return Err(FrameError::Empty { path: path.to_owned() });
        }
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(FrameError::FileTooLarge { path: path.to_owned(), megabytes: bytes.len() as u64 / 1_000_000 });
        }
        let guessed = image::guess_format(bytes).ok();
        let Some(&(format, name)) = READ.iter().find(|(f, _)| Some(*f) == guessed) else {
            return Err(FrameError::UnknownFormat { path: path.to_owned(), found: describe(bytes, guessed) });
        };
        let refuse = |error: ImageError| refusal(path, name, &error);

        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(MAX_DECODER_BYTES);
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(refuse)?;
        let (width, height) = decoder.dimensions();
        if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
            return Err(FrameError::TooLarge { path: path.to_owned(), width, height });
        }
        if width == 0 || height == 0 {
            let reason = format!("it declares {width} × {height} px");
            return Err(FrameError::Damaged { path: path.to_owned(), format: name, reason });
        }
        // A damaged tag does not make the pixels worse: the picture is then taken as it lies.
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let decoded = DynamicImage::from_decoder(decoder).map_err(refuse)?;
        let mut upright = DynamicImage::ImageRgb8(to_rgb8(decoded));
        upright.apply_orientation(orientation);
        let compression = Origin::in_png(bytes).map_or(Compression::Unknown, |o| o.compression);
        Ok(Self { image: upright.into_rgb8(), sha256: hex(&Sha256::digest(bytes)), compression })
    }

    /// The pixels, upright, 8-bit RGB.
    pub fn image(&self) -> &RgbImage {
        &self.image
    }

    /// The pixels alone.
    pub fn into_image(self) -> RgbImage {
        self.image
    }

    /// Width after the orientation tag was applied, px.
    pub fn width(&self) -> u32 {
        self.image.width()
    }

    /// Height after the orientation tag was applied, px.
    pub fn height(&self) -> u32 {
        self.image.height()
    }

    /// What it owes to other frames of a film, where the file says so.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// SHA-256 of the file's bytes: 64 lower-case hexadecimal digits.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// SHA-256 of a file without decoding it, in constant memory: tells whether a project's frame is still the same.
    ///
    /// # Errors
    /// Those of [`FrameError`] that concern the file rather than the picture.
    pub fn sha256_of(path: &Path) -> Result<String, FrameError> {
        let (mut file, _) = open(path)?;
        let mut hasher = Sha256::new();
        let mut block = vec![0; 1 << 16];
        loop {
            match file.read(&mut block) {
                Ok(0) => return Ok(hex(&hasher.finalize())),
                Ok(n) => hasher.update(block.get(..n).unwrap_or_default()),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(reason) => return Err(FrameError::Unreadable { path: path.to_owned(), reason }),
            }
        }
    }
}

/// Opens an ordinary file that is neither empty nor too large, and tells its length in bytes.
fn open(path: &Path) -> Result<(File, u64), FrameError> {
    let owned = || path.to_owned();
    let unreadable = |reason: std::io::Error| match reason.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => FrameError::NotFound { path: owned() },
        _ => FrameError::Unreadable { path: owned(), reason },
    };
    // Looked at before it is opened: opening a pipe would wait for its writer.
    let metadata = path.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(FrameError::IsFolder { path: owned() });
    }
    if !metadata.is_file() {
        return Err(FrameError::NotAFile { path: owned() });
    }
    match metadata.len() {
        0 => Err(FrameError::Empty { path: owned() }),
        n if n > MAX_FILE_BYTES => Err(FrameError::FileTooLarge { path: owned(), megabytes: n / 1_000_000 }),
        n => Ok((File::open(path).map_err(unreadable)?, n)),
    }
}

/// What the first bytes of a file say that is none of the formats read.
fn describe(bytes: &[u8], guessed: Option<ImageFormat>) -> String {
    if let Some(format) = guessed {
        return format!("a {} picture", format!("{format:?}").to_uppercase());
    }
    let brand = bytes.get(4..12).unwrap_or_default();
    let brand_of_film = [&b"ftypisom"[..], b"ftypmp42", b"ftypmp41", b"ftypqt  ", b"ftypavc1", b"ftypM4V "];
    if [&b"ftypheic"[..], b"ftypheix", b"ftypmif1", b"ftyphevc"].contains(&brand) {
        "a HEIC picture".to_owned()
    } else if brand_of_film.contains(&brand)
        || bytes.starts_with(b"RIFF")
        || bytes.starts_with(&[0x1a, 0x45, 0xdf, 0xa3])
    {
        "a film".to_owned()
    } else if bytes.iter().take(512).all(|b| matches!(b, 9 | 10 | 13 | 32..=126)) {
        "a text file".to_owned()
    } else {
        "not a picture that is known here".to_owned()
    }
}

/// Sorts a decoder's error into what a person can do about it.
fn refusal(path: &Path, format: &'static str, error: &ImageError) -> FrameError {
    let one_line = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    // The decoder's own sentence can quote the file; a line of a dialog is enough of it.
    let reason: String = one_line.chars().take(200).collect();
    let path = path.to_owned();
    match error {
        ImageError::Unsupported(_) => FrameError::Unsupported { path, format, reason },
        _ => FrameError::Damaged { path, format, reason },
    }
}

/// 8-bit RGB; transparent pixels lie over white, as viewers show them.
fn to_rgb8(decoded: DynamicImage) -> RgbImage {
    if !decoded.color().has_alpha() {
        return decoded.into_rgb8();
    }
    over_white(&decoded.into_rgba8())
}

/// The picture laid over white.
pub(super) fn over_white(rgba: &RgbaImage) -> RgbImage {
    let mut rgb = RgbImage::new(rgba.width(), rgba.height());
    for (to, from) in rgb.pixels_mut().zip(rgba.pixels()) {
        let [r, g, b, a] = from.0.map(u32::from);
        *to = Rgb([r, g, b].map(|c| ((c * a + 255 * (255 - a) + 127) / 255) as u8));
    }
    rgb
}

fn hex(digest: &[u8]) -> String {
    use std::fmt::Write;
    digest.iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests;
