//! What depth rules and springs miss on scenes whose places and forces are known, without marking errors.

use std::fmt::Write;

use nalgebra::{Point3, Vector3};

use super::artist::ArtistField;
use super::membrane_truth::{MembraneFace, MembraneSettings, TruthError};
use super::wish::Wish;
use super::{Twin, TwinError, TwinSettings};
use crate::camera::Camera;
use crate::displacement::{DepthRule, depth};
use crate::face::{FaceModel, Mesh, Skull};
use crate::forces::{self, SpringRule, Springs};
use crate::forces::{Material, Membrane, Sheet};
use crate::simulate::Ended;
use crate::skin::StressStrainCurve;

/// Thickness of the skin, mm, as the chain has it.
const THICKNESS_MM: f64 = 1.5;
/// Share of every expression's activations.
const INTENSITY: f64 = 0.5;
/// Seed of the muscles that are drawn by chance.
const SEED: u64 = 1;
/// The forehead of a field that moves less has nothing to find, mm (root mean square).
const STILL_MM: f64 = 0.05;

/// Places that are known in both frames.
#[derive(Clone, Debug)]
pub struct Known {
    /// What it is.
    pub name: String,
    /// Who says so.
    pub made_by: &'static str,
    /// Every vertex in the first frame, mm.
    pub first: Vec<Point3<f64>>,
    /// Every vertex in the last frame, mm.
    pub last: Vec<Point3<f64>>,
    /// Vertices whose force can be believed.
    pub believed: Vec<bool>,
}

impl Known {
    /// An artist's field.
    pub fn of_artist(name: &str, field: ArtistField) -> Self {
        Self {
            name: name.to_owned(),
            made_by: "artist",
            first: field.first,
            last: field.last,
            believed: field.believed,
        }
    }
}

/// What a rule makes of a truth.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthRow {
    /// The truth.
    pub truth: String,
    /// Who made it.
    pub made_by: &'static str,
    /// The rule.
    pub rule: DepthRule,
    /// ‖F − F_true‖ / ‖F_true‖ over forehead and brows, F = −K X at the places of the rule and at the true ones; none where nothing moves there.
    pub forehead: Option<f64>,
    /// The same over the whole face.
    pub whole: f64,
    /// Root mean square error of the depth over forehead and brows, mm.
    pub depth_mm: f64,
}

/// What a skin on the face's own mesh makes of the true places of a membrane.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinRow {
    /// The expression.
    pub expression: String,
    /// Cuts of the truth.
    pub levels: u32,
    /// The truth's material.
    pub material: Material,
    /// Why the search for the truth ended, and how many triangles of it have turned over.
    pub ended: Ended,
    /// Triangles turned over.
    pub folded: usize,
    /// Relative errors (all of the force, its part in the surface, all of it over forehead and brows): of springs on the face's own mesh;
    pub springs: [f64; 3],
    /// of the chain's membrane elements on it, with fibres whatever the truth is made of;
    pub membrane: [f64; 3],
    /// of springs on the finer mesh of the truth, gathered: what springs miss on any mesh with triangles of this shape.
    pub fine_springs: [f64; 3],
}

/// The twin whose brow slides, and the expressions of a membrane.
///
/// # Errors
/// A face without muscles.
pub fn made_here(face: &FaceModel) -> Result<Vec<Known>, TrialError> {
    let first = face.mesh().positions().to_vec();
    let settings = TwinSettings { head_motion: false, ..TwinSettings::default() };
    let slide = Twin::generate(face, &settings)?;
    let all = vec![true; first.len()];
    let mut known = vec![Known {
        name: "brow raise".to_owned(),
        made_by: "slide",
        first: first.clone(),
        last: slide.last,
        believed: all,
    }];
    let mut membrane = MembraneFace::new(face, &MembraneSettings::default())?;
    let believed: Vec<bool> = membrane.actuators.held.iter().take(first.len()).map(|held| !held).collect();
    for wish in Wish::ALL {
        let expression = wish.expression(&membrane.actuators, SEED).times(INTENSITY);
        let truth = membrane.truth(&expression)?;
        if truth.ended == Ended::Converged {
            known.push(Known {
                name: wish.word().replace('_', " "),
                made_by: "membrane",
                first: first.clone(),
                last: truth.last,
                believed: believed.clone(),
            });
        }
    }
    Ok(known)
}

/// Why there is nothing to measure on.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// No slide.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// No membrane.
    #[error(transparent)]
    Truth(#[from] TruthError),
}

