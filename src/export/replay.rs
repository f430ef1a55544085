//! Simulated against seen as files: `replay.csv`, and a drawing of both over the face in the last frame.

use std::fmt::Write as _;

use nalgebra::Point2;

use super::csv::numbers;
use crate::draw::line_chart::{COLOURS, sheet};
use crate::draw::numbers::{fixed, significant};
use crate::face::FaceModel;
use crate::muscle_field::replay::{Replay, Simulated, Spread};
use crate::pipeline::Outcome;

/// Header of [`replay_csv`].
pub const REPLAY_HEADER: &str = "vertex,seen_x_px,seen_y_px,simulated_x_px,simulated_y_px,distance_px,distance_mm,motion_px,motion_mm,forces_distance_px,forces_distance_mm";

/// One row a measured point: where it was seen, where the muscles bring it, and how far from there the measured forces do.
pub fn replay_csv(outcome: &Outcome, replay: &Replay) -> String {
    let mut text = format!("{REPLAY_HEADER}\n");
    for (k, &v) in replay.points.iter().enumerate() {
        let (seen, there) = (outcome.last_in_image[v as usize], replay.of_muscles.in_image[v as usize]);
        let (muscles, forces) = (&replay.of_muscles, &replay.of_forces);
        let row = [
            seen.x,
            seen.y,
            there.x,
            there.y,
            muscles.distance_px[k],
            muscles.distance_mm[k],
            replay.motion_px[k],
            replay.motion_mm[k],
            forces.distance_px[k],
            forces.distance_mm[k],
        ];
        let _ = write!(text, "{v}");
        numbers(&mut text, row.into_iter());
        text.push('\n');
    }
    text
}

/// What came out, in a few sentences.
pub fn in_words(replay: &Replay) -> String {
    let one = |what: &str, s: &Simulated| {
        let doubt = Replay::doubt(s).map_or_else(String::new, |words| format!(" {words}"));
        format!(
            "{what} bring the points to {} of where they were seen, {}; that is {} % of the motion.{doubt}",
            both(s, |spread| spread.rms),
            furthest(replay, s),
            fixed(100.0 * replay.explained(s).max(-9.99), 0)
        )
    };
    let [px, mm] = [&replay.motion_px, &replay.motion_mm].map(|list| fixed(Spread::of(list).rms, 2));
    format!(
        "The points went {px} px ({mm} mm), root mean square. {} {}",
        one("The muscles found", &replay.of_muscles),
        one("The measured forces themselves", &replay.of_forces)
    )
}

/// "on average 1.20 px (0.30 mm), at most 4.00 px (1.00 mm) at vertex 7".
pub fn furthest(replay: &Replay, simulated: &Simulated) -> String {
    let at = replay.worst(simulated).map_or_else(String::new, |v| format!(" at vertex {v}"));
    format!("on average {}, at most {}{at}", both(simulated, |s| s.mean), both(simulated, |s| s.largest))
}

/// "1.20 px (0.30 mm)": one number of the distances in the picture, and of those along the skin.
pub fn both(simulated: &Simulated, number: impl Fn(Spread) -> f64) -> String {
    let [px, mm] = [&simulated.distance_px, &simulated.distance_mm].map(|list| fixed(number(Spread::of(list)), 2));
    format!("{px} px ({mm} mm)")
}

/// Pixels of the drawing.
const WIDTH: f64 = 760.0;
/// Room for the heading and for the legend.
const TOP: f64 = 70.0;

/// The last frame's wireframe with each measured point where it was in the first frame, where it was seen and where the muscles bring it.
pub fn replay_svg(face: &FaceModel, outcome: &Outcome, replay: &Replay) -> String {
    let places = &outcome.last_in_image;
    let (mut low, mut high) = (Point2::from([f64::INFINITY; 2]), Point2::from([f64::NEG_INFINITY; 2]));
    for p in places.iter().chain(&replay.of_muscles.in_image).filter(|p| p.coords.iter().all(|c| c.is_finite())) {
        (low, high) = (low.inf(p), high.sup(p));
    }
    let size = high - low;
    let scale = (WIDTH - 40.0) / size.x.max(1e-9);
    let at = |p: &Point2<f64>| [20.0 + scale * (p.x - low.x), TOP + scale * (p.y - low.y)];
    let mut drawn = String::new();
    let line = |drawn: &mut String, [a, b]: [[f64; 2]; 2], style: &str| {
        let [x1, y1, x2, y2] = [a[0], a[1], b[0], b[1]].map(|c| fixed(c, 1));
        let _ = write!(drawn, r#"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" {style}/>"#);
    };
    for &[a, b] in face.mesh().edges() {
        let ends = [a, b].map(|i| at(&places[i as usize]));
        line(&mut drawn, ends, r##"stroke="#d4d4d4" stroke-width="0.6""##);
    }
    let motion = &outcome.head.motion;
    for &v in &replay.points {
        let start = outcome.camera.image_from_face(&motion.last_from_first(&outcome.first[v as usize]));
        let (seen, there) = (at(&places[v as usize]), at(&replay.of_muscles.in_image[v as usize]));
        line(&mut drawn, [at(&start), seen], r##"stroke="#9a9a9a" stroke-width="1""##);
        line(&mut drawn, [seen, there], &format!(r#"stroke="{}" stroke-width="1.2""#, COLOURS[1]));
        let [sx, sy, tx, ty] = [seen[0], seen[1], there[0], there[1]].map(|c| fixed(c, 1));
        let _ = write!(drawn, r#"<circle cx="{sx}" cy="{sy}" r="2.2" fill="{}"/>"#, COLOURS[0]);
        let _ = write!(
            drawn,
            r#"<circle cx="{tx}" cy="{ty}" r="3" fill="none" stroke="{}" stroke-width="1.4"/>"#,
            COLOURS[1]
        );
    }
    let bottom = TOP + scale * size.y + 28.0;
    let legend = [
        (
            20.0,
            "seen in the last frame",
            format!(r#"<circle cx="26" cy="{}" r="2.6" fill="{}"/>"#, bottom - 4.0, COLOURS[0]),
        ),
        (
            230.0,
            "where the muscles bring it",
            format!(
                r#"<circle cx="236" cy="{}" r="3.4" fill="none" stroke="{}" stroke-width="1.4"/>"#,
                bottom - 4.0,
                COLOURS[1]
            ),
        ),
        (
            460.0,
            "way from the first frame, head motion left out",
            format!(
                r##"<line x1="460" y1="{0}" x2="474" y2="{0}" stroke="#9a9a9a" stroke-width="1.4"/>"##,
                bottom - 4.0
            ),
        ),
    ];
    for (x, words, mark) in legend {
        drawn.push_str(&mark);
        let _ = write!(drawn, r##"<text x="{}" y="{bottom}" font-size="12" fill="#333">{words}</text>"##, x + 20.0);
    }
    let circumstances = format!(
        "{} points; {} px apart on the whole (root mean square), where they went {} px",
        replay.points.len(),
        significant(Spread::of(&replay.of_muscles.distance_px).rms, 3),
        significant(Spread::of(&replay.motion_px).rms, 3)
    );
    sheet([WIDTH, bottom + 20.0], "Simulated against seen", &circumstances, &[drawn])
}
