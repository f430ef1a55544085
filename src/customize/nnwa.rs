//! NNWA, the nearest neighbour weighted average: the face between the landmarks follows them.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// A landmark and where it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Where it is before the morph, mm.
    pub at: Point3<f64>,
    /// How far it goes, mm. Only x and y are followed: a landmark keeps its depth, Thesis (4.8).
    pub shift: Vector3<f64>,
}

/// Vertices a thread takes at a time.
const CHUNK: usize = 1024;
/// Below so many products of vertices and landmarks one thread is done before others have woken.
const PARALLEL_FROM: usize = 200_000;
/// A vertex nearer to a landmark than 1e-9 mm goes with it, mm².
const SNAP_SQUARED: f64 = 1e-18;
/// Weight of a landmark that a vertex lies on: beside it all others vanish, whatever the power. A distance of 1 mm weighs 1.
const SNAP_WEIGHT: f64 = 1e150;

/// Moves every vertex by the weighted average of the landmarks' shifts. Thesis §4.2, Fig. 4.6.
///
/// u(x) = Σ_k w_k Δ_k / Σ_k w_k,   w_k = 1 / ‖x − x_k‖^p
///
/// with the distances in three dimensions, before the morph, over all landmarks or the `nearest` few. A vertex on a landmark
/// goes with it. Without anchors nothing moves. Time: one root or quotient for every vertex and landmark.
pub fn morph(positions: &mut [Point3<f64>], anchors: &[Anchor], power: f64, nearest: Option<usize>) {
    if anchors.is_empty() {
        return;
    }
    let few = nearest.filter(|&k| k < anchors.len());
    let run = |chunk: &mut [Point3<f64>]| match few {
        Some(k) => morph_by_nearest(chunk, anchors, power, k.max(1)),
        None => Arch::new().dispatch(Chunk { vertices: chunk, anchors, power }),
    };
    if positions.len() * anchors.len() < PARALLEL_FROM {
        positions.chunks_mut(CHUNK).for_each(run);
    } else {
        positions.par_chunks_mut(CHUNK).for_each(run);
    }
}

struct Chunk<'a> {
    vertices: &'a mut [Point3<f64>],
    anchors: &'a [Anchor],
    power: f64,
}

impl WithSimd for Chunk<'_> {
    type Output = ();

    /// The usual powers without a call of `powf`.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { vertices, anchors, power } = self;
        match power {
            1.0 => side_by_side(vertices, anchors, |d2| 1.0 / d2.sqrt()),
            2.0 => side_by_side(vertices, anchors, |d2| 1.0 / d2),
            3.0 => side_by_side(vertices, anchors, |d2| 1.0 / (d2 * d2.sqrt())),
            4.0 => side_by_side(vertices, anchors, |d2| 1.0 / (d2 * d2)),
            _ => side_by_side(vertices, anchors, |d2| d2.powf(-0.5 * power)),
        }
    }
}

/// Vertices worked on at once.
const LANES: usize = 8;

#[inline(always)]
fn side_by_side(vertices: &mut [Point3<f64>], anchors: &[Anchor], weight: impl Fn(f64) -> f64) {
    for group in vertices.chunks_mut(LANES) {
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (j, v) in group.iter().enumerate() {
            (x[j], y[j], z[j]) = (v.x, v.y, v.z);
        }
        let (mut sum, mut shift_x, mut shift_y) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for a in anchors {
            for j in 0..LANES {
                let (dx, dy, dz) = (x[j] - a.at.x, y[j] - a.at.y, z[j] - a.at.z);
                let d2 = dx * dx + dy * dy + dz * dz;
                let w = if d2 < SNAP_SQUARED { SNAP_WEIGHT } else { weight(d2) };
                sum[j] += w;
                shift_x[j] += w * a.shift.x;
                shift_y[j] += w * a.shift.y;
            }
        }
        for (j, v) in group.iter_mut().enumerate() {
            v.x += shift_x[j] / sum[j];
            v.y += shift_y[j] / sum[j];
        }
    }
}

