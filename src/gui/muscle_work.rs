//! The muscles behind the forces, looked for in the background whenever the forces or the question have changed while they are shown.

use std::sync::Arc;

use super::app::{App, image_size_px};
use super::jobs::{About, Finished};
use super::{Stamp, Workspace};
use crate::muscle_field::{Analysis, Ladder, Nothing, Question, ladder};
use crate::pipeline;

/// What is known of the muscles, and what is being looked for.
#[derive(Debug, Default)]
pub struct MuscleWork {
    /// Grows with every question asked.
    number: u64,
    /// What was asked last, of which outcome.
    asked: Option<(Stamp, Question)>,
    /// The work under way.
    job: Option<u64>,
    /// The last answer; it holds until another comes.
    answer: Option<Result<Arc<Analysis>, Nothing>>,
    /// The number of the question that it answers.
    answered: u64,
    ladder: LadderWork,
}

/// The ladder of models: built when asked for.
#[derive(Debug, Default)]
enum LadderWork {
    #[default]
    None,
    Building,
    Built(u64, Arc<Ladder>),
}

/// What the work brings back; `None` where it was stopped.
#[derive(Debug)]
pub enum MuscleAnswer {
    /// The muscles.
    Analysis(Box<Result<Analysis, Nothing>>),
    /// The ladder.
    Ladder(Box<Ladder>),
}

impl MuscleWork {
    /// The last answer.
    pub fn answer(&self) -> Option<Result<&Arc<Analysis>, Nothing>> {
        self.answer.as_ref().map(|a| a.as_ref().map_err(|e| *e))
    }

    /// The number of the answer that is shown; another one has another.
    pub fn answered(&self) -> u64 {
        self.answered
    }

    /// Whether a newer answer is on its way.
    pub fn is_looking(&self) -> bool {
        self.answered != self.number
    }

    /// The ladder, if it was built on the answer shown.
    pub fn ladder(&self) -> Option<&Ladder> {
        match &self.ladder {
            LadderWork::Built(number, ladder) if *number == self.answered => Some(ladder),
            _ => None,
        }
    }

    /// The answer to what is asked of the outcome shown, with the ladder if it was built on it; none while another is on its way.
    pub fn current(&self, stamp: Stamp) -> Option<(Arc<Analysis>, Option<Arc<Ladder>>)> {
        let (asked, _) = self.asked.as_ref()?;
        let analysis = self.answer.as_ref()?.as_ref().ok().filter(|_| *asked == stamp && !self.is_looking())?;
        let ladder = match &self.ladder {
            LadderWork::Built(number, ladder) if *number == self.answered => Some(Arc::clone(ladder)),
            _ => None,
        };
        Some((Arc::clone(analysis), ladder))
    }

    /// Whether the ladder is being built.
    pub fn is_building(&self) -> bool {
        matches!(self.ladder, LadderWork::Building)
    }
}

impl App {
    /// What is known of the muscles.
    pub fn muscle_work(&self) -> &MuscleWork {
        &self.muscle_work
    }

    /// Asks anew when what is shown is not what was asked.
    pub(super) fn follow_muscles(&mut self, ctx: &egui::Context) {
        let for_play = self.view.workspace == Workspace::Expressions && self.view.expressions.wants_fit;
        let shown = self.view.workspace == Workspace::Muscles || for_play || self.shows_replay();
        if !shown || self.solver.is_fitting() {
            return;
        }
        let question = self.view.muscles.question.clone();
        let wanted = (self.stamp, question);
        if self.muscle_work.asked.as_ref() == Some(&wanted) {
            return;
        }
        if let Some(job) = self.muscle_work.job.take() {
            self.jobs.cancel(job);
        }
        let work = &mut self.muscle_work;
        work.number += 1;
        work.asked = Some(wanted.clone());
        let (number, outcome, face) = (work.number, self.outcome.clone(), Arc::clone(&self.face));
        let project = self.project().clone();
        let job = self.jobs.start(ctx, "Finding the muscles", About::Muscles, move |progress| {
            let causes = pipeline::error_causes(&project, &face, image_size_px(&project));
            let found = Analysis::new(&outcome, &causes, &face, &wanted.1, &|| progress.is_cancelled())?;
            Some(Finished::Muscles(number, MuscleAnswer::Analysis(Box::new(found))))
        });
        self.muscle_work.job = Some(job);
    }

    /// Builds the ladder of models on the answer that is shown.
    pub(super) fn build_ladder(&mut self, ctx: &egui::Context) {
        let Some(Ok(analysis)) = &self.muscle_work.answer else { return };
        if self.muscle_work.is_building() || self.muscle_work.is_looking() {
            return;
        }
        let (analysis, face, project) = (Arc::clone(analysis), Arc::clone(&self.face), self.project().clone());
        let (number, size) = (self.muscle_work.answered, image_size_px(&project));
        self.muscle_work.ladder = LadderWork::Building;
        self.jobs.start(ctx, "Building the ladder", About::Muscles, move |progress| {
            let stop = || progress.is_cancelled();
            let built = ladder::ladder(&project, &face, size, &analysis, &stop, &|share| progress.set(share))?;
            Some(Finished::Muscles(number, MuscleAnswer::Ladder(Box::new(built))))
        });
    }

    /// Takes an answer, if it is still the one that is wanted.
    pub(super) fn muscles_found(&mut self, number: u64, answer: MuscleAnswer, ctx: &egui::Context) {
        let work = &mut self.muscle_work;
        match answer {
            MuscleAnswer::Analysis(found) if number == work.number => {
                work.job = None;
                work.answered = number;
                work.answer = Some((*found).map(Arc::new));
            }
            MuscleAnswer::Analysis(_) => {}
            MuscleAnswer::Ladder(ladder) => work.ladder = LadderWork::Built(number, Arc::new(*ladder)),
        }
        ctx.request_repaint();
    }

    /// The search was stopped by the person, or died: what is shown stays, and is asked for again when something changes.
    pub(super) fn muscles_stopped(&mut self) {
        let work = &mut self.muscle_work;
        work.job = None;
        work.answered = work.number;
        if work.is_building() {
            work.ladder = LadderWork::None;
        }
    }
}
