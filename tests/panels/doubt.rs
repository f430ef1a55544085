//! Doubt: points worth marking, marks that stand out, second marks made blind, another annotator, and the ring about a point in the hand.

use egui::{Key, Vec2};
use egui_kittest::kittest::Queryable as _;
use frontalis::doubt::hand_error;
use frontalis::gui::panels::frames::SideTab;
use frontalis::gui::{Action, Command};
use frontalis::project::{Edit, PointId, Project, Which, file};

use crate::stage::{Person, Window, drag, key, on_screen, open, project, seen, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

fn window(change: impl FnOnce(&mut Project), person: Person) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path(), &frontalis::face::generic(), true);
    change(&mut project);
    (open(project, SIZE, true, person), folder)
}

fn does(window: &mut Window, action: Action) {
    window.state_mut().push(Command::Do(action));
    window.run_steps(4);
}

fn says(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

#[test]
fn the_point_worth_most_is_an_unmarked_one_and_a_key_goes_there() {
    let face = frontalis::face::generic();
    let open: Vec<u32> = face.region("forehead_and_brows")[10..14].to_vec();
    let (mut window, _folder) = window(
        |p| {
            for v in &open {
                p.features.get_mut(v).unwrap().last = None;
            }
        },
        Person::default(),
    );
    key(&mut window, Key::D);
    assert_eq!(window.state().view().frames.side, SideTab::Doubt);
    assert!(says(&window, "a pixel"), "newton a pixel are shown");
    key(&mut window, Key::J);
    let Some(PointId::FeatureLast(v)) = window.state().view().focus.selected.clone() else {
        panic!("nothing selected")
    };
    assert!(open.contains(&v), "{v} is not one of {open:?}");
}

#[test]
fn a_mark_that_slipped_stands_out_and_a_click_goes_to_it() {
    let face = frontalis::face::generic();
    let v = face.region("forehead")[20];
    let at = seen(&face, v, true);
    let (mut window, _folder) =
        window(|p| Edit::Put(PointId::FeatureLast(v), [at[0] + 9.0, at[1] + 6.0]).apply(p).unwrap(), Person::default());
    key(&mut window, Key::D);
    assert!(says(&window, "from its neighbours"), "the list names it");
    window.get_all_by_label(&v.to_string()).last().unwrap().click();
    window.run_steps(3);
    assert_eq!(window.state().view().focus.selected, Some(PointId::FeatureLast(v)));
}

/// The hand presses 1 px to the right of the first mark each time: σ² = Σ 1² / 4n = 1/4, so 0.5 px, less what a press on a point of the
/// screen misses. No mark moves, and the marks of the last frame cannot be seen meanwhile.
#[test]
fn points_are_marked_again_blind_and_tell_the_hands_own_error() {
    let (mut window, _folder) = window(|_| {}, Person::default());
    let before = window.state().project().features.clone();
    does(&mut window, Action::Again);
    let points = window.state().view().frames.doubt.again.clone().unwrap().points;
    assert_eq!(points.len(), 8);
    assert!(window.query_all_by_label_contains("last frame, marked").next().is_none(), "nothing shows where they are");
    assert!(window.query_by_label("Sort by Last x px").is_none(), "not even the table");
    // A press that went wrong is undone, and its point asked for again.
    let wrong = on_screen(&window, Which::Last, [100.0, 100.0]);
    drag(&mut window, &[wrong, wrong]);
    assert_eq!(window.state().view().frames.doubt.asked(), Some(points[1]));
    crate::stage::keys(&mut window, egui::Modifiers::COMMAND, Key::Z);
    for v in points {
        assert_eq!(window.state().view().frames.doubt.asked(), Some(v));
        let at = before[&v].last.unwrap().at_px;
        let place = on_screen(&window, Which::Last, [at[0] + 1.0, at[1]]);
        drag(&mut window, &[place, place]);
        let again = window.state().project().repeats[&v];
        assert!((again[0] - at[0] - 1.0).abs() < 0.6 && (again[1] - at[1]).abs() < 0.6, "{again:?} {at:?}");
    }
    assert_eq!(window.state().project().features, before, "no mark has moved");
    assert_eq!(window.state().project().repeats.len(), 8, "the one that was undone was asked for again");
    assert!(window.state().view().frames.doubt.again.is_none());
    let hand = hand_error(window.state().project()).unwrap();
    assert!((hand.sigma_px - 0.5).abs() < 0.2, "{hand:?}");
    assert!(window.query_all_by_label_contains("last frame, marked").next().is_some(), "and marks are seen again");
    window.get_by_label("Use as marking error").click();
    window.run_steps(3);
    let used = window.state().project().settings.marking_sigma_px;
    assert!((used - hand.sigma_px).abs() < 0.006, "{used}");
    assert!(says(&window, "In use as marking error"));
}

#[test]
fn another_annotator_is_compared_point_by_point_and_other_pictures_are_refused() {
    let person = Person::default();
    let (mut window, folder) = window(|_| {}, person.clone());
    let mut other = window.state().project().clone();
    let v = frontalis::face::generic().region("forehead")[5];
    let at = other.features[&v].last.unwrap().at_px;
    Edit::Put(PointId::FeatureLast(v), [at[0] + 3.0, at[1] - 4.0]).apply(&mut other).unwrap();
    let path = folder.path().join("other.frontalis.json");
    file::save(&other, &path).unwrap();
    person.will_choose(&[&path]);
    does(&mut window, Action::Compare);
    settle(&mut window);
    assert!(says(&window, "other.frontalis.json") && says(&window, "5.0 px apart"));
    does(&mut window, Action::Compare);
    assert!(!says(&window, "px apart"), "the same command stops it");

    // Another project is open: the one compared with, and what was being marked again, belong to the one before.
    person.will_choose(&[&path]);
    does(&mut window, Action::Compare);
    settle(&mut window);
    does(&mut window, Action::Again);
    assert!(window.state().view().frames.doubt.other.is_some() && window.state().view().frames.doubt.again.is_some());
    window.state_mut().push(Command::Proceed(frontalis::gui::command::After::Open(path.clone())));
    settle(&mut window);
    assert!(window.state().view().frames.doubt.other.is_none() && window.state().view().frames.doubt.again.is_none());

    other.frames.last = other.frames.first.clone();
    file::save(&other, &path).unwrap();
    person.will_choose(&[&path]);
    does(&mut window, Action::Compare);
    settle(&mut window);
    assert!(says(&window, "not the same picture"));
}

/// A point is dragged away from its neighbours: its gap grows with it, and forces are named.
#[test]
fn the_ring_follows_while_a_point_is_dragged() {
    let (mut window, _folder) = window(|_| {}, Person::default());
    let id = PointId::FeatureLast(frontalis::face::generic().region("forehead")[20]);
    let PointId::FeatureLast(v) = id else { unreachable!() };
    let at = on_screen(&window, Which::Last, window.state().project().features[&v].last.unwrap().at_px);
    let gap = |window: &Window| window.state().gap(&id).unwrap();
    let before = gap(&window);
    window.hover_at(at);
    window.step();
    window.drag_at(at);
    window.step();
    let mut last = before.px;
    for k in 1..=3 {
        window.hover_at(at + Vec2::new(8.0 * k as f32, 0.0));
        window.run_steps(2);
        let now = gap(&window);
        assert!(now.px > last + 2.0 && now.newton > 0.0, "{now:?}");
        last = now.px;
    }
    assert!(gap(&window).stands_out());
    window.drop_at(at + Vec2::new(24.0, 0.0));
    window.run_steps(2);
}

/// The table tells how far a mark lies from where its neighbours lead, and brings the worst to the top.
#[test]
fn the_table_sorts_feature_points_by_how_far_they_stand_off_their_neighbours() {
    let v = frontalis::face::generic().region("forehead")[20];
    let at = seen(&frontalis::face::generic(), v, true);
    let (mut window, _folder) =
        window(|p| Edit::Put(PointId::FeatureLast(v), [at[0] + 9.0, at[1] + 6.0]).apply(p).unwrap(), Person::default());
    window.get_by_label("Feature points").click();
    window.run_steps(2);
    window.get_by_label("Sort by Residual px").click();
    window.run_steps(3);
    let rows: Vec<_> = window.get_all_by_role(egui::accesskit::Role::ListBoxOption).collect();
    let top = rows.iter().min_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).unwrap();
    assert!(
        egui_kittest::kittest::NodeT::accesskit_node(top).label().unwrap().contains(&v.to_string()),
        "{v} is not first"
    );
}
