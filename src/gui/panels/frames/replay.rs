//! The simulated last frame over the real one: its wireframe, and how far every measured point lies from where it was seen.

use egui::{Color32, Painter, Pos2, Rect, Stroke, UiBuilder, Vec2, pos2};

use super::pane::Pane;
use super::wireframe::{self, WireframeStyle};
use super::{FramesView, marks, points};
use crate::draw::ColourMap;
use crate::draw::numbers::{fixed, significant};
use crate::export::replay::both;
use crate::export::replay_picture::end_of_colours_mm;
use crate::gui::Focus;
use crate::gui::replay_work::Replayed;
use crate::gui::theme::on_picture;
use crate::muscle_field::Replay;
use crate::muscle_field::replay::Simulated;
use crate::project::Which;

/// What pulls on the skin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Under {
    /// The muscles that were found.
    #[default]
    Muscles,
    /// The measured forces themselves.
    Forces,
}

impl Under {
    fn of(self, replay: &Replay) -> &Simulated {
        match self {
            Self::Muscles => &replay.of_muscles,
            Self::Forces => &replay.of_forces,
        }
    }
}

/// Whether and how it is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplayView {
    /// Whether it is laid over the last frame.
    pub on: bool,
    /// Under which forces.
    pub under: Under,
}

/// Radius of the dot where a point is simulated, ui points.
const DOT: f32 = 3.2;
/// Size of the card, ui points.
const CARD: Vec2 = Vec2::new(292.0, 168.0);
/// Stripes of the colour bar.
const STRIPES: usize = 64;

fn colour(mm: f64, most_mm: f64) -> Color32 {
    let [r, g, b] = ColourMap::Viridis.of(Some(mm), [0.0, most_mm]);
    Color32::from_rgb(r, g, b)
}

/// The simulation, where this pane shows it.
fn shown<'a>(pane: &Pane<'a>, view: &FramesView) -> Option<Replayed<'a>> {
    let here = pane.which == Which::Last && view.show_marks && !pane.blind;
    pane.scene.replay.filter(|_| here && pane.scene.project.landmarks.len() >= points::LANDMARKS_TO_PREDICT)
}

/// Draws the wireframe and the distances.
pub fn paint(painter: &Painter, pane: &Pane<'_>, view: &FramesView, focus: &Focus) {
    let Some(Replayed::Found(replay)) = shown(pane, view) else { return };
    let simulated = view.replay.under.of(replay);
    let (face, levels, outcome) = (pane.scene.face, pane.drawing.levels(), pane.scene.outcome);
    let ui = |p: [f64; 2]| pane.transform.ui_from_image(p);
    let points_per_mm = outcome.camera.px_per_mm * pane.transform.zoom;
    // Another colour than that of the wireframe as it was marked.
    let colour_of_mesh = usize::from(view.wireframe.colour != 1);
    let style = WireframeStyle { visible: true, opacity: 0.6, colour: colour_of_mesh, region_only: false };
    wireframe::paint(painter, face, levels, &simulated.in_image, None, &style, points_per_mm, ui);
    let most_mm = end_of_colours_mm(replay);
    let pairs = replay.points.iter().zip(simulated.distance_px.iter().zip(&simulated.distance_mm));
    let mut told = None;
    for (&v, (&px, &mm)) in pairs {
        let (Some(seen), Some(there)) = (outcome.last_in_image.get(v as usize), simulated.in_image.get(v as usize))
        else {
            continue;
        };
        let ends = [ui([seen.x, seen.y]), ui([there.x, there.y])];
        if !ends.iter().all(|p| p.is_finite()) {
            continue;
        }
        let colour = colour(mm, most_mm);
        painter.line_segment(ends, Stroke::new(4.2, on_picture::HALO));
        painter.line_segment(ends, Stroke::new(2.4, colour));
        painter.circle(ends[1], DOT, colour, Stroke::new(1.0, on_picture::HALO));
        if focus.hovered().or(focus.selected_vertex()) == Some(v) {
            told = Some((
                ends[1],
                colour,
                format!("{v}: {} px, {} mm from where it was seen", fixed(px, 2), fixed(mm, 2)),
            ));
        }
    }
    if let Some((at, colour, words)) = told {
        painter.circle(at, 1.6 * DOT, colour, Stroke::new(1.5, on_picture::SELECTED));
        marks::name(painter, at + Vec2::new(0.0, 14.0), &words);
    }
}

