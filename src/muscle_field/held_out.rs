//! How a fit does on skin that it has not seen: patches left out in turn, because errors of neighbours are alike.

use nalgebra::Point3;
use serde::Serialize;

use crate::fit::patches::{members, patches};
use crate::fit::{Compare, LawFit, LawFitOptions, Sample, fit_law};
use crate::muscle::Fibre;

/// Samples in patches.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOutPatches {
    of: Vec<usize>,
    members: Vec<Vec<usize>>,
}

/// The error on patches left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// √(Σ w r² / Σ w y²) over all patches, each predicted by a fit to the others: 0 is perfect, 1 as good as no muscle at all.
    pub error: f64,
    /// Share of Σ w y² that each patch's residual takes; they add up to `error²`. For comparing two laws patch by patch.
    pub shares: Vec<f64>,
    /// Patches whose fit failed: they count as unexplained.
    pub failed: usize,
}

impl HeldOut {
    /// How much larger the squared error of this law is than another's on the same patches, with the standard error of that difference,
    /// both as a share of the field's squares. Above zero the other is better.
    pub fn excess_over(&self, other: &Self) -> [f64; 2] {
        let differences: Vec<f64> = self.shares.iter().zip(&other.shares).map(|(a, b)| a - b).collect();
        let n = differences.len() as f64;
        let sum: f64 = differences.iter().sum();
        let squares: f64 = differences.iter().map(|d| (d - sum / n) * (d - sum / n)).sum();
        // The sum of n differences that scatter with s has the standard error s √n.
        [sum, (squares / (n - 1.0).max(1.0) * n).sqrt()]
    }
}

impl HeldOutPatches {
    /// Patches of about that radius.
    pub fn new(positions: &[Point3<f64>], radius_mm: f64) -> Self {
        let (of, count) = patches(positions, radius_mm);
        Self { members: members(&of, count), of }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Leaves out each patch in turn: `predict` is given the samples that are left, and returns what a fit to them says of any sample, or
    /// nothing where it failed. None with fewer than two patches.
    pub fn test<P: Fn(&Sample) -> nalgebra::Vector3<f64>>(
        &self,
        samples: &[Sample],
        compare: Compare,
        fibres: &[Fibre],
        mut predict: impl FnMut(&[Sample]) -> Option<P>,
    ) -> Option<HeldOut> {
        if self.len() < 2 {
            return None;
        }
        let weighted = samples.iter().all(|s| s.sigma > 0.0);
        let weigh = |s: &Sample| if weighted { 1.0 / (s.sigma * s.sigma) } else { 1.0 };
        let all: f64 = samples.iter().map(|s| weigh(s) * apart(s, &nalgebra::Vector3::zeros(), compare, fibres)).sum();
        let (mut shares, mut failed) = (Vec::with_capacity(self.len()), 0);
        let mut left = Vec::with_capacity(samples.len());
        for (k, patch) in self.members.iter().enumerate() {
            left.clear();
            left.extend(samples.iter().zip(&self.of).filter(|(_, of)| **of != k).map(|(s, _)| *s));
            let found = predict(&left);
            failed += usize::from(found.is_none());
            let missed = |s: &Sample| {
                let said = found.as_ref().map_or_else(nalgebra::Vector3::zeros, |p| p(s));
                weigh(s) * apart(s, &said, compare, fibres)
            };
            shares.push(patch.iter().map(|&i| missed(&samples[i])).sum::<f64>() / all);
        }
        let sum: f64 = shares.iter().sum();
        sum.is_finite().then(|| HeldOut { error: sum.sqrt(), shares, failed })
    }

    /// Fits the law again to all patches but one, from where the whole fit ended.
    pub fn refit(
        &self,
        fit: &LawFit,
        fibres: &[Fibre],
        samples: &[Sample],
        options: &LawFitOptions,
    ) -> Option<HeldOut> {
        let options = LawFitOptions { variants: false, starts: 1, ..options.clone() };
        self.test(samples, options.compare, fibres, |left| {
            let mut fit = fit_law(&fit.law, fibres, left, &options).ok()?;
            drop_unsupported(&mut fit, fibres, left);
            Some(move |s: &Sample| fit.force_at(fibres, &s.position))
        })
    }
}

/// A strength is told by the samples left when the squares of what the law does there are at least this share of those of the strength
/// best told: a muscle all of whose skin is left out has any strength at all.
const TOLD: f64 = 1e-3;

/// Takes back the strengths that the samples cannot tell.
fn drop_unsupported(fit: &mut LawFit, fibres: &[Fibre], samples: &[Sample]) {
    let weight = |s: &Sample| if fit.weighted { 1.0 / (s.sigma * s.sigma) } else { 1.0 };
    let squares = |fibre: Option<usize>, lobe: usize| -> f64 {
        let of = |f: &Fibre| {
            samples.iter().map(|s| weight(s) * fit.law.lobe_force(lobe, f, &s.position).norm_squared()).sum::<f64>()
        };
        match fibre {
            Some(f) => fibres.get(f).map_or(0.0, of),
            None => fibres.iter().map(of).sum(),
        }
    };
    let told: Vec<f64> = fit.strengths.iter().map(|s| squares(s.fibre, s.lobe)).collect();
    let most = told.iter().copied().fold(0.0, f64::max);
    for (strength, told) in fit.strengths.iter_mut().zip(told) {
        if told < TOLD * most {
            strength.value = 0.0;
        }
    }
}

/// Squared distance between an observed force and what is said of it, of what is compared, N².
fn apart(sample: &Sample, said: &nalgebra::Vector3<f64>, compare: Compare, fibres: &[Fibre]) -> f64 {
    let r = sample.force - said;
    match compare {
        Compare::Vectors => r.norm_squared(),
        Compare::Tangential => (r - sample.normal * sample.normal.dot(&r)).norm_squared(),
        Compare::Magnitudes => (sample.force.norm() - said.norm()).powi(2),
        Compare::Along => {
            let distance = |f: &&Fibre| f.distance_mm(&sample.position);
            let nearest = fibres.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            nearest.map_or(0.0, |f| f.pull().dot(&r).powi(2))
        }
    }
}
