//! The table of points: what is known of each, where it is, how well it fits, and what force it carries.

use std::collections::BTreeMap;

use egui::{Align2, FontId, Rect, RichText, Sense, Vec2};

use super::marks;
use super::points::{self, Kind, Look};
use crate::displacement::VertexState;
use crate::doubt::Gap;
use crate::gui::suggesting::crossing_words;
use crate::gui::{Command, Focus, Scene, theme};
use crate::project::PointId;

/// How the table is sorted and what it lists.
#[derive(Clone, Debug, Default)]
pub struct TableView {
    /// The point that the table has shown as selected.
    followed: Option<PointId>,
    list: List,
    column: usize,
    descending: bool,
}

/// What is listed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum List {
    #[default]
    All,
    Landmarks,
    Features,
    Still,
}

/// A row.
struct Row {
    id: PointId,
    vertex: u32,
    look: Look,
    kind: Kind,
    name: String,
    /// x and y of the first frame, x and y of the last, residual, displacement, force, its error.
    numbers: [Option<f64>; 8],
    /// How sure a suggested place is, 0 to 1.
    sure: Option<f64>,
    /// Row and column of the crossing of the painted grid that it is on.
    crossing: Option<String>,
}

impl Row {
    /// What is known of it, in a few words.
    fn state(&self) -> String {
        let sure = self.sure.map(|s| format!(" {}", points::percent(s)));
        format!("{}{}", self.look.word(), sure.unwrap_or_default())
    }

    /// Name for screen readers; a predicted place is told with it, for nothing else is known of the point.
    fn spoken(&self) -> String {
        let on = self.crossing.as_ref().map(|c| format!(", {c}")).unwrap_or_default();
        let words = format!("Row {}, {}{on}", self.name, self.look.word());
        let (which, place) =
            if self.kind == Kind::Landmark { ("first", &self.numbers[..2]) } else { ("last", &self.numbers[2..4]) };
        match place {
            [Some(x), Some(y)] if matches!(self.look, Look::Predicted | Look::Suggested) => {
                format!("{words}, {which} {x:.1}, {y:.1} px")
            }
            _ => words,
        }
    }
}

/// Titles, widths (shares of what the first column leaves) and decimals of the columns.
const COLUMNS: [(&str, f32, usize); 10] = [
    ("Point", 0.0, 0),
    ("State", 1.1, 0),
    ("First x px", 1.0, 1),
    ("First y px", 1.0, 1),
    ("Last x px", 1.0, 1),
    ("Last y px", 1.0, 1),
    ("Residual px", 1.1, 2),
    ("Moved mm", 1.0, 2),
    ("Force", 1.15, 4),
    ("±", 1.0, 4),
];

/// The first of the columns in which the largest number is what is looked for.
const FROM_RESIDUAL: usize = 6;

/// What the residual of a point is.
const RESIDUAL: &str = "How far a mark lies from where it is expected. Landmarks: from the face before the morph; still points: from the head's motion; other points: from where their marked neighbours lead. Click for the worst first.";

/// Height of a row, ui points.
const ROW: f32 = 20.0;

/// Shows the table.
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    gaps: &[Gap],
    view: &mut TableView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let mut rows = rows(scene, chosen, gaps, view.list);
    sort(&mut rows, view);
    let counts = rows.len();
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        for (list, title) in [
            (List::All, "All"),
            (List::Landmarks, "Landmarks"),
            (List::Features, "Feature points"),
            (List::Still, "Still points"),
        ] {
            ui.selectable_value(&mut view.list, list, title);
        }
        ui.label(RichText::new(format!("{counts} points")).weak()).on_hover_text("Predicted places are never data.");
    });
    let cells = columns(ui.available_width() - 10.0);
    header(ui, scene, view, &cells);
    ui.spacing_mut().item_spacing.y = 0.0;
    let mut area = egui::ScrollArea::vertical().auto_shrink(false);
    // A point selected elsewhere is brought to sight, once; then the table is the person's own to scroll.
    if view.followed != focus.selected {
        view.followed.clone_from(&focus.selected);
        if let Some(at) = rows.iter().position(|r| is_selected(r, focus)) {
            area = area.vertical_scroll_offset((at as f32 * ROW - ui.available_height() / 2.0).max(0.0));
        }
    }
    area.show_rows(ui, ROW, rows.len(), |ui, shown| {
        for row in rows.get(shown).unwrap_or_default() {
            show_row(ui, row, &cells, focus, commands);
        }
    });
}

