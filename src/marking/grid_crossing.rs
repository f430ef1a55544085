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

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

mod fit;

use nalgebra::{Point2, Vector2};
use pulp::{Arch, Simd, WithSimd};

use super::gray::Spline;
use super::lanes::{LANES, Lanes};
use super::prepared::Prepared;
use fit::{ANGLE, BEND, Fit, HALF, Numbers, PAINT, PLACE};

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
/// Paint must be darker than so many times what is left unexplained.
const LEAST_CLARITY: f64 = 4.0;

/// Finds the crossing nearest to a place that was pointed at.
pub fn find(picture: &Prepared, near: Point2<f64>, settings: &CrossingSettings) -> Result<Crossing, NoCrossing> {
    let window = settings.window_px.clamp(3, 64);
    let settings = &CrossingSettings { reach_px: settings.reach_px.clamp(0.0, 64.0), ..*settings };
    if !picture.spline().holds(&near, window as f64 + settings.reach_px) {
        return Err(NoCrossing::OutOfPicture);
    }
    let start = rough(picture.soft(), near, settings, window as f64)?;
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
    let crossing = |fit: &Fit, n: &Numbers| fit.middle + Vector2::new(n[PLACE], n[PLACE + 1]);
    let in_reach = |at: Point2<f64>| (at - near).norm() <= settings.reach_px + 1.0;
    // Paint has not quite the model's profile: a window that is not centred would pull the lines to one side.
    for _ in 0..2 {
        let at = crossing(&fit, &numbers);
        if !in_reach(at) {
            return Err(NoCrossing::NoLines);
        }
        if (at - fit.middle).norm() < 0.3 {
            break;
        }
        // Light and place are counted from the middle of the window.
        let shift = at - fit.middle;
        numbers[0] += numbers[1] * shift.x + numbers[2] * shift.y;
        (numbers[PLACE], numbers[PLACE + 1]) = (0.0, 0.0);
        fit = Fit::new(picture.gray(), at, window);
        (numbers, sum) = fit.solve(numbers).ok_or(NoCrossing::Unsettled)?;
    }
    let at = crossing(&fit, &numbers);
    let direction = |k: usize| Vector2::new(numbers[ANGLE + k].cos(), numbers[ANGLE + k].sin());
    let mut lines = [0, 1].map(|k| {
        let d = direction(k);
        (if d.x < 0.0 { -d } else { d }, 2.0 * numbers[HALF + k].exp())
    });
    let between = lines[0].0.perp(&lines[1].0).abs().min(1.0).asin();
    let thin = lines.iter().all(|l| (0.5..1.4 * window as f64).contains(&l.1));
    let bent = (0..2).any(|k| numbers[BEND + k].abs() * window as f64 > 1.0);
    let left = (sum / fit.total).sqrt();
    let contrast = numbers[PAINT];
    if !(in_reach(at) && between >= settings.least_angle && thin && !bent && contrast > LEAST_CLARITY * left) {
        return Err(NoCrossing::NoLines);
    }
    if lines[0].0.x < lines[1].0.x {
        lines.swap(0, 1);
    }
    let sigma_px = fit.standard_errors(&numbers, sum / fit.total).ok_or(NoCrossing::Unsettled)?;
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
    let rays = Rays::of(window);
    let mut best: Option<(f64, Start)> = None;
    for i in -reach..=reach {
        for j in -reach..=reach {
            let shift = Vector2::new(f64::from(i), f64::from(j)) * STEP;
            if shift.norm() > settings.reach_px {
                continue;
            }
            let at = near + shift;
            let mean = rays.means(picture, at);
            for a in 0..DIRECTIONS {
                for b in a + least_apart..DIRECTIONS.min(a + DIRECTIONS + 1 - least_apart) {
                    // Both must be dark, and light between them on either side: one broad line holds many dark directions. Nearness
                    // decides between equals.
                    let halfway = usize::midpoint(a, b);
                    let light = mean[halfway].min(mean[(halfway + DIRECTIONS / 2) % DIRECTIONS]);
                    let dark = f64::from(light - mean[a].max(mean[b])) - 0.15 * shift.norm();
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

/// Places along lines through one place, in all directions; lines of eight directions side by side.
struct Rays {
    steps: [[Lanes; 2]; DIRECTIONS / LANES],
}

/// Places on either side of the middle.
const ALONG: i32 = 5;

impl Rays {
    fn of(window: f64) -> Self {
        let length = 0.9 * window / f64::from(ALONG);
        let steps = std::array::from_fn(|g| {
            let angle = |k: usize| direction(LANES * g + k);
            [
                std::array::from_fn(|k| (angle(k).cos() * length) as f32),
                std::array::from_fn(|k| (angle(k).sin() * length) as f32),
            ]
        });
        Self { steps }
    }

    /// Mean brightness along each line through a place.
    fn means(&self, picture: &Spline, at: Point2<f64>) -> [f32; DIRECTIONS] {
        Arch::new().dispatch(Means { rays: self, picture, at })
    }
}

struct Means<'a> {
    rays: &'a Rays,
    picture: &'a Spline,
    at: Point2<f64>,
}

impl WithSimd for Means<'_> {
    type Output = [f32; DIRECTIONS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f32; DIRECTIONS] {
        let corner = self.at.map(|c| c.floor() as i32);
        let from = [(self.at.x - f64::from(corner.x)) as f32, (self.at.y - f64::from(corner.y)) as f32];
        let mut means = [0.0; DIRECTIONS];
        for (steps, mean) in self.rays.steps.iter().zip(means.chunks_exact_mut(LANES)) {
            let mut sum = [0.0; LANES];
            for i in -ALONG..=ALONG {
                let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
                for k in 0..LANES {
                    x[k] = from[0] + i as f32 * steps[0][k];
                    y[k] = from[1] + i as f32 * steps[1][k];
                }
                let [value, ..] = self.picture.sample_lanes([corner.x, corner.y], &x, &y);
                for k in 0..LANES {
                    sum[k] += value[k];
                }
            }
            for k in 0..LANES {
                mean[k] = sum[k] / (2 * ALONG + 1) as f32;
            }
        }
        means
    }
}

impl Start {
    fn numbers(&self, fit: &Fit) -> Numbers {
        // Robust against a hair or a spot: the tenth part from either end.
        let [low, high] = fit.brightness([0.1, 0.9]);
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
            self.at.x - fit.middle.x,
            self.at.y - fit.middle.y,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::super::gray::Gray;
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
}
