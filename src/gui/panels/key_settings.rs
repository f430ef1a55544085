//! The dialog in which keys are given to commands: press the new key; where another command has it, that is said before it is taken.

use egui::{Align, Button, Key, Layout, RichText, TextEdit};

use crate::gui::action::{self, Chord, HOLDS, TABLE};
use crate::gui::keys::{self, Bound, KeyMap};
use crate::gui::{Command, theme};

/// What is being done in the dialog.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeysView {
    /// Letters of the commands looked for.
    filter: String,
    /// What waits for a key: which command, and which of its keys is replaced (its number of keys for a further one).
    waiting: Option<(Bound, usize)>,
    /// Keys that another command has.
    conflict: Option<Conflict>,
}

/// Keys that another command has, until the person has said whose they are to be.
#[derive(Clone, Debug, PartialEq)]
struct Conflict {
    of: Bound,
    keys: Vec<Chord>,
    taken: Chord,
    user: Bound,
}

/// Height of the note above the list, ui points: two lines, so that the list does not move.
const NOTE: f32 = 58.0;

/// Shows the dialog; true when it is to be closed.
pub fn show(ui: &mut egui::Ui, view: &mut KeysView, commands: &mut Vec<Command>) -> bool {
    let keys = keys::of(ui.ctx());
    listen(ui, view, &keys, commands);
    ui.horizontal(|ui| {
        let label = ui.label("Find");
        let field = TextEdit::singleline(&mut view.filter).hint_text("a command or a key").desired_width(220.0);
        ui.add_enabled(view.waiting.is_none(), field).labelled_by(label.id);
    });
    ui.allocate_ui(egui::vec2(ui.available_width(), NOTE), |ui| {
        ui.set_min_height(NOTE);
        note(ui, view, commands);
    });
    let height = (ui.ctx().content_rect().height() - 300.0).max(120.0);
    egui::ScrollArea::vertical()
        .max_height(height)
        .min_scrolled_height(height)
        .auto_shrink([false, true])
        .show(ui, |ui| list(ui, view, &keys, commands));
    ui.add_space(6.0);
    let mut close = false;
    ui.horizontal(|ui| {
        close = ui.button("Close").clicked();
        if ui.add_enabled(keys.any_changed(), Button::new("Put every key back")).clicked() {
            *view = KeysView { filter: std::mem::take(&mut view.filter), ..KeysView::default() };
            commands.push(Command::ResetKeys);
        }
    });
    close
}

/// Whether the next key is for this dialog alone: Esc then ends the waiting and not the dialog.
pub fn waits_for_key(view: &KeysView) -> bool {
    view.waiting.is_some()
}

/// Takes the key that a command waits for.
fn listen(ui: &egui::Ui, view: &mut KeysView, keys: &KeyMap, commands: &mut Vec<Command>) {
    let Some((of, at)) = view.waiting else { return };
    // The key speaks to the dialog and to none of its buttons.
    if let Some(id) = ui.memory(egui::Memory::focused) {
        ui.memory_mut(|m| m.surrender_focus(id));
    }
    let Some(mut chord) = keys::just_pressed(ui.ctx()) else { return };
    ui.input_mut(|i| i.events.retain(|e| !matches!(e, egui::Event::Key { .. } | egui::Event::Text(_))));
    view.waiting = None;
    if chord.key == Key::Escape {
        return;
    }
    if matches!(of, Bound::Hold(_)) {
        chord.modifiers = egui::Modifiers::NONE;
    }
    let mut new = keys.keys(of).to_vec();
    new.retain(|k| *k != chord);
    let at = at.min(new.len());
    new.splice(at..(at + 1).min(new.len()), [chord]);
    give(view, keys, of, new, commands);
}

/// Gives keys to a command, unless another has one of them: then it is asked first.
fn give(view: &mut KeysView, keys: &KeyMap, of: Bound, new: Vec<Chord>, commands: &mut Vec<Command>) {
    let taken = new.iter().find_map(|k| keys.user(*k).filter(|user| *user != of).map(|user| (*k, user)));
    match taken {
        Some((taken, user)) => view.conflict = Some(Conflict { of, keys: new, taken, user }),
        None => commands.push(Command::BindKeys(of, new)),
    }
}

