//! Vertex block descent: implicit Euler's energy lowered one vertex at a time, with a 3 × 3 matrix each. Source: Chen, Liu, Yang and Yuksel 2024 (arXiv 2403.06321).
//!
//! Hᵢ dᵢ = fᵢ,   Hᵢ = (m / Δt² + c / Δt) I + Σ k d dᵀ + max(0, T/L) (I − d dᵀ) + Σ r' ∇s ∇sᵀ
//!
//! It is what (4.17) wants to be: the own vertex at its new place, its neighbours at their newest ones, with the spring's matrix
//! where the thesis has a scalar. A vertex that would gain energy is stepped half as far, so the sum never grows, whatever
//! the step. Stiff skin needs more sweeps than are made: it then lags behind, and arrives in later steps. Vertices of one colour
//! share no triangle and are stepped side by side.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use super::integrator::Room;
use super::system::{State, System};
use crate::forces::springs::positive_stiffness;

/// Sweeps over all vertices in a time step.
const SWEEPS: usize = 12;
/// Sweeps end when no vertex moves further, in sizes of the face.
const SMALL: f64 = 1e-7;
/// Halvings of a vertex's step before it stays.
const HALVINGS: usize = 10;
/// Fewer vertices of a colour are stepped on one core: threads cost more than they bring.
const WORTH_THREADS: usize = 2000;

/// Free vertices in groups that share no spring and no triangle.
#[derive(Debug)]
pub(super) struct Colours {
    groups: Vec<Vec<u32>>,
    begin: Vec<Point3<f64>>,
    aim: Vec<Point3<f64>>,
    weight: Vec<f64>,
}

impl Colours {
    fn of(system: &System) -> Self {
        let mut colour = vec![usize::MAX; system.len()];
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for i in (0..system.len()).filter(|&i| system.free[i]) {
            let beside = system.springs_of(i).iter().flat_map(|s| system.springs[*s as usize].ends);
            let taken: Vec<usize> = beside.map(|j| colour[j as usize]).collect();
            let first = (0..taken.len()).find(|c| !taken.contains(c)).unwrap_or(taken.len());
            colour[i] = first;
            if groups.len() <= first {
                groups.resize(first + 1, Vec::new());
            }
            groups[first].push(i as u32);
        }
        Self { groups, begin: Vec::new(), aim: Vec::new(), weight: Vec::new() }
    }
}

pub(super) fn step(system: &System, state: &mut State, step_s: f64, room: &mut Room) {
    let Colours { groups, begin, aim, weight } = room.descent.get_or_insert_with(|| Colours::of(system));
    let per_square = 1.0 / (step_s * step_s);
    weight.clear();
    weight.extend((0..system.len()).map(|i| system.inertia[i] * per_square + system.damping(i) / step_s));
    begin.clear();
    begin.extend(state.positions.iter().enumerate().map(|(i, p)| system.allowed(i, p)));
    aim.clear();
    aim.extend((0..system.len()).map(|i| {
        let share = system.inertia[i] * per_square / weight[i].max(f64::MIN_POSITIVE);
        begin[i] + state.velocities[i] * (step_s * share)
    }));
    state.positions.clone_from(begin);
    for _ in 0..SWEEPS {
        let mut furthest = 0.0_f64;
        for group in groups.iter() {
            let x = &state.positions;
            let one = |&i: &u32| {
                let place = descend(system, x, i as usize, weight[i as usize], &aim[i as usize]);
                (i, place)
            };
            let stepped: Vec<(u32, Point3<f64>)> = if group.len() >= WORTH_THREADS {
                group.par_iter().map(one).collect()
            } else {
                group.iter().map(one).collect()
            };
            for (i, place) in stepped {
                furthest = furthest.max((place - state.positions[i as usize]).norm_squared());
                state.positions[i as usize] = place;
            }
        }
        if furthest.sqrt() < SMALL * system.size_mm() {
            break;
        }
    }
    system.velocities(begin, step_s, state);
}

