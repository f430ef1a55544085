//! The strengths of all muscles at once, none negative, with intervals and with what the data cannot tell apart.

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

use super::design::Design;
use super::law_fit::Noise;
use super::non_negative::{self, Ended, NonNegative, NormalEquations};
use super::student;
use super::together::{Together, excess};

/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;
/// A strength whose variance is this many times what it would be alone depends on others: a warning. 10 stands for a standard
/// error three times larger, and is the usual limit.
const INFLATED: f64 = 10.0;
/// Two muscles whose estimates are at least so strongly correlated are named together.
const CORRELATED: f64 = 0.7;
/// Of what pulls at a vertex, less than this has no direction to share, N.
const NO_FORCE_N: f64 = 1e-12;

/// How one muscle stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// It pulls.
    Active,
    /// It would have to push: its strength is zero, with an upper limit.
    AtZero,
    /// It does what a sum of the active ones does; its strength cannot be told from theirs.
    Collinear,
    /// It reaches no measured vertex.
    Silent,
}

/// The strength of one muscle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Activation {
    /// N at the point where its law peaks.
    pub strength_n: f64,
    /// Lower end of the 95 % interval, N; not below zero.
    pub low_n: f64,
    /// Upper end, N; for a muscle at zero the 95 % upper limit; infinite where the data say nothing.
    pub high_n: f64,
    /// Standard error, N; absent where there is none.
    pub sigma_n: Option<f64>,
    /// How it stands.
    pub standing: Standing,
    /// Variance of the strength over what it would be if this muscle were alone in the data (1 to infinity): how much the
    /// others blur it. Absent where it has no error.
    pub inflation: Option<f64>,
}

/// Muscles that the data can hardly tell apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Confusable {
    /// The muscle whose strength is blurred.
    pub muscle: usize,
    /// Those it is blurred by, the worst first, with the correlation of the estimates (−1: one can stand for the other) or, for a
    /// muscle at zero, the cosine of what both do.
    pub with: Vec<(usize, f64)>,
}

/// The strengths of all muscles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Activations {
    /// One a muscle, in the order of the columns.
    pub muscles: Vec<Activation>,
    /// Share of the weighted squares of the forces that is explained: 1 − Σ w|F − F̂|² / Σ w|F|². (Not about the mean: no muscle
    /// means no force.)
    pub r_squared: f64,
    /// Root mean square length of the residual vectors, N, unweighted.
    pub residual_rms_n: f64,
    /// Length of each sample's residual vector, N.
    pub residual_n: Vec<f64>,
    /// Residual variance over that of the given standard errors: 1 where they are true and the muscles suffice.
    pub misfit: f64,
    /// Observed components minus active muscles.
    pub freedom: usize,
    /// Muscles that the data can hardly tell apart.
    pub confusable: Vec<Confusable>,
    /// Why the search ended; the strengths count only with `minimum`.
    pub ended: Ended,
    /// Linear systems solved.
    pub solves: usize,
    /// Covariance of the strengths, N²; zero outside the active set.
    #[serde(skip)]
    covariance: DMatrix<f64>,
}

/// What all muscles of one action unit do together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UnitStrength {
    /// FACS number.
    pub unit: u8,
    /// Sum of the strengths of its muscles, both sides, N.
    pub strength_n: f64,
    /// Lower end of the 95 % interval, N.
    pub low_n: f64,
    /// Upper end, N.
    pub high_n: f64,
}

