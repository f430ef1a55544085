//! The Cholesky factor of a sparse symmetric matrix of small blocks, one row of them a vertex.
//!
//! A = L Lᵀ column by column: from each column of A the earlier columns of L that reach into it are taken (left-looking), its diagonal
//! block is factored, and the rest is divided by that. Columns are in an order of approximate minimum degree (Amestoy, Davis and Duff
//! 1996), found once a pattern. Small meshes gain from it: a general factor spends more on finding its numbers than on reckoning
//! with them.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::amd;
use pulp::{Arch, Simd, WithSimd};

/// A block, column by column.
pub(super) type Block<const K: usize> = [[f64; K]; K];

/// A matrix, and after [`BlockCholesky::factorize`] its factor.
#[derive(Debug)]
pub(super) struct BlockCholesky<const K: usize> {
    /// Place of each unknown in the order of elimination.
    place: Vec<u32>,
    /// Where each column's blocks below the diagonal begin; one more than there are columns.
    starts: Vec<u32>,
    /// Row of each block, ascending within a column.
    rows: Vec<u32>,
    /// Where the blocks left of each row's diagonal begin in `left`.
    left_starts: Vec<u32>,
    left: Vec<Reach>,
    diagonal: Vec<Block<K>>,
    below: Vec<Block<K>>,
    /// A column while it is worked on.
    column: Vec<Block<K>>,
    right: Vec<[f64; K]>,
}

/// A block left of the diagonal.
#[derive(Clone, Copy, Debug)]
struct Reach {
    /// Its number.
    from: u32,
    /// Where its column ends.
    to: u32,
    /// Whether the next one's column has the same rows from here on, so that both can be taken at once.
    with_next: bool,
}

/// Where a pair of unknowns has its block: its number, and whether the first of the pair is the row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    block: u32,
    first_is_row: bool,
}

impl<const K: usize> BlockCholesky<K> {
    /// Orders a matrix with a block on the diagonal for each of `count` unknowns and one for each of these pairs; none where memory is
    /// not to be had.
    pub(super) fn new(count: usize, pairs: &[[u32; 2]]) -> Option<Self> {
        let place = order(count, pairs)?;
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); count];
        for pair in pairs {
            let [a, b] = pair.map(|u| place[u as usize]);
            columns[a.min(b) as usize].push(a.max(b));
        }
        // Column j of L has the rows of A and those of each column whose first row is j.
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); count];
        for j in 0..count {
            let mut rows = std::mem::take(&mut columns[j]);
            for &c in &children[j] {
                rows.extend(columns[c as usize].iter().skip(1));
            }
            rows.sort_unstable();
            rows.dedup();
            if let Some(&parent) = rows.first() {
                children[parent as usize].push(j as u32);
            }
            columns[j] = rows;
        }
        let mut starts = vec![0_u32];
        let mut rows = Vec::new();
        let mut left: Vec<Vec<Reach>> = vec![Vec::new(); count];
        for column in &columns {
            let end = (rows.len() + column.len()) as u32;
            for &row in column {
                left[row as usize].push(Reach { from: rows.len() as u32, to: end, with_next: false });
                rows.push(row);
            }
            starts.push(end);
        }
        for row in &mut left {
            let of = |r: Reach| &rows[r.from as usize..r.to as usize];
            let mut k = 0;
            while k + 1 < row.len() {
                row[k].with_next = of(row[k]) == of(row[k + 1]);
                k += 1 + usize::from(row[k].with_next);
            }
        }
        let mut left_starts = vec![0_u32];
        for row in &left {
            left_starts.push(left_starts[left_starts.len() - 1] + row.len() as u32);
        }
        let zero = [[0.0; K]; K];
        Some(Self {
            diagonal: vec![zero; count],
            below: vec![zero; rows.len()],
            column: vec![zero; count],
            right: vec![[0.0; K]; count],
            left: left.into_iter().flatten().collect(),
            place,
            starts,
            rows,
            left_starts,
        })
    }

    /// Where the block of a pair stands.
    pub(super) fn slot(&self, [a, b]: [u32; 2]) -> Option<Slot> {
        let [a, b] = [a, b].map(|u| self.place[u as usize]);
        let (low, high) = (a.min(b), a.max(b));
        let (from, to) = (self.starts[low as usize] as usize, self.starts[low as usize + 1] as usize);
        let at = self.rows[from..to].binary_search(&high).ok()?;
        Some(Slot { block: (from + at) as u32, first_is_row: a > b })
    }

    /// All blocks 0.
    pub(super) fn clear(&mut self) {
        self.diagonal.fill([[0.0; K]; K]);
        self.below.fill([[0.0; K]; K]);
    }

    /// Block on the diagonal of an unknown.
    pub(super) fn diagonal(&mut self, unknown: u32) -> &mut Block<K> {
        &mut self.diagonal[self.place[unknown as usize] as usize]
    }

    /// Adds to the block of a pair, its row the first of the pair.
    #[inline]
    pub(super) fn add(&mut self, slot: Slot, block: &Block<K>) {
        let to = &mut self.below[slot.block as usize];
        for c in 0..K {
            for r in 0..K {
                to[c][r] += if slot.first_is_row { block[c][r] } else { block[r][c] };
            }
        }
    }

    /// Puts the factor in the place of the matrix; false where the matrix is not positive.
    pub(super) fn factorize(&mut self) -> bool {
        Arch::new().dispatch(Factorize(self))
    }

    /// A⁻¹ b with the last factor, in place: K numbers an unknown.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        for (from, place) in b.chunks_exact(K).zip(&self.place) {
            self.right[*place as usize].copy_from_slice(from);
        }
        Arch::new().dispatch(Solve(self));
        for (to, place) in b.chunks_exact_mut(K).zip(&self.place) {
            to.copy_from_slice(&self.right[*place as usize]);
        }
    }
}

