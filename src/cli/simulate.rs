//! `frontalis simulate`: an expression played on a face: where every vertex goes, the energy over time, a picture and a report.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use super::scene::{Frames, Scene, face_at};
use super::shell_word;
use crate::export::expression::{self as files, PictureOptions, Run};
use crate::expression::player::Pace;
use crate::expression::stage::STIFFNESS;
use crate::expression::{Basic, Expression, Holding, Player, Sample, Setup, Stage};
use crate::face::FaceModel;
use crate::muscle::LawKind;
use crate::pipeline::{self, Workspace};
use crate::simulate::creases::{creases, in_words};
use crate::simulate::{Equilibrium, Method};

/// What `simulate` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// One of surprise, happy, sad, anger, disgust, fear.
    #[arg(long, value_name = "NAME", required_unless_present = "preset", conflicts_with = "preset")]
    expression: Option<String>,
    /// An expression file instead, as the window saves it.
    #[arg(long, value_name = "FILE")]
    preset: Option<PathBuf>,
    /// The project whose fitted face is moved; the generic face without one.
    project: Option<PathBuf>,
    /// A face model that is moved instead.
    #[arg(long, value_name = "FILE", conflicts_with = "project")]
    face: Option<PathBuf>,
    /// Folder for the results; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How time is stepped: `explicit_euler`, `symplectic_euler`, `runge_kutta_4`, thesis, `implicit_euler`, `vertex_block_descent`.
    #[arg(long, value_name = "NAME", default_value = "implicit_euler")]
    method: String,
    /// Simulated time, s; 0 goes to the static equilibrium at once.
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    seconds: f64,
    /// Time of a step, ms.
    #[arg(long, value_name = "MS", default_value_t = 1000.0 / 60.0)]
    step_ms: f64,
    /// After this time an activation has gone 95 % of its way, s.
    #[arg(long, value_name = "S", default_value_t = 0.35)]
    ramp_s: f64,
    /// Factor on all activations and the jaw, 0 to 2.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    intensity: f64,
    /// How a muscle's force spreads: `waters_linear`, `waters_sheet`, koch, anatomical.
    #[arg(long, value_name = "NAME", default_value = "anatomical")]
    law: String,
    /// What keeps the skin on the face: skull, anchors, bare.
    #[arg(long, value_name = "NAME", default_value = "skull")]
    hold: String,
    /// Factor on every stiffness of the skin, 0.01 to 100.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    stiffness: f64,
    /// Lids and the corners of the mouth as stiff as the skin around them.
    #[arg(long)]
    one_skin: bool,
}

/// Most steps of one run: more would write tables of gigabytes.
const MOST_STEPS: f64 = 1e6;

/// The one of that name, or a line that lists the good ones.
pub(super) fn named<T: Copy>(option: &str, word: &str, all: &[T], name: impl Fn(T) -> String) -> Result<T, CliError> {
    let plain = word.to_lowercase().replace([' ', '-'], "_");
    all.iter().copied().find(|one| name(*one) == plain).ok_or_else(|| {
        let names: Vec<String> = all.iter().map(|one| name(*one)).collect();
        CliError::Question(format!("--{option} is {word}; choose one of {}", names.join(", ")))
    })
}

pub(super) fn within(option: &str, value: f64, [low, high]: [f64; 2]) -> Result<f64, CliError> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(CliError::Question(format!("--{option} is {value}; it must lie between {low} and {high}")))
}

impl Arguments {
    fn setup(&self) -> Result<Setup, CliError> {
        Ok(Setup {
            law: named("law", &self.law, &LawKind::ALL, |l| l.name().to_owned())?,
            holding: named("hold", &self.hold, &Holding::ALL, |h| h.name().to_owned())?,
            stiffness: within("stiffness", self.stiffness, STIFFNESS)?,
            tissues: !self.one_skin,
        })
    }

