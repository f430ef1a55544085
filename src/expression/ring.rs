//! Muscles that are no straight fibres: the sphincters round eyes and mouth, and the lifter of the upper lid.

use nalgebra::{Point3, Vector2, Vector3};

use super::places::nearest_seen;
use crate::simulate::region::{self, Cutoff};
use crate::simulate::{Region, Skin, muscle_force};

/// A sphincter: fibres on ellipses about a centre, seen from the front.
///
/// A taut ring pulls the skin under it along its inner normal, in the skin. With ρ the size of the ellipse through a place over that of
/// the sphincter, the pull rises with ρ² from the centre to the ring and falls to nothing at ρ = 1 + `beyond`:
///
/// ```text
/// ρ² = (x/a)² + (y/b)²,   w = ρ² for ρ ≤ 1,   1 − 3 t² + 2 t³ with t = (ρ − 1)/beyond outside,   d = −∇ρ/‖∇ρ‖
/// ```
///
/// Source: Waters 1987 for the ellipse; his pull is largest at the centre, which has no skin in an eye or a mouth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Its centre (x, y), mm.
    pub centre: [f64; 2],
    /// Semi-axes a and b, mm.
    pub semi_axes: [f64; 2],
    /// Where it ends, in sizes of the ring beyond it.
    pub beyond: f64,
    /// Share of the pull that the upper half has, at its top; between by the sine.
    pub above: f64,
}

impl Ring {
    /// Pull on a place: a direction as long as the weight w, before it is turned into the skin.
    pub fn pull(&self, p: &Point3<f64>) -> Vector3<f64> {
        let d = Vector2::new(p.x - self.centre[0], p.y - self.centre[1]);
        let [a, b] = self.semi_axes;
        let rho = (d.x / a).hypot(d.y / b);
        let weight = if rho <= 1.0 {
            rho * rho
        } else {
            let t = (rho - 1.0) / self.beyond;
            if t < 1.0 { 1.0 - t * t * (3.0 - 2.0 * t) } else { 0.0 }
        };
        let up = (d.y / b / rho.max(1e-9)).max(0.0);
        let share = 1.0 - (1.0 - self.above) * up;
        let inwards = Vector2::new(-d.x / (a * a), -d.y / (b * b));
        let inwards = inwards.try_normalize(0.0).unwrap_or_else(Vector2::zeros) * (weight * share);
        Vector3::new(inwards.x, inwards.y, 0.0)
    }

    /// Vertices near the ring at eight places: where the walk over it begins.
    fn seeds(&self, skin: Skin<'_>) -> Vec<u32> {
        let at = |k: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            [self.centre[0] + self.semi_axes[0] * cos, self.centre[1] + self.semi_axes[1] * sin]
        };
        (0..8).filter_map(|k| nearest_seen(at(k), skin.positions, skin.normals)).collect()
    }

    /// The loads of a sphincter whose strongest pull is 1 N.
    pub fn loads(&self, skin: Skin<'_>) -> Region {
        in_skin(skin, &self.seeds(skin), |p| self.pull(p))
    }
}

/// The lifter of an upper lid: it pulls the lid's margin up, most above the pupil. The pull falls off as a bell from the arc from one
/// corner of the eye over the top of its opening to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lid {
    /// The corner at the nose, mm.
    pub inner: Point3<f64>,
    /// The top of the opening, mm.
    pub top: Point3<f64>,
    /// The corner at the temple, mm.
    pub outer: Point3<f64>,
    /// Standard deviation of the bell across the lid, mm.
    pub width_mm: f64,
}

impl Lid {
    /// Pull on a place.
    pub fn pull(&self, p: &Point3<f64>) -> Vector3<f64> {
        let (a, b) = (self.inner.x.min(self.outer.x), self.inner.x.max(self.outer.x));
        let t = (p.x - a) / (b - a);
        if !(0.0..=1.0).contains(&t) {
            return Vector3::zeros();
        }
        // The arc is a parabola between the corners, as high as the top.
        let [left, right] =
            if self.inner.x < self.outer.x { [self.inner, self.outer] } else { [self.outer, self.inner] };
        let s = (self.top.x - a) / (b - a);
        let base = |t: f64| left.y + (right.y - left.y) * t;
        let arch = 4.0 * t * (1.0 - t) / (4.0 * s * (1.0 - s)).max(0.1);
        let off = p.y - (base(t) + (self.top.y - base(s)) * arch);
        let bell = (-0.5 * (off / self.width_mm).powi(2)).exp();
        // The lower lid lies across the opening.
        let below = p.y < base(t) + 0.3 * (self.top.y - base(s)) * arch;
        if below { Vector3::zeros() } else { Vector3::y() * (4.0 * t * (1.0 - t) * bell) }
    }

