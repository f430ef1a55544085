//! Drawing without a window: colour maps, ticks, charts as SVG, and the software rasteriser.

pub mod colour_map;
pub mod height_map;
pub mod line_chart;
pub mod numbers;
pub mod paint;
pub mod raster;
pub mod robust_range;
pub mod surface_picture;
pub mod svg;
pub mod ticks;
pub mod words;

pub use colour_map::ColourMap;
