//! How much moves in a film, frame by frame, and which two frames stand for the start and the end of an expression.
//!
//! Frames are compared small and grey. Before two are compared, the one is moved onto the other by the affine motion that most of their
//! pixels share, and its light is scaled and shifted: the head's motion and a flickering lamp are then no change (dominant motion by a
//! robust estimate: Odobez and Bouthemy, Journal of Visual Communication and Image Representation 6, 1995). What is left, as a root mean
//! square in grey levels in which the middle of the picture counts most, is the *speed* from a frame to the next, and the *change* from the neutral frame.
//!
//! The rule of the proposal, after the feature difference by which facial movements are spotted (Moilanen, Zhao and Pietikäinen, ICPR 2014):
//! - *neutral* is the middle of the earliest quiet stretch of 0.4 s in the first half of the film: quiet is a mean speed of at most half
//!   above that of the quietest;
//! - *apex* has the largest lasting change from it: the change is smoothed by a running median over 0.4 s, so that a blink does not
//!   count, and of the frames at 95 % of the largest or above the one in which least moves is taken, for it is sharp;
//! - where a key frame shows the face as neutral as that, and another lies at that height, these two are taken: a coder carries the texture of
//!   skin into all others.

use image::RgbImage;
use nalgebra::{SMatrix, SVector};

/// Longer side of the pictures that are compared, px.
pub const COMPARED_PX: u32 = 72;

/// Most pictures that are compared: of a longer film every second, third, … frame.
const MOST: usize = 20_000;

/// A stretch that counts as lasting, s: a median over it passes nothing of half its length, and a blink takes 0.1 to 0.2 s.
const LASTING_S: f64 = 0.4;

/// Time from a frame to the next where a film does not say so, s.
const UNSAID_S: f64 = 0.04;

/// How much above the quietest stretch is quiet as well.
const QUIET: f64 = 1.5;

/// Share of the largest lasting change at which a frame counts as the height of the expression.
const HEIGHT: f64 = 0.95;

/// A change below this is no motion, grey levels: the rounding of a film's codec.
const LEAST_CHANGE: f64 = 0.7;

/// So few frames are no film.
const FEW: usize = 8;

/// Rounds of the alignment; a head moves little from one small picture to the next.
const ROUNDS: usize = 6;

/// Share of a pixel by its place, −1 to 1 along the longer side: the face is in the middle, and the room about it does not move with
/// the head.
fn central(x: f64, y: f64) -> f64 {
    (-(x * x + y * y) / (2.0 * MIDDLE * MIDDLE)).exp()
}

/// How far the middle reaches, of half the longer side.
const MIDDLE: f64 = 0.35;

/// A small grey picture.
#[derive(Clone, Debug, PartialEq)]
struct Grey {
    width: usize,
    values: Vec<u8>,
}

/// What one picture is to another: 1, x, y of the shift along x and along y, gain and offset of the light.
type Change = SVector<f64, 8>;

impl Grey {
    fn of(image: &RgbImage) -> Self {
        let values = image.pixels().map(|p| {
            let [r, g, b] = p.0.map(u32::from);
            ((299 * r + 587 * g + 114 * b + 500) / 1000) as u8
        });
        Self { width: image.width() as usize, values: values.collect() }
    }

    fn height(&self) -> usize {
        self.values.len() / self.width.max(1)
    }

    fn get(&self, x: usize, y: usize) -> f64 {
        self.values.get(y * self.width + x).map_or(0.0, |v| f64::from(*v))
    }

