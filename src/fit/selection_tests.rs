//! Tests of the search for the fewest muscles, on columns made for them; fields of a face's muscles are tried in `study::activation_trial`.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::fit::{Compare, Sample};

/// A strip of points 5 mm apart; muscle j pulls up on those from `from[j]` to `to[j]`.
fn strip(ranges: &[[usize; 2]], strengths: &[f64], noise: f64, seed: u64) -> (Design, Vec<Point3<f64>>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let points: Vec<Point3<f64>> = (0..120).map(|i| Point3::new(5.0 * f64::from(i), 0.0, 0.0)).collect();
    let pull = |j: usize, i: usize| {
        let inside = i >= ranges[j][0] && i < ranges[j][1];
        if inside { Vector3::y() } else { Vector3::zeros() }
    };
    let samples: Vec<Sample> = points
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let force: Vector3<f64> = strengths.iter().enumerate().map(|(j, s)| pull(j, i) * *s).sum();
            let error = Vector3::from_fn(|_, _| noise * random.random_range(-1.7..1.7));
            Sample { position: *p, force: force + error, sigma: 0.0, normal: Vector3::z() }
        })
        .collect();
    let mut design = Design::new(&samples, Compare::Vectors).unwrap();
    for j in 0..ranges.len() {
        design.add((0..points.len()).map(|i| pull(j, i)));
    }
    (design, points)
}

const RANGES: [[usize; 2]; 6] = [[0, 20], [20, 40], [40, 60], [60, 80], [80, 100], [30, 50]];

#[test]
fn those_that_pull_are_found_strongest_first_and_no_other() {
    for seed in 0..40 {
        let (design, points) = strip(&RANGES, &[0.0, 1.0, 0.0, 2.0, 0.5, 0.0], 0.2, seed);
        let found = smallest_set(&design, &points, &SelectionSettings::default());
        assert_eq!(found.chosen, [1, 3, 4], "seed {seed}: {:?}", found.path);
        assert_eq!(found.path[1].added, Some(3));
        assert!(found.path.len() > 4 || found.stopped == Stopped::NothingLeft);
        assert!(found.path[..=found.taken].windows(2).all(|w| w[1].extended_bic < w[0].extended_bic));
        assert!(found.path[..=found.taken].windows(2).all(|w| w[1].held_out < w[0].held_out));
        assert!((found.activations.muscles[3].strength_n - 2.0).abs() < 0.25);
    }
}

#[test]
fn nothing_pulls_where_there_is_only_noise() {
    let chosen: usize = (0..100)
        .map(|seed| {
            let (design, points) = strip(&RANGES, &[0.0; 6], 0.3, 100 + seed);
            smallest_set(&design, &points, &SelectionSettings::default()).chosen.len()
        })
        .sum();
    assert!(chosen <= 3, "{chosen} of 600");
}

/// A broad muscle looks best at first, and is given up when the two that it stood for are there.
#[test]
fn a_muscle_that_others_make_unnecessary_is_given_up() {
    let ranges = [[20, 40], [40, 60], [18, 62]];
    let (design, points) = strip(&ranges, &[1.0, 1.1, 0.0], 0.2, 3);
    let found = smallest_set(&design, &points, &SelectionSettings::default());
    assert_eq!(found.path[1].added, Some(2));
    assert_eq!((found.chosen.as_slice(), found.pruned.as_slice()), ([0, 1].as_slice(), [2].as_slice()));
}

/// Without noise the residual is rounding; nothing is added to explain that.
#[test]
fn a_field_without_noise_ends_at_its_muscles() {
    let (design, points) = strip(&RANGES, &[0.7, 0.0, 0.0, 0.0, 1.0, 0.4], 0.0, 1);
    let found = smallest_set(&design, &points, &SelectionSettings::default());
    assert_eq!(found.chosen, [0, 4, 5]);
    assert!(found.held_out < 1e-6 && found.activations.r_squared > 1.0 - 1e-12);
}

#[test]
fn no_muscles_and_no_force_are_no_fault() {
    let (design, points) = strip(&[], &[], 0.1, 1);
    assert!(smallest_set(&design, &points, &SelectionSettings::default()).chosen.is_empty());
    let (design, points) = strip(&RANGES, &[0.0; 6], 0.0, 1);
    let found = smallest_set(&design, &points, &SelectionSettings::default());
    assert!(found.chosen.is_empty() && found.held_out == 0.0);
}
