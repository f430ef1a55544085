//! Landmarks, muscles and regions of the generic face proposed on another mesh: the generic face is laid on it, and what is bound to
//! its vertices goes to the nearest vertices there.
//!
//! It stands on this floor, not with the face, because it needs the morph.

use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use super::radial::Field;
use super::{Anchor, numbering};
use crate::face::closest::Surface;
use crate::face::{FaceError, FaceModel, FaceParts, Landmark, Mesh, Muscle, MusclePreset, Region, mirror};

/// Steps of the coarse fit at most.
const MOST_STEPS: usize = 60;
/// How far proportions and pose are held back, in vertices of the generic face that would have to agree on another.
const RELUCTANCE: f64 = 600.0;
/// Errors that each round of the fine fit allows its correspondences, mm: first the shape as a whole, then the details.
const ROUNDS_MM: [f64; 6] = [10.0, 7.0, 5.0, 3.5, 3.5, 3.5];
/// Length that stands for a difference of one between two unit normals, mm: a lip's upper side finds no lower side.
const NORMAL_MM: f64 = 15.0;
/// Correspondences farther away are not believed, mm.
const FAR_MM: f64 = 20.0;
/// Share of the generic face's depth for its width that a face has at least.
const LEAST_DEPTH: f64 = 0.35;
/// Samples of the target that are compared with every vertex.
const MOST_SAMPLES: usize = 20_000;
/// A place this far outside the target is not on it, mm.
const OUTSIDE_MM: f64 = 6.0;
/// The end of a muscle may lie so far outside the target, mm: it goes to its rim (a forehead that ends below the hair still has its
/// frontalis) ...
const MUSCLE_OUTSIDE_MM: f64 = 30.0;
/// ... as long as this share of its length is left.
const LEAST_LENGTH: f64 = 0.4;
/// A vertex farther than this from the place of a landmark does not stand for it, mm.
const NOT_THERE_MM: f64 = 12.0;
/// Distance between a place and its vertex at which the confidence has fallen to a half, mm.
const HALF_CONFIDENCE_MM: f64 = 5.0;

/// A proposal to correct by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The mesh as a face, moved so that the origin lies midway between the inner corners of the eyes.
    pub face: FaceModel,
    /// For every landmark of the generic face how it fared.
    pub landmarks: Vec<Proposed>,
    /// Muscles that have no place on the mesh.
    pub muscles_left_out: Vec<String>,
    /// Root mean square distance between the generic face laid on the mesh and the mesh, where both are, mm.
    pub rms_mm: f64,
}

/// A landmark proposed, or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposed {
    /// Its id.
    pub id: String,
    /// Its vertex; absent where the mesh does not reach it.
    pub vertex: Option<u32>,
    /// From 0 to 1: a half where its place is 5 mm from the nearest vertex, less where the mesh ends, 1 where its number is known.
    pub confidence: f64,
}

/// Why nothing can be proposed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransferError {
    /// The mesh shows no nose to begin with.
    #[error(
        "no tip of a nose is found on the midline of the mesh: turn it to the front (--up, --front) or cut the face out (--keep face)"
    )]
    NoNose,
    /// The generic face does not come near.
    #[error(
        "the generic face comes only within {rms_mm:.1} mm of the mesh: is it a face, is its unit right, does it look to the front?"
    )]
    Unlike {
        /// Root mean square distance, mm.
        rms_mm: f64,
    },
    /// The parts do not make a face.
    #[error(transparent)]
    Face(#[from] FaceError),
}

/// Lays `generic` on `target` (mm, face space, the midline at x = 0) and proposes its landmarks, muscles and regions there.
///
/// 1. Coarse: the tip of the nose, width and height give a start; then scales along the axes, nod and shift by point-to-plane steps.
/// 2. Fine: rounds of correspondences (nearest in place and normal), each followed through a smoothing [`Field`], both sides alike.
///    Landmarks whose number in the mesh is `known` (generic landmark id, vertex of the target) are held exactly.
/// 3. Every landmark goes to the nearest vertex, on the midline to one of the midline, on the right to the mirror of the left.
///
/// # Errors
/// A mesh without a nose, or on which the generic face cannot be laid.
pub fn propose(
    generic: &FaceModel,
    target: &Mesh,
    name: &str,
    known: &[(String, u32)],
) -> Result<Proposal, TransferError> {
    let surface = Surface::new(target);
    let (laid, rms_mm) = lay(generic, &surface, known)?;
    bind(generic, &surface, name, known, &laid, rms_mm)
}

