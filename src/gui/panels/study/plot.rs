//! A chart with logarithmic axes that can be pointed at, moved and zoomed: methods as lines, failures hollow.

use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::gui::height_map::ink::Inks;
use crate::gui::keys::{self, is_held};
use crate::gui::wheel::zoom_factor;

/// A mark is pointed at when the pointer comes so near, points.
const REACH: f32 = 11.0;
/// Room for the numbers and words: left, top, right, bottom.
const ROOM: [f32; 4] = [66.0, 14.0, 16.0, 44.0];
/// Height of the band of runs that have no answer, points.
const BAND: f32 = 26.0;

/// One mark.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dot {
    /// Along; above zero.
    pub(super) x: f64,
    /// Up; none for runs without an answer, which stand in a band of their own.
    pub(super) y: Option<f64>,
    /// Hollow: something failed.
    pub(super) failed: bool,
    /// With a ring: nobody beats it.
    pub(super) front: bool,
    /// The setting, by which it is known again.
    pub(super) setting: String,
    /// Said when it is pointed at.
    pub(super) words: String,
}

/// One method.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    /// Its name.
    pub(super) method: String,
    /// Its place among all methods of the table, which gives colour and shape.
    pub(super) place: usize,
    /// Its marks, in the order of its sweep.
    pub(super) dots: Vec<Dot>,
}

/// The words of a power of ten on an axis.
pub(super) type Tick = fn(i32) -> String;

/// What is drawn.
pub(super) struct Plot<'a> {
    /// Name for people and screen readers.
    pub(super) title: &'a str,
    /// Words along and up.
    pub(super) axes: [&'a str; 2],
    /// Words of a power of ten along and up.
    pub(super) ticks: [Tick; 2],
    /// A line across, with its words.
    pub(super) live: Option<(f64, &'a str)>,
    pub(super) lines: &'a [Line],
    /// Method and setting that are picked.
    pub(super) picked: Option<(&'a str, &'a str)>,
    /// Methods and settings that were chosen, and for what.
    pub(super) chosen: &'a [Chosen],
}

/// A mark that was chosen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chosen {
    pub(super) method: String,
    pub(super) setting: String,
    /// "for 10 %", once for every goal that it is chosen for.
    pub(super) words: String,
}

/// The part that is seen: powers of ten along and up; all while none.
pub(super) type Seen = Option<[[f64; 2]; 2]>;

/// What the pointer is on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pointed {
    /// Line and dot.
    pub(super) dot: Option<[usize; 2]>,
    /// Whether it was pressed, and whether twice.
    pub(super) clicked: bool,
    pub(super) twice: bool,
}

/// Whole powers of ten around values, with a little room.
fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let logs = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
    let [low, high] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    if low > high { [-1.0, 1.0] } else { [(low - 0.05).floor(), (high + 0.05).ceil()] }
}

struct Place {
    plot: Rect,
    seen: [[f64; 2]; 2],
}

impl Place {
    fn x(&self, v: f64) -> f32 {
        let [low, high] = self.seen[0];
        self.plot.left() + ((v.log10() - low) / (high - low)) as f32 * self.plot.width()
    }

    fn y(&self, v: f64) -> f32 {
        let [low, high] = self.seen[1];
        self.plot.bottom() - ((v.log10() - low) / (high - low)) as f32 * self.plot.height()
    }

    fn of(&self, dot: &Dot) -> Pos2 {
        pos2(self.x(dot.x), dot.y.map_or(self.plot.top() - 0.5 * BAND - 2.0, |y| self.y(y)))
    }
}

