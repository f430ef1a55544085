//! Files: frames opened, projects saved and opened again, unsaved changes asked about, and errors that lose nothing.

use std::path::Path;

use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::gui::dialogs::{Answer, Purpose};
use frontalis::gui::modal::Modal;
use frontalis::gui::{Action, App, Command};
use frontalis::project::{Project, Which, file};

use crate::stage::{Person, Window, key, keys, open, project, settle, show, write_frames};

const SIZE: [f32; 2] = [1280.0, 800.0];

fn empty(person: &Person) -> Window {
    open(Project::default(), SIZE, true, person.clone())
}

#[test]
fn two_frames_are_opened_and_undone() {
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = write_frames(folder.path(), &frontalis::face::generic());
    let person = Person::default();
    person.will_choose(&[&first, &last]);
    let mut window = empty(&person);
    keys(&mut window, Modifiers::COMMAND, Key::F);
    settle(&mut window);
    let frames = window.state().project().frames.clone();
    assert_eq!(frames.first.as_ref().map(|f| f.width_px), Some(crate::stage::SIDE));
    assert!(frames.first.unwrap().path.ends_with("neutral.png"));
    assert!(frames.last.unwrap().path.ends_with("raised.png"));
    assert!(window.state().title().ends_with('•'));
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert!(window.state().project().frames.last.is_none() || window.state().project().frames.first.is_none());
}

#[test]
fn a_folder_proposes_its_first_and_last_picture() {
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = write_frames(folder.path(), &frontalis::face::generic());
    for (from, to) in [(&first, "f_01.png"), (&first, "f_02.png"), (&last, "f_10.png")] {
        std::fs::copy(from, folder.path().join(to)).unwrap();
    }
    std::fs::remove_file(first).unwrap();
    std::fs::remove_file(last).unwrap();
    let person = Person::default();
    person.will_choose(&[folder.path()]);
    let mut window = empty(&person);
    window.state_mut().push(Command::Do(Action::OpenFolder));
    settle(&mut window);
    assert!(matches!(window.state().view().modal, Some(Modal::Film(_))), "{:?}", window.state().view().modal);
    window.get_by_label("Use these frames").click();
    settle(&mut window);
    let frames = window.state().project().frames.clone();
    assert!(frames.first.unwrap().path.ends_with("f_01.png"));
    assert!(frames.last.unwrap().path.ends_with("f_10.png"));
}

#[test]
fn a_project_is_saved_and_opened_again_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let person = Person::default();
    let at = folder.path().join("a.frontalis.json");
    person.will_choose(&[&at]);
    let mut window = open(project(folder.path(), &face, true), SIZE, true, person.clone());
    keys(&mut window, Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    assert!(at.exists());
    let kept = window.state().project().clone();
    assert_eq!(kept.frames.first.as_ref().unwrap().path, "neutral.png", "a path beside the project is relative");
    assert!(!window.state().unsaved());
    assert_eq!(file::load(&at).unwrap(), kept);

    let mut other = empty(&person);
    person.will_choose(&[&at]);
    keys(&mut other, Modifiers::COMMAND, Key::O);
    settle(&mut other);
    assert_eq!(other.state().project(), &kept);
    assert_eq!(other.state().outcome(), window.state().outcome());
}

#[test]
fn unsaved_changes_are_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), SIZE, true, Person::default());
    window.state_mut().push(Command::Do(Action::ClearLast));
    window.run_steps(2);
    let changed = window.state().project().clone();
    keys(&mut window, Modifiers::COMMAND, Key::N);
    assert!(matches!(window.state().view().modal, Some(Modal::Unsaved(_))));
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    assert_eq!(window.state().project(), &changed);
    keys(&mut window, Modifiers::COMMAND, Key::N);
    window.get_by_label("Discard").click();
    window.run_steps(3);
    assert_eq!(window.state().project(), &Project::default());
}

#[test]
fn a_broken_project_is_a_dialog_and_the_open_one_stays() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let bad = folder.path().join("bad.frontalis.json");
    std::fs::write(&bad, "{\"frontalis_project\": 1, \"name\": 3}").unwrap();
    let person = Person::default();
    let mut window = open(project(folder.path(), &face, true), SIZE, true, person.clone());
    let before = window.state().project().clone();
    person.will_choose(&[&bad]);
    keys(&mut window, Modifiers::COMMAND, Key::O);
    settle(&mut window);
    let Some(Modal::Error { text, .. }) = &window.state().view().modal else { panic!("no dialog") };
    assert!(text.contains("bad.frontalis.json") && text.lines().count() == 1, "{text}");
    assert_eq!(window.state().project(), &before);
}

#[test]
fn a_picture_that_cannot_be_read_is_a_dialog() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("cut.png");
    std::fs::write(&bad, b"\x89PNG\r\n\x1a\n\0\0").unwrap();
    let mut window = empty(&Person::default());
    window.state_mut().push(Command::LoadFrame(Which::First, bad));
    settle(&mut window);
    assert!(matches!(&window.state().view().modal, Some(Modal::Error { text, .. }) if text.contains("cut.png")));
    assert_eq!(window.state().project(), &Project::default());
}