/// Lays `generic` on a surface: the first two steps of [`propose`]. Gives its vertices there and their root mean square distance from the
/// surface, where both are, mm.
///
/// # Errors
/// As [`propose`].
pub fn lay(
    generic: &FaceModel,
    surface: &Surface,
    known: &[(String, u32)],
) -> Result<(Vec<Point3<f64>>, f64), TransferError> {
    let mut laid = coarse(generic, surface, known)?;
    let held: Vec<(u32, u32)> = known.iter().filter_map(|(id, v)| Some((generic.landmark(id)?.vertex, *v))).collect();
    for allowed in ROUNDS_MM {
        fine(generic, surface, &held, allowed, &mut laid);
    }
    let deep = |x: &[Point3<f64>]| {
        let (low, high) = extent(x);
        (high.z - low.z) / (high.x - low.x).max(1e-9)
    };
    if deep(&laid) < LEAST_DEPTH * deep(generic.mesh().positions()) {
        return Err(TransferError::NoNose);
    }
    let covered: Vec<f64> =
        laid.iter().map(|x| surface.closest(x)).filter(|c| !c.on_border).map(|c| c.distance).collect();
    let rms_mm = (covered.iter().map(|d| d * d).sum::<f64>() / covered.len().max(1) as f64).sqrt();
    if covered.len() < laid.len() / 4 || rms_mm > OUTSIDE_MM {
        return Err(TransferError::Unlike { rms_mm });
    }
    Ok((laid, rms_mm))
}

/// The vertex that is farthest to the front in the middle of the mesh.
fn nose_tip(mesh: &Mesh) -> Option<Point3<f64>> {
    let (low, high) = extent(mesh.positions());
    let size = high - low;
    mesh.positions()
        .iter()
        .filter(|p| p.x.abs() < 0.12 * size.x && p.y > low.y + 0.15 * size.y && p.y < high.y - 0.2 * size.y)
        .max_by(|a, b| a.z.total_cmp(&b.z))
        .copied()
}

fn extent(points: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let start = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    points.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
}

