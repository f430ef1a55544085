//! Tables as comma-separated text: forces, marks, and the truth of a twin. Columns and units are a contract (`docs/file-formats.md`).
//!
//! Numbers are written with as many digits as bring the very same number back; what is not known is `NaN`, never zero.

use std::fmt::Write as _;

use nalgebra::{Point2, Point3, Vector3};

use crate::doubt::agreement::Difference;
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::{Mark, MarkState, PointId, Project};
use crate::suggest::Suggestion;

/// Header of [`forces`].
pub const FORCES_HEADER: &str = "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,fx_N,fy_N,fz_N,f_N,sigma_N,state";

/// Header of [`marks`].
pub const MARKS_HEADER: &str = "frame,id,name,x_px,y_px,state,sigma_px";

/// Header of [`truth`].
pub const TRUTH_HEADER: &str =
    "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,x0_px,y0_px,x1_px,y1_px,fx_N,fy_N,fz_N,area_mm2,mx_N,my_N,mz_N";

/// Header of [`suggestions`].
pub const SUGGESTIONS_HEADER: &str = "id,name,x_px,y_px,confidence,method,row,col";

/// Suggested places of unmarked vertices in the last frame: `id` is the vertex, `name` that of its landmark or the id of the first
/// region that holds it. `row` and `col` name the crossing of a painted grid and are empty where none is known.
pub fn suggestions(found: &[Suggestion], face: &FaceModel) -> String {
    let mut text = format!("{SUGGESTIONS_HEADER}\n");
    for s in found {
        let landmark = face.landmarks().iter().find(|l| l.vertex == s.vertex).map(|l| l.name.as_str());
        let region = || face.regions().iter().find(|r| r.vertices.contains(&s.vertex)).map(|r| r.id.as_str());
        let name = landmark.or_else(region).unwrap_or_default();
        let _ = write!(text, "{},{}", s.vertex, quoted(name));
        numbers(&mut text, [s.at.x, s.at.y, s.confidence].into_iter());
        let [row, col] = s.crossing.map_or_else(Default::default, |c| c.map(|n| n.to_string()));
        let _ = writeln!(text, ",{},{row},{col}", s.method.word());
    }
    text
}

/// `forces.csv`: one row a vertex; 0 is the first frame (customised), 1 the last (head motion removed).
///
/// Of an unmeasured vertex the last position, the force and its standard error are `NaN`.
pub fn forces(outcome: &Outcome) -> String {
    let mut text = format!("{FORCES_HEADER}\n");
    let rows = outcome.first.iter().zip(&outcome.last).zip(&outcome.states).zip(&outcome.field.force);
    for (v, ((((x0, x1), state), f), sigma)) in rows.zip(&outcome.field.sigma).enumerate() {
        let unknown = !state.is_known();
        let or_nan = |value: f64| if unknown { f64::NAN } else { value };
        let _ = write!(text, "{v}");
        numbers(&mut text, x0.iter().copied());
        numbers(&mut text, x1.iter().map(|&c| or_nan(c)));
        numbers(&mut text, f.iter().map(|&c| or_nan(c)));
        numbers(&mut text, [or_nan(f.norm()), or_nan(*sigma)].into_iter());
        let _ = writeln!(text, ",{}", state.word());
    }
    text
}

/// Every mark of the project: landmarks and feature points of the first frame, then feature points of the last.
///
/// `id` is the landmark's id or the vertex; positions have their origin at the top-left corner of the top-left pixel.
pub fn marks(project: &Project, face: &FaceModel) -> String {
    let mut text = format!("{MARKS_HEADER}\n");
    let mut row = |frame: &str, id: &str, name: &str, mark: &Mark| {
        let _ = write!(text, "{frame},{},{}", quoted(id), quoted(name));
        numbers(&mut text, mark.at_px.into_iter());
        let _ = writeln!(text, ",{},{}", state_word(mark.state), number(project.sigma_px(mark)));
    };
    for (id, mark) in &project.landmarks {
        row("first", id, face.landmark(id).map_or("", |l| &l.name), mark);
    }
    for (vertex, feature) in &project.features {
        if let Some(mark) = &feature.first {
            row("first", &vertex.to_string(), "", mark);
        }
    }
    for (vertex, feature) in &project.features {
        if let Some(mark) = &feature.last {
            row("last", &vertex.to_string(), "", mark);
        }
    }
    text
}

