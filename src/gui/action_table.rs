//! The one table of everything a person can tell the program: label, tooltip, menu and keys of each action.
//!
//! The menus, the shortcuts, the palette and the key sheet are all made from it.

use egui::{Key, Modifiers};

use super::action::{Action, Chord, Direction, HoldSpec, Menu, Spec, Step};
use super::keys::Hold;
use super::orbit_view::StandardView;
use crate::expression::Basic;

const fn plain(key: Key) -> Chord {
    Chord { modifiers: Modifiers::NONE, key }
}
const fn ctrl(key: Key) -> Chord {
    Chord { modifiers: Modifiers::COMMAND, key }
}
const fn shift(key: Key) -> Chord {
    Chord { modifiers: Modifiers::SHIFT, key }
}
const fn alt(key: Key) -> Chord {
    Chord { modifiers: Modifiers::ALT, key }
}
const fn ctrl_shift(key: Key) -> Chord {
    Chord { modifiers: Modifiers::COMMAND.plus(Modifiers::SHIFT), key }
}

const fn row(action: Action, menu: Menu, label: &'static str, keys: &'static [Chord], tooltip: &'static str) -> Spec {
    Spec { action, label, tooltip, menu, new_group: false, keys }
}

const fn group(spec: Spec) -> Spec {
    Spec { new_group: true, ..spec }
}

use Action as A;
use Menu as M;

