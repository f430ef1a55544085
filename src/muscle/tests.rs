//! Every law against numbers worked out by hand, at its limits, and its slopes against central differences.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::*;

/// A fibre along y whose insertion is the origin, in flat skin; the zone is 45°.
fn along_y(length: f64, half_width: f64) -> Fibre {
    let attachment = Point3::new(0.0, length, 0.0);
    Fibre::new(attachment, Point3::origin(), half_width, Some(FRAC_PI_4), [Vector3::z(); 2]).unwrap()
}

fn value(law: MuscleLaw, fibre: &Fibre, x: [f64; 3]) -> f64 {
    law.force(fibre, &Point3::from(x)).norm()
}

#[track_caller]
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

fn waters(reach: f64) -> MuscleLaw {
    MuscleLaw::WatersLinear(WatersLinear { reach, zone: 1.0, direction: Direction::Parallel })
}

fn sheet(n: f64, delta: f64) -> MuscleLaw {
    MuscleLaw::WatersSheet(WatersSheet { n, delta, half_width: 1.0 })
}

fn koch(k: f64, width: f64) -> MuscleLaw {
    MuscleLaw::Koch(Koch { k, width })
}

fn tanh_law(sr: f64, wr: f64, sa: f64, wa: f64) -> Anatomical {
    Anatomical { sr, wr, sa, wa, raw: true, ..Anatomical::default() }
}

#[test]
fn a_fibre_without_length_width_side_or_number_is_refused() {
    let (a, i) = (Point3::new(0.0, 1.0, 0.0), Point3::origin());
    let z = Vector3::z();
    assert_eq!(Fibre::new(a, a, 1.0, None, [z; 2]), Err(FibreError::NoLength));
    assert_eq!(Fibre::new(a, i, 0.0, None, [z; 2]), Err(FibreError::NoWidth { half_width_mm: 0.0 }));
    assert_eq!(Fibre::new(a, i, 1.0, None, [z, -z]), Err(FibreError::OpposedNormals));
    assert_eq!(Fibre::new(a, i, f64::NAN, None, [z; 2]), Err(FibreError::NotFinite));
    assert_eq!(Fibre::new(a, i, 1.0, Some(2.0), [z; 2]), Err(FibreError::Zone { zone_half_angle: 2.0 }));
    // Twice the half width at the insertion: tan φ = 2 · 0.5 / 1.
    near(Fibre::new(a, i, 0.5, None, [z; 2]).unwrap().zone_half_angle, FRAC_PI_4, 1e-15);
}

#[test]
fn normals_are_added_and_as_printed_they_would_lie_along_the_fibre() {
    // Normals leaning 14° apart along a fibre on y, as on a forehead: (0, ∓sin 14°, cos 14°).
    let (s, c) = 14f64.to_radians().sin_cos();
    let normals = [Vector3::new(0.0, s, c), Vector3::new(0.0, -s, c)];
    let fibre = Fibre::new(Point3::new(0.0, 3.0, 0.0), Point3::origin(), 1.0, None, normals).unwrap();
    near((fibre.normal - Vector3::z()).norm(), 0.0, 1e-15);
    let printed = (normals[0] - normals[1]).normalize();
    near((printed - Vector3::y()).norm(), 0.0, 1e-15);
}

