//! The studies in the window: begun, stopped and taken up again; tables opened, pointed at, filtered, zoomed, exported and applied.

use std::path::{Path, PathBuf};

use egui::{Key, Modifiers};
use egui_kittest::SnapshotOptions;
use egui_kittest::kittest::Queryable as _;
use frontalis::displacement::DepthRule;
use frontalis::gui::dialogs::Purpose;
use frontalis::gui::{Action, Command, Workspace};
use frontalis::study::{Run, table};

use crate::pictures::can_draw;
use crate::stage::{Person, Window, keys, open, project, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

/// A quick study of stability, one seed, as `frontalis study stability --quick` wrote it.
fn stability() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/study/stability.csv")
}

/// A made-up table of three methods at two noises: the window knows no difference.
fn accuracy(folder: &Path) -> PathBuf {
    let mut runs = Vec::new();
    for noise in [0.5, 1.0] {
        for (k, level) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            for seed in 1..=3 {
                let f = 4.0_f64.powf(k as f64);
                let run = |method: &str, setting: &str, ms: f64, error: f64| {
                    let setting = format!("level={level}{setting}");
                    let run =
                        Run::new("accuracy", "inverse", method, setting).timed(ms * f).erring(error * noise / f.sqrt());
                    Run { noise_px: noise, vertices: 612, seed, ..run }
                };
                runs.push(run("Direct", "; springs=one for all", 0.004, 0.9));
                runs.push(run("Slide on surface", "", 0.5, 0.3));
                let last = run("Muscle-based", "", 9.0, 0.08);
                let stopped = last.clone().failing(Some("out of iterations".into()));
                runs.push(if k == 3 { Run { force_error: None, ..stopped } } else { last });
            }
        }
    }
    let path = folder.join("accuracy.csv");
    std::fs::write(&path, table::csv(&runs)).unwrap();
    path
}

/// A made-up table of a ladder: three rungs on 59 twins at two marking errors.
fn ladder(folder: &Path) -> PathBuf {
    let mut runs = Vec::new();
    for (method, depth, worst, ms) in [
        ("Direct", "fixed", 4.0, 0.3),
        ("Regularised, discrepancy", "height", 1.2, 0.9),
        ("Muscles, all", "height", 0.6, 2.0),
    ] {
        let setting = format!("depth={depth}; mesh=own");
        let run = |noise: f64, seed: u64| {
            let run = Run::new("ladder", "measured", method, setting.clone());
            Run { noise_px: noise, vertices: 612, seed, ..run }
        };
        for times in [0.25_f64, 1.0] {
            runs.extend((1..=59).map(|seed| {
                let error = worst * times.sqrt() * seed as f64 / 59.0;
                run(times, seed).erring(error).with("times_stated", times)
            }));
        }
        runs.push(run(1.0, 1).timed(ms).with("spread_ms", 0.01));
    }
    let path = folder.join("ladder.csv");
    std::fs::write(&path, table::csv(&runs)).unwrap();
    path
}

fn says(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

/// The workspace with a table.
fn window(size: [f32; 2], dark: bool, table: impl FnOnce(&Path) -> PathBuf) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path(), &frontalis::face::generic(), true);
    let mut window = open(project, size, dark, Person::default());
    let path = table(folder.path());
    window.state_mut().push(Command::FilesChosen(Purpose::OpenStudy, vec![path]));
    settle(&mut window);
    assert_eq!(window.state().view().workspace, Workspace::Study);
    (window, folder)
}

fn press(window: &mut Window, name: &str) {
    let at = window.query_all_by_label_contains(name).next().unwrap().rect().center();
    window.hover_at(at);
    window.run_steps(2);
    window.drag_at(at);
    window.step();
    window.drop_at(at);
    window.run_steps(3);
}

