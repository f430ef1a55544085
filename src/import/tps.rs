//! Marks in the TPS format of geometric morphometrics: y upward from the lower edge of the picture, `-1 -1` for what is missing.

use super::{Names, Wrong, frame_of};
use crate::project::{MarkState, Project, Which};

/// One specimen while it is read.
#[derive(Default)]
struct Specimen {
    line: usize,
    /// Its points with their lines.
    points: Vec<(usize, [f64; 2])>,
    expected: usize,
    image: String,
    id: String,
    /// Names of the points, each with what is said of it.
    named: Option<Vec<(String, String)>>,
}

/// What the comment of an exported specimen begins with.
const NAMES: &str = "points in order:";

/// Reads the text: each specimen is a frame, by its image, its `ID` (`…_first`, `…_last`), or its place.
pub(super) fn read(text: &str, project: &Project, names: &mut Names<'_>) -> Result<(), Wrong> {
    let mut specimens: Vec<Specimen> = Vec::new();
    // Points of curves are no landmarks.
    let mut curve_points = 0_usize;
    for (i, raw) in text.lines().enumerate() {
        let (line, content) = (i + 1, raw.trim());
        let wrong = |reason: &str| {
            Wrong::in_line(line, format!("{reason}: `{}`", content.chars().take(40).collect::<String>()))
        };
        if content.is_empty() {
            continue;
        }
        let Some((key, value)) = content.split_once('=') else {
            let mut numbers = content.split_whitespace().map(str::parse::<f64>);
            let (Some(Ok(x)), Some(Ok(y)), None) = (numbers.next(), numbers.next(), numbers.next()) else {
                return Err(wrong("a point has two numbers"));
            };
            if curve_points > 0 {
                curve_points -= 1;
                continue;
            }
            let specimen = specimens.last_mut().ok_or_else(|| wrong("a point before `LM=`"))?;
            if specimen.points.len() == specimen.expected {
                return Err(Wrong::in_line(
                    line,
                    format!("more than the {} points that `LM=` says", specimen.expected),
                ));
            }
            specimen.points.push((line, [x, y]));
            continue;
        };
        let (key, value) = (key.trim().to_ascii_uppercase(), value.trim());
        if key == "LM" {
            complete(specimens.last())?;
            let expected = value.parse().map_err(|_| wrong("a number of points was expected"))?;
            specimens.push(Specimen { line, expected, ..Specimen::default() });
            continue;
        }
        if key == "LM3" {
            return Err(wrong("points in space are not read"));
        }
        let specimen = specimens.last_mut().ok_or_else(|| wrong("something before `LM=`"))?;
        match key.as_str() {
            "IMAGE" => value.clone_into(&mut specimen.image),
            "ID" => value.clone_into(&mut specimen.id),
            "POINTS" => curve_points = value.parse().map_err(|_| wrong("a number of points was expected"))?,
            "COMMENT" if value.starts_with(NAMES) => {
                let words = value.get(NAMES.len()..).unwrap_or_default().split_whitespace();
                let parted = |w: &str| {
                    w.rsplit_once(':').map_or((w.to_owned(), String::new()), |(a, b)| (a.to_owned(), b.to_owned()))
                };
                specimen.named = Some(words.map(parted).collect());
            }
            // The scale is the project's own matter.
            _ => {}
        }
    }
    complete(specimens.last())?;
    for (place, specimen) in specimens.iter().enumerate() {
        take(specimen, place, project, names)?;
    }
    Ok(())
}

fn complete(specimen: Option<&Specimen>) -> Result<(), Wrong> {
    match specimen {
        Some(s) if s.points.len() < s.expected => {
            let reason = format!("`LM=` says {} points, and {} follow", s.expected, s.points.len());
            Err(Wrong::in_line(s.line, reason))
        }
        _ => Ok(()),
    }
}

fn take(specimen: &Specimen, place: usize, project: &Project, names: &mut Names<'_>) -> Result<(), Wrong> {
    let which = if specimen.id.ends_with("_first") {
        Some(Which::First)
    } else if specimen.id.ends_with("_last") {
        Some(Which::Last)
    } else {
        frame_of(project, &specimen.image, place)
    };
    let Some(which) = which else {
        names.import.passed_over.push(format!("line {}: which frame this specimen is cannot be told", specimen.line));
        return Ok(());
    };
    let frame = if which == Which::First { &project.frames.first } else { &project.frames.last };
    let Some(frame) = frame else {
        let word = which.word();
        return Err(Wrong::in_line(
            specimen.line,
            format!("the project names no {word} frame, whose height this format needs"),
        ));
    };
    let landmarks = names.face.landmarks();
    let named: Vec<(String, String)> = match &specimen.named {
        Some(named) if named.len() == specimen.points.len() => named.clone(),
        Some(named) => {
            let reason = format!("{} points, but the comment names {}", specimen.points.len(), named.len());
            return Err(Wrong::in_line(specimen.line, reason));
        }
        // A file of another program: the landmarks in the order of the face, if it is all of them.
        None if specimen.points.len() == landmarks.len() => {
            landmarks.iter().map(|l| (l.id.clone(), String::new())).collect()
        }
        None => {
            let reason = format!(
                "{} points without names; they are understood only where they are the {} landmarks of the face in its order, or where a line \
                 `COMMENT={NAMES} …` names them",
                specimen.points.len(),
                landmarks.len()
            );
            return Err(Wrong::in_line(specimen.line, reason));
        }
    };
    let height = f64::from(frame.height_px);
    for (&(line, [x, y]), (name, said)) in specimen.points.iter().zip(&named) {
        // Where the wireframe had a point that no hand has moved is no mark.
        if (x, y) == (-1.0, -1.0) || said == "fitted" || said == "unset" {
            continue;
        }
        let state = match said.as_str() {
            "uncertain" => MarkState::Uncertain,
            "occluded" => MarkState::Occluded,
            "locked" => MarkState::Locked,
            _ => MarkState::Marked,
        };
        let added = names.add(which, name, [x, height - y], state, &format!("line {line}"));
        added.map_err(|reason| Wrong::in_line(line, reason))?;
    }
    Ok(())
}
