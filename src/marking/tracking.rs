//! Finds many points of skin again in another picture: coarse to fine, over a painted grid if there is one, all the skin at once.
//!
//! ```text
//!  smallest picture ─▶ … ─▶ half ─▶ field of the motion ─▶ grid: which crossing is which ─▶ all the skin ─▶ every point, judged
//! ```
//!
//! Scouts, some of the points, are followed from the smallest copy of the pictures to the half-sized one; the motion between them is the
//! field. A painted grid repeats itself, so a match alone may sit in the wrong cell; the grid's crossings are therefore told apart by
//! walking along the lines and by the skin inside its cells, and hold all skin near them. The field begins the registration
//! ([`super::registration`]), which says where every point lies; where it fits badly a point's own neighbourhood is asked. Through the
//! frames of a film the field is carried from frame to frame, while the first frame is registered to the last directly, so that errors
//! do not add up.

use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use super::grid::{self, Carried};
use super::lead::{Lead, Leader};
use super::patch::{self, Guess, Lost, Match, PatchSettings};
use super::prepared::HALVINGS;
pub use super::prepared::Prepared;
use super::registration::{Registered, Registration, Skin, Task};

/// Choices of the tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackSettings {
    /// Size of the face in the picture, px per mm. Default 4.
    pub px_per_mm: f64,
    /// Half the side of a neighbourhood, mm. Default 7: a third of it carries most of the weight.
    pub radius_mm: f64,
    /// The same for a point on a crossing of the grid, where two lines say all, and where skin folds. Default 4.2.
    pub close_mm: f64,
    /// How far a point may lie from where its neighbours lead, mm. Default 1.5.
    pub stray_mm: f64,
    /// Least correlation that counts as the same skin. Default 0.35: skin is faint and pictures are noisy.
    pub least_correlation: f64,
    /// Whether to look for a painted grid. Default true.
    pub grid: bool,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self { px_per_mm: 4.0, radius_mm: 7.0, close_mm: 4.2, stray_mm: 1.5, least_correlation: 0.35, grid: true }
    }
}

/// A point to find.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Where it lies in the first picture, px.
    pub first: Point2<f64>,
    /// Where a hand has marked it in the other, px.
    pub known: Option<Point2<f64>>,
    /// A triangle of the skin that it belongs to, if known: of lips that touch its place alone does not tell which.
    pub triangle: Option<u32>,
}

impl Point {
    /// A point that nobody has marked.
    pub fn at(first: Point2<f64>) -> Self {
        Self { first, known: None, triangle: None }
    }
}

/// How a point was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// It lies on a crossing of the painted grid, which carries it.
    Crossing {
        /// Number of the upright line, counted to the right from 0.
        column: i32,
        /// Number of the level line, counted downwards from 0.
        row: i32,
    },
    /// Its neighbourhood was found between crossings that lead there.
    Grid,
    /// Its neighbourhood was found, beginning where the field leads.
    Field,
}

/// A point found again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Where it lies in the other picture, px.
    pub at: Point2<f64>,
    /// Standard error along x and y that the search states, px: on skin about three times too small, because slopes of noise look like
    /// something to hold on to; [`super::confidence`] corrects it.
    pub sigma_px: [f64; 2],
    /// What the pictures differ by about it, in variances of their noise, or of that of the scenes on which confidence was fitted where
    /// they have less: 1 where they agree; see [`Registered::unlike`].
    pub misfit: f64,
    /// How sure it is that the point lies within 1 px, 0 to 1; see [`super::confidence`].
    pub confidence: f64,
    /// How it was found.
    pub method: Method,
}

/// Follows points of one picture through others.
pub struct Tracker<'a> {
    first: &'a Prepared,
    points: &'a [Point],
    settings: TrackSettings,
    /// Crossings in the first picture.
    pieces: Vec<grid::Piece>,
    field: Vec<Leader>,
}

/// What was found in a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tracks {
    /// One answer a point; none for those that are known.
    pub points: Vec<Option<Result<Tracked, Lost>>>,
    /// The crossings of the painted grid that were found in both pictures.
    pub grid: Vec<Carried>,
    /// Variance that compression adds to every place, px² along each axis; see [`super::compressed`].
    pub compressed_px2: f64,
    /// What leads: known points, crossings, and points found, by which a point that was not found can be led.
    pub leaders: Vec<Leader>,
}

