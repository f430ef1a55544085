//! The chain kept up with the project: at once as far as it is quick, in the background where muscles take their time.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::Stamp;
use super::app::{App, image_size_px};
use super::jobs::{About, Finished};
use crate::displacement::VertexState;
use crate::face::FaceModel;
use crate::forces::Skin;
use crate::pipeline::{self, Outcome, Warning};
use crate::project::{FieldWay, Project};

/// A fit that takes no longer is waited for: the measured field would flicker by.
const PATIENCE: Duration = Duration::from_millis(30);

/// The chain, and the state of the history that it was run on.
pub(super) struct Solver {
    workspace: pipeline::Workspace,
    revision: u64,
    muscles: Muscles,
    /// What the fits keep from one to the next.
    of_fits: Arc<Mutex<pipeline::Workspace>>,
}

/// How it stands with the muscles that the project asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Muscles {
    /// The outcome is what the project asks for.
    Shown,
    /// The outcome is the measured one, until the hand lets go.
    Wanted,
    /// It is, until the work of that number is done.
    Fitting(u64),
}

impl Solver {
    /// On a project just opened, with what is known of it at once.
    pub(super) fn new(project: &Project, face: &FaceModel) -> (Self, Outcome) {
        let mut solver = Self {
            workspace: pipeline::Workspace::default(),
            revision: 0,
            muscles: Muscles::Shown,
            of_fits: Arc::default(),
        };
        let outcome = solver.measured(project, face);
        (solver, outcome)
    }

    /// The skin of the last run.
    pub(super) fn skin(&self) -> Option<&Skin> {
        self.workspace.skin()
    }

    /// Whether the field is the measured one, and the muscles that the project asks for are still to come.
    pub(super) fn is_fitting(&self) -> bool {
        self.muscles != Muscles::Shown
    }

    /// The chain as far as it is quick: where muscles are asked for, the measured field stands for theirs.
    fn measured(&mut self, project: &Project, face: &FaceModel) -> Outcome {
        let size = image_size_px(project);
        if !matches!(project.settings.field, FieldWay::Muscles(_)) {
            self.muscles = Muscles::Shown;
            return pipeline::solve(project, face, size, &mut self.workspace);
        }
        let mut quick = project.clone();
        quick.settings.field = project.settings.field.measured();
        let outcome = pipeline::solve(&quick, face, size, &mut self.workspace);
        // Skin that nobody has touched has nothing to explain.
        let marked = outcome.states.contains(&VertexState::Measured);
        self.muscles = if marked { Muscles::Wanted } else { Muscles::Shown };
        outcome
    }
}

impl App {
    /// Runs the chain when the project has changed, and shows the result in this same frame: without its muscles while the hand is at work, or
    /// where they take longer than a moment.
    pub(super) fn resolve(&mut self, ctx: &egui::Context) {
        self.follow_face();
        let history = &self.document.history;
        if self.solver.revision != history.revision() {
            self.solver.revision = history.revision();
            if let Muscles::Fitting(job) = self.solver.muscles {
                self.jobs.cancel(job);
            }
            self.outcome = self.solver.measured(history.project(), &self.face);
            self.stamp.outcome += 1;
            ctx.request_discard("the project changed");
        }
        let in_hand = self.view.frames.drag.is_some() || self.document.nudging;
        if self.solver.muscles == Muscles::Wanted && !in_hand {
            self.fit_muscles(ctx);
        }
    }

    fn fit_muscles(&mut self, ctx: &egui::Context) {
        let (project, face, stamp) = (self.project().clone(), Arc::clone(&self.face), self.stamp);
        let workspace = Arc::clone(&self.solver.of_fits);
        let job = self.jobs.start(ctx, "Fitting the muscles", About::Field, move |progress| {
            let mut workspace = workspace.lock().unwrap_or_else(PoisonError::into_inner);
            let (size, stop) = (image_size_px(&project), || progress.is_cancelled());
            let outcome = pipeline::solve_unless(&project, &face, size, &mut workspace, &stop)?;
            Some(Finished::Solved(stamp, Box::new(outcome)))
        });
        self.solver.muscles = Muscles::Fitting(job);
        if self.jobs.wait_for(job, PATIENCE) {
            self.take_answers(ctx);
        }
    }

    /// Takes a field of muscles, if it is still the one that is wanted.
    pub(super) fn solved(&mut self, of: Stamp, outcome: Outcome, ctx: &egui::Context) {
        if self.stamp == of && self.solver.is_fitting() {
            self.outcome = outcome;
            self.solver.muscles = Muscles::Shown;
            self.stamp.outcome += 1;
            ctx.request_repaint();
        }
    }

    /// The fit was stopped by the person, or died: the measured field stays until something changes.
    pub(super) fn field_stopped(&mut self) {
        if self.solver.is_fitting() {
            self.solver.muscles = Muscles::Shown;
            self.outcome.warnings.push(Warning::NoMuscle { why: "the fit was stopped".to_owned() });
        }
    }

    /// Runs the chain although the history looks unchanged: another document is open.
    pub(super) fn solve_anew(&mut self) {
        self.solver.revision = u64::MAX;
    }
}
