//! A field of measured forces beside some fibres, made ready to be fitted: weights, places, what of each force is compared.

use nalgebra::Vector3;

use super::{Compare, Sample};
use crate::forces::Cause;
use crate::muscle::{Fibre, MuscleLaw, Place};

/// Samples and fibres, prepared once for any number of laws and fits.
///
/// A sample's weight is √3/σ, one over the standard error of one component, where every σ is known, and 1 otherwise. Forces are divided
/// by the largest, so that strengths are of order 1 inside a fit.
#[derive(Clone, Debug)]
pub struct Field {
    compare: Compare,
    weighted: bool,
    /// Largest force, N: what forces were divided by.
    unit: f64,
    fibres: Vec<Fibre>,
    positions: Vec<nalgebra::Point3<f64>>,
    weights: Vec<f64>,
    /// The surface's normal (tangential) or the fibre's direction (along).
    axes: Vec<Vector3<f64>>,
    /// Weighted forces, reduced to what is compared.
    forces: Vec<Vector3<f64>>,
    /// Sample by sample, fibre by fibre.
    places: Vec<Place>,
    /// Causes of error, reduced as the forces; none where errors are taken for independent.
    causes: Vec<Cause>,
}

/// Why a field cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FieldError {
    /// Nothing to fit to.
    #[error("there are no samples")]
    NoSamples,
    /// Nothing to fit.
    #[error("there are no fibres")]
    NoFibres,
    /// A number is NaN, infinite, or a negative error.
    #[error("sample {sample} holds something that is not a finite number, or a negative error")]
    NotFinite {
        /// Which, from 0.
        sample: usize,
    },
    /// Every force is zero.
    #[error("every force is zero")]
    NoForce,
}

impl Field {
    /// Prepares samples for the given way to compare.
    pub fn new(fibres: &[Fibre], samples: &[Sample], compare: Compare) -> Result<Self, FieldError> {
        if samples.is_empty() {
            return Err(FieldError::NoSamples);
        }
        if fibres.is_empty() {
            return Err(FieldError::NoFibres);
        }
        let bad = |s: &Sample| {
            let numbers = s.position.coords + s.force + s.normal;
            !(numbers.iter().all(|v| v.is_finite()) && s.sigma.is_finite() && s.sigma >= 0.0)
        };
        if let Some(sample) = samples.iter().position(bad) {
            return Err(FieldError::NotFinite { sample });
        }
        let unit = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
        if unit <= 0.0 {
            return Err(FieldError::NoForce);
        }
        let weighted = samples.iter().all(|s| s.sigma > 0.0);
        let mut field = Self {
            compare,
            weighted,
            unit,
            fibres: fibres.to_vec(),
            positions: samples.iter().map(|s| s.position).collect(),
            weights: samples.iter().map(|s| if weighted { 3f64.sqrt() * unit / s.sigma } else { 1.0 }).collect(),
            axes: Vec::new(),
            forces: Vec::new(),
            places: samples.iter().flat_map(|s| fibres.iter().map(|f| f.place(&s.position))).collect(),
            causes: Vec::new(),
        };
        field.axes = samples.iter().map(|s| field.axis(s)).collect();
        field.forces = (0..samples.len()).map(|i| field.reduce(i, &(samples[i].force / unit))).collect();
        Ok(field)
    }

    /// The same with the independent causes of the samples' errors (N, by sample), which tell how these go together.
    #[must_use]
    pub fn with_causes(mut self, causes: &[Cause]) -> Self {
        let reduced = |&(i, e): &(u32, Vector3<f64>)| (i, self.reduce(i as usize, &(e / self.unit)));
        self.causes = causes.iter().map(|cause| cause.iter().map(reduced).collect()).collect();
        self
    }

    fn axis(&self, sample: &Sample) -> Vector3<f64> {
        match self.compare {
            Compare::Tangential => sample.normal.try_normalize(0.0).unwrap_or_else(Vector3::zeros),
            Compare::Along => {
                let distance = |f: &&Fibre| f.distance_mm(&sample.position);
                let nearest = self.fibres.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                nearest.map_or_else(Vector3::zeros, Fibre::pull)
            }
            Compare::Vectors | Compare::Magnitudes => Vector3::zeros(),
        }
    }

    /// What of a vector at sample `i` is compared, times the weight. A component becomes the first coordinate.
    #[inline]
    pub(crate) fn reduce(&self, i: usize, v: &Vector3<f64>) -> Vector3<f64> {
        let (w, axis) = (self.weights[i], &self.axes[i]);
        match self.compare {
            Compare::Vectors | Compare::Magnitudes => v * w,
            Compare::Tangential => (v - axis * axis.dot(v)) * w,
            Compare::Along => Vector3::new(axis.dot(v) * w, 0.0, 0.0),
        }
    }

    /// The reduced directions in which a law pulls, sample by sample, fibre by fibre.
    pub(crate) fn directions(&self, law: &MuscleLaw) -> Vec<Vector3<f64>> {
        let mut all = Vec::with_capacity(self.places.len());
        for (i, x) in self.positions.iter().enumerate() {
            all.extend(self.fibres.iter().map(|f| self.reduce(i, &law.direction(f, x))));
        }
        all
    }

    /// How forces and laws are compared.
    pub fn compare(&self) -> Compare {
        self.compare
    }

    /// Whether samples count by their standard errors.
    pub fn weighted(&self) -> bool {
        self.weighted
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.forces.len()
    }

    /// Whether there are none; never true of a field that was made.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty()
    }

    /// The fibres.
    pub fn fibres(&self) -> &[Fibre] {
        &self.fibres
    }

    /// Numbers that are compared: 3 a sample for vectors, 2 in the surface, 1 otherwise.
    pub fn rows(&self) -> usize {
        let each = match self.compare {
            Compare::Vectors => 3,
            Compare::Tangential => 2,
            Compare::Along | Compare::Magnitudes => 1,
        };
        each * self.len()
    }

    /// Largest force, N.
    pub(crate) fn unit(&self) -> f64 {
        self.unit
    }

    pub(crate) fn places(&self) -> &[Place] {
        &self.places
    }

    pub(crate) fn forces(&self) -> &[Vector3<f64>] {
        &self.forces
    }

    pub(crate) fn causes(&self) -> &[Cause] {
        &self.causes
    }

    pub(crate) fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Σ of the squared weighted data: the cost of no muscle at all.
    pub(crate) fn cost_of_nothing(&self) -> f64 {
        self.forces.iter().map(Vector3::norm_squared).sum()
    }
}
