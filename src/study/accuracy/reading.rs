//! What the table of accuracy says, in plain words and from its rows alone.

use std::fmt::Write;

use super::super::points::{Point, mark_front, points};
use super::super::table::{Run, in_words};
use super::PARTS;

/// Methods named of each question, the best first.
const NAMED: usize = 4;

/// A short reading: of every question and noise the points that nobody beats, and the failures.
pub fn reading(runs: &[Run]) -> String {
    let mut text = String::from(
        "# Accuracy\n\nHow near does each method come to the truth, and how long does it take? An error is relative: the root of the sum of squares of what a \
         method misses, over that of the truth. Named are the points that no other beats in time and error both, and what failed.\n",
    );
    for (part, title) in PARTS {
        let all = points(runs, part);
        let mut noises: Vec<f64> = Vec::new();
        for p in &all {
            if !noises.contains(&p.noise_px) {
                noises.push(p.noise_px);
            }
        }
        if noises.is_empty() {
            continue;
        }
        let _ = writeln!(text, "\n## {title}\n");
        for noise in noises {
            let mut own: Vec<Point> = all.iter().filter(|p| p.noise_px == noise).cloned().collect();
            mark_front(&mut own);
            own.sort_by(|a, b| a.error.unwrap_or(f64::MAX).total_cmp(&b.error.unwrap_or(f64::MAX)));
            if all.iter().any(|p| p.noise_px > 0.0) {
                let _ = writeln!(text, "At {noise} px of marking noise:\n");
            }
            for p in own.iter().filter(|p| p.on_front).take(NAMED) {
                let _ = writeln!(text, "- {}: {}, {}", named(p), error(p), time(p));
            }
            let failed: Vec<&Point> = own.iter().filter(|p| p.failed > 0).collect();
            for p in failed.iter().take(NAMED) {
                let cause = p.cause.as_deref().unwrap_or("no cause given");
                let _ = writeln!(text, "- failed: {} ({} of {} runs: {cause})", named(p), p.failed, p.runs);
            }
            if failed.len() > NAMED {
                let _ = writeln!(text, "- and {} more with failures, in the table", failed.len() - NAMED);
            }
            text.push('\n');
        }
    }
    text
}

fn named(p: &Point) -> String {
    format!("{} ({})", p.method, in_words(&p.setting))
}

fn error(p: &Point) -> String {
    match p.error {
        Some(e) if e >= 1e-3 => format!("{:.1} %", 100.0 * e),
        Some(e) => format!("{e:.0e} of the truth"),
        None => "no answer".to_owned(),
    }
}

fn time(p: &Point) -> String {
    p.time_ms.map_or_else(|| "not timed".to_owned(), |t| format!("{t:.3} ms"))
}
