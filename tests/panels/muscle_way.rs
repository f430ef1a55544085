//! The field of muscles: the measured one at once, and theirs as soon as they are fitted.

use egui::Vec2;
use egui_kittest::kittest::Queryable;
use frontalis::forces::SkinModel;
use frontalis::gui::Command;
use frontalis::gui::panels::frames::SideTab;
use frontalis::muscle::LawKind;
use frontalis::pipeline::{self, Outcome};
use frontalis::project::{Edit, FieldWay, MuscleWay, PointId, Settings, Which};

use crate::stage::{Person, Window, hold, on_screen, open, project, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];
/// A marked project of a membrane, and how muscles are asked of it.
fn window(size: [f32; 2], person: Person) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path(), &frontalis::face::generic(), true);
    project.settings.skin_model = SkinModel::Membrane;
    let mut window = open(project, size, true, person);
    window.state_mut().view_mut().frames.side = SideTab::Settings;
    (window, folder)
}

fn ask(window: &mut Window, way: MuscleWay) {
    let settings = Settings { field: FieldWay::Muscles(way), ..window.state().project().settings.clone() };
    window.state_mut().push(Command::Edit(Edit::SetSettings(settings)));
    window.step();
}

/// All laws, which takes longer than is waited for.
fn slow() -> MuscleWay {
    MuscleWay::default()
}

fn one_law() -> MuscleWay {
    MuscleWay { law: Some(LawKind::Anatomical), ..MuscleWay::default() }
}

/// What the chain makes of the project without a window.
fn solved(window: &Window) -> Outcome {
    let (project, face) = (window.state().project(), frontalis::face::generic());
    let size = project.frames.first.as_ref().map(|f| [f.width_px, f.height_px]).unwrap();
    pipeline::solve(project, &face, size, &mut pipeline::Workspace::default())
}

fn fits(window: &Window) -> Vec<u64> {
    let jobs = window.state().jobs().running().iter();
    jobs.filter(|j| j.name == "Fitting the muscles").map(|j| j.id).collect()
}

fn forehead() -> u32 {
    frontalis::face::generic().region("forehead")[0]
}

/// Under the hand the field is the measured one, and the muscles' again when it lets go.
#[test]
fn muscles_wait_for_the_hand_to_let_go() {
    let (mut window, _folder) = window(SIZE, Person::default());
    ask(&mut window, one_law());
    settle(&mut window);
    let v = forehead();
    let at = on_screen(&window, Which::Last, window.state().project().features[&v].last.as_ref().unwrap().at_px);
    let before = window.state().outcome().field.force[v as usize];
    assert!(window.state().outcome().muscles.is_some());
    hold(&mut window, at, Vec2::new(15.0, 0.0));
    window.run_steps(3);
    let dragged = window.state().outcome();
    assert!(dragged.muscles.is_none() && dragged.field.force[v as usize] != before);
    assert!(fits(&window).is_empty());
    assert!(window.query_by_label_contains("The muscles are still to come").is_some());
    window.drop_at(at + Vec2::new(15.0, 0.0));
    settle(&mut window);
    assert_eq!(*window.state().outcome(), solved(&window));
    assert_ne!(window.state().outcome().field.force[v as usize], before);
}

/// The window goes on while muscles are fitted; what was asked for in the meantime is what comes.
#[test]
fn muscles_are_fitted_beside_the_window_and_only_the_last_question_is_answered() {
    let (mut window, _folder) = window(SIZE, Person::default());
    let measured = window.state().outcome().field.force.clone();
    ask(&mut window, slow());
    window.step();
    let first = fits(&window);
    assert_eq!(first.len(), 1);
    assert!(window.state().outcome().muscles.is_none());
    assert!(
        window.query_by_label_contains("The muscles are still to come: until then the field is the measured").is_some()
    );
    // A mark goes its way meanwhile.
    let v = forehead();
    let id = PointId::FeatureLast(v);
    let [x, y] = window.state().project().features[&v].last.as_ref().unwrap().at_px;
    window.state_mut().push(Command::Edit(Edit::Put(id, [x + 9.0, y])));
    window.run_steps(2);
    assert_ne!(window.state().outcome().field.force[v as usize], measured[v as usize]);
    assert!(fits(&window).iter().all(|id| *id != first[0]), "of the marks before, the fit is given up");
    settle(&mut window);
    assert_eq!(*window.state().outcome(), solved(&window));
    assert!(window.query_by_label_contains("muscles move the points").is_some());
}

#[test]
fn a_fit_that_is_stopped_leaves_the_measured_field_and_says_so() {
    let (mut window, _folder) = window(SIZE, Person::default());
    ask(&mut window, slow());
    let job = fits(&window)[0];
    window.state_mut().push(Command::CancelJob(job));
    settle(&mut window);
    let outcome = window.state().outcome();
    assert!(outcome.muscles.is_none());
    let said: Vec<String> = outcome.warnings.iter().map(ToString::to_string).collect();
    assert!(said.contains(&"The field is the measured one, not that of muscles: the fit was stopped.".to_owned()));
    assert!(window.query_by_label_contains("No muscles are found").is_some());
    // What changes asks anew.
    ask(&mut window, one_law());
    settle(&mut window);
    assert!(window.state().outcome().muscles.is_some());
}

/// Results asked for while the fit is on its way are those of the project, not what the window shows until then.
#[test]
fn results_that_are_exported_during_a_fit_are_the_muscles() {
    let person = Person::default();
    let out = tempfile::tempdir().unwrap();
    person.will_choose(&[out.path()]);
    let (mut window, _folder) = window(SIZE, person);
    ask(&mut window, slow());
    assert_eq!(fits(&window).len(), 1);
    assert!(window.state().outcome().muscles.is_none(), "still on its way");
    window.state_mut().push(Command::Do(frontalis::gui::action::Action::Export));
    window.step();
    settle(&mut window);
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.path().join("report.json")).unwrap()).unwrap();
    assert!(report["muscles"]["besides"].is_object(), "{report}");
}

#[test]
fn the_muscles_can_be_taken_alone_and_the_panel_says_what_they_leave() {
    // Tall enough for all settings at once.
    let (mut window, _folder) = window([SIZE[0], 2.0 * SIZE[1]], Person::default());
    ask(&mut window, one_law());
    settle(&mut window);
    assert!(window.query_by_label_contains("Pulls besides theirs are").is_some());
    window.get_by_label("Nothing: the muscles alone").click();
    settle(&mut window);
    let expected = FieldWay::Muscles(MuscleWay { alone: true, ..one_law() });
    assert_eq!(window.state().project().settings.field, expected);
    assert!(window.query_by_label_contains("Pulls besides theirs are").is_none());
    assert!(window.state().outcome().muscles.as_ref().is_some_and(|m| m.besides.is_none()));
    // The law's shape is asked for by the same rules, and said with its intervals.
    window.get_by_label("Found with the muscles").click();
    settle(&mut window);
    let shaped = FieldWay::Muscles(MuscleWay { alone: true, shape: true, ..one_law() });
    assert_eq!(window.state().project().settings.field, shaped);
    assert!(window.query_by_label_contains("Its shape: steepness along the fibre").is_some());
    assert!(window.state().outcome().muscles.as_ref().is_some_and(|m| m.shape.len() == 4));
}
