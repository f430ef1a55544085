//! Where the neighbours of a marked point say that it went: the motion of the skin about it, without its own mark.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use crate::face::Mesh;

/// Where a point is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The place in the last frame, px.
    pub at: Point2<f64>,
    /// Standard error of a mark about this place along each axis, px: that of the fit and that of the mark together.
    pub sigma_px: f64,
    /// How many neighbours speak.
    pub neighbours: usize,
}

/// Fewer neighbours say nothing.
pub const FEWEST: usize = 3;
/// With so many neighbours the motion may grow across them (an affine fit: three numbers an axis), with fewer it is one and the same.
const ENOUGH_FOR_SLOPES: usize = 6;
/// Neighbours are looked for so many edges away, nearest first, until there are enough.
const RINGS: usize = 3;

/// The motion of the marked neighbours of `vertex`, carried to it. `first` are the places of all vertices in the first frame, px; `marked`
/// gives the place of a marked one in the last; `sigma_px` is the standard deviation of a mark.
///
/// The motion u(x) = u₀ + G (x − x_v) is fitted to the neighbours by least squares with weights 1/|x − x_v|; u₀ moves the point. With
/// n neighbours, m numbers an axis and residuals r the variance of a mark about u₀ is
///
/// σ² = s² (1 + h),   s² = max(σ_mark², Σ w r² / Σ w · n / (n − m) / 2),   h = e₁ᵀ (XᵀWX)⁻¹ XᵀW²X (XᵀWX)⁻¹ e₁
///
/// (the half because r has two axes). Nothing where fewer than [`FEWEST`] neighbours are marked.
pub fn expected(
    mesh: &Mesh,
    first: &[Point2<f64>],
    marked: &dyn Fn(u32) -> Option<Point2<f64>>,
    vertex: u32,
    sigma_px: f64,
) -> Option<Expected> {
    let here = *first.get(vertex as usize)?;
    let motions: Vec<(Vector2<f64>, Vector2<f64>)> = marked_neighbours(mesh, marked, vertex)
        .into_iter()
        .filter_map(|v| {
            let from = first.get(v as usize)?;
            Some((from - here, marked(v)? - from))
        })
        .filter(|(away, motion)| away.norm() > 0.0 && motion.iter().all(|c| c.is_finite()))
        .collect();
    if motions.len() < FEWEST {
        return None;
    }
    let slopes = motions.len() >= ENOUGH_FOR_SLOPES;
    fit(&motions, slopes, sigma_px).or_else(|| fit(&motions, false, sigma_px)).map(|(u, sigma_px)| Expected {
        at: here + u,
        sigma_px,
        neighbours: motions.len(),
    })
}

/// The marked vertices around, ring by ring until there are enough for slopes.
fn marked_neighbours(mesh: &Mesh, marked: &dyn Fn(u32) -> Option<Point2<f64>>, vertex: u32) -> Vec<u32> {
    let mut met = BTreeSet::from([vertex]);
    let mut ring = vec![vertex];
    let mut found = Vec::new();
    for _ in 0..RINGS {
        let next: BTreeSet<u32> =
            ring.iter().flat_map(|&v| mesh.neighbours(v as usize)).copied().filter(|v| !met.contains(v)).collect();
        found.extend(next.iter().copied().filter(|&v| marked(v).is_some()));
        if found.len() >= ENOUGH_FOR_SLOPES {
            break;
        }
        met.extend(&next);
        ring = next.into_iter().collect();
    }
    found
}

