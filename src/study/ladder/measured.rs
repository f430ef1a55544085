//! The rows of the ladder: every rung on a twin at every marking error, its region, and its time after a drag.

use std::sync::{Arc, OnceLock};

use super::ground::{FEWEST_COMPARED, Ground};
use super::region::restricted;
use super::rungs::{Level, Rung, rungs};
use super::twins::Truth;
use super::{MEASURED, REGION, SHARE_SOLVED, SPREAD_MS, STUDY, TIMES_STATED, WHOLE_FACE, WHOLE_MS};
use crate::pipeline::Workspace;
use crate::project::Project;
use crate::study::table::{Run, rounded};
use crate::study::yardstick::{drag_times, relative_error};

/// Marks dragged one after the other while the chain is timed.
const DRAGS: usize = 15;
/// Marking errors over the stated one at which regions are tried.
const REGION_NOISES: [f64; 3] = [0.0, 0.25, 1.0];

/// A ground that is made once, when the first case asks for it.
pub(super) type Shared = Arc<OnceLock<Result<Ground, String>>>;

/// What a twin is measured for.
#[derive(Clone, Debug)]
pub(super) struct Asked {
    /// Measured or fresh.
    pub(super) part: &'static str,
    /// Marking errors over the stated one.
    pub(super) noises: Vec<f64>,
    /// Whether the finer mesh is tried.
    pub(super) finer: bool,
    /// Twins on which the region that moved is tried: with the marks of the project, and with the whole face marked.
    pub(super) regions: [u64; 2],
}

fn row(part: &str, rung: &Rung, ground: &Ground, seed: u64, noise_px: f64) -> Run {
    let run = Run::new(STUDY, part, &rung.method, rung.setting.clone());
    Run { noise_px, vertices: rung.vertices(ground), seed, ..run }
}

/// A row that says why there is nothing.
pub(super) fn nothing(part: &str, seed: u64, why: String) -> Vec<Run> {
    vec![Run { seed, ..Run::new(STUDY, part, "Twin", String::new()) }.failing(Some(why))]
}

/// All rungs on the twin of a seed.
pub(super) fn twin(ground: &Ground, asked: &Asked, seed: u64) -> Vec<Run> {
    let truth = match Truth::new(ground, seed) {
        Ok(truth) => truth,
        Err(why) => return nothing(asked.part, seed, why),
    };
    let rungs = rungs(asked.finer);
    let mut rows = Vec::new();
    for &times in &asked.noises {
        let marked = truth.project(ground, times);
        let mut found: Vec<Option<Run>> = vec![None; rungs.len()];
        let mut workspaces = [Workspace::default(), Workspace::default()];
        // Rungs on one mesh and the same marks follow each other: they share the customised face, its skull and its plate.
        for level in Level::ALL {
            let workspace = &mut workspaces[usize::from(level == Level::Finer)];
            for (slot, rung) in found.iter_mut().zip(&rungs).filter(|(_, r)| r.level == level) {
                let row = row(asked.part, rung, ground, seed, times * ground.sigma_px).with(TIMES_STATED, times);
                *slot = Some(error(ground, &truth, rung, &marked, workspace, row));
            }
        }
        rows.extend(found.into_iter().flatten());
    }
    if seed <= asked.regions[0] {
        rows.extend(regions(ground, &truth, &rungs, &[1.0], (REGION, seed)));
    }
    if seed <= asked.regions[1] {
        let whole = ground.whole_face();
        rows.extend(whole.iter().flat_map(|g| regions(g, &truth, &rungs, &REGION_NOISES, (WHOLE_FACE, seed))));
    }
    rows
}

fn error(ground: &Ground, truth: &Truth, rung: &Rung, marked: &Project, workspace: &mut Workspace, row: Run) -> Run {
    let Some(answer) = rung.solve(ground, &rung.project(ground, marked), workspace) else {
        return row.failing(Some("no muscles can be fitted".to_owned()));
    };
    let compared = truth.compared(ground);
    let counted: Vec<usize> = compared.iter().copied().filter(|v| answer.believed[*v]).collect();
    if counted.len() < FEWEST_COMPARED || 2 * counted.len() < compared.len() {
        return row.failing(Some("fewer than half of the vertices can be believed".to_owned()));
    }
    row.erring(relative_error(&answer.force, &truth.force, &counted)).with("compared", counted.len() as f64)
}

