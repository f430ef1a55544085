//! The fit of two painted lines to the pixels of a window: the model, its derivatives, and the descent.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]
#![expect(clippy::needless_range_loop, reason = "lanes are counted through several arrays at once")]

use nalgebra::{Point2, SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use super::super::gray::Gray;
use super::super::lanes::{self, LANES, Lanes};

/// The fit's numbers: b, g_x, g_y, a, ln s, two of ln h, two angles, two of κ, c_x, c_y.
const NUMBERS: usize = 13;
// Where each kind of number begins.
pub(super) const PAINT: usize = 3;
pub(super) const SOFT: usize = 4;
pub(super) const HALF: usize = 5;
pub(super) const ANGLE: usize = 7;
pub(super) const BEND: usize = 9;
/// The place is counted from the middle of the window.
pub(super) const PLACE: usize = 11;
/// How much a line may bend and what softness is expected, held weakly: as one grey level's noise over the window would.
const BEND_PER_PX: f64 = 0.02;
/// Sums in single precision differ by less than this share where they are the same.
const SAME: f64 = 3e-6;

pub(super) type Numbers = SVector<f64, NUMBERS>;
type Normal = SMatrix<f64, NUMBERS, NUMBERS>;

/// The window about a place.
pub(super) struct Fit {
    pub(super) middle: Point2<f64>,
    pub(super) radius: f64,
    /// Sum of the weights.
    pub(super) total: f64,
    pixels: Vec<Pixels>,
}

/// Eight pixels: where they lie from the middle, px, their brightness and what they weigh.
#[derive(Clone, Copy, Default)]
struct Pixels {
    x: Lanes,
    y: Lanes,
    value: Lanes,
    weight: Lanes,
}

/// A line of the model, with what depends on its numbers alone.
#[derive(Clone, Copy)]
struct Painted {
    sin: f32,
    cos: f32,
    bend: f32,
    half: f32,
    soft: f32,
    /// exp(2h / s), and one by it.
    width: f32,
    narrow: f32,
}

/// What one line says at a place: how much it covers, and the derivatives of that.
struct Cover {
    share: f32,
    by_soft: f32,
    by_half: f32,
    by_angle: f32,
    by_bend: f32,
    by_place: [f32; 2],
}

impl Painted {
    fn of(n: &Numbers, k: usize) -> Self {
        let (sin, cos) = n[ANGLE + k].sin_cos();
        let (half, soft) = (n[HALF + k].exp(), n[SOFT].exp());
        let width = (2.0 * half / soft).min(40.0).exp();
        Self {
            sin: sin as f32,
            cos: cos as f32,
            bend: n[BEND + k] as f32,
            half: half as f32,
            soft: soft as f32,
            width: width as f32,
            narrow: (1.0 / width) as f32,
        }
    }

    /// ½ tanh(u) = ½ − 1 / (1 + exp 2u) needs one exponential for both edges.
    #[inline(always)]
    fn edges(&self, x: f32, y: f32) -> (f32, f32, f32, f32, f32) {
        let (along, across) = (x * self.cos + y * self.sin, y * self.cos - x * self.sin);
        let d = across - 0.5 * self.bend * along * along;
        let e = lanes::exp((2.0 * d / self.soft).clamp(-40.0, 40.0));
        (along, across, d, 1.0 / (1.0 + e * self.width), 1.0 / (1.0 + e * self.narrow))
    }

    /// How much the line covers at a place.
    #[inline(always)]
    fn share(&self, x: f32, y: f32) -> f32 {
        let (_, _, _, p, q) = self.edges(x, y);
        q - p
    }

    #[inline(always)]
    fn cover(&self, x: f32, y: f32) -> Cover {
        let (along, across, d, p, q) = self.edges(x, y);
        let (far, near) = (2.0 * p * (1.0 - p), 2.0 * q * (1.0 - q));
        let by_d = (far - near) / self.soft;
        Cover {
            share: q - p,
            // Both are fitted by their logarithms.
            by_soft: -((d + self.half) * far - (d - self.half) * near) / self.soft,
            by_half: self.half * (far + near) / self.soft,
            by_angle: by_d * (-along - self.bend * along * across),
            by_bend: -0.5 * by_d * along * along,
            by_place: [
                by_d * (self.sin + self.bend * along * self.cos),
                by_d * (-self.cos + self.bend * along * self.sin),
            ],
        }
    }
}

/// The model at some numbers: two lines, light and paint.
struct Model {
    lines: [Painted; 2],
    light: [f32; 3],
    paint: f32,
    place: [f32; 2],
}

impl Model {
    fn of(n: &Numbers) -> Self {
        Self {
            lines: [Painted::of(n, 0), Painted::of(n, 1)],
            light: [n[0] as f32, n[1] as f32, n[2] as f32],
            paint: n[PAINT] as f32,
            place: [n[PLACE] as f32, n[PLACE + 1] as f32],
        }
    }

    #[inline(always)]
    fn value(&self, x: f32, y: f32) -> f32 {
        let (rx, ry) = (x - self.place[0], y - self.place[1]);
        let bare = (1.0 - self.lines[0].share(rx, ry)) * (1.0 - self.lines[1].share(rx, ry));
        self.light[0] + self.light[1] * x + self.light[2] * y - self.paint * (1.0 - bare)
    }

    /// Brightness of the model at a place, and its derivative by every number.
    #[inline(always)]
    fn slopes(&self, x: f32, y: f32) -> (f32, [f32; NUMBERS]) {
        let (rx, ry) = (x - self.place[0], y - self.place[1]);
        let [first, second] = [self.lines[0].cover(rx, ry), self.lines[1].cover(rx, ry)];
        let cover = 1.0 - (1.0 - first.share) * (1.0 - second.share);
        let (u, v) = (-self.paint * (1.0 - second.share), -self.paint * (1.0 - first.share));
        let value = self.light[0] + self.light[1] * x + self.light[2] * y - self.paint * cover;
        let slopes = [
            1.0,
            x,
            y,
            -cover,
            u * first.by_soft + v * second.by_soft,
            u * first.by_half,
            v * second.by_half,
            u * first.by_angle,
            v * second.by_angle,
            u * first.by_bend,
            v * second.by_bend,
            u * first.by_place[0] + v * second.by_place[0],
            u * first.by_place[1] + v * second.by_place[1],
        ];
        (value, slopes)
    }
}

/// Weighted sum of the squares of what is left.
struct Left<'a> {
    pixels: &'a [Pixels],
    model: Model,
}

