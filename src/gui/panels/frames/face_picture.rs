//! A small shaded picture of the generic face that shows where a point lies.

use egui::{Color32, Mesh, Pos2, Rect, Sense, Stroke, Vec2};

use crate::face::mesh::doubled_area_vector;
use crate::gui::theme::{self, on_picture};
use crate::gui::{Focus, Scene};

#[expect(clippy::too_many_arguments, reason = "what the picture shows, one by one")]
/// Shows the face from the front. `current` is the vertex to find; it pulses while a tool waits for it.
pub fn show(
    ui: &mut egui::Ui,
    size: Vec2,
    scene: Scene<'_>,
    chosen: &[u32],
    current: Option<u32>,
    pulses: bool,
    features: bool,
    focus: &mut Focus,
) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = match current {
        Some(v) => format!("Face with vertex {v} marked"),
        None => "Face".to_owned(),
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
    let p = theme::palette(ui.visuals());
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 6.0, p.card);
    let places = project(scene, rect.shrink(10.0));
    painter.add(shaded(scene, &places, ui.visuals().dark_mode));

    let dot = if ui.visuals().dark_mode { Color32::from_gray(235) } else { Color32::from_gray(40) };
    if features {
        for &v in chosen {
            let marked = scene.project.features.get(&v).is_some_and(|f| f.last.is_some());
            small_dot(&painter, places.get(v as usize).copied(), marked, dot, p.accent);
        }
    } else {
        for l in scene.face.landmarks() {
            let marked = scene.project.landmarks.contains_key(&l.id);
            small_dot(&painter, places.get(l.vertex as usize).copied(), marked, dot, p.accent);
        }
    }
    if let Some(at) = response.hover_pos()
        && let Some((v, _)) = places
            .iter()
            .enumerate()
            .map(|(v, q)| (v, q.distance(at)))
            .filter(|(_, d)| *d < 6.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
    {
        focus.hover(v as u32);
    }
    if let Some(&at) = focus.hovered().and_then(|v| places.get(v as usize)) {
        painter.circle_stroke(at, 4.0, Stroke::new(1.5, dot));
    }
    if let Some(&at) = current.and_then(|v| places.get(v as usize)) {
        // A style without animations shows it still.
        let pulses = pulses && ui.style().animation_time > 0.0;
        let phase = if pulses { (ui.input(|i| i.time) * 2.6).sin() as f32 * 0.5 + 0.5 } else { 0.3 };
        painter.circle_filled(at, 4.5, on_picture::HALO);
        painter.circle_filled(at, 3.4, on_picture::FEATURE);
        painter.circle_stroke(at, 7.0 + 4.0 * phase, Stroke::new(2.0, p.warn.gamma_multiply(1.0 - 0.6 * phase)));
        if pulses {
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(50));
        }
    }
}

fn small_dot(painter: &egui::Painter, at: Option<Pos2>, marked: bool, open: Color32, done: Color32) {
    let Some(at) = at else { return };
    if marked {
        painter.circle_filled(at, 2.4, done);
    } else {
        painter.circle_stroke(at, 1.8, Stroke::new(1.0, open.gamma_multiply(0.6)));
    }
}

/// The vertices from the front, fitted into `rect`.
fn project(scene: Scene<'_>, rect: Rect) -> Vec<Pos2> {
    let positions = scene.face.mesh().positions();
    let bounds =
        positions.iter().fold(Rect::NOTHING, |r, p| r.union(Rect::from_pos(Pos2::new(p.x as f32, -p.y as f32))));
    let scale = (rect.width() / bounds.width().max(1e-3)).min(rect.height() / bounds.height().max(1e-3));
    positions.iter().map(|p| rect.center() + (Pos2::new(p.x as f32, -p.y as f32) - bounds.center()) * scale).collect()
}

/// The triangles with a light from above the camera, smooth over the vertices.
fn shaded(scene: Scene<'_>, places: &[Pos2], dark: bool) -> Mesh {
    let mesh = scene.face.mesh();
    let light = nalgebra::Vector3::new(-0.35, 0.5, 0.8).normalize();
    let (low, high) = if dark { (62.0, 158.0) } else { (138.0, 226.0) };
    let mut picture = Mesh::default();
    for (normal, &at) in mesh.vertex_normals(mesh.positions()).iter().zip(places) {
        let bright = (normal.dot(&light).max(0.0) * (high - low) + low) as f32;
        let tone = |factor: f32| (bright * factor).clamp(0.0, 255.0) as u8;
        picture.colored_vertex(at, Color32::from_rgb(tone(1.0), tone(0.94), tone(0.90)));
    }
    let mut order: Vec<[u32; 3]> = mesh.triangles().to_vec();
    let depth = |t: &[u32; 3]| t.iter().map(|&v| mesh.positions()[v as usize].z).sum::<f64>();
    order.retain(|&t| doubled_area_vector(mesh.positions(), t).z > 0.0);
    order.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
    for [a, b, c] in order {
        picture.add_triangle(a, b, c);
    }
    picture
}
