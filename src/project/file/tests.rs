//! The project file: exact round trips, and one line for every kind of damage.

use std::fs;
use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::camera::Scale;
use crate::customize::{AlignRule, CustomizeSettings, MorphRule};
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::forces::SpringRule;
use crate::project::document::{
    CameraSettings, FaceSource, Feature, FramePair, FrameRef, Mark, MarkState, Role, Settings,
};

fn here() -> &'static Path {
    Path::new("a.frontalis.json")
}

fn parsed(text: &str) -> Result<Project, ProjectFileError> {
    let project = parse(here(), text.as_bytes())?;
    refuse(here(), faults::of_values(&project))?;
    Ok(project)
}

fn refusal(text: &str) -> String {
    let line = parsed(text).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    assert!(line.starts_with("a.frontalis.json: "), "{line}");
    line
}

fn any_position() -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2(-1e6..=1e6)
}

fn any_mark() -> impl Strategy<Value = Mark> {
    let state = prop_oneof![
        Just(MarkState::Marked),
        Just(MarkState::Uncertain),
        Just(MarkState::Occluded),
        Just(MarkState::Locked)
    ];
    (any_position(), state, prop::option::of(0.0..100.0)).prop_map(|(at_px, state, sigma_px)| Mark {
        at_px,
        state,
        sigma_px,
    })
}

fn any_frame() -> impl Strategy<Value = FrameRef> {
    ("[^\0]{1,30}", "[0-9a-f]{64}", 1_u32..8192, 1_u32..8192).prop_map(|(path, sha256, width_px, height_px)| FrameRef {
        path,
        sha256,
        width_px,
        height_px,
    })
}

fn any_scale() -> impl Strategy<Value = Scale> {
    prop_oneof![
        Just(Scale::Assumed),
        (any_position(), any_position(), 1e-3..1e3).prop_map(|(a_px, b_px, mm)| Scale::TwoPoints { a_px, b_px, mm }),
        (any_position(), any_position(), 0.1..50.0, 0.1..50.0)
            .prop_map(|(a_px, b_px, cells, pitch_mm)| Scale::GridPitch { a_px, b_px, cells, pitch_mm }),
        (1.0..100.0).prop_map(|mm| Scale::InnerEyeCorners { mm }),
    ]
}

fn any_settings() -> impl Strategy<Value = Settings> {
    let unmarked =
        prop_oneof![Just(UnmarkedRule::Held), (0.1..1e3).prop_map(|reach_mm| UnmarkedRule::Inferred { reach_mm })];
    let depth = proptest::sample::select(DepthRule::ALL.to_vec());
    let springs = prop_oneof![Just(SpringRule::Strip), Just(SpringRule::Uniform)];
    let align = prop::sample::select(vec![AlignRule::Thesis, AlignRule::Pose]);
    let morph = prop::sample::select(vec![MorphRule::Nnwa, MorphRule::Radial]);
    let smoothing = prop::sample::select(vec![0.0, 0.7]);
    let customize = (0.1..5.0, 0.1..9.0, prop::option::of(1_usize..40), align, morph, smoothing).prop_map(
        |(z_factor, power, nearest, align, morph, smoothing_mm)| CustomizeSettings {
            align,
            z_factor,
            morph,
            smoothing_mm,
            power,
            nearest,
        },
    );
    (customize, depth, unmarked, springs, 0.01..9.0, 0.0..9.0, any::<bool>()).prop_map(
        |(customize, depth, unmarked, springs, skin_thickness_mm, marking_sigma_px, remove_head_motion)| Settings {
            customize,
            depth,
            unmarked,
            skin_thickness_mm,
            springs,
            marking_sigma_px,
            remove_head_motion,
            ..Settings::default()
        },
    )
}

