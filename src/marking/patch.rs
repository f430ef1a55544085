//! Finds one neighbourhood of skin again when it may bend: the second-order warp of digital image correlation, under noise and other light.
//!
//! Skin that is pushed together does not move as one piece: over half a centimetre its motion u is a polynomial of the second order,
//! and the light on it changes by a slope. All sixteen numbers are fitted at once to the smoothed pictures I₁ and I₂:
//!
//! ```text
//! min Σ w (a I₁(p + o) + b + c · o − I₂(p + o + u(o)))² + what is held,   u(o) = Σ Pₖ φₖ(o),   φ = (1, x, y, x²/2, xy, y²/2)
//! ```
//!
//! by Gauss and Newton's method with the mean of both pictures' slopes (Malis 2004). The stretch and the bend are held weakly to what is
//! expected, as strongly as the pictures' noise demands: where there is little texture, the neighbourhood moves almost as one piece.
//! Source of the warp: Lu and Cary 2000.

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::gray::Spline;

/// Choices of the match.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSettings {
    /// Half the side of the neighbourhood, px; its weight falls off as a Gaussian of 0.5 of that. Default 20.
    pub radius_px: f64,
    /// Pixels compared along that half side (the step between them is radius / samples). Default 10.
    pub samples: usize,
    /// Stretch that is expected beside the start's own, standard deviation. Default 0.08.
    pub stretch: f64,
    /// Bend that is expected, 1/px, standard deviation. Default 0.004.
    pub bend_per_px: f64,
    /// A step below this, px, ends the search. Default 0.02.
    pub close_px: f64,
    /// Most steps. Default 12.
    pub most_steps: usize,
}

impl Default for PatchSettings {
    fn default() -> Self {
        Self { radius_px: 20.0, samples: 10, stretch: 0.08, bend_per_px: 0.004, close_px: 0.02, most_steps: 12 }
    }
}

/// Numbers of the warp along one axis, and of the whole fit.
const WARP: usize = 6;
const NUMBERS: usize = 2 * WARP + 4;
type Numbers = SVector<f64, NUMBERS>;
type Normal = SMatrix<f64, NUMBERS, NUMBERS>;

/// A motion of a neighbourhood: the shift of its middle, its stretch ∂u/∂o, and its bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Where the middle lies in the other picture, px.
    pub at: Point2<f64>,
    /// ∂(place in the other)/∂(place in the first) at the middle.
    pub warp: Matrix2<f64>,
    /// Second derivatives xx, xy, yy of the place's x and y, 1/px.
    pub bend: [[f64; 3]; 2],
    /// Correlation of the neighbourhoods once light and warp are taken out, at most 1.
    pub correlation: f64,
    /// Standard error along x and y, px: from what is left unexplained, which takes the noise as independent between the pixels
    /// compared, and what is held as true.
    pub sigma_px: [f64; 2],
    /// What is left unexplained, grey levels (root mean square).
    pub left: f64,
    /// Steps taken.
    pub steps: usize,
}

/// Why a neighbourhood was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Lost {
    /// It reaches beyond a picture.
    #[error("the neighbourhood reaches beyond the picture")]
    OutOfPicture,
    /// It is too even to be told from its surroundings.
    #[error("the neighbourhood has too little texture")]
    TooEven,
    /// The search did not settle, or ran away.
    #[error("the search did not settle")]
    Unsettled,
    /// The best place looks too different.
    #[error("the skin found looks too different")]
    Unlike,
}

/// Noise of a pixel of the smoothed pictures below which nothing is held more weakly, grey levels.
const LEAST_NOISE: f64 = 0.5;
/// Slope below which a picture says nothing, grey levels per px (root mean square).
const LEAST_SLOPE: f64 = 0.25;

/// Where a search begins, and what is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Where the middle probably lies, px.
    pub at: Point2<f64>,
    /// How the neighbourhood is probably stretched; see [`Match::warp`].
    pub warp: Matrix2<f64>,
    /// How it is probably bent; see [`Match::bend`].
    pub bend: [[f64; 3]; 2],
}

impl Guess {
    /// A place, without stretch or bend.
    pub fn at(at: Point2<f64>) -> Self {
        Self { at, warp: Matrix2::identity(), bend: [[0.0; 3]; 2] }
    }
}

/// Finds the neighbourhood of `from` in another picture.
pub fn find(
    first: &Spline,
    last: &Spline,
    from: Point2<f64>,
    guess: &Guess,
    settings: &PatchSettings,
) -> Result<Match, Lost> {
    let radius = settings.radius_px.max(3.0);
    if !first.holds(&from, 0.7 * radius) || !last.holds(&guess.at, 0.7 * radius) {
        return Err(Lost::OutOfPicture);
    }
    Window::cut(first, from, radius, settings.samples).search(last, guess, settings)
}

