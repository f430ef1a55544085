//! Profiles of the observed forces along and across a muscle, with what each law says there (Thesis Fig. 5.7).

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::analysis::Analysis;
use super::fibres::FibreOf;
use super::section::{Line, cuts};
use crate::face::Mesh;
use crate::face::mesh::doubled_area_vector;
use crate::fit::LawFit;
use crate::pipeline::Outcome;

/// Which way a profile runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Along the fibre, from its attachment to its insertion and beyond: radial.
    Radial,
    /// Across the fibre at its insertion: lateral.
    Lateral,
}

impl Way {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Radial, Self::Lateral];

    /// Word of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Radial => "radial",
            Self::Lateral => "lateral",
        }
    }

    /// What is counted along it.
    pub fn axis(self) -> &'static str {
        match self {
            Self::Radial => "from the attachment towards the insertion, mm",
            Self::Lateral => "across the fibre at the insertion, mm",
        }
    }
}

/// What of the force is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// Its component along the fibre laid into the skin, signed: positive pulls to the bone.
    #[default]
    AlongFibre,
    /// Its length.
    Magnitude,
}

/// One observed force of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// The vertex.
    pub vertex: u32,
    /// Coordinate along the profile, mm.
    pub at_mm: f64,
    /// Value, N or relative.
    pub value: f64,
    /// Standard error.
    pub sigma: f64,
    /// Whether fits may use it ([`Outcome::is_believed`]).
    pub believed: bool,
}

/// What a model says along a profile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Coordinate (mm) and value; a value that is no number breaks the line.
    pub points: Vec<[f64; 2]>,
}

/// One profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Which way it runs.
    pub way: Way,
    /// Its line in the plan.
    pub line: Line,
    /// Coordinate of the insertion along it, mm.
    pub insertion_mm: f64,
    /// Vertices within the muscle's band.
    pub observed: Vec<Observed>,
    /// One curve a model, in the order given.
    pub curves: Vec<Curve>,
}

/// A force that a model puts on a point of the skin, N.
pub type Model<'a> = &'a dyn Fn(&Point3<f64>) -> Vector3<f64>;

/// Cuts a profile; none where the muscle stands upright on the plan.
///
/// The observed forces are those of vertices within the muscle's half width of the fibre, and within a row of the line across it. Models are evaluated on the skin itself where the
/// line cuts it, not on the straight fibre below it: a forehead is round.
pub fn profile(
    mesh: &Mesh,
    outcome: &Outcome,
    of: &FibreOf,
    way: Way,
    part: Part,
    models: &[Model<'_>],
) -> Option<Profile> {
    let fibre = &of.fibre;
    let line = match way {
        Way::Radial => Line::between(&fibre.attachment, &fibre.insertion, fibre.half_width_mm)?,
        // As far to either side as a row of vertices lies from the next: farther up the fibre pulls differently.
        Way::Lateral => across(&fibre.attachment, &fibre.insertion, 0.75 * mesh.mean_edge_length())?,
    };
    let pull = fibre.pull();
    let shown = |force: &Vector3<f64>, normal: &Vector3<f64>| match part {
        Part::Magnitude => force.norm(),
        Part::AlongFibre => laid_into(&pull, normal).map_or(f64::NAN, |d| force.dot(&d)),
    };
    let observed = observed(mesh, outcome, &line, &shown);
    let reach = reach_mm(way, fibre.length_mm(), fibre.half_width_mm, &observed);
    let curves = curves(mesh, &outcome.first, &line, reach, &shown, models);
    let insertion_mm = line.place(&fibre.insertion).0;
    Some(Profile { way, line, insertion_mm, observed, curves })
}

/// The same for one muscle of an analysis (index in its fibres), with a curve for each of its laws; the curve of a law that could not be
/// fitted is empty.
pub fn profile_of_laws(
    mesh: &Mesh,
    outcome: &Outcome,
    analysis: &Analysis,
    fibre: usize,
    way: Way,
    part: Part,
) -> Option<Profile> {
    let fibres = analysis.set_fibres();
    let fits: Vec<Option<&LawFit>> = analysis.laws.iter().map(|row| row.fit.as_ref().ok()).collect();
    let says = &|k: usize, x: &Point3<f64>| fits[k].map_or_else(Vector3::zeros, |fit| fit.force_at(&fibres, x));
    let models: Vec<_> = (0..fits.len()).map(|k| move |x: &Point3<f64>| says(k, x)).collect();
    let models: Vec<Model<'_>> = models.iter().map(|m| m as Model<'_>).collect();
    let mut found = profile(mesh, outcome, analysis.fibres.get(fibre)?, way, part, &models)?;
    for (curve, fit) in found.curves.iter_mut().zip(&fits) {
        if fit.is_none() {
            curve.points.clear();
        }
    }
    Some(found)
}

