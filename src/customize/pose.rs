//! Alignment with the head's pose: turn, shift and two scales together, by least squares, instead of shift and scale alone.
//!
//! A head that nods by 5° lowers its forehead by 6 mm against its chin and hardly changes the picture's ranges. What shows the nod is
//! that places in front (the nose) move against places behind (the temples). The thesis's alignment cannot follow that; this
//! one weighs it against how much faces differ, and against how straight people look into a camera.

use nalgebra::{Matrix2x3, Point2, Point3, Rotation3, SMatrix, SVector, Vector2, Vector3};

use super::align::{self, Alignment};
use crate::camera::Camera;

/// How far a landmark lies from where the turned and scaled mean face has it, mm, where the skin faces the camera: people's
/// proportions differ by 2 to 5 mm (standard deviation), and so do landmarks from one hand to the next.
const LANDMARK_MM: f64 = 3.0;
/// Misses of so many times that are no longer believed as much as the others: a mark in the wrong place does not turn the head.
const FAR: f64 = 2.0;
/// Least part of a landmark's normal that counts as facing the camera.
const STEEPEST: f64 = 0.1;
/// How far from straight people hold their heads for such a picture, about each axis, rad (4.6°).
const TURN: f64 = 0.08;
/// How much width and height of a face differ from each other, as a logarithm (5 %).
const STRETCH: f64 = 0.05;
/// How far the size may be from the camera's scale, as a logarithm: decides only where a single landmark is marked.
const SIZE: f64 = 0.3;
/// Steps at most; two or three dozen are enough for faces.
const MOST_STEPS: usize = 300;
/// A step of less than this, in the prior's standard deviations, is the end.
const DONE: f64 = 1e-11;

/// Turn (rotation vector, rad), logarithms of the two scales, shift along x and y (mm).
type Unknowns = SVector<f64, 7>;

/// An alignment, and how well the landmarks tell it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The alignment.
    pub alignment: Alignment,
    /// Standard error of the turn about x (nod), y (shake) and z (tilt), rad.
    pub turn_sigma: [f64; 3],
}

/// The alignment whose projection comes closest to the marks (px, in the order of `landmarks`, mm, all in front of the camera).
///
/// x ↦ c + t + R diag(s_x, s_y, `z_factor` √(s_x s_y)) (x − c),   c the landmarks' centre, t = (t_x, t_y, 0)
///
/// minimises Σ c² ln(1 + r²/c²) + ‖R‖² / σ_turn² + (ln s_x/s_y)² / σ_stretch² + (ln √(s_x s_y))² / σ_size²
///
/// with r = n_z^1.5 ‖f_p(x) − mark‖ / σ (in mm on the view plane), c = 2. n_z is how far the face's skin faces the camera at the landmark
/// (`facing`, 0 to 1): a place on the outline, as the corner of the jaw, slides along it from person to person and from hand to hand, by
/// more than a nod moves it. The logarithm (Cauchy's) keeps a few marks in wrong places from ruling. Found by reweighted Gauss–Newton steps,
/// halved where needed, from the thesis's alignment. The last three terms are what is known without a mark; with fewer than three
/// landmarks they decide. Without a landmark nothing moves.
pub fn align(landmarks: &[Point3<f64>], facing: &[f64], marks: &[Point2<f64>], camera: &Camera, z_factor: f64) -> Pose {
    if landmarks.is_empty() {
        return Pose { alignment: align::align(landmarks, marks, camera, z_factor), turn_sigma: [TURN; 3] };
    }
    let fit = Fit::new(landmarks, facing, marks, camera, z_factor);
    let start = align::align(landmarks, marks, camera, z_factor);
    let shift = start.to - start.from;
    let mut at = Unknowns::zeros();
    at[3] = start.scale.x.ln();
    at[4] = start.scale.y.ln();
    // The start scales about another point: brought to the same place at the landmarks' centre.
    let centre = start.apply(&fit.centre);
    at[5] = centre.x - fit.centre.x;
    at[6] = centre.y - fit.centre.y;
    if !fit.cost(&at).is_finite() {
        at = Unknowns::zeros();
        (at[5], at[6]) = (shift.x, shift.y);
    }
    let mut cost = fit.cost(&at);
    for _ in 0..MOST_STEPS {
        let (gradient, curvature) = fit.slopes(&at);
        let Some(step) = curvature.cholesky().map(|c| c.solve(&-gradient)) else { break };
        // Near the end costs differ by rounding only: a full step is then the best guess.
        let slack = 1e-12 * cost;
        let tried = (0..30).map(|halvings| at + step * 0.5_f64.powi(halvings));
        let Some((next, next_cost)) = tried.map(|u| (u, fit.cost(&u))).find(|(_, c)| *c <= cost + slack) else { break };
        let moved = (next - at).component_div(&Unknowns::from(SIZES)).amax();
        (at, cost) = (next, next_cost);
        if moved < DONE {
            break;
        }
    }
    let covariance = fit.slopes(&at).1.try_inverse().unwrap_or_else(SMatrix::zeros);
    let turn_sigma = [0, 1, 2].map(|i| covariance[(i, i)].max(0.0).sqrt());
    Pose { alignment: fit.alignment(&at), turn_sigma }
}

