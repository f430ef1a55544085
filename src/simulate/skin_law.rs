//! What one edge of the skin answers to being stretched: the table of stress and strain, or the thesis's power law.

use crate::skin::StressStrainCurve;

/// How an edge resists.
#[derive(Clone, Debug, PartialEq)]
pub enum SkinLaw {
    /// A strip of skin under the stress–strain table, as the forces are measured with. Thesis (5.2).
    Table(StressStrainCurve),
    /// Thesis (4.9).
    Power(PowerLaw),
}

impl Default for SkinLaw {
    fn default() -> Self {
        Self::Table(StressStrainCurve::default())
    }
}

/// The same spring on every edge, which stiffens both ways. Thesis (4.9).
///
/// f = k₀ (1 + e²)^γ (L − d),   e = (L − d) / l_ref
///
/// | here | thesis | unit |
/// |---|---|---|
/// | `stiffness_n_per_mm` | k₀ | N/mm |
/// | `exponent` | γ | – |
/// | `reference_mm` | – | mm |
///
/// Differs from the thesis: (4.9) adds a squared length to 1, which gives another law in every unit; `reference_mm` says in which
/// length it is counted (`docs/errata.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// k₀.
    pub stiffness_n_per_mm: f64,
    /// γ.
    pub exponent: f64,
    /// l_ref.
    pub reference_mm: f64,
}

impl Default for PowerLaw {
    /// The toe of the default table on a mesh of equilateral triangles (E h √3/2 · 2/3 = 33 kPa · 1.5 mm · 0.577 = 0.029 N/mm), and
    /// a stiffening by half at an elongation of 10 % of the mean edge. The thesis prints neither number.
    fn default() -> Self {
        Self { stiffness_n_per_mm: 0.029, exponent: 0.6, reference_mm: 1.0 }
    }
}

/// (1 + e²)^p and what its integral and slope need: the energy [(1+e²)^(p+1) − 1] / (2 (p+1)), the force e (1+e²)^p and its slope
/// (1+e²)^(p−1) (1 + (1+2p) e²), for a spring of unit stiffness and unit length.
pub(super) fn power(e: f64, p: f64) -> [f64; 3] {
    let q = 1.0 + e * e;
    let raised = q.powf(p);
    [(q * raised - 1.0) / (2.0 * (p + 1.0)), e * raised, raised / q * (1.0 + (1.0 + 2.0 * p) * e * e)]
}

/// One edge as a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spring {
    pub(super) ends: [u32; 2],
    pub(super) rest_mm: f64,
    /// Width of its strip times the thickness and its factor, in N per kPa; 0 for an edge of no length.
    pub(super) newton_per_kpa: f64,
    /// Factor on its stiffness.
    pub(super) factor: f64,
    /// Tension that it has at rest, N.
    pub(super) pre_n: f64,
}

impl SkinLaw {
    /// Energy (mJ), tension (N) and its slope (N/mm) of a spring at a length, all times `scale`. The tension that it has at rest
    /// is part of it: k (L − l) + T₀.
    #[inline]
    pub(super) fn at(&self, spring: &Spring, length_mm: f64, scale: f64) -> [f64; 3] {
        let longer = length_mm - spring.rest_mm;
        match self {
            Self::Table(curve) => {
                if spring.newton_per_kpa == 0.0 {
                    return [0.0; 3];
                }
                let [energy, stress, slope] = curve.energy_stress_slope_kpa(longer / spring.rest_mm);
                let k = scale * spring.newton_per_kpa;
                let pre = scale * spring.pre_n;
                [k * energy * spring.rest_mm + pre * longer, k * stress + pre, k * slope / spring.rest_mm]
            }
            Self::Power(law) => {
                let l = law.reference_mm;
                let [energy, force, slope] = power(longer / l, law.exponent);
                let k = scale * spring.factor * law.stiffness_n_per_mm;
                [k * l * l * energy, k * l * force, k * slope]
            }
        }
    }

    /// Stiffness of a spring at rest, N/mm.
    pub(super) fn toe(&self, spring: &Spring, scale: f64) -> f64 {
        self.at(spring, spring.rest_mm, scale)[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spring() -> Spring {
        Spring { ends: [0, 1], rest_mm: 8.0, newton_per_kpa: 0.01, factor: 1.0, pre_n: 0.0 }
    }

    /// `ERRATA.md` E13: an 8 mm edge stretched by 10 %, γ = 2, counted in mm: (1 + 0.8²)² = 2.69 times the linear force; counted in
    /// cm: (1 + 0.08²)² = 1.013 times.
    #[test]
    fn the_power_law_depends_on_the_length_it_is_counted_in() {
        for (reference_mm, factor) in [(1.0, 2.6896), (10.0, 1.012_841)] {
            let law = SkinLaw::Power(PowerLaw { stiffness_n_per_mm: 0.05, exponent: 2.0, reference_mm });
            let [_, tension, _] = law.at(&spring(), 8.8, 1.0);
            assert!((tension - 0.05 * 0.8 * factor).abs() < 1e-7, "{tension}");
        }
    }

    /// 10 % of elongation in the default table: 3.62 kPa · 0.01 N/kPa; the energy is half of that over 0.8 mm.
    #[test]
    fn the_table_by_hand() {
        let [energy, tension, slope] = SkinLaw::default().at(&spring(), 8.8, 1.0);
        assert!((tension - 0.0362).abs() < 1e-12 && (energy - 0.5 * 0.0362 * 0.8).abs() < 1e-12);
        // From there on the next segment: (10.9 − 3.62) / 0.1 = 72.8 kPa; 72.8 · 0.01 / 8.
        assert!((slope - 0.091).abs() < 1e-12);
    }

    #[test]
    fn tension_is_the_slope_of_the_energy_and_stiffness_that_of_the_tension() {
        for law in [SkinLaw::default(), SkinLaw::Power(PowerLaw::default())] {
            for length in [5.1, 7.3, 7.9, 8.3, 10.1] {
                let h = 1e-5;
                let (up, down) = (law.at(&spring(), length + h, 2.0), law.at(&spring(), length - h, 2.0));
                let [_, tension, slope] = law.at(&spring(), length, 2.0);
                assert!(((up[0] - down[0]) / (2.0 * h) - tension).abs() < 1e-7);
                assert!(((up[1] - down[1]) / (2.0 * h) - slope).abs() < 1e-7);
            }
        }
    }
}
