//! What is chosen beside the single muscles: one of the six expressions, the intensity, files; and what the face is built with.

use egui::{Button, ComboBox, Grid, Slider, Ui, WidgetInfo, vec2};

use super::ExpressionsView;
use crate::draw::words::capital;
use crate::expression::stage::STIFFNESS;
use crate::expression::{Basic, Holding};
use crate::gui::action_state::ActionState;
use crate::gui::expression_work::Ready;
use crate::gui::panels::frames::toolbar::switch;
use crate::gui::panels::name_combo;
use crate::gui::{Action, Command, keys};
use crate::muscle::LawKind;
use crate::simulate::Method;

/// The six, the intensity, and where expressions come from and go.
pub(super) fn show(ui: &mut Ui, view: &mut ExpressionsView, state: &ActionState, commands: &mut Vec<Command>) {
    ui.add_space(6.0);
    let gap = ui.spacing().item_spacing.x;
    let width = ((ui.available_width() - 2.0 * gap) / 3.0 - 1.0).floor();
    for row in Basic::ALL.chunks(3) {
        ui.horizontal(|ui| {
            for &basic in row {
                let action = Action::Preset(basic);
                let button = Button::selectable(view.basic == Some(basic), basic.name()).frame_when_inactive(true);
                let hint = keys::of(ui.ctx()).tooltip(action);
                if ui.add_sized(vec2(width, 26.0), button).on_hover_text(hint).clicked() {
                    commands.push(Command::Do(action));
                }
            }
        });
    }
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        ui.label("Intensity");
        percent(ui, &mut view.intensity, "Intensity", 150.0);
    });
    ui.horizontal_wrapped(|ui| {
        for (action, label) in [
            (Action::FromFit, "From the fit"),
            (Action::OpenExpression, "Open…"),
            (Action::SaveExpression, "Save…"),
            (Action::ClearExpression, "Clear"),
        ] {
            switch(ui, action, label, state, commands);
        }
        if view.wants_fit {
            ui.spinner();
        }
    });
    ui.separator();
}

/// A slider that shows so many decimals and keeps all: one that rounds would change what it only shows.
pub(super) fn exact(slider: Slider<'_>, decimals: usize) -> Slider<'_> {
    slider.custom_formatter(move |value, _| format!("{value:.decimals$}"))
}

/// A slider from 0 to 200 %; whether it was moved.
pub(super) fn percent(ui: &mut Ui, value: &mut f64, name: &str, width: f32) -> bool {
    ui.spacing_mut().slider_width = width;
    let mut shown = 100.0 * *value;
    let slider = exact(Slider::new(&mut shown, 0.0..=200.0).suffix(" %").smart_aim(false), 0);
    let response = ui.add(slider);
    response.widget_info(|| WidgetInfo::slider(true, shown, name));
    let changed = response.changed();
    if changed {
        *value = (shown / 100.0).clamp(0.0, 2.0);
    }
    changed
}

/// What the face is built with, and how time is stepped.
pub(super) fn model(ui: &mut Ui, ready: &Ready, view: &mut ExpressionsView) {
    ui.separator();
    ui.strong("Model");
    Grid::new("model of the skin").num_columns(2).spacing([8.0, 5.0]).show(ui, |ui| {
        ui.label("Muscles").on_hover_text("How a muscle's force spreads around its fibre");
        let combo =
            ComboBox::from_id_salt("law").width(176.0).selected_text(view.setup.law.label()).show_ui(ui, |ui| {
                for law in LawKind::ALL {
                    ui.selectable_value(&mut view.setup.law, law, law.label());
                }
            });
        name_combo(&combo.response, "Muscle law", view.setup.law.label());
        ui.end_row();

        ui.label("Skin").on_hover_text("What keeps the skin on the face");
        let label = view.setup.holding.label();
        let combo = ComboBox::from_id_salt("holding").width(176.0).selected_text(label).show_ui(ui, |ui| {
            for holding in Holding::ALL {
                ui.selectable_value(&mut view.setup.holding, holding, holding.label()).on_hover_text(holding.hint());
            }
        });
        name_combo(&combo.response, "Hold", label);
        combo.response.on_hover_text(view.setup.holding.hint());
        ui.end_row();

        ui.label("Stiffness").on_hover_text("Factor on every stiffness of the skin");
        ui.spacing_mut().slider_width = 110.0;
        let [least, most] = STIFFNESS;
        let slider = Slider::new(&mut view.setup.stiffness, least..=most).logarithmic(true).prefix("× ");
        let response = ui.add(exact(slider, 2));
        response.widget_info(|| WidgetInfo::slider(true, view.setup.stiffness, "Stiffness"));
        ui.end_row();

        ui.label("Lids, mouth").on_hover_text("Lids and the corners of the mouth are no plain skin");
        let hint = "The plates of the lids are stiffer than skin, their folds and the corners of the mouth softer. Off: one skin everywhere";
        ui.checkbox(&mut view.setup.tissues, "own stiffness").on_hover_text(hint);
        ui.end_row();

        ui.label("Method").on_hover_text("How time is stepped");
        let label = view.pace.method.label();
        let combo = ComboBox::from_id_salt("method").width(176.0).selected_text(label).show_ui(ui, |ui| {
            for method in Method::ALL {
                let promise = capital(method.promise());
                ui.selectable_value(&mut view.pace.method, method, method.label()).on_hover_text(promise);
            }
        });
        name_combo(&combo.response, "Method", label);
        combo.response.on_hover_text(capital(view.pace.method.promise()));
        ui.end_row();

        ui.label("Step").on_hover_text("Time of a step. Until it is chosen: 16.7 ms, and 33 ms for a face of more than 2,000 vertices");
        let mut ms = 1e3 * view.pace.step_s;
        let slider = Slider::new(&mut ms, 0.1..=33.0).logarithmic(true).suffix(" ms");
        let response = ui.add(exact(slider, 1));
        response.widget_info(|| WidgetInfo::slider(true, ms, "Step"));
        if response.changed() {
            view.pace.step_s = 1e-3 * ms;
            view.step_chosen = true;
        }
        ui.end_row();
    });
    let notes = &ready.actuators.notes;
    if !notes.is_empty() {
        let words = if notes.len() == 1 {
            "1 note on this face".to_owned()
        } else {
            format!("{} notes on this face", notes.len())
        };
        ui.weak(words).on_hover_text(notes.join("\n"));
    }
    ui.add_space(6.0);
}
