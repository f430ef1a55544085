//! The guide: a press marks the point asked for and no other, the list ends, and doubt speaks of the point just placed.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::gui::panels::frames::Tool;
use frontalis::gui::{Action, Command};
use frontalis::project::{Edit, MarkState, PointId, Project, Which, edit};

use crate::stage::{Person, Window, drag, key, keys, on_screen, open, project, seen};

const SIZE: [f32; 2] = [1280.0, 800.0];

/// A window with every landmark placed and no feature marked; the guide asks for the points of these regions.
fn guided(regions: &[&str]) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut project = project(folder.path(), &face, true);
    project.features.clear();
    let mut window = open(project, SIZE, true, Person::default());
    window.state_mut().view_mut().frames.regions = regions.iter().map(|r| (*r).to_owned()).collect();
    keys(&mut window, Modifiers::COMMAND, Key::M);
    (window, folder)
}

fn asked(window: &Window) -> u32 {
    match window.state().view().focus.selected {
        Some(PointId::FeatureLast(v)) => v,
        ref other => panic!("the guide asks for {other:?}"),
    }
}

fn mark_of(window: &Window, v: u32) -> Option<[f64; 2]> {
    edit::mark(window.state().project(), &PointId::FeatureLast(v)).map(|m| m.at_px)
}

fn predicted(window: &Window, v: u32) -> Pos2 {
    let p = window.state().outcome().last_in_image[v as usize];
    on_screen(window, Which::Last, [p.x, p.y])
}

fn in_image(window: &Window, at: Pos2) -> [f64; 2] {
    let pane = &window.state().view().frames.panes[1];
    pane.view.at(pane.rect).image_from_ui(at)
}

fn near(a: [f64; 2], b: [f64; 2], by: f64) -> bool {
    (a[0] - b[0]).abs() < by && (a[1] - b[1]).abs() < by
}

fn button(pos: Pos2, pressed: bool, modifiers: Modifiers) -> Event {
    Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers }
}

/// A click as fast as a hand makes it: pressed and released within one pass, with this motion between.
fn quick(window: &mut Window, at: Pos2, by: Vec2) {
    window.hover_at(at);
    window.step();
    let none = Modifiers::NONE;
    let events = [button(at, true, none), Event::PointerMoved(at + by), button(at + by, false, none)];
    window.input_mut().events.extend(events);
    window.run_steps(2);
}

fn ctrl_drag(window: &mut Window, from: Pos2, to: Pos2) {
    window.hover_at(from);
    window.step();
    window.event_modifiers(button(from, true, Modifiers::COMMAND), Modifiers::COMMAND);
    window.step();
    if to != from {
        window.event_modifiers(Event::PointerMoved(to), Modifiers::COMMAND);
        window.step();
    }
    window.event_modifiers(button(to, false, Modifiers::COMMAND), Modifiers::COMMAND);
    window.event_modifiers(Event::PointerMoved(to), Modifiers::NONE);
    window.run_steps(2);
}

#[test]
fn a_press_beside_the_prediction_marks_the_pressed_place() {
    let (mut window, _folder) = guided(&["forehead"]);
    let v = asked(&window);
    let at = predicted(&window, v) + Vec2::new(2.0, 1.0);
    let pressed = in_image(&window, at);
    quick(&mut window, at, Vec2::ZERO);
    let mark = mark_of(&window, v).unwrap();
    assert!(near(mark, pressed, 1e-6), "pressed {pressed:?}, marked {mark:?}");
}

#[test]
fn a_press_on_the_prediction_of_another_point_marks_the_one_asked_for() {
    let (mut window, _folder) = guided(&["forehead"]);
    let list = frontalis::face::generic().region("forehead").to_vec();
    for i in 0..12 {
        let v = asked(&window);
        assert_eq!(v, list[i], "no point is left out");
        let at = predicted(&window, list[i + 1]);
        let pressed = in_image(&window, at);
        quick(&mut window, at, Vec2::ZERO);
        assert!(near(mark_of(&window, v).unwrap(), pressed, 1e-6));
        assert_eq!(mark_of(&window, list[i + 1]), None, "the one that was predicted there stays unset");
    }
}

