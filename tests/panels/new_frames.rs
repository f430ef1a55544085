//! Other pictures over a project with marks, paths typed into the dialog, and what the still points say of the marking error.

use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use frontalis::gui::dialogs::Answer;
use frontalis::gui::modal::Modal;
use frontalis::gui::panels::frames::SideTab;
use frontalis::gui::{Action, Command};
use frontalis::pipeline::Warning;
use frontalis::project::{Mark, Project, sample};

use crate::stage::{Person, Window, key, keys, open, project, settle, write_frames};

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn frames_opened_over_the_untouched_sample_begin_a_new_project() {
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = write_frames(folder.path(), &frontalis::face::generic());
    let person = Person::default();
    person.will_choose(&[&first, &last]);
    let mut window = open(sample::project().unwrap(), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND, Key::F);
    settle(&mut window);
    let now = window.state().project();
    assert!(now.frames.first.as_ref().unwrap().path.ends_with("neutral.png"));
    assert!(now.frames.last.as_ref().unwrap().path.ends_with("raised.png"));
    let empty = Project { frames: now.frames.clone(), ..Project::default() };
    assert_eq!(now, &empty, "none of the sample's marks, scale or settings");
    assert!(window.state().outcome().peak().vertex().is_none());
    assert_eq!(window.state().view().modal, None);
}

/// A window on a marked project whose person opens two other pictures, of another size.
fn other_pictures() -> (Window, tempfile::TempDir, Project) {
    let folder = tempfile::tempdir().unwrap();
    let before = project(folder.path(), &frontalis::face::generic(), true);
    let paths = ["a.png", "b.png"].map(|n| folder.path().join(n));
    for (i, path) in paths.iter().enumerate() {
        image::RgbImage::from_pixel(200, 160, image::Rgb([90, 80, 70 + i as u8])).save(path).unwrap();
    }
    let person = Person::default();
    person.will_choose(&[&paths[0], &paths[1]]);
    let mut window = open(before.clone(), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND, Key::F);
    settle(&mut window);
    assert!(
        matches!(&window.state().view().modal, Some(Modal::OtherFrames(frames)) if frames.len() == 2),
        "one question"
    );
    assert_eq!(window.state().project(), &before, "nothing is changed before the answer");
    (window, folder, before)
}

#[test]
fn other_pictures_over_marks_are_asked_about_and_escape_leaves_everything() {
    let (mut window, _folder, before) = other_pictures();
    key(&mut window, Key::Escape);
    assert_eq!(window.state().view().modal, None);
    assert_eq!(window.state().project(), &before);
}

#[test]
fn other_pictures_may_begin_a_new_project_by_enter_alone() {
    let (mut window, _folder, _) = other_pictures();
    key(&mut window, Key::Enter);
    settle(&mut window);
    let now = window.state().project();
    assert!(now.landmarks.is_empty() && now.features.is_empty());
    assert!(now.frames.first.as_ref().unwrap().path.ends_with("a.png"));
    assert!(now.frames.last.as_ref().unwrap().path.ends_with("b.png"));
}

#[test]
fn other_pictures_may_keep_the_marks_as_one_step_and_marks_outside_are_warned_of() {
    let (mut window, _folder, before) = other_pictures();
    window.get_by_label("Keep the marks").click();
    settle(&mut window);
    let now = window.state().project().clone();
    assert_eq!((&now.landmarks, &now.features), (&before.landmarks, &before.features));
    assert_eq!(now.frames.first.as_ref().unwrap().width_px, 200);
    assert_eq!(window.state().steps().len(), 1);
    assert!(matches!(window.state().outcome().warnings[0], Warning::OutsidePicture { .. }));
    window.state_mut().view_mut().frames.side = SideTab::Results;
    window.run_steps(3);
    window.get_by_label_contains("marks lie outside their picture");
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(window.state().project(), &before);
}

#[test]
fn a_picture_that_only_moved_on_disk_is_not_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    let before = project(folder.path(), &frontalis::face::generic(), true);
    let moved = folder.path().join("moved.png");
    std::fs::copy(folder.path().join("raised.png"), &moved).unwrap();
    let mut window = open(before.clone(), SIZE, true, Person::default());
    window.state_mut().push(Command::LoadFrame(frontalis::project::Which::Last, moved));
    settle(&mut window);
    assert_eq!(window.state().view().modal, None);
    assert_eq!(window.state().project().features, before.features);
    assert!(window.state().project().frames.last.as_ref().unwrap().path.ends_with("moved.png"));
}

