//! One frame of the height map, painted from back to front.
//!
//! Over a plane the surface is a height field, and what hides what is decided by the plan alone: along any ray of sight the parts follow
//! each other in the order of their places in the plan. So parts are sorted by the depth of their place in the plan, whatever their height;
//! over the face itself they are sorted by their depth in space.

use egui::{Color32, Pos2};
use nalgebra::{Point3, Vector3};

use super::axes::Ground;
use super::ink::{Ink, Inks};
use super::options::{ErrorDisplay, MapOptions, noise_floor};
use super::palette::Palette;
use super::parts::Parts;
use super::quantity::Layer;
use super::surface::{Piece, Relief, Surface, at, level_piece, levels_between};
use crate::displacement::VertexState;
use crate::face::mesh::{Mesh, NONE};
use crate::gui::orbit_view::Projection;
use crate::muscle_field::section::Line;
use crate::pipeline::Outcome;
use crate::pipeline::peak::STANDS_ABOVE;

/// Everything that is drawn.
pub struct Scene<'a> {
    /// The triangles.
    pub mesh: &'a Mesh,
    /// The outcome shown.
    pub outcome: &'a Outcome,
    /// Its values.
    pub layer: &'a Layer,
    /// Their surface.
    pub surface: &'a Surface,
    /// The eye.
    pub projection: &'a Projection,
    /// The colours of values.
    pub palette: &'a Palette,
    /// All other colours.
    pub inks: &'a Inks,
    /// The user's choices.
    pub options: &'a MapOptions,
    /// mm per unit.
    pub mm_per_unit: f64,
    /// Values at which contours are drawn.
    pub contour_levels: &'a [f64],
    /// mm of arrow per unit of force.
    pub arrow_mm_per_unit: f64,
    /// Lines whose cuts through the surface are drawn: those of the profiles.
    pub cuts: &'a [Line],
    /// What of the mesh is drawn.
    pub parts: &'a Parts,
    /// The ground; unmeasured skin beyond it is left out.
    pub ground: &'a Ground,
}

/// Vertices on the screen.
#[derive(Clone, Debug)]
pub struct Projected {
    /// Heads, ui space.
    pub top: Vec<Pos2>,
    /// Feet, ui space.
    pub base: Vec<Pos2>,
    /// Depth of the heads towards the eye, mm.
    pub top_depth: Vec<f64>,
    /// Depth of the feet towards the eye, mm.
    pub base_depth: Vec<f64>,
}

impl Projected {
    /// Projects every vertex once.
    pub fn new(surface: &Surface, projection: &Projection) -> Self {
        let eye = projection.towards_eye_in_face();
        let see = |p: &Point3<f64>| (projection.ui_from_face(p), eye.dot(&p.coords));
        let (base, base_depth): (Vec<_>, Vec<_>) = surface.base.iter().map(see).unzip();
        let (mut top, mut top_depth) = (base.clone(), base_depth.clone());
        // Most of a large face lies flat: its heads are its feet.
        for (v, (head, foot)) in surface.top.iter().zip(&surface.base).enumerate() {
            if head.z != foot.z {
                (top[v], top_depth[v]) = see(head);
            }
        }
        Self { top, base, top_depth, base_depth }
    }
}

/// The parts, in the order in which parts at one place are drawn.
#[derive(Clone, Copy)]
enum Part {
    Triangle = 0,
    Edge = 1,
    Cliff = 2,
    Vertex = 3,
}

/// Distance of hatch lines in the plan, mm.
const HATCH_MM: f64 = 3.2;
/// Distance of the hatch lines of noise, mm.
const NOISE_HATCH_MM: f64 = 3.4;
/// Widths of their dark and of their light stroke, ui points.
const NOISE_WIDTHS: [f32; 2] = [3.0, 1.2];
/// Edges shorter than this on the screen are not drawn: they would be a grey fog.
const SHORTEST_EDGE: f32 = 4.0;