/// The columns that there is room for, each with its left and right edge: positions go first, for the panes show them.
fn columns(width: f32) -> Vec<(usize, f32, f32)> {
    let hidden: &[usize] = match width {
        w if w < 520.0 => &[2, 3, 4, 5, 7, 9],
        w if w < 700.0 => &[2, 3],
        _ => &[],
    };
    let shown: Vec<usize> = (1..COLUMNS.len()).filter(|i| !hidden.contains(i)).collect();
    let shares: f32 = shown.iter().map(|&i| COLUMNS[i].1).sum();
    // Long names need room; numbers need no more than they are wide.
    let unit = ((width - 200.0) / shares).clamp(58.0, 96.0);
    let mut at = (width - shares * unit).max(120.0);
    let mut cells = vec![(0, 0.0, at)];
    for i in shown {
        let right = at + COLUMNS[i].1 * unit;
        cells.push((i, at, right));
        at = right;
    }
    cells
}

fn header(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut TableView, cells: &[(usize, f32, f32)]) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW + 2.0), Sense::hover());
    let unit = if scene.outcome.scale_measured { "N" } else { "rel." };
    for &(i, left, right) in cells {
        let title = COLUMNS[i].0;
        let title = if i >= 8 { format!("{title} {unit}") } else { title.to_owned() };
        let cell = Rect::from_x_y_ranges(rect.left() + left..=rect.left() + right, rect.y_range());
        let response = ui.interact(cell, ui.scope_id().with(("column", i)), Sense::click());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Sort by {title}")));
        let response = if i == FROM_RESIDUAL { response.on_hover_text(RESIDUAL) } else { response };
        if response.clicked() {
            // Of a residual, a force or an error the worst comes first.
            let first = i >= FROM_RESIDUAL;
            view.descending = if view.column == i { !view.descending } else { first };
            view.column = i;
        }
        let sorted = view.column == i;
        let colour = if sorted || response.hovered() {
            ui.visuals().strong_text_color()
        } else {
            ui.visuals().weak_text_color()
        };
        let (anchor, at) = cell_anchor(i, cell);
        let painter = ui.painter().with_clip_rect(cell);
        let written = painter.text(at, anchor, title, FontId::proportional(11.0), colour);
        if sorted {
            let x = if anchor == Align2::LEFT_CENTER { written.right() + 6.0 } else { written.left() - 6.0 };
            sort_arrow(&painter, egui::pos2(x, cell.center().y), view.descending, colour);
        }
    }
    ui.painter().hline(rect.x_range(), rect.bottom(), ui.visuals().widgets.noninteractive.bg_stroke);
}

/// A small triangle: which way the column is sorted.
fn sort_arrow(painter: &egui::Painter, at: egui::Pos2, descending: bool, colour: egui::Color32) {
    let tip = if descending { 2.5 } else { -2.5 };
    let corners = vec![at + Vec2::new(0.0, tip), at + Vec2::new(-3.0, -tip), at + Vec2::new(3.0, -tip)];
    painter.add(egui::Shape::convex_polygon(corners, colour, egui::Stroke::NONE));
}

/// Words to the left, numbers to the right.
fn cell_anchor(column: usize, cell: Rect) -> (Align2, egui::Pos2) {
    if column < 2 {
        (Align2::LEFT_CENTER, cell.left_center() + Vec2::new(6.0, 0.0))
    } else {
        (Align2::RIGHT_CENTER, cell.right_center() - Vec2::new(8.0, 0.0))
    }
}

/// A feature point is one row, whichever frame it is selected in.
fn is_selected(row: &Row, focus: &Focus) -> bool {
    let same_vertex = focus.selected_vertex() == Some(row.vertex) && row.kind != Kind::Landmark;
    focus.selected.as_ref() == Some(&row.id) || same_vertex
}

fn show_row(ui: &mut egui::Ui, row: &Row, cells: &[(usize, f32, f32)], focus: &mut Focus, commands: &mut Vec<Command>) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW), Sense::click());
    let spoken = row.spoken();
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::ListBoxOption, true, false, &spoken));
    let selected = is_selected(row, focus);
    let visuals = ui.visuals();
    if selected {
        ui.painter().rect_filled(rect, 3.0, visuals.selection.bg_fill);
    } else if response.hovered() || focus.hovered() == Some(row.vertex) {
        ui.painter().rect_filled(rect, 3.0, visuals.widgets.hovered.weak_bg_fill.gamma_multiply(0.6));
    }
    if response.hovered() {
        focus.hover(row.vertex);
    }
    if response.clicked() {
        commands.push(Command::JumpTo(row.id.clone()));
    }
    // Where the column cuts the name, the pointer shows it whole.
    response.on_hover_ui_at_pointer(|ui| {
        let on = row.crossing.as_ref().map(|c| format!(", on the crossing in {c}")).unwrap_or_default();
        ui.label(format!("{}, {}{on}", row.name, row.state()));
    });
    let (text, weak) = (visuals.text_color(), visuals.weak_text_color());
    let quiet = !row.look.is_mark();
    for &(i, left, right) in cells {
        let cell = Rect::from_x_y_ranges(rect.left() + left..=rect.left() + right, rect.y_range());
        let (anchor, mut at) = cell_anchor(i, cell);
        let words = match i {
            0 => {
                let dot = cell.left_center() + Vec2::new(13.0, 0.0);
                ui.painter().circle_filled(dot, 4.0, marks::colour(row.kind));
                ui.painter().circle_stroke(dot, 4.0, egui::Stroke::new(1.0, theme::on_picture::HALO));
                at.x += 20.0;
                row.name.clone()
            }
            1 => row.state(),
            _ => row.numbers[i - 2].map_or_else(|| "–".to_owned(), |n| format!("{n:.*}", COLUMNS[i].2)),
        };
        let font = if i < 2 { FontId::proportional(12.5) } else { FontId::monospace(11.5) };
        let colour = if quiet && i > 0 { weak } else { text };
        let mut job = egui::text::LayoutJob::simple_singleline(words, font, colour);
        job.wrap = egui::text::TextWrapping::truncate_at_width((cell.right() - at.x - 4.0).max(20.0));
        // A number is cut by its cell rather than shortened to another number.
        if i > 1 {
            job.wrap = egui::text::TextWrapping::no_max_width();
        }
        let galley = ui.painter().layout_job(job);
        let place = anchor.anchor_size(at, galley.size());
        ui.painter().with_clip_rect(cell.intersect(ui.clip_rect())).galley(place.min, galley, colour);
    }
}

