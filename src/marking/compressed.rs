//! What compression leaves of skin: how far a place may lie from where two compressed pictures show it.
//!
//! A film's coder predicts a frame from those before it and corrects what it got wrong only where that is worth the bits. The faint texture of
//! skin is not: it is carried along by the coder's own motion, or stays where it was while the face moves on. Two such frames then agree
//! almost pixel by pixel at places that are not the same skin, and nothing in what they differ by tells.

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
/// with h the finest detail that is left in both pictures ([`finest`]). A, B, H and P were fitted to twins whose frames went through
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
    let mut sizes = Vec::new();
    for y in inner(gray.height()) {
        for x in inner(gray.width()).filter(|x| skin.shown(*x, y).is_some()) {
            let at = |dx: isize, dy: isize| gray.at(x.cast_signed() + dx, y.cast_signed() + dy);
            let across = |dy: isize| at(-1, dy) - 2.0 * at(0, dy) + at(1, dy);
            sizes.push((across(-1) - 2.0 * across(0) + across(1)).abs());
        }
    }
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
