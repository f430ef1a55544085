//! What a fit says: parameters and strengths with 95 % intervals, what the data cannot tell, how much is left, why it ended.

use nalgebra::{DMatrix, Point3, SymmetricEigen, Vector3};
use serde::Serialize;

use super::law_fit::{Ended, FailedFit, LawFitOptions, Noise, Start};
use super::law_model::Model;
use super::together::excess;
use super::{Compare, Sample, Strengths, student};
use crate::muscle::{Fibre, MuscleLaw};

/// A shape parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Short name: `sr`.
    pub name: &'static str,
    /// What it is, for people.
    pub label: &'static str,
    /// Its value.
    pub value: f64,
    /// Lower end of the 95 % interval, not below what the law accepts.
    pub low: f64,
    /// Upper end of the 95 % interval, not above what the law accepts.
    pub high: f64,
    /// Whether it was fitted; otherwise it was held and has no interval.
    pub fitted: bool,
    /// Whether the fit ended at a bound of the law, so that the interval is the whole range.
    pub at_bound: bool,
    /// Whether the data tell it to within a factor 2 to either side.
    pub identified: bool,
}

/// A strength, N.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Strength {
    /// Which fibre, from 0; `None` where all share one.
    pub fibre: Option<usize>,
    /// 0: the muscle itself, 1: its second lobe.
    pub lobe: usize,
    /// Newton, positive towards the attachment.
    #[serde(rename = "value_N")]
    pub value: f64,
    /// Lower end of the 95 % interval, N.
    #[serde(rename = "low_N")]
    pub low: f64,
    /// Upper end of the 95 % interval, N.
    #[serde(rename = "high_N")]
    pub high: f64,
    /// Whether any sample lies where it pulls, apart from the others.
    pub supported: bool,
}

/// A combination of shape parameters that the data cannot tell to within a factor 2.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeakDirection {
    /// Standard error of the logarithm along it; infinite where nothing changes.
    pub log_sigma: f64,
    /// Its parts: parameter and share, squares of the shares add up to 1. Small ones are left out.
    pub parts: Vec<(&'static str, f64)>,
}

/// Another reading that was fitted and passed over.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Passed {
    /// Its name.
    pub label: String,
    /// Its weighted residual; none where it failed.
    pub weighted_ss: Option<f64>,
    /// Its R²; none where it failed.
    pub r2: Option<f64>,
    /// Why it failed.
    pub failed: Option<String>,
}

impl Passed {
    pub(crate) fn of(fit: &LawFit) -> Self {
        let (weighted_ss, r2) = (Some(fit.weighted_ss), Some(fit.r2));
        Self { label: fit.label.clone(), weighted_ss, r2, failed: None }
    }

    pub(crate) fn failed(fit: &FailedFit) -> Self {
        Self { label: fit.label.clone(), weighted_ss: None, r2: None, failed: Some(fit.why.to_string()) }
    }
}

/// A fit.
///
/// N is the number of numbers compared and k that of unknowns: shape parameters, strengths, and the variance where it is estimated.
/// Errors of neighbouring forces are correlated. Intervals and correlations know it where the fit was given the causes of the errors
/// ([`LawFit::together`]), and are too narrow otherwise; AIC and BIC do not, and grant a parameter too easily. Held-out error
/// ([`LawFit::misfit`]) does not suffer from it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LawFit {
    /// The law with the fitted shape.
    pub law: MuscleLaw,
    /// Its name with what sets the chosen reading apart.
    pub label: String,
    /// What was compared.
    pub compare: Compare,
    /// Whether samples counted by their standard errors.
    pub weighted: bool,
    /// Whether the intervals know how errors of different samples go together.
    pub together: bool,
    /// The shape parameters.
    pub parameters: Vec<Estimate>,
    /// The strengths: of all fibres, then of their second lobes.
    pub strengths: Vec<Strength>,
    /// Names of the rows of `correlation`.
    pub correlated: Vec<String>,
    /// Correlation of the errors of logarithms of parameters and of strengths. What ended at a bound is not in it.
    pub correlation: Vec<Vec<f64>>,
    /// What the data cannot tell, the worst first.
    pub weak: Vec<WeakDirection>,
    /// Largest over least eigenvalue of the normal matrix in logarithms of the shape parameters; 1 without any.
    pub condition: f64,
    /// Σ of the squared weighted residual.
    pub weighted_ss: f64,
    /// Root mean square length of the residual, N, of what was compared, unweighted.
    #[serde(rename = "rms_N")]
    pub rms: f64,
    /// 1 − weighted Σ r² / weighted Σ y², about zero and not about the mean: the share that the law explains of what no muscle would leave.
    pub r2: f64,
    /// N.
    pub rows: usize,
    /// k.
    pub unknowns: usize,
    /// Akaike's criterion, N ln(Σ r²/N) + 2 k.
    pub aic: f64,
    /// The same for small samples, + 2 k (k + 1)/(N − k − 1).
    pub aicc: f64,
    /// Schwarz's criterion, N ln(Σ r²/N) + k ln N.
    pub bic: f64,
    /// How far that of no muscle at all lies above: negative where the law does not earn its parameters.
    pub bic_gain: f64,
    /// Residual variance in units of the given one, Σ r²/(N − k): near 1 where law and standard errors are right. None without standard errors.
    pub reduced_chi2: Option<f64>,
    /// Why the best start ended.
    pub ended: Ended,
    /// Every start, in order.
    pub starts: Vec<Start>,
    /// How many of them ended here.
    pub agreed: usize,
    /// Evaluations of the residual, over all starts and readings.
    pub evaluations: usize,
    /// Time taken, ms.
    pub time_ms: f64,
    /// Other readings that were fitted.
    pub others: Vec<Passed>,
}

