//! What a twin claims is checked against its pictures and against geometry done a second way.

use super::*;
use crate::draw::raster;
use crate::face::generic;

fn twin(settings: &TwinSettings) -> Twin {
    Twin::generate(&generic(), settings).unwrap()
}

fn small() -> TwinSettings {
    TwinSettings { size_px: 400, sensor_noise: 0.0, ..TwinSettings::default() }
}

#[test]
fn a_seed_gives_the_same_twin_to_the_bit_and_another_seed_another() {
    let settings = TwinSettings { size_px: 64, noise_px: 0.5, ..TwinSettings::default() };
    let (a, b) = (twin(&settings), twin(&settings));
    assert_eq!(a, b);
    assert_eq!(a.marks_in_image(), b.marks_in_image());
    assert_eq!(a.render(&generic()), b.render(&generic()));
    let other = twin(&TwinSettings { seed: 2, ..settings });
    assert_ne!(a.head_motion, other.head_motion);
    assert_eq!(a.last, other.last, "the expression does not depend on the seed");
}

#[test]
fn pixels_are_the_projection_of_the_moved_points() {
    let t = twin(&TwinSettings::default());
    // Thesis (4.7) by hand, after R (x − c) + c + t by hand.
    let r = t.head_motion.rotation.to_rotation_matrix();
    for v in (0..t.first.len()).step_by(37) {
        let x = r * (t.last[v] - t.head_motion.pivot) + t.head_motion.pivot.coords + t.head_motion.translation_mm;
        let scale = t.camera.px_per_mm * 1000.0 / (1000.0 - x.z);
        let by_hand = t.camera.principal_point_px + nalgebra::Vector2::new(scale * x.x, -scale * x.y);
        assert!((by_hand - t.last_in_image[v]).norm() < 1e-9);
    }
    // The face takes three quarters of the height, in the middle.
    let rows = || t.first_in_image.iter().map(|p| p.y);
    let (top, bottom) = (rows().fold(f64::INFINITY, f64::min), rows().fold(0.0, f64::max));
    assert!((bottom - top - 0.75 * 1036.0).abs() < 1e-6 && (top + bottom - 1036.0).abs() < 1e-6);
}

#[test]
fn the_head_moves_a_little_or_not_at_all() {
    for seed in 0..200 {
        let motion = head_motion(&TwinSettings { seed, ..TwinSettings::default() });
        let degrees = motion.rotation.angle().to_degrees();
        assert!((0.5 - 1e-9..=2.0 + 1e-9).contains(&degrees), "{degrees}");
        assert!(motion.translation_mm.norm() <= 2.0);
    }
    assert_eq!(twin(&TwinSettings { head_motion: false, ..small() }).head_motion, RigidMotion::default());
}

/// Distance of a point from a triangle, by the nearest of many points of it: slow, and not the code under test.
fn distance_to_triangle(p: &Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a)).normalize();
    let foot = p - normal * normal.dot(&(p - a));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (v - u).cross(&(foot - u)).dot(&normal) >= -1e-9);
    let to_side = |(u, v): (Point3<f64>, Point3<f64>)| {
        let t = ((p - u).dot(&(v - u)) / (v - u).norm_squared()).clamp(0.0, 1.0);
        (p - (u + (v - u) * t)).norm()
    };
    if inside {
        (p - foot).norm()
    } else {
        [(a, b), (b, c), (c, a)].into_iter().map(to_side).fold(f64::INFINITY, f64::min)
    }
}

