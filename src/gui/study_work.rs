//! Studies in the background: begun, watched, stopped and taken up again; and the table that is shown.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::Stamp;
use super::app::App;
use super::jobs::{About, Finished, Progress, Written};
use super::view_state::{NoticeKind, Workspace};
use crate::export::study_files;
use crate::pipeline::{self, Outcome};
use crate::project::Edit;
use crate::project::whole_file::{self, Durability};
use crate::study::applied::{Applied, applied};
use crate::study::journal::Journal;
use crate::study::ladder::{Goals, Subject};
use crate::study::{Kind, Options, Run, runner, table};

/// What is studied, and what is known of it.
#[derive(Default)]
pub struct StudyWork {
    /// What the study under way has brought so far.
    live: Arc<Mutex<Live>>,
    /// Whether a thread is at work on a study: also one that was told to stop and finishes its case.
    busy: Arc<AtomicBool>,
    /// The work under way.
    job: Option<u64>,
    table: Option<Table>,
    /// How far the study was when it was stopped.
    stopped: Option<runner::Progress>,
    preview: Option<Preview>,
}

/// What the picked method would make of the open project.
#[derive(Clone, Debug)]
pub struct Preview {
    /// Its choices, and what they change in words.
    pub applied: Applied,
    /// What the chain makes of them.
    pub outcome: Outcome,
    /// Of which project and face.
    stamp: Stamp,
}

#[derive(Default)]
struct Live {
    progress: Option<runner::Progress>,
    rows: Vec<Run>,
}

/// A table that is shown.
#[derive(Clone, Debug)]
pub struct Table {
    /// Where it comes from: "Stability, under way", or a file.
    pub title: String,
    /// The study, where it is one that this program knows.
    pub kind: Option<Kind>,
    /// Its rows.
    pub runs: Arc<Vec<Run>>,
    /// Changes with the rows.
    pub revision: u64,
}

/// Tells the window that the thread of a study has ended, however it ends.
struct Ends(Arc<AtomicBool>);

impl Drop for Ends {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl StudyWork {
    /// The table shown.
    pub fn table(&self) -> Option<&Table> {
        self.table.as_ref()
    }

    /// How far the study under way is.
    pub fn progress(&self) -> Option<runner::Progress> {
        self.job?;
        self.live.lock().unwrap_or_else(PoisonError::into_inner).progress.clone()
    }

    /// How far the study was that was stopped last.
    pub fn stopped(&self) -> Option<&runner::Progress> {
        self.stopped.as_ref()
    }

    /// What the picked method would make of the open project, where it is a choice of one.
    pub fn preview(&self) -> Option<&Preview> {
        self.preview.as_ref()
    }

    /// Whether a study is under way.
    pub fn is_running(&self) -> bool {
        self.job.is_some()
    }

    /// Whether another can be begun: one that was told to stop finishes its case first.
    pub fn is_free(&self) -> bool {
        self.job.is_none() && !self.busy.load(Ordering::Acquire)
    }

    fn show(&mut self, title: String, runs: Vec<Run>) {
        let revision = self.table.as_ref().map_or(1, |t| t.revision + 1);
        self.table = Some(Table { title, kind: Kind::of(&runs), runs: Arc::new(runs), revision });
    }
}

impl App {
    /// What is studied.
    pub fn study_work(&self) -> &StudyWork {
        &self.study_work
    }

    /// The study that is chosen, on the face that is chosen.
    fn study_options(&self) -> Options {
        let chosen = &self.view.study;
        let own = chosen.own_face.then(|| self.face.with_positions(self.outcome.first.clone()).ok()).flatten();
        let subject = own.is_some().then(|| {
            let project = self.project().clone();
            Arc::new(Subject { size_px: super::app::image_size_px(&project), project, face: Arc::clone(&self.face) })
        });
        let face = own.map_or_else(crate::face::generic, Arc::new);
        Options { quick: chosen.quick, seeds: chosen.seeds, face, subject }
    }

    /// Begins the study that is chosen, or goes on with it; `anew` forgets what there is of it.
    pub(super) fn start_study(&mut self, anew: bool, ctx: &egui::Context) {
        if !self.study_work.is_free() {
            return;
        }
        self.view.workspace = Workspace::Study;
        let (kind, options) = (self.view.study.kind, self.study_options());
        let plan = kind.plan(&options);
        let heading = plan.heading();
        let place = self.state_folder.as_ref().map(|folder| {
            let studies = folder.join("studies");
            (studies.join(format!("{}-{}.journal", kind.name(), heading.short())), studies)
        });
        let live = Arc::new(Mutex::new(Live::default()));
        let work = &mut self.study_work;
        (work.live, work.stopped) = (Arc::clone(&live), None);
        work.busy.store(true, Ordering::Release);
        let ends = Ends(Arc::clone(&work.busy));
        work.show(format!("{}, under way", kind.label()), Vec::new());
        // One core is left to the window.
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get().saturating_sub(1).max(1));
        let repaint = ctx.clone();
        let name = format!("Study: {}", kind.label().to_lowercase());
        let job = self.jobs.start(ctx, name, About::Study, move |progress| {
            let _ends = ends;
            let mut journal = match opened(place, anew, &heading) {
                Ok(journal) => journal,
                Err(why) => return Some(Finished::Study(Err(why))),
            };
            let mut watch = |p: &runner::Progress, rows: &[Run]| {
                progress.set(p.share);
                let mut live = live.lock().unwrap_or_else(PoisonError::into_inner);
                live.progress = Some(p.clone());
                live.rows.extend_from_slice(rows);
                repaint.request_repaint();
            };
            match plan.run(&mut journal, threads, &|| progress.is_cancelled(), &mut watch) {
                Ok(Some(rows)) => {
                    journal.remove();
                    Some(Finished::Study(Ok(rows)))
                }
                Ok(None) => None,
                Err(e) => Some(Finished::Study(Err(e.to_string()))),
            }
        });
        self.study_work.job = Some(job);
    }

