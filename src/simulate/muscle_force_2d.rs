//! Erkoç's construction: a muscle's force found in the unrolled face and lifted back by the plane of a facet. Thesis §4.3.
//!
//! ```text
//! u = R atan2(x − x₀, z − z₀),   v = y                                          (4.18)
//! n = (x₂ − x₁) × (x₃ − x₁),     n · (x − x₁) = 0                               (4.19)–(4.21)
//! x − x₀ = r sin φ,  z − z₀ = r cos φ,  y = v,  φ = u/R                         (4.22)
//! r(φ, v) = (n·(x₁ − o) − n_y v) / (n_x sin φ + n_z cos φ)                      (4.23)
//! ```
//!
//! with o = (x₀, 0, z₀) on the axis. A force (f_u, f_v) of the plane becomes the derivative of that point at x₁, lengthened to ‖f‖:
//! with the ray e_r = (sin φ, 0, cos φ), its perpendicular e_φ = (cos φ, 0, −sin φ) and r at x₁,
//!
//! ```text
//! w = (r/R) f_u e_φ + f_v e_y,   t = w − e_r (n·w)/(n·e_r),   load = ‖f‖ t/‖t‖
//! ```
//!
//! that is, w is pushed along the ray onto the facet, where a tangent projection would push it along the normal.
//!
//! Differs from the thesis (`docs/errata.md`): atan2 and not arctan(x/z), which folds what lies behind the axis onto what lies before it; u is
//! a length like v; (4.22), (4.23) give a *point*, whose way from x₁ grows with tan u: its derivative is taken; a facet that holds the
//! ray, or no facet, is named and the plain tangent projection taken there.
//!
//! On the generic face the two constructions differ by the angles that `docs/accuracy.md` states.

use nalgebra::{Matrix3, Point3, Vector2, Vector3};

use super::muscle_force::Skin;
use crate::muscle::{Fibre, MuscleLaw};

/// Why a vertex has no force by the construction asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exception {
    /// The force points along the skin's normal: its tangent part has no direction. The load is 0.
    AlongNormal,
    /// The facet into which the force points holds the ray from the axis: (4.23) divides by nothing. Tangent projection instead.
    FacetHoldsRay,
    /// No facet lies where the force points: the vertex is on a border. Tangent projection instead.
    NoFacet,
    /// The vertex, or an end of the fibre, lies on the axis, where u is not defined. Tangent projection instead.
    OnAxis,
}

impl Exception {
    /// For people.
    pub fn label(self) -> &'static str {
        match self {
            Self::AlongNormal => "the force points along the skin's normal",
            Self::FacetHoldsRay => {
                "the facet holds the ray from the axis; the force was projected onto the skin instead"
            }
            Self::NoFacet => "no facet lies where the force points; the force was projected onto the skin instead",
            Self::OnAxis => "the axis of the cylinder goes through; the force was projected onto the skin instead",
        }
    }
}

/// The upright cylinder on which the face is unrolled. Thesis (4.18), whose axis is x = z = 0 and whose radius is 1 of any unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// x₀ of its axis, mm.
    pub x: f64,
    /// z₀ of its axis, mm.
    pub z: f64,
    /// R, mm: where the face lies, so that lengths in the plane are about those on the face.
    pub radius_mm: f64,
}

/// Nearer to the axis than this share of the radius a vertex has no angle.
const ON_AXIS: f64 = 1e-6;
/// A facet whose normal is nearer than this to a right angle with the ray (sine) holds it.
const HOLDS_RAY: f64 = 0.05;
/// A direction this little outside a facet's corner is in it: it lies on the edge to the next.
const ON_EDGE: f64 = 1e-9;

impl Cylinder {
    /// The cylinder nearest to the vertices, seen from above: the circle with the least Σ (‖p − c‖² − R²)² (Kåsa 1976). None where they
    /// lie in an upright plane, or in one place.
    pub fn about(positions: &[Point3<f64>]) -> Option<Self> {
        let count = positions.len() as f64;
        let middle = positions.iter().map(|p| p.coords).sum::<Vector3<f64>>() / count;
        // 2 c·q + (R² − c²) = q² for q from the middle: a line in three unknowns.
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for p in positions {
            let q = p.coords - middle;
            let row = Vector3::new(q.x, q.z, 1.0);
            normal += row * row.transpose();
            right += row * (q.x * q.x + q.z * q.z);
        }
        let spread = (normal[(0, 0)] + normal[(1, 1)]) / count;
        let flatness = normal.fixed_view::<2, 2>(0, 0).determinant() / (count * count);
        if !(spread > 0.0 && flatness > 1e-8 * spread * spread) {
            return None;
        }
        let s = normal.try_inverse()? * right;
        let (x, z) = (0.5 * s.x, 0.5 * s.y);
        let radius_mm = (s.z + x * x + z * z).sqrt();
        radius_mm.is_finite().then_some(Self { x: x + middle.x, z: z + middle.z, radius_mm })
    }

