//! The canvas of the height map: draws it, turns it under the hand, and tells which vertex the pointer means.

use egui::{Align2, Color32, FontId, Pos2, Rect, Role, Sense, Stroke, Vec2, WidgetInfo, pos2, vec2};

use super::{ForcesView, colour_bar, select, vertex_name};
use crate::displacement::VertexState;
use crate::draw::ticks::nice_ticks;
use crate::gui::height_map::axes::{self, Ground, HeightAxis};
use crate::gui::height_map::ink::{Ink, Inks};
use crate::gui::height_map::options::{exaggeration_text, noise_floor, significant};
use crate::gui::height_map::picking::{pick, place};
use crate::gui::height_map::quantity::Layer;
use crate::gui::height_map::range::{RangeMode, range_of, round_down};
use crate::gui::height_map::scene::{Projected, Scene as MapScene};
use crate::gui::height_map::{Relief, Surface};
use crate::gui::orbit_view::{OrbitView, Projection};
use crate::gui::{Command, Focus, Scene};

/// Room round the map for numbers and titles: left, top, right (the colour bar), bottom.
const MARGINS: [f32; 4] = [58.0, 44.0, 128.0, 54.0];
/// The longest arrow, mm.
const LONGEST_ARROW_MM: f64 = 25.0;

/// Shows the map in the whole of `ui`.
pub(super) fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    view: &mut ForcesView,
    layer: &Layer,
    selected: Option<usize>,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let canvas = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(canvas, Sense::click_and_drag());
    let inks = Inks::new(ui.visuals());
    ui.painter().rect_filled(canvas, 0.0, inks.canvas);
    let room = Rect::from_min_max(canvas.min + vec2(MARGINS[0], MARGINS[1]), canvas.max - vec2(MARGINS[2], MARGINS[3]));
    if room.width() < 40.0 || room.height() < 40.0 {
        return;
    }

    // The surface stands as high as the range of all data says; the range "in view" needs the projection first, so it follows.
    let mesh = scene.face.mesh();
    let steady = match view.options.range {
        RangeMode::InView => RangeMode::Auto,
        other => other,
    };
    let steady_range = range_of(steady, layer, &|_| true);
    let mm_per_unit = view.options.exaggeration.mm_per_unit(steady_range);
    let surface = Surface::new(mesh, &scene.outcome.first, &layer.values, mm_per_unit, view.options.relief);
    let shown: Vec<usize> = shown_vertices(layer, view.options.fit_known);
    let ground = Ground::under(shown.iter().map(|&v| &surface.base[v]), view.options.relief == Relief::Plane);
    let ground_corners = ground.corners();
    let corners = ground_corners.iter().copied().filter(|_| view.options.axes);
    let projection = view.orbit.project_into(room, surface.extent(shown.iter().copied()).chain(corners));
    let projection = steer(ui, &response, view, projection, room, &surface, &shown, &ground);
    view.shown = Some(projection);
    let projected = Projected::new(&surface, &projection);
    let range = range_of(view.options.range, layer, &|v| canvas.contains(projected.base[v]));
    let palette = view.options.palette(layer, range);
    let ticks = nice_ticks(range.low, range.high, 4);

    // What the pointer means, told to every panel.
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|_| response.container_contains_pointer());
    let under_pointer =
        pointer.filter(|_| !response.dragged()).and_then(|at| pick(at, mesh, &surface, &projected, &layer.values));
    if let Some(v) = under_pointer {
        focus.hover(v as u32);
    }
    if response.clicked() {
        response.request_focus();
        match response.interact_pointer_pos().and_then(|at| pick(at, mesh, &surface, &projected, &layer.values)) {
            Some(v) => select(commands, v),
            None => commands.push(Command::Select(None)),
        }
    }
    if response.dragged() {
        response.request_focus();
    }
    view.canvas_focused = response.has_focus();
    ui.memory_mut(|m| {
        let keys = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..egui::EventFilter::default() };
        m.set_focus_lock_filter(response.id, keys);
    });

    let painter = ui.painter_at(canvas);
    let title = title_of(layer);
    let axis_title = layer.axis_title();
    if view.options.axes {
        let height = (view.options.relief != Relief::FaceColoured).then_some(HeightAxis {
            title: &axis_title,
            ticks: &ticks,
            mm_per_unit,
        });
        let height = height.filter(|_| view.options.relief == Relief::Plane);
        axes::draw(&painter, &projection, &ground, height.as_ref(), &inks);
    }
    let arrow_mm_per_unit = arrow_scale(scene);
    let texture = palette.texture(ui.ctx());
    let mut ink = Ink::new(texture.id(), ui.ctx().pixels_per_point());
    let drawn = without_border(scene, layer, view.options.border);
    let drawn = drawn.as_ref().unwrap_or(layer);
    let drawn_surface;
    let (drawn_surface, drawn_projected) = if std::ptr::eq(drawn, layer) {
        (&surface, projected.clone())
    } else {
        drawn_surface = Surface::new(mesh, &scene.outcome.first, &drawn.values, mm_per_unit, view.options.relief);
        (&drawn_surface, Projected::new(&drawn_surface, &projection))
    };
    MapScene {
        mesh,
        outcome: scene.outcome,
        layer: drawn,
        surface: drawn_surface,
        projection: &projection,
        palette: &palette,
        inks: &inks,
        options: &view.options,
        mm_per_unit,
        contour_levels: &ticks,
        arrow_mm_per_unit,
        ground: &ground,
    }
    .paint(&drawn_projected, &mut ink);
    painter.add(egui::Shape::mesh(ink.into_mesh()));
    if view.options.fibre {
        fibre(&painter, scene, view, &projected, &inks);
    }
    highlights(&painter, layer, &projected, selected, focus.hovered().map(|v| v as usize), &inks);

    captions(&painter, canvas, scene, view, layer, &title, mm_per_unit, &inks);
    axes::tripod(&painter, canvas, &projection, &inks);
    colour_bar::show(&painter, canvas, layer, &palette, view.options.range, &inks);

    let summary = format!("Height map, {title}, {} vertices known", layer.values.iter().flatten().count());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &summary));
    vertex_nodes(ui, &response, scene, layer, &projected, canvas, selected, focus);
    if let Some(v) = under_pointer {
        tooltip(&painter, canvas, place(&projected, &layer.values, v), &vertex_name(scene, layer, v), &inks);
    }
    if response.has_focus() {
        painter.rect_stroke(
            canvas.shrink(1.0),
            0.0,
            Stroke::new(1.0, ui.visuals().selection.stroke.color.gamma_multiply(0.4)),
            egui::StrokeKind::Inside,
        );
    }
}

