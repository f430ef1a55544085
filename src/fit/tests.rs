//! Fits of fields whose law is known, fits that must fail, and slopes against differences.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::law_model::Model;
use super::levenberg_marquardt::{LeastSquares, LevenbergMarquardtSettings};
use super::*;
use crate::forces::Cause;
use crate::muscle::{Anatomical, Direction, Fibre, LawKind, Lobe, MuscleLaw, Reading, WatersLinear};

/// Two fibres side by side on a curved forehead, 50 mm long.
fn fibres() -> Vec<Fibre> {
    let one = |x: f64| {
        let (a, i) = (Point3::new(1.2 * x, 60.0, -4.0), Point3::new(x, 10.0, 0.0));
        let normals = [Vector3::new(0.01 * x, 0.3, 1.0), Vector3::new(0.01 * x, 0.0, 1.0)];
        Fibre::new(a, i, 12.0, Some(0.5), normals.map(|n| n.normalize())).unwrap()
    };
    vec![one(-14.0), one(16.0)]
}

/// Samples of a law on a grid of 7 mm, with every normal towards the camera. The second lobe's strengths come after the fibres'.
fn field_of(law: &MuscleLaw, strengths: &[f64]) -> Vec<Sample> {
    let fibres = fibres();
    let mut samples = Vec::new();
    for i in -6..=6 {
        for j in -3..=9 {
            // Off any line of symmetry, and never on a fibre.
            let position = Point3::new(7.0 * f64::from(i) + 0.4, 7.0 * f64::from(j) + 0.7, -0.02 * f64::from(i * i));
            let of =
                |(at, s): (usize, &f64)| law.lobe_force(at / fibres.len(), &fibres[at % fibres.len()], &position) * *s;
            let force = strengths.iter().enumerate().map(of).sum();
            samples.push(Sample { position, force, sigma: 0.0, normal: Vector3::z() });
        }
    }
    samples
}

fn noisy(samples: &[Sample], sigma: f64, seed: u64) -> Vec<Sample> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    // Twelve uniform numbers have variance 1.
    let mut normal = move || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    let each = sigma / 3f64.sqrt();
    samples.iter().map(|s| Sample { force: s.force + Vector3::from_fn(|_, _| normal()) * each, sigma, ..*s }).collect()
}

/// Away from a default, by factors between 0.7 and 1.4 of the free part.
fn moved(law: &MuscleLaw) -> MuscleLaw {
    let shift = [1.4, 0.7, 1.3, 0.75, 0.9];
    let values: Vec<f64> =
        law.parameters().iter().zip(shift).map(|(p, f)| p.origin + (p.value - p.origin) * f).collect();
    law.with_parameters(&values).unwrap()
}

#[track_caller]
fn recovered(fit: &LawFit, law: &MuscleLaw, strengths: &[f64]) {
    for (found, truth) in fit.parameters.iter().zip(law.parameters()) {
        if truth.smooth {
            assert!(
                (found.value - truth.value).abs() < 1e-6 * truth.value,
                "{}: {found:?} is not {}",
                fit.label,
                truth.value
            );
        } else {
            assert!(
                found.low <= truth.value && truth.value <= found.high,
                "{}: {found:?} not about {}",
                fit.label,
                truth.value
            );
        }
    }
    for (found, truth) in fit.strengths.iter().zip(strengths) {
        assert!((found.value - truth).abs() < 1e-6 * truth.abs(), "{}: {found:?} is not {truth}", fit.label);
    }
    assert!(fit.r2 > 1.0 - 1e-10, "{}", fit.r2);
}

#[test]
fn every_law_is_found_again_without_noise() {
    for kind in LawKind::ALL {
        for law in MuscleLaw::default_of(kind).variants() {
            let samples = field_of(&law, &[0.8, 1.1]);
            for eliminate in [true, false] {
                let settings = LevenbergMarquardtSettings::default();
                let method = Method::LevenbergMarquardt { settings, eliminate };
                let options = LawFitOptions { method, ..LawFitOptions::default() };
                let fit = fit_law(&moved(&law), &fibres(), &samples, &options).unwrap();
                assert_eq!(fit.law.label(), law.label(), "the reading is found too");
                recovered(&fit, &law, &[0.8, 1.1]);
            }
        }
    }
}

