//! The stress–strain diagram of the skin as a piecewise-linear table.

use serde::{Deserialize, Serialize};

/// What the skin does when it is pressed together by more than [`WRINKLE_STRAIN`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contraction {
    /// It wrinkles: the stress stays what it is at −20 % (−9.13 kPa in the default table). A thin membrane can carry little
    /// more than the pre-tension that it lost.
    #[default]
    Saturating,
    /// It follows the table, and beyond the table its first slope: a solid of Fung's kind.
    Fung,
}

/// Strain at which saturating skin starts to wrinkle.
pub const WRINKLE_STRAIN: f64 = -0.20;

/// Steepest segment accepted, kPa per unit strain. Excised skin reaches 1e5; beyond this it is a slip of the pen.
const STEEPEST_KPA: f64 = 1e9;

/// How far the curve may pass from the origin, as a share of its largest stress.
const ORIGIN_TOLERANCE: f64 = 1e-9;

/// Stress against engineering strain, piecewise linear, through the origin. Thesis §5.1, Fig. 5.2.
///
/// σ(ε) = σᵢ + Eᵢ (ε − εᵢ)   for εᵢ ≤ ε < εᵢ₊₁
///
/// | here       | thesis | unit |
/// |------------|--------|------|
/// | strain     | ε = (L − l) / l, positive when stretched | – |
/// | stress     | σ      | kPa = 1e-3 N/mm² |
///
/// Continuous and non-decreasing, and strictly increasing when stretched (refused otherwise by [`StressStrainCurve::new`]).
/// Beyond either end the last slope continues; pressed together by more than 20 % the skin does what [`Contraction`] says.
///
/// The default table is the mean of the responses along and across the tension lines of the facial skin law of
/// Flynn, Stavness, Lloyd and Fels (2015); its toe modulus of 33 kPa lies within the 31–42 kPa that Luboz, Promayon and
/// Payan (2014) measured on faces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Table", into = "Table")]
pub struct StressStrainCurve {
    rows: Vec<[f64; 2]>,
    contraction: Contraction,
    pieces: Vec<Piece>,
    elongation: Vec<Hinge>,
    compression: Vec<Hinge>,
}

/// Why a table was refused. Rows are counted from 1, as a person counts them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// No line can be drawn.
    #[error("the stress–strain table has {rows} rows; at least 2 are needed")]
    TooFewRows {
        /// Number of rows found.
        rows: usize,
    },
    /// A number is NaN or infinite.
    #[error("row {row} of the stress–strain table holds something that is not a finite number")]
    NotFinite {
        /// Row, from 1.
        row: usize,
    },
    /// A spring cannot be shorter than nothing.
    #[error("row {row} of the stress–strain table has strain {strain}; the least possible is -1 (length zero)")]
    Impossible {
        /// Row, from 1.
        row: usize,
        /// Its strain.
        strain: f64,
    },
    /// Strains must go up from row to row.
    #[error("row {row} of the stress–strain table has strain {strain}, not greater than the {previous} before it")]
    NotIncreasing {
        /// Row, from 1.
        row: usize,
        /// Its strain.
        strain: f64,
        /// The strain of the row before.
        previous: f64,
    },
    /// Stress falls where strain rises: the skin would be unstable.
    #[error("the stress falls between rows {} and {row} of the stress–strain table; it may only rise", row - 1)]
    Falling {
        /// The later of the two rows, from 1.
        row: usize,
    },
    /// Stretched skin must resist.
    #[error("the stress does not rise between rows {} and {row} of the stress–strain table; stretched skin must resist", row - 1)]
    FlatInTension {
        /// The later of the two rows, from 1.
        row: usize,
    },
    /// A step instead of a slope.
    #[error("rows {} and {row} of the stress–strain table make a slope of {slope_kpa:e} kPa; the limit is {limit_kpa:e}", row - 1)]
    TooSteep {
        /// The later of the two rows, from 1.
        row: usize,
        /// The slope.
        slope_kpa: f64,
        /// Largest slope accepted.
        limit_kpa: f64,
    },
    /// Skin at rest carries nothing.
    #[error("the stress–strain table must pass through strain 0, stress 0; at strain 0 it {found}")]
    MissesOrigin {
        /// What it does there instead.
        found: String,
    },
}

/// One straight piece: σ = `stress` + `slope` (ε − `strain`) from `from` on; `energy` is ∫ σ dε from 0 to `strain`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    from: f64,
    strain: f64,
    stress: f64,
    slope: f64,
    energy: f64,
}

