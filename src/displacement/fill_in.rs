//! What becomes of vertices that nobody marked: those surrounded by marks are filled in between them by a harmonic solve.

use std::collections::HashMap;

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use nalgebra::{Point2, Point3};

use super::VertexState;
use crate::face::Mesh;

/// How each of some vertices follows others: u_i = Σ w u_k.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    /// For each vertex of the mesh its (source vertex, weight) pairs; none for a vertex that follows nobody.
    pub rows: Vec<Vec<(u32, f64)>>,
}

/// The widest gap that marks around a vertex may leave, rad, a little over a third of a turn: three marks can surround it, two cannot.
///
/// With half a turn, skin of the upper lid counts as lying between the brow and the eye's corner, and false forces follow.
const WIDEST_GAP_RAD: f64 = 1.1 * std::f64::consts::TAU / 3.0;

/// Whether each vertex is surrounded by marked ones: seen from it in the picture, those within `reach_mm` leave no gap wider than
/// `WIDEST_GAP_RAD`.
///
/// `at` are positions in the plane of the picture, mm. Vertices of `source` themselves are not asked.
pub fn surrounded(at: &[Point2<f64>], source: &[bool], reach_mm: f64) -> Vec<bool> {
    let cell = |p: &Point2<f64>| ((p.x / reach_mm).floor() as i64, (p.y / reach_mm).floor() as i64);
    let mut cells: HashMap<(i64, i64), Vec<u32>> = HashMap::new();
    for (i, p) in at.iter().enumerate().filter(|(i, _)| source[*i]) {
        cells.entry(cell(p)).or_default().push(i as u32);
    }
    let mut angles = Vec::new();
    at.iter()
        .zip(source)
        .map(|(p, is_source)| {
            if *is_source {
                return false;
            }
            let (cx, cy) = cell(p);
            angles.clear();
            for key in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (cx + dx, cy + dy))) {
                let near = cells.get(&key).into_iter().flatten().map(|&i| at[i as usize] - p);
                angles.extend(near.filter(|d| d.norm() <= reach_mm).map(|d| d.y.atan2(d.x)));
            }
            angles.sort_unstable_by(f64::total_cmp);
            let Some((&first, &last)) = angles.first().zip(angles.last()) else { return false };
            let around = first + std::f64::consts::TAU - last;
            let widest = angles.windows(2).map(|w| w[1] - w[0]).fold(around, f64::max);
            widest < WIDEST_GAP_RAD
        })
        .collect()
}

/// Harmonic weights: the displacement u of every vertex of `unknown` that makes Σ cot-weighted differences vanish,
/// L u + u / ℓ² = 0 with `screening_mm` ℓ (none: plain Laplace), as a linear function of its neighbours in `source`.
///
/// Triangles count where all corners are unknown or source: the rest of the mesh is open (natural condition). The
/// cotangent weights reproduce a linear displacement of a flat mesh exactly. Parts of `unknown` that touch no source
/// get no rows.
pub fn harmonic_weights(
    mesh: &Mesh,
    positions: &[Point3<f64>],
    unknown: &[bool],
    source: &[bool],
    screening_mm: Option<f64>,
) -> Weights {
    let counts = |i: u32| unknown[i as usize] || source[i as usize];
    let mut edges: HashMap<[u32; 2], f64> = HashMap::new();
    let mut mass = vec![0.0; mesh.len()];
    for &t in mesh.triangles() {
        if !t.iter().all(|&i| counts(i)) || !t.iter().any(|&i| unknown[i as usize]) {
            continue;
        }
        for k in 0..3 {
            let [o, a, b] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            let [p, q] = [a, b].map(|i| positions[i as usize] - positions[o as usize]);
            let area = p.cross(&q).norm();
            if area > 0.0 {
                // Half the cotangent of the corner opposite to the edge.
                *edges.entry([a.min(b), a.max(b)]).or_default() += 0.5 * p.dot(&q) / area;
            }
            mass[o as usize] += area / 6.0;
        }
    }
    let mut rows = vec![Vec::new(); mesh.len()];
    for part in parts(&edges, unknown, mesh.len()) {
        solve_part(&part, &edges_of(&part, &edges, mesh), &mass, screening_mm, source, &mut rows);
    }
    Weights { rows }
}

/// The representative of a vertex's set, with the path to it halved on the way.
fn root(joined: &mut [u32], mut i: u32) -> u32 {
    while joined[i as usize] != i {
        joined[i as usize] = joined[joined[i as usize] as usize];
        i = joined[i as usize];
    }
    i
}

