//! The chain against hand calculation, finite draws and its own invariants.

use nalgebra::{Point2, Point3, UnitQuaternion, Vector3};

use super::{Outcome, Peak, Warning, Workspace, error_causes, solve};
use crate::camera::{Camera, RigidMotion, Scale};
use crate::displacement::regularised::WeightRule;
use crate::displacement::{DepthRule, UnmarkedRule, VertexState};
use crate::face::patches::{Noise, right_angled};
use crate::face::{FaceModel, FaceParts, Landmark};
use crate::project::{Edit, Feature, FieldWay, FrameRef, Mark, MarkState, PointId, Project, Role};

const N: usize = 15;
const SIZE: [u32; 2] = [1000, 1000];
/// What [`project`] tells the chain of the camera.
const CAMERA: Camera =
    Camera { principal_point_px: Point2::new(500.0, 500.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 6.0 };

/// A dome z = −r²/200, 15 × 15 vertices at a pitch of 8 mm, with four corners and two eye corners for landmarks.
fn face() -> FaceModel {
    let flat = right_angled(N, N, 8.0, 8.0);
    let bend = |p: &Point3<f64>| {
        let (x, y) = (p.x - 56.0, p.y - 56.0);
        Point3::new(x, y, -(x * x + y * y) / 200.0)
    };
    let mesh = flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap();
    let named = [("eye_inner_right", 7 * N + 5), ("eye_inner_left", 7 * N + 9)].into_iter();
    let corners = [("a", 0), ("b", N - 1), ("c", N * (N - 1)), ("d", N * N - 1)];
    let landmarks = named
        .chain(corners)
        .map(|(id, v)| Landmark { id: id.into(), name: id.into(), vertex: v as u32, ..Landmark::default() })
        .collect();
    let mirror = vec![None; N * N];
    FaceModel::new(mesh, FaceParts { name: "dome".into(), landmarks, mirror, ..FaceParts::default() }).unwrap()
}

/// The dome with every landmark marked at the truth and a true scale, so that customisation changes nothing.
fn project(face: &FaceModel) -> Project {
    let mut p = Project::default();
    p.settings.customize.z_factor = 1.0;
    p.scale = Scale::TwoPoints { a_px: [0.0, 0.0], b_px: [60.0, 0.0], mm: 10.0 };
    for l in face.landmarks() {
        let at = CAMERA.image_from_face(&face.mesh().positions()[l.vertex as usize]);
        p.landmarks.insert(l.id.clone(), Mark::new([at.x, at.y]));
    }
    p
}

/// A bulge of the middle of the dome in its own plane: z stays, as `FixedDepth` takes it.
fn moved(x: &Point3<f64>) -> Point3<f64> {
    let grow = 3.0 * (-(x.x * x.x + x.y * x.y) / 600.0).exp();
    Point3::new(x.x + 0.3 * grow, x.y + grow, x.z)
}

fn mark(p: &mut Project, v: usize, at: Point2<f64>) {
    p.features.entry(v as u32).or_default().last = Some(Mark::new([at.x, at.y]));
}

fn mark_all(p: &mut Project, face: &FaceModel, which: impl Fn(usize) -> bool) {
    for (v, x) in face.mesh().positions().iter().enumerate().filter(|(v, _)| which(*v)) {
        mark(p, v, CAMERA.image_from_face(&moved(x)));
    }
}

fn run(p: &Project, face: &FaceModel) -> Outcome {
    solve(p, face, SIZE, &mut Workspace::default())
}

/// F on one vertex by the plainest loop over its springs: the tension of the default table, strips of the rest triangles.
fn force_by_hand(face: &FaceModel, p: &Project, o: &Outcome, v: usize) -> Vector3<f64> {
    let mesh = face.mesh();
    let mut f = Vector3::zeros();
    for &j in mesh.neighbours(v) {
        let j = j as usize;
        let rest = (o.first[j] - o.first[v]).norm();
        let area: f64 = mesh
            .triangles()
            .iter()
            .filter(|t| t.contains(&(v as u32)) && t.contains(&(j as u32)))
            .map(|t| {
                let [a, b, c] = t.map(|i| o.first[i as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum();
        let d = o.last[j] - o.last[v];
        let stress = p.settings.skin.stress_kpa(d.norm() / rest - 1.0);
        // kPa · mm² = 10⁻³ N; a stretched spring pulls v towards j, and the muscle pulls against it.
        f -= d / d.norm() * (1e-3 * p.settings.skin_thickness_mm * area / rest * stress);
    }
    f
}

#[test]
fn with_marks_at_the_truth_the_positions_and_the_forces_are_exact() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |_| true);
    p.settings.marking_sigma_px = 0.01;
    let o = run(&p, &face);
    assert!(o.fit.rms_before_px < 1e-9 && o.fit.rms_after_px < 1e-9);
    for (v, x) in face.mesh().positions().iter().enumerate() {
        assert!((o.first[v] - x).norm() < 1e-9 && (o.last[v] - moved(x)).norm() < 1e-9);
        let by_hand = force_by_hand(&face, &p, &o, v);
        assert!((o.field.force[v] - by_hand).norm() < 1e-12 * (1.0 + by_hand.norm()));
    }
    let Peak::Stands { vertex: peak, force: f, .. } = o.peak() else { panic!("{:?}", o.peak()) };
    assert!(f > 0.01 && o.field.internal_sum.norm() < 1e-12, "peak {f} N at {peak}");
    assert!(o.scale_measured && o.unit() == "N");
}

#[test]
fn head_motion_is_removed_before_depth_is_chosen() {
    let face = face();
    let head = RigidMotion {
        rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.03, 0.015)),
        translation_mm: Vector3::new(2.0, -1.0, 1.5),
        pivot: Point3::new(0.0, 0.0, -60.0),
    };
    let mut p = project(&face);
    p.settings.marking_sigma_px = 0.0;
    let rim = face.mesh().on_border();
    for (v, x) in face.mesh().positions().iter().enumerate() {
        let there = if rim[v] { *x } else { moved(x) };
        mark(&mut p, v, CAMERA.image_from_face(&head.last_from_first(&there)));
        p.features.get_mut(&(v as u32)).unwrap().role = if rim[v] { Role::Still } else { Role::Skin };
    }
    let o = run(&p, &face);
    assert!(o.head.noise_floor_px.unwrap() < 1e-3);
    for (v, x) in face.mesh().positions().iter().enumerate() {
        let truth = if rim[v] { *x } else { moved(x) };
        assert!((o.last[v] - truth).norm() < 0.01, "vertex {v}: {}", (o.last[v] - truth).norm());
    }
    // Left in, the same motion is read as skin.
    p.settings.remove_head_motion = false;
    let thesis = run(&p, &face);
    assert!(thesis.peak().force().unwrap() > 0.0 && thesis.head.still_points == 0);
    assert!((thesis.last[0] - o.last[0]).norm() > 0.5);
}

#[test]
fn the_error_of_the_still_points_reaches_skin_whose_marks_are_exact() {
    let face = face();
    let mut p = project(&face);
    p.settings.marking_sigma_px = 0.0;
    mark_all(&mut p, &face, |_| true);
    for v in [0, N - 1, N * (N - 1), N * N - 1, 7] {
        p.features.get_mut(&(v as u32)).unwrap().role = Role::Still;
    }
    assert!(run(&p, &face).field.sigma.iter().all(|s| *s == 0.0));
    for f in p.features.values_mut().filter(|f| f.role == Role::Still) {
        f.last.as_mut().unwrap().sigma_px = Some(0.3);
    }
    assert!(run(&p, &face).field.sigma[7 * N + 7] > 0.0);
}

#[test]
fn only_eye_corners_that_are_marked_measure_a_scale() {
    let face = face();
    let mut p = project(&face);
    p.scale = Scale::InnerEyeCorners { mm: 16.0 };
    let o = run(&p, &face);
    // 32 mm apart and 1.28 mm behind the view plane, said to be 16: 6 · 2 · 1000 / 1001.28.
    assert!((o.camera.px_per_mm - 12_000.0 / 1001.28).abs() < 1e-9 && o.scale_measured && o.unit() == "N");
    // A place that was only guessed is a note, never data.
    let guess = p.landmarks.get_mut("eye_inner_left").unwrap();
    (guess.at_px, guess.state) = ([900.0, 100.0], MarkState::Occluded);
    let o = run(&p, &face);
    assert!(!o.scale_measured && o.warnings.contains(&Warning::RelativeScale) && o.unit() == "relative");
    p.landmarks.remove("eye_inner_left");
    assert_eq!(run(&p, &face).camera, o.camera);
}

#[test]
fn what_is_not_marked_is_inferred_inside_unmeasured_outside_and_held_on_request() {
    let face = face();
    let mut p = project(&face);
    // A block of marks with every other vertex left out.
    mark_all(&mut p, &face, |v| (4..=10).contains(&(v % N)) && (4..=10).contains(&(v / N)) && v % 2 == 0);
    let o = run(&p, &face);
    let centre = 7 * N + 7;
    let between = if o.states[centre] == VertexState::Measured { centre + 1 } else { centre };
    assert_eq!(o.states[between], VertexState::Inferred);
    // Its four neighbours at 8 mm moved by 3 mm · exp(−64/600) and 0.3 of that across: a mean falls short of the summit by
    // 3 (1 − 0.899) √(1 + 0.3²) = 0.32 mm.
    let short = (o.last[between] - moved(&o.first[between])).norm();
    assert!(short < 0.34, "{short}");
    assert_eq!(o.states[0], VertexState::Unmeasured);
    assert_eq!((o.field.force[0], o.field.sigma[0]), (Vector3::zeros(), 0.0));
    assert!(o.border.iter().any(|b| *b) && !o.border[between]);
    assert!(o.field.internal_sum.norm() < 1e-12);
    // A prediction follows its neighbours, and fades.
    let (near, far) = (3 * N + 7, 7);
    assert!((o.last[near] - o.first[near]).norm() > (o.last[far] - o.first[far]).norm());

    p.settings.unmarked = UnmarkedRule::Held;
    let held = run(&p, &face);
    assert_eq!(held.states[between], VertexState::Fixed);
    assert_eq!(held.last[between], held.first[between]);
}

#[test]
fn an_inferred_vertex_beside_unmeasured_skin_is_border_like_a_measured_one() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |v| (4..=10).contains(&(v % N)) && (4..=10).contains(&(v / N)) && v % 2 == 0);
    let o = run(&p, &face);
    let open = |v: usize| face.mesh().neighbours(v).iter().any(|&j| o.states[j as usize] == VertexState::Unmeasured);
    let inferred = |v: &usize| o.states[*v] == VertexState::Inferred;
    let (outer, inner): (Vec<_>, Vec<_>) = (0..N * N).filter(inferred).partition(|v| open(*v));
    assert!(!outer.is_empty() && !inner.is_empty());
    assert!(outer.iter().all(|v| o.border[*v]) && !inner.iter().any(|v| o.border[*v]));
}

