//! A face drawn as a shaded surface, a wireframe, or both: what the workspace of the face and the guide's small picture share.

pub mod levels;
pub mod openings;
pub mod picking;

use egui::epaint::Vertex;
use egui::{Color32, Mesh, Pos2, TextureId};
use nalgebra::{Matrix3, Point3, Vector3};

use super::height_map::ink::Ink;
use super::orbit_view::Projection;
use crate::face;
use crate::face::mesh::NONE;
use levels::{Level, Levels};

/// A mesh made ready for drawing: made once, drawn many times.
#[derive(Clone, Debug)]
pub struct FaceDrawing {
    levels: Levels,
    /// Vertices and their normals in the space that the view turns.
    places: Vec<Point3<f32>>,
    normals: Vec<Vector3<f32>>,
    bounds: [Point3<f64>; 2],
}

/// How it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Whether the surface is drawn.
    pub shaded: bool,
    /// Colour of the edges, if they are drawn.
    pub wire: Option<Color32>,
    /// Colour of the rim and the openings, beside `wire`.
    pub rim: Color32,
    /// Brightness of the surface in shadow and in light, 0 to 255.
    pub tones: [f32; 2],
}

/// Edges of a wireframe that are shorter on the screen are drawn from a coarser level, points.
const SHORTEST_EDGE: f64 = 10.0;
/// The same for the triangles of a surface.
const SHORTEST_SIDE: f64 = 5.0;
/// From the upper left, in view space.
const LIGHT: [f32; 3] = [-0.35, 0.5, 0.8];

/// From face space to the space that an `OrbitView` turns, in which the third axis points up: (x, −z, y).
///
/// A face then stands upright on the turntable, and the view from elevation 0, azimuth 0 sees it from the front.
pub fn upright_from_face(x: &Point3<f64>) -> Point3<f64> {
    Point3::new(x.x, -x.z, x.y)
}

impl FaceDrawing {
    /// Makes a mesh ready.
    pub fn new(mesh: &face::Mesh) -> Self {
        let places: Vec<Point3<f64>> = mesh.positions().iter().map(upright_from_face).collect();
        let low = places.iter().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p.coords));
        let high = places.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p.coords));
        let mut drawing = Self {
            levels: Levels::new(mesh),
            places: Vec::new(),
            normals: Vec::new(),
            bounds: [low.into(), high.into()],
        };
        drawing.move_to(mesh, mesh.positions());
        drawing
    }

    /// Puts the vertices elsewhere, in face space. What a view must fit stays as it was, so that a moving face does not shake it.
    pub fn move_to(&mut self, mesh: &face::Mesh, positions: &[Point3<f64>]) {
        self.places = positions.iter().map(|p| upright_from_face(p).cast()).collect();
        let normals = mesh.vertex_normals(positions);
        self.normals = normals.iter().map(|n| upright_from_face(&Point3::from(*n)).coords.cast()).collect();
    }

    /// Gives a view so much more room below, mm: for a jaw that opens.
    #[must_use]
    pub fn with_room_below(mut self, mm: f64) -> Self {
        self.bounds[0].z -= mm;
        self
    }

    /// Its levels of detail.
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    /// The corners of the box that holds it: what a view must fit.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let [low, high] = self.bounds;
        std::array::from_fn(|k| {
            let pick = |bit: usize, a: f64, b: f64| if k >> bit & 1 == 0 { a } else { b };
            Point3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
        })
    }

    /// Where a vertex is drawn, and its depth towards the eye, mm.
    pub fn place(&self, projection: &Projection, vertex: usize) -> (Pos2, f64) {
        let p = self.places[vertex].cast();
        (projection.ui_from_face(&p), projection.towards_eye_in_face().dot(&p.coords))
    }

    /// Whether the surface at a vertex faces the eye.
    pub fn faces_eye(&self, projection: &Projection, vertex: usize) -> bool {
        projection.towards_eye_in_face().dot(&self.normals[vertex].cast()) > 0.0
    }

    /// Every vertex on the screen, with its depth towards the eye, mm.
    pub fn project(&self, projection: &Projection) -> Vec<(Pos2, f32)> {
        let lens = Lens::new(projection);
        self.places.iter().map(|p| lens.see(p)).collect()
    }

    /// The mesh to draw, in `ink`: triangles and edges that face the eye, from back to front.
    pub fn draw(&self, projection: &Projection, look: &Look, ink: Ink) -> Mesh {
        self.draw_in_colours(projection, look, None, ink)
    }

    /// The same with a colour a vertex, which the light makes darker, in place of the tones.
    pub fn draw_in_colours(
        &self,
        projection: &Projection,
        look: &Look,
        colours: Option<&[Color32]>,
        mut ink: Ink,
    ) -> Mesh {
        let least = if look.wire.is_some() { SHORTEST_EDGE } else { SHORTEST_SIDE };
        let level = self.levels.at(projection.points_per_mm, least);
        let lens = Lens::new(projection);
        let seen: Vec<(Pos2, f32)> = level.vertices.iter().map(|&v| lens.see(&self.places[v as usize])).collect();
        let front: Vec<bool> = level.triangles.iter().map(|t| faces_eye(t.map(|v| seen[v as usize].0))).collect();
        if look.shaded {
            let light = Vector3::from(LIGHT).normalize();
            for (&v, (at, _)) in level.vertices.iter().zip(&seen) {
                let lit = (lens.turn * self.normals[v as usize]).dot(&light);
                let colour = match colours.and_then(|c| c.get(v as usize)) {
                    Some(colour) => shade(*colour, lit),
                    None => tone(lit, look.tones),
                };
                ink.shared_vertex(*at, colour);
            }
        }
        for item in order(level, &seen, &front, look) {
            let item = item as usize;
            if let Some(t) = level.triangles.get(item) {
                ink.shared_triangle(*t);
                continue;
            }
            let e = item - level.triangles.len();
            let [a, b] = level.edges[e].map(|v| seen[v as usize].0);
            let rim = level.triangles_of_edge[e][1] == NONE;
            if let Some(wire) = look.wire {
                ink.line(a, b, if rim { 1.3 } else { 0.8 }, if rim { look.rim } else { wire });
            }
        }
        ink.into_mesh()
    }
}

