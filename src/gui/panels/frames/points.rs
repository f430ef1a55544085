//! The points that a pane shows: where they are, what is known of them, and what they are called.

use std::collections::BTreeSet;

use super::Tool;
use crate::face::Region;
use crate::gui::suggesting::ON_CROSSING_PX;
use crate::gui::{Scene, suggesting};
use crate::project::edit::Accepted;
use crate::project::{MarkState, PointId, Role, Which};
use crate::suggest::{GridCrossing, Source, Suggestion};

/// Id of the region whose vertices are still points.
pub const STILL_REGION: &str = "still";

/// What is known of a point. Told apart by shape as well as by colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Look {
    /// No mark, and nothing to predict it from.
    Unset,
    /// No mark; the place is computed. Never data.
    Predicted,
    /// No mark; the skin was looked for in the picture. Never data until accepted.
    Suggested,
    /// Marked.
    Marked,
    /// Marked in doubt.
    Uncertain,
    /// Not visible.
    Occluded,
    /// Marked and protected.
    Locked,
}

impl Look {
    /// All of them, for the legend.
    pub const ALL: [Self; 7] =
        [Self::Unset, Self::Predicted, Self::Suggested, Self::Marked, Self::Uncertain, Self::Occluded, Self::Locked];

    /// "marked".
    pub fn word(self) -> &'static str {
        match self {
            Self::Unset => "unset",
            Self::Predicted => "predicted",
            Self::Suggested => "suggested",
            Self::Marked => "marked",
            Self::Uncertain => "uncertain",
            Self::Occluded => "occluded",
            Self::Locked => "locked",
        }
    }

    fn of(state: MarkState) -> Self {
        match state {
            MarkState::Marked => Self::Marked,
            MarkState::Uncertain => Self::Uncertain,
            MarkState::Occluded => Self::Occluded,
            MarkState::Locked => Self::Locked,
        }
    }

    /// Whether a hand has put it there.
    pub fn is_mark(self) -> bool {
        self >= Self::Marked
    }
}

/// What kind of point it is; the colour tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A landmark.
    Landmark,
    /// A feature point of ordinary skin.
    Feature,
    /// A still point.
    Still,
    /// A fixed point.
    Fixed,
}

impl Kind {
    /// "landmark".
    pub fn word(self) -> &'static str {
        match self {
            Self::Landmark => "landmark",
            Self::Feature => "point",
            Self::Still => "still point",
            Self::Fixed => "fixed point",
        }
    }
}

/// A point of a pane.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownPoint {
    /// Which point.
    pub id: PointId,
    /// Its vertex.
    pub vertex: u32,
    /// Where it is, px: the mark, or the predicted place.
    pub at: [f64; 2],
    /// What is known of it.
    pub look: Look,
    /// What kind it is.
    pub kind: Kind,
    /// Short name, as files have it.
    pub label: String,
    /// Name for people, drawn beside it.
    pub name: String,
    /// How sure a suggested place is, 0 to 1.
    pub sure: f64,
}

impl ShownPoint {
    /// The name beside it; of a suggestion also how sure it is.
    pub fn title(&self) -> String {
        if self.look == Look::Suggested { format!("{}  {}", self.name, percent(self.sure)) } else { self.name.clone() }
    }

    /// Name for screen readers and tests: "landmark nose_tip, first frame, marked".
    pub fn spoken(&self, which: Which) -> String {
        let sure = if self.look == Look::Suggested { format!(", {}", percent(self.sure)) } else { String::new() };
        format!("{} {}, {} frame, {}{sure}", self.kind.word(), self.label, which.word(), self.look.word())
    }
}

/// What kind of point a feature vertex is: as the project says, or as the regions propose while it is untouched.
pub fn kind_of(scene: Scene<'_>, vertex: u32) -> Kind {
    match scene.project.features.get(&vertex) {
        Some(f) => match f.role {
            Role::Skin => Kind::Feature,
            Role::Still => Kind::Still,
            Role::Fixed => Kind::Fixed,
        },
        None if scene.face.region(STILL_REGION).contains(&vertex) => Kind::Still,
        None => Kind::Feature,
    }
}

