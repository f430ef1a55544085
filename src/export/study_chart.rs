//! The chart of speed against accuracy: time against error, one line a method, the points that nobody beats, and the runs that failed.

use std::fmt::Write;

use crate::draw::line_chart::COLOURS;
use crate::draw::svg::{FONT_FAMILY, escape};
use crate::study::points::{Point, mark_front, points};
use crate::study::table::in_words;
use crate::study::{Run, accuracy};

/// What is live while a point is dragged, ms: one frame of a screen.
pub const LIVE_MS: f64 = 16.0;

const WIDTH: f64 = 1120.0;
const PLOT_WIDTH: f64 = 640.0;
const PLOT_HEIGHT: f64 = 380.0;
const LEFT: f64 = 84.0;
const INK: &str = "#26262c";
const WEAK: &str = "#5a5a64";
const LINE: f64 = 18.0;
/// Height of the band above the plot in which runs without an answer stand.
const BAND: f64 = 30.0;
/// Letters of a line of the list beside the plot.
const LETTERS: usize = 54;

/// One panel of the chart.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// What the errors are of.
    pub error: &'static str,
    /// Its points.
    pub points: Vec<Point>,
    /// Points that were chosen.
    pub chosen: Vec<Chosen>,
}

/// A point that was chosen, and for what.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Its method.
    pub method: String,
    /// Its setting.
    pub setting: String,
    /// "for 10 %".
    pub words: String,
}

/// The panels of a table: one a part and noise, in the order of the table; `title` says what a part is about.
pub fn panels(runs: &[Run], title: impl Fn(&str) -> String) -> Vec<Panel> {
    let mut keys: Vec<(&str, f64)> = Vec::new();
    for run in runs {
        if !keys.contains(&(run.part.as_str(), run.noise_px)) {
            keys.push((run.part.as_str(), run.noise_px));
        }
    }
    let several = |part: &str| keys.iter().filter(|k| k.0 == part).count() > 1;
    let panel = |&(part, noise): &(&str, f64)| {
        let mut own: Vec<Point> = points(runs, part).into_iter().filter(|p| p.noise_px == noise).collect();
        mark_front(&mut own);
        let noise = if several(part) || noise > 0.0 { format!(", {noise} px of marking noise") } else { String::new() };
        let title = format!("{}{noise}", title(part));
        Panel { title, error: accuracy::error_words(part), points: own, chosen: Vec::new() }
    };
    keys.iter().map(panel).collect()
}

/// The panels below each other, with a caption.
pub fn svg(heading: &str, panels: &[Panel], caption: &str) -> String {
    let mut body = String::new();
    let mut top = 62.0;
    for panel in panels {
        top += draw(&mut body, panel, top) + 34.0;
    }
    let _ = write!(body, r#"<text x="24" y="{top:.1}" fill="{WEAK}" font-size="12">{}</text>"#, escape(caption));
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{:.0}" font-family="{FONT_FAMILY}" font-size="13" fill="{INK}"><rect width="100%" height="100%" fill="#ffffff"/><text x="24" y="34" font-size="20">{}</text>{body}</svg>"##,
        top + 22.0,
        escape(heading)
    )
}

/// Whole powers of ten around positive values.
fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return [0.1, 10.0];
    }
    [10_f64.powf((low.log10() - 0.05).floor()), 10_f64.powf((high.log10() + 0.05).ceil())]
}

struct Place {
    /// Left, top, right, bottom.
    plot: [f64; 4],
    x: [f64; 2],
    y: [f64; 2],
}

impl Place {
    fn at(&self, time_ms: f64, error: f64) -> [f64; 2] {
        let along = |v: f64, [low, high]: [f64; 2]| (v.max(low).min(high) / low).ln() / (high / low).ln();
        let [left, top, right, bottom] = self.plot;
        [left + along(time_ms, self.x) * (right - left), bottom - along(error, self.y) * (bottom - top)]
    }
}

