//! The workspace of the forces: the height map, its colour bar, profiles, the table of vertices, and what is known of the one pointed at.

mod canvas;
mod card;
pub(super) mod chart;
pub(super) mod colour_bar;
mod findings;
mod legend;
mod prepared;
mod profiles;
mod summary;
mod table;
mod toolbar;

use crate::gui::action::Action;
use crate::gui::height_map::{ColourRange, Layer, MapOptions, RangeMode};
use crate::gui::orbit_view::{OrbitView, Projection, StandardView};
use crate::gui::panels::in_fixed_width;
use crate::gui::{Command, Focus, Scene};
use crate::muscle_field::section::Section;
use crate::project::PointId;

use prepared::Prepared;
pub use table::{Column, Sorting};

/// What the workspace of the forces remembers about showing.
#[derive(Debug, Default)]
pub struct ForcesView {
    /// What is drawn, and how.
    pub options: MapOptions,
    /// Where the eye stands.
    pub orbit: OrbitView,
    /// What lies under the map.
    pub tab: Tab,
    /// Whether the first profile follows the chosen muscle's fibre instead of a vertical line.
    pub profile_along_fibre: bool,
    /// Order of the table.
    pub sorting: Sorting,
    /// Whether the keys turn the map.
    canvas_focused: bool,
    /// What the last frame showed, for keys that act between frames.
    shown: Option<Shown>,
    prepared: Option<Prepared>,
    /// The profiles, with what they were cut from.
    cuts: Option<(profiles::CutFrom, [Section; 2])>,
}

/// What one frame has shown.
#[derive(Clone, Copy, Debug)]
struct Shown {
    projection: Projection,
    range: ColourRange,
}

/// What lies under the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// Force along two lines through the selected vertex.
    #[default]
    Profiles,
    /// All vertices with their forces.
    Table,
}

impl ForcesView {
    /// Does what a key or a menu entry names, if it means the height map; true when it did.
    ///
    /// Arrows turn the map only while the canvas has the keyboard's focus, otherwise they nudge the selected mark, and the map follows.
    pub fn act(&mut self, action: Action) -> bool {
        let Some(Shown { projection, .. }) = self.shown else { return false };
        if self.orbit.act(action, &projection, self.canvas_focused) {
            return true;
        }
        match action {
            Action::HideMarks => self.options.markers = !self.options.markers,
            Action::ShowWireframe => self.options.wireframe = !self.options.wireframe,
            Action::ShowTable => self.tab = if self.tab == Tab::Table { Tab::Profiles } else { Tab::Table },
            _ => return false,
        }
        true
    }

    /// How often the map has been painted since the outcome or what is shown of it changed: it is not while only the pointer moves.
    pub fn paintings(&self) -> u64 {
        self.prepared.as_ref().map_or(0, Prepared::paintings)
    }

    /// Whether the colour range stays when the data change.
    pub fn range_is_locked(&self) -> bool {
        matches!(self.options.range, RangeMode::Locked(_))
    }

    /// Keeps the range that is shown, or lets it follow the data again.
    pub fn toggle_lock(&mut self) {
        self.options.range = match (self.options.range, self.shown) {
            (RangeMode::Locked(_), _) | (_, None) => RangeMode::Auto,
            (_, Some(shown)) => RangeMode::Locked(shown.range),
        };
    }

    /// Shows the map from one of the standard directions, everything in view.
    pub fn look(&mut self, view: StandardView) {
        self.orbit = OrbitView::standard(view);
    }
}

/// The vertex that is selected, be it as a feature point or as a landmark.
fn selected_vertex(scene: Scene<'_>, focus: &Focus) -> Option<usize> {
    let vertex = match &focus.selected {
        Some(PointId::Landmark(id)) => scene.face.landmark(id).map(|l| l.vertex),
        _ => focus.selected_vertex(),
    };
    vertex.map(|v| v as usize).filter(|v| *v < scene.face.mesh().len())
}

/// Asks for a vertex to be selected in every panel.
fn select(commands: &mut Vec<Command>, vertex: usize) {
    commands.push(Command::Select(Some(PointId::FeatureLast(vertex as u32))));
}

/// "vertex 123, 0.140 ± 0.021 N, measured": how a vertex is called in tooltips and to a screen reader.
pub fn vertex_name(scene: Scene<'_>, layer: &Layer, vertex: usize) -> String {
    use crate::gui::height_map::options::with_error;
    let state = scene.outcome.states.get(vertex).copied().unwrap_or_default().word();
    match layer.value_and_error(vertex) {
        Some((value, error)) if layer.unit.is_empty() => {
            format!("vertex {vertex}, {}, {state}", with_error(value, error))
        }
        Some((value, error)) => format!("vertex {vertex}, {} {}, {state}", with_error(value, error), layer.unit),
        None => format!("vertex {vertex}, {state}"),
    }
}

/// Shows the workspace in the whole of `ui`.
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    view: &mut ForcesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    if view.options.muscle.is_none_or(|m| m >= scene.face.muscles().len()) {
        view.options.muscle = (!scene.face.muscles().is_empty()).then_some(0);
    }
    let mut prepared = Prepared::of(scene, &view.options, view.prepared.take());
    let selected = selected_vertex(scene, focus);
    let (layer, first) = (&prepared.layer, &prepared.first[..]);
    egui::Panel::top("forces toolbar").show(ui, |ui| toolbar::show(ui, scene, view, &prepared));
    // Of a width that no content changes: the map beside it must not move under the pointer.
    egui::Panel::right("forces side").exact_size(282.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            // The card comes and goes with the pointer; below the summary it moves no link.
            in_fixed_width(ui, |ui| {
                summary::show(ui, scene, &prepared.findings, first, focus, commands);
                card::show(ui, scene, layer, first, focus.hovered().map(|v| v as usize).or(selected));
            });
        });
    });
    egui::Panel::bottom("forces charts").resizable(true).default_size(216.0).min_size(120.0).show(ui, |ui| match view
        .tab
    {
        Tab::Profiles => profiles::show(ui, scene, view, &prepared, selected, focus, commands),
        Tab::Table => table::show(ui, scene, view, first, selected, focus, commands),
    });
    let cuts = profiles::lines(scene, view, &prepared, selected).filter(|_| view.tab == Tab::Profiles);
    let cuts = cuts.map_or_else(Vec::new, |(_, lines)| lines.to_vec());
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        canvas::show(ui, scene, view, &mut prepared, &cuts, focus, commands);
    });
    view.prepared = Some(prepared);
}
