//! A face that plays: activations glide to where they are wanted, the skin follows step by step, and what happened last is remembered.
//!
//! The player knows no clock. Whoever shows it says when it takes a step.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::preset::Expression;
use super::stage::Stage;
use crate::simulate::{
    Energy, Equilibrium, EquilibriumSolver, Failure, Method, OutOfMemory, State, Stepper, SystemError,
};

/// So many samples are kept, the last ones: 20 s of the default step.
pub const KEPT: usize = 1200;
/// Share of its way that an activation has gone after the time of the ramp.
const ARRIVED: f64 = 0.95;
/// What is nearer to its goal than this is there: activations, and degrees of the jaw.
const THERE: f64 = 1e-4;

/// What was measured after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub time_s: f64,
    /// Energy by its parts, mJ.
    pub energy: Energy,
    /// Of the vertex picked, if one is.
    pub picked: Option<Picked>,
}

/// What one vertex does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Picked {
    /// The vertex.
    pub vertex: u32,
    /// How far it is from rest, mm.
    pub displacement_mm: f64,
    /// How fast it moves, mm/s.
    pub speed_mm_s: f64,
    /// Length of the muscles' pull on it, N.
    pub force_n: f64,
}

/// How time is stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// The integrator.
    pub method: Method,
    /// Its step, s (default 1/60).
    pub step_s: f64,
    /// After this time an activation has gone 95 % of its way, s (default 0.35); 0 is at once.
    pub ramp_s: f64,
}

/// A face of more vertices is stepped by [`COARSE_STEP_S`] where nobody chose a step.
const FINELY_STEPPED: usize = 2000;
/// Longest step for which implicit Euler was tried from random starts, s.
const COARSE_STEP_S: f64 = 0.033;

impl Pace {
    /// The step that lets a face of so many vertices play as fast as it would move, s.
    pub fn step_for_s(vertices: usize) -> f64 {
        if vertices > FINELY_STEPPED { COARSE_STEP_S } else { Self::default().step_s }
    }
}

impl Default for Pace {
    fn default() -> Self {
        Self { method: Method::default(), step_s: 1.0 / 60.0, ramp_s: 0.35 }
    }
}

/// A stage with its state in time.
#[derive(Debug)]
pub struct Player {
    stage: Stage,
    pace: Pace,
    stepper: Stepper,
    /// Time at which the stepper began, s.
    began_s: f64,
    state: State,
    /// Wanted and present activations, in the order of the actuators.
    wanted: Vec<f64>,
    now: Vec<f64>,
    jaw_wanted_deg: f64,
    jaw_now_deg: f64,
    picked: Option<u32>,
    samples: VecDeque<Sample>,
    failure: Option<Failure>,
    steps: usize,
    solver: Option<EquilibriumSolver>,
}

impl Player {
    /// A face at rest.
    pub fn new(stage: Stage, pace: Pace) -> Self {
        let count = stage.actuators.all.len();
        let mut player = Self {
            state: stage.system.at_rest(),
            stepper: Stepper::new(pace.method),
            began_s: 0.0,
            wanted: vec![0.0; count],
            now: vec![0.0; count],
            jaw_wanted_deg: 0.0,
            jaw_now_deg: 0.0,
            picked: None,
            samples: VecDeque::with_capacity(KEPT),
            failure: None,
            steps: 0,
            solver: None,
            stage,
            pace,
        };
        player.sample();
        player
    }

    /// Goes on where another player of the same face stands, built otherwise; whether it could. One that has failed is no start.
    pub fn take_over(&mut self, other: &Self) -> bool {
        let same = self.stage.system.rest() == other.stage.system.rest() && self.now.len() == other.now.len();
        if !same || other.failure.is_some() {
            return false;
        }
        self.state.clone_from(&other.state);
        (self.now, self.wanted) = (other.now.clone(), other.wanted.clone());
        (self.jaw_now_deg, self.jaw_wanted_deg) = (other.jaw_now_deg, other.jaw_wanted_deg);
        (self.began_s, self.steps, self.picked) = (other.time_s(), other.steps, other.picked);
        // As in `glide`.
        let _ = self.load();
        self.stage.system.settle(&mut self.state);
        self.samples.clone_from(&other.samples);
        true
    }

