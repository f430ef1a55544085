//! Writing a play into a folder of its own: a moving picture, a film, numbered pictures, meshes and tables; the folder appears whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame as Moment, RgbaImage, buffer::ConvertBuffer};
use nalgebra::{Point3, Vector3};

use super::app::App;
use super::jobs::{About, Finished, Progress, Written};
use super::panels::expressions::Paint;
use crate::draw::words::sentence;
use crate::export::expression::{self as files, PictureOptions};
use crate::expression::player::Pace;
use crate::expression::{Expression, Player, Setup, Shown, Stage};
use crate::face::FaceModel;
use crate::frames::film::FilmWriter;
use crate::project::whole_file;

/// What is exported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// A moving picture.
    pub gif: bool,
    /// A film.
    pub mp4: bool,
    /// Numbered pictures.
    pub png: bool,
    /// A mesh for each picture.
    pub obj: bool,
    /// Tables: places at the end, energy over time.
    pub csv: bool,
    /// Length, s.
    pub seconds: f64,
    /// Pictures a second.
    pub per_second: u32,
    /// Whether the muscles let go in the second half.
    pub there_and_back: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            gif: true,
            mp4: false,
            png: false,
            obj: false,
            csv: true,
            seconds: 1.5,
            per_second: 25,
            there_and_back: false,
        }
    }
}

impl Choice {
    /// Whether anything would be written.
    pub fn any(&self) -> bool {
        self.gif || self.mp4 || self.png || self.obj || self.csv
    }
}

/// A play to be written.
pub struct Wanted {
    /// The face.
    pub face: Arc<FaceModel>,
    /// Its vertices at rest, mm.
    pub rest: Arc<Vec<Point3<f64>>>,
    /// What it is built with.
    pub setup: Setup,
    /// How time is stepped.
    pub pace: Pace,
    /// What is played.
    pub expression: Expression,
    /// What is written.
    pub choice: Choice,
    /// The value on the skin.
    pub shown: Option<Shown>,
    /// Turn about the vertical axis, rad.
    pub turn: f64,
}

/// Size of a picture, px.
const PICTURE_PX: [u32; 2] = [420, 520];

/// Plays it from rest and writes it into a new folder inside `inside`; gives that folder, or nothing where the person stopped it.
///
/// # Errors
/// One line: what failed, and what to do. Nothing is left behind.
pub fn write(inside: &Path, wanted: &Wanted, progress: &Progress) -> Result<Option<PathBuf>, String> {
    let refused = |e: io::Error| {
        format!("{}: cannot be written ({e}); choose another folder, or free it for writing", inside.display())
    };
    fs::create_dir_all(inside).map_err(refused)?;
    let work = tempfile::Builder::new().prefix(".frontalis-").suffix(".part").tempdir_in(inside).map_err(refused)?;
    let stage = Stage::new(&wanted.face, &wanted.rest, &wanted.setup).map_err(|e| sentence(&e.to_string()))?;
    let mut player = Player::new(stage, wanted.pace);
    player.want(&wanted.expression);
    let choice = &wanted.choice;
    let count = ((choice.seconds * f64::from(choice.per_second)).round() as usize).max(1) + 1;

    // Played first: the range of the colours holds the whole play.
    let mut moments: Vec<Played> = Vec::with_capacity(count);
    let mut samples = Vec::new();
    for k in 0..count {
        let until = k as f64 / f64::from(choice.per_second);
        if choice.there_and_back && until > 0.5 * choice.seconds {
            player.want(&Expression { name: wanted.expression.name.clone(), ..Expression::default() });
        }
        while player.time_s() + 1e-9 < until {
            if progress.is_cancelled() {
                return Ok(None);
            }
            if !player.step() {
                let why = player.failure().map(ToString::to_string).unwrap_or_default();
                return Err(format!("The play stopped, so nothing was written. {why}"));
            }
            samples.extend(player.samples().next_back().copied());
        }
        moments.push((player.time_s(), player.state().positions.clone(), player.loads().to_vec()));
        progress.set(0.3 * (k + 1) as f64 / count as f64);
    }
    let put = |name: &str, bytes: &[u8]| fs::write(work.path().join(name), bytes).map_err(refused);
    if choice.csv
        && let Some((_, last, loads)) = moments.last()
    {
        let first = Player::new(player.stage().clone(), wanted.pace);
        let all = first.samples().chain(&samples);
        put("positions.csv", files::positions(&wanted.rest, last, loads).as_bytes())?;
        put("energy.csv", files::energy(all).as_bytes())?;
    }
    if choice.obj {
        for (k, (time_s, positions, _)) in moments.iter().enumerate() {
            let text = files::mesh(&wanted.face, &wanted.expression.name, *time_s, positions);
            put(&format!("mesh_{k:04}.obj"), text.as_bytes())?;
        }
    }
    if (choice.gif || choice.mp4 || choice.png) && !pictures(work.path(), wanted, &moments, progress)? {
        return Ok(None);
    }
    let goal = free_name(inside, &wanted.expression.name);
    whole_file::open_to_others(work.path()).and_then(|()| fs::rename(work.path(), &goal)).map_err(refused)?;
    // Moved: there is nothing left to remove.
    let _ = work.keep();
    Ok(Some(goal))
}

