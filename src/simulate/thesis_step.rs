//! The thesis's own step, Eq. 4.17: springs as scalars times a vector, the own vertex at its new place, its neighbours at their old ones.
//!
//! v' = (m v + Δt [Σ t + Σ g (xᵢ − xⱼ) + Σ h (xᵢ − p)]) / (m + Δt c − Δt² (Σ g + Σ h)),   x' = x + Δt v'    Thesis (4.15)–(4.17)
//!
//! with g = −T/L, the scalar of a spring under the tension T at the length L, and h the same of a repulsion.
//!
//! Differs from the thesis (`docs/errata.md`): Δt stands before all three sums, as (4.16) needs it. It is no implicit method: at
//! rest g = h = 0, which leaves symplectic Euler with implicit damping, and under compression g > 0 makes the denominator small,
//! zero or negative. A step with a denominator below a tenth of m + Δt c is halved; where sixty-four parts do not help it fails.

use nalgebra::Point3;

use super::failure::Cause;
use super::integrator::{Room, Stop};
use super::system::{State, System};

/// Halvings before a step is given up.
const HALVINGS: u32 = 6;
/// Least share of m + Δt c that the denominator may fall to.
const LEAST: f64 = 0.1;

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) -> Result<(), Stop> {
    let mut left = step_s;
    let mut part = step_s;
    while left > 1e-9 * step_s {
        part = part.min(left);
        match once(system, state, part, room) {
            Ok(()) => left -= part,
            Err(_) if part > step_s * 0.75 / f64::from(1_u32 << HALVINGS) => part *= 0.5,
            Err((vertex, value)) => {
                return Err((vertex, Cause::Denominator { value, step_ms: 1e3 * part }));
            }
        }
    }
    Ok(())
}

/// One part of a step; else the vertex with the smallest denominator, and that.
fn once(system: &System, state: &mut State, step_s: f64, room: &mut Room) -> Result<(), (usize, f64)> {
    let potential = system.forces(&state.positions, &mut room.forces);
    room.potential.get_or_insert(potential);
    let scalars = scalars(system, &state.positions);
    let denominator = |i: usize| system.inertia[i] + step_s * system.damping(i) - step_s * step_s * scalars[i];
    let ratio = |i: usize| denominator(i) / (system.inertia[i] + step_s * system.damping(i));
    let free = (0..system.len()).filter(|&i| system.free[i]);
    let worst = free.min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)));
    if let Some(worst) = worst.filter(|&i| ratio(i) < LEAST || ratio(i).is_nan()) {
        return Err((worst, denominator(worst)));
    }
    for i in (0..system.len()).filter(|&i| system.free[i]) {
        let force = system.within(i, &state.positions[i], room.forces[i]);
        let v = (state.velocities[i] * system.inertia[i] + force * step_s) / denominator(i);
        state.velocities[i] = v;
        state.positions[i] += v * step_s;
    }
    system.settle(state);
    Ok(())
}

/// Σ g + Σ h of every vertex, N/mm. Thesis (4.15).
fn scalars(system: &System, x: &[Point3<f64>]) -> Vec<f64> {
    let mut sum = vec![0.0; system.len()];
    for spring in &system.springs {
        let [a, b] = spring.ends.map(|i| i as usize);
        let length = (x[a] - x[b]).norm();
        let [_, tension, _] = system.options.law.at(spring, length, system.options.stiffness);
        if length > 0.0 {
            sum[a] -= tension / length;
            sum[b] -= tension / length;
        }
    }
    if let Some(repulsion) = &system.options.repulsion {
        for wedge in &system.wedges {
            let normal = system.wedge_normal(wedge);
            wedge.pushes(repulsion, System::corners(wedge, x), &normal, |push| {
                if push.height.abs() > 1e-9 {
                    sum[wedge.corners[push.tip] as usize] += push.force / push.height;
                }
            });
        }
    }
    for (i, s) in sum.iter_mut().enumerate() {
        *s -= system.anchor(i).map_or(0.0, |(k, _)| k);
    }
    sum
}
