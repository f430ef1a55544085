//! The importers as a whole: repairs said, units and axes guessed, and whatever the bytes, no panic.

use std::fmt::Write as _;

use nalgebra::Point3;
use proptest::prelude::*;

use super::*;

fn obj(points: &[[f64; 3]], faces: &[&[u32]]) -> String {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for face in faces {
        writeln!(text, "f {}", face.iter().map(|i| (i + 1).to_string()).collect::<Vec<_>>().join(" ")).unwrap();
    }
    text
}

fn in_mm() -> ImportOptions {
    ImportOptions { mm_per_unit: Some(1.0), axes: Some(Axes::default()), ..ImportOptions::default() }
}

fn imported(text: &str, options: &ImportOptions) -> Imported {
    read(text.as_bytes(), "a.obj", options).unwrap()
}

const SQUARE: [[f64; 3]; 4] = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]];

#[test]
fn seams_are_closed_and_vertices_without_a_triangle_leave() {
    // Two triangles with their own corners, as files with textures have them, and a vertex of no triangle in between.
    let [a, b, c, d] = SQUARE;
    let text = obj(&[a, b, c, [9.0, 9.0, 9.0], a, c, d], &[&[0, 1, 2], &[4, 5, 6]]);
    let got = imported(&text, &in_mm());
    assert_eq!((got.mesh.len(), got.mesh.edges().len()), (4, 5));
    assert_eq!(got.repairs, [Repair::Merged(2), Repair::Unused(1)]);
    assert_eq!(got.vertex_in_file, [0, 1, 2, 6]);
    let apart = imported(&text, &ImportOptions { merge_duplicates: false, ..in_mm() });
    assert_eq!((apart.mesh.len(), apart.repairs), (6, vec![Repair::Unused(1)]));
    let strict = read(text.as_bytes(), "a.obj", &ImportOptions { strict: true, ..in_mm() }).unwrap_err().to_string();
    assert!(strict.contains("2 vertices lay exactly on others"), "{strict}");
}

#[test]
fn empty_and_repeated_triangles_leave() {
    let mut points = SQUARE.to_vec();
    points.push([0.0, 0.0, 0.0]);
    // 0–4–1 lies on one line, 2–2–3 names a vertex twice, the third stands twice.
    let got = imported(&obj(&points, &[&[0, 1, 2], &[0, 2, 3], &[0, 4, 1], &[2, 2, 3], &[2, 0, 1]]), &in_mm());
    assert_eq!(got.mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(got.repairs, [Repair::Degenerate(2), Repair::Duplicate(1), Repair::Unused(1)]);
}

#[test]
fn a_fork_is_cut_and_named() {
    let mut points = SQUARE.to_vec();
    points.push([0.0, 1.0, 2.0]);
    let text = obj(&points, &[&[0, 1, 2], &[0, 2, 3], &[0, 2, 4]]);
    let got = imported(&text, &in_mm());
    assert_eq!(got.repairs, [Repair::Cut { edges: 1, points: 0, first_in_file: 0 }]);
    assert_eq!(got.mesh.triangles().len(), 3);
    assert!(got.mesh.triangles_of_edge().iter().all(|s| s[1] == crate::face::mesh::NONE), "three sheets of their own");
    let refused = read(text.as_bytes(), "a.obj", &ImportOptions { strict: true, ..in_mm() }).unwrap_err();
    assert!(refused.to_string().contains("forked at 1 edges"), "{refused}");
}

#[test]
fn a_fork_whose_sheets_meet_again_is_cut_too() {
    // Three half discs on one diameter, closed to a sphere with a wall: both ends of the diameter join all sheets behind.
    let rim = |k: u32, angle: f64| {
        let t = f64::from(k) / 4.0 * std::f64::consts::PI;
        [t.cos(), t.sin() * angle.cos(), t.sin() * angle.sin()]
    };
    let mut points = vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for sheet in 0..3_u32 {
        let angle = f64::from(sheet) * 2.0;
        let base = points.len() as u32;
        points.extend((1..4).map(|k| rim(k, angle)));
        let ring = [0, base, base + 1, base + 2, 1];
        faces.extend(ring.windows(2).map(|w| vec![2, w[0], w[1]]));
    }
    let faces: Vec<&[u32]> = faces.iter().map(Vec::as_slice).collect();
    let got = imported(&obj(&points, &faces), &in_mm());
    assert!(matches!(got.repairs[0], Repair::Cut { edges: 2, .. }), "{:?}", got.repairs);
    assert_eq!(got.mesh.triangles().len(), 12);
}

#[test]
fn two_fans_that_touch_are_parted() {
    let bow = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [0.0, -1.0, 0.0]];
    let got = imported(&obj(&bow, &[&[0, 1, 2], &[0, 3, 4]]), &in_mm());
    assert_eq!(got.repairs, [Repair::Cut { edges: 0, points: 1, first_in_file: 0 }]);
    assert_eq!((got.mesh.len(), got.vertex_in_file.last()), (6, Some(&0)));
}

