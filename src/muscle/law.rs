//! One call for every muscle law: its kind, its shape parameters, its force and the slopes of the force.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::anatomical::{Anatomical, Lobe, Reading, Windows};
use super::fibre::{Fibre, Place};
use super::koch::Koch;
use super::parameter::{LawError, MAX_PARAMETERS, Parameter};
use super::waters_linear::{Direction, Sector, WatersLinear};
use super::waters_sheet::{Rectangle, WatersSheet};

/// The four laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawKind {
    /// Thesis (3.1)–(3.5).
    WatersLinear,
    /// Thesis (3.6)–(3.9).
    WatersSheet,
    /// Thesis (3.10)–(3.20).
    Koch,
    /// Thesis (5.1), (5.3)–(5.7).
    Anatomical,
}

impl LawKind {
    /// All, in the order of the thesis.
    pub const ALL: [Self; 4] = [Self::WatersLinear, Self::WatersSheet, Self::Koch, Self::Anatomical];

    /// Short name for files.
    pub fn name(self) -> &'static str {
        match self {
            Self::WatersLinear => "waters_linear",
            Self::WatersSheet => "waters_sheet",
            Self::Koch => "koch",
            Self::Anatomical => "anatomical",
        }
    }

    /// Name for people.
    pub const fn label(self) -> &'static str {
        match self {
            Self::WatersLinear => "Waters linear",
            Self::WatersSheet => "Waters sheet",
            Self::Koch => "Koch",
            Self::Anatomical => "Anatomical",
        }
    }
}

/// A muscle law with its shape parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum MuscleLaw {
    /// Waters' linear muscle.
    WatersLinear(WatersLinear),
    /// Waters' sheet muscle.
    WatersSheet(WatersSheet),
    /// Koch's muscle.
    Koch(Koch),
    /// The thesis's own.
    Anatomical(Anatomical),
}

impl MuscleLaw {
    /// The law with its default shape.
    pub fn default_of(kind: LawKind) -> Self {
        match kind {
            LawKind::WatersLinear => Self::WatersLinear(WatersLinear::default()),
            LawKind::WatersSheet => Self::WatersSheet(WatersSheet::default()),
            LawKind::Koch => Self::Koch(Koch::default()),
            LawKind::Anatomical => Self::Anatomical(Anatomical::default()),
        }
    }

    /// Which of the four.
    pub fn kind(&self) -> LawKind {
        match self {
            Self::WatersLinear(_) => LawKind::WatersLinear,
            Self::WatersSheet(_) => LawKind::WatersSheet,
            Self::Koch(_) => LawKind::Koch,
            Self::Anatomical(_) => LawKind::Anatomical,
        }
    }

    /// Name for people, with what sets this variant apart: "Anatomical (B), second lobe".
    pub fn label(&self) -> String {
        let label = self.kind().label();
        match self {
            Self::WatersLinear(WatersLinear { direction: Direction::Convergent, .. }) => format!("{label}, convergent"),
            Self::Anatomical(law) => {
                let raw = if law.raw { ", raw" } else { "" };
                let lobe = match law.lobe {
                    None => "",
                    Some(Lobe::AtAttachment) => ", second lobe",
                    Some(Lobe::At(_)) => ", second lobe anywhere",
                };
                format!("{label} ({}){raw}{lobe}", law.reading.letter())
            }
            _ => label.to_owned(),
        }
    }

    /// The ways in which the thesis's text can be taken that have the same parameters: both directions of Waters' linear muscle, both
    /// readings of (5.3).
    pub fn variants(&self) -> Vec<Self> {
        match self {
            Self::WatersLinear(law) => [Direction::Parallel, Direction::Convergent]
                .map(|direction| Self::WatersLinear(WatersLinear { direction, ..*law }))
                .to_vec(),
            Self::Anatomical(law) => {
                Reading::ALL.map(|reading| Self::Anatomical(Anatomical { reading, ..*law })).to_vec()
            }
            Self::WatersSheet(_) | Self::Koch(_) => vec![*self],
        }
    }

    /// The anatomical law with another second lobe, or none; `None` for laws that have no lobe.
    pub fn with_lobe(&self, lobe: Option<Lobe>) -> Option<Self> {
        match self {
            Self::Anatomical(law) => Some(Self::Anatomical(Anatomical { lobe, ..*law })),
            _ => None,
        }
    }

    /// Strengths that the force is linear in: 1, or 2 with a second lobe.
    pub fn lobes(&self) -> usize {
        match self {
            Self::Anatomical(Anatomical { lobe: Some(_), .. }) => 2,
            _ => 1,
        }
    }

    /// The shape parameters. The strength is none of them.
    pub fn parameters(&self) -> Vec<Parameter> {
        match self {
            Self::WatersLinear(law) => law.parameters(),
            Self::WatersSheet(law) => law.parameters(),
            Self::Koch(law) => law.parameters(),
            Self::Anatomical(law) => law.parameters(),
        }
    }

