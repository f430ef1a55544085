//! Marks that snap to crossings of the painted grid and are refined: always seen, one step each, and never against the hand.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use frontalis::camera::Scale;
use frontalis::frames::Frame;
use frontalis::gui::Command;
use frontalis::gui::panels::frames::Tool;
use frontalis::marking::Gray;
use frontalis::marking::tracking::Prepared;
use frontalis::project::{Edit, PointId, Project, Role, Which, edit, sample};
use frontalis::suggest;
use nalgebra::Point2;

use crate::stage::{Person, Window, drag, key, keys, on_screen, open, settle};

fn prepared(which: Which) -> Prepared {
    let files = sample::files();
    let (name, bytes) = files[1 + which as usize];
    let frame = Frame::decode(std::path::Path::new(name), bytes).unwrap();
    Prepared::of(Gray::of(frame.image()).unwrap())
}

/// The sample with the marks of its still points alone, in a window close to the forehead, with one point selected.
fn window(v: u32) -> Window {
    let mut project: Project = sample::project().unwrap();
    project.features.retain(|_, f| f.role == Role::Still);
    let mut window = open(project, [1280.0, 800.0], true, Person::default());
    let at = window.state().outcome().first_in_image[v as usize];
    for pane in &mut window.state_mut().view_mut().frames.panes {
        pane.view.fitted = false;
        (pane.view.zoom, pane.view.centre_in_image) = (4.0, [at.x, at.y]);
    }
    window.state_mut().push(Command::Select(Some(PointId::FeatureFirst(v))));
    settle(&mut window);
    window
}

/// The crossing of painted lines nearest to a vertex of the sample in the first frame.
pub(crate) fn crossing_near(v: u32) -> Point2<f64> {
    let face = frontalis::face::generic();
    let project = sample::project().unwrap();
    let outcome =
        frontalis::pipeline::solve(&project, &face, [1036, 1036], &mut frontalis::pipeline::Workspace::default());
    let first = prepared(Which::First);
    let own = outcome.first_in_image[v as usize];
    let about = |k: i32| own + nalgebra::Vector2::new(f64::from(k % 7 - 3), f64::from(k / 7 - 3)) * 5.0;
    let found = (0..49).filter_map(|k| suggest::snap(&first, &outcome, about(k)).ok()).map(|f| f.at);
    found.min_by(|a, b| (a - own).norm().total_cmp(&(b - own).norm())).unwrap()
}

/// A vertex of the forehead, and the crossing of painted lines nearest to it in the first frame.
fn vertex_and_crossing() -> (u32, Point2<f64>) {
    let face = frontalis::face::generic();
    let project = sample::project().unwrap();
    let outcome =
        frontalis::pipeline::solve(&project, &face, [1036, 1036], &mut frontalis::pipeline::Workspace::default());
    let first = prepared(Which::First);
    let near = |v: &u32| Some((*v, suggest::snap(&first, &outcome, outcome.first_in_image[*v as usize]).ok()?.at));
    face.region("forehead").iter().find_map(near).unwrap()
}

fn mark(window: &Window, id: &PointId) -> Option<Point2<f64>> {
    edit::mark(window.state().project(), id).map(|m| Point2::from(m.at_px))
}

fn near(a: Point2<f64>, b: Point2<f64>, by: f64) -> bool {
    (a - b).norm() < by
}

