//! Which vertex lies under the pointer: the nearest one that no part of the surface hides.

use egui::{Pos2, Vec2};

use super::scene::Projected;
use super::surface::Surface;
use crate::face::Mesh;

/// How near the pointer must come, points.
pub const REACH: f32 = 22.0;
/// Of so many nearest vertices the first one that nothing hides is meant.
const CANDIDATES: usize = 16;
/// A part must lie this much nearer to the eye to hide a vertex, mm: neighbours in the surface do not hide each other.
const CLEARANCE_MM: f64 = 0.5;

/// Where a vertex is drawn: its head if it has a triangle that stands up or a value, else its foot.
pub fn place(projected: &Projected, values: &[Option<f64>], v: usize) -> Pos2 {
    if values.get(v).copied().flatten().is_some() { projected.top[v] } else { projected.base[v] }
}

/// The vertex that the pointer means. Of vertices about equally near, one that is known is preferred.
pub fn pick(
    pointer: Pos2,
    mesh: &Mesh,
    surface: &Surface,
    projected: &Projected,
    values: &[Option<f64>],
) -> Option<usize> {
    let known = |v: usize| values.get(v).copied().flatten().is_some();
    let mut near: Vec<(f32, usize)> = (0..mesh.len())
        .filter_map(|v| {
            let distance = place(projected, values, v).distance(pointer);
            (distance <= REACH).then(|| (if known(v) { distance } else { distance + 4.0 }, v))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.into_iter().take(CANDIDATES).map(|(_, v)| v).find(|&v| !hidden(v, mesh, surface, projected, values))
}

/// Whether a part of the surface lies between the vertex and the eye.
pub fn hidden(v: usize, mesh: &Mesh, surface: &Surface, projected: &Projected, values: &[Option<f64>]) -> bool {
    let raised = values.get(v).copied().flatten().is_some();
    let at = place(projected, values, v);
    let depth = if raised { projected.top_depth[v] } else { projected.base_depth[v] };
    mesh.triangles().iter().zip(&surface.raised).any(|(t, &up)| {
        let t = t.map(|v| v as usize);
        if t.contains(&v) && up == raised {
            return false;
        }
        let (pixels, depths) = if up {
            (t.map(|v| projected.top[v]), t.map(|v| projected.top_depth[v]))
        } else {
            (t.map(|v| projected.base[v]), t.map(|v| projected.base_depth[v]))
        };
        // Of a hundred thousand triangles all but a few lie to one side.
        let [x, y] = [pixels.map(|p| p.x - at.x), pixels.map(|p| p.y - at.y)];
        let beside = |d: [f32; 3]| d.iter().all(|d| *d > 1.0) || d.iter().all(|d| *d < -1.0);
        if beside(x) || beside(y) {
            return false;
        }
        depth_at(pixels, depths, at).is_some_and(|here| here > depth + CLEARANCE_MM)
    })
}

/// Depth of a triangle where the pointer is, if the pointer is on it.
pub fn depth_at(pixels: [Pos2; 3], depths: [f64; 3], at: Pos2) -> Option<f64> {
    let weights = barycentric(pixels, at)?;
    Some(weights.iter().zip(depths).map(|(w, d)| f64::from(*w) * d).sum())
}

/// Weights of the corners at a point, if it lies in the triangle.
fn barycentric([a, b, c]: [Pos2; 3], p: Pos2) -> Option<[f32; 3]> {
    let cross = |u: Vec2, v: Vec2| u.x * v.y - u.y * v.x;
    let doubled_area = cross(b - a, c - a);
    if doubled_area.abs() < 1e-6 {
        return None;
    }
    let weights = [cross(c - b, p - b), cross(a - c, p - c), cross(b - a, p - a)].map(|w| w / doubled_area);
    // A little beyond the edge counts as inside, so that nothing slips through between two neighbours.
    weights.iter().all(|w| *w >= -1e-4).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::height_map::Relief;
    use crate::gui::orbit_view::{OrbitView, StandardView};
    use egui::{Rect, pos2};
    use nalgebra::Point3;

    /// A strip of squares along y, 10 mm each, as wide; only the middle rows stand up, as a wall.
    fn wall() -> (Mesh, Vec<Option<f64>>) {
        let p = (0..14).map(|k| Point3::new(f64::from(k % 2) * 10.0, f64::from(k / 2) * 10.0, 0.0)).collect();
        let t = (0..6).flat_map(|r| [[2 * r, 2 * r + 1, 2 * r + 3], [2 * r, 2 * r + 3, 2 * r + 2]]).collect();
        let values = (0..14).map(|k| matches!(k / 2, 2..=3).then_some(4.0)).collect();
        (Mesh::new(p, t).unwrap(), values)
    }

    #[test]
    fn each_vertex_is_picked_where_it_is_drawn_from_the_front() {
        let (mesh, values) = wall();
        let surface = Surface::new(&mesh, mesh.positions(), &values, 10.0, Relief::Plane);
        let canvas = Rect::from_min_max(pos2(0.0, 0.0), pos2(400.0, 800.0));
        let projection =
            OrbitView::standard(StandardView::Front).project_into(canvas, surface.extent(0..mesh.len(), f64::INFINITY));
        let projected = Projected::new(&surface, &projection);
        for v in 0..mesh.len() {
            let at = place(&projected, &values, v);
            assert_eq!(pick(at + Vec2::new(1.0, -2.0), &mesh, &surface, &projected, &values), Some(v));
        }
        assert_eq!(pick(pos2(-500.0, 0.0), &mesh, &surface, &projected, &values), None);
    }

    #[test]
    fn what_the_wall_hides_cannot_be_picked_through_it() {
        let (mesh, values) = wall();
        let canvas = Rect::from_min_max(pos2(0.0, 0.0), pos2(400.0, 400.0));
        let mut view = OrbitView::standard(StandardView::Below);
        view.elevation = 30_f64.to_radians();
        let projected = |mm_per_unit: f64| {
            let s = Surface::new(&mesh, mesh.positions(), &values, mm_per_unit, Relief::Plane);
            let p = view.project_into(canvas, s.extent(0..mesh.len(), f64::INFINITY));
            (Projected::new(&s, &p), s)
        };
        // From 30° above the plan, up on the screen is y sin 30° + z cos 30°. The roof (y = 20 to 30 mm, 20 mm high) spans 27.3 to 32.3 mm,
        // so it covers the feet at y = 60 mm, which lie at 30 mm.
        let (low, s) = projected(5.0);
        assert!(hidden(12, &mesh, &s, &low, &values) && hidden(13, &mesh, &s, &low, &values));
        assert!(!hidden(0, &mesh, &s, &low, &values), "in front of the wall");
        assert!(!hidden(4, &mesh, &s, &low, &values), "on the wall");
        let (flat, s) = projected(0.0);
        assert!(!hidden(12, &mesh, &s, &flat, &values));
    }
}