/// Draws the chart into `rect`. The wheel zooms at the pointer, a drag moves, a double click beside the marks shows all.
pub(super) fn show(ui: &mut Ui, rect: Rect, chart: &Plot<'_>, seen: &mut Seen) -> Pointed {
    let response = ui.interact(rect, ui.scope_id().with(chart.title), Sense::click_and_drag());
    let inks = Inks::new(ui.visuals(), false);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 4.0, inks.canvas);
    let dots = || chart.lines.iter().flat_map(|l| &l.dots);
    let all = [decades(dots().map(|d| d.x).chain(chart.live.map(|l| l.0))), decades(dots().filter_map(|d| d.y))];
    let band = if dots().any(|d| d.y.is_none()) { BAND } else { 0.0 };
    let plot = Rect::from_min_max(rect.min + vec2(ROOM[0], ROOM[1] + band), rect.max - vec2(ROOM[2], ROOM[3]));
    let mut place = Place { plot, seen: seen.unwrap_or(all) };
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|p| response.contains_pointer() && rect.contains(*p));
    let pan = is_held(ui.ctx(), keys::Hold::Pan);
    if response.dragged() || (pan && pointer.is_some()) {
        let d = if response.dragged() { response.drag_delta() } else { ui.input(|i| i.pointer.delta()) };
        move_by(&mut place, d);
        *seen = Some(place.seen);
    }
    if let Some(at) = pointer {
        let factor = zoom_factor(ui);
        if (factor - 1.0).abs() > 1e-6 {
            zoom(&mut place, at, factor);
            *seen = Some(place.seen);
        }
    }
    frame(&painter, chart, &place, &inks, band);
    let clip = Rect::from_min_max(pos2(plot.left() - 7.0, plot.top() - band - 7.0), plot.max + vec2(7.0, 7.0));
    let inside = ui.painter_at(rect).with_clip_rect(clip);
    front(&inside, chart, &place, &inks);
    for line in chart.lines {
        draw(&inside, line, &place, &inks);
    }
    let find = |method: &str, setting: &str| {
        chart.lines.iter().filter(|l| l.method == method).flat_map(|l| &l.dots).find(|d| d.setting == setting)
    };
    for chosen in chart.chosen {
        if let Some(dot) = find(&chosen.method, &chosen.setting) {
            let at = place.of(dot);
            inside.circle_stroke(at, 12.0, Stroke::new(2.5, inks.text));
            let font = FontId::proportional(12.5);
            inside.text(at + vec2(0.0, 16.0), Align2::CENTER_TOP, &chosen.words, font, inks.text);
        }
    }
    if let Some(dot) = chart.picked.and_then(|(method, setting)| find(method, setting)) {
        inside.circle_stroke(place.of(dot), 11.0, Stroke::new(2.0, inks.selected));
    }
    name_dots(ui, &response, chart, &place);
    let dot = pointer.filter(|_| !response.dragged()).and_then(|at| nearest(chart.lines, &place, at));
    if let Some([l, d]) = dot {
        let at = place.of(&chart.lines[l].dots[d]);
        inside.circle_stroke(at, 8.5, Stroke::new(1.5, inks.hovered));
        response.clone().on_hover_text_at_pointer(&chart.lines[l].dots[d].words);
    }
    if response.double_clicked() && dot.is_none() {
        *seen = None;
    }
    let words = format!("Chart, {}: {} methods, {} points", chart.title, chart.lines.len(), dots().count());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, &words));
    Pointed { dot, clicked: response.clicked(), twice: response.double_clicked() }
}

/// Gives every mark that is seen a name, for screen readers and tests.
fn name_dots(ui: &Ui, response: &egui::Response, chart: &Plot<'_>, place: &Place) {
    for (l, line) in chart.lines.iter().enumerate() {
        for (d, dot) in line.dots.iter().enumerate() {
            let at = place.of(dot);
            if response.rect.contains(at) {
                let rect = Rect::from_center_size(at, vec2(10.0, 10.0));
                let mark = ui.interact(rect, response.id.with((l, d)), Sense::hover());
                mark.widget_info(|| WidgetInfo::labeled(Role::GraphicsSymbol, true, dot.words.replace('\n', ", ")));
            }
        }
    }
}

/// Zooms the part that is seen about its middle.
pub(super) fn zoom_middle(seen: &mut Seen, all: [[f64; 2]; 2], factor: f64) {
    let now = seen.unwrap_or(all);
    *seen = Some(now.map(|[low, high]| {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) / factor);
        [middle - half, middle + half]
    }));
}

/// What of the lines is seen when all is.
pub(super) fn whole(lines: &[Line], live: Option<f64>) -> [[f64; 2]; 2] {
    let dots = || lines.iter().flat_map(|l| &l.dots);
    [decades(dots().map(|d| d.x).chain(live)), decades(dots().filter_map(|d| d.y))]
}

fn move_by(place: &mut Place, d: egui::Vec2) {
    let sizes = [place.plot.width(), place.plot.height()];
    for (k, by) in [(0, -d.x), (1, d.y)] {
        let [low, high] = place.seen[k];
        let shift = f64::from(by / sizes[k].max(1.0)) * (high - low);
        place.seen[k] = [low + shift, high + shift];
    }
}

