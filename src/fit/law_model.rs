//! One law over several fibres as a least-squares problem whose strengths are eliminated.
//!
//! The model of sample i is a sum of columns, each with a linear strength:
//!
//! ```text
//! f_i(p, s) = Σ_c s_c φ_ic(p),     φ_ic = θ(place of i beside fibre c; p) d_ic
//! ```
//!
//! For given shape p the best strengths are those of linear least squares, s(p) = G⁻¹ Φᵀy with G = ΦᵀΦ. Put in, the residual
//! r(p) = y − Φ(p) s(p) depends on p alone (variable projection, Golub and Pereyra 1973). Kaufman's (1975) form of its slopes drops
//! a term that is of the order of the residual:
//!
//! ```text
//! J = (1 − Φ G⁻¹ Φᵀ) D,            D_k = Σ_c s_c ∂φ_c/∂p_k
//! JᵀJ = DᵀD − DᵀΦ G⁻¹ ΦᵀD,         Jᵀr = Dᵀr      (r stands at a right angle to Φ)
//! ```
//!
//! That is the Schur complement of the normal matrix of p and s together, which is what is summed up here, and what the intervals of a fit
//! are read from.

use nalgebra::Vector3;

use super::field::Field;
use super::levenberg_marquardt::LeastSquares;
use super::{Compare, Strengths, cholesky};
use crate::muscle::{MAX_PARAMETERS, MuscleLaw, Parameter, Shape};

/// The problem, at one point of it.
#[derive(Clone, Debug)]
pub(crate) struct Model<'a> {
    pub(super) field: &'a Field,
    law: MuscleLaw,
    pub(super) parameters: Vec<Parameter>,
    /// Which parameters are unknowns, in order.
    free: Vec<usize>,
    /// Which have no slope and are to be found all the same.
    sharp: Vec<usize>,
    eliminate: bool,
    shared: bool,
    /// Terms a sample: lobes × fibres, lobe by lobe.
    terms: usize,
    /// Strengths.
    columns: usize,
    pub(super) directions: Vec<Vector3<f64>>,
    pub(super) values: Vec<f64>,
    shapes: Vec<Shape>,
    pub(super) theta: Vec<f64>,
    slopes: Vec<[f64; MAX_PARAMETERS]>,
    strengths: Vec<f64>,
    residual: Vec<Vector3<f64>>,
    gram: Vec<f64>,
    factor: Vec<f64>,
    /// Strengths that the shapes leave without any support.
    dropped: usize,
    full: Vec<f64>,
    gradient: Vec<f64>,
    /// Scratch: columns of one sample, its slopes, and which columns are not zero.
    column: Vec<Vector3<f64>>,
    slope: Vec<Vector3<f64>>,
    active: Vec<usize>,
    half: Vec<f64>,
    /// Calls of [`LeastSquares::cost`].
    pub(crate) evaluations: usize,
}

/// Lengths of vectors below this share of the largest force have no direction.
const NO_DIRECTION: f64 = 1e-12;

