//! The place of a surface that lies nearest to a point, found through a tree of boxes.

use nalgebra::{Point3, Vector3};

use super::mesh::NONE;
use super::{Mesh, MeshError};

/// Triangles in a leaf of the tree.
const LEAF: usize = 4;
/// A weight below this counts as none: the place lies on an edge or a corner.
const ON_EDGE: f64 = 1e-9;

/// A surface prepared for looking up nearest places.
#[derive(Clone, Debug)]
pub struct Surface {
    mesh: Mesh,
    nodes: Vec<Node>,
    /// Triangles in the order of the leaves.
    order: Vec<u32>,
    border: Vec<bool>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    /// A leaf's first place in `order`, or the number of the left child (the right one follows it).
    first: u32,
    /// Triangles of a leaf; 0 for a branch.
    count: u32,
}

/// The nearest place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Where it is, mm.
    pub point: Point3<f64>,
    /// How far away, mm.
    pub distance: f64,
    /// The triangle it lies on.
    pub triangle: u32,
    /// Barycentric weights of that triangle's corners.
    pub weights: [f64; 3],
    /// Whether it lies on the border of the surface: the point may well lie where the surface does not reach.
    pub on_border: bool,
}

impl Surface {
    /// Prepares a mesh at its own positions.
    pub fn new(mesh: &Mesh) -> Self {
        let mut surface = Self {
            nodes: Vec::new(),
            order: (0..mesh.triangles().len() as u32).collect(),
            border: mesh.on_border(),
            mesh: mesh.clone(),
        };
        surface.nodes.push(Node { low: Point3::origin(), high: Point3::origin(), first: 0, count: 0 });
        surface.build(0, 0, mesh.triangles().len());
        surface
    }

    /// Prepares a mesh at other positions.
    ///
    /// # Errors
    /// As [`Mesh::with_positions`].
    pub fn at(mesh: &Mesh, positions: Vec<Point3<f64>>) -> Result<Self, MeshError> {
        Ok(Self::new(&mesh.with_positions(positions)?))
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Unit normal of a triangle; the z axis where it has no area.
    pub fn normal(&self, triangle: u32) -> Vector3<f64> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a)).try_normalize(1e-12).unwrap_or_else(Vector3::z)
    }

    fn corners(&self, t: u32) -> [Point3<f64>; 3] {
        self.mesh.triangles()[t as usize].map(|i| self.mesh.positions()[i as usize])
    }

    /// Fills node `at` with the triangles `from..to` of the order. The halves of a split are equal, so the tree is no deeper than 32.
    fn build(&mut self, at: usize, from: usize, to: usize) {
        let (mut low, mut high) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
        for &t in &self.order[from..to] {
            for p in self.corners(t) {
                low = low.inf(&p);
                high = high.sup(&p);
            }
        }
        if to - from <= LEAF {
            self.nodes[at] = Node { low, high, first: from as u32, count: (to - from) as u32 };
            return;
        }
        let axis = (high - low).imax();
        let middle = usize::midpoint(from, to);
        let mesh = &self.mesh;
        let key =
            |t: &u32| mesh.triangles()[*t as usize].iter().map(|&i| mesh.positions()[i as usize][axis]).sum::<f64>();
        self.order[from..to].select_nth_unstable_by(middle - from, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let left = self.nodes.len();
        let empty = Node { low, high, first: 0, count: 0 };
        self.nodes.extend([empty, empty]);
        self.nodes[at] = Node { low, high, first: left as u32, count: 0 };
        self.build(left, from, middle);
        self.build(left + 1, middle, to);
    }

    /// The place nearest to `x`.
    pub fn closest(&self, x: &Point3<f64>) -> Closest {
        let mut best =
            Closest { point: *x, distance: f64::INFINITY, triangle: 0, weights: [1.0, 0.0, 0.0], on_border: false };
        let mut waiting = vec![(0.0, 0_usize)];
        while let Some((least, node)) = waiting.pop() {
            if least >= best.distance {
                continue;
            }
            let Node { first, count, .. } = self.nodes[node];
            if count == 0 {
                let mut children = [first as usize, first as usize + 1].map(|n| (self.box_distance(n, x), n));
                // The nearer is looked at first: it comes to lie on top.
                children.sort_by(|a, b| b.0.total_cmp(&a.0));
                waiting.extend(children);
                continue;
            }
            for &t in &self.order[first as usize..(first + count) as usize] {
                let corners = self.corners(t);
                let weights = nearest_weights(x, corners);
                let point = Point3::from(corners.iter().zip(weights).map(|(p, w)| p.coords * w).sum::<Vector3<f64>>());
                let distance = (point - x).norm();
                if distance < best.distance {
                    best = Closest { point, distance, triangle: t, weights, on_border: false };
                }
            }
        }
        best.on_border = self.on_border(best.triangle, best.weights);
        best
    }

    fn box_distance(&self, node: usize, x: &Point3<f64>) -> f64 {
        let Node { low, high, .. } = self.nodes[node];
        (x - x.sup(&low).inf(&high)).norm()
    }

    /// Whether a place lies on an edge or corner where the surface ends.
    fn on_border(&self, triangle: u32, weights: [f64; 3]) -> bool {
        let corners = self.mesh.triangles()[triangle as usize];
        let held: Vec<u32> = corners.iter().zip(weights).filter(|(_, w)| *w > ON_EDGE).map(|(c, _)| *c).collect();
        match held.as_slice() {
            [v] => self.border[*v as usize],
            [a, b] => {
                let edge = [*a.min(b), *a.max(b)];
                let found = self.mesh.edges().binary_search(&edge);
                found.is_ok_and(|e| self.mesh.triangles_of_edge()[e][1] == NONE)
            }
            _ => false,
        }
    }
}