/// Time (s), places (mm) and the muscles' pull (N).
type Played = (f64, Vec<Point3<f64>>, Vec<Vector3<f64>>);

/// Draws every moment; false where the person stopped it.
fn pictures(folder: &Path, wanted: &Wanted, moments: &[Played], progress: &Progress) -> Result<bool, String> {
    let choice = &wanted.choice;
    let refused = |e: &dyn std::fmt::Display| format!("The pictures cannot be written ({e}); choose another folder");
    let most = wanted.shown.map(|shown| {
        let of = |m: &Played| files::end_of_colours(&shown.values(wanted.face.mesh(), &wanted.rest, &m.1, &m.2));
        moments.iter().skip(1).map(of).fold(1e-9, f64::max)
    });
    let gif =
        if choice.gif { Some(fs::File::create(folder.join("expression.gif")).map_err(|e| refused(&e))?) } else { None };
    let mut gif = gif.map(|file| GifEncoder::new_with_speed(io::BufWriter::new(file), 10));
    if let Some(gif) = &mut gif {
        gif.set_repeat(Repeat::Infinite).map_err(|e| refused(&e))?;
    }
    let mut film = None;
    for (k, (_, positions, loads)) in moments.iter().enumerate() {
        if progress.is_cancelled() {
            return Ok(false);
        }
        let options = PictureOptions {
            shown: wanted.shown,
            most,
            turns: vec![wanted.turn],
            title: wanted.expression.name.clone(),
            view_px: PICTURE_PX,
            within: Vec::new(),
        };
        let drawn = files::picture(&wanted.face, &wanted.rest, positions, loads, &options).map_err(|e| refused(&e))?;
        if choice.png {
            let bytes = crate::export::png(&drawn).map_err(|e| refused(&e))?;
            fs::write(folder.join(format!("frame_{k:04}.png")), bytes).map_err(|e| refused(&e))?;
        }
        if choice.mp4 {
            let writer = match film.take() {
                Some(writer) => Ok(writer),
                None => FilmWriter::new(drawn.dimensions().into(), choice.per_second),
            };
            let written = writer.and_then(|mut writer| writer.frame(&drawn).map(|()| writer));
            film = Some(written.map_err(|e| sentence(&e.to_string()))?);
        }
        if let Some(gif) = &mut gif {
            let moment: RgbaImage = drawn.convert();
            let delay = Delay::from_numer_denom_ms(1000, choice.per_second.max(1));
            gif.encode_frame(Moment::from_parts(moment, 0, 0, delay)).map_err(|e| refused(&e))?;
        }
        progress.set(0.3 + 0.7 * (k + 1) as f64 / moments.len() as f64);
    }
    if let Some(film) = film {
        let bytes = film.finish().map_err(|e| sentence(&e.to_string()))?;
        fs::write(folder.join("expression.mp4"), bytes).map_err(|e| refused(&e))?;
    }
    Ok(true)
}

/// A folder's name that is not taken: "happy", "happy-2".
fn free_name(inside: &Path, name: &str) -> PathBuf {
    let plain = |c: char| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let stem: String = name.chars().map(plain).collect();
    let stem = stem.trim_matches('-');
    let stem = if stem.is_empty() { "expression" } else { stem };
    let first = inside.join(stem);
    let others = (2_u32..).map(|n| inside.join(format!("{stem}-{n}")));
    std::iter::once(first.clone()).chain(others).find(|p| !p.exists()).unwrap_or(first)
}

