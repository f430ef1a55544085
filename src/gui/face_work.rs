//! The face model that is being made: read, bound, checked, saved and given to the project.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::action::Action;
use super::app::App;
use super::command::After;
use super::dialogs::Purpose;
use super::face_drawing::FaceDrawing;
use super::jobs::{About, Finished};
use super::modal::Modal;
use super::pictures::file_name;
use super::view_state::NoticeKind;
use crate::customize::transfer;
use crate::draw::words::capital;
use crate::face::check::{self, Report};
use crate::face::draft::{Bindings, DraftEdit, FaceDraft};
use crate::face::import::{self, ImportOptions, Keep};
use crate::face::{self, FaceModel};
use crate::frames::Frame;
use crate::project::{Edit, FaceSource, paths};

/// Largest mesh file that is read, bytes: an ASCII scan of several million vertices.
const MAX_MESH_BYTES: u64 = 1 << 30;

/// A face with so many vertices or fewer is checked at once; a larger one in the background.
const CHECKED_AT_ONCE: usize = 5000;

/// The face model in the workspace of the face.
#[derive(Default)]
pub struct FaceWork {
    open: Option<OpenFace>,
    /// Counts the faces opened, so that an answer about another one is known for late.
    number: u64,
    checking: bool,
}

/// A face that is open.
pub struct OpenFace {
    /// The face, as far as it is made.
    pub draft: FaceDraft,
    /// It, ready for drawing.
    pub drawing: FaceDrawing,
    /// Its file, if it has one.
    pub path: Option<PathBuf>,
    /// What the import of the mesh changed or guessed.
    pub notes: Vec<String>,
    /// What is to be said of a transfer from the generic face.
    pub proposed: Vec<String>,
    /// What the check of it says, with the revision that was checked.
    pub report: Option<(u64, Report)>,
}

/// A face read in the background.
pub struct FaceRead {
    draft: FaceDraft,
    drawing: FaceDrawing,
    path: Option<PathBuf>,
    notes: Vec<String>,
}

impl std::fmt::Debug for FaceRead {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FaceRead").field("path", &self.path).finish_non_exhaustive()
    }
}

impl FaceWork {
    /// The face that is open.
    pub fn open(&self) -> Option<&OpenFace> {
        self.open.as_ref()
    }

    /// Whether something of it would be lost with the window.
    pub fn unsaved(&self) -> bool {
        self.open.as_ref().is_some_and(|o| o.draft.unsaved())
    }

    /// Shows a face; it is ready at once.
    pub(super) fn show(&mut self, face: &FaceModel, path: Option<PathBuf>) {
        self.take(FaceRead::new(face, path, Vec::new()));
    }

    fn take(&mut self, FaceRead { draft, drawing, path, notes }: FaceRead) {
        self.number += 1;
        self.open = Some(OpenFace { draft, drawing, path, notes, proposed: Vec::new(), report: None });
    }
}

impl FaceRead {
    fn new(face: &FaceModel, path: Option<PathBuf>, notes: Vec<String>) -> Self {
        let standard = Bindings::of(&face::generic());
        Self { draft: FaceDraft::of(face, &standard), drawing: FaceDrawing::new(face.mesh()), path, notes }
    }
}

/// Reads a mesh of another program, or a face model file, as a face to be made.
///
/// # Errors
/// One line: the file, the place, the reason.
pub fn read(path: &Path, keep: Keep) -> Result<FaceRead, String> {
    let name = file_name(path);
    if import::Format::of(&[], &name).is_none() && !name.to_lowercase().ends_with(".ply") {
        let face = face::file::read(path).map_err(|e| e.to_string())?;
        return Ok(FaceRead::new(&face, Some(path.to_owned()), Vec::new()));
    }
    let refused = |why: String| format!("{}: {why}", path.display());
    let mut bytes = Vec::new();
    let file =
        File::open(path).map_err(|e| refused(format!("cannot be read ({e}); check the path and its permissions")))?;
    let read = file.take(MAX_MESH_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|e| refused(format!("cannot be read ({e}); check the path and its permissions")))?;
    if bytes.len() as u64 > MAX_MESH_BYTES {
        return Err(refused(format!("is larger than {} MB; reduce the mesh first", MAX_MESH_BYTES >> 20)));
    }
    let options = ImportOptions { keep, ..ImportOptions::default() };
    let imported = import::read(&bytes, &name, &options).map_err(|e| refused(e.to_string()))?;
    let notes = imported.repairs.iter().map(ToString::to_string).collect();
    let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
    let face = imported.into_face(stem).map_err(|e| refused(e.to_string()))?;
    Ok(FaceRead::new(&face, None, notes))
}

