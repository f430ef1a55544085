//! Suggested places: found in the background, shown apart, never data until accepted, and yielding to the hand.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use frontalis::gui::Command;
use frontalis::gui::panels::frames::points;
use frontalis::gui::suggesting::Status;
use frontalis::project::{Edit, MarkState, PointId, Project, Role, Which, edit, sample};

use crate::stage::{Person, Window, drag, key, keys, on_screen, open, settle};

/// The sample, with the marks of its still points alone.
fn unmarked() -> Project {
    let mut project = sample::project().unwrap();
    project.features.retain(|_, f| f.role == Role::Still);
    project
}

fn window() -> Window {
    open(unmarked(), [1280.0, 800.0], true, Person::default())
}

/// Every vertex with a suggestion that the window shows, with its place and confidence.
fn suggested(window: &Window) -> Vec<(u32, [f64; 2], f64)> {
    window.state().suggestions().into_iter().map(|s| (s.vertex, [s.at.x, s.at.y], s.confidence)).collect()
}

fn mark(window: &Window, v: u32) -> Option<frontalis::project::Mark> {
    edit::mark(window.state().project(), &PointId::FeatureLast(v)).copied()
}

#[test]
fn suggestions_come_by_themselves_and_are_no_data() {
    let mut window = window();
    assert_eq!(window.state().project(), &unmarked(), "nothing is marked");
    assert!(window.state().steps().is_empty());
    let found = suggested(&window);
    assert!(found.len() > 60, "{}", found.len());
    // The marks of the sample are the truth.
    let truth = sample::project().unwrap();
    let near = |(v, at, _): &&(u32, [f64; 2], f64)| {
        let t = truth.features[v].last.unwrap().at_px;
        (at[0] - t[0]).hypot(at[1] - t[1]) < 1.0
    };
    let sure: Vec<_> = found.iter().filter(|s| s.2 >= 0.9 && truth.features.contains_key(&s.0)).collect();
    assert!(sure.len() > 30 && sure.iter().copied().filter(near).count() * 10 >= sure.len() * 9);
    // Each has a name that tells what it is and how sure.
    let (v, _, confidence) = found[0];
    window.get_by_label(&format!("point {v}, last frame, suggested, {}", points::percent(confidence)));
    // H puts them away and calls them again.
    key(&mut window, Key::H);
    assert!(suggested(&window).is_empty());
    window.get_by_label(&format!("point {v}, last frame, predicted"));
    key(&mut window, Key::H);
    settle(&mut window);
    assert_eq!(suggested(&window), found, "the same again");
}

#[test]
fn one_key_accepts_a_suggestion_and_goes_to_the_next() {
    let mut window = window();
    let found = suggested(&window);
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(found[0].0))));
    window.run_steps(2);
    for k in [Key::Enter, Key::A] {
        let Some(PointId::FeatureLast(v)) = window.state().view().focus.selected else { panic!("nothing is selected") };
        let (_, at, confidence) = *suggested(&window).iter().find(|s| s.0 == v).unwrap();
        key(&mut window, k);
        let mark = mark(&window, v).unwrap();
        assert_eq!(mark.at_px, at);
        let state = if confidence < 0.5 { MarkState::Uncertain } else { MarkState::Marked };
        assert_eq!(mark.state, state);
        assert!(suggested(&window).iter().all(|s| s.0 != v), "a marked point is not suggested");
        let next = window.state().view().focus.selected.clone();
        assert!(matches!(next, Some(PointId::FeatureLast(n)) if n != v), "{next:?}");
    }
    assert_eq!(window.state().steps().len(), 2);
    assert!(window.state().steps()[0].starts_with("Accept the suggestion for point"));
}

