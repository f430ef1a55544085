//! Cubic B-splines: the four that reach a place.

/// The four cubic B-splines at `t`, 0 to 1, between the second and the third of their nodes, with their first and second derivatives;
/// nodes lie 1 apart.
pub(super) fn splines(t: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [s * s * s / 6.0, 2.0 / 3.0 - t * t * (2.0 - t) / 2.0, 2.0 / 3.0 - s * s * (2.0 - s) / 2.0, t * t * t / 6.0],
        [-s * s / 2.0, t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0), t * t / 2.0],
        [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// They add up to one, and make the parabola x² / 2 from x² / 2 − 1 / 6 at their nodes (Marsden's identity); derivatives are those of
    /// that.
    #[test]
    fn a_parabola_is_made_with_its_derivatives() {
        for t in [0.0, 0.25, 0.6, 1.0] {
            let sums = splines(t).map(|four| {
                let parabola = four.iter().enumerate().map(|(k, v)| {
                    let x = k as f64 - 1.0;
                    v * (0.5 * x * x - 1.0 / 6.0)
                });
                (parabola.sum::<f64>(), four.iter().sum::<f64>())
            });
            for ((sum, one), (parabola, constant)) in sums.iter().zip([(0.5 * t * t, 1.0), (t, 0.0), (1.0, 0.0)]) {
                assert!((sum - parabola).abs() < 1e-12 && (one - constant).abs() < 1e-12, "{t}: {sums:?}");
            }
        }
    }
}
