//! A neighbourhood of skin, and the sums of products over its pixels that the fit of its motion needs: eight pixels at once.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]
#![expect(clippy::needless_range_loop, reason = "lanes are counted through several arrays at once")]

use nalgebra::{Point2, SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use super::super::gray::Spline;
use super::super::lanes::{self, LANES, Lanes};

/// Numbers of the warp along one axis.
pub(super) const WARP: usize = 6;
/// Numbers of the whole fit: the warp along both axes, and a, b and c of the light.
const NUMBERS: usize = 2 * WARP + 4;
pub(super) type Numbers = SVector<f64, NUMBERS>;
pub(super) type Normal = SMatrix<f64, NUMBERS, NUMBERS>;

/// Most samples along half a side.
const MOST_SAMPLES: i32 = 40;
/// Spread of the weights, as a share of the radius.
const SPREAD: f32 = 0.5;

/// A neighbourhood of the first picture. Offsets are in shares of its radius, so that all numbers of a warp are of one size: px.
pub(super) struct Window {
    pub(super) from: Point2<f64>,
    pub(super) radius: f64,
    /// Places compared along the radius.
    pub(super) samples: i32,
    /// Sum of the weights.
    pub(super) total: f32,
    /// Weighted sum of the squared values.
    pub(super) contrast: f64,
    pixels: Vec<Pixels>,
}

/// Eight pixels of a neighbourhood.
#[derive(Clone, Copy, Default)]
struct Pixels {
    x: Lanes,
    y: Lanes,
    weight: Lanes,
    /// Brightness beside the mean of the neighbourhood, and its slopes, per px.
    value: Lanes,
    right: Lanes,
    down: Lanes,
}

/// JᵀWJ, and what changes with every step.
pub(super) struct Sums {
    pub(super) matrix: Normal,
    pub(super) pull: Pull,
}

/// JᵀW(what is left), and the weighted sum of what is left, squared.
pub(super) struct Pull {
    pub(super) gradient: Numbers,
    pub(super) squares: f64,
}

impl Window {
    /// A disc about a place, compared at so many places along its radius.
    pub(super) fn cut(first: &Spline, from: Point2<f64>, radius: f64, samples: usize) -> Self {
        let samples = i32::try_from(samples).unwrap_or(MOST_SAMPLES).clamp(3, MOST_SAMPLES);
        let mut window = Self { from, radius, samples, total: 0.0, contrast: 0.0, pixels: disc(samples) };
        Arch::new().dispatch(Cut { window: &mut window, first });
        window
    }

    /// All sums at a warp.
    pub(super) fn sums(&self, last: &Spline, n: &Numbers) -> Sums {
        Arch::new().dispatch(All { window: self, last, n: narrow(n), shift: [n[0], n[WARP]] })
    }

    /// What changes with every step alone, with the slopes at that warp.
    pub(super) fn pull(&self, last: &Spline, n: &Numbers) -> Pull {
        Arch::new().dispatch(Step { window: self, last, n: narrow(n), shift: [n[0], n[WARP]] })
    }
}

/// Offsets and weights of a disc; what is left of the last eight weighs nothing.
fn disc(samples: i32) -> Vec<Pixels> {
    // A Gaussian of both offsets is the product of one a side.
    let side: Vec<f32> = (0..=samples)
        .map(|k| {
            let o = k as f32 / samples as f32;
            (-o * o / (2.0 * SPREAD * SPREAD)).exp()
        })
        .collect();
    let mut pixels = Vec::with_capacity((samples * samples) as usize / 2);
    let mut eight = Pixels::default();
    let mut lane = 0;
    for j in -samples..=samples {
        for i in -samples..=samples {
            // A disc: the corners of a square are farthest away and bend most.
            if i * i + j * j > samples * samples {
                continue;
            }
            eight.x[lane] = i as f32 / samples as f32;
            eight.y[lane] = j as f32 / samples as f32;
            eight.weight[lane] = side[i.unsigned_abs() as usize] * side[j.unsigned_abs() as usize];
            lane += 1;
            if lane == LANES {
                pixels.push(std::mem::take(&mut eight));
                lane = 0;
            }
        }
    }
    if lane > 0 {
        pixels.push(eight);
    }
    pixels
}

fn narrow(n: &Numbers) -> [f32; NUMBERS] {
    // The shift itself is added to the place in double precision.
    std::array::from_fn(|k| if k % WARP == 0 && k < 2 * WARP { 0.0 } else { n[k] as f32 })
}

/// The pixel that a place lies in, and where in it.
fn within(at: Point2<f64>) -> ([i32; 2], [f32; 2]) {
    let whole = at.map(f64::floor);
    ([whole.x as i32, whole.y as i32], [(at.x - whole.x) as f32, (at.y - whole.y) as f32])
}

struct Cut<'a> {
    window: &'a mut Window,
    first: &'a Spline,
}

