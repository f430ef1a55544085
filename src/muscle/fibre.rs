//! The fibre of one muscle on one customised face, and where a point of the skin lies beside it.

use nalgebra::{Point3, Vector3};

use crate::face;

/// One muscle on one customised face: a straight line of fibres. Thesis (3.10), (3.11).
///
/// m = A − I, m̂ = m / ‖m‖, n = (n_A + n_I) / ‖n_A + n_I‖
///
/// | here         | thesis     | unit |
/// |--------------|------------|------|
/// | `attachment` | A, m_j^A   | mm |
/// | `insertion`  | I, m_j^I   | mm |
/// | `normal`     | n_j        | unit vector |
/// | [`Fibre::pull`] | m_ji    | unit vector, from the insertion towards the attachment |
///
/// Differs from the thesis: (3.11) prints a minus, which is 0/0 on flat skin (`docs/errata.md`).
#[derive(Clone, Debug, PartialEq)]
pub struct Fibre {
    /// The fixed (bone) end, mm.
    pub attachment: Point3<f64>,
    /// The moving (skin) end, mm.
    pub insertion: Point3<f64>,
    /// Half the width of the band of fibres, mm.
    pub half_width_mm: f64,
    /// Half the angle of the muscle's zone as seen from the attachment, rad: φ of (3.2).
    pub zone_half_angle: f64,
    /// Mean of the skin's outward normals at both ends, a unit vector.
    pub normal: Vector3<f64>,
    length_mm: f64,
    pull: Vector3<f64>,
}

/// Why a fibre was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FibreError {
    /// A number is NaN or infinite.
    #[error("a fibre holds something that is not a finite number")]
    NotFinite,
    /// Both ends in one place: the fibre has no direction.
    #[error("a fibre's attachment and insertion lie in one place")]
    NoLength,
    /// A band without fibres.
    #[error("a fibre's half width is {half_width_mm} mm; it must be more than 0")]
    NoWidth {
        /// The width given, mm.
        half_width_mm: f64,
    },
    /// A zone that is no cone.
    #[error("a fibre's zone has a half angle of {zone_half_angle} rad; it must lie between 0 and π/2")]
    Zone {
        /// The angle given, rad.
        zone_half_angle: f64,
    },
    /// Normals that cancel, or none: between them there is no side of the skin.
    #[error("the skin's normals at a fibre's ends oppose each other")]
    OpposedNormals,
    /// A muscle bound to a vertex that is not there.
    #[error("muscle {id} is bound to vertex {vertex}, but there are only {vertices} vertices")]
    Unbound {
        /// The muscle.
        id: String,
        /// The vertex named.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
}

/// Shorter fibres are refused, mm: below this the direction is made of rounding errors.
const SHORTEST_MM: f64 = 1e-6;

/// Normals whose sum is shorter are refused.
const LEAST_SUM_OF_NORMALS: f64 = 1e-6;

impl Fibre {
    /// A fibre between two points of the skin with its outward normals there.
    ///
    /// Without a zone (rad) the one within twice the half width at the insertion is taken: tan φ = 2 w / ‖m‖.
    pub fn new(
        attachment: Point3<f64>,
        insertion: Point3<f64>,
        half_width_mm: f64,
        zone_half_angle: Option<f64>,
        normals: [Vector3<f64>; 2],
    ) -> Result<Self, FibreError> {
        let m = attachment - insertion;
        let length_mm = m.norm();
        let sum = normals[0] + normals[1];
        let numbers = [length_mm, half_width_mm, zone_half_angle.unwrap_or(0.0), sum.norm(), attachment.coords.norm()];
        if !numbers.iter().all(|v| v.is_finite()) {
            return Err(FibreError::NotFinite);
        }
        if length_mm < SHORTEST_MM {
            return Err(FibreError::NoLength);
        }
        if half_width_mm <= 0.0 {
            return Err(FibreError::NoWidth { half_width_mm });
        }
        let zone_half_angle = zone_half_angle.unwrap_or_else(|| (2.0 * half_width_mm / length_mm).atan());
        if !(zone_half_angle > 0.0 && zone_half_angle < std::f64::consts::FRAC_PI_2) {
            return Err(FibreError::Zone { zone_half_angle });
        }
        if sum.norm() < LEAST_SUM_OF_NORMALS {
            return Err(FibreError::OpposedNormals);
        }
        let (normal, pull) = (sum.normalize(), m / length_mm);
        Ok(Self { attachment, insertion, half_width_mm, zone_half_angle, normal, length_mm, pull })
    }

