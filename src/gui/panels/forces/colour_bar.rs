//! The colour bar: title, unit, ticks, and at each end how many values lie beyond it.

use egui::{Align2, Color32, FontId, Painter, Rect, Shape, Stroke, pos2, vec2};

use crate::draw::robust_range::SHARE;
use crate::draw::ticks::{labels, nice_ticks};
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::{ColourCurve, Layer, Palette, RangeMode};

/// Width of the bar, points.
const WIDTH: f32 = 16.0;

/// Draws the bar at the right side of the canvas.
pub(in crate::gui::panels) fn show(
    painter: &Painter,
    canvas: Rect,
    layer: &Layer,
    palette: &Palette,
    mode: RangeMode,
    inks: &Inks,
) {
    let height = (canvas.height() - 150.0).clamp(60.0, 420.0);
    let left = canvas.right() - 84.0;
    let top = canvas.top() + 66.0;
    let bar = Rect::from_min_size(pos2(left, top), vec2(WIDTH, height));
    gradient(painter, bar, palette);
    let (below, above) = palette.range.clipped(&layer.values);
    end(painter, bar, palette, above > 0, true);
    end(painter, bar, palette, below > 0, false);
    painter.rect_stroke(bar, 0.0, Stroke::new(1.0, inks.axis), egui::StrokeKind::Outside);
    numbers(painter, bar, palette, inks);

    let small = FontId::proportional(11.0);
    let head = bar.top() - if above > 0 { 14.0 } else { 6.0 };
    painter.text(
        pos2(bar.center().x, head),
        Align2::CENTER_BOTTOM,
        layer.axis_title(),
        FontId::proportional(12.5),
        inks.text,
    );
    let note = |y: f32, text: String| {
        painter.text(pos2(canvas.right() - 14.0, y), Align2::RIGHT_TOP, text, small.clone(), inks.weak_text);
    };
    let mut y = bar.bottom() + if below > 0 { 16.0 } else { 8.0 };
    let mut words = vec![match mode {
        RangeMode::Auto => "auto range".to_owned(),
        RangeMode::InView => "range of this view".to_owned(),
        RangeMode::Locked(_) => "range locked".to_owned(),
    }];
    // What no reaction and no fixture explains: said, so that nobody takes the end of the bar for the greatest force.
    let believed = layer.values.iter().zip(&layer.sets_range).filter(|(_, sets)| **sets).map(|(v, _)| *v);
    let (low_cut, high_cut) = palette.range.clipped(&believed.collect::<Vec<_>>());
    if !matches!(mode, RangeMode::Locked(_)) && low_cut + high_cut > 0 {
        words.push(format!("{:.0} % of forces", 100.0 * SHARE));
    }
    if palette.curve != ColourCurve::Linear {
        words.push(palette.curve.label().to_lowercase());
    }
    if above > 0 {
        words.push(format!("{above} above"));
    }
    if below > 0 {
        words.push(format!("{below} below"));
    }
    for line in words {
        note(y, line);
        y += 14.0;
    }
}

fn gradient(painter: &Painter, bar: Rect, palette: &Palette) {
    const STEPS: usize = 160;
    let [low, high] = palette.tones();
    let mut mesh = egui::Mesh::default();
    for k in 0..=STEPS {
        let share = k as f32 / STEPS as f32;
        let colour = tone_colour(palette, low + f64::from(share) * (high - low));
        let y = bar.bottom() - share * bar.height();
        mesh.colored_vertex(pos2(bar.left(), y), colour);
        mesh.colored_vertex(pos2(bar.right(), y), colour);
        if k > 0 {
            let i = 2 * k as u32;
            mesh.add_triangle(i - 2, i - 1, i);
            mesh.add_triangle(i - 1, i, i + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
}

fn tone_colour(palette: &Palette, tone: f64) -> Color32 {
    let [r, g, b] = palette.map.at(tone);
    Color32::from_rgb(r, g, b)
}

/// A point on the end of the bar where values lie beyond it.
fn end(painter: &Painter, bar: Rect, palette: &Palette, clipped: bool, upper: bool) {
    if !clipped {
        return;
    }
    let [low, high] = palette.tones();
    let (y, tip, tone) = if upper { (bar.top(), -10.0, high) } else { (bar.bottom(), 10.0, low) };
    let corners = vec![pos2(bar.left(), y), pos2(bar.right(), y), pos2(bar.center().x, y + tip)];
    painter.add(Shape::convex_polygon(corners, tone_colour(palette, tone), Stroke::NONE));
}

fn numbers(painter: &Painter, bar: Rect, palette: &Palette, inks: &Inks) {
    let range = palette.range;
    let values = match palette.curve {
        ColourCurve::Linear => nice_ticks(range.low, range.high, 4),
        ColourCurve::SquareRoot | ColourCurve::Logarithm => {
            let mut values = nice_ticks(range.low, range.high, 4);
            let most = range.high.abs().max(range.low.abs());
            let finer = [0.01, 0.02, 0.05, 0.1].map(|share| share * most);
            values.extend(finer.iter().flat_map(|v| [*v, -*v]).filter(|v| (range.low..=range.high).contains(v)));
            values
        }
    };
    let even = palette.curve == ColourCurve::Linear;
    let texts: Vec<String> = if even {
        labels(&values)
    } else {
        values.iter().map(|v| crate::gui::height_map::options::significant(*v, 2)).collect()
    };
    let [low, high] = palette.tones();
    let mut taken: Vec<f32> = Vec::new();
    for (value, text) in values.iter().zip(texts) {
        let share = ((palette.tone(*value) - low) / (high - low).max(1e-12)) as f32;
        let y = bar.bottom() - share * bar.height();
        if taken.iter().any(|t| (t - y).abs() < 13.0) {
            continue;
        }
        taken.push(y);
        painter.line_segment([pos2(bar.right(), y), pos2(bar.right() + 4.0, y)], Stroke::new(1.0, inks.axis));
        painter.text(pos2(bar.right() + 7.0, y), Align2::LEFT_CENTER, text, FontId::proportional(11.5), inks.text);
    }
}
