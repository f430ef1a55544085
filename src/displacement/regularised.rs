//! The smoothest motion of the skin that the marks allow within their error: a thin plate through them, not exactly.
//!
//! `F = −K X` differentiates the marks twice, so it magnifies what is rough in them, and their error is rough. Here the motion u of
//! all the marked skin is the one with
//!
//! ```text
//! min over u   Σ_m |u_m − y_m|² / σ_m²  +  μ uᵀ B u,      B = Lᵀ A⁻¹ L
//! ```
//!
//! L is the cotangent Laplacian of the mesh, A the areas of its vertices: uᵀ B u is ∫ |Δu|², the bending energy of a thin plate. Tikhonov's method
//! with the Laplacian, as proposed for inverse forces in `docs/accuracy.md`; the mesh goes on a little beyond the marks, so that nothing is asked of
//! the motion at their border.
//!
//! All weights μ cost one decomposition (Demmler and Reinsch 1975): with B reduced to the marks and whitened, B̃ = V Λ Vᵀ, the answer for any
//! μ is u = σ V (1 + μ Λ)⁻¹ Vᵀ (y / σ).

use std::collections::{BinaryHeap, HashMap};

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use nalgebra::{DMatrix, Point3, Vector2};
use serde::{Deserialize, Serialize};

use crate::face::Mesh;

/// How the weight μ of smoothness against the marks is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WeightRule {
    /// The largest weight under which the motion misses the marks by no more than their stated error (Morozov's discrepancy principle).
    /// Of the three it gave the smallest errors of the force (`docs/accuracy.md`).
    #[default]
    Discrepancy,
    /// The weight under which these marks with their stated error were the most likely (the evidence, Wahba 1985). Rougher; every rule
    /// takes its error bars from it.
    Evidence,
    /// The weight that foretells left out marks best (generalised cross-validation, Craven and Wahba 1979): it asks for no stated error, and
    /// now and then takes noise for motion.
    CrossValidation,
}

impl WeightRule {
    /// All, the default first.
    pub const ALL: [Self; 3] = [Self::Discrepancy, Self::Evidence, Self::CrossValidation];

    /// Word of files and the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Evidence => "evidence",
            Self::Discrepancy => "discrepancy",
            Self::CrossValidation => "cross_validation",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Evidence => "Evidence",
            Self::Discrepancy => "Discrepancy",
            Self::CrossValidation => "Cross-validation",
        }
    }
}

/// Fewest marks that can tell noise from motion.
pub const FEWEST_MARKS: usize = 8;
/// Most marks that a plate is laid through: its decomposition takes a third of a second then, and grows with their cube.
pub const MOST_MARKS: usize = 1000;
/// How far the mesh goes on beyond the marks, mm along its edges: two edges of the generic face.
const COLLAR_MM: f64 = 18.0;
/// Least standard deviation of a mark, px: marks said to have no error are smoothed by next to nothing.
const LEAST_SIGMA_PX: f64 = 1e-3;
/// Weights tried from the roughest to the smoothest.
const TRIED: usize = 151;
/// An eigenvalue below this share of the largest one is that of a motion without bending.
const UNBENT: f64 = 1e-10;
/// Every so many of them at first, and all about the best of those.
const COARSE: usize = 6;
/// Factors of a product whose logarithm is taken; each is at least 1e-14 (the first weight times the range of the modes).
const AT_ONCE: usize = 8;
/// Golden section: steps that narrow an interval of the tried weights to a thousandth.
const NARROWED: usize = 14;

/// The plate of one set of marks, ready for any motion and any weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Plate {
    /// The marked vertices.
    marked: Vec<u32>,
    /// Their standard deviations, px.
    sigma_px: Vec<f64>,
    /// Λ, ascending: bending energy of each mode.
    bending: Vec<f64>,
    /// V: modes of the whitened marks, a column each.
    modes: DMatrix<f64>,
    /// The vertices whose motion is wanted: the marked and then the others.
    places: Vec<u32>,
    /// The modes' motion there, px: σ V and its continuation, a row a mode and a column a place.
    shapes: DMatrix<f64>,
}

/// One weight and what it does: a point of the L-curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighed {
    /// μ relative to the first weight tried: its logarithm to the base 10.
    pub log_weight: f64,
    /// Root mean square distance of the smooth motion from the marks, in standard deviations of a mark.
    pub residual: f64,
    /// Root mean square bending √(uᵀ B u / m), in standard deviations of a mark.
    pub bending: f64,
    /// Degrees of freedom that the marks have left, of one coordinate: the trace of the smoother.
    pub freedoms: f64,
}

