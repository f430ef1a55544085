//! Stability maps that can be pointed at: the colour and letter of what failed first, the limit of theory drawn in.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::plot::{Pointed, colour};
use crate::draw::numbers::significant;
use crate::gui::height_map::ink::Inks;
use crate::study::cells::{Cell, Map, among, letter};
use crate::study::table::{in_words, words};

/// Height of a row at zoom 1, and widest column, points.
const ROW: f32 = 22.0;
const WIDEST: f32 = 84.0;
/// Room for the names of methods, and for numbers.
const NAMES: [f32; 2] = [190.0, 58.0];

/// Draws all maps of a part one below the other, side by side where they are many; gives the map and cell that the pointer is on.
pub(super) fn show(
    ui: &mut Ui,
    maps: &[Map],
    causes: &[String],
    zoom: f32,
    picked: Option<(&str, &str)>,
) -> (Pointed, Option<(String, String)>) {
    let mut pointed = (Pointed::default(), None);
    let of_methods = maps.iter().any(|m| m.up == "method");
    let room = ui.available_width();
    // Larger on a large screen.
    let zoom = zoom * (room / 1000.0).clamp(1.0, 2.0);
    let least = if of_methods { 520.0 } else { 330.0 } * zoom;
    let columns = ((room / least).floor().max(1.0) as usize).min(maps.len().max(1)).min(3);
    let width = (room / columns as f32).max(least) - 10.0;
    egui::ScrollArea::both().id_salt("maps").auto_shrink(false).show(ui, |ui| {
        for row in maps.chunks(columns) {
            ui.horizontal_top(|ui| {
                for map in row {
                    let found = one(ui, map, causes, width, zoom, picked);
                    if found.1.is_some() {
                        pointed = found;
                    }
                }
            });
            ui.add_space(8.0);
        }
        legend(ui, maps, causes);
    });
    pointed
}

fn one(
    ui: &mut Ui,
    map: &Map,
    causes: &[String],
    width: f32,
    zoom: f32,
    picked: Option<(&str, &str)>,
) -> (Pointed, Option<(String, String)>) {
    let names = NAMES[usize::from(map.up != "method")] * zoom.clamp(1.0, 1.4);
    let row = ROW * zoom;
    let (n, m) = (map.columns.len().max(1), map.rows.len());
    let above = if map.method.is_empty() { 6.0 } else { 24.0 };
    let size = vec2(width, above + row * m as f32 + 46.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let inks = Inks::new(ui.visuals(), false);
    let painter = ui.painter_at(rect);
    let cell = ((width - names - 6.0) / n as f32).min(WIDEST * zoom);
    let grid = Rect::from_min_size(rect.min + vec2(names, above), vec2(cell * n as f32, row * m as f32));
    let font = FontId::proportional(11.5 * zoom.clamp(1.0, 1.4));
    if !map.method.is_empty() {
        let at = pos2(grid.left(), grid.top() - 5.0);
        painter.text(at, Align2::LEFT_BOTTOM, &map.method, FontId::proportional(13.0), inks.text);
    }
    let place = |column: usize, r: usize| {
        let min = pos2(grid.left() + cell * column as f32, grid.bottom() - row * (r + 1) as f32);
        Rect::from_min_size(min, vec2(cell, row))
    };
    for r in 0..m {
        let at = pos2(grid.left() - 7.0, place(0, r).center().y);
        painter.text(at, Align2::RIGHT_CENTER, &map.rows[r], font.clone(), inks.text);
        for c in 0..map.columns.len() {
            paint(&painter, place(c, r), map.cell(c, r), causes, &inks);
            if let Some(x) = map.cell(c, r) {
                let cell = ui.interact(place(c, r), response.id.with((c, r)), Sense::hover());
                cell.widget_info(|| WidgetInfo::labeled(Role::GraphicsSymbol, true, said(x).replace('\n', ", ")));
            }
            if map.cell(c, r).is_some_and(|x| picked == Some((x.method.as_str(), x.setting.as_str()))) {
                let inner = place(c, r).shrink(1.0);
                painter.rect_stroke(inner, 0.0, Stroke::new(2.0, inks.selected), egui::StrokeKind::Inside);
            }
        }
    }
    for (c, value) in map.columns.iter().enumerate() {
        let at = pos2(place(c, 0).center().x, grid.bottom() + 4.0);
        painter.text(at, Align2::CENTER_TOP, short(*value), font.clone(), inks.text);
    }
    let below = pos2(grid.center().x, grid.bottom() + 24.0);
    painter.text(below, Align2::CENTER_TOP, words(&map.along), font.clone(), inks.weak_text);
    if map.up != "method" {
        // Reads upwards beside the numbers.
        let galley = painter.layout_no_wrap(words(&map.up), font, inks.weak_text);
        let at = pos2(rect.left(), grid.center().y + galley.size().x / 2.0);
        let mut beside = egui::epaint::TextShape::new(at, galley, inks.weak_text);
        beside.angle = -std::f32::consts::FRAC_PI_2;
        painter.add(beside);
    }
    limit(&painter, map, grid, row, cell, &inks);
    let name = if map.method.is_empty() { words(&map.along) } else { map.method.clone() };
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, format!("Stability map, {name}")));
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|p| response.contains_pointer() && grid.contains(*p));
    let under_pointer = pointer.and_then(|at: Pos2| {
        let c = ((at.x - grid.left()) / cell) as usize;
        let r = ((grid.bottom() - at.y) / row) as usize;
        map.cell(c, r).map(|x| (place(c, r), x))
    });
    let Some((at, found)) = under_pointer else { return (Pointed::default(), None) };
    painter.rect_stroke(at, 0.0, Stroke::new(1.5, inks.hovered), egui::StrokeKind::Inside);
    let pointed = Pointed { dot: None, clicked: response.clicked(), twice: response.double_clicked() };
    response.on_hover_text_at_pointer(said(found));
    (pointed, Some((found.method.clone(), found.setting.clone())))
}

