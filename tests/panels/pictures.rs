//! A picture of every panel, in light and in dark.

use egui_kittest::{SnapshotOptions, SnapshotResults};
use frontalis::gui::modal::Modal;
use frontalis::gui::panels::frames::{SideTab, Tool};
use frontalis::gui::panels::palette::PaletteView;
use frontalis::project::{PointId, Project};

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
    ("frames_guide", [1000.0, 640.0], false, |w| {
        let view = w.state_mut().view_mut();
        view.frames.tool = Tool::Landmarks;
        view.focus.selected = Some(PointId::Landmark("nose_tip".into()));
    }),
    ("results", [760.0, 620.0], true, |w| w.state_mut().view_mut().frames.side = SideTab::Results),
    ("settings", [760.0, 900.0], true, |w| w.state_mut().view_mut().frames.side = SideTab::Settings),
    ("history", [760.0, 480.0], true, |w| {
        w.state_mut().push(frontalis::gui::Command::Do(frontalis::gui::Action::ClearLast));
        w.state_mut().view_mut().frames.side = SideTab::History;
    }),
    ("palette", [760.0, 520.0], true, |w| w.state_mut().view_mut().palette = Some(PaletteView::default())),
    ("keys", [760.0, 820.0], true, |w| w.state_mut().view_mut().modal = Some(Modal::Keys)),
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
