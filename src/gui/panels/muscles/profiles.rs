//! Observed forces along and across the chosen muscle, with their error bars and each law's curve through them (Thesis Fig. 5.7).

use egui::{Color32, Painter, Pos2, Rect, Response, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::{MusclesView, Shown};
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::range::round_up;
use crate::gui::panels::forces::chart::{self, Chart};
use crate::gui::{Command, Focus};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::profiles::{Observed, Part, Profile, Way, profile_of_laws};
use crate::muscle_field::section::{ProfilePoint, Section};
use crate::project::PointId;

/// Colours of the laws, in the order of the table, that can be told apart without red-green vision (Okabe and Ito 2008).
const LAWS: [Color32; 6] = [
    Color32::from_rgb(0, 114, 178),
    Color32::from_rgb(230, 159, 0),
    Color32::from_rgb(0, 158, 115),
    Color32::from_rgb(213, 94, 0),
    Color32::from_rgb(204, 121, 167),
    Color32::from_rgb(86, 180, 233),
];

/// Shows both charts side by side, and the names of the laws above them.
pub(super) fn show(
    ui: &mut Ui,
    shown: &Shown<'_>,
    view: &mut MusclesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let (scene, analysis) = (shown.scene, shown.analysis);
    let Some(fibre) = analysis.fibres.iter().position(|f| Some(f.muscle) == shown.muscle) else {
        ui.label("No muscle is chosen: click one on the left or on a map.");
        return;
    };
    legend(ui, shown, view);
    let cut = |way| profile_of_laws(scene.face.mesh(), scene.outcome, analysis, fibre, way, view.part);
    let [Some(radial), Some(lateral)] = Way::ALL.map(cut) else {
        ui.label("This muscle stands upright on the picture: it has no profile.");
        return;
    };
    let canvas = Canvas::new(ui, view.part, shown.unit, Sense::click(), focus);
    let values = limits(&[&radial, &lateral]);
    let name = muscle_name(&scene.face.muscles()[analysis.fibres[fibre].muscle]);
    let half = (canvas.rect.width() / 2.0).floor();
    let stroke = |law: usize| Stroke::new(if law == shown.law { 3.0 } else { 1.5 }, colour(law));
    for (k, profile) in [&radial, &lateral].into_iter().enumerate() {
        let corner = pos2(canvas.rect.left() + half * k as f32, canvas.rect.top());
        let part = Rect::from_min_size(corner, vec2(half, canvas.rect.height()));
        let title = match profile.way {
            Way::Radial => format!("Along {name}; insertion at {:.0} mm", profile.insertion_mm),
            Way::Lateral => format!("Across {name}"),
        };
        if let Some(v) = canvas.profile(part, &title, profile, values, &stroke) {
            focus.hover(v as u32);
            if canvas.response.clicked() {
                commands.push(Command::Select(Some(PointId::FeatureLast(v as u32))));
            }
        }
    }
    let words = format!("Profiles along and across {name}");
    canvas.is_called(&words);
}

/// The ground that profiles are drawn on: all the room that is left.
pub(super) struct Canvas {
    pub(super) rect: Rect,
    pub(super) response: Response,
    painter: Painter,
    inks: Inks,
    /// At the vertical axis.
    up: String,
    pointer: Option<Pos2>,
    /// Vertices lit up: selected and hovered.
    pub(super) lit: [Option<usize>; 2],
}

impl Canvas {
    pub(super) fn new(ui: &mut Ui, part: Part, unit: &str, sense: Sense, focus: &Focus) -> Self {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, sense);
        let inks = Inks::new(ui.visuals(), part == Part::AlongFibre);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, inks.canvas);
        Self {
            rect,
            response,
            painter,
            inks,
            up: format!("{}, {unit}", if part == Part::Magnitude { "Force" } else { "Along the fibre" }),
            pointer: ui.input(|i| i.pointer.hover_pos()).filter(|p| rect.contains(*p)),
            lit: [focus.selected_vertex(), focus.hovered()].map(|v| v.map(|v| v as usize)),
        }
    }

    /// Says to screen readers and tests what it shows.
    pub(super) fn is_called(&self, words: &str) {
        self.response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, words));
    }

    /// Draws one profile with its curves; gives the vertex that is pointed at.
    pub(super) fn profile(
        &self,
        rect: Rect,
        title: &str,
        profile: &Profile,
        values: [f64; 2],
        stroke: &dyn Fn(usize) -> Stroke,
    ) -> Option<usize> {
        let points = profile.observed.iter().filter(|o| o.believed);
        let point = |o: &Observed| ProfilePoint {
            vertex: o.vertex as usize,
            at_mm: o.at_mm,
            value: o.value,
            error: Some(o.sigma),
        };
        let section = Section { pieces: Vec::new(), points: points.map(point).collect() };
        let curves = profile.curves.iter().enumerate().map(|(k, curve)| (stroke(k), curve.points.as_slice()));
        let curves: Vec<(Stroke, &[[f64; 2]])> = curves.collect();
        let chart = Chart {
            title,
            across: profile.way.axis(),
            along: None,
            up: &self.up,
            section: &section,
            curves: &curves,
            values,
            colour: &|_| self.inks.text,
            lit: self.lit,
        };
        chart::draw(&self.painter, rect, &chart, self.pointer, &self.inks)
    }
}

fn colour(law: usize) -> Color32 {
    LAWS[law % LAWS.len()]
}

/// The laws with their colours; a click shows one in the map.
fn legend(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView) {
    ui.horizontal_wrapped(|ui| {
        let (dot, _) = ui.allocate_exact_size(vec2(10.0, 12.0), Sense::hover());
        ui.painter().circle_filled(dot.center(), 3.0, ui.visuals().text_color());
        ui.weak("measured, ± one standard error");
        for (k, row) in shown.analysis.laws.iter().enumerate().filter(|(_, r)| r.fit.is_ok()) {
            let (rect, _) = ui.allocate_exact_size(vec2(22.0, 12.0), Sense::hover());
            let width = if k == shown.law { 3.5 } else { 2.0 };
            ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(width, colour(k)));
            if ui.selectable_label(k == shown.law, row.label()).on_hover_text("Show it in the map").clicked() {
                view.law = (shown.analysis.best != Some(k)).then_some(k);
            }
        }
    });
}

/// Limits of the vertical axis that hold both charts: the points with their bars, and the curves as far as half beyond them. Where nothing was
/// measured a law may say anything, and must not flatten what was.
pub(super) fn limits(profiles: &[&Profile]) -> [f64; 2] {
    let points = profiles.iter().flat_map(|p| p.observed.iter().filter(|o| o.believed));
    let ends: Vec<f64> =
        points.flat_map(|o| [o.value - o.sigma, o.value + o.sigma]).filter(|v| v.is_finite()).collect();
    let most = 1.5 * ends.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let cut = if most > 0.0 { most } else { f64::MAX };
    let curves = profiles.iter().flat_map(|p| &p.curves).flat_map(|c| &c.points).map(|p| p[1].clamp(-cut, cut));
    let all = ends.iter().copied().chain(curves).filter(|v| v.is_finite());
    let (low, high) = all.fold((0.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    match (low < 0.0, high > 0.0) {
        (false, false) => [0.0, 1.0],
        (true, false) => [-round_up(-low), 0.0],
        (false, true) => [0.0, round_up(high)],
        (true, true) => [-round_up(-low), round_up(high)],
    }
}
