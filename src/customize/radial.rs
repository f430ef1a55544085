//! Radial basis functions: the smoothest field of shifts that takes every landmark where it was marked.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use nalgebra::{DMatrix, Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Anchor;

/// Half the mean squared difference of two shifts grows by so much for every millimetre between them, mm²/mm: people's
/// proportions differ by 3 to 4 mm (standard deviation) over the 50 mm between parts of a face.
const UNLIKE_PER_MM: f64 = 0.15;
/// Added to the diagonal when landmarks coincide, so that there is a solution still.
const RELUCTANCE: f64 = 1e-9;
/// Vertices a thread takes at a time.
const CHUNK: usize = 1024;
/// Below so many products of vertices and landmarks one thread is done before others have woken.
const PARALLEL_FROM: usize = 200_000;
/// Vertices worked on at once.
const LANES: usize = 8;

/// A centre of the field and its weights.
#[derive(Clone, Copy, Debug)]
struct Centre {
    at: Point3<f64>,
    weight: Vector3<f64>,
}

/// The solved field of shifts.
#[derive(Clone, Debug)]
pub struct Field {
    centres: Vec<Centre>,
    common: Vector3<f64>,
}

impl Field {
    /// Solves for the field through the anchors' shifts. Shifts without a depth (a landmark keeps its own, Thesis (4.8)) make a
    /// field without one.
    ///
    /// u(x) = a + Σ_k w_k ‖x − x_k‖,   u(x_k) = Δ_k,   Σ_k w_k = 0
    ///
    /// In three dimensions the distance is the kernel of the smoothest such field (least ∫ ‖Δu‖² among those that stay bounded), and
    /// the best linear guess for shifts whose unlikeness grows with distance (kriging with a linear variogram). There is one
    /// solution whatever the anchors. With `smoothing_mm` s > 0 the marks are taken to err by s (standard deviation), and
    /// u(x_k) = Δ_k becomes u(x_k) − (s²/0.15 mm) w_k = Δ_k: landmarks are then missed by about as much.
    ///
    /// Source: Duchon 1977 (the kernel); Micchelli 1986 (that it can be solved).
    pub fn through(anchors: &[Anchor], smoothing_mm: f64) -> Self {
        Self::smoothed(anchors, |_| smoothing_mm)
    }

    /// The same with a smoothing for each anchor, by its index, mm.
    pub fn smoothed(anchors: &[Anchor], smoothing_mm: impl Fn(usize) -> f64) -> Self {
        let n = anchors.len();
        if n == 0 {
            return Self { centres: Vec::new(), common: Vector3::zeros() };
        }
        let nugget: Vec<f64> = (0..n).map(smoothing_mm).map(|s| s * s / UNLIKE_PER_MM).collect();
        let solve = |more: f64| {
            let system = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
                (true, true) if i == j => -nugget[i] - more,
                (true, true) => (anchors[i].at - anchors[j].at).norm(),
                (false, false) => 0.0,
                _ => 1.0,
            });
            let shifts = DMatrix::from_fn(n + 1, 3, |i, j| if i < n { anchors[i].shift[j] } else { 0.0 });
            system.lu().solve(&shifts).filter(|s| s.iter().all(|v| v.is_finite()))
        };
        let solution = solve(0.0).or_else(|| solve(RELUCTANCE)).unwrap_or_else(|| DMatrix::zeros(n + 1, 3));
        let row = |i: usize| Vector3::new(solution[(i, 0)], solution[(i, 1)], solution[(i, 2)]);
        let centres = anchors.iter().enumerate().map(|(i, a)| Centre { at: a.at, weight: row(i) }).collect();
        Self { centres, common: row(n) }
    }

    /// Moves every vertex with the field.
    pub fn morph(&self, positions: &mut [Point3<f64>]) {
        let run = |chunk: &mut [Point3<f64>]| Arch::new().dispatch(Chunk { vertices: chunk, field: self });
        if positions.len() * self.centres.len() < PARALLEL_FROM {
            positions.chunks_mut(CHUNK).for_each(run);
        } else {
            positions.par_chunks_mut(CHUNK).for_each(run);
        }
    }
}

struct Chunk<'a> {
    vertices: &'a mut [Point3<f64>],
    field: &'a Field,
}

