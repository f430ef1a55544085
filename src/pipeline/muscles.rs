//! The muscle-based way to the forces: those of the muscles that explain the measured ones best.

use nalgebra::{DMatrix, Point3, Vector3};

use super::{Outcome, Samples};
use crate::face::FaceModel;
use crate::fit::activations::{Activation, Standing, activations};
use crate::fit::design::Design;
use crate::fit::selection::{SelectionSettings, smallest_set};
use crate::fit::{Compare, Noise};
use crate::forces::{self, Errors, ForceSlopes};
use crate::muscle::{Fibre, FibreOf, LawKind, MuscleLaw, fibres};
use crate::pipeline::samples::Include;

/// The muscles that stand for the measured forces.
#[derive(Clone, Debug, PartialEq)]
pub struct MuscleForces {
    /// How each pulls.
    pub law: LawKind,
    /// Those that pull.
    pub pulling: Vec<Pulling>,
    /// Muscles among which they were chosen.
    pub among: usize,
    /// Share of the measured forces' part in the skin (its squares) that they explain.
    pub explained: f64,
    /// The measured force on every vertex, N, which fits and profiles of muscles go on being made from.
    pub measured: Vec<Vector3<f64>>,
    /// Its standard error, N.
    pub measured_sigma: Vec<f64>,
}

/// A muscle that pulls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulling {
    /// Index in [`FaceModel::muscles`].
    pub muscle: usize,
    /// Its strength.
    pub strength: Activation,
    /// Root mean square of the force that it puts on the believed vertices, N: a muscle beside the marked skin may be strong and do little.
    pub felt_n: f64,
}

/// A muscle is looked for where the believed vertices feel at least this share of its peak on the face. One that they hardly feel would need
/// thousands of newtons to explain a little noise, and would put them on the skin around.
const FELT: f64 = 0.2;

