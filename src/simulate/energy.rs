//! Forces on the skin and the energies behind them.

use nalgebra::{Point3, Vector3};

use super::system::{State, System};
use crate::forces::springs::positive_stiffness;

/// What the parts of the total energy are, mJ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// ½ m v².
    pub kinetic: f64,
    /// In stretched and pressed skin, in repulsion and anchors.
    pub elastic: f64,
    /// −Σ f·(x − x₀) of the muscles' loads and of what balances the pre-tension: what they have left to give.
    pub loads: f64,
}

impl Energy {
    /// The sum, which only damping may change, and only downwards.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.loads
    }
}

/// What pulls on the vertices at some places.
#[derive(Debug, Default)]
pub(super) struct Pulls {
    /// The force on every vertex but damping, N.
    pub(super) forces: Vec<Vector3<f64>>,
    /// Every spring's [`positive_stiffness`].
    pub(super) springs: Vec<[f64; 2]>,
}

impl System {
    /// Potential energy (mJ) and the force on every vertex (N) but damping; what holds the skin to the skull is not among them.
    pub fn forces(&self, x: &[Point3<f64>], out: &mut Vec<Vector3<f64>>) -> f64 {
        self.forces_and(x, out, |_, _, _| {})
    }

    /// The same, with every spring's answers for the stiffness matrix.
    pub(super) fn pulls(&self, x: &[Point3<f64>], out: &mut Pulls) -> f64 {
        let Pulls { forces, springs } = out;
        springs.clear();
        self.forces_and(x, forces, |e, answer, length| springs.push(positive_stiffness(answer, self.toes[e], length)))
    }

    /// The same; `told` hears of every spring its number, what it answers, and its length (mm).
    #[inline]
    fn forces_and(
        &self,
        x: &[Point3<f64>],
        out: &mut Vec<Vector3<f64>>,
        mut told: impl FnMut(usize, [f64; 3], f64),
    ) -> f64 {
        out.clear();
        out.extend((0..self.len()).map(|i| self.given(i)));
        let mut energy = -self.work_of_loads(x);
        let scale = self.options.stiffness;
        for (e, spring) in self.springs.iter().enumerate() {
            let [a, b] = spring.ends.map(|i| i as usize);
            let along = x[a] - x[b];
            let length = along.norm();
            let answer @ [u, tension, _] = self.options.law.at(spring, length, scale);
            told(e, answer, length);
            energy += u;
            if length > 0.0 {
                let f = along * (tension / length);
                out[a] -= f;
                out[b] += f;
            }
        }
        if let Some(repulsion) = &self.options.repulsion {
            for wedge in &self.wedges {
                wedge.pushes(repulsion, Self::corners(wedge, x), &self.wedge_normal(wedge), |push| {
                    energy += push.energy;
                    for (i, g) in wedge.corners.iter().zip(push.gradient) {
                        out[*i as usize] += g * push.force;
                    }
                });
            }
        }
        for (i, f) in out.iter_mut().enumerate() {
            if let Some((k, place)) = self.anchor(i) {
                let d = x[i] - place;
                energy += 0.5 * k * d.norm_squared();
                *f -= d * k;
            }
        }
        energy
    }

    /// Potential energy (mJ) and the acceleration of every vertex (mm/s²), with damping, within what it can follow. Thesis (4.11),
    /// (4.12).
    pub(super) fn accelerations(&self, state: &State, out: &mut Vec<Vector3<f64>>) -> f64 {
        let energy = self.forces(&state.positions, out);
        for (i, a) in out.iter_mut().enumerate() {
            *a = if self.free[i] {
                let force = self.within(i, &state.positions[i], *a);
                force / self.inertia[i] - state.velocities[i] * self.options.damping_per_s
            } else {
                Vector3::zeros()
            };
        }
        energy
    }

    /// What pulls on a vertex wherever it is, N: the muscles, and what balances the pre-tension.
    pub(super) fn given(&self, i: usize) -> Vector3<f64> {
        self.balance.get(i).map_or(self.loads[i], |b| self.loads[i] + self.pose.turned(i, b))
    }

    fn work_of_loads(&self, x: &[Point3<f64>]) -> f64 {
        x.iter().zip(&self.rest).enumerate().map(|(i, (x, x0))| self.given(i).dot(&(x - x0))).sum()
    }

    /// Potential energy alone, mJ.
    pub fn potential(&self, x: &[Point3<f64>]) -> f64 {
        let scale = self.options.stiffness;
        let mut energy = -self.work_of_loads(x);
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|i| i as usize);
            energy += self.options.law.at(spring, (x[a] - x[b]).norm(), scale)[0];
        }
        if let Some(repulsion) = &self.options.repulsion {
            for wedge in &self.wedges {
                let normal = self.wedge_normal(wedge);
                wedge.pushes(repulsion, Self::corners(wedge, x), &normal, |push| energy += push.energy);
            }
        }
        for (i, x) in x.iter().enumerate() {
            if let Some((k, place)) = self.anchor(i) {
                energy += 0.5 * k * (x - place).norm_squared();
            }
        }
        energy
    }

    /// The energy of a state by its parts.
    pub fn energy(&self, state: &State) -> Energy {
        let loads = -self.work_of_loads(&state.positions);
        Energy { kinetic: self.kinetic(state), elastic: self.potential(&state.positions) - loads, loads }
    }

    pub(super) fn kinetic(&self, state: &State) -> f64 {
        self.inertia.iter().zip(&state.velocities).map(|(m, v)| 0.5 * m * v.norm_squared()).sum()
    }
}