#[test]
fn a_place_beside_a_fibre_by_hand_and_as_printed() {
    // A = (0, 3, 0), x = (0.2, 1.5, 0): ρ = 1.5, p = (0.2, −1.5, 0) + 1.5 ŷ = (0.2, 0, 0), ω = 0.2, ε of (3.15) = 0.5, γ = 0.2 / 3.
    let fibre = along_y(3.0, 1.0);
    let x = Point3::new(0.2, 1.5, 0.0);
    let place = fibre.place(&x);
    near(place.along, 0.5, 1e-15);
    near(place.across, 0.2 / 3.0, 1e-15);
    near(place.lateral, 0.2, 1e-15);
    near(place.reach, (0.04f64 + 2.25).sqrt() / 3.0, 1e-15);
    near(place.cos_angle, 1.5 / (0.04f64 + 2.25).sqrt(), 1e-15);
    // (3.13) as printed: p = (0.2, −1.5, 0) − 1.5 ŷ = (0.2, −3, 0), ω = 3.007.
    let printed = (x - fibre.attachment) - fibre.pull() * 1.5;
    near(printed.norm(), 3.006_659, 1e-6);
    // (5.7)'s ‖xa‖ sin θ is (5.1)'s ω.
    let sine = (1.0 - place.cos_angle * place.cos_angle).sqrt();
    near(place.reach * sine, place.across, 1e-15);
    // Above the skin by 0.3: (3.14) takes the normal part away, (5.1) does not.
    let above = fibre.place(&Point3::new(0.2, 1.5, 0.3));
    near(above.lateral, 0.2, 1e-15);
    near(above.across, 0.13f64.sqrt() / 3.0, 1e-15);
    near(fibre.distance_mm(&Point3::new(3.0, 7.0, 0.0)), 5.0, 1e-15); // 3 beside, 4 beyond the attachment
}

#[test]
fn the_unit_of_length_does_not_matter_as_it_would_in_print() {
    // Fibre of 30 mm, vertex 28 mm along it: ε of (5.6) = (28 − 30)/30 = −0.0667 in every unit.
    // As printed, ‖m‖ is 1 by (3.10): 27 in mm, 1.8 in cm, −0.972 in m.
    for (unit, printed) in [(1.0, 27.0), (0.1, 1.8), (0.001, -0.972)] {
        let fibre = along_y(30.0 * unit, 5.0 * unit);
        let place = fibre.place(&Point3::new(0.0, 2.0 * unit, 0.0));
        near(place.along - 1.0, -2.0 / 30.0, 1e-12);
        near((28.0 * unit - 1.0) / 1.0, printed, 1e-12);
    }
}

#[test]
fn waters_linear_by_hand() {
    // ‖m‖ = 2, φ = 45°. On the axis, 1.5 from A: θ_a = 1, θ_r = cos(0.25 · 90°) = 0.92388.
    let fibre = along_y(2.0, 1.0);
    near(value(waters(1.5), &fibre, [0.0, 0.5, 0.0]), 0.923_879_532_5, 1e-10);
    // As printed (3.2) multiplies by the distance: cos β = (2 · 1.5 / 2) · 1.5 = 2.25, θ_a = (2.25 − 0.7071) / 0.2929 = 5.27.
    near((2.25 - FRAC_1_SQRT_2) / (1.0 - FRAC_1_SQRT_2), 5.267_767, 1e-6);
    // At distance 2 and β = 30°: θ_r = 1, θ_a = (0.86603 − 0.70711) / 0.29289 = 0.54258.
    let at = |beta: f64, d: f64| [d * beta.sin(), 2.0 - d * beta.cos(), 0.0];
    near(value(waters(1.5), &fibre, at(PI / 6.0, 2.0)), 0.542_582_1, 1e-7);
    // Beyond the insertion, half way to r_max = 3: cos(45°).
    near(value(waters(1.5), &fibre, at(0.0, 2.5)), FRAC_1_SQRT_2, 1e-12);
    // Limits: insertion, attachment, behind it, outside the zone, beyond r_max.
    near(value(waters(1.5), &fibre, [0.0; 3]), 1.0, 1e-15);
    for x in [[0.0, 2.0, 0.0], [0.0, 2.5, 0.0], at(0.8, 1.0), at(0.0, 3.001)] {
        assert_eq!(value(waters(1.5), &fibre, x), 0.0, "{x:?}");
    }
    // Towards the attachment: from (1, 1, 0) along (−1, 1, 0)/√2; θ_a just inside 45°.
    let convergent = MuscleLaw::WatersLinear(WatersLinear { zone: 1.5, direction: Direction::Convergent, reach: 1.5 });
    let force = convergent.force(&fibre, &Point3::new(1.0, 1.0, 0.0));
    near((force.normalize() - Vector3::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0)).norm(), 0.0, 1e-12);
    assert_eq!(convergent.force(&fibre, &fibre.attachment), Vector3::zeros());
}

