//! What was observed, what a law says, and what it leaves, at every vertex: the maps of the muscles.

use nalgebra::Vector3;

use super::analysis::Analysis;
use super::fibres::{FibreAt, fibre_field};
use super::profiles::Part;
use crate::face::FaceModel;
use crate::fit::Compare;
use crate::pipeline::Outcome;

/// One value a vertex, N or relative; absent where nothing is known, and along the fibres where no muscle runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// What was observed.
    pub observed: Vec<Option<f64>>,
    /// What the law says.
    pub said: Vec<Option<f64>>,
    /// The part shown of observed less said. Of lengths it is the length of the difference.
    pub left: Vec<Option<f64>>,
    /// Whether the law was fitted to the vertex: only those set a range of colours.
    pub fitted: Vec<bool>,
}

/// How forces of an outcome are read as one value a vertex: which part of them, and whether only what lies in the skin.
pub(super) struct Reading<'a> {
    outcome: &'a Outcome,
    normals: Vec<Vector3<f64>>,
    along: Vec<Option<FibreAt>>,
    compare: Compare,
    part: Part,
}

impl<'a> Reading<'a> {
    /// Where only what lies in the skin is compared, only that is read.
    pub(super) fn new(outcome: &'a Outcome, face: &FaceModel, compare: Compare, part: Part) -> Self {
        let normals = face.mesh().vertex_normals(&outcome.first);
        Self { outcome, normals, along: fibre_field(face, &outcome.first), compare, part }
    }

    /// What was observed.
    pub(super) fn observed(&self) -> Vec<Option<f64>> {
        self.values(&|v| self.outcome.measured().0.get(v).copied())
    }

    /// Any force a vertex, at the vertices that are known.
    fn values(&self, of: &dyn Fn(usize) -> Option<Vector3<f64>>) -> Vec<Option<f64>> {
        let known = |v: usize| self.outcome.states.get(v).is_some_and(|s| s.is_known());
        let value = |v: usize| self.value(v, of(v)?).filter(|x| x.is_finite());
        (0..self.normals.len()).map(|v| if known(v) { value(v) } else { None }).collect()
    }

    fn value(&self, v: usize, force: Vector3<f64>) -> Option<f64> {
        let laid = match self.compare {
            Compare::Tangential => force - self.normals[v] * self.normals[v].dot(&force),
            _ => force,
        };
        match self.part {
            Part::Magnitude => Some(laid.norm()),
            Part::AlongFibre => self.along.get(v)?.as_ref().map(|at| laid.dot(&at.direction)),
        }
    }
}

/// The fields of the law with that index in [`Analysis::laws`]. Where only what lies in the skin was compared, only that is shown.
pub fn fields(outcome: &Outcome, face: &FaceModel, analysis: &Analysis, law: usize, part: Part) -> Fields {
    let reading = Reading::new(outcome, face, analysis.question.compare, part);
    let fibres = analysis.set_fibres();
    let fit = analysis.laws.get(law).and_then(|row| row.fit.as_ref().ok());
    let said = |v: usize| Some(fit?.force_at(&fibres, outcome.first.get(v)?));
    let mut fitted = vec![false; face.mesh().len()];
    for &v in &analysis.samples.vertices {
        if let Some(fitted) = fitted.get_mut(v as usize) {
            *fitted = true;
        }
    }
    Fields {
        observed: reading.observed(),
        said: reading.values(&said),
        left: reading.values(&|v| Some(outcome.measured().0.get(v)? - said(v)?)),
        fitted,
    }
}
