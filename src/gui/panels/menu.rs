//! The menu bar and the tabs of the workspaces, made from the table of actions.

use egui::containers::menu::MenuBar;

use crate::gui::action::{Menu, Spec, TABLE};
use crate::gui::action_state::ActionState;
use crate::gui::keys;
use crate::gui::pictures::file_name;
use crate::gui::theme;
use crate::gui::view_state::Workspace;
use crate::gui::{Action, Command, ViewState};
use crate::project::recent::Recent;

/// Shows the bar.
pub fn show(
    ui: &mut egui::Ui,
    view: &ViewState,
    title: &str,
    state: &ActionState,
    recent: &Recent,
    commands: &mut Vec<Command>,
) {
    MenuBar::new().ui(ui, |ui| {
        for menu in Menu::BAR {
            ui.menu_button(menu.title(), |ui| {
                ui.set_min_width(230.0);
                for spec in TABLE.iter().filter(|s| s.menu == menu) {
                    entry(ui, spec, state, commands);
                    if spec.action == Action::OpenSample {
                        recent_projects(ui, recent, commands);
                    }
                }
                if menu == Menu::Point {
                    ui.separator();
                    ui.menu_button(Menu::Nudge.title(), |ui| entries(ui, Menu::Nudge, state, commands));
                }
            });
        }
        ui.add_space(16.0);
        for (workspace, action) in [
            (Workspace::Frames, Action::WorkspaceFrames),
            (Workspace::Forces, Action::WorkspaceForces),
            (Workspace::Muscles, Action::WorkspaceMuscles),
            (Workspace::Expressions, Action::WorkspaceExpressions),
            (Workspace::Face, Action::WorkspaceFace),
            (Workspace::Study, Action::WorkspaceStudy),
        ] {
            tab(ui, view.workspace == workspace, action, commands);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add_space(6.0);
            ui.add(egui::Label::new(egui::RichText::new(title).weak()).truncate());
        });
    });
}

/// The entries of one menu; also the menu of a point under the pointer.
pub fn entries(ui: &mut egui::Ui, menu: Menu, state: &ActionState, commands: &mut Vec<Command>) {
    for spec in TABLE.iter().filter(|s| s.menu == menu) {
        entry(ui, spec, state, commands);
    }
}

fn entry(ui: &mut egui::Ui, spec: &Spec, state: &ActionState, commands: &mut Vec<Command>) {
    if spec.new_group {
        ui.separator();
    }
    let key = keys::of(ui.ctx()).text(spec.action).unwrap_or_default();
    let button = match state.on(spec.action) {
        Some(on) => egui::Button::selectable(on, state.label(spec.action)),
        None => egui::Button::new(state.label(spec.action)).frame_when_inactive(false),
    };
    let button = button.shortcut_text(key);
    if ui.add_enabled(state.can(spec.action), button).on_hover_text(spec.tooltip).clicked() {
        commands.push(Command::Do(spec.action));
        ui.close();
    }
}

/// The projects opened last; one whose file is gone is grey.
fn recent_projects(ui: &mut egui::Ui, recent: &Recent, commands: &mut Vec<Command>) {
    let button = egui::Button::new("Open recent").frame_when_inactive(false);
    egui::containers::menu::SubMenuButton::from_button(button).ui(ui, |ui| {
        ui.set_min_width(260.0);
        for path in recent.paths() {
            let name = file_name(path);
            let there = path.exists();
            let shown = ui.add_enabled(there, egui::Button::new(name.as_str()).frame_when_inactive(false));
            let shown = shown.on_hover_text(path.display().to_string());
            if shown.on_disabled_hover_text(format!("{} is not there any more", path.display())).clicked() {
                commands.push(Command::OpenRecent(path.clone()));
                ui.close();
            }
        }
        if recent.paths().is_empty() {
            ui.weak("No project has been opened yet.");
        } else {
            ui.separator();
            if ui.add(egui::Button::new("Forget these").frame_when_inactive(false)).clicked() {
                commands.push(Command::ForgetRecent);
                ui.close();
            }
        }
    });
}

fn tab(ui: &mut egui::Ui, chosen: bool, action: Action, commands: &mut Vec<Command>) {
    let p = theme::palette(ui.visuals());
    let text = egui::RichText::new(action.label());
    let text = if chosen { text.strong() } else { text.weak() };
    let response = ui.add(egui::Button::new(text).frame(false).min_size(egui::vec2(64.0, 24.0)));
    if chosen {
        let rect = response.rect;
        ui.painter().hline(rect.x_range().shrink(8.0), rect.bottom() + 1.0, egui::Stroke::new(2.0, p.accent));
    }
    let tooltip = action.spec().map_or("", |s| s.tooltip);
    if response.on_hover_text(tooltip).clicked() {
        commands.push(Command::Do(action));
    }
}
