//! The force field F = −K X by one pass over the springs, without storing K.
//!
//! Springs are taken in blocks of `BLOCK`, their differences side by side, so that roots and quotients run in wide registers.
//! Vertices are taken in ranges of `RANGE`: a range owns its part of the result and the springs whose lower end it holds,
//! so ranges can run on several cores. What a spring does to a vertex of a later range is noted and added at the end: on a
//! mesh whose neighbours have near indices that is a few springs in a hundred, on one without such order up to all of them
//! (still correct; the notes then cost about as much as the pass).

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Springs;
use crate::skin::StressStrainCurve;
use crate::skin::stress_strain::Hinge;

/// Springs worked on side by side: their seven numbers take 7 KB, a fifth or less of the first-level cache.
const BLOCK: usize = 128;
/// Vertices a range holds: their positions and forces stay in the second-level cache while springs scatter into them.
const RANGE: usize = 8192;
/// Below so many vertices one thread is done before others have woken.
const PARALLEL_FROM: usize = 20_000;
/// Above so many corners of the skin's table its pieces are searched, instead of all corners summed.
const MOST_HINGES: usize = 24;

/// The external (muscle) force on every vertex, N: minus the sum of its spring forces. Thesis (4.5), F = −K X.
///
/// F_i = −Σ_j f_ij = Σ_j f (x_i − x_j) / L,   f = h w σ(ε), L = ‖x_i − x_j‖
///
/// `positions` are the deformed ones, mm, one a vertex. A spring with an end that is not `active` (absent: all are) carries
/// nothing, nor does one of rest length or length zero. `out` is given one vector a vertex; its memory is used again.
pub fn muscle_forces(
    springs: &Springs,
    curve: &StressStrainCurve,
    positions: &[Point3<f64>],
    active: Option<&[bool]>,
    out: &mut Vec<Vector3<f64>>,
) {
    let pass = Pass { springs, curve, positions, active };
    out.resize(springs.vertices(), Vector3::zeros());
    let crossing: Vec<Vec<Crossing>> = if springs.vertices() < PARALLEL_FROM {
        out.chunks_mut(RANGE).enumerate().map(|(range, own)| pass.run(range * RANGE, own)).collect()
    } else {
        out.par_chunks_mut(RANGE).enumerate().map(|(range, own)| pass.run(range * RANGE, own)).collect()
    };
    for (vertex, pull) in crossing.into_iter().flatten() {
        out[vertex as usize] -= pull;
    }
}

/// A vertex of a later range, and what it is pulled with from an earlier one.
type Crossing = (u32, Vector3<f64>);

#[derive(Clone, Copy)]
struct Pass<'a> {
    springs: &'a Springs,
    curve: &'a StressStrainCurve,
    positions: &'a [Point3<f64>],
    active: Option<&'a [bool]>,
}

impl Pass<'_> {
    /// The springs whose lower end is one of `own`, the vertices from `first` on.
    fn run(self, first: usize, own: &mut [Vector3<f64>]) -> Vec<Crossing> {
        Arch::new().dispatch(Range { pass: self, first, own })
    }
}

struct Range<'a, 'b> {
    pass: Pass<'a>,
    first: usize,
    own: &'b mut [Vector3<f64>],
}

