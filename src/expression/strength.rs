//! How strong the muscles of a face are, in newton, and how that is known; and the muscles that expressions need beside those of a face model.

/// How a strength is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// Pulled against a gauge by people.
    Measured,
    /// Area of the muscle's cross-section times 100 kPa.
    CrossSection,
    /// Nobody has measured it; taken to be like its neighbours.
    Assumed,
}

impl Evidence {
    /// For people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::CrossSection => "cross-section × 100 kPa",
            Self::Assumed => "assumed",
        }
    }
}

/// The strength of all muscles of one side that make the same action units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// FACS action units that they make.
    pub action_units: &'static [u8],
    /// Sum of the lengths of the forces on the skin of one side, N.
    pub newton: f64,
    /// How it is known.
    pub evidence: Evidence,
    /// Where from.
    pub source: &'static str,
}

const fn strength(action_units: &'static [u8], newton: f64, evidence: Evidence, source: &'static str) -> Strength {
    Strength { action_units, newton, evidence, source }
}

const NEELY: &str = "Neely & Pomerantz 2002, Laryngoscope 112:1562";
const LIDS: &str =
    "closing an eye pulls 2.4 to 3.9 N in all: Neely & Pomerantz 2002; how 3.6 N are shared by rim and lids is assumed";
const LIKE: &str = "as the cross-section of the zygomaticus major";

/// Strengths at full activation, of one side; of an orbicularis oris, which has no side, of the whole. `docs/expressions.md` shows it.
pub const STRENGTHS: [Strength; 13] = [
    strength(&[1, 2], 3.4, Evidence::Measured, NEELY),
    strength(&[4], 2.0, Evidence::CrossSection, "12.6 mm × 1.6 mm: Yang & Kim 2013"),
    strength(
        &[5],
        0.39,
        Evidence::Measured,
        "upper lid with the brow held, 42 people: Ofir, Belkin & Nemet, A novel technique for measuring eyelid force",
    ),
    strength(&[6], 2.4, Evidence::Assumed, LIDS),
    strength(&[7], 1.2, Evidence::Assumed, LIDS),
    strength(&[9], 1.7, Evidence::Assumed, LIKE),
    strength(&[10, 11, 13], 1.7, Evidence::Assumed, LIKE),
    strength(
        &[12],
        2.7,
        Evidence::Measured,
        "a smile pulls 1.4 to 3.3 N: Neely & Pomerantz 2002; the cross-section of 51 cadavers, 8.5 mm × 2 mm, gives 1.7 N",
    ),
    strength(&[15], 1.7, Evidence::Assumed, LIKE),
    strength(&[16], 1.7, Evidence::Assumed, LIKE),
    strength(&[17], 1.7, Evidence::Assumed, LIKE),
    strength(&[20], 1.7, Evidence::Assumed, LIKE),
    strength(&[22, 23, 24], 3.4, Evidence::Measured, "puckered lips pull 1.7 N a side: Neely & Pomerantz 2002"),
];

/// What a muscle of any other action unit is taken for.
pub const OTHER: Strength = strength(&[], 1.0, Evidence::Assumed, "no row of the table names its action unit");

/// The row for an action unit.
pub fn of_action_unit(unit: u8) -> Strength {
    STRENGTHS.iter().find(|s| s.action_units.contains(&unit)).copied().unwrap_or(OTHER)
}

/// A pair of muscles that expressions need and the face model may lack: places on the left half of the generic face, mm.
pub(super) struct Extra {
    pub(super) id: &'static str,
    pub(super) latin: &'static str,
    pub(super) action_unit: u8,
    pub(super) attachment: [f64; 2],
    pub(super) insertion: [f64; 2],
    pub(super) half_width_mm: f64,
}

const fn extra(
    id: &'static str,
    latin: &'static str,
    action_unit: u8,
    attachment: [f64; 2],
    insertion: [f64; 2],
    half_width_mm: f64,
) -> Extra {
    Extra { id, latin, action_unit, attachment, insertion, half_width_mm }
}

/// Muscles added to a face model that does not have them. Ends: fibres of a finite element face, and general anatomy for the procerus
/// and the zygomaticus minor.
pub(super) const EXTRAS: [Extra; 4] = [
    extra("procerus", "Musculus procerus", 4, [3.0, 0.0], [4.0, 22.0], 5.0),
    extra("zygomaticus_minor", "Musculus zygomaticus minor", 11, [44.0, -20.0], [21.0, -56.0], 5.0),
    extra("levator_anguli_oris", "Musculus levator anguli oris", 13, [32.0, -21.0], [30.0, -62.0], 4.0),
    extra("mentalis", "Musculus mentalis", 17, [5.0, -86.0], [7.0, -101.0], 6.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_action_unit_has_two_strengths_and_every_strength_is_one() {
        let mut units: Vec<u8> = STRENGTHS.iter().flat_map(|s| s.action_units).copied().collect();
        let all = units.len();
        units.sort_unstable();
        units.dedup();
        assert_eq!(units.len(), all);
        assert!(STRENGTHS.iter().all(|s| s.newton > 0.0 && !s.source.is_empty()));
        assert_eq!(of_action_unit(2).newton, 3.4);
        assert_eq!(of_action_unit(44), OTHER);
    }

    #[test]
    fn the_document_shows_the_table() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/expressions.md")).unwrap();
        for s in STRENGTHS {
            let units: Vec<String> = s.action_units.iter().map(u8::to_string).collect();
            let row = format!("| {} | {} | {} | {} |", units.join(", "), s.newton, s.evidence.label(), s.source);
            assert!(text.contains(&row), "docs/expressions.md lacks: {row}");
        }
    }
}
