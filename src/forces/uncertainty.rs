//! How well a force is known: the marking error carried through the springs.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix3, Matrix3x2, Matrix3x6, Matrix6, Matrix6x2, Point3, Vector2, Vector3};
use rayon::prelude::*;

use super::Springs;
use crate::skin::StressStrainCurve;

/// ∂F/∂x of the *external* (muscle) forces F, as one 3 × 3 block a pair of neighbours, N/mm:
///
/// δF_i = Σ_j B_ij (δx_i − δx_j),   B_ji = B_ijᵀ
///
/// so that ∂F_i/∂x_j = −B_ij and ∂F_i/∂x_i = Σ_j B_ij: a shift of all skin changes nothing.
#[derive(Clone, Debug)]
pub struct ForceSlopes<'a> {
    /// Whose edges the blocks belong to.
    springs: &'a Springs,
    /// B_ab of every edge with ends a < b.
    blocks: Vec<Matrix3<f64>>,
    /// The unit vector along which alone the force of each vertex counts, where it does not count whole.
    along: Option<&'a [Vector3<f64>]>,
}

impl<'a> ForceSlopes<'a> {
    /// Of springs:
    ///
    /// B = f′(L) u uᵀ + (f/L)(I − u uᵀ),   u = (x_a − x_b)/L
    ///
    /// The first part is the stretching of the spring, the second its turning: negative, and so softening, in compression. At a
    /// corner of the skin's table f′ is the slope to the right. Zero for a spring that carries nothing or has no length.
    pub fn of_springs(
        springs: &'a Springs,
        curve: &StressStrainCurve,
        positions: &[Point3<f64>],
        active: Option<&[bool]>,
    ) -> Self {
        let block = |e: usize| {
            let along = springs.along(e, positions);
            let length = along.norm();
            if length == 0.0 || !springs.is_active(e, active) {
                return Matrix3::zeros();
            }
            let turning = springs.tension(e, curve, length) / length;
            let stretching = springs.tangent_stiffness(e, curve, length);
            let u = along / length;
            Matrix3::from_diagonal_element(turning) + u * u.transpose() * (stretching - turning)
        };
        let edges = 0..springs.edges().len();
        Self { springs, blocks: edges.into_par_iter().with_min_len(PARALLEL_FROM).map(block).collect(), along: None }
    }

    /// Of blocks B_ab that are known, one an edge of the mesh (a < b).
    pub(super) fn of_blocks(springs: &'a Springs, blocks: Vec<Matrix3<f64>>) -> Self {
        Self { springs, blocks, along: None }
    }

    /// The same of the component n_i·F_i of each force along a unit vector of its vertex: n_i n_iᵀ B_ij.
    #[must_use]
    pub fn along<'b>(self, normals: &'b [Vector3<f64>]) -> ForceSlopes<'b>
    where
        'a: 'b,
    {
        ForceSlopes { springs: self.springs, blocks: self.blocks, along: Some(normals) }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.springs.vertices()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The neighbours j of a vertex i, and B_ij.
    pub fn at(&self, vertex: usize) -> impl Iterator<Item = (usize, Matrix3<f64>)> + '_ {
        self.springs.springs_of_vertex(vertex).iter().map(move |&e| {
            let [a, b] = self.springs.edges()[e as usize].map(|v| v as usize);
            let block = &self.blocks[e as usize];
            let (other, block) = if a == vertex { (b, *block) } else { (a, block.transpose()) };
            let projected = self.along.map(|n| n[vertex] * (n[vertex].transpose() * block));
            (other, projected.unwrap_or(block))
        })
    }
}

/// Below so many items the work stays on one thread.
const PARALLEL_FROM: usize = 4096;

/// Which marks a vertex follows, and with what weight, for every vertex (compressed rows).
#[derive(Clone, Debug, PartialEq)]
pub struct Influence {
    starts: Vec<u32>,
    marks: Vec<u32>,
    weights: Vec<f64>,
}

impl Default for Influence {
    fn default() -> Self {
        Self { starts: vec![0], marks: Vec::new(), weights: Vec::new() }
    }
}

