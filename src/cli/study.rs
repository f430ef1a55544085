//! `frontalis study`: measures the program against known or independent truth, and writes tables.

use std::path::PathBuf;

use clap::Subcommand;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use crate::face;
use crate::face::import::target::read_target;
use crate::face::import::{self, ImportOptions, Keep};
use crate::study::{artist, artist_laws};

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
    }
}

fn laws(arguments: &LawsArguments) -> Result<(), CliError> {
    let mut output = Output::folder(&arguments.out)?;
    let mut progress = Progress::new();
    progress.stage("laying the generic face on the head");
    let generic = face::generic();
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
    let wearer = artist::wear(&generic, &head).map_err(|source| CliError::Transfer { path: path.clone(), source })?;
    println!("the generic face lies on the head with {:.2} mm RMS", wearer.rms_mm);
    let mut rows = Vec::new();
    for made in artist_laws::FIELDS {
        progress.stage(made.name);
        let path = arguments.meshes.join(made.file);
        let bytes = face::file::read_bytes(&path)?;
        let target = read_target(&String::from_utf8_lossy(&bytes), head.vertices_in_file)
            .map_err(|source| CliError::Target { path, source })?;
        let field = artist::artist_field(&generic, &wearer, &target);
        rows.extend(artist_laws::rows(&generic, made, &field)?);
    }
    drop(progress);
    let table = artist_laws::markdown(&rows);
    print!("{table}");
    output.write("laws.csv", artist_laws::csv(&rows).as_bytes())?;
    output.write("laws.md", table.as_bytes())?;
    output.finish()?;
    println!("written to {}", arguments.out.display());
    Ok(())
}