#[test]
fn lobes_are_found_again_and_stay_out_of_fields_without() {
    let options = LawFitOptions::default();
    for lobe in [Lobe::AtAttachment, Lobe::At(0.8)] {
        let law = MuscleLaw::default_of(LawKind::Anatomical).with_lobe(Some(lobe)).unwrap();
        let samples = field_of(&law, &[0.8, 1.1, -0.3, -0.5]);
        let fit = fit_law(&law, &fibres(), &samples, &options).unwrap();
        recovered(&fit, &law, &[0.8, 1.1, -0.3, -0.5]);
        let plain = fit_law(&law.with_lobe(None).unwrap(), &fibres(), &samples, &options).unwrap();
        assert!(fit.bic < plain.bic && fit.unknowns > plain.unknowns);
    }
    // Without a lobe in the field it does not earn its two strengths.
    let plain = MuscleLaw::default_of(LawKind::Anatomical);
    let samples = noisy(&field_of(&plain, &[0.8, 1.1]), 0.05, 3);
    let without = fit_law(&plain, &fibres(), &samples, &options).unwrap();
    let with = fit_law(&plain.with_lobe(Some(Lobe::AtAttachment)).unwrap(), &fibres(), &samples, &options).unwrap();
    assert!(with.weighted_ss <= without.weighted_ss && with.bic > without.bic);
}

#[test]
fn every_way_to_compare_finds_the_law() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let samples = field_of(&law, &[0.8, 1.1]);
    for compare in [Compare::Vectors, Compare::Tangential, Compare::Along, Compare::Magnitudes] {
        let options = LawFitOptions { compare, ..LawFitOptions::default() };
        let fit = fit_law(&moved(&law), &fibres(), &samples, &options).unwrap();
        recovered(&fit, &law, &[0.8, 1.1]);
        let rows = match compare {
            Compare::Vectors => 3,
            Compare::Tangential => 2,
            _ => 1,
        };
        assert_eq!(fit.rows, rows * samples.len());
    }
    let options = LawFitOptions { strengths: Strengths::Shared, ..LawFitOptions::default() };
    let fit = fit_law(&moved(&law), &fibres(), &field_of(&law, &[0.9, 0.9]), &options).unwrap();
    recovered(&fit, &law, &[0.9]);
    assert_eq!(fit.strengths.len(), 1);
}

#[test]
fn nelder_and_mead_come_near() {
    let law = MuscleLaw::default_of(LawKind::Koch);
    let samples = field_of(&law, &[0.8, 1.1]);
    let tight = Method::NelderMead { settings: nelder_mead::NelderMeadSettings::tight(), eliminate: true };
    let fit = fit_law(&moved(&law), &fibres(), &samples, &LawFitOptions { method: tight, ..LawFitOptions::default() })
        .unwrap();
    recovered(&fit, &law, &[0.8, 1.1]);
    let thesis = LawFitOptions { method: Method::thesis(), starts: 1, ..LawFitOptions::default() };
    let fit = fit_law(&moved(&law), &fibres(), &samples, &thesis).unwrap();
    assert!(fit.r2 > 0.999 && fit.r2 < 1.0 - 1e-12, "fminsearch's tolerances end early: {}", fit.r2);
}

