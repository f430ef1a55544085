//! The skin as point masses and springs, with everything that pulls on it and holds it.

use nalgebra::{Matrix3, Point3, Vector3};

use super::jaw::{Jaw, Pose};
use super::repulsion::{Repulsion, Wedge};
use super::skin_law::{SkinLaw, Spring};
use super::skull::Skull;
use crate::face::Mesh;
use crate::face::mesh::{Lists, doubled_area_vector};
use crate::forces::{SpringRule, Springs};

/// What keeps the skin on the face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Hold {
    /// It slides over the skull: every vertex keeps the height above it that it has at rest.
    #[default]
    Skull,
    /// A spring from every vertex to its place at rest, N/mm³ (that is, a mm² of skin).
    Anchors(f64),
    /// Nothing, as in the thesis: springs see only lengths, so the face may turn inside out under small forces
    /// (`docs/errata.md`).
    Bare,
}

impl Hold {
    /// Anchors as stiff as 6 mm of tissue with a shear modulus of 3.6 kPa under the skin (Mooney–Rivlin C10 = 0.4, C01 = 1.4 kPa,
    /// μ = 2 (C10 + C01): Barbarino 2011, as quoted in FACTS 1.1; the thickness is assumed).
    pub const ANCHORS: Self = Self::Anchors(0.6e-3);
}

/// The numbers of the mass–spring–damper system. Thesis (4.9)–(4.12).
#[derive(Clone, Debug, PartialEq)]
pub struct SystemOptions {
    /// What an edge answers to being stretched.
    pub law: SkinLaw,
    /// How wide a strip an edge stands for.
    pub spring_rule: SpringRule,
    /// Thickness of the skin, mm.
    pub thickness_mm: f64,
    /// Density of the skin, kg/m³.
    pub density_kg_m3: f64,
    /// c of (4.11) over the mass, 1/s.
    pub damping_per_s: f64,
    /// What keeps corners from crossing edges.
    pub repulsion: Option<Repulsion>,
    /// What keeps the skin on the face.
    pub hold: Hold,
    /// Factor on every stiffness of the skin.
    pub stiffness: f64,
    /// Stress that the skin is under at rest, kPa, with what balances it there; only under [`SkinLaw::Table`].
    ///
    /// Skin that loses all of it wrinkles and carries no more: with the pre-tension at which the table saturates no spring ever
    /// pushes, its energy is a convex function of the places, and there is one equilibrium. Without it pressed springs push, and
    /// the skin can give way sideways in more than one way.
    pub pre_tension_kpa: f64,
}

impl Default for SystemOptions {
    /// Thickness and density: FACTS 1.2. Pre-tension: what the table loses until it wrinkles; measured are 7 to 53 kPa (Flynn 2018). The damping lets the slowest motion of the face (about 5 Hz) end without swinging back:
    /// 2 · 2π · 5 Hz; it is assumed, no measured value was found.
    fn default() -> Self {
        Self {
            law: SkinLaw::default(),
            spring_rule: SpringRule::default(),
            thickness_mm: 1.5,
            density_kg_m3: 1100.0,
            damping_per_s: 60.0,
            repulsion: Some(Repulsion::default()),
            hold: Hold::default(),
            stiffness: 1.0,
            pre_tension_kpa: 9.13,
        }
    }
}

/// Why a system was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Lists of different lengths.
    #[error("the {what} are given for {found} vertices, but the mesh has {vertices}")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A number that cannot be.
    #[error("{what} is {value}; it must be {wanted}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// A place or a weight is NaN or infinite.
    #[error("vertex {vertex} has a {what} that is not a finite number")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// The vertex.
        vertex: usize,
    },
    /// A vertex that stands for no skin has no mass.
    #[error("vertex {vertex} belongs to no triangle with an area, so it has no mass")]
    Massless {
        /// The vertex.
        vertex: usize,
    },
}

