//! How sure it is that a point was found within a pixel of the truth.

use super::tracking::Tracked;

/// How sure it is that a point lies within 1 px of the truth, 0 to 1.
///
/// Errors of x and y are taken as normal and alike, so that P(|error| < 1 px) = 1 − exp(−1 / 2s²). s² adds what is always there, what the
/// match states, what the neighbours do not share, and how much these differ among themselves. The shares were fitted on rendered
/// scenes of known truth and checked on others (`docs/accuracy.md`).
pub fn of(t: &Tracked) -> f64 {
    let squared: f64 = features(t).iter().zip(SHARES).map(|(f, s)| f * s).sum();
    MOST * (1.0 - (-1.0 / (2.0 * squared)).exp())
}

/// What s² is made of, px²: a constant, the stated variance, the squared stray, and the squared scatter of the neighbours.
pub fn features(t: &Tracked) -> [f64; 4] {
    let stated = 0.5 * (t.sigma_px[0].powi(2) + t.sigma_px[1].powi(2));
    let stray = t.stray_px.unwrap_or(ALONE_PX).min(MOST_PX);
    [1.0, stated, stray * stray, t.scatter_px.min(MOST_PX).powi(2)]
}

/// Shares of the features, fitted by greatest likelihood.
const SHARES: [f64; 4] = [0.053, 2.36, 0.044, 0.066];
/// Even a perfect match may be one with the wrong skin: one in a thousand.
const MOST: f64 = 0.999;
/// Stray of a point without neighbours, px.
const ALONE_PX: f64 = 1.5;
/// Stray and scatter beyond this say no more, px.
const MOST_PX: f64 = 6.0;

#[cfg(test)]
mod tests {
    use super::super::tracking::Method;
    use super::*;
    use nalgebra::Point2;

    #[test]
    fn what_agrees_is_sure_and_every_doubt_makes_it_less_so() {
        let sure = Tracked {
            at: Point2::origin(),
            sigma_px: [0.05; 2],
            correlation: 0.99,
            stray_px: Some(0.1),
            scatter_px: 0.1,
            confidence: 0.0,
            method: Method::Field,
        };
        // By hand: s² = 0.053 + 2.36 · 0.0025 + 0.044 · 0.01 + 0.066 · 0.01 = 0.0600; 0.999 (1 − e^(−8.33)) = 0.9988.
        assert!((of(&sure) - 0.9988).abs() < 1e-4, "{}", of(&sure));
        for doubtful in [
            Tracked { sigma_px: [0.6; 2], ..sure },
            Tracked { stray_px: Some(3.0), ..sure },
            Tracked { stray_px: None, ..sure },
            Tracked { scatter_px: 3.0, ..sure },
        ] {
            assert!(of(&doubtful) < of(&sure) - 0.02 && of(&doubtful) > 0.0, "{}", of(&doubtful));
        }
    }
}
