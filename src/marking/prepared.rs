//! A picture made ready for everything that looks for places in it.

use super::gray::{Gray, Spline};
use crate::frames::Compression;

/// A picture, and smooth surfaces through it and its smaller copies.
///
/// Made once a picture: about 5 ms and 14 bytes a pixel for 1036 × 1036.
#[derive(Clone, Debug)]
pub struct Prepared {
    gray: Gray,
    /// The picture smoothed, then halved again and again.
    levels: Vec<Spline>,
    /// The picture smoothed more.
    soft: Spline,
    compression: Compression,
}

/// Most halvings; the smallest picture is a sixteenth as wide.
pub const HALVINGS: usize = 4;
/// No picture is halved below this width and height, px.
const LEAST_SIDE: usize = 24;

impl Prepared {
    /// Smooths a picture and halves it.
    pub fn of(gray: Gray) -> Self {
        let mut levels = vec![Spline::smoothed(&gray)];
        let mut small = gray.clone();
        while levels.len() <= HALVINGS && small.width().min(small.height()) >= 2 * LEAST_SIDE {
            small = small.halved();
            levels.push(Spline::through(&small));
        }
        Self { soft: Spline::softened(&gray), gray, levels, compression: Compression::Unknown }
    }

    /// The same picture, of which is known how it was compressed.
    #[must_use]
    pub fn compressed(self, compression: Compression) -> Self {
        Self { compression, ..self }
    }

    /// What it owes to other frames of its film.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// The pixels.
    pub fn gray(&self) -> &Gray {
        &self.gray
    }

    /// Width and height, px.
    pub fn size(&self) -> [usize; 2] {
        [self.gray.width(), self.gray.height()]
    }

    /// The smooth surface of the picture itself.
    pub fn spline(&self) -> &Spline {
        &self.levels[0]
    }

    /// A smoother surface of the picture: for following a line pixel by pixel, where noise misleads.
    pub fn soft(&self) -> &Spline {
        &self.soft
    }

    /// The surface after so many halvings, and how many there were: fewer in a small picture.
    pub fn level(&self, halvings: usize) -> (&Spline, usize) {
        let level = halvings.min(self.levels.len() - 1);
        (&self.levels[level], level)
    }
}