/// a −= b cᵀ.
#[inline(always)]
fn take<const K: usize>(a: &mut Block<K>, b: &Block<K>, c: &Block<K>) {
    for col in 0..K {
        for q in 0..K {
            for row in 0..K {
                a[col][row] -= b[q][row] * c[q][col];
            }
        }
    }
}

struct Factorize<'a, const K: usize>(&'a mut BlockCholesky<K>);

impl<const K: usize> WithSimd for Factorize<'_, K> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let BlockCholesky { starts, rows, left_starts, left, diagonal, below, column, .. } = self.0;
        for j in 0..diagonal.len() {
            let own = starts[j] as usize..starts[j + 1] as usize;
            for (row, block) in rows[own.clone()].iter().zip(&below[own.clone()]) {
                column[*row as usize] = *block;
            }
            let mut d = diagonal[j];
            let mut reaching = &left[left_starts[j] as usize..left_starts[j + 1] as usize];
            while let [one, others @ ..] = reaching {
                let first = &below[one.from as usize..one.to as usize];
                let to = &rows[one.from as usize + 1..one.to as usize];
                take(&mut d, &first[0], &first[0]);
                match others {
                    [next, after @ ..] if one.with_next => {
                        let second = &below[next.from as usize..next.to as usize];
                        take(&mut d, &second[0], &second[0]);
                        for ((row, a), b) in to.iter().zip(&first[1..]).zip(&second[1..]) {
                            let target = &mut column[*row as usize];
                            take(target, a, &first[0]);
                            take(target, b, &second[0]);
                        }
                        reaching = after;
                    }
                    _ => {
                        for (row, a) in to.iter().zip(&first[1..]) {
                            take(&mut column[*row as usize], a, &first[0]);
                        }
                        reaching = others;
                    }
                }
            }
            let Some(inverse) = inverse_of_factor(&d) else { return false };
            diagonal[j] = inverse;
            for (row, block) in rows[own.clone()].iter().zip(&mut below[own]) {
                let a = column[*row as usize];
                *block = [[0.0; K]; K];
                for c in 0..K {
                    for q in 0..=c {
                        for r in 0..K {
                            block[c][r] += a[q][r] * inverse[q][c];
                        }
                    }
                }
            }
        }
        true
    }
}

/// L⁻¹ of a small block L Lᵀ, of which the part below the diagonal is read; none where it is not positive.
#[inline(always)]
fn inverse_of_factor<const K: usize>(d: &Block<K>) -> Option<Block<K>> {
    let (mut l, mut inverse) = ([[0.0; K]; K], [[0.0; K]; K]);
    for c in 0..K {
        let mut pivot = d[c][c];
        for earlier in &l[..c] {
            pivot -= earlier[c] * earlier[c];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        l[c][c] = root;
        for r in c + 1..K {
            let mut sum = d[c][r];
            for earlier in &l[..c] {
                sum -= earlier[r] * earlier[c];
            }
            l[c][r] = sum / root;
        }
    }
    for c in 0..K {
        inverse[c][c] = 1.0 / l[c][c];
        for r in c + 1..K {
            let mut sum = 0.0;
            for q in c..r {
                sum += l[q][r] * inverse[c][q];
            }
            inverse[c][r] = -sum / l[r][r];
        }
    }
    Some(inverse)
}

struct Solve<'a, const K: usize>(&'a mut BlockCholesky<K>);

impl<const K: usize> WithSimd for Solve<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let BlockCholesky { starts, rows, diagonal, below, right, .. } = self.0;
        for j in 0..diagonal.len() {
            let (b, inverse) = (right[j], &diagonal[j]);
            let mut y = [0.0; K];
            for c in 0..K {
                for r in c..K {
                    y[r] += inverse[c][r] * b[c];
                }
            }
            right[j] = y;
            let own = starts[j] as usize..starts[j + 1] as usize;
            for (row, block) in rows[own.clone()].iter().zip(&below[own]) {
                let to = &mut right[*row as usize];
                for c in 0..K {
                    for r in 0..K {
                        to[r] -= block[c][r] * y[c];
                    }
                }
            }
        }
        for j in (0..diagonal.len()).rev() {
            let mut sum = right[j];
            let own = starts[j] as usize..starts[j + 1] as usize;
            for (row, block) in rows[own.clone()].iter().zip(&below[own]) {
                let from = right[*row as usize];
                for c in 0..K {
                    for r in 0..K {
                        sum[c] -= block[c][r] * from[r];
                    }
                }
            }
            let inverse = &diagonal[j];
            let mut x = [0.0; K];
            for c in 0..K {
                for r in c..K {
                    x[c] += inverse[c][r] * sum[r];
                }
            }
            right[j] = x;
        }
    }
}

