//! The muscles behind the forces: found in the background, shown with their strengths, switched, chosen, the ladder built on demand.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use frontalis::gui::dialogs::Purpose;
use frontalis::gui::panels::muscles::{Second, Tab};
use frontalis::gui::{Command, Workspace};
use frontalis::project::Project;

use crate::stage::{Person, Window, keys, open, project, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

fn says(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

/// The workspace, with its first answer.
fn window(change: impl FnOnce(&mut Project)) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path(), &frontalis::face::generic(), true);
    change(&mut project);
    let mut window = open(project, SIZE, true, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::Num3);
    assert_eq!(window.state().view().workspace, Workspace::Muscles);
    settle(&mut window);
    (window, folder)
}

#[test]
fn muscles_are_found_and_a_switch_fits_the_laws_to_another_set() {
    let (mut window, _folder) = window(|_| {});
    let found = window.state().muscle_work().answer().unwrap().unwrap().clone();
    assert!(says(&window, "Best law:") && says(&window, "Fit the laws to frontalis, pars medialis (left"));
    let of =
        found.fibres.iter().position(|f| frontalis::face::generic().muscles()[f.muscle].id == "frontalis_medial_left");
    let fibre = of.unwrap();
    let before = found.set.contains(&fibre);
    window.get_by_label("Fit the laws to frontalis, pars medialis (left, AU 1)").click();
    window.run_steps(2);
    settle(&mut window);
    let anew = window.state().muscle_work().answer().unwrap().unwrap().clone();
    assert_eq!(anew.set.contains(&fibre), !before);
    assert!(anew.question.muscles.is_some());
    window.get_by_label("Back to the smallest set").click();
    window.run_steps(2);
}

#[test]
fn the_laws_stand_side_by_side_and_a_click_shows_one() {
    let (mut window, _folder) = window(|_| {});
    window.state_mut().view_mut().muscles.tab = Tab::Laws;
    window.state_mut().view_mut().muscles.second = Second::Model;
    window.run_steps(3);
    assert!(says(&window, "Held-out error") && says(&window, "second lobe"));
    let koch = window.query_all_by_label("Koch").last().unwrap().rect();
    window.hover_at(koch.center());
    window.step();
    window.get_all_by_label("Koch").last().unwrap().click();
    window.run_steps(3);
    assert!(says(&window, "Koch, said"), "the right map shows it");
}

#[test]
fn the_ladder_is_built_when_asked_for() {
    let (mut window, _folder) = window(|_| {});
    window.state_mut().view_mut().muscles.tab = Tab::Ladder;
    window.run_steps(2);
    window.state_mut().push(Command::BuildLadder);
    window.run_steps(2);
    settle(&mut window);
    assert!(window.state().muscle_work().ladder().is_some());
    assert!(says(&window, "Recommended:"));
}

#[test]
fn results_are_written_with_the_muscles_and_the_line_that_finds_them_again() {
    let (mut window, folder) = window(|_| {});
    window.state_mut().view_mut().muscles.question.compare = frontalis::fit::Compare::Along;
    settle(&mut window);
    let out = folder.path().join("out");
    window.state_mut().push(Command::FilesChosen(Purpose::ExportFolder, vec![out.clone()]));
    settle(&mut window);
    for name in ["forces.csv", "fit.json", "activations.csv", "profiles.png", "fields.csv", "report.html"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("frontalis fit &#39;PROJECT") || report.contains("frontalis fit 'PROJECT"), "the command");
    assert!(report.contains("--compare along"));
}

#[test]
fn without_marks_it_says_what_is_missing() {
    let (window, _folder) = window(|p| p.features.clear());
    assert!(says(&window, "No force can be believed yet"));
}