fn zoom(place: &mut Place, at: Pos2, factor: f64) {
    let shares = [
        f64::from((at.x - place.plot.left()) / place.plot.width().max(1.0)),
        f64::from((place.plot.bottom() - at.y) / place.plot.height().max(1.0)),
    ];
    for (range, share) in place.seen.iter_mut().zip(shares) {
        let [low, high] = *range;
        // From a hundredth of a decade to forty.
        let size = ((high - low) / factor).clamp(0.01, 40.0);
        let fixed = low + share * (high - low);
        *range = [fixed - share * size, fixed + (1.0 - share) * size];
    }
}

fn nearest(lines: &[Line], place: &Place, at: Pos2) -> Option<[usize; 2]> {
    let all =
        lines.iter().enumerate().flat_map(|(l, line)| line.dots.iter().enumerate().map(move |(d, dot)| ([l, d], dot)));
    let near = all.map(|(key, dot)| (key, place.of(dot).distance(at))).filter(|(_, far)| *far <= REACH);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(key, _)| key)
}

fn frame(painter: &Painter, chart: &Plot<'_>, place: &Place, inks: &Inks, band: f32) {
    let (plot, font) = (place.plot, FontId::proportional(11.5));
    let powers = |[low, high]: [f64; 2], most: f64| {
        let step = ((high - low) / most).ceil().max(1.0) as i32;
        (low.ceil() as i32..=high.floor() as i32).filter(move |p| p.rem_euclid(step) == 0)
    };
    for p in powers(place.seen[0], 9.0) {
        let x = place.x(10_f64.powi(p));
        painter.vline(x, plot.y_range(), Stroke::new(1.0, inks.grid));
        painter.text(pos2(x, plot.bottom() + 5.0), Align2::CENTER_TOP, (chart.ticks[0])(p), font.clone(), inks.text);
    }
    for p in powers(place.seen[1], 8.0) {
        let y = place.y(10_f64.powi(p));
        painter.hline(plot.x_range(), y, Stroke::new(1.0, inks.grid));
        painter.text(pos2(plot.left() - 7.0, y), Align2::RIGHT_CENTER, (chart.ticks[1])(p), font.clone(), inks.text);
    }
    if band > 0.0 {
        let strip = Rect::from_min_max(pos2(plot.left(), plot.top() - band), pos2(plot.right(), plot.top() - 4.0));
        painter.rect_filled(strip, 3.0, inks.unmeasured);
        let at = pos2(plot.left() - 7.0, strip.center().y);
        painter.text(at, Align2::RIGHT_CENTER, "failed", font.clone(), inks.weak_text);
    }
    if let Some((at, words)) = chart.live.filter(|l| plot.x_range().contains(place.x(l.0))) {
        let x = place.x(at);
        painter.vline(x, plot.y_range(), Stroke::new(1.5, inks.axis));
        painter.text(pos2(x + 5.0, plot.top() + 4.0), Align2::LEFT_TOP, words, font, inks.weak_text);
    }
    let axis = Stroke::new(1.0, inks.axis);
    painter.line_segment([plot.left_top(), plot.left_bottom()], axis);
    painter.line_segment([plot.left_bottom(), plot.right_bottom()], axis);
    let title = FontId::proportional(12.5);
    let below = pos2(plot.center().x, plot.bottom() + 38.0);
    painter.text(below, Align2::CENTER_BOTTOM, chart.axes[0], title.clone(), inks.text);
    let galley = painter.layout_no_wrap(chart.axes[1].to_owned(), title, inks.text);
    let at = pos2(plot.left() - ROOM[0] + 4.0, plot.center().y + galley.size().x / 2.0);
    let mut words = egui::epaint::TextShape::new(at, galley, inks.text);
    words.angle = -std::f32::consts::FRAC_PI_2;
    painter.add(words);
}

/// The points that nobody beats: joined, each with a ring.
fn front(painter: &Painter, chart: &Plot<'_>, place: &Place, inks: &Inks) {
    let mut best: Vec<&Dot> = chart.lines.iter().flat_map(|l| &l.dots).filter(|d| d.front).collect();
    best.sort_by(|a, b| a.x.total_cmp(&b.x));
    let points: Vec<Pos2> = best.iter().map(|d| place.of(d)).collect();
    painter.extend(Shape::dashed_line(&points, Stroke::new(1.2, inks.text), 4.0, 3.0));
    for at in points {
        painter.circle_stroke(at, 8.0, Stroke::new(1.2, inks.text));
    }
}

