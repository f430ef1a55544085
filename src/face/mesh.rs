//! A triangle mesh that cannot hold nonsense: every index is in range, every coordinate finite, no triangle repeats a vertex.

use nalgebra::{Point3, Vector3};

/// Marks "no triangle" or "no vertex" in an adjacency table.
pub const NONE: u32 = u32::MAX;

/// Vertices (mm, face space), triangles (counter-clockwise seen from outside) and the adjacency that the chain needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    triangles_of_edge: Vec<[u32; 2]>,
    neighbours: Lists,
    triangles_of_vertex: Lists,
}

/// Why a mesh was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing to compute on.
    #[error("the mesh has {vertices} vertices and {triangles} triangles; at least 3 and 1 are needed")]
    Empty {
        /// Number of vertices found.
        vertices: usize,
        /// Number of triangles found.
        triangles: usize,
    },
    /// The index type holds 32 bits.
    #[error("the mesh has {vertices} vertices; the limit is {limit}")]
    TooLarge {
        /// Number of vertices found.
        vertices: usize,
        /// Largest number accepted.
        limit: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {index}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex index it names.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A triangle names one vertex twice.
    #[error("triangle {triangle} names vertex {vertex} twice")]
    RepeatedVertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex named twice.
        vertex: u32,
    },
    /// Three or more triangles meet at an edge: the skin would be a fork.
    #[error("{count} triangles share the edge between vertices {a} and {b}; at most 2 may")]
    NonManifoldEdge {
        /// One end.
        a: u32,
        /// The other end.
        b: u32,
        /// Number of triangles at the edge.
        count: usize,
    },
}

/// Lists of indices of different lengths in one block of memory (compressed rows).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Groups `(row, item)` pairs by row, keeping their order inside a row.
    pub fn from_pairs(rows: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0_u32; rows + 1];
        for (row, _) in pairs.clone() {
            starts[row as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[rows] as usize];
        for (row, item) in pairs {
            items[next[row as usize] as usize] = item;
            next[row as usize] += 1;
        }
        Self { starts, items }
    }

    /// The items of one row.
    pub fn row(&self, row: usize) -> &[u32] {
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}

impl Mesh {
    /// Largest number of vertices accepted (indices are 32 bits, and adjacency doubles the edges).
    pub const MAX_VERTICES: usize = 50_000_000;

    /// Checks the parts and builds the adjacency, in time linear in the size but for one sort of the edges.
    pub fn new(positions: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let n = positions.len();
        if n < 3 || triangles.is_empty() {
            return Err(MeshError::Empty { vertices: n, triangles: triangles.len() });
        }
        if n > Self::MAX_VERTICES {
            return Err(MeshError::TooLarge { vertices: n, limit: Self::MAX_VERTICES });
        }
        if let Some(vertex) = positions.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (triangle, t) in triangles.iter().enumerate() {
            if let Some(&index) = t.iter().find(|&&i| i as usize >= n) {
                return Err(MeshError::IndexOutOfRange { triangle, index, vertices: n });
            }
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                let vertex = if t[1] == t[2] { t[1] } else { t[0] };
                return Err(MeshError::RepeatedVertex { triangle, vertex });
            }
        }
        let (edges, triangles_of_edge) = edges_of(&triangles)?;
        let both_ways = edges.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
        let corners = triangles.iter().enumerate().flat_map(|(t, v)| v.iter().map(move |&i| (i, t as u32)));
        Ok(Self {
            neighbours: Lists::from_pairs(n, both_ways),
            triangles_of_vertex: Lists::from_pairs(n, corners),
            positions,
            triangles,
            edges,
            triangles_of_edge,
        })
    }

    /// Vertex positions, mm.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// Triangles, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Every edge once, lower index first, in ascending order.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The one or two triangles at each edge; [`NONE`] on the open side of a border.
    pub fn triangles_of_edge(&self) -> &[[u32; 2]] {
        &self.triangles_of_edge
    }

    /// Vertices joined to `vertex` by an edge.
    pub fn neighbours(&self, vertex: usize) -> &[u32] {
        self.neighbours.row(vertex)
    }

    /// Triangles with a corner at `vertex`.
    pub fn triangles_of_vertex(&self, vertex: usize) -> &[u32] {
        self.triangles_of_vertex.row(vertex)
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Always false: an empty mesh is refused.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The same triangles over other positions (one a vertex).
    ///
    /// # Errors
    /// Refuses a wrong number of positions and coordinates that are not finite.
    pub fn with_positions(&self, positions: Vec<Point3<f64>>) -> Result<Self, MeshError> {
        if positions.len() != self.len() {
            return Err(MeshError::Empty { vertices: positions.len(), triangles: self.triangles.len() });
        }
        if let Some(vertex) = positions.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        Ok(Self { positions, ..self.clone() })
    }

    /// Mean length of the edges, mm.
    pub fn mean_edge_length(&self) -> f64 {
        let sum: f64 =
            self.edges.iter().map(|&[a, b]| (self.positions[a as usize] - self.positions[b as usize]).norm()).sum();
        sum / self.edges.len() as f64
    }

    /// Outward unit normal of each vertex: the mean of its triangles' normals, weighted by area (the z axis where that is zero).
    pub fn vertex_normals(&self, positions: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        let mut normals = vec![Vector3::zeros(); self.len()];
        for &t in &self.triangles {
            let doubled_area = doubled_area_vector(positions, t);
            for i in t {
                normals[i as usize] += doubled_area;
            }
        }
        for n in &mut normals {
            *n = n.try_normalize(1e-12).unwrap_or_else(Vector3::z);
        }
        normals
    }

    /// The same for one vertex.
    pub fn normal_at(&self, positions: &[Point3<f64>], vertex: usize) -> Vector3<f64> {
        let triangles = self.triangles_of_vertex(vertex).iter();
        let sum: Vector3<f64> = triangles.map(|t| doubled_area_vector(positions, self.triangles[*t as usize])).sum();
        sum.try_normalize(1e-12).unwrap_or_else(Vector3::z)
    }

    /// Area of the skin that each vertex stands for: a third of its triangles, mm².
    pub fn vertex_areas(&self, positions: &[Point3<f64>]) -> Vec<f64> {
        let mut areas = vec![0.0; self.len()];
        for &t in &self.triangles {
            let share = doubled_area_vector(positions, t).norm() / 6.0;
            for i in t {
                areas[i as usize] += share;
            }
        }
        areas
    }

    /// Whether each vertex lies on a border (an opening or the rim).
    pub fn on_border(&self) -> Vec<bool> {
        let mut border = vec![false; self.len()];
        for (edge, sides) in self.edges.iter().zip(&self.triangles_of_edge) {
            if sides[1] == NONE {
                border[edge[0] as usize] = true;
                border[edge[1] as usize] = true;
            }
        }
        border
    }
}

