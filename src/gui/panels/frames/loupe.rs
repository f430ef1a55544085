//! The loupe: the neighbourhood of the point in hand, several screen pixels a pixel, with the wireframe in it and a cross.

use std::collections::BTreeSet;

use egui::{Color32, Painter, Pos2, Rect, Stroke, StrokeKind, Vec2};
use nalgebra::Point2;

use super::image_view::Transform;
use super::wireframe::{self, WireframeStyle};
use crate::face::FaceModel;
use crate::gui::face_drawing::levels::Levels;
use crate::gui::snapping;
use crate::gui::texture::Tiles;
use crate::gui::theme::on_picture;
use crate::suggest::Refined;

/// How the loupe is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoupeStyle {
    /// Screen pixels per pixel of the picture, 4 to 16.
    pub scale: f32,
    /// Shown whenever the pointer is on a picture, not only while dragging.
    pub always: bool,
}

impl Default for LoupeStyle {
    fn default() -> Self {
        Self { scale: 8.0, always: false }
    }
}

/// Side of the loupe, ui points.
const SIDE: f32 = 176.0;

/// What the loupe shows.
pub struct Loupe<'a> {
    /// The picture.
    pub tiles: &'a Tiles,
    /// The face of the wireframe.
    pub face: &'a FaceModel,
    /// Its levels of detail.
    pub levels: &'a Levels,
    /// Pixels of the picture a millimetre.
    pub px_per_mm: f64,
    /// Its vertices, px.
    pub in_image: &'a [Point2<f64>],
    /// The vertices between which edges are drawn.
    pub only: Option<&'a BTreeSet<u32>>,
    /// How the wireframe is drawn.
    pub wireframe: &'a WireframeStyle,
    /// The pixel in the middle.
    pub at: [f64; 2],
    /// Colour of the cross.
    pub colour: Color32,
    /// Row and column of the crossing that the cross is on.
    pub crossing: Option<String>,
    /// Where the hand is, px, and the crossing of painted lines that the mark has gone to.
    pub snapped: Option<([f64; 2], Refined)>,
}

/// Draws the loupe beside `beside`, inside `pane`.
pub fn paint(painter: &Painter, pane: Rect, beside: Pos2, style: LoupeStyle, loupe: &Loupe<'_>) {
    let rect = place(pane, beside);
    let zoom = f64::from(style.scale / painter.ctx().pixels_per_point());
    let transform = Transform { pane_centre: rect.center(), centre_in_image: loupe.at, zoom };
    let inside = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    inside.rect_filled(rect, 0.0, Color32::BLACK);
    loupe.tiles.paint(&inside, |p| transform.ui_from_image(p));
    let points_per_mm = loupe.px_per_mm * zoom;
    wireframe::paint(
        &inside,
        loupe.face,
        loupe.levels,
        loupe.in_image,
        loupe.only,
        loupe.wireframe,
        points_per_mm,
        |p| transform.ui_from_image(p),
    );
    cross(&inside, rect, Stroke::new(3.0, on_picture::HALO));
    cross(&inside, rect, Stroke::new(1.0, loupe.colour));
    // Over the cross, whose arms the lines follow on an upright grid.
    if let Some((hand, found)) = &loupe.snapped {
        snapping::paint(&inside, *hand, found, |p| transform.ui_from_image(p));
    }
    painter.rect_stroke(rect, 4.0, Stroke::new(3.0, on_picture::HALO), StrokeKind::Outside);
    painter.rect_stroke(rect, 4.0, Stroke::new(1.5, Color32::WHITE), StrokeKind::Middle);
    let mut line = Rect::from_min_size(rect.left_bottom() - Vec2::new(0.0, 18.0), Vec2::new(SIDE, 18.0));
    let place = format!("{:.2}, {:.2}    {}×", loupe.at[0], loupe.at[1], style.scale);
    let fit = loupe.snapped.map(|(hand, found)| {
        let by = (found.at - Point2::from(hand)).norm();
        format!("{by:.2} px, residual {:.0} %", 100.0 * found.residual)
    });
    let found = fit.into_iter().chain(loupe.crossing.clone()).map(|words| (words, on_picture::SUGGESTED));
    for (text, colour) in std::iter::once((place, Color32::WHITE)).chain(found) {
        let galley = painter.layout_no_wrap(text, egui::FontId::monospace(11.0), colour);
        inside.rect_filled(line, 0.0, Color32::from_black_alpha(150));
        inside.galley(line.left_center() + Vec2::new(6.0, -galley.size().y / 2.0), galley, colour);
        line = line.translate(Vec2::new(0.0, -18.0));
    }
}

/// A cross with an open middle: the skin under the point stays visible.
fn cross(painter: &Painter, rect: Rect, stroke: Stroke) {
    let c = rect.center();
    let (inner, outer) = (6.0, SIDE * 0.38);
    painter.hline(c.x - outer..=c.x - inner, c.y, stroke);
    painter.hline(c.x + inner..=c.x + outer, c.y, stroke);
    painter.vline(c.x, c.y - outer..=c.y - inner, stroke);
    painter.vline(c.x, c.y + inner..=c.y + outer, stroke);
}

/// Above and to the right of the point, or on the side where there is room: never over the point itself.
fn place(pane: Rect, beside: Pos2) -> Rect {
    let gap = 28.0;
    let x = if beside.x + gap + SIDE <= pane.right() { beside.x + gap } else { beside.x - gap - SIDE };
    let y = if beside.y - gap - SIDE >= pane.top() { beside.y - gap - SIDE } else { beside.y + gap };
    Rect::from_min_size(Pos2::new(x.max(pane.left() + 4.0), y), Vec2::splat(SIDE))
}
