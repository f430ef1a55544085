//! How places that are known lead another: the motion of the skin about it, as a polynomial of the second order through the nearest.

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::patch::Guess;

/// A place of the first picture whose place in the other is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leader {
    /// In the first picture, px.
    pub first: Point2<f64>,
    /// In the other, px.
    pub last: Point2<f64>,
    /// Standard error of that, px.
    pub sigma_px: f64,
    /// A triangle of the skin that it belongs to, where its place alone does not tell.
    pub triangle: Option<u32>,
}

/// Where leaders lead a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// The place, with the stretch and the bend of the skin there.
    pub guess: Guess,
    /// Mean distance of the three nearest leaders, px.
    pub distance: f64,
    /// How much the leaders' motions scatter about the polynomial, px (root mean square).
    pub scatter: f64,
}

/// Leaders that count.
const MOST: usize = 12;
/// Stretch and bend per px that are expected of skin, standard deviation: what the leaders do not tell stays near none.
const STRETCH: f64 = 0.12;
const BEND_PER_PX: f64 = 0.003;

impl Lead {
    /// A place led by the nearest leaders but one (`without`, an index); none where there are none.
    ///
    /// Least squares of u(o) = Σ P φ(o) with weights that fall off with the distance and with the leaders' errors, and P held weakly to
    /// zero.
    pub fn of(leaders: &[Leader], at: &Point2<f64>, without: Option<usize>) -> Option<Self> {
        let distances = leaders.iter().enumerate().filter(|(k, _)| Some(*k) != without);
        let mut near: Vec<(f64, usize)> = distances.map(|(k, l)| ((l.first - at).norm(), k)).collect();
        if near.is_empty() {
            return None;
        }
        let count = MOST.min(near.len());
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
        near.truncate(count);
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = &near[..count.min(3)];
        let distance = nearest.iter().map(|n| n.0).sum::<f64>() / nearest.len() as f64;
        let size = near[count - 1].0.max(1.0);
        let phi = |o: &Vector2<f64>| {
            let o = o / size;
            SVector::<f64, 6>::new(1.0, o.x, o.y, 0.5 * o.x * o.x, o.x * o.y, 0.5 * o.y * o.y)
        };
        let (mut square, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SMatrix::<f64, 6, 2>::zeros());
        let mut total = 0.0;
        for (d, k) in &near {
            let l = &leaders[*k];
            let f = phi(&(l.first - at));
            let u = l.last - l.first;
            let weight = 1.0 / ((0.05 + l.sigma_px.powi(2)) * (1.0 + (d / distance.max(1.0)).powi(2)));
            square += f * f.transpose() * weight;
            right += f * u.transpose() * weight;
            total += weight;
        }
        for k in 1..3 {
            square[(k, k)] += (STRETCH * size).powi(-2);
        }
        for k in 3..6 {
            square[(k, k)] += (BEND_PER_PX * size * size).powi(-2);
        }
        let p = square.cholesky()?.solve(&right);
        let left = |(d, k): &(f64, usize)| {
            let l = &leaders[*k];
            let off = (l.last - l.first) - (p.transpose() * phi(&(l.first - at)));
            let weight = 1.0 / ((0.05 + l.sigma_px.powi(2)) * (1.0 + (d / distance.max(1.0)).powi(2)));
            weight * off.norm_squared()
        };
        let scatter = (near.iter().map(left).sum::<f64>() / total).sqrt();
        let bend = |axis: usize| [3, 4, 5].map(|k| p[(k, axis)] / (size * size));
        let guess = Guess {
            at: at + Vector2::new(p[(0, 0)], p[(0, 1)]),
            warp: Matrix2::identity() + Matrix2::new(p[(1, 0)], p[(2, 0)], p[(1, 1)], p[(2, 1)]) / size,
            bend: [bend(0), bend(1)],
        };
        Some(Self { guess, distance, scatter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaders that move by a polynomial of the second order lead to it; far away leaders say less than near ones.
    #[test]
    fn a_bent_motion_is_led_to() {
        let motion = |p: &Point2<f64>| {
            let (x, y) = (p.x - 50.0, p.y - 40.0);
            Vector2::new(3.0 + 0.05 * x - 0.02 * y, -7.0 + 0.01 * x - 0.1 * y + 0.001 * y * y)
        };
        let leaders: Vec<Leader> = (0..36)
            .map(|k| {
                let first = Point2::new(f64::from(k % 6) * 20.0, f64::from(k / 6) * 20.0);
                Leader { first, last: first + motion(&first), sigma_px: 0.05, triangle: None }
            })
            .collect();
        let at = Point2::new(53.0, 47.0);
        let lead = Lead::of(&leaders, &at, None).unwrap();
        assert!((lead.guess.at - (at + motion(&at))).norm() < 0.1, "{:?}", lead.guess.at);
        // ∂u_y/∂y = −0.1 + 2 · 0.001 · 7 there, and the second derivative is 0.002.
        assert!((lead.guess.warp[(1, 1)] - (1.0 - 0.086)).abs() < 0.01, "{}", lead.guess.warp);
        assert!((lead.guess.bend[1][2] - 0.002).abs() < 5e-4 && lead.scatter < 0.2);
        assert!(Lead::of(&leaders[..1], &at, Some(0)).is_none());
        let alone = Lead::of(&leaders[..1], &at, None).unwrap();
        assert!((alone.guess.at - at - motion(&leaders[0].first)).norm() < 1e-6, "one leader shifts everything");
    }
}
