//! `frontalis face import`: a mesh of another program made a face model file.

use std::path::PathBuf;

use clap::ValueEnum;

use super::super::error::CliError;
use super::{counts, write};
use crate::customize::numbering::Numbering;
use crate::customize::transfer;
use crate::face::check::{self, Expectations};
use crate::face::import::{self, Axes, Direction, ImportError, ImportOptions};
use crate::face::{self, file};

/// What `face import` asks for.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The mesh: Wavefront OBJ, Stanford PLY, or CANDIDE .wfm.
    mesh: PathBuf,
    /// The face model file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Name of the face for people (default: the name of the mesh file).
    #[arg(long)]
    name: Option<String>,
    /// Millimetres that one unit of the file stands for (default: guessed from the size).
    #[arg(long, value_name = "MM")]
    mm_per_unit: Option<f64>,
    /// Where up is in the file: x, y, z, -x, -y or -z (default: guessed).
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, requires = "front")]
    up: Option<Direction>,
    /// Where the face looks in the file (default: guessed).
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, requires = "up")]
    front: Option<Direction>,
    /// How much of the mesh is kept.
    #[arg(long, value_enum, default_value_t = Keep::Everything)]
    keep: Keep,
    /// Only this group of an OBJ file; may stand several times.
    #[arg(long = "group", value_name = "NAME")]
    groups: Vec<String>,
    /// Leaves vertices at exactly the same place apart: for lips or lids that touch.
    #[arg(long)]
    keep_duplicates: bool,
    /// Left and right change places: for a mirrored file.
    #[arg(long)]
    mirrored: bool,
    /// Proposes landmarks, muscles and regions of the generic face on the mesh, to be corrected by hand.
    #[arg(long)]
    transfer: bool,
    /// The mesh has published vertex numbers, by which landmarks are bound exactly (a CANDIDE-3 .wfm is known by itself).
    #[arg(long, value_enum, value_name = "SET", requires = "transfer")]
    numbers: Option<Numbers>,
    /// Refuses a surface with a fault instead of repairing it.
    #[arg(long)]
    strict: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Keep {
    /// All of it.
    Everything,
    /// The connected surface with the largest area.
    Largest,
    /// The front of the head, cut out of a head or a whole body.
    Face,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Numbers {
    /// The 468-vertex tracking mesh of MediaPipe.
    #[value(name = "468")]
    Tracking468,
    /// CANDIDE-3.
    Candide3,
}

/// Landmarks of less confidence are named.
const DOUBTFUL: f64 = 0.5;
/// Vertices of CANDIDE-3.
const CANDIDE3_VERTICES: u32 = 113;

impl Arguments {
    fn options(&self) -> Result<ImportOptions, ImportError> {
        let axes = match (self.up, self.front) {
            (Some(up), Some(front)) => Some(Axes::new(up, front)?),
            _ => None,
        };
        Ok(ImportOptions {
            mm_per_unit: self.mm_per_unit,
            axes,
            keep: match self.keep {
                Keep::Everything => import::Keep::Everything,
                Keep::Largest => import::Keep::LargestPiece,
                Keep::Face => import::Keep::Face,
            },
            groups: self.groups.clone(),
            merge_duplicates: !self.keep_duplicates,
            mirrored: self.mirrored,
            strict: self.strict,
        })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let refused = |source: ImportError| CliError::Mesh { path: arguments.mesh.clone(), source };
    let options = arguments.options().map_err(refused)?;
    let bytes = file::read_bytes(&arguments.mesh)?;
    let file_name = arguments.mesh.file_name().unwrap_or_default().to_string_lossy();
    let imported = import::read(&bytes, &file_name, &options).map_err(refused)?;
    for repair in &imported.repairs {
        println!("note: {repair}");
    }
    let name = arguments.name.as_deref().unwrap_or(&file_name);
    let face = if arguments.transfer {
        let candide = import::Format::of(&bytes, &file_name) == Some(import::Format::Wfm)
            && imported.vertices_in_file == CANDIDE3_VERTICES;
        let numbering = match arguments.numbers {
            Some(Numbers::Tracking468) => Some(Numbering::Tracking468),
            Some(Numbers::Candide3) => Some(Numbering::Candide3),
            None => candide.then_some(Numbering::Candide3),
        };
        let generic = face::generic();
        let known =
            numbering.map(|n| transfer::known_numbers(&generic, n, &imported.vertex_in_file)).unwrap_or_default();
        let proposal = transfer::propose(&generic, &imported.mesh, name, &known)
            .map_err(|source| CliError::Transfer { path: arguments.mesh.clone(), source })?;
        say(&proposal);
        proposal.face
    } else {
        imported.into_face(name).map_err(|e| refused(e.into()))?
    };
    println!("{}", counts(&face));
    print!("{}", check::check_against(&face, &Expectations::imported()));
    write(&arguments.out, face::file::to_json(&face))
}

/// What was proposed, the doubtful by name.
fn say(proposal: &transfer::Proposal) {
    println!("the generic face lies within {:.2} mm of the mesh", proposal.rms_mm);
    for l in &proposal.landmarks {
        match l.vertex {
            None => println!("note: the mesh does not reach the landmark {}", l.id),
            Some(v) if l.confidence < DOUBTFUL => {
                println!("note: check the landmark {} at vertex {v} (confidence {:.2})", l.id, l.confidence);
            }
            Some(_) => {}
        }
    }
    for id in &proposal.muscles_left_out {
        println!("note: the muscle {id} has no place on the mesh");
    }
}
