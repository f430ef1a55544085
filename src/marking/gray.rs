//! A grey picture, and the smooth surface through its pixels that sub-pixel methods sample.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use image::RgbImage;
use nalgebra::Point2;
use rayon::prelude::*;

use super::cubic::splines;
use super::lanes::{LANES, Lanes, split};

/// Brightness of every pixel, 0 black to 255 white, in display values.
#[derive(Clone, Debug, PartialEq)]
pub struct Gray {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Gray {
    /// A picture of the given size from one value a pixel, row by row from the top; none where their number does not fit.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        let fits = width > 0 && height > 0 && width.checked_mul(height) == Some(values.len());
        fits.then_some(Self { width, height, values })
    }

    /// Luma of a colour picture: 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709). A picture without pixels has none.
    pub fn of(picture: &RgbImage) -> Option<Self> {
        let (width, height) = picture.dimensions();
        let luma = |p: &[u8]| 0.2126 * f32::from(p[0]) + 0.7152 * f32::from(p[1]) + 0.0722 * f32::from(p[2]);
        Self::new(width as usize, height as usize, picture.as_raw().par_chunks_exact(3).map(luma).collect())
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixel in a column and row; beyond the border the nearest one.
    pub fn at(&self, column: isize, row: isize) -> f32 {
        let x = column.clamp(0, self.width.cast_signed() - 1).cast_unsigned();
        let y = row.clamp(0, self.height.cast_signed() - 1).cast_unsigned();
        self.values[y * self.width + x]
    }

    /// The same size, smoothed along rows and columns with the binomial (1 2 1)/4.
    #[must_use]
    fn blurred(&self) -> Self {
        let (width, height) = (self.width, self.height);
        let (last_column, last_row) = (width - 1, height - 1);
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each_init(
            || vec![0.0; width],
            |line, (y, row)| {
                let [above, here, below] = [y.saturating_sub(1), y, (y + 1).min(last_row)].map(|y| self.row(y));
                for (v, ((a, b), c)) in line.iter_mut().zip(above.iter().zip(here).zip(below)) {
                    *v = 0.25 * (a + c) + 0.5 * b;
                }
                for (v, three) in row.iter_mut().skip(1).zip(line.windows(3)) {
                    *v = 0.25 * (three[0] + three[2]) + 0.5 * three[1];
                }
                row[0] = 0.25 * line[1.min(last_column)] + 0.75 * line[0];
                row[last_column] = 0.25 * line[last_column.saturating_sub(1)] + 0.75 * line[last_column];
            },
        );
        Self { width, height, values }
    }

    /// Half the size: smoothed with the binomial (1 4 6 4 1)/16 so that nothing finer than the new pixels is folded in, then every
    /// second pixel of every second row. Source: Burt and Adelson 1983.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let [before, after] = [2, 2 * width + 2 - self.width];
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each_init(
            // With the outermost pixels repeated on either side.
            || vec![0.0; before + self.width + after],
            |line, (y, row)| {
                line.fill(0.0);
                for (k, tap) in TAPS.iter().enumerate() {
                    let from = self.row((2 * y + k).saturating_sub(2).min(self.height - 1));
                    for (v, p) in line[before..].iter_mut().zip(from) {
                        *v += tap * p;
                    }
                }
                let (left, right) = (line[before], line[before + self.width - 1]);
                line[..before].fill(left);
                line[before + self.width..].fill(right);
                for (v, five) in row.iter_mut().zip(line.windows(5).step_by(2)) {
                    *v = TAPS.iter().zip(five).map(|(t, p)| t * p).sum();
                }
            },
        );
        Self { width, height, values }
    }

    pub(super) fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.width..(row + 1) * self.width]
    }
}

/// The binomial taps (1 4 6 4 1)/16: a smoothing of 1 px, standard deviation.
const TAPS: [f32; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

/// The surface that cubic B-splines on a picture's pixels make: twice differentiable, and so smooth that a place between pixels is seen as
/// sharp as one on a pixel. A surface that meets every pixel (Unser, Aldroubi and Eden 1991) would keep their noise, whose slopes drown
/// those of skin.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    width: usize,
    height: usize,
    coefficients: Vec<f32>,
}

