//! Which activations of muscles bring the skin to rest nearest to where its points were seen: Gauss–Newton through equilibria.

use nalgebra::{DMatrix, DVector, Matrix2x6, Point2, Point3, Vector3};

use crate::camera::head_motion::motion_slope;
use crate::camera::{Camera, HeadMotion};
use crate::expression::jaw::WIDEST_DEG;
use crate::fit::non_negative::{self, NormalEquations};
use crate::simulate::{Ended, Equilibrium, SkinAtRest};

/// Activations are taken to be spread with the density e^(−a/m)/m, and this m: a muscle is used only where the points ask for it, and those
/// hardly felt stay at rest.
pub(super) const USUAL: f64 = 0.2;
/// A place is believed to no less than this, mm: what a mesh of 8 mm triangles missed of the places of one with a quarter of their size, under
/// the same muscles.
const LEAST_MM: f64 = 0.06;
/// A step changes activations of which the points say little by no more than about this (Levenberg).
const BELIEVED: f64 = 0.5;
/// Gauss–Newton steps at most.
const STEPS: usize = 20;
/// Halvings of a step before it is given up.
const HALVINGS: usize = 6;
/// A step that lowers the cost by a smaller share is the last.
const ENOUGH: f64 = 1e-2;
/// Where a step is foretold to take no vertex further, mm, its equilibrium is looked for from the foretold places.
const NEAR_MM: f64 = 3.0;

/// Points seen in the last frame, with how they err: each on its own, and together by what the head's motion and the face of the first frame are
/// known to.
///
/// With whitened residuals r (each over its mark's standard error) and the picture's slopes H by these shared errors of the covariance C, the
/// cost is rᵀ W r, W = (I + H C Hᵀ)⁻¹ = I − H M Hᵀ, M = C (I + Hᵀ H C)⁻¹ (Woodbury).
pub(super) struct Seen<'a> {
    camera: &'a Camera,
    head: &'a HeadMotion,
    points: Vec<(usize, Point2<f64>, f64)>,
    /// Hᵀ.
    shared: DMatrix<f64>,
    /// M.
    inner: DMatrix<f64>,
}