impl<'a> Model<'a> {
    /// `held` names parameters that keep their value.
    pub(crate) fn new(
        field: &'a Field,
        law: &MuscleLaw,
        strengths: Strengths,
        held: &[String],
        eliminate: bool,
    ) -> Self {
        let parameters = law.parameters();
        let moves = |p: &Parameter| !held.iter().any(|h| h == p.name);
        let moving = (0..parameters.len()).filter(|&k| moves(&parameters[k]));
        let (free, sharp): (Vec<usize>, Vec<usize>) = moving.partition(|&k| parameters[k].smooth);
        let (fibres, lobes) = (field.fibres().len(), law.lobes());
        let shared = strengths == Strengths::Shared;
        let columns = if shared { lobes } else { lobes * fibres };
        let (n, terms) = (field.len(), lobes * fibres);
        // Lengths of sums are not linear in the strengths.
        let eliminate = eliminate && field.compare() != Compare::Magnitudes;
        let unknowns = free.len() + columns;
        Self {
            field,
            law: *law,
            values: parameters.iter().map(|p| p.value).collect(),
            eliminate,
            shared,
            terms,
            columns,
            directions: field.directions(law),
            shapes: Vec::with_capacity(fibres),
            theta: vec![0.0; n * terms],
            slopes: vec![[0.0; MAX_PARAMETERS]; n * terms],
            strengths: vec![0.0; columns],
            residual: vec![Vector3::zeros(); n],
            gram: vec![0.0; columns * columns],
            factor: vec![0.0; columns * columns],
            dropped: 0,
            full: vec![0.0; unknowns * unknowns],
            gradient: vec![0.0; unknowns],
            column: vec![Vector3::zeros(); columns],
            slope: vec![Vector3::zeros(); free.len()],
            active: Vec::with_capacity(columns),
            half: vec![0.0; columns],
            evaluations: 0,
            parameters,
            free,
            sharp,
        }
    }

    pub(crate) fn field(&self) -> &Field {
        self.field
    }

    pub(crate) fn free(&self) -> &[usize] {
        &self.free
    }

