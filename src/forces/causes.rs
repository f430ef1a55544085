//! How the errors of all forces go together: one independent cause after the other, each with what it does to every vertex.
//!
//! A point of the skin that is marked a little off pulls at all its neighbours, and the head's motion is shared by all. Standard errors
//! vertex by vertex do not tell that; what is made of many forces at once, such as the strength of a muscle, needs to know.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Matrix3x2, Matrix3x6, Matrix6, SymmetricEigen, Vector3, Vector6};

use super::uncertainty::{Common, ForceSlopes, MarkInfluence, SpreadInfluence};

/// What one cause of error does to the forces at one standard deviation: vertices, each once, and N.
pub type Cause = Vec<(u32, Vector3<f64>)>;

/// The causes of the errors that [`super::standard_errors`] sums up: two a mark, and those of the head's motion that no mark explains.
///
/// With e_m and θ as there, δF_i = Σ_m (A_im S_m + D_i G_m) e_m + D_i θ′, where θ′ is what is left of θ without the marks that it is read from:
///
/// Cov θ′ = Σ − Σ_m σ_m² G_m G_mᵀ
///
/// so that Σ over all causes of |δF_i|² is σ_i².
pub fn causes(slopes: &ForceSlopes<'_>, influence: &MarkInfluence) -> Vec<Cause> {
    let mut all = vec![Cause::new(); 2 * influence.sigma_px.len()];
    let read = |common: &Common| -> Matrix6<f64> {
        common.follows.iter().map(|(&m, g)| g * g.transpose() * influence.sigma_px[m as usize].powi(2)).sum()
    };
    let roots = influence.common.as_ref().map(|c| root(&(c.covariance - read(c)))).unwrap_or_default();
    let mut shared_causes = vec![Cause::new(); roots.len()];
    let mut of_marks: BTreeMap<usize, Matrix3<f64>> = BTreeMap::new();
    for i in 0..slopes.len() {
        let mut own = Matrix3::zeros();
        let mut shared = Matrix3x6::zeros();
        for (j, b) in slopes.at(i) {
            own += b;
            for (mark, weight) in influence.weights.row(j) {
                *of_marks.entry(mark).or_insert_with(Matrix3::zeros) -= b * weight;
            }
            if let Some(common) = &influence.common {
                shared += b * (common.slopes[i] - common.slopes[j]);
            }
        }
        for (mark, weight) in influence.weights.row(i) {
            *of_marks.entry(mark).or_insert_with(Matrix3::zeros) += own * weight;
        }
        if let Some(common) = &influence.common {
            // The marks that the head's motion is read from move every vertex.
            for &mark in common.follows.keys() {
                of_marks.entry(mark as usize).or_insert_with(Matrix3::zeros);
            }
        }
        for (mark, sum) in std::mem::take(&mut of_marks) {
            let with_head = influence.common.as_ref().and_then(|c| c.follows.get(&(mark as u32)));
            let with_head = with_head.map_or_else(Matrix3x2::zeros, |g| shared * g);
            let force = (sum * influence.slope_mm_per_px[mark] + with_head) * influence.sigma_px[mark];
            push(&mut all[2 * mark..2 * mark + 2], i, force.column_iter().map(Vector3::from));
        }
        push(&mut shared_causes, i, roots.iter().map(|root| shared * root));
    }
    all.extend(shared_causes);
    all
}

/// The causes of the errors that [`super::standard_errors_of_spread`] sums up: two for every e_k, one for how far the places are known to be off,
/// and those of the head's motion.
pub fn causes_of_spread(slopes: &ForceSlopes<'_>, influence: &SpreadInfluence<'_>) -> Vec<Cause> {
    let count = influence.spread_px.nrows();
    let roots = influence.common.as_ref().map(|c| root(&c.covariance)).unwrap_or_default();
    let mut all = vec![Cause::new(); 2 * count + 1 + roots.len()];
    let mut parts: Vec<(Matrix3x2<f64>, usize)> = Vec::new();
    for i in 0..slopes.len() {
        let mut own = Matrix3::zeros();
        let mut shared = Matrix3x6::zeros();
        parts.clear();
        for (j, b) in slopes.at(i) {
            own += b;
            if let Some(column) = influence.column[j] {
                parts.push((-b * influence.slope_mm_per_px[j], column as usize));
            }
            if let Some(common) = &influence.common {
                shared += b * (common.slopes[i] - common.slopes[j]);
            }
        }
        if let Some(column) = influence.column[i] {
            parts.push((own * influence.slope_mm_per_px[i], column as usize));
        }
        for k in 0..count {
            let force: Matrix3x2<f64> = parts.iter().map(|(a, p)| a * influence.spread_px[(k, *p)]).sum();
            push(&mut all[2 * k..2 * k + 2], i, force.column_iter().map(Vector3::from));
        }
        let off: Vector3<f64> = parts.iter().map(|(a, p)| a * influence.off_px[*p]).sum();
        push(&mut all[2 * count..], i, std::iter::once(off).chain(roots.iter().map(|root| shared * root)));
    }
    all
}

fn push(causes: &mut [Cause], vertex: usize, forces: impl Iterator<Item = Vector3<f64>>) {
    for (cause, force) in causes.iter_mut().zip(forces) {
        if force != Vector3::zeros() {
            cause.push((vertex as u32, force));
        }
    }
}

/// Columns r with Σ r rᵀ = C; where C is not positive, by rounding, or no number, there is none.
fn root(covariance: &Matrix6<f64>) -> Vec<Vector6<f64>> {
    if !covariance.iter().all(|c| c.is_finite()) {
        return Vec::new();
    }
    let eigen = SymmetricEigen::new(*covariance);
    let values = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    values.filter(|(value, _)| **value > 0.0).map(|(value, vector)| vector * value.sqrt()).collect()
}
