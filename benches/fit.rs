//! Time of fitting laws to a field, how often they are found again, and how far their intervals can be trusted.
//!
//! `cargo bench --no-default-features --bench fit` prints the times.
//! `cargo bench --no-default-features --bench fit -- 1000 DIR` also fits a thousand random starts and a thousand noisy draws of every law and
//! writes `fit_recovery.csv`, `fit_coverage.csv`, `fit_sweep.csv`, `fit.svg`, `fit.png` and `fit.md` to a folder.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use frontalis::displacement::regularised::WeightRule;
use frontalis::draw::line_chart::{Axis, COLOURS, HEADING, LineChart, Series, Style, Value, sheet};
use frontalis::draw::svg;
use frontalis::face::{self, FaceModel};
use frontalis::fit::{Compare, LawFitOptions, Method, compare_laws, fit_law};
use frontalis::muscle::{LawKind, MuscleLaw};
use frontalis::project::FieldWay;
use frontalis::study::law_marks::MarkedForehead;
use frontalis::study::law_trial::{
    Coverage, Recovery, Scene, SweepRow, TOLERANCES, coverage, methods, recovery, sweep, truths, with_noise,
    within_factor,
};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

type Anything = Result<(), Box<dyn std::error::Error>>;

/// The forehead with the brows begins here, mm.
const FOREHEAD_MM: f64 = 15.0;
const NOISES: [f64; 4] = [0.01, 0.05, 0.1, 0.2];

fn main() -> Anything {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    times()?;
    match asked.as_slice() {
        [draws, folder] => trials(draws.parse()?, Path::new(folder)),
        _ => Ok(()),
    }
}

/// Least and median time of one fit, from starts within a factor 3 of the truth, at 10 % noise.
fn times() -> Anything {
    let generic = face::generic();
    println!("one core; four fibres of the frontalis; 10 % noise; vectors; starts within a factor 3");
    println!("{:<52} least, ms  median, ms  evaluations", "");
    for above in [FOREHEAD_MM, f64::NEG_INFINITY] {
        let scene = Scene::frontalis(&generic, above)?;
        let mut count = 0;
        for (what, starts, variants) in
            [("one start", 1, false), ("until two starts agree", 8, false), ("and both readings", 8, true)]
        {
            for law in LawKind::ALL.map(MuscleLaw::default_of) {
                if variants && law.variants().len() == 1 {
                    continue;
                }
                let mut random = Pcg64Mcg::seed_from_u64(5);
                let samples = with_noise(&scene.field(&law), 0.1, &mut random);
                count = samples.len();
                let options = LawFitOptions { starts, variants, ..LawFitOptions::default() };
                let mut evaluations = 0;
                let mut spent: Vec<f64> = (0..200)
                    .map(|_| {
                        let start = within_factor(&law, 3.0, &mut random);
                        let began = Instant::now();
                        let fit = fit_law(&start, &scene.fibres, &samples, &options);
                        let ms = began.elapsed().as_secs_f64() * 1e3;
                        evaluations += fit.map_or_else(|f| f.evaluations, |f| f.evaluations);
                        ms
                    })
                    .collect();
                spent.sort_unstable_by(f64::total_cmp);
                let name = format!("{}, {what}, {count} vertices", law.kind().label());
                println!(
                    "{name:<52} {:>9.3}  {:>10.3}  {:>11.1}",
                    spent[0],
                    spent[100],
                    f64::from(evaluations as u32) / 200.0
                );
            }
        }
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let samples = with_noise(&scene.field(&MuscleLaw::default_of(LawKind::Anatomical)), 0.1, &mut random);
        for (what, starts, variants) in
            [("one start each, one reading", 1, false), ("until two starts agree, both readings", 8, true)]
        {
            let options = LawFitOptions { starts, variants, compare: Compare::Vectors, ..LawFitOptions::default() };
            let mut spent: Vec<f64> = (0..60)
                .filter_map(|_| compare_laws(&scene.fibres, &samples, &options).ok().map(|c| c.time_ms))
                .collect();
            spent.sort_unstable_by(f64::total_cmp);
            let name = format!("all four and a second lobe, {what}, {count}");
            println!("{name:<52} {:>9.3}  {:>10.3}", spent[0], spent[30]);
        }
    }
    Ok(())
}

