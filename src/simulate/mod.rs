//! The forward model: skin under muscle forces, through time and at rest.
//!
//! A [`System`] is the thesis's mass–spring–damper system (4.9)–(4.12) of one face: springs along the edges, repulsion of corners
//! from their opposite edges, damping, fixed vertices, and what the thesis leaves out: a skull that the skin slides over, without
//! which a mesh of springs has no bending stiffness and turns inside out (`docs/errata.md`). A [`Stepper`] takes it through time by
//! one of six [`Method`]s; an [`EquilibriumSolver`] finds where it comes to rest.
//!
//! ```
//! use frontalis::face;
//! use frontalis::simulate::{EquilibriumSolver, Method, Stepper, System, SystemOptions};
//! use nalgebra::Vector3;
//!
//! let face = face::generic();
//! let mesh = face.mesh();
//! let mut system = System::new(mesh, mesh.positions(), &mesh.on_border(), None, SystemOptions::default())?;
//! let mut loads = vec![Vector3::zeros(); mesh.len()];
//! let brow = face.muscles()[0].insertion as usize;
//! loads[brow] = Vector3::new(0.0, 0.05, 0.0); // N, upwards
//! system.set_loads(loads)?;
//!
//! let rest = EquilibriumSolver::new(&system)?.solve(&system, mesh.positions());
//! let mut state = system.at_rest();
//! let mut stepper = Stepper::new(Method::ImplicitEuler);
//! for _ in 0..120 {
//!     stepper.step(&system, &mut state, 1.0 / 60.0)?;
//! }
//! assert!((state.positions[brow] - rest.positions[brow]).norm() < 1e-3 * (rest.positions[brow] - mesh.positions()[brow]).norm());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod block_cholesky;
pub mod creases;
pub mod energy;
pub mod equilibrium;
pub mod explicit_euler;
pub mod failure;
mod freedoms;
pub mod implicit_euler;
pub mod integrator;
pub mod jaw;
mod line_search;
pub mod membrane_rest;
pub mod muscle_force;
pub mod muscle_force_2d;
mod newton;
pub mod options;
pub mod region;
pub mod repulsion;
pub mod rim;
pub mod runge_kutta;
pub mod skin_at_rest;
pub mod skin_law;
pub mod symplectic_euler;
pub mod system;
pub mod thesis_step;
pub mod vertex_block_descent;

pub use energy::Energy;
pub use equilibrium::{Ended, Equilibrium, EquilibriumSolver, Tangent};
pub use failure::{Cause, Failure};
pub use integrator::{Method, Stepper};
pub use jaw::Jaw;
pub use membrane_rest::{MembraneSolver, MembraneTangent};
pub use muscle_force::{InSurface, MuscleForce, Skin, muscle_force};
pub use muscle_force_2d::{Cylinder, Exception, Unrolled};
pub use newton::OutOfMemory;
pub use options::{Hold, SystemError, SystemOptions};
pub use region::{Cutoff, Region, Start};
pub use repulsion::Repulsion;
pub use rim::rim;
pub use skin_at_rest::{RestError, SkinAtRest};
pub use skin_law::{PowerLaw, SkinLaw};
pub use system::{State, System};

#[cfg(test)]
mod tests;
