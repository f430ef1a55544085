//! Ticks of an axis: round numbers that a reader can name, and their labels.

/// The largest of 1, 2, 2.5 and 5 times a power of ten that fits `at_least` times or more often into `span`.
pub fn nice_step(span: f64, at_least: usize) -> f64 {
    let rough = span / at_least.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let decade = 10_f64.powf(rough.log10().floor());
    // A hair of slack: 0.6 / 3 is just under 0.2 in binary.
    [5.0, 2.5, 2.0, 1.0].into_iter().find(|m| m * decade <= rough * (1.0 + 1e-9)).unwrap_or(1.0) * decade
}

/// Round numbers within `[low, high]`, at least `at_least` steps of [`nice_step`] apart; empty for an empty or infinite range.
pub fn nice_ticks(low: f64, high: f64, at_least: usize) -> Vec<f64> {
    if !(low.is_finite() && high.is_finite() && high > low) {
        return Vec::new();
    }
    let step = nice_step(high - low, at_least);
    let slack = 1e-9 * (high - low);
    let (first, last) = (((low - slack) / step).ceil() as i64, ((high + slack) / step).floor() as i64);
    // Whole multiples, not repeated sums, whose rounding would add up. Zero is plain zero.
    (first..=last).map(|i| if i == 0 { 0.0 } else { i as f64 * step }).collect()
}

/// The ticks' labels, all with the number of decimals that the step needs.
pub fn labels(ticks: &[f64]) -> Vec<String> {
    let step = ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let magnitude = ticks.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    if magnitude >= 1e6 || (step.is_finite() && step < 1e-6) {
        return ticks.iter().map(|t| format!("{t:.2e}")).collect();
    }
    // Decimals until the step is a whole number of the last digit.
    let is_whole = |v: f64| (v - v.round()).abs() < 1e-6;
    let exact = |d: &u8| !step.is_finite() || is_whole(step * 10_f64.powi(i32::from(*d)));
    let decimals = usize::from((0..=8).find(exact).unwrap_or(8));
    ticks.iter().map(|t| format!("{t:.decimals$}").replace('-', "−")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let written = |low, high, at_least| labels(&nice_ticks(low, high, at_least)).join(" ");
        assert_eq!(written(0.0, 0.142, 4), "0.000 0.025 0.050 0.075 0.100 0.125");
        assert_eq!(written(0.0, 0.6, 3), "0.0 0.2 0.4 0.6");
        assert_eq!(written(-70.0, 70.0, 3), "−50 −25 0 25 50");
        assert_eq!(written(0.0, 2e-5, 4), "0.000000 0.000005 0.000010 0.000015 0.000020");
        assert_eq!(written(0.0, 4e7, 4), "0.00e0 1.00e7 2.00e7 3.00e7 4.00e7");
        assert_eq!(nice_ticks(1.0, 1.0, 4), Vec::<f64>::new());
        assert_eq!(nice_ticks(0.0, f64::NAN, 4), Vec::<f64>::new());
    }
}
