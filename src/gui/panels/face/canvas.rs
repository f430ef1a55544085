//! The face on its turntable: drawn, turned under the hand, its vertices clicked.

use egui::{Color32, FontId, Painter, Pos2, Rect, Role, Sense, Stroke, Vec2, WidgetInfo, pos2, vec2};

use super::{FaceView, look_from};
use crate::face::draft::{Bindings, DraftEdit, Slot};
use crate::gui::Command;
use crate::gui::face_drawing::{Look, picking};
use crate::gui::face_work::OpenFace;
use crate::gui::height_map::ink::Ink;
use crate::gui::orbit_view::{self, OrbitView, Projection, StandardView};
use crate::gui::theme::{self, on_picture};

/// Room round the face, points.
const MARGIN: f32 = 34.0;
/// Colours of the two ends of a muscle and of its fibre.
const ATTACHMENT: Color32 = Color32::from_rgb(235, 230, 210);
const INSERTION: Color32 = Color32::from_rgb(235, 80, 70);
const FIBRE: Color32 = Color32::from_rgb(196, 62, 58);

/// Shows the face in the whole of `ui`.
pub(super) fn show(ui: &mut egui::Ui, open: &OpenFace, view: &mut FaceView, commands: &mut Vec<Command>) {
    let canvas = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(canvas, Sense::click_and_drag());
    let p = theme::palette(ui.visuals());
    ui.painter().rect_filled(canvas, 0.0, p.canvas);
    let room = canvas.shrink(MARGIN);
    if room.width() < 40.0 || room.height() < 40.0 {
        return;
    }
    let corners = open.drawing.corners();
    let fit = |orbit: &OrbitView| orbit.project_into(room, corners.iter().copied());
    view.orbit.steer(ui, &response, look_from(StandardView::Oblique), &fit);
    let projection = fit(&view.orbit);
    view.shown = Some(projection);
    view.canvas_focused = orbit_view::keep_focus(ui, &response);

    let dark = ui.visuals().dark_mode;
    let look = Look {
        shaded: view.surface,
        wire: view.wireframe.then(|| match (view.surface, dark) {
            (true, _) => Color32::from_black_alpha(70),
            (false, true) => Color32::from_white_alpha(110),
            (false, false) => Color32::from_black_alpha(130),
        }),
        rim: rim(ui.visuals()),
        tones: if dark { [58.0, 196.0] } else { [120.0, 236.0] },
    };
    let painter = ui.painter_at(canvas);
    painter.add(egui::Shape::mesh(open.drawing.draw(&projection, &look, Ink::plain(ui.ctx()))));
    let bindings = open.draft.bindings();
    let pen = Pen { painter: &painter, open, projection: &projection, accent: p.accent };
    if view.muscles {
        for i in 0..bindings.muscles.len() {
            pen.muscle(bindings, i, view.selected);
        }
    }
    if view.marks {
        pen.landmarks(bindings, view);
    }

    let free = response.contains_pointer() && !ui.input(|i| i.pointer.any_down());
    let clicked = response.clicked().then(|| response.interact_pointer_pos()).flatten();
    let pointer = clicked.or_else(|| ui.input(|i| i.pointer.hover_pos()).filter(|_| free));
    view.hovered = pointer.and_then(|at| picking::pick(&open.drawing, open.draft.mesh(), &projection, at));
    if clicked.is_some() {
        click(bindings, view, commands);
    }
    if ui.input(|i| i.key_pressed(egui::Key::Escape)) && view.canvas_focused {
        view.selected = None;
    }
    if let Some(v) = view.hovered {
        pen.ring(v, 5.0, if dark { Color32::WHITE } else { Color32::BLACK });
        tooltip(&painter, canvas, open, v, &projection, dark);
    }
    if let Some(v) = view.selected.and_then(|s| bindings.vertex(s)) {
        pen.ring(v, 8.0, p.accent);
    }
    caption(&painter, canvas, bindings, view, ui.visuals());
    let words = format!("Face model, {} vertices", open.draft.mesh().len());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &words));
    name_bound(ui, &response, canvas, &pen, bindings);
}

