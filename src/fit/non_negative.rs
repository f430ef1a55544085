//! Least squares with strengths that cannot be negative: the exact solution, by an active set on the normal matrix.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// A column whose part outside the columns in use is shorter than this share of it is taken to lie in their span. The normal
/// matrix knows a squared length to a few parts in 1e16, and so an angle to 1e-8; this leaves some digits of a strength.
const INDEPENDENT: f64 = 1e-6;
/// A gradient counts as zero below this share of ‖column‖ ‖observations‖.
const LEVEL: f64 = 1e-10;

/// ‖A x − b‖² as what is needed of it: AᵀA, Aᵀb and bᵀb. Sums of it over parts of the observations add up, which makes leaving
/// out a part cheap.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalEquations {
    /// AᵀA, k × k.
    pub gram: DMatrix<f64>,
    /// Aᵀb, k.
    pub moment: DVector<f64>,
    /// bᵀb.
    pub square: f64,
}

impl NormalEquations {
    /// Of no observation yet.
    pub fn zeros(columns: usize) -> Self {
        Self { gram: DMatrix::zeros(columns, columns), moment: DVector::zeros(columns), square: 0.0 }
    }

    /// Of a matrix and its observations.
    pub fn of(a: &DMatrix<f64>, b: &DVector<f64>) -> Self {
        let mut gram = DMatrix::zeros(a.ncols(), a.ncols());
        for i in 0..a.ncols() {
            for j in 0..=i {
                gram[(i, j)] = a.column(i).dot(&a.column(j));
                gram[(j, i)] = gram[(i, j)];
            }
        }
        Self { gram, moment: a.tr_mul(b), square: b.norm_squared() }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.moment.len()
    }

    /// Whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.moment.is_empty()
    }

    /// ‖A x − b‖², not below zero.
    pub fn cost(&self, x: &DVector<f64>) -> f64 {
        (x.dot(&(&self.gram * x)) - 2.0 * x.dot(&self.moment) + self.square).max(0.0)
    }

    /// Takes in the observations of `part`.
    pub fn add(&mut self, part: &Self) {
        self.gram += &part.gram;
        self.moment += &part.moment;
        self.square += part.square;
    }

    /// These without the observations of `part`.
    #[must_use]
    pub fn without(&self, part: &Self) -> Self {
        Self {
            gram: &self.gram - &part.gram,
            moment: &self.moment - &part.moment,
            square: (self.square - part.square).max(0.0),
        }
    }
}

/// Why the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// At the minimum: the conditions of Karush, Kuhn and Tucker hold.
    Minimum,
    /// After more exchanges than a problem of this size takes: rounding leads in a circle. Not a solution.
    Circle,
    /// A number is not finite. Not a solution.
    NotFinite,
}

/// The least squares solution without negative strengths.
#[derive(Clone, Debug, PartialEq)]
pub struct NonNegative {
    /// x ≥ 0, one a column.
    pub strengths: DVector<f64>,
    /// ‖A x − b‖².
    pub cost: f64,
    /// The columns with a strength above zero, in ascending order.
    pub active: Vec<usize>,
    /// Columns that lie in the span of those in use, so that the data cannot tell them from those: they were left at zero.
    pub collinear: Vec<usize>,
    /// Columns of zeros: the data say nothing about them.
    pub silent: Vec<usize>,
    /// Linear systems solved.
    pub solves: usize,
    /// Why it ended.
    pub ended: Ended,
}

