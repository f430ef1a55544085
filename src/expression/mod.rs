//! Expressions: what the muscles of a face do together, from action units to loads on the skin.
//!
//! An [`Actuator`] is whatever can be tightened on its own: a muscle of the face model, a sphincter, the lifter of an upper lid. The
//! [`Actuators`] of a face hold their loads at full strength in newton, the jaw, and what is held still; an [`Expression`] says how
//! much of each is used. Loads are linear in the activations, so a slider costs a sum.
//!
//! ```
//! use frontalis::expression::{Actuators, Basic, Expression};
//! use frontalis::face;
//! use frontalis::muscle::{LawKind, MuscleLaw};
//!
//! let face = face::generic();
//! let law = MuscleLaw::default_of(LawKind::Anatomical);
//! let actuators = Actuators::of(&face, face.mesh().positions(), &law, Default::default())?;
//! let surprise = Expression::basic(Basic::Surprise, &actuators);
//! let loads = actuators.loads(&surprise);
//! assert!(loads.unknown.is_empty());
//! let brow = face.muscles()[0].insertion as usize;
//! assert!(loads.newton[brow].y > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod action_unit;
pub mod actuator;
pub mod held;
pub mod jaw;
pub mod openings;
pub mod places;
pub mod player;
pub mod preset;
pub mod refined;
pub mod ring;
pub mod shown;
pub mod stage;
pub mod strength;
pub mod tissue;
pub mod tractions;

pub use action_unit::{Basic, Dose};
pub use actuator::{Actuator, ActuatorError, ActuatorSettings, Actuators, Kind, Loads};
pub use held::held;
pub use player::{Player, Sample};
pub use preset::{Expression, ExpressionError, ExpressionFileError};
pub use refined::{RefineError, Refined};
pub use shown::Shown;
pub use stage::{Holding, Setup, Stage, StageError};
pub use strength::Evidence;
pub use tractions::TractionMesh;

#[cfg(test)]
mod tests;
