//! The fitted face as a Wavefront OBJ mesh, mm.

use std::fmt::Write as _;

use nalgebra::Point3;

use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::Which;

/// The OBJ text of the customised face in the first frame, or of the skin in the last (head motion removed).
///
/// In the last frame a vertex of which nothing is known stands at its predicted place; a comment lists those vertices.
pub fn obj(face: &FaceModel, outcome: &Outcome, which: Which) -> String {
    let mut text = format!("# {} in the {} frame\n", one_line(face.name()), which.word());
    let positions = match which {
        Which::First => &outcome.first,
        Which::Last => {
            let unknown: Vec<String> = outcome
                .states
                .iter()
                .enumerate()
                .filter(|(_, s)| !s.is_known())
                .map(|(v, _)| (v + 1).to_string())
                .collect();
            if !unknown.is_empty() {
                let _ = writeln!(text, "# predicted, not measured (counted from 1): {}", unknown.join(" "));
            }
            &outcome.last
        }
    };
    surface(&mut text, positions, face.mesh().triangles());
    text
}

/// Adds a surface to the text, mm; vertices count from 1.
pub(super) fn surface(text: &mut String, positions: &[Point3<f64>], triangles: &[[u32; 3]]) {
    text.push_str("# millimetres; x to the right of the picture, y up, z towards the camera\n");
    for p in positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for [a, b, c] in triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
}

pub(super) fn one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;

    #[test]
    fn vertices_count_from_one_and_predictions_are_named() {
        let (_, face, outcome) = scene_of_one_triangle();
        let first = obj(&face, &outcome, Which::First);
        assert!(first.ends_with("v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n"), "{first}");
        let last = obj(&face, &outcome, Which::Last);
        assert!(last.contains("# predicted, not measured (counted from 1): 3\n"), "{last}");
        assert!(last.ends_with("v 1 0 0\nv 11 0 0\nv 0.5 10 0\nf 1 2 3\n"), "{last}");
    }
}
