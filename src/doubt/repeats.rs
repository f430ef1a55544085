//! The hand's own error: a few points marked a second time without sight of the first.

use nalgebra::{Point2, Vector2};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::gap::mark_of;
use crate::project::{Project, Role};

/// What marking twice says of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandError {
    /// Points marked twice.
    pub points: usize,
    /// Standard deviation of one mark along each axis, px.
    pub sigma_px: f64,
    /// The 95 % interval of it, px.
    pub interval_px: [f64; 2],
    /// Mean of second less first mark, px: a habit that has changed.
    pub shift_px: [f64; 2],
}

/// So many points are proposed: the interval of σ is then 0.75 to 1.5 times the estimate.
pub const PROPOSED: usize = 8;
/// Fewer points give no estimate.
pub const FEWEST: usize = 3;

/// The hand's standard deviation from the points that were marked twice.
///
/// Both marks of a point err alike and independently, so that each axis of their difference d has variance 2 σ²:
///
/// σ² = Σ ‖d‖² / 4n,   with 2n degrees of freedom: σ √(2n / χ²₀.₉₇₅) … σ √(2n / χ²₀.₀₂₅)
///
/// (Dahlberg's error of method). Nothing for fewer than [`FEWEST`] points.
pub fn hand_error(project: &Project) -> Option<HandError> {
    let differences: Vec<Vector2<f64>> =
        project.repeats.iter().filter_map(|(&v, &again)| Some(Point2::from(again) - mark_of(project, v)?)).collect();
    if differences.len() < FEWEST {
        return None;
    }
    let n = differences.len() as f64;
    let sigma_px = (differences.iter().map(Vector2::norm_squared).sum::<f64>() / (4.0 * n)).sqrt();
    let free = 2.0 * n;
    let bound = |z: f64| sigma_px * (free / chi_square_quantile(free, z)).sqrt();
    let shift = differences.iter().sum::<Vector2<f64>>() / n;
    Some(HandError {
        points: differences.len(),
        sigma_px,
        interval_px: [bound(NORMAL_975), bound(-NORMAL_975)],
        shift_px: shift.into(),
    })
}

/// The normal deviate that 97.5 % do not exceed.
pub const NORMAL_975: f64 = 1.959_964;

/// The quantile of χ² with `free` degrees of freedom whose normal deviate is `z` (Wilson and Hilferty 1931: within 1 % from 6 on
/// for the middle 95 %).
fn chi_square_quantile(free: f64, z: f64) -> f64 {
    let a = 2.0 / (9.0 * free);
    free * (1.0 - a + z * a.sqrt()).powi(3)
}

/// Points to mark a second time: drawn from the marked ones, far from each other, in a random order. The seed makes it repeatable.
pub fn propose(project: &Project, count: usize, seed: u64) -> Vec<u32> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut open: Vec<(u32, Point2<f64>)> = project
        .features
        .iter()
        .filter(|(_, f)| f.role != Role::Fixed)
        .filter_map(|(&v, _)| Some((v, mark_of(project, v)?)))
        .collect();
    let mut taken: Vec<(u32, Point2<f64>)> = Vec::new();
    if !open.is_empty() {
        taken.push(open.swap_remove(rng.random_range(0..open.len())));
    }
    while taken.len() < count && !open.is_empty() {
        let apart = |p: &Point2<f64>| taken.iter().map(|(_, q)| (p - q).norm()).fold(f64::INFINITY, f64::min);
        let farthest = (0..open.len()).max_by(|&a, &b| apart(&open[a].1).total_cmp(&apart(&open[b].1)));
        taken.push(open.swap_remove(farthest.unwrap_or(0)));
    }
    let mut chosen: Vec<u32> = taken.into_iter().map(|(v, _)| v).collect();
    chosen.shuffle(&mut rng);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::Noise;
    use crate::project::{Feature, Mark, sample};

    fn marked(places: &[[f64; 2]]) -> Project {
        let feature = |&at: &[f64; 2]| Feature { last: Some(Mark::new(at)), ..Feature::default() };
        Project { features: (0..).zip(places.iter().map(feature)).collect(), ..Project::default() }
    }

    /// Differences (2, 0), (0, 2), (−2, 0), (0, −2): Σ‖d‖² = 16, n = 4, σ = √(16 / 16) = 1. With 8 degrees of freedom the tables give
    /// χ²₀.₉₇₅ = 17.535 and χ²₀.₀₂₅ = 2.180: 0.675 to 1.916.
    #[test]
    fn four_differences_by_hand() {
        let mut project = marked(&[[10.0, 10.0], [20.0, 10.0], [10.0, 30.0], [50.0, 50.0]]);
        project.repeats = [(0, [12.0, 10.0]), (1, [20.0, 12.0]), (2, [8.0, 30.0]), (3, [50.0, 48.0])].into();
        let hand = hand_error(&project).unwrap();
        assert_eq!((hand.points, hand.sigma_px, hand.shift_px), (4, 1.0, [0.0, 0.0]));
        assert!((hand.interval_px[0] - 0.675).abs() < 0.005 && (hand.interval_px[1] - 1.916).abs() < 0.03);
        project.repeats.remove(&0);
        project.repeats.remove(&1);
        assert!(hand_error(&project).is_none(), "two points say nothing");
    }

    /// Of a thousand annotators with σ = 0.4 px who mark eight points twice, 95 % find an interval that holds it.
    #[test]
    fn the_interval_holds_the_truth_as_often_as_it_says() {
        let mut noise = Noise(9);
        let (sigma, draws) = (0.4, 1000);
        let mut held = 0;
        for _ in 0..draws {
            let mut place = || [100.0 + sigma * noise.normal(), 200.0 + sigma * noise.normal()];
            let first: Vec<[f64; 2]> = (0..8).map(|_| place()).collect();
            let mut project = marked(&first);
            project.repeats = (0..8).map(|v| (v, place())).collect();
            let [low, high] = hand_error(&project).unwrap().interval_px;
            held += usize::from((low..=high).contains(&sigma));
        }
        // The share of a thousand draws scatters by 0.7 %.
        assert!((925..=975).contains(&held), "{held}");
    }

    #[test]
    fn proposed_points_are_marked_ones_far_apart_and_the_same_for_the_same_seed() {
        let project = sample::project().unwrap();
        let chosen = propose(&project, PROPOSED, 7);
        assert_eq!(chosen, propose(&project, PROPOSED, 7));
        assert_ne!(chosen, propose(&project, PROPOSED, 8));
        let places: Vec<Point2<f64>> = chosen.iter().map(|&v| mark_of(&project, v).unwrap()).collect();
        for (i, p) in places.iter().enumerate() {
            assert!(places[i + 1..].iter().all(|q| (p - q).norm() > 60.0), "{chosen:?}");
        }
        assert!(propose(&Project::default(), 8, 1).is_empty());
    }
}
