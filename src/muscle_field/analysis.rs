//! The whole answer for one subject: which muscles pulled and how hard, what the four laws say of it, and which law to believe.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::fibres::{FibreOf, fibres};
use super::ladder::ROUNDING;
use super::{Include, Samples};
use crate::face::FaceModel;
use crate::fit::activations::{self, Activations};
use crate::fit::design::{Design, DesignError};
use crate::fit::selection::{Selection, SelectionSettings, smallest_set};
use crate::fit::{
    Compare, FailedFit, HeldOut, LawFit, LawFitOptions, Noise, Patches, Sample, candidates, fit_law_with,
};
use crate::forces::Cause;
use crate::muscle::{Fibre, LawKind, Lobe, MuscleLaw};
use crate::pipeline::Outcome;

/// What is asked of a field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Question {
    /// Vertices that count.
    pub include: Include,
    /// What of the forces is compared with a law.
    pub compare: Compare,
    /// The muscles whose law is fitted, by index in the face; without them the smallest set that explains the field.
    pub muscles: Option<Vec<usize>>,
    /// Radius of the patches that are left out to test a fit, mm.
    pub patch_radius_mm: f64,
}

impl Default for Question {
    fn default() -> Self {
        // Depth is what one camera does not see: the part in the skin is what a frame shows.
        Self { include: Include::default(), compare: Compare::Tangential, muscles: None, patch_radius_mm: 15.0 }
    }
}

impl Question {
    /// The words of `frontalis fit` that ask the same of a project fitted with this face; none for the usual question.
    pub fn arguments(&self, face: &FaceModel) -> Vec<String> {
        let usual = Self::default();
        let mut words = Vec::new();
        let mut add = |name: &str, value: String| words.extend([name.to_owned(), value]);
        if self.compare != usual.compare {
            add("--compare", self.compare.name().to_owned());
        }
        if self.include != usual.include {
            add("--include", self.include.name().to_owned());
        }
        if let Some(muscles) = &self.muscles {
            let ids: Vec<&str> = muscles.iter().filter_map(|&m| Some(face.muscles().get(m)?.id.as_str())).collect();
            add("--muscles", ids.join(","));
        }
        if self.patch_radius_mm != usual.patch_radius_mm {
            add("--patch-mm", self.patch_radius_mm.to_string());
        }
        words
    }
}

/// One law beside the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LawRow {
    /// The law as it began.
    pub law: MuscleLaw,
    /// The fit, or why there is none.
    pub fit: Result<LawFit, FailedFit>,
    /// How it does on patches that it has not seen.
    pub held_out: Option<HeldOut>,
}

impl LawRow {
    /// Its name.
    pub fn label(&self) -> String {
        self.fit.as_ref().map_or_else(|_| self.law.label(), |fit| fit.label.clone())
    }
}

/// Why there is nothing to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Nothing {
    /// No vertex that counts.
    #[error("no force can be believed yet: mark feature points and their neighbours in the last frame")]
    NoSamples,
    /// The face has no muscle.
    #[error("this face has no muscle with a fibre: bind muscles in the Face workspace")]
    NoMuscles,
    /// All forces are zero.
    #[error("every force is zero: nothing moved")]
    NoForce,
    /// Numbers that are none.
    #[error("a force or its error is no finite number")]
    NotFinite,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Analysis {
    /// What was asked.
    pub question: Question,
    /// The forces that counted.
    pub samples: Samples,
    /// The causes of their errors, by sample.
    pub causes: Vec<Cause>,
    /// All muscles that have a fibre.
    pub fibres: Vec<FibreOf>,
    /// The muscles whose law is fitted, as indices into `fibres`.
    pub set: Vec<usize>,
    /// Whether that set explains the field better than no muscle does on patches left out; a set that was given is not judged.
    pub explains: bool,
    /// The four laws, and the anatomical one with a second lobe.
    pub laws: Vec<LawRow>,
    /// The law with the least held-out error, by index in `laws`.
    pub best: Option<usize>,
    /// Strengths of all muscles at once, by the best law's shape.
    pub activations: Activations,
    /// The smallest set, by the same shape, as indices into `fibres`.
    pub selection: Selection,
    /// The shape that activations and the smallest set were found with.
    pub shape: Pull,
}

/// How one muscle pulls at a strength of 1 N when its second lobe keeps a fixed share of the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pull {
    /// The law.
    pub law: MuscleLaw,
    /// Strength of the second lobe over that of the first; 0 for a law without one, −1 where what pulls at the insertion pulls back as
    /// hard at the attachment.
    pub second_lobe: f64,
}

impl Pull {
    /// A law without a second lobe.
    pub fn plain(law: MuscleLaw) -> Self {
        Self { law, second_lobe: 0.0 }
    }

