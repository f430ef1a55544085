//! Meshes of other programs: Wavefront OBJ in and out.

use std::fmt::Write as _;

use nalgebra::Point3;

use super::{Mesh, MeshError};

/// Why an OBJ text was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObjError {
    /// A line cannot be understood.
    #[error("line {line}: {reason}")]
    Line {
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The parts do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Reads the vertices and faces of an OBJ text; polygons become fans of triangles, everything else is passed over.
///
/// OBJ states no unit: a coordinate times `mm_per_unit` is taken as millimetres.
pub fn read_obj(text: &str, mm_per_unit: f64) -> Result<Mesh, ObjError> {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for (i, text) in text.lines().enumerate() {
        let failed = |reason: String| ObjError::Line { line: i + 1, reason };
        let mut words = text.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some("v") => {
                let mut point = [0.0; 3];
                for (axis, value) in ["x", "y", "z"].into_iter().zip(&mut point) {
                    let word = words.next().ok_or_else(|| failed(format!("the vertex has no {axis}")))?;
                    let number = word.parse::<f64>().ok().filter(|v| v.is_finite());
                    *value = number.ok_or_else(|| failed(format!("{axis} is `{word}`, not a number")))? * mm_per_unit;
                }
                positions.push(Point3::from(point));
            }
            Some("f") => {
                let corners: Vec<u32> =
                    words.map(|word| corner(word, positions.len()).map_err(&failed)).collect::<Result<_, _>>()?;
                if corners.len() < 3 {
                    return Err(failed(format!("the face has {} corners; at least 3 are needed", corners.len())));
                }
                triangles.extend(corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]));
            }
            _ => {}
        }
    }
    Ok(Mesh::new(positions, triangles)?)
}

/// The vertex of one corner (`7`, `7/1/2` or `-1` for the last vertex so far), from 0.
fn corner(word: &str, vertices: usize) -> Result<u32, String> {
    let number = word.split('/').next().and_then(|w| w.parse::<i64>().ok());
    let number = number.ok_or_else(|| format!("the corner is `{word}`, not a vertex number"))?;
    let distance = number.unsigned_abs() as usize;
    let index = if number < 0 { vertices.checked_sub(distance) } else { distance.checked_sub(1) };
    let index = index.filter(|&i| i < vertices).and_then(|i| u32::try_from(i).ok());
    index.ok_or_else(|| format!("the corner names vertex {number}, but {vertices} vertices stand above it"))
}

/// The OBJ text of a mesh at the given positions, mm.
pub fn write_obj(mesh: &Mesh, positions: &[Point3<f64>]) -> String {
    let mut text = String::from("# millimetres; x to the right of the picture, y up, z towards the camera\n");
    for p in positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for [a, b, c] in mesh.triangles() {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quad_becomes_a_fan_and_units_become_millimetres() {
        let text = "# cm\nv 0 0 0\nv 1 0 0 1.0\nvt 0 0\nv 1 1 0\nv 0 1 0.5 # raised\ns off\nf 1/1/1 2//2 -2 4\n";
        let mesh = read_obj(text, 10.0).unwrap();
        assert_eq!(mesh.triangles(), &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions()[3], Point3::new(0.0, 10.0, 5.0));
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        let face = crate::face::generic();
        let text = write_obj(face.mesh(), face.mesh().positions());
        assert_eq!(&read_obj(&text, 1.0).unwrap(), face.mesh());
    }

    #[test]
    fn bad_lines_are_refused_with_their_number() {
        let refusal = |text: &str| read_obj(text, 1.0).unwrap_err().to_string();
        assert_eq!(refusal("v 0 0\n"), "line 1: the vertex has no z");
        assert_eq!(refusal("\nv 0 x 0\n"), "line 2: y is `x`, not a number");
        assert_eq!(refusal("v 0 0 nan\n"), "line 1: z is `nan`, not a number");
        assert_eq!(refusal("v 0 0 0\nf 1 1\n"), "line 2: the face has 2 corners; at least 3 are needed");
        assert_eq!(refusal("v 0 0 0\nf 1 2 3\n"), "line 2: the corner names vertex 2, but 1 vertices stand above it");
        assert_eq!(refusal("v 0 0 0\nf 0 1 1\n"), "line 2: the corner names vertex 0, but 1 vertices stand above it");
        assert_eq!(refusal("v 0 0 0\nf a 1 1\n"), "line 2: the corner is `a`, not a vertex number");
        assert!(refusal("").contains("0 vertices and 0 triangles"));
    }
}
