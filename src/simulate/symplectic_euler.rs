//! Symplectic Euler: the velocity is stepped first, and the place with the new velocity. First order. Thesis (4.13) with the force of the step's start.
//!
//! v' = v + Δt (f(x) − c v) / m,   x' = x + Δt v'
//!
//! Keeps the energy of undamped motions on average; stable for Δt < (√(c² + 4ω²) − c) / ω² with c per mass and the fastest frequency ω.

use super::integrator::Room;
use super::system::{State, System};

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) {
    room.potential = Some(system.accelerations(state, &mut room.forces));
    for ((x, v), a) in state.positions.iter_mut().zip(&mut state.velocities).zip(&room.forces) {
        *v += a * step_s;
        *x += *v * step_s;
    }
    system.settle(state);
}
