//! The springs: every edge of the mesh as a strip of skin.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::face::Mesh;
use crate::face::mesh::{Lists, NONE, doubled_area_vector};
use crate::skin::StressStrainCurve;

/// How wide a strip of skin an edge stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringRule {
    /// Its own: the area of its one or two triangles over its length (Van Gelder 1998). On a mesh of equilateral triangles
    /// this is a sheet of the curve's modulus E with Poisson's ratio 1/3, exactly.
    #[default]
    Strip,
    /// The mean of those widths for every edge: one law for all edges, as in the thesis. The force then depends on how the
    /// mesh was drawn.
    Uniform,
}

/// The edges of a mesh as nonlinear springs with a rest length and a cross-section. Thesis (4.1), (4.2), (5.2).
///
/// Tension of a spring of rest length l and length L, with w = ΣA/l the width of its strip and h the thickness of the skin:
///
/// f = h w σ(ε),   ε = (L − l) / l,   in N with h, w in mm and σ in kPa = 1e-3 N/mm²
///
/// With k = f / (L − l), the *secant* stiffness, this is (4.1); see [`Springs::secant_stiffness`].
///
/// An edge of rest length zero has no strain: its spring carries nothing, and [`Springs::degenerate`] names it.
#[derive(Clone, Debug, PartialEq)]
pub struct Springs {
    edges: Vec<[u32; 2]>,
    rest_length_mm: Vec<f64>,
    width_mm: Vec<f64>,
    thickness_mm: f64,
    /// 1/l, per mm; 0 for a degenerate spring.
    per_rest_length: Vec<f64>,
    /// 1e-3 h w: N per kPa; 0 for a degenerate spring.
    newton_per_kpa: Vec<f64>,
    at_vertex: Lists,
    vertices: usize,
}

/// Shortest rest length that counts as one, mm: a millionth of a hair. Below it a strain would be rounding error.
const SHORTEST_MM: f64 = 1e-9;

impl Springs {
    /// Springs along the edges of `mesh`, at rest in the positions `rest` (one a vertex, mm), in skin of `thickness_mm`.
    pub fn new(mesh: &Mesh, rest: &[Point3<f64>], rule: SpringRule, thickness_mm: f64) -> Self {
        let edges = mesh.edges().to_vec();
        let areas: Vec<f64> = mesh.triangles().iter().map(|&t| 0.5 * doubled_area_vector(rest, t).norm()).collect();
        let area = |t: u32| if t == NONE { 0.0 } else { areas[t as usize] };
        let rest_length_mm: Vec<f64> =
            edges.iter().map(|&[a, b]| (rest[a as usize] - rest[b as usize]).norm()).collect();
        let carries = |l: f64| l > SHORTEST_MM;
        let strips = mesh.triangles_of_edge().iter().zip(&rest_length_mm);
        let mut width_mm: Vec<f64> =
            strips.map(|(&[s, t], &l)| if carries(l) { (area(s) + area(t)) / l } else { 0.0 }).collect();
        if rule == SpringRule::Uniform {
            let carrying = rest_length_mm.iter().filter(|&&l| carries(l)).count().max(1);
            let mean = width_mm.iter().sum::<f64>() / carrying as f64;
            for (w, &l) in width_mm.iter_mut().zip(&rest_length_mm) {
                *w = if carries(l) { mean } else { 0.0 };
            }
        }
        let both_ends = edges.iter().enumerate().flat_map(|(e, &[a, b])| [(a, e as u32), (b, e as u32)]);
        Self {
            at_vertex: Lists::from_pairs(mesh.len(), both_ends),
            per_rest_length: rest_length_mm.iter().map(|&l| if carries(l) { 1.0 / l } else { 0.0 }).collect(),
            newton_per_kpa: width_mm.iter().map(|w| 1e-3 * thickness_mm * w).collect(),
            edges,
            rest_length_mm,
            width_mm,
            thickness_mm,
            vertices: mesh.len(),
        }
    }

