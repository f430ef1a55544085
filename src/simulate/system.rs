//! The skin as point masses and springs, with everything that pulls on it and holds it.

use nalgebra::{Matrix3, Point3, Vector3};

use super::jaw::{Carried, Jaw, Pose};
use super::options::{Hold, SystemError, SystemOptions, check};
use super::repulsion::{Repulsion, Wedge};
use super::skin_law::{SkinLaw, Spring};
use crate::face::mesh::{Lists, doubled_area_vector};
use crate::face::{Mesh, Skull};
use crate::forces::Springs;

/// Point masses, springs, repulsion, what holds them, and the muscles' loads. Thesis (4.12), Fig. 4.3.
#[derive(Clone, Debug)]
pub struct System {
    pub(super) rest: Vec<Point3<f64>>,
    pub(super) springs: Vec<Spring>,
    pub(super) wedges: Vec<Wedge>,
    /// Stiffness of each spring at rest, N/mm.
    pub(super) toes: Vec<f64>,
    springs_at: Lists,
    wedges_at: Lists,
    /// Mass of each vertex in N s²/mm (kg / 1000).
    pub(crate) inertia: Vec<f64>,
    pub(super) free: Vec<bool>,
    pub(super) options: SystemOptions,
    skull: Option<(Skull, Vec<f64>)>,
    /// N/mm of each vertex; empty without anchors.
    anchors: Vec<f64>,
    jaw: Option<Jaw>,
    jaw_rad: f64,
    pub(super) pose: Pose,
    pub(super) loads: Vec<Vector3<f64>>,
    /// What balances the pre-tension at rest, N; empty without one.
    pub(super) balance: Vec<Vector3<f64>>,
    size_mm: f64,
    changes: u64,
}

/// Places (mm) and velocities (mm/s) of the vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Places.
    pub positions: Vec<Point3<f64>>,
    /// Velocities.
    pub velocities: Vec<Vector3<f64>>,
}

