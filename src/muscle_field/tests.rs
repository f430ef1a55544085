use nalgebra::{Point3, Vector3};

use super::fibres::{fibre_field, fibre_through, fibres};
use super::profiles::{Part, Way, profile};
use super::samples::{Include, Samples};
use crate::displacement::VertexState;
use crate::export::scene_of_one_triangle;
use crate::face::{FaceModel, FaceParts, Mesh, Muscle, Side};
use crate::pipeline::{ForceField, Outcome};

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
    let (_, _, base) = scene_of_one_triangle();
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
        ..base
    }
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
    let (_, face, outcome) = scene_of_one_triangle();
    // Vertex 0 is measured but border, 1 inferred, 2 unmeasured.
    let of = |include| Samples::of(&outcome, &face, include).vertices;
    assert!(of(Include::Believed).is_empty());
    assert_eq!(of(Include::Measured), [0]);
    assert_eq!(of(Include::Known), [0, 1]);
    let one = Samples::of(&outcome, &face, Include::Measured).samples[0];
    assert_eq!((one.force, one.sigma, one.normal), (Vector3::new(3.0, 4.0, 0.0), 0.25, Vector3::z()));
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

    // Across it at y = 40 the component is 4 N everywhere on the line, and between 3 and 5 N in the band of 15 mm.
    let lateral = cut(Way::Lateral, Part::AlongFibre);
    assert!(lateral.curves[0].points.iter().all(|[_, value]| (value - 4.0).abs() < 1e-9));
    assert!(lateral.observed.iter().all(|o| (o.value - 4.0).abs() < 1.0 + 1e-12));
    assert!(lateral.curves[0].points.windows(2).all(|p| p[0][0] <= p[1][0]));

    // The length of (1, 4, 0) is √17.
    let length = cut(Way::Lateral, Part::Magnitude);
    assert!(length.curves[0].points.iter().all(|[_, value]| (value - 17.0_f64.sqrt()).abs() < 1e-9));
}