/// The same over the `k` nearest landmarks of each vertex.
fn morph_by_nearest(vertices: &mut [Point3<f64>], anchors: &[Anchor], power: f64, k: usize) {
    let mut by_distance: Vec<(f64, usize)> = Vec::with_capacity(anchors.len());
    for v in vertices {
        by_distance.clear();
        by_distance.extend(anchors.iter().enumerate().map(|(i, a)| ((*v - a.at).norm_squared(), i)));
        by_distance.select_nth_unstable_by(k - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut sum, mut shift) = (0.0, Vector3::zeros());
        for &(d2, i) in &by_distance[..k] {
            let w = if d2 < SNAP_SQUARED { SNAP_WEIGHT } else { d2.powf(-0.5 * power) };
            sum += w;
            shift += anchors[i].shift * w;
        }
        *v += Vector3::new(shift.x, shift.y, 0.0) / sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn anchor(x: f64, y: f64, z: f64, dx: f64, dy: f64) -> Anchor {
        Anchor { at: Point3::new(x, y, z), shift: Vector3::new(dx, dy, 0.0) }
    }

    /// A vertex 3 from one landmark and 6 from the other. Power 2: weights 1/9 : 1/36 = 4 : 1; power 1: 2 : 1; power 3: 8 : 1.
    #[test]
    fn two_landmarks_by_hand() {
        let anchors = [anchor(0.0, 0.0, 0.0, 10.0, 0.0), anchor(0.0, 9.0, 0.0, 0.0, 5.0)];
        for (power, first) in [(1.0, 2.0 / 3.0), (2.0, 0.8), (3.0, 8.0 / 9.0), (4.0, 16.0 / 17.0), (2.5, 0.849_778_903)]
        {
            let mut x = [Point3::new(0.0, 3.0, 0.0)];
            morph(&mut x, &anchors, power, None);
            let expected = Point3::new(10.0 * first, 3.0 + 5.0 * (1.0 - first), 0.0);
            assert!((x[0] - expected).norm() < 1e-7, "power {power}: {}", x[0]);
        }
        // The nearest alone takes the vertex with it.
        let mut x = [Point3::new(0.0, 3.0, 0.0)];
        morph(&mut x, &anchors, 2.0, Some(1));
        assert!((x[0] - Point3::new(10.0, 3.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_vertex_on_a_landmark_goes_with_it() {
        let anchors = [anchor(1.0, 2.0, 3.0, 10.0, 4.0), anchor(1.001, 2.0, 3.0, -10.0, 0.0)];
        for power in [0.3, 1.0, 2.0, 3.0, 4.0, 16.0] {
            for nearest in [None, Some(1)] {
                let mut x = [Point3::new(1.0, 2.0, 3.0)];
                morph(&mut x, &anchors, power, nearest);
                assert!((x[0] - Point3::new(11.0, 6.0, 3.0)).norm() < 1e-9, "power {power}: {}", x[0]);
            }
        }
    }

    proptest! {
        /// Weights are normalised (E22): a common shift is passed on whole, and nothing moves beyond the landmarks' range.
        #[test]
        fn an_average_stays_within_its_parts(
            parts in prop::collection::vec(prop::array::uniform5(-80.0..80.0_f64), 1..40),
            at in prop::array::uniform3(-90.0..90.0_f64),
            power in 0.5..8.0_f64,
            nearest in prop::option::of(1..10_usize),
        ) {
            let anchors: Vec<_> = parts.iter().map(|p| anchor(p[0], p[1], p[2], p[3], p[4])).collect();
            let mut x = [Point3::from(at)];
            morph(&mut x, &anchors, power, nearest);
            let moved = x[0] - Point3::from(at);
            for axis in 0..2 {
                let shifts = || anchors.iter().map(|a| a.shift[axis]);
                let (low, high) = (shifts().fold(f64::MAX, f64::min), shifts().fold(f64::MIN, f64::max));
                prop_assert!((low - 1e-9..=high + 1e-9).contains(&moved[axis]));
            }
            prop_assert_eq!(moved.z, 0.0);
        }

        /// The wide path and the plain one agree: all landmarks are also the nearest n.
        #[test]
        fn both_paths_agree(seed in 0..1000_u32, power in prop::sample::select(vec![1.0, 2.0, 3.0, 4.0, 2.2])) {
            let f = |k: u32, s: f64| (f64::from(k * 7919 + seed) * s).sin() * 70.0;
            let anchors: Vec<_> = (0..32).map(|k| anchor(f(k, 0.1), f(k, 0.23), f(k, 0.31), f(k, 0.47), f(k, 0.59))).collect();
            let start: Vec<_> = (0..19).map(|k| Point3::new(f(k, 0.77), f(k, 0.83), f(k, 0.91))).collect();
            let (mut wide, mut plain) = (start.clone(), start);
            morph(&mut wide, &anchors, power, None);
            morph_by_nearest(&mut plain, &anchors, power, 32);
            prop_assert!(wide.iter().zip(&plain).all(|(a, b)| (a - b).norm() < 1e-11));
        }
    }
}
