//! Errors of estimates where the errors of the data go together.

use nalgebra::{DMatrix, Vector3};

use crate::forces::Cause;

/// Unknowns whose variance is so many times what each would have alone are told by rounding errors only.
const UNTOLD: f64 = 1e12;

/// What the causes of error do to a weighted least-squares problem with rows J.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Together {
    /// Jᵀe of every cause: a row an unknown, a column a cause.
    pub(super) slopes: DMatrix<f64>,
    /// Σ |e|² over all causes.
    pub(super) squares: f64,
}

impl Together {
    /// From the vectors of J's columns at every sample, and causes that are reduced and weighted as the data are; none without causes.
    pub(super) fn new(
        unknowns: usize,
        causes: &[Cause],
        row: impl Fn(usize, usize, &Vector3<f64>) -> f64,
    ) -> Option<Self> {
        let squares: f64 = causes.iter().flatten().map(|(_, e)| e.norm_squared()).sum();
        let slope = |u: usize, c: usize| causes[c].iter().map(|(i, e)| row(u, *i as usize, e)).sum();
        let slopes = DMatrix::from_fn(unknowns, causes.len(), slope);
        (squares > 0.0).then_some(Self { slopes, squares })
    }

    /// Covariance of the unknowns `inner`, whose (JᵀJ)⁻¹ is `inverse` and whose diagonal of JᵀJ is `own`; and what Σ r² is to be expected.
    ///
    /// ```text
    /// Cov = (JᵀJ)⁻¹ (Σ_c g_c g_cᵀ) (JᵀJ)⁻¹,    g_c = Jᵀ e_c
    /// E Σ r² = Σ_c (|e_c|² − g_cᵀ (JᵀJ)⁻¹ g_c)
    /// ```
    pub(super) fn covariance(&self, inner: &[usize], inverse: &DMatrix<f64>, own: &[f64]) -> (DMatrix<f64>, f64) {
        let slopes = self.slopes.select_rows(inner);
        let moved = inverse * &slopes;
        let mut covariance = &moved * moved.transpose();
        for (a, own) in own.iter().enumerate() {
            if inverse[(a, a)] * own > UNTOLD {
                covariance[(a, a)] = covariance[(a, a)].max(inverse[(a, a)]);
            }
        }
        (covariance, (self.squares - slopes.dot(&moved)).max(0.0))
    }
}

/// By how much variances grow where more is left than the errors of the data explain (Birge 1932); they never shrink.
pub(super) fn excess(left: f64, expected: f64) -> f64 {
    if expected > 0.0 { (left / expected).max(1.0) } else { 1.0 }
}
