//! The card of one vertex: everything that is known of it.

use egui::{RichText, Ui};
use nalgebra::Point3;

use crate::gui::Scene;
use crate::gui::height_map::Layer;
use crate::gui::height_map::options::{fixed, significant, with_error};
use crate::muscle_field::fibres::{fibre_through, muscle_name};
use crate::pipeline::peak::STANDS_ABOVE;

/// Shows the card of a vertex, or how to get one.
pub(super) fn show(ui: &mut Ui, scene: Scene<'_>, layer: &Layer, first: &[Point3<f64>], vertex: Option<usize>) {
    ui.separator();
    let Some(v) = vertex.filter(|v| *v < scene.outcome.first.len()) else {
        ui.strong("No vertex chosen");
        ui.weak("Point at the map to read a value; click to keep it.");
        return;
    };
    let outcome = scene.outcome;
    let state = outcome.states.get(v).copied().unwrap_or_default();
    let border = outcome.border.get(v).copied().unwrap_or(false);
    ui.horizontal(|ui| {
        ui.label(RichText::new(format!("Vertex {v}")).strong().size(15.0));
        ui.weak(if border { format!("{}, border", state.word()) } else { state.word().to_owned() });
    });
    if let Some(landmark) = scene.face.landmarks().iter().find(|l| l.vertex as usize == v) {
        ui.weak(&landmark.name);
    }
    if let Some(fibre) = fibre_through(scene.face, &outcome.first, v) {
        ui.weak(format!("in {}", muscle_name(&scene.face.muscles()[fibre.muscle])));
    }
    ui.add_space(2.0);
    egui::Grid::new("vertex card").num_columns(2).spacing([12.0, 3.0]).show(ui, |ui| {
        if state.is_known() {
            forces(ui, scene, v);
        } else {
            row(ui, "Force", "not measured");
        }
        if let Some((value, error)) = layer.value_and_error(v)
            && layer.unit == "mm"
        {
            row(ui, &layer.title, &format!("{} mm", with_error(value, error)));
        }
        geometry(ui, scene, first, v, state.is_known());
    });
    if outcome.field.outside_table.get(v).copied().unwrap_or(false) {
        ui.colored_label(ui.visuals().warn_fg_color, "The skin here is strained beyond its table.");
    }
    ui.add_space(8.0);
}

fn row(ui: &mut Ui, name: &str, value: &str) {
    ui.weak(name);
    ui.label(value);
    ui.end_row();
}

fn forces(ui: &mut Ui, scene: Scene<'_>, v: usize) {
    let field = &scene.outcome.field;
    let unit = scene.outcome.unit();
    let Some(force) = field.force.get(v) else { return };
    let sigma = field.sigma.get(v).copied();
    ui.weak("Force");
    ui.strong(format!("{} {unit}", with_error(force.norm(), sigma)));
    ui.end_row();
    if let Some(sigma) = sigma.filter(|s| *s > 0.0) {
        let ratio = force.norm() / sigma;
        let verdict = if ratio < STANDS_ABOVE { " (noise)" } else { "" };
        row(ui, "Force / ±", &format!("{}{verdict}", significant(ratio, 2)));
    }
    let components = [("Force x, y, z", [force.x, force.y, force.z].map(|c| significant(c, 2)).join(", "))];
    for (name, text) in components {
        row(ui, name, &format!("{text} {unit}"));
    }
    for (name, list) in [("In the skin", &field.tangential), ("Out of it", &field.normal)] {
        if let Some(value) = list.get(v) {
            row(ui, name, &format!("{} {unit}", significant(*value, 3)));
        }
    }
    if let Some(fibre) = fibre_through(scene.face, &scene.outcome.first, v) {
        let along = force.dot(&fibre.direction);
        row(ui, "Along its fibre", &format!("{} {unit}", significant(along, 3)));
    }
    if let Some(change) = field.depth_change.get(v) {
        row(ui, "Doubt from depth", &format!("{} {unit}", significant(*change, 2)));
    }
}

fn geometry(ui: &mut Ui, scene: Scene<'_>, first: &[Point3<f64>], v: usize, known: bool) {
    let outcome = scene.outcome;
    let at = outcome.first[v];
    if let (true, Some(last)) = (known, outcome.last.get(v)) {
        let moved = last - at;
        row(ui, "Displacement", &format!("{} mm", fixed(moved.norm(), 2)));
        row(ui, "Moved x, y, z", &format!("{} mm", [moved.x, moved.y, moved.z].map(|c| fixed(c, 2)).join(", ")));
    }
    if let Some((low, high)) = strain_range(scene, v) {
        row(ui, "Strain of springs", &format!("{:+.1} to {:+.1} %", low * 100.0, high * 100.0).replace('-', "−"));
    }
    let at = first[v];
    row(
        ui,
        "Place x, y, z",
        &format!("{} mm", [at.x, at.y, at.z].map(|c| format!("{c:.1}").replace('-', "−")).join(", ")),
    );
}

/// Smallest and largest strain of the springs at a vertex.
fn strain_range(scene: Scene<'_>, v: usize) -> Option<(f64, f64)> {
    let strains = &scene.outcome.field.strain;
    let edges = scene.face.mesh().edges();
    let v = v as u32;
    edges
        .iter()
        .zip(strains)
        .filter(|(edge, _)| edge.contains(&v))
        .filter_map(|(_, strain)| *strain)
        .fold(None, |range: Option<(f64, f64)>, s| Some(range.map_or((s, s), |(low, high)| (low.min(s), high.max(s)))))
}
