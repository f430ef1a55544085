//! A smooth surface under the skin, over which the skin slides while every vertex keeps its height above it.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use super::Mesh;

/// A smooth height field in space: φ(x) is about the height of x above the face at rest, in mm, and ∇φ its outward normal.
///
/// φ is the mean of the heights above the tangent planes of the face's vertices, weighted by (r² + ε²)⁻³ (implicit moving least
/// squares: Kolluri 2008), taken at the nodes of a grid and blended with quadratic B-splines. It is smooth where the mesh has
/// facets, goes on over the openings of eyes and mouth, and has a second derivative, which Newton's method needs. It does not
/// pass through the vertices: each keeps the height that it has at rest.
#[derive(Clone, Debug)]
pub struct Skull {
    low: Point3<f64>,
    pitch: f64,
    per_pitch: f64,
    counts: [usize; 3],
    /// Where the last whole spline is centred, in pitches.
    last: [f64; 3],
    nodes: Vec<f64>,
}

/// φ with its slope and, where asked for, its second derivative at one place.
#[derive(Clone, Copy, Debug)]
pub struct Height {
    /// φ, mm.
    pub value: f64,
    /// ∇φ.
    pub gradient: Vector3<f64>,
    /// ∇∇φ, 1/mm.
    pub curvature: Matrix3<f64>,
}

/// More vertices than this are thinned out: the skull is smooth.
const MOST_SAMPLES: usize = 700;
/// How far the grid reaches beyond the face, mm.
const MARGIN_MM: f64 = 20.0;
/// Pitch of the grid in mean distances of the samples.
const PITCH: f64 = 0.7;
/// No grid has more nodes.
const MOST_NODES: f64 = 60_000.0;

impl Skull {
    /// Builds the surface from a mesh at the positions of its rest (mm).
    pub fn new(mesh: &Mesh, rest: &[Point3<f64>]) -> Self {
        let samples = samples(mesh, rest);
        let (mut low, mut high) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
        for p in rest {
            (low, high) = (low.inf(p), high.sup(p));
        }
        let area: f64 = mesh.vertex_areas(rest).iter().sum();
        let apart = (area / samples.len().max(1) as f64).sqrt().max(1e-3);
        let margin = Vector3::repeat(MARGIN_MM.max(2.0 * apart));
        let (low, size) = (low - margin, high - low + 2.0 * margin);
        let volume = size.x * size.y * size.z;
        let pitch = (PITCH * apart).max((volume / MOST_NODES).cbrt());
        let counts = [0, 1, 2].map(|a| (size[a] / pitch).ceil() as usize + 3);
        let epsilon = 0.25 * apart * apart;
        let plane = counts[0] * counts[1];
        let nodes: Vec<f64> = (0..plane * counts[2])
            .into_par_iter()
            .map(|node| {
                let at = [node % counts[0], node / counts[0] % counts[1], node / plane];
                let x = Point3::from([0, 1, 2].map(|a| low[a] + pitch * at[a] as f64));
                let (mut sum, mut weights) = (0.0, 0.0);
                for (p, n) in &samples {
                    let d = x - p;
                    let near = 1.0 / (d.norm_squared() + epsilon);
                    let w = near * near * near;
                    sum += w * n.dot(&d);
                    weights += w;
                }
                sum / weights
            })
            .collect();
        Self { low, pitch, per_pitch: 1.0 / pitch, counts, last: counts.map(|n| n as f64 - 2.0), nodes }
    }

    /// The height of a place with its slope and curvature. Beyond the grid it goes on straight.
    pub fn height(&self, x: &Point3<f64>) -> Height {
        self.evaluated::<true>(x)
    }

    /// The height of a place with its slope alone, in half the time.
    pub fn slope(&self, x: &Point3<f64>) -> (f64, Vector3<f64>) {
        let Height { value, gradient, .. } = self.evaluated::<false>(x);
        (value, gradient)
    }

    #[inline]
    fn evaluated<const BENT: bool>(&self, x: &Point3<f64>) -> Height {
        let mut first = [0_usize; 3];
        let (mut value, mut slope) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        let mut beyond = Vector3::zeros();
        for a in 0..3 {
            let at = (x[a] - self.low[a]) * self.per_pitch;
            let inside = at.clamp(1.0, self.last[a]);
            beyond[a] = self.pitch * (at - inside);
            // A place that is no number any more is answered with no number, not with a panic.
            let middle = ((inside + 0.5) as usize).max(1);
            first[a] = middle - 1;
            let t = inside - middle as f64;
            value[a] = [0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)];
            slope[a] = [t - 0.5, -2.0 * t, t + 0.5];
        }
        if !BENT && beyond != Vector3::zeros() {
            return self.evaluated::<true>(x);
        }
        let mut h = 0.0;
        let mut g = [0.0; 3];
        let mut c = [0.0; 6];
        let plane = self.counts[0] * self.counts[1];
        for k in 0..3 {
            // Sums over one slice: the value, the slopes in x and y, and the second ones in xx, xy and yy.
            let mut s = [0.0; 6];
            for j in 0..3 {
                let row = (first[2] + k) * plane + (first[1] + j) * self.counts[0] + first[0];
                let Some(&[n0, n1, n2]) = self.nodes.get(row..row + 3) else { continue };
                let along = |w: &[f64; 3]| w[0] * n0 + w[1] * n1 + w[2] * n2;
                let (v, d) = (along(&value[0]), along(&slope[0]));
                s[0] += value[1][j] * v;
                s[1] += value[1][j] * d;
                s[2] += slope[1][j] * v;
                if BENT {
                    s[3] += value[1][j] * (n0 - 2.0 * n1 + n2);
                    s[4] += slope[1][j] * d;
                    s[5] += BEND[j] * v;
                }
            }
            h += value[2][k] * s[0];
            g[0] += value[2][k] * s[1];
            g[1] += value[2][k] * s[2];
            g[2] += slope[2][k] * s[0];
            if BENT {
                c[0] += value[2][k] * s[3];
                c[1] += value[2][k] * s[4];
                c[2] += value[2][k] * s[5];
                c[3] += slope[2][k] * s[1];
                c[4] += slope[2][k] * s[2];
                c[5] += BEND[k] * s[0];
            }
        }
        let gradient = Vector3::from(g) * self.per_pitch;
        let curvature = Matrix3::new(c[0], c[1], c[3], c[1], c[2], c[4], c[3], c[4], c[5]);
        let curvature = curvature * (self.per_pitch * self.per_pitch);
        let value = h + gradient.dot(&beyond);
        // Beside the grid the slope along its side changes with the distance from it.
        let along = curvature * beyond;
        let gradient = gradient.zip_zip_map(&along, &beyond, |g, more, out| if out == 0.0 { g + more } else { g });
        Height { value, gradient, curvature }
    }
}

