//! What the muscles leave: pulls along the skin that no law of theirs foretells, as far as the points ask for them.
//!
//! A law is never quite how a muscle pulls. With its muscles alone the field is far off wherever it is the wrong one, and does not know it. So the
//! traction on the skin is taken for that of the muscles and a discrepancy (Kennedy and O'Hagan 2001): a Gaussian field along the skin with zero
//! mean, as smooth as the mesh can tell, and as large as a share τ of the traction that the muscles put nearby. The points choose τ: it is weighed by
//! how likely they were under each (the evidence).

use faer::{Mat, Side};
use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::motion::{Body, Errors, Found, Seen, USUAL, believed, covariance, together};
use crate::face::Mesh;
use crate::fit::non_negative::{self, NormalEquations};
use crate::simulate::Ended;

/// The discrepancies of two places are alike with e^(−d²/2ℓ²), mm: an edge of the generic face. Longer ones left error bars too short.
const ALIKE_MM: f64 = 8.0;
/// The muscles' traction nearby is its root mean square over a bell of this standard deviation, mm.
const NEARBY_MM: f64 = 10.0;
/// Where muscles pull little, as much is possible as this share of where they pull most.
const LITTLE: f64 = 0.1;
/// Skin further than this from every point, mm, has none: the points could not tell.
const FAR_MM: f64 = 20.0;
/// Share of the prior variance that is left out.
const LEFT_OUT: f64 = 0.01;
/// Shares τ that are tried, how many and from where to where, evenly by their logarithm; the least is next to none.
const TRIED: i32 = 21;
const SHARES: [f64; 2] = [1e-3, 1.0];
/// Steps at most.
const STEPS: usize = 12;
/// Slopes serve on after a step that gains more than this share of what they foretold.
const FOLLOWED: f64 = 0.8;
/// A step that lowers the cost by a smaller share is the last.
const ENOUGH: f64 = 1e-3;
/// Halvings of a step before it is given up.
const HALVINGS: usize = 6;

/// The skin at rest under muscles and what they leave.
pub(super) struct Completed {
    /// One a muscle.
    pub(super) activations: DVector<f64>,
    /// Every vertex, mm.
    pub(super) positions: Vec<Point3<f64>>,
    /// rᵀ W r.
    pub(super) square: f64,
    /// The pulls besides the muscles, N on every vertex.
    pub(super) besides: Vec<Vector3<f64>>,
    /// What the points say τ is: the root of its mean square.
    pub(super) share: f64,
    pub(super) errors: Errors,
}

impl Completed {
    /// The muscles alone, with nothing besides them on any of `vertices`.
    pub(super) fn alone(found: &Found, vertices: usize, errors: Errors) -> Self {
        Self {
            activations: found.activations.clone(),
            positions: found.positions.clone(),
            square: found.square,
            besides: vec![Vector3::zeros(); vertices],
            share: 0.0,
            errors,
        }
    }
}

/// Independent fields of the discrepancy, N on every vertex, one standard deviation each where τ is 1; empty where no muscle pulls.
fn fields(
    mesh: &Mesh,
    first: &[Point3<f64>],
    free: &[bool],
    seen: &Seen<'_>,
    muscles: &[Vector3<f64>],
) -> Vec<Vec<Vector3<f64>>> {
    let areas = mesh.vertex_areas(first);
    let pulled: Vec<usize> = (0..first.len()).filter(|&v| muscles[v] != Vector3::zeros()).collect();
    let bell = |a: usize, b: usize, width: f64| (-0.5 * (first[a] - first[b]).norm_squared() / (width * width)).exp();
    let nearby = |v: usize| {
        let squares: f64 = pulled
            .iter()
            .map(|&u| bell(u, v, NEARBY_MM) * muscles[u].norm_squared() / areas[u].max(f64::MIN_POSITIVE))
            .sum();
        let around: f64 = std::f64::consts::TAU * NEARBY_MM * NEARBY_MM;
        (squares / around).sqrt()
    };
    let near = |v: usize| seen.points().iter().any(|(m, ..)| (first[*m] - first[v]).norm() < FAR_MM);
    let places: Vec<usize> = (0..first.len()).filter(|&v| free[v] && near(v)).collect();
    let size: Vec<f64> = places.iter().map(|&v| nearby(v)).collect();
    let most = size.iter().copied().fold(0.0, f64::max);
    if most == 0.0 {
        return Vec::new();
    }
    let size: Vec<f64> = size.iter().map(|s| s.max(LITTLE * most)).collect();
    let columns = pivoted_root(places.len(), LEFT_OUT, |i, j| size[i] * size[j] * bell(places[i], places[j], ALIKE_MM));
    let normals = mesh.vertex_normals(first);
    let along = |v: usize| {
        let across = if normals[v].x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let t = (across - normals[v] * normals[v].dot(&across)).normalize();
        [t, normals[v].cross(&t)]
    };
    let field = |column: &[f64], axis: usize| {
        let mut newton = vec![Vector3::zeros(); first.len()];
        for (&v, value) in places.iter().zip(column) {
            newton[v] = along(v)[axis] * (value * areas[v]);
        }
        newton
    };
    columns.iter().flat_map(|column| [0, 1].map(|axis| field(column, axis))).collect()
}

