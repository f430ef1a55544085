//! Other subjects in the workspace of the muscles: opened, refused, tried, stopped, put together on the maps, written.

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui_kittest::SnapshotOptions;
use egui_kittest::kittest::Queryable as _;
use frontalis::camera::Scale;
use frontalis::gui::command::After;
use frontalis::gui::dialogs::Purpose;
use frontalis::gui::modal::Modal;
use frontalis::gui::panels::muscles::{Second, Tab};
use frontalis::gui::{Action, Command, Workspace};
use frontalis::muscle_field::subjects::{Seen, carry};
use frontalis::pipeline;
use frontalis::project::{Edit, FrameRef, Mark, PointId, Project, Role as PointRole, file};
use frontalis::study::{Twin, TwinSettings, scene};

use crate::pictures::can_draw;
use crate::stage::{Person, Window, open, project, seen_on_the_way, settle};

const SIZE: [f32; 2] = [1280.0, 800.0];

fn says(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

fn error(window: &mut Window) -> String {
    match window.state_mut().view_mut().modal.take() {
        Some(Modal::Error { text, .. }) => text,
        other => panic!("no error is shown, but {other:?}"),
    }
}

/// Another person's project on the same face: the brows go up by another share.
fn saved(folder: &Path, name: &str, share: f64, change: impl FnOnce(&mut Project)) -> PathBuf {
    let face = frontalis::face::generic();
    let mut other = project(folder, &face, true);
    name.clone_into(&mut other.name);
    for (v, feature) in &mut other.features {
        if feature.role == PointRole::Skin {
            feature.last = Some(Mark::new(seen_on_the_way(&face, *v, share)));
        }
    }
    change(&mut other);
    let path = folder.join(format!("{}.frontalis", name.to_lowercase()));
    file::save(&other, &path).unwrap();
    path
}

/// The workspace with its first answer.
fn window(person: Person) -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let own = project(folder.path(), &frontalis::face::generic(), true);
    let mut window = open(own, SIZE, true, person);
    window.state_mut().view_mut().workspace = Workspace::Muscles;
    settle(&mut window);
    (window, folder)
}

fn add(window: &mut Window, files: &[&Path]) {
    let files = files.iter().map(|p| p.to_path_buf()).collect();
    window.state_mut().push(Command::FilesChosen(Purpose::Subjects, files));
}

fn count(window: &Window) -> usize {
    window.state().subjects_work().others().count()
}

#[test]
fn the_laws_are_tried_on_another_subject_and_the_forces_are_put_together() {
    let person = Person::default();
    let (mut window, folder) = window(person.clone());
    let lea = saved(folder.path(), "Lea", 0.6, |_| {});
    window.state_mut().view_mut().workspace = Workspace::Frames;
    person.will_choose(&[&lea]);
    window.state_mut().push(Command::Do(Action::OtherSubjects));
    settle(&mut window);
    assert_eq!(person.asked.borrow().as_slice(), [Purpose::Subjects]);
    assert_eq!(
        (window.state().view().workspace, window.state().view().muscles.tab),
        (Workspace::Muscles, Tab::Subjects)
    );
    assert!(says(&window, "Least error on skin left out") && says(&window, "R² as fitted"));
    assert!(!says(&window, "Lea: profile"), "the window is too narrow for both");
    window.get_by_label("Along the muscle").click();
    window.run_steps(3);
    assert!(says(&window, "Lea: profile along") && says(&window, "refitted there"));
    window.get_by_label("Table").click();
    window.run_steps(3);

    // What is shown is what the same call without a window gives.
    let app = window.state();
    let analysis = app.muscle_work().answer().unwrap().unwrap();
    let (there, face) = frontalis::gui::files::read_project(&lea).unwrap();
    let solved = pipeline::solve(&there, &face, [480, 480], &mut pipeline::Workspace::default());
    let own_face = app.face();
    let own = Seen { name: "own", face: &own_face, outcome: app.outcome() };
    let seen = Seen { name: "Lea", face: &face, outcome: &solved };
    let expected = carry(analysis, own, seen, &|| false, &|_| {}).unwrap().unwrap();
    let (_, other) = app.subjects_work().others().next().unwrap();
    assert_eq!((other.name.as_str(), other.carried.rows.len()), ("Lea", 5));
    for (row, expected) in other.carried.rows.iter().zip(&expected.rows) {
        assert_eq!((&row.label, row.as_fitted_r2), (&expected.label, expected.as_fitted_r2));
        assert_eq!(row.shape_carried_held_out, expected.shape_carried_held_out);
        assert_eq!(row.refitted_held_out, expected.refitted_held_out);
    }

    // The maps, and every subject's force at a vertex.
    let v = frontalis::face::generic().region("forehead")[30];
    assert!(app.outcome().is_believed(v as usize) && solved.is_believed(v as usize));
    for (button, title) in
        [("Mean", "Mean of 2 subjects"), ("Spread", "Spread over 2 subjects"), ("Difference", "This less Lea")]
    {
        window.get_by_role_and_label(Role::ComboBox, "Right map").click();
        window.run_steps(3);
        window.get_by_label(button).click();
        window.run_steps(3);
        assert!(says(&window, &format!("Map, {title}")), "{title}");
    }
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(v))));
    window.run_steps(3);
    for words in ["on every subject", "this project", "mean", "spread", "this less Lea"] {
        assert!(says(&window, words), "{words}");
    }

    // Taken off the list it leaves the maps, too.
    window.get_by_label("Remove Lea").click();
    window.run_steps(3);
    assert!(count(&window) == 0 && lea.exists() && !says(&window, "Map, This less") && says(&window, "Left by"));
}

