//! A shape parameter of a muscle law: its name, its value and where it may lie.

use serde::Serialize;

/// The largest number of shape parameters that any law has.
pub const MAX_PARAMETERS: usize = 5;

/// One shape parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Short name for files: `sr`.
    pub name: &'static str,
    /// What it is, for people.
    pub label: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Least value accepted.
    pub low: f64,
    /// Largest value accepted.
    pub high: f64,
    /// Where its logarithmic scale begins: fits move `ln(value − origin)`, which keeps `value > origin`.
    pub origin: f64,
    /// Whether force has a slope along it. The sharp side of a zone has none: a fit tries values instead.
    pub smooth: bool,
}

/// The parts of a [`Parameter`] that do not change with the law's value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    pub(crate) name: &'static str,
    pub(crate) label: &'static str,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) origin: f64,
    pub(crate) smooth: bool,
}

impl Scale {
    pub(crate) const fn positive(name: &'static str, label: &'static str, low: f64, high: f64) -> Self {
        Self { name, label, low, high, origin: 0.0, smooth: true }
    }

    /// A number that must be greater than 1.
    pub(crate) const fn above_one(name: &'static str, label: &'static str, high: f64) -> Self {
        Self { name, label, low: 1.01, high, origin: 1.0, smooth: true }
    }

    pub(crate) const fn sharp(self) -> Self {
        Self { smooth: false, ..self }
    }

    pub(crate) const fn at(self, value: f64) -> Parameter {
        let Self { name, label, low, high, origin, smooth } = self;
        Parameter { name, label, unit: "", value, low, high, origin, smooth }
    }
}

/// Why shape parameters were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LawError {
    /// Not as many numbers as the law has parameters.
    #[error("{law} has {expected} shape parameters, not {found}")]
    Count {
        /// The law.
        law: &'static str,
        /// How many it has.
        expected: usize,
        /// How many were given.
        found: usize,
    },
    /// A number outside its range, or none at all.
    #[error("{name} = {value} is outside {low} to {high}")]
    Range {
        /// The parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// Least value accepted.
        low: f64,
        /// Largest value accepted.
        high: f64,
    },
}
