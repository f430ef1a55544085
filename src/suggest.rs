//! Where every feature point that is not marked yet probably went: proposals for a hand, never data.

mod refine;
pub mod still;
mod through;

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector3};

use crate::camera::Camera;
use crate::draw::raster::Corner;
use crate::face::{FaceModel, Mesh};
use crate::marking::gray::Gray;
use crate::marking::grid::Carried;
use crate::marking::lead::Leader;
use crate::marking::registration::Skin;
use crate::marking::tracking::{self, Method, Point, Prepared, TrackSettings, Tracker};
use crate::pipeline::Outcome;
use crate::project::{MarkState, Project};
pub use refine::{Line, Refined, Refinement, Why, refine, snap};
pub use through::follow_film;

/// A proposal for one vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suggestion {
    /// The vertex.
    pub vertex: u32,
    /// Where it probably lies in the last frame, px.
    pub at: Point2<f64>,
    /// How sure it is that this is within 1 px, 0 to 1.
    pub confidence: f64,
    /// How it was found.
    pub method: Source,
    /// Row and column of the crossing of the painted grid that the vertex lies on, counted from the top and from the left.
    pub crossing: Option<[u32; 2]>,
}

/// A crossing of the painted grid that was found in both frames: it keeps its row and column from the first to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCrossing {
    /// Counted from the top, from 0.
    pub row: u32,
    /// Counted from the left, from 0.
    pub column: u32,
    /// In the first frame, px.
    pub first: Point2<f64>,
    /// In the last frame, px.
    pub last: Point2<f64>,
}

/// What a search has found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// For the points without a mark.
    pub suggestions: Vec<Suggestion>,
    /// The crossings of the painted grid; none on bare skin.
    pub crossings: Vec<GridCrossing>,
    /// Standard error along each axis that the frames' compression adds to every place, px.
    pub compressed_px: f64,
}

/// How a suggestion was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The vertex lies on a crossing of the painted grid, which was told from all others.
    Crossing,
    /// The skin about the point was found again, beginning where the crossings about it lead.
    Grid,
    /// The skin about the point was found again, beginning where the motion of the skin about it leads.
    Tracked,
    /// Not found itself; its neighbours lead there.
    Neighbours,
    /// Read from a file of marks.
    Imported,
}

impl Source {
    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Source::Crossing => "crossing",
            Source::Grid => "grid",
            Source::Tracked => "tracked",
            Source::Neighbours => "neighbours",
            Source::Imported => "imported",
        }
    }
}

/// Cosine between a vertex's normal and the direction to the camera below which its skin is seen too flat to be followed.
const SEEN: f64 = 0.25;
/// Error of a place that neighbours lead to, px, at least and for each px of distance to them.
const LED_LEAST_PX: f64 = 0.5;
const LED_ERROR: f64 = 0.08;

/// Suggestions for every vertex that faces the camera in both frames and is not marked in the last.
///
/// Marks of the last frame lead the rest; occluded ones are neither used nor suggested. Empty where a frame has no pixels.
pub fn suggestions(
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    first: &RgbImage,
    last: &RgbImage,
) -> Vec<Suggestion> {
    let (Some(first), Some(last)) = (Gray::of(first), Gray::of(last)) else { return Vec::new() };
    suggestions_in(project, face, outcome, &Prepared::of(first), &Prepared::of(last))
}

/// The same from pictures that were prepared before: what is done again after every mark.
pub fn suggestions_in(
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    last: &Prepared,
) -> Vec<Suggestion> {
    suggestions_through(project, face, outcome, first, std::iter::empty(), last)
}

/// The same through the frames of a film between the first and the last: the motion is followed from frame to frame, so that it may be large
/// and the face may turn on the way. Every frame is prepared where it comes from, so that one at a time is in memory.
pub fn suggestions_through(
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    between: impl Iterator<Item = Prepared>,
    last: &Prepared,
) -> Vec<Suggestion> {
    let followed = follow(face, outcome, first, between);
    found_after(project, face, outcome, first, &followed, last).suggestions
}