#[test]
fn strengths_alone_are_linear_least_squares_by_hand() {
    // One fibre, its law held, weights 1/σ: s = Σ w θ y / Σ w θ², on three samples along the fibre.
    let law = MuscleLaw::default_of(LawKind::WatersSheet);
    let fibre = Fibre::new(Point3::new(0., 40., 0.), Point3::origin(), 5.0, None, [Vector3::z(); 2]).unwrap();
    // θ at λ = 1, ½ and 1/3, n = 1: 1, cos 45° = 0.70711, cos 60° = 0.5. σ² = 1, 1, 4, y = 2.1, 1.3, 1.2:
    // s = (2.1 + 0.70711 · 1.3 + 0.5 · 1.2 / 4) / (1 + 0.5 + 0.25 / 4) = 3.169239 / 1.5625 = 2.028313.
    let sample = |y: f64, force: f64, sigma: f64| Sample {
        position: Point3::new(0.0, y, 0.0),
        force: Vector3::new(0.0, force, 0.0),
        sigma,
        normal: Vector3::z(),
    };
    let samples = [sample(0.0, 2.1, 1.0), sample(20.0, 1.3, 1.0), sample(40.0 * 2.0 / 3.0, 1.2, 2.0)];
    let options = LawFitOptions { compare: Compare::Along, ..LawFitOptions::default() }.with_shape_held(&law);
    let fit = fit_law(&law, std::slice::from_ref(&fibre), &samples, &options).unwrap();
    let s = 3.169_239 / 1.5625;
    assert!((fit.strengths[0].value - s).abs() < 1e-6);
    assert_eq!((fit.rows, fit.unknowns), (3, 2)); // the strength and the variance
    // Residuals 0.0717, −0.1342, 0.1858; Σ w r² = 0.00514 + 0.01802 + 0.00863 = 0.03179, variance half of it,
    // standard error √(0.015896 / 1.5625) = 0.10086, times t(2) = 4.302653. A component's σ is σ/√3, which cancels here.
    let half = 4.302_653 * 0.100_86;
    assert!((fit.strengths[0].high - s - half).abs() < 1e-3, "{:?}", fit.strengths);
    assert!((fit.strengths[0].low - s + half).abs() < 1e-3);
    // With the errors taken as they are: 1.959964 √(1/3 / 1.5625) = 0.90530.
    let given = LawFitOptions { noise: Noise::Given, ..options };
    let fit = fit_law(&law, &[fibre], &samples, &given).unwrap();
    assert!((fit.strengths[0].high - s - 0.905_30).abs() < 1e-4, "{:?}", fit.strengths);
    // Σ w y² = 4.41 + 1.69 + 0.36 = 6.46: R² = 1 − 0.03179 / 6.46.
    assert!((fit.r2 - (1.0 - 0.031_79 / 6.46)).abs() < 1e-5);
}

#[test]
fn intervals_hold_the_truth_and_shrink_with_the_noise() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let clean = field_of(&law, &[0.8, 1.1]);
    let (mut held, mut asked) = (0, 0);
    let mut widths = Vec::new();
    for sigma in [0.02, 0.08] {
        let mut width = 0.0;
        for seed in 0..40 {
            let samples = noisy(&clean, sigma, seed + (1e4 * sigma) as u64);
            let fit = fit_law(
                &law,
                &fibres(),
                &samples,
                &LawFitOptions { starts: 1, variants: false, ..LawFitOptions::default() },
            );
            let fit = fit.unwrap();
            for (e, truth) in fit.parameters.iter().zip(law.parameters()) {
                asked += 1;
                held += usize::from(e.low <= truth.value && truth.value <= e.high);
                width += (e.high / e.low).ln();
            }
            for (s, truth) in fit.strengths.iter().zip([0.8, 1.1]) {
                asked += 1;
                held += usize::from(s.low <= truth && truth <= s.high);
            }
            assert!((fit.reduced_chi2.unwrap() - 1.0).abs() < 0.25);
        }
        widths.push(width);
    }
    // 480 intervals, not independent of each other: 95 % ± 4 %.
    assert!((0.91..=0.99).contains(&(f64::from(held as u32) / f64::from(asked))), "{held} of {asked}");
    assert!((widths[1] / widths[0] - 4.0).abs() < 0.4, "{widths:?}");
}

/// Errors of one cause each: what goes together with nothing is independent, and the sum over the causes is the unit matrix.
#[test]
fn causes_of_one_component_each_are_independent_errors() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let sigma = 0.05;
    let samples = noisy(&field_of(&law, &[0.8, 1.1]), sigma, 3);
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * (sigma / 3f64.sqrt()));
    let causes: Vec<Cause> = (0..samples.len() as u32).flat_map(|i| axes.map(|e| vec![(i, e)])).collect();
    let options = LawFitOptions { starts: 1, variants: false, noise: Noise::Given, ..LawFitOptions::default() };
    let alone = fit_law(&law, &fibres(), &samples, &options).unwrap();
    let with = fit_law_with(&law, &fibres(), &samples, &causes, &options).unwrap();
    assert!(with.together && !alone.together);
    for (a, b) in with.parameters.iter().zip(&alone.parameters) {
        assert!((a.low - b.low).abs() < 1e-9 * b.value && (a.high - b.high).abs() < 1e-9 * b.value, "{a:?} {b:?}");
    }
    for (a, b) in with.strengths.iter().zip(&alone.strengths) {
        assert!((a.low - b.low).abs() < 1e-9 && (a.high - b.high).abs() < 1e-9, "{a:?} {b:?}");
    }
    assert!((with.correlation[0][1] - alone.correlation[0][1]).abs() < 1e-9);
    // Lengths are compared along each force.
    let lengths = LawFitOptions { compare: Compare::Magnitudes, ..options };
    let alone = fit_law(&law, &fibres(), &samples, &lengths).unwrap();
    let with = fit_law_with(&law, &fibres(), &samples, &causes, &lengths).unwrap();
    for (a, b) in with.parameters.iter().zip(&alone.parameters) {
        assert!((a.low - b.low).abs() < 1e-9 * b.value, "{a:?} {b:?}");
    }
}

