//! The command line end to end: the real program, good input and bad, its words, its exit status, and what it leaves on disk.

#![allow(clippy::unwrap_used, reason = "a test that cannot read its own files should stop there")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nalgebra::{Point3, Vector3};
use serde_json::Value;
use tempfile::TempDir;

fn frontalis(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_frontalis"));
    command.args(arguments).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command.output().unwrap()
}

fn done(arguments: &[&str]) -> String {
    let output = frontalis(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
    assert_eq!(stderr, "", "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The one line that says why a command could not be done.
fn refused(arguments: &[&str]) -> String {
    let output = frontalis(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert!(stderr.starts_with("error: ") && stderr.ends_with('\n'), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    stderr
}

/// Names in a folder, hidden ones included.
fn names(folder: &Path) -> BTreeSet<String> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

/// A folder with the embedded sample solved in `out`.
fn sample() -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    done(&["demo", "--out", out.to_str().unwrap()]);
    (dir, out)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The sample's project, changed and written beside it.
fn changed(out: &Path, change: impl FnOnce(&mut Value)) -> PathBuf {
    let kept = fs::read_to_string(out.join("sample.frontalis.json")).unwrap();
    let mut project: Value = serde_json::from_str(&kept).unwrap();
    change(&mut project);
    let path = out.join("changed.frontalis.json");
    fs::write(&path, serde_json::to_string(&project).unwrap()).unwrap();
    path
}

const RESULTS: [&str; 4] = ["forces.csv", "forces.vtp", "height_map.png", "report.json"];

/// One row of a table of numbers, the last column apart.
struct Row {
    numbers: Vec<f64>,
    last: String,
}

fn table(path: &Path) -> (String, Vec<Row>) {
    let content = fs::read_to_string(path).unwrap();
    let mut lines = content.lines();
    let header = lines.next().unwrap().to_owned();
    let rows = lines
        .map(|line| {
            let numbers = line.split(',').map(|f| f.parse().unwrap_or(f64::NAN)).collect();
            Row { numbers, last: line.rsplit(',').next().unwrap().to_owned() }
        })
        .collect();
    (header, rows)
}

fn point(row: &Row, from: usize) -> Point3<f64> {
    Point3::new(row.numbers[from], row.numbers[from + 1], row.numbers[from + 2])
}

#[test]
fn demo_does_the_main_job() {
    let (dir, out) = sample();
    assert_eq!(names(dir.path()), set(&["out"]));
    let expected = [&RESULTS[..], &["first.png", "last.png", "sample.frontalis.json"]].concat();
    assert_eq!(names(&out), set(&expected));
    let report: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["force_unit"], "N");
    assert_eq!(report["landmarks"]["placed"], 32);
    assert!(report["vertices_by_state"]["measured"].as_u64().unwrap() >= 40);
    assert!(report["self_check"]["ratio_to_largest_force"].as_f64().unwrap() < 1e-12);
    assert!(report["landmarks"]["rms_after_px"].as_f64().unwrap() < 1e-9);
    let map = image::open(out.join("height_map.png")).unwrap();
    assert!(map.width() >= 640);
    for frame in ["first.png", "last.png"] {
        let picture = image::open(out.join(frame)).unwrap();
        assert_eq!((picture.width(), picture.height()), (1036, 1036));
    }
}

#[test]
fn solve_writes_the_contract_and_keeps_what_is_not_its_own() {
    let (dir, sample) = sample();
    let project = sample.join("sample.frontalis.json");
    let out = dir.path().join("results/of/today");
    let said = done(&["solve", text(&project), "--out", text(&out)]);
    assert!(said.contains("largest force") && said.contains(" N at vertex "), "{said}");
    assert_eq!(names(&out), set(&RESULTS));
    let (header, rows) = table(&out.join("forces.csv"));
    assert_eq!(header, "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,fx_N,fy_N,fz_N,f_N,sigma_N,state");
    assert_eq!(rows.len(), 612);
    for row in &rows {
        let known = row.numbers[4..12].iter().all(|n| n.is_finite());
        assert_eq!(known, row.last != "unmeasured");
        assert!(row.numbers[..4].iter().all(|n| n.is_finite()));
    }
    // The same again beside somebody's notes: own files replaced, theirs kept, the same numbers.
    let before = fs::read(out.join("forces.csv")).unwrap();
    fs::write(out.join("notes.txt"), "mine").unwrap();
    done(&["solve", text(&project), "--out", text(&out)]);
    assert_eq!(fs::read(out.join("forces.csv")).unwrap(), before);
    assert_eq!(names(&out), set(&[&RESULTS[..], &["notes.txt"]].concat()));
}

/// Stress of the default skin, kPa: the table of the documentation, read by hand.
fn stress_kpa(strain: f64) -> f64 {
    let rows =
        [(-0.2, -9.13), (-0.1, -3.35), (0.0, 0.0), (0.1, 3.62), (0.2, 10.9), (0.3, 33.4), (0.4, 136.0), (0.5, 851.0)];
    if strain <= -0.2 {
        return -9.13;
    }
    let last = rows.len() - 2;
    let i = (0..last).find(|&i| strain <= rows[i + 1].0).unwrap_or(last);
    let ((e0, s0), (e1, s1)) = (rows[i], rows[i + 1]);
    s0 + (s1 - s0) * (strain - e0) / (e1 - e0)
}

/// F = −K X recomputed from nothing but `forces.csv`, the triangles and the skin's table: every edge is a strip of width
/// ΣA/l and thickness 1.5 mm that pulls its ends together with h (ΣA/l) σ(ε); the muscles balance it.
#[test]
fn forces_agree_with_those_computed_by_hand_from_the_exported_positions() {
    let (_dir, out) = sample();
    let (_, rows) = table(&out.join("forces.csv"));
    let triangles = frontalis::face::generic().mesh().triangles().to_vec();
    let rest: Vec<Point3<f64>> = rows.iter().map(|r| point(r, 1)).collect();
    let mut strip = BTreeMap::<(u32, u32), f64>::new();
    for [a, b, c] in triangles {
        let [pa, pb, pc] = [a, b, c].map(|v| rest[v as usize]);
        let area = 0.5 * (pb - pa).cross(&(pc - pa)).norm();
        for (i, j) in [(a, b), (b, c), (c, a)] {
            *strip.entry((i.min(j), i.max(j))).or_default() += area;
        }
    }
    let mut by_hand = vec![Vector3::zeros(); rows.len()];
    for (&(i, j), area) in &strip {
        let (a, b) = (&rows[i as usize], &rows[j as usize]);
        if a.last == "unmeasured" || b.last == "unmeasured" {
            continue;
        }
        let length = (point(a, 1) - point(b, 1)).norm();
        let apart = point(a, 4) - point(b, 4);
        let strain = apart.norm() / length - 1.0;
        // kPa · mm² = 1e-3 N.
        let tension = 1e-3 * 1.5 * area / length * stress_kpa(strain);
        let pull = apart.normalize() * tension;
        by_hand[i as usize] += pull;
        by_hand[j as usize] -= pull;
    }
    let mut largest = 0.0_f64;
    for (row, f) in rows.iter().zip(&by_hand).filter(|(r, _)| r.last != "unmeasured") {
        let written = Vector3::new(row.numbers[7], row.numbers[8], row.numbers[9]);
        largest = largest.max(written.norm());
        assert!((written.norm() - row.numbers[10]).abs() <= 1e-15);
        assert!((written - f).norm() <= 1e-9 * f.norm().max(1e-3), "vertex {}: {written} {f}", row.numbers[0]);
    }
    assert!(largest > 0.01, "the sample moves: {largest} N");
}

#[test]
fn twin_writes_a_scene_of_known_truth_that_solves() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("twin");
    done(&["twin", "--out", text(&out), "--seed", "7", "--noise-px", "0"]);
    assert_eq!(names(&out), set(&["first.png", "last.png", "truth.csv", "truth.json", "twin.frontalis.json"]));
    let (header, truth) = table(&out.join("truth.csv"));
    let columns =
        "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,x0_px,y0_px,x1_px,y1_px,fx_N,fy_N,fz_N,area_mm2,mx_N,my_N,mz_N";
    assert_eq!(header, columns);
    assert_eq!(truth.len(), 612);
    let facts: Value = serde_json::from_str(&fs::read_to_string(out.join("truth.json")).unwrap()).unwrap();
    assert_eq!(facts["seed"], 7);
    assert!(facts["activations"].is_object() || facts["activations"].is_string());

    let project = out.join("twin.frontalis.json");
    done(&["check", text(&project)]);
    let solved = dir.path().join("solved");
    done(&["solve", text(&project), "--out", text(&solved)]);
    let (_, rows) = table(&solved.join("forces.csv"));
    for (row, true_row) in rows.iter().zip(&truth) {
        assert!((point(row, 1) - point(true_row, 1)).norm() < 1e-6, "vertex {}", row.numbers[0]);
    }
    // The same seed gives the same scene, bit for bit; another gives another.
    let again = dir.path().join("again");
    done(&["twin", "--out", text(&again), "--seed", "7", "--noise-px", "0"]);
    for name in names(&out) {
        assert_eq!(fs::read(out.join(&name)).unwrap(), fs::read(again.join(&name)).unwrap(), "{name}");
    }
    assert!(refused(&["twin", "--out", text(&again), "--noise-px", "21"]).contains("noise_px is 21"));
    assert!(refused(&["twin", "--out", text(&again), "--light-change", "0.6"]).contains("light_change is 0.6"));
    assert!(refused(&["twin", "--out", text(&again), "--head-turn-deg", "11"]).contains("head_turn_deg is 11"));

    // Bare skin in other light, with a head that moves far: the truth states what was asked.
    let bare = dir.path().join("bare");
    let asked =
        ["--no-grid", "--light-change", "0.2", "--head-turn-deg", "3", "--head-shift-mm", "3", "--sensor-noise", "6.8"];
    done(&[&["twin", "--out", text(&bare), "--size", "200"][..], &asked].concat());
    let truth: Value = serde_json::from_slice(&fs::read(bare.join("truth.json")).unwrap()).unwrap();
    let settings = &truth["settings"];
    assert!(settings["grid"] == false && settings["light_change"] == 0.2 && settings["head_turn_deg"] == 3.0);
    assert!(settings["head_shift_mm"] == 3.0 && settings["sensor_noise"] == 6.8, "{settings}");
}

/// An expression of a membrane: what is written balances, and the project's own springs do not give its forces even at the true places.
#[test]
fn twin_writes_an_expression_of_a_membrane() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("happy");
    let asked =
        ["--truth", "membrane", "--expression", "happy", "--intensity", "0.3", "--unmarked", "0.2", "--size", "300"];
    done(&[&["twin", "--out", text(&out)][..], &asked].concat());
    let (_, truth) = table(&out.join("truth.csv"));
    assert_eq!(truth.len(), 612);
    let sum = |at: usize| truth.iter().map(|r| point(r, at).coords).sum::<Vector3<f64>>().norm();
    let lengths = |at: usize| truth.iter().map(|r| point(r, at).coords.norm()).sum::<f64>();
    assert!(sum(11) < 1e-9 * lengths(11));
    // Muscles 12, twice 2.7 N, and round the eyes and lips.
    let facts: Value = serde_json::from_slice(&fs::read(out.join("truth.json")).unwrap()).unwrap();
    let smile = facts["activations"]["zygomaticus_major_left"].as_f64().unwrap();
    assert!(smile > 0.1 && lengths(15) > 2.0 * 2.7 * smile * 0.9, "{}", lengths(15));
    assert!(truth.iter().map(|r| r.numbers[14]).sum::<f64>() > 1e4, "a face has more than 100 cm²");
    assert_eq!(facts["membrane"]["folded_triangles"], 0);
    let project = fs::read_to_string(out.join("twin.frontalis.json")).unwrap();
    let project: Value = serde_json::from_str(&project).unwrap();
    let marked = project["features"].as_object().unwrap().len();
    assert!((450..540).contains(&marked), "about four fifths of 612: {marked}");
    done(&["solve", text(&out.join("twin.frontalis.json")), "--out", text(&dir.path().join("solved"))]);
    for (option, value, says) in [
        ("--truth", "springs", "choose slide or membrane"),
        ("--expression", "grin", "--expression is grin; choose one of brow_raise, surprise"),
        ("--material", "rubber", "--material is rubber"),
        ("--levels", "3", "--levels is 3"),
        ("--intensity", "2", "--intensity is 2"),
        ("--unmarked", "1", "--unmarked is 1"),
    ] {
        let words = ["twin", "--truth", "membrane", "--out", text(&out), option, value];
        let words =
            if option == "--truth" { ["twin", "--seed", "1", "--out", text(&out), option, value] } else { words };
        assert!(refused(&words).contains(says), "{option} {value}");
    }
}

/// The generic face out as OBJ and in again: the same landmarks, muscles and regions, and a fit to itself.
#[test]
fn a_mesh_becomes_a_face_and_is_compared() {
    let dir = tempfile::tempdir().unwrap();
    let [obj, bare, bound, out] = ["face.obj", "bare.json", "bound.json", "compared"].map(|name| dir.path().join(name));
    done(&["face", "export", "--out", text(&obj)]);
    assert!(done(&["face", "import", text(&obj), "--out", text(&bare)]).contains("0 landmarks, 0 muscles"));
    let said = done(&["face", "import", text(&obj), "--transfer", "--mm-per-unit", "1", "--out", text(&bound)]);
    assert!(said.contains("32 landmarks, 18 muscles") && !said.contains("note: check"), "{said}");
    // Names and vertices are the same; positions differ by where the origin lies.
    let bindings = |shown: String| -> Vec<String> {
        let landmarks = shown.lines().skip(4).take(32);
        landmarks.map(|l| l.split_whitespace().take(2).collect::<Vec<_>>().join(" ")).collect()
    };
    assert_eq!(bindings(done(&["face", "show", "--face", text(&bound)])), bindings(done(&["face", "show"])));
    let table = done(&["face", "compare", text(&bound), "--people", "3", "--out", text(&out)]);
    assert!(table.contains("pose, radial") && table.contains("3 people"), "{table}");
    for name in ["compare.csv", "compare.svg", "compare.png", "distances.png"] {
        assert!(out.join(name).metadata().unwrap().len() > 100, "{name}");
    }
    let one = done(&["face", "compare", text(&bound), "--align", "thesis", "--z-factor", "1.2"]);
    assert!(one.contains("as asked") && !one.contains("pose"), "{one}");
    assert!(refused(&["face", "compare", text(&bare)]).contains("has 0 landmarks"));
    fs::write(&obj, "v 0 0 0\nf 1 2 3\n").unwrap();
    assert!(
        refused(&["face", "import", text(&obj), "--out", text(&bare)])
            .contains("face.obj: line 2: the corner names vertex 2")
    );
}

#[test]
fn face_lists_shows_exports_checks_and_generates() {
    let dir = tempfile::tempdir().unwrap();
    assert!(done(&["face", "list"]).contains("612 vertices, 1128 triangles, 32 landmarks, 18 muscles"));
    let shown = done(&["face", "show"]);
    assert!(shown.contains("nose_tip") && shown.contains("muscles") && shown.contains("Musculus"), "{shown}");
    done(&["face", "check"]);
    let obj = dir.path().join("face.obj");
    done(&["face", "export", "--out", text(&obj)]);
    let lines = fs::read_to_string(&obj).unwrap();
    assert_eq!(lines.lines().filter(|l| l.starts_with("v ")).count(), 612);
    assert_eq!(lines.lines().filter(|l| l.starts_with("f ")).count(), 1128);
    let json = dir.path().join("face.json");
    done(&["face", "generate", "--out", text(&json)]);
    done(&["face", "check", text(&json)]);
    let picture = dir.path().join("face.png");
    done(&["face", "picture", "--style", "muscles", "--preset", "waters", "--height", "200", "--out", text(&picture)]);
    assert_eq!(image::open(&picture).unwrap().height(), 200);
    let none = refused(&["face", "picture", "--preset", "none", "--out", text(&picture)]);
    assert!(none.contains("no preset of muscles named `none`"), "{none}");
    // Another nose: only its length changes, to 0.1 mm in print.
    let long = dir.path().join("long.json");
    done(&["face", "generate", "--set", "nose_length=55", "--set", "jaw_width=120", "--out", text(&long)]);
    let longer = done(&["face", "show", "--face", text(&long)]);
    assert!(longer.contains("nose_length          55.0 ") && longer.contains("jaw_width           120.0 "), "{longer}");
    for (set, said) in
        [("nose=5", "no proportion of a face"), ("nose_length=5", "nose_length is 5 mm; it must lie between")]
    {
        let refused = refused(&["face", "generate", "--set", set, "--out", text(&long)]);
        assert!(refused.contains(said), "{refused}");
    }
    assert_eq!(done(&["face", "show", "--face", text(&json)]), shown);

    let bad = dir.path().join("bad.json");
    fs::write(&bad, fs::read_to_string(&json).unwrap().replacen('[', "[x", 1)).unwrap();
    assert!(refused(&["face", "check", text(&bad)]).contains("bad.json"));
    assert!(refused(&["face", "show", "--face", "/nowhere/face.json"]).contains("/nowhere/face.json"));
}

#[test]
fn export_writes_every_format_and_never_over_the_project() {
    let (dir, out) = sample();
    let project = out.join("sample.frontalis.json");
    let starts = [
        ("csv", "frame,id,name,x_px,y_px,state,sigma_px\n"),
        ("tps", "LM="),
        ("coco", "{\n"),
        ("obj", "# "),
        ("vtk", "<?xml"),
    ];
    for (format, start) in starts {
        let file = dir.path().join(format);
        let said = done(&["export", text(&project), "--format", format, "--out", text(&file)]);
        // VTK's programs go by the ending, so it is added, and said.
        let file = if format == "vtk" { dir.path().join("vtk.vtp") } else { file };
        assert!(
            said.contains(text(&file)) && fs::read_to_string(&file).unwrap().starts_with(start),
            "{format}: {said}"
        );
    }
    let old = dir.path().join("forces.vtk");
    assert!(done(&["export", text(&project), "--format", "vtk", "--out", text(&old)]).contains("by the ending .vtp"));
    assert!(dir.path().join("forces.vtp").exists() && !old.exists());
    let coco: Value = serde_json::from_str(&fs::read_to_string(dir.path().join("coco")).unwrap()).unwrap();
    let keypoints = coco["categories"][0]["keypoints"].as_array().unwrap().len();
    assert_eq!(coco["annotations"][1]["keypoints"].as_array().unwrap().len(), 3 * keypoints);
    let kept = fs::read(&project).unwrap();
    assert!(refused(&["export", text(&project), "--format", "csv", "--out", text(&project)]).contains("--out"));
    assert_eq!(fs::read(&project).unwrap(), kept);
}

#[test]
fn check_says_everything_that_is_wrong() {
    let (_dir, out) = sample();
    assert!(done(&["check", text(&out.join("sample.frontalis.json"))]).contains("no errors"));
    let path = changed(&out, |p| {
        p["frames"]["last"]["path"] = "gone.png".into();
        p["landmarks"]["third_eye"] = serde_json::json!({ "at_px": [10.0, 10.0] });
        p["landmarks"]["nose_tip"]["at_px"] = serde_json::json!([-50.0, 10.0]);
        p["features"]["5000"] = serde_json::json!({ "last": { "at_px": [20.0, 20.0] } });
        p["camera"]["distance_mm"] = 3.into();
    });
    let output = frontalis(&["check", text(&path)]);
    assert_eq!(output.status.code(), Some(1));
    let listed = String::from_utf8(output.stdout).unwrap();
    for wrong in ["frames.last: ", "landmarks.third_eye", "landmarks.nose_tip.at_px", "features.5000", "camera: "] {
        assert!(listed.contains(&format!("error: {wrong}")), "{wrong} in {listed}");
    }
    assert!(String::from_utf8(output.stderr).unwrap().contains("5 errors"));
}

/// Every bad project: one line that names the file and the reason, status 1, and nothing written.
#[test]
fn bad_projects_are_refused_and_leave_nothing() {
    let (dir, sample) = sample();
    let goal = dir.path().join("never");
    let refuse = |project: &Path, wanted: &[&str]| {
        let line = refused(&["solve", text(project), "--out", text(&goal)]);
        for word in wanted {
            assert!(line.contains(word), "{word} in {line}");
        }
        assert!(!goal.exists());
        assert_eq!(names(dir.path()), set(&["out"]));
    };
    let bad = sample.join("changed.frontalis.json");
    refuse(&sample.join("absent.frontalis.json"), &["absent.frontalis.json", "cannot be read"]);
    refuse(&sample, &["it is a folder"]);
    refuse(&sample.join("first.png"), &["first.png", "is not text"]);
    changed(&sample, |p| p["frontalis_project"] = 3.into());
    refuse(&bad, &["made by a newer Frontalis (format 3, this one reads up to 1): update Frontalis"]);
    changed(&sample, |p| p["landmarks"]["nose_tip"]["at_px"] = "here".into());
    refuse(&bad, &["changed.frontalis.json", "landmarks.nose_tip.at_px", "invalid type"]);
    changed(&sample, |p| p["features"]["5000"] = serde_json::json!({ "last": { "at_px": [20.0, 20.0] } }));
    refuse(&bad, &["features.5000", "its vertices are 0 to 611"]);
    changed(&sample, |p| p["settings"]["skin_thickness_mm"] = (-1.5).into());
    refuse(&bad, &["settings: ", "greater than zero"]);
    let whole = fs::read_to_string(sample.join("sample.frontalis.json")).unwrap();
    fs::write(&bad, whole.replacen("\"distance_mm\": 1", "\"distance_mm\": NaN, \"x\": 1", 1)).unwrap();
    refuse(&bad, &["changed.frontalis.json", "line "]);
    fs::write(&bad, &whole[..whole.len() / 2]).unwrap();
    refuse(&bad, &["line ", "EOF"]);

    changed(&sample, |p| p["frames"]["first"]["path"] = "gone.png".into());
    refuse(&bad, &["the first frame", "gone.png", "there is no such file", "--ignore-frames"]);
    // Half a picture, known by its own hash: it is the decoder that must refuse.
    let half = fs::read(sample.join("first.png")).unwrap();
    fs::write(sample.join("half.png"), &half[..half.len() / 2]).unwrap();
    let sha = frontalis::frames::Frame::sha256_of(&sample.join("half.png")).unwrap();
    changed(&sample, |p| {
        p["frames"]["first"]["path"] = "half.png".into();
        p["frames"]["first"]["sha256"] = sha.into();
    });
    refuse(&bad, &["half.png"]);
    changed(&sample, |p| p["frames"]["first"]["width_px"] = 1000.into());
    refuse(&bad, &["first.png", "1036 × 1036", "1000 × 1036"]);
    changed(&sample, |p| p["frames"]["last"]["path"] = "first.png".into());
    refuse(&bad, &["the last frame", "is not the picture that was marked"]);
}

#[test]
fn marks_can_be_solved_without_their_pictures() {
    let (dir, sample) = sample();
    let bad = changed(&sample, |p| p["frames"]["first"]["path"] = "gone.png".into());
    let out = dir.path().join("results");
    done(&["solve", text(&bad), "--out", text(&out), "--ignore-frames"]);
    assert_eq!(fs::read(out.join("forces.csv")).unwrap(), fs::read(sample.join("forces.csv")).unwrap());
    assert!(fs::read_to_string(out.join("report.json")).unwrap().contains("there is no such file"));
}

#[test]
fn a_place_that_cannot_be_written_is_named_and_left_alone() {
    let (dir, sample) = sample();
    let project = sample.join("sample.frontalis.json");
    let file = dir.path().join("file.txt");
    fs::write(&file, "kept").unwrap();
    for out in [file.join("out"), file.clone()] {
        let line = refused(&["solve", text(&project), "--out", text(&out)]);
        assert!(line.contains("file.txt") && line.contains("cannot be written"), "{line}");
        refused(&["demo", "--out", text(&out)]);
        refused(&["twin", "--out", text(&out)]);
    }
    refused(&["export", text(&project), "--format", "csv", "--out", text(&file.join("x.csv"))]);
    refused(&["face", "generate", "--out", text(&file.join("x.json"))]);
    // A folder stands where a result should go: nothing is replaced.
    let taken = dir.path().join("taken");
    fs::create_dir_all(taken.join("report.json")).unwrap();
    fs::write(taken.join("forces.csv"), "old").unwrap();
    assert!(refused(&["solve", text(&project), "--out", text(&taken)]).contains("report.json"));
    assert_eq!(fs::read_to_string(taken.join("forces.csv")).unwrap(), "old");
    assert_eq!(names(&taken), set(&["forces.csv", "report.json"]));
    assert_eq!(fs::read_to_string(&file).unwrap(), "kept");
    assert_eq!(names(dir.path()), set(&["file.txt", "out", "taken"]));
}

#[test]
fn the_generic_face_is_known_by_the_name_that_the_list_prints() {
    let name = done(&["face", "list"]).split_whitespace().next().unwrap().to_owned();
    assert_eq!(done(&["face", "show", &name]), done(&["face", "show"]));
    assert_eq!(done(&["face", "check", &name]), done(&["face", "check"]));
    assert!(refused(&["face", "check", "generics"]).contains("generics"));
}

#[test]
fn wrong_usage_is_status_2_and_help_names_every_command() {
    for wrong in
        [&["solve"][..], &["export", "a", "--format", "xls", "--out", "b"], &["twin", "--seed", "x", "--out", "b"]]
    {
        assert_eq!(frontalis(wrong).status.code(), Some(2), "{wrong:?}");
    }
    let help = done(&["--help"]);
    for command in ["demo", "solve", "simulate", "face", "twin", "export", "import", "suggest", "frames", "check"] {
        assert!(help.contains(command), "{help}");
    }
    assert!(done(&["--version"]).starts_with("frontalis "));
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_display_the_way_on_is_named() {
    assert!(refused(&[]).contains("frontalis demo --out DIR"));
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("twin");
    let mut child = Command::new(env!("CARGO_BIN_EXE_frontalis")).args(["twin", "--out", text(&out)]).spawn().unwrap();
    // Interrupted as soon as its working folder is there.
    let begun = std::time::Instant::now();
    while names(dir.path()).is_empty() && begun.elapsed().as_secs() < 60 && child.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    if killed.success() && status.code() == Some(130) {
        assert!(names(dir.path()).is_empty(), "{:?}", names(dir.path()));
    } else {
        // It was done before the interrupt came.
        assert_eq!(names(dir.path()), set(&["twin"]));
    }
}

/// Every mark of the last frame of B lies (1.5, −2) px from that of A: bias (1.5, −2), no scatter, distance 2.5 throughout.
#[test]
fn compare_tells_the_bias_between_two_annotators() {
    let dir = tempfile::tempdir().unwrap();
    done(&["demo", "--out", text(dir.path())]);
    let a = dir.path().join("sample.frontalis.json");
    let mut json: serde_json::Value = serde_json::from_slice(&fs::read(&a).unwrap()).unwrap();
    let mut moved = 0;
    for feature in json["features"].as_object_mut().unwrap().values_mut() {
        if let Some(at) = feature.get_mut("last").and_then(|l| l.get_mut("at_px")) {
            let [x, y] = [0, 1].map(|k| at[k].as_f64().unwrap());
            *at = serde_json::json!([x + 1.5, y - 2.0]);
            moved += 1;
        }
    }
    json["landmarks"] = serde_json::json!({});
    let b = dir.path().join("b.frontalis.json");
    fs::write(&b, json.to_string()).unwrap();
    let out = dir.path().join("compared");
    let said = done(&["compare", text(&a), text(&b), "--out", text(&out)]);
    assert!(said.contains("x: bias +1.50, sd 0.00") && said.contains("y: bias -2.00"), "{said}");
    let report: serde_json::Value = serde_json::from_slice(&fs::read(out.join("compare.json")).unwrap()).unwrap();
    assert_eq!(report["summary"]["points"], moved);
    assert!((report["summary"]["rms_px"].as_f64().unwrap() - 2.5).abs() < 1e-9);
    assert_eq!(report["only_in_a"].as_array().unwrap().len(), 32, "the landmarks");
    let rows = fs::read_to_string(out.join("compare.csv")).unwrap();
    assert!(rows.starts_with("frame,id,a_x_px,a_y_px,b_x_px,b_y_px,dx_px,dy_px,distance_px,a_state,b_state\n"));
    assert_eq!(rows.lines().count(), 1 + moved);

    json["frames"]["last"]["sha256"] = "0".repeat(64).into();
    fs::write(&b, json.to_string()).unwrap();
    assert!(refused(&["compare", text(&a), text(&b)]).contains("not the same picture"));
}

#[test]
fn suggest_writes_a_table_and_leaves_the_project_alone() {
    let dir = tempfile::tempdir().unwrap();
    done(&["demo", "--out", text(dir.path())]);
    let project = dir.path().join("sample.frontalis.json");
    let mut json: serde_json::Value = serde_json::from_slice(&fs::read(&project).unwrap()).unwrap();
    // Twenty marks are taken away, to be suggested.
    let marked: Vec<String> = json["features"].as_object().unwrap().keys().take(20).cloned().collect();
    for key in &marked {
        json["features"].as_object_mut().unwrap().remove(key);
    }
    let fewer = dir.path().join("fewer.frontalis.json");
    fs::write(&fewer, json.to_string()).unwrap();
    let before = fs::read(&fewer).unwrap();
    let table = dir.path().join("suggestions.csv");
    assert!(done(&["suggest", text(&fewer), "--out", text(&table)]).contains("points suggested"));
    assert_eq!(fs::read(&fewer).unwrap(), before);
    let rows = fs::read_to_string(&table).unwrap();
    assert!(rows.starts_with("id,name,x_px,y_px,confidence,method,row,col\n"));
    let ids: Vec<&str> = rows.lines().skip(1).filter_map(|l| l.split(',').next()).collect();
    assert!(marked.iter().all(|key| ids.contains(&key.as_str())), "every point taken away is suggested");
    for row in rows.lines().skip(1) {
        let confidence: f64 = row.split(',').nth(4).unwrap().parse().unwrap();
        assert!((0.0..=1.0).contains(&confidence), "{row}");
    }
    json["frames"]["last"] = serde_json::Value::Null;
    fs::write(&fewer, json.to_string()).unwrap();
    assert!(refused(&["suggest", text(&fewer), "--out", text(&table)]).contains("no first or no last frame"));
}

#[test]
fn suggest_follows_the_skin_through_the_film_that_lies_beside_the_frames() {
    let dir = tempfile::tempdir().unwrap();
    let film = dir.path().join("brow_raise.mp4");
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4"), &film).unwrap();
    done(&["frames", text(&film), "--first", "5", "--last", "17", "--out", text(dir.path())]);
    done(&["demo", "--out", text(&dir.path().join("demo"))]);
    let read = |path: &Path| -> serde_json::Value { serde_json::from_slice(&fs::read(path).unwrap()).unwrap() };
    let project = dir.path().join("film.frontalis.json");
    let (mut json, mut sample) = (read(&project), read(&dir.path().join("demo/sample.frontalis.json")));
    for (_, mark) in sample["landmarks"].as_object_mut().unwrap() {
        for at in mark["at_px"].as_array_mut().unwrap() {
            *at = (at.as_f64().unwrap() * 96.0 / 1036.0).into();
        }
    }
    json["landmarks"] = sample["landmarks"].take();
    fs::write(&project, json.to_string()).unwrap();
    let table = dir.path().join("suggestions.csv");
    let suggest = || done(&["suggest", text(&project), "--out", text(&table)]);
    assert!(suggest().contains("followed through 11 frames of"), "{}", suggest());
    fs::remove_file(&film).unwrap();
    assert!(suggest().contains("is not beside them: followed at once"), "{}", suggest());
}

#[test]
fn two_frames_come_out_of_a_film_by_the_motion_or_by_number() {
    let film = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4");
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let said = done(&["frames", film, "--out", text(&out)]);
    assert!(said.starts_with("24 frames of 96 × 96 px\n") && said.contains("proposed by the motion"), "{said}");
    assert_eq!(names(&out), set(&["film.frontalis.json", "first.png", "last.png", "motion.csv"]));
    let motion = fs::read_to_string(out.join("motion.csv")).unwrap();
    assert!(motion.starts_with("frame,time_s,speed_grey,change_grey\n1,0,0,") && motion.lines().count() == 25);
    done(&["check", text(&out.join("film.frontalis.json"))]);
    let first = fs::read(out.join("first.png")).unwrap();

    let said = done(&["frames", film, "--first", "2", "--last", "20", "--out", text(&out)]);
    assert!(said.contains("first: frame 2 at 0.04 s, as asked") && said.contains("last: frame 20"), "{said}");
    // Frame 2 has a white bar of 8 px in its topmost rows.
    let second = image::open(out.join("first.png")).unwrap().into_rgb8();
    assert_eq!((0..96).filter(|&x| second.get_pixel(x, 3).0[1] > 225).count().div_ceil(4), 2);
    assert_ne!(fs::read(out.join("first.png")).unwrap(), first);

    let nowhere = dir.path().join("nowhere");
    for (arguments, why) in [
        (&["--first", "3", "--last", "3"][..], "both frame 3"),
        (&["--last", "25"][..], "no frame 25; the film has frames 1 to 24"),
    ] {
        let refusal = refused(&[&["frames", film, "--out", text(&nowhere)], arguments].concat());
        assert!(refusal.contains(why), "{refusal}");
    }
    assert!(refused(&["frames", text(&dir.path().join("gone.mp4")), "--out", text(&nowhere)]).contains("no such file"));
    assert_eq!(names(dir.path()), set(&["out"]));
}

#[test]
fn exported_marks_are_imported_as_proposals_and_accepted_into_a_new_project() {
    let (dir, out) = sample();
    let project = out.join("sample.frontalis.json");
    let marks = dir.path().join("marks.csv");
    done(&["export", text(&project), "--format", "csv", "--out", text(&marks)]);
    let said = done(&["import", text(&project), text(&marks)]);
    assert!(said.contains(" 0 of them not marked") && said.contains("0.000 px apart"), "{said}");
    // The landmarks and the still points go, and come back from the file.
    let before: Value = serde_json::from_slice(&fs::read(&project).unwrap()).unwrap();
    let fewer = changed(&out, |p| {
        p["landmarks"] = Value::Object(serde_json::Map::new());
        p["features"].as_object_mut().unwrap().retain(|_, f| f["role"] != "still");
    });
    let new = dir.path().join("new.frontalis.json");
    let said = done(&["import", text(&fewer), text(&marks), "--out", text(&new)]);
    assert!(said.contains("points accepted"), "{said}");
    let after: Value = serde_json::from_slice(&fs::read(&new).unwrap()).unwrap();
    assert_eq!(after["landmarks"], before["landmarks"]);
    for (vertex, feature) in before["features"].as_object().unwrap() {
        assert_eq!(after["features"][vertex]["last"], feature["last"], "{vertex}");
    }
    let kept = fs::read(&fewer).unwrap();
    assert!(refused(&["import", text(&fewer), text(&marks), "--out", text(&fewer)]).contains("not overwritten"));
    assert_eq!(fs::read(&fewer).unwrap(), kept);
    fs::write(&marks, "frame,id,x_px,y_px,state\nlast,17,here,2,marked\n").unwrap();
    assert!(refused(&["import", text(&fewer), text(&marks)]).contains("marks.csv: line 2: `here` is not a number"));
}

/// A face of our own as the head, and a target with a fault: one line says where it is, and nothing is written.
#[test]
fn a_faulty_target_is_refused_with_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let (meshes, out) = (dir.path().join("meshes"), dir.path().join("out"));
    fs::create_dir(&meshes).unwrap();
    let study = || refused(&["study", "laws", "--meshes", text(&meshes), "--out", text(&out)]);
    assert!(study().contains("base.obj"));
    let generic = frontalis::face::generic();
    let decimetres: Vec<Point3<f64>> = generic.mesh().positions().iter().map(|p| p * 0.01).collect();
    let obj = frontalis::face::import::write_obj(generic.mesh(), &decimetres);
    fs::write(meshes.join("base.obj"), obj.replacen("\nf ", "\ng body\nf ", 1)).unwrap();
    assert!(study().contains("1.target"));
    fs::write(meshes.join("1.target"), "3 0 .02 0\n612 0 .01 0\n").unwrap();
    assert!(study().ends_with("1.target: line 2: vertex 612, but the mesh has only 612 vertices\n"));
    assert_eq!(names(dir.path()), set(&["meshes"]));
}

/// Killed in the middle, a study leaves its journal alone, and goes on after what that holds; another study is refused there.
#[test]
fn a_study_that_was_killed_goes_on_where_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let journal = out.join("stability.journal");
    let arguments = ["study", "stability", "--quick", "--threads", "1", "--out", text(&out)];
    let lines = || fs::read_to_string(&journal).unwrap_or_default().lines().map(str::to_owned).collect::<Vec<_>>();
    let killed_at = |count: usize| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_frontalis")).args(arguments).spawn().unwrap();
        while lines().len() < count && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        lines()
    };
    let first = killed_at(4);
    assert!(first.len() >= 4 && first[0].contains("\"question\":\"quick, 1 seed"), "{first:?}");
    assert_eq!(names(&out), set(&["stability.journal"]));
    let again = killed_at(first.len() + 3);
    // The last line of the first may have been cut off, and is then written anew.
    let kept = first.len() - 1;
    assert_eq!(again[..kept], first[..kept]);
    assert!(again.len() >= first.len() + 3);
    let other = [&arguments[..], &["--seeds", "2"]].concat();
    assert!(refused(&other).contains("with other settings (quick, 1 seed, face"));
    assert_eq!(lines(), again);
}