/// The non-negative strengths that explain the forces best, over all muscles or those `allowed`.
///
/// The intervals hold on the active set: x ± t σ with σ² the variance by (AᵀA)⁻¹ on that set, cut off at zero. A muscle at zero has a
/// one-sided limit: with it let in, the least squares give x̂ ≤ 0 ± σ; the limit is the 95 % point of that distribution above zero. Where the design
/// has causes of error ([`Design::with_causes`]), variances are those of errors that go together, and grow where more is left than they explain.
pub fn activations(design: &Design, allowed: Option<&[bool]>, noise: Noise) -> Activations {
    let normal = design.normal_equations();
    let found = non_negative::solve(&normal, allowed);
    let freedom = design.observations().saturating_sub(found.active.len()).max(1);
    let misfit = found.cost / freedom as f64;
    let inverse = inverse_on(&normal, &found.active);
    let errors = Errors::new(design, &normal, &found, (&inverse, misfit), noise);
    let freedom_of_t = (noise != Noise::Given && errors.together.is_none()).then_some(freedom);
    let t = student::two_sided_95(freedom_of_t);
    let covariance = errors.covariance(&found.active, &inverse);
    let muscles = (0..normal.len())
        .map(|j| {
            let strength_n = found.strengths[j];
            let standing = standing(&found, j);
            let mut one =
                Activation { strength_n, low_n: 0.0, high_n: f64::INFINITY, sigma_n: None, standing, inflation: None };
            match standing {
                Standing::Active => {
                    let sigma = covariance[(j, j)].sqrt();
                    one.sigma_n = Some(sigma);
                    one.inflation = Some(inverse[(j, j)] * normal.gram[(j, j)]);
                    one.low_n = (strength_n - t * sigma).max(0.0);
                    one.high_n = strength_n + t * sigma;
                }
                Standing::AtZero => {
                    let mut set = found.active.clone();
                    set.push(j);
                    let with = inverse_on(&normal, &set);
                    let sigma = errors.covariance(&set, &with)[(j, j)].sqrt();
                    one.sigma_n = Some(sigma);
                    one.inflation = Some(with[(j, j)] * normal.gram[(j, j)]);
                    let estimate = with.row(j).transpose().dot(&normal.moment);
                    one.high_n = limit_above_zero(estimate.min(0.0), sigma, freedom_of_t);
                }
                Standing::Collinear | Standing::Silent => {}
            }
            one
        })
        .collect::<Vec<_>>();
    let residual_n: Vec<f64> =
        (0..design.samples()).map(|s| (design.observed(s) - design.predicted(s, &found.strengths)).norm()).collect();
    Activations {
        confusable: confusable(&normal, &found, &muscles, &inverse),
        r_squared: if normal.square > 0.0 { 1.0 - found.cost / normal.square } else { 0.0 },
        residual_rms_n: (residual_n.iter().map(|r| r * r).sum::<f64>() / residual_n.len() as f64).sqrt(),
        residual_n,
        misfit,
        freedom,
        ended: found.ended,
        solves: found.solves,
        muscles,
        covariance,
    }
}

/// Where variances of strengths are taken from.
struct Errors<'a> {
    normal: &'a NormalEquations,
    together: Option<Together>,
    /// The variance of independent errors, or by how much those that go together are larger than they are said to be.
    scale: f64,
}

impl<'a> Errors<'a> {
    fn new(
        design: &Design,
        normal: &'a NormalEquations,
        found: &NonNegative,
        (inverse, misfit): (&DMatrix<f64>, f64),
        noise: Noise,
    ) -> Self {
        let together = design.together();
        let mut errors = Self { normal, together, scale: 1.0 };
        errors.scale = match (noise, &errors.together) {
            (Noise::Given, _) => 1.0,
            (Noise::Estimated, None) => misfit,
            (Noise::Estimated, Some(_)) => excess(found.cost, errors.of(&found.active, inverse).1),
        };
        errors
    }

    /// Covariance on some of the columns, zero elsewhere, from (AᵀA)⁻¹ on these.
    fn covariance(&self, set: &[usize], inverse: &DMatrix<f64>) -> DMatrix<f64> {
        self.of(set, inverse).0 * self.scale
    }

    fn of(&self, set: &[usize], inverse: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
        let Some(together) = &self.together else { return (inverse.clone(), 0.0) };
        let own: Vec<f64> = set.iter().map(|&j| self.normal.gram[(j, j)]).collect();
        let part = inverse.select_rows(set).select_columns(set);
        let (found, expected) = together.covariance(set, &part, &own);
        let mut all = DMatrix::zeros(inverse.nrows(), inverse.ncols());
        for (a, &i) in set.iter().enumerate() {
            for (b, &j) in set.iter().enumerate() {
                all[(i, j)] = found[(a, b)];
            }
        }
        (all, expected)
    }
}

fn standing(found: &NonNegative, j: usize) -> Standing {
    if found.strengths[j] > 0.0 {
        Standing::Active
    } else if found.silent.contains(&j) {
        Standing::Silent
    } else if found.collinear.contains(&j) {
        Standing::Collinear
    } else {
        Standing::AtZero
    }
}

/// (AᵀA)⁻¹ on some of the columns, zero elsewhere; columns scaled to length 1 before they are inverted.
fn inverse_on(normal: &NormalEquations, set: &[usize]) -> DMatrix<f64> {
    let k = normal.len();
    let mut all = DMatrix::zeros(k, k);
    let scale: Vec<f64> = set.iter().map(|&j| normal.gram[(j, j)].sqrt()).collect();
    let part = DMatrix::from_fn(set.len(), set.len(), |a, b| normal.gram[(set[a], set[b])] / (scale[a] * scale[b]));
    if let Some(cholesky) = part.cholesky() {
        let inverse = cholesky.inverse();
        for (a, &i) in set.iter().enumerate() {
            for (b, &j) in set.iter().enumerate() {
                all[(i, j)] = inverse[(a, b)] / (scale[a] * scale[b]);
            }
        }
    }
    all
}