/// A cap of a sphere about the z axis: bent as a face is, open at the back.
fn cap(turned: impl Fn(usize) -> bool, map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let (rings, round) = (6_u32, 12_u32);
    let mut points = vec![[0.0, 0.0, 100.0]];
    for r in 1..=rings {
        for k in 0..round {
            let (t, a) = (f64::from(r) * 0.18, f64::from(k) / f64::from(round) * std::f64::consts::TAU);
            points.push([90.0 * t.sin() * a.cos(), 120.0 * t.sin() * a.sin(), 100.0 * t.cos()]);
        }
    }
    let at = |r: u32, k: u32| if r == 0 { 0 } else { 1 + (r - 1) * round + k % round };
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for r in 0..rings {
        for k in 0..round {
            let quad = [at(r, k), at(r + 1, k), at(r + 1, k + 1), at(r, k + 1)];
            faces.push(if r == 0 { quad[..3].to_vec() } else { quad.to_vec() });
        }
    }
    for (i, face) in faces.iter_mut().enumerate() {
        if turned(i) {
            face.reverse();
        }
    }
    let points: Vec<_> = points.into_iter().map(map).collect();
    obj(&points, &faces.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

#[test]
fn winding_is_put_right_triangle_by_triangle_and_as_a_whole() {
    let good = imported(&cap(|_| false, |p| p), &in_mm());
    assert!(good.repairs.is_empty(), "{:?}", good.repairs);
    let mixed = imported(&cap(|i| i % 5 == 0, |p| p), &in_mm());
    assert!(matches!(mixed.repairs.as_slice(), [Repair::Aligned(_)]), "{:?}", mixed.repairs);
    let inward = imported(&cap(|_| true, |p| p), &in_mm());
    assert_eq!(inward.repairs, [Repair::TurnedOutwards(132)]);
    for got in [&good, &mixed, &inward] {
        let outward = got.mesh.vertex_normals(got.mesh.positions());
        assert!(outward.iter().all(|n| n.z > 0.0));
    }
}

#[test]
fn units_and_axes_are_guessed_and_said_and_can_be_overridden() {
    let guess = ImportOptions::default();
    let truth = imported(&cap(|_| false, |p| p), &guess);
    assert!(truth.repairs.is_empty(), "millimetres with z to the front need no word: {:?}", truth.repairs);
    // Height 2 · 120 sin 1.08 = 211.7 mm.
    for (per_mm, unit) in [(0.1, "centimetres"), (0.001, "metres"), (0.01, "decimetres"), (1.0 / 25.4, "inches")] {
        let got = imported(&cap(|_| false, |p| p.map(|c| c * per_mm)), &guess);
        let said: Vec<String> = got.repairs.iter().map(ToString::to_string).collect();
        assert!(said.len() == 1 && said[0].contains(unit) && said[0].contains("212 mm high"), "{said:?}");
        assert!((got.mesh.positions()[0].z - 100.0).abs() < 1e-9);
    }
    let odd = imported(&cap(|_| false, |p| p.map(|c| c * 0.333_333)), &guess);
    assert!(odd.repairs[0].to_string().contains("no usual unit") && odd.repairs[0].to_string().contains("190 mm high"));
    let given = imported(&cap(|_| false, |p| p), &ImportOptions { mm_per_unit: Some(0.5), ..guess.clone() });
    assert!((given.mesh.positions()[0].z - 50.0).abs() < 1e-12 && given.mm_per_unit == 0.5);

    // z up and the face looking along −y, as some programs have it.
    let lying = imported(&cap(|_| false, |[x, y, z]| [x, -z, y]), &guess);
    assert!(lying.repairs[0].to_string().contains("z is up and -y is where the face looks"), "{:?}", lying.repairs);
    assert!(lying.mesh.positions().iter().zip(truth.mesh.positions()).all(|(a, b)| (a - b).norm() < 1e-9));
    let up = |u: &str, f: &str| Axes::new(u.parse().unwrap(), f.parse().unwrap());
    let told = ImportOptions { axes: Some(up("z", "-y").unwrap()), ..guess.clone() };
    assert_eq!(imported(&cap(|_| false, |[x, y, z]| [x, -z, y]), &told).mesh, lying.mesh);
    assert!(up("y", "-y").is_err() && "w".parse::<Direction>().is_err());

    // Another than the middle: moved onto the plane of symmetry.
    let aside = imported(&cap(|_| false, |[x, y, z]| [x + 17.0, y, z]), &guess);
    assert!(aside.repairs[0].to_string().starts_with("moved by -17.00 mm"), "{:?}", aside.repairs);
    // A mirrored file: the left is on the right, the outside stays outside.
    let skew = |[x, y, z]: [f64; 3]| [x, y + 0.1 * x, z];
    let mirrored = imported(&cap(|_| false, skew), &ImportOptions { mirrored: true, ..in_mm() });
    let plain = imported(&cap(|_| false, skew), &in_mm());
    assert!(mirrored.mesh.positions().iter().zip(plain.mesh.positions()).all(|(a, b)| a.x == -b.x && a.y == b.y));
    assert!(mirrored.mesh.vertex_normals(mirrored.mesh.positions()).iter().all(|n| n.z > 0.0));
}

#[test]
fn the_largest_piece_and_a_one_sided_band() {
    let mut points = SQUARE.to_vec();
    points.extend([[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.5, 1.0, 0.0]]);
    let text = obj(&points, &[&[4, 5, 6], &[0, 1, 2], &[0, 2, 3]]);
    let got = imported(&text, &ImportOptions { keep: Keep::LargestPiece, ..in_mm() });
    assert_eq!(got.mesh.len(), 4);
    assert_eq!(got.repairs[0], Repair::SmallPieces { pieces: 1, triangles: 1 });

    // Five triangles in a ring with half a twist: the least Möbius band.
    let ring: Vec<[f64; 3]> =
        (0..5).map(|k| f64::from(k) * 1.257).map(|a| [a.cos(), a.sin(), (2.0 * a).sin()]).collect();
    let band: Vec<Vec<u32>> = (0..5).map(|k| vec![k, (k + 1) % 5, (k + 2) % 5]).collect();
    let band: Vec<&[u32]> = band.iter().map(Vec::as_slice).collect();
    let refused = read(obj(&ring, &band).as_bytes(), "a.obj", &in_mm()).unwrap_err();
    assert!(matches!(refused, ImportError::OneSided { .. }), "{refused}");
}

#[test]
fn the_generic_face_comes_back_from_centimetres_and_out_of_a_head() {
    let face = crate::face::generic();
    let cm: Vec<Point3<f64>> = face.mesh().positions().iter().map(|p| p * 0.1).collect();
    let got = imported(&write_obj(face.mesh(), &cm), &ImportOptions::default());
    assert_eq!(got.mesh.triangles(), face.mesh().triangles());
    assert!(got.mesh.positions().iter().zip(face.mesh().positions()).all(|(a, b)| (a - b).norm() < 1e-9));
    assert_eq!(got.mm_per_unit, 10.0);
    // The face alone, with a skull of one vertex at the top: the cut keeps what hangs together with the nose.
    let got = imported(&write_obj(face.mesh(), &cm), &ImportOptions { keep: Keep::Face, ..ImportOptions::default() });
    assert!(got.mesh.triangles().len() > 1000, "{}", got.mesh.triangles().len());
}

#[test]
fn names_and_sizes_that_cannot_be_are_refused() {
    let refusal =
        |name: &str, text: &str, options: &ImportOptions| read(text.as_bytes(), name, options).unwrap_err().to_string();
    let plain = ImportOptions::default();
    assert!(refusal("face.stl", "solid", &plain).contains("ends in .obj, .ply or .wfm"));
    assert!(refusal("a.obj", "", &plain).contains("0 vertices and 0 triangles"));
    assert!(refusal("a.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", &plain).contains("0 triangles"));
    let far = ImportOptions { mm_per_unit: Some(1e9), ..plain.clone() };
    assert!(refusal("a.obj", &obj(&SQUARE, &[&[0, 1, 2]]), &far).contains("larger than 10 km"));
    let none = ImportOptions { mm_per_unit: Some(0.0), ..plain };
    assert!(refusal("a.obj", "", &none).contains("greater than 0"));
    assert_eq!(Format::of(b"ply\n", "face"), Some(Format::Ply));
    assert_eq!(Format::of(b"", "A.OBJ"), Some(Format::Obj));
}

/// Words that the formats know, so that chance gets beyond the first line.
fn words() -> impl Strategy<Value = String> {
    let word = prop::sample::select(vec![
        "ply",
        "format",
        "ascii",
        "binary_little_endian",
        "binary_big_endian",
        "1.0",
        "element",
        "vertex",
        "face",
        "property",
        "list",
        "uchar",
        "int",
        "float",
        "double",
        "x",
        "y",
        "z",
        "vertex_indices",
        "end_header",
        "v",
        "f",
        "g",
        "#",
        "\n",
        "\n",
        "\n",
        "0",
        "1",
        "2",
        "3",
        "-1",
        "1e308",
        "-1e308",
        "nan",
        "4294967295",
        "1000000000",
        "0.5",
        "\\",
        "1/2/3",
    ]);
    prop::collection::vec(word, 0..120).prop_map(|words| words.join(" ").replace(" \n ", "\n"))
}

/// A sound file with a few bytes changed, cut or put in.
fn bitten() -> impl Strategy<Value = Vec<u8>> {
    let sound = prop::sample::select(vec![
        obj(&SQUARE, &[&[0, 1, 2], &[0, 2, 3]]).into_bytes(),
        cap(|_| false, |p| p).into_bytes(),
        b"4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2\n0 1 2\n0 2 3\n".to_vec(),
        b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n\0\0\0\0\0\0\0\0\0\0\0\0\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x3f\0\0\0\0\0\0\0\x03\0\x01\x02".to_vec(),
    ]);
    (sound, prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 0..6)).prop_map(
        |(mut bytes, bites)| {
            for (at, byte, how) in bites {
                let at = at.index(bytes.len().max(1)).min(bytes.len().saturating_sub(1));
                match how {
                    _ if bytes.is_empty() => {}
                    0 => bytes[at] = byte,
                    1 => bytes.truncate(at),
                    _ => bytes.insert(at, byte),
                }
            }
            bytes
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_panic(
        soup in prop_oneof![prop::collection::vec(any::<u8>(), 0..300), words().prop_map(String::into_bytes), bitten()],
        name in prop::sample::select(vec!["a.obj", "a.ply", "a.wfm"]),
        keep in prop::sample::select(vec![Keep::Everything, Keep::LargestPiece, Keep::Face]),
        merge_duplicates in any::<bool>(),
    ) {
        let options = ImportOptions { keep, merge_duplicates, ..ImportOptions::default() };
        if let Ok(got) = read(&soup, name, &options) {
            prop_assert_eq!(got.mesh.len(), got.vertex_in_file.len());
            prop_assert!(got.mesh.positions().iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
        }
    }

    /// Triangles at random over few vertices fork, touch and repeat in every way there is: what comes out is a surface.
    #[test]
    fn any_heap_of_triangles_becomes_a_surface(
        points in prop::collection::vec(prop::array::uniform3(-4..4_i8), 3..12),
        faces in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..40),
    ) {
        let n = points.len();
        let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        let faces: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|i| i.index(n) as u32)).collect();
        let text = obj(&points, &faces.iter().map(<[u32; 3]>::as_slice).collect::<Vec<_>>());
        match read(text.as_bytes(), "a.obj", &in_mm()) {
            Ok(got) => {
                let parts = crate::face::FaceParts { mirror: vec![None; got.mesh.len()], ..Default::default() };
                let face = crate::face::FaceModel::new(got.mesh, parts).unwrap();
                let said = crate::face::check::check(&face).to_string();
                prop_assert!(!said.contains("touches itself") && !said.contains("opposite ways") && !said.contains("no triangle"), "{}", said);
            }
            Err(e) => prop_assert!(matches!(e, ImportError::OneSided { .. } | ImportError::Mesh(MeshError::Empty { .. })), "{e}"),
        }
    }
}