#[test]
fn a_changed_frame_is_told_and_can_be_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let p = project(folder.path(), &face, true);
    let [first, last] = ["neutral.png", "raised.png"].map(|n| folder.path().join(n));
    std::fs::copy(&last, &first).unwrap();
    let window = open(p, SIZE, true, Person::default());
    window.get_by_label_contains("not the one that was marked");
    window.get_by_label("Find the first frame…");
}

#[test]
fn without_a_file_dialog_a_path_can_be_typed() {
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = write_frames(folder.path(), &frontalis::face::generic());
    let person = Person::default();
    person.answers.borrow_mut().push(Answer::Unavailable);
    let mut window = empty(&person);
    keys(&mut window, Modifiers::COMMAND, Key::F);
    assert_eq!(person.asked.borrow()[..], [Purpose::Frames]);
    let fields = |window: &Window, i: usize| {
        let all: Vec<_> = window.get_all_by_role(egui::Role::TextInput).collect();
        all[i].rect().center()
    };
    for (i, path) in [&first, &last].into_iter().enumerate() {
        let at = fields(&window, i);
        crate::stage::drag(&mut window, &[at, at]);
        window.event(egui::Event::Text(path.display().to_string()));
        window.run_steps(3);
    }
    window.get_by_label("Go on").click();
    settle(&mut window);
    assert!(window.state().project().frames.last.is_some());
}

#[test]
fn the_history_is_a_list_of_names_to_click() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), SIZE, true, Person::default());
    let before = window.state().project().clone();
    window.state_mut().push(Command::Do(Action::ClearLast));
    keys(&mut window, Modifiers::COMMAND, Key::H);
    window.get_by_label("Clear all marks of the last frame");
    window.get_by_label("As opened").click();
    window.run_steps(3);
    assert_eq!(window.state().project(), &before);
    key(&mut window, Key::Escape);
}

#[test]
fn frames_moved_with_their_project_are_found() {
    // A relative path begins at the project's folder, wherever the program was started.
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut p = project(folder.path(), &face, true);
    for (frame, name) in [(&mut p.frames.first, "neutral.png"), (&mut p.frames.last, "raised.png")] {
        frame.as_mut().unwrap().path = name.into();
    }
    let at = folder.path().join("moved.frontalis.json");
    file::save(&p, &at).unwrap();
    let person = Person::default();
    person.will_choose(&[at.as_path() as &Path]);
    let mut window = empty(&person);
    keys(&mut window, Modifiers::COMMAND, Key::O);
    settle(&mut window);
    assert!(window.query_by_label_contains("no such file").is_none());
    window.get_by_label("First frame");
}

#[test]
fn results_are_exported_whole() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let person = Person::default();
    let out = folder.path().join("out");
    person.will_choose(&[&out]);
    let mut window = open(project(folder.path(), &face, true), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND, Key::E);
    settle(&mut window);
    for name in ["forces.csv", "marks.csv", "forces.vtp", "report.json", "height_map.png"] {
        assert!(std::fs::metadata(out.join(name)).unwrap().len() > 100, "{name}");
    }
    let rows = std::fs::read_to_string(out.join("forces.csv")).unwrap().lines().count();
    assert_eq!(rows, face.mesh().len() + 1);
}

#[test]
fn the_sample_opens_and_takes_its_frames_along_when_saved() {
    let folder = tempfile::tempdir().unwrap();
    let person = Person::default();
    let at = folder.path().join("mine.frontalis.json");
    person.will_choose(&[&at]);
    let mut window = empty(&person);
    window.state_mut().push(Command::Do(Action::OpenSample));
    settle(&mut window);
    assert!(window.state().outcome().field.largest(&window.state().outcome().states).is_some());
    assert!(window.query_by_label_contains("no such file").is_none());
    keys(&mut window, Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    assert_eq!(window.state().view().modal, None);
    let saved = file::load(&at).unwrap();
    for (name, frame) in
        ["first.png", "last.png"].into_iter().zip([saved.frames.first.unwrap(), saved.frames.last.unwrap()])
    {
        assert_eq!(frame.path, name, "beside the project, wherever the program was started");
        assert!(frontalis::project::frames_check::status(&at, &frame).is_ok());
    }
}

#[test]
fn work_that_was_not_saved_is_offered_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("kept.frontalis.json");
    let face = frontalis::face::generic();
    let saved = project(folder.path(), &face, true);
    file::save(&saved, &at).unwrap();
    let start = || {
        let person = Box::new(Person::default());
        let app = App::new(file::load(&at).unwrap(), Some(at.clone()), frontalis::face::generic(), person);
        show(app.with_autosave(), SIZE, true)
    };
    let mut window = start();
    window.state_mut().push(Command::Do(Action::ClearLast));
    window.run_steps(3);
    let changed = window.state().project().clone();
    // The program is killed here: nothing is asked, nothing is saved.
    drop(window);

    let mut window = start();
    assert!(matches!(window.state().view().modal, Some(Modal::Recover { .. })));
    window.get_by_label("Recover it");
    key(&mut window, Key::Enter);
    assert_eq!(window.state().project(), &changed, "Enter is the button that goes on");
    assert!(window.state().unsaved());
    assert_eq!(file::load(&at).unwrap(), saved, "the file itself is touched by a save alone");
    keys(&mut window, Modifiers::COMMAND, Key::S);
    drop(window);
    assert_eq!(start().state().view().modal, None, "after a save nothing is left to recover");
}

