//! Koch's muscle: sines along the fibre, a cosine bell across it.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use super::fibre::Place;
use super::parameter::{Parameter, Scale};

/// Koch, Gross and Bosshard's muscle (1998). Thesis (3.10)–(3.20).
///
/// ```text
/// q     = ε^K                                         ε of (3.15): 0 at the attachment, 1 at the insertion
/// θ_r   = sin(π/2 q) + 1/8 (sin(2π q − π/2) + 1)      0 < q < 2, else 0
/// θ_a   = 1/2 (cos(π γ^1.8) + 1)                      γ = ω/ω_j ≤ 1, else 0
/// f     = s θ_r θ_a m̂
/// ```
///
/// | here    | thesis | unit |
/// |---------|--------|------|
/// | `k`     | K_j    | – |
/// | `width` | ω_j over the muscle's own half width | – |
/// | [`Place::along`] | ε_ji | – |
/// | [`Place::lateral`] | ω_ji over the muscle's own half width | – |
///
/// It is 1 at the insertion and largest, 1.055, a little to either side (q = 0.69 and 1.31). A kink where q = 2.
/// Differs from the thesis: (3.17) is cut off behind the attachment, where ε^K is no number, and at q = 2, beyond which it would push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Koch {
    /// Nonlinearity along the fibre.
    pub k: f64,
    /// Largest lateral distance over the muscle's own half width.
    pub width: f64,
}

impl Default for Koch {
    fn default() -> Self {
        Self { k: 1.0, width: 2.0 }
    }
}

const K: Scale = Scale::positive("k", "Nonlinearity along the fibre", 0.1, 20.0);
const WIDTH: Scale = Scale::positive("width", "Largest lateral distance over the muscle's half width", 0.1, 20.0);

/// Exponent of (3.18).
const BELL: f64 = 1.8;

impl Koch {
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![K.at(self.k), WIDTH.at(self.width)]
    }

    /// θ_r θ_a at a place, and its slopes along `k` and `width`.
    pub(crate) fn at(&self, place: &Place, by: &mut [f64]) -> f64 {
        by[..2].fill(0.0);
        let (t, gamma) = (place.along, place.lateral / self.width);
        if t <= 0.0 || gamma >= 1.0 {
            return 0.0;
        }
        let q = t.powf(self.k);
        if q >= 2.0 {
            return 0.0;
        }
        let (sin_half, cos_half) = (FRAC_PI_2 * q).sin_cos();
        // sin(2πq − π/2) = −cos(2πq), and the angle 2πq is four times π/2 q.
        let cos_pi = 1.0 - 2.0 * sin_half * sin_half;
        let sin_pi = 2.0 * sin_half * cos_half;
        let radial = sin_half + 0.25 * sin_pi * sin_pi;
        let radial_by_q = FRAC_PI_2 * cos_half + 0.5 * PI * sin_pi * cos_pi;
        let bell = gamma.powf(BELL);
        let (sin, cos) = (PI * bell).sin_cos();
        let lateral = 0.5 * (cos + 1.0);
        by[0] = radial_by_q * q * t.ln() * lateral;
        // ∂γ^1.8/∂width = −1.8 γ^1.8 / width
        by[1] = radial * 0.5 * PI * sin * BELL * bell / self.width;
        radial * lateral
    }
}
