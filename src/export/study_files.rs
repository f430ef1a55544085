//! What a study leaves: its table, its chart as a drawing and as a picture, and a short reading in plain words.

use super::{png, study_chart, study_ladder, study_maps, study_scaling};
use crate::draw::svg;
use crate::study::ladder::Goals;
use crate::study::{Kind, Run, machine, table};

/// Why there are no files.
#[derive(Debug, thiserror::Error)]
pub enum StudyFilesError {
    /// The drawing.
    #[error(transparent)]
    Drawing(#[from] svg::SvgError),
    /// The picture.
    #[error("the picture of the study cannot be written as PNG: {0}")]
    Png(#[from] image::ImageError),
}

/// Name and bytes of each file: the table as CSV, the chart as SVG and PNG, the reading as Markdown; of a ladder, for these goals.
///
/// # Errors
/// [`StudyFilesError`].
pub fn files(kind: Kind, runs: &[Run], goals: Goals) -> Result<Vec<(String, Vec<u8>)>, StudyFilesError> {
    let caption = caption(runs);
    let drawing = chart(kind, runs, goals, &caption);
    let reading = format!("{}\n{caption}\n", kind.reading(runs, goals));
    let name = kind.name();
    Ok(vec![
        (format!("{name}.csv"), table::csv(runs).into_bytes()),
        (format!("{name}.png"), png(&svg::paint(&drawing, 1.0)?)?),
        (format!("{name}.svg"), drawing.into_bytes()),
        (format!("{name}.md"), reading.into_bytes()),
    ])
}

/// The chart of a study.
pub fn chart(kind: Kind, runs: &[Run], goals: Goals, caption: &str) -> String {
    match kind {
        Kind::Accuracy => {
            let heading = format!("{}: {}", kind.label(), kind.asks());
            study_chart::svg(&heading, &study_chart::panels(runs, |part| kind.title(part)), caption)
        }
        Kind::Ladder => study_ladder::svg(&format!("{}: {}", kind.label(), kind.asks()), runs, goals, caption),
        Kind::Stability => study_maps::svg(kind, runs, caption),
        Kind::Scaling => study_scaling::svg(&format!("{}: {}", kind.label(), kind.asks()), runs, caption),
    }
}

/// Machine, build, seeds and runs, in a line.
pub fn caption(runs: &[Run]) -> String {
    format!("{} · {}", machine::words(), seeds_and_runs(runs))
}

/// "seeds 1 to 7 · 2356 runs".
pub fn seeds_and_runs(runs: &[Run]) -> String {
    let seeds = runs
        .iter()
        .map(|r| r.seed)
        .fold(None, |s: Option<[u64; 2]>, v| Some(s.map_or([v, v], |[low, high]| [low.min(v), high.max(v)])));
    let seeds = match seeds {
        None => "no seeds".to_owned(),
        Some([a, b]) if a == b => format!("seed {a}"),
        Some([a, b]) => format!("seeds {a} to {b}"),
    };
    format!("{seeds} · {} runs", runs.len())
}
