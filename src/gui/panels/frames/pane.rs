//! One frame in its pane: the picture, the wireframe and the points over it.

use std::collections::BTreeSet;

use egui::{Color32, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Sense, Stroke, Vec2};

use super::doubt_marks;
use super::drag::{self, Target};
use super::image_view::{ImageView, Transform};
use super::loupe::{self, Loupe};
use super::points::{self, ShownPoint};
use super::{FramesView, Tool, guide, marks, pane_message, replay, wireframe};
use crate::camera::Scale;
use crate::gui::action::Menu;
use crate::gui::action_state::ActionState;
use crate::gui::face_drawing::FaceDrawing;
use crate::gui::keys::{self, Hold};
use crate::gui::panels::menu;
use crate::gui::pictures::Picture;
use crate::gui::suggesting::{ON_CROSSING_PX, crossing_words};
use crate::gui::theme::{self, on_picture};
use crate::gui::{Command, Focus, Scene, snapping, wheel};
use crate::project::{PointId, Which};
use crate::suggest::Refined;

/// How near to a point a press must be to take it, ui points.
pub const REACH: f32 = 8.0;

/// Points as near as this to the pointer lie over each other: their marks touch, ui points.
const OVERLAP: f32 = 4.0;

/// What a pane knows while it is shown.
pub struct Pane<'a> {
    /// What may be read.
    pub scene: Scene<'a>,
    /// The face ready for drawing.
    pub drawing: &'a FaceDrawing,
    /// Which frame it shows.
    pub which: Which,
    /// Its picture.
    pub picture: &'a Picture,
    /// Where it is on the screen.
    pub rect: Rect,
    /// Pixels to the screen.
    pub transform: Transform,
    /// Its points.
    pub points: Vec<ShownPoint>,
    /// Points are being marked again here without sight of the first marks: nothing may show where they are.
    pub blind: bool,
}

impl Pane<'_> {
    /// The point that a press takes: of those of the tool within reach the selected one, or else the nearest; a mark
    /// wins over a prediction as near.
    pub fn pick(&self, at: Pos2, tool: Tool, selected: Option<&PointId>) -> Option<&ShownPoint> {
        let vertex = selected.and_then(|id| points::place(self.scene, id)).map(|(_, v)| v);
        let rank = |p: &ShownPoint| {
            let d = self.transform.ui_from_image(p.at).distance(at);
            let same_point = selected == Some(&p.id);
            let same_vertex = tool != Tool::Select && vertex == Some(p.vertex);
            let d = if p.look.is_mark() { d - 2.0 } else { d };
            (!same_point, !same_vertex, d)
        };
        self.points
            .iter()
            .filter(|p| tool.takes(p.kind) && self.transform.ui_from_image(p.at).distance(at) <= REACH)
            .map(|p| (rank(p), p))
            .min_by(|(a, _), (b, _)| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)))
            .map(|(_, p)| p)
    }

    /// The point that another click at this place selects: the next of those that overlap there, round and round.
    pub fn behind(&self, point: &ShownPoint, at: Pos2, tool: Tool) -> Option<&ShownPoint> {
        let i = self.points.iter().position(|p| p.id == point.id)?;
        let others = self.points[i + 1..].iter().chain(&self.points[..i]);
        others.into_iter().find(|p| tool.takes(p.kind) && self.transform.ui_from_image(p.at).distance(at) <= OVERLAP)
    }
}