#[test]
fn a_press_on_a_mark_leaves_it_and_marks_the_point_asked_for() {
    let (mut window, _folder) = guided(&["forehead"]);
    let first = asked(&window);
    let at = predicted(&window, first);
    quick(&mut window, at, Vec2::ZERO);
    let (kept, second) = (mark_of(&window, first), asked(&window));
    quick(&mut window, at + Vec2::new(3.0, 0.0), Vec2::ZERO);
    assert_eq!(mark_of(&window, first), kept);
    assert!(mark_of(&window, second).is_some());
    assert_ne!(asked(&window), second);
}

#[test]
fn ctrl_takes_another_point_and_the_guide_asks_for_the_same_as_before() {
    let (mut window, _folder) = guided(&["forehead"]);
    let first = asked(&window);
    let at = predicted(&window, first);
    quick(&mut window, at, Vec2::ZERO);
    let (before, second) = (mark_of(&window, first).unwrap(), asked(&window));
    ctrl_drag(&mut window, at, at + Vec2::new(1.0, 6.0));
    let zoom = window.state().view().frames.panes[1].view.zoom;
    assert!(near(mark_of(&window, first).unwrap(), [before[0] + 1.0 / zoom, before[1] + 6.0 / zoom], 1e-3));
    assert_eq!(asked(&window), second);
    assert_eq!(mark_of(&window, second), None);
    window.get_by_label_contains("Ctrl+press takes another point");
}

#[test]
fn a_press_while_landmarks_are_placed_places_the_one_asked_for_whatever_lies_there() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, false), SIZE, true, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::L);
    let ids: Vec<String> = face.landmarks().iter().map(|l| l.id.clone()).collect();
    for (i, l) in face.landmarks().iter().enumerate().take(4) {
        let at = on_screen(&window, Which::First, seen(&face, l.vertex, false));
        quick(&mut window, at, Vec2::ZERO);
        assert_eq!(window.state().project().landmarks.len(), i + 1);
    }
    let (kept, at) = (window.state().project().landmarks.clone(), seen(&face, face.landmarks()[1].vertex, false));
    let place = on_screen(&window, Which::First, at);
    quick(&mut window, place, Vec2::ZERO);
    let now = &window.state().project().landmarks;
    assert!(near(now[&ids[4]].at_px, at, 0.6), "on another's mark");
    assert_eq!(now[&ids[1]], kept[&ids[1]]);
}

#[test]
fn a_click_that_shakes_moves_nothing_and_a_held_button_follows_from_the_first_pixel() {
    let (mut window, _folder) = guided(&["forehead"]);
    let v = asked(&window);
    let at = predicted(&window, v);
    let pressed = in_image(&window, at);
    quick(&mut window, at, Vec2::new(1.5, -1.0));
    assert!(near(mark_of(&window, v).unwrap(), pressed, 1e-6), "a shake of a click");
    // Each pass of the test lasts a quarter of a second: longer than a click.
    let zoom = window.state().view().frames.panes[1].view.zoom;
    let next = asked(&window);
    let at = predicted(&window, next);
    let pressed = in_image(&window, at);
    drag(&mut window, &[at, at + Vec2::new(1.0, 0.0)]);
    let mark = mark_of(&window, next).unwrap();
    assert!(near(mark, [pressed[0] + 1.0 / zoom, pressed[1]], 1e-6), "{pressed:?} {mark:?}");
    // The same on a mark that is taken again.
    key(&mut window, Key::S);
    let from = on_screen(&window, Which::Last, mark);
    drag(&mut window, &[from, from + Vec2::new(0.0, 1.0)]);
    let moved = mark_of(&window, next).unwrap();
    assert!(near(moved, [mark[0], mark[1] + 1.0 / zoom], 1e-6), "{mark:?} {moved:?}");
}

#[test]
fn the_guide_ends_says_how_many_were_skipped_and_never_asks_for_a_marked_point() {
    let (mut window, _folder) = guided(&["brows"]);
    let all = frontalis::face::generic().region("brows").to_vec();
    let mut skipped = Vec::new();
    for (i, &v) in all.iter().enumerate() {
        assert_eq!(asked(&window), v);
        if i % 5 == 2 {
            skipped.push(v);
            window.get_by_label("Skip").click();
            window.run_steps(3);
        } else {
            let at = predicted(&window, v);
            quick(&mut window, at, Vec2::ZERO);
        }
    }
    assert_eq!(window.state().view().focus.selected, None, "nothing is asked for");
    assert_eq!(window.query_all_by_label(&format!("The list is at its end: {} skipped.", skipped.len())).count(), 2);
    // A press now marks nothing, and says so.
    let before = window.state().project().clone();
    let at = predicted(&window, all[0]);
    quick(&mut window, at, Vec2::ZERO);
    assert_eq!(window.state().project(), &before);
    assert!(window.query_all_by_label_contains("asks for nothing").next().is_some());
    window.get_by_label("Mark them").click();
    window.run_steps(3);
    for &v in &skipped {
        assert_eq!(asked(&window), v);
        key(&mut window, Key::Enter);
    }
    assert!(all.iter().all(|v| mark_of(&window, *v).is_some()));
    assert_eq!(window.state().view().frames.tool, Tool::Select, "all is marked: the tool is put down");
}

