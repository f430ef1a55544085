//! The one place that acts: runs what the panels have asked for.

use std::sync::Arc;

use super::action::Action;
use super::app::App;
use super::command::After;
use super::dialogs::{Answer, Purpose};
use super::jobs::{About, Finished, Written};
use super::keys::KeyMap;
use super::modal::Modal;
use super::panels::frames::{SideTab, Tool, toolbar};
use super::panels::key_settings::KeysView;
use super::panels::palette::PaletteView;
use super::pictures::Source;
use super::view_state::{Notice, NoticeKind, Workspace};
use super::{Command, keys, pictures};
use crate::draw::words::capital;
use crate::frames::Adjustment;
use crate::project::{Edit, FrameRef, MarkState, Role, paths};

/// How long a notice stays in the status bar, s.
const NOTICE_S: f64 = 6.0;

impl App {
    /// Runs everything asked for in this frame, then the chain.
    pub(super) fn run_commands(&mut self, ctx: &egui::Context) {
        if let Some((purpose, answer)) = self.dialogs.poll() {
            self.answer(purpose, answer);
        }
        // A command may ask for others.
        while !self.commands.is_empty() {
            for command in std::mem::take(&mut self.commands) {
                self.run(command, ctx);
            }
        }
        if self.document.nudging && !self.nudge_key_is_down(ctx) {
            self.document.nudging = false;
            self.document.history.commit_gesture();
        }
        self.resolve(ctx);
        self.write_journal();
        if self.view.notice.as_ref().is_some_and(|n| n.until < ctx.input(|i| i.time)) {
            self.view.notice = None;
        }
    }

    fn run(&mut self, command: Command, ctx: &egui::Context) {
        match command {
            Command::Do(action) => self.act(action, ctx),
            Command::Edit(edit) => self.edit(&edit, ctx),
            Command::Edits(edits) => {
                self.document.history.begin_gesture();
                for edit in &edits {
                    self.edit(edit, ctx);
                }
                self.document.history.commit_gesture();
            }
            Command::BeginGesture => self.document.history.begin_gesture(),
            Command::CommitGesture => self.document.history.commit_gesture(),
            Command::CancelGesture => self.document.history.cancel_gesture(),
            Command::Select(point) => self.select(point),
            Command::JumpTo(point) => self.jump_to(point),
            Command::NextAgain => self.next_again(ctx),
            Command::EndGuide => self.end_guide(ctx),
            Command::GoToStep(step) => self.in_step_with_guide(|app| app.document.history.go_to(step)),
            Command::AskFiles(purpose) => self.dialogs.ask(ctx, purpose),
            Command::FilesChosen(purpose, files) => self.files_chosen(&purpose, files, ctx),
            Command::Typed(purpose, typed) => self.view.typed = Some((purpose, typed)),
            Command::NewProjectWith(frames) => self.new_project_with(frames, ctx),
            Command::KeepMarks(frames) => self.keep_marks(frames, ctx),
            Command::LoadFrame(which, path) => pictures::read(which, Source::File(path), true, ctx, &mut self.jobs),
            Command::TakeMarks(read, accept) => self.take_marks(&read, accept, ctx),
            Command::UseFilmFrames(looking, frames) => self.use_film_frames(&looking, frames, ctx),
            Command::Dropped(paths, over) => self.dropped(paths, over, ctx),
            Command::BindKeys(of, keys) => self.change_keys(|map| map.set(of, keys), ctx),
            Command::ResetKeys => self.change_keys(KeyMap::reset, ctx),
            Command::Show(modal) => self.view.modal = Some(modal),
            Command::CloseModal => self.view.modal = None,
            Command::Proceed(after) => self.proceed(after, ctx),
            Command::SaveThen(after) => self.save(Some(after), ctx),
            Command::Recover(take) => self.recover(take),
            Command::EditFace(edit) => self.edit_face(&edit, ctx),
            Command::SaveFaceThen(after) => self.save_face(Some(after), ctx),
            Command::DropFace(after) => {
                self.drop_face();
                self.proceed(after, ctx);
            }
            Command::Rescue(path, which) => self.rescue(&path, which),
            Command::OpenRecent(path) => self.unless_unsaved(After::Open(path), ctx),
            Command::ForgetRecent => self.recent.clear(),
            Command::Tell(kind, text) => self.tell(kind, text, ctx),
            Command::CancelJob(id) => {
                self.stop(id);
            }
            Command::BuildLadder => self.build_ladder(ctx),
            Command::RemoveSubject(id) => self.remove_subject(id),
            Command::TrySubjects => self.try_subjects_again(),
        }
    }

