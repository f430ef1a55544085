//! Walks a painted grid: from crossing to crossing along the lines, so that each gets its column and row.
//!
//! A crossing looks like any other; only the way to it tells which one it is. So a line is followed in small steps, its middle found
//! anew at every one, until another line runs across, and that crossing is fitted ([`grid_crossing`]). Nothing is assumed of the lines'
//! distance, which changes by half where a brow is raised. Where a line fades under hair or at the rim, the walk ends.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::{Matrix2, Point2, Vector2};
use rayon::prelude::*;

use super::grid_crossing::{self, Crossing, CrossingSettings};
use super::prepared::Prepared;

mod carry;
mod cells;

pub use carry::carry;

/// A crossing with its place in the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// Number of the upright line, counted to the right.
    pub column: i32,
    /// Number of the level line, counted downwards.
    pub row: i32,
    /// The crossing.
    pub crossing: Crossing,
}

/// Crossings that hang together by lines; columns and rows count from one of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece {
    /// The crossings.
    pub points: Vec<GridPoint>,
}

/// A crossing of the first picture found again in the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Number of the upright line, counted to the right from 0.
    pub column: i32,
    /// Number of the level line, counted downwards from 0.
    pub row: i32,
    /// In the first picture.
    pub first: Crossing,
    /// In the last picture.
    pub last: Crossing,
}

/// Fewest crossings that make a grid.
const FEWEST: usize = 6;
/// Places at which a first crossing is looked for: with lines 8 mm apart one in seven lies near a crossing.
const TRIES: usize = 56;
/// So many crossings to start from are enough.
const BATCH: usize = 4;
/// Farthest distance of two lines, mm.
const FARTHEST_MM: f64 = 22.0;
/// What a fit may leave unexplained, as a share of the paint's contrast.
const MOST_LEFT: f64 = 0.22;
/// Largest standard error of a crossing that leads on, px.
const MOST_SIGMA_PX: f64 = 0.25;

/// The pieces of the grid in a picture, the largest first; none on bare skin. `about` are places on the skin.
pub fn pieces(picture: &Prepared, about: &[Point2<f64>], px_per_mm: f64) -> Vec<Piece> {
    let settings = CrossingSettings::at_scale(px_per_mm);
    let stride = (about.len() / TRIES).max(1);
    // In an order that covers the face early.
    let spread: Vec<&Point2<f64>> = about.iter().step_by(stride).collect();
    let tried: Vec<&Point2<f64>> = (0..8).flat_map(|k| spread.iter().skip(k).step_by(8).copied()).collect();
    let mut starts: Vec<Crossing> = Vec::new();
    for some in tried.chunks(2 * BATCH) {
        starts.par_extend(
            some.par_iter().filter_map(|at| grid_crossing::find(picture, **at, &settings).ok()).filter(trusted),
        );
        if starts.len() >= BATCH {
            break;
        }
    }
    starts.sort_by(|a, b| a.residual.total_cmp(&b.residual));
    let walk = Walk { picture, settings, farthest: FARTHEST_MM * px_per_mm };
    let mut found: Vec<Piece> = Vec::new();
    let mut seen: Vec<Point2<f64>> = Vec::new();
    for start in starts {
        if !seen.iter().any(|at| (at - start.at).norm() < 3.0) {
            found.extend(walk.from(start, &mut seen));
        }
    }
    found.sort_by_key(|p| std::cmp::Reverse(p.points.len()));
    // Two lines that happen to cross are no grid.
    if found.first().is_none_or(|p| p.points.len() < FEWEST) { Vec::new() } else { found }
}

fn trusted(c: &Crossing) -> bool {
    c.residual < MOST_LEFT && c.sigma_px.iter().all(|s| *s < MOST_SIGMA_PX)
}

/// Where a way led.
struct Met {
    /// The crossing where it began, and the line that it followed.
    from: usize,
    line: usize,
    /// Column and row that this gives.
    label: (i32, i32),
    /// The line's direction there.
    direction: Vector2<f64>,
    /// About the crossing, px.
    at: Point2<f64>,
    /// Crossings nearer than this are one, px.
    near: f64,
}

struct Walk<'a> {
    picture: &'a Prepared,
    settings: CrossingSettings,
    farthest: f64,
}

/// The four ways from a crossing: which line is followed, which way along it, and what that does to column and row.
const WAYS: [(usize, f64, [i32; 2]); 4] = [(0, 1.0, [1, 0]), (0, -1.0, [-1, 0]), (1, 1.0, [0, 1]), (1, -1.0, [0, -1])];

