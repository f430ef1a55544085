//! Makes the drawn mesh fair: lines run evenly, diagonals open angles, and no triangle is much sharper or larger than its neighbours.
//!
//! Vertices move along the surface, so a position is a place in the plane. Drawn vertices stay.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::drawing::Place;
use super::layout::{Layout, Pin};
use super::surface::on_surface;

/// The least angle that a triangle shall have is 20°: its cosine.
const COS_LEAST: f64 = 0.939_692_620_785_908_4;
/// The largest is 130°: its cosine.
const COS_MOST: f64 = -0.642_787_609_686_539_3;
/// Neighbour triangles shall not differ in area by more than this factor.
const AREA_RATIO: f64 = 4.0;
/// Least doubled area in the plane, mm²: below it a triangle is about to turn over.
const THIN: f64 = 0.2;

/// A mesh that is being made fair.
struct Fairing<'a> {
    places: &'a mut [Place],
    triangles: &'a mut [[usize; 3]],
    lines: &'a BTreeSet<[usize; 2]>,
    free: Vec<usize>,
}

/// Moves the free vertices of a layout, and turns diagonals of its cells.
pub(super) fn fair(layout: &mut Layout) {
    let free = (0..layout.places.len()).filter(|&v| layout.pins[v] == Pin::Free).collect();
    let Layout { places, triangles, lines, .. } = layout;
    let mut mesh = Fairing { places, triangles, lines, free };
    for _ in 0..10 {
        mesh.flip();
        mesh.spread(2);
    }
    mesh.flip();
    for round in 0..40 {
        mesh.open_angles(2.0 / f64::from(1 + round / 4));
        mesh.flip();
    }
}