/// u₀ and σ of [`expected`]; nothing where the neighbours lie on a line and slopes are asked for.
fn fit(motions: &[(Vector2<f64>, Vector2<f64>)], slopes: bool, sigma_px: f64) -> Option<(Vector2<f64>, f64)> {
    let scale = motions.iter().map(|(away, _)| away.norm()).sum::<f64>() / motions.len() as f64;
    let row = |away: &Vector2<f64>| {
        let away = if slopes { away / scale } else { Vector2::zeros() };
        Vector3::new(1.0, away.x, away.y)
    };
    let mut normal = Matrix3::zeros();
    let mut squared = Matrix3::zeros();
    let mut right = [Vector3::zeros(); 2];
    let mut weights = 0.0;
    for (away, motion) in motions {
        let (x, w) = (row(away), scale / away.norm());
        normal += x * x.transpose() * w;
        squared += x * x.transpose() * (w * w);
        right[0] += x * (w * motion.x);
        right[1] += x * (w * motion.y);
        weights += w;
    }
    if !slopes {
        // The two numbers that are not asked for are zero.
        normal[(1, 1)] = 1.0;
        normal[(2, 2)] = 1.0;
    }
    let inverse = normal.try_inverse().filter(|_| normal.determinant().abs() > 1e-6 * weights.powi(3))?;
    let inverse = if slopes { inverse } else { Matrix3::from_diagonal(&Vector3::new(1.0 / weights, 0.0, 0.0)) };
    let solution = right.map(|r| inverse * r);
    let numbers = if slopes { 3 } else { 1 };
    let residual = |(away, motion): &(Vector2<f64>, Vector2<f64>)| {
        let x = row(away);
        let r = Vector2::new(motion.x - x.dot(&solution[0]), motion.y - x.dot(&solution[1]));
        r.norm_squared() * scale / away.norm()
    };
    let n = motions.len() as f64;
    let free = (motions.len() - numbers).max(1) as f64;
    let variance = motions.iter().map(residual).sum::<f64>() / weights * n / free / 2.0;
    let leverage = (inverse * squared * inverse)[(0, 0)];
    let sigma = (variance.max(sigma_px * sigma_px) * (1.0 + leverage)).sqrt();
    let u = Vector2::new(solution[0][0], solution[1][0]);
    (u.iter().all(|c| c.is_finite()) && sigma.is_finite()).then_some((u, sigma))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{Noise, triangular};

    fn places(mesh: &Mesh) -> Vec<Point2<f64>> {
        mesh.positions().iter().map(|p| Point2::new(p.x, p.y)).collect()
    }

    /// u = (3 + 0.1 x − 0.05 y, −2 + 0.2 y) is affine: neighbours all round know it exactly.
    #[test]
    fn an_affine_motion_is_expected_exactly_and_a_wrong_mark_stands_out_by_its_error() {
        let mesh = triangular(7, 7, 20.0);
        let first = places(&mesh);
        let moved = |p: &Point2<f64>| Point2::new(p.x + 3.0 + 0.1 * p.x - 0.05 * p.y, p.y - 2.0 + 0.2 * p.y);
        let wrong = 24;
        let mark = |v: u32| {
            let at = moved(&first[v as usize]);
            Some(if v == wrong { at + Vector2::new(4.0, -3.0) } else { at })
        };
        let e = expected(&mesh, &first, &mark, wrong, 0.3).unwrap();
        assert_eq!(e.neighbours, 6);
        assert!((e.at - moved(&first[24])).norm() < 1e-9);
        assert!((mark(wrong).unwrap() - e.at).norm() - 5.0 < 1e-9);
        // Six neighbours evenly around: h = 1/6, and no residual, so that the mark's own error speaks alone.
        assert!((e.sigma_px - 0.3 * (7.0_f64 / 6.0).sqrt()).abs() < 1e-9, "{}", e.sigma_px);
    }

    #[test]
    fn three_neighbours_give_their_mean_and_two_give_nothing() {
        let mesh = triangular(5, 5, 10.0);
        let first = places(&mesh);
        let near: Vec<u32> = mesh.neighbours(12).to_vec();
        let of = |count: usize| {
            let some = near[..count].to_vec();
            expected(&mesh, &first, &|v| some.contains(&v).then(|| first[v as usize] + Vector2::new(1.0, 2.0)), 12, 0.1)
        };
        let three = of(3).unwrap();
        assert!((three.at - first[12] - Vector2::new(1.0, 2.0)).norm() < 1e-12 && three.neighbours == 3);
        assert!(of(2).is_none());
    }

    /// A smooth motion and marks with an error of 0.5 px: distances over σ must scatter as Rayleigh's law says, whose mean
    /// square is 2.
    #[test]
    fn the_error_is_what_marks_scatter_by() {
        let mesh = triangular(16, 16, 18.0);
        let first = places(&mesh);
        let mut noise = Noise(4);
        let sigma = 0.5;
        let (mut sum, mut count) = (0.0, 0.0);
        for _ in 0..20 {
            let marks: Vec<Point2<f64>> = first
                .iter()
                .map(|p| {
                    let lift = 8.0 * (-((p.x - 140.0).powi(2) + (p.y - 120.0).powi(2)) / 20_000.0).exp();
                    Point2::new(p.x + 0.2 * lift + sigma * noise.normal(), p.y - lift + sigma * noise.normal())
                })
                .collect();
            for v in 0..mesh.len() as u32 {
                let e = expected(&mesh, &first, &|v| Some(marks[v as usize]), v, sigma).unwrap();
                sum += (marks[v as usize] - e.at).norm_squared() / e.sigma_px.powi(2);
                count += 1.0;
            }
        }
        let ratio: f64 = sum / count / 2.0;
        // The larger of two estimates of the scatter is taken, which errs on the safe side.
        assert!((0.6..1.1).contains(&ratio), "{ratio}");
    }
}
