//! The report on one subject as one HTML file: what was found and how sure it is, with pictures, tables, settings, and the command that
//! makes it again.

use image::RgbImage;

use super::document::Document;
use super::height_map;
use super::muscle_tables;
use super::muscles::{self, Subject, activations_svg, ladder_svg, profiles, profiles_svg, title, with_interval};
use super::png;
use super::replay::{self, replay_csv, replay_svg};
use super::replay_picture;
use super::report::Circumstances;
use super::subjects;
use crate::draw::ColourMap;
use crate::draw::height_map::HeightMapError;
use crate::draw::numbers::{fixed, significant};
use crate::draw::robust_range::automatic_range;
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::draw::svg;
use crate::draw::words::{capital, sentence};
use crate::fit::activations::Standing;
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::fields::fields;
use crate::muscle_field::profiles::Part;
use crate::muscle_field::replay::{Replay, pull_of_muscles};
use crate::muscle_field::subjects::Other;

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

/// All files on the muscles: `fit.json`, `activations.csv`, `profiles.csv`, `profiles.svg`, `profiles.png`, `fields.csv`, `report.html`; with other
/// subjects `subject_laws.csv` and `subject_profiles.csv`, `.svg` and `.png`, and where their forces can be put together `subjects.csv`, `subject_maps.csv` and `subject_maps.png`; and where a point is measured
/// `replay.csv`, `replay.svg` and, given the last frame, `replay.png`.
///
/// # Errors
/// [`ReportError`].
pub fn files(
    subject: &Subject<'_>,
    circumstances: &Circumstances,
) -> Result<Vec<(&'static str, Vec<u8>)>, ReportError> {
    let cut = profiles(subject);
    let drawn = profiles_svg(subject, &cut);
    let replay = replayed(subject);
    let across = subjects::picture(subject)?;
    let mut files = vec![
        ("fit.json", muscles::fit_json(subject, circumstances).into_bytes()),
        ("activations.csv", muscles::activations(subject).into_bytes()),
        ("profiles.csv", muscles::profiles_csv(subject, &cut).into_bytes()),
        ("profiles.png", png(&svg::paint(&drawn, 1.0)?)?),
        ("profiles.svg", drawn.into_bytes()),
        ("fields.csv", muscles::fields_csv(subject).into_bytes()),
        ("report.html", report(subject, circumstances, replay.as_ref(), across.as_ref())?.into_bytes()),
    ];
    if !subject.others.is_empty() {
        files.push(("subject_laws.csv", subjects::laws_csv(subject.others).into_bytes()));
        files.push(("subject_profiles.csv", subjects::profiles_csv(subject.others).into_bytes()));
        let drawn = subjects::profiles_svg(subject.others);
        files.push(("subject_profiles.png", png(&svg::paint(&drawn, 1.0)?)?));
        files.push(("subject_profiles.svg", drawn.into_bytes()));
    }
    if let Some(csv) = subjects::csv(subject) {
        files.push(("subjects.csv", csv.into_bytes()));
    }
    if let (Some(csv), Some(drawn)) = (subjects::maps_csv(subject), &across) {
        files.push(("subject_maps.csv", csv.into_bytes()));
        files.push(("subject_maps.png", png(drawn)?));
    }
    if let Some(replay) = &replay {
        files.push(("replay.csv", replay_csv(subject.outcome, replay).into_bytes()));
        files.push(("replay.svg", replay_svg(subject.face, subject.outcome, replay).into_bytes()));
        if let Some(last_frame) = subject.last_frame {
            let drawn = replay_picture::picture(last_frame, subject.face, subject.outcome, replay)?;
            files.push(("replay.png", png(&drawn)?));
        }
    }
    Ok(files)
}

/// The muscles that were found at work again, where a point was seen to compare them with.
pub fn replayed(subject: &Subject<'_>) -> Option<Replay> {
    let Subject { project, face, outcome, analysis, .. } = *subject;
    Replay::new(project, face, outcome, pull_of_muscles(face, outcome, analysis)).ok()
}

