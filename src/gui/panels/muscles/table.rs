//! A table of words and numbers, its best row marked, a row chosen by a click.

use egui::{Align, Color32, Grid, Layout, RichText, Ui};

use crate::export::muscle_tables::Table;

/// Shows a table; gives the row that was clicked. The first column is words, the others are numbers.
pub(super) fn show(ui: &mut Ui, name: &str, table: &Table, chosen: Option<usize>) -> Option<usize> {
    let scroll = egui::ScrollArea::both().id_salt(name).auto_shrink(false);
    scroll.show(ui, |ui| whole(ui, name, table, chosen)).inner
}

/// The same as high as it is; what is too wide is scrolled.
pub(super) fn show_whole(ui: &mut Ui, name: &str, table: &Table, chosen: Option<usize>) -> Option<usize> {
    let scroll = egui::ScrollArea::horizontal().id_salt(name).auto_shrink([false, true]);
    scroll.show(ui, |ui| whole(ui, name, table, chosen)).inner
}

fn whole(ui: &mut Ui, name: &str, table: &Table, chosen: Option<usize>) -> Option<usize> {
    let mut clicked = None;
    Grid::new(name).striped(true).spacing([18.0, 5.0]).show(ui, |ui| {
        for (column, (title, hint)) in table.head.iter().enumerate() {
            cell(ui, column, RichText::new(*title).strong()).on_hover_text(*hint);
        }
        ui.end_row();
        for (k, row) in table.rows.iter().enumerate() {
            for (column, words) in row.iter().enumerate() {
                if column == 0 {
                    let label = if table.best == Some(k) { format!("{words} (best)") } else { words.clone() };
                    if ui.selectable_label(chosen == Some(k), label).clicked() {
                        clicked = Some(k);
                    }
                } else {
                    let weak = if words == "–" { ui.visuals().weak_text_color() } else { Color32::PLACEHOLDER };
                    cell(ui, column, RichText::new(words).color(weak));
                }
            }
            ui.end_row();
        }
    });
    clicked
}

fn cell(ui: &mut Ui, column: usize, words: RichText) -> egui::Response {
    if column == 0 {
        return ui.label(words);
    }
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(words)).inner
}
