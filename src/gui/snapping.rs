//! Snapping: a mark pressed or dropped beside a crossing of the painted grid goes to the crossing, to a fraction of a pixel, and *Refine*
//! looks for the skin of the first frame about a mark. Both show where the mark was before, and are one step of the history.

use std::sync::Arc;

use egui::{Color32, Painter, Pos2, Stroke, Vec2};
use nalgebra::Point2;

use super::Scene;
use super::app::App;
use super::panels::frames::drag::Target;
use super::panels::frames::{guide, points};
use super::suggesting::Suggested;
use super::theme::on_picture;
use super::view_state::{NoticeKind, Workspace};
use crate::draw::words::capital;
use crate::marking::tracking::Prepared;
use crate::project::{Edit, PointId, Which};
use crate::suggest::{self, Refined, Refinement};

/// A mark never goes farther than this from the hand, ui points: what is far away on the screen was not meant.
const FARTHEST: f64 = 40.0;

/// Half the length of a fitted line as it is drawn, px.
const LINE_PX: f64 = 9.0;

/// Where a mark went by itself, until something else is done: shown, so that no mark moves unseen.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Which mark.
    pub id: PointId,
    /// Where the hand had put it, px.
    pub from: [f64; 2],
    /// What was found.
    pub found: Refined,
}

impl Trace {
    /// Where the mark went, px.
    pub fn to(&self) -> [f64; 2] {
        [self.found.at.x, self.found.at.y]
    }

    /// How far, px.
    pub fn by(&self) -> f64 {
        (self.found.at - Point2::from(self.from)).norm()
    }

    /// What happened, for the status bar and the loupe.
    pub fn words(&self) -> String {
        let (by, left) = (self.by(), 100.0 * self.found.residual);
        match self.found.kind {
            Refinement::Crossing => format!("to the crossing, {by:.2} px; {left:.0} % of the paint unexplained"),
            Refinement::Template => format!("to the same skin, {by:.2} px; {left:.0} % of it differs"),
        }
    }
}

/// Where a mark at `at` snaps to: the crossing of painted lines there. In the last frame only where the point lies on a crossing in the
/// first, for any other point is not on the paint.
pub fn crossing(scene: Scene<'_>, target: &Target, at: [f64; 2], zoom: f64) -> Option<Refined> {
    let near = Point2::from(at);
    let prepared = |which: Which| scene.suggested.prepared(which);
    let found = match target {
        Target::Point(PointId::FeatureLast(v)) | Target::Again(v) => {
            suggest::refine(prepared(Which::First)?, prepared(Which::Last)?, scene.outcome, *v, near)
        }
        Target::Point(PointId::FeatureFirst(_)) | Target::ScaleEnd(_) => {
            suggest::snap(prepared(Which::First)?, scene.outcome, near)
        }
        Target::Point(PointId::Landmark(_)) => return None,
    };
    found.ok().filter(|f| f.kind == Refinement::Crossing && (f.at - near).norm() * zoom <= FARTHEST)
}

/// Draws the fitted lines and the way from the hand to the mark.
pub fn paint(painter: &Painter, from: [f64; 2], found: &Refined, ui_from_image: impl Fn([f64; 2]) -> Pos2) {
    let to = ui_from_image([found.at.x, found.at.y]);
    let hand = ui_from_image(from);
    let colour = on_picture::SUGGESTED;
    for line in found.lines.iter().flatten() {
        let end = |side: f64| {
            let p = line.through + line.direction * side * LINE_PX;
            ui_from_image([p.x, p.y])
        };
        let reach = [end(-1.0), end(1.0)];
        painter.line_segment(reach, Stroke::new(2.6, on_picture::HALO));
        painter.line_segment(reach, Stroke::new(1.2, colour));
    }
    if hand.distance(to) < 1.0 {
        return;
    }
    for stroke in [Stroke::new(3.0, on_picture::HALO), Stroke::new(1.2, Color32::WHITE)] {
        painter.extend(egui::Shape::dashed_line(&[hand, to], stroke, 3.0, 3.0));
        for arm in [Vec2::new(4.0, 0.0), Vec2::new(0.0, 4.0)] {
            painter.line_segment([hand - arm, hand + arm], stroke);
        }
    }
}

impl App {
    /// Whether a hand that snaps may need the pictures: ready before the first mark, so that none goes unsnapped unseen.
    pub(super) fn snapping_needs_pictures(&self) -> bool {
        self.view.frames.snap && self.view.workspace == Workspace::Frames
    }

    /// Looks for the skin of the first frame, or for a crossing, about the selected mark or the one placed last, and puts it there.
    pub(super) fn refine(&mut self, ctx: &egui::Context) {
        let Some(id) = guide::in_doubt(self.scene(), &self.view.frames, self.view.focus.selected.as_ref()) else {
            return;
        };
        match refined(self.scene(), &id) {
            Ok(trace) => {
                self.edit(&Edit::Put(id, trace.to()), ctx);
                self.tell(NoticeKind::Done, format!("Refined {}.", trace.words()), ctx);
                self.view.frames.trace = Some(trace);
            }
            Err(why) => {
                let text = format!("{} stays where it is: {why}.", capital(&id.to_string()));
                self.tell(NoticeKind::Refused, text, ctx);
            }
        }
    }
}

/// What *Refine* makes of a mark, or why it cannot.
fn refined(scene: Scene<'_>, id: &PointId) -> Result<Trace, String> {
    let preparing = || "its frame is being prepared, try again in a moment".to_owned();
    let suggested: &Suggested = scene.suggested;
    let picture = |which: Which| -> Result<&Arc<Prepared>, String> { suggested.prepared(which).ok_or_else(preparing) };
    let Some((_, from)) = points::of(scene, id) else { return Err("it has no place".to_owned()) };
    let near = Point2::from(from);
    let found = match id {
        PointId::FeatureLast(v) => {
            suggest::refine(picture(Which::First)?, picture(Which::Last)?, scene.outcome, *v, near)
        }
        PointId::FeatureFirst(_) => suggest::snap(picture(Which::First)?, scene.outcome, near),
        PointId::Landmark(_) => return Err("a landmark is a place of the face, not of its paint".to_owned()),
    };
    found.map(|found| Trace { id: id.clone(), from, found }).map_err(|why| why.to_string())
}