/// Puts the forces of muscles in the place of the measured ones: within the skin of the first frame Σ s_m f_m with the strengths s ≥ 0
/// that explain the believed forces best, of all muscles that are felt there ([`FELT`]) or of the smallest set of at most `most`; across it, where the skull bears what
/// no muscle does, what was measured.
///
/// Standard errors are those of the positions, carried through the forces and the least squares of
/// the muscles that pull, and times the root of the misfit where that is above 1 (Birge 1932): what the law does not explain counts as
/// error of the strengths. Nothing is changed where no muscle reaches a believed force.
pub(super) fn explain(
    face: &FaceModel,
    outcome: &mut Outcome,
    law: LawKind,
    most: Option<u8>,
    slopes: ForceSlopes<'_>,
    errors: &dyn Errors,
) {
    let samples = Samples::of(outcome, face, Include::Believed);
    let shape = MuscleLaw::default_of(law);
    let mut all = fibres(face, &outcome.first).0;
    let among = all.len();
    all.retain(|of| {
        let most = |points: &mut dyn Iterator<Item = &Point3<f64>>| {
            points.map(|x| shape.force(&of.fibre, x).norm()).fold(0.0, f64::max)
        };
        most(&mut samples.samples.iter().map(|s| &s.position)) >= FELT * most(&mut outcome.first.iter())
    });
    let lines: Vec<Fibre> = all.iter().map(|of| of.fibre.clone()).collect();
    let Ok(design) = Design::of(&shape, &lines, &samples.samples, Compare::Tangential) else { return };
    let found = match most {
        None => activations(&design, None, Noise::Estimated),
        Some(most) => {
            let positions: Vec<Point3<f64>> = samples.samples.iter().map(|s| s.position).collect();
            let settings = SelectionSettings { most: most.into(), ..SelectionSettings::default() };
            smallest_set(&design, &positions, &settings).activations
        }
    };
    let active: Vec<(&FibreOf, Activation)> =
        all.iter().zip(&found.muscles).filter(|(_, m)| m.standing == Standing::Active).map(|(f, m)| (f, *m)).collect();
    if active.is_empty() {
        return;
    }
    let normals = face.mesh().vertex_normals(&outcome.first);
    let known: Vec<bool> = outcome.states.iter().map(|s| s.is_known()).collect();
    // What each muscle does to every known vertex within the skin, a newton of strength.
    let columns: Vec<Vec<Vector3<f64>>> = active
        .iter()
        .map(|(of, _)| {
            let at = |(v, x): (usize, &Point3<f64>)| {
                let f = if known[v] { shape.force(&of.fibre, x) } else { Vector3::zeros() };
                f - normals[v] * normals[v].dot(&f)
            };
            outcome.first.iter().enumerate().map(at).collect()
        })
        .collect();
    let field = &mut outcome.field;
    let strengths: Vec<f64> = active.iter().map(|(_, m)| m.strength_n).collect();
    let force: Vec<Vector3<f64>> = (0..field.force.len())
        .map(|v| {
            let within: Vector3<f64> = columns.iter().zip(&strengths).map(|(c, s)| c[v] * *s).sum();
            within + normals[v] * normals[v].dot(&field.force[v])
        })
        .collect();
    let weigh = samples.samples.iter().all(|s| s.sigma > 0.0 && s.sigma.is_finite());
    let weights: Vec<(usize, f64)> = samples
        .vertices
        .iter()
        .zip(&samples.samples)
        .map(|(v, s)| (*v as usize, if weigh { s.sigma.powi(-2) } else { 1.0 }))
        .collect();
    let misfit = if weigh { found.misfit.max(1.0) } else { 1.0 };
    let covariance = carried(&columns, &weights, &slopes, errors);
    let across = errors.of_forces(&slopes.along(&normals));
    let sigma = covariance.map(|covariance| {
        let of = |v: usize| {
            let mut within = 0.0;
            for (a, left) in columns.iter().enumerate() {
                for (b, right) in columns.iter().enumerate() {
                    within += covariance[(a, b)] * left[v].dot(&right[v]);
                }
            }
            let across = if known[v] { across[v] } else { 0.0 };
            (misfit * within.max(0.0) + across * across).sqrt()
        };
        (0..normals.len()).map(of).collect()
    });
    let felt = |column: &[Vector3<f64>]| {
        let squares: f64 = weights.iter().map(|(v, _)| column[*v].norm_squared()).sum();
        (squares / weights.len().max(1) as f64).sqrt()
    };
    let pulling = active.iter().zip(&columns).map(|((of, m), column)| Pulling {
        muscle: of.muscle,
        strength: *m,
        felt_n: m.strength_n * felt(column),
    });
    let pulling = pulling.collect();
    let (in_surface, normal) = forces::split(&force, &normals);
    field.tangential = in_surface.iter().map(Vector3::norm).collect();
    field.normal = normal;
    let measured = std::mem::replace(&mut field.force, force);
    let measured_sigma = match sigma {
        Some(sigma) => std::mem::replace(&mut field.sigma, sigma),
        None => field.sigma.clone(),
    };
    outcome.muscles = Some(MuscleForces { law, pulling, among, explained: found.r_squared, measured, measured_sigma });
}

