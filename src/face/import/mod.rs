//! Meshes of other programs (OBJ, PLY, CANDIDE): read, repaired where that can be done honestly, and turned into face space.
//!
//! [`read`] takes the bytes of a file and gives a [`Mesh`] in millimetres with y up and z towards the camera, together with a list
//! of everything that was changed or guessed on the way. What cannot be understood is refused with its line, or its byte in a
//! binary file. Memory stays in proportion to the file: numbers that a header declares are never believed before the data come.

mod axes;
mod clean;
mod face_part;
mod obj;
mod orient;
mod ply;
mod polygon;
pub mod target;
mod unit;
mod wfm;

use std::fmt;

use nalgebra::Point3;

pub use axes::{Axes, Direction};
pub use obj::write_obj;

use super::{FaceError, FaceModel, FaceParts, Mesh, MeshError, mirror};

/// A mesh format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: text, polygons.
    Obj,
    /// Stanford PLY: text or binary, polygons.
    Ply,
    /// CANDIDE wireframe: text, triangles.
    Wfm,
}

impl Format {
    /// The format of a file by its first bytes where they say it (PLY), or else by the ending of its name.
    pub fn of(bytes: &[u8], name: &str) -> Option<Self> {
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            _ if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "wfm" => Some(Self::Wfm),
            _ => None,
        }
    }
}

/// How much of the mesh is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// Everything.
    #[default]
    Everything,
    /// The connected surface with the largest area, without eyeballs, teeth or helper shapes.
    LargestPiece,
    /// The front of the head, cut out of a head or a whole body.
    Face,
}

/// Choices of the import.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// Millimetres that one unit of the file stands for; absent (default) = guessed from the size.
    pub mm_per_unit: Option<f64>,
    /// Which ways are up and front in the file; absent (default) = guessed from the shape, y up and z to the front if in doubt.
    pub axes: Option<Axes>,
    /// How much is kept (default: everything).
    pub keep: Keep,
    /// Only these groups of an OBJ file are read; none named (default) = all.
    pub groups: Vec<String>,
    /// Whether vertices at exactly the same place become one (default true). Turn it off for closed lips or lids that touch; those
    /// of a CANDIDE wireframe are never merged.
    pub merge_duplicates: bool,
    /// Whether left and right change places (default false): for a mirrored file.
    pub mirrored: bool,
    /// Refuses a mesh whose surface needs a repair, instead of repairing it (default false). Guesses of unit and axes stay.
    pub strict: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            mm_per_unit: None,
            axes: None,
            keep: Keep::Everything,
            groups: Vec::new(),
            merge_duplicates: true,
            mirrored: false,
            strict: false,
        }
    }
}

/// A mesh in face space, and what was done to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The mesh, mm.
    pub mesh: Mesh,
    /// For each vertex its number in the file, from 0.
    pub vertex_in_file: Vec<u32>,
    /// Number of vertices in the file.
    pub vertices_in_file: u32,
    /// Millimetres that one unit of the file was taken for.
    pub mm_per_unit: f64,
    /// Everything that was changed or guessed, in the order in which it was done.
    pub repairs: Vec<Repair>,
}

impl Imported {
    /// The mesh as a face: with its mirror table, still without landmarks and muscles.
    pub fn into_face(self, name: &str) -> Result<FaceModel, FaceError> {
        let parts = FaceParts { name: name.to_owned(), mirror: mirror::detect(&self.mesh), ..FaceParts::default() };
        FaceModel::new(self.mesh, parts)
    }
}