/// As [`find`], and then once more with a neighbourhood of half the size: where it tells clearly, or contradicts the larger, it is believed.
/// A small one follows skin that bends better, a large one withstands noise.
pub fn find_finest(
    first: &Spline,
    last: &Spline,
    from: Point2<f64>,
    guess: &Guess,
    settings: &PatchSettings,
) -> Result<Match, Lost> {
    let wide = find(first, last, from, guess, settings)?;
    let guess = Guess { at: wide.at, warp: wide.warp, bend: wide.bend };
    let samples = settings.samples.min(8);
    let close = PatchSettings { radius_px: 0.5 * settings.radius_px, samples, ..*settings };
    let better = find(first, last, from, &guess, &close).ok().filter(|m| {
        let error = m.sigma_px[0].max(m.sigma_px[1]);
        let apart = (m.at - wide.at).norm();
        apart < 0.2 * settings.radius_px && (error < CLEAR_PX || apart > CONTRADICTS * error) && m.correlation > 0.5
    });
    Ok(better.unwrap_or(wide))
}

/// Standard error below which the smaller neighbourhood is the better one, px: what skin bends within the larger weighs more.
const CLEAR_PX: f64 = 0.05;
/// So many standard errors apart the two contradict each other.
const CONTRADICTS: f64 = 4.0;

/// A neighbourhood of the first picture. Offsets are in shares of its radius, so that all numbers of a warp are of one size: px.
struct Window {
    from: Point2<f64>,
    radius: f64,
    points: Vec<Sampled>,
    /// Sum of the weights.
    total: f64,
}

struct Sampled {
    offset: Vector2<f64>,
    weight: f64,
    value: f64,
    slope: [f64; 2],
}

impl Window {
    fn cut(first: &Spline, from: Point2<f64>, radius: f64, samples: usize) -> Self {
        let samples = samples.clamp(3, 32).cast_signed();
        let mut points = Vec::with_capacity((4 * samples * samples).cast_unsigned());
        let mut total = 0.0;
        for j in -samples..=samples {
            for i in -samples..=samples {
                let offset = Vector2::new(i as f64, j as f64) / samples as f64;
                // A disc: the corners of a square are farthest away and bend most.
                if offset.norm_squared() > 1.0 {
                    continue;
                }
                let s = first.sample(&(from + offset * radius));
                let weight = (-offset.norm_squared() / (2.0 * 0.5 * 0.5)).exp();
                total += weight;
                points.push(Sampled { offset, weight, value: s.value, slope: s.slope });
            }
        }
        let mean = points.iter().map(|p| p.weight * p.value).sum::<f64>() / total;
        for p in &mut points {
            p.value -= mean;
        }
        Self { from, radius, points, total }
    }

    fn search(&self, last: &Spline, guess: &Guess, settings: &PatchSettings) -> Result<Match, Lost> {
        let stretch = (guess.warp - Matrix2::identity()) * self.radius;
        let shift = guess.at - self.from;
        let mut n = Numbers::zeros();
        for (axis, k) in [(0, 0), (1, WARP)] {
            n[k] = shift[axis];
            n[k + 1] = stretch[(axis, 0)];
            n[k + 2] = stretch[(axis, 1)];
            for (i, bend) in guess.bend[axis].iter().enumerate() {
                n[k + 3 + i] = bend * self.radius * self.radius;
            }
        }
        n[2 * WARP] = 1.0;
        let expected = n;
        let far = 1.2 * self.radius;
        let mut last_step = f64::INFINITY;
        for steps in 1..=settings.most_steps.max(1) {
            let (matrix, gradient, left) = self.normal(last, &n);
            // The variance of what is left decides how much what is held weighs; one step later it is known better.
            let noise = (left / self.total).sqrt().max(LEAST_NOISE);
            let mut held = matrix;
            let mut pull = gradient;
            for (k, sd) in self.held(settings) {
                let strength = (noise / sd).powi(2);
                held[(k, k)] += strength;
                pull[k] += strength * (n[k] - expected[k]);
            }
            let Some(factor) = held.cholesky() else { return Err(Lost::TooEven) };
            let step = factor.solve(&pull);
            n -= step;
            let moved = Vector2::new(step[0], step[WARP]).norm();
            let shape = (1..3).map(|k| step[k].abs() + step[WARP + k].abs()).sum::<f64>();
            let away = Vector2::new(n[0], n[WARP]) - shift;
            let sane = away.norm() < far && n[2 * WARP] > 0.1;
            if !sane {
                return Err(Lost::Unsettled);
            }
            last_step = moved + 0.25 * shape;
            if last_step < settings.close_px {
                return self.judged(last, &n, settings, steps);
            }
        }
        // One that still creeps is as good as it is doubtful: its last step adds to its error.
        if last_step > 20.0 * settings.close_px {
            return Err(Lost::Unsettled);
        }
        let mut found = self.judged(last, &n, settings, settings.most_steps)?;
        found.sigma_px = found.sigma_px.map(|s| s.hypot(2.0 * last_step));
        Ok(found)
    }

