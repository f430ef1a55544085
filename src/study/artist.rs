//! Displacements that an artist modelled on another head, carried to the generic face, and the forces that they mean.
//!
//! Fields that none of the muscle laws made: what they are compared on.

use nalgebra::{Point3, Vector3};

use crate::customize::transfer::{self, TransferError};
use crate::face::FaceModel;
use crate::face::closest::Surface;
use crate::face::import::Imported;
use crate::face::import::target::Target;
use crate::fit::Sample;
use crate::forces::{self, SpringRule, Springs};
use crate::skin::StressStrainCurve;

/// A place of the other head farther away is not the same skin, mm.
const FAR_MM: f64 = 6.0;
/// Nor is one that looks elsewhere: least cosine between the normals.
const SAME_SIDE: f64 = 0.5;
/// Thickness of the skin, mm, as the chain has it.
const THICKNESS_MM: f64 = 1.5;
/// Skin stretched by more has no force that could be believed: the table is steep there (33 kPa at 30 %, 136 at 40 %), and what an artist
/// lengthens so far, lids and lips, unfolds and does not stretch.
const MOST_STRAIN: f64 = 0.3;
/// Digits of a target file: displacements are whole thousandths of its unit, and a uniform error of one step has 1/√12 of it as its
/// standard deviation.
const STEP: f64 = 1e-3;

/// The generic face laid on another head, ready to take its displacements.
#[derive(Clone, Debug)]
pub struct Wearer {
    /// Every vertex of the generic face on the other head, mm, the origin between the inner corners of its eyes.
    pub first: Vec<Point3<f64>>,
    /// Root mean square distance from the other surface, mm.
    pub rms_mm: f64,
    /// For every vertex the three vertices of the other head's file between which it lies, and their weights; absent where the other
    /// head does not reach it.
    place: Vec<Option<([u32; 3], [f64; 3])>>,
    mm_per_unit: f64,
}

/// An artist's displacements on the generic face.
#[derive(Clone, Debug)]
pub struct ArtistField {
    /// Every vertex at rest, mm.
    pub first: Vec<Point3<f64>>,
    /// Every vertex displaced, mm.
    pub last: Vec<Point3<f64>>,
    /// How far each vertex goes, mm; zero where it is not known.
    pub displacement: Vec<Vector3<f64>>,
    /// Force on each vertex, N; zero where it is not known.
    pub forces: Vec<Vector3<f64>>,
    /// Its standard error by the digits of the file alone, N.
    pub sigma: Vec<f64>,
    /// Outward unit normals at rest.
    pub normals: Vec<Vector3<f64>>,
    /// Whether the force is believed: the vertex and all its neighbours are known, it is not on the border of the mesh (the lids and lips
    /// are borders, too), and no spring at it is stretched by more than 30 %. (Pressed together, skin wrinkles at a stress that no longer
    /// changes.)
    pub believed: Vec<bool>,
}

/// Lays the generic face on another head.
///
/// The fit is by shape (as landmarks are transferred): both surfaces are faces at rest, so nose, brow ridge, lips and chin come to lie on each
/// other. Positions stay those of the other head: it is a person, and the generic face is customised to it.
///
/// # Errors
/// As [`transfer::propose`].
pub fn wear(generic: &FaceModel, head: &Imported) -> Result<Wearer, TransferError> {
    let surface = Surface::new(&head.mesh);
    let (laid, rms_mm) = transfer::lay(generic, &surface, &[])?;
    let normals = generic.mesh().vertex_normals(&laid);
    let place = laid
        .iter()
        .zip(&normals)
        .map(|(x, n)| {
            let c = surface.closest(x);
            let same = !c.on_border && c.distance < FAR_MM && surface.normal(c.triangle).dot(n) > SAME_SIDE;
            let corners = head.mesh.triangles()[c.triangle as usize].map(|v| head.vertex_in_file[v as usize]);
            same.then_some((corners, c.weights))
        })
        .collect();
    let eyes: Vec<Point3<f64>> = ["eye_inner_left", "eye_inner_right"]
        .iter()
        .filter_map(|id| generic.landmark(id).map(|l| laid[l.vertex as usize]))
        .collect();
    let origin = match eyes.as_slice() {
        [a, b] => nalgebra::center(a, b).coords,
        _ => Vector3::zeros(),
    };
    let first = laid.iter().map(|x| x - origin).collect();
    Ok(Wearer { first, rms_mm, place, mm_per_unit: head.mm_per_unit })
}