/// Every action, in the order of the menus.
pub const TABLE: &[Spec] = &[
    row(A::New, M::File, "New project", &[ctrl(Key::N)], "Begin with an empty project."),
    row(A::Open, M::File, "Open project…", &[ctrl(Key::O)], "Open a project file."),
    row(
        A::OpenSample,
        M::File,
        "Open sample",
        &[],
        "Open the embedded sample: two frames of a rendered brow raise with a painted grid, marked.",
    ),
    group(row(A::Save, M::File, "Save", &[ctrl(Key::S)], "Save the project; the last good copy is kept beside it.")),
    row(A::SaveAs, M::File, "Save as…", &[ctrl_shift(Key::S)], "Save the project under another name."),
    group(row(
        A::OpenFrames,
        M::File,
        "Open frames…",
        &[ctrl(Key::F)],
        "Choose the first (neutral) and the last (apex) picture.",
    )),
    row(
        A::OpenFilm,
        M::File,
        "Open film…",
        &[ctrl_shift(Key::O)],
        "Choose the first and the last frame on the strip of a film; the motion proposes both.",
    ),
    row(
        A::OpenFolder,
        M::File,
        "Open folder of frames…",
        &[ctrl_shift(Key::F)],
        "Choose the first and the last frame on the strip of a folder of numbered pictures.",
    ),
    group(row(
        A::ImportMarks,
        M::File,
        "Import marks…",
        &[],
        "Read marks from a CSV, TPS or COCO file, as suggestions or to accept them all at once.",
    )),
    row(
        A::OtherSubjects,
        M::File,
        "Other subjects…",
        &[],
        "Open projects of other subjects: the laws found here are tried on them, and the forces of all are put together vertex by vertex.",
    ),
    row(
        A::Export,
        M::File,
        "Export results…",
        &[ctrl(Key::E)],
        "Write the forces and marks as tables, a mesh, a picture and a report into a folder.",
    ),
    group(row(A::Quit, M::File, "Quit", &[ctrl(Key::Q)], "Leave the program; unsaved changes are asked about.")),
    row(A::Undo, M::Edit, "Undo", &[ctrl(Key::Z)], "Take back the last step."),
    row(A::Redo, M::Edit, "Redo", &[ctrl_shift(Key::Z), ctrl(Key::Y)], "Do again what was taken back."),
    row(A::ShowHistory, M::Edit, "History", &[ctrl(Key::H)], "Show the list of steps; click one to go there."),
    group(row(
        A::ClearLast,
        M::Edit,
        "Clear all marks of the last frame",
        &[],
        "Remove every mark of the last frame that is not locked. Can be undone.",
    )),
    group(row(A::Palette, M::Edit, "Command palette…", &[ctrl(Key::P)], "Find any command by its name.")),
    row(A::WorkspaceFrames, M::View, "Frames", &[ctrl(Key::Num1)], "The two frames, with points to place and drag."),
    row(A::WorkspaceForces, M::View, "Forces", &[ctrl(Key::Num2)], "The forces as a height map."),
    row(
        A::WorkspaceMuscles,
        M::View,
        "Muscles",
        &[ctrl(Key::Num3)],
        "Which muscles pulled, how hard, by which law, and how sure that is.",
    ),
    row(
        A::WorkspaceExpressions,
        M::View,
        "Expressions",
        &[ctrl(Key::Num4)],
        "The face moves: muscles under sliders, the six expressions, curves over time.",
    ),
    row(
        A::WorkspaceFace,
        M::View,
        "Face",
        &[ctrl(Key::Num5)],
        "The face model: its mesh, with landmarks and muscles bound to vertices.",
    ),
    row(
        A::WorkspaceStudy,
        M::View,
        "Study",
        &[ctrl(Key::Num6)],
        "What the methods cost, how near they come to the truth, and where they fail, measured on this machine.",
    ),
    group(row(
        A::Fit,
        M::View,
        "Fit pictures",
        &[plain(Key::Num0), plain(Key::F)],
        "Show the whole picture in its pane. A double click does the same.",
    )),
    row(
        A::ZoomIn,
        M::View,
        "Zoom in",
        &[plain(Key::Plus), plain(Key::Equals), shift(Key::Plus)],
        "Closer, at the centre of the pane. The wheel zooms at the pointer.",
    ),
    row(A::ZoomOut, M::View, "Zoom out", &[plain(Key::Minus)], "Farther."),
    row(
        A::LinkPanes,
        M::View,
        "Link panes",
        &[plain(Key::K)],
        "Zoom and pan both frames together; an offset between them is kept.",
    ),
    row(
        A::MatchPanes,
        M::View,
        "Match other pane",
        &[plain(Key::Q)],
        "Let the other pane show the same place as the active one.",
    ),
    row(
        A::Blink,
        M::View,
        "Swap pictures",
        &[plain(Key::T)],
        "Show each pane the other's picture, until it is swapped back.",
    ),
    group(row(
        A::HideMarks,
        M::View,
        "Marks",
        &[plain(Key::V)],
        "Hide or show every mark, and in Frames the wireframe with them.",
    )),
    row(A::ShowNames, M::View, "Names", &[plain(Key::N)], "Hide or show the points' names."),
    row(A::ShowWireframe, M::View, "Wireframe", &[plain(Key::W)], "Hide or show the wireframe."),
    row(
        A::ShowReplay,
        M::View,
        "Simulated last frame",
        &[],
        "Let the muscles found pull on the skin of the first frame, and lay what comes out over the last frame with the distance of every measured point.",
    ),
    row(
        A::RegionOnly,
        M::View,
        "Wireframe of chosen regions only",
        &[plain(Key::R)],
        "Draw only the part of the wireframe that is to be marked.",
    ),
    row(
        A::LoupeAlways,
        M::View,
        "Loupe while pointing",
        &[plain(Key::G)],
        "Show the loupe whenever the pointer is on a frame, not only while dragging.",
    ),
    group(row(
        A::Clahe,
        M::View,
        "Local contrast (CLAHE)",
        &[plain(Key::C)],
        "Enhance faint detail in the active pane. The project and the results do not change.",
    )),
    row(
        A::ResetAdjustment,
        M::View,
        "Reset contrast",
        &[shift(Key::C)],
        "Put brightness and contrast of both panes back.",
    ),
    group(row(A::ShowTable, M::View, "Table of points", &[plain(Key::P)], "Hide or show the table under the frames.")),
    group(row(
        A::Look(StandardView::Front),
        M::View,
        "Forces from the front",
        &[plain(Key::Num1)],
        "Look at the height map as the camera sees the face.",
    )),
    row(
        A::Look(StandardView::Oblique),
        M::View,
        "Forces obliquely",
        &[plain(Key::Num2)],
        "Look at the height map from above the chin, a little to one side.",
    ),
    row(
        A::Look(StandardView::Side),
        M::View,
        "Forces from the side",
        &[plain(Key::Num3)],
        "Look at the height map from the person's left: y against height.",
    ),
    row(
        A::Look(StandardView::Below),
        M::View,
        "Forces from below",
        &[plain(Key::Num4)],
        "Look at the height map from below the chin, as an axial scan: x against height.",
    ),
    row(
        A::LockRange,
        M::View,
        "Lock the colour range",
        &[shift(Key::L)],
        "Keep the colour range of the height map when the data change, or let it follow them again.",
    ),
    group(row(A::Dark, M::View, "Dark colours", &[], "Dark colours.")),
    row(A::Light, M::View, "Light colours", &[], "Light colours."),
    row(
        A::PlayPause,
        M::Expression,
        "Play or pause",
        &[plain(Key::F5)],
        "Let time run, or stop it. Sliders and expressions act while it runs.",
    ),
    row(A::StepOnce, M::Expression, "One step", &[plain(Key::F6)], "Simulate one step and stop."),
    row(
        A::Settle,
        M::Expression,
        "Settle",
        &[plain(Key::F7)],
        "Show at once where the skin comes to rest: the static equilibrium.",
    ),
    row(
        A::ResetPlay,
        M::Expression,
        "Back to rest",
        &[plain(Key::F8)],
        "Put the skin back to rest, at time 0. The sliders stay.",
    ),
    group(row(
        A::Preset(Basic::Surprise),
        M::Expression,
        "Surprise",
        &[alt(Key::Num1)],
        "Play surprise: brows up, eyes wide, jaw open.",
    )),
    row(
        A::Preset(Basic::Happy),
        M::Expression,
        "Happy",
        &[alt(Key::Num2)],
        "Play happy: cheeks up, corners of the mouth up and out.",
    ),
    row(
        A::Preset(Basic::Sad),
        M::Expression,
        "Sad",
        &[alt(Key::Num3)],
        "Play sad: inner brows up, corners of the mouth down.",
    ),
    row(
        A::Preset(Basic::Anger),
        M::Expression,
        "Anger",
        &[alt(Key::Num4)],
        "Play anger: brows down and together, lids and lips tight.",
    ),
    row(
        A::Preset(Basic::Disgust),
        M::Expression,
        "Disgust",
        &[alt(Key::Num5)],
        "Play disgust: nose wrinkled, upper lip up.",
    ),
    row(
        A::Preset(Basic::Fear),
        M::Expression,
        "Fear",
        &[alt(Key::Num6)],
        "Play fear: brows up and together, eyes wide, mouth drawn wide.",
    ),
    group(row(
        A::FromFit,
        M::Expression,
        "Take the fitted activations",
        &[],
        "Give every muscle the strength that was found behind the project's forces.",
    )),
    row(A::ClearExpression, M::Expression, "Clear the expression", &[], "Let every muscle go and shut the jaw."),
    group(row(
        A::OpenExpression,
        M::Expression,
        "Open expression…",
        &[],
        "Take activations and jaw from an expression file.",
    )),
    row(
        A::SaveExpression,
        M::Expression,
        "Save expression as…",
        &[],
        "Write activations and jaw, with the intensity in them, to an expression file.",
    ),
    row(
        A::ExportExpression,
        M::Expression,
        "Export the play…",
        &[],
        "Write the play as a moving picture, pictures, meshes and tables into a folder.",
    ),
    row(
        A::StartStudy,
        M::Study,
        "Start study",
        &[ctrl_shift(Key::R)],
        "Run the chosen study in the background; one that was stopped goes on where it was.",
    ),
    row(
        A::StartStudyAnew,
        M::Study,
        "Start study anew",
        &[],
        "Forget what there is of the chosen study and begin from nothing.",
    ),
    row(A::StopStudy, M::Study, "Stop study", &[], "Stop the study under way; what it has finished is kept."),
    group(row(
        A::OpenStudy,
        M::Study,
        "Open study…",
        &[],
        "Show the table of a finished study, of this machine or another.",
    )),
    row(
        A::ExportStudy,
        M::Study,
        "Export study…",
        &[],
        "Write the table (CSV), the chart (SVG and PNG) and a reading of it into a folder.",
    ),
    group(row(
        A::ApplyStudy,
        M::Study,
        "Apply to project",
        &[ctrl(Key::Enter)],
        "Solve the open project by the method that is picked in the chart. Can be undone.",
    )),
    row(
        A::OpenMesh,
        M::Face,
        "Open mesh…",
        &[],
        "Make a face model of a mesh of another program: OBJ, PLY or CANDIDE's WFM.",
    ),
    row(
        A::TransferFace,
        M::Face,
        "Transfer from the generic face",
        &[],
        "Propose landmarks, muscles and regions on this mesh, to be corrected by hand. What is bound already is held.",
    ),
    row(A::OpenFace, M::Face, "Open face model…", &[], "Open a face model file, to look at it or to change it."),
    group(row(
        A::SaveFace,
        M::Face,
        "Save face model",
        &[],
        "Save the face model. In its workspace Save does the same.",
    )),
    row(A::SaveFaceAs, M::Face, "Save face model as…", &[], "Save the face model under another name."),
    group(row(
        A::UseFace,
        M::Face,
        "Use this face in the project",
        &[],
        "Fit this face to the frames from now on. Landmarks keep their marks; on another mesh feature points begin anew.",
    )),
    row(A::UseGeneric, M::Face, "Use the generic face in the project", &[], "Fit the embedded face again."),
    row(A::ToolSelect, M::Point, "Select and drag", &[plain(Key::S)], "Clicks select, drags move."),
    row(
        A::ToolLandmarks,
        M::Point,
        "Place landmarks",
        &[ctrl(Key::L)],
        "Place the landmarks in the first frame one after the other: each press places the one that the small face shows, exactly at the pointer.",
    ),
    row(
        A::ToolFeatures,
        M::Point,
        "Mark feature points",
        &[ctrl(Key::M)],
        "Mark the chosen points in the last frame one after the other: each press marks the point asked for, exactly at the pointer.",
    ),
    group(row(
        A::Next,
        M::Point,
        "Next point",
        &[plain(Key::Period), plain(Key::Tab)],
        "Go to the next point; while the guide runs, skip to the next without a mark.",
    )),
    row(A::Previous, M::Point, "Previous point", &[plain(Key::Comma), shift(Key::Tab)], "Go to the point before."),
    group(row(
        A::Accept,
        M::Point,
        "Accept place",
        &[plain(Key::Enter), plain(Key::A)],
        "Take the suggested or predicted place of the point asked for, or of the selected one, as its mark, and go to the next.",
    )),
    row(
        A::AcceptSure,
        M::Point,
        "Accept sure suggestions",
        &[shift(Key::Enter), shift(Key::A)],
        "Take every suggestion that is at least as sure as the guide says, in one step. Can be undone.",
    ),
    row(
        A::AcceptStill,
        M::Point,
        "Accept still points",
        &[shift(Key::S)],
        "Take the suggestions for still points that are sure and move as one head, in one step. Can be undone.",
    ),
    row(
        A::Refine,
        M::Point,
        "Refine place",
        &[plain(Key::E)],
        "Put the mark where the skin of the first frame is found about it, or on the crossing of painted lines there. Shows where it was.",
    ),
    row(
        A::Snap,
        M::Point,
        "Snap to the grid",
        &[plain(Key::M)],
        "Let a mark that is pressed or dropped beside a crossing of painted lines go to the crossing. Alt, or a fine drag with Shift, leaves it to the hand.",
    ),
    row(
        A::Suggest,
        M::Point,
        "Suggest places",
        &[plain(Key::H)],
        "Look for the skin of every point without a mark in the last frame, and show where it probably went. Never data until accepted.",
    ),
    group(row(
        A::ShowDoubt,
        M::Point,
        "Doubt",
        &[plain(Key::D)],
        "Show which point is worth marking next, which marks stand out, your own error, and how another annotator agrees.",
    )),
    row(
        A::NextWorth,
        M::Point,
        "Go to the point worth most",
        &[plain(Key::J)],
        "Go to the point without a mark, or in doubt, whose pixel of error would change the forces most.",
    ),
    row(
        A::Again,
        M::Point,
        "Mark points again, blind",
        &[],
        "Mark a few points a second time without sight of the first mark: how far both lie apart is your own error. Again to stop.",
    ),
    row(
        A::Compare,
        M::Point,
        "Compare with another project…",
        &[],
        "Compare these marks with those of another annotator on the same frames, point by point. Again to stop.",
    ),
    row(
        A::ClearMark,
        M::Point,
        "Clear mark",
        &[plain(Key::Delete), plain(Key::Backspace)],
        "Remove the mark; the point itself stays.",
    ),
    row(A::Lock, M::Point, "Lock", &[plain(Key::L)], "Protect the mark against the hand, or free it again."),
    row(
        A::Uncertain,
        M::Point,
        "Uncertain",
        &[plain(Key::U)],
        "Say that the mark is in doubt: it counts with three times the standard deviation. While the guide asks for the next point, this speaks of the one placed last.",
    ),
    row(
        A::Occluded,
        M::Point,
        "Occluded",
        &[plain(Key::O)],
        "Say that the point cannot be seen here: its place is a note, never data.",
    ),
    group(row(A::RoleSkin, M::Point, "Ordinary skin", &[], "The expression may move this point.")),
    row(
        A::RoleStill,
        M::Point,
        "Still point",
        &[],
        "This skin cannot move with the expression: it gives the head's motion and the noise floor.",
    ),
    row(A::RoleFixed, M::Point, "Fixed point", &[], "Held at its place on the head, marked or not."),
    row(
        A::Nudge(Direction::Left, Step::Medium),
        M::Nudge,
        "Left 0.5 px",
        &[plain(Key::ArrowLeft)],
        "Move the selected point half a pixel.",
    ),
    row(
        A::Nudge(Direction::Right, Step::Medium),
        M::Nudge,
        "Right 0.5 px",
        &[plain(Key::ArrowRight)],
        "Move the selected point half a pixel.",
    ),
    row(
        A::Nudge(Direction::Up, Step::Medium),
        M::Nudge,
        "Up 0.5 px",
        &[plain(Key::ArrowUp)],
        "Move the selected point half a pixel.",
    ),
    row(
        A::Nudge(Direction::Down, Step::Medium),
        M::Nudge,
        "Down 0.5 px",
        &[plain(Key::ArrowDown)],
        "Move the selected point half a pixel.",
    ),
    group(row(
        A::Nudge(Direction::Left, Step::Large),
        M::Nudge,
        "Left 5 px",
        &[shift(Key::ArrowLeft)],
        "Move the selected point five pixels.",
    )),
    row(
        A::Nudge(Direction::Right, Step::Large),
        M::Nudge,
        "Right 5 px",
        &[shift(Key::ArrowRight)],
        "Move the selected point five pixels.",
    ),
    row(
        A::Nudge(Direction::Up, Step::Large),
        M::Nudge,
        "Up 5 px",
        &[shift(Key::ArrowUp)],
        "Move the selected point five pixels.",
    ),
    row(
        A::Nudge(Direction::Down, Step::Large),
        M::Nudge,
        "Down 5 px",
        &[shift(Key::ArrowDown)],
        "Move the selected point five pixels.",
    ),
    group(row(
        A::Nudge(Direction::Left, Step::Small),
        M::Nudge,
        "Left 0.1 px",
        &[alt(Key::ArrowLeft)],
        "Move the selected point a tenth of a pixel.",
    )),
    row(
        A::Nudge(Direction::Right, Step::Small),
        M::Nudge,
        "Right 0.1 px",
        &[alt(Key::ArrowRight)],
        "Move the selected point a tenth of a pixel.",
    ),
    row(
        A::Nudge(Direction::Up, Step::Small),
        M::Nudge,
        "Up 0.1 px",
        &[alt(Key::ArrowUp)],
        "Move the selected point a tenth of a pixel.",
    ),
    row(
        A::Nudge(Direction::Down, Step::Small),
        M::Nudge,
        "Down 0.1 px",
        &[alt(Key::ArrowDown)],
        "Move the selected point a tenth of a pixel.",
    ),
    row(
        A::Keys,
        M::Help,
        "Keys",
        &[plain(Key::F1), plain(Key::Questionmark), shift(Key::Questionmark)],
        "Show every key.",
    ),
    row(A::SetKeys, M::Help, "Change keys…", &[], "Give other keys to commands. They are kept for every project."),
    row(A::About, M::Help, "About Frontalis", &[], "What this program is, and its version."),
];

