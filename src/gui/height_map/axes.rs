//! The base grid of the height map with its millimetres, the height axis, and the little tripod that tells the directions.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Vec2, pos2, vec2};
use nalgebra::{Point3, Vector3};

use super::ink::Inks;
use super::options::significant;
use crate::gui::orbit_view::Projection;

/// Distance of the grid's lines, mm.
const GRID_MM: f64 = 20.0;
/// Axes shorter than this on the screen carry no numbers, points.
const SHORTEST_AXIS: f32 = 70.0;

/// The rectangle in the plan on which the map stands, mm, out to whole lines of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Smallest x and y.
    pub low: [f64; 2],
    /// Largest x and y.
    pub high: [f64; 2],
    /// Height at which it lies.
    pub z: f64,
}

impl Ground {
    /// The ground under the feet of the surface.
    pub fn under<'a>(feet: impl Iterator<Item = &'a Point3<f64>>, at_plane: bool) -> Self {
        let (mut low, mut high, mut z) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::INFINITY);
        for p in feet {
            for (k, c) in [p.x, p.y].into_iter().enumerate() {
                low[k] = low[k].min(c);
                high[k] = high[k].max(c);
            }
            z = z.min(p.z);
        }
        if !z.is_finite() {
            return Self { low: [-GRID_MM; 2], high: [GRID_MM; 2], z: 0.0 };
        }
        Self {
            low: low.map(|c| ((c - 4.0) / GRID_MM).floor() * GRID_MM),
            high: high.map(|c| ((c + 4.0) / GRID_MM).ceil() * GRID_MM),
            z: if at_plane { 0.0 } else { (z / GRID_MM).floor() * GRID_MM },
        }
    }

    /// Whether a foot stands on it.
    pub fn holds(&self, foot: &Point3<f64>) -> bool {
        let within = |c: f64, k: usize| (self.low[k]..=self.high[k]).contains(&c);
        within(foot.x, 0) && within(foot.y, 1)
    }

    /// Its corners, in order round it.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let ([x0, y0], [x1, y1]) = (self.low, self.high);
        [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| Point3::new(x, y, self.z))
    }
}

fn lines(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let count = ((high - low) / GRID_MM).round().clamp(0.0, 500.0) as usize;
    (0..=count).map(move |k| low + k as f64 * GRID_MM)
}

/// The height axis: its title, and the values at its ticks.
pub struct HeightAxis<'a> {
    /// "Force, N".
    pub title: &'a str,
    /// Values with a tick.
    pub ticks: &'a [f64],
    /// mm per unit.
    pub mm_per_unit: f64,
}

/// Draws grid, millimetres and height axis; everything that stands on the ground is drawn after it.
pub fn draw(painter: &Painter, projection: &Projection, ground: &Ground, height: Option<&HeightAxis<'_>>, inks: &Inks) {
    let ui = |x: f64, y: f64, z: f64| projection.ui_from_face(&Point3::new(x, y, z));
    let ([x0, y0], [x1, y1], z) = (ground.low, ground.high, ground.z);
    let thin = Stroke::new(0.8, inks.grid);
    for x in lines(x0, x1) {
        painter.line_segment([ui(x, y0, z), ui(x, y1, z)], thin);
    }
    for y in lines(y0, y1) {
        painter.line_segment([ui(x0, y, z), ui(x1, y, z)], thin);
    }
    let middle =
        ground.corners().map(|c| projection.ui_from_face(&c).to_vec2()).iter().fold(Vec2::ZERO, |a, b| a + *b) / 4.0;
    // Numbers stand along the edges nearest to the eye, where nothing covers them; seen from straight above, at the lower and left edge.
    let eye = projection.towards_eye_in_face();
    let near_y = if eye.y > 1e-6 { y1 } else { y0 };
    let near_x = if eye.x > 1e-6 { x1 } else { x0 };
    plan_axis(painter, inks, middle, "x, mm", lines(x0, x1).map(|x| (x, ui(x, near_y, z))));
    plan_axis(painter, inks, middle, "y, mm", lines(y0, y1).map(|y| (y, ui(near_x, y, z))));
    if let Some(height) = height {
        height_axis(painter, projection, ground, height, inks);
    }
}

