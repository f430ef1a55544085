//! An expression as numbers: how much of each actuator is used, and how far the jaw is open; and its file.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::jaw::WIDEST_DEG;
use crate::project::json;
use crate::project::whole_file::{self, Durability};

/// The version that this program writes, and the highest that it reads.
pub const VERSION: u64 = 1;
/// What the names of expression files end in.
pub const EXTENSION: &str = "expression.json";
/// Largest activation: twice what people can do.
pub const LARGEST_ACTIVATION: f64 = 2.0;
/// Largest file that is opened.
pub const MAX_BYTES: u64 = 1 << 20;

/// How much of each actuator is used.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expression {
    /// Name for people.
    pub name: String,
    /// Activation, 0 to 2, by the actuator's id; one that is not named is at rest.
    #[serde(default)]
    pub activations: BTreeMap<String, f64>,
    /// How far the jaw is open, degrees, 0 to 35.
    #[serde(default)]
    pub jaw_deg: f64,
}

/// Why an expression makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExpressionError {
    /// Nothing to call it by, or a page of text.
    #[error("the name has {length} characters; it must have 1 to 80 on one line")]
    Name {
        /// Its length.
        length: usize,
    },
    /// A muscle that pushes, or pulls more than twice as much as any.
    #[error("the activation of {id} is {value}; it must lie between 0 and {LARGEST_ACTIVATION}")]
    Activation {
        /// The actuator.
        id: String,
        /// Its activation.
        value: f64,
    },
    /// A jaw that no joint allows.
    #[error("the jaw is open by {value} degrees; it must lie between 0 and {WIDEST_DEG}")]
    Jaw {
        /// The angle, degrees.
        value: f64,
    },
}

/// Why an expression file could not be read or written. `Display` is one line.
#[derive(Debug, thiserror::Error)]
pub enum ExpressionFileError {
    /// The file cannot be read.
    #[error("{}: cannot be read ({source}); check the path and its permissions", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is larger than any expression.
    #[error("{}: is larger than 1 MB, which no expression is; check that this is an expression file", .path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// No text, not JSON, or a field is missing, unknown, twice, or of the wrong type.
    #[error("{}: line {line}, column {column}{}{place}: {reason}; mend it there", .path.display(), if .place.is_empty() { "" } else { ", field " })]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The field; empty where there is none.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// JSON, but no expression.
    #[error("{}: is not a Frontalis expression (it has no field `frontalis_expression`); choose a file that ends in .{EXTENSION}", .path.display())]
    NotAnExpression {
        /// The file.
        path: PathBuf,
    },
    /// A newer program wrote it.
    #[error("{}: made by a newer Frontalis (format {found}, this one reads up to {VERSION}): update Frontalis", .path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
    },
    /// A value that makes no sense.
    #[error("{}: {source}", .path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Which.
        source: ExpressionError,
    },
    /// The file cannot be written; what was there is still there.
    #[error("{}: cannot be written ({source}); choose another folder, or free it for writing", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The field that is read before anything else.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    frontalis_expression: Option<u64>,
}

/// Version 1, as read and as written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct V1 {
    frontalis_expression: u64,
    name: String,
    #[serde(default)]
    activations: BTreeMap<String, f64>,
    #[serde(default)]
    jaw_deg: f64,
}

impl Expression {
    /// The activation of an actuator; 0 where it is not named.
    pub fn activation(&self, id: &str) -> f64 {
        self.activations.get(id).copied().unwrap_or(0.0)
    }

