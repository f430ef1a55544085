//! Fields of known origin: the muscles that made them must be found, and where none did, none.

use nalgebra::{Point3, Vector3};

use super::analysis::{Analysis, Nothing, Question};
use super::fibres::{fibre_field, fibre_through, fibres};
use super::ladder::ladder;
use super::maps::{MapsError, of_subjects};
use super::profiles::{Part, Way, profile};
use super::subjects::{Seen, carry, told_apart};
use super::{Include, Samples};
use crate::displacement::VertexState;
use crate::face::{FaceModel, FaceParts, Mesh, Muscle, Side};
use crate::muscle::{Anatomical, LawKind, MuscleLaw};
use crate::pipeline::{self, ForceField, Outcome, Workspace};
use crate::project::Project;

/// A flat sheet of 9 × 9 vertices, 10 mm apart, with one muscle from (40, 80) down to (40, 40), half as wide as 15 mm.
fn sheet() -> FaceModel {
    let at = |k: u32| Point3::new(f64::from(k % 9) * 10.0, f64::from(k / 9) * 10.0, 0.0);
    let triangles = (0..64_u32).flat_map(|k| {
        let i = k / 8 * 9 + k % 8;
        [[i, i + 1, i + 10], [i, i + 10, i + 9]]
    });
    let mesh = Mesh::new((0..81).map(at).collect(), triangles.collect()).unwrap();
    let muscle = Muscle {
        id: "frontalis_left".into(),
        latin: "Musculus frontalis".into(),
        action_unit: 1,
        side: Side::Left,
        attachment: 76,
        insertion: 40,
        half_width_mm: 15.0,
        zone_half_angle_deg: None,
    };
    FaceModel::new(mesh, FaceParts { muscles: vec![muscle], mirror: vec![None; 81], ..FaceParts::default() }).unwrap()
}

/// Every vertex measured, with the force (1, y / 10, 0) N and an error of 0.1 N.
fn outcome(face: &FaceModel) -> Outcome {
    let first = face.mesh().positions().to_vec();
    let n = first.len();
    Outcome {
        states: vec![VertexState::Measured; n],
        border: vec![false; n],
        field: ForceField {
            force: first.iter().map(|p| Vector3::new(1.0, 0.1 * p.y, 0.0)).collect(),
            sigma: vec![0.1; n],
            outside_table: vec![false; n],
            ..ForceField::default()
        },
        last: first.clone(),
        first,
        ..unmarked(face)
    }
}

/// What the chain makes of a face without a mark.
fn unmarked(face: &FaceModel) -> Outcome {
    pipeline::solve(&Project::default(), face, [1036, 1036], &mut Workspace::default())
}

#[test]
fn a_vertex_belongs_to_the_muscle_in_whose_band_it_lies() {
    let face = sheet();
    let first = face.mesh().positions();
    let field = fibre_field(&face, first);
    // The band reaches 15 mm to either side of x = 40, and 15 mm round its ends at y = 80 and 40.
    for (v, at) in field.iter().enumerate() {
        let p = first[v];
        let beyond = (p.y - p.y.clamp(40.0, 80.0)).abs();
        let within = (p.x - 40.0).hypot(beyond) <= 15.0;
        assert_eq!(at.is_some(), within, "{p}");
        assert!(at.is_none_or(|a| a.muscle == 0 && (a.direction - Vector3::y()).norm() < 1e-12));
        assert_eq!(fibre_through(&face, first, v), *at);
    }
}

#[test]
fn the_fibre_lies_in_the_skin_of_the_generic_face() {
    let face = crate::face::generic();
    let first = face.mesh().positions();
    let (all, without) = fibres(&face, first);
    assert_eq!((all.len(), without.len()), (18, 0));
    let normals = face.mesh().vertex_normals(first);
    let mut seen = [false; 18];
    for (at, normal) in fibre_field(&face, first).iter().zip(&normals) {
        let Some(at) = at else { continue };
        seen[at.muscle] = true;
        assert!((at.direction.norm() - 1.0).abs() < 1e-12 && at.direction.dot(normal).abs() < 1e-12);
    }
    assert!(seen.iter().all(|s| *s), "{seen:?}");
}