/// min ‖A x − b‖² over x ≥ 0, with x_j = 0 for columns that are not `allowed` (absent: all are).
///
/// The active set of Lawson and Hanson (*Solving Least Squares Problems*, 1974, chapter 23): the column along which the cost falls
/// steepest joins the set in use; the unconstrained solution on the set is stepped to until a strength would turn negative, and
/// that one leaves. It ends where no gradient Aᵀ(b − A x) is above zero outside the set: since the problem is convex, that is the
/// minimum (Karush, Kuhn, Tucker), and with independent columns the only one.
///
/// It works on the normal matrix, with columns scaled to length 1: there are few columns (18) and many rows (1836), and the search
/// over sets of muscles and the patches left out ask for hundreds of solutions on sums of the same matrices. Squaring halves the
/// digits, so a column is used only where at least 1e-6 of it lies outside the span of the others; else it is named in
/// `collinear`. The factor AᵀA = L Lᵀ of the set in use is not made anew at each exchange: a column joins by one row of L, and one
/// that leaves takes the rows after it along, which then join again.
pub fn solve(normal: &NormalEquations, allowed: Option<&[bool]>) -> NonNegative {
    let k = normal.len();
    let lengths: Vec<f64> = (0..k).map(|j| normal.gram[(j, j)].max(0.0).sqrt()).collect();
    let mut out = NonNegative {
        strengths: DVector::zeros(k),
        cost: normal.square,
        active: Vec::new(),
        collinear: Vec::new(),
        silent: (0..k).filter(|&j| lengths[j] == 0.0).collect(),
        solves: 0,
        ended: Ended::Minimum,
    };
    if !normal.square.is_finite() || !normal.gram.iter().chain(normal.moment.iter()).all(|v| v.is_finite()) {
        out.ended = Ended::NotFinite;
        return out;
    }
    let scale = DVector::from_fn(k, |j, _| if lengths[j] > 0.0 { 1.0 / lengths[j] } else { 0.0 });
    let gram = DMatrix::from_fn(k, k, |i, j| normal.gram[(i, j)] * scale[i] * scale[j]);
    let moment = normal.moment.component_mul(&scale);
    let usable: Vec<bool> = (0..k).map(|j| lengths[j] > 0.0 && allowed.is_none_or(|allowed| allowed[j])).collect();

    let mut search = Search { x: vec![0.0; k], set: Factor::new(k), gram: &gram, moment: &moment };
    let level = LEVEL * normal.square.sqrt();
    let mut open = usable.clone();
    // Each exchange lowers the cost, so no set comes twice; with rounding one might.
    let mut patience = 10 * k + 20;
    while let Some(j) = search.steepest(&open, level) {
        if !search.set.join(&gram, j) || !search.exchange(&mut out.solves, &mut patience) {
            // In the span of the set, or its slope was no more than rounding: not before the set is another.
            open[j] = false;
        } else {
            open.copy_from_slice(&usable);
        }
        if patience == 0 {
            out.ended = Ended::Circle;
            break;
        }
    }
    for (j, value) in search.x.iter().enumerate() {
        out.strengths[j] = value * scale[j];
    }
    out.cost = normal.cost(&out.strengths);
    out.active = (0..k).filter(|&j| search.x[j] > 0.0).collect();
    let in_span =
        |j: &usize| usable[*j] && search.x[*j] == 0.0 && search.set.outside(&gram, *j).1 < INDEPENDENT * INDEPENDENT;
    out.collinear = (0..k).filter(in_span).collect();
    out
}

/// The search on scaled columns.
struct Search<'a> {
    /// One a column; above zero only in the set.
    x: Vec<f64>,
    set: Factor,
    gram: &'a DMatrix<f64>,
    moment: &'a DVector<f64>,
}

impl Search<'_> {
    /// The open column outside the set along which the cost falls steepest, where it falls by more than `level`.
    fn steepest(&self, open: &[bool], level: f64) -> Option<usize> {
        let slope = |j: usize| {
            let along: f64 = self.set.columns.iter().map(|&i| self.gram[(i, j)] * self.x[i]).sum();
            self.moment[j] - along
        };
        (0..self.x.len())
            .filter(|&j| open[j] && !self.set.columns.contains(&j))
            .map(|j| (j, slope(j)))
            .filter(|(_, slope)| *slope > level)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(j, _)| j)
    }

    /// Goes to the solution on the set, in which the last column has just joined; columns that would turn negative leave. False,
    /// with that column taken back, where only rounding had let it in.
    fn exchange(&mut self, solves: &mut usize, patience: &mut usize) -> bool {
        let mut first = true;
        while *patience > 0 {
            *patience -= 1;
            *solves += 1;
            let z = self.set.solution(self.moment);
            if std::mem::take(&mut first) && z.last().is_some_and(|last| *last <= 0.0) {
                self.set.leave(self.gram, z.len() - 1);
                return false;
            }
            let stays = |(i, z): (&usize, &f64)| if *z > 0.0 { 1.0 } else { self.x[*i] / (self.x[*i] - z) };
            let step = self.set.columns.iter().zip(&z).map(stays).fold(1.0, f64::min);
            if step >= 1.0 {
                for (&i, z) in self.set.columns.iter().zip(&z) {
                    self.x[i] = *z;
                }
                return true;
            }
            let mut left = Vec::new();
            for (at, (&i, z)) in self.set.columns.iter().zip(&z).enumerate() {
                if stays((&i, z)) <= step {
                    left.push(at);
                }
            }
            for (&i, z) in self.set.columns.iter().zip(&z) {
                self.x[i] += step * (z - self.x[i]);
            }
            for at in left.into_iter().rev() {
                self.x[self.set.columns[at]] = 0.0;
                self.set.leave(self.gram, at);
            }
        }
        false
    }
}

