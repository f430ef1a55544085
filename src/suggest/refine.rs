//! One press of the hand, sharpened: to the crossing of painted lines under it, or to where the skin of the first frame is found again.
//!
//! Both pictures are prepared once a frame ([`Prepared::of`]: 5 ms and 14 bytes a pixel for 1036 × 1036); a call then takes one or two
//! milliseconds. A call changes nothing; its answer is a proposal with a standard error.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::marking::grid_crossing::{self, Crossing, CrossingSettings, NoCrossing};
use crate::marking::patch::{self, Guess, Lost, Match, PatchSettings};
use crate::marking::tracking::Prepared;
use crate::pipeline::Outcome;

/// A place found with sub-pixel accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The place, px.
    pub at: Point2<f64>,
    /// Standard error along x and y, px.
    pub sigma_px: [f64; 2],
    /// What the fit leaves unexplained, as a share of the contrast: of the paint for a crossing, of the neighbourhood for a template.
    pub residual: f64,
    /// How it was found.
    pub kind: Refinement,
    /// The two fitted lines of a crossing, to be drawn; they meet at the crossing, which a point beside one does not share.
    pub lines: Option<[Line; 2]>,
}

/// How a place was refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refinement {
    /// Two painted lines were fitted.
    Crossing,
    /// The neighbourhood of the first frame was found again.
    Template,
}

impl Refinement {
    /// The word on screen and in files.
    pub fn word(self) -> &'static str {
        match self {
            Refinement::Crossing => "crossing",
            Refinement::Template => "template",
        }
    }
}

/// A straight piece of a painted line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// A place on it, px: where it meets the other.
    pub through: Point2<f64>,
    /// Unit direction; towards the right, or for the nearly upright line up or down.
    pub direction: Vector2<f64>,
    /// Width of the paint at half its darkness, px.
    pub width_px: f64,
}

