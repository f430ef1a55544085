//! The part of the guide that speaks of suggested places: whether there are any, how many are sure, and a button that takes those.

use egui::{Button, RichText, Slider};

use super::{FramesView, points};
use crate::gui::action_state::ActionState;
use crate::gui::suggesting::{Status, Through};
use crate::gui::{Action, Command, Scene, keys, theme};

/// Shows the part.
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    let least = view.suggest.least;
    let found = chosen.iter().filter_map(|&v| points::suggestion(scene, v));
    let (count, sure) =
        found.fold((0, 0), |(n, sure), s| (n + 1, sure + usize::from(points::is_sure(scene, s, least))));
    ui.horizontal(|ui| {
        let mut on = view.suggest.on;
        let tooltip = keys::of(ui.ctx()).tooltip(Action::Suggest);
        if ui.checkbox(&mut on, RichText::new("Suggest places").strong()).on_hover_text(tooltip).changed() {
            commands.push(Command::Do(Action::Suggest));
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add_space(8.0);
            match &scene.suggested.status {
                Status::Off | Status::Failed(_) if count == 0 => {}
                Status::Needs(what) if count == 0 => _ = ui.label(RichText::new(*what).weak()),
                Status::Looking if count == 0 => _ = ui.label(RichText::new("Looking…").weak()),
                _ => {
                    _ = ui.label(RichText::new(format!("{sure} of {count} sure")).weak()).on_hover_text(
                        "Suggestions for the points to mark, and how many of them are as sure as the slider says.",
                    );
                }
            }
        });
    });
    if let Status::Failed(why) = &scene.suggested.status {
        ui.colored_label(theme::palette(ui.visuals()).warn, why);
    }
    match &scene.suggested.through {
        Through::Frames(frames, film) if count > 0 => {
            let words = format!("followed through {frames} frames of {film}");
            let hint = "The skin was followed from frame to frame, so that a large motion does not mislead.";
            ui.label(RichText::new(words).weak()).on_hover_text(hint);
        }
        Through::Not(why) if count > 0 => {
            let words = RichText::new("followed from the first frame to the last at once").weak();
            ui.label(words).on_hover_text(format!("{why}."));
        }
        _ => {}
    }
    let compressed = scene.suggested.compressed_px;
    if count > 0 && compressed > 0.0 {
        let words = format!("compressed frames add ± {compressed:.1} px");
        let hint = "A film's coder drops the faint texture of skin, or carries it from frame to frame, so that it no longer shows how the skin moved. \
                    Take both frames from the film's key frames (marked on its strip), or from a film with less compression. Pictures that say \
                    nothing of a film and have no camera noise left are taken for such frames.";
        ui.label(RichText::new(words).color(theme::palette(ui.visuals()).warn)).on_hover_text(hint);
    }
    if count == 0 && !matches!(scene.suggested.status, Status::Looking | Status::There) {
        return;
    }
    let mut percent = 100.0 * least;
    let slider = Slider::new(&mut percent, 50.0..=99.0).fixed_decimals(0).suffix(" %").text("Sure from");
    let hint = "How sure a suggestion must be that it lies within 1 px, to be taken with the others by one command.";
    if ui.add(slider).on_hover_text(hint).changed() {
        view.suggest.least = percent / 100.0;
    }
    let label = format!("Accept the {sure} that are {} sure and more", points::percent(least));
    let button = ui.add_enabled(state.can(Action::AcceptSure), Button::new(label));
    if button.on_hover_text(keys::of(ui.ctx()).tooltip(Action::AcceptSure)).clicked() {
        commands.push(Command::Do(Action::AcceptSure));
    }
}

/// The still points that are proposed, with a button that takes them.
pub fn still(ui: &mut egui::Ui, scene: Scene<'_>, state: &ActionState, commands: &mut Vec<Command>) {
    let proposal = &scene.suggested.still;
    if proposal.points.is_empty() {
        return;
    }
    let label = format!("Accept the {} still points that move as one", proposal.points.len());
    let scatter = proposal.residual_px.map(|r| format!(" They scatter {r:.2} px about the motion of the head."));
    let others = match proposal.left_out {
        0 => String::new(),
        n => format!(" {n} were left out: vague, or moved otherwise."),
    };
    let hint = format!("{}{}{others}", keys::of(ui.ctx()).tooltip(Action::AcceptStill), scatter.unwrap_or_default());
    if ui.add_enabled(state.can(Action::AcceptStill), Button::new(label)).on_hover_text(hint).clicked() {
        commands.push(Command::Do(Action::AcceptStill));
    }
}
