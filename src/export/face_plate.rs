//! Pictures of a face model: its surface from several sides, as wireframe or shaded, and its muscles over it as in an anatomy plate.

use std::fmt::Write as _;

use image::RgbImage;
use nalgebra::{Point3, Rotation3, Vector3};

use crate::draw::raster::{Colour, Corner, Hit, Line, Raster};
use crate::draw::svg::{self, SvgError};
use crate::face::{FaceModel, Mesh, Muscle, Side};

/// From where the face is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Straight on.
    Front,
    /// The person's left side turned to the eye by 40°.
    ThreeQuarter,
    /// The person's left side.
    Side,
}

/// How the surface is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Light and shadow.
    Shaded,
    /// Edges.
    Wireframe,
    /// Shaded, with the muscles over it and, from the front, their names.
    Muscles,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PlateOptions {
    /// One picture beside the other.
    pub views: Vec<View>,
    /// How the surface is drawn.
    pub style: Style,
    /// Height of the picture, px.
    pub height_px: u32,
}

/// Largest height of a plate, px.
pub const MAX_HEIGHT_PX: u32 = 8192;

/// Width of the column of names beside a front view, as a share of the height.
const NAMES: f64 = 0.34;
/// Share of the height that the face takes.
const FILL: f64 = 0.92;
const PAPER: Colour = [0.985, 0.983, 0.978];
const SKIN: Colour = [0.93, 0.845, 0.78];
const MUSCLE: Colour = [0.68, 0.235, 0.19];
const TENDON: Colour = [0.90, 0.83, 0.74];
const EDGE: Colour = [0.16, 0.25, 0.36];
/// Steps along and across a muscle.
const STEPS: [usize; 2] = [72, 30];
/// Stripes that stand for fibres, per mm of width.
const FIBRES_PER_MM: f64 = 0.55;

/// Draws a face model.
///
/// # Errors
/// A height of nothing or beyond [`MAX_HEIGHT_PX`].
pub fn render(face: &FaceModel, options: &PlateOptions) -> Result<RgbImage, SvgError> {
    let height = f64::from(options.height_px);
    if options.height_px == 0 || options.height_px > MAX_HEIGHT_PX || options.views.is_empty() {
        return Err(SvgError::Size { width: 0.0, height });
    }
    let extent = Extent::of(face.mesh());
    let scale = FILL * height / extent.height;
    let named = options.style == Style::Muscles;
    let panes: Vec<Pane> = options
        .views
        .iter()
        .scan(0.0, |left, &view| {
            let names = if named && view == View::Front { NAMES * height } else { 0.0 };
            let width = extent.width(view) * scale + 0.06 * height;
            let pane = Pane { view, middle: *left + names + width / 2.0, names, scale, height, extent };
            *left += width + 2.0 * names;
            Some((pane, *left))
        })
        .map(|(pane, _)| pane)
        .collect();
    let width = panes.last().map_or(0.0, |p| p.middle + extent.width(p.view) * scale / 2.0 + 0.03 * height + p.names);
    let normals = face.mesh().vertex_normals(face.mesh().positions());
    let mut sheet = Sheet::default();
    for pane in &panes {
        sheet.surface(face.mesh(), &normals, pane, options.style);
        if named {
            for (i, muscle) in face.muscles().iter().enumerate() {
                sheet.muscle(face.mesh(), &normals, muscle, pane, i / 2);
            }
        }
    }
    let raster = Raster { width: width.round() as u32, height: options.height_px, samples: 3 };
    let mut picture = raster.draw(&sheet.triangles, |hit| sheet.colour(hit, options.style), &sheet.lines, |_, _| PAPER);
    if named {
        for pane in panes.iter().filter(|p| p.names > 0.0) {
            svg::paint_over(&names(face, &normals, pane, width), &mut picture)?;
        }
    }
    Ok(picture)
}

/// The box round a mesh.
#[derive(Clone, Copy)]
struct Extent {
    middle: Point3<f64>,
    size: Vector3<f64>,
    height: f64,
}

impl Extent {
    fn of(mesh: &Mesh) -> Self {
        let (mut low, mut high) = (Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3]));
        for p in mesh.positions() {
            (low, high) = (low.inf(p), high.sup(p));
        }
        let size = high - low;
        // A flat sheet is as high as it is wide.
        Self { middle: nalgebra::center(&low, &high), size, height: size.y.max(size.x * 0.5).max(1e-9) }
    }

    fn width(&self, view: View) -> f64 {
        let turn = view.turn();
        (self.size.x * turn.cos().abs() + self.size.z * turn.sin().abs()).max(0.3 * self.height)
    }
}

