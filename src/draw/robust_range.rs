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

#[cfg(test)]
mod tests {
    use super::*;

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
