//! The chart of the ladder: the error that 95 % of twins stay below against the time after a drag, with the rungs that were chosen.

use super::study_chart::{self, Chosen, Panel};
use crate::draw::numbers::significant;
use crate::study::Run;
use crate::study::accuracy::FORCE_ERROR;
use crate::study::ladder::{Goal, Goals, Standing, choose, standings};
use crate::study::points::{Point, mark_front};

/// A panel a marking error, the stated one first.
pub fn svg(heading: &str, runs: &[Run], goals: Goals, caption: &str) -> String {
    let rungs = standings(runs);
    let mut noises: Vec<(f64, f64)> =
        rungs.iter().flat_map(|r| &r.noises).map(|n| (n.times_stated, n.noise_px)).collect();
    let far = |times: f64| (times - 1.0).abs();
    noises.sort_unstable_by(|a, b| far(a.0).total_cmp(&far(b.0)));
    noises.dedup();
    let panels: Vec<Panel> = noises.into_iter().map(|noise| panel(&rungs, goals, noise)).collect();
    study_chart::svg(heading, &panels, caption)
}

fn panel(rungs: &[Standing], goals: Goals, (times_stated, noise_px): (f64, f64)) -> Panel {
    let point = |r: &Standing| {
        let at = r.at(times_stated)?;
        let limit = Some(at.bound.value).filter(|v| v.is_finite());
        Some(Point {
            method: r.method.clone(),
            setting: r.setting.clone(),
            noise_px,
            vertices: r.vertices,
            time_ms: r.time_ms,
            error: limit,
            runs: at.bound.twins,
            failed: usize::from(limit.is_none()),
            cause: limit.is_none().then(|| "more than 5 % of twins have no answer".to_owned()),
            on_front: false,
        })
    };
    let mut points: Vec<Point> = rungs.iter().filter_map(point).collect();
    mark_front(&mut points);
    let chosen = goals.all().filter_map(|goal| {
        let rung = rungs.get(choose(goal, rungs, times_stated).picked?)?;
        Some(Chosen { method: rung.method.clone(), setting: rung.setting.clone(), words: goal_words(goal) })
    });
    Panel {
        error: FORCE_ERROR,
        title: format!("At {} px: 95 % of twins err by less than this", significant(noise_px, 3)),
        chosen: chosen.collect(),
        points,
    }
}

/// "for 10 %", "within 16 ms".
pub fn goal_words(goal: Goal) -> String {
    match goal {
        Goal::Accuracy(share) => format!("for {} %", significant(100.0 * share, 3)),
        Goal::Time(ms) => format!("within {} ms", significant(ms, 3)),
    }
}