/// The Cholesky factor L of the rows and columns of a Gram matrix that are in use, in the order in which they joined.
struct Factor {
    columns: Vec<usize>,
    /// L by rows, each as long as it is full.
    rows: Vec<Vec<f64>>,
}

impl Factor {
    fn new(columns: usize) -> Self {
        Self { columns: Vec::with_capacity(columns), rows: Vec::with_capacity(columns) }
    }

    /// The row of L with which column `j` would join (without its diagonal), and the square of that diagonal: the share of the
    /// column that lies outside the span of those in use, for columns of length 1.
    fn outside(&self, gram: &DMatrix<f64>, j: usize) -> (Vec<f64>, f64) {
        let mut row: Vec<f64> = Vec::with_capacity(self.columns.len() + 1);
        for (&i, above) in self.columns.iter().zip(&self.rows) {
            let known: f64 = above.iter().zip(&row).map(|(l, r)| l * r).sum();
            row.push((gram[(i, j)] - known) / above[row.len()]);
        }
        let left = gram[(j, j)] - row.iter().map(|l| l * l).sum::<f64>();
        (row, left)
    }

    /// Takes a column in; false where it lies in the span of those in use.
    fn join(&mut self, gram: &DMatrix<f64>, j: usize) -> bool {
        let (mut row, left) = self.outside(gram, j);
        if left < INDEPENDENT * INDEPENDENT {
            return false;
        }
        row.push(left.sqrt());
        self.rows.push(row);
        self.columns.push(j);
        true
    }

    /// Lets the column at place `at` go. Those after it join again, which they can: they are independent of fewer now.
    fn leave(&mut self, gram: &DMatrix<f64>, at: usize) {
        let after = self.columns.split_off(at);
        self.rows.truncate(at);
        for &j in &after[1..] {
            let (mut row, left) = self.outside(gram, j);
            row.push(left.max(INDEPENDENT * INDEPENDENT).sqrt());
            self.rows.push(row);
            self.columns.push(j);
        }
    }