/// The card in the corner of the pane: what pulls, the distances of all points, the colours.
pub fn card(ui: &mut egui::Ui, pane: &Pane<'_>, view: &mut FramesView) {
    let Some(replayed) = shown(pane, view) else { return };
    let corner = pane.rect.left_bottom() + Vec2::new(10.0, -10.0);
    let place = Rect::from_min_size(pos2(corner.x, corner.y - CARD.y), CARD).intersect(pane.rect);
    let mut inside = ui.new_child(UiBuilder::new().max_rect(place).layout(egui::Layout::bottom_up(egui::Align::Min)));
    inside.set_clip_rect(pane.rect);
    let frame = egui::Frame::NONE.fill(Color32::from_black_alpha(190)).corner_radius(6.0).inner_margin(8.0);
    frame.show(&mut inside, |ui| {
        ui.set_width(CARD.x - 16.0);
        ui.with_layout(egui::Layout::top_down(egui::Align::Min), |ui| contents(ui, replayed, view));
    });
}

fn contents(ui: &mut egui::Ui, replayed: Replayed<'_>, view: &mut FramesView) {
    // The card lies on a picture, and is dark in both themes.
    *ui.visuals_mut() = egui::Visuals::dark();
    ui.visuals_mut().override_text_color = Some(Color32::from_gray(225));
    ui.strong("Simulated against seen");
    let replay = match replayed {
        Replayed::Looking => {
            ui.label("Finding the muscles and simulating …");
            return;
        }
        Replayed::Refused(why) => {
            ui.label(why);
            return;
        }
        Replayed::Found(replay) => replay,
    };
    ui.horizontal(|ui| {
        let under = &mut view.replay.under;
        ui.selectable_value(under, Under::Muscles, "Muscles found")
            .on_hover_text("The skin of the first frame gives way to the muscles that were found.");
        ui.selectable_value(under, Under::Forces, "Measured forces").on_hover_text(
            "The skin gives way to the measured forces themselves: what they miss is due to the simulation, not to the muscles.",
        );
    });
    let simulated = view.replay.under.of(replay);
    for (what, words) in [
        ("mean", both(simulated, |s| s.mean)),
        ("root mean square", both(simulated, |s| s.rms)),
        ("largest", both(simulated, |s| s.largest)),
    ] {
        let at =
            replay.worst(simulated).filter(|_| what == "largest").map_or(String::new(), |v| format!(", vertex {v}"));
        ui.label(format!("{what}: {words}{at}"));
    }
    let share = fixed(100.0 * replay.explained(simulated).max(-9.99), 0);
    ui.label(format!("{} points, {share} % of their motion", replay.points.len()));
    if let Some(words) = Replay::doubt(simulated) {
        ui.colored_label(ui.visuals().warn_fg_color, words);
    }
    bar(ui, end_of_colours_mm(replay));
}

/// The colours with their ends.
fn bar(ui: &mut egui::Ui, most_mm: f64) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(Vec2::new(120.0, 10.0), egui::Sense::hover());
        let stripe = rect.width() / STRIPES as f32;
        for k in 0..STRIPES {
            let left = Pos2::new(rect.left() + stripe * k as f32, rect.top());
            let one = Rect::from_min_size(left, Vec2::new(stripe + 0.5, rect.height()));
            ui.painter().rect_filled(one, 0.0, colour((k as f64 + 0.5) / STRIPES as f64, 1.0));
        }
        ui.label(format!("0 to {} mm", significant(most_mm, 3)));
    });
}
