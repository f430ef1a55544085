//! Which vertex of a drawn face the pointer means.

use egui::Pos2;

use super::FaceDrawing;
use crate::face;
use crate::gui::height_map::picking;
use crate::gui::orbit_view::Projection;

/// How near the pointer must come to a vertex, points.
const REACH: f32 = 18.0;
/// Of so many nearest vertices the first one that nothing hides is meant.
const CANDIDATES: usize = 8;
/// A part must lie so much nearer to the eye to hide a vertex, mm.
const CLEARANCE_MM: f32 = 0.5;

/// The vertex that the pointer means: the nearest one that faces the eye and that nothing hides.
pub fn pick(drawing: &FaceDrawing, mesh: &face::Mesh, projection: &Projection, at: Pos2) -> Option<u32> {
    let seen = drawing.project(projection);
    let mut near: Vec<(f32, usize)> =
        seen.iter().enumerate().map(|(v, (q, _))| (q.distance(at), v)).filter(|(d, _)| *d <= REACH).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.retain(|(_, v)| drawing.faces_eye(projection, *v));
    let triangles = mesh.triangles();
    let hidden = |v: usize| {
        let (place, depth) = seen[v];
        triangles.iter().any(|t| {
            !t.contains(&(v as u32)) && {
                let corners = t.map(|i| seen[i as usize]);
                corners.iter().any(|c| c.1 > depth + CLEARANCE_MM)
                    && picking::depth_at(corners.map(|c| c.0), corners.map(|c| f64::from(c.1)), place)
                        .is_some_and(|there| there > f64::from(depth + CLEARANCE_MM))
            }
        })
    };
    near.into_iter().take(CANDIDATES).map(|(_, v)| v).find(|v| !hidden(*v)).map(|v| v as u32)
}
