//! The row under the face: play, step, back, settle, and how fast it goes.

use egui::{RichText, Ui};

use super::ExpressionsView;
use crate::draw::numbers::{fixed, significant};
use crate::gui::action_state::ActionState;
use crate::gui::expression_work::{ExpressionWork, Ready};
use crate::gui::panels::frames::toolbar::switch;
use crate::gui::{Action, Command, theme};

/// Slower than this share of the real time is said.
const SLOW: f64 = 0.95;

/// Shows the row.
pub(super) fn show(
    ui: &mut Ui,
    work: &ExpressionWork,
    ready: &Ready,
    view: &ExpressionsView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    let p = theme::palette(ui.visuals());
    ui.add_space(2.0);
    // One line: what does not fit at its end, the creases, is cut and told whole under the pointer.
    ui.horizontal(|ui| {
        let play = if work.is_playing() { "Pause" } else { "Play" };
        for (action, label) in [
            (Action::PlayPause, play),
            (Action::StepOnce, "Step"),
            (Action::ResetPlay, "Reset"),
            (Action::Settle, "Settle"),
        ] {
            switch(ui, action, label, state, commands);
        }
        ui.separator();
        ui.monospace(format!("{} s", fixed(ready.time_s, 2)));
        let meter = work.meter();
        let mut words = Vec::new();
        if meter.fps > 0.0 {
            words.push(format!("{} fps", fixed(meter.fps, 0)));
        } else if work.is_playing() {
            words.push("at rest".to_owned());
        }
        if meter.step_ms > 0.0 && meter.fps > 0.0 {
            words.push(format!(
                "{} ms a step of {} ms",
                significant(meter.step_ms, 2),
                significant(1e3 * view.pace.step_s, 3)
            ));
        }
        if !words.is_empty() {
            ui.label(RichText::new(words.join("   ")).weak());
        }
        if meter.rate > 0.0 && meter.rate < SLOW && meter.fps > 0.0 {
            let slow = format!("slowed: {} ms simulated per 100 ms shown", fixed(100.0 * meter.rate, 0));
            ui.colored_label(p.warn, slow)
                .on_hover_text("A step takes longer than it lasts. A longer step or a coarser mesh keeps up");
        }
        if !ready.folded.is_empty() {
            let count = ready.folded.len();
            let triangles = if count == 1 { "triangle has" } else { "triangles have" };
            let words = format!("{count} {triangles} turned over (first: {})", ready.folded[0]);
            ui.colored_label(p.warn, words).on_hover_text(
                "The skin is folded there. A mesh without a skull does not resist bending: let it slide on the skull",
            );
        }
        if let Some(words) = work.settled() {
            ui.add(egui::Label::new(RichText::new(words).weak()).truncate());
        }
        if let Some([what, advice]) = &ready.creased {
            // Over the skull a crease is a fine fold; without one the sheet has buckled.
            let skull = ready.setup.holding == crate::expression::Holding::Skull;
            let text = RichText::new(what);
            let text = if skull { text.weak() } else { text.color(p.warn) };
            ui.add(egui::Label::new(text).truncate()).on_hover_text(format!("{what}. {advice}"));
        }
    });
    ui.add_space(2.0);
}
