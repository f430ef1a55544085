//! The application: a frame is "show panels, run commands, poll jobs".

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::action::Action;
use super::action_state::ActionState;
use super::dialogs::Dialogs;
use super::expression_work::ExpressionWork;
use super::face_work::FaceWork;
use super::jobs::Jobs;
use super::keys::{self, KeyMap};
use super::muscle_work::MuscleWork;
use super::new_frames::NewFrame;
use super::panels::frames::points;
use super::pictures::Pictures;
use super::replay_work::ReplayWork;
use super::solving::Solver;
use super::study_work::StudyWork;
use super::subjects_work::SubjectsWork;
use super::suggesting::{Status, Suggesting};
use super::view_state::{NoticeKind, ViewState, Workspace};
use super::{Command, Scene, Stamp, files, panels};
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::autosave::{self, Named, Unnamed};
use crate::project::recent::Recent;
use crate::project::whole_file;
use crate::project::{FaceSource, History, PointId, Project, Which};
use crate::suggest::Suggestion;

/// Size of the picture while there is none, px: that of the thesis.
const SIZE_WITHOUT_FRAMES_PX: [u32; 2] = [1036, 1036];

/// The window: the project with its history, what the chain makes of it, and how it is shown.
pub struct App {
    pub(super) document: OpenDocument,
    /// The face that is fitted, and which one the project calls it.
    pub(super) face: Arc<FaceModel>,
    pub(super) face_source: FaceSource,
    /// Faces that this window has had, so that an undo need not read them again.
    pub(super) faces: Vec<(FaceSource, Arc<FaceModel>)>,
    pub(super) face_work: FaceWork,
    pub(super) muscle_work: MuscleWork,
    pub(super) subjects_work: SubjectsWork,
    pub(super) expression_work: ExpressionWork,
    pub(super) replay_work: ReplayWork,
    pub(super) study_work: StudyWork,
    pub(super) stamp: Stamp,
    pub(super) outcome: Outcome,
    pub(super) solver: Solver,
    pub(super) pictures: Pictures,
    pub(super) suggesting: Suggesting,
    pub(super) view: ViewState,
    pub(super) jobs: Jobs,
    /// Pictures that were chosen and wait for what becomes of the marks on those before.
    pub(super) waiting_frames: Vec<NewFrame>,
    pub(super) dialogs: Box<dyn Dialogs>,
    pub(super) commands: Vec<Command>,
    /// Where journals of projects without a file and the list of recent projects are kept, if unsaved work is kept at all.
    pub(super) state_folder: Option<PathBuf>,
    pub(super) recent: Recent,
    pub(super) keys: Arc<KeyMap>,
    /// What could not be read at the start, to be told in the first frame.
    pub(super) to_tell: Option<String>,
}

/// The project that is open, and its file.
pub(super) struct OpenDocument {
    pub(super) history: History,
    /// The project as it stands in its file.
    pub(super) saved: Project,
    pub(super) path: Option<PathBuf>,
    /// Whether a journal of unsaved work is kept.
    pub(super) autosave: bool,
    /// The journal.
    pub(super) journal: Option<Journal>,
    /// The state of the history that the journal holds.
    pub(super) journalled: u64,
    /// Work that was found when the project was opened, until the person has said what becomes of it.
    pub(super) found: Option<Project>,
    /// A nudge by key is under way: one step of the history until the key is released.
    pub(super) nudging: bool,
    /// The window may close.
    pub(super) may_close: bool,
}

/// Where unsaved work is kept.
#[derive(Debug)]
pub(super) enum Journal {
    /// Beside the project's file.
    Beside(Named),
    /// In a place of this window's own.
    Own(Unnamed),
}

impl Journal {
    /// The journal of a project with this file, or without one.
    pub(super) fn of(path: Option<&Path>, state_folder: Option<&Path>) -> Option<Self> {
        match path {
            Some(path) => {
                whole_file::sweep(&whole_file::folder_of(path), whole_file::STALE);
                Some(Self::Beside(Named::take(path, state_folder)))
            }
            None => Unnamed::take(state_folder?).map(Self::Own),
        }
    }

    pub(super) fn path(&self) -> &Path {
        match self {
            Self::Beside(named) => named.journal(),
            Self::Own(unnamed) => unnamed.journal(),
        }
    }
}

