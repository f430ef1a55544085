//! The application: a frame is "show panels, run commands, poll jobs".

use std::path::PathBuf;
use std::sync::Arc;

use super::action::{self, Action};
use super::dialogs::Dialogs;
use super::view_state::{ViewState, Workspace};
use super::{Command, Scene, panels, theme};
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::{History, Project};

/// The chain as the window calls it: project, face, size of the first frame in px.
pub type Solve = Box<dyn FnMut(&Project, &FaceModel, [u32; 2]) -> Outcome>;

/// Size of the picture while there is none, px: that of the thesis.
pub(super) const SIZE_WITHOUT_FRAMES_PX: [u32; 2] = [1036, 1036];

/// The window: the project with its history, what the chain makes of it, and how it is shown.
pub struct App {
    pub(super) history: History,
    /// The project as it stands in its file.
    pub(super) saved: Project,
    pub(super) path: Option<PathBuf>,
    pub(super) face: Arc<FaceModel>,
    pub(super) solve: Solve,
    pub(super) outcome: Outcome,
    pub(super) solved_revision: u64,
    pub(super) view: ViewState,
    pub(super) dialogs: Box<dyn Dialogs>,
    pub(super) commands: Vec<Command>,
}

impl App {
    /// A window on a project.
    pub fn new(
        project: Project,
        path: Option<PathBuf>,
        face: Arc<FaceModel>,
        mut solve: Solve,
        dialogs: Box<dyn Dialogs>,
    ) -> Self {
        let outcome = solve(&project, &face, image_size_px(&project));
        Self {
            saved: project.clone(),
            history: History::new(project),
            path,
            face,
            solve,
            outcome,
            solved_revision: 0,
            view: ViewState::default(),
            dialogs,
            commands: Vec::new(),
        }
    }

    /// The project as it is now.
    pub fn project(&self) -> &Project {
        self.history.project()
    }

    /// What the chain makes of it.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// What is shown, and how.
    pub fn view(&self) -> &ViewState {
        &self.view
    }

    /// Whether the project differs from its file.
    pub fn unsaved(&self) -> bool {
        self.history.project() != &self.saved
    }

    /// Asks for something, as a panel would; done in the next frame.
    pub fn push(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// One frame of the window.
    pub fn frame(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        for action in action::pressed(&ctx, ctx.text_edit_focused()) {
            self.commands.push(Command::Do(action));
        }
        self.show(ui);
        self.run_commands(&ctx);
        if self.view.focus.end_pass() {
            ctx.request_repaint();
        }
    }

    fn show(&mut self, ui: &mut egui::Ui) {
        let title = self.title();
        let Self { history, outcome, face, view, commands, .. } = self;
        let scene = Scene { project: history.project(), outcome, face };
        let can = |action: Action| match action {
            Action::Undo => history.done().len() > 0,
            Action::Redo => history.undone().len() > 0,
            _ => true,
        };
        let on = |_: Action| None;
        egui::Panel::top("menu").show(ui, |ui| panels::menu::show(ui, view, &title, &can, &on, commands));
        egui::Panel::bottom("status").exact_size(26.0).show(ui, |ui| panels::status::show(ui, scene, view, commands));
        let frame = egui::Frame::NONE.fill(theme::palette(ui.visuals()).canvas);
        egui::CentralPanel::default().frame(frame).show(ui, |ui| match view.workspace {
            Workspace::Frames => panels::frames::show(ui, scene, &mut view.frames, &mut view.focus, commands),
            Workspace::Forces => panels::forces::show(ui, scene, &mut view.forces, &mut view.focus, commands),
        });
    }

    fn run_commands(&mut self, ctx: &egui::Context) {
        for command in std::mem::take(&mut self.commands) {
            match command {
                Command::Do(Action::Undo) => _ = self.history.undo(),
                Command::Do(Action::Redo) => _ = self.history.redo(),
                Command::Do(Action::WorkspaceFrames) => self.view.workspace = Workspace::Frames,
                Command::Do(Action::WorkspaceForces) => self.view.workspace = Workspace::Forces,
                Command::Do(Action::Dark) => ctx.set_theme(egui::Theme::Dark),
                Command::Do(Action::Light) => ctx.set_theme(egui::Theme::Light),
                Command::Select(point) => self.view.focus.selected = point,
                Command::Edit(edit) => _ = self.history.apply(&edit),
                _ => {}
            }
        }
        self.resolve(ctx);
    }

    /// Runs the chain when the project has changed, and shows the result in this same frame.
    fn resolve(&mut self, ctx: &egui::Context) {
        if self.solved_revision == self.history.revision() {
            return;
        }
        self.solved_revision = self.history.revision();
        self.outcome = (self.solve)(self.history.project(), &self.face, image_size_px(self.history.project()));
        ctx.request_discard("the project changed");
    }

    /// "Anna, brow raise •": the name of the project, and whether something is unsaved.
    pub fn title(&self) -> String {
        let name = if self.project().name.is_empty() { "Untitled" } else { &self.project().name };
        if self.unsaved() { format!("{name} •") } else { name.to_owned() }
    }
}

/// Size of the first frame, px.
fn image_size_px(project: &Project) -> [u32; 2] {
    project.frames.first.as_ref().map_or(SIZE_WITHOUT_FRAMES_PX, |f| [f.width_px, f.height_px])
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.frame(ui);
    }
}
