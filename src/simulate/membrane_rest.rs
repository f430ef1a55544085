//! Where a membrane comes to rest under loads: Newton's method over the same bones and skull as the springs'.

use std::collections::HashMap;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, Vector3};

use super::block_cholesky::{BlockCholesky, Slot};
use super::equilibrium::{Ended, Equilibrium};
use super::freedoms::{Freedoms, seen_between};
use super::line_search::Search;
use super::newton::OutOfMemory;
use super::system::System;
use crate::forces::Membrane;

/// Finds equilibria of a membrane; the pattern of its matrix is ordered once.
#[derive(Debug)]
pub struct MembraneSolver {
    stiffness: Freedom,
    search: Search,
    forces: Vec<Vector3<f64>>,
    /// Newton steps at most.
    pub iterations: usize,
    /// Length of the last Newton step that counts as none, mm.
    pub tolerance_mm: f64,
}

/// How vertices can move.
#[derive(Debug)]
enum Freedom {
    /// On a surface.
    Sliding(Box<Stiffness<2>>),
    /// Anywhere.
    Free(Box<Stiffness<3>>),
}

/// No vertex goes further in one iteration, mm.
const LONGEST_MM: f64 = 10.0;

impl MembraneSolver {
    /// A solver for this membrane on these bones.
    ///
    /// # Errors
    /// Where memory for the matrix is not to be had.
    pub fn new(membrane: &Membrane, system: &System) -> Result<Self, OutOfMemory> {
        let stiffness = match system.freedoms() {
            2 => Freedom::Sliding(Box::new(Stiffness::new(membrane, system)?)),
            _ => Freedom::Free(Box::new(Stiffness::new(membrane, system)?)),
        };
        Ok(Self { stiffness, search: Search::default(), forces: Vec::new(), iterations: 200, tolerance_mm: 1e-5 })
    }

    /// The equilibrium found from a start. `system` says what pulls, which vertices are free and what they slide on; its springs are not
    /// asked.
    pub fn solve(&mut self, membrane: &Membrane, system: &System, start: &[Point3<f64>]) -> Equilibrium {
        let mut x: Vec<Point3<f64>> = start.iter().enumerate().map(|(i, p)| system.allowed(i, p)).collect();
        let work = |x: &[Point3<f64>]| -> f64 {
            x.iter().zip(system.rest()).enumerate().map(|(i, (x, x0))| system.given(i).dot(&(x - x0))).sum()
        };
        let Self { stiffness, search, forces, .. } = self;
        let mut energy = pulls(membrane, system, &x, forces) - work(&x);
        let mut iterations = 0;
        search.begin();
        let ended = loop {
            if iterations >= self.iterations {
                break Ended::OutOfIterations;
            }
            // With the whole stiffness first, which may be indefinite; then with its positive part.
            let found = [true, false].into_iter().any(|whole| {
                stiffness.factorize(membrane, system, &x, forces, whole)
                    && stiffness.direction(forces, &mut search.direction)
            });
            if !found {
                break Ended::NoFactor;
            }
            iterations += 1;
            let longest = search.longest_mm();
            let shortened = (LONGEST_MM / longest).min(1.0);
            for d in &mut search.direction {
                *d *= shortened;
            }
            let slope = search.slope(forces);
            let evaluate = |x: &[Point3<f64>]| pulls(membrane, system, x, forces) - work(x);
            let Some((share, after)) = search.descend(system, &mut x, energy, slope, evaluate) else {
                // The forces are those of the last place tried.
                energy = pulls(membrane, system, &x, forces) - work(&x);
                break if longest < self.tolerance_mm { Ended::Converged } else { Ended::Stalled };
            };
            energy = after;
            if search.arrived(longest, share, self.tolerance_mm, false) {
                break Ended::Converged;
            }
        };
        let left = |(i, f): (usize, &Vector3<f64>)| system.within(i, &x[i], *f).norm();
        let residual_n = forces.iter().enumerate().map(left).fold(0.0, f64::max);
        let areas = system.doubled_areas(&x);
        let folded = areas.iter().enumerate().filter(|(_, a)| **a < 0.0).map(|(t, _)| t as u32).collect();
        Equilibrium { iterations, residual_n, energy_mj: energy, ended, folded, positions: x }
    }

    /// The stiffness at some places, factored: for many small changes of the loads. None where it has no factor.
    pub fn tangent(&mut self, membrane: &Membrane, system: &System, x: &[Point3<f64>]) -> Option<MembraneTangent<'_>> {
        pulls(membrane, system, x, &mut self.forces);
        let Self { stiffness, forces, .. } = self;
        [true, false]
            .into_iter()
            .any(|whole| stiffness.factorize(membrane, system, x, forces, whole))
            .then_some(MembraneTangent { stiffness })
    }
}

/// What pulls on every vertex, skin and loads together, N; and the elastic energy, mJ.
fn pulls(membrane: &Membrane, system: &System, x: &[Point3<f64>], forces: &mut Vec<Vector3<f64>>) -> f64 {
    let energy = membrane.forces(x, None, forces);
    for (i, f) in forces.iter_mut().enumerate() {
        *f += system.given(i);
    }
    energy
}

