//! How far a mark lies from where its neighbours say it should be, in px and, through the skin, in newton.

use std::collections::BTreeMap;

use nalgebra::Point2;

use crate::face::FaceModel;
use crate::forces::Skin;
use crate::marking::consistency::{Consistency, Expected, Placed};
use crate::pipeline::Outcome;
use crate::project::{Mark, Project};

/// A mark against its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The vertex.
    pub vertex: u32,
    /// Where its neighbours say it went.
    pub expected: Expected,
    /// Distance of the mark from there, px.
    pub px: f64,
    /// How much the force on the vertex changes between the two places, N (or relative).
    pub newton: f64,
}

impl Gap {
    /// Whether the mark lies beyond what its own error, its neighbours', and the bending of the skin about it explain: 3.3 standard errors,
    /// which one good mark in two hundred exceeds (Rayleigh).
    pub fn stands_out(&self) -> bool {
        self.px > STANDS_OUT * self.expected.sigma_px
    }
}

/// exp(−3.26² / 2) = 0.005.
pub const STANDS_OUT: f64 = 3.26;

/// The marks of the last frame that count.
pub(super) fn mark_of(project: &Project, vertex: u32) -> Option<Point2<f64>> {
    let mark = project.features.get(&vertex)?.last.filter(|m| m.state.is_data())?;
    Some(mark.at_px.into())
}

/// The gap of one marked point of the last frame; nothing where it is not marked or too few neighbours are.
pub fn gap(project: &Project, face: &FaceModel, outcome: &Outcome, skin: &Skin, vertex: u32) -> Option<Gap> {
    let marks = marks_with(project, vertex);
    let px_per_mm = outcome.camera.px_per_mm;
    let expected = Consistency::of(face.mesh(), &outcome.first_in_image, &marks, px_per_mm).expected(vertex)?;
    from_expected(project, outcome, skin, vertex, expected)
}

/// The marks that count, and that of a vertex whatever its state: a mark in doubt is weighed, too, but weighs nothing for others.
fn marks_with(project: &Project, vertex: u32) -> BTreeMap<u32, Placed> {
    let counts = |v: &u32, mark: &Mark| mark.state.is_data() || *v == vertex;
    let placed = |mark: &Mark| Placed { at: mark.at_px.into(), sigma_px: project.sigma_px(mark) };
    let marks = project.features.iter().filter_map(|(v, f)| Some((*v, f.last?)));
    marks.filter(|(v, m)| counts(v, m)).map(|(v, m)| (v, placed(&m))).collect()
}

fn from_expected(project: &Project, outcome: &Outcome, skin: &Skin, vertex: u32, expected: Expected) -> Option<Gap> {
    let at = Point2::from(project.features.get(&vertex)?.last?.at_px);
    let here = *outcome.last.get(vertex as usize)?;
    // The skin about the point is moved within the picture's plane, by as much as the picture says at its depth.
    let camera = &outcome.camera;
    let at_depth = |p: &Point2<f64>| camera.face_from_image(p, here.z);
    let there = here + (at_depth(&expected.at) - at_depth(&at));
    let known: Vec<bool> =
        outcome.states.iter().enumerate().map(|(v, s)| s.is_known() || v == vertex as usize).collect();
    let mut moved = outcome.last.clone();
    moved[vertex as usize] = there;
    let change = skin.muscle_force_on(vertex, &outcome.last, &known) - skin.muscle_force_on(vertex, &moved, &known);
    Some(Gap { vertex, expected, px: (at - expected.at).norm(), newton: change.norm() })
}

/// Every mark of the last frame against its neighbours, worst first: by the distance in standard errors.
pub fn gaps(project: &Project, face: &FaceModel, outcome: &Outcome, skin: &Skin) -> Vec<Gap> {
    let px_per_mm = outcome.camera.px_per_mm;
    let data: BTreeMap<u32, Placed> = marks_with(project, u32::MAX);
    let all = Consistency::of(face.mesh(), &outcome.first_in_image, &data, px_per_mm).all();
    let in_doubt = project.features.iter().filter(|(v, f)| f.last.is_some() && !data.contains_key(v));
    let mut gaps: Vec<Gap> = all
        .into_iter()
        .filter_map(|(v, expected)| from_expected(project, outcome, skin, v, expected))
        .chain(in_doubt.filter_map(|(&v, _)| gap(project, face, outcome, skin, v)))
        .collect();
    let in_errors = |g: &Gap| g.px / g.expected.sigma_px.max(1e-9);
    gaps.sort_by(|a, b| in_errors(b).total_cmp(&in_errors(a)));
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::{Workspace, solve};
    use crate::project::{Edit, PointId, sample};

    /// One mark of the sample is moved by 6 px. It heads the list, its gap is about those 6 px, and the newton are what the whole chain
    /// finds on that vertex when the mark is put where the neighbours want it.
    #[test]
    fn a_mark_that_slipped_heads_the_list_with_the_force_that_it_costs() {
        let (mut project, face) = (sample::project().unwrap(), &*crate::face::generic());
        // Depths stay, so that the chain moves the vertex in the plane of the picture as the gap does.
        project.settings.depth = crate::displacement::DepthRule::FixedDepth;
        let vertex = *project
            .features
            .iter()
            .find(|(v, f)| {
                let marked = |v: &u32| mark_of(&project, *v).is_some();
                f.role == crate::project::Role::Skin && face.mesh().neighbours(**v as usize).iter().all(marked)
            })
            .unwrap()
            .0;
        let at = project.features[&vertex].last.unwrap().at_px;
        Edit::Put(PointId::FeatureLast(vertex), [at[0] + 4.8, at[1] - 3.6]).apply(&mut project).unwrap();
        let size = [1036, 1036];
        let mut workspace = Workspace::default();
        let outcome = solve(&project, face, size, &mut workspace);
        let list = gaps(&project, face, &outcome, workspace.skin().unwrap());
        assert_eq!(list[0].vertex, vertex);
        assert!((list[0].px - 6.0).abs() < 1.5 && list[0].stands_out(), "{:?}", list[0]);
        let mended = list[0].expected.at;
        Edit::Put(PointId::FeatureLast(vertex), [mended.x, mended.y]).apply(&mut project).unwrap();
        let after = solve(&project, face, size, &mut workspace);
        let change = (outcome.field.force[vertex as usize] - after.field.force[vertex as usize]).norm();
        // The head's motion is removed with a turn of a degree or so.
        assert!((change - list[0].newton).abs() < 0.05 * change, "{change} {}", list[0].newton);
    }
}
