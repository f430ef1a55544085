//! Whether intervals of fits hold where forces are measured by marks: the errors of a chain, which go together, on the field of a known law.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::law_trial::STRENGTHS;
use super::membrane_truth::{MembraneFace, MembraneSettings};
use super::scene;
use super::twin::{Twin, TwinSettings, normal_pair};
use crate::displacement::DepthRule;
use crate::expression::{Basic, Expression};
use crate::face::FaceModel;
use crate::fit::activations::{Standing, activations};
use crate::fit::{Compare, Design, LawFit, LawFitOptions, Noise, Sample, fit_law_with};
use crate::forces::{Cause, SkinModel};
use crate::muscle::{Fibre, MuscleLaw};
use crate::pipeline::samples::{Include, Samples};
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::{FieldWay, Project};

/// Side of the square frames, px.
const SIZE_PX: u32 = 1036;
/// Share of the expression's full strength.
const INTENSITY: f64 = 0.6;
const REGION: &str = "forehead_and_brows";

/// A forehead with the brows, marked with no error where a surprise takes it, and the same skin's fibres of the frontalis.
pub struct MarkedForehead {
    face: FaceModel,
    project: Project,
    exact: Outcome,
    samples: Samples,
    fibres: Vec<Fibre>,
}

/// Shares of 95 % intervals that held the truth: where they know how errors go together, and where they take them for independent.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedCoverage {
    /// The law and its reading, or the strengths alone for its known shape.
    pub label: String,
    /// Draws of the marks.
    pub draws: usize,
    /// Draws without a fit, or whose samples are not those of the exact marks.
    pub failed: usize,
    /// Shape parameters with a slope: with the causes of the errors, and without; none where the shape is known.
    pub shape: Option<[f64; 2]>,
    /// The same of the strengths.
    pub strengths: [f64; 2],
}

/// What of a draw's intervals held the truth: shape and strengths, with causes and without.
type Held = [[Vec<bool>; 2]; 2];

/// Fits a field with its errors' causes, and asks the intervals; none without a fit.
type Asked<'a> = dyn Fn(&[Sample], &[Cause]) -> Option<Held> + Sync + 'a;

impl MarkedForehead {
    /// Marked for a way to the forces, with a marking error as it is stated.
    ///
    /// # Errors
    /// One line: why there is no such scene.
    pub fn new(generic: &FaceModel, way: FieldWay, noise_px: f64) -> Result<Self, String> {
        let settings = TwinSettings { seed: 1, noise_px: 0.0, ..TwinSettings::default() };
        let person = scene::person(generic, settings.seed, settings.distance_mm).map_err(|e| e.to_string())?;
        let mut moving = MembraneFace::new(&person, &MembraneSettings::default()).map_err(|e| e.to_string())?;
        let surprise = Expression::basic(Basic::Surprise, moving.actuators()).times(INTENSITY);
        let truth = moving.truth(&surprise).map_err(|e| e.to_string())?;
        let twin = Twin::displaced(&person, truth.last, &settings).map_err(|e| e.to_string())?;
        let frames = scene::unseen_frames(SIZE_PX);
        let mut project = scene::membrane_project(&twin, &person, frames, noise_px, Basic::Surprise.name(), 0.0);
        scene::mark_only(&mut project, person.region(REGION));
        project.settings.depth = DepthRule::KeepHeight;
        project.settings.skin_model = SkinModel::Membrane;
        project.settings.field = way;
        let exact = pipeline::solve(&project, generic, [SIZE_PX; 2], &mut Workspace::default());
        let samples = Samples::of(&exact, generic, Include::Believed);
        let normals = generic.mesh().vertex_normals(&exact.first);
        let frontalis = generic.muscles().iter().filter(|m| m.id.starts_with("frontalis"));
        let fibres = frontalis.map(|m| Fibre::of(m, &exact.first, &normals)).collect::<Result<_, _>>();
        let fibres = fibres.map_err(|e| e.to_string())?;
        Ok(Self { face: generic.clone(), project, exact, samples, fibres })
    }

