//! Explicit Euler: the step is taken along the velocity and the force of its start. First order.
//!
//! x' = x + Δt v,   v' = v + Δt (f(x) − c v) / m
//!
//! Gains energy in every undamped motion; stable only for Δt < c / (m ω²) with the fastest frequency ω.

use super::integrator::Room;
use super::system::{State, System};

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) {
    room.potential = Some(system.accelerations(state, &mut room.forces));
    for ((x, v), a) in state.positions.iter_mut().zip(&mut state.velocities).zip(&room.forces) {
        *x += *v * step_s;
        *v += a * step_s;
    }
    system.settle(state);
}