/// Why a press could not be refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Why {
    /// There is no crossing of painted lines.
    #[error("{0}")]
    NoCrossing(#[from] NoCrossing),
    /// The skin about the point was not found again.
    #[error("{0}")]
    Lost(#[from] Lost),
    /// The match lies too far from where the hand pressed.
    #[error("the skin was found too far from here")]
    TooFar,
    /// The face has no such vertex.
    #[error("the face has no such vertex")]
    NoVertex,
}

/// A vertex this near to a crossing in the first frame is carried by it, mm.
const ON_CROSSING_MM: f64 = 0.4;
/// Half the side of the neighbourhood that is looked for, mm, and its limits in px.
const TEMPLATE_MM: f64 = 5.0;
const TEMPLATE_PX: [f64; 2] = [8.0, 80.0];
/// Least correlation of what is found, between noisy pictures.
const LEAST_CORRELATION: f64 = 0.35;
/// Correlation of what is the same skin, and how much nearer to the press than a crossing it must be found to be believed instead, mm.
const SAME_SKIN: f64 = 0.8;
const APART_MM: f64 = 1.0;
/// How far from the press the skin may be found, mm.
const REACH_MM: f64 = 2.0;

/// The crossing of two painted lines nearest to a place in one picture.
pub fn snap(picture: &Prepared, outcome: &Outcome, near: Point2<f64>) -> Result<Refined, Why> {
    let settings = CrossingSettings::at_scale(outcome.camera.px_per_mm);
    let found = grid_crossing::find(picture, near, &settings)?;
    Ok(Refined::of_crossing(&found, found.at))
}

/// Where a vertex lies in the last frame, near a place that the hand pressed.
///
/// If the vertex lies on a crossing of the painted grid in the first frame, or within 0.4 mm of one, the crossing carries it: the place is
/// that of the crossing in the last frame, plus what the vertex lies beside it. Otherwise the neighbourhood of the vertex in the first
/// frame is looked for. Where no crossing is found in the last frame, or the neighbourhood lies nearer to the press, the neighbourhood counts.
pub fn refine(
    first: &Prepared,
    last: &Prepared,
    outcome: &Outcome,
    vertex: u32,
    near: Point2<f64>,
) -> Result<Refined, Why> {
    let own = outcome.first_in_image.get(vertex as usize).ok_or(Why::NoVertex)?;
    let mm = outcome.camera.px_per_mm;
    let beside = CrossingSettings { reach_px: (ON_CROSSING_MM * mm).max(1.5), ..CrossingSettings::at_scale(mm) };
    if let Ok(from) = grid_crossing::find(first, *own, &beside) {
        let offset = own - from.at;
        // A crossing at the edge of the reach may be reported a little beyond it.
        if offset.norm() <= beside.reach_px
            && let Ok(to) = grid_crossing::find(last, near - offset, &CrossingSettings::at_scale(mm))
        {
            let place = to.at + offset;
            // Where a line runs into the corner of an eye it seems to cross another: then the skin itself is found nearer to the press.
            let nearer = (place - near).norm() - APART_MM * mm;
            let elsewhere = |m: Match| m.correlation >= SAME_SKIN && (m.at - near).norm() < nearer;
            if nearer <= 0.0 || !template(first, last, own, near, mm).is_ok_and(elsewhere) {
                let stretch = template(first, last, own, place, mm).map_or_else(|_| Matrix2::identity(), |m| m.warp);
                let mut refined = Refined::of_crossing(&to, to.at + stretch * offset);
                // Both crossings are known to within their errors.
                refined.sigma_px = [0, 1].map(|k| to.sigma_px[k].hypot(from.sigma_px[k]));
                return Ok(refined);
            }
        }
    }
    let found = template(first, last, own, near, mm)?;
    if (found.at - near).norm() > (REACH_MM * mm).max(4.0) {
        return Err(Why::TooFar);
    }
    let correlation = found.correlation.clamp(-1.0, 1.0);
    Ok(Refined {
        at: found.at,
        sigma_px: found.sigma_px,
        residual: (1.0 - correlation * correlation).sqrt(),
        kind: Refinement::Template,
        lines: None,
    })
}

/// The neighbourhood of the first frame, found near a place of the last: in the pictures of half the size first, so that a press some
/// pixels off is forgiven.
fn template(
    first: &Prepared,
    last: &Prepared,
    own: &Point2<f64>,
    near: Point2<f64>,
    px_per_mm: f64,
) -> Result<Match, Lost> {
    let radius_px = (TEMPLATE_MM * px_per_mm).clamp(TEMPLATE_PX[0], TEMPLATE_PX[1]);
    let (a, level) = first.level(1);
    let (b, _) = last.level(1);
    let scale = f64::from(1_u32 << level);
    let small = |p: &Point2<f64>| p.map(|c| (c - 0.5) / scale + 0.5);
    let coarse = PatchSettings { radius_px: 0.9 * radius_px, samples: 8, most_steps: 20, ..PatchSettings::default() };
    let start = patch::find(a, b, small(own), &Guess::at(small(&near)), &coarse);
    let guess = start.map_or(Guess::at(near), |m| Guess {
        at: own + (m.at - small(own)) * scale,
        warp: m.warp,
        bend: m.bend.map(|axis| axis.map(|v| v / scale)),
    });
    let sharp = PatchSettings { radius_px, samples: 11, ..PatchSettings::default() };
    let found = patch::find_finest(first.spline(), last.spline(), *own, &guess, &sharp)?;
    if found.correlation < LEAST_CORRELATION { Err(Lost::Unlike) } else { Ok(found) }
}

impl Refined {
    fn of_crossing(found: &Crossing, at: Point2<f64>) -> Self {
        let line = |k: usize| Line { through: found.at, direction: found.directions[k], width_px: found.widths_px[k] };
        Self {
            at,
            sigma_px: found.sigma_px,
            residual: found.residual,
            kind: Refinement::Crossing,
            lines: Some([line(0), line(1)]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marking::gray::Gray;
    use crate::pipeline::{self, Workspace};
    use crate::project::sample;

    fn scene() -> ([Prepared; 2], crate::project::Project, Outcome) {
        let project = sample::project().unwrap();
        let outcome = pipeline::solve(&project, &crate::face::generic(), [1036, 1036], &mut Workspace::default());
        let pictures = [1, 2].map(|k| {
            let picture = image::load_from_memory(sample::files()[k].1).unwrap().into_rgb8();
            Prepared::of(Gray::of(&picture).unwrap())
        });
        (pictures, project, outcome)
    }

    /// The sample's marks are the truth. A press three pixels beside it is brought back.
    #[test]
    fn a_press_beside_a_point_is_brought_to_it() {
        let ([first, last], project, outcome) = scene();
        let press = Vector2::new(2.1, -2.1);
        let mut errors: Vec<f64> = project
            .features
            .iter()
            .filter_map(|(&v, f)| {
                let truth = Point2::from(f.last?.at_px);
                let found = refine(&first, &last, &outcome, v, truth + press).ok()?;
                assert!(found.lines.is_some() == (found.kind == Refinement::Crossing));
                Some((found.at - truth).norm())
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        let marked = project.features.values().filter(|f| f.last.is_some()).count();
        println!("{} of {marked}: median {:.3} px", errors.len(), errors[errors.len() / 2]);
        assert!(errors.len() * 10 > marked * 8, "{} of {marked}", errors.len());
        assert!(errors[errors.len() / 2] < 0.4, "{}", errors[errors.len() / 2]);
    }

    /// No crossing draws a right press away: not at the inner corners of the eyes either, where a painted line that runs into the corner
    /// seems to cross another, and the next real crossing of the last frame lies 8 px beside it.
    #[test]
    fn no_crossing_draws_a_right_press_away() {
        let ([first, last], project, outcome) = scene();
        for (&v, f) in &project.features {
            let Some(mark) = f.last else { continue };
            let truth = Point2::from(mark.at_px);
            let found = refine(&first, &last, &outcome, v, truth);
            if let Ok(Refined { at, kind: Refinement::Crossing, .. }) = found {
                assert!((at - truth).norm() < 1.0, "vertex {v} went {:.2} px away", (at - truth).norm());
            }
        }
    }

    #[test]
    fn a_press_beside_a_crossing_snaps_in_one_picture_and_elsewhere_says_why() {
        let ([first, _], _, outcome) = scene();
        // The middle of the forehead of the first frame: the painted lines run at multiples of 8 mm from the origin of the face.
        let camera = &outcome.camera;
        let near = camera.image_from_face(&nalgebra::Point3::new(0.0, 48.0, 12.0));
        let found = snap(&first, &outcome, near + Vector2::new(3.0, 2.0)).unwrap();
        assert!((found.at - near).norm() < 2.0 && found.sigma_px[0] < 0.1 && found.residual < 0.2, "{found:?}");
        let lines = found.lines.unwrap();
        assert!(lines[0].direction.x > 0.95 && lines[1].direction.y.abs() > 0.95);
        assert!((2.5..7.0).contains(&lines[0].width_px), "1 mm at 4.2 px/mm: {}", lines[0].width_px);
        assert_eq!(snap(&first, &outcome, Point2::new(20.0, 300.0)).unwrap_err(), Why::NoCrossing(NoCrossing::NoLines));
        assert!(refine(&first, &first, &outcome, 100_000, near).is_err());
    }
}
