//! `frontalis study`: measures the program against known or independent truth, and writes tables.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Subcommand;

use super::error::CliError;
use super::output::Output;
use super::progress::{Bar, Progress};
use super::scene::{Frames, Scene};
use super::study_chart;
use crate::export::study_files;
use crate::face::import::target::read_target;
use crate::face::import::{self, ImportOptions, Keep};
use crate::face::{self, FaceModel};
use crate::forces::Material;
use crate::pipeline::{self, Workspace};
use crate::study::journal::Journal;
use crate::study::ladder::{self, Goals, Subject};
use crate::study::truth_trial::Known;
use crate::study::{Kind, Options, Run, artist, artist_laws, artist_marks, runner, truth_trial};

/// What `study` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compares the four muscle laws on fields that an artist made: laws.csv, laws.md.
    Laws(LawsArguments),
    /// Charts how near every method comes to the truth against the time it takes: accuracy.csv, .svg, .png, .md.
    Accuracy(PartsArguments),
    /// Measures the depth rules and the springs without marking errors, on artists' fields and on truths made here: truths.csv, truths.md.
    Truths(LawsArguments),
    /// Maps where each method fails, and what fails first: stability.csv, .svg, .png, .md.
    Stability(PartsArguments),
    /// Picks the cheapest way, mesh and number of muscles for an accuracy or a time, from twins of one face: ladder.csv, .svg, .png, .md.
    Ladder(LadderArguments),
    /// Draws the chart of a table anew, whole or some of its parts alone: chart.svg, chart.png.
    Chart(study_chart::ChartArguments),
    /// Times every stage from 612 to 10⁶ vertices, its memory, and batches over the cores: scaling.csv, .svg, .png, .md.
    Scaling(RunArguments),
}

#[derive(Debug, clap::Args)]
struct RunArguments {
    /// Folder for the results; files of the same names are replaced, others kept. A study that was stopped goes on there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seeds of every cell; the study's own number otherwise.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: Option<u64>,
    /// Threads for what is not timed; all cores otherwise. What is timed always runs alone.
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// A coarser study with fewer seeds, for a first look.
    #[arg(long)]
    quick: bool,
    /// Measure on the face of this project, customised to its marks, instead of the generic face; the ladder also takes its marked points, its
    /// camera and its stated marking error.
    #[arg(long, value_name = "PROJECT")]
    project: Option<PathBuf>,
    /// Forget what was begun in the folder and start anew.
    #[arg(long)]
    restart: bool,
}

#[derive(Debug, clap::Args)]
struct PartsArguments {
    #[command(flatten)]
    run: RunArguments,
    /// Only this question of the study (its table's column `part`); may be given several times.
    #[arg(long = "part", value_name = "PART")]
    parts: Vec<String>,
}

#[derive(Debug, clap::Args)]
struct LadderArguments {
    #[command(flatten)]
    run: RunArguments,
    /// Accuracy wanted: forces within so many percent of the truth on 95 % of twins (10 where neither it nor a time is given).
    #[arg(long, value_name = "PERCENT", value_parser = positive)]
    accuracy: Option<f64>,
    /// Time allowed after a dragged point, ms (16 where neither it nor an accuracy is given).
    #[arg(long, value_name = "MS", value_parser = positive)]
    time: Option<f64>,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "a number is needed".to_owned())?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("it must be above zero".to_owned()) }
}

impl LadderArguments {
    fn goals(&self) -> Goals {
        match (self.accuracy, self.time) {
            (None, None) => Goals::default(),
            (accuracy, time_ms) => Goals { accuracy: accuracy.map(|percent| percent / 100.0), time_ms },
        }
    }
}

#[derive(Debug, clap::Args)]
struct LawsArguments {
    /// Folder with MakeHuman's base.obj and the targets of FACSHuman: 1.target, 01_Anger.target and so on.
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Folder for the tables; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// MakeHuman's meshes are in decimetres.
const MM_PER_UNIT: f64 = 100.0;

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Command::Laws(arguments) => laws(arguments),
        Command::Accuracy(arguments) => study(Kind::Accuracy, &arguments.run, &arguments.parts, Goals::default()),
        Command::Ladder(arguments) => study(Kind::Ladder, &arguments.run, &[], arguments.goals()),
        Command::Chart(arguments) => study_chart::run(arguments),
        Command::Truths(arguments) => truths(arguments),
        Command::Stability(arguments) => study(Kind::Stability, &arguments.run, &arguments.parts, Goals::default()),
        Command::Scaling(arguments) => study(Kind::Scaling, arguments, &[], Goals::default()),
    }
}

