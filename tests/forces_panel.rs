//! The workspace of the forces: what it draws, what it answers to pointer and keys, and how it looks.

#![allow(clippy::unwrap_used, reason = "a test whose stage cannot be set has failed")]

use std::sync::Arc;

use egui::{Key, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::camera::{Camera, HeadMotion};
use frontalis::displacement::VertexState;
use frontalis::face::{FaceModel, Landmark, Mesh, Muscle, Side};
use frontalis::gui::height_map::{
    ColourRange, Direction, ErrorDisplay, Exaggeration, Layer, Quantity, RangeMode, Relief, range,
};
use frontalis::gui::orbit_view::{OrbitView, StandardView};
use frontalis::gui::panels::forces::{self, ForcesView, Tab, vertex_name};
use frontalis::gui::suggesting::Suggested;
use frontalis::gui::{Command, Focus, Scene, Stamp, theme};
use frontalis::pipeline::{ForceField, LandmarkFit, Outcome, Warning, Workspace, solve};
use frontalis::project::{Feature, Mark, PointId, Project, Role};
use nalgebra::{Point2, Point3, Vector3};

/// A face-like shell: a grid of `columns` × `rows` inside an ellipse 150 × 210 mm, domed like an ellipsoid.
fn face(columns: usize, rows: usize) -> FaceModel {
    let inside = |x: f64, y: f64| (x / 75.0).powi(2) + (y / 105.0).powi(2) <= 1.0;
    let place = |c: usize, r: usize| {
        let x = -75.0 + 150.0 * c as f64 / (columns - 1) as f64;
        let y = -105.0 + 210.0 * r as f64 / (rows - 1) as f64;
        (x, y)
    };
    let mut number = vec![None; columns * rows];
    let mut positions = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            let (x, y) = place(c, r);
            if inside(x, y) {
                number[r * columns + c] = Some(positions.len() as u32);
                let dome = (1.0 - (x / 80.0).powi(2) - (y / 112.0).powi(2)).max(0.0).sqrt();
                positions.push(Point3::new(x, y - 15.0, 60.0 * dome - 45.0));
            }
        }
    }
    let mut triangles = Vec::new();
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let at = |dr: usize, dc: usize| number[(r + dr) * columns + c + dc];
            let (a, b, d, e) = (at(0, 0), at(0, 1), at(1, 1), at(1, 0));
            // Diagonals alternate, so that the mesh has no grain.
            let halves = if (r + c) % 2 == 0 { [[a, b, d], [a, d, e]] } else { [[a, b, e], [b, d, e]] };
            for t in halves {
                if let [Some(a), Some(b), Some(d)] = t {
                    triangles.push([a, b, d]);
                }
            }
        }
    }
    let near = |x: f64, y: f64| {
        let distance = |p: &Point3<f64>| (p.x - x).powi(2) + (p.y - y).powi(2);
        (0..positions.len()).min_by(|a, b| distance(&positions[*a]).total_cmp(&distance(&positions[*b]))).unwrap()
            as u32
    };
    let muscle = |side, sign: f64| Muscle {
        id: format!("frontalis_medial_{}", if side == Side::Left { "left" } else { "right" }),
        latin: "Musculus frontalis, pars medialis".to_owned(),
        action_unit: 1,
        side,
        attachment: near(22.0 * sign, 72.0),
        insertion: near(20.0 * sign, 28.0),
        half_width_mm: 14.0,
        zone_half_angle_deg: None,
    };
    let parts = frontalis::face::FaceParts {
        name: "Test shell".to_owned(),
        landmarks: vec![Landmark {
            id: "glabella".to_owned(),
            name: "Glabella".to_owned(),
            hint: "Between the brows.".to_owned(),
            vertex: near(0.0, 30.0),
            ..Landmark::default()
        }],
        muscles: vec![muscle(Side::Left, 1.0), muscle(Side::Right, -1.0)],
        mirror: vec![None; positions.len()],
        ..frontalis::face::FaceParts::default()
    };
    FaceModel::new(Mesh::new(positions, triangles).unwrap(), parts).unwrap()
}