/// How a fit came about.
pub(crate) struct History {
    pub(crate) cost: f64,
    pub(crate) ended: Ended,
    pub(crate) starts: Vec<Start>,
    pub(crate) agreed: usize,
    pub(crate) evaluations: usize,
}

/// ln 2: an interval that reaches further to either side tells nothing but the order of magnitude.
const TOLD: f64 = std::f64::consts::LN_2;
/// Nearer to a bound than this, on the logarithmic scale, is at it.
const AT_BOUND: f64 = 1e-9;
/// Eigenvalues below this share of the largest are rounding errors.
const NOTHING: f64 = 1e-14;
/// Shares of a weak direction below this are not named.
const NAMED: f64 = 0.25;

/// Reads everything from the model, which stands at the minimum.
pub(crate) fn report(model: &mut Model, options: &LawFitOptions, history: History) -> LawFit {
    let History { cost, ended, starts, agreed, evaluations } = history;
    let (p, q, rows) = (model.free().len(), model.columns(), model.field().rows());
    let unit = model.field().unit();
    let sharp: Vec<usize> = model.sharp().collect();
    let dropped = model.dropped();
    let told = p + sharp.len() + q - dropped;
    let freedom = rows.saturating_sub(told).max(1);
    let known = options.noise == Noise::Given && model.field().weighted();
    // The residual of an exact fit is made of rounding errors, and so is its variance.
    let least = (4.0 * f64::EPSILON).powi(2) * model.field().cost_of_nothing();
    let independent = if known { 1.0 } else { cost.max(least) / freedom as f64 };
    let at_bound = |k: usize, model: &Model| {
        let (parameter, u) = (model.parameters()[k], model.logarithm(k, model.value(k)));
        [parameter.low, parameter.high].iter().any(|b| (u - model.logarithm(k, *b)).abs() < AT_BOUND)
    };
    let held: Vec<bool> = model.free().iter().map(|&k| at_bound(k, model)).collect();
    let matrix = DMatrix::from_row_slice(p + q, p + q, model.normal().0);
    // What is told: parameters away from their bounds, strengths with support.
    let inner: Vec<usize> = (0..p + q).filter(|&i| if i < p { !held[i] } else { matrix[(i, i)] > 0.0 }).collect();
    let inverse = inverse(&matrix, &inner);
    let (covariance, variance, reach) = if let Some(together) = model.together() {
        let own: Vec<f64> = inner.iter().map(|&i| matrix[(i, i)]).collect();
        let (covariance, expected) = together.covariance(&inner, &inverse, &own);
        let more = if options.noise == Noise::Given { 1.0 } else { excess(cost, expected) };
        // The mean over the unknowns of how much more they err than with independent errors of the same size.
        let part = matrix.select_rows(&inner).select_columns(&inner);
        let mean = (part * &covariance).trace() / inner.len().max(1) as f64;
        (covariance * more, mean * more, student::two_sided_95(None))
    } else {
        let reach = student::two_sided_95(if known { None } else { Some(freedom) });
        (&inverse * independent, independent, reach)
    };
    let sigma = |i: usize| inner.iter().position(|&j| j == i).map(|a| covariance[(a, a)].max(0.0).sqrt());

    let parameters = estimates(model, &held, reach, &sigma);
    let fibres = model.field().fibres().len();
    let strengths = model.strengths().iter().enumerate().map(|(c, &value)| {
        let error = sigma(p + c).unwrap_or(f64::INFINITY) * reach;
        let (fibre, lobe) =
            if options.strengths == Strengths::Shared { (None, c) } else { (Some(c % fibres), c / fibres) };
        let (low, high) = ((value - error) * unit, (value + error) * unit);
        Strength { fibre, lobe, value: value * unit, low, high, supported: error.is_finite() && value != 0.0 }
    });
    let strengths: Vec<Strength> = strengths.collect();
    let (weak, condition) = weak_directions(model, &matrix, &inner, &covariance, reach);
    let names = |&i: &usize| match i.checked_sub(p) {
        None => model.parameters()[model.free()[i]].name.to_owned(),
        Some(c) => match (strengths[c].fibre, strengths[c].lobe) {
            (None, 0) => "strength".to_owned(),
            (None, _) => "strength of the lobe".to_owned(),
            (Some(fibre), 0) => format!("strength {}", fibre + 1),
            (Some(fibre), _) => format!("strength of the lobe {}", fibre + 1),
        },
    };
    let correlated: Vec<String> = inner.iter().map(names).collect();
    let correlation = (0..inner.len()).map(|a| {
        let size = |b: usize| (covariance[(a, a)] * covariance[(b, b)]).sqrt();
        (0..inner.len()).map(|b| if a == b { 1.0 } else { covariance[(a, b)] / size(b) }).collect()
    });
    let correlation = correlation.collect();
    let mut parameters = parameters;
    for k in sharp {
        let ceiling = cost + reach * reach * variance;
        let (low, high) = model.side_interval(k, ceiling);
        let estimate = &mut parameters[k];
        (estimate.low, estimate.high) = (low, high);
        estimate.identified = (high / estimate.value).ln() <= TOLD && (estimate.value / low).ln() <= TOLD;
    }
    let (n, k) = (rows as f64, (told + 1) as f64);
    let nothing = model.field().cost_of_nothing();
    let likelihood = n * (cost.max(least) / n).ln();
    let bic = likelihood + k * n.ln();
    let squares = model.residual_squares().zip(model.field().weights()).map(|(r2, w)| r2 / (w * w));
    let rms = (squares.sum::<f64>() / model.field().len() as f64).sqrt() * unit;
    LawFit {
        law: model.law(),
        label: model.law().label(),
        compare: model.field().compare(),
        weighted: model.field().weighted(),
        together: !model.field().causes().is_empty(),
        parameters,
        strengths,
        correlated,
        correlation,
        weak,
        condition,
        weighted_ss: cost,
        rms,
        r2: 1.0 - cost / nothing,
        rows,
        unknowns: told + 1,
        aic: likelihood + 2.0 * k,
        aicc: likelihood + 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0).max(1.0),
        bic,
        bic_gain: n * (nothing / n).ln() + n.ln() - bic,
        reduced_chi2: model.field().weighted().then(|| cost / freedom as f64),
        ended,
        starts,
        agreed,
        evaluations,
        time_ms: 0.0,
        others: Vec::new(),
    }
}