/// The value that a strength, known as `estimate` (≤ 0) ± `sigma` and known not to be negative, exceeds with 5 %.
fn limit_above_zero(estimate: f64, sigma: f64, freedom: Option<usize>) -> f64 {
    if sigma <= 0.0 {
        return 0.0;
    }
    let zero = -estimate / sigma;
    // Far out in the tail what is above zero is small: P falls by e every σ²/|x̂|.
    if zero > 30.0 {
        return -(1.0 - CONFIDENCE).ln() * sigma / zero;
    }
    let tail = (1.0 - CONFIDENCE) * student::upper_tail(zero, freedom);
    (estimate + sigma * student::exceeded_with(tail, freedom)).max(0.0)
}

fn confusable(
    normal: &NormalEquations,
    found: &NonNegative,
    muscles: &[Activation],
    inverse: &DMatrix<f64>,
) -> Vec<Confusable> {
    let cosine = |a: usize, b: usize| normal.gram[(a, b)] / (normal.gram[(a, a)] * normal.gram[(b, b)]).sqrt();
    let mut all = Vec::new();
    for (j, one) in muscles.iter().enumerate() {
        let mut with: Vec<(usize, f64)> = match one.standing {
            Standing::Active if one.inflation.is_some_and(|i| i > INFLATED) => found
                .active
                .iter()
                .filter(|&&i| i != j)
                .map(|&i| (i, inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt()))
                .filter(|(_, c)| c.abs() > CORRELATED)
                .collect(),
            Standing::Collinear => {
                found.active.iter().map(|&i| (i, cosine(i, j))).filter(|(_, c)| c.abs() > 1e-6).collect()
            }
            Standing::AtZero if one.inflation.is_some_and(|i| i > INFLATED) => {
                found.active.iter().map(|&i| (i, cosine(i, j))).filter(|(_, c)| c.abs() > CORRELATED).collect()
            }
            _ => Vec::new(),
        };
        if !with.is_empty() {
            with.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            all.push(Confusable { muscle: j, with });
        }
    }
    all
}

impl Activations {
    /// The strengths alone, N.
    pub fn strengths(&self) -> DVector<f64> {
        DVector::from_iterator(self.muscles.len(), self.muscles.iter().map(|m| m.strength_n))
    }

    /// The muscles that pull.
    pub fn active(&self) -> Vec<usize> {
        (0..self.muscles.len()).filter(|&j| self.muscles[j].standing == Standing::Active).collect()
    }

    /// Sums over the muscles of each action unit, where `units` names that of every muscle, in ascending order of units.
    pub fn by_unit(&self, units: &[u8]) -> Vec<UnitStrength> {
        let mut names: Vec<u8> = units.to_vec();
        names.sort_unstable();
        names.dedup();
        let t = student::two_sided_95(Some(self.freedom));
        names
            .into_iter()
            .map(|unit| {
                let members: Vec<usize> =
                    (0..self.muscles.len().min(units.len())).filter(|&j| units[j] == unit).collect();
                let strength_n = members.iter().map(|&j| self.muscles[j].strength_n).sum::<f64>();
                let pairs = members.iter().flat_map(|&i| members.iter().map(move |&j| (i, j)));
                let sigma = pairs.map(|p| self.covariance[p]).sum::<f64>().max(0.0).sqrt();
                // What is at zero adds what it may still be.
                let hidden: f64 = members
                    .iter()
                    .filter(|&&j| self.muscles[j].standing != Standing::Active)
                    .map(|&j| self.muscles[j].high_n * self.muscles[j].high_n)
                    .sum();
                let above = (t * sigma).hypot(hidden.sqrt());
                UnitStrength { unit, strength_n, low_n: (strength_n - t * sigma).max(0.0), high_n: strength_n + above }
            })
            .collect()
    }

    /// What every muscle does at one sample, N, and its share of what they do together: the part along the sum, so that the
    /// shares add up to 1 (one that pulls against the sum has a negative share). No shares where the sum is nothing.
    pub fn at_sample(&self, design: &Design, sample: usize) -> Vec<(Vector3<f64>, Option<f64>)> {
        let pulls: Vec<Vector3<f64>> =
            self.muscles.iter().enumerate().map(|(j, m)| design.force(j, sample) * m.strength_n).collect();
        let sum: Vector3<f64> = pulls.iter().sum();
        let square = sum.norm_squared();
        let share = |pull: &Vector3<f64>| (square > NO_FORCE_N * NO_FORCE_N).then(|| pull.dot(&sum) / square);
        pulls.iter().map(|pull| (*pull, share(pull))).collect()
    }
}

#[cfg(test)]
#[path = "activations_tests.rs"]
mod tests;
