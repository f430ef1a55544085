//! How long a frame of the window takes on the generic face and on one of 145 thousand vertices: printed, not judged.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use egui::{Pos2, Vec2};
use frontalis::face::{FaceModel, Mesh};
use frontalis::gui::{App, Workspace};

use crate::stage::{Person, Window, settle, show};

/// The generic face with every triangle cut in four, so many times; its vertices keep their numbers.
pub(crate) fn finer(face: &FaceModel, times: usize) -> FaceModel {
    let (mut positions, mut triangles) = (face.mesh().positions().to_vec(), face.mesh().triangles().to_vec());
    for _ in 0..times {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut next = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |p: u32, q: u32| {
                *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    positions.push(nalgebra::center(&positions[p as usize], &positions[q as usize]));
                    positions.len() as u32 - 1
                })
            };
            let (x, y, z) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
        }
        triangles = next;
    }
    let mut parts = face.to_parts();
    parts.mirror.resize(positions.len(), None);
    FaceModel::new(Mesh::new(positions, triangles).unwrap(), parts).unwrap()
}

/// Time that this thread has had a processor, ms; where the system does not tell, the time on the clock.
fn busy_ms(since: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let ns = told.and_then(|t| t.split_whitespace().next().and_then(|n| n.parse::<f64>().ok()));
    ns.map_or_else(|| since.elapsed().as_secs_f64() * 1e3, |ns| ns / 1e6)
}

/// Mean processor time of the frame itself and of cutting it into triangles, ms, while the pointer does `act`.
fn times(window: &mut Window, act: &mut dyn FnMut(&mut Window, f32)) -> [f64; 2] {
    const FRAMES: u16 = 20;
    let start = Instant::now();
    let mut shapes = Vec::new();
    let begun = busy_ms(start);
    for k in 0..FRAMES {
        act(window, f32::from(k));
        window.step();
        shapes.push(window.output().shapes.clone());
    }
    let drawn = busy_ms(start);
    for shapes in shapes {
        assert!(!window.ctx.tessellate(shapes, 1.0).is_empty());
    }
    [drawn - begun, busy_ms(start) - drawn].map(|ms| ms / f64::from(FRAMES))
}

/// Run it alone: `cargo test --test panels times_of_a_frame -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn times_of_a_frame() {
    for cuts in [0, 4] {
        let face = Arc::new(finer(&frontalis::face::generic(), cuts));
        let vertices = face.mesh().len();
        let project = frontalis::project::sample::project().unwrap();
        let mut app = App::new(project, None, face, Box::new(Person::default()));
        app.view_mut().frames.table_shown = false;
        let mut window = show(app, [1280.0, 800.0], true);
        let middle = Pos2::new(330.0, 400.0);
        let hover = &mut |w: &mut Window, k: f32| w.hover_at(middle + Vec2::new(3.0 * k, k));
        let turn = &mut |w: &mut Window, k: f32| {
            w.hover_at(Pos2::new(900.0, 780.0));
            let view = w.state_mut().view_mut();
            view.forces.orbit.orbit_by(Vec2::new(1.0 + k, 0.0));
            view.face.orbit.orbit_by(Vec2::new(1.0 + k, 0.0));
        };
        let zoom = &mut |w: &mut Window, k: f32| {
            w.hover_at(Pos2::new(900.0, 780.0));
            let at = Pos2::new(300.0 + k, 300.0);
            w.state_mut().view_mut().frames.zoom(frontalis::project::Which::First, 1.02, at);
        };
        let say = |what: &str, [frame, cut]: [f64; 2]| {
            println!("{vertices:>7} vertices, {what:<18} frame {frame:6.1} ms, into triangles {cut:5.1} ms");
        };
        say("Frames, hover", times(&mut window, hover));
        say("Frames, zoom", times(&mut window, zoom));
        window.state_mut().view_mut().workspace = Workspace::Forces;
        settle(&mut window);
        say("Forces, turn", times(&mut window, turn));
        say("Forces, hover", times(&mut window, hover));
        window.state_mut().view_mut().workspace = Workspace::Face;
        settle(&mut window);
        say("Face, turn", times(&mut window, turn));
        say("Face, hover", times(&mut window, hover));
    }
}
