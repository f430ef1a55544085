//! Finds one neighbourhood of skin again in another picture, to a fraction of a pixel, as digital image correlation does it.
//!
//! The neighbourhood may shift, turn, stretch and shear (an affine warp), and the light on it may become brighter and stronger in
//! contrast. The inverse compositional Gauss–Newton method fits all six numbers of the warp; its matrix depends on the first picture
//! alone and is made once a point. Source: Baker and Matthews 2004; Pan, Li and Tong 2013 for the criterion and its scaling.

use nalgebra::{Matrix2, Matrix6, Point2, Vector2, Vector6};

use super::gray::Spline;

/// Choices of the match.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSettings {
    /// Half the side of the neighbourhood, px; its weight falls off as a Gaussian of 0.6 of that. Default 10.
    pub radius_px: usize,
    /// Distance of the pixels that are compared, px: 1 all of them, 2 every other of every other row. Default 1.
    pub stride_px: usize,
    /// A step below this, px, ends the search. Default 0.005.
    pub close_px: f64,
    /// Most steps. Default 30.
    pub most_steps: usize,
    /// Least correlation that counts as the same skin, −1 to 1. Default 0.75.
    pub least_correlation: f64,
}

impl Default for PatchSettings {
    fn default() -> Self {
        Self { radius_px: 10, stride_px: 1, close_px: 0.005, most_steps: 30, least_correlation: 0.75 }
    }
}

/// Where a neighbourhood was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Its middle in the other picture, px.
    pub at: Point2<f64>,
    /// How the neighbourhood was stretched and turned: last = warp · first, about its middle.
    pub warp: Matrix2<f64>,
    /// Weighted correlation of the two neighbourhoods, 1 for the same up to light and contrast.
    pub correlation: f64,
    /// Standard error of the place along x and y, px, from what is left unexplained and the slopes of the picture. It is up to a
    /// fifth too small, because interpolation smooths the noise of the other picture, and knows nothing of a match with the wrong skin.
    pub sigma_px: [f64; 2],
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

/// A neighbourhood of the first picture, ready to be found again.
#[derive(Clone, Debug)]
pub struct Patch {
    settings: PatchSettings,
    /// Offsets from the middle, px.
    offsets: Vec<Vector2<f64>>,
    weights: Vec<f64>,
    /// Brightness less its weighted mean.
    values: Vec<f64>,
    /// Derivative of each brightness by the six numbers of the warp, times its weight.
    slopes: Vec<Vector6<f64>>,
    /// Sum of the weights.
    total: f64,
    /// √ of the weighted sum of squares of `values`.
    contrast: f64,
    inverse: Matrix6<f64>,
}

/// A pixel's slope below which a picture says nothing beside its own noise, grey levels per px (root mean square).
const LEAST_SLOPE: f64 = 0.35;

impl Patch {
    /// Cuts the neighbourhood of `at` from a picture.
    pub fn cut(picture: &Spline, at: Point2<f64>, settings: PatchSettings) -> Result<Self, Lost> {
        let radius = settings.radius_px.max(2);
        if !picture.holds(&at, radius as f64) {
            return Err(Lost::OutOfPicture);
        }
        let stride = settings.stride_px.clamp(1, radius);
        let side = 2 * (radius / stride) + 1;
        let spread = 0.6 * radius as f64;
        let mut offsets = Vec::with_capacity(side * side);
        let mut weights = Vec::with_capacity(side * side);
        let mut values = Vec::with_capacity(side * side);
        let mut slopes = Vec::with_capacity(side * side);
        // The pixels' own middles, so that the first picture is not interpolated: that would blur its noise and hide it.
        let corner = at.map(|c| (c - 0.5).round() + 0.5) - at - Vector2::repeat((radius / stride * stride) as f64);
        for i in 0..side * side {
            let offset = corner + Vector2::new((i % side * stride) as f64, (i / side * stride) as f64);
            let sample = picture.sample(&(at + offset));
            let [fx, fy] = sample.slope;
            weights.push((-offset.norm_squared() / (2.0 * spread * spread)).exp());
            values.push(sample.value);
            slopes.push(Vector6::new(fx, fx * offset.x, fx * offset.y, fy, fy * offset.x, fy * offset.y));
            offsets.push(offset);
        }
        let total: f64 = weights.iter().sum();
        let mean = weights.iter().zip(&values).map(|(w, v)| w * v).sum::<f64>() / total;
        for v in &mut values {
            *v -= mean;
        }
        let contrast = weights.iter().zip(&values).map(|(w, v)| w * v * v).sum::<f64>().sqrt();
        let normal: Matrix6<f64> = weights.iter().zip(&slopes).map(|(w, s)| s * s.transpose() * *w).sum();
        // The weaker of the two directions decides: along a line a patch slides.
        let structure = Matrix2::new(normal[(0, 0)], normal[(0, 3)], normal[(3, 0)], normal[(3, 3)]) / total;
        let weakest = structure.symmetric_eigenvalues().min();
        if weakest.is_nan() || weakest <= LEAST_SLOPE * LEAST_SLOPE {
            return Err(Lost::TooEven);
        }
        let inverse = normal.try_inverse().ok_or(Lost::TooEven)?;
        for (slope, w) in slopes.iter_mut().zip(&weights) {
            *slope *= *w;
        }
        Ok(Self { settings, offsets, weights, values, slopes, total, contrast, inverse })
    }

