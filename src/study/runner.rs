//! Runs a study: a list of cases, over all cores where no time is measured and one after the other where it is, to be stopped at any
//! moment and taken up again.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::journal::{Heading, Journal, JournalError};
use super::machine;
use super::table::Run;

/// One case: some runs that are worked out together.
pub struct Case {
    /// Its name, the same in every run of the study and of no other case.
    pub key: String,
    /// Whether its times count: then it runs alone, on one thread.
    pub timed: bool,
    /// About how long it takes, in any unit that is the same for all cases of the study.
    pub weight: f64,
    work: Box<dyn Fn() -> Vec<Run> + Send + Sync>,
}

impl Case {
    /// A case whose times do not count.
    pub fn new(key: String, work: impl Fn() -> Vec<Run> + Send + Sync + 'static) -> Self {
        Self { key, timed: false, weight: 1.0, work: Box::new(work) }
    }

    /// A case whose times count.
    pub fn timed(key: String, work: impl Fn() -> Vec<Run> + Send + Sync + 'static) -> Self {
        Self { timed: true, ..Self::new(key, work) }
    }

    /// With a weight, for the time that is left.
    #[must_use]
    pub fn weighing(self, weight: f64) -> Self {
        Self { weight, ..self }
    }
}

/// A study as a list of cases.
pub struct Plan {
    /// The study.
    pub study: String,
    /// What decides its rows, in words.
    pub question: String,
    /// The cases, in the order of the table.
    pub cases: Vec<Case>,
}

/// How far a study is: said after every case.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Cases finished.
    pub finished: usize,
    /// Cases in all.
    pub of: usize,
    /// Share of the work that is done.
    pub share: f64,
    /// Time that is left, by the pace so far; none at the start.
    pub left: Option<Duration>,
}

impl Progress {
    /// ", about 3 min left", or nothing where that is not known.
    pub fn left_in_words(&self) -> String {
        match self.left.map(|l| l.as_secs()) {
            None => String::new(),
            Some(s) if s < 90 => format!(", about {s} s left"),
            Some(s) if s < 5400 => format!(", about {} min left", (s + 30) / 60),
            Some(s) => format!(", about {} h left", (s + 1800) / 3600),
        }
    }
}

impl Plan {
    /// What its journal is headed with.
    pub fn heading(&self) -> Heading {
        Heading { study: self.study.clone(), question: self.question.clone(), machine: machine::words() }
    }

    /// Keeps the cases of these parts alone: the words before the first dot of their names.
    ///
    /// # Errors
    /// One line: the part that there is none of, and those that there are.
    pub fn only(&mut self, parts: &[String]) -> Result<(), String> {
        if parts.is_empty() {
            return Ok(());
        }
        let of = |case: &Case| case.key.split(" · ").next().unwrap_or_default().to_owned();
        for part in parts {
            if !self.cases.iter().any(|case| of(case) == *part) {
                let mut all: Vec<String> = self.cases.iter().map(of).collect();
                all.dedup();
                return Err(format!("this study has no part '{part}'; its parts are: {}", all.join(" | ")));
            }
        }
        self.cases.retain(|case| parts.contains(&of(case)));
        self.question = format!("{}, {}", self.question, parts.join(", "));
        Ok(())
    }

    /// The rows of the cases that are finished, in the order of the plan.
    pub fn rows(&self, journal: &Journal) -> Vec<Run> {
        self.cases.iter().filter_map(|c| journal.finished(&c.key)).flatten().cloned().collect()
    }