#[test]
fn waters_sheet_by_hand() {
    // ‖m‖ = 6, W/2 = 1. λ = 0.25, n = 1: cos(90° · 0.75) = 0.38268.
    let fibre = along_y(6.0, 1.0);
    near(value(sheet(1.0, 1.5), &fibre, [0.9, 4.5, 0.0]), 0.382_683_432_4, 1e-10);
    // n = 2 and λ = 0.5: λⁿ = 0.25 again.
    near(value(sheet(2.0, 1.5), &fibre, [0.0, 3.0, 0.0]), 0.382_683_432_4, 1e-10);
    // n = 2, δ = 2, λ = √2.5: (2.5 − 1)/(4 − 1) = ½, cos 45°.
    near(value(sheet(2.0, 2.0), &fibre, [0.0, 6.0 - 6.0 * 2.5f64.sqrt(), 0.0]), FRAC_1_SQRT_2, 1e-12);
    // Limits: insertion; attachment, 1.5 behind it (as printed |λ| = 0.25 would give 0.38), beyond δ, 5 to the side (as printed 1).
    near(value(sheet(1.0, 1.5), &fibre, [0.0; 3]), 1.0, 1e-15);
    for x in [[0.0, 6.0, 0.0], [0.0, 7.5, 0.0], [0.0, -3.01, 0.0], [5.0, 0.0, 0.0]] {
        assert_eq!(value(sheet(1.0, 1.5), &fibre, x), 0.0, "{x:?}");
    }
    near((FRAC_PI_2 * (1.0 - 1.5 / 6.0)).cos(), 0.382_683_432_4, 1e-10);
}

#[test]
fn koch_by_hand() {
    let fibre = along_y(3.0, 1.0);
    // ε = 0.5, K = 1, on the fibre: sin 45° + (sin 90° + 1)/8 = 0.70711 + 0.25.
    near(value(koch(1.0, 2.0), &fibre, [0.0, 1.5, 0.0]), FRAC_1_SQRT_2 + 0.25, 1e-12);
    // The same with γ = 1/2: γ^1.8 = 0.287175, ½ (cos(0.287175 π) + 1) = 0.809948.
    near(value(koch(1.0, 2.0), &fibre, [1.0, 1.5, 0.0]) / (FRAC_1_SQRT_2 + 0.25), 0.809_948, 1e-6);
    // K = 2: ε = √0.5 has the same q.
    near(value(koch(2.0, 2.0), &fibre, [0.0, 3.0 - 3.0 * FRAC_1_SQRT_2, 0.0]), FRAC_1_SQRT_2 + 0.25, 1e-12);
    // 1 at the insertion, more at q = 0.69 on this side and 1.31 beyond: a local minimum.
    near(value(koch(1.0, 2.0), &fibre, [0.0; 3]), 1.0, 1e-12);
    for q in [0.69, 1.31] {
        near(value(koch(1.0, 2.0), &fibre, [0.0, 3.0 - 3.0 * q, 0.0]), 1.054_9, 1e-3);
    }
    // Limits: attachment, behind it (no number for K = 1.5 as printed), q = 2 and 3 (−1 as printed), γ = 1.
    for x in [[0.0, 3.0, 0.0], [0.0, 4.0, 0.0], [0.0, -3.0, 0.0], [0.0, -6.0, 0.0], [2.0, 0.0, 0.0]] {
        assert_eq!(value(koch(1.0, 2.0), &fibre, x), 0.0, "{x:?}");
    }
    let printed = |q: f64| (FRAC_PI_2 * q).sin() + ((2.0 * PI * q - FRAC_PI_2).sin() + 1.0) / 8.0;
    near(printed(1.0), 1.0, 1e-12);
    near(printed(2.0), 0.0, 1e-12);
    near(printed(3.0), -1.0, 1e-12);
    assert!((-0.3f64).powf(1.5).is_nan());
}

