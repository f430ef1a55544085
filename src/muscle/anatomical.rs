//! The anatomical muscle: windows of two hyperbolic tangents along and across the fibre, and perhaps a second one at the bone.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use serde::{Deserialize, Serialize};

use super::elementary::exp;
use super::fibre::Place;
use super::parameter::{Parameter, Scale};
use super::wide::{Slopes, Spread, all};

/// Where the window along the fibre is cut off: (5.3) as printed switches the whole muscle off, and its text contradicts it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reading {
    /// A: points behind the attachment (ε ≤ −1) are not pulled. Fits "a patch that follows the insertion points".
    #[default]
    InFront,
    /// B: points beyond the insertion (ε > 0) are not pulled. Fits "abruptly drops to zero beyond the insertion".
    UpToInsertion,
}

impl Reading {
    /// Both.
    pub const ALL: [Self; 2] = [Self::InFront, Self::UpToInsertion];

    /// The letter by which reports name it.
    pub fn letter(self) -> char {
        match self {
            Self::InFront => 'A',
            Self::UpToInsertion => 'B',
        }
    }
}

/// A second window on the fibre, of the same widths, with a strength of its own (expected to be negative): a frontalis raises the
/// lower forehead and lowers the upper one. Not in the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lobe {
    /// Its centre is the attachment, ε = −1.
    AtAttachment,
    /// Its centre is a parameter: this many fibre lengths from the insertion towards the attachment, ε = −distance.
    At(f64),
}

/// The thesis's own law. Thesis (5.1), (5.3)–(5.7).
///
/// ```text
/// θ_r(ε) = ½ (tanh(sr (ε + wr/2)) − tanh(sr (ε − wr/2)))
/// θ_a(γ) = ½ (tanh(sa (γ + wa/2)) − tanh(sa (γ − wa/2)))
/// f      = s θ_r θ_a m̂
/// ```
///
/// | here | thesis | unit |
/// |------|--------|------|
/// | `sr`, `wr` | steepness and width along the fibre, of the fibre's length | – |
/// | `sa`, `wa` | the same across | – |
/// | [`Place::along`] − 1 | ε_ji of (5.6): −1 at the attachment, 0 at the insertion | – |
/// | [`Place::across`] | γ_ji of (5.7), with ω of (5.1) | – |
/// | strength s | α | N |
///
/// The window's peak is tanh(sr wr/2), so that strength and shape are confounded where it is narrow. By default each window is divided
/// by its peak. With A = 2 sr |ε| and B = sr wr both forms have one exponential a point:
///
/// ```text
/// θ/peak = (1 + cosh B) / (cosh A + cosh B) = e⁻ᴬ (1 + e⁻ᴮ)² / ((e⁻ᴬ + e⁻ᴮ)(1 + e⁻ᴬ e⁻ᴮ))
/// ∂ ln(θ/peak)/∂A = e⁻ᴬe⁻ᴮ/(1 + e⁻ᴬe⁻ᴮ) − e⁻ᴮ/(e⁻ᴬ + e⁻ᴮ)
/// ∂ ln(θ/peak)/∂B = e⁻ᴬe⁻ᴮ/(1 + e⁻ᴬe⁻ᴮ) + e⁻ᴮ/(e⁻ᴬ + e⁻ᴮ) − 2 e⁻ᴮ/(1 + e⁻ᴮ)
/// ```
///
/// (sinh 2b = 2 sinh b cosh b turns ½ (tanh(a+b) − tanh(a−b)) into ½ sinh 2b / (cosh(a+b) cosh(a−b)).)
/// Differs from the thesis: the condition of (5.3) is ε > −1 or ε ≤ 0 (see [`Reading`]) and not ε > 1; ε and γ are over the fibre's length,
/// not over the length of a unit vector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anatomical {
    /// Steepness along the fibre.
    pub sr: f64,
    /// Width along the fibre.
    pub wr: f64,
    /// Steepness across the fibre.
    pub sa: f64,
    /// Width across the fibre.
    pub wa: f64,
    /// Where the window is cut off.
    #[serde(default)]
    pub reading: Reading,
    /// Whether the windows are left as printed, with peaks below 1.
    #[serde(default)]
    pub raw: bool,
    /// A second window.
    #[serde(default)]
    pub lobe: Option<Lobe>,
}

