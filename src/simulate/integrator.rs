//! One call for every way of stepping the system through time, with a watch over what it makes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::failure::{Cause, Failure};
use super::system::{State, System};
use super::{explicit_euler, implicit_euler, runge_kutta, symplectic_euler, thesis_step, vertex_block_descent};

/// How time is stepped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// [`explicit_euler`].
    ExplicitEuler,
    /// [`symplectic_euler`].
    SymplecticEuler,
    /// [`runge_kutta`].
    RungeKutta4,
    /// [`thesis_step`].
    Thesis,
    /// [`implicit_euler`].
    #[default]
    ImplicitEuler,
    /// [`vertex_block_descent`].
    VertexBlockDescent,
}

impl Method {
    /// All, from the plainest on.
    pub const ALL: [Self; 6] = [
        Self::ExplicitEuler,
        Self::SymplecticEuler,
        Self::RungeKutta4,
        Self::Thesis,
        Self::ImplicitEuler,
        Self::VertexBlockDescent,
    ];

    /// Name for files and the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ExplicitEuler => "explicit_euler",
            Self::SymplecticEuler => "symplectic_euler",
            Self::RungeKutta4 => "runge_kutta_4",
            Self::Thesis => "thesis",
            Self::ImplicitEuler => "implicit_euler",
            Self::VertexBlockDescent => "vertex_block_descent",
        }
    }

    /// Name for people.
    pub const fn label(self) -> &'static str {
        match self {
            Self::ExplicitEuler => "Explicit Euler",
            Self::SymplecticEuler => "Symplectic Euler",
            Self::RungeKutta4 => "Runge–Kutta 4",
            Self::Thesis => "Thesis (Eq. 4.17)",
            Self::ImplicitEuler => "Implicit Euler",
            Self::VertexBlockDescent => "Vertex block descent",
        }
    }

    /// What it guarantees and where it fails, in a sentence.
    pub const fn promise(self) -> &'static str {
        match self {
            Self::ExplicitEuler => {
                "gains energy at every step: stable only below damping / (fastest frequency)², a fraction of a ms"
            }
            Self::SymplecticEuler => "stable below 2 / (fastest frequency), about a ms; keeps energy on average",
            Self::RungeKutta4 => "fourth order; stable below 2.8 / (fastest frequency)",
            Self::Thesis => {
                "as symplectic Euler at rest; under compression its denominator vanishes and it is worse than explicit"
            }
            Self::ImplicitEuler => {
                "loses energy at every step, however long; takes away motion that is faster than the step"
            }
            Self::VertexBlockDescent => "as implicit Euler, solved vertex by vertex; may lag behind in stiff skin",
        }
    }

    /// Largest step that is stable for small motions about rest, s; none where there is no limit.
    pub fn limit_s(self, system: &System) -> Option<f64> {
        let (omega, _) = system.fastest_rad_per_s();
        let c = system.options().damping_per_s;
        // ω is the bound for one vertex against its neighbours at rest, so the limits are on the safe side.
        match self {
            Self::ExplicitEuler => Some((c / (omega * omega)).min(2.0 / omega)),
            Self::SymplecticEuler => Some(((c * c + 4.0 * omega * omega).sqrt() - c) / (omega * omega)),
            Self::RungeKutta4 => Some(2.78 / omega),
            Self::Thesis => Some((c + (c * c + 4.0 * omega * omega).sqrt()) / (omega * omega)),
            Self::ImplicitEuler | Self::VertexBlockDescent => None,
        }
    }
}

/// Steps a system through time by one method.
#[derive(Debug)]
pub struct Stepper {
    method: Method,
    steps: usize,
    time_s: f64,
    room: Room,
    given: Option<Given>,
}

/// The energy that a system had when loads or bones were last changed.
#[derive(Clone, Copy, Debug)]
struct Given {
    change: u64,
    total: f64,
    /// More than this above `total` is no rounding error.
    most: f64,
}

/// Memory of the methods.
#[derive(Debug, Default)]
pub(super) struct Room {
    pub(super) forces: Vec<Vector3<f64>>,
    /// Potential energy at the start of the step, mJ, where the method found it on its way.
    pub(super) potential: Option<f64>,
    pub(super) runge_kutta: runge_kutta::Stages,
    pub(super) implicit: Option<implicit_euler::Solver>,
    pub(super) descent: Option<vertex_block_descent::Colours>,
}