    /// Standard deviations of what is held: number, px.
    fn held(&self, settings: &PatchSettings) -> [(usize, f64); 2 * (WARP - 1)] {
        let r = self.radius;
        std::array::from_fn(|i| {
            let (axis, k) = (i / (WARP - 1), 1 + i % (WARP - 1));
            (axis * WARP + k, if k < 3 { settings.stretch * r } else { settings.bend_per_px * r * r })
        })
    }

    /// JᵀWJ, JᵀW(what is left), and the weighted sum of squares.
    fn normal(&self, last: &Spline, n: &Numbers) -> (Normal, Numbers, f64) {
        // The disc holds far fewer than a thousand points: sums of rows are kept in arrays, the lower triangle only.
        let mut sums = [[0.0; NUMBERS]; NUMBERS];
        let mut pull = [0.0; NUMBERS];
        let mut squares = 0.0;
        for p in &self.points {
            let (phi, at) = self.place(n, &p.offset);
            let s = last.sample(&at);
            let left = s.value
                - n[2 * WARP] * p.value
                - n[2 * WARP + 1]
                - n[2 * WARP + 2] * p.offset.x
                - n[2 * WARP + 3] * p.offset.y;
            let gx = 0.5 * (s.slope[0] + n[2 * WARP] * p.slope[0]);
            let gy = 0.5 * (s.slope[1] + n[2 * WARP] * p.slope[1]);
            let mut row = [0.0; NUMBERS];
            for k in 0..WARP {
                row[k] = gx * phi[k];
                row[WARP + k] = gy * phi[k];
            }
            row[2 * WARP] = -p.value;
            row[2 * WARP + 1] = -1.0;
            row[2 * WARP + 2] = -p.offset.x;
            row[2 * WARP + 3] = -p.offset.y;
            for a in 0..NUMBERS {
                let weighted = p.weight * row[a];
                pull[a] += weighted * left;
                for b in 0..=a {
                    sums[a][b] += weighted * row[b];
                }
            }
            squares += p.weight * left * left;
        }
        let matrix = Normal::from_fn(|a, b| if a >= b { sums[a][b] } else { sums[b][a] });
        (matrix, Numbers::from_column_slice(&pull), squares)
    }

    /// The polynomials at an offset, and where the warp puts it.
    fn place(&self, n: &Numbers, o: &Vector2<f64>) -> ([f64; WARP], Point2<f64>) {
        let phi = [1.0, o.x, o.y, 0.5 * o.x * o.x, o.x * o.y, 0.5 * o.y * o.y];
        let (mut x, mut y) = (self.from.x + o.x * self.radius, self.from.y + o.y * self.radius);
        for k in 0..WARP {
            x += n[k] * phi[k];
            y += n[WARP + k] * phi[k];
        }
        (phi, Point2::new(x, y))
    }

