//! One step of Newton's method on the energy of a system: the stiffness matrix made positive, and its sparse Cholesky factor.

use std::ops::AddAssign;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, Vector3};

use super::system::System;

/// Room for Newton steps on one system; the pattern of its matrix is ordered once.
pub(super) struct Newton {
    freedoms: usize,
    /// Number of each free vertex among the free ones.
    unknown: Vec<Option<u32>>,
    /// Rank of each spring's block below the diagonal of its column, where both ends are free.
    rank: Vec<Option<u32>>,
    /// Springs of each wedge's sides 01, 12, 20.
    sides: Vec<[u32; 3]>,
    pattern: SymbolicSparseColMat<u32>,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    factor: Vec<f64>,
    scratch: MemBuffer,
    diagonal: Vec<Matrix3<f64>>,
    beside: Vec<Matrix3<f64>>,
    bases: Vec<Matrix3<f64>>,
    right: Vec<f64>,
}

impl std::fmt::Debug for Newton {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Newton").field("unknowns", &self.right.len()).finish_non_exhaustive()
    }
}

/// The matrix could not be ordered: memory ran out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is not enough memory for the stiffness matrix")]
pub struct OutOfMemory;

/// What stiffness is given to a direction that has none, as a share of the skin's own: so little moves nothing wrongly, and a
/// saturated sheet can still be stepped.
const LEAST_SHARE: f64 = 1e-3;

