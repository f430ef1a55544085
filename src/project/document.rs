//! The project: everything an annotator has said about one pair of frames, and nothing that can be computed from it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::camera::Scale;
use crate::customize::CustomizeSettings;
use crate::displacement::regularised::WeightRule;
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::forces::{SkinModel, SkinSpec, SpringRule};
use crate::muscle::LawKind;
use crate::skin::StressStrainCurve;

/// A pair of frames, the marks on them and the settings of the chain. Small, holds no pixels; changed by `Edit` alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Project {
    /// Name for people.
    pub name: String,
    /// The two frames, by path and hash.
    pub frames: FramePair,
    /// Which face is fitted.
    #[serde(default)]
    pub face: FaceSource,
    /// Where the camera stood.
    #[serde(default)]
    pub camera: CameraSettings,
    /// How large a pixel is.
    #[serde(default)]
    pub scale: Scale,
    /// Marks of the landmarks in the first frame, by landmark `id`.
    #[serde(default)]
    pub landmarks: BTreeMap<String, Mark>,
    /// Feature points, by vertex.
    #[serde(default)]
    pub features: BTreeMap<u32, Feature>,
    /// Second, blind marks of feature points in the last frame, by vertex, px: they tell the hand's own error and are data of nothing else.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub repeats: BTreeMap<u32, [f64; 2]>,
    /// Choices for the stages of the chain.
    #[serde(default)]
    pub settings: Settings,
    /// Free text of the annotator.
    #[serde(default)]
    pub notes: String,
}

/// The first (neutral) and the last (apex) frame of the expression.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramePair {
    /// Neutral face.
    pub first: Option<FrameRef>,
    /// Face at the height of the expression.
    pub last: Option<FrameRef>,
}

/// A picture on disk, and what it must be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRef {
    /// Path, relative to the project file where that is possible; `/` between folders on every system.
    pub path: String,
    /// SHA-256 of the file's bytes, 64 hexadecimal digits.
    pub sha256: String,
    /// Width after orientation, px.
    pub width_px: u32,
    /// Height after orientation, px.
    pub height_px: u32,
}

/// Where the face model comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum FaceSource {
    /// The embedded generic face.
    #[default]
    Generic,
    /// A face model file.
    File {
        /// Path, as in [`FrameRef`].
        path: String,
        /// SHA-256 of the file's bytes.
        sha256: String,
    },
}

/// Position of the camera. Thesis (4.7).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Distance from the view plane to the projection reference point, mm (z_prp − z_vp).
    ///
    /// Default 1000: an arm's length and a half, usual for a portrait; the thesis does not print its own.
    pub distance_mm: f64,
    /// z of the view plane, mm. Default 0: through the inner eye corners of the generic face.
    #[serde(default)]
    pub view_plane_z_mm: f64,
    /// Where the optical axis meets the first frame, px; absent = the centre of the picture.
    #[serde(default)]
    pub principal_point_px: Option<[f64; 2]>,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self { distance_mm: 1000.0, view_plane_z_mm: 0.0, principal_point_px: None }
    }
}

/// A position that a hand has put on a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mark {
    /// Position, px.
    pub at_px: [f64; 2],
    /// What the annotator says of it.
    #[serde(default)]
    pub state: MarkState,
    /// Standard deviation of this mark along each axis, px; absent = the project's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_px: Option<f64>,
}

impl Mark {
    /// A plain mark.
    pub fn new(at_px: [f64; 2]) -> Self {
        Self { at_px, state: MarkState::Marked, sigma_px: None }
    }
}

/// What the annotator says of a mark. `unset` is the absence of one; `predicted` is computed and never stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MarkState {
    /// Placed and believed.
    #[default]
    Marked,
    /// Placed in doubt: counts, with a larger standard deviation ([`UNCERTAIN_FACTOR`]).
    Uncertain,
    /// Not visible in this frame: the position is a note, never data.
    Occluded,
    /// Placed and protected against the hand.
    Locked,
}

impl MarkState {
    /// Whether the position counts as a measurement.
    pub fn is_data(self) -> bool {
        self != Self::Occluded
    }
}

/// How many times the standard deviation of an uncertain mark is that of a plain one.
pub const UNCERTAIN_FACTOR: f64 = 3.0;

/// A vertex that is followed from the first frame to the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Where the skin point lies in the first frame, if the hand has moved it from the wireframe's own projection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<Mark>,
    /// Where the skin went in the last frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<Mark>,
    /// What kind of skin it is.
    #[serde(default)]
    pub role: Role,
}

/// What kind of skin a vertex is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Skin that the expression may move.
    #[default]
    Skin,
    /// Skin that this expression cannot move: gives the head's motion and the noise floor.
    Still,
    /// Held at its place on the head by the annotator's decision, marked or not.
    Fixed,
}

/// How the field of forces is found from the marks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "way", rename_all = "snake_case", deny_unknown_fields)]
pub enum FieldWay {
    /// F = −K X at the marks as they are. Thesis (4.5).
    #[default]
    Direct,
    /// F = −K X at the smoothest motion of the skin that the marks allow within their error.
    Regularised {
        /// How smooth that is.
        #[serde(default)]
        weight: WeightRule,
    },
    /// The forces of the muscles under which the skin comes to rest nearest to the points.
    Muscles(MuscleWay),
}

