//! The last frame with what was simulated over it: the wireframe where the muscles bring it, and every measured point with its distance
//! from where it was seen.

use std::fmt::Write as _;

use image::{RgbImage, imageops};
use nalgebra::Point2;

use super::replay::{both, furthest};
use crate::draw::ColourMap;
use crate::draw::line_chart::{HEADING, sheet};
use crate::draw::numbers::{fixed, significant};
use crate::draw::robust_range::{robust_largest, round_up};
use crate::draw::svg::{self, SvgError};
use crate::face::FaceModel;
use crate::muscle_field::replay::{Replay, Spread};
use crate::pipeline::Outcome;

/// Longest side of the frame in the picture, px; larger frames are made smaller.
const LONGEST_PX: f64 = 1600.0;
/// Narrowest picture: the heading and the legend need so much, px.
const NARROWEST_PX: f64 = 1000.0;
/// Room for the legend, px.
const LEGEND_PX: f64 = 52.0;
/// Stripes of the colour bar.
const STRIPES: usize = 48;

/// The distance at the end of the colours, mm: a round number that holds those of a replay under the muscles found.
pub fn end_of_colours_mm(replay: &Replay) -> f64 {
    round_up(robust_largest(replay.of_muscles.distance_mm.iter().copied()))
}

/// The colour of a distance, as drawings name it.
fn colour(mm: f64, most_mm: f64) -> String {
    let [r, g, b] = ColourMap::Viridis.of(Some(mm), [0.0, most_mm]);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Draws it.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted, and for a frame without pixels.
pub fn picture(
    last_frame: &RgbImage,
    face: &FaceModel,
    outcome: &Outcome,
    replay: &Replay,
) -> Result<RgbImage, SvgError> {
    let [width, height] = [last_frame.width(), last_frame.height()].map(f64::from);
    let scale = (LONGEST_PX / width.max(height).max(1.0)).min(1.0);
    let [wide, high] = [width, height].map(|n| (n * scale).round().max(1.0));
    let mut frame = imageops::resize(last_frame, wide as u32, high as u32, imageops::FilterType::Triangle);
    let most_mm = end_of_colours_mm(replay);
    svg::paint_over(&overlay([wide, high], scale, face, outcome, replay, most_mm), &mut frame)?;

    let whole = [wide.max(NARROWEST_PX), HEADING + high + LEGEND_PX];
    let words = format!(
        "{} points went {} px and lie under the muscles found {} from where they were seen (root mean squares), {}",
        replay.points.len(),
        fixed(Spread::of(&replay.motion_px).rms, 2),
        both(&replay.of_muscles, |s| s.rms),
        furthest(replay, &replay.of_muscles)
    );
    let drawn = sheet(whole, "Simulated over the last frame", &words, &[legend(HEADING + high + 30.0, most_mm)]);
    let mut picture = svg::paint(&drawn, 1.0)?;
    imageops::replace(&mut picture, &frame, ((whole[0] - wide) / 2.0) as i64, HEADING as i64);
    Ok(picture)
}

/// What lies over the frame.
fn overlay(
    [wide, high]: [f64; 2],
    scale: f64,
    face: &FaceModel,
    outcome: &Outcome,
    replay: &Replay,
    most_mm: f64,
) -> String {
    let simulated = &replay.of_muscles;
    let at = |p: &Point2<f64>| [fixed(scale * p.x, 1), fixed(scale * p.y, 1)];
    let finite = |p: &Point2<f64>| p.coords.iter().all(|c| c.is_finite());
    let mut out = format!(r#"<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}">"#);
    let mut path = String::new();
    for edge in face.mesh().edges() {
        let ends = edge.map(|v| simulated.in_image[v as usize]);
        if ends.iter().all(finite) {
            let [[x1, y1], [x2, y2]] = [at(&ends[0]), at(&ends[1])];
            let _ = write!(path, "M{x1} {y1}L{x2} {y2}");
        }
    }
    let _ = write!(out, r##"<path d="{path}" stroke="#ffffff" stroke-opacity="0.5" stroke-width="0.8" fill="none"/>"##);
    for (&v, &mm) in replay.points.iter().zip(&simulated.distance_mm) {
        let (seen, there) = (outcome.last_in_image[v as usize], simulated.in_image[v as usize]);
        if !(finite(&seen) && finite(&there)) {
            continue;
        }
        let ([x1, y1], [x2, y2], colour) = (at(&seen), at(&there), colour(mm, most_mm));
        for (stroke, width) in [("#101014", 4.2), (colour.as_str(), 2.4)] {
            let _ = write!(
                out,
                r#"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{stroke}" stroke-width="{width}"/>"#
            );
        }
        let _ = write!(
            out,
            r##"<circle cx="{x2}" cy="{y2}" r="3.2" fill="{colour}" stroke="#101014" stroke-width="1"/><circle cx="{x1}" cy="{y1}" r="2" fill="#ffffff" stroke="#101014" stroke-width="0.8"/>"##
        );
    }
    out.push_str("</svg>");
    out
}

/// The colour bar with its ends, and what the marks are.
fn legend(y: f64, most_mm: f64) -> String {
    let mut out = String::new();
    let stripe = 4.0;
    for k in 0..STRIPES {
        let colour = colour((k as f64 + 0.5) / STRIPES as f64, 1.0);
        let x = 20.0 + stripe * k as f64;
        let _ = write!(out, r#"<rect x="{x}" y="{}" width="{}" height="12" fill="{colour}"/>"#, y - 10.0, stripe + 0.5);
    }
    let right = 20.0 + stripe * STRIPES as f64;
    let marks = right + 190.0;
    let _ = write!(
        out,
        r##"<text x="{}" y="{y}">0 to {} mm along the skin</text><circle cx="{marks}" cy="{2}" r="2.4" fill="#ffffff" stroke="#101014"/><text x="{3}" y="{y}">seen</text><circle cx="{4}" cy="{2}" r="3.6" fill="#21908d" stroke="#101014"/><text x="{5}" y="{y}">simulated</text><text x="{6}" y="{y}" fill="#777">light lines: simulated wireframe</text>"##,
        right + 8.0,
        significant(most_mm, 3),
        y - 4.0,
        marks + 10.0,
        marks + 60.0,
        marks + 70.0,
        marks + 150.0
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle_field::replay::Simulated;
    use crate::simulate::Ended;

    /// Two points of a frame of 400 × 300 px, seen at their marks, simulated 40 px to the right of them: 10 mm at 4 px/mm. On the row
    /// of each point the picture has the frame's grey outside and the colour of the largest distance halfway between the two.
    #[test]
    fn every_point_has_a_line_of_its_distance_s_colour_from_where_it_was_seen() {
        let (_, face, outcome) = crate::export::scene_of_one_triangle();
        let points = vec![0, 1];
        let apart = |p: &Point2<f64>| Point2::new(p.x + 40.0, p.y);
        let simulated = Simulated {
            positions: outcome.last.clone(),
            in_image: outcome.last_in_image.iter().map(apart).collect(),
            distance_px: vec![40.0, 40.0],
            distance_mm: vec![10.0, 10.0],
            ended: Ended::Converged,
            folded: 0,
        };
        let replay = Replay {
            points: points.clone(),
            motion_mm: vec![1.0, 2.0],
            motion_px: vec![4.0, 8.0],
            of_forces: simulated.clone(),
            of_muscles: simulated,
        };
        assert_eq!(end_of_colours_mm(&replay), 10.0);
        assert_eq!(Spread::of(&[3.0, 4.0, 0.0]).largest, 4.0);
        let grey = RgbImage::from_pixel(400, 300, image::Rgb([90; 3]));
        let drawn = picture(&grey, &face, &outcome, &replay).unwrap();
        let left = (f64::from(drawn.width()) - 400.0) / 2.0;
        for v in points {
            let seen = outcome.last_in_image[v as usize];
            let at = |dx: f64| {
                let [x, y] = [left + seen.x + dx, HEADING + seen.y].map(|c| c as u32);
                drawn.get_pixel(x, y).0
            };
            assert_eq!(at(20.0), ColourMap::Viridis.at(1.0), "halfway between the two places of vertex {v}");
            assert_eq!(at(0.0), [255; 3], "where it was seen");
            assert_eq!(at(-12.0), [90; 3], "outside");
        }
        assert!(picture(&RgbImage::new(0, 0), &face, &outcome, &replay).is_ok(), "a frame without pixels is no panic");
    }
}
