//! What is seen through the openings of a face: eyes, and the dark of the mouth, so that an open mouth and a narrow eye can be told.

use egui::epaint::Vertex;
use egui::{Color32, Mesh, Pos2, TextureId, pos2};
use nalgebra::{Point3, Vector3};

use super::{FaceDrawing, upright_from_face};
use crate::expression::openings::{IRIS_MM, Opening, PUPIL_MM, openings};
use crate::face::FaceModel;
use crate::gui::height_map::ink::Ink;
use crate::gui::orbit_view::Projection;

const MOUTH: Color32 = Color32::from_rgb(46, 20, 22);
const WHITE: Color32 = Color32::from_rgb(232, 228, 220);
const IRIS: Color32 = Color32::from_rgb(92, 108, 112);
const PUPIL: Color32 = Color32::from_rgb(22, 22, 24);

/// The openings of one face.
#[derive(Clone, Debug, Default)]
pub struct Openings {
    all: Vec<Opening>,
}

impl Openings {
    /// Eyes and mouth of a face at `rest`.
    pub fn of(face: &FaceModel, rest: &[Point3<f64>]) -> Self {
        let mut all = openings(face, rest);
        for iris in all.iter_mut().filter_map(|o| o.iris.as_mut()) {
            *iris = upright_from_face(iris);
        }
        Self { all }
    }

    /// Draws what is seen through them, before the skin, which covers what it covers.
    pub fn draw(&self, drawing: &FaceDrawing, projection: &Projection, mut ink: Ink) -> Mesh {
        for opening in &self.all {
            let fill = if opening.iris.is_some() { WHITE } else { MOUTH };
            let (corners, middle) = seen(opening, drawing, projection);
            for (k, a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                ink.triangle([middle, *a, b], [fill; 3]);
            }
            let Some(iris) = &opening.iris else { continue };
            for (radius, colour) in [(IRIS_MM, IRIS), (PUPIL_MM, PUPIL)] {
                disc(&mut ink, projection, iris, radius, colour);
            }
        }
        ink.into_mesh()
    }

    /// The same with the eyes of a picture; the mouth is dark.
    pub fn draw_textured(
        &self,
        drawing: &FaceDrawing,
        projection: &Projection,
        texture: TextureId,
        places_in_picture: &[Pos2],
    ) -> Mesh {
        let mut mesh = Mesh::with_texture(texture);
        for opening in &self.all {
            let (corners, middle) = seen(opening, drawing, projection);
            let uv = |v: u32| places_in_picture.get(v as usize).copied().unwrap_or_default();
            let count = opening.border.len().max(1) as f32;
            let sum = opening.border.iter().fold(egui::Vec2::ZERO, |sum, v| sum + uv(*v).to_vec2());
            let color = if opening.iris.is_some() { Color32::WHITE } else { Color32::from_rgb(88, 52, 52) };
            let first = mesh.vertices.len() as u32;
            mesh.vertices.push(Vertex { pos: middle, uv: (sum / count).to_pos2(), color });
            for (pos, v) in corners.iter().zip(&opening.border) {
                mesh.vertices.push(Vertex { pos: *pos, uv: uv(*v), color });
            }
            let n = corners.len() as u32;
            for k in 0..n {
                mesh.indices.extend_from_slice(&[first, first + 1 + k, first + 1 + (k + 1) % n]);
            }
        }
        mesh
    }
}

/// Its border on the screen, and the middle of it.
fn seen(opening: &Opening, drawing: &FaceDrawing, projection: &Projection) -> (Vec<Pos2>, Pos2) {
    let corners: Vec<Pos2> = opening.border.iter().map(|&v| drawing.place(projection, v as usize).0).collect();
    let sum = corners.iter().fold(egui::Vec2::ZERO, |sum, p| sum + p.to_vec2());
    let middle = (sum / corners.len().max(1) as f32).to_pos2();
    (corners, middle)
}

/// A disc that looks forwards from the face.
fn disc(ink: &mut Ink, projection: &Projection, centre: &Point3<f64>, radius: f64, colour: Color32) {
    const SIDES: usize = 24;
    let point = |k: usize| {
        let (sin, cos) = (k as f64 / SIDES as f64 * std::f64::consts::TAU).sin_cos();
        projection.ui_from_face(&(centre + Vector3::new(radius * cos, 0.0, radius * sin)))
    };
    let middle = projection.ui_from_face(centre);
    for k in 0..SIDES {
        ink.triangle([pos2(middle.x, middle.y), point(k), point(k + 1)], [colour; 3]);
    }
}