fn draw(painter: &Painter, line: &Line, place: &Place, inks: &Inks) {
    let colour = colour(line.place, painter.ctx().global_style().visuals.dark_mode);
    let path: Vec<Pos2> = line.dots.iter().filter(|d| d.y.is_some()).map(|d| place.of(d)).collect();
    if path.len() > 1 {
        painter.line(path, Stroke::new(1.8, colour.gamma_multiply(0.75)));
    }
    for dot in &line.dots {
        mark(painter, place.of(dot), line.place, colour, if dot.failed { inks.canvas } else { colour });
    }
}

/// The mark of a method: a shape as well as a colour.
pub(super) fn mark(painter: &Painter, at: Pos2, place: usize, colour: Color32, fill: Color32) {
    let rim = Stroke::new(1.6, colour);
    match place % 4 {
        0 => _ = painter.circle(at, 4.2, fill, rim),
        1 => _ = painter.rect(Rect::from_center_size(at, vec2(8.0, 8.0)), 0.0, fill, rim, StrokeKind::Middle),
        2 => {
            let corners = [vec2(0.0, -5.2), vec2(5.0, 3.8), vec2(-5.0, 3.8)].map(|d| at + d).to_vec();
            painter.add(Shape::convex_polygon(corners, fill, rim));
        }
        _ => {
            let corners = [vec2(0.0, -5.4), vec2(5.4, 0.0), vec2(0.0, 5.4), vec2(-5.4, 0.0)].map(|d| at + d).to_vec();
            painter.add(Shape::convex_polygon(corners, fill, rim));
        }
    }
}

/// The colour of a method or a cause, told apart without red-green vision (Okabe and Ito 2008).
pub(super) fn colour(place: usize, dark: bool) -> Color32 {
    const COLOURS: [[u8; 3]; 7] =
        [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [181, 137, 0], [86, 180, 233], [110, 110, 118]];
    const ON_DARK: [[u8; 3]; 7] = [
        [78, 164, 222],
        [240, 130, 50],
        [50, 190, 150],
        [224, 150, 192],
        [222, 184, 60],
        [150, 212, 250],
        [176, 176, 184],
    ];
    let [r, g, b] = if dark { ON_DARK } else { COLOURS }[place % 7];
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> Place {
        let plot = Rect::from_min_max(pos2(100.0, 50.0), pos2(300.0, 150.0));
        Place { plot, seen: [[0.0, 2.0], [-2.0, 0.0]] }
    }

    /// By hand: 10 is one of two decades, so the middle; 0.1 is the middle of 0.01 to 1.
    #[test]
    fn values_lie_where_their_logarithms_do_and_stay_under_the_pointer_while_zooming() {
        let mut p = place();
        assert_eq!((p.x(10.0), p.y(0.1)), (200.0, 100.0));
        let at = pos2(p.x(3.0), p.y(0.5));
        zoom(&mut p, at, 4.0);
        assert!((p.x(3.0) - at.x).abs() < 1e-3 && (p.y(0.5) - at.y).abs() < 1e-3);
        assert!((p.seen[0][1] - p.seen[0][0] - 0.5).abs() < 1e-12);
        let mut p = place();
        move_by(&mut p, vec2(100.0, 0.0));
        assert!((p.x(1.0) - 200.0).abs() < 1e-3);
        assert_eq!(decades([0.3, 20.0, f64::NAN, -1.0].into_iter()), [-1.0, 2.0]);
    }

    #[test]
    fn the_nearest_mark_within_reach_is_pointed_at() {
        let dot = |x: f64, y: Option<f64>| Dot {
            x,
            y,
            failed: y.is_none(),
            front: false,
            setting: String::new(),
            words: String::new(),
        };
        let lines = [Line {
            method: "A".into(),
            place: 0,
            dots: vec![dot(10.0, Some(0.1)), dot(10.0, None), dot(12.0, Some(0.1))],
        }];
        let p = place();
        assert_eq!(nearest(&lines, &p, pos2(203.0, 101.0)), Some([0, 0]));
        assert_eq!(nearest(&lines, &p, pos2(200.0, 36.0)), Some([0, 1]));
        assert_eq!(nearest(&lines, &p, pos2(120.0, 60.0)), None);
    }
}
