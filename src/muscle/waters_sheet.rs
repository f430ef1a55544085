//! Waters' sheet muscle: parallel fibres over a rectangle.

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use super::fibre::Place;
use super::parameter::{Parameter, Scale};

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
            span: power - 1.0,
            power_by_n: power * self.delta.ln(),
            power_by_delta: self.n * power / self.delta,
        }
    }
}

/// [`WatersSheet`] with what it needs of δⁿ.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    law: WatersSheet,
    span: f64,
    power_by_n: f64,
    power_by_delta: f64,
}

impl Rectangle {
    /// θ(λ) at a place, and its slopes along `n`, `delta` and `half_width` (which has none).
    pub(crate) fn at(&self, place: &Place, by: &mut [f64]) -> f64 {
        by[..3].fill(0.0);
        let lambda = place.along;
        if lambda <= 0.0 || lambda > self.law.delta || place.lateral > self.law.half_width {
            return 0.0;
        }
        let power = lambda.powf(self.law.n);
        let power_by_n = power * lambda.ln();
        if lambda <= 1.0 {
            let (sin, cos) = (FRAC_PI_2 * (1.0 - power)).sin_cos();
            by[0] = sin * FRAC_PI_2 * power_by_n;
            return cos;
        }
        let u = (power - 1.0) / self.span;
        let (sin, cos) = (FRAC_PI_2 * u).sin_cos();
        let slope = -sin * FRAC_PI_2 / self.span;
        by[0] = slope * (power_by_n - u * self.power_by_n);
        by[1] = -slope * u * self.power_by_delta;
        cos
    }
}