    /// Changes keys, here and for the windows to come.
    fn change_keys(&mut self, change: impl FnOnce(&mut KeyMap), ctx: &egui::Context) {
        change(Arc::make_mut(&mut self.keys));
        keys::install(ctx, &self.keys);
        if let Some(folder) = &self.state_folder
            && let Err(why) = self.keys.write(folder)
        {
            self.tell(NoticeKind::Refused, format!("The keys hold for this window only. {why}"), ctx);
        }
    }

    /// Stops a long work, and what waits for it.
    fn stop(&mut self, id: u64) {
        if let Some(about) = self.jobs.cancel(id) {
            self.give_up(about);
        }
    }

    /// Lets go of what waits for a work that brings nothing back.
    fn give_up(&mut self, about: About) {
        match about {
            About::Picture(which) => {
                self.view.frames.panes[which as usize].adjustment = self.pictures.stopped(which);
            }
            About::Preparation(which) => {
                let sha256 = self.pictures.get(which).source().map(|(_, sha256)| sha256.to_owned());
                self.suggesting.preparation_stopped(which, &sha256.unwrap_or_default());
            }
            About::Suggestions => {
                self.suggesting.stopped();
                self.view.frames.suggest.on = false;
            }
            About::Field => self.field_stopped(),
            About::Muscles => self.muscles_stopped(),
            About::Subjects => self.subjects_stopped(),
            About::Replay => self.replay_stopped(),
            About::Expressions => self.stage_stopped(),
            About::Study => self.study_stopped(),
            About::Skin | About::Person => {}
        }
    }

    pub(super) fn edit(&mut self, edit: &Edit, ctx: &egui::Context) {
        if let Err(e) = self.document.history.apply(edit) {
            self.tell(NoticeKind::Refused, capital(&e.to_string()), ctx);
        }
    }

    /// Says something in the status bar.
    pub(super) fn tell(&mut self, kind: NoticeKind, text: String, ctx: &egui::Context) {
        let until = ctx.input(|i| i.time) + NOTICE_S;
        self.view.notice = Some(Notice { kind, text, until });
        ctx.request_repaint_after_secs(NOTICE_S as f32);
    }

    /// Says in a dialog what could not be done.
    pub(super) fn fail(&mut self, title: &str, text: String) {
        // What was typed comes back to be mended; of several errors only the first finds it.
        let typed = self.view.typed.take();
        let typed = typed.map(|(purpose, typed)| Box::new(Modal::Path { purpose, typed, focused: false }));
        let again = typed.or_else(|| match self.view.modal.take() {
            Some(Modal::Error { again, .. }) => again,
            _ => None,
        });
        self.view.modal = Some(Modal::Error { title: title.to_owned(), text, again });
    }