impl<'a> Seen<'a> {
    /// Vertices, where they were seen in the last frame (px), and the marks' standard errors along each axis (px); and how errors of the first
    /// frame of one standard deviation each move the vertices, mm. None without a point, or where a slope is no number.
    pub(super) fn new(
        camera: &'a Camera,
        head: &'a HeadMotion,
        first: &[Point3<f64>],
        marks: impl Iterator<Item = (usize, Point2<f64>, f64)>,
        errors_of_first: &[Vec<Vector3<f64>>],
    ) -> Option<Self> {
        let least = LEAST_MM * camera.px_per_mm;
        let points: Vec<_> = marks.map(|(v, at, sigma)| (v, at, sigma.max(least))).collect();
        if points.is_empty() {
            return None;
        }
        let count = 6 + errors_of_first.len();
        let mut seen = Self {
            camera,
            head,
            shared: DMatrix::zeros(count, 2 * points.len()),
            inner: DMatrix::zeros(count, count),
            points,
        };
        for (k, &(v, _, sigma)) in seen.points.iter().enumerate() {
            let there = head.motion.last_from_first(&first[v]);
            let slope: Matrix2x6<f64> = camera.image_slope(&there) * motion_slope(&head.motion, &first[v]) / sigma;
            seen.shared.fixed_view_mut::<6, 2>(0, 2 * k).copy_from(&slope.transpose());
        }
        let of_first = seen.motion(first, errors_of_first);
        seen.shared.rows_mut(6, errors_of_first.len()).copy_from(&of_first.transpose());
        let mut covariance = DMatrix::identity(count, count);
        covariance.fixed_view_mut::<6, 6>(0, 0).copy_from(&head.covariance);
        let own = DMatrix::identity(count, count) + &seen.shared * seen.shared.transpose() * &covariance;
        seen.inner = covariance * own.try_inverse()?;
        Some(seen)
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// The points' vertices and standard errors.
    pub(super) fn points(&self) -> &[(usize, Point2<f64>, f64)] {
        &self.points
    }

    /// Whitened distances of the points from where the skin at `x` shows them.
    pub(super) fn off(&self, x: &[Point3<f64>]) -> DVector<f64> {
        let of = |(v, at, sigma): &(usize, Point2<f64>, f64)| {
            let off = (at - self.camera.image_from_face(&self.head.motion.last_from_first(&x[*v]))) / *sigma;
            [off.x, off.y]
        };
        DVector::from_iterator(2 * self.points.len(), self.points.iter().flat_map(of))
    }

    /// Whitened motion of the points in the picture, a column for each motion of all vertices (mm).
    pub(super) fn motion(&self, x: &[Point3<f64>], moved: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
        let turn = self.head.motion.rotation.to_rotation_matrix();
        let mut all = DMatrix::zeros(2 * self.points.len(), moved.len());
        for (k, &(v, _, sigma)) in self.points.iter().enumerate() {
            let there = self.head.motion.last_from_first(&x[v]);
            let slope = self.camera.image_slope(&there) * turn.matrix() / sigma;
            for (j, moved) in moved.iter().enumerate() {
                all.fixed_view_mut::<2, 1>(2 * k, j).copy_from(&(slope * moved[v]));
            }
        }
        all
    }

    /// Of each column, how far it moves, from the skin at rest, the point that it moves most, as a share of how far it moves any vertex; none
    /// where the skin has no stiffness there.
    pub(super) fn felt(
        &self,
        body: &mut Body<'_>,
        loads: &[Vec<Vector3<f64>>],
        first: &[Point3<f64>],
    ) -> Option<Vec<f64>> {
        let moved = body.moved(loads, &DVector::zeros(loads.len()), first)?;
        let furthest = |way: &mut dyn Iterator<Item = &Vector3<f64>>| way.map(Vector3::norm).fold(0.0, f64::max);
        let share = |moved: &Vec<Vector3<f64>>| {
            let all = furthest(&mut moved.iter());
            let here = furthest(&mut self.points.iter().map(|(v, ..)| &moved[*v]));
            if all > 0.0 { here / all } else { 0.0 }
        };
        Some(moved.iter().map(share).collect())
    }

    /// Root mean square over the points of what is whitened, one value a row, px.
    pub(super) fn rms_px(&self, whitened: impl Fn(usize) -> f64) -> f64 {
        let of = |(k, (.., sigma)): (usize, &(usize, Point2<f64>, f64))| {
            (whitened(2 * k).powi(2) + whitened(2 * k + 1).powi(2)) * sigma * sigma
        };
        (self.points.iter().enumerate().map(of).sum::<f64>() / self.len() as f64).sqrt()
    }

    /// rᵀ W r.
    pub(super) fn square(&self, off: &DVector<f64>) -> f64 {
        let shared = &self.shared * off;
        off.norm_squared() - shared.dot(&(&self.inner * &shared))
    }

    /// rᵀ W r of r = u − J a as normal equations.
    pub(super) fn normal(&self, slopes: &DMatrix<f64>, aim: &DVector<f64>) -> NormalEquations {
        let shared = &self.shared * slopes;
        let (moment, square) = self.moments(slopes, aim);
        let gram = slopes.tr_mul(slopes) - shared.tr_mul(&(&self.inner * &shared));
        NormalEquations { gram: 0.5 * (&gram + gram.transpose()), moment, square }
    }

    /// Jᵀ W u and uᵀ W u.
    pub(super) fn moments(&self, slopes: &DMatrix<f64>, aim: &DVector<f64>) -> (DVector<f64>, f64) {
        let of_aim = &self.inner * (&self.shared * aim);
        let weighed = aim - self.shared.tr_mul(&of_aim);
        (slopes.tr_mul(&weighed), aim.dot(&weighed))
    }
}

/// The skin, and which of the columns that move it is the jaw.
pub(super) struct Body<'a> {
    pub(super) rest: &'a mut SkinAtRest,
    /// The jaw's column holds no pulls, and its activation is its angle over the widest.
    pub(super) jaw: Option<usize>,
}