#[test]
fn the_largest_force_stands_above_its_error_or_there_is_none() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |_| true);
    p.settings.marking_sigma_px = 0.01;
    let mut o = run(&p, &face);
    let Peak::Stands { vertex, force, sigma } = o.peak() else { panic!("{:?}", o.peak()) };
    assert!(force > 2.0 * sigma && o.is_believed(vertex));
    // A larger force with a larger error is not the largest that can be told from noise.
    let other = (0..N * N).find(|v| o.is_believed(*v) && *v != vertex).unwrap();
    o.field.force[other] = Vector3::new(3.0 * force, 0.0, 0.0);
    o.field.sigma[other] = 1.6 * force;
    assert_eq!(o.peak(), Peak::Stands { vertex, force, sigma });
    assert_eq!(o.field.largest(&o.states).unwrap().0, other);
    assert!(o.peak().in_words("N").starts_with("largest force 0."), "{}", o.peak().in_words("N"));
    // All of them half as long as their error: hand-made, so that the median is known.
    for v in 0..N * N {
        o.field.sigma[v] = 2.0 * o.field.force[v].norm();
    }
    let Peak::Noise { median } = o.peak() else { panic!("{:?}", o.peak()) };
    assert!((median - 0.5).abs() < 1e-12);
    assert_eq!(
        o.peak().in_words("N"),
        "no force stands above twice its error; the median force is 0.50 times its error"
    );
    o.states.fill(VertexState::Unmeasured);
    assert_eq!((o.peak(), o.median_over_error(), o.vertex_to_look_at()), (Peak::Unmeasured, None, None));
}

