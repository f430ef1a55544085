//! The ladder of models for one subject, from one muscle with one number upwards: what each rung buys in held-out error, and what it costs.
//!
//! The recommended rung is the lowest whose held-out error lies within one standard error of the best: the rule of Breiman, Friedman, Olshen
//! and Stone (*Classification and Regression Trees*, 1984), taken over patches of skin.

use std::time::Instant;

use serde::Serialize;

use super::Samples;
use super::analysis::{Analysis, Pull, left_out};
use crate::face::FaceModel;
use crate::fit::activations;
use crate::fit::{Compare, HeldOut, LawFit, LawFitOptions, Noise, Patches, Sample, Strengths, fit_law};
use crate::forces::SpringRule;
use crate::muscle::{Fibre, LawKind, Lobe, MuscleLaw};
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::Project;
use crate::skin::{Contraction, StressStrainCurve};

/// One rung.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// What is new on it: "own strengths".
    pub name: String,
    /// Which step of modelling it is: law, lobe, muscles, skin, springs.
    pub step: &'static str,
    /// Numbers fitted.
    pub parameters: usize,
    /// Share explained of what no muscle would leave, in the fit; none where the fit failed.
    pub r2: Option<f64>,
    /// Its error on patches left out.
    pub held_out: Option<HeldOut>,
    /// Time of one fit, ms.
    pub time_ms: f64,
    /// Why there is no fit.
    pub failed: Option<String>,
}

/// All rungs, from the bottom.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ladder {
    /// The rungs.
    pub rungs: Vec<Rung>,
    /// The rung beyond which nothing more is gained.
    pub recommended: Option<usize>,
    /// The rung with the least held-out error.
    pub best: Option<usize>,
}

/// Builds the ladder on what an analysis has found. `stop` is asked between rungs, and `progress` told the share done; a ladder that was
/// stopped is none.
///
/// Rungs with other skin or other springs change the forces themselves, whose error is then a share of *their* squares.
pub fn ladder(
    project: &Project,
    face: &FaceModel,
    image_size_px: [u32; 2],
    analysis: &Analysis,
    stop: &dyn Fn() -> bool,
    progress: &dyn Fn(f64),
) -> Option<Ladder> {
    let all: Vec<Fibre> = analysis.fibres.iter().map(|f| f.fibre.clone()).collect();
    let patches = Patches::new(&analysis.set_fibres(), &analysis.samples.samples, analysis.question.patch_radius_mm);
    let field = Trial { patches: &patches, compare: analysis.question.compare };
    let plain = analysis.shape;
    let anatomical = MuscleLaw::default_of(LawKind::Anatomical);
    let first = analysis.selection.path.get(1).and_then(|s| s.added).or(analysis.set.first().copied());
    let one: Vec<Fibre> = first.into_iter().map(|f| all[f].clone()).collect();
    let set = analysis.set_fibres();
    let samples = &analysis.samples.samples;
    let mut rungs = Vec::new();
    let steps = 9.0 + LawKind::ALL.len() as f64;
    let mut add = |rung: Rung| {
        rungs.push(rung);
        progress(rungs.len() as f64 / steps);
        !stop()
    };

    let nothing = Rung {
        name: "no muscle".into(),
        step: "nothing",
        parameters: 0,
        r2: Some(0.0),
        held_out: field.nothing(samples, &set),
        time_ms: 0.0,
        failed: None,
    };
    let go = add(nothing)
        && add(field.law(
            "one muscle, one strength",
            "muscle",
            &anatomical,
            &one,
            samples,
            Shape::Held,
            Strengths::Shared,
        ))
        && add(field.law(
            "its set, one strength",
            "muscles",
            &anatomical,
            &set,
            samples,
            Shape::Held,
            Strengths::Shared,
        ))
        && add(field.law("own strengths", "muscles", &anatomical, &set, samples, Shape::Held, Strengths::EachFibre));
    if !go {
        return None;
    }
    for kind in LawKind::ALL {
        let law = MuscleLaw::default_of(kind);
        let name = format!("{}, shape fitted", kind.label());
        if !add(field.law(&name, "law", &law, &set, samples, Shape::Fitted, Strengths::EachFibre)) {
            return None;
        }
    }
    if let Some(lobed) = anatomical.with_lobe(Some(Lobe::AtAttachment))
        && !add(field.law(
            "Anatomical, second lobe",
            "lobe",
            &lobed,
            &set,
            samples,
            Shape::Fitted,
            Strengths::EachFibre,
        ))
    {
        return None;
    }
    if !add(field.all_muscles(&plain, &all, samples)) {
        return None;
    }
    for (name, step, changed) in other_skins(project) {
        let outcome = pipeline::solve(&changed, face, image_size_px, &mut Workspace::default());
        let samples = same_vertices(&outcome, face, analysis);
        let law = analysis.best_fit().map_or(anatomical, |f| f.law);
        let rung = match &samples {
            Some(samples) => field.law(name, step, &law, &set, samples, Shape::Fitted, Strengths::EachFibre),
            None => Rung::failed(name, step, "other vertices can be believed with it".into()),
        };
        if !add(rung) {
            return None;
        }
    }
    let best = least(&rungs);
    Some(Ladder { recommended: best.and_then(|b| lowest_as_good(&rungs, b)), best, rungs })
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Shape {
    Held,
    Fitted,
}

/// The field on which rungs are tried.
struct Trial<'a> {
    patches: &'a Patches,
    compare: Compare,
}