fn plan_axis(painter: &Painter, inks: &Inks, middle: Vec2, title: &str, ticks: impl Iterator<Item = (f64, Pos2)>) {
    let ticks: Vec<(f64, Pos2)> = ticks.collect();
    let (Some(first), Some(last)) = (ticks.first(), ticks.last()) else { return };
    let along = last.1 - first.1;
    if along.length() < SHORTEST_AXIS {
        return;
    }
    let between = along.length() / (ticks.len() - 1).max(1) as f32;
    let every = (26.0 / between).ceil().max(1.0) as i64;
    let out = outwards(along, f32::midpoint(first.1.x, last.1.x), f32::midpoint(first.1.y, last.1.y), middle);
    painter.line_segment([first.1, last.1], Stroke::new(1.0, inks.axis));
    for &(value, at) in &ticks {
        painter.line_segment([at, at + out * 4.0], Stroke::new(1.0, inks.axis));
        if (value / GRID_MM).round() as i64 % every == 0 {
            let text = format!("{value:.0}").replace('-', "−");
            painter.text(at + out * 6.0, anchor(out), text, FontId::proportional(10.5), inks.weak_text);
        }
    }
    let centre = first.1 + along / 2.0;
    painter.text(
        centre + out * if out.x.abs() > out.y.abs() { 34.0 } else { 20.0 },
        anchor(out),
        title,
        FontId::proportional(11.5),
        inks.text,
    );
}

/// Across the axis, away from the middle of the ground.
fn outwards(along: Vec2, x: f32, y: f32, middle: Vec2) -> Vec2 {
    let across = Vec2::new(-along.y, along.x).normalized();
    if across.dot(vec2(x, y) - middle) < 0.0 { -across } else { across }
}

fn anchor(out: Vec2) -> Align2 {
    if out.x.abs() > out.y.abs() {
        if out.x > 0.0 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER }
    } else if out.y > 0.0 {
        Align2::CENTER_TOP
    } else {
        Align2::CENTER_BOTTOM
    }
}

/// Stands on the corner of the ground that is farthest to the left on the screen, where no part of the surface lies before it.
fn height_axis(painter: &Painter, projection: &Projection, ground: &Ground, axis: &HeightAxis<'_>, inks: &Inks) {
    let corners = ground.corners();
    let Some(corner) = corners.iter().min_by(|a, b| {
        let (a, b) = (projection.ui_from_face(a), projection.ui_from_face(b));
        // At equal x (a view along an axis) the farther one, so that the numbers of the plan keep their place.
        (a.x - b.x)
            .abs()
            .partial_cmp(&0.5)
            .filter(|o| o.is_lt())
            .map_or_else(|| a.x.total_cmp(&b.x), |_| a.y.total_cmp(&b.y))
    }) else {
        return;
    };
    let at = |value: f64| projection.ui_from_face(&(corner + Vector3::new(0.0, 0.0, value * axis.mm_per_unit)));
    let (Some(&low), Some(&high)) = (axis.ticks.first(), axis.ticks.last()) else { return };
    let (foot, head) = (at(low), at(high));
    let length = foot.y - head.y;
    if length < SHORTEST_AXIS / 2.0 {
        return;
    }
    painter.line_segment([foot, head], Stroke::new(1.0, inks.axis));
    let every = (14.0 / (length / (axis.ticks.len() - 1).max(1) as f32)).ceil().max(1.0) as usize;
    for (k, &value) in axis.ticks.iter().enumerate() {
        let tick = at(value);
        painter.line_segment([tick, tick - vec2(4.0, 0.0)], Stroke::new(1.0, inks.axis));
        // Zero would run into the numbers of the plan.
        if k % every == 0 && value != 0.0 {
            let text = significant(value, 2);
            painter.text(tick - vec2(6.0, 0.0), Align2::RIGHT_CENTER, text, FontId::proportional(10.5), inks.weak_text);
        }
    }
    painter.text(head - vec2(0.0, 8.0), Align2::CENTER_BOTTOM, axis.title, FontId::proportional(11.5), inks.text);
}

/// Draws the directions of x, y and height into a corner of the canvas.
pub fn tripod(painter: &Painter, canvas: Rect, projection: &Projection, inks: &Inks) {
    let origin = pos2(canvas.left() + 40.0, canvas.bottom() - 66.0);
    let arms = [
        ("x", Vector3::x(), Color32::from_rgb(200, 70, 60)),
        ("y", Vector3::y(), Color32::from_rgb(70, 150, 70)),
        ("h", Vector3::z(), Color32::from_rgb(70, 110, 210)),
    ];
    let mut seen = arms.map(|(name, direction, colour)| (name, projection.view_from_face * direction, colour));
    seen.sort_by(|a, b| a.1.z.total_cmp(&b.1.z));
    for (name, direction, colour) in seen {
        let arm = vec2(direction.x as f32, -direction.y as f32) * 24.0;
        if arm.length() > 2.0 {
            painter.line_segment([origin, origin + arm], Stroke::new(2.0, colour));
            let text = origin + arm + arm.normalized() * 8.0;
            painter.text(text, Align2::CENTER_CENTER, name, FontId::proportional(11.0), inks.text);
        } else {
            painter.circle_filled(origin, 2.5, colour);
        }
    }
}
