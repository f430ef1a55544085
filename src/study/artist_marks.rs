//! What the ways to the field make of an artist's displacements, seen by a camera and marked with an error.

use std::fmt::Write;

use super::artist::ArtistField;
use super::points::median;
use super::scene;
use super::truth_trial::TrialError;
use super::yardstick::{covered, relative_error};
use super::{Twin, TwinSettings};
use crate::displacement::regularised::WeightRule;
use crate::face::{FaceError, FaceModel};
use crate::forces::{Skin, SkinModel};
use crate::pipeline::{self, Workspace};
use crate::project::{FieldWay, MuscleWay, Role};

/// Where the fields are marked: the mouth opens and the lids unfold, which no mesh of skin can say.
const REGION: &str = "forehead_and_brows";
/// A field that moves it less has nothing to find, mm (root mean square).
const STILL_MM: f64 = 0.3;
/// Marking errors, px.
const NOISES: [f64; 3] = [0.0, 0.3, 1.0];
/// Marks drawn of each.
const SEEDS: u64 = 3;
/// Side of the frames, px.
const SIZE: u32 = 1036;

/// The ways; each with the membrane as skin and the depth of the first frame, by the law that leaves least.
const WAYS: [(&str, FieldWay); 4] = [
    ("direct", FieldWay::Direct),
    ("regularised", FieldWay::Regularised { weight: WeightRule::Discrepancy }),
    ("muscles", muscles(false)),
    ("muscles alone", muscles(true)),
];

const fn muscles(alone: bool) -> FieldWay {
    FieldWay::Muscles(MuscleWay { weight: WeightRule::Discrepancy, law: None, most: None, alone, shape: false })
}

/// What a way makes of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkRow {
    /// The field.
    pub truth: String,
    /// The way.
    pub way: &'static str,
    /// Standard deviation of a mark along each axis, px.
    pub noise_px: f64,
    /// ‖F − F_true‖ / ‖F_true‖, the true force that of the same membrane at the true places: median of the draws.
    pub error: f64,
    /// Share of the vertices whose true force lies within the 95 % region of the stated error: median of the draws.
    pub covered: f64,
}

/// Every way and marking error on a field; none where the forehead does not move.
///
/// # Errors
/// A field whose places make no face, or that no camera sees.
pub fn rows(generic: &FaceModel, name: &str, field: &ArtistField) -> Result<Vec<MarkRow>, MarksError> {
    let person = generic.with_positions(field.first.clone())?;
    let region = person.region(REGION);
    let squares: f64 = region.iter().map(|v| field.displacement[*v as usize].norm_squared()).sum();
    if (squares / region.len().max(1) as f64).sqrt() < STILL_MM {
        return Ok(Vec::new());
    }
    let mut rows = Vec::new();
    for noise_px in NOISES {
        for (way, chosen) in WAYS {
            let (mut errors, mut shares) = (Vec::new(), Vec::new());
            for seed in 1..=SEEDS {
                let settings = TwinSettings { seed, noise_px, ..TwinSettings::default() };
                let twin = Twin::displaced(&person, field.last.clone(), &settings).map_err(TrialError::from)?;
                let mut project =
                    scene::membrane_project(&twin, &person, scene::unseen_frames(SIZE), noise_px, name, 0.0);
                project.features.retain(|v, f| f.role == Role::Still || region.contains(v));
                project.settings.skin_model = SkinModel::Membrane;
                project.settings.field = chosen;
                let mut truth = Vec::new();
                let skin = Skin::new(person.mesh(), &field.first, &project.settings.skin_spec());
                skin.muscle_forces(&field.last, &vec![true; field.last.len()], &mut truth);
                let outcome = pipeline::solve(&project, generic, [SIZE, SIZE], &mut Workspace::default());
                let asked = |v: usize| {
                    let skin = project.features.get(&(v as u32)).is_some_and(|f| f.role == Role::Skin);
                    skin && field.believed[v] && outcome.is_believed(v)
                };
                let among: Vec<usize> = (0..truth.len()).filter(|v| asked(*v)).collect();
                errors.push(relative_error(&outcome.field.force, &truth, &among));
                shares.push(covered(&outcome.field.force, &truth, &outcome.field.sigma, &among));
            }
            let [error, covered] = [&mut errors, &mut shares].map(|all| median(all).unwrap_or(f64::NAN));
            rows.push(MarkRow { truth: name.to_owned(), way, noise_px, error, covered });
        }
    }
    Ok(rows)
}

/// Why a field cannot be marked.
#[derive(Debug, thiserror::Error)]
pub enum MarksError {
    /// Its places.
    #[error(transparent)]
    Face(#[from] FaceError),
    /// Its pictures.
    #[error(transparent)]
    Trial(#[from] TrialError),
}

/// A table for people: a row a field and marking error, a column a way.
pub fn markdown(rows: &[MarkRow]) -> String {
    let mut text = "\nError of the forces of marked foreheads, %, and in brackets the share of the true forces within the 95 % region of the stated error; the skin a membrane, the depth that of the first frame.\n\n| truth | marks |".to_owned();
    for (way, _) in WAYS {
        let _ = write!(text, " {way} |");
    }
    text.push_str("\n|---|---|---|---|---|---|\n");
    for of_truth in rows.chunk_by(|a, b| (&a.truth, a.noise_px) == (&b.truth, b.noise_px)) {
        let Some(first) = of_truth.first() else { continue };
        let _ = write!(text, "| artist: {} | {} px |", first.truth, first.noise_px);
        for r in of_truth {
            let _ = write!(text, " {:.0} ({:.0}) |", 100.0 * r.error, 100.0 * r.covered);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use nalgebra::Vector3;

    /// A raise of the forehead within the picture, as the depth rule has it: exact marks find its forces again but for the fit of the face, marks with an
    /// error do not, and the error bars say so.
    #[test]
    fn a_flat_raise_is_found_with_exact_marks_and_lost_in_noise() {
        let generic = face::generic();
        let first = generic.mesh().positions().to_vec();
        let up = |p: &nalgebra::Point3<f64>| Vector3::new(0.0, 5.0 * (-((p.y - 50.0) / 25.0).powi(2)).exp(), 0.0);
        let displacement: Vec<Vector3<f64>> = first.iter().map(up).collect();
        let n = first.len();
        let field = ArtistField {
            last: first.iter().zip(&displacement).map(|(x, d)| x + d).collect(),
            first,
            displacement,
            forces: vec![Vector3::zeros(); n],
            sigma: vec![0.0; n],
            normals: vec![Vector3::z(); n],
            believed: vec![true; n],
        };
        let rows = rows(&generic, "raise", &field).unwrap();
        assert_eq!(rows.len(), NOISES.len() * WAYS.len());
        let of = |way: &str, noise: f64| rows.iter().find(|r| (r.way, r.noise_px) == (way, noise)).unwrap();
        let [exact, noisy] = [0.0, 1.0].map(|noise| of("direct", noise));
        assert!(exact.error < 0.1 && noisy.error > 1.0 && noisy.covered > 0.85, "{exact:?} {noisy:?}");
        assert!(of("regularised", 1.0).error < 0.6 * noisy.error);
        let table = markdown(&rows);
        assert!(table.contains("| artist: raise | 0.3 px |"), "{table}");
        let still = ArtistField { displacement: vec![Vector3::zeros(); n], ..field };
        assert!(super::rows(&generic, "nothing", &still).unwrap().is_empty());
    }
}
