//! Muscle laws: how the force of one muscle spreads over the skin around its fibre.
//!
//! A [`Fibre`] is one muscle on one customised face. A [`MuscleLaw`] says with which share of the muscle's strength each point of
//! the skin is pulled. Force is linear in the strength, so the strength is no parameter of a law:
//!
//! ```text
//! f(x) = s · θ(x; shape parameters) · d(x)       s in N, ‖d‖ = 1
//! ```
//!
//! ```
//! use frontalis::muscle::{Fibre, LawKind, MuscleLaw};
//! use nalgebra::{Point3, Vector3};
//!
//! // A frontalis: from the bone above to the skin of the brow, 50 mm below, in a flat forehead.
//! let fibre = Fibre::new(Point3::new(0., 70., 0.), Point3::new(0., 20., 0.), 13., None, [Vector3::z(); 2])?;
//! let law = MuscleLaw::default_of(LawKind::Anatomical);
//! let at_the_insertion = law.force(&fibre, &fibre.insertion);
//! assert!((at_the_insertion - Vector3::y()).norm() < 1e-12); // 1 N a newton of strength, towards the bone
//! # Ok::<(), frontalis::muscle::FibreError>(())
//! ```

pub mod anatomical;
mod elementary;
pub mod fibre;
pub mod koch;
pub mod law;
pub mod of_face;
pub mod parameter;
pub mod waters_linear;
pub mod waters_sheet;
pub(crate) mod wide;

pub use anatomical::{Anatomical, Lobe, Reading};
pub use fibre::{Fibre, FibreError, Place};
pub use koch::Koch;
pub use law::{LawKind, MuscleLaw, Shape};
pub use of_face::{FibreOf, fibres};
pub use parameter::{LawError, MAX_PARAMETERS, Parameter};
pub use waters_linear::{Direction, WatersLinear};
pub use waters_sheet::WatersSheet;

#[cfg(test)]
mod tests;
