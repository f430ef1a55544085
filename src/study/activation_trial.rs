//! Fields of known muscles with noise: how often the search for the fewest muscles finds exactly those that pulled.

use std::time::Instant;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::twin::normal_pair;
use crate::face::FaceModel;
use crate::fit::design::{Design, DesignError};
use crate::fit::selection::{self, SelectionSettings};
use crate::fit::{Compare, Sample};
use crate::muscle::{Fibre, FibreError, MuscleLaw};

/// A force below this share of the largest counts as none when the size of a field is told.
const PULLED: f64 = 0.05;

/// How fields are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialSettings {
    /// Number of fields (default 1000).
    pub draws: usize,
    /// Seed: the same fields for the same seed.
    pub seed: u64,
    /// Least and most muscles that pull (default 1 to 5).
    pub muscles: [usize; 2],
    /// Least and largest strength, N (default 0.3 to 2).
    pub strength_n: [f64; 2],
    /// Noise: standard deviation of every component of every force over the root mean square length of the true forces on the vertices
    /// that are pulled (by more than 5 % of the largest). Default 0.1; the error of a force is then 17 % of it.
    pub noise: f64,
    /// Muscles that pull together have columns with a cosine of less than this in size: 0.3 (default) is "they do not overlap", 1 is
    /// any muscles.
    pub most_cosine: f64,
    /// Whether only the front of the face is measured, z above 0 (default: all vertices).
    pub front_only: bool,
    /// The search.
    pub selection: SelectionSettings,
}

impl Default for TrialSettings {
    fn default() -> Self {
        Self {
            draws: 1000,
            seed: 1,
            muscles: [1, 5],
            strength_n: [0.3, 2.0],
            noise: 0.1,
            most_cosine: 0.3,
            front_only: false,
            selection: SelectionSettings::default(),
        }
    }
}

/// What the search made of the fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrialReport {
    /// Fields drawn.
    pub draws: usize,
    /// Fields of which exactly the muscles that pulled were found.
    pub exact: usize,
    /// The same by number of muscles that pulled: fields, exact ones.
    pub by_count: Vec<[usize; 2]>,
    /// Fields with a muscle found that did not pull.
    pub false_positive: usize,
    /// Fields with a muscle that pulled and was not found.
    pub missed: usize,
    /// Of every muscle that pulled and was missed, and every one found in its stead: indices and how often. The second is absent where
    /// nothing was found that did not pull.
    pub confusions: Vec<(usize, Option<usize>, usize)>,
    /// Muscles found that did not pull where none was missed, and how often.
    pub spurious: Vec<(usize, usize)>,
    /// Share of the 95 % intervals of found muscles that cover the truth.
    pub covered: f64,
    /// Root mean square of strength / truth − 1 over the found muscles.
    pub strength_error: f64,
    /// The least sum of samples measured.
    pub samples: usize,
    /// Median time of all strengths at once, with the columns already built, ms.
    pub activations_ms: f64,
    /// Median time of a whole search, ms.
    pub selection_ms: f64,
}

