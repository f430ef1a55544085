//! How near the generic face comes to another face when it is customised by that face's landmarks as one camera sees them.

use std::time::Instant;

use nalgebra::{Matrix6, Point2, Point3, Rotation3, Vector3, Vector6};

use crate::camera::Camera;
use crate::customize::{self, CustomizeError, CustomizeSettings, Customized, LandmarkTarget};
use crate::face::FaceModel;
use crate::face::closest::Surface;

/// The region of the generic face that is also measured alone.
const FOREHEAD: &str = "forehead";
/// Times that a customisation is repeated for its median time.
const REPEATS: usize = 31;
/// Steps of the rigid fit at most.
const MOST_STEPS: usize = 60;
/// Pixels per millimetre of the measuring camera; nothing depends on it.
const PX_PER_MM: f64 = 4.0;

/// Distances of the vertices of one surface from another, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Root mean square over the vertices that the target covers.
    pub rms_mm: f64,
    /// The same over those of the forehead.
    pub forehead_rms_mm: f64,
    /// The largest.
    pub max_mm: f64,
    /// Number of vertices that the target covers.
    pub covered: usize,
    /// Number of those on the forehead.
    pub forehead_covered: usize,
}

/// A fit measured in two ways: as it stands but for its distance from the camera, which one picture does not tell; and
/// after the rigid motion that brings it closest, which leaves the difference of shapes alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Shifted along the camera's axis.
    pub shifted: Distances,
    /// How far it was shifted, mm.
    pub shift_mm: f64,
    /// Moved rigidly.
    pub rigid: Distances,
    /// By this turn, rad: how wrongly the head's pose was seen.
    pub turn_rad: f64,
    /// Distance of every vertex after the shift, mm; absent where the target does not cover it.
    pub of_vertex: Vec<Option<f64>>,
}

/// The fit of the generic face to one target.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceFit {
    /// Number of landmarks that both faces have.
    pub landmarks: usize,
    /// After alignment, before the morph.
    pub before: Measured,
    /// After the morph.
    pub after: Measured,
    /// The customised face.
    pub customized: Customized,
    /// Median time of a customisation, ms.
    pub time_ms: f64,
}

/// Customises `generic` by the landmarks of `target`, projected by a camera at `distance_mm`, and measures what comes out.
///
/// Landmarks are matched by name. The depth of the target is used for measuring alone.
///
/// # Errors
/// As [`customize::customize`].
pub fn fit(
    generic: &FaceModel,
    target: &FaceModel,
    distance_mm: f64,
    settings: &CustomizeSettings,
) -> Result<FaceFit, CustomizeError> {
    let camera =
        Camera { principal_point_px: Point2::origin(), z_prp_mm: distance_mm, z_vp_mm: 0.0, px_per_mm: PX_PER_MM };
    let targets: Vec<LandmarkTarget> = generic
        .landmarks()
        .iter()
        .filter_map(|l| {
            let there = target.landmark(&l.id)?;
            let at_in_image = camera.image_from_face(&target.mesh().positions()[there.vertex as usize]);
            Some(LandmarkTarget { vertex: l.vertex, at_in_image })
        })
        .collect();
    let run = || customize::customize(generic.mesh(), &targets, &camera, settings);
    let customized = run()?;
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(run()).ok();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    let surface = Surface::new(target.mesh());
    let mut forehead = vec![false; generic.mesh().len()];
    for &v in generic.region(FOREHEAD) {
        forehead[v as usize] = true;
    }
    Ok(FaceFit {
        landmarks: targets.len(),
        before: measure(&customized.aligned, &surface, &forehead),
        after: measure(&customized.positions, &surface, &forehead),
        customized,
        time_ms: times[REPEATS / 2],
    })
}

fn measure(positions: &[Point3<f64>], surface: &Surface, forehead: &[bool]) -> Measured {
    let shift_mm = depth_shift(positions, surface);
    let shifted: Vec<Point3<f64>> = positions.iter().map(|p| p + Vector3::z() * shift_mm).collect();
    let of_vertex = distances(&shifted, surface);
    let (rigid, turn_rad) = rigidly_closest(&shifted, surface);
    Measured {
        shifted: summary(&of_vertex, forehead),
        shift_mm,
        rigid: summary(&distances(&rigid, surface), forehead),
        turn_rad,
        of_vertex,
    }
}

/// Distances of the vertices that the surface covers: those whose nearest place is not on its border.
fn distances(positions: &[Point3<f64>], surface: &Surface) -> Vec<Option<f64>> {
    positions.iter().map(|p| Some(surface.closest(p)).filter(|c| !c.on_border).map(|c| c.distance)).collect()
}

