//! The chain, whole: project and face in, every number out. Takes no pixels and no files, and never fails.
//!
//! ```text
//! landmarks ─▶ customise ─▶ still points ─▶ head motion ─▶ marks ─▶ displacement ─▶ F = −K X ─▶ errors ─▶ muscles
//! ```

mod crumpling;
mod muscles;
pub mod outcome;
pub mod peak;
pub mod samples;
mod stages;
#[cfg(test)]
mod tests;

pub use muscles::{Besides, JawOpen, MuscleForces, Pulling, ShapeParameter, held_by};
pub use outcome::{ForceField, LandmarkFit, Outcome, Smoothing, Warning};
pub use peak::Peak;
pub use samples::Samples;

use nalgebra::{Point2, Point3, Vector3};

use crate::camera::{Camera, HeadMotion};
use crate::customize::{Customized, LandmarkTarget};
use crate::displacement::fill_in::Weights;
use crate::displacement::regularised::Plate;
use crate::displacement::{UnmarkedRule, VertexState};
use crate::face::{FaceModel, Skull};
use crate::forces::{self, Cause, Skin, SkinSpec};
use crate::project::Project;
use crate::project::document::FieldWay;

/// Results of stages kept from the last run, each with what it was made from. Only speed depends on them.
#[derive(Debug, Default)]
pub struct Workspace {
    face: Option<FaceModel>,
    customized: Option<Kept<CustomizeInput, Customized>>,
    /// The smooth surface through the first frame's face, where the depth rule asks for it.
    heights: Option<Kept<Vec<Point3<f64>>, Skull>>,
    skin: Option<Kept<SkinInput, Skin>>,
    fill: Option<Kept<FillInput, Fill>>,
    plate: Option<Kept<PlateInput, Option<Plate>>>,
    muscles: muscles::Ready,
}

impl Workspace {
    /// The skin of the last run.
    pub fn skin(&self) -> Option<&Skin> {
        self.skin.as_ref().map(|kept| &kept.value)
    }
}

#[derive(Debug)]
struct Kept<I, T> {
    from: I,
    value: T,
}

#[derive(Clone, Debug, PartialEq)]
struct CustomizeInput {
    targets: Vec<LandmarkTarget>,
    camera: Camera,
    settings: crate::customize::CustomizeSettings,
}

#[derive(Debug, PartialEq)]
struct SkinInput {
    rest: Vec<Point3<f64>>,
    spec: SkinSpec,
}

#[derive(Debug, PartialEq)]
struct FillInput {
    first: Vec<Point3<f64>>,
    states: Vec<VertexState>,
    rule: UnmarkedRule,
}

#[derive(Debug, PartialEq)]
struct PlateInput {
    first: Vec<Point3<f64>>,
    vertices: Vec<u32>,
    sigma_px: Vec<f64>,
    inferred: Vec<u32>,
}

/// States after inference, and how unmarked vertices follow the others.
#[derive(Debug)]
struct Fill {
    states: Vec<VertexState>,
    inferred: Weights,
    predicted: Weights,
}

/// Runs the chain. `image_size_px` is the size of the first frame (width, height).
pub fn solve(project: &Project, face: &FaceModel, image_size_px: [u32; 2], workspace: &mut Workspace) -> Outcome {
    chain(project, face, image_size_px, workspace, &|| false, None)
}

/// The same, given up where `stop` says so: muscles can take seconds. None where it did.
pub fn solve_unless(
    project: &Project,
    face: &FaceModel,
    image_size_px: [u32; 2],
    workspace: &mut Workspace,
    stop: &dyn Fn() -> bool,
) -> Option<Outcome> {
    let outcome = chain(project, face, image_size_px, workspace, stop, None);
    (!stop()).then_some(outcome)
}

