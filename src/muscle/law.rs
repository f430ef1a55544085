//! One call for every muscle law: its kind, its shape parameters, its force and the slopes of the force.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use super::anatomical::{Anatomical, Lobe, Reading, SecondLobe, Windows};
use super::fibre::{Fibre, Place};
use super::koch::{Bell, Koch};
use super::parameter::{LawError, MAX_PARAMETERS, Parameter};
use super::waters_linear::{Direction, Sector, WatersLinear};
use super::waters_sheet::{Rectangle, WatersSheet};
use super::wide::{LANES, Spread, fill, fill_points};

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
            Self::Koch(law) => Shape::Bell(law.on()),
            Self::Anatomical(law) => Shape::Windows(law.on()),
        }
    }

    /// What of a place beside a fibre the law depends on: two numbers, whatever its shape parameters.
    pub(crate) fn coordinates(&self, place: &Place) -> [f64; 2] {
        match self {
            Self::WatersLinear(_) => Sector::coordinates(place),
            Self::WatersSheet(_) => Rectangle::coordinates(place),
            Self::Koch(_) => Bell::coordinates(place),
            Self::Anatomical(_) => Windows::coordinates(place),
        }
    }

    /// Force on many points for a strength of 1 N, in N: [`MuscleLaw::force`] of each.
    pub(crate) fn forces(&self, fibre: &Fibre, points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        let mut theta = vec![0.0; points.len().next_multiple_of(LANES)];
        Arch::new().dispatch(Shares { law: self, fibre, points, theta: &mut theta });
        let force = |(x, share): (&Point3<f64>, &f64)| {
            if *share == 0.0 { Vector3::zeros() } else { self.direction(fibre, x) * *share }
        };
        points.iter().zip(&theta).map(force).collect()
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

/// θ at many points.
struct Shares<'a> {
    law: &'a MuscleLaw,
    fibre: &'a Fibre,
    points: &'a [Point3<f64>],
    theta: &'a mut [f64],
}

impl WithSimd for Shares<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { law, fibre, points, theta } = self;
        match law.on(fibre) {
            Shape::Sector(sector) => fill_points(sector, fibre, points, theta),
            Shape::Rectangle(rectangle) => fill_points(rectangle, fibre, points, theta),
            Shape::Bell(bell) => fill_points(bell, fibre, points, theta),
            Shape::Windows(windows) => fill_points(windows, fibre, points, theta),
        }
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
    Bell(Bell),
    /// Of the anatomical muscle.
    Windows(Windows),
}

impl Shape {
    /// θ at a place, the share of the strength that acts there, and its slopes along the shape parameters. `lobe` is 0 for the
    /// muscle itself and 1 for a second lobe.
    pub fn at(&self, lobe: usize, place: &Place, by: &mut [f64; MAX_PARAMETERS]) -> f64 {
        let (value, slopes) = match self {
            Self::Sector(sector) => sector.at(Sector::coordinates(place)),
            Self::Rectangle(rectangle) => rectangle.at(Rectangle::coordinates(place)),
            Self::Bell(bell) => bell.at(Bell::coordinates(place)),
            Self::Windows(windows) if lobe == 0 => windows.at(Windows::coordinates(place)),
            Self::Windows(windows) => SecondLobe(*windows).at(Windows::coordinates(place)),
        };
        *by = slopes;
        value
    }

    /// The same at many places, a multiple of [`LANES`], known by their [`MuscleLaw::coordinates`]: all places' slopes
    /// along the first parameter, then along the next.
    #[inline(always)]
    pub(crate) fn over(&self, lobe: usize, coordinates: [&[f64]; 2], theta: &mut [f64], slopes: &mut [f64]) {
        match self {
            Self::Sector(sector) => fill(*sector, coordinates, theta, slopes),
            Self::Rectangle(rectangle) => fill(*rectangle, coordinates, theta, slopes),
            Self::Bell(bell) => fill(*bell, coordinates, theta, slopes),
            Self::Windows(windows) if lobe == 0 => fill(*windows, coordinates, theta, slopes),
            Self::Windows(windows) => fill(SecondLobe(*windows), coordinates, theta, slopes),
        }
    }
}
