//! Finds many points of skin again in another picture: from the surest to the vaguest, each beginning where its neighbours say.
//!
//! A painted grid repeats itself, so a search over the whole picture would often find the right pattern in the wrong cell. Points
//! that are known (marked by hand), or found beyond doubt, lead their neighbours, and these theirs (reliability-guided correlation,
//! Pan 2009). Every match is then checked backwards, and against its neighbours.

use nalgebra::{Matrix2, Point2, Vector2};
use rayon::prelude::*;

use super::gray::{Gray, Spline};
use super::patch::{Lost, Match, Patch, PatchSettings};

/// Choices of the tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackSettings {
    /// The match of one neighbourhood.
    pub patch: PatchSettings,
    /// How far skin may have moved between the pictures, px: the range of the search where no neighbour leads. Default 40.
    pub reach_px: f64,
    /// How far a point may lie from where its neighbours lead, px. Default 6.
    pub stray_px: f64,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self { patch: PatchSettings::default(), reach_px: 40.0, stray_px: 6.0 }
    }
}

/// A picture prepared for tracking.
#[derive(Clone, Debug)]
pub struct Prepared {
    spline: Spline,
    /// Halved again and again, the picture itself first.
    levels: Vec<Gray>,
}

/// How often a picture is halved for the search.
const HALVINGS: usize = 2;

impl Prepared {
    /// Filters a picture and halves it.
    pub fn of(gray: Gray) -> Self {
        let spline = Spline::of(&gray);
        let mut levels = vec![gray];
        for _ in 0..HALVINGS {
            let next = levels[levels.len() - 1].halved();
            levels.push(next);
        }
        Self { spline, levels }
    }

    /// Width and height of the picture, px.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width(), self.levels[0].height()]
    }

    /// The smooth surface through the picture.
    pub fn spline(&self) -> &Spline {
        &self.spline
    }
}

/// A point to find.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Where it lies in the first picture, px.
    pub first: Point2<f64>,
    /// Where a hand has marked it in the other, px.
    pub known: Option<Point2<f64>>,
    /// Its neighbours, as indices into the list of points.
    pub neighbours: Vec<u32>,
}

/// How a point was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Led by its neighbours.
    Neighbours,
    /// Searched for over the whole range.
    Search,
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
    /// How far beside its start the point comes out when it is tracked back, px; none where it could not be.
    pub back_px: Option<f64>,
    /// How far it moved differently from the median of its neighbours, px; none where none was found.
    pub stray_px: Option<f64>,
    /// How sure it is that the point lies within 1 px, 0 to 1; see [`confidence`].
    pub confidence: f64,
    /// How it was found.
    pub method: Method,
}

/// Finds points of the first picture in the last. One answer a point, none for those that are known.
pub fn track(
    first: &Prepared,
    last: &Prepared,
    points: &[Point],
    settings: &TrackSettings,
) -> Vec<Option<Result<Tracked, Lost>>> {
    let run = Run { first, last, points, settings };
    let patches: Vec<Result<Patches, Lost>> = points.par_iter().map(|p| run.cut(&p.first)).collect();
    let mut state: Vec<State> = points
        .iter()
        .zip(&patches)
        .map(|(p, patch)| match (p.known, patch) {
            (Some(at), _) => State::Known(at),
            (None, Ok(_)) => State::Open,
            (None, Err(lost)) => State::Lost(*lost),
        })
        .collect();
    // Only where nothing leads at all is the whole range searched: the surest of what is found leads the rest.
    if !state.iter().any(|s| s.place().is_some()) {
        for (i, result) in run.seed(&patches, &state) {
            state[i] = result;
        }
    }
    run.spread(&patches, &mut state);
    run.judged(&state)
}

/// The neighbourhoods of one point, the smallest first. A small one follows the skin best; a larger one holds more to go by.
struct Patches(Vec<Patch>);

/// Sizes of the neighbourhoods tried, as parts of the one asked for, and the distance of their pixels: about as many in each.
const SIZES: [(f64, usize); 3] = [(1.0, 1), (1.6, 2), (2.4, 2)];

