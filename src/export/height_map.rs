//! `height_map.png`: |F| over the face as a picture, with what is to be known of it printed beside it.

use image::RgbImage;

use crate::draw::height_map::{self, HeightMapError, HeightMapOptions, Heights};
use crate::draw::numbers::with_error;
use crate::face::FaceModel;
use crate::pipeline::{Outcome, Peak, Warning};
use crate::project::Project;

/// Draws the forces of an outcome: the range, the largest force and what stands above its error by the same rules as the window.
///
/// # Errors
/// An outcome that does not belong to the face, or holds numbers that are not finite.
pub fn picture(project: &Project, face: &FaceModel, outcome: &Outcome) -> Result<RgbImage, HeightMapError> {
    let unit = outcome.unit();
    let options = HeightMapOptions {
        unit: if outcome.scale_measured { unit.to_owned() } else { "N (relative)".to_owned() },
        title: project.name.clone(),
        ..HeightMapOptions::default()
    };
    let peak = match outcome.peak() {
        Peak::Stands { vertex, force, sigma } => {
            Some((vertex, format!("{} {}", with_error(force, Some(sigma)), options.unit)))
        }
        _ => None,
    };
    let noisy = outcome.warnings.iter().find(|w| matches!(w, Warning::NoisyField { .. }));
    let below_noise: Vec<bool> = (0..outcome.states.len()).map(|v| !outcome.stands_above_error(v)).collect();
    let heights = Heights {
        positions: &outcome.first_from_eyes(face),
        triangles: face.mesh().triangles(),
        values: &outcome.magnitude_inside_border(),
        below_noise: &below_noise,
        sets_range: &outcome.sets_range(),
        peak,
        finding: outcome.peak().in_words(unit),
        warning: noisy.map(ToString::to_string).unwrap_or_default(),
    };
    height_map::render(&heights, &options)
}
