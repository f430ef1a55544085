//! The small steps between the stages: from marks to targets, from placed points to positions, and what to warn of.

use nalgebra::{Matrix3x2, Matrix3x6, Point2, Point3, Vector2};

use super::peak::STANDS_ABOVE;
use super::{CustomizeInput, Fill, FillInput, LandmarkFit, Outcome, PlateInput, Warning};
use crate::camera::head_motion::FEWEST_STILL_POINTS;
use crate::camera::head_motion::motion_slope;
use crate::camera::{Camera, HeadMotion, RigidMotion, StillPoint};
use crate::customize::{self, Customized, LandmarkTarget};
use crate::displacement::depth::{self, Placed};
use crate::displacement::fill_in::{self, Weights};
use crate::displacement::regularised::{Plate, Smoothed, Weighed, WeightRule};
use crate::displacement::{DepthRule, UnmarkedRule, VertexState};
use crate::face::mesh::{NONE, doubled_area_vector};
use crate::face::{FaceModel, Mesh, Skull};
use crate::forces::{Common, Influence, MarkInfluence, SpreadInfluence};
use crate::project::{Mark, Project, Role, faults};

/// Landmark ids of the inner eye corners, which set the scale.
pub(super) const EYE_CORNERS: [&str; 2] = ["eye_inner_left", "eye_inner_right"];
/// Share of the picture's height that a face fills before anything is known: as wide as portraits are framed.
const FACE_SHARE: f64 = 0.75;
/// Muscles that leave the points so many times their error off are not what moved them.
const EXPLAINED: f64 = 2.0;

/// The camera with its scale: measured, or assumed from the eye corners, from the landmarks placed so far, or from the picture's height;
/// and whether it was measured.
pub(super) fn camera(project: &Project, face: &FaceModel, [width, height]: [u32; 2]) -> (Camera, bool) {
    let settings = &project.camera;
    let centre = settings.principal_point_px.unwrap_or([f64::from(width) / 2.0, f64::from(height) / 2.0]);
    let corners = EYE_CORNERS.map(|id| face.landmark(id).zip(landmark_mark(project, id)));
    let (mut px, mut mm) = (None, 0.0);
    if let [Some((a, mark_a)), Some((b, mark_b))] = corners {
        let x = face.mesh().positions();
        px = Some((Point2::from(mark_a.at_px) - Point2::from(mark_b.at_px)).norm()).filter(|px| *px > 0.0);
        mm = (x[a.vertex as usize] - x[b.vertex as usize]).norm();
    }
    let told = project.scale.px_per_mm(px, mm);
    let px_per_mm = told
        .or_else(|| scale_of_landmarks(project, face))
        .unwrap_or_else(|| f64::from(height) * FACE_SHARE / face_height(face.mesh()))
        .clamp(1e-6, 1e9);
    let camera = Camera {
        principal_point_px: centre.into(),
        z_prp_mm: settings.view_plane_z_mm + settings.distance_mm,
        z_vp_mm: settings.view_plane_z_mm,
        px_per_mm,
    };
    (camera, project.scale.is_measured() && told.is_some())
}

/// The mark of a landmark, where it counts.
fn landmark_mark<'a>(project: &'a Project, id: &str) -> Option<&'a Mark> {
    project.landmarks.get(id).filter(|m| m.state.is_data())
}

/// Pixels per millimetre from the spread of the landmarks placed so far about their centre; absent for fewer than two.
fn scale_of_landmarks(project: &Project, face: &FaceModel) -> Option<f64> {
    let x = face.mesh().positions();
    let pairs: Vec<_> = face
        .landmarks()
        .iter()
        .filter_map(|l| landmark_mark(project, &l.id).map(|m| (x[l.vertex as usize].xy(), Point2::from(m.at_px))))
        .collect();
    let spread = |points: &dyn Fn(usize) -> Point2<f64>| {
        let n = pairs.len() as f64;
        let centre = (0..pairs.len()).map(|i| points(i).coords).sum::<nalgebra::Vector2<f64>>() / n;
        ((0..pairs.len()).map(|i| (points(i).coords - centre).norm_squared()).sum::<f64>() / n).sqrt()
    };
    let (mm, px) = (spread(&|i| pairs[i].0), spread(&|i| pairs[i].1));
    (pairs.len() >= 2 && mm > 0.0 && px > 0.0).then(|| px / mm)
}

