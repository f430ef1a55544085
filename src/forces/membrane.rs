//! The skin as a membrane of triangles instead of springs: the same sheet by another discretisation, to hold the springs against.
//!
//! Every triangle of the mesh is a constant-strain element: its deformation gradient F (3 × 2) is the linear map that takes the triangle at
//! rest to where its corners are. The energy of an area A of skin of thickness h is A h W(F) with one of two materials.

use nalgebra::{Matrix2, Matrix3, Point3, SymmetricEigen, Vector2, Vector3};

use super::springs::{LEAST_SHARE, positive_stiffness};
use crate::face::Mesh;
use crate::face::mesh::doubled_area_vector;
use crate::skin::StressStrainCurve;

/// How the curve of a strip of skin becomes a law of a sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Material {
    /// Fibres in every direction: W = (3/π) ∫₀^π w(‖F n(θ)‖ − 1) dθ with w(ε) = ∫₀^ε σ. For small strains the isotropic sheet of the
    /// curve's modulus E with Poisson's ratio 1/3; along the three directions of an equilateral triangle alone it is its three springs.
    #[default]
    Fibres,
    /// Stretches along the two principal directions do not know each other: W = w(λ₁ − 1) + w(λ₂ − 1). For small strains the sheet of the
    /// modulus E with Poisson's ratio 0.
    Principal,
}

/// What a membrane is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Stress over strain of a strip.
    pub curve: StressStrainCurve,
    /// Thickness, mm.
    pub thickness_mm: f64,
    /// How the strip's law becomes that of a sheet.
    pub material: Material,
    /// Directions θ over which fibres are summed (trapezoidal rule, the first along x as far as the triangle lets it).
    pub directions: usize,
}

impl Default for Sheet {
    /// Skin as the solver has it: the default curve, 1.5 mm thick.
    fn default() -> Self {
        Self { curve: StressStrainCurve::default(), thickness_mm: 1.5, material: Material::default(), directions: 12 }
    }
}

/// A triangle of skin.
#[derive(Clone, Debug)]
struct Element {
    corners: [u32; 3],
    /// ∇Nᵢ of the three hat functions in the plane of the triangle at rest, 1/mm.
    slopes: [Vector2<f64>; 3],
    /// 1e-3 A h: mJ a kPa, mm³ · 1e-3.
    millijoule_per_kpa: f64,
    /// Outward unit normal at rest.
    normal: Vector3<f64>,
}

/// Skin as a mesh of membrane elements.
#[derive(Clone, Debug)]
pub struct Membrane {
    sheet: Sheet,
    elements: Vec<Element>,
    /// cos² θ, cos θ sin θ and sin² θ of the fibres.
    fibres: Vec<[f64; 3]>,
    vertices: usize,
}

/// Energy density (kPa), its slope P = ∂W/∂F (3 × 2, by columns) and ∂²W/∂F∂F of one element.
struct Answer {
    energy: f64,
    stress: [Vector3<f64>; 2],
    stiffness: [[Matrix3<f64>; 2]; 2],
}

/// Below this share of its area at rest a triangle is held open; above, nothing is added to the material. Without it skin that is pressed beyond
/// the end of the curve's resistance would be pressed to nothing, and turn over.
const LEAST_AREA: f64 = 0.4;
/// How stiffly, in moduli of the skin.
const OPENING: f64 = 5.0;
impl Membrane {
    /// The skin of a mesh at rest. Triangles without an area carry nothing.
    pub fn new(mesh: &Mesh, rest: &[Point3<f64>], sheet: Sheet) -> Self {
        let elements = mesh.triangles().iter().filter_map(|&corners| {
            let [a, b, c] = corners.map(|i| rest[i as usize]);
            let doubled = doubled_area_vector(rest, corners);
            let normal = doubled.try_normalize(1e-12)?;
            // Fibres lie alike in triangles beside each other, so that a uniform stretch is one stress.
            let axis = if normal.x.abs() < 0.95 { Vector3::x() } else { Vector3::y() };
            let along = (axis - normal * normal.dot(&axis)).try_normalize(1e-12)?;
            let across = normal.cross(&along);
            let flat = |d: Vector3<f64>| Vector2::new(d.dot(&along), d.dot(&across));
            // ∇N of a corner: across its opposite side, inwards, one over the height.
            let slope = |from: Point3<f64>, to: Point3<f64>| {
                let side = flat(to - from);
                Vector2::new(-side.y, side.x) / doubled.norm()
            };
            Some(Element {
                corners,
                slopes: [slope(b, c), slope(c, a), slope(a, b)],
                millijoule_per_kpa: 0.5e-3 * doubled.norm() * sheet.thickness_mm,
                normal,
            })
        });
        let elements = elements.collect();
        let step = std::f64::consts::PI / sheet.directions.max(1) as f64;
        let squares = |k: usize| {
            let (sin, cos) = (step * k as f64).sin_cos();
            [cos * cos, cos * sin, sin * sin]
        };
        let fibres = (0..sheet.directions.max(1)).map(squares).collect();
        Self { fibres, sheet, elements, vertices: mesh.len() }
    }

