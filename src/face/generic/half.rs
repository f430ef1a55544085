//! The left half of the generic face: drawn lines cut to segments, triangulated, and filled with evenly spread vertices.
//!
//! Drawn vertices stay where they are. The others are added one by one where the triangles are largest, and after each the
//! mesh relaxes: edges flip where that opens the angles in space, vertices move along the surface to the middle of their
//! neighbourhood. The surface is the height field of [`depth`], so a position is a place in the plane.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::depth_map::depth;
use super::features::{BESIDE_MIDLINE, CURVES, Curve, Cut, ON_MIDLINE, POINTS};
use super::triangulation::{doubled_area, flipped, triangulate};

/// The half mesh: x ≥ 0, the midline included.
pub(super) struct Half {
    /// Places in the plane, mm.
    pub points: Vec<[f64; 2]>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[usize; 3]>,
    /// For each of [`CURVES`] the vertices along it.
    pub curves: Vec<Vec<usize>>,
    fixed: Vec<bool>,
    lines: BTreeSet<[usize; 2]>,
}

/// The surface point over a place in the plane.
pub(super) fn on_surface([x, y]: [f64; 2]) -> Point3<f64> {
    Point3::new(x, y, depth(x, y))
}

/// Curves that bound the half, in order: round the outside counter-clockwise or clockwise, then round the eye.
const OUTLINE: [&str; 8] =
    ["midline_upper", "mouth_upper", "mouth_lower", "midline_lower", "jaw", "side", "temple", "hairline"];
const EYE: [&str; 2] = ["eye_upper", "eye_lower"];

impl Half {
    /// Builds the half with all its vertices.
    pub(super) fn build() -> Self {
        let mut half = Self::drawn();
        while half.points.len() < ON_MIDLINE + BESIDE_MIDLINE {
            half.add_in_largest_triangle();
            half.flip();
            half.relax(4);
        }
        for _ in 0..40 {
            half.relax(3);
            half.flip();
        }
        half.open_angles();
        half
    }

    /// The vertices along a curve.
    pub(super) fn curve(&self, id: &str) -> &[usize] {
        CURVES.iter().position(|c| c.id == id).map_or(&[], |i| &self.curves[i])
    }

    fn drawn() -> Self {
        let mut points: Vec<[f64; 2]> = Vec::new();
        let mut lines = BTreeSet::new();
        let mut curves = Vec::new();
        for curve in &CURVES {
            let along: Vec<usize> = curve.cut().into_iter().map(|p| index_of(&mut points, p)).collect();
            lines.extend(along.windows(2).map(|w| [w[0].min(w[1]), w[0].max(w[1])]));
            curves.push(along);
        }
        for p in POINTS {
            index_of(&mut points, p);
        }
        let mut half = Self { fixed: vec![true; points.len()], points, triangles: Vec::new(), curves, lines };
        let ring = |ids: &[&str]| -> Vec<usize> {
            ids.iter()
                .flat_map(|id| {
                    let c = half.curve(id);
                    c[..c.len().saturating_sub(1)].to_vec()
                })
                .collect()
        };
        let (outline, eye) = (ring(&OUTLINE), ring(&EYE));
        let lines: Vec<_> = half.lines.iter().copied().collect();
        half.triangles = triangulate(&half.points, &lines, &outline, &eye);
        half.flip();
        half
    }

    fn corners(&self, t: usize) -> [Point3<f64>; 3] {
        self.triangles[t].map(|i| on_surface(self.points[i]))
    }

