//! The height map as a surface in face space: what is known stands up from its base, the rest of the face lies flat.
//!
//! A triangle is raised only where all three corners are known. So nothing slopes down from a measured force to a place where nobody
//! measured: the field ends in a cliff, and beyond it there is no number to read.

use nalgebra::{Point3, Vector3};

use crate::face::mesh::{Mesh, NONE, doubled_area_vector};

/// What the heights stand on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Relief {
    /// A plane: x and y of the face, the value as z.
    #[default]
    Plane,
    /// The face itself, raised by the value.
    Face,
    /// The face itself, coloured but not raised.
    FaceColoured,
}

impl Relief {
    /// In the order of the chooser.
    pub const ALL: [Self; 3] = [Self::Plane, Self::Face, Self::FaceColoured];

    /// Words of the chooser.
    pub fn label(self) -> &'static str {
        match self {
            Self::Plane => "Heights over a plane",
            Self::Face => "Heights over the face",
            Self::FaceColoured => "Colours on the face",
        }
    }
}

/// The surface, ready to be projected.
#[derive(Clone, Debug)]
pub struct Surface {
    /// What it stands on.
    pub relief: Relief,
    /// Foot of each vertex, mm.
    pub base: Vec<Point3<f64>>,
    /// Head of each vertex, mm; its foot where nothing is known.
    pub top: Vec<Point3<f64>>,
    /// Whether each triangle carries data at all three corners.
    pub raised: Vec<bool>,
    /// Unit normals of the raised part.
    pub top_normals: Vec<Vector3<f64>>,
    /// Unit normals of the base.
    pub base_normals: Vec<Vector3<f64>>,
    /// Edges (by number) at which the raised part ends.
    pub rim: Vec<u32>,
}

impl Surface {
    /// Builds the surface of `values` over `first` (x, y, z of the face, mm); `mm_per_unit` is the exaggeration.
    pub fn new(mesh: &Mesh, first: &[Point3<f64>], values: &[Option<f64>], mm_per_unit: f64, relief: Relief) -> Self {
        let foot = |p: &Point3<f64>| if relief == Relief::Plane { Point3::new(p.x, p.y, 0.0) } else { *p };
        let positions = if first.len() == mesh.len() { first } else { mesh.positions() };
        let base: Vec<_> = positions.iter().map(foot).collect();
        let lift = if relief == Relief::FaceColoured { 0.0 } else { mm_per_unit };
        let known = |v: u32| values.get(v as usize).copied().flatten();
        let top: Vec<_> =
            base.iter().zip(0..).map(|(p, v)| p + Vector3::new(0.0, 0.0, known(v).unwrap_or(0.0) * lift)).collect();
        let raised: Vec<bool> = mesh.triangles().iter().map(|t| t.iter().all(|&v| known(v).is_some())).collect();
        let is_raised = |t: u32| t != NONE && raised[t as usize];
        let rim = mesh
            .triangles_of_edge()
            .iter()
            .zip(0..)
            .filter(|(sides, _)| is_raised(sides[0]) != is_raised(sides[1]))
            .map(|(_, edge)| edge)
            .collect();
        let top_normals = normals(&top, mesh.triangles().iter().zip(&raised).filter(|(_, r)| **r).map(|(t, _)| *t));
        let base_normals = if relief == Relief::Plane {
            vec![Vector3::z(); base.len()]
        } else {
            normals(&base, mesh.triangles().iter().copied())
        };
        Self { relief, base, top, raised, top_normals, base_normals, rim }
    }

    /// The points that a view must hold: feet and heads of `vertices`, heads no higher than `most_mm` over their feet, so that one
    /// wild value does not make all the rest small.
    pub fn extent(
        &self,
        vertices: impl Iterator<Item = usize> + Clone,
        most_mm: f64,
    ) -> impl Iterator<Item = Point3<f64>> + Clone {
        vertices.flat_map(move |v| {
            let (base, top) = (self.base[v], self.top[v]);
            [base, Point3::new(top.x, top.y, base.z + (top.z - base.z).clamp(-most_mm, most_mm))]
        })
    }
}

fn normals(positions: &[Point3<f64>], triangles: impl Iterator<Item = [u32; 3]>) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); positions.len()];
    for t in triangles {
        let doubled_area = doubled_area_vector(positions, t);
        for v in t {
            normals[v as usize] += doubled_area;
        }
    }
    for n in &mut normals {
        *n = n.try_normalize(1e-12).unwrap_or_else(Vector3::z);
    }
    normals
}