    /// Between pixels; absent outside.
    fn at(&self, x: f64, y: f64) -> Option<f64> {
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 - 1.0 && y < self.height() as f64 - 1.0;
        if !inside {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (u, v) = (x - i as f64, y - j as f64);
        let row = |j: usize| (1.0 - u) * self.get(i, j) + u * self.get(i + 1, j);
        Some((1.0 - v) * row(j) + v * row(j + 1))
    }
}

/// What of `moved` is another than `still` when the shared motion and the light are taken out, grey levels; with that motion.
///
/// Gauss and Newton's method on the gradients of `still`, pixels weighted by Tukey's biweight: what moves otherwise pulls little.
fn difference(still: &Grey, moved: &Grey, begin: Change) -> (f64, Change) {
    let (width, height) = (still.width, still.height());
    if moved.width != width || moved.height() != height || width < 4 || height < 4 {
        return (0.0, begin);
    }
    let (cx, cy) = (width as f64 / 2.0, height as f64 / 2.0);
    let scale = cx.max(cy);
    let mut motion = begin;
    let mut spread = 20.0;
    let mut left = 0.0;
    for round in 0..=ROUNDS {
        let mut normal = SMatrix::<f64, 8, 8>::identity() * 1e-6;
        let mut right = Change::zeros();
        let (mut sum, mut shares, mut count, mut absolute) = (0.0, 0.0, 0, 0.0);
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let (px, py) = ((x as f64 - cx) / scale, (y as f64 - cy) / scale);
                let dx = motion[0] + motion[1] * px + motion[2] * py;
                let dy = motion[3] + motion[4] * px + motion[5] * py;
                let Some(seen) = moved.at(x as f64 + dx, y as f64 + dy) else { continue };
                let here = still.get(x, y);
                let error = seen - (here * (1.0 + motion[6]) + motion[7]);
                let share = central(px, py);
                sum += share * error * error;
                shares += share;
                absolute += share * error.abs();
                count += 1;
                if round == ROUNDS {
                    continue;
                }
                let far = error / (4.685 * spread);
                let weight = if far.abs() < 1.0 { share * (1.0 - far * far).powi(2) } else { 0.0 };
                let gx = (still.get(x + 1, y) - still.get(x - 1, y)) / 2.0;
                let gy = (still.get(x, y + 1) - still.get(x, y - 1)) / 2.0;
                // A farther shift raises what is seen by the gradient; more light raises what is expected.
                let row = Change::from([gx, gx * px, gx * py, gy, gy * px, gy * py, -here, -1.0]);
                normal += row * row.transpose() * weight;
                right -= row * (weight * error);
            }
        }
        if count * 2 < width * height {
            // Most of the picture is gone: no motion that a face makes.
            return if begin == Change::zeros() {
                (left, Change::zeros())
            } else {
                difference(still, moved, Change::zeros())
            };
        }
        left = (sum / shares).sqrt();
        if round == ROUNDS {
            break;
        }
        // The mean absolute error of a normal distribution is 0.8 of its spread.
        spread = (absolute / shares / 0.8).max(0.5);
        match normal.cholesky() {
            Some(solved) => motion += solved.solve(&right),
            None => break,
        }
    }
    (left, motion)
}

/// The pictures of a film while it is read.
#[derive(Debug, Default)]
pub struct Watch {
    step: usize,
    pictures: Vec<Grey>,
    speed: Vec<f64>,
    motion: Change,
}

/// How much moves, and the two frames proposed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Frames from one value to the next: 1 but for very long films.
    pub step: usize,
    /// What changed since the value before, grey levels; the first is 0.
    pub speed: Vec<f64>,
    /// What is another than in the neutral frame, grey levels.
    pub change: Vec<f64>,
    /// Index of the frame proposed as the first: neutral.
    pub first: usize,
    /// Index of the frame proposed as the last: apex.
    pub last: usize,
    /// Whether anything moved that lasted; if not, the two are the ends of the film.
    pub moved: bool,
}

impl Watch {
    /// Begins, for a film of so many frames.
    pub fn new(count: usize) -> Self {
        Self { step: count.div_ceil(MOST).max(1), ..Self::default() }
    }

    /// Whether the frame is one of those that are compared.
    pub fn wants(&self, index: usize) -> bool {
        index.is_multiple_of(self.step)
    }

    /// Takes the next of those frames, already small; returns what changed since the one before, grey levels.
    pub fn see(&mut self, image: &RgbImage) -> f64 {
        let grey = Grey::of(image);
        let speed = self.pictures.last().map_or(0.0, |before| {
            // A motion goes on; what it was is where to begin.
            let (speed, motion) = difference(before, &grey, self.motion);
            self.motion = motion;
            speed
        });
        self.pictures.push(grey);
        self.speed.push(speed);
        speed
    }

