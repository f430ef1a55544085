//! The 3-D height map as a picture: x and y of the face lie flat, the value (a force) stands up, and its colour says it again.

mod scene;

use std::fmt::Write;

use image::RgbImage;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::colour_map::{ColourMap, HATCHING, NOISE_HATCHING, NOT_MEASURED};
use super::numbers::significant;
use super::robust_range::automatic_range;
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
    /// Lowest and highest value of the colours; None (the default) takes 0 to a round number that holds the values that may set
    /// the range, or ± that where there are negative ones ([`automatic_range`]).
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

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Heights<'a> {
    /// The vertices, mm.
    pub positions: &'a [Point3<f64>],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// The value of each vertex; None is *not measured*.
    pub values: &'a [Option<f64>],
    /// Whether each value is below its noise, or none at all: none is said to be. Triangles whose corners all are get hatched.
    pub below_noise: &'a [bool],
    /// Whether each value may set the range, or none at all: all may.
    pub sets_range: &'a [bool],
    /// The vertex with the value to point out, and its words.
    pub peak: Option<(usize, String)>,
    /// What was found, in words: printed under the heading.
    pub finding: String,
    /// What to beware of, in words; empty for nothing.
    pub warning: String,
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
/// A triangle with a corner that was not measured is not measured. Where measured skin ends, a wall goes down to the base. Where all
/// corners of a triangle are below their noise, a dark-and-light hatching lies over the colours.
///
/// # Errors
/// Lists of different lengths, indices out of range and numbers that are not finite.
pub fn render(heights: &Heights<'_>, options: &HeightMapOptions) -> Result<RgbImage, HeightMapError> {
    check(heights, options)?;
    let range = options.range.unwrap_or_else(|| {
        let sets = |v: usize| heights.sets_range.get(v).copied().unwrap_or(true);
        let known = heights.values.iter().enumerate().filter_map(|(v, x)| Some(((*x)?, sets(v))));
        let signed = heights.values.iter().flatten().any(|v| *v < 0.0);
        automatic_range(known, signed)
    });
    let width_mm = heights.positions.iter().fold(0.0_f64, |w, p| w.max(2.0 * p.x.abs()));
    let exaggeration = options.exaggeration_mm.unwrap_or_else(|| auto_exaggeration(width_mm, range));
    let scene = Scene::new(heights, options, range, exaggeration);
    let mut picture = scene.draw();
    svg::paint_over(&lettering(&scene, heights, options, range, exaggeration), &mut picture)?;
    Ok(picture)
}