#[test]
fn only_what_can_be_believed_is_a_sample() {
    let face = sheet();
    let mut outcome = outcome(&face);
    outcome.states.fill(VertexState::Unmeasured);
    outcome.states[..2].copy_from_slice(&[VertexState::Measured, VertexState::Inferred]);
    outcome.border[0] = true;
    let of = |include| Samples::of(&outcome, &face, include).vertices;
    assert!(of(Include::Believed).is_empty());
    assert_eq!(of(Include::Measured), [0]);
    assert_eq!(of(Include::Known), [0, 1]);
    let one = Samples::of(&outcome, &face, Include::Measured).samples[0];
    assert_eq!((one.force, one.sigma, one.normal), (Vector3::new(1.0, 0.0, 0.0), 0.1, Vector3::z()));
}

#[test]
fn profiles_show_what_was_observed_and_what_a_model_says_at_the_same_place() {
    let face = sheet();
    let outcome = outcome(&face);
    let (all, _) = fibres(&face, &outcome.first);
    let model = |x: &Point3<f64>| Vector3::new(1.0, 0.1 * x.y, 0.0);
    let cut = |way, part| profile(face.mesh(), &outcome, &all[0], way, part, &[&model]).unwrap();

    // Along the fibre the coordinate is 80 − y, so that the component along it, 0.1 y, is 8 − 0.1 s. Three columns lie in the band.
    let radial = cut(Way::Radial, Part::AlongFibre);
    assert!((radial.insertion_mm - 40.0).abs() < 1e-12);
    assert_eq!(radial.observed.len(), 27);
    for o in &radial.observed {
        assert!((o.value - (8.0 - 0.1 * o.at_mm)).abs() < 1e-12 && o.sigma == 0.1 && o.believed);
    }
    assert!(radial.curves[0].points.len() > 40);
    for [at, value] in &radial.curves[0].points {
        assert!((value - (8.0 - 0.1 * at)).abs() < 1e-9, "{at} {value}");
    }

    // Across it at y = 40 the component is 4 N everywhere on the line, and between 3 and 5 N in the band of three rows at most.
    let lateral = cut(Way::Lateral, Part::AlongFibre);
    assert!(lateral.curves[0].points.iter().all(|[_, value]| (value - 4.0).abs() < 1e-9));
    assert!(lateral.observed.iter().all(|o| (o.value - 4.0).abs() < 1.0 + 1e-12));
    assert!(lateral.curves[0].points.windows(2).all(|p| p[0][0] <= p[1][0]));

    // The length of (1, 4, 0) is √17.
    let length = cut(Way::Lateral, Part::Magnitude);
    assert!(length.curves[0].points.iter().all(|[_, value]| (value - 17.0_f64.sqrt()).abs() < 1e-9));
}

/// The whole generic face measured, under two muscles by a law of another shape than the default, 0.01 N of error stated.
fn pulled(strengths: [f64; 2]) -> (std::sync::Arc<FaceModel>, Outcome) {
    let face = crate::face::generic();
    let first = face.mesh().positions().to_vec();
    let (all, _) = fibres(&face, &first);
    let law = MuscleLaw::Anatomical(Anatomical { sr: 8.0, wr: 0.7, sa: 7.0, wa: 0.5, ..Anatomical::default() });
    let named = ["frontalis_medial_left", "zygomaticus_major_right"];
    let pulls: Vec<_> = named
        .iter()
        .zip(strengths)
        .map(|(id, strength)| {
            (all.iter().find(|f| face.muscles()[f.muscle].id == **id).unwrap().fibre.clone(), strength)
        })
        .collect();
    let force = |x: &Point3<f64>| pulls.iter().map(|(f, s)| law.force(f, x) * *s).sum::<Vector3<f64>>();
    let n = first.len();
    let field = ForceField {
        force: first.iter().map(force).collect(),
        sigma: vec![0.01; n],
        outside_table: vec![false; n],
        ..ForceField::default()
    };
    let outcome = Outcome {
        states: vec![VertexState::Measured; n],
        border: vec![false; n],
        field,
        last: first.clone(),
        first,
        ..unmarked(&face)
    };
    (face, outcome)
}

