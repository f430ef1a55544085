//! How a law does on skin that it has not seen: patches left out in turn, because errors of neighbours are alike.
//!
//! One yardstick for the window, the ladder, other subjects and the study of the laws.

use nalgebra::{DVector, Point3, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use super::comparison::candidates;
use super::patches::{members, patches, split_where};
use super::{Compare, Design, LawFit, LawFitOptions, Sample, Strengths, fit_law, non_negative};
use crate::muscle::{Fibre, MuscleLaw};

/// Largest share of a fibre's squared force (by any law as it starts) in one patch; a patch with more is cut in two. A patch that holds
/// all of a muscle cannot speak for it.
const MOST_OF_A_MUSCLE: f64 = 0.5;

/// Samples in patches.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches(Vec<Vec<usize>>);

/// The error on patches left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// √(Σ w r² / Σ w y²) over all patches, each predicted by a fit to the others: 0 is perfect, 1 as good as no muscle at all.
    pub error: f64,
    /// Share of Σ w y² that each patch's residual takes; they add up to `error²`. For comparing two laws patch by patch.
    pub shares: Vec<f64>,
    /// Patches without which no fit was found: there the law keeps the shape with which it starts.
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

impl Patches {
    /// Patches of about that radius; none holds more than half of what any law, as it starts, does with one of the fibres.
    pub fn new(fibres: &[Fibre], samples: &[Sample], radius_mm: f64) -> Self {
        let positions: Vec<Point3<f64>> = samples.iter().map(|s| s.position).collect();
        let (of, count) = patches(&positions, radius_mm);
        let mut lists = members(&of, count);
        for law in candidates().iter().filter(|law| law.lobes() == 1) {
            for fibre in fibres {
                let squares: Vec<f64> = positions.iter().map(|x| law.force(fibre, x).norm_squared()).collect();
                let most = MOST_OF_A_MUSCLE * squares.iter().sum::<f64>();
                split_where(&mut lists, &positions, |list| list.iter().map(|&i| squares[i]).sum::<f64>() > most);
            }
        }
        Self(lists)
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Share of Σ w y² of the whole field that lies on each patch.
    pub fn wholes(&self, samples: &[Sample], compare: Compare, fibres: &[Fibre]) -> Vec<f64> {
        let judge = Judge::new(samples, fibres, compare);
        let of: Vec<f64> =
            self.0.iter().map(|list| list.iter().map(|&i| judge.missed(i, &Vector3::zeros())).sum()).collect();
        let all: f64 = of.iter().sum();
        of.iter().map(|s| s / all).collect()
    }

    /// Leaves out each patch in turn: `predict` is given the samples that are left, and returns what is foretold of any sample, and whether
    /// that comes from a fit. None with fewer than two patches, and for a field of zeros.
    pub fn test<P: Fn(&Sample) -> Vector3<f64>>(
        &self,
        samples: &[Sample],
        compare: Compare,
        fibres: &[Fibre],
        predict: impl Fn(&[Sample]) -> (P, bool) + Sync,
    ) -> Option<HeldOut> {
        if self.len() < 2 {
            return None;
        }
        let judge = Judge::new(samples, fibres, compare);
        let all = judge.missed_in_all(&|_| Vector3::zeros());
        let of_patch: Vec<(f64, bool)> = self
            .0
            .par_iter()
            .map(|patch| {
                let mut out = vec![false; samples.len()];
                for &i in patch {
                    out[i] = true;
                }
                let left: Vec<Sample> = samples.iter().zip(&out).filter(|(_, out)| !**out).map(|(s, _)| *s).collect();
                let (foretold, fitted) = predict(&left);
                let missed = |&i: &usize| judge.missed(i, &foretold(&samples[i]));
                (patch.iter().map(missed).sum::<f64>() / all, fitted)
            })
            .collect();
        let sum: f64 = of_patch.iter().map(|p| p.0).sum();
        let failed = of_patch.iter().filter(|p| !p.1).count();
        sum.is_finite().then(|| HeldOut { error: sum.sqrt(), shares: of_patch.iter().map(|p| p.0).collect(), failed })
    }

    /// The same for a law that is fitted to the samples left, from this start.
    pub fn law(
        &self,
        start: &MuscleLaw,
        fibres: &[Fibre],
        samples: &[Sample],
        options: &LawFitOptions,
    ) -> Option<HeldOut> {
        self.test(samples, options.compare, fibres, |left| {
            let found = Pulling::fit(start, fibres, left, options);
            let fitted = found.fitted;
            (move |s: &Sample| found.force_at(fibres, &s.position), fitted)
        })
    }
}

/// A law with strengths that a muscle can have: none negative, and a second lobe only against the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Pulling {
    /// The law with its shape.
    pub law: MuscleLaw,
    /// Strengths, N: of every fibre, then of their second lobes (whose pull is away from the attachment). One for all where shared.
    pub strengths: DVector<f64>,
    /// Whether the shape comes from a fit; otherwise it is the one at the start.
    pub fitted: bool,
    shared: bool,
}

impl Pulling {
    /// The shape comes from [`fit_law`]; where there is no fit, or the start explains the samples better with such strengths, it is that of
    /// the start. Lengths and components along the nearest fibre have no such strengths: there they are those of the fit.
    pub fn fit(start: &MuscleLaw, fibres: &[Fibre], samples: &[Sample], options: &LawFitOptions) -> Self {
        Self::from_fit(start, fit_law(start, fibres, samples, options).ok().as_ref(), fibres, samples, options)
    }

    /// The same from a fit that was made.
    pub fn from_fit(
        start: &MuscleLaw,
        fit: Option<&LawFit>,
        fibres: &[Fibre],
        samples: &[Sample],
        options: &LawFitOptions,
    ) -> Self {
        let shared = options.strengths == Strengths::Shared;
        let none = Self { law: *start, strengths: DVector::zeros(0), fitted: false, shared };
        if !matches!(options.compare, Compare::Vectors | Compare::Tangential) {
            return fit.map_or(none, |fit| Self {
                law: fit.law,
                // A second lobe's strength is counted against the first.
                strengths: fit
                    .strengths
                    .iter()
                    .map(|s| if s.lobe == 0 { s.value } else { -s.value })
                    .collect::<Vec<_>>()
                    .into(),
                fitted: true,
                shared,
            });
        }
        let of = |law: MuscleLaw, fitted: bool| {
            let mut found = Self { law, strengths: DVector::zeros(0), fitted, shared };
            found.strengths = found.pulling(fibres, samples, options.compare);
            (found.unexplained(fibres, samples, options.compare), found)
        };
        let tried = fit.map(|fit| of(fit.law, true)).into_iter().chain([of(*start, fit.is_some())]);
        tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(none, |(_, found)| found)
    }

    /// Share of Σ w y² of some samples that is not explained.
    pub fn unexplained(&self, fibres: &[Fibre], samples: &[Sample], compare: Compare) -> f64 {
        let judge = Judge::new(samples, fibres, compare);
        judge.missed_in_all(&|s| self.force_at(fibres, &s.position)) / judge.missed_in_all(&|_| Vector3::zeros())
    }

    /// Force on a point, N.
    pub fn force_at(&self, fibres: &[Fibre], x: &Point3<f64>) -> Vector3<f64> {
        let each = if self.shared { 1 } else { fibres.len() };
        (0..self.strengths.len())
            .filter(|&column| self.strengths[column] != 0.0)
            .flat_map(|column| {
                let lobe = column / each.max(1);
                let of = if self.shared { fibres } else { fibres.get(column % each..=column % each).unwrap_or(&[]) };
                of.iter().map(move |f| pull(&self.law, lobe, f, x) * self.strengths[column])
            })
            .sum()
    }

    /// Strengths that are not negative, with a weak preference for none at all: a strength is taken to be of the size of the largest force
    /// or less (λ = residual variance / largest force²). Without that, a muscle of which a patch left out held most would get any
    /// strength whatever, and one such patch would decide a comparison.
    fn pulling(&self, fibres: &[Fibre], samples: &[Sample], compare: Compare) -> DVector<f64> {
        let each = if self.shared { 1 } else { fibres.len() };
        let columns = self.law.lobes() * each;
        let Ok(mut design) = Design::new(samples, compare) else { return DVector::zeros(columns) };
        for column in 0..columns {
            let mut one = DVector::zeros(columns);
            one[column] = 1.0;
            let alone = Self { strengths: one, ..self.clone() };
            design.add(samples.iter().map(|s| alone.force_at(fibres, &s.position)));
        }
        let mut normal = design.normal_equations();
        let largest = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
        let residual = non_negative::solve(&normal, None).cost / design.observations() as f64;
        for j in 0..columns {
            normal.gram[(j, j)] += residual / (largest * largest).max(f64::MIN_POSITIVE);
        }
        non_negative::solve(&normal, None).strengths
    }
}

/// Force of one lobe at a strength of 1 N; the second pulls away from the attachment.
fn pull(law: &MuscleLaw, lobe: usize, fibre: &Fibre, x: &Point3<f64>) -> Vector3<f64> {
    law.lobe_force(lobe, fibre, x) * if lobe == 0 { 1.0 } else { -1.0 }
}

/// What is said of samples against what was observed.
struct Judge<'a> {
    samples: &'a [Sample],
    fibres: &'a [Fibre],
    compare: Compare,
    /// As in the fits: one sample without an error takes the weights from all.
    weighted: bool,
}