fn face_height(mesh: &Mesh) -> f64 {
    let (low, high) = mesh
        .positions()
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.y), high.max(p.y)));
    (high - low).max(1e-6)
}

/// Landmarks that count, as targets of the customisation, with their ids.
pub(super) fn landmark_targets(
    project: &Project,
    face: &FaceModel,
    warnings: &mut Vec<Warning>,
) -> (Vec<LandmarkTarget>, Vec<String>) {
    for id in project.landmarks.keys().filter(|id| face.landmark(id).is_none()) {
        warnings.push(Warning::NotInFace { what: format!("landmark {id}") });
    }
    face.landmarks()
        .iter()
        .filter_map(|l| {
            let mark = landmark_mark(project, &l.id)?;
            Some((LandmarkTarget { vertex: l.vertex, at_in_image: mark.at_px.into() }, l.id.clone()))
        })
        .unzip()
}

/// Customises; a fit that cannot be made (it would not be finite) leaves the generic face as it is.
pub(super) fn customized(mesh: &Mesh, input: &CustomizeInput) -> Customized {
    customize::customize(mesh, &input.targets, &input.camera, &input.settings).unwrap_or_else(|_| Customized {
        positions: mesh.positions().to_vec(),
        aligned: mesh.positions().to_vec(),
        scale: [1.0; 3],
        residual_before_px: vec![0.0; input.targets.len()],
        residual_px: vec![0.0; input.targets.len()],
        turn: [0.0; 3],
        turn_sigma: [0.0; 3],
        folded: Vec::new(),
        to_blame: Vec::new(),
    })
}

pub(super) fn landmark_fit(face: &FaceModel, customized: &Customized, ids: &[String]) -> LandmarkFit {
    let rms = |r: &[f64]| (r.iter().map(|r| r * r).sum::<f64>() / r.len().max(1) as f64).sqrt();
    LandmarkFit {
        placed: ids.len(),
        of: face.landmarks().len(),
        residuals_before_px: ids.iter().cloned().zip(customized.residual_before_px.iter().copied()).collect(),
        rms_before_px: rms(&customized.residual_before_px),
        rms_after_px: rms(&customized.residual_px),
        scale: customized.scale,
        folded: customized.folded.clone(),
    }
}

/// Slides vertices over the customised surface to where the hand has put them in the first frame.
pub(super) fn pinned_in_first_frame(
    project: &Project,
    mesh: &Mesh,
    customized: &[Point3<f64>],
    camera: &Camera,
) -> Vec<Point3<f64>> {
    let mut first = customized.to_vec();
    for (&v, feature) in &project.features {
        let Some(mark) = feature.first.filter(|m| m.state.is_data()) else { continue };
        if (v as usize) < mesh.len() {
            let ray = camera.ray(&mark.at_px.into());
            let start = mesh.triangles_of_vertex(v as usize).first();
            let slide = |t: &u32| depth::slide_on_surface(&ray, &camera.ray_slope(), mesh, customized, *t);
            if let Some(placed) = start.and_then(slide) {
                first[v as usize] = placed.position;
            }
        }
    }
    first
}

/// Vertices and marks that say how the head moved.
pub(super) fn still_marks(project: &Project, vertices: usize) -> impl Iterator<Item = (usize, &Mark)> {
    let still = project.features.iter().filter(|(_, f)| f.role == Role::Still);
    let marked = still.filter_map(|(&v, f)| Some((v as usize, f.last.as_ref().filter(|m| m.state.is_data())?)));
    marked.filter(move |(v, _)| *v < vertices)
}

pub(super) fn still_points(project: &Project, first: &[Point3<f64>]) -> Vec<StillPoint> {
    let point = |(v, mark): (usize, &Mark)| StillPoint {
        first: first[v],
        last_in_image: mark.at_px.into(),
        sigma_px: project.sigma_px(mark),
    };
    still_marks(project, first.len()).map(point).collect()
}

