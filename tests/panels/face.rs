//! The workspace of the face: a mesh opened, its vertices clicked to bind landmarks and muscles, checked, saved, given to the project.

use std::path::Path;

use egui::{Key, Modifiers, Pos2};
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::face::draft::{Bindings, Slot};
use frontalis::face::{self, FaceModel};
use frontalis::gui::dialogs::Purpose;
use frontalis::gui::face_drawing::FaceDrawing;
use frontalis::gui::modal::Modal;
use frontalis::gui::{Action, Command, Workspace};
use frontalis::project::{FaceSource, PointId};

use crate::stage::{Person, Window, drag, key, keys, open, project, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

/// A window that shows the generic mesh as another program would have written it: without landmarks and muscles.
fn with_mesh(person: &Person, folder: &Path) -> Window {
    let generic = face::generic();
    let at = folder.join("scan.obj");
    std::fs::write(&at, face::import::write_obj(generic.mesh(), generic.mesh().positions())).unwrap();
    let mut window = open(project(folder, &generic, true), SIZE, true, person.clone());
    person.will_choose(&[&at]);
    window.state_mut().push(Command::Do(Action::OpenMesh));
    settle(&mut window);
    window.state_mut().push(Command::Do(Action::Look(frontalis::gui::orbit_view::StandardView::Front)));
    window.run_steps(3);
    window
}

fn bindings(window: &Window) -> Bindings {
    window.state().face_work().open().unwrap().draft.bindings().clone()
}

/// Where a vertex is on the screen.
fn place(window: &Window, vertex: u32) -> Pos2 {
    let work = window.state().face_work().open().unwrap();
    let projection = window.state().view().face.projection().unwrap();
    FaceDrawing::place(&work.drawing, &projection, vertex as usize).0
}

fn click(window: &mut Window, at: Pos2) {
    drag(window, &[at, at]);
}

fn vertex_of(face: &FaceModel, id: &str) -> u32 {
    face.landmark(id).unwrap().vertex
}

#[test]
fn a_mesh_is_bound_by_clicks_on_both_sides_at_once_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let (generic, person) = (face::generic(), Person::default());
    let mut window = with_mesh(&person, folder.path());
    assert_eq!(window.state().view().workspace, Workspace::Face);
    assert_eq!(bindings(&window).bound(), [0, 0]);
    window.get_by_label("Face model, 612 vertices");

    let name = &generic.landmark("eye_outer_left").unwrap().name;
    window.get_by_label(&format!("Landmark {name}, not bound")).click();
    window.run_steps(2);
    let at = place(&window, vertex_of(&generic, "eye_outer_left"));
    click(&mut window, at);
    let bound = |window: &Window, id: &str| {
        let b = bindings(window);
        let slot = b.landmarks.iter().position(|l| l.landmark.id == id).unwrap();
        b.vertex(Slot::Landmark(slot))
    };
    assert_eq!(bound(&window, "eye_outer_left"), Some(vertex_of(&generic, "eye_outer_left")));
    assert_eq!(bound(&window, "eye_outer_right"), Some(vertex_of(&generic, "eye_outer_right")));
    window.get_by_label(&format!("landmark eye_outer_left, vertex {}", vertex_of(&generic, "eye_outer_left")));

    // The switch off: one side alone.
    window.get_by_label("Both sides").click();
    window.run_steps(2);
    window.get_by_label_contains(&format!("Landmark {name}, vertex")).click();
    window.run_steps(2);
    let at = place(&window, vertex_of(&generic, "nose_tip"));
    click(&mut window, at);
    assert_eq!(bound(&window, "eye_outer_left"), Some(vertex_of(&generic, "nose_tip")));
    assert_eq!(bound(&window, "eye_outer_right"), Some(vertex_of(&generic, "eye_outer_right")));
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(bound(&window, "eye_outer_left"), Some(vertex_of(&generic, "eye_outer_left")));

    // A muscle, and half its width.
    window.get_by_label("Both sides").click();
    window.get_all_by_label("Muscles").last().unwrap().click();
    window.run_steps(3);
    let muscle = generic.muscles().iter().find(|m| m.id.ends_with("left")).unwrap();
    window.get_by_label(&format!("Attachment of {}, not bound", muscle.id)).click();
    window.run_steps(2);
    let at = place(&window, muscle.attachment);
    click(&mut window, at);
    assert!(matches!(window.state().view().face.selected, Some(Slot::Insertion(_))), "the other end comes next");
    let at = place(&window, muscle.insertion);
    click(&mut window, at);
    assert_eq!(bindings(&window).bound(), [2, 2], "both muscles of the pair");

    let out = folder.path().join("mine.face.json");
    person.will_choose(&[&out]);
    keys(&mut window, Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    assert!(matches!(person.asked.borrow().last(), Some(Purpose::SaveFace { .. })));
    let saved = face::file::read(&out).unwrap();
    assert_eq!((saved.landmarks().len(), saved.muscles().len()), (2, 2));
    assert_eq!(saved.mesh().len(), 612);
    assert!(!window.state().face_work().unsaved());
}

#[test]
fn what_the_check_finds_is_live() {
    let folder = tempfile::tempdir().unwrap();
    let person = Person::default();
    let mut window = with_mesh(&person, folder.path());
    window.get_by_label("Check").click();
    window.run_steps(3);
    window.get_by_label("0 of 32 landmarks bound");
    let v = vertex_of(&face::generic(), "chin");
    for slot in [0, 1] {
        let bind =
            frontalis::face::draft::DraftEdit::Bind { slot: Slot::Landmark(slot), vertex: Some(v), mirrored: false };
        window.state_mut().push(Command::EditFace(bind));
    }
    window.run_steps(3);
    window.get_by_label("2 of 32 landmarks bound");
    window.get_by_label_contains(&format!("share vertex {v}"));
}

#[test]
fn the_face_is_used_in_the_project_and_undo_brings_the_other_back() {
    let folder = tempfile::tempdir().unwrap();
    let (generic, person) = (face::generic(), Person::default());
    // A finer face of another number of vertices, with the same names.
    let mut parts = generic.to_parts();
    let mut positions = generic.mesh().positions().to_vec();
    let [a, b, c] = generic.mesh().triangles()[0];
    let at = |v: u32| positions[v as usize].coords;
    let middle = (at(a) + at(b) + at(c)) / 3.0;
    positions.push(middle.into());
    let new = positions.len() as u32 - 1;
    let mut triangles = generic.mesh().triangles().to_vec();
    triangles[0] = [a, b, new];
    triangles.extend([[b, c, new], [c, a, new]]);
    let mesh = face::Mesh::new(positions, triangles).unwrap();
    parts.mirror.push(None);
    let file = folder.path().join("other.face.json");
    face::file::write(&FaceModel::new(mesh, parts).unwrap(), &file).unwrap();

    let mut window = open(project(folder.path(), &generic, true), SIZE, true, person.clone());
    let before = window.state().project().clone();
    person.will_choose(&[&file]);
    window.state_mut().push(Command::Do(Action::OpenFace));
    settle(&mut window);
    window.get_by_label("Use in project").click();
    window.run_steps(4);
    assert!(matches!(window.state().project().face, FaceSource::File { .. }));
    assert_eq!(window.state().outcome().first.len(), 613);
    assert_eq!(window.state().project().landmarks, before.landmarks, "landmarks go by their names");
    assert!(window.state().project().features.is_empty(), "a vertex is another place on another mesh");
    window.get_by_label_contains("marks that it has no place for were removed");
    // Undo belongs to the project outside the workspace of the face.
    keys(&mut window, Modifiers::COMMAND, Key::Num1);
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(window.state().project(), &before);
    assert_eq!(window.state().outcome().first.len(), 612);
    keys(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.state().outcome().first.len(), 613);
}

#[test]
fn bad_files_are_one_clear_line_and_the_face_stays() {
    let folder = tempfile::tempdir().unwrap();
    let person = Person::default();
    let mut window = with_mesh(&person, folder.path());
    let before = bindings(&window);
    for (name, text, said) in [
        ("cut.obj", "v 0 0\n", "line 1"),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4"),
        ("bad.face.json", "{\"version\": 1", "damaged"),
        ("liar.ply", "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nend_header\n", "liar.ply"),
    ] {
        let at = folder.path().join(name);
        std::fs::write(&at, text).unwrap();
        window.state_mut().push(Command::Proceed(frontalis::gui::command::After::ReadFace(at)));
        settle(&mut window);
        let Some(Modal::Error { text, .. }) = window.state().view().modal.clone() else { panic!("{name}: no dialog") };
        assert!(text.contains(name) && text.contains(said) && text.lines().count() == 1, "{text}");
        window.state_mut().push(Command::CloseModal);
        window.run_steps(2);
    }
    assert_eq!(bindings(&window), before);
}

#[test]
fn a_face_that_is_not_saved_is_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    let person = Person::default();
    let mut window = with_mesh(&person, folder.path());
    let edit = frontalis::face::draft::DraftEdit::Rename("Somebody".into());
    window.state_mut().push(Command::EditFace(edit));
    window.state_mut().push(Command::Do(Action::OpenMesh));
    window.run_steps(3);
    assert!(matches!(window.state().view().modal, Some(Modal::UnsavedFace(_))));
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    assert_eq!(bindings(&window).name, "Somebody");
}

