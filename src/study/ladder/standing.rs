//! How every rung stands, from the rows of a table alone: its bound at every marking error, and its time.

use super::bound::Bound;
use super::{FRESH, MEASURED, REGION, SHARE_SOLVED, TIMES_STATED, WHOLE_FACE, WHOLE_MS};
use crate::study::points::median;
use crate::study::table::{Run, in_words};

/// One rung.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// The way.
    pub method: String,
    /// Depth rule and mesh.
    pub setting: String,
    /// Vertices of its mesh.
    pub vertices: usize,
    /// Median time of the chain after a drag, ms.
    pub time_ms: Option<f64>,
    /// Half of the way between the quartiles of that time, ms: its noise.
    pub spread_ms: f64,
    /// What was measured, from the least marking error to the largest.
    pub noises: Vec<AtNoise>,
    /// What solving only the region that moved changes and takes, from the least marking error to the largest.
    pub regions: Vec<Region>,
}

/// A rung at one marking error.
#[derive(Clone, Debug, PartialEq)]
pub struct AtNoise {
    /// The marking error over the one that is stated.
    pub times_stated: f64,
    /// The marking error, px.
    pub noise_px: f64,
    /// The limit that 95 % of twins stay within.
    pub bound: Bound,
    /// Median error.
    pub median: f64,
    /// Errors of the fresh twins; infinite where there was no answer.
    pub fresh: Vec<f64>,
}

/// Only the region that moved, at one marking error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Whether every vertex of the face was marked.
    pub whole_face: bool,
    /// The marking error, px.
    pub noise_px: f64,
    /// Twins.
    pub twins: usize,
    /// Twins of which some marks could be left out.
    pub cut: usize,
    /// Largest change of the answer of those, relative to the whole.
    pub largest_change: f64,
    /// Median share of the marks that were solved for those.
    pub share: Option<f64>,
    /// Median times of the chain after a drag on timed twins that could be cut, ms: the whole and the region.
    pub times_ms: Option<[f64; 2]>,
}

impl Standing {
    /// "Regularised, discrepancy (depth height, mesh own)".
    pub fn name(&self) -> String {
        format!("{} ({})", self.method, in_words(&self.setting))
    }

    /// What was measured at a marking error.
    pub fn at(&self, times_stated: f64) -> Option<&AtNoise> {
        self.noises.iter().find(|n| n.times_stated == times_stated)
    }

    /// The limit at a marking error; infinite where nothing was measured.
    pub fn limit(&self, times_stated: f64) -> f64 {
        self.at(times_stated).map_or(f64::INFINITY, |n| n.bound.value)
    }
}

/// The rungs of a table in its order, the simplest first.
pub fn standings(runs: &[Run]) -> Vec<Standing> {
    let mut keys: Vec<(&str, &str)> = Vec::new();
    let mut own: Vec<Vec<&Run>> = Vec::new();
    for run in runs.iter().filter(|r| r.study == super::STUDY) {
        let key = (run.method.as_str(), run.setting.as_str());
        if let Some(at) = keys.iter().position(|k| *k == key) {
            own[at].push(run);
        } else {
            keys.push(key);
            own.push(vec![run]);
        }
    }
    keys.iter().zip(own).filter_map(|(key, runs)| standing(*key, &runs)).collect()
}

fn standing((method, setting): (&str, &str), runs: &[&Run]) -> Option<Standing> {
    let of = |part: &'static str| runs.iter().filter(move |r| r.part == part);
    let mut noises: Vec<f64> = of(MEASURED).filter_map(|r| r.measures.get(TIMES_STATED).copied()).collect();
    noises.sort_unstable_by(f64::total_cmp);
    noises.dedup();
    let error = |r: &&&Run| r.force_error.filter(|_| r.is_ok()).unwrap_or(f64::INFINITY);
    let at = |times_stated: f64| {
        let there = |part| of(part).filter(move |r| r.measures.get(TIMES_STATED) == Some(&times_stated));
        let mut errors: Vec<f64> = there(MEASURED).map(|r| error(&r)).collect();
        Some(AtNoise {
            times_stated,
            noise_px: there(MEASURED).next()?.noise_px,
            bound: Bound::of(&mut errors)?,
            median: median(&mut errors)?,
            fresh: there(FRESH).map(|r| error(&r)).collect(),
        })
    };
    let noises: Vec<AtNoise> = noises.into_iter().filter_map(at).collect();
    let mut times: Vec<f64> = of(MEASURED).filter_map(|r| r.time_ms).collect();
    let mut spreads: Vec<f64> = of(MEASURED).filter_map(|r| r.measures.get(super::SPREAD_MS).copied()).collect();
    (!noises.is_empty()).then(|| Standing {
        method: method.to_owned(),
        setting: setting.to_owned(),
        vertices: of(MEASURED).next().map_or(0, |r| r.vertices),
        time_ms: median(&mut times),
        spread_ms: median(&mut spreads).unwrap_or(0.0),
        noises,
        regions: [(REGION, false), (WHOLE_FACE, true)]
            .into_iter()
            .flat_map(|(part, whole)| regions(&of(part).copied().collect::<Vec<_>>(), whole))
            .collect(),
    })
}

fn regions(runs: &[&Run], whole_face: bool) -> Vec<Region> {
    let mut noises: Vec<f64> = runs.iter().map(|r| r.noise_px).collect();
    noises.sort_unstable_by(f64::total_cmp);
    noises.dedup();
    let region = |noise_px: f64| {
        let there = || runs.iter().filter(move |r| r.noise_px == noise_px);
        let told: Vec<(f64, f64)> =
            there().filter_map(|r| Some((*r.measures.get(SHARE_SOLVED)?, r.force_error?))).collect();
        let cut: Vec<&(f64, f64)> = told.iter().filter(|t| t.0 < 1.0).collect();
        let middle = |of: &dyn Fn(&Run) -> Option<f64>| median(&mut there().filter_map(|r| of(r)).collect::<Vec<_>>());
        let whole = middle(&|r| r.measures.get(WHOLE_MS).copied());
        Region {
            whole_face,
            noise_px,
            twins: told.len(),
            cut: cut.len(),
            largest_change: cut.iter().map(|t| t.1).fold(0.0, f64::max),
            share: median(&mut cut.iter().map(|t| t.0).collect::<Vec<_>>()),
            times_ms: whole.zip(middle(&|r| r.time_ms)).map(|(whole, part)| [whole, part]),
        }
    };
    noises.into_iter().map(region).collect()
}
