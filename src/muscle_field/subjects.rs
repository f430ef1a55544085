//! A law found on one subject tried on another (Thesis Fig. 5.8 and 5.9), beside the same laws fitted there on equal terms.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::Samples;
use super::analysis::{Analysis, Nothing, left_out};
use super::fibres::{FibreOf, fibres};
use super::profiles::{Model, Part, Profile, Way, profile};
use crate::face::FaceModel;
use crate::fit::{FailedFit, HeldOut, LawFit, LawFitOptions, Patches, candidates, fit_law};
use crate::muscle::Fibre;
use crate::pipeline::Outcome;

/// A subject: a face, and the forces that were found on it.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    /// What people call it.
    pub name: &'a str,
    /// The face.
    pub face: &'a FaceModel,
    /// What the chain made of its marks.
    pub outcome: &'a Outcome,
}

/// Another subject, with the laws of the first tried on it.
#[derive(Clone, Debug)]
pub struct Other {
    /// What people call it.
    pub name: String,
    /// The face.
    pub face: Arc<FaceModel>,
    /// What the chain made of its marks.
    pub outcome: Arc<Outcome>,
    /// How the laws do on it.
    pub carried: Carried,
}

impl Other {
    /// Its forces.
    pub fn seen(&self) -> Seen<'_> {
        Seen { name: &self.name, face: &self.face, outcome: &self.outcome }
    }
}

/// How one law of subject A does on subject B.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CarriedRow {
    /// The law as fitted on A; as it began where no fit was found there.
    pub label: String,
    /// As it is, with A's shape and A's strengths: share explained, R². Below 0 no muscle at all would be nearer. Absent where A has no fit, and
    /// where only one of the subjects has a measured scale: a strength in newton says nothing of relative forces.
    pub as_fitted_r2: Option<f64>,
    /// With A's shape and strengths fitted on B.
    pub shape_carried: Result<LawFit, FailedFit>,
    /// Its error on patches of B left out.
    pub shape_carried_held_out: Option<HeldOut>,
    /// Fitted on B altogether.
    pub refitted: Result<LawFit, FailedFit>,
    /// Its error on patches of B left out.
    pub refitted_held_out: Option<HeldOut>,
    /// A's fit with its strengths given to the fibres of B.
    #[serde(skip)]
    as_fitted: Option<LawFit>,
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
    /// Whether the forces of both are in newton, or of both relative.
    pub same_unit: bool,
    /// One row a law.
    pub rows: Vec<CarriedRow>,
    /// The muscles' fibres on B.
    #[serde(skip)]
    fibres: Vec<FibreOf>,
}

/// Tries A's laws on B. The muscles are those of A's fits, found on B's face by their ids. `stop` is asked between laws, and `progress` told how
/// much is done, 0 to 1; what was stopped is `None`.
///
/// # Errors
/// Where B has nothing to fit, or none of A's muscles.
pub fn carry(
    analysis: &Analysis,
    a: Seen<'_>,
    b: Seen<'_>,
    stop: &dyn Fn() -> bool,
    progress: &dyn Fn(f64),
) -> Option<Result<Carried, Nothing>> {
    let samples = Samples::of(b.outcome, b.face, analysis.question.include);
    if samples.is_empty() {
        return Some(Err(Nothing::NoSamples));
    }
    if samples.samples.iter().all(|s| s.force == Vector3::zeros()) {
        return Some(Err(Nothing::NoForce));
    }
    let (of_b, _) = fibres(b.face, &b.outcome.first);
    let (mut found, mut muscles, mut missing, mut kept) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (place, &f) in analysis.set.iter().enumerate() {
        let id = &a.face.muscles()[analysis.fibres[f].muscle].id;
        match of_b.iter().find(|f| b.face.muscles()[f.muscle].id == *id) {
            Some(of) => {
                found.push(of.clone());
                muscles.push(id.clone());
                kept.push(place);
            }
            None => missing.push(id.clone()),
        }
    }
    if found.is_empty() {
        return Some(Err(Nothing::NoMuscles));
    }
    let lines: Vec<Fibre> = found.iter().map(|f| f.fibre.clone()).collect();
    let same_unit = a.outcome.scale_measured == b.outcome.scale_measured;
    let patches = Patches::new(&lines, &samples.samples, analysis.question.patch_radius_mm);
    let options = LawFitOptions { compare: analysis.question.compare, ..LawFitOptions::default() };
    let held_out = |fit: &Result<LawFit, FailedFit>, options: &LawFitOptions| {
        fit.as_ref().ok().and_then(|fit| left_out(&patches, fit, &lines, &samples.samples, options))
    };
    let mut rows = Vec::new();
    let starts = candidates();
    let count = starts.len().min(analysis.laws.len()).max(1) as f64;
    for (start, of_a) in starts.iter().zip(&analysis.laws) {
        if stop() {
            return None;
        }
        let (shape_carried, shape_carried_held_out) = match &of_a.fit {
            Ok(fit) => {
                let held = LawFitOptions { variants: false, ..options.clone() }.with_shape_held(&fit.law);
                let carried = fit_law(&fit.law, &lines, &samples.samples, &held);
                let error = held_out(&carried, &held);
                (carried, error)
            }
            Err(failed) => (Err(failed.clone()), None),
        };
        let refitted = fit_law(start, &lines, &samples.samples, &options);
        let as_fitted = of_a.fit.as_ref().ok().filter(|_| same_unit).map(|fit| on_fibres(fit, &kept));
        rows.push(CarriedRow {
            label: of_a.label(),
            as_fitted_r2: as_fitted.as_ref().and_then(|f| Some(f.misfit(&lines, &samples.samples).ok()?.r2())),
            shape_carried,
            shape_carried_held_out,
            refitted_held_out: held_out(&refitted, &options),
            refitted,
            as_fitted,
        });
        progress(rows.len() as f64 / count);
    }
    Some(Ok(Carried { rows, muscles, missing, samples: samples.len(), same_unit, fibres: found }))
}