/// The dialog that asks for the paths of two frames.
fn typing() -> Window {
    let person = Person::default();
    person.answers.borrow_mut().push(Answer::Unavailable);
    let mut window = open(Project::default(), SIZE, true, person);
    keys(&mut window, Modifiers::COMMAND, Key::F);
    window.run_steps(4);
    window
}

fn tab(pressed: bool) -> Event {
    Event::Key { key: Key::Tab, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
}

fn typed(window: &Window) -> String {
    match &window.state().view().modal {
        Some(Modal::Path { typed, .. }) => typed.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn letters_typed_around_tab_reach_their_own_fields_even_within_one_pass() {
    let mut window = typing();
    let text = |t: &str| Event::Text(t.to_owned());
    window.input_mut().events.extend([text("a"), text("b"), tab(true), tab(false), text("c"), text("d")]);
    window.run_steps(8);
    assert_eq!(typed(&window), "ab\ncd");
}

#[test]
fn paths_that_were_typed_come_back_after_an_error_to_be_mended() {
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = write_frames(folder.path(), &frontalis::face::generic());
    let mut window = typing();
    let wrong = format!("{}x", last.display());
    for event in [Event::Text(first.display().to_string()), tab(true), tab(false), Event::Text(wrong.clone())] {
        window.event(event);
        window.run_steps(3);
    }
    key(&mut window, Key::Enter);
    settle(&mut window);
    assert!(matches!(&window.state().view().modal, Some(Modal::Error { text, .. }) if text.contains("raised.pngx")));
    window.get_by_label("Change the paths").click();
    window.run_steps(4);
    assert_eq!(typed(&window), format!("{}\n{wrong}", first.display()));
    // Mended in the second field, and accepted; then nothing is kept.
    window.event(tab(true));
    window.event(tab(false));
    window.run_steps(4);
    key(&mut window, Key::End);
    key(&mut window, Key::Backspace);
    key(&mut window, Key::Enter);
    settle(&mut window);
    assert!(window.state().project().frames.last.is_some());
    assert_eq!((&window.state().view().modal, &window.state().view().typed), (&None, &None));
}

#[test]
fn the_scatter_of_the_still_points_can_become_the_marking_error() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut project = project(folder.path(), &face, true);
    for (i, v) in face.region("still").iter().enumerate() {
        let mark = project.features.get_mut(v).unwrap().last.as_mut().unwrap();
        *mark = Mark::new([mark.at_px[0] + 0.3 * (i as f64 * 2.1).sin(), mark.at_px[1] + 0.3 * (i as f64 * 1.3).cos()]);
    }
    let mut window = open(project, SIZE, true, Person::default());
    let noise = window.state().outcome().head.noise_floor_px.unwrap();
    for side in [SideTab::Results, SideTab::Settings] {
        window.state_mut().view_mut().frames.side = side;
        window.run_steps(3);
        window.get_by_label_contains(&format!("Still points scatter {noise:.2} px"));
        window.get_by_label_contains("flatters marks that were smoothed");
        let button = window.get_by_label("Use it as the marking error");
        button.scroll_to_me();
        window.run_steps(4);
        window.get_by_label("Use it as the marking error").click();
        window.run_steps(3);
        let sigma = window.state().project().settings.marking_sigma_px;
        assert!((sigma - noise).abs() < 0.0051 && sigma != 1.0, "{sigma} {noise}");
        assert!(window.query_by_label("Use it as the marking error").is_none(), "nothing is left to take");
        window.state_mut().push(Command::Do(Action::Undo));
        window.run_steps(3);
        assert_eq!(window.state().project().settings.marking_sigma_px, 1.0);
    }
}

#[test]
fn without_landmarks_there_is_no_residual() {
    let mut window = open(Project::default(), SIZE, true, Person::default());
    window.state_mut().view_mut().frames.side = SideTab::Results;
    window.run_steps(3);
    assert!(window.query_by_label_contains("Residual before").is_none());
    window.get_by_label("Landmarks placed");
}