#[test]
fn with_nothing_selected_the_key_accepts_the_suggestion_under_the_pointer() {
    let mut window = window();
    let (v, at, _) = suggested(&window)[9];
    let place = on_screen(&window, Which::Last, at);
    window.hover_at(place);
    window.run_steps(3);
    let v = window.state().view().focus.hovered().unwrap_or(v);
    key(&mut window, Key::A);
    assert!(mark(&window, v).is_some());
    assert_eq!(window.state().steps().len(), 1);
}

#[test]
fn all_that_are_sure_are_accepted_in_one_step_and_taken_back_in_one() {
    let mut window = window();
    window.state_mut().view_mut().frames.suggest.least = 0.8;
    window.run_steps(2);
    let sure: Vec<_> = suggested(&window).into_iter().filter(|s| s.2 >= 0.8).collect();
    let before = window.state().project().clone();
    let label = format!("Accept the {} that are 80 % sure and more", sure.len());
    window.get_by_label(&label).click();
    window.run_steps(3);
    assert_eq!(window.state().steps(), [format!("Accept {} suggestions", sure.len())]);
    for (v, at, _) in &sure {
        assert_eq!(mark(&window, *v).unwrap().at_px, *at);
    }
    assert_eq!(window.state().project().features.len(), before.features.len() + sure.len());
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(window.state().project(), &before);
    // The same by key.
    keys(&mut window, Modifiers::SHIFT, Key::Enter);
    assert_eq!(window.state().steps().len(), 1);
}

#[test]
fn the_guide_goes_on_with_the_point_that_was_left_out_when_the_sure_ones_are_accepted() {
    let mut window = window();
    keys(&mut window, Modifiers::COMMAND, Key::M);
    let (found, least) = (suggested(&window), window.state().view().frames.suggest.least);
    let (left_out, ..) = *found.iter().find(|s| s.2 < least).unwrap();
    assert!(found.iter().rposition(|s| s.2 >= least) > found.iter().position(|s| s.0 == left_out));
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(left_out))));
    window.run_steps(2);
    keys(&mut window, Modifiers::SHIFT, Key::Enter);
    assert!(window.state().steps().len() == 1 && mark(&window, left_out).is_none());
    assert_eq!(window.state().view().focus.selected, Some(PointId::FeatureLast(left_out)));
}

#[test]
fn a_suggestion_yields_to_the_hand_and_leads_its_neighbours() {
    let mut window = window();
    let (v, at, _) = suggested(&window)[5];
    let place = on_screen(&window, Which::Last, at);
    drag(&mut window, &[place, place + egui::vec2(12.0, 0.0), place + egui::vec2(24.0, 0.0)]);
    let marked = mark(&window, v).unwrap();
    assert_eq!(marked.state, MarkState::Marked);
    assert!((marked.at_px[0] - at[0]).abs() > 5.0);
    assert!(suggested(&window).iter().all(|s| s.0 != v));
    // After a pause everything is looked for again, now with this mark to lead.
    settle(&mut window);
    settle(&mut window);
    assert_eq!(window.state().suggestion_status(), &Status::There);
    // Without the mark the suggestion is there again.
    window.state_mut().push(Command::Edit(Edit::Clear(PointId::FeatureLast(v))));
    settle(&mut window);
    assert!(suggested(&window).iter().any(|s| s.0 == v));
}

#[test]
fn where_the_skin_of_a_point_is_another_now_its_suggestion_is_dropped() {
    let mut window = window();
    let (v, ..) = suggested(&window)[5];
    let first = window.state().outcome().first_in_image[v as usize];
    let put = Edit::Put(PointId::FeatureFirst(v), [first.x + 3.0, first.y]);
    window.state_mut().push(Command::Edit(put));
    window.step();
    assert!(suggested(&window).iter().all(|s| s.0 != v), "the other skin was not looked for yet");
    settle(&mut window);
    assert!(suggested(&window).iter().any(|s| s.0 == v));
}