    /// Proposes the two frames; `frame_s` is the time from a frame to the next, `keys` are the film's key frames, if it has others too.
    pub fn finish(self, frame_s: Option<f64>, keys: &[usize]) -> Motion {
        let Self { step, pictures, speed, .. } = self;
        let count = pictures.len();
        let per_value = frame_s.filter(|s| *s > 0.0).unwrap_or(UNSAID_S) * step as f64;
        let lasting = ((LASTING_S / per_value).round() as usize).max(3).min(count.max(1));
        let neutral = quiet_beginning(&speed, lasting);
        let mut change = vec![0.0; count];
        if let Some(still) = pictures.get(neutral) {
            // Outwards from the neutral frame, each alignment begins where the one before it ended.
            for order in [(neutral + 1..count).collect::<Vec<_>>(), (0..neutral).rev().collect()] {
                let mut motion = Change::zeros();
                for i in order {
                    (change[i], motion) = difference(still, &pictures[i], motion);
                }
            }
        }
        let lasting_change = running_median(&change, lasting);
        // A few pictures were chosen by hand: their ends are meant.
        let few = count < FEW;
        let largest = lasting_change.iter().skip(neutral + 1).copied().fold(0.0, f64::max);
        let around = lasting.div_ceil(2);
        let noise = median(change.iter().skip(neutral.saturating_sub(around)).take(2 * around).copied().collect());
        let moved = !few && largest > LEAST_CHANGE.max(2.0 * noise);
        let high = |i: &usize| lasting_change[*i] >= HEIGHT * largest;
        let stillest = |a: &usize, b: &usize| speed[*a].total_cmp(&speed[*b]);
        let apex = (neutral + 1..count).filter(high).min_by(stillest).filter(|_| moved);
        let (first, last) = apex.map_or((0, count.saturating_sub(1)), |apex| {
            let whole = || keys.iter().filter(|k| k.is_multiple_of(step)).map(|k| k / step).filter(|i| *i < count);
            let at_rest = whole().filter(|i| lasting_change[*i] <= LEAST_CHANGE.max(2.0 * noise));
            let begin = at_rest.min_by_key(|i| i.abs_diff(neutral));
            let key = begin.and_then(|b| Some((b, whole().filter(|i| *i > b).filter(high).min_by(stillest)?)));
            key.unwrap_or((neutral, apex))
        });
        Motion { step, speed, change, first: first * step, last: last * step, moved }
    }
}

