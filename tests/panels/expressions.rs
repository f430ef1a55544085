//! The moving face: expressions, sliders, transport, a failure and the way out of it, files, and pictures in both themes.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::{SnapshotOptions, SnapshotResults};
use frontalis::expression::player::Pace;
use frontalis::expression::{Basic, Expression, Holding, Refined, Setup, Shown};
use frontalis::gui::action::Action;
use frontalis::gui::dialogs::Purpose;
use frontalis::gui::export_expression::Choice;
use frontalis::gui::expression_work::{Base, Ready};
use frontalis::gui::panels::expressions::{Curve, Paint};
use frontalis::gui::{App, Command, Workspace};
use frontalis::project::{PointId, Project};
use frontalis::simulate::Method;

use crate::pictures::can_draw;
use crate::stage::{Person, Window, keys, open, project, settle, show};

const SIZE: [f32; 2] = [1280.0, 800.0];

/// The workspace, with a face that is ready.
fn window(dark: bool, change: impl FnOnce(&mut Project)) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path(), &frontalis::face::generic(), true);
    change(&mut project);
    let mut window = open(project, SIZE, dark, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::Num4);
    assert_eq!(window.state().view().workspace, Workspace::Expressions);
    settle(&mut window);
    (window, folder)
}

fn ready(window: &Window) -> &Ready {
    window.state().expression_work().ready().unwrap()
}

fn act(window: &mut Window, action: Action) {
    window.state_mut().push(Command::Do(action));
    window.run_steps(2);
}

fn moved(window: &Window, vertex: usize) -> f64 {
    let ready = ready(window);
    (ready.positions[vertex] - ready.rest[vertex]).norm()
}

