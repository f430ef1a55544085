//! Waters' linear muscle: fibres from one point of the bone fan out over a sector of a disc.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use super::elementary::sin_cos_of_right_angles;
use super::fibre::{Fibre, Place};
use super::parameter::{Parameter, Scale};
use super::wide::{Slopes, Spread, all};

/// Where a point is pulled. The thesis leaves the direction of f_ji in (3.5) open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Along the fibre, as in (3.7), (3.19) and (5.5).
    #[default]
    Parallel,
    /// Towards the attachment, as in Waters (1987).
    Convergent,
}

/// Waters' linear muscle. Thesis (3.1)–(3.5).
///
/// ```text
/// cos β = m · (A − x) / (‖m‖ ‖A − x‖)
/// θ_a   = (cos β − cos φ) / (1 − cos φ)               where cos β ≥ cos φ, else 0
/// θ_r   = cos((1 − r) π/2)                            r ≤ 1
///         cos((r − 1) / (R − 1) · π/2)                1 < r ≤ R, else 0
/// f     = s θ_a θ_r d
/// ```
///
/// | here    | thesis | unit |
/// |---------|--------|------|
/// | `reach` | R = r_max / ‖m‖, greater than 1 | – |
/// | `zone`  | φ over the muscle's own [`Fibre::zone_half_angle`]; φ never exceeds π/2 | – |
/// | [`Place::reach`] | r = ‖A − x‖ / ‖m‖ | – |
///
/// Largest at the insertion, where it is 1. Continuous, with kinks at β = φ and r = R.
/// Differs from the thesis: (3.2) as printed multiplies by ‖A − x‖; θ_a = 0 at the attachment itself, where β is 0/0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatersLinear {
    /// r_max over the fibre's length.
    pub reach: f64,
    /// The zone's half angle over the muscle's own.
    pub zone: f64,
    /// Where points are pulled.
    #[serde(default)]
    pub direction: Direction,
}

impl Default for WatersLinear {
    /// Waters' own muscles reach 1.2 to 2.6 fibre lengths.
    fn default() -> Self {
        Self { reach: 1.6, zone: 1.0, direction: Direction::Parallel }
    }
}

const REACH: Scale = Scale::above_one("reach", "Reach over the fibre's length", 6.0);
const ZONE: Scale = Scale::positive("zone", "Half angle over the muscle's own", 0.1, 10.0);

impl WatersLinear {
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![REACH.at(self.reach), ZONE.at(self.zone)]
    }

    /// The law on one fibre.
    pub(crate) fn on(&self, fibre: &Fibre) -> Sector {
        let wide = self.zone * fibre.zone_half_angle;
        let phi = wide.min(FRAC_PI_2);
        // d cos φ / d zone; none where φ is held at a right angle.
        let slope = if wide < FRAC_PI_2 { -phi.sin() * fibre.zone_half_angle } else { 0.0 };
        Sector { reach: self.reach, cos_phi: phi.cos(), cos_phi_by_zone: slope }
    }
}

/// [`WatersLinear`] on one fibre.
#[derive(Clone, Copy, Debug)]
pub struct Sector {
    reach: f64,
    cos_phi: f64,
    cos_phi_by_zone: f64,
}

impl Spread for Sector {
    /// cos β and r.
    #[inline(always)]
    fn coordinates(place: &Place) -> [f64; 2] {
        [place.cos_angle, place.reach]
    }

    #[inline(always)]
    fn pulls(&self, [cos_angle, r]: [f64; 2]) -> bool {
        all([cos_angle >= self.cos_phi, r <= self.reach])
    }

    /// θ_a θ_r, and its slopes along `reach` and `zone`.
    #[inline(always)]
    fn value(&self, [cos_angle, r]: [f64; 2]) -> (f64, Slopes) {
        let per_zone = 1.0 / (1.0 - self.cos_phi);
        let angular = (cos_angle - self.cos_phi) * per_zone;
        // ∂θ_a/∂cos φ = (cos β − 1) / (1 − cos φ)²
        let angular_by_zone = (cos_angle - 1.0) * (per_zone * per_zone) * self.cos_phi_by_zone;
        // Beyond the insertion u = (r − 1)/(R − 1), ∂u/∂R = −u/(R − 1).
        let per_reach = 1.0 / (self.reach - 1.0);
        let beyond = r > 1.0;
        let u = if beyond { (r - 1.0) * per_reach } else { 1.0 - r };
        let (sin, radial) = sin_cos_of_right_angles(u);
        let radial_by_reach = if beyond { sin * FRAC_PI_2 * u * per_reach } else { 0.0 };
        (angular * radial, [angular * radial_by_reach, angular_by_zone * radial, 0.0, 0.0, 0.0])
    }
}