/// What is said of a cell.
pub(super) fn said(cell: &Cell) -> String {
    let ended = format!("{} of {} ended well", cell.well, cell.runs);
    let mut lines = vec![cell.method.clone(), in_words(&cell.setting), ended];
    lines.extend(cell.cause.as_ref().map(|cause| format!("First cause of failure: {cause}")));
    lines.extend(cell.error.map(|e| format!("Median force error {} %", significant(100.0 * e, 2))));
    lines.join("\n")
}

fn paint(painter: &Painter, at: Rect, cell: Option<&Cell>, causes: &[String], inks: &Inks) {
    let dark = inks.canvas.r() < 100;
    let well = if dark { Color32::from_rgb(46, 50, 57) } else { Color32::from_rgb(236, 239, 244) };
    let place = cell.and_then(|c| c.cause.as_ref()).and_then(|cause| causes.iter().position(|c| c == cause));
    let fill = match (cell, place) {
        (None, _) => inks.canvas,
        (Some(_), None) => well,
        (Some(c), Some(k)) => {
            let strength = 0.3 + 0.4 * (1.0 - c.share() as f32);
            inks.canvas.lerp_to_gamma(colour(k, dark), strength)
        }
    };
    painter.rect_filled(at.shrink(0.5), 0.0, fill);
    if let (Some(c), Some(k)) = (cell, place) {
        let share = if c.well == 0 { String::new() } else { format!(" {}/{}", c.well, c.runs) };
        let text = format!("{}{share}", letter(k));
        painter.text(at.center(), Align2::CENTER_CENTER, text, FontId::proportional(11.5), inks.text);
    }
}

/// Where theory ends, row by row.
fn limit(painter: &Painter, map: &Map, grid: Rect, row: f32, cell: f32, inks: &Inks) {
    let mut path: Vec<Pos2> = Vec::new();
    let stroke = Stroke::new(2.2, inks.text);
    for r in 0..=map.rows.len() {
        let of_row = (0..map.columns.len()).find_map(|c| map.cell(c, r)?.limit);
        match of_row.filter(|_| r < map.rows.len()).and_then(|l| among(&map.columns, l)) {
            Some(at) => {
                let x = grid.left() + cell * (at as f32 + 0.5);
                let y = grid.bottom() - row * r as f32;
                path.extend([pos2(x, y), pos2(x, y - row)]);
            }
            None => {
                if path.len() > 1 {
                    painter.line(std::mem::take(&mut path), stroke);
                }
            }
        }
    }
}

/// The causes that these maps show, with the letters that they have in all.
fn legend(ui: &mut Ui, maps: &[Map], causes: &[String]) {
    let dark = ui.visuals().dark_mode;
    ui.horizontal_wrapped(|ui| {
        let cells = || maps.iter().flat_map(|m| &m.cells).flatten();
        let shown = |cause: &String| cells().any(|c| c.cause.as_ref() == Some(cause));
        for (k, cause) in causes.iter().enumerate().filter(|(_, cause)| shown(cause)) {
            let (rect, _) = ui.allocate_exact_size(vec2(22.0, 16.0), Sense::hover());
            let inks = Inks::new(ui.visuals(), false);
            ui.painter().rect_filled(rect, 2.0, inks.canvas.lerp_to_gamma(colour(k, dark), 0.7));
            ui.painter().text(rect.center(), Align2::CENTER_CENTER, letter(k), FontId::proportional(11.5), inks.text);
            ui.add(egui::Label::new(cause).extend());
            ui.add_space(8.0);
        }
    });
    ui.weak("No colour: every seed ends well. A number beside a letter: the seeds that do. The thick line is the limit of theory, for small motions.");
}

fn short(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-3 || value.abs() >= 1e6) { format!("{value:e}") } else { value.to_string() }
        .replace('-', "−")
}
