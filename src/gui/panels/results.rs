//! What came out, in numbers: the fit, the head's motion, the forces with their self-check, and everything to heed.

use egui::RichText;

use crate::gui::height_map::options::{fixed, significant, with_error};
use crate::gui::{Command, Focus, Scene, theme};
use crate::pipeline::{Peak, Warning};
use crate::project::PointId;

/// Shows the numbers.
pub fn show(ui: &mut egui::Ui, scene: Scene<'_>, focus: &mut Focus, commands: &mut Vec<Command>) {
    super::in_fixed_width(ui, |ui| numbers(ui, scene, focus, commands));
}

fn numbers(ui: &mut egui::Ui, scene: Scene<'_>, focus: &mut Focus, commands: &mut Vec<Command>) {
    warnings(ui, scene, commands);
    let o = scene.outcome;
    heading(ui, "Landmark fit");
    grid(ui, "fit", |ui| {
        row(ui, "Landmarks placed", format!("{} of {}", o.fit.placed, o.fit.of), "");
        if o.fit.placed == 0 {
            return;
        }
        row(
            ui,
            "Residual before the morph",
            format!("{} px", fixed(o.fit.rms_before_px, 2)),
            "Root mean square distance of the landmarks from their marks after alignment and scaling.",
        );
        row(
            ui,
            "Residual after the morph",
            format!("{} px", fixed(o.fit.rms_after_px, 2)),
            "Rounding error, or something is wrong.",
        );
        let [x, y, z] = o.fit.scale;
        row(ui, "Scale of the face x, y, z", format!("{x:.2}, {y:.2}, {z:.2}"), "Of the generic face along its axes.");
    });
    heading(ui, "Head motion");
    head(ui, scene, commands);
    heading(ui, "Forces");
    forces(ui, scene, focus, commands);
}

fn heading(ui: &mut egui::Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).strong());
}

fn grid(ui: &mut egui::Ui, id: &str, rows: impl FnOnce(&mut egui::Ui)) {
    egui::Grid::new(id).num_columns(2).spacing([12.0, 4.0]).min_col_width(120.0).show(ui, rows);
}

fn row(ui: &mut egui::Ui, label: &str, value: String, tooltip: &str) {
    let label = ui.label(RichText::new(label).weak());
    let value = ui.label(RichText::new(value).monospace());
    if !tooltip.is_empty() {
        label.on_hover_text(tooltip);
        value.on_hover_text(tooltip);
    }
    ui.end_row();
}

/// The warnings, each a plain sentence, with a jump to the guilty vertex where there is one.
pub fn warnings(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let p = theme::palette(ui.visuals());
    if scene.outcome.warnings.is_empty() {
        ui.colored_label(p.good, "Nothing to warn of.");
        return;
    }
    for warning in &scene.outcome.warnings {
        egui::Frame::NONE.fill(p.card).stroke(egui::Stroke::new(1.0, p.line)).corner_radius(5).inner_margin(8).show(
            ui,
            |ui| {
                ui.set_width(ui.available_width());
                ui.label(RichText::new(warning.to_string()).color(p.warn));
                for (place, words) in places_of(warning) {
                    if ui.small_button(words).clicked() {
                        commands.push(Command::JumpTo(place));
                    }
                }
            },
        );
    }
}

/// The points that a warning speaks of, with the words of the button that goes there.
fn places_of(warning: &Warning) -> Vec<(PointId, String)> {
    let landmark = |id: &String, name: &String| (PointId::Landmark(id.clone()), format!("Go to {name}"));
    match warning {
        Warning::Folded { vertex, frame: "first", .. } => {
            vec![(PointId::FeatureFirst(*vertex), format!("Go to vertex {vertex}"))]
        }
        Warning::Folded { vertex, .. } => vec![(PointId::FeatureLast(*vertex), format!("Go to vertex {vertex}"))],
        Warning::Swapped { ids, names } => ids.iter().zip(names).map(|(id, name)| landmark(id, name)).collect(),
        Warning::Crumpled { id, name, .. } | Warning::Misplaced { id, name, .. } => vec![landmark(id, name)],
        Warning::OutsidePicture { first, .. } => vec![(first.clone(), format!("Go to {first}"))],
        _ => Vec::new(),
    }
}

fn head(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let head = &scene.outcome.head;
    if head.still_points == 0 {
        ui.label("Not removed: mark at least 3 still points (4 also tell the noise floor).");
        return;
    }
    let t = head.motion.translation_mm;
    let turn = head.motion.rotation.scaled_axis().map(f64::to_degrees);
    grid(ui, "head", |ui| {
        row(ui, "Still points", head.still_points.to_string(), "");
        row(
            ui,
            "Shift x, y, z",
            format!("{} mm", [t.x, t.y, t.z].map(|c| fixed(c, 2)).join(", ")),
            "Of the head from the first frame to the last.",
        );
        row(
            ui,
            "Turn about x, y, z",
            format!("{}°", [turn.x, turn.y, turn.z].map(|c| fixed(c, 2)).join(", ")),
            "Nod, shake and tilt of the head.",
        );
        let floor =
            head.noise_floor_px.map_or_else(|| "needs 4 still points".to_owned(), |n| format!("{} px", fixed(n, 2)));
        row(
            ui,
            "Noise floor",
            floor,
            "How far the still points disagree after the head's motion is removed: what a mark is worth here.",
        );
        let force = scene.outcome.noise_floor_force(scene.project.settings.marking_sigma_px);
        if let Some(force) = force {
            let unit = scene.outcome.unit();
            row(
                ui,
                "Noise floor in force",
                format!("{} {unit}", significant(force, 2)),
                "Median standard error of the forces if every mark erred by the noise floor: a force below it means nothing.",
            );
        }
    });
    super::settings::scatter(ui, scene, commands);
}

fn forces(ui: &mut egui::Ui, scene: Scene<'_>, focus: &mut Focus, commands: &mut Vec<Command>) {
    let o = scene.outcome;
    let unit = o.unit();
    let known = o.states.iter().filter(|s| s.is_known()).count();
    let peak = o.peak();
    if peak == Peak::Unmeasured {
        ui.label("Mark feature points in the last frame to see forces.");
        return;
    }
    grid(ui, "forces", |ui| {
        row(ui, "Points marked", scene.project.measured_count().to_string(), "");
        row(
            ui,
            "Vertices known",
            format!("{known} of {}", o.states.len()),
            "Marked, filled in between marks, or held.",
        );
        if let Peak::Stands { force, sigma, .. } = peak {
            let tooltip = "Of those that can be believed and stand above twice their error, and its standard error from the marking error.";
            row(ui, "Largest force", format!("{} {unit}", with_error(force, Some(sigma))), tooltip);
        }
        let median = o.median_over_error().unwrap_or(0.0);
        row(
            ui,
            "Median force / error",
            significant(median, 2),
            "Below 2, most of the field cannot be told from the noise of marking.",
        );
        row(
            ui,
            "Sum of internal forces",
            format!("{} {unit}", significant(o.field.internal_sum.norm(), 2)),
            "Zero but for rounding: the self-check of the field.",
        );
    });
    let Some(vertex) = peak.vertex() else {
        ui.label("No force stands above twice its error.");
        return;
    };
    let response = ui.link(format!("Go to vertex {vertex}"));
    if response.hovered() {
        focus.hover(vertex as u32);
    }
    if response.clicked() {
        commands.push(Command::JumpTo(PointId::FeatureLast(vertex as u32)));
    }
}
