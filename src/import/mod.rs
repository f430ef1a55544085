//! Marks that another program or another project holds, read as proposals: never data until a hand accepts them.
//!
//! CSV as this program writes it, TPS of geometric morphometrics, and COCO keypoints. Every format's own rule for pixels is taken back (TPS:
//! the origin below, y upward; COCO: 0 at the centre of the first pixel), so that what was exported comes back where it was.

mod coco;
mod csv;
mod tps;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use nalgebra::Point2;

use crate::face::FaceModel;
use crate::project::edit::{self, Edit, PointId};
use crate::project::{FrameRef, MarkState, Project, Which};
use crate::suggest::{Source, Suggestion};

/// Largest file that is read, bytes: a hundred thousand marks have 10 MB.
pub const MAX_BYTES: u64 = 64 << 20;

/// Farthest that a mark may lie from the picture's corner, px, as in a project.
const FARTHEST_PX: f64 = 1e6;

/// Confidence of a mark that another hand has believed, and of one that it has doubted.
const BELIEVED: f64 = 1.0;
const DOUBTED: f64 = 0.4;

/// One point of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// Which point of the project it would be.
    pub point: PointId,
    /// Where, px from the top-left corner of the top-left pixel.
    pub at_px: [f64; 2],
    /// What the file says of it.
    pub state: MarkState,
    /// How sure it is, 0 to 1, where the file says so.
    pub confidence: Option<f64>,
}

/// The points of a file, and what of it was not understood.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The points, each once, in the order of the file.
    pub points: Vec<Imported>,
    /// What was passed over and why, a line each.
    pub passed_over: Vec<String>,
}

/// Why a file gave no points: which file, where in it, what is wrong, in one line.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// It cannot be read.
    #[error("{}: cannot be read ({reason}); check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: std::io::Error,
    },
    /// More than any table of marks has.
    #[error("{}: is larger than {} MB, which no table of marks is", path.display(), MAX_BYTES >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// It is no text.
    #[error("{}: is not text; CSV, TPS and COCO files are read", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
    },
    /// A line cannot be understood.
    #[error("{}: line {line}: {reason}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Its number, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The file as a whole does not fit the project.
    #[error("{}: {reason}", path.display())]
    Whole {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// What went wrong in a text: the line, if it was in one, and the reason.
#[derive(Debug, PartialEq)]
struct Wrong(Option<usize>, String);

impl Wrong {
    fn in_line(line: usize, reason: impl Into<String>) -> Self {
        Self(Some(line), reason.into())
    }

    fn whole(reason: impl Into<String>) -> Self {
        Self(None, reason.into())
    }
}

/// Reads a file of marks for the points of this project.
///
/// # Errors
/// Every case of [`ImportError`]. A name that the face does not have is passed over and told; when none is left, that is an error.
pub fn read(path: &Path, project: &Project, face: &FaceModel) -> Result<Import, ImportError> {
    let unreadable = |reason| ImportError::Unreadable { path: path.to_owned(), reason };
    if !path.metadata().map_err(unreadable)?.is_file() {
        return Err(unreadable(std::io::Error::new(std::io::ErrorKind::InvalidInput, "it is not a file")));
    }
    let mut bytes = Vec::new();
    File::open(path).and_then(|f| f.take(MAX_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(ImportError::TooLarge { path: path.to_owned() });
    }
    let text = std::str::from_utf8(&bytes).map_err(|_| ImportError::NotText { path: path.to_owned() })?;
    parse(text, project, face).map_err(|Wrong(line, reason)| match line {
        Some(line) => ImportError::Line { path: path.to_owned(), line, reason },
        None => ImportError::Whole { path: path.to_owned(), reason },
    })
}

/// Reads the text of a file; its kind is told by how it begins.
fn parse(text: &str, project: &Project, face: &FaceModel) -> Result<Import, Wrong> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut names = Names { face, import: Import::default() };
    let begins = text.trim_start();
    if begins.starts_with('{') {
        coco::read(text, project, &mut names)?;
    } else if begins.get(..2).is_some_and(|b| b.eq_ignore_ascii_case("lm")) {
        tps::read(text, project, &mut names)?;
    } else {
        csv::read(text, &mut names)?;
    }
    let import = names.import;
    if import.points.is_empty() {
        let why = import.passed_over.first().map_or("there is no mark in it", String::as_str);
        return Err(Wrong::whole(format!("no point of this project's face is in it ({why})")));
    }
    Ok(import)
}

/// Finds points by the names in a file, and keeps what was found.
struct Names<'a> {
    face: &'a FaceModel,
    import: Import,
}

