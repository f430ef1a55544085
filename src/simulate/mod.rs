//! The forward direction: what muscles do to the skin, from the force of each on each vertex to the face that they move.
//!
//! [`region`] walks over the vertices that a muscle reaches and touches no others.

pub mod muscle_force;
pub mod muscle_force_2d;
pub mod region;

pub use muscle_force::{InSurface, MuscleForce, Skin, muscle_force};
pub use muscle_force_2d::{Cylinder, Exception, Unrolled};
pub use region::{Cutoff, Region, Start};