/// Second differences: the curvature of a quadratic B-spline.
const BEND: [f64; 3] = [1.0, -2.0, 1.0];

/// Vertices with their normals: all, or one a cell of a grid where there are too many. One whose triangles have no area has no
/// normal and is left out.
fn samples(mesh: &Mesh, rest: &[Point3<f64>]) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let mut weighted = vec![Vector3::zeros(); mesh.len()];
    for &t in mesh.triangles() {
        let doubled = super::mesh::doubled_area_vector(rest, t);
        for i in t {
            weighted[i as usize] += doubled;
        }
    }
    let all = || rest.iter().zip(&weighted);
    if mesh.len() <= MOST_SAMPLES {
        return all().filter_map(|(p, n)| Some((*p, n.try_normalize(1e-12)?))).collect();
    }
    let area: f64 = weighted.iter().map(Vector3::norm).sum::<f64>() / 6.0;
    // A surface crosses about 1.5 times as many cells as its area holds squares.
    let cell = (1.5 * area / MOST_SAMPLES as f64).sqrt().max(1e-9);
    let mut cells: std::collections::BTreeMap<[i64; 3], (Vector3<f64>, Vector3<f64>, f64)> =
        std::collections::BTreeMap::new();
    for (p, n) in all() {
        let key = [0, 1, 2].map(|a| (p[a] / cell).floor() as i64);
        let weight = n.norm();
        let sum = cells.entry(key).or_insert((Vector3::zeros(), Vector3::zeros(), 0.0));
        *sum = (sum.0 + p.coords * weight, sum.1 + n, sum.2 + weight);
    }
    let mean = |(p, n, w): (Vector3<f64>, Vector3<f64>, f64)| Some((Point3::from(p / w), n.try_normalize(1e-12)?));
    cells.into_values().filter_map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    #[test]
    fn slope_and_curvature_agree_with_differences_inside_and_beyond_the_grid() {
        let face = face::generic();
        let skull = Skull::new(face.mesh(), face.mesh().positions());
        for x in [Point3::new(21.0, 33.0, 12.0), Point3::new(-40.3, -51.2, 4.0), Point3::new(0.0, 300.0, -3.0)] {
            let at = skull.height(&x);
            for axis in 0..3 {
                let mut e = Vector3::zeros();
                e[axis] = 1e-4;
                let (up, down) = (skull.height(&(x + e)), skull.height(&(x - e)));
                assert!(((up.value - down.value) / 2e-4 - at.gradient[axis]).abs() < 1e-6);
                let inside = x.y < 200.0;
                let bend = (up.gradient - down.gradient) / 2e-4;
                assert!(!inside || (bend - at.curvature.column(axis)).norm() < 1e-4);
            }
        }
    }

    #[test]
    fn a_place_that_is_no_number_has_no_height() {
        let face = face::generic();
        let skull = Skull::new(face.mesh(), face.mesh().positions());
        for x in [f64::NAN, f64::INFINITY] {
            assert!(!skull.height(&Point3::new(x, 0.0, 0.0)).value.is_finite());
            assert!(!skull.slope(&Point3::new(0.0, x, 0.0)).0.is_finite());
        }
    }

    /// A sphere of radius 100 mm: the height 5 mm outside is 5, up to the smoothing (4 %), and the normal is radial.
    #[test]
    fn a_dome_s_height_is_that_above_the_sphere() {
        let flat = crate::face::patches::right_angled(21, 21, 5.0, 5.0);
        let dome: Vec<Point3<f64>> = flat
            .positions()
            .iter()
            .map(|p| {
                let (x, y) = (p.x - 50.0, p.y - 50.0);
                Point3::new(x, y, (1e4 - x * x - y * y).sqrt())
            })
            .collect();
        let mesh = flat.with_positions(dome.clone()).unwrap();
        let skull = Skull::new(&mesh, &dome);
        let at_rest = skull.height(&Point3::new(0.0, 0.0, 100.0)).value;
        for direction in [Vector3::new(0.1, 0.05, 1.0), Vector3::new(-0.2, 0.15, 1.0)] {
            let out = direction.normalize();
            let h = skull.height(&Point3::from(out * 105.0));
            assert!((h.value - at_rest - 5.0).abs() < 0.2, "{}", h.value);
            assert!(h.gradient.normalize().dot(&out) > 0.999);
        }
    }
}
