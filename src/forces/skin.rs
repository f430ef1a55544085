//! The skin between the vertices, as springs along the edges or as a membrane of triangles: what a change of its shape takes.

use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::force_field::{muscle_forces, outside_table};
use super::uncertainty::ForceSlopes;
use super::{Membrane, Sheet, SpringRule, Springs};
use crate::face::Mesh;
use crate::face::mesh::Lists;
use crate::skin::StressStrainCurve;

/// What resists between the vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SkinModel {
    /// A spring along every edge. Thesis (4.1).
    #[default]
    Springs,
    /// Every triangle a membrane element with fibres in all directions ([`Membrane`]).
    Membrane,
}

impl SkinModel {
    /// All, the thesis's first.
    pub const ALL: [Self; 2] = [Self::Springs, Self::Membrane];

    /// Whether it is the thesis's.
    pub fn is_springs(&self) -> bool {
        *self == Self::Springs
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Springs => "Springs",
            Self::Membrane => "Membrane",
        }
    }
}

/// Everything about the skin but its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinSpec {
    /// What resists.
    pub model: SkinModel,
    /// How wide a strip of skin an edge stands for; of the strains of the edges and, in the model of springs, of all forces.
    pub rule: SpringRule,
    /// Thickness h, mm.
    pub thickness_mm: f64,
    /// Stress over strain of a strip.
    pub curve: StressStrainCurve,
}

/// The skin of a mesh at rest, ready to say what force every vertex needs in another shape: F = −K X. Thesis (4.5).
///
/// Of a membrane K is as sparse and as symmetric as of springs, and its rows, too, sum to zero:
///
/// K_ij = −Σ_t A_t h g_iᵀ S_t g_j,   S_t = Σ_θ (3/n) σ(λ_θ − 1)/λ_θ n_θ n_θᵀ,   λ_θ = ‖F_t n_θ‖
///
/// over the triangles t at the edge, with the slopes g of their hat functions and n directions θ of fibres ([`Membrane`]).
#[derive(Clone, Debug)]
pub struct Skin {
    springs: Springs,
    curve: StressStrainCurve,
    triangles: Option<Triangles>,
}

#[derive(Clone, Debug)]
struct Triangles {
    membrane: Membrane,
    /// The edges of every element, opposite to nothing: those between its corners 01, 12 and 20.
    sides: Vec<[u32; 3]>,
    of_vertex: Lists,
}

impl Skin {
    /// The skin of a mesh that is at rest at `rest` (mm, one a vertex).
    pub fn new(mesh: &Mesh, rest: &[Point3<f64>], spec: &SkinSpec) -> Self {
        let springs = Springs::new(mesh, rest, spec.rule, spec.thickness_mm);
        let triangles = (spec.model == SkinModel::Membrane).then(|| {
            let sheet = Sheet { curve: spec.curve.clone(), thickness_mm: spec.thickness_mm, ..Sheet::default() };
            let membrane = Membrane::new(mesh, rest, sheet);
            let edge = |a: u32, b: u32| mesh.edges().binary_search(&[a.min(b), a.max(b)]).unwrap_or(0) as u32;
            let sides = membrane.corners().map(|[a, b, c]| [edge(a, b), edge(b, c), edge(c, a)]).collect();
            let pairs = membrane.corners().enumerate().flat_map(|(e, t)| t.map(|v| (v, e as u32)));
            Triangles { of_vertex: Lists::from_pairs(mesh.len(), pairs), sides, membrane }
        });
        Self { springs, curve: spec.curve.clone(), triangles }
    }

    /// The edges as springs: what carries in the model of springs, and what strains are told by in each.
    pub fn springs(&self) -> &Springs {
        &self.springs
    }

    /// The membrane, where that is the model.
    pub fn membrane(&self) -> Option<&Membrane> {
        self.triangles.as_ref().map(|t| &t.membrane)
    }

