//! Registers all the skin of one picture to another at once: the one motion under which every pixel of both looks alike and that bends no
//! more than it must.
//!
//! A neighbourhood that is followed by itself knows nothing of the skin beside it. Here the motion u is one surface of cubic B-splines
//! (free-form deformation, Rueckert et al. 1999) over the whole face, the one with
//!
//! ```text
//! min Σ ρ((I₂(p + u(p)) − g(p) I₁(p)) / s)  +  Σ anchors  +  Σ τ(second differences of u)
//! ```
//!
//! found by Gauss and Newton's method with the mean of both pictures' slopes (Malis 2004), from small pictures to large ones. g is how
//! much brighter the last picture is thereabouts, s the spread of the noise. ρ (Cauchy's) lets lashes, hair and highlights differ; τ (of
//! Student's t, one degree of freedom) lets skin bend sharply in few places, below a brow, instead of a little everywhere: both as
//! repeatedly weighted squares. Lips and lids are cut: the surface does not hold across an opening of the face.
//!
//! Standard errors come from draws of the posterior: the same equations, solved for right sides of noise (Papandreou and Yuille 2010).

mod lattice;
mod level;
mod normal;
mod skin;

use std::sync::Arc;

use nalgebra::{Matrix2, Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::gray::Spline;
use super::lead::Leader;
use super::patch::Guess;
use super::prepared::Prepared;
use lattice::{Derivatives, Lattice, REACH};
use level::{Level, Pull, Reaches};
use normal::{Factor, Normal};
pub use skin::Skin;

/// A motion of skin.
#[derive(Clone, Debug)]
struct Field {
    lattice: Arc<Lattice>,
    coefficients: Vec<Vector2<f64>>,
}

/// The motion of all the skin from one picture to another.
#[derive(Clone, Debug)]
pub struct Registration {
    field: Field,
    /// What noise alone would make of the motion, drawn again and again.
    draws: Vec<Vec<Vector2<f64>>>,
    /// What the pictures say about each node.
    about: Vec<About>,
    variance: f64,
}

/// What is known of a place of the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registered {
    /// Where it lies in the last picture, with the stretch and the bend of the skin there.
    pub guess: Guess,
    /// Standard error along x and y that the equations state, px: too small where slopes are mostly noise.
    pub sigma_px: [f64; 2],
    /// What the pictures differ by about it, in variances of the noise: 1 where they agree.
    pub misfit: f64,
    /// The same in variances of no less noise than 4.6 grey levels a picture: what light and lens leave between clean pictures is no
    /// doubt of the place.
    pub unlike: f64,
    /// The same in grey levels, root mean square.
    pub left: f64,
    /// The share of the skin in the slopes about it; the rest is noise, which looks like something to hold on to. About 0 on even skin.
    pub told: f64,
}

/// Sums about a node.
#[derive(Clone, Copy, Debug, Default)]
struct About {
    /// Squares of what the pictures differ by, and pixels.
    left: f64,
    count: f64,
    /// Squared slopes, and those that noise alone would have.
    slopes: f64,
    noise: f64,
}

impl About {
    fn add(&mut self, other: &Self, weight: f64) {
        self.left += weight * other.left;
        self.count += weight * other.count;
        self.slopes += weight * other.slopes;
        self.noise += weight * other.noise;
    }
}

