//! The classical Runge–Kutta method: four forces a step. Fourth order where the forces are smooth.
//!
//! Stable for Δt < 2.78 / ω with the fastest frequency ω; takes a little energy away below that, gains it above.

use nalgebra::Vector3;

use super::integrator::Room;
use super::system::{State, System};

/// Memory of the four stages.
#[derive(Debug, Default)]
pub(super) struct Stages {
    at: State,
    places: Vec<Vector3<f64>>,
    velocities: Vec<Vector3<f64>>,
}

/// Weight of each stage in the mean, times 6, and how far the next one is taken, in steps.
const STAGES: [(f64, f64); 4] = [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)];

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) {
    let Room { forces, runge_kutta: stages, potential, .. } = room;
    stages.at.clone_from(state);
    for sum in [&mut stages.places, &mut stages.velocities] {
        sum.clear();
        sum.resize(system.len(), Vector3::zeros());
    }
    for (weight, next) in STAGES {
        let energy = system.accelerations(&stages.at, forces);
        potential.get_or_insert(energy);
        for (i, a) in forces.iter().enumerate() {
            let v = stages.at.velocities[i];
            stages.places[i] += v * weight;
            stages.velocities[i] += a * weight;
            stages.at.positions[i] = state.positions[i] + v * (next * step_s);
            stages.at.velocities[i] = state.velocities[i] + a * (next * step_s);
        }
        // A stage lies on the surface too: its forces are those of skin that slid there.
        system.settle(&mut stages.at);
    }
    for i in 0..system.len() {
        state.positions[i] += stages.places[i] * (step_s / 6.0);
        state.velocities[i] += stages.velocities[i] * (step_s / 6.0);
    }
    system.settle(state);
}