#[test]
fn marks_outside_their_picture_are_warned_of_first() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |_| true);
    let frame = |side| FrameRef { path: "a.png".into(), sha256: "0".repeat(64), width_px: side, height_px: side };
    (p.frames.first, p.frames.last) = (Some(frame(1000)), Some(frame(1000)));
    assert!(!run(&p, &face).warnings.iter().any(|w| matches!(w, Warning::OutsidePicture { .. })));
    p.frames.last = Some(frame(300));
    let beyond = p.features.values().filter(|f| f.last.unwrap().at_px.iter().any(|c| *c > 300.0)).count();
    let o = run(&p, &face);
    assert!(matches!(o.warnings[0], Warning::OutsidePicture { count, .. } if count == beyond), "{:?}", o.warnings);
}

#[test]
fn the_standard_error_is_the_spread_of_repeated_marking() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |v| v % 3 != 0 || v == 7 * N + 6);
    p.settings.marking_sigma_px = 0.05;
    let stated = run(&p, &face);
    let mut noise = Noise(12345);
    let mut squares = vec![0.0; N * N];
    let mut workspace = Workspace::default();
    let draws = 600;
    for _ in 0..draws {
        let mut q = p.clone();
        for f in q.features.values_mut() {
            let m = f.last.as_mut().unwrap();
            m.at_px = [m.at_px[0] + 0.05 * noise.normal(), m.at_px[1] + 0.05 * noise.normal()];
        }
        let o = solve(&q, &face, SIZE, &mut workspace);
        for (sum, (drawn, meant)) in squares.iter_mut().zip(o.field.force.iter().zip(&stated.field.force)) {
            *sum += (drawn - meant).norm_squared();
        }
    }
    let mut ratios = Vec::new();
    for v in (0..N * N).filter(|&v| stated.states[v].is_known()) {
        let spread = (squares[v] / f64::from(draws)).sqrt();
        ratios.push(spread / stated.field.sigma[v]);
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    // 600 draws of a length with 2–3 degrees of freedom: each ratio is good to about 4 %, their mean far better.
    assert!((mean - 1.0).abs() < 0.02, "mean ratio {mean}");
    assert!(ratios.iter().all(|r| (0.8..1.2).contains(r)), "{ratios:?}");
}

