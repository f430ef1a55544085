//! The words on the canvas: title, exaggeration, and the legend of the markers and hatchings.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, pos2, vec2};

use super::canvas::Stage;
use crate::displacement::VertexState;
use crate::gui::height_map::Relief;
use crate::gui::height_map::ink::{Ink, Inks};
use crate::gui::height_map::options::{exaggeration_text, noise_floor, significant};
use crate::gui::height_map::scene::draw_marker;

/// Title, exaggeration and legend.
pub(super) fn captions(painter: &Painter, stage: &Stage<'_>) {
    let (canvas, layer, inks) = (stage.canvas, stage.layer, &stage.inks);
    let title = if layer.unit.is_empty() { layer.title.clone() } else { format!("{}, {}", layer.title, layer.unit) };
    painter.text(canvas.min + vec2(14.0, 10.0), Align2::LEFT_TOP, title, FontId::proportional(16.0), inks.text);
    let mut words = vec![match stage.options.relief {
        Relief::FaceColoured => "no heights".to_owned(),
        _ => exaggeration_text(stage.mm_per_unit, layer.unit),
    }];
    if stage.options.arrows {
        let scale = exaggeration_text(stage.arrow_mm_per_unit, stage.scene.outcome.unit());
        words.push(scale.replacen("height", "arrows", 1));
    }
    if let (true, Some(floor)) = (stage.options.noise_floor, noise_floor(layer)) {
        words.push(format!("noise floor {} {} (median ±)", significant(floor, 2), layer.unit));
    }
    let line = canvas.min + vec2(14.0, 32.0);
    painter.text(line, Align2::LEFT_TOP, words.join("   ·   "), FontId::proportional(12.0), inks.weak_text);
    legend(painter, stage);
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

fn legend(painter: &Painter, stage: &Stage<'_>) {
    let (scene, options, inks, canvas) = (stage.scene, stage.options, &stage.inks, stage.canvas);
    let has = |state| stage.findings.has(state);
    let mut entries = Vec::new();
    if options.markers {
        for (sign, state) in [
            (Sign::Measured, VertexState::Measured),
            (Sign::Inferred, VertexState::Inferred),
            (Sign::Fixed, VertexState::Fixed),
        ] {
            if has(state) {
                entries.push((sign, state.word()));
            }
        }
        if options.border && scene.outcome.border.contains(&true) {
            entries.push((Sign::Border, "border: carries reactions"));
        }
    }
    if has(VertexState::Unmeasured) {
        entries.push((Sign::Unmeasured, "not measured"));
    }
    if options.below_noise {
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

fn draw_sign(painter: &Painter, at: Pos2, sign: Sign, inks: &Inks) {
    let swatch = Rect::from_center_size(at, vec2(14.0, 10.0));
    match sign {
        Sign::Measured => marker(painter, at, VertexState::Measured, false, inks),
        Sign::Inferred => marker(painter, at, VertexState::Inferred, false, inks),
        Sign::Fixed => marker(painter, at, VertexState::Fixed, false, inks),
        Sign::Border => marker(painter, at, VertexState::Measured, true, inks),
        Sign::Unmeasured => {
            painter.rect_filled(swatch, 1.0, inks.unmeasured);
            hatch(painter, swatch, Stroke::new(1.0, inks.hatch), false);
            painter.rect_stroke(swatch, 1.0, Stroke::new(0.8, inks.hatch), egui::StrokeKind::Inside);
        }
        Sign::Noise => {
            painter.rect_filled(swatch, 1.0, Color32::from_rgb(53, 183, 121));
            hatch(painter, swatch, Stroke::new(2.6, inks.noise[0]), true);
            hatch(painter, swatch, Stroke::new(1.0, inks.noise[1]), true);
        }
    }
}

/// The marker of a vertex, as the map draws it: by the same code, a little larger than on a map with room.
fn marker(painter: &Painter, at: Pos2, state: VertexState, border: bool, inks: &Inks) {
    let mut ink = Ink::plain(painter.ctx());
    draw_marker(&mut ink, at, 1.1, state, border, inks);
    painter.add(egui::Shape::mesh(ink.into_mesh()));
}

/// Diagonal lines over a rectangle.
pub(super) fn hatch(painter: &Painter, rect: Rect, stroke: Stroke, falling: bool) {
    let clipped = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let mut x = rect.left() - rect.height();
    while x < rect.right() {
        let (a, b) = (pos2(x, rect.bottom()), pos2(x + rect.height(), rect.top()));
        let ends = if falling { [pos2(a.x, b.y), pos2(b.x, a.y)] } else { [a, b] };
        clipped.line_segment(ends, stroke);
        x += 5.0;
    }
}
