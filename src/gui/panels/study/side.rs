//! Beside the charts: the parts of the study, its methods to hide and show, and the noise.

use egui::{Sense, Ui, vec2};

use super::shown::{Look, Shown};
use super::{StudyView, plot};
use crate::draw::numbers::significant;
use crate::gui::study_work::Table;

/// Shows the list.
pub(super) fn show(ui: &mut Ui, table: &Table, shown: &Shown, view: &mut StudyView) {
    ui.add_space(6.0);
    ui.heading(&table.title);
    let failed = table.runs.iter().filter(|r| !r.is_ok()).count();
    ui.weak(format!("{} runs, {failed} failed", table.runs.len()));
    ui.add_space(6.0);
    ui.strong("Question");
    for (part, title) in &shown.parts {
        if ui.selectable_label(*part == shown.asked.part, title).clicked() && *part != view.part {
            view.part.clone_from(part);
            (view.seen, view.noise, view.picked) = (None, None, None);
            view.hidden.clear();
        }
    }
    if shown.noises.len() > 1 {
        ui.add_space(6.0);
        ui.strong("Marking noise, px");
        ui.horizontal_wrapped(|ui| {
            for noise in &shown.noises {
                let words = if *noise == 0.0 { "0".to_owned() } else { significant(*noise, 2) };
                ui.selectable_value(&mut view.noise, Some(*noise), words);
            }
        });
    }
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        ui.strong("Methods");
        if !view.hidden.is_empty() && ui.small_button("Show all").clicked() {
            view.hidden.clear();
        }
    });
    let dark = ui.visuals().dark_mode;
    for (place, method) in shown.methods.iter().enumerate() {
        ui.horizontal(|ui| {
            if shown.look != Look::Maps {
                let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
                let colour = plot::colour(place, dark);
                plot::mark(ui.painter(), rect.center(), place, colour, colour);
            }
            let mut on = !view.hidden.contains(method);
            if ui.checkbox(&mut on, method).changed() {
                if on {
                    view.hidden.remove(method);
                } else {
                    view.hidden.insert(method.clone());
                }
            }
        });
    }
    if shown.look == Look::Accuracy {
        ui.add_space(8.0);
        ui.weak("Ringed: nobody is both as fast and as true. Hollow: some runs failed; point at it for the cause.");
    }
}