    /// The face with what pulls on it.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Places and velocities now.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.began_s + self.stepper.time_s()
    }

    /// Steps taken since the start.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// How time is stepped.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// The present activation of each actuator.
    pub fn activations(&self) -> &[f64] {
        &self.now
    }

    /// The present angle of the jaw, degrees.
    pub fn jaw_deg(&self) -> f64 {
        self.jaw_now_deg
    }

    /// Why it stands still, when a step has failed.
    pub fn failure(&self) -> Option<&Failure> {
        self.failure.as_ref()
    }

    /// What was measured, oldest first.
    pub fn samples(&self) -> impl DoubleEndedIterator<Item = &Sample> + ExactSizeIterator {
        self.samples.iter()
    }

    /// The muscles' pull on every vertex now, N.
    pub fn loads(&self) -> &[Vector3<f64>] {
        self.stage.system.loads()
    }

    /// Whether every activation is where it is wanted.
    pub fn has_arrived(&self) -> bool {
        self.now == self.wanted && self.jaw_now_deg == self.jaw_wanted_deg
    }

    /// Triangles that have turned over: the skin is folded there.
    pub fn folded(&self) -> Vec<u32> {
        let areas = self.stage.system.doubled_areas(&self.state.positions);
        areas.iter().enumerate().filter(|(_, a)| **a < 0.0).map(|(t, _)| t as u32).collect()
    }

    /// Goes to another expression from now on; names that this face does not have are passed over.
    pub fn want(&mut self, expression: &Expression) {
        for (wanted, actuator) in self.wanted.iter_mut().zip(&self.stage.actuators.all) {
            *wanted = expression.activation(&actuator.id);
        }
        self.jaw_wanted_deg = expression.jaw_deg;
    }

    /// Steps otherwise from now on. Another method begins with the present state.
    pub fn set_pace(&mut self, pace: Pace) {
        if pace.method != self.pace.method {
            self.begin(pace.method);
        }
        self.pace = pace;
    }

    /// Watches another vertex from now on, or none.
    pub fn pick(&mut self, vertex: Option<u32>) {
        let vertex = vertex.filter(|v| (*v as usize) < self.stage.system.len());
        if vertex != self.picked {
            self.picked = vertex;
            let at = self.at_picked();
            if let Some(last) = self.samples.back_mut() {
                last.picked = at;
            }
        }
    }

    /// One step. After a failure nothing happens until [`Player::reset`]. True where a step was taken and did not fail.
    pub fn step(&mut self) -> bool {
        if self.failure.is_some() {
            return false;
        }
        self.glide();
        self.steps += 1;
        let done = self.stepper.step(&self.stage.system, &mut self.state, self.pace.step_s);
        if let Err(failure) = done {
            self.failure = Some(failure);
            return false;
        }
        self.sample();
        true
    }

    /// Everything at rest again, at time 0; what is wanted stays wanted.
    pub fn reset(&mut self) {
        self.state = self.stage.system.at_rest();
        self.now.fill(0.0);
        self.jaw_now_deg = 0.0;
        self.began_s = 0.0;
        self.stepper = Stepper::new(self.pace.method);
        self.steps = 0;
        self.failure = None;
        self.samples.clear();
        // At rest no load can be refused.
        let _ = self.load();
        self.sample();
    }

    /// Goes to the static equilibrium of what is wanted, at once.
    ///
    /// # Errors
    /// Where memory for the matrix is not to be had.
    pub fn settle(&mut self) -> Result<Equilibrium, OutOfMemory> {
        self.now.clone_from(&self.wanted);
        self.jaw_now_deg = self.jaw_wanted_deg;
        // Activations are checked where they come in: their loads are finite.
        let _ = self.load();
        let system = &self.stage.system;
        let mut solver = match self.solver.take() {
            Some(solver) => solver,
            None => EquilibriumSolver::new(system)?,
        };
        let start = if self.failure.is_some() { system.carried() } else { self.state.positions.clone() };
        let found = solver.solve(system, &start);
        self.solver = Some(solver);
        self.state.positions.clone_from(&found.positions);
        self.state.velocities.fill(Vector3::zeros());
        self.failure = None;
        self.begin(self.pace.method);
        self.sample();
        Ok(found)
    }

    /// A new stepper from the present state on.
    fn begin(&mut self, method: Method) {
        self.began_s = self.time_s();
        self.stepper = Stepper::new(method);
    }

    /// Lets activations and jaw go part of their way, as long as a step takes.
    fn glide(&mut self) {
        if self.has_arrived() {
            return;
        }
        let share =
            if self.pace.ramp_s > 0.0 { 1.0 - (1.0 - ARRIVED).powf(self.pace.step_s / self.pace.ramp_s) } else { 1.0 };
        let nearer = |now: f64, wanted: f64| {
            let next = now + (wanted - now) * share;
            if (next - wanted).abs() < THERE { wanted } else { next }
        };
        for (now, wanted) in self.now.iter_mut().zip(&self.wanted) {
            *now = nearer(*now, *wanted);
        }
        self.jaw_now_deg = nearer(self.jaw_now_deg, self.jaw_wanted_deg);
        // As above.
        let _ = self.load();
    }

    /// Gives the present activations to the system.
    fn load(&mut self) -> Result<(), SystemError> {
        let mut newton = vec![Vector3::zeros(); self.stage.system.len()];
        for (actuator, &activation) in self.stage.actuators.all.iter().zip(&self.now) {
            actuator.add_loads(activation, &mut newton);
        }
        self.stage.system.open_jaw(self.jaw_now_deg.to_radians());
        self.stage.system.set_loads(newton)
    }

    fn sample(&mut self) {
        if self.samples.len() == KEPT {
            self.samples.pop_front();
        }
        let energy = self.stage.system.energy(&self.state);
        self.samples.push_back(Sample { time_s: self.time_s(), energy, picked: self.at_picked() });
    }

    fn at_picked(&self) -> Option<Picked> {
        let vertex = self.picked?;
        let i = vertex as usize;
        let system = &self.stage.system;
        Some(Picked {
            vertex,
            displacement_mm: (self.state.positions[i] - system.rest()[i]).norm(),
            speed_mm_s: self.state.velocities[i].norm(),
            force_n: system.loads()[i].norm(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::{Basic, Setup};
    use crate::face;
    use crate::simulate::Cause;

    fn stage(setup: &Setup) -> Stage {
        let face = face::generic();
        Stage::new(&face, face.mesh().positions(), setup).unwrap()
    }

    fn surprised(stage: &Stage) -> Expression {
        Expression::basic(Basic::Surprise, &stage.actuators)
    }

    #[test]
    fn what_is_played_comes_to_rest_where_the_equilibrium_is() {
        let stage = stage(&Setup::default());
        let surprise = surprised(&stage);
        let mut player = Player::new(stage, Pace::default());
        player.want(&surprise);
        player.pick(Some(face::generic().muscles()[0].insertion));
        for _ in 0..240 {
            assert!(player.step());
        }
        assert!(player.has_arrived() && (player.time_s() - 4.0).abs() < 1e-9);
        let played = player.state().positions.clone();
        let last = *player.samples().next_back().unwrap();
        assert!(last.picked.unwrap().displacement_mm > 1.0 && last.energy.kinetic < 0.05, "{last:?}");
        let rest = player.settle().unwrap();
        let apart = played.iter().zip(&rest.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 0.05, "{apart} mm apart");
        assert!(player.folded().is_empty(), "{:?}", player.folded());
    }

    #[test]
    fn activations_go_95_percent_of_their_way_in_the_time_of_the_ramp() {
        let stage = stage(&Setup::default());
        let surprise = surprised(&stage);
        let pace = Pace { step_s: 0.01, ramp_s: 0.2, ..Pace::default() };
        let mut player = Player::new(stage, pace);
        player.want(&surprise);
        for _ in 0..20 {
            player.step();
        }
        assert!((player.jaw_deg() / surprise.jaw_deg - 0.95).abs() < 1e-9, "{}", player.jaw_deg());
        player.reset();
        assert_eq!((player.time_s(), player.jaw_deg(), player.samples().len()), (0.0, 0.0, 1));
        assert!(player.loads().iter().all(|f| f.norm() == 0.0));
        assert!(!player.has_arrived(), "what was wanted stays wanted");
    }

    #[test]
    fn a_failure_stops_the_play_and_says_where_until_it_is_put_back() {
        let stage = stage(&Setup { stiffness: 100.0, ..Setup::default() });
        let surprise = surprised(&stage);
        let pace = Pace { method: Method::ExplicitEuler, step_s: 0.033, ramp_s: 0.0 };
        let mut player = Player::new(stage, pace);
        player.want(&surprise);
        let taken = (0..2000).take_while(|_| player.step()).count();
        assert!(taken < 2000, "explicit Euler with 33 ms in skin a hundred times as stiff cannot last");
        let failure = player.failure().unwrap().clone();
        assert!(failure.step == taken + 1 && failure.advice.contains("limit"), "{failure}");
        assert!(matches!(failure.cause, Cause::NotFinite | Cause::RanAway { .. } | Cause::EnergyGrew { .. }));
        assert!(!player.step(), "nothing moves after a failure");
        player.set_pace(Pace::default());
        player.reset();
        assert!(player.step() && player.failure().is_none());
    }

    #[test]
    fn another_skin_goes_on_where_the_one_before_stands() {
        let mut before = Player::new(stage(&Setup::default()), Pace::default());
        before.want(&surprised(before.stage()));
        for _ in 0..60 {
            before.step();
        }
        let mut after = Player::new(stage(&Setup { stiffness: 3.0, ..Setup::default() }), Pace::default());
        assert!(after.take_over(&before) && after.time_s() == before.time_s() && after.jaw_deg() == before.jaw_deg());
        let apart = |a: &Player, b: &Player| {
            let places = a.state().positions.iter().zip(&b.state().positions);
            places.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        };
        assert!(apart(&before, &after) < 1e-6, "{}", apart(&before, &after));
        for _ in 0..60 {
            assert!(after.step());
        }
        assert!(apart(&before, &after) > 0.1, "stiffer skin goes elsewhere");
    }

    #[test]
    fn only_the_last_samples_are_kept() {
        let mut player = Player::new(stage(&Setup::default()), Pace::default());
        for _ in 0..KEPT + 5 {
            player.sample();
        }
        assert_eq!(player.samples().len(), KEPT);
    }
}