/// A change of slope by `slope` at `at`, counted outwards from zero strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hinge {
    pub(crate) at: f64,
    pub(crate) slope: f64,
}

/// A run of the curve outwards from zero: its slope from the distance `at` on.
type Run = Vec<Hinge>;

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    rows: Vec<[f64; 2]>,
    #[serde(default)]
    contraction: Contraction,
}

impl TryFrom<Table> for StressStrainCurve {
    type Error = CurveError;

    fn try_from(table: Table) -> Result<Self, CurveError> {
        Self::new(table.rows, table.contraction)
    }
}

impl From<StressStrainCurve> for Table {
    fn from(curve: StressStrainCurve) -> Self {
        Self { rows: curve.rows, contraction: curve.contraction }
    }
}

impl Default for StressStrainCurve {
    fn default() -> Self {
        Self::checked(DEFAULT_ROWS.to_vec(), Contraction::default())
    }
}

/// Engineering strain and stress in kPa.
const DEFAULT_ROWS: [[f64; 2]; 10] = [
    [-0.40, -97.0],
    [-0.30, -25.2],
    [-0.20, -9.13],
    [-0.10, -3.35],
    [0.0, 0.0],
    [0.10, 3.62],
    [0.20, 10.9],
    [0.30, 33.4],
    [0.40, 136.0],
    [0.50, 851.0],
];

impl StressStrainCurve {
    /// A table of (strain, stress in kPa), strains going up.
    ///
    /// # Errors
    /// Fewer than two rows, numbers that are not finite, strains below −1 or not increasing, falling stress, no resistance
    /// to stretching, a curve that misses the origin.
    pub fn new(rows: Vec<[f64; 2]>, contraction: Contraction) -> Result<Self, CurveError> {
        check(&rows)?;
        Ok(Self::checked(rows, contraction))
    }

    fn checked(rows: Vec<[f64; 2]>, contraction: Contraction) -> Self {
        let stretched = outwards(rows.iter().copied());
        let mut pressed = outwards(rows.iter().rev().map(|&[strain, stress]| [-strain, -stress]));
        // A table that ends at the origin continues through it with the slope of the other side.
        let stretched = if stretched.is_empty() { pressed[..1].to_vec() } else { stretched };
        if pressed.is_empty() {
            pressed = stretched[..1].to_vec();
        }
        if contraction == Contraction::Saturating {
            pressed.retain(|run| run.at < -WRINKLE_STRAIN);
            pressed.push(Hinge { at: -WRINKLE_STRAIN, slope: 0.0 });
        }
        let pieces = pieces(&pressed, &stretched);
        Self { rows, contraction, pieces, elongation: hinges(&stretched), compression: hinges(&pressed) }
    }

    /// The table as given: strain, stress in kPa.
    pub fn rows(&self) -> &[[f64; 2]] {
        &self.rows
    }

    /// What happens below −20 %.
    pub fn contraction(&self) -> Contraction {
        self.contraction
    }

    /// σ(ε), kPa; positive when stretched.
    pub fn stress_kpa(&self, strain: f64) -> f64 {
        let p = self.piece(strain);
        p.stress + p.slope * (strain - p.strain)
    }

    /// dσ/dε, kPa: the slope to the right of a corner.
    pub fn slope_kpa(&self, strain: f64) -> f64 {
        self.piece(strain).slope
    }

    /// Energy density ∫₀^ε σ dε (kPa = mJ a cm³), stress σ and slope dσ/dε (kPa) at once.
    pub fn energy_stress_slope_kpa(&self, strain: f64) -> [f64; 3] {
        let p = self.piece(strain);
        let over = strain - p.strain;
        [p.energy + over * (p.stress + 0.5 * p.slope * over), p.stress + p.slope * over, p.slope]
    }

    /// σ/ε, kPa: the stiffness that makes Thesis (4.1) return the curve; the slope at ε = 0, its limit from the stretched side.
    pub fn secant_kpa(&self, strain: f64) -> f64 {
        if strain == 0.0 { self.slope_kpa(0.0) } else { self.stress_kpa(strain) / strain }
    }

    /// Whether the table says anything about this strain. Outside, the stress is a continuation.
    pub fn covers(&self, strain: f64) -> bool {
        let (first, last) = (self.rows[0][0], self.rows[self.rows.len() - 1][0]);
        (first..=last).contains(&strain)
    }

