//! The file format of a face model: JSON, version first, described field by field in `docs/face-format.md`.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::{FaceError, FaceModel, FaceParts, Landmark, Mesh, Muscle, MusclePreset, Region};

/// The version that is written, and the newest that is read.
pub const VERSION: u32 = 2;
/// Largest file that is read, bytes: a scan of ten million vertices fits.
pub const MAX_BYTES: u64 = 1 << 30;

/// Why a face file was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum FaceFileError {
    /// The file cannot be opened or read.
    #[error("cannot read the face file {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is larger than any face.
    #[error("the face file {path} is larger than {limit} bytes; reduce the mesh first", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// [`MAX_BYTES`].
        limit: u64,
    },
    /// The text is not JSON, or a field is missing, unknown or of the wrong type.
    #[error("the face file {path} is damaged at line {line}, column {column}: {reason}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was met there.
        reason: String,
    },
    /// Another program version wrote the file.
    #[error(
        "the face file {path} has version {found}, this program reads versions 1 to {VERSION}; use a newer Frontalis",
        path = path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// The version it states.
        found: u64,
    },
    /// The parts do not make a face.
    #[error("the face file {path} does not hold a face: {source}", path = path.display())]
    Face {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: FaceError,
    },
    /// The file cannot be written.
    #[error("cannot write the face file {path}: {source}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// Read before all else, so that a newer file is named as such and not as damaged.
#[derive(Deserialize)]
struct Head {
    version: u64,
}

/// Version 2 added fields to version 1 and changed none, so it reads both.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct V2 {
    #[expect(dead_code, reason = "read as part of the head")]
    version: u64,
    name: String,
    positions_mm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    #[serde(default)]
    mirror: Option<Vec<Option<u32>>>,
    #[serde(default)]
    landmarks: Vec<Landmark>,
    #[serde(default)]
    muscles: Vec<Muscle>,
    #[serde(default)]
    muscle_presets: Vec<MusclePreset>,
    #[serde(default)]
    regions: Vec<Region>,
}

/// Reads a face model from a file.
pub fn read(path: &Path) -> Result<FaceModel, FaceFileError> {
    parse(&read_bytes(path)?, path)
}

/// The bytes of a face model or mesh file, up to [`MAX_BYTES`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, FaceFileError> {
    let failed = |source| FaceFileError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    // Read one byte beyond the limit instead of asking for the length: a device or a pipe has none.
    File::open(path).map_err(failed)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(FaceFileError::TooLarge { path: path.to_owned(), limit: MAX_BYTES });
    }
    Ok(bytes)
}

/// Reads a face model from the bytes of a file; `path` only names it in errors.
pub fn parse(bytes: &[u8], path: &Path) -> Result<FaceModel, FaceFileError> {
    let damaged = |e: serde_json::Error| FaceFileError::Format {
        path: path.to_owned(),
        line: e.line(),
        column: e.column(),
        // serde_json ends its message with the position, which stands in the sentence already.
        reason: e.to_string().split(" at line ").next().unwrap_or_default().to_owned(),
    };
    let head: Head = serde_json::from_slice(bytes).map_err(damaged)?;
    if !(1..=u64::from(VERSION)).contains(&head.version) {
        return Err(FaceFileError::Version { path: path.to_owned(), found: head.version });
    }
    let v2: V2 = serde_json::from_slice(bytes).map_err(damaged)?;
    let unfit = |source| FaceFileError::Face { path: path.to_owned(), source };
    let positions: Vec<_> = v2.positions_mm.into_iter().map(Point3::from).collect();
    let mirror = v2.mirror.unwrap_or_else(|| vec![None; positions.len()]);
    let mesh = Mesh::new(positions, v2.triangles).map_err(|e| unfit(e.into()))?;
    let parts = FaceParts {
        name: v2.name,
        landmarks: v2.landmarks,
        muscles: v2.muscles,
        muscle_presets: v2.muscle_presets,
        mirror,
        regions: v2.regions,
    };
    FaceModel::new(mesh, parts).map_err(unfit)
}

/// The text of the file: one row a line, so that two versions of a face can be compared line by line.
pub fn to_json(face: &FaceModel) -> String {
    let mut text = format!("{{\n  \"version\": {VERSION},\n  \"name\": {},\n", json(&face.name()));
    rows(&mut text, "positions_mm", face.mesh().positions());
    rows(&mut text, "triangles", face.mesh().triangles());
    if face.mirror().iter().any(Option::is_some) {
        let _ = writeln!(text, "  \"mirror\": {},", json(&face.mirror()));
    }
    rows(&mut text, "landmarks", face.landmarks());
    rows(&mut text, "muscles", face.muscles());
    if !face.muscle_presets().is_empty() {
        rows(&mut text, "muscle_presets", face.muscle_presets());
    }
    rows(&mut text, "regions", face.regions());
    text.truncate(text.trim_end_matches([',', '\n']).len());
    text.push_str("\n}\n");
    text
}