impl WithSimd for Cut<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { window, first } = self;
        let (corner, at) = within(window.from);
        let radius = window.radius as f32;
        let (mut total, mut sum) = ([0.0; LANES], [0.0; LANES]);
        for p in &mut window.pixels {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                x[k] = at[0] + p.x[k] * radius;
                y[k] = at[1] + p.y[k] * radius;
            }
            [p.value, p.right, p.down] = first.sample_lanes(corner, &x, &y);
            for k in 0..LANES {
                total[k] += p.weight[k];
                sum[k] += p.weight[k] * p.value[k];
            }
        }
        let total = lanes::sum(&total);
        let mean = (lanes::sum(&sum) / total) as f32;
        let mut squares = [0.0; LANES];
        for p in &mut window.pixels {
            for k in 0..LANES {
                p.value[k] -= mean;
                squares[k] += p.weight[k] * p.value[k] * p.value[k];
            }
        }
        window.total = total as f32;
        window.contrast = lanes::sum(&squares);
    }
}

/// What is left of eight pixels, and how it changes with each number.
struct Compared {
    left: Lanes,
    rows: [Lanes; NUMBERS],
}

impl Pixels {
    #[inline(always)]
    fn compared(&self, last: &Spline, corner: [i32; 2], at: [f32; 2], radius: f32, n: &[f32; NUMBERS]) -> Compared {
        let mut phi = [[1.0; LANES]; WARP];
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let (u, v) = (self.x[k], self.y[k]);
            let p = [1.0, u, v, 0.5 * u * u, u * v, 0.5 * v * v];
            let (mut to_x, mut to_y) = (at[0] + u * radius, at[1] + v * radius);
            for i in 1..WARP {
                phi[i][k] = p[i];
                to_x += n[i] * p[i];
                to_y += n[WARP + i] * p[i];
            }
            (x[k], y[k]) = (to_x, to_y);
        }
        let [value, right, down] = last.sample_lanes(corner, &x, &y);
        let [a, b, c, d] = [n[2 * WARP], n[2 * WARP + 1], n[2 * WARP + 2], n[2 * WARP + 3]];
        let mut left = [0.0; LANES];
        let mut rows = [[0.0; LANES]; NUMBERS];
        for k in 0..LANES {
            left[k] = value[k] - a * self.value[k] - b - c * self.x[k] - d * self.y[k];
            let gx = 0.5 * (right[k] + a * self.right[k]);
            let gy = 0.5 * (down[k] + a * self.down[k]);
            for i in 0..WARP {
                rows[i][k] = gx * phi[i][k];
                rows[WARP + i][k] = gy * phi[i][k];
            }
            rows[2 * WARP][k] = -self.value[k];
            rows[2 * WARP + 1][k] = -1.0;
            rows[2 * WARP + 2][k] = -self.x[k];
            rows[2 * WARP + 3][k] = -self.y[k];
        }
        Compared { left, rows }
    }
}

/// Sums that every step needs, lane by lane.
struct Gathered {
    pull: [Lanes; NUMBERS],
    squares: Lanes,
}

impl Gathered {
    fn none() -> Self {
        Self { pull: [[0.0; LANES]; NUMBERS], squares: [0.0; LANES] }
    }

    /// Adds some pixels, whose difference is weighted.
    #[inline(always)]
    fn add(&mut self, c: &Compared, weight: &Lanes) {
        let mut weighted = [0.0; LANES];
        for k in 0..LANES {
            weighted[k] = weight[k] * c.left[k];
            self.squares[k] += weighted[k] * c.left[k];
        }
        for a in 0..NUMBERS {
            for k in 0..LANES {
                self.pull[a][k] += weighted[k] * c.rows[a][k];
            }
        }
    }

    fn sum(&self) -> Pull {
        Pull { gradient: Numbers::from_fn(|a, _| lanes::sum(&self.pull[a])), squares: lanes::sum(&self.squares) }
    }
}

impl Window {
    /// The corner of the pixel that the middle is moved to, and where in it.
    fn moved(&self, shift: [f64; 2]) -> ([i32; 2], [f32; 2]) {
        within(Point2::new(self.from.x + shift[0], self.from.y + shift[1]))
    }
}

struct All<'a> {
    window: &'a Window,
    last: &'a Spline,
    n: [f32; NUMBERS],
    shift: [f64; 2],
}

impl WithSimd for All<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let Self { window, last, n, shift } = self;
        let (corner, at) = window.moved(shift);
        let mut matrix = [[0.0; LANES]; NUMBERS * (NUMBERS + 1) / 2];
        let mut gathered = Gathered::none();
        for p in &window.pixels {
            let c = p.compared(last, corner, at, window.radius as f32, &n);
            gathered.add(&c, &p.weight);
            let mut place = 0;
            for a in 0..NUMBERS {
                let mut weighted = [0.0; LANES];
                for k in 0..LANES {
                    weighted[k] = p.weight[k] * c.rows[a][k];
                }
                for row in &c.rows[..=a] {
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
        Sums { matrix, pull: gathered.sum() }
    }
}

struct Step<'a> {
    window: &'a Window,
    last: &'a Spline,
    n: [f32; NUMBERS],
    shift: [f64; 2],
}

impl WithSimd for Step<'_> {
    type Output = Pull;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Pull {
        let Self { window, last, n, shift } = self;
        let (corner, at) = window.moved(shift);
        let mut gathered = Gathered::none();
        for p in &window.pixels {
            gathered.add(&p.compared(last, corner, at, window.radius as f32, &n), &p.weight);
        }
        gathered.sum()
    }
}
