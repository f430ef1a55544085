//! The face that moves, on its turntable.

use std::fmt::Write as _;

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::{ExpressionsView, Paint};
use crate::draw::ColourMap;
use crate::draw::numbers::fixed;
use crate::expression::Shown;
use crate::gui::expression_work::{ExpressionWork, Ready};
use crate::gui::face_drawing::{Look, picking};
use crate::gui::height_map::ink::{Ink, Inks};
use crate::gui::height_map::palette::ColourCurve;
use crate::gui::height_map::range::round_up;
use crate::gui::height_map::{ColourRange, Layer, Palette, RangeMode};
use crate::gui::orbit_view::{self, OrbitView, Projection, StandardView};
use crate::gui::panels::face::look_from;
use crate::gui::panels::forces::colour_bar;
use crate::gui::{Action, Command, Focus, theme};
use crate::project::PointId;

/// Room round the face, points.
const MARGIN: f32 = 26.0;

/// Shows the face in the whole of `ui`.
pub(super) fn show(
    ui: &mut Ui,
    work: &ExpressionWork,
    ready: &Ready,
    places_in_first: Option<&[Pos2]>,
    view: &mut ExpressionsView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let canvas = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(canvas, Sense::click_and_drag());
    let values = match view.paint {
        Paint::Value(shown) => Some(coloured(ready, shown, view)),
        Paint::Plain | Paint::Texture => None,
    };
    let signed = values.as_ref().is_some_and(|(layer, _)| layer.signed);
    let inks = Inks::new(ui.visuals(), signed);
    let p = theme::palette(ui.visuals());
    let painter = ui.painter_at(canvas);
    painter.rect_filled(canvas, 0.0, p.canvas);
    let room = canvas.shrink(MARGIN);
    if room.width() < 40.0 || room.height() < 40.0 {
        return;
    }
    let corners = ready.drawing.corners();
    let fit = |orbit: &OrbitView| orbit.project_into(room, corners.iter().copied());
    view.orbit.steer(ui, &response, look_from(StandardView::Front), &fit);
    let projection = fit(&view.orbit);
    view.shown = Some(projection);
    view.canvas_focused = orbit_view::keep_focus(ui, &response);

    let texture = work.texture().map(egui::TextureHandle::id).zip(places_in_first);
    let texture = texture.filter(|_| view.paint == Paint::Texture);
    let colours: Option<Vec<Color32>> =
        values.as_ref().map(|(layer, palette)| layer.values.iter().map(|v| palette.colour(v.unwrap_or(0.0))).collect());
    draw(ui, &painter, ready, &projection, view, colours.as_deref(), texture);

    if let Some((layer, palette)) = &values {
        colour_bar::show(&painter, canvas, layer, palette, RangeMode::Auto, &inks);
    }
    let free = response.contains_pointer() && !ui.input(|i| i.pointer.any_down());
    let clicked = response.clicked().then(|| response.interact_pointer_pos()).flatten();
    let pointer = clicked.or_else(|| ui.input(|i| i.pointer.hover_pos()).filter(|_| free));
    let hovered = pointer.and_then(|at| picking::pick(&ready.drawing, ready.face.mesh(), &projection, at));
    if let Some(v) = hovered {
        focus.hover(v);
    }
    if clicked.is_some() {
        commands.push(Command::Select(hovered.map(PointId::FeatureLast)));
    }
    let known = |v: &u32| (*v as usize) < ready.rest.len();
    if let Some(v) = focus.selected_vertex().filter(known) {
        ring(&painter, ready, &projection, v, 7.0, inks.selected);
    }
    if let Some(v) = hovered.or(focus.hovered()).filter(known) {
        ring(&painter, ready, &projection, v, 5.0, inks.hovered);
        tooltip(&painter, canvas, ready, v, view, &projection, ui.visuals().dark_mode);
    }
    caption(&painter, canvas, view, ui.visuals());
    let words = format!("Moving face, {} vertices", ready.rest.len());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &words));
    if ready.failure.is_some() {
        failure(ui, canvas, ready, &projection, commands);
    }
}

fn draw(
    ui: &Ui,
    painter: &Painter,
    ready: &Ready,
    projection: &Projection,
    view: &ExpressionsView,
    colours: Option<&[Color32]>,
    texture: Option<(egui::TextureId, &[Pos2])>,
) {
    let dark = ui.visuals().dark_mode;
    let wire = Color32::from_black_alpha(if texture.is_some() { 90 } else { 70 });
    let look = Look {
        shaded: true,
        wire: view.wireframe.then_some(wire),
        rim: wire,
        tones: if dark { [64.0, 214.0] } else { [112.0, 240.0] },
    };
    let drawing = &ready.drawing;
    if let Some((id, places)) = texture {
        painter.add(Shape::mesh(ready.openings.draw_textured(drawing, projection, id, places)));
        painter.add(Shape::mesh(drawing.draw_textured(projection, id, places)));
        if view.wireframe {
            let lines = Look { shaded: false, ..look };
            painter.add(Shape::mesh(drawing.draw(projection, &lines, Ink::plain(ui.ctx()))));
        }
        return;
    }
    painter.add(Shape::mesh(ready.openings.draw(drawing, projection, Ink::plain(ui.ctx()))));
    painter.add(Shape::mesh(drawing.draw_in_colours(projection, &look, colours, Ink::plain(ui.ctx()))));
}

