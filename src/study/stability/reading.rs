//! What the table of the study of stability says, in plain words.

use std::fmt::Write;

use super::super::cells::{Map, maps};
use super::super::table::Run;
use super::PARTS;

/// The reading of the table, in Markdown, from its rows alone.
pub fn reading(runs: &[Run]) -> String {
    let mut text = String::from(
        "# Where each method fails\n\nA cell is a method at one setting; it ends well where all its seeds do. The cause is that of the first seed \
         that failed. The runs of the forward model last 0.1 s or 40 to 100 steps, so a divergence slower than that is not seen. \
         Of the expressions the seeds are surprise, happy, sad, anger, disgust and fear, with all muscles at once.\n",
    );
    for (part, title) in PARTS {
        let maps = maps(runs, part);
        if maps.is_empty() {
            continue;
        }
        let _ = writeln!(text, "\n## {title}\n");
        for map in &maps {
            for row in rows_of(map) {
                let _ = writeln!(text, "- {row}");
            }
        }
    }
    text
}

/// A sentence for the map of a method, or one for every method of a map.
fn rows_of(map: &Map) -> Vec<String> {
    if map.up != "method" {
        let cells: Vec<_> = map.cells.iter().flatten().collect();
        let well = cells.iter().filter(|c| c.well == c.runs).count();
        let agree = agreement(map).map_or_else(String::new, |words| format!(" {words}"));
        return vec![format!(
            "**{}**: {well} of {} cells end well.{}{agree}",
            map.method,
            cells.len(),
            first_causes(&cells)
        )];
    }
    let sentence = |r: usize| {
        let cells: Vec<_> = (0..map.columns.len()).filter_map(|c| map.cell(c, r)).collect();
        let bad = (0..map.columns.len()).filter(|&c| map.cell(c, r).is_some_and(|x| x.well < x.runs));
        let bad: Vec<String> = bad.map(|c| map.columns[c].to_string()).collect();
        if bad.is_empty() {
            format!("**{}** ends well everywhere.", map.rows[r])
        } else {
            format!("**{}** fails at {} = {}.{}", map.rows[r], map.along, bad.join(", "), first_causes(&cells))
        }
    };
    (0..map.rows.len()).rev().map(sentence).collect()
}

/// How often each cause comes first.
fn first_causes(cells: &[&super::super::cells::Cell]) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for cause in cells.iter().filter_map(|c| c.cause.as_deref()) {
        match counts.iter_mut().find(|c| c.0 == cause) {
            Some(count) => count.1 += 1,
            None => counts.push((cause, 1)),
        }
    }
    counts.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    let words: Vec<String> = counts.iter().map(|(cause, n)| format!("{cause} ({n})")).collect();
    if words.is_empty() { String::new() } else { format!(" First cause: {}.", words.join(", ")) }
}

/// Whether theory and runs agree, where a limit is drawn.
fn agreement(map: &Map) -> Option<String> {
    let (mut below, mut above) = (0, 0);
    for (at, cell) in map.cells.iter().enumerate().filter_map(|(at, c)| Some((at, c.as_ref()?))) {
        let x = map.columns[at % map.columns.len()];
        let limit = cell.limit?;
        below += usize::from(x < limit && cell.well < cell.runs);
        above += usize::from(x > limit && cell.well == cell.runs);
    }
    Some(format!("{below} fail below the limit for small motions, {above} survive above it."))
}
