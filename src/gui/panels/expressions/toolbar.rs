//! The row above the face: which face, what is on its skin, where the eye stands, and what is exported.

use egui::{ComboBox, Ui};

use super::{ExpressionsView, Paint};
use crate::expression::Shown;
use crate::gui::action_state::ActionState;
use crate::gui::expression_work::{Base, ExpressionWork};
use crate::gui::panels::face::toolbar::standard_views;
use crate::gui::panels::frames::toolbar::switch;
use crate::gui::panels::name_combo;
use crate::gui::{Action, Command};

/// Shows the row; it wraps where the window is narrow.
pub(super) fn show(
    ui: &mut Ui,
    work: &ExpressionWork,
    on_frame: bool,
    view: &mut ExpressionsView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        let label = |base| match base {
            Base::Project => "The project's face",
            Base::Generic => "The generic face",
        };
        let shown = label(view.base);
        let combo = ComboBox::from_id_salt("base").width(128.0).selected_text(shown).show_ui(ui, |ui| {
            for (base, hint) in [
                (Base::Project, "The face as it is fitted to the first frame"),
                (Base::Generic, "The embedded face, as it is"),
            ] {
                ui.selectable_value(&mut view.base, base, label(base)).on_hover_text(hint);
            }
        });
        name_combo(&combo.response, "Face", shown);
        ui.separator();
        let textured = on_frame && work.texture().is_some();
        let hint = "The first frame on the skin. What the camera did not see of it is drawn out of what it saw beside";
        let button = egui::Button::selectable(view.paint == Paint::Texture && textured, "First frame");
        let response = ui.add_enabled(textured, button).on_hover_text(hint);
        if response.on_disabled_hover_text("This face has no first frame").clicked() {
            view.paint = Paint::Texture;
        }
        let plain = view.paint == Paint::Plain || (view.paint == Paint::Texture && !textured);
        if ui.selectable_label(plain, "Plain").on_hover_text("Clay, under one light").clicked() {
            view.paint = Paint::Plain;
        }
        for (shown, hint) in [
            (Shown::Displacement, "How far the skin has moved from rest, mm"),
            (Shown::Strain, "Mean strain of the edges at each vertex, %: red is drawn out, blue is pressed"),
            (Shown::Force, "Length of the muscles' pull on each vertex, N"),
        ] {
            if ui.selectable_label(view.paint == Paint::Value(shown), shown.label()).on_hover_text(hint).clicked() {
                view.paint = Paint::Value(shown);
            }
        }
        switch(ui, Action::ShowWireframe, "Wireframe", state, commands);
        ui.separator();
        standard_views(ui, &mut view.orbit);
        switch(ui, Action::Fit, "Fit", state, commands);
        ui.separator();
        export(ui, view, state, commands);
        if work.is_preparing() {
            ui.spinner();
        }
    });
    ui.add_space(3.0);
}

fn export(ui: &mut Ui, view: &mut ExpressionsView, state: &ActionState, commands: &mut Vec<Command>) {
    let config =
        egui::containers::menu::MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    let button = egui::containers::menu::MenuButton::new("Export…").config(config);
    let (response, _) = button.ui(ui, |ui| {
        ui.set_min_width(240.0);
        let choice = &mut view.export;
        ui.checkbox(&mut choice.gif, "Moving picture (GIF)");
        ui.checkbox(&mut choice.mp4, "Film (MP4)");
        ui.checkbox(&mut choice.png, "Numbered pictures (PNG)");
        ui.checkbox(&mut choice.obj, "Meshes (OBJ)");
        ui.checkbox(&mut choice.csv, "Tables (CSV)");
        ui.separator();
        ui.add(egui::Slider::new(&mut choice.seconds, 0.2..=10.0).suffix(" s").fixed_decimals(1).text("long"));
        ui.add(egui::Slider::new(&mut choice.per_second, 5..=50).text("pictures a second"));
        ui.checkbox(&mut choice.there_and_back, "And back to rest")
            .on_hover_text("In the second half the muscles let go: a moving picture that can be repeated");
        ui.weak("Played anew from rest, with the colours and the direction shown.");
        ui.separator();
        switch(ui, Action::ExportExpression, "Choose a folder…", state, commands);
    });
    response.on_hover_text("Write the play as pictures, meshes or tables");
}