/// Place of each unknown in an order of approximate minimum degree.
fn order(count: usize, pairs: &[[u32; 2]]) -> Option<Vec<u32>> {
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); count];
    for &[a, b] in pairs {
        beside[a.min(b) as usize].push(a.max(b));
        beside[a.max(b) as usize].push(a.min(b));
    }
    let (mut starts, mut rows) = (vec![0_u32], Vec::new());
    for (i, others) in beside.iter_mut().enumerate() {
        others.push(i as u32);
        others.sort_unstable();
        others.dedup();
        rows.extend_from_slice(others);
        starts.push(rows.len() as u32);
    }
    let entries = rows.len();
    let pattern = SymbolicSparseColMat::new_checked(count, count, starts, None, rows);
    let (mut forward, mut place) = (vec![0_u32; count], vec![0_u32; count]);
    let mut scratch = MemBuffer::try_new(amd::order_scratch::<u32>(count, entries)).ok()?;
    amd::order(&mut forward, &mut place, pattern.as_ref(), amd::Control::default(), MemStack::new(&mut scratch))
        .ok()?;
    Some(place)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::face::patches::{Noise, triangular};

    /// The matrix of a mesh's edges with random blocks, plus so much on the diagonal, once as blocks and once with all its zeros.
    fn both<const K: usize>(on_diagonal: f64) -> (BlockCholesky<K>, DMatrix<f64>) {
        let mesh = triangular(7, 6, 1.0);
        let mut noise = Noise(5);
        let mut matrix = BlockCholesky::<K>::new(mesh.len(), mesh.edges()).unwrap();
        let mut whole = DMatrix::zeros(K * mesh.len(), K * mesh.len());
        matrix.clear();
        for u in 0..mesh.len() {
            for c in 0..K {
                matrix.diagonal(u as u32)[c][c] += on_diagonal;
                whole[(K * u + c, K * u + c)] += on_diagonal;
            }
        }
        for &[a, b] in mesh.edges() {
            let block: Block<K> = std::array::from_fn(|_| std::array::from_fn(|_| noise.uniform()));
            let slot = matrix.slot([a, b]).unwrap();
            assert!(matrix.slot([b, a]).is_some_and(|other| other != slot));
            // Once as it stands and once from the other side: two halves.
            let half = block.map(|column| column.map(|v| 0.5 * v));
            let turned: Block<K> = std::array::from_fn(|c| std::array::from_fn(|r| half[r][c]));
            matrix.add(slot, &half);
            let other = matrix.slot([b, a]).unwrap();
            matrix.add(other, &turned);
            for c in 0..K {
                for r in 0..K {
                    whole[(K * a as usize + r, K * b as usize + c)] = block[c][r];
                    whole[(K * b as usize + c, K * a as usize + r)] = block[c][r];
                }
            }
        }
        (matrix, whole)
    }

    fn agrees_with_a_dense_factor<const K: usize>() {
        let (mut matrix, whole) = both::<K>(9.0);
        assert!(matrix.factorize());
        for seed in [1.0, 2.0] {
            let right = DVector::from_fn(whole.nrows(), |i, _| (seed * i as f64).sin());
            let expected = whole.clone().cholesky().unwrap().solve(&right);
            let mut found = right.as_slice().to_vec();
            matrix.solve(&mut found);
            let apart = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-13, "{K}: {apart}");
        }
    }

    #[test]
    fn solutions_agree_with_a_dense_factor() {
        agrees_with_a_dense_factor::<2>();
        agrees_with_a_dense_factor::<3>();
    }

    /// Six neighbours with blocks of size 1 outweigh 0.1 on the diagonal.
    #[test]
    fn a_matrix_that_is_not_positive_has_no_factor() {
        let (mut matrix, whole) = both::<2>(0.1);
        assert!(whole.cholesky().is_none());
        assert!(!matrix.factorize());
        matrix.clear();
        for u in 0..42 {
            matrix.diagonal(u)[0][0] = f64::NAN;
        }
        assert!(!matrix.factorize(), "no number");
    }

    #[test]
    fn a_matrix_of_nothing_has_a_factor_of_nothing() {
        let mut matrix = BlockCholesky::<2>::new(0, &[]).unwrap();
        assert!(matrix.factorize());
        matrix.solve(&mut []);
    }
}
