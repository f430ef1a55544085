//! What all twins of a subject share: the person, the camera, the muscles that act where it is marked, and the vertices that count.

use nalgebra::Point3;

use super::subject::Subject;
use crate::camera::Camera;
use crate::camera::head_motion::FEWEST_STILL_POINTS;
use crate::expression::Refined;
use crate::expression::{Basic, Expression};
use crate::face::FaceModel;
use crate::forces::Sheet;
use crate::pipeline::{self, Workspace};
use crate::project::{Feature, Mark, Project, Role, Settings};
use crate::study::points::median;
use crate::study::scene;
use crate::study::{MembraneFace, MembraneSettings};

/// A muscle acts where this share of its pull, or more, lies on marked skin.
const ACTS: f64 = 0.25;
/// An expression acts there when it pulls by this share, or more, of what the strongest of the six does.
const EXPRESSION_ACTS: f64 = 0.25;
/// Fewer vertices than this tell no error.
pub(super) const FEWEST_COMPARED: usize = 8;

/// A subject made ready.
#[derive(Clone)]
pub(super) struct Ground {
    /// The project as it is.
    pub(super) project: Project,
    /// The face model that the chain begins with.
    pub(super) face: FaceModel,
    /// The same with every triangle cut into four.
    pub(super) finer: Refined,
    pub(super) size_px: [u32; 2],
    /// The face as the project's landmarks make it: the twins' own.
    pub(super) person: FaceModel,
    pub(super) camera: Camera,
    /// Marked skin of which all neighbours are known: what is compared.
    pub(super) compared: Vec<usize>,
    /// Marked skin.
    pub(super) marked: Vec<u32>,
    /// Actuators that act there, by id.
    pub(super) muscles: Vec<String>,
    /// The basic expressions that do.
    pub(super) expressions: Vec<Basic>,
    /// Whether still points tell the head's motion: else the twins' heads keep still.
    pub(super) head_moves: bool,
    /// The marking error that the project states, px: the median over the marks.
    pub(super) sigma_px: f64,
}

impl Ground {
    pub(super) fn new(subject: &Subject) -> Result<Self, String> {
        let project = subject.project.clone();
        let face = FaceModel::clone(&subject.face);
        let outcome = pipeline::solve(&project, &face, subject.size_px, &mut Workspace::default());
        let person = face.with_positions(outcome.first.clone()).map_err(|e| e.to_string())?;
        let skin = |v: usize| project.features.get(&(v as u32)).is_some_and(|f| f.role == Role::Skin);
        let measured = |v: usize| outcome.states[v] == crate::displacement::VertexState::Measured;
        let marked: Vec<u32> = (0..face.mesh().len()).filter(|&v| measured(v) && skin(v)).map(|v| v as u32).collect();
        let compared: Vec<usize> = marked.iter().map(|v| *v as usize).filter(|&v| !outcome.border[v]).collect();
        if compared.len() < FEWEST_COMPARED {
            return Err(format!(
                "only {} marked vertices have all their neighbours marked or filled in; at least {FEWEST_COMPARED} are needed",
                compared.len()
            ));
        }
        let mut sigmas: Vec<f64> = project.features.values().filter_map(|f| Some(project.sigma_px(&f.last?))).collect();
        let (muscles, expressions) = acting(&person, &project.settings, &marked)?;
        let still = project.features.values().filter(|f| f.role == Role::Still && f.last.is_some()).count();
        let head_moves = project.settings.remove_head_motion && still >= FEWEST_STILL_POINTS;
        let finer = scene::finer(&face)?;
        let (camera, size_px) = (outcome.camera, subject.size_px);
        let sigma_px = median(&mut sigmas).unwrap_or(project.settings.marking_sigma_px);
        Ok(Self {
            project,
            face,
            finer,
            size_px,
            person,
            camera,
            compared,
            marked,
            muscles,
            expressions,
            head_moves,
            sigma_px,
        })
    }
}

/// Largest face of which every vertex is marked.
const MOST_MARKED: usize = crate::displacement::regularised::MOST_MARKS;

impl Ground {
    /// The same person with every vertex of the face marked: where there is something to leave out. None for a face that is too large.
    pub(super) fn whole_face(&self) -> Option<Self> {
        let mesh = self.face.mesh();
        if mesh.len() > MOST_MARKED {
            return None;
        }
        let mut whole = self.clone();
        for v in 0..mesh.len() as u32 {
            let mark = Some(Mark::new([0.0; 2]));
            whole.project.features.entry(v).or_insert(Feature { first: None, last: mark, role: Role::Skin });
        }
        let skin = whole.project.features.iter().filter(|(_, f)| f.role == Role::Skin && f.last.is_some());
        whole.marked = skin.map(|(v, _)| *v).filter(|v| (*v as usize) < mesh.len()).collect();
        let border = mesh.on_border();
        whole.compared = whole.marked.iter().map(|v| *v as usize).filter(|v| !border[*v]).collect();
        Some(whole)
    }
}

/// The skin of the truths: the project's own curve and thickness.
pub(super) fn membrane(settings: &Settings) -> MembraneSettings {
    let sheet = Sheet { curve: settings.skin.clone(), thickness_mm: settings.skin_thickness_mm, ..Sheet::default() };
    MembraneSettings { sheet, ..MembraneSettings::default() }
}

/// The muscles and the basic expressions that act on marked skin.
fn acting(person: &FaceModel, settings: &Settings, marked: &[u32]) -> Result<(Vec<String>, Vec<Basic>), String> {
    let made = MembraneFace::new(person, &membrane(settings)).map_err(|e| e.to_string())?;
    let mut is_marked = vec![false; made.refined.coarse];
    for &v in marked {
        is_marked[v as usize] = true;
    }
    let share = |fine: u32| -> f64 {
        let row = &made.refined.between[fine as usize];
        row.iter().filter(|(v, _)| is_marked[*v as usize]).map(|(_, w)| w).sum()
    };
    let there =
        |loads: &[(u32, nalgebra::Vector3<f64>)]| -> f64 { loads.iter().map(|(v, f)| f.norm() * share(*v)).sum() };
    let all = &made.actuators().all;
    let acts = |a: &&crate::expression::Actuator| {
        let pull: f64 = a.loads.iter().map(|(_, f)| f.norm()).sum();
        pull > 0.0 && there(&a.loads) >= ACTS * pull
    };
    let muscles: Vec<String> = all.iter().filter(acts).map(|a| a.id.clone()).collect();
    if muscles.is_empty() {
        return Err("no muscle of this face acts where it is marked".to_owned());
    }
    let pulls = Basic::ALL.map(|basic| {
        let loads = made.actuators().loads(&Expression::basic(basic, made.actuators())).newton;
        loads.iter().enumerate().map(|(v, f)| f.norm() * share(v as u32)).sum::<f64>()
    });
    let strongest = pulls.iter().fold(0.0_f64, |a, b| a.max(*b));
    let some = Basic::ALL.into_iter().zip(pulls).filter(|(_, pull)| *pull >= EXPRESSION_ACTS * strongest);
    Ok((muscles, some.map(|(basic, _)| basic).collect()))
}

/// How far every vertex of two lists lies apart, mm.
pub(super) fn apart(a: &[Point3<f64>], b: &[Point3<f64>]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).collect()
}