impl Rung {
    fn failed(name: &str, step: &'static str, why: String) -> Self {
        let name = name.to_owned();
        Self { name, step, parameters: 0, r2: None, held_out: None, time_ms: 0.0, failed: Some(why) }
    }
}

impl Trial<'_> {
    fn nothing(&self, samples: &[Sample], fibres: &[Fibre]) -> Option<HeldOut> {
        self.patches.test(samples, self.compare, fibres, |_| (|_: &Sample| nalgebra::Vector3::zeros(), true))
    }

    #[expect(clippy::too_many_arguments, reason = "a rung is a row of a table, and these are its columns")]
    fn law(
        &self,
        name: &str,
        step: &'static str,
        law: &MuscleLaw,
        fibres: &[Fibre],
        samples: &[Sample],
        shape: Shape,
        strengths: Strengths,
    ) -> Rung {
        let mut options = LawFitOptions { compare: self.compare, strengths, ..LawFitOptions::default() };
        if shape == Shape::Held {
            options = LawFitOptions { variants: false, ..options }.with_shape_held(law);
        }
        match fit_law(law, fibres, samples, &options) {
            Ok(fit) => Rung {
                name: name.to_owned(),
                step,
                parameters: numbers(&fit),
                r2: Some(fit.r2),
                held_out: left_out(self.patches, &fit, fibres, samples, &options),
                time_ms: fit.time_ms,
                failed: None,
            },
            Err(failed) => Rung { time_ms: failed.time_ms, ..Rung::failed(name, step, failed.why.to_string()) },
        }
    }

    fn all_muscles(&self, pull: &Pull, fibres: &[Fibre], samples: &[Sample]) -> Rung {
        let name = "all muscles at once";
        let compare = if self.compare == Compare::Vectors { Compare::Vectors } else { Compare::Tangential };
        let began = Instant::now();
        let design = match pull.design(fibres, samples, compare) {
            Ok(design) => design,
            Err(why) => return Rung::failed(name, "muscles", why.to_string()),
        };
        let found = activations::activations(&design, None, Noise::default());
        let time_ms = began.elapsed().as_secs_f64() * 1e3;
        let held_out = self.patches.test(samples, compare, fibres, |left| {
            let design = pull.design(fibres, left, compare);
            let found = design.map(|d| activations::activations(&d, None, Noise::default()).strengths());
            let (strengths, fitted) = (found.as_ref().ok().cloned(), found.is_ok());
            let foretold = move |s: &Sample| {
                let strengths = strengths.iter().flat_map(|x| x.iter());
                let pulls = fibres.iter().zip(strengths).map(|(f, x)| pull.force(f, &s.position) * *x);
                pulls.sum::<nalgebra::Vector3<f64>>()
            };
            (foretold, fitted)
        });
        Rung {
            name: name.to_owned(),
            step: "muscles",
            parameters: fibres.len(),
            r2: Some(found.r_squared),
            held_out,
            time_ms,
            failed: None,
        }
    }
}