impl FaceDrawing {
    /// The surface with a picture on it: `places_in_picture` are texture coordinates, one a vertex. The picture brings its own light.
    pub fn draw_textured(&self, projection: &Projection, texture: TextureId, places_in_picture: &[Pos2]) -> Mesh {
        let level = self.levels.at(projection.points_per_mm, SHORTEST_SIDE);
        let lens = Lens::new(projection);
        let seen: Vec<(Pos2, f32)> = level.vertices.iter().map(|&v| lens.see(&self.places[v as usize])).collect();
        let front: Vec<bool> = level.triangles.iter().map(|t| faces_eye(t.map(|v| seen[v as usize].0))).collect();
        let mut mesh = Mesh::with_texture(texture);
        mesh.vertices.extend(level.vertices.iter().zip(&seen).map(|(&v, (pos, _))| Vertex {
            pos: *pos,
            uv: places_in_picture.get(v as usize).copied().unwrap_or_default(),
            color: Color32::WHITE,
        }));
        let look = Look { shaded: true, wire: None, rim: Color32::TRANSPARENT, tones: [0.0; 2] };
        for t in order(level, &seen, &front, &look) {
            mesh.indices.extend_from_slice(&level.triangles[t as usize]);
        }
        mesh
    }
}

/// The projection in single precision, which is enough for a screen.
struct Lens {
    turn: Matrix3<f32>,
    target: Vector3<f32>,
    points_per_mm: f32,
    centre: Pos2,
}

impl Lens {
    fn new(projection: &Projection) -> Self {
        Self {
            turn: projection.view_from_face.cast(),
            target: projection.target_in_view.cast(),
            points_per_mm: projection.points_per_mm as f32,
            centre: projection.centre,
        }
    }

    fn see(&self, p: &Point3<f32>) -> (Pos2, f32) {
        let q = self.turn * p.coords;
        let off = (q - self.target) * self.points_per_mm;
        (Pos2::new(self.centre.x + off.x, self.centre.y - off.y), q.z)
    }
}

/// Counter-clockwise seen from outside is, with y down, clockwise in numbers: the doubled area is then negative.
fn faces_eye([a, b, c]: [Pos2; 3]) -> bool {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) < 0.0
}

fn tone(lit: f32, [dark, bright]: [f32; 2]) -> Color32 {
    let level = dark + lit.max(0.0) * (bright - dark);
    let part = |share: f32| (level * share).clamp(0.0, 255.0) as u8;
    Color32::from_rgb(part(1.0), part(0.94), part(0.90))
}

/// A colour under the light: never so dark that it cannot be told from others.
fn shade(colour: Color32, lit: f32) -> Color32 {
    let level = 0.58 + 0.42 * lit.max(0.0);
    let part = |c: u8| (f32::from(c) * level) as u8;
    Color32::from_rgb(part(colour.r()), part(colour.g()), part(colour.b()))
}

