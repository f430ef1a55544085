//! What the tests of the window play on: a face seen by a known camera, its two frames, and a person who answers dialogs.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use egui_kittest::Harness;
use frontalis::camera::Camera;
use frontalis::face::FaceModel;
use frontalis::frames::Frame;
use frontalis::gui::dialogs::{Answer, Dialogs, Purpose};
use frontalis::gui::{App, theme};
use frontalis::project::{Feature, FrameRef, Mark, Project, Role};
use image::{Rgb, RgbImage};
use nalgebra::{Point2, Point3};

/// Side of the frames, px.
pub(crate) const SIDE: u32 = 480;

/// The window under test.
pub(crate) type Window = Harness<'static, App>;

/// A person who answers the file dialogs with what was laid out beforehand, and remembers the questions.
#[derive(Clone, Default)]
pub(crate) struct Person {
    pub(crate) answers: Rc<RefCell<Vec<Answer>>>,
    pub(crate) asked: Rc<RefCell<Vec<Purpose>>>,
    waiting: Rc<RefCell<Option<(Purpose, Answer)>>>,
}

impl Person {
    pub(crate) fn will_choose(&self, files: &[&Path]) {
        self.answers.borrow_mut().push(Answer::Files(files.iter().map(|p| p.to_path_buf()).collect()));
    }
}

impl Dialogs for Person {
    fn ask(&mut self, _: &egui::Context, purpose: Purpose) {
        self.asked.borrow_mut().push(purpose.clone());
        let mut answers = self.answers.borrow_mut();
        let answer = if answers.is_empty() { Answer::Cancelled } else { answers.remove(0) };
        *self.waiting.borrow_mut() = Some((purpose, answer));
    }

    fn poll(&mut self) -> Option<(Purpose, Answer)> {
        self.waiting.borrow_mut().take()
    }
}

/// The camera that took the frames.
pub(crate) fn camera() -> Camera {
    let middle = f64::from(SIDE) / 2.0;
    Camera { principal_point_px: Point2::new(middle, middle), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 2.2 }
}

/// Where the camera sees a vertex of the generic face; `raised`: with the brows up.
pub(crate) fn seen(face: &FaceModel, vertex: u32, raised: bool) -> [f64; 2] {
    seen_on_the_way(face, vertex, if raised { 1.0 } else { 0.0 })
}

/// The same on the way from the first frame to the last: `raised` from 0 to 1, and beyond.
pub(crate) fn seen_on_the_way(face: &FaceModel, vertex: u32, raised: f64) -> [f64; 2] {
    let p = face.mesh().positions()[vertex as usize];
    let up = raised * 4.0 * (-((p.y - 30.0) / 22.0).powi(2)).exp();
    let q = camera().image_from_face(&Point3::new(p.x, p.y + up, p.z));
    [q.x, q.y]
}

/// A frame: the face shaded from the front, with a dark dot on every seventh vertex.
pub(crate) fn draw(face: &FaceModel, raised: bool) -> RgbImage {
    draw_on_the_way(face, if raised { 1.0 } else { 0.0 })
}

/// The same on the way.
pub(crate) fn draw_on_the_way(face: &FaceModel, raised: f64) -> RgbImage {
    let mut picture = RgbImage::from_fn(SIDE, SIDE, |_, y| Rgb([52, 58, 66 + (y / 16) as u8]));
    let normals = face.mesh().vertex_normals(face.mesh().positions());
    for t in face.mesh().triangles() {
        let corners = t.map(|v| seen_on_the_way(face, v, raised));
        let light = t.iter().map(|&v| normals[v as usize].z.max(0.0)).sum::<f64>() / 3.0;
        fill(&mut picture, corners, light);
    }
    for v in (0..face.mesh().len() as u32).step_by(7) {
        let [x, y] = seen_on_the_way(face, v, raised);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (px, py) = (x as u32 + dx, y as u32 + dy);
            if px < SIDE && py < SIDE {
                picture.put_pixel(px, py, Rgb([70, 44, 38]));
            }
        }
    }
    picture
}

