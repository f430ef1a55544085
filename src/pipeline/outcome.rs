//! What the chain makes of a project: every number that the window draws and the files hold.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3, Vector3};

use crate::camera::{Camera, HeadMotion};
use crate::displacement::VertexState;
use crate::displacement::regularised::Weighed;
use crate::face::FaceModel;
use crate::project::{PointId, Project};

use super::MuscleForces;

/// The result of the whole chain for one project. Every list over vertices has one item a vertex of the face.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The camera used, with its scale.
    pub camera: Camera,
    /// Whether the scale was measured: forces are then in newton, otherwise *relative*.
    pub scale_measured: bool,
    /// How the generic face was fitted.
    pub fit: LandmarkFit,
    /// Positions in the first frame, mm (customised, and moved by the hand's first-frame marks).
    pub first: Vec<Point3<f64>>,
    /// The same in the first frame's picture, px.
    pub first_in_image: Vec<Point2<f64>>,
    /// What the still points say.
    pub head: HeadMotion,
    /// What is known of each vertex in the last frame.
    pub states: Vec<VertexState>,
    /// Vertices whose force carries a reaction: measured and inferred ones with a neighbour of which nothing is known, and in a field of muscles known
    /// ones that a bone holds.
    pub border: Vec<bool>,
    /// Positions in the last frame with the head's motion removed, mm. Of unmeasured vertices this is a prediction to draw, never data.
    pub last: Vec<Point3<f64>>,
    /// The same in the last frame's picture (head motion put back), px. For unmarked vertices: the predicted place of the point.
    pub last_in_image: Vec<Point2<f64>>,
    /// The force field.
    pub field: ForceField,
    /// How smooth the motion was made; absent where the marks were taken as they are.
    pub smoothing: Option<Smoothing>,
    /// The muscles whose forces the field is; absent where it is measured.
    pub muscles: Option<MuscleForces>,
    /// What the user should know, gravest first.
    pub warnings: Vec<Warning>,
}

/// How smooth the motion of the skin was made. [`crate::displacement::regularised`].
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothing {
    /// The weight taken.
    pub weighed: Weighed,
    /// The L-curve: what other weights would do.
    pub curve: Vec<Weighed>,
    /// Marks, and fixed vertices beside them, whose motion was made smooth.
    pub marks: usize,
}

/// The fit of the landmarks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkFit {
    /// Number of landmarks placed.
    pub placed: usize,
    /// Number of landmarks that the face has.
    pub of: usize,
    /// Distance of each placed landmark (id) from its mark after alignment and scaling, before the morph, px.
    pub residuals_before_px: Vec<(String, f64)>,
    /// Root mean square of those, px.
    pub rms_before_px: f64,
    /// Root mean square after the morph, px: rounding error, or something is wrong.
    pub rms_after_px: f64,
    /// Scale of the generic face along x, y, z.
    pub scale: [f64; 3],
    /// Triangles that the fit turned over.
    pub folded: Vec<u32>,
}

/// Forces on every vertex, N (or relative): the muscles' pull, F = −K X. Thesis (4.5).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForceField {
    /// Force of the muscles on each vertex; zero, and not to be used, where the vertex is unmeasured.
    pub force: Vec<Vector3<f64>>,
    /// Standard error of each force: root mean square length of its error vector for the stated marking error.
    pub sigma: Vec<f64>,
    /// Component along the outward normal of the first frame's surface.
    pub normal: Vec<f64>,
    /// Length of the part in the surface.
    pub tangential: Vec<f64>,
    /// How far the force moves when the other depth rule is taken: what one camera cannot see. None of it in the field of muscles, which
    /// asks for no depth.
    pub depth_change: Vec<f64>,
    /// Sum of the internal forces over the mesh: zero but for rounding, the self-check.
    pub internal_sum: Vector3<f64>,
    /// Vertices that touch skin strained beyond its table.
    pub outside_table: Vec<bool>,
    /// Strain of every edge of the mesh; absent where an end is unmeasured.
    pub strain: Vec<Option<f64>>,
    /// Triangles of the last frame that lie upside down.
    pub folded: Vec<u32>,
}