#[test]
fn the_mode_is_told_by_button_guide_pane_and_status_and_a_second_click_keeps_it() {
    let (mut window, _folder) = guided(&["forehead"]);
    let on = |w: &Window, name: &str| {
        let mut found = w.get_all_by_role_and_label(egui::Role::Button, name);
        found.all(|n| n.accesskit_node().toggled() == Some(egui::accesskit::Toggled::True))
    };
    let mode = "Mark feature points";
    assert!(on(&window, mode) && !on(&window, "Select"));
    window.get_by_role_and_label(egui::Role::Button, mode).click();
    window.run_steps(3);
    assert!(on(&window, mode), "still on");
    assert_eq!(window.state().view().frames.tool, Tool::Features);
    let v = asked(&window);
    window.get_by_label_contains("Press the same spot of skin");
    assert!(window.query_all_by_label_contains(&format!("Last frame: press marks: point {v}")).next().is_some());
    key(&mut window, Key::S);
    assert!(on(&window, "Select") && !on(&window, mode));
    assert!(window.query_by_label_contains("Press the same spot of skin").is_none());
    assert!(window.query_by_label_contains("press marks:").is_none());
    let before = window.state().project().clone();
    quick(&mut window, Pos2::new(700.0, 120.0), Vec2::ZERO);
    assert_eq!(window.state().project(), &before);
    window.get_by_label("Nothing is being placed.");
}

#[test]
fn doubt_right_after_a_press_is_about_the_point_just_placed() {
    let (mut window, _folder) = guided(&["forehead"]);
    let first = asked(&window);
    let at = predicted(&window, first);
    quick(&mut window, at, Vec2::ZERO);
    let second = asked(&window);
    key(&mut window, Key::U);
    let state = |w: &Window, v: u32| w.state().project().features.get(&v).and_then(|f| f.last).map(|m| m.state);
    assert_eq!(state(&window, first), Some(MarkState::Uncertain));
    assert_eq!((state(&window, second), asked(&window)), (None, second), "and the guide goes on");
    assert!(window.query_all_by_label_contains("placed last, is uncertain").next().is_some());
    key(&mut window, Key::U);
    assert_eq!(state(&window, first), Some(MarkState::Marked));
    // Stepped back to a mark, it is about that one.
    let at = predicted(&window, second);
    quick(&mut window, at, Vec2::ZERO);
    key(&mut window, Key::Comma);
    key(&mut window, Key::Comma);
    assert_eq!(asked(&window), first);
    key(&mut window, Key::U);
    assert_eq!((state(&window, first), state(&window, second)), (Some(MarkState::Uncertain), Some(MarkState::Marked)));
}

#[test]
fn back_goes_to_the_point_placed_last_over_those_accepted_together() {
    let (mut window, _folder) = guided(&["forehead"]);
    let placed = asked(&window);
    let at = predicted(&window, placed);
    quick(&mut window, at, Vec2::ZERO);
    // The next two points get their marks at once, and the guide goes on after them.
    let next = asked(&window);
    let order = window.state().face().region("forehead").to_vec();
    let from = order.iter().position(|v| *v == next).unwrap();
    let accepted = order[from..from + 2].iter().map(|&v| {
        let at = window.state().outcome().last_in_image[v as usize];
        frontalis::project::edit::Accepted {
            vertex: v,
            at_px: [at.x, at.y],
            state: MarkState::Marked,
            role: frontalis::project::Role::Skin,
        }
    });
    let together = Edit::Accept(accepted.collect());
    window.state_mut().push(Command::Edit(together));
    window.run_steps(3);
    window.state_mut().push(Command::Do(Action::Next));
    window.run_steps(3);
    let waiting = asked(&window);
    assert_eq!(waiting, order[from + 2]);
    key(&mut window, Key::Comma);
    assert_eq!(asked(&window), placed);
    key(&mut window, Key::Period);
    assert_eq!(asked(&window), waiting, "forwards leads to the next without a mark");
    // Where a point was skipped, it is the one before.
    key(&mut window, Key::Period);
    key(&mut window, Key::Comma);
    assert_eq!(asked(&window), waiting);
}

