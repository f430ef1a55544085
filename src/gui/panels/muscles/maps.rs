//! Two maps of the face side by side, with one range of colours and one eye: what was observed, and what a law says of it or leaves.

use std::sync::Arc;

use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use nalgebra::Point3;

use crate::gui::face_drawing::levels::Levels;
use crate::gui::height_map::axes::Ground;
use crate::gui::height_map::ink::{Ink, Inks};
use crate::gui::height_map::parts::{self, Parts};
use crate::gui::height_map::picking::{pick, place};
use crate::gui::height_map::scene::{Projected, Scene as MapScene};
use crate::gui::height_map::{ColourRange, Layer, MapOptions, Relief, Surface};
use crate::gui::orbit_view::{self, OrbitView, Projection, StandardView};
use crate::gui::panels::forces::colour_bar;
use crate::gui::{Focus, Scene};
use crate::muscle_field::FibreOf;

/// Room round a map, points: left, top, right, bottom.
const MARGINS: [f32; 4] = [10.0, 30.0, 10.0, 12.0];
/// Room for the bar of colours between the maps and the right side.
pub(in crate::gui::panels) const BAR: f32 = 96.0;
/// Triangles and flat parts of a large face are drawn from levels whose edges are at least so long on the screen, points.
const SHORTEST: [f64; 2] = [4.0, 8.0];
/// A muscle is pointed at when the pointer comes so near to its fibre, points.
const REACH: f32 = 7.0;

/// A muscle as it is drawn over the face.
#[derive(Clone, Copy, Debug)]
pub(in crate::gui::panels) struct Drawn {
    /// Index in the face's muscles.
    pub(in crate::gui::panels) muscle: usize,
    /// Share of the strongest activation, 0 to 1; none where it takes part in no fit.
    pub(in crate::gui::panels) strength: Option<f64>,
}

/// One map.
pub(in crate::gui::panels) struct Map<'a> {
    /// Above it.
    pub(in crate::gui::panels) title: &'a str,
    /// Its values.
    pub(in crate::gui::panels) layer: &'a Layer,
}

/// What both maps share.
pub(in crate::gui::panels) struct Shared<'a> {
    pub(in crate::gui::panels) scene: Scene<'a>,
    /// The vertices from the eyes, mm.
    pub(in crate::gui::panels) first: &'a [Point3<f64>],
    /// Values whose vertices the view must hold, so that both maps stand alike.
    pub(in crate::gui::panels) in_view: &'a [Option<f64>],
    pub(in crate::gui::panels) options: &'a MapOptions,
    pub(in crate::gui::panels) range: ColourRange,
    pub(in crate::gui::panels) mm_per_unit: f64,
    /// All muscles with a fibre.
    pub(in crate::gui::panels) fibres: &'a [FibreOf],
    /// Those that are drawn.
    pub(in crate::gui::panels) muscles: &'a [Drawn],
    /// The muscle that is chosen.
    pub(in crate::gui::panels) chosen: Option<usize>,
    pub(in crate::gui::panels) selected: Option<usize>,
}

/// What a pair of maps keeps from frame to frame.
#[derive(Debug, Default)]
pub(in crate::gui::panels) struct Kept {
    levels: Option<(u64, Arc<Levels>)>,
}

/// What the pointer does on a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::gui::panels) struct Pointed {
    /// The vertex under it.
    pub(in crate::gui::panels) vertex: Option<usize>,
    /// The muscle under it.
    pub(in crate::gui::panels) muscle: Option<usize>,
    /// Whether it was clicked.
    pub(in crate::gui::panels) clicked: bool,
}

/// How maps of the face are drawn at first: flat, in colours.
pub(in crate::gui::panels) fn options() -> MapOptions {
    MapOptions { relief: Relief::FaceColoured, markers: false, contours: false, axes: false, ..MapOptions::default() }
}

/// The view from which the maps are first seen.
pub(in crate::gui::panels) fn home() -> OrbitView {
    OrbitView::standard(StandardView::Front)
}

