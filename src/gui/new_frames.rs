//! Pictures that a person has chosen: they become frames of the project, or of a new one where marks of other pictures are in the way.

use std::path::PathBuf;

use super::app::App;
use super::command::After;
use super::jobs::About;
use super::modal::Modal;
use super::pictures::Source;
use super::view_state::NoticeKind;
use super::{Command, pictures};
use crate::frames::Frame;
use crate::project::{Edit, FrameRef, Project, Which, paths, sample};

/// A picture that is not the one that was marked; what becomes of the marks is asked.
#[derive(Clone, Debug, PartialEq)]
pub struct NewFrame {
    /// Which frame it is to be.
    pub which: Which,
    /// Its file.
    pub path: PathBuf,
    /// What the project would call it.
    pub named: FrameRef,
}

impl App {
    /// Takes a picture that a person has chosen: at once, or, where marks were made on another one, after asking.
    pub(super) fn frame_chosen(&mut self, which: Which, source: Source, frame: Frame, ctx: &egui::Context) {
        // Nobody has marked anything yet who looks at the sample and opens pictures of their own.
        if self.is_untouched_sample() && sample_has_not(frame.sha256()) {
            self.open_document(Project::default(), None);
            let text = "A new project with your own pictures. The sample is under File, Open sample.";
            self.tell(NoticeKind::Done, text.to_owned(), ctx);
        }
        let path = match paths::to_text(self.document.path.as_deref(), source.path()) {
            Ok(text) => text,
            Err(e) => return self.fail("The frame cannot be used", e.to_string()),
        };
        let sha256 = frame.sha256().to_owned();
        let named = FrameRef { path, sha256, width_px: frame.width(), height_px: frame.height() };
        if !self.waiting_frames.is_empty() || marks_are_of_another(self.project(), which, &named) {
            let path = source.path().to_owned();
            self.waiting_frames.push(NewFrame { which, path, named });
            return;
        }
        self.pictures.frame_read(which, source, Ok(frame));
        self.edit(&Edit::SetFrame(which, Some(named)), ctx);
        self.frames_are_open(which, ctx);
    }

    /// Asks what becomes of the marks, once all pictures that were chosen together are read.
    pub(super) fn ask_about_waiting_frames(&mut self) {
        let reading = self.jobs.running().iter().any(|j| matches!(j.about, About::Picture(_)));
        if !self.waiting_frames.is_empty() && !reading && self.view.modal.is_none() {
            self.view.modal = Some(Modal::OtherFrames(std::mem::take(&mut self.waiting_frames)));
        }
    }

    /// The marks stay and are taken for marks of these pictures: one step.
    pub(super) fn keep_marks(&mut self, frames: Vec<NewFrame>, ctx: &egui::Context) {
        let Some(which) = frames.last().map(|f| f.which) else { return };
        let edits = frames.into_iter().map(|f| Edit::SetFrame(f.which, Some(f.named)));
        self.commands.push(Command::Edits(edits.collect()));
        self.frames_are_open(which, ctx);
    }

    /// A new project of these pictures, once what is unsaved is saved or given up.
    pub(super) fn new_project_with(&mut self, frames: Vec<NewFrame>, ctx: &egui::Context) {
        let frames = frames.into_iter().map(|f| (f.which, f.path)).collect();
        self.unless_unsaved(After::NewWith(frames), ctx);
    }

    /// Reads pictures for the project that was just begun.
    pub(super) fn begin_with(&mut self, frames: Vec<(Which, PathBuf)>, ctx: &egui::Context) {
        self.open_document(Project::default(), None);
        for (which, path) in frames {
            pictures::read(which, Source::File(path), true, ctx, &mut self.jobs);
        }
    }

    fn frames_are_open(&mut self, which: Which, ctx: &egui::Context) {
        self.view.frames.fit();
        let frames = &self.project().frames;
        let text = if frames.first.is_some() && frames.last.is_some() {
            "The first and the last frame are open.".to_owned()
        } else {
            format!("The {} frame is open.", which.word())
        };
        self.tell(NoticeKind::Done, text, ctx);
    }

    fn is_untouched_sample(&self) -> bool {
        self.document.path.is_none() && sample::project().is_ok_and(|s| &s == self.project())
    }
}

fn sample_has_not(sha256: &str) -> bool {
    let frame = FrameRef { path: String::new(), sha256: sha256.to_owned(), width_px: 0, height_px: 0 };
    sample::frame_bytes(&frame).is_none()
}

/// Whether the project has marks on that frame, made on another picture than this one.
fn marks_are_of_another(project: &Project, which: Which, named: &FrameRef) -> bool {
    let (before, marked) = match which {
        Which::First => {
            let features = project.features.values().any(|f| f.first.is_some());
            (&project.frames.first, features || !project.landmarks.is_empty())
        }
        Which::Last => (&project.frames.last, project.features.values().any(|f| f.last.is_some())),
    };
    marked && before.as_ref().is_some_and(|b| !b.sha256.eq_ignore_ascii_case(&named.sha256))
}
