//! Batches: many small projects over the cores of one machine, each solved whole by one of them.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::scene;
use super::super::table::{Run, setting};
use super::super::twin::{Twin, TwinSettings};
use super::{BATCH, STUDY};
use crate::face::FaceModel;
use crate::pipeline::{self, Workspace};
use crate::project::Project;

const METHOD: &str = "solve, whole project";

/// The cases: the same batch over one core, two, and so on in doubles up to all.
pub(super) fn cases(options: &Options) -> Vec<Case> {
    let projects = if options.quick { 40 } else { 200 };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let mut counts: Vec<usize> = (0..16).map(|k| 1 << k).filter(|n| *n < cores).collect();
    counts.push(cores);
    let case = |threads: usize| {
        let face = Arc::clone(&options.face);
        let name = format!("batch of {projects} over {threads}");
        Case::timed(name, move || vec![solved(&face, projects, threads)]).weighing(2.0)
    };
    counts.into_iter().map(case).collect()
}

fn solved(face: &FaceModel, projects: usize, threads: usize) -> Run {
    let at = setting(&[("threads", threads as f64), ("projects", projects as f64)]);
    let row = Run { vertices: face.mesh().len(), seed: 1, ..Run::new(STUDY, BATCH, METHOD, at) };
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else {
        return row.failing(Some("no threads".to_owned()));
    };
    let made: Result<Vec<Project>, String> =
        pool.install(|| (1..=projects as u64).into_par_iter().map(|seed| project(face, seed)).collect());
    let made = match made {
        Ok(made) => made,
        Err(e) => return row.failing(Some(e)),
    };
    let solve = |p: &Project| pipeline::solve(p, face, [1036, 1036], &mut Workspace::default()).states.len();
    // Once for the caches, then for the time.
    let pass = || pool.install(|| made.par_iter().map(solve).sum::<usize>());
    pass();
    let begun = Instant::now();
    let known = pass();
    let ms = begun.elapsed().as_secs_f64() * 1e3;
    row.timed(ms).with("per_project_ms", ms / projects as f64).with("vertices_solved", known as f64)
}

/// A twin's project with half a pixel of marking noise.
fn project(face: &FaceModel, seed: u64) -> Result<Project, String> {
    let settings = TwinSettings { seed, noise_px: 0.5, ..TwinSettings::default() };
    let person = scene::person(face, seed, settings.distance_mm).map_err(|e| e.to_string())?;
    let twin = Twin::generate(&person, &settings).map_err(|e| e.to_string())?;
    Ok(scene::project(&twin, &person, scene::unseen_frames(settings.size_px), 0.5))
}