    /// Runs what the journal does not hold yet. The whole table, or none where it was stopped: then the journal holds what was finished.
    ///
    /// Cases without times run first, over `threads` threads (0: all cores); then those with times, alone and on one thread.
    ///
    /// # Errors
    /// A journal that cannot be written any more.
    pub fn run(
        &self,
        journal: &mut Journal,
        threads: usize,
        stopped: &(dyn Fn() -> bool + Sync),
        watch: &mut (dyn FnMut(&Progress, &[Run]) + Send),
    ) -> Result<Option<Vec<Run>>, JournalError> {
        let mut all: Vec<&Case> = self.cases.iter().filter(|c| journal.finished(&c.key).is_none()).collect();
        all.sort_by_key(|c| c.timed);
        let timed = all.iter().position(|c| c.timed).unwrap_or(all.len());
        let total: f64 = self.cases.iter().map(|c| c.weight).sum();
        let to_do: f64 = all.iter().map(|c| c.weight).sum();
        let count = self.cases.len();
        let first =
            Progress { finished: count - all.len(), of: count, share: 1.0 - to_do / total.max(1e-300), left: None };
        watch(&first, &self.rows(journal));
        let state = Mutex::new(State { journal, watch, progress: first, done: 0.0, error: None });
        let (begun, halt) = (Instant::now(), AtomicBool::new(false));
        let one = |case: &&Case| {
            if halt.load(Ordering::Relaxed) || stopped() {
                return;
            }
            let runs = (case.work)();
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            state.done += case.weight;
            state.progress.finished += 1;
            state.progress.share += case.weight / total.max(1e-300);
            let left = begun.elapsed().as_secs_f64() * (to_do - state.done).max(0.0) / state.done.max(1e-300);
            state.progress.left = Duration::try_from_secs_f64(left).ok();
            let State { journal, watch, progress, error, .. } = &mut *state;
            watch(progress, &runs);
            if let Err(failed) = journal.note(&case.key, runs) {
                *error = Some(failed);
                halt.store(true, Ordering::Relaxed);
            }
        };
        let (free, alone) = all.split_at(timed);
        match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            // One case at a time of each thread: they differ in length.
            Ok(pool) => pool.install(|| free.par_iter().with_max_len(1).for_each(one)),
            Err(_) => free.iter().for_each(one),
        }
        match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
            Ok(pool) => pool.install(|| alone.iter().for_each(one)),
            Err(_) => alone.iter().for_each(one),
        }
        let State { journal, progress, error, .. } = state.into_inner().unwrap_or_else(PoisonError::into_inner);
        match error {
            Some(error) => Err(error),
            None => Ok((progress.finished == progress.of).then(|| self.rows(journal))),
        }
    }
}