    /// The fibre of a face's muscle, for the positions (mm) and outward unit normals of its vertices.
    pub fn of(muscle: &face::Muscle, positions: &[Point3<f64>], normals: &[Vector3<f64>]) -> Result<Self, FibreError> {
        let end = |vertex: u32| match (positions.get(vertex as usize), normals.get(vertex as usize)) {
            (Some(position), Some(normal)) => Ok((*position, *normal)),
            _ => Err(FibreError::Unbound { id: muscle.id.clone(), vertex, vertices: positions.len() }),
        };
        let (attachment, at_bone) = end(muscle.attachment)?;
        let (insertion, at_skin) = end(muscle.insertion)?;
        let zone = muscle.zone_half_angle_deg.map(f64::to_radians);
        Self::new(attachment, insertion, muscle.half_width_mm, zone, [at_bone, at_skin])
    }

    /// Length of the fibre ‖m‖, mm.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Unit vector from the insertion to the attachment: where the skin is pulled. Thesis (3.10).
    pub fn pull(&self) -> Vector3<f64> {
        self.pull
    }

    /// Where a point lies beside the fibre. Thesis (3.12)–(3.15), (5.1), (5.6), (5.7).
    ///
    /// ρ = (A − x) · m̂, p = (x − A) + ρ m̂, ω = ‖p − (p · n) n‖, γ = ‖p‖ / ‖m‖
    ///
    /// Differs from the thesis: (3.13) prints p = (x − A) − ρ m̂, which is not perpendicular to the fibre, and (5.6), (5.7) divide by
    /// the length of a unit vector (`docs/errata.md`).
    #[inline]
    pub fn place(&self, x: &Point3<f64>) -> Place {
        let from_point = self.attachment - x;
        let distance = from_point.norm();
        let rho = from_point.dot(&self.pull);
        let p = self.pull * rho - from_point;
        let lateral = (p - self.normal * p.dot(&self.normal)).norm();
        // At the attachment itself there is no angle: behind is where every zone gives nothing.
        let cos_angle = if distance > 0.0 { (rho / distance).clamp(-1.0, 1.0) } else { -1.0 };
        Place {
            along: rho / self.length_mm,
            across: p.norm() / self.length_mm,
            lateral: lateral / self.half_width_mm,
            reach: distance / self.length_mm,
            cos_angle,
        }
    }

    /// Distance of a point from the fibre between its ends, mm.
    pub fn distance_mm(&self, x: &Point3<f64>) -> f64 {
        let rho = (self.attachment - x).dot(&self.pull).clamp(0.0, self.length_mm);
        (self.attachment - self.pull * rho - x).norm()
    }
}

/// A point of the skin beside a fibre, without units: the shape parameters of a law act on nothing else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Distance from the attachment along the fibre over the fibre's length: 0 at the attachment, 1 at the insertion, negative
    /// behind the attachment. ε of (3.15), and ε + 1 of (5.6).
    pub along: f64,
    /// Distance from the fibre's line over the fibre's length: γ of (5.7).
    pub across: f64,
    /// Distance from the fibre's line without its part along the skin's normal, over the half width: ω of (3.14).
    pub lateral: f64,
    /// Distance from the attachment over the fibre's length: ‖A − x‖ / ‖m‖ of (3.3).
    pub reach: f64,
    /// Cosine of the angle between the fibre and the way to the point, seen from the attachment: cos β of (3.2). −1 at the
    /// attachment itself, where there is no angle.
    pub cos_angle: f64,
}
