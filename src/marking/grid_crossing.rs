//! Finds the crossing of two painted lines near a place: both lines are fitted to the picture at once, to a fraction of a pixel.
//!
//! The skin about a crossing is modelled as light b + g · x, less dark paint a where two lines cover it. A line is 2h wide, its edges are
//! soft over s, and it may be bent by κ, as painted lines are once the skin has moved:
//!
//! ```text
//! I(x) = b + g · x − a (1 − (1 − e₁)(1 − e₂)),   eₖ = ½ tanh((dₖ + hₖ) / s) − ½ tanh((dₖ − hₖ) / s),
//! dₖ = nₖ · (x − c) − ½ κₖ (tₖ · (x − c))²
//! ```
//!
//! All thirteen numbers (b, g, a, s, two of h, directions and κ, and c) are fitted by Levenberg and Marquardt's method; c is the crossing.

use nalgebra::{Point2, SMatrix, SVector, Vector2};

use super::gray::{Gray, Spline};
use super::prepared::Prepared;

/// Choices of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingSettings {
    /// How far from the place that was pointed at the crossing may lie, px (at most 64). Default 7.
    pub reach_px: f64,
    /// Half the side of the window in which the lines are fitted, px (3 to 64): wider than a line, less than half the distance of
    /// two. Default 8.
    pub window_px: usize,
    /// Least angle between the two lines, radians. Default 0.5 (29°).
    pub least_angle: f64,
}

impl Default for CrossingSettings {
    fn default() -> Self {
        Self { reach_px: 7.0, window_px: 8, least_angle: 0.5 }
    }
}

impl CrossingSettings {
    /// Choices that suit a picture of so many pixels a millimetre: lines of 0.4 to 2 mm, 5 mm apart or more.
    pub fn at_scale(px_per_mm: f64) -> Self {
        let mm = if px_per_mm.is_finite() { px_per_mm.max(0.0) } else { 4.0 };
        Self {
            reach_px: (1.7 * mm).clamp(4.0, 64.0),
            window_px: (1.9 * mm).round().clamp(5.0, 64.0) as usize,
            ..Self::default()
        }
    }
}

/// Two lines that cross.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Where they cross, px.
    pub at: Point2<f64>,
    /// Unit directions of the lines; the first is the nearer to horizontal.
    pub directions: [Vector2<f64>; 2],
    /// Widths of the two lines, at half the paint's darkness, px.
    pub widths_px: [f64; 2],
    /// Darkness of the paint, grey levels.
    pub contrast: f64,
    /// What the model leaves unexplained, root mean square, as a share of the contrast.
    pub residual: f64,
    /// Standard error of the crossing along x and y, px.
    pub sigma_px: [f64; 2],
}

/// Why there is no crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCrossing {
    /// The window reaches beyond the picture.
    #[error("the window reaches beyond the picture")]
    OutOfPicture,
    /// No two lines cross within reach.
    #[error("no two painted lines cross here")]
    NoLines,
    /// The fit did not settle within reach.
    #[error("the lines could not be fitted")]
    Unsettled,
}

/// Directions tried for a line, over half a turn.
const DIRECTIONS: usize = 24;
/// The fit's numbers: b, g_x, g_y, a, ln s, two of ln h, two angles, two of κ, c_x, c_y.
const NUMBERS: usize = 13;
// Where each kind of number begins.
const PAINT: usize = 3;
const SOFT: usize = 4;
const HALF: usize = 5;
const ANGLE: usize = 7;
const BEND: usize = 9;
const PLACE: usize = 11;
/// How much a line may bend and what softness is expected, held weakly: as one grey level's noise over the window would.
const BEND_PER_PX: f64 = 0.02;
/// Paint must be darker than so many times what is left unexplained.
const LEAST_CLARITY: f64 = 4.0;

/// Finds the crossing nearest to a place that was pointed at.
pub fn find(picture: &Prepared, near: Point2<f64>, settings: &CrossingSettings) -> Result<Crossing, NoCrossing> {
    let window = settings.window_px.clamp(3, 64);
    let settings = &CrossingSettings { reach_px: settings.reach_px.clamp(0.0, 64.0), ..*settings };
    if !picture.spline().holds(&near, window as f64 + settings.reach_px) {
        return Err(NoCrossing::OutOfPicture);
    }
    let start = rough(picture.spline(), near, settings, window as f64)?;
    fitted(picture, near, &start, settings)
}

