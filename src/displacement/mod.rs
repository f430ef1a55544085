//! From marks to displacement: the depth of the points in the last frame, and what becomes of those that nobody marked.

use serde::{Deserialize, Serialize};

pub mod depth;
pub mod fill_in;
pub mod regularised;

/// How deep a point of the last frame lies on its ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthRule {
    /// As deep as in the first frame. Thesis (4.8).
    #[default]
    FixedDepth,
    /// Where the ray meets the first frame's surface: right where skin slides on a smooth skull.
    SlideOnSurface,
    /// Where the ray meets the level at which the point keeps its own height above a smooth surface through the first frame's face: right where
    /// skin of any thickness slides on a smooth skull.
    KeepHeight,
    /// Half of the way in depth from the first frame's to that of [`Self::KeepHeight`], never more than half as far as the point went aside:
    /// what lies between the truths that are known.
    HalfWay,
}

impl DepthRule {
    /// The rule that this one is held against: their difference is what one camera cannot see.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::FixedDepth => Self::SlideOnSurface,
            Self::SlideOnSurface | Self::KeepHeight | Self::HalfWay => Self::FixedDepth,
        }
    }

    /// All, the default first.
    pub const ALL: [Self; 4] = [Self::FixedDepth, Self::SlideOnSurface, Self::KeepHeight, Self::HalfWay];

    /// The word used in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::FixedDepth => "fixed_depth",
            Self::SlideOnSurface => "slide_on_surface",
            Self::KeepHeight => "keep_height",
            Self::HalfWay => "half_way",
        }
    }

    /// Whether it asks for heights above a smooth surface.
    pub fn asks_for_heights(self) -> bool {
        matches!(self, Self::KeepHeight | Self::HalfWay)
    }
}

/// What becomes of vertices that nobody marked in the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "rule", rename_all = "snake_case", deny_unknown_fields)]
pub enum UnmarkedRule {
    /// Those surrounded by marks are filled in by a harmonic solve; the others are unmeasured and carry no force.
    Inferred {
        /// How far a mark may lie to count as surrounding, mm.
        reach_mm: f64,
    },
    /// They stay where they were, as in the thesis; the border of the marked skin then carries false forces (E23).
    Held,
}

impl Default for UnmarkedRule {
    /// 15 mm: under two edges of the generic face, so that marks on every other vertex surround the one between, and skin
    /// across a fold (the lid between brow and eye) is not taken for skin between marks.
    fn default() -> Self {
        Self::Inferred { reach_mm: 15.0 }
    }
}

/// What is known of a vertex in the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VertexState {
    /// Marked by a hand.
    Measured,
    /// Surrounded by marks and filled in from them.
    Inferred,
    /// Held in its place on the head, by the annotator or by [`UnmarkedRule::Held`].
    Fixed,
    /// Nothing is known: no force.
    #[default]
    Unmeasured,
}

impl VertexState {
    /// Whether the vertex has a place in the last frame.
    pub fn is_known(self) -> bool {
        self != Self::Unmeasured
    }

    /// The word used in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Inferred => "inferred",
            Self::Fixed => "fixed",
            Self::Unmeasured => "unmeasured",
        }
    }
}