/// Any project that the edits could have made.
pub(crate) fn any_project() -> impl Strategy<Value = Project> {
    let role = prop_oneof![Just(Role::Skin), Just(Role::Still), Just(Role::Fixed)];
    let feature = (prop::option::of(any_mark()), prop::option::of(any_mark()), role)
        .prop_map(|(first, last, role)| Feature { first, last, role });
    let frames = (prop::option::of(any_frame()), prop::option::of(any_frame()))
        .prop_map(|(first, last)| FramePair { first, last });
    let face = prop_oneof![
        Just(FaceSource::Generic),
        ("[^\0]{1,9}", "[0-9a-f]{64}").prop_map(|(path, sha256)| FaceSource::File { path, sha256 })
    ];
    let camera = (150.0..1e5, -1e3..1e3, prop::option::of(any_position())).prop_map(|(d, z, c)| CameraSettings {
        distance_mm: d,
        view_plane_z_mm: z,
        principal_point_px: c,
    });
    let said = (any::<String>(), any::<String>());
    let marks = (
        prop::collection::btree_map("[a-z_]{1,12}", any_mark(), 0..5),
        prop::collection::btree_map(0..u32::MAX, feature, 0..6),
        prop::collection::btree_map(0..u32::MAX, any_position(), 0..3),
    );
    (said, frames, face, camera, any_scale(), marks, any_settings()).prop_map(
        |((name, notes), frames, face, camera, scale, (landmarks, features, repeats), settings)| Project {
            name,
            frames,
            face,
            camera,
            scale,
            landmarks,
            features,
            repeats,
            settings,
            notes,
        },
    )
}

/// A small project that uses every kind of field.
fn sample() -> Vec<u8> {
    let mut p = Project { name: "Ünïcode \"name\"\n".into(), ..Project::default() };
    let frame = FrameRef { path: "a/b.png".into(), sha256: "0f".repeat(32), width_px: 100, height_px: 200 };
    p.frames.first = Some(frame.clone());
    p.frames.last = Some(frame);
    p.scale = Scale::GridPitch { a_px: [1.0, 2.0], b_px: [3.5, 4.0], cells: 3.0, pitch_mm: 8.0 };
    p.landmarks.insert("nose_tip".into(), Mark::new([50.125, 60.0]));
    let last = Mark { state: MarkState::Uncertain, sigma_px: Some(0.3), ..Mark::new([1.0 / 3.0, 2e-7]) };
    p.features.insert(17, Feature { last: Some(last), role: Role::Still, ..Feature::default() });
    to_bytes(here(), &p).unwrap()
}

proptest! {
    /// What is saved comes back exactly, bit for bit of every number.
    #[test]
    fn a_round_trip_is_exact(project in any_project()) {
        prop_assume!(faults::of_values(&project).is_empty());
        let bytes = to_bytes(here(), &project).unwrap();
        let back = parse(here(), &bytes).unwrap();
        prop_assert_eq!(&back, &project);
        prop_assert_eq!(to_bytes(here(), &back).unwrap(), bytes);
    }

    /// Whatever bytes are changed, the answer is a project or one line; a project that was accepted can be saved again.
    #[test]
    fn damaged_bytes_never_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..3), 1..6)) {
        let mut bytes = sample();
        for (at, byte, how) in changes {
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => { bytes.remove(at); }
            }
        }
        match parse(here(), &bytes) {
            Ok(project) => if faults::of_values(&project).is_empty() {
                let again = to_bytes(here(), &project).unwrap();
                prop_assert_eq!(parse(here(), &again).unwrap(), project);
            },
            Err(e) => prop_assert!(!e.to_string().is_empty()),
        }
    }
}