/// What acts while a key is held.
pub const HOLDS: &[HoldSpec] = &[
    HoldSpec {
        hold: Hold::Blink,
        label: "Blink",
        tooltip: "Blink: each pane shows the other's picture",
        keys: &[plain(Key::B)],
    },
    HoldSpec { hold: Hold::Pan, label: "Pan", tooltip: "Pan with the left button", keys: &[plain(Key::Space)] },
];

/// What the pointer does, and keys that have no other; on the key sheet beside the table.
pub const POINTER: &[(&str, &str)] = &[
    ("Wheel", "Zoom at the pointer"),
    ("Middle drag", "Pan"),
    ("Press (guided)", "Mark the point asked for, there"),
    ("Ctrl+press (guided)", "Take or move another point"),
    ("Drag a point", "Move it; the loupe shows where"),
    ("Shift while dragging", "Move at a fifth of the speed"),
    ("Alt while dragging", "Leave the mark where the hand is: no snapping"),
    ("Esc", "Give up the drag; everything is as before"),
    ("Double click beside the points", "Show the whole pictures"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_actions_share_a_key_and_each_has_a_label_and_a_sentence() {
        for (i, a) in TABLE.iter().enumerate() {
            assert!(!a.label.is_empty() && a.tooltip.ends_with('.'), "{:?}", a.action);
            for b in &TABLE[i + 1..] {
                assert_ne!(a.action, b.action);
                assert_ne!(a.label, b.label);
                for key in a.keys {
                    assert!(!b.keys.contains(key), "{} is a key of {} and of {}", key.text(), a.label, b.label);
                }
            }
        }
    }

    #[test]
    fn keys_that_are_held_are_no_actions() {
        for spec in TABLE {
            assert!(HOLDS.iter().all(|h| h.keys.iter().all(|k| !spec.keys.contains(k))));
        }
    }
}