/// Beyond every picture, px.
const FAR: i32 = 1 << 24;

/// A brightness and its slope, per px to the right and downwards.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Brightness.
    pub value: f64,
    /// Derivative to the right and downwards, per px.
    pub slope: [f64; 2],
}

impl Spline {
    /// The surface whose coefficients are the pixels as they stand: it does not meet them, but smooths them a little (0.58 px, standard
    /// deviation).
    pub fn through(gray: &Gray) -> Self {
        Self { width: gray.width, height: gray.height, coefficients: gray.values.clone() }
    }

    /// The surface of a smoothed picture: the pixels, smoothed with the binomial (1 2 1)/4, are its coefficients as they stand, which
    /// smooths once more (0.91 px in all, standard deviation). The slopes of a noisy picture are mostly noise; those of this one less so.
    pub fn smoothed(gray: &Gray) -> Self {
        Self { width: gray.width, height: gray.height, coefficients: gray.blurred().values }
    }

    /// The surface of a picture that was smoothed twice: 1.15 px in all, standard deviation.
    pub fn softened(gray: &Gray) -> Self {
        Self::smoothed(&gray.blurred())
    }

    /// Whether a place lies in the picture, at least `margin` px from its border.
    pub fn holds(&self, at: &Point2<f64>, margin: f64) -> bool {
        at.x >= margin && at.y >= margin && at.x <= self.width as f64 - margin && at.y <= self.height as f64 - margin
    }

    /// Brightness and slope at a place in image space (a pixel's middle is at +0.5); beyond the border that of the border.
    pub fn sample(&self, at: &Point2<f64>) -> Sample {
        let (x, y) = (Taps::at(at.x - 0.5, self.width), Taps::at(at.y - 0.5, self.height));
        let (mut value, mut right, mut down) = (0.0, 0.0, 0.0);
        for r in 0..4 {
            let row = self.row(y.pixels[r]);
            let (mut v, mut d) = (0.0, 0.0);
            for c in 0..4 {
                let k = f64::from(row[x.pixels[c]]);
                v += x.weights[c] * k;
                d += x.slopes[c] * k;
            }
            value += y.weights[r] * v;
            right += y.weights[r] * d;
            down += y.slopes[r] * v;
        }
        Sample { value, slope: [right, down] }
    }

    /// Brightness and slopes at eight places, px to the right of and below the top-left corner of the pixel in column and row `corner`.
    ///
    /// As [`Spline::sample`], in single precision; to be inlined into a dispatched function.
    #[inline(always)]
    pub(super) fn sample_lanes(&self, corner: [i32; 2], x: &Lanes, y: &Lanes) -> [Lanes; 3] {
        let (mut column, mut row) = ([0_i32; LANES], [0_i32; LANES]);
        let (mut tx, mut ty) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            (column[k], tx[k]) = split(x[k] - 0.5);
            (row[k], ty[k]) = split(y[k] - 0.5);
        }
        let [last_column, last_row] = [self.width, self.height].map(|side| i32::try_from(side).unwrap_or(0) - 3);
        let mut least = i32::MAX;
        for k in 0..LANES {
            column[k] = column[k].saturating_add(corner[0]).clamp(-FAR, FAR);
            row[k] = row[k].saturating_add(corner[1]).clamp(-FAR, FAR);
            // All of them or none: a minimum and not a branch.
            let room = (column[k] - 1).min(last_column - column[k]).min(row[k] - 1).min(last_row - row[k]);
            least = least.min(room);
        }
        if least < 0 {
            return self.sample_at_border(corner, x, y);
        }
        // The four pixels of four rows about each place, all lanes of a pixel together.
        let mut pixels = [[[0.0; LANES]; 4]; 4];
        for k in 0..LANES {
            let mut start = (row[k] as usize - 1) * self.width + column[k] as usize - 1;
            for line in &mut pixels {
                let four: &[f32] = &self.coefficients[start..start + 4];
                for (pixel, value) in line.iter_mut().zip(four) {
                    pixel[k] = *value;
                }
                start += self.width;
            }
        }
        let mut out = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let ((wx, dx), (wy, dy)) = (weights(tx[k]), weights(ty[k]));
            let (mut value, mut right, mut down) = (0.0, 0.0, 0.0);
            for r in 0..4 {
                let p = [pixels[r][0][k], pixels[r][1][k], pixels[r][2][k], pixels[r][3][k]];
                let v = wx[0] * p[0] + wx[1] * p[1] + wx[2] * p[2] + wx[3] * p[3];
                value += wy[r] * v;
                right += wy[r] * (dx[0] * p[0] + dx[1] * p[1] + dx[2] * p[2] + dx[3] * p[3]);
                down += dy[r] * v;
            }
            (out[0][k], out[1][k], out[2][k]) = (value, right, down);
        }
        out
    }

    /// The same where a place is so near to the border that pixels are wanting.
    #[cold]
    fn sample_at_border(&self, corner: [i32; 2], x: &Lanes, y: &Lanes) -> [Lanes; 3] {
        let mut out = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let at = [f64::from(x[k]) + f64::from(corner[0]), f64::from(y[k]) + f64::from(corner[1])];
            let s = self.sample(&Point2::from(at));
            (out[0][k], out[1][k], out[2][k]) = (s.value as f32, s.slope[0] as f32, s.slope[1] as f32);
        }
        out
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.coefficients[row * self.width..(row + 1) * self.width]
    }
}