    fn act(&mut self, action: Action, ctx: &egui::Context) {
        if self.view.workspace == Workspace::Forces && self.view.forces.act(action) {
            return;
        }
        if self.view.workspace == Workspace::Muscles && self.view.muscles.act(action) {
            return;
        }
        if self.view.workspace == Workspace::Expressions && self.view.expressions.act(action) {
            return;
        }
        if self.view.workspace == Workspace::Study && self.view.study.act(action) {
            return;
        }
        if self.view.workspace == Workspace::Face && self.act_on_face(action, ctx) {
            return;
        }
        let frames = &mut self.view.frames;
        match action {
            Action::OpenMesh
            | Action::OpenFace
            | Action::SaveFace
            | Action::SaveFaceAs
            | Action::TransferFace
            | Action::UseFace
            | Action::UseGeneric => self.act_in_face_menu(action, ctx),
            Action::WorkspaceExpressions => self.view.workspace = Workspace::Expressions,
            Action::Preset(_)
            | Action::PlayPause
            | Action::StepOnce
            | Action::ResetPlay
            | Action::Settle
            | Action::FromFit
            | Action::ClearExpression
            | Action::OpenExpression
            | Action::SaveExpression
            | Action::ExportExpression => self.act_on_expression(action, ctx),
            Action::WorkspaceStudy => self.view.workspace = Workspace::Study,
            Action::StartStudy => self.start_study(false, ctx),
            Action::StartStudyAnew => self.start_study(true, ctx),
            Action::StopStudy => self.stop_study(),
            Action::OpenStudy => self.dialogs.ask(ctx, Purpose::OpenStudy),
            Action::ExportStudy => self.dialogs.ask(ctx, Purpose::StudyFolder),
            Action::ApplyStudy => self.apply_study(ctx),
            Action::WorkspaceFace => self.view.workspace = Workspace::Face,
            Action::WorkspaceMuscles => self.view.workspace = Workspace::Muscles,
            Action::New => self.unless_unsaved(After::New, ctx),
            Action::Open => self.unless_unsaved(After::AskOpen, ctx),
            Action::OpenSample => self.unless_unsaved(After::Sample, ctx),
            Action::Quit => self.unless_unsaved(After::Quit, ctx),
            Action::Save => self.save(None, ctx),
            Action::SaveAs => self.ask_where_to_save(None, ctx),
            Action::OpenFrames => self.dialogs.ask(ctx, Purpose::Frames),
            Action::OpenFilm => self.dialogs.ask(ctx, Purpose::Film),
            Action::OpenFolder => self.dialogs.ask(ctx, Purpose::FrameFolder),
            Action::ImportMarks => self.dialogs.ask(ctx, Purpose::Marks),
            Action::OtherSubjects => self.ask_for_subjects(ctx),
            Action::Export => self.dialogs.ask(ctx, Purpose::ExportFolder),
            Action::Undo => self.in_step_with_guide(|app| _ = app.document.history.undo()),
            Action::Redo => self.in_step_with_guide(|app| _ = app.document.history.redo()),
            Action::ShowHistory => {
                frames.side = if frames.side == SideTab::History { SideTab::Guide } else { SideTab::History };
                self.view.workspace = Workspace::Frames;
            }
            Action::Palette => self.view.palette = Some(PaletteView::default()),
            Action::WorkspaceFrames => self.view.workspace = Workspace::Frames,
            Action::WorkspaceForces => self.view.workspace = Workspace::Forces,
            Action::Fit => frames.fit(),
            Action::ZoomIn | Action::ZoomOut => {
                let factor = if action == Action::ZoomIn { 1.25 } else { 0.8 };
                let at = frames.panes[frames.active as usize].rect.center();
                frames.zoom(frames.active, factor, at);
            }
            Action::LinkPanes => frames.linked = !frames.linked,
            Action::MatchPanes => {
                let from = frames.panes[frames.active as usize].view;
                for pane in &mut frames.panes {
                    pane.view = from;
                }
            }
            Action::Blink => frames.swapped = !frames.swapped,
            Action::HideMarks => frames.show_marks = !frames.show_marks,
            Action::ShowNames => frames.show_names = !frames.show_names,
            Action::ShowWireframe => frames.toggle_wireframe(),
            Action::ShowReplay => frames.replay.on = !frames.replay.on,
            Action::RegionOnly => frames.wireframe.region_only = !frames.wireframe.region_only,
            Action::LoupeAlways => frames.loupe.always = !frames.loupe.always,
            Action::Clahe => {
                let clahe = &mut frames.panes[frames.active as usize].adjustment.clahe;
                *clahe = if clahe.is_some() { None } else { Some(toolbar::CLAHE_DEFAULT) };
            }
            Action::ResetAdjustment => {
                for pane in &mut frames.panes {
                    pane.adjustment = Adjustment::default();
                }
            }
            Action::ShowTable => frames.table_shown = !frames.table_shown,
            Action::Look(view) => {
                self.view.workspace = Workspace::Forces;
                self.view.forces.look(view);
            }
            Action::LockRange => self.view.forces.toggle_lock(),
            Action::Dark => ctx.set_theme(egui::Theme::Dark),
            Action::Light => ctx.set_theme(egui::Theme::Light),
            Action::ToolSelect => {
                frames.tool = Tool::Select;
                frames.finished = None;
            }
            Action::ToolLandmarks => self.start_tool(Tool::Landmarks),
            Action::ToolFeatures => self.start_tool(Tool::Features),
            Action::Keys => self.view.modal = Some(Modal::Keys),
            Action::SetKeys => self.view.modal = Some(Modal::SetKeys(KeysView::default())),
            Action::About => self.view.modal = Some(Modal::About),
            Action::ClearLast => self.in_step_with_guide(|app| app.edit(&Edit::ClearLast, ctx)),
            Action::Next => self.step_point(true, ctx),
            Action::Previous => self.step_point(false, ctx),
            Action::Accept => self.accept(ctx),
            Action::AcceptSure => self.accept_sure(ctx),
            Action::AcceptStill => self.accept_still(ctx),
            Action::Refine => self.refine(ctx),
            Action::Snap => frames.snap = !frames.snap,
            Action::Suggest => {
                frames.suggest.on = !frames.suggest.on;
                self.suggesting.retry();
            }
            Action::ShowDoubt | Action::NextWorth | Action::Again | Action::Compare => self.act_in_doubt(action, ctx),
            Action::ClearMark => self.on_selected(ctx, |id, _| Edit::Clear(id)),
            Action::Lock => self.toggle_state(MarkState::Locked, ctx),
            Action::Uncertain => self.toggle_uncertain(ctx),
            Action::Occluded => self.toggle_state(MarkState::Occluded, ctx),
            Action::RoleSkin => self.set_role(Role::Skin, ctx),
            Action::RoleStill => self.set_role(Role::Still, ctx),
            Action::RoleFixed => self.set_role(Role::Fixed, ctx),
            Action::Nudge(direction, step) => self.nudge(direction, step, ctx),
        }
    }