impl WithSimd for Left<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sums = [0.0; LANES];
        for p in self.pixels {
            for k in 0..LANES {
                let left = self.model.value(p.x[k], p.y[k]) - p.value[k];
                sums[k] += p.weight[k] * left * left;
            }
        }
        lanes::sum(&sums)
    }
}

/// JᵀW^q J for q = 1 or 2, and JᵀW(model − picture).
struct Products<'a> {
    pixels: &'a [Pixels],
    model: Model,
    squared: bool,
}

impl WithSimd for Products<'_> {
    type Output = (Normal, Numbers);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (Normal, Numbers) {
        let mut matrix = [[0.0; LANES]; NUMBERS * (NUMBERS + 1) / 2];
        let mut gradient = [[0.0; LANES]; NUMBERS];
        for p in self.pixels {
            let mut rows = [[0.0; LANES]; NUMBERS];
            let (mut left, mut weight) = ([0.0; LANES], p.weight);
            for k in 0..LANES {
                let (value, slopes) = self.model.slopes(p.x[k], p.y[k]);
                left[k] = value - p.value[k];
                for (row, slope) in rows.iter_mut().zip(slopes) {
                    row[k] = slope;
                }
            }
            if self.squared {
                for k in 0..LANES {
                    weight[k] *= p.weight[k];
                }
            }
            let mut place = 0;
            for a in 0..NUMBERS {
                let mut weighted = [0.0; LANES];
                for k in 0..LANES {
                    weighted[k] = weight[k] * rows[a][k];
                    gradient[a][k] += weighted[k] * left[k];
                }
                for row in &rows[..=a] {
                    for k in 0..LANES {
                        matrix[place][k] += weighted[k] * row[k];
                    }
                    place += 1;
                }
            }
        }
        let matrix = Normal::from_fn(|a, b| {
            let (long, short) = (a.max(b), a.min(b));
            lanes::sum(&matrix[long * (long + 1) / 2 + short])
        });
        (matrix, Numbers::from_fn(|a, _| lanes::sum(&gradient[a])))
    }
}