/// A straight piece inside a triangle: barycentric coordinates of its two ends.
pub type Piece = [[f64; 3]; 2];

/// Where a scalar given at a triangle's corners takes a value: the piece of the level line, if it crosses the triangle.
pub fn level_piece(corners: [f64; 3], level: f64) -> Option<Piece> {
    let mut ends = [[0.0; 3]; 2];
    let mut found = 0;
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        let (from, to) = (corners[a] - level, corners[b] - level);
        // Half-open: a corner exactly on the level counts as above it, so that a line through a corner is met once.
        if (from < 0.0) != (to < 0.0) && found < 2 {
            let share = from / (from - to);
            ends[found][a] = 1.0 - share;
            ends[found][b] = share;
            found += 1;
        }
    }
    (found == 2).then_some(ends)
}

/// The levels k · spacing that lie between the corners' values; none where there would be more than 200.
pub fn levels_between(corners: [f64; 3], spacing: f64) -> impl Iterator<Item = f64> {
    let low = corners[0].min(corners[1]).min(corners[2]);
    let high = corners[0].max(corners[1]).max(corners[2]);
    let first = (low / spacing).ceil();
    let count = ((high / spacing).floor() - first + 1.0).clamp(0.0, 201.0);
    let count = if count > 200.0 || !count.is_finite() { 0 } else { count as usize };
    (0..count).map(move |k| (first + k as f64) * spacing)
}

/// The point with these barycentric coordinates.
pub fn at(corners: [Point3<f64>; 3], weights: [f64; 3]) -> Point3<f64> {
    Point3::from(corners[0].coords * weights[0] + corners[1].coords * weights[1] + corners[2].coords * weights[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four unit triangles about a middle vertex 4; vertex 0 is not known.
    fn square() -> (Mesh, Vec<Option<f64>>) {
        let p = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 2.0, 1.0], [0.0, 2.0, 1.0], [1.0, 1.0, 2.0]];
        let mesh = Mesh::new(p.map(Point3::from).to_vec(), vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]).unwrap();
        (mesh, vec![None, Some(1.0), Some(-2.0), Some(3.0), Some(0.5)])
    }

    #[test]
    fn only_triangles_known_at_all_corners_stand_up_and_the_others_lie_flat() {
        let (mesh, values) = square();
        let s = Surface::new(&mesh, mesh.positions(), &values, 10.0, Relief::Plane);
        assert_eq!(s.raised, [false, true, true, false]);
        assert_eq!(s.base[4], Point3::new(1.0, 1.0, 0.0), "the plan of the face");
        assert_eq!(s.top[2].z, -20.0, "−2 times 10 mm");
        assert_eq!(s.top[0], s.base[0], "an unknown vertex has no height");
        // The raised part ends at its two outer edges and at the two that it shares with flat triangles.
        assert_eq!(s.rim.len(), 4);
    }

    #[test]
    fn over_the_face_heights_are_added_to_its_depth() {
        let (mesh, values) = square();
        let s = Surface::new(&mesh, mesh.positions(), &values, 10.0, Relief::Face);
        assert_eq!(s.top[4].z, 2.0 + 5.0);
        let s = Surface::new(&mesh, mesh.positions(), &values, 10.0, Relief::FaceColoured);
        assert_eq!(s.top[4].z, 2.0);
    }

    #[test]
    fn a_level_line_crosses_where_the_scalar_has_the_level() {
        let piece = level_piece([0.0, 4.0, 2.0], 1.0).unwrap();
        for end in piece {
            let value = end[1] * 4.0 + end[2] * 2.0;
            assert!((value - 1.0).abs() < 1e-12 && (end.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert!(level_piece([0.0, 4.0, 2.0], 5.0).is_none());
        assert_eq!(levels_between([0.1, 0.9, 0.35], 0.25).collect::<Vec<_>>(), [0.25, 0.5, 0.75]);
        assert_eq!(levels_between([0.0, 1e9, 0.0], 1e-3).count(), 0);
        assert_eq!(levels_between([0.0, f64::NAN, f64::NAN], 0.0).count(), 0);
    }
}