/// What is known of a point while tracking.
#[derive(Clone, Copy, Debug)]
enum State {
    Known(Point2<f64>),
    Found(Match, Method, PatchSettings),
    Open,
    Lost(Lost),
}

impl State {
    /// Where the point lies in the other picture, and how its neighbourhood is stretched.
    fn place(&self) -> Option<(Point2<f64>, Matrix2<f64>)> {
        match self {
            State::Known(at) => Some((*at, Matrix2::identity())),
            State::Found(m, ..) => Some((m.at, m.warp)),
            State::Open | State::Lost(_) => None,
        }
    }
}

/// Correlation at which a match found by search may lead others.
const SURE: f64 = 0.93;
/// Half the side of the neighbourhood that is searched for in the smallest picture, px.
const SEARCHED: isize = 6;

/// Where the nearest found points lead another.
struct Lead {
    to: Point2<f64>,
    warp: Matrix2<f64>,
    /// Mean distance of the three nearest of them, px.
    distance: f64,
}

/// Found points by which another is led.
const LEADERS: usize = 8;
/// Farthest that points lead, in typical distances of neighbours.
const MOST_RANGE: f64 = 4.0;

impl Lead {
    /// An affine motion through the nearest found points, nearer ones counting more; drawn towards their mean stretch where they lie in a
    /// row and say nothing across it.
    fn of(found: &[(Point2<f64>, Point2<f64>, Matrix2<f64>)], first: &Point2<f64>) -> Option<Self> {
        let mut near: Vec<(f64, usize)> = found.iter().enumerate().map(|(k, f)| ((f.0 - first).norm(), k)).collect();
        if near.is_empty() {
            return None;
        }
        let leaders = LEADERS.min(near.len());
        near.select_nth_unstable_by(leaders - 1, |a, b| a.0.total_cmp(&b.0));
        near.truncate(leaders);
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = &near[..leaders.min(3)];
        let distance = nearest.iter().map(|n| n.0).sum::<f64>() / nearest.len() as f64;
        let weights: Vec<f64> = near.iter().map(|(d, _)| 1.0 / (1.0 + (d / distance.max(1.0)).powi(2))).collect();
        let total: f64 = weights.iter().sum();
        let mean = |f: &dyn Fn(usize) -> Vector2<f64>| -> Vector2<f64> {
            near.iter().zip(&weights).map(|(n, w)| f(n.1) * *w).sum::<Vector2<f64>>() / total
        };
        let from = mean(&|k| found[k].0.coords);
        let to = mean(&|k| found[k].1.coords);
        let stretch = near.iter().zip(&weights).map(|(n, w)| found[n.1].2 * *w).sum::<Matrix2<f64>>() / total;
        // Least squares for the gradient G of the motion: (Σ w d dᵀ + λ) G = Σ w d uᵀ + λ stretch, d and u from the means.
        let (mut square, mut both) = (Matrix2::zeros(), Matrix2::zeros());
        for ((_, k), w) in near.iter().zip(&weights) {
            let (d, u) = (found[*k].0.coords - from, found[*k].1.coords - to);
            square += d * d.transpose() * *w;
            both += u * d.transpose() * *w;
        }
        let hold = 0.25 * total * distance * distance + 1e-9;
        let gradient = (both + stretch * hold) * (square + Matrix2::identity() * hold).try_inverse()?;
        Some(Self { to: Point2::from(to + gradient * (first.coords - from)), warp: gradient, distance })
    }
}

struct Run<'a> {
    first: &'a Prepared,
    last: &'a Prepared,
    points: &'a [Point],
    settings: &'a TrackSettings,
}

