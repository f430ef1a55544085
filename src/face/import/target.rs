//! MakeHuman's `.target` files: how far some vertices of a mesh are displaced, one a line, `vertex dx dy dz`.

use nalgebra::Vector3;

/// Displacements of some vertices of the mesh that a target belongs to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Target {
    /// Number of the vertex in the mesh's file, from 0, and its displacement in the unit of that file; in ascending order.
    pub moves: Vec<(u32, Vector3<f64>)>,
}

/// Why a target was refused. Lines are counted from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// A line is not `vertex dx dy dz`.
    #[error("line {line}: {reason}")]
    Line {
        /// The line.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// No displacement at all.
    #[error("there is no displacement in it")]
    Empty,
}

/// Reads a target for a mesh of `vertices` vertices. Lines that begin with `#` and empty ones are passed over.
///
/// # Errors
/// A number that is missing, one too many, or not finite; a vertex that the mesh has not, or that stands twice; a file without any.
pub fn read_target(text: &str, vertices: u32) -> Result<Target, TargetError> {
    let mut moves: Vec<(u32, Vector3<f64>)> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for (at, line) in text.lines().enumerate() {
        let refuse = |reason: String| TargetError::Line { line: at + 1, reason };
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.len() != 4 {
            return Err(refuse(format!("{} words; `vertex dx dy dz` are 4", words.len())));
        }
        let vertex: u32 = words[0].parse().map_err(|_| refuse(format!("`{}` is no vertex number", words[0])))?;
        if vertex >= vertices {
            return Err(refuse(format!("vertex {vertex}, but the mesh has only {vertices} vertices")));
        }
        if !seen.insert(vertex) {
            return Err(refuse(format!("vertex {vertex} stands twice")));
        }
        let mut by = Vector3::zeros();
        for (axis, word) in words[1..].iter().enumerate() {
            let number = word.parse::<f64>().ok().filter(|v| v.is_finite());
            by[axis] = number.ok_or_else(|| refuse(format!("`{word}` is not a finite number")))?;
        }
        moves.push((vertex, by));
    }
    if moves.is_empty() {
        return Err(TargetError::Empty);
    }
    moves.sort_by_key(|m| m.0);
    Ok(Target { moves })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_comments_and_short_numbers() {
        let target = read_target("# a brow\n7 0 .25 -1e-2\n\n  2 1 2 3 \r\n", 8).unwrap();
        assert_eq!(target.moves, [(2, Vector3::new(1.0, 2.0, 3.0)), (7, Vector3::new(0.0, 0.25, -0.01))]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let refusal = |text: &str| read_target(text, 8).unwrap_err().to_string();
        assert_eq!(refusal("1 0 0 0\n8 0 0 1\n"), "line 2: vertex 8, but the mesh has only 8 vertices");
        assert_eq!(refusal("1 0 0\n"), "line 1: 3 words; `vertex dx dy dz` are 4");
        assert_eq!(refusal("1 0 0 0 0\n"), "line 1: 5 words; `vertex dx dy dz` are 4");
        assert_eq!(refusal("1 0 nan 0\n"), "line 1: `nan` is not a finite number");
        assert_eq!(refusal("1 0 1e999 0\n"), "line 1: `1e999` is not a finite number");
        assert_eq!(refusal("-1 0 0 0\n"), "line 1: `-1` is no vertex number");
        assert_eq!(refusal("x 0 0 0\n"), "line 1: `x` is no vertex number");
        assert_eq!(refusal("3 0 0 1\n3 0 0 2\n"), "line 2: vertex 3 stands twice");
        assert_eq!(refusal("# nothing\n"), "there is no displacement in it");
    }
}
