//! What is drawn of a surface: every triangle of a small mesh; of a large one as many as can be seen, most of them where there are data.

use super::surface::Surface;
use crate::face::mesh::Mesh;
use crate::gui::face_drawing::levels::Level;

/// A mesh with fewer triangles is drawn whole.
const LARGE: usize = 20_000;

/// A triangle to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Its corners, vertices of the mesh.
    pub corners: [u32; 3],
    /// Whether it stands up: all its corners have data.
    pub raised: bool,
}

/// The triangles and edges to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// The triangles.
    pub triangles: Vec<Part>,
    /// Edges of the mesh.
    pub edges: Vec<u32>,
    /// Edges at which what stands up ends, by their two vertices.
    pub rim: Vec<[u32; 2]>,
}

/// Whether a mesh is large enough for a coarser level to be worth it.
pub fn is_large(mesh: &Mesh) -> bool {
    mesh.triangles().len() >= LARGE
}

impl Parts {
    /// Everything.
    pub fn whole(mesh: &Mesh, surface: &Surface) -> Self {
        let part = |(corners, raised): (&[u32; 3], &bool)| Part { corners: *corners, raised: *raised };
        Self {
            triangles: mesh.triangles().iter().zip(&surface.raised).map(part).collect(),
            edges: (0..mesh.edges().len() as u32).collect(),
            rim: surface.rim.iter().map(|&e| mesh.edges()[e as usize]).collect(),
        }
    }

    /// What has data from the level `fine`, a ring around it, too, and beyond that from the level `flat`, which overlaps the ring and
    /// nothing else. Where many vertices become one, the one with the largest value stands for them: no peak is lost.
    pub fn reduced(mesh: &Mesh, surface: &Surface, values: &[Option<f64>], fine: &Level, flat: &Level) -> Self {
        if flat.stands_for.is_empty() {
            return Self::whole(mesh, surface);
        }
        let best = highest(values, fine);
        let corners = |t: &[u32; 3]| -> Part {
            match t.map(|c| best[c as usize]) {
                [Some(a), Some(b), Some(c)] => Part { corners: [a, b, c], raised: true },
                _ => Part { corners: t.map(|c| fine.vertices[c as usize]), raised: false },
            }
        };
        let mut triangles: Vec<Part> = fine.triangles.iter().map(corners).collect();
        let cell = |v: u32| flat.stands_for[v as usize] as usize;
        let mut with_data = vec![false; flat.vertices.len()];
        for v in triangles.iter().filter(|t| t.raised).flat_map(|t| t.corners) {
            with_data[cell(v)] = true;
        }
        let mut near = with_data.clone();
        for t in flat.triangles.iter().filter(|t| t.iter().any(|&c| with_data[c as usize])) {
            for &c in t {
                near[c as usize] = true;
            }
        }
        triangles.retain(|t| t.raised || t.corners.iter().any(|&v| near[cell(v)]));
        let beyond = flat.triangles.iter().filter(|t| !t.iter().any(|&c| with_data[c as usize]));
        triangles.extend(beyond.map(|t| Part { corners: t.map(|c| flat.vertices[c as usize]), raised: false }));
        let raised = |t: &u32| surface.raised.get(*t as usize).copied().unwrap_or(false);
        let edges = (0_u32..).zip(mesh.triangles_of_edge()).filter(|(_, sides)| sides.iter().any(raised));
        // Where even triangles are joined edges cannot be told apart.
        let edges = if fine.stands_for.is_empty() { edges.map(|(e, _)| e).collect() } else { Vec::new() };
        let rim = rim(&triangles);
        Self { triangles, edges, rim }
    }
}

/// The sides that belong to one triangle that stands up and to no second.
fn rim(triangles: &[Part]) -> Vec<[u32; 2]> {
    let raised = triangles.iter().filter(|t| t.raised).map(|t| t.corners);
    let mut sides: Vec<[u32; 2]> =
        raised.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)])).collect();
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// For each vertex of a level the vertex of the mesh with the largest value among those that it stands for.
fn highest(values: &[Option<f64>], level: &Level) -> Vec<Option<u32>> {
    let mut best: Vec<Option<(f64, u32)>> = vec![None; level.vertices.len()];
    for (v, value) in (0_u32..).zip(values) {
        let Some(size) = value.map(f64::abs) else { continue };
        let place = if level.stands_for.is_empty() { v } else { level.stands_for[v as usize] };
        let here = &mut best[place as usize];
        if here.is_none_or(|(most, _)| size > most) {
            *here = Some((size, v));
        }
    }
    best.into_iter().map(|b| b.map(|(_, v)| v)).collect()
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
        let parts = Parts::reduced(&mesh, &surface, &values, levels.finest(), levels.at(1.0, 7.0));
        assert!(parts.triangles.len() < mesh.triangles().len() / 5);
        let raised = parts.triangles.iter().filter(|t| t.raised).count();
        assert_eq!(raised, surface.raised.iter().filter(|r| **r).count(), "what has data is there whole");
        let mut of_surface: Vec<_> = surface.rim.iter().map(|&e| mesh.edges()[e as usize]).collect();
        of_surface.sort_unstable();
        assert_eq!(parts.rim, of_surface, "and ends where the data end");
        // No coarse triangle lies over data, and no place between the two is left empty.
        let inside = |t: &[u32; 3], x: f64, y: f64| {
            let [a, b, c] = t.map(|v| mesh.positions()[v as usize]);
            let side = |p: Point3<f64>, q: Point3<f64>| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
            side(a, b) >= -1e-9 && side(b, c) >= -1e-9 && side(c, a) >= -1e-9
        };
        for k in 0..400 {
            let (x, y) = (20.0 + f64::from(k % 20) * 6.03, 20.0 + f64::from(k / 20) * 6.03);
            let on_data = (x - 80.0).abs() <= 11.0 && (y - 60.0).abs() <= 11.0;
            let covered = |raised: bool| parts.triangles.iter().any(|t| t.raised == raised && inside(&t.corners, x, y));
            assert!(!(on_data && covered(false)), "{x} {y} is covered twice");
            assert!(covered(true) || covered(false), "{x} {y} is empty");
        }
        // Joined, the highest vertex of each cell is kept.
        let mut values = values;
        let peak = values.iter().position(Option::is_some).unwrap() + 5;
        values[peak] = Some(-9.0);
        let joined = Parts::reduced(&mesh, &surface, &values, levels.at(1.0, 2.0), levels.at(1.0, 7.0));
        assert!(joined.triangles.iter().any(|t| t.raised && t.corners.contains(&(peak as u32))));
        assert!(joined.triangles.len() < parts.triangles.len() && joined.edges.is_empty());
    }
}
