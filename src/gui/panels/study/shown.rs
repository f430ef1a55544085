//! What the workspace shows of a table: the lines or maps of one part, kept until the table or a filter changes.

use std::collections::BTreeSet;

use super::plot::{Dot, Line};
use crate::draw::numbers::significant;
use crate::gui::study_work::Table;
use crate::study::Kind;
use crate::study::cells::{Map, causes, maps};
use crate::study::ladder::standing::AtNoise;
use crate::study::ladder::{self, Standing, standings};
use crate::study::points::{Point, mark_front, points};
use crate::study::table::{in_words, pairs};

/// How a part is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// Time against error.
    Accuracy,
    /// Time a vertex against the number of vertices.
    Growth,
    /// Time against another setting.
    Times,
    /// Cells.
    Maps,
}

/// What is asked of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Asked {
    pub(super) revision: u64,
    pub(super) part: String,
    pub(super) hidden: BTreeSet<String>,
    pub(super) noise: Option<f64>,
}

/// What is shown of it.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    pub(super) asked: Asked,
    /// The parts of the table and what stands above each.
    pub(super) parts: Vec<(String, String)>,
    /// The methods of the part, hidden ones too, in the order of the table.
    pub(super) methods: Vec<String>,
    /// The noises of the part, px; none where it is an axis of the map.
    pub(super) noises: Vec<f64>,
    pub(super) look: Look,
    pub(super) lines: Vec<Line>,
    pub(super) maps: Vec<Map>,
    pub(super) causes: Vec<String>,
    /// The rungs of a ladder; none of any other study.
    pub(super) rungs: Vec<Standing>,
}

impl Shown {
    /// What a table shows when it is asked so; a part that it does not have is its first.
    pub(super) fn of(table: &Table, mut asked: Asked) -> Self {
        if table.kind == Some(Kind::Ladder) {
            return Self::of_ladder(table, asked);
        }
        let mut parts: Vec<(String, String)> = Vec::new();
        for run in table.runs.iter() {
            if !parts.iter().any(|p| p.0 == run.part) {
                let title = table.kind.map_or_else(|| run.part.clone(), |k| k.title(&run.part));
                parts.push((run.part.clone(), title));
            }
        }
        if !parts.iter().any(|p| p.0 == asked.part) {
            asked.part = parts.first().map(|p| p.0.clone()).unwrap_or_default();
        }
        let own: Vec<_> = table.runs.iter().filter(|r| r.part == asked.part).collect();
        let (mut methods, mut noises) = (Vec::new(), Vec::new());
        for run in &own {
            if !methods.contains(&run.method) {
                methods.push(run.method.clone());
            }
            if !noises.contains(&run.noise_px) {
                noises.push(run.noise_px);
            }
        }
        noises.sort_by(f64::total_cmp);
        let timed = own.iter().any(|r| r.time_ms.is_some());
        let look = match (timed, own.iter().any(|r| r.force_error.is_some())) {
            (true, true) => Look::Accuracy,
            (true, false) if own.iter().any(|r| r.vertices != own[0].vertices) => Look::Growth,
            (true, false) => Look::Times,
            _ => Look::Maps,
        };
        if look == Look::Maps {
            noises.clear();
        }
        if !asked.noise.is_some_and(|n| noises.contains(&n)) {
            // One pixel is what the marks of a hand err by.
            asked.noise = noises.iter().copied().find(|n| *n == 1.0).or(noises.last().copied());
        }
        let seen: Vec<_> = own
            .into_iter()
            .filter(|r| !asked.hidden.contains(&r.method) && asked.noise.is_none_or(|n| r.noise_px == n))
            .cloned()
            .collect();
        let mut shown = Self {
            parts,
            methods,
            noises,
            look,
            lines: Vec::new(),
            maps: Vec::new(),
            causes: Vec::new(),
            rungs: Vec::new(),
            asked,
        };
        if look == Look::Maps {
            shown.maps = maps(&seen, &shown.asked.part);
            // Letters that stay when a method is hidden.
            let all: Vec<Map> = shown.parts.iter().flat_map(|p| maps(&table.runs, &p.0)).collect();
            shown.causes = causes(&all).into_iter().map(str::to_owned).collect();
        } else {
            shown.lines = shown.lines_of(&seen);
        }
        shown
    }

