//! What the height map can show: one number a vertex, with its title, its unit and its standard error.

use nalgebra::Vector3;

use crate::face::{FaceModel, Muscle};
use crate::muscle_field::fibres::{fibre_field, muscle_name};
use crate::pipeline::Outcome;

/// What is drawn as height and colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Length of the force.
    #[default]
    Magnitude,
    /// Component along the fibre of the muscle that runs through the vertex; signed.
    AlongFibre,
    /// Component of the force along one direction; signed.
    Along,
    /// Length of the part in the surface.
    Tangential,
    /// Component along the outward normal; signed.
    Normal,
    /// Standard error of the force.
    StandardError,
    /// Force over its standard error.
    SignalToNoise,
    /// How far the force moves with the other depth rule.
    DepthChange,
    /// How far the skin moved.
    Displacement,
}

impl Quantity {
    /// In the order of the chooser.
    pub const ALL: [Self; 9] = [
        Self::Magnitude,
        Self::AlongFibre,
        Self::Along,
        Self::Tangential,
        Self::Normal,
        Self::StandardError,
        Self::SignalToNoise,
        Self::DepthChange,
        Self::Displacement,
    ];

    /// Words of the chooser.
    pub fn label(self) -> &'static str {
        match self {
            Self::Magnitude => "Force",
            Self::AlongFibre => "Force along the fibres",
            Self::Along => "Force along a direction",
            Self::Tangential => "Force in the skin",
            Self::Normal => "Force out of the skin",
            Self::StandardError => "Standard error",
            Self::SignalToNoise => "Force / standard error",
            Self::DepthChange => "Doubt from depth",
            Self::Displacement => "Displacement",
        }
    }

    /// One sentence for the tooltip.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Magnitude => "Length of the muscles' force on each vertex, |F| = |−K X|",
            Self::AlongFibre => {
                "The force's component along the fibre of the muscle in whose band the vertex lies; positive pulls to the bone, negative away from it"
            }
            Self::Along => "The force's component along the direction chosen beside; positive pulls that way",
            Self::Tangential => "Length of the part of the force that lies in the surface of the skin",
            Self::Normal => "The force's component along the outward normal; negative presses on the skull",
            Self::StandardError => "Standard error of the force, propagated from the error of marking",
            Self::SignalToNoise => "How many standard errors the force is large; below 2 it is noise",
            Self::DepthChange => {
                "How far the force moves when the other depth rule is taken: what one camera cannot see"
            }
            Self::Displacement => "How far the skin moved from the first frame to the last, head motion removed",
        }
    }

    /// Whether values of both signs occur.
    pub fn is_signed(self) -> bool {
        matches!(self, Self::AlongFibre | Self::Along | Self::Normal)
    }
}

/// The direction of [`Quantity::Along`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Up the face, +y.
    #[default]
    Up,
    /// Along the chosen muscle's fibre, from its insertion to its attachment: the way it pulls.
    Fibre,
}

/// One number a vertex, ready to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// "Force along frontalis medialis, left".
    pub title: String,
    /// The same in a word or two, for axes: "Force".
    pub short: &'static str,
    /// "N", "relative", "mm" or nothing.
    pub unit: &'static str,
    /// Whether values of both signs occur, so that colours are centred on zero.
    pub signed: bool,
    /// The value of each vertex; absent where nothing is known.
    pub values: Vec<Option<f64>>,
    /// Standard error of each value, where there is one. Of a component it is the whole vector's: never too small.
    pub sigma: Option<Vec<f64>>,
    /// Whether a vertex may set the colour range: what carries the border's or a fixture's reaction may not.
    pub sets_range: Vec<bool>,
}

