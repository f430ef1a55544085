//! The normal equations of everything that is fitted to a motion on a lattice.

use std::sync::Arc;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Side};
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use super::lattice::{Difference, Lattice, REACH};
use super::level::{Pull, Reaches};

/// What holds a node that nothing else holds, per squared px.
const LITTLE: f64 = 1e-6;
/// Right sides that are solved for together.
const AT_ONCE: usize = 8;
/// Ways from a spot to those after it whose splines overlap with its own: to the right in its row, and all in the next three rows.
const PAIRS: usize = 25;

/// Normal equations of a motion on a lattice: H c = b, with 2 × 2 blocks for overlapping splines.
pub(super) struct Normal {
    pub(super) lattice: Arc<Lattice>,
    /// The first block of each node, which is that with itself, and one more.
    starts: Vec<usize>,
    /// By how much the block of a node with the first node of a spot so far after it is farther on.
    slots: Vec<[u32; PAIRS]>,
    /// The number of the first node of the spot of each.
    firsts: Vec<usize>,
    /// xx, xy and yy of each block.
    blocks: Vec<[f64; 3]>,
    /// Whether blocks are added, or right sides alone.
    both: bool,
    pub(super) right: Vec<Vector2<f64>>,
    pattern: SymbolicSparseColMat<usize>,
    order: SymbolicLlt<usize>,
}

/// Cholesky's factor of the equations.
pub(super) struct Factor {
    count: usize,
    factor: Llt<usize, f64>,
}

/// How a pair of nodes is counted: the later one lies so many rows and columns after the earlier.
fn pair(right: isize, down: isize) -> usize {
    if down == 0 { right as usize } else { (4 + 7 * (down - 1) + right + 3) as usize }
}

impl Normal {
    /// Empty equations of a lattice, with the order in which they are solved.
    pub(super) fn of(lattice: Lattice) -> Option<Self> {
        let count = lattice.len();
        let (mut starts, mut slots, mut firsts) = (vec![0], vec![[0; PAIRS]; count], vec![0; count]);
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for (number, node) in lattice.nodes.iter().enumerate() {
            firsts[number] = lattice.beside(node, 0, 0).next()?;
            let mut after = Vec::with_capacity(PAIRS);
            for down in 0..4 {
                for right in if down == 0 { 0..4 } else { -3..4 } {
                    slots[number][pair(right, down)] = after.len() as u32;
                    after.extend(lattice.beside(node, right, down).filter(|n| *n >= number));
                }
            }
            for axis in 0..2 {
                rows.extend(after.iter().flat_map(|n| [2 * n, 2 * n + 1]).filter(|row| *row >= 2 * number + axis));
                columns.push(rows.len());
            }
            starts.push(starts[number] + after.len());
        }
        let pattern = SymbolicSparseColMat::new_checked(2 * count, 2 * count, columns, None, rows);
        let order = SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).ok()?;
        Some(Self {
            blocks: vec![[0.0; 3]; starts[count]],
            both: true,
            lattice: Arc::new(lattice),
            starts,
            slots,
            firsts,
            right: vec![Vector2::zeros(); count],
            pattern,
            order,
        })
    }

    /// Begins anew; or, unless both sides are wanted, with another right side of the same blocks.
    pub(super) fn clear(&mut self, both: bool) {
        self.both = both;
        if both {
            self.blocks.fill([0.0; 3]);
        }
        self.right.fill(Vector2::zeros());
    }

    /// Adds a symmetric block to a pair of nodes (once for the two orders).
    fn add(&mut self, a: usize, b: usize, block: [f64; 3]) {
        if !self.both {
            return;
        }
        let (early, late) = if a <= b { (a, b) } else { (b, a) };
        let [from, to] = [early, late].map(|k| self.lattice.nodes[k]);
        let right = to.column.cast_signed() - from.column.cast_signed();
        let down = to.row.cast_signed() - from.row.cast_signed();
        // Nodes of one spot stand one after the other; of its own spot a node counts from itself.
        let first = if [right, down] == [0, 0] { early } else { self.firsts[late] };
        let slot = self.starts[early] + self.slots[early][pair(right, down)] as usize + (late - first);
        for (sum, v) in self.blocks[slot].iter_mut().zip(block) {
            *sum += v;
        }
    }

    /// Adds a difference that should be none, with its weight.
    pub(super) fn hold(&mut self, difference: &Difference, weight: f64, coefficients: &[Vector2<f64>]) {
        let now = difference.of(coefficients);
        for (k, (a, fa)) in difference.terms.iter().enumerate() {
            for (b, fb) in &difference.terms[..=k] {
                let v = weight * fa * fb;
                self.add(*a, *b, [v, 0.0, v]);
            }
            self.right[*a] -= now * (weight * fa);
        }
    }

    /// Adds a motion that is seen at a place: `left` is what is still wanting, with its weight.
    pub(super) fn see(&mut self, (at, triangle): (&Point2<f64>, u32), left: &Vector2<f64>, weight: f64) {
        let taps = self.lattice.taps(at);
        let Some(nodes) = self.lattice.reach(&taps, triangle) else { return };
        let values = taps.values();
        for k in 0..REACH {
            for l in 0..=k {
                let v = weight * values[k] * values[l];
                self.add(nodes[k], nodes[l], [v, 0.0, v]);
            }
            self.right[nodes[k]] += left * (weight * values[k]);
        }
    }

    /// Adds the pulls of tiles, times a factor. Tiles of a cell, which the same nodes reach, are summed side by side, and then once into
    /// the equations.
    pub(super) fn pull(&mut self, reach: &Reaches, pulls: &[Pull], factor: f64) {
        let both = self.both;
        let sums: Vec<Option<Cell>> = reach.cells.par_iter().map(|tiles| Cell::of(tiles, reach, pulls, both)).collect();
        for cell in sums.into_iter().flatten() {
            let mut block = 0;
            for k in 0..REACH {
                for l in 0..=k {
                    self.add(cell.nodes[k], cell.nodes[l], cell.blocks[block].map(|v| v * factor));
                    block += 1;
                }
                self.right[cell.nodes[k]] += cell.right[k] * factor;
            }
        }
    }

    /// A little weight of every node itself, so that what nothing else holds stays.
    pub(super) fn rest(&mut self) {
        for node in 0..self.lattice.len() {
            self.add(node, node, [LITTLE, 0.0, LITTLE]);
        }
    }

    /// The equations, ready to be solved; none where they do not hold everything.
    pub(super) fn factor(&self) -> Option<Factor> {
        let count = self.lattice.len();
        let mut values = Vec::with_capacity(self.pattern.row_idx().len());
        for blocks in self.starts.windows(2).map(|range| &self.blocks[range[0]..range[1]]) {
            for axis in 0..2 {
                for (k, [xx, xy, yy]) in blocks.iter().enumerate() {
                    let column = if axis == 0 { [xx, xy] } else { [xy, yy] };
                    // The block with itself is on the diagonal: only its lower half is stored.
                    values.extend(column[if k == 0 { axis } else { 0 }..].iter().copied());
                }
            }
        }
        let matrix = SparseColMat::new(self.pattern.clone(), values);
        let factor = Llt::try_new_with_symbolic(self.order.clone(), matrix.as_ref(), Side::Lower).ok()?;
        Some(Factor { count, factor })
    }
}

