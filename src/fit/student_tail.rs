//! The tail of Student's distribution: from standard errors to limits that are exceeded with a given probability.

/// Probability that Student's t with `freedom` degrees of freedom exceeds `t`.
///
/// P(T > t) = ½ I(ν/(ν + t²); ν/2, ½) for t ≥ 0, with the regularised incomplete beta function I.
///
/// Source: Abramowitz and Stegun, *Handbook of Mathematical Functions*, 26.7.1 and 26.5.27.
pub fn upper_tail(t: f64, freedom: f64) -> f64 {
    if t < 0.0 {
        return 1.0 - upper_tail(-t, freedom);
    }
    0.5 * incomplete_beta(freedom / (freedom + t * t), 0.5 * freedom, 0.5)
}

/// t with P(T > t) = `probability`, for probabilities above 0 and below 1, to 1e-12 of it.
///
/// Newton's steps on ln P, whose slope is −density / P; where a step leaves the bounds known so far, they are halved instead.
pub fn exceeded_with(probability: f64, freedom: f64) -> f64 {
    if probability > 0.5 {
        return -exceeded_with(1.0 - probability, freedom);
    }
    let log_scale =
        ln_gamma(0.5 * (freedom + 1.0)) - ln_gamma(0.5 * freedom) - 0.5 * (freedom * std::f64::consts::PI).ln();
    let density = |t: f64| (log_scale - 0.5 * (freedom + 1.0) * (t * t / freedom).ln_1p()).exp();
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut t = 0.0;
    for _ in 0..200 {
        let tail = upper_tail(t, freedom);
        if tail > probability {
            low = t;
        } else {
            high = t;
        }
        let mut next = t + (tail / probability).ln() * tail / density(t);
        if !(next > low && next < high) {
            next = if high.is_finite() { f64::midpoint(low, high) } else { 2.0 * low + 1.0 };
        }
        if (next - t).abs() <= 1e-12 * next.abs() {
            return next;
        }
        t = next;
    }
    t
}

/// I(x; a, b), by its continued fraction (26.5.8), evaluated by Lentz's method.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    // The fraction converges fast on one side of its middle; the other follows by I(x; a, b) = 1 − I(1 − x; b, a).
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp() / a;
    let guarded = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guarded(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..2000 {
        let m = f64::from(m);
        for numerator in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / guarded(1.0 + numerator * d);
            c = guarded(1.0 + numerator / c);
            fraction *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

/// ln Γ(x) for x > 0, to about 1e-13. Stirling's series (6.1.41) above 10, brought there by Γ(x + 1) = x Γ(x).
fn ln_gamma(x: f64) -> f64 {
    if x < 10.0 {
        return ln_gamma(x + 1.0) - x.ln();
    }
    let z = 1.0 / (x * x);
    let series = 1.0 / 12.0 - z * (1.0 / 360.0 - z * (1.0 / 1260.0 - z * (1.0 / 1680.0 - z / 1188.0)));
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series / x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables: Abramowitz and Stegun, 26.10.
    #[test]
    fn quantiles_of_the_tables() {
        for (freedom, tail, t) in [
            (1.0, 0.025, 12.706),
            (2.0, 0.025, 4.303),
            (5.0, 0.025, 2.571),
            (5.0, 0.05, 2.015),
            (10.0, 0.005, 3.169),
            (30.0, 0.025, 2.042),
            (120.0, 0.025, 1.980),
            (1e7, 0.025, 1.960),
        ] {
            assert!(
                (exceeded_with(tail, freedom) - t).abs() < 6e-4,
                "{freedom} {tail}: {}",
                exceeded_with(tail, freedom)
            );
        }
        // The two-sided quantile of the fits, by another method.
        for n in [1, 2, 3, 7, 50, 199, 200, 1833] {
            let other = crate::fit::student::two_sided_95(Some(n));
            assert!((exceeded_with(0.025, n as f64) - other).abs() < 1e-7 * other, "{n}");
        }
    }

    /// With one degree of freedom it is Cauchy's: P(T > t) = ½ − arctan(t)/π; with two, ½ − t / (2 √(2 + t²)).
    #[test]
    fn one_and_two_degrees_of_freedom_in_closed_form() {
        for t in [-3.0, -0.4, 0.0, 0.01, 0.7, 2.0, 11.0, 400.0] {
            assert!((upper_tail(t, 1.0) - (0.5 - f64::atan(t) / std::f64::consts::PI)).abs() < 1e-13);
            assert!((upper_tail(t, 2.0) - (0.5 - t / (2.0 * (2.0 + t * t).sqrt()))).abs() < 1e-13);
        }
        assert_eq!(upper_tail(0.0, 7.0), 0.5);
        assert!((exceeded_with(0.9, 3.0) + exceeded_with(0.1, 3.0)).abs() < 1e-10);
    }

    /// Γ(½) = √π, Γ(5) = 24, Γ(20) = 19!.
    #[test]
    fn factorials() {
        assert!((ln_gamma(0.5) - 0.5 * std::f64::consts::PI.ln()).abs() < 1e-12);
        assert!((ln_gamma(5.0) - 24_f64.ln()).abs() < 1e-12);
        assert!((ln_gamma(20.0) - 121_645_100_408_832_000_f64.ln()).abs() < 1e-11);
    }
}