    fn judged(&self, last: &Spline, n: &Numbers, settings: &PatchSettings, steps: usize) -> Result<Match, Lost> {
        let (matrix, _, squares) = self.normal(last, n);
        let variance = squares / self.total;
        let noise = variance.max(LEAST_NOISE * LEAST_NOISE);
        let slope = matrix[(0, 0)].min(matrix[(WARP, WARP)]) / self.total;
        if slope.is_nan() || slope <= LEAST_SLOPE * LEAST_SLOPE {
            return Err(Lost::TooEven);
        }
        let mut held = matrix;
        for (k, sd) in self.held(settings) {
            held[(k, k)] += noise / (sd * sd);
        }
        let inverse = held.try_inverse().ok_or(Lost::TooEven)?;
        // The weights are below one: fewer pixels count than are compared, which the inverse of their sum says already.
        let sigma_px = [0, WARP].map(|k| (inverse[(k, k)] * noise).max(0.0).sqrt());
        // How much of the first picture's contrast is met, beside what the light's slope takes.
        let contrast = self.points.iter().map(|p| p.weight * p.value * p.value).sum::<f64>() * n[2 * WARP].powi(2);
        let correlation = (contrast / (contrast + squares)).sqrt();
        let r = self.radius;
        let axis = |k: usize| [n[k + 3], n[k + 4], n[k + 5]].map(|b| b / (r * r));
        Ok(Match {
            at: self.from + Vector2::new(n[0], n[WARP]),
            warp: Matrix2::identity() + Matrix2::new(n[1], n[2], n[WARP + 1], n[WARP + 2]) / r,
            bend: [axis(0), axis(WARP)],
            correlation,
            sigma_px,
            left: variance.sqrt(),
            steps,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::gray::Gray;
    use super::*;
    use crate::face::patches::Noise;

    /// A texture known everywhere, with waves of several directions no finer than 6 px.
    fn texture(x: f64, y: f64) -> f64 {
        120.0
            + 24.0 * (0.55 * x + 0.21 * y).sin()
            + 18.0 * (0.83 * y - 0.30 * x + 1.0).cos()
            + 14.0 * (0.95 * x + 0.62 * y + 2.0).sin() * (0.17 * x).cos()
    }

    fn picture(noise: f64, seed: u64, f: impl Fn(f64, f64) -> f64) -> Spline {
        let mut random = Noise(seed);
        let values = (0..120 * 120)
            .map(|i| (f(f64::from(i % 120) + 0.5, f64::from(i / 120) + 0.5) + noise * random.normal()) as f32);
        Spline::smoothed(&Gray::new(120, 120, values.collect()).unwrap())
    }

    /// The first picture shows the texture through a map of the second order about (60, 60), the second the texture itself under other
    /// light that falls off to the right. The middle must be found where the map puts it: the truth is exact.
    #[test]
    fn a_moved_stretched_bent_and_relit_texture_is_found_to_a_fortieth_of_a_pixel() {
        let from = Point2::new(60.3, 59.6);
        let second = picture(0.0, 1, |x, y| 20.0 + 0.8 * texture(x, y) + 0.3 * x);
        for (shift, warp, bend) in [
            (Vector2::new(2.37, -1.81), Matrix2::identity(), 0.0),
            (Vector2::new(-0.5, 0.25), Matrix2::new(1.12, 0.03, -0.02, 0.88), 0.0),
            (Vector2::new(1.2, 1.9), Matrix2::new(0.995, -0.09, 0.09, 0.995), 0.006),
        ] {
            let first = picture(0.0, 1, |x, y| {
                let o = Vector2::new(x, y) - from.coords;
                let q = from.coords + shift + warp * o + Vector2::new(0.5 * bend * o.y * o.y, -0.5 * bend * o.y * o.y);
                texture(q.x, q.y)
            });
            let guess = Guess::at(from + shift + Vector2::new(0.9, -0.8));
            let found = find(&first, &second, from, &guess, &PatchSettings::default()).unwrap();
            let error = (found.at - (from + shift)).norm();
            assert!(error < 0.025, "{error} px after {} steps", found.steps);
            assert!((found.warp - warp).norm() < 0.02 && found.correlation > 0.995, "{}", found.correlation);
            assert!((found.bend[0][2] - bend).abs() < 1.5e-3, "{:?}", found.bend);
        }
    }

    /// With white noise the scatter over many draws must be about what the standard error says: neighbouring pixels of a smoothed
    /// picture share some of their noise, which the error does not know.
    #[test]
    fn the_standard_error_is_about_the_scatter() {
        let (mut errors, mut stated) = (Vec::new(), Vec::new());
        for seed in 0..80 {
            let first = picture(6.0, 2 * seed + 1, texture);
            let second = picture(6.0, 2 * seed + 2, |x, y| texture(x - 1.17, y + 1.68));
            let guess = Guess::at(Point2::new(60.6, 59.0));
            let found = find(&first, &second, Point2::new(60.0, 60.0), &guess, &PatchSettings::default()).unwrap();
            errors.extend([found.at.x - 61.17, found.at.y - 58.32]);
            stated.extend(found.sigma_px);
        }
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len() as f64).sqrt();
        let ratio = rms(&errors) / rms(&stated);
        assert!((0.7..1.6).contains(&ratio), "scatter is {ratio} of what is stated ({} px)", rms(&stated));
        assert!(rms(&errors) < 0.08, "{}", rms(&errors));
    }

    #[test]
    fn what_cannot_be_found_says_why() {
        let first = picture(0.0, 1, texture);
        let at = |from: [f64; 2], to: [f64; 2], last: &Spline| {
            find(&first, last, Point2::from(from), &Guess::at(Point2::from(to)), &PatchSettings::default())
        };
        assert_eq!(at([5.0, 60.0], [5.0, 60.0], &first).unwrap_err(), Lost::OutOfPicture);
        assert_eq!(at([f64::NAN, 60.0], [60.0, 60.0], &first).unwrap_err(), Lost::OutOfPicture);
        assert_eq!(at([60.0, 60.0], [-50.0, 60.0], &first).unwrap_err(), Lost::OutOfPicture);
        let even = picture(0.0, 1, |_, _| 100.0);
        assert!(at([60.0, 60.0], [60.0, 60.0], &even).is_err());
        let own =
            find(&even, &even, Point2::new(60.0, 60.0), &Guess::at(Point2::new(60.0, 60.0)), &PatchSettings::default());
        assert_eq!(own.unwrap_err(), Lost::TooEven);
    }
}