#[test]
fn what_is_missing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let face = frontalis::face::generic();
    let window = open(Project::default(), [1280.0, 800.0], false, Person::default());
    window.get_by_label("Needs both frames.");
    let window = open(crate::stage::project(folder.path(), &face, false), [1280.0, 800.0], false, Person::default());
    window.get_by_label("Needs landmarks.");
    let window = open(crate::stage::project(folder.path(), &face, true), [1280.0, 800.0], false, Person::default());
    window.get_by_label("Every chosen point is marked.");
}

#[test]
fn marks_of_a_file_are_suggested_or_accepted_as_the_person_says() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("other.csv");
    let whole = sample::project().unwrap();
    let (v, truth) =
        whole.features.iter().find_map(|(v, f)| f.last.filter(|_| f.role == Role::Skin).map(|m| (*v, m))).unwrap();
    let at = [truth.at_px[0] + 40.0, truth.at_px[1]];
    let rows = format!("frame,id,x_px,y_px,state\nlast,{v},{},{},marked\nlast,nobody,1,2,marked\n", at[0], at[1]);
    std::fs::write(&file, rows).unwrap();
    let person = Person::default();
    for accept in [false, true] {
        person.will_choose(&[&file]);
        let mut window = open(unmarked(), [1280.0, 800.0], true, person.clone());
        window.state_mut().push(Command::Do(frontalis::gui::Action::ImportMarks));
        settle(&mut window);
        window.get_by_label_contains("other.csv holds 1 point of this face");
        window.get_by_label_contains("the face has no point `nobody`");
        window.get_by_label(if accept { "Accept all" } else { "Show as suggestions" }).click();
        settle(&mut window);
        if accept {
            assert_eq!((mark(&window, v).unwrap().at_px, window.state().steps().len()), (at, 1));
        } else {
            assert_eq!(mark(&window, v), None, "a proposal is never data");
            let (_, place, confidence) = suggested(&window).into_iter().find(|s| s.0 == v).unwrap();
            assert_eq!((place, confidence), (at, 1.0));
        }
    }
}

#[test]
fn still_points_are_proposed_and_give_the_motion_of_the_head_and_the_noise_floor() {
    use frontalis::gui::panels::frames::SideTab;
    let mut project = sample::project().unwrap();
    let truth = frontalis::pipeline::solve(
        &project,
        &frontalis::face::generic(),
        [1036; 2],
        &mut frontalis::pipeline::Workspace::default(),
    )
    .head;
    project.features.clear();
    let mut window = open(project, [1280.0, 1100.0], true, Person::default());
    assert_eq!(window.state().outcome().head.still_points, 0);
    window.get_by_label_contains("still points that move as one").click();
    window.run_steps(3);
    assert_eq!(window.state().steps().len(), 1);
    let features = &window.state().project().features;
    assert!(features.len() >= 4 && features.values().all(|f| f.role == Role::Still && f.last.is_some()));
    // The head's motion of the sample is known from its own marks.
    let head = &window.state().outcome().head;
    let off = head.motion.last_from_first(&nalgebra::Point3::origin())
        - truth.motion.last_from_first(&nalgebra::Point3::origin());
    assert!(off.xy().norm() < 0.3, "{off:?} mm");
    assert!(head.noise_floor_px.unwrap() < 0.6);
    // With a forehead marked there is a force to compare the noise with.
    window.state_mut().push(Command::Do(frontalis::gui::Action::AcceptSure));
    settle(&mut window);
    settle(&mut window);
    window.state_mut().push(Command::Do(frontalis::gui::Action::AcceptSure));
    window.state_mut().view_mut().frames.side = SideTab::Results;
    window.run_steps(3);
    window.get_by_label("Turn about x, y, z");
    window.get_by_label("Noise floor in force");
    let floor = window.state().outcome().noise_floor_force(1.0).unwrap();
    assert!(floor > 0.0 && floor.is_finite());
    // The table: a click on the title brings the still point that fits worst to the top.
    // The tab of the table, not the row of the guide.
    let tab = window.query_all_by_label("Still points").max_by(|a, b| a.rect().top().total_cmp(&b.rect().top()));
    tab.unwrap().click();
    window.get_by_label("Sort by Residual px").click();
    window.run_steps(3);
    let residuals = window.state().outcome().still_residuals_px(window.state().project());
    let (worst, _) = residuals.iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    let rows: Vec<_> =
        window.query_all_by_label_contains("Row still point").map(|n| (n.rect().top(), format!("{n:?}"))).collect();
    let top = rows.iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert!(top.1.contains(&format!("Row still point {worst},")), "{} {worst}", top.1);
}

