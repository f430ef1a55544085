//! Erkoç's construction against hand calculation, against what is printed, and against the tangent projection on the generic face.

use super::*;
use crate::face::{self, Mesh};
use crate::simulate::muscle_force::{InSurface, muscle_force};
use crate::simulate::region::Cutoff;

const UNIT: Cylinder = Cylinder { x: 0.0, z: 0.0, radius_mm: 1.0 };

/// Thesis (4.22), (4.23) as printed, with the axis x = z = 0 and u an angle: the point of the plane through x₁ at (u, v).
fn printed(n: Vector3<f64>, x1: Point3<f64>, u: f64, v: f64) -> Point3<f64> {
    let z = (n.x * x1.x - n.y * (v - x1.y) + n.z * x1.z) / (n.x * u.tan() + n.z);
    Point3::new(z * u.tan(), v, z)
}

/// Four facets round vertex 0 at `at`, with the corners around it at x ± 1 and y ± 1 on the plane of normal `n`.
fn four_facets(at: Point3<f64>, n: Vector3<f64>) -> Mesh {
    let on_plane = |dx: f64, dy: f64| at + Vector3::new(dx, dy, -(n.x * dx + n.y * dy) / n.z);
    let ring = [on_plane(1., 0.), on_plane(0., 1.), on_plane(-1., 0.), on_plane(0., -1.)];
    let places = std::iter::once(at).chain(ring).collect();
    Mesh::new(places, vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]).unwrap()
}

fn lift(mesh: &Mesh, cylinder: Cylinder, vertex: u32, f: [f64; 2]) -> Result<Vector3<f64>, Exception> {
    let positions = mesh.positions();
    let normals = mesh.vertex_normals(positions);
    // Any fibre: lifting does not ask for it.
    let fibre = Fibre::new(Point3::new(0., 1., 9.), Point3::new(0., 0., 9.), 1.0, None, [Vector3::z(); 2]).unwrap();
    let flat = Unrolled::of(cylinder, &fibre).unwrap();
    flat.lift(Skin { mesh, positions, normals: &normals }, vertex, Vector2::from(f))
}

/// (4.18): a quarter turn at radius 50 is 50 π/2 wide; behind the axis, atan(30/−40) as printed would lie at −36.9°, before it.
#[test]
fn unrolling_by_hand_and_behind_the_axis() {
    let at = |x, y, z| Cylinder { radius_mm: 50.0, ..UNIT }.unrolled(&Point3::new(x, y, z)).unwrap();
    assert!((at(0.0, 7.0, 20.0) - Vector2::new(0.0, 7.0)).norm() < 1e-12);
    assert!((at(50.0, 3.0, 0.0) - Vector2::new(25.0 * std::f64::consts::PI, 3.0)).norm() < 1e-12);
    let behind = at(30.0, 0.0, -40.0).x / 50.0;
    assert!((behind.to_degrees() - 143.130_102).abs() < 1e-6);
    assert!(((30.0_f64 / -40.0).atan().to_degrees() + 36.869_897).abs() < 1e-6);
    assert_eq!(UNIT.unrolled(&Point3::new(0.0, 5.0, 0.0)), None);
}

/// (4.18) as printed sets an angle beside a length: one fibre, 20 mm wide and 40 mm high at a radius of 70 mm, leans by 0.4° to 63°
/// from the vertical, depending on the unit. In mm, on a cylinder of the face's radius, it leans as on the face: 26.6°.
#[test]
fn with_an_angle_for_u_directions_depend_on_the_unit() {
    let (wide, high) = (20.0_f64 / 70.0, 40.0_f64);
    let lean = |unit_mm: f64| (wide / (high / unit_mm)).atan().to_degrees();
    assert!((lean(1.0) - 0.409).abs() < 1e-3 && (lean(70.0) - 26.565).abs() < 1e-3 && lean(275.0) > 63.0);
    let cylinder = Cylinder { radius_mm: 70.0, ..UNIT };
    let u = 20.0 / 70.0_f64;
    let q = cylinder.unrolled(&Point3::new(70.0 * u.sin(), 40.0, 70.0 * u.cos())).unwrap();
    assert!(((q.x / q.y).atan().to_degrees() - 26.565).abs() < 1e-3);
}

/// (4.19)–(4.23): the printed point lies in the plane and at (u, v).
#[test]
fn the_printed_point_lies_in_the_plane_at_u_and_v() {
    let (x1, x2, x3) = (Point3::new(3., 1., 4.), Point3::new(4., 1., 3.5), Point3::new(3., 2., 3.75));
    let n = (x2 - x1).cross(&(x3 - x1));
    // By hand: (1, 0, −½) × (0, 1, −¼) = (½, ¼, 1).
    assert!((n - Vector3::new(0.5, 0.25, 1.0)).norm() < 1e-15);
    let p = printed(n, x1, 0.3, 1.5);
    assert!(n.dot(&(p - x1)).abs() < 1e-12);
    let q = UNIT.unrolled(&p).unwrap();
    assert!((q - Vector2::new(0.3, 1.5)).norm() < 1e-12);
    // By hand, at u = 0: z = (½·3 − ¼·½ + 4)/1 = 5.375.
    assert!((printed(n, x1, 0.0, 1.5) - Point3::new(0.0, 1.5, 5.375)).norm() < 1e-12);
}