impl Influence {
    /// One row of (mark, weight) a vertex. A marked vertex has itself with weight 1, one that is fixed has none.
    pub fn from_rows<R: IntoIterator<Item = (u32, f64)>>(rows: impl IntoIterator<Item = R>) -> Self {
        let mut influence = Self::default();
        for row in rows {
            for (mark, weight) in row {
                influence.marks.push(mark);
                influence.weights.push(weight);
            }
            influence.starts.push(influence.marks.len() as u32);
        }
        influence
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The (mark, weight) pairs of one vertex.
    pub fn row(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[vertex] as usize..self.starts[vertex + 1] as usize;
        self.marks[range.clone()].iter().map(|&m| m as usize).zip(self.weights[range].iter().copied())
    }
}

/// How the positions depend on what a hand has marked: the error of vertex j is
///
/// δx_j = Σ_m w_jm S_m e_m + C_j θ,   e_m ~ N(0, σ_m² I) px,   θ ~ N(0, Σ)
///
/// all e_m independent of each other. θ is read from some of the marks, so that it errs with them: E[θ e_mᵀ] = σ_m² G_m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MarkInfluence {
    /// w: the marks of each vertex.
    pub weights: Influence,
    /// S: how the position follows each mark, mm per px.
    pub slope_mm_per_px: Vec<Matrix3x2<f64>>,
    /// σ: standard deviation of each mark along either axis, px.
    pub sigma_px: Vec<f64>,
    /// What all vertices share: the head's motion.
    pub common: Option<Common>,
}

/// The error θ of the head's motion (rotation vector, rad; translation, mm), which every vertex shares.
#[derive(Clone, Debug, PartialEq)]
pub struct Common {
    /// C of each vertex, mm per unit of θ.
    pub slopes: Vec<Matrix3x6<f64>>,
    /// Σ.
    pub covariance: Matrix6<f64>,
    /// G of the marks that θ was read from: ∂θ/∂mark, per px.
    pub follows: BTreeMap<u32, Matrix6x2<f64>>,
}

/// Standard error of the force on every vertex, N: the root mean square length of its error vector.
///
/// δF_i = Σ_j B_ij (δx_i − δx_j) over the neighbours j of i ([`ForceSlopes`]), so that
///
/// σ_i² = tr Cov(F_i) = Σ_m σ_m² (‖A_m‖² + 2 ⟨A_m, D G_m⟩) + tr(D Σ Dᵀ)
///
/// A_m = (Σ_j B_ij (w_im − w_jm)) S_m,   D = Σ_j B_ij (C_i − C_j)
///
/// First order in the marking error: exact for a small one, within a few per cent as long as it does not carry springs over a
/// corner of the skin's table. `out` is given one number a vertex.
pub fn standard_errors(slopes: &ForceSlopes<'_>, influence: &MarkInfluence, out: &mut Vec<f64>) {
    out.resize(slopes.len(), 0.0);
    out.par_iter_mut().enumerate().with_min_len(PARALLEL_FROM / 4).for_each_init(
        || Gathered::new(influence.sigma_px.len()),
        |gathered, (i, sigma)| *sigma = gathered.variance(i, slopes, influence).sqrt(),
    );
}

/// Positions whose errors go together, each along its own slope:
///
/// δx_j = S_j (d_j + Σ_k g_kj e_k) + C_j θ,   e_k ~ N(0, I),   θ ~ N(0, Σ)
///
/// as smoothing leaves them.
#[derive(Clone, Debug)]
pub struct SpreadInfluence<'a> {
    /// S: how each position follows its place in the picture, mm per px; zero where a vertex does not move.
    pub slope_mm_per_px: Vec<Matrix3x2<f64>>,
    /// Which column of `spread_px` is a vertex's own, if any.
    pub column: Vec<Option<u32>>,
    /// g: a row a cause, a column a place, px.
    pub spread_px: &'a DMatrix<f64>,
    /// d: how far each place is known to be off, px.
    pub off_px: &'a [Vector2<f64>],
    /// What all vertices share, independent of the e_k: the head's motion.
    pub common: Option<Common>,
}

