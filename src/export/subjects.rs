//! Several subjects as files: the force of each on every vertex, and mean, spread and difference on the face that they share.

use std::fmt::Write as _;

use image::RgbImage;
use serde::Serialize;

use super::csv::{numbers, quoted, rounded};
use super::muscles::{Subject, curve_rows, in_pairs, line, observed_rows, profile_chart, title};
use crate::draw::ColourMap;
use crate::draw::line_chart::{LineChart, Style};
use crate::draw::robust_range::automatic_range;
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::draw::svg::SvgError;
use crate::fit::{FailedFit, HeldOut, LawFit};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::maps::{Maps, MapsError, of_subjects};
use crate::muscle_field::profiles::{Curve, Part, Profile, Way};
use crate::muscle_field::subjects::{CURVES, Other, Seen};

/// Header of [`csv`].
pub const SUBJECTS_HEADER: &str = "vertex,subject,force_N,along_fibre_N,sigma_N,less_force_N,less_along_fibre_N";

/// Header of [`maps_csv`].
pub const SUBJECT_MAPS_HEADER: &str =
    "vertex,subjects,mean_force_N,spread_force_N,mean_along_fibre_N,spread_along_fibre_N";

/// Header of [`laws_csv`].
pub const SUBJECT_LAWS_HEADER: &str = "subject,law,r2_as_fitted,r2_carried,held_out_carried,r2_refitted,held_out_refitted,why_not_carried,why_not_refitted";

/// Header of [`profiles_csv`].
pub const SUBJECT_PROFILES_HEADER: &str = "subject,law,muscle,way,source,vertex,at_mm,along_fibre_N,sigma_N";

/// Differences that are drawn at most; the table has all.
const DRAWN: usize = 3;

/// What `fit.json` says of the maps.
#[derive(Serialize)]
pub(super) struct Across {
    subjects: usize,
    vertices_of_all: usize,
    why_not: Option<String>,
}

impl Across {
    pub(super) fn of(subject: &Subject<'_>) -> Self {
        let maps = together(subject, Part::Magnitude);
        Self {
            subjects: subject.others.len() + 1,
            vertices_of_all: maps.as_ref().map_or(0, Maps::shared),
            why_not: maps.err().map(|why| why.to_string()),
        }
    }
}

/// This subject first, then the others.
fn seen<'a>(subject: &Subject<'a>) -> Vec<Seen<'a>> {
    let own = Seen { name: title(subject.project), face: subject.face, outcome: subject.outcome };
    std::iter::once(own).chain(subject.others.iter().map(|o| o.seen())).collect()
}

/// The forces of all subjects put together, as the question of the fits reads them.
///
/// # Errors
/// [`MapsError`].
pub fn together(subject: &Subject<'_>, part: Part) -> Result<Maps, MapsError> {
    of_subjects(&seen(subject), &subject.analysis.question, part)
}

/// How many subjects and vertices the maps speak of, and how much the subjects scatter.
pub fn in_words(subject: &Subject<'_>, maps: &Maps) -> String {
    let square = |values: &[Option<f64>]| values.iter().flatten().map(|x| x * x).sum::<f64>();
    let share = (square(&maps.spread) / square(&maps.mean)).sqrt();
    let scatter = if share.is_finite() {
        format!(" Their forces scatter by {:.0} % of their mean, root mean square.", 100.0 * share)
    } else {
        String::new()
    };
    format!(
        "{} subjects, {} vertices that count on all of them; the others are grey.{scatter}",
        subject.others.len() + 1,
        maps.shared()
    )
}

/// `subjects.csv`: a row a subject and vertex that counts on it, this subject first; `less` is this subject's force less that one's, where the vertex
/// counts on all. None without other subjects, and where forces cannot be put together.
pub fn csv(subject: &Subject<'_>) -> Option<String> {
    let (length, along) = (together(subject, Part::Magnitude).ok()?, together(subject, Part::AlongFibre).ok()?);
    let mut text = format!("{SUBJECTS_HEADER}\n");
    for (k, one) in seen(subject).iter().enumerate() {
        let (less, less_along) = (length.difference(k), along.difference(k));
        let known = length.values[k].iter().enumerate().filter_map(|(v, x)| Some((v, (*x)?)));
        for (v, force) in known {
            let or_nan = |list: &[Option<f64>]| list.get(v).copied().flatten().filter(|_| k > 0).unwrap_or(f64::NAN);
            let sigma = one.outcome.field.sigma.get(v).copied().unwrap_or(f64::NAN);
            let own = along.values[k].get(v).copied().flatten().unwrap_or(f64::NAN);
            // Writing to a string cannot fail.
            let _ = write!(text, "{v},{}", quoted(one.name));
            numbers(&mut text, [force, own, sigma, or_nan(&less), or_nan(&less_along)].into_iter());
            text.push('\n');
        }
    }
    Some(text)
}

