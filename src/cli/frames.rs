//! `frontalis frames`: the first and the last frame of an expression out of a film, as pictures and as a project that names them.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::error::CliError;
use super::output::Output;
use super::progress::Progress;
use crate::frames::film::{Film, FilmError, still_png};
use crate::frames::motion::Motion;
use crate::frames::{Compression, Frame, strip};
use crate::project::{FramePair, FrameRef, Project, file};

/// What `frames` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The film, or a folder of numbered pictures.
    film: PathBuf,
    /// The neutral frame, counted from 1; without it, the one that the motion proposes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    first: Option<u64>,
    /// The frame at the height of the expression, counted from 1; without it, the one that the motion proposes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    last: Option<u64>,
    /// Folder for first.png, last.png, motion.csv and the project; files of the same names are replaced, others kept.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Header of `motion.csv`.
const MOTION_HEADER: &str = "frame,time_s,speed_grey,change_grey";

const PROJECT: &str = "film.frontalis.json";

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut progress = Progress::new();
    progress.stage("open");
    let never = || false;
    let mut film = Film::open(&arguments.film, &never)?;
    let mut output = Output::folder(&arguments.out)?;
    progress.stage("look for the motion");
    let strip::Scan { motion, count, broken } = strip::scan(&mut film, &never, &mut |_| ())?;
    let chosen = |asked: Option<u64>, proposed: usize| asked.map_or(proposed, |n| n as usize - 1);
    let indices = [chosen(arguments.first, motion.first), chosen(arguments.last, motion.last)];
    for index in indices {
        if index >= count {
            let path = arguments.film.clone();
            return Err(broken.unwrap_or(FilmError::NoSuchFrame { path, number: index + 1, count }).into());
        }
    }
    if indices[0] == indices[1] {
        return Err(CliError::SameFrame(indices[0] + 1));
    }
    progress.stage("read the two frames");
    let mut named = Vec::new();
    for (index, file_name) in indices.into_iter().zip(["first.png", "last.png"]) {
        let image = film.frame(index, &never)?;
        let encoded = still_png(&image, &film.origin(index));
        let bytes = encoded.map_err(|source| CliError::Encode { name: file_name, source })?;
        output.write(file_name, &bytes)?;
        let sha256 = Frame::decode(file_name.as_ref(), &bytes)?.sha256().to_owned();
        named.push(FrameRef { path: file_name.to_owned(), sha256, width_px: image.width(), height_px: image.height() });
    }
    let mut named = named.into_iter();
    let frames = FramePair { first: named.next(), last: named.next() };
    let stem = arguments.film.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let project = Project { name: stem, frames, ..Project::default() };
    output.write(PROJECT, &file::to_bytes(PROJECT.as_ref(), &project)?)?;
    output.write("motion.csv", table(&film, &motion).as_bytes())?;
    output.finish()?;
    drop(progress);

    if let Some(remark) = film.remark() {
        eprintln!("note: {remark}");
    }
    if let Some(broken) = broken {
        eprintln!("note: {broken}");
    }
    let [width, height] = film.size();
    println!("{count} frames of {width} × {height} px");
    for (word, index, asked) in
        [("first", indices[0], arguments.first.is_some()), ("last", indices[1], arguments.last.is_some())]
    {
        let time = film.time_s(index).map(|t| format!(" at {t:.2} s")).unwrap_or_default();
        let why = match (asked, motion.moved) {
            (true, _) => "as asked",
            (false, true) => "proposed by the motion",
            (false, false) => "an end of the film, for nothing lasting moves in it",
        };
        let kind = film.compression(index).words().map(|w| format!(", a {w}")).unwrap_or_default();
        println!("{word}: frame {}{time}, {why}{kind}", index + 1);
    }
    if indices.iter().any(|i| film.compression(*i) == Compression::Inter) {
        println!(
            "predicted frames carry the texture of skin along: suggestions are less sure than between key frames{}",
            near(&film.key_frames(), indices)
        );
    }
    println!("the project is {}", arguments.out.join(PROJECT).display());
    Ok(())
}

/// The key frames beside two frames, in words.
fn near(keys: &[usize], frames: [usize; 2]) -> String {
    let beside = |i: usize| [keys.iter().rev().find(|k| **k <= i), keys.iter().find(|k| **k > i)];
    let mut numbers: Vec<usize> = frames.into_iter().flat_map(beside).flatten().map(|k| k + 1).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    if numbers.is_empty() { String::new() } else { format!("; the nearest are {}", numbers.join(", ")) }
}

/// `motion.csv`: how much moves, one row a frame that was compared.
fn table(film: &Film, motion: &Motion) -> String {
    let mut text = format!("{MOTION_HEADER}\n");
    for (i, (speed, change)) in motion.speed.iter().zip(&motion.change).enumerate() {
        let index = i * motion.step;
        let time = film.time_s(index).map_or_else(|| "NaN".to_owned(), |t| t.to_string());
        let _ = writeln!(text, "{},{time},{speed},{change}", index + 1);
    }
    text
}
