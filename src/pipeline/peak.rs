//! The largest force: one rule for the window, the picture, the report and the command line.
//!
//! The largest of a thousand uncertain numbers is the one with the luckiest error. So the largest force is sought among those that
//! stand above their error, and where none does, that is the finding.

use super::Outcome;
use crate::displacement::VertexState;
use crate::draw::numbers::{significant, with_error};

/// So many standard errors a force must be long to stand above its error: below, it cannot be told from the noise of marking.
pub const STANDS_ABOVE: f64 = 2.0;

/// What there is to say of the largest force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Peak {
    /// No vertex is measured.
    Unmeasured,
    /// No force stands above [`STANDS_ABOVE`] times its standard error.
    Noise {
        /// Median of |F| / standard error.
        median: f64,
    },
    /// The largest of those that do.
    Stands {
        /// Where.
        vertex: usize,
        /// Its length, N or relative.
        force: f64,
        /// Its standard error.
        sigma: f64,
    },
}

impl Peak {
    /// The vertex, where there is one.
    pub fn vertex(self) -> Option<usize> {
        if let Self::Stands { vertex, .. } = self { Some(vertex) } else { None }
    }

    /// The force there.
    pub fn force(self) -> Option<f64> {
        if let Self::Stands { force, .. } = self { Some(force) } else { None }
    }

    /// The finding as a sentence without its end: "largest force 0.18 ± 0.02 N at vertex 12".
    pub fn in_words(self, unit: &str) -> String {
        match self {
            Self::Unmeasured => "no vertex is measured".to_owned(),
            Self::Noise { median } => {
                format!(
                    "no force stands above twice its error; the median force is {} times its error",
                    significant(median, 2)
                )
            }
            Self::Stands { vertex, force, sigma } => {
                format!("largest force {} {unit} at vertex {vertex}", with_error(force, Some(sigma)))
            }
        }
    }
}

impl Outcome {
    /// Whether the force on a vertex can be believed: a hand has measured it; it is not on the border, which carries the reaction
    /// of skin that nobody measured; and the skin around it is not strained beyond its table.
    pub fn is_believed(&self, vertex: usize) -> bool {
        self.states.get(vertex) == Some(&VertexState::Measured)
            && !self.border.get(vertex).copied().unwrap_or(false)
            && !self.field.outside_table.get(vertex).copied().unwrap_or(false)
    }

    /// The vertices that speak for the field: those that can be believed ([`Outcome::is_believed`]), or, where there are none, all
    /// measured and inferred ones. They alone give the largest force and the medians.
    pub fn speaks(&self) -> Vec<bool> {
        let believed: Vec<bool> = (0..self.states.len()).map(|v| self.is_believed(v)).collect();
        if believed.contains(&true) {
            return believed;
        }
        self.states.iter().map(|s| matches!(s, VertexState::Measured | VertexState::Inferred)).collect()
    }

    /// The vertices that may set the range of colours: those that speak and are measured, or, where there are none, all that speak. What is
    /// inferred lies where its neighbours leave it nearly without force: the thousands of a fine mesh would hide the measured forces.
    pub fn sets_range(&self) -> Vec<bool> {
        let speaks = self.speaks();
        let measured = |v: usize| self.states[v] == VertexState::Measured;
        let both: Vec<bool> = speaks.iter().enumerate().map(|(v, s)| *s && measured(v)).collect();
        if both.contains(&true) { both } else { speaks }
    }

    /// Whether the force on a vertex is more than [`STANDS_ABOVE`] times its standard error.
    pub fn stands_above_error(&self, vertex: usize) -> bool {
        let (force, sigma) = (self.field.force.get(vertex), self.field.sigma.get(vertex));
        force.zip(sigma).is_some_and(|(f, s)| f.norm() > STANDS_ABOVE * s)
    }

    fn speaking(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let forces = self.field.force.iter().zip(&self.field.sigma).enumerate();
        let speaks = self.speaks();
        forces.filter(move |(v, _)| speaks.get(*v) == Some(&true)).map(|(v, (f, s))| (v, f.norm(), *s))
    }

    /// The largest force that stands above its error.
    pub fn peak(&self) -> Peak {
        let standing = self.speaking().filter(|(v, ..)| self.stands_above_error(*v));
        match (standing.max_by(|a, b| a.1.total_cmp(&b.1)), self.median_over_error()) {
            (Some((vertex, force, sigma)), _) => Peak::Stands { vertex, force, sigma },
            (None, Some(median)) => Peak::Noise { median },
            (None, None) => Peak::Unmeasured,
        }
    }

    /// Median of |F| / standard error over the vertices that speak for the field; absent where none does, zero where nothing moved
    /// and no error is stated.
    pub fn median_over_error(&self) -> Option<f64> {
        let ratio = |(_, force, sigma): (usize, f64, f64)| if force > 0.0 { force / sigma } else { 0.0 };
        let mut ratios: Vec<f64> = self.speaking().map(ratio).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).copied()
    }

    /// The vertex to look at first: that of the largest force, or, where none stands above its error, of the largest that speaks for
    /// the field all the same.
    pub fn vertex_to_look_at(&self) -> Option<usize> {
        let largest = || self.speaking().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(v, ..)| v);
        self.peak().vertex().or_else(largest)
    }
}
