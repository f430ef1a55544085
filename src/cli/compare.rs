//! `frontalis compare`: two annotators on the same frames, point by point.

use std::path::PathBuf;

use serde::Serialize;

use super::error::CliError;
use super::output::Output;
use crate::doubt::agreement::{self, Summary};
use crate::export::csv;
use crate::project::file;

/// What `compare` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// One project (a .frontalis.json file).
    a: PathBuf,
    /// The other, on the same frames. Differences are B − A.
    b: PathBuf,
    /// A folder for compare.csv (every point) and compare.json (the summary).
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// So many of the worst points are printed.
const WORST: usize = 5;

/// `compare.json`.
#[derive(Serialize)]
struct Report {
    program: &'static str,
    version: &'static str,
    a: String,
    b: String,
    summary: Option<Summary>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let (a, b) = (file::load(&arguments.a)?, file::load(&arguments.b)?);
    let agreement = agreement::compare(&a, &b)?;
    match &agreement.summary {
        Some(s) => {
            println!("{} points marked in both; differences are B − A, px", s.points);
            for (axis, bias, sd, [low, high]) in
                [("x", s.bias_px[0], s.sd_px[0], s.limits_x_px), ("y", s.bias_px[1], s.sd_px[1], s.limits_y_px)]
            {
                println!("{axis}: bias {bias:+.2}, sd {sd:.2}, 95 % between {low:+.2} and {high:+.2}");
            }
            println!(
                "distance: median {:.2}, rms {:.2}; each hand errs by {:.2} px along an axis if both err alike",
                s.median_px, s.rms_px, s.sigma_each_px
            );
        }
        None => println!("fewer than two points are marked in both"),
    }
    for d in agreement.differences.iter().take(WORST) {
        println!("worst: {} by {:.2} px ({:+.2}, {:+.2})", d.id, d.distance_px(), d.by_px[0], d.by_px[1]);
    }
    println!("{} marked in A alone, {} in B alone", agreement.only_a.len(), agreement.only_b.len());
    if let Some(folder) = &arguments.out {
        let names = |ids: &[crate::project::PointId]| ids.iter().map(ToString::to_string).collect();
        let report = Report {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            a: arguments.a.display().to_string(),
            b: arguments.b.display().to_string(),
            summary: agreement.summary,
            only_in_a: names(&agreement.only_a),
            only_in_b: names(&agreement.only_b),
        };
        let mut output = Output::folder(folder)?;
        output.write("compare.csv", csv::differences(&agreement.differences).as_bytes())?;
        let text = serde_json::to_string_pretty(&report).unwrap_or_default() + "\n";
        output.write("compare.json", text.as_bytes())?;
        output.finish()?;
        println!("written to {}", folder.display());
    }
    Ok(())
}