#[test]
fn a_mark_dropped_beside_a_crossing_goes_there_and_is_shown_to_have_gone() {
    let (v, crossing) = vertex_and_crossing();
    let mut window = window(v);
    let first = PointId::FeatureFirst(v);
    let from = on_screen(&window, Which::First, points_at(&window, v));
    let beside = [crossing.x + 2.0, crossing.y - 1.5];
    let to = on_screen(&window, Which::First, beside);
    drag(&mut window, &[from, from + (to - from) * 0.5, to]);
    assert!(near(mark(&window, &first).unwrap(), crossing, 0.05), "{:?} {crossing:?}", mark(&window, &first));
    assert_eq!(window.state().steps().len(), 1);
    window.get_by_label_contains("Snapped to the crossing, 2.5");
    let trace = window.state().view().frames.trace.clone().unwrap();
    assert!(near(Point2::from(trace.from), Point2::from(beside), 0.2), "where the hand was stays known");

    // Now that the point lies on the paint, it snaps to the crossing in the last frame, too.
    keys(&mut window, Modifiers::COMMAND, Key::M);
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(v))));
    settle(&mut window);
    settle(&mut window);
    let truth = window.state().suggestions().into_iter().find(|s| s.vertex == v).unwrap().at;
    window.state_mut().view_mut().frames.linked = false;
    window.state_mut().view_mut().frames.panes[1].view.centre_in_image = [truth.x, truth.y];
    window.run_steps(2);
    let press = on_screen(&window, Which::Last, [truth.x + 1.5, truth.y + 1.0]);
    drag(&mut window, &[press, press]);
    let last = mark(&window, &PointId::FeatureLast(v)).unwrap();
    let [a, b] = [Which::First, Which::Last].map(prepared);
    let refined = suggest::refine(&a, &b, window.state().outcome(), v, last).unwrap();
    assert_eq!(refined.kind, suggest::Refinement::Crossing);
    assert!(near(last, refined.at, 0.05) && near(last, truth, 1.0), "{last:?} {refined:?} {truth:?}");
    // One step back, and the mark is gone again.
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(mark(&window, &PointId::FeatureLast(v)), None);
}

fn points_at(window: &Window, v: u32) -> [f64; 2] {
    let p = window.state().outcome().first_in_image[v as usize];
    [p.x, p.y]
}

#[test]
fn alt_a_fine_drag_and_the_switch_leave_the_mark_to_the_hand() {
    let (v, crossing) = vertex_and_crossing();
    let id = PointId::FeatureFirst(v);
    for how in ["alt", "switch"] {
        let mut window = window(v);
        if how == "switch" {
            key(&mut window, Key::M);
        }
        let from = on_screen(&window, Which::First, points_at(&window, v));
        let beside = [crossing.x + 2.0, crossing.y - 1.5];
        let to = on_screen(&window, Which::First, beside);
        window.hover_at(from);
        window.step();
        window.drag_at(from);
        window.step();
        window.hover_at(from + (to - from) * 0.5);
        window.step();
        let modifiers = if how == "alt" { Modifiers::ALT } else { Modifiers::NONE };
        window.event_modifiers(egui::Event::PointerMoved(to), modifiers);
        window.step();
        let at = mark(&window, &id).unwrap();
        assert!(near(at, Point2::from(beside), 0.2), "{how}: {at:?}");
        assert!(window.state().view().frames.drag.as_ref().unwrap().snapped.is_none());
    }
}

#[test]
fn a_point_that_is_not_on_the_paint_is_left_where_the_hand_puts_it() {
    let (v, crossing) = vertex_and_crossing();
    let mut window = window(v);
    // Its place in the first frame is plain skin between the lines.
    let between = [crossing.x + 13.0, crossing.y + 13.0];
    window.state_mut().push(Command::Edit(Edit::Put(PointId::FeatureFirst(v), between)));
    keys(&mut window, Modifiers::COMMAND, Key::M);
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(v))));
    settle(&mut window);
    let outcome = window.state().outcome().clone();
    let last = prepared(Which::Last);
    let about =
        |k: i32| outcome.last_in_image[v as usize] + nalgebra::Vector2::new(f64::from(k % 5), f64::from(k / 5)) * 5.0;
    let crossing = (0..25).find_map(|k| suggest::snap(&last, &outcome, about(k)).ok()).unwrap().at;
    window.state_mut().view_mut().frames.linked = false;
    window.state_mut().view_mut().frames.panes[1].view.centre_in_image = [crossing.x, crossing.y];
    window.run_steps(2);
    let beside = [crossing.x + 1.0, crossing.y];
    let press = on_screen(&window, Which::Last, beside);
    drag(&mut window, &[press, press]);
    let at = mark(&window, &PointId::FeatureLast(v)).unwrap();
    assert!(near(at, Point2::from(beside), 0.2), "{at:?} {beside:?}");
}

