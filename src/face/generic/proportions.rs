//! The proportions of a face by name, with their mean and spread among adults, and faces of other proportions made from the mean one.
//!
//! A proportion is a distance between two landmarks. Each has a smooth field of displacements of its own (a nose that grows takes
//! the mouth along but not the chin), and a face of given proportions is the mean face moved by that sum of fields whose landmarks
//! measure as asked: x′ = x + Σₖ aₖ φₖ(x), with the amounts a solved for. Fields move both sides alike, so faces stay symmetric.

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::super::{FaceError, FaceModel};

/// A named proportion of adult faces.
#[derive(Debug)]
pub struct Proportion {
    /// Short name: `nose_length`.
    pub id: &'static str,
    /// What is measured, for people.
    pub name: &'static str,
    /// Standard deviation among adults of one sex and population, mm.
    pub sd_mm: f64,
    /// Where the standard deviation comes from.
    pub source: &'static str,
    measure: Measure,
    field: fn(&Point3<f64>) -> Vector3<f64>,
}

/// How a proportion is read from the landmarks of a face.
#[derive(Debug)]
enum Measure {
    /// Distance between two landmarks.
    Distance(&'static str, &'static str),
    /// How much nearer to the camera the first landmark lies than the second.
    Protrusion(&'static str, &'static str),
}

/// Standard measurements of women and of men of one population, their variances averaged: √((s₁² + s₂²)/2).
const SURVEY: &str =
    "Maxillofac Plast Reconstr Surg 41 (2019), doi 10.1186/s40902-019-0191-7, table 9, both sexes pooled";
/// Where no figure was found.
const ASSUMED: &str = "assumed: no published figure found";

