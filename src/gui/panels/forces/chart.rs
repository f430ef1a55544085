//! A small line chart with error bars, axes with units, and points that can be pointed at.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, pos2, vec2};

use super::legend::hatch;
use crate::draw::ticks::{labels, nice_ticks};
use crate::gui::height_map::ink::Inks;
use crate::muscle_field::section::{ProfilePoint, Section};

/// What a chart shows.
pub(in crate::gui::panels) struct Chart<'a> {
    /// Above it.
    pub(in crate::gui::panels) title: &'a str,
    /// Under the horizontal axis: "y, mm".
    pub(in crate::gui::panels) across: &'a str,
    /// Limits of the horizontal axis; those of the data with a little room without them.
    pub(in crate::gui::panels) along: Option<[f64; 2]>,
    /// At the vertical axis: "Force, N".
    pub(in crate::gui::panels) up: &'a str,
    /// The data.
    pub(in crate::gui::panels) section: &'a Section,
    /// Further lines: what models say, each with its colour; a place without a number breaks the line.
    pub(in crate::gui::panels) curves: &'a [(Stroke, &'a [[f64; 2]])],
    /// Limits of the vertical axis.
    pub(in crate::gui::panels) values: [f64; 2],
    /// Colour of a value.
    pub(in crate::gui::panels) colour: &'a dyn Fn(f64) -> Color32,
    /// Vertices lit up: selected and hovered.
    pub(in crate::gui::panels) lit: [Option<usize>; 2],
}

/// How near the pointer must come to a point, points.
const REACH: f32 = 14.0;

/// Draws the chart into `rect`; gives the vertex under the pointer and the places of the points.
pub(in crate::gui::panels) fn draw(
    painter: &Painter,
    rect: Rect,
    chart: &Chart<'_>,
    pointer: Option<Pos2>,
    inks: &Inks,
) -> Option<usize> {
    let plot = Rect::from_min_max(rect.min + vec2(52.0, 22.0), rect.max - vec2(12.0, 34.0));
    painter.text(rect.min + vec2(52.0, 4.0), Align2::LEFT_TOP, chart.title, FontId::proportional(12.0), inks.text);
    if plot.width() < 40.0 || plot.height() < 30.0 {
        return None;
    }
    let Some([from, to]) = span(chart) else {
        painter.rect_filled(plot, 0.0, inks.unmeasured);
        hatch(painter, plot, Stroke::new(1.0, inks.hatch), false);
        painter.text(
            plot.center(),
            Align2::CENTER_CENTER,
            "nothing measured on this line",
            FontId::proportional(12.0),
            inks.text,
        );
        return None;
    };
    let [low, high] = chart.values;
    let x = |at: f64| plot.left() + plot.width() * ((at - from) / (to - from)) as f32;
    let y = |value: f64| plot.bottom() - plot.height() * ((value - low) / (high - low)) as f32;
    frame(painter, plot, chart, [from, to], &x, &y, inks);
    let clipped = painter.with_clip_rect(plot.expand(5.0).intersect(painter.clip_rect()));
    gaps(&clipped, plot, chart.section, [from, to], &x, inks);
    for [a, b] in &chart.section.pieces {
        let colour = (chart.colour)(f64::midpoint(a[1], b[1]));
        let ends = [pos2(x(a[0]), y(a[1])), pos2(x(b[0]), y(b[1]))];
        clipped.line_segment(ends, Stroke::new(3.4, inks.axis.gamma_multiply(0.35)));
        clipped.line_segment(ends, Stroke::new(2.4, colour));
    }
    for (stroke, points) in chart.curves {
        for run in points.split(|p| !p[1].is_finite()).filter(|run| run.len() > 1) {
            let line: Vec<Pos2> = run.iter().map(|p| pos2(x(p[0]), y(p[1]))).collect();
            clipped.add(egui::Shape::line(line, *stroke));
        }
    }
    let mut nearest: Option<(f32, usize)> = None;
    for point in &chart.section.points {
        let at = pos2(x(point.at_mm), y(point.value));
        error_bar(&clipped, point, at.x, &y, inks);
        clipped.circle_filled(at, 2.8, inks.canvas);
        clipped.circle_filled(at, 2.1, inks.text);
        if let Some(distance) = pointer.map(|p| p.distance(at)).filter(|d| *d < REACH)
            && nearest.is_none_or(|(d, _)| distance < d)
        {
            nearest = Some((distance, point.vertex));
        }
    }
    for (vertex, colour, radius) in [(chart.lit[0], inks.selected, 5.5), (chart.lit[1], inks.hovered, 4.5)] {
        if let Some(point) = chart.section.points.iter().find(|p| Some(p.vertex) == vertex) {
            clipped.circle_stroke(pos2(x(point.at_mm), y(point.value)), radius, Stroke::new(2.0, colour));
        }
    }
    nearest.map(|(_, vertex)| vertex)
}