#[test]
fn the_muscles_that_made_a_field_are_found_with_their_law_and_strengths() {
    let (face, outcome) = pulled([0.9, 0.4]);
    let question = Question { compare: crate::fit::Compare::Vectors, ..Question::default() };
    let found = Analysis::new(&outcome, &[], &face, &question, &|| false).unwrap().unwrap();
    let ids: Vec<&str> =
        found.selection.chosen.iter().map(|&f| face.muscles()[found.fibres[f].muscle].id.as_str()).collect();
    assert_eq!(ids, ["frontalis_medial_left", "zygomaticus_major_right"]);
    assert!(found.explains);
    let best = found.best_fit().unwrap();
    assert_eq!(best.law.kind(), LawKind::Anatomical);
    assert!(best.r2 > 1.0 - 1e-9, "{}", best.r2);
    for (&f, truth) in found.selection.chosen.iter().zip([0.9, 0.4]) {
        let strength = found.activations.muscles[f].strength_n;
        assert!((strength - truth).abs() < 1e-4, "{strength} for {truth}");
    }
    // No second lobe made the field, so none may be found to pay.
    assert_eq!(found.second_lobe_pays(), Some(false));

    // The same law on the same muscles twice as strong: its shape holds, its strengths explain 1 − (1/2)² of the squares.
    let (_, twice) = pulled([1.8, 0.8]);
    let [own, other] =
        [("own", &outcome), ("twice", &twice)].map(|(name, outcome)| Seen { name, face: &face, outcome });
    let told = std::cell::RefCell::new(Vec::new());
    let carried = carry(&found, own, other, &|| false, &|share| told.borrow_mut().push(share)).unwrap().unwrap();
    assert_eq!(told.into_inner(), [0.2, 0.4, 0.6, 0.8, 1.0], "five laws");
    let row = carried.rows.iter().find(|r| r.label == best.label).unwrap();
    assert!((row.as_fitted_r2.unwrap() - 0.75).abs() < 1e-3, "{:?}", row.as_fitted_r2);
    assert!(row.shape_carried.as_ref().unwrap().r2 > 1.0 - 1e-6);
    assert!(carried.missing.is_empty() && carried.same_unit);
    assert!(carried.nearest()[0].is_some_and(|k| carried.rows[k].label == best.label));

    // Its profile there: as fitted here the law says half of what was observed, with strengths of there all of it.
    let k = carried.rows.iter().position(|r| r.label == best.label).unwrap();
    let cut = carried.profile(other, k, "frontalis_medial_left", Way::Radial, Part::AlongFibre).unwrap();
    let [as_fitted, shape, refitted] = [0, 1, 2].map(|c| &cut.curves[c].points);
    let across = carried.profile(other, k, "zygomaticus_major_right", Way::Lateral, Part::AlongFibre).unwrap();
    for curve in cut.curves.iter().chain(&across.curves) {
        assert!(curve.points.windows(2).all(|p| p[0][0] <= p[1][0]), "a line never runs back");
    }
    assert!(as_fitted.len() > 20 && as_fitted.len() == shape.len() && shape.len() == refitted.len());
    for (a, s) in as_fitted.iter().zip(shape).filter(|(a, _)| a[1].is_finite()) {
        assert!((2.0 * a[1] - s[1]).abs() < 1e-3, "{a:?} {s:?}");
    }
    assert!(carried.profile(other, k, "mentalis_left", Way::Radial, Part::AlongFibre).is_none(), "not fitted");

    // Stopped between two laws it says nothing; with a scale on one side alone no strength is carried.
    assert!(carry(&found, own, other, &|| true, &|_| {}).is_none());
    let newtons = Outcome { scale_measured: true, ..twice.clone() };
    let there = Seen { name: "newtons", face: &face, outcome: &newtons };
    let mixed = carry(&found, own, there, &|| false, &|_| {}).unwrap().unwrap();
    assert!(!mixed.same_unit && mixed.rows.iter().all(|r| r.as_fitted_r2.is_none()));
    assert!(mixed.rows[k].shape_carried.as_ref().unwrap().r2 > 1.0 - 1e-6, "a shape has no unit of force");
    let still =
        Outcome { field: ForceField { force: vec![Vector3::zeros(); 612], ..twice.field.clone() }, ..twice.clone() };
    let still = Seen { name: "still", face: &face, outcome: &still };
    assert_eq!(carry(&found, own, still, &|| false, &|_| {}).unwrap().unwrap_err(), Nothing::NoForce);

    // A law without a fit here is refitted there all the same.
    let mut lame = found.clone();
    let why = crate::fit::NoFit::OutOfReach;
    lame.laws[0].fit = Err(crate::fit::FailedFit { label: "Waters".into(), why, evaluations: 0, time_ms: 0.0 });
    let carried = carry(&lame, own, other, &|| false, &|_| {}).unwrap().unwrap();
    assert!(carried.rows.len() == 5 && carried.rows[0].shape_carried.is_err() && carried.rows[0].refitted.is_ok());

    let project = Project::default();
    let built = ladder(&project, &face, [1036, 1036], &found, &|| false, &|_| {}).unwrap();
    let recommended = &built.rungs[built.recommended.unwrap()];
    assert!(recommended.name.starts_with("Anatomical, shape"), "{recommended:?}");
    let errors: Vec<f64> = built.rungs[..4].iter().map(|r| r.held_out.as_ref().unwrap().error).collect();
    assert!((errors[0] - 1.0).abs() < 1e-12 && errors[3] < errors[0], "{errors:?}");
}

