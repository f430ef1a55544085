//! What leaves the program: pictures and files for other tools.

pub mod colour_map;
pub mod raster;
pub mod svg;
pub mod ticks;

pub use colour_map::ColourMap;