/// Something the user should know. `Display` is the sentence to show.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Warning {
    /// No scale was given.
    #[error(
        "No scale is set: forces are relative. Set two points a known distance apart, the grid's pitch, or the eye corners' distance."
    )]
    RelativeScale,
    /// Landmarks are missing.
    #[error("{placed} of {of} landmarks are placed: the wireframe follows only those.")]
    LandmarksMissing {
        /// Placed.
        placed: usize,
        /// All.
        of: usize,
    },
    /// Nothing was removed.
    #[error("{found} still points are marked; {needed} are needed to remove the head's motion. Forces include it.")]
    HeadMotionNotRemoved {
        /// Marked.
        found: usize,
        /// Needed.
        needed: usize,
    },
    /// The still points disagree by more than the marks move.
    #[error(
        "The noise floor of the still points ({noise_px:.2} px) is larger than the expression ({motion_px:.2} px)."
    )]
    NoiseAboveMotion {
        /// Noise floor.
        noise_px: f64,
        /// Root mean square motion of the measured points.
        motion_px: f64,
    },
    /// Triangles turned over.
    #[error(
        "{count} triangles of the {frame} frame are folded, the first at vertex {vertex}: check the marks around it."
    )]
    Folded {
        /// Number of triangles.
        count: usize,
        /// "first" or "last".
        frame: &'static str,
        /// A vertex of the first of them.
        vertex: u32,
    },
    /// Two landmarks have each other's marks.
    #[error("The marks of {} and {} seem swapped: each lies where the other is expected.", .names[0], .names[1])]
    Swapped {
        /// The landmarks.
        ids: [String; 2],
        /// Their names for people.
        names: [String; 2],
    },
    /// A landmark's mark turns triangles over.
    #[error("The mark of {name} folds the wireframe of the first frame ({count} triangles lie upside down): check it.")]
    Crumpled {
        /// Number of triangles folded.
        count: usize,
        /// The landmark to blame.
        id: String,
        /// Its name for people.
        name: String,
    },
    /// A landmark's mark lies far from where all the others put it.
    #[error("The mark of {name} lies {off_mm:.0} mm from where the other landmarks put it: check it.")]
    Misplaced {
        /// The landmark.
        id: String,
        /// Its name for people.
        name: String,
        /// How far, mm.
        off_mm: f64,
    },
    /// Strains beyond the table.
    #[error("{count} vertices touch skin strained beyond its table: their forces are extrapolated.")]
    OutsideTable {
        /// Number of vertices.
        count: usize,
    },
    /// Marks on vertices or landmarks that the face does not have.
    #[error("{what} is not part of this face and was left out.")]
    NotInFace {
        /// The mark.
        what: String,
    },
    /// Marks lie where there is no picture.
    #[error("{}", outside_picture(*.count, .first))]
    OutsidePicture {
        /// Number of marks.
        count: usize,
        /// The first of them.
        first: PointId,
    },
    /// The forces shown are those of muscles, and these leave more of the motion than marks err.
    #[error(
        "The muscles leave the points {left_px:.1} px off, {misfit:.1} times what marks, head and landmarks err by: {}.",
        not_all(*.besides)
    )]
    MusclesExplainLittle {
        /// Root mean square distance of the points from where the muscles take them, px.
        left_px: f64,
        /// The same over what the marks, the head's motion and the landmarks are said to err by.
        misfit: f64,
        /// Share of all that pulls that is none of theirs, 0 to 1, where that was asked for.
        besides: Option<f64>,
    },
    /// What pulls besides the muscles was asked for, and is not in the field.
    #[error("What the muscles leave is not in the field, which is theirs alone: {why}.")]
    NothingBesides {
        /// Why.
        why: &'static str,
    },
    /// There is no field of muscles.
    #[error("The field is the measured one, not that of muscles: {why}.")]
    NoMuscle {
        /// Why.
        why: String,
    },
    /// The marking error swamps the force.
    #[error(
        "At {sigma_px} px of marking error the median force is {ratio:.1} times its standard error: read the field with its ± only."
    )]
    NoisyField {
        /// The project's marking error.
        sigma_px: f64,
        /// Median of force / standard error.
        ratio: f64,
    },
}

fn not_all(besides: Option<f64>) -> String {
    besides.map_or("they are not all that moved the skin, so read their field as theirs alone".to_owned(), |share| {
        format!("{:.0} % of the field is pulls besides theirs", 100.0 * share)
    })
}

