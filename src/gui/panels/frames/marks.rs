//! How points are drawn: the shape tells what is known of them, the colour what kind they are.

use egui::epaint::{PathShape, PathStroke};
use egui::{Color32, ColorImage, Painter, Pos2, Rect, Shape, Stroke, TextureHandle, TextureOptions, Vec2};

use super::points::{Kind, Look};
use crate::gui::theme::on_picture;

/// Half the size of a mark where there is room, and where points stand close, ui points.
const RADIUS: (f32, f32) = (5.0, 2.4);

/// Half the size of a mark when the vertices of the face lie so far apart on the screen.
pub fn radius(spacing: f32) -> f32 {
    (spacing * 0.3).clamp(RADIUS.1, RADIUS.0)
}

/// Colour of a kind of point.
pub fn colour(kind: Kind) -> Color32 {
    match kind {
        Kind::Landmark => on_picture::LANDMARK,
        Kind::Feature => on_picture::FEATURE,
        Kind::Still => on_picture::STILL,
        Kind::Fixed => on_picture::FIXED,
    }
}

/// How a point is lit up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lit {
    /// Not at all.
    No,
    /// It, or its vertex in another panel, is under the pointer.
    Hovered,
    /// It is selected.
    Selected,
}

/// Draws a point: circle = marked, diamond = uncertain, crossed circle = occluded, square = locked, dashed circle =
/// predicted, triangle = suggested (stronger the surer), small plus = unset. The middle stays free, so that the skin under it can be
/// seen.
pub fn paint(painter: &Painter, at: Pos2, radius: f32, look: Look, kind: Kind, lit: Lit, sure: f64) {
    let suggested = look == Look::Suggested;
    let strength = if suggested { strength(sure) } else { 1.0 };
    let colour = if suggested { on_picture::SUGGESTED.gamma_multiply(strength) } else { colour(kind) };
    let (selected, hovered) = (lit == Lit::Selected, lit == Lit::Hovered);
    let radius = if selected { RADIUS.0 + 1.5 } else { radius };
    if selected || hovered {
        let strong = if selected { 2.0 } else { 1.5 };
        painter.circle_stroke(at, radius + 4.5, Stroke::new(strong + 1.5, on_picture::HALO));
        painter.circle_stroke(at, radius + 4.5, Stroke::new(strong, on_picture::SELECTED));
    }
    let width = (radius * 0.36).clamp(1.1, 1.8);
    if look == Look::Marked {
        return marked(painter, at, radius, width, colour);
    }
    let halo = on_picture::HALO.gamma_multiply(strength);
    for (stroke, filled) in [(Stroke::new(width + HALO_WIDTH, halo), false), (Stroke::new(width, colour), true)] {
        outline(painter, at, radius, look, stroke);
        if filled && look.is_mark() && look != Look::Occluded {
            painter.circle_filled(at, dot(radius), colour);
        }
    }
}

/// So much wider than a line is the halo under it, ui points.
const HALO_WIDTH: f32 = 1.6;

/// Radius of the dot in the middle of a mark.
fn dot(radius: f32) -> f32 {
    (radius * 0.26).max(0.9)
}

/// Radii of which one picture is kept, per ui point: a mark is drawn to a sixteenth of a point as large as it should be.
const SIZES_A_POINT: f32 = 8.0;

/// A plain mark: circle, halo and dot as one small picture. There are hundreds, and their circles would be two hundred triangles each.
fn marked(painter: &Painter, at: Pos2, radius: f32, width: f32, colour: Color32) {
    let ctx = painter.ctx();
    let pixels_per_point = ctx.pixels_per_point();
    let size = (radius * SIZES_A_POINT).round();
    let id = egui::Id::unique("mark").with((size as u32, pixels_per_point.to_bits()));
    let known = ctx.data(|d| d.get_temp::<TextureHandle>(id));
    let texture = known.unwrap_or_else(|| {
        let picture = ring(size / SIZES_A_POINT, width, pixels_per_point);
        let texture = ctx.load_texture("mark", picture, TextureOptions::LINEAR);
        ctx.data_mut(|d| d.insert_temp(id, texture.clone()));
        texture
    });
    let rect = Rect::from_center_size(at, texture.size_vec2() / pixels_per_point);
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    painter.image(texture.id(), rect, whole, colour);
}

