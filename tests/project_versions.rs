//! Project files of every version that was ever released load for ever, and the documented ones open as they stand on the page.

use std::path::{Path, PathBuf};

use frontalis::camera::Scale;
use frontalis::displacement::{DepthRule, UnmarkedRule};
use frontalis::project::{FaceSource, Mark, MarkState, Role, file};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn fixture(name: &str) -> PathBuf {
    root().join("tests/fixtures").join(name)
}

#[test]
fn version_1_loads() {
    let p = file::load(&fixture("project_v1.json")).unwrap();
    assert_eq!(p.name, "Brow raise, „session“ 3");
    let first = p.frames.first.as_ref().unwrap();
    assert_eq!((first.path.as_str(), first.width_px, first.height_px), ("frames/neutral.png", 1036, 1024));
    assert_eq!(p.frames.last.as_ref().unwrap().path, "../apex.png");
    assert_eq!(p.face, FaceSource::File { path: "faces/own.json".into(), sha256: "ab".repeat(32) });
    assert_eq!((p.camera.distance_mm, p.camera.view_plane_z_mm), (1250.5, -3.25));
    assert_eq!(p.camera.principal_point_px, Some([518.0, 500.25]));
    let grid = Scale::GridPitch { a_px: [400.0, 300.0], b_px: [560.0, 300.5], cells: 4.0, pitch_mm: 10.0 };
    assert_eq!(p.scale, grid);
    assert_eq!(p.landmarks["nose_tip"], Mark::new([518.25, 640.5]));
    assert_eq!(p.landmarks["nasion"].state, MarkState::Locked);
    let last = p.features[&17].last.unwrap();
    assert_eq!((last.at_px, last.state, last.sigma_px), ([0.1 + 0.2, 288.25], MarkState::Uncertain, Some(0.5)));
    assert_eq!(p.features[&17].first.unwrap().state, MarkState::Occluded);
    assert_eq!((p.features[&40].role, p.features[&41].role), (Role::Still, Role::Fixed));
    assert_eq!(p.settings.customize.nearest, Some(5));
    assert_eq!(p.settings.depth, DepthRule::SlideOnSurface);
    assert_eq!(p.settings.unmarked, UnmarkedRule::Inferred { reach_mm: 12.5 });
    assert_eq!((p.settings.skin_thickness_mm, p.settings.marking_sigma_px), (1.75, 0.25));
    assert!(!p.settings.remove_head_motion);
    assert_eq!(p.notes, "two\nlines");
}

#[test]
fn version_1_is_written_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let copy = dir.path().join("copy.frontalis.json");
    let kept = fixture("project_v1.json");
    file::save(&file::load(&kept).unwrap(), &copy).unwrap();
    assert_eq!(std::fs::read_to_string(copy).unwrap(), std::fs::read_to_string(kept).unwrap());
}

#[test]
fn every_project_on_the_page_of_the_format_opens() {
    let page = std::fs::read_to_string(root().join("docs/project-format.md")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let mut opened = 0;
    for block in page.split("```json\n").skip(1) {
        let text = block.split("```").next().unwrap();
        let path = dir.path().join("page.frontalis.json");
        std::fs::write(&path, text).unwrap();
        file::load(&path).unwrap();
        opened += 1;
    }
    assert_eq!(opened, 2);
}
