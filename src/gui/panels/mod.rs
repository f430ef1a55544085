//! The panels. Each reads the scene and its own view, and pushes commands.

pub mod expressions;
pub mod face;
pub mod film_strip;
pub mod forces;
pub mod frames;
pub mod history;
pub mod key_settings;
pub mod key_sheet;
pub mod menu;
pub mod modals;
pub mod muscles;
pub mod palette;
pub mod results;
pub mod settings;
pub mod skin_table;
pub mod status;
pub mod study;

/// Shows contents in the width there is: what is wider is cut off instead of widening the panel, beside which panes would move.
fn in_fixed_width(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    let place = ui.available_rect_before_wrap();
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(place));
    contents(&mut child);
    let size = egui::vec2(place.width(), child.min_rect().height());
    ui.advance_cursor_after_rect(egui::Rect::from_min_size(place.min, size));
}

/// Gives a combo box a name for screen readers and tests beside its value.
fn name_combo(response: &egui::Response, name: &str, value: &str) {
    response.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(egui::Role::ComboBox, true, name);
        info.current_text_value = Some(value.to_owned());
        info
    });
}