/// Distance of the nodes of the splines, mm; while pictures are small it is twice that.
const SPACING_MM: f64 = 3.5;
/// No two nodes are nearer, px.
const LEAST_SPACING_PX: f64 = 6.0;
/// Bend that is expected of the motion, per mm.
const BEND_PER_MM: f64 = 0.0065;
/// Degrees of freedom of Student's t for it.
const FREEDOM: f64 = 1.0;
/// Differences of the pictures beyond so many times their spread count less and less: from step to step fewer, since at first the skin lies
/// beside its place, and what stands out most there shows best where it belongs.
const OUTLIER: [f64; 3] = [16.0, 8.0, 4.0];
/// The same of anchors.
const ANCHOR_OUTLIER: f64 = 4.0;
/// Light is taken out over this length, mm.
const LIGHT_MM: f64 = 2.0;
/// A pixel of the smallest pictures that are compared is no larger, mm.
const COARSEST_MM: f64 = 2.5;
/// Finer pictures are compared at half their size, px per mm: a large one has more pixels than tell anything new.
const FINEST_PX_PER_MM: f64 = 8.0;
/// Most steps at a small size and at the full one, and the step that ends them, px.
const STEPS: [usize; 2] = [4, 4];
const CLOSE_PX: f64 = 0.03;
/// No step moves a node farther, in distances of nodes.
const LONGEST: f64 = 0.5;
/// Error of a place that only begins the search, px.
const BEGIN_PX: f64 = 0.4;
/// Error of such a place while pictures are small, beside its own, px.
const LED_PX: f64 = 0.7;
/// How strongly a motion through a few places is held not to bend, per squared px of a second difference.
const BEGIN_BEND: f64 = 0.3;
/// Variance of the noise in the difference of two pixels below which confidence takes no account of it, grey levels squared: that of the
/// scenes on which confidence was fitted (5.1 a picture) is a fifth more.
const LEAST_NOISE: f64 = 43.0;
/// Draws of the posterior: a standard error of them is known to an eighth.
const DRAWS: usize = 32;

impl Field {
    /// The motion at twice as many nodes a side.
    fn refined(&self, lattice: &Arc<Lattice>, skin: &Skin) -> Self {
        Self { lattice: lattice.clone(), coefficients: lattice.refined(&self.lattice, &self.coefficients, skin) }
    }

    /// The motion at a place of a triangle, with the nodes that reach there; none beyond the skin.
    fn at(&self, at: &Point2<f64>, triangle: u32) -> Option<Reached> {
        let taps = self.lattice.taps(at);
        let nodes = self.lattice.reach(&taps, triangle)?;
        Some(Reached { nodes, values: taps.values(), motion: taps.motion(&nodes, &self.coefficients) })
    }
}

/// The motion at a place.
struct Reached {
    nodes: [usize; REACH],
    values: [f64; REACH],
    motion: Derivatives,
}

/// What is registered, and what is known of its motion.
pub struct Task<'a> {
    /// Both pictures.
    pub pictures: [&'a Prepared; 2],
    /// The skin of the first.
    pub skin: &'a Skin,
    /// Size of the face, px per mm.
    pub px_per_mm: f64,
    /// Places that are known, with their errors.
    pub anchors: &'a [Leader],
    /// Places that only begin the search.
    pub begin: &'a [Leader],
}