impl OpenDocument {
    /// A project just opened.
    pub(super) fn new(project: Project, path: Option<PathBuf>, autosave: bool) -> Self {
        Self {
            saved: project.clone(),
            history: History::new(project),
            path,
            autosave,
            journal: None,
            journalled: 0,
            found: None,
            nudging: false,
            may_close: false,
        }
    }
}

impl App {
    /// A window on a project.
    pub fn new(project: Project, path: Option<PathBuf>, face: Arc<FaceModel>, dialogs: Box<dyn Dialogs>) -> Self {
        let (solver, outcome) = Solver::new(&project, &face);
        let mut view = ViewState::default();
        view.frames.regions = proposed_regions(&face);
        Self {
            face_source: project.face.clone(),
            faces: Vec::new(),
            face_work: FaceWork::default(),
            muscle_work: MuscleWork::default(),
            subjects_work: SubjectsWork::default(),
            expression_work: ExpressionWork::default(),
            replay_work: ReplayWork::default(),
            study_work: StudyWork::default(),
            stamp: Stamp::default(),
            document: OpenDocument::new(project, path, false),
            face,
            outcome,
            solver,
            pictures: Pictures::default(),
            suggesting: Suggesting::default(),
            view,
            jobs: Jobs::default(),
            waiting_frames: Vec::new(),
            dialogs,
            commands: Vec::new(),
            state_folder: None,
            recent: Recent::default(),
            keys: Arc::default(),
            to_tell: None,
        }
    }

    /// Keeps a journal of unsaved work, and asks about what is found in it.
    #[must_use]
    pub fn with_autosave(self) -> Self {
        self.with_autosave_in(autosave::state_folder())
    }

    /// The same, with what belongs to no project's folder kept in this one.
    #[must_use]
    pub fn with_autosave_in(mut self, state_folder: Option<PathBuf>) -> Self {
        self.recent = Recent::read(state_folder.as_deref());
        if let Some(folder) = &state_folder {
            let (keys, bad) = KeyMap::read(folder);
            (self.keys, self.to_tell) = (Arc::new(keys), bad);
        }
        self.state_folder = state_folder;
        self.document.autosave = true;
        self.document.journal = Journal::of(self.document.path.as_deref(), self.state_folder.as_deref());
        if let Some(path) = self.document.path.clone() {
            self.recent.add(&path);
        }
        self.look_for_unsaved_work();
        self
    }

    /// The project as it is now.
    pub fn project(&self) -> &Project {
        self.document.history.project()
    }

    /// The work under way.
    pub fn jobs(&self) -> &Jobs {
        &self.jobs
    }

    /// What the chain makes of it.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// How far a marked point of the last frame lies from where its neighbours lead.
    pub fn gap(&self, id: &PointId) -> Option<crate::doubt::Gap> {
        super::panels::frames::doubt::gap_of(self.scene(), id)
    }

    /// The suggestions that are shown for the points to mark.
    pub fn suggestions(&self) -> Vec<Suggestion> {
        let scene = self.scene();
        let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
        chosen.into_iter().filter_map(|v| points::suggestion(scene, v).copied()).collect()
    }

    /// What is to be said of them.
    pub fn suggestion_status(&self) -> &Status {
        &self.suggesting.shown.status
    }

    /// Names of the steps done, oldest first.
    pub fn steps(&self) -> Vec<String> {
        self.document.history.done().map(str::to_owned).collect()
    }

    /// What is shown, and how.
    pub fn view(&self) -> &ViewState {
        &self.view
    }

    /// What is shown, and how, to be changed before the first frame.
    pub fn view_mut(&mut self) -> &mut ViewState {
        &mut self.view
    }

    /// The face that is being made.
    pub fn face_work(&self) -> &FaceWork {
        &self.face_work
    }

    /// Whether the project differs from its file.
    pub fn unsaved(&self) -> bool {
        self.document.history.project() != &self.document.saved
    }

