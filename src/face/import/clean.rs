//! A clean surface out of triangles as files hold them: at most two triangles at an edge, one fan at a vertex, nothing twice.

use std::collections::{BTreeSet, HashMap};

use nalgebra::Point3;

use super::{Repair, Soup};

/// A triangle is without an area when its height is less than this share of its longest side.
const FLAT: f64 = 1e-9;

/// Merges, drops and cuts; every step is reported.
pub(super) fn surface(soup: &mut Soup, merge: bool, repairs: &mut Vec<Repair>) {
    if merge {
        merge_duplicates(soup, repairs);
    }
    let before = soup.triangles.len();
    let p = &soup.positions;
    soup.triangles.retain(|&[a, b, c]| a != b && b != c && c != a && !flat([a, b, c].map(|i| p[i as usize])));
    if soup.triangles.len() < before {
        repairs.push(Repair::Degenerate(before - soup.triangles.len()));
    }
    let before = soup.triangles.len();
    let mut seen = std::collections::HashSet::with_capacity(before);
    soup.triangles.retain(|t| seen.insert(sorted(*t)));
    if soup.triangles.len() < before {
        repairs.push(Repair::Duplicate(before - soup.triangles.len()));
    }
    cut_apart(soup, repairs);
}

fn sorted(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

fn flat([a, b, c]: [Point3<f64>; 3]) -> bool {
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    let area = (b - a).cross(&(c - a)).norm();
    // Written so that an overflow counts as flat too.
    area.partial_cmp(&(FLAT * longest)) != Some(std::cmp::Ordering::Greater)
}

/// Vertices at exactly the same place become the first of them.
fn merge_duplicates(soup: &mut Soup, repairs: &mut Vec<Repair>) {
    // Adding 0 makes −0 the same as 0.
    let key = |p: &Point3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let used: BTreeSet<u32> = soup.triangles.iter().flatten().copied().collect();
    let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(soup.positions.len());
    let mut merged = 0;
    let target: Vec<u32> = (0..soup.positions.len() as u32)
        .map(|i| {
            if !used.contains(&i) {
                return i;
            }
            let kept = *first.entry(key(&soup.positions[i as usize])).or_insert(i);
            merged += usize::from(kept != i);
            kept
        })
        .collect();
    if merged > 0 {
        for corner in soup.triangles.iter_mut().flatten() {
            *corner = target[*corner as usize];
        }
        // The vertices merged away leave with the unused ones, and are not counted again there.
        soup.keep_vertices(&|i| target[i as usize] == i);
        repairs.push(Repair::Merged(merged));
    }
}

impl Soup {
    /// Drops the vertices that are not kept; no triangle may use one of those.
    fn keep_vertices(&mut self, keep: &dyn Fn(u32) -> bool) {
        let mut number = vec![0_u32; self.positions.len()];
        let mut next = 0;
        for (i, new) in number.iter_mut().enumerate() {
            if keep(i as u32) {
                *new = next;
                self.positions[next as usize] = self.positions[i];
                self.in_file[next as usize] = self.in_file[i];
                next += 1;
            }
        }
        self.positions.truncate(next as usize);
        self.in_file.truncate(next as usize);
        for corner in self.triangles.iter_mut().flatten() {
            *corner = number[*corner as usize];
        }
    }

    /// Every edge (lower vertex first) with each triangle at it, in order.
    pub(super) fn sides(&self) -> Vec<([u32; 2], u32)> {
        let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)].map(|(p, q)| [p.min(q), p.max(q)]);
        let mut sides: Vec<_> =
            self.triangles.iter().enumerate().flat_map(|(t, corners)| edges(corners).map(|e| (e, t as u32))).collect();
        sides.sort_unstable();
        sides
    }

    /// For each triangle the number of its connected surface (by edges), and how many there are.
    pub(super) fn pieces(&self) -> (Vec<u32>, usize) {
        let mut groups = Groups::new(self.triangles.len());
        for run in self.sides().chunk_by(|a, b| a.0 == b.0) {
            for pair in run.windows(2) {
                groups.join(pair[0].1, pair[1].1);
            }
        }
        groups.numbered()
    }
}

/// Things that belong together (union and find).
struct Groups(Vec<u32>);

impl Groups {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, i: u32, j: u32) {
        let (a, b) = (self.root(i), self.root(j));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The group of each, numbered from 0 in the order of their first members.
    fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut next = 0;
        let of = (0..self.0.len() as u32)
            .map(|i| {
                let root = self.root(i) as usize;
                if number[root] == u32::MAX {
                    number[root] = next;
                    next += 1;
                }
                number[root]
            })
            .collect();
        (of, next as usize)
    }
}

