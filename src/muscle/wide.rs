//! A law at many places at once: loops without a branch over numbers that lie side by side.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use nalgebra::Point3;

use super::fibre::{Fibre, Place};
use super::parameter::MAX_PARAMETERS;

/// Places worked on at once; lists of places hold a multiple of it.
pub(crate) const LANES: usize = 8;

/// θ's slopes along the shape parameters; zeros after the last.
pub(super) type Slopes = [f64; MAX_PARAMETERS];

/// A law on one fibre. (A trait and no closures: these are not inlined into what is compiled for wide registers.)
pub(super) trait Spread: Copy {
    /// What of a place the law depends on: two numbers, whatever its shape parameters.
    fn coordinates(place: &Place) -> [f64; 2];

    /// Whether it pulls at a place, known by what the law depends on.
    fn pulls(&self, coordinates: [f64; 2]) -> bool;

    /// θ and its slopes where it pulls, elsewhere some numbers.
    fn value(&self, coordinates: [f64; 2]) -> (f64, Slopes);

    /// θ and its slopes.
    #[inline(always)]
    fn at(&self, coordinates: [f64; 2]) -> (f64, Slopes) {
        let pulled = self.pulls(coordinates);
        let (value, mut by) = self.value(coordinates);
        for slope in &mut by {
            *slope = if pulled { *slope } else { 0.0 };
        }
        (if pulled { value } else { 0.0 }, by)
    }
}

/// Whether all hold. (No branches, as `&&` would be.)
#[inline(always)]
pub(super) fn all<const N: usize>(conditions: [bool; N]) -> bool {
    let mut hold = true;
    for condition in conditions {
        hold &= condition;
    }
    hold
}

/// Works out θ at places and its slopes: all places along the first parameter, then along the next; as many parameters as `slopes` has room for.
#[inline(always)]
pub(super) fn fill(law: impl Spread, [first, second]: [&[f64]; 2], theta: &mut [f64], slopes: &mut [f64]) {
    let n = theta.len();
    let lanes = first.as_chunks::<LANES>().0.iter().zip(second.as_chunks::<LANES>().0);
    for (at, ((a, b), theta)) in lanes.zip(theta.as_chunks_mut::<LANES>().0).enumerate() {
        // Lists of its own: what a loop writes may be nothing that it reads.
        let (a, b, mut values, mut by) = (*a, *b, [0.0; LANES], [[0.0; LANES]; MAX_PARAMETERS]);
        let mut reached = false;
        for lane in 0..LANES {
            reached |= law.pulls([a[lane], b[lane]]);
        }
        if reached {
            for lane in 0..LANES {
                let (value, slopes) = law.at([a[lane], b[lane]]);
                values[lane] = value;
                for (by, slope) in by.iter_mut().zip(slopes) {
                    by[lane] = slope;
                }
            }
        }
        *theta = values;
        for (plane, by) in slopes.chunks_exact_mut(n).zip(&by) {
            if let Some(out) = plane.as_chunks_mut::<LANES>().0.get_mut(at) {
                *out = *by;
            }
        }
    }
}

/// Works out θ at points beside a fibre.
#[inline(always)]
pub(super) fn fill_points<L: Spread>(law: L, fibre: &Fibre, points: &[Point3<f64>], theta: &mut [f64]) {
    for (points, theta) in points.chunks(LANES).zip(theta.chunks_exact_mut(LANES)) {
        let mut at = [fibre.insertion; LANES];
        at[..points.len()].copy_from_slice(points);
        let mut coordinates = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let [first, second] = L::coordinates(&fibre.place(&at[lane]));
            (coordinates[0][lane], coordinates[1][lane]) = (first, second);
        }
        fill(law, [&coordinates[0], &coordinates[1]], theta, &mut []);
    }
}
