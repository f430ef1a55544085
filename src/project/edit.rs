//! The edits: the only code that changes a project.

use serde::Serialize;

use super::document::{CameraSettings, FaceSource, Feature, FrameRef, Mark, MarkState, Project, Role, Settings};
use crate::camera::{Scale, ScaleError};

/// Which of the two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Which {
    /// The neutral frame.
    First,
    /// The frame at the height of the expression.
    Last,
}

impl Which {
    /// "first" or "last".
    pub fn word(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Last => "last",
        }
    }
}

/// Names a point that can be marked.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PointId {
    /// A landmark, in the first frame.
    Landmark(String),
    /// A feature point in the first frame: where on the skin the vertex sits.
    FeatureFirst(u32),
    /// A feature point in the last frame: where the skin went.
    FeatureLast(u32),
}

/// A proposed place in the last frame that a hand has accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accepted {
    /// The vertex.
    pub vertex: u32,
    /// The place, px.
    pub at_px: [f64; 2],
    /// What the mark is worth.
    pub state: MarkState,
    /// What kind of skin the vertex becomes, if nothing has been said of it yet.
    pub role: Role,
}

/// One change of a project.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Names the project.
    Rename(String),
    /// Replaces the notes.
    SetNotes(String),
    /// Sets or clears a frame. Marks stay: the same picture may only have moved on disk.
    SetFrame(Which, Option<FrameRef>),
    /// Chooses the face. Marks stay where names and vertices still exist; the others are removed.
    SetFace {
        /// The face.
        source: FaceSource,
        /// Landmark ids that the face has.
        landmark_ids: Vec<String>,
        /// Number of vertices that the face has.
        vertices: u32,
    },
    /// Puts a mark (a locked point refuses).
    Put(PointId, [f64; 2]),
    /// Puts several marks at once, one entry in the history.
    PutMany(Vec<(PointId, [f64; 2])>),
    /// Makes marks of proposed places. One whose point has a mark by now changes nothing: proposals yield to the hand.
    Accept(Vec<Accepted>),
    /// Sets the state of a mark that exists.
    SetState(PointId, MarkState),
    /// Gives a mark its own standard deviation, px, or the project's.
    SetSigma(PointId, Option<f64>),
    /// Removes a mark, never the point itself.
    Clear(PointId),
    /// Removes all marks of the last frame.
    ClearLast,
    /// Marks a feature point of the last frame a second time, px. The mark itself stays.
    Repeat(u32, [f64; 2]),
    /// Forgets all second marks.
    ClearRepeats,
    /// Says what kind of skin a vertex is.
    SetRole(u32, Role),
    /// Sets the camera.
    SetCamera(CameraSettings),
    /// Sets the scale.
    SetScale(Scale),
    /// Sets the choices of the chain.
    SetSettings(Settings),
}

/// Why an edit was refused; the project is as before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The mark is locked.
    #[error("{0} is locked; unlock it first")]
    Locked(String),
    /// There is no mark to change.
    #[error("{0} is not marked yet")]
    NotMarked(String),
    /// A number makes no sense.
    #[error("{what} must be {rule}, and it is {value}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        value: f64,
    },
    /// The scale makes no sense.
    #[error(transparent)]
    Scale(#[from] ScaleError),
}

impl std::fmt::Display for PointId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Landmark(id) => write!(f, "landmark {id}"),
            Self::FeatureFirst(v) => write!(f, "point {v} in the first frame"),
            Self::FeatureLast(v) => write!(f, "point {v}"),
        }
    }
}

