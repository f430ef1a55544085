//! `frontalis fit`: the muscles behind a project's forces: strengths, the four laws, profiles, a report.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Frames, Scene};
use super::shell_word;
use crate::export::muscles::Subject;
use crate::export::{muscle_report, replay, report, subjects};
use crate::face::FaceModel;
use crate::fit::{Compare, LawFit};
use crate::muscle_field::profiles::Part;
use crate::muscle_field::subjects::{Other, Seen, carry, told_apart};
use crate::muscle_field::{Analysis, Include, Question, ladder};
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::paths;

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
    let all: Vec<&PathBuf> = std::iter::once(&arguments.project).chain(others.iter().map(|(path, _)| *path)).collect();
    for (k, path) in all.iter().enumerate() {
        if all[..k].iter().any(|before| paths::same_file(before, path)) {
            let what = format!("{}: is named twice; a subject counts once, so leave one out", path.display());
            return Err(CliError::Question(what));
        }
    }
    let mut output = Output::folder(&arguments.out)?;
    progress.stage("solve");
    let outcome = solved(&scene);
    progress.stage("fit");
    let goes_on = || false;
    let causes = pipeline::error_causes(&scene.project, &scene.face, scene.image_size_px);
    let found = Analysis::new(&outcome, &causes, &scene.face, &question, &goes_on);
    let Some(analysis) = found else { return Ok(()) };
    let analysis = analysis?;
    let built = if arguments.ladder {
        progress.stage("ladder");
        let (project, face) = (&scene.project, scene.face.as_ref());
        ladder::ladder(project, face, scene.image_size_px, &analysis, &goes_on, &|_| {})
    } else {
        None
    };
    let own = Seen { name: &scene.project.name, face: &scene.face, outcome: &outcome };
    let mut tried = Vec::new();
    for ((path, other), name) in others.iter().zip(names(&arguments.project, &scene, &others)) {
        progress.stage("try on others");
        let on = Arc::new(solved(other));
        let seen = Seen { name: &name, face: &other.face, outcome: &on };
        let Some(carried) = carry(&analysis, own, seen, &goes_on, &|_| {}) else { return Ok(()) };
        let carried = carried.map_err(|why| CliError::Question(format!("{}: {why}", path.display())))?;
        tried.push(Other { name, face: Arc::clone(&other.face), outcome: on, carried });
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
        others: &tried,
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

/// What the other subjects are called, so that they can be told apart.
fn names(path: &Path, scene: &Scene, others: &[(&PathBuf, Scene)]) -> Vec<String> {
    let all = others.iter().map(|(path, other)| (other.project.name.as_str(), path.as_path()));
    let all: Vec<(&str, &Path)> = std::iter::once((scene.project.name.as_str(), path)).chain(all).collect();
    told_apart(&all).into_iter().skip(1).collect()
}

fn solved(scene: &Scene) -> Outcome {
    pipeline::solve(&scene.project, &scene.face, scene.image_size_px, &mut Workspace::default())
}

fn r2(share: f64) -> String {
    format!("R² {share:.3}")
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
                println!("{}: held-out error {error}, {}, {:.2} ms", row.label(), r2(fit.r2), fit.time_ms);
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
    for other in subject.others {
        for row in &other.carried.rows {
            let share = |fit: &Result<LawFit, _>| fit.as_ref().map_or_else(|_| "no fit".into(), |f| r2(f.r2));
            let as_fitted = row.as_fitted_r2.map_or_else(|| "not tried".into(), r2);
            let (shape, refitted) = (share(&row.shape_carried), share(&row.refitted));
            let name = &other.name;
            println!("on {name}, {}: as fitted {as_fitted}; with its shape {shape}; refitted {refitted}", row.label);
        }
    }
    if !subject.others.is_empty() {
        match subjects::together(subject, Part::Magnitude) {
            Ok(maps) => println!("across subjects: {}", subjects::in_words(subject, &maps)),
            Err(why) => println!("no maps across subjects: {why}"),
        }
    }
}
