//! Koch's muscle: sines along the fibre, a cosine bell across it.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::f64::consts::{FRAC_PI_2, LN_2, PI};

use serde::{Deserialize, Serialize};

use super::elementary::{exp, sin_cos_of_right_angles};
use super::fibre::Place;
use super::parameter::{Parameter, Scale};
use super::wide::{Slopes, Spread, all};

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

    /// The law on any fibre.
    pub(crate) fn on(&self) -> Bell {
        Bell { k: self.k, log_width: self.width.ln(), per_width: 1.0 / self.width }
    }
}

/// [`Koch`] with what it needs of its width.
#[derive(Clone, Copy, Debug)]
pub struct Bell {
    k: f64,
    log_width: f64,
    per_width: f64,
}

impl Spread for Bell {
    /// ln ε, which is no number behind the attachment, and ln ω.
    #[inline(always)]
    fn coordinates(place: &Place) -> [f64; 2] {
        [place.along.ln(), place.lateral.ln()]
    }

    #[inline(always)]
    fn pulls(&self, [log_along, log_lateral]: [f64; 2]) -> bool {
        all([log_along > f64::NEG_INFINITY, log_along * self.k < LN_2, log_lateral < self.log_width])
    }

    /// θ_r θ_a, and its slopes along `k` and `width`.
    #[inline(always)]
    fn value(&self, [log_along, log_lateral]: [f64; 2]) -> (f64, Slopes) {
        let q = exp(self.k * log_along);
        let log_gamma = log_lateral - self.log_width;
        let (sin_half, cos_half) = sin_cos_of_right_angles(q);
        // sin(2πq − π/2) = −cos(2πq), and the angle 2πq is four times π/2 q.
        let cos_pi = 1.0 - 2.0 * sin_half * sin_half;
        let sin_pi = 2.0 * sin_half * cos_half;
        let radial = sin_half + 0.25 * sin_pi * sin_pi;
        let radial_by_q = FRAC_PI_2 * cos_half + 0.5 * PI * sin_pi * cos_pi;
        let bell = exp(BELL * log_gamma);
        let (sin, cos) = sin_cos_of_right_angles(2.0 * bell);
        let lateral = 0.5 * (cos + 1.0);
        // ∂γ^1.8/∂width = −1.8 γ^1.8 / width
        let by_k = radial_by_q * q * log_along * lateral;
        let by_width = radial * 0.5 * PI * sin * BELL * bell * self.per_width;
        (radial * lateral, [by_k, by_width, 0.0, 0.0, 0.0])
    }
}