    fn add_in_largest_triangle(&mut self) {
        let mut largest = (0, 0.0);
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t);
            let area = (b - a).cross(&(c - a)).norm();
            if area > largest.1 {
                largest = (t, area);
            }
        }
        let t = largest.0;
        let [a, b, c] = self.triangles[t];
        let middle = [0, 1].map(|axis| (self.points[a][axis] + self.points[b][axis] + self.points[c][axis]) / 3.0);
        let new = self.points.len();
        self.points.push(middle);
        self.fixed.push(false);
        self.triangles[t] = [a, b, new];
        self.triangles.push([b, c, new]);
        self.triangles.push([c, a, new]);
    }

    /// Flips every free edge whose opposite angles in space sum to more than 180°, until none is left.
    fn flip(&mut self) {
        // Each flip lowers the largest circles, so this ends long before the bound.
        for _ in 0..100 {
            let mut sides: BTreeMap<[usize; 2], Vec<(usize, usize)>> = BTreeMap::new();
            for (t, corners) in self.triangles.iter().enumerate() {
                for k in 0..3 {
                    let (a, b) = (corners[k], corners[(k + 1) % 3]);
                    sides.entry([a.min(b), a.max(b)]).or_default().push((t, k));
                }
            }
            let mut touched = vec![false; self.triangles.len()];
            for (edge, sides) in sides {
                let &[(t, k), (u, _)] = sides.as_slice() else { continue };
                if touched[t] || touched[u] || self.lines.contains(&edge) {
                    continue;
                }
                if let Some([new_t, new_u]) = flipped(&self.points, &self.triangles, t, k, u) {
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

    /// Cotangent of the angle at `at` in the triangle with `a` and `b`, in space.
    fn cotangent(&self, at: usize, a: usize, b: usize) -> f64 {
        let p = on_surface(self.points[at]);
        let (u, v) = (on_surface(self.points[a]) - p, on_surface(self.points[b]) - p);
        u.dot(&v) / u.cross(&v).norm().max(1e-12)
    }

    fn around(&self) -> Vec<Vec<usize>> {
        let mut around = vec![Vec::new(); self.points.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            for &i in corners {
                around[i].push(t);
            }
        }
        around
    }

    /// Moves every free vertex along the surface to the centroid of its triangles, `rounds` times.
    fn relax(&mut self, rounds: usize) {
        let around = self.around();
        for _ in 0..rounds {
            for v in self.free() {
                let p = on_surface(self.points[v]);
                let (mut sum, mut normal, mut weight) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros(), 0.0);
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
                let step = sum / weight;
                let step = step - normal * (step.dot(&normal) / normal.norm_squared());
                self.try_move(
                    v,
                    [self.points[v][0] + step.x, self.points[v][1] + step.y],
                    &around[v],
                    f64::NEG_INFINITY,
                );
            }
        }
    }

    /// The vertices that may move.
    fn free(&self) -> Vec<usize> {
        (0..self.points.len()).filter(|&v| !self.fixed[v]).collect()
    }

    /// Moves a vertex unless a triangle would turn over or the worst of them become worse than `least`.
    fn try_move(&mut self, v: usize, to: [f64; 2], around: &[usize], least: f64) -> bool {
        let from = std::mem::replace(&mut self.points[v], to);
        let ok = around.iter().all(|&t| {
            let [a, b, c] = self.triangles[t];
            doubled_area(self.points[a], self.points[b], self.points[c]) > 0.2
        }) && self.worst(around) > least;
        if !ok {
            self.points[v] = from;
        }
        ok
    }

    /// Least shape of some triangles: 1 equilateral, 0 flat.
    fn worst(&self, triangles: &[usize]) -> f64 {
        triangles.iter().map(|&t| shape(self.corners(t))).fold(f64::INFINITY, f64::min)
    }

    /// Lets every free vertex search for a place where the worst of its triangles is better.
    fn open_angles(&mut self) {
        let around = self.around();
        for round in 0..30 {
            let step = 1.5 / f64::from(1 + round / 3);
            for v in self.free() {
                let mut best = self.worst(&around[v]);
                if best > 0.8 {
                    continue;
                }
                for (dx, dy) in [
                    (1.0, 0.0),
                    (0.7, 0.7),
                    (0.0, 1.0),
                    (-0.7, 0.7),
                    (-1.0, 0.0),
                    (-0.7, -0.7),
                    (0.0, -1.0),
                    (0.7, -0.7),
                ] {
                    let [x, y] = self.points[v];
                    if self.try_move(v, [x + dx * step, y + dy * step], &around[v], best + 1e-9) {
                        best = self.worst(&around[v]);
                    }
                }
            }
        }
    }
}

/// Shape of a triangle: `4√3 · area / Σ length²`, 1 when equilateral, 0 when flat.
fn shape([a, b, c]: [Point3<f64>; 3]) -> f64 {
    let (u, v, w) = (b - a, c - b, a - c);
    2.0 * 3.0_f64.sqrt() * u.cross(&w).norm() / (u.norm_squared() + v.norm_squared() + w.norm_squared())
}

fn index_of(points: &mut Vec<[f64; 2]>, p: [f64; 2]) -> usize {
    let near = |q: &[f64; 2]| (q[0] - p[0]).abs() < 1e-6 && (q[1] - p[1]).abs() < 1e-6;
    points.iter().position(near).unwrap_or_else(|| {
        points.push(p);
        points.len() - 1
    })
}

impl Curve {
    /// The places of the vertices along the curve, its knots among them exactly.
    fn cut(&self) -> Vec<[f64; 2]> {
        if self.pieces.is_empty() {
            return self.through.to_vec();
        }
        let mut places = vec![self.through[0]];
        let mut start = 0;
        for &(end, cut) in self.pieces {
            let fine = self.between(start, end);
            places.extend(cut.fractions().into_iter().map(|f| at_fraction(&fine, f)));
            places.push(self.through[end]);
            start = end;
        }
        places
    }

    /// A fine polyline from one control point to another. Cubic with tangents by chord length.
    fn between(&self, start: usize, end: usize) -> Vec<[f64; 2]> {
        const FINE: usize = 32;
        let mut fine = vec![self.through[start]];
        for i in start..end {
            let (a, b) = (self.through[i], self.through[i + 1]);
            let chord = distance(a, b);
            let (ta, tb) = (self.tangent(i), self.tangent(i + 1));
            for k in 1..=FINE {
                let t = k as f64 / FINE as f64;
                let (t2, t3) = (t * t, t * t * t);
                fine.push([0, 1].map(|j| {
                    a[j] + (3.0 * t2 - 2.0 * t3) * (b[j] - a[j])
                        + chord * ((t3 - 2.0 * t2 + t) * ta[j] + (t3 - t2) * tb[j])
                }));
            }
        }
        fine
    }

    /// Derivative by chord length at a control point; across the join where the curve is closed.
    fn tangent(&self, i: usize) -> [f64; 2] {
        let p = self.through;
        let last = p.len() - 1;
        let closed = p[0] == p[last];
        let before = if i > 0 { Some(p[i - 1]) } else { closed.then(|| p[last - 1]) };
        let after = if i < last { Some(p[i + 1]) } else { closed.then(|| p[1]) };
        let slope = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|j| (b[j] - a[j]) / distance(a, b));
        match (before, after) {
            (Some(a), Some(b)) => {
                let (left, right) = (distance(a, p[i]), distance(p[i], b));
                let (s, r) = (slope(a, p[i]), slope(p[i], b));
                [0, 1].map(|j| (s[j] * right + r[j] * left) / (left + right))
            }
            (Some(a), None) => slope(a, p[i]),
            (None, Some(b)) => slope(p[i], b),
            (None, None) => [0.0, 0.0],
        }
    }
}

impl Cut {
    /// Where the cuts between the ends lie, as fractions of the length in space.
    fn fractions(self) -> Vec<f64> {
        match self {
            Cut::Even(n) => (1..n).map(|k| k as f64 / n as f64).collect(),
            Cut::Staggered(n) => {
                let n = n as f64;
                let inner = (1..).map(|k| f64::from(k) + 0.5).take_while(|f| *f < n - 1.0);
                std::iter::once(0.75).chain(inner).chain([n - 0.75]).map(|f| f / n).collect()
            }
        }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt()
}

/// The place at a fraction of the length in space of a polyline.
fn at_fraction(fine: &[[f64; 2]], fraction: f64) -> [f64; 2] {
    let lengths: Vec<f64> = fine.windows(2).map(|w| (on_surface(w[1]) - on_surface(w[0])).norm()).collect();
    let mut left = fraction * lengths.iter().sum::<f64>();
    for (w, &length) in fine.windows(2).zip(&lengths) {
        if left <= length {
            let t = left / length;
            return [0, 1].map(|j| w[0][j] + t * (w[1][j] - w[0][j]));
        }
        left -= length;
    }
    fine[fine.len() - 1]
}