impl View {
    /// Rotation of the face about the vertical, radians.
    fn turn(self) -> f64 {
        match self {
            View::Front => 0.0,
            View::ThreeQuarter => -40.0_f64.to_radians(),
            View::Side => -90.0_f64.to_radians(),
        }
    }
}

/// One view on the sheet.
struct Pane {
    view: View,
    /// Where the middle of the face comes to lie, px from the left.
    middle: f64,
    /// Width of the column of names on either side, px.
    names: f64,
    /// px/mm.
    scale: f64,
    height: f64,
    extent: Extent,
}

impl Pane {
    fn turned(&self, v: Vector3<f64>) -> Vector3<f64> {
        Rotation3::from_axis_angle(&Vector3::y_axis(), self.view.turn()) * v
    }

    fn corner(&self, p: &Point3<f64>) -> Corner {
        let q = self.turned(p - self.extent.middle) * self.scale;
        Corner { x: self.middle + q.x, y: self.height / 2.0 - q.y, depth: -q.z }
    }
}

/// What a corner of a triangle carries to the shader.
#[derive(Clone, Copy, Default)]
struct Ink {
    /// Unit normal, turned with the view.
    normal: Vector3<f64>,
    /// On a muscle: 0 at the bone to 1 at the skin, and mm across from its middle.
    along_across: Option<[f64; 2]>,
}

#[derive(Default)]
struct Sheet {
    triangles: Vec<[Corner; 3]>,
    inks: Vec<[Ink; 3]>,
    lines: Vec<Line>,
}

impl Sheet {
    fn surface(&mut self, mesh: &Mesh, normals: &[Vector3<f64>], pane: &Pane, style: Style) {
        let positions = mesh.positions();
        for t in mesh.triangles() {
            self.triangles.push(t.map(|v| pane.corner(&positions[v as usize])));
            let ink = |v: u32| Ink { normal: pane.turned(normals[v as usize]), along_across: None };
            self.inks.push(t.map(ink));
        }
        if style == Style::Shaded {
            return;
        }
        let (width, opacity) = if style == Style::Wireframe { (1.3, 1.0) } else { (0.8, 0.22) };
        let lift = 0.8 * pane.scale;
        for [a, b] in mesh.edges() {
            let ends = [a, b].map(|&v| pane.corner(&positions[v as usize]));
            let width_px = width * pane.height / 1000.0;
            self.lines.push(Line { ends, width_px, colour: EDGE, opacity, lift });
        }
    }

    /// A muscle as a band on the surface. Later ones lie over earlier ones.
    fn muscle(&mut self, mesh: &Mesh, normals: &[Vector3<f64>], muscle: &Muscle, pane: &Pane, order: usize) {
        let at = |v: u32| mesh.positions()[v as usize];
        let (bone, skin) = (at(muscle.attachment), at(muscle.insertion));
        let along = skin - bone;
        let Some(across) = Vector3::new(along.y, -along.x, 0.0).try_normalize(1e-9) else { return };
        let above = 1.2 + 0.25 * order as f64;
        let [long, wide] = STEPS;
        let mut grid = Vec::with_capacity((long + 1) * (wide + 1));
        for i in 0..=long {
            let s = i as f64 / long as f64;
            let half = muscle.half_width_mm * belly(s, muscle);
            for j in 0..=wide {
                let t = (2.0 * j as f64 / wide as f64 - 1.0) * half;
                let flat = bone + along * s + across * t;
                grid.push(lifted(mesh, normals, &flat).map(|(place, normal)| {
                    let ink = Ink { normal: pane.turned(normal), along_across: Some([s, t]) };
                    (pane.corner(&(place + normal * above)), ink)
                }));
            }
        }
        for i in 0..long {
            for j in 0..wide {
                let at = |di: usize, dj: usize| (i + di) * (wide + 1) + j + dj;
                for corners in [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]] {
                    // What would reach beyond the rim or over an opening is left out.
                    if let [Some(a), Some(b), Some(c)] = corners.map(|c| grid[c]) {
                        self.triangles.push([a.0, b.0, c.0]);
                        self.inks.push([a.1, b.1, c.1]);
                    }
                }
            }
        }
    }

    fn colour(&self, hit: Hit, style: Style) -> Colour {
        let inks = &self.inks[hit.triangle];
        let normal: Vector3<f64> = inks.iter().zip(hit.weights).map(|(ink, w)| ink.normal * w).sum();
        let normal = normal.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        // Seen from behind it is turned towards the eye, so that an open mesh shows its inside.
        let normal = if normal.z < 0.0 { -normal } else { normal };
        // A key light from above on the left of the picture, and a weak one from the right that keeps shadows open.
        let from = |light: Vector3<f64>| normal.dot(&light.normalize()).max(0.0);
        let light =
            (0.38 + 0.62 * from(Vector3::new(-0.35, 0.5, 0.8)) + 0.20 * from(Vector3::new(0.8, 0.1, 0.45))) as f32;
        let base = match inks[0].along_across {
            Some(_) => {
                let mean = |k: usize| -> f64 {
                    inks.iter().zip(hit.weights).map(|(ink, w)| ink.along_across.unwrap_or_default()[k] * w).sum()
                };
                fibres(mean(0), mean(1))
            }
            None if style == Style::Wireframe => return PAPER.map(|c| c * (0.93 + 0.07 * light)),
            None => SKIN,
        };
        base.map(|c| (c * light).min(1.0))
    }
}

