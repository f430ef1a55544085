//! Student's t: how many standard errors an interval reaches, and limits that are exceeded with a given probability.
//!
//! `freedom` is the number of degrees of freedom, at least 1; `None` where the variance is known, so that the distribution is normal.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Half width, in standard errors, of an interval that holds the truth in 95 % of cases.
pub fn two_sided_95(freedom: Option<usize>) -> f64 {
    exceeded_with(0.025, freedom)
}

/// Probability that t is exceeded.
pub fn upper_tail(t: f64, freedom: Option<usize>) -> f64 {
    distribution(freedom).map_or_else(|| Normal::standard().sf(t), |d| d.sf(t))
}

/// The value that is exceeded with this probability, between 0 and 1.
pub fn exceeded_with(probability: f64, freedom: Option<usize>) -> f64 {
    // Both are symmetric, and a small probability is told more exactly than its complement.
    let p = probability.clamp(f64::MIN_POSITIVE, 1.0);
    -distribution(freedom).map_or_else(|| Normal::standard().inverse_cdf(p), |d| d.inverse_cdf(p))
}

fn distribution(freedom: Option<usize>) -> Option<StudentsT> {
    freedom.and_then(|n| StudentsT::new(0.0, 1.0, n.max(1) as f64).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables: Abramowitz and Stegun, 26.10; the normal quantile 1.959964.
    #[test]
    fn quantiles_of_the_tables() {
        let table = [
            (Some(1), 0.025, 12.706),
            (Some(2), 0.025, 4.303),
            (Some(5), 0.025, 2.571),
            (Some(5), 0.05, 2.015),
            (Some(10), 0.005, 3.169),
            (Some(30), 0.025, 2.042),
            (Some(120), 0.025, 1.980),
            (None, 0.025, 1.960),
        ];
        for (freedom, tail, t) in table {
            let found = exceeded_with(tail, freedom);
            assert!((found - t).abs() < 6e-4, "{freedom:?} {tail}: {found}");
        }
        assert!((two_sided_95(None) - 1.959_963_984_540_054).abs() < 1e-9);
        assert!((two_sided_95(Some(100_000)) - 1.959_963_984_540_054 - 2.4e-5).abs() < 1e-5);
    }

    /// With one degree of freedom it is Cauchy's: P(T > t) = ½ − arctan(t)/π; with two, ½ − t / (2 √(2 + t²)).
    #[test]
    fn one_and_two_degrees_of_freedom_in_closed_form() {
        for t in [-3.0, -0.4, 0.0, 0.01, 0.7, 2.0, 11.0, 400.0] {
            assert!((upper_tail(t, Some(1)) - (0.5 - f64::atan(t) / std::f64::consts::PI)).abs() < 1e-13);
            assert!((upper_tail(t, Some(2)) - (0.5 - t / (2.0 * (2.0 + t * t).sqrt()))).abs() < 1e-13);
        }
        assert_eq!(upper_tail(0.0, Some(7)), 0.5);
        assert!((exceeded_with(0.9, Some(3)) + exceeded_with(0.1, Some(3))).abs() < 1e-10);
    }

    #[test]
    fn a_limit_is_exceeded_with_the_probability_asked_for_also_far_out() {
        for freedom in [Some(3), Some(50), Some(181), Some(1833), None] {
            for p in [0.3, 0.025, 1e-4, 1e-12] {
                let back = upper_tail(exceeded_with(p, freedom), freedom);
                assert!((back / p - 1.0).abs() < 1e-9, "{freedom:?} {p}: {back}");
            }
        }
    }
}
