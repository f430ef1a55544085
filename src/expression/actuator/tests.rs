//! Actuators of the generic face and of others: strengths, places, symmetry, and what is said when something is missing.

use super::*;
use crate::expression::{Basic, Expression};
use crate::face;
use crate::muscle::LawKind;
use crate::simulate::Cylinder;

fn of(face: &FaceModel, kind: LawKind, in_surface: InSurface) -> Actuators {
    let settings = ActuatorSettings { in_surface, ..ActuatorSettings::default() };
    Actuators::of(face, face.mesh().positions(), &MuscleLaw::default_of(kind), settings).unwrap()
}

fn generic() -> Actuators {
    of(&face::generic(), LawKind::Anatomical, InSurface::default())
}

#[test]
fn lengths_of_loads_sum_to_the_strength_under_every_law_and_construction() {
    let face = face::generic();
    let cylinder = Cylinder::about(face.mesh().positions()).unwrap();
    let normals = face.mesh().vertex_normals(face.mesh().positions());
    for kind in LawKind::ALL {
        for in_surface in [InSurface::Tangent, InSurface::TangentLengthKept, InSurface::Unrolled(cylinder)] {
            for a in of(&face, kind, in_surface).all {
                let sum: f64 = a.loads.iter().map(|(_, f)| f.norm()).sum();
                assert!((sum - a.strength_n).abs() < 1e-9, "{kind:?} {} {sum} {}", a.id, a.strength_n);
                let across = |(v, f): &(u32, Vector3<f64>)| f.dot(&normals[*v as usize]).abs();
                let plain = !matches!(in_surface, InSurface::Unrolled(_));
                assert!(!plain || a.loads.iter().map(across).fold(0.0, f64::max) < 1e-9, "{}", a.id);
            }
        }
    }
}

#[test]
fn a_brow_is_raised_by_3_4_newton_a_side_shared_by_width_on_any_choice_of_muscles() {
    let face = face::generic();
    let raise = |a: &Actuators, side| -> f64 {
        let of_brow = |x: &&Actuator| x.side == Some(side) && [1, 2].contains(&x.action_unit);
        a.all.iter().filter(of_brow).map(|x| x.strength_n).sum()
    };
    let (own, waters) =
        (generic(), of(&face.with_preset("waters").unwrap(), LawKind::WatersLinear, InSurface::Tangent));
    for side in [Side::Left, Side::Right] {
        assert!((raise(&own, side) - 3.4).abs() < 1e-12 && (raise(&waters, side) - 3.4).abs() < 1e-12);
    }
    // 13 mm and 14 mm of half width: 3.4 · 13/27.
    assert!((own.get("frontalis_medial_left").unwrap().strength_n - 3.4 * 13.0 / 27.0).abs() < 1e-12);
}

#[test]
fn the_face_is_the_same_on_both_sides() {
    let face = face::generic();
    let actuators = generic();
    for a in actuators.all.iter().filter(|a| a.side == Some(Side::Left)) {
        let right = actuators.get(&a.id.replace("_left", "_right")).unwrap();
        assert_eq!(a.loads.len(), right.loads.len(), "{}", a.id);
        for (v, f) in &a.loads {
            let across = face.mirror()[*v as usize].unwrap();
            let (_, g) = right.loads.iter().find(|(w, _)| *w == across).unwrap();
            assert!((Vector3::new(-f.x, f.y, f.z) - g).norm() < 1e-9, "{} {v}", a.id);
        }
    }
}

#[test]
fn extras_are_added_where_they_lack_and_only_there() {
    let face = face::generic();
    let actuators = generic();
    let count = |a: &Actuators, kind| a.all.iter().filter(|a| a.kind == kind).count();
    // 18 muscles of the face and 4 pairs; two rings an eye and the mouth's; two lids.
    assert_eq!(
        (count(&actuators, Kind::Fibre), count(&actuators, Kind::Sphincter), count(&actuators, Kind::Lid)),
        (26, 5, 2)
    );
    assert!(actuators.notes.is_empty() && actuators.all.iter().all(|a| !a.loads.is_empty() && a.note.is_none()));
    let mut parts = face.to_parts();
    let own = Muscle { id: "mentalis_left".to_owned(), ..face.muscles()[0].clone() };
    parts.muscles.push(own);
    let with = FaceModel::new(face.mesh().clone(), parts).unwrap();
    assert_eq!(count(&of(&with, LawKind::Anatomical, InSurface::default()), Kind::Fibre), 26);
}