/// Something that was changed or guessed.
#[derive(Clone, Debug, PartialEq)]
pub enum Repair {
    /// Vertices at exactly the same place were made one.
    Merged(usize),
    /// Triangles without an area were left out.
    Degenerate(usize),
    /// Triangles that stood twice were left out.
    Duplicate(usize),
    /// Polygons whose outline crosses itself were cut as fans.
    CrossedPolygons(usize),
    /// The surface forked or touched itself, and was cut apart there.
    Cut {
        /// Edges with more than two triangles.
        edges: usize,
        /// Vertices at which the surface only touched itself.
        points: usize,
        /// A vertex of the file at which this was.
        first_in_file: u32,
    },
    /// Triangles turned so that neighbours face the same way.
    Aligned(usize),
    /// Triangles turned because their surface was wound inwards.
    TurnedOutwards(usize),
    /// Surfaces other than the largest were left out.
    SmallPieces {
        /// How many surfaces.
        pieces: usize,
        /// Their triangles.
        triangles: usize,
    },
    /// The face was cut out of a head or body.
    CutOut {
        /// Triangles kept.
        kept: usize,
        /// Triangles before.
        of: usize,
    },
    /// Vertices of no triangle were left out.
    Unused(usize),
    /// Up and front were guessed.
    GuessedAxes(Axes),
    /// The unit was guessed.
    GuessedUnit {
        /// Millimetres a unit.
        mm_per_unit: f64,
        /// Name of the unit, or why there is none.
        unit: &'static str,
        /// Height of the mesh with that unit, mm.
        height_mm: f64,
    },
    /// The mesh was moved sideways onto its plane of symmetry, mm.
    Centred(f64),
}

impl Repair {
    /// Whether the surface itself was at fault; else it is a guess or a choice.
    fn is_fault(&self) -> bool {
        matches!(
            self,
            Self::Merged(_)
                | Self::Degenerate(_)
                | Self::Duplicate(_)
                | Self::CrossedPolygons(_)
                | Self::Cut { .. }
                | Self::Aligned(_)
                | Self::TurnedOutwards(_)
                | Self::Unused(_)
        )
    }
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Merged(n) => write!(f, "{n} vertices lay exactly on others and were merged with them"),
            Self::Degenerate(n) => write!(f, "{n} triangles without an area were left out"),
            Self::Duplicate(n) => write!(f, "{n} triangles stood twice and were left out"),
            Self::CrossedPolygons(n) => write!(f, "{n} polygons cross themselves and were cut as fans"),
            Self::Cut { edges, points, first_in_file } => write!(
                f,
                "the surface forked at {edges} edges and touched itself at {points} vertices, and was cut apart there (first at vertex {first_in_file} of the file)"
            ),
            Self::Aligned(n) => write!(f, "{n} triangles were turned to face the same way as their neighbours"),
            Self::TurnedOutwards(n) => write!(f, "{n} triangles were wound inwards and were turned outwards"),
            Self::SmallPieces { pieces, triangles } => {
                write!(f, "{pieces} smaller surfaces with {triangles} triangles were left out")
            }
            Self::CutOut { kept, of } => write!(f, "the face was cut out: {kept} of {of} triangles"),
            Self::Unused(n) => write!(f, "{n} vertices belong to no triangle and were left out"),
            Self::GuessedAxes(axes) => write!(f, "guessed from the shape: {axes}"),
            Self::GuessedUnit { mm_per_unit, unit, height_mm } => {
                write!(
                    f,
                    "guessed from the size: {mm_per_unit} mm a unit ({unit}), which makes it {height_mm:.0} mm high"
                )
            }
            Self::Centred(by) => write!(f, "moved by {by:.2} mm sideways onto the plane of symmetry"),
        }
    }
}