/// A motion smoothed.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// The motion of every place of the plate, px.
    pub motion_px: Vec<Vector2<f64>>,
    /// Root covariance: the motion of place p along either axis is that of the evidence's weight, further by Σ_k g_kp e_k with independent
    /// e_k ~ N(0, 1); px. It is the spread of the motions that the marks leave open (Bayes; Wahba 1983), which counts what smoothing
    /// takes away as well as noise.
    pub spread_px: DMatrix<f64>,
    /// How far the motion of the evidence's weight lies from `motion_px`: smoother than likely is an error that is known, px.
    pub off_px: Vec<Vector2<f64>>,
    /// The weight taken.
    pub weighed: Weighed,
}

impl Plate {
    /// A plate over the `marked` vertices (with a standard deviation in px each) that also tells the motion of `others`.
    ///
    /// Absent where fewer than [`FEWEST_MARKS`] or more than [`MOST_MARKS`] are marked, or where no plate can be laid (no triangle among them).
    pub fn new(mesh: &Mesh, at: &[Point3<f64>], marked: &[u32], sigma_px: &[f64], others: &[u32]) -> Option<Self> {
        let m = marked.len();
        if !(FEWEST_MARKS..=MOST_MARKS).contains(&m) || sigma_px.len() != m {
            return None;
        }
        let Energy { rows, beside, inner, own } = Energy::new(mesh, at, marked)?;
        // What lies between and beyond the marks bends as little as it may: u_r = −B_rr⁻¹ B_rm u_m.
        let follows = if inner.is_empty() {
            Mat::zeros(0, m)
        } else {
            let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(inner.len(), inner.len(), &rows).ok()?;
            let factor = matrix.sp_cholesky(Side::Lower).ok()?;
            -factor.solve(&beside)
        };
        let sigma: Vec<f64> = sigma_px.iter().map(|s| s.max(LEAST_SIGMA_PX)).collect();
        let reduced = &own + beside.transpose() * &follows;
        let whitened = Mat::from_fn(m, m, |i, j| 0.5 * (reduced[(i, j)] + reduced[(j, i)]) * sigma[i] * sigma[j]);
        let eigen = whitened.self_adjoint_eigen(Side::Lower).ok()?;
        let largest = eigen.S().column_vector().iter().fold(0.0_f64, |a, b| a.max(*b));
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let bending: Vec<f64> =
            eigen.S().column_vector().iter().map(|&v| if v < UNBENT * largest { 0.0 } else { v }).collect();
        let modes = DMatrix::from_fn(m, m, |i, k| eigen.U()[(i, k)]);
        let row_of: HashMap<u32, usize> = inner.iter().enumerate().map(|(k, &v)| (v, k)).collect();
        let others: Vec<(u32, usize)> = others.iter().filter_map(|v| Some((*v, *row_of.get(v)?))).collect();
        let mut shapes = DMatrix::zeros(m, m + others.len());
        for k in 0..m {
            for i in 0..m {
                shapes[(k, i)] = sigma[i] * modes[(i, k)];
            }
            for (p, (_, row)) in others.iter().enumerate() {
                shapes[(k, m + p)] = (0..m).map(|i| follows[(*row, i)] * shapes[(k, i)]).sum();
            }
        }
        let places = marked.iter().copied().chain(others.iter().map(|o| o.0)).collect();
        Some(Self { marked: marked.to_vec(), sigma_px: sigma, bending, modes, places, shapes })
    }

    /// The vertices whose motion it tells: the marked in their order, then those others that it reaches.
    pub fn places(&self) -> &[u32] {
        &self.places
    }

    /// The marked vertices.
    pub fn marked(&self) -> &[u32] {
        &self.marked
    }

    /// The motion of the marks in the modes, in standard deviations.
    fn in_modes(&self, motion_px: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let white: Vec<Vector2<f64>> = motion_px.iter().zip(&self.sigma_px).map(|(y, s)| y / *s).collect();
        let mode = |k: usize| self.modes.column(k).iter().zip(&white).map(|(v, y)| y * *v).sum();
        (0..self.modes.ncols()).map(mode).collect()
    }

