//! The end of a colour range that one wild value cannot spoil.

/// Share of the values that the range must hold where the largest stand far above the rest.
pub const SHARE: f64 = 0.98;

/// So many times the value at [`SHARE`] the largest may be without being cut off.
const SLACK: f64 = 1.5;

/// Fewer values than this are all taken in: 2 % of them would be none.
const FEWEST: usize = 25;

/// The largest absolute value, or, where a few stand more than half as high again above the rest, the one that 98 % do not exceed.
/// Zero without values.
pub fn robust_largest(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.filter(|v| v.is_finite()).map(f64::abs).collect();
    let rank = ((sizes.len() as f64 * SHARE).ceil() as usize).saturating_sub(1);
    if sizes.is_empty() {
        return 0.0;
    }
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let (_, &mut most, _) = sizes.select_nth_unstable_by(rank, f64::total_cmp);
    if sizes.len() < FEWEST || largest <= SLACK * most { largest } else { most }
}

/// The ends of the colours for values and whether each may set them: from 0, or as far below zero as above it, to a round number that
/// holds [`robust_largest`]. Where none may set the range all do; without values the end is 1.
pub fn automatic_range(values: impl Iterator<Item = (f64, bool)> + Clone, signed: bool) -> [f64; 2] {
    let chosen = robust_largest(values.clone().filter(|(_, sets)| *sets).map(|(v, _)| v));
    let most = if chosen > 0.0 { chosen } else { robust_largest(values.map(|(v, _)| v)) };
    let high = if most > 0.0 { round_up(most) } else { 1.0 };
    [if signed { -high } else { 0.0 }, high]
}

/// The next number up with two digits that ticks divide well: 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten.
pub fn round_up(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powi(value.log10().floor() as i32);
    let digits = value / power;
    [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0].into_iter().find(|g| *g >= digits - 1e-9).unwrap_or(10.0)
        * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_ends_on_a_round_number_and_what_may_not_set_it_does_not() {
        let values = [(0.1, true), (0.142, true), (9.0, false)];
        let [low, high] = automatic_range(values.into_iter(), false);
        assert!(low == 0.0 && (high - 0.15).abs() < 1e-12);
        assert_eq!(automatic_range([(-0.37, true), (0.1, true)].into_iter(), true), [-0.4, 0.4]);
        assert_eq!(automatic_range([(9.0, false)].into_iter(), false), [0.0, 10.0], "nothing else: it must do");
        assert_eq!(automatic_range(std::iter::empty(), false), [0.0, 1.0]);
        assert!((round_up(0.031) - 0.04).abs() < 1e-12 && round_up(f64::NAN) == 1.0);
    }

    #[test]
    fn one_wild_value_of_a_hundred_is_cut_off_and_a_real_peak_is_not() {
        // 1, 2, …, 99 and a thousand: the 98th of a hundred is 98.
        let even = (1..100).map(f64::from);
        assert_eq!(robust_largest(even.clone().chain([-1000.0])), 98.0);
        assert_eq!(robust_largest(even.clone().chain([140.0])), 140.0, "not half as high again as 98");
        assert_eq!(robust_largest((1..20).map(f64::from).chain([1000.0])), 1000.0, "too few to judge");
        assert_eq!(robust_largest(even.chain([f64::NAN])), 99.0);
        assert_eq!(robust_largest(std::iter::empty()), 0.0);
    }
}