/// The crossing of the painted grid that a vertex is on: in the first frame, and in the last too where it is marked there.
pub fn crossing_of(scene: Scene<'_>, vertex: u32) -> Option<&GridCrossing> {
    let crossing =
        scene.suggested.crossing_at(Which::First, predicted(scene, Which::First, vertex), 3.0 * ON_CROSSING_PX)?;
    let last = scene.project.features.get(&vertex).and_then(|f| f.last);
    let there = |at: [f64; 2]| (crossing.last - nalgebra::Point2::from(at)).norm() <= 3.0 * ON_CROSSING_PX;
    last.is_none_or(|m| there(m.at_px)).then_some(crossing)
}

/// The regions of the face in the order of marking: still points first, for they give the head's motion and so better predictions
/// of all others; then as the face has them.
pub fn regions_in_order(scene: Scene<'_>) -> impl Iterator<Item = &Region> {
    let is_still = |r: &&Region| r.id == STILL_REGION;
    let all = scene.face.regions();
    all.iter().filter(is_still).chain(all.iter().filter(move |r| !is_still(r)))
}

/// The vertices to mark: those of the ticked regions in marking order, then those that the project knows besides.
pub fn chosen_vertices(scene: Scene<'_>, regions: &BTreeSet<String>) -> Vec<u32> {
    let mut seen = BTreeSet::new();
    let ticked = regions_in_order(scene).filter(|r| regions.contains(&r.id));
    ticked
        .flat_map(|r| r.vertices.iter().copied())
        .chain(scene.project.features.keys().copied())
        .filter(|&v| (v as usize) < scene.face.mesh().len() && seen.insert(v))
        .collect()
}

/// The points of a pane. While landmarks are placed, those without a mark are shown at their predicted places; while
/// feature points are marked, no landmark stands for the feature point of its vertex.
pub fn in_frame(scene: Scene<'_>, which: Which, chosen: &[u32], tool: Tool) -> Vec<ShownPoint> {
    let unmarked_landmarks = tool == Tool::Landmarks;
    let project = scene.project;
    let mut points = Vec::with_capacity(chosen.len() + 32);
    let mut taken = BTreeSet::new();
    // While landmarks are placed, and before they say where the face is, places of other points only confuse.
    let placed = project.landmarks.len() >= LANDMARKS_TO_PREDICT;
    let predicts = !unmarked_landmarks && placed;
    if which == Which::First {
        for l in scene.face.landmarks() {
            let mark = project.landmarks.get(&l.id);
            if mark.is_none() && !(unmarked_landmarks && placed) {
                continue;
            }
            if tool != Tool::Features {
                taken.insert(l.vertex);
            }
            points.push(ShownPoint {
                id: PointId::Landmark(l.id.clone()),
                vertex: l.vertex,
                at: mark.map_or_else(|| predicted(scene, which, l.vertex), |m| m.at_px),
                look: mark.map_or_else(|| without_mark(scene), |m| Look::of(m.state)),
                kind: Kind::Landmark,
                label: l.id.clone(),
                name: l.name.clone(),
                sure: 1.0,
            });
        }
    }
    for &v in chosen {
        let feature = project.features.get(&v);
        let mark = feature.and_then(|f| if which == Which::First { f.first } else { f.last });
        if mark.is_none() && (taken.contains(&v) || !predicts) {
            continue;
        }
        let suggestion = suggestion(scene, v).filter(|_| which == Which::Last && mark.is_none());
        let (look, at) = match (mark, suggestion) {
            (Some(m), _) => (Look::of(m.state), m.at_px),
            (None, Some(s)) => (Look::Suggested, [s.at.x, s.at.y]),
            (None, None) => (without_mark(scene), predicted(scene, which, v)),
        };
        points.push(ShownPoint {
            id: if which == Which::First { PointId::FeatureFirst(v) } else { PointId::FeatureLast(v) },
            vertex: v,
            at,
            look,
            kind: kind_of(scene, v),
            label: v.to_string(),
            name: v.to_string(),
            sure: suggestion.map_or(1.0, |s| s.confidence),
        });
    }
    points.retain(|p| p.at.iter().all(|c| c.is_finite()));
    points
}

