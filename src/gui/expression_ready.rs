//! The face that plays as it is drawn: its places, loads and curves at the last moment shown.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::expression_work::Question;
use super::face_drawing::FaceDrawing;
use super::face_drawing::openings::Openings;
use crate::expression::{Actuators, Player, Sample, Setup};
use crate::face::FaceModel;
use crate::simulate::Failure;
use crate::simulate::creases::{creases, in_words};

/// An open mouth needs so much more room below the chin, mm.
const JAW_ROOM_MM: f64 = 16.0;

/// What is shown of the play, also while the player works beside the window.
pub struct Ready {
    /// The face.
    pub face: Arc<FaceModel>,
    /// Its vertices at rest, mm.
    pub rest: Arc<Vec<Point3<f64>>>,
    /// What pulls on it.
    pub actuators: Arc<Actuators>,
    /// The face, as it is now, ready for drawing.
    pub drawing: FaceDrawing,
    /// Its eyes and mouth.
    pub openings: Openings,
    /// Places now, mm.
    pub positions: Vec<Point3<f64>>,
    /// The muscles' pull now, N.
    pub loads: Vec<Vector3<f64>>,
    /// What was measured, oldest first.
    pub samples: Vec<Sample>,
    /// Why it stands still.
    pub failure: Option<Failure>,
    /// Triangles that have turned over.
    pub folded: Vec<u32>,
    /// Where the sheet is creased, and what to change; none where it is not.
    pub creased: Option<[String; 2]>,
    /// Time since the start, s.
    pub time_s: f64,
    /// What it was built with.
    pub setup: Setup,
}

impl Ready {
    pub(super) fn new(question: &Question, player: &Player) -> Self {
        // What a view must fit is the face at rest, with room for a jaw that opens.
        let at_rest = question.face.mesh().with_positions(question.rest.to_vec());
        let drawing = at_rest.as_ref().map_or_else(|_| FaceDrawing::new(question.face.mesh()), FaceDrawing::new);
        let drawing = drawing.with_room_below(JAW_ROOM_MM);
        let mut ready = Self {
            openings: Openings::of(&question.face, &question.rest),
            face: Arc::clone(&question.face),
            rest: Arc::clone(&question.rest),
            actuators: Arc::new(player.stage().actuators.clone()),
            drawing,
            positions: Vec::new(),
            loads: Vec::new(),
            samples: Vec::new(),
            failure: None,
            folded: Vec::new(),
            creased: None,
            time_s: 0.0,
            setup: question.setup,
        };
        ready.show(player);
        ready
    }

    pub(super) fn show(&mut self, player: &Player) {
        let moved = self.positions != player.state().positions;
        if moved {
            self.positions.clone_from(&player.state().positions);
            let finite = self.positions.iter().all(|p| p.coords.iter().all(|c| c.is_finite()));
            // A state that failed may be no place to draw: the last good one stays.
            if finite {
                self.drawing.move_to(self.face.mesh(), &self.positions);
            }
            self.folded = player.folded();
            let (mesh, hold) = (self.face.mesh(), player.stage().system.options().hold);
            self.creased = in_words(mesh, &creases(mesh, &self.rest, &self.positions), hold);
        }
        self.loads.clear();
        self.loads.extend_from_slice(player.loads());
        self.samples.clear();
        self.samples.extend(player.samples());
        self.failure = player.failure().cloned();
        self.time_s = player.time_s();
    }
}