fn coarse(generic: &FaceModel, surface: &Surface, known: &[(String, u32)]) -> Result<Vec<Point3<f64>>, TransferError> {
    let tip = nose_tip(surface.mesh()).ok_or(TransferError::NoNose)?;
    let start = generic.mesh().positions();
    let own_tip = generic.landmark("nose_tip").map_or_else(Point3::origin, |l| start[l.vertex as usize]);
    let ((low, high), (own_low, own_high)) = (extent(surface.mesh().positions()), extent(start));
    let wide = (high.x - low.x) / (own_high.x - own_low.x).max(1e-9);
    let tall = (tip.y - low.y) / (own_tip.y - own_low.y).max(1e-9);
    if !(wide > 0.0 && tall > 0.0) {
        return Err(TransferError::NoNose);
    }
    let scale = Vector3::new(wide, tall, (wide * tall).sqrt());
    let mut laid: Vec<Point3<f64>> = start.iter().map(|p| tip + (p - own_tip).component_mul(&scale)).collect();
    for _ in 0..MOST_STEPS {
        let normals = generic.mesh().vertex_normals(&laid);
        let mut pairs: Vec<(Point3<f64>, Vector3<f64>, f64, f64)> = Vec::with_capacity(laid.len());
        for (x, normal) in laid.iter().zip(&normals) {
            let c = surface.closest(x);
            let n = surface.normal(c.triangle);
            if !c.on_border && n.dot(normal) > 0.5 {
                pairs.push((*x, n, (c.point - x).dot(&n), c.distance));
            }
        }
        let mut distances: Vec<f64> = pairs.iter().map(|p| p.3).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let most = 3.0 * distances.get(distances.len() / 2).copied().unwrap_or(0.0) + 1.0;
        let mut curvature =
            Matrix6::from_diagonal(&Vector6::new(RELUCTANCE, RELUCTANCE, RELUCTANCE, RELUCTANCE, 3.0, 3.0));
        let mut gradient = Vector6::zeros();
        let mut add = |x: &Point3<f64>, n: &Vector3<f64>, lack: f64, weight: f64| {
            let d = x - tip;
            let row = Vector6::new(d.x * n.x, d.y * n.y, d.z * n.z, d.y * n.z - d.z * n.y, n.y, n.z);
            curvature += row * row.transpose() * weight;
            gradient += row * lack * weight;
        };
        for (x, n, lack, _) in pairs.iter().filter(|p| p.3 < most) {
            add(x, n, *lack, 1.0);
        }
        // Known places count as much as the whole surface.
        for (id, v) in known {
            let Some(l) = generic.landmark(id) else { continue };
            let x = laid[l.vertex as usize];
            let lack = surface.mesh().positions()[*v as usize] - x;
            for axis in 0..3 {
                add(&x, &Vector3::ith(axis, 1.0), lack[axis], laid.len() as f64 / known.len() as f64);
            }
        }
        let Some(step) = curvature.cholesky().map(|c| c.solve(&gradient)) else { break };
        for x in &mut laid {
            let d = *x - tip;
            *x += Vector3::new(
                step[0] * d.x,
                step[1] * d.y - step[3] * d.z + step[4],
                step[2] * d.z + step[3] * d.y + step[5],
            );
        }
        if step.fixed_rows::<4>(0).amax() < 1e-4 {
            break;
        }
    }
    Ok(laid)
}

/// One round: correspondences, smoothed, both sides alike.
fn fine(generic: &FaceModel, surface: &Surface, held: &[(u32, u32)], allowed_mm: f64, laid: &mut [Point3<f64>]) {
    let mesh = surface.mesh();
    let target_normals = mesh.vertex_normals(mesh.positions());
    let corners = mesh.triangles().iter().enumerate().map(|(t, c)| {
        let middle = c.iter().map(|&i| mesh.positions()[i as usize].coords).sum::<Vector3<f64>>() / 3.0;
        (Point3::from(middle), surface.normal(t as u32))
    });
    let all = mesh.positions().iter().copied().zip(target_normals.iter().copied()).chain(corners);
    let stride = (mesh.len() + mesh.triangles().len()).div_ceil(MOST_SAMPLES).max(1);
    let samples: Vec<(Point3<f64>, Vector3<f64>)> = all.step_by(stride).collect();
    let normals = generic.mesh().vertex_normals(laid);
    let mut anchors = Vec::with_capacity(laid.len());
    for (v, (x, normal)) in laid.iter().zip(&normals).enumerate() {
        if let Some(&(_, there)) = held.iter().find(|h| h.0 as usize == v) {
            anchors.push(Anchor { at: *x, shift: mesh.positions()[there as usize] - x });
            continue;
        }
        if surface.closest(x).on_border {
            continue;
        }
        let unlike = |s: &(Point3<f64>, Vector3<f64>)| {
            (s.0 - x).norm_squared() + NORMAL_MM * NORMAL_MM * (s.1 - normal).norm_squared()
        };
        let nearest = samples.iter().min_by(|a, b| unlike(a).total_cmp(&unlike(b)));
        if let Some((place, n)) = nearest
            && n.dot(normal) > 0.6
            && (place - x).norm() < FAR_MM
        {
            anchors.push(Anchor { at: *x, shift: place - x });
        }
    }
    let exact: Vec<bool> = anchors.iter().map(|a| held.iter().any(|h| laid[h.0 as usize] == a.at)).collect();
    let field = Field::smoothed(&anchors, |k| if exact[k] { 0.0 } else { allowed_mm });
    let mut moved = laid.to_vec();
    field.morph(&mut moved);
    let shift: Vec<Vector3<f64>> = moved.iter().zip(laid.iter()).map(|(m, l)| m - l).collect();
    for (v, x) in laid.iter_mut().enumerate() {
        let across = generic.mirror()[v].map_or(shift[v], |w| shift[w as usize]);
        *x += (shift[v] + Vector3::new(-across.x, across.y, across.z)) / 2.0;
    }
}

