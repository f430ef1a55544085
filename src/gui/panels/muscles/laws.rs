//! The laws side by side: parameters with intervals, what is explained, held-out error, cost.

use egui::Ui;

use super::{MusclesView, Shown, table};
use crate::draw::numbers::significant;
use crate::draw::words::sentence;
use crate::export::muscle_tables;

/// Shows the parameters of the law chosen, and the table.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView) {
    ui.horizontal_wrapped(|ui| {
        let words = match shown.analysis.second_lobe_pays() {
            Some(true) => "The second lobe earns its parameters.",
            Some(false) => "The second lobe does not earn its parameters.",
            None => "",
        };
        ui.label(words);
        parameters(ui, shown);
    });
    ui.separator();
    let clicked = table::show(ui, "laws", &muscle_tables::laws(shown.analysis, shown.unit), Some(shown.law));
    if let Some(law) = clicked {
        view.law = (shown.analysis.best != Some(law)).then_some(law);
    }
}

/// "sr 5.1 (3.2 to 8.0)", what is not identified in words.
fn parameters(ui: &mut Ui, shown: &Shown<'_>) {
    let row = &shown.analysis.laws[shown.law];
    match &row.fit {
        Ok(fit) => {
            ui.weak(format!("{}:", row.label()));
            for p in &fit.parameters {
                let words = format!("{} {}", p.name, significant(p.value, 3));
                let interval = format!("({} to {})", significant(p.low, 2), significant(p.high, 2));
                let label = if p.identified && !p.at_bound {
                    ui.label(format!("{words} {interval}"))
                } else {
                    let why = if p.at_bound { "at its limit" } else { "not identified" };
                    ui.colored_label(ui.visuals().warn_fg_color, format!("{words} {interval}, {why}"))
                };
                let errors = if fit.together {
                    "with the errors that neighbours share."
                } else {
                    "as if neighbours shared no errors: too narrow."
                };
                label.on_hover_text(format!("{}; 95 % interval, {errors}", p.label));
            }
        }
        Err(failed) => _ = ui.colored_label(ui.visuals().warn_fg_color, sentence(&failed.to_string())),
    }
}
