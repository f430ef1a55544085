//! The generic face against the measured proportions of adult faces.

use super::*;
use crate::face::check;

fn at(face: &FaceModel, id: &str) -> Point3<f64> {
    face.mesh().positions()[face.landmark(id).unwrap().vertex as usize]
}

#[test]
fn the_embedded_file_is_what_the_generator_makes() {
    let made = generate().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/faces/generic.json");
    if std::env::var_os("FRONTALIS_WRITE_FACE").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        file::write(&made, &path).unwrap();
    }
    let stored = std::fs::read(&path).unwrap();
    assert!(
        file::to_json(&made).into_bytes() == stored,
        "run this test with FRONTALIS_WRITE_FACE=1 to write the file anew"
    );
    assert!(EMBEDDED == stored, "build again: the program still carries the file before this one");
    assert_eq!(*generic(), made);
}

#[test]
fn the_face_has_its_counts_and_every_check_passes() {
    let face = generic();
    let report = check::check_against(&face, &check::Expectations::generic());
    assert!(report.ok(), "{report}");
    assert_eq!(face.mesh().edges().len(), 1742);
    assert_eq!(face.mesh().triangles_of_edge().iter().filter(|s| s[1] == crate::face::mesh::NONE).count(), 100);
    let edge = face.mesh().mean_edge_length();
    // 360 cm² of skin in 1128 triangles are equilateral triangles of 8.6 mm; this face ends before the ears.
    assert!((7.5..9.0).contains(&edge), "{edge}");
}

#[test]
fn landmarks_lie_where_they_were_measured() {
    // Mean of a scan database (mm); mouth and nose agree between two databases within 8 mm in depth.
    for (id, x, y, z) in [
        ("brow_outer_left", 58.0, 19.0, -13.0),
        ("brow_mid_left", 38.0, 29.0, 6.0),
        ("brow_inner_left", 12.0, 26.0, 15.0),
        ("nose_saddle", 0.0, 4.0, 15.0),
        ("nose_tip", 0.0, -29.0, 39.0),
        ("subnasale", 0.0, -45.0, 24.0),
        ("nose_wing_left", 18.0, -36.0, 11.0),
        ("eye_inner_left", 18.4, 0.0, 0.0),
        ("eye_outer_left", 44.6, 1.0, -6.0),
        ("mouth_corner_left", 25.3, -69.0, 10.0),
        ("upper_lip", 0.0, -60.0, 22.0),
        ("upper_lip_inner", 0.0, -67.0, 21.0),
        ("lower_lip", 0.0, -77.0, 24.0),
        ("chin", 0.0, -109.0, 12.0),
        ("jaw_left", 57.0, -78.0, -31.0),
        ("forehead_top", 0.0, 73.0, -3.0),
    ] {
        let d = (at(&generic(), id) - Point3::new(x, y, z)).norm();
        assert!(d < 4.0, "{id} is {d:.1} mm off: {}", at(&generic(), id));
    }
}

#[test]
fn distances_are_those_of_an_adult_face() {
    for (a, b, mm, tolerance) in [
        ("eye_inner_left", "eye_inner_right", 36.9, 1.0),
        ("eye_outer_left", "eye_outer_right", 89.2, 2.0),
        ("mouth_corner_left", "mouth_corner_right", 50.7, 2.0),
        ("nose_wing_left", "nose_wing_right", 36.0, 2.0),
        ("nose_saddle", "subnasale", 50.0, 2.0),
        ("nose_saddle", "chin", 113.0, 3.0),
        ("subnasale", "upper_lip_inner", 21.0, 2.0),
        ("nose_tip", "subnasale", 22.0, 2.0),
        ("jaw_left", "jaw_right", 115.0, 3.0),
    ] {
        let d = (at(&generic(), a) - at(&generic(), b)).norm();
        assert!((d - mm).abs() <= tolerance, "{a} to {b}: {d:.1} mm, measured {mm}");
    }
}

