//! Stability maps as a drawing: every cell in the colour of its first cause of failure with its letter, the limit of theory drawn in.

use std::fmt::Write;

use crate::draw::line_chart::COLOURS;
use crate::draw::svg::{FONT_FAMILY, escape};
use crate::study::cells::{Cell, Map, among, causes, letter, maps};
use crate::study::table::words;
use crate::study::{Kind, Run};

const WIDTH: f64 = 1180.0;
const MARGIN: f64 = 24.0;
const INK: &str = "#26262c";
const WEAK: &str = "#5a5a64";
/// The colour of a cell that ends well.
const WELL: &str = "#e9edf2";
const NOT_RUN: &str = "#ffffff";
/// Height of a row, of what stands above a map, and of what stands below it.
const ROW: f64 = 24.0;
const ABOVE: f64 = 26.0;
const BELOW: f64 = 50.0;
/// Maps of one part side by side.
const SIDE_BY_SIDE: usize = 3;

/// All maps of a table as one drawing, with the causes and the circumstances below. A table without maps is a drawing that says so.
pub fn svg(kind: Kind, runs: &[Run], caption: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for run in runs {
        if !parts.contains(&run.part.as_str()) {
            parts.push(&run.part);
        }
    }
    let all: Vec<(String, Vec<Map>)> = parts.iter().map(|p| (kind.title(p), maps(runs, p))).collect();
    let every: Vec<Map> = all.iter().flat_map(|a| a.1.clone()).collect();
    let legend = causes(&every);
    let mut body = String::new();
    let mut top = 64.0;
    for (title, maps) in &all {
        if maps.is_empty() {
            continue;
        }
        let _ = write!(body, r#"<text x="{MARGIN}" y="{top:.1}" font-size="16" fill="{INK}">{}</text>"#, escape(title));
        top += 12.0;
        let of_methods = maps.iter().any(|m| m.up == "method");
        let columns = if of_methods { 1 } else { SIDE_BY_SIDE };
        let width = (WIDTH - 2.0 * MARGIN) / columns as f64;
        for row in maps.chunks(columns) {
            let mut height = 0.0_f64;
            for (k, map) in row.iter().enumerate() {
                let used = draw(&mut body, map, &legend, [MARGIN + width * k as f64, top, width - 18.0]);
                height = height.max(used);
            }
            top += height + 8.0;
        }
        top += 26.0;
    }
    if every.is_empty() {
        let _ = write!(body, r#"<text x="{MARGIN}" y="{top:.1}" fill="{WEAK}">No maps in this table.</text>"#);
        top += 30.0;
    }
    for (k, cause) in legend.iter().enumerate() {
        let (x, y) = (MARGIN + (k % 3) as f64 * 0.32 * WIDTH, top + (k / 3) as f64 * 24.0);
        let _ = write!(
            body,
            r#"<rect x="{x:.1}" y="{:.1}" width="26" height="18" fill="{}"/>{}<text x="{:.1}" y="{:.1}">{}</text>"#,
            y - 13.0,
            tint(Some(k), 1.0),
            word(x + 13.0, y + 1.0, &letter(k), INK),
            x + 34.0,
            y + 1.0,
            escape(cause)
        );
    }
    top += legend.len().div_ceil(3) as f64 * 24.0 + 6.0;
    let _ = write!(
        body,
        r#"<rect x="{MARGIN}" y="{:.1}" width="26" height="18" fill="{WELL}"/><text x="{:.1}" y="{:.1}">all seeds end well; a number beside a letter is the share of seeds that do</text><path d="M{:.1} {:.1}v18" stroke="{INK}" stroke-width="2.5"/><text x="{:.1}" y="{:.1}">limit of theory for small motions, or of the linear law of errors</text><text x="{MARGIN}" y="{:.1}" fill="{WEAK}" font-size="12">{}</text>"#,
        top - 13.0,
        MARGIN + 34.0,
        top + 1.0,
        0.58 * WIDTH,
        top - 13.0,
        0.58 * WIDTH + 12.0,
        top + 1.0,
        top + 32.0,
        escape(caption)
    );
    let height = top + 52.0;
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height:.0}" font-family="{FONT_FAMILY}" font-size="13" fill="{INK}"><rect width="100%" height="100%" fill="#ffffff"/><text x="{MARGIN}" y="34" font-size="20">{}: {}</text>{body}</svg>"##,
        kind.label(),
        escape(kind.asks())
    )
}

/// The colour of a cause: paler where only some seeds fail.
fn tint(place: Option<usize>, failed: f64) -> String {
    let Some(place) = place else { return WELL.to_owned() };
    let hex = COLOURS[place % COLOURS.len()];
    let channel = |at: usize| hex.get(at..at + 2).and_then(|h| u8::from_str_radix(h, 16).ok()).unwrap_or(128);
    let strength = 0.25 + 0.4 * failed.clamp(0.0, 1.0);
    let pale = |c: u8| (255.0 + (f64::from(c) - 255.0) * strength).round() as u8;
    format!("#{:02x}{:02x}{:02x}", pale(channel(1)), pale(channel(3)), pale(channel(5)))
}

fn word(x: f64, y: f64, text: &str, colour: &str) -> String {
    format!(
        r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle" font-size="12" fill="{colour}">{}</text>"#,
        escape(text)
    )
}

