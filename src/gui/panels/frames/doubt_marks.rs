//! Doubt as it is drawn on a picture: the ring where neighbours lead, circles about guilty marks, the marks of another annotator.

use egui::{Align2, Color32, FontId, Painter, Pos2, Stroke, Vec2};

use super::FramesView;
use super::doubt::{gap_in_words, gap_of, others_in};
use super::drag::Target;
use super::pane::Pane;
use crate::gui::Focus;
use crate::gui::theme::on_picture;
use crate::project::{PointId, Which};

/// A mark that goes with its neighbours.
const GOES_WITH: Color32 = Color32::from_rgb(120, 220, 120);
/// One that does not.
const STANDS_OUT: Color32 = Color32::from_rgb(255, 110, 90);
/// The marks of another annotator.
const OTHER: Color32 = Color32::from_rgb(255, 120, 220);
/// Radius of the circle about a guilty mark, and about a point to be marked again, ui points.
const CIRCLE: f32 = 14.0;
/// The ring is never smaller, ui points.
const SMALLEST_RING: f32 = 4.0;

/// Draws it all.
pub fn paint(painter: &Painter, pane: &Pane<'_>, view: &FramesView, focus: &Focus) {
    let ui = |p: [f64; 2]| pane.transform.ui_from_image(p);
    if pane.which == Which::First
        && let Some(v) = view.doubt.asked()
        && let Some(at) = pane.scene.outcome.first_in_image.get(v as usize)
    {
        circle(painter, ui([at.x, at.y]), CIRCLE, on_picture::SELECTED);
        circle(painter, ui([at.x, at.y]), 3.0, on_picture::FEATURE);
    }
    if !view.show_marks {
        return;
    }
    for (other, own) in others_in(pane.scene, &view.doubt, pane.which) {
        let at = ui(other);
        if let Some(own) = own {
            line(painter, at, ui(own), OTHER);
        }
        let corner = |x: f32, y: f32| at + Vec2::new(x, y) * 4.5;
        let diamond = vec![corner(0.0, -1.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(-1.0, 0.0)];
        painter.add(egui::Shape::closed_line(diamond.clone(), Stroke::new(3.0, on_picture::HALO)));
        painter.add(egui::Shape::closed_line(diamond, Stroke::new(1.4, OTHER)));
    }
    if pane.which == Which::Last {
        for &v in &view.guilty {
            if let Some(mark) = pane.scene.project.features.get(&v).and_then(|f| f.last) {
                circle(painter, ui(mark.at_px), CIRCLE, STANDS_OUT);
            }
        }
        ring(painter, pane, view, focus);
    }
}

/// While a point is in the hand, or selected: where its neighbours say it should be. The ring holds 86 % of good marks: two standard
/// errors.
fn ring(painter: &Painter, pane: &Pane<'_>, view: &FramesView, focus: &Focus) {
    let held = view.drag.as_ref().and_then(|d| match &d.target {
        Target::Point(id) if d.began => Some(id),
        _ => None,
    });
    let Some(id @ PointId::FeatureLast(v)) = held.or(focus.selected.as_ref()) else { return };
    let Some(gap) = gap_of(pane.scene, id) else { return };
    let Some(mark) = pane.scene.project.features.get(v).and_then(|f| f.last) else { return };
    let ui = |p: [f64; 2]| pane.transform.ui_from_image(p);
    let (centre, at) = (ui(gap.expected.at.into()), ui(mark.at_px));
    let radius = ((2.0 * gap.expected.sigma_px * pane.transform.zoom) as f32).max(SMALLEST_RING);
    let colour = if gap.stands_out() { STANDS_OUT } else { GOES_WITH };
    circle(painter, centre, radius, colour);
    line(painter, centre, at, colour);
    let text = gap_in_words(&gap, pane.scene.outcome.unit());
    let place = centre + Vec2::new(0.0, radius.min(60.0) + 12.0);
    let galley = painter.layout_no_wrap(text, FontId::proportional(11.5), colour);
    let rect = Align2::CENTER_CENTER.anchor_size(place, galley.size());
    painter.rect_filled(rect.expand2(Vec2::new(5.0, 2.0)), 4.0, Color32::from_black_alpha(170));
    painter.galley(rect.min, galley, colour);
}

fn circle(painter: &Painter, at: Pos2, radius: f32, colour: Color32) {
    painter.circle_stroke(at, radius, Stroke::new(3.4, on_picture::HALO));
    painter.circle_stroke(at, radius, Stroke::new(1.6, colour));
}

fn line(painter: &Painter, a: Pos2, b: Pos2, colour: Color32) {
    painter.line_segment([a, b], Stroke::new(3.0, on_picture::HALO));
    painter.line_segment([a, b], Stroke::new(1.2, colour));
}
