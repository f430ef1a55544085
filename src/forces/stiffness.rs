//! The stiffness matrix K of the whole mesh, written out. For export, for tests and for eyes; the field itself is computed
//! without it in [`force_field`](super::force_field).

use nalgebra::{Point3, Vector3};

use super::Springs;
use crate::skin::StressStrainCurve;

/// K: sparse, symmetric, n × n effective stiffnesses in N/mm, rows that sum to zero. Thesis (4.3), (4.4).
///
/// α_ij = k_ij (l_ij − ‖x_i − x_j‖) / ‖x_i − x_j‖   (4.2),   K_ij = −α_ij,   K_ii = Σ_j α_ij
///
/// K holds the *internal* forces: row i of K X is what the springs do to vertex i. It depends on X through α.
#[derive(Clone, Debug, PartialEq)]
pub struct Stiffness {
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Stiffness {
    /// K at the deformed `positions` (mm, one a vertex). A spring with an end that is not `active` carries nothing.
    pub fn assemble(springs: &Springs, curve: &StressStrainCurve, positions: &[Point3<f64>], active: &[bool]) -> Self {
        let alpha: Vec<f64> = (0..springs.edges().len())
            .map(|e| {
                let length = springs.along(e, positions).norm();
                if length == 0.0 || !springs.is_active(e, Some(active)) {
                    return 0.0;
                }
                springs.secant_stiffness(e, curve, length) * (springs.rest_length_mm()[e] - length) / length
            })
            .collect();
        let mut k = Self { starts: vec![0], columns: Vec::new(), values: Vec::new() };
        let mut row: Vec<(u32, f64)> = Vec::new();
        for i in 0..springs.vertices() as u32 {
            row.clear();
            for &e in springs.springs_of_vertex(i as usize) {
                let [a, b] = springs.edges()[e as usize];
                row.push((if a == i { b } else { a }, -alpha[e as usize]));
            }
            let diagonal = -row.iter().map(|r| r.1).sum::<f64>();
            row.push((i, diagonal));
            row.sort_unstable_by_key(|r| r.0);
            k.columns.extend(row.iter().map(|r| r.0));
            k.values.extend(row.iter().map(|r| r.1));
            k.starts.push(k.columns.len() as u32);
        }
        k
    }

    /// Number of vertices n.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The stored (column, N/mm) entries of one row, columns ascending.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.columns[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }

    /// K_ij, N/mm; 0 where vertices are not neighbours.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.row(i).find(|(column, _)| *column as usize == j).map_or(0.0, |(_, value)| value)
    }

    /// Whether K_ij = K_ji holds for every entry, to the last bit.
    pub fn is_symmetric(&self) -> bool {
        (0..self.len()).all(|i| self.row(i).all(|(j, value)| self.get(j as usize, i) == value))
    }

    /// F = −K X: the external (muscle) force on every vertex, N. Thesis (4.5).
    pub fn apply(&self, x: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        (0..self.len())
            .map(|i| -self.row(i).map(|(j, value)| x[j as usize].coords * value).sum::<Vector3<f64>>())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::Mesh;
    use crate::face::patches::{shaken, triangular};
    use crate::forces::{SpringRule, muscle_forces};
    use proptest::prelude::*;

    /// Two springs in a row by hand: lengths 1, 1 at rest; the middle vertex moved so that they are 1.1 and 0.9 long.
    /// A sliver of width w carries w · 3.62e-3 N on the left and pushes with w · 3.35e-3 N on the right (h = 1 mm).
    #[test]
    fn a_row_of_two_springs_by_hand() {
        let p =
            vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0), Point3::new(1.0, 1.0, 0.0)];
        let mesh = Mesh::new(p.clone(), vec![[0, 1, 3], [1, 2, 3]]).unwrap();
        let springs = Springs::new(&mesh, &p, SpringRule::Strip, 1.0);
        let mut x = p;
        x[1].x = 1.1;
        // Only the three vertices of the row are active: the springs to the tip carry nothing.
        let k = Stiffness::assemble(&springs, &StressStrainCurve::default(), &x, &[true, true, true, false]);
        // ΣA/l = 0.5 / 1. K_01 = −α_01 = f_01 / L_01 = 0.5 · 3.62e-3 / 1.1; K_12 = −0.5 · 3.35e-3 / 0.9.
        assert!((k.get(0, 1) - 0.5 * 3.62e-3 / 1.1).abs() < 1e-15);
        assert!((k.get(1, 2) + 0.5 * 3.35e-3 / 0.9).abs() < 1e-15);
        assert_eq!(k.get(0, 2), 0.0);
        assert!((k.get(1, 1) + k.get(0, 1) + k.get(1, 2)).abs() < 1e-15);
        let f = k.apply(&x);
        // To hold the middle against a pull to the left and a push to the left: 0.5 · (3.62 + 3.35)e-3 N to the right.
        assert!((f[1].x - 0.5 * 6.97e-3).abs() < 1e-15 && f[3].norm() == 0.0);
        // Its ends are held with the opposite of their springs (Newton's third law).
        assert!((f[0].x + 0.5 * 3.62e-3).abs() < 1e-15 && (f[2].x + 0.5 * 3.35e-3).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn k_is_symmetric_its_rows_sum_to_zero_and_the_fast_path_is_minus_k_x(seed: u64, amount in 0.0..3.0_f64, uniform: bool) {
            let mesh = triangular(7, 6, 5.0);
            let rule = if uniform { SpringRule::Uniform } else { SpringRule::Strip };
            let rest = shaken(mesh.positions(), 0.8, seed);
            let x = shaken(&rest, amount, seed ^ 1);
            let active: Vec<bool> = (0..mesh.len()).map(|i| (seed >> (i % 64)) & 3 != 0).collect();
            let springs = Springs::new(&mesh, &rest, rule, 1.5);
            let curve = StressStrainCurve::default();
            let k = Stiffness::assemble(&springs, &curve, &x, &active);
            prop_assert!(k.is_symmetric());
            let largest = k.values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for i in 0..k.len() {
                prop_assert!(k.row(i).map(|r| r.1).sum::<f64>().abs() <= 1e-14 * largest);
            }
            let mut fast = Vec::new();
            muscle_forces(&springs, &curve, &x, Some(&active), &mut fast);
            // K X is a difference of products K_ij x_j with coordinates up to 35 mm: their rounding is the floor.
            let floor = 1e-14 * largest * 35.0;
            let scale = fast.iter().map(Vector3::norm).fold(0.0, f64::max);
            for (a, b) in k.apply(&x).iter().zip(&fast) {
                prop_assert!((a - b).norm() <= 1e-12 * scale + floor, "{a} {b}");
            }
        }
    }
}
