//! What is to be said of the fit, and everything about the vertex pointed at: its share of every muscle, its springs on the curve.

use egui::{Align2, FontId, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::Shown;
use super::layers::Layers;
use crate::draw::numbers::{fixed, significant};
use crate::gui::Focus;
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::options::with_error;
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::maps::Maps;

/// Shares smaller than this are summed up as "others".
const LEAST_SHARE: f64 = 0.02;

/// Shows the summary, and the card of the vertex hovered or selected.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>, layers: &Layers, focus: &Focus) {
    summary(ui, shown);
    ui.separator();
    match focus.hovered().or_else(|| focus.selected_vertex()) {
        Some(v) if (v as usize) < shown.scene.outcome.first.len() => vertex(ui, shown, layers, v),
        _ => {
            ui.strong("No vertex chosen");
            ui.weak("Point at a map to see its share of every muscle and its springs on the stress–strain curve; click to keep it.");
        }
    }
}

fn summary(ui: &mut Ui, shown: &Shown<'_>) {
    let analysis = shown.analysis;
    ui.add_space(6.0);
    let Some(row) = analysis.best.map(|b| &analysis.laws[b]) else {
        ui.colored_label(ui.visuals().warn_fg_color, "No law could be fitted to these forces.");
        return;
    };
    ui.strong(format!("Best law: {}", row.label()));
    if let Some(held_out) = &row.held_out {
        let missed = (held_out.error * held_out.error).min(9.99);
        ui.label(format!(
            "It misses {} % of the squared force on patches that it has not seen.",
            fixed(100.0 * missed, 0)
        ));
        if held_out.error >= 1.0 {
            ui.colored_label(ui.visuals().warn_fg_color, "That is no better than no muscle at all: do not believe it.");
        }
    }
    let rivals: Vec<String> = analysis
        .laws
        .iter()
        .filter(|other| !std::ptr::eq(*other, row))
        .filter_map(|other| {
            let [excess, error] = other.held_out.as_ref()?.excess_over(row.held_out.as_ref()?);
            (excess < 2.0 * error).then(|| other.label())
        })
        .collect();
    if !rivals.is_empty() {
        ui.weak(format!("Not clearly better than: {}.", rivals.join("; ")));
    }
    if !analysis.question.include.name().starts_with("believed") {
        ui.weak("Vertices on the border or inferred ones count, too.");
    }
    if !shown.scene.outcome.scale_measured {
        ui.weak("No scale is set: strengths are relative.");
    }
}

fn vertex(ui: &mut Ui, shown: &Shown<'_>, layers: &Layers, v: u32) {
    let (outcome, unit) = (shown.scene.outcome, shown.unit);
    ui.strong(format!("Vertex {v}"));
    let known = outcome.states.get(v as usize).is_some_and(|s| s.is_known());
    if let (true, Some(force)) = (known, outcome.measured().0.get(v as usize)) {
        let sigma = outcome.measured().1.get(v as usize).copied();
        ui.label(format!("{} {unit} observed", with_error(force.norm(), sigma)));
    } else {
        ui.weak("not measured");
    }
    if let Some(Ok(maps)) = &layers.across {
        across(ui, shown, layers, maps, v as usize);
    }
    shares(ui, shown, v);
    ui.add_space(6.0);
    springs(ui, shown, v);
}

/// The vertex on every subject, what they have in common, and how this one differs.
fn across(ui: &mut Ui, shown: &Shown<'_>, layers: &Layers, maps: &Maps, v: usize) {
    ui.add_space(4.0);
    let part = if layers.is_signed() { "Along the fibres" } else { "Length" };
    ui.weak(format!("{part} on every subject, {}", shown.unit));
    let at = |list: &[Option<f64>]| list.get(v).copied().flatten();
    let sigmas = std::iter::once(shown.scene.outcome).chain(shown.subjects.others().map(|(_, o)| &*o.outcome));
    egui::Grid::new("on every subject").spacing([10.0, 2.0]).show(ui, |ui| {
        for ((name, values), outcome) in shown.names().iter().zip(&maps.values).zip(sigmas) {
            name_cell(ui, egui::RichText::new(*name));
            match at(values) {
                Some(value) => ui.label(with_error(value, outcome.field.sigma.get(v).copied())),
                None => ui.weak("does not count"),
            };
            ui.end_row();
        }
        let less = shown.other.map(|(_, other)| (format!("this less {}", other.name), shown.place_of_other()));
        let less = less.and_then(|(words, place)| Some((words, at(&maps.difference(place))?)));
        let common = [("mean", at(&maps.mean)), ("spread", at(&maps.spread))];
        let common = common.into_iter().filter_map(|(words, value)| Some((words.to_owned(), value?)));
        for (words, value) in common.chain(less) {
            name_cell(ui, egui::RichText::new(words).weak());
            ui.label(significant(value, 3));
            ui.end_row();
        }
    });
}

/// A name in a column of a fixed width; what is longer is cut off, and told by the pointer.
fn name_cell(ui: &mut Ui, words: egui::RichText) {
    let size = vec2(118.0, 16.0);
    ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_width(size.x);
        ui.add(egui::Label::new(words).truncate());
    });
}

