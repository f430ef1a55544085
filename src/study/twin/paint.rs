//! What colour the skin is at each place: skin tone, lips, brows, hairline, and the grid painted over them.
//!
//! All places are (x, y) of the first frame, mm: the paint moves with the skin. Colours are linear light, 0 to 1.

use nalgebra::{Point2, Vector3};

use super::TwinSettings;
use super::noise::{layered, smooth};

/// Linear light in red, green and blue.
pub(super) type Light = Vector3<f64>;

const SKIN: [f64; 3] = [0.68, 0.41, 0.29];
const LIP: [f64; 3] = [0.46, 0.14, 0.13];
const HAIR: [f64; 3] = [0.058, 0.036, 0.024];
const INK: [f64; 3] = [0.018, 0.028, 0.075];
const NOSTRIL: [f64; 3] = [0.055, 0.02, 0.014];

/// The grid's ink covers this share of the skin's light.
const INK_COVER: f64 = 0.9;

/// Half the width of the soft edge of a painted line, mm.
const INK_EDGE_MM: f64 = 0.12;

/// Middle of the brow over |x|, with half its width, mm.
const BROW: [[f64; 3]; 8] = [
    [10.5, 25.2, 1.5],
    [13.0, 26.2, 3.4],
    [20.0, 28.0, 3.6],
    [29.0, 29.3, 3.3],
    [38.0, 29.0, 2.8],
    [49.0, 25.4, 2.0],
    [56.0, 20.6, 1.3],
    [60.0, 17.4, 0.5],
];

/// Upper edge of the upper lip and lower edge of the lower lip over |x|, mm.
const LIPS: [[f64; 3]; 6] = [
    [0.0, -60.4, -77.0],
    [5.6, -58.9, -76.9],
    [12.0, -60.8, -75.8],
    [19.2, -64.4, -72.9],
    [24.0, -67.8, -70.0],
    [26.0, -69.1, -69.0],
];

/// Places where less light arrives (or the blood shows): middle, radii and strength; the same on both sides.
const SHADES: [([f64; 2], [f64; 2], f64); 9] = [
    ([29.0, 9.0], [22.0, 11.0], 0.2),    // under the ridge of the brow
    ([17.0, 2.0], [8.0, 9.0], 0.2),      // inner corner of the eye
    ([32.0, -9.0], [17.0, 6.0], 0.1),    // fold of the lower lid
    ([0.0, -47.5], [15.0, 6.0], 0.28),   // under the nose
    ([19.6, -35.0], [3.6, 9.0], 0.3),    // crease beside the wing
    ([25.0, -47.0], [5.5, 14.0], 0.1),   // fold from nose to mouth
    ([26.5, -69.0], [5.0, 5.0], 0.22),   // corner of the mouth
    ([0.0, -82.5], [19.0, 6.0], 0.18),   // under the lower lip
    ([0.0, -114.0], [60.0, 13.0], 0.25), // under the chin
];

/// An opening of the face in the plane of the picture.
struct Opening {
    line: Vec<Point2<f64>>,
    low: Point2<f64>,
    high: Point2<f64>,
}

/// The painted skin of a twin.
pub(super) struct Paint {
    grid: bool,
    pitch: f64,
    half_line: f64,
    seed: u32,
    /// The rim of the face, a closed line.
    rim: Vec<Point2<f64>>,
    /// The eye openings.
    eyes: Vec<Opening>,
    /// Middles of the nostrils.
    nostrils: [Point2<f64>; 2],
}

impl Paint {
    pub(super) fn new(settings: &TwinSettings, rim: Vec<Point2<f64>>, eyes: Vec<Vec<Point2<f64>>>) -> Self {
        Self {
            grid: settings.grid,
            pitch: settings.grid_pitch_mm,
            half_line: 0.5 * settings.grid_line_mm,
            seed: (settings.seed ^ (settings.seed >> 32)) as u32,
            rim,
            eyes: eyes
                .into_iter()
                .map(|line| {
                    let (low, high) = bounds(&line);
                    Opening { line, low, high }
                })
                .collect(),
            nostrils: [Point2::new(8.0, -42.6), Point2::new(-8.0, -42.6)],
        }
    }

