//! The row of choices above the maps.

use egui::{ComboBox, Ui};

use super::{MusclesView, Second, Shown, Tab, maps};
use crate::fit::Compare;
use crate::gui::height_map::{RangeMode, Relief};
use crate::gui::orbit_view::{OrbitView, StandardView};
use crate::gui::panels::name_combo;
use crate::muscle_field::Include;
use crate::muscle_field::profiles::Part;

/// Ways to compare, with their words and what they mean.
const COMPARE: [(Compare, &str, &str); 4] = [
    (Compare::Tangential, "In the skin", "The part of the force in the surface: what a frame shows"),
    (Compare::Vectors, "Whole vectors", "All three components, also the one that one camera sees least"),
    (Compare::Along, "Along the fibre", "The signed component along the nearest fibre of the set"),
    (Compare::Magnitudes, "Lengths", "As the thesis: lengths alone. Noise makes lengths too long"),
];

/// Shows the row; it wraps where the window is narrow.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView) {
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        ui.label("Law");
        let laws = &shown.analysis.laws;
        let label = laws.get(shown.law).map(crate::muscle_field::LawRow::label).unwrap_or_default();
        let combo = ComboBox::from_id_salt("law shown").width(170.0).selected_text(&label).show_ui(ui, |ui| {
            for (k, row) in laws.iter().enumerate() {
                let best = if shown.analysis.best == Some(k) { " (best)" } else { "" };
                if ui.selectable_label(shown.law == k, format!("{}{best}", row.label())).clicked() {
                    view.law = (shown.analysis.best != Some(k)).then_some(k);
                }
            }
        });
        name_combo(&combo.response, "Law shown", &label);
        ui.separator();
        ui.selectable_value(&mut view.part, Part::AlongFibre, "Along the fibres")
            .on_hover_text("The signed component: positive pulls to the bone, negative away from it");
        ui.selectable_value(&mut view.part, Part::Magnitude, "Length").on_hover_text("Length of the force");
        ui.separator();
        ui.label("Right map");
        right_map(ui, view, shown.other.is_some());
        ui.separator();
        let locked = view.range_is_locked();
        if ui.selectable_label(locked, "Lock range").on_hover_text("Keeps the ends of both maps' colours").clicked() {
            view.options.range = match (locked, view.shown) {
                (false, Some((_, range))) => RangeMode::Locked(range),
                _ => RangeMode::Auto,
            };
        }
        ui.menu_button("Show…", |ui| {
            ui.set_min_width(210.0);
            ui.checkbox(&mut view.show_muscles, "Muscles");
            ui.checkbox(&mut view.options.wireframe, "Wireframe");
            ui.checkbox(&mut view.options.markers, "Markers");
            ui.checkbox(&mut view.options.border, "Border vertices");
            ui.checkbox(&mut view.options.fit_known, "Fit what is known");
            ui.separator();
            ui.weak("Standing on");
            for relief in Relief::ALL {
                ui.radio_value(&mut view.options.relief, relief, relief.label());
            }
            ui.separator();
            ui.weak("Seen from");
            for standard in StandardView::ALL {
                if ui.button(standard.label()).on_hover_text(standard.hint()).clicked() {
                    view.orbit =
                        if standard == StandardView::Front { maps::home() } else { OrbitView::standard(standard) };
                }
            }
        });
        ui.separator();
        compared(ui, view);
        ui.separator();
        for (tab, words) in [
            (Tab::Profiles, "Profiles"),
            (Tab::Laws, "Laws"),
            (Tab::SmallestSet, "Smallest set"),
            (Tab::Ladder, "Ladder"),
            (Tab::Subjects, "Subjects"),
        ] {
            ui.selectable_value(&mut view.tab, tab, words);
        }
        if shown.looking {
            ui.spinner().on_hover_text("The muscles are looked for anew");
        }
    });
    ui.add_space(3.0);
}

/// What the right map shows; of several subjects only where there are others.
fn right_map(ui: &mut Ui, view: &mut MusclesView, others: bool) {
    let all = [
        (Second::Residual, "Residual", "Observed less what the law says"),
        (Second::Model, "Law", "What the law says"),
        (Second::Mean, "Mean", "Mean force of all subjects, where the vertex counts on each of them"),
        (Second::Spread, "Spread", "Standard deviation of the force over all subjects"),
        (Second::Difference, "Difference", "The force of this subject less that of the one chosen under Subjects"),
    ];
    let choices = || all.iter().filter(|(second, ..)| others || !second.is_across());
    let label = choices().find(|(second, ..)| *second == view.second).map_or("Residual", |(_, words, _)| words);
    let combo = ComboBox::from_id_salt("right map").width(100.0).selected_text(label).show_ui(ui, |ui| {
        for (second, words, hint) in choices() {
            ui.selectable_value(&mut view.second, *second, *words).on_hover_text(*hint);
        }
    });
    name_combo(&combo.response, "Right map", label);
}

fn compared(ui: &mut Ui, view: &mut MusclesView) {
    ui.menu_button("Compared…", |ui| {
        ui.set_min_width(220.0);
        ui.weak("What of the forces");
        for (compare, words, hint) in COMPARE {
            ui.radio_value(&mut view.question.compare, compare, words).on_hover_text(hint);
        }
        ui.separator();
        ui.weak("Which vertices");
        for include in Include::ALL {
            ui.radio_value(&mut view.question.include, include, include.label());
        }
        ui.separator();
        ui.weak("Patches left out");
        ui.add(egui::Slider::new(&mut view.question.patch_radius_mm, 5.0..=40.0).step_by(1.0).suffix(" mm radius"))
            .on_hover_text("Errors of neighbouring forces are alike: a law is tested on whole patches of skin that it has not seen");
    })
    .response
    .on_hover_text("What the laws are compared with");
}