/// Where a vertex goes while all others stay.
fn descend(system: &System, x: &[Point3<f64>], i: usize, weight: f64, aim: &Point3<f64>) -> Point3<f64> {
    let at = &x[i];
    let (before, force, stiffness) = local(system, x, i, at, weight, aim);
    let direction = match system.normal(i, at) {
        Some(normal) => {
            // The normal is stiffened so that what is left of the step lies within the surface.
            let across = normal * normal.transpose();
            let within = Matrix3::identity() - across;
            let h = within * stiffness * within + across * (stiffness.trace() + weight);
            h.cholesky().map(|c| c.solve(&(within * force)))
        }
        None => stiffness.cholesky().map(|c| c.solve(&force)),
    };
    let Some(direction) = direction.filter(|d| d.iter().all(|c| c.is_finite())) else { return *at };
    let slope = direction.dot(&force);
    let mut share = 1.0;
    for _ in 0..HALVINGS {
        let place = system.allowed(i, &(at + direction * share));
        if local_energy(system, x, i, &place, weight, aim) <= before - 1e-4 * share * slope {
            return place;
        }
        share *= 0.5;
    }
    *at
}

/// Energy, force and stiffness of what touches one vertex.
fn local(
    system: &System,
    x: &[Point3<f64>],
    i: usize,
    at: &Point3<f64>,
    weight: f64,
    aim: &Point3<f64>,
) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let scale = system.options.stiffness;
    let load = system.given(i);
    let mut energy = 0.5 * weight * (at - aim).norm_squared() - load.dot(&(at - system.rest[i]));
    let mut force = load - (at - aim) * weight;
    let mut stiffness = Matrix3::from_diagonal_element(weight);
    for &s in system.springs_of(i) {
        let spring = &system.springs[s as usize];
        let other = spring.ends[usize::from(spring.ends[0] as usize == i)] as usize;
        let along = at - x[other];
        let length = along.norm();
        let [u, tension, slope] = system.options.law.at(spring, length, scale);
        energy += u;
        if length > 0.0 {
            force -= along * (tension / length);
        }
        let [sideways, lengthways] = positive_stiffness([u, tension, slope], system.toes[s as usize], length);
        stiffness += along * along.transpose() * lengthways + Matrix3::from_diagonal_element(sideways);
    }
    if let Some(repulsion) = &system.options.repulsion {
        for &w in system.wedges_of(i) {
            let wedge = &system.wedges[w as usize];
            let own = wedge.corners.map(|c| c as usize == i);
            let normal = system.wedge_normal(wedge);
            wedge.pushes(repulsion, System::corners(wedge, x), &normal, |push| {
                energy += push.energy;
                for (g, _) in push.gradient.iter().zip(own).filter(|(_, own)| *own) {
                    force += g * push.force;
                    stiffness += g * push.slope * g.transpose();
                }
            });
        }
    }
    if let Some((k, place)) = system.anchor(i) {
        energy += 0.5 * k * (at - place).norm_squared();
        force -= (at - place) * k;
        stiffness += Matrix3::from_diagonal_element(k);
    }
    (energy, force, stiffness)
}

/// The energy of what touches one vertex, were it at `at`.
fn local_energy(system: &System, x: &[Point3<f64>], i: usize, at: &Point3<f64>, weight: f64, aim: &Point3<f64>) -> f64 {
    let scale = system.options.stiffness;
    let mut energy = 0.5 * weight * (at - aim).norm_squared() - system.given(i).dot(&(at - system.rest[i]));
    for &s in system.springs_of(i) {
        let spring = &system.springs[s as usize];
        let other = spring.ends[usize::from(spring.ends[0] as usize == i)] as usize;
        energy += system.options.law.at(spring, (at - x[other]).norm(), scale)[0];
    }
    if let Some(repulsion) = &system.options.repulsion {
        for &w in system.wedges_of(i) {
            let wedge = &system.wedges[w as usize];
            let corners = wedge.corners.map(|c| if c as usize == i { *at } else { x[c as usize] });
            wedge.pushes(repulsion, corners, &system.wedge_normal(wedge), |push| energy += push.energy);
        }
    }
    if let Some((k, place)) = system.anchor(i) {
        energy += 0.5 * k * (at - place).norm_squared();
    }
    energy
}