/// `subject_maps.csv`: a row a vertex that counts on all subjects; along the fibres `NaN` where no muscle runs on one of them.
pub fn maps_csv(subject: &Subject<'_>) -> Option<String> {
    let (length, along) = (together(subject, Part::Magnitude).ok()?, together(subject, Part::AlongFibre).ok()?);
    let mut text = format!("{SUBJECT_MAPS_HEADER}\n");
    for (v, mean) in length.mean.iter().enumerate().filter_map(|(v, x)| Some((v, (*x)?))) {
        let or_nan = |list: &[Option<f64>]| list.get(v).copied().flatten().unwrap_or(f64::NAN);
        let _ = write!(text, "{v},{}", length.values.len());
        let row = [mean, or_nan(&length.spread), or_nan(&along.mean), or_nan(&along.spread)];
        numbers(&mut text, row.into_iter());
        text.push('\n');
    }
    Some(text)
}

/// `subject_laws.csv`: a row a subject and law; `NaN` where there is no number, with the reason at the end where a fit failed.
pub fn laws_csv(others: &[Other]) -> String {
    let mut text = format!("{SUBJECT_LAWS_HEADER}\n");
    let r2 = |fit: &Result<LawFit, FailedFit>| fit.as_ref().map_or(f64::NAN, |f| f.r2);
    let error = |held_out: &Option<HeldOut>| held_out.as_ref().map_or(f64::NAN, |h| h.error);
    let why =
        |fit: &Result<LawFit, FailedFit>| fit.as_ref().err().map_or_else(String::new, |f| quoted(&f.why.to_string()));
    for (other, row) in others.iter().flat_map(|o| o.carried.rows.iter().map(move |row| (o, row))) {
        // Writing to a string cannot fail.
        let _ = write!(text, "{},{}", quoted(&other.name), quoted(&row.label));
        let carried =
            [row.as_fitted_r2.unwrap_or(f64::NAN), r2(&row.shape_carried), error(&row.shape_carried_held_out)];
        let refitted = [r2(&row.refitted), error(&row.refitted_held_out)];
        numbers(&mut text, carried.into_iter().chain(refitted));
        let _ = writeln!(text, ",{},{}", why(&row.shape_carried), why(&row.refitted));
    }
    text
}

/// The profiles of a law on another subject along and across every muscle, with the muscle's id.
fn profiles(other: &Other, law: usize) -> Vec<(&str, Profile)> {
    let cut = |id: &'_ String, way| other.carried.profile(other.seen(), law, id, way, Part::AlongFibre);
    let of = |id| Way::ALL.into_iter().filter_map(move |way| Some((String::as_str(id), cut(id, way)?)));
    other.carried.muscles.iter().flat_map(of).collect()
}

/// Points of a curve nearer to each other are left out of a table, mm: the mesh is no finer than twice that.
const CURVE_STEP_MM: f64 = 2.0;

/// A curve with five significant digits, a point every 2 mm at least as far as it goes on, and its last one.
fn thinned(curve: &Curve) -> Curve {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (k, point) in curve.points.iter().enumerate() {
        let far = points.last().is_none_or(|last| point[0] - last[0] >= CURVE_STEP_MM || !last[1].is_finite());
        if far || !point[1].is_finite() || k + 1 == curve.points.len() {
            points.push(*point);
        }
    }
    Curve { points: points.into_iter().map(|p| p.map(rounded)).collect() }
}

/// `subject_profiles.csv`: as `profiles.csv`, on the other subjects, curves thinned; `source` is `observed` or `not_fitted`, without a law, or one of [`CURVES`] of
/// a law.
pub fn profiles_csv(others: &[Other]) -> String {
    let mut text = format!("{SUBJECT_PROFILES_HEADER}\n");
    let names = CURVES.map(str::to_owned);
    for other in others {
        for (law, row) in other.carried.rows.iter().enumerate() {
            for (id, mut profile) in profiles(other, law) {
                for observed in &mut profile.observed {
                    for number in [&mut observed.at_mm, &mut observed.value, &mut observed.sigma] {
                        *number = rounded(*number);
                    }
                }
                profile.curves = profile.curves.iter().map(thinned).collect();
                let begin = |law: &str| {
                    format!("{},{}", [other.name.as_str(), law, id].map(quoted).join(","), profile.way.name())
                };
                if law == 0 {
                    observed_rows(&mut text, &begin(""), &profile);
                }
                curve_rows(&mut text, &begin(&row.label), &profile, &names);
            }
        }
    }
    text
}

