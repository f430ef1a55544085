//! Two projects on the same frames, point by point: bias, limits of agreement, the worst points.

use nalgebra::{Point2, Vector2};
use serde::Serialize;

use super::repeats::NORMAL_975;
use crate::project::edit::mark;
use crate::project::{Mark, MarkState, PointId, Project, Which};

/// One point that both have marked.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The point.
    pub id: PointId,
    /// Its mark in A and in B.
    pub marks: [Mark; 2],
    /// B less A, px.
    pub by_px: [f64; 2],
}

impl Difference {
    /// How far apart the two marks are, px.
    pub fn distance_px(&self) -> f64 {
        self.by_px[0].hypot(self.by_px[1])
    }

    /// The frame that the point is marked in.
    pub fn frame(&self) -> Which {
        if matches!(self.id, PointId::FeatureLast(_)) { Which::Last } else { Which::First }
    }
}

/// How well two projects agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// The points that count in both, the farthest apart first.
    pub differences: Vec<Difference>,
    /// Marked in A alone.
    pub only_a: Vec<PointId>,
    /// Marked in B alone.
    pub only_b: Vec<PointId>,
    /// All of them together; absent for fewer than two.
    pub summary: Option<Summary>,
}

/// Differences B − A in numbers (Bland and Altman 1986), px.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Points compared.
    pub points: usize,
    /// Mean difference along x and y.
    pub bias_px: [f64; 2],
    /// Standard deviation of the differences along x and y (n − 1).
    pub sd_px: [f64; 2],
    /// Bias ± 1.96 standard deviations: 95 % of differences lie between.
    pub limits_x_px: [f64; 2],
    /// The same along y.
    pub limits_y_px: [f64; 2],
    /// Root mean square distance.
    pub rms_px: f64,
    /// Median distance.
    pub median_px: f64,
    /// What one mark errs by along each axis, if both hands err alike: the standard deviations' mean square over two, rooted.
    pub sigma_each_px: f64,
}

/// Why two projects cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotComparable {
    /// The pictures are not the same.
    #[error("the {} frames are not the same picture: only marks on the same frames can be compared", .0.word())]
    OtherFrame(Which),
}

/// Compares the marks of two projects on the same frames. Occluded marks are notes, not data, and are left out.
///
/// # Errors
/// Both name a frame and its hashes differ.
pub fn compare(a: &Project, b: &Project) -> Result<Agreement, NotComparable> {
    let pairs = [(Which::First, &a.frames.first, &b.frames.first), (Which::Last, &a.frames.last, &b.frames.last)];
    for (which, a, b) in pairs {
        if let (Some(a), Some(b)) = (a, b)
            && !a.sha256.eq_ignore_ascii_case(&b.sha256)
        {
            return Err(NotComparable::OtherFrame(which));
        }
    }
    let (mut differences, mut only_a) = (Vec::new(), Vec::new());
    let counts =
        |project: &Project, id: &PointId| mark(project, id).copied().filter(|m| m.state != MarkState::Occluded);
    for id in points(a) {
        match (counts(a, &id), counts(b, &id)) {
            (Some(in_a), Some(in_b)) => {
                let by = Point2::from(in_b.at_px) - Point2::from(in_a.at_px);
                differences.push(Difference { id, marks: [in_a, in_b], by_px: by.into() });
            }
            (Some(_), None) => only_a.push(id),
            (None, _) => {}
        }
    }
    let only_b = points(b).into_iter().filter(|id| counts(b, id).is_some() && counts(a, id).is_none()).collect();
    differences.sort_by(|p, q| q.distance_px().total_cmp(&p.distance_px()));
    let summary = summary(&differences);
    Ok(Agreement { differences, only_a, only_b, summary })
}

/// Every point with a mark, landmarks first.
fn points(project: &Project) -> Vec<PointId> {
    let landmarks = project.landmarks.keys().cloned().map(PointId::Landmark);
    let first = project.features.iter().filter(|(_, f)| f.first.is_some()).map(|(&v, _)| PointId::FeatureFirst(v));
    let last = project.features.iter().filter(|(_, f)| f.last.is_some()).map(|(&v, _)| PointId::FeatureLast(v));
    landmarks.chain(first).chain(last).collect()
}