#[test]
fn refine_finds_the_skin_again_in_one_step_and_says_how_far() {
    let truth = sample::project().unwrap();
    let [first, last] = [Which::First, Which::Last].map(prepared);
    let face = frontalis::face::generic();
    let outcome =
        frontalis::pipeline::solve(&truth, &face, [1036, 1036], &mut frontalis::pipeline::Workspace::default());
    let found = |v: &u32, at: Point2<f64>| suggest::refine(&first, &last, &outcome, *v, at).ok();
    let (v, to) = face
        .region("forehead")
        .iter()
        .find_map(|v| {
            let at = Point2::from(truth.features.get(v)?.last?.at_px);
            let f = found(v, at + nalgebra::Vector2::new(2.0, 1.0))?;
            near(f.at, at, 0.3).then_some((*v, at))
        })
        .unwrap();
    let mut window = window(v);
    let id = PointId::FeatureLast(v);
    let off = [to.x + 2.0, to.y + 1.0];
    window.state_mut().push(Command::Edit(Edit::Put(id.clone(), off)));
    window.state_mut().push(Command::Select(Some(id.clone())));
    settle(&mut window);
    key(&mut window, Key::E);
    let at = mark(&window, &id).unwrap();
    assert!(near(at, to, 0.6), "{at:?} {to:?}");
    window.get_by_label_contains("Refined to the");
    assert_eq!(window.state().steps().len(), 2);
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(mark(&window, &id), Some(Point2::from(off)));
    // A place where there is no such skin: the mark stays, and the reason is said.
    window.state_mut().push(Command::Edit(Edit::Put(id.clone(), [30.0, 30.0])));
    window.run_steps(3);
    key(&mut window, Key::E);
    assert_eq!(mark(&window, &id), Some(Point2::new(30.0, 30.0)));
    window.get_by_label_contains("stays where it is");
}

/// The pitch of the grid is measured between two crossings, so both presses snap; two places of known distance are anywhere, and do not.
#[test]
fn the_two_places_of_the_pitch_snap_and_those_of_a_distance_do_not() {
    let (v, a) = vertex_and_crossing();
    let (first, outcome) = (prepared(Which::First), window(v).state().outcome().clone());
    // The next upright line: 8 mm to the right.
    let cell = 8.0 * outcome.camera.px_per_mm;
    let b = suggest::snap(&first, &outcome, a + nalgebra::Vector2::new(cell, 0.0)).unwrap().at;
    assert!(((b - a).norm() / cell - 1.0).abs() < 0.1, "{a:?} {b:?}");
    let beside = [[a.x + 1.6, a.y - 1.2], [b.x - 1.3, b.y + 1.4]];
    for grid in [true, false] {
        let mut window = window(v);
        window.state_mut().view_mut().frames.tool = Tool::ScalePoints { grid, first: None };
        window.run_steps(2);
        for place in beside {
            let press = on_screen(&window, Which::First, place);
            drag(&mut window, &[press, press]);
        }
        match window.state().project().scale {
            Scale::GridPitch { a_px, b_px, cells, .. } if grid => {
                let [at_a, at_b] = [a_px, b_px].map(Point2::from);
                assert!(near(at_a, a, 0.05) && near(at_b, b, 0.05) && cells == 1.0, "{at_a:?} {a:?} {at_b:?} {b:?}");
            }
            Scale::TwoPoints { a_px, b_px, .. } if !grid => {
                let [at_a, at_b] = [a_px, b_px].map(Point2::from);
                assert!(near(at_a, beside[0].into(), 0.2) && near(at_b, beside[1].into(), 0.2), "{at_a:?} {at_b:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}
