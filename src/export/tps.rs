//! Marks in the TPS format of geometric morphometrics (tpsDig, geomorph): the two frames as two specimens.
//!
//! Both specimens hold the same points in the same order; x and y are pixels with the origin at the **lower**-left corner
//! of the picture and y upward: `y_tps = height − y`. No half pixel is added or taken: pixel centres stay at +0.5.
//! A point that is not to be had in a frame stands as `-1 -1`, which those programs read as missing.

use std::fmt::Write as _;

use super::csv::state_word;
use super::homologous::points;
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::{FrameRef, Mark, Project, Which};

/// Why a format could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the project names no {} frame, whose size this format needs; choose the frame first", .0.word())]
pub struct NoFrame(pub Which);

/// The TPS text. In the first frame a feature point that no hand has moved stands where the fitted wireframe has it.
///
/// `SCALE=` (mm per px on the view plane) is written only where the scale was measured.
pub fn tps(project: &Project, face: &FaceModel, outcome: &Outcome) -> Result<String, NoFrame> {
    let points = points(project, face, outcome);
    let mut text = String::new();
    for which in [Which::First, Which::Last] {
        let frame = frame_of(project, which)?;
        let height = f64::from(frame.height_px);
        let _ = writeln!(text, "LM={}", points.len());
        for p in &points {
            let seen = |mark: Option<Mark>| mark.filter(|m| m.state.is_data()).map(|m| m.at_px);
            let at = match which {
                // The annotator who leaves a point where the wireframe has it has accepted that place.
                Which::First if p.first.is_none() => Some([p.fitted_in_image.x, p.fitted_in_image.y]),
                Which::First => seen(p.first),
                Which::Last => seen(p.last),
            };
            match at {
                Some([x, y]) => {
                    let _ = writeln!(text, "{x} {}", height - y);
                }
                None => text.push_str("-1 -1\n"),
            }
        }
        let _ = writeln!(text, "IMAGE={}", frame.path);
        let _ = writeln!(text, "ID={}_{}", one_word(&project.name), which.word());
        if outcome.scale_measured {
            let _ = writeln!(text, "SCALE={}", 1.0 / outcome.camera.px_per_mm);
        }
        let names: Vec<String> = points.iter().map(|p| named(&p.name, which, p.first, p.last)).collect();
        let _ = writeln!(text, "COMMENT=points in order: {}", names.join(" "));
    }
    Ok(text)
}

fn named(name: &str, which: Which, first: Option<Mark>, last: Option<Mark>) -> String {
    let state = match if which == Which::First { first } else { last } {
        Some(mark) => state_word(mark.state),
        None if which == Which::First => "fitted",
        None => "unset",
    };
    format!("{name}:{state}")
}

pub(super) fn frame_of(project: &Project, which: Which) -> Result<&FrameRef, NoFrame> {
    let frame = match which {
        Which::First => &project.frames.first,
        Which::Last => &project.frames.last,
    };
    frame.as_ref().ok_or(NoFrame(which))
}

/// A name without the blanks and line ends that would break a line of the format.
fn one_word(name: &str) -> String {
    let word: String =
        name.chars().map(|c| if c.is_whitespace() || c.is_control() || c == '=' { '_' } else { c }).collect();
    if word.is_empty() { "face".to_owned() } else { word }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;

    #[test]
    fn y_is_turned_up_and_both_specimens_have_the_same_points() {
        let (project, face, outcome) = scene_of_one_triangle();
        let text = tps(&project, &face, &outcome).unwrap();
        let expected = "LM=2\n\
            100.5 100\n\
            149 90\n\
            IMAGE=first.png\n\
            ID=One_triangle_first\n\
            SCALE=0.25\n\
            COMMENT=points in order: nose_tip:marked vertex_1:fitted\n\
            LM=2\n\
            104.5 100\n\
            -1 -1\n\
            IMAGE=last.png\n\
            ID=One_triangle_last\n\
            SCALE=0.25\n\
            COMMENT=points in order: nose_tip:uncertain vertex_1:occluded\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_frame_is_needed_for_its_height() {
        let (mut project, face, outcome) = scene_of_one_triangle();
        project.frames.last = None;
        assert_eq!(tps(&project, &face, &outcome), Err(NoFrame(Which::Last)));
    }
}
