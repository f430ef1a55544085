//! Which crossing of the first picture is which in the last.
//!
//! Lines tell crossings of one piece apart. Of another piece, beyond a brow or a fold, they do not: its lines may have been missed, or
//! pressed together. What lies *between* the lines does: the skin inside the cells, which no two cells have in common.

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Point2, Vector2};

use super::super::grid_crossing::Crossing;
use super::super::prepared::Prepared;
use super::cells::{Cells, Told};
use super::{Carried, FEWEST, GridPoint, Piece};

/// What the motion says of a place of the first picture.
type Expected<'a> = &'a (dyn Fn(&Point2<f64>) -> Option<Point2<f64>> + Sync);

/// A piece, and what its cells tell of it.
pub(super) type Part = (Piece, Option<Told>);

/// A piece of which nothing is told.
pub(super) fn untold(piece: &Piece) -> Part {
    (piece.clone(), None)
}

/// Which crossing of the first picture is which in the last.
///
/// Each crossing is sent to where `expected` says, and votes for the shift of columns and rows that the nearest crossing there has. Each
/// piece of the last picture takes the shift near the one with most votes under which the skin in its cells looks alike. Pieces of which
/// the cells do not tell it are numbered beside those; where no cells tell anything, the whole grid follows the majority.
pub fn carry(pictures: [&Prepared; 2], [first, last]: [&[Piece]; 2], expected: Expected) -> Vec<Carried> {
    let first = joined(&first.iter().map(untold).collect::<Vec<_>>());
    let own = Cells::of(&first, pictures[0]);
    let last: Vec<Part> = last.iter().flat_map(|piece| parts(piece, &first, &own, pictures[1], expected)).collect();
    let all = joined(&last);
    let last = if last.iter().any(|(_, told)| told.is_some()) {
        all
    } else {
        let Some(([dc, dr], _)) = elected(&first, &all, expected).filter(|(_, sure)| *sure) else { return Vec::new() };
        all.into_iter().map(|p| GridPoint { column: p.column + dc, row: p.row + dr, ..p }).collect()
    };
    let at: BTreeMap<(i32, i32), Crossing> = last.iter().map(|p| ((p.column, p.row), p.crossing)).collect();
    let left = first.iter().map(|p| p.column).min().unwrap_or(0);
    let top = first.iter().map(|p| p.row).min().unwrap_or(0);
    let carried = first.iter().filter_map(|p| {
        let last = *at.get(&(p.column, p.row))?;
        Some(Carried { column: p.column - left, row: p.row - top, first: p.crossing, last })
    });
    agreeing(carried.collect())
}

/// So near to crossings of another shift one is not certain, columns and rows.
const SEAM: i32 = 1;

/// A piece of the last picture with the shift that its cells tell, in several where parts of it clearly have another: in skin pressed
/// together a walk may miss a line at both its ends alike.
fn parts(piece: &Piece, first: &[GridPoint], own: &Cells, picture: &Prepared, expected: Expected) -> Vec<Part> {
    let likeness = elected(first, &piece.points, expected)
        .map(|(voted, _)| own.likeness(&Cells::of(&piece.points, picture), voted));
    let Some((likeness, whole)) = likeness.and_then(|l| l.of_piece().map(|whole| (l, whole))) else {
        return vec![untold(piece)];
    };
    let each: Vec<Option<Told>> = piece.points.iter().map(|p| likeness.about(p)).collect();
    let mut parts: BTreeMap<[i32; 2], (Piece, Told)> = BTreeMap::new();
    for (p, one) in piece.points.iter().zip(&each) {
        let told = one.unwrap_or(whole);
        let other = |(q, told_there): (&GridPoint, &Option<Told>)| {
            (q.column - p.column).abs().max((q.row - p.row).abs()) <= SEAM
                && told_there.is_some_and(|t| t.shift != told.shift)
        };
        // Beside a seam nothing is certain.
        if piece.points.iter().zip(&each).any(other) {
            continue;
        }
        let (part, best) = parts.entry(told.shift).or_insert_with(|| (Piece::default(), told));
        part.points.push(*p);
        best.alike = best.alike.max(told.alike);
    }
    parts.into_values().map(|(part, told)| (part, Some(told))).collect()
}

