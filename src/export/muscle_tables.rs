//! The tables on the muscles, in words: the same for the window and for the report.

use crate::draw::numbers::{fixed, significant, with_error};
use crate::face::FaceModel;
use crate::fit::{FailedFit, HeldOut, LawFit};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::subjects::{Carried, CarriedRow};
use crate::muscle_field::{Analysis, Ladder};

/// A table: the first column is words, the others are numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Titles, each with what it means.
    pub head: Vec<(&'static str, &'static str)>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// The row to point out.
    pub best: Option<usize>,
}

/// What is not known.
const UNKNOWN: &str = "–";
const HELD_OUT: (&str, &str) = (
    "Held-out error",
    "Root of the share of the squared force that is missed on patches left out; 1 is as good as no muscle at all",
);
const R2: (&str, &str) = ("R²", "Share of the squared force explained, about zero, weighted by standard errors");

/// The laws side by side; forces in `unit`.
pub fn laws(analysis: &Analysis, unit: &str) -> Table {
    let rows = &analysis.laws;
    let least = rows.iter().filter_map(|r| r.fit.as_ref().ok()).map(|f| f.bic).fold(f64::INFINITY, f64::min);
    let of_best = analysis.best.and_then(|b| rows[b].held_out.as_ref());
    let row = |row: &crate::muscle_field::LawRow| {
        let held_out = row.held_out.as_ref();
        let excess = held_out.zip(of_best).map(|(h, best)| h.excess_over(best)).filter(|[e, _]| *e > 0.0);
        let excess = match excess {
            Some([e, sigma]) if e < 10.0 => with_error(e, Some(sigma)),
            Some(_) => "more than 10".to_owned(),
            None => UNKNOWN.to_owned(),
        };
        let mut cells = vec![row.label(), error(held_out.map(|h| h.error)), excess];
        cells.extend(fitted(&row.fit, least, unit));
        cells
    };
    Table {
        head: vec![
            ("Law", "All are fitted to the same forces of the same muscles"),
            HELD_OUT,
            (
                "Worse than the best by",
                "In squared held-out error, with the standard error of the difference over patches",
            ),
            R2,
            ("Residual", "Root mean square length of what is left"),
            ("ΔBIC", "Schwarz's criterion above the lowest; it takes errors of neighbours for independent"),
            ("Numbers", "Shape parameters and strengths"),
            ("Evaluations", "Of the residual, over all starts and readings"),
            ("Time", "Of the fit"),
            ("Ended", "Why the best start ended, or why there is no fit"),
        ],
        rows: rows.iter().map(row).collect(),
        best: analysis.best,
    }
}

fn fitted(fit: &Result<LawFit, FailedFit>, least_bic: f64, unit: &str) -> [String; 7] {
    let time = |ms: f64| format!("{} ms", significant(ms, 2));
    match fit {
        Ok(fit) => [
            fixed(fit.r2, 3),
            format!("{} {unit}", significant(fit.rms, 3)),
            fixed(fit.bic - least_bic, 1),
            numbers(fit).to_string(),
            fit.evaluations.to_string(),
            time(fit.time_ms),
            words_of(&fit.ended),
        ],
        Err(failed) => {
            let none = || UNKNOWN.to_owned();
            let [evaluations, spent, why] =
                [failed.evaluations.to_string(), time(failed.time_ms), format!("no fit: {}", failed.why)];
            [none(), none(), none(), none(), evaluations, spent, why]
        }
    }
}

/// Numbers fitted.
fn numbers(fit: &LawFit) -> usize {
    fit.parameters.iter().filter(|p| p.fitted).count() + fit.strengths.len()
}

/// A word as `fit.json` says it, with blanks.
fn words_of(ended: &impl serde::Serialize) -> String {
    let value = serde_json::to_value(ended).unwrap_or_default();
    value.as_str().map_or_else(|| value.to_string(), |s| s.replace('_', " "))
}

/// The way to the smallest set.
pub fn smallest_set(analysis: &Analysis, face: &FaceModel) -> Table {
    let path = &analysis.selection.path;
    let least = path.iter().map(|s| s.extended_bic).fold(f64::INFINITY, f64::min);
    let name = |f: usize| muscle_name(&face.muscles()[analysis.fibres[f].muscle]);
    let rows = path.iter().map(|step| {
        vec![
            step.added.map_or_else(|| "(none)".to_owned(), name),
            step.muscles.to_string(),
            error(Some(step.held_out)),
            fixed(step.extended_bic - least, 1),
            fixed(step.r_squared, 3),
        ]
    });
    Table {
        head: vec![
            ("Muscle added", "The one that lowers the residual most"),
            ("Muscles", "In the set"),
            HELD_OUT,
            ("ΔBIC", "Extended Schwarz criterion, with what is paid for having chosen among many, above the lowest"),
            R2,
        ],
        rows: rows.collect(),
        best: Some(analysis.selection.taken),
    }
}

/// The ladder of models.
pub fn ladder(ladder: &Ladder) -> Table {
    let rows = ladder.rungs.iter().map(|rung| {
        vec![
            rung.failed.as_ref().map_or_else(|| rung.name.clone(), |why| format!("{} (no fit: {why})", rung.name)),
            rung.step.to_owned(),
            rung.parameters.to_string(),
            error(rung.held_out.as_ref().map(|h| h.error)),
            rung.r2.map_or_else(|| UNKNOWN.to_owned(), |r2| fixed(r2, 3)),
            format!("{} ms", significant(rung.time_ms, 2)),
        ]
    });
    Table {
        head: vec![
            ("Rung", "From one muscle with one number upwards"),
            ("New", "What changes on this rung"),
            ("Numbers", "Fitted"),
            (
                HELD_OUT.0,
                "Root of the share of the squared force missed on patches left out; with another skin, of the forces that it gives",
            ),
            R2,
            ("Time", "Of one fit"),
        ],
        rows: rows.collect(),
        best: ladder.recommended,
    }
}