    /// The external (muscle) force on every vertex, N, in the shape `positions` (mm). What touches a vertex that is not `active`
    /// carries nothing. Thesis (4.5).
    pub fn muscle_forces(&self, positions: &[Point3<f64>], active: &[bool], out: &mut Vec<Vector3<f64>>) {
        let Some(triangles) = &self.triangles else {
            return muscle_forces(&self.springs, &self.curve, positions, Some(active), out);
        };
        triangles.membrane.forces(positions, Some(active), out);
        for f in out {
            *f = -*f;
        }
    }

    /// The same on one vertex alone.
    pub fn muscle_force_on(&self, vertex: u32, positions: &[Point3<f64>], active: &[bool]) -> Vector3<f64> {
        if let Some(triangles) = &self.triangles {
            return triangles.membrane.pull_on(vertex, triangles.of_vertex.row(vertex as usize), positions, active);
        }
        let springs = &self.springs;
        let mut force = Vector3::zeros();
        for &e in springs.springs_of_vertex(vertex as usize) {
            let e = e as usize;
            let [a, b] = springs.edges()[e];
            let other = if a == vertex { b } else { a } as usize;
            let along = positions[vertex as usize] - positions[other];
            let length = along.norm();
            if length > 0.0 && active[other] {
                force += along / length * springs.tension(e, &self.curve, length);
            }
        }
        force
    }

