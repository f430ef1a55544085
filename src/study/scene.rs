//! A twin as an annotator would have marked it: a person, the project, and the true forces.
//!
//! The person's face *is* what customisation makes of the generic face from the person's landmarks: with marks at the
//! truth the chain finds the true first frame to rounding, and what remains of an error belongs to the last frame.

use nalgebra::{Point2, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::camera::{Camera, Scale};
use crate::customize::{self, CustomizeError, CustomizeSettings, LandmarkTarget};
use crate::displacement::{DepthRule, UnmarkedRule, VertexState};
use crate::expression::Refined;
use crate::face::{FaceError, FaceModel};
use crate::forces::{self, Springs};
use crate::pipeline::Outcome;
use crate::project::{CameraSettings, Feature, FramePair, FrameRef, Mark, Project, Role, Settings};

use super::twin::Twin;

/// Largest change of a person's proportions against the generic face: width, height, and the height of the lower face.
const PROPORTIONS: f64 = 0.03;
/// Largest further move of a landmark along x and y, mm: faces are not quite symmetric.
const ASYMMETRY_MM: f64 = 0.5;
/// Regions that are marked in the last frame.
const MARKED: [&str; 2] = ["forehead_and_brows", "still"];
/// The region of still points.
const STILL: &str = "still";
/// A still point may have been moved by the expression so far, mm: far below what a hand can mark.
const STILL_WITHIN_MM: f64 = 0.02;
/// How far inference reaches, mm: an edge and a half, so that a vertex skipped between marks is filled in and the lids, of which
/// nothing is marked and which unfold rather than stretch, are not guessed from the brow and the eye corner.
const REACH_MM: f64 = 12.0;
/// Length of the two points that give the scale, mm.
const RULER_MM: f64 = 50.0;
/// A vertex of the rim whose normal leans farther from the camera is not seen: least z.
const SEEN: f64 = 0.25;

/// Why a person could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PersonError {
    /// The landmarks do not customise the face.
    #[error(transparent)]
    Customize(#[from] CustomizeError),
    /// The customised face is no face.
    #[error(transparent)]
    Face(#[from] FaceError),
}

/// A person: the generic face customised to landmarks of other proportions, seen from `distance_mm`.
///
/// Depends on the seed and the distance of the camera alone; the same face model otherwise.
pub fn person(generic: &FaceModel, seed: u64, distance_mm: f64) -> Result<FaceModel, PersonError> {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x7065_7273);
    let mut within = |limit: f64| random.random_range(-limit..=limit);
    let [wide, high, low] = [(); 3].map(|()| 1.0 + within(PROPORTIONS));
    // Any scale will do: customisation works in millimetres on the view plane.
    let camera = Camera { principal_point_px: Point2::origin(), z_prp_mm: distance_mm, z_vp_mm: 0.0, px_per_mm: 1.0 };
    let mesh = generic.mesh();
    let targets: Vec<LandmarkTarget> = generic
        .landmarks()
        .iter()
        .filter_map(|l| {
            let x = mesh.positions().get(l.vertex as usize)?;
            let lower = if x.y < 0.0 { low } else { 1.0 };
            let place = Point3::new(x.x * wide + within(ASYMMETRY_MM), x.y * high * lower + within(ASYMMETRY_MM), x.z);
            Some(LandmarkTarget { vertex: l.vertex, at_in_image: camera.image_from_face(&place) })
        })
        .collect();
    let customized = customize::customize(mesh, &targets, &camera, &CustomizeSettings::default())?;
    Ok(generic.with_positions(customized.positions)?)
}

/// Leaves out the marks of skin outside a region.
pub(super) fn mark_only(project: &mut Project, region: &[u32]) {
    project.features.retain(|v, f| f.role == Role::Still || region.contains(v));
}

/// The face with muscles that are not where anyone looks for them: both ends of every muscle on a neighbour of their vertex, some 8 mm off, and
/// widths from 75 to 125 % of its own.
pub(super) fn muscles_elsewhere(face: &FaceModel, seed: u64) -> Result<FaceModel, FaceError> {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x656c_7365);
    let mut parts = face.to_parts();
    for muscle in &mut parts.muscles {
        let mut beside = |end: u32, other: u32| {
            let near = face.mesh().neighbours(end as usize);
            let near: Vec<u32> = near.iter().copied().filter(|v| *v != other).collect();
            near.get(random.random_range(0..near.len().max(1))).copied().unwrap_or(end)
        };
        muscle.attachment = beside(muscle.attachment, muscle.insertion);
        muscle.insertion = beside(muscle.insertion, muscle.attachment);
        muscle.half_width_mm *= random.random_range(0.75..1.25);
    }
    FaceModel::new(face.mesh().clone(), parts)
}