    /// The curve as a sum of hinges, for loops that many strains go through at once:
    /// σ(ε) = Σ eₖ max(0, ε − aₖ) − Σ cₖ max(0, −ε − bₖ), elongation first.
    pub(crate) fn hinges(&self) -> (&[Hinge], &[Hinge]) {
        (&self.elongation, &self.compression)
    }

    fn piece(&self, strain: f64) -> &Piece {
        // Counting them all is faster than searching: a dozen comparisons without a branch.
        let after: usize = self.pieces.iter().map(|p| usize::from(p.from <= strain)).sum();
        &self.pieces[after.saturating_sub(1)]
    }
}

fn check(rows: &[[f64; 2]]) -> Result<(), CurveError> {
    if rows.len() < 2 {
        return Err(CurveError::TooFewRows { rows: rows.len() });
    }
    for (r, &[strain, stress]) in rows.iter().enumerate() {
        if !(strain.is_finite() && stress.is_finite()) {
            return Err(CurveError::NotFinite { row: r + 1 });
        }
        if strain < -1.0 {
            return Err(CurveError::Impossible { row: r + 1, strain });
        }
    }
    for (r, pair) in rows.windows(2).enumerate() {
        let ([e0, s0], [e1, s1], row) = (pair[0], pair[1], r + 2);
        if e1 <= e0 {
            return Err(CurveError::NotIncreasing { row, strain: e1, previous: e0 });
        }
        if s1 < s0 {
            return Err(CurveError::Falling { row });
        }
        if s1 == s0 && e1 > 0.0 {
            return Err(CurveError::FlatInTension { row });
        }
        let slope_kpa = (s1 - s0) / (e1 - e0);
        if slope_kpa > STEEPEST_KPA {
            return Err(CurveError::TooSteep { row, slope_kpa, limit_kpa: STEEPEST_KPA });
        }
    }
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    if first[0] > 0.0 || last[0] < 0.0 {
        return Err(CurveError::MissesOrigin { found: "says nothing".to_owned() });
    }
    let largest = first[1].abs().max(last[1].abs());
    let after = rows.partition_point(|r| r[0] < 0.0);
    let [e1, s1] = rows[after];
    let at_zero = match after.checked_sub(1).map(|before| rows[before]) {
        Some([e0, s0]) if e1 > 0.0 => s0 - e0 * (s1 - s0) / (e1 - e0),
        _ => s1,
    };
    if at_zero.abs() > ORIGIN_TOLERANCE * largest {
        return Err(CurveError::MissesOrigin { found: format!("has stress {at_zero} kPa") });
    }
    Ok(())
}

/// The slopes met on the way from the origin out to the last row with positive strain. Rows at or before the origin only tell
/// where the first segment comes from: the curve is taken to pass through (0, 0) exactly.
fn outwards(rows: impl Iterator<Item = [f64; 2]>) -> Run {
    let mut run = Run::new();
    let mut last = [0.0, 0.0];
    for [strain, stress] in rows.filter(|r| r[0] > 0.0) {
        run.push(Hinge { at: last[0], slope: (stress - last[1]) / (strain - last[0]) });
        last = [strain, stress];
    }
    run
}

fn hinges(run: &[Hinge]) -> Vec<Hinge> {
    let mut before = 0.0;
    let mut hinges: Vec<Hinge> =
        run.iter().map(|h| Hinge { at: h.at, slope: h.slope - std::mem::replace(&mut before, h.slope) }).collect();
    hinges.retain(|h| h.slope != 0.0);
    hinges
}

