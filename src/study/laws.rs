//! The four muscle laws on one field of forces, on equal terms: the same samples, each law refitted, each judged on patches of skin that it
//! did not see.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::fit::{Compare, LawFit, LawFitOptions, Patches, Pulling, Sample, candidates, fit_law};
use crate::muscle::{Fibre, MuscleLaw};

/// Radius of the patches that are left out, mm.
const PATCH_RADIUS_MM: f64 = 15.0;
/// Skin farther than this from every fibre says nothing about a law, mm.
const REACH_MM: f64 = 30.0;
/// Resamplings for an interval.
const RESAMPLINGS: usize = 4000;

/// Less than this share of the squared forces foretold is nothing, and shows as 0 %.
const NOTHING: f64 = 0.005;

/// A law that takes part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// Name of tables.
    pub name: &'static str,
    /// Where its fit starts.
    pub start: MuscleLaw,
    /// Whether it is one of the four; otherwise it is shown beside them and cannot win.
    pub ranked: bool,
}

/// The four laws, and the anatomical one with a second lobe beside them.
pub fn contenders() -> Vec<Contender> {
    let contender = |start: MuscleLaw| {
        let ranked = start.lobes() == 1;
        Contender { name: if ranked { start.kind().label() } else { "Anatomical, second lobe" }, start, ranked }
    };
    candidates().into_iter().map(contender).collect()
}

/// How one law did on one field.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Its name.
    pub name: &'static str,
    /// Whether it is one of the four.
    pub ranked: bool,
    /// The fit to all samples, or why there is none.
    pub fit: Result<LawFit, String>,
    /// The law with the shape taken on all samples.
    pub law: MuscleLaw,
    /// Strengths on all samples, N, none negative: of every fibre, then of their second lobes (whose pull is away from the attachment).
    pub strengths_n: Vec<f64>,
    /// Share of the squared forces that is explained on the samples themselves, with those strengths.
    pub r2: f64,
    /// Squared error on each patch with the fit to the others, as a share of the squared forces of all.
    pub of_patch: Vec<f64>,
    /// Patches without which no fit was found: there the law keeps the shape with which it starts.
    pub failed_patches: usize,
    /// Share of the squared forces that is foretold on patches not seen: 1 − Σ error² / Σ force². Below zero it is worse than no muscle.
    pub held_out_r2: f64,
    /// 95 % interval of it, from drawing patches with replacement.
    pub interval: [f64; 2],
}

/// All laws on one field.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Samples used: those within 30 mm of a fibre.
    pub samples: usize,
    /// Patches left out in turn.
    pub patches: usize,
    /// Root mean square force, N.
    pub rms_n: f64,
    /// The laws in their order.
    pub standings: Vec<Standing>,
    /// Share of the squared forces that lies on each patch.
    of_patch: Vec<f64>,
}

/// A difference with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Its value.
    pub value: f64,
    /// Lower and upper end.
    pub interval: [f64; 2],
}

impl Difference {
    /// Whether the interval leaves zero out.
    pub fn is_sure(&self) -> bool {
        self.interval[0] > 0.0 || self.interval[1] < 0.0
    }
}

/// Fits every law to the samples near the fibres, once to all of them and once without each patch, and judges it on the patch
/// ([`crate::fit::held_out`]). None without enough samples.
pub fn compare(fibres: &[Fibre], samples: &[Sample], compare: Compare) -> Option<Comparison> {
    let near = |s: &&Sample| fibres.iter().any(|f| f.distance_mm(&s.position) < REACH_MM);
    let samples: Vec<Sample> = samples.iter().filter(near).copied().collect();
    let patches = Patches::new(fibres, &samples, PATCH_RADIUS_MM);
    if patches.len() < 3 || samples.iter().all(|s| s.force == Vector3::zeros()) {
        return None;
    }
    let options = LawFitOptions { compare, ..LawFitOptions::default() };
    let wholes = patches.wholes(&samples, compare, fibres);
    let standing = |contender: Contender| {
        let held_out = patches.law(&contender.start, fibres, &samples, &options)?;
        let [held_out_r2, low, high] = resampled(&wholes, |k| wholes[k] - held_out.shares[k]);
        let fit = fit_law(&contender.start, fibres, &samples, &options);
        let found = Pulling::from_fit(&contender.start, fit.as_ref().ok(), fibres, &samples, &options);
        Some(Standing {
            name: contender.name,
            ranked: contender.ranked,
            r2: 1.0 - found.unexplained(fibres, &samples, compare),
            law: found.law,
            strengths_n: found.strengths.iter().copied().collect(),
            fit: fit.map_err(|failed| failed.why.to_string()),
            failed_patches: held_out.failed,
            of_patch: held_out.shares,
            held_out_r2,
            interval: [low, high],
        })
    };
    let standings = contenders().into_iter().map(standing).collect::<Option<Vec<_>>>()?;
    let rms_n = (samples.iter().map(|s| shown(s, compare).norm_squared()).sum::<f64>() / samples.len() as f64).sqrt();
    Some(Comparison { samples: samples.len(), patches: patches.len(), rms_n, standings, of_patch: wholes })
}

/// What of a force is compared.
fn shown(sample: &Sample, compare: Compare) -> Vector3<f64> {
    match compare {
        Compare::Tangential => sample.force - sample.normal * sample.normal.dot(&sample.force),
        _ => sample.force,
    }
}