/// What solving only the region that moved changes, for every rung that has one.
fn regions(ground: &Ground, truth: &Truth, rungs: &[Rung], noises: &[f64], (part, seed): (&str, u64)) -> Vec<Run> {
    let mut rows = Vec::new();
    let own: Vec<&Rung> = rungs.iter().filter(|r| r.has_region()).collect();
    for &times in noises {
        let marked = truth.project(ground, times);
        for (rung, found) in own.iter().zip(restricted(ground, truth, &own, &marked)) {
            let Some(found) = found else { continue };
            let row = row(part, rung, ground, seed, times * ground.sigma_px).erring(found.change);
            let row = row.with(TIMES_STATED, times).with(SHARE_SOLVED, found.cut.share);
            rows.push(row.with("muscles", truth.muscles as f64));
        }
    }
    rows
}

/// Times of a rung after a drag on some twins: whole, and only the region that moved, where a part can be left out.
pub(super) fn timed(
    ground: &Ground,
    truths: &[OnceLock<Result<Truth, String>>],
    rung: &Rung,
    with_whole_face: bool,
) -> Vec<Run> {
    let mut rows = Vec::new();
    let whole_face = ground.whole_face().filter(|_| with_whole_face);
    for (seed, slot) in (1..).zip(truths) {
        let truth = match slot.get_or_init(|| Truth::new(ground, seed)) {
            Ok(truth) => truth,
            Err(why) => return nothing(MEASURED, seed, why.clone()),
        };
        let project = rung.project(ground, &truth.project(ground, 1.0));
        rows.push(time(ground, rung, &project, row(MEASURED, rung, ground, seed, ground.sigma_px)));
        if rung.has_region() {
            // Of the whole face where most can be left out.
            let scopes = [(REGION, Some(ground), 1.0), (WHOLE_FACE, whole_face.as_ref(), 0.0)];
            rows.extend(
                scopes.into_iter().filter_map(|(part, on, times)| timed_region(on?, truth, rung, times, (part, seed))),
            );
        }
    }
    rows
}

/// Times of the whole and of the region on a twin, where a part can be left out.
fn timed_region(ground: &Ground, truth: &Truth, rung: &Rung, times: f64, (part, seed): (&str, u64)) -> Option<Run> {
    let marked = truth.project(ground, times);
    let cut = restricted(ground, truth, &[rung], &marked).pop()??.cut;
    if cut.is_whole() {
        return None;
    }
    let project = rung.project(ground, &marked);
    let row = || row(part, rung, ground, seed, times * ground.sigma_px);
    let whole_ms = time(ground, rung, &project, row()).time_ms?;
    Some(time(ground, rung, &cut.of(&project), row()).with(WHOLE_MS, whole_ms))
}

fn time(ground: &Ground, rung: &Rung, project: &Project, row: Run) -> Run {
    let mut workspace = Workspace::default();
    // What does not depend on the dragged mark is made before.
    std::hint::black_box(rung.solve(ground, project, &mut workspace));
    let mut times = drag_times(project, DRAGS, |dragged| {
        std::hint::black_box(rung.solve(ground, dragged, &mut workspace));
    });
    times.sort_unstable_by(f64::total_cmp);
    let quartile = |share: f64| times.get((share * times.len() as f64) as usize).copied();
    let Some([low, middle, high]) = quartile(0.25).zip(quartile(0.5)).zip(quartile(0.75)).map(|((a, b), c)| [a, b, c])
    else {
        return row.failing(Some("no mark can be dragged".to_owned()));
    };
    let spread = rounded(0.5 * (high - low)).unwrap_or(0.0);
    row.timed(middle).with(SPREAD_MS, spread)
}

/// The rows of a case, or why there are none.
pub(super) fn on(
    ground: &Shared,
    subject: &super::Subject,
    part: &str,
    seed: u64,
    rows: impl Fn(&Ground) -> Vec<Run>,
) -> Vec<Run> {
    match ground.get_or_init(|| Ground::new(subject)) {
        Ok(ground) => rows(ground),
        Err(why) => nothing(part, seed, why.clone()),
    }
}