#[test]
fn a_chart_is_drawn_anew_from_a_table_or_some_of_its_parts() {
    let dir = tempfile::tempdir().unwrap();
    let (table, out) = (dir.path().join("accuracy.csv"), dir.path().join("out"));
    let head = "study,part,method,setting,noise_px,vertices,seed,time_ms,force_error,status,cause";
    let row = |part: &str, noise: f64| format!("accuracy,{part},Direct,rules=as the scene,{noise},612,1,0.3,0.5,ok,");
    fs::write(&table, [head, &row("forces", 0.0), &row("forces", 1.0), &row("laws", 0.0)].join("\n")).unwrap();
    let drawn = |more: &[&str]| {
        let arguments = [&["study", "chart", text(&table), "--out", text(&out)], more].concat();
        done(&arguments);
        fs::read_to_string(out.join("chart.svg")).unwrap()
    };
    let whole = drawn(&[]);
    assert!(whole.contains("accuracy.csv · seed 1 · 3 runs") && whole.contains("Forces from marks"));
    assert_eq!(names(&out), set(&["chart.png", "chart.svg"]));
    let one = drawn(&["--part", "forces", "--noise", "1"]);
    assert!(one.contains("seed 1 · 1 runs") && !one.contains("law fitted"));
    let unknown = refused(&["study", "accuracy", "--part", "force", "--out", text(&out)]);
    assert!(unknown.contains("no part 'force'; its parts are: forces | forces, rough | "), "{unknown}");
    let none = refused(&["study", "chart", text(&table), "--part", "force", "--out", text(&out)]);
    assert!(none.contains("has no such rows; its parts are: forces | laws"), "{none}");
    fs::write(&table, "a,b\n1,2\n").unwrap();
    assert!(refused(&["study", "chart", text(&table), "--out", text(&out)]).contains("this is no table of a study"));
}