/// Through the insertion, square to the fibre in the plan; grows with x.
fn across(attachment: &Point3<f64>, insertion: &Point3<f64>, half_width_mm: f64) -> Option<Line> {
    let along = (insertion.xy() - attachment.xy()).try_normalize(1e-9)?;
    let square = Vector2::new(-along.y, along.x);
    let along = if square.x < 0.0 { -square } else { square };
    Some(Line { origin: Point2::from(insertion.xy()), along, start: 0.0, half_band_mm: half_width_mm })
}

/// The direction of a fibre laid into the skin with that normal.
fn laid_into(pull: &Vector3<f64>, normal: &Vector3<f64>) -> Option<Vector3<f64>> {
    (pull - normal * normal.dot(pull)).try_normalize(1e-6)
}

fn observed(
    mesh: &Mesh,
    outcome: &Outcome,
    line: &Line,
    shown: &dyn Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
) -> Vec<Observed> {
    let (forces, sigmas) = outcome.measured();
    let mut all: Vec<Observed> = outcome
        .states
        .iter()
        .enumerate()
        .filter(|(_, state)| state.is_known())
        .filter_map(|(v, _)| {
            let (at_mm, aside) = line.place(outcome.first.get(v)?);
            let force = forces.get(v).filter(|_| aside.abs() <= line.half_band_mm)?;
            let value = shown(force, &mesh.normal_at(&outcome.first, v));
            let sigma = sigmas.get(v).copied().unwrap_or(0.0);
            let one = Observed { vertex: v as u32, at_mm, value, sigma, believed: outcome.is_believed(v) };
            value.is_finite().then_some(one)
        })
        .collect();
    all.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
    all
}

/// How far the curves are drawn: over the muscle and to where laws end, and as far as something was observed near it.
fn reach_mm(way: Way, length: f64, half_width: f64, observed: &[Observed]) -> [f64; 2] {
    let [from, to] = match way {
        Way::Radial => [-0.25 * length, 1.6 * length],
        Way::Lateral => [-3.0 * half_width, 3.0 * half_width],
    };
    let ends = observed.iter().filter(|o| o.believed && o.at_mm > 2.0 * from - to && o.at_mm < 2.0 * to - from);
    ends.fold([from, to], |[a, b], o| [a.min(o.at_mm), b.max(o.at_mm)])
}

fn curves(
    mesh: &Mesh,
    first: &[Point3<f64>],
    line: &Line,
    [from, to]: [f64; 2],
    shown: &dyn Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
    models: &[Model<'_>],
) -> Vec<Curve> {
    /// Steps within one triangle: laws change faster than the mesh.
    const STEPS: usize = 6;
    let faces_front = |t: [u32; 3]| doubled_area_vector(first, t).z > 0.0;
    let mut curves = vec![Curve::default(); models.len()];
    let mut reached = f64::NEG_INFINITY;
    for cut in cuts(mesh, first, line, faces_front) {
        let [(a, ..), (b, ..)] = cut.ends;
        if b < from || a > to {
            continue;
        }
        let normal = doubled_area_vector(first, mesh.triangles()[cut.triangle]).try_normalize(1e-12);
        let Some(normal) = normal else { continue };
        let [start, end] = cut.points(first);
        let gap = a > reached + 0.5;
        for (curve, model) in curves.iter_mut().zip(models) {
            if gap && !curve.points.is_empty() {
                curve.points.push([a, f64::NAN]);
            }
            // The last place of a piece is the first of the next.
            for k in 0..STEPS {
                let share = k as f64 / STEPS as f64;
                let x = start + (end - start) * share;
                let at = a + (b - a) * share;
                // Where the line runs along an edge, both triangles beside it are cut there: the first one speaks.
                if (from..=to).contains(&at) && at >= reached {
                    curve.points.push([at, shown(&model(&x), &normal)]);
                }
            }
        }
        reached = reached.max(b);
    }
    curves
}
