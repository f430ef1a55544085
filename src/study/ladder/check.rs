//! Whether the choice is right: on fresh twins, does it keep what was stated, and is it much dearer than the cheapest that would have?

use super::bound::SHARE;
use super::choice::{Goal, choose};
use super::standing::Standing;

/// Accuracies that are stated in turn, from loose to tight.
const ACCURACIES: [f64; 11] = [5.0, 3.0, 2.0, 1.75, 1.5, 1.25, 1.0, 0.75, 0.5, 0.35, 0.25];
/// Times that are stated in turn, ms.
const TIMES_MS: [f64; 3] = [1.0, 4.0, 16.0];

/// One goal at one marking error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// What was stated.
    pub goal: Goal,
    /// The marking error over the one that the project states.
    pub times_stated: f64,
    /// The rung that was chosen from the measured twins; none where none was promised to meet it.
    pub picked: Option<usize>,
    /// Share of the fresh twins on which it kept the accuracy: the stated one, or of a time the limit that it was chosen by.
    pub met: Option<f64>,
    /// The cheapest rung that keeps the stated accuracy on 95 % of the fresh twins.
    pub cheapest: Option<usize>,
    /// Time of the chosen rung over that of the cheapest.
    pub cost: Option<f64>,
    /// Fresh twins.
    pub twins: usize,
}

/// All goals at every marking error at which fresh twins were measured.
pub fn checks(rungs: &[Standing]) -> Vec<Checked> {
    let mut noises: Vec<f64> =
        rungs.iter().flat_map(|r| &r.noises).filter(|n| !n.fresh.is_empty()).map(|n| n.times_stated).collect();
    noises.sort_unstable_by(|a, b| b.total_cmp(a));
    noises.dedup();
    let goals = || ACCURACIES.map(Goal::Accuracy).into_iter().chain(TIMES_MS.map(Goal::Time));
    noises.iter().flat_map(|&n| goals().map(move |goal| check(goal, rungs, n))).collect()
}

fn check(goal: Goal, rungs: &[Standing], times_stated: f64) -> Checked {
    let picked = choose(goal, rungs, times_stated).picked;
    let met = |k: usize, within: f64| {
        let fresh = &rungs[k].at(times_stated)?.fresh;
        let kept = fresh.iter().filter(|e| **e <= within).count();
        (!fresh.is_empty()).then(|| kept as f64 / fresh.len() as f64)
    };
    let time = |k: usize| rungs[k].time_ms.filter(|t| *t > 0.0);
    let cheapest = match goal {
        Goal::Time(_) => None,
        Goal::Accuracy(share) => {
            let would = (0..rungs.len()).filter(|&k| time(k).is_some() && met(k, share).is_some_and(|m| m >= SHARE));
            would.min_by(|a, b| time(*a).unwrap_or(f64::MAX).total_cmp(&time(*b).unwrap_or(f64::MAX)))
        }
    };
    let within = |k: usize| match goal {
        Goal::Accuracy(share) => share,
        Goal::Time(_) => rungs[k].limit(times_stated),
    };
    Checked {
        goal,
        times_stated,
        picked,
        met: picked.and_then(|k| met(k, within(k))),
        cheapest,
        cost: picked.zip(cheapest).and_then(|(p, c)| Some(time(p)? / time(c)?)),
        twins: rungs.iter().filter_map(|r| r.at(times_stated)).map(|n| n.fresh.len()).max().unwrap_or(0),
    }
}
