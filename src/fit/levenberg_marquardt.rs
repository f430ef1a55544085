//! Levenberg and Marquardt's method for least squares between bounds, without allocation inside the loop.

use serde::{Deserialize, Serialize};

use super::cholesky;

/// Settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LevenbergMarquardtSettings {
    /// Stop where the residual stands this nearly at a right angle to every free direction: the largest cosine (default 1e-6, which leaves
    /// about 1e-12 of the cost to be gained).
    pub gradient: f64,
    /// Stop where no unknown would move by more than this (default 1e-7). Unknowns are scaled to be of order 1.
    pub step: f64,
    /// Stop where cost falls, and is predicted to fall, by less than this share (default 1e-11: far below what noise leaves
    /// undecided, and no limit where there is no noise, since the cost then falls towards nothing).
    pub cost: f64,
    /// Evaluations at most (default 100).
    pub evaluations: usize,
    /// First damping, as a share of the diagonal of JᵀJ (default 1e-3).
    pub damping: f64,
    /// Largest move of an unknown in one step (default 1.0: a factor e, where unknowns are logarithms).
    pub longest_step: f64,
}

impl Default for LevenbergMarquardtSettings {
    fn default() -> Self {
        Self { gradient: 1e-6, step: 1e-7, cost: 1e-11, evaluations: 100, damping: 1e-3, longest_step: 1.0 }
    }
}

/// Why the iteration stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// No free direction lowers the cost any more: a minimum.
    Gradient,
    /// Steps have become too short to matter: a minimum, or a kink that works as one.
    Step,
    /// The cost does not fall any more.
    Cost,
    /// Beside a minimum that an earlier start found: this one leads to the same.
    Known,
    /// The residual is made of rounding errors.
    Exact,
    /// No unknown was free.
    NothingFree,
    /// No evaluations left.
    Limit,
    /// The start has no finite cost, or slopes are no numbers.
    NotFinite,
}

impl Stop {
    /// Whether the end is a minimum as far as the method can tell.
    pub fn converged(self) -> bool {
        !matches!(self, Self::Limit | Self::NotFinite)
    }
}

/// Where the iteration ended. The unknowns themselves are in the slice that was passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Descent {
    /// Cost there, Σ r².
    pub cost: f64,
    /// Evaluations of the residual.
    pub evaluations: usize,
    /// Evaluations of its slopes.
    pub linearisations: usize,
    /// Why it stopped.
    pub stop: Stop,
}

/// A sum of squares Σ r(u)², r = y − f(u).
pub trait LeastSquares {
    /// The cost at `u`; infinite or NaN where there is none.
    fn cost(&mut self, u: &[f64]) -> f64;
    /// JᵀJ (rows one after the other) and Jᵀr with J = ∂f/∂u, at the point for which [`LeastSquares::cost`] was called last.
    fn linearise(&mut self, jtj: &mut [f64], jtr: &mut [f64]);
    /// Costs below this are rounding errors.
    fn rounding(&self) -> f64;
    /// Whether `u` with this cost is beside a minimum that is known already, so that going on would tell nothing.
    fn is_known(&self, _u: &[f64], _cost: f64) -> bool {
        false
    }
}

/// Room for the iteration: made once, used for many starts.
#[derive(Clone, Debug, Default)]
pub struct Room {
    jtj: Vec<f64>,
    jtr: Vec<f64>,
    scale: Vec<f64>,
    damped: Vec<f64>,
    step: Vec<f64>,
    trial: Vec<f64>,
    free: Vec<usize>,
    moving: Vec<usize>,
}

/// Columns shorter than this share of the longest are damped as if they were that long.
const FLAT: f64 = 1e-12;

/// Damping beyond this moves nothing.
const STIFFEST: f64 = 1e20;