/// "Force, N".
pub(super) fn title_of(layer: &Layer) -> String {
    if layer.unit.is_empty() { layer.title.clone() } else { format!("{}, {}", layer.title, layer.unit) }
}

fn shown_vertices(layer: &Layer, known_only: bool) -> Vec<usize> {
    let all = 0..layer.values.len();
    let known: Vec<usize> = all.clone().filter(|&v| layer.values[v].is_some()).collect();
    if known_only && known.len() > 2 { known } else { all.collect() }
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

/// mm of arrow per unit of force: the largest force that can be believed is drawn about [`LONGEST_ARROW_MM`] long.
fn arrow_scale(scene: Scene<'_>) -> f64 {
    let peak = scene.outcome.field.peak(&scene.outcome.states).map_or(1.0, |(_, f)| f);
    round_down(LONGEST_ARROW_MM / peak.max(1e-12))
}

/// Turns, shifts and zooms the view under the hand; gives the projection that results.
fn steer(
    ui: &egui::Ui,
    response: &egui::Response,
    view: &mut ForcesView,
    projection: Projection,
    room: Rect,
    surface: &Surface,
    shown: &[usize],
    ground: &Ground,
) -> Projection {
    let before = view.orbit;
    let (wheel, pinch, pan_key, delta) = ui.input(|i| {
        (
            i.smooth_scroll_delta().y,
            i.zoom_delta(),
            i.modifiers.shift || i.key_down(egui::Key::Space),
            i.pointer.delta(),
        )
    });
    // The last motion and the release can come in one frame.
    let moved = response.dragged() || response.drag_stopped();
    let drag = if response.drag_delta() == Vec2::ZERO { delta } else { response.drag_delta() };
    if moved && drag != Vec2::ZERO {
        let middle =
            response.dragged_by(egui::PointerButton::Middle) || response.drag_stopped_by(egui::PointerButton::Middle);
        if middle || pan_key {
            view.orbit.pan(&projection, drag);
        } else {
            view.orbit.orbit(&projection, drag);
        }
    }
    if response.double_clicked() {
        view.orbit = OrbitView::default();
    }
    if response.container_contains_pointer()
        && let Some(at) = ui.input(|i| i.pointer.hover_pos())
    {
        let factor = f64::from(pinch) * (f64::from(wheel) * 0.0025).exp();
        if (factor - 1.0).abs() > 1e-6 {
            view.orbit.zoom(&projection, factor, at);
        }
    }
    if view.orbit == before {
        return projection;
    }
    let corners = ground.corners();
    let corners = corners.iter().copied().filter(|_| view.options.axes);
    view.orbit.project_into(room, surface.extent(shown.iter().copied()).chain(corners))
}

/// The chosen muscle's fibre, from its attachment (a square on the bone) to its insertion (a dot in the skin).
fn fibre(painter: &egui::Painter, scene: Scene<'_>, view: &ForcesView, projected: &Projected, inks: &Inks) {
    let Some(muscle) = view.options.muscle.and_then(|m| scene.face.muscles().get(m)) else { return };
    let (a, i) = (projected.top[muscle.attachment as usize], projected.top[muscle.insertion as usize]);
    let stroke = Stroke::new(2.0, inks.selected);
    painter.extend(egui::Shape::dashed_line(&[a, i], stroke, 6.0, 4.0));
    painter.rect_filled(Rect::from_center_size(a, Vec2::splat(7.0)), 0.0, inks.selected);
    painter.circle_filled(i, 4.0, inks.selected);
}

/// The selected vertex and the one under the pointer, over everything, each with its foot.
fn highlights(
    painter: &egui::Painter,
    layer: &Layer,
    projected: &Projected,
    selected: Option<usize>,
    hovered: Option<usize>,
    inks: &Inks,
) {
    let lit = [(selected, inks.selected, 7.0), (hovered, inks.hovered, 5.5)];
    for (vertex, colour, radius) in lit {
        let Some(v) = vertex.filter(|v| *v < projected.top.len()) else { continue };
        let at = place(projected, &layer.values, v);
        painter.line_segment([projected.base[v], at], Stroke::new(1.0, colour.gamma_multiply(0.7)));
        painter.circle_stroke(at, radius, Stroke::new(3.5, inks.canvas.gamma_multiply(0.7)));
        painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
    }
}

/// Title, exaggeration and legend of the markers.
fn captions(
    painter: &egui::Painter,
    canvas: Rect,
    scene: Scene<'_>,
    view: &ForcesView,
    layer: &Layer,
    title: &str,
    mm_per_unit: f64,
    inks: &Inks,
) {
    painter.text(canvas.min + vec2(14.0, 10.0), Align2::LEFT_TOP, title, FontId::proportional(16.0), inks.text);
    let mut words = vec![match view.options.relief {
        Relief::FaceColoured => "no heights".to_owned(),
        _ => exaggeration_text(mm_per_unit, layer.unit),
    }];
    if view.options.arrows {
        let scale = exaggeration_text(arrow_scale(scene), scene.outcome.unit());
        words.push(scale.replacen("height", "arrows", 1));
    }
    if let (true, Some(floor)) = (view.options.noise_floor, noise_floor(layer)) {
        words.push(format!("noise floor {} {} (median ±)", significant(floor, 2), layer.unit));
    }
    let line = pos2(canvas.left() + 14.0, canvas.bottom() - 12.0);
    painter.text(line, Align2::LEFT_BOTTOM, words.join("   ·   "), FontId::proportional(12.0), inks.weak_text);
    legend(painter, canvas, scene, view, inks);
}

/// One entry of the legend.
#[derive(Clone, Copy, PartialEq)]
enum Sign {
    Measured,
    Inferred,
    Fixed,
    Border,
    Unmeasured,
    Noise,
}

fn legend(painter: &egui::Painter, canvas: Rect, scene: Scene<'_>, view: &ForcesView, inks: &Inks) {
    let states = &scene.outcome.states;
    let has = |state| states.contains(&state);
    let mut entries = Vec::new();
    if view.options.markers {
        for (sign, state) in [
            (Sign::Measured, VertexState::Measured),
            (Sign::Inferred, VertexState::Inferred),
            (Sign::Fixed, VertexState::Fixed),
        ] {
            if has(state) {
                entries.push((sign, state.word()));
            }
        }
        if view.options.border && scene.outcome.border.contains(&true) {
            entries.push((Sign::Border, "border: carries reactions"));
        }
    }
    if has(VertexState::Unmeasured) {
        entries.push((Sign::Unmeasured, "not measured"));
    }
    if view.options.below_noise {
        entries.push((Sign::Noise, "below 2 ±"));
    }
    let font = FontId::proportional(11.5);
    // Laid out from the right end, left of the colour bar.
    let mut right = canvas.right() - 14.0;
    let y = canvas.bottom() - 19.0;
    for (sign, words) in entries.into_iter().rev() {
        let galley = painter.layout_no_wrap(words.to_owned(), font.clone(), inks.weak_text);
        right -= galley.size().x;
        painter.galley(pos2(right, y - galley.size().y / 2.0), galley, inks.weak_text);
        right -= 11.0;
        draw_sign(painter, pos2(right, y), sign, inks);
        right -= 20.0;
    }
}

fn draw_sign(painter: &egui::Painter, at: Pos2, sign: Sign, inks: &Inks) {
    let swatch = Rect::from_center_size(at, vec2(14.0, 10.0));
    let (ink, thin) = (inks.text, Stroke::new(1.0, inks.text));
    match sign {
        Sign::Measured => _ = painter.circle_filled(at, 2.4, ink),
        Sign::Inferred => _ = painter.circle_stroke(at, 2.4, thin),
        Sign::Fixed => _ = painter.rect_filled(Rect::from_center_size(at, Vec2::splat(5.0)), 0.0, ink),
        Sign::Border => {
            painter.circle_filled(at, 1.8, ink);
            for k in 0..6 {
                let point = |k: f32| at + Vec2::angled(k / 12.0 * std::f32::consts::TAU) * 4.8;
                painter.line_segment([point(2.0 * k as f32), point(2.0 * k as f32 + 1.0)], Stroke::new(1.2, ink));
            }
        }
        Sign::Unmeasured => {
            painter.rect_filled(swatch, 1.0, inks.unmeasured);
            hatch(painter, swatch, inks.hatch, false);
            painter.rect_stroke(swatch, 1.0, Stroke::new(0.8, inks.hatch), egui::StrokeKind::Inside);
        }
        Sign::Noise => {
            painter.rect_filled(swatch, 1.0, Color32::from_rgb(62, 74, 137));
            hatch(painter, swatch, inks.noise, true);
        }
    }
}

/// Diagonal lines over a rectangle.
pub(super) fn hatch(painter: &egui::Painter, rect: Rect, colour: Color32, falling: bool) {
    let clipped = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let mut x = rect.left() - rect.height();
    while x < rect.right() {
        let (a, b) = (pos2(x, rect.bottom()), pos2(x + rect.height(), rect.top()));
        let ends = if falling { [pos2(a.x, b.y), pos2(b.x, a.y)] } else { [a, b] };
        clipped.line_segment(ends, Stroke::new(1.0, colour));
        x += 5.0;
    }
}

/// A line of text beside a point, inside the canvas.
fn tooltip(painter: &egui::Painter, canvas: Rect, at: Pos2, text: &str, inks: &Inks) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), inks.canvas);
    let size = galley.size() + vec2(12.0, 8.0);
    let x = if at.x + 14.0 + size.x < canvas.right() { at.x + 14.0 } else { at.x - 14.0 - size.x };
    let y = (at.y - size.y - 10.0).max(canvas.top() + 4.0);
    let rect = Rect::from_min_size(pos2(x, y), size);
    painter.rect_filled(rect, 4.0, inks.text.gamma_multiply(0.92));
    painter.galley(rect.min + vec2(6.0, 4.0), galley, inks.canvas);
}

/// A node for the screen reader, and for tests, on every measured vertex and on those that are lit up.
fn vertex_nodes(
    ui: &egui::Ui,
    response: &egui::Response,
    scene: Scene<'_>,
    layer: &Layer,
    projected: &Projected,
    canvas: Rect,
    selected: Option<usize>,
    focus: &Focus,
) {
    let hovered = focus.hovered().map(|v| v as usize);
    for (v, state) in scene.outcome.states.iter().enumerate() {
        if *state != VertexState::Measured && Some(v) != selected && Some(v) != hovered {
            continue;
        }
        let at = place(projected, &layer.values, v);
        if !canvas.contains(at) {
            continue;
        }
        let node =
            ui.interact(Rect::from_center_size(at, Vec2::splat(6.0)), response.id.with(("vertex", v)), Sense::hover());
        node.widget_info(|| {
            WidgetInfo::selected(Role::GraphicsSymbol, true, Some(v) == selected, vertex_name(scene, layer, v))
        });
    }
}