/// Sizes of the unknowns, to measure steps by.
const SIZES: [f64; 7] = [TURN, TURN, TURN, STRETCH, STRETCH, LANDMARK_MM, LANDMARK_MM];

struct Fit<'a> {
    landmarks: &'a [Point3<f64>],
    /// n_z³/σ² of each landmark, 1/mm².
    weights: Vec<f64>,
    /// Marks on the view plane, mm.
    marks: Vec<Vector2<f64>>,
    camera: &'a Camera,
    centre: Point3<f64>,
    z_factor: f64,
}

impl<'a> Fit<'a> {
    fn new(
        landmarks: &'a [Point3<f64>],
        facing: &[f64],
        marks: &[Point2<f64>],
        camera: &'a Camera,
        z_factor: f64,
    ) -> Self {
        let centre = landmarks.iter().map(|x| x.coords).sum::<Vector3<f64>>() / landmarks.len() as f64;
        let weight = |n_z: &f64| n_z.max(STEEPEST).powi(3) / (LANDMARK_MM * LANDMARK_MM);
        let on_plane = |p: &Point2<f64>| camera.face_from_image(p, camera.z_vp_mm).coords.xy();
        Self {
            landmarks,
            weights: facing.iter().map(weight).collect(),
            marks: marks.iter().map(on_plane).collect(),
            camera,
            centre: centre.into(),
            z_factor,
        }
    }

    fn alignment(&self, u: &Unknowns) -> Alignment {
        let (x, y) = (u[3].exp(), u[4].exp());
        Alignment {
            from: self.centre,
            to: self.centre + Vector3::new(u[5], u[6], 0.0),
            scale: Vector3::new(x, y, self.z_factor * (x * y).sqrt()),
            turn: Rotation3::new(u.fixed_rows::<3>(0).into_owned()),
        }
    }

    /// Projection on the view plane, mm, and its slope.
    fn project(&self, x: &Point3<f64>) -> (Vector2<f64>, Matrix2x3<f64>) {
        let depth = self.camera.z_prp_mm - x.z;
        let shrink = (self.camera.z_prp_mm - self.camera.z_vp_mm) / depth;
        let slope = Matrix2x3::new(shrink, 0.0, shrink * x.x / depth, 0.0, shrink, shrink * x.y / depth);
        (x.coords.xy() * shrink, slope)
    }

    /// Half the sum of squares; infinite where a landmark is not seen.
    fn cost(&self, u: &Unknowns) -> f64 {
        let alignment = self.alignment(u);
        let mut sum = 0.0;
        for ((landmark, mark), weight) in self.landmarks.iter().zip(&self.marks).zip(&self.weights) {
            let x = alignment.apply(landmark);
            if !self.camera.sees(&x) {
                return f64::INFINITY;
            }
            sum += FAR * FAR * ((self.project(&x).0 - mark).norm_squared() * weight / (FAR * FAR)).ln_1p();
        }
        let (stretch, size) = (u[3] - u[4], f64::midpoint(u[3], u[4]));
        sum += u.fixed_rows::<3>(0).norm_squared() / (TURN * TURN);
        sum += stretch * stretch / (STRETCH * STRETCH) + size * size / (SIZE * SIZE);
        if sum.is_finite() { 0.5 * sum } else { f64::INFINITY }
    }