impl<'a> Judge<'a> {
    fn new(samples: &'a [Sample], fibres: &'a [Fibre], compare: Compare) -> Self {
        Self { samples, fibres, compare, weighted: samples.iter().all(|s| s.sigma > 0.0) }
    }

    /// Weighted squared distance between an observed force and what is said of it, of what is compared.
    fn missed(&self, i: usize, said: &Vector3<f64>) -> f64 {
        let sample = &self.samples[i];
        let r = sample.force - said;
        let square = match self.compare {
            Compare::Vectors => r.norm_squared(),
            Compare::Tangential => (r - sample.normal * sample.normal.dot(&r)).norm_squared(),
            Compare::Magnitudes => (sample.force.norm() - said.norm()).powi(2),
            Compare::Along => {
                let distance = |f: &&Fibre| f.distance_mm(&sample.position);
                let nearest = self.fibres.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                nearest.map_or(0.0, |f| f.pull().dot(&r).powi(2))
            }
        };
        if self.weighted { square / (sample.sigma * sample.sigma) } else { square }
    }

    fn missed_in_all(&self, said: &dyn Fn(&Sample) -> Vector3<f64>) -> f64 {
        self.samples.iter().enumerate().map(|(i, s)| self.missed(i, &said(s))).sum()
    }
}