#[test]
fn what_can_be_no_other_subject_is_told_in_a_line_and_the_rest_is_taken() {
    let (mut window, folder) = window(Person::default());
    let lea = saved(folder.path(), "Lea", 0.6, |_| {});
    let own = folder.path().join("own.frontalis");
    window
        .state_mut()
        .push(Command::FilesChosen(Purpose::SaveProject { suggested: String::new(), then: None }, vec![own.clone()]));
    settle(&mut window);
    let broken = folder.path().join("notes.frontalis");
    std::fs::write(&broken, "no project").unwrap();
    let bare = saved(folder.path(), "Bare", 0.5, |p| p.features.clear());
    add(&mut window, &[&lea, &lea, &own, &broken, &bare]);
    settle(&mut window);
    let text = error(&mut window);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 4, "{text}");
    assert!(lines[0].contains("among the other subjects already") && lines[1].contains("is the project that is open"));
    assert!(lines[2].contains("notes.frontalis") && lines[3].contains("no mark in the last frame"), "{text}");
    settle(&mut window);
    assert_eq!(count(&window), 1);

    // One that becomes the open project no longer counts, and says so; the list is the window's.
    window.state_mut().view_mut().muscles.tab = Tab::Subjects;
    window.state_mut().push(Command::Proceed(After::Open(lea)));
    settle(&mut window);
    assert!(count(&window) == 0 && says(&window, "This is the project that is open"));
    window.state_mut().push(Command::Proceed(After::Open(own)));
    settle(&mut window);
    settle(&mut window);
    assert_eq!(count(&window), 1);
}

/// Another face tries the laws by the names of the muscles, as the command line does; only maps need one mesh.
#[test]
fn another_face_is_another_subject_whose_muscles_are_found_by_name() {
    let (mut window, folder) = window(Person::default());
    let at = folder.path().join("turned.face.json");
    frontalis::face::file::write(&frontalis::face::generic(), &at).unwrap();
    // The same skin, its triangles numbered from the end.
    let mut turned: serde_json::Value = serde_json::from_slice(&std::fs::read(&at).unwrap()).unwrap();
    turned["triangles"].as_array_mut().unwrap().reverse();
    std::fs::write(&at, turned.to_string()).unwrap();
    let sha256 = frontalis::frames::Frame::sha256_of(&at).unwrap();
    let far = saved(folder.path(), "Far", 0.6, |p| {
        p.face = frontalis::project::FaceSource::File { path: "turned.face.json".into(), sha256 };
    });
    let view = window.state_mut().view_mut();
    (view.muscles.tab, view.muscles.second) = (Tab::Subjects, Second::Mean);
    add(&mut window, &[&far]);
    settle(&mut window);
    settle(&mut window);
    assert!(window.state().view().modal.is_none() && count(&window) == 1);
    let (_, other) = window.state().subjects_work().others().next().unwrap();
    assert!(other.carried.missing.is_empty() && other.carried.rows.iter().any(|r| r.shape_carried.is_ok()));
    assert!(says(&window, "The face of Far is another one"), "in the place of the map");
}

