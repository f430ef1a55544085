//! eˣ, sine and cosine without a branch, so that a loop over many numbers is compiled for wide registers.
//!
//! They are as exact as the library's to a few units in the last place, and the same on every processor.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::f64::consts::{FRAC_PI_2, LOG2_E};

/// Added to a number below 2⁵¹ it leaves a whole number in the last bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, so that k ln 2 keeps its digits.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// e to this and less is not told from e to this; e^708 is the largest power that is a number.
const FURTHEST: f64 = 708.0;

/// 1/2! to 1/13!.
const INVERSE_FACTORIALS: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// eˣ; of x below −708 that of −708, and above 708 that of 708.
#[inline(always)]
pub(super) fn exp(x: f64) -> f64 {
    let x = if x > -FURTHEST { x } else { -FURTHEST };
    let x = if x < FURTHEST { x } else { FURTHEST };
    // x = k ln 2 + r with |r| ≤ ½ ln 2. Taylor's series to r¹³/13!: the next term is below 5 · 10⁻¹⁸.
    let shifted = x * LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let (square, fourth) = (r * r, (r * r) * (r * r));
    // Four terms at a time: they need not wait for each other.
    let [a, b, c, d, e, f, g, h, i, j, last, l] = INVERSE_FACTORIALS;
    let first = (a + b * r) + (c + d * r) * square;
    let second = (e + f * r) + (g + h * r) * square;
    let third = (i + j * r) + (last + l * r) * square;
    let rest = first + (second + third * fourth) * fourth;
    let power = 1.0 + (r + square * rest);
    power * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

/// Sine and cosine of `u` right angles, 0 ≤ u ≤ 2; beyond that some number.
#[inline(always)]
pub(super) fn sin_cos_of_right_angles(u: f64) -> (f64, f64) {
    let (first, last) = (u < 0.5, u >= 1.5);
    let turns = if first { 0.0 } else { 1.0 } + if last { 1.0 } else { 0.0 };
    // |x| ≤ π/4. Taylor's series to x¹⁵/15! and x¹⁶/16!: the next terms are below 5 · 10⁻¹⁷.
    let x = (u - turns) * FRAC_PI_2;
    let square = x * x;
    let (mut sin, mut cos) = (-1.0 / 1_307_674_368_000.0, 1.0 / 20_922_789_888_000.0);
    for (odd, even) in [
        (6_227_020_800.0, -87_178_291_200.0),
        (-39_916_800.0, 479_001_600.0),
        (362_880.0, -3_628_800.0),
        (-5_040.0, 40_320.0),
        (120.0, -720.0),
        (-6.0, 24.0_f64),
    ] {
        sin = sin * square + 1.0 / odd;
        cos = cos * square + 1.0 / even;
    }
    let sin = x + x * square * sin;
    let cos = 1.0 + square * (cos * square - 0.5);
    if first {
        (sin, cos)
    } else if last {
        (-sin, -cos)
    } else {
        (cos, -sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_the_library_s() {
        for k in -70_000..=70_000 {
            let x = f64::from(k) * 0.010_1;
            assert!((exp(x) / x.exp() - 1.0).abs() < 4e-16, "{x}: {:e} for {:e}", exp(x), x.exp());
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(f64::NEG_INFINITY), exp(-708.0));
        assert!(exp(-1e9) > 0.0 && exp(1e9).is_finite());
    }

    #[test]
    fn sine_and_cosine_are_the_library_s() {
        for k in 0..=20_000 {
            let u = f64::from(k) * 1e-4;
            let ((sin, cos), (by_sin, by_cos)) = (sin_cos_of_right_angles(u), (u * FRAC_PI_2).sin_cos());
            assert!((sin - by_sin).abs() < 4e-16 && (cos - by_cos).abs() < 4e-16, "{u}: {sin} {cos}");
        }
        assert_eq!(sin_cos_of_right_angles(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_of_right_angles(1.0), (1.0, 0.0));
    }
}
