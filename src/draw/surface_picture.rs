//! A surface as a picture: shaded, seen from the front, from between and from the side, with a value a vertex as its colour.

use std::fmt::Write;

use image::RgbImage;
use nalgebra::{Point3, Rotation3, Vector3};

use super::colour_map::{ColourMap, NOT_MEASURED};
use super::paint::Paint;
use super::raster::{Colour, Corner, Line, Raster, colour};
use super::svg::{self, SvgError};
use super::ticks;

/// Colour of skin without a value.
const CLAY: [u8; 3] = [214, 203, 194];
/// What lies behind a surface.
pub(crate) const PAPER: [u8; 3] = [251, 251, 252];
const INK: Colour = [0.10, 0.10, 0.13];
/// Where the light comes from: above, from the left, in front.
const LIGHT: [f64; 3] = [-0.35, 0.45, 0.82];

/// How surfaces are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// Width of each view, px (default 420).
    pub view_width_px: u32,
    /// Height, px (default 560).
    pub height_px: u32,
    /// Turns about the vertical axis, rad, one a view (default: 0, 40° and 90°).
    pub turns: Vec<f64>,
    /// Whether the edges are drawn (default yes).
    pub wireframe: bool,
    /// The colours (default viridis).
    pub colour_map: ColourMap,
    /// Values at the ends of the colours (default 0 to 1).
    pub range: [f64; 2],
    /// Heading, and name and unit of the values: "distance, mm".
    pub title: String,
    /// Name and unit of the values; no legend where it is empty.
    pub quantity: String,
    /// What is seen through openings.
    pub fills: Vec<Fill>,
    /// What is painted on the surface where no values are; clay without it.
    pub paint: Option<Paint>,
    /// Points that find place in every view, so that several pictures have one scale; the surface's own where there are none.
    pub within: Vec<Point3<f64>>,
}

/// A flat shape in one colour, without light: the dark of a mouth; or a window on a ball: an eye in its opening.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// Its border, in order; it must be seen whole from its middle.
    pub corners: Vec<Point3<f64>>,
    /// Its colour.
    pub colour: [u8; 3],
    /// So much farther from the eye than it is, for what hides it, mm.
    pub behind_mm: f64,
    /// What is seen through it; its colour is then that of the ball.
    pub ball: Option<Ball>,
}

/// A ball that looks ahead, along z.
#[derive(Clone, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub centre: Point3<f64>,
    /// Its radius, mm.
    pub radius_mm: f64,
    /// Discs about the point that lies foremost: radius in mm and colour, the smallest first.
    pub rings: Vec<(f64, [u8; 3])>,
}

impl Ball {
    /// What is seen of it through a point, from a side (of length 1): the colour `own` outside its rings, and the normal.
    fn seen(&self, through: &Point3<f64>, from: &Vector3<f64>, own: [u8; 3]) -> ([u8; 3], Vector3<f64>) {
        let across = through - self.centre;
        let across = across - from * across.dot(from);
        let rise2 = self.radius_mm * self.radius_mm - across.norm_squared();
        // Beside the ball is its edge.
        let normal = (across + from * rise2.max(0.0).sqrt()).try_normalize(1e-12).unwrap_or(*from);
        let off = normal.xy().norm() * self.radius_mm;
        let ring = self.rings.iter().find(|(radius, _)| normal.z > 0.0 && off < *radius);
        (ring.map_or(own, |r| r.1), normal)
    }
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            view_width_px: 420,
            height_px: 560,
            turns: [0.0, 40.0, 90.0].map(f64::to_radians).to_vec(),
            wireframe: true,
            colour_map: ColourMap::default(),
            range: [0.0, 1.0],
            title: String::new(),
            quantity: String::new(),
            fills: Vec::new(),
            paint: None,
            within: Vec::new(),
        }
    }
}

/// Height of the heading, px.
pub(crate) const HEADING_PX: u32 = 56;
/// Width of the legend, px.
const LEGEND_PX: u32 = 130;