/// Every depth rule on a truth, seen by a camera at 1 m without errors. `face` has the triangles and the regions; its places are not used.
pub fn depth_rows(face: &FaceModel, known: &Known) -> Vec<DepthRow> {
    let mesh = face.mesh();
    let springs = Springs::new(mesh, &known.first, SpringRule::default(), THICKNESS_MM);
    let curve = StressStrainCurve::default();
    let force = |x: &[Point3<f64>]| {
        let mut out = Vec::new();
        forces::muscle_forces(&springs, &curve, x, None, &mut out);
        out
    };
    let truth = force(&known.last);
    let mut forehead = vec![false; mesh.len()];
    for v in face.region("forehead_and_brows") {
        forehead[*v as usize] = known.believed[*v as usize];
    }
    let rms = |of: &dyn Fn(usize) -> f64| {
        let chosen: Vec<f64> = (0..mesh.len()).filter(|v| forehead[*v]).map(of).collect();
        (chosen.iter().map(|d| d * d).sum::<f64>() / chosen.len().max(1) as f64).sqrt()
    };
    let moves = rms(&|v| (known.last[v] - known.first[v]).norm()) > STILL_MM;
    let surface = Skull::new(mesh, &known.first);
    DepthRule::ALL
        .into_iter()
        .map(|rule| {
            let places = placed(mesh, known, &surface, rule);
            let found = force(&places);
            DepthRow {
                truth: known.name.clone(),
                made_by: known.made_by,
                rule,
                forehead: moves.then(|| relative(&found, &truth, &forehead)),
                whole: relative(&found, &truth, &known.believed),
                depth_mm: rms(&|v| places[v].z - known.last[v].z),
            }
        })
        .collect()
}

fn placed(mesh: &Mesh, known: &Known, surface: &Skull, rule: DepthRule) -> Vec<Point3<f64>> {
    let camera = Camera { principal_point_px: [0.0, 0.0].into(), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 };
    let slope = camera.ray_slope();
    let place = |(v, (from, to)): (usize, (&Point3<f64>, &Point3<f64>))| {
        let ray = camera.ray(&camera.image_from_face(to));
        let placed = match rule {
            DepthRule::FixedDepth => depth::fixed_depth(&ray, &slope, from.z),
            DepthRule::SlideOnSurface => {
                let start = mesh.triangles_of_vertex(v).first();
                start.and_then(|t| depth::slide_on_surface(&ray, &slope, mesh, &known.first, *t))
            }
            DepthRule::KeepHeight => depth::keep_height(&ray, &slope, surface, from),
            DepthRule::HalfWay => depth::half_way(&ray, &slope, surface, from),
        };
        placed.map_or(*from, |p| p.position)
    };
    known.first.iter().zip(&known.last).enumerate().map(place).collect()
}

fn relative(found: &[Vector3<f64>], truth: &[Vector3<f64>], among: &[bool]) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for ((f, t), _) in found.iter().zip(truth).zip(among).filter(|(_, among)| **among) {
        off += (f - t).norm_squared();
        all += t.norm_squared();
    }
    (off / all).sqrt()
}

/// What springs and membrane elements on the face's own mesh, those of the chain whatever the truth's material is, make of the true places of membranes, over vertices that are not held and have no held
/// neighbour.
///
/// # Errors
/// A face without muscles.
pub fn skin_rows(face: &FaceModel, levels: u32, material: Material) -> Result<Vec<SkinRow>, TruthError> {
    let sheet = Sheet { material, ..Sheet::default() };
    let mut made = MembraneFace::new(face, &MembraneSettings { levels, sheet, ..Default::default() })?;
    let mesh = face.mesh();
    let curve = StressStrainCurve::default();
    let held = made.actuators.held.clone();
    let free = |v: usize| !held[v] && mesh.neighbours(v).iter().all(|n| !held[*n as usize]);
    let among: Vec<bool> = (0..mesh.len()).map(free).collect();
    let mut forehead = vec![false; mesh.len()];
    for v in face.region("forehead_and_brows") {
        forehead[*v as usize] = among[*v as usize];
    }
    let by_springs = |mesh: &Mesh, x: &[Point3<f64>]| {
        let springs = Springs::new(mesh, mesh.positions(), SpringRule::default(), THICKNESS_MM);
        let mut out = Vec::new();
        forces::muscle_forces(&springs, &curve, x, None, &mut out);
        out
    };
    let coarse = Membrane::new(mesh, mesh.positions(), Sheet::default());
    let mut rows = Vec::new();
    for wish in Wish::ALL {
        let expression = wish.expression(&made.actuators, SEED).times(INTENSITY);
        let truth = made.truth(&expression)?;
        let normals = mesh.vertex_normals(&truth.last);
        let tangential = |f: &[Vector3<f64>]| forces::split(f, &normals).0;
        let errors = |f: &[Vector3<f64>]| {
            let within = relative(&tangential(f), &tangential(&truth.force), &among);
            [relative(f, &truth.force, &among), within, relative(f, &truth.force, &forehead)]
        };
        let mut elements = Vec::new();
        coarse.forces(&truth.last, None, &mut elements);
        for f in &mut elements {
            *f = -*f;
        }
        let fine = by_springs(made.refined.face.mesh(), &truth.fine);
        rows.push(SkinRow {
            expression: wish.word().replace('_', " "),
            levels,
            material,
            ended: truth.ended,
            folded: truth.folded,
            springs: errors(&by_springs(mesh, &truth.last)),
            membrane: errors(&elements),
            fine_springs: errors(&made.refined.gathered(&fine)),
        });
    }
    Ok(rows)
}

