//! The study of scaling: how every stage of the chain grows from the size of the thesis's face to a million vertices, against the time to move the same
//! bytes through memory; and how many projects a batch solves over the cores.

mod batch;
mod reading;
pub mod stages;
pub mod timing;

use super::kind::Options;
use super::runner::{Case, Plan};
use super::table::{Run, rounded, setting};
use stages::{Sheet, Stage};

pub use reading::reading;

/// The study's name.
const STUDY: &str = "scaling";
/// Its parts.
pub const STAGES: &str = "stages";
/// See [`STAGES`].
pub const BATCH: &str = "batch";

/// Columns and rows of the sheets; the first is the size of the thesis's face.
pub const SIZES: [(usize, usize); 5] = [(18, 34), (40, 62), (80, 125), (250, 400), (800, 1250)];

/// The cases: every stage at every size on one thread, then batches of projects.
pub fn plan(options: &Options) -> Plan {
    let sizes = if options.quick { &SIZES[..3] } else { &SIZES[..] };
    let mut cases = Vec::new();
    // From small to large: memory that the program keeps for later use is then never more than this size needs.
    for &(columns, rows) in sizes {
        for stage in Stage::ALL {
            let name = format!("{} · {} vertices", stage.name(), columns * rows);
            // A run costs its fixed quarter of a second, and what it takes to lay out the sheet and repeat the work.
            let weight = 0.5 + (columns * rows) as f64 / 1e5;
            cases.push(Case::timed(name, move || vec![measured(stage, columns, rows)]).weighing(weight));
        }
    }
    cases.extend(batch::cases(options));
    Plan { study: STUDY.to_owned(), question: options.words(1), cases }
}

/// What stands above the chart of a part.
pub fn title(part: &str) -> &str {
    match part {
        STAGES => "Every stage from 612 to a million vertices",
        BATCH => "Projects solved over the cores",
        other => other,
    }
}

fn measured(stage: Stage, columns: usize, rows: usize) -> Run {
    let n = columns * rows;
    let row = Run::new(STUDY, STAGES, stage.name(), setting(&[("vertices", n as f64)]));
    let mut row = Run { vertices: n, seed: 1, ..row };
    if n > stage.largest() {
        let many = stage.largest();
        return row.failing(Some(format!("not run above {many} vertices: its matrix takes too much memory")));
    }
    let Ok(sheet) = Sheet::new(columns, rows) else { return row.failing(Some("no such sheet".to_owned())) };
    timing::forget_peak();
    let mut failed = None;
    let ran = sheet.run(stage, &mut |bytes, work| {
        let [least, median] = timing::repeated(work);
        let now = std::mem::take(&mut row).timed(median.as_secs_f64() * 1e3);
        let mut now = now.with("least_ms", rounded(least.as_secs_f64() * 1e3).unwrap_or(f64::NAN));
        if let Some(peak) = timing::peak_mb() {
            now = now.with("peak_mb", rounded(peak).unwrap_or(f64::NAN));
        }
        if bytes > 0 {
            let streamed = timing::streamed(bytes);
            now = now.with("bytes", bytes as f64);
            now = now.with("stream_ms", rounded(streamed.as_secs_f64() * 1e3).unwrap_or(f64::NAN));
        }
        row = now;
    });
    if let Err(e) = ran {
        failed = Some(e);
    }
    row.failing(failed)
}

#[cfg(test)]
mod tests {
    use super::super::journal::Journal;
    use super::*;

    /// Every stage runs at the size of the face and says a time and, where bytes are counted, what streaming them takes.
    #[test]
    fn every_stage_has_a_time_at_the_size_of_the_face() {
        let options = Options { quick: true, ..Options::on(crate::face::generic()) };
        let mut plan = plan(&options);
        plan.cases.retain(|c| c.key.ends_with("· 612 vertices"));
        assert_eq!(plan.cases.len(), Stage::ALL.len());
        let rows = plan.run(&mut Journal::in_memory(), 1, &|| false, &mut |_, _| {}).unwrap().unwrap();
        for row in &rows {
            assert!(row.is_ok() && row.time_ms.unwrap() > 0.0 && row.vertices == 612, "{row:?}");
            assert_eq!(row.measures.contains_key("bytes"), row.measures.contains_key("stream_ms"), "{row:?}");
        }
        // 24 bytes a spring and 48 a vertex: 18 · 33 + 17 · 34 + 17 · 33 springs.
        let field = rows.iter().find(|r| r.method == Stage::Field.name()).unwrap();
        assert_eq!(field.measures["bytes"], f64::from(24 * (18 * 33 + 17 * 34 + 17 * 33) + 48 * 612));
        let large = measured(Stage::Equilibrium, 800, 1250);
        assert!(large.cause.unwrap().starts_with("not run above 100000 vertices"));
    }
}