    fn pace(&self) -> Result<Pace, CliError> {
        let pace = Pace {
            method: named("method", &self.method, &Method::ALL, |m| m.name().to_owned())?,
            step_s: 1e-3 * within("step-ms", self.step_ms, [0.001, 1000.0])?,
            ramp_s: within("ramp-s", self.ramp_s, [0.0, 60.0])?,
        };
        let seconds = within("seconds", self.seconds, [0.0, 600.0])?;
        if seconds / pace.step_s > MOST_STEPS {
            let what = format!(
                "--seconds {seconds} in steps of {} ms are more than a million steps; take longer ones",
                self.step_ms
            );
            return Err(CliError::Question(what));
        }
        Ok(pace)
    }

    fn basic(&self) -> Result<Option<Basic>, CliError> {
        let find = |word: &String| named("expression", word, &Basic::ALL, |b| b.name().to_lowercase());
        self.expression.as_ref().map(find).transpose()
    }

    /// The line that does the same again.
    fn command(&self, setup: &Setup, pace: &Pace, basic: Option<Basic>) -> String {
        let mut words = vec!["frontalis simulate".to_owned()];
        match (basic, &self.preset) {
            (Some(basic), _) => words.push(format!("--expression {}", basic.name().to_lowercase())),
            (None, Some(preset)) => words.push(format!("--preset {}", shell_word(preset))),
            (None, None) => {}
        }
        words.extend(self.project.iter().map(|p| shell_word(p)));
        words.extend(self.face.iter().map(|f| format!("--face {}", shell_word(f))));
        words.push(format!("--out {}", shell_word(&self.out)));
        words.push(format!("--method {} --seconds {}", pace.method.name(), self.seconds));
        words.push(format!("--step-ms {} --ramp-s {} --intensity {}", self.step_ms, self.ramp_s, self.intensity));
        words.push(format!(
            "--law {} --hold {} --stiffness {}",
            setup.law.name(),
            setup.holding.name(),
            setup.stiffness
        ));
        words.extend((!setup.tissues).then(|| "--one-skin".to_owned()));
        words.join(" ")
    }

    fn subject(&self) -> Result<Subject, CliError> {
        let Some(path) = &self.project else {
            let face = face_at(self.face.as_ref())?;
            let rest = face.mesh().positions().to_vec();
            return Ok(Subject { face, rest, project: None });
        };
        // Marks alone: the frames say nothing of the face that they do not.
        let scene = Scene::open(path, Frames::Ignored)?;
        let outcome = pipeline::solve(&scene.project, &scene.face, scene.image_size_px, &mut Workspace::default());
        let rest = outcome.first_from_eyes(&scene.face);
        Ok(Subject { face: scene.face, rest, project: Some(scene.project.name) })
    }
}

/// What is moved.
struct Subject {
    face: Arc<FaceModel>,
    /// Its vertices at rest, mm.
    rest: Vec<Point3<f64>>,
    /// Name of the project.
    project: Option<String>,
}

/// What a play has left.
struct Played {
    samples: Vec<Sample>,
    last: Vec<Point3<f64>>,
    loads: Vec<Vector3<f64>>,
    fastest_mm_s: f64,
    equilibrium: Option<Equilibrium>,
}