fn rows(scene: Scene<'_>, chosen: &[u32], gaps: &[Gap], list: List) -> Vec<Row> {
    let mut rows = Vec::new();
    if matches!(list, List::All | List::Landmarks) {
        for l in scene.face.landmarks() {
            let id = PointId::Landmark(l.id.clone());
            let Some((look, at)) = points::of(scene, &id) else { continue };
            let shown = look != Look::Unset;
            let residual = scene.outcome.fit.residuals_before_px.iter().find(|(r, _)| r == &l.id).map(|(_, px)| *px);
            rows.push(Row {
                vertex: l.vertex,
                look,
                kind: Kind::Landmark,
                name: l.name.clone(),
                numbers: [shown.then_some(at[0]), shown.then_some(at[1]), None, None, residual, None, None, None],
                sure: None,
                crossing: None,
                id,
            });
        }
    }
    if list == List::Landmarks {
        return rows;
    }
    let still = scene.outcome.still_residuals_px(scene.project);
    let gap: BTreeMap<u32, f64> = gaps.iter().map(|g| (g.vertex, g.px)).collect();
    for &v in chosen {
        let kind = points::kind_of(scene, v);
        if list == List::Still && kind != Kind::Still || list == List::Features && kind != Kind::Feature {
            continue;
        }
        rows.push(feature_row(scene, v, kind, still.get(&v).or_else(|| gap.get(&v)).copied()));
    }
    rows
}

fn feature_row(scene: Scene<'_>, v: u32, kind: Kind, residual: Option<f64>) -> Row {
    let id = PointId::FeatureLast(v);
    let (look, place) = points::of(scene, &id).unwrap_or((Look::Unset, [f64::NAN; 2]));
    let at = Some(place).filter(|_| look != Look::Unset);
    let first = points::predicted(scene, crate::project::Which::First, v);
    let o = scene.outcome;
    let i = v as usize;
    let state = o.states.get(i).copied().unwrap_or_default();
    let moved = o.first.get(i).zip(o.last.get(i)).map(|(a, b)| (b - a).norm()).filter(|_| state.is_known());
    let believed = matches!(state, VertexState::Measured | VertexState::Inferred);
    let finite = |x: f64| x.is_finite().then_some(x);
    Row {
        vertex: v,
        look,
        kind,
        name: format!("{} {v}", kind.word()),
        numbers: [
            finite(first[0]),
            finite(first[1]),
            at.map(|p| p[0]),
            at.map(|p| p[1]),
            residual,
            moved,
            o.field.force.get(i).map(nalgebra::Vector3::norm).filter(|_| believed),
            o.field.sigma.get(i).copied().filter(|_| believed),
        ],
        sure: points::suggestion(scene, v).map(|s| s.confidence),
        crossing: points::crossing_of(scene, v).map(crossing_words),
        id,
    }
}

fn sort(rows: &mut [Row], view: &TableView) {
    match view.column {
        // The order of marking, or that order turned round.
        0 => {}
        1 => rows.sort_by(|a, b| a.look.cmp(&b.look).then(a.sure.unwrap_or(1.0).total_cmp(&b.sure.unwrap_or(1.0)))),
        c => rows.sort_by(|a, b| {
            // What has no number stands last either way.
            let key = |r: &Row| r.numbers[c - 2].map_or(f64::INFINITY, |n| if view.descending { -n } else { n });
            key(a).total_cmp(&key(b))
        }),
    }
    if view.column < 2 && view.descending {
        rows.reverse();
    }
}