/// Binds what is selected to the vertex under the pointer, or selects what is bound there.
fn click(bindings: &Bindings, view: &mut FaceView, commands: &mut Vec<Command>) {
    let Some(vertex) = view.hovered else { return };
    if let Some(slot) = view.selected {
        commands.push(Command::EditFace(DraftEdit::Bind { slot, vertex: Some(vertex), mirrored: view.mirrored }));
        // A thing bound for the first time leads to the next; one that is moved stays in hand.
        if bindings.vertex(slot).is_none() {
            view.go_on(bindings, slot);
        }
        return;
    }
    let landmark = bindings.landmarks.iter().position(|l| l.vertex == Some(vertex)).map(Slot::Landmark);
    let muscle = || {
        bindings.muscles.iter().enumerate().find_map(|(i, m)| match vertex {
            v if m.insertion == Some(v) => Some(Slot::Insertion(i)),
            v if m.attachment == Some(v) => Some(Slot::Attachment(i)),
            _ => None,
        })
    };
    if let Some(slot) = landmark.or_else(muscle) {
        view.selected = Some(slot);
        view.tab = if matches!(slot, Slot::Landmark(_)) { super::Tab::Landmarks } else { super::Tab::Muscles };
    }
}

/// What marks are drawn with.
struct Pen<'a> {
    painter: &'a Painter,
    open: &'a OpenFace,
    projection: &'a Projection,
    accent: Color32,
}

impl Pen<'_> {
    fn at(&self, vertex: u32) -> Pos2 {
        self.open.drawing.place(self.projection, vertex as usize).0
    }

    /// What lies on the far side is drawn faintly.
    fn strength(&self, vertex: u32) -> f32 {
        if self.open.drawing.faces_eye(self.projection, vertex as usize) { 1.0 } else { 0.3 }
    }

    fn ring(&self, vertex: u32, radius: f32, colour: Color32) {
        let at = self.at(vertex);
        self.painter.circle_stroke(at, radius, Stroke::new(3.5, on_picture::HALO));
        self.painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
    }

    fn muscle(&self, bindings: &Bindings, i: usize, selected: Option<Slot>) {
        let m = &bindings.muscles[i];
        let chosen = matches!(selected, Some(Slot::Attachment(s) | Slot::Insertion(s)) if s == i);
        if let (Some(a), Some(b)) = (m.attachment, m.insertion) {
            let strength = self.strength(a).max(self.strength(b));
            let ends = [self.at(a), self.at(b)];
            let across = (ends[1] - ends[0]).rot90();
            if chosen && across.length() > 1.0 {
                let half = across.normalized() * (m.muscle.half_width_mm * self.projection.points_per_mm) as f32;
                let band = vec![ends[0] - half, ends[0] + half, ends[1] + half, ends[1] - half];
                let rim = Stroke::new(1.0, FIBRE);
                self.painter.add(egui::Shape::convex_polygon(band, FIBRE.gamma_multiply(0.28), rim));
            }
            let width = if chosen { 3.4 } else { 2.2 };
            self.painter.line_segment(ends, Stroke::new(width + 1.6, on_picture::HALO.gamma_multiply(strength)));
            self.painter.line_segment(ends, Stroke::new(width, FIBRE.gamma_multiply(strength)));
        }
        if let Some(v) = m.attachment {
            let square = Rect::from_center_size(self.at(v), Vec2::splat(6.5));
            self.painter.rect_filled(square.expand(1.0), 0.0, on_picture::HALO.gamma_multiply(self.strength(v)));
            self.painter.rect_filled(square, 0.0, ATTACHMENT.gamma_multiply(self.strength(v)));
        }
        if let Some(v) = m.insertion {
            self.painter.circle_filled(self.at(v), 4.2, on_picture::HALO.gamma_multiply(self.strength(v)));
            self.painter.circle_filled(self.at(v), 3.2, INSERTION.gamma_multiply(self.strength(v)));
        }
    }

    fn landmarks(&self, bindings: &Bindings, view: &FaceView) {
        for (i, l) in bindings.landmarks.iter().enumerate() {
            let Some(v) = l.vertex else { continue };
            let (at, strength) = (self.at(v), self.strength(v));
            self.painter.circle_filled(at, 5.0, on_picture::HALO.gamma_multiply(strength));
            self.painter.circle_filled(at, 3.8, on_picture::LANDMARK.gamma_multiply(strength));
            let chosen = view.selected == Some(Slot::Landmark(i));
            if (view.names && strength > 0.5) || chosen {
                crate::gui::panels::frames::marks::name(self.painter, at, &l.landmark.name);
            }
        }
        if let Some(v) = view.selected.and_then(|s| bindings.partner(s)).and_then(|s| bindings.vertex(s))
            && view.mirrored
        {
            self.painter.circle_stroke(self.at(v), 7.0, Stroke::new(1.2, self.accent));
        }
    }
}