/// Two patches of upward force over the brows, a weaker downward one at the hairline; the lower face is not measured.
fn outcome(face: &FaceModel) -> Outcome {
    let first = face.mesh().positions().to_vec();
    let n = first.len();
    let bump = |p: &Point3<f64>, x: f64, y: f64, width: f64| {
        (-((p.x - x).powi(2) + (p.y - y).powi(2)) / (2.0 * width * width)).exp()
    };
    let state = |v: usize| {
        let p = first[v];
        match () {
            () if p.y > 78.0 => VertexState::Fixed,
            () if p.y < 12.0 || p.x.abs() > 62.0 => VertexState::Unmeasured,
            () if v % 7 == 3 => VertexState::Inferred,
            () => VertexState::Measured,
        }
    };
    let states: Vec<_> = (0..n).map(state).collect();
    let border: Vec<bool> = (0..n)
        .map(|v| {
            states[v] == VertexState::Measured
                && face.mesh().neighbours(v).iter().any(|&w| states[w as usize] == VertexState::Unmeasured)
        })
        .collect();
    let normals = face.mesh().vertex_normals(&first);
    let force: Vec<Vector3<f64>> = (0..n)
        .map(|v| {
            let p = &first[v];
            let up = 0.36 * bump(p, -24.0, 38.0, 11.0) + 0.29 * bump(p, 26.0, 40.0, 10.0);
            let down = 0.10 * bump(p, 0.0, 72.0, 22.0);
            let sideways = 0.05 * (p.x / 40.0) * bump(p, 0.0, 40.0, 30.0);
            // A ripple as marking noise leaves it: reproducible, from the vertex number alone.
            let noise = |k: f64| 0.012 * (v as f64 * 12.9898 + k).sin();
            let f = Vector3::new(sideways + noise(0.0), up - down + noise(1.0), noise(2.0));
            if states[v].is_known() { f } else { Vector3::zeros() }
        })
        .collect();
    let last = (0..n).map(|v| first[v] + force[v] * 20.0).collect();
    let field = ForceField {
        sigma: (0..n).map(|v| if states[v].is_known() { 0.018 + 0.006 * (v as f64).cos() } else { 0.0 }).collect(),
        normal: (0..n).map(|v| force[v].dot(&normals[v])).collect(),
        tangential: (0..n).map(|v| (force[v] - normals[v] * force[v].dot(&normals[v])).norm()).collect(),
        depth_change: force.iter().map(|f| 0.2 * f.norm()).collect(),
        internal_sum: Vector3::new(1e-17, -2e-17, 0.0),
        outside_table: vec![false; n],
        strain: face
            .mesh()
            .edges()
            .iter()
            .map(|&[a, b]| {
                let known = states[a as usize].is_known() && states[b as usize].is_known();
                known.then(|| (force[a as usize] - force[b as usize]).norm())
            })
            .collect(),
        folded: Vec::new(),
        force,
    };
    Outcome {
        camera: Camera {
            principal_point_px: Point2::new(518.0, 518.0),
            z_prp_mm: 1000.0,
            z_vp_mm: 0.0,
            px_per_mm: 4.0,
        },
        scale_measured: true,
        fit: LandmarkFit::default(),
        first_in_image: vec![Point2::origin(); n],
        head: HeadMotion::default(),
        last,
        last_in_image: vec![Point2::origin(); n],
        first,
        states,
        border,
        field,
        muscles: None,
        smoothing: None,
        warnings: vec![Warning::HeadMotionNotRemoved { found: 0, needed: 3 }],
    }
}

