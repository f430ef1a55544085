//! Forces as a sum of columns: what each of several muscles would do at every measured vertex with a strength of 1 N.

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::non_negative::NormalEquations;
use super::together::Together;
use super::{Compare, Sample};
use crate::forces::Cause;
use crate::muscle::{Fibre, MuscleLaw};

/// A force is F = Σ x_j f_j with strengths x_j, N. Here are the f_j and the observed F, both divided by their standard errors.
///
/// Rows go sample by sample, three a sample. Where directions along the normal are not compared, both sides are projected into the
/// surface; a sample then counts as two observations.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Weighted columns, 3 n × k.
    columns: DMatrix<f64>,
    /// Weighted observations, 3 n.
    observed: DVector<f64>,
    /// One over the standard error of each component, 1/N.
    weights: Vec<f64>,
    /// The normal that is projected out, where it is.
    normals: Option<Vec<Vector3<f64>>>,
    /// Causes of error, reduced and weighted as the observations; none where errors are taken for independent.
    causes: Vec<Cause>,
}

/// Why forces cannot be compared with a sum of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DesignError {
    /// Nothing is measured.
    #[error("there is no measured force to explain")]
    NoSamples,
    /// The strengths would not enter linearly, or the direction is not one for several fibres.
    #[error("several muscles at once are compared by vectors or by their tangential parts only")]
    NotLinear,
    /// A number is not finite.
    #[error("the force of sample {sample} is not a finite number, or its standard error is negative")]
    NotFinite {
        /// Index of the sample, from 0.
        sample: usize,
    },
}

