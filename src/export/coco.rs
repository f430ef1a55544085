//! Marks as COCO keypoints: one picture and one annotation a frame, what the hand has set and nothing else.
//!
//! COCO counts pixels from 0 at their centres, so that `x_coco = x − 0.5`; the bounding box is COCO's continuous one, whose
//! origin is the picture's corner, and keeps our coordinates. Visibility: 0 unset, 1 occluded, 2 marked.

use serde::Serialize;

use super::homologous::{SharedPoint, points};
use super::tps::{NoFrame, frame_of};
use crate::face::FaceModel;
use crate::pipeline::Outcome;
use crate::project::{Mark, Project, Which};

#[derive(Serialize)]
struct Document {
    info: Info,
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: [Category; 1],
    licenses: [(); 0],
}

#[derive(Serialize)]
struct Info {
    description: String,
    version: &'static str,
    coordinates: &'static str,
}

#[derive(Serialize)]
struct Image {
    id: u32,
    file_name: String,
    width: u32,
    height: u32,
}

#[derive(Serialize)]
struct Annotation {
    id: u32,
    image_id: u32,
    category_id: u32,
    keypoints: Vec<f64>,
    num_keypoints: usize,
    bbox: [f64; 4],
    area: f64,
    iscrowd: u8,
}

#[derive(Serialize)]
struct Category {
    id: u32,
    name: &'static str,
    supercategory: &'static str,
    keypoints: Vec<String>,
    skeleton: Vec<[usize; 2]>,
}

/// The COCO text. The skeleton joins points whose vertices share an edge of the face.
pub fn coco(project: &Project, face: &FaceModel, outcome: &Outcome) -> Result<String, NoFrame> {
    let points = points(project, face, outcome);
    let frames = [(1, Which::First), (2, Which::Last)];
    let images = frames
        .iter()
        .map(|&(id, which)| {
            let f = frame_of(project, which)?;
            Ok(Image { id, file_name: f.path.clone(), width: f.width_px, height: f.height_px })
        })
        .collect::<Result<_, NoFrame>>()?;
    let document = Document {
        info: Info {
            description: project.name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            coordinates: "keypoints: 0 is the centre of the top-left pixel; bbox: 0 is its top-left corner",
        },
        images,
        annotations: frames.iter().map(|&(id, which)| annotation(id, which, &points)).collect(),
        categories: [Category {
            id: 1,
            name: "face",
            supercategory: "person",
            keypoints: points.iter().map(|p| p.name.clone()).collect(),
            skeleton: skeleton(face, &points),
        }],
        licenses: [],
    };
    // Strings, finite numbers and lists: nothing here can fail to be written.
    Ok(serde_json::to_string_pretty(&document).unwrap_or_default() + "\n")
}

fn annotation(id: u32, which: Which, points: &[SharedPoint]) -> Annotation {
    let mark_of = |p: &SharedPoint| if which == Which::First { p.first } else { p.last };
    let marks: Vec<Option<Mark>> = points.iter().map(mark_of).collect();
    let keypoints = marks
        .iter()
        .flat_map(|mark| match mark {
            Some(Mark { at_px: [x, y], state, .. }) => [x - 0.5, y - 0.5, if state.is_data() { 2.0 } else { 1.0 }],
            None => [0.0, 0.0, 0.0],
        })
        .collect();
    let set: Vec<[f64; 2]> = marks.iter().flatten().map(|m| m.at_px).collect();
    let low = |axis: usize| set.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
    let high = |axis: usize| set.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
    let bbox = if set.is_empty() { [0.0; 4] } else { [low(0), low(1), high(0) - low(0), high(1) - low(1)] };
    Annotation {
        id,
        image_id: id,
        category_id: 1,
        keypoints,
        num_keypoints: set.len(),
        bbox,
        area: bbox[2] * bbox[3],
        iscrowd: 0,
    }
}

/// Pairs of points, counted from 1, whose vertices share an edge.
fn skeleton(face: &FaceModel, points: &[SharedPoint]) -> Vec<[usize; 2]> {
    let place: std::collections::BTreeMap<u32, usize> =
        points.iter().enumerate().map(|(i, p)| (p.vertex, i + 1)).collect();
    let edges = face.mesh().edges().iter();
    edges.filter_map(|[a, b]| Some([*place.get(a)?, *place.get(b)?])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;

    #[test]
    fn half_a_pixel_is_taken_and_visibility_tells_unset_occluded_and_marked() {
        let (project, face, outcome) = scene_of_one_triangle();
        let json: serde_json::Value = serde_json::from_str(&coco(&project, &face, &outcome).unwrap()).unwrap();
        assert_eq!(json["categories"][0]["keypoints"], serde_json::json!(["nose_tip", "vertex_1"]));
        assert_eq!(json["categories"][0]["skeleton"], serde_json::json!([[1, 2]]));
        assert_eq!(json["annotations"][0]["keypoints"], serde_json::json!([100.0, 199.5, 2.0, 0.0, 0.0, 0.0]));
        assert_eq!(json["annotations"][1]["keypoints"], serde_json::json!([104.0, 199.5, 2.0, 149.5, 209.5, 1.0]));
        assert_eq!(json["annotations"][1]["num_keypoints"], 2);
        assert_eq!(json["annotations"][1]["bbox"], serde_json::json!([104.5, 200.0, 45.5, 10.0]));
        assert_eq!(json["images"][1]["file_name"], "last.png");
    }
}