/// Most scouts.
const SCOUTS: usize = 300;
/// Half the side of a scout's neighbourhood at each level, px of it; the picture itself first (not used).
const SCOUT_PX: [f64; HALVINGS + 1] = [14.0, 14.0, 12.0, 10.0, 9.0];
/// A scout farther than this from what its neighbours say is not believed, px of its level and times their scatter.
const SCOUT_STRAY: [f64; 2] = [0.8, 2.5];
/// Error that is stated of a mark and of a crossing as leaders, px.
const KNOWN_SIGMA_PX: f64 = 0.1;
/// A point this near to a crossing in the first picture is carried by it, mm.
const ON_CROSSING_MM: f64 = 0.4;
/// Half the side of a neighbourhood, px: least and most.
const RADIUS_PX: [f64; 2] = [8.0, 80.0];
/// Distance of the places compared in it, px: nearer ones share their noise.
const COMPARED_PX: f64 = 1.6;
/// A misfit from which the registration is doubted, and how much less the neighbourhood alone must leave unexplained.
const DOUBTFUL: f64 = 4.0;
const BETTER: f64 = 0.7;
/// Skin whose share of its surroundings' slopes is smaller is not found: it is too even.
const LEAST_TOLD: f64 = 0.04;
/// A place whose standard error is larger is not found, px.
const MOST_SIGMA_PX: f64 = 3.0;
/// Fewest crossings found in both pictures that lead.
const FEWEST_CROSSINGS: usize = 6;

impl<'a> Tracker<'a> {
    /// Begins at the first picture: finds the crossings of a painted grid in it.
    pub fn new(first: &'a Prepared, points: &'a [Point], settings: TrackSettings) -> Self {
        let about: Vec<Point2<f64>> = points.iter().map(|p| p.first).collect();
        let find = || grid::pieces(first, &about, settings.px_per_mm);
        let pieces = if settings.grid { together(find) } else { Vec::new() };
        Self { first, points, settings, pieces, field: Vec::new() }
    }

    /// Goes on to a picture on the way: the field of the motion follows, from small to large.
    pub fn advance(&mut self, picture: &Prepared) {
        self.field = self.scouted(picture, &[]);
    }

    /// What was followed so far.
    pub fn into_field(self) -> Vec<Leader> {
        self.field
    }

    /// Goes on from where another tracker of the same points had come.
    #[must_use]
    pub fn after(self, field: Vec<Leader>) -> Self {
        Self { field, ..self }
    }

    /// Finds every point in the last picture, on the skin that the first shows.
    pub fn find(&self, last: &Prepared, skin: &Skin) -> Tracks {
        together(|| self.found(last, skin))
    }

    fn found(&self, last: &Prepared, skin: &Skin) -> Tracks {
        let known: Vec<Leader> = self.points.iter().filter_map(leader_of_mark).collect();
        let field = self.scouted(last, &known);
        let expected = |at: &Point2<f64>| Lead::of(&field, at, None).map(|l| l.guess.at);
        let mut grid = Vec::new();
        if !self.pieces.is_empty() {
            let about: Vec<Point2<f64>> = self.points.iter().filter_map(|p| expected(&p.first)).collect();
            let pieces = grid::pieces(last, &about, self.settings.px_per_mm);
            grid = grid::carry([self.first, last], [&self.pieces, &pieces], &expected);
        }
        if grid.len() < FEWEST_CROSSINGS {
            grid.clear();
        }
        let crossings = grid.iter().map(|c| Leader {
            first: c.first.at,
            last: c.last.at,
            sigma_px: c.last.sigma_px[0].max(c.last.sigma_px[1]).max(KNOWN_SIGMA_PX),
            triangle: None,
        });
        let anchors: Vec<Leader> = known.iter().copied().chain(crossings).collect();
        let s = &self.settings;
        // Scouts may sit in the wrong cell of a grid: where its crossings lead they are not asked.
        let far = APART_MM * s.px_per_mm;
        let apart = |l: &Leader| grid.iter().all(|c| (c.first.at - l.first).norm() > far);
        let begin: Vec<Leader> = field.into_iter().filter(apart).collect();
        let registration = Registration::of(&Task {
            pictures: [self.first, last],
            skin,
            px_per_mm: s.px_per_mm,
            anchors: &anchors,
            begin: &begin,
        });
        let leads: Vec<Leader> = anchors.iter().chain(&begin).copied().collect();
        // Painted lines are strong enough for any coder: about them skin goes where they go.
        let compressed_px2 =
            if grid.is_empty() { super::compressed::variance_px2([self.first, last], skin, s.px_per_mm) } else { 0.0 };
        let one = |p: &Point| {
            if p.known.is_some() {
                return None;
            }
            let registered = registration.as_ref().and_then(|r| r.at(&p.first, skin.triangle(&p.first, p.triangle)?));
            let on = self.crossing_at(&p.first, &grid);
            let method = match on {
                Some(c) => Method::Crossing { column: c.column, row: c.row },
                None if grid.is_empty() => Method::Field,
                None => Method::Grid,
            };
            let found = self.one(last, &p.first, registered, &leads, on, method);
            Some(found.map(|t| Tracked { confidence: super::confidence::of(&t, compressed_px2), ..t }))
        };
        let points: Vec<_> = self.points.par_iter().map(one).collect();
        let found = self.points.iter().zip(&points).filter_map(|(p, answer)| {
            let t = answer.as_ref()?.as_ref().ok()?;
            let sigma_px = t.sigma_px[0].hypot(t.sigma_px[1]);
            Some(Leader { first: p.first, last: t.at, sigma_px, triangle: p.triangle })
        });
        let leaders = known.iter().copied().chain(found).collect();
        Tracks { points, grid, compressed_px2, leaders }
    }