/// Shows one frame in `rect`.
#[expect(clippy::too_many_arguments, reason = "what a panel may read, its own view, and the commands")]
pub fn show(
    ui: &mut egui::Ui,
    rect: Rect,
    scene: Scene<'_>,
    drawing: &FaceDrawing,
    which: Which,
    picture: &Picture,
    chosen: &[u32],
    state: &ActionState,
    view: &mut FramesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let id = ui.scope_id().with(("pane", which.word()));
    let response = ui.interact(rect, id, Sense::click_and_drag());
    let name = if which == Which::First { "First frame" } else { "Last frame" };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, name));
    view.canvases.retain(|c| *c != response.id);
    view.canvases.push(response.id);
    keep_keyboard(ui, &response, view, which);
    view.panes[which as usize].rect = rect;

    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 0.0, theme::palette(ui.visuals()).canvas);
    let Some(size) = picture.size() else {
        pane_message::without_picture(ui, rect, which, picture, commands);
        return;
    };
    if view.panes[which as usize].view.fitted {
        view.panes[which as usize].view = ImageView::fit(size, rect);
    }
    navigate(ui, &response, which, view);

    let mut pane = Pane {
        scene,
        drawing,
        which,
        picture,
        rect,
        transform: view.panes[which as usize].view.at(rect),
        points: points::in_frame(scene, which, chosen, view.tool),
        blind: view.doubt.again.is_some() && which == Which::Last,
    };
    if pane.blind || !view.show_marks && view.drag.is_none() {
        pane.points.clear();
    }
    let space = keys::is_held(ui.ctx(), Hold::Pan);
    if !space {
        drag::handle(ui, &response, &pane, chosen, view, focus, commands);
    }
    response.context_menu(|ui| menu::entries(ui, Menu::Point, state, commands));
    if !pane.blind {
        hover(ui, &response, &pane, view.tool, focus);
    }
    cursor(ui, &response, &pane, view, space);

    let only: Option<BTreeSet<u32>> = view.wireframe.region_only.then(|| chosen.iter().copied().collect());
    paint(&painter, &pane, view, focus, only.as_ref());
    if !matches!(picture.status(), crate::gui::pictures::PictureStatus::Ready { changed: false }) {
        pane_message::over_picture(ui, rect, which, picture, commands);
    }
    replay::card(ui, &pane, view);
    paint_loupe(ui, &response, &painter, &pane, view, focus, only.as_ref());
    let press = view.tool.places_in(which).then(|| guide::what_a_press_does(scene, chosen, view, focus)).flatten();
    let again = view.doubt.again.as_ref().filter(|_| pane.blind);
    let press = again.map(|a| format!("press marks again: point {} of {}", a.done + 1, a.points.len())).or(press);
    let tone = if view.tool == Tool::Landmarks { on_picture::LANDMARK } else { on_picture::FEATURE };
    caption(&painter, rect, name, press.map(|p| (p, tone)), view.active == which);
    name_points(ui, id, &pane, view, focus);
}

/// The active pane has the keyboard whenever no other widget has it, and then keeps arrows and Tab to itself.
fn keep_keyboard(ui: &egui::Ui, response: &Response, view: &FramesView, which: Which) {
    let free = ui.memory(|m| m.focused().is_none() && m.top_modal_layer().is_none());
    if view.active == which && free && ui.is_enabled() {
        response.request_focus();
    }
    let filter = egui::EventFilter { tab: true, horizontal_arrows: true, vertical_arrows: true, escape: true };
    ui.memory_mut(|m| m.set_focus_lock_filter(response.id, filter));
}

/// Wheel and pinch zoom at the pointer; middle drag, or Space and drag, pans; double click on nothing fits.
fn navigate(ui: &egui::Ui, response: &Response, which: Which, view: &mut FramesView) {
    let pointer = response.hover_pos();
    if let Some(at) = pointer {
        let factor = wheel::zoom_factor(ui);
        if (factor - 1.0).abs() > 1e-6 {
            view.zoom(which, factor, at);
        }
    }
    let space = keys::is_held(ui.ctx(), Hold::Pan);
    let panning = response.dragged_by(PointerButton::Middle) || (space && response.dragged_by(PointerButton::Primary));
    if panning && view.drag.is_none() {
        view.pan(which, response.drag_delta());
    }
}

