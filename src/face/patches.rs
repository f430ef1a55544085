//! Flat meshes and a stream of noise for tests.

use nalgebra::{Point3, Vector3};

use super::Mesh;
use super::mesh::lattice_triangles;

/// `columns` × `rows` vertices of a lattice of equilateral triangles of side `pitch`, flat, rows shifted alternately.
pub(crate) fn triangular(columns: usize, rows: usize, pitch: f64) -> Mesh {
    let step = pitch * 3.0_f64.sqrt() / 2.0;
    let at = |c: usize, r: usize| Point3::new((c as f64 + 0.5 * (r % 2) as f64) * pitch, r as f64 * step, 0.0);
    let positions = (0..rows).flat_map(|r| (0..columns).map(move |c| at(c, r))).collect();
    Mesh::new(positions, lattice_triangles(columns, rows)).unwrap()
}

/// `columns` × `rows` vertices on a rectangular grid, each cell cut by the same diagonal.
pub(crate) fn right_angled(columns: usize, rows: usize, dx: f64, dy: f64) -> Mesh {
    let at = |c: usize, r: usize| Point3::new(c as f64 * dx, r as f64 * dy, 0.0);
    let positions = (0..rows).flat_map(|r| (0..columns).map(move |c| at(c, r))).collect();
    let mut triangles = Vec::new();
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let i = (r * columns + c) as u32;
            let up = i + columns as u32;
            triangles.extend([[i, i + 1, up + 1], [i, up + 1, up]]);
        }
    }
    Mesh::new(positions, triangles).unwrap()
}

/// A stream of numbers in [−1, 1): splitmix64, the same on every machine.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Standard normal (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (0.5 - 0.5 * self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::PI * v).cos()
    }
}

/// The positions, each coordinate moved by up to `amount`.
pub(crate) fn shaken(positions: &[Point3<f64>], amount: f64, seed: u64) -> Vec<Point3<f64>> {
    let mut noise = Noise(seed);
    positions.iter().map(|p| p + Vector3::from_fn(|_, _| noise.uniform()) * amount).collect()
}