#[test]
fn anatomical_by_hand() {
    let fibre = along_y(2.0, 1.0);
    let law = tanh_law(6.0, 0.5, 5.0, 0.6);
    let raw = MuscleLaw::Anatomical(law);
    let normalised = MuscleLaw::Anatomical(Anatomical { raw: false, ..law });
    // At the insertion: tanh(1.5)² = 0.90515² raw, 1 normalised.
    near(value(raw, &fibre, [0.0; 3]), 0.905_148_25f64.powi(2), 1e-8);
    near(value(normalised, &fibre, [0.0; 3]), 1.0, 1e-15);
    // ε = ±0.25 on the fibre: ½ (tanh 3 − tanh 0) = 0.497527 on both sides of the insertion.
    for y in [0.5, -0.5] {
        near(value(raw, &fibre, [0.0, y, 0.0]), 0.497_527_4 * 0.905_148_25, 1e-7);
    }
    // ε = −0.3, γ = 0.2: ½ (tanh(−0.3) + tanh 3.3) · ½ (tanh 2.5 + tanh 0.5).
    let (radial, lateral) = (0.5 * (3.3f64.tanh() - 0.3f64.tanh()), 0.5 * (2.5f64.tanh() + 0.5f64.tanh()));
    near(value(raw, &fibre, [0.4, 0.6, 0.0]), radial * lateral, 1e-14);
    near(value(normalised, &fibre, [0.4, 0.6, 0.0]), radial * lateral / 1.5f64.tanh().powi(2), 1e-14);
    // A jump at the attachment when the window is wide: ½ (tanh(−1) + tanh 3) = 0.117 for (2, 1), and 0 behind.
    let wide = MuscleLaw::Anatomical(tanh_law(2.0, 1.0, 5.0, 6.0));
    let lateral = 15f64.tanh();
    near(value(wide, &fibre, [0.0, 2.0 - 1e-9, 0.0]), 0.116_730_2 * lateral, 1e-6);
    assert_eq!(value(wide, &fibre, [0.0, 2.0, 0.0]), 0.0);
    assert_eq!(value(wide, &fibre, [0.0, 2.1, 0.0]), 0.0);
    // Reading B: nothing beyond the insertion, the same up to it.
    let b = MuscleLaw::Anatomical(Anatomical { reading: Reading::UpToInsertion, ..law });
    near(value(b, &fibre, [0.0, 0.5, 0.0]), value(raw, &fibre, [0.0, 0.5, 0.0]), 0.0);
    near(value(b, &fibre, [0.0; 3]), value(raw, &fibre, [0.0; 3]), 0.0);
    assert_eq!(value(b, &fibre, [0.0, -0.01, 0.0]), 0.0);
    // At both ends of what is accepted: a box, 1 inside and 0 outside, and ½ at its edge; never 0/0.
    let boxed = MuscleLaw::Anatomical(tanh_law(500.0, 6.0, 500.0, 6.0));
    for (x, v) in [([0.0, 0.0, 0.0], 1.0), ([5.9, -5.9, 0.0], 1.0), ([6.1, 0.0, 0.0], 0.0), ([6.0, 0.0, 0.0], 0.5)] {
        near(value(boxed, &fibre, x), v, 1e-12);
    }
    // Far to the side, and so steep that e^(A − B) would overflow.
    assert_eq!(value(MuscleLaw::Anatomical(tanh_law(200.0, 0.5, 200.0, 0.6)), &fibre, [9.0, 0.0, 0.0]), 0.0);
}