/// Width of a muscle along its fibre, as a share of its half width: sheets are even, others have a belly, convergent ones a fan.
fn belly(s: f64, muscle: &Muscle) -> f64 {
    if muscle.zone_half_angle_deg.is_some() {
        0.25 + 0.75 * s
    } else if muscle.half_width_mm >= 12.0 {
        0.92 - 0.10 * s
    } else {
        0.42 + 0.50 * (4.0 * s * (1.0 - s)).sqrt()
    }
}

/// Red fibres, pale towards the bone.
fn fibres(along: f64, across: f64) -> Colour {
    let stripe = (std::f64::consts::TAU * FIBRES_PER_MM * across).cos();
    let shade = 0.90 + 0.10 * stripe;
    let pale = (1.0 - along / 0.16).clamp(0.0, 1.0).powi(2);
    [0, 1, 2].map(|c| (shade as f32) * (MUSCLE[c] + (TENDON[c] - MUSCLE[c]) * pale as f32))
}

/// The front of the surface over (x, y) with its smooth unit normal; none beside the surface.
fn lifted(mesh: &Mesh, normals: &[Vector3<f64>], flat: &Point3<f64>) -> Option<(Point3<f64>, Vector3<f64>)> {
    let positions = mesh.positions();
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for t in mesh.triangles() {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let side = |p: &Point3<f64>, q: &Point3<f64>| (q.x - p.x) * (flat.y - p.y) - (q.y - p.y) * (flat.x - p.x);
        let weights = [side(&b, &c), side(&c, &a), side(&a, &b)];
        let area: f64 = weights.iter().sum();
        if area <= 1e-9 || weights.iter().any(|w| *w < 0.0) {
            continue;
        }
        let z = (weights[0] * a.z + weights[1] * b.z + weights[2] * c.z) / area;
        if best.is_none_or(|(front, _)| z > front) {
            let normal: Vector3<f64> = t.iter().zip(weights).map(|(&v, w)| normals[v as usize] * w).sum();
            best = Some((z, normal.try_normalize(1e-9).unwrap_or_else(Vector3::z)));
        }
    }
    best.map(|(z, normal)| (Point3::new(flat.x, flat.y, z), normal))
}