impl Scene<'_> {
    /// Paints everything into `ink`.
    pub fn paint(&self, projected: &Projected, ink: &mut Ink) {
        let size = self.marker_size(projected);
        ink.reserve(2 * self.parts.triangles.len());
        // Corners of coloured triangles are shared: each is lit and coloured once.
        let s = self.surface;
        let mut corner = vec![NONE; s.top.len()];
        for v in self.parts.triangles.iter().filter(|t| t.raised).flat_map(|t| t.corners).map(|v| v as usize) {
            if let (NONE, Some(value)) = (corner[v], self.layer.values.get(v).copied().flatten()) {
                corner[v] = ink.palette_vertex(projected.top[v], self.palette.u(value), self.light(&s.top_normals[v]));
            }
        }
        for key in self.sorted_parts(projected) {
            let index = (key & INDEX_MASK) as usize;
            match (key >> INDEX_BITS) & 3 {
                0 => self.triangle(index, &corner, projected, ink),
                1 => self.edge(index, projected, ink),
                2 => self.cliff(index, projected, ink),
                _ => self.vertex(index, size, projected, ink),
            }
        }
    }

    /// Sort keys: depth in the upper bits, then the kind of part, then its number.
    fn sorted_parts(&self, projected: &Projected) -> Vec<u64> {
        let eye = self.projection.towards_eye_in_face();
        let plan = Vector3::new(eye.x, eye.y, 0.0);
        let s = self.surface;
        let flat = s.relief == Relief::Plane;
        let depth_of = |v: u32, raised: bool| {
            let v = v as usize;
            match (flat, raised) {
                (true, _) => plan.dot(&s.base[v].coords),
                (false, true) => projected.top_depth[v],
                (false, false) => projected.base_depth[v],
            }
        };
        let triangles = self.mesh.triangles();
        let mean = |t: &[u32; 3], raised: bool| t.iter().map(|&v| depth_of(v, raised)).sum::<f64>() / 3.0;
        let depth = |t: u32| mean(&triangles[t as usize], s.raised[t as usize]);
        let drawn = &self.parts.triangles;
        let mut parts = Vec::with_capacity(drawn.len() * 3);
        parts.extend(drawn.iter().enumerate().map(|(k, t)| sort_key(mean(&t.corners, t.raised), Part::Triangle, k)));
        if self.options.wireframe && self.edges_are_long(projected) {
            for &e in &self.parts.edges {
                let sides = &self.mesh.triangles_of_edge()[e as usize];
                let nearest = sides.iter().filter(|t| **t != NONE).map(|&t| depth(t));
                parts.push(sort_key(nearest.fold(f64::NEG_INFINITY, f64::max), Part::Edge, e as usize));
            }
        }
        for (k, &[a, b]) in self.parts.rim.iter().enumerate() {
            parts.push(sort_key(f64::midpoint(depth_of(a, false), depth_of(b, false)), Part::Cliff, k));
        }
        // Signs that would cover each other are left to the vertices that a hand has marked.
        let crowded = mean_distance(self.mesh.edges(), &projected.base) < SHORTEST_EDGE;
        let measured = |v: usize| self.outcome.states.get(v) == Some(&VertexState::Measured);
        for v in 0..self.layer.values.len() {
            if self.layer.values[v].is_some() && (!crowded || measured(v)) {
                let nearest = self.mesh.triangles_of_vertex(v).iter().map(|&t| depth(t));
                parts.push(sort_key(nearest.fold(f64::NEG_INFINITY, f64::max), Part::Vertex, v));
            }
        }
        parts.sort_unstable();
        parts
    }

    fn edges_are_long(&self, projected: &Projected) -> bool {
        mean_distance(self.mesh.edges(), &projected.base) > SHORTEST_EDGE
    }

    /// Markers are as large as the mesh on the screen leaves room for: 1 where neighbours are 16 points apart.
    fn marker_size(&self, projected: &Projected) -> f32 {
        (mean_distance(self.mesh.edges(), &projected.base) / 16.0).clamp(0.45, 1.25)
    }

    /// Brightness of a surface with this normal, lit from the upper left of the screen.
    fn light(&self, normal: &Vector3<f64>) -> Color32 {
        if !self.options.shading {
            return Color32::WHITE;
        }
        let n = self.projection.view_from_face * normal;
        let lambert = n.dot(&Vector3::new(-0.40, 0.52, 0.755)).max(0.0);
        Color32::from_gray((255.0 * (0.70 + 0.30 * lambert.powf(0.8)).min(1.0)) as u8)
    }

    fn triangle(&self, t: usize, corner: &[u32], projected: &Projected, ink: &mut Ink) {
        let s = self.surface;
        let Some(part) = self.parts.triangles.get(t) else { return };
        let corners = part.corners.map(|v| v as usize);
        if !part.raised {
            if !corners.iter().all(|&v| self.ground.holds(&s.base[v])) {
                return;
            }
            let light = corners.map(|v| multiply(self.inks.unmeasured, self.light(&s.base_normals[v])));
            let fill = if s.relief == Relief::Plane { [self.inks.unmeasured; 3] } else { light };
            ink.triangle(corners.map(|v| projected.base[v]), fill);
            let stripes = corners.map(|v| s.base[v].x + s.base[v].y);
            let width = if s.relief == Relief::Plane { 1.0 } else { 0.8 };
            for level in levels_between(stripes, HATCH_MM * std::f64::consts::SQRT_2) {
                self.piece(corners.map(|v| s.base[v]), level_piece(stripes, level), width, self.inks.hatch, ink);
            }
            return;
        }
        let value = corners.map(|v| self.layer.values[v].unwrap_or(0.0));
        let sigma = self.sigma_of(corners);
        let shells = self.options.errors == ErrorDisplay::Shells && self.options.errors_apply(self.layer);
        let from_above = self.projection.towards_eye_in_face().z >= 0.0;
        let shell = |sign: f64, ink: &mut Ink| {
            if let (true, Some(sigma)) = (shells, sigma) {
                self.shell(corners, sigma, sign, ink);
            }
        };
        shell(if from_above { -1.0 } else { 1.0 }, ink);
        ink.shared_triangle(corners.map(|v| corner[v]));
        let top = corners.map(|v| s.top[v]);
        if let (true, Some(sigma)) = (self.options.below_noise, sigma)
            && value.iter().zip(sigma).all(|(v, s)| v.abs() < STANDS_ABOVE * s)
        {
            // A dark stroke with a light one in it: one of the two stands out on any colour.
            let stripes = corners.map(|v| s.base[v].x - s.base[v].y);
            for (width, stroke) in NOISE_WIDTHS.into_iter().zip(self.inks.noise) {
                for level in levels_between(stripes, NOISE_HATCH_MM * std::f64::consts::SQRT_2) {
                    self.piece(top, level_piece(stripes, level), width, stroke, ink);
                }
            }
        }
        if self.options.contours {
            let (least, most) = (value[0].min(value[1]).min(value[2]), value[0].max(value[1]).max(value[2]));
            for &level in self.contour_levels.iter().filter(|l| (least..=most).contains(l)) {
                self.piece(top, level_piece(value, level), 1.0, self.inks.contour, ink);
            }
        }
        for line in self.cuts {
            let side = top.map(|p| line.place(&p).1);
            if side.iter().all(|s| *s < 0.0) || side.iter().all(|s| *s > 0.0) {
                continue;
            }
            self.piece(top, level_piece(side, 0.0), 3.0, self.inks.canvas.gamma_multiply(0.35), ink);
            self.piece(top, level_piece(side, 0.0), 1.4, self.inks.selected, ink);
        }
        if self.options.noise_floor && s.relief == Relief::Plane {
            self.noise_plane(corners, value, ink);
        }
        shell(if from_above { 1.0 } else { -1.0 }, ink);
    }

    fn sigma_of(&self, corners: [usize; 3]) -> Option<[f64; 3]> {
        let sigma = self.layer.sigma.as_ref()?;
        let of = |v: usize| sigma.get(v).copied().filter(|s| s.is_finite());
        Some([of(corners[0])?, of(corners[1])?, of(corners[2])?])
    }

    fn shell(&self, corners: [usize; 3], sigma: [f64; 3], sign: f64, ink: &mut Ink) {
        let lifted: [Point3<f64>; 3] =
            std::array::from_fn(|k| self.raised_by(corners[k], sign * sigma[k] * self.mm_per_unit));
        let pixels = lifted.map(|p| self.projection.ui_from_face(&p));
        ink.triangle(pixels, [self.inks.weak_text.gamma_multiply(0.22); 3]);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            ink.line(pixels[a], pixels[b], 0.5, self.inks.weak_text.gamma_multiply(0.35));
        }
    }

    fn raised_by(&self, vertex: usize, mm: f64) -> Point3<f64> {
        self.surface.top[vertex] + Vector3::new(0.0, 0.0, mm)
    }

    /// The part of the noise floor that lies above the surface within one triangle.
    fn noise_plane(&self, corners: [usize; 3], value: [f64; 3], ink: &mut Ink) {
        let Some(floor) = noise_floor(self.layer) else { return };
        let levels: &[f64] = if self.layer.signed { &[-1.0, 1.0] } else { &[1.0] };
        for sign in levels {
            let level = sign * floor;
            let feet = corners.map(|v| {
                self.projection.ui_from_face(&(self.surface.base[v] + Vector3::new(0.0, 0.0, level * self.mm_per_unit)))
            });
            let mut outline: Vec<Pos2> = Vec::with_capacity(4);
            for k in 0..3 {
                let next = (k + 1) % 3;
                let (here, there) = ((level - value[k]) * sign, (level - value[next]) * sign);
                if here > 0.0 {
                    outline.push(feet[k]);
                }
                if (here > 0.0) != (there > 0.0) {
                    outline.push(feet[k] + (feet[next] - feet[k]) * (here / (here - there)) as f32);
                }
            }
            for k in 2..outline.len() {
                let colour = self.inks.selected.gamma_multiply(0.16);
                ink.triangle([outline[0], outline[k - 1], outline[k]], [colour; 3]);
            }
            let pixel = |p: Point3<f64>| self.projection.ui_from_face(&p);
            if let Some(ends) = level_piece(value, level) {
                let top = corners.map(|v| self.surface.top[v]);
                ink.line(pixel(at(top, ends[0])), pixel(at(top, ends[1])), 1.2, self.inks.selected);
            }
        }
    }

    fn piece(&self, corners: [Point3<f64>; 3], piece: Option<Piece>, width: f32, colour: Color32, ink: &mut Ink) {
        if let Some([a, b]) = piece {
            let pixel = |weights| self.projection.ui_from_face(&at(corners, weights));
            ink.line(pixel(a), pixel(b), width, colour);
        }
    }

    fn edge(&self, e: usize, projected: &Projected, ink: &mut Ink) {
        let [a, b] = self.mesh.edges()[e].map(|v| v as usize);
        let is_raised = |t: u32| t != NONE && self.surface.raised[t as usize];
        let sides = self.mesh.triangles_of_edge()[e];
        let raised = sides.map(is_raised);
        if raised[0] || raised[1] {
            let both = raised[0] && raised[1];
            let (width, colour) = if both { (0.8, self.inks.wire) } else { (1.3, self.inks.contour) };
            ink.line(projected.top[a], projected.top[b], width, colour);
        } else if sides.iter().any(|&t| t != NONE && self.on_ground(t)) {
            ink.line(projected.base[a], projected.base[b], 0.8, self.inks.wire_flat);
        }
    }

    fn on_ground(&self, t: u32) -> bool {
        self.mesh.triangles()[t as usize].iter().all(|&v| self.ground.holds(&self.surface.base[v as usize]))
    }

    fn cliff(&self, k: usize, projected: &Projected, ink: &mut Ink) {
        let Some([a, b]) = self.parts.rim.get(k).map(|e| e.map(|v| v as usize)) else { return };
        let corners = [projected.base[a], projected.base[b], projected.top[b], projected.top[a]];
        ink.quad(corners, [self.inks.cliff; 4]);
        ink.line(projected.top[a], projected.top[b], 1.3, self.inks.contour);
        ink.line(projected.base[a], projected.base[b], 1.0, self.inks.contour.gamma_multiply(0.5));
    }

    fn vertex(&self, v: usize, size: f32, projected: &Projected, ink: &mut Ink) {
        let centre = projected.top[v];
        let Some((_, error)) = self.layer.value_and_error(v) else { return };
        let state = self.outcome.states.get(v).copied().unwrap_or_default();
        let border = self.outcome.border.get(v).copied().unwrap_or(false);
        let bars = self.options.errors == ErrorDisplay::Bars && self.options.errors_apply(self.layer);
        if let (true, Some(error), VertexState::Measured) = (bars, error, state) {
            let reach = error * self.mm_per_unit;
            let ends = [reach, -reach].map(|mm| self.projection.ui_from_face(&self.raised_by(v, mm)));
            ink.line(ends[0], ends[1], 2.6, self.inks.halo.gamma_multiply(0.6));
            ink.line(ends[0], ends[1], 1.2, self.inks.text);
            for end in ends {
                let cap = egui::vec2(2.5, 0.0);
                ink.line(end - cap, end + cap, 1.2, self.inks.text);
            }
        }
        if self.options.arrows
            && let Some(force) = self.outcome.field.force.get(v)
        {
            let head = self.surface.top[v] + force * self.arrow_mm_per_unit;
            let head = self.projection.ui_from_face(&head);
            ink.arrow(centre, head, 3.0, self.inks.canvas.gamma_multiply(0.55));
            ink.arrow(centre, head, 1.4, self.inks.arrow);
        }
        if self.options.markers {
            draw_marker(ink, centre, size, state, border, self.inks);
        }
    }
}