/// A brow raise on the generic face, marked exactly as the camera sees it, through the whole chain. Still points as the face names them.
fn from_the_chain() -> State {
    let face = frontalis::face::generic();
    let camera =
        Camera { principal_point_px: Point2::new(518.0, 518.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 };
    let seen = |v: u32, raised: bool| {
        let p = face.mesh().positions()[v as usize];
        let up = if raised { 4.0 * (-((p.y - 30.0) / 20.0).powi(2)).exp() } else { 0.0 };
        let q = camera.image_from_face(&Point3::new(p.x, p.y + up, p.z));
        [q.x, q.y]
    };
    let mut project = Project { name: "Brow raise".to_owned(), ..Project::default() };
    project.settings.marking_sigma_px = 0.2;
    for l in face.landmarks() {
        project.landmarks.insert(l.id.clone(), Mark::new(seen(l.vertex, false)));
    }
    for &v in face.region("still") {
        project.features.insert(v, Feature { first: None, last: Some(Mark::new(seen(v, false))), role: Role::Still });
    }
    for &v in face.region("forehead_and_brows") {
        project.features.insert(v, Feature { first: None, last: Some(Mark::new(seen(v, true))), role: Role::Skin });
    }
    let outcome = solve(&project, &face, [1036, 1036], &mut Workspace::default());
    State {
        project,
        outcome,
        face,
        view: ForcesView::default(),
        focus: Focus::default(),
        commands: Vec::new(),
        suggested: Suggested::default(),
    }
}

struct State {
    project: Project,
    face: Arc<FaceModel>,
    outcome: Outcome,
    view: ForcesView,
    focus: Focus,
    commands: Vec<Command>,
    suggested: Suggested,
}

impl State {
    fn new(columns: usize, rows: usize) -> Self {
        let face = Arc::new(face(columns, rows));
        Self {
            project: Project::default(),
            outcome: outcome(&face),
            face,
            view: ForcesView::default(),
            focus: Focus::default(),
            commands: Vec::new(),
            suggested: Suggested::default(),
        }
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            project: &self.project,
            outcome: &self.outcome,
            face: &self.face,
            suggested: &self.suggested,
            skin: None,
            fitting: false,
            replay: None,
            stamp: self.stamp(),
        }
    }

    /// Tests change the outcome in place: another field, another stamp.
    fn stamp(&self) -> Stamp {
        let sum: f64 = self.outcome.field.force.iter().map(|f| f.x + 3.0 * f.y + 7.0 * f.z).sum();
        Stamp { face: self.face.mesh().len() as u64, outcome: sum.to_bits() }
    }

    fn layer(&self) -> Layer {
        let o = &self.view.options;
        Layer::new(&self.outcome, &self.face, o.quantity, o.direction, o.muscle)
    }

    fn peak(&self) -> usize {
        self.outcome.field.largest(&self.outcome.states).unwrap().0
    }
}

fn panel(ui: &mut egui::Ui, state: &mut State) {
    let stamp = state.stamp();
    let State { project, face, outcome, view, focus, commands, suggested } = state;
    let scene = Scene { project, outcome, face, suggested, skin: None, fitting: false, replay: None, stamp };
    forces::show(ui, scene, view, focus, commands);
    // As the application does.
    for command in commands.iter() {
        if let Command::Select(point) = command {
            focus.selected = point.clone();
        }
    }
}

fn harness(state: State, size: [f32; 2]) -> Harness<'static, State> {
    // Sixty frames a second, so that two clicks can be a double click.
    Harness::builder().with_size(size).with_step_dt(1.0 / 60.0).with_max_steps(60).build_ui_state(panel, state)
}

// ---------- what it looks like ----------

/// Whether this machine can draw. Without a graphics driver pictures are skipped, loudly, unless the environment forbids that.
fn can_draw(test: &str) -> bool {
    let adapter = std::panic::catch_unwind(|| {
        let mut small = Harness::builder().with_size([16.0, 16.0]).wgpu().build_ui(|ui| _ = ui.label("x"));
        small.render().is_ok()
    });
    if adapter.unwrap_or(false) {
        return true;
    }
    assert!(
        std::env::var_os("FRONTALIS_REQUIRE_PICTURES").is_none(),
        "{test}: pictures are required here, but no graphics adapter was found"
    );
    eprintln!("SKIPPED {test}: no graphics adapter was found, so nothing was drawn. Install mesa-vulkan-drivers.");
    false
}

/// Set to a folder, the pictures are written there and compared with nothing; `FRONTALIS_PICTURE_SCALE` makes them larger.
const PICTURES_TO: &str = "FRONTALIS_PICTURES_TO";

