//! Several subjects on one face: mean, spread and difference of their forces, vertex by vertex.
//!
//! Subjects fitted with the same face model share its topology, so that vertex 205 is the same place of skin on each of them. Their forces
//! are compared there, as signed components along each one's own fibres or as lengths; no face is warped onto another for it.

use super::analysis::Question;
use super::fields::Reading;
use super::profiles::Part;
use super::subjects::Seen;
use crate::face::Mesh;

/// Forces of several subjects, put together vertex by vertex, N or relative.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Maps {
    /// What is known of each subject: absent where its own force does not count.
    pub values: Vec<Vec<Option<f64>>>,
    /// Mean, x̄ = Σ x / n, where all n know the vertex.
    pub mean: Vec<Option<f64>>,
    /// Standard deviation, √(Σ (x − x̄)² / (n − 1)), where all n know the vertex.
    pub spread: Vec<Option<f64>>,
}

/// Fields that cannot be put together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MapsError {
    /// One subject or none.
    #[error("there is no other subject to compare with")]
    Alone,
    /// Another mesh.
    #[error("the face of {name} is another one: only subjects on the same face model can be compared vertex by vertex")]
    Topology {
        /// Whose.
        name: String,
    },
    /// Newtons beside forces without a scale.
    #[error(
        "the forces of {relative} are relative, those of {measured} are in N, and the two are not mixed: set a scale for {relative}, or leave it out"
    )]
    Scale {
        /// A subject without a measured scale.
        relative: String,
        /// One with it.
        measured: String,
    },
}

/// Whether vertices with the same number are the same place of skin on both.
pub fn same_topology(a: &Mesh, b: &Mesh) -> bool {
    a.len() == b.len() && a.triangles() == b.triangles()
}

/// Puts the forces of subjects together, as the question reads them: its part of the force, at the vertices that count.
///
/// # Errors
/// Fewer than two subjects, another mesh, forces of which only some have a measured scale.
pub fn of_subjects(subjects: &[Seen<'_>], question: &Question, part: Part) -> Result<Maps, MapsError> {
    let [first, others @ ..] = subjects else { return Err(MapsError::Alone) };
    if others.is_empty() {
        return Err(MapsError::Alone);
    }
    if let Some(other) = others.iter().find(|o| !same_topology(first.face.mesh(), o.face.mesh())) {
        return Err(MapsError::Topology { name: other.name.to_owned() });
    }
    if let Some(other) = others.iter().find(|o| o.outcome.scale_measured != first.outcome.scale_measured) {
        let (measured, relative) = if first.outcome.scale_measured { (first, other) } else { (other, first) };
        return Err(MapsError::Scale { relative: relative.name.to_owned(), measured: measured.name.to_owned() });
    }
    Ok(Maps::of(subjects.iter().map(|s| counted(s, question, part)).collect()))
}

/// What was observed at the vertices that count.
fn counted(subject: &Seen<'_>, question: &Question, part: Part) -> Vec<Option<f64>> {
    let reading = Reading::new(subject.outcome, subject.face, question.compare, part);
    let observed = reading.observed().into_iter().enumerate();
    observed.map(|(v, x)| x.filter(|_| question.include.takes(subject.outcome, v))).collect()
}

impl Maps {
    /// Puts lists of the same length together.
    fn of(values: Vec<Vec<Option<f64>>>) -> Self {
        let (mut mean, mut spread) = (Vec::new(), Vec::new());
        for v in 0..values.first().map_or(0, Vec::len) {
            let here: Option<Vec<f64>> = values.iter().map(|of| of.get(v).copied().flatten()).collect();
            let n = values.len() as f64;
            let middle = here.as_ref().map(|all| all.iter().sum::<f64>() / n);
            mean.push(middle);
            spread.push(here.zip(middle).filter(|_| n > 1.0).map(|(all, middle)| {
                let squares: f64 = all.iter().map(|x| (x - middle) * (x - middle)).sum();
                (squares / (n - 1.0)).sqrt()
            }));
        }
        Self { values, mean, spread }
    }

    /// The first subject less another one (1 is the second), where all know the vertex.
    pub fn difference(&self, other: usize) -> Vec<Option<f64>> {
        let pair = self.values.first().zip(self.values.get(other));
        let value = |v: usize| {
            let (first, other) = pair?;
            self.mean[v]?;
            Some(first[v]? - other[v]?)
        };
        (0..self.mean.len()).map(value).collect()
    }

    /// Number of vertices that all subjects know.
    pub fn shared(&self) -> usize {
        self.mean.iter().flatten().count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_spread_and_difference_are_those_of_vertices_that_all_know() {
        // Vertex 0: 1, 3, 5: mean 3, sd √((4 + 0 + 4)/2) = 2, first less third −4. Vertex 1 and 2: not all know it. Vertex 3: −2, 4, 1: mean 1,
        // sd √((9 + 9 + 0)/2) = 3, first less third −3.
        let m = Maps::of(vec![
            vec![Some(1.0), None, Some(2.0), Some(-2.0)],
            vec![Some(3.0), Some(7.0), None, Some(4.0)],
            vec![Some(5.0), Some(8.0), Some(4.0), Some(1.0)],
        ]);
        assert_eq!(m.mean, [Some(3.0), None, None, Some(1.0)]);
        assert_eq!(m.spread, [Some(2.0), None, None, Some(3.0)]);
        assert_eq!(m.difference(2), [Some(-4.0), None, None, Some(-3.0)]);
        assert_eq!(m.difference(3), [None; 4], "there is no fourth subject");
        assert_eq!(m.shared(), 2);
    }

    #[test]
    fn one_subject_has_no_spread() {
        assert_eq!(Maps::of(vec![vec![Some(1.0)]]).spread, [None]);
        assert_eq!(Maps::of(Vec::new()), Maps::default());
    }
}