/// The command of `docs/batch/Snakefile` with its placeholders filled in, on a project in a folder with an awkward name: it makes the files that
/// the rule promises, and nothing else.
#[cfg(unix)]
#[test]
fn the_command_of_the_batch_solves_a_project() {
    let text_of = |path: &str| fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
    let snakefile = text_of("docs/batch/Snakefile");
    let between = |from: &str, to: &str| {
        let rest = snakefile.split_once(from).unwrap().1;
        rest.split_once(to).unwrap().0.trim().to_owned()
    };
    let (_dir, out) = sample();
    let folder = out.join("it's a name");
    fs::create_dir(&folder).unwrap();
    let quoted = |path: &Path| format!("'{}'", text(path).replace('\'', r"'\''"));
    let project = fs::read_dir(&out).unwrap().map(|e| e.unwrap().path());
    let project = project.into_iter().find(|p| text(p).ends_with(".frontalis.json")).unwrap();
    let (results, log) = (folder.join("results"), folder.join("results.log"));
    let line = between("shell:\n        \"", "\"\n")
        .replace("{threads}", "1")
        .replace("{params.program:q}", &quoted(Path::new(env!("CARGO_BIN_EXE_frontalis"))))
        .replace("{input.project:q}", &quoted(&project))
        .replace("{params.out:q}", &quoted(&results))
        .replace("{log:q}", &quoted(&log));
    assert!(!line.contains(['{', '}']), "{line}");
    let ran = Command::new("sh").args(["-c", &line]).output().unwrap();
    assert!(ran.status.success(), "{line}: {}", fs::read_to_string(&log).unwrap_or_default());
    let promised = between("FILES = [", "]").replace('"', "");
    let promised: BTreeSet<String> = promised.split(',').map(|f| f.trim().to_owned()).collect();
    assert_eq!(names(&results), promised);
    assert!(fs::read_to_string(&log).unwrap().contains("written to"));
}