/// Beyond so many diagonals of the face a vertex has run away.
const AWAY: f64 = 3.0;
/// Share of the face's size over which all loads together may err in energy before it counts as gained.
const SLACK: f64 = 0.05;

impl Stepper {
    /// A stepper at time 0.
    pub fn new(method: Method) -> Self {
        Self { method, steps: 0, time_s: 0.0, room: Room::default(), given: None }
    }

    /// Its method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Time reached, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Forgets what it prepared: for another system, or one whose fixed vertices changed.
    pub fn restart(&mut self) {
        *self = Self::new(self.method);
    }

    /// One step of `step_s` seconds.
    ///
    /// # Errors
    /// Where the method fails, with the step, the vertex, the cause and what to change. The state is then the one that failed.
    pub fn step(&mut self, system: &System, state: &mut State, step_s: f64) -> Result<(), Failure> {
        self.steps += 1;
        self.time_s += step_s;
        let kinetic = system.kinetic(state);
        let before = state.velocities.clone();
        let room = &mut self.room;
        room.potential = None;
        let done: Result<(), Stop> = match self.method {
            Method::ExplicitEuler => {
                explicit_euler::step(system, state, step_s, room);
                Ok(())
            }
            Method::SymplecticEuler => {
                symplectic_euler::step(system, state, step_s, room);
                Ok(())
            }
            Method::RungeKutta4 => {
                runge_kutta::step(system, state, step_s, room);
                Ok(())
            }
            Method::Thesis => thesis_step::step(system, state, step_s, room),
            Method::ImplicitEuler => implicit_euler::step(system, state, step_s, room),
            Method::VertexBlockDescent => {
                vertex_block_descent::step(system, state, step_s, room);
                Ok(())
            }
        };
        let stopped = done.and_then(|()| watch(system, state)).and_then(|()| self.weigh(system, &before, kinetic));
        stopped.map_err(|(vertex, cause)| self.failure(system, state, step_s, vertex, cause))
    }

    /// Compares the energy at the start of the step with what there was when loads and bones were last changed.
    fn weigh(&mut self, system: &System, before: &[Vector3<f64>], kinetic: f64) -> Result<(), Stop> {
        let Some(potential) = self.room.potential else { return Ok(()) };
        let total = kinetic + potential;
        match self.given {
            Some(given) if given.change == system.changes() => {
                if total <= given.total + given.most {
                    return Ok(());
                }
                let fastest = (0..before.len()).max_by(|&a, &b| before[a].norm().total_cmp(&before[b].norm()));
                Err((fastest.unwrap_or(0), Cause::EnergyGrew { mj: total - given.total }))
            }
            _ => {
                let pull: f64 = system.loads().iter().map(Vector3::norm).sum();
                let most = total.abs() + SLACK * pull * system.size_mm() + f64::MIN_POSITIVE;
                self.given = Some(Given { change: system.changes(), total, most });
                Ok(())
            }
        }
    }

    fn failure(&self, system: &System, state: &State, step_s: f64, vertex: usize, cause: Cause) -> Failure {
        let over = system.doubled_areas(&state.positions);
        let triangle = system.wedges_of(vertex).iter().map(|t| *t as usize).find(|&t| over[t] < 0.0);
        let advice = match self.method.limit_s(system) {
            Some(limit) if step_s > limit => format!(
                "The step of {:.2} ms is above this method's limit of {:.2} ms: take a shorter one, or implicit Euler.",
                1e3 * step_s,
                1e3 * limit
            ),
            Some(_) => "The step is below the limit for small motions, but the skin stiffens as it is stretched: take a shorter \
                        one, or implicit Euler."
                .to_owned(),
            None => "Look at the loads and the stiffness of the skin there.".to_owned(),
        };
        Failure { method: self.method, step: self.steps, time_ms: 1e3 * self.time_s, vertex, triangle, cause, advice }
    }
}

/// What stopped a step, and at which vertex.
pub(super) type Stop = (usize, Cause);

/// Finds a state that no skin can be in.
fn watch(system: &System, state: &State) -> Result<(), Stop> {
    let reach = AWAY * system.size_mm();
    for (i, ((x, v), x0)) in state.positions.iter().zip(&state.velocities).zip(system.rest()).enumerate() {
        let away = (x - x0).norm();
        if !(away.is_finite() && v.iter().all(|c| c.is_finite())) {
            return Err((i, Cause::NotFinite));
        }
        if away > reach {
            return Err((i, Cause::RanAway { distance_mm: away }));
        }
    }
    Ok(())
}