    pub(crate) fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    pub(crate) fn strengths(&self) -> &[f64] {
        &self.strengths
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn dropped(&self) -> usize {
        self.dropped
    }

    pub(crate) fn residual(&self) -> &[Vector3<f64>] {
        &self.residual
    }

    /// The law with the shape at which the model stands.
    pub(crate) fn law(&self) -> MuscleLaw {
        self.law.at(&self.values)
    }

    pub(crate) fn eliminates(&self) -> bool {
        self.eliminate
    }

    /// Unknowns of the descent: logarithms of the free parameters, and the strengths unless they are eliminated.
    pub(crate) fn unknowns(&self) -> usize {
        self.free.len() + if self.eliminate { 0 } else { self.columns }
    }

    /// Where parameter k of the law stands on its logarithmic scale.
    pub(crate) fn logarithm(&self, k: usize, value: f64) -> f64 {
        (value - self.parameters[k].origin).ln()
    }

    /// Bounds of the unknowns.
    pub(crate) fn bounds(&self) -> Vec<[f64; 2]> {
        let of = |&k: &usize| [self.logarithm(k, self.parameters[k].low), self.logarithm(k, self.parameters[k].high)];
        let mut bounds: Vec<[f64; 2]> = self.free.iter().map(of).collect();
        bounds.resize(self.unknowns(), [-1e6, 1e6]);
        bounds
    }

    pub(crate) fn value(&self, k: usize) -> f64 {
        self.values[k]
    }

    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Parameters without a slope that are to be found: the sharp side of a zone.
    pub(crate) fn sharp(&self) -> impl Iterator<Item = usize> + use<> {
        self.sharp.clone().into_iter()
    }

    /// The cost at a shape (all parameters of the law, within their ranges), for given strengths or the best ones.
    pub(crate) fn cost_at(&mut self, values: &[f64], strengths: Option<&[f64]>) -> f64 {
        self.evaluations += 1;
        self.values.copy_from_slice(values);
        self.shape();
        match strengths {
            Some(strengths) => self.strengths.copy_from_slice(strengths),
            None => self.solve_strengths(),
        }
        self.residue()
    }

    /// The unknowns for a shape (all parameters of the law): strengths, where they are unknowns, are the best for that shape.
    pub(crate) fn start(&mut self, values: &[f64]) -> Vec<f64> {
        self.values.copy_from_slice(values);
        let mut u: Vec<f64> = self.free.iter().map(|&k| self.logarithm(k, values[k])).collect();
        if !self.eliminate {
            self.shape();
            self.solve_strengths();
            u.extend(&self.strengths);
        }
        u
    }

    fn set(&mut self, u: &[f64]) {
        for (&k, u) in self.free.iter().zip(u) {
            let p = &self.parameters[k];
            // The bounds are logarithms, and their exponentials may lie a rounding error outside.
            self.values[k] = (p.origin + u.exp()).clamp(p.low, p.high);
        }
    }

    /// θ and its slopes along the law's parameters, everywhere.
    pub(super) fn shape(&mut self) {
        let law = self.law.at(&self.values);
        self.shapes.clear();
        self.shapes.extend(self.field.fibres().iter().map(|f| law.on(f)));
        let (fibres, lobes) = (self.shapes.len(), self.terms / self.shapes.len());
        let places = self.field.places();
        for (i, places) in places.chunks_exact(fibres).enumerate() {
            for lobe in 0..lobes {
                let at = i * self.terms + lobe * fibres;
                let out = self.theta[at..at + fibres].iter_mut().zip(&mut self.slopes[at..at + fibres]);
                for ((theta, slopes), (shape, place)) in out.zip(self.shapes.iter().zip(places)) {
                    *theta = shape.at(lobe, place, slopes);
                }
            }
        }
    }

    fn column_of(&self, term: usize) -> usize {
        if self.shared { term / self.shapes.len() } else { term }
    }

    /// The columns of sample `i` and which of them are not zero.
    fn columns_of(&mut self, i: usize) {
        let fibres = self.shapes.len();
        self.active.clear();
        self.column.fill(Vector3::zeros());
        for term in 0..self.terms {
            let theta = self.theta[i * self.terms + term];
            if theta != 0.0 {
                let c = self.column_of(term);
                self.column[c] += self.directions[i * fibres + term % fibres] * theta;
                if self.active.last() != Some(&c) {
                    self.active.push(c);
                }
            }
        }
    }

    /// The best strengths for the shape: s = G⁻¹ Φᵀ y. For lengths, the best for the sum of lengths.
    fn solve_strengths(&mut self) {
        let q = self.columns;
        let lengths = self.field.compare() == Compare::Magnitudes;
        self.gram.fill(0.0);
        self.strengths.fill(0.0);
        for i in 0..self.field.len() {
            self.columns_of(i);
            let y = &self.field.forces()[i];
            for (a, &c) in self.active.iter().enumerate() {
                if lengths {
                    self.column[c] = Vector3::new(self.column[c].norm(), 0.0, 0.0);
                    self.strengths[c] += self.column[c].x * y.norm();
                } else {
                    self.strengths[c] += self.column[c].dot(y);
                }
                for &d in &self.active[..=a] {
                    let (low, high) = (c.min(d), c.max(d));
                    self.gram[high * q + low] += self.column[c].dot(&self.column[d]);
                }
            }
        }
        self.factor.copy_from_slice(&self.gram);
        self.dropped = cholesky::factor(&mut self.factor, q);
        cholesky::solve(&self.factor, q, &mut self.strengths);
    }

    /// The residual for shape and strengths, and its square.
    fn residue(&mut self) -> f64 {
        let fibres = self.shapes.len();
        let lengths = self.field.compare() == Compare::Magnitudes;
        let mut cost = 0.0;
        for (i, y) in self.field.forces().iter().enumerate() {
            let mut f = Vector3::zeros();
            for (term, theta) in self.theta[i * self.terms..(i + 1) * self.terms].iter().enumerate() {
                let strength = self.strengths[if self.shared { term / fibres } else { term }];
                f += self.directions[i * fibres + term % fibres] * (theta * strength);
            }
            let r = if lengths { Vector3::new(y.norm() - f.norm(), 0.0, 0.0) } else { y - f };
            cost += r.norm_squared();
            self.residual[i] = r;
        }
        cost
    }

    /// The normal matrix of (logarithms of the free parameters, strengths) and the slope of the cost, at the point where the model stands.
    pub(crate) fn normal(&mut self) -> (&[f64], &[f64]) {
        let (p, q) = (self.free.len(), self.columns);
        let n = p + q;
        let fibres = self.shapes.len();
        let lengths = self.field.compare() == Compare::Magnitudes;
        // ∂/∂ln(v − o) = (v − o) ∂/∂v
        let mut factors = [0.0; MAX_PARAMETERS];
        for (factor, (value, parameter)) in factors.iter_mut().zip(self.values.iter().zip(&self.parameters)) {
            *factor = value - parameter.origin;
        }
        self.full.fill(0.0);
        self.gradient.fill(0.0);
        for i in 0..self.field.len() {
            self.columns_of(i);
            if self.active.is_empty() {
                continue;
            }
            self.slope.fill(Vector3::zeros());
            for term in 0..self.terms {
                let at = i * self.terms + term;
                if self.theta[at] == 0.0 {
                    continue;
                }
                let pull = self.directions[i * fibres + term % fibres] * self.strengths[self.column_of(term)];
                for (slope, &k) in self.slope.iter_mut().zip(&self.free) {
                    *slope += pull * (self.slopes[at][k] * factors[k]);
                }
            }
            if lengths {
                let f: Vector3<f64> = self.active.iter().map(|&c| self.column[c] * self.strengths[c]).sum();
                let u = f.try_normalize(NO_DIRECTION).unwrap_or_else(Vector3::zeros);
                for v in self.slope.iter_mut().chain(&mut self.column) {
                    *v = Vector3::new(u.dot(v), 0.0, 0.0);
                }
            }
            let r = &self.residual[i];
            for (k, slope) in self.slope.iter().enumerate() {
                self.gradient[k] += slope.dot(r);
                for (l, other) in self.slope[..=k].iter().enumerate() {
                    self.full[k * n + l] += slope.dot(other);
                }
            }
            for (a, &c) in self.active.iter().enumerate() {
                let column = self.column[c];
                self.gradient[p + c] += column.dot(r);
                let row = (p + c) * n;
                for (k, slope) in self.slope.iter().enumerate() {
                    self.full[row + k] += column.dot(slope);
                }
                for &d in &self.active[..=a] {
                    let (low, high) = (c.min(d), c.max(d));
                    self.full[(p + high) * n + p + low] += column.dot(&self.column[d]);
                }
            }
        }
        for i in 0..n {
            for j in 0..i {
                self.full[j * n + i] = self.full[i * n + j];
            }
        }
        (&self.full, &self.gradient)
    }
}

impl LeastSquares for Model<'_> {
    fn cost(&mut self, u: &[f64]) -> f64 {
        self.evaluations += 1;
        self.set(u);
        self.shape();
        if self.eliminate {
            self.solve_strengths();
        } else {
            self.strengths.copy_from_slice(&u[self.free.len()..]);
        }
        self.residue()
    }