#[test]
fn as_printed_the_anatomical_muscle_is_switched_off() {
    // (5.3) asks for ε > 1, but by (5.6) the whole fibre has −1 ≤ ε ≤ 0: nothing of it pulls. At ε = 1.1 the window has fallen to 2e−5.
    let fibre = along_y(2.0, 1.0);
    let law = MuscleLaw::Anatomical(tanh_law(6.0, 0.5, 5.0, 0.6));
    let sum = |from: f64, to: f64| {
        let steps = (0..100).map(|i| from + (to - from) * (f64::from(i) + 0.5) / 100.0);
        steps.map(|epsilon| value(law, &fibre, [0.0, -2.0 * epsilon, 0.0])).sum::<f64>()
    };
    assert!(sum(-1.0, 1.0) > 20.0);
    assert!(sum(1.0, 3.0) < 1e-3);
}

#[test]
fn the_second_lobe_is_the_first_one_moved() {
    let fibre = along_y(2.0, 1.0);
    let plain = MuscleLaw::Anatomical(Anatomical::default());
    let two = plain.with_lobe(Some(Lobe::AtAttachment)).unwrap();
    assert_eq!((plain.lobes(), two.lobes(), two.parameters().len()), (1, 2, 4));
    for x in [[0.1, 1.8, 0.0], [0.3, 2.3, 0.1]] {
        // The attachment is 2 further up than the insertion.
        let moved = Point3::new(x[0], x[1] - 2.0, x[2]);
        let lobe = two.lobe_force(1, &fibre, &Point3::from(x));
        near((lobe - plain.force(&fibre, &moved)).norm(), 0.0, 1e-14);
    }
    let anywhere = plain.with_lobe(Some(Lobe::At(0.5))).unwrap();
    near(anywhere.lobe_force(1, &fibre, &Point3::new(0.0, 1.0, 0.0)).norm(), 1.0, 1e-14);
    assert_eq!(plain.lobe_force(1, &fibre, &Point3::origin()), Vector3::zeros());
    assert!(MuscleLaw::default_of(LawKind::Koch).with_lobe(Some(Lobe::AtAttachment)).is_none());
}

#[test]
fn parameters_out_of_range_are_refused_and_named() {
    let law = MuscleLaw::default_of(LawKind::WatersLinear);
    assert_eq!(law.with_parameters(&[1.6, 2.0]).unwrap().parameters()[1].value, 2.0);
    let error = law.with_parameters(&[1.0, 1.0]).unwrap_err();
    assert_eq!(error.to_string(), "reach = 1 is outside 1.01 to 6");
    assert!(law.with_parameters(&[f64::NAN, 1.0]).is_err());
    let error = law.with_parameters(&[1.5]).unwrap_err();
    assert_eq!(error.to_string(), "Waters linear has 2 shape parameters, not 1");
    for kind in LawKind::ALL {
        let law = MuscleLaw::default_of(kind);
        let values: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
        assert_eq!(law.with_parameters(&values).unwrap(), law);
        let text = serde_json::to_string(&law).unwrap();
        assert_eq!(serde_json::from_str::<MuscleLaw>(&text).unwrap(), law);
    }
}

#[test]
fn a_muscle_of_a_face_becomes_a_fibre() {
    let face = crate::face::generic();
    let positions = face.mesh().positions();
    let normals = face.mesh().vertex_normals(positions);
    for muscle in face.muscles() {
        let fibre = Fibre::of(muscle, positions, &normals).unwrap();
        let ends = positions[muscle.attachment as usize] - positions[muscle.insertion as usize];
        near(fibre.length_mm(), ends.norm(), 1e-12);
        near(fibre.pull().dot(&ends), ends.norm(), 1e-12);
        for kind in LawKind::ALL {
            near((MuscleLaw::default_of(kind).force(&fibre, &fibre.insertion) - fibre.pull()).norm(), 0.0, 1e-12);
        }
    }
    let far = crate::face::Muscle { insertion: 9_999, ..face.muscles()[0].clone() };
    assert!(matches!(Fibre::of(&far, positions, &normals), Err(FibreError::Unbound { vertex: 9_999, .. })));
}