impl Newton {
    pub(super) fn new(system: &System) -> Result<Self, OutOfMemory> {
        let k = system.freedoms();
        let mut unknown = vec![None; system.len()];
        let mut count = 0_u32;
        for (slot, _) in unknown.iter_mut().zip(&system.free).filter(|(_, free)| **free) {
            *slot = Some(count);
            count += 1;
        }
        let mut below = vec![0_u32; count as usize];
        // Springs are in ascending order of their lower end, then of the higher: so are the rows of a column.
        let rank: Vec<Option<u32>> = system
            .springs
            .iter()
            .map(|s| {
                let [a, b] = s.ends.map(|i| unknown[i as usize]);
                let (a, _) = (a?, b?);
                below[a as usize] += 1;
                Some(below[a as usize] - 1)
            })
            .collect();
        let mut columns = vec![0_u32];
        let mut rows: Vec<u32> = Vec::new();
        let mut spring = 0;
        for (i, slot) in unknown.iter().enumerate() {
            let Some(column) = *slot else { continue };
            while system.springs.get(spring).is_some_and(|s| (s.ends[0] as usize) < i) {
                spring += 1;
            }
            let of_this = system.springs[spring..].iter().take_while(|s| s.ends[0] as usize == i);
            let others: Vec<u32> = of_this.filter_map(|s| unknown[s.ends[1] as usize]).collect();
            for c in 0..k as u32 {
                rows.extend((c..k as u32).map(|r| column * k as u32 + r));
                rows.extend(others.iter().flat_map(|j| (0..k as u32).map(move |r| j * k as u32 + r)));
                columns.push(rows.len() as u32);
            }
        }
        let size = count as usize * k;
        let entries = rows.len();
        let pattern = SymbolicSparseColMat::new_checked(size, size, columns, None, rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..CholeskySymbolicParams::default()
            },
        )
        .map_err(|_| OutOfMemory)?;
        let need = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, faer::Spec::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let scratch = MemBuffer::try_new(need).map_err(|_| OutOfMemory)?;
        let index: std::collections::HashMap<[u32; 2], u32> =
            system.springs.iter().enumerate().map(|(e, s)| (s.ends, e as u32)).collect();
        let side = |a: u32, b: u32| index.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0);
        Ok(Self {
            freedoms: k,
            rank,
            sides: system
                .wedges
                .iter()
                .map(|w| w.corners)
                .map(|[a, b, c]| [side(a, b), side(b, c), side(c, a)])
                .collect(),
            factor: vec![0.0; symbolic.len_val()],
            values: vec![0.0; entries],
            pattern,
            symbolic,
            scratch,
            diagonal: vec![Matrix3::zeros(); system.len()],
            beside: vec![Matrix3::zeros(); system.springs.len()],
            bases: vec![Matrix3::identity(); system.len()],
            right: vec![0.0; size],
            unknown,
        })
    }

    /// The direction H⁻¹ f for the forces `f` at `x`, with `inertia` (N/mm, one a vertex) on the diagonal where time is stepped;
    /// false where H has no factor.
    ///
    /// H = Σ k d dᵀ + max(0, T/L) (I − d dᵀ) + Σ r' ∇s ∇sᵀ + anchors, within the surface; the pull of the surface on a vertex that
    /// is pressed against it adds T_t n·f ∇∇φ, as far as that is positive. All parts are positive, so the direction descends.
    pub(super) fn direction(
        &mut self,
        system: &System,
        x: &[Point3<f64>],
        forces: &[Vector3<f64>],
        inertia: impl Fn(usize) -> f64,
        out: &mut Vec<Vector3<f64>>,
    ) -> bool {
        self.assemble(system, x, inertia);
        // With the whole curvature of the surface first, which may leave the matrix indefinite; then with its positive part.
        if !(self.factorized(system, x, forces, true) || self.factorized(system, x, forces, false)) {
            return false;
        }
        let stack = MemStack::new(&mut self.scratch);
        let size = self.right.len();
        let right = MatMut::from_column_major_slice_mut(&mut self.right, size, 1);
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
        out.clear();
        out.resize(system.len(), Vector3::zeros());
        for (i, u) in self.unknown.iter().enumerate() {
            let Some(u) = u else { continue };
            let at = *u as usize * self.freedoms;
            for (c, value) in self.right[at..at + self.freedoms].iter().enumerate() {
                out[i] += self.bases[i].column(c) * *value;
            }
        }
        out.iter().all(|d| d.iter().all(|c| c.is_finite()))
    }

    fn factorized(&mut self, system: &System, x: &[Point3<f64>], forces: &[Vector3<f64>], whole: bool) -> bool {
        self.reduce(system, x, forces, whole);
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.values);
        let found = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            matrix,
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            faer::Spec::default(),
        );
        found.is_ok()
    }

    fn assemble(&mut self, system: &System, x: &[Point3<f64>], inertia: impl Fn(usize) -> f64) {
        let scale = system.options.stiffness;
        let law = &system.options.law;
        for (i, d) in self.diagonal.iter_mut().enumerate() {
            let anchor = system.anchor(i).map_or(0.0, |(k, _)| k);
            *d = Matrix3::from_diagonal_element(inertia(i) + anchor);
        }
        for (block, spring) in self.beside.iter_mut().zip(&system.springs) {
            let [a, b] = spring.ends.map(|i| i as usize);
            let k = spring_stiffness(law.at(spring, (x[a] - x[b]).norm(), scale), law.toe(spring, scale), x[a] - x[b]);
            self.diagonal[a] += k;
            self.diagonal[b] += k;
            *block = -k;
        }
        let Some(repulsion) = &system.options.repulsion else { return };
        for (wedge, sides) in system.wedges.iter().zip(&self.sides) {
            let normal = system.wedge_normal(wedge);
            wedge.pushes(repulsion, System::corners(wedge, x), &normal, |push| {
                for (c, side) in sides.iter().enumerate() {
                    let g = push.gradient[c] * push.slope;
                    self.diagonal[wedge.corners[c] as usize] += g * push.gradient[c].transpose();
                    let d = (c + 1) % 3;
                    // The block of a spring is that of its lower end's row and its higher end's column.
                    let (low, high) = if wedge.corners[c] < wedge.corners[d] { (c, d) } else { (d, c) };
                    self.beside[*side as usize] += push.gradient[low] * push.slope * push.gradient[high].transpose();
                }
            });
        }
    }

    /// Writes the matrix in the coordinates in which the vertices can move, and the right side.
    fn reduce(&mut self, system: &System, x: &[Point3<f64>], forces: &[Vector3<f64>], whole: bool) {
        let k = self.freedoms;
        let columns = self.pattern.col_ptr();
        for (i, u) in self.unknown.iter().enumerate() {
            let Some(u) = u else { continue };
            let first = *u as usize * k;
            let mut pull = Matrix2::zeros();
            if k == 2 {
                let (normal, curvature) = system.surface(i, &x[i]).unwrap_or_else(|| (Vector3::z(), Matrix3::zeros()));
                let across = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
                let t = normal.cross(&across).normalize();
                let s = normal.cross(&t);
                self.bases[i] = Matrix3::from_columns(&[t, s, normal]);
                let bent = curvature * normal.dot(&forces[i]);
                pull = within(&bent, t, s);
                if !whole {
                    pull = positive(&pull);
                }
            }
            let basis = self.bases[i];
            let mut inside = basis.transpose() * self.diagonal[i] * basis;
            inside.fixed_view_mut::<2, 2>(0, 0).add_assign(&pull);
            for c in 0..k {
                let at = columns[first + c] as usize;
                for r in c..k {
                    self.values[at + r - c] = inside[(r, c)];
                }
                self.right[first + c] = basis.column(c).dot(&forces[i]);
            }
        }
        for ((spring, rank), block) in system.springs.iter().zip(&self.rank).zip(&self.beside) {
            let Some(rank) = rank else { continue };
            let [a, b] = spring.ends.map(|i| i as usize);
            let Some(u) = self.unknown[a] else { continue };
            let between = self.bases[b].transpose() * block.transpose() * self.bases[a];
            for c in 0..k {
                let at = columns[u as usize * k + c] as usize + (k - c) + *rank as usize * k;
                for r in 0..k {
                    self.values[at + r] = between[(r, c)];
                }
            }
        }
    }
}

/// k d dᵀ + max(0, T/L) (I − d dᵀ): the stiffness of a spring without what would make it push sideways (Choi and Ko 2002).
#[inline]
pub(super) fn spring_stiffness([_, tension, slope]: [f64; 3], toe: f64, along: Vector3<f64>) -> Matrix3<f64> {
    let squared = along.norm_squared();
    let slope = slope.max(LEAST_SHARE * toe);
    if squared < 1e-18 {
        return Matrix3::from_diagonal_element(slope);
    }
    let sideways = (tension / squared.sqrt()).max(0.0);
    let mut k = along * along.transpose() * ((slope - sideways) / squared);
    for a in 0..3 {
        k[(a, a)] += sideways;
    }
    k
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
