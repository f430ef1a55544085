//! Waters' sheet muscle: parallel fibres over a rectangle.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use super::elementary::{exp, sin_cos_of_right_angles};
use super::fibre::Place;
use super::parameter::{Parameter, Scale};
use super::wide::{Slopes, Spread, all};

/// Waters' sheet muscle. Thesis (3.6)–(3.9).
///
/// ```text
/// λ    = l / ‖m‖                                      l: signed distance in front of the attachment line
/// θ(λ) = cos(π/2 (1 − λⁿ))                            0 ≤ λ ≤ 1
///        cos(π/2 (λⁿ − 1) / (δⁿ − 1))                 1 < λ ≤ δ, else 0
/// f    = s θ(λ) m̂                                     where |side| ≤ W/2, else 0
/// ```
///
/// | here         | thesis | unit |
/// |--------------|--------|------|
/// | `n`          | n_j, greater than 0 | – |
/// | `delta`      | δ_j = L_j / ‖m‖, greater than 1 | – |
/// | `half_width` | W_j / 2 over the muscle's own half width | – |
/// | strength     | α_st   | N |
/// | [`Place::along`] | λ_ji | – |
///
/// The attachment line runs through the attachment at a right angle to the fibre. Largest at the insertion line, where it is 1; to the
/// side it ends sharply, so that no slope says how wide it is.
/// Differs from the thesis: there l has no sign, and W is listed but used nowhere (`docs/errata.md`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatersSheet {
    /// Exponent of the length ratio.
    pub n: f64,
    /// Length of the rectangle over the fibre's.
    pub delta: f64,
    /// Half width of the rectangle over the muscle's own.
    pub half_width: f64,
}

impl Default for WatersSheet {
    fn default() -> Self {
        Self { n: 1.0, delta: 1.5, half_width: 1.0 }
    }
}

const EXPONENT: Scale = Scale::positive("n", "Exponent of the length ratio", 0.1, 20.0);
const DELTA: Scale = Scale::above_one("delta", "Length over the fibre's", 6.0);
const HALF_WIDTH: Scale = Scale::positive("half_width", "Half width over the muscle's own", 0.1, 20.0).sharp();

impl WatersSheet {
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![EXPONENT.at(self.n), DELTA.at(self.delta), HALF_WIDTH.at(self.half_width)]
    }

    /// The law on any fibre.
    pub(crate) fn on(&self) -> Rectangle {
        let power = self.delta.powf(self.n);
        Rectangle {
            law: *self,
            log_delta: self.delta.ln(),
            per_span: 1.0 / (power - 1.0),
            power_by_n: power * self.delta.ln(),
            power_by_delta: self.n * power / self.delta,
        }
    }
}

/// [`WatersSheet`] with what it needs of δⁿ.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    law: WatersSheet,
    log_delta: f64,
    /// 1 / (δⁿ − 1).
    per_span: f64,
    power_by_n: f64,
    power_by_delta: f64,
}

impl Spread for Rectangle {
    /// ln λ, which is no number behind the attachment, and the distance to the side.
    #[inline(always)]
    fn coordinates(place: &Place) -> [f64; 2] {
        [place.along.ln(), place.lateral]
    }

    #[inline(always)]
    fn pulls(&self, [log_lambda, lateral]: [f64; 2]) -> bool {
        all([log_lambda > f64::NEG_INFINITY, log_lambda <= self.log_delta, lateral <= self.law.half_width])
    }

    /// θ(λ), and its slopes along `n`, `delta` and `half_width` (which has none).
    #[inline(always)]
    fn value(&self, [log_lambda, _]: [f64; 2]) -> (f64, Slopes) {
        let power = exp(self.law.n * log_lambda);
        let power_by_n = power * log_lambda;
        let beyond = log_lambda > 0.0;
        let u = if beyond { (power - 1.0) * self.per_span } else { 1.0 - power };
        let (sin, cos) = sin_cos_of_right_angles(u);
        let slope = sin * FRAC_PI_2;
        let outer = slope * self.per_span;
        let by_n = if beyond { outer * (u * self.power_by_n - power_by_n) } else { slope * power_by_n };
        let by_delta = if beyond { outer * u * self.power_by_delta } else { 0.0 };
        (cos, [by_n, by_delta, 0.0, 0.0, 0.0])
    }
}
