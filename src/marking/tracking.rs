//! Finds many points of skin again in another picture: coarse to fine, over a painted grid if there is one, each led by its neighbours.
//!
//! ```text
//!  smallest picture ─▶ … ─▶ half ─▶ field of the motion ─▶ grid: which crossing is which ─▶ every point, sub-pixel ─▶ judged
//! ```
//!
//! Scouts, some of the points, are followed from the smallest copy of the pictures to the half-sized one; the motion between them is the
//! field. A painted grid repeats itself, so a match alone may sit in the wrong cell; the grid's crossings are therefore told apart by
//! walking along the lines, and lead all points near them. Through the frames of a film the field is carried from frame to frame, while
//! every neighbourhood is cut from the first frame, so that errors do not add up.

use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use super::grid::{self, Carried};
use super::lead::{Lead, Leader};
use super::patch::{self, Guess, Lost, Match, PatchSettings};
use super::prepared::HALVINGS;
pub use super::prepared::Prepared;

/// Choices of the tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackSettings {
    /// Size of the face in the picture, px per mm. Default 4.
    pub px_per_mm: f64,
    /// Half the side of a neighbourhood, mm. Default 7: a third of it carries most of the weight.
    pub radius_mm: f64,
    /// The same for a point on a crossing of the grid, where two lines say all. Default 4.2.
    pub crossing_mm: f64,
    /// How far a point may lie from where its neighbours lead, mm. Default 1.5.
    pub stray_mm: f64,
    /// Least correlation that counts as the same skin. Default 0.35: skin is faint and pictures are noisy.
    pub least_correlation: f64,
    /// Whether to look for a painted grid. Default true.
    pub grid: bool,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self { px_per_mm: 4.0, radius_mm: 7.0, crossing_mm: 4.2, stray_mm: 1.5, least_correlation: 0.35, grid: true }
    }
}

/// A point to find.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Where it lies in the first picture, px.
    pub first: Point2<f64>,
    /// Where a hand has marked it in the other, px.
    pub known: Option<Point2<f64>>,
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
    /// Standard error along x and y, px; see [`Match::sigma_px`].
    pub sigma_px: [f64; 2],
    /// Correlation of the neighbourhoods, at most 1.
    pub correlation: f64,
    /// How far it moved differently from what its neighbours say, px; none where it has none.
    pub stray_px: Option<f64>,
    /// How much those neighbours differ among themselves, px.
    pub scatter_px: f64,
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
    /// What leads: known points, crossings, and points found, by which a point that was not found can be led.
    pub leaders: Vec<Leader>,
}

/// What is known of a point while it is looked for; none of one that a hand has marked.
type Answer = Option<Result<Match, Lost>>;

/// Most scouts.
const SCOUTS: usize = 170;
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
/// How far stretch and bend may be from those of the points about one that were found, standard deviation.
const LED_STRETCH: f64 = 0.03;
const LED_BEND_PER_PX: f64 = 0.0015;
/// So many smaller neighbourhoods are asked, each this share of the one before; so many standard errors apart one contradicts it.
const SMALLER: usize = 2;
const SHRINK: f64 = 0.6;
const CONTRADICTS: f64 = 3.0;
/// Fewest crossings found in both pictures that lead.
const FEWEST_CROSSINGS: usize = 6;

