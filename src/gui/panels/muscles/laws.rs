//! The laws side by side: parameters with intervals, what is explained, held-out error, cost.

use egui::Ui;

use super::{MusclesView, Shown, table};
use crate::draw::numbers::{fixed, significant};
use crate::fit::LawFit;
use crate::gui::height_map::options::with_error;

/// Titles of the table, each with what it means.
const HEAD: [(&str, &str); 9] = [
    ("Law", "Click to show it in the map and in the profiles"),
    (
        "Held-out error",
        "Root of the share of the squared force that is missed on patches left out; 1 is as good as no muscle",
    ),
    ("Worse than the best by", "In squared held-out error, with the standard error of the difference over patches"),
    ("R²", "Share of the squared force explained, about zero, weighted by standard errors"),
    ("Residual", "Root mean square length of what is left"),
    ("ΔBIC", "Schwarz's criterion above the lowest; it takes errors of neighbours for independent"),
    ("Numbers", "Shape parameters and strengths"),
    ("Evaluations", "Of the residual, over all starts and readings"),
    ("Time", "Of the fit"),
];

/// Shows the table, and under it the parameters of the law chosen.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView) {
    let laws = &shown.analysis.laws;
    let least = laws.iter().filter_map(|r| r.fit.as_ref().ok()).map(|f| f.bic).fold(f64::INFINITY, f64::min);
    let of_best = shown.analysis.best.and_then(|b| laws[b].held_out.as_ref());
    let rows: Vec<Vec<String>> = laws
        .iter()
        .map(|row| {
            let Ok(fit) = &row.fit else {
                let mut cells = vec!["–".to_owned(); HEAD.len()];
                cells[0] = format!("{} (no fit)", row.label());
                return cells;
            };
            let held_out = row.held_out.as_ref();
            let excess = held_out.zip(of_best).map(|(h, best)| h.excess_over(best)).filter(|[e, _]| *e > 0.0);
            vec![
                row.label(),
                held_out.map_or_else(|| "–".to_owned(), |h| error_text(h.error)),
                excess.map_or_else(
                    || "–".to_owned(),
                    |[e, sigma]| if e < 10.0 { with_error(e, Some(sigma)) } else { "more than 10".to_owned() },
                ),
                fixed(fit.r2, 3),
                format!("{} {}", significant(fit.rms, 3), shown.unit),
                fixed(fit.bic - least, 1),
                numbers(fit).to_string(),
                fit.evaluations.to_string(),
                format!("{} ms", significant(fit.time_ms, 2)),
            ]
        })
        .collect();
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
    let clicked = table::show(ui, "laws", &HEAD, &rows, shown.analysis.best, Some(shown.law));
    if let Some(law) = clicked {
        view.law = (shown.analysis.best != Some(law)).then_some(law);
    }
}

/// An error of ten is as far from the truth as one of a million.
pub(super) fn error_text(error: f64) -> String {
    if error < 10.0 { fixed(error, 3) } else { "above 10".to_owned() }
}

fn numbers(fit: &LawFit) -> usize {
    fit.parameters.iter().filter(|p| p.fitted).count() + fit.strengths.len()
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
                label.on_hover_text(format!(
                    "{}; 95 % interval. Errors of neighbours are alike, so that it is too narrow.",
                    p.label
                ));
            }
        }
        Err(failed) => _ = ui.colored_label(ui.visuals().warn_fg_color, super::sentence(&failed.to_string())),
    }
}