/// Draws one map into `canvas`; gives what the pointer means there, and the projection used.
pub(in crate::gui::panels) fn show(
    ui: &mut Ui,
    canvas: Rect,
    map: &Map<'_>,
    shared: &Shared<'_>,
    orbit: &mut OrbitView,
    kept: &mut Kept,
    focus: &mut Focus,
) -> (Pointed, Projection) {
    let response = ui.interact(canvas, ui.scope_id().with(map.title), Sense::click_and_drag());
    let inks = Inks::new(ui.visuals(), map.layer.signed);
    let painter = ui.painter_at(canvas);
    painter.rect_filled(canvas, 0.0, inks.canvas);
    let room = Rect::from_min_max(canvas.min + vec2(MARGINS[0], MARGINS[1]), canvas.max - vec2(MARGINS[2], MARGINS[3]));
    let mesh = shared.scene.face.mesh();
    let values = &map.layer.values;
    let surface = Surface::new(mesh, shared.first, values, shared.mm_per_unit, shared.options.relief);
    let most_mm = 2.0 * shared.mm_per_unit * shared.range.high.abs().max(shared.range.low.abs());
    let shown = in_view(shared.in_view, shared.options.fit_known);
    let outline: Vec<Point3<f64>> = surface.extent(shown.iter().copied(), most_mm).collect();
    let fit = |orbit: &OrbitView| orbit.project_into(room, outline.iter().copied());
    orbit.steer(ui, &response, home(), &fit);
    let projection = fit(orbit);
    orbit_view::keep_focus(ui, &response);
    let projected = Projected::new(&surface, &projection);
    let palette = shared.options.palette(map.layer, shared.range);
    let texture = palette.texture(ui.ctx()).id();
    let ground = Ground::under(shown.iter().map(|&v| &surface.base[v]), shared.options.relief == Relief::Plane);
    let scene = MapScene {
        mesh,
        outcome: shared.scene.outcome,
        layer: map.layer,
        surface: &surface,
        parts: &kept.parts(shared.scene, &surface, values, &projection),
        projection: &projection,
        palette: &palette,
        inks: &inks,
        options: shared.options,
        mm_per_unit: shared.mm_per_unit,
        contour_levels: &[],
        arrow_mm_per_unit: 0.0,
        cuts: &[],
        ground: &ground,
    };
    let mut ink = Ink::new(texture, ui.ctx().pixels_per_point());
    scene.paint(&projected, &mut ink);
    painter.add(Shape::mesh(ink.into_mesh()));

    let pen = Pen { painter: &painter, projection: &projection, surface: &surface, shared, inks: &inks };
    for drawn in shared.muscles {
        pen.muscle(drawn);
    }
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|_| response.contains_pointer() && !response.dragged());
    let vertex = pointer.and_then(|at| pick(at, mesh, &surface, &projected, values));
    let muscle = pointer.and_then(|at| pen.muscle_at(at));
    if let Some(v) = vertex {
        focus.hover(v as u32);
    }
    for (v, colour, radius) in
        [(shared.selected, inks.selected, 7.0), (focus.hovered().map(|v| v as usize), inks.hovered, 5.5)]
    {
        if let Some(v) = v.filter(|v| *v < projected.top.len()) {
            let at = place(&projected, values, v);
            painter.circle_stroke(at, radius, Stroke::new(3.5, inks.canvas.gamma_multiply(0.7)));
            painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
        }
    }
    painter.text(canvas.min + vec2(12.0, 8.0), Align2::LEFT_TOP, map.title, FontId::proportional(13.5), inks.text);
    let words = format!("Map, {}, {} vertices known", map.title, values.iter().flatten().count());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &words));
    (Pointed { vertex, muscle, clicked: response.clicked() }, projection)
}

/// The vertices that the view must hold.
fn in_view(values: &[Option<f64>], known_only: bool) -> Vec<usize> {
    let known: Vec<usize> = (0..values.len()).filter(|&v| values[v].is_some()).collect();
    if known_only && known.len() > 2 { known } else { (0..values.len()).collect() }
}

impl Kept {
    fn parts(&mut self, scene: Scene<'_>, surface: &Surface, values: &[Option<f64>], projection: &Projection) -> Parts {
        let mesh = scene.face.mesh();
        if !parts::is_large(mesh) {
            return Parts::whole(mesh, surface);
        }
        let levels = match &self.levels {
            Some((face, levels)) if *face == scene.stamp.face => Arc::clone(levels),
            _ => Arc::clone(&self.levels.insert((scene.stamp.face, Arc::new(Levels::new(mesh)))).1),
        };
        let [fine, flat] = SHORTEST.map(|least| levels.at(projection.points_per_mm, least));
        Parts::reduced(mesh, surface, values, fine, flat)
    }
}