/// Draws a map into left, top and width; the height that it took.
fn draw(out: &mut String, map: &Map, legend: &[&str], [left, top, width]: [f64; 3]) -> f64 {
    let of_methods = map.up == "method";
    let names = if of_methods { 220.0 } else { 64.0 };
    let above = if of_methods { 4.0 } else { ABOVE };
    let (x0, y0) = (left + names, top + above);
    let (n, m) = (map.columns.len(), map.rows.len());
    let cell_width = ((width - names) / n.max(1) as f64).min(90.0);
    let bottom = y0 + ROW * m as f64;
    if !of_methods {
        let _ = write!(out, r#"<text x="{x0:.1}" y="{:.1}" font-size="14">{}</text>"#, y0 - 8.0, escape(&map.method));
        let _ = write!(
            out,
            r#"<text transform="translate({:.1} {:.1}) rotate(-90)" text-anchor="middle" fill="{WEAK}" font-size="12">{}</text>"#,
            left + 10.0,
            0.5 * (y0 + bottom),
            escape(&words(&map.up))
        );
    }
    for row in 0..m {
        let y = bottom - ROW * (row + 1) as f64;
        let _ = write!(
            out,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="end" font-size="{}">{}</text>"#,
            x0 - 8.0,
            y + 16.0,
            if of_methods { 13 } else { 12 },
            escape(&map.rows[row])
        );
        for column in 0..n {
            let x = x0 + cell_width * column as f64;
            let cell = map.cell(column, row);
            let (fill, text) = cell.map_or((NOT_RUN.to_owned(), String::new()), |c| face_of(c, legend));
            let _ = write!(
                out,
                r##"<rect x="{x:.1}" y="{y:.1}" width="{cell_width:.1}" height="{ROW}" fill="{fill}" stroke="#ffffff"/>"##
            );
            if !text.is_empty() {
                out.push_str(&word(x + 0.5 * cell_width, y + 16.0, &text, INK));
            }
        }
    }
    for (column, value) in map.columns.iter().enumerate() {
        out.push_str(&word(x0 + cell_width * (column as f64 + 0.5), bottom + 15.0, &short(*value), INK));
    }
    out.push_str(&word(x0 + 0.5 * cell_width * n as f64, bottom + 33.0, &words(&map.along), WEAK));
    // Where theory ends: a stroke through every row, joined where the rows above and below have one too.
    let ends: Vec<Option<f64>> = (0..m)
        .map(|row| (0..n).find_map(|c| map.cell(c, row)?.limit).and_then(|l| among(&map.columns, l)))
        .map(|at| at.map(|a| x0 + cell_width * (a + 0.5)))
        .collect();
    let mut path = String::new();
    let mut joined = false;
    for (row, x) in ends.iter().enumerate() {
        let y = bottom - ROW * row as f64;
        match x {
            Some(x) => {
                let _ = write!(path, "{}{x:.1} {y:.1}V{:.1}", if joined { 'L' } else { 'M' }, y - ROW);
                joined = true;
            }
            None => joined = false,
        }
    }
    if !path.is_empty() {
        let _ = write!(out, r#"<path d="{path}" fill="none" stroke="{INK}" stroke-width="2.5"/>"#);
    }
    above + ROW * m as f64 + BELOW
}

/// Colour and letter of a cell.
fn face_of(cell: &Cell, legend: &[&str]) -> (String, String) {
    let Some(cause) = &cell.cause else { return (WELL.to_owned(), String::new()) };
    let place = legend.iter().position(|c| c == cause);
    let mark = place.map_or_else(String::new, letter);
    let share = cell.share();
    let text = if cell.well == 0 { mark } else { format!("{mark} {}/{}", cell.well, cell.runs) };
    (tint(place, 1.0 - share), text)
}

/// A number of an axis: "0.01", "1000", "1e−12".
fn short(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-3 || value.abs() >= 1e6) {
        format!("{value:e}").replace('-', "−")
    } else {
        format!("{value}").replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::table::setting;

    #[test]
    fn a_map_shows_letters_shares_and_the_limit() {
        let mut runs = Vec::new();
        for (x, y, seed, cause) in [
            (1.0, 1.0, 1, None),
            (10.0, 1.0, 1, Some("ran <away>")),
            (10.0, 2.0, 1, Some("other")),
            (10.0, 2.0, 2, None),
        ] {
            let at = setting(&[("step_ms", x), ("stiffness", y)]);
            let run = Run { seed, cause: cause.map(str::to_owned), ..Run::new("stability", "a part", "Euler", at) };
            runs.push(run.with("limit_ms", 3.0));
        }
        runs.push(Run::new("stability", "one", "A method", setting(&[("x_mm", 0.0)])));
        let text = svg(Kind::Stability, &runs, "a machine & more");
        // By name: "other" is A, "ran <away>" B. One seed of two ended well at (10, 2).
        assert!(text.contains(">A 1/2</text>") && text.contains(">B</text>"), "{text}");
        assert!(text.contains("ran &lt;away&gt;") && text.contains("a machine &amp; more"));
        assert!(text.contains(r##"stroke="#26262c" stroke-width="2.5""##));
        assert!(text.contains("step, ms") && !text.contains("NaN"));
        crate::draw::svg::paint(&text, 1.0).unwrap();
        crate::draw::svg::paint(&svg(Kind::Stability, &[], ""), 1.0).unwrap();
        assert_eq!((short(1e-12), short(0.25)), ("1e−12".into(), "0.25".into()));
    }
}
