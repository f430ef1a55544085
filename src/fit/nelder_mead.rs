//! Nelder and Mead's simplex method as MATLAB's `fminsearch` runs it: the thesis's own way to fit.

use serde::{Deserialize, Serialize};

/// Settings, with `fminsearch`'s own as default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct NelderMeadSettings {
    /// Largest distance along any axis between the best corner and the others at which the simplex counts as small (default 1e-4).
    pub tol_x: f64,
    /// Largest difference of cost between the best corner and the others at which it counts as flat (default 1e-4). Absolute, as in
    /// `fminsearch`: what it means depends on the unit of the cost.
    pub tol_fun: f64,
    /// Iterations, and evaluations, at most: this many times the number of unknowns (default 200).
    pub per_unknown: usize,
    /// How far each corner of the first simplex lies from the start, as a share of its coordinate (default 5 %).
    pub spread: f64,
    /// The same where the coordinate is zero (default 0.00025).
    pub spread_at_zero: f64,
}

impl Default for NelderMeadSettings {
    fn default() -> Self {
        Self { tol_x: 1e-4, tol_fun: 1e-4, per_unknown: 200, spread: 0.05, spread_at_zero: 0.000_25 }
    }
}

impl NelderMeadSettings {
    /// Tight enough for six digits, with ten times the patience.
    pub fn tight() -> Self {
        Self { tol_x: 1e-9, tol_fun: 1e-16, per_unknown: 2_000, ..Self::default() }
    }
}

/// Why the simplex stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimplexStop {
    /// Small and flat.
    Tolerance,
    /// No evaluations left.
    Evaluations,
    /// No iterations left.
    Iterations,
    /// The start itself has no finite cost.
    NoStart,
}

/// Where the simplex ended.
#[derive(Clone, Debug, PartialEq)]
pub struct SimplexEnd {
    /// The best corner.
    pub at: Vec<f64>,
    /// Its cost.
    pub cost: f64,
    /// Evaluations of the cost.
    pub evaluations: usize,
    /// Iterations.
    pub iterations: usize,
    /// Why it stopped.
    pub stop: SimplexStop,
}

// Coefficients of fminsearch. The corner reached from the worst w through the mean m of the others is m + c (m − w).
const REFLECT: f64 = 1.0;
const EXPAND: f64 = 2.0;
const CONTRACT_OUTSIDE: f64 = 0.5;
const CONTRACT_INSIDE: f64 = -0.5;
const SHRINK: f64 = 0.5;