impl System {
    /// The skin of a face at rest. `fixed` vertices stay on their bone; without a jaw no bone moves.
    pub fn new(
        mesh: &Mesh,
        rest: &[Point3<f64>],
        fixed: &[bool],
        jaw: Option<Jaw>,
        options: SystemOptions,
    ) -> Result<Self, SystemError> {
        let n = mesh.len();
        let length =
            |what, found| if found == n { Ok(()) } else { Err(SystemError::Length { what, found, vertices: n }) };
        length("places at rest", rest.len())?;
        length("fixed vertices", fixed.len())?;
        length("weights of the jaw", jaw.as_ref().map_or(n, |j| j.weights.len()))?;
        if let Some(vertex) = rest.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(SystemError::NotFinite { what: "place", vertex });
        }
        if let Some(vertex) = jaw.as_ref().and_then(|j| j.weights.iter().position(|w| !w.is_finite())) {
            return Err(SystemError::NotFinite { what: "weight of the jaw", vertex });
        }
        check(&options, mesh.edges().len())?;
        let areas = mesh.vertex_areas(rest);
        // kg/m³ · mm² · mm = 1e-9 kg, and 1 kg = 1e-3 N s²/mm.
        let per_area = 1e-12 * options.density_kg_m3 * options.thickness_mm;
        if let Some(vertex) = areas.iter().zip(fixed).position(|(a, fixed)| *a <= 0.0 && !fixed) {
            return Err(SystemError::Massless { vertex });
        }
        let springs = springs(&Springs::new(mesh, rest, options.spring_rule, options.thickness_mm), &options);
        let wedges = wedges(mesh, rest, &springs, &options);
        let ends = springs.iter().enumerate().flat_map(|(e, s)| s.ends.map(|i| (i, e as u32)));
        let corners = wedges.iter().enumerate().flat_map(|(w, t)| t.corners.map(|i| (i, w as u32)));
        let skull = matches!(options.hold, Hold::Skull).then(|| {
            let skull = Skull::new(mesh, rest);
            let heights = rest.iter().map(|p| skull.slope(p).0).collect();
            (skull, heights)
        });
        let anchors = match options.hold {
            Hold::Anchors(per_area) => areas.iter().map(|a| a * per_area).collect(),
            Hold::Skull | Hold::Bare => Vec::new(),
        };
        let balance = balance(rest, &springs, options.stiffness);
        let (mut low, mut high) = (rest[0], rest[0]);
        for p in rest {
            (low, high) = (low.inf(p), high.sup(p));
        }
        Ok(Self {
            rest: rest.to_vec(),
            springs_at: Lists::from_pairs(n, ends),
            wedges_at: Lists::from_pairs(n, corners),
            toes: springs.iter().map(|s| options.law.toe(s, options.stiffness)).collect(),
            springs,
            wedges,
            inertia: areas.iter().map(|a| a * per_area).collect(),
            free: fixed.iter().map(|f| !f).collect(),
            options,
            skull,
            anchors,
            jaw,
            jaw_rad: 0.0,
            pose: Pose::default(),
            loads: vec![Vector3::zeros(); n],
            balance,
            size_mm: (high - low).norm(),
            changes: 0,
        })
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.rest.len()
    }

    /// Always false: a mesh has vertices.
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The places at rest, mm.
    pub fn rest(&self) -> &[Point3<f64>] {
        &self.rest
    }

    /// Whether each vertex may move.
    pub fn free(&self) -> &[bool] {
        &self.free
    }

    /// The numbers it was built with.
    pub fn options(&self) -> &SystemOptions {
        &self.options
    }

    /// Diagonal of the box around the face at rest, mm.
    pub fn size_mm(&self) -> f64 {
        self.size_mm
    }

    /// Everything at rest.
    pub fn at_rest(&self) -> State {
        State { positions: self.rest.clone(), velocities: vec![Vector3::zeros(); self.len()] }
    }

    /// The muscles' pull on every vertex, N.
    pub fn loads(&self) -> &[Vector3<f64>] {
        &self.loads
    }

    /// Sets the muscles' pull on every vertex, N.
    ///
    /// # Errors
    /// Refuses a wrong number of loads and any that is not finite.
    pub fn set_loads(&mut self, loads: Vec<Vector3<f64>>) -> Result<(), SystemError> {
        if loads.len() != self.len() {
            return Err(SystemError::Length { what: "loads", found: loads.len(), vertices: self.len() });
        }
        if let Some(vertex) = loads.iter().position(|f| !f.iter().all(|c| c.is_finite())) {
            return Err(SystemError::NotFinite { what: "load", vertex });
        }
        self.loads = loads;
        self.changes += 1;
        Ok(())
    }

    /// Opens the jaw by an angle (rad; 0 is shut). Without a jaw nothing happens.
    pub fn open_jaw(&mut self, angle_rad: f64) {
        if angle_rad == self.jaw_rad || !angle_rad.is_finite() {
            return;
        }
        if let Some(jaw) = &self.jaw {
            self.pose = Pose::of(jaw, angle_rad);
            self.jaw_rad = angle_rad;
            self.changes += 1;
        }
    }

    /// How often loads and bones were changed.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// Whether there is a jaw.
    pub fn has_jaw(&self) -> bool {
        self.jaw.is_some()
    }

    /// The angle of the jaw, rad.
    pub fn jaw_rad(&self) -> f64 {
        self.jaw_rad
    }

    /// Every vertex where its bone carries it from rest: a start for an equilibrium with an open jaw.
    pub fn carried(&self) -> Vec<Point3<f64>> {
        self.rest.iter().enumerate().map(|(i, p)| self.pose.moved(i, p)).collect()
    }

    /// Places on the bones as these would carry them if the jaw opened by so much more, rad, and vectors there turned back with them; none without
    /// a jaw.
    pub(super) fn carried_further(&self, by_rad: f64) -> Option<Carried> {
        let jaw = self.jaw.as_ref()?;
        Some(Carried { now: self.pose.clone(), then: Pose::of(jaw, self.jaw_rad + by_rad) })
    }

    /// The same from where the bones were at an angle of the jaw, rad, to where they are; none where that is the angle it has.
    pub(super) fn carried_since(&self, before_rad: f64) -> Option<Carried> {
        let jaw = self.jaw.as_ref().filter(|_| before_rad != self.jaw_rad)?;
        Some(Carried { now: Pose::of(jaw, before_rad), then: self.pose.clone() })
    }

    /// Coordinates in which a free vertex can move: 2 over the skull, else 3.
    pub(super) fn freedoms(&self) -> usize {
        if self.skull.is_some() { 2 } else { 3 }
    }

    pub(super) fn springs_of(&self, i: usize) -> &[u32] {
        self.springs_at.row(i)
    }

    pub(super) fn wedges_of(&self, i: usize) -> &[u32] {
        self.wedges_at.row(i)
    }

    pub(super) fn anchor(&self, i: usize) -> Option<(f64, Point3<f64>)> {
        self.anchors.get(i).map(|k| (*k, self.pose.moved(i, &self.rest[i])))
    }

    /// c of a vertex, N s/mm.
    pub(super) fn damping(&self, i: usize) -> f64 {
        self.options.damping_per_s * self.inertia[i]
    }

    /// Normal at rest of a triangle, turned with the bone under it.
    pub(super) fn wedge_normal(&self, wedge: &Wedge) -> Vector3<f64> {
        if self.pose.is_at_rest() {
            return wedge.normal;
        }
        let sum: Vector3<f64> = wedge.corners.iter().map(|&i| self.pose.turned(i as usize, &wedge.normal)).sum();
        sum.try_normalize(1e-9).unwrap_or(wedge.normal)
    }

    pub(super) fn corners(wedge: &Wedge, x: &[Point3<f64>]) -> [Point3<f64>; 3] {
        wedge.corners.map(|i| x[i as usize])
    }

    /// Twice the signed area of each triangle, mm²: negative where it has turned over.
    pub fn doubled_areas(&self, x: &[Point3<f64>]) -> Vec<f64> {
        self.wedges.iter().map(|w| Wedge::doubled_area(Self::corners(w, x), &self.wedge_normal(w))).collect()
    }

    /// How far each vertex lies from the height above the skull that it has at rest, mm; zero without a skull.
    pub fn off_the_skull_mm(&self, x: &[Point3<f64>]) -> Vec<f64> {
        let Some((skull, heights)) = &self.skull else { return vec![0.0; x.len()] };
        let off = |(i, p): (usize, &Point3<f64>)| {
            let (height, gradient) = skull.slope(&self.pose.back(i, p));
            (height - heights[i]) / gradient.norm().max(1e-9)
        };
        x.iter().enumerate().map(off).collect()
    }

    /// Outward normal of the surface that a vertex slides on, and the curvature of that surface (∇∇φ / ‖∇φ‖); none without a skull.
    pub(super) fn surface(&self, i: usize, x: &Point3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (skull, _) = self.skull.as_ref()?;
        let at = skull.height(&self.pose.back(i, x));
        let size = at.gradient.norm();
        if size < 1e-9 {
            return None;
        }
        if self.pose.is_at_rest() {
            return Some((at.gradient / size, at.curvature / size));
        }
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|a| self.pose.turned_back(i, &a));
        let b = Matrix3::from_columns(&columns);
        Some((self.pose.turned(i, &(at.gradient / size)), b.transpose() * (at.curvature / size) * b))
    }

    /// The normal alone.
    pub(super) fn normal(&self, i: usize, x: &Point3<f64>) -> Option<Vector3<f64>> {
        let (skull, _) = self.skull.as_ref()?;
        let (_, gradient) = skull.slope(&self.pose.back(i, x));
        Some(self.pose.turned(i, &gradient.try_normalize(1e-9)?))
    }

    /// The place nearest to `x` where a vertex may be: its bone's for a fixed one, its height above the skull for one that slides.
    pub(super) fn allowed(&self, i: usize, x: &Point3<f64>) -> Point3<f64> {
        if !self.free[i] {
            return self.pose.moved(i, &self.rest[i]);
        }
        let Some((skull, heights)) = &self.skull else { return *x };
        let mut p = self.pose.back(i, x);
        for _ in 0..12 {
            let (height, gradient) = skull.slope(&p);
            let off = heights[i] - height;
            let squared = gradient.norm_squared();
            if off * off <= OFF_MM * OFF_MM * squared || squared < 1e-18 {
                break;
            }
            // A step of at most 10 mm: far from the face the slope says little about the surface.
            let step = gradient * (off / squared);
            p += step * (10.0 / step.norm()).min(1.0);
            // Halving the number of right digits that are left: after a small step the next would be too small to see.
            if step.norm_squared() < OFF_MM {
                break;
            }
        }
        self.pose.moved(i, &p)
    }

    /// Takes out of a vector what a vertex cannot follow.
    pub(crate) fn within(&self, i: usize, x: &Point3<f64>, v: Vector3<f64>) -> Vector3<f64> {
        if !self.free[i] {
            return Vector3::zeros();
        }
        match self.normal(i, x) {
            Some(n) => v - n * n.dot(&v),
            None => v,
        }
    }

    /// The velocities with which a step came from `begin`, as far as the vertices can follow them.
    pub(super) fn velocities(&self, begin: &[Point3<f64>], step_s: f64, state: &mut State) {
        for (i, (x, x0)) in state.positions.iter().zip(begin).enumerate() {
            state.velocities[i] = self.within(i, x, (x - x0) / step_s);
        }
    }

    /// Puts every vertex where it may be and takes from its velocity what it cannot follow.
    pub fn settle(&self, state: &mut State) {
        for i in 0..self.len() {
            state.positions[i] = self.allowed(i, &state.positions[i]);
            state.velocities[i] = self.within(i, &state.positions[i], state.velocities[i]);
        }
    }

    /// Sum of m v over all vertices, N s.
    pub fn momentum(&self, state: &State) -> Vector3<f64> {
        self.inertia.iter().zip(&state.velocities).map(|(m, v)| v * *m).sum()
    }

    /// Bound of the fastest natural frequency at rest (rad/s) and the vertex that it comes from: ω² ≤ max 2 Σⱼ kᵢⱼ / mᵢ
    /// (Gershgorin's circles around the stiffness matrix).
    pub fn fastest_rad_per_s(&self) -> (f64, usize) {
        let mut k = vec![0.0; self.len()];
        for spring in &self.springs {
            let toe = self.options.law.toe(spring, self.options.stiffness);
            for i in spring.ends {
                k[i as usize] += 2.0 * toe;
            }
        }
        let squared =
            |i: usize| if self.free[i] { (k[i] + self.anchors.get(i).unwrap_or(&0.0)) / self.inertia[i] } else { 0.0 };
        let fastest = (0..self.len()).max_by(|&a, &b| squared(a).total_cmp(&squared(b))).unwrap_or(0);
        (squared(fastest).sqrt(), fastest)
    }
}