#[test]
fn a_fit_writes_its_tables_its_drawing_and_a_report_that_names_the_command() {
    let (_dir, out) = sample();
    let project = out.join("sample.frontalis.json");
    let fit = out.join("fit");
    let said = done(&[
        "fit",
        text(&project),
        "--out",
        text(&fit),
        "--muscles",
        "frontalis_lateral_left,frontalis_lateral_right",
    ]);
    assert!(said.contains("best: ") && said.contains("Koch"), "{said}");
    let files = [
        "activations.csv",
        "fields.csv",
        "fit.json",
        "profiles.csv",
        "profiles.png",
        "profiles.svg",
        "replay.csv",
        "replay.svg",
        "replay.png",
        "report.html",
    ];
    assert_eq!(names(&fit), set(&files));

    let report: Value = serde_json::from_str(&fs::read_to_string(fit.join("fit.json")).unwrap()).unwrap();
    assert_eq!(report["muscles_fitted"], serde_json::json!(["frontalis_lateral_left", "frontalis_lateral_right"]));
    let laws = report["laws"].as_array().unwrap();
    assert_eq!(laws.len(), 5);
    for law in laws {
        let fit = &law["fit"]["Ok"];
        for field in
            ["parameters", "strengths", "r2", "aic", "bic", "evaluations", "time_ms", "ended", "correlation", "weak"]
        {
            assert!(!fit[field].is_null(), "{field} of {}", law["label"]);
        }
        for p in fit["parameters"].as_array().unwrap().iter().filter(|p| p["fitted"] == true) {
            let [low, value, high] = ["low", "value", "high"].map(|k| p[k].as_f64().unwrap());
            assert!(low <= value && value <= high, "{p}");
        }
    }
    let activations = fs::read_to_string(fit.join("activations.csv")).unwrap();
    assert!(activations.starts_with("muscle,action_unit,activation_N,low_N,high_N\n"));
    assert_eq!(activations.lines().count(), 19, "18 muscles");
    for row in activations.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let [value, low, high] = [2, 3, 4].map(|k| cells[k].parse::<f64>().unwrap());
        assert!(value.is_nan() || (0.0 <= low && low <= value && value <= high), "{row}");
    }
    let html = fs::read_to_string(fit.join("report.html")).unwrap();
    assert!(html.contains("--muscles frontalis_lateral_left,frontalis_lateral_right</pre>"));
    assert!(html.contains("SHA-256") && html.contains("data:image/png;base64,"));
}

