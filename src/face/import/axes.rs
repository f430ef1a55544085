//! Which way is up and which way the face looks in a file, and the turn into face space.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Point3, Vector3};

use super::{ImportError, Soup};

/// A direction along an axis of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direction {
    axis: u8,
    negative: bool,
}

impl Direction {
    const fn new(axis: u8, negative: bool) -> Self {
        Self { axis, negative }
    }

    fn unit(self) -> Vector3<f64> {
        let mut unit = Vector3::zeros();
        unit[usize::from(self.axis)] = if self.negative { -1.0 } else { 1.0 };
        unit
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", if self.negative { "-" } else { "" }, ["x", "y", "z"][usize::from(self.axis)])
    }
}

impl FromStr for Direction {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (negative, axis) =
            text.strip_prefix('-').map_or((false, text.trim_start_matches('+')), |rest| (true, rest));
        match axis {
            "x" => Ok(Self::new(0, negative)),
            "y" => Ok(Self::new(1, negative)),
            "z" => Ok(Self::new(2, negative)),
            _ => Err("a direction is x, y, z, -x, -y or -z"),
        }
    }
}

/// Where up and front are in a file. By default y and z, as in face space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes {
    up: Direction,
    front: Direction,
}

impl Default for Axes {
    fn default() -> Self {
        Self { up: Direction::new(1, false), front: Direction::new(2, false) }
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is up and {} is where the face looks", self.up, self.front)
    }
}

impl Axes {
    /// Both directions, which must lie across each other.
    pub fn new(up: Direction, front: Direction) -> Result<Self, ImportError> {
        if up.axis == front.axis {
            return Err(ImportError::Option("up and front must be different axes"));
        }
        Ok(Self { up, front })
    }
}

/// A surface that looks one way on the whole by at least this share of its area is a face, else a closed head or body.
const LOOKS: f64 = 0.2;

/// Where an outward surface looks on the whole, if it does: a closed head or body looks everywhere.
pub(super) fn looks(soup: &Soup) -> Option<Vector3<f64>> {
    let normals = soup.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| soup.positions[i as usize]);
        (b - a).cross(&(c - a))
    });
    let (sum, area) = normals.fold((Vector3::zeros(), 0.0), |(sum, area), n| (sum + n, area + n.norm()));
    (sum.norm() > LOOKS * area).then_some(sum)
}

/// The axes of an outward surface by its shape. Up is y, or z where the face looks along y: files do not show more.
pub(super) fn guess(soup: &Soup) -> Axes {
    let Some(sum) = looks(soup) else { return Axes::default() };
    let axis = sum.iamax() as u8;
    let front = Direction::new(axis, sum[usize::from(axis)] < 0.0);
    Axes { up: Direction::new(if axis == 1 { 2 } else { 1 }, false), front }
}

/// Turns the points into face space: x to the right of the picture, y up, z to the front.
pub(super) fn turn(soup: &mut Soup, axes: Axes) {
    if axes == Axes::default() {
        return;
    }
    let (up, front) = (axes.up.unit(), axes.front.unit());
    let right = up.cross(&front);
    for p in &mut soup.positions {
        *p = Point3::new(p.coords.dot(&right), p.coords.dot(&up), p.coords.dot(&front));
    }
}

/// Changes left and right; the triangles are wound the other way to keep their outside.
pub(super) fn mirror(soup: &mut Soup) {
    for p in &mut soup.positions {
        p.x = -p.x;
    }
    for t in &mut soup.triangles {
        t.swap(1, 2);
    }
}
