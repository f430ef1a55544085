//! One step of Newton's method on the energy of a system: the stiffness matrix made positive, and its sparse Cholesky factor.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, Vector3};

use super::block_cholesky::{Block, BlockCholesky, Slot};
use super::energy::Pulls;
use super::freedoms::{Freedoms, seen_from};
use super::system::System;

/// Room for Newton steps on one system; the pattern of its matrix is ordered once.
#[derive(Debug)]
pub(super) enum Newton {
    /// Vertices that slide on a surface.
    Sliding(Stiffness<2>),
    /// Vertices that move freely.
    Free(Stiffness<3>),
}

/// The matrix could not be ordered: memory ran out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is not enough memory for the stiffness matrix")]
pub struct OutOfMemory;

impl Newton {
    pub(super) fn new(system: &System) -> Result<Self, OutOfMemory> {
        match system.freedoms() {
            2 => Stiffness::new(system).map(Self::Sliding),
            _ => Stiffness::new(system).map(Self::Free),
        }
    }

    /// Factors the stiffness at `x`, with `inertia` (N/mm, one a vertex) on the diagonal where time is stepped; false where it has no
    /// factor.
    ///
    /// H = Σ k d dᵀ + max(0, T/L) (I − d dᵀ) + Σ r' ∇s ∇sᵀ + anchors, within the surface; the pull of the surface on a vertex that
    /// is pressed against it adds T_t n·f ∇∇φ, as far as that is positive. All parts are positive, so H⁻¹ f descends.
    pub(super) fn factorize(
        &mut self,
        system: &System,
        x: &[Point3<f64>],
        pulls: &Pulls,
        inertia: impl Fn(usize) -> f64,
    ) -> bool {
        match self {
            Self::Sliding(stiffness) => stiffness.factorize(system, x, pulls, inertia),
            Self::Free(stiffness) => stiffness.factorize(system, x, pulls, inertia),
        }
    }

    /// Takes the last factor along to `x`: what it says about the surface there is turned with the surface. H⁻¹ f still descends.
    pub(super) fn keep(&mut self, system: &System, x: &[Point3<f64>]) {
        if let Self::Sliding(stiffness) = self {
            stiffness.freedoms.turn(system, x);
        }
    }

    /// What takes each vertex that goes along `d` back to the surface, in second order, mm.
    pub(super) fn bends(&self, directions: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) {
        out.clear();
        if let Self::Sliding(stiffness) = self {
            out.extend(directions.iter().enumerate().map(|(i, d)| stiffness.bend(i, d)));
        }
    }

    /// The direction H⁻¹ f for the forces `f`, with the last factor; false where a number is no number.
    pub(super) fn direction(&mut self, forces: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        match self {
            Self::Sliding(stiffness) => stiffness.direction(forces, out),
            Self::Free(stiffness) => stiffness.direction(forces, out),
        }
    }
}

/// The matrix in the K coordinates in which each vertex can move.
#[derive(Debug)]
pub(super) struct Stiffness<const K: usize> {
    freedoms: Freedoms<K>,
    /// Where each spring's block stands, where both ends are free.
    slots: Vec<Option<Slot>>,
    /// Springs of each wedge's sides 01, 12, 20.
    sides: Vec<[u32; 3]>,
    /// The curvature of the surface under each vertex in the directions in which it can move, 1/mm.
    bends: Vec<Matrix2<f64>>,
    /// What the surface adds to each diagonal block.
    pulls: Vec<Matrix2<f64>>,
    matrix: BlockCholesky<K>,
}

