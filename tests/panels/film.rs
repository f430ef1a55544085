//! The strip of a film: opened, proposed, dragged, stepped, and two frames of it made those of the project.

use std::path::{Path, PathBuf};

use egui::{Key, Modifiers, Pos2};
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::gui::modal::Modal;
use frontalis::gui::{Action, Command};
use frontalis::project::Project;

use crate::stage::{Person, Window, drag, key, keys, open, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

/// A folder with a film of 24 frames: 8 at rest, 7 between, 9 with the brows up.
fn film() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("brow raise.mp4");
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4");
    std::fs::copy(fixture, &path).unwrap();
    (folder, path)
}

fn opened(path: &Path) -> Window {
    let person = Person::default();
    person.will_choose(&[path]);
    let mut window = open(Project::default(), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::O);
    settle(&mut window);
    window
}

fn chosen(window: &Window) -> [usize; 2] {
    match &window.state().view().modal {
        Some(Modal::Film(view)) => view.chosen(),
        other => panic!("{other:?}"),
    }
}

/// Where the strip has a frame, on the row of thumbnails.
fn place(window: &Window, index: usize) -> Pos2 {
    let strip = window.get_by_label_contains("Strip of 24 frames").accesskit_node().bounding_box().unwrap();
    let (left, right) = (strip.x0 as f32 + 7.0, strip.x1 as f32 - 7.0);
    Pos2::new(left + (right - left) * index as f32 / 23.0, strip.y0 as f32 + 30.0)
}

#[test]
fn a_film_proposes_neutral_and_apex_and_both_can_be_dragged_and_stepped() {
    let (_folder, path) = film();
    let mut window = opened(&path);
    let [first, last] = chosen(&window);
    assert!(first < 8 && last >= 14, "{first} {last}");
    window.get_by_label_contains("24 frames of 96 × 96 px");
    window.get_by_label_contains("Proposed by the motion");
    let (from, to) = (place(&window, last), place(&window, 22));
    drag(&mut window, &[from, from + (to - from) / 2.0, to]);
    assert_eq!(chosen(&window), [first, 22]);
    key(&mut window, Key::ArrowLeft);
    assert_eq!(chosen(&window), [first, 21], "keys move the handle that was dragged");
    key(&mut window, Key::Num1);
    keys(&mut window, Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(chosen(&window), [first + 10, 21]);
    key(&mut window, Key::Home);
    settle(&mut window);
    window.get_by_label_contains("First (neutral), frame 1 of 24");
    window.get_by_label("Propose again").click();
    window.run_steps(3);
    assert_eq!(chosen(&window), [first, last]);
    key(&mut window, Key::Escape);
    assert!(window.state().view().modal.is_none() && window.state().project() == &Project::default());
}

#[test]
fn two_frames_of_a_film_become_pictures_beside_it_and_frames_of_the_project() {
    let (folder, path) = film();
    for round in 0..2 {
        let mut window = opened(&path);
        key(&mut window, Key::Home);
        key(&mut window, Key::Num2);
        key(&mut window, Key::End);
        match round {
            0 => window.get_by_label("Use these frames").click(),
            _ => key(&mut window, Key::Enter),
        }
        settle(&mut window);
        let frames = window.state().project().frames.clone();
        assert!(frames.first.unwrap().path.ends_with("brow raise-000001.png"), "round {round}");
        assert!(frames.last.as_ref().unwrap().path.ends_with("brow raise-000024.png"));
        assert_eq!(frames.last.unwrap().width_px, 96);
        assert_eq!(window.state().view().modal, None);
    }
    // The second time the same pictures were there already.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn key_frames_are_named_and_ctrl_with_an_arrow_goes_from_one_to_the_next() {
    let (_folder, path) = film();
    let mut window = opened(&path);
    // Its first, eleventh and twenty-first frames; the outer two lie at rest and at the height.
    assert_eq!(chosen(&window), [0, 20]);
    assert_eq!(window.query_all_by_label_contains("key frame").count(), 3, "both frames, and what the marks are");
    for (which, pressed, to) in
        [(0, Key::ArrowRight, 10), (0, Key::ArrowLeft, 0), (0, Key::ArrowLeft, 0), (1, Key::ArrowLeft, 10)]
    {
        key(&mut window, [Key::Num1, Key::Num2][which]);
        keys(&mut window, Modifiers::COMMAND, pressed);
        assert_eq!(chosen(&window)[which], to);
    }
    key(&mut window, Key::ArrowRight);
    window.get_by_label_contains("predicted frame");
}

#[test]
fn the_same_frame_twice_cannot_be_used_and_a_bad_film_says_why() {
    let (folder, path) = film();
    let mut window = opened(&path);
    key(&mut window, Key::Home);
    key(&mut window, Key::Num2);
    key(&mut window, Key::Home);
    window.get_by_label_contains("must be different");
    let bad = folder.path().join("bad.mp4");
    std::fs::write(&bad, &std::fs::read(&path).unwrap()[..3000]).unwrap();
    let mut window = open(Project::default(), SIZE, true, Person::default());
    window.state_mut().push(Command::Dropped(vec![bad], None));
    settle(&mut window);
    assert!(matches!(&window.state().view().modal, Some(Modal::Error { text, .. }) if text.contains("cut short")));
    assert!(Action::OpenFilm.spec().is_some());
}

#[test]
fn what_comes_and_goes_above_the_strip_does_not_take_it_out_of_the_hand() {
    let (_folder, path) = film();
    let person = Person::default();
    person.will_choose(&[&path]);
    let mut window = open(Project::default(), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::O);
    // While the film is opened, looked through and read, and after: a drag is held by the id of what was pressed.
    let mut ids = std::collections::BTreeSet::new();
    let mut note =
        |window: &Window| ids.extend(window.query_by_label_contains("Strip of").map(|n| n.accesskit_node().id()));
    for _ in 0..200 {
        window.step();
        note(&window);
    }
    settle(&mut window);
    note(&window);
    assert_eq!(ids.len(), 1);
}