/// What must be added to columns and rows of the last picture so that they are those of the first, by most votes, and whether it is sure:
/// where the skin moved by a cell a few are sent to the wrong one, and it does no harm.
fn elected(first: &[GridPoint], last: &[GridPoint], expected: Expected) -> Option<([i32; 2], bool)> {
    let mut votes: BTreeMap<[i32; 2], usize> = BTreeMap::new();
    for p in first {
        let Some(to) = expected(&p.crossing.at) else { continue };
        let distance = |q: &&GridPoint| (q.crossing.at - to).norm();
        let Some(nearest) = last.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else { continue };
        if distance(&nearest) < 0.4 * spacing(last, nearest) {
            *votes.entry([p.column - nearest.column, p.row - nearest.row]).or_default() += 1;
        }
    }
    let total: usize = votes.values().sum();
    let (shift, most) = votes.into_iter().max_by_key(|(_, n)| *n)?;
    Some((shift, most >= FEWEST && 2 * most >= total))
}

/// The crossings of all pieces that can be numbered alike, each column and row once.
pub(super) fn joined(parts: &[Part]) -> Vec<GridPoint> {
    let mut all: BTreeMap<(i32, i32), GridPoint> = BTreeMap::new();
    let shifts = numbered(parts);
    let mut order: Vec<(&Part, [i32; 2])> = parts.iter().zip(shifts).filter_map(|(part, s)| Some((part, s?))).collect();
    // Where two claim one place the better told has it.
    let sure = |part: &Part| part.1.map_or(0.0, |t| t.alike);
    order.sort_by(|a, b| sure(b.0).total_cmp(&sure(a.0)));
    for ((piece, _), [dc, dr]) in order {
        for p in &piece.points {
            let (column, row) = (p.column + dc, p.row + dr);
            all.entry((column, row)).or_insert(GridPoint { column, row, crossing: p.crossing });
        }
    }
    all.into_values().collect()
}

/// Distance of a crossing from the nearest other one, px.
fn spacing(points: &[GridPoint], of: &GridPoint) -> f64 {
    let apart = |p: &GridPoint| (p.crossing.at - of.crossing.at).norm();
    points.iter().map(apart).filter(|d| *d > 1e-6).fold(f64::INFINITY, f64::min)
}

/// What must be added to each piece's columns and rows so that all count alike: what is told of it; without, the largest piece counts,
/// and the others lie where the lines beside them would run on. None for a piece that lies between lines or too far away to tell.
fn numbered(parts: &[Part]) -> Vec<Option<[i32; 2]>> {
    let mut shifts: Vec<Option<[i32; 2]>> = parts.iter().map(|(_, told)| told.map(|t| t.shift)).collect();
    if shifts.iter().all(Option::is_none)
        && let Some(largest) = shifts.first_mut()
    {
        *largest = Some([0, 0]);
    }
    let labelled = |piece: &Piece, [dc, dr]: [i32; 2]| -> Vec<(Vector2<f64>, Point2<f64>)> {
        let of = |p: &GridPoint| (Vector2::new(f64::from(p.column + dc), f64::from(p.row + dr)), p.crossing.at);
        piece.points.iter().map(of).collect()
    };
    let known = parts.iter().zip(&shifts).filter_map(|((piece, _), shift)| Some(labelled(piece, (*shift)?)));
    let mut counted: Vec<(Vector2<f64>, Point2<f64>)> = known.flatten().collect();
    for ((piece, _), shift) in parts.iter().zip(&mut shifts).filter(|(_, shift)| shift.is_none()) {
        let mut votes: BTreeMap<[i32; 2], usize> = BTreeMap::new();
        for p in &piece.points {
            if let Some(label) = label_of(&counted, &p.crossing.at) {
                let exact = label - Vector2::new(f64::from(p.column), f64::from(p.row));
                let whole = exact.map(f64::round);
                if (exact - whole).norm() < 0.3 {
                    *votes.entry([whole.x as i32, whole.y as i32]).or_default() += 1;
                }
            }
        }
        let best = votes.into_iter().max_by_key(|(_, n)| *n);
        *shift = best.filter(|(_, n)| 2 * n > piece.points.len()).map(|(shift, _)| shift);
        if let Some(shift) = *shift {
            counted.extend(labelled(piece, shift));
        }
    }
    shifts
}

/// Column and row, as fractions, of a place: an affine map through the eight nearest counted crossings.
fn label_of(counted: &[(Vector2<f64>, Point2<f64>)], at: &Point2<f64>) -> Option<Vector2<f64>> {
    let mut near: Vec<&(Vector2<f64>, Point2<f64>)> = counted.iter().collect();
    near.sort_by(|a, b| (a.1 - at).norm().total_cmp(&(b.1 - at).norm()));
    near.truncate(8);
    let n = near.len() as f64;
    let label = near.iter().map(|p| p.0).sum::<Vector2<f64>>() / n;
    let place = near.iter().map(|p| p.1.coords).sum::<Vector2<f64>>() / n;
    let (mut square, mut both) = (Matrix2::zeros(), Matrix2::zeros());
    for p in &near {
        let d = p.1.coords - place;
        square += d * d.transpose();
        both += (p.0 - label) * d.transpose();
    }
    let map = both * square.try_inverse()?;
    let offset = at.coords - place;
    // Farther than three cells away the lines may have bent elsewhere.
    let found = label + map * offset;
    ((map * offset).norm() < 4.0).then_some(found)
}