/// The connected parts of the unknown vertices, joined by edges of the operator.
fn parts(edges: &HashMap<[u32; 2], f64>, unknown: &[bool], n: usize) -> Vec<Vec<u32>> {
    let mut joined: Vec<u32> = (0..n as u32).collect();
    let mut touched = vec![false; n];
    for &[a, b] in edges.keys() {
        touched[a as usize] = true;
        touched[b as usize] = true;
        if unknown[a as usize] && unknown[b as usize] {
            let (ra, rb) = (root(&mut joined, a), root(&mut joined, b));
            joined[ra.max(rb) as usize] = ra.min(rb);
        }
    }
    let mut part_of: HashMap<u32, usize> = HashMap::new();
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for i in (0..n as u32).filter(|&i| unknown[i as usize] && touched[i as usize]) {
        let r = root(&mut joined, i);
        let at = *part_of.entry(r).or_insert_with(|| {
            parts.push(Vec::new());
            parts.len() - 1
        });
        parts[at].push(i);
    }
    parts
}

type Link = (u32, u32, f64);

fn edges_of(part: &[u32], edges: &HashMap<[u32; 2], f64>, mesh: &Mesh) -> Vec<Link> {
    let mut links = Vec::new();
    for &i in part {
        for &j in mesh.neighbours(i as usize) {
            if let Some(&w) = edges.get(&[i.min(j), i.max(j)]) {
                links.push((i, j, w));
            }
        }
    }
    links
}

fn solve_part(
    part: &[u32],
    links: &[Link],
    mass: &[f64],
    screening_mm: Option<f64>,
    source: &[bool],
    rows: &mut [Vec<(u32, f64)>],
) {
    let local: HashMap<u32, usize> = part.iter().enumerate().map(|(k, &i)| (i, k)).collect();
    let mut sources: Vec<u32> = links.iter().map(|l| l.1).filter(|&j| source[j as usize]).collect();
    sources.sort_unstable();
    sources.dedup();
    if sources.is_empty() {
        return;
    }
    let mut right = faer::Mat::<f64>::zeros(part.len(), sources.len());
    let mut entries = Vec::with_capacity(links.len() + part.len());
    let mut diagonal: Vec<f64> =
        part.iter().map(|&i| screening_mm.map_or(0.0, |l| mass[i as usize] / (l * l))).collect();
    for &(i, j, w) in links {
        let row = local[&i];
        diagonal[row] += w;
        match (local.get(&j), sources.binary_search(&j)) {
            (Some(&column), _) if column < row => entries.push(Triplet::new(row, column, -w)),
            (None, Ok(column)) => right[(row, column)] += w,
            _ => {}
        }
    }
    entries.extend(diagonal.iter().enumerate().map(|(k, &d)| Triplet::new(k, k, d)));
    let Ok(matrix) = SparseColMat::<usize, f64>::try_new_from_triplets(part.len(), part.len(), &entries) else {
        return;
    };
    let Ok(factor) = matrix.sp_cholesky(faer::Side::Lower) else { return };
    let solution = factor.solve(&right);
    // What is only drawn need not follow marks that move it by less than could be seen; what forces are made of must.
    let negligible = if screening_mm.is_some() { 1e-6 } else { 1e-12 };
    for (k, &i) in part.iter().enumerate() {
        let row = sources.iter().enumerate().map(|(c, &j)| (j, solution[(k, c)]));
        rows[i as usize] = row.filter(|(_, w)| w.abs() > negligible).collect();
    }
}

/// States of the vertices and the weights of the inferred ones.
///
/// Inferred are the unmarked vertices that marks surround; one that no triangle of known vertices joins to a mark is
/// unmeasured after all.
pub fn infer(mesh: &Mesh, positions: &[Point3<f64>], states: &mut [VertexState], reach_mm: f64) -> Weights {
    let source: Vec<bool> = states.iter().copied().map(VertexState::is_known).collect();
    let in_plane: Vec<Point2<f64>> = positions.iter().map(Point3::xy).collect();
    let unknown = surrounded(&in_plane, &source, reach_mm);
    if !unknown.contains(&true) {
        return Weights { rows: vec![Vec::new(); mesh.len()] };
    }
    let weights = harmonic_weights(mesh, positions, &unknown, &source, None);
    for (state, row) in states.iter_mut().zip(&weights.rows) {
        if !row.is_empty() {
            *state = VertexState::Inferred;
        }
    }
    weights
}

/// Largest number of weights that a prediction may cost; beyond it far vertices are drawn where they were.
const MOST_PREDICTION_WEIGHTS: usize = 4_000_000;
/// How far a displacement is carried on beyond the known skin for drawing, mm: it fades by 1/e over this length.
const PREDICTION_FADE_MM: f64 = 15.0;
/// Edges beyond the known skin within which anything is predicted.
const PREDICTION_RINGS: usize = 8;

