//! The fewest muscles that explain a field: added one by one, while an information criterion and patches left out both say that it pays.

use nalgebra::{DVector, Point3};
use serde::Serialize;

use super::activations::{self, Activations};
use super::design::Design;
use super::law_fit::Noise;
use super::non_negative::{self, NormalEquations};
use super::patches;

/// Largest share of a muscle's squared force in one patch; a patch with more is cut in two.
const MOST_OF_A_MUSCLE: f64 = 0.5;

/// How the fewest muscles are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SelectionSettings {
    /// Radius of the patches that are left out, mm (default 15). Larger ones are a harder test; one that holds more than half of
    /// what a muscle does is cut in two.
    pub patch_radius_mm: f64,
    /// Most muscles (default: all).
    pub most: usize,
    /// Where the size of the errors comes from (default: the residual).
    pub noise: Noise,
}

impl Default for SelectionSettings {
    fn default() -> Self {
        Self { patch_radius_mm: 15.0, most: usize::MAX, noise: Noise::Estimated }
    }
}

/// One muscle added, as far as all could be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// The muscle added; none for the start without muscles.
    pub added: Option<usize>,
    /// Number of muscles.
    pub muscles: usize,
    /// Bayesian information criterion, n ln(RSS/n) + k ln n, over n observed components.
    pub bic: f64,
    /// The criterion that decides: BIC + 2 k ln p, among p muscles.
    pub extended_bic: f64,
    /// Error on patches left out over the force, weighted: √(Σ w|F − F̂|² / Σ w|F|²); 1 where nothing is explained.
    pub held_out: f64,
    /// Mean of how much less squared error (as a share of all) the patches have than one step before, and its standard error.
    pub gain: [f64; 2],
    /// Share of the squares explained on all samples.
    pub r_squared: f64,
}

/// Why no further muscle was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stopped {
    /// The criterion rose.
    Criterion,
    /// Patches left out were explained no better.
    HeldOut,
    /// No muscle is left that would lower the residual.
    NothingLeft,
    /// The most that was asked for.
    Most,
}

/// The fewest muscles that explain a field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    /// The muscles chosen, in ascending order.
    pub chosen: Vec<usize>,
    /// The way forward, also beyond where it was stopped, so that it can be drawn: the first row has no muscle.
    pub path: Vec<Step>,
    /// Number of steps of the path that were taken.
    pub taken: usize,
    /// Why it went no further.
    pub stopped: Stopped,
    /// Muscles taken on the way that the others made unnecessary, in the order in which they were given up.
    pub pruned: Vec<usize>,
    /// Number of patches that were left out in turn.
    pub patches: usize,
    /// Held-out error of the chosen set.
    pub held_out: f64,
    /// The chosen muscles' strengths with their intervals; all others are zero.
    pub activations: Activations,
}

/// Forward selection, then pruning.
///
/// Forward: the muscle that lowers the cost most joins. A step is taken while
/// * the extended BIC falls: n ln(RSS/n) + k ln n + 2 k ln p. The last term pays for having chosen among p muscles (Chen and Chen 2008
///   have 2 ln C(p, k), which is the same for few of many, but falls again beyond half of them). Plain BIC asks only
///   √ln n = 2.7 standard errors of a muscle, which the luckiest of 18 idle ones has in 5 of 100 fields; this asks 3.6;
/// * and the error on patches left out falls. Errors of the law are alike between neighbours; BIC takes them for independent and goes
///   on for ever, patches do not.
///
/// Backward: as long as a muscle can go and the extended BIC falls, or rises by nothing, the one that is missed least goes. And a
/// muscle whose place another takes with a lower cost is exchanged for it.
pub fn smallest_set(design: &Design, positions: &[Point3<f64>], settings: &SelectionSettings) -> Selection {
    let lists = patches_for(design, positions, settings.patch_radius_mm);
    let parts: Vec<NormalEquations> = lists.iter().map(|samples| design.normal_equations_of(samples)).collect();
    let mut all = NormalEquations::zeros(design.muscles());
    for part in &parts {
        all.add(part);
    }
    let field = Field { all, parts, observations: design.observations() as f64 };

    let p = design.muscles();
    let mut set = vec![false; p];
    let mut path = vec![field.step(None, &set, None)];
    let mut errors = field.held_out(&set);
    let mut order = Vec::new();
    let mut stop = None;
    while order.len() < p.min(settings.most) {
        let Some((j, _)) = field.best_addition(&set) else {
            stop = stop.or(Some((order.len(), Stopped::NothingLeft)));
            break;
        };
        set[j] = true;
        order.push(j);
        let step = field.step(Some(j), &set, Some(&errors));
        errors = field.held_out(&set);
        let before = path[path.len() - 1];
        if stop.is_none() {
            if step.extended_bic >= before.extended_bic {
                stop = Some((order.len() - 1, Stopped::Criterion));
            } else if step.held_out >= before.held_out {
                stop = Some((order.len() - 1, Stopped::HeldOut));
            }
        }
        path.push(step);
    }
    let (taken, stopped) =
        stop.unwrap_or((order.len(), if order.len() < p { Stopped::Most } else { Stopped::NothingLeft }));
    let mut set = vec![false; p];
    for &j in &order[..taken] {
        set[j] = true;
    }
    let pruned = field.prune(&mut set);
    field.exchange(&mut set);
    let chosen: Vec<usize> = (0..p).filter(|&j| set[j]).collect();
    Selection {
        held_out: field.held_out_error(&field.held_out(&set)),
        activations: activations::activations(design, Some(&set), settings.noise),
        chosen,
        path,
        taken,
        stopped,
        pruned,
        patches: lists.len(),
    }
}

