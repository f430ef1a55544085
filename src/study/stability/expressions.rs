//! Maps of the moving face: the six expressions at once, at any activation, stepped by every method.

use std::sync::{Arc, OnceLock};

use super::super::kind::Options;
use super::super::runner::Case;
use super::super::table::Run;
use super::motion::{Start, Way, random, went};
use super::{case, run};
use crate::expression::{Basic, Expression, Setup, Stage};
use crate::simulate::Method;

/// Number of the part.
const PART: usize = 8;

/// One case a method, step and activation; its seeds are the expressions, from 1 in the order of the plates.
pub(super) fn cases(options: &Options) -> Vec<Case> {
    let (steps, activations, expressions): (&[f64], &[f64], &[Basic]) = if options.quick {
        (&[0.1, 10.0], &[100.0, 200.0], &[Basic::Surprise, Basic::Anger])
    } else {
        (&[0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 33.0], &[0.0, 50.0, 100.0, 150.0, 200.0], &Basic::ALL)
    };
    let stage: Arc<OnceLock<Result<Stage, String>>> = Arc::default();
    let mut cases = Vec::new();
    for method in Method::ALL {
        for &percent in activations {
            for &step_ms in steps {
                let (face, stage, expressions) = (Arc::clone(&options.face), Arc::clone(&stage), expressions.to_vec());
                let setting = [("step_ms", step_ms), ("activation_percent", percent)];
                cases.push(case(PART, method.label(), &setting, move || {
                    let stage = stage.get_or_init(|| {
                        Stage::new(&face, face.mesh().positions(), &Setup::default()).map_err(|e| e.to_string())
                    });
                    let one = |basic: &Basic| {
                        let seed = Basic::ALL.iter().position(|b| b == basic).unwrap_or(0) as u64 + 1;
                        let [step, activation] = setting;
                        let setting = [step, activation, ("expression", seed as f64)];
                        let row = Run { vertices: face.mesh().len(), seed, ..run(PART, method.label(), &setting) };
                        match stage {
                            Ok(stage) => played(stage, *basic, method, step_ms, percent, row),
                            Err(e) => row.failing(Some(e.clone())),
                        }
                    };
                    expressions.iter().map(one).collect()
                }));
            }
        }
    }
    cases
}

/// All muscles pull at once, and the jaw is open from the start: harder than in the window, where both glide.
fn played(stage: &Stage, basic: Basic, method: Method, step_ms: f64, percent: f64, row: Run) -> Run {
    let Stage { mut system, actuators } = stage.clone();
    let expression = Expression::basic(basic, &actuators).times(percent / 100.0);
    system.open_jaw(expression.jaw_deg.to_radians());
    if let Err(e) = system.set_loads(actuators.loads(&expression).newton) {
        return row.failing(Some(e.to_string()));
    }
    let mut state = system.at_rest();
    state.positions = system.carried();
    let seed = row.seed;
    let start = Start { system, state, step_s: Some(1e-3 * step_ms), must_unfold: false };
    went(Way::Stepped(method), start, &mut random(seed), row)
}