fn picture(name: &str, theme: egui::Theme, state: State) {
    let scale: f32 = std::env::var("FRONTALIS_PICTURE_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    if !can_draw(name) {
        return;
    }
    let mut harness = Harness::builder()
        .with_size(if scale > 1.0 { [1280.0, 760.0] } else { [1000.0, 640.0] })
        .with_theme(theme)
        .with_pixels_per_point(scale)
        .with_context_setup(theme::install)
        .wgpu()
        .build_ui_state(panel, state);
    harness.run();
    if let Some(folder) = std::env::var_os(PICTURES_TO) {
        let image = harness.render().unwrap();
        image.save(std::path::Path::new(&folder).join(format!("{name}.png"))).unwrap();
        return;
    }
    // Software and hardware drivers round the edges of triangles differently; a moved label changes thousands of pixels.
    harness.snapshot_options(
        format!("forces/{name}"),
        &egui_kittest::SnapshotOptions::new().threshold(1.2).max_failed_pixels(600),
    );
}

fn with(change: impl FnOnce(&mut State)) -> State {
    let mut state = State::new(25, 33);
    change(&mut state);
    state
}

#[test]
fn picture_of_the_height_map_in_the_light() {
    picture("map_light", egui::Theme::Light, with(|_| {}));
}

/// With more triangles than that the map comes as a picture.
#[test]
fn picture_of_a_large_height_map() {
    picture("large_light", egui::Theme::Light, State::new(118, 160));
}

#[test]
fn picture_of_a_large_height_map_from_the_side() {
    let mut state = State::new(118, 160);
    state.view.options.arrows = true;
    state.view.options.below_noise = true;
    state.view.look(StandardView::Side);
    picture("large_dark", egui::Theme::Dark, state);
}

#[test]
fn picture_of_the_height_map_in_the_dark() {
    picture("map_dark", egui::Theme::Dark, with(|_| {}));
}

#[test]
fn picture_of_a_signed_component_with_everything_switched_on() {
    let all = |s: &mut State| {
        s.view.options.quantity = Quantity::Along;
        s.view.options.direction = Direction::Fibre;
        s.view.options.errors = ErrorDisplay::Bars;
        s.view.options.below_noise = true;
        s.view.options.noise_floor = true;
        s.view.options.fibre = true;
        s.view.profile_along_fibre = true;
        s.focus.selected = Some(PointId::FeatureLast(s.peak() as u32));
    };
    picture("signed_light", egui::Theme::Light, with(all));
}

#[test]
fn picture_of_the_table_and_of_arrows_on_the_face() {
    let arrows = |s: &mut State| {
        s.view.options.relief = Relief::FaceColoured;
        s.view.options.fit_known = false;
        s.view.options.arrows = true;
        s.view.options.range = RangeMode::Locked(ColourRange::new(0.0, 0.2));
        s.view.look(StandardView::Front);
        s.view.tab = Tab::Table;
    };
    picture("arrows_dark", egui::Theme::Dark, with(arrows));
}

#[test]
fn picture_from_the_side_with_shells() {
    let side = |s: &mut State| {
        s.view.options.errors = ErrorDisplay::Shells;
        s.view.look(StandardView::Below);
    };
    picture("below_light", egui::Theme::Light, with(side));
}

#[test]
fn the_outcome_of_the_chain_is_shown_whole() {
    let state = from_the_chain();
    let measured = state.outcome.states.iter().filter(|s| **s == VertexState::Measured).count();
    assert!(measured >= 40, "a brow raise has at least 40 marks on the forehead: {measured}");
    assert!(state.outcome.field.largest(&state.outcome.states).is_some());
    let unit = state.outcome.unit();
    assert_eq!(unit, "relative", "no scale was set");
    let mut harness = harness(state, [1280.0, 760.0]);
    harness.run();
    assert!(harness.query_all_by_label_contains(", measured").count() >= 40);
    assert!(
        harness
            .query_by_label_contains("Sum of internal forces")
            .unwrap()
            .accesskit_node()
            .value()
            .is_none_or(|t| t.contains("holds"))
    );
    assert!(
        harness.query_all_by_label_contains("relative, measured").count() >= 40,
        "the unit stands with every force"
    );
}

