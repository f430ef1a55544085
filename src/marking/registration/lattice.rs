//! Nodes of cubic B-splines over skin, with a copy of a node for each piece of skin that its spline reaches: the lips move apart although they touch.
//!
//! Where an opening cuts the skin within the reach of a node, each side has a node of its own there (virtual nodes; Molino, Bao and
//! Fedkiw 2004).

use nalgebra::{Matrix2, Point2, Vector2};

use super::super::cubic::splines;
use super::skin::Skin;

/// Nodes whose splines reach a place.
pub(super) const REACH: usize = 16;
/// No such node.
pub(super) const NONE: u32 = u32::MAX;

/// A node of one piece of skin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) column: usize,
    pub(super) row: usize,
    /// The piece, as [`Spot`] counts them.
    piece: u32,
}

/// A place of the square lattice: the triangles of skin within the reach of its spline, and the piece that each belongs to.
#[derive(Clone, Debug, Default)]
struct Spot {
    triangles: Vec<u32>,
    pieces: Vec<u32>,
    /// The number of the node of each piece; those of which nothing is seen have none.
    numbers: Vec<u32>,
}

/// Nodes at equal distances over the skin of a picture; those whose splines reach no skin are left out. Lattices over the same skin with
/// distances of h and h / 2 are nested: every node of the first is one of the second.
#[derive(Debug)]
pub(super) struct Lattice {
    /// The node in column and row [`MARGIN`] + 1.
    origin: Point2<f64>,
    /// Distance of two nodes, px.
    pub(super) spacing: f64,
    columns: usize,
    rows: usize,
    spots: Vec<Spot>,
    /// The nodes, row by row.
    pub(super) nodes: Vec<Node>,
    /// Those about each, itself among them, that hang together with it.
    about: Vec<Vec<usize>>,
    /// The second differences of the nodes (along x, along y, and √2 times the mixed one): their squares add up to the bending energy
    /// of a thin plate, times the spacing squared. None goes across an opening.
    pub(super) differences: Vec<Difference>,
}

/// The cell of the first skin is so far from the first.
const MARGIN: f64 = 2.0;
/// The coefficients of four nodes at half the distance, of the four about them at the whole: two cubic B-splines are one, split in halves
/// ((1, 4, 6, 4, 1) / 8; Lane and Riesenfeld 1980). First where the column of the first of the finer four is even, then where it is odd.
const HALVED: [[[f64; 4]; 4]; 2] = [
    [[0.5, 0.5, 0.0, 0.0], [0.125, 0.75, 0.125, 0.0], [0.0, 0.5, 0.5, 0.0], [0.0, 0.125, 0.75, 0.125]],
    [[0.125, 0.75, 0.125, 0.0], [0.0, 0.5, 0.5, 0.0], [0.0, 0.125, 0.75, 0.125], [0.0, 0.0, 0.5, 0.5]],
];

/// The splines at a place: products of four along x and four along y.
pub(super) struct Taps {
    /// Column and row of the first.
    first: [usize; 2],
    x: [[f64; 4]; 3],
    y: [[f64; 4]; 3],
}

/// The motion at a place, its gradient ∂u/∂(x, y), and its second derivatives xx, xy, yy.
pub(super) type Derivatives = (Vector2<f64>, Matrix2<f64>, [Vector2<f64>; 3]);

impl Spot {
    fn piece_of(&self, triangle: u32) -> Option<u32> {
        self.triangles.binary_search(&triangle).ok().map(|k| self.pieces[k])
    }

    fn number(&self, piece: u32) -> Option<usize> {
        self.numbers.get(piece as usize).copied().filter(|n| *n != NONE).map(|n| n as usize)
    }

    /// The nodes here that share a triangle with a piece of another spot.
    fn linked(&self, other: &Self, piece: u32) -> Vec<usize> {
        let shared = other.triangles.iter().zip(&other.pieces).filter(|(_, p)| **p == piece);
        let numbers = shared.filter_map(|(t, _)| self.number(self.piece_of(*t)?));
        // Where all skin hangs together the first answers for all.
        let most = if self.numbers.len() == 1 { 1 } else { usize::MAX };
        let mut found: Vec<usize> = numbers.take(most).collect();
        found.sort_unstable();
        found.dedup();
        found
    }
}