    /// What it is made of.
    pub fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    /// Elastic energy (mJ) and its force −∂U/∂x on every vertex, N. An element with a corner that is not `active` (absent: all are)
    /// carries nothing.
    pub fn forces(&self, x: &[Point3<f64>], active: Option<&[bool]>, out: &mut Vec<Vector3<f64>>) -> f64 {
        out.clear();
        out.resize(self.vertices, Vector3::zeros());
        let mut energy = 0.0;
        for e in self.elements.iter().filter(|e| e.is_active(active)) {
            let (stored, pull) = self.pulls(e, x);
            energy += stored;
            for (corner, pull) in e.corners.iter().zip(pull) {
                out[*corner as usize] -= pull;
            }
        }
        energy
    }

    /// Energy of an element (mJ) and ∂U/∂x of its corners, N: what must pull there from outside.
    fn pulls(&self, e: &Element, x: &[Point3<f64>]) -> (f64, [Vector3<f64>; 3]) {
        let answer = self.answer::<1>(&e.gradient(x));
        let (open, push) = self.opening(e, x);
        let pull = [0, 1, 2].map(|i| {
            let g = e.slopes[i];
            let opening = if push == 0.0 { Vector3::zeros() } else { e.area_slope(x, i) * push };
            (answer.stress[0] * g.x + answer.stress[1] * g.y + opening) * e.millijoule_per_kpa
        });
        (e.millijoule_per_kpa * (answer.energy + open), pull)
    }

    /// What some elements, by their numbers, need from outside at one of their corners, N.
    pub(super) fn pull_on(&self, vertex: u32, elements: &[u32], x: &[Point3<f64>], active: &[bool]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for e in elements.iter().filter_map(|e| self.elements.get(*e as usize)).filter(|e| e.is_active(Some(active))) {
            for (_, pull) in e.corners.iter().zip(self.pulls(e, x).1).filter(|(c, _)| **c == vertex) {
                sum += pull;
            }
        }
        sum
    }

    /// ∂²U/∂xᵢ∂xⱼ of every element's corners, N/mm, with the element's number; all directions that would make it indefinite left out unless
    /// `whole`. An element with a corner that is not `active` is left out.
    pub(crate) fn stiffness(
        &self,
        x: &[Point3<f64>],
        active: Option<&[bool]>,
        whole: bool,
        mut add: impl FnMut(usize, [u32; 3], [[Matrix3<f64>; 3]; 3]),
    ) {
        for (number, e) in self.elements.iter().enumerate().filter(|(_, e)| e.is_active(active)) {
            let f = e.gradient(x);
            let answer = if whole { self.answer::<2>(&f) } else { self.answer::<3>(&f) };
            let stiff = OPENING * self.toe_kpa();
            let pushes = self.opening(e, x).1 != 0.0;
            let area = if pushes { [0, 1, 2].map(|i| e.area_slope(x, i)) } else { [Vector3::zeros(); 3] };
            let block = |i: usize, j: usize| {
                let (g, h) = (e.slopes[i], e.slopes[j]);
                let mut k = Matrix3::zeros();
                for a in 0..2 {
                    for b in 0..2 {
                        k += answer.stiffness[a][b] * (g[a] * h[b]);
                    }
                }
                // The area is bilinear in the corners: what its own curvature adds is left out.
                if pushes {
                    k += area[i] * area[j].transpose() * stiff;
                }
                k * e.millijoule_per_kpa
            };
            let [k00, k01, k02, k11, k12, k22] =
                [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(i, j)| block(i, j));
            let rows = [[k00, k01, k02], [k01.transpose(), k11, k12], [k02.transpose(), k12.transpose(), k22]];
            add(number, e.corners, rows);
        }
    }