    /// The two ends of each spring, lower index first, in ascending order (the edges of the mesh).
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// l of each spring, mm.
    pub fn rest_length_mm(&self) -> &[f64] {
        &self.rest_length_mm
    }

    /// Width w = ΣA/l of the strip of skin that each spring stands for, mm; 0 for a degenerate spring.
    pub fn width_mm(&self) -> &[f64] {
        &self.width_mm
    }

    /// Thickness of the skin, h, mm.
    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    /// Number of vertices of the mesh.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// The springs at a vertex, by their index.
    pub fn springs_of_vertex(&self, vertex: usize) -> &[u32] {
        self.at_vertex.row(vertex)
    }

    /// Springs of rest length zero, which carry nothing.
    pub fn degenerate(&self) -> impl Iterator<Item = u32> + '_ {
        self.per_rest_length.iter().enumerate().filter(|(_, k)| **k == 0.0).map(|(e, _)| e as u32)
    }

    /// Tension f of one spring at the length L, N; negative when it pushes.
    pub fn tension(&self, spring: usize, curve: &StressStrainCurve, length_mm: f64) -> f64 {
        self.newton_per_kpa[spring] * curve.stress_kpa(self.strain(spring, length_mm))
    }

    /// k of Thesis (4.1): tension over elongation, N/mm; its limit, the slope, at the rest length.
    ///
    /// k = h w (σ/ε) / l
    pub fn secant_stiffness(&self, spring: usize, curve: &StressStrainCurve, length_mm: f64) -> f64 {
        let strain = self.strain(spring, length_mm);
        self.newton_per_kpa[spring] * curve.secant_kpa(strain) * self.per_rest_length[spring]
    }

    /// df/dL of one spring, N/mm.
    pub fn tangent_stiffness(&self, spring: usize, curve: &StressStrainCurve, length_mm: f64) -> f64 {
        let strain = self.strain(spring, length_mm);
        self.newton_per_kpa[spring] * curve.slope_kpa(strain) * self.per_rest_length[spring]
    }

    /// Engineering strain (L − l) / l; 0 for a degenerate spring.
    pub fn strain(&self, spring: usize, length_mm: f64) -> f64 {
        (length_mm - self.rest_length_mm[spring]) * self.per_rest_length[spring]
    }

    /// x_a − x_b along one spring, mm.
    pub(crate) fn along(&self, spring: usize, positions: &[Point3<f64>]) -> Vector3<f64> {
        let [a, b] = self.edges[spring];
        positions[a as usize] - positions[b as usize]
    }

    /// 1/l and 1e-3 h w of each spring.
    pub(crate) fn constants(&self) -> (&[f64], &[f64]) {
        (&self.per_rest_length, &self.newton_per_kpa)
    }

    /// Whether a spring carries force: both ends active (all are, where nothing is said).
    pub(crate) fn is_active(&self, spring: usize, active: Option<&[bool]>) -> bool {
        let [a, b] = self.edges[spring];
        active.is_none_or(|active| active[a as usize] && active[b as usize])
    }
}

/// What stiffness is given to a direction that has none, as a share of the skin's own: so little moves nothing wrongly, and a
/// saturated sheet can still be stepped.
pub(super) const LEAST_SHARE: f64 = 1e-3;

