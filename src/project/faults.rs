//! What is wrong with the values of a project: every fault with its place, so that one run shows them all.

use super::document::{FaceSource, FrameRef, Mark, Project};
use super::edit::{PointId, check_camera, check_not_negative, check_position, check_settings};
use crate::face::FaceModel;

/// One fault of a project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The field, as in the file: `features.17.last.at_px`.
    pub place: String,
    /// What is wrong and what it should be.
    pub reason: String,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.reason)
    }
}

/// Values that no stage could compute with, whatever the face. A project file with one of them is refused.
pub fn of_values(project: &Project) -> Vec<Fault> {
    let mut faults = Faults::default();
    for (place, frame) in [("frames.first", &project.frames.first), ("frames.last", &project.frames.last)] {
        if let Some(frame) = frame {
            faults.of_frame(place, frame);
        }
    }
    if let FaceSource::File { path, sha256 } = &project.face {
        faults.of_path("face.path", path);
        faults.of_hash("face.sha256", sha256);
    }
    faults.note("camera", check_camera(&project.camera));
    faults.note("scale", project.scale.check());
    let scale_points = match project.scale {
        crate::camera::Scale::TwoPoints { a_px, b_px, .. } | crate::camera::Scale::GridPitch { a_px, b_px, .. } => {
            vec![("scale.a_px", a_px), ("scale.b_px", b_px)]
        }
        _ => Vec::new(),
    };
    for (place, at) in scale_points {
        faults.note(place, check_position(at));
    }
    for (id, mark) in &project.landmarks {
        faults.of_mark(&format!("landmarks.{id}"), mark);
    }
    for (vertex, feature) in &project.features {
        for (end, mark) in [("first", &feature.first), ("last", &feature.last)] {
            if let Some(mark) = mark {
                faults.of_mark(&format!("features.{vertex}.{end}"), mark);
            }
        }
    }
    for (vertex, at) in &project.repeats {
        faults.note(&format!("repeats.{vertex}"), check_position(*at));
    }
    faults.note("settings", check_settings(&project.settings));
    faults.0
}

/// Marks of landmarks and vertices that a face does not have. The chain leaves them out; a file with one was made for another face.
pub fn of_bindings(project: &Project, face: &FaceModel) -> Vec<Fault> {
    let mut faults = Faults::default();
    for id in project.landmarks.keys().filter(|id| face.landmark(id).is_none()) {
        let reason = format!("the face “{}” has no landmark of this name", face.name());
        faults.add(format!("landmarks.{id}"), reason);
    }
    let vertices = face.mesh().len();
    for vertex in project.features.keys().filter(|v| **v as usize >= vertices) {
        let reason =
            format!("the face “{}” has no vertex {vertex}: its vertices are 0 to {}", face.name(), vertices - 1);
        faults.add(format!("features.{vertex}"), reason);
    }
    for vertex in project.repeats.keys().filter(|v| **v as usize >= vertices) {
        faults.add(format!("repeats.{vertex}"), format!("the face “{}” has no vertex {vertex}", face.name()));
    }
    faults.0
}

/// Marks that count and lie outside their picture.
pub fn of_extent(project: &Project) -> Vec<Fault> {
    let mut faults = Faults::default();
    for (id, [x, y]) in outside_picture(project) {
        let (place, frame) = match &id {
            PointId::Landmark(id) => (format!("landmarks.{id}.at_px"), &project.frames.first),
            PointId::FeatureFirst(v) => (format!("features.{v}.first.at_px"), &project.frames.first),
            PointId::FeatureLast(v) => (format!("features.{v}.last.at_px"), &project.frames.last),
        };
        let (w, h) = frame.as_ref().map_or((0, 0), |f| (f.width_px, f.height_px));
        faults.add(place, format!("({x}, {y}) lies outside the picture of {w} × {h} px"));
    }
    faults.0
}

