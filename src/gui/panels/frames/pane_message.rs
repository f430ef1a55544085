//! What a pane says when its picture is not there, or is not the one that was marked.

use egui::{Align2, RichText, Vec2};

use crate::gui::dialogs::Purpose;
use crate::gui::pictures::{Picture, PictureStatus};
use crate::gui::{Command, theme};
use crate::project::Which;

/// Fills a pane without a picture.
pub fn without_picture(
    ui: &mut egui::Ui,
    rect: egui::Rect,
    which: Which,
    picture: &Picture,
    commands: &mut Vec<Command>,
) {
    let (title, hint) = match which {
        Which::First => ("First frame", "The neutral face, before the expression."),
        Which::Last => ("Last frame", "The face at the height of the expression."),
    };
    let area = egui::Rect::from_center_size(rect.center(), Vec2::new(rect.width().min(300.0) - 20.0, 150.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(area).id_salt(which.word()), |ui| {
        ui.vertical_centered(|ui| {
            ui.label(RichText::new(title).heading());
            ui.label(RichText::new(hint).weak());
            ui.add_space(8.0);
            if let PictureStatus::Failed(why) = picture.status() {
                ui.colored_label(theme::palette(ui.visuals()).warn, why);
            }
            let label = format!("Choose {} frame…", which.word());
            if ui.button(label).clicked() {
                commands.push(Command::AskFiles(Purpose::Frame(which)));
            }
            ui.label(RichText::new("or drop a picture here").small().weak());
        });
    });
}

/// Lays a notice over a pane whose picture is being read, is missing, or has changed.
pub fn over_picture(ui: &mut egui::Ui, rect: egui::Rect, which: Which, picture: &Picture, commands: &mut Vec<Command>) {
    let (text, find) = match picture.status() {
        PictureStatus::Reading => ("Reading the picture…".to_owned(), false),
        PictureStatus::Failed(why) => (why.to_owned(), true),
        PictureStatus::Ready { changed: true } => (
            "This file is not the one that was marked: its content has changed. The marks may not fit it.".to_owned(),
            true,
        ),
        _ => return,
    };
    let width = (rect.width() - 40.0).min(420.0);
    let place = Align2::CENTER_BOTTOM.align_size_within_rect(Vec2::new(width, 90.0), rect.shrink(16.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(place).id_salt(("over", which.word())), |ui| {
        egui::Frame::window(ui.style()).inner_margin(12).show(ui, |ui| {
            ui.set_width(width - 24.0);
            let colour = if find { theme::palette(ui.visuals()).warn } else { ui.visuals().text_color() };
            ui.colored_label(colour, text);
            if find && ui.button(format!("Find the {} frame…", which.word())).clicked() {
                commands.push(Command::AskFiles(Purpose::Frame(which)));
            }
        });
    });
}
