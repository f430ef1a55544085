//! Muscles found again from where they took the skin, with errors as stated, and named wrong where they are.

use super::*;
use crate::displacement::regularised::WeightRule;
use crate::expression::{ActuatorSettings, Actuators};
use crate::face::{self, patches::Noise as Draws};
use crate::forces::SkinModel;
use crate::pipeline::{self, Warning, Workspace};
use crate::project::{Feature, FieldWay, Mark};

const WAY: fn(LawKind, Option<u8>) -> FieldWay =
    |law, most| FieldWay::Muscles(MuscleWay { law: Some(law), most, alone: true, ..MuscleWay::default() });

/// A forehead marked where an expression of the anatomical law takes it, the skin a membrane; and the forces that hold it there.
struct Posed {
    face: std::sync::Arc<FaceModel>,
    project: Project,
    pulls: Vec<(String, f64)>,
    force: Vec<Vector3<f64>>,
}

fn posed(pulls: &[(&str, f64)]) -> Posed {
    posed_by(pulls, &face::generic())
}

/// The same by the muscles of another face of this mesh, marked for the generic face.
fn posed_by(pulls: &[(&str, f64)], puller: &FaceModel) -> Posed {
    posed_with(
        pulls,
        puller,
        &MuscleLaw::default_of(LawKind::Anatomical),
        0.0,
        face::generic().region("forehead_and_brows").to_vec(),
    )
}

/// The same with the jaw open, marked on these vertices.
fn posed_with(pulls: &[(&str, f64)], puller: &FaceModel, law: &MuscleLaw, jaw_deg: f64, marked: Vec<u32>) -> Posed {
    let face = face::generic();
    let mut project = Project::default();
    project.settings.skin_model = SkinModel::Membrane;
    project.settings.remove_head_motion = false;
    let before = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
    let all = TractionMesh::new(puller, &before.first).unwrap().actuators(law).unwrap();
    let mut loads = vec![Vector3::zeros(); face.mesh().len()];
    for (id, activation) in pulls {
        let actuator = all.iter().find(|a| a.id == *id).unwrap();
        actuator.add_loads(*activation, &mut loads);
    }
    let held = held_by(&project, &face, &before.first);
    let jaw = jaw_of(&face, &before.first);
    let mut rest = SkinAtRest::new(face.mesh(), &before.first, &held, jaw, &project.settings.skin_spec()).unwrap();
    rest.open_jaw(jaw_deg.to_radians());
    let there = rest.solve(loads, &before.first).unwrap();
    assert_eq!(there.ended, crate::simulate::Ended::Converged);
    let mut force = Vec::new();
    rest.skin().muscle_forces(&there.positions, &vec![true; held.len()], &mut force);
    for v in marked.into_iter().filter(|v| !held[*v as usize]) {
        let at = before.camera.image_from_face(&there.positions[v as usize]);
        let feature = Feature { last: Some(Mark::new([at.x, at.y])), ..Feature::default() };
        project.features.insert(v, feature);
    }
    let pulls = pulls.iter().map(|(id, a)| ((*id).to_owned(), *a)).collect();
    Posed { face, project, pulls, force }
}

fn solve(posed: &Posed, way: FieldWay) -> Outcome {
    let mut project = posed.project.clone();
    project.settings.field = way;
    pipeline::solve(&project, &posed.face, [1036, 1036], &mut Workspace::default())
}

const BROW_RAISE: [(&str, f64); 3] =
    [("frontalis_medial_left", 0.5), ("frontalis_medial_right", 0.4), ("corrugator_left", 0.3)];