    /// z with L Lᵀ z = the moments of the columns in use.
    fn solution(&self, moment: &DVector<f64>) -> Vec<f64> {
        let n = self.columns.len();
        let mut z = Vec::with_capacity(n);
        for (&i, row) in self.columns.iter().zip(&self.rows) {
            let known: f64 = row.iter().zip(&z).map(|(l, y)| l * y).sum();
            z.push((moment[i] - known) / row[z.len()]);
        }
        for at in (0..n).rev() {
            z[at] /= self.rows[at][at];
            let value = z[at];
            for (z, l) in z[..at].iter_mut().zip(&self.rows[at]) {
                *z -= l * value;
            }
        }
        z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// The least cost over all 2^k sets: on each the plain solution by Householder's reflections of the matrix itself, where no
    /// strength is negative. Sets with dependent columns are left out: the minimum is reached without them as well.
    fn by_trying_all(a: &DMatrix<f64>, b: &DVector<f64>) -> (f64, DVector<f64>) {
        let k = a.ncols();
        let mut best = (b.norm_squared(), DVector::zeros(k));
        for set in 1..1_usize << k {
            let columns: Vec<usize> = (0..k).filter(|j| set >> j & 1 == 1 && a.column(*j).norm() > 0.0).collect();
            let part =
                DMatrix::from_fn(a.nrows(), columns.len(), |i, j| a[(i, columns[j])] / a.column(columns[j]).norm());
            if columns.is_empty() || columns.len() > a.nrows() {
                continue;
            }
            let qr = part.clone().qr();
            let r = qr.r();
            if r.diagonal().amin() < 1e-8 {
                continue;
            }
            let z = r.solve_upper_triangular(&qr.q().tr_mul(b)).unwrap();
            let cost = (&part * &z - b).norm_squared();
            if z.iter().all(|z| *z >= 0.0) && cost < best.0 {
                best.0 = cost;
                best.1.fill(0.0);
                for (&j, z) in columns.iter().zip(z.iter()) {
                    best.1[j] = *z / a.column(j).norm();
                }
            }
        }
        best
    }

    /// The conditions of Karush, Kuhn and Tucker on the matrix itself, not on the normal equations.
    fn conditions_hold(a: &DMatrix<f64>, b: &DVector<f64>, found: &NonNegative) {
        assert_eq!(found.ended, Ended::Minimum);
        let gradient = a.tr_mul(&(b - a * &found.strengths));
        for j in 0..a.ncols() {
            let scale = a.column(j).norm() * b.norm() + 1e-300;
            let slope = gradient[j] / scale;
            assert!(found.strengths[j] >= 0.0);
            assert!(slope < 1e-8, "column {j}: {slope:e}");
            assert!(found.strengths[j] == 0.0 || slope > -1e-8, "column {j}: {slope:e}");
        }
    }

    /// By hand. Columns (1,0,0), (1,1,0), observations (2,−1,5): plainly x = (3, −1). Without a negative strength the second is zero
    /// and the first 2; its residual is (0,−1,5), so the slopes are 0 and −1, and the cost 26.
    #[test]
    fn two_columns_by_hand() {
        let a = DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
        let found = solve(&NormalEquations::of(&a, &DVector::from_vec(vec![2.0, -1.0, 5.0])), None);
        assert!((found.strengths[0] - 2.0).abs() < 1e-14 && found.strengths[1] == 0.0);
        assert!((found.cost - 26.0).abs() < 1e-12);
        assert_eq!((found.active, found.ended), (vec![0], Ended::Minimum));
    }

    /// By hand. Columns (1,1,1), (1,−1,0), (−1,2,0), observations (3,2,−1). The first is steepest, 4/√3 = 2.31 against 0.71 and 0.45,
    /// and joins. But (3,2,0) = 8 (1,−1,0) + 5 (−1,2,0), and the residual (0,0,−1) left by that has the slope −1/√3 along the first: it must
    /// go, at a cost of 1.
    #[test]
    fn a_column_that_joined_first_may_leave() {
        let a = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, -1.0, 1.0, -1.0, 2.0, 1.0, 0.0, 0.0]);
        let found = solve(&NormalEquations::of(&a, &DVector::from_vec(vec![3.0, 2.0, -1.0])), None);
        assert!((&found.strengths - DVector::from_vec(vec![0.0, 8.0, 5.0])).amax() < 1e-12, "{}", found.strengths);
        assert!(found.active == [1, 2] && found.solves > 2 && (found.cost - 1.0).abs() < 1e-12);
    }

    #[test]
    fn random_problems_end_where_trying_all_sets_ends() {
        let mut random = Pcg64::seed_from_u64(5);
        let mut exchanged = 0;
        for case in 0..400 {
            let k = 1 + case % 10;
            let rows = if case % 3 == 0 { k } else { 3 * k + 2 };
            // Shared parts make columns alike, up to a cosine of 0.99 and more, so that some must leave the set again.
            let shared = DVector::from_fn(rows, |_, _| random.random_range(-1.0..1.0));
            let alike = [0.0, 0.5, 1.0, 10.0][case % 4];
            let size = [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3][case % 7];
            let a = DMatrix::from_fn(rows, k, |i, j| {
                (random.random_range(-1.0..1.0) + alike * shared[i]) * if j % 2 == 0 { size } else { 1.0 }
            });
            // A sum with some strengths negative, and noise.
            let sum = (0..k)
                .map(|j| a.column(j) * (random.random_range(-0.6..1.0) / a.column(j).norm()))
                .sum::<DVector<f64>>();
            let b = sum + DVector::from_fn(rows, |_, _| 0.1 * random.random_range(-1.0..1.0));
            let found = solve(&NormalEquations::of(&a, &b), None);
            conditions_hold(&a, &b, &found);
            let (cost, x) = by_trying_all(&a, &b);
            assert!((found.cost - cost).abs() < 1e-9 * b.norm_squared(), "case {case}: {} {cost}", found.cost);
            // Of columns almost in one plane the strengths are not known to more digits, but what they explain is.
            let far = (&a * (&found.strengths - &x)).norm();
            assert!(far < 1e-6 * b.norm(), "case {case}: {far:e}");
            exchanged += usize::from(found.solves > found.active.len());
        }
        assert!(exchanged > 10, "only {exchanged} had a column leave");
    }

    #[test]
    fn columns_in_each_other_s_span_are_named_and_cost_nothing() {
        let mut random = Pcg64::seed_from_u64(6);
        for case in 0..200 {
            let (rows, k) = (24, 4 + case % 5);
            let mut a = DMatrix::from_fn(rows, k, |_, _| random.random_range(-1.0..1.0));
            // A copy, a combination, and a column of zeros.
            let copy = a.column(0) * random.random_range(0.1..4.0);
            a.set_column(1, &copy);
            let mixed = a.column(0) * random.random_range(0.0..2.0) + a.column(2) * random.random_range(0.0..2.0);
            a.set_column(3, &mixed);
            if k > 4 {
                a.column_mut(4).fill(0.0);
            }
            let b = DVector::from_fn(rows, |i, _| a[(i, 0)] + 0.5 * a[(i, 2)] + random.random_range(-0.3..0.3));
            let found = solve(&NormalEquations::of(&a, &b), None);
            conditions_hold(&a, &b, &found);
            let (cost, _) = by_trying_all(&a, &b);
            assert!((found.cost - cost).abs() < 1e-9 * b.norm_squared(), "case {case}: {} {cost}", found.cost);
            assert!(!found.collinear.is_empty(), "case {case}");
            assert_eq!(found.silent, if k > 4 { vec![4] } else { vec![] });
        }
    }

    #[test]
    fn only_allowed_columns_are_used() {
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.0, 0.1]);
        let found = solve(&NormalEquations::of(&a, &DVector::from_vec(vec![1.0, 0.0])), Some(&[false, true]));
        assert_eq!(found.active, [1]);
        // 0.9 / (0.81 + 0.01).
        assert!((found.strengths[1] - 0.9 / 0.82).abs() < 1e-14);
    }

    #[test]
    fn what_is_not_a_number_is_said() {
        let mut normal = NormalEquations::zeros(2);
        assert_eq!(solve(&normal, None).ended, Ended::Minimum);
        assert_eq!(solve(&normal, None).silent, [0, 1]);
        normal.moment[1] = f64::NAN;
        assert_eq!(solve(&normal, None).ended, Ended::NotFinite);
    }

    /// Parts add up: leaving one out is a subtraction.
    #[test]
    fn leaving_observations_out_is_a_subtraction() {
        let mut random = Pcg64::seed_from_u64(7);
        let a = DMatrix::from_fn(30, 4, |_, _| random.random_range(-1.0..1.0));
        let b = DVector::from_fn(30, |_, _| random.random_range(-1.0..1.0));
        let all = NormalEquations::of(&a, &b);
        let part = NormalEquations::of(&a.rows(20, 10).into(), &b.rows(20, 10).into());
        let rest = NormalEquations::of(&a.rows(0, 20).into(), &b.rows(0, 20).into());
        let left = all.without(&part);
        assert!((&left.gram - &rest.gram).amax() < 1e-13 && (left.square - rest.square).abs() < 1e-13);
        let x = DVector::from_element(4, 0.3);
        assert!((rest.cost(&x) - (a.rows(0, 20) * &x - b.rows(0, 20)).norm_squared()).abs() < 1e-12);
    }
}
