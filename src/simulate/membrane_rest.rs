//! Where a membrane comes to rest under loads: Newton's method over the same bones and skull as the springs'.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Side};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, Vector3};

use super::equilibrium::{Ended, Equilibrium};
use super::line_search::Search;
use super::newton::OutOfMemory;
use super::system::System;
use crate::forces::Membrane;

/// Finds equilibria of a membrane; the pattern of its matrix is ordered once.
#[derive(Debug)]
pub struct MembraneSolver {
    /// Number of each free vertex among the free ones.
    unknown: Vec<Option<u32>>,
    freedoms: usize,
    /// Edges of the mesh and, for every element, those of its sides 01, 12, 20.
    edges: Vec<[u32; 2]>,
    sides: Vec<[u32; 3]>,
    /// Rank of each edge's block below the diagonal of its column, where both ends are free.
    rank: Vec<Option<u32>>,
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLlt<usize>,
    search: Search,
    /// Newton steps at most.
    pub iterations: usize,
    /// Length of the last Newton step that counts as none, mm.
    pub tolerance_mm: f64,
}

/// No vertex goes further in one iteration, mm.
const LONGEST_MM: f64 = 10.0;

impl MembraneSolver {
    /// A solver for this membrane on these bones.
    ///
    /// # Errors
    /// Where memory for the matrix is not to be had.
    pub fn new(membrane: &Membrane, system: &System) -> Result<Self, OutOfMemory> {
        let freedoms = system.freedoms();
        let mut unknown = vec![None; system.len()];
        let mut count = 0_u32;
        for (slot, _) in unknown.iter_mut().zip(system.free()).filter(|(_, free)| **free) {
            *slot = Some(count);
            count += 1;
        }
        let ends = |t: [u32; 3]| [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [t[i].min(t[j]), t[i].max(t[j])]);
        let mut edges: Vec<[u32; 2]> = membrane.corners().flat_map(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        let number = |e: [u32; 2]| edges.binary_search(&e).unwrap_or(0) as u32;
        let sides = membrane.corners().map(|t| ends(t).map(number)).collect();
        let mut below: Vec<Vec<u32>> = vec![Vec::new(); count as usize];
        let rank = edges
            .iter()
            .map(|&[a, b]| {
                let (a, b) = (unknown[a as usize]?, unknown[b as usize]?);
                let column = &mut below[a as usize];
                column.push(b);
                Some(column.len() as u32 - 1)
            })
            .collect();
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for (u, others) in below.iter().enumerate() {
            for c in 0..freedoms {
                rows.extend((c..freedoms).map(|r| u * freedoms + r));
                rows.extend(others.iter().flat_map(|&b| (0..freedoms).map(move |r| b as usize * freedoms + r)));
                columns.push(rows.len());
            }
        }
        let size = count as usize * freedoms;
        let pattern = SymbolicSparseColMat::new_checked(size, size, columns, None, rows);
        let symbolic = SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).map_err(|_| OutOfMemory)?;
        Ok(Self {
            unknown,
            freedoms,
            edges,
            sides,
            rank,
            pattern,
            symbolic,
            search: Search::default(),
            iterations: 200,
            tolerance_mm: 1e-5,
        })
    }

    /// The equilibrium found from a start. `system` says what pulls, which vertices are free and what they slide on; its springs are not
    /// asked.
    pub fn solve(&mut self, membrane: &Membrane, system: &System, start: &[Point3<f64>]) -> Equilibrium {
        let mut x: Vec<Point3<f64>> = start.iter().enumerate().map(|(i, p)| system.allowed(i, p)).collect();
        let work = |x: &[Point3<f64>]| -> f64 {
            x.iter().zip(system.rest()).enumerate().map(|(i, (x, x0))| system.given(i).dot(&(x - x0))).sum()
        };
        let mut forces = Vec::new();
        let pull = |x: &[Point3<f64>], forces: &mut Vec<Vector3<f64>>| {
            let energy = membrane.forces(x, None, forces) - work(x);
            for (i, f) in forces.iter_mut().enumerate() {
                *f += system.given(i);
            }
            energy
        };
        let mut energy = pull(&x, &mut forces);
        let mut iterations = 0;
        self.search.begin();
        let ended = loop {
            if iterations >= self.iterations {
                break Ended::OutOfIterations;
            }
            let found =
                [true, false].into_iter().find_map(|whole| self.direction(membrane, system, &x, &forces, whole));
            let Some(direction) = found else { break Ended::NoFactor };
            iterations += 1;
            self.search.direction = direction;
            let longest = self.search.longest_mm();
            let shortened = (LONGEST_MM / longest).min(1.0);
            for d in &mut self.search.direction {
                *d *= shortened;
            }
            let slope = self.search.slope(&forces);
            let found = self.search.descend(system, &mut x, energy, slope, |x| membrane.energy(x) - work(x));
            let Some((share, _)) = found else {
                break if longest < self.tolerance_mm { Ended::Converged } else { Ended::Stalled };
            };
            energy = pull(&x, &mut forces);
            if self.search.arrived(longest, share, self.tolerance_mm, false) {
                break Ended::Converged;
            }
        };
        let left = |(i, f): (usize, &Vector3<f64>)| system.within(i, &x[i], *f).norm();
        let residual_n = forces.iter().enumerate().map(left).fold(0.0, f64::max);
        let areas = system.doubled_areas(&x);
        let folded = areas.iter().enumerate().filter(|(_, a)| **a < 0.0).map(|(t, _)| t as u32).collect();
        Equilibrium { iterations, residual_n, energy_mj: energy, ended, folded, positions: x }
    }