    /// Asks for something, as a panel would; done in the next frame.
    pub fn push(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// Waits for all long work, so that its result is there in the next frame.
    pub fn wait_for_jobs(&mut self) {
        self.jobs.wait();
    }

    /// One frame of the window.
    pub fn frame(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        keys::install(&ctx, &self.keys);
        if let Some(text) = self.to_tell.take() {
            self.tell(NoticeKind::Refused, text, &ctx);
        }
        self.listen(&ctx);
        self.show(ui);
        self.run_commands(&ctx);
        self.poll_jobs(&ctx);
        if self.view.focus.end_pass() {
            ctx.request_repaint();
        }
    }

    /// Keys, files dropped on the window, and the wish to close it.
    fn listen(&mut self, ctx: &egui::Context) {
        if self.view.modal.is_none() && self.view.palette.is_none() && !ctx.any_popup_open() {
            let state = self.action_state(ctx);
            let pressed = self.keys.pressed(ctx, ctx.text_edit_focused());
            let possible = pressed.into_iter().filter(|a| state.can(*a));
            // Keys that speak to a widget with the keyboard focus are left to it.
            let in_frames = self.view.workspace == Workspace::Frames;
            let widget = in_frames && ctx.memory(egui::Memory::focused).is_some() && !self.canvas_has_focus(ctx);
            self.commands.extend(possible.filter(|a| !(widget && speaks_to_widgets(*a))).map(Command::Do));
        }
        let (dropped, at) = ctx.input(|i| {
            let paths: Vec<PathBuf> = i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect();
            (paths, i.pointer.latest_pos())
        });
        if !dropped.is_empty() {
            let panes = &self.view.frames.panes;
            let over = [Which::First, Which::Last]
                .into_iter()
                .find(|w| at.is_some_and(|at| panes[*w as usize].rect.contains(at)));
            self.commands.push(Command::Dropped(dropped, over));
        }
        if ctx.input(|i| i.viewport().close_requested()) && !self.document.may_close {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.commands.push(Command::Do(Action::Quit));
        }
    }

    fn show(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        let state = self.action_state(&ctx);
        let title = self.title();
        set_window_title(&ctx, &title);
        let in_first = (self.view.workspace == Workspace::Expressions).then(|| self.places_in_first()).flatten();
        let Self {
            document,
            outcome,
            face,
            view,
            pictures,
            jobs,
            commands,
            recent,
            stamp,
            face_work,
            muscle_work,
            subjects_work,
            expression_work,
            replay_work,
            study_work,
            suggesting,
            solver,
            ..
        } = self;
        let suggested = &suggesting.shown;
        let (project, skin, fitting) = (document.history.project(), solver.skin(), solver.is_fitting());
        let replay = view.frames.replay.on.then(|| replay_work.of(*stamp));
        let scene = Scene { project, outcome, face, suggested, skin, fitting, replay, stamp: *stamp };
        egui::Panel::top("menu").show(ui, |ui| panels::menu::show(ui, view, &title, &state, recent, commands));
        egui::Panel::bottom("status").exact_size(26.0).show(ui, |ui| {
            panels::status::show(ui, scene, view, jobs, commands);
        });
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| match view.workspace {
            Workspace::Frames => {
                let (history, frames, focus) = (&document.history, &mut view.frames, &mut view.focus);
                panels::frames::show(ui, scene, pictures, history, &state, frames, focus, commands);
            }
            Workspace::Muscles => {
                let (view, focus) = (&mut view.muscles, &mut view.focus);
                panels::muscles::show(ui, scene, muscle_work, subjects_work, view, focus, commands);
            }
            Workspace::Expressions => {
                let (view, focus) = (&mut view.expressions, &mut view.focus);
                panels::expressions::show(ui, expression_work, in_first.as_deref(), view, focus, &state, commands);
            }
            Workspace::Study => {
                let (view, focus) = (&mut view.study, &mut view.focus);
                panels::study::show(ui, scene, study_work, view, focus, &state, commands);
            }
            Workspace::Face => panels::face::show(ui, face_work, &mut view.face, &state, commands),
            Workspace::Forces => panels::forces::show(ui, scene, &mut view.forces, &mut view.focus, commands),
        });
        if let Some(mut modal) = view.modal.take()
            && panels::modals::show(&ctx, &mut modal, commands)
        {
            view.modal = Some(modal);
        }
        if let Some(mut palette) = view.palette.take()
            && panels::palette::show(&ctx, &mut palette, &state, commands)
        {
            view.palette = Some(palette);
        }
    }

