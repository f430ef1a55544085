//! Long work, on threads of its own: each with a name, a progress and a way to stop it; the answer comes back by channel.

use std::path::PathBuf;

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Stamp;
use super::expression_work::Prepared;
use super::face_work::{FaceProposal, FaceRead};
use super::film_work::{Looking, NotWritten, Stills};
use super::import_marks::ReadMarks;
use super::muscle_work::MuscleAnswer;
use super::pictures::{Adjusted, Source};
use super::subjects_work::Tried;
use super::suggesting::{Answer, Failure, Ready};
use crate::face::check::Report;
use crate::frames::{Adjustment, Frame};
use crate::muscle_field::Replay;
use crate::pipeline::Outcome;
use crate::project::Which;

/// Results that were written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Where they are.
    pub folder: PathBuf,
    /// Whether the other subjects are not among them, since the laws have not been tried on all of them.
    pub without: bool,
}

impl Written {
    /// All of them, into this folder.
    pub fn to(folder: PathBuf) -> Self {
        Self { folder, without: false }
    }
}

/// What a job brings back.
#[derive(Debug)]
pub enum Finished {
    /// A picture was read, or not: one line says why.
    Frame {
        /// For which frame.
        which: Which,
        /// Where it was read from.
        source: Source,
        /// Whether a person chose it now (an edit), or the project names it already.
        chosen: bool,
        /// The picture.
        result: Result<Frame, String>,
    },
    /// A picture was adjusted for showing.
    Adjusted {
        /// Which frame.
        which: Which,
        /// Hash of the frame that was adjusted.
        sha256: String,
        /// How.
        adjustment: Adjustment,
        /// The pixels, or why there are none: one line.
        result: Result<Adjusted, String>,
    },
    /// A film was looked through, or cannot be: one line says why.
    Film(Looking, Result<(), String>),
    /// A file of marks was read, or not: one line says why.
    Marks(Result<ReadMarks, String>),
    /// Two frames of a film were written as pictures, or not.
    Stills(Stills, Result<[PathBuf; 2], NotWritten>),
    /// A mesh or a face model was read, or not: one line says why.
    Face(Box<Result<FaceRead, String>>),
    /// Landmarks and muscles were proposed for the face of that number, or not.
    Proposed(u64, Box<Result<FaceProposal, String>>),
    /// A face was checked.
    FaceChecked {
        /// Which face was open.
        number: u64,
        /// Which state of it.
        revision: u64,
        /// What was found.
        report: Report,
    },
    /// A frame was prepared for finding points in it, or not.
    Prepared(Which, Result<Ready, Failure>),
    /// Places for the points that are not marked.
    Suggested(Answer),
    /// The chain was run with the muscles that the project asks for, after the outcome of that stamp.
    Solved(Stamp, Box<Outcome>),
    /// The muscles behind the forces were looked for: the answer to the question of that number.
    Muscles(u64, MuscleAnswer),
    /// The laws of the answer of that number were tried on other subjects.
    Subjects(u64, Vec<Tried>),
    /// The last frame was simulated, for the outcome of that stamp, or not: one line says why.
    Replay(Stamp, Box<Result<Replay, String>>),
    /// A face was made ready to move, for the question of that number, or not: one line says why.
    Stage(u64, Box<Result<Prepared, String>>),
    /// The frame of that hash, to be laid on the skin.
    Skin(String, Result<egui::ColorImage, String>),
    /// A study came to its end, or could not go on: one line says why.
    Study(Result<Vec<crate::study::Run>, String>),
    /// Results were written, or not.
    Exported(Result<Written, String>),
    /// The work ended without an answer: what waited for it, and a line about it.
    Died(About, String),
}

/// Shared between a job and the window.
#[derive(Debug, Default)]
pub struct Progress {
    permille: AtomicU32,
    cancelled: AtomicBool,
}

