//! Which actions can be done now, and which switches are on: what menus, toolbar, palette and guide show greyed or ticked.

use super::action::Action;
use super::face_work::FaceWork;
use super::panels::forces::Tab;
use super::panels::frames::{Tool, guide, points};
use super::study_work::StudyWork;
use super::suggesting;
use super::view_state::{ViewState, Workspace};
use super::{Scene, guided, panels};
use crate::expression::Basic;
use crate::project::{History, MarkState, PointId, Role, edit};

/// Taken once a frame.
#[derive(Clone, Debug)]
pub struct ActionState {
    undo: Option<String>,
    redo: Option<String>,
    face: bool,
    study: StudyState,
    slot: bool,
    frames: bool,
    results: bool,
    /// Whether the moving face is the project's.
    fitted_face: bool,
    export_chosen: bool,
    last_marks: bool,
    dark: bool,
    selected: Option<PointId>,
    mark: Option<MarkState>,
    /// State of the mark that *Uncertain* speaks of.
    in_doubt: Option<MarkState>,
    /// Whether *Accept* would take a place.
    acceptable: bool,
    /// How many suggestions are sure enough, and what that means.
    sure: (usize, f64),
    /// How many suggested still points move as one head.
    still: usize,
    role: Option<Role>,
    switches: Switches,
}

#[derive(Clone, Copy, Debug)]
struct StudyState {
    free: bool,
    running: bool,
    /// Whether there is a table that this program can draw.
    table: bool,
    /// Whether the method that is picked would change the project.
    applicable: bool,
}

impl StudyState {
    fn of(work: &StudyWork, scene: Scene<'_>) -> Self {
        Self {
            free: work.is_free(),
            running: work.is_running(),
            table: work.table().is_some_and(|t| t.kind.is_some() && !t.runs.is_empty()),
            applicable: work.preview().is_some_and(|p| p.applied.settings != scene.project.settings),
        }
    }
}

#[derive(Clone, Debug)]
struct Switches {
    workspace: Workspace,
    basic: Option<Basic>,
    tool: Tool,
    linked: bool,
    swapped: bool,
    marks: bool,
    names: bool,
    wireframe: bool,
    replay: bool,
    region_only: bool,
    loupe: bool,
    clahe: bool,
    table: bool,
    history: bool,
    range_locked: bool,
    suggest: bool,
    snap: bool,
    doubt: bool,
    again: bool,
    comparing: bool,
}

impl ActionState {
    /// What can be done with this project, shown like this.
    pub fn new(
        scene: Scene<'_>,
        history: &History,
        face: &FaceWork,
        study: &StudyWork,
        view: &ViewState,
        dark: bool,
    ) -> Self {
        let selected = view.focus.selected.clone();
        let state_of = |id: &PointId| edit::mark(scene.project, id).map(|m| m.state);
        let mark = selected.as_ref().and_then(state_of);
        let chosen = points::chosen_vertices(scene, &view.frames.regions);
        let asked = guide::asked(scene, &chosen, view.frames.tool, selected.as_ref()).ok().flatten();
        let role = match selected {
            Some(PointId::FeatureFirst(v) | PointId::FeatureLast(v)) => {
                Some(scene.project.features.get(&v).map_or_else(Role::default, |f| f.role))
            }
            _ => None,
        };
        let f = &view.frames;
        let least = f.suggest.least;
        let steps = match (view.workspace, face.open()) {
            (Workspace::Face, Some(open)) => open.draft.steps(),
            _ => [history.done().last(), history.undone().next()],
        };
        let [undo, redo] = steps.map(|s| s.map(str::to_owned));
        let (forces, shown) = (&view.forces, &view.face);
        Self {
            undo,
            redo,
            face: face.open().is_some(),
            study: StudyState::of(study, scene),
            slot: view.face.selected.is_some(),
            frames: scene.project.frames.first.is_some() || scene.project.frames.last.is_some(),
            fitted_face: view.expressions.base == super::expression_work::Base::Project,
            export_chosen: view.expressions.export.any(),
            results: scene.outcome.states.iter().any(|s| s.is_known()),
            last_marks: scene.project.features.values().any(|f| f.last.is_some()),
            dark,
            acceptable: suggesting::to_accept(scene, view, asked).is_some(),
            still: scene.suggested.still.points.len(),
            sure: (points::sure_suggestions(scene, &chosen, least).len(), least),
            selected,
            mark,
            in_doubt: guided::in_doubt(scene, view).as_ref().and_then(state_of),
            role,
            switches: Switches {
                workspace: view.workspace,
                basic: view.expressions.basic.filter(|_| view.workspace == Workspace::Expressions),
                tool: f.tool,
                linked: f.linked,
                swapped: f.swapped,
                // A switch that acts in the workspace shown tells of that workspace.
                marks: match view.workspace {
                    Workspace::Frames => f.show_marks,
                    Workspace::Forces => forces.options.markers,
                    Workspace::Muscles => view.muscles.show_muscles,
                    Workspace::Face => shown.marks,
                    Workspace::Expressions | Workspace::Study => true,
                },
                names: if view.workspace == Workspace::Face { shown.names } else { f.show_names },
                wireframe: match view.workspace {
                    Workspace::Frames => f.show_marks && f.wireframe.visible,
                    Workspace::Forces => forces.options.wireframe,
                    Workspace::Muscles => view.muscles.options.wireframe,
                    Workspace::Face => shown.wireframe,
                    Workspace::Expressions => view.expressions.wireframe,
                    Workspace::Study => true,
                },
                replay: f.replay.on,
                region_only: f.wireframe.region_only,
                loupe: f.loupe.always,
                clahe: f.panes[f.active as usize].adjustment.clahe.is_some(),
                table: match view.workspace {
                    Workspace::Forces => forces.tab == Tab::Table,
                    _ => f.table_shown,
                },
                history: f.side == panels::frames::SideTab::History,
                range_locked: view.forces.range_is_locked(),
                suggest: f.suggest.on,
                snap: f.snap,
                doubt: f.side == panels::frames::SideTab::Doubt,
                again: f.doubt.again.is_some(),
                comparing: f.doubt.other.is_some(),
            },
        }
    }