/// The middle of the earliest quiet stretch in the first half.
fn quiet_beginning(speed: &[f64], lasting: usize) -> usize {
    // The speed of a frame is about the one before it: the stretch begins one later.
    let half = (speed.len() / 2).max(lasting + 1).min(speed.len());
    let stretches: Vec<f64> = speed
        .get(1..half)
        .unwrap_or_default()
        .windows(lasting.saturating_sub(1).max(1))
        .map(|w| w.iter().sum::<f64>() / w.len() as f64)
        .collect();
    let quietest = stretches.iter().copied().fold(f64::INFINITY, f64::min);
    let begin = stretches.iter().position(|s| *s <= QUIET * quietest).unwrap_or(0);
    (begin + lasting / 2).min(speed.len().saturating_sub(1))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn running_median(values: &[f64], width: usize) -> Vec<f64> {
    let around = width / 2;
    (0..values.len())
        .map(|i| median(values[i.saturating_sub(around)..(i + around + 1).min(values.len())].to_vec()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use rand::{RngExt, SeedableRng};

    /// A face of sorts: two brows over a textured ground; raised by `up` px, shut eyes, moved, turned and lit.
    struct Pose {
        up: f64,
        shut: bool,
        shift: [f64; 2],
        turn: f64,
        light: f64,
    }

    fn draw(pose: &Pose, random: &mut rand_pcg::Pcg32) -> RgbImage {
        let (sin, cos) = pose.turn.sin_cos();
        RgbImage::from_fn(72, 54, |px, py| {
            let (dx, dy) = (f64::from(px) - 36.0 - pose.shift[0], f64::from(py) - 27.0 - pose.shift[1]);
            let (x, y) = (36.0 + cos * dx + sin * dy, 27.0 - sin * dx + cos * dy);
            let ground = 130.0 + 30.0 * (x * 0.31).sin() * (y * 0.23).cos() + 20.0 * (x * 0.11 + y * 0.17).sin();
            let spot = |cx: f64, cy: f64, w: f64, h: f64| (-((x - cx) / w).powi(2) - ((y - cy) / h).powi(2)).exp();
            let brows = spot(24.0, 18.0 - pose.up, 7.0, 2.0) + spot(48.0, 18.0 - pose.up, 7.0, 2.0);
            let eyes = if pose.shut { 0.0 } else { spot(24.0, 26.0, 3.0, 2.0) + spot(48.0, 26.0, 3.0, 2.0) };
            let noise = random.random::<f64>() * 6.0 - 3.0;
            let value = (ground - 70.0 * brows - 60.0 * eyes) * pose.light + noise;
            Rgb([value.clamp(0.0, 255.0) as u8; 3])
        })
    }

    /// Neutral to 29, up from 30 to 39, held to 69, relaxed by 80; a blink at 12; a head that drifts by 5 px and 3°; a lamp that
    /// flickers by 10 %.
    fn film(raise: f64, keys: &[usize]) -> Motion {
        let mut random = rand_pcg::Pcg32::seed_from_u64(5);
        let mut watch = Watch::new(100);
        for i in 0..100 {
            let t = f64::from(i);
            let up = raise * ((t - 29.0) / 10.0).clamp(0.0, 1.0).min(((80.0 - t) / 10.0).clamp(0.0, 1.0));
            let light = 1.0 + 0.1 * (t * 1.7).sin();
            let pose = Pose { up, shut: (12..16).contains(&i), shift: [0.05 * t, -0.03 * t], turn: 0.0005 * t, light };
            watch.see(&draw(&pose, &mut random));
        }
        watch.finish(Some(0.04), keys)
    }

    #[test]
    fn neutral_and_apex_are_found_in_spite_of_a_blink_a_drifting_head_and_a_flickering_lamp() {
        let motion = film(4.0, &[]);
        assert!(motion.moved);
        assert!(motion.first < 12 || (16..29).contains(&motion.first), "{}", motion.first);
        assert!((39..=69).contains(&motion.last), "{}", motion.last);
        // The change is the brows': many times what head and lamp leave over.
        let mean =
            |range: std::ops::Range<usize>| motion.change[range.clone()].iter().sum::<f64>() / range.len() as f64;
        let (rest, held) = (mean(20..28), mean(45..65));
        assert!(held > 2.5 * rest, "{rest} {held}");
    }

    /// Key frames at rest (0 and 25) and at the height (50): those. Where there is none at the height (35 is on the way up), the others.
    #[test]
    fn key_frames_are_taken_where_both_ends_have_one() {
        let motion = film(4.0, &[0, 25, 50, 75]);
        assert!([0, 25].contains(&motion.first) && motion.last == 50, "{motion:?}");
        let (one, none) = (film(4.0, &[0, 35, 90]), film(4.0, &[]));
        assert_eq!([one.first, one.last], [none.first, none.last]);
    }

    #[test]
    fn where_nothing_moves_the_ends_are_proposed_and_it_is_said() {
        let motion = film(0.0, &[]);
        assert_eq!((motion.moved, motion.first, motion.last), (false, 0, 99));
        let nothing = Watch::new(0).finish(None, &[]);
        assert_eq!((nothing.first, nothing.last, nothing.moved), (0, 0, false));
        let mut two = Watch::new(2);
        two.see(&RgbImage::new(3, 2));
        two.see(&RgbImage::new(3, 2));
        assert_eq!((two.finish(None, &[]).last, Watch::new(50_000).step), (1, 3));
    }

    #[test]
    fn a_shift_a_turn_and_a_light_are_no_change() {
        let mut random = rand_pcg::Pcg32::seed_from_u64(9);
        let still = Pose { up: 0.0, shut: false, shift: [0.0; 2], turn: 0.0, light: 1.0 };
        let a = Grey::of(&draw(&still, &mut random));
        let b = Grey::of(&draw(&Pose { shift: [2.0, -1.5], turn: 0.04, light: 0.85, ..still }, &mut random));
        let (left, motion) = difference(&a, &b, Change::zeros());
        // Two pictures with uniform noise of ±3: √2 · 6/√12 = 2.4, a little less for being interpolated.
        assert!(left < 2.6, "{left}");
        assert!((motion[0] - 2.0).abs() < 0.1 && (motion[3] + 1.5).abs() < 0.1, "{motion}");
        assert!((motion[6] + 0.15).abs() < 0.02, "{motion}");
    }
}
