//! Meshes whose vertices have published numbers: which of them are landmarks.

use crate::face::Landmark;

/// A published numbering of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbering {
    /// The 468-vertex tracking mesh of MediaPipe: each landmark of the generic face holds its number there.
    Tracking468,
    /// CANDIDE-3 with its 113 vertices.
    Candide3,
}

impl Numbering {
    /// The vertex of a landmark, from 0, where the numbering has it.
    pub fn number(self, landmark: &Landmark) -> Option<u32> {
        match self {
            // Its forehead ends below the hair: the vertex on its upper rim is another place.
            Self::Tracking468 if landmark.id == "forehead_top" => None,
            Self::Tracking468 => landmark.in_468.map(u32::from),
            Self::Candide3 => CANDIDE3.iter().find(|(id, _)| *id == landmark.id).map(|(_, v)| *v),
        }
    }
}

/// Source: Ahlberg, "CANDIDE-3, an updated parameterised face", Linköping 2001, appendix: the vertices by name. Places that CANDIDE-3
/// has not (the contour of the face is another one) are left out.
const CANDIDE3: [(&str, u32); 25] = [
    ("eye_inner_left", 23),
    ("eye_inner_right", 56),
    ("eye_outer_left", 20),
    ("eye_outer_right", 53),
    ("eye_top_left", 21),
    ("eye_top_right", 54),
    ("eye_bottom_left", 22),
    ("eye_bottom_right", 55),
    ("brow_inner_left", 17),
    ("brow_inner_right", 50),
    ("brow_mid_left", 16),
    ("brow_mid_right", 49),
    ("brow_outer_left", 15),
    ("brow_outer_right", 48),
    ("nose_saddle", 94),
    ("nose_tip", 5),
    ("nose_wing_left", 26),
    ("nose_wing_right", 59),
    ("subnasale", 6),
    ("mouth_corner_left", 31),
    ("mouth_corner_right", 64),
    ("upper_lip", 7),
    ("upper_lip_inner", 87),
    ("lower_lip", 8),
    ("chin", 10),
];