/// What is going on: a key is waited for, or belongs to another command.
fn note(ui: &mut egui::Ui, view: &mut KeysView, commands: &mut Vec<Command>) {
    if let Some(Conflict { of, keys, taken, user }) = view.conflict.clone() {
        let warn = theme::palette(ui.visuals()).warn;
        ui.colored_label(warn, format!("{} is the key of “{}”.", taken.text(), user.label()));
        ui.horizontal(|ui| {
            let take = ui.button(format!("Take it for “{}”", of.label())).clicked();
            if take {
                commands.push(Command::BindKeys(of, keys));
            }
            if take || ui.button("Leave it").clicked() {
                view.conflict = None;
            }
        });
    } else if let Some((of, _)) = view.waiting {
        ui.label(RichText::new(format!("Press the key for “{}”. Esc leaves it as it is.", of.label())).strong());
    } else {
        ui.label(
            RichText::new("Click a key to change it, + to add one. Esc, Ctrl+C, Ctrl+X and Ctrl+V stay as they are.")
                .weak(),
        );
    }
}

fn list(ui: &mut egui::Ui, view: &mut KeysView, keys: &KeyMap, commands: &mut Vec<Command>) {
    let typed = view.filter.trim().to_lowercase();
    let found = |of: Bound| {
        let mut texts = keys.keys(of).iter().map(|k| k.text().to_lowercase());
        typed.is_empty() || of.label().to_lowercase().contains(&typed) || texts.any(|t| t == typed)
    };
    let mut any = false;
    for menu in action::SHEET {
        let rows: Vec<Bound> =
            TABLE.iter().filter(|s| s.menu == menu).map(|s| Bound::Press(s.action)).filter(|of| found(*of)).collect();
        any |= section(ui, menu.title(), &rows, view, keys, commands);
    }
    let rows: Vec<Bound> = HOLDS.iter().map(|h| Bound::Hold(h.hold)).filter(|of| found(*of)).collect();
    any |= section(ui, "While held", &rows, view, keys, commands);
    if !any {
        ui.label(RichText::new("No command has such a name or key.").weak());
    }
}

fn section(
    ui: &mut egui::Ui,
    title: &str,
    rows: &[Bound],
    view: &mut KeysView,
    keys: &KeyMap,
    commands: &mut Vec<Command>,
) -> bool {
    if rows.is_empty() {
        return false;
    }
    ui.add_space(4.0);
    ui.label(RichText::new(title).strong());
    for &of in rows {
        ui.horizontal(|ui| row(ui, of, view, keys, commands));
    }
    true
}

/// A command with its keys, each a button; what names them to a screen reader tells the command, too.
fn row(ui: &mut egui::Ui, of: Bound, view: &mut KeysView, keys: &KeyMap, commands: &mut Vec<Command>) {
    let label = of.label();
    ui.allocate_ui_with_layout(egui::vec2(260.0, 20.0), Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(260.0);
        ui.add(egui::Label::new(label).truncate());
    });
    let own = keys.keys(of);
    for (i, chord) in own.iter().enumerate() {
        let waits = view.waiting == Some((of, i));
        let text = if waits { "press a key…".to_owned() } else { chord.text() };
        let button = ui.add(Button::selectable(waits, RichText::new(&text).monospace()).frame_when_inactive(true));
        button.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Change the key {text} of {label}"))
        });
        let button =
            button.on_hover_text("Click and press another key. A click with the right button takes the key away.");
        if button.clicked() {
            (view.waiting, view.conflict) = (Some((of, i)), None);
        }
        if button.secondary_clicked() {
            let left = own.iter().filter(|k| *k != chord).copied().collect();
            commands.push(Command::BindKeys(of, left));
        }
    }
    let waits = view.waiting == Some((of, own.len()));
    let add = ui.add(Button::selectable(waits, if waits { "press a key…" } else { "+" }));
    add.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Add a key to {label}")));
    if add.on_hover_text("Give it one more key.").clicked() {
        (view.waiting, view.conflict) = (Some((of, own.len())), None);
    }
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        ui.add_space(12.0);
        if keys.is_changed(of) {
            let back = ui.small_button("Put back");
            back.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Put back the keys of {label}"))
            });
            if back.on_hover_text("The keys that the program gives to it.").clicked() {
                view.waiting = None;
                give(view, keys, of, of.default_keys().to_vec(), commands);
            }
        }
    });
}