/// The face with every triangle cut into four, and its own muscles alone.
pub(super) fn finer(face: &FaceModel) -> Result<Refined, String> {
    let mut refined = Refined::new(face, 1).map_err(|e| e.to_string())?;
    let mut parts = refined.face.to_parts();
    parts.muscles = face.muscles().to_vec();
    refined.face = FaceModel::new(refined.face.mesh().clone(), parts).map_err(|e| e.to_string())?;
    Ok(refined)
}

/// What of a twin is marked in the last frame, and how its project is called.
#[derive(Clone, Debug)]
struct Scope {
    /// Name of the project.
    name: String,
    /// What it says of itself.
    notes: String,
    /// Depth rule of the project.
    depth: DepthRule,
    /// Vertices that may be marked.
    vertices: Vec<u32>,
    /// Share of them that nobody marked, by chance; still points are marked always. 0 to 0.9.
    unmarked: f64,
    /// Vertices among which still points are looked for.
    still: Vec<u32>,
}

/// The project of a twin: every landmark, the forehead, the brows and the still points marked at the truth plus the
/// twin's noise, the true camera and scale, and the depth rule that is true of this scene.
///
/// `sigma_px` is the marking error that the project states.
pub fn project(twin: &Twin, face: &FaceModel, frames: [FrameRef; 2], sigma_px: f64) -> Project {
    let scope = Scope {
        name: format!("Brow raise of twin {}", twin.settings.seed),
        notes:
            "A rendered scene whose truth is known: the skin slides on the face, so depth is taken from its surface."
                .to_owned(),
        depth: DepthRule::SlideOnSurface,
        vertices: MARKED.iter().flat_map(|r| face.region(r)).copied().collect(),
        unmarked: 0.0,
        still: face.region(STILL).to_vec(),
    };
    project_of(twin, face, frames, sigma_px, &scope)
}

/// The project of an expression of a membrane: the whole face marked but for a share, the corners of the eyes and what else the bones hold as still
/// points, and the default depth rule, which knows nothing of the scene.
pub fn membrane_project(
    twin: &Twin,
    face: &FaceModel,
    frames: [FrameRef; 2],
    sigma_px: f64,
    name: &str,
    unmarked: f64,
) -> Project {
    let mesh = face.mesh();
    let normals = mesh.vertex_normals(mesh.positions());
    let border = crate::simulate::rim(mesh, mesh.positions());
    // Of the rim only what the camera sees.
    let rim = (0..mesh.len()).filter(|&v| border[v] && normals[v].z > SEEN).map(|v| v as u32);
    let scope = Scope {
        name: format!("{name}, twin {}", twin.settings.seed),
        notes: "A rendered scene whose truth is known: a finer mesh of membrane elements over the skull, pulled by \
                muscles, in equilibrium. Its forces are not those of the project's springs."
            .to_owned(),
        depth: DepthRule::default(),
        vertices: (0..mesh.len() as u32).collect(),
        unmarked,
        still: face.region(STILL).iter().copied().chain(rim).collect(),
    };
    project_of(twin, face, frames, sigma_px, &scope)
}

fn project_of(twin: &Twin, face: &FaceModel, frames: [FrameRef; 2], sigma_px: f64, scope: &Scope) -> Project {
    let [first_marks, last_marks] = twin.marks_in_image();
    let mark = |marks: &[Point2<f64>], v: u32| marks.get(v as usize).map(|p| Mark::new([p.x, p.y]));
    let landmarks = face.landmarks().iter().filter_map(|l| Some((l.id.clone(), mark(&first_marks, l.vertex)?)));
    let still = twin.still(&scope.still, STILL_WITHIN_MM);
    let mut random = Pcg64::seed_from_u64(twin.settings.seed ^ 0x756e_6d61);
    let mut features = std::collections::BTreeMap::new();
    for &v in scope.vertices.iter().chain(&still) {
        let role = if still.contains(&v) { Role::Still } else { Role::Skin };
        // One draw a vertex, so that a larger share leaves out the same and more.
        let left_out = random.random::<f64>() < scope.unmarked;
        if role == Role::Still || !left_out {
            features.insert(v, Feature { first: None, last: mark(&last_marks, v), role });
        }
    }
    let [first, last] = frames;
    let corner = [40.0, 40.0];
    Project {
        name: scope.name.clone(),
        frames: FramePair { first: Some(first), last: Some(last) },
        camera: CameraSettings {
            distance_mm: twin.camera.z_prp_mm - twin.camera.z_vp_mm,
            view_plane_z_mm: twin.camera.z_vp_mm,
            principal_point_px: Some([twin.camera.principal_point_px.x, twin.camera.principal_point_px.y]),
        },
        scale: Scale::TwoPoints {
            a_px: corner,
            b_px: [corner[0] + RULER_MM * twin.camera.px_per_mm, corner[1]],
            mm: RULER_MM,
        },
        landmarks: landmarks.collect(),
        features,
        settings: Settings {
            depth: scope.depth,
            unmarked: UnmarkedRule::Inferred { reach_mm: REACH_MM },
            marking_sigma_px: sigma_px,
            ..Settings::default()
        },
        notes: scope.notes.clone(),
        ..Project::default()
    }
}