#[test]
fn muscles_are_found_again_from_where_they_took_the_skin_and_the_measured_forces_are_kept() {
    let posed = posed(&BROW_RAISE);
    let outcome = solve(&posed, WAY(LawKind::Anatomical, None));
    let found = outcome.muscles.as_ref().unwrap();
    for (id, activation) in &posed.pulls {
        let pulling = found.pulling.iter().find(|p| p.id == *id).unwrap();
        // Being used costs a little: σ² / m of the linear problem, far below a hundredth.
        assert!((pulling.activation - activation).abs() < 0.01, "{pulling:?}");
        assert!(pulling.between[0] <= pulling.activation && pulling.activation <= pulling.between[1]);
    }
    assert!(found.misfit < 0.2 && found.left_px < 0.2 && found.explained > 0.999, "{found:?}");
    let marked: Vec<usize> = posed.project.features.keys().map(|v| *v as usize).collect();
    let off: f64 = marked.iter().map(|&v| (outcome.field.force[v] - posed.force[v]).norm_squared()).sum();
    let all: f64 = marked.iter().map(|&v| posed.force[v].norm_squared()).sum();
    assert!((off / all).sqrt() < 0.03, "{}", (off / all).sqrt());
    // What fits go on from is what the regularised way finds.
    let regularised = solve(&posed, FieldWay::Regularised { weight: WeightRule::default() });
    let samples = |o: &Outcome| pipeline::Samples::of(o, &posed.face, pipeline::samples::Include::Believed);
    assert_eq!(samples(&outcome), samples(&regularised));
    assert!(outcome.measured().0 == regularised.field.force && outcome.field.force != regularised.field.force);
    assert!(!outcome.warnings.iter().any(|w| matches!(w, Warning::MusclesExplainLittle { .. })));
}

/// The anatomical law spreads a pull otherwise than Koch's: the distance that is left tells which it was.
#[test]
fn another_law_leaves_the_points_further_off() {
    let mut posed = posed(&BROW_RAISE);
    posed.project.settings.marking_sigma_px = 0.1;
    let left = |law| solve(&posed, WAY(law, None)).muscles.unwrap();
    let [right, wrong] = [LawKind::Anatomical, LawKind::Koch].map(left);
    assert!(wrong.misfit > 3.0 * right.misfit && wrong.misfit > 2.0, "{} {}", right.misfit, wrong.misfit);
    let said = solve(&posed, WAY(LawKind::Koch, None)).warnings;
    let expected = Warning::MusclesExplainLittle { left_px: wrong.left_px, misfit: wrong.misfit, besides: None };
    assert!(said.contains(&expected), "{said:?}");
    // Asked for none in particular, the one that made the motion is taken.
    let any = FieldWay::Muscles(MuscleWay { alone: true, ..MuscleWay::default() });
    let found = solve(&posed, any).muscles.unwrap();
    assert_eq!(found.law, LawKind::Anatomical);
    // It was looked for from another law's places: the same minimum, to what ends the search.
    assert!((found.misfit - right.misfit).abs() < 0.05 * right.misfit && found.pulling.len() == right.pulling.len());
}

#[test]
fn the_smallest_set_has_no_more_muscles_than_were_asked_for() {
    let posed = posed(&BROW_RAISE);
    let few = solve(&posed, WAY(LawKind::Anatomical, Some(2))).muscles.unwrap();
    assert!(!few.pulling.is_empty() && few.pulling.len() <= 2, "{:?}", few.pulling);
    let all = solve(&posed, WAY(LawKind::Anatomical, Some(u8::MAX))).muscles.unwrap();
    let mut ids: Vec<&str> = all.pulling.iter().map(|p| p.id.as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["corrugator_left", "frontalis_medial_left", "frontalis_medial_right"]);
    assert!(few.left_px > all.left_px);
}

const DRAWS: usize = 40;

