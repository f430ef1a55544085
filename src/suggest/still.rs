//! Which of the points that may be still really are: those that were found surely and move as one rigid head.

use crate::camera::head_motion::{self, StillPoint};
use crate::pipeline::Outcome;
use crate::project::{Project, Role};

use super::Suggestion;

/// Suggestions for still points that agree with each other and with those that a hand has marked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StillProposal {
    /// Those that move as one head.
    pub points: Vec<Suggestion>,
    /// How many were left out: found vaguely, or moved otherwise.
    pub left_out: usize,
    /// Root mean square along one axis of what the head's motion leaves of those kept and those marked, over the degrees of freedom
    /// left, px. Absent with 3 points or fewer.
    pub residual_px: Option<f64>,
}

/// A point this many times as far off as the middle one moved otherwise than the head.
const ODD_TIMES: f64 = 3.0;
/// Nobody tells a smaller distance from the error of finding points, px.
const ODD_PX: f64 = 0.5;

/// Of the suggestions for points that may be still (`candidates`), those at least so sure (`least`, 0 to 1) that move as one head.
///
/// The likeliest rigid motion of all of them, together with the still points that are marked already, is fitted; the point farthest from
/// where it leads is left out while it lies more than 0.5 px and three times the median distance away, and the motion is fitted anew. Marks
/// are never left out: a hand has made them.
pub fn propose(project: &Project, outcome: &Outcome, candidates: &[Suggestion], least: f64) -> StillProposal {
    let place = |vertex: u32| outcome.first.get(vertex as usize).copied();
    let marked: Vec<StillPoint> = project
        .features
        .iter()
        .filter(|(_, f)| f.role == Role::Still)
        .filter_map(|(&v, f)| {
            let mark = f.last.filter(|m| m.state.is_data())?;
            let (first, sigma_px) = (place(v)?, project.sigma_px(&mark));
            Some(StillPoint { first, last_in_image: mark.at_px.into(), sigma_px })
        })
        .collect();
    let mut kept: Vec<Suggestion> =
        candidates.iter().filter(|s| s.confidence >= least && place(s.vertex).is_some()).copied().collect();
    loop {
        let proposed = kept.iter().filter_map(|s| {
            let (first, sigma_px) = (place(s.vertex)?, project.settings.marking_sigma_px);
            Some(StillPoint { first, last_in_image: s.at, sigma_px })
        });
        let all: Vec<StillPoint> = marked.iter().copied().chain(proposed).collect();
        let head = head_motion::most_likely(&outcome.camera, &all);
        let mut sorted = head.residuals_px.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = ODD_PX.max(ODD_TIMES * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0));
        let own = head.residuals_px.iter().skip(marked.len()).copied().enumerate();
        match own.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((i, off)) if off > limit => _ = kept.remove(i),
            _ => {
                let left_out = candidates.len() - kept.len();
                return StillProposal { points: kept, left_out, residual_px: head.noise_floor_px };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::{self, Workspace};
    use crate::project::sample;
    use crate::suggest::Source;
    use nalgebra::Vector2;

    /// The sample's still points are where its head went. Two of them are moved away by 4 px, as skin that is not still moves, and one
    /// is vague: these three alone are left out, and what is left scatters as the truth does.
    #[test]
    fn those_that_move_otherwise_or_are_vague_are_left_out() {
        let face = crate::face::generic();
        let whole = sample::project().unwrap();
        let mut project = whole.clone();
        project.features.clear();
        let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        let still = whole.features.iter().filter(|(_, f)| f.role == Role::Still);
        let mut candidates: Vec<Suggestion> = still
            .map(|(&vertex, f)| {
                let at = f.last.unwrap().at_px.into();
                Suggestion { vertex, at, confidence: 0.95, method: Source::Tracked, crossing: None }
            })
            .collect();
        let clean = propose(&project, &outcome, &candidates, 0.9);
        assert_eq!((clean.points.len(), clean.left_out), (candidates.len(), 0));
        let floor = clean.residual_px.unwrap();
        assert!(floor < 0.4, "{floor}");

        candidates[1].at += Vector2::new(0.0, -4.0);
        candidates[4].at += Vector2::new(3.0, 3.0);
        candidates[6].confidence = 0.3;
        let odd = [1, 4, 6].map(|i: usize| candidates[i].vertex);
        let found = propose(&project, &outcome, &candidates, 0.9);
        assert_eq!(found.left_out, 3);
        assert!(found.points.iter().all(|s| !odd.contains(&s.vertex)));
        assert!((found.residual_px.unwrap() - floor).abs() < 0.1);

        // A mark stays whatever the others do.
        project.features = whole.features.iter().filter(|(v, _)| **v == odd[0]).map(|(v, f)| (*v, *f)).collect();
        assert_eq!(propose(&project, &outcome, &candidates[5..6], 0.9).points.len(), 1);
        assert_eq!(
            propose(&project, &outcome, &[], 0.9),
            StillProposal { residual_px: None, ..StillProposal::default() }
        );
    }
}
