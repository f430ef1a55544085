//! The canvas of the height map: draws it, turns it under the hand, and tells which vertex the pointer means.

use std::sync::Arc;

use egui::{FontId, Painter, Pos2, Rect, Role, Sense, Stroke, Vec2, WidgetInfo, pos2, vec2};

use super::findings::Findings;
use super::prepared::{Drawn, DrawnFrom, Prepared, Sight};
use super::{ForcesView, colour_bar, legend, select, vertex_name};
use crate::displacement::VertexState;
use crate::draw::ticks::nice_ticks;
use crate::gui::height_map::axes::{self, HeightAxis};
use crate::gui::height_map::ink::{Ink, Inks};
use crate::gui::height_map::mesh_picture::Place;
use crate::gui::height_map::parts;
use crate::gui::height_map::picking::{pick, place};
use crate::gui::height_map::range::{RangeMode, range_of, round_down};
use crate::gui::height_map::scene::{Projected, Scene as MapScene};
use crate::gui::height_map::{Layer, MapOptions, Relief};
use crate::gui::orbit_view::{self, OrbitView};
use crate::gui::{Command, Focus, Scene};
use crate::muscle_field::section::Line;

/// Room round the map for numbers and titles: left, top, right (the colour bar), bottom.
const MARGINS: [f32; 4] = [58.0, 72.0, 128.0, 72.0];
/// The longest arrow, mm.
const LONGEST_ARROW_MM: f64 = 25.0;

/// The view makes room for heights up to so many times the end of the colour range; what is higher leaves the canvas.
const HIGHEST: f64 = 2.0;

/// A map that is turned is painted with no more pixels than this where the processor paints it.
const MOST_PIXELS_IN_MOTION: f32 = 600_000.0;

/// What one frame of the canvas shows.
pub(super) struct Stage<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) findings: &'a Findings,
    pub(super) layer: &'a Layer,
    pub(super) options: &'a MapOptions,
    pub(super) canvas: Rect,
    pub(super) inks: Inks,
    pub(super) mm_per_unit: f64,
    pub(super) arrow_mm_per_unit: f64,
    pub(super) projected: Arc<Projected>,
    pub(super) selected: Option<usize>,
    pub(super) hovered: Option<usize>,
}