/// What the transfer from the generic face proposes.
pub struct FaceProposal {
    face: FaceModel,
    drawing: FaceDrawing,
    notes: Vec<String>,
}

impl std::fmt::Debug for FaceProposal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FaceProposal").field("notes", &self.notes).finish_non_exhaustive()
    }
}

/// A landmark proposed with less confidence is named as one to look at.
const DOUBTFUL: f64 = 0.5;

/// Lays the generic face on the draft's mesh; landmarks that are bound already are held where they are.
fn proposal(draft: &FaceDraft) -> Result<FaceProposal, String> {
    let generic = face::generic();
    let bindings = draft.bindings();
    let known: Vec<(String, u32)> =
        bindings.landmarks.iter().filter_map(|l| Some((l.landmark.id.clone(), l.vertex?))).collect();
    let found = transfer::propose(&generic, draft.mesh(), &bindings.name, &known).map_err(|e| e.to_string())?;
    let name = |id: &str| generic.landmark(id).map_or_else(|| id.to_owned(), |l| l.name.clone());
    let mut notes =
        vec![format!("The generic face lies within {:.1} mm (root mean square) of this mesh.", found.rms_mm)];
    let list = |of: &dyn Fn(&transfer::Proposed) -> bool| -> Vec<String> {
        found.landmarks.iter().filter(|l| of(l)).map(|l| name(&l.id)).collect()
    };
    let doubtful = list(&|l| l.vertex.is_some() && l.confidence < DOUBTFUL);
    if !doubtful.is_empty() {
        notes.push(format!("Look at these, which are in doubt: {}.", doubtful.join(", ")));
    }
    let missing = list(&|l| l.vertex.is_none());
    if !missing.is_empty() {
        notes.push(format!("The mesh does not reach these: {}.", missing.join(", ")));
    }
    if !found.muscles_left_out.is_empty() {
        notes.push(format!("These muscles have no place on it: {}.", found.muscles_left_out.join(", ")));
    }
    Ok(FaceProposal { drawing: FaceDrawing::new(found.face.mesh()), face: found.face, notes })
}

impl App {
    fn propose_face(&mut self, ctx: &egui::Context) {
        let Some(open) = &self.face_work.open else { return };
        let (number, draft) = (self.face_work.number, open.draft.clone());
        self.jobs.start(ctx, "Laying the generic face on the mesh", About::Person, move |_| {
            Some(Finished::Proposed(number, Box::new(proposal(&draft))))
        });
    }

    pub(super) fn face_proposed(&mut self, number: u64, proposed: Result<FaceProposal, String>, ctx: &egui::Context) {
        let Some(open) = self.face_work.open.as_mut().filter(|_| self.face_work.number == number) else { return };
        let taken = proposed.and_then(|FaceProposal { face, drawing, notes }| {
            open.draft.take_proposal(&face, &Bindings::of(&face::generic()))?;
            (open.drawing, open.proposed) = (drawing, notes);
            Ok(())
        });
        match taken {
            Ok(()) => {
                let [landmarks, muscles] = open.draft.bindings().bound();
                let text = format!(
                    "{landmarks} landmarks and {muscles} muscles are proposed; look at each, undo takes them back."
                );
                self.tell(NoticeKind::Done, text, ctx);
            }
            Err(why) => self.fail("Nothing can be proposed", why),
        }
    }

    /// What an action means while the workspace of the face is shown; false when it means nothing special there.
    pub(super) fn act_on_face(&mut self, action: Action, ctx: &egui::Context) -> bool {
        let view = &mut self.view.face;
        let Some(open) = &mut self.face_work.open else { return false };
        match action {
            Action::Undo => _ = open.draft.undo(),
            Action::Redo => _ = open.draft.redo(),
            Action::Save => self.save_face(None, ctx),
            Action::Next | Action::Previous => view.step(open.draft.bindings(), action == Action::Next),
            Action::ClearMark => {
                if let Some(slot) = view.selected {
                    let mirrored = view.mirrored;
                    self.edit_face(&DraftEdit::Bind { slot, vertex: None, mirrored }, ctx);
                }
            }
            _ => return view.act(action),
        }
        true
    }