    fn answer(&mut self, purpose: Purpose, answer: Answer) {
        match answer {
            Answer::Files(files) => self.commands.push(Command::FilesChosen(purpose, files)),
            Answer::Cancelled => {}
            Answer::Unavailable => {
                let typed = match &purpose {
                    Purpose::SaveProject { suggested, .. }
                    | Purpose::SaveFace { suggested, .. }
                    | Purpose::SaveExpression { suggested } => {
                        let beside = self.document.path.as_deref().and_then(std::path::Path::parent);
                        let folder = beside.map(std::path::Path::to_owned).filter(|f| f.is_absolute());
                        let folder = folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default();
                        folder.join(suggested).display().to_string()
                    }
                    _ => String::new(),
                };
                self.view.modal = Some(Modal::Path { purpose, typed, focused: false });
            }
        }
    }

    /// Takes what long work has brought back, and starts what the pictures need.
    pub(super) fn poll_jobs(&mut self, ctx: &egui::Context) {
        self.take_answers(ctx);
        self.ask_about_waiting_frames();
        self.follow_film(ctx);
        let project = self.document.history.project();
        let path = self.document.path.clone().unwrap_or_else(|| "unnamed".into());
        let resolve = |frame: &FrameRef| paths::resolve(&path, frame);
        let wanted = [0, 1].map(|i| self.view.frames.panes[i].adjustment);
        if self.jobs.running().is_empty() && self.view.modal.is_none() && self.commands.is_empty() {
            self.view.typed = None;
        }
        self.pictures.follow(project, &resolve, wanted, ctx, &mut self.jobs);
        self.follow_suggestions(ctx);
        if self.view.workspace == Workspace::Face {
            self.enter_face();
            self.check_face(ctx);
        }
        self.resolve(ctx);
        self.follow_muscles(ctx);
        self.follow_subjects(ctx);
        self.follow_replay(ctx);
        self.follow_expressions(ctx);
        self.follow_study();
        self.follow_preview();
    }

    /// Takes what the works have brought back.
    pub(super) fn take_answers(&mut self, ctx: &egui::Context) {
        for finished in self.jobs.poll() {
            self.finish(finished, ctx);
        }
    }

    fn finish(&mut self, finished: Finished, ctx: &egui::Context) {
        match finished {
            Finished::Frame { which, source, chosen: true, result: Ok(frame) } => {
                self.frame_chosen(which, source, frame, ctx);
            }
            Finished::Frame { chosen: true, result: Err(why), .. } => self.fail("The frame cannot be read", why),
            Finished::Frame { which, source, result, .. } => self.pictures.frame_read(which, source, result),
            Finished::Adjusted { which, sha256, adjustment, result } => {
                self.pictures.adjusted(which, &sha256, adjustment, result);
            }
            Finished::Prepared(which, result) => self.suggesting.take_prepared(which, result),
            Finished::Suggested(answer) => {
                self.suggesting.take(answer);
                ctx.request_repaint();
            }
            Finished::Face(read) => self.face_read(*read, ctx),
            Finished::Proposed(number, proposed) => self.face_proposed(number, *proposed, ctx),
            Finished::FaceChecked { number, revision, report } => self.face_checked(number, revision, report),
            Finished::Solved(of, outcome) => self.solved(of, *outcome, ctx),
            Finished::Muscles(number, result) => self.muscles_found(number, result, ctx),
            Finished::Subjects(number, tried) => self.subjects_tried(number, tried, ctx),
            Finished::Replay(stamp, found) => self.replay_found(stamp, *found, ctx),
            Finished::Stage(number, result) => self.stage_ready(number, *result, ctx),
            Finished::Skin(sha256, read) => self.skin_read(&sha256, read, ctx),
            Finished::Film(looking, result) => self.film_looked_through(&looking, result),
            Finished::Marks(read) => self.marks_read(read),
            Finished::Stills(stills, result) => self.stills_written(stills, result, ctx),
            Finished::Study(result) => self.study_finished(result, ctx),
            Finished::Exported(Ok(Written { folder, without })) => {
                let place = folder.display();
                if without {
                    let why = "without the other subjects: the laws have not been tried on all of them yet";
                    self.tell(NoticeKind::Refused, format!("The results are in {place}, {why}."), ctx);
                } else {
                    self.tell(NoticeKind::Done, format!("The results are in {place}."), ctx);
                }
            }
            Finished::Exported(Err(why)) => self.fail("The results cannot be written", why),
            Finished::Died(about, what) => {
                // Work on the suggestions is not begun again by itself, to break again.
                if matches!(
                    about,
                    About::Preparation(_)
                        | About::Suggestions
                        | About::Field
                        | About::Muscles
                        | About::Subjects
                        | About::Replay
                        | About::Expressions
                        | About::Study
                ) {
                    self.give_up(about);
                }
                self.fail("Something went wrong", what);
            }
        }
    }
}
