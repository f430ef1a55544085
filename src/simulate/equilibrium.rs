//! Where the skin comes to rest under the muscles' loads: projected Newton with a line search.
//!
//! The energy U(x) of [`System::forces`] is lowered until no free vertex is pulled along the surface any more. Every iteration
//! solves H d = f with the positive part H of the stiffness matrix (`newton.rs`), so it descends from any start, also from
//! folded and compressed ones. It ends in *an* equilibrium: bare skin has several (`docs/errata.md`), skin over a skull need not.

use nalgebra::{Point3, Vector3};

use super::energy::Pulls;
use super::line_search::Search;
use super::newton::{Newton, OutOfMemory};
use super::system::System;

/// Why the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// No step longer than the tolerance is left.
    Converged,
    /// No step lowers the energy: rounding error, or a corner of the skin's law.
    Stalled,
    /// As many iterations as were allowed.
    OutOfIterations,
    /// The stiffness matrix has no factor.
    NoFactor,
}

impl Ended {
    /// For people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Stalled => "no step lowers the energy",
            Self::OutOfIterations => "out of iterations",
            Self::NoFactor => "the stiffness matrix has no factor",
        }
    }
}

/// Where the skin came to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Equilibrium {
    /// Places, mm.
    pub positions: Vec<Point3<f64>>,
    /// Newton steps.
    pub iterations: usize,
    /// Largest force that is left along the surface, N.
    pub residual_n: f64,
    /// Potential energy, mJ.
    pub energy_mj: f64,
    /// Why it ended.
    pub ended: Ended,
    /// Triangles that have turned over: the skin is folded there.
    pub folded: Vec<u32>,
}

/// Finds equilibria of one system; its matrix is ordered once.
#[derive(Debug)]
pub struct EquilibriumSolver {
    newton: Newton,
    search: Search,
    pulls: Pulls,
    /// Newton steps at most.
    pub iterations: usize,
    /// Length of the last Newton step that counts as none, mm.
    pub tolerance_mm: f64,
}

impl EquilibriumSolver {
    /// A solver for systems with the same mesh, fixed vertices and hold as this one.
    ///
    /// # Errors
    /// Where memory for the matrix is not to be had.
    pub fn new(system: &System) -> Result<Self, OutOfMemory> {
        Ok(Self {
            newton: Newton::new(system)?,
            search: Search::default(),
            pulls: Pulls::default(),
            iterations: 200,
            tolerance_mm: 1e-5,
        })
    }

    /// The equilibrium found from a start (places that are then put where the vertices may be).
    pub fn solve(&mut self, system: &System, start: &[Point3<f64>]) -> Equilibrium {
        let mut x: Vec<Point3<f64>> = start.iter().enumerate().map(|(i, p)| system.allowed(i, p)).collect();
        let Self { newton, search, pulls, .. } = self;
        let mut energy = system.pulls(&x, pulls);
        let mut iterations = 0;
        search.begin();
        let ended = loop {
            if iterations >= self.iterations {
                break Ended::OutOfIterations;
            }
            let kept = search.keeps(NEAR_MM);
            if kept {
                newton.keep(system, &x);
            }
            let ready = kept || newton.factorize(system, &x, pulls, |_| 0.0);
            if !(ready && newton.direction(&pulls.forces, &mut search.direction)) {
                break Ended::NoFactor;
            }
            iterations += 1;
            let longest = search.longest_mm();
            let shortened = (LONGEST_MM / longest).min(1.0);
            for d in &mut search.direction {
                *d *= shortened;
            }
            newton.bends(&search.direction, &mut search.bend);
            let slope = search.slope(&pulls.forces);
            let found = search.descend(system, &mut x, energy, slope, |x| system.pulls(x, pulls));
            let Some((share, after)) = found else {
                // The forces are those of the last place tried.
                energy = system.pulls(&x, pulls);
                if longest < self.tolerance_mm {
                    break Ended::Converged;
                }
                if kept {
                    search.begin();
                    continue;
                }
                break Ended::Stalled;
            };
            energy = after;
            if search.arrived(longest, share, self.tolerance_mm, kept) {
                break Ended::Converged;
            }
        };
        let residual = |(i, f): (usize, &Vector3<f64>)| system.within(i, &x[i], *f).norm();
        let residual_n = pulls.forces.iter().enumerate().map(residual).fold(0.0, f64::max);
        let areas = system.doubled_areas(&x);
        let folded = areas.iter().enumerate().filter(|(_, a)| **a < 0.0).map(|(t, _)| t as u32).collect();
        Equilibrium { iterations, residual_n, energy_mj: energy, ended, folded, positions: x }
    }

    /// The stiffness at some places, factored: for many small changes of the loads. None where it has no factor.
    pub fn tangent(&mut self, system: &System, x: &[Point3<f64>]) -> Option<Tangent<'_>> {
        system.pulls(x, &mut self.pulls);
        let Self { newton, pulls, .. } = self;
        newton.factorize(system, x, pulls, |_| 0.0).then_some(Tangent { newton })
    }
}

/// The stiffness of a system at an equilibrium, factored once.
///
/// H is the second derivative of the energy within the surface, with what is negative in it left out: of springs that push, and of the
/// repulsion's own bending. Where no spring pushes and no corner is repelled, as in skin with tension at rest that is not pressed
/// together, it is exact.
#[derive(Debug)]
pub struct Tangent<'a> {
    newton: &'a mut Newton,
}

impl Tangent<'_> {
    /// How far each vertex goes, mm, for a small change of the loads, N: H⁻¹ Δf. False where a number is no number.
    pub fn moved(&mut self, change: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>) -> bool {
        self.newton.direction(change, out)
    }
}

/// After a whole step shorter than this the factor of the step before may serve once more, mm.
const NEAR_MM: f64 = 0.075;

/// No vertex goes further in one iteration, mm: where the skin has no stiffness left, Newton's step says nothing.
const LONGEST_MM: f64 = 10.0;
