//! What is drawn of a surface: every triangle of a small mesh; of a large one every triangle with data, and the rest from a coarser level.

use super::surface::Surface;
use crate::face::mesh::Mesh;
use crate::gui::face_drawing::levels::Level;

/// A mesh with fewer triangles is drawn whole.
const LARGE: usize = 20_000;

/// The triangles and edges to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// Triangles of the mesh.
    pub triangles: Vec<u32>,
    /// Triangles between vertices of the mesh that stand for many flat ones; all of them without data.
    pub coarse: Vec<[u32; 3]>,
    /// Edges of the mesh.
    pub edges: Vec<u32>,
}

/// Whether a mesh is large enough for a coarser level to be worth it.
pub fn is_large(mesh: &Mesh) -> bool {
    mesh.triangles().len() >= LARGE
}

impl Parts {
    /// Everything.
    pub fn whole(mesh: &Mesh) -> Self {
        Self {
            triangles: (0..mesh.triangles().len() as u32).collect(),
            coarse: Vec::new(),
            edges: (0..mesh.edges().len() as u32).collect(),
        }
    }

    /// Everything with data, and around it a ring of a cell; beyond that the level's triangles, which overlap the ring and nothing else.
    pub fn reduced(mesh: &Mesh, surface: &Surface, level: &Level) -> Self {
        let Some(&last) = level.stands_for.last() else { return Self::whole(mesh) };
        debug_assert!((last as usize) < level.vertices.len());
        let cell = |v: u32| level.stands_for[v as usize] as usize;
        let mut with_data = vec![false; level.vertices.len()];
        for (t, _) in mesh.triangles().iter().zip(&surface.raised).filter(|(_, raised)| **raised) {
            for &v in t {
                with_data[cell(v)] = true;
            }
        }
        let mut near = with_data.clone();
        for t in level.triangles.iter().filter(|t| t.iter().any(|&c| with_data[c as usize])) {
            for &c in t {
                near[c as usize] = true;
            }
        }
        let is_near = |t: &[u32; 3]| t.iter().any(|&v| near[cell(v)]);
        let triangles: Vec<u32> = (0..mesh.triangles().len() as u32)
            .filter(|&t| surface.raised[t as usize] || is_near(&mesh.triangles()[t as usize]))
            .collect();
        let beyond = level.triangles.iter().filter(|t| !t.iter().any(|&c| with_data[c as usize]));
        let raised = |t: &u32| surface.raised.get(*t as usize).copied().unwrap_or(false);
        Self {
            triangles,
            coarse: beyond.map(|t| t.map(|c| level.vertices[c as usize])).collect(),
            edges: (0_u32..)
                .zip(mesh.triangles_of_edge())
                .filter(|(_, sides)| sides.iter().any(raised))
                .map(|(e, _)| e)
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::face_drawing::levels::Levels;
    use crate::gui::height_map::Relief;
    use nalgebra::Point3;

    #[test]
    fn what_has_data_is_drawn_whole_and_the_rest_covers_the_sheet() {
        let n = 160_u32;
        let positions: Vec<_> = (0..n * n).map(|k| Point3::new(f64::from(k % n), f64::from(k / n), 0.0)).collect();
        let triangles = (0..(n - 1) * (n - 1))
            .flat_map(|k| {
                let a = k / (n - 1) * n + k % (n - 1);
                [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
            })
            .collect();
        let mesh = Mesh::new(positions, triangles).unwrap();
        assert!(is_large(&mesh));
        let with_data = |p: &Point3<f64>| (p.x - 80.0).abs() < 12.0 && (p.y - 60.0).abs() < 12.0;
        let values: Vec<_> = mesh.positions().iter().map(|p| with_data(p).then_some(1.0)).collect();
        let surface = Surface::new(&mesh, mesh.positions(), &values, 1.0, Relief::Plane);
        let levels = Levels::new(&mesh);
        let parts = Parts::reduced(&mesh, &surface, levels.at(1.0, 7.0));
        assert!(parts.triangles.len() + parts.coarse.len() < mesh.triangles().len() / 5);
        for t in 0..mesh.triangles().len() {
            assert!(!surface.raised[t] || parts.triangles.contains(&(t as u32)), "triangle {t} has data");
        }
        // No coarse triangle lies over data, and no place between the two is left empty.
        let inside = |t: &[u32; 3], x: f64, y: f64| {
            let [a, b, c] = t.map(|v| mesh.positions()[v as usize]);
            let side = |p: Point3<f64>, q: Point3<f64>| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
            side(a, b) >= -1e-9 && side(b, c) >= -1e-9 && side(c, a) >= -1e-9
        };
        let fine: Vec<[u32; 3]> = parts.triangles.iter().map(|&t| mesh.triangles()[t as usize]).collect();
        for k in 0..400 {
            let (x, y) = (20.0 + f64::from(k % 20) * 6.03, 20.0 + f64::from(k / 20) * 6.03);
            let on_data = (x - 80.0).abs() <= 11.0 && (y - 60.0).abs() <= 11.0;
            let coarse = parts.coarse.iter().any(|t| inside(t, x, y));
            assert!(!(on_data && coarse), "{x} {y} is covered twice");
            assert!(coarse || fine.iter().any(|t| inside(t, x, y)), "{x} {y} is empty");
        }
    }
}
