//! The ways in which positions err, one by one: what a quantity that is no force of a single vertex needs for its error.

use nalgebra::{Matrix6, SymmetricEigen, Vector3};

use super::uncertainty::{Common, MarkInfluence, SpreadInfluence};

/// One way to err: how far it takes each vertex, mm. Its size is a standard normal number, independent of those of other ways.
pub type Mode = Vec<(u32, Vector3<f64>)>;

/// How all vertices err together, as independent ways.
pub trait ErrorModes {
    /// The ways: every error of the positions is δx = Σ_k z_k mode_k, z_k ~ N(0, 1).
    fn modes(&self) -> Vec<Mode>;
}

impl ErrorModes for MarkInfluence {
    /// Two ways a mark, along the axes of the picture, each with what the head's motion makes of it, and those in which this motion errs
    /// beside the marks.
    fn modes(&self) -> Vec<Mode> {
        let mut of_mark: Vec<Vec<(u32, f64)>> = vec![Vec::new(); self.sigma_px.len()];
        for vertex in 0..self.weights.len() {
            for (mark, weight) in self.weights.row(vertex) {
                of_mark[mark].push((vertex as u32, weight));
            }
        }
        let mut modes = Vec::with_capacity(2 * of_mark.len() + 6);
        let mut explained = Matrix6::zeros();
        for (mark, follows) in of_mark.iter().enumerate() {
            let sigma = self.sigma_px[mark];
            let through_head = self.common.as_ref().and_then(|c| Some((c, c.follows.get(&(mark as u32))?)));
            if let Some((_, g)) = through_head {
                explained += g * g.transpose() * sigma.powi(2);
            }
            for axis in 0..2 {
                let own = self.slope_mm_per_px[mark].column(axis) * sigma;
                let mut mode: Mode = follows.iter().map(|&(v, weight)| (v, own * weight)).collect();
                if let Some((common, g)) = through_head {
                    let turned = g.column(axis) * sigma;
                    mode.extend(common.slopes.iter().enumerate().map(|(v, c)| (v as u32, c * turned)));
                }
                modes.push(mode);
            }
        }
        modes.extend(self.common.iter().flat_map(|c| of_head(c, &(c.covariance - explained))));
        modes
    }
}

impl ErrorModes for SpreadInfluence<'_> {
    /// Two ways a cause, along the axes of the picture, those of the head, and one in which every place is off by what it is known to be.
    fn modes(&self) -> Vec<Mode> {
        let placed: Vec<(u32, usize)> =
            self.column.iter().enumerate().filter_map(|(v, c)| Some((v as u32, (*c)? as usize))).collect();
        let mut modes = Vec::with_capacity(2 * self.spread_px.nrows() + 7);
        for cause in 0..self.spread_px.nrows() {
            for axis in 0..2 {
                let shift = |&(v, column): &(u32, usize)| {
                    (v, self.slope_mm_per_px[v as usize].column(axis) * self.spread_px[(cause, column)])
                };
                modes.push(placed.iter().map(shift).collect());
            }
        }
        modes.push(placed.iter().map(|&(v, c)| (v, self.slope_mm_per_px[v as usize] * self.off_px[c])).collect());
        modes.extend(self.common.iter().flat_map(|c| of_head(c, &c.covariance)));
        modes
    }
}

/// The six ways in which a head's motion of this covariance errs.
fn of_head(common: &Common, covariance: &Matrix6<f64>) -> Vec<Mode> {
    let eigen = SymmetricEigen::new(*covariance);
    // A variance rounded to just below zero is zero.
    let axes = (0..6).map(|k| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt());
    axes.map(|axis| common.slopes.iter().enumerate().map(|(v, c)| (v as u32, c * axis)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{Noise, shaken, triangular};
    use crate::forces::{ForceSlopes, Influence, SpringRule, Springs, standard_errors, standard_errors_of_spread};
    use crate::skin::StressStrainCurve;
    use nalgebra::{DMatrix, Matrix3x2, Matrix3x6, Matrix6x2, Vector2};

    /// The sum over the ways of the squared change of each force is the variance that the closed formula has, for marks as for spreads.
    #[test]
    fn ways_and_the_closed_formula_give_the_same_standard_errors() {
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
        let by_modes = |modes: Vec<Mode>| -> Vec<f64> {
            let mut variance = vec![0.0; n];
            for mode in modes {
                let mut shift = vec![Vector3::zeros(); n];
                for (v, d) in &mode {
                    shift[*v as usize] += d;
                }
                for (i, variance) in variance.iter_mut().enumerate() {
                    let change: Vector3<f64> = slopes.at(i).map(|(j, b)| b * (shift[i] - shift[j])).sum();
                    *variance += change.norm_squared();
                }
            }
            variance.into_iter().map(f64::sqrt).collect()
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
        assert!(agree(&by_modes(marks.modes()), &closed));

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
        assert!(agree(&by_modes(spread.modes()), &closed));
    }
}
