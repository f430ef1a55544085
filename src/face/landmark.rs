//! Landmarks: the named vertices that an annotator finds again on a photograph.

use serde::{Deserialize, Serialize};

/// A named vertex by which a generic face is fitted to a person.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landmark {
    /// Short name for files, unique in a face: `brow_outer_left`. Left and right are the person's own.
    pub id: String,
    /// Name for people: "Outer end of the left brow".
    pub name: String,
    /// How to recognise the place on a photograph, one sentence.
    pub hint: String,
    /// The vertex that stands for it.
    pub vertex: u32,
    /// `id` of the landmark across the midline; absent on the midline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror: Option<String>,
    /// Number, from 1, of the same place in the 68-point markup of iBUG 300-W, which most detectors of faces use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_68: Option<u8>,
    /// Vertex, from 0, at the same place of the 468-vertex tracking mesh of MediaPipe.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_468: Option<u16>,
}