/// Marks err by what is stated, 1 px: in the mean over 40 draws the field errs by what it states, and so do the activations.
#[test]
fn standard_errors_are_what_draws_of_the_marks_give() {
    let mut posed = posed(&BROW_RAISE);
    posed.project.settings.marking_sigma_px = 1.0;
    let exact = posed.project.features.clone();
    let marked: Vec<usize> = exact.keys().map(|v| *v as usize).collect();
    let mut draws = Draws(11);
    let (mut squares, mut stated, mut covered, mut asked) = (0.0, 0.0, 0, 0);
    for _ in 0..DRAWS {
        for (v, feature) in &exact {
            let mut mark = feature.last.unwrap();
            mark.at_px = mark.at_px.map(|c| c + draws.normal());
            posed.project.features.get_mut(v).unwrap().last = Some(mark);
        }
        let outcome = solve(&posed, WAY(LawKind::Anatomical, None));
        squares += marked.iter().map(|&v| (outcome.field.force[v] - posed.force[v]).norm_squared()).sum::<f64>();
        // The forces are those of this very mesh, which so misses nothing of them.
        let by_marks = |v: usize| outcome.field.sigma[v].powi(2) - of_mesh(posed.face.mesh(), &outcome.field.force, v);
        stated += marked.iter().map(|&v| by_marks(v)).sum::<f64>();
        for (id, activation) in &posed.pulls {
            let pulling = outcome.muscles.as_ref().unwrap().pulling.iter().find(|p| p.id == *id);
            covered += usize::from(pulling.is_some_and(|p| (p.between[0]..=p.between[1]).contains(activation)));
            asked += 1;
        }
    }
    assert!((0.5..1.5).contains(&(squares / stated)), "{}", squares / stated);
    // 120 intervals of 95 %, a few of them the same muscle's: 114 ± 5.
    assert!(covered * 100 >= asked * 88, "{covered} of {asked}");
}

/// Error of the field on the marked vertices, and the share of them where it lies within its 95 % region: with two components of equal variance σ²/2,
/// |δ|² < 5.99 σ²/2.
fn error_and_coverage(posed: &Posed, outcome: &Outcome) -> (f64, f64) {
    let marked: Vec<usize> = posed.project.features.keys().map(|v| *v as usize).collect();
    let off = |v: usize| (outcome.field.force[v] - posed.force[v]).norm_squared();
    let size: f64 = marked.iter().map(|&v| posed.force[v].norm_squared()).sum();
    let covered = marked.iter().filter(|&&v| off(v) < 5.99 / 2.0 * outcome.field.sigma[v].powi(2)).count();
    let all: f64 = marked.iter().map(|&v| off(v)).sum();
    ((all / size).sqrt(), covered as f64 / marked.len() as f64)
}

/// With marks that err by 0.2 px.
fn marked_within(mut posed: Posed, sigma_px: f64) -> Posed {
    let mut draws = Draws(5);
    posed.project.settings.marking_sigma_px = sigma_px;
    for feature in posed.project.features.values_mut() {
        let mark = feature.last.as_mut().unwrap();
        mark.at_px = mark.at_px.map(|c| c + sigma_px * draws.normal());
    }
    posed
}

/// Koch's law for skin that the anatomical one moved, and then muscles whose ends lie one vertex from where the face has them: with the muscles alone the
/// field is far off and does not know it; pulls besides them take most of that away, and their error bars are true.
#[test]
fn what_the_muscles_leave_is_found_where_the_law_or_their_places_are_wrong() {
    let generic = face::generic();
    let mut parts = generic.to_parts();
    for muscle in &mut parts.muscles {
        let next = |v: u32, other: u32| *generic.mesh().neighbours(v as usize).iter().find(|n| **n != other).unwrap();
        muscle.insertion = next(muscle.insertion, muscle.attachment);
        muscle.attachment = next(muscle.attachment, muscle.insertion);
    }
    let elsewhere = FaceModel::new(generic.mesh().clone(), parts).unwrap();
    for (posed, law) in [(posed(&BROW_RAISE), LawKind::Koch), (posed_by(&BROW_RAISE, &elsewhere), LawKind::Anatomical)]
    {
        let posed = marked_within(posed, 0.2);
        let by = |alone| solve(&posed, FieldWay::Muscles(MuscleWay { law: Some(law), alone, ..MuscleWay::default() }));
        let ([alone, alone_covers], [whole, covers]) = {
            let pair = |alone| {
                let (e, c) = error_and_coverage(&posed, &by(alone));
                [e, c]
            };
            (pair(true), pair(false))
        };
        assert!(alone > 0.4 && alone_covers < 0.6, "{law:?}: {alone} {alone_covers}");
        assert!(whole < 0.5 * alone && covers > 0.85, "{law:?}: {whole} of {alone}, {covers}");
        let besides = by(false).muscles.unwrap().besides.unwrap();
        assert!(besides.share > 0.1 && besides.of_all > 0.1 && by(true).muscles.unwrap().besides.is_none());
    }
    // The law that moved it leaves hardly anything.
    let posed = marked_within(posed(&BROW_RAISE), 0.2);
    let outcome =
        solve(&posed, FieldWay::Muscles(MuscleWay { law: Some(LawKind::Anatomical), ..MuscleWay::default() }));
    let besides = outcome.muscles.as_ref().unwrap().besides.unwrap();
    let (error, covers) = error_and_coverage(&posed, &outcome);
    assert!(error < 0.08 && covers > 0.85 && besides.of_all < 0.1, "{error} {covers} {besides:?}");
}

