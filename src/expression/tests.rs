//! The six expressions on the generic face, brought to rest: displacements in the ranges measured on people.

use nalgebra::Point3;

use super::*;
use crate::face;
use crate::muscle::{LawKind, MuscleLaw};
use crate::simulate::{Ended, EquilibriumSolver, Jaw, System, SystemOptions};

/// Places at rest under an expression, which must be an equilibrium without a triangle turned over.
fn settled(actuators: &Actuators, expression: &Expression) -> Vec<Point3<f64>> {
    let face = face::generic();
    let mesh = face.mesh();
    let jaw: Jaw = actuators.jaw.clone();
    let mut system = System::new(mesh, mesh.positions(), &actuators.held, Some(jaw), SystemOptions::default()).unwrap();
    system.open_jaw(expression.jaw_deg.to_radians());
    system.set_loads(actuators.loads(expression).newton).unwrap();
    let rest = EquilibriumSolver::new(&system).unwrap().solve(&system, &system.carried());
    assert!(rest.ended == Ended::Converged && rest.folded.is_empty(), "{} {rest:?}", expression.name);
    rest.positions
}

fn moved(positions: &[Point3<f64>], landmark: &str) -> nalgebra::Vector3<f64> {
    let face = face::generic();
    let v = face.landmark(landmark).unwrap().vertex as usize;
    positions[v] - face.mesh().positions()[v]
}

fn generic(kind: LawKind) -> Actuators {
    let face = face::generic();
    let law = MuscleLaw::default_of(kind);
    Actuators::of(&face, face.mesh().positions(), &law, ActuatorSettings::default()).unwrap()
}

/// Brow 7.57 to 10.57 mm (Souza Cruz 2004; Vicon, 12 people), mouth corner in a smile 9.28 ± 2.83 mm (same).
#[test]
fn a_raised_brow_and_a_smile_move_as_far_as_people_s_do() {
    let actuators = generic(LawKind::Anatomical);
    let brow_raise = [Dose { action_unit: 1, activation: 1.0 }, Dose { action_unit: 2, activation: 1.0 }];
    let raised = settled(&actuators, &Expression::of_action_units("Brow raise", &brow_raise, &actuators));
    let surprised = settled(&actuators, &Expression::basic(Basic::Surprise, &actuators));
    for brow in
        [moved(&raised, "brow_inner_left"), moved(&raised, "brow_mid_left"), moved(&surprised, "brow_mid_right")]
    {
        assert!((7.57..=10.57).contains(&brow.norm()) && brow.y > 0.0, "{brow}");
    }
    let smile = moved(&settled(&actuators, &Expression::basic(Basic::Happy, &actuators)), "mouth_corner_left");
    assert!((smile.norm() - 9.28).abs() < 2.83 && smile.y > 0.0 && smile.x > 0.0, "{smile}");
}

/// What each expression is named by, in the direction in which it goes.
#[test]
fn each_expression_moves_what_it_is_named_by_under_every_law() {
    for kind in LawKind::ALL {
        let actuators = generic(kind);
        let of = |basic| settled(&actuators, &Expression::basic(basic, &actuators));
        let up = |p: &[Point3<f64>], id| moved(p, id).y;
        let [surprise, happy, sad, anger, disgust, fear] = Basic::ALL.map(of);
        assert!(up(&surprise, "brow_mid_left") > 4.0 && up(&surprise, "lower_lip") < -15.0);
        assert!(up(&happy, "mouth_corner_left") - up(&happy, "lower_lip") > 4.0);
        assert!(up(&sad, "mouth_corner_left") < -4.0 && up(&sad, "brow_inner_left") > up(&sad, "brow_mid_left") + 1.0);
        assert!(up(&anger, "brow_inner_left") < -4.0 && moved(&anger, "brow_inner_left").x < -1.0);
        assert!(up(&disgust, "nose_wing_left") > 3.0 && up(&disgust, "upper_lip") > 3.0);
        assert!(up(&fear, "eye_top_left") > 3.0 && moved(&fear, "mouth_corner_left").x > 4.0);
    }
}