#[test]
fn landmarks_and_muscle_ends_sit_on_vertices_made_for_them() {
    let face = generic();
    for (landmark, &(place, side)) in face.landmarks().iter().zip(&PLACING_ORDER) {
        let p = face.mesh().positions()[landmark.vertex as usize];
        let [x, y] = PLACES[place].at;
        let x = if side == Some(Side::Right) { -x } else { x };
        assert!((p.x - x).abs() < 1e-3 && (p.y - y).abs() < 1e-3, "{}: {p}", landmark.id);
    }
    for (muscle, pair) in face.muscles().iter().zip(MUSCLES.iter().flat_map(|p| [p, p])) {
        for (vertex, [x, y]) in [(muscle.attachment, pair.attachment), (muscle.insertion, pair.insertion)] {
            let p = face.mesh().positions()[vertex as usize];
            let d = ((p.x.abs() - x).powi(2) + (p.y - y).powi(2)).sqrt();
            assert!(d < 5.0, "{}: {d:.1} mm", muscle.id);
            assert_eq!(p.x > 0.0, muscle.side == Side::Left, "{}", muscle.id);
        }
    }
}

#[test]
fn regions_are_marked_row_by_row_and_each_vertex_once() {
    let face = generic();
    let all = face.region("forehead_and_brows");
    assert!(all.len() >= 60, "{}", all.len());
    for region in face.regions() {
        let mut seen = region.vertices.clone();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), region.vertices.len(), "{}", region.id);
    }
    assert!(face.region("still").iter().all(|v| !all.contains(v)));
    // Left to right in the picture within a row: x falls back only where a row ends.
    let p = face.mesh().positions();
    let starts = all.windows(2).filter(|w| p[w[1] as usize].x < p[w[0] as usize].x).count();
    assert_eq!(starts, BROW, "as many rows above the brow, each but the first begins anew");
}

/// Fibres of the frontalis run along edges: from every vertex of the brow a column of edges leads up to the top row, and leans
/// outwards by no more than the muscle does (Frank 2019: 6.7 ± 2.9° to 21.3 ± 5.9°).
#[test]
fn the_columns_of_the_forehead_follow_the_fibres() {
    let face = generic();
    let p = face.mesh().positions();
    let rows: Vec<Vec<u32>> = face.region("forehead").chunks(2 * COLUMNS - 1).map(<[u32]>::to_vec).collect();
    assert_eq!(rows.len(), BROW);
    for pair in rows.windows(2) {
        for (above, below) in pair[0].iter().zip(&pair[1]) {
            assert!(face.mesh().neighbours(*above as usize).contains(below), "no edge from {above} to {below}");
        }
    }
    for (top, bottom) in rows[0].iter().zip(&rows[BROW - 1]) {
        let (a, b) = (p[*top as usize], p[*bottom as usize]);
        let lean = ((a.x.abs() - b.x.abs()) / (a.y - b.y)).atan().to_degrees();
        assert!((-12.0..22.0).contains(&lean), "the column over {bottom} leans {lean:.0}°");
    }
}

#[test]
fn landmarks_name_the_same_places_of_other_sets() {
    let face = generic();
    let numbers: Vec<u16> = face.landmarks().iter().filter_map(|l| l.in_468).collect();
    assert_eq!(numbers.len(), 32);
    let unique: std::collections::BTreeSet<_> = numbers.iter().collect();
    assert_eq!(unique.len(), 32);
    let in_68: std::collections::BTreeSet<_> = face.landmarks().iter().filter_map(|l| l.in_68).collect();
    assert_eq!(in_68.len(), 27, "the 68-point markup has no top and bottom of the eyes and no forehead");
    // The two ends of the markup's outline and its middle, the tip of the nose, the corners of the mouth.
    for (id, number) in
        [("temple_right", 1), ("temple_left", 17), ("chin", 9), ("nose_tip", 31), ("mouth_corner_left", 55)]
    {
        assert_eq!(face.landmark(id).unwrap().in_68, Some(number));
    }
}

#[test]
fn the_preset_of_waters_has_its_eighteen_muscles_with_zones() {
    let waters = generic().with_preset("waters").unwrap();
    assert_eq!(waters.muscles().len(), 18);
    assert!(waters.muscles().iter().all(|m| m.zone_half_angle_deg.is_some()));
    for (muscle, pair) in waters.muscles().iter().zip(WATERS_MUSCLES.iter().flat_map(|p| [p, p])) {
        for (vertex, [x, y]) in [(muscle.attachment, pair.attachment), (muscle.insertion, pair.insertion)] {
            let p = waters.mesh().positions()[vertex as usize];
            let d = ((p.x.abs() - x).powi(2) + (p.y - y).powi(2)).sqrt();
            assert!(d < 6.0, "{}: {d:.1} mm", muscle.id);
        }
    }
    assert!(generic().with_preset("none").is_none());
}
