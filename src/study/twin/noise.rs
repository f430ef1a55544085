//! Irregularity that repeats: smooth noise over a plane for the skin, and normal random numbers for marks and cameras.

use rand::{Rng, RngExt};

/// Two independent standard normal numbers (Box and Muller 1958).
pub(in crate::study) fn normal_pair(random: &mut impl Rng) -> [f64; 2] {
    let radius = (-2.0 * (1.0 - random.random_range(0.0..1.0_f64)).ln()).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * random.random_range(0.0..1.0_f64)).sin_cos();
    [radius * cos, radius * sin]
}

/// Smooth noise between −1 and 1 with features about 1 in size: random values on the whole numbers, blended between them.
pub(super) fn smooth(x: f64, y: f64, seed: u32) -> f64 {
    let (column, row) = (x.floor(), y.floor());
    let fade = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (fade(x - column), fade(y - row));
    let value = |i: i64, j: i64| lattice(column as i64 + i, row as i64 + j, seed);
    let top = value(0, 0) + (value(1, 0) - value(0, 0)) * u;
    let bottom = value(0, 1) + (value(1, 1) - value(0, 1)) * u;
    top + (bottom - top) * v
}

/// Noise of several sizes: each octave half as large and half as strong as the one before.
pub(super) fn layered(x: f64, y: f64, octaves: u32, seed: u32) -> f64 {
    let layer = |k: u32| {
        let scale = f64::from(1_u32 << k);
        smooth(x * scale, y * scale, seed.wrapping_add(k)) / scale
    };
    (0..octaves).map(layer).sum()
}

/// A random value between −1 and 1 for a point of the lattice, always the same one.
fn lattice(i: i64, j: i64, seed: u32) -> f64 {
    let mut h = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h ^= u64::from(seed).wrapping_mul(0x1656_67b1_9e37_79f9);
    // The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^= h >> 31;
    (h >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn normal_numbers_have_mean_0_and_variance_1() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let all: Vec<f64> = (0..20_000).flat_map(|_| normal_pair(&mut random)).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let variance = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / all.len() as f64;
        // Standard errors at 40 000 numbers: 0.005 and 0.007.
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
    }

    #[test]
    fn noise_is_continuous_bounded_and_centred() {
        let mut sum = 0.0;
        for i in 0..10_000 {
            let (x, y) = (f64::from(i % 100) * 0.37 - 20.0, f64::from(i / 100) * 0.41 - 20.0);
            let v = smooth(x, y, 3);
            assert!(v.abs() <= 1.0 && (smooth(x + 1e-4, y, 3) - v).abs() < 1e-3);
            sum += v;
        }
        assert!((sum / 1e4_f64).abs() < 0.05);
    }
}