    /// Force on a point, N.
    pub fn force(&self, fibre: &Fibre, x: &Point3<f64>) -> Vector3<f64> {
        let main = self.law.force(fibre, x);
        if self.second_lobe == 0.0 { main } else { main + self.law.lobe_force(1, fibre, x) * self.second_lobe }
    }

    /// Forces as columns, one a fibre.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn design(&self, fibres: &[Fibre], samples: &[Sample], compare: Compare) -> Result<Design, DesignError> {
        if self.second_lobe == 0.0 {
            return Design::of(&self.law, fibres, samples, compare);
        }
        let mut design = Design::new(samples, compare)?;
        for fibre in fibres {
            design.add(samples.iter().map(|s| self.force(fibre, &s.position)));
        }
        Ok(design)
    }

    /// Name for people.
    pub fn label(&self) -> String {
        self.law.label()
    }

    /// What a fit has found: its law, and the share of the second lobes in the whole strength.
    fn of(fit: &LawFit) -> Self {
        let sum = |lobe: usize| fit.strengths.iter().filter(|s| s.lobe == lobe).map(|s| s.value).sum::<f64>();
        let share = sum(1) / sum(0);
        Self { law: fit.law, second_lobe: if share.is_finite() { share.clamp(-MOST_LOBE, MOST_LOBE) } else { 0.0 } }
    }
}

/// A second lobe is at most so many times as strong as the first.
const MOST_LOBE: f64 = 3.0;

/// The shapes by which the smallest set is looked for: each law's default, and the anatomical one whose two lobes pull against each other.
/// Frontalis has no bone at its upper end: what raises the brow lowers the upper forehead.
fn first_guesses() -> Vec<Pull> {
    let mut all: Vec<Pull> = LawKind::ALL.map(|kind| Pull::plain(MuscleLaw::default_of(kind))).to_vec();
    let lobed = MuscleLaw::default_of(LawKind::Anatomical).with_lobe(Some(Lobe::AtAttachment));
    all.extend(lobed.map(|law| Pull { law, second_lobe: -1.0 }));
    all
}

impl Analysis {
    /// Looks for the muscles behind an outcome's forces, whose errors have these causes ([`crate::pipeline::error_causes`]; without any they are taken
    /// for independent). `stop` is asked between fits; an answer that was stopped is none.
    ///
    /// 1. The smallest set is looked for with each law's default shape, and with two lobes that pull against each other; the union is what all laws are then fitted to, so that no law
    ///    has chosen the muscles alone.
    /// 2. Each law is fitted, and again with each patch left out.
    /// 3. With the shape of the law that does best on the patches: strengths of all muscles, and the smallest set.
    ///
    /// # Errors
    /// [`Nothing`] where there is nothing to fit; `None` where it was stopped.
    pub fn new(
        outcome: &Outcome,
        causes: &[Cause],
        face: &FaceModel,
        question: &Question,
        stop: &dyn Fn() -> bool,
    ) -> Option<Result<Self, Nothing>> {
        match Self::find(outcome, causes, face, question, stop) {
            Ok(analysis) => Some(Ok(analysis)),
            Err(Halt::Nothing(nothing)) => Some(Err(nothing)),
            Err(Halt::Stopped) => None,
        }
    }