fn summary(differences: &[Difference]) -> Option<Summary> {
    let n = differences.len();
    if n < 2 {
        return None;
    }
    let by = || differences.iter().map(|d| Vector2::from(d.by_px));
    let bias = by().sum::<Vector2<f64>>() / n as f64;
    let squares = by().map(|d| (d - bias).component_mul(&(d - bias))).sum::<Vector2<f64>>();
    let sd = (squares / (n - 1) as f64).map(f64::sqrt);
    let limits = |k: usize| [bias[k] - NORMAL_975 * sd[k], bias[k] + NORMAL_975 * sd[k]];
    // Sorted by distance, so that the middle one is the median, or the two middle ones about it.
    let middle = [(n - 1) / 2, n / 2].map(|k| differences[k].distance_px());
    Some(Summary {
        points: n,
        bias_px: bias.into(),
        sd_px: sd.into(),
        limits_x_px: limits(0),
        limits_y_px: limits(1),
        rms_px: (by().map(|d| d.norm_squared()).sum::<f64>() / n as f64).sqrt(),
        median_px: f64::midpoint(middle[0], middle[1]),
        sigma_each_px: (sd.norm_squared() / 4.0).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::{Edit, FrameRef};

    /// Differences (1, 0), (3, 0), (2, 3): bias (2, 1); sd x: √((1 + 1 + 0) / 2) = 1, y: √((1 + 1 + 4) / 2) = √3; limits
    /// 2 ± 1.96 and 1 ± 3.395; distances 1, 3, √13: rms √(23 / 3), median 3; σ each √((1 + 3) / 4) = 1.
    #[test]
    fn three_differences_by_hand() {
        let (mut a, mut b) = (Project::default(), Project::default());
        let moved = [(4, [1.0, 0.0]), (7, [3.0, 0.0]), (9, [2.0, 3.0])];
        for (v, d) in moved {
            Edit::Put(PointId::FeatureLast(v), [100.0, 50.0]).apply(&mut a).unwrap();
            Edit::Put(PointId::FeatureLast(v), [100.0 + d[0], 50.0 + d[1]]).apply(&mut b).unwrap();
        }
        Edit::Put(PointId::Landmark("chin".into()), [1.0, 1.0]).apply(&mut a).unwrap();
        Edit::Put(PointId::FeatureLast(12), [1.0, 1.0]).apply(&mut b).unwrap();
        // A note in A: no difference, and not the mark of B alone either until it is data.
        Edit::Put(PointId::FeatureLast(20), [5.0, 5.0]).apply(&mut a).unwrap();
        Edit::SetState(PointId::FeatureLast(20), MarkState::Occluded).apply(&mut a).unwrap();
        let agreement = compare(&a, &b).unwrap();
        let s = agreement.summary.unwrap();
        assert_eq!((s.points, s.bias_px, s.sd_px[0]), (3, [2.0, 1.0], 1.0));
        assert!((s.sd_px[1] - 3.0_f64.sqrt()).abs() < 1e-12 && (s.sigma_each_px - 1.0).abs() < 1e-12);
        assert!((s.limits_x_px[0] - 0.04).abs() < 1e-3 && (s.limits_y_px[1] - 4.3948).abs() < 1e-3);
        assert!((s.rms_px - (23.0_f64 / 3.0).sqrt()).abs() < 1e-12 && s.median_px == 3.0);
        let order: Vec<_> = agreement.differences.iter().map(|d| d.id.clone()).collect();
        assert_eq!(order, [9, 7, 4].map(PointId::FeatureLast));
        assert_eq!(agreement.only_a, [PointId::Landmark("chin".into())]);
        assert_eq!(agreement.only_b, [PointId::FeatureLast(12)]);
    }

    #[test]
    fn other_pictures_are_refused_by_name() {
        let frame =
            |hash: &str| Some(FrameRef { path: "a.png".into(), sha256: hash.into(), width_px: 9, height_px: 9 });
        let (mut a, mut b) = (Project::default(), Project::default());
        a.frames.last = frame("ab");
        b.frames.last = frame("AB");
        assert!(compare(&a, &b).is_ok(), "hexadecimal digits of either case");
        b.frames.last = frame("ac");
        let why = compare(&a, &b).unwrap_err();
        assert!(why.to_string().contains("last frames"), "{why}");
    }
}
