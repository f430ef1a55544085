//! The landmarks and the muscles of a face, each with the vertex that it is bound to.

use egui::{Button, DragValue, RichText, Ui, Vec2};

use super::FaceView;
use crate::face::draft::{DraftEdit, Slot};
use crate::gui::face_work::OpenFace;
use crate::gui::pictures::file_name;
use crate::gui::{Command, theme};
use crate::muscle_field::fibres::muscle_name;

/// Name, file and size of the face.
pub(super) fn head(ui: &mut Ui, open: &OpenFace, commands: &mut Vec<Command>) {
    ui.add_space(4.0);
    let mut name = open.draft.bindings().name.clone();
    ui.horizontal(|ui| {
        let label = ui.label("Name");
        let edit = egui::TextEdit::singleline(&mut name).desired_width(f32::INFINITY);
        if ui.add(edit).labelled_by(label.id).changed() {
            commands.push(Command::EditFace(DraftEdit::Rename(name.clone())));
        }
    });
    let mesh = open.draft.mesh();
    let file = open.path.as_deref().map_or_else(|| "no file yet".to_owned(), file_name);
    let unsaved = if open.draft.unsaved() { " •" } else { "" };
    let words = format!("{} vertices, {} triangles, {file}{unsaved}", mesh.len(), mesh.triangles().len());
    ui.add(egui::Label::new(RichText::new(words).weak()).truncate());
}

/// What is selected, with how to recognise it: of a fixed height, so that the list under it does not jump.
fn card(ui: &mut Ui, open: &OpenFace, view: &mut FaceView, commands: &mut Vec<Command>) {
    let bindings = open.draft.bindings();
    ui.allocate_ui(Vec2::new(ui.available_width(), 84.0), |ui| {
        ui.set_min_height(84.0);
        let Some(slot) = view.selected else {
            ui.label(RichText::new("Choose what to bind, then click its vertex.").weak());
            return;
        };
        let (title, hint) = match slot {
            Slot::Landmark(i) => match bindings.landmarks.get(i) {
                Some(l) => (l.landmark.name.clone(), l.landmark.hint.clone()),
                None => return,
            },
            Slot::Attachment(i) | Slot::Insertion(i) => {
                let Some(m) = bindings.muscles.get(i) else { return };
                let end = if matches!(slot, Slot::Attachment(_)) {
                    "The end on the bone, which stays."
                } else {
                    "The end in the skin, which moves."
                };
                (muscle_name(&m.muscle), end.to_owned())
            }
        };
        ui.label(RichText::new(title).strong().size(14.0));
        ui.label(RichText::new(hint).weak());
        ui.horizontal(|ui| {
            let bound = bindings.vertex(slot);
            ui.label(bound.map_or_else(|| "Click its vertex.".to_owned(), |v| format!("At vertex {v}.")));
            if ui.add_enabled(bound.is_some(), Button::new("Unbind").small()).clicked() {
                let mirrored = view.mirrored;
                commands.push(Command::EditFace(DraftEdit::Bind { slot, vertex: None, mirrored }));
            }
            if ui.add(Button::new("Done").small()).on_hover_text("Bind nothing by clicks").clicked() {
                view.selected = None;
            }
        });
    });
    ui.separator();
}

/// The list of the landmarks.
pub(super) fn landmarks(ui: &mut Ui, open: &OpenFace, view: &mut FaceView, commands: &mut Vec<Command>) {
    card(ui, open, view, commands);
    let bindings = open.draft.bindings();
    ui.spacing_mut().item_spacing.y = 0.0;
    for (i, l) in bindings.landmarks.iter().enumerate() {
        let slot = Slot::Landmark(i);
        let place = l.vertex.map_or_else(|| "not bound".to_owned(), |v| format!("vertex {v}"));
        let spoken = format!("Landmark {}, {place}", l.landmark.name);
        entry(ui, view, slot, &l.landmark.name, &place, &spoken, l.vertex.is_some());
    }
}

/// A row that selects a slot.
fn entry(ui: &mut Ui, view: &mut FaceView, slot: Slot, name: &str, place: &str, spoken: &str, bound: bool) {
    let p = theme::palette(ui.visuals());
    let selected = view.selected == Some(slot);
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 20.0), egui::Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::ListBoxOption, true, selected, spoken));
    if selected {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().selection.bg_fill);
    } else if response.hovered() {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().widgets.hovered.weak_bg_fill.gamma_multiply(0.6));
    }
    let dot = rect.left_center() + Vec2::new(9.0, 0.0);
    if bound {
        ui.painter().circle_filled(dot, 3.6, p.good);
    } else {
        ui.painter().circle_stroke(dot, 3.2, egui::Stroke::new(1.2, p.warn));
    }
    let font = egui::TextStyle::Body.resolve(ui.style());
    let weak = ui.visuals().weak_text_color();
    let place_rect = ui.painter().text(
        rect.right_center() - Vec2::new(4.0, 0.0),
        egui::Align2::RIGHT_CENTER,
        place,
        egui::FontId::proportional(11.5),
        weak,
    );
    let from = rect.left_center() + Vec2::new(20.0, 0.0);
    let mut job = egui::text::LayoutJob::simple_singleline(name.to_owned(), font, ui.visuals().text_color());
    job.wrap = egui::text::TextWrapping::truncate_at_width((place_rect.left() - from.x - 6.0).max(20.0));
    let galley = ui.painter().layout_job(job);
    ui.painter().galley(from - Vec2::new(0.0, galley.size().y / 2.0), galley, ui.visuals().text_color());
    if response.clicked() {
        view.selected = if selected { None } else { Some(slot) };
    }
}

/// The list of the muscles, each with its two ends and half its width.
pub(super) fn muscles(ui: &mut Ui, open: &OpenFace, view: &mut FaceView, commands: &mut Vec<Command>) {
    card(ui, open, view, commands);
    let bindings = open.draft.bindings();
    for (i, m) in bindings.muscles.iter().enumerate() {
        let name = muscle_name(&m.muscle);
        ui.add(egui::Label::new(RichText::new(&name).small()).truncate());
        ui.horizontal(|ui| {
            let ends = [
                (Slot::Attachment(i), "bone", "Attachment", m.attachment),
                (Slot::Insertion(i), "skin", "Insertion", m.insertion),
            ];
            for (slot, word, long, vertex) in ends {
                let place = vertex.map_or_else(|| "not bound".to_owned(), |v| v.to_string());
                let on = view.selected == Some(slot);
                let button = ui.add(Button::selectable(on, format!("{word} {place}")).min_size(Vec2::new(96.0, 20.0)));
                let spoken = format!("{long} of {}, {place}", m.muscle.id);
                button.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, on, &spoken));
                if button.clicked() {
                    view.selected = if on { None } else { Some(slot) };
                }
            }
            let mut half_width_mm = m.muscle.half_width_mm;
            let drag = DragValue::new(&mut half_width_mm).range(0.5..=60.0).speed(0.1).max_decimals(1).suffix(" mm");
            let field = ui.add(drag).on_hover_text("Half the width of the band of fibres");
            field.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::SpinButton, true, format!("Half width of {}", m.muscle.id))
            });
            if field.changed() {
                let mirrored = view.mirrored;
                commands.push(Command::EditFace(DraftEdit::SetHalfWidth { muscle: i, half_width_mm, mirrored }));
            }
        });
        ui.add_space(2.0);
    }
}