/// The vertex under the pointer: its number, its place, and what is bound to it.
fn tooltip(painter: &Painter, canvas: Rect, open: &OpenFace, vertex: u32, projection: &Projection, dark: bool) {
    let bindings = open.draft.bindings();
    let x = open.draft.mesh().positions()[vertex as usize];
    let mut lines = vec![format!("vertex {vertex}   {:.1}, {:.1}, {:.1} mm", x.x, x.y, x.z).replace('-', "−")];
    lines.extend(bindings.landmarks.iter().filter(|l| l.vertex == Some(vertex)).map(|l| l.landmark.name.clone()));
    for m in &bindings.muscles {
        for (end, bound) in [("bone end", m.attachment), ("skin end", m.insertion)] {
            if bound == Some(vertex) {
                lines.push(format!("{end} of {}", m.muscle.id));
            }
        }
    }
    let (ink, paper) =
        if dark { (Color32::BLACK, Color32::from_gray(235)) } else { (Color32::WHITE, Color32::from_gray(30)) };
    let galley = painter.layout_no_wrap(lines.join("\n"), FontId::proportional(12.0), ink);
    let at = open.drawing.place(projection, vertex as usize).0;
    let size = galley.size() + vec2(12.0, 8.0);
    let left = if at.x + 14.0 + size.x < canvas.right() { at.x + 14.0 } else { at.x - 14.0 - size.x };
    let rect = Rect::from_min_size(pos2(left, (at.y - size.y - 8.0).max(canvas.top() + 4.0)), size);
    painter.rect_filled(rect, 4.0, paper.gamma_multiply(0.94));
    painter.galley(rect.min + vec2(6.0, 4.0), galley, ink);
}

/// What a click does now, and the signs of the drawing.
fn caption(painter: &Painter, canvas: Rect, bindings: &Bindings, view: &FaceView, visuals: &egui::Visuals) {
    let words = match view.selected {
        Some(slot) => format!("A click binds the {}", bindings.slot_name(slot).replace('_', " ")),
        None => "Choose a landmark or the end of a muscle, then click its vertex".to_owned(),
    };
    let at = canvas.min + vec2(14.0, 10.0);
    painter.text(at, egui::Align2::LEFT_TOP, words, FontId::proportional(13.0), visuals.text_color());
    let y = canvas.bottom() - 16.0;
    let mut x = canvas.left() + 18.0;
    let font = FontId::proportional(11.5);
    let signs: [(&str, &dyn Fn(Pos2)); 4] = [
        ("landmark", &|at| {
            painter.circle_filled(at, 5.0, on_picture::HALO);
            painter.circle_filled(at, 3.8, on_picture::LANDMARK);
        }),
        ("bone end", &|at| {
            let square = Rect::from_center_size(at, Vec2::splat(6.5));
            painter.rect_filled(square.expand(1.0), 0.0, on_picture::HALO);
            painter.rect_filled(square, 0.0, ATTACHMENT);
        }),
        ("skin end", &|at| {
            painter.circle_filled(at, 4.2, on_picture::HALO);
            painter.circle_filled(at, 3.2, INSERTION);
        }),
        ("rim and openings", &|at| _ = painter.hline(at.x - 6.0..=at.x + 5.0, at.y, Stroke::new(1.6, rim(visuals)))),
    ];
    for (word, sign) in signs {
        sign(pos2(x, y));
        let written =
            painter.text(pos2(x + 11.0, y), egui::Align2::LEFT_CENTER, word, font.clone(), visuals.weak_text_color());
        x = written.right() + 20.0;
    }
}

fn rim(visuals: &egui::Visuals) -> Color32 {
    if visuals.dark_mode { Color32::from_rgb(255, 196, 84) } else { Color32::from_rgb(150, 70, 10) }
}

/// A node for the screen reader, and for tests, on every landmark and muscle end that can be seen.
fn name_bound(ui: &egui::Ui, response: &egui::Response, canvas: Rect, pen: &Pen<'_>, bindings: &Bindings) {
    let landmarks = (0..bindings.landmarks.len()).map(Slot::Landmark);
    let ends = (0..bindings.muscles.len()).flat_map(|i| [Slot::Attachment(i), Slot::Insertion(i)]);
    for slot in landmarks.chain(ends) {
        let Some(v) = bindings.vertex(slot) else { continue };
        let at = pen.at(v);
        if !canvas.contains(at) {
            continue;
        }
        let id = response.id.with(("slot", slot));
        let node = ui.interact(Rect::from_center_size(at, Vec2::splat(8.0)), id, Sense::hover());
        let name = format!("{}, vertex {v}", bindings.slot_name(slot));
        node.widget_info(|| WidgetInfo::labeled(Role::GraphicsSymbol, true, &name));
    }
}