impl Lattice {
    /// A lattice over the skin; none where there is none, or where it is too large.
    pub(super) fn over(skin: &Skin, spacing: f64) -> Option<Self> {
        const MOST_NODES: f64 = 1e6;
        let places = skin.places();
        let (first, _) = places.first()?;
        let (low, high) = places.iter().fold((*first, *first), |(l, h), (p, _)| (l.inf(p), h.sup(p)));
        let size = (high - low) / spacing;
        let fits = (size.x + 6.0) * (size.y + 6.0) < MOST_NODES;
        if !fits {
            return None;
        }
        let [columns, rows] = [size.x, size.y].map(|s| s.ceil() as usize + 6);
        let mut lattice = Self {
            origin: low,
            spacing,
            columns,
            rows,
            spots: vec![Spot::default(); columns * rows],
            nodes: Vec::new(),
            about: Vec::new(),
            differences: Vec::new(),
        };
        lattice.cut(skin);
        let mut before = None;
        for (p, triangle) in &places {
            let first = [lattice.along(p.x, 0).0, lattice.along(p.y, 1).0];
            // Places stand row by row: most have the nodes of the one before.
            if before.replace((first, *triangle)) == Some((first, *triangle)) {
                continue;
            }
            for k in 0..REACH {
                let spot = &mut lattice.spots[spot_of(first, columns, k)];
                if let Some(piece) = spot.piece_of(*triangle) {
                    spot.numbers[piece as usize] = 0;
                }
            }
        }
        for (k, spot) in lattice.spots.iter_mut().enumerate() {
            for (piece, number) in spot.numbers.iter_mut().enumerate().filter(|(_, n)| **n != NONE) {
                *number = lattice.nodes.len() as u32;
                lattice.nodes.push(Node { column: k % columns, row: k / columns, piece: piece as u32 });
            }
        }
        let around = |node: &Node| {
            let all = (-1..=1).flat_map(|down| (-1..=1).map(move |right| (right, down)));
            all.flat_map(|(right, down)| lattice.linked(node, right, down)).collect()
        };
        lattice.about = lattice.nodes.iter().map(around).collect();
        lattice.differences = lattice.differences();
        Some(lattice)
    }

    /// Finds the pieces of skin within the reach of every spot.
    fn cut(&mut self, skin: &Skin) {
        // The spline of the node in column c is none before cell c − 3 and after cell c.
        let within = |low: f64, high: f64, count: usize| {
            let cell = |v: f64| v.floor().clamp(0.0, count as f64) as usize;
            let (first, end) = (cell(low), (cell(high) + 4).min(count));
            first.min(end)..end
        };
        for (triangle, [low, high]) in skin.boxes() {
            let [low, high] = [low, high].map(|p| ((p - self.origin) / self.spacing).map(|v| v + MARGIN));
            for row in within(low.y, high.y, self.rows) {
                for column in within(low.x, high.x, self.columns) {
                    self.spots[row * self.columns + column].triangles.push(triangle);
                }
            }
        }
        for spot in &mut self.spots {
            spot.pieces = skin.pieces(&spot.triangles);
            let count = spot.pieces.iter().map(|p| *p as usize + 1).max().unwrap_or(0);
            spot.numbers = vec![NONE; count];
        }
    }

    /// Nodes.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The first of the four columns (axis 0) or rows (axis 1) of nodes that reach a coordinate, and where it lies in their cell, 0 to 1;
    /// beyond the lattice those of its border.
    fn along(&self, at: f64, axis: usize) -> (usize, f64) {
        let count = [self.columns, self.rows][axis];
        let x = (at - self.origin[axis]) / self.spacing;
        // Rounded down before anything is added: so cells at half the distance lie within these, whatever the last digit.
        let whole = (x.floor() + MARGIN).clamp(0.0, (count - 4) as f64);
        (whole as usize, (x + MARGIN - whole).clamp(0.0, 1.0))
    }

