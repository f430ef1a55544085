//! The key sheet: every key, in two columns.

use egui::RichText;

use crate::gui::action::{Action, HOLDS, POINTER, TABLE};
use crate::gui::keys::{self, Bound};
use crate::gui::{Command, action};

/// Shows the sheet; true when it is to be closed.
pub fn show(ui: &mut egui::Ui, commands: &mut Vec<Command>) -> bool {
    let keys = keys::of(ui.ctx());
    let texts = |of: Bound| keys.keys(of).iter().take(2).map(|k| k.text()).collect::<Vec<_>>().join("  ");
    egui::ScrollArea::vertical().max_height(ui.ctx().content_rect().height() - 180.0).show(ui, |ui| {
        ui.columns(2, |columns| {
            for (i, menu) in action::SHEET.into_iter().enumerate() {
                let ui = &mut columns[usize::from(i > 4)];
                ui.label(RichText::new(menu.title()).strong());
                for spec in TABLE.iter().filter(|s| s.menu == menu) {
                    let texts = texts(Bound::Press(spec.action));
                    if !texts.is_empty() {
                        line(ui, &texts, spec.label);
                    }
                }
                ui.add_space(8.0);
            }
            let ui = &mut columns[1];
            ui.label(RichText::new("On a frame").strong());
            for hold in HOLDS {
                line(ui, &format!("Hold {}", texts(Bound::Hold(hold.hold))), hold.tooltip);
            }
            for (key, what) in POINTER {
                line(ui, key, what);
            }
        });
    });
    ui.add_space(6.0);
    let mut close = false;
    ui.horizontal(|ui| {
        close = ui.button("Close").clicked();
        if ui.button(Action::SetKeys.label()).clicked() {
            commands.push(Command::Do(Action::SetKeys));
        }
    });
    close
}

fn line(ui: &mut egui::Ui, key: &str, what: &str) {
    ui.spacing_mut().item_spacing.y = 1.0;
    ui.spacing_mut().interact_size.y = 16.0;
    ui.horizontal(|ui| {
        ui.allocate_ui_with_layout(egui::vec2(150.0, 16.0), egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_width(150.0);
            ui.label(RichText::new(key).monospace().size(11.0));
        });
        ui.add(egui::Label::new(what).wrap());
    });
}
