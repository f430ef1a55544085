//! Charts as SVG: lines, points with error bars, bars with intervals; axes linear or logarithmic, one sheet for several charts.

use std::fmt::Write;

use super::svg::{FONT_FAMILY, escape};
use super::ticks::{labels, nice_ticks};

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spread {
    /// Evenly.
    #[default]
    Linear,
    /// By powers of ten; values of zero and below are left out.
    Logarithmic,
}

/// One axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// "force, N".
    pub title: String,
    /// How values are spread.
    pub spread: Spread,
    /// First and last value; by the data where absent.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis that follows the data.
    pub fn linear(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A logarithmic axis that follows the data.
    pub fn logarithmic(title: impl Into<String>) -> Self {
        Self { title: title.into(), spread: Spread::Logarithmic, range: None }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line through the points.
    Line,
    /// A broken line.
    Dashed,
    /// Filled points.
    Points,
    /// Hollow points: a run that failed, a value not used.
    Hollow,
    /// A line with its points.
    LineAndPoints,
}

/// One value of a series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Value {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// Half the length of its error bar.
    pub error: Option<f64>,
    /// Written beside it.
    pub label: Option<String>,
}

impl Value {
    /// A bare point.
    pub fn at(x: f64, y: f64) -> Self {
        Self { x, y, ..Self::default() }
    }
}

/// Values that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend; without one it is not listed.
    pub name: String,
    /// Colour, as SVG takes it.
    pub colour: String,
    /// How it is drawn.
    pub style: Style,
    /// Its values, in the order of the line. A value that is no number breaks the line.
    pub values: Vec<Value>,
}

/// One chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineChart {
    /// Above it.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, the first lowest.
    pub series: Vec<Series>,
    /// Lines across the chart at these values of x, with a word.
    pub x_marks: Vec<(f64, String)>,
    /// Lines along the chart at these values of y, with a word.
    pub y_marks: Vec<(f64, String)>,
}

/// Colours of series that can be told apart without red-green vision (Okabe and Ito 2008), darkest first.
pub const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#333333"];

/// Room for the numbers, the titles and the legend: left, top, right, bottom.
const MARGINS: [f64; 4] = [64.0, 34.0, 16.0, 50.0];
const LINE_HEIGHT: f64 = 17.0;
const INK: &str = "#26262c";
const WEAK: &str = "#5a5a64";

/// Where values of one axis lie on the sheet.
struct Place {
    spread: Spread,
    range: [f64; 2],
    ends: [f64; 2],
}

impl Place {
    fn of(axis: &Axis, values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Self {
        let usable = values.filter(|v| v.is_finite() && (axis.spread == Spread::Linear || *v > 0.0));
        let found = usable.fold(None, |r: Option<[f64; 2]>, v| Some(r.map_or([v, v], |[a, b]| [a.min(v), b.max(v)])));
        let [low, high] = axis.range.or(found).unwrap_or([1.0, 10.0]);
        let range = match (axis.spread, axis.range) {
            (_, Some(range)) => range,
            (Spread::Linear, None) => {
                let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1e-9) };
                // An axis that starts at nothing starts exactly there.
                [if low >= 0.0 && low <= 0.3 * high { 0.0 } else { low - room }, high + room]
            }
            (Spread::Logarithmic, None) => {
                [10_f64.powf((low.log10() - 0.1).floor()), 10_f64.powf((high.log10() + 0.1).ceil())]
            }
        };
        Self { spread: axis.spread, range, ends }
    }

    fn at(&self, value: f64) -> f64 {
        let along = |v: f64| if self.spread == Spread::Logarithmic { v.max(1e-300).log10() } else { v };
        let [low, high] = self.range.map(along);
        self.ends[0] + (along(value) - low) / (high - low).max(1e-300) * (self.ends[1] - self.ends[0])
    }

    fn holds(&self, value: f64) -> bool {
        let [low, high] = self.range;
        let slack = 1e-9 * (high - low).abs();
        value.is_finite() && value >= low - slack && value <= high + slack
    }

    fn ticks(&self, at_least: usize) -> Vec<(f64, String)> {
        let [low, high] = self.range;
        if self.spread == Spread::Linear {
            let ticks = nice_ticks(low, high, at_least);
            let words = labels(&ticks);
            return ticks.into_iter().zip(words).collect();
        }
        let (from, to) = (low.log10().ceil() as i32, high.log10().floor() as i32);
        (from..=to).map(|p| (10_f64.powi(p), power_of_ten(p))).collect()
    }
}

