//! All laws fitted to one field on equal terms: the same samples, each law's shape refitted, a strength for each fibre.

use std::time::Instant;

use serde::Serialize;

use super::estimate::LawFit;
use super::field::Field;
use super::law_fit::{FailedFit, LawFitOptions, fit_law_to};
use super::{FieldError, Sample};
use crate::muscle::{Fibre, LawKind, Lobe, MuscleLaw};

/// Every law's fit to one field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The four laws in the order of the thesis, and the anatomical one with a second lobe at the attachment.
    pub fits: Vec<Candidate>,
    /// Which has the least BIC; `None` where no law could be fitted.
    pub best: Option<usize>,
    /// By how much the second lobe lowers the anatomical law's BIC: positive where it earns its strengths. `None` where either failed.
    pub lobe_gain: Option<f64>,
    /// Time taken by all, ms.
    pub time_ms: f64,
}

/// A law that was fitted, or why it was not.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Candidate {
    /// A fit.
    Fitted(Box<LawFit>),
    /// No fit.
    Failed(FailedFit),
}

impl Candidate {
    /// The fit, where there is one.
    pub fn fit(&self) -> Option<&LawFit> {
        match self {
            Self::Fitted(fit) => Some(fit),
            Self::Failed(_) => None,
        }
    }

    /// Name for people.
    pub fn label(&self) -> &str {
        match self {
            Self::Fitted(fit) => &fit.label,
            Self::Failed(failed) => &failed.label,
        }
    }
}

/// The candidates, each at its default shape.
pub fn candidates() -> Vec<MuscleLaw> {
    let mut laws = LawKind::ALL.map(MuscleLaw::default_of).to_vec();
    laws.extend(laws.iter().filter_map(|law| law.with_lobe(Some(Lobe::AtAttachment))).collect::<Vec<_>>());
    laws
}

/// Fits every law to samples beside fibres.
pub fn compare_laws(fibres: &[Fibre], samples: &[Sample], options: &LawFitOptions) -> Result<Comparison, FieldError> {
    let began = Instant::now();
    let field = Field::new(fibres, samples, options.compare)?;
    let fits: Vec<Candidate> = candidates()
        .iter()
        .map(|law| match fit_law_to(law, &field, options) {
            Ok(fit) => Candidate::Fitted(Box::new(fit)),
            Err(failed) => Candidate::Failed(failed),
        })
        .collect();
    let bic = |at: usize| fits.get(at).and_then(Candidate::fit).map(|fit| fit.bic);
    let best = (0..fits.len()).filter(|&i| bic(i).is_some()).min_by(|a, b| match (bic(*a), bic(*b)) {
        (Some(a), Some(b)) => a.total_cmp(&b),
        _ => std::cmp::Ordering::Equal,
    });
    let (plain, lobed) = (LawKind::ALL.len() - 1, LawKind::ALL.len());
    let lobe_gain = bic(plain).zip(bic(lobed)).map(|(plain, lobed)| plain - lobed);
    Ok(Comparison { fits, best, lobe_gain, time_ms: began.elapsed().as_secs_f64() * 1e3 })
}