#[test]
fn the_skin_slides_on_the_surface_and_moves_as_far_as_measured() {
    let face = generic();
    let t = twin(&TwinSettings { amplitude: 1.0, ..small() });
    let corners = |i: &[u32; 3]| i.map(|v| t.first[v as usize]);
    let mut moved = 0;
    for (v, (x0, x1)) in t.first.iter().zip(&t.last).enumerate() {
        if x0 == x1 {
            continue;
        }
        moved += 1;
        let off =
            face.mesh().triangles().iter().map(|i| distance_to_triangle(x1, corners(i))).fold(f64::INFINITY, f64::min);
        // The look-up lets a point lie a billionth of a triangle outside it.
        assert!(off < 1e-7, "vertex {v} is {off} mm off the surface");
    }
    assert!(moved > 120, "{moved}");
    // The middle of the brow: 10.3 mm up and 2.6 mm out, and back along the slope of the forehead.
    let brow = face.landmark("brow_mid_left").unwrap().vertex as usize;
    let u = t.last[brow] - t.first[brow];
    assert!((u.y - 10.3).abs() < 0.4 && (u.x - 2.6).abs() < 0.3 && u.z < -0.5, "{u}");
    for id in ["eye_inner_left", "eye_top_right", "nose_tip", "mouth_corner_left"] {
        let v = face.landmark(id).unwrap().vertex as usize;
        assert_eq!(t.first[v], t.last[v], "{id}");
    }
    let still = t.still(face.region("still"), 0.05);
    assert!(still.len() >= 6, "{} of {}", still.len(), face.region("still").len());
}

#[test]
fn no_triangle_folds_over() {
    let face = generic();
    let t = twin(&TwinSettings { amplitude: 1.2, ..small() });
    let flat_area = |x: &[Point3<f64>], [a, b, c]: [u32; 3]| {
        let p = |i: u32| x[i as usize].xy();
        (p(b) - p(a)).perp(&(p(c) - p(a)))
    };
    for (i, triangle) in face.mesh().triangles().iter().enumerate() {
        let (before, after) = (flat_area(&t.first, *triangle), flat_area(&t.last, *triangle));
        assert!(before < 0.5 || after / before > 0.2, "triangle {i}: {before} → {after} mm²");
    }
}

#[test]
fn the_skin_that_is_drawn_is_the_skin_that_is_measured() {
    // The finely cut mesh passes through the vertices' true places.
    let face = generic();
    let t = twin(&small());
    let surface = Surface::new(face.mesh());
    let raise = BrowRaise { amplitude: t.settings.amplitude };
    for (v, x0) in t.first.iter().enumerate() {
        let from = surface.at(&motion::Between { corners: [v; 3], weights: [1.0, 0.0, 0.0] });
        assert_eq!(from.point, *x0);
        assert!((surface.slide(&from, &raise.displacement(&x0.xy())).point - t.last[v]).norm() < 1e-12);
    }
}

/// Skin that goes where it is told: half way it is half way, triangles carry what is painted on them, and the crossings with them.
#[test]
fn skin_with_given_places_is_drawn_and_crossed_where_they_are() {
    let face = generic();
    let last: Vec<_> = face.mesh().positions().iter().map(|p| p + Vector3::new(0.05 * p.y, 0.0, 0.0)).collect();
    let settings = TwinSettings { head_motion: false, ..small() };
    let t = Twin::displaced(&face, last.clone(), &settings).unwrap();
    assert_eq!((&t.last, t.camera), (&last, twin(&settings).camera));
    let (half, _) = t.moment(&face, 0.5);
    for (v, p) in half.iter().enumerate() {
        let middle = t.camera.image_from_face(&nalgebra::center(&t.first[v], &t.last[v]));
        assert!((p - middle).norm() < 1e-9);
    }
    // An affine motion takes a crossing where it takes its place in face space.
    let crossings = t.crossings(&face);
    assert!(crossings.len() > 50);
    for c in &crossings {
        let ray = t.camera.ray(&c.first_in_image);
        let at = Surface::new(face.mesh()).over(&Point2::new(f64::from(c.column) * 8.0, f64::from(c.row) * 8.0), 1e3);
        let at = at.unwrap().point;
        assert!((ray.origin + ray.direction * ((at.z - ray.origin.z) / ray.direction.z) - at).norm() < 1e-9);
        let there = t.camera.image_from_face(&(at + Vector3::new(0.05 * at.y, 0.0, 0.0)));
        assert!((there - c.last_in_image).norm() < 1e-9);
    }
    // The same skin at rest is the same picture; moved, it is another.
    let rest = Twin::displaced(&face, t.first.clone(), &settings).unwrap();
    let [first, still] = rest.render(&face);
    assert_eq!(first, still);
    let [_, moved] = t.render(&face);
    assert_ne!(first, moved);
}