/// The stiffness of a membrane on its bones at some places, factored once: the second derivative H of its energy within the surface, or its
/// positive part where the whole has no factor.
#[derive(Debug)]
pub struct MembraneTangent<'a> {
    stiffness: &'a mut Freedom,
}

impl MembraneTangent<'_> {
    /// How far each vertex goes, mm, for a small change of the loads, N: H⁻¹ Δf. False where a number is no number.
    pub fn moved(&mut self, change: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        self.stiffness.direction(change, out)
    }
}

impl Freedom {
    fn factorize(
        &mut self,
        membrane: &Membrane,
        system: &System,
        x: &[Point3<f64>],
        forces: &[Vector3<f64>],
        whole: bool,
    ) -> bool {
        match self {
            Self::Sliding(stiffness) => stiffness.factorize(membrane, system, x, forces, whole),
            Self::Free(stiffness) => stiffness.factorize(membrane, system, x, forces, whole),
        }
    }

    fn direction(&mut self, forces: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        match self {
            Self::Sliding(stiffness) => stiffness.direction(forces, out),
            Self::Free(stiffness) => stiffness.direction(forces, out),
        }
    }
}

/// The matrix in the K coordinates in which each vertex can move.
#[derive(Debug)]
struct Stiffness<const K: usize> {
    freedoms: Freedoms<K>,
    /// Edges of the mesh, where the block of each stands if both its ends are free, and for every element its sides 01, 12, 20.
    edges: Vec<[u32; 2]>,
    slots: Vec<Option<Slot>>,
    sides: Vec<[u32; 3]>,
    /// Blocks of the vertices and of the edges in space.
    own: Vec<Matrix3<f64>>,
    between: Vec<Matrix3<f64>>,
    matrix: BlockCholesky<K>,
}

impl<const K: usize> Stiffness<K> {
    fn new(membrane: &Membrane, system: &System) -> Result<Self, OutOfMemory> {
        let freedoms = Freedoms::new(system);
        let ends = |t: [u32; 3]| [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [t[i].min(t[j]), t[i].max(t[j])]);
        let mut edges: Vec<[u32; 2]> = membrane.corners().flat_map(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        let number: HashMap<[u32; 2], u32> = edges.iter().enumerate().map(|(k, e)| (*e, k as u32)).collect();
        let sides = membrane.corners().map(|t| ends(t).map(|e| number.get(&e).copied().unwrap_or(0))).collect();
        let pairs: Vec<[u32; 2]> = edges.iter().filter_map(|e| freedoms.pair(*e)).collect();
        let matrix = BlockCholesky::new(freedoms.free(), &pairs).ok_or(OutOfMemory)?;
        Ok(Self {
            slots: edges.iter().map(|e| matrix.slot(freedoms.pair(*e)?)).collect(),
            own: vec![Matrix3::zeros(); system.len()],
            between: vec![Matrix3::zeros(); edges.len()],
            freedoms,
            edges,
            sides,
            matrix,
        })
    }

    /// The factor at `x`, where the `forces` (N) are left; with the whole stiffness and curvature of the surface, or their positive part.
    fn factorize(
        &mut self,
        membrane: &Membrane,
        system: &System,
        x: &[Point3<f64>],
        forces: &[Vector3<f64>],
        whole: bool,
    ) -> bool {
        self.own.fill(Matrix3::zeros());
        self.between.fill(Matrix3::zeros());
        membrane.stiffness(x, None, whole, |element, corners, k| {
            let Some(sides) = self.sides.get(element) else { return };
            for c in 0..3 {
                self.own[corners[c] as usize] += k[c][c];
                let d = (c + 1) % 3;
                let (low, high) = if corners[c] < corners[d] { (c, d) } else { (d, c) };
                self.between[sides[c] as usize] += k[low][high];
            }
        });
        self.matrix.clear();
        for i in 0..x.len() {
            let Some(u) = self.freedoms.number(i) else { continue };
            let mut block = self.own[i];
            if let (2, Some((normal, curvature))) = (K, system.surface(i, &x[i])) {
                let both = self.freedoms.lie_in(i, &normal);
                // What presses on the surface follows its slope.
                let pull = curvature * normal.dot(&forces[i]);
                block += if whole { pull } else { positive_within(&pull, both) };
            }
            let basis = self.freedoms.basis(i);
            *self.matrix.diagonal(u) = seen_between(basis, &block, basis);
        }
        for ((&[a, b], slot), block) in self.edges.iter().zip(&self.slots).zip(&self.between) {
            if let Some(slot) = slot {
                let (a, b) = (self.freedoms.basis(a as usize), self.freedoms.basis(b as usize));
                self.matrix.add(*slot, &seen_between(a, block, b));
            }
        }
        self.matrix.factorize()
    }

    /// H⁻¹ of these forces, with the last factor; false where a number is no number.
    fn direction(&mut self, forces: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        self.freedoms.solve(&mut self.matrix, forces, out)
    }
}

/// The positive part of a symmetric matrix within the plane of two directions.
fn positive_within(m: &Matrix3<f64>, both: [Vector3<f64>; 2]) -> Matrix3<f64> {
    let plane = Matrix3x2::from_columns(&both);
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