/// Names with lines to the muscles: every other pair on the left of the picture, the others on the right.
fn names(face: &FaceModel, normals: &[Vector3<f64>], pane: &Pane, sheet_width: f64) -> String {
    let positions = face.mesh().positions();
    let middle = |m: &Muscle| nalgebra::center(&positions[m.attachment as usize], &positions[m.insertion as usize]);
    let mut pairs: Vec<&Muscle> = face.muscles().iter().filter(|m| m.side == Side::Left).collect();
    pairs.sort_by(|a, b| middle(b).y.total_cmp(&middle(a).y));
    let size = pane.height / 56.0;
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{sheet_width}" height="{}" font-family="{}" font-size="{size:.1}" fill="#2a2622">"##,
        pane.height,
        svg::FONT_FAMILY
    );
    for on_left in [true, false] {
        let mut last = f64::NEG_INFINITY;
        for left_muscle in pairs.iter().skip(usize::from(!on_left)).step_by(2) {
            let across = |m: &&Muscle| m.side == Side::Right && m.id == left_muscle.id.replace("_left", "_right");
            let muscle = match face.muscles().iter().find(across) {
                Some(partner) if on_left => partner,
                _ => left_muscle,
            };
            let on_axis = middle(muscle);
            let end = pane.corner(&lifted(face.mesh(), normals, &on_axis).map_or(on_axis, |(place, _)| place));
            let y = end.y.max(last + 2.6 * size);
            last = y;
            let edge = pane.extent.width(pane.view) * pane.scale / 2.0 + 0.03 * pane.height;
            let (x, anchor, sign) =
                if on_left { (pane.middle - edge, "end", -1.0) } else { (pane.middle + edge, "start", 1.0) };
            let latin = muscle.latin.strip_prefix("Musculus ").unwrap_or(&muscle.latin);
            let (name, rest) = latin.split_once(", ").unwrap_or((latin, ""));
            let second = if rest.is_empty() { String::new() } else { format!("{rest} · ") };
            // Writing to a string cannot fail.
            let _ = write!(
                out,
                r##"<path d="M{x:.1} {y:.1}L{:.1} {:.1}" stroke="#2a2622" stroke-width="{:.2}" fill="none"/><circle cx="{:.1}" cy="{:.1}" r="{:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="{anchor}">M. {}</text><text x="{:.1}" y="{:.1}" text-anchor="{anchor}" font-size="{:.1}" fill="#6b6058">{}AU {}</text>"##,
                end.x,
                end.y,
                size / 14.0,
                end.x,
                end.y,
                size / 6.0,
                x + sign * 0.5 * size,
                y + 0.1 * size,
                svg::escape(name),
                x + sign * 0.5 * size,
                y + 1.1 * size,
                0.82 * size,
                svg::escape(&second),
                muscle.action_unit
            );
        }
    }
    out.push_str("</svg>");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::generic;

    fn plate(style: Style, views: &[View]) -> RgbImage {
        render(&generic(), &PlateOptions { views: views.to_vec(), style, height_px: 400 }).unwrap()
    }

    fn share(picture: &RgbImage, is: impl Fn([u8; 3]) -> bool) -> f64 {
        picture.pixels().filter(|p| is(p.0)).count() as f64 / f64::from(picture.width() * picture.height())
    }

    fn is_muscle([r, g, b]: [u8; 3]) -> bool {
        i32::from(r) - i32::from(g) > 60 && i32::from(r) - i32::from(b) > 60
    }

    #[test]
    fn muscles_are_red_on_both_sides_and_only_where_they_are_asked_for() {
        assert!(share(&plate(Style::Shaded, &[View::Front]), is_muscle) < 1e-3);
        let picture = plate(Style::Muscles, &[View::Front]);
        assert!(share(&picture, is_muscle) > 0.04, "{}", share(&picture, is_muscle));
        let half = picture.width() / 2;
        let red = |from: u32, to: u32| {
            (from..to)
                .flat_map(|x| (0..400).map(move |y| (x, y)))
                .filter(|&(x, y)| is_muscle(picture.get_pixel(x, y).0))
                .count()
        };
        let (left, right) = (red(0, half) as f64, red(half, picture.width()) as f64);
        assert!((left / right - 1.0).abs() < 0.2, "{left} {right}");
    }

    #[test]
    fn the_views_stand_side_by_side_and_the_face_is_symmetric_from_the_front() {
        let all = plate(Style::Shaded, &[View::Front, View::ThreeQuarter, View::Side]);
        let front = plate(Style::Shaded, &[View::Front]);
        assert!(all.width() > front.width() + 300, "{} {}", all.width(), front.width());
        let wires = plate(Style::Wireframe, &[View::Front]);
        let half = wires.width() / 2;
        let ink = |from: u32, to: u32| {
            (from..to)
                .flat_map(|x| (0..400).map(move |y| (x, y)))
                .filter(|&(x, y)| wires.get_pixel(x, y).0[0] < 190)
                .count()
        };
        let (left, right) = (ink(0, half) as f64, ink(half, wires.width()) as f64);
        assert!((left / right - 1.0).abs() < 0.05, "{left} {right}");
    }

    #[test]
    fn a_size_that_cannot_be_is_refused() {
        for height_px in [0, MAX_HEIGHT_PX + 1] {
            let options = PlateOptions { views: vec![View::Front], style: Style::Shaded, height_px };
            assert!(matches!(render(&generic(), &options), Err(SvgError::Size { .. })));
        }
    }
}