fn rows<T: Serialize>(text: &mut String, field: &str, rows: &[T]) {
    let lines: Vec<String> = rows.iter().map(|row| format!("\n    {}", json(row))).collect();
    let _ = writeln!(text, "  \"{field}\": [{}\n  ],", lines.join(","));
}

/// These values are strings, finite numbers and lists of them: serialisation has nothing to fail on.
fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// Writes a face model: the file appears whole or not at all.
pub fn write(face: &FaceModel, path: &Path) -> Result<(), FaceFileError> {
    let failed = |source| FaceFileError::Write { path: path.to_owned(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    file.write_all(to_json(face).as_bytes()).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = r#"{
  "version": 1,
  "name": "Square",
  "positions_mm": [[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]],
  "triangles": [[0, 1, 2], [0, 2, 3]],
  "mirror": [1, 0, 3, 2],
  "landmarks": [{"id": "a", "name": "A", "hint": "Here.", "vertex": 2}],
  "muscles": [{"id": "m", "latin": "M", "action_unit": 1, "side": "left", "attachment": 0, "insertion": 2, "half_width_mm": 5}],
  "regions": [{"id": "r", "vertices": [0, 1]}]
}"#;

    fn refusal(text: &str) -> String {
        parse(text.as_bytes(), Path::new("square.json")).unwrap_err().to_string()
    }

    #[test]
    fn a_face_comes_back_exactly_as_it_was_saved() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("face.json");
        for face in [parse(SMALL.as_bytes(), &path).unwrap(), crate::face::generic::generate().unwrap()] {
            write(&face, &path).unwrap();
            assert_eq!(read(&path).unwrap(), face);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
    }

    #[test]
    fn only_the_mesh_and_its_name_are_required() {
        let face = parse(
            br#"{"version":1,"name":"T","positions_mm":[[0,0,0],[1,0,0],[0,1,0]],"triangles":[[0,1,2]]}"#,
            Path::new("t.json"),
        )
        .unwrap();
        assert_eq!(face.mirror(), &[None, None, None]);
    }

    #[test]
    fn damage_is_named_with_its_line() {
        for (from, to, said) in [
            ("\"Square\"", "7", "line 3|invalid type: integer `7`, expected a string"),
            ("[1, 1, 0.1]", "[1, 1, 1e999]", "line 4|number out of range"),
            ("[1, 1, 0.1]", "[1, 1, NaN]", "line 4|expected value"),
            ("[1, 1, 0.1]", "[1, 1]", "line 4"),
            ("[0, 2, 3]", "[0, 2, -3]", "line 5|invalid value: integer `-3`, expected u32"),
            ("\"hint\"", "\"tip\"", "line 7|unknown field `tip`"),
            ("\"regions\"", "\"areas\"", "line 9|unknown field `areas`"),
            ("\"version\": 1,", "", "missing field `version`"),
            ("\"left\"", "\"middle\"", "unknown variant `middle`, expected `left` or `right`"),
        ] {
            let error = refusal(&SMALL.replace(from, to));
            let (line, reason) = said.split_once('|').unwrap_or(("line", said));
            let named = error.contains("square.json") && error.contains(line) && error.contains(reason);
            assert!(named, "{from} -> {to}: {error}");
        }
        for end in 0..SMALL.len() {
            assert!(refusal(&SMALL[..end]).contains("is damaged at line"));
        }
    }

    #[test]
    fn parts_that_do_not_fit_are_named() {
        for (from, to, said) in [
            ("[0, 2, 3]", "[0, 2, 4]", "triangle 1 names vertex 4, but there are only 4 vertices"),
            ("[0, 2, 3]", "[0, 2, 2]", "triangle 1 names vertex 2 twice"),
            ("\"vertex\": 2", "\"vertex\": 9", "landmark a is bound to vertex 9"),
            ("\"half_width_mm\": 5", "\"half_width_mm\": -5", "muscle m has no length or no width"),
            ("[1, 0, 3, 2]", "[1, 0]", "the mirror table has 2 rows for 4 vertices"),
            ("\"version\": 1", "\"version\": 3", "has version 3, this program reads versions 1 to 2"),
            ("\"version\": 1", "\"version\": 0", "has version 0"),
        ] {
            let error = refusal(&SMALL.replace(from, to));
            assert!(error.contains(said), "{from} -> {to}: {error}");
        }
    }

    #[test]
    fn a_missing_file_and_an_unwritable_folder_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("none").join("face.json");
        assert!(read(&missing).unwrap_err().to_string().contains("cannot read the face file"));
        let face = parse(SMALL.as_bytes(), &missing).unwrap();
        assert!(write(&face, &missing).unwrap_err().to_string().contains("cannot write the face file"));
    }
}
