//! Several subjects as files: the force of each on every vertex, and mean, spread and difference on the face that they share.

use std::fmt::Write as _;

use image::RgbImage;
use serde::Serialize;

use super::csv::{numbers, quoted};
use super::muscles::{Subject, title};
use crate::draw::ColourMap;
use crate::draw::robust_range::automatic_range;
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::draw::svg::SvgError;
use crate::muscle_field::maps::{Maps, MapsError, of_subjects};
use crate::muscle_field::profiles::Part;
use crate::muscle_field::subjects::Seen;

/// Header of [`csv`].
pub const SUBJECTS_HEADER: &str = "vertex,subject,force_N,along_fibre_N,sigma_N,less_force_N,less_along_fibre_N";

/// Header of [`maps_csv`].
pub const SUBJECT_MAPS_HEADER: &str =
    "vertex,subjects,mean_force_N,spread_force_N,mean_along_fibre_N,spread_along_fibre_N";

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

/// Mean, spread and the first differences on this subject's face: lengths above, components along the fibres below.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted. None where [`together`] has none.
pub fn picture(subject: &Subject<'_>) -> Result<Option<RgbImage>, SvgError> {
    let rows = [(Part::Magnitude, "length"), (Part::AlongFibre, "along the fibres")];
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
    // One range for lengths and their spread; one for all differences.
    let both = range_of(&[&maps.mean, &maps.spread], signed);
    let less = range_of(&differences.iter().map(Vec::as_slice).collect::<Vec<_>>(), true);
    let mut pictures = vec![
        one(&maps.mean, format!("Mean of {count}"), signed, both)?,
        one(&maps.spread, format!("Standard deviation of {count}"), false, [0.0, both[1]])?,
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
