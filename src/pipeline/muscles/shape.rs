//! The shape of a muscle law as the points tell it: its parameters as unknowns beside the activations, one shape for all muscles.

use std::f64::consts::LN_2;

use nalgebra::{DVector, Point3, Vector3};

use super::motion::{Body, Errors, Found, Seen, USUAL, believed, covariance, find};
use super::{NO_REST, STOPPED, dense};
use crate::expression::TractionMesh;
use crate::fit::non_negative::{self, NormalEquations};
use crate::muscle::{MuscleLaw, Parameter};

/// ln(value − origin) of a parameter is taken to be spread about that of the law's usual shape by this: a factor of two.
const SPREAD: f64 = LN_2;
/// Change of that logarithm by which slopes are taken.
const DIFFERENCE: f64 = 0.02;
/// A step takes it down by no more than this.
const FURTHEST: f64 = 1.0;
/// Gauss–Newton steps at most.
const STEPS: usize = 8;
/// Halvings of a step before it is given up.
const HALVINGS: usize = 4;
/// A step that lowers the cost by a smaller share is the last.
const ENOUGH: f64 = 1e-2;

/// Loads at full strength on every vertex (N), a column each.
type Columns = Vec<Vec<Vector3<f64>>>;

/// A law whose shape is asked for.
pub(super) struct Shaping<'a> {
    mesh: &'a TractionMesh,
    law: MuscleLaw,
    /// Ids of the muscles that are asked for.
    muscles: Vec<&'a str>,
    jaw: bool,
    /// The unknowns' logarithms in the law's usual shape.
    usual: DVector<f64>,
}

/// The shape that was found, as logarithms, and muscles of it.
pub(super) struct Shaped {
    pub(super) logs: DVector<f64>,
    /// As [`Shaping::loads`].
    pub(super) loads: Columns,
    pub(super) found: Found,
    /// What was minimised.
    pub(super) cost: f64,
}

/// The equilibrium made linear in activations and shape.
struct Joint {
    /// What a change of each logarithm by one puts on the vertices, N.
    pulls: Columns,
    /// Motion of all vertices by each column, mm.
    moved: Columns,
    /// In the activations a and the changes δ of the logarithms, with what being used and being unusual costs.
    normal: NormalEquations,
}

/// How activations, places and shape err together.
pub(super) struct ShapeErrors {
    /// Those of activations end with the rows of the shape's logarithms.
    pub(super) errors: Errors,
    /// What a change of each logarithm by one puts on the vertices, N.
    pub(super) pulls: Columns,
}

fn unknowns(law: &MuscleLaw) -> impl Iterator<Item = Parameter> {
    // The sharp side of a zone has no slope.
    law.parameters().into_iter().filter(|p| p.smooth)
}

impl<'a> Shaping<'a> {
    /// Of the muscles with these ids, and of the jaw.
    pub(super) fn new(mesh: &'a TractionMesh, law: MuscleLaw, muscles: Vec<&'a str>, jaw: bool) -> Self {
        let usual: Vec<f64> = unknowns(&law).map(|p| (p.value - p.origin).ln()).collect();
        Self { mesh, law, muscles, jaw, usual: DVector::from_vec(usual) }
    }

    /// The law's parameters that are unknowns, as they usually are.
    pub(super) fn unknowns(&self) -> impl Iterator<Item = Parameter> {
        unknowns(&self.law)
    }

    /// The value of a parameter whose logarithm this is, within its range.
    pub(super) fn value(parameter: &Parameter, log: f64) -> f64 {
        (parameter.origin + log.exp()).clamp(parameter.low, parameter.high)
    }

    fn at(&self, logs: &DVector<f64>) -> MuscleLaw {
        let mut logs = logs.iter();
        let values: Vec<f64> = self
            .law
            .parameters()
            .iter()
            .map(|p| if p.smooth { logs.next().map_or(p.value, |log| Self::value(p, *log)) } else { p.value })
            .collect();
        self.law.at(&values)
    }

    /// What each muscle, then the jaw, puts on every vertex at full strength.
    fn loads(&self, logs: &DVector<f64>, vertices: usize) -> Result<Columns, String> {
        let all = self.mesh.actuators(&self.at(logs)).map_err(|why| why.to_string())?;
        let own = all.iter().filter(|a| self.muscles.contains(&a.id.as_str()));
        let mut loads: Columns = own.map(|a| dense(a, vertices)).collect();
        loads.extend(self.jaw.then(|| vec![Vector3::zeros(); vertices]));
        Ok(loads)
    }

    /// What an unusual shape costs: its logarithms have a normal density about the usual ones.
    fn unusual(&self, logs: &DVector<f64>) -> f64 {
        (logs - &self.usual).norm_squared() / (SPREAD * SPREAD)
    }