    /// The share of the light that the skin gives back at a place, for each colour.
    pub(super) fn at(&self, p: &Point2<f64>) -> Light {
        let mut colour = self.bare_skin(p);
        colour = mix(colour, LIP, self.lips(p));
        colour = self.nostrils.iter().fold(colour, |c, n| {
            let d = p - n;
            mix(c, NOSTRIL, 0.92 * fall((d.x / 4.4).hypot(d.y / 2.7), 0.55, 1.05))
        });
        let hair = self.hairline(p);
        colour = mix(colour, INK, self.ink(p) * (1.0 - self.lips(p)) * (1.0 - hair));
        colour = mix(colour, HAIR, self.brow(p));
        colour = mix(colour, HAIR, self.lashes(p));
        mix(colour, HAIR, hair)
    }

    /// How much of what is drawn over the grid lies at a place (lips, brows, lashes, hair), 0 to 1.
    pub(super) fn over_grid(&self, p: &Point2<f64>) -> f64 {
        [self.lips(p), self.brow(p), self.lashes(p), self.hairline(p)].into_iter().fold(0.0, f64::max)
    }

    /// How much light reaches a place between the folds of the face, 0 to 1.
    pub(super) fn openness(p: &Point2<f64>) -> f64 {
        SHADES.iter().fold(1.0, |light, (at, radii, strength)| {
            let r2 = ((p.x.abs() - at[0]) / radii[0]).powi(2) + ((p.y - at[1]) / radii[1]).powi(2);
            light * (1.0 - strength * (1.0 - r2).max(0.0))
        })
    }

    /// Tilt of the skin by pores and fine wrinkles, a slope in x and y.
    pub(super) fn grain(&self, p: &Point2<f64>) -> [f64; 2] {
        const DEPTH_MM: f64 = 0.045;
        const STEP_MM: f64 = 0.2;
        let height = |x: f64, y: f64| DEPTH_MM * layered(x * 1.1, y * 1.1, 2, self.seed.wrapping_add(11));
        let here = height(p.x, p.y);
        [(height(p.x + STEP_MM, p.y) - here) / STEP_MM, (height(p.x, p.y + STEP_MM) - here) / STEP_MM]
    }

    fn bare_skin(&self, p: &Point2<f64>) -> Light {
        let blotches = layered(p.x / 19.0, p.y / 19.0, 3, self.seed.wrapping_add(1));
        let fine = layered(p.x * 0.9, p.y * 0.9, 3, self.seed.wrapping_add(2));
        // Freckles: the highest places of a fine noise.
        let freckle = (smooth(p.x * 0.55, p.y * 0.55, self.seed.wrapping_add(3)) - 0.62).max(0.0) * 0.5;
        let blush =
            |at: [f64; 2], r: f64| (1.0 - ((p.x.abs() - at[0]) / r).powi(2) - ((p.y - at[1]) / r).powi(2)).max(0.0);
        let red =
            0.16 * blush([38.0, -33.0], 24.0) + 0.16 * blush([0.0, -31.0], 13.0) + 0.1 * blush([0.0, -98.0], 15.0);
        let tone = 1.0 + 0.05 * blotches + 0.045 * fine - freckle;
        Light::new(
            SKIN[0] * tone * (1.0 + 0.1 * red),
            SKIN[1] * tone * (1.0 - 0.9 * red - 0.03 * blotches),
            SKIN[2] * tone * (1.0 - 0.8 * red - 0.03 * blotches),
        )
    }

    /// How much of the grid's ink lies at a place, 0 to 1.
    fn ink(&self, p: &Point2<f64>) -> f64 {
        if !self.grid {
            return 0.0;
        }
        let from_line = |v: f64| (v - (v / self.pitch).round() * self.pitch).abs();
        let line = |v: f64| fall(from_line(v), self.half_line - INK_EDGE_MM, self.half_line + INK_EDGE_MM);
        let thin = 0.06 * smooth(p.x * 0.8, p.y * 0.8, self.seed.wrapping_add(5));
        line(p.x).max(line(p.y)) * (INK_COVER + thin)
    }

