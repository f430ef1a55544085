//! `frontalis face compare`: how near the generic face comes to other faces, and to people drawn at random, when it is customised
//! by their landmarks.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::ValueEnum;

use super::super::error::CliError;
use super::super::output::Output;
use super::super::scene::face_at;
use crate::customize::{AlignRule, CustomizeSettings, MorphRule};
use crate::draw::surface_picture::{self, SurfaceOptions};
use crate::face::FaceModel;
use crate::study::face_fit::{self, Distances, FaceFit};
use crate::study::people::{self, PeopleReport, PeopleSettings};

/// Distance at which the pictures' colours end, mm.
const COLOURS_TO_MM: f64 = 6.0;

/// What `face compare` asks for.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Face model files with landmarks of the same names; none are needed with --people.
    #[arg(required_unless_present = "people")]
    targets: Vec<PathBuf>,
    /// The face that is customised; without it, the generic face.
    #[arg(long, value_name = "FILE")]
    face: Option<PathBuf>,
    /// Also compares with so many people drawn from the proportions of adults, and counts folded triangles.
    #[arg(long, value_name = "N")]
    people: Option<usize>,
    /// Seed of the people.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the people's marks, px at 4 px/mm.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    noise_px: f64,
    /// Alignment; without this and the next four, the thesis's choices, the program's and what lies between are compared.
    #[arg(long, value_enum)]
    align: Option<Align>,
    /// Morph.
    #[arg(long, value_enum)]
    morph: Option<Morph>,
    /// Depth over width.
    #[arg(long, value_name = "Z")]
    z_factor: Option<f64>,
    /// Power of the inverse distance (NNWA).
    #[arg(long)]
    power: Option<f64>,
    /// Standard deviation by which landmarks may be missed, mm (radial).
    #[arg(long, value_name = "MM")]
    smoothing_mm: Option<f64>,
    /// Distance of the camera, mm.
    #[arg(long, value_name = "MM", default_value_t = 1000.0)]
    distance_mm: f64,
    /// Folder for compare.csv, compare.svg, compare.png (time against error), and distances.png, the fit of the last choice to
    /// the last target, coloured by distance.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Align {
    /// Shift, and scale by the ranges of the landmarks.
    Thesis,
    /// Shift, scale and turn of the head together.
    Pose,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Morph {
    /// Average weighted by inverse distance.
    Nnwa,
    /// Radial basis functions.
    Radial,
}

/// A choice of settings with its name.
struct Choice {
    name: String,
    settings: CustomizeSettings,
}

impl Arguments {
    fn choices(&self) -> Vec<Choice> {
        let given = self.align.is_some()
            || self.morph.is_some()
            || self.z_factor.is_some()
            || self.power.is_some()
            || self.smoothing_mm.is_some();
        let named = |name: &str, settings| Choice { name: name.to_owned(), settings };
        let (thesis, program) = (CustomizeSettings::thesis(), CustomizeSettings::default());
        if !given {
            return vec![
                named("thesis, z 1.15", thesis),
                named("thesis, z 1", CustomizeSettings { z_factor: 1.0, ..thesis }),
                named("ranges, radial", CustomizeSettings { align: AlignRule::Thesis, ..program }),
                named("pose, NNWA", CustomizeSettings { morph: MorphRule::Nnwa, ..program }),
                named("pose, radial, 1 mm", CustomizeSettings { smoothing_mm: 1.0, ..program }),
                named("pose, radial", program),
            ];
        }
        let settings = CustomizeSettings {
            align: match self.align {
                Some(Align::Thesis) => AlignRule::Thesis,
                Some(Align::Pose) => AlignRule::Pose,
                None => program.align,
            },
            morph: match self.morph {
                Some(Morph::Nnwa) => MorphRule::Nnwa,
                Some(Morph::Radial) => MorphRule::Radial,
                None => program.morph,
            },
            z_factor: self.z_factor.unwrap_or(program.z_factor),
            power: self.power.unwrap_or(program.power),
            smoothing_mm: self.smoothing_mm.unwrap_or(program.smoothing_mm),
            nearest: None,
        };
        vec![named("as asked", settings)]
    }
}