    fn direction(
        &self,
        membrane: &Membrane,
        system: &System,
        x: &[Point3<f64>],
        forces: &[Vector3<f64>],
        whole: bool,
    ) -> Option<Vec<Vector3<f64>>> {
        let mut diagonal = vec![Matrix3::zeros(); x.len()];
        let mut beside = vec![Matrix3::zeros(); self.edges.len()];
        membrane.stiffness(x, None, whole, |element, corners, k| {
            let Some(sides) = self.sides.get(element) else { return };
            for c in 0..3 {
                diagonal[corners[c] as usize] += k[c][c];
                let d = (c + 1) % 3;
                let (low, high) = if corners[c] < corners[d] { (c, d) } else { (d, c) };
                beside[sides[c] as usize] += k[low][high];
            }
        });
        let k = self.freedoms;
        let mut bases = vec![Matrix3::identity(); x.len()];
        let columns = self.pattern.col_ptr();
        let mut values = vec![0.0; self.pattern.row_idx().len()];
        let mut right = Mat::<f64>::zeros(self.pattern.nrows(), 1);
        for (i, u) in self.unknown.iter().enumerate() {
            let Some(u) = u.map(|u| u as usize) else { continue };
            let mut block = diagonal[i];
            if let (2, Some((normal, curvature))) = (k, system.surface(i, &x[i])) {
                let across = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
                let t = normal.cross(&across).normalize();
                bases[i] = Matrix3::from_columns(&[t, normal.cross(&t), normal]);
                // What presses on the surface follows its slope.
                let pull = curvature * normal.dot(&forces[i]);
                block += if whole { pull } else { positive_within(&pull, &bases[i]) };
            }
            let inside = bases[i].transpose() * block * bases[i];
            for c in 0..k {
                let at = columns[u * k + c];
                for r in c..k {
                    values[at + r - c] = inside[(r, c)];
                }
                right[(u * k + c, 0)] = bases[i].column(c).dot(&forces[i]);
            }
        }
        for ((&[a, b], rank), block) in self.edges.iter().zip(&self.rank).zip(&beside) {
            let (Some(rank), Some(u)) = (rank, self.unknown[a as usize]) else { continue };
            let between = bases[b as usize].transpose() * block.transpose() * bases[a as usize];
            for c in 0..k {
                let at = columns[u as usize * k + c] + (k - c) + *rank as usize * k;
                for r in 0..k {
                    values[at + r] = between[(r, c)];
                }
            }
        }
        let matrix = SparseColMat::new(self.pattern.clone(), values);
        let factor = Llt::try_new_with_symbolic(self.symbolic.clone(), matrix.as_ref(), Side::Lower).ok()?;
        let solution = factor.solve(&right);
        let mut out = vec![Vector3::zeros(); x.len()];
        for (i, u) in self.unknown.iter().enumerate() {
            let Some(u) = u.map(|u| u as usize) else { continue };
            for c in 0..k {
                out[i] += bases[i].column(c) * solution[(u * k + c, 0)];
            }
        }
        out.iter().all(|d| d.iter().all(|c| c.is_finite())).then_some(out)
    }
}

/// The positive part of a symmetric matrix within the plane of the first two columns of a basis.
fn positive_within(m: &Matrix3<f64>, basis: &Matrix3<f64>) -> Matrix3<f64> {
    let plane = Matrix3x2::from_columns(&[basis.column(0), basis.column(1)]);
    let eigen = nalgebra::SymmetricEigen::new(Matrix2::from(plane.transpose() * m * plane));
    let kept = eigen.eigenvalues.map(|l| l.max(0.0));
    plane * eigen.eigenvectors * Matrix2::from_diagonal(&kept) * eigen.eigenvectors.transpose() * plane.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{right_angled, shaken};
    use crate::forces::{Material, Sheet};
    use crate::simulate::SystemOptions;

    /// A shear by 0.1 and a stretch by 17 %.
    fn sheared(x: &[Point3<f64>]) -> Vec<Point3<f64>> {
        x.iter().map(|p| Point3::new(p.x + p.y * 0.1, p.y * 1.17, p.z)).collect()
    }

    /// The patch test of the solver: held along one side and pulled on the border with what a uniform shear and stretch needs, an irregular patch
    /// takes that shape, to the tolerance.
    #[test]
    fn the_equilibrium_under_a_uniform_traction_is_a_uniform_stretch() {
        let flat = right_angled(6, 6, 6.0, 5.0);
        let place = |(p, q): (&Point3<f64>, &Point3<f64>)| if q.y == 0.0 { *q } else { Point3::new(p.x, p.y, 0.0) };
        let mesh =
            flat.with_positions(shaken(flat.positions(), 0.9, 2).iter().zip(flat.positions()).map(place).collect());
        let mesh = mesh.unwrap();
        let fixed: Vec<bool> = mesh.positions().iter().map(|p| p.y == 0.0).collect();
        let options = SystemOptions { repulsion: None, pre_tension_kpa: 0.0, ..SystemOptions::default() };
        let aim = sheared(mesh.positions());
        for material in [Material::Fibres, Material::Principal] {
            let membrane = Membrane::new(&mesh, mesh.positions(), Sheet { material, ..Sheet::default() });
            let mut system = System::new(&mesh, mesh.positions(), &fixed, None, options.clone()).unwrap();
            let mut pull = Vec::new();
            membrane.forces(&aim, None, &mut pull);
            system.set_loads(pull.iter().map(|f| -f).collect()).unwrap();
            let found = MembraneSolver::new(&membrane, &system).unwrap().solve(&membrane, &system, mesh.positions());
            assert_eq!(found.ended, Ended::Converged);
            let off = found.positions.iter().zip(&aim).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < 1e-5 && found.folded.is_empty(), "{material:?} {off}");
        }
    }
}