/// Every proportion. The embedded face has the mean of each.
pub static PROPORTIONS: [Proportion; 15] = [
    Proportion {
        id: "face_height",
        name: "saddle of the nose to bottom of the chin (n–gn)",
        sd_mm: 4.6,
        source: SURVEY,
        measure: Measure::Distance("nose_saddle", "chin"),
        field: |p| Vector3::new(0.0, -ramp(-p.y, 77.0, 110.5), 0.0),
    },
    Proportion {
        id: "face_width",
        name: "temple to temple",
        sd_mm: 4.1,
        source: "that of the bizygomatic width: Maxillofac Plast Reconstr Surg 41 (2019), doi 10.1186/s40902-019-0191-7, table 9",
        measure: Measure::Distance("temple_left", "temple_right"),
        field: |p| Vector3::new(0.5 * p.x / 70.2 * (p.x / 70.2).abs(), 0.0, 0.0),
    },
    Proportion {
        id: "forehead_height",
        name: "top of the forehead to saddle of the nose (tr–n)",
        sd_mm: 2.6,
        source: SURVEY,
        measure: Measure::Distance("forehead_top", "nose_saddle"),
        field: |p| Vector3::new(0.0, ramp(p.y, 4.0, 75.0), 0.0),
    },
    Proportion {
        id: "brow_ridge",
        name: "middle of the brow before the outer corner of the eye",
        sd_mm: 1.5,
        source: ASSUMED,
        measure: Measure::Protrusion("brow_mid_left", "eye_outer_left"),
        field: |p| Vector3::new(0.0, 0.0, hill(p.x.abs() - 30.0, 36.0) * hill(p.y - 26.0, 17.0)),
    },
    Proportion {
        id: "eye_distance",
        name: "inner corner to inner corner of the eyes (en–en)",
        sd_mm: 2.5,
        source: "Plast Reconstr Surg Glob Open 2022, PMC9029890: White adults",
        measure: Measure::Distance("eye_inner_left", "eye_inner_right"),
        field: |p| sideways(p, 0.5 * tent(p.x.abs(), 0.0, 18.4, 44.6, 70.0) * hill(p.y, 36.0)),
    },
    Proportion {
        id: "eye_width",
        name: "inner to outer corner of the eye (en–ex)",
        sd_mm: 2.6,
        source: SURVEY,
        measure: Measure::Distance("eye_inner_left", "eye_outer_left"),
        field: |p| sideways(p, tent(p.x.abs(), 18.4, 44.6, 44.6, 71.0) * hill(p.y, 36.0)),
    },
    Proportion {
        id: "nose_length",
        name: "saddle of the nose to root of the upper lip (n–sn)",
        sd_mm: 2.6,
        source: SURVEY,
        measure: Measure::Distance("nose_saddle", "subnasale"),
        field: |p| Vector3::new(0.0, -tent(-p.y, -4.0, 45.0, 77.0, 110.5), 0.0),
    },
    Proportion {
        id: "nose_width",
        name: "wing to wing of the nose (al–al)",
        sd_mm: 3.8,
        source: SURVEY,
        measure: Measure::Distance("nose_wing_left", "nose_wing_right"),
        field: |p| sideways(p, 0.5 * tent(p.x.abs(), 0.0, 18.2, 18.2, 46.0) * hill(p.y + 36.0, 30.0)),
    },
    Proportion {
        id: "nose_protrusion",
        name: "tip of the nose before the root of the upper lip",
        sd_mm: 2.0,
        source: ASSUMED,
        measure: Measure::Protrusion("nose_tip", "subnasale"),
        field: |p| Vector3::new(0.0, 0.0, hill(p.x, 22.0) * hill(p.y + 29.0, 28.0)),
    },
    Proportion {
        id: "upper_lip_height",
        name: "root of the upper lip to the line between the lips (sn–sto)",
        sd_mm: 2.0,
        source: SURVEY,
        measure: Measure::Distance("subnasale", "upper_lip_inner"),
        field: |p| Vector3::new(0.0, -tent(-p.y, 45.0, 66.3, 77.0, 110.5), 0.0),
    },
    Proportion {
        id: "lip_height",
        name: "upper edge of the upper lip to lower edge of the lower lip (ls–li)",
        sd_mm: 1.5,
        source: SURVEY,
        measure: Measure::Distance("upper_lip", "lower_lip"),
        field: |p| {
            Vector3::new(0.0, 0.5 * (tent(-p.y, 45.0, 60.2, 60.2, 66.3) - tent(-p.y, 68.6, 77.0, 77.0, 110.5)), 0.0)
        },
    },
    Proportion {
        id: "mouth_width",
        name: "corner to corner of the mouth (ch–ch)",
        sd_mm: 3.7,
        source: SURVEY,
        measure: Measure::Distance("mouth_corner_left", "mouth_corner_right"),
        field: |p| sideways(p, 0.5 * tent(p.x.abs(), 0.0, 25.35, 25.35, 58.0) * hill(p.y + 69.0, 36.0)),
    },
    Proportion {
        id: "chin",
        name: "bottom of the chin before the corner of the mouth",
        sd_mm: 3.0,
        source: ASSUMED,
        measure: Measure::Protrusion("chin", "mouth_corner_left"),
        field: |p| Vector3::new(0.0, 0.0, hill(p.x, 46.0) * ramp(-p.y, 77.0, 104.0)),
    },
    Proportion {
        id: "jaw_width",
        name: "corner to corner of the jaw (go–go)",
        sd_mm: 4.6,
        source: SURVEY,
        measure: Measure::Distance("jaw_left", "jaw_right"),
        field: |p| sideways(p, 0.5 * ramp(p.x.abs(), 20.0, 57.4) * ramp(-p.y, 0.0, 76.0)),
    },
    Proportion {
        id: "depth",
        name: "saddle of the nose before the temple",
        sd_mm: 4.0,
        source: ASSUMED,
        measure: Measure::Protrusion("nose_saddle", "temple_left"),
        field: |p| Vector3::new(0.0, 0.0, -(p.x / 70.2) * (p.x / 70.2)),
    },
];

/// Proportions farther from their mean than so many standard deviations are refused: no adult has them.
pub const MOST_DEVIATIONS: f64 = 4.0;

/// Why a face of given proportions cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProportionError {
    /// No proportion has that name.
    #[error("`{0}` is no proportion of a face; `frontalis face show` lists them")]
    Unknown(String),
    /// A value that no adult face has.
    #[error("{id} is {value} mm; it must lie between {low:.1} and {high:.1} mm")]
    Range {
        /// The proportion.
        id: &'static str,
        /// The value asked for.
        value: f64,
        /// Least value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// A value that contradicts the others.
    #[error("no face has these proportions together: {id} comes out as {found:.1} mm instead of {asked:.1} mm")]
    Contradiction {
        /// The proportion that is farthest off.
        id: &'static str,
        /// What was asked.
        asked: f64,
        /// What came out.
        found: f64,
    },
    /// The face has not the landmarks of the generic face.
    #[error("the face has no landmark {0}")]
    NoLandmark(&'static str),
    /// The parts do not fit together.
    #[error(transparent)]
    Face(#[from] FaceError),
}

/// The proportions of a face, mm, in the order of [`PROPORTIONS`].
pub fn measured(face: &FaceModel) -> Result<Vec<f64>, ProportionError> {
    let place = |id: &'static str| {
        let landmark = face.landmark(id).ok_or(ProportionError::NoLandmark(id))?;
        Ok(face.mesh().positions()[landmark.vertex as usize])
    };
    PROPORTIONS.iter().map(|p| p.measure.of(place)).collect()
}

/// A smooth deformation of the mean face to other proportions.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    amounts: Vec<f64>,
}

