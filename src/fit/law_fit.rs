//! Fits one law to a field of forces: shape parameters shared by all fibres, a strength for each.

use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};

use super::estimate::{self, LawFit};
use super::field::{Field, FieldError};
use super::law_model::Model;
use super::levenberg_marquardt::{self, LeastSquares, LevenbergMarquardtSettings, Room, Stop};
use super::nelder_mead::{self, NelderMeadSettings, SimplexStop};
use super::{Compare, Sample, Strengths};
use crate::forces::Cause;
use crate::muscle::{Fibre, MuscleLaw};

/// Where the variance of the data is taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Noise {
    /// From the residual: intervals are right where the law is, whatever unit the samples' errors are in. Student's t.
    #[default]
    Estimated,
    /// From the samples' standard errors as they stand; from the residual where they are not known.
    Given,
}

/// How the least residual is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum Method {
    /// Levenberg and Marquardt, on logarithms of the parameters.
    LevenbergMarquardt {
        /// Its settings.
        settings: LevenbergMarquardtSettings,
        /// Whether the strengths are eliminated. Lengths of forces are not linear in them, so there they never are.
        eliminate: bool,
    },
    /// Nelder and Mead as `fminsearch`, on the parameters themselves, forces divided by the largest.
    NelderMead {
        /// Its settings.
        settings: NelderMeadSettings,
        /// Whether the strengths are eliminated; the thesis searches for them too.
        eliminate: bool,
    },
}

impl Default for Method {
    fn default() -> Self {
        Self::LevenbergMarquardt { settings: LevenbergMarquardtSettings::default(), eliminate: true }
    }
}

impl Method {
    /// As the thesis: `fminsearch` at its own settings over shape and strengths.
    pub fn thesis() -> Self {
        Self::NelderMead { settings: NelderMeadSettings::default(), eliminate: false }
    }
}

/// Settings of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LawFitOptions {
    /// What of the forces is compared.
    pub compare: Compare,
    /// A strength for each fibre, or one for all.
    pub strengths: Strengths,
    /// Where the variance is taken from.
    pub noise: Noise,
    /// How the least residual is looked for.
    pub method: Method,
    /// Names of shape parameters that keep their value.
    pub held: Vec<String>,
    /// Whether the law's other readings are fitted too and the best is taken: both directions of Waters' linear muscle, both readings of
    /// (5.3).
    pub variants: bool,
    /// Starts at most: the given one, and points within a factor 3 of the law's default and of the given one in turn (default 8).
    /// Starting ends when two have ended in the same place (three with a
    /// second lobe); if no two have, there is no fit. With a single start nothing is compared.
    pub starts: usize,
    /// Seed of the further starts.
    pub seed: u64,
}

impl Default for LawFitOptions {
    fn default() -> Self {
        Self {
            compare: Compare::default(),
            strengths: Strengths::default(),
            noise: Noise::default(),
            method: Method::default(),
            held: Vec::new(),
            variants: true,
            starts: 8,
            seed: 1,
        }
    }
}

impl LawFitOptions {
    /// The same with every shape parameter of a law held: only strengths are fitted.
    #[must_use]
    pub fn with_shape_held(mut self, law: &MuscleLaw) -> Self {
        self.held = law.parameters().iter().map(|p| p.name.to_owned()).collect();
        self
    }
}

/// Why one start ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Ended {
    /// Of Levenberg and Marquardt's method.
    Descent(Stop),
    /// Of Nelder and Mead's.
    Simplex(SimplexStop),
}

impl Ended {
    /// Whether the method says that it stands at a minimum.
    pub fn converged(self) -> bool {
        match self {
            Self::Descent(stop) => stop.converged(),
            Self::Simplex(stop) => stop == SimplexStop::Tolerance,
        }
    }
}

