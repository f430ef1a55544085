//! Cholesky factors of small symmetric matrices in place, without allocation, for the inside of a fit.

/// Pivots below this share of their diagonal entry are rounding errors: the column depends on those before it.
const DEPENDENT: f64 = 1e-13;

/// Factors a symmetric `n` × `n` matrix (rows one after the other, lower triangle read) into L Lᵀ in place. A column that depends on
/// those before it, or is zero, is dropped: its unknown becomes 0 in [`solve`]. Returns how many were dropped.
pub(crate) fn factor(a: &mut [f64], n: usize) -> usize {
    let mut dropped = 0;
    for j in 0..n {
        let before = a[j * n + j];
        let mut pivot = before;
        for k in 0..j {
            pivot -= a[j * n + k] * a[j * n + k];
        }
        if !(pivot > DEPENDENT * before && pivot.is_finite()) {
            dropped += 1;
            // An infinite pivot makes the column vanish from every product.
            a[j * n..j * n + j].fill(0.0);
            a[j * n + j] = f64::INFINITY;
            for i in j + 1..n {
                a[i * n + j] = 0.0;
            }
            continue;
        }
        let root = pivot.sqrt();
        a[j * n + j] = root;
        for i in j + 1..n {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            a[i * n + j] = sum / root;
        }
    }
    dropped
}

/// Solves L Lᵀ x = b in place, with the factor of [`factor`].
pub(crate) fn solve(l: &[f64], n: usize, b: &mut [f64]) {
    forward(l, n, b);
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= l[k * n + i] * b[k];
        }
        b[i] = sum / l[i * n + i];
    }
}

/// Solves L y = b in place.
pub(crate) fn forward(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= l[i * n + k] * b[k];
        }
        b[i] = sum / l[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_by_hand() {
        // [4 2; 2 5] = L Lᵀ with L = [2 0; 1 2]; L Lᵀ x = (8, 9) has x = (11/8, 5/4).
        let mut a = [4.0, 2.0, 2.0, 5.0];
        assert_eq!(factor(&mut a, 2), 0);
        assert_eq!([a[0], a[2], a[3]], [2.0, 1.0, 2.0]);
        let mut b = [8.0, 9.0];
        solve(&a, 2, &mut b);
        assert_eq!(b, [11.0 / 8.0, 1.25]);
    }

    #[test]
    fn a_column_that_depends_on_others_gets_nothing() {
        // The second column is twice the first, the third is zero: (1, 2, 0) is answered by the first alone.
        let mut a = [1.0, 2.0, 0.0, 2.0, 4.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(factor(&mut a, 3), 2);
        let mut b = [1.0, 2.0, 0.0];
        solve(&a, 3, &mut b);
        assert_eq!(b, [1.0, 0.0, 0.0]);
    }
}