impl<const K: usize> Stiffness<K> {
    fn new(system: &System) -> Result<Self, OutOfMemory> {
        let freedoms = Freedoms::new(system);
        let pairs: Vec<[u32; 2]> = system.springs.iter().filter_map(|s| freedoms.pair(s.ends)).collect();
        let matrix = BlockCholesky::new(freedoms.free(), &pairs).ok_or(OutOfMemory)?;
        let index: std::collections::HashMap<[u32; 2], u32> =
            system.springs.iter().enumerate().map(|(e, s)| (s.ends, e as u32)).collect();
        let side = |a: u32, b: u32| index.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0);
        let sides = system.wedges.iter().map(|w| w.corners).map(|[a, b, c]| [side(a, b), side(b, c), side(c, a)]);
        Ok(Self {
            slots: system.springs.iter().map(|s| matrix.slot(freedoms.pair(s.ends)?)).collect(),
            sides: sides.collect(),
            bends: vec![Matrix2::zeros(); system.len()],
            pulls: vec![Matrix2::zeros(); system.len()],
            matrix,
            freedoms,
        })
    }

    /// The factor of H at these places.
    fn factorize(&mut self, system: &System, x: &[Point3<f64>], pulls: &Pulls, inertia: impl Fn(usize) -> f64) -> bool {
        self.lay(system, x, &pulls.forces);
        // With the whole curvature of the surface first, which may leave the matrix indefinite; then with its positive part.
        self.assemble(system, x, &pulls.springs, &inertia);
        if self.matrix.factorize() {
            return true;
        }
        for pull in &mut self.pulls {
            *pull = positive(pull);
        }
        self.assemble(system, x, &pulls.springs, &inertia);
        self.matrix.factorize()
    }

    /// How far a vertex that goes this way leaves the surface in second order, mm: along the normal of the plane that it goes in.
    fn bend(&self, i: usize, d: &Vector3<f64>) -> Vector3<f64> {
        let (Some([t, s]), true) = (self.freedoms.basis(i).first_chunk::<2>(), K == 2) else { return Vector3::zeros() };
        let (a, b, c) = (t.dot(d), s.dot(d), &self.bends[i]);
        t.cross(s) * (-0.5 * (c.m11 * a * a + 2.0 * c.m12 * a * b + c.m22 * b * b))
    }

    /// H⁻¹ of these forces, with the last factor.
    fn direction(&mut self, forces: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        self.freedoms.solve(&mut self.matrix, forces, out)
    }

    /// Finds the directions in which the vertices can move, and what the surface adds.
    fn lay(&mut self, system: &System, x: &[Point3<f64>], forces: &[Vector3<f64>]) {
        if K != 2 {
            return;
        }
        for i in 0..x.len() {
            if self.freedoms.number(i).is_none() {
                continue;
            }
            let (normal, curvature) = system.surface(i, &x[i]).unwrap_or_else(|| (Vector3::z(), Matrix3::zeros()));
            let [t, s] = self.freedoms.lie_in(i, &normal);
            self.bends[i] = within(&curvature, t, s);
            self.pulls[i] = self.bends[i] * normal.dot(&forces[i]);
        }
    }

    fn assemble(&mut self, system: &System, x: &[Point3<f64>], springs: &[[f64; 2]], inertia: impl Fn(usize) -> f64) {
        let Self { matrix, freedoms, .. } = self;
        matrix.clear();
        for (i, u) in freedoms.each() {
            let own = inertia(i) + system.anchor(i).map_or(0.0, |(k, _)| k);
            let to = matrix.diagonal(u);
            for (c, column) in to.iter_mut().enumerate() {
                column[c] += own;
            }
            if K == 2 {
                let pull = self.pulls[i];
                for c in 0..2 {
                    for r in 0..2 {
                        to[c][r] += pull[(r, c)];
                    }
                }
            }
        }
        for ((spring, slot), [sideways, lengthways]) in system.springs.iter().zip(&self.slots).zip(springs) {
            let [a, b] = spring.ends.map(|i| i as usize);
            let along = x[a] - x[b];
            let [ta, tb] = [a, b].map(|i| seen_from(freedoms.basis(i), &along));
            for (i, t) in [(a, &ta), (b, &tb)] {
                let Some(u) = freedoms.number(i) else { continue };
                let to = matrix.diagonal(u);
                for c in 0..K {
                    to[c][c] += sideways;
                    for r in 0..K {
                        to[c][r] += lengthways * t[r] * t[c];
                    }
                }
            }
            let Some(slot) = slot else { continue };
            let (row, column) = (freedoms.basis(a), freedoms.basis(b));
            let block: Block<K> = std::array::from_fn(|c| {
                std::array::from_fn(|r| -(sideways * row[r].dot(&column[c]) + lengthways * ta[r] * tb[c]))
            });
            matrix.add(*slot, &block);
        }
        let Some(repulsion) = &system.options.repulsion else { return };
        for (wedge, sides) in system.wedges.iter().zip(&self.sides) {
            let normal = system.wedge_normal(wedge);
            wedge.pushes(repulsion, System::corners(wedge, x), &normal, |push| {
                let g: [[f64; K]; 3] =
                    std::array::from_fn(|c| seen_from(freedoms.basis(wedge.corners[c] as usize), &push.gradient[c]));
                let product = |row: &[f64; K], column: &[f64; K]| -> Block<K> {
                    std::array::from_fn(|c| std::array::from_fn(|r| push.slope * row[r] * column[c]))
                };
                for (c, side) in sides.iter().enumerate() {
                    if let Some(u) = freedoms.number(wedge.corners[c] as usize) {
                        let to = matrix.diagonal(u);
                        for (to, from) in to.iter_mut().flatten().zip(product(&g[c], &g[c]).iter().flatten()) {
                            *to += from;
                        }
                    }
                    let d = (c + 1) % 3;
                    // The block of a spring is that of its lower end's row and its higher end's column.
                    let (low, high) = if wedge.corners[c] < wedge.corners[d] { (c, d) } else { (d, c) };
                    if let Some(slot) = self.slots[*side as usize] {
                        matrix.add(slot, &product(&g[low], &g[high]));
                    }
                }
            });
        }
    }
}

/// tᵀ M t, tᵀ M s and sᵀ M s of a symmetric matrix.
fn within(m: &Matrix3<f64>, t: Vector3<f64>, s: Vector3<f64>) -> Matrix2<f64> {
    let basis = Matrix3x2::from_columns(&[t, s]);
    basis.transpose() * m * basis
}

/// The positive part of a symmetric matrix: its negative eigenvalues set to zero.
fn positive(m: &Matrix2<f64>) -> Matrix2<f64> {
    let (mean, half) = (0.5 * (m.m11 + m.m22), 0.5 * (m.m11 - m.m22));
    let spread = half.hypot(m.m12);
    if mean - spread >= 0.0 {
        *m
    } else if mean + spread <= 0.0 {
        Matrix2::zeros()
    } else {
        // (M − λ₂ I) / (λ₁ − λ₂) projects onto the first eigenvector.
        (m - Matrix2::from_diagonal_element(mean - spread)) * ((mean + spread) / (2.0 * spread))
    }
}