impl Run<'_> {
    fn cut(&self, at: &Point2<f64>) -> Result<Patches, Lost> {
        let base = self.settings.patch;
        let mut lost = Lost::TooEven;
        let mut patches = Vec::new();
        for (size, stride) in SIZES {
            let radius_px = (base.radius_px as f64 * size).round() as usize;
            let settings = PatchSettings { radius_px, stride_px: base.stride_px * stride, ..base };
            match Patch::cut(&self.first.spline, *at, settings) {
                Ok(patch) => patches.push(patch),
                Err(why) => lost = why,
            }
        }
        if patches.is_empty() { Err(lost) } else { Ok(Patches(patches)) }
    }

    /// Wave by wave: every open point that has found ones near it begins where these lead. One that is not found is tried again when
    /// nearer ones are.
    fn spread(&self, patches: &[Result<Patches, Lost>], state: &mut [State]) {
        let mut tried_at = vec![f64::INFINITY; state.len()];
        let mut range = 1.5 * self.spacing();
        loop {
            let found: Vec<(Point2<f64>, Point2<f64>, Matrix2<f64>)> = (0..self.points.len())
                .filter_map(|i| state[i].place().map(|(at, warp)| (self.points[i].first, at, warp)))
                .collect();
            let wave: Vec<(usize, f64, Result<State, Lost>)> = (0..self.points.len())
                .into_par_iter()
                .filter_map(|i| {
                    let (State::Open, Ok(patches)) = (state[i], &patches[i]) else { return None };
                    let lead = Lead::of(&found, &self.points[i].first)?;
                    let nearer = lead.distance < 0.8 * tried_at[i] && lead.distance <= range;
                    nearer.then(|| (i, lead.distance, self.near(patches, lead.to, lead.warp)))
                })
                .collect();
            if wave.is_empty() {
                if range > MOST_RANGE * self.spacing() {
                    return;
                }
                range *= 1.5;
            }
            for (i, distance, result) in wave {
                tried_at[i] = distance;
                if let Ok(result) = result {
                    state[i] = result;
                }
            }
        }
    }

    /// Typical distance of neighbours, px.
    fn spacing(&self) -> f64 {
        let lengths = self.points.iter().flat_map(|p| {
            p.neighbours.iter().filter_map(|&n| Some((self.points.get(n as usize)?.first - p.first).norm()))
        });
        median(lengths).max(1.0)
    }

    /// The best match of any size about a place, as alike and as near as it must be.
    fn near(&self, patches: &Patches, guess: Point2<f64>, warp: Matrix2<f64>) -> Result<State, Lost> {
        let spline = &self.last.spline;
        let mut lost = Lost::Unsettled;
        for patch in &patches.0 {
            match patch.find_from(spline, guess, warp) {
                Ok(m) if (m.at - guess).norm() <= self.settings.stray_px => {
                    return Ok(State::Found(m, Method::Neighbours, *patch.settings()));
                }
                Ok(_) => lost = Lost::Unlike,
                Err(why) => lost = why,
            }
        }
        Err(lost)
    }

    /// The surest of the open points, found by search.
    fn seed(&self, patches: &[Result<Patches, Lost>], state: &[State]) -> Vec<(usize, State)> {
        let found: Vec<(usize, State)> = (0..self.points.len())
            .into_par_iter()
            .filter_map(|i| {
                let (State::Open, Ok(patches)) = (state[i], &patches[i]) else { return None };
                let guess = self.search(&self.points[i].first)?;
                let patch = patches.0.last()?;
                let found = patch.find(&self.last.spline, guess).ok()?;
                Some((i, State::Found(found, Method::Search, *patch.settings())))
            })
            .collect();
        let correlation = |s: &State| if let State::Found(m, ..) = s { m.correlation } else { -1.0 };
        // Those beyond doubt lead; where there is none, the better half does.
        let least = SURE.min(median(found.iter().map(|(_, s)| correlation(s))));
        let sure: Vec<(usize, State)> = found.into_iter().filter(|(_, s)| correlation(s) >= least).collect();
        // The motion that most of them share: a match in the wrong cell of a grid stands alone.
        let shift = |(i, s): &(usize, State)| s.place().map(|(at, _)| at - self.points[*i].first);
        let shifts: Vec<Vector2<f64>> = sure.iter().filter_map(shift).collect();
        let middle = Vector2::new(median(shifts.iter().map(|s| s.x)), median(shifts.iter().map(|s| s.y)));
        let off = |one: &(usize, State)| shift(one).map_or(f64::INFINITY, |s| (s - middle).norm());
        let typical = median(sure.iter().map(off)).max(0.5);
        sure.into_iter().filter(|one| off(one) <= typical).collect()
    }

    /// Coarse to fine: the place within reach where the normalised correlation is greatest.
    fn search(&self, at: &Point2<f64>) -> Option<Point2<f64>> {
        let mut shift = (0, 0);
        for level in (1..=HALVINGS).rev() {
            let (a, b) = (&self.first.levels[level], &self.last.levels[level]);
            let scale = f64::from(1 << level);
            let middle = at.map(|c| ((c - 0.5) / scale).round() as isize);
            let reach = if level == HALVINGS { (self.settings.reach_px / scale).ceil() as isize } else { 2 };
            shift = (2 * shift.0, 2 * shift.1);
            let mut best = (f64::NEG_INFINITY, shift);
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let tried = (shift.0 + dx, shift.1 + dy);
                    if let Some(c) = alike(a, b, (middle.x, middle.y), tried)
                        && c > best.0
                    {
                        best = (c, tried);
                    }
                }
            }
            if best.0 == f64::NEG_INFINITY {
                return None;
            }
            shift = best.1;
        }
        Some(at + Vector2::new(shift.0 as f64, shift.1 as f64) * 2.0)
    }

    /// Checks every match backwards and against its neighbours.
    fn judged(&self, state: &[State]) -> Vec<Option<Result<Tracked, Lost>>> {
        (0..self.points.len())
            .into_par_iter()
            .map(|i| match state[i] {
                State::Known(_) => None,
                // Neighbours led here and it was not found.
                State::Open => Some(Err(Lost::Unsettled)),
                State::Lost(lost) => Some(Err(lost)),
                State::Found(m, method, settings) => {
                    let first = self.points[i].first;
                    let back = Patch::cut(&self.last.spline, m.at, settings).and_then(|p| {
                        let warp = m.warp.try_inverse().unwrap_or_else(Matrix2::identity);
                        p.find_from(&self.first.spline, first, warp)
                    });
                    let back_px = back.ok().map(|b| (b.at - first).norm());
                    let stray_px = self.stray(i, &m, state);
                    let mut tracked = Tracked {
                        at: m.at,
                        sigma_px: m.sigma_px,
                        correlation: m.correlation,
                        back_px,
                        stray_px,
                        confidence: 0.0,
                        method,
                    };
                    tracked.confidence = confidence(&tracked);
                    Some(Ok(tracked))
                }
            })
            .collect()
    }

    /// Distance of a motion from the median of its neighbours', px.
    fn stray(&self, i: usize, m: &Match, state: &[State]) -> Option<f64> {
        let beside: Vec<Vector2<f64>> = self.points[i]
            .neighbours
            .iter()
            .filter_map(|&n| Some(state.get(n as usize)?.place()?.0 - self.points[n as usize].first))
            .collect();
        if beside.is_empty() {
            return None;
        }
        let own = m.at - self.points[i].first;
        let middle = Vector2::new(median(beside.iter().map(|s| s.x)), median(beside.iter().map(|s| s.y)));
        Some((own - middle).norm())
    }
}