impl Registration {
    /// The motion of the skin; none where there is no skin, or nothing in the pictures that holds it.
    pub fn of(task: &Task) -> Option<Self> {
        let [first, last] = task.pictures;
        let size = first.size();
        let spacing = (SPACING_MM * task.px_per_mm).max(LEAST_SPACING_PX);
        let finest = (task.px_per_mm / FINEST_PX_PER_MM).max(1.0).log2().ceil() as usize;
        let most = (COARSEST_MM * task.px_per_mm).max(1.0).log2().floor() as usize;
        let there = |k: &usize| first.level(*k).1 == *k && last.level(*k).1 == *k;
        let smallest = (0..=most).rev().find(there).unwrap_or(0);
        let finest = finest.min(smallest);
        let equations = |spacing: f64| Normal::of(Lattice::over(task.skin, spacing)?);
        let small = || {
            let mut normal = equations(2.0 * spacing)?;
            let mut field = task.begun(&mut normal)?;
            // Where little is seen the motion would run away along a line: what it began with holds it.
            let begin = task.begin.iter().map(|l| Leader { sigma_px: l.sigma_px.hypot(LED_PX), ..*l });
            let led: Vec<Leader> = task.anchors.iter().copied().chain(begin).collect();
            for halvings in (finest + 1..=smallest).rev() {
                let pictures = [first.level(halvings).0, last.level(halvings).0];
                let level = Level::new(pictures, 1 << halvings, size, 2.0 * spacing, task.skin);
                field = task.settled(&level, field, &led, &mut normal, Size::Small)?.0;
            }
            Some(field)
        };
        // Whole pictures are compared as they are: smoothing takes the finest texture, which tells most.
        let whole = (finest == 0).then(|| [first, last].map(|p| Spline::through(p.gray())));
        let pictures = match &whole {
            Some([a, b]) => [a, b],
            None => [first, last].map(|p| p.level(finest).0),
        };
        let large = || {
            let level = Level::new(pictures, 1 << finest, size, spacing, task.skin);
            Some((level, equations(spacing)?))
        };
        let (coarse, fine) = rayon::join(|| if smallest > finest { Some(small()) } else { None }, large);
        let (level, mut normal) = fine?;
        let begun = match coarse {
            Some(coarse) => coarse?.refined(&normal.lattice, task.skin),
            None => task.begun(&mut normal)?,
        };
        let (field, last_step) = task.settled(&level, begun, task.anchors, &mut normal, Size::Full)?;
        let draws = last_step.draws(&field.lattice)?;
        let about = last_step.about(&field, f64::from(1_u32 << finest));
        Some(Self { field, draws, about, variance: last_step.variance })
    }

    /// What is known of a place of the first picture, on a triangle of its skin; none beyond it.
    pub fn at(&self, at: &Point2<f64>, triangle: u32) -> Option<Registered> {
        let r = self.field.at(at, triangle)?;
        let (motion, gradient, second) = r.motion;
        let mut squares = Vector2::zeros();
        for draw in &self.draws {
            let u: Vector2<f64> = r.nodes.iter().zip(r.values).map(|(n, v)| draw[*n] * v).sum();
            squares += u.component_mul(&u);
        }
        let mut about = About::default();
        for (n, v) in r.nodes.iter().zip(r.values) {
            about.add(&self.about[*n], v);
        }
        let left = if about.count > 0.0 { about.left / about.count } else { f64::INFINITY };
        let bend = |axis: usize| [0, 1, 2].map(|k| second[k][axis]);
        Some(Registered {
            guess: Guess { at: at + motion, warp: Matrix2::identity() + gradient, bend: [bend(0), bend(1)] },
            sigma_px: [squares.x, squares.y].map(|s| (s / self.draws.len().max(1) as f64).sqrt()),
            misfit: left * level::SHARED / self.variance,
            unlike: left * level::SHARED / self.variance.max(LEAST_NOISE),
            left: left.sqrt(),
            told: if about.slopes > 0.0 { 1.0 - about.noise / about.slopes } else { 0.0 },
        })
    }
}

/// Of which size pictures are compared.
#[derive(Clone, Copy)]
enum Size {
    Small,
    Full,
}

/// What the last step was made of.
struct Step {
    reach: Reaches,
    pulls: Vec<Pull>,
    /// Variance of white noise of a pixel's difference.
    variance: f64,
    /// Weight of each second difference.
    held: Vec<f64>,
    /// Places of anchors, their triangles, and their weights.
    anchors: Vec<(Point2<f64>, u32, f64)>,
    factor: Option<Factor>,
}