fn trials(draws: usize, folder: &Path) -> Anything {
    let generic = face::generic();
    let scene = Scene::frontalis(&generic, FOREHEAD_MM)?;
    let mut recoveries = Vec::new();
    let once = |method| LawFitOptions { method, starts: 1, ..LawFitOptions::default() };
    let tight = frontalis::fit::nelder_mead::NelderMeadSettings::tight();
    let ways = [
        ("Levenberg–Marquardt, until two starts agree", LawFitOptions::default(), draws),
        ("Levenberg–Marquardt, one start", once(Method::default()), draws),
        (
            "Nelder–Mead, strengths eliminated, tight",
            once(Method::NelderMead { settings: tight, eliminate: true }),
            draws.min(100),
        ),
        ("Nelder–Mead as fminsearch", once(Method::thesis()), draws.min(100)),
    ];
    for law in truths() {
        for (name, options, starts) in &ways {
            recoveries.push((*name, recovery(&scene, &law, options, *starts, 1)));
        }
        println!("found again: {}", law.label());
    }
    let mut coverages = Vec::new();
    for law in truths() {
        for noise in NOISES {
            coverages.push(coverage(&scene, &law, noise, draws, 1_000_000));
        }
        println!("intervals: {}", law.label());
    }
    let marked = of_marks(&generic, draws)?;
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let starts = draws.min(50) as u64;
    let sweeps = [0.0, 0.1].map(|noise| (noise, sweep(&scene, &law, noise, starts, 9)));
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("fit_recovery.csv"), recovery_csv(&recoveries))?;
    std::fs::write(folder.join("fit_coverage.csv"), coverage_csv(&coverages))?;
    std::fs::write(folder.join("fit_sweep.csv"), sweep_csv(&sweeps))?;
    std::fs::write(folder.join("fit.md"), reading(&recoveries, &coverages) + &marked)?;
    let chart = chart(&sweeps, starts);
    std::fs::write(folder.join("fit.svg"), &chart)?;
    svg::paint(&chart, 1.0)?.save(folder.join("fit.png"))?;
    Ok(())
}

fn recovery_csv(rows: &[(&str, Recovery)]) -> String {
    let mut text = String::from("method,law,starts,recovered,failed,wrong,evaluations,time_ms\n");
    for (name, r) in rows {
        let _ = writeln!(
            text,
            "\"{name}\",\"{}\",{},{},{},{},{:.1},{:.3}",
            r.label, r.starts, r.recovered, r.failed, r.wrong, r.evaluations, r.time_ms
        );
    }
    text
}

fn coverage_csv(rows: &[Coverage]) -> String {
    let mut text = String::from("law,noise,draws,failed,parameter,held\n");
    for c in rows {
        for (name, share) in &c.held {
            let _ = writeln!(text, "\"{}\",{},{},{},{name},{share:.4}", c.label, c.noise, c.draws, c.failed);
        }
    }
    text
}

fn sweep_csv(sweeps: &[(f64, Vec<SweepRow>)]) -> String {
    let mut text =
        String::from("study,method,setting,noise,law,seed,time_ms,force_error,parameter_error,status,cause\n");
    let number = |v: Option<f64>| v.map(|v| format!("{v:e}")).unwrap_or_default();
    for (noise, rows) in sweeps {
        for r in rows {
            let _ = writeln!(
                text,
                "fit,\"{}\",{:e},{noise},{},{},{:.4},{},{},{},\"{}\"",
                r.method,
                r.tolerance,
                r.law,
                r.seed,
                r.time_ms,
                number(r.force_error),
                number(r.parameter_error),
                r.status,
                r.cause
            );
        }
    }
    text
}

/// The tables of the document.
fn reading(recoveries: &[(&str, Recovery)], coverages: &[Coverage]) -> String {
    let mut text = String::from(
        "| law | method | starts | found again | said to have failed | wrong | evaluations | median, ms |\n|---|---|---|---|---|---|---|---|\n",
    );
    let percent = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    for (name, r) in recoveries {
        let _ = writeln!(
            text,
            "| {} | {name} | {} | {:.1} % | {:.1} % | {:.1} % | {:.0} | {:.2} |",
            r.label,
            r.starts,
            percent(r.recovered, r.starts),
            percent(r.failed, r.starts),
            percent(r.wrong, r.starts),
            r.evaluations,
            r.time_ms
        );
    }
    text.push_str("\n| law | noise | draws | no fit | least | parameter | largest | parameter | mean |\n|---|---|---|---|---|---|---|---|---|\n");
    for c in coverages {
        let by_share = |a: &&(String, f64), b: &&(String, f64)| a.1.total_cmp(&b.1);
        let (Some(least), Some(most)) = (c.held.iter().min_by(by_share), c.held.iter().max_by(by_share)) else {
            continue;
        };
        let mean = c.held.iter().map(|h| h.1).sum::<f64>() / c.held.len() as f64;
        let _ = writeln!(
            text,
            "| {} | {:.0} % | {} | {} | {:.1} % | {} | {:.1} % | {} | {:.1} % |",
            c.label,
            100.0 * c.noise,
            c.draws,
            c.failed,
            100.0 * least.1,
            least.0,
            100.0 * most.1,
            most.0,
            100.0 * mean
        );
    }
    text
}