/// Where the points that are known or were found lead one that was not: no match, only the motion of its surroundings.
///
/// None where nothing is found at all. With it the mean distance of the three nearest that lead, px.
pub fn led(
    points: &[Point],
    answers: &[Option<Result<Tracked, Lost>>],
    first: &Point2<f64>,
) -> Option<(Point2<f64>, f64)> {
    let place = |(point, answer): (&Point, &Option<Result<Tracked, Lost>>)| {
        let at = point.known.or(answer.as_ref().and_then(|a| a.as_ref().ok()).map(|t| t.at))?;
        Some((point.first, at, Matrix2::identity()))
    };
    let found: Vec<_> = points.iter().zip(answers).filter_map(place).collect();
    Lead::of(&found, first).map(|lead| (lead.to, lead.distance))
}

/// How sure it is that a point lies within 1 px of the truth.
///
/// Errors of x and y are taken as normal and alike, so that P(|error| < 1 px) = 1 − exp(−1 / 2s²); s² adds what the match states, what
/// the way back shows (two matches made that), a part of the motion that the neighbours do not share, and what a poor correlation
/// hides. The shares were fitted on rendered scenes of known truth (see `docs/accuracy.md`).
pub fn confidence(t: &Tracked) -> f64 {
    const ALWAYS_PX: f64 = 0.08;
    const STRAY: f64 = 0.22;
    const ALONE_PX: f64 = 1.5;
    const UNLIKE_PX: f64 = 1.6;
    let stated = t.sigma_px[0].max(t.sigma_px[1]);
    let back = t.back_px.map_or(1.0, |b| b * std::f64::consts::FRAC_1_SQRT_2);
    let unlike = UNLIKE_PX * (1.0 - t.correlation.min(1.0));
    let stray = t.stray_px.map_or(ALONE_PX, |s| STRAY * s);
    let squared = ALWAYS_PX * ALWAYS_PX + stated * stated + back * back + stray * stray + unlike * unlike;
    1.0 - (-1.0 / (2.0 * squared)).exp()
}

