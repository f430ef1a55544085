//! The wireframe over a picture.

use std::collections::BTreeSet;

use egui::{Color32, Painter, Pos2};
use nalgebra::Point2;

use crate::face::{FaceModel, mesh};
use crate::gui::face_drawing::levels::Levels;
use crate::gui::height_map::ink::Ink;

/// How the wireframe is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WireframeStyle {
    /// Whether it is drawn at all.
    pub visible: bool,
    /// 0 to 1.
    pub opacity: f32,
    /// Which of [`COLOURS`].
    pub colour: usize,
    /// Only between vertices that are to be marked.
    pub region_only: bool,
}

impl Default for WireframeStyle {
    fn default() -> Self {
        Self { visible: true, opacity: 0.55, colour: 0, region_only: false }
    }
}

/// Colours of the mesh and of its feature lines (openings, rim, midline), by name.
pub const COLOURS: [(&str, Color32, Color32); 4] = [
    ("White", Color32::from_rgb(245, 248, 250), Color32::from_rgb(255, 196, 84)),
    ("Cyan", Color32::from_rgb(96, 214, 240), Color32::from_rgb(255, 240, 150)),
    ("Magenta", Color32::from_rgb(240, 120, 220), Color32::from_rgb(160, 240, 255)),
    ("Black", Color32::from_rgb(16, 18, 22), Color32::from_rgb(150, 40, 20)),
];

/// Edges that would be shorter on the screen are drawn from a coarser level, ui points.
const SHORTEST_EDGE: f64 = 11.0;

/// Draws the edges of the face with its vertices at `in_image`, px; `points_per_mm` is the size of a millimetre on the screen.
#[expect(clippy::too_many_arguments, reason = "what is drawn, where, and how")]
pub fn paint(
    painter: &Painter,
    face: &FaceModel,
    levels: &Levels,
    in_image: &[Point2<f64>],
    only: Option<&BTreeSet<u32>>,
    style: &WireframeStyle,
    points_per_mm: f64,
    ui_from_image: impl Fn([f64; 2]) -> Pos2,
) {
    if !style.visible || in_image.len() != face.mesh().len() {
        return;
    }
    let level = if only.is_some() { levels.finest() } else { levels.at(points_per_mm, SHORTEST_EDGE) };
    // Where edges are short on the screen their ink would cover the skin.
    let room = (level.spacing_mm * points_per_mm / 16.0).clamp(0.35, 1.0) as f32;
    let opacity = style.opacity * room;
    let (_, plain, feature) = COLOURS[style.colour.min(COLOURS.len() - 1)];
    let plain = plain.gamma_multiply(opacity);
    let feature = feature.gamma_multiply((opacity * 1.4).min(1.0));
    let seen = painter.clip_rect().expand(2.0);
    let at = |v: u32| ui_from_image([in_image[v as usize].x, in_image[v as usize].y]);
    let mut ink = Ink::plain(painter.ctx());
    let mut draw = |v: [u32; 2], [a, b]: [Pos2; 2], rim: bool| {
        if a.is_finite() && b.is_finite() && seen.intersects(egui::Rect::from_two_pos(a, b)) {
            let is_feature = rim || v.iter().all(|&v| on_midline(face, v));
            ink.line(a, b, if is_feature { 1.4 } else { 1.0 }, if is_feature { feature } else { plain });
        }
    };
    if let Some(only) = only {
        let edges = face.mesh().edges();
        for &v in only.iter().filter(|v| (**v as usize) < face.mesh().len()) {
            // Edges are in ascending order, each under its lower end.
            let from = edges.partition_point(|e| e[0] < v);
            let own = edges[from..].iter().zip(&face.mesh().triangles_of_edge()[from..]).take_while(|(e, _)| e[0] == v);
            for (e, sides) in own.filter(|(e, _)| only.contains(&e[1])) {
                draw(*e, e.map(at), sides.contains(&mesh::NONE));
            }
        }
    } else {
        let places: Vec<Pos2> = level.vertices.iter().map(|&v| at(v)).collect();
        for (e, sides) in level.edges.iter().zip(&level.triangles_of_edge) {
            let vertices = e.map(|k| level.vertices[k as usize]);
            draw(vertices, e.map(|k| places[k as usize]), sides.contains(&mesh::NONE));
        }
    }
    painter.add(egui::Shape::mesh(ink.into_mesh()));
}

fn on_midline(face: &FaceModel, vertex: u32) -> bool {
    face.mirror().get(vertex as usize).copied().flatten() == Some(vertex)
}