impl Layer {
    /// Reads one quantity off an outcome; `muscle` gives the fibre of [`Direction::Fibre`].
    pub fn new(
        outcome: &Outcome,
        face: &FaceModel,
        quantity: Quantity,
        direction: Direction,
        muscle: Option<usize>,
    ) -> Self {
        let field = &outcome.field;
        let muscle = muscle.and_then(|m| face.muscles().get(m));
        let along = match (direction, muscle) {
            (Direction::Fibre, Some(muscle)) => fibre_direction(outcome, muscle).unwrap_or_else(Vector3::y),
            _ => Vector3::y(),
        };
        let at = |list: &[f64], v: usize| list.get(v).copied().unwrap_or(f64::NAN);
        let fibres = if quantity == Quantity::AlongFibre { fibre_field(face, &outcome.first) } else { Vec::new() };
        let along_own = |v: usize| Some(field.force[v].dot(&fibres.get(v)?.as_ref()?.direction));
        let value = |v: usize| match quantity {
            Quantity::Magnitude => field.force[v].norm(),
            // No muscle runs there: no number.
            Quantity::AlongFibre => along_own(v).unwrap_or(f64::NAN),
            Quantity::Along => field.force[v].dot(&along),
            Quantity::Tangential => at(&field.tangential, v),
            Quantity::Normal => at(&field.normal, v),
            Quantity::StandardError => at(&field.sigma, v),
            Quantity::SignalToNoise => field.force[v].norm() / at(&field.sigma, v),
            Quantity::DepthChange => at(&field.depth_change, v),
            Quantity::Displacement => (outcome.last[v] - outcome.first[v]).norm(),
        };
        let values: Vec<Option<f64>> = (0..face.mesh().len())
            .map(|v| {
                let known = outcome.states.get(v).is_some_and(|s| s.is_known());
                let there = v < field.force.len() && v < outcome.last.len() && v < outcome.first.len();
                (known && there).then(|| value(v)).filter(|x| x.is_finite())
            })
            .collect();
        let mut sets_range = outcome.sets_range();
        sets_range.resize(values.len(), false);
        let is_force = matches!(
            quantity,
            Quantity::Magnitude | Quantity::AlongFibre | Quantity::Along | Quantity::Tangential | Quantity::Normal
        );
        let title = match (quantity, direction, muscle) {
            (Quantity::Along, Direction::Fibre, Some(muscle)) => format!("Force along {}", muscle_name(muscle)),
            (Quantity::Along, ..) => "Force upwards".to_owned(),
            (Quantity::StandardError, ..) => "Standard error of force".to_owned(),
            _ => quantity.label().to_owned(),
        };
        let short = match quantity {
            Quantity::StandardError => "±",
            Quantity::SignalToNoise => "Force / ±",
            Quantity::DepthChange => "Doubt",
            Quantity::Displacement => "Displacement",
            _ => "Force",
        };
        let unit = match quantity {
            Quantity::SignalToNoise => "",
            Quantity::Displacement => "mm",
            _ => outcome.unit(),
        };
        Self {
            title,
            short,
            unit,
            signed: quantity.is_signed(),
            values,
            sigma: is_force.then(|| field.sigma.clone()),
            sets_range,
        }
    }

    /// "Force, N".
    pub fn axis_title(&self) -> String {
        if self.unit.is_empty() { self.short.to_owned() } else { format!("{}, {}", self.short, self.unit) }
    }

    /// The value of a vertex with its standard error.
    pub fn value_and_error(&self, vertex: usize) -> Option<(f64, Option<f64>)> {
        let value = self.values.get(vertex).copied().flatten()?;
        let error = self.sigma.as_ref().and_then(|s| s.get(vertex).copied()).filter(|s| s.is_finite());
        Some((value, error))
    }
}

/// Unit vector from a muscle's insertion to its attachment in the first frame: the way it pulls. Thesis (3.1).
pub fn fibre_direction(outcome: &Outcome, muscle: &Muscle) -> Option<Vector3<f64>> {
    let attachment = outcome.first.get(muscle.attachment as usize)?;
    let insertion = outcome.first.get(muscle.insertion as usize)?;
    (attachment - insertion).try_normalize(1e-9)
}
