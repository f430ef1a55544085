//! Student's t distribution: how many standard errors an interval reaches to each side.

use std::f64::consts::{FRAC_2_PI, PI};

/// Half width, in standard errors, of an interval that holds the truth in 95 % of cases, for `freedom` ≥ 1 degrees of freedom;
/// `None` freedom: the variance is known, 1.959964.
pub fn two_sided_95(freedom: Option<usize>) -> f64 {
    const NORMAL: f64 = 1.959_963_984_540_054;
    match freedom {
        None => NORMAL,
        Some(n) if n >= 200 => expansion(NORMAL, n as f64),
        Some(n) => {
            // Newton on the probability within ±t, from the expansion, which is near enough from 3 degrees on.
            let mut t = if n < 3 { [12.7, 4.3][n.saturating_sub(1)] } else { expansion(NORMAL, n as f64) };
            for _ in 0..20 {
                let step = (within(t, n) - 0.95) / (2.0 * density(t, n));
                t -= step;
                if step.abs() < 1e-12 * t {
                    break;
                }
            }
            t
        }
    }
}

/// Quantile of Student's t from that of the normal distribution. Abramowitz and Stegun 26.7.5.
fn expansion(z: f64, n: f64) -> f64 {
    let z2 = z * z;
    let g1 = (z2 + 1.0) * z / 4.0;
    let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) * z / 96.0;
    let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) * z / 384.0;
    let g4 = ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) * z / 92_160.0;
    z + (g1 + (g2 + (g3 + g4 / n) / n) / n) / n
}

/// Probability of |T| < t. Abramowitz and Stegun 26.7.3 and 26.7.4, finite sums.
fn within(t: f64, n: usize) -> f64 {
    let theta = (t / (n as f64).sqrt()).atan();
    let (sin, cos) = theta.sin_cos();
    let odd = n % 2 == 1;
    if n == 1 {
        return FRAC_2_PI * theta;
    }
    // 1 + (1/2) cos² + (1·3)/(2·4) cos⁴ + …, or cos + (2/3) cos³ + (2·4)/(3·5) cos⁵ + …
    let (mut term, mut sum) = if odd { (cos, cos) } else { (1.0, 1.0) };
    let mut k = if odd { 3 } else { 2 };
    while k + 2 <= n {
        term *= cos * cos * (k - 1) as f64 / k as f64;
        sum += term;
        k += 2;
    }
    if odd { FRAC_2_PI * (theta + sin * sum) } else { sin * sum }
}

/// Density of Student's t.
fn density(t: f64, n: usize) -> f64 {
    // Γ((n+1)/2) / Γ(n/2) by its recurrence in steps of 2, from Γ(1)/Γ(½) = 1/√π and Γ(3/2)/Γ(1) = √π/2.
    let mut ratio = if n % 2 == 1 { 1.0 / PI.sqrt() } else { PI.sqrt() / 2.0 };
    let mut k = if n % 2 == 1 { 1 } else { 2 };
    while k < n {
        ratio *= (k + 1) as f64 / k as f64;
        k += 2;
    }
    let n = n as f64;
    ratio / (n * PI).sqrt() * (1.0 + t * t / n).powf(-0.5 * (n + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_printed_tables() {
        // Any table of Student's t, 97.5 %; 200 degrees are where the expansion takes over.
        let table = [
            (1, 12.706_205),
            (2, 4.302_653),
            (3, 3.182_446),
            (4, 2.776_445),
            (5, 2.570_582),
            (10, 2.228_139),
            (29, 2.045_230),
            (30, 2.042_272),
            (60, 2.000_298),
            (120, 1.979_930),
        ];
        for (n, t) in table {
            assert!((two_sided_95(Some(n)) - t).abs() < 1e-6, "{n}: {} is not {t}", two_sided_95(Some(n)));
        }
        assert!((within(two_sided_95(Some(200)), 200) - 0.95).abs() < 1e-10);
        assert!((two_sided_95(Some(1_000_000)) - two_sided_95(None)).abs() < 3e-6);
    }

    #[test]
    fn the_density_is_the_slope_of_the_probability() {
        for n in [1, 2, 3, 8, 151] {
            let slope = (within(1.5 + 1e-5, n) - within(1.5 - 1e-5, n)) / 4e-5;
            assert!((slope - density(1.5, n)).abs() < 1e-8, "{n}");
        }
    }
}
