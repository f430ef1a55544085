//! The automatic choice: the cheapest rung that keeps a stated accuracy, or the most accurate within a stated time, and what to say of it.

use std::fmt::Write;

use super::standing::Standing;
use crate::draw::numbers::significant;

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Forces within this share of the truth, on 95 % of twins.
    Accuracy(f64),
    /// An answer after so many ms.
    Time(f64),
}

/// What a person states: either, or both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goals {
    /// Share of the truth that forces may miss.
    pub accuracy: Option<f64>,
    /// Time that an answer may take after a drag, ms.
    pub time_ms: Option<f64>,
}

impl Default for Goals {
    /// 10 % and one frame of a screen.
    fn default() -> Self {
        Self { accuracy: Some(0.1), time_ms: Some(16.0) }
    }
}

impl Goals {
    /// Those that are stated.
    pub fn all(self) -> impl Iterator<Item = Goal> {
        self.accuracy.map(Goal::Accuracy).into_iter().chain(self.time_ms.map(Goal::Time))
    }
}

/// The choice for a goal, as indices of the rungs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The rung that meets the goal; none where none does.
    pub picked: Option<usize>,
    /// The most accurate rung of all.
    pub best: Option<usize>,
    /// The next rung up from the picked one: the cheapest that is surely more accurate.
    pub next: Option<usize>,
}

/// A bound must be this much lower to count as more accurate: less is chance.
const LOWER: f64 = 0.95;
/// Times that differ by less than this share, or by the noise of timing, are the same.
const SAME_TIME: f64 = 0.1;

/// Picks for a goal at a marking error, given as a multiple of the stated one. Rungs without a time are left out.
pub fn choose(goal: Goal, rungs: &[Standing], times_stated: f64) -> Choice {
    let limit = |k: usize| rungs[k].limit(times_stated);
    let time = |k: usize| rungs[k].time_ms.unwrap_or(f64::INFINITY);
    let usable: Vec<usize> = (0..rungs.len()).filter(|&k| time(k).is_finite() && limit(k).is_finite()).collect();
    let best = usable.iter().copied().min_by(|a, b| limit(*a).total_cmp(&limit(*b)));
    let picked = match goal {
        Goal::Accuracy(share) => cheapest(rungs, usable.iter().copied().filter(|&k| limit(k) <= share)),
        Goal::Time(ms) => {
            let within: Vec<usize> = usable.iter().copied().filter(|&k| time(k) <= ms).collect();
            let least = within.iter().map(|&k| limit(k)).fold(f64::INFINITY, f64::min);
            // Of those whose limits cannot be told apart, the one that errs least in the middle.
            let middle = |k: usize| rungs[k].at(times_stated).map_or(f64::INFINITY, |n| n.median);
            let even: Vec<usize> = within.into_iter().filter(|&k| LOWER * limit(k) <= least).collect();
            let lowest = even.iter().map(|&k| middle(k)).fold(f64::INFINITY, f64::min);
            cheapest(rungs, even.into_iter().filter(|&k| LOWER * middle(k) <= lowest))
        }
    };
    let next = picked.and_then(|p| {
        let better = usable.iter().copied().filter(|&k| limit(k) < LOWER * limit(p) && time(k) > time(p));
        cheapest(rungs, better)
    });
    Choice { picked, best, next }
}

/// The cheapest; of those that take as long within the noise of timing, the simplest.
fn cheapest(rungs: &[Standing], mut among: impl Iterator<Item = usize> + Clone) -> Option<usize> {
    let time = |k: usize| rungs[k].time_ms.unwrap_or(f64::INFINITY);
    let fastest = among.clone().min_by(|a, b| time(*a).total_cmp(&time(*b)))?;
    let room = (SAME_TIME * time(fastest)).max(rungs[fastest].spread_ms);
    among.find(|&k| time(k) <= time(fastest) + room)
}

