//! How sure it is that a point was found within a pixel of the truth.

use super::tracking::Tracked;

/// How sure it is that a point lies within 1 px of the truth, 0 to 1; `compressed_px2` is the variance that the pictures' compression adds
/// ([`super::compressed`]).
///
/// Errors of x and y are taken as normal and alike, so that P(|error| < 1 px) = 1 − exp(−1 / 2s²). s² adds what is always there, what the
/// search states, what the pictures differ by where the point lies, and what their compression adds. The shares were fitted on rendered
/// scenes of known truth and checked on others (`docs/accuracy.md`).
pub fn of(t: &Tracked, compressed_px2: f64) -> f64 {
    let squared: f64 = features(t).iter().zip(SHARES).map(|(f, s)| f * s).sum();
    MOST * (1.0 - (-1.0 / (2.0 * (squared + compressed_px2))).exp())
}

/// What s² is made of: a constant, the stated variance (px²), and by how much the pictures differ about the point more than their noise.
fn features(t: &Tracked) -> [f64; 3] {
    let stated = 0.5 * (t.sigma_px[0].powi(2) + t.sigma_px[1].powi(2));
    [1.0, stated, (t.misfit - 1.0).clamp(0.0, MOST_MISFIT)]
}

/// Shares of the features, px², 1 and px², fitted by greatest likelihood.
const SHARES: [f64; 3] = [0.0095, 8.61, 0.0563];
/// Even a perfect match may be one with the wrong skin: one in a thousand.
const MOST: f64 = 0.999;
/// A misfit beyond this says no more.
const MOST_MISFIT: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::super::tracking::Method;
    use super::*;
    use nalgebra::Point2;

    #[test]
    fn what_agrees_is_sure_and_every_doubt_makes_it_less_so() {
        let sure =
            Tracked { at: Point2::origin(), sigma_px: [0.05; 2], misfit: 1.2, confidence: 0.0, method: Method::Field };
        // By hand: s² = 0.0095 + 8.61 · 0.0025 + 0.0563 · 0.2 = 0.0423; 0.999 (1 − e^(−11.8)) = 0.9990.
        assert!((of(&sure, 0.0) - 0.999).abs() < 1e-4, "{}", of(&sure, 0.0));
        // With half a squared pixel more: 0.999 (1 − e^(−1 / 1.0846)) = 0.6017.
        assert!((of(&sure, 0.5) - 0.602).abs() < 1e-3, "{}", of(&sure, 0.5));
        for doubtful in [Tracked { sigma_px: [0.3; 2], ..sure }, Tracked { misfit: 8.0, ..sure }] {
            assert!(of(&doubtful, 0.0) < of(&sure, 0.0) - 0.02 && of(&doubtful, 0.0) > 0.0, "{}", of(&doubtful, 0.0));
        }
    }
}