impl Body<'_> {
    fn open(&mut self, shares: &DVector<f64>) {
        self.rest.open_jaw(self.jaw.map_or(0.0, |j| shares[j].min(1.0) * WIDEST_DEG.to_radians()));
    }

    /// The equilibrium under shares of the columns (N on every vertex), looked for from a start.
    pub(super) fn solve(
        &mut self,
        columns: &[Vec<Vector3<f64>>],
        shares: &DVector<f64>,
        from: &[Point3<f64>],
    ) -> Option<Equilibrium> {
        self.open(shares);
        self.rest.solve(together(columns, shares), from).ok()
    }

    /// How far every vertex goes from that equilibrium, mm, for the whole of each column; none where the skin has no stiffness there.
    pub(super) fn moved(
        &mut self,
        columns: &[Vec<Vector3<f64>>],
        shares: &DVector<f64>,
        x: &[Point3<f64>],
    ) -> Option<Vec<Vec<Vector3<f64>>>> {
        self.open(shares);
        let loads = together(columns, shares);
        let Some(jaw) = self.jaw else { return self.rest.moved(loads, x, columns) };
        let [carried, left] = self.rest.opening(&loads, x)?;
        let mut columns = columns.to_vec();
        columns[jaw] = left;
        let mut moved = self.rest.moved(loads, x, &columns)?;
        for (moved, carried) in moved[jaw].iter_mut().zip(carried) {
            *moved = (*moved + carried) * WIDEST_DEG.to_radians();
        }
        Some(moved)
    }
}

/// Activations, and the skin at rest under them.
pub(super) struct Found {
    /// One a muscle, 0 and above.
    pub(super) activations: DVector<f64>,
    /// Every vertex, mm.
    pub(super) positions: Vec<Point3<f64>>,
    /// rᵀ W r.
    pub(super) square: f64,
    /// What was minimised.
    pub(super) cost: f64,
    /// Whitened distances of the points.
    pub(super) off: DVector<f64>,
    /// The problem made linear there, Jᵀ W J and Jᵀ W u for r = u − J a, less what being used costs.
    pub(super) normal: NormalEquations,
    /// J: whitened motion of the points for a full activation of each muscle.
    pub(super) slopes: DMatrix<f64>,
    /// The same of all vertices, mm.
    pub(super) moved: Vec<Vec<Vector3<f64>>>,
}

