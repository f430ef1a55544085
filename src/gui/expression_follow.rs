//! What the moving face follows while it is shown: the project, the first frame, the fit, the sliders and the clock.

use std::sync::Arc;

use egui::{ColorImage, Pos2, TextureOptions, pos2};
use image::imageops::FilterType;

use super::Workspace;
use super::app::App;
use super::expression_work::{Base, ExpressionWork, Place, Prepared, Question, Ready, Skin, Transport};
use super::jobs::{About, Finished};
use super::pictures::PictureStatus;
use super::view_state::NoticeKind;
use crate::draw::words::sentence;
use crate::expression::player::Pace;
use crate::expression::{Player, Stage};
use crate::face;
use crate::project::Which;

/// A frame of the window counts for so long at most, s: after a pause the play goes on where it stood.
const LONGEST_FRAME_S: f64 = 0.1;
/// Longest side of a picture on the skin, px.
const SKIN_PX: u32 = 2048;

/// Makes a face ready; long work for a large one.
fn prepare(question: &Question) -> Result<Prepared, String> {
    let stage = Stage::new(&question.face, &question.rest, &question.setup).map_err(|e| sentence(&e.to_string()))?;
    let player = Box::new(Player::new(stage, Pace::default()));
    let ready = Ready::new(question, &player);
    Ok(Prepared { player, ready })
}

impl App {
    /// The face that plays.
    pub fn expression_work(&self) -> &ExpressionWork {
        &self.expression_work
    }

    /// Does what is asked of the play.
    pub(super) fn transport(&mut self, what: Transport) {
        self.expression_work.transport(what);
    }

    /// Follows the project, the sliders and the clock, while the workspace is shown.
    pub(super) fn follow_expressions(&mut self, ctx: &egui::Context) {
        if self.view.workspace != Workspace::Expressions {
            return;
        }
        self.ask_for_stage(ctx);
        self.ask_for_skin(ctx);
        self.take_from_fit(ctx);
        let picked = self.view.focus.selected_vertex();
        if let Some(ready) = self.expression_work.ready()
            && !self.view.expressions.step_chosen
        {
            self.view.expressions.pace.step_s = Pace::step_for_s(ready.rest.len());
        }
        let (wanted, pace) = (self.view.expressions.wanted(), self.view.expressions.pace);
        let frame_s = f64::from(ctx.input(|i| i.unstable_dt)).min(LONGEST_FRAME_S);
        let before = self.expression_work.ready.as_ref().map(|r| r.time_s);
        let moving = self.expression_work.run(&wanted, pace, picked, frame_s, ctx);
        let after = self.expression_work.ready.as_ref().map(|r| r.time_s);
        // A player beside the window calls when it comes back.
        if (moving && matches!(self.expression_work.place, Place::Here(_))) || before != after {
            ctx.request_repaint();
        }
    }

    /// Makes another face ready, when another is to be shown.
    fn ask_for_stage(&mut self, ctx: &egui::Context) {
        // While a slider is moved one face after the other is made, not all at once.
        if self.expression_work.job.is_some() {
            return;
        }
        let (base, setup) = (self.view.expressions.base, self.view.expressions.setup);
        let seen = (self.stamp, base, setup);
        if self.expression_work.seen == Some(seen) {
            return;
        }
        self.expression_work.seen = Some(seen);
        let question = match base {
            Base::Project => {
                let rest = Arc::new(self.outcome.first_from_eyes(&self.face));
                Question { face: Arc::clone(&self.face), rest, setup }
            }
            Base::Generic => {
                let face = face::generic();
                let rest = Arc::new(face.mesh().positions().to_vec());
                Question { face, rest, setup }
            }
        };
        // Most edits leave the first frame as it is.
        if self.expression_work.asked.as_ref() == Some(&question) {
            return;
        }
        let work = &mut self.expression_work;
        work.number += 1;
        work.asked = Some(question.clone());
        let number = work.number;
        let job = self.jobs.start(ctx, "Making the face ready to move", About::Expressions, move |_| {
            Some(Finished::Stage(number, Box::new(prepare(&question))))
        });
        self.expression_work.job = Some(job);
    }

    /// Takes a face that was made ready, if it is still the one that is wanted.
    pub(super) fn stage_ready(&mut self, number: u64, result: Result<Prepared, String>, ctx: &egui::Context) {
        let work = &mut self.expression_work;
        if number != work.number {
            return;
        }
        work.job = None;
        match result {
            Ok(prepared) => {
                let actuators = Arc::clone(&prepared.ready.actuators);
                work.take(prepared);
                self.view.expressions.meet(&actuators);
            }
            Err(why) => {
                (work.ready, work.place, work.playing) = (None, Place::Nowhere, false);
                work.refused = Some(why);
            }
        }
        ctx.request_repaint();
    }

