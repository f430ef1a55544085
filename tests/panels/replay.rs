//! The simulated last frame over the real one: switched on, worked out in the background, looked at.

use egui_kittest::kittest::{NodeT as _, Queryable as _};
use egui_kittest::{SnapshotOptions, SnapshotResults};
use frontalis::gui::Command;
use frontalis::project::{Edit, PointId};

use crate::pictures::can_draw;
use crate::stage::{Person, Window, on_screen, open, project, settle};

/// The words of the card that begin so.
fn line(window: &Window, begin: &str) -> Option<String> {
    let node = window.query_all_by_label_contains(begin).next()?;
    node.accesskit_node().label().or_else(|| node.accesskit_node().value())
}

fn window(dark: bool) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path(), &frontalis::face::generic(), true);
    let mut window = open(project, [1280.0, 800.0], dark, Person::default());
    settle(&mut window);
    window.get_by_label("Simulated").click();
    window.run_steps(2);
    settle(&mut window);
    settle(&mut window);
    (window, folder)
}

#[test]
fn the_distances_of_all_points_are_told_and_follow_the_marks() {
    let (mut window, _folder) = window(true);
    assert!(line(&window, "Simulated against seen").is_some());
    let muscles = line(&window, "root mean square: ").unwrap();
    assert!(line(&window, "of their motion").unwrap().contains("points"));
    window.get_by_label("Measured forces").click();
    window.run_steps(3);
    let forces = line(&window, "root mean square: ").unwrap();
    assert_ne!(muscles, forces, "other forces, other places");

    // A mark goes 20 px aside: it lies farthest from any simulation of skin.
    let face = frontalis::face::generic();
    let v = face.region("forehead")[0];
    let at = crate::stage::seen(&face, v, true);
    window.state_mut().push(Command::Edit(Edit::Put(PointId::FeatureLast(v), [at[0] + 20.0, at[1]])));
    settle(&mut window);
    settle(&mut window);
    let after = line(&window, "root mean square: ").unwrap();
    assert_ne!(forces, after, "another mark, other distances");

    window.get_by_label("Simulated").click();
    window.run_steps(3);
    assert!(line(&window, "Simulated against seen").is_none());
}

#[test]
fn without_marks_there_is_nothing_to_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path(), &frontalis::face::generic(), false);
    let mut window = open(project, [1280.0, 800.0], true, Person::default());
    settle(&mut window);
    assert!(window.get_by_label("Simulated").accesskit_node().is_disabled());
}

#[test]
fn it_looks_as_it_did() {
    if !can_draw() {
        return;
    }
    let mut results = SnapshotResults::new();
    for dark in [true, false] {
        let (mut window, _folder) = window(dark);
        let face = frontalis::face::generic();
        let v = face.region("brows")[3];
        let at = crate::stage::seen(&face, v, true);
        let place = on_screen(&window, frontalis::project::Which::Last, at);
        window.hover_at(place);
        window.run_steps(4);
        let theme = if dark { "dark" } else { "light" };
        let options = SnapshotOptions::new().threshold(1.2).max_failed_pixels(40);
        results.add(window.try_snapshot_options(format!("panels/simulated_{theme}"), &options));
    }
}
