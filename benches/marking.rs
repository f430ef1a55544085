//! Time and error of everything that finds points in pictures, on rendered scenes of known truth.
//!
//! `cargo bench --no-default-features --bench marking` prints the times on one scene with a painted grid and one without.
//! `cargo bench --no-default-features --bench marking -- 100 DIR` tries a hundred seeds and writes `marking.csv`, `marking.svg`,
//! `marking.png` and `marking.md` to a folder.
//! `cargo bench --no-default-features --bench marking -- expressions 5 FILE.md` tries whole faces of five seeds that open the mouth.
//! `cargo bench --no-default-features --bench marking -- films 4 FILE.md` tries raised brows of four seeds as a film's coder leaves them.

use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use frontalis::draw::svg;
use frontalis::expression::Basic;
use frontalis::face;
use frontalis::frames::Compression;
use frontalis::marking::Gray;
use frontalis::marking::tracking::{Point, Prepared, TrackSettings, track};
use frontalis::study::marking_trial::{self, Bin, Sample, Scene, TrialError, Way};
use frontalis::study::wish::Wish;
use rayon::prelude::*;

const SIZE_PX: u32 = 1036;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    match asked.as_slice() {
        [what, seeds, file] if what == "expressions" => expressions(seeds.parse()?, Path::new(file)),
        [what, seeds, file] if what == "films" => films(seeds.parse()?, Path::new(file)),
        [seeds, folder] => trial(seeds.parse()?, Path::new(folder)),
        _ => times(),
    }
}

/// Least and median time of the stages on two scenes.
fn times() -> Result<(), Box<dyn std::error::Error>> {
    let generic = face::generic();
    println!("{} threads; {SIZE_PX} × {SIZE_PX} px", rayon::current_num_threads());
    for grid in [true, false] {
        let scene = Scene::make(&generic, 1, grid, SIZE_PX)?;
        let named = |what: &str| format!("{what}, {}", if grid { "painted grid" } else { "bare skin" });
        let frames = &scene.frames;
        report(&named("prepare a picture"), 1, || Gray::of(&frames[0]).map(Prepared::of).is_some());
        let pictures: Vec<Prepared> = frames.iter().filter_map(Gray::of).map(Prepared::of).collect();
        let [first, last] = pictures.as_slice() else { continue };
        // 600 points of the face's skin: the vertices, some of them turned away.
        let points: Vec<Point> = scene.twin.first_in_image.iter().take(600).map(|p| Point::at(*p)).collect();
        let settings = TrackSettings { px_per_mm: scene.twin.camera.px_per_mm, ..TrackSettings::default() };
        report(&named("track 600 points"), points.len(), || {
            !track(first, last, &points, &scene.skin(), &settings).points.is_empty()
        });
    }
    Ok(())
}

fn report(name: &str, points: usize, mut work: impl FnMut() -> bool) {
    let mut times: Vec<Duration> = Vec::new();
    for _ in 0..12 {
        let start = Instant::now();
        std::hint::black_box(work());
        times.push(start.elapsed());
    }
    times.sort_unstable();
    let ms = |t: Duration| t.as_secs_f64() * 1e3;
    let (least, median) = (ms(times[0]), ms(times[times.len() / 2]));
    println!(
        "{name:<40} least {least:>8.2} ms   median {median:>8.2} ms   {:>8.1} µs a point",
        1e3 * least / points as f64
    );
}

fn trial(seeds: u64, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let generic = face::generic();
    // Scenes are drawn side by side; what is timed runs alone afterwards, scene by scene.
    let mut samples: Vec<Sample> = Vec::new();
    let all: Vec<(u64, bool)> = (0..seeds).flat_map(|seed| [(seed, true), (seed, false)]).collect();
    for some in all.chunks(2 * rayon::current_num_threads()) {
        let scenes: Result<Vec<Scene>, _> =
            some.par_iter().map(|(seed, grid)| Scene::make(&generic, *seed, *grid, SIZE_PX)).collect();
        for scene in scenes? {
            samples.extend(marking_trial::measure(&scene));
        }
        println!("seed {} done", some.last().map_or(0, |s| s.0));
    }
    let summaries = marking_trial::summaries(&samples);
    let chart = marking_trial::chart(&summaries, seeds as usize);
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("marking.csv"), marking_trial::csv(&samples))?;
    std::fs::write(folder.join("marking.svg"), &chart)?;
    svg::paint(&chart, 1.0)?.save(folder.join("marking.png"))?;
    std::fs::write(folder.join("marking.md"), reading(&samples))?;
    Ok(())
}

/// Whole faces in four expressions, with lips and lids apart: what tracking finds, one row an expression and skin.
fn expressions(seeds: u64, file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let generic = face::generic();
    let mut text = String::from(
        "| expression | skin | points | not found | median, px | 95 % within, px | < 0.15 px | < 0.5 px | < 1 px | called 0.9 and more | of these < 1 px | crossings of another |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for basic in [Basic::Surprise, Basic::Happy, Basic::Disgust, Basic::Fear] {
        let wish = Wish::Basic(basic);
        let tried: Result<Vec<Vec<Sample>>, TrialError> = (0..seeds)
            .into_par_iter()
            .map(|seed| {
                let scenes = Scene::expressing(&generic, wish, seed, SIZE_PX)?;
                Ok(scenes.iter().flat_map(marking_trial::measure_tracking).collect())
            })
            .collect();
        let samples: Vec<Sample> = tried?.into_iter().flatten().collect();
        let (mistaken, told) = marking_trial::identities(&samples);
        let samples: Vec<Sample> = samples.into_iter().filter(|s| s.way == Way::TrackedVertex).collect();
        for s in marking_trial::summaries(&samples) {
            let sure = Bin::of(&samples, s.grid, [0.9, 1.0]);
            let _ = writeln!(
                text,
                "| {} | {} | {} | {:.1} % | {:.3} | {:.3} | {:.1} % | {:.1} % | {:.1} % | {} | {:.1} % | {} |",
                wish.word(),
                if s.grid { "grid" } else { "bare" },
                s.count,
                100.0 * s.failed as f64 / s.count.max(1) as f64,
                s.median_px,
                s.p95_px,
                100.0 * s.within[0],
                100.0 * s.within[1],
                100.0 * s.within[2],
                sure.count,
                100.0 * sure.is,
                if s.grid { format!("{mistaken} of {told}") } else { String::new() }
            );
        }
        println!("{} done", wish.word());
    }
    std::fs::write(file, text)?;
    Ok(())
}