fn check(heights: &Heights<'_>, options: &HeightMapOptions) -> Result<(), HeightMapError> {
    let Heights { positions, triangles, values, .. } = *heights;
    let vertices = positions.len();
    for list in [heights.below_noise.len(), heights.sets_range.len()] {
        if list != 0 && list != vertices {
            return Err(HeightMapError::Lengths { vertices, values: list });
        }
    }
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

/// Everything that is written: heading, finding, warning, legend, axes and the peak.
fn lettering(
    scene: &Scene,
    heights: &Heights<'_>,
    options: &HeightMapOptions,
    range: [f64; 2],
    exaggeration: f64,
) -> String {
    let (width, height) = (f64::from(scene.width), f64::from(scene.height));
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="{}" font-size="18" fill="#26262c">"##,
        svg::FONT_FAMILY
    );
    // Writing to a string cannot fail.
    let _ = write!(out, r#"<text x="32" y="44" font-size="28">{}</text>"#, svg::escape(&options.title));
    let values = heights.values;
    let shown = format!(
        "{} · height ×{} mm/{} · {} of {} vertices shown{}",
        heights.finding,
        significant(exaggeration, 3),
        options.unit.split_whitespace().next().unwrap_or("unit"),
        values.iter().flatten().count(),
        values.len(),
        cut_off(values, range)
    );
    let _ = write!(out, r##"<text x="32" y="74" font-size="17" fill="#5a5a64">{}</text>"##, svg::escape(&shown));
    let warning = svg::escape(&heights.warning);
    let _ = write!(out, r##"<text x="32" y="100" font-size="17" fill="#a33c00">{warning}</text>"##);
    axes(scene, &mut out);
    if let (Some((x, y)), Some((_, words))) = (scene.peak_in_picture, &heights.peak) {
        let _ = write!(
            out,
            r##"<path d="M{x:.1} {:.1}V{:.1}" stroke="#26262c" stroke-width="1.2"/><circle cx="{x:.1}" cy="{y:.1}" r="4" fill="#fff" stroke="#26262c" stroke-width="1.6"/><text x="{x:.1}" y="{:.1}" text-anchor="middle" stroke="#fbfbfc" stroke-width="5" stroke-opacity="0.85" stroke-linejoin="round" paint-order="stroke">{}</text>"##,
            y - 4.0,
            y - 30.0,
            y - 38.0,
            svg::escape(words)
        );
    }
    legend(scene, heights, options, range, &mut out);
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

/// The colour bar with its ticks, and the signs for what was not measured and for what is below its noise.
fn legend(scene: &Scene, heights: &Heights<'_>, options: &HeightMapOptions, [low, high]: [f64; 2], out: &mut String) {
    let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let (quantity, unit) = (svg::escape(&options.quantity), svg::escape(&options.unit));
    let (left, top) = (f64::from(scene.width) - 156.0, 0.2 * f64::from(scene.height));
    let length = 0.56 * f64::from(scene.height);
    let bottom = top + length;
    out.push_str(r#"<defs><linearGradient id="bar" x1="0" y1="1" x2="0" y2="0">"#);
    for i in 0..=32 {
        let t = f64::from(i) / 32.0;
        let _ = write!(out, r#"<stop offset="{t}" stop-color="{}"/>"#, hex(options.colour_map.at(t)));
    }
    let pattern = |out: &mut String, id: &str, turn: i32, behind: [u8; 3], strokes: &[(f64, f64, [u8; 3])]| {
        let _ = write!(
            out,
            r#"<pattern id="{id}" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate({turn})"><rect width="7" height="7" fill="{}"/>"#,
            hex(behind)
        );
        for (x, width, ink) in strokes {
            let _ = write!(out, r#"<rect x="{x}" width="{width}" height="7" fill="{}"/>"#, hex(*ink));
        }
        out.push_str("</pattern>");
    };
    out.push_str("</linearGradient>");
    pattern(out, "hatch", 45, NOT_MEASURED, &[(0.0, 2.4, HATCHING)]);
    let [dark, light] = NOISE_HATCHING;
    pattern(out, "noise", -45, options.colour_map.at(0.65), &[(0.0, 1.7, dark), (1.7, 1.7, light)]);
    let _ = write!(
        out,
        r##"</defs>
<text x="{left}" y="{:.1}" font-size="20">{quantity}, {unit}</text>
<rect x="{left}" y="{top}" width="26" height="{length}" fill="url(#bar)" stroke="#70707a" stroke-width="0.8"/>"##,
        top - 18.0
    );
    let mut sign = |y: f64, fill: &str, lines: [&str; 2]| {
        let _ = write!(
            out,
            r##"<rect x="{left}" y="{y:.1}" width="26" height="20" fill="url(#{fill})" stroke="#70707a" stroke-width="0.8"/>"##
        );
        for (i, line) in lines.into_iter().enumerate() {
            let (x, y) = (left + 36.0, y + 15.0 + 17.0 * i as f64);
            let _ = write!(out, r#"<text x="{x:.1}" y="{y:.1}" font-size="15">{line}</text>"#);
        }
    };
    sign(bottom + 24.0, "hatch", ["not measured,", "or border"]);
    if !heights.below_noise.is_empty() {
        sign(bottom + 68.0, "noise", ["below twice", "its error"]);
    }
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

#[cfg(test)]
mod tests;