/// How muscles are asked for the field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MuscleWay {
    /// How smooth the motion of the skin is from which the measured forces are found, which fits go on being made from.
    pub weight: WeightRule,
    /// How a muscle pulls on the skin around its fibre; absent: by the law of the four that leaves the points nearest.
    pub law: Option<LawKind>,
    /// At most so many muscles, the smallest set that explains the motion; all that pull where absent.
    pub most: Option<u8>,
    /// Whether nothing pulls but the muscles; otherwise what they leave is taken for smooth pulls besides them, as far as the points ask.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub alone: bool,
    /// Whether the law's shape is found with the muscles, one for all; otherwise it is the law's usual one.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub shape: bool,
}

impl FieldWay {
    /// All, each with its own defaults, the thesis's first.
    pub const ALL: [Self; 3] = [
        Self::Direct,
        Self::Regularised { weight: WeightRule::Discrepancy },
        Self::Muscles(MuscleWay { weight: WeightRule::Discrepancy, law: None, most: None, alone: false, shape: false }),
    ];

    /// Whether it is the thesis's.
    pub fn is_direct(&self) -> bool {
        *self == Self::Direct
    }

    /// Word of files and the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Regularised { .. } => "regularised",
            Self::Muscles(_) => "muscles",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Direct => "Direct",
            Self::Regularised { .. } => "Regularised",
            Self::Muscles(_) => "Muscles",
        }
    }

    /// How smooth it makes the motion of the skin; absent where it does not.
    pub fn weight(self) -> Option<WeightRule> {
        match self {
            Self::Direct => None,
            Self::Regularised { weight } | Self::Muscles(MuscleWay { weight, .. }) => Some(weight),
        }
    }

    /// The way to the forces that are measured, on which this one goes on: smoothed ones behind muscles, else itself.
    #[must_use]
    pub fn measured(self) -> Self {
        match self {
            Self::Muscles(MuscleWay { weight, .. }) => Self::Regularised { weight },
            other => other,
        }
    }

    /// The same way with another smoothness, where it has one.
    #[must_use]
    pub fn with_weight(self, weight: WeightRule) -> Self {
        match self {
            Self::Direct => Self::Direct,
            Self::Regularised { .. } => Self::Regularised { weight },
            Self::Muscles(way) => Self::Muscles(MuscleWay { weight, ..way }),
        }
    }

    /// What it means, in a sentence.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Direct => {
                "F = −K X at the marks as they are (thesis): exact for exact marks, and it magnifies their error most"
            }
            Self::Regularised { .. } => {
                "F = −K X at the smoothest motion of the skin that the marks allow within their stated error"
            }
            Self::Muscles(_) => {
                "The forces of the muscles under which the skin comes to rest nearest to the points: by far the nearest where muscles of this law moved it, and wrong where they did not, which the distance left tells"
            }
        }
    }
}

/// Choices for the stages of the chain; every one has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Fitting the generic face to the landmarks.
    pub customize: CustomizeSettings,
    /// Depth of the points in the last frame.
    pub depth: DepthRule,
    /// What becomes of vertices that nobody marked.
    pub unmarked: UnmarkedRule,
    /// How forces are found from the marks; not written where it is the thesis's way, so that a project without another stays as it was.
    #[serde(skip_serializing_if = "FieldWay::is_direct")]
    pub field: FieldWay,
    /// The skin's stress–strain curve.
    pub skin: StressStrainCurve,
    /// Thickness of the skin, mm. Default 1.5, from the histology and ultrasound of facial skin (total 1.2–2.0 mm).
    pub skin_thickness_mm: f64,
    /// What resists between the points; not written where it is the thesis's springs.
    #[serde(skip_serializing_if = "SkinModel::is_springs")]
    pub skin_model: SkinModel,
    /// How an edge becomes a spring.
    pub springs: SpringRule,
    /// Standard deviation of a plain mark along each axis, px. Default 1: two people on a painted grid agree to 1–2 px.
    pub marking_sigma_px: f64,
    /// Whether the motion of the still points is removed (where there are at least three).
    pub remove_head_motion: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            customize: CustomizeSettings::default(),
            depth: DepthRule::default(),
            unmarked: UnmarkedRule::default(),
            field: FieldWay::default(),
            skin: StressStrainCurve::default(),
            skin_thickness_mm: 1.5,
            skin_model: SkinModel::default(),
            springs: SpringRule::default(),
            marking_sigma_px: 1.0,
            remove_head_motion: true,
        }
    }
}

impl Settings {
    /// The skin, as the chain takes it.
    pub fn skin_spec(&self) -> SkinSpec {
        SkinSpec {
            model: self.skin_model,
            rule: self.springs,
            thickness_mm: self.skin_thickness_mm,
            curve: self.skin.clone(),
        }
    }
}

impl Project {
    /// Standard deviation of a mark along each axis, px: its own or the project's, larger where it is uncertain.
    pub fn sigma_px(&self, mark: &Mark) -> f64 {
        let sigma = mark.sigma_px.unwrap_or(self.settings.marking_sigma_px);
        if mark.state == MarkState::Uncertain { sigma * UNCERTAIN_FACTOR } else { sigma }
    }

    /// Number of feature points with a mark that counts in the last frame.
    pub fn measured_count(&self) -> usize {
        self.features.values().filter(|f| f.last.is_some_and(|m| m.state.is_data())).count()
    }
}