fn numbers(fit: &LawFit) -> usize {
    fit.parameters.iter().filter(|p| p.fitted).count() + fit.strengths.len()
}

/// Projects with another skin or other springs.
fn other_skins(project: &Project) -> Vec<(&'static str, &'static str, Project)> {
    let with = |change: &dyn Fn(&mut crate::project::Settings)| {
        let mut other = project.clone();
        change(&mut other.settings);
        other
    };
    let skin = &project.settings.skin;
    let mut all = Vec::new();
    let other_contraction = match skin.contraction() {
        Contraction::Saturating => ("skin that does not wrinkle", Contraction::Fung),
        Contraction::Fung => ("skin that wrinkles", Contraction::Saturating),
    };
    if let Ok(curve) = StressStrainCurve::new(skin.rows().to_vec(), other_contraction.1) {
        all.push((other_contraction.0, "skin", with(&|s| s.skin = curve.clone())));
    }
    // One slope, that of the curve at rest: Hooke's law, the simplest skin.
    let slope = skin.slope_kpa(0.0);
    if let Ok(line) =
        StressStrainCurve::new(vec![[-0.5, -0.5 * slope], [0.0, 0.0], [0.5, 0.5 * slope]], Contraction::Fung)
    {
        all.push(("skin of one slope", "skin", with(&|s| s.skin = line.clone())));
    }
    let (name, rule) = match project.settings.springs {
        SpringRule::Strip => ("one law for all springs", SpringRule::Uniform),
        SpringRule::Uniform => ("springs as strips of skin", SpringRule::Strip),
    };
    all.push((name, "springs", with(&|s| s.springs = rule)));
    all
}

/// The forces of an outcome on the vertices of an analysis; none where one of them has no finite force.
fn same_vertices(outcome: &Outcome, face: &FaceModel, analysis: &Analysis) -> Option<Vec<Sample>> {
    let known = Samples::of(outcome, face, super::Include::Known);
    let find = |v: &u32| known.vertices.iter().position(|k| k == v).map(|at| known.samples[at]);
    analysis.samples.vertices.iter().map(find).collect()
}

fn least(rungs: &[Rung]) -> Option<usize> {
    let rated = rungs.iter().enumerate().filter(|(_, r)| on_this_field(r));
    rated.filter_map(|(k, r)| Some((k, r.held_out.as_ref()?.error))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// Errors on other forces cannot be set beside these patch by patch.
fn on_this_field(rung: &Rung) -> bool {
    rung.step != "skin" && rung.step != "springs"
}

/// A smaller share of the squares is rounding.
pub(super) const ROUNDING: f64 = 1e-6;

/// The rung with the fewest numbers whose squared error exceeds the best one's by no more than one standard error of the difference.
fn lowest_as_good(rungs: &[Rung], best: usize) -> Option<usize> {
    let of_best = rungs[best].held_out.as_ref()?;
    let as_good = |rung: &Rung| {
        rung.held_out.as_ref().is_some_and(|held_out| {
            let [excess, error] = held_out.excess_over(of_best);
            excess <= error.max(ROUNDING)
        })
    };
    let good = rungs.iter().enumerate().filter(|(_, r)| on_this_field(r) && as_good(r));
    good.min_by(|a, b| a.1.parameters.cmp(&b.1.parameters).then(a.1.time_ms.total_cmp(&b.1.time_ms))).map(|(k, _)| k)
}