impl Fit {
    pub(super) fn new(picture: &Gray, middle: Point2<f64>, window: usize) -> Self {
        let side = 2 * window + 1;
        let radius = window as f64;
        let spread = 0.55 * radius;
        // The pixels themselves: smoothing would round the corners between the lines.
        let corner = middle.map(|c| c.floor() + 0.5 - radius);
        let mut fit = Self { middle, radius, total: 0.0, pixels: Vec::with_capacity(side * side / LANES) };
        let (mut eight, mut lane) = (Pixels::default(), 0);
        for i in 0..side * side {
            let at = Point2::new(corner.x + (i % side) as f64, corner.y + (i / side) as f64);
            let from_middle = at - middle;
            // A disc: the corners of a square weigh little and cost as much.
            if from_middle.norm_squared() > radius * radius {
                continue;
            }
            let weight = (-from_middle.norm_squared() / (2.0 * spread * spread)).exp();
            eight.x[lane] = from_middle.x as f32;
            eight.y[lane] = from_middle.y as f32;
            eight.value[lane] = picture.at(at.x as isize, at.y as isize);
            eight.weight[lane] = weight as f32;
            fit.total += weight;
            lane += 1;
            if lane == LANES {
                fit.pixels.push(std::mem::take(&mut eight));
                lane = 0;
            }
        }
        if lane > 0 {
            fit.pixels.push(eight);
        }
        fit
    }

    /// The brightness that so many of the pixels do not reach, as shares of all.
    pub(super) fn brightness(&self, shares: [f64; 2]) -> [f64; 2] {
        let lanes = self.pixels.iter().flat_map(|p| p.value.into_iter().zip(p.weight));
        let mut sorted: Vec<f32> = lanes.filter(|(_, weight)| *weight > 0.0).map(|(value, _)| value).collect();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().saturating_sub(1) as f64;
        shares.map(|share| sorted.get((last * share) as usize).copied().map_or(0.0, f64::from))
    }

    /// What is held weakly, so that numbers of which the window says little stay sensible: residual, derivative, number.
    fn held(&self, n: &Numbers) -> [(f64, f64, usize); 4] {
        let size = self.radius;
        let bend = size / BEND_PER_PX / 4.0;
        let width = 0.5 * size;
        [
            (bend * n[BEND], bend, BEND),
            (bend * n[BEND + 1], bend, BEND + 1),
            (width * n[SOFT], width, SOFT),
            (width * (n[HALF] - n[HALF + 1]), width, HALF),
        ]
    }

    /// Weighted sum of squares, the light's and the paint's alone and with what is held.
    fn sums(&self, n: &Numbers) -> [f64; 2] {
        let sum = Arch::new().dispatch(Left { pixels: &self.pixels, model: Model::of(n) });
        [sum, sum + self.held(n).iter().map(|h| h.0 * h.0).sum::<f64>()]
    }

    /// Normal equations: JᵀWJ and JᵀW(model − picture), with what is held.
    fn normal(&self, n: &Numbers) -> (Normal, Numbers) {
        let (mut matrix, mut gradient) =
            Arch::new().dispatch(Products { pixels: &self.pixels, model: Model::of(n), squared: false });
        for (left, slope, k) in self.held(n) {
            matrix[(k, k)] += slope * slope;
            gradient[k] += slope * left;
            if k == HALF {
                // The difference of the two widths is held.
                matrix[(k + 1, k + 1)] += slope * slope;
                matrix[(k + 1, k)] -= slope * slope;
                matrix[(k, k + 1)] -= slope * slope;
                gradient[k + 1] -= slope * left;
            }
        }
        (matrix, gradient)
    }

