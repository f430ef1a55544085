//! Many samples of a trial in few numbers.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Sample, Way};

/// What became of the points of one way, in all scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// The way.
    pub way: Way,
    /// Whether with a painted grid.
    pub grid: bool,
    /// Number of points.
    pub count: usize,
    /// Those that were not found.
    pub failed: usize,
    /// Median error of those found, px.
    pub median_px: f64,
    /// Error that 95 % of those found stay below, px.
    pub p95_px: f64,
    /// Root mean square error, px.
    pub rms_px: f64,
    /// Share of those found within 0.15, 0.5 and 1 px.
    pub within: [f64; 3],
    /// Median time of a point, µs.
    pub time_us: f64,
}

/// Distances that [`Summary::within`] is about, px.
const WITHIN_PX: [f64; 3] = [0.15, 0.5, 1.0];

/// One summary a way, with and without a grid.
pub fn summaries(samples: &[Sample]) -> Vec<Summary> {
    let mut groups: BTreeMap<(Way, bool), Vec<&Sample>> = BTreeMap::new();
    for s in samples {
        groups.entry((s.way, s.grid)).or_default().push(s);
    }
    let summary = |((way, grid), group): ((Way, bool), Vec<&Sample>)| {
        let mut errors: Vec<f64> = group.iter().filter_map(|s| s.error_px).collect();
        errors.sort_by(f64::total_cmp);
        let mut times: Vec<f64> = group.iter().map(|s| s.time_us).collect();
        times.sort_by(f64::total_cmp);
        let n = errors.len().max(1) as f64;
        Summary {
            way,
            grid,
            count: group.len(),
            failed: group.len() - errors.len(),
            median_px: at(&errors, 0.5),
            p95_px: at(&errors, 0.95),
            rms_px: (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            within: WITHIN_PX.map(|px| errors.iter().filter(|e| **e < px).count() as f64 / n),
            time_us: at(&times, 0.5),
        }
    };
    groups.into_iter().map(summary).collect()
}

fn at(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((share * last).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Points whose confidence lies in a range, what was said of them and what is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// The range.
    pub from: f64,
    /// Its end; the last one holds it.
    pub to: f64,
    /// Number of points.
    pub count: usize,
    /// Mean confidence.
    pub said: f64,
    /// Share within 1 px of the truth.
    pub is: f64,
}

/// Ends of the ranges of confidence.
const ENDS: [f64; 9] = [0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.95, 0.99, 1.0];

/// Confidence against truth, of all tracked points with or without a grid.
pub fn reliability(samples: &[Sample], grid: bool) -> Vec<Bin> {
    ENDS.windows(2).map(|ends| Bin::of(samples, grid, [ends[0], ends[1]])).collect()
}

impl Bin {
    /// The points whose confidence lies between two ends, the upper one not among them but where it is 1.
    pub fn of(samples: &[Sample], grid: bool, [from, to]: [f64; 2]) -> Self {
        let inside = |c: &f64| *c >= from && (*c < to || to >= 1.0);
        let tracked = samples.iter().filter(|s| s.grid == grid);
        let own: Vec<(f64, bool)> =
            tracked.filter_map(|s| Some((s.confidence.filter(inside)?, s.error_px.is_some_and(|e| e < 1.0)))).collect();
        let n = own.len().max(1) as f64;
        Self {
            from,
            to,
            count: own.len(),
            said: own.iter().map(|s| s.0).sum::<f64>() / n,
            is: own.iter().filter(|s| s.1).count() as f64 / n,
        }
    }
}

/// Crossings that got the column and row of another, and all that were told apart.
pub fn identities(samples: &[Sample]) -> (usize, usize) {
    let told = || samples.iter().filter_map(|s| s.mistaken);
    (told().filter(|m| *m).count(), told().count())
}

/// One row a way.
pub fn csv(samples: &[Sample]) -> String {
    let mut text =
        "study,method,grid,points,failed,median_px,p95_px,rms_px,within_0.15_px,within_0.5_px,within_1_px,time_us\n"
            .to_owned();
    for s in summaries(samples) {
        let _ = writeln!(
            text,
            "marking,\"{}\",{},{},{},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.1}",
            s.way.name(),
            if s.grid { "painted" } else { "none" },
            s.count,
            s.failed,
            s.median_px,
            s.p95_px,
            s.rms_px,
            s.within[0],
            s.within[1],
            s.within[2],
            s.time_us
        );
    }
    text
}