/// The picture of [`marked`]: white for what takes the colour of the mark, black for the halo.
fn ring(radius: f32, width: f32, pixels_per_point: f32) -> ColorImage {
    let half = ((radius + f32::midpoint(width, HALO_WIDTH)) * pixels_per_point).ceil() as usize + 1;
    let halo = f32::from(on_picture::HALO.a()) / 255.0;
    let cover = |beyond: f32| (0.5 - beyond * pixels_per_point).clamp(0.0, 1.0);
    let pixels = (0..4 * half * half).map(|k| {
        let place = |i: usize| (i as f32 + 0.5 - half as f32) / pixels_per_point;
        let from_centre = place(k % (2 * half)).hypot(place(k / (2 * half)));
        let off = (from_centre - radius).abs();
        let line = cover(off - width / 2.0).max(cover(from_centre - dot(radius)));
        let under = halo * cover(off - f32::midpoint(width, HALO_WIDTH)) * (1.0 - line);
        let level = |share: f32| (255.0 * share).round() as u8;
        Color32::from_rgba_premultiplied(level(line), level(line), level(line), level(line + under))
    });
    ColorImage::new([2 * half, 2 * half], pixels.collect())
}

/// How strongly a suggestion is drawn: vague ones are faint, and still to be seen.
fn strength(sure: f64) -> f32 {
    (0.3 + 0.7 * sure.clamp(0.0, 1.0).powi(2)) as f32
}

fn outline(painter: &Painter, at: Pos2, r: f32, look: Look, stroke: Stroke) {
    match look {
        Look::Unset => {
            painter.hline(at.x - r * 0.6..=at.x + r * 0.6, at.y, stroke);
            painter.vline(at.x, at.y - r * 0.6..=at.y + r * 0.6, stroke);
        }
        Look::Predicted => dashed_circle(painter, at, r, stroke),
        Look::Suggested => {
            let r = r * 1.2;
            let corners = [-90.0_f32, 30.0, 150.0].map(|a| at + r * Vec2::angled(a.to_radians()));
            painter.add(PathShape::closed_line(corners.to_vec(), PathStroke::from(stroke)));
        }
        Look::Uncertain => {
            let r = r * 1.25;
            let corners = [Vec2::new(0.0, -r), Vec2::new(r, 0.0), Vec2::new(0.0, r), Vec2::new(-r, 0.0)];
            painter.add(PathShape::closed_line(corners.map(|c| at + c).to_vec(), PathStroke::from(stroke)));
        }
        // Drawn whole by `marked`.
        Look::Marked => {}
        Look::Occluded => {
            painter.circle_stroke(at, r, stroke);
            let d = Vec2::splat(r * 0.7);
            painter.line_segment([at - d, at + d], stroke);
            let d = Vec2::new(d.x, -d.y);
            painter.line_segment([at - d, at + d], stroke);
        }
        Look::Locked => {
            let square = Rect::from_center_size(at, Vec2::splat(2.0 * r - 1.0));
            painter.rect_stroke(square, 0.0, stroke, egui::StrokeKind::Middle);
        }
    }
}

/// Four dashes around, as long as the gaps: on a point of ten pixels the halo closes smaller gaps, and the circle looks like that of a mark.
fn dashed_circle(painter: &Painter, at: Pos2, r: f32, stroke: Stroke) {
    let arcs = 4;
    for k in 0..arcs {
        let from = std::f32::consts::TAU * k as f32 / arcs as f32;
        let points: Vec<Pos2> = (0..=4)
            .map(|i| at + r * Vec2::angled(from + std::f32::consts::TAU * 0.5 / arcs as f32 * i as f32 / 4.0))
            .collect();
        painter.add(Shape::line(points, stroke));
    }
}

/// A name beside a point, readable on any picture.
pub fn name(painter: &Painter, at: Pos2, text: &str) {
    let font = egui::FontId::proportional(11.0);
    let place = at + Vec2::new(RADIUS.0 + 6.0, -2.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = egui::Align2::LEFT_CENTER.anchor_size(place, galley.size());
    painter.rect_filled(rect.expand2(Vec2::new(3.0, 0.0)), 3.0, on_picture::HALO);
    painter.galley(rect.min, galley, Color32::WHITE);
}

/// The legend: every shape and every colour with its word.
pub fn legend_ui(ui: &mut egui::Ui) {
    let swatch = |ui: &mut egui::Ui, look: Look, kind: Kind, word: &str| {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(Vec2::splat(18.0), egui::Sense::hover());
            let dark = ui.visuals().dark_mode;
            let behind = if dark { Color32::from_gray(70) } else { Color32::from_gray(120) };
            ui.painter().rect_filled(rect, 4.0, behind);
            paint(ui.painter(), rect.center(), RADIUS.0, look, kind, Lit::No, 1.0);
            ui.label(word);
        });
    };
    egui::Grid::new("legend").num_columns(2).spacing(Vec2::new(16.0, 4.0)).show(ui, |ui| {
        let kinds = [Kind::Landmark, Kind::Feature, Kind::Still, Kind::Fixed];
        for (i, look) in Look::ALL.into_iter().enumerate() {
            swatch(ui, look, Kind::Feature, look.word());
            if let Some(kind) = kinds.get(i) {
                swatch(ui, Look::Marked, *kind, kind.word());
            }
            ui.end_row();
        }
    });
}