/// L of C ≈ L Lᵀ, column by column, until the share `left_out` of the trace is left: the Cholesky factor with the largest pivot first, of which only
/// so many columns are made.
fn pivoted_root(n: usize, left_out: f64, c: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut left: Vec<f64> = (0..n).map(|i| c(i, i)).collect();
    let enough = left_out * left.iter().sum::<f64>();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    while columns.len() < n && left.iter().sum::<f64>() > enough {
        let pivot = (0..n).fold(0, |best, i| if left[i] > left[best] { i } else { best });
        let root = left[pivot].sqrt();
        let entry = |i: usize| (c(i, pivot) - columns.iter().map(|l| l[i] * l[pivot]).sum::<f64>()) / root;
        let column: Vec<f64> = (0..n).map(entry).collect();
        for (left, l) in left.iter_mut().zip(&column) {
            *left = (*left - l * l).max(0.0);
        }
        left[pivot] = 0.0;
        columns.push(column);
    }
    columns
}

/// The linear problem in the activations a and the fields' strengths z, with the part of the fields diagonal.
struct Split {
    /// Of a alone.
    muscles: NormalEquations,
    /// Q and Λ of Gᵀ W G = Q Λ Qᵀ, G the points' motion by the fields.
    turn: DMatrix<f64>,
    weights: DVector<f64>,
    /// Qᵀ Gᵀ W J and Qᵀ Gᵀ W u.
    coupling: DMatrix<f64>,
    moment: DVector<f64>,
}

/// Its solution for one share τ.
struct Weighed {
    /// Logarithm of how likely the points were, but for a constant.
    evidence: f64,
    activations: DVector<f64>,
    /// The normal equations of a with z integrated out, and what being used costs.
    normal: NormalEquations,
    /// 1 / (τ⁻² + Λ): variances of Qᵀ z where a is known.
    variances: DVector<f64>,
}

impl Split {
    fn new(normal: &NormalEquations, muscles: usize) -> Option<Self> {
        let (m, q) = (muscles, normal.len() - muscles);
        let eigen = Mat::from_fn(q, q, |i, j| normal.gram[(m + i, m + j)]).self_adjoint_eigen(Side::Lower).ok()?;
        let turn = DMatrix::from_fn(q, q, |i, j| eigen.U()[(i, j)]);
        Some(Self {
            weights: DVector::from_iterator(q, eigen.S().column_vector().iter().map(|l| l.max(0.0))),
            coupling: turn.tr_mul(&normal.gram.view((m, 0), (q, m))),
            moment: turn.tr_mul(&normal.moment.rows(m, q)),
            muscles: NormalEquations {
                gram: normal.gram.view((0, 0), (m, m)).into_owned(),
                moment: normal.moment.rows(0, m).into_owned(),
                square: normal.square,
            },
            turn,
        })
    }

    /// The same slopes with another whitened aim u, of which `normal` holds the moments.
    fn aim(&mut self, moment: &DVector<f64>, square: f64) {
        let m = self.muscles.len();
        self.muscles.moment = moment.rows(0, m).into_owned();
        self.muscles.square = square;
        self.moment = self.turn.tr_mul(&moment.rows(m, self.weights.len()));
    }

