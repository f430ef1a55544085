//! Motion under a muscle: every way of stepping through time at every step, against a run of very small steps.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use nalgebra::Point3;

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::stability::{cause_of, pulled};
use super::super::table::{Run, setting};
use super::{case, run};
use crate::face::FaceModel;
use crate::simulate::{Method, Stepper, System, SystemOptions};

/// A run lasts so long, s: one frame of a film, and the skin is still on its way then.
const LASTS_S: f64 = 1.0 / 30.0;
/// Step of the run that is the truth, s: with Runge and Kutta's method its own error is far below what is compared.
const TRUE_STEP_S: f64 = 4e-5;
/// Pull of the muscle, in the unit of the maps of stability.
const PULL: f64 = 1.0;

/// Where the skin is at the end.
type Truth = Arc<OnceLock<Result<Vec<Point3<f64>>, String>>>;

pub(super) fn cases(options: &Options) -> Vec<Case> {
    let steps: &[f64] =
        if options.quick { &[0.1, 1.0, 10.0] } else { &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 16.7, 33.3] };
    let truth: Truth = Truth::default();
    let mut cases = Vec::new();
    for method in Method::ALL {
        for &step_ms in steps {
            let (face, truth) = (Arc::clone(&options.face), Arc::clone(&truth));
            let setting = setting(&[("step_ms", step_ms)]);
            let of = setting.clone();
            let work = move || vec![stepped(&face, &truth, method, step_ms, run(7, method.label(), &of))];
            cases.push(case(7, method.label(), &setting, work).weighing(0.05 + 0.2 / step_ms));
        }
    }
    cases
}

fn ended(system: &System, method: Method, step_s: f64) -> Result<Vec<Point3<f64>>, String> {
    let mut state = system.at_rest();
    let mut stepper = Stepper::new(method);
    let whole = (LASTS_S / step_s).floor() as usize;
    for _ in 0..whole {
        stepper.step(system, &mut state, step_s).map_err(|f| cause_of(&f))?;
    }
    // What is left of the time, where the step does not divide it.
    let left = LASTS_S - whole as f64 * step_s;
    if left > 1e-9 {
        stepper.step(system, &mut state, left).map_err(|f| cause_of(&f))?;
    }
    Ok(state.positions)
}

fn stepped(face: &FaceModel, truth: &Truth, method: Method, step_ms: f64, row: Run) -> Run {
    let row = Run { vertices: face.mesh().len(), ..row };
    let system = match pulled(face, SystemOptions::default(), PULL) {
        Ok(system) => system,
        Err(e) => return row.failing(Some(e.to_string())),
    };
    let truth = match truth.get_or_init(|| ended(&system, Method::RungeKutta4, TRUE_STEP_S)) {
        Ok(truth) => truth,
        Err(why) => return row.failing(Some(format!("no truth: {why}"))),
    };
    let begun = Instant::now();
    let found = ended(&system, method, 1e-3 * step_ms);
    let row = row.timed(begun.elapsed().as_secs_f64() * 1e3);
    match found {
        Err(why) => row.failing(Some(why)),
        Ok(found) => {
            let square = |a: &[Point3<f64>]| a.iter().zip(truth).map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
            let error = (square(&found) / square(system.rest())).sqrt();
            // Beyond the whole motion it is no answer.
            row.erring(error).failing((error > 1.0).then(|| "further off than skin that never moved".to_owned()))
        }
    }
}