/// Draws the surface; without `values` in the colour of clay, with them a vertex without a value in grey.
///
/// # Errors
/// [`SvgError`] where the letters could not be painted. Indices and lists that do not fit leave their triangle out.
pub fn render(
    positions: &[Point3<f64>],
    triangles: &[[u32; 3]],
    values: Option<&[Option<f64>]>,
    options: &SurfaceOptions,
) -> Result<RgbImage, SvgError> {
    let (wide, high) = (options.view_width_px.clamp(64, 4096), options.height_px.clamp(64, 4096));
    let views = options.turns.len().clamp(1, 8) as u32;
    let legend = if options.quantity.is_empty() { 0 } else { LEGEND_PX };
    let raster = Raster { width: wide * views + legend, height: high + HEADING_PX, samples: 3 };

    let (mut low, mut top) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    let within = if options.within.is_empty() { positions } else { &options.within };
    for p in within {
        low = low.inf(p);
        top = top.sup(p);
    }
    let centre = nalgebra::center(&low, &top);
    // Every turn about the vertical axis fits.
    let half_width = within.iter().map(|p| (p - centre).xz().norm()).fold(1e-9, f64::max);
    let px_per_mm =
        (0.94 * f64::from(high) / (top.y - low.y).max(1e-9)).min(0.97 * f64::from(wide) / (2.0 * half_width));

    let known = |t: &&[u32; 3]| t.iter().all(|&i| (i as usize) < positions.len());
    let shown: Vec<[usize; 3]> = triangles.iter().filter(known).map(|t| t.map(|i| i as usize)).collect();
    let mut normals = vec![Vector3::zeros(); positions.len()];
    for &[a, b, c] in &shown {
        let n = (positions[b] - positions[a]).cross(&(positions[c] - positions[a]));
        for i in [a, b, c] {
            normals[i] += n;
        }
    }
    let mut corners = Vec::new();
    let mut lines = Vec::new();
    let mut turns = Vec::new();
    for (k, &turn) in options.turns.iter().take(views as usize).enumerate() {
        let about = Rotation3::from_axis_angle(&Vector3::y_axis(), -turn);
        turns.push(about);
        let middle = (f64::from(wide) * (k as f64 + 0.5), f64::from(HEADING_PX) + 0.5 * f64::from(high));
        let corner = |i: usize| {
            let q = about * (positions[i] - centre);
            Corner { x: middle.0 + px_per_mm * q.x, y: middle.1 - px_per_mm * q.y, depth: -q.z }
        };
        corners.extend(shown.iter().map(|t| t.map(corner)));
        for fill in &options.fills {
            let place = |p: &Point3<f64>| {
                let q = about * (p - centre);
                Corner { x: middle.0 + px_per_mm * q.x, y: middle.1 - px_per_mm * q.y, depth: fill.behind_mm - q.z }
            };
            let inner = place(&middle_of(&fill.corners));
            let next = fill.corners.iter().cycle().skip(1);
            corners.extend(fill.corners.iter().zip(next).map(|(a, b)| [inner, place(a), place(b)]));
        }
        if options.wireframe {
            let sides = shown.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|(a, b)| a < b);
            lines.extend(sides.map(|(a, b)| Line {
                ends: [corner(a), corner(b)],
                width_px: 0.9,
                colour: INK,
                opacity: 0.28,
                lift: 0.8,
            }));
        }
    }
    let light = Vector3::from(LIGHT).normalize();
    let in_fills: Vec<(&Fill, usize)> =
        options.fills.iter().flat_map(|f| (0..f.corners.len()).map(move |k| (f, k))).collect();
    let in_a_view = shown.len() + in_fills.len();
    let shade = |hit: super::raster::Hit| {
        let Some(&t) = shown.get(hit.triangle % in_a_view) else {
            let (fill, k) = in_fills[hit.triangle % in_a_view - shown.len()];
            let Some(ball) = &fill.ball else { return colour(fill.colour) };
            let ends = [middle_of(&fill.corners), fill.corners[k], fill.corners[(k + 1) % fill.corners.len()]];
            let through: Vector3<f64> = ends.iter().zip(hit.weights).map(|(p, w)| p.coords * w).sum();
            let about = turns[hit.triangle / in_a_view];
            let (seen, normal) = ball.seen(&through.into(), &(about.inverse() * Vector3::z()), fill.colour);
            let lit = (0.62 + 0.38 * (about * normal).dot(&light).max(0.0)) as f32;
            return colour(seen).map(|c| c * lit);
        };
        let blend = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
            t.iter().zip(hit.weights).map(|(&i, w)| of(i) * w).sum()
        };
        let normal =
            turns[hit.triangle / in_a_view] * blend(&|i| normals[i]).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let base = match values {
            None => options.paint.as_ref().map_or(colour(CLAY), |p| p.colour(t, hit.weights)),
            Some(values) => {
                let own = t.map(|i| values.get(i).copied().flatten());
                let value = match own {
                    [Some(a), Some(b), Some(c)] => Some(a * hit.weights[0] + b * hit.weights[1] + c * hit.weights[2]),
                    _ => None,
                };
                colour(value.map_or(NOT_MEASURED, |v| options.colour_map.of(Some(v), options.range)))
            }
        };
        // Seen from behind a surface is darker, not black.
        let lit = (0.46 + 0.54 * normal.dot(&light).max(0.0)) as f32 * if normal.z < 0.0 { 0.7 } else { 1.0 };
        base.map(|c| c * lit)
    };
    let paper = colour(PAPER);
    let mut picture = raster.draw(&corners, shade, &lines, |_, _| paper);
    svg::paint_over(&lettering(options, &raster, legend), &mut picture)?;
    Ok(picture)
}

fn middle_of(corners: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = corners.iter().map(|p| p.coords).sum();
    Point3::from(sum / corners.len().max(1) as f64)
}