/// Point masses, springs, repulsion, what holds them, and the muscles' loads. Thesis (4.12), Fig. 4.3.
#[derive(Clone, Debug)]
pub struct System {
    pub(super) rest: Vec<Point3<f64>>,
    pub(super) springs: Vec<Spring>,
    pub(super) wedges: Vec<Wedge>,
    springs_at: Lists,
    wedges_at: Lists,
    /// Mass of each vertex in N s²/mm (kg / 1000).
    pub(super) inertia: Vec<f64>,
    pub(super) free: Vec<bool>,
    pub(super) options: SystemOptions,
    skull: Option<(Skull, Vec<f64>)>,
    /// N/mm of each vertex; empty without anchors.
    anchors: Vec<f64>,
    jaw: Option<Jaw>,
    jaw_rad: f64,
    pose: Pose,
    loads: Vec<Vector3<f64>>,
    /// What balances the pre-tension at rest, N; empty without one.
    balance: Vec<Vector3<f64>>,
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

/// What the parts of the total energy are, mJ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// ½ m v².
    pub kinetic: f64,
    /// In stretched and pressed skin, in repulsion and anchors.
    pub elastic: f64,
    /// −Σ f·(x − x₀) of the muscles' loads and of what balances the pre-tension: what they have left to give.
    pub loads: f64,
}