/// Told apart by shape: measured a dot, inferred a small ring, fixed a square; the border's have a dotted outline. The legend shows
/// them by this same function.
pub fn draw_marker(ink: &mut Ink, centre: Pos2, size: f32, state: VertexState, border: bool, inks: &Inks) {
    let (marker, halo) = (inks.marker, inks.halo.gamma_multiply(0.75));
    match state {
        VertexState::Measured => {
            ink.disc(centre, 2.3 * size, halo);
            ink.disc(centre, 1.6 * size, marker);
        }
        VertexState::Inferred => {
            ink.ring(centre, 2.1 * size, 2.0 * size, halo, false);
            ink.ring(centre, 2.1 * size, 0.9 * size, marker, false);
        }
        VertexState::Fixed => {
            ink.square(centre, 2.8 * size, halo);
            ink.square(centre, 2.0 * size, marker);
        }
        VertexState::Unmeasured => {}
    }
    if border {
        ink.ring(centre, 4.6 * size, 2.2 * size, halo, true);
        ink.ring(centre, 4.6 * size, 1.2 * size, marker, true);
    }
}

/// Mean distance between the ends of some two hundred of the edges on the screen, points.
fn mean_distance(edges: &[[u32; 2]], pixels: &[Pos2]) -> f32 {
    let step = (edges.len() / 200).max(1);
    let (sum, count) = edges.iter().step_by(step).fold((0.0, 0.0_f32), |(sum, count), &[a, b]| {
        (sum + pixels[a as usize].distance(pixels[b as usize]), count + 1.0)
    });
    sum / count.max(1.0)
}