/// Lights up the point under the pointer everywhere, or else the vertex of the wireframe there.
fn hover(ui: &egui::Ui, response: &Response, pane: &Pane<'_>, tool: Tool, focus: &mut Focus) {
    let Some(at) = response.hover_pos() else { return };
    if ui.input(|i| i.pointer.any_down()) {
        return;
    }
    if let Some(point) = pane.pick(at, tool, focus.selected.as_ref()) {
        focus.hover(point.vertex);
        return;
    }
    let near = |(v, p): (usize, [f64; 2])| {
        let d = pane.transform.ui_from_image(p).distance(at);
        (d <= REACH).then_some((v, d))
    };
    // Before landmarks say where the face is, its vertices are nowhere.
    if pane.scene.project.landmarks.len() < points::LANDMARKS_TO_PREDICT {
        return;
    }
    let vertices = (0..pane.scene.face.mesh().len()).map(|v| (v, points::predicted(pane.scene, pane.which, v as u32)));
    if let Some((v, _)) = vertices.filter_map(near).min_by(|a, b| a.1.total_cmp(&b.1)) {
        focus.hover(v as u32);
    }
}

fn cursor(ui: &egui::Ui, response: &Response, pane: &Pane<'_>, view: &FramesView, space: bool) {
    let Some(at) = response.hover_pos() else { return };
    let (middle, takes) = ui.input(|i| (i.pointer.middle_down(), i.modifiers.command));
    let icon = if space || middle {
        CursorIcon::Grabbing
    } else if view.drag.is_some() || (view.tool.places_in(pane.which) && !takes) {
        CursorIcon::Crosshair
    } else if pane.pick(at, view.tool, None).is_some() {
        CursorIcon::Move
    } else {
        CursorIcon::Default
    };
    ui.ctx().set_cursor_icon(icon);
}

fn paint(painter: &Painter, pane: &Pane<'_>, view: &FramesView, focus: &Focus, only: Option<&BTreeSet<u32>>) {
    let t = pane.transform;
    pane.picture.tiles().paint(painter, |p| t.ui_from_image(p));
    let outcome = pane.scene.outcome;
    let vertices = if pane.which == Which::First { &outcome.first_in_image } else { &outcome.last_in_image };
    // Without landmarks the wireframe lies anywhere but on the face.
    if view.show_marks && !pane.blind && pane.scene.project.landmarks.len() >= points::LANDMARKS_TO_PREDICT {
        let (face, levels) = (pane.scene.face, pane.drawing.levels());
        let points_per_mm = outcome.camera.px_per_mm * t.zoom;
        wireframe::paint(painter, face, levels, vertices, only, &view.wireframe, points_per_mm, |p| t.ui_from_image(p));
    }
    if pane.which == Which::First {
        paint_scale(painter, pane, view);
    }
    let radius = marks::radius(spacing(pane));
    let mut selected = None;
    for point in &pane.points {
        let at = t.ui_from_image(point.at);
        if !painter.clip_rect().expand(16.0).contains(at) {
            continue;
        }
        let is_selected = focus.selected.as_ref() == Some(&point.id);
        let same_vertex = focus.selected_vertex() == Some(point.vertex) || focus.hovered() == Some(point.vertex);
        if is_selected {
            selected = Some(point);
        } else {
            let lit = if same_vertex { marks::Lit::Hovered } else { marks::Lit::No };
            marks::paint(painter, at, radius, point.look, point.kind, lit, point.sure);
        }
        let told = point.look == points::Look::Suggested && focus.hovered() == Some(point.vertex);
        if (view.show_names || told) && !is_selected {
            marks::name(painter, at, &point.title());
        }
    }
    if let Some(point) = selected {
        let at = t.ui_from_image(point.at);
        marks::paint(painter, at, radius, point.look, point.kind, marks::Lit::Selected, point.sure);
        // While points are placed the guide names them, and a name here would hide what is looked for.
        if view.tool == Tool::Select || view.show_names {
            marks::name(painter, at, &point.title());
        }
    }
    if pane.blind {
        return;
    }
    doubt_marks::paint(painter, pane, view, focus);
    replay::paint(painter, pane, view, focus);
    let shown = |v: u32| pane.points.iter().any(|p| p.vertex == v);
    let known = pane.scene.project.landmarks.len() >= points::LANDMARKS_TO_PREDICT;
    if let Some(v) = focus.hovered().filter(|v| known && !shown(*v)) {
        let p = points::predicted(pane.scene, pane.which, v);
        painter.circle_stroke(t.ui_from_image(p), 5.0, Stroke::new(3.0, on_picture::HALO));
        painter.circle_stroke(t.ui_from_image(p), 5.0, Stroke::new(1.5, on_picture::SELECTED));
    }
    if let Some((from, found)) = moved_by_itself(pane, view) {
        snapping::paint(painter, from, &found, |p| t.ui_from_image(p));
    }
    if let Some(point) = selected_besides(pane, view.tool, focus) {
        let at = t.ui_from_image(point.at);
        marks::paint(painter, at, radius, point.look, point.kind, marks::Lit::Selected, point.sure);
        if view.tool == Tool::Select || view.show_names {
            marks::name(painter, at, &point.name);
        }
    }
}

