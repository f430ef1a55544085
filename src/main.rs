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

fn window(_: Option<PathBuf>) -> ExitCode {
    no_window()
}

fn no_window() -> ExitCode {
    eprintln!("error: {}", cli::NO_WINDOW);
    ExitCode::FAILURE
}