    fn joint(
        &self,
        body: &mut Body<'_>,
        seen: &Seen<'_>,
        logs: &DVector<f64>,
        (loads, found): (&[Vec<Vector3<f64>>], &Found),
    ) -> Result<Joint, String> {
        let (m, vertices, a) = (loads.len(), found.positions.len(), &found.activations);
        let mut pulls = Columns::new();
        for k in 0..logs.len() {
            let mut moved = logs.clone();
            moved[k] += DIFFERENCE;
            let mut pull = vec![Vector3::zeros(); vertices];
            for ((there, here), a) in self.loads(&moved, vertices)?.iter().zip(loads).zip(a.iter()) {
                for ((pull, there), here) in pull.iter_mut().zip(there).zip(here) {
                    *pull += (there - here) * (a / DIFFERENCE);
                }
            }
            pulls.push(pull);
        }
        let columns = [loads, &pulls].concat();
        let shares = a.clone().resize_vertically(columns.len(), 0.0);
        let moved = body.moved(&columns, &shares, &found.positions).ok_or(NO_REST)?;
        let slopes = seen.motion(&found.positions, &moved);
        let mut normal = seen.normal(&slopes, &(&found.off + &slopes * &shares));
        for j in 0..m {
            normal.moment[j] -= 1.0 / USUAL;
        }
        for k in 0..pulls.len() {
            normal.gram[(m + k, m + k)] += SPREAD.powi(-2);
            normal.moment[m + k] += (self.usual[k] - logs[k]) * SPREAD.powi(-2);
        }
        Ok(Joint { pulls, moved, normal })
    }

    /// The activations and the shape that minimise rᵀ W r + 2 Σ a / m + Σ (θ − θ₀)² / s², θ the logarithms of the law's smooth parameters over their
    /// origins, from the usual shape θ₀ and the activations that were found with it.
    ///
    /// Gauss–Newton through the equilibrium, as [`find`], with the columns dx/dθ = H⁻¹ Σ aⱼ ∂fⱼ/∂θ beside those of the muscles; ∂f/∂θ by differences of
    /// the muscles' tractions. After each step of the shape the activations are found anew.
    pub(super) fn fit(
        &self,
        body: &mut Body<'_>,
        seen: &Seen<'_>,
        first: &[Point3<f64>],
        (loads, found): (Columns, Found),
        stop: &dyn Fn() -> bool,
    ) -> Result<Shaped, String> {
        let m = loads.len();
        let mut now = Shaped { logs: self.usual.clone(), cost: found.cost, loads, found };
        for _ in 0..STEPS {
            if stop() {
                return Err(STOPPED.to_owned());
            }
            let joint = self.joint(body, seen, &now.logs, (&now.loads, &now.found))?;
            let still = now.found.activations.clone().resize_vertically(m + now.logs.len(), 0.0);
            let aim = non_negative::solve(&from_below(&believed(&joint.normal, &still), m), None);
            if aim.ended != non_negative::Ended::Minimum {
                break;
            }
            let ahead = (aim.strengths.rows(0, m) - &now.found.activations).into_owned();
            let way = aim.strengths.rows(m, now.logs.len()).add_scalar(-FURTHEST);
            let lowest = now.cost;
            let mut part = 1.0;
            for _ in 0..HALVINGS {
                let logs = &now.logs + &way * part;
                let loads = self.loads(&logs, first.len())?;
                let start = Some((&now.found.activations + &ahead * part, &now.found.positions[..]));
                let found = find(body, &loads, seen, None, start, first);
                let cost = found.as_ref().map_or(f64::INFINITY, |f| f.cost + self.unusual(&logs));
                if let Some(found) = found.filter(|_| cost < lowest) {
                    now = Shaped { logs, loads, found, cost };
                    break;
                }
                part *= 0.5;
            }
            if lowest - now.cost < ENOUGH * lowest {
                break;
            }
        }
        Ok(now)
    }

    /// How it all errs together where the shape has these logarithms.
    pub(super) fn errors(
        &self,
        body: &mut Body<'_>,
        seen: &Seen<'_>,
        logs: &DVector<f64>,
        (loads, found): (&[Vec<Vector3<f64>>], &Found),
    ) -> Result<ShapeErrors, String> {
        let Joint { pulls, moved, normal } = self.joint(body, seen, logs, (loads, found))?;
        let m = loads.len();
        let all = found.activations.clone().resize_vertically(m + pulls.len(), FURTHEST);
        let root = covariance(&all, &from_below(&normal, m)).and_then(nalgebra::Matrix::cholesky);
        let root = root.ok_or("the shape of the law cannot be told")?.unpack();
        Ok(ShapeErrors { errors: Errors { places: Errors::places(&moved) * &root, activations: root }, pulls })
    }
}

/// The same problem in δ + [`FURTHEST`] instead of δ, the unknowns after the first `m`, of which non-negative least squares leaves none further below.
fn from_below(normal: &NormalEquations, m: usize) -> NormalEquations {
    let mut shifted = normal.clone();
    let count = normal.len() - m;
    shifted.moment += normal.gram.columns(m, count) * DVector::from_element(count, FURTHEST);
    shifted
}