#[test]
fn adjusting_a_frame_that_was_replaced_meanwhile_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), SIZE, true, Person::default());
    std::fs::copy(folder.path().join("raised.png"), folder.path().join("neutral.png")).unwrap();
    key(&mut window, Key::C);
    settle(&mut window);
    window.get_by_label_contains("was replaced by another picture");
}

#[test]
fn a_spoilt_project_offers_what_lies_beside_it_and_is_never_overwritten() {
    use frontalis::project::{Edit, autosave};
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let at = folder.path().join("work.frontalis.json");
    let saved = project(folder.path(), &face, true);
    file::save(&saved, &at).unwrap();
    let mut later = saved.clone();
    Edit::Rename("later".into()).apply(&mut later).unwrap();
    // The copy of the save before, and the journal after it.
    file::save(&later, &at).unwrap();
    let mut unsaved = later.clone();
    Edit::ClearLast.apply(&mut unsaved).unwrap();
    autosave::write(&unsaved, &autosave::beside(&at)).unwrap();
    let whole = std::fs::read(&at).unwrap();
    std::fs::write(&at, &whole[..whole.len() / 2]).unwrap();
    for (button, expected) in [("Take the unsaved work", &unsaved), ("Take the copy before the last save", &saved)] {
        let person = Person::default();
        person.will_choose(&[&at]);
        let mut window = empty(&person);
        keys(&mut window, Modifiers::COMMAND, Key::O);
        settle(&mut window);
        assert!(matches!(window.state().view().modal, Some(Modal::Spoilt { .. })), "{:?}", window.state().view().modal);
        window.get_by_label_contains(button).click();
        settle(&mut window);
        assert_eq!(window.state().project(), expected);
        assert!(window.state().unsaved() && window.query_by_label_contains("no such file").is_none());
        keys(&mut window, Modifiers::COMMAND, Key::S);
        settle(&mut window);
        assert!(!window.state().unsaved());
        assert_eq!(std::fs::read(&at).unwrap(), whole[..whole.len() / 2], "the spoilt file is left alone");
    }
    assert!(folder.path().join("work-recovered.frontalis.json").exists());
    assert!(folder.path().join("work-recovered-2.frontalis.json").exists());
}

#[test]
fn recent_projects_are_listed_opened_and_grey_when_gone() {
    let (folder, state) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let face = frontalis::face::generic();
    let project = project(folder.path(), &face, true);
    let [a, b] = ["first one", "second one"].map(|n| folder.path().join(format!("{n}.frontalis.json")));
    file::save(&project, &a).unwrap();
    file::save(&project, &b).unwrap();
    let start = |path: Option<std::path::PathBuf>| {
        let opened = path.as_deref().map_or_else(Project::default, |p| file::load(p).unwrap());
        let app = App::new(opened, path, frontalis::face::generic(), Box::new(Person::default()));
        show(app.with_autosave_in(Some(state.path().to_owned())), SIZE, true)
    };
    drop(start(Some(a.clone())));
    drop(start(Some(b.clone())));
    std::fs::remove_file(&b).unwrap();
    let mut window = start(None);
    window.get_by_role_and_label(egui::Role::Button, "File").click();
    window.run_steps(4);
    window.get_by_label_contains("Open recent").click();
    window.run_steps(4);
    let gone = window.get_by_label("second one.frontalis.json");
    assert!(gone.accesskit_node().is_disabled());
    window.get_by_label("first one.frontalis.json").click();
    settle(&mut window);
    assert_eq!(window.state().project(), &project);
}

#[test]
fn two_windows_without_a_file_do_not_share_a_journal() {
    let state = tempfile::tempdir().unwrap();
    let start = || {
        let app = App::new(Project::default(), None, frontalis::face::generic(), Box::new(Person::default()));
        show(app.with_autosave_in(Some(state.path().to_owned())), SIZE, true)
    };
    let (mut one, mut two) = (start(), start());
    for (window, name) in [(&mut one, "one"), (&mut two, "two")] {
        window.state_mut().push(Command::Edit(frontalis::project::Edit::Rename(name.into())));
        window.run_steps(3);
    }
    // Both are killed.
    drop((one, two));
    let mut found = Vec::new();
    let mut windows = Vec::new();
    for _ in 0..2 {
        let mut window = start();
        window.get_by_label("Recover it").click();
        window.run_steps(3);
        found.push(window.state().project().name.clone());
        windows.push(window);
    }
    found.sort();
    assert_eq!(found, ["one", "two"]);
}
