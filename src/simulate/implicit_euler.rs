//! Implicit Euler: each step is the minimum of an energy, found by Newton's method with a line search. First order.
//!
//! x' = argmin ½ (x − y)ᵀ M (x − y) / Δt² + ½ c |x − x_t|² / Δt + U(x),   y = x_t + Δt v,   v' = (x' − x_t) / Δt
//!
//! Its derivative set to zero is M (x' − y) / Δt² = f(x') − c (x' − x_t) / Δt: the step of Thesis (4.13), (4.14) with every
//! force at the new place. Each iteration lowers that sum, so U' + ½ m |v' − v|² never exceeds ½ m v² + U, whatever the step: it
//! cannot run away. At its minimum the whole energy falls where U is convex, as that of skin with tension at rest is. It takes away
//! motion that is faster than the step. Where the iterations end early (a stiff skin, a long step) the rest is done in the next
//! step. Where a bone has moved, the search begins with the skin carried along by it, if that lies lower.

use nalgebra::Point3;

use super::energy::Pulls;
use super::failure::Cause;
use super::integrator::{Room, Stop};
use super::line_search::Search;
use super::newton::{Newton, OutOfMemory};
use super::system::{State, System};

/// Newton steps at most in a time step.
const ITERATIONS: usize = 8;
/// Smaller Newton steps end the search, in sizes of the face.
const SMALL: f64 = 3e-4;
/// Newton steps that are shorter are not gone, in sizes of the face.
const NOTHING: f64 = 1e-8;
/// A direction of the factor of an earlier time that is longer is not believed, in sizes of the face.
const NEAR: f64 = 0.01;

/// Memory of the minimiser.
#[derive(Debug)]
pub(super) struct Solver {
    newton: Newton,
    pub(super) search: Search,
    pulls: Pulls,
    begin: Vec<Point3<f64>>,
    aim: Vec<Point3<f64>>,
    /// Where the bones carried the skin that was there.
    carried: Vec<Point3<f64>>,
    /// The jaw's angle in the step before, rad.
    jaw_rad: f64,
    /// The step that the factor was made for, s; none where there is no factor.
    factored_s: Option<f64>,
}

impl Solver {
    fn new(system: &System) -> Result<Self, OutOfMemory> {
        Ok(Self {
            newton: Newton::new(system)?,
            search: Search::default(),
            pulls: Pulls::default(),
            begin: Vec::new(),
            aim: Vec::new(),
            carried: Vec::new(),
            jaw_rad: 0.0,
            factored_s: None,
        })
    }
}

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) -> Result<(), Stop> {
    if room.implicit.is_none() {
        room.implicit = Solver::new(system).ok();
    }
    let Some(Solver { newton, search, pulls, begin, aim, carried, jaw_rad, factored_s }) = &mut room.implicit else {
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
    // The energy that is lowered, and its forces, at some places.
    let evaluate = |x: &[Point3<f64>], pulls: &mut Pulls| -> f64 {
        let mut energy = system.pulls(x, pulls);
        for (i, f) in pulls.forces.iter_mut().enumerate().filter(|(i, _)| system.free[*i]) {
            let (away, k) = (x[i] - aim[i], weight(i));
            energy += 0.5 * k * away.norm_squared();
            *f -= away * k;
        }
        energy
    };
    // Skin that goes with a bone is nearer to where it will be than skin that is left behind by it.
    let before_rad = std::mem::replace(jaw_rad, system.jaw_rad());
    carried.clear();
    if let Some(bones) = system.carried_since(before_rad) {
        carried.extend(state.positions.iter().enumerate().map(|(i, p)| system.allowed(i, &bones.place(i, p))));
    }
    state.positions.clone_from(begin);
    let mut energy = evaluate(&state.positions, pulls);
    if !carried.is_empty() {
        let there = evaluate(carried, pulls);
        if there < energy {
            energy = there;
            state.positions.clone_from(carried);
        } else {
            evaluate(&state.positions, pulls);
        }
    }
    // Skin that moves little from one step to the next is met by the factor of the step before.
    let mut keeps = *factored_s == Some(step_s) && !search.is_worn();
    search.begin();
    for _ in 0..ITERATIONS {
        let kept = std::mem::take(&mut keeps);
        if kept {
            newton.keep(system, &state.positions);
        }
        let ready = kept || newton.factorize(system, &state.positions, pulls, weight);
        *factored_s = Some(step_s);
        if !(ready && newton.direction(&pulls.forces, &mut search.direction)) {
            *factored_s = None;
            return Err((0, Cause::NoFactor));
        }
        let (slope, longest) = (search.slope(&pulls.forces), search.longest_mm());
        // So little that rounding hides what it gains.
        if longest < NOTHING * system.size_mm() {
            break;
        }
        if kept && longest > NEAR * system.size_mm() {
            continue;
        }
        newton.bends(&search.direction, &mut search.bend);
        let found = search.descend(system, &mut state.positions, energy, slope, |x| evaluate(x, pulls));
        let Some((share, after)) = found else {
            if !kept {
                break;
            }
            energy = evaluate(&state.positions, pulls);
            continue;
        };
        energy = after;
        if search.arrived(longest, share, SMALL * system.size_mm(), kept) {
            break;
        }
    }
    system.velocities(begin, step_s, state);
    Ok(())
}