/// Cross product of two edges of a triangle: outward, as long as twice the area (mm²). Thesis (4.19).
pub fn doubled_area_vector(positions: &[Point3<f64>], [a, b, c]: [u32; 3]) -> Vector3<f64> {
    let x1 = positions[a as usize];
    (positions[b as usize] - x1).cross(&(positions[c as usize] - x1))
}

type EdgeTable = (Vec<[u32; 2]>, Vec<[u32; 2]>);

fn edges_of(triangles: &[[u32; 3]]) -> Result<EdgeTable, MeshError> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(triangles.len() * 3);
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            sides.push(([p.min(q), p.max(q)], t as u32));
        }
    }
    sides.sort_unstable();
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(sides.len() / 2);
    let mut faces: Vec<[u32; 2]> = Vec::with_capacity(sides.len() / 2);
    for run in sides.chunk_by(|x, y| x.0 == y.0) {
        let [a, b] = run[0].0;
        if run.len() > 2 {
            return Err(MeshError::NonManifoldEdge { a, b, count: run.len() });
        }
        edges.push([a, b]);
        faces.push([run[0].1, run.get(1).map_or(NONE, |s| s.1)]);
    }
    Ok((edges, faces))
}

/// Triangles of `columns` × `rows` vertices (at least 2 each, row by row) whose odd rows are shifted by half an edge towards the ends of the rows:
/// equilateral ones, where the rows lie √3/2 edges apart.
pub fn lattice_triangles(columns: usize, rows: usize) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let i = (r * columns + c) as u32;
            let up = i + columns as u32;
            if r % 2 == 0 {
                triangles.extend([[i, i + 1, up], [i + 1, up + 1, up]]);
            } else {
                triangles.extend([[i, i + 1, up + 1], [i, up + 1, up]]);
            }
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let p = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        (p.iter().map(|p| Point3::new(p[0], p[1], 0.0)).collect(), vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn a_square_of_two_triangles_has_five_edges_and_the_diagonal_has_two_sides() {
        let (p, t) = square();
        let mesh = Mesh::new(p, t).unwrap();
        assert_eq!(mesh.edges(), &[[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(mesh.triangles_of_edge()[1], [0, 1]);
        assert_eq!(mesh.triangles_of_edge().iter().filter(|s| s[1] == NONE).count(), 4);
        assert_eq!(mesh.neighbours(0), &[1, 2, 3]);
        // Two triangles of 2 mm² each; corner 0 touches both: (2 + 2) / 3.
        let areas = mesh.vertex_areas(mesh.positions());
        assert!((areas[0] - 4.0 / 3.0).abs() < 1e-12 && (areas[1] - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(mesh.vertex_normals(mesh.positions())[2], Vector3::z());
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let (p, t) = square();
        let mut bad = p.clone();
        bad[3].y = f64::NAN;
        assert_eq!(Mesh::new(bad, t), Err(MeshError::NotFinite { vertex: 3 }));
        assert_eq!(
            Mesh::new(p.clone(), vec![[0, 1, 9]]),
            Err(MeshError::IndexOutOfRange { triangle: 0, index: 9, vertices: 4 })
        );
        assert_eq!(Mesh::new(p.clone(), vec![[0, 1, 1]]), Err(MeshError::RepeatedVertex { triangle: 0, vertex: 1 }));
        let mut fork = p;
        fork.push(Point3::new(1.0, 1.0, 5.0));
        assert_eq!(
            Mesh::new(fork, vec![[0, 1, 2], [0, 2, 3], [0, 2, 4]]),
            Err(MeshError::NonManifoldEdge { a: 0, b: 2, count: 3 })
        );
    }
}
