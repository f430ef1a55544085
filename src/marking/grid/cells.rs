//! The skin inside the cells of a painted grid: what tells one cell from the next.

use std::collections::BTreeMap;

use nalgebra::Point2;

use super::super::prepared::Prepared;
use super::GridPoint;

/// Places along each side of a cell where its skin is looked at.
const SIDE: usize = 7;
/// They lie within this share of the cell on either side of its middle, clear of the lines.
const WITHIN: f64 = 0.3;
/// A cell whose skin differs less from a plane tells nothing, grey levels.
const LEAST_RMS: f64 = 1.0;
/// How far from the shift that was voted for others are tried, columns and rows.
const AROUND: i32 = 2;
/// Cells to either side of a crossing that are asked about it alone.
const ABOUT: i32 = 2;
/// How much more alike the skin must be under one shift than under all others. Under a wrong one it is a sum over cells of correlations by
/// chance, divided by its own spread times √(SIDE²): about 0.15.
const CLEARLY: f64 = 0.75;

/// The skin inside each cell, by the column and row of its first crossing: brightness less the plane through it, of length 1.
pub(super) struct Cells(BTreeMap<(i32, i32), [f32; SIDE * SIDE]>);

/// What the cells tell of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    /// What must be added to its columns and rows.
    pub(super) shift: [i32; 2],
    /// Σ correlation / √cells under it.
    pub(super) alike: f64,
}

impl Cells {
    /// The cells of which all four crossings are known.
    pub(super) fn of(points: &[GridPoint], picture: &Prepared) -> Self {
        let at: BTreeMap<(i32, i32), Point2<f64>> = points.iter().map(|p| ((p.column, p.row), p.crossing.at)).collect();
        let cell = |(&(column, row), first): (&(i32, i32), &Point2<f64>)| {
            let right = at.get(&(column + 1, row))?;
            let [left_below, below] = [at.get(&(column, row + 1))?, at.get(&(column + 1, row + 1))?];
            let place = |x: f64, y: f64| {
                let [top, bottom] = [first.coords.lerp(&right.coords, x), left_below.coords.lerp(&below.coords, x)];
                Point2::from(top.lerp(&bottom, y))
            };
            Some(((column, row), inside(picture, place)?))
        };
        Self(at.iter().filter_map(cell).collect())
    }

    /// How alike the cells of a piece of another picture are to these, under shifts near the one that was voted for.
    pub(super) fn likeness(&self, piece: &Self, [columns, rows]: [i32; 2]) -> Likeness {
        let around = -AROUND..=AROUND;
        let shifts: Vec<[i32; 2]> =
            around.clone().flat_map(|dr| around.clone().map(move |dc| [columns + dc, rows + dr])).collect();
        let one = |(&(column, row), b): (&(i32, i32), &[f32; SIDE * SIDE])| {
            let under = |[dc, dr]: &[i32; 2]| {
                let a = self.0.get(&(column + dc, row + dr))?;
                Some(a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum())
            };
            ((column, row), shifts.iter().map(under).collect())
        };
        Likeness { cells: piece.0.iter().map(one).collect(), shifts }
    }
}

/// Correlations of each cell of a piece under each shift that is tried.
pub(super) struct Likeness {
    shifts: Vec<[i32; 2]>,
    cells: BTreeMap<(i32, i32), Vec<Option<f64>>>,
}

impl Likeness {
    /// The shift under which the whole piece looks alike; none where no shift stands out.
    pub(super) fn of_piece(&self) -> Option<Told> {
        self.told(self.cells.values())
    }

    /// The same of the cells about one crossing.
    pub(super) fn about(&self, point: &GridPoint) -> Option<Told> {
        let square = (-ABOUT..ABOUT).flat_map(|down| (-ABOUT..ABOUT).map(move |right| (right, down)));
        self.told(square.filter_map(|(right, down)| self.cells.get(&(point.column + right, point.row + down))))
    }

    fn told<'a>(&self, cells: impl Iterator<Item = &'a Vec<Option<f64>>>) -> Option<Told> {
        let mut sums = vec![(0.0, 0.0); self.shifts.len()];
        for cell in cells {
            for ((sum, count), likeness) in sums.iter_mut().zip(cell) {
                *sum += likeness.unwrap_or(0.0);
                *count += f64::from(u8::from(likeness.is_some()));
            }
        }
        let told =
            |(shift, (sum, count)): (&[i32; 2], (f64, f64))| Told { shift: *shift, alike: sum / count.max(1.0).sqrt() };
        let mut tried: Vec<Told> = self.shifts.iter().zip(sums).map(told).collect();
        tried.sort_by(|a, b| b.alike.total_cmp(&a.alike));
        let [best, next, ..] = tried.as_slice() else { return None };
        (best.alike > next.alike.max(0.0) + CLEARLY).then_some(*best)
    }
}

/// Brightness at even places of a cell, less the plane through it, of length 1; none where that is too little.
fn inside(picture: &Prepared, place: impl Fn(f64, f64) -> Point2<f64>) -> Option<[f32; SIDE * SIDE]> {
    let along = |k: usize| 2.0 * k as f64 / (SIDE - 1) as f64 - 1.0;
    let mut values: [f64; SIDE * SIDE] = std::array::from_fn(|k| {
        let [x, y] = [along(k % SIDE), along(k / SIDE)].map(|t| 0.5 + WITHIN * t);
        picture.spline().sample(&place(x, y)).value
    });
    // The places are symmetric about the middle: the plane's three parts do not know each other.
    let dot = |values: &[f64], f: &dyn Fn(usize) -> f64| -> f64 {
        let (up, square) = values.iter().enumerate().fold((0.0, 0.0), |(u, s), (k, v)| (u + v * f(k), s + f(k) * f(k)));
        up / square
    };
    let parts: [&dyn Fn(usize) -> f64; 3] = [&|_| 1.0, &|k| along(k % SIDE), &|k| along(k / SIDE)];
    for part in parts {
        let share = dot(&values, part);
        for (k, v) in values.iter_mut().enumerate() {
            *v -= share * part(k);
        }
    }
    let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length / SIDE as f64 > LEAST_RMS).then(|| values.map(|v| (v / length) as f32))
}