/// Intervals on forces measured by marks, as a table of the document: with the causes of the errors, and as if these were independent.
fn of_marks(generic: &FaceModel, draws: usize) -> Result<String, String> {
    let mut text = String::from(
        "\n| law | field | marking error | draws | no fit | shape: together / independent | strengths |\n|---|---|---|---|---|---|---|\n",
    );
    let weight = WeightRule::Discrepancy;
    let laws: Vec<MuscleLaw> = LawKind::ALL.map(MuscleLaw::default_of).to_vec();
    for way in [FieldWay::Direct, FieldWay::Regularised { weight }] {
        for px in [0.1, 0.3, 1.0] {
            for c in MarkedForehead::new(generic, way, px)?.coverage(&laws, draws) {
                let percent = |[a, b]: [f64; 2]| format!("{:.1} / {:.1} %", 100.0 * a, 100.0 * b);
                let (shape, strengths) = (c.shape.map_or_else(|| "–".to_owned(), percent), percent(c.strengths));
                let (way, label) = (way.label(), &c.label);
                let _ = writeln!(
                    text,
                    "| {label} | {way} | {px} px | {} | {} | {shape} | {strengths} |",
                    c.draws, c.failed
                );
            }
            println!("intervals on marked fields: {}, {px} px", way.label());
        }
    }
    Ok(text)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Time against error, one line a method over its tolerances; tolerances at which runs failed have a hollow mark at the top.
fn chart(sweeps: &[(f64, Vec<SweepRow>)], starts: u64) -> String {
    let mut drawn = Vec::new();
    for (at, (noise, rows)) in sweeps.iter().enumerate() {
        let mut series = Vec::new();
        for (number, (method, _)) in methods(1.0).iter().enumerate() {
            let of = |tolerance: f64, status: &'static str| {
                rows.iter().filter(move |r| r.method == *method && r.tolerance == tolerance && r.status == status)
            };
            let mut line = Vec::new();
            let mut hollow = Vec::new();
            for tolerance in TOLERANCES {
                let time = median(of(tolerance, "fitted").map(|r| r.time_ms).collect());
                let error = median(of(tolerance, "fitted").filter_map(|r| r.force_error).collect());
                if let (Some(time), Some(error)) = (time, error) {
                    line.push(Value::at(time, error.max(1e-16)));
                }
                let failed = of(tolerance, "failed").count();
                if let Some(time) = median(of(tolerance, "failed").map(|r| r.time_ms).collect()) {
                    let label =
                        (failed == rows.len() / TOLERANCES.len() / 4).then(|| format!("{tolerance:.0e}: all failed"));
                    hollow.push(Value { label, ..Value::at(time, 2.0) });
                }
            }
            let colour = COLOURS[number].to_owned();
            let name = (*method).to_owned();
            series.push(Series { name, colour: colour.clone(), style: Style::LineAndPoints, values: line });
            series.push(Series { name: String::new(), colour, style: Style::Hollow, values: hollow });
        }
        let title = if *noise == 0.0 { "Without noise".to_owned() } else { format!("{:.0} % noise", 100.0 * noise) };
        let mut y = Axis::logarithmic("relative force error against the truth");
        y.range = Some([if *noise == 0.0 { 1e-16 } else { 1e-3 }, 10.0]);
        let chart = LineChart {
            title,
            x: Axis::logarithmic("median time of a fit, ms"),
            y,
            series,
            x_marks: vec![(16.0, "16 ms".to_owned())],
            ..LineChart::default()
        };
        drawn.push(chart.draw([20.0 + 560.0 * at as f64, HEADING, 540.0, 520.0]));
    }
    let circumstances = format!(
        "anatomical law, four fibres, forehead; {starts} starts within a factor 3, one start a fit; tolerances 1e-2 to 1e-12; hollow: runs that failed; one core, release build"
    );
    sheet([1160.0, HEADING + 540.0], "Fits: time against error", &circumstances, &drawn)
}