/// Middle of a dark line across a row of pixels near x: the centre of gravity of what is darker than the skin beside it.
fn dark_middle(picture: &RgbImage, x: f64, y: u32, reach: i32) -> f64 {
    let at = |i: i32| f64::from(picture.get_pixel((x as i32 + i) as u32, y).0[0]);
    let (left, right) = (at(-reach), at(reach));
    let (mut weight, mut sum) = (0.0, 0.0);
    for i in -reach..=reach {
        let skin = left + (right - left) * f64::from(i + reach) / f64::from(2 * reach);
        // The grain of the skin is below a tenth of the ink's darkness.
        let dark = (skin - at(i) - 30.0).max(0.0);
        weight += dark;
        sum += dark * (f64::from(x as i32 + i) + 0.5);
    }
    sum / weight
}

#[test]
fn painted_lines_lie_where_the_truth_says_in_both_frames() {
    let face = generic();
    let settings = TwinSettings { sensor_noise: 0.0, amplitude: 0.8, ..TwinSettings::default() };
    let t = twin(&settings);
    let pictures = t.render(&face);
    let surface = Surface::new(face.mesh());
    let raise = BrowRaise { amplitude: settings.amplitude };
    let mut worst = [0.0_f64; 2];
    // Upright lines on the forehead, between the level ones (which run at multiples of 8 mm).
    for x in [-32.0, -24.0, -16.0, -8.0, 0.0, 8.0, 16.0, 24.0, 32.0] {
        for y in [36.0, 44.0, 52.0, 60.0] {
            let first = surface.over(&Point2::new(x, y), 10.0).unwrap();
            let last = surface.slide(&first, &raise.displacement(&Point2::new(x, y))).point;
            let places = [
                t.camera.image_from_face(&first.point),
                t.camera.image_from_face(&t.head_motion.last_from_first(&last)),
            ];
            for (frame, place) in places.iter().enumerate() {
                let row = place.y.floor() as u32;
                let seen = dark_middle(&pictures[frame], place.x, row, 7);
                // The row's middle is up to half a pixel from the place; the lines lean by a tenth at most.
                worst[frame] = worst[frame].max((seen - place.x).abs());
            }
        }
    }
    assert!(worst[0] < 0.3 && worst[1] < 0.3, "{worst:?} px");
}

#[test]
fn marking_noise_has_the_size_asked_for() {
    let t = twin(&TwinSettings { noise_px: 0.7, ..small() });
    let marks = t.marks_in_image();
    let pairs = marks[0].iter().zip(&t.first_in_image).chain(marks[1].iter().zip(&t.last_in_image));
    let squares: Vec<f64> = pairs.flat_map(|(m, p)| [(m.x - p.x).powi(2), (m.y - p.y).powi(2)]).collect();
    let sigma = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // 2448 numbers: standard error 0.7 / √4896 = 0.01.
    assert!((sigma - 0.7).abs() < 0.04, "{sigma}");
    assert_eq!(twin(&small()).marks_in_image()[1], twin(&small()).last_in_image);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let face = generic();
    let wrong = TwinSettings { amplitude: f64::NAN, ..TwinSettings::default() };
    assert_eq!(Twin::generate(&face, &wrong).unwrap_err().setting, "amplitude");
    let wrong = TwinSettings { size_px: 9000, ..TwinSettings::default() };
    assert!(Twin::generate(&face, &wrong).unwrap_err().to_string().contains("size_px is 9000"));
}

#[test]
fn the_photograph_shows_a_face_on_a_plain_background() {
    let picture = &twin(&small()).render(&generic())[0];
    let share = |test: fn([u8; 3]) -> bool| {
        picture.pixels().filter(|p| test(p.0)).count() as f64 / f64::from(picture.width() * picture.height())
    };
    // Skin is redder than it is blue; the background is not.
    assert!((0.2..0.6).contains(&share(|[r, _, b]| i32::from(r) - i32::from(b) > 30)));
    assert!((0.25..0.6).contains(&share(|[r, g, b]| r.abs_diff(b) < 25 && g.abs_diff(b) < 15 && b > 120)));
    assert_eq!(raster::colour([255, 0, 51]), [1.0, 0.0, 0.2]);
}