    /// Whether it can be done now.
    pub fn can(&self, action: Action) -> bool {
        let in_frames = self.switches.workspace == Workspace::Frames;
        match action {
            Action::Undo => self.undo.is_some(),
            Action::Redo => self.redo.is_some(),
            Action::SaveFace | Action::SaveFaceAs | Action::UseFace | Action::TransferFace => self.face,
            Action::ClearMark if self.switches.workspace == Workspace::Face => self.slot,
            Action::Export | Action::OtherSubjects => self.results,
            Action::FromFit => self.results && self.fitted_face,
            Action::PlayPause | Action::StepOnce | Action::ResetPlay | Action::Settle | Action::ClearExpression => {
                self.switches.workspace == Workspace::Expressions
            }
            Action::ExportExpression => self.switches.workspace == Workspace::Expressions && self.export_chosen,
            Action::StartStudy | Action::StartStudyAnew => self.study.free,
            Action::StopStudy => self.study.running,
            Action::ExportStudy => self.study.table,
            Action::ApplyStudy => self.study.applicable && self.switches.workspace == Workspace::Study,
            Action::ClearLast | Action::Again | Action::Compare => self.last_marks,
            Action::ClearMark | Action::Lock | Action::Occluded => self.mark.is_some(),
            Action::Uncertain => self.in_doubt.is_some(),
            Action::Refine => self.in_doubt.is_some_and(|s| s != MarkState::Locked) && in_frames,
            Action::Accept => self.acceptable && in_frames,
            // What is hidden is not accepted.
            Action::AcceptStill => self.still > 0 && in_frames && self.switches.marks,
            Action::AcceptSure => self.sure.0 > 0 && in_frames && self.switches.marks,
            Action::RoleSkin | Action::RoleStill | Action::RoleFixed => self.role.is_some(),
            Action::Nudge(..) => self.selected.is_some() || !in_frames,
            Action::Fit | Action::ZoomIn | Action::ZoomOut => self.frames || !in_frames,
            Action::ShowReplay => in_frames && (self.results || self.switches.replay),
            Action::MatchPanes | Action::Clahe => in_frames && self.frames,
            // Nothing shows these switches elsewhere.
            Action::Snap | Action::Suggest => in_frames,
            _ => true,
        }
    }

    /// For a switch, whether it is on.
    pub fn on(&self, action: Action) -> Option<bool> {
        let s = &self.switches;
        Some(match action {
            Action::WorkspaceFrames => s.workspace == Workspace::Frames,
            Action::WorkspaceForces => s.workspace == Workspace::Forces,
            Action::WorkspaceMuscles => s.workspace == Workspace::Muscles,
            Action::WorkspaceExpressions => s.workspace == Workspace::Expressions,
            Action::Preset(basic) => s.basic == Some(basic),
            Action::WorkspaceFace => s.workspace == Workspace::Face,
            Action::WorkspaceStudy => s.workspace == Workspace::Study,
            Action::ToolSelect => s.tool == Tool::Select,
            Action::ToolLandmarks => s.tool == Tool::Landmarks,
            Action::ToolFeatures => s.tool == Tool::Features,
            Action::LinkPanes => s.linked,
            Action::Blink => s.swapped,
            Action::HideMarks => s.marks,
            Action::ShowNames => s.names,
            Action::ShowWireframe => s.wireframe,
            Action::ShowReplay => s.replay,
            Action::RegionOnly => s.region_only,
            Action::LoupeAlways => s.loupe,
            Action::Clahe => s.clahe,
            Action::Suggest => s.suggest,
            Action::Snap => s.snap,
            Action::ShowTable => s.table,
            Action::ShowHistory => s.history,
            Action::ShowDoubt => s.doubt,
            Action::Again => s.again,
            Action::Compare => s.comparing,
            Action::LockRange => s.range_locked,
            Action::Dark => self.dark,
            Action::Light => !self.dark,
            Action::Lock => self.mark == Some(MarkState::Locked),
            Action::Uncertain => self.in_doubt == Some(MarkState::Uncertain),
            Action::Occluded => self.mark == Some(MarkState::Occluded),
            Action::RoleSkin => self.role == Some(Role::Skin),
            Action::RoleStill => self.role == Some(Role::Still),
            Action::RoleFixed => self.role == Some(Role::Fixed),
            _ => return None,
        })
    }

    /// What an action is called now: "Undo Move landmark nose_tip".
    pub fn label(&self, action: Action) -> String {
        match (action, &self.undo, &self.redo) {
            (Action::Undo, Some(step), _) => format!("Undo: {step}"),
            (Action::Redo, _, Some(step)) => format!("Redo: {step}"),
            (Action::AcceptSure, ..) => {
                let (count, least) = self.sure;
                format!("{} ({count}, {:.0} % and more)", action.label(), 100.0 * least)
            }
            // The key saves what is shown.
            (Action::Save, ..) if self.switches.workspace == Workspace::Face => Action::SaveFace.label().to_owned(),
            _ => action.label().to_owned(),
        }
    }
}
