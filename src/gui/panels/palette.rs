//! The palette of commands: type a few letters of any action's name, and run it.

use egui::{Align2, Key, RichText};

use crate::gui::action::{Spec, TABLE};
use crate::gui::action_state::ActionState;
use crate::gui::{Action, Command, keys};

/// The palette while it is open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PaletteView {
    typed: String,
    chosen: usize,
}

/// Shows the palette; false when it is to be closed.
pub fn show(ctx: &egui::Context, view: &mut PaletteView, state: &ActionState, commands: &mut Vec<Command>) -> bool {
    let mut open = true;
    let area = egui::Modal::default_area(egui::Id::unique("palette")).anchor(Align2::CENTER_TOP, [0.0, 80.0]);
    let shown = egui::Modal::new(egui::Id::unique("palette")).area(area).show(ctx, |ui| {
        ui.set_width(460.0);
        let (up, down, enter) = ui.input_mut(|i| {
            (
                i.consume_key(egui::Modifiers::NONE, Key::ArrowUp),
                i.consume_key(egui::Modifiers::NONE, Key::ArrowDown),
                i.key_pressed(Key::Enter),
            )
        });
        let edit = egui::TextEdit::singleline(&mut view.typed).hint_text("Find a command").desired_width(f32::INFINITY);
        let response = ui.add(edit);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Find a command"));
        response.request_focus();
        if response.changed() {
            view.chosen = 0;
        }
        let found = search(&view.typed);
        let last = found.len().saturating_sub(1);
        view.chosen = (view.chosen + usize::from(down)).saturating_sub(usize::from(up)).min(last);
        ui.add_space(4.0);
        egui::ScrollArea::vertical().max_height(340.0).auto_shrink([false, true]).show(ui, |ui| {
            for (i, spec) in found.iter().enumerate() {
                let run = entry(ui, spec, i == view.chosen, up || down, state);
                if (run || enter && i == view.chosen) && state.can(spec.action) {
                    commands.push(Command::Do(spec.action));
                    open = false;
                }
            }
            if found.is_empty() {
                ui.label(RichText::new("No command has such a name.").weak());
            }
        });
    });
    open && !shown.should_close()
}

fn entry(ui: &mut egui::Ui, spec: &Spec, chosen: bool, moved: bool, state: &ActionState) -> bool {
    let key = keys::of(ui.ctx()).text(spec.action).unwrap_or_default();
    let text = format!("{}  ›  {}", spec.menu.title(), spec.label);
    let button =
        egui::Button::selectable(chosen, text).shortcut_text(key).min_size(egui::vec2(ui.available_width(), 22.0));
    let response = ui.add_enabled(state.can(spec.action), button);
    if chosen && moved {
        response.scroll_to_me(None);
    }
    response.on_hover_text(spec.tooltip).clicked()
}

/// The rows whose name has the typed letters in their order; names that begin with them, or have them together, first.
fn search(typed: &str) -> Vec<&'static Spec> {
    let typed = typed.trim().to_lowercase();
    let mut found: Vec<(usize, &Spec)> = TABLE
        .iter()
        .filter(|s| s.action != Action::Palette)
        .filter_map(|spec| {
            let label = spec.label.to_lowercase();
            let rank = match label.find(&typed) {
                Some(0) => 0,
                Some(_) => 1,
                None if in_order(&typed, &label) => 2,
                None if spec.tooltip.to_lowercase().contains(&typed) => 3,
                None => return None,
            };
            Some((rank, spec))
        })
        .collect();
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, spec)| spec).collect()
}

fn in_order(letters: &str, text: &str) -> bool {
    let mut rest = text.chars();
    letters.chars().filter(|c| !c.is_whitespace()).all(|c| rest.any(|t| t == c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_letters_find_a_command() {
        assert_eq!(search("undo")[0].action, Action::Undo);
        assert_eq!(search("hist")[0].action, Action::ShowHistory);
        assert!(search("plm").iter().any(|s| s.action == Action::ToolLandmarks));
        assert!(search("xyzzy").is_empty());
    }
}