impl Default for Anatomical {
    fn default() -> Self {
        Self { sr: 6.0, wr: 0.5, sa: 5.0, wa: 0.6, reading: Reading::InFront, raw: false, lobe: None }
    }
}

const SR: Scale = Scale::positive("sr", "Steepness along the fibre", 0.05, 500.0);
const WR: Scale = Scale::positive("wr", "Width along the fibre", 0.005, 6.0);
const SA: Scale = Scale::positive("sa", "Steepness across the fibre", 0.05, 500.0);
const WA: Scale = Scale::positive("wa", "Width across the fibre", 0.005, 6.0);
const LOBE: Scale = Scale::positive("lobe", "Second lobe's distance from the insertion", 0.2, 3.0);

impl Anatomical {
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let mut all = vec![SR.at(self.sr), WR.at(self.wr), SA.at(self.sa), WA.at(self.wa)];
        if let Some(Lobe::At(distance)) = self.lobe {
            all.push(LOBE.at(distance));
        }
        all
    }

    /// The law on any fibre.
    pub(crate) fn on(&self) -> Windows {
        let (centre, moves) = match self.lobe {
            None | Some(Lobe::AtAttachment) => (-1.0, 0.0),
            Some(Lobe::At(distance)) => (-distance, 1.0),
        };
        let [above, up_to] = match self.reading {
            Reading::InFront => [-1.0, f64::INFINITY],
            Reading::UpToInsertion => [f64::NEG_INFINITY, 0.0],
        };
        Windows {
            along: Window::new(self.sr, self.wr, self.raw),
            across: Window::new(self.sa, self.wa, self.raw),
            above,
            up_to,
            centre,
            moves,
        }
    }
}

/// [`Anatomical`] with what its windows need.
#[derive(Clone, Copy, Debug)]
pub struct Windows {
    along: Window,
    across: Window,
    /// The muscle itself pulls where `above` < ε ≤ `up_to`.
    above: f64,
    up_to: f64,
    /// Where the second lobe's centre is, and whether (1 or 0) that is a parameter.
    centre: f64,
    moves: f64,
}

impl Windows {
    /// The product of both windows, its slopes along sr, wr, sa, wa, and its slope along ε times `moves`.
    #[inline(always)]
    fn product(&self, epsilon: f64, gamma: f64, moves: f64) -> (f64, Slopes) {
        let (r, a) = (self.along.at(epsilon), self.across.at(gamma));
        let value = r.value * a.value;
        let by = [
            value * r.log_by_steepness,
            value * r.log_by_width,
            value * a.log_by_steepness,
            value * a.log_by_width,
            value * (moves * r.log_by_distance),
        ];
        (value, by)
    }
}

impl Spread for Windows {
    /// ε and γ.
    #[inline(always)]
    fn coordinates(place: &Place) -> [f64; 2] {
        [place.along - 1.0, place.across]
    }

    #[inline(always)]
    fn pulls(&self, [epsilon, gamma]: [f64; 2]) -> bool {
        all([epsilon > self.above, epsilon <= self.up_to, self.along.reaches(epsilon), self.across.reaches(gamma)])
    }

    /// θ_r θ_a, and its slopes along the parameters.
    #[inline(always)]
    fn value(&self, [epsilon, gamma]: [f64; 2]) -> (f64, Slopes) {
        self.product(epsilon, gamma, 0.0)
    }
}

/// The second lobe, which no reading of (5.3) cuts off.
#[derive(Clone, Copy, Debug)]
pub(super) struct SecondLobe(pub(super) Windows);