#[test]
fn each_pulls_where_its_action_unit_says() {
    let face = face::generic();
    let actuators = generic();
    let net = |id: &str| -> Vector3<f64> { actuators.get(id).unwrap().loads.iter().map(|(_, f)| f).sum() };
    // Brow up; brow in and down; corner up and out; corner down; corner out; chin up; lid up; nose up.
    assert!(net("frontalis_medial_left").y > 1.0 && net("levator_palpebrae_left").y > 0.3);
    assert!(net("corrugator_left").x < -0.5 && net("corrugator_left").y < -0.2);
    assert!(net("zygomaticus_major_left").x > 0.3 && net("zygomaticus_major_left").y > 0.5);
    assert!(net("depressor_anguli_oris_left").y < -0.5 && net("risorius_left").x > 0.5);
    assert!(net("mentalis_left").y > 0.2 && net("levator_alae_nasi_left").y > 0.5);
    // The cheek is raised towards the eye.
    let cheek = actuators.get("orbicularis_oculi_orbital_left").unwrap();
    let below = |(v, _): &&(u32, Vector3<f64>)| face.mesh().positions()[*v as usize].y < -10.0;
    assert!(cheek.loads.iter().filter(below).map(|(_, f)| f.y).sum::<f64>() > 0.3);
    // The lips are drawn together, and the corners in.
    let lips = actuators.get("orbicularis_oris").unwrap();
    let at = |id: &str| {
        let vertex = face.landmark(id).unwrap().vertex;
        lips.loads.iter().find(|(v, _)| *v == vertex).unwrap().1
    };
    assert!(at("lower_lip").y > 0.0 && at("upper_lip").y < 0.0 && at("mouth_corner_left").x < 0.0);
}

#[test]
fn missing_landmarks_and_places_are_said_in_one_line() {
    let face = face::generic();
    let mut parts = face.to_parts();
    parts.landmarks.retain(|l| l.id != "chin");
    let without = FaceModel::new(face.mesh().clone(), parts).unwrap();
    let law = MuscleLaw::default_of(LawKind::Koch);
    let refused = |face: &FaceModel, places: usize| {
        let rest = &face.mesh().positions()[..places];
        Actuators::of(face, rest, &law, ActuatorSettings::default()).unwrap_err().to_string()
    };
    let text = refused(&without, 612);
    assert!(text.contains("chin") && !text.contains('\n') && !text.contains("nose_tip"), "{text}");
    assert_eq!(refused(&face, 611), "there are 611 places for the 612 vertices of the face");
}

#[test]
fn a_fitted_strength_becomes_an_activation_that_pulls_as_much() {
    let face = face::generic();
    let actuators = generic();
    let a = actuators.get("zygomaticus_major_left").unwrap();
    let muscle = face.muscles().iter().find(|m| m.id == a.id).unwrap();
    let normals = face.mesh().vertex_normals(face.mesh().positions());
    let fibre = Fibre::of(muscle, face.mesh().positions(), &normals).unwrap();
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let t = a.activation_of_law_strength(0.05);
    let (v, f) = a.loads.iter().find(|(v, _)| *v == muscle.insertion).unwrap();
    let n = normals[*v as usize];
    let expected = law.force(&fibre, &face.mesh().positions()[*v as usize]) * 0.05;
    assert!((f * t - (expected - n * expected.dot(&n))).norm() < 1e-12);
}

#[test]
fn loads_are_linear_and_unknown_names_are_listed() {
    let actuators = generic();
    let mut smile = Expression::basic(Basic::Happy, &actuators);
    let one = actuators.loads(&smile);
    for a in smile.activations.values_mut() {
        *a *= 2.0;
    }
    smile.activations.insert("auricularis_left".to_owned(), 1.0);
    let two = actuators.loads(&smile);
    assert_eq!((one.unknown.len(), two.unknown.as_slice()), (0, &["auricularis_left".to_owned()][..]));
    assert!(one.newton.iter().zip(&two.newton).all(|(a, b)| (a * 2.0 - b).norm() < 1e-12));
}

#[test]
fn the_rim_and_the_corners_of_the_eyes_are_held_and_nothing_else() {
    let face = face::generic();
    let actuators = generic();
    // 40 vertices on the rim of the generic face, 4 corners.
    assert_eq!(actuators.held.iter().filter(|h| **h).count(), 44);
    assert!(actuators.held[face.landmark("chin").unwrap().vertex as usize]);
    assert!(!actuators.held[face.landmark("mouth_corner_left").unwrap().vertex as usize]);
}
