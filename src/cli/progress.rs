//! What a long command is doing, on a terminal and nowhere else.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Names the stage at work and remembers how long each took.
pub(super) struct Progress {
    bar: ProgressBar,
    stages: Vec<(&'static str, Instant)>,
}

impl Progress {
    /// Begins; on anything but a terminal nothing is ever shown.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar, stages: Vec::new() }
    }

    /// The stage before ends here, and this one begins.
    pub(super) fn stage(&mut self, name: &'static str) {
        self.bar.set_message(name);
        self.stages.push((name, Instant::now()));
    }

    /// The stages so far and their times, ms; the present one up to now.
    pub(super) fn timings_ms(&self) -> Vec<(&'static str, f64)> {
        let ends = self.stages.iter().skip(1).map(|(_, at)| *at).chain([Instant::now()]);
        self.stages.iter().zip(ends).map(|((name, from), to)| (*name, (to - *from).as_secs_f64() * 1e3)).collect()
    }
}

/// How far a work of known size is, on a terminal and nowhere else.
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// Begins at nothing.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new(1000);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent} %  {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Self(bar)
    }

    /// Says what share is done, and a word about it.
    pub(super) fn set(&self, share: f64, words: String) {
        self.0.set_position((1000.0 * share.clamp(0.0, 1.0)) as u64);
        self.0.set_message(words);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
