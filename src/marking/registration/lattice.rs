//! A motion of skin as cubic B-splines on a square lattice of nodes, and the normal equations of everything that is fitted to it.

use std::collections::BTreeMap;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Side};
use nalgebra::{Matrix2, Point2, Vector2};
use rayon::prelude::*;

use super::level::{Pull, Reach};

/// Nodes whose splines reach a place.
pub(super) const REACH: usize = 16;
/// What holds a node that nothing else holds, per squared px.
const LITTLE: f64 = 1e-6;
/// Right sides that are solved for together.
const AT_ONCE: usize = 8;
/// No such node.
const NONE: u32 = u32::MAX;
/// Pairs of nodes whose splines overlap, each pair once: those to the right in the same row and all in the next three rows.
const PAIRS: usize = 25;

/// Nodes at equal distances over the skin of a picture; those whose splines reach no skin are left out.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    corner: Point2<f64>,
    /// Distance of two nodes, px.
    pub(super) spacing: f64,
    columns: usize,
    rows: usize,
    /// The number of each node of the square, row by row.
    numbers: Vec<u32>,
    /// Column and row of each numbered node.
    nodes: Vec<[usize; 2]>,
}

/// The splines at a place: products of four along x and four along y.
pub(super) struct Taps {
    column: usize,
    row: usize,
    x: [[f64; 4]; 3],
    y: [[f64; 4]; 3],
}

/// Values, slopes and second derivatives of the four cubic B-splines at `t` between the second and the third node.
fn splines(t: f64, spacing: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [s * s * s / 6.0, 2.0 / 3.0 - t * t * (2.0 - t) / 2.0, 2.0 / 3.0 - s * s * (2.0 - s) / 2.0, t * t * t / 6.0],
        [-s * s / 2.0, t * (1.5 * t - 2.0), -s * (1.5 * s - 2.0), t * t / 2.0].map(|d| d / spacing),
        [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t].map(|d| d / (spacing * spacing)),
    ]
}

impl Lattice {
    /// A lattice over places; none where there is no place, or where they lie too far apart to be of one picture.
    pub(super) fn over(places: &[Point2<f64>], spacing: f64) -> Option<Self> {
        const MOST_NODES: f64 = 1e6;
        let low = places.iter().fold(None, |l: Option<Point2<f64>>, p| Some(l.map_or(*p, |l| l.inf(p))))?;
        let high = places.iter().fold(low, |h, p| h.sup(p));
        let corner = low - Vector2::repeat(1.5 * spacing);
        let size = (high - low) / spacing;
        if !(size.x.is_finite() && size.y.is_finite() && (size.x + 6.0) * (size.y + 6.0) < MOST_NODES) {
            return None;
        }
        let [columns, rows] = [size.x, size.y].map(|s| s.ceil() as usize + 6);
        let mut lattice =
            Self { corner, spacing, columns, rows, numbers: vec![NONE; columns * rows], nodes: Vec::new() };
        for p in places {
            let taps = lattice.taps(p);
            for k in 0..REACH {
                let node = taps.node(&lattice, k);
                lattice.numbers[node] = 0;
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let number = &mut lattice.numbers[row * columns + column];
                if *number != NONE {
                    *number = lattice.nodes.len() as u32;
                    lattice.nodes.push([column, row]);
                }
            }
        }
        Some(lattice)
    }

    /// Numbered nodes.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The splines at a place; beyond the lattice those of its border.
    pub(super) fn taps(&self, at: &Point2<f64>) -> Taps {
        let along = |x: f64, count: usize| {
            let whole = (x.floor().max(0.0) as usize).min(count - 4);
            (whole, splines((x - whole as f64).clamp(0.0, 1.0), self.spacing))
        };
        // A place between nodes 1 and 2 is reached by nodes 0 to 3.
        let (column, x) = along((at.x - self.corner.x) / self.spacing, self.columns);
        let (row, y) = along((at.y - self.corner.y) / self.spacing, self.rows);
        Taps { column, row, x, y }
    }

    /// The sixteen numbered nodes that reach a place, with their values there; none where one of them is not numbered.
    pub(super) fn reach(&self, taps: &Taps) -> Option<([usize; REACH], [f64; REACH])> {
        let mut nodes = [0; REACH];
        for (k, node) in nodes.iter_mut().enumerate() {
            let number = self.numbers[taps.node(self, k)];
            if number == NONE {
                return None;
            }
            *node = number as usize;
        }
        Some((nodes, taps.values()))
    }