/// Looks for the least cost from `u` between the bounds, and leaves the best point in `u`.
///
/// Each step solves (JᵀJ + λ D) δ = Jᵀr, D = the largest diagonal of JᵀJ seen so far (Moré 1978), in the unknowns that are not held
/// at a bound; what would leave the bounds ends on them. λ follows the ratio of the fall of the cost to the fall foretold (Nielsen 1999).
pub fn minimise(
    problem: &mut impl LeastSquares,
    u: &mut [f64],
    bounds: &[[f64; 2]],
    settings: &LevenbergMarquardtSettings,
    room: &mut Room,
) -> Descent {
    let n = u.len();
    room.resize(n);
    for (x, [low, high]) in u.iter_mut().zip(bounds) {
        *x = x.clamp(*low, *high);
    }
    let mut cost = problem.cost(u);
    let (mut evaluations, mut linearisations) = (1, 0);
    if !cost.is_finite() {
        return Descent { cost, evaluations, linearisations, stop: Stop::NotFinite };
    }
    let (mut damping, mut growth) = (settings.damping, 2.0);
    'linearise: loop {
        let end = |cost, evaluations, linearisations, stop| Descent { cost, evaluations, linearisations, stop };
        if problem.is_known(u, cost) {
            return end(cost, evaluations, linearisations, Stop::Known);
        }
        problem.linearise(&mut room.jtj, &mut room.jtr);
        linearisations += 1;
        if !room.jtj.iter().chain(&room.jtr).all(|v| v.is_finite()) {
            return end(cost, evaluations, linearisations, Stop::NotFinite);
        }
        if cost <= problem.rounding() {
            return end(cost, evaluations, linearisations, Stop::Exact);
        }
        room.find_free(u, bounds);
        if room.free.is_empty() {
            return end(cost, evaluations, linearisations, Stop::NothingFree);
        }
        let length = cost.sqrt();
        let cosine = |&i: &usize| {
            let column = room.jtj[i * n + i].sqrt();
            if column > 0.0 { room.jtr[i].abs() / (column * length) } else { 0.0 }
        };
        if room.free.iter().map(cosine).fold(0.0, f64::max) <= settings.gradient {
            return end(cost, evaluations, linearisations, Stop::Gradient);
        }
        let largest = (0..n).map(|i| room.jtj[i * n + i]).fold(0.0, f64::max);
        for i in 0..n {
            room.scale[i] = room.scale[i].max(room.jtj[i * n + i]).max(FLAT * largest);
        }
        loop {
            let foretold = room.solve(u, bounds, damping, settings.longest_step);
            let longest = room.step.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            if longest <= settings.step {
                return end(cost, evaluations, linearisations, Stop::Step);
            }
            if evaluations >= settings.evaluations {
                // The problem must stand at `u` and not at the last trial.
                let cost = problem.cost(u);
                return end(cost, evaluations + 1, linearisations, Stop::Limit);
            }
            let tried = problem.cost(&room.trial);
            evaluations += 1;
            let fall = cost - tried;
            if tried.is_finite() && fall > 0.0 {
                let ratio = if foretold > 0.0 { fall / foretold } else { 0.0 };
                u.copy_from_slice(&room.trial);
                let little = fall <= settings.cost * cost && foretold <= settings.cost * cost;
                cost = tried;
                damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0);
                damping = damping.max(1e-15);
                growth = 2.0;
                if little {
                    return end(cost, evaluations, linearisations, Stop::Cost);
                }
                continue 'linearise;
            }
            damping *= growth;
            growth *= 2.0;
            if damping > STIFFEST {
                problem.cost(u);
                return end(cost, evaluations + 1, linearisations, Stop::Step);
            }
        }
    }
}

impl Room {
    fn resize(&mut self, n: usize) {
        for matrix in [&mut self.jtj, &mut self.damped] {
            matrix.clear();
            matrix.resize(n * n, 0.0);
        }
        for vector in [&mut self.jtr, &mut self.scale, &mut self.step, &mut self.trial] {
            vector.clear();
            vector.resize(n, 0.0);
        }
        self.free.clear();
        self.free.reserve(n);
    }

    /// Unknowns that may move: all but those at a bound that the slope presses them against.
    fn find_free(&mut self, u: &[f64], bounds: &[[f64; 2]]) {
        self.free.clear();
        for (i, (x, [low, high])) in u.iter().zip(bounds).enumerate() {
            // Jᵀr points downhill.
            let held = (x <= low && self.jtr[i] <= 0.0) || (x >= high && self.jtr[i] >= 0.0);
            if !held {
                self.free.push(i);
            }
        }
    }