impl Walk<'_> {
    /// Everything that can be reached from a crossing, in pieces that are certain in themselves.
    fn from(&self, start: Crossing, seen: &mut Vec<Point2<f64>>) -> Vec<Piece> {
        let mut points = vec![GridPoint { column: 0, row: 0, crossing: start }];
        let mut suspect = vec![false];
        let mut index = BTreeMap::from([((0, 0), 0_usize)]);
        let mut open = vec![0_usize];
        let mut links = BTreeSet::new();
        let at_place = |points: &[GridPoint], at: &Point2<f64>, near: f64| {
            points.iter().position(|p| (p.crossing.at - at).norm() < near)
        };
        // Wave by wave, so that all ways of a wave are walked side by side. Ways to neighbours that are known already are walked as well:
        // that they meet is the check.
        while !open.is_empty() {
            let ways: Vec<(usize, usize)> = open.iter().flat_map(|i| (0..WAYS.len()).map(|k| (*i, k))).collect();
            let met: Vec<Met> =
                ways.into_par_iter().filter_map(|(from, way)| self.next(&points[from], from, way)).collect();
            let (mut asked, mut others): (Vec<Met>, Vec<Met>) = (Vec::new(), Vec::new());
            for m in met {
                let same = at_place(&points, &m.at, m.near);
                if same.is_some() && index.get(&m.label).copied() == same {
                    links.extend(same.map(|b| (m.from, b)));
                } else if asked.iter().any(|a| a.label == m.label && (a.at - m.at).norm() < m.near) {
                    // Several ways lead to one crossing: it is fitted once.
                    others.push(m);
                } else if same.is_some() || !seen.iter().any(|p| (p - m.at).norm() < m.near) {
                    // What an earlier walk has met belongs to its piece, or was not certain there.
                    asked.push(m);
                }
            }
            let fitted: Vec<Option<Crossing>> =
                asked.par_iter().map(|m| self.crossing(&points[m.from].crossing, m)).collect();
            open.clear();
            for (m, crossing) in asked.into_iter().zip(fitted) {
                let Some(crossing) = crossing else { continue };
                let same = at_place(&points, &crossing.at, m.near);
                match (index.get(&m.label).copied(), same) {
                    (Some(a), Some(b)) if a == b => {
                        links.insert((m.from, b));
                    }
                    (None, None) => {
                        links.insert((m.from, points.len()));
                        index.insert(m.label, points.len());
                        open.push(points.len());
                        points.push(GridPoint { column: m.label.0, row: m.label.1, crossing });
                        suspect.push(false);
                    }
                    (a, b) => {
                        // Two ways disagree: whoever is concerned is not told apart for certain.
                        for k in [a, b, Some(m.from)].into_iter().flatten() {
                            suspect[k] = true;
                        }
                    }
                }
            }
            for m in others {
                let same = at_place(&points, &m.at, m.near);
                if same.is_some() && index.get(&m.label).copied() == same {
                    links.extend(same.map(|b| (m.from, b)));
                }
            }
        }
        seen.extend(points.iter().map(|p| p.crossing.at));
        let certain: Vec<bool> = (0..points.len()).map(|i| !suspect[i] && lies_right(&points, &index, i)).collect();
        hanging_together(&points, &certain, &links)
    }

    /// Where the next line runs across the line that one of the four ways follows.
    fn next(&self, start: &GridPoint, index: usize, way: usize) -> Option<Met> {
        let (line, sign, [dc, dr]) = WAYS[way];
        let from = &start.crossing;
        let (width, across) = (from.widths_px[line], from.widths_px[1 - line]);
        let mut direction = from.directions[line] * sign;
        if line == 1 && from.directions[1].y < 0.0 {
            // Downwards counts up, whichever way the upright line's direction points.
            direction = -direction;
        }
        let value = |at: Point2<f64>| self.picture.soft().sample(&at).value;
        let beside = 0.5 * width + (0.6 * width).max(2.0);
        let step = (0.4 * width).max(1.0);
        // Begin where the other line has been left.
        let mut at = from.at + direction * (0.5 * across + beside.min(0.6 * across + 1.5));
        let normal = |d: &Vector2<f64>| Vector2::new(-d.y, d.x);
        let sides =
            |at: &Point2<f64>, d: &Vector2<f64>| [value(at + normal(d) * beside), value(at - normal(d) * beside)];
        let [a, b] = sides(&at, &direction);
        let mut light = a.max(b);
        // What the softened picture has left of the paint: of a line two pixels wide hardly more than half.
        let paint = (light - value(at)).clamp(0.3 * from.contrast, from.contrast);
        let mut trail = VecDeque::from([from.at]);
        let (mut entered, mut left, mut missed) = (None, 0.0_f64, 0.0);
        let mut gone = 0.0;
        while gone < self.farthest {
            if !self.picture.spline().holds(&at, beside + 2.0) {
                return None;
            }
            let [a, b] = sides(&at, &direction);
            let dark = [a, b].map(|v| v < light - 0.45 * paint);
            if dark[0] || dark[1] {
                // Another line, or what looks like one: both sides of a true one are dark within little more than its width.
                let begin = *entered.get_or_insert(gone);
                left = gone;
                if gone - begin > 2.5 * across + 0.3 * width {
                    return None;
                }
            } else if let Some(begin) = entered {
                let middle = at - direction * (gone - 0.5 * (begin + left));
                return Some(Met {
                    from: index,
                    line,
                    label: (start.column + dc, start.row + dr),
                    direction,
                    at: middle,
                    near: (0.7 * across).max(2.5),
                });
            } else {
                light += 0.3 * (0.5 * (a + b) - light);
                // The middle of what is dark across the line.
                let (mut weight, mut sum) = (0.0, 0.0);
                for k in -3..=3 {
                    let t = f64::from(k) / 3.0 * 0.8 * width.max(1.5);
                    let darkness = (light - value(at + normal(&direction) * t)).max(0.0);
                    weight += darkness;
                    sum += darkness * t;
                }
                if weight / 7.0 < 0.25 * paint {
                    missed += step;
                    if missed > 1.5 * width + 2.0 {
                        return None;
                    }
                } else {
                    missed = 0.0;
                    at += normal(&direction) * (sum / weight).clamp(-0.5 * step, 0.5 * step);
                }
                trail.push_back(at);
                if trail.len() > 6
                    && let Some(old) = trail.pop_front()
                    && let Some(along) = (at - old).try_normalize(1e-6)
                {
                    direction = along;
                }
            }
            at += direction * step;
            gone += step;
        }
        None
    }

    /// The crossing at a place that a line led to, if it is one like that where it began.
    fn crossing(&self, from: &Crossing, met: &Met) -> Option<Crossing> {
        let (line, other) = (met.line, from.directions[1 - met.line]);
        let angles = [met.direction.y.atan2(met.direction.x), other.y.atan2(other.x)];
        let widths = [from.widths_px[line], from.widths_px[1 - line]];
        let near = CrossingSettings { reach_px: (0.8 * widths[1]).max(3.0), ..self.settings };
        let found = grid_crossing::find_along(self.picture, met.at, angles, widths, &near).ok()?;
        let alike = (0.35..2.8).contains(&(found.contrast / from.contrast))
            && (0..2).all(|k| (0.4..2.5).contains(&(found.widths_px[k] / from.widths_px[k])));
        (alike && trusted(&found)).then_some(found)
    }
}