struct State<'a> {
    journal: &'a mut Journal,
    watch: &'a mut (dyn FnMut(&Progress, &[Run]) + Send),
    progress: Progress,
    done: f64,
    error: Option<JournalError>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    fn plan() -> Plan {
        let run = |k: u64, time: f64| {
            let run = Run { seed: k, ..Run::new("test", "p", "square", format!("x={k}")) };
            vec![run.erring((k * k) as f64).timed(time)]
        };
        let clock = Instant::now();
        let case = move |k: u64| {
            let work = move || run(k, clock.elapsed().as_secs_f64() * 1e3);
            if k.is_multiple_of(3) {
                Case::timed(format!("case {k}"), work)
            } else {
                Case::new(format!("case {k}"), work)
            }
        };
        Plan { study: "test".into(), question: "20 squares".into(), cases: (0..20).map(case).collect() }
    }

    fn without_times(rows: Vec<Run>) -> Vec<Run> {
        rows.into_iter().map(Run::without_times).collect()
    }

    #[test]
    fn some_parts_alone_are_another_question_and_an_unknown_one_names_those_that_there_are() {
        let of = |part: &str, k: u64| Case::new(format!("{part} · case {k}"), Vec::new);
        let cases = [("a", 1), ("a", 2), ("a, b", 1), ("c", 1)].map(|(part, k)| of(part, k));
        let mut plan = Plan { study: "test".into(), question: "whole".into(), cases: cases.into() };
        let whole = plan.heading();
        assert_eq!(plan.only(&["b".into()]).unwrap_err(), "this study has no part 'b'; its parts are: a | a, b | c");
        plan.only(&[]).unwrap();
        assert_eq!((plan.cases.len(), plan.heading()), (4, whole.clone()));
        plan.only(&["a".into(), "c".into()]).unwrap();
        assert_eq!(
            plan.cases.iter().map(|c| c.key.as_str()).collect::<Vec<_>>(),
            ["a · case 1", "a · case 2", "c · case 1"]
        );
        assert_ne!(plan.heading(), whole);
    }

    #[test]
    fn a_study_that_was_stopped_and_taken_up_again_has_the_same_table() {
        let whole = plan().run(&mut Journal::in_memory(), 1, &|| false, &mut |_, _| {}).unwrap().unwrap();
        // In the order of the plan, not in that of the runs: the row of case k is k².
        assert!(whole.iter().enumerate().all(|(k, r)| r.force_error == Some((k * k) as f64)));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("test.journal");
        for (threads, after) in [(1, 0), (1, 7), (2, 17), (2, 1)] {
            let plan = plan();
            let mut journal = Journal::open(&path, &plan.heading()).unwrap();
            let done = AtomicUsize::new(0);
            let stop = || done.load(Ordering::Relaxed) >= after;
            let mut count = |p: &Progress, _: &[Run]| done.store(p.finished, Ordering::Relaxed);
            assert_eq!(plan.run(&mut journal, threads, &stop, &mut count).unwrap(), None);
            let kept = plan.rows(&journal);
            // One more can be under way on each of the other threads.
            assert!((after..after + threads).contains(&kept.len()), "{} of {after}", kept.len());
            drop(journal);
            let mut journal = Journal::open(&path, &plan.heading()).unwrap();
            assert_eq!(plan.rows(&journal), kept);
            let mut seen = Vec::new();
            let mut watch = |p: &Progress, rows: &[Run]| seen.push((p.finished, rows.len(), p.share));
            let resumed = plan.run(&mut journal, threads, &|| false, &mut watch).unwrap().unwrap();
            assert_eq!(without_times(resumed), without_times(whole.clone()));
            assert_eq!(seen[0].1, kept.len());
            assert_eq!(seen.len(), 21 - kept.len());
            assert!(seen.windows(2).all(|w| w[1].0 == w[0].0 + 1) && (seen.last().unwrap().2 - 1.0).abs() < 1e-9);
            journal.remove();
        }
    }

    #[test]
    fn the_time_left_is_said_in_a_unit_that_fits() {
        let left = |s| Progress { finished: 0, of: 1, share: 0.0, left: s };
        let words = |s| left(Some(Duration::from_secs(s))).left_in_words();
        assert_eq!([words(5), words(150), words(7000)], [", about 5 s left", ", about 3 min left", ", about 2 h left"]);
        assert_eq!(left(None).left_in_words(), "");
    }

    #[test]
    fn cases_whose_times_count_run_alone() {
        let under_way = std::sync::Arc::new(AtomicUsize::new(0));
        let case = |k: usize| {
            let under_way = std::sync::Arc::clone(&under_way);
            let work = move || {
                let before = under_way.fetch_add(1, Ordering::SeqCst);
                let inner: usize = (0..64).into_par_iter().map(|_| rayon::current_num_threads()).max().unwrap();
                under_way.fetch_sub(1, Ordering::SeqCst);
                vec![Run { vertices: inner, seed: before as u64, ..Run::default() }]
            };
            if k.is_multiple_of(2) { Case::timed(k.to_string(), work) } else { Case::new(k.to_string(), work) }
        };
        let plan = Plan { study: "test".into(), question: String::new(), cases: (0..40).map(case).collect() };
        let rows = plan.run(&mut Journal::in_memory(), 2, &|| false, &mut |_, _| {}).unwrap().unwrap();
        assert!(rows.iter().step_by(2).all(|r| r.vertices == 1 && r.seed == 0), "{rows:?}");
        assert!(rows.iter().skip(1).step_by(2).all(|r| r.vertices == 2));
    }
}