impl Task<'_> {
    /// A motion through what is known before any picture is compared, held to bend little.
    fn begun(&self, normal: &mut Normal) -> Option<Field> {
        normal.clear(true);
        for l in self.anchors.iter().chain(self.begin) {
            let weight = 1.0 / (l.sigma_px.powi(2) + BEGIN_PX * BEGIN_PX);
            if let Some(triangle) = self.skin.triangle(&l.first, l.triangle) {
                normal.see((&l.first, triangle), &(l.last - l.first), weight);
            }
        }
        let lattice = normal.lattice.clone();
        let still = vec![Vector2::zeros(); lattice.len()];
        for d in &lattice.differences {
            normal.hold(d, BEGIN_BEND, &still);
        }
        normal.rest();
        let coefficients = normal.factor()?.solve(&[&normal.right]).pop()?;
        Some(Field { lattice, coefficients })
    }

    /// Steps at one size until they are short. The blocks of the first serve for all (the chord method), but for the last at the full size:
    /// standard errors are of that.
    fn settled(
        &self,
        level: &Level,
        mut field: Field,
        anchors: &[Leader],
        normal: &mut Normal,
        size: Size,
    ) -> Option<(Field, Step)> {
        let bend_px = BEND_PER_MM * field.lattice.spacing.powi(2) / self.px_per_mm;
        let prior = bend_px.powi(-2);
        let reach = level.reach(&field.lattice);
        let held = vec![prior; field.lattice.differences.len()];
        let mut step = Step { reach, pulls: Vec::new(), variance: 1.0, held, anchors: Vec::new(), factor: None };
        let (mut done, mut left) = (0, STEPS[size as usize]);
        while left > 0 {
            let outlier = OUTLIER[done.min(OUTLIER.len() - 1)];
            (step.pulls, step.variance) = level.compare(&field, &step.reach, LIGHT_MM * self.px_per_mm, outlier);
            step.hold(&field, prior);
            let kept = step.factor.take_if(|_| left > 1 || matches!(size, Size::Small));
            normal.clear(kept.is_none());
            step.assemble(&field, anchors, self.skin, normal);
            let factor = match kept {
                Some(factor) => factor,
                None => normal.factor()?,
            };
            let moved = factor.solve(&[&normal.right]).pop()?;
            step.factor = Some(factor);
            let longest = LONGEST * field.lattice.spacing;
            let mut most = 0.0_f64;
            for (c, m) in field.coefficients.iter_mut().zip(&moved) {
                let length = m.norm();
                if !length.is_finite() {
                    return None;
                }
                most = most.max(length);
                *c += m * (longest / length.max(longest));
            }
            (done, left) = (done + 1, left - 1);
            if most < CLOSE_PX {
                left = left.min(match size {
                    Size::Small => 0,
                    Size::Full => 1,
                });
            }
        }
        Some((field, step))
    }
}

impl Step {
    /// Weighs the second differences anew: those where the motion bends anyway, less.
    fn hold(&mut self, field: &Field, prior: f64) {
        let count = field.lattice.len();
        let mut squares = vec![0.0; count];
        for d in &field.lattice.differences {
            squares[d.middle] += d.of(&field.coefficients).norm_squared();
        }
        let weight = |node: usize| {
            let (sum, n) = field.lattice.about(node).iter().fold((0.0, 0.0), |(s, n), k| (s + squares[*k], n + 1.0));
            prior * (1.0 + FREEDOM) / (FREEDOM + prior * sum / n)
        };
        let weights: Vec<f64> = (0..count).map(weight).collect();
        self.held.clear();
        self.held.extend(field.lattice.differences.iter().map(|d| weights[d.middle]));
    }

    /// Gauss and Newton's equations.
    fn assemble(&mut self, field: &Field, anchors: &[Leader], skin: &Skin, normal: &mut Normal) {
        normal.pull(&self.reach, &self.pulls, 1.0 / self.variance);
        for (d, w) in field.lattice.differences.iter().zip(&self.held) {
            normal.hold(d, *w, &field.coefficients);
        }
        self.anchors.clear();
        for a in anchors {
            let Some(triangle) = skin.triangle(&a.first, a.triangle) else { continue };
            let Some(r) = field.at(&a.first, triangle) else { continue };
            let left = a.last - a.first - r.motion.0;
            let variance = a.sigma_px * a.sigma_px;
            let weight = 1.0 / (variance + left.norm_squared() / (ANCHOR_OUTLIER * ANCHOR_OUTLIER));
            normal.see((&a.first, triangle), &left, weight);
            self.anchors.push((a.first, triangle, weight));
        }
        normal.rest();
    }