/// The points whose marks count and lie outside their picture, and where, px.
pub fn outside_picture(project: &Project) -> Vec<(PointId, [f64; 2])> {
    let (first, last) = (&project.frames.first, &project.frames.last);
    let landmarks = project.landmarks.iter().map(|(id, m)| (PointId::Landmark(id.clone()), m, first));
    let features = project.features.iter().flat_map(|(v, f)| {
        let in_first = f.first.iter().map(move |m| (PointId::FeatureFirst(*v), m, first));
        in_first.chain(f.last.iter().map(move |m| (PointId::FeatureLast(*v), m, last)))
    });
    let outside = |(id, mark, frame): (PointId, &Mark, &Option<FrameRef>)| {
        let frame = frame.as_ref().filter(|_| mark.state.is_data())?;
        let [x, y] = mark.at_px;
        let (w, h) = (f64::from(frame.width_px), f64::from(frame.height_px));
        let inside = (0.0..=w).contains(&x) && (0.0..=h).contains(&y);
        (!inside).then_some((id, mark.at_px))
    };
    landmarks.chain(features).filter_map(outside).collect()
}

/// A SHA-256 as files hold it: 64 hexadecimal digits.
pub fn is_sha256(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

#[derive(Default)]
struct Faults(Vec<Fault>);

impl Faults {
    fn add(&mut self, place: impl Into<String>, reason: impl Into<String>) {
        self.0.push(Fault { place: place.into(), reason: reason.into() });
    }

    fn note<E: std::fmt::Display>(&mut self, place: &str, checked: Result<(), E>) {
        if let Err(e) = checked {
            self.add(place, e.to_string());
        }
    }

    fn of_frame(&mut self, place: &str, frame: &FrameRef) {
        self.of_path(&format!("{place}.path"), &frame.path);
        self.of_hash(&format!("{place}.sha256"), &frame.sha256);
        for (name, size) in [("width_px", frame.width_px), ("height_px", frame.height_px)] {
            if size == 0 {
                self.add(format!("{place}.{name}"), "a picture is at least 1 px wide and high");
            }
        }
    }

    fn of_path(&mut self, place: &str, path: &str) {
        if path.is_empty() || path.contains('\0') {
            self.add(place, "the path of a file is needed");
        }
    }

    fn of_hash(&mut self, place: &str, hash: &str) {
        if !is_sha256(hash) {
            self.add(place, "a SHA-256 of 64 hexadecimal digits is needed (as `sha256sum FILE` prints it)");
        }
    }

    fn of_mark(&mut self, place: &str, mark: &Mark) {
        self.note(&format!("{place}.at_px"), check_position(mark.at_px));
        if let Some(sigma) = mark.sigma_px {
            self.note(&format!("{place}.sigma_px"), check_not_negative("the standard deviation of a mark", sigma));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::document::{Feature, MarkState};

    #[test]
    fn every_fault_is_listed_with_its_place() {
        let mut p = Project::default();
        let frame = FrameRef { path: String::new(), sha256: "12".into(), width_px: 0, height_px: 10 };
        p.frames.last = Some(frame);
        p.camera.distance_mm = 10.0;
        p.settings.skin_thickness_mm = 0.0;
        p.landmarks.insert("nose_tip".into(), Mark::new([f64::NAN, 0.0]));
        let mark = Mark { sigma_px: Some(-1.0), ..Mark::new([0.0, 0.0]) };
        p.features.insert(17, Feature { last: Some(mark), ..Feature::default() });
        let places: Vec<String> = of_values(&p).into_iter().map(|f| f.place).collect();
        let expected = [
            "frames.last.path",
            "frames.last.sha256",
            "frames.last.width_px",
            "camera",
            "landmarks.nose_tip.at_px",
            "features.17.last.sigma_px",
            "settings",
        ];
        assert_eq!(places, expected);
        assert!(of_values(&Project::default()).is_empty());
    }

    #[test]
    fn a_mark_on_the_rim_is_inside_and_an_occluded_one_may_be_anywhere() {
        let mut p = Project::default();
        p.frames.first = Some(FrameRef { path: "a".into(), sha256: "0".repeat(64), width_px: 10, height_px: 20 });
        p.landmarks.insert("a".into(), Mark::new([10.0, 20.0]));
        p.landmarks.insert("b".into(), Mark::new([10.1, 5.0]));
        let hidden = Mark { state: MarkState::Occluded, ..Mark::new([-5.0, 5.0]) };
        p.landmarks.insert("c".into(), hidden);
        let faults = of_extent(&p);
        assert_eq!(faults.len(), 1);
        assert_eq!(faults[0].to_string(), "landmarks.b.at_px: (10.1, 5) lies outside the picture of 10 × 20 px");
    }
}