/// Patches none of which holds more than half of what a muscle does: a muscle that is left out as a whole cannot show whether it is
/// needed.
fn patches_for(design: &Design, positions: &[Point3<f64>], radius_mm: f64) -> Vec<Vec<usize>> {
    let (of, count) = patches::patches(positions, radius_mm);
    let mut lists = patches::members(&of, count);
    let squares = |muscle: usize, samples: &mut dyn Iterator<Item = usize>| -> f64 {
        samples.map(|s| design.force(muscle, s).norm_squared()).sum()
    };
    for muscle in 0..design.muscles() {
        let all = squares(muscle, &mut (0..design.samples()));
        patches::split_where(&mut lists, positions, |members| {
            squares(muscle, &mut members.iter().copied()) > MOST_OF_A_MUSCLE * all
        });
    }
    lists
}

/// The observations as normal equations, whole and by patches.
struct Field {
    all: NormalEquations,
    parts: Vec<NormalEquations>,
    observations: f64,
}

impl Field {
    fn cost(&self, set: &[bool]) -> f64 {
        non_negative::solve(&self.all, Some(set)).cost
    }

    /// BIC and extended BIC. A cost below rounding error counts as that, or the logarithm of nothing would decide.
    fn criteria(&self, cost: f64, muscles: usize) -> [f64; 2] {
        let n = self.observations;
        let least = 1e-14 * self.all.square + f64::MIN_POSITIVE;
        let bic = n * (cost.max(least) / n).ln() + muscles as f64 * n.ln();
        [bic, bic + 2.0 * muscles as f64 * (self.all.len().max(1) as f64).ln()]
    }

    fn extended_bic(&self, set: &[bool]) -> f64 {
        self.criteria(self.cost(set), size(set))[1]
    }

    /// The muscle outside the set with which the cost falls most.
    fn best_addition(&self, set: &[bool]) -> Option<(usize, f64)> {
        let cost = self.cost(set);
        let mut trial = set.to_vec();
        let mut best: Option<(usize, f64)> = None;
        for j in (0..set.len()).filter(|&j| !set[j]) {
            trial[j] = true;
            let with = self.cost(&trial);
            trial[j] = false;
            if with < cost - 1e-13 * self.all.square && best.is_none_or(|(_, least)| with < least) {
                best = Some((j, with));
            }
        }
        best
    }

    /// The squared error on each patch, with strengths found without it.
    fn held_out(&self, set: &[bool]) -> Vec<f64> {
        let mut strengths = DVector::zeros(0);
        self.parts
            .iter()
            .map(|part| {
                strengths = non_negative::solve(&self.all.without(part), Some(set)).strengths;
                part.cost(&strengths)
            })
            .collect()
    }

    fn held_out_error(&self, errors: &[f64]) -> f64 {
        if self.all.square > 0.0 { (errors.iter().sum::<f64>() / self.all.square).sqrt() } else { 0.0 }
    }

    fn step(&self, added: Option<usize>, set: &[bool], before: Option<&[f64]>) -> Step {
        let cost = self.cost(set);
        let [bic, extended_bic] = self.criteria(cost, size(set));
        let errors = self.held_out(set);
        let n = errors.len() as f64;
        let gains: Vec<f64> =
            before.map_or_else(Vec::new, |before| before.iter().zip(&errors).map(|(b, e)| b - e).collect());
        let mean = gains.iter().sum::<f64>() / n;
        let spread = gains.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        let share = if self.all.square > 0.0 { n / self.all.square } else { 0.0 };
        Step {
            added,
            muscles: size(set),
            bic,
            extended_bic,
            held_out: self.held_out_error(&errors),
            gain: [mean * share, (spread / n).sqrt() * share],
            r_squared: if self.all.square > 0.0 { 1.0 - cost / self.all.square } else { 0.0 },
        }
    }

    /// Gives up muscles as long as the criterion does not rise. A muscle of strength zero is always one of them.
    fn prune(&self, set: &mut [bool]) -> Vec<usize> {
        let mut pruned = Vec::new();
        loop {
            let now = self.extended_bic(set);
            let mut best: Option<(usize, f64)> = None;
            for j in 0..set.len() {
                if set[j] {
                    set[j] = false;
                    let without = self.extended_bic(set);
                    set[j] = true;
                    if without <= now && best.is_none_or(|(_, least)| without < least) {
                        best = Some((j, without));
                    }
                }
            }
            let Some((j, _)) = best else { return pruned };
            set[j] = false;
            pruned.push(j);
        }
    }

    /// Exchanges one muscle for one outside where that lowers the cost, until none does.
    fn exchange(&self, set: &mut [bool]) {
        let mut now = self.cost(set);
        for _ in 0..set.len() {
            let mut best: Option<(usize, usize, f64)> = None;
            for i in (0..set.len()).filter(|&i| set[i]) {
                for j in (0..set.len()).filter(|&j| !set[j]) {
                    let mut trial = set.to_vec();
                    (trial[i], trial[j]) = (false, true);
                    let cost = self.cost(&trial);
                    if cost < now - 1e-9 * self.all.square && best.is_none_or(|(_, _, least)| cost < least) {
                        best = Some((i, j, cost));
                    }
                }
            }
            let Some((i, j, cost)) = best else { return };
            (set[i], set[j], now) = (false, true, cost);
        }
    }
}

fn size(set: &[bool]) -> usize {
    set.iter().filter(|s| **s).count()
}

#[cfg(test)]
#[path = "selection_tests.rs"]
mod tests;