impl Comparison {
    /// The law of the four that foretells most, by index; none where none foretells half a percent.
    pub fn best(&self) -> Option<usize> {
        let foretells = |k: &usize| self.standings[*k].ranked && self.standings[*k].held_out_r2 >= NOTHING;
        (0..self.standings.len())
            .filter(foretells)
            .max_by(|&a, &b| self.standings[a].held_out_r2.total_cmp(&self.standings[b].held_out_r2))
    }

    /// How much more of the force law `a` foretells than law `b`, both on the same patches.
    pub fn difference(&self, a: usize, b: usize) -> Difference {
        let (a, b) = (&self.standings[a].of_patch, &self.standings[b].of_patch);
        let [value, low, high] = resampled(&self.of_patch, |k| b[k] - a[k]);
        Difference { value, interval: [low, high] }
    }
}

/// Σ part / Σ whole over patches, and its 95 % interval over patches drawn with replacement (percentiles; Efron 1979). The seed is
/// fixed: the same field has the same interval.
fn resampled(whole: &[f64], part: impl Fn(usize) -> f64) -> [f64; 3] {
    let n = whole.len();
    let share = |picked: &mut dyn Iterator<Item = usize>| {
        let (up, down) = picked.fold((0.0, 0.0), |(up, down), k| (up + part(k), down + whole[k]));
        if down > 0.0 { up / down } else { 0.0 }
    };
    let value = share(&mut (0..n));
    let mut random = Pcg64::seed_from_u64(0x6c61_7773);
    let mut drawn: Vec<f64> = (0..RESAMPLINGS).map(|_| share(&mut (0..n).map(|_| random.random_range(0..n)))).collect();
    drawn.sort_unstable_by(f64::total_cmp);
    [value, drawn[RESAMPLINGS / 40], drawn[RESAMPLINGS - 1 - RESAMPLINGS / 40]]
}

/// Mean of a value over fields, with the 95 % interval of Student's t: the fields differ more than any one is uncertain.
pub fn over_fields(values: &[f64]) -> Option<Difference> {
    let n = values.len() as f64;
    if values.len() < 2 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    let reach = crate::fit::student::two_sided_95(Some(values.len() - 1)) * (variance / n).sqrt();
    Some(Difference { value: mean, interval: [mean - reach, mean + reach] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::LawKind;
    use crate::study::activation_trial::fibres_and_samples;

    /// A field that a law made is foretold by that law on patches it did not see, and by it best.
    #[test]
    fn the_law_that_made_a_field_wins_on_it() {
        let face = crate::face::generic();
        let (fibres, samples) = fibres_and_samples(&face).unwrap();
        let fibres = &fibres[..4];
        for (truth, kind) in [LawKind::Koch, LawKind::Anatomical].into_iter().enumerate() {
            let law = MuscleLaw::default_of(kind);
            let mut random = Pcg64::seed_from_u64(truth as u64);
            let field: Vec<Sample> = samples
                .iter()
                .map(|s| {
                    let force: Vector3<f64> = fibres.iter().map(|f| law.force(f, &s.position)).sum();
                    let error = Vector3::from_fn(|_, _| 0.02 * random.random_range(-1.0..1.0));
                    Sample { force: force + error, ..*s }
                })
                .collect();
            let found = compare(fibres, &field, Compare::Vectors).unwrap();
            let best = found.best().unwrap();
            assert_eq!(found.standings[best].name, kind.label());
            assert!(found.standings[best].held_out_r2 > 0.98, "{:?}", found.standings[best].held_out_r2);
            for other in (0..4).filter(|&k| k != best) {
                let margin = found.difference(best, other);
                assert!(margin.value > 0.0 && margin.is_sure(), "{margin:?}");
            }
        }
    }

    /// Forces without any order are foretold by no law: none is named.
    #[test]
    fn where_no_law_foretells_anything_none_is_best() {
        let face = crate::face::generic();
        let (fibres, samples) = fibres_and_samples(&face).unwrap();
        let mut random = Pcg64::seed_from_u64(9);
        let mut any = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        let field: Vec<Sample> = samples.iter().map(|s| Sample { force: any(), ..*s }).collect();
        let found = compare(&fibres[..4], &field, Compare::Vectors).unwrap();
        assert!(found.standings.iter().all(|s| s.held_out_r2 < NOTHING));
        assert_eq!(found.best(), None);
    }

    /// By hand: patches of squares 1, 1, 2 with errors 0.5, 0.5, 1: half is foretold whatever is drawn.
    #[test]
    fn equal_shares_have_no_spread() {
        let [value, low, high] = resampled(&[1.0, 1.0, 2.0], |k| [0.5, 0.5, 1.0][k]);
        assert!((value - 0.5).abs() < 1e-12 && (low - 0.5).abs() < 1e-12 && (high - 0.5).abs() < 1e-12);
        // Mean 2, standard deviation 1, t of 2 degrees 4.303: 2 ± 4.303/√3.
        let over = over_fields(&[1.0, 2.0, 3.0]).unwrap();
        assert!((over.value - 2.0).abs() < 1e-12 && (over.interval[1] - 2.0 - 4.303 / 3.0_f64.sqrt()).abs() < 1e-3);
        assert!(!over.is_sure() && over_fields(&[1.0]).is_none());
    }
}
