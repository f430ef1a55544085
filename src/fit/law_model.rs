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
use pulp::Arch;

use super::field::Field;
use super::law_sums::{What, Work};
use super::levenberg_marquardt::LeastSquares;
use super::planes::padded;
use super::together::Together;
use super::{Compare, Strengths, cholesky};
use crate::muscle::{MuscleLaw, Parameter, Shape};

/// The problem, at one point of it.
///
/// Numbers lie sample by sample, `m` of them: as many as there are samples, and zeros up to a multiple of the lanes. Vectors are three such
/// lists one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Model<'a> {
    pub(super) arch: Arch,
    pub(super) field: &'a Field,
    pub(super) law: MuscleLaw,
    pub(super) parameters: Vec<Parameter>,
    /// Which parameters are unknowns, in order.
    pub(super) free: Vec<usize>,
    /// Which have no slope and are to be found all the same.
    pub(super) sharp: Vec<usize>,
    pub(super) eliminate: bool,
    pub(super) shared: bool,
    pub(super) m: usize,
    /// Strengths.
    pub(super) columns: usize,
    /// The observed vectors.
    pub(super) observed: Vec<f64>,
    /// Fibre by fibre, what the law depends on, and the vectors along which it pulls.
    pub(super) coordinates: Vec<f64>,
    pub(super) directions: Vec<f64>,
    /// Products of the directions of every two fibres (the second one no later), and of each fibre's with what is observed.
    pub(super) pairs: Vec<f64>,
    pub(super) seen: Vec<f64>,
    pub(super) values: Vec<f64>,
    pub(super) shapes: Vec<Shape>,
    /// θ, term by term, and its slopes, term by term and parameter by parameter.
    pub(super) theta: Vec<f64>,
    pub(super) slopes: Vec<f64>,
    /// Vectors: D, one for each free parameter, and Φ, one for each column.
    pub(super) rows: Vec<f64>,
    /// Where lengths are compared: those of Φ and of what is observed, the parts of `rows` along the sum of all pulls, and that sum.
    pub(super) lengths: Vec<f64>,
    pub(super) along: Vec<f64>,
    pub(super) sum: Vec<f64>,
    pub(super) strengths: Vec<f64>,
    /// Vectors; a single list where lengths are compared.
    pub(super) residual: Vec<f64>,
    pub(super) gram: Vec<f64>,
    pub(super) factor: Vec<f64>,
    /// Strengths that the shapes leave without any support.
    pub(super) dropped: usize,
    pub(super) full: Vec<f64>,
    pub(super) gradient: Vec<f64>,
    pub(super) half: Vec<f64>,
    /// The values at which the model stands with the strengths that are best there, and the cost.
    pub(super) stands: Option<(Vec<f64>, f64)>,
    /// The best minimum of earlier starts: its values and its cost.
    pub(super) best: Option<(Vec<f64>, f64)>,
    /// Calls of [`LeastSquares::cost`].
    pub(crate) evaluations: usize,
}