/// Shows the map in the whole of `ui`; `cuts` are the lines of the profiles.
pub(super) fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    view: &mut ForcesView,
    prepared: &mut Prepared,
    cuts: &[Line],
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let canvas = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(canvas, Sense::click_and_drag());
    let inks = Inks::new(ui.visuals(), prepared.layer.signed);
    ui.painter().rect_filled(canvas, 0.0, inks.canvas);
    let room = Rect::from_min_max(canvas.min + vec2(MARGINS[0], MARGINS[1]), canvas.max - vec2(MARGINS[2], MARGINS[3]));
    if room.width() < 40.0 || room.height() < 40.0 {
        return;
    }
    let mesh = scene.face.mesh();
    let large = parts::is_large(mesh);
    let options = view.options;
    // The range "in view" needs the projection, which needs the heights; so the heights follow the range of all data.
    let of_all = prepared.range(options.range);
    let mm_per_unit = options.exaggeration.mm_per_unit(of_all);
    let mut raised = prepared.raise(scene, &options, mm_per_unit, |layer| without_border(scene, layer, options.border));
    let drawn = prepared.take_drawn();
    // How large it will be is known before what is drawn at that size is chosen.
    let points_per_mm = view.shown.map_or(1.0, |s| s.projection.points_per_mm);
    prepared.choose(scene, &mut raised, points_per_mm, response.dragged());
    let most_mm = HIGHEST * mm_per_unit * of_all.high.abs().max(of_all.low.abs());
    // Of many points only those that can lie on the outline.
    let Sight { ground, outline, .. } = raised.sight(&prepared.layer, options.fit_known, most_mm);
    let corners = ground.corners();
    let surface = &raised.surface;
    let layer = raised.layer.as_ref().unwrap_or(&prepared.layer);
    let fit = |orbit: &OrbitView| {
        let corners = corners.iter().copied().filter(|_| options.axes);
        orbit.project_into(room, outline.iter().copied().chain(corners))
    };
    view.orbit.steer(ui, &response, OrbitView::default(), &fit);
    let projection = fit(&view.orbit);
    let projected = Drawn::project(drawn.as_ref(), &raised, &projection);
    let pick_at = |at: Pos2| pick(at, mesh, surface, &projected, &layer.values);
    let pointed = point(ui, &response, &pick_at, focus, commands);
    view.canvas_focused = orbit_view::keep_focus(ui, &response);

    let range = match options.range {
        RangeMode::InView => range_of(options.range, layer, &|v| canvas.contains(projected.base[v])),
        mode => prepared.range(mode),
    };
    let palette = options.palette(layer, range);
    let ticks = nice_ticks(range.low, range.high, 4);
    let painter = ui.painter_at(canvas);
    if options.axes {
        let title = layer.axis_title();
        let height = HeightAxis { title: &title, ticks: &ticks, mm_per_unit };
        axes::draw(&painter, &projection, &ground, (options.relief == Relief::Plane).then_some(&height), &inks);
    }
    let arrow_mm_per_unit = arrow_scale(scene, prepared.findings.look_at);
    let texture = palette.texture(ui.ctx()).id();
    let map = MapScene {
        mesh,
        outcome: scene.outcome,
        layer,
        surface,
        parts: &raised.parts,
        projection: &projection,
        palette: &palette,
        inks: &inks,
        options: &options,
        mm_per_unit,
        contour_levels: &ticks,
        arrow_mm_per_unit,
        cuts,
        ground: &ground,
    };
    let moved = view.shown.is_some_and(|s| s.projection != projection);
    if moved && large {
        // The next frame, at rest, paints every pixel.
        ui.ctx().request_repaint();
    }
    let picture = large.then(|| picture_over(canvas, ui.ctx().pixels_per_point(), moved || response.dragged()));
    view.shown = Some(super::Shown { projection, range });
    let from = DrawnFrom {
        projection,
        options,
        texture,
        palette,
        surface: raised.from,
        cuts: cuts.to_vec(),
        dark: ui.visuals().dark_mode,
        pixels_per_point: ui.ctx().pixels_per_point(),
        levels_mm: raised.levels_mm,
        picture,
    };
    let drawn = Drawn::draw(drawn, from, Arc::clone(&projected), ui.ctx(), |projected| {
        let mut ink = Ink::new(texture, picture.map_or(ui.ctx().pixels_per_point(), |p| p.pixels_per_point));
        map.paint(projected, &mut ink);
        ink.into_mesh()
    });
    drawn.show(&painter);

    let stage = Stage {
        scene,
        findings: &prepared.findings,
        layer,
        options: &options,
        canvas,
        inks,
        mm_per_unit,
        arrow_mm_per_unit,
        selected: super::selected_vertex(scene, focus),
        hovered: focus.hovered().map(|v| v as usize),
        projected,
    };
    if options.fibre {
        fibre(&painter, &stage);
    }
    highlights(&painter, &stage);
    legend::captions(&painter, &stage);
    axes::tripod(&painter, canvas, &projection, &inks);
    colour_bar::show(&painter, canvas, layer, &palette, options.range, &inks);
    let summary = format!("Height map, {}, {} vertices known", layer.title, layer.values.iter().flatten().count());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &summary));
    vertex_nodes(ui, &response, &stage);
    if let Some(v) = pointed {
        tooltip(&painter, &stage, v);
    }
    prepared.keep(raised, drawn);
    if response.has_focus() {
        let line = Stroke::new(1.0, ui.visuals().hyperlink_color.gamma_multiply(0.6));
        painter.rect_stroke(canvas.shrink(1.0), 0.0, line, egui::StrokeKind::Inside);
    }
}

/// The pixels of the canvas; while the map is turned fewer and larger ones where there would be more than can follow the hand.
fn picture_over(canvas: Rect, pixels_per_point: f32, in_motion: bool) -> Place {
    let pixels = canvas.area() * pixels_per_point * pixels_per_point;
    let coarser = if in_motion { (pixels / MOST_PIXELS_IN_MOTION).sqrt().max(1.0) } else { 1.0 };
    let corner = (canvas.min.to_vec2() * pixels_per_point).floor() / pixels_per_point;
    Place::over(Rect::from_min_max(corner.to_pos2(), canvas.max), pixels_per_point / coarser)
}

/// The layer without the vertices whose force carries the border's reaction, if they are to be left out.
fn without_border(scene: Scene<'_>, layer: &Layer, show_border: bool) -> Option<Layer> {
    if show_border || !scene.outcome.border.iter().any(|b| *b) {
        return None;
    }
    let mut layer = layer.clone();
    for (value, border) in layer.values.iter_mut().zip(&scene.outcome.border) {
        if *border {
            *value = None;
        }
    }
    Some(layer)
}

