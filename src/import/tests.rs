//! What was exported comes back; what is wrong is told with its line.

use super::*;
use crate::export::{coco as coco_out, csv as csv_out, tps as tps_out};
use crate::pipeline::{self, Workspace};
use crate::project::{Mark, sample};

/// The sample with a few marks in other states, without a locked landmark moved.
fn scene() -> (Project, std::sync::Arc<FaceModel>) {
    let mut project = sample::project().unwrap();
    let states = [MarkState::Uncertain, MarkState::Occluded, MarkState::Locked];
    for (feature, state) in project.features.values_mut().filter(|f| f.last.is_some()).zip(states) {
        feature.last = feature.last.map(|m| Mark { state, ..m });
    }
    (project, crate::face::generic())
}

/// Every mark of the project by point.
fn marks(project: &Project) -> Vec<(PointId, Mark)> {
    let landmarks = project.landmarks.iter().map(|(id, m)| (PointId::Landmark(id.clone()), *m));
    let first = project.features.iter().filter_map(|(v, f)| Some((PointId::FeatureFirst(*v), f.first?)));
    let last = project.features.iter().filter_map(|(v, f)| Some((PointId::FeatureLast(*v), f.last?)));
    landmarks.chain(first).chain(last).collect()
}

fn without_marks(project: &Project) -> Project {
    let mut bare = project.clone();
    bare.landmarks.clear();
    for feature in bare.features.values_mut() {
        (feature.first, feature.last) = (None, None);
    }
    bare
}

#[test]
fn csv_comes_back_to_the_bit_with_every_state() {
    let (project, face) = scene();
    let import = parse(&csv_out::marks(&project, &face), &project, &face).unwrap();
    assert_eq!(import.passed_over, Vec::<String>::new());
    let there = marks(&project);
    assert_eq!(import.points.len(), there.len());
    for (id, mark) in &there {
        let point = import.points.iter().find(|p| p.point == *id).unwrap();
        assert_eq!((point.at_px, point.state), (mark.at_px, mark.state));
    }
    assert_eq!(import.against(&project), Some((there.len(), 0.0, 0.0)));
    // Nothing is overwritten; without marks, accepting brings back every one of them.
    assert!(import.accept(&project).is_empty());
    let mut bare = without_marks(&project);
    for edit in import.accept(&bare) {
        edit.apply(&mut bare).unwrap();
    }
    let places = |p: &Project| marks(p).into_iter().map(|(id, m)| (id, m.at_px, m.state)).collect::<Vec<_>>();
    assert_eq!(places(&bare), places(&project));
}

#[test]
fn tps_and_coco_come_back_to_printed_precision() {
    let (project, face) = scene();
    let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
    let texts = [tps_out::tps(&project, &face, &outcome).unwrap(), coco_out::coco(&project, &face, &outcome).unwrap()];
    for (text, tps) in texts.iter().zip([true, false]) {
        let import = parse(text, &project, &face).unwrap();
        let landmark_vertex = |v: u32| face.landmarks().iter().any(|l| l.vertex == v);
        let mut compared = 0;
        for (id, mark) in marks(&project) {
            // A feature point of the first frame that is a landmark as well stands once, as the landmark.
            let hidden = tps && mark.state == MarkState::Occluded;
            if hidden || matches!(id, PointId::FeatureFirst(v) if landmark_vertex(v)) {
                continue;
            }
            let point = import.points.iter().find(|p| p.point == id).unwrap();
            // 1036 − (1036 − y) and (y − 0.5) + 0.5 round once each.
            assert!((0..2).all(|i| (point.at_px[i] - mark.at_px[i]).abs() < 1e-9), "{point:?} {mark:?}");
            let state = match mark.state {
                MarkState::Uncertain | MarkState::Locked if !tps => MarkState::Marked,
                state => state,
            };
            assert_eq!(point.state, state);
            compared += 1;
        }
        assert!(compared > 100 && import.points.len() == compared, "{compared} of {}", import.points.len());
    }
}

#[test]
fn points_become_suggestions_and_never_marks_by_themselves() {
    let (project, face) = scene();
    let text =
        "id,name,x_px,y_px,confidence,method,row,col\n17,brow,100.5,200,0.75,tracked,,\nnose_tip,,1,2,0.9,searched,,\n";
    let import = parse(text, &project, &face).unwrap();
    let suggestion = import.points[0].suggestion().unwrap();
    assert_eq!((suggestion.vertex, suggestion.at.x, suggestion.confidence), (17, 100.5, 0.75));
    assert_eq!(suggestion.method, Source::Imported);
    // A landmark's name in the last frame means its vertex there.
    let vertex = face.landmark("nose_tip").unwrap().vertex;
    assert_eq!(import.points[1].point, PointId::FeatureLast(vertex));
    let csv = |rows: &str| parse(&format!("frame,id,x_px,y_px,state\n{rows}"), &project, &face).unwrap().points;
    assert_eq!(csv("last,17,1,2,uncertain\n")[0].suggestion().unwrap().confidence, DOUBTED);
    assert_eq!(csv("last,17,1,2,occluded\n")[0].suggestion(), None);
    assert_eq!(csv("first,nose_tip,1,2,\n")[0].suggestion(), None);
}