/// Weights by which unmeasured vertices are drawn: the known displacement carried on, fading.
pub fn predict(mesh: &Mesh, positions: &[Point3<f64>], states: &[VertexState]) -> Weights {
    let mut ring = vec![usize::MAX; mesh.len()];
    let mut front: Vec<u32> = (0..mesh.len() as u32).filter(|&i| states[i as usize].is_known()).collect();
    for &i in &front {
        ring[i as usize] = 0;
    }
    let mut border = 0;
    for depth in 1..=PREDICTION_RINGS {
        let mut next = Vec::new();
        for &i in &front {
            let mut open = false;
            for &j in mesh.neighbours(i as usize) {
                if ring[j as usize] == usize::MAX {
                    ring[j as usize] = depth;
                    next.push(j);
                }
                open |= ring[j as usize] == 1;
            }
            border += usize::from(depth == 1 && open);
        }
        front = next;
    }
    let unknown: Vec<bool> = ring.iter().map(|&r| r != 0 && r != usize::MAX).collect();
    let size = unknown.iter().filter(|u| **u).count();
    if border == 0 || size == 0 || size * border > MOST_PREDICTION_WEIGHTS {
        return Weights { rows: vec![Vec::new(); mesh.len()] };
    }
    let source: Vec<bool> = ring.iter().map(|&r| r == 0).collect();
    harmonic_weights(mesh, positions, &unknown, &source, Some(PREDICTION_FADE_MM))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::right_angled;

    /// A flat 11 × 11 sheet, sheared so that no triangle is right-angled.
    fn sheet() -> Mesh {
        let flat = right_angled(11, 11, 1.0, 1.0);
        let shear = |p: &Point3<f64>| Point3::new(p.x - 0.7 * p.y, p.y, 0.0);
        flat.with_positions(flat.positions().iter().map(shear).collect()).unwrap()
    }

    #[test]
    fn a_linear_displacement_is_filled_in_exactly() {
        let mesh = sheet();
        let x = mesh.positions();
        let rim = mesh.on_border();
        let u = |i: usize| 0.2 * x[i].x - 0.7 * x[i].y + 3.0;
        // The rim is marked, and within it every third vertex, or none: then most weights are small.
        for every_third in [true, false] {
            let source: Vec<bool> = (0..mesh.len()).map(|i| rim[i] || (every_third && i % 3 == 0)).collect();
            let unknown: Vec<bool> = source.iter().map(|s| !s).collect();
            let w = harmonic_weights(&mesh, x, &unknown, &source, None);
            for i in (0..mesh.len()).filter(|&i| unknown[i]) {
                let filled: f64 = w.rows[i].iter().map(|&(j, w)| w * u(j as usize)).sum();
                assert!((filled - u(i)).abs() < 1e-9, "vertex {i}: {filled} for {}", u(i));
                let total: f64 = w.rows[i].iter().map(|r| r.1).sum();
                assert!((total - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn one_between_two_is_not_surrounded_but_one_between_three_is() {
        let at = [[0.0, 0.0], [1.0, 0.6], [-1.0, 0.6], [0.0, -1.0]].map(Point2::from);
        assert!(!surrounded(&at, &[false, true, true, false], 2.0)[0]);
        assert!(surrounded(&at, &[false, true, true, true], 2.0)[0]);
        assert!(!surrounded(&at, &[false, true, true, true], 0.5)[0], "marks out of reach do not count");
    }

    #[test]
    fn beyond_the_marks_nothing_is_inferred_and_the_prediction_fades() {
        let mesh = sheet();
        let mut states: Vec<VertexState> = (0..mesh.len())
            .map(|i| {
                if (3..=7).contains(&(i % 11)) && (3..=7).contains(&(i / 11)) && (i % 2 == 0) {
                    VertexState::Measured
                } else {
                    VertexState::Unmeasured
                }
            })
            .collect();
        infer(&mesh, mesh.positions(), &mut states, 2.5);
        assert_eq!(
            states[5 * 11 + 5 + usize::from(states[5 * 11 + 5] == VertexState::Measured)],
            VertexState::Inferred
        );
        assert_eq!(states[0], VertexState::Unmeasured);
        let w = predict(&mesh, mesh.positions(), &states);
        let carried = |i: usize| w.rows[i].iter().map(|r| r.1).sum::<f64>();
        assert!(carried(0) < carried(12 + 11) && carried(12 + 11) < 1.0 && carried(0) > 0.0);
    }
}