impl Fairing<'_> {
    fn corners(&self, t: usize) -> [Point3<f64>; 3] {
        self.triangles[t].map(|i| on_surface(self.places[i]))
    }

    /// For each vertex its triangles.
    fn around(&self) -> Vec<Vec<usize>> {
        let mut around = vec![Vec::new(); self.places.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            for &i in corners {
                around[i].push(t);
            }
        }
        around
    }

    /// Moves every free vertex along the surface towards the centroid of its triangles.
    fn spread(&mut self, rounds: usize) {
        let around = self.around();
        for _ in 0..rounds {
            for v in self.free.clone() {
                let p = on_surface(self.places[v]);
                let (mut sum, mut normal, mut weight) = (Vector3::zeros(), Vector3::zeros(), 0.0);
                for &t in &around[v] {
                    let [a, b, c] = self.corners(t);
                    let n = (b - a).cross(&(c - a));
                    let area = n.norm();
                    sum += ((a - p) + (b - p) + (c - p)) * (area / 3.0);
                    normal += n;
                    weight += area;
                }
                if weight <= 0.0 || normal.norm_squared() <= 0.0 {
                    continue;
                }
                let step = sum / weight * 0.5;
                let step = step - normal * (step.dot(&normal) / normal.norm_squared());
                let to = [self.places[v][0] + step.x, self.places[v][1] + step.y];
                let from = std::mem::replace(&mut self.places[v], to);
                if around[v].iter().any(|&t| self.is_thin(t)) {
                    self.places[v] = from;
                }
            }
        }
    }

    fn is_thin(&self, t: usize) -> bool {
        let [a, b, c] = self.triangles[t].map(|i| self.places[i]);
        doubled_area(a, b, c) <= THIN
    }

    /// For each edge the triangles beside it.
    fn sides(&self) -> BTreeMap<[usize; 2], Vec<usize>> {
        let mut sides: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        for (t, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                sides.entry([p.min(q), p.max(q)]).or_default().push(t);
            }
        }
        sides
    }

    /// Turns every diagonal whose opposite angles in space sum to more than 180°, until none is left.
    fn flip(&mut self) {
        // Each turn lowers the largest circles, so this ends long before the bound.
        for _ in 0..100 {
            let mut touched = vec![false; self.triangles.len()];
            for (edge, sides) in self.sides() {
                let &[t, u] = sides.as_slice() else { continue };
                if touched[t] || touched[u] || self.lines.contains(&edge) {
                    continue;
                }
                if let Some([new_t, new_u]) = self.flipped(t, u, edge) {
                    let [c, _, d] = new_t;
                    if self.cotangent(c, edge[0], edge[1]) + self.cotangent(d, edge[0], edge[1]) < -1e-9 {
                        self.triangles[t] = new_t;
                        self.triangles[u] = new_u;
                        (touched[t], touched[u]) = (true, true);
                    }
                }
            }
            if !touched.contains(&true) {
                return;
            }
        }
    }

    /// What replaces two triangles when the edge between them turns, if their union is convex.
    fn flipped(&self, t: usize, u: usize, edge: [usize; 2]) -> Option<[[usize; 3]; 2]> {
        let start = (0..3).find(|&k| {
            let (a, b) = (self.triangles[t][k], self.triangles[t][(k + 1) % 3]);
            [a.min(b), a.max(b)] == edge
        })?;
        let [a, b, c] = [0, 1, 2].map(|j| self.triangles[t][(start + j) % 3]);
        let d = *self.triangles[u].iter().find(|&&i| i != a && i != b)?;
        let turns_left =
            |p: usize, q: usize, r: usize| doubled_area(self.places[p], self.places[q], self.places[r]) > THIN;
        (turns_left(c, a, d) && turns_left(d, b, c)).then_some([[c, a, d], [d, b, c]])
    }

    /// Cotangent of the angle at `at` in the triangle with `a` and `b`, in space.
    fn cotangent(&self, at: usize, a: usize, b: usize) -> f64 {
        let p = on_surface(self.places[at]);
        let (u, v) = (on_surface(self.places[a]) - p, on_surface(self.places[b]) - p);
        u.dot(&v) / u.cross(&v).norm().max(1e-12)
    }

    /// Lets every free vertex search around itself, `reach` mm away, for a place where the worst of its triangles is better.
    fn open_angles(&mut self, reach: f64) {
        const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
        const DIRECTIONS: [Place; 8] = [
            [1.0, 0.0],
            [DIAGONAL, DIAGONAL],
            [0.0, 1.0],
            [-DIAGONAL, DIAGONAL],
            [-1.0, 0.0],
            [-DIAGONAL, -DIAGONAL],
            [0.0, -1.0],
            [DIAGONAL, -DIAGONAL],
        ];
        let around = self.around();
        let across = self.across();
        for v in self.free.clone() {
            let mut best = self.margin(&around[v], &across);
            if best > 1.6 {
                continue;
            }
            for [dx, dy] in DIRECTIONS {
                let from = self.places[v];
                self.places[v] = [from[0] + dx * reach, from[1] + dy * reach];
                let found = self.margin(&around[v], &across);
                if found > best + 1e-9 {
                    best = found;
                } else {
                    self.places[v] = from;
                }
            }
        }
    }

    /// For each triangle those that share an edge with it.
    fn across(&self) -> Vec<Vec<usize>> {
        let mut across = vec![Vec::new(); self.triangles.len()];
        for sides in self.sides().values() {
            if let &[t, u] = sides.as_slice() {
                across[t].push(u);
                across[u].push(t);
            }
        }
        across
    }

    /// How far the worst of some triangles is within the limits: 1 at a limit, more inside, below 0 turned over.
    fn margin(&self, triangles: &[usize], across: &[Vec<usize>]) -> f64 {
        let mut margin = f64::INFINITY;
        for &t in triangles {
            if self.is_thin(t) {
                return -1.0;
            }
            let corners = self.corners(t);
            for k in 0..3 {
                let (p, q, r) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
                let (u, v) = (q - p, r - p);
                let cos = u.dot(&v) / (u.norm() * v.norm());
                margin = margin.min((1.0 - cos) / (1.0 - COS_LEAST)).min((1.0 + cos) / (1.0 + COS_MOST));
            }
            let area = doubled_area_in_space(corners);
            for &u in &across[t] {
                let other = doubled_area_in_space(self.corners(u));
                let ratio = if area > other { area / other } else { other / area };
                margin = margin.min(AREA_RATIO / ratio);
            }
        }
        margin
    }
}

fn doubled_area_in_space([a, b, c]: [Point3<f64>; 3]) -> f64 {
    (b - a).cross(&(c - a)).norm()
}

/// Twice the signed area of a triangle in the plane; positive when counter-clockwise.
fn doubled_area(a: Place, b: Place, c: Place) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
