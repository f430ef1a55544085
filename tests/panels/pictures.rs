//! A picture of every panel, in light and in dark.

use egui_kittest::kittest::Queryable;
use egui_kittest::{SnapshotOptions, SnapshotResults};
use frontalis::gui::modal::Modal;
use frontalis::gui::new_frames::NewFrame;
use frontalis::gui::panels::frames::{SideTab, Tool};
use frontalis::gui::panels::palette::PaletteView;
use frontalis::project::{PointId, Project, Role, Which};

use crate::stage::{Person, Window, open, project, settle};

/// Whether pictures can be drawn here. Where a driver is required and missing, the test fails.
pub(crate) fn can_draw() -> bool {
    let found = std::panic::catch_unwind(|| {
        let mut probe = egui_kittest::Harness::builder().with_size([8.0, 8.0]).wgpu().build_ui(|ui| {
            ui.label("x");
        });
        probe.render().is_ok()
    });
    let can = found.unwrap_or(false);
    let required = std::env::var_os("FRONTALIS_REQUIRE_PICTURES").is_some_and(|v| v == "1");
    assert!(
        can || !required,
        "FRONTALIS_REQUIRE_PICTURES=1, but no graphics driver was found (install mesa-vulkan-drivers)"
    );
    if !can {
        eprintln!(
            "\n*** SKIPPED: no graphics driver, so the window was not looked at. Install mesa-vulkan-drivers. ***\n"
        );
    }
    can
}

/// A panel to look at: its name, the size of the window, and what is done before looking.
type View = (&'static str, [f32; 2], bool, fn(&mut Window));

const VIEWS: &[View] = &[
    ("frames_empty", [760.0, 480.0], false, |_| {}),
    ("frames_marked", [1000.0, 640.0], true, |_| {}),
    ("frames_guide", [1000.0, 640.0], true, |w| {
        // The sign that pulses would look otherwise in every run.
        w.ctx.all_styles_mut(|style| style.animation_time = 0.0);
        for id in ["nose_tip", "chin", "mouth_corner_left"] {
            let clear = frontalis::project::Edit::Clear(PointId::Landmark(id.into()));
            w.state_mut().push(frontalis::gui::Command::Edit(clear));
        }
        w.run_steps(2);
        let view = w.state_mut().view_mut();
        view.frames.tool = Tool::Landmarks;
        view.focus.selected = Some(PointId::Landmark("nose_tip".into()));
    }),
    ("frames_loupe", [1000.0, 640.0], true, |w| {
        let v = frontalis::face::generic().region("brows")[3];
        let at = crate::stage::on_screen(
            w,
            frontalis::project::Which::Last,
            crate::stage::seen(&frontalis::face::generic(), v, true),
        );
        w.hover_at(at);
        w.step();
        w.drag_at(at);
        w.step();
        w.hover_at(at + egui::vec2(5.0, 3.0));
        w.step();
    }),
    ("doubt", [1280.0, 800.0], true, |w| {
        use frontalis::gui::Command;
        use frontalis::project::Edit;
        let face = frontalis::face::generic();
        let region = face.region("forehead_and_brows");
        for &v in &region[30..36] {
            w.state_mut().push(Command::Edit(Edit::Clear(PointId::FeatureLast(v))));
        }
        let at = crate::stage::seen(&face, region[60], true);
        let id = PointId::FeatureLast(region[60]);
        w.state_mut().push(Command::Edit(Edit::Put(id.clone(), [at[0] + 7.0, at[1] - 5.0])));
        for (k, &v) in region[..8].iter().enumerate() {
            let [x, y] = crate::stage::seen(&face, v, true);
            let off = 0.3 * (k as f64 - 3.5);
            w.state_mut().push(Command::Edit(Edit::Repeat(v, [x + off, y - 0.5 * off])));
        }
        w.state_mut().push(Command::Select(Some(id)));
        w.run_steps(3);
        w.state_mut().view_mut().frames.side = SideTab::Doubt;
    }),
    ("face", [1280.0, 800.0], true, |w| {
        let view = w.state_mut().view_mut();
        view.workspace = frontalis::gui::Workspace::Face;
        view.face.selected = Some(frontalis::face::draft::Slot::Insertion(2));
        view.face.tab = frontalis::gui::panels::face::Tab::Muscles;
    }),
    ("face_large", [2560.0, 1440.0], true, |w| {
        let view = w.state_mut().view_mut();
        view.workspace = frontalis::gui::Workspace::Face;
        view.face.names = true;
        view.face.muscles = false;
        view.face.selected = Some(frontalis::face::draft::Slot::Landmark(5));
    }),
    ("face_check", [1000.0, 640.0], true, |w| {
        let view = w.state_mut().view_mut();
        view.workspace = frontalis::gui::Workspace::Face;
        view.face.tab = frontalis::gui::panels::face::Tab::Check;
        view.face.surface = false;
    }),
    ("results", [760.0, 620.0], true, |w| w.state_mut().view_mut().frames.side = SideTab::Results),
    ("settings", [760.0, 900.0], true, |w| w.state_mut().view_mut().frames.side = SideTab::Settings),
    ("field_of_muscles", [760.0, 1480.0], true, |w| {
        let mut settings = w.state().project().settings.clone();
        let weight = frontalis::displacement::regularised::WeightRule::Discrepancy;
        let law = frontalis::muscle::LawKind::Anatomical;
        settings.field = frontalis::project::FieldWay::Muscles(frontalis::project::MuscleWay {
            weight,
            law: Some(law),
            ..Default::default()
        });
        settings.skin_model = frontalis::forces::SkinModel::Membrane;
        w.state_mut().push(frontalis::gui::Command::Edit(frontalis::project::Edit::SetSettings(settings)));
        w.state_mut().view_mut().frames.side = SideTab::Settings;
    }),
    ("history", [760.0, 480.0], true, |w| {
        w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::ClearLast));
        w.state_mut().view_mut().frames.side = SideTab::History;
    }),
    ("palette", [760.0, 520.0], true, |w| w.state_mut().view_mut().palette = Some(PaletteView::default())),
    ("keys", [760.0, 820.0], true, |w| w.state_mut().view_mut().modal = Some(Modal::Keys)),
    ("key_settings", [760.0, 620.0], true, |w| {
        w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::SetKeys));
        w.run_steps(3);
        egui_kittest::kittest::Queryable::get_by_label(w, "Add a key to Save").click_accesskit();
        w.run_steps(2);
        crate::stage::keys(w, egui::Modifiers::COMMAND, egui::Key::Z);
    }),
    ("guide_end", [1000.0, 640.0], true, |w| {
        w.ctx.all_styles_mut(|style| style.animation_time = 0.0);
        let v = frontalis::face::generic().region("brows")[3];
        w.state_mut().push(frontalis::gui::Command::Edit(frontalis::project::Edit::Clear(PointId::FeatureLast(v))));
        w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::ToolFeatures));
        w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::Next));
    }),
    ("other_frames", [760.0, 480.0], true, |w| {
        let first = w.state().project().frames.first.clone().unwrap();
        let named = frontalis::project::FrameRef { width_px: 800, height_px: 600, ..first };
        let frame = |which, path: &str| NewFrame { which, path: path.into(), named: named.clone() };
        let frames = vec![frame(Which::First, "/pictures/neutral.jpg"), frame(Which::Last, "/pictures/surprise.jpg")];
        w.state_mut().view_mut().modal = Some(Modal::OtherFrames(frames));
    }),
    ("film", [1000.0, 720.0], true, |w| {
        let film = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4");
        w.state_mut().push(frontalis::gui::Command::Dropped(vec![film.into()], None));
        settle(w);
        // Over the handle of the last frame: what is told of the frame there does not cover the handle's name.
        let strip = w.get_by_label_contains("Strip of 24 frames").rect();
        w.hover_at(egui::pos2(strip.left() + 0.7 * strip.width(), strip.bottom() - 30.0));
        w.run_steps(3);
    }),
    ("unsaved", [760.0, 480.0], true, |w| {
        w.state_mut().view_mut().modal = Some(Modal::Unsaved(frontalis::gui::command::After::New));
    }),
];