/// The chain's numbers change with its settings, so this picture is only for looking at.
#[test]
fn picture_of_the_chain() {
    if std::env::var_os(PICTURES_TO).is_some() {
        picture("chain_light", egui::Theme::Light, from_the_chain());
        let front = |mut s: State| {
            s.view.look(StandardView::Front);
            s.view.options.relief = Relief::Face;
            s.view.options.fit_known = false;
            s
        };
        picture("chain_face", egui::Theme::Light, front(from_the_chain()));
        let turned = |mut s: State| {
            s.view.options.relief = Relief::Face;
            s.view.options.quantity = Quantity::Displacement;
            s.view.options.fit_known = false;
            s.view.orbit = OrbitView { azimuth: -0.5, elevation: 1.1, target: None, points_per_mm: None };
            s
        };
        picture("chain_turned", egui::Theme::Dark, turned(from_the_chain()));
    }
}

/// Not a test of right and wrong: prints how long a frame takes at growing sizes. `cargo test --test forces_panel -- --ignored --nocapture`
#[test]
#[ignore = "prints times"]
fn times_of_a_frame() {
    for (columns, rows) in [(25, 33), (60, 84), (101, 130), (118, 160)] {
        let state = State::new(columns, rows);
        let (vertices, triangles) = (state.face.mesh().len(), state.face.mesh().triangles().len());
        let mut harness = harness(state, [1280.0, 760.0]);
        harness.run();
        let mut times: Vec<f64> = (0..15)
            .map(|k| {
                harness.state_mut().view.orbit.orbit_by(Vec2::new(1.0, 0.0));
                harness.hover_at(Pos2::new(400.0 + k as f32, 300.0));
                let start = std::time::Instant::now();
                harness.step();
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!(
            "{vertices} vertices, {triangles} triangles: median frame {:.1} ms without the graphics card",
            times[7]
        );
    }
}

/// Size of the picture on the canvas, and the largest list of triangles that a frame shows.
fn work_of_a_frame(harness: &mut Harness<'_, State>) -> (Option<Vec2>, usize) {
    let canvas = canvas_of(harness);
    harness.step();
    let output = harness.output();
    // A picture is two triangles; the largest on the canvas is the map.
    let on_canvas = |s: &egui::epaint::ClippedShape| match &s.shape {
        egui::Shape::Mesh(mesh) if mesh.indices.len() == 6 && canvas.expand(1.0).contains_rect(mesh.calc_bounds()) => {
            Some(mesh.calc_bounds().size()).filter(|size| size.x > 100.0 && size.y > 50.0)
        }
        _ => None,
    };
    let triangles = output.shapes.iter().map(|s| match &s.shape {
        egui::Shape::Mesh(mesh) => mesh.indices.len() / 3,
        _ => 0,
    });
    (output.shapes.iter().find_map(on_canvas), triangles.max().unwrap_or(0))
}

#[test]
fn a_large_map_is_painted_once_and_not_again_while_only_the_pointer_moves() {
    let mut small = harness(State::new(25, 33), [1280.0, 760.0]);
    small.run();
    let (picture, triangles) = work_of_a_frame(&mut small);
    assert!(picture.is_none() && triangles > 500, "a small map goes to the graphics card: {triangles} triangles");

    let mut harness = harness(State::new(118, 160), [1280.0, 760.0]);
    harness.run();
    let canvas = canvas_of(&harness);
    let before = harness.state().view.paintings();
    assert!(before > 0);
    for k in 0..20 {
        harness.hover_at(canvas.center() + Vec2::new(3.0 * k as f32, k as f32));
        let (picture, triangles) = work_of_a_frame(&mut harness);
        let size = picture.expect("the map is a picture");
        assert_eq!(harness.state().view.paintings(), before, "only the pointer has moved");
        assert!(triangles < 5000, "the map itself costs two triangles, not {triangles}");
        assert!(size.x * size.y < 0.9 * canvas.area(), "of the map, not of the whole canvas");
    }
    harness.state_mut().view.orbit.orbit_by(Vec2::new(20.0, 5.0));
    let (_, triangles) = work_of_a_frame(&mut harness);
    assert!(harness.state().view.paintings() > before && triangles < 5000, "turned it is painted anew");
}

// ---------- what it answers ----------

fn canvas_of(harness: &Harness<'_, State>) -> egui::Rect {
    harness.get_by_label_contains("Height map").rect()
}

fn place_of(harness: &Harness<'_, State>, vertex: usize) -> Pos2 {
    let name = vertex_name(harness.state().scene(), &harness.state().layer(), vertex);
    harness.get_by_label(&name).rect().center()
}

#[test]
fn a_click_on_a_drawn_vertex_selects_that_vertex() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    let peak = harness.state().peak();
    let measured: Vec<usize> = (0..harness.state().outcome.states.len())
        .filter(|&v| harness.state().outcome.states[v] == VertexState::Measured)
        .collect();
    // The peak, and every ninth of the vertices that nothing hides from straight above.
    harness.state_mut().view.look(StandardView::Front);
    harness.run();
    for v in measured.iter().copied().step_by(9).chain([peak]) {
        let at = place_of(&harness, v);
        harness.hover_at(at);
        harness.drag_at(at);
        harness.drop_at(at);
        harness.run();
        assert_eq!(harness.state().focus.selected, Some(PointId::FeatureLast(v as u32)), "vertex {v} at {at}");
    }
}

#[test]
fn the_name_of_a_vertex_carries_force_error_unit_and_state() {
    let mut state = State::new(25, 33);
    let v = state.peak();
    state.outcome.states[v] = VertexState::Measured;
    state.outcome.field.force[v] = Vector3::new(0.0, 0.14, 0.0);
    state.outcome.field.sigma[v] = 0.02;
    assert_eq!(vertex_name(state.scene(), &state.layer(), v), format!("vertex {v}, 0.140 ± 0.020 N, measured"));
    state.outcome.scale_measured = false;
    assert_eq!(vertex_name(state.scene(), &state.layer(), v), format!("vertex {v}, 0.140 ± 0.020 relative, measured"));
    state.outcome.states[v] = VertexState::Unmeasured;
    assert_eq!(vertex_name(state.scene(), &state.layer(), v), format!("vertex {v}, unmeasured"));
}

#[test]
fn the_peak_is_sought_away_from_the_border_and_the_border_is_named_beside_it() {
    let mut state = State::new(25, 33);
    let inner = state.peak();
    let border = state.outcome.border.iter().position(|b| *b).unwrap();
    state.outcome.field.force[border] = Vector3::new(0.0, 5.0, 0.0);
    assert_eq!(state.peak(), border, "the largest force of all");
    assert_eq!(state.outcome.peak().vertex(), Some(inner));
    let range = range::range_of(RangeMode::Auto, &state.layer(), &|_| true);
    assert!((range.high - 0.4).abs() < 1e-9, "the border's 5 N do not set the range");
    let mut harness = harness(state, [1280.0, 760.0]);
    harness.run();
    assert!(harness.query_by_label_contains(&format!("vertex {inner} at x")).is_some());
    harness.get_by_label_contains(&format!("on the border, vertex {border}")).click();
    harness.run();
    assert_eq!(harness.state().focus.selected, Some(PointId::FeatureLast(border as u32)));
}

#[test]
fn a_signed_component_has_the_sign_of_the_pull() {
    let mut state = State::new(25, 33);
    let v = state.peak();
    state.view.options.quantity = Quantity::Along;
    let up = state.layer().values[v].unwrap();
    assert!((up - state.outcome.field.force[v].y).abs() < 1e-12, "upwards is +y");
    state.outcome.field.force[v] = -state.outcome.field.force[v];
    assert!((state.layer().values[v].unwrap() + up).abs() < 1e-12);
    // Along a fibre: a force of 2 N from the insertion to the attachment is +2 N.
    state.view.options.direction = Direction::Fibre;
    state.view.options.muscle = Some(0);
    let muscle = &state.face.muscles()[0];
    let first = &state.outcome.first;
    let pull = (first[muscle.attachment as usize] - first[muscle.insertion as usize]).normalize() * 2.0;
    state.outcome.field.force[v] = pull;
    assert!((state.layer().values[v].unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn dragging_turns_and_the_wheel_zooms_and_a_double_click_resets() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    let start = harness.state().view.orbit;
    let middle = canvas_of(&harness).center();
    harness.hover_at(middle);
    harness.step();
    harness.drag_at(middle);
    harness.step();
    harness.hover_at(middle + Vec2::new(40.0, 20.0));
    harness.step();
    harness.drop_at(middle + Vec2::new(40.0, 20.0));
    harness.run();
    let turned = harness.state().view.orbit;
    // 40 points of 450 a half turn: −16°; 20 points: +8°.
    assert!((turned.azimuth - start.azimuth + 16_f64.to_radians()).abs() < 1e-6, "{turned:?}");
    assert!((turned.elevation - start.elevation - 8_f64.to_radians()).abs() < 1e-6, "{turned:?}");

    let before = turned.points_per_mm.unwrap();
    harness.hover_at(middle);
    harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: Vec2::new(0.0, 120.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run();
    assert!(harness.state().view.orbit.points_per_mm.unwrap() > before * 1.2);

    for _ in 0..2 {
        for pressed in [true, false] {
            let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
            harness.event(egui::Event::PointerButton { pos: middle, button, pressed, modifiers });
            harness.step();
        }
    }
    harness.run();
    assert_eq!(harness.state().view.orbit, OrbitView::default());
}

#[test]
fn shift_drag_and_middle_drag_pan() {
    for (button, modifiers) in
        [(egui::PointerButton::Middle, egui::Modifiers::NONE), (egui::PointerButton::Primary, egui::Modifiers::SHIFT)]
    {
        let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
        harness.run();
        let angles = |h: &Harness<'_, State>| (h.state().view.orbit.azimuth, h.state().view.orbit.elevation);
        let before = angles(&harness);
        let v = harness.state().peak();
        let v = if harness.state().outcome.states[v] == VertexState::Measured { v } else { v + 1 };
        let at = place_of(&harness, v);
        let middle = canvas_of(&harness).center();
        let press = |pos, pressed| egui::Event::PointerButton { pos, button, pressed, modifiers };
        harness.event(egui::Event::ModifiersChanged(modifiers));
        harness.hover_at(middle);
        harness.step();
        harness.event(press(middle, true));
        harness.step();
        harness.hover_at(middle + Vec2::new(-33.0, 12.0));
        harness.step();
        harness.event(press(middle + Vec2::new(-33.0, 12.0), false));
        harness.event(egui::Event::ModifiersChanged(egui::Modifiers::NONE));
        harness.run();
        assert_eq!(angles(&harness), before, "{button:?} does not turn");
        let moved = place_of(&harness, v) - at;
        assert!((moved - Vec2::new(-33.0, 12.0)).length() < 1.0, "{button:?} {moved}");
    }
}

#[test]
fn view_buttons_look_where_they_say() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    for view in StandardView::ALL {
        harness.get_by_label(view.label()).click();
        harness.run();
        assert!(harness.state().view.orbit.is_standard(view), "{view:?}");
    }
}

#[test]
fn a_locked_range_stays_when_the_field_grows_tenfold_and_clipping_is_told() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    harness.get_by_label("Locked").click();
    harness.run();
    let locked = harness.state().view.options.range;
    assert!(matches!(locked, RangeMode::Locked(_)));
    for f in &mut harness.state_mut().outcome.field.force {
        *f *= 10.0;
    }
    harness.run();
    assert_eq!(harness.state().view.options.range, locked);
    assert!(harness.query_by_label("Upper end of the range").is_some());
    harness.get_by_label("Auto").click();
    harness.run();
    assert_eq!(harness.state().view.options.range, RangeMode::Auto);
}

#[test]
fn another_quantity_gets_its_own_range() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    harness.state_mut().view.toggle_lock();
    assert!(harness.state().view.range_is_locked());
    harness.get_by_label("Quantity").click();
    harness.run();
    harness.get_by_label("Displacement").click();
    harness.run();
    assert_eq!(harness.state().view.options.quantity, Quantity::Displacement);
    assert!(!harness.state().view.range_is_locked(), "0.4 N are no range for millimetres");
}

#[test]
fn the_exaggeration_can_be_fixed_and_follows_the_range_again() {
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    harness.get_by_label("Auto height").click();
    harness.run();
    // The peak is 0.36 N and a little noise: the bar ends at 0.4 N, and 40 mm / 0.4 N = 100 mm/N.
    assert_eq!(harness.state().view.options.exaggeration, Exaggeration::Fixed(100.0));
    harness.get_by_label("Auto height").click();
    harness.run();
    assert_eq!(harness.state().view.options.exaggeration, Exaggeration::Auto);
}

#[test]
fn keys_turn_the_map_only_while_it_has_the_focus() {
    use frontalis::gui::action::{Action, Direction as Way, Step};
    let mut harness = harness(State::new(25, 33), [1280.0, 760.0]);
    harness.run();
    let nudge = Action::Nudge(Way::Left, Step::Medium);
    assert!(!harness.state_mut().view.act(nudge), "without the focus the key nudges a mark");
    harness.get_by_label_contains("Height map").focus();
    harness.run();
    let before = harness.state().view.orbit.azimuth;
    assert!(harness.state_mut().view.act(nudge));
    // One press is 5°.
    assert!((harness.state().view.orbit.azimuth - before - 5_f64.to_radians()).abs() < 1e-9);
    assert!(harness.state_mut().view.act(Action::ZoomIn));
    harness.key_press(Key::ArrowLeft);
    harness.run();
    assert!(
        harness.get_by_label_contains("Height map").accesskit_node().is_focused(),
        "arrows do not carry the focus away"
    );
}

#[test]
fn the_table_sorts_and_selects() {
    let mut harness = harness(with(|s| s.view.tab = Tab::Table), [1280.0, 760.0]);
    harness.run();
    let first_row = |h: &Harness<'_, State>| {
        h.query_all_by_label_contains("row of vertex")
            .min_by(|a, b| a.rect().top().total_cmp(&b.rect().top()))
            .unwrap()
            .accesskit_node()
            .label()
            .unwrap()
    };
    let expected = {
        let s = harness.state();
        let known = (0..s.outcome.states.len()).filter(|&v| s.outcome.states[v].is_known());
        known.max_by(|a, b| s.outcome.field.force[*a].norm().total_cmp(&s.outcome.field.force[*b].norm())).unwrap()
    };
    assert!(first_row(&harness).starts_with(&format!("row of vertex {expected},")), "largest force first");
    harness.get_by_label("±, N").click();
    harness.run();
    let most_uncertain = {
        let s = harness.state();
        let known = (0..s.outcome.states.len()).filter(|&v| s.outcome.states[v].is_known());
        known.max_by(|a, b| s.outcome.field.sigma[*a].total_cmp(&s.outcome.field.sigma[*b])).unwrap()
    };
    let top = first_row(&harness);
    assert!(top.starts_with(&format!("row of vertex {most_uncertain},")), "{top}");
    harness.get_by_label(&top).click();
    harness.run();
    assert_eq!(harness.state().focus.selected, Some(PointId::FeatureLast(most_uncertain as u32)));
}