/// The motion of the skin from the first frame to the last one before the last, as far as it was followed.
#[derive(Clone, Debug, Default)]
pub struct Followed(Vec<Leader>);

/// Follows the motion through the frames between the first and the last; marks have no part in it, so that it holds while the last frame is
/// being marked.
pub fn follow(
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    between: impl Iterator<Item = Prepared>,
) -> Followed {
    let asked = asked(face, outcome, first.size());
    let points: Vec<Point> = asked.iter().map(|&v| Point::at(outcome.first_in_image[v as usize])).collect();
    let settings = TrackSettings { grid: false, ..settings_for(outcome) };
    let mut tracker = Tracker::new(first, &points, settings);
    for frame in between {
        tracker.advance(&frame);
    }
    Followed(tracker.into_field())
}

/// Suggestions as of [`suggestions_in`], where the motion was followed before (an empty one is no help and no harm), and the crossings that led.
pub fn found_after(
    project: &Project,
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    followed: &Followed,
    last: &Prepared,
) -> Found {
    let asked = asked(face, outcome, first.size());
    let skin = skin(face.mesh(), &outcome.first, &outcome.camera, first.size());
    let mark = |v: u32| project.features.get(&v).and_then(|f| f.last);
    let usable = |state: MarkState| state != MarkState::Occluded;
    let points: Vec<Point> = asked
        .iter()
        .map(|&v| Point {
            first: outcome.first_in_image[v as usize],
            known: mark(v).filter(|m| usable(m.state)).map(|m| Point2::from(m.at_px)),
            triangle: skin.at_vertex(v as usize),
        })
        .collect();
    let tracker = Tracker::new(first, &points, settings_for(outcome)).after(followed.0.clone());
    let tracks = tracker.find(last, &skin);
    let crossing = |c: &Carried| GridCrossing {
        row: c.row.unsigned_abs(),
        column: c.column.unsigned_abs(),
        first: c.first.at,
        last: c.last.at,
    };
    let crossings = tracks.grid.iter().map(crossing).collect();
    let suggestions = asked
        .iter()
        .zip(&points)
        .zip(&tracks.points)
        .filter(|((v, _), _)| mark(**v).is_none())
        .filter_map(|((&vertex, point), answer)| {
            if let Some(Ok(t)) = answer {
                let (method, crossing) = match t.method {
                    Method::Crossing { column, row } => (Source::Crossing, Some([row, column].map(i32::unsigned_abs))),
                    Method::Grid => (Source::Grid, None),
                    Method::Field => (Source::Tracked, None),
                };
                return Some(Suggestion { vertex, at: t.at, confidence: t.confidence, method, crossing });
            }
            let (at, distance) = tracking::led(&tracks, &point.first)?;
            let sigma = LED_LEAST_PX + LED_ERROR * distance;
            let confidence = 1.0 - (-1.0 / (2.0 * (sigma * sigma + tracks.compressed_px2))).exp();
            Some(Suggestion { vertex, at, confidence, method: Source::Neighbours, crossing: None })
        })
        .collect();
    Found { suggestions, crossings, compressed_px: tracks.compressed_px2.sqrt() }
}

fn settings_for(outcome: &Outcome) -> TrackSettings {
    TrackSettings { px_per_mm: outcome.camera.px_per_mm, ..TrackSettings::default() }
}

/// The vertices that face the camera, inside the picture.
fn asked(face: &FaceModel, outcome: &Outcome, size: [usize; 2]) -> Vec<u32> {
    let size = size.map(|side| side as f64);
    let inside = |at: Point2<f64>| at.x > 0.0 && at.y > 0.0 && at.x < size[0] && at.y < size[1];
    let seen = seen(face.mesh(), &outcome.first, outcome.camera.z_prp_mm);
    (0..seen.len()).filter(|&v| seen[v] && inside(outcome.first_in_image[v])).map(|v| v as u32).collect()
}