/// Bumps of error 12 mm wide, 14 mm apart: forces of neighbours err together, as where one mark pulls at all of them.
fn bumps(samples: &[Sample], sigma: f64) -> (Vec<Cause>, Vec<Sample>) {
    let at = |k: i32| f64::from(k) * 14.0;
    let centres = (-4..=4).flat_map(|i| (-3..=6).map(move |j| Point3::new(at(i), at(j), 0.0)));
    let bump = |centre: Point3<f64>, axis: usize| -> Cause {
        let size = |s: &Sample| sigma * (-(s.position - centre).xy().norm_squared() / 288.0).exp();
        (0..).zip(samples).map(|(i, s)| (i, Vector3::ith(axis, size(s)))).collect()
    };
    let causes: Vec<Cause> = centres.flat_map(|centre| [0, 1, 2].map(|axis| bump(centre, axis))).collect();
    let mut squares = vec![0.0; samples.len()];
    for (i, e) in causes.iter().flatten() {
        squares[*i as usize] += e.norm_squared();
    }
    let known = samples.iter().zip(squares).map(|(s, square)| Sample { sigma: square.sqrt(), ..*s });
    (causes, known.collect())
}

fn drawn(samples: &[Sample], causes: &[Cause], seed: u64) -> Vec<Sample> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut found = samples.to_vec();
    for cause in causes {
        let times: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
        for (i, e) in cause {
            found[*i as usize].force += e * times;
        }
    }
    found
}

/// A thousand draws of errors that go together: intervals that know it hold the truth in about 95 % of them, others
/// mostly far less often.
#[test]
fn intervals_know_how_errors_go_together() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let (causes, clean) = bumps(&field_of(&law, &[0.8, 1.1]), 0.01);
    let held = |known: &[Cause], noise: Noise, seed: u64| -> Vec<bool> {
        let options = LawFitOptions { starts: 1, variants: false, noise, ..LawFitOptions::default() };
        let fit = fit_law_with(&law, &fibres(), &drawn(&clean, &causes, seed), known, &options).unwrap();
        let shape = fit.parameters.iter().zip(law.parameters()).map(|(e, t)| e.low <= t.value && t.value <= e.high);
        shape.chain(fit.strengths.iter().zip([0.8, 1.1]).map(|(s, t)| s.low <= t && t <= s.high)).collect()
    };
    let share = |known: &[Cause], noise: Noise| {
        let mut count = Vec::new();
        for seed in 0..1000 {
            let held = held(known, noise, seed);
            count.resize(held.len(), 0);
            count.iter_mut().zip(held).for_each(|(n, held)| *n += u32::from(held));
        }
        count.iter().map(|n| f64::from(*n) / 1000.0).collect::<Vec<f64>>()
    };
    let given = share(&causes, Noise::Given);
    // A thousand draws scatter by 0.7 points.
    assert!(given.iter().all(|s| (0.93..=0.975).contains(s)), "{given:?}");
    // By default they grow where by chance more is left than expected, and never shrink: a little too long.
    let estimated = share(&causes, Noise::Estimated);
    assert!(estimated.iter().all(|s| (0.94..=0.985).contains(s)), "{estimated:?}");
    let without = share(&[], Noise::Given);
    assert!(without.iter().filter(|s| **s < 0.8).count() >= 4, "{without:?}");
}

#[test]
fn what_the_data_cannot_tell_is_named() {
    // A window so narrow that its width is only an amplitude: normalised, it tells next to nothing.
    let law = MuscleLaw::Anatomical(Anatomical { sr: 6.0, wr: 0.05, ..Anatomical::default() });
    let samples = noisy(&field_of(&law, &[0.8, 1.1]), 0.05, 1);
    let options = LawFitOptions { variants: false, ..LawFitOptions::default() };
    let fit = fit_law(&law, &fibres(), &samples, &options).unwrap();
    let wr = &fit.parameters[1];
    assert!(!wr.identified, "{wr:?}");
    assert!(fit.parameters[2].identified && fit.parameters[3].identified);
    let named = fit.weak.iter().any(|d| d.parts.iter().any(|(name, _)| *name == "wr"));
    assert!(named || wr.at_bound, "{:?}", fit.weak);
    // A fibre that no sample reaches has no strength.
    let mut three = fibres();
    let far = Point3::new(0.0, -500.0, 0.0);
    three.push(Fibre::new(far, far + Vector3::y() * 40.0, 5.0, None, [Vector3::z(); 2]).unwrap());
    let law = MuscleLaw::default_of(LawKind::Koch);
    let fit = fit_law(&law, &three, &field_of(&law, &[0.8, 1.1]), &options).unwrap();
    assert!(!fit.strengths[2].supported && fit.strengths[1].supported);
    assert_eq!(fit.strengths[2].value, 0.0);
}

