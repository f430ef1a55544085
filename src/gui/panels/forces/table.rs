//! The table of vertices with a force, sorted by what the user asks for.

use egui::{Align, Layout, Sense, Ui, vec2};
use nalgebra::Point3;

use super::{ForcesView, select};
use crate::gui::height_map::options::significant;
use crate::gui::{Command, Focus, Scene};

/// A column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Column {
    /// Number of the vertex.
    Vertex,
    /// What is known of it.
    State,
    /// Length of the force.
    #[default]
    Force,
    /// Standard error.
    Error,
    /// Force over standard error.
    Ratio,
    /// Part in the skin.
    Tangential,
    /// Part out of it.
    Normal,
    /// How far the skin moved.
    Displacement,
    /// x of the face.
    X,
    /// y of the face.
    Y,
}

impl Column {
    /// From left to right.
    pub const ALL: [Self; 10] = [
        Self::Vertex,
        Self::State,
        Self::Force,
        Self::Error,
        Self::Ratio,
        Self::Tangential,
        Self::Normal,
        Self::Displacement,
        Self::X,
        Self::Y,
    ];

    /// Head of the column with its unit.
    pub fn title(self, unit: &str) -> String {
        match self {
            Self::Vertex => "Vertex".to_owned(),
            Self::State => "State".to_owned(),
            Self::Force => format!("Force, {unit}"),
            Self::Error => format!("±, {unit}"),
            Self::Ratio => "Force / ±".to_owned(),
            Self::Tangential => format!("In skin, {unit}"),
            Self::Normal => format!("Out of skin, {unit}"),
            Self::Displacement => "Moved, mm".to_owned(),
            Self::X => "x, mm".to_owned(),
            Self::Y => "y, mm".to_owned(),
        }
    }

    fn width(self) -> f32 {
        match self {
            Self::Vertex => 62.0,
            Self::State => 132.0,
            Self::X | Self::Y => 66.0,
            _ => 104.0,
        }
    }
}

/// Which column sorts the table, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sorting {
    /// The column.
    pub by: Column,
    /// Largest first.
    pub descending: bool,
}

impl Default for Sorting {
    fn default() -> Self {
        Self { by: Column::Force, descending: true }
    }
}

fn number(scene: Scene<'_>, first: &[Point3<f64>], column: Column, v: usize) -> f64 {
    let (outcome, field) = (scene.outcome, &scene.outcome.field);
    let at = |list: &[f64]| list.get(v).copied().unwrap_or(f64::NAN);
    match column {
        Column::Vertex => v as f64,
        // Measured first, border after it.
        Column::State => {
            let state = outcome.states[v] as u8;
            f64::from(state) + if outcome.border.get(v).copied().unwrap_or(false) { 0.5 } else { 0.0 }
        }
        Column::Force => field.force.get(v).map_or(f64::NAN, nalgebra::Vector3::norm),
        Column::Error => at(&field.sigma),
        Column::Ratio => field.force.get(v).map_or(f64::NAN, nalgebra::Vector3::norm) / at(&field.sigma),
        Column::Tangential => at(&field.tangential),
        Column::Normal => at(&field.normal),
        Column::Displacement => (outcome.last[v] - outcome.first[v]).norm(),
        Column::X => first[v].x,
        Column::Y => first[v].y,
    }
}

/// Vertices with a force, in the order asked for; equal ones by their number. What is not a number comes last.
pub(super) fn sorted(scene: Scene<'_>, first: &[Point3<f64>], sorting: Sorting) -> Vec<usize> {
    let outcome = scene.outcome;
    let count = outcome.states.len().min(outcome.first.len()).min(outcome.last.len());
    let mut rows: Vec<(f64, usize)> = (0..count)
        .filter(|&v| outcome.states[v].is_known())
        .map(|v| (number(scene, first, sorting.by, v), v))
        .collect();
    rows.sort_by(|a, b| {
        let order = if sorting.descending { b.0.total_cmp(&a.0) } else { a.0.total_cmp(&b.0) };
        a.0.is_nan().cmp(&b.0.is_nan()).then(order).then(a.1.cmp(&b.1))
    });
    rows.into_iter().map(|(_, v)| v).collect()
}