/// Inverse of the rows and columns named, by eigenvalues of the matrix scaled to a unit diagonal; what rounding errors alone hold is
/// given an infinite variance by its smallness.
fn inverse(matrix: &DMatrix<f64>, inner: &[usize]) -> DMatrix<f64> {
    let m = inner.len();
    let scale: Vec<f64> = inner.iter().map(|&i| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = DMatrix::from_fn(m, m, |a, b| matrix[(inner[a], inner[b])] / (scale[a] * scale[b]));
    let eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.iter().fold(0.0, |l: f64, v| l.max(*v));
    let values = eigen.eigenvalues.map(|v| 1.0 / v.max(NOTHING * largest));
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(m, m, |a, b| inverse[(a, b)] / (scale[a] * scale[b]))
}

fn estimates(model: &Model, held: &[bool], reach: f64, sigma: &impl Fn(usize) -> Option<f64>) -> Vec<Estimate> {
    let one = |(k, parameter): (usize, &crate::muscle::Parameter)| {
        let value = model.value(k);
        let at = model.free().iter().position(|&f| f == k);
        let at_bound = at.is_some_and(|i| held[i]);
        let fitted = at.is_some() || model.sharp().any(|s| s == k);
        let (low, high, identified) = match at.and_then(sigma) {
            Some(sigma) => {
                let (u, reach) = (model.logarithm(k, value), reach * sigma);
                let end = |u: f64| (parameter.origin + u.exp()).clamp(parameter.low, parameter.high);
                (end(u - reach), end(u + reach), reach <= TOLD)
            }
            None if at_bound => (parameter.low, parameter.high, false),
            None => (value, value, !fitted),
        };
        Estimate { name: parameter.name, label: parameter.label, value, low, high, fitted, at_bound, identified }
    };
    model.parameters().iter().enumerate().map(one).collect()
}

/// Eigenvectors of the normal matrix in logarithms of the shape parameters, strengths eliminated, along which the data tell less than a
/// factor 2; and the matrix's condition.
fn weak_directions(
    model: &Model,
    matrix: &DMatrix<f64>,
    inner: &[usize],
    covariance: &DMatrix<f64>,
    reach: f64,
) -> (Vec<WeakDirection>, f64) {
    let p = model.free().len();
    let shape: Vec<usize> = inner.iter().copied().filter(|&i| i < p).collect();
    let strengths: Vec<usize> = inner.iter().copied().filter(|&i| i >= p).collect();
    if shape.is_empty() {
        return (Vec::new(), 1.0);
    }
    let block = |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| matrix[(a[i], b[j])]);
    let mixed = block(&shape, &strengths);
    let schur = block(&shape, &shape) - &mixed * inverse(matrix, &strengths) * mixed.transpose();
    // The shape parameters come first.
    let covariance = covariance.view((0, 0), (shape.len(), shape.len()));
    let eigen = SymmetricEigen::new(schur);
    let largest = eigen.eigenvalues.iter().fold(0.0, |l: f64, v| l.max(*v));
    let least = eigen.eigenvalues.iter().fold(f64::INFINITY, |l: f64, v| l.min(*v));
    let mut weak: Vec<WeakDirection> = eigen
        .eigenvalues
        .iter()
        .enumerate()
        .map(|(a, &value)| {
            let along = eigen.eigenvectors.column(a);
            let variance = along.dot(&(covariance * along));
            let log_sigma = if value > NOTHING * largest { variance.max(0.0).sqrt() } else { f64::INFINITY };
            let parts = shape
                .iter()
                .enumerate()
                .map(|(i, &at)| (model.parameters()[model.free()[at]].name, eigen.eigenvectors[(i, a)]));
            WeakDirection { log_sigma, parts: parts.filter(|(_, share)| share.abs() >= NAMED).collect() }
        })
        .filter(|d| d.log_sigma * reach > TOLD)
        .collect();
    weak.sort_by(|a, b| b.log_sigma.total_cmp(&a.log_sigma));
    (weak, if least > 0.0 { largest / least } else { f64::INFINITY })
}