/// Draws a panel; the height that it took.
fn draw(out: &mut String, panel: &Panel, top: f64) -> f64 {
    let own = &panel.points;
    let times = own.iter().filter_map(|p| p.time_ms).chain([LIVE_MS]);
    let errors = own.iter().filter_map(|p| p.error);
    let failures = own.iter().any(|p| p.failed > 0);
    let plot_top = top + 16.0 + if failures { BAND } else { 0.0 };
    let place = Place {
        plot: [LEFT, plot_top, LEFT + PLOT_WIDTH, plot_top + PLOT_HEIGHT],
        x: decades(times),
        y: decades(errors),
    };
    let _ = write!(out, r#"<text x="{LEFT}" y="{top:.1}" font-size="15">{}</text>"#, escape(&panel.title));
    frame(out, &place, panel.error, failures);
    let mut methods: Vec<&str> = Vec::new();
    for p in own {
        if !methods.contains(&p.method.as_str()) {
            methods.push(&p.method);
        }
    }
    let right = LEFT + PLOT_WIDTH + 26.0;
    let mut row = plot_top + 6.0;
    let mut say = |out: &mut String, mark: &str, text: &str, colour: &str| {
        for (k, line) in wrapped(text, LETTERS).iter().enumerate() {
            if k == 0 {
                let _ = write!(out, r#"<g transform="translate({:.1} {:.1})">{mark}</g>"#, right + 10.0, row - 4.5);
            }
            let _ = write!(
                out,
                r#"<text x="{:.1}" y="{row:.1}" fill="{colour}" font-size="12.5">{}</text>"#,
                right + 28.0,
                escape(line)
            );
            row += LINE;
        }
    };
    let mut front: Vec<[f64; 2]> = Vec::new();
    for (k, method) in methods.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        line_of(out, &place, own, method, colour, k);
        say(out, &mark(k, colour, true), method, INK);
        for p in own.iter().filter(|p| p.method == *method && p.failed > 0) {
            let text = format!(
                "{}: {} of {} failed, {}",
                in_words(&p.setting),
                p.failed,
                p.runs,
                p.cause.as_deref().unwrap_or("no cause given")
            );
            say(out, &mark(k, colour, false), &text, WEAK);
        }
        front.extend(
            own.iter().filter(|p| p.method == *method && p.on_front).filter_map(|p| Some([p.time_ms?, p.error?])),
        );
    }
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let path: Vec<String> =
        front.iter().map(|[t, e]| place.at(*t, *e)).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if !path.is_empty() {
        let _ = write!(
            out,
            r#"<path d="M{}" fill="none" stroke="{INK}" stroke-width="1.2" stroke-dasharray="3 3"/>"#,
            path.join("L")
        );
        for [t, e] in &front {
            let [x, y] = place.at(*t, *e);
            let _ =
                write!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="8" fill="none" stroke="{INK}" stroke-width="1.2"/>"#);
        }
        let ring = format!(r#"<circle r="7" fill="none" stroke="{INK}" stroke-width="1.2"/>"#);
        say(out, &ring, "nobody is both as fast and as true", WEAK);
    }
    for chosen in &panel.chosen {
        let same = |p: &&Point| p.method == chosen.method && p.setting == chosen.setting;
        let Some([x, y]) = own.iter().find(same).and_then(|p| Some(place.at(p.time_ms?, p.error?))) else { continue };
        let ring = |r: f64| format!(r#"<circle r="{r}" fill="none" stroke="{INK}" stroke-width="2.4"/>"#);
        let _ = write!(out, r#"<g transform="translate({x:.1} {y:.1})">{}</g>"#, ring(12.0));
        let words = format!("chosen {}: {} ({})", chosen.words, chosen.method, in_words(&chosen.setting));
        say(out, &ring(7.0), &words, INK);
    }
    (place.plot[3] + 46.0).max(row) - top
}

fn frame(out: &mut String, place: &Place, error: &str, failures: bool) {
    let [left, top, right, bottom] = place.plot;
    for power in place.x[0].log10().round() as i32..=place.x[1].log10().round() as i32 {
        let [x, _] = place.at(10_f64.powi(power), place.y[0]);
        let _ = write!(
            out,
            r##"<path d="M{x:.1} {top:.1}V{bottom:.1}" stroke="#e3e3e8"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{}</text>"##,
            bottom + 18.0,
            time_words(power)
        );
    }
    for power in place.y[0].log10().round() as i32..=place.y[1].log10().round() as i32 {
        let [_, y] = place.at(place.x[0], 10_f64.powi(power));
        let word = percent_words(power);
        let _ = write!(
            out,
            r##"<path d="M{left:.1} {y:.1}H{right:.1}" stroke="#e3e3e8"/><text x="{:.1}" y="{:.1}" text-anchor="end">{word}</text>"##,
            left - 8.0,
            y + 4.5
        );
    }
    let [live, _] = place.at(LIVE_MS, place.y[0]);
    let _ = write!(
        out,
        r##"<path d="M{live:.1} {top:.1}V{bottom:.1}" stroke="#8a8a94" stroke-width="1.5"/><text transform="translate({:.1} {:.1}) rotate(-90)" fill="{WEAK}" font-size="12" stroke="#ffffff" stroke-width="3" paint-order="stroke">16 ms: live while dragging</text><path d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}" stroke="{INK}" fill="none"/><text x="{:.1}" y="{:.1}" text-anchor="middle" fill="{WEAK}">median time</text><text transform="translate(22 {:.1}) rotate(-90)" text-anchor="middle" fill="{WEAK}">{error}</text>"##,
        live - 5.0,
        bottom - 8.0,
        0.5 * (left + right),
        bottom + 38.0,
        0.5 * (top + bottom)
    );
    if failures {
        let _ = write!(
            out,
            r##"<rect x="{left:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="#f4f4f7"/><text x="{:.1}" y="{:.1}" text-anchor="end" fill="{WEAK}" font-size="12">failed</text>"##,
            top - BAND,
            right - left,
            BAND - 4.0,
            left - 8.0,
            top - BAND + 17.0
        );
    }
}

/// "1 ms", "10 µs": a power of ten of milliseconds.
pub fn time_words(power: i32) -> String {
    match power {
        ..=-7 => format!("1e{power} ms").replace('-', "−"),
        -6..=-4 => format!("{} ns", 10_f64.powi(power + 6)),
        -3..=-1 => format!("{} µs", 10_f64.powi(power + 3)),
        0..=2 => format!("{} ms", 10_f64.powi(power)),
        _ => format!("{} s", 10_f64.powi(power - 3)),
    }
}

/// "10 %": a power of ten as a share.
pub fn percent_words(power: i32) -> String {
    let percent = 10_f64.powi(power + 2);
    if percent >= 1e-3 { format!("{percent} %") } else { format!("1e{} %", power + 2).replace('-', "−") }
}

/// The line of a method over its sweep, with its points; failed ones hollow, in the band above where they have no error.
fn line_of(out: &mut String, place: &Place, own: &[Point], method: &str, colour: &str, shape: usize) {
    let of = || own.iter().filter(|p| p.method == method);
    let path: Vec<String> =
        of().filter_map(|p| Some(place.at(p.time_ms?, p.error?))).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if path.len() > 1 {
        let _ = write!(
            out,
            r#"<path d="M{}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-opacity="0.7"/>"#,
            path.join("L")
        );
    }
    for p in of() {
        let Some(time) = p.time_ms else { continue };
        let [x, y] = match p.error {
            Some(error) => place.at(time, error),
            None => [place.at(time, place.y[0])[0], place.plot[1] - 0.5 * BAND - 2.0],
        };
        let _ = write!(out, r#"<g transform="translate({x:.1} {y:.1})">{}</g>"#, mark(shape, colour, p.failed == 0));
    }
}

/// The mark of a method around the origin: its shape tells it apart as well as its colour; hollow for failures.
fn mark(method: usize, colour: &str, filled: bool) -> String {
    let fill = if filled { colour } else { "#ffffff" };
    let style = format!(r#"fill="{fill}" stroke="{colour}" stroke-width="1.6""#);
    match method % 4 {
        0 => format!(r#"<circle r="4" {style}/>"#),
        1 => format!(r#"<rect x="-3.8" y="-3.8" width="7.6" height="7.6" {style}/>"#),
        2 => format!(r#"<path d="M0 -5L4.8 3.6H-4.8Z" {style}/>"#),
        _ => format!(r#"<path d="M0 -5.2L5.2 0L0 5.2L-5.2 0Z" {style}/>"#),
    }
}

/// A text in lines of at most so many letters, cut between words.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last().map_or(0, |l| l.chars().count());
        if last > 0 && last + 1 + word.chars().count() > letters {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::table::setting;

    pub(super) fn table() -> Vec<Run> {
        let run = |method: &str, level: f64, seed: u64, ms: f64, error: f64| {
            let at = setting(&[("level", level)]);
            Run { seed, vertices: 612, noise_px: 1.0, ..Run::new("accuracy", "inverse", method, at) }
                .timed(ms)
                .erring(error)
        };
        let mut runs = Vec::new();
        for seed in 1..=3 {
            for (k, level) in [1.0, 2.0, 3.0].into_iter().enumerate() {
                let f = 4.0_f64.powf(k as f64);
                runs.push(run("Direct", level, seed, 0.004 * f, 0.9 / (1.0 + k as f64)));
                runs.push(run("Regularised", level, seed, 0.5 * f, 0.3 / f));
                let muscle = run("Muscle-based", level, seed, 9.0 * f, 0.08 / f);
                runs.push(if k == 2 { muscle.failing(Some("out of iterations".into())) } else { muscle });
            }
        }
        for run in runs.iter_mut().filter(|r| !r.is_ok()) {
            run.force_error = None;
        }
        runs
    }

    #[test]
    fn a_line_a_method_a_ring_for_the_front_and_a_hollow_mark_for_failures() {
        let panels = panels(&table(), |p| format!("About {p}"));
        assert_eq!(panels.len(), 1);
        assert_eq!(panels[0].title, "About inverse, 1 px of marking noise");
        let text = svg("Speed against accuracy", &panels, "a machine");
        assert!(text.contains("level 3: 3 of 3 failed, out of iterations"), "{text}");
        assert!(text.contains("16 ms: live while dragging"));
        // Direct and regularised overlap in neither; only Direct's first points and what is better on the right are on the front.
        assert_eq!(text.matches(r#"r="8""#).count(), panels[0].points.iter().filter(|p| p.on_front).count());
        assert!(!text.contains("NaN"));
        crate::draw::svg::paint(&text, 1.0).unwrap();
        assert_eq!(wrapped("aa bb cc", 5), ["aa bb", "cc"]);
        assert_eq!((time_words(-5), time_words(1)), ("10 ns".into(), "10 ms".into()));
    }

    #[test]
    fn an_empty_table_is_an_empty_chart() {
        let nothing =
            [Panel { title: String::new(), error: accuracy::FORCE_ERROR, points: Vec::new(), chosen: Vec::new() }];
        crate::draw::svg::paint(&svg("", &nothing, ""), 1.0).unwrap();
    }
}
