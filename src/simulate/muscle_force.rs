//! The force of one muscle on the vertices of its region, turned into the surface of the skin.

use nalgebra::{Point3, Vector3};

use super::muscle_force_2d::{Cylinder, Exception, Unrolled};
use super::region::{self, Cutoff, Start};
use crate::face::Mesh;
use crate::muscle::{Fibre, MuscleLaw};

/// How a force that points into the face, or out of it, is made to lie in the skin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum InSurface {
    /// f − (f·n) n with the vertex's normal n: what skin that slides over a skull feels of f, which is less than f.
    #[default]
    Tangent,
    /// The same, lengthened to ‖f‖: the muscle bends round the skull and loses nothing. Where f points along the normal there is no
    /// direction to lengthen; that is named and the load is 0.
    TangentLengthKept,
    /// Erkoç's construction: the law in the unrolled face, lifted back by the plane of a facet. Thesis (4.18)–(4.23), in the file
    /// `muscle_force_2d.rs`.
    Unrolled(Cylinder),
}

/// Skin at rest: a mesh, where its vertices are (mm) and their outward unit normals.
#[derive(Clone, Copy, Debug)]
pub struct Skin<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// One a vertex.
    pub positions: &'a [Point3<f64>],
    /// One a vertex.
    pub normals: &'a [Vector3<f64>],
}

/// The force of one muscle.
#[derive(Clone, Debug, PartialEq)]
pub struct MuscleForce {
    /// The load (N) of each vertex of its region, in ascending order of vertices.
    pub loads: Vec<(u32, Vector3<f64>)>,
    /// Where the walk over the region began.
    pub start: Start,
    /// How often the law was evaluated.
    pub evaluated: usize,
    /// Vertices where the surface left no direction or Erkoç's construction has none, and why.
    pub exceptions: Vec<(u32, Exception)>,
}

/// A tangent part of less than this share of a force has no direction of its own.
const ALONG_NORMAL: f64 = 1e-6;

/// The loads of one muscle with a strength (N) for each lobe of its law, walked from `insertion`, and from `attachment` where a
/// second lobe acts, over what lies above the cutoff. Thesis (4.12), the tᵢₙ of one muscle n.
///
/// The region is where the muscle pulls, before its force is turned into the surface.
pub fn muscle_force(
    skin: Skin<'_>,
    law: &MuscleLaw,
    fibre: &Fibre,
    [attachment, insertion]: [u32; 2],
    strengths: &[f64],
    in_surface: InSurface,
    cutoff: Cutoff,
) -> MuscleForce {
    let lobes = || strengths.iter().copied().enumerate().take(law.lobes());
    let peak = lobes().map(|(_, s)| s.abs()).fold(0.0, f64::max);
    let seeds =
        if lobes().any(|(lobe, s)| lobe > 0 && s != 0.0) { vec![insertion, attachment] } else { vec![insertion] };
    let at = |v: u32| skin.positions[v as usize];
    let pull = |v: u32| lobes().map(|(lobe, s)| law.lobe_force(lobe, fibre, &at(v)) * s).sum::<Vector3<f64>>();
    let cutoff = cutoff.newton(peak);

    let mut exceptions = Vec::new();
    let unrolled = match in_surface {
        InSurface::Unrolled(cylinder) => match Unrolled::of(cylinder, fibre) {
            Ok(flat) => Some(flat),
            Err(exception) => {
                exceptions.push((insertion, exception));
                None
            }
        },
        InSurface::Tangent | InSurface::TangentLengthKept => None,
    };
    if let Some(flat) = unrolled {
        // The law acts in the plane, and its region is walked there.
        let region = region::walk(skin.mesh, &seeds, cutoff, |v| flat.force(law, strengths, &at(v)));
        let lift = |(v, f): (u32, Vector3<f64>)| match flat.lift(skin, v, f.xy()) {
            Ok(load) => (v, load),
            Err(exception) => {
                exceptions.push((v, exception));
                (v, lengthened(pull(v), &skin.normals[v as usize]).unwrap_or_else(Vector3::zeros))
            }
        };
        let loads = region.loads.into_iter().map(lift).collect();
        return MuscleForce { loads, start: region.start, evaluated: region.evaluated, exceptions };
    }

    let region = region::walk(skin.mesh, &seeds, cutoff, pull);
    let turn = |(v, f): (u32, Vector3<f64>)| {
        let normal = &skin.normals[v as usize];
        if in_surface == InSurface::Tangent {
            return (v, tangent(f, normal));
        }
        let load = lengthened(f, normal).unwrap_or_else(|| {
            exceptions.push((v, Exception::AlongNormal));
            Vector3::zeros()
        });
        (v, load)
    };
    let loads = region.loads.into_iter().map(turn).collect();
    MuscleForce { loads, start: region.start, evaluated: region.evaluated, exceptions }
}