/// "0.01", "1000" or "1e−7".
fn power_of_ten(p: i32) -> String {
    if (-4..=5).contains(&p) { format!("{}", 10_f64.powi(p)) } else { format!("1e{p}").replace('-', "−") }
}

impl LineChart {
    /// The chart in a box of the sheet: left, top, width, height.
    pub fn draw(&self, [left, top, width, height]: [f64; 4]) -> String {
        let named: Vec<&Series> = self.series.iter().filter(|s| !s.name.is_empty()).collect();
        let legend = if named.len() > 1 { named.len() as f64 * LINE_HEIGHT + 6.0 } else { 0.0 };
        let plot = [left + MARGINS[0], top + MARGINS[1], left + width - MARGINS[2], top + height - MARGINS[3] - legend];
        let all = || self.series.iter().flat_map(|s| &s.values);
        let xs = all().map(|v| v.x).chain(self.x_marks.iter().map(|m| m.0));
        let reach = |v: &Value| {
            let e = v.error.unwrap_or(0.0);
            [v.y - e, v.y + e, v.y]
        };
        let ys = all().flat_map(reach).chain(self.y_marks.iter().map(|m| m.0));
        let x = Place::of(&self.x, xs, [plot[0], plot[2]]);
        let y = Place::of(&self.y, ys, [plot[3], plot[1]]);
        let mut out = String::new();
        self.frame(&mut out, plot, &x, &y);
        // A drawing inside the drawing is cut off at its sides, and needs no name: several charts may stand in one page.
        let [x0, y0, w, h] = [plot[0] - 5.0, plot[1] - 5.0, plot[2] - plot[0] + 10.0, plot[3] - plot[1] + 10.0];
        let _ = write!(
            out,
            r#"<svg x="{x0:.1}" y="{y0:.1}" width="{w:.1}" height="{h:.1}" viewBox="{x0:.1} {y0:.1} {w:.1} {h:.1}">"#
        );
        for series in &self.series {
            draw_series(&mut out, series, &x, &y);
        }
        out.push_str("</svg>");
        if named.len() > 1 {
            for (k, series) in named.iter().enumerate() {
                let at = plot[3] + MARGINS[3] + LINE_HEIGHT * k as f64;
                legend_line(&mut out, series, plot[0], at);
            }
        }
        out
    }