/// First and last coordinate of the data, with a little room.
fn span(chart: &Chart<'_>) -> Option<[f64; 2]> {
    if chart.along.is_some() {
        return chart.along;
    }
    let section = chart.section;
    let of_curves = chart.curves.iter().flat_map(|(_, points)| points.iter()).map(|p| p[0]);
    let ends = section.pieces.iter().flatten().map(|p| p[0]).chain(section.points.iter().map(|p| p.at_mm));
    let ends = ends.chain(of_curves);
    let (from, to) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
    let room = ((to - from) * 0.03).max(1.0);
    from.is_finite().then_some([from - room, to + room])
}

fn frame(
    painter: &Painter,
    plot: Rect,
    chart: &Chart<'_>,
    [from, to]: [f64; 2],
    x: &dyn Fn(f64) -> f32,
    y: &dyn Fn(f64) -> f32,
    inks: &Inks,
) {
    let small = FontId::proportional(10.5);
    let thin = Stroke::new(0.8, inks.grid);
    let up = nice_ticks(chart.values[0], chart.values[1], if plot.height() > 110.0 { 3 } else { 2 });
    for (value, text) in up.iter().zip(labels(&up)) {
        painter.line_segment([pos2(plot.left(), y(*value)), pos2(plot.right(), y(*value))], thin);
        painter.text(pos2(plot.left() - 5.0, y(*value)), Align2::RIGHT_CENTER, text, small.clone(), inks.weak_text);
    }
    let across = nice_ticks(from, to, (plot.width() / 90.0).clamp(2.0, 8.0) as usize);
    for (at, text) in across.iter().zip(labels(&across)) {
        painter.line_segment([pos2(x(*at), plot.top()), pos2(x(*at), plot.bottom())], thin);
        painter.text(pos2(x(*at), plot.bottom() + 4.0), Align2::CENTER_TOP, text, small.clone(), inks.weak_text);
    }
    if chart.values[0] < 0.0 {
        painter.line_segment([pos2(plot.left(), y(0.0)), pos2(plot.right(), y(0.0))], Stroke::new(1.0, inks.axis));
    }
    painter.line_segment([plot.left_top(), plot.left_bottom()], Stroke::new(1.0, inks.axis));
    painter.line_segment([plot.left_bottom(), plot.right_bottom()], Stroke::new(1.0, inks.axis));
    let title = FontId::proportional(11.0);
    painter.text(
        pos2(plot.center().x, plot.bottom() + 18.0),
        Align2::CENTER_TOP,
        chart.across,
        title.clone(),
        inks.text,
    );
    // Reads upwards beside the axis.
    let galley = painter.layout_no_wrap(chart.up.to_owned(), title, inks.text);
    let at = pos2(plot.left() - 46.0, plot.center().y + galley.size().x / 2.0);
    let mut words = egui::epaint::TextShape::new(at, galley, inks.text);
    words.angle = -std::f32::consts::FRAC_PI_2;
    painter.add(words);
}

/// Hatches what lies between pieces of the curve: nothing was measured there.
fn gaps(painter: &Painter, plot: Rect, section: &Section, [from, to]: [f64; 2], x: &dyn Fn(f64) -> f32, inks: &Inks) {
    if section.pieces.is_empty() {
        return;
    }
    let mut reached = from;
    let ends = section.pieces.iter().map(|[a, b]| (a[0], b[0])).chain([(to, to)]);
    for (begin, end) in ends {
        if begin > reached + 0.05 && reached > from {
            let gap = Rect::from_x_y_ranges(x(reached)..=x(begin.min(to)), plot.y_range());
            if begin < to {
                painter.rect_filled(gap, 0.0, inks.unmeasured);
                hatch(painter, gap, Stroke::new(1.0, inks.hatch), false);
            }
        }
        reached = reached.max(end);
    }
}

fn error_bar(painter: &Painter, point: &ProfilePoint, x: f32, y: &dyn Fn(f64) -> f32, inks: &Inks) {
    let Some(error) = point.error.filter(|e| *e > 0.0) else { return };
    let (top, bottom) = (y(point.value + error), y(point.value - error));
    let stroke = Stroke::new(1.0, inks.text.gamma_multiply(0.75));
    painter.line_segment([pos2(x, top), pos2(x, bottom)], stroke);
    for end in [top, bottom] {
        painter.line_segment([pos2(x - 2.5, end), pos2(x + 2.5, end)], stroke);
    }
}
