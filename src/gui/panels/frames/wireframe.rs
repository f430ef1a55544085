//! The wireframe over a picture.

use std::collections::BTreeSet;

use egui::{Color32, Painter, Pos2, Stroke};
use nalgebra::Point2;

use crate::face::{FaceModel, mesh};

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

/// Draws the edges of the face with its vertices at `in_image`, px.
pub fn paint(
    painter: &Painter,
    face: &FaceModel,
    in_image: &[Point2<f64>],
    only: Option<&BTreeSet<u32>>,
    style: &WireframeStyle,
    ui_from_image: impl Fn([f64; 2]) -> Pos2,
) {
    if !style.visible || in_image.len() != face.mesh().len() {
        return;
    }
    let places: Vec<Pos2> = in_image.iter().map(|p| ui_from_image([p.x, p.y])).collect();
    // Where edges are short on the screen their ink would cover the skin.
    let room = (mean_length(face, &places) / 16.0).clamp(0.35, 1.0);
    let opacity = style.opacity * room;
    let (_, plain, feature) = COLOURS[style.colour.min(COLOURS.len() - 1)];
    let plain = Stroke::new(1.0, plain.gamma_multiply(opacity));
    let feature = Stroke::new(1.4, feature.gamma_multiply((opacity * 1.4).min(1.0)));
    let seen = painter.clip_rect().expand(2.0);
    for (edge, triangles) in face.mesh().edges().iter().zip(face.mesh().triangles_of_edge()) {
        if only.is_some_and(|set| edge.iter().any(|v| !set.contains(v))) {
            continue;
        }
        let [a, b] = edge.map(|v| places[v as usize]);
        let drawn = a.is_finite() && b.is_finite() && seen.intersects(egui::Rect::from_two_pos(a, b));
        if !drawn {
            continue;
        }
        let is_feature = triangles.contains(&mesh::NONE) || edge.iter().all(|&v| on_midline(face, v));
        painter.line_segment([a, b], if is_feature { feature } else { plain });
    }
}

/// Mean length of the edges on the screen, from a few of them.
fn mean_length(face: &FaceModel, places: &[Pos2]) -> f32 {
    let some = face.mesh().edges().iter().step_by(face.mesh().edges().len() / 64 + 1);
    let lengths: Vec<f32> = some.map(|e| places[e[0] as usize].distance(places[e[1] as usize])).collect();
    lengths.iter().sum::<f32>() / lengths.len().max(1) as f32
}

fn on_midline(face: &FaceModel, vertex: u32) -> bool {
    face.mirror().get(vertex as usize).copied().flatten() == Some(vertex)
}