/// As [`find`], beginning with lines of known directions (radians from the right, clockwise) and widths at the place itself: without the
/// search, and therefore about three times as fast.
pub fn find_along(
    picture: &Prepared,
    near: Point2<f64>,
    angles: [f64; 2],
    widths_px: [f64; 2],
    settings: &CrossingSettings,
) -> Result<Crossing, NoCrossing> {
    if !picture.spline().holds(&near, settings.window_px.clamp(3, 64) as f64) {
        return Err(NoCrossing::OutOfPicture);
    }
    fitted(picture, near, &Start { at: near, angles, widths_px: Some(widths_px) }, settings)
}

fn fitted(
    picture: &Prepared,
    near: Point2<f64>,
    start: &Start,
    settings: &CrossingSettings,
) -> Result<Crossing, NoCrossing> {
    let window = settings.window_px.clamp(3, 64);
    let mut fit = Fit::new(picture.gray(), start.at, window);
    let (mut numbers, mut sum) = fit.solve(start.numbers(&fit)).ok_or(NoCrossing::Unsettled)?;
    let crossing = |n: &Numbers| Point2::new(n[PLACE], n[PLACE + 1]);
    let in_reach = |at: Point2<f64>| (at - near).norm() <= settings.reach_px + 1.0;
    // Paint has not quite the model's profile: a window that is not centred would pull the lines to one side.
    for _ in 0..2 {
        let at = crossing(&numbers);
        if !in_reach(at) {
            return Err(NoCrossing::NoLines);
        }
        if (at - fit.middle).norm() < 0.3 {
            break;
        }
        fit = Fit::new(picture.gray(), at, window);
        (numbers, sum) = fit.solve(numbers).ok_or(NoCrossing::Unsettled)?;
    }
    let at = crossing(&numbers);
    let direction = |k: usize| Vector2::new(numbers[ANGLE + k].cos(), numbers[ANGLE + k].sin());
    let mut lines = [0, 1].map(|k| {
        let d = direction(k);
        (if d.x < 0.0 { -d } else { d }, 2.0 * numbers[HALF + k].exp())
    });
    let between = lines[0].0.perp(&lines[1].0).abs().min(1.0).asin();
    let thin = lines.iter().all(|l| (0.5..1.4 * window as f64).contains(&l.1));
    let bent = (0..2).any(|k| numbers[BEND + k].abs() * window as f64 > 1.0);
    let total: f64 = fit.weights.iter().sum();
    let left = (sum / total).sqrt();
    let contrast = numbers[PAINT];
    if !(in_reach(at) && between >= settings.least_angle && thin && !bent && contrast > LEAST_CLARITY * left) {
        return Err(NoCrossing::NoLines);
    }
    if lines[0].0.x < lines[1].0.x {
        lines.swap(0, 1);
    }
    let sigma_px = fit.standard_errors(&numbers, sum / total).ok_or(NoCrossing::Unsettled)?;
    Ok(Crossing {
        at,
        directions: lines.map(|l| l.0),
        widths_px: lines.map(|l| l.1),
        contrast,
        residual: left / contrast,
        sigma_px,
    })
}

/// Where a fit starts.
struct Start {
    at: Point2<f64>,
    angles: [f64; 2],
    /// Widths of the lines, where they are known.
    widths_px: Option<[f64; 2]>,
}

/// The place within reach from which two directions are darkest beside those between them.
fn rough(picture: &Spline, near: Point2<f64>, settings: &CrossingSettings, window: f64) -> Result<Start, NoCrossing> {
    const STEP: f64 = 1.5;
    let reach = (settings.reach_px / STEP).ceil() as i32;
    let least_apart = (settings.least_angle / std::f64::consts::PI * DIRECTIONS as f64).ceil() as usize;
    let mut best: Option<(f64, Start)> = None;
    for i in -reach..=reach {
        for j in -reach..=reach {
            let shift = Vector2::new(f64::from(i), f64::from(j)) * STEP;
            if shift.norm() > settings.reach_px {
                continue;
            }
            let at = near + shift;
            let mean: Vec<f64> = (0..DIRECTIONS).map(|k| along(picture, at, direction(k), window)).collect();
            for a in 0..DIRECTIONS {
                for b in a + least_apart..DIRECTIONS.min(a + DIRECTIONS + 1 - least_apart) {
                    // Both must be dark, and light between them on either side: one broad line holds many dark directions. Nearness
                    // decides between equals.
                    let halfway = usize::midpoint(a, b);
                    let light = mean[halfway].min(mean[(halfway + DIRECTIONS / 2) % DIRECTIONS]);
                    let dark = light - mean[a].max(mean[b]) - 0.15 * shift.norm();
                    if best.as_ref().is_none_or(|(d, _)| dark > *d) {
                        best = Some((dark, Start { at, angles: [direction(a), direction(b)], widths_px: None }));
                    }
                }
            }
        }
    }
    best.filter(|(dark, _)| *dark > 1.0).map(|(_, start)| start).ok_or(NoCrossing::NoLines)
}