#[test]
fn still_points_come_first() {
    let (window, _folder) = guided(&["still", "forehead_and_brows"]);
    assert_eq!(asked(&window), frontalis::face::generic().region("still")[0]);
}

#[test]
fn the_view_stays_until_the_point_asked_for_is_out_of_view() {
    let (mut window, _folder) = guided(&["forehead"]);
    let list = frontalis::face::generic().region("forehead").to_vec();
    let v = asked(&window);
    // Zoomed in so far that the point asked for lies ten ui points from the edge of the pane.
    let pane = window.state().view().frames.panes[1].rect;
    window.state_mut().view_mut().frames.zoom(Which::Last, 6.0, pane.center());
    let place = predicted(&window, list[1]);
    let to_edge = Pos2::new(pane.right() - 10.0, pane.center().y) - place;
    window.state_mut().view_mut().frames.pan(Which::Last, to_edge);
    window.run_steps(2);
    let before = window.state().view().frames.panes[1].view;
    let at = pane.center();
    quick(&mut window, at, Vec2::ZERO);
    assert!(mark_of(&window, v).is_some() && asked(&window) == list[1]);
    if pane.contains(predicted(&window, list[1])) {
        assert_eq!(window.state().view().frames.panes[1].view, before, "in view, near the edge");
    }
    window.state_mut().view_mut().frames.pan(Which::Last, Vec2::new(4000.0, 0.0));
    window.run_steps(2);
    window.state_mut().push(frontalis::gui::Command::JumpTo(PointId::FeatureLast(list[2])));
    window.run_steps(3);
    assert!(pane.contains(predicted(&window, list[2])), "out of view, it is fetched");
}

#[test]
fn an_empty_project_lights_up_nothing_under_the_pointer() {
    let mut window = open(Project::default(), SIZE, true, Person::default());
    let folder = tempfile::tempdir().unwrap();
    let with_frames = project(folder.path(), &frontalis::face::generic(), false);
    for (which, frame) in [(Which::First, with_frames.frames.first), (Which::Last, with_frames.frames.last)] {
        window.state_mut().push(frontalis::gui::Command::Edit(Edit::SetFrame(which, frame)));
    }
    crate::stage::settle(&mut window);
    for k in 0..12 {
        let at = on_screen(&window, Which::First, [200.0 + 6.0 * f64::from(k), 240.0]);
        window.hover_at(at);
        window.run_steps(2);
        assert_eq!(window.state().view().focus.hovered(), None);
    }
}

#[test]
fn the_buttons_of_the_guide_stay_under_the_pointer_whatever_is_said_above_or_below_them() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), SIZE, true, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::L);
    let place = |w: &Window| ["Back", "Skip"].map(|b| w.get_by_role_and_label(egui::Role::Button, b).rect());
    let mut before = None;
    for l in face.landmarks() {
        window.state_mut().push(frontalis::gui::Command::Select(Some(PointId::Landmark(l.id.clone()))));
        window.run_steps(2);
        assert_eq!(*before.get_or_insert(place(&window)), place(&window), "{}", l.name);
    }
}

#[test]
fn a_window_that_is_left_alone_draws_nothing() {
    let (mut window, _folder) = guided(&["still"]);
    // As in the window of the program: a test has no animations by itself.
    window.ctx.all_styles_mut(|style| style.animation_time = 0.1);
    crate::stage::settle(&mut window);
    let wait = |w: &Window| w.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
    assert!(wait(&window) < std::time::Duration::from_millis(100), "the point asked for pulses");
    // A step is a quarter of a second; suggestions are there, and all notices are gone.
    window.run_steps(80);
    crate::stage::settle(&mut window);
    assert_eq!(window.state().suggestion_status(), &frontalis::gui::suggesting::Status::There);
    assert_eq!(wait(&window), std::time::Duration::MAX);
    // The next point pulses again.
    key(&mut window, Key::Period);
    assert!(wait(&window) < std::time::Duration::from_millis(100));
}