    /// The loads of a lid whose strongest pull is 1 N.
    pub fn loads(&self, skin: Skin<'_>) -> Region {
        let seed = nearest_seen([self.top.x, self.top.y], skin.positions, skin.normals);
        in_skin(skin, seed.as_slice(), |p| self.pull(p))
    }
}

fn in_skin(skin: Skin<'_>, seeds: &[u32], pull: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Region {
    region::walk(skin.mesh, seeds, Cutoff::default().newton(1.0), |v| {
        let normal = &skin.normals[v as usize];
        // What faces away from the camera only seems to lie on the ring.
        if normal.z <= 0.0 {
            Vector3::zeros()
        } else {
            muscle_force::tangent(pull(&skin.positions[v as usize]), normal)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RING: Ring = Ring { centre: [10.0, 0.0], semi_axes: [4.0, 2.0], beyond: 0.5, above: 0.5 };

    #[test]
    fn a_ring_pulls_along_its_inner_normal_most_on_the_ring_by_hand() {
        // On the axes the inner normal points at the centre; at half the size the pull is a quarter.
        assert!((RING.pull(&Point3::new(14.0, 0.0, 3.0)) + Vector3::x()).norm() < 1e-12);
        assert!((RING.pull(&Point3::new(8.0, 0.0, 3.0)) - Vector3::x() * 0.25).norm() < 1e-12);
        assert!((RING.pull(&Point3::new(10.0, -2.0, 0.0)) - Vector3::y()).norm() < 1e-12);
        // The top has half of it; halfway beyond, half again: 1 − 3/4 + 2/8.
        assert!((RING.pull(&Point3::new(10.0, 2.0, 0.0)) + Vector3::y() * 0.5).norm() < 1e-12);
        assert!((RING.pull(&Point3::new(15.0, 0.0, 0.0)) + Vector3::x() * 0.5).norm() < 1e-12);
        assert_eq!(RING.pull(&Point3::new(16.1, 0.0, 0.0)), Vector3::zeros());
        assert_eq!(RING.pull(&Point3::new(10.0, 0.0, 0.0)), Vector3::zeros());
        // At 45° of the ellipse below: (4, 2)/√2; the inner normal is (−x/16, y/4) ∝ (−1, 2).
        let half = 0.5_f64.sqrt();
        let pull = RING.pull(&Point3::new(10.0 + 4.0 * half, -2.0 * half, 0.0));
        assert!((pull - Vector3::new(-1.0, 2.0, 0.0).normalize()).norm() < 1e-12);
    }

    #[test]
    fn a_lid_is_pulled_up_most_at_its_top_and_nothing_below_the_opening() {
        let lid = Lid {
            inner: Point3::new(18.0, 0.0, 0.0),
            top: Point3::new(31.0, 6.0, 5.0),
            outer: Point3::new(44.0, 0.0, 0.0),
            width_mm: 2.0,
        };
        assert!((lid.pull(&Point3::new(31.0, 6.0, 5.0)) - Vector3::y()).norm() < 1e-12);
        // One standard deviation above the top, and at a quarter of the width, where the arc is 4 · ¼ · ¾ = ¾ as high.
        assert!((lid.pull(&Point3::new(31.0, 8.0, 5.0)).y - (-0.5_f64).exp()).abs() < 1e-12);
        assert!((lid.pull(&Point3::new(24.5, 4.5, 5.0)).y - 0.75).abs() < 1e-12);
        assert_eq!(lid.pull(&Point3::new(31.0, -5.0, 5.0)), Vector3::zeros());
        assert_eq!(lid.pull(&Point3::new(17.0, 3.0, 5.0)), Vector3::zeros());
    }
}