    fn frame(&self, out: &mut String, plot: [f64; 4], x: &Place, y: &Place) {
        let [left, top, right, bottom] = plot;
        for (value, word) in x.ticks(((right - left) / 90.0).clamp(2.0, 8.0) as usize) {
            let at = x.at(value);
            let _ = write!(
                out,
                r##"<path d="M{at:.1} {top:.1}V{bottom:.1}" stroke="#e3e3e8"/><text x="{at:.1}" y="{:.1}" text-anchor="middle" font-size="12">{word}</text>"##,
                bottom + 16.0
            );
        }
        for (value, word) in y.ticks(((bottom - top) / 55.0).clamp(2.0, 8.0) as usize) {
            let at = y.at(value);
            let _ = write!(
                out,
                r##"<path d="M{left:.1} {at:.1}H{right:.1}" stroke="#e3e3e8"/><text x="{:.1}" y="{:.1}" text-anchor="end" font-size="12">{word}</text>"##,
                left - 7.0,
                at + 4.0
            );
        }
        for (value, word) in self.x_marks.iter().filter(|m| x.holds(m.0)) {
            let _ = write!(
                out,
                r##"<path d="M{0:.1} {top:.1}V{bottom:.1}" stroke="#8a8a94" stroke-dasharray="4 3"/><text x="{1:.1}" y="{2:.1}" font-size="12" fill="{WEAK}">{3}</text>"##,
                x.at(*value),
                x.at(*value) + 4.0,
                top + 12.0,
                escape(word)
            );
        }
        for (value, word) in self.y_marks.iter().filter(|m| y.holds(m.0)) {
            let _ = write!(
                out,
                r##"<path d="M{left:.1} {0:.1}H{right:.1}" stroke="#8a8a94" stroke-dasharray="4 3"/><text x="{1:.1}" y="{2:.1}" font-size="12" fill="{WEAK}" text-anchor="end">{3}</text>"##,
                y.at(*value),
                right - 3.0,
                y.at(*value) - 4.0,
                escape(word)
            );
        }
        if y.spread == Spread::Linear && y.range[0] < 0.0 && y.range[1] > 0.0 {
            let _ = write!(out, r#"<path d="M{left:.1} {:.1}H{right:.1}" stroke="{INK}"/>"#, y.at(0.0));
        }
        let _ = write!(
            out,
            r#"<path d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}" stroke="{INK}" fill="none"/><text x="{left:.1}" y="{:.1}" font-size="14">{}</text><text x="{:.1}" y="{:.1}" text-anchor="middle" fill="{WEAK}">{}</text><text transform="translate({:.1} {:.1}) rotate(-90)" text-anchor="middle" fill="{WEAK}">{}</text>"#,
            top - 12.0,
            escape(&self.title),
            0.5 * (left + right),
            bottom + 36.0,
            escape(&self.x.title),
            left - 46.0,
            0.5 * (top + bottom),
            escape(&self.y.title)
        );
    }
}

fn draw_series(out: &mut String, series: &Series, x: &Place, y: &Place) {
    let colour = escape(&series.colour);
    let usable = |v: &Value| {
        let positive = |place: &Place, value: f64| place.spread == Spread::Linear || value > 0.0;
        v.x.is_finite() && v.y.is_finite() && positive(x, v.x) && positive(y, v.y)
    };
    if matches!(series.style, Style::Line | Style::Dashed | Style::LineAndPoints) {
        let mut path = String::new();
        let mut pen_down = false;
        for v in &series.values {
            if usable(v) {
                let _ = write!(path, "{}{:.1} {:.1}", if pen_down { 'L' } else { 'M' }, x.at(v.x), y.at(v.y));
            }
            pen_down = usable(v);
        }
        let dash = if series.style == Style::Dashed { r#" stroke-dasharray="6 4""# } else { "" };
        let _ = write!(out, r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>"#);
    }
    for v in series.values.iter().filter(|v| usable(v)) {
        let (px, py) = (x.at(v.x), y.at(v.y));
        if let Some(error) = v.error.filter(|e| e.is_finite() && *e > 0.0) {
            let low = if y.spread == Spread::Logarithmic { (v.y - error).max(y.range[0]) } else { v.y - error };
            let _ = write!(
                out,
                r#"<path d="M{px:.1} {0:.1}V{1:.1}M{2:.1} {0:.1}h6M{2:.1} {1:.1}h6" stroke="{colour}" stroke-opacity="0.7" fill="none"/>"#,
                y.at(low),
                y.at(v.y + error),
                px - 3.0
            );
        }
        point(out, series.style, &colour, px, py);
        if let Some(label) = &v.label {
            let _ = write!(
                out,
                r#"<text x="{:.1}" y="{:.1}" font-size="11" fill="{colour}">{}</text>"#,
                px + 6.0,
                py - 5.0,
                escape(label)
            );
        }
    }
}

fn point(out: &mut String, style: Style, colour: &str, x: f64, y: f64) {
    let _ = match style {
        Style::Points | Style::LineAndPoints => {
            write!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3" fill="{colour}"/>"#)
        }
        Style::Hollow => write!(
            out,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="3.2" fill="#ffffff" stroke="{colour}" stroke-width="1.4"/>"##
        ),
        Style::Line | Style::Dashed => Ok(()),
    };
}

fn legend_line(out: &mut String, series: &Series, left: f64, y: f64) {
    let colour = escape(&series.colour);
    match series.style {
        Style::Line | Style::Dashed | Style::LineAndPoints => {
            let dash = if series.style == Style::Dashed { r#" stroke-dasharray="6 4""# } else { "" };
            let _ = write!(out, r#"<path d="M{left:.1} {:.1}h24" stroke="{colour}" stroke-width="2"{dash}/>"#, y - 4.0);
        }
        Style::Points | Style::Hollow => {}
    }
    point(out, series.style, &colour, left + 12.0, y - 4.0);
    let _ = write!(out, r#"<text x="{:.1}" y="{y:.1}">{}</text>"#, left + 32.0, escape(&series.name));
}

/// One bar of a bar chart: lies along the horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// To its left.
    pub name: String,
    /// Its length.
    pub value: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// To its right.
    pub note: String,
    /// Drawn pale: not part of the answer.
    pub pale: bool,
}

/// Bars with intervals, one below the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarChart {
    /// Above it.
    pub title: String,
    /// Under it: "activation, N".
    pub unit: String,
    /// The bars, from above.
    pub bars: Vec<Bar>,
}

impl BarChart {
    /// The height that it needs.
    pub fn height(&self) -> f64 {
        MARGINS[1] + 20.0 * self.bars.len() as f64 + MARGINS[3]
    }

    /// The chart in a box of the sheet: left, top, width.
    pub fn draw(&self, [left, top, width]: [f64; 3]) -> String {
        /// Room for the names and the notes.
        const SIDES: [f64; 2] = [250.0, 70.0];
        let axis = Axis::linear(self.unit.as_str());
        let ends = [left + SIDES[0], left + width - SIDES[1]];
        let values = self.bars.iter().flat_map(|b| [b.value, b.interval[0], b.interval[1]]).chain([0.0]);
        let x = Place::of(&axis, values.filter(|v| v.is_finite()), ends);
        let (first, bottom) = (top + MARGINS[1], top + MARGINS[1] + 20.0 * self.bars.len() as f64);
        let mut out = String::new();
        for (value, word) in x.ticks(4) {
            let at = x.at(value);
            let _ = write!(
                out,
                r##"<path d="M{at:.1} {first:.1}V{bottom:.1}" stroke="#e3e3e8"/><text x="{at:.1}" y="{:.1}" text-anchor="middle" font-size="12">{word}</text>"##,
                bottom + 16.0
            );
        }
        for (k, bar) in self.bars.iter().enumerate() {
            let y = first + 20.0 * k as f64;
            let colour = if bar.pale { "#b9c3d6" } else { "#3b5b92" };
            let (from, to) = (x.at(bar.value.min(0.0)), x.at(bar.value.max(0.0)));
            let [low, high] = bar.interval.map(|v| x.at(v.clamp(x.range[0], x.range[1])));
            let _ = write!(
                out,
                r#"<text x="{0:.1}" y="{1:.1}" text-anchor="end">{2}</text><rect x="{from:.1}" y="{3:.1}" width="{4:.1}" height="12" fill="{colour}"/><path d="M{low:.1} {5:.1}H{high:.1}M{low:.1} {6:.1}v8M{high:.1} {6:.1}v8" stroke="{INK}" fill="none"/><text x="{7:.1}" y="{1:.1}" fill="{WEAK}">{8}</text>"#,
                ends[0] - 8.0,
                y + 14.0,
                escape(&bar.name),
                y + 4.0,
                (to - from).max(0.0),
                y + 10.0,
                y + 6.0,
                ends[1] + 8.0,
                escape(&bar.note)
            );
        }
        let _ = write!(
            out,
            r#"<path d="M{0:.1} {first:.1}V{bottom:.1}" stroke="{INK}"/><text x="{left:.1}" y="{1:.1}" font-size="14">{2}</text><text x="{3:.1}" y="{4:.1}" text-anchor="middle" fill="{WEAK}">{5}</text>"#,
            x.at(0.0),
            first - 12.0,
            escape(&self.title),
            0.5 * (ends[0] + ends[1]),
            bottom + 36.0,
            escape(&self.unit)
        );
        out
    }
}

/// A whole drawing of that size around what charts have drawn, with a heading and a line of circumstances under it.
pub fn sheet([width, height]: [f64; 2], heading: &str, circumstances: &str, drawn: &[String]) -> String {
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="{FONT_FAMILY}" font-size="13" fill="{INK}"><rect width="100%" height="100%" fill="#ffffff"/><text x="20" y="30" font-size="18">{}</text><text x="20" y="51" fill="{WEAK}">{}</text>"##,
        escape(heading),
        escape(circumstances)
    );
    for part in drawn {
        out.push_str(part);
    }
    out.push_str("</svg>\n");
    out
}

/// Room that the heading of a [`sheet`] takes.
pub const HEADING: f64 = 62.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::svg::paint;

    fn chart(spread: Spread) -> LineChart {
        let values = (1..=5).map(|k| Value { error: Some(0.5), ..Value::at(f64::from(k), f64::from(k * k)) });
        let axis = |title: &str| Axis { title: title.into(), spread, range: None };
        LineChart {
            title: "a < b".into(),
            x: axis("x"),
            y: axis("y"),
            series: vec![
                Series {
                    name: "one".into(),
                    colour: COLOURS[0].into(),
                    style: Style::LineAndPoints,
                    values: values.collect(),
                },
                Series {
                    name: "two".into(),
                    colour: COLOURS[1].into(),
                    style: Style::Hollow,
                    values: vec![Value::at(2.0, f64::NAN), Value::at(3.0, 7.0)],
                },
            ],
            x_marks: vec![(2.0, "here".into())],
            y_marks: Vec::new(),
        }
    }

    #[test]
    fn a_value_lies_where_its_axis_says() {
        // Linear from 0 to 10 over 100 units: 2.5 lies at 25. Logarithmic from 1 to 100: 10 lies in the middle.
        let linear = Place { spread: Spread::Linear, range: [0.0, 10.0], ends: [0.0, 100.0] };
        assert_eq!(linear.at(2.5), 25.0);
        let log = Place { spread: Spread::Logarithmic, range: [1.0, 100.0], ends: [200.0, 100.0] };
        assert!((log.at(10.0) - 150.0).abs() < 1e-9);
        assert_eq!(log.ticks(3).iter().map(|t| t.1.as_str()).collect::<Vec<_>>(), ["1", "10", "100"]);
        assert_eq!(power_of_ten(-7), "1e−7");
    }

    #[test]
    fn charts_are_valid_drawings_with_ink_of_every_series() {
        for spread in [Spread::Linear, Spread::Logarithmic] {
            let svg =
                sheet([500.0, 400.0], "Head & line", "seed 1", &[chart(spread).draw([10.0, HEADING, 480.0, 330.0])]);
            let picture = paint(&svg, 1.0).unwrap();
            for colour in [[0x00, 0x72, 0xb2], [0xd5, 0x5e, 0x00]] {
                let near = |p: &&image::Rgb<u8>| p.0.iter().zip(colour).all(|(a, b): (&u8, u8)| a.abs_diff(b) < 24);
                assert!(picture.pixels().filter(near).count() > 8, "{spread:?} {colour:?}");
            }
        }
    }

    #[test]
    fn nothing_to_draw_and_no_numbers_are_drawn_without_nonsense() {
        let mut empty = chart(Spread::Logarithmic);
        empty.series.iter_mut().for_each(|s| s.values = vec![Value::at(0.0, -1.0), Value::at(f64::NAN, f64::INFINITY)]);
        empty.x_marks.clear();
        let bars = BarChart {
            title: "t".into(),
            unit: "N".into(),
            bars: vec![Bar {
                name: "a".into(),
                value: 0.0,
                interval: [0.0, f64::INFINITY],
                note: "?".into(),
                pale: true,
            }],
        };
        let svg =
            sheet([600.0, 700.0], "", "", &[empty.draw([0.0, 60.0, 500.0, 300.0]), bars.draw([0.0, 400.0, 600.0])]);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        paint(&svg, 1.0).unwrap();
    }
}
