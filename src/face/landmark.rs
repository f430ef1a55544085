//! Landmarks: the named vertices that an annotator finds again on a photograph.

use serde::{Deserialize, Serialize};

/// A named vertex by which a generic face is fitted to a person.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
}