#[test]
fn what_was_not_measured_has_no_value_no_node_and_no_row() {
    let state = State::new(25, 33);
    for quantity in Quantity::ALL {
        let layer = Layer::new(&state.outcome, &state.face, quantity, Direction::Up, None);
        for (v, s) in state.outcome.states.iter().enumerate() {
            let told = layer.values[v].is_some();
            // Along the fibres there is a value only where a muscle runs.
            let may_lack = quantity == Quantity::AlongFibre && !told;
            assert!(told == s.is_known() || may_lack, "{quantity:?} at vertex {v}");
        }
    }
    let mut harness = harness(state, [1280.0, 760.0]);
    harness.run();
    assert!(harness.query_all_by_label_contains(", unmeasured").next().is_none());
    assert!(harness.query_all_by_label_contains(", measured").count() > 100);
}

#[test]
fn an_empty_project_is_drawn_without_a_number() {
    let mut state = State::new(25, 33);
    let n = state.outcome.states.len();
    state.outcome.states = vec![VertexState::Unmeasured; n];
    state.outcome.border = vec![false; n];
    state.outcome.field = ForceField::default();
    for tab in [Tab::Profiles, Tab::Table] {
        state.view.tab = tab;
    }
    let mut harness = harness(state, [900.0, 600.0]);
    harness.run();
    assert!(harness.query_all_by_label_contains("No vertex is measured").next().is_some());
}