#[test]
fn a_fit_that_cannot_be_made_says_why_and_leaves_nothing() {
    let (_dir, out) = sample();
    let project = out.join("sample.frontalis.json");
    let fit = out.join("fit");
    let words = refused(&["fit", text(&project), "--out", text(&fit), "--muscles", "biceps"]);
    assert!(words.contains("--muscles names biceps") && words.contains("frontalis_medial_left"), "{words}");
    let words = refused(&["fit", text(&project), "--out", text(&fit), "--patch-mm", "0"]);
    assert!(words.contains("between 3 and 60"), "{words}");
    let unmarked = changed(&out, |p| p["features"] = serde_json::json!({}));
    let words = refused(&["fit", text(&unmarked), "--out", text(&fit)]);
    assert!(words.contains("no force can be believed yet"), "{words}");
    assert!(!fit.exists());
}

/// The columns of a table, by name, as numbers (no number: `NaN`) beside the text of its second column.
fn columns(csv: &Path) -> Vec<(usize, String, BTreeMap<String, f64>)> {
    let kept = fs::read_to_string(csv).unwrap();
    let mut lines = kept.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    lines
        .map(|cells| {
            let numbers = head.iter().zip(&cells).map(|(h, c)| ((*h).to_owned(), c.parse().unwrap_or(f64::NAN)));
            (cells[0].parse().unwrap(), cells[1].to_owned(), numbers.collect())
        })
        .collect()
}

