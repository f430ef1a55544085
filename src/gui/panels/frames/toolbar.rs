//! The tools above the frames: what a click does, and how the frames are shown.

use egui::{Button, DragValue, Slider};

use super::wireframe::COLOURS;
use super::{FramesView, Tool};
use crate::gui::action_state::ActionState;
use crate::gui::{Action, Command, keys};
use crate::project::Which;

/// Shows the tools in one row.
pub fn show(ui: &mut egui::Ui, view: &mut FramesView, state: &ActionState, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        for (action, label) in
            [(Action::ToolSelect, "Select"), (Action::ToolLandmarks, "Landmarks"), (Action::ToolFeatures, "Features")]
        {
            switch(ui, action, label, state, commands);
        }
        switch(ui, Action::Snap, "Snap", state, commands);
        ui.separator();
        for (action, label) in [(Action::Fit, "Fit"), (Action::LinkPanes, "Link"), (Action::Blink, "Swap")] {
            switch(ui, action, label, state, commands);
        }
        ui.separator();
        for (action, label) in
            [(Action::HideMarks, "Marks"), (Action::ShowNames, "Names"), (Action::ShowWireframe, "Wireframe")]
        {
            switch(ui, action, label, state, commands);
        }
        wireframe_menu(ui, view, state, commands);
        switch(ui, Action::ShowReplay, "Simulated", state, commands);
        ui.separator();
        picture_menu(ui, view, state, commands);
        loupe_menu(ui, view, state, commands);
        if let Tool::ScalePoints { first, .. } = view.tool {
            let text = if first.is_none() { "Click the first place of the scale" } else { "Click the second place" };
            ui.colored_label(ui.visuals().warn_fg_color, text);
        }
    });
}

/// A button for an action of the table.
pub fn switch(ui: &mut egui::Ui, action: Action, label: &str, state: &ActionState, commands: &mut Vec<Command>) {
    let tooltip = keys::of(ui.ctx()).tooltip(action);
    let button = match state.on(action) {
        Some(on) => Button::selectable(on, label),
        None => Button::new(label).frame_when_inactive(false),
    };
    if ui.add_enabled(state.can(action), button).on_hover_text(tooltip).clicked() {
        commands.push(Command::Do(action));
    }
}

fn wireframe_menu(ui: &mut egui::Ui, view: &mut FramesView, state: &ActionState, commands: &mut Vec<Command>) {
    stay_open_menu(ui, "Style", "How the wireframe is drawn.", |ui| {
        let style = &mut view.wireframe;
        let mut percent = style.opacity * 100.0;
        if ui.add(Slider::new(&mut percent, 5.0..=100.0).text("Opacity").suffix(" %").fixed_decimals(0)).changed() {
            style.opacity = percent / 100.0;
        }
        ui.horizontal(|ui| {
            ui.label("Colour");
            for (i, (name, ..)) in COLOURS.iter().enumerate() {
                ui.selectable_value(&mut style.colour, i, *name);
            }
        });
        switch(ui, Action::RegionOnly, Action::RegionOnly.label(), state, commands);
    });
}

fn picture_menu(ui: &mut egui::Ui, view: &mut FramesView, state: &ActionState, commands: &mut Vec<Command>) {
    stay_open_menu(
        ui,
        "Picture",
        "Brightness, contrast and local contrast of each frame. Results do not change.",
        |ui| {
            for which in [Which::First, Which::Last] {
                ui.strong(if which == Which::First { "First frame" } else { "Last frame" });
                let a = &mut view.panes[which as usize].adjustment;
                ui.push_id(which.word(), |ui| {
                    ui.add(Slider::new(&mut a.brightness, -0.5..=0.5).text("Brightness").fixed_decimals(2));
                    ui.add(Slider::new(&mut a.contrast, 0.2..=3.0).text("Contrast").fixed_decimals(2));
                    ui.add(Slider::new(&mut a.gamma, 0.4..=2.5).text("Gamma").fixed_decimals(2));
                    let mut on = a.clahe.is_some();
                    if ui.checkbox(&mut on, "Local contrast (CLAHE)").changed() {
                        a.clahe = on.then_some(CLAHE_DEFAULT);
                    }
                    if let Some(limit) = &mut a.clahe {
                        ui.add(Slider::new(limit, 1.0..=8.0).text("Limit").fixed_decimals(1));
                    }
                });
                ui.add_space(4.0);
            }
            switch(ui, Action::ResetAdjustment, Action::ResetAdjustment.label(), state, commands);
        },
    );
}

/// Clip limit that shows the grain of skin without its noise.
pub const CLAHE_DEFAULT: f64 = 2.5;

fn loupe_menu(ui: &mut egui::Ui, view: &mut FramesView, state: &ActionState, commands: &mut Vec<Command>) {
    stay_open_menu(ui, "Loupe", "How far the loupe enlarges, and when it is shown.", |ui| {
        ui.horizontal(|ui| {
            let label = ui.label("Screen pixels a pixel");
            ui.add(DragValue::new(&mut view.loupe.scale).range(4.0..=16.0).speed(0.1).fixed_decimals(0))
                .labelled_by(label.id);
            for scale in [4.0, 8.0, 16.0] {
                ui.selectable_value(&mut view.loupe.scale, scale, format!("{scale}×"));
            }
        });
        switch(ui, Action::LoupeAlways, Action::LoupeAlways.label(), state, commands);
    });
}

/// A menu of sliders and switches, which stays open while they are used.
fn stay_open_menu(ui: &mut egui::Ui, title: &str, tooltip: &str, contents: impl FnOnce(&mut egui::Ui)) {
    use egui::containers::menu::{MenuButton, MenuConfig};
    let config = MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    let button = Button::new(title.to_owned()).frame_when_inactive(false);
    let (response, _) = MenuButton::from_button(button).config(config).ui(ui, |ui| {
        ui.set_min_width(240.0);
        contents(ui);
    });
    response.on_hover_text(tooltip);
}