impl Factor {
    /// The answers to several right sides.
    pub(super) fn solve(&self, sides: &[&[Vector2<f64>]]) -> Vec<Vec<Vector2<f64>>> {
        let count = self.count;
        let some = |sides: &[&[Vector2<f64>]]| -> Vec<Vec<Vector2<f64>>> {
            let mut right = Mat::from_fn(2 * count, sides.len(), |row, column| sides[column][row / 2][row % 2]);
            self.factor.solve_in_place(&mut right);
            let of = |column: usize| {
                (0..count).map(|node| Vector2::new(right[(2 * node, column)], right[(2 * node + 1, column)])).collect()
            };
            (0..sides.len()).map(of).collect()
        };
        sides.par_chunks(AT_ONCE).flat_map_iter(some).collect()
    }
}

/// What the tiles say that the same sixteen nodes reach.
struct Cell {
    nodes: [usize; REACH],
    blocks: [[f64; 3]; REACH * (REACH + 1) / 2],
    right: [Vector2<f64>; REACH],
}

impl Cell {
    fn of(tiles: &[usize], reach: &Reaches, pulls: &[Pull], both: bool) -> Option<Self> {
        let nodes = reach.tiles[*tiles.first()?].as_ref()?.nodes;
        let mut cell = Self { nodes, blocks: [[0.0; 3]; REACH * (REACH + 1) / 2], right: [Vector2::zeros(); REACH] };
        for &tile in tiles {
            let Some(reach) = &reach.tiles[tile] else { continue };
            let pull = &pulls[tile];
            for (right, value) in cell.right.iter_mut().zip(&reach.values) {
                *right += pull.right * *value;
            }
            let mut block = 0;
            for k in if both { 0..REACH } else { 0..0 } {
                let own = pull.square.map(|s| s * reach.values[k]);
                for (sum, v) in cell.blocks[block..=block + k].iter_mut().zip(&reach.values) {
                    sum[0] += own[0] * v;
                    sum[1] += own[1] * v;
                    sum[2] += own[2] * v;
                }
                block += k + 1;
            }
        }
        Some(cell)
    }
}