    /// What noise alone would make of the motion: H⁻¹ (Jᵀ z) with z of all that H is made of has the covariance H⁻¹.
    fn draws(&self, lattice: &Lattice) -> Option<Vec<Vec<Vector2<f64>>>> {
        let one = |seed: usize| {
            let mut random = Pcg64::seed_from_u64(seed as u64);
            let mut right = vec![Vector2::zeros(); lattice.len()];
            for (reach, pull) in self.reach.tiles.iter().zip(&self.pulls) {
                let Some(reach) = reach else { continue };
                let [xx, xy, yy] = pull.square.map(|v| v / self.variance);
                // Cholesky's factor of the tile's 2 × 2 block.
                let a = xx.max(0.0).sqrt();
                let b = if a > 0.0 { xy / a } else { 0.0 };
                let c = (yy - b * b).max(0.0).sqrt();
                let z = signs(&mut random);
                let v = Vector2::new(a * z.x, b * z.x + c * z.y);
                for (n, w) in reach.nodes.iter().zip(reach.values) {
                    right[*n] += v * w;
                }
            }
            for (d, w) in lattice.differences.iter().zip(&self.held) {
                let v = signs(&mut random) * w.sqrt();
                for (n, f) in &d.terms {
                    right[*n] += v * *f;
                }
            }
            for (at, triangle, w) in &self.anchors {
                let v = signs(&mut random) * w.sqrt();
                let taps = lattice.taps(at);
                if let Some(nodes) = lattice.reach(&taps, *triangle) {
                    for (n, f) in nodes.iter().zip(taps.values()) {
                        right[*n] += v * f;
                    }
                }
            }
            right
        };
        let sides: Vec<Vec<Vector2<f64>>> = (0..DRAWS).into_par_iter().map(one).collect();
        let sides: Vec<&[Vector2<f64>]> = sides.iter().map(Vec::as_slice).collect();
        Some(self.factor.as_ref()?.solve(&sides))
    }

    /// What the pictures say about each node.
    fn about(&self, field: &Field, scale: f64) -> Vec<About> {
        let noise = 2.0 * level::SLOPE_NOISE * self.variance / (scale * scale);
        let mut about = vec![About::default(); field.lattice.len()];
        for (reach, pull) in self.reach.tiles.iter().zip(&self.pulls) {
            let Some(reach) = reach else { continue };
            let tile = About {
                left: pull.squares,
                count: pull.count,
                slopes: pull.square[0] + pull.square[2],
                noise: noise * pull.weight,
            };
            for (n, w) in reach.nodes.iter().zip(reach.values) {
                about[*n].add(&tile, w);
            }
        }
        about
    }
}

/// Two independent numbers, 1 or −1: noise of unit variance is all that the draws' covariance asks for.
fn signs(random: &mut Pcg64) -> Vector2<f64> {
    let bits = random.next_u32();
    let sign = |bit: u32| if bits & bit == 0 { 1.0 } else { -1.0 };
    Vector2::new(sign(1 << 30), sign(1 << 31))
}

#[cfg(test)]
mod tests {
    use super::super::gray::{Gray, uneven};
    use super::*;
    use crate::face::patches::Noise;

    const SIDE: usize = 240;

    /// Unevenness of 5 to 60 px.
    fn texture(x: f64, y: f64) -> f64 {
        let sizes = [(5.0, 40.0), (12.0, 50.0), (27.0, 50.0), (60.0, 50.0)];
        120.0 + sizes.map(|(size, high)| high * uneven(x, y, size)).iter().sum::<f64>()
    }

    fn picture(noise: f64, seed: u64, f: impl Fn(f64, f64) -> f64) -> Prepared {
        let mut random = Noise(seed);
        let side = SIDE as f64;
        let values = (0..SIDE * SIDE).map(|i| {
            let (x, y) = ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
            (f(x.clamp(0.0, side), y.clamp(0.0, side)) + noise * random.normal()) as f32
        });
        Prepared::of(Gray::new(SIDE, SIDE, values.collect()).unwrap())
    }