/// Standard deviations of the landmarks that count, px, in the order of [`landmark_targets`].
pub(super) fn landmark_sigmas(project: &Project, face: &FaceModel) -> impl Iterator<Item = f64> {
    face.landmarks().iter().filter_map(|l| Some(project.sigma_px(landmark_mark(project, &l.id)?)))
}

/// Vertices of the skin that are measured in the last frame, with their marks.
pub(super) fn skin_marks<'a>(
    project: &'a Project,
    states: &'a [VertexState],
) -> impl Iterator<Item = (usize, &'a Mark)> {
    project.features.iter().filter(|(_, f)| f.role == Role::Skin).filter_map(|(&v, f)| {
        let mark = f.last.as_ref().filter(|m| m.state.is_data())?;
        (states.get(v as usize) == Some(&VertexState::Measured)).then_some((v as usize, mark))
    })
}

/// A mark of the last frame that counts.
pub(super) struct Marked {
    vertex: u32,
    at_in_image: Point2<f64>,
    sigma_px: f64,
}

pub(super) fn marked(project: &Project, vertices: usize, warnings: &mut Vec<Warning>) -> Vec<Marked> {
    let mut marked = Vec::new();
    for (&vertex, feature) in &project.features {
        if vertex as usize >= vertices {
            warnings.push(Warning::NotInFace { what: format!("point {vertex}") });
        } else if feature.role != Role::Fixed
            && let Some(mark) = feature.last.filter(|m| m.state.is_data())
        {
            marked.push(Marked { vertex, at_in_image: mark.at_px.into(), sigma_px: project.sigma_px(&mark) });
        }
    }
    marked
}

/// The motion of the skin made smooth: how, and the marks as they are then.
pub(super) struct Smooth {
    /// The marks, and the inferred vertices as if marked.
    pub marked: Vec<Marked>,
    /// Number of marks, and of fixed vertices beside them.
    pub marks: usize,
    /// The motion in the picture, with its spread.
    pub smoothed: Smoothed,
    /// Vertices of its columns.
    pub places: Vec<u32>,
    /// Its L-curve.
    pub curve: Vec<Weighed>,
}

/// What a plate is laid over.
pub(super) fn plate_input(
    project: &Project,
    mesh: &Mesh,
    first: &[Point3<f64>],
    states: &[VertexState],
    marked: &[Marked],
) -> PlateInput {
    let least = marked.iter().map(|m| m.sigma_px).fold(f64::INFINITY, f64::min);
    let mut known: Vec<(u32, f64)> = marked.iter().map(|m| (m.vertex, m.sigma_px)).collect();
    // Vertices that stay on their bone count as marks that hardly err, where they lie beside moving skin.
    let moves = |v: usize| matches!(states[v], VertexState::Measured | VertexState::Inferred);
    let held = |v: &usize| states[*v] == VertexState::Fixed && mesh.neighbours(*v).iter().any(|&j| moves(j as usize));
    if project.settings.unmarked != UnmarkedRule::Held {
        known.extend((0..states.len()).filter(held).map(|v| (v as u32, 0.1 * least)));
    }
    known.sort_by_key(|k| k.0);
    known.dedup_by_key(|k| k.0);
    let inferred = (0..states.len()).filter(|v| states[*v] == VertexState::Inferred).map(|v| v as u32).collect();
    let (vertices, sigma_px) = known.into_iter().unzip();
    PlateInput { first: first.to_vec(), vertices, sigma_px, inferred }
}

/// Marks made smooth on a plate: their motion in the picture beyond that of the head.
pub(super) fn smooth(
    plate: &Plate,
    rule: WeightRule,
    marked: &[Marked],
    states: &[VertexState],
    first: &[Point3<f64>],
    camera: &Camera,
    motion: &RigidMotion,
) -> Smooth {
    let still = |v: u32| camera.image_from_face(&motion.last_from_first(&first[v as usize]));
    let of = |v: &u32| {
        let mark = marked.binary_search_by_key(v, |m| m.vertex).ok().map(|k| marked[k].at_in_image);
        mark.map_or(Vector2::zeros(), |at| at - still(*v))
    };
    let motion_px: Vec<Vector2<f64>> = plate.marked().iter().map(of).collect();
    let smoothed = plate.smooth(&motion_px, rule);
    let at = |(&vertex, u): (&u32, &Vector2<f64>)| Marked { vertex, at_in_image: still(vertex) + u, sigma_px: 0.0 };
    // What is fixed told the plate where to stay, and stays there itself.
    let moves = |(v, _): &(&u32, _)| matches!(states[**v as usize], VertexState::Measured | VertexState::Inferred);
    Smooth {
        marked: plate.places().iter().zip(&smoothed.motion_px).filter(moves).map(at).collect(),
        marks: plate.marked().len(),
        curve: plate.l_curve(&motion_px),
        places: plate.places().to_vec(),
        smoothed,
    }
}

