//! `frontalis face`: face models listed, shown, exported, checked, generated, and made from meshes of other programs.

mod import;

use std::path::{Path, PathBuf};

use clap::Subcommand;

use super::error::CliError;
use super::scene::face_at;
use crate::face::{self, FaceModel, check, import as mesh_import};
use crate::project::whole_file::{self, Durability};

/// What `face` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// The face models that the program holds.
    List,
    /// Counts, landmarks and muscles of a face.
    Show {
        /// A face model file or a mesh (OBJ, PLY, CANDIDE .wfm); without it, the generic face.
        #[arg(long, value_name = "FILE")]
        face: Option<PathBuf>,
    },
    /// Writes the mesh of a face as Wavefront OBJ, mm.
    Export {
        /// A face model file or a mesh (OBJ, PLY, CANDIDE .wfm); without it, the generic face.
        #[arg(long, value_name = "FILE")]
        face: Option<PathBuf>,
        /// The OBJ file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Checks that a face is fit for the chain.
    Check {
        /// A face model file or a mesh (OBJ, PLY, CANDIDE .wfm); without it, the generic face.
        file: Option<PathBuf>,
    },
    /// Makes a face model file of a mesh (OBJ, PLY, CANDIDE .wfm), and says what was repaired and guessed.
    Import(import::Arguments),
    /// Generates the generic face anew and writes its file.
    Generate {
        /// The face model file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.action {
        Action::List => {
            println!("generic  {}", counts(&face::generic()));
            Ok(())
        }
        Action::Show { face } => {
            print!("{}", description(face_at(face.as_ref())?.as_ref()));
            Ok(())
        }
        Action::Export { face, out } => {
            let face = face_at(face.as_ref())?;
            write(out, &mesh_import::write_obj(face.mesh(), face.mesh().positions()))
        }
        Action::Check { file } => {
            let face = face_at(file.as_ref())?;
            let report = match file {
                None => check::check_against(&face, &check::Expectations::generic()),
                Some(_) => check::check_against(&face, &check::Expectations::imported()),
            };
            print!("{report}");
            if report.ok() { Ok(()) } else { Err(CliError::FaceFailed(face.name().to_owned())) }
        }
        Action::Import(arguments) => import::run(arguments),
        Action::Generate { out } => write(out, &face::file::to_json(&face::generic::generate()?)),
    }
}

fn write(out: &Path, text: &str) -> Result<(), CliError> {
    let failed = |source| CliError::Write { path: out.to_owned(), source };
    whole_file::write(out, text.as_bytes(), Durability::Process).map_err(failed)?;
    println!("written to {}", out.display());
    Ok(())
}

fn counts(face: &FaceModel) -> String {
    format!(
        "{} vertices, {} triangles, {} landmarks, {} muscles",
        face.mesh().len(),
        face.mesh().triangles().len(),
        face.landmarks().len(),
        face.muscles().len()
    )
}

fn description(face: &FaceModel) -> String {
    use std::fmt::Write as _;
    let mut text = format!("{}\n{}\n\nlandmarks (id, vertex, x y z in mm, name)\n", face.name(), counts(face));
    let at = |v: u32| face.mesh().positions().get(v as usize).copied().unwrap_or_default();
    for l in face.landmarks() {
        let p = at(l.vertex);
        let _ = writeln!(text, "  {:<22} {:>4}  {:>7.2} {:>7.2} {:>7.2}  {}", l.id, l.vertex, p.x, p.y, p.z, l.name);
    }
    text.push_str("\nmuscles (id, action unit, attachment, insertion, length in mm, Latin name)\n");
    for m in face.muscles() {
        let length = (at(m.attachment) - at(m.insertion)).norm();
        let _ = writeln!(
            text,
            "  {:<28} {:>2}  {:>4} {:>4}  {length:>6.2}  {}",
            m.id, m.action_unit, m.attachment, m.insertion, m.latin
        );
    }
    if !face.regions().is_empty() {
        text.push_str("\nregions (id, number of vertices)\n");
        for r in face.regions() {
            let _ = writeln!(text, "  {:<22} {:>4}", r.id, r.vertices.len());
        }
    }
    text
}