    /// A ladder: its rungs as points, one line a way.
    fn of_ladder(table: &Table, mut asked: Asked) -> Self {
        let rungs = standings(&table.runs);
        let (mut methods, mut noises, mut stated) = (Vec::new(), Vec::new(), None);
        for rung in &rungs {
            if !methods.contains(&rung.method) {
                methods.push(rung.method.clone());
            }
            for n in &rung.noises {
                if !noises.contains(&n.noise_px) {
                    noises.push(n.noise_px);
                }
                stated = stated.or((n.times_stated == 1.0).then_some(n.noise_px));
            }
        }
        noises.sort_by(f64::total_cmp);
        ladder::MEASURED.clone_into(&mut asked.part);
        asked.noise = asked.noise.filter(|n| noises.contains(n)).or(stated);
        let place = |method: &str| methods.iter().position(|m| m == method).unwrap_or(0);
        let mut points: Vec<(Point, String)> = Vec::new();
        for rung in rungs.iter().filter(|r| !asked.hidden.contains(&r.method)) {
            points.extend(rung.noises.iter().filter(|n| asked.noise == Some(n.noise_px)).map(|n| rung_point(rung, n)));
        }
        let (mut plain, words): (Vec<Point>, Vec<String>) = points.into_iter().unzip();
        mark_front(&mut plain);
        let mut lines: Vec<Line> = Vec::new();
        for (p, words) in plain.iter().zip(words) {
            let Some(x) = p.time_ms.filter(|t| *t > 0.0) else { continue };
            let (y, failed) = (p.error, p.error.is_none());
            let dot = Dot { x, y, failed, front: p.on_front, setting: p.setting.clone(), words };
            match lines.iter_mut().find(|l| l.method == p.method) {
                Some(line) => line.dots.push(dot),
                None => lines.push(Line { method: p.method.clone(), place: place(&p.method), dots: vec![dot] }),
            }
        }
        Self {
            parts: vec![(asked.part.clone(), ladder::title(&asked.part).to_owned())],
            methods,
            noises,
            look: Look::Accuracy,
            lines,
            maps: Vec::new(),
            causes: Vec::new(),
            rungs,
            asked,
        }
    }

    fn lines_of(&self, runs: &[crate::study::Run]) -> Vec<Line> {
        let mut all = points(runs, &self.asked.part);
        if self.look == Look::Accuracy {
            mark_front(&mut all);
        }
        let line = |(place, method): (usize, &String)| {
            let own = all.iter().filter(|p| p.method == *method);
            let dot = |p: &Point| {
                let ms = p.time_ms.filter(|t| *t > 0.0)?;
                let [x, y] = match self.look {
                    Look::Accuracy => [Some(ms), p.error.filter(|e| *e > 0.0)],
                    Look::Growth => [Some(p.vertices as f64), Some(1e6 * ms / p.vertices.max(1) as f64)],
                    _ => [pairs(&p.setting).first().and_then(|s| s.1.parse().ok()).filter(|v| *v > 0.0), Some(ms)],
                };
                let words = said(p);
                Some(Dot { x: x?, y, failed: p.failed > 0, front: p.on_front, setting: p.setting.clone(), words })
            };
            Line { method: method.clone(), place, dots: own.filter_map(dot).collect() }
        };
        let lines = self.methods.iter().enumerate().map(line);
        lines.filter(|l| !l.dots.is_empty()).collect()
    }
}