#[test]
fn without_a_mark_of_the_skin_the_field_stays_as_measured() {
    let mut posed = posed(&BROW_RAISE);
    for feature in posed.project.features.values_mut() {
        feature.role = Role::Still;
    }
    let outcome = solve(&posed, WAY(LawKind::Anatomical, None));
    let why = "no point of the skin is marked".to_owned();
    assert!(outcome.muscles.is_none() && outcome.warnings.contains(&Warning::NoMuscle { why }));
    let nothing = Project { features: std::collections::BTreeMap::default(), ..posed.project.clone() };
    let untouched = solve(&Posed { project: nothing, ..posed }, WAY(LawKind::Anatomical, None));
    assert!(
        !untouched.warnings.iter().any(|w| matches!(w, Warning::NoMuscle { .. })),
        "nobody has marked anything yet"
    );
}

/// Skin that stays where it was asks for no muscle, and so there is no scale for what would pull besides: that is said.
#[test]
fn what_the_muscles_leave_is_asked_for_only_where_one_pulls() {
    let still = posed(&[]);
    let way = MuscleWay { law: Some(LawKind::Anatomical), ..MuscleWay::default() };
    let outcome = solve(&still, FieldWay::Muscles(way));
    assert!(outcome.muscles.as_ref().is_some_and(|m| m.pulling.is_empty() && m.besides.is_none()));
    assert!(outcome.warnings.contains(&Warning::NothingBesides { why: "no muscle pulls" }));
    let alone = solve(&still, FieldWay::Muscles(MuscleWay { alone: true, ..way }));
    assert!(!alone.warnings.iter().any(|w| matches!(w, Warning::NothingBesides { .. })));
}

#[test]
fn a_fit_of_muscles_is_given_up_when_it_is_told_to() {
    let Posed { face, mut project, .. } = posed(&BROW_RAISE);
    project.settings.field = FieldWay::Muscles(MuscleWay::default());
    let calls = std::cell::Cell::new(0);
    let after = |most: usize| {
        calls.set(0);
        let stop = || calls.replace(calls.get() + 1) >= most;
        pipeline::solve_unless(&project, &face, [1036, 1036], &mut Workspace::default(), &stop)
    };
    let whole = after(usize::MAX);
    let asked = calls.get();
    assert!(whole.is_some_and(|o| o.muscles.is_some()) && asked > LawKind::ALL.len(), "{asked}");
    for most in 0..asked {
        assert_eq!(after(most), None, "{most}");
        // No law is tried, and no step gone, after it was told: the chain asks once more at its end.
        assert!(calls.get() <= most + 2, "{most}: {}", calls.get());
    }
}

