//! The program `frontalis`: subcommands without a window, and the window.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use frontalis::cli::{self, Arguments};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match arguments.command {
        Some(command) => cli::run(command),
        None => window(arguments.project),
    }
}

#[cfg(feature = "gui")]
fn window(project: Option<PathBuf>) -> ExitCode {
    use frontalis::gui::WindowError;
    match frontalis::gui::start(project) {
        Ok(()) => ExitCode::SUCCESS,
        Err(WindowError::NoWindow(_)) => no_window(),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(feature = "gui"))]
fn window(_: Option<PathBuf>) -> ExitCode {
    no_window()
}

fn no_window() -> ExitCode {
    eprintln!("error: {}", cli::NO_WINDOW);
    ExitCode::FAILURE
}