/// Why no trial is possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// A muscle of the face makes no fibre.
    #[error(transparent)]
    Fibre(#[from] FibreError),
    /// The samples make no columns.
    #[error(transparent)]
    Design(#[from] DesignError),
}

/// The fibres of a face as it stands, and a sample without force at every vertex.
///
/// # Errors
/// A muscle that makes no fibre.
pub fn fibres_and_samples(face: &FaceModel) -> Result<(Vec<Fibre>, Vec<Sample>), FibreError> {
    let x = face.mesh().positions();
    let normals = face.mesh().vertex_normals(x);
    let fibres = face.muscles().iter().map(|m| Fibre::of(m, x, &normals)).collect::<Result<_, _>>()?;
    let samples =
        x.iter().zip(&normals).map(|(p, n)| Sample { position: *p, force: Vector3::zeros(), sigma: 0.0, normal: *n });
    Ok((fibres, samples.collect()))
}

/// Draws fields, adds noise, and looks for the muscles.
///
/// # Errors
/// [`TrialError`].
pub fn trial(face: &FaceModel, law: &MuscleLaw, settings: &TrialSettings) -> Result<TrialReport, TrialError> {
    let (fibres, mut samples) = fibres_and_samples(face)?;
    if settings.front_only {
        samples.retain(|s| s.position.z > 0.0);
    }
    let positions: Vec<_> = samples.iter().map(|s| s.position).collect();
    let unit = Design::of(law, &fibres, &samples, Compare::Vectors)?;
    let p = fibres.len();
    let [fewest, most] = settings.muscles;
    let mut random = Pcg64::seed_from_u64(settings.seed ^ 0x6163_7469);
    let mut report = TrialReport {
        draws: settings.draws,
        by_count: vec![[0, 0]; most + 1],
        samples: samples.len(),
        ..TrialReport::default()
    };
    let mut confusion = std::collections::BTreeMap::new();
    let mut spurious = std::collections::BTreeMap::new();
    let (mut intervals, mut covering, mut squares) = (0_usize, 0_usize, 0.0);
    let mut times: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for _ in 0..settings.draws {
        let wanted = random.random_range(fewest..=most);
        let truth = draw_set(p, wanted, &mut random, |a, b| unit.cosine(a, b).abs() < settings.most_cosine);
        let mut strengths = nalgebra::DVector::zeros(p);
        for &j in &truth {
            strengths[j] = random.random_range(settings.strength_n[0]..=settings.strength_n[1]);
        }
        let mut squared = Vec::with_capacity(samples.len());
        for (at, sample) in samples.iter_mut().enumerate() {
            sample.force = unit.predicted(at, &strengths);
            squared.push(sample.force.norm_squared());
        }
        let largest = squared.iter().copied().fold(0.0, f64::max);
        let pulled: Vec<f64> = squared.into_iter().filter(|s| *s > PULLED * PULLED * largest).collect();
        let sigma = settings.noise * (pulled.iter().sum::<f64>() / pulled.len().max(1) as f64).sqrt();
        for sample in &mut samples {
            let ([a, b], [c, _]) = (normal_pair(&mut random), normal_pair(&mut random));
            sample.force += Vector3::new(a, b, c) * sigma;
        }
        let design = unit.with_forces(&samples)?;
        let start = Instant::now();
        let all = crate::fit::activations::activations(&design, None, settings.selection.noise);
        times[0].push(start.elapsed().as_secs_f64() * 1e3);
        std::hint::black_box(all);
        let start = Instant::now();
        let found = selection::smallest_set(&design, &positions, &settings.selection);
        times[1].push(start.elapsed().as_secs_f64() * 1e3);

        let exact = found.chosen == truth;
        report.exact += usize::from(exact);
        report.by_count[truth.len()][0] += 1;
        report.by_count[truth.len()][1] += usize::from(exact);
        let missed: Vec<usize> = truth.iter().copied().filter(|j| !found.chosen.contains(j)).collect();
        let extra: Vec<usize> = found.chosen.iter().copied().filter(|j| !truth.contains(j)).collect();
        report.missed += usize::from(!missed.is_empty());
        report.false_positive += usize::from(!extra.is_empty());
        for &m in &missed {
            // The one found in its stead is the one most like it.
            let alike = |j: &usize| unit.cosine(m, *j).abs();
            let taken = extra.iter().copied().max_by(|a, b| alike(a).total_cmp(&alike(b)));
            *confusion.entry((m, taken)).or_insert(0) += 1;
        }
        if missed.is_empty() {
            for &j in &extra {
                *spurious.entry(j).or_insert(0) += 1;
            }
        }
        for &j in &found.chosen {
            if strengths[j] > 0.0 {
                let one = &found.activations.muscles[j];
                intervals += 1;
                covering += usize::from(one.low_n <= strengths[j] && strengths[j] <= one.high_n);
                squares += (one.strength_n / strengths[j] - 1.0).powi(2);
            }
        }
    }
    report.confusions = confusion.into_iter().map(|((m, taken), n)| (m, taken, n)).collect();
    report.confusions.sort_by_key(|c| std::cmp::Reverse(c.2));
    report.spurious = spurious.into_iter().collect();
    report.spurious.sort_by_key(|c| std::cmp::Reverse(c.1));
    report.covered = covering as f64 / intervals.max(1) as f64;
    report.strength_error = (squares / intervals.max(1) as f64).sqrt();
    for list in &mut times {
        list.sort_unstable_by(f64::total_cmp);
    }
    [report.activations_ms, report.selection_ms] = times.map(|t| t.get(t.len() / 2).copied().unwrap_or(0.0));
    Ok(report)
}

/// `wanted` different muscles any two of which may pull together; drawn anew where none is left that may.
fn draw_set(p: usize, wanted: usize, random: &mut Pcg64, together: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    // Without an end where no set of that size exists, so the wish shrinks after many trials.
    for attempt in 0..10_000 {
        let wanted = wanted.saturating_sub(attempt / 1000).clamp(1, p);
        let mut set: Vec<usize> = Vec::with_capacity(wanted);
        let mut left: Vec<usize> = (0..p).collect();
        while set.len() < wanted && !left.is_empty() {
            let j = left.swap_remove(random.random_range(0..left.len()));
            set.push(j);
            left.retain(|&i| together(i, j));
        }
        if set.len() == wanted {
            set.sort_unstable();
            return set;
        }
    }
    vec![0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::LawKind;

    /// 60 fields of one to five muscles that do not overlap, 10 % noise, all four laws in turn.
    #[test]
    fn muscles_that_do_not_overlap_are_found_exactly() {
        let face = crate::face::generic();
        for (kind, seed) in LawKind::ALL.into_iter().zip(1..) {
            let settings = TrialSettings { draws: 15, seed, ..TrialSettings::default() };
            let report = trial(&face, &MuscleLaw::default_of(kind), &settings).unwrap();
            assert!(report.exact >= 14, "{}: {report:?}", kind.label());
            assert!(report.covered > 0.8 && report.strength_error < 0.1, "{report:?}");
        }
    }

    /// A thousand fields a law; prints the figures of `docs/accuracy.md`.
    #[test]
    #[ignore = "a minute"]
    fn a_thousand_fields_a_law() {
        let face = crate::face::generic();
        let name = |j: usize| face.muscles()[j].id.as_str();
        for (most_cosine, front_only, noise) in
            [(0.3, false, 0.1), (1.01, false, 0.1), (0.3, true, 0.1), (1.01, true, 0.1), (1.01, false, 0.3)]
        {
            for kind in LawKind::ALL {
                let settings = TrialSettings { noise, most_cosine, front_only, ..TrialSettings::default() };
                let r = trial(&face, &MuscleLaw::default_of(kind), &settings).unwrap();
                println!(
                    "{:14} cos<{most_cosine:.2} noise {noise} n={} exact {:.1} % false {} missed {} covered {:.1} % error {:.1} % | {:.3} ms {:.2} ms | {:?}",
                    kind.label(),
                    r.samples,
                    100.0 * r.exact as f64 / r.draws as f64,
                    r.false_positive,
                    r.missed,
                    100.0 * r.covered,
                    100.0 * r.strength_error,
                    r.activations_ms,
                    r.selection_ms,
                    r.by_count
                );
                for (m, taken, n) in r.confusions.iter().take(8) {
                    println!("    {} taken for {}: {n}", name(*m), taken.map_or("nothing", name));
                }
                for (j, n) in r.spurious.iter().take(5) {
                    println!("    {} found beside: {n}", name(*j));
                }
            }
        }
    }
}
