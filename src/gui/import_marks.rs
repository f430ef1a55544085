//! Marks read from a file of another program or project: shown as suggestions, or all accepted at once, after the person has said which.

use std::path::PathBuf;
use std::sync::Arc;

use super::app::App;
use super::jobs::{About, Finished};
use super::modal::Modal;
use super::pictures::file_name;
use super::view_state::NoticeKind;
use super::{Action, Command};
use crate::import::{self, Import};
use crate::suggest::Suggestion;

/// Marks that were read, until the person has said what becomes of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadMarks {
    /// Name of the file.
    pub name: String,
    /// Its points.
    pub import: Import,
}

impl App {
    /// Reads a file of marks, in the background.
    pub(super) fn import_marks(&mut self, path: PathBuf, ctx: &egui::Context) {
        let (project, face) = (self.project().clone(), Arc::clone(&self.face));
        let name = file_name(&path);
        self.jobs.start(ctx, format!("Reading {name}"), About::Person, move |progress| {
            let read = import::read(&path, &project, &face);
            let read = read.map(|import| ReadMarks { name, import }).map_err(|e| e.to_string());
            (!progress.is_cancelled()).then_some(Finished::Marks(read))
        });
    }

    /// Asks what becomes of marks that were read.
    pub(super) fn marks_read(&mut self, read: Result<ReadMarks, String>) {
        match read {
            Ok(read) => self.view.modal = Some(Modal::Marks(read)),
            Err(why) => self.fail("The marks cannot be read", why),
        }
    }

    /// Takes the points as suggestions (those of the last frame), or as marks, in one step.
    pub(super) fn take_marks(&mut self, read: &ReadMarks, accept: bool, ctx: &egui::Context) {
        let text = if accept {
            let edits = read.import.accept(self.project());
            let count = read.import.new_points(self.project()).count();
            self.commands.push(Command::Edits(edits));
            format!("{count} points of {} are marks now. Undo takes all of them back.", read.name)
        } else {
            self.suggesting.import(read.import.points.iter().filter_map(import::Imported::suggestion));
            // Of a point that has its mark nothing is suggested.
            let open = |s: &Suggestion| self.project().features.get(&s.vertex).is_none_or(|f| f.last.is_none());
            let count = read.import.points.iter().filter_map(import::Imported::suggestion).filter(open).count();
            let key = |action| self.keys.text(action).unwrap_or_else(|| action.label().to_owned());
            let (one, all) = (key(Action::Accept), key(Action::AcceptSure));
            format!("{count} points of {} are suggested now. {one} accepts one, {all} all that are sure.", read.name)
        };
        self.tell(NoticeKind::Done, text, ctx);
    }
}