    /// The weight μ at a position on the way from the roughest (0) to the smoothest (`TRIED` − 1) that is tried.
    fn weight(&self, position: f64) -> f64 {
        let bent = self.bending.iter().filter(|b| **b > 0.0);
        let (low, high) = bent.fold((f64::INFINITY, 0.0_f64), |(l, h), b| (l.min(*b), h.max(*b)));
        // From a weight that leaves every mode to one that takes every mode which bends at all.
        let (rough, smooth) = ((1e-4 / high).ln(), (1e3 / low).ln());
        (rough + (smooth - rough) * position / (TRIED - 1) as f64).exp()
    }

    fn weighed(&self, modes: &[Vector2<f64>], position: f64) -> Weighed {
        let mu = self.weight(position);
        let (mut residual, mut bending, mut freedoms) = (0.0, 0.0, 0.0);
        for (c, b) in modes.iter().zip(&self.bending) {
            let kept = 1.0 / (1.0 + mu * b);
            let square = c.norm_squared();
            residual += (1.0 - kept).powi(2) * square;
            bending += b * kept * kept * square;
            freedoms += kept;
        }
        let count = 2.0 * modes.len() as f64;
        Weighed {
            log_weight: (mu / self.weight(0.0)).log10(),
            residual: (residual / count).sqrt(),
            bending: (bending / count).sqrt(),
            freedoms,
        }
    }

    /// What a rule wants to be least, at a position among the weights.
    fn price(&self, modes: &[Vector2<f64>], rule: WeightRule, position: f64) -> f64 {
        let m = modes.len() as f64;
        match rule {
            WeightRule::Evidence => {
                let mu = self.weight(position);
                // Logarithms of products of a few: none of them comes near the smallest number.
                let (mut price, mut product) = (0.0, 1.0_f64);
                for (k, (c, b)) in modes.iter().zip(&self.bending).filter(|(_, b)| **b > 0.0).enumerate() {
                    let taken = mu * b / (1.0 + mu * b);
                    price += taken * c.norm_squared();
                    product *= taken;
                    if k % AT_ONCE == AT_ONCE - 1 {
                        price -= 2.0 * product.ln();
                        product = 1.0;
                    }
                }
                price - 2.0 * product.ln()
            }
            WeightRule::Discrepancy => {
                // The residual grows with the weight; the largest allowed one is where it crosses 1.
                let off = self.weighed(modes, position).residual - 1.0;
                if off > 0.0 { 1e3 + off } else { -position }
            }
            WeightRule::CrossValidation => {
                let w = self.weighed(modes, position);
                w.residual.powi(2) / (1.0 - w.freedoms / m).max(1e-9).powi(2)
            }
        }
    }

    /// The motion smoothed with the weight that a rule chooses. `motion_px` is that of the marks, in their order.
    pub fn smooth(&self, motion_px: &[Vector2<f64>], rule: WeightRule) -> Smoothed {
        let modes = self.in_modes(motion_px);
        let position = self.chosen(&modes, rule);
        let likely = if rule == WeightRule::Evidence { position } else { self.chosen(&modes, WeightRule::Evidence) };
        let [kept, open] = [position, likely].map(|p| {
            let mu = self.weight(p);
            self.bending.iter().map(|b| 1.0 / (1.0 + mu * b)).collect::<Vec<f64>>()
        });
        let mut spread_px = self.shapes.clone();
        let mut motion_px = vec![Vector2::zeros(); self.places.len()];
        let mut off_px = motion_px.clone();
        let taken: Vec<_> =
            modes.iter().zip(kept.iter().zip(&open)).map(|(c, (h, o))| (c * *h, c * (o - h), o.sqrt())).collect();
        for ((mut place, motion), off) in spread_px.column_iter_mut().zip(&mut motion_px).zip(&mut off_px) {
            for (value, (kept, beyond, root)) in place.iter_mut().zip(&taken) {
                *motion += kept * *value;
                *off += beyond * *value;
                *value *= *root;
            }
        }
        Smoothed { motion_px, spread_px, off_px, weighed: self.weighed(&modes, position) }
    }