    /// The same with left and right exchanged: ids that end in `_left` and `_right` swap.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let across = |id: &String| match (id.strip_suffix("_left"), id.strip_suffix("_right")) {
            (Some(stem), _) => format!("{stem}_right"),
            (_, Some(stem)) => format!("{stem}_left"),
            _ => id.clone(),
        };
        let activations = self.activations.iter().map(|(id, a)| (across(id), *a)).collect();
        Self { activations, ..self.clone() }
    }

    /// The same with every activation and the jaw times a factor, held in their ranges.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        let scaled = |(id, a): (&String, &f64)| (id.clone(), (a * factor).clamp(0.0, LARGEST_ACTIVATION));
        Self {
            name: self.name.clone(),
            activations: self.activations.iter().map(scaled).collect(),
            jaw_deg: (self.jaw_deg * factor).clamp(0.0, WIDEST_DEG),
        }
    }

    /// The first thing in it that makes no sense.
    pub fn check(&self) -> Option<ExpressionError> {
        let length = self.name.chars().count();
        if !(1..=80).contains(&length) || self.name.chars().any(char::is_control) {
            return Some(ExpressionError::Name { length });
        }
        if let Some((id, &value)) = self.activations.iter().find(|(_, a)| !(0.0..=LARGEST_ACTIVATION).contains(*a)) {
            return Some(ExpressionError::Activation { id: id.clone(), value });
        }
        (!(0.0..=WIDEST_DEG).contains(&self.jaw_deg)).then_some(ExpressionError::Jaw { value: self.jaw_deg })
    }

    /// Reads an expression file; refuses whatever is not one, down to single values.
    pub fn load(path: &Path) -> Result<Self, ExpressionFileError> {
        let failed = |source| ExpressionFileError::Read { path: path.to_owned(), source };
        if !fs::metadata(path).map_err(failed)?.is_file() {
            return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "it is not a file")));
        }
        let mut bytes = Vec::new();
        fs::File::open(path).map_err(failed)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(ExpressionFileError::TooLarge { path: path.to_owned() });
        }
        Self::parse(path, &bytes)
    }

    /// An expression from the bytes of a file, version first; `path` serves the messages alone.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, ExpressionFileError> {
        let path = || path.to_owned();
        let syntax = |fault: json::JsonFault| ExpressionFileError::Syntax {
            path: path(),
            line: fault.line,
            column: fault.column,
            place: fault.place,
            reason: fault.reason,
        };
        let text = std::str::from_utf8(bytes).map_err(|e| {
            let before = String::from_utf8_lossy(&bytes[..e.valid_up_to()]);
            let line = before.split('\n').count();
            let column = before.rsplit('\n').next().map_or(0, str::len) + 1;
            ExpressionFileError::Syntax {
                path: path(),
                line,
                column,
                place: String::new(),
                reason: "not UTF-8".to_owned(),
            }
        })?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let head: Head = json::with_place(text).map_err(syntax)?;
        match head.frontalis_expression {
            None | Some(0) => return Err(ExpressionFileError::NotAnExpression { path: path() }),
            Some(VERSION) => {}
            Some(found) => return Err(ExpressionFileError::Newer { path: path(), found }),
        }
        let V1 { name, activations, jaw_deg, .. } = json::read(text).map_err(syntax)?;
        let expression = Self { name, activations, jaw_deg };
        match expression.check() {
            Some(source) => Err(ExpressionFileError::Value { path: path(), source }),
            None => Ok(expression),
        }
    }

    /// Writes an expression file, whole or not at all; one that could not be read back is not written.
    pub fn save(&self, path: &Path) -> Result<(), ExpressionFileError> {
        if let Some(source) = self.check() {
            return Err(ExpressionFileError::Value { path: path.to_owned(), source });
        }
        let failed = |source| ExpressionFileError::Write { path: path.to_owned(), source };
        let Self { name, activations, jaw_deg } = self.clone();
        let file = V1 { frontalis_expression: VERSION, name, activations, jaw_deg };
        let bytes = json::write(&file).map_err(|e| failed(e.into()))?;
        whole_file::write(path, &bytes, Durability::Disk).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smirk() -> Expression {
        let activations = [("zygomaticus_major_left", 1.25), ("orbicularis_oris", 0.1)];
        let activations = activations.map(|(id, a)| (id.to_owned(), a)).into_iter().collect();
        Expression { name: "Smirk".to_owned(), activations, jaw_deg: 2.5 }
    }

    fn refused(text: &str) -> String {
        Expression::parse(Path::new("a.expression.json"), text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn what_is_saved_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("smirk.expression.json");
        smirk().save(&path).unwrap();
        assert_eq!(Expression::load(&path).unwrap(), smirk());
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("{\n  \"frontalis_expression\": 1,\n  \"name\": \"Smirk\""), "{text}");
        assert!(Expression::load(folder.path()).unwrap_err().to_string().contains("not a file"));
        let wrong = Expression { jaw_deg: f64::NAN, ..smirk() };
        assert!(wrong.save(&path).is_err() && Expression::load(&path).unwrap() == smirk());
    }

    #[test]
    fn broken_files_are_refused_with_one_line_that_says_where() {
        let good = r#"{"frontalis_expression": 1, "name": "A", "activations": {"a": 1}, "jaw_deg": 0}"#;
        assert!(Expression::parse(Path::new("a"), good.as_bytes()).is_ok());
        for (from, to, says) in [
            ("1, \"name\"", "2, \"name\"", "newer Frontalis (format 2"),
            ("frontalis_expression", "frontalis_project", "is not a Frontalis expression"),
            ("{\"a\": 1}", "{\"a\": 1, \"a\": 2}", "`a` stands twice"),
            ("{\"a\": 1}", "{\"a\": 2.5}", "the activation of a is 2.5"),
            ("{\"a\": 1}", "{\"a\": -0.1}", "the activation of a is -0.1"),
            ("{\"a\": 1}", "{\"a\": \"x\"}", "field activations.a"),
            ("\"jaw_deg\": 0", "\"jaw_deg\": 36", "the jaw is open by 36 degrees"),
            ("\"jaw_deg\": 0", "\"jaws\": 0", "unknown field `jaws`"),
            ("\"A\"", "\"\"", "the name has 0 characters"),
        ] {
            let text = refused(&good.replacen(from, to, 1));
            assert!(text.contains(says) && !text.contains('\n'), "{says}: {text}");
        }
        assert!(refused("\u{1}").contains("line 1") && refused(&good[..good.len() - 3]).contains("line 1"));
        let no_text = Expression::parse(Path::new("a"), b"{\n\xff").unwrap_err().to_string();
        assert!(no_text.contains("line 2, column 1: not UTF-8"), "{no_text}");
    }

    #[test]
    fn sides_are_exchanged_and_middles_stay() {
        let other = smirk().mirrored();
        assert_eq!(
            (other.activation("zygomaticus_major_right"), other.activation("zygomaticus_major_left")),
            (1.25, 0.0)
        );
        assert_eq!(other.activation("orbicularis_oris"), 0.1);
        assert_eq!(other.mirrored(), smirk());
    }

    #[test]
    fn a_factor_stays_in_range() {
        let all = smirk().times(2.0);
        assert_eq!(
            (all.activation("zygomaticus_major_left"), all.activation("orbicularis_oris"), all.jaw_deg),
            (2.0, 0.2, 5.0)
        );
        assert_eq!(all.check(), None);
        assert_eq!(smirk().times(0.0).jaw_deg, 0.0);
    }
}