/// One row of the table: a choice on a target or on the people.
struct Row {
    choice: usize,
    target: String,
    outcome: Found,
}

enum Found {
    Face(Box<FaceFit>),
    People(PeopleReport),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let generic = face_at(arguments.face.as_ref())?;
    let choices = arguments.choices();
    let mut targets: Vec<(String, FaceModel)> = Vec::new();
    for path in &arguments.targets {
        let target = face_at(Some(path))?;
        let shared = generic.landmarks().iter().filter(|l| target.landmark(&l.id).is_some()).count();
        if shared < 3 {
            return Err(CliError::NoCommonLandmarks { path: path.clone(), shared });
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        targets.push((name, target.as_ref().clone()));
    }
    let mut rows = Vec::new();
    for (choice, Choice { settings, .. }) in choices.iter().enumerate() {
        for (name, target) in &targets {
            let fit = face_fit::fit(&generic, target, arguments.distance_mm, settings)?;
            rows.push(Row { choice, target: name.clone(), outcome: Found::Face(Box::new(fit)) });
        }
        if let Some(people) = arguments.people {
            let drawn = PeopleSettings {
                people,
                seed: arguments.seed,
                noise_px: arguments.noise_px,
                distance_mm: arguments.distance_mm,
                ..PeopleSettings::default()
            };
            let report = people::customised_people(&generic, &drawn, settings)?;
            rows.push(Row { choice, target: format!("{people} people"), outcome: Found::People(report) });
        }
    }
    print!("{}", table(&choices, &rows));
    if let Some(out) = &arguments.out {
        let mut output = Output::folder(out)?;
        output.write("compare.csv", csv(&choices, &rows).as_bytes())?;
        let chart = chart(&choices, &rows);
        output.write("compare.svg", chart.as_bytes())?;
        output.write_png("compare.png", &crate::draw::svg::paint(&chart, 2.0)?)?;
        let last = rows.iter().rev().find_map(|r| match &r.outcome {
            Found::Face(fit) => Some((r, fit)),
            Found::People(_) => None,
        });
        if let Some((row, fit)) = last {
            let options = SurfaceOptions {
                title: format!(
                    "Generic face fitted to {} ({}): {:.2} mm RMS, forehead {:.2} mm",
                    row.target, choices[row.choice].name, fit.after.shifted.rms_mm, fit.after.shifted.forehead_rms_mm
                ),
                quantity: "distance, mm".to_owned(),
                range: [0.0, COLOURS_TO_MM],
                ..SurfaceOptions::default()
            };
            let triangles = generic.mesh().triangles();
            let values = Some(fit.after.of_vertex.as_slice());
            output.write_png(
                "distances.png",
                &surface_picture::render(&fit.customized.positions, triangles, values, &options)?,
            )?;
        }
        output.finish()?;
        println!("written to {}", out.display());
    }
    Ok(())
}

fn table(choices: &[Choice], rows: &[Row]) -> String {
    let mut text = String::new();
    let faces: Vec<_> =
        rows.iter().filter_map(|r| if let Found::Face(f) = &r.outcome { Some((r, f)) } else { None }).collect();
    if !faces.is_empty() {
        text.push_str("mm; all vertices that the target covers, and those of the forehead\n");
        let _ = writeln!(
            text,
            "{:<20} {:<16} {:>13} {:>13} {:>13} {:>6} {:>8} {:>8}",
            "choice", "target", "before", "after", "shape alone", "max", "nod", "ms"
        );
    }
    for (row, fit) in faces {
        let pair = |d: &Distances| format!("{:.2} {:.2}", d.rms_mm, d.forehead_rms_mm);
        let _ = writeln!(
            text,
            "{:<20} {:<16} {:>13} {:>13} {:>13} {:>6.1} {:>7.1}° {:>8.3}",
            choices[row.choice].name,
            row.target,
            pair(&fit.before.shifted),
            pair(&fit.after.shifted),
            pair(&fit.after.rigid),
            fit.after.shifted.max_mm,
            fit.customized.turn[0].to_degrees(),
            fit.time_ms
        );
    }
    for row in rows {
        if let Found::People(p) = &row.outcome {
            let _ = writeln!(
                text,
                "{:<20} {} people: lengths {:.2} %, in plane {:.2} mm, in depth {:.2} mm, {:.3} ms; {} folded triangles on {} faces",
                choices[row.choice].name,
                p.people,
                1e2 * p.edge_error,
                p.in_plane_mm,
                p.in_depth_mm,
                p.time_ms,
                p.folds,
                p.folded_people
            );
            for (id, count) in &p.blamed {
                let _ = writeln!(text, "    {count} by {id}");
            }
        }
    }
    text
}

fn csv(choices: &[Choice], rows: &[Row]) -> String {
    let mut text = String::from(
        "choice,target,landmarks,covered,forehead_covered,before_rms_mm,before_forehead_mm,after_rms_mm,after_forehead_mm,after_max_mm,shape_rms_mm,shape_forehead_mm,edge_error,in_plane_mm,in_depth_mm,folds,time_ms\n",
    );
    for row in rows {
        let name = &choices[row.choice].name;
        let _ = match &row.outcome {
            Found::Face(f) => writeln!(
                text,
                "\"{name}\",\"{}\",{},{},{},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},,,,{},{:.4}",
                row.target.replace('"', "'"),
                f.landmarks,
                f.after.shifted.covered,
                f.after.shifted.forehead_covered,
                f.before.shifted.rms_mm,
                f.before.shifted.forehead_rms_mm,
                f.after.shifted.rms_mm,
                f.after.shifted.forehead_rms_mm,
                f.after.shifted.max_mm,
                f.after.rigid.rms_mm,
                f.after.rigid.forehead_rms_mm,
                f.customized.folded.len(),
                f.time_ms
            ),
            Found::People(p) => writeln!(
                text,
                "\"{name}\",\"{}\",,,,,,,,,,,{:.6},{:.4},{:.4},{},{:.4}",
                row.target, p.edge_error, p.in_plane_mm, p.in_depth_mm, p.folds, p.time_ms
            ),
        };
    }
    text
}

/// Time against error, one mark a choice: the mean over the targets where there are any, otherwise the people's error in the plane.
fn chart(choices: &[Choice], rows: &[Row]) -> String {
    let faces = rows.iter().filter(|r| r.choice == 0 && matches!(r.outcome, Found::Face(_))).count();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let points: Vec<(f64, f64, f64)> = (0..choices.len())
        .map(|c| {
            let own = || rows.iter().filter(move |r| r.choice == c);
            let faces: Vec<&FaceFit> =
                own().filter_map(|r| if let Found::Face(f) = &r.outcome { Some(f.as_ref()) } else { None }).collect();
            let people = own().find_map(|r| if let Found::People(p) = &r.outcome { Some(p) } else { None });
            let times: Vec<f64> = faces.iter().map(|f| f.time_ms).chain(people.map(|p| p.time_ms)).collect();
            let rms: Vec<f64> = faces.iter().map(|f| f.after.shifted.rms_mm).collect();
            let forehead: Vec<f64> = faces.iter().map(|f| f.after.shifted.forehead_rms_mm).collect();
            let error = if rms.is_empty() { people.map_or(0.0, |p| p.in_plane_mm) } else { mean(&rms) };
            (mean(&times), error, mean(&forehead))
        })
        .collect();
    let (width, height, left, top, right, bottom) = (900.0, 470.0, 74.0, 64.0, 250.0, 66.0);
    let most = |v: &dyn Fn(&(f64, f64, f64)) -> f64| points.iter().map(v).fold(1e-9, f64::max);
    let (x_end, y_end) = (1.12 * most(&|p| p.0), 1.12 * most(&|p| p.1.max(p.2)));
    let x = |ms: f64| left + ms / x_end * (width - left - right);
    let y = |mm: f64| height - bottom - mm / y_end * (height - top - bottom);
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="{}" font-size="13" fill="#26262c"><rect width="{width}" height="{height}" fill="#ffffff"/><text x="{left}" y="30" font-size="18">Customised faces: time against error</text><text x="{left}" y="50" fill="#5a5a64">{}</text>"##,
        crate::draw::svg::FONT_FAMILY,
        if faces > 0 {
            format!("mean over {faces} faces; filled: all vertices, hollow: forehead")
        } else {
            "in the picture's plane, over the people drawn".to_owned()
        }
    );
    let grid = |out: &mut String, path: String| {
        let _ = write!(out, r##"<path d="{path}" stroke="#e3e3e8" fill="none"/>"##);
    };
    let ticks = crate::draw::ticks::nice_ticks(0.0, x_end, 4);
    for (tick, label) in ticks.iter().zip(crate::draw::ticks::labels(&ticks)) {
        grid(&mut out, format!("M{:.1} {top}V{:.1}", x(*tick), height - bottom));
        let _ = write!(
            out,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{label}</text>"#,
            x(*tick),
            height - bottom + 20.0
        );
    }
    let ticks = crate::draw::ticks::nice_ticks(0.0, y_end, 4);
    for (tick, label) in ticks.iter().zip(crate::draw::ticks::labels(&ticks)) {
        grid(&mut out, format!("M{left} {:.1}H{:.1}", y(*tick), width - right));
        let _ =
            write!(out, r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{label}</text>"#, left - 8.0, y(*tick) + 4.0);
    }
    let _ = write!(
        out,
        r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">median time of one customisation, ms</text><text transform="translate(24 {:.1}) rotate(-90)" text-anchor="middle">distance, RMS, mm</text>"#,
        0.5 * (left + width - right),
        height - 16.0,
        0.5 * (top + height - bottom)
    );
    let mut numbers: Vec<(f64, f64)> = Vec::new();
    for (k, (choice, (ms, error, forehead))) in choices.iter().zip(&points).enumerate() {
        let mut at = (x(*ms), 0.0);
        let highest = y(*error).min(if *forehead > 0.0 { y(*forehead) } else { f64::INFINITY });
        if *forehead > 0.0 {
            let _ = write!(
                out,
                r##"<path d="M{0:.1} {1:.1}V{2:.1}" stroke="#7a86b8" stroke-width="1.2"/><circle cx="{0:.1}" cy="{2:.1}" r="5" fill="#ffffff" stroke="#35478c" stroke-width="1.8"/>"##,
                x(*ms),
                y(*error),
                y(*forehead)
            );
        }
        // A number goes beside another that is already there.
        at.1 = highest - 10.0;
        while numbers.iter().any(|n| (n.0 - at.0).abs() < 12.0 && (n.1 - at.1).abs() < 14.0) {
            at.0 += 12.0;
        }
        numbers.push(at);
        let _ = write!(
            out,
            r##"<circle cx="{0:.1}" cy="{1:.1}" r="5" fill="#35478c"/><text x="{10:.1}" y="{2:.1}" text-anchor="middle">{3}</text><text x="{4:.1}" y="{5:.1}">{3}  {6}</text><text x="{4:.1}" y="{7:.1}" fill="#5a5a64" font-size="12">{8:.2} mm, forehead {9:.2} mm</text>"##,
            x(*ms),
            y(*error),
            at.1,
            k + 1,
            width - right + 24.0,
            top + 16.0 + 44.0 * k as f64,
            crate::draw::svg::escape(&choice.name),
            top + 33.0 + 44.0 * k as f64,
            error,
            forehead,
            at.0
        );
    }
    out.push_str("</svg>");
    out
}
