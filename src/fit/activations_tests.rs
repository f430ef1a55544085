//! Tests of strengths and their intervals.

use nalgebra::Point3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::fit::{Compare, Sample};

fn sample(force: [f64; 3], sigma: f64) -> Sample {
    Sample { position: Point3::origin(), force: force.into(), sigma, normal: Vector3::z() }
}

fn columns(design: &mut Design, columns: &[&[[f64; 3]]]) {
    for c in columns {
        design.add(c.iter().map(|f| Vector3::from(*f)));
    }
}

/// By hand. Two samples, two muscles: f₁ = (1,0,0) on the first, f₂ = (0,1,0) on the first and (0,1,0) on the second.
/// F = (3,1,0), (0,2,1). Strengths 3 and (1 + 2)/2 = 1.5; residuals (0,−½,0) and (0,½,1), squares ¼ + ¼ + 1 = 1.5, of 15 in all:
/// R² = 0.9. Freedom 6 − 2 = 4, variance 0.375; σ₁ = √0.375, σ₂ = √(0.375/2); t = 2.776 (4 degrees).
#[test]
fn two_muscles_by_hand() {
    let mut design =
        Design::new(&[sample([3.0, 1.0, 0.0], 0.0), sample([0.0, 2.0, 1.0], 0.0)], Compare::Vectors).unwrap();
    columns(&mut design, &[&[[1.0, 0.0, 0.0], [0.0; 3]], &[[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]]);
    let found = activations(&design, None, Noise::Estimated);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-3;
    assert!(close(found.muscles[0].strength_n, 3.0) && close(found.muscles[1].strength_n, 1.5));
    assert!(close(found.r_squared, 0.9) && close(found.misfit, 0.375) && found.freedom == 4);
    assert!(close(found.muscles[0].sigma_n.unwrap(), 0.6124) && close(found.muscles[1].sigma_n.unwrap(), 0.4330));
    assert!(
        close(found.muscles[0].low_n, 3.0 - 2.776 * 0.6124) && close(found.muscles[0].high_n, 3.0 + 2.776 * 0.6124)
    );
    assert!(close(found.residual_n[0], 0.5) && close(found.residual_n[1], 1.25_f64.sqrt()));
    assert!(close(found.residual_rms_n, 0.75_f64.sqrt()));
    // On the first sample they pull (3,0,0) and (0,1.5,0): shares 9/11.25 and 2.25/11.25.
    let shares = found.at_sample(&design, 0);
    assert!(close(shares[0].1.unwrap(), 0.8) && close(shares[1].1.unwrap(), 0.2));
    // Together, as one unit: 4.5 ± 2.776 √(0.375 + 0.1875).
    let unit = found.by_unit(&[12, 12])[0];
    assert!(close(unit.strength_n, 4.5) && close(unit.high_n, 4.5 + 2.776 * 0.75) && unit.unit == 12);
}

/// The same, with standard errors that say 0.3 N a force: 0.3/√3 a component; σ₁ = 0.1732, t = 1.96.
#[test]
fn given_errors_count_as_they_are() {
    let mut design =
        Design::new(&[sample([3.0, 1.0, 0.0], 0.3), sample([0.0, 2.0, 1.0], 0.3)], Compare::Vectors).unwrap();
    columns(&mut design, &[&[[1.0, 0.0, 0.0], [0.0; 3]], &[[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]]);
    let found = activations(&design, None, Noise::Given);
    assert!((found.muscles[0].sigma_n.unwrap() - 0.1732).abs() < 1e-4);
    assert!((found.muscles[0].high_n - 3.0 - 1.96 * 0.1732).abs() < 1e-3);
    // 1.5 / 0.03 / 4.
    assert!((found.misfit - 12.5).abs() < 1e-9 && (found.residual_n[0] - 0.5).abs() < 1e-12);
}

/// What points out of the surface is not compared, and counts as no observation.
#[test]
fn tangential_parts_alone() {
    let samples = [sample([1.0, 0.0, 9.0], 0.1), sample([0.0, 1.0, -4.0], 0.1)];
    let mut design = Design::new(&samples, Compare::Tangential).unwrap();
    columns(&mut design, &[&[[1.0, 0.0, 5.0], [0.0; 3]], &[[0.0; 3], [0.0, 0.5, 0.0]]]);
    assert_eq!(design.observations(), 4);
    let found = activations(&design, None, Noise::Estimated);
    assert!((found.muscles[0].strength_n - 1.0).abs() < 1e-12 && (found.muscles[1].strength_n - 2.0).abs() < 1e-12);
    assert_eq!(Design::new(&samples, Compare::Magnitudes), Err(crate::fit::design::DesignError::NotLinear));
    assert_eq!(Design::new(&[], Compare::Vectors), Err(crate::fit::design::DesignError::NoSamples));
    let bad = [sample([f64::NAN, 0.0, 0.0], 0.1)];
    assert_eq!(Design::new(&bad, Compare::Vectors), Err(crate::fit::design::DesignError::NotFinite { sample: 0 }));
}

/// A muscle that would have to push, one that does the same as another, and one that reaches nothing.
#[test]
fn every_standing_is_named() {
    let samples: Vec<Sample> = (0..30).map(|i| sample([1.0 + 0.01 * f64::from(i % 3), -0.5, 0.0], 0.0)).collect();
    let mut design = Design::new(&samples, Compare::Vectors).unwrap();
    let all = |f: [f64; 3]| vec![f; 30];
    columns(&mut design, &[&all([1.0, 0.0, 0.0]), &all([0.0, 1.0, 0.0]), &all([0.7, 0.0, 0.0]), &all([0.0; 3])]);
    let found = activations(&design, None, Noise::Estimated);
    let standings: Vec<Standing> = found.muscles.iter().map(|m| m.standing).collect();
    let one_of_two = standings[0] == Standing::Active && standings[2] == Standing::Collinear;
    assert!(one_of_two || standings[2] == Standing::Active && standings[0] == Standing::Collinear, "{standings:?}");
    assert_eq!((standings[1], standings[3]), (Standing::AtZero, Standing::Silent));
    assert!(found.muscles[1].high_n > 0.0 && found.muscles[1].high_n < 0.05, "{:?}", found.muscles[1]);
    assert_eq!(found.muscles[3].high_n, f64::INFINITY);
    assert_eq!(found.confusable.len(), 1);
    assert!((found.confusable[0].with[0].1 - 1.0).abs() < 1e-9);
}

/// Two columns with a cosine of 0.98 blur each other: 1/(1 − 0.98²) = 25 times the variance, and the estimates are correlated by −0.98.
#[test]
fn two_much_alike_are_named_with_their_correlation() {
    let across = (1.0_f64 - 0.98 * 0.98).sqrt();
    let samples: Vec<Sample> = (0..10).map(|i| sample([1.98, across, 0.1 * f64::from(i % 2)], 0.0)).collect();
    let mut design = Design::new(&samples, Compare::Vectors).unwrap();
    columns(&mut design, &[&[[1.0, 0.0, 0.0]; 10], &[[0.98, across, 0.0]; 10]]);
    let found = activations(&design, None, Noise::Estimated);
    assert!((found.muscles[0].inflation.unwrap() - 25.25).abs() < 0.01, "{:?}", found.muscles[0]);
    assert_eq!(found.confusable.len(), 2);
    assert!((found.confusable[0].with[0].1 + 0.98).abs() < 1e-9 && found.confusable[0].with[0].0 == 1);
}

/// By hand. One muscle that pulls by 1 on two samples along x; one cause of error puts 0.3 on both, another ±0.1. Its strength is the mean, which
/// the second leaves alone: σ = 0.3. Independent errors of the same size √0.1 would give √(0.1/2) = 0.2236. For a muscle at zero σ is the same.
#[test]
fn errors_that_go_together_count_as_they_do() {
    let e = |a: f64, b: f64| vec![(0, Vector3::new(a, 0.0, 0.0)), (1, Vector3::new(b, 0.0, 0.0))];
    let causes = [e(0.3, 0.3), e(0.1, -0.1)];
    for (force, standing) in [(2.0, Standing::Active), (-0.01, Standing::AtZero)] {
        let samples = [sample([force, 0.0, 0.0], 0.1_f64.sqrt()); 2];
        let mut design = Design::new(&samples, Compare::Vectors).unwrap();
        columns(&mut design, &[&[[1.0, 0.0, 0.0]; 2]]);
        let alone = activations(&design, None, Noise::Given);
        // A component of the error has σ/√3.
        assert!((alone.muscles[0].sigma_n.unwrap() - (0.1_f64 / 6.0).sqrt()).abs() < 1e-9);
        for noise in [Noise::Given, Noise::Estimated] {
            let found = activations(&design.clone().with_causes(&causes), None, noise);
            assert_eq!(found.muscles[0].standing, standing);
            assert!((found.muscles[0].sigma_n.unwrap() - 0.3).abs() < 1e-9, "{:?}", found.muscles[0]);
        }
    }
    // What the causes leave of a residual is that of the second: 2 · 0.1². Ten times that is √10 times the error.
    let samples = [2.0 + 0.1_f64.sqrt(), 2.0 - 0.1_f64.sqrt()].map(|x| sample([x, 0.0, 0.0], 0.1_f64.sqrt()));
    let mut design = Design::new(&samples, Compare::Vectors).unwrap();
    columns(&mut design, &[&[[1.0, 0.0, 0.0]; 2]]);
    let found = activations(&design.with_causes(&causes), None, Noise::Estimated);
    assert!((found.muscles[0].sigma_n.unwrap() - 0.3 * 10.0_f64.sqrt()).abs() < 1e-9, "{:?}", found.muscles[0]);
}

/// 2000 draws of three columns that overlap: the intervals of strengths above zero and the limits of those at zero hold what
/// they promise.
#[test]
fn intervals_cover_the_truth() {
    let mut random = Pcg64::seed_from_u64(11);
    let truth = [1.0, 0.0, 0.4];
    let (mut covered, mut below_limit, mut at_zero) = ([0; 3], 0, 0);
    for _ in 0..2000 {
        let shape = |j: usize, i: usize| if i >= 5 * j && i < 5 * j + 9 { 1.0 } else { 0.0 };
        let samples: Vec<Sample> = (0..20)
            .map(|i| {
                let force: f64 = (0..3).map(|j| truth[j] * shape(j, i)).sum();
                // The sum of twelve uniform numbers, less 6, is as good as normal here.
                let mut normal = || (0..12).map(|_| random.random_range(0.0..1.0_f64)).sum::<f64>() - 6.0;
                sample([force + 0.2 * normal(), 0.2 * normal(), 0.2 * normal()], 0.0)
            })
            .collect();
        let mut design = Design::new(&samples, Compare::Vectors).unwrap();
        for j in 0..3 {
            design.add((0..20).map(|i| Vector3::x() * shape(j, i)));
        }
        let found = activations(&design, None, Noise::Estimated);
        for j in 0..3 {
            covered[j] += u32::from(found.muscles[j].low_n <= truth[j] && truth[j] <= found.muscles[j].high_n);
        }
        if found.muscles[1].standing == Standing::AtZero {
            at_zero += 1;
            // Truths between zero and the limit stay possible; a tenth of a newton is 1.3 standard errors.
            below_limit += usize::from(found.muscles[1].high_n > 0.05);
        }
    }
    let share = covered.map(|c: u32| f64::from(c) / 2000.0);
    assert!(share[0] > 0.93 && share[2] > 0.93, "{share:?}");
    assert!((0.95..1.0).contains(&share[1]), "{share:?}");
    assert!((800..1200).contains(&at_zero) && below_limit == at_zero, "{at_zero} {below_limit}");
}