    fn number(&self, column: usize, row: usize, right: isize, down: isize) -> Option<usize> {
        let (c, r) = (column.checked_add_signed(right)?, row.checked_add_signed(down)?);
        let number = (c < self.columns && r < self.rows).then(|| self.numbers[r * self.columns + c])?;
        (number != NONE).then_some(number as usize)
    }

    /// The second differences of the nodes (along x, along y, and √2 times the mixed one): their squares add up to the bending energy
    /// of a thin plate, times the spacing squared. Each comes with the node in its middle.
    pub(super) fn differences(&self) -> Vec<Difference> {
        let mut all = Vec::with_capacity(3 * self.len());
        for (middle, [c, r]) in self.nodes.iter().enumerate() {
            let at = |right, down| self.number(*c, *r, right, down);
            let lines = [[at(-1, 0), at(1, 0)], [at(0, -1), at(0, 1)]];
            for [before, after] in lines {
                if let (Some(a), Some(b)) = (before, after) {
                    all.push(Difference { middle, terms: vec![(a, 1.0), (middle, -2.0), (b, 1.0)] });
                }
            }
            if let (Some(b), Some(d), Some(e)) = (at(1, 0), at(0, 1), at(1, 1)) {
                let s = std::f64::consts::SQRT_2;
                all.push(Difference { middle, terms: vec![(middle, s), (b, -s), (d, -s), (e, s)] });
            }
        }
        all
    }

    /// The numbered nodes about a node, itself among them.
    pub(super) fn about(&self, node: usize) -> impl Iterator<Item = usize> {
        let [c, r] = self.nodes[node];
        (-1..=1).flat_map(move |down| (-1..=1).filter_map(move |right| self.number(c, r, right, down)))
    }
}

/// A second difference of nodes.
pub(super) struct Difference {
    /// The node in its middle.
    pub(super) middle: usize,
    /// Nodes and their factors.
    pub(super) terms: Vec<(usize, f64)>,
}

impl Difference {
    /// Its value.
    pub(super) fn of(&self, coefficients: &[Vector2<f64>]) -> Vector2<f64> {
        self.terms.iter().map(|(n, f)| coefficients[*n] * *f).sum()
    }
}

impl Taps {
    /// The place in the square of the k-th node.
    fn node(&self, lattice: &Lattice, k: usize) -> usize {
        (self.row + k / 4) * lattice.columns + self.column + k % 4
    }

    fn values(&self) -> [f64; REACH] {
        std::array::from_fn(|k| self.x[0][k % 4] * self.y[0][k / 4])
    }

    /// The motion at the place, its gradient ∂u/∂(x, y), and its second derivatives xx, xy, yy.
    pub(super) fn motion(
        &self,
        nodes: &[usize; REACH],
        coefficients: &[Vector2<f64>],
    ) -> (Vector2<f64>, Matrix2<f64>, [Vector2<f64>; 3]) {
        let mut sums = [[Vector2::zeros(); 3]; 3];
        for (row, four) in nodes.chunks_exact(4).enumerate() {
            let mut line = [Vector2::zeros(); 3];
            for (column, node) in four.iter().enumerate() {
                for (l, x) in line.iter_mut().zip(&self.x) {
                    *l += coefficients[*node] * x[column];
                }
            }
            for (sum, y) in sums.iter_mut().zip(&self.y) {
                for (s, l) in sum.iter_mut().zip(&line) {
                    *s += l * y[row];
                }
            }
        }
        // sums[derivatives along y][derivatives along x]
        (sums[0][0], Matrix2::from_columns(&[sums[0][1], sums[1][0]]), [sums[0][2], sums[1][1], sums[2][0]])
    }
}