    /// The splines at a place; beyond the lattice those of its border.
    pub(super) fn taps(&self, at: &Point2<f64>) -> Taps {
        let h = self.spacing;
        let [(column, x), (row, y)] = [0, 1].map(|axis| self.along(at[axis], axis));
        let [x, y] = [x, y].map(|t| {
            let [value, slope, second] = splines(t);
            [value, slope.map(|d| d / h), second.map(|d| d / (h * h))]
        });
        Taps { first: [column, row], x, y }
    }

    /// The sixteen nodes that reach a place of a triangle; none where one of them is missing.
    pub(super) fn reach(&self, taps: &Taps, triangle: u32) -> Option<[usize; REACH]> {
        self.sixteen(taps.first, triangle)
    }

    fn sixteen(&self, first: [usize; 2], triangle: u32) -> Option<[usize; REACH]> {
        let mut nodes = [0; REACH];
        for (k, node) in nodes.iter_mut().enumerate() {
            let spot = self.spots.get(spot_of(first, self.columns, k))?;
            *node = spot.number(spot.piece_of(triangle)?)?;
        }
        Some(nodes)
    }

    /// The coefficients here of a motion of a lattice over the same skin whose nodes are twice as far apart: the same motion, exactly.
    pub(super) fn refined(&self, coarse: &Self, coefficients: &[Vector2<f64>], skin: &Skin) -> Vec<Vector2<f64>> {
        let mut finer = vec![Vector2::zeros(); self.len()];
        let mut before = None;
        for (p, triangle) in skin.places() {
            let first = [self.along(p.x, 0).0, self.along(p.y, 1).0];
            if before.replace((first, triangle)) == Some((first, triangle)) {
                continue;
            }
            // Cell c of this lattice lies in cell c / 2 + 1 of the other: both count from two cells before the same place.
            let around = coarse.sixteen(first.map(|c| c / 2 + 1), triangle);
            let (Some(own), Some(around)) = (self.sixteen(first, triangle), around) else { continue };
            let [columns, rows] = first.map(|c| &HALVED[c % 2]);
            for (k, node) in own.iter().enumerate() {
                let weight = |l: usize| columns[k % 4][l % 4] * rows[k / 4][l / 4];
                finer[*node] = around.iter().enumerate().map(|(l, n)| coefficients[*n] * weight(l)).sum();
            }
        }
        finer
    }

    fn spot(&self, column: usize, row: usize, right: isize, down: isize) -> Option<&Spot> {
        let (c, r) = (column.checked_add_signed(right)?, row.checked_add_signed(down)?);
        (c < self.columns && r < self.rows).then(|| &self.spots[r * self.columns + c])
    }

    /// All nodes so far from a node.
    pub(super) fn beside(&self, node: &Node, right: isize, down: isize) -> impl Iterator<Item = usize> {
        let spot = self.spot(node.column, node.row, right, down);
        spot.into_iter().flat_map(|s| &s.numbers).filter(|n| **n != NONE).map(|n| *n as usize)
    }

    /// The nodes so far from a node whose skin hangs together with its own.
    fn linked(&self, node: &Node, right: isize, down: isize) -> Vec<usize> {
        let own = self.spot(node.column, node.row, 0, 0);
        let other = self.spot(node.column, node.row, right, down);
        own.zip(other).map_or(Vec::new(), |(own, other)| other.linked(own, node.piece))
    }

    fn differences(&self) -> Vec<Difference> {
        let mut all = Vec::with_capacity(3 * self.len());
        for (middle, node) in self.nodes.iter().enumerate() {
            for (before, after) in [([-1, 0], [1, 0]), ([0, -1], [0, 1])] {
                let after = self.linked(node, after[0], after[1]);
                for a in self.linked(node, before[0], before[1]) {
                    for &b in &after {
                        all.push(Difference { middle, terms: vec![(a, 1.0), (middle, -2.0), (b, 1.0)] });
                    }
                }
            }
            let s = std::f64::consts::SQRT_2;
            let below = self.linked(node, 0, 1);
            for b in self.linked(node, 1, 0) {
                for e in self.linked(&self.nodes[b], 0, 1) {
                    for d in below.iter().filter(|d| self.linked(&self.nodes[**d], 1, 0).contains(&e)) {
                        all.push(Difference { middle, terms: vec![(middle, s), (b, -s), (*d, -s), (e, s)] });
                    }
                }
            }
        }
        all
    }