    fn lips(&self, p: &Point2<f64>) -> f64 {
        let x = p.x.abs();
        if x > 26.0 {
            return 0.0;
        }
        let [top, bottom] = along(&LIPS, x);
        let wave = 0.35 * smooth(p.x * 0.7, p.y * 0.2, self.seed.wrapping_add(6));
        let wrinkle = 0.9 + 0.1 * smooth(p.x * 1.3, p.y * 0.15, self.seed.wrapping_add(7));
        0.85 * wrinkle * fall(p.y - wave, top - 1.0, top + 0.6) * fall(-p.y - wave, -bottom - 1.2, -bottom + 0.8)
    }

    /// Hairs of the brows: short strokes that lean outwards.
    fn brow(&self, p: &Point2<f64>) -> f64 {
        let x = p.x.abs();
        if !(10.5..60.0).contains(&x) {
            return 0.0;
        }
        let [middle, half] = along(&BROW, x);
        let off = (p.y - middle) / half;
        // Along the hairs the noise is long, across them short.
        let lean = 0.5 + 0.012 * x;
        let (across, length) = (x * 2.3 - p.y * lean * 1.5, x * 0.22 + p.y * 0.35);
        let strokes = 0.5 + 0.5 * smooth(across, length + 40.0 * p.x.signum(), self.seed.wrapping_add(8));
        let density = fall(off.abs(), 0.25, 1.25) * fall(-x, -13.5, -10.5);
        (density * (0.45 + 0.85 * strokes)).min(0.95)
    }

    /// Hairs grow in from the rim of the forehead and the temples.
    fn hairline(&self, p: &Point2<f64>) -> f64 {
        if p.y < -12.0 || (p.y < 50.0 && p.x.abs() < 48.0) {
            return 0.0;
        }
        let depth = distance_to(&self.rim, p);
        let ragged = 1.6 * smooth(p.x * 0.55, p.y * 0.55, self.seed.wrapping_add(9))
            + 0.9 * smooth(p.x * 1.9, p.y * 0.7, self.seed.wrapping_add(10));
        let reach = 3.4 * fall(-p.y, -8.0, 12.0);
        fall(depth + ragged, reach - 2.2, reach + 1.6) * fall(-p.y, -4.0, 12.0)
    }

    /// The dark edge of the upper lid.
    fn lashes(&self, p: &Point2<f64>) -> f64 {
        let near = |Opening { line, low, high }: &Opening| {
            let inside = p.x > low.x - 3.0 && p.x < high.x + 3.0 && p.y > low.y - 2.0 && p.y < high.y + 3.0;
            if !inside {
                return 0.0;
            }
            let upper = fall(-(p.y - 0.5 * (low.y + high.y)), -1.0, 1.5);
            let width = 0.5 + 0.75 * upper;
            (0.25 + 0.65 * upper) * fall(distance_to(line, p), 0.35 * width, width)
        };
        self.eyes.iter().map(near).fold(0.0, f64::max)
    }
}

/// 1 up to `full`, 0 from `none` on, smooth between.
pub(super) fn fall(v: f64, full: f64, none: f64) -> f64 {
    let t = ((v - full) / (none - full)).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

/// `a` with a share of `b`.
pub(super) fn mix(a: Light, b: [f64; 3], share: f64) -> Light {
    a + (Light::from(b) - a) * share.clamp(0.0, 1.0)
}

/// Straight lines through a table of (x, a, b): a and b at x.
fn along<const N: usize>(table: &[[f64; 3]; N], x: f64) -> [f64; 2] {
    let k = table.iter().skip(1).take(N - 2).take_while(|row| row[0] <= x).count();
    let (a, b) = (table[k], table[k + 1]);
    let t = ((x - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    [1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// Distance of a point from a closed line, mm.
pub(super) fn distance_to(line: &[Point2<f64>], p: &Point2<f64>) -> f64 {
    let sides = line.iter().zip(line.iter().cycle().skip(1));
    let squared = sides.map(|(a, b)| {
        let side = b - a;
        let t = ((p - a).dot(&side) / side.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (p - (a + side * t)).norm_squared()
    });
    squared.fold(f64::INFINITY, f64::min).sqrt()
}

/// Lowest and highest x and y of a line.
pub(super) fn bounds(line: &[Point2<f64>]) -> (Point2<f64>, Point2<f64>) {
    let fold = |start: f64, pick: fn(f64, f64) -> f64| {
        Point2::new(line.iter().map(|p| p.x).fold(start, pick), line.iter().map(|p| p.y).fold(start, pick))
    };
    (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max))
}