#[test]
fn what_is_written_before_the_laws_were_tried_says_that_subjects_are_missing() {
    let (mut window, folder) = window(Person::default());
    let lea = saved(folder.path(), "Lea", 0.6, |_| {});
    window.state_mut().view_mut().workspace = Workspace::Forces;
    add(&mut window, &[&lea]);
    window.state_mut().view_mut().workspace = Workspace::Forces;
    let out = folder.path().join("out");
    window.state_mut().push(Command::FilesChosen(Purpose::ExportFolder, vec![out.clone()]));
    settle(&mut window);
    let notice = window.state().view().notice.as_ref().map(|n| n.text.clone()).unwrap();
    assert!(notice.contains("without the other subjects") && !out.join("subjects.csv").exists(), "{notice}");
}

#[test]
fn marks_change_and_what_was_found_is_shown_as_old_until_it_is_found_anew() {
    let (mut window, folder) = window(Person::default());
    let lea = saved(folder.path(), "Lea", 0.6, |_| {});
    window.state_mut().view_mut().muscles.tab = Tab::Subjects;
    add(&mut window, &[&lea]);
    settle(&mut window);
    let as_fitted = |w: &Window| {
        let (_, other) = w.state().subjects_work().others().next().unwrap();
        other.carried.rows.iter().map(|r| r.as_fitted_r2).collect::<Vec<_>>()
    };
    let before = as_fitted(&window);
    let face = frontalis::face::generic();
    let edits =
        face.region("forehead").iter().map(|&v| Edit::Put(PointId::FeatureLast(v), seen_on_the_way(&face, v, 1.4)));
    window.state_mut().push(Command::Edits(edits.collect()));
    window.step();
    assert!(window.state().subjects_work().is_old(None) && count(&window) == 1);
    assert_eq!(as_fitted(&window), before, "shown until then");
    window.step();
    assert!(says(&window, "trying the laws anew"));
    settle(&mut window);
    settle(&mut window);
    assert!(!says(&window, "trying the laws anew") && as_fitted(&window) != before);
}

#[test]
fn the_work_can_be_stopped_and_taken_up_again() {
    let (mut window, folder) = window(Person::default());
    let lea = saved(folder.path(), "Lea", 0.6, |_| {});
    window.state_mut().view_mut().muscles.tab = Tab::Subjects;
    add(&mut window, &[&lea]);
    window.step();
    let jobs = window.state().jobs().running();
    let job = jobs.iter().find(|j| j.name == "Trying the laws on other subjects").map(|j| j.id).unwrap();
    window.state_mut().push(Command::CancelJob(job));
    settle(&mut window);
    assert!(count(&window) == 0 && says(&window, "stopped; what is shown is older"));
    assert_eq!(window.state().subjects_work().listed().len(), 1, "it stays on the list");
    window.get_by_label("Try the laws again").click();
    window.run_steps(2);
    settle(&mut window);
    assert!(count(&window) == 1 && !says(&window, "stopped;"));
}

#[test]
fn newtons_are_not_mixed_with_relative_forces_and_everything_is_written() {
    let (mut window, folder) = window(Person::default());
    let with_scale =
        |p: &mut Project| p.scale = Scale::TwoPoints { a_px: [100.0, 100.0], b_px: [210.0, 100.0], mm: 50.0 };
    let lea = saved(folder.path(), "Lea", 0.6, with_scale);
    let ida = saved(folder.path(), "Ida", 0.8, |_| {});
    window.state_mut().view_mut().muscles.tab = Tab::Subjects;
    window.state_mut().view_mut().muscles.second = Second::Mean;
    add(&mut window, &[&lea]);
    settle(&mut window);
    settle(&mut window);
    assert!(says(&window, "the forces of") || says(&window, "The forces of"));
    assert!(says(&window, "those of Lea are in N") && says(&window, "no law is tried as fitted"));
    window.get_by_label("Remove Lea").click();
    add(&mut window, &[&ida]);
    settle(&mut window);
    settle(&mut window);
    assert!(says(&window, "Map, Mean of 2 subjects"));

    let out = folder.path().join("out");
    window.state_mut().push(Command::FilesChosen(Purpose::ExportFolder, vec![out.clone()]));
    settle(&mut window);
    for name in ["subjects.csv", "subject_maps.csv", "subject_maps.png"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("The laws tried on Ida") && report.contains("--test"), "with the line that does it again");
}

