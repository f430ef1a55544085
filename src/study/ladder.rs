//! The study of how much model a face needs: rungs from the simplest way up, measured on twins of one face, and the choice among them.
//!
//! Twins are this person under muscles drawn by chance, marked at the same vertices, their forces known. Of every rung is known how far 95 % of
//! twins stay within ([`bound`]) and how long it takes; from that alone [`choice`] picks, and fresh twins check it ([`check`]).

pub mod bound;
pub mod check;
pub mod choice;
mod ground;
mod measured;
mod reading;
mod region;
mod rungs;
pub mod standing;
mod subject;
mod twins;

use std::sync::Arc;

use super::kind::Options;
use super::runner::{Case, Plan};
use measured::{Asked, Shared};

pub use choice::{Choice, Goal, Goals, choose};
pub use reading::{choices, reading};
pub use standing::{Standing, standings};
pub use subject::Subject;

/// The study's name.
const STUDY: &str = "ladder";

/// The twins from which the choice is made.
pub const MEASURED: &str = "measured";
/// The twins on which it is checked.
const FRESH: &str = "fresh";
/// The region that moved.
const REGION: &str = "region";
/// The same where every vertex of the face is marked.
const WHOLE_FACE: &str = "region, whole face";
/// What stands above each chart.
const TITLES: [(&str, &str); 4] = [
    (MEASURED, "Error that 95 % of twins stay below, against the time after a drag"),
    (FRESH, "Fresh twins, on which the choice is checked"),
    (REGION, "Only the region that moved: change of the answer"),
    (WHOLE_FACE, "Only the region that moved, of a face marked as a whole: change of the answer"),
];

/// The marking error of a row over the one that the project states.
const TIMES_STATED: &str = "times_stated";
/// The noise of a row's time.
const SPREAD_MS: &str = "spread_ms";
/// The time of the whole beside that of a region.
const WHOLE_MS: &str = "whole_ms";
/// Share of the marks that were solved.
const SHARE_SOLVED: &str = "share_solved";

/// Marking errors over the stated one, at which the choice is made, and at which it is checked.
const NOISES: [f64; 5] = [0.0, 0.25, 0.5, 1.0, 2.0];
const CHECKED: [f64; 2] = [0.25, 1.0];
/// The same in the quick study.
const QUICK_NOISES: [f64; 3] = [0.0, 0.25, 1.0];
const QUICK_CHECKED: [f64; 1] = [1.0];
/// Twins that the choice is made from, whole and quick: with 124 the limit is the third largest error, with 59 the largest.
const TWINS: [u64; 2] = [124, bound::FEWEST as u64];
/// Fresh twins, whole and quick.
const FRESH_TWINS: [u64; 2] = [200, 30];
/// Seeds of fresh twins begin above: no other study has so many.
const FRESH_SEEDS: u64 = 10_000;
/// Twins on which the region that moved is tried, whole and quick: with the marks of the project, and with the whole face marked.
const REGION_TWINS: [[u64; 2]; 2] = [[59, 12], [6, 0]];
/// Twins on which rungs are timed.
const TIMED: usize = 3;

/// The cases: a twin each, then a rung each with its times.
pub fn plan(options: &Options) -> Plan {
    let [whole, quick] = TWINS;
    let twins = options.seeds(whole, quick);
    let [whole, quick] = FRESH_TWINS;
    let fresh = options.seeds(whole, quick);
    let subject = options.subject.clone().map_or_else(|| Subject::of_face(&options.face).map(Arc::new), Ok);
    let question = |of: &str| format!("{}, {of}", options.words(twins));
    let subject = match subject {
        Ok(subject) => subject,
        Err(why) => {
            let why = why.to_string();
            let case = Case::new("twin".to_owned(), move || measured::nothing(MEASURED, 1, why.clone()));
            return Plan { study: STUDY.to_owned(), question: question("no twin"), cases: vec![case] };
        }
    };
    let ground = Shared::default();
    let noises = |whole: &[f64], quick: &[f64]| if options.quick { quick.to_vec() } else { whole.to_vec() };
    let finer = !options.quick;
    let regions = REGION_TWINS[usize::from(options.quick)];
    let parts = [
        (Asked { part: MEASURED, noises: noises(&NOISES, &QUICK_NOISES), finer, regions }, 0, twins),
        (Asked { part: FRESH, noises: noises(&CHECKED, &QUICK_CHECKED), finer, regions: [0; 2] }, FRESH_SEEDS, fresh),
    ];
    let mut cases = Vec::new();
    for (asked, after, count) in parts {
        for seed in after + 1..=after + count {
            let (ground, subject, asked) = (Arc::clone(&ground), Arc::clone(&subject), asked.clone());
            let (key, weight) = (format!("{} · twin {seed}", asked.part), 1.0 + asked.noises.len() as f64);
            let work = move || measured::on(&ground, &subject, asked.part, seed, |g| measured::twin(g, &asked, seed));
            cases.push(Case::new(key, work).weighing(weight));
        }
    }
    let truths: Arc<[_; TIMED]> = Arc::default();
    for (place, rung) in rungs::rungs(finer).into_iter().enumerate() {
        let (ground, subject, truths) = (Arc::clone(&ground), Arc::clone(&subject), Arc::clone(&truths));
        let key = format!("time · {} · {}", rung.method, rung.setting);
        let work = move || {
            let of = |g: &ground::Ground| measured::timed(g, &*truths, &rung, finer);
            measured::on(&ground, &subject, MEASURED, place as u64 + 1, of)
        };
        cases.push(Case::timed(key, work).weighing(2.0));
    }
    Plan { study: STUDY.to_owned(), question: question(&format!("marks {}", subject.digest())), cases }
}

/// What stands above the chart of a part.
pub fn title(part: &str) -> &str {
    TITLES.iter().find(|t| t.0 == part).map_or(part, |t| t.1)
}

#[cfg(test)]
mod tests;
