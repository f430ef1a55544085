//! The command line: one file a subcommand. Exit status 0 done, 1 could not be done (one line says why), 2 wrong usage.

mod check;
mod compare;
mod demo;
mod error;
mod export;
mod face;
mod fit;
mod frames;
mod import;
mod output;
mod progress;
mod scene;
mod simulate;
mod solve;
mod study;
mod study_chart;
mod suggest;
mod twin;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use error::CliError;

/// Measures the muscle forces of a facial expression from the first and the last frame of a video.
///
/// Without a command the window opens on PROJECT, or on the embedded sample.
#[derive(Debug, Parser)]
#[command(name = "frontalis", version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Arguments {
    /// What to do without a window.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// The project to open in the window (a .frontalis.json file).
    pub project: Option<PathBuf>,
}

/// What can be done without a window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solves the embedded sample: writes its project, its two frames, and what `solve` writes.
    Demo(demo::Arguments),
    /// Computes the forces of a project: forces.csv, height_map.png, forces.vtp, report.json.
    Solve(solve::Arguments),
    /// Fits muscles to a project's forces: fit.json, activations.csv, profiles.csv, profiles.svg, fields.csv, report.html.
    Fit(fit::Arguments),
    /// Plays an expression on a face: positions.csv, energy.csv, expression.png, report.json.
    Simulate(simulate::Arguments),
    /// Lists, shows, exports, checks and generates face models.
    Face(face::Arguments),
    /// Makes a scene of known truth: a project, two rendered frames with a painted grid, truth.csv, truth.json.
    Twin(twin::Arguments),
    /// Measures the program against independent truth: tables of the four muscle laws on artist-made fields.
    Study(study::Arguments),
    /// Writes marks and results for other programs.
    Export(export::Arguments),
    /// Reads marks of another program or project (CSV, TPS, COCO) as proposals; accepts them into a new project where asked.
    Import(import::Arguments),
    /// Where tracking would put every feature point that is not marked: a table, never a change of the project.
    Suggest(suggest::Arguments),
    /// Takes the first and the last frame of an expression out of a film; without numbers, by the motion.
    Frames(frames::Arguments),
    /// Compares the marks of two projects on the same frames: bias, limits of agreement, the worst points.
    Compare(compare::Arguments),
    /// Says everything that is wrong with a project.
    Check(check::Arguments),
}

/// Said where there can be no window.
pub const NO_WINDOW: &str = "no window can be opened here; run `frontalis demo --out DIR` for the main job without one, or see `frontalis --help`";

/// Runs a subcommand; what went wrong is said on stderr in one line.
pub fn run(command: Command) -> ExitCode {
    let done = match command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Solve(arguments) => solve::run(&arguments),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Face(arguments) => face::run(&arguments),
        Command::Twin(arguments) => twin::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Suggest(arguments) => suggest::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Frames(arguments) => frames::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", one_line(&error.to_string()));
            ExitCode::FAILURE
        }
    }
}

/// Names and messages from elsewhere may hold line ends.
fn one_line(message: &str) -> String {
    message.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ")
}

/// A word as a shell takes it: in quotes where it must be.
fn shell_word(word: &std::path::Path) -> String {
    let text = word.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+:@,".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::path::Path;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
        let window = Arguments::try_parse_from(["frontalis", "a.frontalis.json"]).unwrap();
        assert!(window.command.is_none() && window.project.is_some());
        assert!(Arguments::try_parse_from(["frontalis"]).unwrap().project.is_none());
        assert_eq!(Arguments::try_parse_from(["frontalis", "solve"]).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn words_with_blanks_are_quoted_for_the_shell() {
        assert_eq!(shell_word(Path::new("a/b-1.json")), "a/b-1.json");
        assert_eq!(shell_word(Path::new("it's here")), r"'it'\''s here'");
        assert_eq!(one_line("a\n  b\n\n"), "a; b");
    }
}
