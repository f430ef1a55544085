//! A grey picture, and the smooth surface through its pixels that sub-pixel methods sample.

use image::RgbImage;
use nalgebra::Point2;
use rayon::prelude::*;

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

    /// The same size, smoothed along rows and columns with the binomial (1 4 6 4 1)/16.
    #[must_use]
    fn blurred(&self) -> Self {
        let (width, height) = (self.width, self.height);
        let mut rows = vec![0.0; width * height];
        rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let line = &self.values[y * width..(y + 1) * width];
            for (x, v) in row.iter_mut().enumerate() {
                *v = if x >= 2 && x + 2 < width {
                    TAPS.iter().zip(&line[x - 2..=x + 2]).map(|(t, p)| t * p).sum()
                } else {
                    (0..5).map(|k| TAPS[k] * self.at((x + k).cast_signed() - 2, y.cast_signed())).sum()
                };
            }
        });
        let last = height - 1;
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (k, tap) in TAPS.iter().enumerate() {
                let from = (y + k).saturating_sub(2).min(last);
                for (v, p) in row.iter_mut().zip(&rows[from * width..(from + 1) * width]) {
                    *v += tap * p;
                }
            }
        });
        Self { width, height, values }
    }

    /// Half the size: smoothed with the binomial (1 4 6 4 1)/16 so that nothing finer than the new pixels is folded in, then every
    /// second pixel of every second row. Source: Burt and Adelson 1983.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let tap = |k: usize| k.cast_signed() - 2;
        let mut rows = vec![0.0; width * self.height];
        rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, v) in row.iter_mut().enumerate() {
                let middle = 2 * x.cast_signed();
                *v = TAPS.iter().enumerate().map(|(k, t)| t * self.at(middle + tap(k), y.cast_signed())).sum();
            }
        });
        let rows = Self { width, height: self.height, values: rows };
        let mut values = vec![0.0; width * height];
        values.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, v) in row.iter_mut().enumerate() {
                let middle = 2 * y.cast_signed();
                *v = TAPS.iter().enumerate().map(|(k, t)| t * rows.at(x.cast_signed(), middle + tap(k))).sum();
            }
        });
        Self { width, height, values }
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

    /// The surface of a smoothed picture: the pixels, smoothed with the binomial (1 4 6 4 1)/16, are its coefficients as they stand, which
    /// smooths once more (1.15 px in all, standard deviation). The slopes of a noisy picture are mostly noise; those of this one are not.
    pub fn smoothed(gray: &Gray) -> Self {
        Self { width: gray.width, height: gray.height, coefficients: gray.blurred().values }
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

    fn row(&self, row: usize) -> &[f32] {
        &self.coefficients[row * self.width..(row + 1) * self.width]
    }
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
        let t = x - whole as f64;
        let s = 1.0 - t;
        // Beyond the border the picture is mirrored about its outermost pixels, as the filter takes it to be.
        let mirrored = |i: usize| if i <= last { i } else { (2 * last).saturating_sub(i) };
        let before = if whole == 0 { mirrored(1) } else { whole - 1 };
        Self {
            pixels: [before, whole, mirrored(whole + 1), mirrored(whole + 2)],
            weights: [
                s * s * s / 6.0,
                2.0 / 3.0 - t * t * (2.0 - t) / 2.0,
                2.0 / 3.0 - s * s * (2.0 - s) / 2.0,
                t * t * t / 6.0,
            ],
            slopes: [-s * s / 2.0, t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0), t * t / 2.0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Gray {
        let values = (0..width * height).map(|i| f((i % width) as f64 + 0.5, (i / width) as f64 + 0.5) as f32);
        Gray::new(width, height, values.collect()).unwrap()
    }

    /// Cubic B-splines with the samples of a parabola as coefficients make that parabola, raised by half its second derivative times their
    /// variance, 1/3; the binomial's variance is 1 more. Slopes stay.
    #[test]
    fn a_parabola_is_raised_by_its_smoothing_and_keeps_its_slope() {
        let f = |x: f64, y: f64| 0.03 * x * x - 0.04 * x * y + 0.02 * y * y + 5.0;
        let gray = picture(80, 80, f);
        for (spline, variance) in [(Spline::through(&gray), 1.0 / 3.0), (Spline::smoothed(&gray), 4.0 / 3.0)] {
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
