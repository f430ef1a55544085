//! Holds the house: a room uses only lower floors, `cli` and `gui` never meet, and only `gui` names egui.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop at what it did not expect")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Every room of `src/` and its floor. Rooms on one floor do not know each other.
const FLOORS: &[(&str, u8)] = &[
    ("face", 1),
    ("camera", 1),
    ("frames", 1),
    ("skin", 1),
    ("draw", 1),
    ("customize", 2),
    ("displacement", 2),
    ("forces", 2),
    ("marking", 2),
    ("muscle", 2),
    ("fit", 3),
    ("project", 3),
    ("simulate", 3),
    ("pipeline", 5),
    ("expression", 4),
    ("doubt", 6),
    ("muscle_field", 6),
    ("suggest", 6),
    ("study", 7),
    ("export", 8),
    ("import", 9),
    ("cli", 10),
    ("gui", 10),
];

/// Crates that only the window may name.
const WINDOW_CRATES: &[&str] = &["egui", "eframe", "rfd", "egui_plot", "egui_extras"];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

/// The room of a source file: the first part of its path under `src/`.
fn room(path: &Path, src: &Path) -> String {
    let first = path.strip_prefix(src).unwrap().components().next().unwrap();
    first.as_os_str().to_str().unwrap().trim_end_matches(".rs").to_owned()
}

/// Rooms that a line names through `crate::…`, also inside braces: `use crate::{camera::Camera, face};`.
fn rooms_named(text: &str) -> Vec<String> {
    let mut named = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        let word = |s: &str| s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 1;
            let mut item = true;
            for (i, c) in group.char_indices() {
                if item && depth == 1 && (c.is_alphabetic() || c == '_') {
                    named.push(word(&group[i..]));
                    item = false;
                }
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 1 => item = true,
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
            }
        } else {
            named.push(word(rest));
        }
    }
    named
}

fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|l| !l.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn a_room_uses_only_lower_floors() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let floors: BTreeMap<&str, u8> = FLOORS.iter().copied().collect();
    let mut broken = Vec::new();
    for path in sources(&src) {
        let here = room(&path, &src);
        if here == "lib" || here == "main" {
            continue;
        }
        let Some(&floor) = floors.get(here.as_str()) else {
            broken.push(format!("{}: room {here} has no floor", path.display()));
            continue;
        };
        for other in rooms_named(&code(&path)) {
            if other != here && floors.get(other.as_str()).is_some_and(|&f| f >= floor) {
                broken.push(format!("{}: {here} (floor {floor}) uses {other}", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

#[test]
fn only_the_window_names_the_window_toolkit() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&src).into_iter().filter(|p| room(p, &src) != "gui") {
        let code = code(&path);
        for name in WINDOW_CRATES {
            assert!(!code.contains(&format!("{name}::")), "{} names {name}", path.display());
        }
    }
}

#[test]
fn every_source_file_opens_with_a_sentence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for path in
        ["src", "tests", "benches"].iter().map(|f| root.join(f)).filter(|f| f.exists()).flat_map(|f| sources(&f))
    {
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("//! "), "{} does not say what it is", path.display());
    }
}

#[test]
fn the_reader_of_imports_sees_groups() {
    let text = "use crate::{camera::{Camera, Ray}, face};\nuse crate::skin::Curve;";
    assert_eq!(rooms_named(text), ["camera", "face", "skin"]);
}