#[test]
fn every_panel_looks_as_it_did() {
    if !can_draw() {
        return;
    }
    let face = frontalis::face::generic();
    let mut results = SnapshotResults::new();
    for (name, size, marked, prepare) in VIEWS {
        for dark in [true, false] {
            let folder = tempfile::tempdir().unwrap();
            let p = if *name == "frames_empty" { Project::default() } else { project(folder.path(), &face, *marked) };
            let mut window = open(p, *size, dark, Person::default());
            prepare(&mut window);
            settle(&mut window);
            let theme = if dark { "dark" } else { "light" };
            // Lines a pixel wide fall on other pixels by a rounding of the driver's.
            let options = SnapshotOptions::new().threshold(1.2).max_failed_pixels(40);
            results.add(window.try_snapshot_options(format!("panels/{name}_{theme}"), &options));
        }
    }
}

/// Takes the marks of all skin that may move away: suggestions come instead.
fn unmark_skin(w: &mut Window) {
    let skin: Vec<_> =
        w.state().project().features.iter().filter(|(_, f)| f.role == Role::Skin).map(|(v, _)| *v).collect();
    let edits = skin.into_iter().map(|v| frontalis::project::Edit::Clear(PointId::FeatureLast(v))).collect();
    w.state_mut().push(frontalis::gui::Command::Edits(edits));
    settle(w);
}

fn look_at_forehead(w: &mut Window, zoom: f64) {
    let v = frontalis::face::generic().region("forehead")[0];
    let at = w.state().outcome().first_in_image[v as usize];
    for pane in &mut w.state_mut().view_mut().frames.panes {
        pane.view.fitted = false;
        (pane.view.zoom, pane.view.centre_in_image) = (zoom, [at.x, at.y]);
    }
    w.run_steps(2);
}