impl App {
    /// Writes the play into a folder, in the background.
    pub(super) fn export_expression(&mut self, inside: PathBuf, ctx: &egui::Context) {
        let Some(ready) = self.expression_work.ready() else { return };
        let view = &self.view.expressions;
        let wanted = Wanted {
            face: Arc::clone(&ready.face),
            rest: Arc::clone(&ready.rest),
            setup: ready.setup,
            pace: view.pace,
            expression: view.wanted(),
            choice: view.export,
            shown: match view.paint {
                Paint::Value(shown) => Some(shown),
                Paint::Texture | Paint::Plain => None,
            },
            turn: view.orbit.azimuth,
        };
        self.jobs.start(ctx, "Writing the play", About::Person, move |progress| {
            let written = write(&inside, &wanted, progress);
            match written {
                Ok(None) => None,
                Ok(Some(folder)) => Some(Finished::Exported(Ok(Written::to(folder)))),
                Err(why) => Some(Finished::Exported(Err(why))),
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::Basic;
    use crate::face;
    use crate::frames::film::Film;
    use crate::simulate::Method;

    fn wanted(choice: Choice) -> Wanted {
        let face = face::generic();
        let rest = Arc::new(face.mesh().positions().to_vec());
        let stage = Stage::new(&face, &rest, &Setup::default()).unwrap();
        let expression = Expression::basic(Basic::Surprise, &stage.actuators);
        Wanted {
            face,
            rest,
            setup: Setup::default(),
            pace: Pace::default(),
            expression,
            choice,
            shown: Some(Shown::Displacement),
            turn: 0.0,
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_play_is_a_folder_with_everything_that_was_chosen() {
        let dir = tempfile::tempdir().unwrap();
        let all = Choice { mp4: true, png: true, obj: true, seconds: 0.2, per_second: 10, ..Choice::default() };
        let folder = write(dir.path(), &wanted(all), &Progress::default()).unwrap().unwrap();
        assert_eq!(folder, dir.path().join("surprise"));
        assert_eq!(
            names(&folder),
            [
                "energy.csv",
                "expression.gif",
                "expression.mp4",
                "frame_0000.png",
                "frame_0001.png",
                "frame_0002.png",
                "mesh_0000.obj",
                "mesh_0001.obj",
                "mesh_0002.obj",
                "positions.csv"
            ]
        );
        // The film shows the numbered pictures.
        let mut film = Film::open(&folder.join("expression.mp4"), &|| false).unwrap();
        assert_eq!((film.len(), film.time_s(2)), (3, Some(0.2)));
        for k in 0..3 {
            let [read, drawn] = [
                film.frame(k, &|| false).unwrap(),
                image::open(folder.join(format!("frame_{k:04}.png"))).unwrap().to_rgb8(),
            ];
            let off = |(x, y, p): (u32, u32, &image::Rgb<u8>)| {
                p.0.iter().zip(read.get_pixel(x, y).0).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0
            };
            let mean = drawn.enumerate_pixels().map(off).sum::<f64>() / f64::from(drawn.width() * drawn.height());
            assert!(mean < 2.0, "frame {k}: {mean}");
        }
        let energy = fs::read_to_string(folder.join("energy.csv")).unwrap();
        // At rest, and twelve steps of 1/60 s.
        assert_eq!(energy.lines().count(), 1 + 1 + 12, "{energy}");
        let again = write(dir.path(), &wanted(Choice { gif: false, mp4: false, ..all }), &Progress::default())
            .unwrap()
            .unwrap();
        assert_eq!(again, dir.path().join("surprise-2"));
        assert_eq!(names(dir.path()), ["surprise", "surprise-2"], "and nothing else");
    }

    #[test]
    fn a_film_that_is_stopped_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let progress = Progress::default();
        progress.cancel();
        let choice = Choice { mp4: true, ..Choice::default() };
        assert_eq!(write(dir.path(), &wanted(choice), &progress), Ok(None));
        assert!(names(dir.path()).is_empty());
    }

    #[test]
    fn a_play_that_fails_leaves_nothing_and_says_why() {
        let dir = tempfile::tempdir().unwrap();
        let mut wanted = wanted(Choice { seconds: 5.0, ..Choice::default() });
        wanted.setup.stiffness = 100.0;
        wanted.pace = Pace { method: Method::ExplicitEuler, step_s: 0.033, ramp_s: 0.0 };
        let why = write(dir.path(), &wanted, &Progress::default()).unwrap_err();
        assert!(why.contains("nothing was written") && why.contains("implicit Euler"), "{why}");
        assert!(names(dir.path()).is_empty());
    }
}