/// Carries a target to the generic face: every vertex goes as the place of the other head goes on which it lies. Then F = −K X with the
/// skin of the chain.
pub fn artist_field(generic: &FaceModel, wearer: &Wearer, target: &Target) -> ArtistField {
    let by = |v: u32| target.moves.binary_search_by_key(&v, |m| m.0).map_or(Vector3::zeros(), |i| target.moves[i].1);
    let displacement: Vec<Vector3<f64>> = wearer
        .place
        .iter()
        .map(|place| {
            place.map_or(Vector3::zeros(), |(corners, weights)| {
                corners.iter().zip(weights).map(|(v, w)| by(*v) * w).sum::<Vector3<f64>>() * wearer.mm_per_unit
            })
        })
        .collect();
    let first = wearer.first.clone();
    let last: Vec<Point3<f64>> = first.iter().zip(&displacement).map(|(x, d)| x + d).collect();
    let known: Vec<bool> = wearer.place.iter().map(Option::is_some).collect();

    let mesh = generic.mesh();
    let curve = StressStrainCurve::default();
    let springs = Springs::new(mesh, &first, SpringRule::default(), THICKNESS_MM);
    let mut force = Vec::new();
    forces::muscle_forces(&springs, &curve, &last, Some(&known), &mut force);
    let strains = forces::strains(&springs, &last);
    let unfolds = |v: usize| springs.springs_of_vertex(v).iter().any(|&e| strains[e as usize] > MOST_STRAIN);
    let border = mesh.on_border();
    let believed = (0..mesh.len())
        .map(|v| known[v] && !border[v] && !unfolds(v) && mesh.neighbours(v).iter().all(|&n| known[n as usize]))
        .collect();
    let sigma = by_digits(&springs, &curve, &last, STEP * wearer.mm_per_unit / 12.0_f64.sqrt());
    ArtistField { displacement, forces: force, sigma, normals: mesh.vertex_normals(&first), believed, first, last }
}

/// Standard error of every force when every vertex is placed with the error `sigma_mm` along each axis, N: √tr Cov.
fn by_digits(springs: &Springs, curve: &StressStrainCurve, positions: &[Point3<f64>], sigma_mm: f64) -> Vec<f64> {
    let slopes = forces::ForceSlopes::of_springs(springs, curve, positions, None);
    (0..slopes.len())
        .map(|v| {
            let own: nalgebra::Matrix3<f64> = slopes.at(v).map(|(_, b)| b).sum();
            let others: f64 = slopes.at(v).map(|(_, b)| b.norm_squared()).sum();
            sigma_mm * (own.norm_squared() + others).sqrt()
        })
        .collect()
}

impl ArtistField {
    /// The forces that are believed, as samples, and their vertices. Every sample has the same standard error, the root mean square of those by
    /// the digits: what a law misses here is larger by far, and no place is to count more because it is stiffer.
    pub fn samples(&self) -> (Vec<u32>, Vec<Sample>) {
        let chosen: Vec<usize> = (0..self.forces.len()).filter(|&v| self.believed[v]).collect();
        let square = chosen.iter().map(|&v| self.sigma[v] * self.sigma[v]).sum::<f64>();
        let sigma = (square / chosen.len().max(1) as f64).sqrt();
        let sample =
            |&v: &usize| Sample { position: self.first[v], force: self.forces[v], sigma, normal: self.normals[v] };
        (chosen.iter().map(|&v| v as u32).collect(), chosen.iter().map(sample).collect())
    }

    /// The displacements at the same vertices as samples, mm instead of N: what the laws of Waters and Koch were made for.
    pub fn displacement_samples(&self) -> Vec<Sample> {
        let chosen = (0..self.forces.len()).filter(|&v| self.believed[v]);
        chosen
            .map(|v| Sample {
                position: self.first[v],
                force: self.displacement[v],
                sigma: 1.0,
                normal: self.normals[v],
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::import::{self, ImportOptions, target};

    /// The generic face as another's head, in decimetres: what is displaced there by hand is displaced alike on the face, and the force is that
    /// of the chain's own springs.
    #[test]
    fn a_displacement_of_the_same_mesh_comes_over_as_it_is() {
        let face = crate::face::generic();
        let decimetres: Vec<_> = face.mesh().positions().iter().map(|p| p * 0.01).collect();
        let text = import::write_obj(face.mesh(), &decimetres);
        let options = ImportOptions { mm_per_unit: Some(100.0), ..ImportOptions::default() };
        let head = import::read(text.as_bytes(), "head.obj", &options).unwrap();
        let wearer = wear(&face, &head).unwrap();
        assert!(wearer.rms_mm < 0.2, "{}", wearer.rms_mm);
        // The left half of the forehead goes up by 3 mm.
        let up: Vec<u32> =
            face.region("forehead").iter().copied().filter(|&v| face.mesh().positions()[v as usize].x > 0.0).collect();
        let lines = up.iter().map(|v| format!("{v} 0 .03 0")).collect::<Vec<_>>().join("\n");
        let target = target::read_target(&lines, head.vertices_in_file).unwrap();
        let field = artist_field(&face, &wearer, &target);
        let moved = |v: usize| face.mesh().neighbours(v).iter().all(|n| up.contains(n)) && up.contains(&(v as u32));
        let inner: Vec<usize> = (0..612).filter(|&v| moved(v)).collect();
        assert!(inner.len() > 10);
        for &v in &inner {
            assert!(
                (field.displacement[v] - Vector3::new(0.0, 3.0, 0.0)).norm() < 0.15,
                "{v}: {}",
                field.displacement[v]
            );
        }
        // Where all neighbours go alike nothing is stretched.
        let (vertices, samples) = field.samples();
        let largest = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
        let quiet = inner.iter().filter(|&&v| field.forces[v].norm() < 0.1 * largest).count();
        assert!(largest > 0.02 && quiet > inner.len() / 2, "{largest} {quiet}");
        assert!(samples.iter().all(|s| s.sigma > 0.0 && s.sigma < 0.05) && vertices.len() == samples.len());
        assert!(field.believed.iter().zip(face.mesh().on_border()).all(|(believed, border)| !(*believed && border)));
        assert_eq!(field.displacement_samples().len(), samples.len());
    }
}