    /// Does what the menu of the face names.
    pub(super) fn act_in_face_menu(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::OpenMesh => self.unless_face_unsaved(After::AskMesh, ctx),
            Action::OpenFace => self.unless_face_unsaved(After::AskFace, ctx),
            Action::SaveFace => self.save_face(None, ctx),
            Action::SaveFaceAs => self.ask_where_to_save_face(None, ctx),
            Action::TransferFace => self.propose_face(ctx),
            Action::UseFace => self.use_face(ctx),
            Action::UseGeneric => self.set_face_of_project(FaceSource::Generic, &face::generic(), ctx),
            _ => {}
        }
    }

    /// Shows the face of the project when the workspace is first entered, or while nothing of its own has been opened there.
    pub(super) fn enter_face(&mut self) {
        if self.face_work.open.is_none() {
            let path = match (&self.project().face, &self.document.path) {
                (FaceSource::File { path, .. }, Some(project)) => Some(paths::resolve_text(project, path)),
                (FaceSource::File { path, .. }, None) => Some(path.into()),
                (FaceSource::Generic, _) => None,
            };
            let face = Arc::clone(&self.face);
            self.face_work.show(&face, path);
        }
    }

    pub(super) fn edit_face(&mut self, edit: &DraftEdit, ctx: &egui::Context) {
        if let Some(open) = &mut self.face_work.open
            && let Err(why) = open.draft.apply(edit)
        {
            self.tell(NoticeKind::Refused, capital(&why), ctx);
        }
    }

    /// Does it, or asks first what becomes of a face that is not saved.
    pub(super) fn unless_face_unsaved(&mut self, after: After, ctx: &egui::Context) {
        if self.face_work.unsaved() {
            self.view.modal = Some(Modal::UnsavedFace(after));
        } else {
            self.proceed(after, ctx);
        }
    }

    /// Gives up the changes of the face.
    pub(super) fn drop_face(&mut self) {
        self.face_work.open = None;
        self.enter_face();
    }

    /// Reads a mesh or a face model in the background.
    pub(super) fn read_face(&mut self, path: PathBuf, ctx: &egui::Context) {
        let keep = self.view.face.keep;
        self.jobs.start(ctx, format!("Reading {}", file_name(&path)), About::Person, move |_| {
            Some(Finished::Face(Box::new(read(&path, keep))))
        });
    }

    pub(super) fn face_read(&mut self, read: Result<FaceRead, String>, ctx: &egui::Context) {
        match read {
            Ok(read) => {
                let count = read.draft.mesh().len();
                self.face_work.take(read);
                self.view.face.begin();
                self.view.workspace = super::Workspace::Face;
                self.tell(NoticeKind::Done, format!("A face of {count} vertices is open."), ctx);
            }
            Err(why) => self.fail("The face cannot be opened", why),
        }
    }

    /// Checks the face when it has changed since the last check.
    pub(super) fn check_face(&mut self, ctx: &egui::Context) {
        let number = self.face_work.number;
        let Some(open) = &mut self.face_work.open else { return };
        let revision = open.draft.revision();
        if self.face_work.checking || open.report.as_ref().is_some_and(|(checked, _)| *checked == revision) {
            return;
        }
        let draft = open.draft.clone();
        if draft.mesh().len() <= CHECKED_AT_ONCE {
            open.report = Some((revision, report_of(&draft)));
            ctx.request_repaint();
            return;
        }
        self.face_work.checking = true;
        self.jobs.start(ctx, "Checking the face", About::Person, move |_| {
            Some(Finished::FaceChecked { number, revision, report: report_of(&draft) })
        });
    }

    pub(super) fn face_checked(&mut self, number: u64, revision: u64, report: Report) {
        self.face_work.checking = false;
        if let Some(open) = self.face_work.open.as_mut().filter(|_| self.face_work.number == number) {
            open.report = Some((revision, report));
        }
    }

    /// Saves the face where its file lies, or asks where; then does what waits.
    pub(super) fn save_face(&mut self, then: Option<After>, ctx: &egui::Context) {
        match self.face_work.open.as_ref().and_then(|o| o.path.clone()) {
            Some(path) => self.save_face_to(path, then, ctx),
            None => self.ask_where_to_save_face(then, ctx),
        }
    }

    fn ask_where_to_save_face(&mut self, then: Option<After>, ctx: &egui::Context) {
        let Some(open) = &self.face_work.open else { return };
        let name = match open.draft.bindings().name.trim() {
            "" => "face",
            name => name,
        };
        let suggested = format!("{}.face.json", name.replace(['/', '\\', ':'], "-"));
        self.dialogs.ask(ctx, Purpose::SaveFace { suggested, then });
    }

    pub(super) fn save_face_to(&mut self, mut path: PathBuf, then: Option<After>, ctx: &egui::Context) {
        let Some(open) = &mut self.face_work.open else { return };
        if path.extension().is_none() {
            path.set_extension("face.json");
        }
        let face = match open.draft.to_face() {
            Ok(face) => face,
            Err(e) => return self.fail("The face was not saved", e.to_string()),
        };
        // What cannot be read as a face might be somebody's work.
        if path.exists() && face::file::read(&path).is_err() {
            let why =
                "holds something that is not a readable face model and is not overwritten; save under another name";
            return self.fail("The face was not saved", format!("{}: {why}", path.display()));
        }
        if let Err(e) = face::file::write(&face, &path) {
            return self.fail("The face was not saved", e.to_string());
        }
        open.draft.mark_saved();
        open.path = Some(path.clone());
        let [landmarks, muscles] = open.draft.bindings().bound();
        let text = format!("Saved to {}, with {landmarks} landmarks and {muscles} muscles.", path.display());
        self.tell(NoticeKind::Done, text, ctx);
        if let Some(after) = then {
            self.commands.push(super::Command::Proceed(after));
        }
    }

    /// Gives the face to the project; it is saved first where it is not.
    pub(super) fn use_face(&mut self, ctx: &egui::Context) {
        let Some(open) = &self.face_work.open else { return };
        let Some(path) = open.path.clone().filter(|p| !open.draft.unsaved() && p.exists()) else {
            return self.save_face(Some(After::UseFace), ctx);
        };
        let used = Frame::sha256_of(&path).map_err(|e| e.to_string()).and_then(|sha256| {
            let text = paths::to_text(self.document.path.as_deref(), &path).map_err(|e| e.to_string())?;
            let face = face::file::read(&path).map_err(|e| e.to_string())?;
            Ok((FaceSource::File { path: text, sha256 }, face))
        });
        match used {
            Ok((source, face)) => self.set_face_of_project(source, &Arc::new(face), ctx),
            Err(why) => self.fail("The face cannot be used", why),
        }
    }

    fn set_face_of_project(&mut self, source: FaceSource, face: &Arc<FaceModel>, ctx: &egui::Context) {
        let landmark_ids: Vec<String> = face.landmarks().iter().map(|l| l.id.clone()).collect();
        // A feature point is a vertex: on another mesh its number means another place.
        let same_mesh = face.mesh() == self.face.mesh();
        let vertices = if same_mesh { face.mesh().len() as u32 } else { 0 };
        let lost = if same_mesh { 0 } else { self.project().features.len() };
        let lost_landmarks = self.project().landmarks.keys().filter(|id| !landmark_ids.contains(id)).count();
        self.remember_face(&source, face);
        self.edit(&Edit::SetFace { source, landmark_ids, vertices }, ctx);
        let lost = match lost + lost_landmarks {
            0 => String::new(),
            n => format!(" {n} marks that it has no place for were removed; undo brings them back."),
        };
        self.tell(NoticeKind::Done, format!("The project uses the face {}.{lost}", face.name()), ctx);
    }
}

/// What the check says of a face as far as it is made, after what is still missing.
fn report_of(draft: &FaceDraft) -> Report {
    use check::{Finding, Severity};
    let finding = |severity, what: String| Finding { severity, what, where_: String::new() };
    let bindings = draft.bindings();
    let [landmarks, muscles] = bindings.bound();
    let mut findings = Vec::new();
    for (bound, of, what) in
        [(landmarks, bindings.landmarks.len(), "landmarks"), (muscles, bindings.muscles.len(), "muscles")]
    {
        let severity = if bound == of { Severity::Passed } else { Severity::Warning };
        findings.push(finding(severity, format!("{bound} of {of} {what} bound")));
    }
    let mut at: std::collections::BTreeMap<u32, &str> = std::collections::BTreeMap::new();
    for l in &bindings.landmarks {
        if let Some(v) = l.vertex
            && let Some(other) = at.insert(v, &l.landmark.name)
        {
            findings.push(finding(Severity::Failed, format!("{other} and {} share vertex {v}", l.landmark.name)));
        }
    }
    match draft.to_face() {
        Ok(face) => findings.extend(check::check(&face).findings),
        Err(e) => findings.push(finding(Severity::Failed, e.to_string())),
    }
    Report { findings }
}