impl Edit {
    /// Changes the project, or refuses and leaves it as it was.
    pub fn apply(&self, project: &mut Project) -> Result<(), EditError> {
        match self {
            Self::Rename(name) => project.name.clone_from(name),
            Self::SetNotes(notes) => project.notes.clone_from(notes),
            Self::SetFrame(Which::First, frame) => project.frames.first.clone_from(frame),
            Self::SetFrame(Which::Last, frame) => project.frames.last.clone_from(frame),
            Self::SetFace { source, landmark_ids, vertices } => {
                project.face = source.clone();
                project.landmarks.retain(|id, _| landmark_ids.contains(id));
                project.features.retain(|v, _| v < vertices);
                project.repeats.retain(|v, _| v < vertices);
            }
            Self::Put(id, at) => {
                check_position(*at)?;
                check_unlocked(project, id)?;
                put(project, id, *at);
            }
            Self::PutMany(marks) => {
                for (id, at) in marks {
                    check_position(*at)?;
                    check_unlocked(project, id)?;
                }
                for (id, at) in marks {
                    put(project, id, *at);
                }
            }
            Self::Accept(places) => {
                for place in places {
                    check_position(place.at_px)?;
                }
                for place in places {
                    accept(project, place);
                }
            }
            Self::SetState(id, state) => mark_mut(project, id)?.state = *state,
            Self::SetSigma(id, sigma) => {
                if let Some(s) = sigma {
                    check_not_negative("the standard deviation of a mark", *s)?;
                }
                mark_mut(project, id)?.sigma_px = *sigma;
            }
            Self::Clear(id) => {
                check_unlocked(project, id)?;
                clear(project, id);
            }
            Self::ClearLast => {
                for feature in project.features.values_mut() {
                    if feature.last.is_some_and(|m| m.state != MarkState::Locked) {
                        feature.last = None;
                    }
                }
                drop_empty(project);
            }
            Self::Repeat(vertex, at) => {
                check_position(*at)?;
                project.repeats.insert(*vertex, *at);
            }
            Self::ClearRepeats => project.repeats.clear(),
            Self::SetRole(vertex, role) => {
                project.features.entry(*vertex).or_default().role = *role;
                drop_empty(project);
            }
            Self::SetCamera(camera) => {
                check_camera(camera)?;
                project.camera = *camera;
            }
            Self::SetScale(scale) => {
                scale.check()?;
                project.scale = *scale;
            }
            Self::SetSettings(settings) => {
                check_settings(settings)?;
                project.settings.clone_from(settings);
            }
        }
        Ok(())
    }

    /// Name for the undo list: "Move landmark nose_tip".
    pub fn name(&self, before: &Project) -> String {
        match self {
            Self::Rename(_) => "Rename project".into(),
            Self::SetNotes(_) => "Edit notes".into(),
            Self::SetFrame(which, _) => format!("Set {} frame", which.word()),
            Self::SetFace { .. } => "Choose face".into(),
            Self::Put(id, _) => format!("{} {id}", if mark(before, id).is_some() { "Move" } else { "Mark" }),
            Self::PutMany(marks) => format!("Mark {} points", marks.len()),
            Self::Accept(places) => match places[..] {
                [Accepted { vertex, .. }] => format!("Accept the suggestion for point {vertex}"),
                _ => format!("Accept {} suggestions", places.len()),
            },
            Self::SetState(id, state) => {
                let verb = match state {
                    MarkState::Marked => "Confirm",
                    MarkState::Uncertain => "Doubt",
                    MarkState::Occluded => "Set occluded:",
                    MarkState::Locked => "Lock",
                };
                format!("{verb} {id}")
            }
            Self::SetSigma(id, _) => format!("Set error of {id}"),
            Self::Clear(id) => format!("Clear {id}"),
            Self::ClearLast => "Clear all marks of the last frame".into(),
            Self::Repeat(v, _) => format!("Mark point {v} again"),
            Self::ClearRepeats => "Forget all second marks".into(),
            Self::SetRole(v, Role::Skin) => format!("Make point {v} ordinary skin"),
            Self::SetRole(v, Role::Still) => format!("Make point {v} a still point"),
            Self::SetRole(v, Role::Fixed) => format!("Fix point {v}"),
            Self::SetCamera(_) => "Set camera".into(),
            Self::SetScale(_) => "Set scale".into(),
            Self::SetSettings(_) => "Change settings".into(),
        }
    }
}