/// Fits go on from the measured forces, and so the causes of errors are theirs.
#[test]
fn the_causes_of_errors_are_those_of_the_measured_forces() {
    let mut posed = posed(&BROW_RAISE);
    posed.project.settings.field = WAY(LawKind::Anatomical, None);
    let outcome = solve(&posed, posed.project.settings.field);
    let sigma = &outcome.muscles.as_ref().unwrap().measured_sigma;
    let mut squares = vec![0.0; sigma.len()];
    for (v, force) in pipeline::error_causes(&posed.project, &posed.face, [1036, 1036]).iter().flatten() {
        squares[*v as usize] += force.norm_squared();
    }
    for (square, sigma) in squares.iter().zip(sigma) {
        assert!((square.sqrt() - sigma).abs() <= 1e-9 * sigma.max(1e-6), "{} {sigma}", square.sqrt());
    }
}

/// A marked corner of the eye is held by a bone: what pulls there besides the muscles is not told, so it counts as border, and not in another way.
#[test]
fn what_a_bone_holds_is_border_in_a_field_of_muscles() {
    let mut posed = posed(&BROW_RAISE);
    let generic = face::generic();
    let corner = generic.landmark("eye_inner_left").unwrap().vertex;
    let before = solve(&posed, FieldWay::Direct);
    let around = generic.mesh().neighbours(corner as usize).iter().copied().chain([corner]);
    for v in around {
        let at = before.first_in_image[v as usize];
        posed
            .project
            .features
            .entry(v)
            .or_insert(Feature { last: Some(Mark::new([at.x, at.y])), ..Feature::default() });
    }
    let border = |way| solve(&posed, way).border[corner as usize];
    assert!(border(WAY(LawKind::Anatomical, None)) && !border(FieldWay::Direct));
}

/// A jaw that opens under a pull at the corners of the mouth: both are found again from the lower face, and the jaw is not asked for by the brow.
#[test]
fn the_jaw_is_found_beside_the_muscles() {
    let pulls = [("zygomaticus_major_left", 0.5), ("zygomaticus_major_right", 0.4)];
    let generic = face::generic();
    let rest = generic.mesh().positions();
    let lower = (0..rest.len() as u32).filter(|v| rest[*v as usize].y < -5.0).collect();
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let open = posed_with(&pulls, &generic, &law, 8.0, lower);
    let outcome = solve(&open, WAY(LawKind::Anatomical, None));
    let found = outcome.muscles.as_ref().unwrap();
    let jaw = found.jaw.unwrap();
    assert!((jaw.deg - 8.0).abs() < 0.2 && jaw.between[0] <= 8.0 && 8.0 <= jaw.between[1], "{jaw:?}");
    for (id, activation) in &open.pulls {
        let one = found.pulling.iter().find(|p| p.id == *id).unwrap();
        assert!((one.activation - activation).abs() < 0.05, "{one:?}");
    }
    let (error, covers) = error_and_coverage(&open, &outcome);
    assert!(error < 0.1 && covers > 0.8 && found.misfit < 1.2, "{error} {covers} {}", found.misfit);
    // The fewest muscles leave the jaw open.
    let few = solve(&open, WAY(LawKind::Anatomical, Some(2))).muscles.unwrap();
    assert!(few.pulling.len() <= 2 && (few.jaw.unwrap().deg - 8.0).abs() < 0.5, "{few:?}");
    let brow = solve(&posed(&BROW_RAISE), WAY(LawKind::Anatomical, None));
    assert_eq!(brow.muscles.unwrap().jaw, None);
}

#[test]
fn muscles_that_the_marks_cannot_feel_are_not_asked_for() {
    let posed = posed(&BROW_RAISE);
    let found = solve(&posed, WAY(LawKind::Anatomical, None)).muscles.unwrap();
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let rest = posed.face.mesh().positions();
    let all = Actuators::of(&posed.face, rest, &law, ActuatorSettings::default()).unwrap();
    assert!(found.among >= 8 && found.among < all.all.len(), "{} of {}", found.among, all.all.len());
}

