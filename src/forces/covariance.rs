//! How quantities that depend on many positions at once err, where a force of a single vertex would not do.

use nalgebra::{DMatrix, Matrix3x6, Matrix6, Vector2, Vector3};

use super::uncertainty::{
    Common, ForceSlopes, MarkInfluence, SpreadInfluence, standard_errors, standard_errors_of_spread,
};

/// How all positions err together.
pub trait Errors {
    /// Standard error of the force on every vertex, N: [`standard_errors`] or [`standard_errors_of_spread`].
    fn of_forces(&self, slopes: &ForceSlopes<'_>) -> Vec<f64>;

    /// Covariance of quantities q_m = Σ_j T_mj · x_j; `rows` holds T, mm⁻¹ of q, a row a quantity, a vector a vertex.
    fn covariance_of(&self, rows: &[Vec<Vector3<f64>>]) -> DMatrix<f64>;
}

impl Errors for MarkInfluence {
    fn of_forces(&self, slopes: &ForceSlopes<'_>) -> Vec<f64> {
        let mut sigma = Vec::new();
        standard_errors(slopes, self, &mut sigma);
        sigma
    }

    /// Σ_k σ_k² A_k A_kᵀ + D (Σ − Σ_k σ_k² G_k G_kᵀ) Dᵀ, where D = T C and A_k = T w_k S_k + D G_k is what mark k changes, also through the head.
    fn covariance_of(&self, rows: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
        let mut of_mark =
            [DMatrix::zeros(rows.len(), self.sigma_px.len()), DMatrix::zeros(rows.len(), self.sigma_px.len())];
        for vertex in 0..self.weights.len() {
            for (mark, weight) in self.weights.row(vertex) {
                let slope = self.slope_mm_per_px[mark] * (weight * self.sigma_px[mark]);
                for (m, row) in rows.iter().enumerate() {
                    for (axis, of_mark) in of_mark.iter_mut().enumerate() {
                        of_mark[(m, mark)] += row[vertex].dot(&slope.column(axis));
                    }
                }
            }
        }
        let mut covariance = DMatrix::zeros(rows.len(), rows.len());
        if let Some(common) = &self.common {
            let through_head = through_head(common, rows);
            let mut beside = common.covariance;
            for (mark, g) in &common.follows {
                let g = g * self.sigma_px[*mark as usize];
                beside -= g * g.transpose();
                for (axis, of_mark) in of_mark.iter_mut().enumerate() {
                    let added = &through_head * g.column(axis);
                    let mut column = of_mark.column_mut(*mark as usize);
                    column += added;
                }
            }
            covariance += with_head(&through_head, &beside);
        }
        of_mark.iter().fold(covariance, |sum, a| sum + a * a.transpose())
    }
}

impl Errors for SpreadInfluence<'_> {
    fn of_forces(&self, slopes: &ForceSlopes<'_>) -> Vec<f64> {
        let mut sigma = Vec::new();
        standard_errors_of_spread(slopes, self, &mut sigma);
        sigma
    }

    /// Σ_axis P g gᵀ Pᵀ + q qᵀ + D Σ Dᵀ, with P = T S by the columns of g, q = P d and D = T C.
    fn covariance_of(&self, rows: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
        let places = self.spread_px.ncols();
        let mut by_place = [DMatrix::zeros(rows.len(), places), DMatrix::zeros(rows.len(), places)];
        for (vertex, column) in self.column.iter().enumerate().filter_map(|(v, c)| Some((v, (*c)? as usize))) {
            for (m, row) in rows.iter().enumerate() {
                let along: Vector2<f64> = self.slope_mm_per_px[vertex].tr_mul(&row[vertex]);
                by_place[0][(m, column)] = along.x;
                by_place[1][(m, column)] = along.y;
            }
        }
        let off = DMatrix::from_fn(rows.len(), 1, |m, _| {
            let terms = self.off_px.iter().enumerate();
            terms.map(|(c, d)| by_place[0][(m, c)] * d.x + by_place[1][(m, c)] * d.y).sum::<f64>()
        });
        let mut covariance = &off * off.transpose();
        for part in &by_place {
            let by_cause = part * self.spread_px.transpose();
            covariance += &by_cause * by_cause.transpose();
        }
        match &self.common {
            None => covariance,
            Some(common) => covariance + with_head(&through_head(common, rows), &common.covariance),
        }
    }
}