/// The mark of a point, if it has one.
pub fn mark<'a>(project: &'a Project, id: &PointId) -> Option<&'a Mark> {
    match id {
        PointId::Landmark(id) => project.landmarks.get(id),
        PointId::FeatureFirst(v) => project.features.get(v)?.first.as_ref(),
        PointId::FeatureLast(v) => project.features.get(v)?.last.as_ref(),
    }
}

/// Refuses settings that a stage could not compute with.
pub fn check_settings(settings: &Settings) -> Result<(), EditError> {
    check_positive("the thickness of the skin", settings.skin_thickness_mm)?;
    check_not_negative("the marking error", settings.marking_sigma_px)?;
    check_positive("the factor of depth", settings.customize.z_factor)?;
    check_positive("the power of the distance", settings.customize.power)?;
    if settings.customize.nearest == Some(0) {
        return Err(EditError::Value { what: "the number of nearest landmarks", rule: "at least 1", value: 0.0 });
    }
    if let crate::displacement::UnmarkedRule::Inferred { reach_mm } = settings.unmarked {
        check_positive("the reach of inference", reach_mm)?;
    }
    Ok(())
}

/// Refuses a camera that sees nothing.
pub fn check_camera(camera: &CameraSettings) -> Result<(), EditError> {
    // Nearer than 150 mm the nose would touch the lens and the wireframe turn inside out.
    if !(camera.distance_mm >= 150.0 && camera.distance_mm.is_finite()) {
        let what = "the distance of the camera";
        return Err(EditError::Value { what, rule: "at least 150 mm", value: camera.distance_mm });
    }
    if !(-1000.0..=1000.0).contains(&camera.view_plane_z_mm) {
        let what = "the depth of the view plane";
        return Err(EditError::Value { what, rule: "within ±1000 mm", value: camera.view_plane_z_mm });
    }
    camera.principal_point_px.map_or(Ok(()), check_position)
}

/// Refuses positions that are not finite or absurdly far outside any picture.
pub fn check_position(at: [f64; 2]) -> Result<(), EditError> {
    for value in at {
        if !(-1e6..=1e6).contains(&value) {
            return Err(EditError::Value { what: "a position", rule: "a number of pixels within ±1000000", value });
        }
    }
    Ok(())
}

fn check_positive(what: &'static str, value: f64) -> Result<(), EditError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(EditError::Value { what, rule: "greater than zero", value })
    }
}

/// Refuses negative and non-finite numbers.
pub fn check_not_negative(what: &'static str, value: f64) -> Result<(), EditError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(EditError::Value { what, rule: "zero or greater", value })
    }
}

fn check_unlocked(project: &Project, id: &PointId) -> Result<(), EditError> {
    match mark(project, id) {
        Some(m) if m.state == MarkState::Locked => Err(EditError::Locked(id.to_string())),
        _ => Ok(()),
    }
}

/// A mark that is moved keeps what was said of it, except that an occluded one is seen again.
fn put(project: &mut Project, id: &PointId, at_px: [f64; 2]) {
    let mut new = mark(project, id).map_or_else(|| Mark::new(at_px), |old| Mark { at_px, ..*old });
    if new.state == MarkState::Occluded {
        new.state = MarkState::Marked;
    }
    match id {
        PointId::Landmark(id) => {
            project.landmarks.insert(id.clone(), new);
        }
        PointId::FeatureFirst(v) => project.features.entry(*v).or_default().first = Some(new),
        PointId::FeatureLast(v) => project.features.entry(*v).or_default().last = Some(new),
    }
}

fn accept(project: &mut Project, place: &Accepted) {
    let Accepted { vertex, at_px, state, role } = *place;
    let feature = project.features.entry(vertex).or_insert(Feature { role, ..Feature::default() });
    feature.last.get_or_insert(Mark { state, ..Mark::new(at_px) });
}

fn mark_mut<'a>(project: &'a mut Project, id: &PointId) -> Result<&'a mut Mark, EditError> {
    let found = match id {
        PointId::Landmark(name) => project.landmarks.get_mut(name),
        PointId::FeatureFirst(v) => project.features.get_mut(v).and_then(|f| f.first.as_mut()),
        PointId::FeatureLast(v) => project.features.get_mut(v).and_then(|f| f.last.as_mut()),
    };
    found.ok_or_else(|| EditError::NotMarked(id.to_string()))
}

