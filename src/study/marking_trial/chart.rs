//! The chart of a trial: error against time a point, one mark a way.

use std::fmt::Write;

use super::Summary;
use crate::draw::svg;

const SIDES: [f64; 2] = [1080.0, 620.0];
/// Left, top, right and bottom of the frame.
const FRAME: [f64; 4] = [76.0, 74.0, 710.0, 548.0];
/// Powers of ten that the axes span: time, µs, and error, px.
const TIME: [f64; 2] = [1.0, 4.0];
const ERROR: [f64; 2] = [-2.0, 1.0];
const WITH_GRID: &str = "#35478c";
const BARE: &str = "#b4552d";

/// Both axes are logarithmic. A mark is the median; the line from it ends at the error that 95 % stay below; the share not found stands
/// beside the name.
pub fn chart(summaries: &[Summary], seeds: usize) -> String {
    let [left, top, right, bottom] = FRAME;
    let along = |v: f64, [from, to]: [f64; 2]| (v.max(1e-9).log10().clamp(from, to) - from) / (to - from);
    let x = |us: f64| left + along(us, TIME) * (right - left);
    let y = |px: f64| bottom - along(px, ERROR) * (bottom - top);
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" font-family="{}" font-size="13" fill="#26262c"><rect width="100%" height="100%" fill="#ffffff"/><text x="{left}" y="30" font-size="18">Finding points again: time against error</text><text x="{left}" y="52" fill="#5a5a64">{seeds} seeds; mark: median, end of the line: 95 % of those found; head 3 mm and 3°, light 20 %, noise 2 %</text>"##,
        SIDES[0],
        SIDES[1],
        svg::FONT_FAMILY
    );
    for power in TIME[0] as i32..=TIME[1] as i32 {
        let us = 10.0_f64.powi(power);
        let label = if us < 1e3 { format!("{us:.0} µs") } else { format!("{:.0} ms", us / 1e3) };
        let _ = write!(
            out,
            r##"<path d="M{0:.1} {top}V{bottom}" stroke="#e3e3e8"/><text x="{0:.1}" y="{1:.1}" text-anchor="middle">{label}</text>"##,
            x(us),
            bottom + 20.0
        );
    }
    for (px, strong) in [(0.01, false), (0.1, true), (0.15, true), (0.5, true), (1.0, false), (10.0, false)] {
        let stroke = if strong { "#c3c3cc" } else { "#e3e3e8" };
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
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for (k, s) in summaries.iter().enumerate() {
        let colour = if s.grid { WITH_GRID } else { BARE };
        let (at, median, end) = (x(s.time_us), y(s.median_px), y(s.p95_px));
        let mut number = [at, end - 8.0];
        while taken.iter().any(|t| (t[0] - number[0]).abs() < 17.0 && (t[1] - number[1]).abs() < 14.0) {
            number[0] += 17.0;
        }
        taken.push(number);
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
