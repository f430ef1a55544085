//! The face that plays: made ready in the background, stepped between two frames of the window or beside it, never so long that the window waits.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

use egui::TextureHandle;
use nalgebra::{Point3, Vector3};

use super::Stamp;
pub use super::expression_ready::Ready;
use crate::draw::words::sentence;
use crate::expression::player::Pace;
use crate::expression::{Expression, Player, Setup};
use crate::face::FaceModel;
use crate::simulate::Equilibrium;

/// Steps are taken between two frames of the window as long as that takes no longer than this; slower ones beside it.
const IN_FRAME: Duration = Duration::from_millis(8);
/// So long at most a simulation beside the window works before it shows what it has.
const BESIDE: Duration = Duration::from_millis(60);
/// No more time than this is made up for, s: the play is slowed instead.
const MADE_UP_S: f64 = 0.1;
/// The rate of the play is found anew after so much time, s.
const RATED_S: f64 = 0.7;
/// Skin slower than this, with every activation where it is wanted, is at rest, mm/s.
const AT_REST_MM_S: f64 = 0.2;
/// A skin of so many vertices or fewer settles between two frames; a larger one beside the window.
const SETTLED_AT_ONCE: usize = 2000;

/// Which face is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// The face of the project, as it is fitted to the first frame.
    #[default]
    Project,
    /// The generic face.
    Generic,
}

/// What a person asks of the play.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Play, or stop playing.
    PlayPause,
    /// One step.
    Step,
    /// Back to rest, at time 0.
    Reset,
    /// To the static equilibrium, at once.
    Settle,
}

/// The face in the workspace of the expressions.
#[derive(Default)]
pub struct ExpressionWork {
    /// Grows with every face that is made ready.
    pub(super) number: u64,
    pub(super) seen: Option<(Stamp, Base, Setup)>,
    pub(super) asked: Option<Question>,
    pub(super) job: Option<u64>,
    /// Why there is no face to play: one line.
    pub(super) refused: Option<String>,
    pub(super) ready: Option<Ready>,
    pub(super) place: Place,
    pub(super) playing: bool,
    pub(super) steps_wanted: usize,
    pub(super) settle_wanted: bool,
    pub(super) reset_wanted: bool,
    pub(super) owed_s: f64,
    pub(super) meter: Meter,
    pub(super) settled: Option<String>,
    pub(super) skin: Skin,
}

/// What a face is made ready from.
#[derive(Clone, PartialEq)]
pub(super) struct Question {
    pub(super) face: Arc<FaceModel>,
    pub(super) rest: Arc<Vec<Point3<f64>>>,
    pub(super) setup: Setup,
}

/// A face made ready.
pub struct Prepared {
    pub(super) player: Box<Player>,
    pub(super) ready: Ready,
}

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").field("vertices", &self.ready.rest.len()).finish_non_exhaustive()
    }
}

/// Where the player is.
#[derive(Default)]
pub(super) enum Place {
    #[default]
    Nowhere,
    Here(Box<Player>),
    /// On a thread of its own, from which it comes back.
    Beside(Receiver<Returned>),
}

/// What comes back from beside the window.
pub(super) struct Returned {
    player: Box<Player>,
    steps: usize,
    took: Duration,
    settled: Option<Result<Equilibrium, String>>,
}

/// How fast it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Meter {
    /// Time of a step, ms.
    pub step_ms: f64,
    /// Frames a second while it plays.
    pub fps: f64,
    /// Simulated time over shown time: 1 where it keeps up; 0 until it is known.
    pub rate: f64,
    /// Time shown and simulated since the rate was last found, s.
    shown_s: f64,
    simulated_s: f64,
}

impl Meter {
    /// A frame of the window has passed.
    fn pass(&mut self, frame_s: f64) {
        let fps = 1.0 / frame_s.max(1e-4);
        self.fps = if self.fps > 0.0 { 0.9 * self.fps + 0.1 * fps } else { fps };
        self.shown_s += frame_s;
        if self.shown_s >= RATED_S {
            self.rate = (self.simulated_s / self.shown_s).clamp(1e-3, 1.0);
            (self.shown_s, self.simulated_s) = (0.0, 0.0);
        }
    }

    /// Nothing moves any more.
    fn rest(&mut self) {
        *self = Self { step_ms: self.step_ms, ..Self::default() };
    }

    fn count(&mut self, steps: usize, step_s: f64, took: Duration) {
        self.simulated_s += steps as f64 * step_s;
        if steps > 0 {
            let each = 1e3 * took.as_secs_f64() / steps as f64;
            self.step_ms = if self.step_ms > 0.0 { 0.8 * self.step_ms + 0.2 * each } else { each };
        }
    }
}

/// The first frame, to be laid on the skin.
#[derive(Default)]
pub(super) struct Skin {
    /// Hash of the frame that was asked for.
    pub(super) asked: Option<String>,
    pub(super) texture: Option<TextureHandle>,
}

impl ExpressionWork {
    /// What is shown.
    pub fn ready(&self) -> Option<&Ready> {
        self.ready.as_ref()
    }