    fn weigh(&self, share: f64, from: &DVector<f64>, allowed: Option<&[bool]>) -> Option<Weighed> {
        let variances = self.weights.map(|l| 1.0 / (share.powi(-2) + l));
        let seen =
            DMatrix::from_fn(self.weights.len(), self.muscles.len(), |i, j| self.coupling[(i, j)] * variances[i]);
        let mut normal = self.muscles.clone();
        normal.gram -= self.coupling.tr_mul(&seen);
        normal.moment -= seen.tr_mul(&self.moment);
        normal.moment.add_scalar_mut(-1.0 / USUAL);
        normal.square -= self.moment.component_mul(&variances).dot(&self.moment);
        let solved = non_negative::solve(&believed(&normal, from), allowed);
        if solved.ended != non_negative::Ended::Minimum {
            return None;
        }
        let activations = solved.strengths;
        let active: Vec<usize> = (0..activations.len()).filter(|&j| activations[j] > 0.0).collect();
        let part = DMatrix::from_fn(active.len(), active.len(), |r, c| normal.gram[(active[r], active[c])]);
        // Laplace's approximation over the activations in use, each with the density e^(−a/m)/m.
        let shape: f64 = part.cholesky()?.l_dirty().diagonal().iter().map(|l| 2.0 * l.ln()).sum();
        let usual = active.len() as f64 * (USUAL * USUAL / std::f64::consts::TAU).ln();
        let spread: f64 = self.weights.iter().map(|l| (share * share * l).ln_1p()).sum();
        let cost =
            activations.dot(&(&normal.gram * &activations)) - 2.0 * activations.dot(&normal.moment) + normal.square;
        Some(Weighed { evidence: -0.5 * (cost + spread + shape + usual), activations, normal, variances })
    }

    /// The solution for the share that the points say, and that share.
    fn solve(&self, from: &DVector<f64>, allowed: Option<&[bool]>) -> Option<(f64, Weighed)> {
        let step = (SHARES[1] / SHARES[0]).powf(1.0 / f64::from(TRIED - 1));
        let shares = (0..TRIED).map(|k| SHARES[0] * step.powi(k));
        let tried: Vec<(f64, Weighed)> = shares.filter_map(|s| Some((s, self.weigh(s, from, allowed)?))).collect();
        let best = tried.iter().map(|(_, w)| w.evidence).fold(f64::NEG_INFINITY, f64::max);
        let weights = tried.iter().map(|(_, w)| (w.evidence - best).exp());
        let (sum, squares) =
            tried.iter().zip(weights).fold((0.0, 0.0), |(sum, squares), ((s, _), w)| (sum + w, squares + w * s * s));
        let share = (squares / sum).sqrt();
        Some((share, self.weigh(share, from, allowed)?))
    }

    /// z for these activations.
    fn strengths(&self, weighed: &Weighed, activations: &DVector<f64>) -> DVector<f64> {
        &self.turn * (&self.moment - &self.coupling * activations).component_mul(&weighed.variances)
    }
}

/// The equilibrium made linear at some activations and strengths.
struct Linear {
    /// Motion of all vertices by each, mm.
    moved: Vec<Vec<Vector3<f64>>>,
    /// Whitened motion of the points.
    slopes: DMatrix<f64>,
    split: Split,
}

impl Linear {
    /// At `now`, where the vertices are at `x` and the points are `off`; the first `muscles` columns (N on every vertex) are muscles.
    fn new(
        body: &mut Body<'_>,
        seen: &Seen<'_>,
        columns: &[Vec<Vector3<f64>>],
        muscles: usize,
        (now, x, off): (&DVector<f64>, &[Point3<f64>], &DVector<f64>),
    ) -> Option<Self> {
        let moved = body.moved(columns, now, x)?;
        let slopes = seen.motion(x, &moved);
        let split = Split::new(&seen.normal(&slopes, &(off + &slopes * now)), muscles)?;
        Some(Self { moved, slopes, split })
    }
}

const NO_REST: &str = "the skin finds no rest under pulls besides the muscles";
const NO_STRENGTHS: &str = "the strengths of muscles and other pulls cannot be told apart";