#[test]
fn a_table_is_opened_pointed_at_and_filtered() {
    let (mut window, _folder) = window(SIZE, true, accuracy);
    assert!(says(&window, "Chart, inverse: 3 methods, 12 points"));
    // The largest noise up to one pixel is shown first: half as much halves the error.
    assert!(says(
        &window,
        "Direct, level 1, springs one for all, 612 vertices, 1 px of noise, 0.00400 ms, force error 90.0 %"
    ));
    window.get_by_role_and_label(egui::Role::Button, "0.50").click();
    window.run_steps(3);
    assert!(says(&window, "force error 45.0 %"));
    assert!(says(&window, "3 of 3 runs failed: out of iterations"), "what failed is told where it is pointed at");
    window.get_by_role_and_label(egui::Role::CheckBox, "Direct").click();
    window.run_steps(3);
    assert!(says(&window, "Chart, inverse: 2 methods, 8 points"));
    window.get_by_label("Show all").click();
    window.run_steps(3);
    assert!(says(&window, "Chart, inverse: 3 methods, 12 points"));
}

#[test]
fn zooming_keeps_what_is_under_the_pointer_and_fit_shows_all_again() {
    let (mut window, _folder) = window(SIZE, true, accuracy);
    let dot = "Slide on surface, level 2";
    let place = |window: &Window| window.query_all_by_label_contains(dot).next().unwrap().rect().center();
    let before = place(&window);
    let other = |window: &Window| {
        window.query_all_by_label_contains("Slide on surface, level 3").next().unwrap().rect().center()
    };
    let apart = before.distance(other(&window));
    window.hover_at(before);
    window.step();
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    });
    window.run_steps(20);
    assert!(place(&window).distance(before) < 1.5, "{} {before}", place(&window));
    assert!(place(&window).distance(other(&window)) > 1.2 * apart);
    window.state_mut().push(Command::Do(Action::Fit));
    window.run_steps(3);
    assert!(place(&window).distance(before) < 0.5);
}

#[test]
fn a_method_that_is_picked_shows_what_it_changes_and_is_applied_as_one_step() {
    let (mut window, _folder) = window(SIZE, true, accuracy);
    let before = window.state().project().clone();
    press(&mut window, "Muscle-based, level 1");
    assert!(says(&window, "This is no choice of a project"));
    press(&mut window, "Slide on surface, level 2");
    assert!(says(&window, "Depth: on the first frame's surface (now frozen, as the thesis)."));
    assert!(says(&window, "Map, Change against the project as it is"));
    assert_eq!(window.state().project(), &before, "picking changes nothing");
    // What the map says is what the project then has.
    let foretold = window.state().study_work().preview().unwrap().outcome.field.force.clone();
    let steps = window.state().steps().len();
    keys(&mut window, Modifiers::COMMAND, Key::Enter);
    settle(&mut window);
    assert_eq!(window.state().project().settings.depth, DepthRule::SlideOnSurface);
    assert_eq!(window.state().outcome().field.force, foretold);
    assert_eq!(window.state().steps().len(), steps + 1);
    assert!(says(&window, "The project is solved so already."));
    window.state_mut().push(Command::Do(Action::Undo));
    settle(&mut window);
    assert_eq!(window.state().project(), &before);
}

#[test]
fn a_rung_is_chosen_for_an_accuracy_and_for_a_time_and_applied_as_one_step() {
    let (mut window, _folder) = window(SIZE, true, ladder);
    let before = window.state().project().clone();
    assert!(says(
        &window,
        "Chart, Error that 95 % of twins stay below, against the time after a drag: 3 methods, 3 points"
    ));
    // By hand: the largest errors of 59 twins are 400, 120 and 60 %.
    assert!(says(&window, "For 10 %: no rung meets it at 1.0 px. The best is Muscles, all (depth height, mesh own)"));
    assert!(says(&window, "Within 16 ms: Muscles, all (depth height, mesh own). 95 % of twins err by less than 60 %"));
    // As it would be typed into the field.
    window.state_mut().view_mut().study.goals.accuracy = Some(1.5);
    window.run_steps(3);
    assert!(says(
        &window,
        "For 150 %: Regularised, discrepancy (depth height, mesh own). 95 % of twins err by less than 120 % at 1.0 px; 0.90 ms after a drag."
    ));
    assert!(says(
        &window,
        "The next rung up, Muscles, all (depth height, mesh own), would err by less than 60 % (60 points less) for 1.1 ms more."
    ));
    assert_eq!(window.state().project(), &before, "looking changes nothing");
    let steps = window.state().steps().len();
    window.get_by_label("Apply what is chosen for 150 %").click();
    settle(&mut window);
    let settings = &window.state().project().settings;
    assert_eq!((settings.depth, settings.field.name()), (DepthRule::KeepHeight, "regularised"));
    assert_eq!(window.state().steps().len(), steps + 1);
    window.state_mut().push(Command::Do(Action::Undo));
    settle(&mut window);
    assert_eq!(window.state().project(), &before);
    // At a quarter of the marking error all err half as much.
    window.get_by_role_and_label(egui::Role::Button, "0.25").click();
    window.run_steps(3);
    assert!(says(&window, "0.300 ms after a drag, 95 % of twins err by less than 200 %"));
}