impl Names<'_> {
    /// Keeps a point: `name` is a landmark's id, a vertex, or `vertex_17`.
    fn add(&mut self, which: Which, name: &str, at_px: [f64; 2], state: MarkState, place: &str) -> Result<(), String> {
        self.add_sure(which, name, at_px, state, None, place)
    }

    fn add_sure(
        &mut self,
        which: Which,
        name: &str,
        at_px: [f64; 2],
        state: MarkState,
        confidence: Option<f64>,
        place: &str,
    ) -> Result<(), String> {
        if !at_px.iter().all(|c| c.is_finite() && c.abs() <= FARTHEST_PX) {
            return Err(format!("{name} lies at {}, {} px, where no picture is", at_px[0], at_px[1]));
        }
        let Some(point) = self.point(which, name) else {
            self.import.passed_over.push(format!("{place}: the face has no point `{name}`"));
            return Ok(());
        };
        if self.import.points.iter().rev().take(MOST_COMPARED).any(|p| p.point == point) {
            self.import.passed_over.push(format!("{place}: `{name}` stands there twice; the first is taken"));
            return Ok(());
        }
        self.import.points.push(Imported { point, at_px, state, confidence });
        Ok(())
    }

    fn point(&self, which: Which, name: &str) -> Option<PointId> {
        let landmark = self.face.landmark(name);
        let number = name.strip_prefix("vertex_").unwrap_or(name).parse::<u32>().ok();
        let vertex = number.filter(|v| (*v as usize) < self.face.mesh().len());
        match which {
            Which::First => landmark.map(|l| PointId::Landmark(l.id.clone())).or(vertex.map(PointId::FeatureFirst)),
            Which::Last => landmark.map(|l| l.vertex).or(vertex).map(PointId::FeatureLast),
        }
    }
}

/// So many points before one are looked at for the same one: the file of a face has fewer, and a file of a million lines stays quick.
const MOST_COMPARED: usize = 20_000;

/// The frame that a file means by a picture's name; where that says nothing, by its place among two.
fn frame_of(project: &Project, name: &str, place: usize) -> Option<Which> {
    let file = |path: &str| path.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    let named = |f: &Option<FrameRef>| f.as_ref().is_some_and(|f| !name.is_empty() && file(&f.path) == file(name));
    let frames = &project.frames;
    match (named(&frames.first), named(&frames.last)) {
        (true, false) => Some(Which::First),
        (false, true) => Some(Which::Last),
        _ => [Which::First, Which::Last].get(place).copied(),
    }
}

impl Imported {
    /// As a suggestion, for a feature point of the last frame that can be seen.
    pub fn suggestion(&self) -> Option<Suggestion> {
        let PointId::FeatureLast(vertex) = self.point else { return None };
        let by_state = if self.state == MarkState::Uncertain { DOUBTED } else { BELIEVED };
        let confidence = self.confidence.unwrap_or(by_state);
        let at = Point2::from(self.at_px);
        self.state.is_data().then_some(Suggestion { vertex, at, confidence, method: Source::Imported, crossing: None })
    }
}

impl Import {
    /// The points that the project has no mark for.
    pub fn new_points<'a>(&'a self, project: &'a Project) -> impl Iterator<Item = &'a Imported> {
        self.points.iter().filter(|p| edit::mark(project, &p.point).is_none())
    }

    /// The edits that make marks of the points that the project has none for: what a hand does that accepts all of them. Marks that are
    /// there stay.
    pub fn accept(&self, project: &Project) -> Vec<Edit> {
        self.new_points(project)
            .flat_map(|p| {
                let state = (p.state != MarkState::Marked).then(|| Edit::SetState(p.point.clone(), p.state));
                [Some(Edit::Put(p.point.clone(), p.at_px)), state].into_iter().flatten()
            })
            .collect()
    }

    /// How far the points lie from marks that the project has: how many, root mean square and largest, px.
    pub fn against(&self, project: &Project) -> Option<(usize, f64, f64)> {
        let gaps: Vec<f64> = self
            .points
            .iter()
            .filter_map(|p| Some((Point2::from(edit::mark(project, &p.point)?.at_px) - Point2::from(p.at_px)).norm()))
            .collect();
        let mean = gaps.iter().map(|g| g * g).sum::<f64>() / gaps.len() as f64;
        (!gaps.is_empty()).then(|| (gaps.len(), mean.sqrt(), gaps.iter().copied().fold(0.0, f64::max)))
    }
}

#[cfg(test)]
mod tests;