impl WithSimd for Range<'_, '_> {
    type Output = Vec<Crossing>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Crossing> {
        let Self { pass, first, own } = self;
        let Pass { springs, curve, positions, active } = pass;
        own.fill(Vector3::zeros());
        let mut crossing = Vec::new();
        let edges = springs.edges();
        let begin = edges.partition_point(|e| (e[0] as usize) < first);
        let end = begin + edges[begin..].partition_point(|e| (e[0] as usize) < first + own.len());
        let (per_rest_length, newton_per_kpa) = springs.constants();
        let mut block = Block::default();
        let mut spare = [[0.0; BLOCK]; 2];
        for start in (begin..end).step_by(BLOCK) {
            let range = start..(start + BLOCK).min(end);
            // Said again for the optimiser: no more than a block, so no bounds to check in it.
            let edges = &edges[range.clone()][..range.len().min(BLOCK)];
            for (j, &[a, b]) in edges.iter().enumerate() {
                let d = positions[a as usize] - positions[b as usize];
                (block.x[j], block.y[j], block.z[j]) = (d.x, d.y, d.z);
            }
            let (mut per_l, mut scale) = (&per_rest_length[range.clone()], &newton_per_kpa[range]);
            if edges.len() < BLOCK || active.is_some() {
                spare[0][..edges.len()].copy_from_slice(per_l);
                spare[1][..edges.len()].copy_from_slice(scale);
                if let Some(active) = active {
                    for (c, &[a, b]) in spare[1].iter_mut().zip(edges) {
                        *c = if active[a as usize] && active[b as usize] { *c } else { 0.0 };
                    }
                }
                (per_l, scale) = (&spare[0], &spare[1]);
            }
            block.pull(curve, per_l, scale);
            // Springs of one lower end follow each other: their sum stays in registers until the next.
            let (mut lower, mut sum, mut crosses) = (edges[0][0], Vector3::zeros(), false);
            for (j, &[a, b]) in edges.iter().enumerate() {
                let f = Vector3::new(block.x[j], block.y[j], block.z[j]);
                if a != lower {
                    own[lower as usize - first] += sum;
                    (lower, sum) = (a, Vector3::zeros());
                }
                sum += f;
                match own.get_mut(b as usize - first) {
                    Some(force) => *force -= f,
                    None => crosses = true,
                }
            }
            own[lower as usize - first] += sum;
            // Apart from the loop above, which has no room in its registers for it.
            if crosses {
                let ends = edges.iter().map(|e| e[1]).zip(block.forces());
                crossing.extend(ends.filter(|(b, _)| *b as usize - first >= own.len()));
            }
        }
        crossing
    }
}

/// Springs side by side. `x, y, z` hold x_a − x_b before [`Block::pull`] and the force on a after it.
struct Block {
    x: [f64; BLOCK],
    y: [f64; BLOCK],
    z: [f64; BLOCK],
    length: [f64; BLOCK],
    strain: [f64; BLOCK],
}

impl Default for Block {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        Self { x: zero, y: zero, z: zero, length: zero, strain: zero }
    }
}

/// Numbers in one wide register (or two halves of it).
const LANES: usize = 8;
/// Smallest squared length that is divided by, mm²: a spring of length zero has no direction and carries nothing.
const SHORTEST_SQUARED: f64 = 1e-200;

impl Block {
    /// Turns differences into forces: (x_a − x_b) h w σ(L/l − 1) / L, with 1/l and h w of every spring of the block.
    #[inline(always)]
    fn pull(&mut self, curve: &StressStrainCurve, per_rest_length: &[f64], newton_per_kpa: &[f64]) {
        let (least, most) = self.stretch(&per_rest_length[..BLOCK]);
        let newton_per_kpa = &newton_per_kpa[..BLOCK];
        let (elongation, compression) = curve.hinges();
        let search = elongation.len() + compression.len() > MOST_HINGES;
        // Corners that no spring of the block has reached add nothing: most blocks meet only those at zero.
        let elongation = &elongation[..elongation.partition_point(|h| h.at < most)];
        let compression = &compression[..compression.partition_point(|h| h.at < -least)];
        for i in (0..BLOCK).step_by(LANES) {
            let lanes = i..i + LANES;
            let strain = &self.strain[lanes.clone()];
            let mut stress = [0.0; LANES];
            if search {
                for (s, &e) in stress.iter_mut().zip(strain) {
                    *s = curve.stress_kpa(e);
                }
            } else {
                sum_of_hinges(strain, elongation, compression, &mut stress);
            }
            let [x, y, z] = [&mut self.x, &mut self.y, &mut self.z].map(|c| &mut c[lanes.clone()]);
            let (scale, length) = (&newton_per_kpa[lanes.clone()], &self.length[lanes]);
            for j in 0..LANES {
                let pull = scale[j] * stress[j] / length[j];
                x[j] *= pull;
                y[j] *= pull;
                z[j] *= pull;
            }
        }
    }