#[test]
fn maps_tell_every_cell_and_are_exported_by_the_command_line_s_own_writer() {
    let (mut window, folder) = window(SIZE, true, |_| stability());
    assert!(says(&window, "Stability map, Symplectic Euler"));
    assert!(says(
        &window,
        "Symplectic Euler, step 10 ms, stiffness 100, 0 of 1 ended well, First cause of failure: a vertex ran away"
    ));
    window.get_by_label_contains("Distance of the camera").click();
    window.run_steps(3);
    press(&mut window, "Slide on surface, distance 300 mm");
    assert!(window.state().study_work().preview().is_some());
    let out = folder.path().join("out");
    window.state_mut().push(Command::FilesChosen(Purpose::StudyFolder, vec![out.clone()]));
    settle(&mut window);
    assert_eq!(std::fs::read(out.join("stability.csv")).unwrap(), std::fs::read(stability()).unwrap());
    for name in ["stability.svg", "stability.png", "stability.md"] {
        assert!(out.join(name).is_file(), "{name}");
    }
}

#[test]
fn what_is_no_table_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = open(frontalis::project::Project::default(), SIZE, true, Person::default());
    let path = folder.path().join("notes.csv");
    std::fs::write(&path, "a,b\n1,2\n").unwrap();
    window.state_mut().push(Command::FilesChosen(Purpose::OpenStudy, vec![path]));
    settle(&mut window);
    assert!(says(&window, "notes.csv: line 1: the column study is missing: this is no table of a study"));
    assert!(window.state().study_work().table().is_none());
}

/// Stopped after some cases and begun again, it goes on after them; begun anew, from nothing.
#[test]
fn a_study_is_stopped_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let marked = project(folder.path(), &frontalis::face::generic(), true);
    let app = frontalis::gui::App::new(marked, None, frontalis::face::generic(), Box::new(Person::default()))
        .with_autosave_in(Some(folder.path().join("state")));
    let mut window = crate::stage::show(app, SIZE, true);
    keys(&mut window, Modifiers::COMMAND, Key::Num6);
    assert!(says(&window, "Start one, or open the table of an earlier one."));
    let until = |window: &mut Window, done: &dyn Fn(&Window) -> bool| {
        while !done(window) {
            window.step();
            std::thread::yield_now();
        }
    };
    let finished = |window: &Window| window.state().study_work().progress().map_or(0, |p| p.finished);
    window.get_by_role_and_label(egui::Role::Button, "Start").click();
    until(&mut window, &|w| finished(w) >= 4);
    assert!(says(&window, "cases") && window.state().study_work().is_running());
    // What the status bar tells of it moves no frame under the pointer.
    keys(&mut window, Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    assert!(window.query_by_role_and_label(egui::Role::Button, "Stop").is_some());
    let panes = |window: &Window| [0, 1].map(|k| window.state().view().frames.panes[k].rect);
    let told = panes(&window);
    window.state_mut().push(Command::Do(Action::StopStudy));
    until(&mut window, &|w| w.state().study_work().is_free());
    window.run_steps(2);
    assert!(window.query_by_role_and_label(egui::Role::Button, "Stop").is_none());
    assert_eq!(panes(&window), told);
    keys(&mut window, Modifiers::COMMAND, Key::Num6);
    let kept = window.state().study_work().stopped().unwrap().finished;
    assert!(kept >= 4 && says(&window, "Stopped at"));
    window.get_by_role_and_label(egui::Role::Button, "Go on").click();
    until(&mut window, &|w| finished(w) > 0);
    assert!(finished(&window) >= kept);
    window.state_mut().push(Command::Do(Action::StopStudy));
    until(&mut window, &|w| w.state().study_work().is_free());
    window.state_mut().push(Command::Do(Action::StartStudyAnew));
    window.run_steps(1);
    until(&mut window, &|w| w.state().study_work().progress().is_some());
    assert!(finished(&window) < kept);
    window.state_mut().push(Command::Do(Action::StopStudy));
    until(&mut window, &|w| w.state().study_work().is_free());
}