/// Standard error of the force on every vertex, N, as [`standard_errors`], for positions whose errors go together:
///
/// σ_i² = Σ_jl ⟨A_ij S_j, A_il S_l⟩ (g_j · g_l) + |Σ_j A_ij S_j d_j|² + tr(D Σ Dᵀ),   A_ii = Σ_j B_ij,  A_ij = −B_ij
pub fn standard_errors_of_spread(slopes: &ForceSlopes<'_>, influence: &SpreadInfluence<'_>, out: &mut Vec<f64>) {
    let variance = |i: usize| {
        let mut own = Matrix3::zeros();
        let mut shared = Matrix3x6::zeros();
        let mut parts: Vec<(Matrix3x2<f64>, u32)> = Vec::new();
        for (j, b) in slopes.at(i) {
            own += b;
            if let Some(column) = influence.column[j] {
                parts.push((-b * influence.slope_mm_per_px[j], column));
            }
            if let Some(common) = &influence.common {
                shared += b * (common.slopes[i] - common.slopes[j]);
            }
        }
        if let Some(column) = influence.column[i] {
            parts.push((own * influence.slope_mm_per_px[i], column));
        }
        let mut variance =
            influence.common.as_ref().map_or(0.0, |c| (shared * c.covariance * shared.transpose()).trace());
        let off: Vector3<f64> = parts.iter().map(|(a, p)| a * influence.off_px[*p as usize]).sum();
        variance += off.norm_squared();
        for (k, (a, p)) in parts.iter().enumerate() {
            let g = influence.spread_px.column(*p as usize);
            variance += a.norm_squared() * g.norm_squared();
            for (b, q) in &parts[..k] {
                variance += 2.0 * a.dot(b) * g.dot(&influence.spread_px.column(*q as usize));
            }
        }
        variance.max(0.0)
    };
    out.resize(slopes.len(), 0.0);
    out.par_iter_mut().enumerate().with_min_len(PARALLEL_FROM / 4).for_each(|(i, sigma)| *sigma = variance(i).sqrt());
}

/// The sum Σ_j B_ij (w_im − w_jm) of every mark that touches one vertex; memory used again for the next.
struct Gathered {
    /// Where a mark's sum is in `sums`, plus 1; 0 for a mark not met.
    place: Vec<u32>,
    sums: Vec<(usize, Matrix3<f64>)>,
}

impl Gathered {
    fn new(marks: usize) -> Self {
        Self { place: vec![0; marks], sums: Vec::new() }
    }

    fn add(&mut self, mark: usize, block: Matrix3<f64>) {
        if self.place[mark] == 0 {
            self.sums.push((mark, block));
            self.place[mark] = self.sums.len() as u32;
        } else {
            self.sums[self.place[mark] as usize - 1].1 += block;
        }
    }

    /// tr Cov(F_i), N².
    fn variance(&mut self, i: usize, slopes: &ForceSlopes<'_>, influence: &MarkInfluence) -> f64 {
        let mut own = Matrix3::zeros();
        let mut shared = Matrix3x6::zeros();
        for (j, b) in slopes.at(i) {
            own += b;
            for (mark, weight) in influence.weights.row(j) {
                self.add(mark, b * -weight);
            }
            if let Some(common) = &influence.common {
                shared += b * (common.slopes[i] - common.slopes[j]);
            }
        }
        for (mark, weight) in influence.weights.row(i) {
            self.add(mark, own * weight);
        }
        let common = influence.common.as_ref();
        let mut variance = common.map_or(0.0, |c| (shared * c.covariance * shared.transpose()).trace());
        for (mark, sum) in self.sums.drain(..) {
            self.place[mark] = 0;
            let own = sum * influence.slope_mm_per_px[mark];
            let with_head = common.and_then(|c| c.follows.get(&(mark as u32))).map_or(0.0, |g| own.dot(&(shared * g)));
            variance += influence.sigma_px[mark].powi(2) * (own.norm_squared() + 2.0 * with_head);
        }
        // A covariance rounded to just below zero is zero.
        variance.max(0.0)
    }
}

