//! Killed at any moment, a program that edits, journals and saves loses at most the gesture in progress.
//!
//! The test starts itself as another process, which edits as the window does (a gesture, the journal, now and then a save) and says each
//! gesture that is safe; it kills that process at a random moment, and looks at what is left on the disk. Hundreds of times:
//! `FRONTALIS_KILLS=1000 cargo test --test killed`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use frontalis::project::autosave::{self, Named};
use frontalis::project::{Edit, History, PointId, Project, file, whole_file};
use rand::{RngExt, SeedableRng};

const CHILD: &str = "FRONTALIS_EDIT_UNTIL_KILLED";

/// Points that every gesture moves together: a mixture of two states shows.
const POINTS: u32 = 60;

/// A save after so many gestures.
const SAVE_EVERY: u64 = 5;

/// The number of the gesture that made this state; all points agree on it.
fn gesture_of(project: &Project) -> u64 {
    let numbers: Vec<f64> = project.features.values().filter_map(|f| f.last.map(|m| m.at_px[0])).collect();
    let first = numbers.first().copied().unwrap_or(0.0);
    assert!(numbers.is_empty() || numbers.len() == POINTS as usize, "{} points", numbers.len());
    assert!(numbers.iter().all(|n| *n == first), "a mixture of two states");
    first as u64
}

/// What the next start would go on with, as the window finds it.
fn reopened(path: &Path, locks: &Path) -> (Project, Named) {
    let place = Named::take(path, Some(locks));
    let recovered = autosave::recover(place.journal(), Some(path)).map(|r| r.project);
    let project = recovered.unwrap_or_else(|| file::load(path).unwrap());
    (project, place)
}

/// The process that is killed; without its variable it is no test.
#[test]
fn edits_until_it_is_killed() {
    let Some(folder) = std::env::var_os(CHILD) else { return };
    let (path, locks) = (Path::new(&folder).join("p.frontalis.json"), Path::new(&folder).join("state"));
    let (project, place) = reopened(&path, &locks);
    let mut history = History::new(project);
    let mut out = std::io::stdout();
    for number in gesture_of(history.project()) + 1.. {
        history.begin_gesture();
        for vertex in 0..POINTS {
            history.apply(&Edit::Put(PointId::FeatureLast(vertex), [number as f64, f64::from(vertex)])).unwrap();
        }
        history.commit_gesture();
        autosave::write(history.project(), place.journal()).unwrap();
        writeln!(out, "\nsafe {number}").unwrap();
        out.flush().unwrap();
        if number % SAVE_EVERY == 0 {
            file::save(history.project(), &path).unwrap();
            autosave::remove(place.journal());
        }
    }
}

#[test]
fn killed_at_any_moment_it_loses_at_most_the_gesture_in_progress() {
    let kills: u32 = std::env::var("FRONTALIS_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(100);
    let dir = tempfile::tempdir().unwrap();
    let (path, locks) = (dir.path().join("p.frontalis.json"), dir.path().join("state"));
    file::save(&Project::default(), &path).unwrap();
    let mut random = rand_pcg::Pcg32::seed_from_u64(11);
    let (mut before, mut parts) = (0, 0);
    for kill in 0..kills {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["edits_until_it_is_killed", "--exact", "--nocapture"])
            .env(CHILD, dir.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let safe = |line: &str| line.strip_prefix("safe ").and_then(|n| n.parse::<u64>().ok());
        // It is killed at work, and sometimes on its way there.
        let mut said = None;
        if kill % 10 != 0 {
            said = lines.by_ref().find_map(|l| safe(&l.unwrap()));
            assert!(said.is_some(), "the process ended before a gesture");
        }
        std::thread::sleep(Duration::from_micros(random.random_range(0..25_000)));
        child.kill().unwrap();
        child.wait().unwrap();
        // What it said until it was killed still lies in the pipe.
        let said = lines.filter_map(|l| safe(&l.ok()?)).last().or(said).unwrap_or(before);
        let (project, _place) = reopened(&path, &locks);
        let found = gesture_of(&project);
        assert!((said.max(before)..=said + 1).contains(&found), "kill {kill}: said {said}, found {found}");
        file::load(&path).unwrap();
        before = found;
        let is_part = |e: &std::fs::DirEntry| e.file_name().to_string_lossy().ends_with(".part");
        parts = std::fs::read_dir(dir.path()).unwrap().filter(|e| is_part(e.as_ref().unwrap())).count();
    }
    println!("{kills} kills, {before} gestures, {parts} files in the making left behind");
    assert!(before > u64::from(kills), "it was killed at work");
    whole_file::sweep(dir.path(), Duration::ZERO);
    let left: Vec<String> =
        std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    assert!(left.iter().all(|n| n.starts_with("p.frontalis.json") || n == "state"), "{left:?}");
}
