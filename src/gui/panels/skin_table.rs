//! The stress–strain table of the skin: its curve, its rows, and what happens beyond wrinkling.

use egui::{Pos2, Sense, Stroke, Vec2};

use super::settings::Number;
use crate::gui::{Command, theme};
use crate::project::{Edit, Settings};
use crate::skin::{Contraction, StressStrainCurve};

/// What is being typed into the table.
#[derive(Debug, Default)]
pub struct SkinTableView {
    /// Why the last change was refused.
    refused: Option<String>,
}

/// Shows the table.
pub fn show(ui: &mut egui::Ui, settings: &Settings, view: &mut SkinTableView, commands: &mut Vec<Command>) {
    let curve = &settings.skin;
    plot(ui, curve);
    ui.label("In contraction");
    for (rule, label, tooltip) in [
        (
            Contraction::Saturating,
            "Skin wrinkles and carries no more",
            "The stress stays what it is at the wrinkling strain.",
        ),
        (Contraction::Fung, "The table goes on", "The thesis's reading."),
    ] {
        if ui.radio(curve.contraction() == rule, label).on_hover_text(tooltip).clicked() {
            set(settings, StressStrainCurve::new(curve.rows().to_vec(), rule), view, commands);
        }
    }
    egui::CollapsingHeader::new("Rows: strain, stress kPa").id_salt("skin rows").show(ui, |ui| {
        for (i, row) in curve.rows().iter().enumerate() {
            ui.push_id(i, |ui| row_ui(ui, i, *row, settings, view, commands));
        }
        if ui.button("The default table").clicked() {
            set(settings, Ok::<_, String>(StressStrainCurve::default()), view, commands);
        }
    });
    if let Some(why) = &view.refused {
        ui.colored_label(ui.visuals().warn_fg_color, why);
    }
}

fn row_ui(
    ui: &mut egui::Ui,
    i: usize,
    row: [f64; 2],
    settings: &Settings,
    view: &mut SkinTableView,
    commands: &mut Vec<Command>,
) {
    for (k, (label, unit, speed)) in [("Strain", "", 0.001), ("Stress", " kPa", 0.1)].into_iter().enumerate() {
        let tooltip = "Rows must stay in order of strain, with stress growing.";
        let label = format!("{label} {}", i + 1);
        let number = Number { label: &label, unit, tooltip, range: -1e4..=1e4, speed, decimals: 3 };
        let mut own = Vec::new();
        number.show(ui, row[k], &mut own, |value| {
            let mut rows = settings.skin.rows().to_vec();
            rows[i][k] = value;
            let mut new = settings.clone();
            match StressStrainCurve::new(rows, settings.skin.contraction()) {
                Ok(skin) => {
                    view.refused = None;
                    new.skin = skin;
                }
                Err(e) => view.refused = Some(e.to_string()),
            }
            Edit::SetSettings(new)
        });
        commands.append(&mut own);
    }
}

fn set<E: std::fmt::Display>(
    settings: &Settings,
    curve: Result<StressStrainCurve, E>,
    view: &mut SkinTableView,
    commands: &mut Vec<Command>,
) {
    match curve {
        Ok(skin) => {
            view.refused = None;
            commands.push(Command::Edit(Edit::SetSettings(Settings { skin, ..settings.clone() })));
        }
        Err(e) => view.refused = Some(e.to_string()),
    }
}

/// The curve over the strains that skin meets.
fn plot(ui: &mut egui::Ui, curve: &StressStrainCurve) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 96.0), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Stress over strain of the skin"));
    let p = theme::palette(ui.visuals());
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 4.0, p.card);
    let strains: Vec<f64> = (0..=120).map(|i| -0.4 + 0.9 * f64::from(i) / 120.0).collect();
    let stress: Vec<f64> = strains.iter().map(|&e| curve.stress_kpa(e)).collect();
    let (low, high) = stress.iter().fold((0.0_f64, 0.0_f64), |(l, h), &s| (l.min(s), h.max(s)));
    let area = rect.shrink2(Vec2::new(8.0, 14.0));
    let place = |e: f64, s: f64| {
        Pos2::new(
            area.left() + area.width() * ((e + 0.4) / 0.9) as f32,
            area.bottom() - area.height() * ((s - low) / (high - low).max(1e-9)) as f32,
        )
    };
    let axis = Stroke::new(1.0, p.line);
    painter.vline(place(0.0, 0.0).x, area.y_range(), axis);
    painter.hline(area.x_range(), place(0.0, 0.0).y, axis);
    let line: Vec<Pos2> = strains.iter().zip(&stress).map(|(&e, &s)| place(e, s)).collect();
    painter.line(line, Stroke::new(1.8, p.accent));
    for row in curve.rows().iter().filter(|r| (-0.4..=0.5).contains(&r[0])) {
        painter.circle_filled(place(row[0], row[1]), 2.4, p.accent);
    }
    let font = egui::FontId::proportional(10.0);
    let weak = ui.visuals().weak_text_color();
    painter.text(
        rect.left_top() + Vec2::new(6.0, 3.0),
        egui::Align2::LEFT_TOP,
        format!("{high:.0} kPa"),
        font.clone(),
        weak,
    );
    painter.text(
        rect.left_bottom() + Vec2::new(6.0, -2.0),
        egui::Align2::LEFT_BOTTOM,
        "strain −40 %",
        font.clone(),
        weak,
    );
    painter.text(rect.right_bottom() - Vec2::new(6.0, 2.0), egui::Align2::RIGHT_BOTTOM, "+50 %", font, weak);
}
