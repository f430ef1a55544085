//! Marks as COCO keypoints: 0 is the centre of the top-left pixel, so that `x = x_coco + 0.5`; visibility 0 unset, 1 occluded, 2 marked.

use serde::Deserialize;

use super::{Names, Wrong, frame_of};
use crate::project::{MarkState, Project};

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: i64,
    #[serde(default)]
    file_name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: i64,
    category_id: i64,
    #[serde(default)]
    keypoints: Vec<f64>,
}

#[derive(Deserialize)]
struct Category {
    id: i64,
    #[serde(default)]
    keypoints: Vec<String>,
}

/// Reads the text: the first annotation of each of two pictures.
pub(super) fn read(text: &str, project: &Project, names: &mut Names<'_>) -> Result<(), Wrong> {
    let document: Document = serde_json::from_str(text).map_err(|e| {
        let said = e.to_string();
        let reason = said.split(" at line ").next().unwrap_or_default();
        Wrong::in_line(e.line().max(1), format!("column {}: {reason}; a COCO keypoint file was expected", e.column()))
    })?;
    for (i, annotation) in document.annotations.iter().enumerate() {
        let here = format!("annotation {}", i + 1);
        let image = document.images.iter().position(|m| m.id == annotation.image_id);
        let file_name = image.and_then(|at| document.images.get(at)).map_or("", |m| m.file_name.as_str());
        let Some(which) = frame_of(project, file_name, image.unwrap_or(i)) else {
            names.import.passed_over.push(format!("{here}: its picture is neither frame of the project"));
            continue;
        };
        let category = document.categories.iter().find(|c| c.id == annotation.category_id);
        let keypoints =
            &category.ok_or_else(|| Wrong::whole(format!("{here}: its category is not in the file")))?.keypoints;
        if annotation.keypoints.len() != 3 * keypoints.len() {
            let numbers = annotation.keypoints.len();
            let reason =
                format!("{here}: {numbers} numbers for {} keypoints; three each were expected", keypoints.len());
            return Err(Wrong::whole(reason));
        }
        for (name, numbers) in keypoints.iter().zip(annotation.keypoints.as_chunks::<3>().0) {
            let [x, y, visibility] = *numbers;
            let state = match visibility {
                0.0 => continue,
                1.0 => MarkState::Occluded,
                2.0 => MarkState::Marked,
                other => return Err(Wrong::whole(format!("{here}, {name}: visibility {other}; it is 0, 1 or 2"))),
            };
            let added = names.add(which, name, [x + 0.5, y + 0.5], state, &here);
            added.map_err(|reason| Wrong::whole(format!("{here}: {reason}")))?;
        }
    }
    Ok(())
}
