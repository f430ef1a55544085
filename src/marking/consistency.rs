//! Where the neighbours of a marked point say that it went: the smoothest motion of the skin through their marks, without its own.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, Point2, Vector2};
use rayon::prelude::*;

use crate::face::Mesh;

/// Where a point is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The place in the last frame, px.
    pub at: Point2<f64>,
    /// Standard error of a mark about this place along each axis, px: that of the neighbours, that of the mark, and how far skin that bends
    /// goes beyond what neighbours can tell.
    pub sigma_px: f64,
    /// How many neighbours speak.
    pub neighbours: usize,
}

/// A mark of the last frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The place, px.
    pub at: Point2<f64>,
    /// Standard deviation along each axis, px.
    pub sigma_px: f64,
}

/// Fewer neighbours say nothing.
pub const FEWEST: usize = 3;
/// With so many neighbours the motion may grow across them, with fewer it is one and the same.
const ENOUGH_FOR_SLOPES: usize = 6;
/// So many neighbours speak, the nearest; they are looked for so many edges away.
const MOST: usize = 16;
const RINGS: usize = 4;
/// Marks about one that tell how much the skin bends there, and those of the whole face.
const ABOUT: usize = 8;
const WHOLE: usize = 100;
/// No mark is better than this, px.
const LEAST_SIGMA_PX: f64 = 0.1;
/// The unit of distance, and what skin bends over it before anything is known, mm: how much a mark's own error is smoothed.
const UNIT_MM: f64 = 12.0;
const BEND_MM: f64 = 0.75;
/// Least k: where neighbours are dense, bending says little.
const LEAST_BEND: f64 = 1e-4;
/// Shares of the bending: of the median about the mark, of the median of all, of the most about it, and of what two smooth motions differ by.
const SHARES: [f64; 4] = [1.35, 3.3, 0.05, 1.0];

/// Marks that are weighed against each other.
///
/// The motion u at a mark is predicted from the up to 16 nearest others by a smoothing thin-plate spline (Duchon 1977, as kriging):
/// u = Σ λᵢ uᵢ, with the weights λ that reproduce every affine motion and have the least variance
///
/// k(λ) = Σᵢⱼ λᵢ λⱼ φ(|xᵢ − xⱼ|) − 2 Σᵢ λᵢ φ(|xᵢ − x|),   φ(r) = r² ln r
///
/// in units of the bending τ² of the skin, beside their own errors Σ λᵢ² σᵢ². How much skin bends is not known but shows: by the distances e
/// of the marks about from where *their* neighbours lead, τ² = max(0, e² / 2 − σ² − Σ λᵢ² σᵢ²) / k. The variance of a mark about its
/// prediction is
///
/// σ² + Σ λᵢ² σᵢ² + k (1.35 med + 3.3 all + 0.05 max) + d²
///
/// with the median and the greatest τ² of the eight nearest marks, the median of all, and the distance d of a second prediction that knows no
/// slopes (φ = − r^1.5). The four shares were chosen on rendered scenes so that true marks rarely stand out (`docs/accuracy.md`).
/// What a mark itself does to its neighbours is taken out: its own error does not excuse it.
pub struct Consistency<'a> {
    mesh: &'a Mesh,
    first: &'a [Point2<f64>],
    marks: &'a BTreeMap<u32, Placed>,
    px_per_mm: f64,
}

/// What the neighbours of a mark say.
struct Said {
    /// Neighbours and their weights.
    by: Vec<(u32, f64)>,
    motion: Vector2<f64>,
    /// What they say of a motion without slopes.
    plain: Vector2<f64>,
    /// k and Σ λᵢ² σᵢ².
    bend: f64,
    noise: f64,
}

impl<'a> Consistency<'a> {
    /// `first` are the places of all vertices in the first frame, px; `marks` those marked in the last.
    pub fn of(mesh: &'a Mesh, first: &'a [Point2<f64>], marks: &'a BTreeMap<u32, Placed>, px_per_mm: f64) -> Self {
        Self { mesh, first, marks, px_per_mm }
    }

    /// Where one mark is expected; nothing where it is not marked or fewer than [`FEWEST`] neighbours are.
    pub fn expected(&self, vertex: u32) -> Option<Expected> {
        let stride = self.marks.len().div_ceil(WHOLE).max(1);
        let near = self.near(vertex)?;
        let asked: BTreeSet<u32> = self.marks.keys().step_by(stride).chain(near.iter().take(ABOUT)).copied().collect();
        let asked: Vec<u32> = asked.into_iter().chain([vertex]).collect();
        let said = self.said_of(&asked);
        self.judged(vertex, &said, self.whole(&said))
    }

