//! The chart of a trial: error against time a point, one mark a way.

use std::fmt::Write;

use super::Summary;
use crate::draw::svg;

const SIDES: [f64; 2] = [1080.0, 620.0];
/// Left, top, right and bottom of the frame.
const FRAME: [f64; 4] = [76.0, 74.0, 710.0, 548.0];
/// Width and height that a number takes, px.
const NUMBER: [f64; 2] = [17.0, 14.0];
const WITH_GRID: &str = "#35478c";
const BARE: &str = "#b4552d";

/// Errors that are wanted: snapped crossings, tracked with a grid and without, px.
const WANTED_PX: [f64; 3] = [0.1, 0.15, 0.5];

/// The steps 1, 2, 5, 10, … of a logarithmic axis from below all values to above them, and how far along it a value lies, 0 to 1.
fn axis(values: impl Iterator<Item = f64>) -> (Vec<f64>, impl Fn(f64) -> f64) {
    let [least, most] = values.fold([f64::INFINITY, 0.0_f64], |[least, most], v| [least.min(v), most.max(v)]);
    let all: Vec<f64> = (-3..6).flat_map(|power| [1.0, 2.0, 5.0].map(|v| v * 10.0_f64.powi(power))).collect();
    let last = all.len() - 1;
    let from = all.iter().rposition(|v| *v <= least).unwrap_or(0).min(last - 1);
    let to = all.iter().position(|v| *v >= most).unwrap_or(last).max(from + 1);
    let [low, high] = [all[from], all[to]];
    (all[from..=to].to_vec(), move |v| (v.clamp(low, high) / low).ln() / (high / low).ln())
}

/// Both axes are logarithmic. A mark is the median; the line from it ends at the error that 95 % stay below; the share not found stands
/// beside the name.
pub fn chart(summaries: &[Summary], seeds: usize) -> String {
    let [left, top, right, bottom] = FRAME;
    let (times, along) = axis(summaries.iter().map(|s| s.time_us));
    let (errors, up) = axis(summaries.iter().flat_map(|s| [s.median_px, s.p95_px]));
    let x = |us: f64| left + along(us) * (right - left);
    let y = |px: f64| bottom - up(px) * (bottom - top);
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" font-family="{}" font-size="13" fill="#26262c"><rect width="100%" height="100%" fill="#ffffff"/><text x="{left}" y="30" font-size="18">Finding points again: time against error</text><text x="{left}" y="52" fill="#5a5a64">{seeds} seeds; mark: median, end of the line: 95 % of those found; head 3 mm and 3°, light 20 %, noise 2 %</text>"##,
        SIDES[0],
        SIDES[1],
        svg::FONT_FAMILY
    );
    for &us in &times {
        let label = if us < 1e3 { format!("{us:.0} µs") } else { format!("{:.0} ms", us / 1e3) };
        let _ = write!(
            out,
            r##"<path d="M{0:.1} {top}V{bottom}" stroke="#e3e3e8"/><text x="{0:.1}" y="{1:.1}" text-anchor="middle">{label}</text>"##,
            x(us),
            bottom + 20.0
        );
    }
    let wanted = WANTED_PX.iter().filter(|px| !errors.contains(px));
    for &px in errors.iter().chain(wanted) {
        let stroke = if WANTED_PX.contains(&px) { "#a9a9b4" } else { "#e3e3e8" };
        let _ = write!(
            out,
            r#"<path d="M{left} {0:.1}H{right}" stroke="{stroke}"/><text x="{1:.1}" y="{2:.1}" text-anchor="end">{px}</text>"#,
            y(px),
            left - 8.0,
            y(px) + 4.0
        );
    }
    let _ = write!(
        out,
        r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">time of one point</text><text transform="translate(24 {:.1}) rotate(-90)" text-anchor="middle">distance from the truth, px</text>"#,
        0.5 * (left + right),
        bottom + 46.0,
        0.5 * (top + bottom)
    );
    for (colour, words, row) in [(WITH_GRID, "painted grid", 0.0), (BARE, "bare skin", 1.0)] {
        let _ = write!(
            out,
            r#"<circle cx="{0:.1}" cy="{1:.1}" r="5" fill="{colour}"/><text x="{2:.1}" y="{3:.1}">{words}</text>"#,
            right + 30.0 + 130.0 * row,
            top - 4.0,
            right + 42.0 + 130.0 * row,
            top + 0.5
        );
    }
    // What no number may stand on: marks with their lines, and the numbers before it.
    let mut taken: Vec<[f64; 4]> =
        summaries.iter().map(|s| [x(s.time_us), y(s.p95_px), 4.0, y(s.median_px) - y(s.p95_px)]).collect();
    for (k, s) in summaries.iter().enumerate() {
        let colour = if s.grid { WITH_GRID } else { BARE };
        let (at, median, end) = (x(s.time_us), y(s.median_px), y(s.p95_px));
        let on = |number: [f64; 2], t: &[f64; 4]| {
            (t[0] - number[0]).abs() < 0.5 * NUMBER[0] + t[2] && number[1] > t[1] && number[1] - NUMBER[1] < t[1] + t[3]
        };
        let mut number = [at, end - 6.0];
        while number[1] > top && taken.iter().any(|t| on(number, t)) {
            number[1] -= 2.0;
        }
        taken.push([number[0], number[1] - NUMBER[1], 0.5 * NUMBER[0], NUMBER[1]]);
        let failed = 100.0 * s.failed as f64 / s.count.max(1) as f64;
        let row = top + 26.0 + 34.0 * k as f64;
        let _ = write!(
            out,
            r##"<path d="M{at:.1} {median:.1}V{end:.1}M{0:.1} {end:.1}h8" stroke="{colour}" stroke-width="1.5" fill="none"/><circle cx="{at:.1}" cy="{median:.1}" r="5" fill="{colour}"/><text x="{1:.1}" y="{2:.1}" text-anchor="middle">{3}</text><text x="{4:.1}" y="{row:.1}" fill="{colour}">{3}  {5}</text><text x="{4:.1}" y="{6:.1}" fill="#5a5a64" font-size="12">{7:.2} px, 95 % within {8:.2} px; {failed:.1} % not found</text>"##,
            at - 4.0,
            number[0],
            number[1],
            k + 1,
            right + 24.0,
            svg::escape(&s.way.name()),
            row + 15.0,
            s.median_px,
            s.p95_px
        );
    }
    out.push_str("</svg>");
    out
}