/// Depths are told apart in so many steps; what lies in one step is drawn in any order.
const STEPS: usize = 1 << 14;

/// What faces the eye, farthest first: triangles by their number, edges after them by theirs.
///
/// Sorted by counting, in time linear in the number of items: a hundred thousand are sorted anew in every frame of a turn.
fn order(level: &Level, seen: &[(Pos2, f32)], front: &[bool], look: &Look) -> Vec<u32> {
    let depth = |t: u32| level.triangles[t as usize].iter().map(|&v| seen[v as usize].1).sum::<f32>() / 3.0;
    let mut items: Vec<(u32, f32)> = Vec::with_capacity(level.triangles.len() + level.edges.len());
    if look.shaded {
        items.extend((0..level.triangles.len() as u32).filter(|t| front[*t as usize]).map(|t| (t, depth(t))));
    }
    if look.wire.is_some() {
        let first = level.triangles.len() as u32;
        for (e, sides) in (first..).zip(&level.triangles_of_edge) {
            let near = sides.iter().filter(|t| **t != NONE && front[**t as usize]).map(|t| depth(*t));
            if let Some(nearest) = near.reduce(f32::max) {
                items.push((e, nearest));
            }
        }
    }
    let (low, high) = items.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), i| (l.min(i.1), h.max(i.1)));
    let scale = (STEPS - 1) as f32 / (high - low).max(1e-6);
    let step = |depth: f32| ((depth - low) * scale) as usize;
    let mut starts = vec![0_u32; STEPS + 1];
    for (_, depth) in &items {
        starts[step(*depth) + 1] += 1;
    }
    for k in 0..STEPS {
        starts[k + 1] += starts[k];
    }
    // Of one step, triangles come before the edges on them, for they were put in first.
    let mut sorted = vec![0; items.len()];
    for (item, depth) in items {
        let place = &mut starts[step(depth)];
        sorted[*place as usize] = item;
        *place += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::orbit_view::OrbitView;
    use egui::{Rect, TextureId, pos2};

    const LOOK: Look = Look { shaded: true, wire: None, rim: Color32::RED, tones: [60.0, 220.0] };

    fn front(drawing: &FaceDrawing) -> Projection {
        let view = OrbitView { azimuth: 0.0, elevation: 0.0, target: None, points_per_mm: None };
        view.project_into(Rect::from_min_max(pos2(0.0, 0.0), pos2(400.0, 600.0)), drawing.corners().into_iter())
    }

    #[test]
    fn from_the_front_the_nose_is_nearest_and_left_is_right() {
        let face = face::generic();
        let drawing = FaceDrawing::new(face.mesh());
        let projection = front(&drawing);
        let seen = |id: &str| drawing.place(&projection, face.landmark(id).unwrap().vertex as usize);
        let (nose, chin, left, right) =
            (seen("nose_tip"), seen("chin"), seen("eye_outer_left"), seen("eye_outer_right"));
        assert!(nose.0.y < chin.0.y, "up is up");
        assert!(left.0.x > right.0.x, "the person's left is right on the screen");
        assert!(face.landmarks().iter().all(|l| drawing.place(&projection, l.vertex as usize).1 <= nose.1 + 1e-3));
    }

    #[test]
    fn only_what_faces_the_eye_is_drawn_and_the_nearest_last() {
        let face = face::generic();
        let drawing = FaceDrawing::new(face.mesh());
        let projection = front(&drawing);
        let mesh = drawing.draw(&projection, &LOOK, Ink::new(TextureId::default(), 1.0));
        assert_eq!(mesh.vertices.len(), face.mesh().len(), "corners are shared");
        let drawn = mesh.indices.len() / 3;
        assert!(drawn > 1000 && drawn <= face.mesh().triangles().len(), "{drawn}");
        let nose = face.landmark("nose_tip").unwrap().vertex;
        let last: Vec<u32> = mesh.indices[mesh.indices.len() - 60..].to_vec();
        assert!(last.contains(&nose), "the nose is in front of everything");
        let wire = Look { shaded: false, wire: Some(Color32::WHITE), ..LOOK };
        let lines = drawing.draw(&projection, &wire, Ink::new(TextureId::default(), 1.0));
        assert!(lines.vertices.len() >= 4 * 1000 && lines.vertices.len() <= 4 * face.mesh().edges().len());
    }
}