fn bind(
    generic: &FaceModel,
    surface: &Surface,
    name: &str,
    known: &[(String, u32)],
    laid: &[Point3<f64>],
    rms_mm: f64,
) -> Result<Proposal, TransferError> {
    let mesh = surface.mesh();
    let table = mirror::detect(mesh);
    let nearest = |x: &Point3<f64>, among: &dyn Fn(usize) -> bool| {
        let far = |v: &usize| (mesh.positions()[*v] - x).norm_squared();
        (0..mesh.len()).filter(|v| among(*v)).min_by(|a, b| far(a).total_cmp(&far(b)))
    };
    let on_midline = |v: usize| table[v] == Some(v as u32);
    let outside = |x: &Point3<f64>, most: f64| {
        let c = surface.closest(x);
        c.distance > most || (c.on_border && c.distance > 0.5 * most)
    };
    // The vertex for a place of the generic face: nearest, on the midline for the midline.
    let place = |v: u32| -> Option<u32> {
        let x = &laid[v as usize];
        let any = nearest(x, &|_| true)?;
        if generic.mirror()[v as usize] == Some(v)
            && let Some(middle) = nearest(x, &on_midline)
            && (mesh.positions()[middle] - x).norm() < 2.0 * (mesh.positions()[any] - x).norm() + 2.0
        {
            return Some(middle as u32);
        }
        Some(any as u32)
    };
    // Both sides alike where the target has mirror pairs: the right takes the mirror of the left.
    let symmetric = |v: u32| -> Option<u32> {
        let across = generic.mirror()[v as usize].filter(|w| *w != v && laid[v as usize].x < laid[*w as usize].x);
        let mirrored = across.and_then(place).and_then(|p| table[p as usize]);
        mirrored.or_else(|| place(v))
    };

    let mut landmarks: Vec<Landmark> = Vec::new();
    let mut proposed = Vec::new();
    for l in generic.landmarks() {
        let x = &laid[l.vertex as usize];
        let given = known.iter().find(|(id, _)| *id == l.id).map(|(_, v)| *v);
        let vertex = given.or_else(|| if outside(x, OUTSIDE_MM) { None } else { symmetric(l.vertex) });
        let near = |v: &u32| given.is_some() || (mesh.positions()[*v as usize] - x).norm() < NOT_THERE_MM;
        let vertex = vertex.filter(|v| near(v) && landmarks.iter().all(|other| other.vertex != *v));
        let confidence = vertex.map_or(0.0, |v| {
            let away = (mesh.positions()[v as usize] - x).norm() / HALF_CONFIDENCE_MM;
            let edge = if surface.closest(x).on_border { 0.5 } else { 1.0 };
            if given.is_some() { 1.0 } else { edge / (1.0 + away * away) }
        });
        proposed.push(Proposed { id: l.id.clone(), vertex, confidence });
        if let Some(vertex) = vertex {
            landmarks.push(Landmark { vertex, ..l.clone() });
        }
    }
    let ids: Vec<String> = landmarks.iter().map(|l| l.id.clone()).collect();
    for l in &mut landmarks {
        // A landmark whose partner has no place stands alone.
        l.mirror = l.mirror.take().filter(|m| ids.contains(m));
    }

    let mut left_out = Vec::new();
    let mut muscle = |m: &Muscle| -> Option<Muscle> {
        let there = |v: u32| surface.closest(&laid[v as usize]).distance < MUSCLE_OUTSIDE_MM;
        let length = |a: Point3<f64>, b: Point3<f64>| (a - b).norm();
        let whole = length(laid[m.attachment as usize], laid[m.insertion as usize]);
        let left = |a: u32, b: u32| length(mesh.positions()[a as usize], mesh.positions()[b as usize]);
        match [m.attachment, m.insertion].map(|v| if there(v) { symmetric(v) } else { None }) {
            [Some(attachment), Some(insertion)]
                if attachment != insertion && left(attachment, insertion) > LEAST_LENGTH * whole =>
            {
                Some(Muscle { attachment, insertion, ..m.clone() })
            }
            _ => {
                left_out.push(m.id.clone());
                None
            }
        }
    };
    let muscles: Vec<Muscle> = generic.muscles().iter().filter_map(&mut muscle).collect();
    let muscle_presets: Vec<MusclePreset> = generic
        .muscle_presets()
        .iter()
        .map(|p| MusclePreset { muscles: p.muscles.iter().filter_map(&mut muscle).collect(), ..p.clone() })
        .collect();
    let regions = regions(generic, mesh, laid, &symmetric, &|x| outside(x, OUTSIDE_MM))?;

    // The origin lies midway between the inner corners of the eyes.
    let eyes: Vec<Point3<f64>> = ["eye_inner_left", "eye_inner_right"]
        .iter()
        .filter_map(|id| generic.landmark(id))
        .map(|l| {
            let bound = landmarks.iter().find(|b| b.id == l.id);
            bound.map_or(laid[l.vertex as usize], |b| mesh.positions()[b.vertex as usize])
        })
        .collect();
    let origin = match eyes.as_slice() {
        [a, b] => Vector3::new(0.0, f64::midpoint(a.y, b.y), f64::midpoint(a.z, b.z)),
        _ => Vector3::zeros(),
    };
    let moved = mesh.positions().iter().map(|p| p - origin).collect();
    let parts = FaceParts { name: name.to_owned(), landmarks, muscles, muscle_presets, mirror: table, regions };
    let face = FaceModel::new(mesh.with_positions(moved).map_err(FaceError::from)?, parts)?;
    Ok(Proposal { face, landmarks: proposed, muscles_left_out: left_out, rms_mm })
}