    /// (u, v) of a place, mm; none on the axis. Thesis (4.18).
    pub fn unrolled(&self, p: &Point3<f64>) -> Option<Vector2<f64>> {
        let (x, z) = (p.x - self.x, p.z - self.z);
        (x.hypot(z) > ON_AXIS * self.radius_mm).then(|| Vector2::new(self.radius_mm * x.atan2(z), p.y))
    }
}

/// A muscle in the unrolled face.
#[derive(Clone, Debug)]
pub struct Unrolled {
    cylinder: Cylinder,
    fibre: Fibre,
}

impl Unrolled {
    /// The fibre with its ends, width and zone in the plane.
    pub fn of(cylinder: Cylinder, fibre: &Fibre) -> Result<Self, Exception> {
        let end = |p| cylinder.unrolled(p).map(|q| Point3::new(q.x, q.y, 0.0)).ok_or(Exception::OnAxis);
        let (attachment, insertion) = (end(&fibre.attachment)?, end(&fibre.insertion)?);
        let zone = Some(fibre.zone_half_angle);
        let flat = Fibre::new(attachment, insertion, fibre.half_width_mm, zone, [Vector3::z(); 2]);
        Ok(Self { cylinder, fibre: flat.map_err(|_| Exception::OnAxis)? })
    }

    /// Force (f_u, f_v, 0) of the muscle on a place, N: the law in the plane.
    pub fn force(&self, law: &MuscleLaw, strengths: &[f64], p: &Point3<f64>) -> Vector3<f64> {
        let Some(q) = self.cylinder.unrolled(p) else { return Vector3::zeros() };
        let q = Point3::new(q.x, q.y, 0.0);
        strengths.iter().enumerate().map(|(lobe, s)| law.lobe_force(lobe, &self.fibre, &q) * *s).sum()
    }

    /// The force of the plane on a vertex as one that lies in a facet of the skin there, of the same length. Thesis (4.19)–(4.23).
    pub fn lift(&self, skin: Skin<'_>, vertex: u32, f: Vector2<f64>) -> Result<Vector3<f64>, Exception> {
        let at = skin.positions[vertex as usize];
        let (x, z) = (at.x - self.cylinder.x, at.z - self.cylinder.z);
        let r = x.hypot(z);
        if r <= ON_AXIS * self.cylinder.radius_mm {
            return Err(Exception::OnAxis);
        }
        let ray = Vector3::new(x / r, 0.0, z / r);
        let around = Vector3::new(ray.z, 0.0, -ray.x);
        let w = around * (f.x * r / self.cylinder.radius_mm) + Vector3::y() * f.y;
        let mut why = Exception::NoFacet;
        let mut turned_away = None;
        for &t in skin.mesh.triangles_of_vertex(vertex as usize) {
            let [a, b] = others(skin.mesh.triangles()[t as usize], vertex).map(|i| skin.positions[i as usize] - at);
            let n = a.cross(&b);
            let outwards = n.dot(&ray);
            if outwards.abs() <= HOLDS_RAY * n.norm() {
                why = Exception::FacetHoldsRay;
                continue;
            }
            let t = w - ray * (n.dot(&w) / outwards);
            // t = α a + β b in the plane of the facet: it points between its edges where neither is negative.
            let per_n = 1.0 / n.norm_squared();
            let (alpha, beta) = (t.cross(&b).dot(&n) * per_n * a.norm(), a.cross(&t).dot(&n) * per_n * b.norm());
            if alpha.min(beta) < -ON_EDGE * t.norm() {
                continue;
            }
            // Where the face overhangs, a facet turned away from the axis is the one to be seen from it.
            if outwards > 0.0 {
                return Ok(lengthened_to(t, f.norm()));
            }
            turned_away = Some(t);
        }
        turned_away.map(|t| lengthened_to(t, f.norm())).ok_or(why)
    }
}

fn lengthened_to(t: Vector3<f64>, length: f64) -> Vector3<f64> {
    t.try_normalize(0.0).map_or_else(Vector3::zeros, |t| t * length)
}

/// The other two corners of a triangle, in its order.
fn others([a, b, c]: [u32; 3], vertex: u32) -> [u32; 2] {
    if vertex == a {
        [b, c]
    } else if vertex == b {
        [c, a]
    } else {
        [a, b]
    }
}

#[cfg(test)]
mod tests;
