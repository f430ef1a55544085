//! Lines, dots and triangles of the height map in one egui mesh, in the order in which they are drawn, with soft edges.

use egui::epaint::Vertex;
use egui::{Color32, ColorImage, Mesh, Pos2, TextureHandle, TextureId, TextureOptions, Vec2, pos2};

use crate::draw::colour_map::NOISE_HATCHING;

/// Texels along the palette: enough that a logarithm shows no steps.
pub const TEXELS: usize = 1024;
/// Rows of the texture: two of the palette, two of white, and the softness across lines, a row for each width.
const ROWS: usize = 16;
const FIRST_WHITE: usize = 2;
const FIRST_LINE: usize = 4;
/// Texture coordinates of the palette and of plain colour, half-way between two equal rows.
const PALETTE_V: f32 = 1.0 / ROWS as f32;
const PLAIN: Pos2 = pos2(0.5, (FIRST_WHITE + 1) as f32 / ROWS as f32);
/// From one row of lines to the next, half the width with its soft edge grows by so many soft edges; the first row is one.
const WIDTH_STEP: f32 = 0.25;

/// The texture for drawing in the colours of `palette` ([`TEXELS`] of them), in plain ones, and lines with soft edges.
///
/// A line is one quadrilateral with its softness in the texture: the edges that a mesh of triangles needs for it would be four or six
/// triangles for each line, and a wireframe is thousands of lines.
pub fn texture(ctx: &egui::Context, name: &str, palette: &[Color32]) -> TextureHandle {
    ctx.load_texture(name, texels(palette), TextureOptions::LINEAR)
}

/// The pixels of a [`texture`].
pub fn texels(palette: &[Color32]) -> ColorImage {
    let mut pixels = [palette, palette].concat();
    pixels.resize(FIRST_LINE * TEXELS, Color32::WHITE);
    for row in 0..ROWS - FIRST_LINE {
        pixels.extend((0..TEXELS).map(|k| {
            let from_edge = 1.0 - (2.0 * (k as f32 + 0.5) / TEXELS as f32 - 1.0).abs();
            let cover = (from_edge * (1.0 + row as f32 * WIDTH_STEP)).min(1.0);
            let level = (255.0 * cover).round() as u8;
            Color32::from_rgba_premultiplied(level, level, level, level)
        }));
    }
    ColorImage::new([TEXELS, ROWS], pixels)
}

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
}

impl Ink {
    /// An empty mesh over a [`texture`]; edges are softened over one pixel.
    pub fn new(texture: TextureId, pixels_per_point: f32) -> Self {
        Self { mesh: Mesh::with_texture(texture), feather: 1.0 / pixels_per_point.max(0.1) }
    }

    /// An empty mesh of plain colours alone.
    pub fn plain(ctx: &egui::Context) -> Self {
        let id = egui::Id::unique("plain ink");
        let known = ctx.data(|d| d.get_temp::<TextureHandle>(id));
        let texture = known.unwrap_or_else(|| {
            let texture = texture(ctx, "plain ink", &[Color32::WHITE; TEXELS]);
            ctx.data_mut(|d| d.insert_temp(id, texture.clone()));
            texture
        });
        Self::new(texture.id(), ctx.pixels_per_point())
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
        self.mesh.vertices.push(Vertex { pos: at, uv: pos2(u, PALETTE_V), color: light });
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
        self.mesh.vertices.push(Vertex { pos, uv: PLAIN, color });
    }

    /// A straight line with soft edges; thinner than a pixel it becomes fainter instead.
    pub fn line(&mut self, a: Pos2, b: Pos2, width: f32, colour: Color32) {
        let along = b - a;
        let length = along.length();
        if length <= 1e-4 || !length.is_finite() {
            return;
        }
        let colour = if width < self.feather { colour.gamma_multiply(width / self.feather) } else { colour };
        let half = f32::midpoint(width.max(self.feather), self.feather);
        let outer = Vec2::new(-along.y, along.x) * (half / length);
        let row = (half / self.feather - 1.0) / WIDTH_STEP;
        let last = ROWS - FIRST_LINE - 1;
        // A line wider than the widest row is a little softer than it should be.
        let v = (FIRST_LINE as f32 + row.min(last as f32) + 0.5) / ROWS as f32;
        let first = self.mesh.vertices.len() as u32;
        for (end, u, side) in [(a, 0.0, outer), (a, 1.0, -outer), (b, 1.0, -outer), (b, 0.0, outer)] {
            self.mesh.vertices.push(Vertex { pos: end + side, uv: pos2(u, v), color: colour });
        }
        self.mesh.indices.extend_from_slice(&[first, first + 1, first + 2, first, first + 2, first + 3]);
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