impl Choice {
    /// The choice in words, with numbers, for a marking error as stated.
    pub fn words(&self, goal: Goal, rungs: &[Standing]) -> String {
        let wanted = match goal {
            Goal::Accuracy(share) => format!("For {}", percent(share)),
            Goal::Time(ms) => format!("Within {}", ms_words(ms)),
        };
        let Some(first) = rungs.iter().flat_map(|r| &r.noises).find(|n| n.times_stated == 1.0) else {
            return "Nothing was measured at the stated marking error.".to_owned();
        };
        let sure = if first.bound.is_sure() {
            String::new()
        } else {
            format!(
                " Only {} twins were measured: the limit is their largest error, with a confidence of {} instead of 95 %.",
                first.bound.twins,
                percent(first.bound.confidence)
            )
        };
        let Some(picked) = self.picked else {
            return format!("{wanted}: {}{sure}", self.none_meets(goal, rungs, first.noise_px));
        };
        let of = |k: usize| (rungs[k].limit(1.0), rungs[k].time_ms.unwrap_or(f64::INFINITY));
        let (limit, ms) = of(picked);
        let mut text = format!(
            "{wanted}: {}. 95 % of twins err by less than {} at {} px; {} after a drag.",
            rungs[picked].name(),
            percent(limit),
            significant(first.noise_px, 2),
            ms_words(ms)
        );
        if limit >= 1.0 {
            text += " (No force at all would err by 100 %.)";
        }
        match self.next {
            Some(next) => {
                let (lower, longer) = of(next);
                let _ = write!(
                    text,
                    " The next rung up, {}, would err by less than {} ({} points less) for {} more.",
                    rungs[next].name(),
                    percent(lower),
                    significant(100.0 * (limit - lower), 2),
                    ms_words(longer - ms)
                );
            }
            None => text += " No dearer rung errs by less.",
        }
        text + &sure
    }

    fn none_meets(&self, goal: Goal, rungs: &[Standing], noise_px: f64) -> String {
        let Some(best) = self.best else { return "no rung has an answer on 95 % of twins.".to_owned() };
        let (rung, limit) = (&rungs[best], rungs[best].limit(1.0));
        let share = match goal {
            Goal::Time(_) => {
                let fastest = rungs.iter().filter_map(|r| r.time_ms).fold(f64::INFINITY, f64::min);
                return format!("no rung is so fast; the fastest takes {}.", ms_words(fastest));
            }
            Goal::Accuracy(share) => share,
        };
        let mut text = format!(
            "no rung meets it at {} px. The best is {}: 95 % of twins err by less than {}.",
            significant(noise_px, 2),
            rung.name(),
            percent(limit)
        );
        if let Some(exact) = rung.at(0.0) {
            let _ = write!(
                text,
                " Of that, {} remain without any marking error: that part is due to the model, not to the marks.",
                percent(exact.bound.value)
            );
        }
        let mut met = rung.noises.iter().filter(|n| n.times_stated < 1.0).rev().filter_map(|n| {
            let there = choose(Goal::Accuracy(share), rungs, n.times_stated).picked?;
            Some((n, there))
        });
        match met.next() {
            Some((n, there)) if n.times_stated > 0.0 => {
                let _ = write!(
                    text,
                    " It would be met at {} px, {} of your marking error, by {}.",
                    significant(n.noise_px, 2),
                    part(n.times_stated),
                    rungs[there].name()
                );
            }
            Some((_, there)) => {
                let _ = write!(text, " Only marks without error would meet it, by {}.", rungs[there].name());
            }
            None => {
                let least = rung.noises.first().map_or(noise_px, |n| n.noise_px);
                let _ = match least {
                    0.0 => write!(text, " Marks without error would not meet it either."),
                    px => write!(text, " Marks that err by {} px would not meet it either.", significant(px, 2)),
                };
            }
        }
        text
    }
}

/// "25 %".
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() {
        format!("{} %", significant(100.0 * share, if share >= 1.0 { 3 } else { 2 }))
    } else {
        "no limit".to_owned()
    }
}

/// "0.25 ms".
pub(super) fn ms_words(ms: f64) -> String {
    format!("{} ms", significant(ms, 2))
}

fn part(times: f64) -> String {
    match times {
        0.5 => "half".to_owned(),
        0.25 => "a quarter".to_owned(),
        _ => percent(times),
    }
}