/// A rung at a marking error as a point, and what is said of it.
fn rung_point(rung: &Standing, at: &AtNoise) -> (Point, String) {
    let limit = Some(at.bound.value).filter(|v| v.is_finite());
    let percent = |share: f64| format!("{} %", significant(100.0 * share, 3));
    let mut lines = vec![rung.method.clone(), in_words(&rung.setting), format!("{} vertices", rung.vertices)];
    lines.extend(rung.time_ms.map(|ms| format!("{} ms after a drag", significant(ms, 3))));
    lines.push(limit.map_or_else(
        || "no answer on more than 5 % of twins".to_owned(),
        |limit| format!("95 % of twins err by less than {}, half by less than {}", percent(limit), percent(at.median)),
    ));
    lines.push(format!("{} twins", at.bound.twins));
    let point = Point {
        method: rung.method.clone(),
        setting: rung.setting.clone(),
        noise_px: at.noise_px,
        vertices: rung.vertices,
        time_ms: rung.time_ms,
        error: limit,
        runs: at.bound.twins,
        failed: usize::from(limit.is_none()),
        cause: None,
        on_front: false,
    };
    (point, lines.join("\n"))
}

/// What is said of a point.
pub(super) fn said(p: &Point) -> String {
    let noise = if p.noise_px > 0.0 { format!(", {} px of noise", p.noise_px) } else { String::new() };
    let mut lines = vec![p.method.clone(), in_words(&p.setting), format!("{} vertices{noise}", p.vertices)];
    lines.extend(p.time_ms.map(|ms| format!("{} ms", significant(ms, 3))));
    lines.extend(p.error.map(|e| format!("force error {} %", significant(100.0 * e, 3))));
    lines.push(if p.failed == 0 {
        format!("{} runs, all ended well", p.runs)
    } else {
        format!("{} of {} runs failed: {}", p.failed, p.runs, p.cause.as_deref().unwrap_or("no cause given"))
    });
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Run;
    use std::sync::Arc;

    fn table() -> Table {
        let run = |part: &str, method: &str, noise: f64, error: Option<f64>| {
            let setting = "step_ms=1; stiffness=2".to_owned();
            let run = Run { noise_px: noise, vertices: 612, ..Run::new("stability", part, method, setting) };
            error.map_or(run.clone(), |e| run.erring(e).timed(2.0))
        };
        let runs = vec![
            run("accuracy", "A", 0.0, Some(0.1)),
            run("accuracy", "A", 1.0, Some(0.4)),
            run("accuracy", "B", 1.0, Some(0.2)),
            run("map", "A", 0.0, None).failing(Some("ran away".into())),
        ];
        Table { title: "t".into(), kind: None, runs: Arc::new(runs), revision: 1 }
    }

    #[test]
    fn a_part_is_filtered_by_noise_and_method_and_keeps_its_colours() {
        let shown = Shown::of(&table(), Asked::default());
        assert_eq!((shown.look, shown.asked.part.as_str(), shown.asked.noise), (Look::Accuracy, "accuracy", Some(1.0)));
        assert_eq!(shown.lines.len(), 2);
        assert_eq!(shown.lines[0].dots[0].y, Some(0.4));
        // At the same time of 2 ms B errs less: it alone is not beaten.
        assert!(!shown.lines[0].dots[0].front && shown.lines[1].dots[0].front);
        let hidden = Asked { hidden: BTreeSet::from(["A".into()]), noise: Some(1.0), ..Asked::default() };
        let shown = Shown::of(&table(), hidden);
        assert_eq!((shown.lines.len(), shown.lines[0].place, shown.methods.len()), (1, 1, 2));
        let shown = Shown::of(&table(), Asked { part: "map".into(), ..Asked::default() });
        assert_eq!(
            (shown.look, shown.maps.len(), shown.causes.as_slice()),
            (Look::Maps, 1, &["ran away".to_owned()][..])
        );
        assert!(shown.noises.is_empty());
    }
}
