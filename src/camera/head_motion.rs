//! The rigid motion of the head between the two frames, estimated from points of skin that do not move with the expression.

use nalgebra::{Matrix2x6, Matrix3x6, Matrix6, Matrix6x2, Point2, Point3, UnitQuaternion, Vector3, Vector6};

use super::projection::{Camera, Ray};

/// A rotation about a pivot followed by a translation: x ↦ R (x − c) + c + t, mm, from the head in the first frame to the head in the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// R.
    pub rotation: UnitQuaternion<f64>,
    /// t, mm.
    pub translation_mm: Vector3<f64>,
    /// c, mm.
    pub pivot: Point3<f64>,
}

impl Default for RigidMotion {
    fn default() -> Self {
        Self { rotation: UnitQuaternion::identity(), translation_mm: Vector3::zeros(), pivot: Point3::origin() }
    }
}

impl RigidMotion {
    /// Where a point of the first frame's head stands in the last frame.
    pub fn last_from_first(&self, x: &Point3<f64>) -> Point3<f64> {
        self.pivot + self.rotation * (x - self.pivot) + self.translation_mm
    }

    /// The ray of a last-frame pixel, seen from the head as it stood in the first frame.
    pub fn first_from_last_ray(&self, ray: &Ray) -> Ray {
        let back = self.rotation.inverse();
        Ray {
            origin: self.pivot + back * (ray.origin - self.pivot - self.translation_mm),
            direction: back * ray.direction,
        }
    }
}

/// What the still points say of the head.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadMotion {
    /// The motion; the identity where there were too few still points.
    pub motion: RigidMotion,
    /// Number of still points used; 0 means that nothing was removed, as in the thesis.
    pub still_points: usize,
    /// Distance of each still point from where the motion puts it, px, in the order given.
    pub residuals_px: Vec<f64>,
    /// Root mean square of the residuals along one axis, over the degrees of freedom left, px. Absent with 3 points or fewer.
    pub noise_floor_px: Option<f64>,
    /// Covariance of (rotation vector rad, translation mm) for marks of the given standard deviation.
    pub covariance: Matrix6<f64>,
    /// How (rotation vector, translation) follows the mark of each still point, in the order given, rad and mm per px.
    pub follows: Vec<Matrix6x2<f64>>,
}

impl Default for HeadMotion {
    fn default() -> Self {
        Self {
            motion: RigidMotion::default(),
            still_points: 0,
            residuals_px: Vec::new(),
            noise_floor_px: None,
            covariance: Matrix6::zeros(),
            follows: Vec::new(),
        }
    }
}

/// A still point: where it is on the first frame's head, where it was marked in the last frame, and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillPoint {
    /// Position in the first frame, mm.
    pub first: Point3<f64>,
    /// Mark in the last frame.
    pub last_in_image: Point2<f64>,
    /// Standard deviation of the mark along each axis, px.
    pub sigma_px: f64,
}

/// Fewest still points from which a motion is read: three fix the six numbers.
pub const FEWEST_STILL_POINTS: usize = 3;

/// Expected size of what a frontal picture hardly shows: turns of the head (rad) and its motion in depth (mm).
///
/// A prior of this spread keeps the estimate finite when the still points lie close together; heads that were asked to
/// keep still turn a few degrees and come a few millimetres nearer.
const PRIOR_ROTATION_RAD: f64 = 0.05;
const PRIOR_DEPTH_MM: f64 = 5.0;
/// In the picture's plane the motion is free: a spread so wide that it never acts.
const PRIOR_PLANE_MM: f64 = 500.0;

/// Least-squares rigid motion from still points: minimise Σ |proj(R (x − c) + c + t) − p|² / σ² plus a weak prior,
/// by Gauss–Newton on the rotation vector and the translation about the points' centroid c.
///
/// With fewer than [`FEWEST_STILL_POINTS`] points nothing is removed.
pub fn estimate(camera: &Camera, points: &[StillPoint]) -> HeadMotion {
    if points.len() < FEWEST_STILL_POINTS { HeadMotion::default() } else { most_likely(camera, points) }
}

