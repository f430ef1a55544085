//! What the table of the ladder says: the choice, how every rung stands, the check on fresh twins, and what a region saves.

use std::fmt::Write;

use super::bound::Bound;
use super::check::{Checked, checks};
use super::choice::{Goal, Goals, choose, ms_words, percent};
use super::region::TOLERANCE;
use super::standing::{Standing, standings};
use crate::draw::numbers::significant;
use crate::study::Run;

/// A sentence or two for every stated goal.
pub fn choices(runs: &[Run], goals: Goals) -> Vec<String> {
    let rungs = standings(runs);
    goals.all().map(|goal| choose(goal, &rungs, 1.0).words(goal, &rungs)).collect()
}

/// The reading, in Markdown.
pub fn reading(runs: &[Run], goals: Goals) -> String {
    let mut text = String::from(
        "# Ladder\n\nHow much model does this face need? Twins are this person, marked at the same points, under muscles drawn by chance; their forces are those of a membrane on \
         a finer mesh. An error is the root of the sum of squares of what a rung misses, over that of the truth. The limit of a rung is the error that 95 % of all such twins stay below, with a confidence \
         of 95 %.\n\n## The choice\n\n",
    );
    let rungs = standings(runs);
    for words in choices(runs, goals) {
        let _ = writeln!(text, "- {words}");
    }
    if let Some(cause) = runs.iter().find_map(|r| r.cause.as_ref()).filter(|_| rungs.is_empty()) {
        let _ = writeln!(text, "- Nothing was measured: {cause}.");
    }
    if rungs.is_empty() {
        return text;
    }
    table(&mut text, &rungs);
    check_table(&mut text, &rungs);
    region_table(&mut text, &rungs);
    text
}

fn table(text: &mut String, rungs: &[Standing]) {
    let noises: Vec<(f64, f64, Bound)> = rungs
        .iter()
        .max_by_key(|r| r.noises.len())
        .map_or_else(Vec::new, |r| r.noises.iter().map(|n| (n.times_stated, n.noise_px, n.bound)).collect());
    let twins = noises.first().map_or(0, |n| n.2.twins);
    let _ = write!(
        text,
        "\n## The rungs, the simplest first\n\nLimit / median of {twins} twins, by the marking error.\n\n| rung | vertices |"
    );
    for (_, px, _) in &noises {
        let _ = write!(text, " {} px |", significant(*px, 3));
    }
    let _ = writeln!(text, " a drag |\n|---|---|{}---|", "---|".repeat(noises.len()));
    for rung in rungs {
        let _ = write!(text, "| {} | {} |", rung.name(), rung.vertices);
        for (times, ..) in &noises {
            let cell = rung.at(*times).map(|n| format!("{} / {}", percent(n.bound.value), percent(n.median)));
            let _ = write!(text, " {} |", cell.unwrap_or_default());
        }
        let _ = writeln!(text, " {} |", rung.time_ms.map_or_else(|| "not timed".to_owned(), ms_words));
    }
}

fn check_table(text: &mut String, rungs: &[Standing]) {
    let all = checks(rungs);
    let Some(first) = all.first() else { return };
    let _ = writeln!(
        text,
        "\n## The choice on {} fresh twins\n\nChosen from the measured twins alone; held against the cheapest rung that keeps the accuracy on 95 % of the fresh ones.\n\n\
         | marking error | stated | chosen | kept on | cheapest that would have | cost over it |\n|---|---|---|---|---|---|",
        first.twins
    );
    for c in &all {
        let _ = writeln!(text, "{}", check_row(c, rungs));
    }
    let promised: Vec<f64> = all.iter().filter_map(|c| c.met).collect();
    let kept = promised.iter().filter(|m| **m >= super::bound::SHARE).count();
    let costs: Vec<f64> = all.iter().filter_map(|c| c.cost).collect();
    let cheap = costs.iter().filter(|c| **c <= 2.0).count();
    let _ = writeln!(
        text,
        "\nOf {} choices {kept} kept on 95 % of the fresh twins what they promised (least {}); {cheap} of {} cost at most twice the cheapest (most {} times).",
        promised.len(),
        percent(promised.iter().copied().fold(1.0, f64::min)),
        costs.len(),
        significant(costs.iter().copied().fold(0.0, f64::max), 2)
    );
}

fn check_row(c: &Checked, rungs: &[Standing]) -> String {
    let px = rungs.iter().find_map(|r| Some(r.at(c.times_stated)?.noise_px)).unwrap_or(0.0);
    let name = |k: Option<usize>| k.map_or_else(|| "none".to_owned(), |k| rungs[k].name());
    let (stated, cheapest) = match c.goal {
        Goal::Accuracy(share) => (percent(share), name(c.cheapest)),
        Goal::Time(ms) => (ms_words(ms), "–".to_owned()),
    };
    format!(
        "| {} px | {stated} | {} | {} | {cheapest} | {} |",
        significant(px, 3),
        name(c.picked),
        c.met.map_or_else(|| "–".to_owned(), percent),
        c.cost.map_or_else(|| "–".to_owned(), |c| significant(c, 3))
    )
}

fn region_table(text: &mut String, rungs: &[Standing]) {
    let told: Vec<_> = rungs.iter().flat_map(|r| r.regions.iter().map(move |region| (r, region))).collect();
    if told.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "\n## Only the region that moved\n\nMarks that moved and two rings of neighbours around them, the outer one held where it was seen. The region is the smallest with which the answer changes by less than half of {0}; what must \
         stay below {0} is the change after nine marks were dragged.\n\n| rung | marked | marking error | twins that can be cut | largest change | marks solved | a drag, whole | a drag, region |\n|---|---|---|---|---|---|---|---|",
        percent(TOLERANCE)
    );
    for (rung, r) in told {
        let marked = if r.whole_face { "whole face" } else { "as the project" };
        let _ = write!(
            text,
            "| {} | {marked} | {} px | {} of {} |",
            rung.name(),
            significant(r.noise_px, 3),
            r.cut,
            r.twins
        );
        let Some(share) = r.share else {
            let _ = writeln!(text, " – | 100 % | – | brings nothing |");
            continue;
        };
        let times = r.times_ms.map_or_else(|| ["not timed".to_owned(), "not timed".to_owned()], |t| t.map(ms_words));
        let _ = writeln!(text, " {} | {} | {} |", percent(r.largest_change), percent(share), times.join(" | "));
    }
    let broken: Vec<String> = rungs
        .iter()
        .filter(|r| r.regions.iter().any(|region| region.largest_change >= TOLERANCE))
        .map(Standing::name)
        .collect();
    let kept = percent(TOLERANCE);
    let _ = if broken.is_empty() {
        writeln!(text, "\nThe change stays below {kept} on every twin.")
    } else {
        let broken = broken.join("; ");
        writeln!(
            text,
            "\nThe change stays below {kept} on every twin but with: {broken}. Of these everything has to be solved."
        )
    };
}