fn summary(distances: &[Option<f64>], forehead: &[bool]) -> Distances {
    let rms = |values: &[f64]| (values.iter().map(|d| d * d).sum::<f64>() / values.len().max(1) as f64).sqrt();
    let all: Vec<f64> = distances.iter().flatten().copied().collect();
    let above: Vec<f64> = distances.iter().zip(forehead).filter(|(_, f)| **f).filter_map(|(d, _)| *d).collect();
    Distances {
        rms_mm: rms(&all),
        forehead_rms_mm: rms(&above),
        max_mm: all.iter().copied().fold(0.0, f64::max),
        covered: all.len(),
        forehead_covered: above.len(),
    }
}

/// The shift along z that brings the vertices closest to the surface, mm: mean of what is lacking, until it lacks no more.
fn depth_shift(positions: &[Point3<f64>], surface: &Surface) -> f64 {
    let mut shift = 0.0;
    for _ in 0..MOST_STEPS {
        let found: Vec<f64> = positions
            .iter()
            .map(|p| p + Vector3::z() * shift)
            .map(|p| (p, surface.closest(&p)))
            .filter(|(_, c)| !c.on_border)
            .map(|(p, c)| c.point.z - p.z)
            .collect();
        let step = found.iter().sum::<f64>() / found.len().max(1) as f64;
        shift += step;
        if step.abs() < 1e-3 {
            break;
        }
    }
    shift
}

/// Moves the points rigidly onto the surface (point to plane); gives them and the turn, rad. A slight pull keeps them from sliding
/// where the surface does not tell.
fn rigidly_closest(positions: &[Point3<f64>], surface: &Surface) -> (Vec<Point3<f64>>, f64) {
    let mut moved = positions.to_vec();
    let mut turn = Rotation3::identity();
    for _ in 0..MOST_STEPS {
        let (mut curvature, mut gradient) = (Matrix6::identity() * 1e-3, Vector6::zeros());
        for p in &moved {
            let c = surface.closest(p);
            let [a, b, d] =
                surface.mesh().triangles()[c.triangle as usize].map(|i| surface.mesh().positions()[i as usize]);
            let Some(n) = (b - a).cross(&(d - a)).try_normalize(1e-12).filter(|_| !c.on_border) else { continue };
            let arm = p.coords.cross(&n);
            let row = Vector6::new(arm.x, arm.y, arm.z, n.x, n.y, n.z);
            curvature += row * row.transpose();
            gradient += row * (c.point - p).dot(&n);
        }
        let Some(step) = curvature.cholesky().map(|c| c.solve(&gradient)) else { break };
        let further = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
        turn = further * turn;
        for p in &mut moved {
            *p = further * *p + step.fixed_rows::<3>(3);
        }
        if step.amax() < 1e-5 {
            break;
        }
    }
    (moved, turn.angle())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    /// The generic face, nodding by 5° and 10 mm farther away, is found but for what the prior of the pose keeps; without a pose it is not.
    #[test]
    fn a_nod_is_found_by_the_pose_and_missed_by_the_thesis() {
        let generic = face::generic();
        let nod = Rotation3::new(Vector3::new(5_f64.to_radians(), 0.0, 0.0));
        let moved = generic.mesh().positions().iter().map(|p| nod * p - Vector3::z() * 10.0).collect();
        let target = FaceModel::new(generic.mesh().with_positions(moved).unwrap(), generic.to_parts()).unwrap();
        let best = fit(&generic, &target, 1000.0, &CustomizeSettings::default()).unwrap();
        let level = CustomizeSettings { z_factor: 1.0, ..CustomizeSettings::thesis() };
        let thesis = fit(&generic, &target, 1000.0, &level).unwrap();
        assert_eq!(best.landmarks, 32);
        assert!(best.after.shifted.rms_mm < 1.5 && best.after.rigid.rms_mm < 0.6, "{:?}", best.after.shifted);
        assert!(
            thesis.after.shifted.forehead_rms_mm > 2.0 * best.after.shifted.forehead_rms_mm,
            "{:?}",
            thesis.after.shifted
        );
        assert!((thesis.after.turn_rad.to_degrees() - 5.0).abs() < 1.0, "{}", thesis.after.turn_rad.to_degrees());
        assert!((best.after.shift_mm + 10.0).abs() < 2.0, "{}", best.after.shift_mm);
    }

    #[test]
    fn a_face_fitted_to_itself_is_itself() {
        let generic = face::generic();
        let fit = fit(&generic, &generic, 1000.0, &CustomizeSettings::default()).unwrap();
        assert!(fit.after.shifted.rms_mm < 1e-6 && fit.after.turn_rad < 1e-6, "{:?}", fit.after.shifted);
        assert!(fit.after.shifted.covered > 480, "{}", fit.after.shifted.covered);
    }
}