/// Every vertex of the target belongs to the regions of the vertex of the generic face it lies nearest to; and where the target
/// is the coarser of the two, the vertices nearest to a region belong to it.
fn regions(
    generic: &FaceModel,
    mesh: &Mesh,
    laid: &[Point3<f64>],
    vertex_for: &dyn Fn(u32) -> Option<u32>,
    outside: &dyn Fn(&Point3<f64>) -> bool,
) -> Result<Vec<Region>, FaceError> {
    let cover = Surface::at(generic.mesh(), laid.to_vec())?;
    let owner: Vec<Option<u32>> = mesh
        .positions()
        .iter()
        .map(|p| {
            let c = cover.closest(p);
            let corner = if c.weights[0] >= c.weights[1] && c.weights[0] >= c.weights[2] {
                0
            } else if c.weights[1] >= c.weights[2] {
                1
            } else {
                2
            };
            let there = generic.mesh().triangles()[c.triangle as usize][corner];
            (c.distance < OUTSIDE_MM && !c.on_border).then_some(there)
        })
        .collect();
    let finer = mesh.len() > generic.mesh().len();
    Ok(generic
        .regions()
        .iter()
        .map(|r| {
            let mut vertices: Vec<u32> = Vec::new();
            let mut add = |v: u32| {
                if !vertices.contains(&v) {
                    vertices.push(v);
                }
            };
            for &g in &r.vertices {
                if finer {
                    (0..mesh.len()).filter(|v| owner[*v] == Some(g)).for_each(|v| add(v as u32));
                } else if !outside(&laid[g as usize])
                    && let Some(v) = vertex_for(g)
                {
                    add(v);
                }
            }
            Region { id: r.id.clone(), vertices }
        })
        .collect())
}

