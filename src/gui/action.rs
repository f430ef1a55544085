//! Everything a person can tell the program, and what a row of the one table (`action_table`) says of it.

use egui::{Key, Modifiers};

pub use super::action_table::{HOLDS, POINTER, TABLE};

use super::keys::Hold;
use super::orbit_view::StandardView;
use crate::expression::Basic;

/// Something a person can tell the program to do, without further data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// Begin an empty project.
    New,
    /// Open a project file.
    Open,
    /// Open the embedded sample.
    OpenSample,
    /// Save the project.
    Save,
    /// Save the project under another name.
    SaveAs,
    /// Choose the two frames.
    OpenFrames,
    /// Choose a film, and the first and the last frame in it.
    OpenFilm,
    /// Choose a folder of numbered frames.
    OpenFolder,
    /// Read marks from a file of another program or project.
    ImportMarks,
    /// Open projects of other subjects, to try the laws on them.
    OtherSubjects,
    /// Write the results into a folder.
    Export,
    /// Leave the program.
    Quit,
    /// Take back the last step.
    Undo,
    /// Do the step again.
    Redo,
    /// Show the list of steps.
    ShowHistory,
    /// Show the palette of commands.
    Palette,
    /// Show the workspace of the two frames.
    WorkspaceFrames,
    /// Show the workspace of the forces.
    WorkspaceForces,
    /// Show the workspace of the muscles.
    WorkspaceMuscles,
    /// Show the workspace of the expressions.
    WorkspaceExpressions,
    /// Show the workspace of the studies.
    WorkspaceStudy,
    /// Show the workspace of the face model.
    WorkspaceFace,
    /// Open a mesh, to make a face model of it.
    OpenMesh,
    /// Open a face model.
    OpenFace,
    /// Propose the landmarks and muscles of the generic face on this mesh.
    TransferFace,
    /// Save the face model.
    SaveFace,
    /// Save the face model under another name.
    SaveFaceAs,
    /// Fit this face model in the project.
    UseFace,
    /// Fit the generic face in the project.
    UseGeneric,
    /// Fit the picture into its pane.
    Fit,
    /// Closer.
    ZoomIn,
    /// Farther.
    ZoomOut,
    /// Zoom and pan both panes together.
    LinkPanes,
    /// Show this pane's place in the other one.
    MatchPanes,
    /// Swap the two pictures while looking.
    Blink,
    /// Hide and show marks.
    HideMarks,
    /// Hide and show names.
    ShowNames,
    /// Hide and show the wireframe.
    ShowWireframe,
    /// Lay the simulated last frame over the real one, or take it away.
    ShowReplay,
    /// Draw the wireframe of the chosen regions only.
    RegionOnly,
    /// Show the loupe while pointing, too.
    LoupeAlways,
    /// Enhance local contrast of the pane under the pointer.
    Clahe,
    /// Put brightness and contrast of both panes back.
    ResetAdjustment,
    /// Hide and show the table of points.
    ShowTable,
    /// Look at the height map from a standard direction.
    Look(StandardView),
    /// Keep the colour range of the height map, or let it follow the data again.
    LockRange,
    /// Dark colours.
    Dark,
    /// Light colours.
    Light,
    /// Only select and drag.
    ToolSelect,
    /// Place the landmarks one after the other.
    ToolLandmarks,
    /// Mark the feature points one after the other.
    ToolFeatures,
    /// The next point.
    Next,
    /// The point before.
    Previous,
    /// Take the predicted place for the point's mark.
    Accept,
    /// Take every suggested place that is sure enough.
    AcceptSure,
    /// Take the suggested still points that move as one head.
    AcceptStill,
    /// Snap marks to crossings of the painted grid, or not.
    Snap,
    /// Look for the skin of the first frame about the mark.
    Refine,
    /// Suggest places for points without a mark, or not.
    Suggest,
    /// Show what is in doubt.
    ShowDoubt,
    /// Go to the point whose mark would tell most.
    NextWorth,
    /// Mark a few points a second time, blind, or stop.
    Again,
    /// Compare with another project on the same frames, or stop.
    Compare,
    /// Remove the mark.
    ClearMark,
    /// Protect the mark against the hand, or not.
    Lock,
    /// Mark in doubt, or not.
    Uncertain,
    /// Not visible here, or visible.
    Occluded,
    /// Make it ordinary skin.
    RoleSkin,
    /// Make it a still point.
    RoleStill,
    /// Hold it in place.
    RoleFixed,
    /// Remove all marks of the last frame.
    ClearLast,
    /// Move the selected point a little.
    Nudge(Direction, Step),
    /// Play one of the six expressions.
    Preset(Basic),
    /// Play, or stop playing.
    PlayPause,
    /// Simulate one step.
    StepOnce,
    /// Put the moving face back to rest.
    ResetPlay,
    /// Show the static equilibrium at once.
    Settle,
    /// Take the activations of the fit.
    FromFit,
    /// Let every muscle go.
    ClearExpression,
    /// Open an expression file.
    OpenExpression,
    /// Save the expression under a name.
    SaveExpression,
    /// Write the play into a folder.
    ExportExpression,
    /// Begin the study that is chosen, or go on with it.
    StartStudy,
    /// Begin it from nothing.
    StartStudyAnew,
    /// Stop the study under way.
    StopStudy,
    /// Open the table of a study.
    OpenStudy,
    /// Write the study into a folder.
    ExportStudy,
    /// Solve the project by the method that is picked.
    ApplyStudy,
    /// Show the keys.
    Keys,
    /// Give other keys to commands.
    SetKeys,
    /// Say what this program is.
    About,
}