fn fill(picture: &mut RgbImage, corners: [[f64; 2]; 3], light: f64) {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let range = |i: usize| {
        let low = corners.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min).max(0.0);
        let high = corners.iter().map(|p| p[i]).fold(0.0, f64::max).min(f64::from(SIDE) - 1.0);
        low as u32..=high as u32
    };
    for y in range(1) {
        for x in range(0) {
            let p = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let side =
                |u: [f64; 2], v: [f64; 2]| ((v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])) / area;
            if side(a, b) >= -1e-6 && side(b, c) >= -1e-6 && side(c, a) >= -1e-6 {
                let tone = |full: f64| (full * (0.35 + 0.65 * light)) as u8;
                picture.put_pixel(x, y, Rgb([tone(226.0), tone(182.0), tone(158.0)]));
            }
        }
    }
}

/// Writes both frames into a folder.
pub(crate) fn write_frames(folder: &Path, face: &FaceModel) -> [PathBuf; 2] {
    let paths = [folder.join("neutral.png"), folder.join("raised.png")];
    draw(face, false).save(&paths[0]).unwrap();
    draw(face, true).save(&paths[1]).unwrap();
    paths
}

/// The reference of a frame on disk.
pub(crate) fn frame_ref(path: &Path) -> FrameRef {
    let frame = Frame::read(path).unwrap();
    FrameRef {
        path: path.to_str().unwrap().to_owned(),
        sha256: frame.sha256().to_owned(),
        width_px: frame.width(),
        height_px: frame.height(),
    }
}

/// A project with both frames and, where asked, all landmarks, still points and forehead marks at the true places.
pub(crate) fn project(folder: &Path, face: &FaceModel, marked: bool) -> Project {
    let [first, last] = write_frames(folder, face);
    let mut project = Project { name: "Brow raise".into(), ..Project::default() };
    project.frames.first = Some(frame_ref(&first));
    project.frames.last = Some(frame_ref(&last));
    if marked {
        for l in face.landmarks() {
            project.landmarks.insert(l.id.clone(), Mark::new(seen(face, l.vertex, false)));
        }
        for &v in face.region("still") {
            let last = Some(Mark::new(seen(face, v, false)));
            project.features.insert(v, Feature { first: None, last, role: Role::Still });
        }
        for &v in face.region("forehead_and_brows") {
            let last = Some(Mark::new(seen(face, v, true)));
            project.features.insert(v, Feature { first: None, last, role: Role::Skin });
        }
    }
    project
}

/// Opens a window of that size on a project; pictures are there.
pub(crate) fn open(project: Project, size: [f32; 2], dark: bool, person: Person) -> Window {
    show(App::new(project, None, frontalis::face::generic(), Box::new(person)), size, dark)
}

/// Shows a window of that size.
pub(crate) fn show(app: App, size: [f32; 2], dark: bool) -> Window {
    let mut window = Harness::builder()
        .with_size(size)
        .with_max_steps(12)
        .with_theme(if dark { egui::Theme::Dark } else { egui::Theme::Light })
        .with_context_setup(theme::install)
        .build_ui_state(|ui, app: &mut App| app.frame(ui), app);
    settle(&mut window);
    window
}

/// Lets frames pass until what was read in the background is shown.
pub(crate) fn settle(window: &mut Window) {
    for _ in 0..3 {
        window.run_steps(2);
        window.state_mut().wait_for_jobs();
    }
    window.run_steps(2);
}

/// Where a pixel of a frame is on the screen.
pub(crate) fn on_screen(window: &Window, which: frontalis::project::Which, px: [f64; 2]) -> egui::Pos2 {
    let pane = &window.state().view().frames.panes[which as usize];
    pane.view.at(pane.rect).ui_from_image(px)
}

/// Presses at one place, moves to others, releases at the last.
pub(crate) fn drag(window: &mut Window, path: &[egui::Pos2]) {
    window.hover_at(path[0]);
    window.step();
    window.drag_at(path[0]);
    window.step();
    for &at in &path[1..] {
        window.hover_at(at);
        window.step();
    }
    window.drop_at(path[path.len() - 1]);
    window.run_steps(2);
}

/// Takes what lies there and moves it, without letting go.
pub(crate) fn hold(window: &mut Window, at: egui::Pos2, by: egui::Vec2) {
    window.hover_at(at);
    window.step();
    window.drag_at(at);
    window.step();
    window.hover_at(at + by);
    window.step();
}

/// Presses a key and lets it go.
pub(crate) fn key(window: &mut Window, key: egui::Key) {
    keys(window, egui::Modifiers::NONE, key);
}

/// The same with other keys held.
pub(crate) fn keys(window: &mut Window, modifiers: egui::Modifiers, key: egui::Key) {
    window.key_press_modifiers(modifiers, key);
    window.run_steps(3);
}
