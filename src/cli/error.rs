//! Why a command could not be done: one line that names what, where, and what to do.

use std::io;
use std::path::PathBuf;

use crate::customize::CustomizeError;
use crate::customize::transfer::TransferError;
use crate::draw::height_map::HeightMapError;
use crate::draw::svg::SvgError;
use crate::export::NoFrame;
use crate::face::file::FaceFileError;
use crate::face::generic::proportions::ProportionError;
use crate::face::import::ImportError;
use crate::frames::{FilmError, FrameError};
use crate::project::{FrameStatus, ProjectFileError};
use crate::study::TwinError;
use crate::study::people::PeopleError;
use crate::study::scene::PersonError;

/// Every way in which a command can fail.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The project file.
    #[error(transparent)]
    Project(#[from] ProjectFileError),
    /// Two projects cannot be compared.
    #[error(transparent)]
    NotComparable(#[from] crate::doubt::agreement::NotComparable),
    /// No muscles can be looked for.
    #[error(transparent)]
    NoMuscles(#[from] crate::muscle_field::Nothing),
    /// What was asked of a fit.
    #[error("{0}")]
    Question(String),
    /// An expression file.
    #[error(transparent)]
    Expression(#[from] crate::expression::ExpressionFileError),
    /// A face that cannot be made to move.
    #[error(transparent)]
    Stage(#[from] crate::expression::StageError),
    /// A scene of known truth that cannot be made.
    #[error(transparent)]
    Truth(#[from] crate::study::membrane_truth::TruthError),
    /// What the depth rules are measured on cannot be made.
    #[error(transparent)]
    Trial(#[from] crate::study::truth_trial::TrialError),
    /// An artist's field cannot be marked.
    #[error(transparent)]
    ArtistMarks(#[from] crate::study::artist_marks::MarksError),
    /// A play that failed; its files are written as far as it came.
    #[error("{failure} What it came to is in {}", .out.display())]
    Played {
        /// When, where, why, and what to change.
        failure: Box<crate::simulate::Failure>,
        /// Where its files are.
        out: PathBuf,
    },
    /// The report on the muscles.
    #[error(transparent)]
    Report(#[from] crate::export::muscle_report::ReportError),
    /// A frame's picture.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A file of marks.
    #[error(transparent)]
    Marks(#[from] crate::import::ImportError),
    /// A film.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// One frame was asked for twice.
    #[error("the first and the last frame are both frame {0}; choose two different ones with --first and --last")]
    SameFrame(usize),
    /// A frame's file is not the one that was marked.
    #[error("the {which} frame {status}, or add --ignore-frames to compute from the marks alone")]
    FrameFile {
        /// "first" or "last".
        which: &'static str,
        /// What became of it.
        status: FrameStatus,
    },
    /// A frame has another size than the project says.
    #[error("{}: is {found_w} × {found_h} px, but the project says {said_w} × {said_h}; correct width_px and height_px of its frame", .path.display())]
    FrameSize {
        /// The picture.
        path: PathBuf,
        /// Width found, px.
        found_w: u32,
        /// Height found, px.
        found_h: u32,
        /// Width that the project says, px.
        said_w: u32,
        /// Height that the project says, px.
        said_h: u32,
    },
    /// The face model.
    #[error(transparent)]
    Face(#[from] FaceFileError),
    /// Proportions that no face has.
    #[error(transparent)]
    Proportions(#[from] ProportionError),
    /// A mesh of another program.
    #[error("{}: {source}", .path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ImportError,
    },
    /// A target of displacements.
    #[error("{}: {source}", .path.display())]
    Target {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: crate::face::import::target::TargetError,
    },
    /// A muscle of a face makes no fibre.
    #[error(transparent)]
    Fibre(#[from] crate::muscle::FibreError),
    /// Nothing could be proposed on a mesh.
    #[error("{}: {source}", .path.display())]
    Transfer {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TransferError,
    },
    /// A face to compare with has not the landmarks for it.
    #[error("{}: has {shared} landmarks of the names of the generic face, at least 3 are needed; add them with `frontalis face import MESH --transfer`", .path.display())]
    NoCommonLandmarks {
        /// The file.
        path: PathBuf,
        /// Landmarks shared.
        shared: usize,
    },
    /// A face cannot be customised.
    #[error("the face cannot be customised: {0}")]
    Customize(#[from] CustomizeError),
    /// People cannot be drawn.
    #[error("the people cannot be made: {0}")]
    People(#[from] PeopleError),
    /// The face file is not the one that the project was made with.
    #[error("the face {0}")]
    FaceChanged(FrameStatus),
    /// The face is not fit.
    #[error("{0} does not pass the check; see the lines marked FAILED")]
    FaceFailed(String),
    /// The generator failed.
    #[error("the generic face could not be generated: {0}")]
    Generator(#[from] crate::face::FaceError),
    /// A face has no such preset of muscles.
    #[error("the face has no preset of muscles named `{0}`; `frontalis face show` lists them")]
    NoPreset(String),
    /// A drawing could not be painted.
    #[error("the picture could not be drawn: {0}")]
    Drawing(#[from] SvgError),
    /// Tracking needs both pictures.
    #[error("the project names no first or no last frame; open both in the window and save")]
    NoFrames,
    /// A format needs a frame.
    #[error(transparent)]
    NoFrame(#[from] NoFrame),
    /// The picture could not be drawn.
    #[error("the height map could not be drawn: {0}")]
    HeightMap(#[from] HeightMapError),
    /// The twin's settings make no scene.
    #[error("no twin can be made: {0}; see `frontalis twin --help`")]
    Twin(#[from] TwinError),
    /// The twin's person could not be made.
    #[error("no person can be made for the twin: {0}; try another --seed or --distance-mm")]
    Person(#[from] PersonError),
    /// A picture could not be encoded.
    #[error("{name} could not be encoded: {source}")]
    Encode {
        /// The file.
        name: &'static str,
        /// What the encoder says.
        source: image::ImageError,
    },
    /// The journal of a study.
    #[error(transparent)]
    Journal(#[from] crate::study::journal::JournalError),
    /// The chart of a study.
    #[error(transparent)]
    StudyFiles(#[from] crate::export::study_files::StudyFilesError),
    /// A study was stopped.
    #[error("the study was stopped; the same command goes on with it")]
    Stopped,
    /// An output cannot be written; what was there is still there.
    #[error("{}: cannot be written ({source}); choose another place for --out, or free it for writing", .path.display())]
    Write {
        /// The path.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// An output would replace an input.
    #[error("{}: is the project itself and is not overwritten; choose another place for --out", .0.display())]
    WouldReplaceInput(PathBuf),
    /// The check found faults.
    #[error("{}: {errors} {}; they are listed above", .path.display(), if *.errors == 1 { "error" } else { "errors" })]
    Faulty {
        /// The project.
        path: PathBuf,
        /// How many.
        errors: usize,
    },
}