/// What each muscle does at the vertex, with the strengths of all muscles at once.
fn shares(ui: &mut Ui, shown: &Shown<'_>, v: u32) {
    let analysis = shown.analysis;
    let x = &shown.scene.outcome.first[v as usize];
    let pulls = analysis.fibres.iter().zip(&analysis.activations.muscles);
    let mut pulls: Vec<(usize, f64)> =
        pulls.map(|(of, one)| (of.muscle, (analysis.shape.force(&of.fibre, x) * one.strength_n).norm())).collect();
    let sum: f64 = pulls.iter().map(|p| p.1).sum();
    if sum <= 0.0 {
        ui.weak("No muscle pulls here.");
        return;
    }
    pulls.sort_by(|a, b| b.1.total_cmp(&a.1));
    ui.add_space(4.0);
    ui.weak("Muscles that pull here");
    let mut others = 0.0;
    for (muscle, pull) in pulls {
        let share = pull / sum;
        if share < LEAST_SHARE {
            others += share;
            continue;
        }
        let name = muscle_name(&shown.scene.face.muscles()[muscle]);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 4.0, 30.0), Sense::hover());
        let painter = ui.painter();
        let small = FontId::proportional(12.0);
        painter.text(rect.min, Align2::LEFT_TOP, &name, small.clone(), ui.visuals().text_color());
        let words = format!("{} {}, {} %", significant(pull, 2), shown.unit, fixed(100.0 * share, 0));
        let bar =
            Rect::from_min_max(pos2(rect.left(), rect.top() + 17.0), pos2(rect.right() - 92.0, rect.top() + 26.0));
        painter.rect_filled(bar, 2.0, ui.visuals().widgets.noninteractive.bg_stroke.color.gamma_multiply(0.5));
        let filled = Rect::from_min_size(bar.min, vec2(bar.width() * share as f32, bar.height()));
        painter.rect_filled(filled, 2.0, egui::Color32::from_rgb(196, 62, 58));
        painter.text(
            pos2(rect.right(), bar.center().y),
            Align2::RIGHT_CENTER,
            &words,
            small,
            ui.visuals().weak_text_color(),
        );
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, format!("{name}: {words}")));
    }
    if others > 0.005 {
        ui.weak(format!("others {} %", fixed(100.0 * others, 0)));
    }
}

/// The place of each attached spring on the stress–strain curve.
fn springs(ui: &mut Ui, shown: &Shown<'_>, v: u32) {
    /// Straight pieces of the curve.
    const STEPS: i32 = 80;
    let scene = shown.scene;
    let curve = &scene.project.settings.skin;
    let edges = scene.face.mesh().edges().iter().zip(&scene.outcome.field.strain);
    let strains: Vec<f64> = edges.filter(|(e, _)| e.contains(&v)).filter_map(|(_, s)| *s).collect();
    ui.weak("Its springs on the stress–strain curve");
    if strains.is_empty() {
        ui.label("No spring here is known at both ends.");
        return;
    }
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 4.0, 128.0), Sense::hover());
    let inks = Inks::new(ui.visuals(), true);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 4.0, inks.canvas);
    let plot = Rect::from_min_max(rect.min + vec2(40.0, 8.0), rect.max - vec2(8.0, 26.0));
    let most = strains.iter().fold(0.05_f64, |m, s| m.max(s.abs())) * 1.15;
    let stress = [-most, most].map(|e| curve.stress_kpa(e));
    let reach = stress[0].abs().max(stress[1].abs()).max(1e-9);
    let at = |strain: f64, kpa: f64| -> Pos2 {
        pos2(
            plot.center().x + (strain / most) as f32 * plot.width() / 2.0,
            plot.center().y - (kpa / reach) as f32 * plot.height() / 2.0,
        )
    };
    let thin = Stroke::new(0.8, inks.axis);
    painter.line_segment([at(-most, 0.0), at(most, 0.0)], thin);
    painter.line_segment([at(0.0, -reach), at(0.0, reach)], thin);
    let line = (0..=STEPS).map(|k| {
        let strain = most * (2.0 * f64::from(k) / f64::from(STEPS) - 1.0);
        at(strain, curve.stress_kpa(strain))
    });
    painter.add(egui::Shape::line(line.collect(), Stroke::new(2.0, inks.weak_text)));
    for &strain in &strains {
        let place = at(strain, curve.stress_kpa(strain));
        let colour = if curve.covers(strain) { inks.selected } else { ui.visuals().warn_fg_color };
        painter.circle_filled(place, 3.6, colour);
    }
    let small = FontId::proportional(10.5);
    let number = |x: f64, unit: &str| format!("{}{unit}", significant(x, 2));
    let foot = plot.bottom() + 4.0;
    painter.text(pos2(plot.left(), foot), Align2::LEFT_TOP, number(-100.0 * most, " %"), small.clone(), inks.weak_text);
    painter.text(
        pos2(plot.right(), foot),
        Align2::RIGHT_TOP,
        number(100.0 * most, " %"),
        small.clone(),
        inks.weak_text,
    );
    painter.text(pos2(plot.center().x, foot), Align2::CENTER_TOP, "strain", small.clone(), inks.weak_text);
    painter.text(plot.left_top() - vec2(4.0, 0.0), Align2::RIGHT_TOP, number(reach, ""), small.clone(), inks.weak_text);
    painter.text(
        plot.left_bottom() - vec2(4.0, 0.0),
        Align2::RIGHT_BOTTOM,
        number(-reach, ""),
        small.clone(),
        inks.weak_text,
    );
    painter.text(pos2(rect.left() + 4.0, plot.center().y), Align2::LEFT_CENTER, "kPa", small, inks.weak_text);
    let words = format!(
        "{} springs, strains from {} to {} %",
        strains.len(),
        fixed(100.0 * strains.iter().copied().fold(f64::INFINITY, f64::min), 1),
        fixed(100.0 * strains.iter().copied().fold(f64::NEG_INFINITY, f64::max), 1)
    );
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, &words));
    response.on_hover_text(words);
}