/// The skin that a camera sees of a face whose vertices lie at some places.
pub(crate) fn skin(mesh: &Mesh, places: &[Point3<f64>], camera: &Camera, size: [usize; 2]) -> Skin {
    let corner = |x: &Point3<f64>| {
        let p = camera.image_from_face(x);
        Corner { x: p.x, y: p.y, depth: camera.z_prp_mm - x.z }
    };
    let corners: Vec<Corner> = places.iter().map(corner).collect();
    Skin::of(mesh, &seen(mesh, places, camera.z_prp_mm), &corners, size)
}

/// Whether each vertex of a face faces a camera at a height of `eye_mm` before it.
pub(crate) fn seen(mesh: &Mesh, places: &[Point3<f64>], eye_mm: f64) -> Vec<bool> {
    let normals = mesh.vertex_normals(places);
    let eye = Point3::new(0.0, 0.0, eye_mm);
    let faces = |(at, normal): (&Point3<f64>, &Vector3<f64>)| {
        (eye - at).try_normalize(1e-9).is_some_and(|towards| normal.dot(&towards) > SEEN)
    };
    places.iter().zip(&normals).map(faces).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::{self, Workspace};
    use crate::project::{Role, sample};

    /// The sample is a rendered scene whose marks are the truth. All but the still points are taken away and suggested anew: the
    /// forehead moves by up to 8 mm under a grid whose cells are 25 px apart, so a match in the wrong cell is 25 px off.
    #[test]
    fn marks_of_the_sample_are_found_again() {
        let face = crate::face::generic();
        let whole = sample::project().unwrap();
        let mut project = whole.clone();
        project.features.retain(|_, f| f.role == Role::Still);
        assert!((4..30).contains(&project.features.len()), "{}", project.features.len());
        let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        let [first, last] = [1, 2].map(|k| image::load_from_memory(sample::files()[k].1).unwrap().into_rgb8());
        let found = suggestions(&project, &face, &outcome, &first, &last);
        let errors: Vec<(f64, f64)> = found
            .iter()
            .filter_map(|s| {
                let truth = whole.features.get(&s.vertex)?.last?;
                Some(((s.at - Point2::from(truth.at_px)).norm(), s.confidence))
            })
            .collect();
        assert!(errors.len() > 100, "{}", errors.len());
        let share = |of: &dyn Fn(&(f64, f64)) -> bool, is: &dyn Fn(&(f64, f64)) -> bool| {
            let chosen: Vec<_> = errors.iter().filter(|e| of(e)).collect();
            (chosen.iter().filter(|e| is(e)).count() as f64 / chosen.len().max(1) as f64, chosen.len())
        };
        let (half, _) = share(&|_| true, &|e| e.0 < 0.35);
        assert!(half > 0.5, "half of the points within 0.35 px: {half}");
        let (sure, count) = share(&|e| e.1 >= 0.9, &|e| e.0 < 1.0);
        assert!(count > 30 && sure >= 0.9, "{count} called 90 % sure, {sure} within 1 px");
        assert!(!errors.iter().any(|e| e.1 > 0.6 && e.0 > 10.0), "none in the wrong cell");
        assert!(found.iter().all(|s| !project.features.contains_key(&s.vertex)), "no marked point is suggested");
    }

    #[test]
    fn without_texture_there_is_no_sure_suggestion() {
        let face = crate::face::generic();
        let project = sample::project().unwrap();
        let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
        let grey = RgbImage::from_pixel(1036, 1036, image::Rgb([120; 3]));
        let found = suggestions(&project, &face, &outcome, &grey, &grey);
        assert!(!found.is_empty() && found.iter().all(|s| s.method == Source::Neighbours && s.confidence < 0.9));
        assert!(suggestions(&project, &face, &outcome, &RgbImage::new(0, 0), &grey).is_empty());
    }
}
