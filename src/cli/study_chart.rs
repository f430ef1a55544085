//! `frontalis study chart`: draws the chart of a study's table anew, whole or some of its questions and marking errors alone.

use std::path::PathBuf;

use super::error::CliError;
use super::output::Output;
use crate::draw::svg;
use crate::export::{png, study_files};
use crate::study::ladder::Goals;
use crate::study::{Kind, Run, table};

#[derive(Debug, clap::Args)]
pub(super) struct ChartArguments {
    /// The table: accuracy.csv, stability.csv, ladder.csv or scaling.csv of a study.
    #[arg(value_name = "TABLE.csv")]
    table: PathBuf,
    /// Only this question of the study (its column `part`); may be given several times.
    #[arg(long, value_name = "PART")]
    part: Vec<String>,
    /// Only this marking error, px; may be given several times.
    #[arg(long, value_name = "PX")]
    noise: Vec<f64>,
    /// Folder for chart.svg and chart.png; files of these names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(arguments: &ChartArguments) -> Result<(), CliError> {
    let refuse = |why: String| CliError::Question(format!("{}: {why}", arguments.table.display()));
    let all = table::read_file(&arguments.table).map_err(refuse)?;
    let kind = Kind::of(&all).ok_or_else(|| refuse("is no table of a study".to_owned()))?;
    let chosen = |r: &&Run| {
        (arguments.part.is_empty() || arguments.part.contains(&r.part))
            && (arguments.noise.is_empty() || arguments.noise.contains(&r.noise_px))
    };
    let runs: Vec<Run> = all.iter().filter(chosen).cloned().collect();
    if runs.is_empty() {
        let mut parts: Vec<&str> = all.iter().map(|r| r.part.as_str()).collect();
        parts.sort_unstable();
        parts.dedup();
        return Err(refuse(format!("has no such rows; its parts are: {}", parts.join(" | "))));
    }
    // Where the table was measured it does not say, so nothing is said of a machine.
    let name = arguments.table.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let caption = format!("{name} · {}", study_files::seeds_and_runs(&runs));
    let drawing = study_files::chart(kind, &runs, Goals::default(), &caption);
    let picture = svg::paint(&drawing, 1.0).map_err(|e| refuse(e.to_string()))?;
    let picture = png(&picture).map_err(|e| refuse(e.to_string()))?;
    let mut output = Output::folder(&arguments.out)?;
    output.write("chart.png", &picture)?;
    output.write("chart.svg", drawing.as_bytes())?;
    output.finish()?;
    println!("{} of {} rows drawn; written to {}", runs.len(), all.len(), arguments.out.display());
    Ok(())
}