const INDEX_BITS: u32 = 30;
const INDEX_MASK: u64 = (1 << INDEX_BITS) - 1;

/// Larger keys are drawn later. Depths (mm) keep their order: the bits of a float sort like integers once the sign is mended.
fn sort_key(depth: f64, part: Part, index: usize) -> u64 {
    // Rounded to a tenth of a micrometre, so that parts at one depth follow the order of their kinds.
    let bits = (((depth * 1e4).round() / 1e4) as f32 + 0.0).to_bits();
    let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    (u64::from(ordered) << (INDEX_BITS + 2)) | ((part as u64) << INDEX_BITS) | (index as u64 & INDEX_MASK)
}

fn multiply(a: Color32, b: Color32) -> Color32 {
    let m = |x: u8, y: u8| (u16::from(x) * u16::from(y) / 255) as u8;
    Color32::from_rgb(m(a.r(), b.r()), m(a.g(), b.g()), m(a.b(), b.b()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_sort_by_depth_then_kind_then_number() {
        let depths = [-1e4, -20.5, -0.001, 0.0, 0.001, 3.0, 900.0];
        let keys: Vec<u64> = depths.iter().map(|&d| sort_key(d, Part::Triangle, 5)).collect();
        assert!(keys.is_sorted());
        assert!(sort_key(3.0, Part::Triangle, 900) < sort_key(3.0, Part::Vertex, 0));
        assert!(sort_key(3.0, Part::Vertex, 900) < sort_key(3.1, Part::Triangle, 0));
        assert_eq!(sort_key(0.0, Part::Edge, 77) & INDEX_MASK, 77);
        // A quarter turn's cosine is not quite zero; what it leaves must not decide the order.
        assert_eq!(sort_key(6e-15, Part::Cliff, 1), sort_key(-6e-15, Part::Cliff, 1));
    }
}