/// The independent causes of the errors of the measured forces, vertex by vertex: Σ over all of |δF_i|² is the square of the standard error
/// ([`Outcome::measured`]), and they tell how errors of different vertices go together.
pub fn error_causes(project: &Project, face: &FaceModel, image_size_px: [u32; 2]) -> Vec<Cause> {
    let mut measured = project.clone();
    measured.settings.field = project.settings.field.measured();
    let mut causes = Vec::new();
    chain(&measured, face, image_size_px, &mut Workspace::default(), &|| false, Some(&mut causes));
    causes
}

fn chain(
    project: &Project,
    face: &FaceModel,
    image_size_px: [u32; 2],
    workspace: &mut Workspace,
    stop: &dyn Fn() -> bool,
    causes: Option<&mut Vec<Cause>>,
) -> Outcome {
    if workspace.face.as_ref() != Some(face) {
        *workspace = Workspace { face: Some(face.clone()), ..Workspace::default() };
    }
    let mesh = face.mesh();
    let settings = &project.settings;
    let mut warnings = Vec::new();

    let (camera, scale_measured) = stages::camera(project, face, image_size_px);
    let (targets, ids) = stages::landmark_targets(project, face, &mut warnings);
    let customized =
        kept(&mut workspace.customized, CustomizeInput { targets, camera, settings: settings.customize }, |input| {
            stages::customized(mesh, input)
        });
    let fit = stages::landmark_fit(face, customized, &ids);
    let first = stages::pinned_in_first_frame(project, mesh, &customized.positions, &camera);
    let first_in_image: Vec<Point2<f64>> = first.iter().map(|x| camera.image_from_face(x)).collect();

    let still = stages::still_points(project, &first);
    let head = if settings.remove_head_motion {
        crate::camera::head_motion::estimate(&camera, &still)
    } else {
        HeadMotion::default()
    };

    let heights = settings.depth.asks_for_heights();
    let heights = heights.then(|| &*kept(&mut workspace.heights, first.clone(), |first| Skull::new(mesh, first)));
    let marked = stages::marked(project, mesh.len(), &mut warnings);
    let measured = stages::place(&marked, &camera, &head.motion, mesh, &first, settings.depth, heights);
    let mut states = stages::known_from_marks(project, mesh.len(), &measured);
    if settings.unmarked == UnmarkedRule::Held {
        for state in states.iter_mut().filter(|s| **s == VertexState::Unmeasured) {
            *state = VertexState::Fixed;
        }
    }
    let fill =
        kept(&mut workspace.fill, FillInput { first: first.clone(), states, rule: settings.unmarked }, |input| {
            stages::fill(mesh, input)
        });
    let smooth = settings.field.weight().and_then(|weight| {
        let input = stages::plate_input(project, mesh, &first, &fill.states, &marked);
        let plate = kept(&mut workspace.plate, input, |input| {
            Plate::new(mesh, &input.first, &input.vertices, &input.sigma_px, &input.inferred)
        });
        plate.as_ref().map(|p| stages::smooth(p, weight, &marked, &fill.states, &first, &camera, &head.motion))
    });
    let (marked, measured) = match &smooth {
        None => (&marked, measured),
        Some(smooth) => (
            &smooth.marked,
            stages::place(&smooth.marked, &camera, &head.motion, mesh, &first, settings.depth, heights),
        ),
    };
    let displaced = stages::displaced(&first, &measured, fill);
    let last_in_image = stages::seen_in_last_frame(&displaced, &camera, &head.motion);
    let last_in_image = if still.is_empty() || head.still_points > 0 || !settings.remove_head_motion {
        last_in_image
    } else {
        // Too few still points to remove the head's motion from data, and enough to predict with: otherwise each would drag
        // the skin around it along, and the third would let every prediction jump.
        let likely = crate::camera::head_motion::most_likely(&camera, &still).motion;
        let measured = stages::place(marked, &camera, &likely, mesh, &first, settings.depth, heights);
        stages::seen_in_last_frame(&stages::displaced(&first, &measured, fill), &camera, &likely)
    };

    let input = SkinInput { rest: first.clone(), spec: settings.skin_spec() };
    let skin = kept(&mut workspace.skin, input, |input| Skin::new(mesh, &input.rest, &input.spec));
    let active: Vec<bool> = fill.states.iter().map(|s| s.is_known()).collect();
    let mut field = force_field(face, skin, &first, &displaced, &active);
    let slopes = skin.slopes(&displaced, &active);
    match &smooth {
        None => {
            let influence = stages::influence(project, &camera, &head, &measured, &first, fill);
            forces::standard_errors(&slopes, &influence, &mut field.sigma);
            if let Some(causes) = causes {
                *causes = forces::causes(&slopes, &influence);
            }
        }
        Some(smooth) => {
            let influence = stages::spread(smooth, &camera, &head, &measured, &first);
            forces::standard_errors_of_spread(&slopes, &influence, &mut field.sigma);
            if let Some(causes) = causes {
                *causes = forces::causes_of_spread(&slopes, &influence);
            }
        }
    }
    let other = stages::place(marked, &camera, &head.motion, mesh, &first, settings.depth.other(), heights);
    let mut other_force = Vec::new();
    let other_displaced = stages::displaced(&first, &other, fill);
    skin.muscle_forces(&other_displaced, &active, &mut other_force);
    field.depth_change = field.force.iter().zip(&other_force).map(|(a, b)| (a - b).norm()).collect();
    field.folded = stages::folded(mesh, &first, &displaced, &fill.states);

    let states = fill.states.clone();
    let mut outcome = Outcome {
        scale_measured,
        border: stages::border(mesh, &states),
        camera,
        fit,
        first,
        first_in_image,
        head,
        states,
        last: displaced,
        last_in_image,
        field,
        smoothing: smooth.as_ref().map(|s| Smoothing {
            weighed: s.smoothed.weighed,
            curve: s.curve.clone(),
            marks: s.marks,
        }),
        muscles: None,
        warnings,
    };
    if let FieldWay::Muscles(way) = settings.field {
        // Skin that nobody has touched has nothing to explain.
        let marks = outcome.states.contains(&VertexState::Measured);
        let input = workspace.customized.as_ref().filter(|_| marks).map(|kept| &kept.from);
        let tried =
            input.map(|input| muscles::explain(project, face, &mut outcome, way, input, &mut workspace.muscles, stop));
        if let Some(Err(why)) = tried {
            outcome.warnings.push(Warning::NoMuscle { why });
        }
    }
    stages::warn(project, &mut outcome, mesh);
    if let Some(k) = &workspace.customized {
        crumpling::warn(face, &k.from, &k.value, &mut outcome.warnings);
    }
    outcome
}