struct Pen<'a> {
    painter: &'a Painter,
    projection: &'a Projection,
    surface: &'a Surface,
    shared: &'a Shared<'a>,
    inks: &'a Inks,
}

impl Pen<'_> {
    fn ends(&self, muscle: usize) -> Option<[Pos2; 2]> {
        let muscle = self.shared.scene.face.muscles().get(muscle)?;
        let foot = |v: u32| self.surface.base.get(v as usize).map(|p| self.projection.ui_from_face(p));
        Some([foot(muscle.attachment)?, foot(muscle.insertion)?])
    }

    /// A band of fibres from the bone (a bar) to the skin (a dot), the redder the stronger it pulls; grey where it takes no part.
    fn muscle(&self, drawn: &Drawn) {
        let Some([a, i]) = self.ends(drawn.muscle) else { return };
        let Some(of) = self.shared.fibres.iter().find(|f| f.muscle == drawn.muscle) else { return };
        let chosen = self.shared.chosen == Some(drawn.muscle);
        let colour = match drawn.strength {
            Some(s) => Color32::from_rgb(196, 52, 48).gamma_multiply(0.35 + 0.65 * s as f32),
            None => self.inks.weak_text.gamma_multiply(0.5),
        };
        let along = i - a;
        if along.length() > 1.0 && (chosen || drawn.strength.is_some_and(|s| s > 0.0)) {
            let half = along.rot90().normalized() * (of.fibre.half_width_mm * self.projection.points_per_mm) as f32;
            let band = vec![a - half, a + half, i + half, i - half];
            let fill = colour.gamma_multiply(if chosen { 0.3 } else { 0.16 });
            let rim = if chosen { Stroke::new(1.4, self.inks.selected) } else { Stroke::NONE };
            self.painter.add(Shape::convex_polygon(band, fill, rim));
        }
        let width = if chosen { 3.0 } else { 1.0 + 2.0 * drawn.strength.unwrap_or(0.0) as f32 };
        self.painter.line_segment([a, i], Stroke::new(width + 1.6, self.inks.halo.gamma_multiply(0.55)));
        self.painter.line_segment([a, i], Stroke::new(width, colour));
        self.painter.rect_filled(Rect::from_center_size(a, Vec2::splat(6.0)), 0.0, colour);
        self.painter.circle_filled(i, 3.6, colour);
    }

    fn muscle_at(&self, at: Pos2) -> Option<usize> {
        let distance = |drawn: &Drawn| {
            let [a, i] = self.ends(drawn.muscle)?;
            let along = i - a;
            let share = ((at - a).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
            Some(at.distance(a + along * share)).filter(|d| *d <= REACH)
        };
        let near = self.shared.muscles.iter().filter_map(|d| Some((d.muscle, distance(d)?)));
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(muscle, _)| muscle)
    }
}

/// The bar of colours at the right of the maps, which holds for both.
pub(in crate::gui::panels) fn bar(ui: &Ui, canvas: Rect, layer: &Layer, options: &MapOptions, range: ColourRange) {
    let inks = Inks::new(ui.visuals(), layer.signed);
    let painter = ui.painter_at(canvas);
    let strip = Rect::from_min_max(pos2(canvas.right() - BAR, canvas.top()), canvas.max);
    painter.rect_filled(strip, 0.0, inks.canvas);
    colour_bar::show(&painter, canvas, layer, &options.palette(layer, range), options.range, &inks);
}

/// The halves of a canvas, each with room for a bar of its own beside it.
pub(in crate::gui::panels) fn halves_with_bars(rect: Rect) -> [Rect; 2] {
    let middle = rect.center().x.floor();
    [rect.with_max_x(middle - 0.5 - BAR), Rect::from_min_max(pos2(middle + 0.5, rect.top()), rect.max - vec2(BAR, 0.0))]
}

/// The halves of a canvas, with a line between them.
pub(in crate::gui::panels) fn halves(rect: Rect) -> [Rect; 2] {
    let middle = (rect.left() + (rect.width() - BAR) / 2.0).floor();
    let end = rect.right() - BAR;
    [
        Rect::from_min_max(rect.min, pos2(middle - 0.5, rect.bottom())),
        Rect::from_min_max(pos2(middle + 0.5, rect.top()), pos2(end, rect.bottom())),
    ]
}