impl Deformation {
    /// The deformation of `mean` that gives it the named proportions (mm) and leaves every other at its mean.
    pub fn to(mean: &FaceModel, wanted: &[(&str, f64)]) -> Result<Self, ProportionError> {
        let means = measured(mean)?;
        let mut target = means.clone();
        for &(id, value) in wanted {
            let k = PROPORTIONS.iter().position(|p| p.id == id).ok_or(ProportionError::Unknown(id.to_owned()))?;
            let reach = MOST_DEVIATIONS * PROPORTIONS[k].sd_mm;
            let (low, high) = (means[k] - reach, means[k] + reach);
            if !(value >= low && value <= high) {
                return Err(ProportionError::Range { id: PROPORTIONS[k].id, value, low, high });
            }
            target[k] = value;
        }
        Self::solved(mean, &target)
    }

    /// Newton's method; the fields are nearly independent, so a handful of steps reaches rounding error.
    fn solved(mean: &FaceModel, target: &[f64]) -> Result<Self, ProportionError> {
        let n = PROPORTIONS.len();
        let mut shape = Self { amounts: vec![0.0; n] };
        let mut found = shape.measured(mean)?;
        for _ in 0..20 {
            let lack = DVector::from_iterator(n, target.iter().zip(&found).map(|(t, f)| t - f));
            if lack.amax() < CLOSE_MM {
                return Ok(shape);
            }
            let mut slopes = DMatrix::zeros(n, n);
            for k in 0..n {
                const STEP: f64 = 1e-3;
                let mut beside = shape.clone();
                beside.amounts[k] += STEP;
                let there = beside.measured(mean)?;
                for i in 0..n {
                    slopes[(i, k)] = (there[i] - found[i]) / STEP;
                }
            }
            let Some(step) = slopes.lu().solve(&lack) else { break };
            shape.amounts.iter_mut().zip(step.iter()).for_each(|(a, s)| *a += s);
            found = shape.measured(mean)?;
        }
        let farthest = (0..n).max_by(|&i, &j| (target[i] - found[i]).abs().total_cmp(&(target[j] - found[j]).abs()));
        let k = farthest.unwrap_or(0);
        Err(ProportionError::Contradiction { id: PROPORTIONS[k].id, asked: target[k], found: found[k] })
    }

    fn measured(&self, mean: &FaceModel) -> Result<Vec<f64>, ProportionError> {
        let place = |id: &'static str| {
            let landmark = mean.landmark(id).ok_or(ProportionError::NoLandmark(id))?;
            Ok(self.apply(&mean.mesh().positions()[landmark.vertex as usize]))
        };
        PROPORTIONS.iter().map(|p| p.measure.of(place)).collect()
    }

    /// Where a point of the mean face goes.
    pub fn apply(&self, x: &Point3<f64>) -> Point3<f64> {
        let shift: Vector3<f64> = PROPORTIONS.iter().zip(&self.amounts).map(|(p, a)| (p.field)(x) * *a).sum();
        x + shift
    }
}

/// Proportions that are met to this, mm, are met.
const CLOSE_MM: f64 = 1e-9;

/// The generic face with the named proportions (mm) in place of their means; all others stay at their means.
pub fn generate_with(wanted: &[(&str, f64)]) -> Result<FaceModel, ProportionError> {
    let mean = super::generate()?;
    if wanted.is_empty() {
        return Ok(mean);
    }
    let shape = Deformation::to(&mean, wanted)?;
    let moved = mean.mesh().positions().iter().map(|x| shape.apply(x).map(super::rounded)).collect();
    let mut parts = mean.to_parts();
    let values: Vec<String> = wanted.iter().map(|(id, value)| format!("{id} {value} mm")).collect();
    parts.name = format!("{} ({})", parts.name, values.join(", "));
    Ok(FaceModel::new(mean.mesh().with_positions(moved).map_err(FaceError::from)?, parts)?)
}