    /// Gradient and Gauss–Newton curvature of the cost.
    fn slopes(&self, u: &Unknowns) -> (Unknowns, SMatrix<f64, 7, 7>) {
        let alignment = self.alignment(u);
        let turn_slope = left_jacobian(&u.fixed_rows::<3>(0).into_owned());
        let mut gradient = Unknowns::zeros();
        let mut curvature = SMatrix::<f64, 7, 7>::zeros();
        for ((landmark, mark), &weight) in self.landmarks.iter().zip(&self.marks).zip(&self.weights) {
            let x = alignment.apply(landmark);
            let scaled = alignment.scale.component_mul(&(landmark - self.centre));
            let arm = alignment.turn * scaled;
            let (projected, slope) = self.project(&x);
            let mut moved = SMatrix::<f64, 3, 7>::zeros();
            // A further small turn δ moves the arm by δ × arm.
            moved.fixed_columns_mut::<3>(0).copy_from(&(-arm.cross_matrix() * turn_slope));
            let half_depth = Vector3::new(0.0, 0.0, 0.5 * scaled.z);
            moved.set_column(3, &(alignment.turn * (Vector3::new(scaled.x, 0.0, 0.0) + half_depth)));
            moved.set_column(4, &(alignment.turn * (Vector3::new(0.0, scaled.y, 0.0) + half_depth)));
            moved[(0, 5)] = 1.0;
            moved[(1, 6)] = 1.0;
            let row = slope * moved;
            let miss = projected - mark;
            let believed = weight / (1.0 + miss.norm_squared() * weight / (FAR * FAR));
            gradient += row.transpose() * miss * believed;
            curvature += row.transpose() * row * believed;
        }
        for i in 0..3 {
            gradient[i] += u[i] / (TURN * TURN);
            curvature[(i, i)] += 1.0 / (TURN * TURN);
        }
        let (of_stretch, of_size) = (1.0 / (STRETCH * STRETCH), 0.25 / (SIZE * SIZE));
        for (i, j, sign) in [(3, 3, 1.0), (4, 4, 1.0), (3, 4, -1.0), (4, 3, -1.0)] {
            gradient[i] += (sign * of_stretch + of_size) * u[j];
            curvature[(i, j)] += sign * of_stretch + of_size;
        }
        (gradient, curvature)
    }
}