#[test]
fn noise_alone_is_explained_by_no_muscle_and_no_field_is_no_answer() {
    use rand::{RngExt, SeedableRng};
    let (face, mut outcome) = pulled([0.9, 0.4]);
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    for f in &mut outcome.field.force {
        *f = Vector3::from_fn(|_, _| random.random_range(-0.1..0.1));
    }
    let found = Analysis::new(&outcome, &[], &face, &Question::default(), &|| false).unwrap().unwrap();
    assert!(!found.explains && found.selection.chosen.is_empty());
    let best = found.best.and_then(|b| found.laws[b].held_out.as_ref()).unwrap();
    assert!(best.error > 0.97, "{}", best.error);

    assert!(Analysis::new(&outcome, &[], &face, &Question::default(), &|| true).is_none(), "stopped");
    outcome.field.force.fill(Vector3::zeros());
    assert_eq!(
        Analysis::new(&outcome, &[], &face, &Question::default(), &|| false).unwrap().unwrap_err(),
        Nothing::NoForce
    );
    outcome.states.fill(VertexState::Inferred);
    assert_eq!(
        Analysis::new(&outcome, &[], &face, &Question::default(), &|| false).unwrap().unwrap_err(),
        Nothing::NoSamples
    );
}

#[test]
fn only_vertices_that_count_on_all_subjects_are_put_together() {
    let face = sheet();
    let mut one = outcome(&face);
    let mut two = outcome(&face);
    // At (40, 50), vertex 49, the force is (1, 5, 0); the other's is (3, 1, 0): lengths √26 and √10, along the fibre 5 and 1.
    two.field.force[49] = Vector3::new(3.0, 1.0, 0.0);
    two.border[50] = true;
    one.states[51] = VertexState::Inferred;
    let question = Question::default();
    let seen = |one: &Outcome, two: &Outcome, part| {
        let pair = [("one", one), ("two", two)].map(|(name, outcome)| Seen { name, face: &face, outcome });
        of_subjects(&pair, &question, part)
    };
    let along = seen(&one, &two, Part::AlongFibre).unwrap();
    assert_eq!((along.mean[49], along.difference(1)[49]), (Some(3.0), Some(4.0)));
    // √((2² + 2²) / 1).
    assert!((along.spread[49].unwrap() - 8.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!((along.values[0][50], along.values[1][50]), (Some(5.0), None));
    assert_eq!([50, 51].map(|v: usize| along.mean[v]), [None; 2], "one is on the border, one is inferred");
    assert_eq!(along.mean[0], None, "no muscle runs there");
    let length = seen(&one, &two, Part::Magnitude).unwrap();
    assert!((length.difference(1)[49].unwrap() - (26.0_f64.sqrt() - 10.0_f64.sqrt())).abs() < 1e-12);
    assert_eq!(length.shared(), 79);

    // What cannot be put together says why.
    two.scale_measured = true;
    let words = seen(&one, &two, Part::Magnitude).unwrap_err().to_string();
    assert!(words.contains("of one are relative") && words.contains("of two are in N"), "{words}");
    let other = crate::face::generic();
    let generic = unmarked(&other);
    let pair =
        [Seen { name: "one", face: &face, outcome: &one }, Seen { name: "far", face: &other, outcome: &generic }];
    let wrong = of_subjects(&pair, &question, Part::Magnitude).unwrap_err();
    assert_eq!(wrong, MapsError::Topology { name: "far".into() });
    assert_eq!(of_subjects(&pair[..1], &question, Part::Magnitude).unwrap_err(), MapsError::Alone);
}

#[test]
fn subjects_of_one_name_are_told_apart_by_folder_or_number() {
    let names =
        |all: &[(&str, &str)]| told_apart(&all.iter().map(|(n, p)| (*n, std::path::Path::new(p))).collect::<Vec<_>>());
    assert_eq!(names(&[("Anna", "a/x.frontalis"), ("", "b/bert.frontalis")]), ["Anna", "bert.frontalis"]);
    assert_eq!(names(&[("Twin", "a/x"), ("Twin", "b/x"), ("Lea", "a/l")]), ["Twin (a)", "Twin (b)", "Lea"]);
    assert_eq!(names(&[("Twin", "a/x"), ("Twin", "a/y"), ("Twin", "x")]), ["Twin (a)", "Twin (a) 2", "Twin"]);
}
