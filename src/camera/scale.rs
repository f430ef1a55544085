//! How many pixels a millimetre is, and whether that was measured or assumed.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Where the scale of the picture comes from. Until it is given, every force is relative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "from", rename_all = "snake_case", deny_unknown_fields)]
pub enum Scale {
    /// The distance between the inner eye corners of the generic face (the mean of many people) is taken for the person's own.
    #[default]
    Assumed,
    /// Two points of the first frame a known distance apart, near the plane of the eye corners.
    TwoPoints {
        /// One point, px.
        a_px: [f64; 2],
        /// The other point, px.
        b_px: [f64; 2],
        /// Their distance, mm.
        mm: f64,
    },
    /// The painted grid: two crossings some cells apart.
    GridPitch {
        /// One crossing, px.
        a_px: [f64; 2],
        /// The other crossing, px.
        b_px: [f64; 2],
        /// Number of cells between them.
        cells: f64,
        /// Pitch of the grid, mm.
        pitch_mm: f64,
    },
    /// The distance between the person's own inner eye corners.
    InnerEyeCorners {
        /// The distance, mm.
        mm: f64,
    },
}

/// Why a scale cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScaleError {
    /// A length is zero, negative, or not a number.
    #[error("the scale's {what} must be greater than zero, and it is {value}")]
    NotPositive {
        /// Which length.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Scale {
    /// Refuses lengths that are not positive and points that coincide.
    pub fn check(&self) -> Result<(), ScaleError> {
        let positive = |what, value: f64| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(ScaleError::NotPositive { what, value }) }
        };
        match *self {
            Self::Assumed => Ok(()),
            Self::TwoPoints { a_px, b_px, mm } => {
                positive("distance in mm", mm)?;
                positive("distance in px", distance(a_px, b_px))
            }
            Self::GridPitch { a_px, b_px, cells, pitch_mm } => {
                positive("number of cells", cells)?;
                positive("pitch in mm", pitch_mm)?;
                positive("distance in px", distance(a_px, b_px))
            }
            Self::InnerEyeCorners { mm } => positive("distance in mm", mm),
        }
    }

    /// Pixels per millimetre, where this alone or with the marked inner eye corners (`eye_corners_px` apart) can tell.
    ///
    /// `assumed_eye_mm` is the distance between the inner eye corners of the generic face.
    pub fn px_per_mm(&self, eye_corners_px: Option<f64>, assumed_eye_mm: f64) -> Option<f64> {
        match *self {
            Self::Assumed => eye_corners_px.map(|px| px / assumed_eye_mm),
            Self::TwoPoints { a_px, b_px, mm } => Some(distance(a_px, b_px) / mm),
            Self::GridPitch { a_px, b_px, cells, pitch_mm } => Some(distance(a_px, b_px) / (cells * pitch_mm)),
            Self::InnerEyeCorners { mm } => eye_corners_px.map(|px| px / mm),
        }
    }

    /// Whether forces are in newton (true) or relative (false).
    pub fn is_measured(&self) -> bool {
        !matches!(self, Self::Assumed)
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (Point2::from(a) - Point2::from(b)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_per_millimetre_by_hand() {
        // 3-4-5: 50 px over 10 mm.
        let two = Scale::TwoPoints { a_px: [0.0, 0.0], b_px: [30.0, 40.0], mm: 10.0 };
        assert_eq!(two.px_per_mm(None, 36.9), Some(5.0));
        // 100 px over 5 cells of 8 mm.
        let grid = Scale::GridPitch { a_px: [0.0, 0.0], b_px: [100.0, 0.0], cells: 5.0, pitch_mm: 8.0 };
        assert_eq!(grid.px_per_mm(None, 36.9), Some(2.5));
        assert_eq!(Scale::InnerEyeCorners { mm: 30.0 }.px_per_mm(Some(120.0), 36.9), Some(4.0));
        assert_eq!(Scale::InnerEyeCorners { mm: 30.0 }.px_per_mm(None, 36.9), None);
        assert_eq!(Scale::Assumed.px_per_mm(Some(73.8), 36.9), Some(2.0));
    }

    #[test]
    fn lengths_that_are_not_positive_are_refused() {
        assert!(Scale::InnerEyeCorners { mm: 0.0 }.check().is_err());
        assert!(Scale::InnerEyeCorners { mm: f64::NAN }.check().is_err());
        assert!(Scale::TwoPoints { a_px: [1.0, 1.0], b_px: [1.0, 1.0], mm: 3.0 }.check().is_err());
        assert!(Scale::Assumed.check().is_ok());
    }
}