impl Energy {
    /// The sum, which only damping may change, and only downwards.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.loads
    }
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
        check(&options)?;
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

    /// The angle of the jaw, rad.
    pub fn jaw_rad(&self) -> f64 {
        self.jaw_rad
    }

    /// Every vertex where its bone carries it from rest: a start for an equilibrium with an open jaw.
    pub fn carried(&self) -> Vec<Point3<f64>> {
        self.rest.iter().enumerate().map(|(i, p)| self.pose.moved(i, p)).collect()
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
    pub(super) fn within(&self, i: usize, x: &Point3<f64>, v: Vector3<f64>) -> Vector3<f64> {
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

    /// Potential energy (mJ) and the force on every vertex (N) but damping; what holds the skin to the skull is not among them.
    pub fn forces(&self, x: &[Point3<f64>], out: &mut Vec<Vector3<f64>>) -> f64 {
        out.clear();
        out.extend((0..self.len()).map(|i| self.given(i)));
        let mut energy = -self.work_of_loads(x);
        let scale = self.options.stiffness;
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|i| i as usize);
            let along = x[a] - x[b];
            let length = along.norm();
            let [u, tension, _] = self.options.law.at(spring, length, scale);
            energy += u;
            if length > 0.0 {
                let f = along * (tension / length);
                out[a] -= f;
                out[b] += f;
            }
        }
        if let Some(repulsion) = &self.options.repulsion {
            for wedge in &self.wedges {
                wedge.pushes(repulsion, Self::corners(wedge, x), &self.wedge_normal(wedge), |push| {
                    energy += push.energy;
                    for (i, g) in wedge.corners.iter().zip(push.gradient) {
                        out[*i as usize] += g * push.force;
                    }
                });
            }
        }
        for (i, f) in out.iter_mut().enumerate() {
            if let Some((k, place)) = self.anchor(i) {
                let d = x[i] - place;
                energy += 0.5 * k * d.norm_squared();
                *f -= d * k;
            }
        }
        energy
    }

    /// Potential energy (mJ) and the acceleration of every vertex (mm/s²), with damping, within what it can follow. Thesis (4.11),
    /// (4.12).
    pub(super) fn accelerations(&self, state: &State, out: &mut Vec<Vector3<f64>>) -> f64 {
        let energy = self.forces(&state.positions, out);
        for (i, a) in out.iter_mut().enumerate() {
            *a = if self.free[i] {
                let force = self.within(i, &state.positions[i], *a);
                force / self.inertia[i] - state.velocities[i] * self.options.damping_per_s
            } else {
                Vector3::zeros()
            };
        }
        energy
    }

    /// What pulls on a vertex wherever it is, N: the muscles, and what balances the pre-tension.
    pub(super) fn given(&self, i: usize) -> Vector3<f64> {
        self.balance.get(i).map_or(self.loads[i], |b| self.loads[i] + self.pose.turned(i, b))
    }

    fn work_of_loads(&self, x: &[Point3<f64>]) -> f64 {
        x.iter().zip(&self.rest).enumerate().map(|(i, (x, x0))| self.given(i).dot(&(x - x0))).sum()
    }

    /// Potential energy alone, mJ.
    pub fn potential(&self, x: &[Point3<f64>]) -> f64 {
        let scale = self.options.stiffness;
        let mut energy = -self.work_of_loads(x);
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|i| i as usize);
            energy += self.options.law.at(spring, (x[a] - x[b]).norm(), scale)[0];
        }
        if let Some(repulsion) = &self.options.repulsion {
            for wedge in &self.wedges {
                let normal = self.wedge_normal(wedge);
                wedge.pushes(repulsion, Self::corners(wedge, x), &normal, |push| energy += push.energy);
            }
        }
        for (i, x) in x.iter().enumerate() {
            if let Some((k, place)) = self.anchor(i) {
                energy += 0.5 * k * (x - place).norm_squared();
            }
        }
        energy
    }

    /// The energy of a state by its parts.
    pub fn energy(&self, state: &State) -> Energy {
        let loads = -self.work_of_loads(&state.positions);
        Energy { kinetic: self.kinetic(state), elastic: self.potential(&state.positions) - loads, loads }
    }

    pub(super) fn kinetic(&self, state: &State) -> f64 {
        self.inertia.iter().zip(&state.velocities).map(|(m, v)| 0.5 * m * v.norm_squared()).sum()
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

fn check(o: &SystemOptions) -> Result<(), SystemError> {
    let more_than_0 = [
        ("the thickness of the skin (mm)", o.thickness_mm),
        ("the density of the skin (kg/m³)", o.density_kg_m3),
        ("the factor on the stiffness", o.stiffness),
    ];
    for (what, value) in more_than_0 {
        if !(value > 0.0 && value.is_finite()) {
            return Err(SystemError::Value { what, value, wanted: "more than 0" });
        }
    }
    let anchors = if let Hold::Anchors(k) = o.hold { k } else { 0.0 };
    let r = o.repulsion.unwrap_or_default();
    let mut not_negative = vec![
        ("the damping (1/s)", o.damping_per_s),
        ("the stiffness of the anchors (N/mm³)", anchors),
        ("the strength of the repulsion", r.strength),
        ("the exponent of the repulsion", r.exponent),
        ("the pre-tension of the skin (kPa)", o.pre_tension_kpa),
        ("the share of the height below which corners are pushed", r.from),
    ];
    if let SkinLaw::Power(law) = &o.law {
        not_negative.extend([
            ("the stiffness k₀ (N/mm)", law.stiffness_n_per_mm),
            ("the exponent γ", law.exponent),
            ("the reference length (mm)", law.reference_mm - f64::MIN_POSITIVE),
        ]);
    }
    match not_negative.into_iter().find(|(_, value)| !(*value >= 0.0 && value.is_finite())) {
        Some((what, value)) => Err(SystemError::Value { what, value, wanted: "0 or more" }),
        None => Ok(()),
    }
}

fn springs(springs: &Springs, options: &SystemOptions) -> Vec<Spring> {
    let (_, newton_per_kpa) = springs.constants();
    let pre_kpa = if matches!(options.law, SkinLaw::Table(_)) { options.pre_tension_kpa } else { 0.0 };
    let all = springs.edges().iter().zip(springs.rest_length_mm()).zip(newton_per_kpa);
    all.map(|((&ends, &rest_mm), &newton_per_kpa)| Spring {
        ends,
        rest_mm,
        newton_per_kpa,
        pre_n: pre_kpa * newton_per_kpa,
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