impl WithSimd for Chunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for group in self.vertices.chunks_mut(LANES) {
            let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for (j, v) in group.iter().enumerate() {
                (x[j], y[j], z[j]) = (v.x, v.y, v.z);
            }
            let common = self.field.common;
            let (mut shift_x, mut shift_y, mut shift_z) = ([common.x; LANES], [common.y; LANES], [common.z; LANES]);
            for c in &self.field.centres {
                for j in 0..LANES {
                    let (dx, dy, dz) = (x[j] - c.at.x, y[j] - c.at.y, z[j] - c.at.z);
                    let r = (dx * dx + dy * dy + dz * dz).sqrt();
                    shift_x[j] += c.weight.x * r;
                    shift_y[j] += c.weight.y * r;
                    shift_z[j] += c.weight.z * r;
                }
            }
            for (j, v) in group.iter_mut().enumerate() {
                v.x += shift_x[j];
                v.y += shift_y[j];
                v.z += shift_z[j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn anchor(x: f64, y: f64, z: f64, dx: f64, dy: f64) -> Anchor {
        Anchor { at: Point3::new(x, y, z), shift: Vector3::new(dx, dy, 0.0) }
    }

    fn moved(anchors: &[Anchor], smoothing_mm: f64, at: Point3<f64>) -> Vector3<f64> {
        let mut x = [at];
        Field::through(anchors, smoothing_mm).morph(&mut x);
        x[0] - at
    }

    /// Two anchors 10 apart, shifted by 4 and 0: w = −0.2 and 0.2, a = 2, so u falls linearly between them (w₁ t + w₂ (10 − t) + a =
    /// 4 − 0.4 t) and stays at 4 and 0 beyond.
    #[test]
    fn two_landmarks_by_hand() {
        let anchors = [anchor(0.0, 0.0, 0.0, 4.0, 1.0), anchor(0.0, 10.0, 0.0, 0.0, 1.0)];
        for (t, u) in [(0.0, 4.0), (2.5, 3.0), (5.0, 2.0), (10.0, 0.0), (-7.0, 4.0), (60.0, 0.0)] {
            let shift = moved(&anchors, 0.0, Point3::new(0.0, t, 0.0));
            assert!((shift - Vector3::new(u, 1.0, 0.0)).norm() < 1e-12, "{t}: {shift}");
        }
        // Smoothing by s² = 0.75 mm²: nugget 5, so that 10 w₂ + a − 5 w₁… gives w = ∓4 / (2 · 10 + 2 · 5) = ∓0.1333.
        let shift = moved(&anchors, 0.75_f64.sqrt(), Point3::origin());
        assert!((shift.x - (2.0 + 4.0 / 3.0)).abs() < 1e-12, "{shift}");
    }

    #[test]
    fn coinciding_and_single_landmarks_have_a_solution() {
        let twice = [anchor(1.0, 2.0, 3.0, 4.0, 0.0), anchor(1.0, 2.0, 3.0, 4.0, 0.0), anchor(9.0, 2.0, 3.0, 0.0, 0.0)];
        assert!((moved(&twice, 0.0, Point3::new(1.0, 2.0, 3.0)).x - 4.0).abs() < 1e-5);
        assert_eq!(moved(&twice[..1], 0.0, Point3::new(50.0, 0.0, 0.0)), Vector3::new(4.0, 0.0, 0.0));
        assert_eq!(moved(&[], 0.0, Point3::origin()), Vector3::zeros());
    }

    proptest! {
        #[test]
        fn landmarks_land_and_a_common_shift_is_passed_on(
            parts in prop::collection::vec(prop::array::uniform5(-80.0..80.0_f64), 1..40),
            at in prop::array::uniform3(-90.0..90.0_f64),
        ) {
            let anchors: Vec<_> = parts.iter().map(|p| anchor(p[0], p[1], p[2], p[3], p[4])).collect();
            for a in &anchors {
                prop_assert!((moved(&anchors, 0.0, a.at) - a.shift).norm() < 1e-6);
            }
            let both = Vector3::new(3.0, -2.0, 0.0);
            let shifted: Vec<_> = anchors.iter().map(|a| Anchor { shift: a.shift + both, ..*a }).collect();
            let difference = moved(&shifted, 0.0, at.into()) - moved(&anchors, 0.0, at.into());
            prop_assert!((difference - both).norm() < 1e-6 && difference.z == 0.0);
        }
    }
}