/// Normal equations of a motion on a lattice: H c = b, with 2 × 2 blocks for overlapping splines.
pub(super) struct Normal {
    pub(super) lattice: Lattice,
    /// Where the block of each node with each node after it stands.
    slots: Vec<[u32; PAIRS]>,
    /// xx, xy and yy of each block.
    blocks: Vec<[f64; 3]>,
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
        let mut slots = vec![[NONE; PAIRS]; count];
        let mut used = 0;
        let (mut starts, mut rows) = (Vec::with_capacity(2 * count + 1), Vec::new());
        starts.push(0);
        for (node, slot) in slots.iter_mut().enumerate() {
            let [c, r] = lattice.nodes[node];
            let mut after = Vec::with_capacity(PAIRS);
            for down in 0..4 {
                for right in if down == 0 { 0..4 } else { -3..4 } {
                    if let Some(other) = lattice.number(c, r, right, down) {
                        slot[pair(right, down)] = used;
                        used += 1;
                        after.push(other);
                    }
                }
            }
            for axis in 0..2 {
                rows.extend(after.iter().flat_map(|n| [2 * n, 2 * n + 1]).filter(|row| *row >= 2 * node + axis));
                starts.push(rows.len());
            }
        }
        let pattern = SymbolicSparseColMat::new_checked(2 * count, 2 * count, starts, None, rows);
        let order = SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).ok()?;
        Some(Self {
            lattice,
            slots,
            blocks: vec![[0.0; 3]; used as usize],
            right: vec![Vector2::zeros(); count],
            pattern,
            order,
        })
    }

    /// Begins anew.
    pub(super) fn clear(&mut self) {
        self.blocks.fill([0.0; 3]);
        self.right.fill(Vector2::zeros());
    }

    /// Adds a symmetric block to a pair of nodes (once for the two orders).
    fn add(&mut self, a: usize, b: usize, block: [f64; 3]) {
        let (early, late) = if a <= b { (a, b) } else { (b, a) };
        let ([c, r], [d, s]) = (self.lattice.nodes[early], self.lattice.nodes[late]);
        let slot = self.slots[early][pair(d.cast_signed() - c.cast_signed(), s.cast_signed() - r.cast_signed())];
        for (sum, v) in self.blocks[slot as usize].iter_mut().zip(block) {
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
    pub(super) fn see(&mut self, at: &Point2<f64>, left: &Vector2<f64>, weight: f64) {
        let Some((nodes, values)) = self.lattice.reach(&self.lattice.taps(at)) else { return };
        for k in 0..REACH {
            for l in 0..=k {
                let v = weight * values[k] * values[l];
                self.add(nodes[k], nodes[l], [v, 0.0, v]);
            }
            self.right[nodes[k]] += left * (weight * values[k]);
        }
    }

    /// Adds the pulls of tiles, times a factor.
    pub(super) fn pull(&mut self, reach: &[Option<Reach>], pulls: &[Pull], factor: f64) {
        // Tiles that the same nodes reach are summed side by side, and then once into the equations.
        let mut cells: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (k, reach) in reach.iter().enumerate() {
            if let Some(reach) = reach {
                cells.entry(reach.nodes[0]).or_default().push(k);
            }
        }
        let cells: Vec<Vec<usize>> = cells.into_values().collect();
        let sums: Vec<Option<Cell>> = cells.par_iter().map(|tiles| Cell::of(tiles, reach, pulls)).collect();
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
        for node in 0..self.slots.len() {
            self.add(node, node, [LITTLE, 0.0, LITTLE]);
        }
    }

    /// The equations, ready to be solved; none where they do not hold everything.
    pub(super) fn factor(&self) -> Option<Factor> {
        let count = self.slots.len();
        let mut values = Vec::with_capacity(self.pattern.row_idx().len());
        for slot in &self.slots {
            for axis in 0..2 {
                for k in slot.iter().filter(|k| **k != NONE) {
                    let [xx, xy, yy] = self.blocks[*k as usize];
                    let column = if axis == 0 { [xx, xy] } else { [xy, yy] };
                    // The block with itself is on the diagonal: only its lower half is stored.
                    let own = *k == slot[0];
                    values.extend_from_slice(&column[if own { axis } else { 0 }..]);
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
    fn of(tiles: &[usize], reach: &[Option<Reach>], pulls: &[Pull]) -> Option<Self> {
        let nodes = reach[*tiles.first()?].as_ref()?.nodes;
        let mut cell = Self { nodes, blocks: [[0.0; 3]; REACH * (REACH + 1) / 2], right: [Vector2::zeros(); REACH] };
        for &tile in tiles {
            let Some(reach) = &reach[tile] else { continue };
            let pull = &pulls[tile];
            let mut block = 0;
            for k in 0..REACH {
                let own = pull.square.map(|s| s * reach.values[k]);
                for (sum, v) in cell.blocks[block..=block + k].iter_mut().zip(&reach.values) {
                    sum[0] += own[0] * v;
                    sum[1] += own[1] * v;
                    sum[2] += own[2] * v;
                }
                block += k + 1;
                cell.right[k] += pull.right * reach.values[k];
            }
        }
        Some(cell)
    }
}
