//! Frontalis measures the muscle forces of a facial expression from the first and the last frame of a video.
//!
//! # The problem
//!
//! Skin is a sheet of springs. Two frames show where points of it were and where they went; what pulled them there is
//!
//! ```text
//! F = −K(X) X          Thesis (4.5)
//! ```
//!
//! | symbol | what | unit | shape |
//! |---|---|---|---|
//! | X | positions of the vertices in the last frame, head motion removed | mm | n × 3 |
//! | K | α_ij = k_ij (l_ij − ‖x_i − x_j‖) / ‖x_i − x_j‖ off the diagonal with a minus sign, their sums on it | N/mm | n × n, symmetric |
//! | k_ij | secant stiffness of the skin between i and j at its strain | N/mm | – |
//! | l_ij | length of that spring in the first frame | mm | – |
//! | F | the muscles' pull on every vertex | N | n × 3 |
//!
//! # The chain
//!
//! ```text
//! frames ─▶ landmarks ─▶ customize ─▶ feature marks ─▶ displacement ─▶ springs ─▶ F = −K X ─▶ errors
//! (pixels)  (32 points)   (§4.2)       (last frame)     (depth, §4.2)  (skin §5.1)  (§4.1)    (marking error)
//! ```
//!
//! [`pipeline::solve`] runs it, from a [`project::Project`] and a [`face::FaceModel`] to a [`pipeline::Outcome`]:
//!
//! ```
//! use frontalis::{face, pipeline, project::{Edit, PointId, Project}};
//!
//! let face = face::generic();
//! let mut project = Project::default();
//! Edit::Put(PointId::Landmark("nose_tip".into()), [518.0, 640.0]).apply(&mut project)?;
//! let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut pipeline::Workspace::default());
//! assert_eq!(outcome.fit.placed, 1);
//! # Ok::<(), frontalis::project::EditError>(())
//! ```
//!
//! # Conventions
//!
//! * Face space is in millimetres: x to the right of the picture (the person's own left), y up, z towards the camera.
//! * Image space is in pixels: origin at the top-left corner of the top-left pixel (its centre is at 0.5, 0.5), y down.
//! * Transforms are named `a_from_b`. Angles are radians.
//! * Force is in newton, stress in kPa, mass in kg, time in s; any other unit is in the name.
//! * `Thesis (n.m)` names an equation of D. Ağdoğan, *Mathematical Modeling of Human Facial Muscles*, Işık University, 2015.

// The order in which the data flows.
pub mod face;

pub mod camera;

pub mod frames;

pub mod skin;

pub mod draw;

pub mod customize;

pub mod displacement;

pub mod forces;

pub mod marking;

pub mod muscle;

pub mod fit;

pub mod simulate;

pub mod project;

pub mod pipeline;

pub mod expression;

pub mod muscle_field;

pub mod doubt;

pub mod suggest;

pub mod study;

pub mod export;

pub mod import;

pub mod cli;

#[cfg(feature = "gui")]
pub mod gui;