/// A project whose frames are the first and the last of a film in which the brows rise by `raised` times 4 mm; its landmarks are marked.
fn from_film(folder: &std::path::Path, raised: f64, frames: usize) -> Project {
    use frontalis::frames::film::{Film, still_png};
    let face = frontalis::face::generic();
    let path = folder.join("rise.gif");
    let mut gif = image::codecs::gif::GifEncoder::new_with_speed(std::fs::File::create(&path).unwrap(), 20);
    for k in 0..frames {
        let picture = crate::stage::draw_on_the_way(&face, raised * k as f64 / (frames - 1) as f64);
        let rgba = image::DynamicImage::from(picture).into_rgba8();
        gif.encode_frame(image::Frame::new(rgba)).unwrap();
    }
    drop(gif);
    let mut film = Film::open(&path, &|| false).unwrap();
    let mut still = |index: usize| {
        let still = folder.join(format!("rise-{}.png", index + 1));
        std::fs::write(&still, still_png(&film.frame(index, &|| false).unwrap(), &film.origin(index)).unwrap())
            .unwrap();
        crate::stage::frame_ref(&still)
    };
    let mut project = Project::default();
    project.frames.first = Some(still(0));
    project.frames.last = Some(still(frames - 1));
    for l in face.landmarks() {
        project
            .landmarks
            .insert(l.id.clone(), frontalis::project::Mark::new(crate::stage::seen(&face, l.vertex, false)));
    }
    project
}

/// The work under way that looks for points, and how it is told to stop.
fn search(window: &Window) -> Option<(String, std::sync::Arc<frontalis::gui::jobs::Progress>)> {
    let jobs = window.state().jobs().running().iter();
    let looks = |j: &&frontalis::gui::jobs::Job| j.about == frontalis::gui::jobs::About::Suggestions;
    jobs.filter(looks).map(|j| (j.name.clone(), j.progress.clone())).next()
}

#[test]
fn the_skin_is_followed_through_the_film_that_the_frames_come_from() {
    let folder = tempfile::tempdir().unwrap();
    let project = from_film(folder.path(), 2.0, 7);
    let mut window = open(project.clone(), [1280.0, 800.0], true, Person::default());
    settle(&mut window);
    window.get_by_label("followed through 5 frames of rise.gif");
    let face = frontalis::face::generic();
    let far = |found: &[(u32, [f64; 2], f64)]| {
        let forehead = face.region("forehead");
        let errors: Vec<f64> = found
            .iter()
            .filter(|s| forehead.contains(&s.0) && s.2 >= 0.5)
            .map(|(v, at, _)| {
                let truth = crate::stage::seen_on_the_way(&face, *v, 2.0);
                (at[0] - truth[0]).hypot(at[1] - truth[1])
            })
            .collect();
        (errors.iter().filter(|e| **e < 2.0).count(), errors.len())
    };
    let (right, of) = far(&suggested(&window));
    assert!(right > 10 && right * 10 >= of * 8, "{right} of {of} within 2 px");
    // The film moved away, the frames alone are left, and that is told; opened where it is now, it is used again.
    let elsewhere = tempfile::tempdir().unwrap();
    let moved = elsewhere.path().join("rise.gif");
    std::fs::rename(folder.path().join("rise.gif"), &moved).unwrap();
    let mut window = open(project, [1280.0, 800.0], true, Person::default());
    settle(&mut window);
    window.get_by_label("followed from the first frame to the last at once");
    window.state_mut().push(Command::Dropped(vec![moved], None));
    settle(&mut window);
    key(&mut window, Key::Escape);
    settle(&mut window);
    window.get_by_label("followed through 5 frames of rise.gif");
}