/// The place about `near` in the last picture, to about 2 px, whose surroundings are most like those of a place in the first; none where
/// they reach beyond a picture or are even. `reach_px` is at most 64.
pub fn roughly(
    first: &Prepared,
    last: &Prepared,
    at: &Point2<f64>,
    near: &Point2<f64>,
    reach_px: f64,
) -> Option<Point2<f64>> {
    let (a, b) = (&first.levels[1], &last.levels[1]);
    let half = |p: &Point2<f64>| p.map(|c| ((c - 0.5) / 2.0).round() as isize);
    let (from, to) = (half(at), half(near));
    let reach = (0.5 * reach_px.clamp(0.0, 64.0)).ceil() as isize;
    let shifts =
        (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (to.x - from.x + dx, to.y - from.y + dy)));
    let correlation = |shift| Some((alike(a, b, (from.x, from.y), shift)?, shift));
    let (_, shift) = shifts.filter_map(correlation).max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(at + Vector2::new(shift.0 as f64, shift.1 as f64) * 2.0)
}

/// Normalised correlation of two neighbourhoods, the second shifted; none where one reaches beyond its picture or is even.
fn alike(a: &Gray, b: &Gray, at: (isize, isize), shift: (isize, isize)) -> Option<f64> {
    let inside = |g: &Gray, x: isize, y: isize| {
        x >= SEARCHED
            && y >= SEARCHED
            && x + SEARCHED < g.width().cast_signed()
            && y + SEARCHED < g.height().cast_signed()
    };
    let (x, y) = (at.0 + shift.0, at.1 + shift.1);
    if !inside(a, at.0, at.1) || !inside(b, x, y) {
        return None;
    }
    let (mut sa, mut sb, mut saa, mut sbb, mut sab) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for j in -SEARCHED..=SEARCHED {
        for i in -SEARCHED..=SEARCHED {
            let (p, q) = (f64::from(a.at(at.0 + i, at.1 + j)), f64::from(b.at(x + i, y + j)));
            sa += p;
            sb += q;
            saa += p * p;
            sbb += q * q;
            sab += p * q;
        }
    }
    let n = ((2 * SEARCHED + 1) * (2 * SEARCHED + 1)) as f64;
    let (va, vb) = (saa - sa * sa / n, sbb - sb * sb / n);
    (va > 1e-6 && vb > 1e-6).then(|| (sab - sa * sb / n) / (va * vb).sqrt())
}

/// The middle of some numbers; 0 of none.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