    /// The motion of some of the points, coarse to fine. `known` places stay.
    fn scouted(&self, last: &Prepared, known: &[Leader]) -> Vec<Leader> {
        let stride = self.points.len().div_ceil(SCOUTS).max(1);
        let scouts: Vec<Point2<f64>> = self.points.iter().step_by(stride).map(|p| p.first).collect();
        let start = if self.field.is_empty() { HALVINGS } else { HALVINGS / 2 };
        let mut field: Vec<Leader> = self.field.iter().chain(known).copied().collect();
        for halvings in (1..=start).rev() {
            let (a, level) = self.first.level(halvings);
            let (b, _) = last.level(halvings);
            if level < halvings {
                continue;
            }
            let scale = f64::from(1_u32 << level);
            // Between pixels of a halved picture lie 2 of the larger; both begin at the top-left corner of pixel 0.
            let small = |p: &Point2<f64>| p.map(|c| (c - 0.5) / scale + 0.5);
            let settings = PatchSettings {
                radius_px: SCOUT_PX[level],
                samples: 9,
                stretch: 0.3,
                bend_per_px: 0.008 * scale,
                close_px: 0.03,
                most_steps: 12,
            };
            let found: Vec<Leader> = scouts
                .par_iter()
                .filter_map(|at| {
                    let lead = Lead::of(&field, at, None).map_or(Guess::at(*at), |l| l.guess);
                    let guess =
                        Guess { at: small(&lead.at), warp: lead.warp, bend: lead.bend.map(|b| b.map(|v| v * scale)) };
                    let m = patch::find(a, b, small(at), &guess, &settings).ok()?;
                    let moved = (m.at - small(at)) * scale;
                    let sigma_px = scale * m.sigma_px[0].hypot(m.sigma_px[1]).max(0.05);
                    Some(Leader { first: *at, last: at + moved, sigma_px, triangle: None })
                })
                .collect();
            let believed = believed(&found, scale);
            field = known.iter().chain(&believed).copied().collect();
        }
        field
    }