    /// How the forces change with the shape.
    pub fn slopes(&self, positions: &[Point3<f64>], active: &[bool]) -> ForceSlopes<'_> {
        let Some(Triangles { membrane, sides, .. }) = &self.triangles else {
            return ForceSlopes::of_springs(&self.springs, &self.curve, positions, Some(active));
        };
        let mut blocks = vec![Matrix3::zeros(); self.springs.edges().len()];
        membrane.stiffness(positions, Some(active), true, |element, corners, k| {
            for (c, edge) in sides[element].iter().enumerate() {
                let d = (c + 1) % 3;
                let (low, high) = if corners[c] < corners[d] { (c, d) } else { (d, c) };
                blocks[*edge as usize] -= k[low][high];
            }
        });
        ForceSlopes::of_blocks(&self.springs, blocks)
    }

    /// Whether each vertex touches skin that is strained beyond the table: its force is then a continuation. Of a membrane the principal
    /// stretches are asked, between which those of all its fibres lie.
    pub fn outside_table(&self, positions: &[Point3<f64>], active: &[bool]) -> Vec<bool> {
        let Some(Triangles { membrane, .. }) = &self.triangles else {
            return outside_table(&self.springs, &self.curve, positions, Some(active));
        };
        let mut outside = vec![false; active.len()];
        for (corners, stretch) in membrane.corners().zip(membrane.stretches(positions)) {
            let carries = corners.iter().all(|c| active[*c as usize]);
            if carries && stretch.iter().any(|l| !self.curve.covers(l - 1.0)) {
                for c in corners {
                    outside[c as usize] = true;
                }
            }
        }
        outside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::patches::{shaken, triangular};
    use crate::forces::uncertainty::assert_differences;

    fn skin(mesh: &Mesh, model: SkinModel) -> Skin {
        let curve = StressStrainCurve::default();
        Skin::new(mesh, mesh.positions(), &SkinSpec { model, rule: SpringRule::Strip, thickness_mm: 1.5, curve })
    }

    fn field(skin: &Skin, x: &[Point3<f64>], active: &[bool]) -> Vec<Vector3<f64>> {
        let mut out = Vec::new();
        skin.muscle_forces(x, active, &mut out);
        out
    }

    #[test]
    fn the_slopes_are_those_of_the_forces_by_central_differences() {
        let mesh = triangular(6, 5, 6.0);
        let x = shaken(mesh.positions(), 0.6, 5);
        let mut active = vec![true; mesh.len()];
        active[7] = false;
        for model in SkinModel::ALL {
            let skin = skin(&mesh, model);
            assert_differences(&skin.slopes(&x, &active), &x, 1e-7, |x| field(&skin, x, &active));
        }
    }

    #[test]
    fn the_force_on_one_vertex_is_that_of_the_field_there() {
        let mesh = triangular(6, 5, 6.0);
        let x = shaken(mesh.positions(), 0.9, 8);
        let mut active = vec![true; mesh.len()];
        active[11] = false;
        for model in SkinModel::ALL {
            let skin = skin(&mesh, model);
            let all = field(&skin, &x, &active);
            let largest = all.iter().map(Vector3::norm).fold(0.0, f64::max);
            for v in (0..mesh.len()).filter(|v| active[*v]) {
                let alone = skin.muscle_force_on(v as u32, &x, &active);
                assert!((alone - all[v]).norm() < 1e-13 * largest, "{model:?} {v}");
            }
            assert!(all[11].norm() == 0.0, "what is not known carries nothing");
        }
    }

    /// K_ij of a membrane from its definition, element by element: the field is −K X, K is symmetric and its rows sum to zero.
    #[test]
    fn the_force_of_a_membrane_is_minus_k_x() {
        let mesh = triangular(5, 5, 6.0);
        let n = mesh.len();
        let skin = skin(&mesh, SkinModel::Membrane);
        let x = shaken(mesh.positions(), 0.5, 3);
        let (rest, curve) = (mesh.positions(), StressStrainCurve::default());
        let mut k = vec![vec![0.0; n]; n];
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|v| rest[v as usize].xy());
            let doubled = (b - a).perp(&(c - a));
            // ∇N of a corner: its opposite side turned by a right angle, over twice the area.
            let slope = |from: nalgebra::Point2<f64>, to: nalgebra::Point2<f64>| {
                nalgebra::Vector2::new(-(to - from).y, (to - from).x) / doubled
            };
            let g = [slope(b, c), slope(c, a), slope(a, b)];
            let mut s = nalgebra::Matrix2::zeros();
            for step in 0..12 {
                let angle = std::f64::consts::PI * f64::from(step) / 12.0;
                let n = nalgebra::Vector2::new(angle.cos(), angle.sin());
                let along: Vector3<f64> = (0..3).map(|i| x[t[i] as usize].coords * g[i].dot(&n)).sum();
                let stretch = along.norm();
                s += n * n.transpose() * (3.0 / 12.0 * curve.stress_kpa(stretch - 1.0) / stretch);
            }
            for i in 0..3 {
                for j in 0..3 {
                    k[t[i] as usize][t[j] as usize] -= 1e-3 * 0.5 * doubled * 1.5 * (s * g[j]).dot(&g[i]);
                }
            }
        }
        let force = field(&skin, &x, &vec![true; n]);
        for i in 0..n {
            assert!(k[i].iter().sum::<f64>().abs() < 1e-12);
            assert!((0..n).all(|j| (k[i][j] - k[j][i]).abs() < 1e-15));
            let minus_k_x: Vector3<f64> = -(0..n).map(|j| x[j].coords * k[i][j]).sum::<Vector3<f64>>();
            assert!((force[i] - minus_k_x).norm() < 1e-12, "{i}: {} {minus_k_x}", force[i]);
        }
    }

    #[test]
    fn skin_drawn_out_beyond_the_table_is_flagged_in_either_model() {
        let mesh = triangular(5, 4, 6.0);
        let mut x = mesh.positions().to_vec();
        x[0].x -= 6.0;
        let mut active = vec![true; mesh.len()];
        for model in SkinModel::ALL {
            let skin = skin(&mesh, model);
            let flagged = skin.outside_table(&x, &active);
            assert!(flagged[0] && flagged[1] && !flagged[mesh.len() - 1], "{model:?}");
            active[0] = false;
            assert!(!skin.outside_table(&x, &active).contains(&true), "{model:?}");
            active[0] = true;
        }
    }
}