/// `truths.csv`: a row a truth and rule.
pub fn csv(rows: &[DepthRow]) -> String {
    let mut text = "made_by,truth,rule,force_error_forehead,force_error_whole,depth_rms_mm\n".to_owned();
    for r in rows {
        let forehead = r.forehead.unwrap_or(f64::NAN);
        let _ = writeln!(
            text,
            "{},{},{},{forehead:.6},{:.6},{:.6}",
            r.made_by,
            r.truth,
            r.rule.word(),
            r.whole,
            r.depth_mm
        );
    }
    text
}

/// `truths.md`: the tables for people.
pub fn markdown(depths: &[DepthRow], skins: &[SkinRow]) -> String {
    let mut text = "# What depth rules and springs miss without marking errors\n\n\
        Error of the forces by the depth rule alone, %: forehead and brows / whole face; in brackets the error of the depth there, mm.\n\n\
        | truth |"
        .to_owned();
    for rule in DepthRule::ALL {
        let _ = write!(text, " `{}` |", rule.word());
    }
    text.push_str("\n|---|---|---|---|---|\n");
    for of_truth in depths.chunk_by(|a, b| (a.made_by, &a.truth) == (b.made_by, &b.truth)) {
        let Some(first) = of_truth.first() else { continue };
        let _ = write!(text, "| {}: {} |", first.made_by, first.truth);
        for r in of_truth {
            let forehead = r.forehead.map_or("–".to_owned(), |e| format!("{:.0}", 100.0 * e));
            let _ = write!(text, " {forehead} / {:.0} ({:.2}) |", 100.0 * r.whole, r.depth_mm);
        }
        text.push('\n');
    }
    text.push_str(
        "\nError of forces at the true places of a membrane, %: all of the force / its part in the surface / all of it over forehead and brows.\n\n\
         | expression | material, cuts | springs | membrane elements | springs on the truth's mesh | folded |\n|---|---|---|---|---|---|\n",
    );
    for r in skins {
        let three = |e: [f64; 3]| e.map(|e| format!("{:.0}", 100.0 * e)).join(" / ");
        let ended = if r.ended == Ended::Converged { r.folded.to_string() } else { r.ended.label().to_owned() };
        let _ = writeln!(
            text,
            "| {} | {:?}, {} | {} | {} | {} | {ended} |",
            r.expression,
            r.material,
            r.levels,
            three(r.springs),
            three(r.membrane),
            three(r.fine_springs)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    /// Each truth made here is that of one rule: the slide of the surface, the membrane of the kept height (over its own, finer skull). Half of the
    /// way errs by about half as much as staying.
    #[test]
    fn each_rule_is_best_where_it_is_true_and_half_way_errs_by_half() {
        let face = face::generic();
        let known = made_here(&face).unwrap();
        assert_eq!(known.len(), 9);
        let of = |rows: &[DepthRow], rule: DepthRule| rows.iter().find(|r| r.rule == rule).unwrap().clone();
        let [slide, raise] = [0, 1].map(|k| depth_rows(&face, &known[k]));
        assert!(of(&slide, DepthRule::SlideOnSurface).whole < 1e-6);
        assert!(of(&slide, DepthRule::FixedDepth).forehead.unwrap() > 0.5);
        let [fixed, kept, half] =
            [DepthRule::FixedDepth, DepthRule::KeepHeight, DepthRule::HalfWay].map(|rule| of(&raise, rule));
        assert!(kept.depth_mm < 0.1 * fixed.depth_mm, "{kept:?} {fixed:?}");
        assert!((half.depth_mm / fixed.depth_mm - 0.5).abs() < 0.1, "{half:?} {fixed:?}");
        assert!(half.forehead < fixed.forehead.map(|e| 0.6 * e));
        let table = csv(&[slide, raise].concat());
        assert_eq!(table.lines().count(), 9);
        assert!(table.contains("membrane,brow raise,half_way,0."));
    }

    /// On the mesh of the truth itself, elements of its material miss nothing; springs do, because triangles are not equilateral.
    #[test]
    fn elements_find_their_own_forces_again_and_springs_do_not() {
        let face = face::generic();
        let rows = skin_rows(&face, 0, Material::Fibres).unwrap();
        let raise = &rows[0];
        assert_eq!((raise.expression.as_str(), raise.ended), ("brow raise", Ended::Converged));
        assert!(raise.membrane[0] < 1e-9 && raise.membrane[1] < 1e-9, "{raise:?}");
        assert!(raise.springs[0] > 0.1 && (raise.springs[0] - raise.fine_springs[0]).abs() < 1e-9, "{raise:?}");
        let text = markdown(&[], &rows);
        assert!(text.contains("| brow raise | Fibres, 0 |"), "{text}");
    }
}
