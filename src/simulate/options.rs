//! The numbers of the mass–spring–damper system, and which of them are refused.

use super::repulsion::Repulsion;
use super::skin_law::SkinLaw;
use crate::forces::SpringRule;

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
    /// Factor on the stiffness (and the pre-tension) of each edge, in the order of [`crate::face::Mesh::edges`]; none is 1 everywhere.
    pub of_edges: Vec<f64>,
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
            of_edges: Vec::new(),
            pre_tension_kpa: 9.13,
        }
    }
}

/// Why a system was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Not one factor an edge.
    #[error("there are {found} factors on the stiffness for {edges} edges; give one an edge, or none")]
    Edges {
        /// How many factors.
        found: usize,
        /// Number of edges.
        edges: usize,
    },
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

/// Refuses numbers that no skin has.
pub(super) fn check(o: &SystemOptions, edges: usize) -> Result<(), SystemError> {
    if ![0, edges].contains(&o.of_edges.len()) {
        return Err(SystemError::Edges { found: o.of_edges.len(), edges });
    }
    let more_than_0 = [
        ("the thickness of the skin (mm)", o.thickness_mm),
        ("the density of the skin (kg/m³)", o.density_kg_m3),
        ("the factor on the stiffness", o.stiffness),
    ];
    let of_edges = o.of_edges.iter().map(|f| ("the factor on the stiffness of an edge", *f));
    for (what, value) in more_than_0.into_iter().chain(of_edges) {
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