/// Where the chain puts a vertex in a frame, px.
pub fn predicted(scene: Scene<'_>, which: Which, vertex: u32) -> [f64; 2] {
    let list = if which == Which::First { &scene.outcome.first_in_image } else { &scene.outcome.last_in_image };
    list.get(vertex as usize).map_or([f64::NAN; 2], |p| [p.x, p.y])
}

/// Fewer placed landmarks than this fix neither place nor size of the face, so there is nothing to predict from.
pub const LANDMARKS_TO_PREDICT: usize = 3;

fn without_mark(scene: Scene<'_>) -> Look {
    if scene.project.landmarks.len() >= LANDMARKS_TO_PREDICT { Look::Predicted } else { Look::Unset }
}

/// What is known of a point, and where it is, px.
pub fn of(scene: Scene<'_>, id: &PointId) -> Option<(Look, [f64; 2])> {
    let mark = crate::project::edit::mark(scene.project, id);
    if let Some(m) = mark {
        return Some((Look::of(m.state), m.at_px));
    }
    if let PointId::FeatureLast(v) = id
        && let Some(s) = suggestion(scene, *v)
    {
        return Some((Look::Suggested, [s.at.x, s.at.y]));
    }
    let (which, vertex) = place(scene, id)?;
    let look = without_mark(scene);
    let at = predicted(scene, which, vertex);
    at.iter().all(|c| c.is_finite()).then_some((look, at))
}

/// Where the skin of a vertex without a mark in the last frame was found.
pub fn suggestion(scene: Scene<'_>, vertex: u32) -> Option<&Suggestion> {
    if scene.project.features.get(&vertex).is_some_and(|f| f.last.is_some()) {
        return None;
    }
    let first = scene.outcome.first_in_image.get(vertex as usize)?;
    scene.suggested.of(vertex, *first)
}

/// Whether a suggestion is as sure as that; a still point must also move as the others do.
pub fn is_sure(scene: Scene<'_>, suggestion: &Suggestion, least: f64) -> bool {
    let v = suggestion.vertex;
    // What another hand has marked is not judged.
    let judged = suggestion.method != Source::Imported && kind_of(scene, v) == Kind::Still;
    let odd = || judged && !scene.suggested.still.points.iter().any(|s| s.vertex == v);
    suggestion.confidence >= least && !odd()
}

/// The chosen points whose suggestion is at least so sure, as marks to be.
pub fn sure_suggestions(scene: Scene<'_>, chosen: &[u32], least: f64) -> Vec<Accepted> {
    let sure = chosen.iter().filter_map(|&v| suggestion(scene, v)).filter(|s| is_sure(scene, s, least));
    sure.map(|s| suggesting::accepted(s, kind_of(scene, s.vertex) == Kind::Still)).collect()
}

/// "93 %": never 100, for nothing that was computed is certain.
pub fn percent(share: f64) -> String {
    format!("{:.0} %", (100.0 * share + 1e-9).floor().clamp(0.0, 99.0))
}

/// The frame and the vertex of a point.
pub fn place(scene: Scene<'_>, id: &PointId) -> Option<(Which, u32)> {
    match id {
        PointId::Landmark(id) => scene.face.landmark(id).map(|l| (Which::First, l.vertex)),
        PointId::FeatureFirst(v) => Some((Which::First, *v)),
        PointId::FeatureLast(v) => Some((Which::Last, *v)),
    }
}
