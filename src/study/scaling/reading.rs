//! What the table of the study of scaling says, in plain words.

use std::fmt::Write;

use super::super::table::{Run, pairs};
use super::{BATCH, STAGES};
use crate::draw::numbers::significant;

/// The reading of the table, in Markdown, from its rows alone.
pub fn reading(runs: &[Run]) -> String {
    let mut text = String::from(
        "# How the work grows\n\nMedian time of one run on one thread. *Over streaming* is that time over the time to read and write the bytes that the \
         stage must move at least; memory is the most that the whole program held meanwhile, the sheet included.\n\n\
         | stage | vertices | time, ms | ns a vertex | over streaming | peak memory, MB |\n|---|---|---|---|---|---|\n",
    );
    for run in by_stage(runs) {
        let (Some(ms), None) = (run.time_ms, &run.cause) else {
            let why = run.cause.as_deref().unwrap_or("no time");
            let _ = writeln!(text, "| {} | {} | {why} | | | |", run.method, run.vertices);
            continue;
        };
        let number = |v: Option<f64>| v.map_or_else(String::new, |v| significant(v, 3));
        let over = run.measures.get("stream_ms").map(|s| ms / s.max(1e-9));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            run.method,
            run.vertices,
            significant(ms, 3),
            significant(1e6 * ms / run.vertices.max(1) as f64, 3),
            number(over),
            number(run.measures.get("peak_mb").copied())
        );
    }
    let batches: Vec<(f64, f64, f64)> = runs.iter().filter(|r| r.part == BATCH).filter_map(batch).collect();
    if let Some(&(_, _, one)) = batches.first() {
        text.push_str("\n## Projects over the cores\n\n");
        for (threads, projects, ms) in &batches {
            let each = ms / projects.max(1.0);
            let _ = writeln!(
                text,
                "- {projects} projects over {threads} {}: {} ms a project, {} times as fast as over one.",
                if *threads == 1.0 { "core" } else { "cores" },
                significant(each, 3),
                significant(one / ms, 3)
            );
        }
    }
    text
}

/// The rows of the stages, stage by stage.
fn by_stage(runs: &[Run]) -> Vec<&Run> {
    let own = || runs.iter().filter(|r| r.part == STAGES);
    let first = |of: &Run| own().position(|r| r.method == of.method);
    let mut rows: Vec<&Run> = own().collect();
    rows.sort_by_key(|r| first(r));
    rows
}

/// Threads, projects and time of a batch.
fn batch(run: &Run) -> Option<(f64, f64, f64)> {
    let value = |name: &str| pairs(&run.setting).iter().find(|p| p.0 == name)?.1.parse().ok();
    Some((value("threads")?, value("projects")?, run.time_ms?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::table::setting;

    /// By hand: 2 ms of 1000 vertices are 2000 ns a vertex, and four times 0.5 ms of streaming; 300 ms over one core and 150 over two is twice as fast.
    #[test]
    fn the_numbers_of_the_reading_by_hand() {
        let stage = Run { vertices: 1000, ..Run::new("scaling", STAGES, "field", String::new()) };
        let batch = |threads: f64, ms: f64| {
            Run::new("scaling", BATCH, "solve", setting(&[("threads", threads), ("projects", 100.0)])).timed(ms)
        };
        let too_large = stage.clone().failing(Some("not run".into()));
        let runs = [stage.timed(2.0).with("stream_ms", 0.5), too_large, batch(1.0, 300.0), batch(2.0, 150.0)];
        let text = reading(&runs);
        assert!(text.contains("| field | 1000 | 2.00 | 2000 | 4.00 |  |"), "{text}");
        assert!(text.contains("| field | 1000 | not run | | | |"));
        assert!(text.contains("- 100 projects over 2 cores: 1.50 ms a project, 2.00 times as fast as over one."));
    }
}