impl Measure {
    fn of(&self, place: impl Fn(&'static str) -> Result<Point3<f64>, ProportionError>) -> Result<f64, ProportionError> {
        Ok(match self {
            Measure::Distance(a, b) => (place(a)? - place(b)?).norm(),
            Measure::Protrusion(a, b) => place(a)?.z - place(b)?.z,
        })
    }
}

/// 0 up to `from`, 1 beyond `to`, linear between.
fn ramp(x: f64, from: f64, to: f64) -> f64 {
    ((x - from) / (to - from)).clamp(0.0, 1.0)
}

/// 0 outside `from` to `end`, 1 between `full` and `last`, linear between.
fn tent(x: f64, from: f64, full: f64, last: f64, end: f64) -> f64 {
    ramp(x, from, full).min(1.0 - ramp(x, last, end))
}

/// (1 − (x/radius)²)², 0 beyond the radius: a smooth hill of height 1.
fn hill(x: f64, radius: f64) -> f64 {
    let inside = (1.0 - (x / radius) * (x / radius)).max(0.0);
    inside * inside
}

/// Away from the midline.
fn sideways(p: &Point3<f64>, amount: f64) -> Vector3<f64> {
    Vector3::new(if p.x < 0.0 { -amount } else { amount }, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::check::{Expectations, check_against};

    #[test]
    fn a_face_measures_what_was_asked_and_nothing_else_changes() {
        let mean = super::super::generic();
        let means = measured(&mean).unwrap();
        for (k, p) in PROPORTIONS.iter().enumerate() {
            for deviations in [-3.0, 3.0] {
                let value = means[k] + deviations * p.sd_mm;
                let face = generate_with(&[(p.id, value)]).unwrap();
                for (i, (found, mean)) in measured(&face).unwrap().iter().zip(&means).enumerate() {
                    let asked = if i == k { value } else { *mean };
                    assert!((found - asked).abs() < 5e-4, "{} at {value}: {} is {found}", p.id, PROPORTIONS[i].id);
                }
                let report = check_against(
                    &face,
                    &Expectations {
                        smallest_angle_deg: 12.0,
                        largest_angle_deg: 150.0,
                        largest_area_ratio: None,
                        ..Expectations::generic()
                    },
                );
                assert!(report.ok(), "{} at {value}:\n{report}", p.id);
            }
        }
    }

    #[test]
    fn all_proportions_together_are_met() {
        let mean = super::super::generic();
        let means = measured(&mean).unwrap();
        let wanted: Vec<(&str, f64)> = PROPORTIONS
            .iter()
            .enumerate()
            .map(|(k, p)| (p.id, means[k] + if k % 2 == 0 { 1.5 } else { -1.5 } * p.sd_mm))
            .collect();
        let found = measured(&generate_with(&wanted).unwrap()).unwrap();
        for (f, (id, w)) in found.iter().zip(&wanted) {
            assert!((f - w).abs() < 5e-4, "{id}");
        }
    }

    #[test]
    fn what_no_adult_has_is_refused_by_name() {
        let refusal = |wanted: &[(&str, f64)]| generate_with(wanted).unwrap_err().to_string();
        assert!(refusal(&[("nose", 50.0)]).starts_with("`nose` is no proportion of a face"));
        let range = refusal(&[("nose_length", 90.0)]);
        assert!(range.starts_with("nose_length is 90 mm; it must lie between 39"), "{range}");
        assert!(refusal(&[("nose_length", f64::NAN)]).starts_with("nose_length is NaN mm"));
    }

    /// The means of the embedded face against the means of the scan database it was drawn after, mm.
    #[test]
    fn the_embedded_face_has_the_mean_proportions() {
        let means = measured(&super::super::generic()).unwrap();
        for (id, mm, tolerance) in [
            ("face_height", 113.0, 3.0),
            ("nose_length", 50.0, 2.0),
            ("upper_lip_height", 21.0, 2.0),
            ("eye_distance", 36.9, 0.5),
            ("mouth_width", 50.7, 1.0),
            ("nose_width", 36.0, 1.0),
            ("nose_protrusion", 15.0, 2.5),
            ("jaw_width", 115.0, 1.0),
            ("forehead_height", 71.0, 4.0),
        ] {
            let k = PROPORTIONS.iter().position(|p| p.id == id).unwrap();
            assert!((means[k] - mm).abs() <= tolerance, "{id} is {:.1}, measured {mm}", means[k]);
        }
    }
}