    /// Where among the weights a rule's own lies.
    fn chosen(&self, modes: &[Vector2<f64>], rule: WeightRule) -> f64 {
        let price = |p: f64| self.price(modes, rule, p);
        let least = |positions: &mut dyn Iterator<Item = usize>| {
            positions.map(|p| (p, price(p as f64))).fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a })
        };
        let (about, _) = least(&mut (0..TRIED).step_by(COARSE));
        let best = least(&mut (about.saturating_sub(COARSE)..(about + COARSE + 1).min(TRIED)));
        // Golden section between the neighbours of the best.
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = ((best.0 as f64 - 1.0).max(0.0), (best.0 as f64 + 1.0).min((TRIED - 1) as f64));
        for _ in 0..NARROWED {
            let [a, b] = [high - ratio * (high - low), low + ratio * (high - low)];
            if price(a) <= price(b) { high = b } else { low = a }
        }
        let middle = 0.5 * (low + high);
        if price(middle) <= best.1 { middle } else { best.0 as f64 }
    }

    /// The L-curve: every third weight tried, from the roughest to the smoothest.
    pub fn l_curve(&self, motion_px: &[Vector2<f64>]) -> Vec<Weighed> {
        let modes = self.in_modes(motion_px);
        (0..TRIED).step_by(3).map(|p| self.weighed(&modes, p as f64)).collect()
    }
}

/// B over the marks, over the vertices around them, and between.
struct Energy {
    /// Lower triangle of B_rr.
    rows: Vec<Triplet<usize, usize, f64>>,
    /// B_rm.
    beside: Mat<f64>,
    /// The vertices r.
    inner: Vec<u32>,
    /// B_mm.
    own: Mat<f64>,
}

impl Energy {
    fn new(mesh: &Mesh, at: &[Point3<f64>], marked: &[u32]) -> Option<Self> {
        let near = near(mesh, at, marked);
        // (L u)_i = Σ_j w_ij (u_i − u_j) on the triangles that lie near the marks as a whole.
        let mut laplacian: HashMap<u32, HashMap<u32, f64>> = HashMap::new();
        let mut area: HashMap<u32, f64> = HashMap::new();
        for &t in mesh.triangles().iter().filter(|t| t.iter().all(|&v| near[v as usize])) {
            for k in 0..3 {
                let [o, a, b] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                let [p, q] = [a, b].map(|v| at[v as usize] - at[o as usize]);
                let doubled = p.cross(&q).norm();
                *area.entry(o).or_default() += doubled / 6.0;
                if doubled <= 0.0 {
                    continue;
                }
                let half_cotangent = 0.5 * p.dot(&q) / doubled;
                for (i, j) in [(a, b), (b, a)] {
                    let row = laplacian.entry(i).or_default();
                    *row.entry(i).or_default() += half_cotangent;
                    *row.entry(j).or_default() -= half_cotangent;
                }
            }
        }
        let place: HashMap<u32, usize> = marked.iter().enumerate().map(|(k, &v)| (v, k)).collect();
        if !marked.iter().all(|v| laplacian.contains_key(v)) {
            return None;
        }
        let mut inner: Vec<u32> = laplacian.keys().copied().filter(|v| !place.contains_key(v)).collect();
        inner.sort_unstable();
        let inside: HashMap<u32, usize> = inner.iter().enumerate().map(|(k, &v)| (v, k)).collect();
        let mut own = Mat::zeros(marked.len(), marked.len());
        let mut beside = Mat::zeros(inner.len(), marked.len());
        let mut rows = Vec::new();
        let mut ordered: Vec<u32> = laplacian.keys().copied().collect();
        ordered.sort_unstable();
        for v in ordered {
            let mut row: Vec<(u32, f64)> = laplacian[&v].iter().map(|(&j, &w)| (j, w)).collect();
            row.sort_unstable_by_key(|r| r.0);
            let per_area = 1.0 / area.get(&v).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
            for &(i, wi) in &row {
                for &(j, wj) in &row {
                    let value = wi * wj * per_area;
                    match (place.get(&i), inside.get(&i), place.get(&j), inside.get(&j)) {
                        (Some(&i), _, Some(&j), _) => own[(i, j)] += value,
                        (_, Some(&i), Some(&j), _) => beside[(i, j)] += value,
                        (_, Some(&i), _, Some(&j)) if j <= i => rows.push(Triplet::new(i, j, value)),
                        _ => {}
                    }
                }
            }
        }
        Some(Self { rows, beside, inner, own })
    }
}