    /// The same of every mark.
    pub fn all(&self) -> BTreeMap<u32, Expected> {
        let asked: Vec<u32> = self.marks.keys().copied().collect();
        let said = self.said_of(&asked);
        let whole = self.whole(&said);
        asked.into_iter().filter_map(|v| Some((v, self.judged(v, &said, whole)?))).collect()
    }

    fn said_of(&self, vertices: &[u32]) -> BTreeMap<u32, Said> {
        vertices.par_iter().filter_map(|&v| Some((v, self.said(v)?))).collect()
    }

    fn motion(&self, vertex: u32) -> Option<Vector2<f64>> {
        let motion = self.marks.get(&vertex)?.at - self.first.get(vertex as usize)?;
        motion.iter().all(|c| c.is_finite()).then_some(motion)
    }

    fn sigma(&self, vertex: u32) -> f64 {
        self.marks.get(&vertex).map_or(LEAST_SIGMA_PX, |m| m.sigma_px.max(LEAST_SIGMA_PX))
    }

    /// The marked vertices around, nearest first; ring by ring, so that the skin between is whole.
    fn near(&self, vertex: u32) -> Option<Vec<u32>> {
        let here = self.first.get(vertex as usize)?;
        let mut met = BTreeSet::from([vertex]);
        let mut ring = vec![vertex];
        let mut found: Vec<(f64, u32)> = Vec::new();
        for _ in 0..RINGS {
            let next: BTreeSet<u32> = ring
                .iter()
                .flat_map(|&v| self.mesh.neighbours(v as usize))
                .copied()
                .filter(|v| !met.contains(v))
                .collect();
            let marked = next.iter().copied().filter(|v| self.motion(*v).is_some());
            found.extend(marked.map(|v| ((self.first[v as usize] - here).norm(), v)).filter(|(away, _)| *away > 0.0));
            met.extend(&next);
            ring = next.into_iter().collect();
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(MOST);
        Some(found.into_iter().map(|(_, v)| v).collect())
    }

    fn said(&self, vertex: u32) -> Option<Said> {
        let near = self.near(vertex)?;
        if near.len() < FEWEST {
            return None;
        }
        let (plain, plain_bend) = self.weights(vertex, &near, false)?;
        let smooth = if near.len() >= ENOUGH_FOR_SLOPES { self.weights(vertex, &near, true) } else { None };
        let (weights, bend) = smooth.unwrap_or_else(|| (plain.clone(), plain_bend));
        let moved = |weights: &[f64]| {
            near.iter().zip(weights).filter_map(|(v, w)| Some(self.motion(*v)? * *w)).sum::<Vector2<f64>>()
        };
        let noise = near.iter().zip(&weights).map(|(v, w)| (w * self.sigma(*v)).powi(2)).sum::<f64>();
        let said = Said { motion: moved(&weights), plain: moved(&plain), bend, noise, by: Vec::new() };
        let finite = said.motion.iter().chain(&said.plain).all(|c| c.is_finite()) && noise.is_finite();
        finite.then(|| Said { by: near.into_iter().zip(weights).collect(), ..said })
    }

    /// Weights of the neighbours, and k; nothing where they lie on a line and slopes are asked for.
    fn weights(&self, vertex: u32, near: &[u32], slopes: bool) -> Option<(Vec<f64>, f64)> {
        let unit = UNIT_MM * self.px_per_mm;
        let bend_px = BEND_MM * self.px_per_mm;
        let here = self.first[vertex as usize];
        let away: Vec<Vector2<f64>> = near.iter().map(|v| (self.first[*v as usize] - here) / unit).collect();
        let phi = |r: f64| match slopes {
            true if r > 0.0 => r * r * r.ln(),
            true => 0.0,
            false => -r.powf(1.5),
        };
        let (n, trend) = (near.len(), if slopes { 3 } else { 1 });
        let basis = |i: usize, k: usize| if k == 0 { 1.0 } else { away[i][k - 1] };
        let matrix = DMatrix::from_fn(n + trend, n + trend, |i, j| match (i < n, j < n) {
            (true, true) => {
                let own = if i == j { (self.sigma(near[i]) / bend_px).powi(2) } else { 0.0 };
                phi((away[i] - away[j]).norm()) + own
            }
            (true, false) => basis(i, j - n),
            (false, true) => basis(j, i - n),
            (false, false) => 0.0,
        });
        let right =
            DMatrix::from_fn(
                n + trend,
                1,
                |i, _| {
                    if i < n { phi(away[i].norm()) } else { f64::from(u8::from(i == n)) }
                },
            );
        let solution = matrix.lu().solve(&right)?;
        let weights: Vec<f64> = (0..n).map(|i| solution[i]).collect();
        let kept = (weights.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        let mut k = 0.0;
        for (i, wi) in weights.iter().enumerate() {
            k -= 2.0 * wi * phi(away[i].norm());
            for (j, wj) in weights.iter().enumerate() {
                k += wi * wj * phi((away[i] - away[j]).norm());
            }
        }
        (kept && k.is_finite()).then(|| (weights, k.max(LEAST_BEND)))
    }

    /// τ² at a mark, as it would be if another mark (`about`) lay where its neighbours lead.
    fn bending(&self, vertex: u32, said: &Said, about: Option<(u32, Vector2<f64>)>) -> Option<f64> {
        let mut off = self.motion(vertex)? - said.motion;
        if let Some((other, gap)) = about
            && let Some((_, weight)) = said.by.iter().find(|(v, _)| *v == other)
        {
            off += gap * *weight;
        }
        let explained = self.sigma(vertex).powi(2) + said.noise;
        Some((0.5 * off.norm_squared() - explained).max(0.0) / said.bend)
    }

    /// The median τ² of the whole face.
    fn whole(&self, said: &BTreeMap<u32, Said>) -> f64 {
        let stride = self.marks.len().div_ceil(WHOLE).max(1);
        let mut all: Vec<f64> =
            self.marks.keys().step_by(stride).filter_map(|v| self.bending(*v, said.get(v)?, None)).collect();
        median(&mut all)
    }

    fn judged(&self, vertex: u32, said: &BTreeMap<u32, Said>, whole: f64) -> Option<Expected> {
        let own = said.get(&vertex)?;
        let gap = self.motion(vertex)? - own.motion;
        let near = own.by.iter().take(ABOUT);
        let mut about: Vec<f64> =
            near.filter_map(|(v, _)| self.bending(*v, said.get(v)?, Some((vertex, gap)))).collect();
        let most = about.iter().copied().fold(0.0, f64::max);
        let between = (own.motion - own.plain).norm_squared() - own.noise;
        let bent = own.bend * (SHARES[0] * median(&mut about) + SHARES[1] * whole + SHARES[2] * most)
            + SHARES[3] * between.max(0.0);
        let sigma_px = (self.sigma(vertex).powi(2) + own.noise + bent).sqrt();
        let at = self.first.get(vertex as usize)? + own.motion;
        Some(Expected { at, sigma_px, neighbours: own.by.len() })
    }
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::triangular;

    fn places(mesh: &Mesh) -> Vec<Point2<f64>> {
        mesh.positions().iter().map(|p| Point2::new(p.x, p.y)).collect()
    }

    fn marked(places: impl Iterator<Item = (u32, Point2<f64>)>, sigma_px: f64) -> BTreeMap<u32, Placed> {
        places.map(|(v, at)| (v, Placed { at, sigma_px })).collect()
    }

    /// u = (3 + 0.1 x − 0.05 y, −2 + 0.2 y) is affine: the spline reproduces it, whatever its weights.
    #[test]
    fn an_affine_motion_is_expected_exactly_and_a_wrong_mark_stands_out_by_its_error() {
        let mesh = triangular(9, 9, 20.0);
        let first = places(&mesh);
        let moved = |p: &Point2<f64>| Point2::new(p.x + 3.0 + 0.1 * p.x - 0.05 * p.y, p.y - 2.0 + 0.2 * p.y);
        let wrong = 40;
        let mut marks = marked((0..mesh.len() as u32).map(|v| (v, moved(&first[v as usize]))), 0.3);
        marks.get_mut(&wrong).unwrap().at += Vector2::new(4.0, -3.0);
        let all = Consistency::of(&mesh, &first, &marks, 4.0).all();
        let e = all[&wrong];
        assert!((e.at - moved(&first[40])).norm() < 1e-9, "{:?}", e.at);
        assert_eq!(e.neighbours, 16);
        // The skin bends nowhere, so that the marks' errors speak alone: 0.3 px, and at most as much again from the neighbours.
        assert!((0.3..0.4).contains(&e.sigma_px), "{}", e.sigma_px);
        assert_eq!(
            Consistency::of(&mesh, &first, &marks, 4.0).expected(wrong),
            Some(e),
            "one is as in the list of all"
        );
    }

    #[test]
    fn three_neighbours_that_move_alike_are_followed_and_two_say_nothing() {
        let mesh = triangular(5, 5, 10.0);
        let first = places(&mesh);
        let near: Vec<u32> = mesh.neighbours(12).to_vec();
        let of = |count: usize| {
            let some = near[..count].iter().copied().chain([12]);
            let marks = marked(some.map(|v| (v, first[v as usize] + Vector2::new(1.0, 2.0))), 0.1);
            Consistency::of(&mesh, &first, &marks, 4.0).expected(12)
        };
        let three = of(3).unwrap();
        assert!((three.at - first[12] - Vector2::new(1.0, 2.0)).norm() < 1e-9 && three.neighbours == 3);
        assert!(of(2).is_none());
    }
}
