//! Where a sheet has buckled: edges at which its two triangles stand at quite another angle than at rest.

use nalgebra::Point3;

use super::options::Hold;
use crate::face::Mesh;
use crate::face::mesh::{NONE, doubled_area_vector};

/// Angle between two triangles that is no bending of skin any more, rad: 60°.
pub const CREASE_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Edges whose angle differs from that at rest by more than [`CREASE_RAD`], and by how much (rad), the worst first.
///
/// Springs along edges do not resist bending, and the mirror image of a face costs them nothing: a mesh without a skull turns
/// inside out under small forces (`docs/errata.md`). A dent shows here first, at its rim.
pub fn creases(mesh: &Mesh, rest: &[Point3<f64>], x: &[Point3<f64>]) -> Vec<(u32, f64)> {
    let mut found: Vec<(u32, f64)> = (0..mesh.edges().len() as u32)
        .filter_map(|e| {
            let turned = angle(mesh, e, x)? - angle(mesh, e, rest)?;
            let turned = turned.sin().atan2(turned.cos()).abs();
            (turned > CREASE_RAD).then_some((e, turned))
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found
}

/// What creases there are, and what they mean and what to change; nothing without any.
pub fn in_words(mesh: &Mesh, found: &[(u32, f64)], hold: Hold) -> Option<[String; 2]> {
    let (worst, angle) = found.first()?;
    let [a, b] = mesh.edges().get(*worst as usize)?;
    let (bent, most) = (CREASE_RAD.to_degrees(), angle.to_degrees());
    let what = match found.len() {
        1 => format!("The edge between vertices {a} and {b} is bent by {most:.0}°"),
        n => format!("{n} edges are bent by more than {bent:.0}°, worst {a}–{b}: {most:.0}°"),
    };
    let advice = match hold {
        Hold::Bare => {
            "The sheet has buckled: springs along edges do not resist bending. Let it slide on the skull, or anchor it."
        }
        Hold::Anchors(_) => "The skin has buckled between its anchors. Let it slide on the skull, or pull less.",
        Hold::Skull => {
            "The skin folds there more finely than the mesh can show. Pull less, open the jaw less, or take a finer mesh."
        }
    };
    Some([what, advice.to_owned()])
}

/// Signed angle between the normals of an edge's triangles, rad: 0 where they are flat, positive in a valley.
fn angle(mesh: &Mesh, edge: u32, x: &[Point3<f64>]) -> Option<f64> {
    let [s, t] = mesh.triangles_of_edge()[edge as usize];
    if t == NONE {
        return None;
    }
    let [a, b] = mesh.edges()[edge as usize];
    let normal = |t: u32| doubled_area_vector(x, mesh.triangles()[t as usize]).try_normalize(1e-12);
    let (n, m) = (normal(s)?, normal(t)?);
    let along = (x[b as usize] - x[a as usize]).try_normalize(1e-12)?;
    // The triangle that runs from a to b is the one on the left.
    let corners = mesh.triangles()[s as usize];
    let forward = (0..3).any(|c| corners[c] == a && corners[(c + 1) % 3] == b);
    let (left, right) = if forward { (n, m) } else { (m, n) };
    Some(-left.cross(&right).dot(&along).atan2(left.dot(&right)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles folded up by 90° about their common edge: a valley of π/2.
    #[test]
    fn a_right_angle_by_hand() {
        let flat: Vec<Point3<f64>> =
            [[0.0, 0.0], [0.0, 2.0], [-1.0, 1.0], [1.0, 1.0]].map(|p| Point3::new(p[0], p[1], 0.0)).to_vec();
        let mesh = Mesh::new(flat.clone(), vec![[0, 1, 2], [1, 0, 3]]).unwrap();
        let mut up = flat.clone();
        up[3] = Point3::new(0.0, 1.0, 1.0);
        let found = creases(&mesh, &flat, &up);
        assert_eq!(found.len(), 1);
        assert!((found[0].1 - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((angle(&mesh, found[0].0, &up).unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let [what, advice] = in_words(&mesh, &found, Hold::Bare).unwrap();
        assert_eq!(what, "The edge between vertices 0 and 1 is bent by 90°");
        assert!(advice.contains("skull"));
        up[3] = Point3::new(0.9, 1.0, 0.4);
        assert!(creases(&mesh, &flat, &up).is_empty());
        assert!(in_words(&mesh, &[], Hold::Skull).is_none());
    }
}
