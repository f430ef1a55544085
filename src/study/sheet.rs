//! Curved and flat sheets of any number of vertices: skin on which studies and benchmarks measure how work grows with the mesh.

use nalgebra::{Point3, Vector3};

use crate::face::mesh::lattice_triangles;
use crate::face::{Mesh, MeshError};

/// A sheet of 140 × 180 mm that bulges like a face, of `columns` × `rows` vertices (both at least 2).
///
/// z = 20 − x²/80 − y²/300 mm; each cell is cut by the same diagonal.
///
/// # Errors
/// More vertices than a mesh can have.
pub fn bulging(columns: usize, rows: usize) -> Result<Mesh, MeshError> {
    let (columns, rows) = (columns.max(2), rows.max(2));
    let at = |i: usize, n: usize, size: f64| (i as f64 / (n - 1) as f64 - 0.5) * size;
    let place = |i: usize| {
        let (x, y) = (at(i % columns, columns, 140.0), at(i / columns, rows, 180.0));
        Point3::new(x, y, 20.0 - x * x / 80.0 - y * y / 300.0)
    };
    let mut triangles = Vec::with_capacity(2 * (columns - 1) * (rows - 1));
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let i = (r * columns + c) as u32;
            let up = i + columns as u32;
            triangles.extend([[i, i + 1, up + 1], [i, up + 1, up]]);
        }
    }
    Mesh::new((0..columns * rows).map(place).collect(), triangles)
}

/// The places of a sheet after a motion of some millimetres: waves of 9 to 25 mm length along the skin.
pub fn moved(positions: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let motion = |p: &Point3<f64>| {
        Vector3::new(1.5 * (p.y / 9.0).sin(), 4.0 * (p.y / 15.0).sin() * (p.x / 25.0).cos(), 0.8 * (p.x / 7.0).sin())
    };
    positions.iter().map(|p| p + motion(p)).collect()
}

/// A flat square of `side_mm` around the origin, of equilateral triangles with edges of about `pitch_mm`: each row is shifted by half an edge.
///
/// # Errors
/// More vertices than a mesh can have.
pub fn lattice(side_mm: f64, pitch_mm: f64) -> Result<Mesh, MeshError> {
    let columns = (side_mm / pitch_mm).round().max(2.0) as usize + 1;
    let step = pitch_mm * 3.0_f64.sqrt() / 2.0;
    let rows = (side_mm / step).round().max(2.0) as usize + 1;
    let half = [0.5 * (columns - 1) as f64 * pitch_mm, 0.5 * (rows - 1) as f64 * step];
    let place = |i: usize| {
        let (c, r) = (i % columns, i / columns);
        Point3::new((c as f64 + 0.5 * (r % 2) as f64 - 0.25) * pitch_mm - half[0], r as f64 * step - half[1], 0.0)
    };
    Mesh::new((0..columns * rows).map(place).collect(), lattice_triangles(columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 18 × 34 vertices, 17 · 33 cells of two triangles; the lattice of 100 mm with edges of 10 mm has 11 columns and, its rows
    /// 8.66 mm apart, 13 rows, and every edge is 10 mm long.
    #[test]
    fn sheets_have_the_size_that_they_say() {
        let sheet = bulging(18, 34).unwrap();
        assert_eq!((sheet.len(), sheet.triangles().len()), (612, 1122));
        assert_eq!(sheet.positions()[0], Point3::new(-70.0, -90.0, 20.0 - 61.25 - 27.0));
        let flat = lattice(100.0, 10.0).unwrap();
        assert_eq!(flat.len(), 143);
        let length = |&[a, b]: &[u32; 2]| (flat.positions()[a as usize] - flat.positions()[b as usize]).norm();
        assert!(flat.edges().iter().map(length).all(|l| (l - 10.0).abs() < 1e-9));
        let normals = flat.vertex_normals(flat.positions());
        assert!(normals.iter().all(|n| n.z > 0.999));
    }
}