/// How a rotation turns further when its rotation vector changes: exp(ω + δ) ≈ exp(J δ) exp(ω).
fn left_jacobian(turn: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    let (a, b) = if angle < 1e-4 {
        (0.5, 1.0 / 6.0)
    } else {
        ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / angle.powi(3))
    };
    nalgebra::Matrix3::identity() + cross * a + cross * cross * b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::face::patches::Noise;

    fn camera() -> Camera {
        Camera { principal_point_px: Point2::new(518.0, 400.0), z_prp_mm: 900.0, z_vp_mm: 10.0, px_per_mm: 4.0 }
    }

    fn landmarks() -> Vec<Point3<f64>> {
        let face = face::generic();
        face.landmarks().iter().map(|l| face.mesh().positions()[l.vertex as usize]).collect()
    }

    /// Every landmark faces the camera.
    const FACING: [f64; 32] = [1.0; 32];

    fn posed(turn: Vector3<f64>, scale: Vector3<f64>, shift: Vector3<f64>) -> Alignment {
        Alignment { from: Point3::origin(), to: shift.into(), scale, turn: Rotation3::new(turn) }
    }

    /// Turned by 8° and 5°, larger by a tenth, marked without error: what comes back is the turn, drawn to zero by the prior a little.
    #[test]
    fn a_turned_head_is_found() {
        let truth = posed(Vector3::new(0.14, -0.09, 0.05), Vector3::new(1.1, 1.07, 1.08), Vector3::new(7.0, -9.0, 0.0));
        let x = landmarks();
        let marks: Vec<_> = x.iter().map(|x| camera().image_from_face(&truth.apply(x))).collect();
        let pose = align(&x, &FACING, &marks, &camera(), 1.0);
        let turn = pose.alignment.turn.scaled_axis();
        for i in 0..3 {
            let off = turn[i] - truth.turn.scaled_axis()[i];
            assert!(
                off.abs() < 0.25 * truth.turn.scaled_axis()[i].abs() && off.abs() < 1.5 * pose.turn_sigma[i],
                "{i}: {off} {:?}",
                pose.turn_sigma
            );
        }
        assert!(
            pose.turn_sigma[0] > 0.01 && pose.turn_sigma[0] < 0.05 && pose.turn_sigma[2] < 0.01,
            "{:?}",
            pose.turn_sigma
        );
        let worst = x.iter().zip(&marks).map(|(x, m)| (camera().image_from_face(&pose.alignment.apply(x)) - m).norm());
        assert!(worst.fold(0.0, f64::max) < 8.0, "2 mm");
    }

    #[test]
    fn the_slopes_are_those_of_the_cost() {
        let x = landmarks();
        let mut noise = Noise(5);
        let marks: Vec<_> = x
            .iter()
            .map(|x| camera().image_from_face(x) + Vector2::new(noise.normal(), noise.normal()) * 9.0)
            .collect();
        let camera = camera();
        let facing: Vec<f64> = (0..32).map(|k| 1.0 - f64::from(k) * 0.02).collect();
        let fit = Fit::new(&x, &facing, &marks, &camera, 1.1);
        for at in [
            Unknowns::zeros(),
            Unknowns::from([0.3, -0.2, 0.5, 0.1, -0.2, 5.0, -3.0]),
            Unknowns::from([1e-6, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]),
        ] {
            let (gradient, _) = fit.slopes(&at);
            for i in 0..7 {
                let h = 1e-6;
                let mut step = Unknowns::zeros();
                step[i] = h;
                let difference = (fit.cost(&(at + step)) - fit.cost(&(at - step))) / (2.0 * h);
                assert!(
                    (difference - gradient[i]).abs() < 1e-4 * (1.0 + gradient[i].abs()),
                    "{i}: {difference} {}",
                    gradient[i]
                );
            }
        }
    }

    /// The pose of a face that was itself made with this alignment is found again to rounding: the twins rely on it.
    #[test]
    fn the_end_does_not_depend_on_the_units_of_the_picture() {
        let x = landmarks();
        let mut noise = Noise(11);
        let other = Camera { principal_point_px: Point2::new(3.0, 1.0), px_per_mm: 0.37, ..camera() };
        let moved: Vec<Point3<f64>> = x
            .iter()
            .map(|x| Point3::new(x.x * 1.05 + 3.0 * noise.normal(), x.y * 0.95 + 3.0 * noise.normal(), x.z))
            .collect();
        let [a, b] = [camera(), other].map(|c| {
            let marks: Vec<_> = moved.iter().map(|x| c.image_from_face(x)).collect();
            align(&x, &FACING, &marks, &c, 1.0).alignment
        });
        assert!(x.iter().all(|x| (a.apply(x) - b.apply(x)).norm() < 1e-9));
    }

    #[test]
    fn few_landmarks_do_not_turn_the_head() {
        let x = landmarks();
        let none = align(&[], &[], &[], &camera(), 1.0);
        assert_eq!((none.alignment.scale, none.alignment.turn), (Vector3::repeat(1.0), Rotation3::identity()));
        let seen = |x: &Point3<f64>| camera().image_from_face(&(x + Vector3::new(20.0, 5.0, 0.0)));
        let one = align(&x[..1], &FACING[..1], &[seen(&x[0])], &camera(), 1.0).alignment;
        assert!((one.apply(&x[0]) - x[0] - Vector3::new(20.0, 5.0, 0.0)).norm() < 1e-6 && one.turn.angle() < 1e-9);
        assert!((one.scale - Vector3::repeat(1.0)).norm() < 1e-6, "{}", one.scale);
        let two = align(&x[..2], &FACING[..2], &[seen(&x[0]), seen(&x[1])], &camera(), 1.0).alignment;
        assert!(
            two.turn.angle() < 0.05 && (two.scale - Vector3::repeat(1.0)).norm() < 0.05,
            "{} {}",
            two.scale,
            two.turn.angle()
        );
    }
}