#[test]
fn what_the_workspace_remembers_changes_nothing() {
    let face = face();
    let mut p = project(&face);
    let mut workspace = Workspace::default();
    mark_all(&mut p, &face, |v| v % 2 == 0);
    for step in 0..9 {
        match step {
            1 => mark(&mut p, 100, Point2::new(512.0, 480.0)),
            2 => p.settings.depth = DepthRule::SlideOnSurface,
            // And once more with heights, which are kept.
            6 => p.settings.depth = DepthRule::HalfWay,
            7 => Edit::Put(PointId::FeatureLast(113), [505.0, 498.0]).apply(&mut p).unwrap(),
            3 => Edit::Clear(PointId::FeatureLast(112)).apply(&mut p).unwrap(),
            4 => Edit::Put(PointId::Landmark("a".into()), [160.0, 830.0]).apply(&mut p).unwrap(),
            5 => Edit::Put(PointId::FeatureFirst(112), [505.0, 498.0]).apply(&mut p).unwrap(),
            _ => {}
        }
        assert_eq!(solve(&p, &face, SIZE, &mut workspace), run(&p, &face), "after step {step}");
    }
}

#[test]
fn an_empty_project_and_a_strange_one_have_an_outcome() {
    let face = face();
    let empty = run(&Project::default(), &face);
    assert!(empty.states.iter().all(|s| *s == VertexState::Unmeasured));
    assert!(empty.warnings.is_empty(), "nothing is amiss before anything is marked: {:?}", empty.warnings);
    let one = Project { landmarks: [("nasion".into(), Mark::new([1.0, 1.0]))].into(), ..Project::default() };
    assert!(run(&one, &face).warnings.contains(&Warning::RelativeScale));
    assert!(empty.first_in_image.iter().all(|p| p.x.is_finite() && (0.0..1000.0).contains(&p.y)));

    let mut strange = project(&face);
    strange.landmarks.insert("no_such".into(), Mark::new([1.0, 1.0]));
    strange.features.insert(99_999, Feature { last: Some(Mark::new([5.0, 5.0])), ..Feature::default() });
    for mark in strange.landmarks.values_mut() {
        mark.at_px = [500.0, 500.0];
    }
    mark(&mut strange, 3, Point2::new(1e6, -1e6));
    let o = run(&strange, &face);
    assert!(o.warnings.iter().any(|w| matches!(w, Warning::NotInFace { what } if what == "landmark no_such")));
    assert!(o.field.force.iter().chain([&o.field.internal_sum]).all(|f| f.iter().all(|c| c.is_finite())));
}

#[test]
fn a_point_pinned_in_the_first_frame_slides_on_the_surface() {
    let face = face();
    let mut p = project(&face);
    let target = Point2::new(509.0, 493.0);
    Edit::Put(PointId::FeatureFirst(112), [target.x, target.y]).apply(&mut p).unwrap();
    let o = run(&p, &face);
    assert!((o.first_in_image[112] - target).norm() < 1e-9);
    // 1.5 mm and 1.17 mm from the top of the dome: the facet there is at most (1.5 + 1.17) · 8 / 200 below it.
    assert!(o.first[112].z <= 0.0 && o.first[112].z > -0.12);
}