/// The activations a ≥ 0 of muscles with these loads (N on every vertex at full strength) that minimise rᵀ W r + 2 Σ a / m, of all muscles or
/// those `allowed`, from rest or from activations that come near, with the places of all vertices under them.
///
/// Each step makes the equilibrium linear, dx/da = H⁻¹ f with the factor of the skin's stiffness H (one solution a muscle, as cheap here as the
/// adjoint, and errors need all of them), solves the non-negative least squares exactly, and goes there as far as lowers the cost. None where
/// the skin finds no rest.
pub(super) fn find(
    body: &mut Body<'_>,
    loads: &[Vec<Vector3<f64>>],
    seen: &Seen<'_>,
    allowed: Option<&[bool]>,
    start: Option<(DVector<f64>, &[Point3<f64>])>,
    first: &[Point3<f64>],
) -> Option<Found> {
    let started = start.is_some();
    let (mut a, x) = start.unwrap_or_else(|| (DVector::zeros(loads.len()), first));
    let mut x = x.to_vec();
    let mut off = seen.off(&x);
    let cost = |off: &DVector<f64>, a: &DVector<f64>| seen.square(off) + 2.0 * a.sum() / USUAL;
    // Other muscles than those of the start may explain less: the first step is taken as it is.
    let mut lowest = if started { f64::INFINITY } else { cost(&off, &a) };
    let mut step = 0;
    loop {
        let moved = body.moved(loads, &a, &x)?;
        let slopes = seen.motion(&x, &moved);
        let mut normal = seen.normal(&slopes, &(&off + &slopes * &a));
        normal.moment.add_scalar_mut(-1.0 / USUAL);
        if step == STEPS {
            return Some(Found {
                square: seen.square(&off),
                cost: cost(&off, &a),
                activations: a,
                positions: x,
                off,
                normal,
                slopes,
                moved,
            });
        }
        let aim = non_negative::solve(&believed(&normal, &a), allowed);
        if aim.ended != non_negative::Ended::Minimum {
            return None;
        }
        step += 1;
        let ahead = &aim.strengths - &a;
        let way = together(&moved, &ahead);
        let longest = way.iter().map(Vector3::norm).fold(0.0, f64::max);
        let mut last = true;
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let trial = &a + &ahead * share;
            let from: Vec<Point3<f64>> = if longest * share < NEAR_MM {
                x.iter().zip(&way).map(|(x, d)| x + d * share).collect()
            } else {
                x.clone()
            };
            let found = body.solve(loads, &trial, &from)?;
            let there = seen.off(&found.positions);
            let now = cost(&there, &trial);
            if found.ended == Ended::Converged && now < lowest {
                last = lowest.is_finite() && lowest - now < ENOUGH * lowest;
                (a, x, off, lowest) = (trial, found.positions, there, now);
                break;
            }
            share *= 0.5;
        }
        if last && lowest == f64::INFINITY {
            return None;
        }
        if last {
            step = STEPS;
        }
    }
}

/// The linear problem with a cost of going far from the activations that it was made at: no further than it can be believed.
pub(super) fn believed(normal: &NormalEquations, from: &DVector<f64>) -> NormalEquations {
    let mut near = normal.clone();
    for j in 0..from.len() {
        near.gram[(j, j)] += BELIEVED.powi(-2);
        near.moment[j] += from[j] * BELIEVED.powi(-2);
    }
    near
}

/// Σ s_j v_j.
pub(super) fn together(vectors: &[Vec<Vector3<f64>>], shares: &DVector<f64>) -> Vec<Vector3<f64>> {
    let mut sum = vec![Vector3::zeros(); vectors.first().map_or(0, Vec::len)];
    for (vector, share) in vectors.iter().zip(shares.iter()).filter(|(_, s)| **s != 0.0) {
        for (to, v) in sum.iter_mut().zip(vector) {
            *to += v * *share;
        }
    }
    sum
}

impl Found {
    /// How activations and places err together, by the muscles alone.
    pub(super) fn errors(&self) -> Option<Errors> {
        let root = covariance(&self.activations, &self.normal)?.cholesky()?.unpack();
        Some(Errors { places: Errors::places(&self.moved) * &root, activations: root })
    }
}

/// Independent errors of one standard deviation each, a column for each of them.
#[derive(Clone)]
pub(super) struct Errors {
    /// What each changes of the activations.
    pub(super) activations: DMatrix<f64>,
    /// And of the vertices' places, mm: x, y, z of the first, x of the second, …
    pub(super) places: DMatrix<f64>,
}

impl Errors {
    /// Motions of all vertices, a column each.
    pub(super) fn places(moved: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
        let rows = 3 * moved.first().map_or(0, Vec::len);
        DMatrix::from_iterator(rows, moved.len(), moved.iter().flatten().flat_map(|d| [d.x, d.y, d.z]))
    }

    /// Standard error of an activation.
    pub(super) fn of_activation(&self, muscle: usize) -> f64 {
        self.activations.row(muscle).norm()
    }
}

