//! Laws fitted to forces by every optimiser and tolerance, and the face customised by every morph.

use std::sync::{Arc, OnceLock};

use super::super::kind::Options;
use super::super::law_trial::{self, Scene, SweepRow, TOLERANCES};
use super::super::people::{PeopleSettings, customised_people};
use super::super::runner::Case;
use super::super::table::Run;
use super::{case, run};
use crate::customize::{AlignRule, CustomizeSettings, MorphRule};
use crate::muscle::{LawKind, MuscleLaw};

/// Forces of this height stand for the forehead, mm.
const ABOVE_MM: f64 = 15.0;
/// Seed of the starts.
const SEED: u64 = 9;

pub(super) fn cases(options: &Options, seeds: u64) -> Vec<Case> {
    let mut cases = laws(options, seeds);
    cases.extend(faces(options, seeds));
    cases
}

fn laws(options: &Options, seeds: u64) -> Vec<Case> {
    let swept: Arc<OnceLock<Result<Vec<SweepRow>, String>>> = Arc::default();
    let mut cases = Vec::new();
    for (method, _) in law_trial::methods(TOLERANCES[0]) {
        for tolerance in TOLERANCES {
            let setting = format!("tolerance={tolerance:.0e}");
            let (face, swept, of) = (Arc::clone(&options.face), Arc::clone(&swept), setting.clone());
            let work = move || {
                let rows = swept.get_or_init(|| {
                    let scene = Scene::frontalis(&face, ABOVE_MM).map_err(|e| e.to_string())?;
                    Ok(law_trial::sweep(&scene, &MuscleLaw::default_of(LawKind::Anatomical), 0.0, seeds, SEED))
                });
                let row = || Run { vertices: face.mesh().len(), ..run(8, method, &of) };
                let own = |r: &&SweepRow| r.method == method && r.tolerance == tolerance;
                let one = |r: &SweepRow| {
                    let row = Run { seed: r.seed, ..row() }.timed(r.time_ms);
                    // A fit without any error has none that a logarithm shows: it is rounding.
                    let row = r.force_error.map_or(row.clone(), |e| row.erring(e.max(f64::EPSILON)));
                    row.failing((r.status == "failed").then(|| r.cause.clone()))
                };
                match rows {
                    Ok(rows) => rows.iter().filter(own).map(one).collect(),
                    Err(why) => vec![row().failing(Some(why.clone()))],
                }
            };
            cases.push(case(8, method, &setting, work).weighing(0.05));
        }
    }
    cases
}

/// The ways to customise, by name.
fn morphs() -> [(&'static str, CustomizeSettings); 4] {
    let of = |align, morph| CustomizeSettings { align, morph, ..CustomizeSettings::default() };
    [
        ("Thesis: scale by ranges, NNWA", CustomizeSettings::thesis()),
        ("Pose, NNWA", of(AlignRule::Pose, MorphRule::Nnwa)),
        ("Scale by ranges, radial", of(AlignRule::Thesis, MorphRule::Radial)),
        ("Pose, radial", of(AlignRule::Pose, MorphRule::Radial)),
    ]
}

fn faces(options: &Options, seeds: u64) -> Vec<Case> {
    let noises: &[f64] = if options.quick { &[0.0, 2.0] } else { &[0.0, 1.0, 2.0, 4.0] };
    let mut cases = Vec::new();
    for &noise_px in noises {
        for (name, settings) in morphs() {
            let face = Arc::clone(&options.face);
            let work = move || {
                let one = |seed: u64| {
                    let people = PeopleSettings { people: 6, seed, noise_px, ..PeopleSettings::default() };
                    let row = run(9, name, "people=6");
                    let row = Run { noise_px, vertices: face.mesh().len(), seed, ..row };
                    match customised_people(&face, &people, &settings) {
                        Ok(r) if r.people == 0 => row.failing(Some("no face has the proportions drawn".to_owned())),
                        Ok(r) => row
                            .erring(r.edge_error)
                            .timed(r.time_ms)
                            .with("in_plane_mm", r.in_plane_mm)
                            .with("in_depth_mm", r.in_depth_mm)
                            .with("folded_people", r.folded_people as f64),
                        Err(e) => row.failing(Some(e.to_string())),
                    }
                };
                (1..=seeds).map(one).collect()
            };
            cases.push(case(9, name, &format!("{noise_px} px"), work).weighing(0.1));
        }
    }
    cases
}
