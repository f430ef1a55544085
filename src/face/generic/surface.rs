//! The surface on which the generic face is drawn: places in the plane of the picture, lifted onto the depth map.

use nalgebra::Point3;

use super::depth_map::depth;
use super::drawing::Place;

/// The point of the face over a place in the plane, mm.
pub(super) fn on_surface([x, y]: Place) -> Point3<f64> {
    Point3::new(x, y, depth(x, y))
}

/// Distance in space between the points over two places, mm.
pub(super) fn step(a: Place, b: Place) -> f64 {
    (on_surface(b) - on_surface(a)).norm()
}