/// The maps of time step against stiffness, for the documents.
pub(crate) fn stability_maps(window: &mut Window) {
    window.state_mut().push(Command::FilesChosen(Purpose::OpenStudy, vec![stability()]));
    settle(window);
}

/// The choice on a table of the generic face, for the documents: some rungs of `frontalis study ladder`, 59 twins.
pub(crate) fn a_rung_for_an_accuracy(window: &mut Window) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/study/ladder.csv");
    window.state_mut().push(Command::FilesChosen(Purpose::OpenStudy, vec![path]));
    settle(window);
    window.state_mut().view_mut().study.goals.accuracy = Some(1.5);
    window.hover_at(egui::pos2(640.0, 4.0));
}

/// A method of the study of the camera's distance, picked: for the documents.
pub(crate) fn a_method_for_the_project(window: &mut Window) {
    stability_maps(window);
    window.get_by_label_contains("Distance of the camera").click();
    window.run_steps(3);
    press(window, "Frozen depth, distance 1000 mm");
    window.hover_at(egui::pos2(640.0, 4.0));
}

fn picture(name: &str, size: [f32; 2], dark: bool, table: fn(&Path) -> PathBuf, prepare: impl FnOnce(&mut Window)) {
    if !can_draw() {
        return;
    }
    let (mut window, _folder) = window(size, dark, table);
    prepare(&mut window);
    settle(&mut window);
    let options = SnapshotOptions::new().threshold(1.2).max_failed_pixels(60);
    window.try_snapshot_options(format!("panels/study_{name}"), &options).unwrap();
}

fn pick_the_slide(window: &mut Window) {
    press(window, "Slide on surface, level 2");
    window.hover_at(egui::pos2(640.0, 4.0));
    window.run_steps(2);
}

#[test]
fn accuracy_looks_as_it_did_in_dark() {
    picture("accuracy_dark", SIZE, true, accuracy, pick_the_slide);
}

#[test]
fn accuracy_looks_as_it_did_in_light() {
    picture("accuracy_light", SIZE, false, accuracy, |_| {});
}

fn ask_for_150_percent(window: &mut Window) {
    window.state_mut().view_mut().study.goals.accuracy = Some(1.5);
}

#[test]
fn the_choice_looks_as_it_did_in_dark() {
    picture("ladder_dark", SIZE, true, ladder, ask_for_150_percent);
}

#[test]
fn the_choice_looks_as_it_did_in_light() {
    picture("ladder_light", SIZE, false, ladder, |_| {});
}

#[test]
fn maps_look_as_they_did_in_dark() {
    picture("maps_dark", SIZE, true, |_| stability(), |_| {});
}

#[test]
fn maps_look_as_they_did_in_light() {
    picture(
        "maps_light",
        SIZE,
        false,
        |_| stability(),
        |w| {
            w.get_by_label_contains("How much steeper").click();
        },
    );
}

#[test]
fn on_a_large_screen_they_look_as_they_did() {
    picture(
        "large",
        [2560.0, 1440.0],
        true,
        |_| stability(),
        |w| {
            w.get_by_label_contains("Distance of the camera").click();
            w.run_steps(3);
            press(w, "Slide on surface, distance 300 mm");
            w.hover_at(egui::pos2(1280.0, 4.0));
        },
    );
}