    /// Where skin of the last picture was in the first: a shift, a stretch and a bump of 3 px that is 60 px wide.
    fn back(x: f64, y: f64) -> [f64; 2] {
        let bump = 3.0 * (-((x - 130.0).powi(2) + (y - 110.0).powi(2)) / (2.0 * 30.0_f64.powi(2))).exp();
        [x - 2.3 - 0.02 * (x - 120.0), y + 1.7 + bump]
    }

    /// The place in the last picture of a place of the first, by repeated substitution in [`back`].
    fn truth(p: &Point2<f64>) -> Point2<f64> {
        let mut q = *p;
        for _ in 0..60 {
            let b = back(q.x, q.y);
            q += p - Point2::from(b);
        }
        q
    }

    fn places() -> impl Iterator<Item = Point2<f64>> {
        (0..36).map(|k| Point2::new(60.0 + f64::from(k % 6) * 24.0, 60.0 + f64::from(k / 6) * 24.0))
    }

    /// What begins the search: every so many places, a pixel beside the truth.
    fn beside(every: usize, truth: impl Fn(&Point2<f64>) -> Point2<f64>) -> Vec<Leader> {
        let one = |p: Point2<f64>| Leader {
            first: p,
            last: truth(&p) + Vector2::new(0.7, -0.7),
            sigma_px: 1.0,
            triangle: None,
        };
        places().step_by(every).map(one).collect()
    }

