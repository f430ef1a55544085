//! The jaw: the one bone that moves, and carries the skin that lies on it.

use nalgebra::{Point3, Rotation3, Unit, Vector3};

/// A turn about an axis through the jaw's joints in which every vertex takes part by its weight.
///
/// The bone under vertex i turns by wᵢ times the angle of the jaw: w is 1 over the mandible, 0 above the mouth, between in the
/// cheeks. What a vertex is held by (its fixed place, its height above the skull, its anchor) turns with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Jaw {
    /// A point of the axis, mm.
    pub centre: Point3<f64>,
    /// The axis: a positive angle opens the mouth when it points to +x.
    pub axis: Unit<Vector3<f64>>,
    /// wᵢ, 0 to 1, one a vertex.
    pub weights: Vec<f64>,
}

/// Where the bone under each vertex is now.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pose {
    centre: Point3<f64>,
    /// One a vertex; empty while nothing has moved.
    turns: Vec<Rotation3<f64>>,
}

impl Pose {
    pub(super) fn of(jaw: &Jaw, angle_rad: f64) -> Self {
        if angle_rad == 0.0 {
            return Self::default();
        }
        let turns = jaw.weights.iter().map(|w| Rotation3::from_axis_angle(&jaw.axis, w * angle_rad)).collect();
        Self { centre: jaw.centre, turns }
    }

    /// Whether the bones lie as at rest.
    pub(super) fn is_at_rest(&self) -> bool {
        self.turns.is_empty()
    }

    pub(super) fn moved(&self, i: usize, p: &Point3<f64>) -> Point3<f64> {
        self.turns.get(i).map_or(*p, |t| self.centre + t * (p - self.centre))
    }

    pub(super) fn back(&self, i: usize, p: &Point3<f64>) -> Point3<f64> {
        self.turns.get(i).map_or(*p, |t| self.centre + t.inverse() * (p - self.centre))
    }

    pub(super) fn turned(&self, i: usize, v: &Vector3<f64>) -> Vector3<f64> {
        self.turns.get(i).map_or(*v, |t| t * v)
    }

    pub(super) fn turned_back(&self, i: usize, v: &Vector3<f64>) -> Vector3<f64> {
        self.turns.get(i).map_or(*v, |t| t.inverse() * v)
    }
}

/// Two poses of the bones.
#[derive(Debug)]
pub(super) struct Carried {
    pub(super) now: Pose,
    pub(super) then: Pose,
}

impl Carried {
    /// A place on the bone of a vertex, carried from now to then.
    pub(super) fn place(&self, i: usize, p: &Point3<f64>) -> Point3<f64> {
        self.then.moved(i, &self.now.back(i, p))
    }

    /// A vector there, turned from then to now.
    pub(super) fn back(&self, i: usize, v: &Vector3<f64>) -> Vector3<f64> {
        self.now.turned(i, &self.then.turned_back(i, v))
    }
}