impl Spread for SecondLobe {
    #[inline(always)]
    fn coordinates(place: &Place) -> [f64; 2] {
        Windows::coordinates(place)
    }

    #[inline(always)]
    fn pulls(&self, [epsilon, gamma]: [f64; 2]) -> bool {
        all([self.0.along.reaches(epsilon - self.0.centre), self.0.across.reaches(gamma)])
    }

    #[inline(always)]
    fn value(&self, [epsilon, gamma]: [f64; 2]) -> (f64, Slopes) {
        // ε − centre grows with the distance of the centre from the insertion.
        self.0.product(epsilon - self.0.centre, gamma, self.0.moves)
    }
}

/// One window of two hyperbolic tangents.
#[derive(Clone, Copy, Debug)]
struct Window {
    steepness: f64,
    per_steepness: f64,
    b: f64,
    /// e⁻²ᴮ.
    e_2b: f64,
    /// (1 + e⁻ᴮ)², times the peak when raw.
    scale: f64,
    /// −2 e⁻ᴮ/(1 + e⁻ᴮ), plus ∂ ln peak/∂B when raw.
    log_by_b: f64,
}

/// A window's value and the slopes of its logarithm.
struct WindowValue {
    value: f64,
    log_by_steepness: f64,
    log_by_width: f64,
    log_by_distance: f64,
}

/// Where a window has fallen below e^−45 of its peak it is zero.
const TAIL: f64 = 45.0;

impl Window {
    fn new(steepness: f64, width: f64, raw: bool) -> Self {
        let b = steepness * width;
        let e_b = (-b).exp();
        // peak = tanh(B/2) = (1 − e⁻ᴮ)/(1 + e⁻ᴮ), ∂ ln peak/∂B = 2 e⁻ᴮ/(1 − e⁻²ᴮ)
        let less = -(-b).exp_m1();
        let (peak, log_peak_by_b) =
            if raw { (less / (1.0 + e_b), 2.0 * e_b / (less * (1.0 + e_b))) } else { (1.0, 0.0) };
        let scale = (1.0 + e_b) * (1.0 + e_b) * peak;
        Self {
            steepness,
            per_steepness: 1.0 / steepness,
            b,
            e_2b: e_b * e_b,
            scale,
            log_by_b: log_peak_by_b - 2.0 * e_b / (1.0 + e_b),
        }
    }

    /// Whether a distance lies before the window's tail.
    #[inline(always)]
    fn reaches(&self, distance: f64) -> bool {
        2.0 * self.steepness * distance.abs() - self.b <= TAIL
    }

    /// The window at a signed distance from its centre.
    #[inline(always)]
    fn at(&self, distance: f64) -> WindowValue {
        let a = 2.0 * self.steepness * distance.abs();
        // With ρ = e^(A − B), which is a number also where e⁻ᴬ and e⁻ᴮ are nothing:
        // e⁻ᴬ/(e⁻ᴬ + e⁻ᴮ) = 1/(1 + ρ) and 1/(1 + e⁻ᴬe⁻ᴮ) = ρ/(ρ + e⁻²ᴮ). One quotient: it is what takes the time.
        let ratio = exp(a - self.b);
        let (beside, below) = (1.0 + ratio, ratio + self.e_2b);
        let inverse = 1.0 / (beside * below);
        let (share, rest) = (below * inverse, ratio * beside * inverse);
        let (near, far) = (self.e_2b * beside * inverse, ratio * share);
        let (by_a, by_b) = (near - far, near + far + self.log_by_b);
        WindowValue {
            value: self.scale * share * rest,
            log_by_steepness: (a * by_a + self.b * by_b) * self.per_steepness,
            log_by_width: self.steepness * by_b,
            log_by_distance: 2.0 * self.steepness * by_a * if distance < 0.0 { -1.0 } else { 1.0 },
        }
    }
}