fn says(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

/// Goes to the equilibrium, beside the window where a step is slow.
fn settle_play(window: &mut Window) {
    act(window, Action::Settle);
    for _ in 0..2000 {
        if window.state().expression_work().settled().is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
        window.step();
    }
    window.run_steps(2);
}

/// Lets it play until so much time has passed in the face.
fn play_until(window: &mut Window, time_s: f64) {
    for _ in 0..2000 {
        if ready(window).time_s >= time_s || ready(window).failure.is_some() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
        window.step();
    }
    panic!("only {} s of {time_s} s were played", ready(window).time_s);
}

#[test]
fn a_preset_plays_and_reset_puts_everything_back() {
    let (mut window, _folder) = window(true, |_| {});
    window.get_by_label("Surprise").click();
    window.step();
    assert!(window.state().expression_work().is_playing());
    play_until(&mut window, 1.0);
    let brow = frontalis::face::generic().muscles()[0].insertion as usize;
    assert!(moved(&window, brow) > 1.0, "{}", moved(&window, brow));
    keys(&mut window, Modifiers::NONE, Key::F5);
    assert!(!window.state().expression_work().is_playing());
    keys(&mut window, Modifiers::NONE, Key::F8);
    window.run_steps(2);
    assert_eq!((moved(&window, brow), ready(&window).time_s), (0.0, 0.0));
    keys(&mut window, Modifiers::NONE, Key::F6);
    let one = window.state().view().expressions.pace.step_s;
    play_until(&mut window, 0.5 * one);
    assert!((ready(&window).time_s - one).abs() < 1e-9, "one step");
}

#[test]
fn keys_choose_expressions_and_settle_goes_there_at_once() {
    let (mut window, _folder) = window(true, |_| {});
    keys(&mut window, Modifiers::ALT, Key::Num2);
    assert_eq!(window.state().view().expressions.basic, Some(Basic::Happy));
    settle_play(&mut window);
    assert!(says(&window, "Settled: converged"));
    let corner = frontalis::face::generic().landmark("mouth_corner_left").unwrap().vertex as usize;
    let at_100 = moved(&window, corner);
    assert!(at_100 > 2.0, "{at_100}");
    window.state_mut().view_mut().expressions.intensity = 0.3;
    keys(&mut window, Modifiers::NONE, Key::F7);
    for _ in 0..2000 {
        if moved(&window, corner) < at_100 {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
        window.step();
    }
    panic!("a third of the intensity moves the corner as far");
}

#[test]
fn a_slider_moves_both_sides_unless_they_are_parted() {
    let (mut window, _folder) = window(true, |_| {});
    let names = |window: &Window| window.query_all_by_role(egui::accesskit::Role::Slider).count();
    let linked = names(&window);
    window.get_by_label("Both sides").click();
    window.run_steps(2);
    let parted = names(&window);
    let all = ready(&window).actuators.all.len();
    assert!(parted > linked && parted >= all, "{linked} {parted} {all}");
}

#[test]
fn a_failure_stops_says_where_and_reset_leads_out() {
    let (mut window, _folder) = window(true, |_| {});
    let view = &mut window.state_mut().view_mut().expressions;
    view.setup = Setup { stiffness: 100.0, ..Setup::default() };
    view.pace = Pace { method: Method::ExplicitEuler, step_s: 0.033, ramp_s: 0.0 };
    view.step_chosen = true;
    settle(&mut window);
    act(&mut window, Action::Preset(Basic::Fear));
    for _ in 0..3000 {
        window.step();
        if ready(&window).failure.is_some() {
            break;
        }
    }
    window.run_steps(2);
    assert!(ready(&window).failure.is_some() && !window.state().expression_work().is_playing());
    assert!(says(&window, "The play has stopped.") && says(&window, "Explicit Euler failed at step"));
    let view = &mut window.state_mut().view_mut().expressions;
    (view.pace, view.step_chosen) = (Pace::default(), false);
    act(&mut window, Action::ResetPlay);
    assert!(ready(&window).failure.is_none() && !says(&window, "The play has stopped."));
}

/// Once refined the generic face has 2,354 vertices.
#[test]
fn a_fine_face_takes_longer_steps_until_one_is_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let generic = frontalis::face::generic();
    let fine = std::sync::Arc::new(Refined::new(&generic, 1).unwrap().face);
    let of_generic = project(folder.path(), &generic, true);
    let mut window = show(App::new(of_generic, None, fine, Box::new(Person::default())), SIZE, true);
    keys(&mut window, Modifiers::COMMAND, Key::Num4);
    settle(&mut window);
    assert_eq!(ready(&window).rest.len(), 2354);
    let step_s = |window: &Window| window.state().view().expressions.pace.step_s;
    assert_eq!(step_s(&window), 0.033);
    window.state_mut().view_mut().expressions.base = Base::Generic;
    settle(&mut window);
    assert_eq!(step_s(&window), 1.0 / 60.0);
    window.get_by_role_and_label(egui::accesskit::Role::Slider, "Step").focus();
    window.run_steps(2);
    keys(&mut window, Modifiers::NONE, Key::ArrowLeft);
    let chosen = step_s(&window);
    assert!((1e-4..=0.033).contains(&chosen) && chosen != 1.0 / 60.0, "{chosen}");
    window.state_mut().view_mut().expressions.base = Base::Project;
    settle(&mut window);
    assert_eq!((ready(&window).rest.len(), step_s(&window)), (2354, chosen));
}

#[test]
fn a_click_on_the_face_picks_a_vertex_for_the_curves() {
    let (mut window, _folder) = window(true, |_| {});
    let view = &window.state().view().expressions;
    let projection = view.projection().unwrap();
    let nose = frontalis::face::generic().landmark("nose_tip").unwrap().vertex;
    let at = ready(&window).drawing.place(&projection, nose as usize).0;
    window.hover_at(at);
    window.step();
    window.drag_at(at);
    window.step();
    window.drop_at(at);
    window.run_steps(3);
    assert_eq!(window.state().view().focus.selected, Some(PointId::FeatureLast(nose)));
    assert!(says(&window, &format!("vertex {nose}")));
    act(&mut window, Action::Preset(Basic::Surprise));
    play_until(&mut window, 0.3);
    let picked = ready(&window).samples.last().unwrap().picked.unwrap();
    assert_eq!(picked.vertex, nose);
}

#[test]
fn an_expression_is_saved_opened_and_exported() {
    let (mut window, folder) = window(true, |_| {});
    act(&mut window, Action::Preset(Basic::Anger));
    window.state_mut().view_mut().expressions.intensity = 0.5;
    let file = folder.path().join("cross.expression.json");
    window
        .state_mut()
        .push(Command::FilesChosen(Purpose::SaveExpression { suggested: String::new() }, vec![file.clone()]));
    window.run_steps(2);
    let saved = Expression::load(&file).unwrap();
    assert_eq!(saved.name, "cross");
    act(&mut window, Action::ClearExpression);
    assert!(window.state().view().expressions.expression.activations.is_empty());
    window.state_mut().push(Command::FilesChosen(Purpose::OpenExpression, vec![file]));
    window.run_steps(2);
    assert_eq!(window.state().view().expressions.expression, saved);
    window.state_mut().view_mut().expressions.export =
        Choice { obj: true, gif: false, seconds: 0.2, per_second: 10, ..Choice::default() };
    window.state_mut().push(Command::FilesChosen(Purpose::PlayFolder, vec![folder.path().to_owned()]));
    settle(&mut window);
    assert!(folder.path().join("cross/mesh_0002.obj").is_file());
    assert!(folder.path().join("cross/positions.csv").is_file());
}

#[test]
fn activations_come_from_the_fit() {
    let (mut window, _folder) = window(true, |_| {});
    act(&mut window, Action::FromFit);
    settle(&mut window);
    window.run_steps(3);
    let expression = &window.state().view().expressions.expression;
    assert_eq!(expression.name, "From the fit");
    assert!(expression.activation("frontalis_medial_left") > 0.0, "{expression:?}");
}

#[test]
fn the_project_s_face_and_the_generic_one_can_be_moved_and_the_skin_is_held_as_chosen() {
    let (mut window, _folder) = window(true, |_| {});
    assert!(window.state().expression_work().texture().is_some(), "the first frame is on the skin");
    window.state_mut().view_mut().expressions.base = Base::Generic;
    window.state_mut().view_mut().expressions.setup.holding = Holding::Anchors;
    settle(&mut window);
    assert_eq!(*ready(&window).rest, frontalis::face::generic().mesh().positions());
    assert_eq!(ready(&window).setup.holding, Holding::Anchors);
}

/// What is looked at: its name and what is done before looking.
fn picture(name: &str, prepare: impl Fn(&mut Window)) {
    if !can_draw() {
        return;
    }
    let mut results = SnapshotResults::new();
    for dark in [true, false] {
        let (mut window, _folder) = window(dark, |_| {});
        prepare(&mut window);
        window.run_steps(3);
        let name = format!("panels/{name}_{}", if dark { "dark" } else { "light" });
        results.add(window.try_snapshot_options(name, &SnapshotOptions::default().threshold(0.8)));
    }
}

/// At rest in time, so that no clock is in the picture.
fn settled(window: &mut Window, basic: Basic) {
    // In one frame, so that not a step is taken whose number would hang on the machine.
    window.state_mut().push(Command::Do(Action::Preset(basic)));
    window.state_mut().push(Command::Do(Action::PlayPause));
    settle_play(window);
}

#[test]
fn a_picture_of_the_first_frame_on_the_skin() {
    picture("expressions", |w| settled(w, Basic::Surprise));
}

#[test]
fn a_picture_of_values_with_wireframe_and_a_picked_vertex() {
    picture("expressions_values", |w| {
        let brow = frontalis::face::generic().muscles()[0].insertion;
        w.state_mut().push(Command::Select(Some(PointId::FeatureLast(brow))));
        let view = &mut w.state_mut().view_mut().expressions;
        view.paint = Paint::Value(Shown::Displacement);
        view.wireframe = true;
        view.curve = Curve::Force;
        view.base = Base::Generic;
        settle(w);
        settled(w, Basic::Happy);
    });
}
