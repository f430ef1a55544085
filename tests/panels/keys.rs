//! Keys that the person has changed: taken with a warning, shown everywhere, kept, and put back.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use frontalis::gui::keys::{self, Bound, Hold};
use frontalis::gui::{Action, App, Command};

use crate::stage::{Person, Window, key, keys as press, open, project, show};

fn window(state: &std::path::Path, folder: &std::path::Path) -> Window {
    let face = frontalis::face::generic();
    let app = App::new(project(folder, &face, true), None, face, Box::new(Person::default()));
    show(app.with_autosave_in(Some(state.to_owned())), [1280.0, 800.0], true)
}

fn text(window: &Window, action: Action) -> Option<String> {
    keys::of(&window.ctx).text(action)
}

fn ask_for_key(window: &mut Window, name: &str) {
    // Wherever the list is scrolled to.
    window.get_by_label(name).click_accesskit();
    window.run_steps(2);
}

#[test]
fn a_key_is_changed_in_the_dialog_and_holds_everywhere_and_at_the_next_start() {
    let [state, folder] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    let mut w = window(state.path(), folder.path());
    w.state_mut().push(Command::Do(Action::SetKeys));
    w.run_steps(3);
    w.get_by_label("Find").focus();
    w.run_steps(2);
    w.get_by_label("Find").type_text("names");
    w.run_steps(3);
    assert!(w.query_by_label("Add a key to Undo").is_none());
    ask_for_key(&mut w, "Change the key N of Names");
    press(&mut w, Modifiers::COMMAND, Key::J);
    assert_eq!(text(&w, Action::ShowNames).as_deref(), Some("Ctrl+J"));
    key(&mut w, Key::Escape);
    assert!(w.state().view().modal.is_none());
    // The old key does nothing, the new one acts.
    key(&mut w, Key::N);
    assert!(!w.state().view().frames.show_names);
    press(&mut w, Modifiers::COMMAND, Key::J);
    assert!(w.state().view().frames.show_names);
    // The sheet shows it.
    key(&mut w, Key::F1);
    w.get_by_label("Ctrl+J");
    drop(w);
    let w = window(state.path(), folder.path());
    assert_eq!(text(&w, Action::ShowNames).as_deref(), Some("Ctrl+J"));
    assert!(w.state().project().measured_count() > 0);
}

#[test]
fn a_key_that_another_command_has_is_asked_about_before_it_is_taken() {
    let [state, folder] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    let mut w = window(state.path(), folder.path());
    w.state_mut().push(Command::Do(Action::SetKeys));
    w.run_steps(3);
    for take in [false, true] {
        ask_for_key(&mut w, "Add a key to Names");
        w.get_by_label_contains("Press the key for “Names”");
        press(&mut w, Modifiers::COMMAND, Key::Z);
        w.get_by_label("Ctrl+Z is the key of “Undo”.");
        assert_eq!(text(&w, Action::Undo).as_deref(), Some("Ctrl+Z"), "nothing is taken unasked");
        w.get_by_label(if take { "Take it for “Names”" } else { "Leave it" }).click();
        w.run_steps(3);
        assert_eq!(text(&w, Action::Undo).is_none(), take);
    }
    assert_eq!(keys::of(&w.ctx).keys(Bound::Press(Action::ShowNames)).len(), 2);
    // Putting Undo's key back asks, too, and then Names has lost it.
    w.get_by_label("Put back the keys of Undo").click_accesskit();
    w.run_steps(2);
    w.get_by_label("Take it for “Undo”").click();
    w.run_steps(3);
    assert_eq!(text(&w, Action::Undo).as_deref(), Some("Ctrl+Z"));
    assert!(!keys::of(&w.ctx).any_changed(), "everything is as in the program again");
}

#[test]
fn esc_ends_the_waiting_and_not_the_dialog_and_every_key_can_be_put_back() {
    let [state, folder] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    let mut w = window(state.path(), folder.path());
    w.state_mut().push(Command::BindKeys(Bound::Press(Action::Undo), Vec::new()));
    w.state_mut().push(Command::Do(Action::SetKeys));
    w.run_steps(3);
    ask_for_key(&mut w, "Add a key to Undo");
    key(&mut w, Key::Escape);
    assert!(w.state().view().modal.is_some() && text(&w, Action::Undo).is_none());
    w.get_by_label("Put every key back").click();
    w.run_steps(3);
    assert_eq!(text(&w, Action::Undo).as_deref(), Some("Ctrl+Z"));
    key(&mut w, Key::Escape);
    assert!(w.state().view().modal.is_none());
}

#[test]
fn what_is_held_can_have_another_key_too() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let mut w = open(project(folder.path(), &face, true), [1280.0, 800.0], true, Person::default());
    let j = keys::just_pressed(&w.ctx);
    assert!(j.is_none());
    let chord = frontalis::gui::action::Chord::parse("J").unwrap();
    w.state_mut().push(Command::BindKeys(Bound::Hold(Hold::Blink), vec![chord]));
    w.run_steps(2);
    let left = |w: &Window| w.get_by_label("First frame").rect().left();
    let before = left(&w);
    for (k, blinks) in [(Key::B, false), (Key::J, true)] {
        w.key_down(k);
        w.run_steps(2);
        assert_eq!(left(&w) > before + 100.0, blinks, "{k:?}");
        w.key_up(k);
        w.run_steps(2);
    }
}