impl<'a> Tracker<'a> {
    /// Begins at the first picture: finds the crossings of a painted grid in it.
    pub fn new(first: &'a Prepared, points: &'a [Point], settings: TrackSettings) -> Self {
        let about: Vec<Point2<f64>> = points.iter().map(|p| p.first).collect();
        let pieces = if settings.grid { grid::pieces(first, &about, settings.px_per_mm) } else { Vec::new() };
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

    /// Finds every point in the last picture.
    pub fn find(&self, last: &Prepared) -> Tracks {
        let known: Vec<Leader> = self.points.iter().filter_map(leader_of_mark).collect();
        let field = self.scouted(last, &known);
        let expected = |at: &Point2<f64>| Lead::of(&field, at, None).map(|l| l.guess.at);
        let mut grid = Vec::new();
        if !self.pieces.is_empty() {
            let about: Vec<Point2<f64>> = self.points.iter().filter_map(|p| expected(&p.first)).collect();
            grid = grid::carry(&self.pieces, &grid::pieces(last, &about, self.settings.px_per_mm), &expected);
        }
        if grid.len() < FEWEST_CROSSINGS {
            grid.clear();
        }
        let crossings = grid.iter().map(|c| Leader {
            first: c.first.at,
            last: c.last.at,
            sigma_px: c.last.sigma_px[0].max(c.last.sigma_px[1]).max(KNOWN_SIGMA_PX),
        });
        let mut leaders: Vec<Leader> = known.iter().copied().chain(crossings).collect();
        let anchors = leaders.len();
        let led_by_grid = !grid.is_empty();
        if !led_by_grid {
            leaders.extend(&field);
        }
        let mut answers = self.all(last, &leaders, &field, &grid);
        leaders.truncate(anchors);
        self.settle(last, &leaders, &mut answers, &grid);
        self.judged(answers, &known, grid)
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
                    Some(Leader { first: *at, last: at + moved, sigma_px })
                })
                .collect();
            let believed = believed(&found, scale);
            field = known.iter().chain(&believed).copied().collect();
        }
        field
    }

    /// Every point that is not known, each from where the leaders lead.
    fn all(&self, last: &Prepared, leaders: &[Leader], field: &[Leader], grid: &[Carried]) -> Vec<Answer> {
        let far = 3.0 * MOST_CELL_MM * self.settings.px_per_mm;
        let one = |p: &Point| {
            if p.known.is_some() {
                return None;
            }
            let near = Lead::of(leaders, &p.first, None).filter(|l| l.distance < far);
            let lead = near.or_else(|| Lead::of(field, &p.first, None));
            Some(self.one(last, &p.first, lead, self.crossing_at(&p.first, grid)))
        };
        self.points.par_iter().map(one).collect()
    }

    fn crossing_at<'g>(&self, at: &Point2<f64>, grid: &'g [Carried]) -> Option<&'g Carried> {
        let within = (ON_CROSSING_MM * self.settings.px_per_mm).max(1.0);
        grid.iter().find(|c| (c.first.at - at).norm() < within)
    }

    fn one(&self, last: &Prepared, at: &Point2<f64>, lead: Option<Lead>, on: Option<&Carried>) -> Result<Match, Lost> {
        let s = &self.settings;
        let mut guess = lead.map_or(Guess::at(*at), |l| l.guess);
        let mm = if on.is_some() { s.crossing_mm } else { s.radius_mm };
        if let Some(c) = on {
            guess.at = c.last.at + guess.warp * (at - c.first.at);
        }
        let found = self.patch(last, at, &guess, &settings_of(self.radius_px(mm)))?;
        self.believable(found, &guess)
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

    /// Looks for every point once more, from where those found about it lead: nearer and finer than the field, so that stretch and bend are
    /// held to theirs, and noise has less to say. Where a smaller neighbourhood contradicts the larger, skin bends more than it can follow,
    /// and the smaller is believed.
    fn settle(&self, last: &Prepared, anchors: &[Leader], answers: &mut [Answer], grid: &[Carried]) {
        let mut leaders = anchors.to_vec();
        let found = self.found(answers);
        let own: Vec<Option<usize>> = found
            .into_iter()
            .map(|leader| {
                leaders.extend(leader);
                leader.map(|_| leaders.len() - 1)
            })
            .collect();
        let again: Vec<Answer> = (0..answers.len())
            .into_par_iter()
            .map(|i| {
                if !matches!(answers[i], Some(Ok(_) | Err(Lost::Unsettled | Lost::Unlike))) {
                    return None;
                }
                let at = &self.points[i].first;
                let lead = Lead::of(&leaders, at, own[i]);
                if let Some(on) = self.crossing_at(at, grid) {
                    return Some(self.one(last, at, lead, Some(on)));
                }
                let guess = lead.map_or(Guess::at(*at), |l| l.guess);
                Some(self.smallest_that_contradicts(last, at, &guess))
            })
            .collect();
        for (answer, again) in answers.iter_mut().zip(again) {
            if matches!(answer, Some(Err(_))) || matches!(again, Some(Ok(_))) {
                *answer = again.or(*answer);
            }
        }
    }

    /// The neighbourhood of the usual size, or a smaller one where that says something else for certain.
    fn smallest_that_contradicts(&self, last: &Prepared, at: &Point2<f64>, guess: &Guess) -> Result<Match, Lost> {
        let mut radius_px = self.radius_px(self.settings.radius_mm);
        let held = PatchSettings { stretch: LED_STRETCH, bend_per_px: LED_BEND_PER_PX, ..settings_of(radius_px) };
        let mut found = self.patch(last, at, guess, &held).and_then(|m| self.believable(m, guess))?;
        for _ in 0..SMALLER {
            radius_px = limited(radius_px * SHRINK);
            let from = Guess { at: found.at, warp: found.warp, bend: found.bend };
            let small = self.patch(last, at, &from, &settings_of(radius_px)).and_then(|m| self.believable(m, guess));
            let Ok(small) = small else { break };
            let apart = small.at - found.at;
            let in_errors = (apart.x / small.sigma_px[0]).hypot(apart.y / small.sigma_px[1]);
            if in_errors < CONTRADICTS {
                break;
            }
            found = small;
        }
        Ok(found)
    }

    /// The points that were found, as leaders of others.
    fn found(&self, answers: &[Answer]) -> Vec<Option<Leader>> {
        let of = |(p, a): (&Point, &Answer)| {
            let m = a.as_ref()?.as_ref().ok()?;
            Some(Leader { first: p.first, last: m.at, sigma_px: m.sigma_px[0].hypot(m.sigma_px[1]) })
        };
        self.points.iter().zip(answers).map(of).collect()
    }

    /// What the neighbours say of each, and how sure it is.
    fn judged(&self, answers: Vec<Answer>, known: &[Leader], grid: Vec<Carried>) -> Tracks {
        let mut leaders = known.to_vec();
        let mut own = vec![None; answers.len()];
        for (i, leader) in self.found(&answers).into_iter().enumerate() {
            if let Some(leader) = leader {
                own[i] = Some(leaders.len());
                leaders.push(leader);
            }
        }
        let judge = |(i, answer): (usize, Answer)| {
            let m = match answer? {
                Ok(m) => m,
                Err(lost) => return Some(Err(lost)),
            };
            let at = self.points[i].first;
            let lead = Lead::of(&leaders, &at, own[i]);
            let method = match self.crossing_at(&at, &grid) {
                Some(c) => Method::Crossing { column: c.column, row: c.row },
                None if grid.is_empty() => Method::Field,
                None => Method::Grid,
            };
            let mut tracked = Tracked {
                at: m.at,
                sigma_px: m.sigma_px,
                correlation: m.correlation,
                stray_px: lead.map(|l| (l.guess.at - m.at).norm()),
                scatter_px: lead.map_or(0.0, |l| l.scatter),
                confidence: 0.0,
                method,
            };
            tracked.confidence = super::confidence::of(&tracked);
            Some(Ok(tracked))
        };
        let points = answers.into_par_iter().enumerate().map(judge).collect();
        Tracks { points, grid, leaders }
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

/// Cells of the grid are no larger, mm: how far crossings lead.
const MOST_CELL_MM: f64 = 10.0;

fn leader_of_mark(p: &Point) -> Option<Leader> {
    p.known.map(|last| Leader { first: p.first, last, sigma_px: KNOWN_SIGMA_PX })
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

/// Finds points of the first picture in the last; see [`Tracker`].
pub fn track(first: &Prepared, last: &Prepared, points: &[Point], settings: &TrackSettings) -> Tracks {
    Tracker::new(first, points, *settings).find(last)
}

/// Where what was found leads a point that was not: no match, only the motion of its surroundings, with the distance of the three
/// nearest that lead, px. None where nothing was found at all.
pub fn led(tracks: &Tracks, first: &Point2<f64>) -> Option<(Point2<f64>, f64)> {
    let lead = Lead::of(&tracks.leaders, first, None)?;
    let plain = Vector2::new(lead.guess.at.x - first.x, lead.guess.at.y - first.y);
    Some((first + plain, lead.distance))
}