    /// Finds the neighbourhood in another picture, starting with its middle at `guess` and unstretched.
    pub fn find(&self, picture: &Spline, guess: Point2<f64>) -> Result<Match, Lost> {
        self.find_from(picture, guess, Matrix2::identity())
    }

    /// As [`find`](Self::find), starting with a given stretch.
    pub fn find_from(&self, picture: &Spline, guess: Point2<f64>, warp: Matrix2<f64>) -> Result<Match, Lost> {
        let (mut at, mut warp) = (guess, warp);
        let far = 3.0 * self.settings.radius_px as f64;
        for steps in 1..=self.settings.most_steps.max(1) {
            if !picture.holds(&at, 1.0) {
                return Err(Lost::OutOfPicture);
            }
            let look = self.look(picture, &at, &warp).ok_or(Lost::Unlike)?;
            let mut gradient = Vector6::zeros();
            for (k, left) in look.left.iter().enumerate() {
                gradient += self.slopes[k] * *left;
            }
            // What the first picture would have to do; the other picture's warp takes the inverse of it.
            let d = self.inverse * gradient;
            let step = Matrix2::new(1.0 + d[1], d[2], d[4], 1.0 + d[5]);
            let Some(back) = step.try_inverse() else { return Err(Lost::Unsettled) };
            warp *= back;
            at -= warp * Vector2::new(d[0], d[3]);
            let sane = (warp - Matrix2::identity()).norm() < 1.5 && (at - guess).norm() < far;
            if !sane {
                return Err(Lost::Unsettled);
            }
            let moved = Vector2::new(d[0], d[3]).norm()
                + 0.5 * self.settings.radius_px as f64 * Matrix2::new(d[1], d[2], d[4], d[5]).norm();
            if moved < self.settings.close_px {
                return self.judged(picture, at, warp, steps);
            }
        }
        Err(Lost::Unsettled)
    }

    fn judged(&self, picture: &Spline, at: Point2<f64>, warp: Matrix2<f64>, steps: usize) -> Result<Match, Lost> {
        let look = self.look(picture, &at, &warp).ok_or(Lost::Unlike)?;
        if look.correlation.is_nan() || look.correlation < self.settings.least_correlation {
            return Err(Lost::Unlike);
        }
        // Variance of one pixel from what is left, then through the weighted normal equations (sandwich).
        let variance = self.weights.iter().zip(&look.left).map(|(w, l)| w * l * l).sum::<f64>() / self.total
            * self.offsets.len() as f64
            / (self.offsets.len() as f64 - 8.0);
        let middle: Matrix6<f64> = self.slopes.iter().map(|s| s * s.transpose()).sum();
        let covariance = self.inverse * middle * self.inverse * variance;
        let sigma_px = [0, 3].map(|k| covariance[(k, k)].max(0.0).sqrt());
        Ok(Match { at, warp, correlation: look.correlation, sigma_px, steps })
    }

    /// Compares the neighbourhood with the other picture under a warp.
    fn look(&self, picture: &Spline, at: &Point2<f64>, warp: &Matrix2<f64>) -> Option<Look> {
        let mut left: Vec<f64> = self.offsets.iter().map(|o| picture.sample(&(at + warp * o)).value).collect();
        let mean = self.weights.iter().zip(&left).map(|(w, v)| w * v).sum::<f64>() / self.total;
        let (mut both, mut own) = (0.0, 0.0);
        for ((g, w), f) in left.iter_mut().zip(&self.weights).zip(&self.values) {
            *g -= mean;
            both += w * *g * f;
            own += w * *g * *g;
        }
        let contrast = own.sqrt();
        if contrast.is_nan() || contrast <= 0.0 {
            return None;
        }
        let gain = self.contrast / contrast;
        for (g, f) in left.iter_mut().zip(&self.values) {
            *g = *g * gain - f;
        }
        Some(Look { left, correlation: both / (self.contrast * contrast) })
    }

