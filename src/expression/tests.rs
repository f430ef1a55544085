//! The six expressions on the generic face, brought to rest: displacements in the ranges measured on people.

use nalgebra::Point3;

use super::*;
use crate::face;
use crate::muscle::LawKind;
use crate::simulate::Ended;

/// Places at rest under an expression, which must be an equilibrium without a triangle turned over.
fn settled(stage: &mut Stage, expression: &Expression) -> Vec<Point3<f64>> {
    let rest = stage.equilibria(std::slice::from_ref(expression)).unwrap().remove(0);
    assert!(rest.ended == Ended::Converged && rest.folded.is_empty(), "{} {rest:?}", expression.name);
    rest.positions
}

fn settled_basic(stage: &mut Stage, basic: Basic) -> Vec<Point3<f64>> {
    let expression = Expression::basic(basic, &stage.actuators);
    settled(stage, &expression)
}

fn moved(positions: &[Point3<f64>], landmark: &str) -> nalgebra::Vector3<f64> {
    let face = face::generic();
    let v = face.landmark(landmark).unwrap().vertex as usize;
    positions[v] - face.mesh().positions()[v]
}

fn generic(law: LawKind, tissues: bool) -> Stage {
    let face = face::generic();
    Stage::new(&face, face.mesh().positions(), &Setup { law, tissues, ..Setup::default() }).unwrap()
}

const BROW_RAISE: [Dose; 2] = [Dose { action_unit: 1, activation: 1.0 }, Dose { action_unit: 2, activation: 1.0 }];

/// Brow 7.57 to 10.57 mm (Souza Cruz 2004; Vicon, 12 people), mouth corner in a smile 9.28 ± 2.83 mm (same).
#[test]
fn a_raised_brow_and_a_smile_move_as_far_as_people_s_do() {
    for tissues in [true, false] {
        let mut stage = generic(LawKind::Anatomical, tissues);
        let raise = Expression::of_action_units("Brow raise", &BROW_RAISE, &stage.actuators);
        let raised = settled(&mut stage, &raise);
        let surprised = settled_basic(&mut stage, Basic::Surprise);
        for brow in
            [moved(&raised, "brow_inner_left"), moved(&raised, "brow_mid_left"), moved(&surprised, "brow_mid_right")]
        {
            assert!((7.57..=10.57).contains(&brow.norm()) && brow.y > 0.0, "{brow}");
        }
        let smile = moved(&settled_basic(&mut stage, Basic::Happy), "mouth_corner_left");
        assert!((smile.norm() - 9.28).abs() < 2.83 && smile.y > 0.0 && smile.x > 0.0, "{smile}");
    }
}

/// What each expression is named by, in the direction in which it goes.
#[test]
fn each_expression_moves_what_it_is_named_by_under_every_law() {
    for (kind, tissues) in LawKind::ALL.into_iter().flat_map(|k| [(k, true), (k, false)]) {
        let mut stage = generic(kind, tissues);
        let [surprise, happy, sad, anger, disgust, fear] = Basic::ALL.map(|basic| settled_basic(&mut stage, basic));
        let up = |p: &[Point3<f64>], id| moved(p, id).y;
        assert!(up(&surprise, "brow_mid_left") > 4.0 && up(&surprise, "lower_lip") < -15.0);
        assert!(up(&happy, "mouth_corner_left") - up(&happy, "lower_lip") > 4.0);
        assert!(up(&sad, "mouth_corner_left") < -4.0 && up(&sad, "brow_inner_left") > up(&sad, "brow_mid_left") + 1.0);
        assert!(up(&anger, "brow_inner_left") < -4.0 && moved(&anger, "brow_inner_left").x < -1.0);
        assert!(up(&disgust, "nose_wing_left") > 3.0 && up(&disgust, "upper_lip") > 3.0);
        assert!(up(&fear, "eye_top_left") > 3.0 && moved(&fear, "mouth_corner_left").x > 4.0);
    }
}

/// On one skin the upper lid follows the brow by more than half of its way, and an open jaw draws the upper lip down almost twice as far.
#[test]
fn lids_and_lips_hold_their_place_better_than_plain_skin() {
    let moved_under = |tissues: bool, doses: &[Dose], jaw_deg: f64, landmark: &str| {
        let mut stage = generic(LawKind::Anatomical, tissues);
        let expression = Expression { jaw_deg, ..Expression::of_action_units("", doses, &stage.actuators) };
        moved(&settled(&mut stage, &expression), landmark).y
    };
    let share = |tissues| {
        moved_under(tissues, &BROW_RAISE, 0.0, "eye_top_left") / moved_under(tissues, &BROW_RAISE, 0.0, "brow_mid_left")
    };
    assert!(share(false) > 0.5 && share(true) < 0.45, "{} {}", share(false), share(true));
    let lip = |tissues| -moved_under(tissues, &[], 16.0, "upper_lip");
    assert!(lip(true) < 0.6 * lip(false), "{} {}", lip(true), lip(false));
}

/// The step's equation, m (v' − v) / Δt = f(x') − m c v' within the surface, is what its iterations solve: what is left of it, in N, while the jaw
/// falls. The skin is begun with where the jaw carries it; left where it was, 0.6 N are left after all iterations.
#[test]
fn skin_on_a_falling_jaw_is_found_within_a_step() {
    let face = face::generic();
    let stage = Stage::new(&face, face.mesh().positions(), &Setup::default()).unwrap();
    let pace = player::Pace { step_s: 0.033, ramp_s: 0.1, ..player::Pace::default() };
    let mut player = Player::new(stage, pace);
    player.want(&Expression { jaw_deg: 20.0, ..Expression::default() });
    let mut most = 0.0_f64;
    for _ in 0..6 {
        let before = player.state().velocities.clone();
        assert!(player.step());
        let system = &player.stage().system;
        let state = player.state();
        let mut forces = Vec::new();
        system.forces(&state.positions, &mut forces);
        for (i, force) in forces.iter().enumerate().filter(|(i, _)| system.free()[*i]) {
            let (v, before) = (state.velocities[i], before[i]);
            let taken = system.inertia[i] * ((v - before) / pace.step_s + v * system.options().damping_per_s);
            most = most.max(system.within(i, &state.positions[i], force - taken).norm());
        }
    }
    assert!(most < 0.01, "{most} N");
}