/// Covariance of the strengths, N²; none where the columns cannot be told apart.
///
/// A change δF of the measured forces changes the strengths by δs = G⁻¹ Σ_i w_i a_i·δF_i, G = Σ_i w_i a_i·a_iᵀ over the samples, and
/// δF_i = Σ_j B_ij (δx_i − δx_j). So δs = Σ_j T_j·δx_j.
fn carried(
    columns: &[Vec<Vector3<f64>>],
    weights: &[(usize, f64)],
    slopes: &ForceSlopes<'_>,
    positions: &dyn Errors,
) -> Option<DMatrix<f64>> {
    let k = columns.len();
    let mut gram = DMatrix::<f64>::zeros(k, k);
    for &(v, w) in weights {
        for (a, left) in columns.iter().enumerate() {
            for (b, right) in columns.iter().enumerate() {
                gram[(a, b)] += w * left[v].dot(&right[v]);
            }
        }
    }
    let inverse = gram.cholesky()?.inverse();
    let mut rows = vec![vec![Vector3::zeros(); slopes.len()]; k];
    for &(i, w) in weights {
        for (m, row) in rows.iter_mut().enumerate() {
            let pull: Vector3<f64> = columns.iter().enumerate().map(|(b, c)| c[i] * (w * inverse[(m, b)])).sum();
            for (j, block) in slopes.at(i) {
                let part = block.tr_mul(&pull);
                row[i] += part;
                row[j] -= part;
            }
        }
    }
    Some(positions.covariance_of(&rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::displacement::VertexState;
    use crate::face::{self, patches::Noise as Draws};
    use crate::forces::{Influence, MarkInfluence, Skin, SkinSpec};
    use crate::pipeline::{self, ForceField, Workspace};
    use crate::project::{Project, Settings};
    use nalgebra::Matrix3x2;

    /// The generic face, all of it measured, with the forces that some muscles of the anatomical law make (index, N), and something upright.
    fn pulled(strengths: &[(usize, f64)]) -> (std::sync::Arc<FaceModel>, Outcome, Vec<Vector3<f64>>) {
        let face = face::generic();
        let mut outcome = pipeline::solve(&Project::default(), &face, [1036, 1036], &mut Workspace::default());
        let normals = face.mesh().vertex_normals(&outcome.first);
        let law = MuscleLaw::default_of(LawKind::Anatomical);
        let all = fibres(&face, &outcome.first).0;
        let force: Vec<Vector3<f64>> = (0..outcome.first.len())
            .map(|v| {
                let x = &outcome.first[v];
                let f: Vector3<f64> = strengths.iter().map(|(m, s)| law.force(&all[*m].fibre, x) * *s).sum();
                f - normals[v] * normals[v].dot(&f) + normals[v] * 0.01 * (v % 7) as f64
            })
            .collect();
        let n = force.len();
        outcome.states = vec![VertexState::Measured; n];
        outcome.border = vec![false; n];
        outcome.field = ForceField {
            force: force.clone(),
            sigma: vec![0.01; n],
            outside_table: vec![false; n],
            ..ForceField::default()
        };
        (face, outcome, force)
    }

    /// Positions without error.
    struct Exact;

    impl Errors for Exact {
        fn of_forces(&self, slopes: &ForceSlopes<'_>) -> Vec<f64> {
            vec![0.0; slopes.len()]
        }

        fn covariance_of(&self, rows: &[Vec<Vector3<f64>>]) -> DMatrix<f64> {
            DMatrix::zeros(rows.len(), rows.len())
        }
    }

    fn skin(face: &FaceModel, at: &[Point3<f64>]) -> Skin {
        let spec: SkinSpec = Settings::default().skin_spec();
        Skin::new(face.mesh(), at, &spec)
    }

    #[test]
    fn what_muscles_made_is_found_again_and_the_measured_forces_are_kept() {
        let (face, mut outcome, force) = pulled(&[(0, 0.4), (5, 0.7)]);
        let skin = skin(&face, &outcome.first);
        let first = outcome.first.clone();
        for most in [None, Some(18)] {
            outcome.field.force.clone_from(&force);
            explain(&face, &mut outcome, LawKind::Anatomical, most, skin.slopes(&first, &vec![true; 612]), &Exact);
            let found = outcome.muscles.as_ref().unwrap();
            let ids: Vec<usize> = found.pulling.iter().map(|p| p.muscle).collect();
            assert!(ids.contains(&0) && ids.contains(&5) && (found.explained - 1.0).abs() < 1e-9, "{ids:?}");
            let of = |m: usize| found.pulling.iter().find(|p| p.muscle == m).unwrap().strength.strength_n;
            assert!((of(0) - 0.4).abs() < 1e-6 && (of(5) - 0.7).abs() < 1e-6);
            let off = |(a, b): (&Vector3<f64>, &Vector3<f64>)| (a - b).norm();
            assert!(outcome.field.force.iter().zip(&force).map(off).fold(0.0, f64::max) < 1e-6);
            assert!(outcome.measured().0 == force, "what was measured is kept");
        }
        // The wrong law says less, and the field is that law's: not the measured one.
        outcome.field.force.clone_from(&force);
        explain(&face, &mut outcome, LawKind::Koch, None, skin.slopes(&first, &vec![true; 612]), &Exact);
        assert!(outcome.muscles.as_ref().unwrap().explained < 0.98);
        assert!(outcome.field.force != force);
    }

    const DRAWS: usize = 300;

    /// Positions err in ways of their own; in the mean over 300 draws the muscles' forces err by what is stated.
    #[test]
    fn standard_errors_are_what_draws_of_the_positions_give() {
        let (face, outcome, force) = pulled(&[(0, 0.4), (5, 0.7)]);
        let n = force.len();
        let first = outcome.first.clone();
        let skin = skin(&face, &first);
        let slopes = skin.slopes(&first, &vec![true; n]);
        let mut draws = Draws(7);
        // Eighty marks, each on a vertex, with the neighbours following by half.
        let marked: Vec<u32> = (0..80).map(|k| k * 7 + 20).collect();
        let mut follows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        for (mark, v) in marked.iter().enumerate() {
            follows[*v as usize].push((mark as u32, 1.0));
            for j in face.mesh().neighbours(*v as usize) {
                follows[*j as usize].push((mark as u32, 0.5));
            }
        }
        let slope = |_| Matrix3x2::from_fn(|_, _| draws.uniform());
        let influence = MarkInfluence {
            slope_mm_per_px: marked.iter().map(slope).collect(),
            sigma_px: vec![1e-3; marked.len()],
            weights: Influence::from_rows(follows.iter().cloned()),
            common: None,
        };
        let mut stated = Vec::new();
        let mut squares = vec![0.0; n];
        for _ in 0..DRAWS {
            let mut shift = vec![Vector3::zeros(); n];
            let drawn: Vec<Vector3<f64>> = influence
                .slope_mm_per_px
                .iter()
                .map(|s| s * nalgebra::Vector2::new(draws.normal(), draws.normal()) * 1e-3)
                .collect();
            for (shift, row) in shift.iter_mut().zip(&follows) {
                *shift = row.iter().map(|(m, w)| drawn[*m as usize] * *w).sum();
            }
            let mut drawn = outcome.clone();
            for (i, f) in drawn.field.force.iter_mut().enumerate() {
                *f += slopes.at(i).map(|(j, b)| b * (shift[i] - shift[j])).sum::<Vector3<f64>>();
            }
            explain(&face, &mut drawn, LawKind::Anatomical, None, slopes.clone(), &influence);
            for (s, (a, b)) in squares.iter_mut().zip(drawn.field.force.iter().zip(&force)) {
                *s += (a - b).norm_squared();
            }
            if stated.is_empty() {
                stated = drawn.field.sigma.clone();
            }
        }
        let drawn: f64 = squares.iter().sum::<f64>() / DRAWS as f64;
        let said: f64 = stated.iter().map(|s| s * s).sum();
        assert!((0.85..1.15).contains(&(drawn / said)), "{drawn} {said}");
    }

    /// Only the forehead is measured, with noise: no muscle of the mouth is made strong to explain it.
    #[test]
    fn a_muscle_that_the_measured_skin_hardly_feels_is_left_out() {
        let (face, mut outcome, _) = pulled(&[(0, 0.4)]);
        let forehead = face.region("forehead_and_brows");
        let mut draws = Draws(3);
        for v in 0..612 {
            if !forehead.contains(&(v as u32)) {
                outcome.states[v] = VertexState::Unmeasured;
            }
            outcome.field.force[v] += Vector3::new(draws.normal(), draws.normal(), draws.normal()) * 0.05;
        }
        let first = outcome.first.clone();
        let skin = skin(&face, &first);
        explain(&face, &mut outcome, LawKind::Anatomical, None, skin.slopes(&first, &vec![true; 612]), &Exact);
        let found = outcome.muscles.as_ref().unwrap();
        assert!(found.pulling.iter().all(|p| p.strength.strength_n < 1.0), "{:?}", found.pulling);
        assert!(found.pulling.iter().any(|p| p.muscle == 0) && found.among == 18);
    }

    #[test]
    fn without_a_believed_force_nothing_is_changed() {
        let (face, mut outcome, force) = pulled(&[(0, 0.4)]);
        outcome.states = vec![VertexState::Unmeasured; force.len()];
        let first = outcome.first.clone();
        let skin = skin(&face, &first);
        explain(&face, &mut outcome, LawKind::Anatomical, None, skin.slopes(&first, &vec![false; 612]), &Exact);
        assert!(outcome.muscles.is_none() && outcome.field.force == force);
    }
}