    /// What it was cut with.
    pub fn settings(&self) -> &PatchSettings {
        &self.settings
    }
}

/// A comparison of two neighbourhoods.
struct Look {
    /// The other brightness at the contrast of the first, less the first.
    left: Vec<f64>,
    correlation: f64,
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
        Spline::of(&Gray::new(120, 120, values.collect()).unwrap())
    }

    /// The second picture shows the texture moved by an affine map about (60, 60), under other light. The middle must be found where
    /// the map puts it: the pictures are sampled from one formula, so the truth is exact.
    #[test]
    fn a_moved_stretched_and_relit_texture_is_found_to_a_hundredth_of_a_pixel() {
        let first = picture(0.0, 1, texture);
        let patch = Patch::cut(&first, Point2::new(60.3, 59.6), PatchSettings::default()).unwrap();
        for (shift, warp) in [
            (Vector2::new(2.37, -1.81), Matrix2::identity()),
            (Vector2::new(-0.5, 0.25), Matrix2::new(1.12, 0.03, -0.02, 0.88)),
            (Vector2::new(1.2, 1.9), Matrix2::new(0.995, -0.09, 0.09, 0.995)),
        ] {
            let back = warp.try_inverse().unwrap();
            let second = picture(0.0, 1, |x, y| {
                let p = back * (Vector2::new(x - 60.3, y - 59.6) - shift) + Vector2::new(60.3, 59.6);
                20.0 + 0.8 * texture(p.x, p.y)
            });
            let found = patch.find(&second, Point2::new(60.3, 59.6) + shift + Vector2::new(0.9, -0.8)).unwrap();
            let error = (found.at - (Point2::new(60.3, 59.6) + shift)).norm();
            assert!(error < 0.01, "{error} px after {} steps", found.steps);
            assert!((found.warp - warp).norm() < 0.01 && found.correlation > 0.9999);
        }
    }

    /// With white noise the scatter over many draws must be what the standard error says.
    #[test]
    fn the_standard_error_is_the_scatter() {
        let truth = Point2::new(61.17, 58.32);
        let (mut errors, mut stated) = (Vec::new(), Vec::new());
        for seed in 0..120 {
            let first = picture(3.0, 2 * seed + 1, texture);
            let second = picture(3.0, 2 * seed + 2, |x, y| texture(x - 1.17, y + 1.68));
            let patch = Patch::cut(&first, Point2::new(60.0, 60.0), PatchSettings::default()).unwrap();
            let found = patch.find(&second, Point2::new(60.6, 59.0)).unwrap();
            errors.extend([found.at.x - truth.x, found.at.y - truth.y]);
            stated.extend(found.sigma_px);
        }
        let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len() as f64).sqrt();
        let ratio = rms(&errors) / rms(&stated);
        assert!((0.8..1.3).contains(&ratio), "scatter is {ratio} of what is stated ({} px)", rms(&stated));
        assert!(rms(&errors) < 0.05);
    }

    #[test]
    fn what_cannot_be_found_says_why() {
        let first = picture(0.0, 1, texture);
        let cut = |at: [f64; 2]| Patch::cut(&first, Point2::from(at), PatchSettings::default());
        assert_eq!(cut([5.0, 60.0]).unwrap_err(), Lost::OutOfPicture);
        assert_eq!(cut([f64::NAN, 60.0]).unwrap_err(), Lost::OutOfPicture);
        let lines = picture(0.0, 1, |x, _| 100.0 + 50.0 * (0.5 * x).sin());
        let along = Patch::cut(&lines, Point2::new(60.0, 60.0), PatchSettings::default());
        assert_eq!(along.unwrap_err(), Lost::TooEven, "a patch of parallel lines slides along them");
        let patch = cut([60.0, 60.0]).unwrap();
        let other = picture(30.0, 9, |_, _| 100.0);
        assert!(patch.find(&other, Point2::new(60.0, 60.0)).is_err());
        assert_eq!(patch.find(&first, Point2::new(-50.0, 60.0)).unwrap_err(), Lost::OutOfPicture);
        let even = picture(0.0, 1, |_, _| 100.0);
        assert!(patch.find(&even, Point2::new(60.0, 60.0)).is_err());
    }
}