#[test]
fn a_search_that_nobody_waits_for_any_more_is_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let project = from_film(folder.path(), 1.0, 16);
    let mut window = open(project.clone(), [1280.0, 800.0], true, Person::default());
    // A landmark of the first frame moves: the skin that was looked for lies elsewhere.
    let (id, mark) = project.landmarks.iter().next().map(|(id, m)| (id.clone(), *m)).unwrap();
    let begin = |window: &mut Window, by: f64| {
        let to = [mark.at_px[0] + by, mark.at_px[1]];
        window.state_mut().push(Command::Edit(Edit::Put(PointId::Landmark(id.clone()), to)));
        for _ in 0..80 {
            window.step();
            if let Some((name, progress)) = search(window).filter(|(_, p)| !p.is_cancelled()) {
                return (name, progress);
            }
        }
        panic!("no search has begun");
    };
    let (name, first) = begin(&mut window, 20.0);
    assert_eq!(name, "Following the skin through rise.gif");
    window.state_mut().push(Command::Edit(Edit::Put(PointId::Landmark(id.clone()), mark.at_px)));
    window.run_steps(3);
    assert!(first.is_cancelled(), "the search for skin that is elsewhere now is told to stop");
    settle(&mut window);
    let (_, second) = begin(&mut window, 30.0);
    key(&mut window, Key::H);
    assert!(second.is_cancelled(), "and so is one whose answer is not wanted");
    assert!(search(&window).is_none());
}

#[test]
fn a_crossing_tells_its_row_and_column_in_both_frames() {
    let mut window = window();
    let (v, at) = window
        .state()
        .suggestions()
        .into_iter()
        .find_map(|s| Some((s.vertex, s.at, s.crossing?)))
        .map(|(v, at, crossing)| (v, (at, crossing)))
        .expect("the sample has a painted grid");
    let (last, [row, column]) = at;
    let words = format!("row {row}, column {column}");
    let first = window.state().outcome().first_in_image[v as usize];
    for (which, place) in [(Which::First, first), (Which::Last, last)] {
        let at = on_screen(&window, which, [place.x, place.y]);
        window.hover_at(at);
        window.run_steps(3);
        window.get_by_label_contains(&format!("crossing {words}"));
    }
    // The guide and the table say it too, of a suggestion and of a mark.
    for mark in [false, true] {
        if mark {
            window.state_mut().push(Command::Edit(Edit::Put(PointId::FeatureLast(v), [last.x, last.y])));
        }
        window.state_mut().push(Command::Select(Some(PointId::FeatureLast(v))));
        settle(&mut window);
        assert!(window.query_all_by_label_contains(&words).count() >= 2, "{words}, marked: {mark}");
    }
}

#[test]
fn the_status_bar_offers_only_a_place_that_can_be_taken() {
    let mut window = window();
    let found = suggested(&window)[0].0;
    window.state_mut().view_mut().frames.tool = frontalis::gui::panels::frames::Tool::Features;
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(found))));
    window.run_steps(3);
    window.get_by_label_contains("its suggested place");
    // Marked, it has its place: there is nothing to take.
    window.state_mut().push(Command::Edit(Edit::Put(PointId::FeatureLast(found), [500.0, 500.0])));
    window.state_mut().push(Command::Select(Some(PointId::FeatureLast(found))));
    window.run_steps(3);
    window.state_mut().view_mut().notice = None;
    window.run_steps(2);
    window.get_by_label_contains("press marks");
    assert!(window.query_by_label_contains("its predicted place").is_none());
    assert!(window.query_by_label_contains("its suggested place").is_none());
}