#[test]
fn landmarks_of_another_program_are_taken_in_the_order_of_the_face() {
    let (project, face) = scene();
    let points = |n: usize| (0..n).map(|i| format!("{i}.5 1000")).collect::<Vec<_>>().join("\n");
    let count = face.landmarks().len();
    let import =
        parse(&format!("LM={count}\r\n{}\nIMAGE=first.png\nSCALE=0.1\n", points(count)), &project, &face).unwrap();
    assert_eq!(import.points.len(), count);
    assert_eq!(import.points[3].point, PointId::Landmark(face.landmarks()[3].id.clone()));
    // y of 1000 upward from the lower edge of 1036 px.
    assert_eq!(import.points[3].at_px, [3.5, 36.0]);
    let Wrong(line, reason) = parse(&format!("LM=5\n{}", points(5)), &project, &face).unwrap_err();
    assert!(line == Some(1) && reason.contains("5 points without names"), "{reason}");
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let (project, face) = scene();
    let head = "frame,id,x_px,y_px,state\n";
    for (text, line, why) in [
        (String::new(), None, "empty"),
        ("a,b\n1,2\n".to_owned(), Some(1), "no column `id`"),
        (format!("{head}last,17,1,2,marked\nlast,18,x,2,marked\n"), Some(3), "`x` is not a number"),
        (format!("{head}last,17,1,2\n"), Some(2), "4 fields, but the header has 5"),
        (format!("{head}middle,17,1,2,marked\n"), Some(2), "not a frame"),
        (format!("{head}last,17,1,2,sure\n"), Some(2), "not the state"),
        (format!("{head}\nlast,17,1e9,2,marked\n"), Some(3), "where no picture is"),
        (format!("{head}last,17,NaN,2,marked\n"), Some(2), "where no picture is"),
        (format!("{head}last,\"17,1,2,marked\n"), Some(2), "never closed"),
        (format!("{head}last,no_such_point,1,2,marked\n"), None, "no point `no_such_point`"),
        ("LM=2\n1 2\n".to_owned(), Some(1), "says 2 points, and 1 follow"),
        ("LM=1\n1 2\n3 4\n".to_owned(), Some(3), "more than the 1 points"),
        ("LM=1\n1 two\n".to_owned(), Some(2), "two numbers"),
        ("LM3=1\n1 2 3\n".to_owned(), Some(1), "in space"),
        ("LM=many\n".to_owned(), Some(1), "number of points"),
        ("{\"annotations\": [\n1]}".to_owned(), Some(2), "COCO"),
        ("{\"annotations\": [], \"categories\": []}".to_owned(), None, "no mark in it"),
    ] {
        let Wrong(at, reason) = parse(&text, &project, &face).unwrap_err();
        assert!(at == line && reason.contains(why) && !reason.contains('\n'), "{text:?}: {at:?} {reason}");
    }
    let twice = parse(&format!("{head}last,17,1,2,\nlast,17,3,4,\nlast,9999999,1,2,\n"), &project, &face).unwrap();
    assert_eq!((twice.points.len(), twice.passed_over.len()), (1, 2));
    assert!(twice.passed_over[0].starts_with("line 3: `17` stands there twice"), "{:?}", twice.passed_over);
}

/// Cut anywhere, or with any byte another one, a file is read or refused in a line.
#[test]
fn damaged_files_are_read_or_refused() {
    use rand::{RngExt, SeedableRng};
    let (project, face) = scene();
    let outcome = pipeline::solve(&project, &face, [1036, 1036], &mut Workspace::default());
    let texts = [
        csv_out::marks(&project, &face),
        tps_out::tps(&project, &face, &outcome).unwrap(),
        coco_out::coco(&project, &face, &outcome).unwrap(),
    ];
    let mut random = rand_pcg::Pcg32::seed_from_u64(3);
    for text in texts {
        for _ in 0..60 {
            let cut: String = text.chars().take(random.random_range(0..text.len())).collect();
            let mut bytes = text.clone().into_bytes();
            let place = random.random_range(0..bytes.len());
            bytes[place] = random.random_range(32..127);
            for damaged in [cut, String::from_utf8_lossy(&bytes).into_owned()] {
                if let Err(Wrong(_, reason)) = parse(&damaged, &project, &face) {
                    assert!(!reason.contains('\n'), "{reason}");
                }
            }
        }
    }
}
