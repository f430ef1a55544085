//! Which point is worth marking next: the one whose pixel of error would change the force field most.

use nalgebra::Matrix3;

use crate::face::FaceModel;
use crate::forces::Skin;
use crate::pipeline::Outcome;
use crate::project::{MarkState, Project};

/// What a mark of one point is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// The vertex.
    pub vertex: u32,
    /// By how much the field changes for one pixel of error of this point, N (or relative): the root of the sum over all vertices of
    /// the squared change of force, in the mean over the directions of the pixel.
    pub newton_per_px: f64,
    /// Whether there is a mark already, in doubt.
    pub uncertain: bool,
}

/// The points of `chosen` that are not marked in the last frame, or marked in doubt, by what a mark of them is worth; most first.
///
/// A step e of the point i in the picture moves its vertex by S e and changes the forces by −B_ji S e at each neighbour j and
/// Σ B_ij S e at the vertex itself ([`ForceSlopes`](crate::forces::ForceSlopes)), so that in the mean over directions
///
/// ‖δF‖² = ½ (‖Σ B_ij S‖² + Σ ‖B_ji S‖²)
///
/// over the neighbours that are known or are to be marked as well. Points that the camera does not see are left out.
pub fn worth_marking(
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    skin: &Skin,
    chosen: &[u32],
) -> Vec<Worth> {
    let vertices = face.mesh().len();
    if outcome.last.len() != vertices || skin.springs().vertices() != vertices {
        return Vec::new();
    }
    let mut counts: Vec<bool> = outcome.states.iter().map(|s| s.is_known()).collect();
    for &v in chosen {
        if let Some(counts) = counts.get_mut(v as usize) {
            *counts = true;
        }
    }
    let slopes = skin.slopes(&outcome.last, &counts);
    let slope = outcome.camera.ray_slope();
    let worth = |vertex: u32| {
        let mut own = Matrix3::zeros();
        let mut others = 0.0;
        // The slope is that on the view plane; a vertex nearer to the camera follows less.
        let camera = &outcome.camera;
        let depth = camera.z_prp_mm - outcome.last[vertex as usize].z;
        let follows = slope * (depth / (camera.z_prp_mm - camera.z_vp_mm));
        for (_, block) in slopes.at(vertex as usize) {
            own += block;
            others += (block.transpose() * follows).norm_squared();
        }
        (f64::midpoint((own * follows).norm_squared(), others)).sqrt()
    };
    let mut list: Vec<Worth> = chosen
        .iter()
        .filter(|&&v| (v as usize) < vertices && outcome.camera.sees(&outcome.last[v as usize]))
        .filter_map(|&vertex| {
            let mark = project.features.get(&vertex).and_then(|f| f.last);
            let uncertain = match mark.map(|m| m.state) {
                None => false,
                Some(MarkState::Uncertain) => true,
                Some(_) => return None,
            };
            Some(Worth { vertex, newton_per_px: worth(vertex), uncertain })
        })
        .collect();
    list.sort_by(|a, b| b.newton_per_px.total_cmp(&a.newton_per_px).then(a.vertex.cmp(&b.vertex)));
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::{Workspace, solve};
    use crate::project::{Edit, PointId, Role, sample};

    /// A marked point is put in doubt, so that the list holds it; its worth is what the whole chain says for a small step of its mark
    /// in either direction.
    #[test]
    fn the_worth_of_a_point_is_the_change_of_the_field_by_central_differences() {
        let (mut project, face) = (sample::project().unwrap(), &*crate::face::generic());
        project.settings.depth = crate::displacement::DepthRule::FixedDepth;
        project.settings.remove_head_motion = false;
        project.settings.unmarked = crate::displacement::UnmarkedRule::Inferred { reach_mm: 0.1 };
        let inside = project.features.iter().find(|(v, f)| {
            let marked = |v: &u32| project.features.get(v).is_some_and(|f| f.last.is_some());
            f.role == Role::Skin && face.mesh().neighbours(**v as usize).iter().all(marked)
        });
        let vertex = *inside.unwrap().0;
        let id = PointId::FeatureLast(vertex);
        Edit::SetState(id.clone(), MarkState::Uncertain).apply(&mut project).unwrap();
        let size = [1036, 1036];
        let mut workspace = Workspace::default();
        let outcome = solve(&project, face, size, &mut workspace);
        let list = worth_marking(&project, face, &outcome, workspace.skin().unwrap(), &[vertex]);
        assert!(list.len() == 1 && list[0].uncertain);
        let at = project.features[&vertex].last.unwrap().at_px;
        let h = 1e-3;
        let mut squares = 0.0;
        for axis in 0..2 {
            let mut forces = [h, -h].map(|step| {
                let mut moved = at;
                moved[axis] += step;
                Edit::Put(id.clone(), moved).apply(&mut project).unwrap();
                solve(&project, face, size, &mut workspace).field.force
            });
            let [up, down] = &mut forces;
            squares += up.iter().zip(down).map(|(u, d)| ((u - *d) / (2.0 * h)).norm_squared()).sum::<f64>();
        }
        let differences = (squares / 2.0).sqrt();
        let worth = list[0].newton_per_px;
        assert!((worth - differences).abs() < 1e-3 * differences, "{worth} {differences}");
    }

    #[test]
    fn what_is_marked_is_left_out_and_the_stiffest_comes_first() {
        let (mut project, face) = (sample::project().unwrap(), &*crate::face::generic());
        let marked: Vec<u32> = project.features.iter().filter(|(_, f)| f.last.is_some()).map(|(v, _)| *v).collect();
        let open = &marked[..20];
        for v in open {
            project.features.remove(v);
        }
        let mut workspace = Workspace::default();
        let outcome = solve(&project, face, [1036, 1036], &mut workspace);
        let list = worth_marking(&project, face, &outcome, workspace.skin().unwrap(), &marked);
        assert_eq!(list.len(), 20);
        assert!(list.windows(2).all(|w| w[0].newton_per_px >= w[1].newton_per_px) && list[0].newton_per_px > 0.0);
        assert!(list.iter().all(|w| open.contains(&w.vertex) && !w.uncertain));
    }
}