/// The forces measured on other subjects along and across every muscle, with the three curves of the law that is nearest there with its shape
/// carried (Thesis Fig. 5.8 and 5.9); subjects on which no law could be tried on skin left out are left out.
pub fn profiles_svg(others: &[Other]) -> String {
    let nearest = others.iter().filter_map(|other| Some((other, other.carried.nearest()[0]?)));
    let mut charts = Vec::new();
    let mut laws = Vec::new();
    for (other, law) in nearest {
        laws.extend(other.carried.rows.get(law).map(|row| format!("{} on {}", row.label, other.name)));
        charts.extend(profiles(other, law).iter().map(|(id, profile)| chart(other, id, profile)));
    }
    let below = format!("the nearest law with its shape carried: {}; positive pulls to the bone", laws.join("; "));
    in_pairs(&charts, "Laws carried to other subjects", &below)
}

fn chart(other: &Other, id: &str, profile: &Profile) -> LineChart {
    let muscle = other.face.muscles().iter().find(|m| m.id == id).map_or_else(|| id.to_owned(), muscle_name);
    let there = CURVES.iter().zip(&profile.curves).enumerate().filter(|(_, (_, curve))| !curve.points.is_empty());
    let series = there
        .map(|(k, (name, curve))| line((*name).to_owned(), k, if k == 1 { Style::Line } else { Style::Dashed }, curve));
    let drawn = profile_chart(&muscle, other.outcome.unit(), profile, series.collect());
    LineChart { title: format!("{}: {}", other.name, drawn.title), ..drawn }
}

/// Mean, spread and the first differences on this subject's face: lengths above, components along the fibres below.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted. None where [`together`] has none.
pub fn picture(subject: &Subject<'_>) -> Result<Option<RgbImage>, SvgError> {
    let rows = [(Part::Magnitude, "length"), (Part::AlongFibre, "along fibre")];
    let mut drawn = Vec::new();
    for (part, word) in rows {
        match together(subject, part) {
            Ok(maps) => drawn.push(row(subject, &maps, part, word)?),
            Err(_) => return Ok(None),
        }
    }
    Ok(Some(sheet(&drawn)))
}

fn row(subject: &Subject<'_>, maps: &Maps, part: Part, word: &str) -> Result<Vec<RgbImage>, SvgError> {
    let positions = subject.outcome.first_from_eyes(subject.face);
    let one = |values: &[Option<f64>], title: String, signed: bool, range: [f64; 2]| {
        let options = SurfaceOptions {
            turns: vec![0.0],
            colour_map: if signed { ColourMap::CoolWarm } else { ColourMap::Viridis },
            range,
            title,
            quantity: format!("{word}, {}", subject.outcome.unit()),
            ..SurfaceOptions::default()
        };
        surface_picture::render(&positions, subject.face.mesh().triangles(), Some(values), &options)
    };
    let range_of = |lists: &[&[Option<f64>]], signed: bool| {
        automatic_range(lists.iter().flat_map(|l| l.iter()).flatten().map(|x| (*x, true)), signed)
    };
    let signed = part == Part::AlongFibre;
    let count = maps.values.len();
    let differences: Vec<Vec<Option<f64>>> = (1..count).take(DRAWN).map(|k| maps.difference(k)).collect();
    // One range for all differences; what scatters is small beside the mean.
    let less = range_of(&differences.iter().map(Vec::as_slice).collect::<Vec<_>>(), true);
    let mut pictures = vec![
        one(&maps.mean, format!("Mean of {count}"), signed, range_of(&[&maps.mean], signed))?,
        one(&maps.spread, format!("Standard deviation of {count}"), false, range_of(&[&maps.spread], false))?,
    ];
    for (other, difference) in subject.others.iter().zip(&differences) {
        pictures.push(one(difference, format!("This less {}", other.name), true, less)?);
    }
    Ok(pictures)
}

/// Pictures of one height a row side by side, rows one below the other, on white.
pub(super) fn sheet(rows: &[Vec<RgbImage>]) -> RgbImage {
    let width = rows.iter().map(|row| row.iter().map(RgbImage::width).sum()).max().unwrap_or(0);
    let height_of = |row: &Vec<RgbImage>| row.iter().map(RgbImage::height).max().unwrap_or(0);
    let mut sheet = RgbImage::from_pixel(width, rows.iter().map(height_of).sum(), image::Rgb([255; 3]));
    let mut y = 0;
    for row in rows {
        let mut x = 0;
        for picture in row {
            image::imageops::replace(&mut sheet, picture, x, y);
            x += i64::from(picture.width());
        }
        y += i64::from(height_of(row));
    }
    sheet
}