/// D: what the head's motion changes, a row a quantity, by its six numbers.
fn through_head(common: &Common, rows: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(rows.len(), 6);
    for (m, row) in rows.iter().enumerate() {
        let turned = |(t, c): (&Vector3<f64>, &Matrix3x6<f64>)| c.tr_mul(t);
        let sum = row.iter().zip(&common.slopes).map(turned).sum::<nalgebra::Vector6<f64>>();
        all.row_mut(m).copy_from(&sum.transpose());
    }
    all
}

fn with_head(through_head: &DMatrix<f64>, covariance: &Matrix6<f64>) -> DMatrix<f64> {
    let covariance = DMatrix::from_column_slice(6, 6, covariance.as_slice());
    through_head * covariance * through_head.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{Noise, shaken, triangular};
    use crate::forces::{Influence, SpringRule, Springs};
    use crate::skin::StressStrainCurve;
    use nalgebra::{Matrix3x2, Matrix6x2};

    /// The trace of the covariance of a force's components is the variance that the closed formula has, for marks as for spreads.
    #[test]
    fn rows_and_the_closed_formula_give_the_same_standard_errors() {
        let mesh = triangular(6, 5, 7.0);
        let n = mesh.len();
        let x = shaken(mesh.positions(), 0.5, 4);
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let slopes = ForceSlopes::of_springs(&springs, &StressStrainCurve::default(), &x, None);
        let mut noise = Noise(23);
        let follows: std::collections::BTreeMap<u32, Matrix6x2<f64>> =
            [3, 17].into_iter().map(|m| (m, Matrix6x2::from_fn(|_, _| 0.02 * noise.uniform()))).collect();
        let root = Matrix6::from_fn(|_, _| 3e-3 * noise.uniform());
        let read: Matrix6<f64> = follows.values().map(|g| g * g.transpose() * 0.49).sum();
        let common = Common {
            slopes: (0..n).map(|_| Matrix3x6::from_fn(|_, _| noise.uniform())).collect(),
            covariance: root * root.transpose() + read,
            follows,
        };
        let slope_mm_per_px: Vec<_> = (0..n).map(|_| Matrix3x2::from_fn(|_, _| 0.3 * noise.uniform())).collect();
        // Three rows a vertex: the components of its force.
        let by_rows = |errors: &dyn Errors| -> Vec<f64> {
            let of_vertex = |i: usize| {
                let mut rows = vec![vec![Vector3::zeros(); n]; 3];
                for (j, b) in slopes.at(i) {
                    for (axis, row) in rows.iter_mut().enumerate() {
                        let along = Vector3::from(b.row(axis).transpose());
                        row[i] += along;
                        row[j] -= along;
                    }
                }
                errors.covariance_of(&rows).trace().sqrt()
            };
            (0..n).map(of_vertex).collect()
        };
        let agree = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * b.max(1e-6));

        let marks = MarkInfluence {
            weights: Influence::from_rows((0..n as u32).map(|i| match i {
                12 => vec![(11, 0.5), (13, 0.5)],
                i => vec![(i, 1.0)],
            })),
            slope_mm_per_px: slope_mm_per_px.clone(),
            sigma_px: vec![0.7; n],
            common: Some(common.clone()),
        };
        let mut closed = Vec::new();
        standard_errors(&slopes, &marks, &mut closed);
        assert!(agree(&by_rows(&marks), &closed));

        let spread_px = DMatrix::from_fn(n, n, |i, j| if i == j { 0.5 } else { 0.1 / (1.0 + i.abs_diff(j) as f64) });
        let off_px: Vec<_> = (0..n).map(|_| Vector2::new(noise.uniform(), noise.uniform()) * 0.1).collect();
        let spread = SpreadInfluence {
            slope_mm_per_px,
            column: (0..n as u32).map(|v| (v != 8).then_some(v)).collect(),
            spread_px: &spread_px,
            off_px: &off_px,
            common: Some(common),
        };
        standard_errors_of_spread(&slopes, &spread, &mut closed);
        assert!(agree(&by_rows(&spread), &closed));
    }
}
