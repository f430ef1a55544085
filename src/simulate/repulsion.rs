//! Edge repulsion: a corner of a triangle that comes near its opposite edge, or crosses it, is pushed back.

use nalgebra::{Point3, Vector3};

use super::skin_law::power;

/// How corners are kept from their opposite edges. Thesis (4.10).
///
/// r = k d₀ e (1 + e²)^ζ,   e = (d₀ − s) / d₀ > 0,   d₀ = `from` · d
///
/// | here | thesis | unit |
/// |---|---|---|
/// | s | ‖x_i − p_k‖, with the sign of the side on which the corner lies at rest | mm |
/// | d | d_ik, the height at rest | mm |
/// | k | k₀ = `strength` times the mean stiffness of the triangle's springs at rest | N/mm |
/// | `exponent` | ζ | – |
///
/// Differs from the thesis (`docs/errata.md`): only below d₀ (it also *attracts* as printed), signed (as printed it pushes a corner
/// that has crossed further out), with the reaction on the ends of the edge, so that momentum is kept; from e = 2 on it grows no
/// faster than there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repulsion {
    /// k₀ in units of the skin's own stiffness.
    pub strength: f64,
    /// ζ.
    pub exponent: f64,
    /// Share of its height at rest below which a corner is pushed: 1 as in the thesis.
    pub from: f64,
}

impl Default for Repulsion {
    /// Skin over the forehead shortens by up to 36 % (FACTS 3.5), so nothing is pushed before a corner has lost 40 % of its height.
    fn default() -> Self {
        Self { strength: 1.0, exponent: 2.0, from: 0.6 }
    }
}

/// From here on the force grows linearly: a corner deep on the wrong side is not thrown across the face.
const DEEPEST: f64 = 2.0;

impl Repulsion {
    /// Energy, force and slope for unit stiffness and unit d₀ at the depth e > 0.
    fn at(&self, e: f64) -> [f64; 3] {
        let deepest = e.min(DEEPEST);
        let [energy, force, slope] = power(deepest, self.exponent);
        let over = e - deepest;
        [energy + over * (force + 0.5 * slope * over), force + slope * over, slope]
    }
}

/// A triangle whose three corners are kept from their opposite edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wedge {
    pub(super) corners: [u32; 3],
    /// Outward normal at rest, a unit vector.
    pub(super) normal: Vector3<f64>,
    /// d₀ of each corner, mm.
    pub(super) from_mm: [f64; 3],
    /// k of the triangle, N/mm.
    pub(super) stiffness: f64,
}

/// One corner that is being pushed.
pub(super) struct Push {
    pub(super) energy: f64,
    /// r, N: along −∇ of the height.
    pub(super) force: f64,
    /// −dr/ds, N/mm.
    pub(super) slope: f64,
    /// ∇s at the three corners of the triangle, in its order.
    pub(super) gradient: [Vector3<f64>; 3],
    /// Which corner is pushed, 0 to 2.
    pub(super) tip: usize,
    /// s, mm.
    pub(super) height: f64,
}

impl Wedge {
    /// Twice the area, negative once the triangle has turned over; `normal` is the one at rest, moved with the bone.
    pub(super) fn doubled_area(x: [Point3<f64>; 3], normal: &Vector3<f64>) -> f64 {
        normal.dot(&(x[1] - x[0]).cross(&(x[2] - x[0])))
    }

