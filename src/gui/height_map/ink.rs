//! Lines, dots and triangles of the height map in one egui mesh, in the order in which they are drawn, with soft edges.

use egui::epaint::Vertex;
use egui::{Color32, Mesh, Pos2, TextureId, Vec2, pos2};

use crate::draw::colour_map::NOISE_HATCHING;

/// Texture coordinate of plain colour: the lower half of the palette's texture is white.
const PLAIN: Pos2 = pos2(0.5, 0.75);

/// The colours of the map that do not come from the palette.
#[derive(Clone, Copy, Debug)]
pub struct Inks {
    /// Behind everything.
    pub canvas: Color32,
    /// Lines of the base grid.
    pub grid: Color32,
    /// Axes and their ticks.
    pub axis: Color32,
    /// Numbers and titles.
    pub text: Color32,
    /// Less important words.
    pub weak_text: Color32,
    /// Where nothing was measured.
    pub unmeasured: Color32,
    /// The hatching over it.
    pub hatch: Color32,
    /// The wireframe over unmeasured skin.
    pub wire_flat: Color32,
    /// The wireframe over colours.
    pub wire: Color32,
    /// Contour lines and the edge of what was measured.
    pub contour: Color32,
    /// The cliff at the end of what was measured.
    pub cliff: Color32,
    /// Hatching of what lies below the noise: its dark and its light stroke.
    pub noise: [Color32; 2],
    /// Dark part of a marker.
    pub marker: Color32,
    /// Light part of a marker.
    pub halo: Color32,
    /// The selected vertex.
    pub selected: Color32,
    /// The vertex under the pointer.
    pub hovered: Color32,
    /// A force as an arrow.
    pub arrow: Color32,
}

impl Inks {
    /// The inks on a light or a dark canvas, under a palette of magnitudes (blue to yellow) or of signed values (blue to red): what is
    /// selected has a colour that the palette does not have.
    pub fn new(visuals: &egui::Visuals, signed: bool) -> Self {
        let selected = match (visuals.dark_mode, signed) {
            (true, false) => Color32::from_rgb(255, 112, 67),
            (false, false) => Color32::from_rgb(216, 67, 21),
            (true, true) => Color32::from_rgb(72, 207, 173),
            (false, true) => Color32::from_rgb(0, 121, 107),
        };
        let noise = NOISE_HATCHING.map(|[r, g, b]| Color32::from_rgb(r, g, b));
        let grey = Color32::from_gray;
        let clear = |level: u8, alpha: u8| Color32::from_rgba_unmultiplied(level, level, level, alpha);
        if visuals.dark_mode {
            Self {
                canvas: Color32::from_rgb(20, 21, 24),
                grid: grey(48),
                axis: grey(130),
                text: grey(225),
                weak_text: grey(160),
                unmeasured: Color32::from_rgb(42, 44, 49),
                hatch: Color32::from_rgb(82, 85, 93),
                wire_flat: clear(255, 26),
                wire: clear(0, 80),
                contour: clear(0, 190),
                cliff: Color32::from_rgba_unmultiplied(120, 124, 134, 150),
                noise,
                marker: grey(12),
                halo: grey(240),
                selected,
                hovered: Color32::WHITE,
                arrow: grey(245),
            }
        } else {
            Self {
                canvas: Color32::WHITE,
                grid: grey(222),
                axis: grey(95),
                text: grey(25),
                weak_text: grey(95),
                unmeasured: Color32::from_rgb(237, 238, 240),
                hatch: Color32::from_rgb(183, 186, 192),
                wire_flat: clear(0, 24),
                wire: clear(0, 60),
                contour: clear(0, 190),
                cliff: Color32::from_rgba_unmultiplied(150, 154, 163, 150),
                noise,
                marker: grey(12),
                halo: grey(250),
                selected,
                hovered: Color32::BLACK,
                arrow: grey(15),
            }
        }
    }
}

/// A mesh that grows back to front.
pub struct Ink {
    mesh: Mesh,
    feather: f32,
    /// Texture coordinate at which the texture is white.
    white: Pos2,
}

impl Ink {
    /// An empty mesh over the palette's texture; edges are softened over one pixel.
    pub fn new(texture: TextureId, pixels_per_point: f32) -> Self {
        Self { mesh: Mesh::with_texture(texture), feather: 1.0 / pixels_per_point.max(0.1), white: PLAIN }
    }

    /// An empty mesh of plain colours alone.
    pub fn plain(pixels_per_point: f32) -> Self {
        Self { white: egui::epaint::WHITE_UV, ..Self::new(TextureId::default(), pixels_per_point) }
    }

    /// A vertex for [`Ink::shared_triangle`]; they are numbered in the order in which they come, before anything else is drawn.
    pub fn shared_vertex(&mut self, at: Pos2, colour: Color32) {
        self.vertex(at, colour);
    }

    /// A triangle between shared vertices.
    pub fn shared_triangle(&mut self, corners: [u32; 3]) {
        self.mesh.indices.extend_from_slice(&corners);
    }

    /// Makes room for so many triangles, so that the mesh grows in one piece.
    pub fn reserve(&mut self, triangles: usize) {
        self.mesh.reserve_triangles(triangles);
        self.mesh.reserve_vertices(triangles);
    }