/// Plays for so long, then looks where the skin comes to rest. After a failure neither.
fn play(player: &mut Player, seconds: f64) -> Result<Played, CliError> {
    let mut samples: Vec<Sample> = player.samples().copied().collect();
    while player.time_s() + 0.5 * player.pace().step_s < seconds && player.step() {
        samples.extend(player.samples().next_back().copied());
    }
    let (last, loads) = (player.state().positions.clone(), player.loads().to_vec());
    let fastest_mm_s = player.state().velocities.iter().map(Vector3::norm).fold(0.0, f64::max);
    if player.failure().is_some() {
        return Ok(Played { samples, last, loads, fastest_mm_s, equilibrium: None });
    }
    let found = player.settle().map_err(|e| CliError::Question(format!("the equilibrium cannot be found: {e}")))?;
    if seconds > 0.0 {
        return Ok(Played { samples, last, loads, fastest_mm_s, equilibrium: Some(found) });
    }
    samples.extend(player.samples().next_back().copied());
    let loads = player.loads().to_vec();
    Ok(Played { samples, last: found.positions.clone(), loads, fastest_mm_s, equilibrium: Some(found) })
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let (setup, pace, basic) = (arguments.setup()?, arguments.pace()?, arguments.basic()?);
    let intensity = within("intensity", arguments.intensity, [0.0, 2.0])?;
    let preset = arguments.preset.as_deref().map(Expression::load).transpose()?;
    let Subject { face, rest, project } = arguments.subject()?;
    progress.stage("prepare");
    let stage = Stage::new(&face, &rest, &setup)?;
    let chosen = match (basic, preset) {
        (Some(basic), _) => Expression::basic(basic, &stage.actuators),
        (None, Some(preset)) => preset,
        (None, None) => Expression::default(),
    };
    let expression = chosen.times(intensity);
    let unknown = stage.actuators.loads(&expression).unknown;
    let mut output = Output::folder(&arguments.out)?;
    progress.stage("play");
    let mut player = Player::new(stage, pace);
    player.want(&expression);
    let played = play(&mut player, arguments.seconds)?;
    let failure = player.failure().cloned();
    progress.stage("draw");
    let title = format!("{}, {:.0} %", expression.name, 100.0 * intensity);
    let options = PictureOptions {
        shown: None,
        most: None,
        turns: vec![0.0, 35_f64.to_radians()],
        title: if failure.is_some() { format!("{title} – failed") } else { title },
        view_px: [480, 620],
        within: Vec::new(),
    };
    let picture = files::picture(&face, &rest, &played.last, &played.loads, &options)?;
    output.write("positions.csv", files::positions(&rest, &played.last, &played.loads).as_bytes())?;
    output.write("energy.csv", files::energy(played.samples.iter()).as_bytes())?;
    output.write_png("expression.png", &picture)?;
    let run = Run {
        command: &arguments.command(&setup, &pace, basic),
        project: project.as_deref(),
        face: &face,
        setup: &setup,
        expression: &expression,
        intensity,
        seconds: arguments.seconds,
        player: &player,
        last: &played.last,
        loads: &played.loads,
        end: played.samples.last().copied().unwrap_or_default(),
        fastest_mm_s: played.fastest_mm_s,
        failure: failure.as_ref(),
        equilibrium: played.equilibrium.as_ref(),
        unknown: &unknown,
        timings_ms: progress.timings_ms(),
    };
    let report = files::report(&run).map_err(|e| CliError::Question(format!("the report cannot be written ({e})")))?;
    output.write("report.json", report.as_bytes())?;
    output.finish()?;
    drop(progress);
    for id in &unknown {
        eprintln!("warning: this face has no muscle {id}; it was left out");
    }
    if let Some(failure) = failure {
        return Err(CliError::Played { failure: Box::new(failure), out: arguments.out.clone() });
    }
    say(&expression, &rest, &played);
    let mesh = face.mesh();
    if let Some([what, advice]) = in_words(mesh, &creases(mesh, &rest, &played.last), setup.holding.hold()) {
        println!("warning: {what}. {advice}");
    }
    println!("written to {}", arguments.out.display());
    Ok(())
}

/// The result in a few lines.
fn say(expression: &Expression, rest: &[Point3<f64>], played: &Played) {
    let moved = played.last.iter().zip(rest).map(|(x, x0)| (x - x0).norm()).enumerate();
    if let Some((vertex, mm)) = moved.max_by(|a, b| a.1.total_cmp(&b.1)) {
        println!("{}: vertex {vertex} moves farthest, {mm:.2} mm", expression.name);
    }
    if let Some(e) = &played.equilibrium {
        println!("equilibrium: {}, {} iterations, {:.1e} N left", e.ended.label(), e.iterations, e.residual_n);
        if !e.folded.is_empty() {
            println!("warning: {} triangles have turned over, first {}", e.folded.len(), e.folded[0]);
        }
    }
}