/// A twin of that seed as a project on disk.
pub(crate) fn twin(folder: &Path, seed: u64) -> PathBuf {
    let settings = TwinSettings { seed, ..TwinSettings::default() };
    let person = scene::person(&frontalis::face::generic(), seed, settings.distance_mm).unwrap();
    let twin = Twin::generate(&person, &settings).unwrap();
    let frame = |name: &str| FrameRef { path: name.into(), sha256: "0".repeat(64), width_px: 1036, height_px: 1036 };
    let project = scene::project(&twin, &person, [frame("first.png"), frame("last.png")], 0.1);
    let path = folder.join(format!("twin{seed}.frontalis"));
    file::save(&project, &path).unwrap();
    path
}

/// The sample beside two twins, compared along the fibres of frontalis.
pub(crate) fn beside_two_twins(window: &mut Window) {
    let face = frontalis::face::generic();
    let folder = tempfile::tempdir().unwrap();
    let twins = [2, 3].map(|seed| twin(folder.path(), seed));
    let frontalis = (0..).zip(face.muscles()).filter(|(_, m)| m.id.starts_with("frontalis"));
    let view = window.state_mut().view_mut();
    view.workspace = Workspace::Muscles;
    view.muscles.question.compare = frontalis::fit::Compare::Along;
    view.muscles.question.muscles = Some(frontalis.map(|(i, _)| i).collect());
    view.muscles.tab = Tab::Subjects;
    view.muscles.second = Second::Difference;
    settle(window);
    add(window, &[&twins[0], &twins[1]]);
    settle(window);
    let v = face.region("forehead")[30];
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(v))));
    settle(window);
}

fn looks(name: &str, size: [f32; 2], dark: bool, prepare: impl FnOnce(&mut Window)) {
    if !can_draw() {
        return;
    }
    let mut window = open(frontalis::project::sample::project().unwrap(), size, dark, Person::default());
    beside_two_twins(&mut window);
    prepare(&mut window);
    settle(&mut window);
    // Lines a pixel wide fall on other pixels by a rounding of the driver's.
    let options = SnapshotOptions::new().threshold(1.2).max_failed_pixels(40);
    window.snapshot_options(format!("panels/{name}"), &options);
}

#[test]
fn the_difference_looks_as_it_did_in_dark() {
    looks("subjects_dark", SIZE, true, |_| {});
}

#[test]
fn the_spread_of_lengths_looks_as_it_did_in_light() {
    looks("subjects_light", SIZE, false, |w| {
        let view = &mut w.state_mut().view_mut().muscles;
        view.second = Second::Spread;
        view.part = frontalis::muscle_field::profiles::Part::Magnitude;
        view.other_table = false;
    });
}

#[test]
fn a_wide_window_has_room_for_table_and_profile() {
    looks("subjects_wide", [1800.0, 900.0], false, |w| w.state_mut().view_mut().muscles.second = Second::Mean);
}

#[test]
fn why_forces_are_not_put_together_stands_in_the_place_of_the_map() {
    looks("subjects_relative", SIZE, false, |w| {
        let folder = tempfile::tempdir().unwrap();
        let path = twin(folder.path(), 4);
        let relative = Project { scale: Scale::Assumed, name: "Lea".into(), ..file::load(&path).unwrap() };
        file::save(&relative, &path).unwrap();
        add(w, &[&path]);
        settle(w);
        settle(w);
        let lea = w.state().subjects_work().others().find(|(_, o)| o.name == "Lea").map(|(id, _)| id);
        assert!(lea.is_some());
        w.state_mut().view_mut().muscles.other = lea;
    });
}