/// Muscles as they are without what they leave.
pub(super) struct Alone<'a> {
    /// What each puts on every vertex at full strength, N.
    pub(super) loads: &'a [Vec<Vector3<f64>>],
    pub(super) found: &'a Found,
    /// Those that may pull; all where absent.
    pub(super) allowed: Option<&'a [bool]>,
}

/// Adds to the muscles what they leave.
///
/// The equilibrium is made linear where the muscles alone take it, and gone to from there by steps with those slopes as long as they foretell what a
/// step gains.
///
/// # Errors
/// Why there is nothing: no muscle pulls, the skin finds no rest, or `stop` says so.
pub(super) fn complete(
    body: &mut Body<'_>,
    mesh: &Mesh,
    first: &[Point3<f64>],
    seen: &Seen<'_>,
    muscles: &Alone<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<Completed, &'static str> {
    let Alone { loads, found, allowed } = *muscles;
    let pulls = together(loads, &found.activations);
    let fields = fields(mesh, first, body.rest.free(), seen, &pulls);
    if fields.is_empty() {
        return Err("no muscle pulls");
    }
    let (m, q) = (loads.len(), fields.len());
    let columns = [loads, &fields].concat();
    let mut now = found.activations.clone().resize_vertically(m + q, 0.0);
    let (mut x, mut off) = (found.positions.clone(), found.off.clone());
    let mut linear = Linear::new(body, seen, &columns, m, (&now, &x, &off)).ok_or(NO_REST)?;
    let mut solved = linear.split.solve(&found.activations, allowed).ok_or(NO_STRENGTHS)?;
    let cost = |off: &DVector<f64>, all: &DVector<f64>, share: f64| {
        seen.square(off) + 2.0 * all.rows(0, m).sum() / USUAL + all.rows(m, q).norm_squared() / (share * share)
    };
    let mut fresh = true;
    for step in 0..STEPS {
        if stop() {
            return Err(super::STOPPED);
        }
        let (share, weighed) = (solved.0, &solved.1);
        let mut aim = weighed.activations.clone().resize_vertically(m + q, 0.0);
        aim.rows_mut(m, q).copy_from(&linear.split.strengths(weighed, &weighed.activations));
        let (way, lowest) = (&aim - &now, cost(&off, &now, share));
        let foretold = lowest - cost(&(&off - &linear.slopes * &way), &aim, share);
        let mut part = 1.0;
        let mut gained = 0.0;
        for _ in 0..HALVINGS {
            let trial = &now + &way * part;
            let there = body.solve(&columns, &trial, &x).ok_or(NO_REST)?;
            let left = seen.off(&there.positions);
            let gain = lowest - cost(&left, &trial, share);
            if there.ended == Ended::Converged && gain >= 0.0 {
                (now, x, off, gained) = (trial, there.positions, left, gain);
                break;
            }
            part *= 0.5;
        }
        let followed = gained > FOLLOWED * foretold;
        if step + 1 == STEPS || (gained < ENOUGH * lowest && (followed || fresh)) {
            break;
        }
        fresh = !followed;
        if fresh {
            linear = Linear::new(body, seen, &columns, m, (&now, &x, &off)).ok_or(NO_REST)?;
        } else {
            let (moment, square) = seen.moments(&linear.slopes, &(&off + &linear.slopes * &now));
            linear.split.aim(&moment, square);
        }
        solved = linear.split.solve(&now.rows(0, m).into_owned(), allowed).ok_or(NO_STRENGTHS)?;
    }
    let Linear { split, moved, .. } = linear;
    let (share, weighed) = solved;
    let activations = now.rows(0, m).into_owned();
    // Errors: of the activations, which the fields make up for in part, and of the fields where the activations are known.
    let root =
        covariance(&activations, &weighed.normal).and_then(nalgebra::Matrix::cholesky).ok_or(NO_STRENGTHS)?.unpack();
    let made_up = -(&split.turn * DMatrix::from_diagonal(&weighed.variances) * &split.coupling * &root);
    let own = &split.turn * DMatrix::from_diagonal(&weighed.variances.map(f64::sqrt));
    let mut of_fields = made_up.resize_horizontally(m + q, 0.0);
    of_fields.columns_mut(m, q).copy_from(&own);
    let of_muscles = root.resize_horizontally(m + q, 0.0);
    let places = Errors::places(&moved[..m]) * &of_muscles + Errors::places(&moved[m..]) * &of_fields;
    Ok(Completed {
        square: seen.square(&off),
        besides: together(&fields, &now.rows(m, q).into_owned()),
        errors: Errors { activations: of_muscles, places },
        activations,
        positions: x,
        share,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All columns are the Cholesky factor with its rows in the order of the pivots: L Lᵀ is C itself; fewer leave no more of the trace than was said.
    #[test]
    fn the_pivoted_root_gives_the_covariance_to_the_share_that_is_left_out() {
        let at = [0.0_f64, 1.0, 2.5, 4.0, 4.2, 7.0];
        let size = [1.0, 0.3, 2.0, 1.0, 1.0, 0.1];
        let c = |i: usize, j: usize| size[i] * size[j] * (-0.5 * (at[i] - at[j]).powi(2)).exp();
        let product = |l: &[Vec<f64>], i: usize, j: usize| l.iter().map(|column| column[i] * column[j]).sum::<f64>();
        let whole = pivoted_root(6, 0.0, c);
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            assert!((product(&whole, i, j) - c(i, j)).abs() < 1e-12, "{i} {j}");
        }
        let part = pivoted_root(6, 0.1, c);
        let trace: f64 = (0..6).map(|i| c(i, i)).sum();
        let left: f64 = (0..6).map(|i| c(i, i) - product(&part, i, i)).sum();
        assert!(part.len() < 6 && left > 0.0 && left < 0.1 * trace, "{} {left}", part.len());
    }

    /// Against the formulas with whole matrices: the points' covariance under the share τ is I + τ² G Gᵀ; the activations are the generalised least
    /// squares, the strengths z = τ² Gᵀ (I + τ² G Gᵀ)⁻¹ (u − J a), the evidence that of a normal density with Laplace's factor.
    #[test]
    fn the_split_problem_is_generalised_least_squares_with_the_fields_as_errors() {
        let (points, m, q, share) = (9, 2, 4, 0.7);
        let j = DMatrix::from_fn(points, m, |i, k| 30.0 * ((i * (k + 2)) as f64 * 0.7 + k as f64).sin());
        let g = DMatrix::from_fn(points, q, |i, k| ((i + 1) as f64 * 0.9 * (k + 1) as f64).cos());
        let u = &j * DVector::from_vec(vec![0.4, 0.6]) + DVector::from_fn(points, |i, _| (i as f64 * 2.1).sin());
        let mut slopes = j.clone().resize_horizontally(m + q, 0.0);
        slopes.columns_mut(m, q).copy_from(&g);
        let mut split = Split::new(&NormalEquations::of(&slopes, &u), m).unwrap();
        // The aim can be changed and changed back.
        split.aim(&DVector::zeros(m + q), 0.0);
        split.aim(&slopes.tr_mul(&u), u.norm_squared());
        // From the answer itself, so that what keeps it near changes nothing.
        let mut from = DVector::zeros(m);
        for _ in 0..40 {
            from = split.weigh(share, &from, None).unwrap().activations;
        }
        let found = split.weigh(share, &from, None).unwrap();
        let covariance = DMatrix::identity(points, points) + &g * g.transpose() * (share * share);
        let w = covariance.clone().try_inverse().unwrap();
        let gram = j.transpose() * &w * &j;
        let moment = j.tr_mul(&(&w * &u)).add_scalar(-1.0 / USUAL);
        let a = gram.clone().try_inverse().unwrap() * &moment;
        assert!((&found.activations - &a).norm() < 1e-9 * a.norm() && a.iter().all(|a| *a > 0.0), "{a}");
        let z = g.tr_mul(&(&w * (&u - &j * &a))) * (share * share);
        assert!((split.strengths(&found, &a) - &z).norm() < 1e-9 * z.norm());
        let r = &u - &j * &a;
        let cost = r.dot(&(&w * &r)) + 2.0 * a.sum() / USUAL;
        let laplace = gram.determinant().ln() + 2.0 * (USUAL * USUAL / std::f64::consts::TAU).ln();
        let expected = -0.5 * (cost + covariance.determinant().ln() + laplace);
        assert!((found.evidence - expected).abs() < 1e-9 * expected.abs(), "{} {expected}", found.evidence);
    }
}