/// Whether each vertex lies within [`COLLAR_MM`] of a marked one, along the edges; the direct neighbours always do.
fn near(mesh: &Mesh, at: &[Point3<f64>], marked: &[u32]) -> Vec<bool> {
    /// A vertex and how far it is, the nearest first in a heap.
    #[derive(PartialEq)]
    struct Reached(f64, u32);
    impl Eq for Reached {}
    impl Ord for Reached {
        fn cmp(&self, other: &Self) -> std::cmp::Ordering {
            other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
        }
    }
    impl PartialOrd for Reached {
        fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
            Some(self.cmp(other))
        }
    }
    let mut far = vec![f64::INFINITY; mesh.len()];
    let mut heap = BinaryHeap::new();
    for &v in marked {
        far[v as usize] = 0.0;
        heap.push(Reached(0.0, v));
    }
    while let Some(Reached(here, v)) = heap.pop() {
        if here > far[v as usize] {
            continue;
        }
        for &j in mesh.neighbours(v as usize) {
            let there = here + (at[v as usize] - at[j as usize]).norm();
            if there <= COLLAR_MM && there < far[j as usize] {
                far[j as usize] = there;
                heap.push(Reached(there, j));
            }
        }
    }
    let mut near: Vec<bool> = far.iter().map(|d| d.is_finite()).collect();
    for &v in marked {
        for &j in mesh.neighbours(v as usize) {
            near[j as usize] = true;
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{Noise, right_angled};

    /// A bent 11 × 11 sheet of pitch 8 mm; two of three vertices of its middle are marked.
    fn sheet() -> (Mesh, Vec<u32>) {
        let flat = right_angled(11, 11, 8.0, 8.0);
        let bend = |p: &Point3<f64>| Point3::new(p.x - 0.3 * p.y, p.y, -(p.x - 40.0).powi(2) / 200.0);
        let mesh = flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap();
        let marked =
            (0..121).filter(|v| (2..9).contains(&(v % 11)) && (2..9).contains(&(v / 11)) && v % 3 != 0).collect();
        (mesh, marked)
    }

    fn others(marked: &[u32]) -> Vec<u32> {
        (0..121).filter(|v| !marked.contains(v)).collect()
    }

    /// What is minimised, from its definition: the bending is the Laplacian's square over the area of each vertex.
    fn price(mesh: &Mesh, near: &[u32], marked: &[u32], sigma: f64, mu: f64, y: &[f64], u: &[f64]) -> f64 {
        let x = mesh.positions();
        let (mut lu, mut area) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for t in mesh.triangles().iter().filter(|t| t.iter().all(|v| near.contains(v))) {
            for k in 0..3 {
                let [o, a, b] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]].map(|v| v as usize);
                let angle = (x[a] - x[o]).angle(&(x[b] - x[o]));
                let flow = 0.5 / angle.tan() * (u[a] - u[b]);
                lu[a] += flow;
                lu[b] -= flow;
                area[o] += (x[a] - x[o]).cross(&(x[b] - x[o])).norm() / 6.0;
            }
        }
        let bending: f64 = lu.iter().zip(&area).filter(|(_, a)| **a > 0.0).map(|(l, a)| l * l / a).sum();
        let misses: f64 = marked.iter().zip(y).map(|(&v, y)| (u[v as usize] - y).powi(2) / (sigma * sigma)).sum();
        misses + mu * bending
    }

    #[test]
    fn the_motion_has_the_least_price_of_all_motions() {
        let (mesh, marked) = sheet();
        let sigma = 0.7;
        let plate = Plate::new(&mesh, mesh.positions(), &marked, &vec![sigma; marked.len()], &others(&marked)).unwrap();
        let mut noise = Noise(5);
        let y: Vec<Vector2<f64>> = marked.iter().map(|_| Vector2::new(noise.normal(), noise.normal()) * 3.0).collect();
        let smooth = plate.smooth(&y, WeightRule::Discrepancy);
        // The weight that was taken, from its place among those tried.
        let mu = plate.weight(0.0) * 10.0_f64.powf(smooth.weighed.log_weight);
        let near = plate.places().to_vec();
        assert!(near.len() > marked.len() + 20, "the plate goes on beyond the marks: {}", near.len());
        for axis in 0..2 {
            let of_y: Vec<f64> = y.iter().map(|y| y[axis]).collect();
            let mut u = vec![0.0; mesh.len()];
            for (&v, m) in near.iter().zip(&smooth.motion_px) {
                u[v as usize] = m[axis];
            }
            let price_at = |u: &[f64]| price(&mesh, &near, &marked, sigma, mu, &of_y, u);
            let least = price_at(&u);
            for &v in near.iter().step_by(3) {
                // The price is a parabola: its slope by central differences is exact.
                let mut moved = u.clone();
                let h = 1e-3;
                moved[v as usize] += h;
                let up = price_at(&moved);
                moved[v as usize] -= 2.0 * h;
                let slope = (up - price_at(&moved)) / (2.0 * h);
                assert!(slope.abs() < 1e-6 * least.max(1.0), "vertex {v}: {slope} of {least}");
            }
        }
    }

    #[test]
    fn a_shift_of_all_skin_is_not_smoothed_away() {
        let (mesh, marked) = sheet();
        let plate = Plate::new(&mesh, mesh.positions(), &marked, &vec![1.0; marked.len()], &others(&marked)).unwrap();
        let shift = Vector2::new(4.0, -7.0);
        for rule in WeightRule::ALL {
            let smooth = plate.smooth(&vec![shift; marked.len()], rule);
            assert!(smooth.motion_px.iter().all(|m| (m - shift).norm() < 1e-6), "{}", rule.name());
        }
    }

    #[test]
    fn the_discrepancy_rule_misses_the_marks_by_their_stated_error() {
        let (mesh, marked) = sheet();
        let plate = Plate::new(&mesh, mesh.positions(), &marked, &vec![0.5; marked.len()], &[]).unwrap();
        let mut noise = Noise(9);
        let rough = |v: &u32| {
            let p = mesh.positions()[*v as usize];
            Vector2::new(10.0 * (p.x / 20.0).sin(), 8.0 * (p.y / 25.0).cos())
                + Vector2::new(noise.normal(), noise.normal()) * 0.5
        };
        let y: Vec<Vector2<f64>> = marked.iter().map(rough).collect();
        let smooth = plate.smooth(&y, WeightRule::Discrepancy);
        let square: f64 = y.iter().zip(&smooth.motion_px).map(|(y, u)| (y - u).norm_squared()).sum();
        let rms = (square / (2.0 * y.len() as f64)).sqrt();
        assert!((rms - 0.5).abs() < 0.005 && (smooth.weighed.residual - 1.0).abs() < 0.01, "{rms}");
        // Along the L-curve the residual grows and the bending falls.
        let curve = plate.l_curve(&y);
        assert!(curve.windows(2).all(|w| w[0].residual <= w[1].residual && w[0].bending >= w[1].bending));
        assert!(curve[0].freedoms > 0.99 * y.len() as f64 && curve[curve.len() - 1].freedoms < 2.0);
    }

    #[test]
    fn intervals_cover_motions_that_are_as_smooth_as_the_plate_expects() {
        let (mesh, marked) = sheet();
        let plate = Plate::new(&mesh, mesh.positions(), &marked, &vec![0.6; marked.len()], &[]).unwrap();
        let m = marked.len();
        let mu = plate.weight(70.0);
        let mut noise = Noise(11);
        for rule in [WeightRule::Evidence, WeightRule::Discrepancy] {
            let (mut inside, mut all) = (0, 0);
            for _ in 0..200 {
                // A motion drawn from what the plate takes for likely: every bending mode with variance 1 / (μ Λ).
                let mut truth = vec![Vector2::zeros(); m];
                for (k, b) in plate.bending.iter().enumerate().filter(|(_, b)| **b > 0.0) {
                    let c = Vector2::new(noise.normal(), noise.normal()) / (mu * b).sqrt();
                    for (t, s) in truth.iter_mut().zip(plate.shapes.row(k).iter()) {
                        *t += c * *s;
                    }
                }
                let y: Vec<Vector2<f64>> =
                    truth.iter().map(|t| t + Vector2::new(noise.normal(), noise.normal()) * 0.6).collect();
                let smooth = plate.smooth(&y, rule);
                for (k, t) in truth.iter().enumerate() {
                    let spread = smooth.spread_px.column(k).norm_squared();
                    for axis in 0..2 {
                        let error = smooth.motion_px[k][axis] - t[axis];
                        let bar = (spread + smooth.off_px[k][axis].powi(2)).sqrt();
                        inside += usize::from(error.abs() < 1.96 * bar);
                        all += 1;
                    }
                }
            }
            let share = f64::from(inside as u32) / f64::from(all as u32);
            assert!((0.93..=0.97).contains(&share), "{}: {share}", rule.name());
        }
    }

    #[test]
    fn what_cannot_be_smoothed_is_left() {
        let (mesh, marked) = sheet();
        let few = &marked[..FEWEST_MARKS - 1];
        assert!(Plate::new(&mesh, mesh.positions(), few, &vec![1.0; few.len()], &[]).is_none());
        assert!(Plate::new(&mesh, mesh.positions(), &marked, &[1.0], &[]).is_none());
    }
}