/// Header of [`differences`].
pub const DIFFERENCES_HEADER: &str = "frame,id,a_x_px,a_y_px,b_x_px,b_y_px,dx_px,dy_px,distance_px,a_state,b_state";

/// Points that two projects have marked, the farthest apart first; differences are B − A.
pub fn differences(differences: &[Difference]) -> String {
    let mut text = format!("{DIFFERENCES_HEADER}\n");
    for d in differences {
        let id = match &d.id {
            PointId::Landmark(id) => quoted(id),
            PointId::FeatureFirst(v) | PointId::FeatureLast(v) => v.to_string(),
        };
        let [a, b] = d.marks;
        let _ = write!(text, "{},{id}", d.frame().word());
        let places = a.at_px.into_iter().chain(b.at_px).chain(d.by_px);
        numbers(&mut text, places.chain([d.distance_px()]));
        let _ = writeln!(text, ",{},{}", state_word(a.state), state_word(b.state));
    }
    text
}

/// What is true of one vertex of a twin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthRow {
    /// Position in the first frame, mm.
    pub first: Point3<f64>,
    /// Position in the last frame on the head of the first, mm.
    pub last: Point3<f64>,
    /// Where the first frame shows it, px.
    pub first_in_image: Point2<f64>,
    /// Where the last frame shows it, px.
    pub last_in_image: Point2<f64>,
    /// What holds the skin in its shape, N.
    pub force: Vector3<f64>,
    /// Area of skin at rest that the vertex stands for, mm²: force over area is a traction, 10⁶ N/m² a N/mm².
    pub area_mm2: f64,
    /// The muscles' part of the force, N, where it is known.
    pub muscle: Option<Vector3<f64>>,
}

/// `truth.csv` of a twin: one row a vertex.
pub fn truth(rows: impl IntoIterator<Item = TruthRow>) -> String {
    let mut text = format!("{TRUTH_HEADER}\n");
    for (v, r) in rows.into_iter().enumerate() {
        let _ = write!(text, "{v}");
        numbers(&mut text, r.first.iter().chain(r.last.iter()).copied());
        numbers(&mut text, r.first_in_image.iter().chain(r.last_in_image.iter()).copied());
        let muscle = r.muscle.unwrap_or_else(|| Vector3::repeat(f64::NAN));
        numbers(&mut text, r.force.iter().copied().chain([r.area_mm2]).chain(muscle.iter().copied()));
        text.push('\n');
    }
    text
}

/// The word of a mark's state in files.
pub fn state_word(state: MarkState) -> &'static str {
    match state {
        MarkState::Marked => "marked",
        MarkState::Uncertain => "uncertain",
        MarkState::Occluded => "occluded",
        MarkState::Locked => "locked",
    }
}

/// The shortest digits that bring the same number back; plain zero for the negative one.
fn number(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { value.to_string() }
}

pub(super) fn numbers(text: &mut String, values: impl Iterator<Item = f64>) {
    for value in values {
        text.push(',');
        text.push_str(&number(value));
    }
}

/// A number with five significant digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// A field as RFC 4180 wants it: in quotes where it holds a comma, a quote or a line's end.
pub(super) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;

    #[test]
    fn an_unmeasured_vertex_has_no_force_and_no_last_place() {
        let (_, _, outcome) = scene_of_one_triangle();
        let text = forces(&outcome);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], FORCES_HEADER);
        // 3-4-0 force: length 5.
        assert_eq!(lines[1], "0,0,0,0,1,0,0,3,4,0,5,0.25,measured");
        assert_eq!(lines[3], "2,0,10,0,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,unmeasured");
        assert_eq!(lines.len(), 4);
        assert!(lines.iter().all(|l| l.split(',').count() == 13));
    }

    #[test]
    fn marks_are_listed_by_frame_and_awkward_names_quoted() {
        let (project, face, _) = scene_of_one_triangle();
        let text = marks(&project, &face);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "first,nose_tip,\"Tip, of the \"\"nose\"\"\",100.5,200,marked,1");
        assert_eq!(lines[2], "last,0,,104.5,200,uncertain,1.5");
        assert_eq!(lines[3], "last,1,,150,210,occluded,1");
        assert_eq!(lines.len(), 4);
    }

    #[test]
    fn every_number_comes_back_bit_for_bit() {
        for value in [1.0 / 3.0, 6.02e23, 5e-324, -1.234_567_890_123_456_7e-7, f64::MAX] {
            assert_eq!(number(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(f64::NAN), "NaN");
    }
}