/// Marks with an error of 1 px on a smooth raise of the dome: the regularised forces are nearer to those of the true places than the
/// direct ones, and their errors are as large as they are said to be.
#[test]
fn a_regularised_field_is_nearer_to_the_truth_and_says_how_near() {
    let face = face();
    let mut exact = project(&face);
    mark_all(&mut exact, &face, |_| true);
    let truth = run(&exact, &face).field.force;
    let (mut gains, mut ratios) = (Vec::new(), Vec::new());
    for seed in 1..=20 {
        let mut noisy = exact.clone();
        let mut noise = Noise(seed);
        for feature in noisy.features.values_mut().filter(|f| f.role == Role::Skin) {
            if let Some(mark) = &mut feature.last {
                mark.at_px[0] += noise.normal();
                mark.at_px[1] += noise.normal();
            }
        }
        let miss = |o: &Outcome| {
            let inner = || (0..truth.len()).filter(|&v| o.states[v].is_known() && !o.border[v]);
            let error: f64 = inner().map(|v| (o.field.force[v] - truth[v]).norm_squared()).sum();
            (error.sqrt(), (error / inner().map(|v| o.field.sigma[v].powi(2)).sum::<f64>()).sqrt())
        };
        let direct = miss(&run(&noisy, &face)).0;
        for weight in WeightRule::ALL {
            noisy.settings.field = FieldWay::Regularised { weight };
            let outcome = run(&noisy, &face);
            assert!(outcome.smoothing.is_some());
            let (error, ratio) = miss(&outcome);
            gains.push((weight, direct / error));
            ratios.push(ratio);
        }
    }
    for rule in WeightRule::ALL {
        let mut of_rule: Vec<f64> = gains.iter().filter(|g| g.0 == rule).map(|g| g.1).collect();
        of_rule.sort_by(f64::total_cmp);
        assert!(of_rule[10] > 1.5, "{}: {of_rule:?}", rule.name());
    }
    ratios.sort_by(f64::total_cmp);
    assert!((0.4..1.3).contains(&ratios[30]), "{ratios:?}");
}

/// The causes of the errors add up to the standard errors of the measured forces.
#[test]
fn the_causes_of_errors_add_up_to_the_standard_errors() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |_| true);
    for way in [FieldWay::Direct, FieldWay::Regularised { weight: WeightRule::Discrepancy }] {
        p.settings.field = way;
        let outcome = run(&p, &face);
        let causes = error_causes(&p, &face, SIZE);
        let mut squares = vec![0.0; face.mesh().len()];
        for (v, force) in causes.iter().flatten() {
            squares[*v as usize] += force.norm_squared();
        }
        let (_, sigma) = outcome.measured();
        assert!(sigma.iter().filter(|s| **s > 0.0).count() > 10);
        for (square, sigma) in squares.iter().zip(sigma) {
            assert!((square.sqrt() - sigma).abs() <= 1e-9 * sigma.max(1e-6), "{way:?}: {} {sigma}", square.sqrt());
        }
    }
}

#[test]
fn too_few_marks_are_not_smoothed() {
    let face = face();
    let mut p = project(&face);
    for v in [100, 101, 112] {
        mark(&mut p, v, Point2::new(500.0 + v as f64, 480.0));
    }
    let direct = run(&p, &face);
    p.settings.field = FieldWay::Regularised { weight: WeightRule::Discrepancy };
    let outcome = run(&p, &face);
    assert!(outcome.smoothing.is_none());
    assert_eq!(outcome.field, direct.field);
}

/// A vertex that a hand holds at its place on the head is held there after smoothing, too, however its neighbours go.
#[test]
fn smoothing_moves_no_fixed_vertex() {
    let face = face();
    let mut p = project(&face);
    mark_all(&mut p, &face, |v| v != 112);
    p.features.insert(112, Feature { role: Role::Fixed, ..Feature::default() });
    p.settings.field = FieldWay::Regularised { weight: WeightRule::Discrepancy };
    let outcome = run(&p, &face);
    assert_eq!(outcome.states[112], VertexState::Fixed);
    assert_eq!(outcome.last[112], outcome.first[112]);
    assert_eq!(outcome.smoothing.unwrap().marks, N * N);
}