/// Where a nudge goes on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// −x.
    Left,
    /// +x.
    Right,
    /// −y.
    Up,
    /// +y.
    Down,
}

impl Direction {
    /// Unit step, px, y down.
    pub fn unit(self) -> [f64; 2] {
        match self {
            Self::Left => [-1.0, 0.0],
            Self::Right => [1.0, 0.0],
            Self::Up => [0.0, -1.0],
            Self::Down => [0.0, 1.0],
        }
    }
}

/// How far a nudge goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// 0.1 px.
    Small,
    /// 0.5 px.
    Medium,
    /// 5 px.
    Large,
}

impl Step {
    /// Length, px.
    pub fn px(self) -> f64 {
        match self {
            Self::Small => 0.1,
            Self::Medium => 0.5,
            Self::Large => 5.0,
        }
    }
}

/// The menus of the menu bar, from left to right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Files.
    File,
    /// The history.
    Edit,
    /// How things are shown.
    View,
    /// The face that moves.
    Expression,
    /// The face model.
    Face,
    /// The selected point.
    Point,
    /// Studies.
    Study,
    /// Moving the selected point by keys; a part of the menu of the point.
    Nudge,
    /// Help.
    Help,
}

impl Menu {
    /// The menus of the bar.
    pub const BAR: [Self; 8] =
        [Self::File, Self::Edit, Self::View, Self::Expression, Self::Face, Self::Study, Self::Point, Self::Help];

    /// Its title.
    pub fn title(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Expression => "Expression",
            Self::Face => "Model",
            Self::Study => "Studies",
            Self::Point => "Point",
            Self::Nudge => "Nudge",
            Self::Help => "Help",
        }
    }
}

/// The menus in the order of the key sheet: the first five in its first column.
pub const SHEET: [Menu; 9] = [
    Menu::File,
    Menu::Edit,
    Menu::View,
    Menu::Face,
    Menu::Help,
    Menu::Expression,
    Menu::Study,
    Menu::Point,
    Menu::Nudge,
];

/// A key with what is held beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chord {
    /// Held keys.
    pub modifiers: Modifiers,
    /// The key.
    pub key: Key,
}

impl Chord {
    /// "Ctrl+Shift+Z".
    pub fn text(self) -> String {
        let mut text = String::new();
        for (held, word) in
            [(self.modifiers.command, "Ctrl+"), (self.modifiers.alt, "Alt+"), (self.modifiers.shift, "Shift+")]
        {
            if held {
                text.push_str(word);
            }
        }
        text + match self.key {
            Key::ArrowLeft => "Left",
            Key::ArrowRight => "Right",
            Key::ArrowUp => "Up",
            Key::ArrowDown => "Down",
            Key::Period => ".",
            Key::Comma => ",",
            Key::Plus => "+",
            Key::Minus => "-",
            Key::Equals => "=",
            Key::Questionmark => "?",
            key => key.name(),
        }
    }
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// What it does.
    pub action: Action,
    /// Words on the menu and in the palette.
    pub label: &'static str,
    /// One sentence that says what happens.
    pub tooltip: &'static str,
    /// Where it stands.
    pub menu: Menu,
    /// Whether a line is drawn above it in the menu.
    pub new_group: bool,
    /// Its keys, until they are changed; the first is shown.
    pub keys: &'static [Chord],
}

/// What acts while a key is held.
#[derive(Clone, Copy, Debug)]
pub struct HoldSpec {
    /// What it does.
    pub hold: Hold,
    /// Its name in the dialog of the keys.
    pub label: &'static str,
    /// What happens while the key is held.
    pub tooltip: &'static str,
    /// Its keys, until they are changed.
    pub keys: &'static [Chord],
}

impl Action {
    /// Its row of the table.
    pub fn spec(self) -> Option<&'static Spec> {
        TABLE.iter().find(|s| s.action == self)
    }

    /// Words on the menu and in the palette.
    pub fn label(self) -> &'static str {
        self.spec().map_or("", |s| s.label)
    }
}