/// How well a fit does on samples that it may not have seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Misfit {
    /// Σ of the squared weighted residual.
    pub weighted_ss: f64,
    /// The same for no muscle at all.
    pub weighted_ss_of_nothing: f64,
    /// Root mean square length of the residual, N, of what is compared.
    #[serde(rename = "rms_N")]
    pub rms: f64,
    /// Samples.
    pub samples: usize,
}

impl Misfit {
    /// 1 − weighted Σ r² / weighted Σ y²; below 0 where no muscle at all would be nearer.
    pub fn r2(&self) -> f64 {
        1.0 - self.weighted_ss / self.weighted_ss_of_nothing
    }
}

impl LawFit {
    /// Force of the fitted law on a point, N, for its own fibres or the same muscles of another face.
    pub fn force_at(&self, fibres: &[Fibre], x: &Point3<f64>) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for strength in &self.strengths {
            match strength.fibre {
                Some(fibre) => {
                    if let Some(fibre) = fibres.get(fibre) {
                        sum += self.law.lobe_force(strength.lobe, fibre, x) * strength.value;
                    }
                }
                None => {
                    for fibre in fibres {
                        sum += self.law.lobe_force(strength.lobe, fibre, x) * strength.value;
                    }
                }
            }
        }
        sum
    }

    /// The residual of samples, such as those held out of the fit or of another face, compared and weighted as in the fit.
    pub fn misfit(&self, fibres: &[Fibre], samples: &[Sample]) -> Result<Misfit, super::FieldError> {
        let field = super::Field::new(fibres, samples, self.compare)?;
        let mut misfit = Misfit {
            weighted_ss: 0.0,
            weighted_ss_of_nothing: field.cost_of_nothing(),
            rms: 0.0,
            samples: samples.len(),
        };
        for (i, sample) in samples.iter().enumerate() {
            let law = field.reduce(i, &(self.force_at(fibres, &sample.position) / field.unit()));
            let y = &field.forces()[i];
            let r2 = if self.compare == Compare::Magnitudes {
                (y.norm() - law.norm()).powi(2)
            } else {
                (y - law).norm_squared()
            };
            misfit.weighted_ss += r2;
            misfit.rms += r2 / (field.weights()[i] * field.weights()[i]);
        }
        misfit.rms = (misfit.rms / samples.len() as f64).sqrt() * field.unit();
        Ok(misfit)
    }
}