/// Covariance of activations where the stated errors are true, given the normal equations of the points' motion less what being used costs:
/// (Jᵀ W J)⁻¹ over the muscles that pull. Of one at rest the posterior density falls from zero on as e^(−g a − ½ G a²), g the slope of the cost and G
/// its curvature there; its second moment about zero lies between 1/G (g = 0) and 2/g² (g large), and is taken for 1/(G + ½ g²).
pub(super) fn covariance(activations: &DVector<f64>, normal: &NormalEquations) -> Option<DMatrix<f64>> {
    let (a, gram) = (activations, &normal.gram);
    let slope = &normal.moment - gram * a;
    let active: Vec<usize> = (0..a.len()).filter(|&j| a[j] > 0.0).collect();
    let mut all = DMatrix::zeros(a.len(), a.len());
    for j in (0..a.len()).filter(|&j| a[j] == 0.0) {
        all[(j, j)] = 1.0 / (gram[(j, j)] + 0.5 * slope[j] * slope[j]).max(f64::MIN_POSITIVE);
    }
    if active.is_empty() {
        return Some(all);
    }
    let scale: Vec<f64> = active.iter().map(|&j| gram[(j, j)].sqrt()).collect();
    let part =
        DMatrix::from_fn(active.len(), active.len(), |r, c| gram[(active[r], active[c])] / (scale[r] * scale[c]));
    let inverse = part.cholesky()?.inverse();
    for (r, &i) in active.iter().enumerate() {
        for (c, &j) in active.iter().enumerate() {
            all[(i, j)] = inverse[(r, c)] / (scale[r] * scale[c]);
        }
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    /// rᵀ W r with W by Woodbury against the inverse of I + H C Hᵀ itself, and the normal equations with it.
    #[test]
    fn errors_that_all_points_share_count_by_their_own_covariance() {
        let face = face::generic();
        let first = face.mesh().positions();
        let camera =
            Camera { principal_point_px: Point2::new(500.0, 500.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 };
        let covariance = nalgebra::Matrix6::from_diagonal(&[1e-4, 4e-4, 1e-4, 0.04, 0.09, 0.01].into());
        // The face of the first frame leans to one side by a tenth of a millimetre each 100 mm of height.
        let leans: Vec<Vector3<f64>> = first.iter().map(|x| Vector3::new(1e-3 * x.y, 0.0, 0.0)).collect();
        let head = HeadMotion { covariance, ..HeadMotion::default() };
        let marks = (0..5).map(|k| (40 * k, camera.image_from_face(&first[40 * k]), 0.7));
        let seen = Seen::new(&camera, &head, first, marks, std::slice::from_ref(&leans)).unwrap();
        let h = seen.shared.transpose();
        let mut whole = DMatrix::identity(7, 7);
        whole.fixed_view_mut::<6, 6>(0, 0).copy_from(&covariance);
        // The last shared error in the picture: 4 px a millimetre, over 0.7 px.
        assert!((h[(0, 6)] - leans[0].x * 4.0 / 0.7 * 1000.0 / (1000.0 - first[0].z)).abs() < 1e-9);
        let w = (DMatrix::identity(10, 10) + &h * whole * h.transpose()).try_inverse().unwrap();
        let r = DVector::from_fn(10, |k, _| (k as f64 * 1.7).sin());
        let expected = r.dot(&(&w * &r));
        assert!((seen.square(&r) - expected).abs() < 1e-9 * expected && expected < 0.9 * r.norm_squared());
        let slopes = DMatrix::from_fn(10, 2, |i, j| (i as f64 * 0.9 + j as f64).cos());
        let normal = seen.normal(&slopes, &r);
        let off = (&normal.gram - slopes.transpose() * &w * &slopes).norm()
            + (&normal.moment - slopes.tr_mul(&(&w * &r))).norm();
        assert!(off < 1e-9 * normal.gram.norm() && (normal.square - expected).abs() < 1e-9 * expected);
    }
}
