//! The workspace of the two frames: the panes side by side, the tools above, the table below, the guide beside.

use std::collections::BTreeSet;
use std::sync::Arc;

use egui::{Pos2, Rect, Vec2};

use crate::frames::Adjustment;
use crate::gui::action_state::ActionState;
use crate::gui::face_drawing::FaceDrawing;
use crate::gui::keys::{self, Hold};
use crate::gui::pictures::Pictures;
use crate::gui::snapping::Trace;
use crate::gui::suggesting::SuggestStyle;
use crate::gui::{Command, Focus, Scene};
use crate::project::{PointId, Which};

pub mod doubt;
pub mod doubt_marks;
pub mod drag;
pub mod face_picture;
pub mod guide;
pub mod image_view;
pub mod loupe;
pub mod marks;
pub mod pane;
pub mod pane_message;
pub mod points;
pub mod points_table;
pub mod replay;
pub mod suggestions;
pub mod toolbar;
pub mod wireframe;

use super::{history, results, settings};
use drag::Drag;
use image_view::ImageView;
use loupe::LoupeStyle;
use points_table::TableView;
use wireframe::WireframeStyle;

/// What a click on a frame does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Tool {
    /// Selects; a drag moves.
    #[default]
    Select,
    /// Places the next landmark in the first frame.
    Landmarks,
    /// Marks the next feature point in the last frame.
    Features,
    /// Gives the two places of the scale in the first frame.
    ScalePoints {
        /// Crossings of the painted grid, or any two places.
        grid: bool,
        /// The place already given, px.
        first: Option<[f64; 2]>,
    },
}

impl Tool {
    /// Whether a click on this frame places something.
    pub fn places_in(self, which: Which) -> bool {
        match self {
            Self::Select => false,
            Self::Landmarks | Self::ScalePoints { .. } => which == Which::First,
            Self::Features => which == Which::Last,
        }
    }

    /// Whether a press takes points of this kind.
    pub fn takes(self, kind: points::Kind) -> bool {
        match self {
            Self::Select | Self::ScalePoints { .. } => true,
            Self::Landmarks => kind == points::Kind::Landmark,
            Self::Features => kind != points::Kind::Landmark,
        }
    }
}

/// The tabs beside the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SideTab {
    /// Which point comes next.
    #[default]
    Guide,
    /// Numbers and warnings.
    Results,
    /// What is in doubt.
    Doubt,
    /// Choices of the chain.
    Settings,
    /// The list of steps.
    History,
}

impl SideTab {
    /// All of them, with their titles.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Guide, "Guide"),
        (Self::Doubt, "Doubt"),
        (Self::Results, "Results"),
        (Self::Settings, "Settings"),
        (Self::History, "History"),
    ];
}

/// One pane.
#[derive(Clone, Copy, Debug)]
pub struct PaneView {
    /// Which part of the picture it shows.
    pub view: ImageView,
    /// How the picture is adjusted for showing.
    pub adjustment: Adjustment,
    /// Where it was last shown.
    pub rect: Rect,
}

/// What the workspace of the frames remembers about showing.
#[derive(Debug)]
pub struct FramesView {
    /// The panes of the first and the last frame.
    pub panes: [PaneView; 2],
    /// The pane that keys speak to.
    pub active: Which,
    /// Whether both panes zoom and pan together.
    pub linked: bool,
    /// Whether each pane shows the other's frame.
    pub swapped: bool,
    /// Whether marks and wireframe are drawn.
    pub show_marks: bool,
    /// Whether names are drawn.
    pub show_names: bool,
    /// How the wireframe is drawn.
    pub wireframe: WireframeStyle,
    /// Whether the simulated last frame lies over the real one.
    pub replay: replay::ReplayView,
    /// How the loupe is used.
    pub loupe: LoupeStyle,
    /// What a click does.
    pub tool: Tool,
    /// The regions whose points are to be marked.
    pub regions: BTreeSet<String>,
    /// The widgets of the panes, which take the keyboard when nothing else has it.
    pub canvases: Vec<egui::Id>,
    /// The point in the hand.
    pub drag: Option<Drag>,
    /// The point that the guide has placed last.
    pub placed: Option<PointId>,
    /// The guided tool that was put down because everything had its mark: an undo takes it up again.
    pub finished: Option<Tool>,
    /// The tab shown beside the frames.
    pub side: SideTab,
    /// The table of points.
    pub table: TableView,
    /// Whether the table is shown.
    pub table_shown: bool,
    /// Whether marks snap to crossings of the painted grid.
    pub snap: bool,
    /// Where a mark has gone by itself, until something else is done.
    pub trace: Option<Trace>,
    /// How suggestions are used.
    pub suggest: SuggestStyle,
    /// What is in doubt.
    pub doubt: doubt::DoubtView,
    /// Marks to blame for folded triangles of the last frame.
    pub guilty: Vec<u32>,
    /// What is being typed into the settings.
    pub settings: settings::SettingsView,
    /// The face ready for drawing, with the stamp of the face that it was made of.
    drawing: Option<(u64, Arc<FaceDrawing>)>,
}

impl Default for FramesView {
    fn default() -> Self {
        let pane = PaneView { view: ImageView::default(), adjustment: Adjustment::default(), rect: Rect::NOTHING };
        Self {
            panes: [pane; 2],
            active: Which::First,
            linked: true,
            swapped: false,
            show_marks: true,
            show_names: false,
            wireframe: WireframeStyle::default(),
            replay: replay::ReplayView::default(),
            loupe: LoupeStyle::default(),
            tool: Tool::Select,
            regions: BTreeSet::new(),
            canvases: Vec::new(),
            drag: None,
            placed: None,
            finished: None,
            side: SideTab::Guide,
            table: TableView::default(),
            table_shown: true,
            snap: true,
            trace: None,
            suggest: SuggestStyle::default(),
            doubt: doubt::DoubtView::default(),
            guilty: Vec::new(),
            settings: settings::SettingsView::default(),
            drawing: None,
        }
    }
}