fn direction(k: usize) -> f64 {
    k as f64 / DIRECTIONS as f64 * std::f64::consts::PI
}

/// Mean brightness along a line through a place.
fn along(picture: &Spline, at: Point2<f64>, angle: f64, window: f64) -> f64 {
    const SAMPLES: i32 = 5;
    let step = Vector2::new(angle.cos(), angle.sin()) * (0.9 * window / f64::from(SAMPLES));
    let sum: f64 = (-SAMPLES..=SAMPLES).map(|k| picture.sample(&(at + step * f64::from(k))).value).sum();
    sum / f64::from(2 * SAMPLES + 1)
}

impl Start {
    fn numbers(&self, fit: &Fit) -> Numbers {
        // Robust against a hair or a spot: the tenth part from either end.
        let mut sorted: Vec<f64> = fit.values.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
        let (low, high) = (at(0.1), at(0.9));
        let halves = self.widths_px.map_or([0.18 * fit.radius; 2], |w| w.map(|w| 0.5 * w));
        let [first, second] = self.angles;
        Numbers::from_column_slice(&[
            high,
            0.0,
            0.0,
            high - low,
            0.0,
            halves[0].ln(),
            halves[1].ln(),
            first,
            second,
            0.0,
            0.0,
            self.at.x,
            self.at.y,
        ])
    }
}

type Numbers = SVector<f64, NUMBERS>;

/// The window about a place.
struct Fit {
    middle: Point2<f64>,
    radius: f64,
    places: Vec<Point2<f64>>,
    values: Vec<f64>,
    weights: Vec<f64>,
}

/// What one line says at a place: how much it covers, and the derivatives of that.
struct Cover {
    share: f64,
    by_soft: f64,
    by_half: f64,
    by_angle: f64,
    by_bend: f64,
    by_place: [f64; 2],
}

/// A line of the model, with what depends on its numbers alone.
struct Painted {
    sin: f64,
    cos: f64,
    bend: f64,
    half: f64,
    soft: f64,
    /// exp(2h / s).
    width: f64,
}

impl Painted {
    fn of(n: &Numbers, k: usize) -> Self {
        let (sin, cos) = n[ANGLE + k].sin_cos();
        let (half, soft) = (n[HALF + k].exp(), n[SOFT].exp());
        Self { sin, cos, bend: n[BEND + k], half, soft, width: (2.0 * half / soft).min(60.0).exp() }
    }

    /// How much the line covers at a place.
    fn share(&self, r: &Vector2<f64>) -> f64 {
        let (along, across) = (r.x * self.cos + r.y * self.sin, r.y * self.cos - r.x * self.sin);
        let d = across - 0.5 * self.bend * along * along;
        let e = (2.0 * d / self.soft).clamp(-60.0, 60.0).exp();
        1.0 / (1.0 + e / self.width) - 1.0 / (1.0 + e * self.width)
    }