    fn find(
        outcome: &Outcome,
        causes: &[Cause],
        face: &FaceModel,
        question: &Question,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, Halt> {
        let samples = Samples::of(outcome, face, question.include);
        let causes = samples.causes(causes);
        let (fibres, _) = fibres(face, &outcome.first);
        if samples.is_empty() {
            return Err(Nothing::NoSamples.into());
        }
        if fibres.is_empty() {
            return Err(Nothing::NoMuscles.into());
        }
        if samples.samples.iter().all(|s| s.force == Vector3::zeros()) {
            return Err(Nothing::NoForce.into());
        }
        let lines: Vec<Fibre> = fibres.iter().map(|f| f.fibre.clone()).collect();
        let positions: Vec<Point3<f64>> = samples.samples.iter().map(|s| s.position).collect();
        let settings = SelectionSettings { patch_radius_mm: question.patch_radius_mm, ..SelectionSettings::default() };
        let design = |pull: &Pull| {
            pull.design(&lines, &samples.samples, linear(question.compare)).map_err(|_| Nothing::NotFinite)
        };

        let (set, explains) = if let Some(muscles) = &question.muscles {
            ((0..fibres.len()).filter(|&f| muscles.contains(&fibres[f].muscle)).collect(), true)
        } else {
            let mut chosen = vec![false; fibres.len()];
            let mut strongest = None;
            for guess in first_guesses() {
                let found = smallest_set(&design(&guess)?, &positions, &settings);
                found.chosen.iter().for_each(|&f| chosen[f] = true);
                strongest = strongest.or(found.path.get(1).and_then(|step| step.added));
                pause(stop)?;
            }
            let set: Vec<usize> = (0..fibres.len()).filter(|&f| chosen[f]).collect();
            // Where nothing explains the field the law is shown on the muscle that comes nearest to it.
            if set.is_empty() { (strongest.into_iter().collect(), false) } else { (set, true) }
        };

        let of_set: Vec<Fibre> = set.iter().map(|&f| lines[f].clone()).collect();
        let patches = Patches::new(&of_set, &samples.samples, question.patch_radius_mm);
        let options = LawFitOptions { compare: question.compare, ..LawFitOptions::default() };
        let mut laws = Vec::new();
        for law in candidates() {
            let fit = fit_law_with(&law, &of_set, &samples.samples, &causes, &options);
            let held_out =
                fit.as_ref().ok().and_then(|fit| left_out(&patches, fit, &of_set, &samples.samples, &options));
            laws.push(LawRow { law, fit, held_out });
            pause(stop)?;
        }
        let best = best_of(&laws);
        let default = || Pull::plain(MuscleLaw::default_of(LawKind::Anatomical));
        let shape = best.and_then(|b| laws[b].fit.as_ref().ok()).map_or_else(default, Pull::of);
        let design = design(&shape)?;
        let selection = smallest_set(&design, &positions, &settings);
        let activations = activations::activations(&design.with_causes(&causes), None, Noise::default());
        let question = question.clone();
        Ok(Self { question, samples, causes, fibres, set, explains, laws, best, activations, selection, shape })
    }

    /// The best law's fit.
    pub fn best_fit(&self) -> Option<&LawFit> {
        self.best.and_then(|b| self.laws[b].fit.as_ref().ok())
    }

    /// The strengths of the set's muscles alone, by the shape that all were found with; none where a number is no number. Strengths of
    /// all muscles at once hold some that hardly reach what was measured and take on what is noise there.
    pub fn strengths_of_set(&self) -> Option<Activations> {
        let lines: Vec<Fibre> = self.fibres.iter().map(|f| f.fibre.clone()).collect();
        let design = self.shape.design(&lines, &self.samples.samples, linear(self.question.compare)).ok()?;
        let allowed: Vec<bool> = (0..lines.len()).map(|f| self.set.contains(&f)).collect();
        Some(activations::activations(&design.with_causes(&self.causes), Some(&allowed), Noise::default()))
    }

    /// The fibres of the set, in the order of a fit's strengths.
    pub fn set_fibres(&self) -> Vec<Fibre> {
        self.set.iter().map(|&f| self.fibres[f].fibre.clone()).collect()
    }

    /// Whether a second lobe has earned its parameters: by Schwarz's criterion, and on patches left out by more than the standard error
    /// of the difference.
    pub fn second_lobe_pays(&self) -> Option<bool> {
        let row = |lobes: usize| {
            let found = self.laws.iter().find(|r| r.law.kind() == LawKind::Anatomical && r.law.lobes() == lobes)?;
            Some((found.fit.as_ref().ok()?.bic, found.held_out.as_ref()?))
        };
        let ((bic, held_out), (bic_with, held_out_with)) = (row(1)?, row(2)?);
        let [gain, error] = held_out.excess_over(held_out_with);
        Some(bic_with < bic && gain > error.max(ROUNDING))
    }
}

/// A fit's law on patches left out, each time fitted from where the whole fit ended.
pub(super) fn left_out(
    patches: &Patches,
    fit: &LawFit,
    fibres: &[Fibre],
    samples: &[Sample],
    options: &LawFitOptions,
) -> Option<HeldOut> {
    patches.law(&fit.law, fibres, samples, &LawFitOptions { variants: false, starts: 1, ..options.clone() })
}

/// Several muscles at once are linear in their strengths only where directions are compared.
fn linear(compare: Compare) -> Compare {
    if compare == Compare::Vectors { Compare::Vectors } else { Compare::Tangential }
}

/// The law with the least error on patches left out; where none could be left out, the one with the least criterion.
fn best_of(laws: &[LawRow]) -> Option<usize> {
    let by = |of: &dyn Fn(&LawRow) -> Option<f64>| {
        let rated = laws.iter().enumerate().filter_map(|(k, row)| Some((k, of(row).filter(|x| x.is_finite())?)));
        rated.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    };
    by(&|row| Some(row.held_out.as_ref()?.error)).or_else(|| by(&|row| Some(row.fit.as_ref().ok()?.bic)))
}

enum Halt {
    Nothing(Nothing),
    Stopped,
}

impl From<Nothing> for Halt {
    fn from(nothing: Nothing) -> Self {
        Self::Nothing(nothing)
    }
}

fn pause(stop: &dyn Fn() -> bool) -> Result<(), Halt> {
    if stop() { Err(Halt::Stopped) } else { Ok(()) }
}