    /// The forces on the lower ends.
    fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..BLOCK).map(|j| Vector3::new(self.x[j], self.y[j], self.z[j]))
    }

    /// Lengths and strains, and the least and the most of the strains.
    #[inline(always)]
    fn stretch(&mut self, per_rest_length: &[f64]) -> (f64, f64) {
        let (mut least, mut most) = ([0.0; LANES], [0.0; LANES]);
        for i in (0..BLOCK).step_by(LANES) {
            let lanes = i..i + LANES;
            let (x, y, z) = (&self.x[lanes.clone()], &self.y[lanes.clone()], &self.z[lanes.clone()]);
            let per_l = &per_rest_length[lanes.clone()];
            let (length, strain) = (&mut self.length[lanes.clone()], &mut self.strain[lanes]);
            for j in 0..LANES {
                let squared = x[j] * x[j] + y[j] * y[j] + z[j] * z[j];
                length[j] = if squared > SHORTEST_SQUARED { squared } else { SHORTEST_SQUARED }.sqrt();
                strain[j] = length[j] * per_l[j] - 1.0;
                least[j] = if strain[j] < least[j] { strain[j] } else { least[j] };
                most[j] = if strain[j] > most[j] { strain[j] } else { most[j] };
            }
        }
        (least.into_iter().fold(0.0, f64::min), most.into_iter().fold(0.0, f64::max))
    }
}

/// σ(ε) = Σ eₖ max(0, ε − aₖ) − Σ cₖ max(0, −ε − bₖ): no branch and no search, so all lanes go at once.
#[inline(always)]
fn sum_of_hinges(strain: &[f64], elongation: &[Hinge], compression: &[Hinge], stress: &mut [f64; LANES]) {
    for h in elongation {
        for j in 0..LANES {
            let beyond = strain[j] - h.at;
            stress[j] += h.slope * if beyond > 0.0 { beyond } else { 0.0 };
        }
    }
    for h in compression {
        for j in 0..LANES {
            let beyond = -strain[j] - h.at;
            stress[j] -= h.slope * if beyond > 0.0 { beyond } else { 0.0 };
        }
    }
}

/// Sum of the internal forces over the mesh, N: zero but for rounding (about 1e-16 of the largest force, times √n), because
/// every spring pulls its two ends alike. The self-check of a field.
pub fn internal_sum(muscle_forces: &[Vector3<f64>]) -> Vector3<f64> {
    -muscle_forces.iter().sum::<Vector3<f64>>()
}

/// Engineering strain of every spring at `positions`; 0 for a spring of rest length zero.
pub fn strains(springs: &Springs, positions: &[Point3<f64>]) -> Vec<f64> {
    (0..springs.edges().len()).map(|e| springs.strain(e, springs.along(e, positions).norm())).collect()
}

/// Whether each vertex has a spring that carries force at a strain beyond the skin's table: its force is then a continuation.
pub fn outside_table(
    springs: &Springs,
    curve: &StressStrainCurve,
    positions: &[Point3<f64>],
    active: Option<&[bool]>,
) -> Vec<bool> {
    let mut outside = vec![false; springs.vertices()];
    for (e, (&strain, ends)) in strains(springs, positions).iter().zip(springs.edges()).enumerate() {
        if !curve.covers(strain) && springs.is_active(e, active) {
            for &i in ends {
                outside[i as usize] = true;
            }
        }
    }
    outside
}