/// Sides of the frames that are filmed, px, and quantisers of the coder.
const FILMED_PX: [u32; 3] = [190, 400, 800];
const QUANTISERS: [u8; 3] = [18, 24, 30];

/// Raised brows as a film's coder leaves them: places and what is said of them, one row a size, a kind of frame, a quantiser and a skin.
fn films(seeds: u64, file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let generic = face::generic();
    let folder = tempfile::tempdir()?;
    let kinds = [Compression::Unknown, Compression::Intra, Compression::Inter];
    let coded = |kind| QUANTISERS.map(|q| (kind, q));
    let ways: Vec<(Compression, u8)> =
        [(kinds[0], 0)].into_iter().chain(coded(kinds[1])).chain(coded(kinds[2])).collect();
    let mut text = String::from(
        "| px/mm | frames | skin | points | not found | median, px | < 0.5 px | < 1 px | said, mean | called 0.85 to 0.95 | of these < 1 px | called 0.95 and more | of these < 1 px |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for size in FILMED_PX {
        for &(kind, quantiser) in &ways {
            let tried: Result<Vec<(f64, Vec<Sample>)>, TrialError> = (0..2 * seeds)
                .into_par_iter()
                .map(|k| {
                    let settings = marking_trial::filmed_settings(k / 2, k % 2 == 0, size);
                    let scene = Scene::with(&generic, &settings)?;
                    let path = folder.path().join(format!("{k}.mp4"));
                    let seen = match kind {
                        Compression::Unknown => scene,
                        kind => scene.filmed(kind, quantiser, &path)?,
                    };
                    Ok((seen.twin.camera.px_per_mm, marking_trial::measure_tracking(&seen)))
                })
                .collect();
            let tried = tried?;
            let scale = tried.iter().map(|t| t.0).sum::<f64>() / tried.len() as f64;
            let samples: Vec<Sample> = tried.into_iter().flat_map(|t| t.1).collect();
            let samples: Vec<Sample> = samples.into_iter().filter(|s| s.way == Way::TrackedVertex).collect();
            let named = match kind.words() {
                Some(words) => format!("{words}s, quantiser {quantiser}"),
                None => "not coded".to_owned(),
            };
            for s in marking_trial::summaries(&samples) {
                let [all, some, sure] =
                    [[0.0, 1.0], [0.85, 0.95], [0.95, 1.0]].map(|ends| Bin::of(&samples, s.grid, ends));
                let _ = writeln!(
                    text,
                    "| {scale:.2} | {named} | {} | {} | {:.1} % | {:.2} | {:.0} % | {:.0} % | {:.0} % | {} | {:.0} % | {} | {:.0} % |",
                    if s.grid { "grid" } else { "bare" },
                    s.count,
                    100.0 * s.failed as f64 / s.count.max(1) as f64,
                    s.median_px,
                    100.0 * s.within[1],
                    100.0 * s.within[2],
                    100.0 * all.said,
                    some.count,
                    100.0 * some.is,
                    sure.count,
                    100.0 * sure.is,
                );
            }
            println!("{size} px, {named} done");
        }
    }
    std::fs::write(file, text)?;
    Ok(())
}

/// The tables of the document.
fn reading(samples: &[Sample]) -> String {
    let mut text = String::from(
        "| way | skin | points | not found | median, px | 95 % within, px | RMS, px | < 0.15 px | < 0.5 px | < 1 px | time a point |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for s in marking_trial::summaries(samples) {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.1} % | {:.3} | {:.3} | {:.3} | {:.1} % | {:.1} % | {:.1} % | {:.0} µs |",
            s.way.name(),
            if s.grid { "grid" } else { "bare" },
            s.count,
            100.0 * s.failed as f64 / s.count.max(1) as f64,
            s.median_px,
            s.p95_px,
            s.rms_px,
            100.0 * s.within[0],
            100.0 * s.within[1],
            100.0 * s.within[2],
            s.time_us
        );
    }
    let (mistaken, told) = marking_trial::identities(samples);
    let _ = writeln!(text, "\nCrossings with the column and row of another: {mistaken} of {told}.\n");
    text.push_str("| confidence | grid: points | said | within 1 px | bare: points | said | within 1 px |\n|---|---|---|---|---|---|---|\n");
    let [with, without] = [true, false].map(|grid| marking_trial::reliability(samples, grid));
    for (a, b) in with.iter().zip(&without) {
        let _ = writeln!(
            text,
            "| {} – {} | {} | {:.1} % | {:.1} % | {} | {:.1} % | {:.1} % |",
            a.from,
            a.to,
            a.count,
            100.0 * a.said,
            100.0 * a.is,
            b.count,
            100.0 * b.said,
            100.0 * b.is
        );
    }
    text
}
