//! What compression leaves of skin: how far a place may lie from where two compressed pictures show it.
//!
//! A film's coder predicts a frame from those before it and corrects what it got wrong only where that is worth the bits. The faint texture of
//! skin is not: it is carried along by the coder's own motion, or stays where it was while the face moves on. Two such frames then agree
//! almost pixel by pixel at places that are not the same skin, and nothing in what they differ by tells.

use rayon::prelude::*;

use super::prepared::Prepared;
use super::registration::Skin;
use crate::frames::Compression;

/// Variance of a place along each axis that compression adds, px²: to be told apart from what the pictures' differences say, which do not
/// know of it.
///
/// ```text
/// (A + B · 2^(−h / H)) · (px per mm)^P
/// ```
///
/// with h the finest detail that is left in both pictures (`finest`). A, B, H and P were fitted to twins whose frames went through
/// an H.264 coder (`docs/accuracy.md`). Between two pictures of their own there is no A, and little of B: texture is lost there, not carried
/// along. Where nothing is known of them pictures in which the noise of a camera is left were not compressed, and others may be frames of any film.
pub fn variance_px2(pictures: [&Prepared; 2], skin: &Skin, px_per_mm: f64) -> f64 {
    let kinds = pictures.map(Prepared::compression);
    let [Some(a), Some(b)] = pictures.map(|p| finest(p, skin)) else { return 0.0 };
    let h = 0.5 * (a + b);
    let [least, most] = match kinds {
        [Compression::Intra, Compression::Intra] => LOST,
        [a, b] if a != Compression::Inter && b != Compression::Inter && h >= CAMERA => return 0.0,
        _ => CARRIED,
    };
    (least + most * (-h / HALF).exp2()) * px_per_mm.powf(POWER)
}

/// Lower quartile over the skin of the size of the second difference across rows and columns (Immerkær 1996, scaled as the
/// standard deviation of white noise), grey levels: the noise of a camera where it is left, near nothing where a coder took it. None without skin.
fn finest(picture: &Prepared, skin: &Skin) -> Option<f64> {
    let gray = picture.gray();
    let inner = |side: usize| (1..side.saturating_sub(1)).step_by(EVERY);
    let rows: Vec<usize> = inner(gray.height()).collect();
    let of_row = |y: &usize| {
        let [above, here, below] = [y - 1, *y, y + 1].map(|y| gray.row(y));
        let across = |row: &[f32], x: usize| row[x - 1] - 2.0 * row[x] + row[x + 1];
        let size = move |x: usize| (across(above, x) - 2.0 * across(here, x) + across(below, x)).abs();
        let y = *y;
        inner(gray.width()).filter(move |x| skin.shown(*x, y).is_some()).map(size)
    };
    let mut sizes: Vec<f32> = rows.par_iter().flat_map_iter(of_row).collect();
    if sizes.is_empty() {
        return None;
    }
    let quarter = sizes.len() / 4;
    let (_, quartile, _) = sizes.select_nth_unstable_by(quarter, f32::total_cmp);
    Some(TO_SPREAD * f64::from(*quartile))
}

/// Of every so many columns and rows.
const EVERY: usize = 2;
/// The median size of that second difference under white noise of 1, whose weights have the squares' sum 36, is 6 · 0.6745.
const TO_SPREAD: f64 = 1.4826 / 6.0;
/// Pictures with this much fine detail still have their camera's noise, grey levels.
const CAMERA: f64 = 0.3;
/// A and B, px² at 1 px per mm: between frames into which texture may have been carried, and between pictures of their own.
const CARRIED: [f64; 2] = [0.11, 0.33];
const LOST: [f64; 2] = [0.0, 0.1];
/// H, grey levels.
const HALF: f64 = 0.1;
/// P.
const POWER: f64 = 0.6;

#[cfg(test)]
mod tests {
    use super::super::gray::Gray;
    use super::*;
    use crate::face::patches::Noise;

    fn picture(noise: f64, compression: Compression) -> Prepared {
        let mut random = Noise(7);
        let values = (0..200 * 200).map(|i| (100.0 + 0.2 * f64::from(i % 200) + noise * random.normal()) as f32);
        Prepared::of(Gray::new(200, 200, values.collect()).unwrap()).compressed(compression)
    }

    /// A quarter of normal errors is smaller than 0.3186 of their spread, half than 0.6745: noise of 2 leaves 2 · 0.3186 / 0.6745 = 0.945,
    /// a ramp nothing.
    #[test]
    fn fine_detail_is_that_of_the_noise() {
        let skin = Skin::square(20.0, 180.0);
        let found = |noise: f64| finest(&picture(noise, Compression::Unknown), &skin).unwrap();
        assert!((found(2.0) - 0.945).abs() < 0.03, "{}", found(2.0));
        assert!(found(0.0) < 1e-4);
        assert_eq!(finest(&picture(2.0, Compression::Unknown), &Skin::square(300.0, 400.0)), None);
    }

    /// By hand, at 2 px/mm (2^0.6 = 1.5157) and without detail: (0.11 + 0.33) · 1.5157 = 0.667 between predicted frames, 0.1 · 1.5157 = 0.152
    /// between key frames. With a camera's noise nothing, unless a film says otherwise: then about 0.11 · 1.5157 = 0.167.
    #[test]
    fn only_what_was_compressed_is_doubted() {
        use Compression::{Inter, Intra, Unknown};
        let skin = Skin::square(20.0, 180.0);
        let of = |noise: f64, kinds: [Compression; 2]| {
            let [a, b] = kinds.map(|k| picture(noise, k));
            variance_px2([&a, &b], &skin, 2.0)
        };
        for (noise, kinds, by_hand) in [
            (0.0, [Inter, Inter], 0.667),
            (0.0, [Intra, Inter], 0.667),
            (0.0, [Unknown, Unknown], 0.667),
            (0.0, [Intra, Intra], 0.152),
            (2.0, [Unknown, Unknown], 0.0),
            (2.0, [Intra, Unknown], 0.0),
            (2.0, [Inter, Intra], 0.167),
            (2.0, [Intra, Intra], 0.0),
        ] {
            let found = of(noise, kinds);
            assert!((found - by_hand).abs() < 2e-3, "{noise} {kinds:?}: {found}");
        }
    }
}