/// Cuts the surface along edges with more than two triangles, and apart where two fans only touch at a vertex.
///
/// Corners at one vertex stay together when their triangles share an edge there that has just two triangles; each further fan
/// gets a copy of the vertex. Where that leaves a fork (its sheets are joined behind), the triangles beyond two are torn off.
fn cut_apart(soup: &mut Soup, repairs: &mut Vec<Repair>) {
    let mut first_in_file: Option<u32> = None;
    let sides = soup.sides();
    let mut forks = 0;
    // Corner k of triangle t is number 3 t + k.
    let mut fans = Groups::new(3 * soup.triangles.len());
    let corner = |soup: &Soup, t: u32, v: u32| {
        3 * t + soup.triangles[t as usize].iter().position(|&i| i == v).unwrap_or_default() as u32
    };
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        match run {
            [_] => {}
            [one, other] => {
                for v in one.0 {
                    fans.join(corner(soup, one.1, v), corner(soup, other.1, v));
                }
            }
            _ => {
                forks += 1;
                first_in_file = first_in_file.or(Some(soup.in_file[run[0].0[0] as usize]));
            }
        }
    }
    let (fan_of, _) = fans.numbered();
    let mut first_fan: Vec<Option<u32>> = vec![None; soup.positions.len()];
    let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
    let mut touching = BTreeSet::new();
    let on_fork: BTreeSet<u32> =
        sides.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 2).flat_map(|run| run[0].0).collect();
    for t in 0..soup.triangles.len() {
        for k in 0..3 {
            let v = soup.triangles[t][k];
            let fan = fan_of[3 * t + k];
            let first = *first_fan[v as usize].get_or_insert(fan);
            if first != fan {
                if !on_fork.contains(&v) {
                    touching.insert(v);
                }
                let copy = *copies.entry((v, fan)).or_insert(soup.positions.len() as u32);
                if copy as usize == soup.positions.len() {
                    soup.positions.push(soup.positions[v as usize]);
                    soup.in_file.push(soup.in_file[v as usize]);
                }
                soup.triangles[t][k] = copy;
            }
        }
    }
    if let Some(&v) = touching.first() {
        first_in_file = first_in_file.or(Some(soup.in_file[v as usize]));
    }
    let left: Vec<u32> = soup
        .sides()
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|run| run.len() > 2)
        .flat_map(|run| run[2..].iter().map(|s| s.1))
        .collect();
    for t in left {
        for k in 0..3 {
            let v = soup.triangles[t as usize][k] as usize;
            soup.triangles[t as usize][k] = soup.positions.len() as u32;
            soup.positions.push(soup.positions[v]);
            soup.in_file.push(soup.in_file[v]);
        }
    }
    if let Some(first_in_file) = first_in_file {
        repairs.push(Repair::Cut { edges: forks, points: touching.len(), first_in_file });
    }
}

/// Leaves out all surfaces but the one with the largest area.
pub(super) fn largest_piece(soup: &mut Soup, repairs: &mut Vec<Repair>) {
    let (piece, pieces) = soup.pieces();
    if pieces < 2 {
        return;
    }
    let mut area = vec![0.0_f64; pieces];
    for (t, &piece) in soup.triangles.iter().zip(&piece) {
        let [a, b, c] = t.map(|i| soup.positions[i as usize]);
        area[piece as usize] += (b - a).cross(&(c - a)).norm();
    }
    let largest = (0..pieces).max_by(|&i, &j| area[i].total_cmp(&area[j])).unwrap_or_default();
    let before = soup.triangles.len();
    let mut of = piece.iter();
    soup.triangles.retain(|_| of.next().is_some_and(|p| *p as usize == largest));
    repairs.push(Repair::SmallPieces { pieces: pieces - 1, triangles: before - soup.triangles.len() });
}

/// Leaves out vertices of no triangle.
pub(super) fn drop_unused(soup: &mut Soup, repairs: &mut Vec<Repair>) {
    let dropped = compact(soup);
    if dropped > 0 {
        repairs.push(Repair::Unused(dropped));
    }
}

/// The same, not reported: after a part was cut out, that is no fault.
pub(super) fn compact(soup: &mut Soup) -> usize {
    let mut used = vec![false; soup.positions.len()];
    for &corner in soup.triangles.iter().flatten() {
        used[corner as usize] = true;
    }
    soup.keep_vertices(&|i| used[i as usize]);
    used.len() - soup.positions.len()
}
