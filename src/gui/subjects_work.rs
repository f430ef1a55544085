//! Other subjects: projects opened beside the one at hand, solved in the background, with its laws tried on each of them.
//!
//! The list belongs to the window, not to the project: it is kept while the window is open, also when another project is opened in it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::app::App;
use super::dialogs::Purpose;
use super::files::read_project;
use super::jobs::{About, Finished};
use super::panels::muscles::Tab;
use super::pictures::file_name;
use super::{Workspace, app};
use crate::draw::words::sentence;
use crate::face::FaceModel;
use crate::muscle_field::subjects::{Other, Seen, carry, told_apart};
use crate::pipeline::{self, Outcome};
use crate::project::{Project, paths};

/// The other subjects of a window.
#[derive(Default)]
pub struct SubjectsWork {
    listed: Vec<Listed>,
    next: u64,
    /// Grows with every change of the list or of what is known of it.
    revision: u64,
    /// The work under way, and which answer about the muscles it takes the laws from.
    job: Option<(u64, u64)>,
    /// The answer for which the person has stopped the work.
    stopped: Option<u64>,
}

/// One of them.
pub struct Listed {
    /// Tells it from the others.
    pub id: u64,
    /// What it is called.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    project: Project,
    face: Arc<FaceModel>,
    outcome: Option<Arc<Outcome>>,
    /// Whether it is the project that is open.
    own: bool,
    /// What came of it, and from which answer about the muscles.
    tried: Option<(u64, Result<Other, String>)>,
}

impl Listed {
    /// What is known of it: the laws tried on it, or in one line why they cannot be; nothing yet while that is looked for.
    pub fn found(&self) -> Option<Result<&Other, &str>> {
        if self.own {
            return Some(Err("This is the project that is open."));
        }
        self.tried.as_ref().map(|(_, found)| found.as_ref().map_err(String::as_str))
    }

    fn other(&self) -> Option<&Other> {
        self.found().and_then(Result::ok)
    }
}

/// What a work brings back of one subject: its number, its forces, and the laws on them or why there are none.
pub type Tried = (u64, Arc<Outcome>, Result<Other, String>);

impl SubjectsWork {
    /// All that were opened, in that order.
    pub fn listed(&self) -> &[Listed] {
        &self.listed
    }

    /// Those on which laws were tried, with their numbers.
    pub fn others(&self) -> impl Iterator<Item = (u64, &Other)> {
        self.listed.iter().filter_map(|l| Some((l.id, l.other()?)))
    }

    /// Changes with everything that can be seen of them.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether what is shown belongs to another answer about the muscles than this one (none: another answer is on its way), or is not
    /// there yet.
    pub fn is_old(&self, answer: Option<u64>) -> bool {
        self.listed.iter().any(|l| !l.own && l.tried.as_ref().map(|t| t.0) != answer)
    }

    /// Whether the person has stopped the work on this answer.
    pub fn is_stopped(&self, answer: Option<u64>) -> bool {
        answer.is_some() && self.stopped == answer
    }

    /// Whether there is any besides the project that is open.
    pub fn is_any(&self) -> bool {
        self.listed.iter().any(|l| !l.own)
    }

    /// All, where laws were tried on every one with this answer; for what is written, which must be of one piece.
    pub fn whole(&self, answer: u64) -> Vec<(PathBuf, Other)> {
        if self.is_old(Some(answer)) {
            return Vec::new();
        }
        self.listed.iter().filter_map(|l| Some((l.path.clone(), l.other()?.clone()))).collect()
    }

    /// Says which of them is the project that is open, and gives them names that differ.
    fn rename(&mut self, project: &Project, path: Option<&Path>) {
        self.revision += 1;
        let unnamed = Path::new("");
        let all = self.listed.iter().map(|l| (l.project.name.as_str(), l.path.as_path()));
        let own = (project.name.as_str(), path.unwrap_or(unnamed));
        let names = told_apart(&std::iter::once(own).chain(all).collect::<Vec<_>>());
        for (listed, name) in self.listed.iter_mut().zip(names.into_iter().skip(1)) {
            listed.own = path.is_some_and(|p| paths::same_file(p, &listed.path));
            if let Some((_, Ok(other))) = &mut listed.tried {
                other.name.clone_from(&name);
            }
            listed.name = name;
        }
    }
}

impl App {
    /// The other subjects.
    pub fn subjects_work(&self) -> &SubjectsWork {
        &self.subjects_work
    }

    /// Asks for other subjects, and shows where they will be.
    pub(super) fn ask_for_subjects(&mut self, ctx: &egui::Context) {
        self.view.workspace = Workspace::Muscles;
        self.view.muscles.tab = Tab::Subjects;
        self.dialogs.ask(ctx, Purpose::Subjects);
    }