/// Slopes against central differences of the field, every vertex along every axis.
#[cfg(test)]
pub(super) fn assert_differences(
    slopes: &ForceSlopes<'_>,
    x: &[Point3<f64>],
    within: f64,
    field: impl Fn(&[Point3<f64>]) -> Vec<Vector3<f64>>,
) {
    let h = 1e-6;
    for j in 0..x.len() {
        for axis in 0..3 {
            let moved = |s: f64| {
                let mut x = x.to_vec();
                x[j][axis] += s;
                field(&x)
            };
            let (up, down) = (moved(h), moved(-h));
            let mut exact = vec![Vector3::zeros(); x.len()];
            for (i, block) in slopes.at(j) {
                exact[j] += Vector3::from(block.column(axis));
                exact[i] -= Vector3::from(block.row(axis).transpose());
            }
            for i in 0..x.len() {
                let d = (up[i] - down[i]) / (2.0 * h);
                assert!((d - exact[i]).norm() < within, "{i} {j} {axis}: {d} {}", exact[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{Noise, shaken, triangular};
    use crate::forces::{Cause, SpringRule, causes, causes_of_spread, muscle_forces};
    use nalgebra::Vector6;

    fn forces(springs: &Springs, curve: &StressStrainCurve, x: &[Point3<f64>], active: &[bool]) -> Vec<Vector3<f64>> {
        let mut out = Vec::new();
        muscle_forces(springs, curve, x, Some(active), &mut out);
        out
    }

    #[test]
    fn blocks_agree_with_central_differences_of_the_field() {
        let mesh = triangular(6, 5, 6.0);
        let curve = StressStrainCurve::default();
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let x = shaken(mesh.positions(), 0.6, 5);
        let mut active = vec![true; mesh.len()];
        active[7] = false;
        let slopes = ForceSlopes::of_springs(&springs, &curve, &x, Some(&active));
        assert_differences(&slopes, &x, 1e-8, |x| forces(&springs, &curve, x, &active));
    }

    /// Equal independent errors σ of both in-plane coordinates on a triangular lattice of linear springs k at rest:
    /// each of the six springs has B = k u uᵀ and Σ B = 3 k I, so σ_F² = σ² (‖3k I‖² + 6 ‖k u uᵀ‖²) = σ² k² (18 + 6).
    #[test]
    fn on_a_lattice_the_error_is_root_24_k_sigma() {
        let (mesh, l, sigma) = (triangular(7, 7, 8.6), 8.6, 0.3);
        let curve = StressStrainCurve::default();
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let influence = MarkInfluence {
            weights: Influence::from_rows((0..mesh.len() as u32).map(|i| [(i, 1.0)])),
            slope_mm_per_px: vec![Matrix3x2::identity() * 0.25; mesh.len()],
            sigma_px: vec![sigma; mesh.len()],
            common: None,
        };
        // At rest every strain is rounding error: take the slope of the stretched side by stretching a little.
        let x: Vec<_> = mesh.positions().iter().map(|p| Point3::from(p.coords * (1.0 + 1e-9))).collect();
        let mut sigma_n = Vec::new();
        standard_errors(&ForceSlopes::of_springs(&springs, &curve, &x, None), &influence, &mut sigma_n);
        // k = h w E / l with w = √3/2 l and E = 36.2 kPa.
        let k = 1.5 * 3.0_f64.sqrt() / 2.0 * 36.2e-3;
        let inner = 3 * 7 + 3;
        assert!((springs.rest_length_mm()[0] - l).abs() < 1e-12);
        let closed = 24.0_f64.sqrt() * k * sigma * 0.25;
        assert!((sigma_n[inner] - closed).abs() < 1e-6 * closed, "{} {closed}", sigma_n[inner]);
    }

    /// Errors that are all each vertex's own are those of marks; what is known to be off adds its own force.
    #[test]
    fn a_spread_without_ties_is_that_of_the_marks() {
        let mesh = triangular(6, 6, 8.0);
        let (n, curve) = (mesh.len(), StressStrainCurve::default());
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let x = shaken(mesh.positions(), 0.6, 3);
        let slope_of = |i: usize| Matrix3x2::new(0.25, 0.0, 0.0, 0.26, 0.01 * i as f64, 0.1);
        let sigma_px: Vec<f64> = (0..n).map(|i| 0.2 + 0.05 * (i % 5) as f64).collect();
        let marks = MarkInfluence {
            weights: Influence::from_rows((0..n as u32).map(|i| [(i, 1.0)])),
            slope_mm_per_px: (0..n).map(slope_of).collect(),
            sigma_px: sigma_px.clone(),
            common: None,
        };
        let mut of_marks = Vec::new();
        standard_errors(&ForceSlopes::of_springs(&springs, &curve, &x, None), &marks, &mut of_marks);
        let spread_px = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(sigma_px));
        let mut off_px = vec![Vector2::zeros(); n];
        let of_spread = |off_px: &[Vector2<f64>]| {
            let influence = SpreadInfluence {
                slope_mm_per_px: (0..n).map(slope_of).collect(),
                column: (0..n as u32).map(Some).collect(),
                spread_px: &spread_px,
                off_px,
                common: None,
            };
            let mut out = Vec::new();
            standard_errors_of_spread(&ForceSlopes::of_springs(&springs, &curve, &x, None), &influence, &mut out);
            out
        };
        for (a, b) in of_marks.iter().zip(of_spread(&off_px)) {
            assert!((a - b).abs() < 1e-12 * a.max(1e-3), "{a} {b}");
        }
        // And so are its causes, but for their order.
        let slopes = ForceSlopes::of_springs(&springs, &curve, &x, None);
        let influence = SpreadInfluence {
            slope_mm_per_px: (0..n).map(slope_of).collect(),
            column: (0..n as u32).map(Some).collect(),
            spread_px: &spread_px,
            off_px: &off_px,
            common: None,
        };
        let (one, other) = (causes(&slopes, &marks), causes_of_spread(&slopes, &influence));
        assert_eq!((one.len() + 1, &other[2 * n]), (other.len(), &Cause::new()));
        for (a, b) in one.iter().flatten().zip(other.iter().flatten()) {
            assert!(a.0 == b.0 && (a.1 - b.1).norm() < 1e-15, "{a:?} {b:?}");
        }
        // One vertex off by d: the force there changes by ΣB S d, to first order.
        let (v, d) = (14, Vector2::new(1e-4, -2e-4));
        off_px[v] = d;
        let mut moved = x.clone();
        moved[v] += slope_of(v) * d;
        let active = vec![true; n];
        let change = (forces(&springs, &curve, &moved, &active)[v] - forces(&springs, &curve, &x, &active)[v]).norm();
        let added = (of_spread(&off_px)[v].powi(2) - of_marks[v].powi(2)).sqrt();
        assert!((added - change).abs() < 1e-3 * change, "{added} {change}");
    }

    /// Two thousand draws of the marks' and the head's errors, through the nonlinear field.
    #[test]
    fn standard_errors_agree_with_monte_carlo() {
        let mesh = triangular(6, 6, 8.0);
        let (n, curve) = (mesh.len(), StressStrainCurve::default());
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        // Stretched unevenly, away from the corners of the table, and bent.
        let x: Vec<_> = mesh
            .positions()
            .iter()
            .map(|p| Point3::new(p.x * 1.06, p.y * 1.14, 0.004 * p.x * p.x + 0.002 * p.x * p.y))
            .collect();
        let mut active = vec![true; n];
        active[1] = false;
        // Vertices 14 and 15 follow marks of their neighbours; 8 is fixed; the rest are marked. Mark m sits on vertex m.
        let weights = Influence::from_rows((0..n as u32).map(|i| match i {
            14 => vec![(13, 0.4), (20, 0.35), (9, 0.25)],
            15 => vec![(9, 0.5), (16, 0.5)],
            8 => vec![],
            i => vec![(i, 1.0)],
        }));
        let mut noise = Noise(17);
        let slope: Vec<_> = (0..n)
            .map(|_| Matrix3x2::new(0.25, 0.0, 0.0, -0.25, 0.08 * noise.uniform(), 0.08 * noise.uniform()))
            .collect();
        let sigma: Vec<_> = (0..n).map(|_| 0.06 + 0.03 * noise.uniform()).collect();
        // Rotation about each axis, then translation, of a head with a pivot at the origin.
        let follow: Vec<_> = x
            .iter()
            .map(|p| {
                Matrix3x6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| {
                    let mut axis = Vector3::zeros();
                    axis[k % 3] = 1.0;
                    if k < 3 { axis.cross(&p.coords) * (1.0 + 0.02 * p.x) } else { axis * (1.0 + 0.01 * p.y) }
                }))
            })
            .collect();
        let root = Matrix6::from_fn(|_, _| 2e-3 * noise.uniform());
        // Three marks give the head's motion too.
        let follows: BTreeMap<u32, Matrix6x2<f64>> =
            [7, 21, 28].into_iter().map(|m| (m, Matrix6x2::from_fn(|_, _| 0.03 * noise.uniform()))).collect();
        let read: Matrix6<f64> = follows.iter().map(|(&m, g)| g * g.transpose() * sigma[m as usize].powi(2)).sum();
        let influence = MarkInfluence {
            weights,
            slope_mm_per_px: slope.clone(),
            sigma_px: sigma.clone(),
            common: Some(Common {
                slopes: follow.clone(),
                covariance: root * root.transpose() + read,
                follows: follows.clone(),
            }),
        };
        let mut claimed = Vec::new();
        standard_errors(&ForceSlopes::of_springs(&springs, &curve, &x, Some(&active)), &influence, &mut claimed);

        let mean = forces(&springs, &curve, &x, &active);
        let mut squares = vec![0.0; n];
        // Errors of two vertices go together: neighbours, some that follow the same marks, and two that share the head alone.
        let pairs = [(20, 21), (14, 15), (2, 33)];
        let mut products = pairs.map(|_| Matrix3::zeros());
        let draws = 2000;
        for _ in 0..draws {
            let e: Vec<_> = sigma.iter().map(|s| Vector2::new(noise.normal(), noise.normal()) * *s).collect();
            let theta = root * Vector6::from_fn(|_, _| noise.normal())
                + follows.iter().map(|(&m, g)| g * e[m as usize]).sum::<Vector6<f64>>();
            let moved: Vec<_> = (0..n)
                .map(|j| {
                    let marks: Vector3<f64> = influence.weights.row(j).map(|(m, w)| slope[m] * e[m] * w).sum();
                    x[j] + marks + follow[j] * theta
                })
                .collect();
            let found = forces(&springs, &curve, &moved, &active);
            let off: Vec<Vector3<f64>> = found.iter().zip(&mean).map(|(f, m)| f - m).collect();
            for (sum, off) in squares.iter_mut().zip(&off) {
                *sum += off.norm_squared();
            }
            for (sum, (i, j)) in products.iter_mut().zip(pairs) {
                *sum += off[i] * off[j].transpose();
            }
        }
        let slopes = ForceSlopes::of_springs(&springs, &curve, &x, Some(&active));
        let known = causes(&slopes, &influence);
        let of_causes = |i: usize, j: usize| -> Matrix3<f64> {
            let at = |cause: &Cause, i: usize| {
                cause.iter().find(|(v, _)| *v as usize == i).map_or_else(Vector3::zeros, |(_, f)| *f)
            };
            known.iter().map(|c| at(c, i) * at(c, j).transpose()).sum()
        };
        for (sum, (i, j)) in products.iter().zip(pairs) {
            let (said, room) = (of_causes(i, j), claimed[i] * claimed[j]);
            assert!((sum / f64::from(draws) - said).norm() < 0.06 * room, "{i} {j}: {said} of {room}");
        }
        let alike = pairs.map(|(i, j)| of_causes(i, j).norm() / (claimed[i] * claimed[j]));
        assert!(alike.iter().all(|a| *a > 0.1), "{alike:?}");
        for i in 0..n {
            let drawn = (squares[i] / f64::from(draws)).sqrt();
            // 2000 draws of two or three numbers scatter by about 1.5 %.
            let caused = of_causes(i, i).trace();
            assert!((caused - claimed[i].powi(2)).abs() <= 1e-9 * caused, "{i}: {caused}");
            assert!((claimed[i] - drawn).abs() <= 0.06 * drawn, "vertex {i}: claimed {} drawn {drawn}", claimed[i]);
        }
        assert!(claimed[1] == 0.0 && claimed[14] > 0.0);
    }
}