    /// The step for a damping, and the trial point; returns the fall of the cost that the linear model foretells.
    ///
    /// An unknown that would move too far, or beyond its bound, moves only so far, and the others are solved for anew: shortening all of
    /// them alike would let one that the data hardly tell stop the rest.
    fn solve(&mut self, u: &[f64], bounds: &[[f64; 2]], damping: f64, longest: f64) -> f64 {
        let n = u.len();
        self.step.fill(0.0);
        self.moving.clear();
        self.moving.extend_from_slice(&self.free);
        loop {
            let m = self.moving.len();
            for (a, &i) in self.moving.iter().enumerate() {
                for (b, &j) in self.moving.iter().enumerate() {
                    self.damped[a * m + b] = self.jtj[i * n + j];
                }
                self.damped[a * m + a] += damping * self.scale[i];
                let settled = (0..n).filter(|j| !self.moving.contains(j));
                self.trial[a] = self.jtr[i] - settled.map(|j| self.jtj[i * n + j] * self.step[j]).sum::<f64>();
            }
            cholesky::factor(&mut self.damped[..m * m], m);
            cholesky::solve(&self.damped[..m * m], m, &mut self.trial[..m]);
            let mut a = 0;
            let (step, trial) = (&mut self.step, &self.trial);
            self.moving.retain(|&i| {
                let (low, high) = ((bounds[i][0] - u[i]).max(-longest), (bounds[i][1] - u[i]).min(longest));
                let wanted = trial[a];
                a += 1;
                let inside = (low..=high).contains(&wanted);
                step[i] = if inside { 0.0 } else { wanted.clamp(low, high) };
                inside
            });
            if self.moving.len() == m {
                for (a, &i) in self.moving.iter().enumerate() {
                    self.step[i] = self.trial[a];
                }
                break;
            }
        }
        let mut foretold = 0.0;
        for i in 0..n {
            self.trial[i] = (u[i] + self.step[i]).clamp(bounds[i][0], bounds[i][1]);
            foretold += 2.0 * self.step[i] * self.jtr[i];
        }
        for i in 0..n {
            for j in 0..n {
                foretold -= self.step[i] * self.jtj[i * n + j] * self.step[j];
            }
        }
        foretold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as least squares: r = (10 (x₂ − x₁²), 1 − x₁).
    struct Rosenbrock {
        at: [f64; 2],
    }

    impl LeastSquares for Rosenbrock {
        fn cost(&mut self, u: &[f64]) -> f64 {
            self.at = [u[0], u[1]];
            100.0 * (u[1] - u[0] * u[0]).powi(2) + (1.0 - u[0]).powi(2)
        }
        fn linearise(&mut self, jtj: &mut [f64], jtr: &mut [f64]) {
            // f = −r: J = [20 x₁, −10; 1, 0].
            let [x, y] = self.at;
            let (r0, r1) = (10.0 * (y - x * x), 1.0 - x);
            jtj.copy_from_slice(&[400.0 * x * x + 1.0, -200.0 * x, -200.0 * x, 100.0]);
            jtr.copy_from_slice(&[20.0 * x * r0 + r1, -10.0 * r0]);
        }
        fn rounding(&self) -> f64 {
            1e-30
        }
    }

    const FREE: [[f64; 2]; 2] = [[-1e3, 1e3]; 2];

    #[test]
    fn rosenbrock_is_solved_and_the_reason_given() {
        let mut u = [-1.2, 1.0];
        let settings = LevenbergMarquardtSettings::default();
        let end = minimise(&mut Rosenbrock { at: [0.0; 2] }, &mut u, &FREE, &settings, &mut Room::default());
        // The valley is flat: a cost of 1e-16 is reached 1e-8 from its lowest point.
        assert!((u[0] - 1.0).abs() < 1e-7 && (u[1] - 1.0).abs() < 1e-7, "{u:?}");
        assert!(end.stop.converged() && end.evaluations < 60, "{end:?}");
    }

    #[test]
    fn bounds_hold_and_the_minimum_on_them_is_found() {
        // x₁ ≤ 0.5: on the bound the least cost has x₂ = 0.25 and cost (1 − 0.5)² = 0.25.
        let mut u = [-1.2, 1.0];
        let bounds = [[-2.0, 0.5], [-2.0, 2.0]];
        let settings = LevenbergMarquardtSettings::default();
        let end = minimise(&mut Rosenbrock { at: [0.0; 2] }, &mut u, &bounds, &settings, &mut Room::default());
        assert_eq!(u[0], 0.5);
        assert!((u[1] - 0.25).abs() < 1e-9 && (end.cost - 0.25).abs() < 1e-12 && end.stop.converged(), "{u:?} {end:?}");
    }

    #[test]
    fn a_limit_and_a_start_without_a_number_are_no_minimum() {
        let settings = LevenbergMarquardtSettings { evaluations: 3, ..LevenbergMarquardtSettings::default() };
        let mut u = [-1.2, 1.0];
        let end = minimise(&mut Rosenbrock { at: [0.0; 2] }, &mut u, &FREE, &settings, &mut Room::default());
        assert_eq!(end.stop, Stop::Limit);
        assert!(!end.stop.converged());
        let mut u = [f64::NAN, 1.0];
        let end = minimise(&mut Rosenbrock { at: [0.0; 2] }, &mut u, &FREE, &settings, &mut Room::default());
        assert_eq!(end.stop, Stop::NotFinite);
    }
}