/// Those whose motion agrees with that of the crossings beside them in the grid.
fn agreeing(carried: Vec<Carried>) -> Vec<Carried> {
    let at: BTreeMap<(i32, i32), usize> = carried.iter().enumerate().map(|(k, c)| ((c.column, c.row), k)).collect();
    let motion = |c: &Carried| c.last.at - c.first.at;
    let agrees = |c: &Carried| {
        let beside: Vec<&Carried> = [[1, 0], [-1, 0], [0, 1], [0, -1]]
            .iter()
            .filter_map(|[dc, dr]| at.get(&(c.column + dc, c.row + dr)).map(|k| &carried[*k]))
            .collect();
        let mean = beside.iter().map(|b| motion(b)).sum::<Vector2<f64>>() / beside.len().max(1) as f64;
        let apart = beside.iter().map(|b| (b.first.at - c.first.at).norm()).fold(f64::INFINITY, f64::min);
        !beside.is_empty() && (motion(c) - mean).norm() < 0.6 * apart
    };
    let keep: Vec<bool> = carried.iter().map(agrees).collect();
    carried.into_iter().zip(keep).filter(|(_, k)| *k).map(|(c, _)| c).collect()
}

#[cfg(test)]
mod tests {
    use super::super::pieces;
    use super::*;
    use crate::marking::gray::{Gray, uneven};

    /// Lines 4 px wide at multiples of 30 px on skin whose brightness goes up and down by `rich` grey levels, moved down by so many px.
    fn painted(down: f64, rich: f64) -> Prepared {
        let on = |v: f64| (v - (v / 30.0).round() * 30.0).abs() < 2.0;
        let values = (0..300 * 300).map(|i| {
            let (u, v) = (f64::from(i % 300) + 0.5, f64::from(i / 300) + 0.5 - down);
            (if on(u) || on(v) { 80.0 } else { 180.0 + 2.0 * rich * uneven(u, v, 6.0) }) as f32
        });
        Prepared::of(Gray::new(300, 300, values.collect()).unwrap())
    }

    fn about() -> Vec<Point2<f64>> {
        (0..300).map(|k| Point2::new(20.0 + 13.0 * f64::from(k % 20), 20.0 + 17.0 * f64::from(k / 20))).collect()
    }

    /// Everything went down by 30 px, a whole cell, and the motion that is expected is none: by the lines nothing moved. The skin inside
    /// the cells knows; without it, the majority's word stands.
    #[test]
    fn skin_inside_the_cells_tells_what_lines_cannot() {
        for (rich, moved) in [(20.0, 30.0), (0.0, 0.0)] {
            let [first, last] = [painted(0.0, rich), painted(30.0, rich)];
            let [a, b] = [&first, &last].map(|p| pieces(p, &about(), 4.0));
            let carried = carry([&first, &last], [&a, &b], &|p| Some(*p));
            assert!(carried.len() > 30, "{}", carried.len());
            for c in &carried {
                let off = c.last.at - c.first.at - Vector2::new(0.0, moved);
                assert!(off.norm() < 0.5, "{rich}: {off}");
            }
        }
    }

    /// A walk that has missed a line counts one row too few below it: the cells there say so, and beside the seam nothing is carried.
    #[test]
    fn a_line_that_a_walk_has_missed_is_counted_again() {
        let picture = painted(0.0, 20.0);
        let found = pieces(&picture, &about(), 4.0);
        let mut miscounted = found.clone();
        let rows: Vec<i32> = found[0].points.iter().map(|p| p.row).collect();
        let middle = (rows.iter().min().unwrap() + rows.iter().max().unwrap()) / 2;
        miscounted[0].points.retain(|p| p.row != middle);
        for p in miscounted[0].points.iter_mut().filter(|p| p.row > middle) {
            p.row -= 1;
        }
        let carried = carry([&picture, &picture], [&found, &miscounted], &|p| Some(*p));
        assert!(carried.iter().all(|c| (c.last.at - c.first.at).norm() < 0.5));
        let below = carried.iter().filter(|c| c.first.at.y > 180.0).count();
        assert!(below > 10 && carried.len() > below + 10, "{below} of {}", carried.len());
    }
}
