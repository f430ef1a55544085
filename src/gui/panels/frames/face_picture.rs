//! A small shaded picture of the generic face that shows where a point lies.

use egui::{Color32, Pos2, Sense, Stroke, Vec2};

use crate::gui::face_drawing::{FaceDrawing, Look};
use crate::gui::height_map::ink::Ink;
use crate::gui::orbit_view::OrbitView;
use crate::gui::theme::{self, on_picture};
use crate::gui::{Focus, Scene};

/// So long the point to find pulses once it is asked for, s: three times. After that nothing moves, and a window that is left alone
/// draws nothing.
const PULSES_S: f64 = 3.0 * std::f64::consts::TAU / PULSE_RATE;

/// How fast it pulses, radians a second.
const PULSE_RATE: f64 = 2.6;

/// How far out the ring rests; a pulse begins and ends there.
const AT_REST: f32 = 0.3;

#[expect(clippy::too_many_arguments, reason = "what the picture shows, one by one")]
/// Shows the face from the front. `current` is the vertex to find; it pulses a few times when a tool begins to ask for it.
pub fn show(
    ui: &mut egui::Ui,
    size: Vec2,
    scene: Scene<'_>,
    drawing: &FaceDrawing,
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
    let front = OrbitView { azimuth: 0.0, elevation: 0.0, target: None, points_per_mm: None };
    let projection = front.project_into(rect.shrink(10.0), drawing.corners().into_iter());
    let tones = if ui.visuals().dark_mode { [62.0, 158.0] } else { [138.0, 226.0] };
    let look = Look { shaded: true, wire: None, rim: Color32::TRANSPARENT, tones };
    painter.add(egui::Shape::mesh(drawing.draw(&projection, &look, Ink::plain(ui.ctx()))));
    let vertices = scene.face.mesh().len();
    let place = |v: u32| ((v as usize) < vertices).then(|| drawing.place(&projection, v as usize).0);

    let dot = if ui.visuals().dark_mode { Color32::from_gray(235) } else { Color32::from_gray(40) };
    if features {
        for &v in chosen {
            let marked = scene.project.features.get(&v).is_some_and(|f| f.last.is_some());
            small_dot(&painter, place(v), marked, dot, p.accent);
        }
    } else {
        for l in scene.face.landmarks() {
            let marked = scene.project.landmarks.contains_key(&l.id);
            small_dot(&painter, place(l.vertex), marked, dot, p.accent);
        }
    }
    if let Some(at) = response.hover_pos()
        && let Some((v, _)) = drawing
            .project(&projection)
            .iter()
            .enumerate()
            .map(|(v, (q, _))| (v, q.distance(at)))
            .filter(|(_, d)| *d < 6.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
    {
        focus.hover(v as u32);
    }
    if let Some(at) = focus.hovered().and_then(place) {
        painter.circle_stroke(at, 4.0, Stroke::new(1.5, dot));
    }
    if let Some(at) = current.and_then(place) {
        let phase = if pulses { pulse(ui, current) } else { AT_REST };
        painter.circle_filled(at, 4.5, on_picture::HALO);
        painter.circle_filled(at, 3.4, on_picture::FEATURE);
        painter.circle_stroke(at, 7.0 + 4.0 * phase, Stroke::new(2.0, p.warn.gamma_multiply(1.0 - 0.6 * phase)));
    }
}

/// How far out the ring about the point to find is now, 0 to 1; asks for the next picture of it while it moves.
fn pulse(ui: &egui::Ui, current: Option<u32>) -> f32 {
    let now = ui.input(|i| i.time);
    let id = egui::Id::unique("pulse of the point to find");
    let begun = ui.data_mut(|d| {
        let (asked, begun) = d.get_temp_mut_or(id, (current, now));
        if *asked != current {
            (*asked, *begun) = (current, now);
        }
        *begun
    });
    // A style without animations shows it still.
    if now - begun >= PULSES_S || ui.style().animation_time <= 0.0 {
        return AT_REST;
    }
    ui.ctx().request_repaint_after(std::time::Duration::from_millis(50));
    let out = 0.5 - 0.5 * ((now - begun) * PULSE_RATE).cos() as f32;
    AT_REST + (1.0 - AT_REST) * out
}

fn small_dot(painter: &egui::Painter, at: Option<Pos2>, marked: bool, open: Color32, done: Color32) {
    let Some(at) = at else { return };
    if marked {
        painter.circle_filled(at, 2.4, done);
    } else {
        painter.circle_stroke(at, 1.8, Stroke::new(1.0, open.gamma_multiply(0.6)));
    }
}