/// The selected vertex where this pane would not show it: it has no mark here, and is not among those to mark. While landmarks are
/// placed the last frame has nothing to say.
fn selected_besides(pane: &Pane<'_>, tool: Tool, focus: &Focus) -> Option<ShownPoint> {
    let scene = pane.scene;
    if tool == Tool::Landmarks || pane.blind {
        return None;
    }
    let (_, vertex) = points::place(scene, focus.selected.as_ref()?)?;
    let known = scene.project.landmarks.len() >= points::LANDMARKS_TO_PREDICT;
    if !known || pane.points.iter().any(|p| p.vertex == vertex) {
        return None;
    }
    let landmark = scene.face.landmarks().iter().find(|l| focus.selected == Some(PointId::Landmark(l.id.clone())));
    Some(ShownPoint {
        id: if pane.which == Which::First { PointId::FeatureFirst(vertex) } else { PointId::FeatureLast(vertex) },
        vertex,
        at: points::predicted(scene, pane.which, vertex),
        look: points::Look::Predicted,
        kind: if landmark.is_some() { points::Kind::Landmark } else { points::kind_of(scene, vertex) },
        label: vertex.to_string(),
        name: landmark.map_or_else(|| vertex.to_string(), |l| l.name.clone()),
        sure: 1.0,
    })
}

/// What has gone to a place of its own accord in this pane: what is in the hand, or else the last mark, as long as it lies there. With it
/// where the hand had put it, px.
fn moved_by_itself(pane: &Pane<'_>, view: &FramesView) -> Option<([f64; 2], Refined)> {
    if let Some(drag) = view.drag.as_ref().filter(|d| d.which == pane.which) {
        return drag.snapped.map(|found| (drag.at, found));
    }
    let trace = view.trace.as_ref()?;
    let (which, _) = points::place(pane.scene, &trace.id)?;
    let mark = crate::project::edit::mark(pane.scene.project, &trace.id)?;
    (which == pane.which && mark.at_px == trace.to() && view.show_marks).then_some((trace.from, trace.found))
}

/// How far neighbouring vertices lie apart on the screen, ui points.
fn spacing(pane: &Pane<'_>) -> f32 {
    let px = pane.scene.outcome.camera.px_per_mm * pane.drawing.levels().finest().spacing_mm;
    (px * pane.transform.zoom) as f32
}

/// The two points of the scale, with a line between them.
fn paint_scale(painter: &Painter, pane: &Pane<'_>, view: &FramesView) {
    let ends = match (&view.tool, pane.scene.project.scale) {
        (Tool::ScalePoints { first: Some(a), .. }, _) => vec![*a],
        (_, Scale::TwoPoints { a_px, b_px, .. } | Scale::GridPitch { a_px, b_px, .. }) => vec![a_px, b_px],
        _ => return,
    };
    let places: Vec<Pos2> = ends.iter().map(|p| pane.transform.ui_from_image(*p)).collect();
    for stroke in [Stroke::new(4.0, on_picture::HALO), Stroke::new(1.6, on_picture::SCALE)] {
        if let [a, b] = places[..] {
            painter.line_segment([a, b], stroke);
        }
        for &at in &places {
            painter.line_segment([at - Vec2::splat(5.0), at + Vec2::splat(5.0)], stroke);
            painter.line_segment([at - Vec2::new(5.0, -5.0), at + Vec2::new(5.0, -5.0)], stroke);
        }
    }
}