/// Every law in every variant, with and without lobes, for given shape parameters between 0 and 1 that are spread over a wide range.
fn laws(u: &[f64]) -> Vec<MuscleLaw> {
    let mut all = Vec::new();
    for kind in LawKind::ALL {
        for variant in MuscleLaw::default_of(kind).variants() {
            all.push(variant);
            for lobe in [Lobe::AtAttachment, Lobe::At(0.8)] {
                all.extend(variant.with_lobe(Some(lobe)));
            }
            if let MuscleLaw::Anatomical(law) = variant {
                all.push(MuscleLaw::Anatomical(Anatomical { raw: true, ..law }));
            }
        }
    }
    let shaped = all.iter().map(|law| {
        let spread = |(p, u): (&Parameter, &f64)| p.origin + (p.value - p.origin) * (2.5 * (u - 0.5)).exp();
        let values: Vec<f64> = law.parameters().iter().zip(u).map(spread).collect();
        law.with_parameters(&values).unwrap()
    });
    shaped.collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn slopes_agree_with_central_differences(
        u in proptest::collection::vec(0.0..1.0f64, MAX_PARAMETERS),
        x in proptest::array::uniform3(-1.0..1.0f64),
    ) {
        let normals = [Vector3::new(0.1, 0.2, 1.0), Vector3::new(-0.2, 0.1, 1.0)];
        let fibre = Fibre::new(Point3::new(2.0, 48.0, 3.0), Point3::new(0.0, 2.0, 0.0), 12.0, Some(0.6), normals).unwrap();
        let x = Point3::new(x[0] * 20.0, 20.0 + x[1] * 45.0, x[2] * 4.0);
        let place = fibre.place(&x);
        for law in laws(&u) {
            let parameters = law.parameters();
            for lobe in 0..law.lobes() {
                let at = |values: &[f64]| {
                    let mut by = [0.0; MAX_PARAMETERS];
                    let value = law.at(values).on(&fibre).at(lobe, &place, &mut by);
                    (value, by)
                };
                let values: Vec<f64> = parameters.iter().map(|p| p.value).collect();
                let (middle, by) = at(&values);
                for (k, parameter) in parameters.iter().enumerate() {
                    let step = 1e-6 * (parameter.value - parameter.origin);
                    let moved = |by: f64| {
                        let mut moved = values.clone();
                        moved[k] += by;
                        at(&moved).0
                    };
                    let (less, more) = (moved(-step), moved(step));
                    let slope = (more - less) / (2.0 * step);
                    // Beside a kink the one-sided slopes differ; there is no slope to agree with.
                    let kink = ((more - middle) - (middle - less)).abs() / step;
                    let size = 1.0 + slope.abs();
                    if kink < 1e-3 * size {
                        prop_assert!(
                            (by[k] - slope).abs() < 1e-4 * size,
                            "{} {}: {} and {slope} at {place:?}", law.label(), parameter.name, by[k]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn force_and_derivatives_are_the_shape_times_the_direction(x in proptest::array::uniform3(-1.0..1.0f64)) {
        let fibre = along_y(2.0, 1.0);
        let x = Point3::new(x[0], 1.0 + 2.0 * x[1], 0.2 * x[2]);
        for law in laws(&[0.5; MAX_PARAMETERS]) {
            let mut by = [Vector3::zeros(); MAX_PARAMETERS];
            let force = law.force_and_derivatives(&fibre, &x, &mut by);
            prop_assert_eq!(force, law.force(&fibre, &x));
            let mut slopes = [0.0; MAX_PARAMETERS];
            law.on(&fibre).at(0, &fibre.place(&x), &mut slopes);
            for (vector, slope) in by.iter().zip(slopes) {
                prop_assert!((vector - law.direction(&fibre, &x) * slope).norm() < 1e-15);
            }
            prop_assert!(force.norm() < 1.06 && law.direction(&fibre, &x).norm() - 1.0 < 1e-12);
        }
    }
}