    /// What every panel may read.
    pub(super) fn scene(&self) -> Scene<'_> {
        let suggested = &self.suggesting.shown;
        let (skin, fitting) = (self.solver.skin(), self.solver.is_fitting());
        Scene {
            project: self.project(),
            outcome: &self.outcome,
            face: &self.face,
            suggested,
            skin,
            fitting,
            replay: self.view.frames.replay.on.then(|| self.replay_work.of(self.stamp)),
            stamp: self.stamp,
        }
    }

    /// Fits another face from now on.
    pub(super) fn set_face(&mut self, source: &FaceSource, face: Arc<FaceModel>) {
        self.remember_face(source, &face);
        self.view.frames.regions = proposed_regions(&face);
        (self.face, self.face_source) = (face, source.clone());
        self.stamp.face += 1;
        self.solve_anew();
    }

    pub(super) fn remember_face(&mut self, source: &FaceSource, face: &Arc<FaceModel>) {
        if !self.faces.iter().any(|(known, _)| same_face(known, source)) {
            self.faces.push((source.clone(), Arc::clone(face)));
        }
    }

    /// Fits the face that the project names, when an edit or an undo has changed it.
    pub(super) fn follow_face(&mut self) {
        let wanted = self.project().face.clone();
        if same_face(&wanted, &self.face_source) {
            return;
        }
        let known = self.faces.iter().find(|(source, _)| same_face(source, &wanted)).map(|(_, face)| Arc::clone(face));
        let path = self.document.path.clone().unwrap_or_else(|| "unnamed".into());
        match known.map_or_else(|| files::face_of(self.project(), &path), Ok) {
            Ok(face) => self.set_face(&wanted, face),
            Err(why) => {
                // Said once; the face before stays until another is named.
                self.face_source = wanted;
                self.fail("The face of the project cannot be read", why);
            }
        }
    }

    pub(super) fn action_state(&self, ctx: &egui::Context) -> ActionState {
        let dark = ctx.theme() == egui::Theme::Dark;
        ActionState::new(self.scene(), &self.document.history, &self.face_work, &self.study_work, &self.view, dark)
    }

    fn canvas_has_focus(&self, ctx: &egui::Context) -> bool {
        ctx.memory(egui::Memory::focused).is_some_and(|id| self.view.frames.canvases.contains(&id))
    }

    /// "brow raise •": the name of the project, and whether something is unsaved.
    pub fn title(&self) -> String {
        let named = &self.project().name;
        let file = self.document.path.as_deref().map(super::pictures::file_name);
        let name = match (named.is_empty(), file) {
            (false, _) => named.clone(),
            (true, Some(file)) => file,
            (true, None) => "Untitled".to_owned(),
        };
        if self.unsaved() { format!("{name} •") } else { name }
    }
}

/// Still points are few and needed first; of the others, the first region.
fn proposed_regions(face: &FaceModel) -> std::collections::BTreeSet<String> {
    let regions = face.regions().iter();
    let proposed = regions.clone().filter(|r| r.id == points::STILL_REGION).chain(regions.take(1));
    proposed.map(|r| r.id.clone()).collect()
}

/// Whether two sources name one face, wherever its file lies.
fn same_face(a: &FaceSource, b: &FaceSource) -> bool {
    match (a, b) {
        (FaceSource::File { sha256: a, .. }, FaceSource::File { sha256: b, .. }) => a.eq_ignore_ascii_case(b),
        _ => a == b,
    }
}

/// Whether the key of an action also means something to a button or a slider that has the keyboard.
fn speaks_to_widgets(action: Action) -> bool {
    matches!(action, Action::Nudge(..) | Action::Accept | Action::Next | Action::Previous)
}

/// Size of the first frame, px.
pub(super) fn image_size_px(project: &Project) -> [u32; 2] {
    project.frames.first.as_ref().map_or(SIZE_WITHOUT_FRAMES_PX, |f| [f.width_px, f.height_px])
}

/// Gives the window a title, when it is another one.
fn set_window_title(ctx: &egui::Context, title: &str) {
    let whole = format!("{title} – Frontalis");
    let id = egui::Id::unique("title of the window");
    if ctx.data(|d| d.get_temp::<String>(id)).as_ref() != Some(&whole) {
        ctx.data_mut(|d| d.insert_temp(id, whole.clone()));
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(whole));
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.frame(ui);
    }
}
