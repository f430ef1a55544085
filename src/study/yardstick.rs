//! How a field of forces is held against the truth of a scene, and how long the chain takes after a dragged mark.

use std::time::Instant;

use nalgebra::{Point3, Vector3};

use super::points::median;
use crate::face::Mesh;
use crate::forces::{SpringRule, Springs, strains};
use crate::project::{Project, Role};

/// Where skin is stretched by more, lids and lips, it unfolds in truth, and the table is so steep that a hair of depth makes a newton: as on an artist's
/// fields, such vertices are not compared.
const MOST_STRAIN: f64 = 0.3;
/// A mark is dragged so far, px.
const DRAG_PX: f64 = 0.1;

/// Whether no spring at a vertex is stretched by more than 30 % when the vertices of `mesh` go to `last` (mm).
pub(super) fn gentle(mesh: &Mesh, last: &[Point3<f64>], thickness_mm: f64) -> Vec<bool> {
    let springs = Springs::new(mesh, mesh.positions(), SpringRule::default(), thickness_mm);
    let strains = strains(&springs, last);
    let calm = |v: usize| springs.springs_of_vertex(v).iter().all(|&e| strains[e as usize] <= MOST_STRAIN);
    (0..mesh.len()).map(calm).collect()
}

/// ‖F − G‖ / ‖G‖ over some vertices; no number where nothing is to be found.
pub(super) fn relative_error(force: &[Vector3<f64>], truth: &[Vector3<f64>], vertices: &[usize]) -> f64 {
    let off: f64 = vertices.iter().map(|&v| (force[v] - truth[v]).norm_squared()).sum();
    (off / squares(truth, vertices)).sqrt()
}

/// Share of some vertices whose true force lies within the 95 % region of the stated error: a force in the skin has two components, each takes half of
/// the variance, and 95 % of such vectors lie within χ² = 5.99.
pub(super) fn covered(force: &[Vector3<f64>], truth: &[Vector3<f64>], sigma: &[f64], vertices: &[usize]) -> f64 {
    let within = |v: &&usize| (force[**v] - truth[**v]).norm_squared() < 5.99 / 2.0 * sigma[**v].powi(2);
    vertices.iter().filter(within).count() as f64 / vertices.len() as f64
}

/// Σ ‖F‖² over some vertices.
pub(super) fn squares(force: &[Vector3<f64>], vertices: &[usize]) -> f64 {
    vertices.iter().map(|&v| force[v].norm_squared()).sum()
}

/// Times of `answer` after `drags` marks of the skin were dragged one after the other, ms.
pub(super) fn drag_times(project: &Project, drags: usize, mut answer: impl FnMut(&Project)) -> Vec<f64> {
    let mut dragged = project.clone();
    let skin: Vec<u32> = dragged.features.iter().filter(|(_, f)| f.role == Role::Skin).map(|(v, _)| *v).collect();
    let mut times = Vec::with_capacity(drags);
    for k in 0..drags {
        let Some(v) = skin.get(k * skin.len() / drags) else { continue };
        if let Some(mark) = dragged.features.get_mut(v).and_then(|f| f.last.as_mut()) {
            mark.at_px[0] += DRAG_PX;
        }
        let begun = Instant::now();
        answer(&dragged);
        times.push(begun.elapsed().as_secs_f64() * 1e3);
    }
    times
}

/// The median of [`drag_times`]; no number without marks.
pub(super) fn after_a_drag_ms(project: &Project, drags: usize, answer: impl FnMut(&Project)) -> f64 {
    median(&mut drag_times(project, drags, answer)).unwrap_or(f64::NAN)
}
