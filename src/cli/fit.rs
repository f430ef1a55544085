//! `frontalis fit`: the muscles behind a project's forces: strengths, the four laws, profiles, a report.

use std::path::PathBuf;

use clap::ValueEnum;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use super::shell_word;
use crate::export::muscles::Subject;
use crate::export::{muscle_report, replay, report};
use crate::face::FaceModel;
use crate::fit::Compare;
use crate::muscle_field::subjects::carry;
use crate::muscle_field::{Analysis, Include, Question, ladder};
use crate::pipeline::{self, Outcome, Workspace};

/// What `fit` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The project (a .frontalis.json file).
    project: PathBuf,
    /// Folder for the results; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What of the forces is compared with a law.
    #[arg(long, value_enum, default_value_t = CompareWord::Tangential)]
    compare: CompareWord,
    /// Which vertices count.
    #[arg(long, value_enum, default_value_t = IncludeWord::Believed)]
    include: IncludeWord,
    /// Ids of the muscles whose law is fitted, with commas between them; without it, the smallest set that explains the field.
    #[arg(long, value_name = "IDS", value_delimiter = ',')]
    muscles: Vec<String>,
    /// Radius of the patches of skin that are left out to test a fit, mm (3 to 60).
    #[arg(long, value_name = "MM", default_value_t = 15.0)]
    patch_mm: f64,
    /// Also builds the ladder of models, from one muscle with one number upwards.
    #[arg(long)]
    ladder: bool,
    /// Another subject that the laws are tried on; may be given several times.
    #[arg(long, value_name = "PROJECT")]
    test: Vec<PathBuf>,
    /// Compute from the marks alone, even where a frame is missing or has changed.
    #[arg(long)]
    ignore_frames: bool,
}

/// A [`Compare`] as a word.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum CompareWord {
    /// The part in the skin's surface.
    Tangential,
    /// All three components.
    Vectors,
    /// The signed component along the fibre.
    Along,
    /// Lengths alone, as the thesis.
    Magnitudes,
}

/// An [`Include`] as a word.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum IncludeWord {
    /// Measured, not on the border, no spring beyond the skin table.
    Believed,
    /// All that were measured.
    Measured,
    /// Measured and inferred ones.
    Known,
}

impl Arguments {
    fn question(&self, scene: &Scene) -> Result<Question, CliError> {
        if !(3.0..=60.0).contains(&self.patch_mm) {
            let what = format!("--patch-mm is {}; it must lie between 3 and 60", self.patch_mm);
            return Err(CliError::Question(what));
        }
        let muscles = scene.face.muscles();
        let find = |id: &String| {
            muscles.iter().position(|m| m.id == *id).ok_or_else(|| {
                let known: Vec<&str> = muscles.iter().map(|m| m.id.as_str()).collect();
                CliError::Question(format!("--muscles names {id}; this face has {}", known.join(", ")))
            })
        };
        let chosen = self.muscles.iter().map(find).collect::<Result<Vec<usize>, _>>()?;
        Ok(Question {
            include: match self.include {
                IncludeWord::Believed => Include::Believed,
                IncludeWord::Measured => Include::Measured,
                IncludeWord::Known => Include::Known,
            },
            compare: match self.compare {
                CompareWord::Tangential => Compare::Tangential,
                CompareWord::Vectors => Compare::Vectors,
                CompareWord::Along => Compare::Along,
                CompareWord::Magnitudes => Compare::Magnitudes,
            },
            muscles: (!chosen.is_empty()).then_some(chosen),
            patch_radius_mm: self.patch_mm,
        })
    }