    /// Corners of every element, in the order of [`Self::stiffness`].
    pub(crate) fn corners(&self) -> impl Iterator<Item = [u32; 3]> + Clone + '_ {
        self.elements.iter().map(|e| e.corners)
    }

    /// Largest and least principal stretch of every element.
    pub fn stretches(&self, x: &[Point3<f64>]) -> Vec<[f64; 2]> {
        let of = |e: &Element| {
            let ([l1, l2], ..) = principal(&e.gradient(x));
            [l1, l2]
        };
        self.elements.iter().map(of).collect()
    }

    fn toe_kpa(&self) -> f64 {
        self.sheet.curve.slope_kpa(0.0)
    }

    /// ½ k (a − J)² of a triangle whose area J, as a share of that at rest and with the sign of the side on which it lies, is less than
    /// [`LEAST_AREA`] = a; and its slope −k (a − J), k = [`OPENING`] E.
    fn opening(&self, e: &Element, x: &[Point3<f64>]) -> (f64, f64) {
        let off = LEAST_AREA - e.area(x);
        if off <= 0.0 {
            return (0.0, 0.0);
        }
        let stiff = OPENING * self.toe_kpa();
        (0.5 * stiff * off * off, -stiff * off)
    }

    /// ORDER 1: energy and stress; 2: and stiffness; 3: and the positive part of the stiffness.
    fn answer<const ORDER: u8>(&self, f: &[Vector3<f64>; 2]) -> Answer {
        match self.sheet.material {
            Material::Fibres => self.of_fibres::<ORDER>(f),
            Material::Principal => self.of_stretches::<ORDER>(f),
        }
    }

    /// With C = FᵀF a fibre is stretched by λ = √(nᵀ C n). P = F S with S = Σ (σ/λ) n nᵀ, and ∂²W/∂Fₐ∂F_b = S_ab I + F T_ab Fᵀ with
    /// T_abcd = Σ (σ' − σ/λ)/λ² nₐ n_b n_c n_d, which has five numbers: one for each count of y among its indices.
    fn of_fibres<const ORDER: u8>(&self, f: &[Vector3<f64>; 2]) -> Answer {
        let mut answer = Answer::none();
        let weight = 3.0 / self.fibres.len() as f64;
        let toe = self.toe_kpa();
        let [c00, c01, c11] = [f[0].dot(&f[0]), f[0].dot(&f[1]), f[1].dot(&f[1])];
        let (mut pull, mut even, mut along) = ([0.0; 3], [0.0; 3], [0.0; 5]);
        for &[xx, xy, yy] in &self.fibres {
            let stretch = (c00 * xx + 2.0 * c01 * xy + c11 * yy).max(0.0).sqrt();
            let [energy, stress, slope] = self.sheet.curve.energy_stress_slope_kpa(stretch - 1.0);
            answer.energy += weight * energy;
            if stretch < 1e-9 {
                continue;
            }
            let squares = [xx, xy, yy];
            let secant = weight * stress / stretch;
            for (to, n) in pull.iter_mut().zip(squares) {
                *to += secant * n;
            }
            let [sideways, more] = match ORDER {
                2 => [secant, (weight * slope - secant) / (stretch * stretch)],
                3 => positive_stiffness([0.0, stress, slope], toe, stretch).map(|k| weight * k),
                _ => continue,
            };
            for (to, n) in even.iter_mut().zip(squares) {
                *to += sideways * n;
            }
            for (to, n) in along.iter_mut().zip([xx * xx, xx * xy, xx * yy, xy * yy, yy * yy]) {
                *to += more * n;
            }
        }
        answer.stress = [f[0] * pull[0] + f[1] * pull[1], f[0] * pull[1] + f[1] * pull[2]];
        if ORDER == 1 {
            return answer;
        }
        let (f00, f11) = (f[0] * f[0].transpose(), f[1] * f[1].transpose());
        let both = f[0] * f[1].transpose();
        let both = both + both.transpose();
        let of = |k: usize| {
            f00 * along[k] + both * along[k + 1] + f11 * along[k + 2] + Matrix3::from_diagonal_element(even[k])
        };
        let [k00, k01, k11] = [0, 1, 2].map(of);
        answer.stiffness = [[k00, k01], [k01, k11]];
        answer
    }

    fn of_stretches<const ORDER: u8>(&self, f: &[Vector3<f64>; 2]) -> Answer {
        let mut answer = Answer::none();
        let (stretch, n, u) = principal(f);
        let law = stretch.map(|l| self.sheet.curve.energy_stress_slope_kpa(l - 1.0));
        answer.energy = law[0][0] + law[1][0];
        for ([_, stress, _], (n, u)) in law.iter().zip(n.iter().zip(&u)) {
            answer.stress[0] += u * (stress * n.x);
            answer.stress[1] += u * (stress * n.y);
        }
        if ORDER == 1 {
            return answer;
        }
        // Second derivative of a function of the singular values: along each, a twist, a flip, and out of the plane (Smith, de Goes
        // and Kim 2019).
        let [s1, s2] = [law[0][1], law[1][1]];
        let apart = stretch[0] - stretch[1];
        let flip = if apart > 1e-6 { (s1 - s2) / apart } else { law[0][2] };
        let together = (stretch[0] + stretch[1]).max(1e-9);
        let least = LEAST_SHARE * self.toe_kpa();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let out = u[0].cross(&u[1]);
        let per = |i: usize| law[i][1] / stretch[i].max(1e-9);
        let modes: [(f64, [Vector3<f64>; 2], f64); 6] = [
            (law[0][2], [u[0] * n[0].x, u[0] * n[0].y], least),
            (law[1][2], [u[1] * n[1].x, u[1] * n[1].y], least),
            (flip, [0, 1].map(|a| (u[0] * n[1][a] + u[1] * n[0][a]) * half), least),
            ((s1 + s2) / together, [0, 1].map(|a| (u[0] * n[1][a] - u[1] * n[0][a]) * half), 0.0),
            (per(0), [0, 1].map(|a| out * n[0][a]), 0.0),
            (per(1), [0, 1].map(|a| out * n[1][a]), 0.0),
        ];
        for (k, mode, floor) in modes {
            let k = if ORDER == 3 { k.max(floor) } else { k };
            for a in 0..2 {
                for b in 0..2 {
                    answer.stiffness[a][b] += mode[a] * mode[b].transpose() * k;
                }
            }
        }
        answer
    }
}

