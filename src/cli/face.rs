//! `frontalis face`: face models listed, shown, exported, checked, generated, and made from meshes of other programs.

mod compare;
mod import;

use std::path::{Path, PathBuf};

use clap::Subcommand;

use super::error::CliError;
use super::scene::{face_at, is_generic};
use crate::export::expression_plate;
use crate::export::face_plate::{self, PlateOptions, Style, View};
use crate::expression::{Basic, Expression, Setup, Stage};
use crate::face::generic::proportions;
use crate::face::{self, FaceModel, check, import as mesh_import};
use crate::project::whole_file::{self, Durability};

/// What `face` asks for.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// The face models that the program holds.
    List,
    /// Counts, landmarks and muscles of a face.
    Show {
        /// A face model file, a mesh (OBJ, PLY, CANDIDE .wfm), or `generic`; without it, the generic face.
        #[arg(value_name = "FACE")]
        named: Option<PathBuf>,
        /// The same.
        #[arg(long, value_name = "FILE", conflicts_with = "named")]
        face: Option<PathBuf>,
    },
    /// Writes the mesh of a face as Wavefront OBJ, mm.
    Export {
        /// A face model file or a mesh (OBJ, PLY, CANDIDE .wfm); without it, the generic face.
        #[arg(long, value_name = "FILE")]
        face: Option<PathBuf>,
        /// The OBJ file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Checks that a face is fit for the chain.
    Check {
        /// A face model file, a mesh (OBJ, PLY, CANDIDE .wfm), or `generic`; without it, the generic face.
        #[arg(value_name = "FACE")]
        file: Option<PathBuf>,
    },
    /// Says how near the generic face comes to other faces when it is customised by their landmarks.
    Compare(compare::Arguments),
    /// Makes a face model file of a mesh (OBJ, PLY, CANDIDE .wfm), and says what was repaired and guessed.
    Import(import::Arguments),
    /// Draws a face: shaded, as wireframe, or with its muscles as in an anatomy plate.
    Picture {
        /// A face model file or a mesh; without it, the generic face.
        #[arg(long, value_name = "FILE")]
        face: Option<PathBuf>,
        /// The PNG file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// The six expressions, each at rest, in place of the face alone.
        #[arg(long, conflicts_with_all = ["view", "style", "preset"])]
        expressions: bool,
        /// From where it is seen; may be given several times.
        #[arg(long, value_enum, default_values_t = [ViewArgument::Front])]
        view: Vec<ViewArgument>,
        /// How it is drawn.
        #[arg(long, value_enum, default_value_t = StyleArgument::Shaded)]
        style: StyleArgument,
        /// A preset of muscles in place of the face's own, such as `waters`.
        #[arg(long, value_name = "NAME")]
        preset: Option<String>,
        /// Height of the picture, px.
        #[arg(long, value_name = "PX", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(64..=8192))]
        height: u32,
    },
    /// Generates the generic face anew, or one of other proportions, and writes its file.
    Generate {
        /// A proportion in place of its mean, mm: `nose_length=55`. May be given several times; `face show` lists them.
        #[arg(long, value_name = "NAME=MM", value_parser = proportion)]
        set: Vec<(String, f64)>,
        /// The face model file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum ViewArgument {
    /// Straight on.
    Front,
    /// Turned by 40 degrees.
    ThreeQuarter,
    /// From the person's left.
    Side,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum StyleArgument {
    /// Light and shadow.
    Shaded,
    /// Edges.
    Wireframe,
    /// The muscles over the skin, with their names.
    Muscles,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.action {
        Action::List => {
            println!("generic  {}", counts(&face::generic()));
            Ok(())
        }
        Action::Show { named, face } => {
            print!("{}", description(face_at(named.as_ref().or(face.as_ref()))?.as_ref()));
            Ok(())
        }
        Action::Export { face, out } => {
            let face = face_at(face.as_ref())?;
            write(out, mesh_import::write_obj(face.mesh(), face.mesh().positions()))
        }
        Action::Check { file } => {
            let face = face_at(file.as_ref())?;
            let report = match file.as_deref().filter(|path| !is_generic(path)) {
                None => check::check_against(&face, &check::Expectations::generic()),
                Some(_) => check::check_against(&face, &check::Expectations::imported()),
            };
            print!("{report}");
            if report.ok() { Ok(()) } else { Err(CliError::FaceFailed(face.name().to_owned())) }
        }
        Action::Compare(arguments) => compare::run(arguments),
        Action::Import(arguments) => import::run(arguments),
        Action::Picture { face, out, expressions: true, height, .. } => {
            let face = face_at(face.as_ref())?;
            write_picture(out, &six_expressions(&face, *height)?)
        }
        Action::Picture { face, out, expressions: false, view, style, preset, height } => {
            let face = face_at(face.as_ref())?;
            let chosen = match preset {
                None => None,
                Some(id) => Some(face.with_preset(id).ok_or_else(|| CliError::NoPreset(id.clone()))?),
            };
            let options = PlateOptions {
                views: view
                    .iter()
                    .map(|v| match v {
                        ViewArgument::Front => View::Front,
                        ViewArgument::ThreeQuarter => View::ThreeQuarter,
                        ViewArgument::Side => View::Side,
                    })
                    .collect(),
                style: match style {
                    StyleArgument::Shaded => Style::Shaded,
                    StyleArgument::Wireframe => Style::Wireframe,
                    StyleArgument::Muscles => Style::Muscles,
                },
                height_px: *height,
            };
            let picture = face_plate::render(chosen.as_ref().unwrap_or(&face), &options)?;
            write_picture(out, &picture)
        }
        Action::Generate { set, out } => {
            let wanted: Vec<(&str, f64)> = set.iter().map(|(id, mm)| (id.as_str(), *mm)).collect();
            write(out, face::file::to_json(&proportions::generate_with(&wanted)?))
        }
    }
}

/// The face under each of the six, where its skin comes to rest.
fn six_expressions(face: &FaceModel, height_px: u32) -> Result<image::RgbImage, CliError> {
    let rest = face.mesh().positions();
    let mut stage = Stage::new(face, rest, &Setup::default())?;
    let all = Basic::ALL.map(|b| Expression::basic(b, &stage.actuators));
    let found = stage.equilibria(&all)?;
    for (expression, e) in all.iter().zip(&found).filter(|(_, e)| !e.folded.is_empty()) {
        eprintln!("warning: {}: {} triangles have turned over", expression.name, e.folded.len());
    }
    let named = all.into_iter().zip(found).map(|(expression, e)| (expression.name, e.positions));
    Ok(expression_plate::plate(face, rest, &named.collect::<Vec<_>>(), height_px)?)
}

fn write_picture(out: &Path, picture: &image::RgbImage) -> Result<(), CliError> {
    write(out, crate::export::png(picture).map_err(|source| CliError::Encode { name: "picture", source })?)
}

/// `nose_length=55` as a name and millimetres.
fn proportion(text: &str) -> Result<(String, f64), String> {
    let (id, mm) = text.split_once('=').ok_or("write NAME=MM, such as nose_length=55")?;
    let mm = mm.parse().map_err(|_| format!("`{mm}` is not a number of millimetres"))?;
    Ok((id.to_owned(), mm))
}

fn write(out: &Path, contents: impl AsRef<[u8]>) -> Result<(), CliError> {
    let failed = |source| CliError::Write { path: out.to_owned(), source };
    whole_file::write(out, contents.as_ref(), Durability::Process).map_err(failed)?;
    println!("written to {}", out.display());
    Ok(())
}

fn counts(face: &FaceModel) -> String {
    format!(
        "{} vertices, {} triangles, {} landmarks, {} muscles",
        face.mesh().len(),
        face.mesh().triangles().len(),
        face.landmarks().len(),
        face.muscles().len()
    )
}

fn description(face: &FaceModel) -> String {
    use std::fmt::Write as _;
    let mut text = format!(
        "{}\n{}\n\nlandmarks (id, vertex, x y z in mm, number in the 68-point markup, vertex of the 468-vertex mesh, name)\n",
        face.name(),
        counts(face)
    );
    let number = |n: Option<u16>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
    let at = |v: u32| face.mesh().positions().get(v as usize).copied().unwrap_or_default();
    for l in face.landmarks() {
        let p = at(l.vertex);
        let [x, y, z] = [p.x, p.y, p.z];
        let (in_68, in_468) = (number(l.in_68.map(u16::from)), number(l.in_468));
        let _ = writeln!(
            text,
            "  {:<22} {:>4}  {x:>7.2} {y:>7.2} {z:>7.2}  {in_68:>2} {in_468:>3}  {}",
            l.id, l.vertex, l.name
        );
    }
    let presets =
        face.muscle_presets().iter().map(|p| (format!("muscles of the preset {}", p.id), p.muscles.as_slice()));
    for (title, muscles) in std::iter::once(("muscles".to_owned(), face.muscles())).chain(presets) {
        let _ = writeln!(text, "\n{title} (id, action unit, attachment, insertion, length in mm, Latin name)");
        for m in muscles {
            let length = (at(m.attachment) - at(m.insertion)).norm();
            let _ = writeln!(
                text,
                "  {:<28} {:>2}  {:>4} {:>4}  {length:>6.2}  {}",
                m.id, m.action_unit, m.attachment, m.insertion, m.latin
            );
        }
    }
    if let Ok(values) = proportions::measured(face) {
        text.push_str("\nproportions (name, mm, standard deviation among adults, what is measured)\n");
        for (p, value) in proportions::PROPORTIONS.iter().zip(values) {
            let _ = writeln!(text, "  {:<18} {value:>6.1} ± {:<4} {}", p.id, p.sd_mm, p.name);
        }
    }
    if !face.regions().is_empty() {
        text.push_str("\nregions (id, number of vertices)\n");
        for r in face.regions() {
            let _ = writeln!(text, "  {:<22} {:>4}", r.id, r.vertices.len());
        }
    }
    text
}