/// Weights of the four pixels about a place `t` beyond the second, 0 to 1, and the derivatives of these.
#[inline(always)]
fn weights(t: f32) -> ([f32; 4], [f32; 4]) {
    const SIXTH: f32 = 1.0 / 6.0;
    const TWO_THIRDS: f32 = 2.0 / 3.0;
    let s = 1.0 - t;
    (
        [
            s * s * s * SIXTH,
            TWO_THIRDS - 0.5 * t * t * (2.0 - t),
            TWO_THIRDS - 0.5 * s * s * (2.0 - s),
            t * t * t * SIXTH,
        ],
        [-0.5 * s * s, t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0), 0.5 * t * t],
    )
}

/// The four pixels about a coordinate, their weights, and the derivatives of these.
struct Taps {
    pixels: [usize; 4],
    weights: [f64; 4],
    slopes: [f64; 4],
}

impl Taps {
    fn at(x: f64, size: usize) -> Self {
        let last = size - 1;
        let x = if x.is_finite() { x.clamp(0.0, last as f64) } else { 0.0 };
        let whole = (x as usize).min(last);
        let [weights, slopes, _] = splines(x - whole as f64);
        // Beyond the border the picture is mirrored about its outermost pixels, as the filter takes it to be.
        let mirrored = |i: usize| if i <= last { i } else { (2 * last).saturating_sub(i) };
        let before = if whole == 0 { mirrored(1) } else { whole - 1 };
        Self { pixels: [before, whole, mirrored(whole + 1), mirrored(whole + 2)], weights, slopes }
    }
}