    fn crossing_at<'g>(&self, at: &Point2<f64>, grid: &'g [Carried]) -> Option<&'g Carried> {
        let within = (ON_CROSSING_MM * self.settings.px_per_mm).max(1.0);
        grid.iter().find(|c| (c.first.at - at).norm() < within)
    }

    /// A point: where the registration has it; its own neighbourhood on a crossing and where nothing is registered.
    fn one(
        &self,
        last: &Prepared,
        at: &Point2<f64>,
        registered: Option<Registered>,
        leads: &[Leader],
        on: Option<&Carried>,
        method: Method,
    ) -> Result<Tracked, Lost> {
        let s = &self.settings;
        let lead = || Lead::of(leads, at, None).map_or(Guess::at(*at), |l| l.guess);
        let mut guess = registered.map_or_else(lead, |r| r.guess);
        if let Some(c) = on {
            guess.at = c.last.at + guess.warp * (at - c.first.at);
        }
        let own = |mm: f64| {
            let m = self.patch(last, at, &guess, &settings_of(self.radius_px(mm)))?;
            self.believable(m, &guess)
        };
        let of = |at: Point2<f64>, sigma_px: [f64; 2], misfit: f64| Tracked {
            at,
            sigma_px,
            misfit,
            confidence: 0.0,
            method,
        };
        let tracked = match (registered, on) {
            (Some(r), None) if r.told < LEAST_TOLD || r.sigma_px[0].max(r.sigma_px[1]) > MOST_SIGMA_PX => {
                return Err(Lost::TooEven);
            }
            // Skin that folds or unfolds may move as no smooth surface does: there its own neighbourhood is asked, too.
            (Some(r), None) => match (r.misfit > DOUBTFUL).then(|| own(s.close_mm)) {
                Some(Ok(m)) if m.left < BETTER * r.left => of(m.at, m.sigma_px, r.unlike * (m.left / r.left).powi(2)),
                _ => of(r.guess.at, r.sigma_px, r.unlike),
            },
            (r, on) => {
                let m = own(if on.is_some() { s.close_mm } else { s.radius_mm })?;
                of(m.at, m.sigma_px, r.map_or(1.0, |r| r.unlike))
            }
        };
        Ok(tracked)
    }

    fn radius_px(&self, mm: f64) -> f64 {
        limited(mm * self.settings.px_per_mm)
    }

    fn patch(&self, last: &Prepared, at: &Point2<f64>, guess: &Guess, settings: &PatchSettings) -> Result<Match, Lost> {
        patch::find(self.first.spline(), last.spline(), *at, guess, settings)
    }

    /// What looks like the skin that was sought, not far from where it was sought.
    fn believable(&self, found: Match, guess: &Guess) -> Result<Match, Lost> {
        let s = &self.settings;
        let stray = (found.at - guess.at).norm();
        let near = stray <= (s.stray_mm * s.px_per_mm).max(3.0);
        if near && found.correlation >= s.least_correlation { Ok(found) } else { Err(Lost::Unlike) }
    }
}

fn limited(radius_px: f64) -> f64 {
    radius_px.clamp(RADIUS_PX[0], RADIUS_PX[1])
}

/// Choices for a neighbourhood of a size.
fn settings_of(radius_px: f64) -> PatchSettings {
    let samples = (radius_px / COMPARED_PX).ceil() as usize;
    PatchSettings { radius_px, samples, ..PatchSettings::default() }
}

/// Beside a crossing no scout is needed, mm.
const APART_MM: f64 = 6.0;

fn leader_of_mark(p: &Point) -> Option<Leader> {
    p.known.map(|last| Leader { first: p.first, last, sigma_px: KNOWN_SIGMA_PX, triangle: p.triangle })
}

/// Scouts that move as those about them do.
fn believed(found: &[Leader], scale: f64) -> Vec<Leader> {
    let agrees = |(i, l): (usize, &Leader)| {
        let Some(lead) = Lead::of(found, &l.first, Some(i)) else { return true };
        let stray = (lead.guess.at - l.last).norm();
        stray < SCOUT_STRAY[0] * scale + SCOUT_STRAY[1] * lead.scatter.min(scale)
    };
    found.par_iter().enumerate().filter(|(i, l)| agrees((*i, l))).map(|(_, l)| *l).collect()
}

/// Does something among the threads that share work: called from outside, each of many short passes would have to wake them.
fn together<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| work())
}

/// Finds points of the first picture in the last; see [`Tracker`].
pub fn track(first: &Prepared, last: &Prepared, points: &[Point], skin: &Skin, settings: &TrackSettings) -> Tracks {
    Tracker::new(first, points, *settings).find(last, skin)
}

/// Where what was found leads a point that was not: no match, only the motion of its surroundings, with the distance of the three
/// nearest that lead, px. None where nothing was found at all.
pub fn led(tracks: &Tracks, first: &Point2<f64>) -> Option<(Point2<f64>, f64)> {
    let lead = Lead::of(&tracks.leaders, first, None)?;
    let plain = Vector2::new(lead.guess.at.x - first.x, lead.guess.at.y - first.y);
    Some((first + plain, lead.distance))
}