/// Why a mesh file was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// A line cannot be understood.
    #[error("line {line}: {reason}")]
    Line {
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The data of a binary file cannot be understood.
    #[error("byte {byte}: {reason}")]
    Byte {
        /// Offset from the beginning of the file.
        byte: usize,
        /// What is wrong there.
        reason: String,
    },
    /// The format is not known.
    #[error("a mesh file ends in .obj, .ply or .wfm, but this one is named `{0}`")]
    Format(String),
    /// A group that is not in the file.
    #[error("there is no group `{name}`; the file has {found}")]
    NoGroup {
        /// The group asked for.
        name: String,
        /// Some that are there.
        found: String,
    },
    /// An option cannot be.
    #[error("{0}")]
    Option(&'static str),
    /// A surface with a fault, where no repair is wanted.
    #[error("the surface has a fault: {0}; read it without --strict to have it repaired")]
    Fault(Repair),
    /// The surface has only one side.
    #[error("the surface has only one side: it cannot be turned outwards at vertex {vertex} of the file")]
    OneSided {
        /// A vertex of the file.
        vertex: u32,
    },
    /// No face was found to cut out.
    #[error("no face was found to cut out: {0}")]
    NoFace(&'static str),
    /// The parts do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh does not make a face.
    #[error(transparent)]
    Face(#[from] FaceError),
}

/// Points and triangles as they stand in a file.
#[derive(Debug, Default)]
struct Soup {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// For each vertex its number in the file.
    in_file: Vec<u32>,
    crossed_polygons: usize,
}

/// Reads a mesh; `name` is that of the file, for its format.
///
/// # Errors
/// A line or byte that cannot be understood, and parts that make no mesh.
pub fn read(bytes: &[u8], name: &str, options: &ImportOptions) -> Result<Imported, ImportError> {
    if options.mm_per_unit.is_some_and(|s| !(s > 0.0 && s <= 1e9)) {
        return Err(ImportError::Option("millimetres a unit must be greater than 0 and at most 1e9"));
    }
    let mut soup = match Format::of(bytes, name) {
        Some(Format::Obj) => obj::parse(&String::from_utf8_lossy(bytes), &options.groups)?,
        Some(Format::Ply) => ply::parse(bytes)?,
        Some(Format::Wfm) => wfm::parse(&String::from_utf8_lossy(bytes))?,
        None => return Err(ImportError::Format(name.to_owned())),
    };
    let (vertices, triangles) = (soup.positions.len(), soup.triangles.len());
    if vertices < 3 || triangles == 0 {
        return Err(MeshError::Empty { vertices, triangles }.into());
    }
    let vertices_in_file = vertices as u32;
    soup.in_file = (0..vertices_in_file).collect();

    let mut repairs = Vec::new();
    if soup.crossed_polygons > 0 {
        repairs.push(Repair::CrossedPolygons(soup.crossed_polygons));
    }
    // Parts that are not kept may be as faulty as they like: they leave first where no cleaning is needed to tell them.
    // A wireframe has no seams: where its vertices meet, lips or lids touch.
    let merge = options.merge_duplicates && Format::of(bytes, name) != Some(Format::Wfm);
    clean::surface(&mut soup, merge, &mut repairs);
    if options.keep == Keep::LargestPiece {
        clean::largest_piece(&mut soup, &mut repairs);
    }
    orient::outwards(&mut soup, &mut repairs)?;
    let axes = options.axes.unwrap_or_else(|| axes::guess(&soup));
    if options.axes.is_none() && axes != Axes::default() {
        repairs.push(Repair::GuessedAxes(axes));
    }
    axes::turn(&mut soup, axes);
    if options.mirrored {
        axes::mirror(&mut soup);
    }
    clean::drop_unused(&mut soup, &mut repairs);
    let mm_per_unit = unit::apply(&mut soup, options.mm_per_unit, &mut repairs)?;
    if options.keep == Keep::Face {
        face_part::cut_out(&mut soup, &mut repairs)?;
    }
    if options.strict
        && let Some(fault) = repairs.iter().find(|r| r.is_fault())
    {
        return Err(ImportError::Fault(fault.clone()));
    }
    let Soup { positions, triangles, in_file, .. } = soup;
    let mesh = Mesh::new(positions, triangles)?;
    let offset = mirror::plane_of_symmetry(&mesh);
    if offset.abs() <= 1e-3 {
        return Ok(Imported { mesh, vertex_in_file: in_file, vertices_in_file, mm_per_unit, repairs });
    }
    repairs.push(Repair::Centred(-offset));
    let positions = mesh.positions().iter().map(|p| Point3::new(p.x - offset, p.y, p.z)).collect();
    let mesh = mesh.with_positions(positions)?;
    Ok(Imported { mesh, vertex_in_file: in_file, vertices_in_file, mm_per_unit, repairs })
}

#[cfg(test)]
mod tests;
