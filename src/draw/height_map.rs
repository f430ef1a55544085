//! The 3-D height map as a picture: x and y of the face lie flat, the value (a force) stands up, and its colour says it again.

mod scene;

use std::fmt::Write;

use image::RgbImage;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::colour_map::{ColourMap, HATCHING, NOT_MEASURED};
use super::robust_range::robust_largest;
use super::svg::{self, SvgError};
use super::ticks;
use scene::Scene;

/// How a height map is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeightMapOptions {
    /// Width, px (default 1280, at least 640).
    pub width_px: u32,
    /// Height, px (default 960, at least 480).
    pub height_px: u32,
    /// The colours (default viridis).
    pub colour_map: ColourMap,
    /// Lowest and highest value of the colours; None (the default) takes 0 to the largest value, or ± the largest where
    /// there are negative ones.
    pub range: Option<[f64; 2]>,
    /// Millimetres of height for one unit of value; None (the default) chooses a round number that makes the peak about a third
    /// of the face's width.
    pub exaggeration_mm: Option<f64>,
    /// Unit of the values (default "N"; "N (relative)" where the scale is only assumed).
    pub unit: String,
    /// What the values are (default "|F|").
    pub quantity: String,
    /// Heading; empty for none.
    pub title: String,
    /// Turn of the view about the upright axis, rad (default −0.35; 0 looks along y, from the chin upwards).
    pub azimuth: f64,
    /// Height of the view above the face's plane, rad (default 1.0; π/2 looks straight down).
    pub elevation: f64,
}