/// How every vertex errs after smoothing.
pub(super) fn spread<'a>(
    smooth: &'a Smooth,
    camera: &Camera,
    head: &HeadMotion,
    measured: &[Measured],
    first: &[Point3<f64>],
) -> SpreadInfluence<'a> {
    let mut slope_mm_per_px = vec![Matrix3x2::zeros(); first.len()];
    let mut column = vec![None; first.len()];
    for (k, &v) in smooth.places.iter().enumerate() {
        column[v as usize] = Some(k as u32);
    }
    let mut shared = vec![Matrix3x6::zeros(); first.len()];
    for m in measured {
        slope_mm_per_px[m.vertex as usize] = m.placed.slope_mm_per_px;
        shared[m.vertex as usize] = follows_head(m, camera, head);
    }
    let common = (head.still_points > 0).then(|| Common {
        slopes: shared,
        covariance: head.covariance,
        follows: std::collections::BTreeMap::new(),
    });
    let smoothed = &smooth.smoothed;
    SpreadInfluence { slope_mm_per_px, column, spread_px: &smoothed.spread_px, off_px: &smoothed.off_px, common }
}

/// A small further motion of the head moves the picture of a placed point; what follows is the mark's own slope times that, backwards.
fn follows_head(m: &Measured, camera: &Camera, head: &HeadMotion) -> Matrix3x6<f64> {
    let there = head.motion.last_from_first(&m.placed.position);
    let in_picture = camera.image_slope(&there) * motion_slope(&head.motion, &m.placed.position);
    -(m.placed.slope_mm_per_px * in_picture)
}

/// A mark brought back to the head as it stood in the first frame.
pub(super) struct Measured {
    vertex: u32,
    placed: Placed,
    sigma_px: f64,
}

pub(super) fn place(
    marked: &[Marked],
    camera: &Camera,
    motion: &RigidMotion,
    mesh: &Mesh,
    first: &[Point3<f64>],
    rule: DepthRule,
    heights: Option<&Skull>,
) -> Vec<Measured> {
    let slope = motion.rotation.inverse().to_rotation_matrix().matrix() * camera.ray_slope();
    // The triangle in which each vertex was found: the walk for a neighbour starts there.
    let mut found = vec![NONE; if rule == DepthRule::SlideOnSurface { mesh.len() } else { 0 }];
    let mut at = |m: &Marked| {
        let v = m.vertex as usize;
        let ray = motion.first_from_last_ray(&camera.ray(&m.at_in_image));
        let placed = match rule {
            DepthRule::FixedDepth => depth::fixed_depth(&ray, &slope, first[v].z),
            DepthRule::KeepHeight => depth::keep_height(&ray, &slope, heights?, &first[v]),
            DepthRule::HalfWay => depth::half_way(&ray, &slope, heights?, &first[v]),
            DepthRule::SlideOnSurface => {
                let near = mesh.neighbours(v).iter().map(|&j| found[j as usize]).find(|&t| t != NONE);
                let start = near.or_else(|| mesh.triangles_of_vertex(v).first().copied())?;
                let placed = depth::slide_on_surface(&ray, &slope, mesh, first, start)?;
                found[v] = placed.triangle;
                Some(placed)
            }
        }?;
        let finite = placed.position.coords.iter().all(|c| c.is_finite());
        finite.then_some(Measured { vertex: m.vertex, placed, sigma_px: m.sigma_px })
    };
    marked.iter().filter_map(&mut at).collect()
}

