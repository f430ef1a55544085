//! The tools above the face: files, where the eye stands, and what is drawn.

use egui::{ComboBox, Ui};

use super::{FaceView, VIEWS, look_from};
use crate::face::import::Keep;
use crate::gui::action_state::ActionState;
use crate::gui::orbit_view::OrbitView;
use crate::gui::panels::frames::toolbar::switch;
use crate::gui::{Action, Command};

/// How much of a mesh is kept.
const KEEP: [(Keep, &str, &str); 3] = [
    (Keep::Everything, "whole mesh", "Everything that is in the file"),
    (Keep::LargestPiece, "largest surface", "Without eyeballs, teeth and helper shapes"),
    (Keep::Face, "face alone", "The front of the head, cut out of a head or a body"),
];

/// Shows the row; it wraps where the window is narrow.
pub(super) fn show(ui: &mut Ui, view: &mut FaceView, state: &ActionState, commands: &mut Vec<Command>) {
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        for (action, label) in [
            (Action::OpenMesh, "Open mesh…"),
            (Action::OpenFace, "Open face…"),
            (Action::TransferFace, "Transfer"),
            (Action::SaveFace, "Save"),
            (Action::UseFace, "Use in project"),
        ] {
            switch(ui, action, label, state, commands);
        }
        let chosen = KEEP.iter().find(|k| k.0 == view.keep).map_or("", |k| k.1);
        let shown = ComboBox::from_id_salt("keep").width(112.0).selected_text(chosen).show_ui(ui, |ui| {
            for (keep, words, hint) in KEEP {
                ui.selectable_value(&mut view.keep, keep, words).on_hover_text(hint);
            }
        });
        shown.response.on_hover_text("How much of the next mesh that is opened is kept");
        ui.separator();
        standard_views(ui, &mut view.orbit);
        switch(ui, Action::Fit, "Fit", state, commands);
        ui.separator();
        ui.toggle_value(&mut view.surface, "Surface").on_hover_text("Hide or show the shaded surface");
        switch(ui, Action::ShowWireframe, "Wireframe", state, commands);
        switch(ui, Action::HideMarks, "Marks", state, commands);
        ui.toggle_value(&mut view.muscles, "Fibres").on_hover_text("Hide or show the muscles");
        switch(ui, Action::ShowNames, "Names", state, commands);
    });
    ui.add_space(3.0);
}

/// A button for every standard view of a face.
pub(in crate::gui::panels) fn standard_views(ui: &mut Ui, orbit: &mut OrbitView) {
    for (standard, words, hint) in VIEWS {
        let there = look_from(standard);
        let on = (orbit.azimuth - there.azimuth).abs() + (orbit.elevation - there.elevation).abs() < 1e-9;
        if ui.selectable_label(on, words).on_hover_text(hint).clicked() {
            *orbit = there;
        }
    }
}