/// Each force as a part in the surface and a component along the outward unit normal: F = T + N n.
pub fn split(forces: &[Vector3<f64>], normals: &[Vector3<f64>]) -> (Vec<Vector3<f64>>, Vec<f64>) {
    forces
        .iter()
        .zip(normals)
        .map(|(f, n)| {
            let along = f.dot(n);
            (f - n * along, along)
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::Mesh;
    use crate::face::patches::{right_angled, shaken, triangular};
    use crate::forces::SpringRule;
    use nalgebra::{Matrix3, Rotation3};
    use proptest::prelude::*;

    const RULES: [SpringRule; 2] = [SpringRule::Strip, SpringRule::Uniform];

    fn field(mesh: &Mesh, x: &[Point3<f64>], rule: SpringRule) -> Vec<Vector3<f64>> {
        let springs = Springs::new(mesh, mesh.positions(), rule, 1.5);
        let mut out = Vec::new();
        muscle_forces(&springs, &StressStrainCurve::default(), x, None, &mut out);
        out
    }

    /// The patch test. A flat regular grid under one uniform strain: inside, neighbours come in opposite pairs and every force
    /// cancels. On the rim, the muscle must replace what the missing neighbours would do.
    ///
    /// Right-angled cells a × b, stretched to a(1+p) × b(1+q). Springs along x: strip width of an inner one (two triangles of
    /// area ab/2 over its length a) b, of a rim one b/2. A vertex of the right rim (not a corner) loses one x spring and one
    /// diagonal, so it must be pulled outwards with h b σ(p) + the diagonal's x part, and along y with the diagonal's y part.
    #[test]
    fn patch_test_on_right_angled_grids() {
        let (h, curve) = (1.5, StressStrainCurve::default());
        for (columns, rows, a, b) in [(3, 3, 8.0, 8.0), (6, 5, 8.0, 5.0), (25, 25, 2.0, 3.0), (120, 90, 0.5, 0.5)] {
            let mesh = right_angled(columns, rows, a, b);
            let (p, q) = (0.12, -0.07);
            let x: Vec<_> =
                mesh.positions().iter().map(|v| Point3::new(v.x * (1.0 + p), v.y * (1.0 + q), 0.0)).collect();
            for rule in RULES {
                let f = field(&mesh, &x, rule);
                // Widths by the strip rule: along x two triangles of ab/2 over a (half of that on the rim), along y alike,
                // and ab over the diagonal's length l. Each cell owns one edge of each kind, the rim's halves make one more
                // row and column: their sum is cells · (b + a + ab/l).
                let l = a.hypot(b);
                let cells = ((columns - 1) * (rows - 1)) as f64;
                let edges = ((columns - 1) * rows + columns * (rows - 1)) as f64 + cells;
                let mean = cells * (a + b + a * b / l) / edges;
                let [w_x, w_d, rim_x, rim_y] = match rule {
                    SpringRule::Strip => [b, a * b / l, b / 2.0, a / 2.0],
                    SpringRule::Uniform => [mean; 4],
                };
                let long = (a * (1.0 + p)).hypot(b * (1.0 + q));
                let diagonal = 1e-3 * h * w_d * curve.stress_kpa(long / l - 1.0);
                let along = Vector3::new(a * (1.0 + p), b * (1.0 + q), 0.0) / long;
                let pull_x = 1e-3 * h * w_x * curve.stress_kpa(p);
                let right = Vector3::new(pull_x, 0.0, 0.0) + along * diagonal;
                let scale = right.norm();
                for (i, f) in f.iter().enumerate() {
                    let (c, r) = (i % columns, i / columns);
                    let (inner_c, inner_r) = (c > 0 && c < columns - 1, r > 0 && r < rows - 1);
                    if inner_c && inner_r {
                        assert!(f.norm() < 1e-12 * scale, "{columns}x{rows} {rule:?} inside: {f}");
                    } else if inner_r {
                        let sign = if c == 0 { -1.0 } else { 1.0 };
                        assert!(
                            (f - right * sign).norm() < 1e-11 * scale,
                            "{columns}x{rows} {rule:?} rim: {f} {right}"
                        );
                    }
                }
                // The corner (0, 0) has one x spring and one y spring, both of the rim, and a diagonal; all are held back.
                let sides = Vector3::new(rim_x * curve.stress_kpa(p), rim_y * curve.stress_kpa(q), 0.0);
                let corner = -along * diagonal - sides * 1e-3 * h;
                assert!((f[0] - corner).norm() < 1e-11 * scale, "{rule:?} corner: {} {corner}", f[0]);
            }
        }
    }

    /// A triangular lattice of side l stretched by ε alike in every direction: each strip carries h w σ(ε). A vertex of the
    /// straight lower rim lacks the two springs at −60° and −120°; its two rim springs cancel. So the muscle pulls it down with
    /// 2 · sin 60° · h · (√3/2 l) σ(ε) = 3/2 h l σ(ε): per length of rim l the tension (3/2) h σ of a sheet with ν = 1/3,
    /// E/(1 − ν) = 3/2 E.
    #[test]
    fn patch_test_on_equilateral_lattices() {
        let (h, e, curve) = (1.5, 0.17, StressStrainCurve::default());
        for (columns, rows, l) in [(5, 5, 8.6), (30, 21, 3.0), (141, 150, 0.7)] {
            let mesh = triangular(columns, rows, l);
            let x: Vec<_> = mesh.positions().iter().map(|v| Point3::from(v.coords * (1.0 + e))).collect();
            let f = field(&mesh, &x, SpringRule::Strip);
            let rim = 1.5e-3 * h * l * curve.stress_kpa(e);
            for (i, f) in f.iter().enumerate() {
                let (c, r) = (i % columns, i / columns);
                if c > 0 && c < columns - 1 && r > 0 && r < rows - 1 {
                    assert!(f.norm() < 1e-11 * rim, "inside: {f}");
                } else if r == 0 && c > 0 && c < columns - 1 {
                    assert!((f - Vector3::new(0.0, -rim, 0.0)).norm() < 1e-11 * rim, "rim: {f} {rim}");
                }
            }
        }
    }

    #[test]
    fn ranges_threads_and_any_order_of_the_vertices_give_one_field() {
        // 160 × 140 = 22 400 vertices: three ranges, more than one thread.
        let mesh = triangular(160, 140, 1.0);
        let x = shaken(mesh.positions(), 0.2, 3);
        let f = field(&mesh, &x, SpringRule::Strip);
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(
            one_thread.install(|| field(&mesh, &x, SpringRule::Strip)),
            f,
            "threads change nothing, to the last bit"
        );
        // Vertex i becomes i · 9973 mod n: neighbours lie in different ranges.
        let n = mesh.len();
        let to = |i: usize| i * 9973 % n;
        let mut moved = vec![Point3::origin(); n];
        let mut moved_x = moved.clone();
        for i in 0..n {
            moved[to(i)] = mesh.positions()[i];
            moved_x[to(i)] = x[i];
        }
        let triangles = mesh.triangles().iter().map(|t| t.map(|i| to(i as usize) as u32)).collect();
        let g = field(&Mesh::new(moved, triangles).unwrap(), &moved_x, SpringRule::Strip);
        let scale = f.iter().map(Vector3::norm).fold(0.0, f64::max);
        assert!((0..n).all(|i| (g[to(i)] - f[i]).norm() < 1e-12 * scale));
    }

    #[test]
    fn a_long_table_is_searched_and_gives_the_same_curve() {
        // σ = ε / (1 − ε) sampled in 100 rows.
        let rows: Vec<_> = (-50..50).map(|k| f64::from(k) / 100.0).map(|e| [e, 40.0 * e / (1.0 - e)]).collect();
        let curve = StressStrainCurve::new(rows, crate::skin::Contraction::Fung).unwrap();
        let mesh = triangular(6, 6, 5.0);
        let x = shaken(mesh.positions(), 1.0, 11);
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let mut fast = Vec::new();
        muscle_forces(&springs, &curve, &x, None, &mut fast);
        let slow = crate::forces::Stiffness::assemble(&springs, &curve, &x, &vec![true; mesh.len()]).apply(&x);
        assert!(fast.iter().zip(&slow).all(|(a, b)| (a - b).norm() < 1e-13));
    }

    #[test]
    fn strains_beyond_the_table_are_flagged_where_they_act() {
        let mesh = triangular(5, 5, 4.0);
        let mut x = mesh.positions().to_vec();
        // Vertex 12 moved 3 of 4 mm towards vertex 13: strain −0.75 there.
        x[12].x += 3.0;
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let curve = StressStrainCurve::default();
        let flagged = outside_table(&springs, &curve, &x, None);
        assert!(flagged[12] && flagged[13] && !flagged[24]);
        let mut active = vec![true; mesh.len()];
        active[12] = false;
        assert!(!outside_table(&springs, &curve, &x, Some(&active)).contains(&true));
    }

    #[test]
    fn collapsed_springs_give_finite_forces() {
        let mesh = triangular(4, 4, 3.0);
        let x = vec![Point3::new(1.0, 2.0, 3.0); mesh.len()];
        assert!(field(&mesh, &x, SpringRule::Strip).iter().all(|f| f.norm() == 0.0));
    }

    proptest! {
        #[test]
        fn internal_forces_sum_to_zero_and_have_no_moment(seed: u64, amount in 0.01..4.0_f64) {
            let mesh = triangular(9, 8, 6.0);
            let x = shaken(mesh.positions(), amount, seed);
            let f = field(&mesh, &x, SpringRule::Strip);
            let total: f64 = f.iter().map(Vector3::norm).sum();
            prop_assert!(internal_sum(&f).norm() <= 1e-13 * total);
            let moment: Vector3<f64> = x.iter().zip(&f).map(|(x, f)| x.coords.cross(f)).sum();
            prop_assert!(moment.norm() <= 1e-11 * total);
        }

        #[test]
        fn a_rigid_motion_makes_no_force(seed: u64, angle in -3.0..3.0_f64, shift in -300.0..300.0_f64) {
            let flat = triangular(7, 7, 6.0);
            let mesh = flat.with_positions(shaken(flat.positions(), 1.5, seed)).unwrap();
            let turn = Rotation3::new(Vector3::new(0.6, -0.5, 0.62) * angle);
            let x: Vec<_> = mesh.positions().iter().map(|p| turn * p + Vector3::new(shift, -shift, 0.3 * shift)).collect();
            let f = field(&mesh, &x, SpringRule::Strip);
            // Coordinates of some 600 mm carry rounding of 1e-13 mm; times 0.1 N/mm.
            prop_assert!(f.iter().all(|f| f.norm() < 1e-12));
        }

        /// Turning the face turns its forces.
        #[test]
        fn forces_turn_with_the_face(seed: u64, angle in -3.0..3.0_f64) {
            let mesh = triangular(6, 6, 5.0);
            let x = shaken(mesh.positions(), 1.0, seed);
            let turn = Rotation3::new(Vector3::new(0.1, 0.9, -0.4) * angle);
            let turned: Vec<_> = x.iter().map(|p| turn * p).collect();
            let (f, g) = (field(&mesh, &x, SpringRule::Strip), field(&mesh, &turned, SpringRule::Strip));
            let scale = f.iter().map(Vector3::norm).fold(0.0, f64::max);
            prop_assert!(f.iter().zip(&g).all(|(f, g)| (turn * f - g).norm() < 1e-11 * scale));
        }

        #[test]
        fn a_split_force_is_put_together_again(f in prop::array::uniform3(-1.0..1.0_f64), n in prop::array::uniform3(0.1..1.0_f64)) {
            let (f, n) = (Vector3::from(f), Vector3::from(n).normalize());
            let (tangential, normal) = split(&[f], &[n]);
            prop_assert!((tangential[0] + n * normal[0] - f).norm() < 1e-15 && tangential[0].dot(&n).abs() < 1e-15);
            let project = Matrix3::identity() - n * n.transpose();
            prop_assert!((project * f - tangential[0]).norm() < 1e-15);
        }
    }
}