fn outside_picture(count: usize, first: &PointId) -> String {
    if count == 1 {
        return format!("One mark lies outside its picture, that of {first}.");
    }
    format!("{count} marks lie outside their picture, the first that of {first}: they seem to be of other frames.")
}

impl ForceField {
    /// Length of each force, absent where nothing is known of the vertex.
    pub fn magnitude(&self, states: &[VertexState]) -> Vec<Option<f64>> {
        self.force.iter().zip(states).map(|(f, s)| s.is_known().then(|| f.norm())).collect()
    }

    /// The vertex with the largest force of all measured and inferred ones, believed or not, and that force. What there is to say of
    /// the field is [`Outcome::peak`].
    pub fn largest(&self, states: &[VertexState]) -> Option<(usize, f64)> {
        self.force
            .iter()
            .zip(states)
            .enumerate()
            .filter(|(_, (_, s))| **s == VertexState::Measured || **s == VertexState::Inferred)
            .map(|(v, (f, _))| (v, f.norm()))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Outcome {
    /// The measured forces and their standard errors, N or relative: what muscles are found from, whatever way the field goes.
    pub fn measured(&self) -> (&[Vector3<f64>], &[f64]) {
        match &self.muscles {
            None => (&self.field.force, &self.field.sigma),
            Some(found) => (&found.measured, &found.measured_sigma),
        }
    }

    /// The middle between the inner eye corners in the first frame, mm: from there people measure a face. Positions of the chain are
    /// measured from the optical axis instead, as the projection wants them. Absent for a face without those two landmarks.
    pub fn eye_midpoint(&self, face: &FaceModel) -> Option<Point3<f64>> {
        let at = |id: &str| face.landmark(id).and_then(|l| self.first.get(l.vertex as usize));
        let [left, right] = super::stages::EYE_CORNERS.map(at);
        Some(nalgebra::center(left?, right?))
    }

    /// Positions in the first frame as people read them, mm: from the middle between the inner eye corners
    /// ([`Outcome::eye_midpoint`]), or from the optical axis where there is none.
    pub fn first_from_eyes(&self, face: &FaceModel) -> Vec<Point3<f64>> {
        let origin = self.eye_midpoint(face).unwrap_or_else(Point3::origin).coords;
        self.first.iter().map(|x| x - origin).collect()
    }

    /// Length of each force, absent where nothing is known of the vertex and on the border, which carries the reaction of skin
    /// that nobody measured: a wall of it would hide the forces behind.
    pub fn magnitude_inside_border(&self) -> Vec<Option<f64>> {
        let mut values = self.field.magnitude(&self.states);
        for (value, border) in values.iter_mut().zip(&self.border) {
            *value = value.filter(|_| !border);
        }
        values
    }

    /// How far each marked still point lies from where the head's motion puts it, px, by vertex; none where no motion was removed.
    pub fn still_residuals_px(&self, project: &Project) -> BTreeMap<u32, f64> {
        let vertices = super::stages::still_marks(project, self.first.len()).map(|(v, _)| v as u32);
        if self.head.still_points == 0 {
            return BTreeMap::new();
        }
        vertices.zip(self.head.residuals_px.iter().copied()).collect()
    }

    /// What the noise floor is worth in force: the median standard error of the forces that speak for the field if every mark erred by
    /// what the still points scatter, N or relative. Errors of forces grow in proportion to those of marks. Absent without a noise floor,
    /// without forces, and where no marking error is stated.
    pub fn noise_floor_force(&self, marking_sigma_px: f64) -> Option<f64> {
        let speaks = self.speaks();
        let mut sigmas: Vec<f64> =
            self.field.sigma.iter().zip(&speaks).filter(|(_, speaks)| **speaks).map(|(s, _)| *s).collect();
        sigmas.sort_unstable_by(f64::total_cmp);
        let median = sigmas.get(sigmas.len() / 2)?;
        (marking_sigma_px > 0.0).then_some(median * self.head.noise_floor_px? / marking_sigma_px)
    }

    /// "N" or "relative".
    pub fn unit(&self) -> &'static str {
        if self.scale_measured { "N" } else { "relative" }
    }
}