    /// Opens projects as other subjects; says of each that cannot be one why, and takes the others.
    pub(super) fn add_subjects(&mut self, files: &[PathBuf]) {
        let mut refused = Vec::new();
        for path in files {
            match self.readable_subject(path) {
                Ok((project, face)) => {
                    let work = &mut self.subjects_work;
                    work.next += 1;
                    work.listed.push(Listed {
                        id: work.next,
                        name: String::new(),
                        path: path.clone(),
                        project,
                        face,
                        outcome: None,
                        own: false,
                        tried: None,
                    });
                }
                Err(why) => refused.push(why),
            }
        }
        self.subjects_work.stopped = None;
        self.name_subjects();
        if !refused.is_empty() {
            self.fail("This is no other subject", refused.join("\n"));
        }
    }

    /// A project that can be another subject, with its face; or in one line why not.
    fn readable_subject(&self, path: &Path) -> Result<(Project, Arc<FaceModel>), String> {
        let name = file_name(path);
        if self.document.path.as_ref().is_some_and(|own| paths::same_file(own, path)) {
            return Err(format!("{name} is the project that is open; choose that of another subject."));
        }
        if self.subjects_work.listed.iter().any(|l| paths::same_file(&l.path, path)) {
            return Err(format!("{name} is among the other subjects already."));
        }
        let (project, face) = read_project(path)?;
        if project.features.values().all(|f| f.last.is_none()) {
            return Err(format!("{name} has no mark in the last frame, so that no force is known of it."));
        }
        Ok((project, face))
    }

    /// Takes one off the list.
    pub(super) fn remove_subject(&mut self, id: u64) {
        self.subjects_work.listed.retain(|l| l.id != id);
        self.name_subjects();
    }

    /// Another project is open, or has another file or name.
    pub(super) fn name_subjects(&mut self) {
        self.subjects_work.rename(self.document.history.project(), self.document.path.as_deref());
    }

    /// Goes on where the person had stopped.
    pub(super) fn try_subjects_again(&mut self) {
        self.subjects_work.stopped = None;
    }

    /// Tries the laws of the answer that is shown on every subject that has not seen them.
    pub(super) fn follow_subjects(&mut self, ctx: &egui::Context) {
        let answer = self.muscle_work.current(self.stamp);
        let number = self.muscle_work.answered();
        let work = &mut self.subjects_work;
        if let Some((job, of)) = work.job {
            if answer.is_some() && of == number {
                return;
            }
            // What it would bring back belongs to marks or a question of before.
            self.jobs.cancel(job);
            work.job = None;
        }
        let Some((analysis, _)) = answer.filter(|_| self.view.workspace == Workspace::Muscles) else { return };
        if work.stopped == Some(number) {
            return;
        }
        let stale = work.listed.iter().filter(|l| !l.own && l.tried.as_ref().is_none_or(|t| t.0 != number));
        let tasks: Vec<Task> = stale
            .map(|l| Task {
                id: l.id,
                name: l.name.clone(),
                project: l.project.clone(),
                face: Arc::clone(&l.face),
                outcome: l.outcome.clone(),
            })
            .collect();
        if tasks.is_empty() {
            return;
        }
        let (face, outcome) = (Arc::clone(&self.face), self.outcome.clone());
        let job = self.jobs.start(ctx, "Trying the laws on other subjects", About::Subjects, move |progress| {
            let own = Seen { name: "", face: &face, outcome: &outcome };
            let count = tasks.len() as f64;
            let mut tried = Vec::new();
            for (k, task) in tasks.into_iter().enumerate() {
                let stop = || progress.is_cancelled();
                let told = |share: f64| progress.set((k as f64 + share) / count);
                if stop() {
                    return None;
                }
                let solved = task.outcome.unwrap_or_else(|| {
                    let size = app::image_size_px(&task.project);
                    Arc::new(pipeline::solve(&task.project, &task.face, size, &mut pipeline::Workspace::default()))
                });
                let there = Seen { name: &task.name, face: &task.face, outcome: &solved };
                let found = carry(&analysis, own, there, &stop, &told)?.map_err(|why| sentence(&why.to_string()));
                let found = found.map(|carried| Other {
                    name: task.name,
                    face: task.face,
                    outcome: Arc::clone(&solved),
                    carried,
                });
                tried.push((task.id, solved, found));
            }
            Some(Finished::Subjects(number, tried))
        });
        work.job = Some((job, number));
    }

    /// Takes what was found, of those that are still listed.
    pub(super) fn subjects_tried(&mut self, number: u64, tried: Vec<Tried>, ctx: &egui::Context) {
        let work = &mut self.subjects_work;
        work.job = work.job.filter(|(_, of)| *of != number);
        for (id, outcome, found) in tried {
            if let Some(listed) = work.listed.iter_mut().find(|l| l.id == id) {
                listed.outcome = Some(outcome);
                listed.tried = Some((number, found));
            }
        }
        self.name_subjects();
        ctx.request_repaint();
    }

    /// The work was stopped by the person, or died: what is shown stays, and is old.
    pub(super) fn subjects_stopped(&mut self) {
        self.subjects_work.stopped = self.subjects_work.job.take().map(|(_, number)| number);
    }
}

/// What is to be done for one subject.
struct Task {
    id: u64,
    name: String,
    project: Project,
    face: Arc<FaceModel>,
    outcome: Option<Arc<Outcome>>,
}