    /// The corners that are pushed.
    ///
    /// s = D / ‖x_b − x_a‖ with D = n·((x_b − x_a) × (x − x_a)), the same for all three corners.
    #[inline]
    pub(super) fn pushes(
        &self,
        law: &Repulsion,
        x: [Point3<f64>; 3],
        normal: &Vector3<f64>,
        mut visit: impl FnMut(Push),
    ) {
        let doubled = Self::doubled_area(x, normal);
        for tip in 0..3 {
            let (a, b) = ((tip + 1) % 3, (tip + 2) % 3);
            let edge = x[b] - x[a];
            let from = self.from_mm[tip];
            let squared = edge.norm_squared();
            // s < d₀, without the root; an edge of no length has no height.
            if (doubled > 0.0 && doubled * doubled >= from * from * squared) || squared < 1e-18 || from <= 0.0 {
                continue;
            }
            let length = squared.sqrt();
            let height = doubled / length;
            let [energy, force, slope] = law.at((from - height) / from);
            let along = edge / length;
            let at_tip = normal.cross(&along);
            let at_b = (x[tip] - x[a]).cross(normal) / length - along * (height / length);
            let mut gradient = [Vector3::zeros(); 3];
            gradient[tip] = at_tip;
            gradient[b] = at_b;
            gradient[a] = -(at_tip + at_b);
            visit(Push {
                energy: self.stiffness * from * from * energy,
                force: self.stiffness * from * force,
                slope: self.stiffness * slope,
                gradient,
                tip,
                height,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wedge() -> Wedge {
        Wedge { corners: [0, 1, 2], normal: Vector3::z(), from_mm: [1.0, 0.0, 0.0], stiffness: 1.0 }
    }

    fn pushed(height: f64) -> Option<Push> {
        let x = [Point3::new(0.4, height, 0.0), Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0)];
        let mut found = None;
        wedge().pushes(&Repulsion { strength: 1.0, exponent: 1.0, from: 1.0 }, x, &Vector3::z(), |p| found = Some(p));
        found
    }

    /// `ERRATA.md` E14: at a height of 1.3 of 1 the printed force attracts (here: nothing), at −0.1 it pushes the wrong way. With
    /// k₀ = 1, ζ = 1 and e = 1.1 the size is 1.1 · (1 + 1.21) = 2.431, towards the side at rest.
    #[test]
    fn one_sided_and_signed_by_hand() {
        assert!(pushed(1.3).is_none());
        let push = pushed(-0.1).unwrap();
        assert!((push.force - 2.431).abs() < 1e-12);
        assert!((push.gradient[0] - Vector3::y()).norm() < 1e-12);
        // The foot lies at 0.4 of the edge: 0.6 of the reaction on the near end, 0.4 on the far one.
        assert!((push.gradient[1] + Vector3::y() * 0.6).norm() < 1e-12);
        let sum: Vector3<f64> = push.gradient.iter().sum();
        assert!(sum.norm() < 1e-15, "momentum is kept");
    }

    #[test]
    fn the_force_is_the_slope_of_the_energy_for_every_corner_and_depth() {
        let law = Repulsion { strength: 1.0, exponent: 2.0, from: 0.6 };
        let wedge = Wedge { corners: [0, 1, 2], normal: Vector3::z(), from_mm: [0.6, 0.5, 0.7], stiffness: 0.3 };
        for height in [0.5, 0.1, -0.4, -2.0] {
            let x = [Point3::new(0.3, height, 0.1), Point3::new(0.0, 0.1, 0.0), Point3::new(1.1, 0.0, -0.2)];
            let energy = |x: [Point3<f64>; 3]| {
                let mut sum = 0.0;
                wedge.pushes(&law, x, &Vector3::z(), |p| sum += p.energy);
                sum
            };
            let mut force = [Vector3::zeros(); 3];
            wedge.pushes(&law, x, &Vector3::z(), |p| {
                for (f, g) in force.iter_mut().zip(p.gradient) {
                    *f += g * p.force;
                }
            });
            for corner in 0..3 {
                for axis in 0..3 {
                    let h = 1e-6;
                    let (mut up, mut down) = (x, x);
                    up[corner][axis] += h;
                    down[corner][axis] -= h;
                    let slope = (energy(up) - energy(down)) / (2.0 * h);
                    assert!((slope + force[corner][axis]).abs() < 1e-6, "{height} {corner} {axis}");
                }
            }
        }
    }
}