/// The true forces of a twin, N: those of the project's own springs, all of them, at the true positions. Thesis (4.5).
pub fn true_forces(twin: &Twin, face: &FaceModel, settings: &Settings) -> Vec<Vector3<f64>> {
    let springs = Springs::new(face.mesh(), &twin.first, settings.springs, settings.skin_thickness_mm);
    let mut truth = Vec::new();
    forces::muscle_forces(&springs, &settings.skin, &twin.last, None, &mut truth);
    truth
}

/// ‖F − F_true‖ / ‖F_true‖ over measured vertices all of whose neighbours are measured (or, where `inferred` is set, filled in), and how
/// many those are: the others carry what was guessed or what is missing around them.
pub fn force_error(face: &FaceModel, outcome: &Outcome, truth: &[Vector3<f64>], inferred: bool) -> (usize, f64) {
    let known = |v: u32| match outcome.states[v as usize] {
        VertexState::Inferred => inferred,
        state => state == VertexState::Measured,
    };
    let measured = |v: usize| outcome.states[v] == VertexState::Measured;
    let inside = |v: &usize| measured(*v) && face.mesh().neighbours(*v).iter().all(|n| known(*n));
    let vertices: Vec<usize> = (0..truth.len()).filter(inside).collect();
    let off: f64 = vertices.iter().map(|&v| (outcome.field.force[v] - truth[v]).norm_squared()).sum();
    let all: f64 = vertices.iter().map(|&v| truth[v].norm_squared()).sum();
    (vertices.len(), (off / all).sqrt())
}

/// First and last frame of a scene that is solved and never looked at: there are no files behind them.
pub fn unseen_frames(size_px: u32) -> [FrameRef; 2] {
    ["first.png", "last.png"].map(|name| FrameRef {
        path: name.to_owned(),
        sha256: "0".repeat(64),
        width_px: size_px,
        height_px: size_px,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::pipeline::{self, Workspace};
    use crate::study::TwinSettings;

    fn scene(noise_px: f64) -> (Twin, FaceModel, Project) {
        let settings = TwinSettings { seed: 3, noise_px, ..TwinSettings::default() };
        let person = person(&face::generic(), settings.seed, settings.distance_mm).unwrap();
        let twin = Twin::generate(&person, &settings).unwrap();
        let project = project(&twin, &person, unseen_frames(settings.size_px), noise_px);
        (twin, person, project)
    }

    fn solved(project: &Project) -> Outcome {
        pipeline::solve(project, &face::generic(), [1036, 1036], &mut Workspace::default())
    }

    #[test]
    fn with_marks_at_the_truth_the_chain_finds_the_first_frame_and_the_head() {
        let (twin, _, project) = scene(0.0);
        let outcome = solved(&project);
        let farthest = outcome.first.iter().zip(&twin.first).map(|(a, b)| (a - b).norm()).fold(0.0_f64, f64::max);
        assert!(farthest < 1e-8, "{farthest} mm");
        assert!((outcome.camera.px_per_mm - twin.camera.px_per_mm).abs() < 1e-12);
        assert!(outcome.head.still_points >= 6);
        assert!(project.measured_count() >= 40, "{}", project.measured_count());
    }

    /// The twin slides on the first frame's surface, which is what the depth rule of its project assumes; frozen depth does not.
    #[test]
    fn with_marks_at_the_truth_the_field_is_as_true_as_the_depth_rule() {
        let (twin, person, mut project) = scene(0.0);
        let truth = true_forces(&twin, &person, &project.settings);
        let (inside, slide) = force_error(&person, &solved(&project), &truth, false);
        project.settings.depth = DepthRule::FixedDepth;
        let (_, frozen) = force_error(&person, &solved(&project), &truth, false);
        println!("{inside} vertices: slide {slide:.2e}, frozen {frozen:.2e}");
        assert!(inside >= 50, "{inside}");
        // What is left is the weak prior of the head's motion, which moves points by less than a micrometre.
        assert!(slide < 1e-4, "{slide}");
        assert!(frozen > 10.0 * slide, "{frozen}");
    }

    #[test]
    fn people_differ_and_a_seed_is_always_the_same_person() {
        let generic = face::generic();
        let [a, b, c] = [1, 1, 2].map(|seed| person(&generic, seed, 1000.0).unwrap());
        assert_eq!(a, b);
        assert_ne!(a.mesh().positions(), c.mesh().positions());
        // A person is not symmetric, but whole: one surface, nothing folded over.
        let up = c.mesh().vertex_normals(c.mesh().positions());
        let before = generic.mesh().vertex_normals(generic.mesh().positions());
        assert!(up.iter().zip(&before).all(|(a, b)| a.dot(b) > 0.5));
    }
}