/// Vertices of the target whose landmark is known by a numbering, by landmark id.
pub fn known_numbers(
    generic: &FaceModel,
    numbering: numbering::Numbering,
    vertex_in_file: &[u32],
) -> Vec<(String, u32)> {
    let vertex = |number: u32| vertex_in_file.iter().position(|v| *v == number).map(|v| v as u32);
    let number = |l: &Landmark| numbering.number(l);
    generic.landmarks().iter().filter_map(|l| Some((l.id.clone(), vertex(number(l)?)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::face::generic::proportions::generate_with;
    use crate::face::import;

    /// Another person, in centimetres, elsewhere, through an OBJ: most landmarks come back to their very vertices.
    #[test]
    fn a_person_of_other_proportions_gets_the_landmarks_back() {
        let generic = face::generic();
        let person =
            generate_with(&[("nose_length", 46.0), ("face_width", 148.0), ("jaw_width", 112.0), ("mouth_width", 56.0)])
                .unwrap();
        let moved: Vec<_> = person
            .mesh()
            .positions()
            .iter()
            .map(|p| Point3::new(p.x * 0.1, p.y * 0.1 + 7.0, p.z * 0.1 - 3.0))
            .collect();
        let text = import::write_obj(person.mesh(), &moved);
        let mesh = import::read(text.as_bytes(), "person.obj", &import::ImportOptions::default()).unwrap().mesh;
        let proposal = propose(&generic, &mesh, "person", &[]).unwrap();
        let away = |l: &Proposed| {
            let truth = person.landmark(&l.id).unwrap().vertex;
            l.vertex.map_or(99.0, |v| {
                (person.mesh().positions()[v as usize] - person.mesh().positions()[truth as usize]).norm()
            })
        };
        let mut all: Vec<f64> = proposal.landmarks.iter().map(away).collect();
        all.sort_unstable_by(f64::total_cmp);
        println!("{all:.1?} rms {:.2}", proposal.rms_mm);
        assert!(all[all.len() / 2] < 0.1 && all[28] < 9.0, "{all:?}");
        assert!(proposal.rms_mm < 1.0 && proposal.muscles_left_out.is_empty(), "{:?}", proposal.muscles_left_out);
        assert!(proposal.face.muscles().len() == 18 && proposal.face.region("forehead").len() > 20);
        // Both sides alike.
        for l in proposal.face.landmarks() {
            let across = l.mirror.as_ref().and_then(|m| proposal.face.landmark(m)).map_or(l.vertex, |m| m.vertex);
            assert_eq!(proposal.face.mirror()[l.vertex as usize], Some(across), "{}", l.id);
        }
        let eyes = ["eye_inner_left", "eye_inner_right"]
            .map(|id| proposal.face.mesh().positions()[proposal.face.landmark(id).unwrap().vertex as usize]);
        assert!(nalgebra::center(&eyes[0], &eyes[1]).coords.norm() < 1e-9);
    }

    /// A face without its forehead gets no landmark there, and says so.
    #[test]
    fn what_the_mesh_does_not_reach_is_not_proposed() {
        let generic = face::generic();
        let mut text = import::write_obj(generic.mesh(), generic.mesh().positions());
        let low = |t: &[u32; 3]| t.iter().all(|&v| generic.mesh().positions()[v as usize].y < 48.0);
        let faces = text.find("\nf ").unwrap();
        text.truncate(faces + 1);
        for t in generic.mesh().triangles().iter().filter(|t| low(t)) {
            use std::fmt::Write;
            writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap();
        }
        let options = import::ImportOptions { mm_per_unit: Some(1.0), ..Default::default() };
        let mesh = import::read(text.as_bytes(), "low.obj", &options).unwrap().mesh;
        let proposal = propose(&generic, &mesh, "low", &[]).unwrap();
        let top = proposal.landmarks.iter().find(|l| l.id == "forehead_top").unwrap();
        assert_eq!((top.vertex, top.confidence), (None, 0.0));
        assert!(proposal.face.landmark("nose_tip").is_some() && proposal.face.landmark("forehead_top").is_none());
    }

    #[test]
    fn a_flat_sheet_is_no_face() {
        let sheet = crate::face::patches::right_angled(20, 20, 8.0, 9.0);
        let moved = sheet.positions().iter().map(|p| Point3::new(p.x - 76.0, p.y, p.z)).collect();
        let sheet = sheet.with_positions(moved).unwrap();
        assert_eq!(propose(&face::generic(), &sheet, "sheet", &[]), Err(TransferError::NoNose));
    }
}