/// f − (f·n) n for a unit normal n.
pub fn tangent(f: Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    f - normal * f.dot(normal)
}

/// The tangent part of f with the length of f; none where f points along the normal.
fn lengthened(f: Vector3<f64>, normal: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (part, length) = (tangent(f, normal), f.norm());
    let short = part.norm();
    (short > ALONG_NORMAL * length).then(|| part * (length / short))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::muscle::{Anatomical, LawKind, Lobe};

    fn generic(visit: impl FnOnce(Skin<'_>, &[face::Muscle])) {
        let face = face::generic();
        let positions = face.mesh().positions();
        let normals = face.mesh().vertex_normals(positions);
        visit(Skin { mesh: face.mesh(), positions, normals: &normals }, face.muscles());
    }

    fn of(skin: Skin<'_>, muscle: &face::Muscle, law: &MuscleLaw, in_surface: InSurface) -> MuscleForce {
        let fibre = Fibre::of(muscle, skin.positions, skin.normals).unwrap();
        let ends = [muscle.attachment, muscle.insertion];
        muscle_force(skin, law, &fibre, ends, &[2.0], in_surface, Cutoff::default())
    }

    #[test]
    fn a_slope_of_30_degrees_by_hand() {
        // n leans 30° towards +y; the tangent part of a unit force up is cos 30° long and rises by cos² 30° = 3/4.
        let n = Vector3::new(0.0, 0.5, 0.75_f64.sqrt());
        let t = tangent(Vector3::y(), &n);
        assert!((t - Vector3::new(0.0, 0.75, -0.5 * 0.75_f64.sqrt())).norm() < 1e-15);
        assert!((lengthened(Vector3::y() * 3.0, &n).unwrap() - t.normalize() * 3.0).norm() < 1e-15);
        assert_eq!(lengthened(n * 2.0, &n), None);
        assert_eq!(lengthened(Vector3::zeros(), &n), None);
    }

    #[test]
    fn every_law_and_muscle_pulls_in_the_skin_and_on_few_vertices() {
        generic(|skin, muscles| {
            let mean =
                muscles.iter().map(|m| of(skin, m, &MuscleLaw::default_of(LawKind::Anatomical), InSurface::Tangent));
            let touched: Vec<_> = mean.map(|f| f.evaluated).collect();
            assert!(touched.iter().sum::<usize>() < 18 * 612 / 4, "{touched:?}");
            for kind in LawKind::ALL {
                let law = MuscleLaw::default_of(kind);
                for muscle in muscles {
                    let plain = of(skin, muscle, &law, InSurface::Tangent);
                    let kept = of(skin, muscle, &law, InSurface::TangentLengthKept);
                    assert!(plain.start == Start::Seed && !plain.loads.is_empty(), "{kind:?} {}", muscle.id);
                    let fibre = Fibre::of(muscle, skin.positions, skin.normals).unwrap();
                    for ((v, a), (w, b)) in plain.loads.iter().zip(&kept.loads) {
                        let full = law.force(&fibre, &skin.positions[*v as usize]) * 2.0;
                        let n = skin.normals[*v as usize];
                        assert!(v == w && a.dot(&n).abs() < 1e-12 && b.dot(&n).abs() < 1e-12);
                        assert!(a.norm() <= full.norm() + 1e-12 && (b.norm() - full.norm()).abs() < 1e-12);
                        // What is taken away is the component along the normal alone.
                        assert!((full - a - n * full.dot(&n)).norm() < 1e-12);
                    }
                }
            }
        });
    }

    #[test]
    fn a_second_lobe_is_walked_from_the_attachment() {
        generic(|skin, muscles| {
            let law = Anatomical { lobe: Some(Lobe::AtAttachment), wr: 0.2, ..Anatomical::default() };
            let law = MuscleLaw::Anatomical(law);
            let fibre = Fibre::of(&muscles[0], skin.positions, skin.normals).unwrap();
            let ends = [muscles[0].attachment, muscles[0].insertion];
            let with = |strengths: &[f64]| {
                muscle_force(skin, &law, &fibre, ends, strengths, InSurface::Tangent, Cutoff::Newton(0.3))
            };
            let (one, two) = (with(&[2.0]), with(&[2.0, -1.0]));
            assert!(two.loads.len() > one.loads.len());
            let up =
                |f: &MuscleForce| f.loads.iter().map(|(_, f)| f.y).fold([0.0_f64; 2], |[a, b], y| [a.min(y), b.max(y)]);
            assert!(up(&one)[0] >= 0.0 && up(&two)[0] < -0.5 && up(&two)[1] > 1.0);
        });
    }
}