fn text(scene: Scene<'_>, first: &[Point3<f64>], column: Column, v: usize) -> String {
    match column {
        Column::Vertex => v.to_string(),
        Column::State => {
            let border = scene.outcome.border.get(v).copied().unwrap_or(false);
            format!("{}{}", scene.outcome.states[v].word(), if border { ", border" } else { "" })
        }
        Column::X | Column::Y | Column::Displacement => {
            format!("{:.1}", number(scene, first, column, v)).replace('-', "−")
        }
        Column::Error | Column::Ratio => significant(number(scene, first, column, v), 2),
        _ => significant(number(scene, first, column, v), 3),
    }
}

/// Shows the table; `first` are the vertices from the eyes, mm.
pub(super) fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    view: &mut ForcesView,
    first: &[Point3<f64>],
    selected: Option<usize>,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let unit = scene.outcome.unit();
    let rows = sorted(scene, first, view.sorting);
    egui::ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
        ui.vertical(|ui| {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 0.0;
                for column in Column::ALL {
                    head(ui, column, unit, &mut view.sorting);
                }
            });
            ui.separator();
            if rows.is_empty() {
                ui.weak("No vertex is measured yet: mark feature points in the last frame.");
            }
            let height = 20.0;
            ui.spacing_mut().item_spacing.y = 0.0;
            egui::ScrollArea::vertical().auto_shrink(false).show_rows(ui, height, rows.len(), |ui, shown| {
                for &v in &rows[shown] {
                    row(ui, scene, first, v, height, selected, focus, commands);
                }
            });
        });
    });
}

fn head(ui: &mut Ui, column: Column, unit: &str, sorting: &mut Sorting) {
    let chosen = sorting.by == column;
    let layout = if column == Column::State {
        Layout::left_to_right(Align::Center)
    } else {
        Layout::right_to_left(Align::Center)
    };
    ui.allocate_ui_with_layout(vec2(column.width(), 20.0), layout, |ui| {
        ui.set_min_width(column.width());
        if column == Column::State {
            ui.add_space(14.0);
        }
        let button = ui.add(egui::Button::new(column.title(unit)).frame(false)).on_hover_text("Sort by this column");
        if chosen {
            direction_sign(ui, button.rect, sorting.descending);
        }
        if button.clicked() {
            let descending =
                if chosen { !sorting.descending } else { !matches!(column, Column::Vertex | Column::State) };
            *sorting = Sorting { by: column, descending };
        }
    });
}

/// A small triangle under the title: pointing down where the largest is first.
fn direction_sign(ui: &Ui, title: egui::Rect, descending: bool) {
    let at = egui::pos2(title.center().x, title.bottom() + 1.0);
    let (foot, tip) = if descending { (-1.5, 2.5) } else { (2.5, -1.5) };
    let corners = vec![at + vec2(-4.0, foot), at + vec2(4.0, foot), at + vec2(0.0, tip)];
    ui.painter().add(egui::Shape::convex_polygon(corners, ui.visuals().hyperlink_color, egui::Stroke::NONE));
}

#[expect(clippy::too_many_arguments, reason = "what a panel may read, and the commands")]
fn row(
    ui: &mut Ui,
    scene: Scene<'_>,
    first: &[Point3<f64>],
    v: usize,
    height: f32,
    selected: Option<usize>,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let width: f32 = Column::ALL.iter().map(|c| c.width()).sum();
    let (rect, response) = ui.allocate_exact_size(vec2(width.max(ui.available_width()), height), Sense::click());
    let hovered = response.hovered() || focus.hovered() == Some(v as u32);
    if Some(v) == selected {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().selection.bg_fill);
    } else if hovered {
        ui.painter().rect_filled(rect, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
    }
    let font = egui::TextStyle::Body.resolve(ui.style());
    let mut x = rect.left();
    for column in Column::ALL {
        let (at, align) = if column == Column::State {
            (x + 14.0, egui::Align2::LEFT_CENTER)
        } else {
            (x + column.width(), egui::Align2::RIGHT_CENTER)
        };
        let colour = ui.visuals().text_color();
        ui.painter().text(egui::pos2(at, rect.center().y), align, text(scene, first, column, v), font.clone(), colour);
        x += column.width();
    }
    if response.hovered() {
        focus.hover(v as u32);
    }
    if response.clicked() {
        select(commands, v);
    }
    let words = format!("row of vertex {v}, {} {}", text(scene, first, Column::Force, v), scene.outcome.unit());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Row, true, Some(v) == selected, &words));
}