    /// The line that does the same again.
    fn command(&self, question: &Question, face: &FaceModel) -> String {
        let mut words = vec!["frontalis fit".to_owned(), shell_word(&self.project)];
        words.extend(["--out".to_owned(), shell_word(&self.out)]);
        words.extend(question.arguments(face));
        words.extend(self.test.iter().flat_map(|path| ["--test".to_owned(), shell_word(path)]));
        let switches = [(self.ladder, "--ladder"), (self.ignore_frames, "--ignore-frames")];
        words.extend(switches.iter().filter(|s| s.0).map(|s| s.1.to_owned()));
        words.join(" ")
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let frames = if arguments.ignore_frames { Frames::Ignored } else { Frames::Required };
    let scene = Scene::open(&arguments.project, frames)?;
    let question = arguments.question(&scene)?;
    let others = arguments
        .test
        .iter()
        .map(|path| Ok((path, Scene::open(path, frames)?)))
        .collect::<Result<Vec<_>, CliError>>()?;
    let mut output = Output::folder(&arguments.out)?;
    progress.stage("solve");
    let outcome = solved(&scene);
    progress.stage("fit");
    let goes_on = || false;
    let Some(analysis) = Analysis::new(&outcome, &scene.face, &question, &goes_on) else { return Ok(()) };
    let analysis = analysis?;
    let built = if arguments.ladder {
        progress.stage("ladder");
        let (project, face) = (&scene.project, scene.face.as_ref());
        ladder::ladder(project, face, scene.image_size_px, &analysis, &goes_on, &|_| {})
    } else {
        None
    };
    let mut carried = Vec::new();
    for (path, other) in &others {
        progress.stage("try on others");
        let name = if other.project.name.is_empty() { path.display().to_string() } else { other.project.name.clone() };
        carried.push((name, carry(&analysis, &scene.face, &solved(other), &other.face)?));
    }
    progress.stage("write");
    let last_frame = scene.last_frame(&arguments.project);
    let subject = Subject {
        project: &scene.project,
        face: &scene.face,
        outcome: &outcome,
        analysis: &analysis,
        ladder: built.as_ref(),
        last_frame: last_frame.as_ref(),
        carried: &carried,
    };
    let (timings_ms, command) = (progress.timings_ms(), arguments.command(&question, &scene.face));
    let circumstances = report::Circumstances { command, timings_ms, remarks: scene.remarks.clone() };
    for (name, bytes) in muscle_report::files(&subject, &circumstances)? {
        output.write(name, &bytes)?;
    }
    output.finish()?;
    drop(progress);
    say(&subject);
    println!("written to {}", arguments.out.display());
    Ok(())
}

fn solved(scene: &Scene) -> Outcome {
    pipeline::solve(&scene.project, &scene.face, scene.image_size_px, &mut Workspace::default())
}

/// The result in a few lines.
fn say(subject: &Subject<'_>) {
    let (analysis, unit) = (subject.analysis, subject.outcome.unit());
    if !analysis.explains {
        println!("no muscle explains the forces better than none does on patches left out; the nearest one is shown");
    }
    for row in &analysis.laws {
        match (&row.fit, &row.held_out) {
            (Ok(fit), held_out) => {
                let error = held_out.as_ref().map_or_else(|| "–".into(), |h| format!("{:.3}", h.error.min(10.0)));
                println!("{}: held-out error {error}, R² {:.3}, {:.2} ms", row.label(), fit.r2, fit.time_ms);
            }
            (Err(failed), _) => println!("{failed}"),
        }
    }
    if let Some(best) = analysis.best {
        println!("best: {}", analysis.laws[best].label());
    }
    for &f in &analysis.selection.chosen {
        let one = &analysis.activations.muscles[f];
        let muscle = &subject.face.muscles()[analysis.fibres[f].muscle];
        println!("{}: {:.3} {unit} ({:.3} to {:.3})", muscle.id, one.strength_n, one.low_n, one.high_n);
    }
    if let Some(rung) = subject.ladder.and_then(|l| l.rungs.get(l.recommended?)) {
        println!("recommended rung: {} ({} numbers)", rung.name, rung.parameters);
    }
    if let Some(replay) = muscle_report::replayed(subject) {
        println!("simulated against seen: {}", replay::in_words(&replay));
    }
    for (name, carried) in subject.carried {
        for row in &carried.rows {
            let r2 = |fit: &Result<crate::fit::LawFit, _>| fit.as_ref().map_or(f64::NAN, |f| f.r2);
            let as_fitted = row.as_fitted_r2.unwrap_or(f64::NAN);
            let (shape, refitted) = (r2(&row.shape_carried), r2(&row.refitted));
            println!(
                "on {name}, {}: R² {as_fitted:.3} as fitted, {shape:.3} with its shape, {refitted:.3} refitted",
                row.label
            );
        }
    }
}