impl Progress {
    /// Says how much is done, 0 to 1.
    pub fn set(&self, share: f64) {
        self.permille.store((share.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
    }

    /// How much is done, 0 to 1.
    pub fn share(&self) -> f32 {
        self.permille.load(Ordering::Relaxed) as f32 / 1000.0
    }

    /// Whether the person wants it to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Asks the work to stop.
    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

/// What waits for a work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The picture of a frame.
    Picture(Which),
    /// The search for points in a frame, which needs it prepared.
    Preparation(Which),
    /// The suggestions.
    Suggestions,
    /// The field of the muscles that the project asks for.
    Field,
    /// The muscles.
    Muscles,
    /// The other subjects.
    Subjects,
    /// The simulated last frame.
    Replay,
    /// The face that moves.
    Expressions,
    /// The picture on its skin.
    Skin,
    /// The study.
    Study,
    /// The person.
    Person,
}

/// A work under way.
pub struct Job {
    /// Its number.
    pub id: u64,
    /// What it does: "Reading first.png".
    pub name: String,
    /// What waits for it.
    pub about: About,
    /// How far it is.
    pub progress: Arc<Progress>,
    /// When it began.
    pub began: Instant,
    thread: Option<JoinHandle<()>>,
}

/// All work under way.
pub struct Jobs {
    next: u64,
    running: Vec<Job>,
    /// Numbers of the works that were stopped: one may have ended at that very moment.
    dropped: Vec<u64>,
    sender: Sender<(u64, Finished)>,
    receiver: Receiver<(u64, Finished)>,
    /// Held by the work that has a whole picture in memory: another one waits.
    picture_in_memory: Arc<Mutex<()>>,
}

impl Default for Jobs {
    fn default() -> Self {
        let (sender, receiver) = channel();
        let picture_in_memory = Arc::default();
        Self { next: 0, running: Vec::new(), dropped: Vec::new(), sender, receiver, picture_in_memory }
    }
}

impl Jobs {
    /// Starts a work on a thread of its own, and gives its number. Work that finds itself cancelled returns nothing.
    pub fn start(
        &mut self,
        ctx: &egui::Context,
        name: impl Into<String>,
        about: About,
        work: impl FnOnce(&Progress) -> Option<Finished> + Send + 'static,
    ) -> u64 {
        let (id, name) = (self.next, name.into());
        self.next += 1;
        let progress = Arc::new(Progress::default());
        let (sender, ctx, shared) = (self.sender.clone(), ctx.clone(), Arc::clone(&progress));
        let one_at_a_time = matches!(about, About::Picture(_) | About::Preparation(_) | About::Skin)
            .then(|| Arc::clone(&self.picture_in_memory));
        let thread = std::thread::Builder::new().name(name.clone()).spawn(move || {
            // A work that died has left no picture behind.
            let held = one_at_a_time.as_ref().map(|m| m.lock().unwrap_or_else(PoisonError::into_inner));
            let answer = if shared.is_cancelled() { None } else { work(&shared) };
            drop(held);
            if let Some(answer) = answer {
                // The window may be gone; then nobody waits for the answer.
                let _ = sender.send((id, answer));
            }
            ctx.request_repaint();
        });
        match thread {
            Ok(thread) => {
                self.running.push(Job { id, name, about, progress, began: Instant::now(), thread: Some(thread) });
            }
            Err(e) => {
                let why = format!("{name}: no thread could be started ({e})");
                _ = self.sender.send((id, Finished::Died(about, why)));
            }
        }
        id
    }

    /// The works under way.
    pub fn running(&self) -> &[Job] {
        &self.running
    }

    /// Asks a work to stop, and tells what waits for it; what it brings back later is dropped.
    pub fn cancel(&mut self, id: u64) -> Option<About> {
        let at = self.running.iter().position(|j| j.id == id)?;
        let job = self.running.remove(at);
        job.progress.cancel();
        self.dropped.push(id);
        Some(job.about)
    }

    /// What has been brought back since the last call.
    pub fn poll(&mut self) -> Vec<Finished> {
        let mut ended: Vec<usize> = Vec::new();
        for (at, job) in self.running.iter().enumerate() {
            if job.thread.as_ref().is_none_or(JoinHandle::is_finished) {
                ended.push(at);
            }
        }
        // Threads first, channel second: the answer of a thread that has ended is then certainly in the channel.
        let dropped = &self.dropped;
        let mut answers: Vec<(u64, Finished)> =
            self.receiver.try_iter().filter(|(id, _)| !dropped.contains(id)).collect();
        for at in ended.into_iter().rev() {
            let mut job = self.running.remove(at);
            let failed = job.thread.take().is_some_and(|t| t.join().is_err());
            if failed {
                let why = format!("{} stopped unexpectedly; nothing was changed", job.name);
                answers.push((job.id, Finished::Died(job.about, why)));
            }
        }
        answers.into_iter().map(|(_, answer)| answer).collect()
    }

    /// Waits for a work, but not longer than this; whether it has ended.
    pub(super) fn wait_for(&self, id: u64, at_most: Duration) -> bool {
        let began = Instant::now();
        loop {
            let job = self.running.iter().find(|j| j.id == id);
            if job.and_then(|j| j.thread.as_ref()).is_none_or(JoinHandle::is_finished) {
                return true;
            }
            if began.elapsed() >= at_most {
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits until every work has ended: for tests, which then see the answers in the next frame.
    pub fn wait(&mut self) {
        for job in &mut self.running {
            while job.thread.as_ref().is_some_and(|t| !t.is_finished()) {
                std::thread::yield_now();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_panics_is_a_sentence_and_a_cancelled_one_is_silent() {
        let (ctx, mut jobs) = (egui::Context::default(), Jobs::default());
        jobs.start(&ctx, "Breaking", About::Person, |_| panic!("on purpose"));
        jobs.wait();
        let answers = jobs.poll();
        assert!(
            matches!(&answers[..], [Finished::Died(About::Person, text)] if text.starts_with("Breaking stopped")),
            "{answers:?}"
        );
        assert!(jobs.running().is_empty());

        let (open, gate) = channel::<()>();
        jobs.start(&ctx, "Waiting", About::Picture(Which::Last), move |p| {
            gate.recv().ok();
            (!p.is_cancelled()).then(|| Finished::Died(About::Person, "not cancelled".into()))
        });
        let id = jobs.running()[0].id;
        assert_eq!(jobs.cancel(id), Some(About::Picture(Which::Last)));
        open.send(()).unwrap();
        assert!(jobs.running().is_empty() && jobs.poll().is_empty());
    }
}
