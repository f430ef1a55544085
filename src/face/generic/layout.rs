//! The edge flow of the left half of the generic face: a grid whose columns follow the fibres of the forehead, rings round eye,
//! mouth and nose in place of parts of it, and two coarser lines towards the rim.
//!
//! ```text
//!  midline ─▶ side            A block of the grid is replaced by rings that have as many vertices as its outline, so every line
//!  ├─┼─┼─┼─┼─┤  forehead      runs on; at the corners of a block five lines meet instead of four, as in any face that modellers
//!  ├─┼─┼─┼─┼─┤  brow          build for animation.
//!  ├─┼(eye )─┤
//!  ├(nose)─┼─┤
//!  (mouth )┼─┤
//!  ├─┼─┼─┼─┼─┤  chin
//! ```

use std::collections::BTreeSet;

use super::drawing::{
    BROW, Block, CHIN_ROW, COLUMNS, DRAWN, EYE, EYE_RINGS, INNER_RIM_SEGMENTS, MOUTH, MOUTH_RINGS, NOSE, NOSE_LINE,
    Place, RIM, ROWS, at_fraction,
};
use super::surface::step;

/// What may move a vertex when the mesh is made fair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pin {
    /// Nothing: it was drawn.
    Fixed,
    /// Fairing.
    Free,
}

/// The half mesh before fairing: x ≥ 0, the midline included.
pub(super) struct Layout {
    /// Places in the plane, mm.
    pub places: Vec<Place>,
    /// For each vertex what may move it.
    pub pins: Vec<Pin>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[usize; 3]>,
    /// Edges that the flow asks for, smaller vertex first: all but the diagonals of its cells.
    pub lines: BTreeSet<[usize; 2]>,
    /// `grid[column][row]`, where the grid was not replaced.
    pub grid: Vec<Vec<Option<usize>>>,
    /// Rings round the eye, outermost first (on the grid), each from its middle at the nose over the upper lid.
    pub eye: Vec<Vec<usize>>,
    /// Half rings round the mouth, outermost first (on the grid), each from the midline above to the midline below.
    pub mouth: Vec<Vec<usize>>,
    /// The rim from the midline above to the midline below.
    pub rim: Vec<usize>,
}

impl Layout {
    /// Lays all lines and fills the cells between them.
    pub(super) fn new() -> Self {
        let mut half = Self {
            places: Vec::new(),
            pins: Vec::new(),
            triangles: Vec::new(),
            lines: BTreeSet::new(),
            grid: Vec::new(),
            eye: Vec::new(),
            mouth: Vec::new(),
            rim: Vec::new(),
        };
        half.lay_grid();
        half.fill_grid();
        half.lay_nose();
        half.lay_eye();
        half.lay_mouth();
        half.lay_rim();
        half
    }

    fn vertex(&mut self, place: Place, pin: Pin) -> usize {
        // What lies on the midline stays there.
        self.pins.push(if place[0] == 0.0 { Pin::Fixed } else { pin });
        self.places.push(place);
        self.places.len() - 1
    }

    fn at(&self, column: usize, row: usize) -> Option<usize> {
        self.grid.get(column).and_then(|c| c.get(row)).copied().flatten()
    }

    /// Grid vertices: those that are drawn, and between drawn rows even steps along the columns.
    fn lay_grid(&mut self) {
        let drawn = |column: usize, row: usize| -> Option<Place> {
            if row == ROWS {
                return Some(CHIN_ROW[column]);
            }
            DRAWN
                .iter()
                .find(|(r, first, places)| *r == row && (*first..first + places.len()).contains(&column))
                .map(|(_, first, places)| places[column - first])
        };
        for column in 0..=COLUMNS {
            let mut cells = Vec::new();
            for row in 0..=ROWS {
                let hole = [EYE, MOUTH].iter().any(|b| b.holds_inside(column, row));
                let corner = column == COLUMNS && (row == 0 || row == ROWS);
                if hole || corner {
                    cells.push(None);
                    continue;
                }
                let place = drawn(column, row).unwrap_or_else(|| {
                    let above = (0..row).rev().find_map(|r| drawn(column, r).map(|p| (r, p)));
                    let below = (row..=ROWS).find_map(|r| drawn(column, r).map(|p| (r, p)));
                    match (above, below) {
                        (Some((a, p)), Some((b, q))) => {
                            at_fraction(&finely(p, q), (row - a) as f64 / (b - a) as f64, step)
                        }
                        (Some((_, p)), None) | (None, Some((_, p))) => p,
                        (None, None) => [0.0, 0.0],
                    }
                });
                let forehead = row == BROW || (row < BROW && column <= 6);
                let nose = column <= 2 && (7..=13).contains(&row);
                let pin = if forehead || nose { Pin::Fixed } else { Pin::Free };
                cells.push(Some(self.vertex(place, pin)));
            }
            self.grid.push(cells);
        }
    }

