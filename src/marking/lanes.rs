//! Eight numbers side by side, as wide registers hold them: what pixels are worked on with.
//!
//! Everything here is inlined into functions that [`pulp`] dispatches, and compiled there for the registers that the processor has.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

/// Pixels worked on at once.
pub(super) const LANES: usize = 8;

/// One number of each of these pixels.
pub(super) type Lanes = [f32; LANES];

/// Added to a number below 2²² it leaves whole numbers alone in the last bits.
const WHOLE: f32 = 12_582_912.0;
const WHOLE_BITS: i32 = 0x4b40_0000;

/// A whole number, and the rest between 0 and 1 (either where the rest is none). Anything below 2²² in size; others give nonsense.
#[inline(always)]
pub(super) fn split(x: f32) -> (i32, f32) {
    let shifted = (x - 0.5) + WHOLE;
    let whole = shifted - WHOLE;
    (shifted.to_bits().cast_signed().wrapping_sub(WHOLE_BITS), x - whole)
}

/// eˣ between −80 and 80 with a relative error of 3 · 10⁻⁷, without a branch.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    // x = k ln 2 + r with |r| ≤ ½ ln 2; ln 2 in two parts, so that r keeps its digits.
    let shifted = x * std::f32::consts::LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    let r = (x - k * 0.693_359_4) + k * 2.121_944_4e-4;
    // Taylor's series to r⁶ / 720: the next term is below 2 · 10⁻⁷.
    let power = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r / 720.0)))));
    let scale = shifted.to_bits().cast_signed().wrapping_sub(WHOLE_BITS).wrapping_add(127) << 23;
    power * f32::from_bits(scale.cast_unsigned())
}

/// The sum of all lanes.
pub(super) fn sum(lanes: &Lanes) -> f64 {
    lanes.iter().map(|v| f64::from(*v)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for k in -8000..=8000 {
            let x = k as f32 * 0.01;
            let expected = f64::from(x).exp();
            assert!((f64::from(exp(x)) / expected - 1.0).abs() < 1e-6, "{x}: {} for {expected}", exp(x));
        }
    }

    #[test]
    fn a_number_is_split_into_whole_and_rest() {
        for (x, whole, rest) in [(3.25, 3, 0.25), (-3.25, -4, 0.75), (0.5, 0, 0.5), (1000.125, 1000, 0.125)] {
            assert_eq!(split(x), (whole, rest));
        }
        for x in [-2.0, 0.0, 7.0] {
            let (whole, rest) = split(x);
            assert!(whole as f32 + rest == x && (0.0..=1.0).contains(&rest));
        }
    }
}