/// `ERRATA.md` E19 on a facet that faces the camera, x₁ = (3, 0, 4): the printed "force" is a point 5 from the origin however small the
/// force; its way from x₁ is 4 (tan(u + f) − tan u), 6.26 times as long as the force at 0.001, 11.6 times at 0.5, and at 1 it points back.
#[test]
fn printed_the_force_is_a_point_and_its_way_from_the_vertex_grows_and_turns() {
    let (n, x1) = (Vector3::z(), Point3::new(3.0, 0.0, 4.0));
    let u = 0.75_f64.atan();
    let tip = |f: f64| printed(n, x1, u + f, 0.0);
    assert!((tip(1e-9).coords.norm() - 5.0).abs() < 1e-6);
    let stretch = |f: f64| (tip(f) - x1).x / f;
    assert!((stretch(1e-3) - 6.254_7).abs() < 1e-3 && (stretch(0.5) - 11.6).abs() < 0.05 && stretch(1.0) < 0.0);
    let mesh = four_facets(x1, n);
    for f in [1e-3, 0.5, 1.0] {
        assert!((lift(&mesh, UNIT, 0, [f, 0.0]).unwrap() - Vector3::x() * f).norm() < 1e-12);
    }
}

#[test]
fn the_lifted_force_is_the_derivative_of_the_printed_point_lengthened_to_the_force() {
    let x1 = Point3::new(30.0, -2.0, 40.0);
    for n in [Vector3::new(0.3, 0.2, 1.0), Vector3::new(0.9, -0.6, 0.8), Vector3::new(-0.2, 0.7, 0.4)] {
        let mesh = four_facets(x1, n);
        for f in [[0.3, 0.1], [-0.2, 0.5], [0.1, -0.4], [-0.6, -0.1]] {
            let radius_mm = 60.0;
            let lifted = lift(&mesh, Cylinder { radius_mm, ..UNIT }, 0, f).unwrap();
            let (u, v, h) = (0.75_f64.atan(), -2.0, 1e-6);
            let tip = |h: f64| printed(n, x1, u + h * f[0] / radius_mm, v + h * f[1]);
            let derivative = (tip(h) - tip(-h)) / (2.0 * h);
            let length = f[0].hypot(f[1]);
            assert!((lifted - derivative.normalize() * length).norm() < 1e-6 && (lifted.norm() - length).abs() < 1e-12);
        }
    }
}

#[test]
fn the_facet_into_which_the_force_points_is_taken() {
    // A ridge along y: facets to the right fall away by 45°, those to the left lie flat.
    let places =
        [[0., 0., 10.], [1., 0., 9.], [0., 1., 10.], [-1., 0., 10.], [0., -1., 10.]].map(Point3::from).to_vec();
    let mesh = Mesh::new(places, vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]).unwrap();
    let half = 0.5_f64.sqrt();
    let right = lift(&mesh, UNIT, 0, [1.0, 0.0]).unwrap();
    assert!((right - Vector3::new(half, 0.0, -half)).norm() < 1e-12);
    assert!((lift(&mesh, UNIT, 0, [-1.0, 0.0]).unwrap() + Vector3::x()).norm() < 1e-12);
    // Along the ridge both planes agree.
    assert!((lift(&mesh, UNIT, 0, [0.0, 1.0]).unwrap() - Vector3::y()).norm() < 1e-12);
}

#[test]
fn singular_cases_are_named() {
    // The plane x = 0 holds the ray of every vertex in it: n_x tan u + n_z = 0.
    let places = [[0., 0., 10.], [0., 1., 9.], [0., 1., 11.]].map(Point3::from).to_vec();
    let edge_on = Mesh::new(places, vec![[0, 1, 2]]).unwrap();
    assert_eq!(lift(&edge_on, UNIT, 0, [0.0, 1.0]), Err(Exception::FacetHoldsRay));
    // A border: the only facet lies above and to the right, the force points down.
    let places = [[0., 0., 10.], [1., 0., 10.], [0., 1., 10.]].map(Point3::from).to_vec();
    let corner = Mesh::new(places.clone(), vec![[0, 1, 2]]).unwrap();
    assert_eq!(lift(&corner, UNIT, 0, [0.2, -1.0]), Err(Exception::NoFacet));
    assert!(lift(&corner, UNIT, 0, [0.2, 1.0]).is_ok());
    let on_axis = Cylinder { z: 10.0, ..UNIT };
    assert_eq!(lift(&corner, on_axis, 0, [0.2, 1.0]), Err(Exception::OnAxis));
    // Seen from an axis in front of it a facet is turned away; where there is no other, it is taken.
    let in_front = Cylinder { z: 20.0, ..UNIT };
    assert!(lift(&corner, in_front, 0, [-0.2, 1.0]).is_ok());
}