    /// The same law with other shape parameters, in the order of [`MuscleLaw::parameters`]; refuses what is out of range.
    pub fn with_parameters(&self, values: &[f64]) -> Result<Self, LawError> {
        let parameters = self.parameters();
        if values.len() != parameters.len() {
            let law = self.kind().label();
            return Err(LawError::Count { law, expected: parameters.len(), found: values.len() });
        }
        for (parameter, &value) in parameters.iter().zip(values) {
            if !(value >= parameter.low && value <= parameter.high) {
                let Parameter { name, low, high, .. } = *parameter;
                return Err(LawError::Range { name, value, low, high });
            }
        }
        Ok(self.at(values))
    }

    /// The same law with other shape parameters, which are trusted: as many as it has, in their ranges.
    pub(crate) fn at(&self, values: &[f64]) -> Self {
        match (*self, values) {
            (Self::WatersLinear(law), &[reach, zone]) => Self::WatersLinear(WatersLinear { reach, zone, ..law }),
            (Self::WatersSheet(_), &[n, delta, half_width]) => Self::WatersSheet(WatersSheet { n, delta, half_width }),
            (Self::Koch(_), &[k, width]) => Self::Koch(Koch { k, width }),
            (Self::Anatomical(law), &[sr, wr, sa, wa]) => Self::Anatomical(Anatomical { sr, wr, sa, wa, ..law }),
            (Self::Anatomical(law), &[sr, wr, sa, wa, distance]) => {
                Self::Anatomical(Anatomical { sr, wr, sa, wa, lobe: Some(Lobe::At(distance)), ..law })
            }
            (same, _) => same,
        }
    }

    /// What the law needs to be evaluated at many places of one fibre.
    pub fn on(&self, fibre: &Fibre) -> Shape {
        match self {
            Self::WatersLinear(law) => Shape::Sector(law.on(fibre)),
            Self::WatersSheet(law) => Shape::Rectangle(law.on()),
            Self::Koch(law) => Shape::Koch(*law),
            Self::Anatomical(law) => Shape::Windows(law.on()),
        }
    }

    /// Unit vector in which a point is pulled.
    pub fn direction(&self, fibre: &Fibre, x: &Point3<f64>) -> Vector3<f64> {
        match self {
            Self::WatersLinear(WatersLinear { direction: Direction::Convergent, .. }) => {
                (fibre.attachment - x).try_normalize(0.0).unwrap_or_else(|| fibre.pull())
            }
            _ => fibre.pull(),
        }
    }

    /// Force on a point for a strength of 1 N, in N: at the insertion its length is 1 for all but the raw anatomical law.
    pub fn force(&self, fibre: &Fibre, x: &Point3<f64>) -> Vector3<f64> {
        self.lobe_force(0, fibre, x)
    }

    /// Force on a point for a strength of 1 N of one lobe (0: the muscle itself, 1: the second lobe, zero where there is none).
    pub fn lobe_force(&self, lobe: usize, fibre: &Fibre, x: &Point3<f64>) -> Vector3<f64> {
        let mut by = [0.0; MAX_PARAMETERS];
        self.direction(fibre, x)
            * if lobe < self.lobes() { self.on(fibre).at(lobe, &fibre.place(x), &mut by) } else { 0.0 }
    }

    /// [`MuscleLaw::force`] and its slope along each shape parameter, which are written to `by` (as many as there are parameters).
    pub fn force_and_derivatives(&self, fibre: &Fibre, x: &Point3<f64>, by: &mut [Vector3<f64>]) -> Vector3<f64> {
        let mut slopes = [0.0; MAX_PARAMETERS];
        let value = self.on(fibre).at(0, &fibre.place(x), &mut slopes);
        let direction = self.direction(fibre, x);
        for (out, slope) in by.iter_mut().zip(slopes) {
            *out = direction * slope;
        }
        direction * value
    }
}

/// A law on one fibre, ready to be evaluated at many places.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Of Waters' linear muscle.
    Sector(Sector),
    /// Of Waters' sheet muscle.
    Rectangle(Rectangle),
    /// Of Koch's muscle.
    Koch(Koch),
    /// Of the anatomical muscle.
    Windows(Windows),
}

impl Shape {
    /// θ at a place, the share of the strength that acts there, and its slopes along the shape parameters. `lobe` is 0 for the
    /// muscle itself and 1 for a second lobe.
    #[inline]
    pub fn at(&self, lobe: usize, place: &Place, by: &mut [f64; MAX_PARAMETERS]) -> f64 {
        match self {
            Self::Sector(sector) => sector.at(place, by),
            Self::Rectangle(rectangle) => rectangle.at(place, by),
            Self::Koch(koch) => koch.at(place, by),
            Self::Windows(windows) if lobe == 0 => windows.at(place, by),
            Self::Windows(windows) => windows.lobe_at(place, by),
        }
    }
}