/// The pictures of the documents, made anew: `cargo test --test panels docs_images -- --ignored`.
#[test]
#[ignore = "writes docs/images; run it when the window has changed"]
fn docs_images() {
    type Scene = (&'static str, bool, fn(&mut Window));
    assert!(can_draw(), "the pictures of the documents need a graphics driver");
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images");
    std::fs::create_dir_all(&folder).unwrap();
    let scenes: [Scene; 14] = [
        ("study-dark", true, crate::study::stability_maps),
        ("study-method-dark", true, crate::study::a_method_for_the_project),
        ("study-ladder-dark", true, crate::study::a_rung_for_an_accuracy),
        ("suggestions-dark", true, |w| {
            unmark_skin(w);
            look_at_forehead(w, 2.2);
        }),
        ("snapping-dark", true, |w| {
            unmark_skin(w);
            look_at_forehead(w, 5.0);
            let v = frontalis::face::generic().region("forehead")[0];
            w.state_mut().push(frontalis::gui::Command::Select(Some(PointId::FeatureFirst(v))));
            settle(w);
            let first = w.state().outcome().first_in_image[v as usize];
            let from = crate::stage::on_screen(w, Which::First, [first.x, first.y]);
            let crossing = crate::snapping::crossing_near(v);
            let to = crate::stage::on_screen(w, Which::First, [crossing.x + 1.6, crossing.y - 1.4]);
            w.hover_at(from);
            w.step();
            w.drag_at(from);
            w.step();
            w.hover_at(from + (to - from) * 0.5);
            w.step();
            w.hover_at(to);
            w.step();
        }),
        ("face-dark", true, |w| {
            let view = w.state_mut().view_mut();
            view.workspace = frontalis::gui::Workspace::Face;
            view.face.selected = Some(frontalis::face::draft::Slot::Insertion(2));
            view.face.tab = frontalis::gui::panels::face::Tab::Muscles;
        }),
        ("muscles-dark", true, |w| {
            let face = frontalis::face::generic();
            let frontalis = (0..).zip(face.muscles()).filter(|(_, m)| m.id.starts_with("frontalis"));
            let view = w.state_mut().view_mut();
            view.workspace = frontalis::gui::Workspace::Muscles;
            view.muscles.question.compare = frontalis::fit::Compare::Along;
            view.muscles.question.muscles = Some(frontalis.map(|(i, _)| i).collect());
        }),
        ("subjects-dark", true, crate::subjects::beside_two_twins),
        ("expressions-dark", true, |w| {
            use frontalis::gui::{Action, Command};
            w.state_mut().view_mut().workspace = frontalis::gui::Workspace::Expressions;
            settle(w);
            let brow = frontalis::face::generic().muscles()[0].insertion;
            w.state_mut().push(Command::Select(Some(PointId::FeatureLast(brow))));
            w.state_mut().push(Command::Do(Action::Preset(frontalis::expression::Basic::Surprise)));
            for _ in 0..400 {
                std::thread::sleep(std::time::Duration::from_millis(1));
                w.step();
            }
            w.state_mut().push(Command::Do(Action::PlayPause));
        }),
        ("frames-dark", true, |_| {}),
        ("simulated-dark", true, |w| {
            w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::ShowReplay));
            settle(w);
            settle(w);
        }),
        ("forces-light", false, |w| w.state_mut().view_mut().workspace = frontalis::gui::Workspace::Forces),
        ("guide-light", false, |w| {
            let id = PointId::Landmark("nose_tip".into());
            w.state_mut().push(frontalis::gui::Command::Edit(frontalis::project::Edit::Clear(id.clone())));
            w.run_steps(2);
            let view = w.state_mut().view_mut();
            view.frames.tool = Tool::Landmarks;
            view.focus.selected = Some(id);
        }),
        ("loupe-dark", true, |w| {
            let v = frontalis::face::generic().region("brows")[5];
            let mark = w.state().project().features[&v].last.unwrap();
            let at = crate::stage::on_screen(w, frontalis::project::Which::Last, mark.at_px);
            w.hover_at(at);
            w.step();
            w.drag_at(at);
            w.step();
            w.hover_at(at + egui::vec2(6.0, -4.0));
            w.step();
        }),
    ];
    for (name, dark, prepare) in scenes {
        // The test's own margin of 8 points around the window is cut off.
        let size = [1296.0, 816.0];
        let mut window = open(frontalis::project::sample::project().unwrap(), size, dark, Person::default());
        window.remove_cursor();
        prepare(&mut window);
        settle(&mut window);
        let picture = image::imageops::crop_imm(&window.render().unwrap(), 8, 8, 1280, 800).to_image();
        let file = std::fs::File::create(folder.join(format!("{name}.png"))).unwrap();
        let (best, filter) = (image::codecs::png::CompressionType::Best, image::codecs::png::FilterType::Adaptive);
        let encoder = image::codecs::png::PngEncoder::new_with_quality(file, best, filter);
        image::DynamicImage::ImageRgba8(picture).into_rgb8().write_with_encoder(encoder).unwrap();
    }
}