/// The anatomical law with its parameters times these.
fn of_shape(times: [f64; 4]) -> MuscleLaw {
    let usual = MuscleLaw::default_of(LawKind::Anatomical);
    let values: Vec<f64> = usual.parameters().iter().zip(times).map(|(p, times)| p.value * times).collect();
    usual.with_parameters(&values).unwrap()
}

/// Muscles that spread their pull otherwise than their law usually does: with its usual shape the field is off, and the shape is found again with the
/// muscles. Where it is the usual one nothing is lost by asking.
#[test]
fn the_shape_of_a_law_is_found_with_the_muscles_that_pull_by_it() {
    let law = of_shape([0.7, 1.5, 1.4, 0.7]);
    let forehead = || face::generic().region("forehead_and_brows").to_vec();
    let other = marked_within(posed_with(&BROW_RAISE, &face::generic(), &law, 0.0, forehead()), 0.1);
    let usual = marked_within(posed(&BROW_RAISE), 0.1);
    let by = |posed: &Posed, alone, shape| {
        let way = MuscleWay { law: Some(LawKind::Anatomical), alone, shape, ..MuscleWay::default() };
        let outcome = solve(posed, FieldWay::Muscles(way));
        let (error, covers) = error_and_coverage(posed, &outcome);
        (error, covers, outcome.muscles.unwrap())
    };
    let (off, _, plain) = by(&other, true, false);
    let (near, covers, found) = by(&other, true, true);
    assert!(plain.shape.is_empty() && found.shape.len() == 4);
    assert!(near < 0.3 * off && near < 0.06 && covers > 0.9, "{off} {near} {covers}");
    assert!(found.misfit < 0.5 * plain.misfit, "{} {}", plain.misfit, found.misfit);
    let inside =
        found.shape.iter().zip(law.parameters()).filter(|(p, q)| (p.between[0]..=p.between[1]).contains(&q.value));
    assert!(inside.count() >= 3, "{:?}", found.shape);
    for (id, activation) in &other.pulls {
        let pulling = found.pulling.iter().find(|p| p.id == *id).unwrap();
        assert!((pulling.activation - activation).abs() < 0.05, "{pulling:?}");
    }
    // With pulls besides them, which then are few.
    let [with, without] = [true, false].map(|shape| by(&other, false, shape));
    assert!(with.0 < without.0 && with.2.besides.unwrap().of_all < without.2.besides.unwrap().of_all);
    let [asked, not] = [true, false].map(|shape| by(&usual, true, shape));
    assert!(asked.0 < 0.05 && asked.1 > 0.9, "{} {} {}", asked.0, asked.1, not.0);
}

/// Any law can be asked for its shape, and leaves the points no further off with it; the law of the four that then leaves least is the one that pulled.
#[test]
fn the_shape_of_every_law_can_be_found() {
    let law = of_shape([0.7, 1.5, 1.4, 0.7]);
    let forehead = face::generic().region("forehead_and_brows").to_vec();
    let posed = marked_within(posed_with(&BROW_RAISE, &face::generic(), &law, 0.0, forehead), 0.3);
    let by = |law, shape| {
        let way = MuscleWay { law, alone: true, shape, ..MuscleWay::default() };
        solve(&posed, FieldWay::Muscles(way)).muscles.unwrap()
    };
    for law in LawKind::ALL {
        let (plain, shaped) = (by(Some(law), false), by(Some(law), true));
        // Waters' sheet is sharp across the fibre: that side is no unknown.
        let unknowns = MuscleLaw::default_of(law).parameters().iter().filter(|p| p.smooth).count();
        assert_eq!(shaped.shape.len(), unknowns, "{law:?}");
        assert!(shaped.misfit < 1.01 * plain.misfit, "{law:?}: {} {}", plain.misfit, shaped.misfit);
        for p in &shaped.shape {
            assert!(p.between[0] <= p.value && p.value <= p.between[1] && p.between[0] < p.between[1], "{law:?} {p:?}");
        }
    }
    assert_eq!(by(None, true).law, LawKind::Anatomical);
}