impl Design {
    /// The observations, still without a muscle.
    ///
    /// σ of a sample is the length of its error vector (rms), so each component has σ/√3 (σ/√2 where two are compared). Where a σ is
    /// zero, no sample is weighted by it: all count alike, with the unit 1 N.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(samples: &[Sample], compare: Compare) -> Result<Self, DesignError> {
        if samples.is_empty() {
            return Err(DesignError::NoSamples);
        }
        let normals = match compare {
            Compare::Vectors => None,
            Compare::Tangential => Some(samples.iter().map(|s| s.normal).collect()),
            _ => return Err(DesignError::NotLinear),
        };
        let fine = |s: &Sample| s.force.iter().chain(s.normal.iter()).all(|v| v.is_finite()) && s.sigma >= 0.0;
        if let Some(sample) = samples.iter().position(|s| !fine(s)) {
            return Err(DesignError::NotFinite { sample });
        }
        let components: f64 = if normals.is_some() { 2.0 } else { 3.0 };
        let weigh = samples.iter().all(|s| s.sigma > 0.0 && s.sigma.is_finite());
        let weights = samples.iter().map(|s| if weigh { components.sqrt() / s.sigma } else { 1.0 }).collect();
        let columns = DMatrix::zeros(3 * samples.len(), 0);
        let mut design = Self { columns, observed: DVector::zeros(0), weights, normals, causes: Vec::new() };
        design.observed = DVector::from_vec(design.column(samples.iter().map(|s| s.force)));
        Ok(design)
    }

    /// The observations and one column a fibre, by one law.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn of(law: &MuscleLaw, fibres: &[Fibre], samples: &[Sample], compare: Compare) -> Result<Self, DesignError> {
        let mut design = Self::new(samples, compare)?;
        let mut values = Vec::with_capacity(3 * samples.len() * fibres.len());
        let positions: Vec<Point3<f64>> = samples.iter().map(|s| s.position).collect();
        for fibre in fibres {
            values.extend(design.column(law.forces(fibre, &positions).into_iter()));
        }
        design.columns = DMatrix::from_vec(3 * samples.len(), fibres.len(), values);
        Ok(design)
    }

    /// The same with the independent causes of the samples' errors (N, by sample), which tell how these go together.
    #[must_use]
    pub fn with_causes(mut self, causes: &[Cause]) -> Self {
        let seen = |&(i, e): &(u32, Vector3<f64>)| (i, self.seen(i as usize, e) * self.weights[i as usize]);
        self.causes = causes.iter().map(|cause| cause.iter().map(seen).collect()).collect();
        self
    }

    /// What the causes of error do to the strengths; none where it has none.
    pub(super) fn together(&self) -> Option<Together> {
        let row = |j: usize, i: usize, e: &Vector3<f64>| self.columns.fixed_view::<3, 1>(3 * i, j).dot(e);
        Together::new(self.muscles(), &self.causes, row)
    }

    /// What of a vector on a sample is compared.
    fn seen(&self, sample: usize, v: Vector3<f64>) -> Vector3<f64> {
        self.normals.as_ref().map_or(v, |normals| v - normals[sample] * normals[sample].dot(&v))
    }

    /// Adds a muscle, or a part of one, by its force on every sample at a strength of 1 N.
    pub fn add(&mut self, forces: impl Iterator<Item = Vector3<f64>>) {
        let column = DVector::from_vec(self.column(forces));
        let k = self.columns.ncols();
        let columns = std::mem::replace(&mut self.columns, DMatrix::zeros(0, 0));
        self.columns = columns.insert_column(k, 0.0);
        self.columns.set_column(k, &column);
    }

    /// The same columns for other forces on the same places.
    ///
    /// # Errors
    /// [`DesignError`], and where there is another number of samples.
    pub fn with_forces(&self, samples: &[Sample]) -> Result<Self, DesignError> {
        let compare = if self.normals.is_some() { Compare::Tangential } else { Compare::Vectors };
        let mut new = Self::new(samples, compare)?;
        if new.samples() != self.samples() {
            return Err(DesignError::NoSamples);
        }
        new.columns = self.columns.clone();
        for (at, (old, weight)) in self.weights.iter().zip(&new.weights).enumerate() {
            if old != weight {
                new.columns.rows_mut(3 * at, 3).scale_mut(weight / old);
            }
        }
        Ok(new)
    }

    fn column(&self, forces: impl Iterator<Item = Vector3<f64>>) -> Vec<f64> {
        let mut values = vec![0.0; 3 * self.weights.len()];
        for (at, (force, row)) in forces.zip(values.chunks_exact_mut(3)).enumerate() {
            row.copy_from_slice((self.seen(at, force) * self.weights[at]).as_slice());
        }
        values
    }

    /// Number of muscles.
    pub fn muscles(&self) -> usize {
        self.columns.ncols()
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.weights.len()
    }

    /// Number of observed components: three a sample, or two where the normal one is left out.
    pub fn observations(&self) -> usize {
        self.weights.len() * if self.normals.is_some() { 2 } else { 3 }
    }

    /// The normal equations over all samples.
    pub fn normal_equations(&self) -> NormalEquations {
        NormalEquations::of(&self.columns, &self.observed)
    }

    /// The normal equations over some of the samples.
    pub fn normal_equations_of(&self, samples: &[usize]) -> NormalEquations {
        let rows: Vec<usize> = samples.iter().flat_map(|&s| [3 * s, 3 * s + 1, 3 * s + 2]).collect();
        NormalEquations::of(&self.columns.select_rows(&rows), &self.observed.select_rows(&rows))
    }

    /// Force of one muscle on one sample at a strength of 1 N, as it is compared.
    pub fn force(&self, muscle: usize, sample: usize) -> Vector3<f64> {
        self.columns.fixed_view::<3, 1>(3 * sample, muscle) / self.weights[sample]
    }

    /// The observed force of a sample, as it is compared, N.
    pub fn observed(&self, sample: usize) -> Vector3<f64> {
        self.observed.fixed_rows::<3>(3 * sample) / self.weights[sample]
    }

    /// The force on one sample with these strengths, N.
    pub fn predicted(&self, sample: usize, strengths: &DVector<f64>) -> Vector3<f64> {
        (0..self.muscles()).filter(|&j| strengths[j] != 0.0).map(|j| self.force(j, sample) * strengths[j]).sum()
    }

    /// Cosine between two columns: 1 where two muscles do the same, 0 where they share no vertex or pull across each other.
    pub fn cosine(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (self.columns.column(a), self.columns.column(b));
        let lengths = a.norm() * b.norm();
        if lengths > 0.0 { a.dot(&b) / lengths } else { 0.0 }
    }
}