/// Two subjects: five laws on equal terms, and the maps answer to the tables of the single forces.
#[test]
fn laws_are_tried_on_another_subject_and_both_are_put_together_vertex_by_vertex() {
    let (dir, out) = sample();
    let project = out.join("sample.frontalis.json");
    let folder = dir.path().join("other");
    done(&["twin", "--out", text(&folder), "--seed", "2", "--stated-sigma-px", "0.1"]);
    let other = folder.join("twin.frontalis.json");
    let fit = out.join("fit");
    let arguments = ["fit", text(&project), "--out", text(&fit), "--compare", "vectors", "--test", text(&other)];
    let said = done(&arguments);
    assert!(
        said.contains("on Brow raise of twin 2, Koch: as fitted R²") && said.contains("across subjects: 2 subjects"),
        "{said}"
    );

    let report: Value = serde_json::from_str(&fs::read_to_string(fit.join("fit.json")).unwrap()).unwrap();
    let tried = &report["tried_on"][0];
    assert_eq!((tried["project"].as_str(), tried["same_unit"].as_bool()), (Some("Brow raise of twin 2"), Some(true)));
    let rows = tried["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 5, "every law, also those without a fit on the first");
    for row in rows {
        // Fitted there altogether explains no less than with the shape held, but for readings and starts: both are of the same forces.
        if let (Some(shape), Some(whole)) =
            (row["shape_carried"]["Ok"]["r2"].as_f64(), row["refitted"]["Ok"]["r2"].as_f64())
        {
            assert!(whole > shape - 1e-6, "{}: {shape} {whole}", row["label"]);
            assert!(row["as_fitted_r2"].as_f64().unwrap() <= shape + 1e-9, "strengths of there are the best there");
        }
    }

    let kept = fs::read_to_string(fit.join("subject_laws.csv")).unwrap();
    assert_eq!(kept.lines().count(), 6);
    for (line, row) in kept.lines().skip(1).zip(rows) {
        let cells: Vec<&str> = line.split(',').collect();
        let held_out = row["refitted_held_out"]["error"].as_f64();
        assert!(
            cells[0] == "Brow raise of twin 2" && cells.contains(&held_out.unwrap_or(f64::NAN).to_string().as_str()),
            "{line}"
        );
    }
    let profiles = fs::read_to_string(fit.join("subject_profiles.csv")).unwrap();
    assert!(image::open(fit.join("subject_profiles.png")).is_ok() && fit.join("subject_profiles.svg").exists());
    for source in ["observed", "as fitted here", "shape carried", "refitted there"] {
        assert!(profiles.contains(&format!(",radial,{source},")), "{source}");
    }

    // A second way to the maps: from the forces of each that `solve` wrote, which count where both tables say so.
    let forces = |project: &Path, name: &str| {
        let folder = dir.path().join(name);
        done(&["solve", text(project), "--out", text(&folder)]);
        columns(&folder.join("forces.csv")).into_iter().map(|(v, _, c)| (v, c["f_N"])).collect::<BTreeMap<_, _>>()
    };
    let (a, b) = (forces(&project, "a"), forces(&other, "b"));
    let maps = columns(&fit.join("subject_maps.csv"));
    assert!(maps.len() > 50, "{}", maps.len());
    assert_eq!(report["across_subjects"]["vertices_of_all"].as_u64().unwrap() as usize, maps.len());
    let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * (1.0 + y.abs());
    for (v, count, of) in &maps {
        assert_eq!(count, "2");
        assert!(near(of["mean_force_N"], 0.5 * (a[v] + b[v])));
        // The standard deviation of two: |a − b| / √2.
        assert!(near(of["spread_force_N"], (a[v] - b[v]).abs() / 2.0_f64.sqrt()));
    }
    let single = columns(&fit.join("subjects.csv"));
    let counted = |name: &str| {
        let own = single.iter().filter(|(_, s, _)| s == name);
        own.map(|(v, _, c)| (*v, c.clone())).collect::<BTreeMap<_, _>>()
    };
    let [own, there] = ["Brow raise of twin 1", "Brow raise of twin 2"].map(counted);
    assert_eq!(own.keys().filter(|v| there.contains_key(v)).count(), maps.len(), "where both count, and nowhere else");
    for (v, row) in &there {
        let less = row["less_force_N"];
        assert_eq!(less.is_finite(), own.contains_key(v));
        assert!(!less.is_finite() || near(less, a[v] - b[v]));
        if let (Some(first), true) = (own.get(v), row["less_along_fibre_N"].is_finite()) {
            assert!(near(row["less_along_fibre_N"], first["along_fibre_N"] - row["along_fibre_N"]));
        }
    }
    let drawn = image::open(fit.join("subject_maps.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height()), (3 * 550, 2 * 616), "mean, spread and difference, of two readings");
    let html = fs::read_to_string(fit.join("report.html")).unwrap();
    assert!(html.contains("The laws tried on Brow raise of twin 2") && html.contains("Across subjects"));
    assert!(html.contains("Brow raise of twin 2: Along "), "its profiles");

    // A subject counts once; forces without a scale are not mixed with newtons; who has none says so.
    let words =
        refused(&["fit", text(&project), "--out", text(&fit), "--test", text(&out.join("./sample.frontalis.json"))]);
    assert!(words.contains("named twice"), "{words}");
    let relative = changed(&out, |p| {
        p.as_object_mut().unwrap().remove("scale");
        p["name"] = "Lea".into();
    });
    let bare = out.join("bare");
    let said = done(&["fit", text(&project), "--out", text(&bare), "--test", text(&relative)]);
    assert!(said.contains("no maps across subjects: the forces of Lea are relative"), "{said}");
    assert!(said.contains("on Lea, Koch: as fitted not tried"), "{said}");
    assert!(!bare.join("subject_maps.csv").exists() && !bare.join("subjects.csv").exists());
    assert!(bare.join("subject_laws.csv").exists(), "laws have no unit of force but for their strengths");
    let unmarked = changed(&out, |p| p["features"] = serde_json::json!({}));
    let words = refused(&["fit", text(&project), "--out", text(&fit), "--test", text(&unmarked)]);
    assert!(words.contains("changed.frontalis.json: no force can be believed yet"), "{words}");
}

#[test]
fn simulate_writes_the_contract_on_the_generic_face() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let said = done(&["simulate", "--expression", "surprise", "--out", text(&out), "--seconds", "1.5"]);
    assert!(said.contains("Surprise: vertex") && said.contains("equilibrium: converged"), "{said}");
    assert_eq!(names(&out), set(&["energy.csv", "expression.png", "positions.csv", "report.json"]));
    let positions = fs::read_to_string(out.join("positions.csv")).unwrap();
    let mut rows = positions.lines();
    assert_eq!(rows.next().unwrap(), "vertex,x0_mm,y0_mm,z0_mm,x1_mm,y1_mm,z1_mm,f_N");
    let rows: Vec<Vec<f64>> = rows.map(|r| r.split(',').map(|n| n.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 612);
    // A brow goes up, by more than a millimetre and by less than an eye is high.
    let face = frontalis::face::generic();
    let brow = &rows[face.muscles()[0].insertion as usize];
    let up = brow[5] - brow[2];
    assert!((1.0..25.0).contains(&up) && brow[7] > 0.0, "{up} mm");
    let energy = fs::read_to_string(out.join("energy.csv")).unwrap();
    assert!(energy.starts_with("time_s,kinetic_mJ,elastic_mJ,loads_mJ\n0,0,0,"));
    // At rest, and 90 steps of 1/60 s.
    assert_eq!(energy.lines().count(), 1 + 1 + 90);
    let report: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["play"]["steps"], 90);
    assert!(report["failure"].is_null() && report["equilibrium"]["residual_n"].as_f64().unwrap() < 1e-3);
    assert!(report["equilibrium"]["farthest_from_play_mm"].as_f64().unwrap() < 1.0);
    let command = report["command"].as_str().unwrap().to_owned();
    assert!(command.starts_with("frontalis simulate --expression surprise --out "), "{command}");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    done(&words);

    // A bare mesh does not resist bending: where it has buckled is said, and what to change.
    let bare = ["--hold", "bare", "--intensity", "2", "--seconds", "0"];
    let said = done(&[&["simulate", "--expression", "disgust", "--out", text(&out)][..], &bare].concat());
    assert!(said.contains("bent by more than 60°") && said.contains("Let it slide on the skull"), "{said}");
    let report: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    let creases = report["creases"].as_array().unwrap();
    assert!(creases.len() > 1 && creases.iter().all(|c| c["bent_deg"].as_f64().unwrap() > 60.0));
    assert!(report["crease_advice"].as_str().unwrap().contains("buckled"));
}

#[test]
fn simulate_moves_the_face_of_a_project_by_an_expression_of_ones_own() {
    let (dir, out) = sample();
    let preset = dir.path().join("smirk.expression.json");
    let smirk =
        r#"{"frontalis_expression": 1, "name": "Smirk", "activations": {"zygomaticus_major_left": 1}, "jaw_deg": 0}"#;
    fs::write(&preset, smirk).unwrap();
    let project = out.join("sample.frontalis.json");
    let to = dir.path().join("smirk");
    done(&[
        "simulate",
        "--preset",
        text(&preset),
        text(&project),
        "--out",
        text(&to),
        "--seconds",
        "0",
        "--intensity",
        "0.5",
    ]);
    let report: Value = serde_json::from_str(&fs::read_to_string(to.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["expression"]["activations"]["zygomaticus_major_left"], 0.5);
    let moved = |id: &str| report["landmarks"][id]["length_mm"].as_f64().unwrap();
    assert!(moved("mouth_corner_left") > 3.0 * moved("mouth_corner_right"), "one side smiles");
    assert_eq!(report["play"]["steps"], 0);
}

#[test]
fn simulate_refuses_bad_names_with_a_line_that_lists_the_good_ones() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let with = |more: &[&str]| {
        let mut words = vec!["simulate", "--out", text(&out)];
        words.extend(more);
        refused(&words)
    };
    for (words, says) in [
        (&["--expression", "joy"][..], "choose one of surprise, happy, sad, anger, disgust, fear"),
        (&["--expression", "sad", "--method", "euler"], "explicit_euler, symplectic_euler, runge_kutta_4, thesis"),
        (&["--expression", "sad", "--law", "hill"], "waters_linear, waters_sheet, koch, anatomical"),
        (&["--expression", "sad", "--hold", "glue"], "skull, anchors, bare"),
        (&["--expression", "sad", "--stiffness", "0"], "--stiffness is 0; it must lie between 0.01 and 100"),
        (&["--expression", "sad", "--intensity", "3"], "--intensity is 3; it must lie between 0 and 2"),
        (&["--expression", "sad", "--seconds=-1"], "--seconds is -1"),
        (&["--preset", "nowhere.expression.json"], "nowhere.expression.json: cannot be read"),
    ] {
        let line = with(words);
        assert!(line.contains(says), "{words:?}: {line}");
    }
    assert!(!out.exists());
    assert_eq!(frontalis(&["simulate", "--out", text(&out)]).status.code(), Some(2), "nothing to play");
}

#[test]
fn a_play_that_fails_says_when_where_and_why_and_what_to_change() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let line = refused(&[
        "simulate",
        "--expression",
        "happy",
        "--out",
        text(&out),
        "--method",
        "explicit_euler",
        "--step-ms",
        "33",
        "--stiffness",
        "100",
        "--seconds",
        "60",
        "--ramp-s",
        "0",
    ]);
    assert!(line.contains("Explicit Euler failed at step") && line.contains("implicit Euler"), "{line}");
    let report: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    let failure = &report["failure"];
    assert!(failure["step"].as_u64().unwrap() > 0 && failure["vertex"].is_u64(), "{failure}");
    assert!(report["equilibrium"].is_null());
}

/// The muscles' field says which muscles, how sure, and what pulls besides them; alone it says nothing of the last.
#[test]
fn a_field_of_muscles_names_them_and_what_they_leave() {
    let (_dir, out) = sample();
    let solved = |field: Value, name: &str| -> (Value, String) {
        let project = changed(&out, |p| {
            p["settings"]["skin_model"] = "membrane".into();
            p["settings"]["field"] = field;
        });
        let to = out.join(name);
        done(&["solve", text(&project), "--out", text(&to)]);
        let report: Value = serde_json::from_str(&fs::read_to_string(to.join("report.json")).unwrap()).unwrap();
        (report["muscles"].clone(), fs::read_to_string(to.join("forces.csv")).unwrap())
    };
    let (both, with) = solved(serde_json::json!({ "way": "muscles", "law": "anatomical" }), "both");
    let (alone, without) = solved(serde_json::json!({ "way": "muscles", "law": "anatomical", "alone": true }), "alone");
    for muscles in [&both, &alone] {
        assert_eq!(muscles["law"], "anatomical");
        let pulling = muscles["pulling"].as_array().unwrap();
        assert!(pulling.iter().any(|p| p["muscle"].as_str().unwrap().starts_with("frontalis")), "{muscles}");
        for p in pulling {
            let [low, a, high] = ["low", "activation", "high"].map(|k| p[k].as_f64().unwrap());
            assert!(0.0 <= low && low <= a && a < high, "{p}");
        }
    }
    let number = |key: &str| both["besides"][key].as_f64().unwrap();
    assert!(number("sum_n") > 0.0 && number("spread_over_traction") > 0.0);
    assert!((0.0..1.0).contains(&number("share_of_all")));
    assert!(alone.get("besides").is_none() && with != without);
    assert!(alone.get("shape").is_none());
    let shaped = serde_json::json!({ "way": "muscles", "law": "anatomical", "alone": true, "shape": true });
    let (shaped, other) = solved(shaped, "shaped");
    let names: Vec<&str> =
        shaped["shape"].as_array().unwrap().iter().map(|p| p["parameter"].as_str().unwrap()).collect();
    assert_eq!(names, ["sr", "wr", "sa", "wa"]);
    for p in shaped["shape"].as_array().unwrap() {
        let [low, value, high, usual] = ["low", "value", "high", "usual"].map(|k| p[k].as_f64().unwrap());
        assert!(low < value && value < high && usual > 0.0, "{p}");
    }
    assert!(other != without);
    // A project remembers it in its file, and one from before the choice has it the new way.
    let unknown = changed(&out, |p| p["settings"]["field"] = serde_json::json!({ "way": "muscles", "lone": true }));
    assert!(refused(&["solve", text(&unknown), "--out", text(&out.join("no"))]).contains("lone"));
}
