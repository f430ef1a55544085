//! The last frame simulated under the muscles found, made anew in the background while it is laid over the real one.

use std::sync::Arc;

use super::app::App;
use super::jobs::{About, Finished};
use super::{Stamp, Workspace};
use crate::draw::words::sentence;
use crate::muscle_field::Replay;
use crate::muscle_field::replay::pull_of_muscles;

/// The simulation that is shown, and the one under way.
#[derive(Debug, Default)]
pub struct ReplayWork {
    /// The outcome that was asked about last.
    asked: Option<Stamp>,
    job: Option<u64>,
    /// The answer, with the outcome that it is of.
    answer: Option<(Stamp, Result<Arc<Replay>, String>)>,
}

/// What can be laid over the last frame.
#[derive(Clone, Copy, Debug)]
pub enum Replayed<'a> {
    /// It is being worked out.
    Looking,
    /// It cannot be: one line says why.
    Refused(&'a str),
    /// Simulated against seen.
    Found(&'a Replay),
}

impl ReplayWork {
    /// What is known about the outcome of this stamp.
    pub fn of(&self, stamp: Stamp) -> Replayed<'_> {
        match &self.answer {
            Some((of, Ok(replay))) if *of == stamp => Replayed::Found(replay),
            Some((of, Err(why))) if *of == stamp => Replayed::Refused(why),
            _ => Replayed::Looking,
        }
    }
}

impl App {
    /// Whether the simulation is shown, so that the muscles must be known. While a point is in the hand, everything changes with
    /// every frame of the window, and nothing is asked for.
    pub(super) fn shows_replay(&self) -> bool {
        let frames = &self.view.frames;
        self.view.workspace == Workspace::Frames && frames.replay.on && frames.drag.is_none()
    }

    /// Simulates anew when what is shown is not what was asked about.
    pub(super) fn follow_replay(&mut self, ctx: &egui::Context) {
        let stamp = self.stamp;
        if !self.shows_replay() || self.replay_work.asked == Some(stamp) {
            return;
        }
        if let (Some(Err(nothing)), false) = (self.muscle_work.answer(), self.muscle_work.is_looking()) {
            self.replay_work.asked = Some(stamp);
            self.replay_work.answer = Some((stamp, Err(sentence(&nothing.to_string()))));
            ctx.request_repaint();
            return;
        }
        let Some((analysis, _)) = self.muscle_work.current(stamp) else { return };
        if let Some(job) = self.replay_work.job.take() {
            self.jobs.cancel(job);
        }
        self.replay_work.asked = Some(stamp);
        let (project, face, outcome) = (self.project().clone(), Arc::clone(&self.face), self.outcome.clone());
        let job = self.jobs.start(ctx, "Simulating the last frame", About::Replay, move |progress| {
            let pull = pull_of_muscles(&face, &outcome, &analysis);
            let found = Replay::new(&project, &face, &outcome, pull).map_err(|e| sentence(&e.to_string()));
            (!progress.is_cancelled()).then(|| Finished::Replay(stamp, Box::new(found)))
        });
        self.replay_work.job = Some(job);
    }

    /// Takes a simulation, if it is still the one that is wanted.
    pub(super) fn replay_found(&mut self, stamp: Stamp, found: Result<Replay, String>, ctx: &egui::Context) {
        let work = &mut self.replay_work;
        if work.asked == Some(stamp) {
            work.job = None;
            work.answer = Some((stamp, found.map(Arc::new)));
            ctx.request_repaint();
        }
    }

    /// The work was stopped, or died: it is not begun again before something changes.
    pub(super) fn replay_stopped(&mut self) {
        let work = &mut self.replay_work;
        work.job = None;
        work.answer = work.asked.map(|stamp| (stamp, Err("The simulation was stopped.".to_owned())));
    }
}
