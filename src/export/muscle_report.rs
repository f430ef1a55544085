//! The report on one subject as one HTML file: what was found and how sure it is, with pictures, tables, settings, and the command that
//! makes it again.

use std::io::Cursor;

use image::RgbImage;

use super::document::Document;
use super::height_map;
use super::muscles::{Subject, activations_svg, error_text, ladder_svg, profiles, profiles_svg, title, with_interval};
use super::report::Circumstances;
use crate::draw::ColourMap;
use crate::draw::height_map::HeightMapError;
use crate::draw::numbers::{fixed, significant, with_error};
use crate::draw::robust_range::automatic_range;
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::fit::activations::Standing;
use crate::fit::{FailedFit, LawFit};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::fields::fields;
use crate::muscle_field::profiles::Part;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The height map.
    #[error(transparent)]
    HeightMap(#[from] HeightMapError),
    /// Letters of a picture.
    #[error(transparent)]
    Letters(#[from] crate::draw::svg::SvgError),
    /// A picture as PNG.
    #[error("a picture of the report cannot be written as PNG: {0}")]
    Png(#[from] image::ImageError),
}

/// The text of `report.html`.
///
/// # Errors
/// [`ReportError`].
pub fn report(subject: &Subject<'_>, circumstances: &Circumstances) -> Result<String, ReportError> {
    let (analysis, outcome, unit) = (subject.analysis, subject.outcome, subject.outcome.unit());
    let name = title(subject.project);
    let mut d = Document::new(
        &format!("{name}: the muscles behind the forces"),
        &format!("frontalis {}, face: {}", env!("CARGO_PKG_VERSION"), subject.face.name()),
    );
    findings(&mut d, subject);
    for warning in &outcome.warnings {
        d.warning(&warning.to_string());
    }
    for remark in &circumstances.remarks {
        d.warning(remark);
    }
    d.heading("The forces");
    d.paragraph(&format!("{}.", capital(&outcome.peak().in_words(unit))));
    d.picture(
        &png(&height_map::picture(subject.project, subject.face, outcome)?)?,
        "Length of the force on every vertex",
    );
    let pictures = maps(subject)?;
    d.picture(
        &png(&pictures)?,
        "Component along the fibres: observed, said by the best law, and what it leaves, on one range",
    );

    d.heading("Strengths of all muscles at once");
    d.drawing(
        &activations_svg(subject),
        "Non-negative strengths with 95 % intervals; an upper limit where none was found",
    );
    activation_table(&mut d, subject);

    d.heading("The laws side by side");
    laws(&mut d, subject);
    d.drawing(
        &profiles_svg(subject, &profiles(subject)),
        "Observed forces along and across each muscle, and each law's curve on the skin there",
    );
    smallest_set(&mut d, subject);
    if let Some(ladder) = subject.ladder {
        d.heading("How much model the field needs");
        d.drawing(&ladder_svg(ladder), "Held-out error of each rung");
        let rows: Vec<Vec<String>> = ladder
            .rungs
            .iter()
            .map(|r| {
                vec![
                    r.failed.as_ref().map_or_else(|| r.name.clone(), |why| format!("{} (no fit: {why})", r.name)),
                    r.step.to_owned(),
                    r.parameters.to_string(),
                    error_text(r.held_out.as_ref().map(|h| h.error)),
                    r.r2.map_or_else(|| "–".into(), |x| fixed(x, 3)),
                    significant(r.time_ms, 2),
                ]
            })
            .collect();
        d.table(&["Rung", "New", "Numbers", "Held-out error", "R²", "Time, ms"], &rows, ladder.recommended);
    }
    for (other, carried) in subject.carried {
        tried_on(&mut d, other, carried);
    }
    d.heading("How this was made");
    if !circumstances.command.is_empty() {
        d.paragraph("The command that makes it again:");
        d.verbatim(&circumstances.command);
    }
    let frames = &subject.project.frames;
    let frame = |which: &str, f: &Option<crate::project::FrameRef>| {
        let f = f.as_ref()?;
        Some(vec![which.to_owned(), f.path.clone(), format!("{} × {} px", f.width_px, f.height_px), f.sha256.clone()])
    };
    let rows: Vec<_> = [frame("first", &frames.first), frame("last", &frames.last)].into_iter().flatten().collect();
    d.table(&["Frame", "File", "Size", "SHA-256"], &rows, None);
    d.paragraph("Settings of the chain and of the fits:");
    d.verbatim(&serde_json::to_string_pretty(&subject.project.settings).unwrap_or_default());
    d.verbatim(&serde_json::to_string_pretty(&analysis.question).unwrap_or_default());
    Ok(d.finish())
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_uppercase().chain(chars).collect()).unwrap_or_default()
}

/// What a hurried reader must know.
fn findings(d: &mut Document, subject: &Subject<'_>) {
    let (analysis, unit) = (subject.analysis, subject.outcome.unit());
    if !analysis.explains {
        d.warning("No muscle explains the forces better than none does on patches of skin left out. What follows shows the muscle that comes nearest; it is no finding.");
    }
    if let Some(row) = analysis.best.map(|b| &analysis.laws[b]) {
        let missed = row.held_out.as_ref().map(|h| h.error * h.error);
        let words = missed.map_or_else(String::new, |m| {
            format!(
                " It misses {} % of the squared force on patches of skin that it has not seen.",
                fixed(100.0 * m.min(9.99), 0)
            )
        });
        d.paragraph(&format!("Best law: {}.{words}", row.label()));
    } else {
        d.warning("No law could be fitted to these forces.");
    }
    let units = analysis.activations.by_unit(&units(subject));
    let mut told: Vec<_> = units.into_iter().filter(|u| u.strength_n > 0.0).collect();
    told.sort_by(|a, b| b.strength_n.total_cmp(&a.strength_n));
    if !told.is_empty() {
        let words: Vec<String> = told
            .iter()
            .map(|u| format!("AU {}: {}", u.unit, with_interval(u.strength_n, [u.low_n, u.high_n], unit)))
            .collect();
        d.paragraph(&format!("Action units, strengths with 95 % intervals: {}.", words.join("; ")));
    }
    d.paragraph(match analysis.second_lobe_pays() {
        Some(true) => "The anatomical law's second lobe, opposite at the attachment, earns its parameters.",
        Some(false) => "The anatomical law's second lobe, opposite at the attachment, does not earn its parameters.",
        None => "Whether a second lobe earns its parameters cannot be said.",
    });
    d.paragraph("Errors of neighbouring forces are alike, which intervals, AIC and BIC do not know; the error on patches left out does not suffer from it.");
}

fn units(subject: &Subject<'_>) -> Vec<u8> {
    let muscles = subject.face.muscles();
    subject.analysis.fibres.iter().map(|f| muscles[f.muscle].action_unit).collect()
}

/// Observed, said and left, side by side on one range.
fn maps(subject: &Subject<'_>) -> Result<RgbImage, ReportError> {
    let (analysis, face) = (subject.analysis, subject.face);
    let fields = fields(subject.outcome, face, analysis, analysis.best.unwrap_or(0), Part::AlongFibre);
    let known = fields.observed.iter().zip(&fields.fitted).filter_map(|(x, fitted)| Some(((*x)?, *fitted)));
    let range = automatic_range(known, true);
    let positions = subject.outcome.first_from_eyes(face);
    let one = |values: &[Option<f64>], title: &str| {
        let options = SurfaceOptions {
            turns: vec![0.0],
            colour_map: ColourMap::CoolWarm,
            range,
            title: title.to_owned(),
            quantity: format!("along the fibres, {}", subject.outcome.unit()),
            ..SurfaceOptions::default()
        };
        surface_picture::render(&positions, face.mesh().triangles(), Some(values), &options)
    };
    let pictures = [one(&fields.observed, "Observed")?, one(&fields.said, "Best law")?, one(&fields.left, "Left")?];
    let (width, height) = (pictures.iter().map(RgbImage::width).sum(), pictures[0].height());
    let mut sheet = RgbImage::from_pixel(width, height, image::Rgb([255; 3]));
    let mut x = 0;
    for picture in &pictures {
        image::imageops::replace(&mut sheet, picture, x, 0);
        x += i64::from(picture.width());
    }
    Ok(sheet)
}

fn png(picture: &RgbImage) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

fn activation_table(d: &mut Document, subject: &Subject<'_>) {
    let analysis = subject.analysis;
    let muscles = subject.face.muscles();
    let rows: Vec<Vec<String>> = analysis
        .activations
        .muscles
        .iter()
        .zip(&analysis.fibres)
        .map(|(a, f)| {
            let [strength, low, high] = [a.strength_n, a.low_n, a.high_n].map(|x| significant(x, 3));
            let words = match a.standing {
                Standing::Active => [strength, low, high, String::new()],
                Standing::AtZero => ["0".into(), "0".into(), high, String::new()],
                Standing::Collinear => ["–".into(), "–".into(), "–".into(), "not told from others".into()],
                Standing::Silent => ["–".into(), "–".into(), "–".into(), "no measured force in reach".into()],
            };
            std::iter::once(muscle_name(&muscles[f.muscle])).chain(words).collect()
        })
        .collect();
    let unit = subject.outcome.unit();
    d.table(&["Muscle", &format!("Strength, {unit}"), "from", "to", ""], &rows, None);
    let explained = fixed(100.0 * analysis.activations.r_squared, 0);
    d.paragraph(&format!(
        "Together they explain {explained} % of the squared force of {} vertices.",
        analysis.samples.len()
    ));
    for c in &analysis.activations.confusable {
        let name = |f: usize| muscle_name(&muscles[analysis.fibres[f].muscle]);
        let others: Vec<String> = c.with.iter().map(|(f, _)| name(*f)).collect();
        d.paragraph(&format!("{} is hard to tell from {}.", capital(&name(c.muscle)), others.join("; ")));
    }
}

fn laws(d: &mut Document, subject: &Subject<'_>) {
    let analysis = subject.analysis;
    let names: Vec<String> =
        analysis.set.iter().map(|&f| muscle_name(&subject.face.muscles()[analysis.fibres[f].muscle])).collect();
    d.paragraph(&format!("All laws were fitted to the same forces with the same muscles: {}.", names.join("; ")));
    let of_best = analysis.best.and_then(|b| analysis.laws[b].held_out.as_ref());
    let rows: Vec<Vec<String>> = analysis
        .laws
        .iter()
        .map(|row| {
            let error = error_text(row.held_out.as_ref().map(|h| h.error));
            let excess = row.held_out.as_ref().zip(of_best).map(|(h, best)| h.excess_over(best));
            let excess =
                excess.filter(|[e, _]| *e > 0.0 && *e < 10.0).map_or("–".into(), |[e, s]| with_error(e, Some(s)));
            let numbers = fit_numbers(&row.fit);
            [row.label(), error, excess].into_iter().chain(numbers).collect()
        })
        .collect();
    let residual = format!("Residual, {}", subject.outcome.unit());
    let head =
        ["Law", "Held-out error", "Worse than the best by", "R²", &residual, "BIC", "Evaluations", "Time, ms", "Ended"];
    d.table(&head, &rows, analysis.best);
    let mut rows = Vec::new();
    for (row, fit) in analysis.laws.iter().filter_map(|r| Some((r, r.fit.as_ref().ok()?))) {
        for p in &fit.parameters {
            let note = match (p.at_bound, p.identified) {
                (true, _) => "at its limit",
                (_, false) => "not identified",
                _ => "",
            };
            let numbers = [p.value, p.low, p.high].map(|x| significant(x, 3));
            rows.push([row.label(), p.label.to_owned()].into_iter().chain(numbers).chain([note.to_owned()]).collect());
        }
    }
    d.table(&["Law", "Parameter", "Value", "from", "to", ""], &rows, None);
}

/// R², residual, BIC, evaluations, time, and why it ended.
fn fit_numbers(fit: &Result<LawFit, FailedFit>) -> [String; 6] {
    match fit {
        Ok(fit) => [
            fixed(fit.r2, 3),
            significant(fit.rms, 3),
            fixed(fit.bic, 1),
            fit.evaluations.to_string(),
            significant(fit.time_ms, 2),
            in_words(&fit.ended),
        ],
        Err(failed) => {
            let dash = || "–".to_owned();
            let spent = [failed.evaluations.to_string(), significant(failed.time_ms, 2)];
            let [evaluations, time] = spent;
            [dash(), dash(), dash(), evaluations, time, failed.why.to_string()]
        }
    }
}

/// "gradient" and the like, as `fit.json` says it.
fn in_words(ended: &impl serde::Serialize) -> String {
    let value = serde_json::to_value(ended).unwrap_or_default();
    value.as_str().map_or_else(|| value.to_string(), |s| s.replace('_', " "))
}

fn smallest_set(d: &mut Document, subject: &Subject<'_>) {
    let analysis = subject.analysis;
    let selection = &analysis.selection;
    let name = |f: usize| muscle_name(&subject.face.muscles()[analysis.fibres[f].muscle]);
    d.heading("The smallest set of muscles");
    let least = selection.path.iter().map(|s| s.extended_bic).fold(f64::INFINITY, f64::min);
    let rows: Vec<Vec<String>> = selection
        .path
        .iter()
        .map(|s| {
            vec![
                s.added.map_or_else(|| "(none)".into(), name),
                s.muscles.to_string(),
                error_text(Some(s.held_out)),
                fixed(s.extended_bic - least, 1),
                fixed(s.r_squared, 3),
            ]
        })
        .collect();
    d.table(&["Muscle added", "Muscles", "Held-out error", "ΔBIC", "R²"], &rows, Some(selection.taken));
    d.paragraph(&format!("Tested on {} patches of skin left out in turn.", selection.patches));
}

fn tried_on(d: &mut Document, other: &str, carried: &crate::muscle_field::subjects::Carried) {
    d.heading(&format!("The laws tried on {other}"));
    d.paragraph(&format!(
        "{} vertices. As fitted: shape and strengths of this subject. Shape carried: strengths fitted there. Refitted: all fitted there.",
        carried.samples
    ));
    if !carried.missing.is_empty() {
        d.warning(&format!("That face lacks {}; they were left out.", carried.missing.join(", ")));
    }
    let r2 = |fit: &Result<LawFit, FailedFit>| fit.as_ref().map_or_else(|_| "–".into(), |f| fixed(f.r2, 3));
    let error = |held_out: &Option<crate::muscle_field::HeldOut>| error_text(held_out.as_ref().map(|h| h.error));
    let rows: Vec<Vec<String>> = carried
        .rows
        .iter()
        .map(|row| {
            vec![
                row.label.clone(),
                row.as_fitted_r2.map_or_else(|| "–".into(), |x| fixed(x.max(-9.99), 3)),
                r2(&row.shape_carried),
                error(&row.shape_carried_held_out),
                r2(&row.refitted),
                error(&row.refitted_held_out),
            ]
        })
        .collect();
    let head = ["Law", "R² as fitted", "R², shape carried", "held-out error", "R², refitted", "held-out error"];
    d.table(&head, &rows, None);
}