fn clear(project: &mut Project, id: &PointId) {
    match id {
        PointId::Landmark(id) => {
            project.landmarks.remove(id);
        }
        PointId::FeatureFirst(v) => {
            if let Some(f) = project.features.get_mut(v) {
                f.first = None;
            }
        }
        PointId::FeatureLast(v) => {
            if let Some(f) = project.features.get_mut(v) {
                f.last = None;
            }
        }
    }
    drop_empty(project);
}

fn drop_empty(project: &mut Project) {
    project.features.retain(|_, f| *f != Feature::default());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_locked_mark_refuses_the_hand_and_an_occluded_one_is_seen_again_when_moved() {
        let mut p = Project::default();
        let id = PointId::FeatureLast(7);
        Edit::Put(id.clone(), [1.0, 2.0]).apply(&mut p).unwrap();
        Edit::SetState(id.clone(), MarkState::Locked).apply(&mut p).unwrap();
        let before = p.clone();
        assert!(matches!(Edit::Put(id.clone(), [3.0, 4.0]).apply(&mut p), Err(EditError::Locked(_))));
        assert!(matches!(Edit::Clear(id.clone()).apply(&mut p), Err(EditError::Locked(_))));
        assert_eq!(p, before);
        Edit::SetState(id.clone(), MarkState::Occluded).apply(&mut p).unwrap();
        assert_eq!(p.measured_count(), 0);
        Edit::Put(id.clone(), [3.0, 4.0]).apply(&mut p).unwrap();
        assert_eq!(mark(&p, &id).unwrap().state, MarkState::Marked);
        assert_eq!(p.measured_count(), 1);
    }

    #[test]
    fn one_bad_position_of_many_changes_nothing() {
        let mut p = Project::default();
        let many = vec![(PointId::FeatureLast(1), [1.0, 1.0]), (PointId::FeatureLast(2), [f64::NAN, 1.0])];
        assert!(Edit::PutMany(many).apply(&mut p).is_err());
        assert_eq!(p, Project::default());
    }

    #[test]
    fn an_accepted_place_never_replaces_a_mark_and_keeps_what_was_said_of_the_skin() {
        let mut p = Project::default();
        Edit::Put(PointId::FeatureLast(1), [1.0, 1.0]).apply(&mut p).unwrap();
        Edit::SetRole(2, Role::Fixed).apply(&mut p).unwrap();
        let place = |vertex| Accepted { vertex, at_px: [9.0, 9.0], state: MarkState::Uncertain, role: Role::Still };
        let edit = Edit::Accept(vec![place(1), place(2), place(3)]);
        assert_eq!(edit.name(&p), "Accept 3 suggestions");
        edit.apply(&mut p).unwrap();
        assert_eq!(p.features[&1].last, Some(Mark::new([1.0, 1.0])));
        let marked = Some(Mark { state: MarkState::Uncertain, ..Mark::new([9.0, 9.0]) });
        assert_eq!((p.features[&2].last, p.features[&2].role), (marked, Role::Fixed));
        assert_eq!((p.features[&3].last, p.features[&3].role), (marked, Role::Still));
        let bad = Edit::Accept(vec![place(4), Accepted { at_px: [f64::NAN, 0.0], ..place(5) }]);
        assert!(bad.apply(&mut p).is_err() && !p.features.contains_key(&4));
    }

    #[test]
    fn clearing_the_only_mark_leaves_no_empty_feature_but_a_role_stays() {
        let mut p = Project::default();
        Edit::Put(PointId::FeatureLast(3), [1.0, 1.0]).apply(&mut p).unwrap();
        Edit::Clear(PointId::FeatureLast(3)).apply(&mut p).unwrap();
        assert_eq!(p, Project::default());
        Edit::SetRole(3, Role::Still).apply(&mut p).unwrap();
        Edit::Clear(PointId::FeatureLast(3)).apply(&mut p).unwrap();
        assert_eq!(p.features[&3].role, Role::Still);
    }
}
