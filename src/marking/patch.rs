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

mod window;

use nalgebra::{Matrix2, Point2, Vector2};

use super::gray::Spline;
use window::{Normal, Numbers, WARP, Window};

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
/// Area over which a smoothed picture's pixels share their noise, px²: 4π times the variance of the smoothing, less what the slopes,
/// which differ over it, take away.
const NOISE_AREA: f64 = 7.0;
/// A step longer than this changes the slopes that are compared, px.
const ANEW_PX: f64 = 0.1;
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
    Fit { window: Window::cut(first, from, radius, settings.samples), last, settings }.search(guess)
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

/// The fit of one neighbourhood.
struct Fit<'a> {
    window: Window,
    last: &'a Spline,
    settings: &'a PatchSettings,
}

impl Fit<'_> {
    fn search(&self, guess: &Guess) -> Result<Match, Lost> {
        let Window { from, radius, .. } = self.window;
        let total = f64::from(self.window.total);
        let stretch = (guess.warp - Matrix2::identity()) * radius;
        let shift = guess.at - from;
        let mut n = Numbers::zeros();
        for (axis, k) in [(0, 0), (1, WARP)] {
            n[k] = shift[axis];
            n[k + 1] = stretch[(axis, 0)];
            n[k + 2] = stretch[(axis, 1)];
            for (i, bend) in guess.bend[axis].iter().enumerate() {
                n[k + 3 + i] = bend * radius * radius;
            }
        }
        n[2 * WARP] = 1.0;
        let expected = n;
        let far = 1.2 * radius;
        let most = self.settings.most_steps.max(1);
        let mut last_step = f64::INFINITY;
        let mut squares = f64::INFINITY;
        let mut matrix = Normal::zeros();
        for steps in 1..=most {
            // The slopes hardly change once the steps are short: their products are summed anew while they are long.
            let sums = if last_step > ANEW_PX { Some(self.window.sums(self.last, &n)) } else { None };
            let pull = match sums {
                Some(sums) => {
                    matrix = sums.matrix;
                    sums.pull
                }
                None => self.window.pull(self.last, &n),
            };
            // The first step alone takes away what the pictures differ by in all; until then it is no noise.
            let offset = pull.gradient[2 * WARP + 1] / total;
            squares = (pull.squares - total * offset * offset).max(0.0);
            // The variance of what is left decides how much what is held weighs; one step later it is known better.
            let noise = (squares / total).sqrt().max(LEAST_NOISE) * self.shared();
            let mut held = matrix;
            let mut gradient = pull.gradient;
            for (k, sd) in self.held() {
                let strength = (noise / sd).powi(2);
                held[(k, k)] += strength;
                gradient[k] += strength * (n[k] - expected[k]);
            }
            let Some(factor) = held.cholesky() else { return Err(Lost::TooEven) };
            let step = factor.solve(&gradient);
            n -= step;
            let moved = Vector2::new(step[0], step[WARP]).norm();
            let shape = (1..3).map(|k| step[k].abs() + step[WARP + k].abs()).sum::<f64>();
            let away = Vector2::new(n[0], n[WARP]) - shift;
            let sane = away.norm() < far && n[2 * WARP] > 0.1 && n.iter().all(|v| v.is_finite());
            if !sane {
                return Err(Lost::Unsettled);
            }
            last_step = moved + 0.25 * shape;
            if steps > 1 && last_step < self.settings.close_px {
                return self.judged(&matrix, squares, &n, steps);
            }
        }
        // One that still creeps is as good as it is doubtful: its last step adds to its error.
        if last_step > 20.0 * self.settings.close_px {
            return Err(Lost::Unsettled);
        }
        let mut found = self.judged(&matrix, squares, &n, most)?;
        found.sigma_px = found.sigma_px.map(|s| s.hypot(2.0 * last_step));
        Ok(found)
    }

    /// By how much places that are compared nearer to each other than the noise reaches say less than they would apart.
    fn shared(&self) -> f64 {
        let step = self.window.radius / f64::from(self.window.samples);
        (NOISE_AREA / (step * step)).max(1.0).sqrt()
    }

    /// Standard deviations of what is held: number, px.
    fn held(&self) -> [(usize, f64); 2 * (WARP - 1)] {
        let r = self.window.radius;
        std::array::from_fn(|i| {
            let (axis, k) = (i / (WARP - 1), 1 + i % (WARP - 1));
            (axis * WARP + k, if k < 3 { self.settings.stretch * r } else { self.settings.bend_per_px * r * r })
        })
    }

    /// The match, from the sums of the last step.
    fn judged(&self, matrix: &Normal, squares: f64, n: &Numbers, steps: usize) -> Result<Match, Lost> {
        let window = &self.window;
        let total = f64::from(window.total);
        let variance = squares / total;
        let noise = variance.max(LEAST_NOISE * LEAST_NOISE) * self.shared().powi(2);
        let slope = matrix[(0, 0)].min(matrix[(WARP, WARP)]) / total;
        if slope.is_nan() || slope <= LEAST_SLOPE * LEAST_SLOPE {
            return Err(Lost::TooEven);
        }
        let mut held = *matrix;
        for (k, sd) in self.held() {
            held[(k, k)] += noise / (sd * sd);
        }
        let inverse = held.try_inverse().ok_or(Lost::TooEven)?;
        // The weights are below one: fewer pixels count than are compared, which the inverse of their sum says already.
        let sigma_px = [0, WARP].map(|k| (inverse[(k, k)] * noise).max(0.0).sqrt());
        // How much of the first picture's contrast is met, beside what the light's slope takes.
        let contrast = window.contrast * n[2 * WARP].powi(2);
        let correlation = (contrast / (contrast + squares)).sqrt();
        let r = window.radius;
        let axis = |k: usize| [n[k + 3], n[k + 4], n[k + 5]].map(|b| b / (r * r));
        Ok(Match {
            at: window.from + Vector2::new(n[0], n[WARP]),
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
