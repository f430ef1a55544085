//! The 3D height map: from an outcome to a picture of its forces, with what is under the pointer.

pub mod axes;
pub mod ink;
pub mod mesh_picture;
pub mod options;
pub mod palette;
pub mod parts;
pub mod picking;
pub mod quantity;
pub mod range;
pub mod scene;
pub mod surface;

pub use options::{ErrorDisplay, Exaggeration, MapOptions};
pub use palette::{ColourCurve, Palette};
pub use quantity::{Direction, Layer, Quantity};
pub use range::{ColourRange, RangeMode};
pub use surface::{Relief, Surface};