    /// The numbers that fit best and their weighted sum of squares; none where the search does not settle.
    pub(super) fn solve(&self, start: Numbers) -> Option<(Numbers, f64)> {
        let mut n = start;
        let mut sums = self.sums(&n);
        let mut damping = 1e-3;
        let (mut matrix, mut gradient) = self.normal(&n);
        for _ in 0..60 {
            let mut damped = matrix;
            for k in 0..NUMBERS {
                damped[(k, k)] += damping * matrix[(k, k)].max(1e-9);
            }
            let step = damped.cholesky()?.solve(&gradient);
            let tried = n - step;
            let tried_sums = self.sums(&tried);
            if tried_sums[1].is_finite() && tried_sums[1] <= sums[1] * (1.0 + SAME) {
                let settled = step[PLACE].hypot(step[PLACE + 1]) < 2e-3 && sums[1] - tried_sums[1] < 1e-3 * sums[1];
                (n, sums) = (tried, tried_sums);
                damping = (damping * 0.2).max(1e-9);
                if settled {
                    return Some((n, sums[0]));
                }
                (matrix, gradient) = self.normal(&n);
            } else {
                damping *= 8.0;
                if damping > 1e9 {
                    return Some((n, sums[0]));
                }
            }
        }
        None
    }

    /// Standard errors of the crossing for a variance of one pixel (sandwich of the weighted normal equations).
    pub(super) fn standard_errors(&self, n: &Numbers, variance: f64) -> Option<[f64; 2]> {
        let (matrix, _) = self.normal(n);
        let (middle, _) = Arch::new().dispatch(Products { pixels: &self.pixels, model: Model::of(n), squared: true });
        let inverse = matrix.try_inverse()?;
        let covariance = inverse * middle * inverse * variance;
        Some([PLACE, PLACE + 1].map(|k| covariance[(k, k)].max(0.0).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The model's derivatives against central differences, in steps that single precision resolves.
    #[test]
    fn the_derivatives_are_those_of_the_model() {
        let n =
            Numbers::from_column_slice(&[150.0, 0.3, -0.2, 60.0, 0.2, 0.6, 0.8, 0.15, 1.45, 0.01, -0.02, 0.4, -0.2]);
        for (x, y) in [(1.0, 0.2), (-1.7, 3.1), (0.4, -0.1)] {
            let slopes = Model::of(&n).slopes(x, y).1;
            for k in 0..NUMBERS {
                let step = 2e-3;
                let (mut less, mut more) = (n, n);
                less[k] -= step;
                more[k] += step;
                let at = |n: &Numbers| f64::from(Model::of(n).value(x, y));
                let expected = (at(&more) - at(&less)) / (2.0 * step);
                let found = f64::from(slopes[k]);
                assert!((found - expected).abs() < 2e-2 + 1e-3 * expected.abs(), "number {k}: {found} for {expected}");
            }
        }
    }

    /// Sums over lanes against sums done one by one in double precision.
    #[test]
    fn sums_of_eight_pixels_at_once_are_those_one_by_one() {
        let values = (0..40 * 40).map(|i| 100.0 + ((i * 37) % 50) as f32).collect();
        let fit = Fit::new(&Gray::new(40, 40, values).unwrap(), Point2::new(20.3, 19.8), 8);
        let n =
            Numbers::from_column_slice(&[150.0, 0.3, -0.2, 60.0, 0.2, 0.6, 0.8, 0.15, 1.45, 0.01, -0.02, 0.4, -0.2]);
        let (mut sum, mut gradient) = (0.0, 0.0);
        for p in &fit.pixels {
            for k in 0..LANES {
                let (value, slopes) = Model::of(&n).slopes(p.x[k], p.y[k]);
                let left = f64::from(value - p.value[k]);
                sum += f64::from(p.weight[k]) * left * left;
                gradient += f64::from(p.weight[k]) * left * f64::from(slopes[PLACE]);
            }
        }
        assert!((fit.sums(&n)[0] / sum - 1.0).abs() < 1e-5);
        assert!((fit.normal(&n).1[PLACE] / gradient - 1.0).abs() < 1e-4);
    }
}
