//! Implicit Euler: each step is the minimum of an energy, found by Newton's method with a line search. First order.
//!
//! x' = argmin ½ (x − y)ᵀ M (x − y) / Δt² + ½ c |x − x_t|² / Δt + U(x),   y = x_t + Δt v,   v' = (x' − x_t) / Δt
//!
//! Its derivative set to zero is M (x' − y) / Δt² = f(x') − c (x' − x_t) / Δt: the step of Thesis (4.13), (4.14) with every
//! force at the new place. Each iteration lowers that sum, so U' + ½ m |v' − v|² never exceeds ½ m v² + U, whatever the step: it
//! cannot run away. At its minimum the whole energy falls where U is convex, as that of skin with tension at rest is. It takes away motion that is faster than the step. Where the iterations end early (a stiff skin, a long step)
//! the rest is done in the next step.

use nalgebra::{Point3, Vector3};

use super::failure::Cause;
use super::integrator::{Room, Stop};
use super::newton::{Newton, OutOfMemory};
use super::system::{State, System};

/// Newton steps at most in a time step.
const ITERATIONS: usize = 8;
/// Smaller Newton steps end the search, in sizes of the face.
const SMALL: f64 = 1e-4;
/// Halvings of a Newton step before it is given up.
const HALVINGS: usize = 24;
/// Share of the promised descent that is enough (Armijo).
const ENOUGH: f64 = 1e-4;

/// Memory of the minimiser.
#[derive(Debug)]
pub(super) struct Solver {
    newton: Newton,
    pub(super) search: Search,
    forces: Vec<Vector3<f64>>,
    begin: Vec<Point3<f64>>,
    aim: Vec<Point3<f64>>,
}

impl Solver {
    fn new(system: &System) -> Result<Self, OutOfMemory> {
        Ok(Self {
            newton: Newton::new(system)?,
            search: Search::default(),
            forces: Vec::new(),
            begin: Vec::new(),
            aim: Vec::new(),
        })
    }
}

/// Memory of a line search along the surface.
#[derive(Debug, Default)]
pub(super) struct Search {
    pub(super) direction: Vec<Vector3<f64>>,
    trial: Vec<Point3<f64>>,
    /// Length of the last whole step, mm.
    last_mm: Option<f64>,
}

impl Search {
    /// A search from a new place.
    pub(super) fn begin(&mut self) {
        self.last_mm = None;
    }

    /// Whether what is left after a step of this length (mm) and share is less than the tolerance: steps shrink at least as much
    /// from one to the next as they just did.
    pub(super) fn arrived(&mut self, longest_mm: f64, share: f64, tolerance_mm: f64) -> bool {
        let whole = (share == 1.0).then_some(longest_mm);
        let last = std::mem::replace(&mut self.last_mm, whole);
        let left = match (whole, last) {
            (Some(now), Some(last)) if now < 0.1 * last => now * now / last,
            _ => longest_mm * share,
        };
        left < tolerance_mm
    }

    /// Goes along the direction as far as lowers the energy enough; the share of it that was gone, or none. `slope` is the product of
    /// direction and force.
    pub(super) fn descend(
        &mut self,
        system: &System,
        x: &mut Vec<Point3<f64>>,
        before: f64,
        slope: f64,
        energy: impl Fn(&[Point3<f64>]) -> f64,
    ) -> Option<(f64, f64)> {
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            self.trial.clear();
            let places = x.iter().zip(&self.direction).enumerate();
            self.trial.extend(places.map(|(i, (p, d))| system.allowed(i, &(p + d * share))));
            let after = energy(&self.trial);
            if after <= before - ENOUGH * share * slope {
                std::mem::swap(x, &mut self.trial);
                return Some((share, after));
            }
            share *= 0.5;
        }
        None
    }
}

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) -> Result<(), Stop> {
    if room.implicit.is_none() {
        room.implicit = Solver::new(system).ok();
    }
    let Some(Solver { newton, search, forces, begin, aim }) = &mut room.implicit else {
        return Err((0, Cause::NoFactor));
    };
    let per_square = 1.0 / (step_s * step_s);
    let weight = |i: usize| system.inertia[i] * per_square + system.damping(i) / step_s;
    begin.clear();
    begin.extend(state.positions.iter().enumerate().map(|(i, p)| system.allowed(i, p)));
    // The minimum of both quadratic terms together: where the vertex would be without forces.
    aim.clear();
    aim.extend(begin.iter().zip(&state.velocities).enumerate().map(|(i, (p, v))| {
        let share = system.inertia[i] * per_square / weight(i).max(f64::MIN_POSITIVE);
        p + v * (step_s * share)
    }));
    let moved = |x: &[Point3<f64>]| -> f64 {
        let terms = x.iter().zip(aim.iter()).enumerate();
        terms.map(|(i, (x, y))| if system.free[i] { 0.5 * weight(i) * (x - y).norm_squared() } else { 0.0 }).sum()
    };
    state.positions.clone_from(begin);
    let mut energy = system.forces(&state.positions, forces) + moved(&state.positions);
    search.begin();
    for _ in 0..ITERATIONS {
        for (i, f) in forces.iter_mut().enumerate() {
            *f -= (state.positions[i] - aim[i]) * if system.free[i] { weight(i) } else { 0.0 };
        }
        if !newton.direction(system, &state.positions, forces, weight, &mut search.direction) {
            return Err((0, Cause::NoFactor));
        }
        let slope: f64 = search.direction.iter().zip(forces.iter()).map(|(d, f)| d.dot(f)).sum();
        let longest = search.direction.iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
        let total = |x: &[Point3<f64>]| system.potential(x) + moved(x);
        let Some((share, _)) = search.descend(system, &mut state.positions, energy, slope, total) else { break };
        if search.arrived(longest, share, SMALL * system.size_mm()) {
            break;
        }
        energy = system.forces(&state.positions, forces) + moved(&state.positions);
    }
    system.velocities(begin, step_s, state);
    Ok(())
}
