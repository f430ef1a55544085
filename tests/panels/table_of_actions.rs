//! Every action of the table can be found in a menu, in the palette and on the key sheet.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use frontalis::gui::action::{HOLDS, Menu, POINTER, TABLE};
use frontalis::gui::{Action, Command};

use crate::stage::{Person, key, keys, open, project};

#[test]
fn every_action_stands_in_a_menu() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), [1280.0, 1000.0], false, Person::default());
    for menu in Menu::BAR {
        window.get_by_role_and_label(egui::Role::Button, menu.title()).click();
        window.run_steps(4);
        if menu == Menu::Point {
            window.get_by_label_contains(Menu::Nudge.title()).hover();
            window.run_steps(4);
            window.get_by_label_contains(Menu::Nudge.title()).click();
            window.run_steps(4);
        }
        let shown = |m: Menu| m == menu || menu == Menu::Point && m == Menu::Nudge;
        for spec in TABLE.iter().filter(|s| shown(s.menu)) {
            let found = window.query_all_by_label_contains(spec.label).count();
            assert!(found > 0, "{} is not in the menu {}", spec.label, menu.title());
        }
        key(&mut window, Key::Escape);
        window.hover_at(egui::pos2(640.0, 600.0));
        window.run_steps(4);
    }
}

#[test]
fn the_palette_runs_a_command() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, true), [1280.0, 800.0], true, Person::default());
    let names = window.state().view().frames.show_names;
    keys(&mut window, Modifiers::COMMAND, Key::P);
    window.get_by_label("Find a command").type_text("names");
    window.run_steps(3);
    key(&mut window, Key::Enter);
    assert_ne!(window.state().view().frames.show_names, names);
    assert!(window.state().view().palette.is_none());
}

#[test]
fn f1_shows_every_key() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut window = open(project(folder.path(), &face, false), [1280.0, 1200.0], true, Person::default());
    key(&mut window, Key::F1);
    for spec in TABLE.iter().filter(|s| !s.keys.is_empty()) {
        assert!(window.query_all_by_label_contains(spec.label).count() > 0, "{} is not on the sheet", spec.label);
    }
    for what in POINTER.iter().map(|p| p.1).chain(HOLDS.iter().map(|h| h.tooltip)) {
        window.get_by_label(what);
    }
    key(&mut window, Key::Escape);
    assert!(window.state().view().modal.is_none());
}

#[test]
fn what_cannot_be_done_is_not_done() {
    let mut window = open(frontalis::project::Project::default(), [1280.0, 800.0], true, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    key(&mut window, Key::Delete);
    key(&mut window, Key::ArrowLeft);
    window.state_mut().push(Command::Do(Action::Accept));
    window.run_steps(3);
    assert_eq!(window.state().project(), &frontalis::project::Project::default());
    assert!(window.state().steps().is_empty());
}
