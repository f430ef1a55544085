//! The surface that the skin slides on: the face's own triangles, looked up by their place in the plane of the picture.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::motion::Between;
use crate::face::Mesh;

/// Side of a cell of the look-up grid, mm: about half a triangle.
const CELL_MM: f64 = 4.0;

/// Most cells along a side, so that a stray vertex far away costs no memory.
const MAX_CELLS: usize = 512;

/// The triangles of a face that look forward, found by (x, y).
pub(super) struct Surface<'a> {
    positions: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    normals: Vec<Vector3<f64>>,
    low: Point2<f64>,
    cell_mm: f64,
    cells: [usize; 2],
    lists: Vec<Vec<u32>>,
}

/// A place on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnSurface {
    /// Where, mm.
    pub point: Point3<f64>,
    /// Smooth outward unit normal.
    pub normal: Vector3<f64>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        let positions = mesh.positions();
        let along = |axis: usize| {
            let low = positions.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
            (low, positions.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max) - low)
        };
        let ((x, width), (y, height)) = (along(0), along(1));
        let cell_mm = CELL_MM.max(width.max(height) / MAX_CELLS as f64);
        let cells = [width, height].map(|side| (side / cell_mm) as usize + 1);
        let mut surface = Self {
            positions,
            triangles: mesh.triangles(),
            normals: smooth_normals(mesh, positions),
            low: Point2::new(x, y),
            cell_mm,
            cells,
            lists: vec![Vec::new(); cells[0] * cells[1]],
        };
        for (i, t) in mesh.triangles().iter().enumerate() {
            let corners = t.map(|v| surface.cell(&positions[v as usize].xy()));
            let range = |axis: usize| {
                let all = corners.map(|c| c[axis]);
                all.into_iter().min().unwrap_or(0)..=all.into_iter().max().unwrap_or(0)
            };
            for row in range(1) {
                for column in range(0) {
                    surface.lists[row * cells[0] + column].push(i as u32);
                }
            }
        }
        surface
    }

    fn cell(&self, p: &Point2<f64>) -> [usize; 2] {
        let place = (p - self.low) / self.cell_mm;
        [0, 1].map(|axis| (place[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    /// A place between vertices, with its smooth normal.
    pub(super) fn at(&self, place: &Between) -> OnSurface {
        let normal = place.blend(|v| self.normals[v]);
        OnSurface {
            point: Point3::from(place.blend(|v| self.positions[v].coords)),
            normal: normal.try_normalize(1e-12).unwrap_or_else(Vector3::z),
        }
    }

    /// The place of the surface over (x, y) whose depth is nearest to `z`; None beside the face or in an opening.
    pub(super) fn between(&self, p: &Point2<f64>, z: f64) -> Option<Between> {
        let [column, row] = self.cell(p);
        let candidates = self.lists[row * self.cells[0] + column].iter().filter_map(|&i| {
            let corners = self.triangles[i as usize].map(|v| v as usize);
            Some(Between { corners, weights: weights(corners.map(|v| self.positions[v].xy()), p)? })
        });
        let off = |place: &Between| (place.blend(|v| self.positions[v].coords).z - z).abs();
        candidates.min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The same with its point and normal.
    pub(super) fn over(&self, p: &Point2<f64>, z: f64) -> Option<OnSurface> {
        self.between(p, z).map(|place| self.at(&place))
    }

    /// Where a point of the surface comes to lie when it slides by (Δx, Δy): over its new place, on the surface again.
    ///
    /// A point that would leave the surface goes as far along its way as the surface reaches.
    pub(super) fn slide(&self, from: &OnSurface, by: &Vector2<f64>) -> OnSurface {
        if *by == Vector2::zeros() {
            return *from;
        }
        let reach = |share: f64| self.over(&(from.point.xy() + by * share), from.point.z);
        if let Some(there) = reach(1.0) {
            return there;
        }
        let (mut low, mut best) = (0.0, *from);
        let mut high = 1.0;
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            match reach(middle) {
                Some(there) => (low, best) = (middle, there),
                None => high = middle,
            }
        }
        best
    }
}

/// Vertex normals, averaged once with their neighbours: the facets of a coarse mesh then do not show in the light.
pub(super) fn smooth_normals(mesh: &Mesh, positions: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let sharp = mesh.vertex_normals(positions);
    let averaged = |v: usize| {
        let around = mesh.neighbours(v);
        let sum: Vector3<f64> = around.iter().map(|&n| sharp[n as usize]).sum();
        let mean = sharp[v] + sum / around.len().max(1) as f64;
        mean.try_normalize(1e-12).unwrap_or(sharp[v])
    };
    (0..mesh.len()).map(averaged).collect()
}

/// Barycentric weights of a point inside a triangle of the plane (a hair of slack at the sides); None outside and for a sliver.
fn weights([a, b, c]: [Point2<f64>; 3], p: &Point2<f64>) -> Option<[f64; 3]> {
    let area = (b - a).perp(&(c - a));
    if area.abs() < 1e-9 {
        return None;
    }
    let w = [(b - p).perp(&(c - p)) / area, (c - p).perp(&(a - p)) / area, (a - p).perp(&(b - p)) / area];
    w.iter().all(|&w| w > -1e-9).then_some(w)
}