/// mm of arrow per unit of force: the largest force is drawn about [`LONGEST_ARROW_MM`] long.
fn arrow_scale(scene: Scene<'_>, look_at: Option<usize>) -> f64 {
    let largest = look_at.and_then(|v| scene.outcome.field.force.get(v)).map_or(1.0, nalgebra::Vector3::norm);
    round_down(LONGEST_ARROW_MM / largest.max(1e-12))
}

/// Tells every panel what the pointer means, and selects on a click; gives the vertex under the pointer.
fn point(
    ui: &egui::Ui,
    response: &egui::Response,
    pick_at: &dyn Fn(Pos2) -> Option<usize>,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) -> Option<usize> {
    // A click by the keyboard has no place.
    if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
        match pick_at(at) {
            Some(v) => select(commands, v),
            None => commands.push(Command::Select(None)),
        }
    }
    let free = response.container_contains_pointer() && !response.dragged();
    let pointed = ui.input(|i| i.pointer.hover_pos()).filter(|_| free).and_then(pick_at);
    if let Some(v) = pointed {
        focus.hover(v as u32);
    }
    pointed
}

/// The chosen muscle's fibre, from its attachment (a square on the bone) to its insertion (a dot in the skin).
fn fibre(painter: &Painter, stage: &Stage<'_>) {
    let muscles = stage.scene.face.muscles();
    let Some(muscle) = stage.options.muscle.and_then(|m| muscles.get(m)) else { return };
    let [a, i] = [muscle.attachment, muscle.insertion].map(|v| stage.projected.top[v as usize]);
    for (width, colour) in [(4.0, stage.inks.halo.gamma_multiply(0.7)), (2.0, stage.inks.selected)] {
        painter.extend(egui::Shape::dashed_line(&[a, i], Stroke::new(width, colour), 7.0, 4.0));
    }
    painter.rect_filled(Rect::from_center_size(a, Vec2::splat(8.0)), 0.0, stage.inks.selected);
    painter.circle_filled(i, 4.5, stage.inks.selected);
}

/// The selected vertex and the one under the pointer, over everything, each with its foot.
fn highlights(painter: &Painter, stage: &Stage<'_>) {
    let inks = &stage.inks;
    for (vertex, colour, radius) in [(stage.selected, inks.selected, 7.0), (stage.hovered, inks.hovered, 5.5)] {
        let Some(v) = vertex.filter(|v| *v < stage.projected.top.len()) else { continue };
        let at = place(&stage.projected, &stage.layer.values, v);
        painter.line_segment([stage.projected.base[v], at], Stroke::new(1.0, colour.gamma_multiply(0.7)));
        painter.circle_stroke(at, radius, Stroke::new(3.5, inks.canvas.gamma_multiply(0.7)));
        painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
    }
}

/// A line of text beside a vertex, inside the canvas.
fn tooltip(painter: &Painter, stage: &Stage<'_>, v: usize) {
    let (at, canvas) = (place(&stage.projected, &stage.layer.values, v), stage.canvas);
    let text = vertex_name(stage.scene, stage.layer, v);
    let galley = painter.layout_no_wrap(text, FontId::proportional(12.0), stage.inks.canvas);
    let size = galley.size() + vec2(12.0, 8.0);
    let x = if at.x + 14.0 + size.x < canvas.right() { at.x + 14.0 } else { at.x - 14.0 - size.x };
    let y = (at.y - size.y - 10.0).max(canvas.top() + 4.0);
    let rect = Rect::from_min_size(pos2(x, y), size);
    painter.rect_filled(rect, 4.0, stage.inks.text.gamma_multiply(0.92));
    painter.galley(rect.min + vec2(6.0, 4.0), galley, stage.inks.canvas);
}

/// A node for the screen reader, and for tests, on every measured vertex and on those that are lit up.
fn vertex_nodes(ui: &egui::Ui, response: &egui::Response, stage: &Stage<'_>) {
    for (v, state) in stage.scene.outcome.states.iter().enumerate() {
        let lit = Some(v) == stage.selected || Some(v) == stage.hovered;
        if v >= stage.projected.top.len() || (*state != VertexState::Measured && !lit) {
            continue;
        }
        let at = place(&stage.projected, &stage.layer.values, v);
        if !stage.canvas.contains(at) {
            continue;
        }
        let id = response.id.with(("vertex", v));
        let node = ui.interact(Rect::from_center_size(at, Vec2::splat(6.0)), id, Sense::hover());
        node.widget_info(|| {
            let name = vertex_name(stage.scene, stage.layer, v);
            WidgetInfo::selected(Role::GraphicsSymbol, true, Some(v) == stage.selected, name)
        });
    }
}