/// Unevenness of a size, −½ to ½, known everywhere, that nowhere repeats itself: values at the corners of squares, smoothly between them.
#[cfg(test)]
pub(super) fn uneven(x: f64, y: f64, size: f64) -> f64 {
    let corner = |i: i64, j: i64| {
        let mixed = (i.wrapping_mul(0x9E37_79B9) ^ j.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0xC2B2_AE35);
        f64::from((mixed >> 13 & 0xFFFF) as u16) / 65535.0 - 0.5
    };
    let (x, y) = (x / size + 100.0, y / size + 100.0);
    let (i, j) = (x.floor(), y.floor());
    let ease = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let (s, t) = (ease(x - i), ease(y - j));
    let (i, j) = (i as i64, j as i64);
    let along = |j: i64| corner(i, j) * (1.0 - s) + corner(i + 1, j) * s;
    along(j) * (1.0 - t) + along(j + 1) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Gray {
        let values = (0..width * height).map(|i| f((i % width) as f64 + 0.5, (i / width) as f64 + 0.5) as f32);
        Gray::new(width, height, values.collect()).unwrap()
    }

    /// Cubic B-splines with the samples of a parabola as coefficients make that parabola, raised by half its second derivative times their
    /// variance, 1/3; the binomial's variance is 1/2 more. Slopes stay.
    #[test]
    fn a_parabola_is_raised_by_its_smoothing_and_keeps_its_slope() {
        let f = |x: f64, y: f64| 0.03 * x * x - 0.04 * x * y + 0.02 * y * y + 5.0;
        let gray = picture(80, 80, f);
        for (spline, variance) in [(Spline::through(&gray), 1.0 / 3.0), (Spline::smoothed(&gray), 5.0 / 6.0)] {
            for (x, y) in [(40.0, 40.0), (41.37, 38.81), (39.99, 43.21)] {
                let s = spline.sample(&Point2::new(x, y));
                let expected = f(x, y) + variance * (0.03 + 0.02);
                assert!((s.value - expected).abs() < 1e-4, "{} for {expected}", s.value);
                let slope = [0.06 * x - 0.04 * y, -0.04 * x + 0.04 * y];
                assert!((s.slope[0] - slope[0]).abs() < 1e-4 && (s.slope[1] - slope[1]).abs() < 1e-4, "{:?}", s.slope);
            }
        }
    }

    #[test]
    fn outside_and_nowhere_are_answered() {
        let spline = Spline::smoothed(&picture(5, 4, |x, _| x));
        for at in [[-100.0, 2.0], [1e300, 1e300], [f64::NAN, 2.0], [f64::INFINITY, -1.0]] {
            assert!(spline.sample(&Point2::from(at)).value.is_finite());
        }
        let one = Spline::smoothed(&picture(1, 1, |_, _| 7.0)).sample(&Point2::new(0.5, 0.5)).value;
        assert!((one - 7.0).abs() < 1e-9);
        assert!(Gray::new(0, 3, Vec::new()).is_none() && Gray::new(2, 2, vec![0.0; 3]).is_none());
        assert!(Gray::of(&RgbImage::new(0, 0)).is_none());
        assert!(spline.holds(&Point2::new(2.0, 2.0), 1.0) && !spline.holds(&Point2::new(f64::NAN, 2.0), 1.0));
    }

    /// Eight places at once are what they are one by one, in the middle, at the border and beyond it.
    #[test]
    fn eight_places_at_once_are_those_one_by_one() {
        let spline = Spline::smoothed(&picture(70, 60, |x, y| 90.0 + 40.0 * (0.31 * x).sin() * (0.23 * y).cos()));
        for (corner, spread) in [([30, 25], 3.1), ([0, 0], 0.9), ([64, 55], 2.3), ([-20, 90], 1.0)] {
            let x: Lanes = std::array::from_fn(|k| k as f32 * spread - 1.3);
            let y: Lanes = std::array::from_fn(|k| 7.0 - 0.7 * k as f32 * spread);
            let all = spline.sample_lanes(corner, &x, &y);
            for k in 0..LANES {
                let at = [f64::from(x[k]) + f64::from(corner[0]), f64::from(y[k]) + f64::from(corner[1])];
                let one = spline.sample(&Point2::from(at));
                assert!((f64::from(all[0][k]) - one.value).abs() < 1e-3, "{at:?}");
                assert!((f64::from(all[1][k]) - one.slope[0]).abs() < 1e-4, "{at:?}");
                assert!((f64::from(all[2][k]) - one.slope[1]).abs() < 1e-4, "{at:?}");
            }
        }
    }

    #[test]
    fn halving_keeps_the_mean_and_a_slow_wave() {
        let half = picture(64, 48, |x, _| 100.0 + 50.0 * (0.1 * x).sin()).halved();
        assert_eq!((half.width(), half.height()), (32, 24));
        // Pixel k of the half lies at pixel 2k of the whole, whose middle is at 2k + 0.5; a wave this slow is damped by
        // (1 + cos 0.1)²/4 = 0.995.
        let expected = 100.0 + 50.0 * 0.995 * (0.1 * 30.5_f64).sin();
        assert!((f64::from(half.at(15, 10)) - expected).abs() < 0.05);
    }
}