#[test]
fn a_fit_that_cannot_be_is_no_fit() {
    let law = MuscleLaw::default_of(LawKind::Koch);
    let samples = field_of(&law, &[0.8, 1.1]);
    let options = LawFitOptions::default();
    let why = |fibres: &[Fibre], samples: &[Sample]| fit_law(&law, fibres, samples, &options).unwrap_err().why;
    assert_eq!(why(&fibres(), &[]), NoFit::Field(FieldError::NoSamples));
    assert_eq!(why(&[], &samples), NoFit::Field(FieldError::NoFibres));
    assert_eq!(why(&fibres(), &samples[60..61]), NoFit::TooFew { rows: 3, unknowns: 4 });
    let mut bad = samples.clone();
    bad[7].force.x = f64::NAN;
    assert_eq!(why(&fibres(), &bad), NoFit::Field(FieldError::NotFinite { sample: 7 }));
    let still: Vec<Sample> = samples.iter().map(|s| Sample { force: Vector3::zeros(), ..*s }).collect();
    assert_eq!(why(&fibres(), &still), NoFit::Field(FieldError::NoForce));
    // Nothing within reach: every sample far behind both attachments.
    let behind: Vec<Sample> =
        samples.iter().map(|s| Sample { position: s.position + Vector3::y() * 300.0, ..*s }).collect();
    assert_eq!(why(&fibres(), &behind), NoFit::OutOfReach);
    // Out of patience: said so, start by start.
    let settings = LevenbergMarquardtSettings { evaluations: 2, ..LevenbergMarquardtSettings::default() };
    let hasty = LawFitOptions { method: Method::LevenbergMarquardt { settings, eliminate: true }, ..options.clone() };
    let failed = fit_law(&moved(&law), &fibres(), &samples, &hasty).unwrap_err();
    let NoFit::NoMinimum { starts } = &failed.why else { panic!("{failed}") };
    assert!(starts.iter().all(|s| !s.ended.converged()) && starts.len() == options.starts);
    assert!(serde_json::to_string(&failed).unwrap().contains("no_minimum"));
}

#[test]
fn a_law_of_one_face_is_tried_on_samples_it_has_not_seen() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let samples = field_of(&law, &[0.8, 1.1]);
    let (seen, unseen): (Vec<_>, Vec<_>) = samples.iter().enumerate().partition(|(i, _)| i % 3 != 0);
    let take = |v: Vec<(usize, &Sample)>| v.into_iter().map(|(_, s)| *s).collect::<Vec<_>>();
    let (seen, unseen) = (take(seen), take(unseen));
    for compare in [Compare::Vectors, Compare::Tangential, Compare::Along, Compare::Magnitudes] {
        let fit = fit_law(&law, &fibres(), &seen, &LawFitOptions { compare, ..LawFitOptions::default() }).unwrap();
        let misfit = fit.misfit(&fibres(), &unseen).unwrap();
        assert!(misfit.r2() > 1.0 - 1e-10 && misfit.rms < 1e-6 && misfit.samples == unseen.len());
        // On what it was fitted to, the misfit is the fit's own.
        let noisy = noisy(&seen, 0.05, 1);
        let fit = fit_law(&law, &fibres(), &noisy, &LawFitOptions { compare, ..LawFitOptions::default() }).unwrap();
        let own = fit.misfit(&fibres(), &noisy).unwrap();
        assert!((own.r2() - fit.r2).abs() < 1e-9 && (own.rms - fit.rms).abs() < 1e-9 * fit.rms, "{compare:?}");
    }
}