/// The text of `report.html`; `drawn` are the maps across subjects.
///
/// # Errors
/// [`ReportError`].
pub fn report(
    subject: &Subject<'_>,
    circumstances: &Circumstances,
    replay: Option<&Replay>,
    drawn: Option<&RgbImage>,
) -> Result<String, ReportError> {
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
    d.paragraph(&sentence(&outcome.peak().in_words(unit)));
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
    if let Some(replay) = replay {
        d.heading("Simulated against seen");
        d.paragraph(&replay::in_words(replay));
        d.drawing(
            &replay_svg(subject.face, outcome, replay),
            "Each measured point where it was seen, and where the muscles bring it when the skin of the first frame gives way to them",
        );
    }
    if let Some(ladder) = subject.ladder {
        d.heading("How much model the field needs");
        d.drawing(&ladder_svg(ladder), "Held-out error of each rung");
        d.table(&muscle_tables::ladder(ladder));
    }
    for other in subject.others {
        tried_on(&mut d, other);
    }
    if !subject.others.is_empty() {
        across(&mut d, subject, drawn)?;
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
    d.plain_table(&["Frame", "File", "Size", "SHA-256"], &rows);
    d.paragraph("Settings of the chain and of the fits:");
    d.verbatim(&serde_json::to_string_pretty(&subject.project.settings).unwrap_or_default());
    d.verbatim(&serde_json::to_string_pretty(&analysis.question).unwrap_or_default());
    Ok(d.finish())
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
            quantity: format!("along fibre, {}", subject.outcome.unit()),
            ..SurfaceOptions::default()
        };
        surface_picture::render(&positions, face.mesh().triangles(), Some(values), &options)
    };
    Ok(subjects::sheet(&[vec![
        one(&fields.observed, "Observed")?,
        one(&fields.said, "Best law")?,
        one(&fields.left, "Left")?,
    ]]))
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
    d.plain_table(&["Muscle", &format!("Strength, {unit}"), "from", "to", ""], &rows);
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
    d.table(&muscle_tables::laws(analysis, subject.outcome.unit()));
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
    d.plain_table(&["Law", "Parameter", "Value", "from", "to", ""], &rows);
}

fn smallest_set(d: &mut Document, subject: &Subject<'_>) {
    let analysis = subject.analysis;
    d.heading("The smallest set of muscles");
    d.table(&muscle_tables::smallest_set(analysis, subject.face));
    d.paragraph(&format!("Tested on {} patches of skin left out in turn.", analysis.selection.patches));
}

fn tried_on(d: &mut Document, other: &Other) {
    d.heading(&format!("The laws tried on {}", other.name));
    d.paragraph(&format!(
        "{} vertices. As fitted: shape and strengths of this subject. Carried: its shape, strengths fitted there. Refitted: all fitted there.",
        other.carried.samples
    ));
    d.table(&muscle_tables::carried(&other.carried));
    for words in muscle_tables::carried_in_words(&other.carried) {
        d.paragraph(&words);
    }
    let drawn = subjects::profiles_svg(std::slice::from_ref(other));
    d.drawing(&drawn, "Forces measured there, and the law that is nearest there with its shape carried");
}

/// Mean, spread and differences, or why there are none.
fn across(d: &mut Document, subject: &Subject<'_>, drawn: Option<&RgbImage>) -> Result<(), ReportError> {
    d.heading("Across subjects");
    match (subjects::together(subject, Part::Magnitude), drawn) {
        (Ok(maps), Some(drawn)) => {
            d.paragraph(&subjects::in_words(subject, &maps));
            d.picture(&png(drawn)?, "Length of the force and its component along the fibres: mean, standard deviation, and this subject less the others");
        }
        (Err(why), _) => d.warning(&sentence(&why.to_string())),
        (Ok(_), None) => {}
    }
    Ok(())
}