/// The laws tried on another subject; the row marked is the nearest with its shape carried.
pub fn carried(carried: &Carried) -> Table {
    let r2 = |fit: &Result<LawFit, FailedFit>| fit.as_ref().map_or_else(|_| "no fit".to_owned(), |f| share(f.r2));
    let columns = [
        errors(carried, |row| row.shape_carried_held_out.as_ref()),
        errors(carried, |row| row.refitted_held_out.as_ref()),
    ];
    let rows = carried.rows.iter().enumerate().map(|(k, row)| {
        vec![
            row.label.clone(),
            row.as_fitted_r2.map_or_else(|| UNKNOWN.to_owned(), share),
            r2(&row.shape_carried),
            columns[0][k].clone(),
            r2(&row.refitted),
            columns[1][k].clone(),
        ]
    });
    Table {
        head: vec![
            ("Law", "All with the muscles of this subject's fits, on the other's forces"),
            (
                "R² as fitted",
                "Share of the squared force explained with this subject's shape and strengths; below 0 no muscle at all would be nearer",
            ),
            ("R² carried", "With this subject's shape, and strengths fitted there"),
            (
                "Held-out, carried",
                "Error on patches left out there; 1 is as good as no muscle at all. In brackets its place among the laws",
            ),
            ("R² refitted", "With shape and strengths fitted there"),
            (
                "Held-out, refitted",
                "Error on patches left out there, fitted anew each time. In brackets its place among the laws",
            ),
        ],
        rows: rows.collect(),
        best: carried.nearest()[0],
    }
}

/// "0.512 (1)": errors with their places among the laws.
fn errors(carried: &Carried, of: fn(&CarriedRow) -> Option<&HeldOut>) -> Vec<String> {
    let all: Vec<Option<f64>> = carried.rows.iter().map(|row| of(row).map(|h| h.error)).collect();
    let place = |own: f64| 1 + all.iter().flatten().filter(|e| **e < own).count();
    all.iter().map(|e| e.map_or_else(|| error(None), |own| format!("{} ({})", error(Some(own)), place(own)))).collect()
}

/// A share explained; what is ten times worse than no muscle is as bad as a million times.
fn share(r2: f64) -> String {
    if r2 < -9.99 { "below −10".to_owned() } else { fixed(r2, 3) }
}

/// What is to be said of the laws on another subject: which is nearest, what carrying its shape costs, what could not be fitted, what is missing.
pub fn carried_in_words(carried: &Carried) -> Vec<String> {
    let mut words = Vec::new();
    let [shape, whole] = carried.nearest();
    let named = |k: usize, held_out: &Option<HeldOut>| {
        format!("{} ({})", carried.rows[k].label, error(held_out.as_ref().map(|h| h.error)))
    };
    let of_shape = shape.map(|k| named(k, &carried.rows[k].shape_carried_held_out));
    let of_whole = whole.map(|k| named(k, &carried.rows[k].refitted_held_out));
    words.push(match (of_shape, of_whole) {
        (Some(shape), Some(whole)) => {
            format!("Least error on skin left out: with the shape carried {shape}, refitted {whole}.")
        }
        (Some(shape), None) => format!("Least error on skin left out, with the shape carried: {shape}."),
        (None, Some(whole)) => format!("Least error on skin left out, refitted: {whole}."),
        (None, None) => "No law could be tested on skin left out.".to_owned(),
    });
    if !carried.same_unit {
        words.push("Only one of the two has a measured scale: strengths in N say nothing of relative forces, so no law is tried as fitted.".to_owned());
    }
    if !carried.missing.is_empty() {
        words.push(format!("That face lacks {}; they were left out.", carried.missing.join(", ")));
    }
    for row in &carried.rows {
        let carried =
            row.shape_carried.as_ref().err().map(|f| format!("{}, shape carried: no fit: {}.", row.label, f.why));
        let refitted = row.refitted.as_ref().err().map(|f| format!("{}, refitted: no fit: {}.", row.label, f.why));
        words.extend(carried.into_iter().chain(refitted));
    }
    words
}

/// An error of ten is as far from the truth as one of a million.
pub(super) fn error(error: Option<f64>) -> String {
    match error {
        Some(error) if error < 10.0 => fixed(error, 3),
        Some(_) => "above 10".to_owned(),
        None => UNKNOWN.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle_field::Rung;

    #[test]
    fn what_failed_and_what_is_far_off_are_said_in_words() {
        assert_eq!([error(Some(0.12345)), error(Some(1e15)), error(None)], ["0.123", "above 10", "–"]);
        let rung = |failed: Option<&str>| Rung {
            name: "Koch".into(),
            step: "law",
            parameters: 6,
            r2: None,
            held_out: None,
            time_ms: 0.25,
            failed: failed.map(str::to_owned),
        };
        let table =
            ladder(&Ladder { rungs: vec![rung(None), rung(Some("no samples"))], recommended: Some(0), best: None });
        assert_eq!(table.rows[0], ["Koch", "law", "6", "–", "–", "0.25 ms"]);
        assert_eq!(table.rows[1][0], "Koch (no fit: no samples)");
        assert!(table.rows.iter().all(|r| r.len() == table.head.len()));
    }
}
