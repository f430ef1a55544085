//! A law found on one subject tried on another (Thesis Fig. 5.8 and 5.9), beside the same laws fitted there on equal terms.

use serde::Serialize;

use super::analysis::{Analysis, Nothing, left_out};
use super::fibres::fibres;
use super::samples::Samples;
use crate::face::FaceModel;
use crate::fit::{FailedFit, HeldOut, LawFit, LawFitOptions, Patches, candidates, fit_law};
use crate::muscle::Fibre;
use crate::pipeline::Outcome;

/// How one law of subject A does on subject B.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CarriedRow {
    /// The law as fitted on A.
    pub label: String,
    /// As it is, with A's shape and A's strengths: share explained, R². Below 0 no muscle at all would be nearer.
    pub as_fitted_r2: Option<f64>,
    /// With A's shape and strengths fitted on B.
    pub shape_carried: Result<LawFit, FailedFit>,
    /// Its error on patches of B left out.
    pub shape_carried_held_out: Option<HeldOut>,
    /// Fitted on B altogether.
    pub refitted: Result<LawFit, FailedFit>,
    /// Its error on patches of B left out.
    pub refitted_held_out: Option<HeldOut>,
}

/// The laws of A on B.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Carried {
    /// Ids of the muscles, found on A.
    pub muscles: Vec<String>,
    /// Muscles of A that B's face does not have; they are left out.
    pub missing: Vec<String>,
    /// Forces of B that counted.
    pub samples: usize,
    /// One row a law.
    pub rows: Vec<CarriedRow>,
}

/// Tries A's laws on B. The muscles are those of A's fits, found on B's face by their ids.
///
/// # Errors
/// Where B has nothing to fit, or none of A's muscles.
pub fn carry(
    analysis: &Analysis,
    face_a: &FaceModel,
    outcome_b: &Outcome,
    face_b: &FaceModel,
) -> Result<Carried, Nothing> {
    let samples = Samples::of(outcome_b, face_b, analysis.question.include);
    if samples.is_empty() {
        return Err(Nothing::NoSamples);
    }
    let (of_b, _) = fibres(face_b, &outcome_b.first);
    let (mut lines, mut muscles, mut missing, mut kept) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (place, &f) in analysis.set.iter().enumerate() {
        let id = &face_a.muscles()[analysis.fibres[f].muscle].id;
        match of_b.iter().find(|f| face_b.muscles()[f.muscle].id == *id) {
            Some(found) => {
                lines.push(found.fibre.clone());
                muscles.push(id.clone());
                kept.push(place);
            }
            None => missing.push(id.clone()),
        }
    }
    if lines.is_empty() {
        return Err(Nothing::NoMuscles);
    }
    let patches = Patches::new(&lines, &samples.samples, analysis.question.patch_radius_mm);
    let options = LawFitOptions { compare: analysis.question.compare, ..LawFitOptions::default() };
    let row = |start: &crate::muscle::MuscleLaw, fit: &LawFit| {
        let held = LawFitOptions { variants: false, ..options.clone() }.with_shape_held(&fit.law);
        let shape_carried = fit_law(&fit.law, &lines, &samples.samples, &held);
        let refitted = fit_law(start, &lines, &samples.samples, &options);
        let held_out = |fit: &Result<LawFit, FailedFit>, options: &LawFitOptions| {
            fit.as_ref().ok().and_then(|fit| left_out(&patches, fit, &lines, &samples.samples, options))
        };
        CarriedRow {
            label: fit.label.clone(),
            as_fitted_r2: as_fitted(fit, &kept, &lines, &samples),
            shape_carried_held_out: held_out(&shape_carried, &held),
            refitted_held_out: held_out(&refitted, &options),
            shape_carried,
            refitted,
        }
    };
    let starts = candidates();
    let fitted = starts.iter().zip(&analysis.laws).filter_map(|(start, r)| Some((start, r.fit.as_ref().ok()?)));
    let rows = fitted.map(|(start, fit)| row(start, fit));
    Ok(Carried { rows: rows.collect(), muscles, missing, samples: samples.len() })
}

/// Share of B's forces that A's law explains with A's strengths, of the muscles that both have.
fn as_fitted(fit: &LawFit, kept: &[usize], lines: &[Fibre], samples: &Samples) -> Option<f64> {
    let mut fit = fit.clone();
    fit.strengths.retain(|s| s.fibre.is_none_or(|f| kept.contains(&f)));
    for strength in &mut fit.strengths {
        strength.fibre = strength.fibre.and_then(|f| kept.iter().position(|k| *k == f));
    }
    fit.misfit(lines, &samples.samples).ok().map(|m| m.r2())
}