/// How one start went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Start {
    /// Weighted residual where it ended, over that of no muscle at all: 1 − R².
    pub unexplained: f64,
    /// Why it ended.
    pub ended: Ended,
    /// Evaluations of the residual.
    pub evaluations: usize,
}

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoFit {
    /// The field itself.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// Fewer numbers than unknowns.
    #[error("{rows} numbers cannot tell {unknowns} unknowns")]
    TooFew {
        /// Numbers compared.
        rows: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// No sample lies where the law pulls.
    #[error("no sample lies where the law pulls")]
    OutOfReach,
    /// No two starts ended in the same place: the least residual found may be far from the least there is.
    #[error("no two of {} starts ended in the same place", starts.len())]
    Disagreement {
        /// How each ended.
        starts: Vec<Start>,
    },
    /// No start ended in a minimum.
    #[error("none of {} starts ended in a minimum", starts.len())]
    NoMinimum {
        /// How each ended.
        starts: Vec<Start>,
    },
}

/// A fit that failed: no law, no strengths, only why.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize)]
#[error("{label}: {why}")]
pub struct FailedFit {
    /// The law that was to be fitted.
    pub label: String,
    /// Why there is no fit.
    pub why: NoFit,
    /// Evaluations of the residual.
    pub evaluations: usize,
    /// Time taken, ms.
    pub time_ms: f64,
}

/// Fits a law to samples beside fibres. Their errors are taken for independent.
pub fn fit_law(
    start: &MuscleLaw,
    fibres: &[Fibre],
    samples: &[Sample],
    options: &LawFitOptions,
) -> Result<LawFit, FailedFit> {
    fit_law_with(start, fibres, samples, &[], options)
}

/// The same with the causes of the samples' errors ([`Field::with_causes`]).
pub fn fit_law_with(
    start: &MuscleLaw,
    fibres: &[Fibre],
    samples: &[Sample],
    causes: &[Cause],
    options: &LawFitOptions,
) -> Result<LawFit, FailedFit> {
    let began = Instant::now();
    match Field::new(fibres, samples, options.compare) {
        Ok(field) => {
            fit_law_to(start, &field.with_causes(causes), options).map(|fit| LawFit { time_ms: ms(began), ..fit })
        }
        Err(error) => Err(FailedFit { label: start.label(), why: error.into(), evaluations: 0, time_ms: ms(began) }),
    }
}

/// The same on a field that has been prepared, whose own way to compare counts.
pub fn fit_law_to(start: &MuscleLaw, field: &Field, options: &LawFitOptions) -> Result<LawFit, FailedFit> {
    let began = Instant::now();
    let variants = if options.variants { start.variants() } else { vec![*start] };
    let mut best: Option<LawFit> = None;
    let mut failed: Option<FailedFit> = None;
    let mut evaluations = 0;
    let mut others = Vec::new();
    for variant in variants {
        match fit_variant(&variant, field, options) {
            Ok(fit) => {
                evaluations += fit.evaluations;
                let better = best.as_ref().is_none_or(|b| fit.weighted_ss < b.weighted_ss);
                let (kept, passed) = if better { (Some(fit), best) } else { (best, Some(fit)) };
                others.extend(passed.as_ref().map(estimate::Passed::of));
                best = kept;
            }
            Err(failure) => {
                evaluations += failure.evaluations;
                others.push(estimate::Passed::failed(&failure));
                failed = Some(failure);
            }
        }
    }
    match (best, failed) {
        (Some(fit), _) => Ok(LawFit { evaluations, time_ms: ms(began), others, ..fit }),
        (None, Some(failure)) => Err(FailedFit { evaluations, time_ms: ms(began), ..failure }),
        (None, None) => {
            let why = NoFit::NoMinimum { starts: Vec::new() };
            Err(FailedFit { label: start.label(), why, evaluations, time_ms: ms(began) })
        }
    }
}

/// The shape parameters of the law's default, or of the law itself where it has one more.
fn law_default(law: &MuscleLaw) -> Vec<f64> {
    let own = law.parameters();
    let default = MuscleLaw::default_of(law.kind()).parameters();
    own.iter().map(|p| default.iter().find(|d| d.name == p.name).unwrap_or(p).value).collect()
}

fn ms(began: Instant) -> f64 {
    began.elapsed().as_secs_f64() * 1e3
}

/// Where one start ended.
struct Run {
    cost: f64,
    values: Vec<f64>,
    strengths: Vec<f64>,
    ended: Ended,
}

/// Two ends are the same place when their costs differ by less than this share of the cost there, or of the cost of no muscle, …
const SAME_COST: [f64; 2] = [1e-3, 1e-9];
/// … and the logarithms of their parameters by less than this. Laws with kinks have many minima close together.
const SAME_PLACE: f64 = 2e-2;
/// A descent beside a known end leads there where the costs differ by less than this: in a flat valley it might else end a little lower.
const LEADS_THERE: [f64; 2] = [1e-6, 1e-12];

fn fit_variant(law: &MuscleLaw, field: &Field, options: &LawFitOptions) -> Result<LawFit, FailedFit> {
    let began = Instant::now();
    let fail = |why, evaluations| FailedFit { label: law.label(), why, evaluations, time_ms: ms(began) };
    let eliminate = match options.method {
        Method::LevenbergMarquardt { eliminate, .. } | Method::NelderMead { eliminate, .. } => eliminate,
    };
    let mut model = Model::new(field, law, options.strengths, &options.held, eliminate);
    let unknowns = model.free().len() + model.columns() + model.sharp().count();
    if field.rows() <= unknowns {
        return Err(fail(NoFit::TooFew { rows: field.rows(), unknowns }, 0));
    }
    let nothing = field.cost_of_nothing();
    let mut room = Room::default();
    let mut random = Pcg64Mcg::seed_from_u64(options.seed);
    let given: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
    let mut starts: Vec<Start> = Vec::new();
    let mut best: Option<Run> = None;
    let mut agreed = 0;
    let mut evaluations = 0;
    let several = !model.free().is_empty();
    // A second lobe has false minima that one start in twenty reaches.
    let enough = 1 + law.lobes();
    let centres = [law_default(law), given.clone()];
    for number in 0..if several { options.starts.max(1) } else { 1 } {
        let from = if number == 0 { given.clone() } else { model.near(&centres[(number + 1) % 2], &mut random) };
        model.evaluations = 0;
        let run = match options.method {
            Method::LevenbergMarquardt { settings, .. } => descend(&mut model, &from, &settings, &mut room),
            Method::NelderMead { settings, .. } => search(&mut model, &from, &settings),
        };
        evaluations += model.evaluations;
        starts.push(Start { unexplained: run.cost / nothing, ended: run.ended, evaluations: model.evaluations });
        if !(run.ended.converged() && run.cost.is_finite()) {
            continue;
        }
        match &best {
            Some(b) if run.cost >= b.cost => agreed += usize::from(model.same_end(&b.values, b.cost, run.cost)),
            _ => {
                let found_again = best.as_ref().is_some_and(|b| model.same_end(&b.values, b.cost, run.cost));
                agreed = if found_again { agreed + 1 } else { 1 };
                model.best = Some((run.values.clone(), run.cost));
                best = Some(run);
            }
        }
        if agreed >= enough {
            break;
        }
    }
    let Some(run) = best else {
        return Err(fail(NoFit::NoMinimum { starts }, evaluations));
    };
    if run.cost >= nothing {
        return Err(fail(NoFit::OutOfReach, evaluations));
    }
    if starts.len() > 1 && agreed < 2 {
        return Err(fail(NoFit::Disagreement { starts }, evaluations));
    }
    let cost = model.cost_at(&run.values, (!model.eliminates()).then_some(&run.strengths));
    Ok(estimate::report(&mut model, options, estimate::History { cost, ended: run.ended, starts, agreed, evaluations }))
}

/// Rounds of looking for the sharp side anew and descending again.
const ROUNDS: usize = 8;

/// Levenberg and Marquardt from one start. A sharp side is moved before and between descents.
fn descend(model: &mut Model, from: &[f64], settings: &LevenbergMarquardtSettings, room: &mut Room) -> Run {
    let mut u = model.start(from);
    let bounds = model.bounds();
    let sharp: Vec<usize> = model.sharp().collect();
    let mut end = None;
    for round in 0..ROUNDS {
        let mut moved = round == 0;
        for &k in &sharp {
            moved |= model.move_side(k, &mut u);
        }
        if !moved {
            break;
        }
        let descent = levenberg_marquardt::minimise(model, &mut u, &bounds, settings, room);
        end = Some(descent.stop);
        if sharp.is_empty() || descent.stop == Stop::Known {
            break;
        }
        // The model may stand at a trial that was refused.
        model.cost(&u);
    }
    // The model may stand at a trial that was refused.
    let cost = model.cost(&u);
    let stop = end.unwrap_or(Stop::NotFinite);
    Run { cost, values: model.values().to_vec(), strengths: model.strengths().to_vec(), ended: Ended::Descent(stop) }
}

/// Nelder and Mead from one start, over the parameters themselves and, unless they are eliminated, the strengths.
fn search(model: &mut Model, from: &[f64], settings: &NelderMeadSettings) -> Run {
    model.start(from);
    let moved: Vec<usize> = model.free().iter().copied().chain(model.sharp()).collect();
    let mut x: Vec<f64> = moved.iter().map(|&k| from[k]).collect();
    if !model.eliminates() {
        x.extend(model.strengths());
    }
    let weight = model.field().weights().iter().map(|w| w * w).sum::<f64>() / model.field().len() as f64;
    let mut values = from.to_vec();
    let within =
        |model: &Model, values: &[f64]| model.parameters().iter().zip(values).all(|(p, v)| *v >= p.low && *v <= p.high);
    let mut cost = |model: &mut Model, x: &[f64]| {
        for (&k, v) in moved.iter().zip(x) {
            values[k] = *v;
        }
        if !within(model, &values) {
            return f64::INFINITY;
        }
        let strengths = (!model.eliminates()).then(|| &x[moved.len()..]);
        // As if forces were at most 1 and all weights were equal: fminsearch's tolerance is absolute.
        model.cost_at(&values, strengths) / weight
    };
    let end = nelder_mead::minimise(|x| cost(model, x), &x, settings);
    let cost = cost(model, &end.at) * weight;
    Run {
        cost,
        values: model.values().to_vec(),
        strengths: model.strengths().to_vec(),
        ended: Ended::Simplex(end.stop),
    }
}

/// Within a factor 3 of the start.
const NEAR: f64 = 3.0;
/// Candidates for each further start; the one with the least residual is taken.
const CANDIDATES: usize = 3;

impl Model<'_> {
    /// Shape parameters near a start, the best of a few.
    fn near(&mut self, given: &[f64], random: &mut Pcg64Mcg) -> Vec<f64> {
        let mut best = (f64::INFINITY, given.to_vec());
        for _ in 0..CANDIDATES {
            let mut values = self.values().to_vec();
            for k in self.free().iter().copied().chain(self.sharp()).collect::<Vec<_>>() {
                let p = &self.parameters()[k];
                let factor = NEAR.powf(random.random_range(-1.0..1.0));
                values[k] = (p.origin + (given[k] - p.origin) * factor).clamp(p.low, p.high);
            }
            let cost = self.cost_at(&values, None);
            if cost < best.0 {
                best = (cost, values);
            }
        }
        best.1
    }

    /// Whether the model, which stands where the cost is `cost`, stands where another start ended: at its values, with its cost.
    fn same_end(&self, values: &[f64], least: f64, cost: f64) -> bool {
        self.is_beside(values, least, cost, SAME_COST)
    }

    /// Whether going on from where the model stands would only polish an end that is known.
    pub(super) fn leads_to(&self, values: &[f64], least: f64, cost: f64) -> bool {
        // A lower cost may still fall.
        cost >= least && self.is_beside(values, least, cost, LEADS_THERE)
    }

    fn is_beside(&self, values: &[f64], least: f64, cost: f64, [share, of_nothing]: [f64; 2]) -> bool {
        let near = |k: usize| (self.logarithm(k, self.value(k)) - self.logarithm(k, values[k])).abs() < SAME_PLACE;
        (cost - least).abs() <= share * cost.min(least) + of_nothing * self.field().cost_of_nothing()
            && self.free().iter().all(|&k| near(k))
    }
}