#[test]
fn keys_turn_step_and_unbind() {
    let folder = tempfile::tempdir().unwrap();
    let generic = face::generic();
    let mut window = open(project(folder.path(), &generic, true), SIZE, true, Person::default());
    keys(&mut window, Modifiers::COMMAND, Key::Num5);
    settle(&mut window);
    assert_eq!(bindings(&window).bound(), [32, 18], "the face of the project");
    assert!(!window.state().face_work().unsaved());
    key(&mut window, Key::Period);
    assert_eq!(window.state().view().face.selected, Some(Slot::Landmark(0)));
    key(&mut window, Key::Delete);
    assert!(bindings(&window).landmarks[0].vertex.is_none());
    let before = window.state().view().face.orbit;
    let middle = place(&window, vertex_of(&generic, "nose_tip"));
    drag(&mut window, &[middle, middle + egui::vec2(30.0, 0.0), middle + egui::vec2(60.0, 5.0)]);
    assert_ne!(window.state().view().face.orbit.azimuth, before.azimuth);
    assert!(bindings(&window).landmarks[0].vertex.is_none(), "a drag binds nothing");
    assert_eq!(window.state().view().focus.selected, None::<PointId>);
    key(&mut window, Key::V);
    let marks = window.get_by_role_and_label(egui::Role::Button, "Marks");
    assert_eq!(marks.accesskit_node().toggled(), Some(egui::accesskit::Toggled::False));
}

#[test]
fn the_generic_face_is_transferred_as_a_proposal_that_undo_takes_back() {
    let folder = tempfile::tempdir().unwrap();
    let person = Person::default();
    let mut window = with_mesh(&person, folder.path());
    window.get_by_label("Transfer").click();
    settle(&mut window);
    let generic = face::generic();
    let proposed = bindings(&window);
    let near = |l: &frontalis::face::draft::DraftLandmark| {
        let Some(v) = l.vertex else { return false };
        let x = generic.mesh().positions();
        (x[v as usize] - x[vertex_of(&generic, &l.landmark.id) as usize]).norm() < 4.0
    };
    let right = proposed.landmarks.iter().filter(|l| near(l)).count();
    assert!(right >= 30, "{right} of 32 landmarks lie where they are on the same mesh");
    assert!(proposed.bound()[1] >= 16 && !proposed.regions.is_empty());
    window.get_by_label("Check").click();
    window.run_steps(3);
    window.get_by_label_contains("(root mean square) of this mesh");
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(bindings(&window).bound(), [0, 0]);
}
