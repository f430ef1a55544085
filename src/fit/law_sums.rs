//! The sums of a law's least-squares problem over all samples: θ, Gram matrix, residual, normal matrix.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::ops::Range;

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::cholesky;
use super::law_model::{AXES, Model};
use super::planes::{add_products, add_scaled, dot, dot_of_part, scaled_vectors, tiles, weighted_dot_of_part};

/// Lengths of vectors below this share of the largest force have no direction.
const NO_DIRECTION: f64 = 1e-12;

impl Model<'_> {
    /// θ and its slopes, term by term.
    #[inline(always)]
    fn shape_inlined(&mut self) {
        let law = self.law.at(&self.values);
        self.shapes.clear();
        self.shapes.extend(self.field.fibres().iter().map(|f| law.on(f)));
        let (m, fibres, parameters) = (self.m, self.shapes.len(), self.parameters.len());
        let slopes = self.slopes.chunks_exact_mut(parameters * m);
        for (term, (theta, slopes)) in self.theta.chunks_exact_mut(m).zip(slopes).enumerate() {
            let (lobe, fibre) = (term / fibres, term % fibres);
            let (first, second) = self.coordinates[2 * fibre * m..2 * (fibre + 1) * m].split_at(m);
            self.shapes[fibre].over(lobe, [first, second], theta, slopes);
        }
    }

    /// Φ over a part of the samples.
    #[inline(always)]
    fn fill_columns(&mut self, part: &Range<usize>) {
        let (m, fibres) = (self.m, self.shapes.len());
        let phi = &mut self.rows[self.free.len() * AXES * m..];
        for (term, theta) in self.theta.chunks_exact(m).enumerate() {
            let fibre = term % fibres;
            let (column, more) = if self.shared { (term / fibres, fibre > 0) } else { (term, false) };
            let column = &mut phi[AXES * column * m..AXES * (column + 1) * m];
            let directions = &self.directions[AXES * fibre * m..AXES * (fibre + 1) * m];
            scaled_vectors(column, more, 1.0, theta, directions, part);
        }
    }

    /// G = ΦᵀΦ and Φᵀy: θ enters both as products of numbers, for those of the directions are always the same.
    #[inline(always)]
    fn gram(&mut self) {
        let (m, q, fibres) = (self.m, self.columns, self.shapes.len());
        self.gram.fill(0.0);
        self.strengths.fill(0.0);
        for part in tiles(m) {
            for (t, left) in self.theta.chunks_exact(m).enumerate() {
                let a = if self.shared { t / fibres } else { t };
                self.strengths[a] += dot(&left[part.clone()], &self.seen[t % fibres * m..][part.clone()]);
                for (u, right) in self.theta.chunks_exact(m).take(t + 1).enumerate() {
                    let b = if self.shared { u / fibres } else { u };
                    let (f, g) = ((t % fibres).max(u % fibres), (t % fibres).min(u % fibres));
                    let product = weighted_dot_of_part(left, right, &self.pairs[(f * (f + 1) / 2 + g) * m..], &part);
                    // Two terms of one column meet twice.
                    self.gram[a * q + b] += if a == b && t != u { 2.0 * product } else { product };
                }
            }
        }
    }

    /// The same for lengths: G and Φᵀy of the lengths of vectors.
    #[inline(always)]
    fn columns_of_lengths(&mut self) {
        let (m, q) = (self.m, self.columns);
        let phi = &self.rows[self.free.len() * AXES * m..];
        for (length, column) in self.lengths.chunks_exact_mut(m).zip(phi.chunks_exact(AXES * m)) {
            lengths_of(column, length);
        }
        let (lengths, observed) = self.lengths.split_at(q * m);
        self.gram.fill(0.0);
        add_products(lengths, 1, m, &(0..m), q, &mut self.gram);
        for (strength, column) in self.strengths.iter_mut().zip(lengths.chunks_exact(m)) {
            *strength = dot(column, observed);
        }
    }

    /// Φ, the strengths, which are as they are or the best for the shape, s = G⁻¹ Φᵀ y (for lengths, the best for the sum of lengths), and the
    /// square of the residual.
    #[inline(always)]
    fn cost_inlined(&mut self, solve: bool) -> f64 {
        let (m, lengths) = (self.m, self.compares_lengths());
        if lengths {
            self.fill_columns(&(0..m));
        }
        if solve {
            if lengths {
                self.columns_of_lengths();
            } else {
                self.gram();
            }
            self.factor.copy_from_slice(&self.gram);
            self.dropped = cholesky::factor(&mut self.factor, self.columns);
            cholesky::solve(&self.factor, self.columns, &mut self.strengths);
        }
        if lengths {
            self.sum.fill(0.0);
            let phi = self.rows[self.free.len() * AXES * m..].chunks_exact(AXES * m);
            for (column, strength) in phi.zip(&self.strengths) {
                add_scaled(&mut self.sum, *strength, column);
            }
            lengths_of(&self.sum, &mut self.residual);
            for (r, y) in self.residual.iter_mut().zip(&self.lengths[self.columns * m..]) {
                *r = y - *r;
            }
        } else {
            self.residual.copy_from_slice(&self.observed);
            for part in tiles(m) {
                for (term, theta) in self.theta.chunks_exact(m).enumerate() {
                    let (strength, fibre) = (self.strengths[self.column_of(term)], term % self.shapes.len());
                    let directions = &self.directions[AXES * fibre * m..AXES * (fibre + 1) * m];
                    scaled_vectors(&mut self.residual, true, -strength, theta, directions, &part);
                }
            }
        }
        dot(&self.residual, &self.residual)
    }

    #[inline(always)]
    fn normal_inlined(&mut self) {
        let (m, p, q) = (self.m, self.free.len(), self.columns);
        let (n, fibres, parameters) = (p + q, self.shapes.len(), self.parameters.len());
        self.full.fill(0.0);
        self.gradient.fill(0.0);
        for part in tiles(m) {
            for (term, slopes) in self.slopes.chunks_exact(parameters * m).enumerate() {
                let (strength, fibre) = (self.strengths[self.column_of(term)], term % fibres);
                let directions = &self.directions[AXES * fibre * m..AXES * (fibre + 1) * m];
                for (&k, row) in self.free.iter().zip(self.rows.chunks_exact_mut(AXES * m)) {
                    // ∂/∂ln(v − o) = (v − o) ∂/∂v
                    let factor = strength * (self.values[k] - self.parameters[k].origin);
                    scaled_vectors(row, term > 0, factor, &slopes[k * m..(k + 1) * m], directions, &part);
                }
            }
            if !self.compares_lengths() {
                self.fill_columns(&part);
                // ΦᵀΦ is G, if that was needed.
                add_products(&self.rows, AXES, m, &part, if self.eliminate { p } else { n }, &mut self.full);
                for (slope, row) in self.gradient.iter_mut().zip(self.rows.chunks_exact(AXES * m)) {
                    *slope += dot_of_part(row, &self.residual, m, &part);
                }
            }
        }
        if self.compares_lengths() {
            self.project();
            add_products(&self.along, 1, m, &(0..m), n, &mut self.full);
            for (slope, row) in self.gradient.iter_mut().zip(self.along.chunks_exact(m)) {
                *slope = dot(row, &self.residual);
            }
        } else if self.eliminate {
            for a in 0..q {
                self.full[(p + a) * n + p..][..=a].copy_from_slice(&self.gram[a * q..][..=a]);
            }
        }
        for a in 0..n {
            for b in 0..a {
                self.full[b * n + a] = self.full[a * n + b];
            }
        }
    }

    /// The components of `rows` along the sum of all pulls.
    #[inline(always)]
    fn project(&mut self) {
        let (m, p) = (self.m, self.free.len());
        for i in 0..m {
            let vector = |row: usize| Vector3::from_fn(|axis, _| self.rows[(AXES * row + axis) * m + i]);
            let sum: Vector3<f64> = self.strengths.iter().enumerate().map(|(c, s)| vector(p + c) * *s).sum();
            let sum = sum.try_normalize(NO_DIRECTION).unwrap_or_else(Vector3::zeros);
            for row in 0..p + self.columns {
                self.along[row * m + i] = sum.dot(&vector(row));
            }
        }
    }
}

/// Lengths of vectors.
#[inline(always)]
fn lengths_of(vectors: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for axis in vectors.chunks_exact(out.len()) {
        for (out, value) in out.iter_mut().zip(axis) {
            *out += value * value;
        }
    }
    for out in out {
        *out = out.sqrt();
    }
}

/// What is worked out.
pub(super) enum What {
    /// θ and its slopes.
    Shape,
    /// The cost, for the strengths as they are or for the best.
    Cost { solve: bool },
    /// The normal matrix.
    Normal,
}

/// Work that is compiled for the registers that the processor has.
pub(super) struct Work<'a, 'b> {
    pub(super) model: &'a mut Model<'b>,
    pub(super) what: What,
}

impl WithSimd for Work<'_, '_> {
    type Output = f64;

    /// The cost; 0 where that was not asked for.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { model, what } = self;
        match what {
            What::Shape => model.shape_inlined(),
            What::Normal => model.normal_inlined(),
            What::Cost { solve } => {
                model.shape_inlined();
                return model.cost_inlined(solve);
            }
        }
        0.0
    }
}