/// The likeliest motion for as many still points as there are: one gives a shift in the picture, two also a tilt of the head, and
/// what they do not show stays at the prior's zero. Good for predicting where points went; too few to remove the motion from data.
pub fn most_likely(camera: &Camera, points: &[StillPoint]) -> HeadMotion {
    if points.is_empty() {
        return HeadMotion::default();
    }
    let centroid = points.iter().map(|p| p.first.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let mut motion = RigidMotion { pivot: Point3::from(centroid), ..RigidMotion::default() };
    let prior = Matrix6::from_diagonal(&Vector6::new(
        PRIOR_ROTATION_RAD.powi(-2),
        PRIOR_ROTATION_RAD.powi(-2),
        PRIOR_ROTATION_RAD.powi(-2),
        PRIOR_PLANE_MM.powi(-2),
        PRIOR_PLANE_MM.powi(-2),
        PRIOR_DEPTH_MM.powi(-2),
    ));
    let mut normal = prior;
    let mut pulls: Vec<Matrix6x2<f64>> = Vec::with_capacity(points.len());
    for _ in 0..30 {
        normal = prior;
        pulls.clear();
        let so_far =
            Vector6::from_iterator(motion.rotation.scaled_axis().iter().chain(motion.translation_mm.iter()).copied());
        let mut gradient = prior * so_far;
        for p in points {
            // Exact marks (σ = 0) are taken for a hundredth of a pixel: only the ratio to the prior matters.
            let weight = p.sigma_px.max(0.01).powi(-2);
            let moved = motion.last_from_first(&p.first);
            let slope: Matrix2x6<f64> = camera.image_slope(&moved) * motion_slope(&motion, &p.first);
            let residual = camera.image_from_face(&moved) - p.last_in_image;
            normal += slope.transpose() * slope * weight;
            let pull = slope.transpose() * weight;
            gradient += pull * residual;
            pulls.push(pull);
        }
        let Some(step) = normal.cholesky().map(|c| -c.solve(&gradient)) else {
            return HeadMotion::default();
        };
        motion.rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned()) * motion.rotation;
        motion.translation_mm += step.fixed_rows::<3>(3);
        if step.norm() < 1e-12 {
            break;
        }
    }
    if !motion.translation_mm.iter().chain(motion.rotation.coords.iter()).all(|c| c.is_finite()) {
        return HeadMotion::default();
    }
    let residuals_px: Vec<f64> = points
        .iter()
        .map(|p| (camera.image_from_face(&motion.last_from_first(&p.first)) - p.last_in_image).norm())
        .collect();
    let freedom = 2.0 * points.len() as f64 - 6.0;
    let squares: f64 = residuals_px.iter().map(|r| r * r).sum();
    let covariance = normal.try_inverse().unwrap_or_else(Matrix6::zeros);
    HeadMotion {
        motion,
        still_points: points.len(),
        noise_floor_px: (freedom > 0.0).then(|| (squares / freedom).sqrt()),
        residuals_px,
        follows: pulls.iter().map(|pull| covariance * pull).collect(),
        covariance,
    }
}