pub(super) fn known_from_marks(project: &Project, vertices: usize, measured: &[Measured]) -> Vec<VertexState> {
    let mut states = vec![VertexState::Unmeasured; vertices];
    for (&v, feature) in &project.features {
        if feature.role == Role::Fixed
            && let Some(state) = states.get_mut(v as usize)
        {
            *state = VertexState::Fixed;
        }
    }
    for m in measured {
        states[m.vertex as usize] = VertexState::Measured;
    }
    states
}

pub(super) fn fill(mesh: &Mesh, input: &FillInput) -> Fill {
    let mut states = input.states.clone();
    let nothing = || Weights { rows: vec![Vec::new(); mesh.len()] };
    let known = states.iter().any(|s| s.is_known());
    let inferred = match input.rule {
        UnmarkedRule::Inferred { reach_mm } if known => fill_in::infer(mesh, &input.first, &mut states, reach_mm),
        _ => nothing(),
    };
    let open = known && states.contains(&VertexState::Unmeasured);
    let predicted = if open { fill_in::predict(mesh, &input.first, &states) } else { nothing() };
    Fill { states, inferred, predicted }
}

/// Positions in the last frame, head motion removed: measured, held, filled in, and predicted for drawing.
pub(super) fn displaced(first: &[Point3<f64>], measured: &[Measured], fill: &Fill) -> Vec<Point3<f64>> {
    let mut last = first.to_vec();
    let mut placed = vec![false; first.len()];
    for m in measured {
        last[m.vertex as usize] = m.placed.position;
        placed[m.vertex as usize] = true;
    }
    // Inferred vertices follow measured ones; predictions follow both, so they come second.
    for weights in [&fill.inferred, &fill.predicted] {
        for (i, row) in weights.rows.iter().enumerate().filter(|(i, row)| !placed[*i] && !row.is_empty()) {
            let moved = row.iter().map(|&(j, w)| (last[j as usize] - first[j as usize]) * w);
            last[i] = first[i] + moved.sum::<nalgebra::Vector3<f64>>();
        }
    }
    last
}

/// Where the last frame shows every vertex: the head's motion put back.
pub(super) fn seen_in_last_frame(last: &[Point3<f64>], camera: &Camera, motion: &RigidMotion) -> Vec<Point2<f64>> {
    last.iter().map(|x| camera.image_from_face(&motion.last_from_first(x))).collect()
}

/// How every known vertex follows the marks: measured ones their own, inferred ones those around them, all the head's motion.
pub(super) fn influence(
    project: &Project,
    camera: &Camera,
    head: &HeadMotion,
    measured: &[Measured],
    first: &[Point3<f64>],
    fill: &Fill,
) -> MarkInfluence {
    let mut mark_of = vec![u32::MAX; first.len()];
    for (k, m) in measured.iter().enumerate() {
        mark_of[m.vertex as usize] = k as u32;
    }
    let rows = || {
        fill.inferred.rows.iter().enumerate().map(|(v, row)| {
            let own = (mark_of[v] != u32::MAX).then_some((mark_of[v], 1.0));
            let others = row.iter().filter(|(j, _)| mark_of[*j as usize] != u32::MAX);
            own.into_iter().chain(others.map(|&(j, w)| (mark_of[j as usize], w)))
        })
    };
    let slopes: Vec<Matrix3x2<f64>> = measured.iter().map(|m| m.placed.slope_mm_per_px).collect();
    // Marks without error leave none in the head's motion.
    let still: Vec<(usize, &Mark)> = still_marks(project, first.len()).collect();
    let common = (head.still_points > 0 && still.iter().any(|(_, m)| project.sigma_px(m) > 0.0)).then(|| {
        let of_mark: Vec<Matrix3x6<f64>> = measured.iter().map(|m| follows_head(m, camera, head)).collect();
        let mut of_vertex = vec![Matrix3x6::zeros(); first.len()];
        for (slope, row) in of_vertex.iter_mut().zip(rows()) {
            *slope += row.map(|(k, w)| of_mark[k as usize] * w).sum::<Matrix3x6<f64>>();
        }
        let follows = still.iter().zip(&head.follows);
        let follows = follows.filter_map(|(&(v, _), &g)| Some((mark_of[v], g)).filter(|(k, _)| *k != u32::MAX));
        Common { slopes: of_vertex, covariance: head.covariance, follows: follows.collect() }
    });
    MarkInfluence {
        weights: Influence::from_rows(rows()),
        slope_mm_per_px: slopes,
        sigma_px: measured.iter().map(|m| m.sigma_px).collect(),
        common,
    }
}

