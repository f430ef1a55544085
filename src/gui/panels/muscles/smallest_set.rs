//! How the smallest set of muscles was found: each muscle added, and what it bought.

use egui::Ui;

use super::{Shown, table};
use crate::export::muscle_tables;
use crate::fit::selection::Stopped;
use crate::muscle_field::fibres::muscle_name;

/// Shows the way.
pub(super) fn show(ui: &mut Ui, shown: &Shown<'_>) {
    let analysis = shown.analysis;
    let selection = &analysis.selection;
    let name = |f: usize| muscle_name(&shown.scene.face.muscles()[analysis.fibres[f].muscle]);
    let why = match selection.stopped {
        Stopped::Criterion => "the criterion rose",
        Stopped::HeldOut => "patches left out were explained no better",
        Stopped::NothingLeft => "no muscle was left that explains more",
        Stopped::Most => "no more were asked for",
    };
    let set = match selection.chosen.len() {
        0 => "No muscle explains the forces better than none does on patches left out.".to_owned(),
        1 => format!("One muscle explains the field: {}.", name(selection.chosen[0])),
        n => format!("{n} muscles explain the field; after {} steps {why}.", selection.taken),
    };
    let pruned = match selection.pruned.len() {
        0 => String::new(),
        _ => format!(
            " Given up on the way: {}.",
            selection.pruned.iter().map(|&f| name(f)).collect::<Vec<_>>().join("; ")
        ),
    };
    ui.label(format!("{set}{pruned} By {}, tested on {} patches.", analysis.shape.label(), selection.patches));
    ui.separator();
    table::show(ui, "smallest set", &muscle_tables::smallest_set(analysis, shown.scene.face), None);
}
