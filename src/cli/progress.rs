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

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
