//! Levels of detail: a mesh of a hundred thousand vertices drawn small is drawn with fewer of them.
//!
//! Level 0 is the mesh. Each further one joins the vertices that fall into one cell of a grid of twice the spacing, and lets the one
//! nearest to their middle stand for them. So every level is drawn with vertices of the mesh itself, wherever the mesh has gone since.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use crate::face::mesh::{Mesh, NONE};

/// A mesh with fewer triangles than this is drawn whole.
const COARSEST: usize = 1200;

/// One level.
#[derive(Clone, Debug, Default)]
pub struct Level {
    /// The vertices of the mesh that it is drawn with.
    pub vertices: Vec<u32>,
    /// Its triangles; corners count in `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Its edges; ends count in `vertices`, lower first.
    pub edges: Vec<[u32; 2]>,
    /// The one or two triangles at each edge; [`NONE`] on the open side.
    pub triangles_of_edge: Vec<[u32; 2]>,
    /// For each vertex of the mesh the one of `vertices` that stands for it; empty in the finest level.
    pub stands_for: Vec<u32>,
    /// Mean length of its edges, mm.
    pub spacing_mm: f64,
}

/// All levels, the finest first.
#[derive(Clone, Debug)]
pub struct Levels(Vec<Level>);

impl Levels {
    /// Builds the levels of a mesh in time linear in its size, but for one sort of the edges.
    pub fn new(mesh: &Mesh) -> Self {
        let finest = Level {
            vertices: (0..mesh.len() as u32).collect(),
            triangles: mesh.triangles().to_vec(),
            edges: mesh.edges().to_vec(),
            triangles_of_edge: mesh.triangles_of_edge().to_vec(),
            stands_for: Vec::new(),
            spacing_mm: mesh.mean_edge_length(),
        };
        let mut levels = vec![finest];
        while let Some(last) = levels.last()
            && last.triangles.len() > COARSEST
            && let Some(next) = last.coarser(mesh.positions())
        {
            levels.push(next);
        }
        Self(levels)
    }

    /// The finest level whose edges are at least so long on the screen, or the coarsest.
    pub fn at(&self, points_per_mm: f64, least_points: f64) -> &Level {
        let long = |level: &&Level| level.spacing_mm * points_per_mm >= least_points;
        let coarsest = self.0.len() - 1;
        self.0.iter().find(long).unwrap_or(&self.0[coarsest])
    }

    /// The mesh itself.
    pub fn finest(&self) -> &Level {
        &self.0[0]
    }
}

impl Level {
    fn coarser(&self, positions: &[Point3<f64>]) -> Option<Self> {
        let cell_mm = 2.0 * self.spacing_mm;
        if !(cell_mm > 0.0 && cell_mm.is_finite()) {
            return None;
        }
        let place = |v: u32| positions[self.vertices[v as usize] as usize];
        let mut cells: HashMap<[i64; 3], u32> = HashMap::with_capacity(self.vertices.len() / 3);
        let mut cell_of = Vec::with_capacity(self.vertices.len());
        let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
        for v in 0..self.vertices.len() as u32 {
            let p = place(v);
            let key = [p.x, p.y, p.z].map(|c| (c / cell_mm).floor() as i64);
            let cell = *cells.entry(key).or_insert_with(|| {
                sums.push((Vector3::zeros(), 0.0));
                sums.len() as u32 - 1
            });
            cell_of.push(cell);
            let (sum, count) = &mut sums[cell as usize];
            *sum += p.coords;
            *count += 1.0;
        }
        let mut nearest = vec![(f64::INFINITY, 0); sums.len()];
        for (v, &cell) in cell_of.iter().enumerate() {
            let (sum, count) = sums[cell as usize];
            let off = (place(v as u32).coords - sum / count).norm_squared();
            if off < nearest[cell as usize].0 {
                nearest[cell as usize] = (off, self.vertices[v]);
            }
        }
        let mut triangles: Vec<[u32; 3]> = self
            .triangles
            .iter()
            .map(|t| t.map(|v| cell_of[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .map(from_the_least)
            .collect();
        triangles.sort_unstable();
        triangles.dedup();
        if triangles.is_empty() || 10 * triangles.len() > 9 * self.triangles.len() {
            return None;
        }
        let mut sides: Vec<([u32; 2], u32)> = (0_u32..)
            .zip(&triangles)
            .flat_map(|(t, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], t)))
            .collect();
        sides.sort_unstable();
        let (mut edges, mut triangles_of_edge): (Vec<[u32; 2]>, Vec<[u32; 2]>) = (Vec::new(), Vec::new());
        for (edge, t) in sides {
            match (edges.last(), triangles_of_edge.last_mut()) {
                // Of three at an edge, which joining can make, the third is drawn and not counted.
                (Some(last), Some(pair)) if *last == edge => pair[1] = t,
                _ => {
                    edges.push(edge);
                    triangles_of_edge.push([t, NONE]);
                }
            }
        }
        let vertices: Vec<u32> = nearest.into_iter().map(|(_, v)| v).collect();
        let length = |&[a, b]: &[u32; 2]| {
            (positions[vertices[a as usize] as usize] - positions[vertices[b as usize] as usize]).norm()
        };
        let spacing_mm = edges.iter().map(length).sum::<f64>() / edges.len() as f64;
        let stands_for = if self.stands_for.is_empty() {
            cell_of
        } else {
            self.stands_for.iter().map(|&v| cell_of[v as usize]).collect()
        };
        Some(Self { vertices, triangles, edges, triangles_of_edge, stands_for, spacing_mm })
    }
}

/// The same triangle, told from its least corner on.
fn from_the_least([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat square of n × n vertices, 1 mm apart.
    fn sheet(n: u32) -> Mesh {
        let positions = (0..n * n).map(|k| Point3::new(f64::from(k % n), f64::from(k / n), 0.0)).collect();
        let triangles = (0..(n - 1) * (n - 1))
            .flat_map(|k| {
                let a = k / (n - 1) * n + k % (n - 1);
                [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
            })
            .collect();
        Mesh::new(positions, triangles).unwrap()
    }

    #[test]
    fn each_level_has_about_a_quarter_of_the_triangles_and_still_covers_the_sheet() {
        let mesh = sheet(200);
        let levels = Levels::new(&mesh);
        assert!(levels.0.len() >= 4, "{}", levels.0.len());
        for pair in levels.0.windows(2) {
            let share = pair[1].triangles.len() as f64 / pair[0].triangles.len() as f64;
            assert!((0.12..0.45).contains(&share), "{share}");
            assert!(pair[1].spacing_mm > 1.5 * pair[0].spacing_mm);
            let at = |v: u32| mesh.positions()[pair[1].vertices[v as usize] as usize];
            let area: f64 =
                pair[1].triangles.iter().map(|t| (at(t[1]) - at(t[0])).cross(&(at(t[2]) - at(t[0]))).z / 2.0).sum();
            // The rim is drawn in by up to a cell.
            assert!(area > 0.7 * 199.0 * 199.0, "{area}: all wound as the mesh is");
        }
    }

    #[test]
    fn the_finest_level_that_can_be_seen_is_drawn() {
        let levels = Levels::new(&sheet(200));
        assert_eq!(levels.at(10.0, 6.0).vertices.len(), 200 * 200);
        let coarse = levels.at(0.5, 3.0);
        assert!(coarse.spacing_mm >= 6.0 && coarse.vertices.len() < 2500);
        let generic = crate::face::generic();
        assert_eq!(Levels::new(generic.mesh()).at(0.001, 6.0).triangles, generic.mesh().triangles());
    }
}