    fn linearise(&mut self, jtj: &mut [f64], jtr: &mut [f64]) {
        let (p, q) = (self.free.len(), self.columns);
        let n = p + q;
        self.normal();
        if !self.eliminate {
            jtj.copy_from_slice(&self.full);
            jtr.copy_from_slice(&self.gradient);
            return;
        }
        jtr.copy_from_slice(&self.gradient[..p]);
        // DᵀD − (L⁻¹ΦᵀD)ᵀ (L⁻¹ΦᵀD), column by column; the forward-solved columns are kept where ΦᵀD stood.
        for k in 0..p {
            for c in 0..q {
                self.half[c] = self.full[(p + c) * n + k];
            }
            cholesky::forward(&self.factor, q, &mut self.half);
            for c in 0..q {
                self.full[(p + c) * n + k] = self.half[c];
            }
        }
        for k in 0..p {
            for l in 0..p {
                let both: f64 = (p..n).map(|c| self.full[c * n + k] * self.full[c * n + l]).sum();
                jtj[k * p + l] = self.full[k * n + l] - both;
            }
        }
    }

    fn rounding(&self) -> f64 {
        // Each of the residual's numbers is a difference of numbers rounded to 1.1e-16.
        (4.0 * f64::EPSILON).powi(2) * self.field.cost_of_nothing()
    }
}