#[test]
fn the_other_readings_are_named() {
    let law = MuscleLaw::Anatomical(Anatomical { reading: Reading::UpToInsertion, ..Anatomical::default() });
    let samples = noisy(&field_of(&law, &[0.8, 1.1]), 0.03, 5);
    let fit =
        fit_law(&MuscleLaw::default_of(LawKind::Anatomical), &fibres(), &samples, &LawFitOptions::default()).unwrap();
    assert_eq!(fit.label, "Anatomical (B)");
    assert_eq!(fit.others[0].label, "Anatomical (A)");
    assert!(fit.others[0].r2.unwrap() < fit.r2);
    let text = serde_json::to_string(&fit).unwrap();
    assert!(text.contains("\"bic\"") && text.contains("value_N"));
}

#[test]
fn slopes_of_the_cost_agree_with_differences() {
    let laws = [
        MuscleLaw::default_of(LawKind::Koch),
        MuscleLaw::WatersLinear(WatersLinear { direction: Direction::Convergent, ..WatersLinear::default() }),
        MuscleLaw::default_of(LawKind::Anatomical).with_lobe(Some(Lobe::At(0.8))).unwrap(),
    ];
    for law in laws {
        let samples = noisy(&field_of(&law, &vec![0.7; 2 * law.lobes()]), 0.1, 2);
        for compare in [Compare::Vectors, Compare::Tangential, Compare::Along, Compare::Magnitudes] {
            for (eliminate, strengths) in
                [(true, Strengths::EachFibre), (false, Strengths::EachFibre), (false, Strengths::Shared)]
            {
                let field = Field::new(&fibres(), &samples, compare).unwrap();
                let mut model = Model::new(&field, &law, strengths, &[], eliminate);
                let values: Vec<f64> = moved(&law).parameters().iter().map(|p| p.value).collect();
                let u = model.start(&values);
                let n = u.len();
                let (mut jtj, mut jtr) = (vec![0.0; n * n], vec![0.0; n]);
                model.cost(&u);
                model.linearise(&mut jtj, &mut jtr);
                for i in 0..n {
                    let mut cost = |by: f64| {
                        let mut u = u.clone();
                        u[i] += by;
                        model.cost(&u)
                    };
                    let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
                    // The cost is Σ r², its slope −2 Jᵀr.
                    assert!(
                        (slope + 2.0 * jtr[i]).abs() < 1e-4 * (slope.abs() + 1.0),
                        "{} {compare:?} {strengths:?} eliminated {eliminate}, unknown {i}: {slope} and {}",
                        law.label(),
                        -2.0 * jtr[i]
                    );
                }
            }
        }
    }
}

#[test]
fn kaufman_s_matrix_is_the_schur_complement_of_the_whole() {
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let samples = noisy(&field_of(&law, &[0.7, 0.9]), 0.1, 2);
    let field = Field::new(&fibres(), &samples, Compare::Vectors).unwrap();
    let values: Vec<f64> = moved(&law).parameters().iter().map(|p| p.value).collect();
    let mut model = Model::new(&field, &law, Strengths::EachFibre, &[], true);
    let u = model.start(&values);
    model.cost(&u);
    let whole = nalgebra::DMatrix::from_row_slice(6, 6, model.normal().0);
    let mut jtj = vec![0.0; 16];
    model.linearise(&mut jtj, &mut [0.0; 4]);
    let inverse = whole.view((4, 4), (2, 2)).into_owned().try_inverse().unwrap();
    let mixed = whole.view((0, 4), (4, 2)).into_owned();
    let schur = whole.view((0, 0), (4, 4)).into_owned() - &mixed * inverse * mixed.transpose();
    let jtj = nalgebra::DMatrix::from_row_slice(4, 4, &jtj);
    assert!((jtj - &schur).norm() < 1e-10 * schur.norm());
}

#[test]
fn the_law_that_made_a_field_wins_the_comparison() {
    let options = LawFitOptions::default();
    for (at, law) in comparison::candidates().iter().enumerate() {
        let strengths: Vec<f64> = [0.8, 1.1, -0.4, -0.5][..2 * law.lobes()].to_vec();
        let samples = noisy(&field_of(law, &strengths), 0.1, 4);
        let comparison = compare_laws(&fibres(), &samples, &options).unwrap();
        assert_eq!(comparison.best, Some(at), "{}", law.label());
        assert_eq!(comparison.fits.len(), 5);
        if at >= 3 {
            assert_eq!(comparison.lobe_gain.unwrap() > 0.0, at == 4, "{}", law.label());
        }
    }
    assert_eq!(compare_laws(&fibres(), &[], &options), Err(FieldError::NoSamples));
}