/// Barycentric weights of the place of a triangle that is nearest to `x`. Source: Ericson, Real-Time Collision Detection, 5.1.5.
fn nearest_weights(x: &Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let (ax, bx, cx) = (x - a, x - b, x - c);
    let (d1, d2) = (ab.dot(&ax), ac.dot(&ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(&bx), ac.dot(&bx));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let (d5, d6) = (ab.dot(&cx), ac.dot(&cx));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let all = va + vb + vc;
    [va / all, vb / all, vc / all]
}

#[cfg(test)]
mod tests {
    use super::super::patches::{Noise, right_angled};
    use super::*;

    #[test]
    fn places_on_a_square_by_hand() {
        let surface = Surface::new(&right_angled(3, 3, 10.0, 10.0));
        for (x, point, distance, on_border) in [
            ([12.0, 7.0, 5.0], [12.0, 7.0, 0.0], 5.0, false),
            ([24.0, 7.0, 3.0], [20.0, 7.0, 0.0], 5.0, true),
            ([23.0, -4.0, 0.0], [20.0, 0.0, 0.0], 5.0, true),
            ([10.0, 10.0, -2.0], [10.0, 10.0, 0.0], 2.0, false),
        ] {
            let found = surface.closest(&Point3::from(x));
            assert!((found.point - Point3::from(point)).norm() < 1e-12 && (found.distance - distance).abs() < 1e-12);
            assert_eq!(found.on_border, on_border, "{x:?}");
        }
    }

    /// The tree finds what looking at every triangle finds.
    #[test]
    fn the_tree_misses_nothing() {
        let face = crate::face::generic();
        let surface = Surface::new(face.mesh());
        let mut noise = Noise(3);
        for _ in 0..300 {
            let x = Point3::new(90.0 * noise.uniform(), 110.0 * noise.uniform(), 60.0 * noise.uniform());
            let all = (0..face.mesh().triangles().len() as u32).map(|t| {
                let corners = surface.corners(t);
                let place: Vector3<f64> =
                    corners.iter().zip(nearest_weights(&x, corners)).map(|(p, w)| p.coords * w).sum();
                (place - x.coords).norm()
            });
            let least = all.fold(f64::INFINITY, f64::min);
            assert!((surface.closest(&x).distance - least).abs() < 1e-12);
        }
    }
}