#[test]
fn a_border_vertex_and_a_fibre_through_the_axis_are_projected_onto_the_skin_and_said() {
    let places = [[0., 0., 10.], [5., 0., 10.], [0., 5., 10.], [5., 5., 10.]].map(Point3::from).to_vec();
    let mesh = Mesh::new(places.clone(), vec![[0, 1, 2], [1, 3, 2]]).unwrap();
    let skin = Skin { mesh: &mesh, positions: &places, normals: &[Vector3::z(); 4] };
    let fibre = Fibre::new(Point3::new(0., 20., 10.), places[2], 5.0, None, [Vector3::z(); 2]).unwrap();
    let law = MuscleLaw::default_of(crate::muscle::LawKind::Anatomical);
    let with = |cylinder| {
        let surface = InSurface::Unrolled(cylinder);
        muscle_force(skin, &law, &fibre, [2, 2], &[1.0], surface, Cutoff::default())
    };
    // The upper border: nothing above it.
    let on_border = with(Cylinder { radius_mm: 10.0, ..UNIT });
    assert_eq!(on_border.exceptions.iter().find(|e| e.0 == 2), Some(&(2, Exception::NoFacet)));
    assert!((on_border.loads.iter().find(|l| l.0 == 2).unwrap().1 - Vector3::y()).norm() < 1e-12);
    let through = with(Cylinder { z: 10.0, ..UNIT });
    assert_eq!(through.exceptions, [(2, Exception::OnAxis)]);
    assert!(!through.loads.is_empty());
}

#[test]
fn the_cylinder_of_points_on_one_is_found_and_a_wall_has_none() {
    let around = |i: i32| {
        let phi = f64::from(i) * 0.1;
        Point3::new(5.0 + 70.0 * phi.sin(), f64::from(i), -50.0 + 70.0 * phi.cos())
    };
    let found = Cylinder::about(&(-10..9).map(around).collect::<Vec<_>>()).unwrap();
    assert!((found.x - 5.0).abs() < 1e-9 && (found.z + 50.0).abs() < 1e-9 && (found.radius_mm - 70.0).abs() < 1e-9);
    let wall: Vec<_> = (0..9).map(|i| Point3::new(f64::from(i), f64::from(i * i), 3.0)).collect();
    assert_eq!(Cylinder::about(&wall), None);
    assert_eq!(Cylinder::about(&[Point3::origin(); 3]), None);
}

/// How far apart the two constructions are on the generic face: the figures of `docs/accuracy.md`. `cargo test --lib
/// two_constructions -- --nocapture` prints them.
#[test]
fn angle_between_the_two_constructions_on_the_generic_face() {
    let face = face::generic();
    let positions = face.mesh().positions();
    let normals = face.mesh().vertex_normals(positions);
    let skin = Skin { mesh: face.mesh(), positions, normals: &normals };
    let cylinder = Cylinder::about(positions).unwrap();
    println!("axis x {:.1}, z {:.1}, radius {:.1} mm", cylinder.x, cylinder.z, cylinder.radius_mm);
    let law = MuscleLaw::default_of(crate::muscle::LawKind::Anatomical);
    let (mut sum, mut weight, mut exceptions, mut vertices) = (0.0, 0.0, 0, 0);
    for muscle in face.muscles() {
        let fibre = Fibre::of(muscle, positions, &normals).unwrap();
        let with = |surface| {
            muscle_force(skin, &law, &fibre, [muscle.attachment, muscle.insertion], &[1.0], surface, Cutoff::default())
        };
        let (flat, plain) = (with(InSurface::Unrolled(cylinder)), with(InSurface::TangentLengthKept));
        let (mut s, mut w) = (0.0, 0.0);
        for (v, f) in &flat.loads {
            if flat.exceptions.iter().any(|(e, _)| e == v) {
                continue;
            }
            if let Some((_, g)) = plain.loads.iter().find(|(p, _)| p == v) {
                s += f.norm() * f.angle(g).to_degrees();
                w += f.norm();
            }
        }
        exceptions += flat.exceptions.len();
        vertices += flat.loads.len();
        println!(
            "{:28} {:5.1}°  {} of {} vertices by projection",
            muscle.id,
            s / w,
            flat.exceptions.len(),
            flat.loads.len()
        );
        sum += s;
        weight += w;
    }
    let mean = sum / weight;
    println!("mean {mean:.1}°, {exceptions} of {vertices} vertices by projection");
    assert!((mean - 9.5).abs() < 0.1 && exceptions == 78 && vertices == 992);
}
