//! Wavefront OBJ: vertices, polygons and groups in, triangles out.

use std::fmt::Write as _;

use nalgebra::Point3;

use super::{ImportError, Soup, polygon};
use crate::face::Mesh;

/// Reads the vertices and faces of an OBJ text, of all groups or of those named; materials, textures, normals, curves and lines
/// are passed over.
pub(super) fn parse(text: &str, groups: &[String]) -> Result<Soup, ImportError> {
    let mut soup = Soup::default();
    let mut found: Vec<String> = Vec::new();
    let mut wanted = groups.is_empty();
    let mut corners = Vec::new();
    for (line, text) in logical_lines(text) {
        let failed = |reason: String| ImportError::Line { line, reason };
        let mut words = text.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some("v") => {
                let mut point = [0.0; 3];
                for (axis, value) in ["x", "y", "z"].into_iter().zip(&mut point) {
                    let word = words.next().ok_or_else(|| failed(format!("the vertex has no {axis}")))?;
                    let number = word.parse::<f64>().ok().filter(|v| v.is_finite());
                    *value = number.ok_or_else(|| failed(format!("{axis} is `{word}`, not a number")))?;
                }
                soup.positions.push(Point3::from(point));
            }
            Some("f") => {
                corners.clear();
                for word in words {
                    corners.push(corner(word, soup.positions.len()).map_err(&failed)?);
                }
                if !(3..=polygon::MOST_CORNERS).contains(&corners.len()) {
                    let wanted = if corners.len() < 3 { "at least 3 are needed" } else { "at most 1000 are read" };
                    return Err(failed(format!("the face has {} corners; {wanted}", corners.len())));
                }
                if wanted && !polygon::cut(&corners, &soup.positions, &mut soup.triangles) {
                    soup.crossed_polygons += 1;
                }
            }
            Some("g") if !groups.is_empty() => {
                let names: Vec<&str> = words.collect();
                wanted = names.iter().any(|n| groups.iter().any(|g| g == n));
                for name in names {
                    if found.len() < 1000 && !found.iter().any(|f| f == name) {
                        found.push(name.to_owned());
                    }
                }
            }
            _ => {}
        }
    }
    if let Some(name) = groups.iter().find(|g| !found.contains(g)) {
        found.truncate(8);
        let found = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
        return Err(ImportError::NoGroup { name: name.clone(), found });
    }
    Ok(soup)
}

/// Lines with the number of their first one; a backslash at the end continues a line.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let Some(begun) = first.trim_end().strip_suffix('\\') else { return Some((number + 1, first.into())) };
        let mut whole = begun.to_owned();
        for (_, next) in lines.by_ref() {
            whole.push(' ');
            if let Some(more) = next.trim_end().strip_suffix('\\') {
                whole.push_str(more);
            } else {
                whole.push_str(next);
                break;
            }
        }
        Some((number + 1, whole.into()))
    })
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

    fn read(text: &str) -> Soup {
        parse(text, &[]).unwrap()
    }

    #[test]
    fn a_quad_becomes_two_triangles_and_the_rest_is_passed_over() {
        let text = "# cm\nmtllib a.mtl\no face\nv 0 0 0\nv 1 0 0 1.0\nvt 0 0\nv 1 1 0\nv 0 1 0.5 # raised\ns off\nusemtl skin\nf 1/1/1 2//2 \\\n -2 4\nl 1 2\n";
        let soup = read(text);
        assert_eq!(soup.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(soup.positions[3], Point3::new(0.0, 1.0, 0.5));
    }

    #[test]
    fn only_the_groups_asked_for_are_read() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng body skin\nf 1 2 3\ng helper\nf 1 3 4\n";
        assert_eq!(read(text).triangles.len(), 2);
        assert_eq!(parse(text, &["skin".to_owned()]).unwrap().triangles, [[0, 1, 2]]);
        let refused = parse(text, &["head".to_owned()]).unwrap_err().to_string();
        assert_eq!(refused, "there is no group `head`; the file has body, skin, helper");
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        let face = crate::face::generic();
        let soup = read(&write_obj(face.mesh(), face.mesh().positions()));
        assert_eq!(
            (soup.positions.as_slice(), soup.triangles.as_slice()),
            (face.mesh().positions(), face.mesh().triangles())
        );
    }

    #[test]
    fn bad_lines_are_refused_with_their_number() {
        let refusal = |text: &str| parse(text, &[]).unwrap_err().to_string();
        assert_eq!(refusal("v 0 0\n"), "line 1: the vertex has no z");
        assert_eq!(refusal("\nv 0 x 0\n"), "line 2: y is `x`, not a number");
        assert_eq!(refusal("v 0 0 nan\n"), "line 1: z is `nan`, not a number");
        assert_eq!(refusal("v 0 0 -1e999\n"), "line 1: z is `-1e999`, not a number");
        assert_eq!(refusal("v 0 0 0\nf 1 1\n"), "line 2: the face has 2 corners; at least 3 are needed");
        assert_eq!(refusal("v 0 0 0\nf 1 2 3\n"), "line 2: the corner names vertex 2, but 1 vertices stand above it");
        assert_eq!(refusal("v 0 0 0\nf 0 1 1\n"), "line 2: the corner names vertex 0, but 1 vertices stand above it");
        assert_eq!(refusal("v 0 0 0\nf 1 1 -2\n"), "line 2: the corner names vertex -2, but 1 vertices stand above it");
        assert_eq!(refusal("v 0 0 0\nf a 1 1\n"), "line 2: the corner is `a`, not a vertex number");
        assert!(refusal(&format!("v 0 0 0\nf{}\n", " 1".repeat(1001))).contains("1001 corners; at most 1000"));
    }
}