/// Coordinates of a vector.
pub(super) const AXES: usize = 3;

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
        let (m, terms) = (padded(field.len()), lobes * fibres);
        // Lengths of sums are not linear in the strengths.
        let lengths = field.compare() == Compare::Magnitudes;
        let eliminate = eliminate && !lengths;
        let unknowns = free.len() + columns;
        let mut model = Self {
            arch: Arch::new(),
            field,
            law: *law,
            values: parameters.iter().map(|p| p.value).collect(),
            eliminate,
            shared,
            m,
            columns,
            observed: vec![0.0; AXES * m],
            coordinates: vec![0.0; 2 * fibres * m],
            directions: vec![0.0; fibres * AXES * m],
            pairs: vec![0.0; fibres * (fibres + 1) / 2 * m],
            seen: vec![0.0; fibres * m],
            shapes: Vec::with_capacity(fibres),
            theta: vec![0.0; terms * m],
            slopes: vec![0.0; terms * parameters.len() * m],
            rows: vec![0.0; (free.len() + columns) * AXES * m],
            lengths: vec![0.0; if lengths { (columns + 1) * m } else { 0 }],
            along: vec![0.0; if lengths { (free.len() + columns) * m } else { 0 }],
            sum: vec![0.0; if lengths { AXES * m } else { 0 }],
            strengths: vec![0.0; columns],
            residual: vec![0.0; if lengths { m } else { AXES * m }],
            gram: vec![0.0; columns * columns],
            factor: vec![0.0; columns * columns],
            dropped: 0,
            full: vec![0.0; unknowns * unknowns],
            gradient: vec![0.0; unknowns],
            half: vec![0.0; columns],
            stands: None,
            best: None,
            evaluations: 0,
            parameters,
            free,
            sharp,
        };
        model.lay_out();
        model
    }

    /// Lays the field out list by list.
    fn lay_out(&mut self) {
        let (m, fibres) = (self.m, self.field.fibres().len());
        for (i, force) in self.field.forces().iter().enumerate() {
            for (axis, value) in force.iter().enumerate() {
                self.observed[axis * m + i] = *value;
            }
        }
        let places = self.field.places().chunks_exact(fibres);
        let directions = self.field.directions(&self.law);
        for (i, (places, directions)) in places.zip(directions.chunks_exact(fibres)).enumerate() {
            for (fibre, (place, direction)) in places.iter().zip(directions).enumerate() {
                for (at, value) in self.law.coordinates(place).into_iter().enumerate() {
                    self.coordinates[(2 * fibre + at) * m + i] = value;
                }
                for (axis, value) in direction.iter().enumerate() {
                    self.directions[(AXES * fibre + axis) * m + i] = *value;
                }
            }
        }
        let axis = |list: &[f64], at: usize, i: usize| list[at * m + i];
        let mut pairs = self.pairs.chunks_exact_mut(m);
        for (a, seen) in self.seen.chunks_exact_mut(m).enumerate() {
            for (i, seen) in seen.iter_mut().enumerate() {
                let along = |x| axis(&self.directions, AXES * a + x, i) * axis(&self.observed, x, i);
                *seen = (0..AXES).map(along).sum();
            }
            for (b, pair) in pairs.by_ref().take(a + 1).enumerate() {
                for (i, pair) in pair.iter_mut().enumerate() {
                    let along = |x| axis(&self.directions, AXES * a + x, i) * axis(&self.directions, AXES * b + x, i);
                    *pair = (0..AXES).map(along).sum();
                }
            }
        }
        if let Some((_, observed)) = self.lengths.split_at_mut_checked(self.columns * m) {
            for (out, force) in observed.iter_mut().zip(self.field.forces()) {
                *out = force.norm();
            }
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

    /// Squares of the weighted residual, sample by sample.
    pub(crate) fn residual_squares(&self) -> impl Iterator<Item = f64> {
        (0..self.field.len()).map(|i| self.residual.chunks_exact(self.m).map(|r| r[i] * r[i]).sum())
    }

    /// Vector that a fibre adds at a sample for a strength of 1.
    pub(super) fn pull(&self, fibre: usize, sample: usize) -> Vector3<f64> {
        let theta = self.theta[fibre * self.m + sample];
        Vector3::from_fn(|axis, _| theta * self.directions[(AXES * fibre + axis) * self.m + sample])
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
        self.values.copy_from_slice(values);
        if let Some(strengths) = strengths {
            self.strengths.copy_from_slice(strengths);
        }
        self.evaluate(strengths.is_none())
    }

    /// The unknowns for a shape (all parameters of the law): strengths, where they are unknowns, are the best for that shape.
    pub(crate) fn start(&mut self, values: &[f64]) -> Vec<f64> {
        self.values.copy_from_slice(values);
        let mut u: Vec<f64> = self.free.iter().map(|&k| self.logarithm(k, values[k])).collect();
        if !self.eliminate {
            self.evaluate(true);
            u.extend(&self.strengths);
        }
        u
    }

    /// θ, its slopes and the cost, where the values are and for the strengths as they are or the best for these values.
    fn evaluate(&mut self, solve: bool) -> f64 {
        if let Some((values, cost)) = self.stands.as_ref().filter(|_| solve)
            && *values == self.values
        {
            return *cost;
        }
        self.evaluations += 1;
        let cost = self.arch.dispatch(Work { model: self, what: What::Cost { solve } });
        let mut values = self.stands.take().map(|s| s.0).unwrap_or_default();
        if solve {
            values.clone_from(&self.values);
            self.stands = Some((values, cost));
        }
        cost
    }

    /// θ and its slopes along the law's parameters, where the values are.
    pub(super) fn shape(&mut self) {
        self.stands = None;
        self.arch.dispatch(Work { model: self, what: What::Shape });
    }

    fn set(&mut self, u: &[f64]) {
        for (&k, u) in self.free.iter().zip(u) {
            let p = &self.parameters[k];
            // The bounds are logarithms, and their exponentials may lie a rounding error outside.
            self.values[k] = (p.origin + u.exp()).clamp(p.low, p.high);
        }
    }

    /// The normal matrix of (logarithms of the free parameters, strengths) and the slope of the cost, at the point where the model stands.
    pub(crate) fn normal(&mut self) -> (&[f64], &[f64]) {
        self.arch.dispatch(Work { model: self, what: What::Normal });
        (&self.full, &self.gradient)
    }

    /// What the field's causes of error do to the unknowns of [`Self::normal`], which was asked for last; none where it has none.
    pub(super) fn together(&self) -> Option<Together> {
        let (m, unknowns) = (self.m, self.free.len() + self.columns);
        let row = |u: usize, i: usize, e: &Vector3<f64>| {
            if self.compares_lengths() {
                // |y + e| − |y|, to first order.
                let y = &self.field.forces()[i];
                self.along[u * m + i] * y.dot(e) / y.norm().max(f64::MIN_POSITIVE)
            } else {
                (0..AXES).map(|axis| self.rows[(AXES * u + axis) * m + i] * e[axis]).sum()
            }
        };
        Together::new(unknowns, self.field.causes(), row)
    }

    pub(super) fn column_of(&self, term: usize) -> usize {
        if self.shared { term / self.shapes.len() } else { term }
    }

    pub(super) fn compares_lengths(&self) -> bool {
        !self.lengths.is_empty()
    }
}

impl LeastSquares for Model<'_> {
    fn cost(&mut self, u: &[f64]) -> f64 {
        self.set(u);
        if !self.eliminate {
            self.strengths.copy_from_slice(&u[self.free.len()..]);
        }
        self.evaluate(self.eliminate)
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

    fn is_known(&self, _: &[f64], cost: f64) -> bool {
        self.best.as_ref().is_some_and(|(values, least)| self.leads_to(values, *least, cost))
    }

    fn rounding(&self) -> f64 {
        // Each of the residual's numbers is a difference of numbers rounded to 1.1e-16.
        (4.0 * f64::EPSILON).powi(2) * self.field.cost_of_nothing()
    }
}
