//! The rim of a face: the border of its skin that is not an eye, a nostril or the mouth.

use nalgebra::Point3;

use crate::face::Mesh;
use crate::face::mesh::NONE;

/// Whether each vertex lies on the longest border of the mesh: where the skin goes on, over head and neck. All false on a closed
/// mesh.
pub fn rim(mesh: &Mesh, positions: &[Point3<f64>]) -> Vec<bool> {
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); mesh.len()];
    for (&[a, b], sides) in mesh.edges().iter().zip(mesh.triangles_of_edge()) {
        if sides[1] == NONE {
            beside[a as usize].push(b);
            beside[b as usize].push(a);
        }
    }
    let mut seen = vec![false; mesh.len()];
    let mut longest = (0.0, Vec::new());
    for start in 0..mesh.len() {
        if seen[start] || beside[start].is_empty() {
            continue;
        }
        seen[start] = true;
        let (mut piece, mut next, mut length) = (Vec::new(), vec![start], 0.0);
        while let Some(i) = next.pop() {
            piece.push(i);
            for &j in &beside[i] {
                // Every edge is met from both ends.
                length += 0.5 * (positions[i] - positions[j as usize]).norm();
                if !std::mem::replace(&mut seen[j as usize], true) {
                    next.push(j as usize);
                }
            }
        }
        if length > longest.0 {
            longest = (length, piece);
        }
    }
    let mut rim = vec![false; mesh.len()];
    for i in longest.1 {
        rim[i] = true;
    }
    rim
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    /// The generic face has four borders: two eyes, the mouth, and the rim, which alone reaches the hairline and the chin.
    #[test]
    fn the_rim_of_the_generic_face_is_its_outline() {
        let face = face::generic();
        let mesh = face.mesh();
        let rim = rim(mesh, mesh.positions());
        let border = mesh.on_border();
        let on =
            |p: &dyn Fn(&Point3<f64>) -> bool| (0..mesh.len()).filter(|&i| p(&mesh.positions()[i])).collect::<Vec<_>>();
        assert!(on(&|p| p.y > 73.0 || p.y < -105.0).iter().any(|&i| rim[i]));
        // Around the eyes and the mouth there is a border that is no rim.
        let middle = on(&|p| p.x.abs() < 50.0 && p.y.abs() < 15.0 || p.x.abs() < 30.0 && (p.y + 69.0).abs() < 12.0);
        assert!(middle.iter().all(|&i| !rim[i]) && middle.iter().any(|&i| border[i]));
        assert!(rim.iter().zip(&border).all(|(r, b)| !r || *b));
    }
}