fn paint_loupe(
    ui: &egui::Ui,
    response: &Response,
    painter: &Painter,
    pane: &Pane<'_>,
    view: &FramesView,
    focus: &Focus,
    only: Option<&BTreeSet<u32>>,
) {
    let dragged = view.drag.as_ref().filter(|d| d.which == pane.which && d.began);
    let (at, colour) = match (dragged, response.hover_pos()) {
        (Some(d), _) => match &d.target {
            Target::Point(id) => (d.mark(), colour_of(pane, id)),
            Target::ScaleEnd(_) => (d.mark(), on_picture::SCALE),
            Target::Again(_) => (d.mark(), on_picture::FEATURE),
        },
        (None, Some(pointer)) if view.loupe.always && !ui.input(|i| i.pointer.any_down()) => (
            pane.transform.image_from_ui(pointer),
            focus.selected.as_ref().map_or(Color32::WHITE, |id| colour_of(pane, id)),
        ),
        _ => return,
    };
    let outcome = pane.scene.outcome;
    let in_image = if pane.which == Which::First { &outcome.first_in_image } else { &outcome.last_in_image };
    let hidden = wireframe::WireframeStyle { visible: false, ..view.wireframe };
    let shown = Loupe {
        tiles: pane.picture.tiles(),
        face: pane.scene.face,
        levels: pane.drawing.levels(),
        px_per_mm: outcome.camera.px_per_mm,
        in_image,
        only,
        wireframe: if pane.blind { &hidden } else { &view.wireframe },
        at,
        colour,
        crossing: pane.scene.suggested.crossing_at(pane.which, at, ON_CROSSING_PX).map(crossing_words),
        snapped: dragged.and_then(|d| d.snapped.map(|found| (d.at, found))),
    };
    loupe::paint(painter, pane.rect, pane.transform.ui_from_image(at), view.loupe, &shown);
}

fn colour_of(pane: &Pane<'_>, id: &PointId) -> Color32 {
    pane.points.iter().find(|p| &p.id == id).map_or(on_picture::LANDMARK, |p| marks::colour(p.kind))
}

/// The name of the frame; while a tool places something here, also what a press does.
fn caption(painter: &Painter, rect: Rect, name: &str, press: Option<(String, Color32)>, active: bool) {
    let font = egui::FontId::proportional(12.0);
    let mut at = rect.left_top() + Vec2::new(10.0, 8.0);
    let colour = if active { Color32::WHITE } else { Color32::from_gray(205) };
    for (text, colour) in std::iter::once((name.to_owned(), colour)).chain(press) {
        let mut job = egui::text::LayoutJob::simple_singleline(text, font.clone(), colour);
        job.wrap = egui::text::TextWrapping::truncate_at_width((rect.right() - at.x - 16.0).max(40.0));
        let galley = painter.layout_job(job);
        let behind = Rect::from_min_size(at, galley.size()).expand2(Vec2::new(6.0, 3.0));
        painter.rect_filled(behind, 4.0, Color32::from_black_alpha(170));
        at.x = behind.right() + 12.0;
        painter.galley(behind.min + Vec2::new(6.0, 3.0), galley, colour);
    }
}

/// Gives every point a name that a screen reader, and a test, can find.
fn name_points(ui: &egui::Ui, pane_id: egui::Id, pane: &Pane<'_>, view: &FramesView, focus: &Focus) {
    for point in pane.points.iter().chain(&selected_besides(pane, view.tool, focus)) {
        let at = pane.transform.ui_from_image(point.at);
        if !pane.rect.contains(at) {
            continue;
        }
        let rect = Rect::from_center_size(at, Vec2::splat(2.0 * REACH));
        let response =
            ui.interact(rect, pane_id.with(&point.label).with(point.kind == points::Kind::Landmark), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsSymbol, true, point.spoken(pane.which)));
    }
}