    /// Stops the study under way; what it has finished stays, and is taken up again.
    pub(super) fn stop_study(&mut self) {
        if let Some(job) = self.study_work.job {
            self.jobs.cancel(job);
            self.study_stopped();
        }
    }

    /// The study was stopped, or died.
    pub(super) fn study_stopped(&mut self) {
        self.follow_study();
        let work = &mut self.study_work;
        work.job = None;
        let live = Arc::clone(&work.live);
        work.stopped.clone_from(&live.lock().unwrap_or_else(PoisonError::into_inner).progress);
        if let Some(table) = &mut work.table {
            table.title = table.title.replace(", under way", ", stopped");
        }
    }

    /// Shows what the study under way has brought since the last frame.
    pub(super) fn follow_study(&mut self) {
        if self.study_work.job.is_none() {
            return;
        }
        let live = Arc::clone(&self.study_work.live);
        let live = live.lock().unwrap_or_else(PoisonError::into_inner);
        let work = &mut self.study_work;
        let Some(table) = &mut work.table else { return };
        if table.runs.len() != live.rows.len() {
            table.runs = Arc::new(live.rows.clone());
            table.kind = Kind::of(&table.runs);
            table.revision += 1;
        }
    }

    /// The study came to its end, or could not go on.
    pub(super) fn study_finished(&mut self, result: Result<Vec<Run>, String>, ctx: &egui::Context) {
        self.follow_study();
        self.study_work.job = None;
        match result {
            Ok(rows) => {
                let label = Kind::of(&rows).unwrap_or_default().label();
                self.study_work.show(label.to_owned(), rows);
                self.tell(NoticeKind::Done, format!("The study is done: {}.", label.to_lowercase()), ctx);
            }
            Err(why) => self.fail("The study cannot go on", why),
        }
    }

    /// Shows the table of a study from disk.
    pub(super) fn open_study(&mut self, path: &Path) {
        match table::read_file(path) {
            Ok(runs) => {
                if self.study_work.is_running() {
                    self.stop_study();
                }
                self.study_work.stopped = None;
                let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into());
                self.study_work.show(name, runs);
                self.view.study.forget();
                self.view.workspace = Workspace::Study;
            }
            Err(why) => self.fail("The table cannot be read", format!("{}: {why}", path.display())),
        }
    }

    /// Writes table, chart and reading into a folder.
    pub(super) fn export_study(&mut self, folder: PathBuf, ctx: &egui::Context) {
        let Some(Table { kind: Some(kind), runs, .. }) = self.study_work.table.clone() else { return };
        let goals = self.view.study.goals;
        self.jobs.start(ctx, "Writing the study", About::Person, move |progress| {
            Some(Finished::Exported(write((kind, &runs, goals), &folder, progress).map(|()| Written::to(folder))))
        });
    }

    /// Solves a copy of the project by the method that is picked, whenever either has changed.
    pub(super) fn follow_preview(&mut self) {
        let picked = self.view.study.picked.as_ref().filter(|_| self.view.workspace == Workspace::Study);
        let wanted = picked.and_then(|p| applied(&p.method, &p.setting, &self.project().settings));
        let Some(wanted) = wanted else {
            self.study_work.preview = None;
            return;
        };
        let same = |p: &Preview| p.stamp == self.stamp && p.applied == wanted;
        if self.study_work.preview.as_ref().is_some_and(same) {
            return;
        }
        let mut project = self.project().clone();
        project.settings = wanted.settings.clone();
        let size = super::app::image_size_px(&project);
        let outcome = pipeline::solve(&project, &self.face, size, &mut pipeline::Workspace::default());
        self.study_work.preview = Some(Preview { applied: wanted, outcome, stamp: self.stamp });
    }

    /// Solves the project by the method that is picked: one step of the history.
    pub(super) fn apply_study(&mut self, ctx: &egui::Context) {
        let Some(applied) = self.study_work.preview.as_ref().map(|p| p.applied.clone()) else { return };
        self.edit(&Edit::SetSettings(applied.settings), ctx);
        self.tell(NoticeKind::Done, applied.words, ctx);
    }
}

/// The journal of a study in the window's own folder; in memory alone where it has none.
fn opened(
    place: Option<(PathBuf, PathBuf)>,
    anew: bool,
    heading: &crate::study::journal::Heading,
) -> Result<Journal, String> {
    let Some((path, folder)) = place else { return Ok(Journal::in_memory()) };
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: cannot be made ({e})", folder.display()))?;
    if anew && path.exists() {
        std::fs::remove_file(&path).map_err(|e| format!("{}: cannot be removed ({e})", path.display()))?;
    }
    Journal::open(&path, heading).map_err(|e| e.to_string())
}

fn write((kind, runs, goals): (Kind, &[Run], Goals), folder: &Path, progress: &Progress) -> Result<(), String> {
    let refused = |path: &Path, e: std::io::Error| {
        format!("{}: cannot be written ({e}); choose another folder, or free it for writing", path.display())
    };
    let files = study_files::files(kind, runs, goals).map_err(|e| e.to_string())?;
    std::fs::create_dir_all(folder).map_err(|e| refused(folder, e))?;
    for (name, bytes) in files {
        if progress.is_cancelled() {
            return Ok(());
        }
        let path = folder.join(name);
        whole_file::write(&path, &bytes, Durability::Disk).map_err(|e| refused(&path, e))?;
    }
    Ok(())
}