/// The certain crossings in pieces that hang together by lines that were walked both ways. Where a walk has skipped a line unseen, the
/// crossings about that place disagree and are no longer certain; what lies beyond becomes a piece of its own, to be numbered anew.
fn hanging_together(points: &[GridPoint], certain: &[bool], links: &BTreeSet<(usize, usize)>) -> Vec<Piece> {
    let mut taken = vec![false; points.len()];
    let mut pieces = Vec::new();
    for start in 0..points.len() {
        if taken[start] || !certain[start] {
            continue;
        }
        taken[start] = true;
        let (mut open, mut piece) = (vec![start], Piece::default());
        while let Some(i) = open.pop() {
            piece.points.push(points[i]);
            for &(_, j) in links.range((i, 0)..(i + 1, 0)) {
                if certain[j] && !taken[j] && links.contains(&(j, i)) {
                    taken[j] = true;
                    open.push(j);
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}

/// Whether the crossings about one lie where their columns and rows say, by the steps from it to its neighbours in the grid.
fn lies_right(points: &[GridPoint], index: &BTreeMap<(i32, i32), usize>, i: usize) -> bool {
    let here = &points[i];
    let beside = |dc: i32, dr: i32| index.get(&(here.column + dc, here.row + dr)).map(|k| points[*k].crossing.at);
    let step = |dc: i32, dr: i32| match (beside(dc, dr), beside(-dc, -dr)) {
        (Some(a), Some(b)) => Some((a - b) / 2.0),
        (Some(a), None) => Some(a - here.crossing.at),
        (None, Some(b)) => Some(here.crossing.at - b),
        (None, None) => None,
    };
    // At the end of one line alone nothing tells.
    let (Some(right), Some(down)) = (step(1, 0), step(0, 1)) else { return false };
    let Some(inverse) = Matrix2::from_columns(&[right, down]).try_inverse() else { return false };
    let reach = 1.6 * right.norm().max(down.norm());
    let (mut count, mut wrong) = (0, 0);
    for p in points {
        let apart = p.crossing.at - here.crossing.at;
        if apart.norm() < 1e-6 || apart.norm() > reach {
            continue;
        }
        let steps = inverse * apart;
        let label = Vector2::new(f64::from(p.column - here.column), f64::from(p.row - here.row));
        count += 1;
        wrong += usize::from((steps - label).amax() > 0.6);
    }
    4 * wrong < count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marking::gray::Gray;

    /// Lines 4 px wide at multiples of 30 px, as seen through a map from the picture to the skin, with a line of hair over them.
    fn painted(skin: impl Fn(f64, f64) -> [f64; 2], hair: bool) -> Prepared {
        drawn(4.0, skin, hair)
    }

    /// As [`painted`], with lines of another width, px.
    fn drawn(width: f64, skin: impl Fn(f64, f64) -> [f64; 2], hair: bool) -> Prepared {
        let on = |v: f64| (v - (v / 30.0).round() * 30.0).abs() < 0.5 * width;
        let values = (0..300 * 260).map(|i| {
            let mut sum = 0.0;
            for k in 0..9 {
                let (x, y) = (
                    f64::from(i % 300) + f64::from(k % 3) / 3.0 + 0.17,
                    f64::from(i / 300) + f64::from(k / 3) / 3.0 + 0.17,
                );
                let [u, v] = skin(x, y);
                let covered = hair && (y - 130.0 - 0.2 * x).abs() < 6.0 && (x as i32 / 3) % 2 == 0;
                sum += if covered {
                    40.0
                } else if on(u) || on(v) {
                    80.0
                } else {
                    180.0
                };
            }
            (sum / 9.0) as f32
        });
        Prepared::of(Gray::new(300, 260, values.collect()).unwrap())
    }

    fn about() -> Vec<Point2<f64>> {
        (0..300).map(|k| Point2::new(20.0 + 13.0 * f64::from(k % 20), 20.0 + 15.0 * f64::from(k / 20))).collect()
    }

    /// The last picture's lower half is moved up by almost a whole cell: the nearest crossing is a wrong one for half of them, and the
    /// lines tell. Skin (u, v) of a place (x, y) is y itself at the top and y + 27 at the bottom.
    #[test]
    fn crossings_are_told_apart_where_the_skin_moved_by_a_cell() {
        let first = painted(|x, y| [x, y], false);
        let rise = |y: f64| 27.0 / (1.0 + (-(y - 170.0) / 14.0).exp());
        let last = painted(|x, y| [x + 0.02 * y, y + rise(y)], false);
        let (a, b) = (pieces(&first, &about(), 4.0), pieces(&last, &about(), 4.0));
        let carried = carry([&first, &last], [&a, &b], &|p| Some(*p));
        assert!(carried.len() > 40, "{} of 63", carried.len());
        for c in &carried {
            // Where the crossing must lie, from the map itself: v is a multiple of 30.
            let v = (c.first.at.y / 30.0).round() * 30.0;
            let seen = c.last.at.y + rise(c.last.at.y);
            assert!((seen - v).abs() < 1.0, "row {}: {} for {v}", c.row, seen);
            assert!((c.last.at.x + 0.02 * c.last.at.y - c.first.at.x).abs() < 0.5);
        }
        let top_left = carried.iter().min_by_key(|c| (c.row, c.column)).unwrap();
        assert!(top_left.row == 0 && carried.iter().any(|c| c.column == 0));
    }

    #[test]
    fn hair_over_the_lines_misleads_no_one() {
        let picture = painted(|x, y| [x, y], true);
        let found = pieces(&picture, &about(), 4.0);
        let all = carry::joined(&found.iter().map(carry::untold).collect::<Vec<_>>());
        assert!(all.len() > 20, "{}", all.len());
        let zero = all[0];
        for p in &all {
            let steps = (p.crossing.at - zero.crossing.at) / 30.0;
            assert!((steps.x - f64::from(p.column - zero.column)).abs() < 0.1, "{p:?}");
            assert!((steps.y - f64::from(p.row - zero.row)).abs() < 0.1, "{p:?}");
        }
    }

    /// Two pixels, as a line of 1 mm is in a picture 500 px wide: the softened picture in which the lines are followed has half of the
    /// paint.
    #[test]
    fn thin_lines_are_followed() {
        let picture = drawn(2.0, |x, y| [x + 0.03 * y, y - 0.02 * x], false);
        let found = pieces(&picture, &about(), 2.2);
        assert!(found.first().is_some_and(|p| p.points.len() > 40), "{:?}", found.len());
    }

    #[test]
    fn bare_skin_has_no_grid() {
        let bare = painted(|x, y| [15.0 + 0.001 * x, 15.0 + 0.001 * y], false);
        assert!(pieces(&bare, &about(), 4.0).is_empty());
        assert!(pieces(&bare, &[], 4.0).is_empty() && carry([&bare, &bare], [&[], &[]], &|p| Some(*p)).is_empty());
    }
}
