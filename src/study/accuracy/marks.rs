//! Marks that the program finds itself: how near snapping, templates and tracking come to the truth, and how long a point takes.

use std::sync::{Arc, OnceLock};

use super::super::kind::Options;
use super::super::marking_trial::{Sample, Scene, TEMPLATES_MM, Way, measure};
use super::super::points::median;
use super::super::runner::Case;
use super::super::table::Run;
use super::{case, run};
use crate::face::FaceModel;

/// The part of the study.
const PART: usize = 10;
/// Side of the frames, px.
const SIZE: u32 = 1036;
/// Scenes of each skin: every one holds hundreds of points.
const MOST_SEEDS: u64 = 5;
/// A mark within this distance serves smoothing well, px.
const NEAR_PX: f64 = 0.5;

/// A scene, tried in every way at once.
struct Tried {
    samples: Vec<Sample>,
    /// How far the points move between the frames, px, root mean square: what an error is measured against.
    motion_px: f64,
}

type Scenes = Arc<Vec<OnceLock<Result<Tried, String>>>>;

fn tried(face: &FaceModel, grid: bool, seed: u64) -> Result<Tried, String> {
    let scene = Scene::make(face, seed, grid, SIZE).map_err(|e| e.to_string())?;
    let twin = &scene.twin;
    let squares = twin.first_in_image.iter().zip(&twin.last_in_image).map(|(a, b)| (b - a).norm_squared());
    let motion_px = (squares.sum::<f64>() / twin.first_in_image.len().max(1) as f64).sqrt();
    Ok(Tried { samples: measure(&scene), motion_px })
}

/// The ways to a mark on one kind of skin: crossings are only where lines are painted.
fn ways(grid: bool) -> Vec<Way> {
    let crossings: &[Way] = if grid { &[Way::SnappedFirst, Way::SnappedLast, Way::TrackedCrossing] } else { &[] };
    let templates = TEMPLATES_MM.map(|mm| Way::Template((10.0 * mm) as u32));
    crossings.iter().copied().chain([Way::TrackedVertex]).chain(templates).collect()
}

pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let seeds = seeds.min(MOST_SEEDS);
    let mut cases = Vec::new();
    for (grid, setting) in [(true, "grid=painted"), (false, "grid=none")] {
        let scenes: Scenes = Arc::new((0..seeds).map(|_| OnceLock::new()).collect());
        for way in ways(grid) {
            let (face, scenes) = (Arc::clone(&options.face), Arc::clone(&scenes));
            let work = move || {
                let rows = scenes.iter().zip(1..).map(|(slot, seed)| {
                    let row = Run { vertices: face.mesh().len(), seed, ..run(PART, &way.name(), setting) };
                    match slot.get_or_init(|| tried(&face, grid, seed)) {
                        Ok(tried) => measured(tried, way, row),
                        Err(why) => row.failing(Some(why.clone())),
                    }
                });
                rows.collect()
            };
            cases.push(case(PART, &way.name(), setting, work).weighing(0.1));
        }
    }
    cases
}

fn measured(tried: &Tried, way: Way, row: Run) -> Run {
    let own: Vec<&Sample> = tried.samples.iter().filter(|s| s.way == way).collect();
    let mut errors: Vec<f64> = own.iter().filter_map(|s| s.error_px).collect();
    let Some(median_px) = median(&mut errors) else {
        return row.failing(Some("no point was found".to_owned()));
    };
    let asked = own.len() as f64;
    let mean_ms = own.iter().map(|s| s.time_us).sum::<f64>() / asked / 1e3;
    let near = errors.iter().filter(|e| **e < NEAR_PX).count() as f64;
    row.erring(median_px / tried.motion_px)
        .timed(mean_ms)
        .with("points", asked)
        .with("median_px", median_px)
        .with("within_half_px_percent", 100.0 * near / asked)
        .with("not_found_percent", 100.0 * (asked - errors.len() as f64) / asked)
}