impl Default for HeightMapOptions {
    fn default() -> Self {
        Self {
            width_px: 1280,
            height_px: 960,
            colour_map: ColourMap::default(),
            range: None,
            exaggeration_mm: None,
            unit: "N".to_owned(),
            quantity: "|F|".to_owned(),
            title: String::new(),
            azimuth: -0.35,
            elevation: 1.0,
        }
    }
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum HeightMapError {
    /// The lists do not belong together.
    #[error("a height map needs one value a vertex: {vertices} vertices, {values} values")]
    Lengths {
        /// Number of vertices.
        vertices: usize,
        /// Number of values.
        values: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} of the height map names a vertex beyond the {vertices} there are")]
    Index {
        /// The triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A position, a value or an option is not a finite number.
    #[error("{0} of the height map is not a finite number")]
    NotFinite(&'static str),
    /// The letters could not be painted.
    #[error(transparent)]
    Letters(#[from] SvgError),
}

/// Colours' range for values: 0 to the largest, or ± the largest where a value is negative; of a few values far above the rest
/// ([`robust_largest`]) without those. `[0, 1]` where there is none.
pub fn auto_range(values: &[Option<f64>]) -> [f64; 2] {
    let measured = || values.iter().flatten().copied().filter(|v| v.is_finite());
    match robust_largest(measured()) {
        0.0 => [0.0, 1.0],
        m if measured().any(|v| v < 0.0) => [-m, m],
        m => [0.0, m],
    }
}

/// Millimetres a unit so that the largest of `range` stands about a third of `width_mm` high, rounded down to one digit.
pub fn auto_exaggeration(width_mm: f64, range: [f64; 2]) -> f64 {
    let largest = range[0].abs().max(range[1].abs());
    let rough = 0.36 * width_mm / largest;
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let decade = 10_f64.powf(rough.log10().floor());
    (rough / decade).floor() * decade
}

/// Draws the height map of one value a vertex; None is *not measured* and is drawn flat, grey and hatched, never as a value.
///
/// A triangle with a corner that was not measured is not measured. Where measured skin ends, a wall goes down to the base.
///
/// # Errors
/// Lists of different lengths, indices out of range and numbers that are not finite.
pub fn render(
    positions: &[Point3<f64>],
    triangles: &[[u32; 3]],
    values: &[Option<f64>],
    options: &HeightMapOptions,
) -> Result<RgbImage, HeightMapError> {
    check(positions, triangles, values, options)?;
    let range = options.range.unwrap_or_else(|| auto_range(values));
    let width_mm = positions.iter().fold(0.0_f64, |w, p| w.max(2.0 * p.x.abs()));
    let exaggeration = options.exaggeration_mm.unwrap_or_else(|| auto_exaggeration(width_mm, range));
    let scene = Scene::new(positions, triangles, values, options, range, exaggeration);
    let mut picture = scene.draw();
    svg::paint_over(&lettering(&scene, values, options, range, exaggeration), &mut picture)?;
    Ok(picture)
}

fn check(
    positions: &[Point3<f64>],
    triangles: &[[u32; 3]],
    values: &[Option<f64>],
    options: &HeightMapOptions,
) -> Result<(), HeightMapError> {
    let vertices = positions.len();
    if vertices != values.len() {
        return Err(HeightMapError::Lengths { vertices, values: values.len() });
    }
    if let Some(triangle) = triangles.iter().position(|t| t.iter().any(|&i| i as usize >= vertices)) {
        return Err(HeightMapError::Index { triangle, vertices });
    }
    if !positions.iter().all(|p| p.coords.iter().all(|c| c.is_finite())) {
        return Err(HeightMapError::NotFinite("a position"));
    }
    if !values.iter().flatten().all(|v| v.is_finite()) {
        return Err(HeightMapError::NotFinite("a value"));
    }
    let numbers = [options.azimuth, options.elevation, options.exaggeration_mm.unwrap_or(1.0)];
    if !numbers.iter().chain(options.range.iter().flatten()).all(|v| v.is_finite()) {
        return Err(HeightMapError::NotFinite("an option"));
    }
    Ok(())
}

/// Everything that is written: heading, legend, axes and the peak.
fn lettering(
    scene: &Scene,
    values: &[Option<f64>],
    options: &HeightMapOptions,
    range: [f64; 2],
    exaggeration: f64,
) -> String {
    let (width, height) = (f64::from(scene.width), f64::from(scene.height));
    let unit = svg::escape(&options.unit);
    let quantity = svg::escape(&options.quantity);
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="{}" font-size="18" fill="#26262c">"##,
        svg::FONT_FAMILY
    );
    // Writing to a string cannot fail.
    let _ = write!(out, r#"<text x="32" y="50" font-size="28">{}</text>"#, svg::escape(&options.title));
    let measured = values.iter().flatten().count();
    let largest = values
        .iter()
        .flatten()
        .copied()
        .fold(None, |m: Option<f64>, v| Some(m.map_or(v, |m| if v.abs() > m.abs() { v } else { m })));
    let peak = largest.map_or_else(|| "nothing measured".to_owned(), |v| format!("largest {} {unit}", significant(v)));
    let _ = write!(
        out,
        r##"<text x="32" y="80" fill="#5a5a64">{peak} · height ×{} mm/{} · {measured} of {} vertices shown{}</text>"##,
        significant(exaggeration),
        svg::escape(options.unit.split_whitespace().next().unwrap_or("unit")),
        values.len(),
        cut_off(values, range)
    );
    axes(scene, &mut out);
    if let (Some((x, y)), Some(v)) = (scene.peak_in_picture, largest) {
        let _ = write!(
            out,
            r##"<path d="M{x:.1} {:.1}V{:.1}" stroke="#26262c" stroke-width="1.2"/><circle cx="{x:.1}" cy="{y:.1}" r="4" fill="#fff" stroke="#26262c" stroke-width="1.6"/><text x="{x:.1}" y="{:.1}" text-anchor="middle" stroke="#fbfbfc" stroke-width="5" stroke-opacity="0.85" stroke-linejoin="round" paint-order="stroke">{} {unit}</text>"##,
            y - 4.0,
            y - 30.0,
            y - 38.0,
            significant(v)
        );
    }
    legend(scene, options, range, &quantity, &unit, &mut out);
    out.push_str("</svg>");
    out
}

/// " · 3 beyond the bar": how many values have the colour of its end without being it.
fn cut_off(values: &[Option<f64>], [low, high]: [f64; 2]) -> String {
    let slack = 1e-9 * (high - low);
    match values.iter().flatten().filter(|v| **v > high + slack || **v < low - slack).count() {
        0 => String::new(),
        n => format!(" · {n} beyond the bar"),
    }
}

fn axes(scene: &Scene, out: &mut String) {
    for axis in &scene.axes {
        for (label, (x, y)) in &axis.ticks {
            let _ = write!(
                out,
                r##"<text x="{x:.1}" y="{:.1}" font-size="15" fill="#70707a" text-anchor="middle">{label}</text>"##,
                y + 5.0
            );
        }
        let (x, y) = axis.name_at;
        let _ = write!(
            out,
            r##"<text x="{x:.1}" y="{:.1}" font-size="16" fill="#5a5a64" text-anchor="middle">{}</text>"##,
            y + 5.0,
            axis.name
        );
    }
}

/// The colour bar with its ticks, and the sign for what was not measured.
fn legend(
    scene: &Scene,
    options: &HeightMapOptions,
    [low, high]: [f64; 2],
    quantity: &str,
    unit: &str,
    out: &mut String,
) {
    let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let (left, top) = (f64::from(scene.width) - 132.0, 0.2 * f64::from(scene.height));
    let length = 0.56 * f64::from(scene.height);
    let bottom = top + length;
    out.push_str(r#"<defs><linearGradient id="bar" x1="0" y1="1" x2="0" y2="0">"#);
    for i in 0..=32 {
        let t = f64::from(i) / 32.0;
        let _ = write!(out, r#"<stop offset="{t}" stop-color="{}"/>"#, hex(options.colour_map.at(t)));
    }
    let _ = write!(
        out,
        r##"</linearGradient><pattern id="hatch" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect width="7" height="7" fill="{}"/><rect width="2.4" height="7" fill="{}"/></pattern></defs>
<text x="{left}" y="{:.1}" font-size="20">{quantity}, {unit}</text>
<rect x="{left}" y="{top}" width="26" height="{length}" fill="url(#bar)" stroke="#70707a" stroke-width="0.8"/>
<rect x="{left}" y="{:.1}" width="26" height="20" fill="url(#hatch)" stroke="#70707a" stroke-width="0.8"/>
<text x="{:.1}" y="{:.1}" font-size="15">not measured, or border</text>"##,
        hex(NOT_MEASURED),
        hex(HATCHING),
        top - 18.0,
        bottom + 24.0,
        left,
        bottom + 64.0,
    );
    let places = ticks::nice_ticks(low, high, 4);
    for (tick, label) in places.iter().zip(ticks::labels(&places)) {
        let y = bottom - (tick - low) / (high - low) * length;
        let _ = write!(
            out,
            r##"<path d="M{:.1} {y:.1}h6" stroke="#26262c"/><text x="{:.1}" y="{:.1}">{label}</text>"##,
            left + 26.0,
            left + 38.0,
            y + 6.0
        );
    }
}

/// Three significant digits, without an exponent where it can be read so.
pub fn significant(value: f64) -> String {
    let digits_before = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let text = if (-5..6).contains(&digits_before) {
        format!("{value:.*}", (2 - digits_before).max(0) as usize)
    } else {
        format!("{value:.2e}")
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests;