/// A fit with the strengths of those of its fibres that the other subject has, too.
fn on_fibres(fit: &LawFit, kept: &[usize]) -> LawFit {
    let mut fit = fit.clone();
    fit.strengths.retain(|s| s.fibre.is_none_or(|f| kept.contains(&f)));
    for strength in &mut fit.strengths {
        strength.fibre = strength.fibre.and_then(|f| kept.iter().position(|k| *k == f));
    }
    fit
}

/// What a curve of [`Carried::profile`] is.
pub const CURVES: [&str; 3] = ["as fitted here", "shape carried", "refitted there"];

impl Carried {
    /// The row with the least error on skin left out among those with the shape carried, and among those refitted.
    pub fn nearest(&self) -> [Option<usize>; 2] {
        let of = |pick: fn(&CarriedRow) -> Option<&HeldOut>| {
            let rated = self.rows.iter().enumerate().filter_map(|(k, row)| Some((k, pick(row)?.error)));
            rated.filter(|r| r.1.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
        };
        [of(|row| row.shape_carried_held_out.as_ref()), of(|row| row.refitted_held_out.as_ref())]
    }

    /// The observed forces of B along or across a muscle of that id, with what a law says there: as fitted on A, with A's shape and strengths of
    /// B, and refitted on B ([`CURVES`]); a curve that could not be had is empty (Thesis Fig. 5.8 and 5.9). None where the muscle is not among
    /// those fitted, or stands upright on the plan.
    pub fn profile(&self, b: Seen<'_>, row: usize, muscle: &str, way: Way, part: Part) -> Option<Profile> {
        let row = self.rows.get(row)?;
        let of = self.fibres.get(self.muscles.iter().position(|m| m == muscle)?)?;
        let lines: Vec<Fibre> = self.fibres.iter().map(|f| f.fibre.clone()).collect();
        let fits = [row.as_fitted.as_ref(), row.shape_carried.as_ref().ok(), row.refitted.as_ref().ok()];
        let says = |fit: Option<&LawFit>, x: &Point3<f64>| fit.map_or_else(Vector3::zeros, |f| f.force_at(&lines, x));
        let models = fits.map(|fit| move |x: &Point3<f64>| says(fit, x));
        let models: Vec<Model<'_>> = models.iter().map(|m| m as Model<'_>).collect();
        let mut found = profile(b.face.mesh(), b.outcome, of, way, part, &models)?;
        for (curve, fit) in found.curves.iter_mut().zip(fits) {
            if fit.is_none() {
                curve.points.clear();
            }
        }
        Some(found)
    }
}

/// Names of projects that can be told apart: what the project calls itself, or its file; with its folder, or a number, where two are alike.
pub fn told_apart(projects: &[(&str, &Path)]) -> Vec<String> {
    let word = |path: Option<&std::ffi::OsStr>| path.map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    let own = |(name, path): &(&str, &Path)| match *name {
        "" => word(path.file_name()),
        name => name.to_owned(),
    };
    let names: Vec<String> = projects.iter().map(own).collect();
    let again = |k: usize| names.iter().enumerate().any(|(i, n)| i != k && *n == names[k]);
    let with_folder: Vec<String> = (0..names.len())
        .map(|k| match word(projects[k].1.parent().and_then(Path::file_name)) {
            folder if again(k) && !folder.is_empty() => format!("{} ({folder})", names[k]),
            _ => names[k].clone(),
        })
        .collect();
    let counted = |k: usize| match with_folder[..k].iter().filter(|n| **n == with_folder[k]).count() {
        0 => with_folder[k].clone(),
        before => format!("{} {}", with_folder[k], before + 1),
    };
    (0..names.len()).map(counted).collect()
}