    /// Cells of the grid outside the blocks that are replaced; at a corner that was left out, one triangle.
    fn fill_grid(&mut self) {
        for column in 0..COLUMNS {
            for row in 0..ROWS {
                if [EYE, MOUTH, NOSE].iter().any(|b| b.holds_cell(column, row)) {
                    continue;
                }
                let corners = [(column, row), (column, row + 1), (column + 1, row + 1), (column + 1, row)];
                let corners: Vec<usize> = corners.iter().filter_map(|&(c, r)| self.at(c, r)).collect();
                self.cell(&corners);
            }
        }
    }

    /// A cell of three or four corners, counter-clockwise: its sides become lines, its better diagonal two triangles.
    fn cell(&mut self, corners: &[usize]) {
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            self.lines.insert([a.min(b), a.max(b)]);
        }
        match *corners {
            [a, b, c] => self.triangles.push([a, b, c]),
            [a, b, c, d] => {
                let long = |p: usize, q: usize| step(self.places[p], self.places[q]);
                if long(a, c) < long(b, d) {
                    self.triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    self.triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
            _ => {}
        }
    }

    /// The cells between two lines of equal length, the second to the left of the first.
    fn band(&mut self, first: &[usize], second: &[usize]) {
        for (a, b) in first.windows(2).zip(second.windows(2)) {
            self.cell(&[a[0], a[1], b[1], b[0]]);
        }
    }

    /// The block of the nose: a line inside its outline, and the grid's own vertices inside that.
    fn lay_nose(&mut self) {
        let outline = self.half_outline(NOSE);
        let line: Vec<usize> = NOSE_LINE.iter().map(|&p| self.vertex(p, Pin::Fixed)).collect();
        // Both lines run clockwise round the nose from the top; what is to be filled lies to their right.
        self.band(&line, &outline);
        let [first, last] = NOSE.rows;
        let wide = NOSE.columns[1];
        let inner = |half: &Self, column: usize, row: usize| -> Option<usize> {
            if row == first {
                line.get(column).copied()
            } else if row == last {
                line.get(line.len() - 1 - column).copied()
            } else if column == wide {
                line.get(wide + row - first).copied()
            } else {
                half.at(column, row)
            }
        };
        for column in 0..wide {
            for row in first..last {
                let corners = [(column, row), (column, row + 1), (column + 1, row + 1), (column + 1, row)];
                let corners: Vec<usize> = corners.iter().filter_map(|&(c, r)| inner(self, c, r)).collect();
                self.cell(&corners);
            }
        }
    }

    /// The outline of a block that touches the midline, from there above to there below.
    fn half_outline(&self, block: Block) -> Vec<usize> {
        let Block { columns: [_, wide], rows: [first, last] } = block;
        let above = (0..=wide).map(|c| (c, first));
        let side = (first + 1..last).map(|r| (wide, r));
        let below = (0..=wide).rev().map(|c| (c, last));
        above.chain(side).chain(below).filter_map(|(c, r)| self.at(c, r)).collect()
    }

    fn lay_eye(&mut self) {
        let Block { columns: [near, far], rows: [first, last] } = EYE;
        let middle = usize::midpoint(first, last);
        let outline: Vec<usize> = (first..=middle)
            .rev()
            .map(|r| (near, r))
            .chain((near + 1..=far).map(|c| (c, first)))
            .chain((first + 1..=last).map(|r| (far, r)))
            .chain((near..far).rev().map(|c| (c, last)))
            .chain((middle + 1..last).rev().map(|r| (near, r)))
            .filter_map(|(c, r)| self.at(c, r))
            .collect();
        self.eye.push(outline);
        for (ring, [upper, lower]) in EYE_RINGS.iter().enumerate() {
            let mut places = upper.cut(step);
            places.pop();
            places.extend(lower.cut(step));
            places.pop();
            let pin = if ring == 0 { Pin::Free } else { Pin::Fixed };
            let inner: Vec<usize> = places.into_iter().map(|p| self.vertex(p, pin)).collect();
            let closed = |ring: &[usize]| [ring, &ring[..1]].concat();
            let outer = closed(&self.eye[ring]);
            self.band(&closed(&inner), &outer);
            self.eye.push(inner);
        }
    }

    fn lay_mouth(&mut self) {
        self.mouth.push(self.half_outline(MOUTH));
        for (ring, [upper, lower]) in MOUTH_RINGS.iter().enumerate() {
            let mut places = upper.cut(step);
            places.pop();
            places.extend(lower.cut(step));
            let pin = if ring == 0 { Pin::Free } else { Pin::Fixed };
            let inner: Vec<usize> = places.into_iter().map(|p| self.vertex(p, pin)).collect();
            let outer = self.mouth[ring].clone();
            self.band(&inner, &outer);
            self.mouth.push(inner);
        }
    }

    /// The two lines between the grid and the outside: each coarser than the one before.
    fn lay_rim(&mut self) {
        const FINE: usize = 400;
        let above = (0..COLUMNS).map(|c| (c, 0));
        let side = (1..ROWS).map(|r| (COLUMNS, r));
        let below = (0..COLUMNS).rev().map(|c| (c, ROWS));
        let border: Vec<usize> = above.chain(side).chain(below).filter_map(|(c, r)| self.at(c, r)).collect();
        let mut rim: Vec<Place> = Vec::new();
        for line in &RIM {
            rim.pop();
            rim.extend(line.cut(step));
        }
        // Halfway between the border of the grid and the rim, cut evenly.
        let inside: Vec<Place> = border.iter().map(|&v| self.places[v]).collect();
        let halfway: Vec<Place> = (0..=FINE)
            .map(|k| {
                let t = k as f64 / FINE as f64;
                let (a, b) = (at_fraction(&inside, t, step), at_fraction(&rim, t, step));
                [0, 1].map(|j| f64::midpoint(a[j], b[j]))
            })
            .collect();
        let inner: Vec<usize> = (0..=INNER_RIM_SEGMENTS)
            .map(|k| at_fraction(&halfway, k as f64 / INNER_RIM_SEGMENTS as f64, step))
            .enumerate()
            .map(|(k, [x, y])| self.vertex([if k % INNER_RIM_SEGMENTS == 0 { 0.0 } else { x }, y], Pin::Free))
            .collect();
        let outer: Vec<usize> = rim.into_iter().map(|p| self.vertex(p, Pin::Fixed)).collect();
        self.strip(&border, &inner);
        self.strip(&inner, &outer);
        self.rim = outer;
    }

    /// Triangles between two lines of different fineness, the second to the left of the first seen along them.
    fn strip(&mut self, first: &[usize], second: &[usize]) {
        for line in [first, second] {
            self.lines.extend(line.windows(2).map(|w| [w[0].min(w[1]), w[0].max(w[1])]));
        }
        let long = |p: usize, q: usize| step(self.places[p], self.places[q]);
        let (mut i, mut j) = (0, 0);
        while i + 1 < first.len() || j + 1 < second.len() {
            let ahead = if j + 1 == second.len() {
                true
            } else if i + 1 == first.len() {
                false
            } else {
                long(first[i + 1], second[j]) < long(first[i], second[j + 1])
            };
            if ahead {
                self.triangles.push([first[i], first[i + 1], second[j]]);
                i += 1;
            } else {
                self.triangles.push([first[i], second[j + 1], second[j]]);
                j += 1;
            }
        }
    }
}

impl Block {
    fn holds_inside(self, column: usize, row: usize) -> bool {
        let left = self.columns[0] == 0 || column > self.columns[0];
        left && column < self.columns[1] && row > self.rows[0] && row < self.rows[1]
    }

    fn holds_cell(self, column: usize, row: usize) -> bool {
        (self.columns[0]..self.columns[1]).contains(&column) && (self.rows[0]..self.rows[1]).contains(&row)
    }
}

fn finely(from: Place, to: Place) -> Vec<Place> {
    const STEPS: usize = 16;
    (0..=STEPS).map(|k| [0, 1].map(|j| from[j] + k as f64 / STEPS as f64 * (to[j] - from[j]))).collect()
}