    /// Why there is nothing to show: one line.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Whether another face is being made ready.
    pub fn is_preparing(&self) -> bool {
        self.job.is_some()
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// How fast it goes.
    pub fn meter(&self) -> Meter {
        self.meter
    }

    /// What is to be said of the last equilibrium.
    pub fn settled(&self) -> Option<&str> {
        self.settled.as_deref()
    }

    /// The picture on the skin.
    pub fn texture(&self) -> Option<&TextureHandle> {
        self.skin.texture.as_ref()
    }

    /// Does what a person asks of the play, with the next frame.
    pub fn transport(&mut self, what: Transport) {
        match what {
            Transport::PlayPause => {
                self.playing = !self.playing;
                self.owed_s = 0.0;
            }
            Transport::Step => {
                self.playing = false;
                self.steps_wanted += 1;
            }
            Transport::Reset => {
                self.reset_wanted = true;
                self.steps_wanted = 0;
            }
            Transport::Settle => {
                self.playing = false;
                self.settle_wanted = true;
            }
        }
    }

    /// Begins to play.
    pub fn play(&mut self) {
        self.playing = true;
    }

    pub(super) fn take(&mut self, mut prepared: Prepared) {
        if let Place::Here(before) = &self.place
            && prepared.player.take_over(before)
        {
            prepared.ready.show(&prepared.player);
        }
        self.refused = None;
        self.settled = None;
        self.meter = Meter::default();
        self.place = Place::Here(prepared.player);
        self.ready = Some(prepared.ready);
        // What was asked of the face before does not hold for this one.
        (self.steps_wanted, self.settle_wanted, self.reset_wanted, self.owed_s) = (0, false, false, 0.0);
    }

    /// Takes back the player that worked beside the window, when it is done.
    fn fetch(&mut self) {
        let Place::Beside(receiver) = &self.place else { return };
        match receiver.try_recv() {
            Ok(returned) => {
                self.meter.count(returned.steps, returned.player.pace().step_s, returned.took);
                if let Some(settled) = returned.settled {
                    self.settled = Some(words_of(settled));
                }
                self.show(&returned.player);
                self.place = Place::Here(returned.player);
            }
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => {
                self.place = Place::Nowhere;
                self.playing = false;
                self.asked = None;
                self.seen = None;
                self.ready = None;
                self.refused = Some("The simulation stopped unexpectedly; choose another step or method.".to_owned());
            }
        }
    }

    fn show(&mut self, player: &Player) {
        if let Some(ready) = &mut self.ready {
            ready.show(player);
        }
        if player.failure().is_some() {
            self.playing = false;
        }
    }

    /// Lets the time of one frame of the window pass; whether something moves.
    pub(super) fn run(
        &mut self,
        wanted: &Expression,
        pace: Pace,
        picked: Option<u32>,
        frame_s: f64,
        ctx: &egui::Context,
    ) -> bool {
        self.fetch();
        if !matches!(self.place, Place::Here(_)) {
            if self.playing {
                self.meter.pass(frame_s);
                self.owed_s += frame_s;
            }
            return matches!(self.place, Place::Beside(_));
        }
        let Place::Here(mut player) = std::mem::take(&mut self.place) else { return false };
        player.want(wanted);
        player.set_pace(pace);
        player.pick(picked);
        if std::mem::take(&mut self.reset_wanted) {
            player.reset();
            self.settled = None;
            self.owed_s = 0.0;
        }
        let settle = std::mem::take(&mut self.settle_wanted);
        let mut steps = std::mem::take(&mut self.steps_wanted);
        let moving = self.playing && player.failure().is_none() && !is_at_rest(&player);
        if moving {
            self.meter.pass(frame_s);
            self.owed_s = (self.owed_s + frame_s).min(MADE_UP_S.max(pace.step_s));
            let due = (self.owed_s / pace.step_s + 1e-6).floor();
            self.owed_s = (self.owed_s - due * pace.step_s).max(0.0);
            steps += due as usize;
        } else {
            self.meter.rest();
            self.owed_s = 0.0;
        }
        let slow = self.meter.step_ms > 1e3 * IN_FRAME.as_secs_f64();
        let large = settle && player.state().positions.len() > SETTLED_AT_ONCE;
        if large || (slow && steps > 0) {
            self.send(player, steps, settle, ctx);
            return true;
        }
        let (taken, took) = take_steps(&mut player, steps, IN_FRAME);
        self.meter.count(taken, pace.step_s, took);
        if settle {
            self.settled = Some(words_of(player.settle().map_err(|e| e.to_string())));
        }
        self.show(&player);
        self.place = Place::Here(player);
        moving
    }

    /// Lets the player work beside the window.
    fn send(&mut self, mut player: Box<Player>, steps: usize, settle: bool, ctx: &egui::Context) {
        let (sender, receiver) = channel();
        let ctx = ctx.clone();
        let most = if settle { Duration::ZERO } else { BESIDE };
        // Without a thread the sender is gone, which is found with the next frame.
        let _ = std::thread::Builder::new().name("simulation".into()).spawn(move || {
            let (steps, took) = take_steps(&mut player, steps, most);
            let settled = settle.then(|| player.settle().map_err(|e| e.to_string()));
            // The window may be gone; then nobody waits.
            let _ = sender.send(Returned { player, steps, took, settled });
            ctx.request_repaint();
        });
        self.place = Place::Beside(receiver);
    }
}

/// Takes steps until all are taken, one fails, or the time is up; at least one. How many, and how long that took.
fn take_steps(player: &mut Player, steps: usize, most: Duration) -> (usize, Duration) {
    let began = Instant::now();
    let mut taken = 0;
    while taken < steps && (taken == 0 || began.elapsed() < most) && player.step() {
        taken += 1;
    }
    (taken, began.elapsed())
}

fn is_at_rest(player: &Player) -> bool {
    let slow = |v: &Vector3<f64>| v.norm_squared() < AT_REST_MM_S * AT_REST_MM_S;
    player.steps() > 0 && player.has_arrived() && player.state().velocities.iter().all(slow)
}

/// What is said of an equilibrium.
fn words_of(found: Result<Equilibrium, String>) -> String {
    match found {
        Err(why) => sentence(&why),
        Ok(found) => {
            let ended = found.ended.label();
            let steps = if found.iterations == 1 { "step" } else { "steps" };
            format!("Settled: {ended} after {} {steps}, {:.1e} N left", found.iterations, found.residual_n)
        }
    }
}