/// Runs a study, or goes on with one that was stopped, and writes its files.
fn study(kind: Kind, arguments: &RunArguments, parts: &[String], goals: Goals) -> Result<(), CliError> {
    let (face, subject) = match &arguments.project {
        None => (face::generic(), None),
        Some(path) => {
            let Scene { project, face, image_size_px: size_px, .. } = Scene::open(path, Frames::Ignored)?;
            let outcome = pipeline::solve(&project, &face, size_px, &mut Workspace::default());
            let own = Arc::new(face.with_positions(outcome.first)?);
            (own, Some(Arc::new(Subject { project, face, size_px })))
        }
    };
    let options = Options { quick: arguments.quick, seeds: arguments.seeds, face, subject };
    let mut plan = kind.plan(&options);
    plan.only(parts).map_err(CliError::Question)?;
    // Sets what Ctrl-C does: it ends the program at once, and the journal holds every case that was finished.
    let mut output = Output::folder(&arguments.out)?;
    let write = |source| CliError::Write { path: arguments.out.clone(), source };
    std::fs::create_dir_all(&arguments.out).map_err(write)?;
    let path = kind.journal_in(&arguments.out);
    if arguments.restart && path.exists() {
        std::fs::remove_file(&path).map_err(write)?;
    }
    let mut journal = Journal::open(&path, &plan.heading())?;
    let bar = Bar::new();
    let mut watch = |p: &runner::Progress, _: &[Run]| {
        bar.set(
            p.share,
            format!("{} of {} cases{}; Ctrl-C stops, the same command goes on", p.finished, p.of, p.left_in_words()),
        );
    };
    let runs = plan.run(&mut journal, arguments.threads, &|| false, &mut watch)?.ok_or(CliError::Stopped)?;
    drop(bar);
    for (name, bytes) in study_files::files(kind, &runs, goals)? {
        output.write(&name, &bytes)?;
    }
    output.finish()?;
    journal.remove();
    if kind == Kind::Ladder {
        for words in ladder::choices(&runs, goals) {
            println!("{words}");
        }
    }
    println!("{} runs; written to {}", runs.len(), arguments.out.display());
    Ok(())
}

/// The fields of the artist on the generic face laid on the artist's head.
fn fields(
    arguments: &LawsArguments,
    generic: &FaceModel,
    progress: &mut Progress,
    mut take: impl FnMut(artist_laws::Made, artist::ArtistField) -> Result<(), CliError>,
) -> Result<(), CliError> {
    progress.stage("laying the generic face on the head");
    let path = arguments.meshes.join("base.obj");
    let options = ImportOptions {
        mm_per_unit: Some(MM_PER_UNIT),
        keep: Keep::Face,
        groups: vec!["body".to_owned()],
        ..ImportOptions::default()
    };
    let bytes = face::file::read_bytes(&path)?;
    let head =
        import::read(&bytes, "base.obj", &options).map_err(|source| CliError::Mesh { path: path.clone(), source })?;
    let wearer = artist::wear(generic, &head).map_err(|source| CliError::Transfer { path: path.clone(), source })?;
    println!("the generic face lies on the head with {:.2} mm RMS", wearer.rms_mm);
    for made in artist_laws::FIELDS {
        progress.stage(made.name);
        let path = arguments.meshes.join(made.file);
        let bytes = face::file::read_bytes(&path)?;
        let target = read_target(&String::from_utf8_lossy(&bytes), head.vertices_in_file)
            .map_err(|source| CliError::Target { path, source })?;
        let field = artist::artist_field(generic, &wearer, &target);
        take(made, field)?;
    }
    Ok(())
}

fn laws(arguments: &LawsArguments) -> Result<(), CliError> {
    let mut output = Output::folder(&arguments.out)?;
    let mut progress = Progress::new();
    let generic = face::generic();
    let mut rows = Vec::new();
    fields(arguments, &generic, &mut progress, |made, field| {
        rows.extend(artist_laws::rows(&generic, made, &field)?);
        Ok(())
    })?;
    drop(progress);
    let table = artist_laws::markdown(&rows);
    print!("{table}");
    output.write("laws.csv", artist_laws::csv(&rows).as_bytes())?;
    output.write("laws.md", table.as_bytes())?;
    output.finish()?;
    println!("written to {}", arguments.out.display());
    Ok(())
}

/// The cuts of the membranes that springs are held against.
const CUTS: [u32; 2] = [1, 2];

fn truths(arguments: &LawsArguments) -> Result<(), CliError> {
    let mut output = Output::folder(&arguments.out)?;
    let mut progress = Progress::new();
    let generic = face::generic();
    let (mut rows, mut marks) = (Vec::new(), Vec::new());
    fields(arguments, &generic, &mut progress, |made, field| {
        marks.extend(artist_marks::rows(&generic, made.name, &field)?);
        rows.extend(truth_trial::depth_rows(&generic, &Known::of_artist(made.name, field)));
        Ok(())
    })?;
    progress.stage("expressions of a membrane");
    for known in truth_trial::made_here(&generic)? {
        rows.extend(truth_trial::depth_rows(&generic, &known));
    }
    let mut skins = Vec::new();
    for material in [Material::Fibres, Material::Principal] {
        for levels in CUTS {
            skins.extend(truth_trial::skin_rows(&generic, levels, material)?);
        }
    }
    drop(progress);
    let table = truth_trial::markdown(&rows, &skins) + &artist_marks::markdown(&marks);
    print!("{table}");
    output.write("truths.csv", truth_trial::csv(&rows).as_bytes())?;
    output.write("truths.md", table.as_bytes())?;
    output.finish()?;
    println!("written to {}", arguments.out.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        ladder: LadderArguments,
    }

    fn goals(words: &[&str]) -> Option<Goals> {
        let line = [&["ladder", "--out", "o"], words].concat();
        Line::try_parse_from(line).ok().map(|line| line.ladder.goals())
    }

    #[test]
    fn an_accuracy_in_percent_or_a_time_or_both_are_asked_for() {
        assert_eq!(goals(&[]), Some(Goals { accuracy: Some(0.1), time_ms: Some(16.0) }));
        assert_eq!(goals(&["--accuracy", "5"]), Some(Goals { accuracy: Some(0.05), time_ms: None }));
        assert_eq!(goals(&["--time", "4"]), Some(Goals { accuracy: None, time_ms: Some(4.0) }));
        let both = goals(&["--accuracy", "50", "--time", "4"]);
        assert_eq!(both, Some(Goals { accuracy: Some(0.5), time_ms: Some(4.0) }));
        assert_eq!((goals(&["--accuracy", "0"]), goals(&["--time", "nan"])), (None, None));
    }
}
