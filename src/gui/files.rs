//! Opening, saving, dropping and recovering: everything that reads or writes a file because a person said so.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::app::{App, Journal, OpenDocument, image_size_px};
use super::command::After;
use super::dialogs::Purpose;
use super::jobs::{About, Finished, Written};
use super::modal::Modal;
use super::panels::frames::Tool;
use super::pictures::{self, PictureStatus, Pictures};
use super::view_state::NoticeKind;
use super::{Command, dialogs, export_results, rescue};
use crate::face::{self, FaceModel};
use crate::pipeline;
use crate::project::whole_file::{self, Durability};
use crate::project::{FaceSource, FrameStatus, Project, Which, autosave, file, frames_check, paths, sample};

impl App {
    /// Does it, or asks first what becomes of unsaved changes.
    pub(super) fn unless_unsaved(&mut self, after: After, ctx: &egui::Context) {
        if self.unsaved() {
            self.view.modal = Some(Modal::Unsaved(after));
        } else {
            self.proceed(after, ctx);
        }
    }

    /// Does what unsaved changes have stopped; they are saved or given up.
    pub(super) fn proceed(&mut self, after: After, ctx: &egui::Context) {
        match after {
            After::New => self.open_document(Project::default(), None),
            After::NewWith(frames) => self.begin_with(frames, ctx),
            After::AskOpen => self.dialogs.ask(ctx, Purpose::OpenProject),
            After::Open(path) => self.open(&path),
            After::Sample => match sample::project() {
                Ok(project) => {
                    self.open_document(project, None);
                }
                Err(e) => self.fail("The sample cannot be opened", e.to_string()),
            },
            After::AskMesh => self.dialogs.ask(ctx, Purpose::OpenMesh),
            After::AskFace => self.dialogs.ask(ctx, Purpose::OpenFace),
            After::ReadFace(path) => self.read_face(path, ctx),
            After::UseFace => self.use_face(ctx),
            After::Quit if self.face_work.unsaved() => self.view.modal = Some(Modal::UnsavedFace(After::Quit)),
            After::Quit => {
                self.remove_journal();
                self.document.may_close = true;
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
        }
    }

    /// Shows another document; the journal of the one before goes, for its changes were saved or given up.
    pub(super) fn open_document(&mut self, project: Project, path: Option<PathBuf>) {
        self.remove_journal();
        self.document = OpenDocument::new(project, path, self.document.autosave);
        if self.document.autosave {
            self.document.journal = Journal::of(self.document.path.as_deref(), self.state_folder.as_deref());
        }
        self.pictures = Pictures::default();
        self.view.focus.selected = None;
        self.view.frames.drag = None;
        self.view.frames.tool = Tool::Select;
        self.view.frames.placed = None;
        self.view.frames.finished = None;
        self.view.frames.doubt.reset();
        self.waiting_frames.clear();
        self.suggesting.forget_imported();
        self.view.frames.fit();
        self.name_subjects();
        self.solve_anew();
        self.look_for_unsaved_work();
    }

    /// Opens a project file, or says why not; the one that is open then stays.
    pub(super) fn open(&mut self, path: &Path) {
        match read_project(path) {
            Ok((project, face)) => {
                self.set_face(&project.face, face);
                self.open_document(project, Some(path.to_owned()));
                self.recent.add(path);
            }
            Err(why) => self.offer_rescue(path, why),
        }
    }

    /// Saves where the project lies, or asks where.
    pub(super) fn save(&mut self, then: Option<After>, ctx: &egui::Context) {
        match self.document.path.clone() {
            Some(path) => self.save_to(path, then, ctx),
            None => self.ask_where_to_save(then, ctx),
        }
    }

    pub(super) fn ask_where_to_save(&mut self, then: Option<After>, ctx: &egui::Context) {
        let name = match &self.project().name {
            empty if empty.is_empty() => "project",
            name => name,
        };
        let suggested = format!("{}.{}", name.replace(['/', '\\', ':'], "-"), file::EXTENSION);
        self.dialogs.ask(ctx, Purpose::SaveProject { suggested, then });
    }

    fn save_to(&mut self, mut path: PathBuf, then: Option<After>, ctx: &egui::Context) {
        if path.extension().is_none() {
            path.set_extension(file::EXTENSION);
        }
        self.document.history.commit_gesture();
        let moved = paths::rebase(self.project(), self.document.path.as_deref(), &path);
        let mut project = self.project().clone();
        for edit in &moved {
            // A path is text like any other: such an edit is never refused.
            let _ = edit.apply(&mut project);
        }
        let saved = write_sample_frames(&project, &path);
        if let Err(e) = saved.and_then(|()| file::save(&project, &path).map_err(|e| e.to_string())) {
            self.fail("The project was not saved", e);
            return;
        }
        self.remove_journal();
        if !moved.is_empty() {
            let from = self.document.path.clone();
            self.document.history.relocate(|p| paths::rebase(p, from.as_deref(), &path));
        }
        self.document.saved = project;
        self.tell(NoticeKind::Done, format!("Saved to {}.", path.display()), ctx);
        self.recent.add(&path);
        if self.document.autosave && self.document.path.as_ref() != Some(&path) {
            self.document.journal = Journal::of(Some(&path), self.state_folder.as_deref());
        }
        self.document.path = Some(path);
        self.name_subjects();
        if let Some(after) = then {
            self.commands.push(Command::Proceed(after));
        }
    }

    /// Goes on with the files that the person has named.
    pub(super) fn files_chosen(&mut self, purpose: &Purpose, mut files: Vec<PathBuf>, ctx: &egui::Context) {
        let Some(first) = files.first().cloned() else { return };
        match purpose {
            Purpose::OpenProject => self.open(&first),
            Purpose::SaveProject { then, .. } => self.save_to(first, then.clone(), ctx),
            Purpose::Frames if files.len() == 1 => {
                self.commands.push(Command::LoadFrame(Which::First, first));
                self.commands.push(Command::AskFiles(Purpose::Frame(Which::Last)));
            }
            Purpose::Frames => {
                if files.len() > 2 {
                    self.fail(
                        "Too many files",
                        format!(
                            "{} files were chosen; choose the first and the last frame, or open their folder.",
                            files.len()
                        ),
                    );
                    return;
                }
                self.load_pair(&mut files);
            }
            Purpose::Frame(which) => self.commands.push(Command::LoadFrame(*which, first)),
            Purpose::OpenMesh | Purpose::OpenFace => self.read_face(first, ctx),
            Purpose::SaveFace { then, .. } => self.save_face_to(first, then.clone(), ctx),
            Purpose::Marks => self.import_marks(first, ctx),
            Purpose::Compare => self.compare_with(&first),
            Purpose::Subjects => self.add_subjects(&files),
            Purpose::Film | Purpose::FrameFolder => self.open_film(first, ctx),
            Purpose::StillsFolder(stills) => self.write_stills(stills.clone(), first, ctx),
            Purpose::ExportFolder => self.export(first, ctx),
            Purpose::PlayFolder => self.export_expression(first, ctx),
            Purpose::OpenStudy => self.open_study(&first),
            Purpose::StudyFolder => self.export_study(first, ctx),
            Purpose::OpenExpression => self.open_expression(&first),
            Purpose::SaveExpression { .. } => self.save_expression(first, ctx),
        }
    }

    fn load_pair(&mut self, files: &mut [PathBuf]) {
        if let [first, last] = files {
            self.commands.push(Command::LoadFrame(Which::First, first.clone()));
            self.commands.push(Command::LoadFrame(Which::Last, last.clone()));
        }
    }

    /// A project is opened, a film or a folder shown as a strip, one picture goes to the pane it was dropped on, two become the frames.
    pub(super) fn dropped(&mut self, mut files: Vec<PathBuf>, over: Option<Which>, ctx: &egui::Context) {
        files.sort();
        let is_picture = |p: &PathBuf| {
            p.extension().is_some_and(|e| dialogs::PICTURES.contains(&e.to_string_lossy().to_lowercase().as_str()))
        };
        let is_film = |p: &PathBuf| {
            p.extension().is_some_and(|e| dialogs::FILMS.contains(&e.to_string_lossy().to_lowercase().as_str()))
        };
        let is_face = |p: &PathBuf| {
            let name = pictures::file_name(p).to_lowercase();
            dialogs::MESHES.iter().any(|e| name.ends_with(&format!(".{e}"))) || name.ends_with(".face.json")
        };
        if matches!(self.view.modal, Some(Modal::Path { .. })) {
            self.view.modal = None;
        }
        match &files[..] {
            [one] if one.is_dir() || is_film(one) => self.open_film(one.clone(), ctx),
            [one] if is_picture(one) => {
                let free = if self.project().frames.first.is_none() { Which::First } else { Which::Last };
                self.commands.push(Command::LoadFrame(over.unwrap_or(free), one.clone()));
            }
            [one] if is_face(one) => self.unless_face_unsaved(After::ReadFace(one.clone()), ctx),
            [one] => self.unless_unsaved(After::Open(one.clone()), ctx),
            [_, _] if files.iter().all(is_picture) => self.load_pair(&mut files),
            _ => {
                let text = "Drop one project, one picture, two pictures (first and last), a film, a folder of numbered pictures, or one mesh.";
                self.fail("These files are not understood together", text.to_owned());
            }
        }
    }

    /// Writes the journal when a gesture has ended since it was last written.
    pub(super) fn write_journal(&mut self) {
        let document = &mut self.document;
        let revision = document.history.revision();
        let waits = document.found.is_some() || document.history.in_gesture() || document.journalled == revision;
        if !document.autosave || waits {
            return;
        }
        document.journalled = revision;
        let Some(journal) = document.journal.as_ref().map(Journal::path) else { return };
        if document.history.project() == &document.saved {
            autosave::remove(journal);
        } else if let Err(e) = autosave::write(document.history.project(), journal) {
            document.autosave = false;
            self.fail("Unsaved work cannot be kept safe", format!("{e}. Save often."));
        }
    }

    fn remove_journal(&mut self) {
        if self.document.autosave
            && self.document.found.is_none()
            && let Some(journal) = &self.document.journal
        {
            autosave::remove(journal.path());
        }
    }

    /// Asks about work that was not saved, if there is any.
    pub(super) fn look_for_unsaved_work(&mut self) {
        let document = &mut self.document;
        let Some(journal) = document.journal.as_ref().filter(|_| document.autosave) else { return };
        if let Some(found) = autosave::recover(journal.path(), document.path.as_deref()) {
            let (when, older) = (rescue::age(found.saved_at), found.older);
            document.found = Some(found.project);
            self.view.modal = Some(Modal::Recover { when, older });
        }
    }

    /// Takes the work that was found, as unsaved changes, or throws it away.
    pub(super) fn recover(&mut self, take: bool) {
        let Some(found) = self.document.found.take() else { return };
        if !take {
            self.remove_journal();
            return;
        }
        let saved = self.document.saved.clone();
        let journal = self.document.journal.take();
        self.document = OpenDocument::new(found, self.document.path.clone(), self.document.autosave);
        (self.document.saved, self.document.journal) = (saved, journal);
        self.view.frames.doubt.reset();
        self.solve_anew();
    }

    /// Writes the results into a folder, in the background.
    fn export(&mut self, folder: PathBuf, ctx: &egui::Context) {
        let named = self.document.path.as_ref().map_or_else(|| "PROJECT".into(), |p| p.display().to_string());
        let last = self.pictures.get(Which::Last);
        let known = matches!(last.status(), PictureStatus::Ready { changed: false });
        let muscles = self.muscle_work.current(self.stamp);
        let others = self.subjects_work.whole(self.muscle_work.answered());
        let without = self.subjects_work.is_any() && (muscles.is_none() || others.is_empty());
        let fitting = self.solver.is_fitting();
        let mut results = export_results::Results {
            project: self.project().clone(),
            face: Arc::clone(&self.face),
            outcome: self.outcome.clone(),
            muscles,
            others,
            last_frame: last.source().filter(|_| known).map(|(source, _)| source.clone()),
            named: [format!("'{named}'"), format!("'{}'", folder.display())],
        };
        self.jobs.start(ctx, "Writing the results", About::Person, move |progress| {
            if fitting {
                // What is shown stands for the muscles only until they are there.
                let (size, stop) = (image_size_px(&results.project), || progress.is_cancelled());
                let mut workspace = pipeline::Workspace::default();
                results.outcome = pipeline::solve_unless(&results.project, &results.face, size, &mut workspace, &stop)?;
            }
            let written = export_results::write(&folder, &results, progress);
            (!progress.is_cancelled()).then(|| Finished::Exported(written.map(|()| Written { folder, without })))
        });
    }

    /// The face that the window fits.
    pub fn face(&self) -> Arc<FaceModel> {
        Arc::clone(&self.face)
    }
}

/// Reads a project with the face that it names; refuses marks on what that face does not have.
///
/// # Errors
/// One line: the file, the place, the reason, the remedy.
pub fn read_project(path: &Path) -> Result<(Project, Arc<FaceModel>), String> {
    let project = file::load(path).map_err(|e| e.to_string())?;
    let face = face_of(&project, path)?;
    Ok((project, face))
}

/// The face that a project at `path` names; refuses marks on what that face does not have.
///
/// # Errors
/// One line: the file, the place, the reason, the remedy.
pub fn face_of(project: &Project, path: &Path) -> Result<Arc<FaceModel>, String> {
    let face = match &project.face {
        FaceSource::Generic => face::generic(),
        FaceSource::File { path: text, sha256 } => {
            let at = paths::resolve_text(path, text);
            match frames_check::status_at(at.clone(), sha256) {
                FrameStatus::Ok => Arc::new(face::file::read(&at).map_err(|e| e.to_string())?),
                status => return Err(format!("the face model {status}")),
            }
        }
    };
    file::check_bindings(path, project, &face).map_err(|e| e.to_string())?;
    Ok(face)
}

/// The sample's frames lie in the program; a project of them that is saved takes them along.
fn write_sample_frames(project: &Project, path: &Path) -> Result<(), String> {
    for frame in [&project.frames.first, &project.frames.last].into_iter().flatten() {
        let at = paths::resolve(path, frame);
        if let Some(bytes) = sample::frame_bytes(frame)
            && !at.exists()
        {
            let written = whole_file::write(&at, bytes, Durability::Disk);
            written.map_err(|e| format!("{}: cannot be written ({e}); choose another folder", at.display()))?;
        }
    }
    Ok(())
}