    /// The mesh drawn.
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// A vertex in a palette colour for [`Ink::shared_triangle`]; `u` is its texture coordinate, `light` its brightness. Gives its number.
    pub fn palette_vertex(&mut self, at: Pos2, u: f32, light: Color32) -> u32 {
        self.mesh.vertices.push(Vertex { pos: at, uv: pos2(u, 0.25), color: light });
        self.mesh.vertices.len() as u32 - 1
    }

    /// A triangle in plain colours.
    pub fn triangle(&mut self, corners: [Pos2; 3], colours: [Color32; 3]) {
        let first = self.mesh.vertices.len() as u32;
        for k in 0..3 {
            self.vertex(corners[k], colours[k]);
        }
        self.mesh.indices.extend_from_slice(&[first, first + 1, first + 2]);
    }

    /// A quadrilateral in plain colours, corners in order round it.
    pub fn quad(&mut self, corners: [Pos2; 4], colours: [Color32; 4]) {
        let first = self.mesh.vertices.len() as u32;
        for k in 0..4 {
            self.vertex(corners[k], colours[k]);
        }
        self.mesh.indices.extend_from_slice(&[first, first + 1, first + 2, first, first + 2, first + 3]);
    }

    fn vertex(&mut self, pos: Pos2, color: Color32) {
        self.mesh.vertices.push(Vertex { pos, uv: self.white, color });
    }

    /// A straight line with soft edges; thinner than a pixel it becomes fainter instead.
    pub fn line(&mut self, a: Pos2, b: Pos2, width: f32, colour: Color32) {
        let along = b - a;
        let length = along.length();
        if length <= 1e-4 || !length.is_finite() {
            return;
        }
        let across = Vec2::new(-along.y, along.x) / length;
        let colour = if width < self.feather { colour.gamma_multiply(width / self.feather) } else { colour };
        let width = width.max(self.feather);
        let inner = across * ((width - self.feather) / 2.0);
        let outer = across * f32::midpoint(width, self.feather);
        let first = self.mesh.vertices.len() as u32;
        if width <= self.feather {
            // A line of one pixel has no inside: two triangles to either side of it are enough, and a wireframe is thousands of lines.
            for end in [a, b] {
                self.vertex(end + outer, Color32::TRANSPARENT);
                self.vertex(end, colour);
                self.vertex(end - outer, Color32::TRANSPARENT);
            }
            for k in 0..2 {
                let (p, q) = (first + k, first + k + 3);
                self.mesh.indices.extend_from_slice(&[p, p + 1, q, p + 1, q + 1, q]);
            }
            return;
        }
        for end in [a, b] {
            self.vertex(end + outer, Color32::TRANSPARENT);
            self.vertex(end + inner, colour);
            self.vertex(end - inner, colour);
            self.vertex(end - outer, Color32::TRANSPARENT);
        }
        for k in 0..3 {
            let (p, q) = (first + k, first + k + 4);
            self.mesh.indices.extend_from_slice(&[p, p + 1, q, p + 1, q + 1, q]);
        }
    }

    /// A filled circle.
    pub fn disc(&mut self, centre: Pos2, radius: f32, colour: Color32) {
        let sides = sides(radius);
        let first = self.mesh.vertices.len() as u32;
        let inner = (radius - self.feather / 2.0).max(0.0);
        let outer = radius + self.feather / 2.0;
        self.vertex(centre, colour);
        for k in 0..sides {
            let direction = Vec2::angled(k as f32 / sides as f32 * std::f32::consts::TAU);
            self.vertex(centre + direction * inner, colour);
            self.vertex(centre + direction * outer, Color32::TRANSPARENT);
        }
        for k in 0..sides {
            let (p, q) = (first + 1 + 2 * k, first + 1 + 2 * ((k + 1) % sides));
            self.mesh.indices.extend_from_slice(&[first, p, q, p, p + 1, q, p + 1, q + 1, q]);
        }
    }

    /// A circle's outline; `gaps` leaves out every other piece of it.
    pub fn ring(&mut self, centre: Pos2, radius: f32, width: f32, colour: Color32, gaps: bool) {
        let sides = if gaps { 12 } else { sides(radius) };
        let point = |k: u32| centre + Vec2::angled(k as f32 / sides as f32 * std::f32::consts::TAU) * radius;
        for k in (0..sides).step_by(if gaps { 2 } else { 1 }) {
            self.line(point(k), point(k + 1), width, colour);
        }
    }

    /// A square, centred.
    pub fn square(&mut self, centre: Pos2, half: f32, colour: Color32) {
        let corner = |x: f32, y: f32| centre + Vec2::new(x, y) * half;
        self.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], [colour; 4]);
    }

    /// An arrow from `a` to `b`; its head shrinks with it.
    pub fn arrow(&mut self, a: Pos2, b: Pos2, width: f32, colour: Color32) {
        let along = b - a;
        let length = along.length();
        if length < 1.5 || !length.is_finite() {
            return;
        }
        let along = along / length;
        let across = Vec2::new(-along.y, along.x);
        let head = (3.2 * width + 2.0).min(length * 0.6);
        let neck = b - along * head;
        self.line(a, neck, width, colour);
        self.triangle([b, neck + across * head * 0.45, neck - across * head * 0.45], [colour; 3]);
    }
}

fn sides(radius: f32) -> u32 {
    (8.0 + radius * 2.0).clamp(8.0, 40.0) as u32
}