fn force_field(
    face: &FaceModel,
    skin: &Skin,
    first: &[Point3<f64>],
    last: &[Point3<f64>],
    active: &[bool],
) -> ForceField {
    let mut force = Vec::new();
    skin.muscle_forces(last, active, &mut force);
    let normals = face.mesh().vertex_normals(first);
    let (in_surface, normal) = forces::split(&force, &normals);
    let strain: Vec<Option<f64>> = forces::strains(skin.springs(), last)
        .into_iter()
        .zip(skin.springs().edges())
        .map(|(e, &[a, b])| (active[a as usize] && active[b as usize]).then_some(e))
        .collect();
    let outside_table = skin.outside_table(last, active);
    ForceField {
        internal_sum: forces::internal_sum(&force),
        tangential: in_surface.iter().map(Vector3::norm).collect(),
        normal,
        strain,
        outside_table,
        force,
        ..ForceField::default()
    }
}

/// What was made last time from the same input, or made anew.
fn kept<I: PartialEq, T>(slot: &mut Option<Kept<I, T>>, from: I, make: impl FnOnce(&I) -> T) -> &mut T {
    let same = slot.take().filter(|k| k.from == from);
    let kept = same.unwrap_or_else(|| {
        let value = make(&from);
        Kept { from, value }
    });
    &mut slot.insert(kept).value
}