/// How far from its height a vertex may be left, mm.
const OFF_MM: f64 = 1e-7;

fn springs(springs: &Springs, options: &SystemOptions) -> Vec<Spring> {
    let (_, newton_per_kpa) = springs.constants();
    let pre_kpa = if matches!(options.law, SkinLaw::Table(_)) { options.pre_tension_kpa } else { 0.0 };
    let all = springs.edges().iter().zip(springs.rest_length_mm()).zip(newton_per_kpa);
    all.enumerate()
        .map(|(e, ((&ends, &rest_mm), &newton_per_kpa))| {
            let factor = options.of_edges.get(e).copied().unwrap_or(1.0);
            let newton_per_kpa = factor * newton_per_kpa;
            Spring { ends, rest_mm, newton_per_kpa, factor, pre_n: pre_kpa * newton_per_kpa }
        })
        .collect()
}

/// The pull on every vertex that keeps pre-tensed springs at rest, N.
fn balance(rest: &[Point3<f64>], springs: &[Spring], scale: f64) -> Vec<Vector3<f64>> {
    if springs.iter().all(|s| s.pre_n == 0.0) {
        return Vec::new();
    }
    let mut balance = vec![Vector3::zeros(); rest.len()];
    for spring in springs.iter().filter(|s| s.rest_mm > 0.0) {
        let [a, b] = spring.ends.map(|i| i as usize);
        let pull = (rest[a] - rest[b]) * (scale * spring.pre_n / spring.rest_mm);
        balance[a] += pull;
        balance[b] -= pull;
    }
    balance
}

fn wedges(mesh: &Mesh, rest: &[Point3<f64>], springs: &[Spring], options: &SystemOptions) -> Vec<Wedge> {
    let repulsion = options.repulsion.unwrap_or(Repulsion { strength: 0.0, ..Repulsion::default() });
    let toe = |a: u32, b: u32| {
        let found = mesh.edges().binary_search(&[a.min(b), a.max(b)]);
        found.map_or(0.0, |e| options.law.toe(&springs[e], options.stiffness))
    };
    mesh.triangles()
        .iter()
        .map(|&corners| {
            let doubled = doubled_area_vector(rest, corners);
            let [a, b, c] = corners;
            let side = |i: u32, j: u32| (rest[i as usize] - rest[j as usize]).norm();
            let height = |i: u32, j: u32| {
                let length = side(i, j);
                if length > 0.0 { repulsion.from * doubled.norm() / length } else { 0.0 }
            };
            Wedge {
                corners,
                normal: doubled.try_normalize(1e-12).unwrap_or_else(Vector3::z),
                from_mm: [height(b, c), height(c, a), height(a, b)],
                stiffness: repulsion.strength * (toe(a, b) + toe(b, c) + toe(c, a)) / 3.0,
            }
        })
        .collect()
}
