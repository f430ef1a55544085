//! Sums over long lists of numbers, written so that they are compiled for wide registers where a dispatched function inlines them.
//!
//! Every sum has as many partial sums as there are lanes, and so comes out the same on every processor.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::ops::Range;

use crate::muscle::wide::LANES;

/// Partial sums: so many that each can wait for the one before it. Lists hold a multiple of it.
const SUMS: usize = 2 * LANES;

/// Length of a list that holds `n` numbers and has no lanes left over.
pub(super) fn padded(n: usize) -> usize {
    n.next_multiple_of(SUMS)
}

/// Samples worked on before the next: what is needed of so many stays in the nearest memory.
const TILE: usize = 128;

/// The parts, one after the other, of a list of `m` numbers.
pub(super) fn tiles(m: usize) -> impl Iterator<Item = Range<usize>> {
    (0..m).step_by(TILE).map(move |start| start..(start + TILE).min(m))
}

/// Partial sums of aᵢ bᵢ.
#[inline(always)]
fn add_dot(sums: &mut [f64; SUMS], a: &[f64], b: &[f64]) {
    for (a, b) in a.as_chunks::<SUMS>().0.iter().zip(b.as_chunks::<SUMS>().0) {
        for lane in 0..SUMS {
            sums[lane] += a[lane] * b[lane];
        }
    }
}

#[inline(always)]
fn total(sums: &[f64; SUMS]) -> f64 {
    let mut halves = [0.0; LANES];
    for lane in 0..LANES {
        halves[lane] = sums[lane] + sums[lane + LANES];
    }
    halves.iter().sum()
}

/// Σ aᵢ bᵢ.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; SUMS];
    add_dot(&mut sums, a, b);
    total(&sums)
}

/// Σ aᵢ · bᵢ over a part of vectors whose coordinates are lists of length `m`, one after the other.
#[inline(always)]
pub(super) fn dot_of_part(a: &[f64], b: &[f64], m: usize, part: &Range<usize>) -> f64 {
    let mut sums = [0.0; SUMS];
    for (a, b) in a.chunks_exact(m).zip(b.chunks_exact(m)) {
        add_dot(&mut sums, &a[part.clone()], &b[part.clone()]);
    }
    total(&sums)
}

/// Σ aᵢ bᵢ wᵢ over a part.
#[inline(always)]
pub(super) fn weighted_dot_of_part(a: &[f64], b: &[f64], weights: &[f64], part: &Range<usize>) -> f64 {
    let mut sums = [0.0; SUMS];
    let (a, b, weights) = (&a[part.clone()], &b[part.clone()], &weights[part.clone()]);
    let each = a.as_chunks::<SUMS>().0.iter().zip(b.as_chunks::<SUMS>().0).zip(weights.as_chunks::<SUMS>().0);
    for ((a, b), w) in each {
        for lane in 0..SUMS {
            sums[lane] += (a[lane] * b[lane]) * w[lane];
        }
    }
    total(&sums)
}

/// outᵢ += factor · aᵢ.
#[inline(always)]
pub(super) fn add_scaled(out: &mut [f64], factor: f64, a: &[f64]) {
    for (out, a) in out.iter_mut().zip(a) {
        *out += factor * a;
    }
}

/// Over a part of vectors: out = factor · θᵢ dᵢ, or where there is `more`, out += that.
#[inline(always)]
pub(super) fn scaled_vectors(
    out: &mut [f64],
    more: bool,
    factor: f64,
    theta: &[f64],
    directions: &[f64],
    part: &Range<usize>,
) {
    let m = theta.len();
    for (out, direction) in out.chunks_exact_mut(m).zip(directions.chunks_exact(m)) {
        let (out, direction, theta) = (&mut out[part.clone()], &direction[part.clone()], &theta[part.clone()]);
        let each = out.iter_mut().zip(direction).zip(theta);
        if more {
            for ((out, direction), theta) in each {
                *out += (factor * theta) * direction;
            }
        } else {
            for ((out, direction), theta) in each {
                *out = (factor * theta) * direction;
            }
        }
    }
}

/// Adds to the lower triangle of a matrix, but not to its columns from `known` on, the products of `rows` with each other over a part of them. A row is
/// `axes` lists of length `m`.
#[inline(always)]
pub(super) fn add_products(rows: &[f64], axes: usize, m: usize, part: &Range<usize>, known: usize, out: &mut [f64]) {
    let n = rows.len() / (axes * m);
    for (a, left) in rows.chunks_exact(axes * m).enumerate() {
        for (b, right) in rows.chunks_exact(axes * m).take(known.min(a + 1)).enumerate() {
            out[a * n + b] += dot_of_part(left, right, m, part);
        }
    }
}