fn lettering(options: &SurfaceOptions, raster: &Raster, legend: u32) -> String {
    let (width, height) = (raster.width, raster.height);
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="{}" font-size="15" fill="#26262c">"##,
        svg::FONT_FAMILY
    );
    // Writing to a string cannot fail.
    let _ = write!(out, r#"<text x="20" y="36" font-size="21">{}</text>"#, svg::escape(&options.title));
    if legend > 0 {
        let [low, high] = options.range;
        let (left, top) = (f64::from(width - legend) + 16.0, f64::from(HEADING_PX) + 50.0);
        let length = f64::from(height) - top - 90.0;
        let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
        out.push_str(r#"<defs><linearGradient id="bar" x1="0" y1="1" x2="0" y2="0">"#);
        for i in 0..=32 {
            let t = f64::from(i) / 32.0;
            let _ = write!(out, r#"<stop offset="{t}" stop-color="{}"/>"#, hex(options.colour_map.at(t)));
        }
        let _ = write!(
            out,
            r##"</linearGradient></defs><text x="{left}" y="{:.1}">{}</text><rect x="{left}" y="{top}" width="22" height="{length}" fill="url(#bar)" stroke="#70707a" stroke-width="0.8"/><rect x="{left}" y="{:.1}" width="22" height="16" fill="{}" stroke="#70707a" stroke-width="0.8"/><text x="{:.1}" y="{:.1}" font-size="13">none</text>"##,
            top - 16.0,
            svg::escape(&options.quantity),
            top + length + 18.0,
            hex(NOT_MEASURED),
            left + 30.0,
            top + length + 31.0,
        );
        let places = ticks::nice_ticks(low, high, 4);
        for (tick, label) in places.iter().zip(ticks::labels(&places)) {
            let y = top + length - (tick - low) / (high - low) * length;
            let _ = write!(
                out,
                r##"<path d="M{:.1} {y:.1}h6" stroke="#26262c"/><text x="{:.1}" y="{:.1}">{label}</text>"##,
                left + 22.0,
                left + 33.0,
                y + 5.0
            );
        }
    }
    out.push_str("</svg>");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 3]; 4] = [[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 50.0, 0.0], [-50.0, 50.0, 0.0]];

    #[test]
    fn a_square_is_seen_whole_from_the_front_and_as_nothing_from_the_side() {
        let positions = SQUARE.map(Point3::from);
        let options = SurfaceOptions {
            turns: vec![0.0, std::f64::consts::FRAC_PI_2],
            wireframe: false,
            ..SurfaceOptions::default()
        };
        let picture = render(&positions, &[[0, 1, 2], [0, 2, 3]], None, &options).unwrap();
        let inked = |columns: std::ops::Range<u32>| {
            columns
                .flat_map(|x| (0..picture.height()).map(move |y| (x, y)))
                .filter(|&(x, y)| picture.get_pixel(x, y).0[2] < 240)
                .count()
        };
        // A square of 100 mm, half a diagonal of 50 mm in a view of 420 px: 0.97 · 420 / 100 px/mm.
        let side = 0.97 * 420.0;
        let front = inked(0..420) as f64;
        assert!((front / (side * side) - 1.0).abs() < 0.02, "{front}");
        assert!(inked(420..840) < 1000);
    }

    #[test]
    fn values_colour_and_their_absence_is_grey_and_nonsense_is_left_out() {
        let positions = SQUARE.map(Point3::from);
        let options = SurfaceOptions {
            turns: vec![0.0],
            wireframe: false,
            quantity: "mm".to_owned(),
            ..SurfaceOptions::default()
        };
        let values = [Some(1.0), Some(1.0), Some(1.0), None];
        let picture = render(&positions, &[[0, 1, 2], [0, 2, 3], [0, 1, 9]], Some(&values), &options).unwrap();
        let [r, g, b] = picture.get_pixel(330, 400).0;
        assert!(r > 150 && g > 150 && b < 90, "yellow at the upper end: {r} {g} {b}");
        let [r, g, b] = picture.get_pixel(100, 200).0;
        assert!(r.abs_diff(g) < 8 && g.abs_diff(b) < 12, "grey: {r} {g} {b}");
        assert!(render(&[], &[], None, &SurfaceOptions::default()).is_ok());
    }

    #[test]
    fn a_fill_is_seen_through_an_opening_and_not_through_skin() {
        let positions = SQUARE.map(Point3::from);
        let fill = Fill { corners: positions.to_vec(), colour: [200, 30, 30], behind_mm: 1.0, ball: None };
        let options =
            SurfaceOptions { turns: vec![0.0], wireframe: false, fills: vec![fill], ..SurfaceOptions::default() };
        // The lower right half of the square is skin, the upper left one is open.
        let picture = render(&positions, &[[0, 1, 2]], None, &options).unwrap();
        assert_eq!(picture.get_pixel(110, 236).0, [200, 30, 30]);
        let [r, g, b] = picture.get_pixel(310, 436).0;
        assert!(r.abs_diff(g) < 30 && g.abs_diff(b) < 30, "clay: {r} {g} {b}");
    }
}