    /// Errors of the forces, N, with their standard errors as samples without a force, and their causes, where the marks err by the seed's draw. None
    /// where other vertices are believed than with exact marks.
    fn drawn(&self, seed: u64) -> Option<(Vec<Sample>, Vec<Cause>)> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x6d61_726b);
        let mut project = self.project.clone();
        let sigma = self.project.settings.marking_sigma_px;
        for mark in project.features.values_mut().filter_map(|f| f.last.as_mut()) {
            let off = normal_pair(&mut random);
            mark.at_px = [0, 1].map(|axis| mark.at_px[axis] + sigma * off[axis]);
        }
        let outcome = pipeline::solve(&project, &self.face, [SIZE_PX; 2], &mut Workspace::default());
        let samples = Samples::of(&outcome, &self.face, Include::Believed);
        if samples.vertices != self.samples.vertices {
            return None;
        }
        let causes = samples.causes(&pipeline::error_causes(&project, &self.face, [SIZE_PX; 2]));
        let exact = self.exact.measured().0;
        let pairs = samples.vertices.iter().zip(&samples.samples);
        let errors = pairs.map(|(v, s)| Sample { force: s.force - exact[*v as usize], ..*s });
        Some((errors.collect(), causes))
    }

    /// Fits every law to its own field of [`STRENGTHS`] with the errors of so many draws of the marks, and finds the strengths alone for the shapes.
    pub fn coverage(&self, laws: &[MuscleLaw], draws: usize) -> Vec<MarkedCoverage> {
        let drawn: Vec<_> = (0..draws as u64).into_par_iter().map(|seed| self.drawn(seed)).collect();
        let share = |held: &dyn Fn(&Held) -> &Vec<bool>, all: &[Held]| {
            let (sum, count) = all.iter().flat_map(held).fold((0, 0), |(sum, n), h| (sum + u32::from(*h), n + 1));
            (count > 0).then(|| f64::from(sum) / f64::from(count))
        };
        let both = |part: usize, all: &[Held]| -> Option<[f64; 2]> {
            Some([share(&|held| &held[0][part], all)?, share(&|held| &held[1][part], all)?])
        };
        let covered = |label: String, asked: &Asked<'_>| {
            let all: Vec<Held> =
                drawn.par_iter().flatten().filter_map(|(samples, causes)| asked(samples, causes)).collect();
            MarkedCoverage {
                label,
                draws,
                failed: draws - all.len(),
                shape: both(0, &all),
                strengths: both(1, &all).unwrap_or_default(),
            }
        };
        let mut all = Vec::new();
        for law in laws {
            all.push(covered(law.label(), &|errors, causes| {
                let samples = self.field(law, errors);
                Some([self.fitted(law, &samples, causes)?, self.fitted(law, &samples, &[])?])
            }));
            all.push(covered(format!("{}, strengths alone", law.label()), &|errors, causes| {
                let samples = self.field(law, errors);
                let design = Design::of(law, &self.fibres, &samples, Compare::Vectors).ok()?;
                let found = |design: &Design| {
                    let found = activations(design, None, Noise::Estimated);
                    let pull = found.muscles.iter().zip(STRENGTHS).filter(|(m, _)| m.standing == Standing::Active);
                    [Vec::new(), pull.map(|(m, truth)| m.low_n <= truth && truth <= m.high_n).collect()]
                };
                Some([found(&design.clone().with_causes(causes)), found(&design)])
            }));
        }
        all
    }

    fn field(&self, law: &MuscleLaw, errors: &[Sample]) -> Vec<Sample> {
        let with = |(error, exact): (&Sample, &Sample)| {
            let position = exact.position;
            let pull: Vector3<f64> = self.fibres.iter().zip(STRENGTHS).map(|(f, s)| law.force(f, &position) * s).sum();
            Sample { position, force: pull + error.force, ..*error }
        };
        errors.iter().zip(&self.samples.samples).map(with).collect()
    }

    fn fitted(&self, law: &MuscleLaw, samples: &[Sample], causes: &[Cause]) -> Option<[Vec<bool>; 2]> {
        let options = LawFitOptions { variants: false, starts: 1, ..LawFitOptions::default() };
        let fit: LawFit = fit_law_with(law, &self.fibres, samples, causes, &options).ok()?;
        let shape = fit.parameters.iter().zip(law.parameters()).filter(|(_, truth)| truth.smooth);
        let shape = shape.map(|(e, truth)| e.low <= truth.value && truth.value <= e.high).collect();
        let strengths = fit.strengths.iter().zip(STRENGTHS).map(|(s, truth)| s.low <= truth && truth <= s.high);
        Some([shape, strengths.collect()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::LawKind;

    /// 150 draws of six to nine intervals each that share their errors: 95 % ± 4 %. Errors of a direct field change their sign from vertex to vertex,
    /// so that strengths, which are sums over many, are better known than independent errors would let them.
    #[test]
    fn intervals_hold_where_forces_are_measured_by_marks() {
        let scene = MarkedForehead::new(&crate::face::generic(), FieldWay::Direct, 0.1).unwrap();
        let laws = [LawKind::WatersLinear, LawKind::Anatomical].map(MuscleLaw::default_of);
        let found = scene.coverage(&laws, 150);
        assert_eq!(found.len(), 4);
        for c in &found {
            assert!(c.failed == 0 && (0.91..=0.99).contains(&c.strengths[0]), "{c:?}");
        }
        assert!((0.91..=0.99).contains(&found[0].shape.unwrap()[0]) && found[0].strengths[1] > 0.99, "{found:?}");
    }
}
