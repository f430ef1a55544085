//! A plate of expressions: the same face under each of them, painted and at one scale, with their names.

use image::{RgbImage, imageops};
use nalgebra::Point3;

use super::expression::{PictureOptions, picture};
use crate::draw::raster;
use crate::draw::surface_picture::{HEADING_PX, PAPER};
use crate::draw::svg::SvgError;
use crate::face::FaceModel;

/// Faces in a row.
const COLUMNS: usize = 3;
/// Width of a face's view, as a share of its height.
const WIDE: f64 = 0.80;

/// Draws a face under several expressions, each with its name, three in a row.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted, and where no expression is given.
pub fn plate(
    face: &FaceModel,
    rest: &[Point3<f64>],
    expressions: &[(String, Vec<Point3<f64>>)],
    height_px: u32,
) -> Result<RgbImage, SvgError> {
    let rows = expressions.len().div_ceil(COLUMNS);
    if rows == 0 {
        return Err(SvgError::Size { width: 0.0, height: f64::from(height_px) });
    }
    let high = (height_px / rows as u32).saturating_sub(HEADING_PX).clamp(64, 4096);
    let wide = ((f64::from(high) * WIDE).round() as u32).max(64);
    let options = PictureOptions {
        shown: None,
        most: None,
        turns: vec![0.0],
        title: String::new(),
        view_px: [wide, high],
        // One scale for all, and nothing of any of them cut off.
        within: expressions.iter().flat_map(|(_, p)| p).chain(rest).copied().collect(),
    };
    let columns = expressions.len().min(COLUMNS) as u32;
    let mut sheet = raster::blank(columns * wide, rows as u32 * (high + HEADING_PX), PAPER);
    for (k, (name, positions)) in expressions.iter().enumerate() {
        let one = picture(face, rest, positions, &[], &PictureOptions { title: name.clone(), ..options.clone() })?;
        let [column, row] = [k % COLUMNS, k / COLUMNS].map(|n| n as u32);
        imageops::replace(&mut sheet, &one, i64::from(column * wide), i64::from(row * (high + HEADING_PX)));
    }
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::{Basic, Expression, Setup, Stage};
    use crate::face::generic;

    const HIGH: u32 = 480;

    /// Mean row of the pixels of one column of the sheet, down to a row, that are such a colour, and their number.
    fn found(sheet: &RgbImage, column: u32, down_to: u32, is: impl Fn([i32; 3]) -> bool) -> (f64, usize) {
        let wide = sheet.width() / 3;
        let here = |(x, y): (u32, u32)| is(sheet.get_pixel(column * wide + x, y).0.map(i32::from));
        let all = (HEADING_PX..down_to).flat_map(|y| (0..wide).map(move |x| (x, y)));
        let rows: Vec<f64> = all.filter(|p| here(*p)).map(|(_, y)| f64::from(y)).collect();
        (rows.iter().sum::<f64>() / rows.len().max(1) as f64, rows.len())
    }

    #[test]
    fn eyes_are_seen_brows_rise_and_no_face_is_cut_off() {
        let face = generic();
        let rest = face.mesh().positions();
        let mut stage = Stage::new(&face, rest, &Setup::default()).unwrap();
        let surprise = Expression::basic(Basic::Surprise, &stage.actuators);
        let disgust = Expression::basic(Basic::Disgust, &stage.actuators);
        let moved = stage.equilibria(&[surprise, disgust]).unwrap().into_iter().map(|e| e.positions);
        let all: Vec<_> = [rest.to_vec()].into_iter().chain(moved).map(|p| (String::new(), p)).collect();
        let sheet = plate(&face, rest, &all, HIGH).unwrap();
        assert_eq!(sheet.height(), HIGH);

        // Rows above the mouth, and above the eyes.
        let (nose, lids) = (HIGH * 55 / 100, HIGH * 2 / 5);
        let white = |[r, g, b]: [i32; 3]| r > 170 && r < 248 && r - g < 8 && r - b < 20;
        let pupil = |[r, g, b]: [i32; 3]| r < 30 && g < 30 && b < 30;
        let brow = |[r, g, b]: [i32; 3]| (55..95).contains(&r) && r - g > 10 && r - b > 18 && b > 25;
        for column in 0..3 {
            assert!(found(&sheet, column, nose, pupil).1 > 10, "pupils of face {column}");
        }
        let [at_rest, wide, narrow] = [0, 1, 2].map(|c| found(&sheet, c, nose, white).1);
        assert!(narrow < at_rest && at_rest < wide, "{narrow} {at_rest} {wide}");
        // The brows rise by 8 to 10 mm at some 1.8 px/mm.
        let [at_rest, raised, lowered] = [0, 1, 2].map(|c| found(&sheet, c, lids, brow));
        assert!(at_rest.1 > 100 && raised.1 > 100 && lowered.1 > 100, "{at_rest:?} {raised:?} {lowered:?}");
        assert!(raised.0 < at_rest.0 - 4.0 && lowered.0 > at_rest.0, "{at_rest:?} {raised:?} {lowered:?}");
        let last = sheet.height() - 1;
        assert!((0..sheet.width()).all(|x| sheet.get_pixel(x, last).0 == PAPER));
    }

    #[test]
    fn a_face_without_landmarks_is_drawn_plain() {
        let (_, face, _) = super::super::scene_of_one_triangle();
        let rest = face.mesh().positions();
        assert!(super::super::face_paint::paint(&face, rest).is_none());
        assert!(plate(&face, rest, &[("A".to_owned(), rest.to_vec())], 200).is_ok());
        assert!(plate(&face, rest, &[], 200).is_err());
    }
}