/// Change of a moved point with a small further rotation (rad) about the pivot and a translation (mm): ∂x/∂(ω, t).
pub fn motion_slope(motion: &RigidMotion, first: &Point3<f64>) -> Matrix3x6<f64> {
    let arm = motion.rotation * (first - motion.pivot);
    let mut slope = Matrix3x6::zeros();
    slope.fixed_view_mut::<3, 3>(0, 0).copy_from(&-arm.cross_matrix());
    slope.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    slope
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera { principal_point_px: Point2::new(518.0, 518.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 }
    }

    fn points(motion: &RigidMotion) -> Vec<StillPoint> {
        // Nasion, nose bridge, inner eye corners and temples of a mean face.
        let places = [
            [0.0, 4.0, 15.0],
            [0.0, -10.0, 25.0],
            [18.4, 0.0, 0.0],
            [-18.4, 0.0, 0.0],
            [68.0, 20.0, -40.0],
            [-68.0, 20.0, -40.0],
        ];
        let still = |p: &[f64; 3]| {
            let first = Point3::from(*p);
            let last_in_image = camera().image_from_face(&motion.last_from_first(&first));
            StillPoint { first, last_in_image, sigma_px: 0.0 }
        };
        places.iter().map(still).collect()
    }

    #[test]
    fn an_exact_motion_is_recovered() {
        let truth = RigidMotion {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.015, 0.01)),
            translation_mm: Vector3::new(1.5, -0.7, 1.0),
            pivot: Point3::new(0.0, 0.0, -20.0),
        };
        let head = estimate(&camera(), &points(&truth));
        assert_eq!(head.still_points, 6);
        for p in points(&truth) {
            let there = truth.last_from_first(&p.first);
            // The prior pulls by its share of the information: a few micrometres.
            assert!((head.motion.last_from_first(&p.first) - there).norm() < 2e-2);
        }
        assert!(head.noise_floor_px.unwrap() < 1e-2);
    }

    #[test]
    fn a_ray_taken_back_passes_through_the_point_on_the_first_head() {
        let motion = RigidMotion {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.05, -0.03)),
            translation_mm: Vector3::new(3.0, 2.0, -4.0),
            pivot: Point3::new(1.0, 2.0, 3.0),
        };
        let first = Point3::new(20.0, 30.0, 10.0);
        let last = motion.last_from_first(&first);
        let ray = motion.first_from_last_ray(&camera().ray(&camera().image_from_face(&last)));
        let off = (first - ray.origin).cross(&ray.direction.normalize()).norm();
        assert!(off < 1e-9, "{off}");
    }

    /// At exact marks nothing is left over, so that the slopes of Gauss and Newton are those of the minimum itself.
    #[test]
    fn the_motion_follows_each_mark_as_central_differences_say() {
        let mut marks = points(&RigidMotion::default());
        for (p, sigma) in marks.iter_mut().zip([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) {
            p.sigma_px = sigma;
        }
        let (follows, h) = (estimate(&camera(), &marks).follows, 1e-3);
        assert_eq!(follows.len(), marks.len());
        for (k, follows) in follows.iter().enumerate() {
            for axis in 0..2 {
                let moved = |step: f64| {
                    let mut marks = marks.clone();
                    marks[k].last_in_image[axis] += step;
                    estimate(&camera(), &marks).motion
                };
                let (up, down) = (moved(h), moved(-h));
                let turn = (up.rotation * down.rotation.inverse()).scaled_axis() / (2.0 * h);
                let shift = (up.translation_mm - down.translation_mm) / (2.0 * h);
                let column = follows.column(axis);
                assert!((turn - column.fixed_rows::<3>(0)).norm() < 1e-6 * (1e-3 + turn.norm()), "{k} {axis}");
                assert!((shift - column.fixed_rows::<3>(3)).norm() < 1e-6 * (1.0 + shift.norm()), "{k} {axis}");
            }
        }
    }

    #[test]
    fn two_points_are_too_few() {
        assert_eq!(estimate(&camera(), &points(&RigidMotion::default())[..2]), HeadMotion::default());
    }

    #[test]
    fn from_the_first_point_on_the_likeliest_motion_leads_to_the_true_one() {
        let truth = RigidMotion {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.01, -0.015, 0.02)),
            translation_mm: Vector3::new(6.0, -4.0, 1.0),
            pivot: Point3::new(0.0, 0.0, -20.0),
        };
        let all = points(&truth);
        let brow = Point3::new(20.0, 30.0, 10.0);
        let there = camera().image_from_face(&truth.last_from_first(&brow));
        let off = |n: usize| {
            let motion = if n == 0 { RigidMotion::default() } else { most_likely(&camera(), &all[..n]).motion };
            (camera().image_from_face(&motion.last_from_first(&brow)) - there).norm()
        };
        // 7 mm at 4 px/mm before anything is marked; a shift alone leaves what turns of one to two degrees do 35 mm away.
        assert!(off(0) > 20.0);
        for n in 1..=6 {
            assert!(off(n) < 8.0, "{n} still points: {} px", off(n));
        }
        assert!(off(6) < 0.2, "{}", off(6));
        assert_eq!(estimate(&camera(), &all[..3]), most_likely(&camera(), &all[..3]), "no jump at the third");
    }

    #[test]
    fn the_slope_agrees_with_central_differences() {
        let m = RigidMotion {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.2, -0.1)),
            translation_mm: Vector3::new(1.0, 2.0, 3.0),
            pivot: Point3::new(4.0, 5.0, 6.0),
        };
        let (x, h) = (Point3::new(30.0, -20.0, 10.0), 1e-6);
        let slope = motion_slope(&m, &x);
        for axis in 0..3 {
            let mut w = Vector3::zeros();
            w[axis] = h;
            let turned = |w| RigidMotion { rotation: UnitQuaternion::from_scaled_axis(w) * m.rotation, ..m };
            let d = (turned(w).last_from_first(&x) - turned(-w).last_from_first(&x)) / (2.0 * h);
            assert!((d - slope.column(axis)).norm() < 1e-6);
        }
    }
}