impl Answer {
    fn none() -> Self {
        Self { energy: 0.0, stress: [Vector3::zeros(); 2], stiffness: [[Matrix3::zeros(); 2]; 2] }
    }
}

impl Element {
    fn is_active(&self, active: Option<&[bool]>) -> bool {
        active.is_none_or(|active| self.corners.iter().all(|c| active[*c as usize]))
    }

    /// F by columns.
    fn gradient(&self, x: &[Point3<f64>]) -> [Vector3<f64>; 2] {
        let mut f = [Vector3::zeros(); 2];
        for (corner, g) in self.corners.iter().zip(&self.slopes) {
            let p = x[*corner as usize].coords;
            f[0] += p * g.x;
            f[1] += p * g.y;
        }
        f
    }

    /// Area over that at rest, seen along the normal at rest.
    fn area(&self, x: &[Point3<f64>]) -> f64 {
        let [f0, f1] = self.gradient(x);
        f0.cross(&f1).dot(&self.normal)
    }

    /// Its slope by the place of corner `i`, 1/mm.
    fn area_slope(&self, x: &[Point3<f64>], i: usize) -> Vector3<f64> {
        let ([f0, f1], g) = (self.gradient(x), self.slopes[i]);
        f1.cross(&self.normal) * g.x + self.normal.cross(&f0) * g.y
    }
}

/// Principal stretches of F, the larger first, their directions at rest and where these point now.
fn principal(f: &[Vector3<f64>; 2]) -> ([f64; 2], [Vector2<f64>; 2], [Vector3<f64>; 2]) {
    let cauchy = Matrix2::new(f[0].dot(&f[0]), f[0].dot(&f[1]), f[0].dot(&f[1]), f[1].dot(&f[1]));
    let eigen = SymmetricEigen::new(cauchy);
    let (large, small) = if eigen.eigenvalues[0] >= eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    let n = [eigen.eigenvectors.column(large).into_owned(), eigen.eigenvectors.column(small).into_owned()];
    let now = n.map(|n| f[0] * n.x + f[1] * n.y);
    let stretch = now.map(|v| v.norm());
    let u0 = now[0].try_normalize(1e-12).unwrap_or_else(Vector3::x);
    let sideways = f[0].cross(&f[1]).try_normalize(1e-12).unwrap_or_else(Vector3::z).cross(&u0);
    (stretch, n, [u0, now[1].try_normalize(1e-12).unwrap_or(sideways)])
}

#[cfg(test)]
mod tests;