/// Pieces in ascending order of strain, each anchored at its end nearer to the origin, so that nothing cancels near zero.
fn pieces(pressed: &[Hinge], stretched: &[Hinge]) -> Vec<Piece> {
    let anchored = |run: &[Hinge]| {
        let (mut at, mut slope, mut stress, mut energy) = (0.0, 0.0, 0.0, 0.0);
        run.iter()
            .map(|h| {
                let over = h.at - at;
                energy += over * (stress + 0.5 * slope * over);
                stress += slope * over;
                (at, slope) = (h.at, h.slope);
                (at, stress, slope, energy)
            })
            .collect::<Vec<_>>()
    };
    let negative = anchored(pressed);
    let mut pieces: Vec<Piece> = negative
        .iter()
        .enumerate()
        .rev()
        .map(|(i, &(u, stress, slope, energy))| {
            let from = negative.get(i + 1).map_or(f64::NEG_INFINITY, |next| -next.0);
            Piece { from, strain: -u, stress: -stress, slope, energy }
        })
        .collect();
    pieces.extend(anchored(stretched).into_iter().map(|(e, stress, slope, energy)| Piece {
        from: e,
        strain: e,
        stress,
        slope,
        energy,
    }));
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn by_hinges(curve: &StressStrainCurve, e: f64) -> f64 {
        let (elongation, compression) = curve.hinges();
        let up: f64 = elongation.iter().map(|h| h.slope * (e - h.at).max(0.0)).sum();
        let down: f64 = compression.iter().map(|h| h.slope * (-e - h.at).max(0.0)).sum();
        up - down
    }

    #[test]
    fn the_default_table_is_returned_row_by_row_and_holds_when_the_skin_wrinkles() {
        let saturating = StressStrainCurve::default();
        let fung = StressStrainCurve::new(DEFAULT_ROWS.to_vec(), Contraction::Fung).unwrap();
        for [strain, stress] in DEFAULT_ROWS {
            assert!((fung.stress_kpa(strain) - stress).abs() < 1e-12 * stress.abs().max(1.0), "{strain}");
            let held = stress.max(-9.13);
            assert!((saturating.stress_kpa(strain) - held).abs() < 1e-12 * held.abs().max(1.0), "{strain}");
        }
        assert_eq!(saturating.stress_kpa(0.0), 0.0);
        assert!((saturating.stress_kpa(-0.9) + 9.13).abs() < 1e-12);
        assert_eq!(saturating.slope_kpa(-0.25), 0.0);
        // Half way between two rows: (3.62 + 10.9) / 2 = 7.26.
        assert!((saturating.stress_kpa(0.15) - 7.26).abs() < 1e-12);
        // Beyond the table the last slope goes on: 851 + 0.1 · 7150 = 1566; and −97 − 0.1 · 718 = −168.8.
        assert!((saturating.stress_kpa(0.6) - 1566.0).abs() < 1e-9);
        assert!((fung.stress_kpa(-0.5) + 168.8).abs() < 1e-9);
        assert!(saturating.covers(-0.4) && saturating.covers(0.5));
        assert!(!saturating.covers(-0.41) && !saturating.covers(0.51) && !saturating.covers(f64::NAN));
    }

    /// `ERRATA.md` E12: with k times elongation (4.1) only the secant gives the tension of the table back.
    #[test]
    fn the_secant_and_not_the_slope_returns_the_table() {
        // Slope 1.25 up to strain 0.4 and (2.0 − 0.5) / 0.2 = 7.5 beyond: at 0.5 the table says 0.5 + 0.75 = 1.25.
        let curve = StressStrainCurve::new(vec![[0.0, 0.0], [0.4, 0.5], [0.6, 2.0]], Contraction::Fung).unwrap();
        assert!((curve.stress_kpa(0.5) - 1.25).abs() < 1e-12);
        assert!((curve.secant_kpa(0.5) * 0.5 - 1.25).abs() < 1e-12);
        assert!(
            (curve.slope_kpa(0.5) * 0.5 - 3.75).abs() < 1e-12,
            "read as a slope the tension would be three times too large"
        );
        // The slope reading jumps at a corner, by (7.5 − 1.25) · 0.4 = 2.5; the secant does not.
        let jump = |k: &dyn Fn(f64) -> f64| k(0.4) * 0.4 - k(0.4 - 1e-12) * (0.4 - 1e-12);
        assert!((jump(&|e| curve.slope_kpa(e)) - 2.5).abs() < 1e-9 && jump(&|e| curve.secant_kpa(e)).abs() < 1e-9);
        assert_eq!(curve.secant_kpa(0.0), curve.slope_kpa(0.0));
    }

    #[test]
    fn bad_tables_are_refused_by_row() {
        let new = |rows: &[[f64; 2]]| StressStrainCurve::new(rows.to_vec(), Contraction::Fung).unwrap_err();
        assert_eq!(new(&[[0.0, 0.0]]), CurveError::TooFewRows { rows: 1 });
        assert_eq!(new(&[[0.0, 0.0], [0.1, f64::NAN]]), CurveError::NotFinite { row: 2 });
        assert_eq!(new(&[[-1.5, -1.0], [0.0, 0.0]]), CurveError::Impossible { row: 1, strain: -1.5 });
        assert_eq!(
            new(&[[0.0, 0.0], [0.1, 1.0], [0.1, 2.0]]),
            CurveError::NotIncreasing { row: 3, strain: 0.1, previous: 0.1 }
        );
        assert_eq!(new(&[[-0.2, -1.0], [-0.1, -2.0], [0.0, 0.0]]), CurveError::Falling { row: 2 });
        assert_eq!(new(&[[0.0, 0.0], [0.1, 1.0], [0.2, 1.0]]), CurveError::FlatInTension { row: 3 });
        assert!(matches!(new(&[[0.0, 0.0], [1e-300, 1e300]]), CurveError::TooSteep { row: 2, .. }));
        assert!(matches!(new(&[[0.1, 0.0], [0.2, 1.0]]), CurveError::MissesOrigin { .. }));
        assert!(matches!(new(&[[-0.1, -1.0], [0.1, 2.0]]), CurveError::MissesOrigin { .. }));
    }

    #[test]
    fn a_table_of_one_side_continues_straight_through_the_origin() {
        let up = StressStrainCurve::new(vec![[0.0, 0.0], [0.1, 1.0], [0.2, 3.0]], Contraction::Fung).unwrap();
        assert!((up.stress_kpa(-0.05) + 0.5).abs() < 1e-15);
        let down =
            StressStrainCurve::new(vec![[-0.2, -3.0], [-0.1, -1.0], [0.0, 0.0]], Contraction::Saturating).unwrap();
        assert!((down.stress_kpa(0.05) - 0.5).abs() < 1e-15);
        // A table that ends before −20 % goes on with its first slope until there, and then holds: −0.5 − 0.15 · 10 = −2.
        let short = StressStrainCurve::new(vec![[-0.05, -0.5], [0.1, 1.0]], Contraction::Saturating).unwrap();
        assert!((short.stress_kpa(-0.2) + 2.0).abs() < 1e-12 && (short.stress_kpa(-0.7) + 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_file_goes_through_the_same_checks() {
        let curve = StressStrainCurve::default();
        let text = serde_json::to_string(&curve).unwrap();
        assert!(
            text.starts_with(r#"{"rows":[[-0.4,-97.0],"#) && text.ends_with(r#""contraction":"saturating"}"#),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<StressStrainCurve>(&text).unwrap(), curve);
        let bad = serde_json::from_str::<StressStrainCurve>(r#"{"rows":[[0,0],[0.1,-1]]}"#).unwrap_err();
        assert!(bad.to_string().contains("falls between rows 1 and 2"), "{bad}");
        assert!(serde_json::from_str::<StressStrainCurve>(r#"{"rows":[[0,0],[0.1,1]],"colour":1}"#).is_err());
    }

    proptest! {
        #[test]
        fn pieces_and_hinges_are_one_curve(e in -1.0..2.0_f64, fung: bool) {
            let contraction = if fung { Contraction::Fung } else { Contraction::Saturating };
            let curve = StressStrainCurve::new(DEFAULT_ROWS.to_vec(), contraction).unwrap();
            let (a, b) = (curve.stress_kpa(e), by_hinges(&curve, e));
            prop_assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
        }

        #[test]
        fn the_energy_s_slope_is_the_stress(e in -0.6..0.7_f64) {
            let curve = StressStrainCurve::default();
            let h = 1e-5;
            let energy = |e: f64| curve.energy_stress_slope_kpa(e)[0];
            let d = (energy(e + h) - energy(e - h)) / (2.0 * h);
            let [_, stress, slope] = curve.energy_stress_slope_kpa(e);
            prop_assert!((d - stress).abs() < 0.05 && stress == curve.stress_kpa(e) && slope == curve.slope_kpa(e));
            prop_assert!(energy(0.0) == 0.0 && energy(e) >= 0.0);
        }

        #[test]
        fn stress_never_falls_and_the_slope_is_its_derivative(e in -0.6..0.7_f64) {
            let curve = StressStrainCurve::default();
            let h = 1e-7;
            prop_assert!(curve.stress_kpa(e + h) >= curve.stress_kpa(e));
            let away = curve.rows().iter().all(|r| (r[0] - e).abs() > 2.0 * h);
            let d = (curve.stress_kpa(e + h) - curve.stress_kpa(e - h)) / (2.0 * h);
            prop_assert!(!away || (d - curve.slope_kpa(e)).abs() < 1e-5 * d.abs().max(1.0));
        }
    }
}