    /// The nodes about a node, itself among them, whose skin hangs together with its own.
    pub(super) fn about(&self, node: usize) -> &[usize] {
        &self.about[node]
    }
}

/// A second difference of nodes.
#[derive(Debug)]
pub(super) struct Difference {
    /// The node in its middle, or at its corner.
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

/// The spot of the k-th of sixteen nodes, of which the first is in such a column and row, in a lattice of so many columns.
fn spot_of([column, row]: [usize; 2], columns: usize, k: usize) -> usize {
    (row + k / 4) * columns + column + k % 4
}

impl Taps {
    /// The splines of the sixteen nodes.
    pub(super) fn values(&self) -> [f64; REACH] {
        std::array::from_fn(|k| self.x[0][k % 4] * self.y[0][k / 4])
    }

    /// The motion that the sixteen nodes make here.
    pub(super) fn motion(&self, nodes: &[usize; REACH], coefficients: &[Vector2<f64>]) -> Derivatives {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the same skin, slit in its middle, a motion at nodes h apart is made by nodes h / 2 apart everywhere, on both sides of the slit.
    #[test]
    fn a_lattice_at_half_the_distance_makes_the_same_motion() {
        let skin = Skin::slit();
        let coarse = Lattice::over(&skin, 28.3).unwrap();
        let fine = Lattice::over(&skin, 14.15).unwrap();
        let mixed = |n: usize| (n as f64 * 12.9898).sin() * 4.0;
        let coefficients: Vec<Vector2<f64>> =
            (0..coarse.len()).map(|n| Vector2::new(mixed(2 * n), mixed(2 * n + 1))).collect();
        let finer = fine.refined(&coarse, &coefficients, &skin);
        let motion = |lattice: &Lattice, all: &[Vector2<f64>], p: &Point2<f64>, triangle: u32| {
            let taps = lattice.taps(p);
            taps.motion(&lattice.reach(&taps, triangle).unwrap(), all)
        };
        let (mut seen, mut widest) = (0, 0.0_f64);
        for (p, triangle) in skin.places() {
            let (u, gradient, second) = motion(&coarse, &coefficients, &p, triangle);
            let (v, finer_gradient, finer_second) = motion(&fine, &finer, &p, triangle);
            assert!((u - v).norm() < 1e-9 && (gradient - finer_gradient).norm() < 1e-9, "{p} {u} {v}");
            assert!(second.iter().zip(&finer_second).all(|(a, b)| (a - b).norm() < 1e-9));
            seen += 1;
            widest = widest.max(u.norm());
        }
        assert!(seen > 2000 && widest > 1.0, "{seen} places, {widest} px");
    }

    /// Beside a slit there are nodes for each of its sides; no difference holds one side by the other, and those at its ends hang together.
    #[test]
    fn nodes_beside_a_slit_are_of_one_side() {
        let (skin, whole) = (Skin::slit(), Skin::square(20.0, 220.0));
        let [cut, one] = [&skin, &whole].map(|s| Lattice::over(s, 10.0).unwrap());
        assert!(cut.len() > one.len());
        let (above, below) = (Point2::new(120.0, 115.0), Point2::new(120.0, 125.0));
        let nodes = |p: &Point2<f64>| cut.reach(&cut.taps(p), skin.near(p).unwrap()).unwrap();
        let [a, b] = [nodes(&above), nodes(&below)];
        assert!(a.iter().all(|n| !b.contains(n)));
        let both = |d: &&Difference| [&a, &b].iter().all(|side| d.terms.iter().any(|t| side.contains(&t.0)));
        assert_eq!(cut.differences.iter().filter(both).count(), 0);
        // Far from the slit the lattice is one.
        let (above, below) = (Point2::new(32.0, 115.0), Point2::new(32.0, 125.0));
        let [a, b] = [nodes(&above), nodes(&below)];
        assert!(a.iter().any(|n| b.contains(n)));
    }
}
