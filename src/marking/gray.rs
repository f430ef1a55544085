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

    /// Half the size: smoothed with the binomial (1 4 6 4 1)/16 so that nothing finer than the new pixels is folded in, then every
    /// second pixel of every second row. Source: Burt and Adelson 1983.
    #[must_use]
    pub fn halved(&self) -> Self {
        const TAPS: [f32; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
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

/// The cubic B-spline through the pixels of a grey picture: twice differentiable, and exact at every pixel's middle.
///
/// Source: Unser, Aldroubi and Eden 1991. Cubic convolution and bilinear sampling would pull sub-pixel places towards pixels
/// (by up to 0.05 px); this does so by less than 0.01 px on pictures that are not finer than their pixels.
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
    /// Finds the coefficients by filtering rows, then columns.
    pub fn of(gray: &Gray) -> Self {
        let (width, height) = (gray.width, gray.height);
        let mut rows = gray.values.clone();
        rows.par_chunks_mut(width).for_each(filter);
        // Columns are filtered as rows of the transposed picture.
        let mut columns = transposed(&rows, width, height);
        columns.par_chunks_mut(height).for_each(filter);
        Self { width, height, coefficients: transposed(&columns, height, width) }
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

/// Turns samples into coefficients of the cubic B-spline in place: one pass forwards and one back (pole √3 − 2).
fn filter(line: &mut [f32]) {
    let n = line.len();
    if n < 2 {
        return;
    }
    let pole = 3.0_f64.sqrt() - 2.0;
    // 0.27¹⁶ is below the rounding of the numbers stored.
    let reach = n.min(16);
    let mut power = 1.0;
    let mut sum = 0.0;
    for value in &line[..reach] {
        sum += power * f64::from(*value);
        power *= pole;
    }
    let mut work: Vec<f64> = line.iter().map(|v| f64::from(*v)).collect();
    work[0] = sum;
    for i in 1..n {
        work[i] += pole * work[i - 1];
    }
    work[n - 1] = pole / (pole * pole - 1.0) * (work[n - 1] + pole * work[n - 2]);
    for i in (0..n - 1).rev() {
        work[i] = pole * (work[i + 1] - work[i]);
    }
    for (out, v) in line.iter_mut().zip(work) {
        *out = (6.0 * v) as f32;
    }
}

fn transposed(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    /// Pixels along the side of a tile: two tiles stay in the first-level cache.
    const TILE: usize = 32;
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(height * TILE).enumerate().for_each(|(band, columns)| {
        let first = band * TILE;
        for from in (0..height).step_by(TILE) {
            for (c, column) in columns.chunks_exact_mut(height).enumerate() {
                for y in from..(from + TILE).min(height) {
                    column[y] = values[y * width + first + c];
                }
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Gray {
        let values = (0..width * height).map(|i| f((i % width) as f64 + 0.5, (i / width) as f64 + 0.5) as f32);
        Gray::new(width, height, values.collect()).unwrap()
    }

    #[test]
    fn the_spline_meets_every_pixel() {
        let gray = picture(23, 17, |x, y| 90.0 + 60.0 * (0.9 * x).sin() + 40.0 * (1.3 * y + 0.4 * x).cos());
        let spline = Spline::of(&gray);
        for row in 0..17 {
            for column in 0..23 {
                let found = spline.sample(&Point2::new(column as f64 + 0.5, row as f64 + 0.5)).value;
                let pixel = f64::from(gray.at(column, row));
                assert!((found - pixel).abs() < 2e-4, "{column} {row}: {found} for {pixel}");
            }
        }
    }

    /// A cubic B-spline reproduces cubics; near the border the mirror bends them, so the middle is looked at.
    #[test]
    fn a_cubic_is_met_between_pixels_with_its_slope() {
        let f = |x: f64, y: f64| 1e-3 * x * x * x - 0.04 * x * y + 2e-4 * y * y * y + 5.0;
        let spline = Spline::of(&picture(80, 80, f));
        for (x, y) in [(40.0, 40.0), (41.37, 38.81), (39.99, 43.21)] {
            let s = spline.sample(&Point2::new(x, y));
            assert!((s.value - f(x, y)).abs() < 1e-3, "{}", s.value - f(x, y));
            let slope = [3e-3 * x * x - 0.04 * y, -0.04 * x + 6e-4 * y * y];
            assert!((s.slope[0] - slope[0]).abs() < 1e-3 && (s.slope[1] - slope[1]).abs() < 1e-3, "{:?}", s.slope);
        }
    }

    #[test]
    fn outside_and_nowhere_are_answered() {
        let spline = Spline::of(&picture(5, 4, |x, _| x));
        for at in [[-100.0, 2.0], [1e300, 1e300], [f64::NAN, 2.0], [f64::INFINITY, -1.0]] {
            assert!(spline.sample(&Point2::from(at)).value.is_finite());
        }
        let one = Spline::of(&picture(1, 1, |_, _| 7.0)).sample(&Point2::new(0.5, 0.5)).value;
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