#[test]
fn every_truncation_is_refused() {
    let bytes = sample();
    // The last byte is the line's end, without which the text is still whole.
    for length in 0..bytes.len() - 1 {
        assert!(parse(here(), &bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn the_version_is_read_first_and_a_newer_one_never_half_read() {
    let line = refusal("{\"something\": [], \"frontalis_project\": 3}");
    assert_eq!(
        line,
        "a.frontalis.json: made by a newer Frontalis (format 3, this one reads up to 1): update Frontalis"
    );
    assert!(refusal("{}").contains("is not a Frontalis project (it has no field `frontalis_project`)"));
    assert!(refusal("{\"frontalis_project\": 0}").contains("versions begin at 1"));
    assert!(
        refusal("{\"frontalis_project\": \"1\"}").contains("line 1, column 25, field frontalis_project: invalid type")
    );
    assert!(refusal("[1, 2]").contains("line 1") && refusal("[1]").contains("expected a project"));
    assert!(refusal("").contains("EOF"));
}

#[test]
fn a_refusal_names_the_line_the_field_and_the_reason() {
    let with = |fields: &str| {
        refusal(&format!(
            "{{\"frontalis_project\": 1, \"name\": \"\", \"frames\": {{\"first\": null, \"last\": null}},\n{fields}}}"
        ))
    };
    let unknown = with("\"colour\": 3");
    assert!(unknown.contains("line 2, column 8") && unknown.contains("unknown field `colour`"), "{unknown}");
    let deep = with("\"features\": {\"17\": {\"last\": {\"at_px\": [1.0, \"x\"]}}}");
    assert!(deep.contains("line 2") && deep.contains("field features.17.last.at_px[1]"), "{deep}");
    let vertex = with("\"features\": {\"-1\": {}}");
    assert!(vertex.contains("features.-1"), "{vertex}");
    let twice = with("\"notes\": \"a\", \"notes\": \"b\"");
    assert!(twice.contains("`notes` stands twice"), "{twice}");
    let mark_twice = with("\"features\": {\"17\": {}, \"17\": {}}");
    assert!(mark_twice.contains("`17` stands twice"), "{mark_twice}");
    let nan = with("\"camera\": {\"distance_mm\": NaN}");
    assert!(nan.contains("line 2, column"), "{nan}");
    let huge = with("\"camera\": {\"distance_mm\": 1e999}");
    assert!(huge.contains("number out of range"), "{huge}");
    let near = with("\"camera\": {\"distance_mm\": 3.0}, \"landmarks\": {\"a\": {\"at_px\": [1e9, 0.0]}}");
    assert!(near.contains("camera: the distance of the camera must be at least 150 mm, and it is 3"), "{near}");
    assert!(near.contains("(and 1 more: `frontalis check a.frontalis.json` lists them)"), "{near}");
}

#[test]
fn deep_nesting_and_huge_files_are_refused() {
    assert!(refusal(&"[".repeat(100_000)).contains("line 1"));
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("huge.json");
    fs::File::create(&path).unwrap().set_len(MAX_BYTES + 1).unwrap();
    assert!(matches!(load(&path), Err(ProjectFileError::TooLarge { .. })));
    assert!(matches!(load(dir.path()), Err(ProjectFileError::Read { .. })));
    fs::write(&path, [b'{', 0xff]).unwrap();
    assert!(matches!(load(&path), Err(ProjectFileError::NotText { at: 1, .. })));
}

#[test]
fn saving_keeps_the_former_copy_and_never_overwrites_what_it_cannot_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("p.frontalis.json");
    let bak = dir.path().join("p.frontalis.json.bak");
    let named = |name: &str| Project { name: name.into(), ..Project::default() };
    save(&named("one"), &path).unwrap();
    assert!(!bak.exists());
    save(&named("two"), &path).unwrap();
    save(&named("two"), &path).unwrap();
    assert_eq!(load(&path).unwrap(), named("two"));
    assert_eq!(load(&bak).unwrap(), named("one"));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);

    for foreign in ["{\"frontalis_project\": 2}", "not a project"] {
        fs::write(&path, foreign).unwrap();
        assert!(matches!(save(&named("three"), &path), Err(ProjectFileError::WouldOverwrite { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), foreign);
    }
    let under_a_file = path.join("p.frontalis.json");
    let line = save(&named("four"), &under_a_file).unwrap_err().to_string();
    assert!(line.contains("cannot be written") && !line.contains('\n'), "{line}");
}

#[test]
fn a_project_that_could_not_be_read_back_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("p.frontalis.json");
    let mut p = Project::default();
    p.landmarks.insert("a".into(), Mark::new([f64::NAN, 0.0]));
    assert!(matches!(save(&p, &path), Err(ProjectFileError::Value { .. })));
    assert!(!path.exists());
}

#[test]
fn numbers_stand_on_one_line_and_the_version_first() {
    let text = String::from_utf8(sample()).unwrap();
    assert!(text.starts_with("{\n  \"frontalis_project\": 1,\n"), "{text}");
    assert!(text.contains("\"at_px\": [50.125, 60.0]"), "{text}");
}