    /// The making was stopped, or died.
    pub(super) fn stage_stopped(&mut self) {
        self.expression_work.job = None;
        if self.expression_work.ready.is_none() {
            self.expression_work.refused = Some("The face was not made ready to move.".to_owned());
        }
    }

    /// Reads the first frame again for the skin, when it is there.
    fn ask_for_skin(&mut self, ctx: &egui::Context) {
        let picture = self.pictures.get(Which::First);
        let known = matches!(picture.status(), PictureStatus::Ready { changed: false });
        let Some((source, sha256)) = picture.source().filter(|_| known) else {
            if self.project().frames.first.is_none() {
                self.expression_work.skin = Skin::default();
            }
            return;
        };
        if self.expression_work.skin.asked.as_deref() == Some(sha256) {
            return;
        }
        let (source, sha256) = (source.clone(), sha256.to_owned());
        self.expression_work.skin = Skin { asked: Some(sha256.clone()), texture: None };
        self.jobs.start(ctx, "Reading the first frame for the skin", About::Skin, move |_| {
            let read = source.read().map(|frame| on_skin(frame.into_image()));
            Some(Finished::Skin(sha256, read))
        });
    }

    /// Lays a frame on the skin, if it is still the first one.
    pub(super) fn skin_read(&mut self, sha256: &str, read: Result<ColorImage, String>, ctx: &egui::Context) {
        let skin = &mut self.expression_work.skin;
        if skin.asked.as_deref() == Some(sha256)
            && let Ok(image) = read
        {
            skin.texture = Some(ctx.load_texture("skin", image, TextureOptions::LINEAR));
            ctx.request_repaint();
        }
    }

    /// Where each vertex of the project's face lies in the first frame, as texture coordinates; none where another face is shown.
    pub(super) fn places_in_first(&self) -> Option<Vec<Pos2>> {
        let frame = self.project().frames.first.as_ref()?;
        let shown = self.expression_work.ready.as_ref()?;
        if self.view.expressions.base != Base::Project || !Arc::ptr_eq(&shown.face, &self.face) {
            return None;
        }
        let [width, height] = [frame.width_px, frame.height_px].map(|n| f64::from(n.max(1)));
        let place = |p: &nalgebra::Point2<f64>| pos2((p.x / width) as f32, (p.y / height) as f32);
        Some(self.outcome.first_in_image.iter().map(place).collect())
    }

    /// Takes the activations of the fit, once they are known and wanted.
    fn take_from_fit(&mut self, ctx: &egui::Context) {
        if !self.view.expressions.wants_fit || self.view.expressions.base != Base::Project {
            return;
        }
        let Some(ready) = &self.expression_work.ready else { return };
        let actuators = Arc::clone(&ready.actuators);
        match self.muscle_work.answer() {
            Some(Err(nothing)) if !self.muscle_work.is_looking() => {
                let why = sentence(&nothing.to_string());
                self.view.expressions.wants_fit = false;
                self.tell(NoticeKind::Refused, why, ctx);
            }
            _ => {
                let Some((analysis, _)) = self.muscle_work.current(self.stamp) else { return };
                self.view.expressions.wants_fit = false;
                let muscles = self.face.muscles();
                let strengths = analysis.fibres.iter().zip(&analysis.activations.muscles);
                let fitted = strengths.filter(|(_, one)| one.strength_n > 0.0).filter_map(|(fibre, one)| {
                    let actuator = actuators.get(&muscles.get(fibre.muscle)?.id)?;
                    Some((actuator.id.clone(), actuator.activation_of_law_strength(one.strength_n)))
                });
                let said = self.view.expressions.take_fitted(fitted.collect());
                self.expression_work.play();
                self.tell(NoticeKind::Done, said, ctx);
            }
        }
    }
}

/// A frame small enough for one texture.
fn on_skin(frame: image::RgbImage) -> ColorImage {
    let longest = frame.width().max(frame.height()).max(1);
    let small = if longest > SKIN_PX {
        let side = |n: u32| (n * SKIN_PX / longest).max(1);
        image::imageops::resize(&frame, side(frame.width()), side(frame.height()), FilterType::Triangle)
    } else {
        frame
    };
    ColorImage::from_rgb([small.width() as usize, small.height() as usize], small.as_raw())
}
