//! A face made ready to move: its skin as a system of springs, and the actuators that pull on it.

use nalgebra::Point3;

use super::actuator::{ActuatorError, ActuatorSettings, Actuators};
use super::places::Carry;
use super::preset::Expression;
use super::tissue;
use crate::face::FaceModel;
use crate::muscle::{LawKind, MuscleLaw};
use crate::simulate::{Equilibrium, EquilibriumSolver, Hold, OutOfMemory, System, SystemError, SystemOptions};

/// What keeps the skin on the face, as a choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Holding {
    /// It slides over the skull.
    #[default]
    Skull,
    /// Springs of soft tissue hold every vertex.
    Anchors,
    /// Nothing, as in the thesis.
    Bare,
}

impl Holding {
    /// All, the default first.
    pub const ALL: [Self; 3] = [Self::Skull, Self::Anchors, Self::Bare];

    /// Name for files and the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skull => "skull",
            Self::Anchors => "anchors",
            Self::Bare => "bare",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Skull => "Slides on the skull",
            Self::Anchors => "Anchored",
            Self::Bare => "Bare mesh (thesis)",
        }
    }

    /// What it means, in a sentence.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Skull => "Every vertex keeps the height above the skull that it has at rest",
            Self::Anchors => "A spring as stiff as 6 mm of soft tissue holds every vertex to its place at rest",
            Self::Bare => "Springs along the edges alone: they do not resist bending, so the face may turn inside out",
        }
    }

    /// The same for the system.
    pub fn hold(self) -> Hold {
        match self {
            Self::Skull => Hold::Skull,
            Self::Anchors => Hold::ANCHORS,
            Self::Bare => Hold::Bare,
        }
    }
}

/// What a stage is built with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// How a muscle's force spreads around its fibre (default: anatomical).
    pub law: LawKind,
    /// What keeps the skin on the face.
    pub holding: Holding,
    /// Factor on every stiffness of the skin, 0.01 to 100 (default 1).
    pub stiffness: f64,
    /// Whether lids and the corners of the mouth differ from the skin around them, as [`tissue`] says (default yes).
    pub tissues: bool,
}

impl Default for Setup {
    fn default() -> Self {
        Self { law: LawKind::Anatomical, holding: Holding::default(), stiffness: 1.0, tissues: true }
    }
}

/// Least and largest factor on the stiffness.
pub const STIFFNESS: [f64; 2] = [0.01, 100.0];

/// Why a face cannot be made to move.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StageError {
    /// It has no actuators.
    #[error(transparent)]
    Actuators(#[from] ActuatorError),
    /// Its skin makes no system.
    #[error("the skin cannot be simulated: {0}")]
    System(#[from] SystemError),
    /// Its equilibria cannot be looked for.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

/// A face at rest, with what moves it.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The skin.
    pub system: System,
    /// What pulls on it.
    pub actuators: Actuators,
}

impl Stage {
    /// Makes a face ready, with its vertices at `rest` (mm).
    ///
    /// # Errors
    /// A face without the landmarks that actuators are placed by, or whose skin makes no system.
    pub fn new(face: &FaceModel, rest: &[Point3<f64>], setup: &Setup) -> Result<Self, StageError> {
        let law = MuscleLaw::default_of(setup.law);
        let mut actuators = Actuators::of(face, rest, &law, ActuatorSettings::default())?;
        actuators.tissues = setup.tissues;
        let carry = Carry::onto(face, rest).map_err(|missing| ActuatorError::Landmarks { missing })?;
        let options = SystemOptions {
            hold: setup.holding.hold(),
            stiffness: setup.stiffness,
            of_edges: if setup.tissues { tissue::of_edges(face, rest, &carry) } else { Vec::new() },
            ..SystemOptions::default()
        };
        let system = System::new(face.mesh(), rest, &actuators.held, Some(actuators.jaw.clone()), options)?;
        Ok(Self { system, actuators })
    }

    /// Where the skin comes to rest under each of these; names that this face does not have are passed over.
    ///
    /// # Errors
    /// Activations that are no numbers, and too little memory.
    pub fn equilibria(&mut self, expressions: &[Expression]) -> Result<Vec<Equilibrium>, StageError> {
        let mut solver = EquilibriumSolver::new(&self.system)?;
        let mut found = Vec::with_capacity(expressions.len());
        for expression in expressions {
            self.system.open_jaw(expression.jaw_deg.to_radians());
            self.system.set_loads(self.actuators.loads(expression).newton)?;
            found.push(solver.solve(&self.system, &self.system.carried()));
        }
        Ok(found)
    }
}