    fn register<'a>(
        pictures: [&Prepared; 2],
        skin: &'a Skin,
        anchors: &[Leader],
        begin: &[Leader],
    ) -> Option<Found<'a>> {
        let registration = Registration::of(&Task { pictures, skin, px_per_mm: 4.0, anchors, begin })?;
        Some(Found { registration, skin })
    }

    struct Found<'a> {
        registration: Registration,
        skin: &'a Skin,
    }

    impl Found<'_> {
        fn at(&self, p: &Point2<f64>) -> Option<Registered> {
            self.registration.at(p, self.skin.near(p)?)
        }
    }

    /// Noise of 5 grey levels, light that grows by a third across the picture, and a dark lash that does not move: still the whole motion
    /// is found, and the errors are about what is stated (a radius of two normal errors has the mean square 2 σ²).
    #[test]
    fn a_smooth_motion_is_found_under_other_light_noise_and_a_lash() {
        let (skin, mut errors, mut stated) = (Skin::square(20.0, 220.0), Vec::new(), Vec::new());
        for seed in 0..6 {
            let lash = |x: f64, y: f64| (y - 150.0 - 0.2 * x).abs() < 1.5 && x < 90.0;
            let first = picture(5.0, 2 * seed + 1, |x, y| if lash(x, y) { 30.0 } else { texture(x, y) });
            let last = picture(5.0, 2 * seed + 2, |x, y| {
                let [a, b] = back(x, y);
                if lash(x, y) { 30.0 } else { (0.85 + 0.3 * x / SIDE as f64) * texture(a, b) }
            });
            let found = register([&first, &last], &skin, &[], &beside(5, truth)).unwrap();
            // Beside the lash itself nobody can tell whether it is skin.
            let apart = |p: &Point2<f64>| p.x > 110.0 || (p.y - 150.0 - 0.2 * p.x).abs() > 20.0;
            for p in places().filter(apart) {
                let r = found.at(&p).unwrap();
                let off = r.guess.at - truth(&p);
                errors.extend([off.x, off.y]);
                stated.extend(r.sigma_px);
                assert!(r.misfit < 3.0 && off.norm() < 0.5, "{p}: {off}, {}", r.misfit);
            }
        }
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len() as f64).sqrt();
        let (error, stated) = (rms(&errors), rms(&stated));
        assert!(error < 0.12 && (0.6..2.5).contains(&(error / stated)), "{error} px, stated {stated}");
    }

    /// Gradient and bend of what is found are the differences of what is found.
    #[test]
    fn stretch_and_bend_are_those_of_the_motion() {
        let first = picture(0.0, 1, texture);
        let last = picture(0.0, 1, |x, y| {
            let [a, b] = back(x, y);
            texture(a, b)
        });
        let skin = Skin::square(20.0, 220.0);
        let found = register([&first, &last], &skin, &[], &beside(5, truth)).unwrap();
        let at = |x: f64, y: f64| found.at(&Point2::new(x, y)).unwrap().guess;
        let (x, y, h) = (126.3, 104.1, 0.5);
        let g = at(x, y);
        let (right, left, down, up) = (at(x + h, y), at(x - h, y), at(x, y + h), at(x, y - h));
        for axis in 0..2 {
            let slope = (right.at[axis] - left.at[axis]) / (2.0 * h);
            let bend = (right.at[axis] - 2.0 * g.at[axis] + left.at[axis]) / (h * h);
            assert!((g.warp[(axis, 0)] - slope).abs() < 1e-4 && (g.bend[axis][0] - bend).abs() < 1e-4);
            let slope = (down.at[axis] - up.at[axis]) / (2.0 * h);
            let bend = (down.at[axis] - 2.0 * g.at[axis] + up.at[axis]) / (h * h);
            assert!((g.warp[(axis, 1)] - slope).abs() < 1e-4 && (g.bend[axis][2] - bend).abs() < 1e-4);
            let mixed = (at(x + h, y + h).at[axis] - at(x - h, y + h).at[axis] - at(x + h, y - h).at[axis]
                + at(x - h, y - h).at[axis])
                / (4.0 * h * h);
            assert!((g.bend[axis][1] - mixed).abs() < 1e-4);
        }
    }

    /// Where the pictures say nothing an anchor is believed, and that they say nothing is known.
    #[test]
    fn even_skin_goes_with_its_anchors() {
        let even = picture(1.0, 3, |_, _| 120.0);
        let other = picture(1.0, 4, |_, _| 120.0);
        let (first, last) = (Point2::new(120.0, 120.0), Point2::new(125.0, 118.0));
        let anchor = Leader { first, last, sigma_px: 0.1, triangle: None };
        let skin = Skin::square(20.0, 220.0);
        let found = register([&even, &other], &skin, &[anchor], &[]).unwrap();
        let at = found.at(&anchor.first).unwrap();
        assert!((at.guess.at - anchor.last).norm() < 0.3, "{}", at.guess.at);
        let far = found.at(&Point2::new(30.0, 30.0)).unwrap();
        assert!(at.told < 0.04 && far.told < 0.04, "{} {}", at.told, far.told);
        let rich = [3, 4].map(|seed| picture(1.0, seed, texture));
        let seen = register(rich.each_ref(), &skin, &[], &beside(5, Point2::clone)).unwrap();
        let told: Vec<f64> = places().map(|p| seen.at(&p).unwrap().told).collect();
        assert!(told.iter().all(|t| *t > 0.9), "{told:?}");
    }

    /// A mouth 50 mm wide that opens by 4 mm (2 px a mm): the lower lip goes down, least at its corners, the upper one stays. Right at
    /// both lips each keeps its own motion; a surface that does not know of the opening smears one into the other.
    #[test]
    fn lips_that_part_each_keep_their_own_motion() {
        let opening = |x: f64| 8.0 * (1.0 - ((x - 120.0) / 50.0).powi(2)).max(0.0).powi(2);
        // Down to y = 220 what moves is held back more and more.
        let truth = |p: &Point2<f64>| {
            let down = if p.y < 120.0 { 0.0 } else { opening(p.x) * (220.0 - p.y).max(0.0) / 100.0 };
            Point2::new(p.x, p.y + down)
        };
        let first = picture(2.0, 1, texture);
        let last = picture(2.0, 2, |x, y| {
            let d = opening(x);
            if !(120.0..220.0).contains(&y) {
                texture(x, y)
            } else if y < 120.0 + d {
                20.0
            } else {
                texture(x, 120.0 + (y - 120.0 - d) / (1.0 - d / 100.0))
            }
        });
        let lips: Vec<Point2<f64>> =
            (0..9).flat_map(|k| [117.0, 123.0].map(|y| Point2::new(88.0 + 8.0 * f64::from(k), y))).collect();
        let worst = |skin: &Skin| {
            let (pictures, begin) = ([&first, &last], beside(1, truth));
            let task = Task { pictures, skin, px_per_mm: 2.0, anchors: &[], begin: &begin };
            let found = Found { registration: Registration::of(&task).unwrap(), skin };
            let off = |p: &Point2<f64>| (found.at(p).unwrap().guess.at - truth(p)).norm();
            lips.iter().map(off).fold(0.0, f64::max)
        };
        let (cut, whole) = (worst(&Skin::slit()), worst(&Skin::square(20.0, 220.0)));
        assert!(cut < 0.8 && whole > 3.0, "{cut} px, without the slit {whole} px");
    }

    /// A mark on the edge of the lower lip, which the pixel under it takes for the upper one: the lower lip goes with it, the upper one
    /// stays.
    #[test]
    fn a_mark_on_touching_lips_is_of_its_own_lip() {
        let skin = Skin::slit();
        let [even, other] = [3, 4].map(|seed| picture(1.0, seed, |_, _| 120.0));
        let (upper, lower) = (Point2::new(120.0, 117.0), Point2::new(120.0, 123.0));
        let held = |first: Point2<f64>, down: f64, triangle: Option<u32>| Leader {
            first,
            last: first + Vector2::new(0.0, down),
            sigma_px: 0.1,
            triangle,
        };
        let mark = Point2::new(120.0, 119.5);
        assert_eq!(skin.near(&mark), skin.near(&upper));
        let rim = [30.0, 210.0].map(|y| held(Point2::new(120.0, y), 0.0, None));
        let apart = |triangle: Option<u32>| {
            let anchors = [rim[0], rim[1], held(upper, 0.0, None), held(mark, 8.0, triangle)];
            // At 2 px a mm the slit is as wide as a mouth.
            let task = Task { pictures: [&even, &other], skin: &skin, px_per_mm: 2.0, anchors: &anchors, begin: &[] };
            let found = Found { registration: Registration::of(&task).unwrap(), skin: &skin };
            let down = |p: &Point2<f64>| found.at(p).unwrap().guess.at.y - p.y;
            [down(&upper), down(&lower)]
        };
        let (known, unknown) = (apart(skin.near(&lower)), apart(None));
        assert!(known[0].abs() < 1.0 && known[1] > 3.0, "{known:?}");
        assert!(unknown[1] < 1.0, "{unknown:?}");
    }

    #[test]
    fn where_there_is_no_skin_nothing_is_known() {
        let p = picture(1.0, 1, texture);
        let nowhere = Skin::square(300.0, 400.0);
        assert!(register([&p, &p], &nowhere, &[], &[]).is_none());
        let broken = Skin::flat(&[[f64::MAX, 0.0], [1.0, 2.0], [1e300, 3.0]], &[[0, 1, 2]]);
        assert!(register([&p, &p], &broken, &[], &[]).is_none());
        let place = Point2::new(70.0, 70.0);
        let still = Leader { first: place, last: place, sigma_px: 0.1, triangle: None };
        let skin = Skin::square(20.0, 120.0);
        let found = register([&p, &p], &skin, &[still], &[]).unwrap();
        assert!(found.at(&Point2::new(200.0, 200.0)).is_none() && found.at(&Point2::new(f64::NAN, 9.0)).is_none());
        let still = found.at(&Point2::new(70.0, 70.0)).unwrap();
        assert!((still.guess.at - Point2::new(70.0, 70.0)).norm() < 1e-3);
    }
}