impl FramesView {
    /// The face ready for drawing: made once a face.
    fn drawing(&mut self, scene: Scene<'_>) -> Arc<FaceDrawing> {
        match &self.drawing {
            Some((stamp, drawing)) if *stamp == scene.stamp.face => Arc::clone(drawing),
            _ => {
                let drawing = Arc::new(FaceDrawing::new(scene.face.mesh()));
                self.drawing = Some((scene.stamp.face, Arc::clone(&drawing)));
                drawing
            }
        }
    }

    /// Zooms a pane at a place of the screen, and the other at the place across when they are linked.
    pub fn zoom(&mut self, which: Which, factor: f64, at: Pos2) {
        let offset = at - self.panes[which as usize].rect.center();
        for pane in self.together(which) {
            let (rect, centre) = (pane.rect, pane.rect.center());
            pane.view.zoom_at(factor, centre + offset, rect);
        }
    }

    /// Moves a pane's picture, and the other's when they are linked.
    pub fn pan(&mut self, which: Which, by: Vec2) {
        for pane in self.together(which) {
            pane.view.pan(by);
        }
    }

    /// Hides or shows the wireframe. While everything over the pictures is hidden, it is asked for, and so comes back with the marks.
    pub fn toggle_wireframe(&mut self) {
        self.wireframe.visible = !self.show_marks || !self.wireframe.visible;
        self.show_marks = true;
    }

    /// Shows both whole pictures.
    pub fn fit(&mut self) {
        for pane in &mut self.panes {
            pane.view.fitted = true;
        }
    }

    /// Moves a pane so that a pixel is in its middle, if it is not in view already.
    pub fn bring_to_view(&mut self, which: Which, at: [f64; 2]) {
        let pane = &mut self.panes[which as usize];
        let place = pane.view.at(pane.rect).ui_from_image(at);
        if !pane.rect.contains(place) {
            let by = pane.rect.center() - place;
            self.pan(which, by);
        }
    }

    fn together(&mut self, which: Which) -> impl Iterator<Item = &mut PaneView> {
        let linked = self.linked;
        self.panes.iter_mut().enumerate().filter(move |(i, _)| linked || *i == which as usize).map(|(_, p)| p)
    }
}

/// Width of the panel beside the frames, ui points.
const SIDE_WIDTH: f32 = 316.0;

/// Shows the workspace in the whole of `ui`.
#[expect(clippy::too_many_arguments, reason = "what a panel may read, its own view, and the commands")]
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    pictures: &Pictures,
    history: &crate::project::History,
    state: &ActionState,
    view: &mut FramesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let chosen = points::chosen_vertices(scene, &view.regions);
    let drawing = view.drawing(scene);
    if view.drag.is_none() {
        view.doubt.follow(scene.project);
    }
    view.guilty = view.doubt.guilty(scene, &chosen);
    // Of a width that no content changes: the panes beside it must not move under the pointer.
    egui::Panel::right("side").exact_size(SIDE_WIDTH).show(ui, |ui| {
        side_tabs(ui, view);
        egui::ScrollArea::vertical().id_salt(view.side as usize).auto_shrink(false).show(ui, |ui| match view.side {
            SideTab::Guide => guide::show(ui, scene, &drawing, &chosen, view, focus, state, commands),
            SideTab::Doubt => doubt::show(ui, scene, &chosen, view, state, commands),
            SideTab::Results => results::show(ui, scene, focus, commands),
            SideTab::Settings => settings::show(ui, scene, view, commands),
            SideTab::History => history::show(ui, history, commands),
        });
    });
    egui::Panel::top("tools").show(ui, |ui| toolbar::show(ui, view, state, commands));
    // The table tells where marks are, which a hand that marks points again must not see.
    if view.table_shown && view.doubt.again.is_none() {
        egui::Panel::bottom("table").resizable(true).default_size(168.0).size_range(96.0..=520.0).show(ui, |ui| {
            let gaps = view.doubt.gaps(scene, &chosen);
            points_table::show(ui, scene, &chosen, gaps, &mut view.table, focus, commands);
        });
    }
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        let whole = ui.max_rect();
        ui.painter().rect_filled(whole, 0.0, ui.visuals().panel_fill);
        let blink = keys::is_held(ui.ctx(), Hold::Blink) && !ui.ctx().text_edit_focused() && view.drag.is_none();
        let order = if view.swapped ^ blink { [Which::Last, Which::First] } else { [Which::First, Which::Last] };
        let half = Vec2::new((whole.width() - 2.0) / 2.0, whole.height());
        let places = [Rect::from_min_size(whole.min, half), Rect::from_min_size(whole.max - half, half)];
        for (which, rect) in order.into_iter().zip(places) {
            pane::show(ui, rect, scene, &drawing, which, pictures.get(which), &chosen, state, view, focus, commands);
        }
    });
}

fn side_tabs(ui: &mut egui::Ui, view: &mut FramesView) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        // All five have room in the width of the panel.
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 7.0;
        for (tab, title) in SideTab::ALL {
            ui.selectable_value(&mut view.side, tab, title);
        }
    });
    ui.separator();
}
