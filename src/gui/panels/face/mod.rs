//! The workspace of the face: a mesh to turn under the hand, and the landmarks and muscles to bind to its vertices.

mod canvas;
mod findings;
mod lists;
pub(in crate::gui::panels) mod toolbar;

use crate::face::draft::{Bindings, Slot};
use crate::face::import::Keep;
use crate::gui::Command;
use crate::gui::action::Action;
use crate::gui::action_state::ActionState;
use crate::gui::face_work::FaceWork;
use crate::gui::orbit_view::{OrbitView, Projection, StandardView};
use crate::gui::panels::in_fixed_width;

/// What the workspace of the face remembers about showing.
#[derive(Debug)]
pub struct FaceView {
    /// What the next click on a vertex binds.
    pub selected: Option<Slot>,
    /// Whether the other side of the face is bound at the same time.
    pub mirrored: bool,
    /// The list shown beside the face.
    pub tab: Tab,
    /// Where the eye stands.
    pub orbit: OrbitView,
    /// Whether the surface is drawn.
    pub surface: bool,
    /// Whether the edges are drawn.
    pub wireframe: bool,
    /// Whether landmarks are drawn.
    pub marks: bool,
    /// Whether muscles are drawn.
    pub muscles: bool,
    /// Whether names are drawn.
    pub names: bool,
    /// How much of a mesh is kept when it is opened.
    pub keep: Keep,
    /// The vertex under the pointer.
    hovered: Option<u32>,
    /// Whether the keys turn the face.
    canvas_focused: bool,
    shown: Option<Projection>,
}

/// The lists beside the face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// The landmarks.
    #[default]
    Landmarks,
    /// The muscles.
    Muscles,
    /// What the check says.
    Check,
}

impl Tab {
    /// All of them, with their titles.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Landmarks, "Landmarks"), (Self::Muscles, "Muscles"), (Self::Check, "Check")];
}

impl Default for FaceView {
    fn default() -> Self {
        Self {
            selected: None,
            mirrored: true,
            tab: Tab::Landmarks,
            orbit: look_from(StandardView::Oblique),
            surface: true,
            wireframe: true,
            marks: true,
            muscles: true,
            names: false,
            keep: Keep::Everything,
            hovered: None,
            canvas_focused: false,
            shown: None,
        }
    }
}

/// The eye at one of the places worth a button, everything in view. The face stands upright, so the angles are others than the map's.
pub(in crate::gui::panels) fn look_from(view: StandardView) -> OrbitView {
    let (azimuth, elevation): (f64, f64) = match view {
        StandardView::Front => (0.0, 0.0),
        StandardView::Oblique => (32.0, 6.0),
        StandardView::Side => (90.0, 0.0),
        StandardView::Below => (0.0, -62.0),
    };
    OrbitView { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), target: None, points_per_mm: None }
}

/// Words of the buttons.
const VIEWS: [(StandardView, &str, &str); 4] = [
    (StandardView::Front, "Front", "As the camera sees the face (1)"),
    (StandardView::Oblique, "Three-quarter", "From the person's left front (2)"),
    (StandardView::Side, "Side", "From the person's left (3)"),
    (StandardView::Below, "Below", "From below the chin (4)"),
];

impl FaceView {
    /// How the last frame was seen.
    pub fn projection(&self) -> Option<Projection> {
        self.shown
    }

    /// Begins with another face: nothing selected, everything in view.
    pub(in crate::gui) fn begin(&mut self) {
        (self.selected, self.hovered) = (None, None);
        self.orbit = look_from(StandardView::Oblique);
    }

    /// Does what a key or a menu entry names, if it means the picture of the face; true when it did.
    pub(in crate::gui) fn act(&mut self, action: Action) -> bool {
        let Some(projection) = self.shown else { return false };
        if self.orbit.act(action, &projection, self.canvas_focused) {
            return true;
        }
        match action {
            Action::Look(view) => self.orbit = look_from(view),
            Action::Nudge(..) => {}
            Action::HideMarks => self.marks = !self.marks,
            Action::ShowNames => self.names = !self.names,
            Action::ShowWireframe => self.wireframe = !self.wireframe,
            _ => return false,
        }
        true
    }

    /// Goes to the next thing to bind in the list shown, or the one before.
    pub(in crate::gui) fn step(&mut self, bindings: &Bindings, forward: bool) {
        let all = slots(bindings, self.tab);
        let at = self.selected.and_then(|s| all.iter().position(|a| *a == s));
        let count = all.len().max(1);
        let next = match (at, forward) {
            (Some(i), true) => (i + 1) % count,
            (Some(i), false) => (i + count - 1) % count,
            (None, true) => 0,
            (None, false) => count - 1,
        };
        self.selected = all.get(next).copied();
    }

    /// After a binding: the next thing of the list that is bound to nothing; the same one stays where none is left.
    fn go_on(&mut self, bindings: &Bindings, just_bound: Slot) {
        let all = slots(bindings, if matches!(just_bound, Slot::Landmark(_)) { Tab::Landmarks } else { Tab::Muscles });
        let at = all.iter().position(|s| *s == just_bound).map_or(0, |i| i + 1);
        let partner = bindings.partner(just_bound).filter(|_| self.mirrored);
        let mut rest = all.iter().cycle().skip(at).take(all.len());
        let open = |s: &&Slot| bindings.vertex(**s).is_none() && **s != just_bound && Some(**s) != partner;
        if let Some(next) = rest.find(open) {
            self.selected = Some(*next);
        }
    }
}

/// What can be bound, in the order of a list.
fn slots(bindings: &Bindings, tab: Tab) -> Vec<Slot> {
    match tab {
        Tab::Muscles => (0..bindings.muscles.len()).flat_map(|i| [Slot::Attachment(i), Slot::Insertion(i)]).collect(),
        Tab::Landmarks | Tab::Check => (0..bindings.landmarks.len()).map(Slot::Landmark).collect(),
    }
}

/// Width of the panel beside the face, ui points.
const SIDE_WIDTH: f32 = 330.0;

/// Shows the workspace in the whole of `ui`.
pub fn show(ui: &mut egui::Ui, work: &FaceWork, view: &mut FaceView, state: &ActionState, commands: &mut Vec<Command>) {
    let Some(open) = work.open() else { return };
    egui::Panel::top("face tools").show(ui, |ui| toolbar::show(ui, view, state, commands));
    egui::Panel::right("face side").exact_size(SIDE_WIDTH).show(ui, |ui| {
        lists::head(ui, open, commands);
        ui.horizontal(|ui| {
            for (tab, title) in Tab::ALL {
                ui.selectable_value(&mut view.tab, tab, title);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let hint = "Bind the other side at the same time, where the mesh has a vertex across the midline";
                ui.toggle_value(&mut view.mirrored, "Both sides").on_hover_text(hint);
            });
        });
        ui.separator();
        egui::ScrollArea::vertical().id_salt(view.tab as usize).auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| match view.tab {
                Tab::Landmarks => lists::landmarks(ui, open, view, commands),
                Tab::Muscles => lists::muscles(ui, open, view, commands),
                Tab::Check => findings::show(ui, open),
            });
        });
    });
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| canvas::show(ui, open, view, commands));
}