    /// ½ tanh(u) = ½ − 1 / (1 + exp 2u) needs one exponential for both edges.
    fn cover(&self, r: &Vector2<f64>) -> Cover {
        let (along, across) = (r.x * self.cos + r.y * self.sin, r.y * self.cos - r.x * self.sin);
        let d = across - 0.5 * self.bend * along * along;
        let e = (2.0 * d / self.soft).clamp(-60.0, 60.0).exp();
        let (p, q) = (1.0 / (1.0 + e * self.width), 1.0 / (1.0 + e / self.width));
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

impl Fit {
    fn new(picture: &Gray, middle: Point2<f64>, window: usize) -> Self {
        let side = 2 * window + 1;
        let radius = window as f64;
        let spread = 0.55 * radius;
        // The pixels themselves: smoothing would round the corners between the lines.
        let corner = middle.map(|c| c.floor() + 0.5 - radius);
        // A disc: the corners of a square weigh little and cost as much.
        let places: Vec<Point2<f64>> = (0..side * side)
            .map(|i| corner + Vector2::new((i % side) as f64, (i / side) as f64))
            .filter(|p| (p - middle).norm() <= radius)
            .collect();
        let values = places.iter().map(|p| f64::from(picture.at(p.x as isize, p.y as isize))).collect();
        let weights = places.iter().map(|p| (-(p - middle).norm_squared() / (2.0 * spread * spread)).exp()).collect();
        Self { middle, radius, places, values, weights }
    }

    /// Brightness of the model at a place, and its derivative by every number.
    fn model(&self, n: &Numbers, lines: &[Painted; 2], at: &Point2<f64>) -> (f64, Numbers) {
        let from_middle = at - self.middle;
        let r = at - Point2::new(n[PLACE], n[PLACE + 1]);
        let [first, second] = [lines[0].cover(&r), lines[1].cover(&r)];
        let cover = 1.0 - (1.0 - first.share) * (1.0 - second.share);
        let paint = n[PAINT];
        let (u, v) = (-paint * (1.0 - second.share), -paint * (1.0 - first.share));
        let value = n[0] + n[1] * from_middle.x + n[2] * from_middle.y - paint * cover;
        let slope = Numbers::from_column_slice(&[
            1.0,
            from_middle.x,
            from_middle.y,
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
        ]);
        (value, slope)
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
        let lines = [Painted::of(n, 0), Painted::of(n, 1)];
        let at = Point2::new(n[PLACE], n[PLACE + 1]);
        let value = |p: &Point2<f64>| {
            let (m, r) = (p - self.middle, p - at);
            let bare = (1.0 - lines[0].share(&r)) * (1.0 - lines[1].share(&r));
            n[0] + n[1] * m.x + n[2] * m.y - n[PAINT] * (1.0 - bare)
        };
        let one = |((p, v), w): ((&Point2<f64>, &f64), &f64)| w * (value(p) - v).powi(2);
        let sum: f64 = self.places.iter().zip(&self.values).zip(&self.weights).map(one).sum();
        [sum, sum + self.held(n).iter().map(|h| h.0 * h.0).sum::<f64>()]
    }

    /// Normal equations: JᵀWJ and JᵀW(model − picture).
    fn normal(&self, n: &Numbers) -> (SMatrix<f64, NUMBERS, NUMBERS>, Numbers) {
        let lines = [Painted::of(n, 0), Painted::of(n, 1)];
        let mut matrix = SMatrix::<f64, NUMBERS, NUMBERS>::zeros();
        let mut gradient = Numbers::zeros();
        for ((p, v), w) in self.places.iter().zip(&self.values).zip(&self.weights) {
            let (model, slope) = self.model(n, &lines, p);
            for column in 0..NUMBERS {
                let weighted = slope[column] * w;
                for row in column..NUMBERS {
                    matrix[(row, column)] += slope[row] * weighted;
                }
            }
            gradient += slope * (w * (model - v));
        }
        for (left, slope, k) in self.held(n) {
            matrix[(k, k)] += slope * slope;
            gradient[k] += slope * left;
            if k == HALF {
                // The difference of the two widths is held.
                matrix[(k + 1, k + 1)] += slope * slope;
                matrix[(k + 1, k)] -= slope * slope;
                gradient[k + 1] -= slope * left;
            }
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        (matrix, gradient)
    }

    /// The numbers that fit best and their weighted sum of squares; none where the search does not settle.
    fn solve(&self, start: Numbers) -> Option<(Numbers, f64)> {
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
            if tried_sums[1].is_finite() && tried_sums[1] <= sums[1] {
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
    fn standard_errors(&self, n: &Numbers, variance: f64) -> Option<[f64; 2]> {
        let (matrix, _) = self.normal(n);
        let lines = [Painted::of(n, 0), Painted::of(n, 1)];
        let mut middle = SMatrix::<f64, NUMBERS, NUMBERS>::zeros();
        for (p, w) in self.places.iter().zip(&self.weights) {
            let slope = self.model(n, &lines, p).1;
            middle += slope * slope.transpose() * (w * w);
        }
        let inverse = matrix.try_inverse()?;
        let covariance = inverse * middle * inverse * variance;
        Some([PLACE, PLACE + 1].map(|k| covariance[(k, k)].max(0.0).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::Noise;

    /// Painted lines 1.8 px wide with sharp edges, blurred by taking 8 × 8 samples a pixel: not the model's own profile.
    fn painted(crossing: [f64; 2], angles: [f64; 2], noise: f64, seed: u64) -> Prepared {
        let mut random = Noise(seed);
        let values = (0..60 * 60).map(|i| {
            let (x, y) = (f64::from(i % 60), f64::from(i / 60));
            let mut dark = 0.0;
            for k in 0..64 {
                let p = Vector2::new(x + f64::from(k % 8) / 8.0 + 0.0625, y + f64::from(k / 8) / 8.0 + 0.0625);
                let d = p - Vector2::from(crossing);
                let on = angles.iter().any(|a| (d.y * a.cos() - d.x * a.sin()).abs() < 0.9);
                dark += if on { 1.0 / 64.0 } else { 0.0 };
            }
            (150.0 + 0.4 * x - 0.2 * y - 70.0 * dark + noise * random.normal()) as f32
        });
        Prepared::of(Gray::new(60, 60, values.collect()).unwrap())
    }

    #[test]
    fn the_crossing_of_sharp_lines_is_found_to_a_fiftieth_of_a_pixel() {
        for (crossing, angles) in [
            ([30.0, 30.0], [0.0, 1.571]),
            ([30.37, 29.71], [0.12, 1.66]),
            ([29.5, 30.5], [0.7, 2.2]),
            ([30.81, 30.26], [2.9, 1.2]),
        ] {
            let picture = painted(crossing, angles, 0.0, 1);
            let near = Point2::new(crossing[0] + 3.1, crossing[1] - 2.3);
            let found = find(&picture, near, &CrossingSettings::default()).unwrap();
            let error = (found.at - Point2::from(crossing)).norm();
            assert!(error < 0.02, "{error} px at {crossing:?}");
            assert!(found.residual < 0.1 && found.directions[0].x >= found.directions[1].x);
        }
    }

    #[test]
    fn with_noise_the_scatter_is_what_the_standard_error_says() {
        let (mut errors, mut stated) = (Vec::new(), Vec::new());
        for seed in 0..100 {
            let picture = painted([30.37, 29.71], [0.12, 1.66], 5.0, seed);
            let found = find(&picture, Point2::new(32.0, 28.5), &CrossingSettings::default()).unwrap();
            errors.extend([found.at.x - 30.37, found.at.y - 29.71]);
            stated.extend(found.sigma_px);
        }
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len() as f64).sqrt();
        assert!(rms(&errors) < 0.1, "{} px", rms(&errors));
        let ratio = rms(&errors) / rms(&stated);
        assert!((0.75..1.3).contains(&ratio), "scatter is {ratio} of what is stated");
    }

    #[test]
    fn bare_skin_one_line_and_the_border_have_no_crossing() {
        let settings = CrossingSettings::default();
        let bare = painted([1e6, 1e6], [0.0, 1.5], 3.0, 4);
        assert!(find(&bare, Point2::new(30.0, 30.0), &settings).is_err());
        let one = painted([30.0, 30.0], [0.3, 0.3], 2.0, 5);
        assert!(find(&one, Point2::new(30.0, 30.0), &settings).is_err());
        let two = painted([30.0, 30.0], [0.0, 1.5], 0.0, 6);
        assert_eq!(find(&two, Point2::new(8.0, 30.0), &settings), Err(NoCrossing::OutOfPicture));
        assert_eq!(find(&two, Point2::new(f64::NAN, 30.0), &settings), Err(NoCrossing::OutOfPicture));
        // A crossing out of reach is not drawn near.
        assert!(find(&two, Point2::new(42.0, 43.0), &settings).is_err());
    }

    /// The model's derivatives against central differences.
    #[test]
    fn the_derivatives_are_those_of_the_model() {
        let picture = painted([30.0, 30.0], [0.1, 1.4], 0.0, 7);
        let fit = Fit::new(picture.gray(), Point2::new(30.0, 30.0), 8);
        let n =
            Numbers::from_column_slice(&[150.0, 0.3, -0.2, 60.0, 0.2, 0.6, 0.8, 0.15, 1.45, 0.01, -0.02, 30.4, 29.8]);
        let value = |n: &Numbers, p: &Point2<f64>| fit.model(n, &[Painted::of(n, 0), Painted::of(n, 1)], p);
        for p in [Point2::new(31.0, 30.2), Point2::new(28.3, 33.1), Point2::new(30.4, 29.9)] {
            let slope = value(&n, &p).1;
            for k in 0..NUMBERS {
                let step = 1e-5;
                let (mut less, mut more) = (n, n);
                less[k] -= step;
                more[k] += step;
                let expected = (value(&more, &p).0 - value(&less, &p).0) / (2.0 * step);
                assert!(
                    (slope[k] - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                    "number {k}: {} for {expected}",
                    slope[k]
                );
            }
        }
    }
}