/// Looks for the least cost from a start. A cost that is not a number counts as infinite, so that `f64::INFINITY` walls off a region.
pub fn minimise(mut cost: impl FnMut(&[f64]) -> f64, start: &[f64], settings: &NelderMeadSettings) -> SimplexEnd {
    let n = start.len();
    let mut evaluations = 0;
    let mut evaluate = |x: &[f64]| {
        evaluations += 1;
        let value = cost(x);
        (if value.is_nan() { f64::INFINITY } else { value }, evaluations)
    };
    let limit = settings.per_unknown * n;
    // Corners in order of cost: (cost, coordinates).
    let mut corners: Vec<(f64, Vec<f64>)> = Vec::with_capacity(n + 1);
    corners.push((evaluate(start).0, start.to_vec()));
    let end = |corners: &[(f64, Vec<f64>)], evaluations, iterations, stop| {
        let (cost, at) = corners[0].clone();
        SimplexEnd { at, cost, evaluations, iterations, stop }
    };
    if !corners[0].0.is_finite() {
        return end(&corners, 1, 0, SimplexStop::NoStart);
    }
    let mut spent = 1;
    for j in 0..n {
        let mut corner = start.to_vec();
        corner[j] = if corner[j] == 0.0 { settings.spread_at_zero } else { corner[j] * (1.0 + settings.spread) };
        let (value, count) = evaluate(&corner);
        spent = count;
        corners.push((value, corner));
    }
    let by_cost = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| a.0.total_cmp(&b.0);
    corners.sort_by(by_cost);
    let (mut mean, mut trial, mut second) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut iterations = 1;
    loop {
        let small = corners[1..].iter().all(|(_, c)| {
            c.iter().zip(&corners[0].1).all(|(a, b)| (a - b).abs() <= settings.tol_x.max(10.0 * f64::EPSILON * b.abs()))
        });
        let best = corners[0].0;
        let flat = corners[n].0 - best <= settings.tol_fun.max(10.0 * f64::EPSILON * best.abs());
        if small && flat {
            return end(&corners, spent, iterations, SimplexStop::Tolerance);
        }
        if spent >= limit {
            return end(&corners, spent, iterations, SimplexStop::Evaluations);
        }
        if iterations >= limit {
            return end(&corners, spent, iterations, SimplexStop::Iterations);
        }
        iterations += 1;
        for (j, m) in mean.iter_mut().enumerate() {
            *m = corners[..n].iter().map(|(_, c)| c[j]).sum::<f64>() / n as f64;
        }
        let mut probe = |out: &mut [f64], worst: &[f64], by: f64| {
            for ((o, m), w) in out.iter_mut().zip(&mean).zip(worst) {
                *o = m + by * (m - w);
            }
            let (value, count) = evaluate(out);
            spent = count;
            value
        };
        let worst = corners[n].0;
        let reflected = probe(&mut trial, &corners[n].1, REFLECT);
        let accepted = if reflected < best {
            let expanded = probe(&mut second, &corners[n].1, EXPAND);
            if expanded < reflected {
                trial.copy_from_slice(&second);
                Some(expanded)
            } else {
                Some(reflected)
            }
        } else if reflected < corners[n - 1].0 {
            Some(reflected)
        } else {
            let (by, bar) = if reflected < worst { (CONTRACT_OUTSIDE, reflected) } else { (CONTRACT_INSIDE, worst) };
            let contracted = probe(&mut trial, &corners[n].1, by);
            // fminsearch takes an equal cost outside, a smaller one inside.
            let better = if reflected < worst { contracted <= bar } else { contracted < bar };
            better.then_some(contracted)
        };
        if let Some(value) = accepted {
            corners[n].0 = value;
            corners[n].1.copy_from_slice(&trial);
        } else {
            let (first, others) = corners.split_at_mut(1);
            for (value, corner) in others {
                for (c, b) in corner.iter_mut().zip(&first[0].1) {
                    *c = b + SHRINK * (*c - b);
                }
                (*value, spent) = evaluate(corner);
            }
        }
        corners.sort_by(by_cost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rosenbrock(x: &[f64]) -> f64 {
        100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
    }

    #[test]
    fn rosenbrock_ends_where_fminsearch_does() {
        // MATLAB's own example: from (−1.2, 1) fminsearch stops after 85 iterations and 159 evaluations at (1.0000, 1.0000), cost 8.2e−10.
        let end = minimise(rosenbrock, &[-1.2, 1.0], &NelderMeadSettings::default());
        assert_eq!((end.iterations, end.evaluations, end.stop), (85, 159, SimplexStop::Tolerance));
        assert!((end.cost - 8.177_66e-10).abs() < 1e-14, "{}", end.cost);
    }

    #[test]
    fn it_says_when_it_ran_out_and_keeps_out_of_walls() {
        let few = NelderMeadSettings { per_unknown: 10, ..NelderMeadSettings::default() };
        assert_eq!(minimise(rosenbrock, &[-1.2, 1.0], &few).stop, SimplexStop::Evaluations);
        let walled = |x: &[f64]| if x[0] < 0.5 { f64::NAN } else { x[0] * x[0] + x[1] * x[1] };
        let end = minimise(walled, &[2.0, 1.0], &NelderMeadSettings::default());
        assert!((end.at[0] - 0.5).abs() < 1e-3 && end.at[1].abs() < 1e-2, "{:?}", end.at);
        assert_eq!(minimise(walled, &[0.0, 1.0], &NelderMeadSettings::default()).stop, SimplexStop::NoStart);
    }

    #[test]
    fn a_zero_coordinate_gets_a_corner_of_its_own() {
        let end = minimise(|x| (x[0] - 3.0).powi(2), &[0.0], &NelderMeadSettings::tight());
        assert!((end.at[0] - 3.0).abs() < 1e-7);
    }
}
