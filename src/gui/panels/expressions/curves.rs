//! Curves over time: the energy by its parts, and what the picked vertex does.

use egui::{Color32, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::{Curve, ExpressionsView};
use crate::gui::expression_work::Ready;
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::range::round_up;
use crate::gui::panels::forces::chart::{self, Chart};
use crate::muscle_field::section::Section;

/// Colours of the parts of the energy, told apart without red-green vision (Okabe and Ito 2008).
const PARTS: [(&str, Color32); 3] = [
    ("kinetic", Color32::from_rgb(213, 94, 0)),
    ("elastic", Color32::from_rgb(0, 114, 178)),
    ("left in the muscles", Color32::from_rgb(0, 158, 115)),
];

const CURVES: [(Curve, &str, &str); 3] = [
    (Curve::Displacement, "Displacement", "displacement, mm"),
    (Curve::Speed, "Speed", "speed, mm/s"),
    (Curve::Force, "Force", "pull, N"),
];

/// Shows both charts side by side, with what they show above them.
pub(super) fn show(ui: &mut Ui, ready: &Ready, view: &mut ExpressionsView) {
    let picked = ready.samples.iter().rev().find_map(|s| s.picked);
    ui.horizontal(|ui| {
        for (name, colour) in PARTS {
            let (rect, _) = ui.allocate_exact_size(vec2(20.0, 12.0), Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.5, colour));
            ui.weak(name);
        }
        ui.separator();
        match picked {
            Some(picked) => {
                ui.label(format!("vertex {}", picked.vertex));
                for (curve, words, _) in CURVES {
                    ui.selectable_value(&mut view.curve, curve, words);
                }
            }
            None => _ = ui.weak("click a vertex of the face for its curve"),
        }
    });
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, "Energy and the picked vertex over time"));
    let inks = Inks::new(ui.visuals(), false);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 4.0, inks.canvas);
    let half = (rect.width() / 2.0).floor();
    let part =
        |k: usize| Rect::from_min_size(pos2(rect.left() + half * k as f32, rect.top()), vec2(half, rect.height()));
    let over_time = |of: &dyn Fn(&crate::expression::Sample) -> f64| -> Vec<[f64; 2]> {
        ready.samples.iter().map(|s| [s.time_s, of(s)]).collect()
    };

    let kinetic = over_time(&|s| s.energy.kinetic);
    let elastic = over_time(&|s| s.energy.elastic);
    let left = over_time(&|s| s.energy.loads);
    let lines = [&kinetic, &elastic, &left];
    let curves: Vec<(Stroke, &[[f64; 2]])> =
        PARTS.iter().zip(lines).map(|((_, c), points)| (Stroke::new(1.8, *c), points.as_slice())).collect();
    draw(&painter, part(0), "Energy", "energy, mJ", &curves, &inks);

    let (_, words, up) = CURVES.into_iter().find(|c| c.0 == view.curve).unwrap_or(CURVES[0]);
    let vertex = picked.map(|p| p.vertex);
    let of_vertex = over_time(&|s| match s.picked.filter(|p| Some(p.vertex) == vertex) {
        Some(p) => match view.curve {
            Curve::Displacement => p.displacement_mm,
            Curve::Speed => p.speed_mm_s,
            Curve::Force => p.force_n,
        },
        None => f64::NAN,
    });
    let title = vertex.map_or_else(|| words.to_owned(), |v| format!("{words} of vertex {v}"));
    let curves = [(Stroke::new(1.8, PARTS[0].1), of_vertex.as_slice())];
    draw(&painter, part(1), &title, up, &curves, &inks);
}

fn draw(painter: &egui::Painter, rect: Rect, title: &str, up: &str, curves: &[(Stroke, &[[f64; 2]])], inks: &Inks) {
    let times = || curves.iter().flat_map(|(_, points)| points.iter().map(|p| p[0]));
    let first = times().fold(f64::INFINITY, f64::min);
    let from = if first.is_finite() { first } else { 0.0 };
    // At least a second, so that the beginning is not a wild one.
    let along = [from, times().fold(from + 1.0, f64::max)];

    let all = curves.iter().flat_map(|(_, points)| points.iter().map(|p| p[1])).filter(|v| v.is_finite());
    let (low, high) = all.fold((0.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    // What is nothing but rounding is no curve.
    let end = |v: f64| if v.abs() < 1e-9 { 0.0 } else { v.signum() * round_up(v.abs()) };
    let values = match (end(low), end(high)) {
        (0.0, 0.0) => [0.0, 1.0],
        ends => [ends.0, ends.1],
    };
    let section = Section::default();
    let chart = Chart {
        title,
        across: "time, s",
        along: Some(along),
        up,
        section: &section,
        curves,
        values,
        colour: &|_| inks.text,
        lit: [None, None],
    };
    chart::draw(painter, rect, &chart, None, inks);
}