/// s and q of s I + q a aᵀ, for a spring along a (mm) that answers with this energy, tension T (N) and
/// its slope k (N/mm), and has the stiffness `toe` at rest (N/mm):
/// k d dᵀ + max(0, T/L) (I − d dᵀ) along d = a / L, the stiffness of a spring without what would make it push sideways (Choi and Ko
/// 2002).
#[inline]
pub(crate) fn positive_stiffness([_, tension, slope]: [f64; 3], toe: f64, length_mm: f64) -> [f64; 2] {
    let slope = slope.max(LEAST_SHARE * toe);
    if length_mm < 1e-9 {
        return [slope, 0.0];
    }
    let sideways = (tension / length_mm).max(0.0);
    [sideways, (slope - sideways) / (length_mm * length_mm)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::triangular;

    /// An equilateral triangle of side 2: area √3; each edge has one triangle, so its strip is √3/2 wide.
    #[test]
    fn one_equilateral_triangle_by_hand() {
        let h = 3.0_f64.sqrt();
        let p = vec![Point3::origin(), Point3::new(2.0, 0.0, 0.0), Point3::new(1.0, h, 0.0)];
        let mesh = Mesh::new(p.clone(), vec![[0, 1, 2]]).unwrap();
        let springs = Springs::new(&mesh, &p, SpringRule::Strip, 1.5);
        for e in 0..3 {
            assert!((springs.rest_length_mm()[e] - 2.0).abs() < 1e-12);
            assert!((springs.width_mm()[e] - h / 2.0).abs() < 1e-12);
            // Stretched by 10 %: 1.5 mm · 0.866 mm · 3.62 kPa = 4.70e-3 N.
            let f = springs.tension(e, &StressStrainCurve::default(), 2.2);
            assert!((f - 1.5 * h / 2.0 * 3.62e-3).abs() < 1e-12);
            let k = springs.secant_stiffness(e, &StressStrainCurve::default(), 2.2);
            assert!((k * 0.2 - f).abs() < 1e-12);
        }
    }

    /// A sheet of modulus E and Poisson's ratio 1/3 under the strains (ε, 0) carries the plane stresses
    /// E ε / (1 − 1/9) = 9/8 E ε along and a third of that, 3/8 E ε, across.
    #[test]
    fn equilateral_meshes_are_a_sheet_of_the_curve_s_modulus_with_poisson_s_ratio_one_third() {
        let (mesh, pitch) = (triangular(9, 9, 4.0), 4.0);
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let curve = StressStrainCurve::default();
        let (e_kpa, strain) = (36.2, 1e-4);
        // Stress of the lattice: Σ over the springs of a vertex of f_e (d ⊗ d) l / 2, over its area √3/2 l² times h.
        let inner = 4 * 9 + 4;
        let mut stress = nalgebra::Matrix3::zeros();
        for &e in springs.springs_of_vertex(inner) {
            let d = springs.along(e as usize, mesh.positions()) / pitch;
            // To first order the spring lengthens by ε l d_x².
            let f = springs.tension(e as usize, &curve, pitch * (1.0 + strain * d.x * d.x));
            stress += d * d.transpose() * f * pitch / 2.0;
        }
        stress *= 1e3 / (3.0_f64.sqrt() / 2.0 * pitch * pitch * 1.5);
        assert!((stress[(0, 0)] - 9.0 / 8.0 * e_kpa * strain).abs() < 1e-9 * e_kpa);
        assert!((stress[(1, 1)] - 3.0 / 8.0 * e_kpa * strain).abs() < 1e-9 * e_kpa);
        assert!(stress[(0, 1)].abs() < 1e-12);
    }

    #[test]
    fn the_uniform_rule_gives_every_edge_the_mean_width() {
        let mesh = triangular(4, 3, 2.0);
        let strip = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.0);
        let uniform = Springs::new(&mesh, mesh.positions(), SpringRule::Uniform, 1.0);
        let mean = strip.width_mm().iter().sum::<f64>() / strip.width_mm().len() as f64;
        assert!(uniform.width_mm().iter().all(|w| (w - mean).abs() < 1e-12));
    }

    #[test]
    fn a_spring_of_no_length_carries_nothing_and_is_named() {
        let p = vec![Point3::origin(), Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let mesh = Mesh::new(p.clone(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        for rule in [SpringRule::Strip, SpringRule::Uniform] {
            let springs = Springs::new(&mesh, &p, rule, 1.5);
            assert_eq!(springs.degenerate().collect::<Vec<_>>(), [0]);
            let f = springs.tension(0, &StressStrainCurve::default(), 3.0);
            assert_eq!(f, 0.0);
            assert!(springs.width_mm().iter().all(|w| w.is_finite()));
        }
    }
}
