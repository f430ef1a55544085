//! Muscles as a face model holds them: a fibre from a vertex on the bone to a vertex in the skin.

use serde::{Deserialize, Serialize};

/// The side of the person's own body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The person's left: x > 0, right in an unmirrored picture.
    Left,
    /// The person's right: x < 0.
    Right,
}

/// One muscle. Thesis (3.1): its fibre is `m = attachment − insertion`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Muscle {
    /// Short name for files, unique in a face: `frontalis_medial_left`.
    pub id: String,
    /// Latin name: "Musculus frontalis, pars medialis".
    pub latin: String,
    /// FACS action unit that it produces.
    pub action_unit: u8,
    /// Side of the body.
    pub side: Side,
    /// Vertex at the fixed (bone) end.
    pub attachment: u32,
    /// Vertex at the moving (skin) end.
    pub insertion: u32,
    /// Half the width of the band of fibres, mm.
    pub half_width_mm: f64,
    /// For a muscle of convergent fibres: half the angle of the zone about the fibre, as seen from the attachment, in which it
    /// pulls, degrees; above 0, below 90 (Waters 1987).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone_half_angle_deg: Option<f64>,
}

/// Another choice of muscles for the same face.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MusclePreset {
    /// Short name, unique in a face: `waters`.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// The muscles.
    pub muscles: Vec<Muscle>,
}