/// The value of every vertex with its colours. The range grows with what is shown, so that it does not flicker, and begins anew with the play.
fn coloured(ready: &Ready, shown: Shown, view: &mut ExpressionsView) -> (Layer, Palette) {
    let values = shown.values(ready.face.mesh(), &ready.rest, &ready.positions, &ready.loads);
    let layer = Layer {
        title: shown.label().to_owned(),
        short: shown.label(),
        unit: shown.unit(),
        signed: shown.is_signed(),
        values: values.into_iter().map(|v| v.is_finite().then_some(v)).collect(),
        sigma: None,
        sets_range: vec![true; ready.rest.len()],
    };
    if view.most.0 != shown || ready.time_s == 0.0 {
        view.most = (shown, 0.0);
    }
    let most = crate::draw::robust_range::robust_largest(layer.values.iter().flatten().copied());
    view.most.1 = view.most.1.max(most);
    let high = if view.most.1 > 1e-6 { round_up(view.most.1) } else { 1.0 };
    let range = ColourRange::new(if layer.signed { -high } else { 0.0 }, high);
    let map = if layer.signed { ColourMap::CoolWarm } else { ColourMap::Viridis };
    let palette = Palette { map, range, curve: ColourCurve::Linear, signed: layer.signed };
    (layer, palette)
}

fn ring(painter: &Painter, ready: &Ready, projection: &Projection, vertex: u32, radius: f32, colour: Color32) {
    let at = ready.drawing.place(projection, vertex as usize).0;
    painter.circle_stroke(at, radius, Stroke::new(3.5, theme::on_picture::HALO));
    painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
}

/// The vertex under the pointer with its values.
fn tooltip(
    painter: &Painter,
    canvas: Rect,
    ready: &Ready,
    vertex: u32,
    view: &ExpressionsView,
    projection: &Projection,
    dark: bool,
) {
    let mesh = ready.face.mesh();
    let value = |shown: Shown| shown.values(mesh, &ready.rest, &ready.positions, &ready.loads)[vertex as usize];
    let mut lines = vec![format!("vertex {vertex}")];
    if let Some(l) = ready.face.landmarks().iter().find(|l| l.vertex == vertex) {
        let _ = write!(lines[0], "   {}", l.name);
    }
    for shown in Shown::ALL {
        let digits = if shown == Shown::Force { 3 } else { 1 };
        let mark = if view.paint == Paint::Value(shown) { "▸ " } else { "" };
        lines.push(format!("{mark}{} {} {}", shown.label().to_lowercase(), fixed(value(shown), digits), shown.unit()));
    }
    let (ink, paper) =
        if dark { (Color32::BLACK, Color32::from_gray(235)) } else { (Color32::WHITE, Color32::from_gray(30)) };
    let galley = painter.layout_no_wrap(lines.join("\n"), FontId::proportional(12.0), ink);
    let at = ready.drawing.place(projection, vertex as usize).0;
    let size = galley.size() + vec2(12.0, 8.0);
    let left = if at.x + 14.0 + size.x < canvas.right() { at.x + 14.0 } else { at.x - 14.0 - size.x };
    let rect = Rect::from_min_size(pos2(left, (at.y - size.y - 8.0).max(canvas.top() + 4.0)), size);
    painter.rect_filled(rect, 4.0, paper.gamma_multiply(0.94));
    painter.galley(rect.min + vec2(6.0, 4.0), galley, ink);
}

fn caption(painter: &Painter, canvas: Rect, view: &ExpressionsView, visuals: &egui::Visuals) {
    let percent = fixed(100.0 * view.intensity, 0);
    let words = format!("{}, {percent} %", view.expression.name);
    painter.text(
        canvas.min + vec2(14.0, 10.0),
        Align2::LEFT_TOP,
        words,
        FontId::proportional(15.0),
        visuals.text_color(),
    );
}

/// Why it stands still, where, and what to do.
fn failure(ui: &mut Ui, canvas: Rect, ready: &Ready, projection: &Projection, commands: &mut Vec<Command>) {
    let Some(failure) = &ready.failure else { return };
    let p = theme::palette(ui.visuals());
    if failure.vertex < ready.rest.len() {
        ring(&ui.painter_at(canvas), ready, projection, failure.vertex as u32, 9.0, p.warn);
    }
    let width = (canvas.width() - 60.0).clamp(160.0, 460.0);
    let place = Rect::from_min_size(pos2(canvas.center().x - width / 2.0, canvas.top() + 44.0), vec2(width, 60.0));
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(place));
    egui::Frame::popup(child.style()).show(&mut child, |ui| {
        ui.set_width(width - 24.0);
        ui.horizontal_wrapped(|ui| {
            ui.colored_label(p.warn, "The play has stopped.");
        });
        ui.label(failure.to_string());
        if let Some(triangle) = failure.triangle {
            ui.label(format!("Triangle {triangle} has turned over there."));
        }
        if ui.button("Reset").clicked() {
            commands.push(Command::Do(Action::ResetPlay));
        }
    });
}
