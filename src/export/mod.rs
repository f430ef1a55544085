//! Marks and results as files for other programs. Each writer makes a text; the shell puts it on disk.

pub mod coco;
pub mod csv;
pub mod document;
pub mod expression;
pub mod expression_plate;
pub mod face_paint;
pub mod face_plate;
pub mod height_map;
pub mod homologous;
pub mod muscle_report;
pub mod muscle_tables;
pub mod muscles;
pub mod obj;
pub mod replay;
pub mod replay_picture;
pub mod report;
pub mod study_chart;
pub mod study_files;
pub mod study_ladder;
pub mod study_maps;
pub mod study_scaling;
pub mod subjects;
pub mod tps;
pub mod vtk;

pub use tps::NoFrame;

/// A picture as the bytes of a PNG file.
pub fn png(picture: &image::RgbImage) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// A hand-made scene for the tests of this room: one triangle, 4 px/mm, two vertices marked and one unmeasured.
#[cfg(test)]
pub(crate) fn scene_of_one_triangle() -> (crate::project::Project, crate::face::FaceModel, crate::pipeline::Outcome) {
    use crate::camera::{Camera, HeadMotion, Scale};
    use crate::displacement::VertexState;
    use crate::face::{FaceModel, FaceParts, Landmark, Mesh};
    use crate::pipeline::{ForceField, LandmarkFit, Outcome};
    use crate::project::{Feature, FrameRef, Mark, MarkState, Project};
    use nalgebra::{Point2, Point3, Vector3};

    let first = vec![Point3::origin(), Point3::new(10.0, 0.0, 0.0), Point3::new(0.0, 10.0, 0.0)];
    let mesh = Mesh::new(first.clone(), vec![[0, 1, 2]]).unwrap();
    let landmark = Landmark { id: "nose_tip".into(), name: "Tip, of the \"nose\"".into(), ..Landmark::default() };
    let parts = FaceParts {
        name: "One triangle".into(),
        landmarks: vec![landmark],
        mirror: vec![None; 3],
        ..FaceParts::default()
    };
    let face = FaceModel::new(mesh, parts).unwrap();

    let mut project = Project { name: "One triangle".into(), ..Project::default() };
    let frame = |path: &str| FrameRef { path: path.into(), sha256: "0".repeat(64), width_px: 400, height_px: 300 };
    project.frames.first = Some(frame("first.png"));
    project.frames.last = Some(frame("last.png"));
    project.scale = Scale::InnerEyeCorners { mm: 30.0 };
    project.landmarks.insert("nose_tip".into(), Mark::new([100.5, 200.0]));
    let marked = |at_px, state, sigma_px| Feature { last: Some(Mark { at_px, state, sigma_px }), ..Feature::default() };
    project.features.insert(0, marked([104.5, 200.0], MarkState::Uncertain, Some(0.5)));
    project.features.insert(1, marked([150.0, 210.0], MarkState::Occluded, None));

    let in_image = vec![Point2::new(100.5, 200.0), Point2::new(149.0, 210.0), Point2::new(100.5, 160.0)];
    let outcome = Outcome {
        camera: Camera {
            principal_point_px: Point2::new(200.0, 150.0),
            z_prp_mm: 1000.0,
            z_vp_mm: 0.0,
            px_per_mm: 4.0,
        },
        scale_measured: true,
        fit: LandmarkFit { placed: 1, of: 1, scale: [1.0; 3], ..LandmarkFit::default() },
        first_in_image: in_image.clone(),
        head: HeadMotion::default(),
        states: vec![VertexState::Measured, VertexState::Inferred, VertexState::Unmeasured],
        border: vec![true, false, false],
        last: vec![Point3::new(1.0, 0.0, 0.0), Point3::new(11.0, 0.0, 0.0), Point3::new(0.5, 10.0, 0.0)],
        last_in_image: in_image,
        field: ForceField {
            force: vec![Vector3::new(3.0, 4.0, 0.0), Vector3::new(-3.0, -4.0, 0.0), Vector3::zeros()],
            sigma: vec![0.25, 0.5, 0.0],
            normal: vec![0.0; 3],
            tangential: vec![5.0, 5.0, 0.0],
            depth_change: vec![0.125, 0.25, 0.0],
            internal_sum: Vector3::zeros(),
            outside_table: vec![false; 3],
            strain: vec![Some(0.1), None, None],
            folded: Vec::new(),
        },
        first,
        muscles: None,
        smoothing: None,
        warnings: Vec::new(),
    };
    (project, face, outcome)
}
