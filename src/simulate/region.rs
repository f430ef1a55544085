//! The region of influence of a muscle: the vertices that it reaches, walked from its insertion along the edges of the mesh.

use nalgebra::Vector3;

use crate::face::Mesh;

/// Force below which a muscle does not reach a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cutoff {
    /// This many newton.
    Newton(f64),
    /// This share of the force that the muscle's strength stands for (its peak in all laws but the raw anatomical one, where the peak is
    /// less).
    ShareOfPeak(f64),
}

impl Default for Cutoff {
    /// A hundredth of the peak: with the default laws what is left out is below 1 % of a muscle's force.
    fn default() -> Self {
        Self::ShareOfPeak(0.01)
    }
}

impl Cutoff {
    /// The cutoff in N of a muscle whose strength is `peak` newton; never below 0.
    pub fn newton(self, peak: f64) -> f64 {
        let force = match self {
            Self::Newton(force) => force,
            Self::ShareOfPeak(share) => share * peak.abs(),
        };
        if force > 0.0 { force } else { 0.0 }
    }
}

/// Where a walk began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At a seed, as in the thesis.
    Seed,
    /// Every seed lies below the cutoff; of the vertices above it that are nearest, counted in edges, this is the strongest.
    Beside {
        /// The vertex.
        vertex: u32,
        /// Edges between it and the nearest seed.
        edges: u32,
    },
    /// No vertex that edges join to a seed is above the cutoff: the region is empty. The largest force met, N.
    Nowhere {
        /// The largest force met, N.
        peak: f64,
    },
}

/// The vertices that a muscle reaches, with its force on each.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Vertices whose force is above the cutoff, in ascending order, with the force (N).
    pub loads: Vec<(u32, Vector3<f64>)>,
    /// Where the walk began.
    pub start: Start,
    /// How often the force was worked out: once for each vertex touched.
    pub evaluated: usize,
}