/// Measured and inferred vertices with a neighbour of which nothing is known.
pub(super) fn border(mesh: &Mesh, states: &[VertexState]) -> Vec<bool> {
    let open = |v: usize| mesh.neighbours(v).iter().any(|&j| !states[j as usize].is_known());
    let carries = |s: &VertexState| matches!(s, VertexState::Measured | VertexState::Inferred);
    states.iter().enumerate().map(|(v, s)| carries(s) && open(v)).collect()
}

/// Triangles of known vertices whose normal has turned over between the frames.
pub(super) fn folded(mesh: &Mesh, first: &[Point3<f64>], last: &[Point3<f64>], states: &[VertexState]) -> Vec<u32> {
    let turned = |t: [u32; 3]| {
        t.iter().all(|&i| states[i as usize].is_known())
            && doubled_area_vector(first, t).dot(&doubled_area_vector(last, t)) < 0.0
    };
    mesh.triangles().iter().enumerate().filter(|(_, t)| turned(**t)).map(|(i, _)| i as u32).collect()
}

/// Collects what the user should know, gravest first.
pub(super) fn warn(project: &Project, outcome: &mut Outcome, mesh: &Mesh) {
    let mut found = Vec::new();
    let outside = faults::outside_picture(project);
    if let Some((first, _)) = outside.first() {
        found.push(Warning::OutsidePicture { count: outside.len(), first: first.clone() });
    }
    for (folded, frame) in [(&outcome.fit.folded, "first"), (&outcome.field.folded, "last")] {
        if let Some(&t) = folded.first() {
            let vertex = mesh.triangles()[t as usize][0];
            found.push(Warning::Folded { count: folded.len(), frame, vertex });
        }
    }
    // Nothing is amiss with a project that nobody has begun to mark.
    let begun = !project.landmarks.is_empty() || !project.features.is_empty();
    if begun && outcome.fit.placed < outcome.fit.of {
        found.push(Warning::LandmarksMissing { placed: outcome.fit.placed, of: outcome.fit.of });
    }
    if begun && !outcome.scale_measured {
        found.push(Warning::RelativeScale);
    }
    let marks = outcome.states.iter().filter(|s| **s == VertexState::Measured).count();
    if marks > 0 && outcome.head.still_points == 0 && project.settings.remove_head_motion {
        let marked_still = project.features.values().filter(|f| f.role == Role::Still && f.last.is_some()).count();
        found.push(Warning::HeadMotionNotRemoved { found: marked_still, needed: FEWEST_STILL_POINTS });
    }
    if let Some(noise_px) = outcome.head.noise_floor_px {
        let still = |v: usize| project.features.get(&(v as u32)).is_some_and(|f| f.role == Role::Still);
        let moved = |v: usize| {
            let there = outcome.camera.image_from_face(&outcome.last[v]);
            (there - outcome.first_in_image[v]).norm_squared()
        };
        let squares: Vec<f64> = (0..outcome.states.len())
            .filter(|&v| outcome.states[v] == VertexState::Measured && !still(v))
            .map(moved)
            .collect();
        let motion_px = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        if !squares.is_empty() && noise_px > motion_px {
            found.push(Warning::NoiseAboveMotion { noise_px, motion_px });
        }
    }
    let outside = outcome.field.outside_table.iter().filter(|o| **o).count();
    if outside > 0 {
        found.push(Warning::OutsideTable { count: outside });
    }
    if let Some(ratio) = outcome.median_over_error()
        && ratio < STANDS_ABOVE
        && project.settings.marking_sigma_px > 0.0
    {
        found.push(Warning::NoisyField { sigma_px: project.settings.marking_sigma_px, ratio });
    }
    if let Some(m) = outcome.muscles.as_ref().filter(|m| m.misfit > EXPLAINED) {
        let besides = m.besides.map(|b| b.of_all);
        found.push(Warning::MusclesExplainLittle { left_px: m.left_px, misfit: m.misfit, besides });
    }
    outcome.warnings.splice(0..0, found);
}