/// Walks from the seeds over the edges of the mesh as long as the force's length is above `cutoff` (N). Thesis §4.3.
///
/// `force` is asked once for each vertex that is touched: those above the cutoff and their neighbours. The region is the union of
/// the connected parts of {‖f‖ > cutoff} that hold a seed. Forces that are not finite end the walk there like small ones.
///
/// Differs from the thesis: it pushes neighbours again and again, so that its stack never empties; here each vertex is pushed once,
/// and then the order (stack or queue) does not change the region (`docs/errata.md`). Where all seeds lie below the cutoff, the
/// thesis's walk ends at once and the muscle is silently lost; here the walk goes on breadth first through weak vertices to the
/// nearest strong one, and [`Start`] says so. Seeds that are no vertices are left out.
pub fn walk(mesh: &Mesh, seeds: &[u32], cutoff: f64, mut force: impl FnMut(u32) -> Vector3<f64>) -> Region {
    let mut visited = vec![false; mesh.len()];
    let mut visit = |v: u32| !std::mem::replace(&mut visited[v as usize], true);
    let (mut loads, mut evaluated, mut peak) = (Vec::new(), 0, 0.0_f64);

    // Breadth first through what is weak, one ring of neighbours after the other, until a ring holds something strong.
    let mut ring: Vec<u32> = seeds.iter().copied().filter(|&v| (v as usize) < mesh.len() && visit(v)).collect();
    let mut stack = Vec::new();
    let mut edges = 0;
    while !ring.is_empty() {
        for &v in &ring {
            let f = force(v);
            evaluated += 1;
            let length = f.norm();
            if length.is_finite() {
                peak = peak.max(length);
            }
            if length.is_finite() && length > cutoff {
                loads.push((v, f));
                stack.push(v);
            }
        }
        if !stack.is_empty() {
            break;
        }
        ring = ring.iter().flat_map(|&v| mesh.neighbours(v as usize)).copied().filter(|&v| visit(v)).collect();
        edges += 1;
    }
    let strongest = loads.iter().max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()));
    let start = match strongest {
        None => Start::Nowhere { peak },
        Some(_) if edges == 0 => Start::Seed,
        Some(&(vertex, _)) => Start::Beside { vertex, edges },
    };

    while let Some(v) = stack.pop() {
        for &next in mesh.neighbours(v as usize) {
            if !visit(next) {
                continue;
            }
            let f = force(next);
            evaluated += 1;
            if f.norm().is_finite() && f.norm() > cutoff {
                loads.push((next, f));
                stack.push(next);
            }
        }
    }
    loads.sort_unstable_by_key(|(v, _)| *v);
    Region { loads, start, evaluated }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A grid of n × n vertices 1 mm apart; vertex (i, j) has the number n j + i.
    fn grid(n: u32) -> Mesh {
        let places = (0..n * n).map(|v| Point3::new(f64::from(v % n), f64::from(v / n), 0.0)).collect();
        let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| n * j + i));
        Mesh::new(places, cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect()).unwrap()
    }

    /// Force in x that falls from 1 at (4, 4) by a fifth every mm.
    fn cone(mesh: &Mesh, v: u32) -> Vector3<f64> {
        let d = (mesh.positions()[v as usize] - Point3::new(4.0, 4.0, 0.0)).norm();
        Vector3::x() * (1.0 - 0.2 * d).max(0.0)
    }

    #[test]
    fn every_vertex_above_the_cutoff_is_found_once_and_only_its_neighbours_are_touched() {
        let mesh = grid(9);
        let region = walk(&mesh, &[40], 0.5, |v| cone(&mesh, v));
        // 1 − 0.2 d > 0.5 is d < 2.5: lattice points in that circle are 1 + 4 (d = 1) + 4 (√2) + 4 (2) + 8 (√5) = 21.
        assert_eq!(region.loads.len(), 21);
        assert_eq!(region.start, Start::Seed);
        let all: Vec<u32> = (0..81).filter(|&v| cone(&mesh, v).norm() > 0.5).collect();
        assert_eq!(region.loads.iter().map(|(v, _)| *v).collect::<Vec<_>>(), all);
        let mut touched: Vec<u32> = all.iter().flat_map(|&v| mesh.neighbours(v as usize)).copied().collect();
        touched.extend(&all);
        touched.sort_unstable();
        touched.dedup();
        assert_eq!(region.evaluated, touched.len());
        assert!(region.evaluated < 81);
    }

    #[test]
    fn a_second_patch_without_a_seed_is_not_reached_and_with_one_it_is() {
        let mesh = grid(9);
        let two = |v: u32| if [0, 80].contains(&v) { Vector3::x() } else { Vector3::zeros() };
        assert_eq!(walk(&mesh, &[0], 0.5, two).loads.len(), 1);
        assert_eq!(walk(&mesh, &[0, 80, 0, 999], 0.5, two).loads.len(), 2);
    }

    #[test]
    fn a_seed_below_the_cutoff_is_named_and_the_nearest_strong_vertex_taken() {
        let mesh = grid(9);
        // From the corner (0, 0) along the diagonals, which are edges, (3, 3) is 3 away; (2, 2) has only 1 − 0.2 √8 = 0.43.
        let region = walk(&mesh, &[0], 0.5, |v| cone(&mesh, v));
        assert_eq!(region.start, Start::Beside { vertex: 30, edges: 3 });
        assert_eq!(region.loads.len(), 21);
    }

    #[test]
    fn a_muscle_weaker_than_the_cutoff_reaches_nothing_and_says_how_strong_it_is() {
        let mesh = grid(9);
        let region = walk(&mesh, &[40], 2.0, |v| cone(&mesh, v));
        assert_eq!((region.loads.len(), region.start), (0, Start::Nowhere { peak: 1.0 }));
        assert_eq!(region.evaluated, 81);
        // Nonsense is never a load, and ends.
        let nonsense = walk(&mesh, &[40], 0.0, |_| Vector3::repeat(f64::NAN));
        assert_eq!((nonsense.loads.len(), nonsense.start), (0, Start::Nowhere { peak: 0.0 }));
    }

    #[test]
    fn a_cutoff_is_newtons_or_a_share() {
        assert_eq!(Cutoff::Newton(0.02).newton(5.0), 0.02);
        assert_eq!(Cutoff::ShareOfPeak(0.01).newton(-5.0), 0.05);
        assert_eq!(Cutoff::Newton(f64::NAN).newton(5.0), 0.0);
    }
}
