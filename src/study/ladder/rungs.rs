//! The rungs: ways to the forces, each with rules for depth and on meshes where that matters, the simplest first.
//!
//! A rung is a change of a project's choices. Another way is another line of [`WAYS`].

use nalgebra::Vector3;

use super::ground::Ground;
use crate::displacement::DepthRule;
use crate::displacement::regularised::WeightRule;
use crate::forces::SkinModel;
use crate::muscle::LawKind;
use crate::pipeline::{self, Outcome, Workspace};
use crate::project::{FieldWay, MuscleWay, Project, Role};
use crate::study::applied::method;

/// How fine the mesh is that the chain runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    /// The face's own mesh, with about every third mark left out and filled in.
    Thinned,
    /// The face's own mesh with all marks.
    Own,
    /// Every triangle cut into four; marks at the face's own vertices, the rest filled in.
    Finer,
}

impl Level {
    pub(super) const ALL: [Self; 3] = [Self::Thinned, Self::Own, Self::Finer];

    const fn word(self) -> &'static str {
        match self {
            Self::Thinned => "own, two thirds of the marks",
            Self::Own => "own",
            Self::Finer => "finer",
        }
    }
}

/// A way to the forces, and where it is tried.
struct Way {
    field: FieldWay,
    skins: &'static [SkinModel],
    depths: &'static [DepthRule],
    levels: &'static [Level],
}

const BOTH: &[SkinModel] = &SkinModel::ALL;
const MEMBRANE: &[SkinModel] = &[SkinModel::Membrane];
const DEPTHS: &[DepthRule] = &[DepthRule::FixedDepth, DepthRule::KeepHeight, DepthRule::HalfWay];
const HEIGHT: &[DepthRule] = &[DepthRule::KeepHeight];
const LEVELS: &[Level] = &Level::ALL;
const OWN: &[Level] = &[Level::Own];

const WEIGHT: WeightRule = WeightRule::Discrepancy;
const SMOOTH: FieldWay = FieldWay::Regularised { weight: WEIGHT };

/// Muscles by the thesis's law, and on the face's own mesh, whatever law made the truth: to try all of them takes four
/// times as long, and so does a finer mesh.
const fn muscles(most: Option<u8>, alone: bool) -> FieldWay {
    FieldWay::Muscles(MuscleWay { weight: WEIGHT, law: Some(LawKind::Anatomical), most, alone, shape: false })
}

/// The ways, the simplest first.
#[rustfmt::skip]
const WAYS: [Way; 6] = [
    Way { field: FieldWay::Direct, skins: BOTH, depths: DEPTHS, levels: LEVELS },
    Way { field: SMOOTH, skins: BOTH, depths: DEPTHS, levels: LEVELS },
    Way { field: muscles(Some(2), true), skins: MEMBRANE, depths: HEIGHT, levels: OWN },
    Way { field: muscles(Some(u8::MAX), true), skins: MEMBRANE, depths: HEIGHT, levels: OWN },
    Way { field: muscles(None, true), skins: MEMBRANE, depths: HEIGHT, levels: OWN },
    Way { field: muscles(None, false), skins: MEMBRANE, depths: HEIGHT, levels: OWN },
];

/// One rung.
pub(super) struct Rung {
    /// The way's name.
    pub(super) method: String,
    /// Skin, depth rule and mesh as pairs.
    pub(super) setting: String,
    pub(super) level: Level,
    field: FieldWay,
    skin: SkinModel,
    depth: DepthRule,
}

/// All rungs, with the finer mesh or without: every way with its skins and depth rules on the face's own mesh, and on the other meshes as a membrane with
/// the depth that skin over a skull has.
pub(super) fn rungs(finer: bool) -> Vec<Rung> {
    let mut all = Vec::new();
    for way in &WAYS {
        for (&skin, &depth) in way.skins.iter().flat_map(|skin| way.depths.iter().map(move |depth| (skin, depth))) {
            for &level in way.levels.iter().filter(|l| finer || **l != Level::Finer) {
                if level == Level::Own || (skin, depth) == (SkinModel::Membrane, DepthRule::KeepHeight) {
                    all.push(Rung::of(way, skin, depth, level));
                }
            }
        }
    }
    all
}

/// The rung whose motion tells what has moved: smoothed, at the project's usual depth.
pub(super) fn smooth_rung() -> Rung {
    Rung {
        method: "Motion".to_owned(),
        setting: String::new(),
        level: Level::Own,
        field: SMOOTH,
        skin: SkinModel::default(),
        depth: DepthRule::FixedDepth,
    }
}

fn depth_word(rule: DepthRule) -> &'static str {
    match rule {
        DepthRule::FixedDepth => "fixed",
        DepthRule::SlideOnSurface => "slide",
        DepthRule::KeepHeight => "height",
        DepthRule::HalfWay => "half",
    }
}

/// A field on the face's own vertices, N, and which of them it can be believed at.
pub(super) struct Answer {
    pub(super) force: Vec<Vector3<f64>>,
    pub(super) believed: Vec<bool>,
}

impl Rung {
    fn of(way: &Way, skin: SkinModel, depth: DepthRule, level: Level) -> Self {
        let words = [skin.label().to_lowercase(), depth_word(depth).to_owned(), level.word().to_owned()];
        let [skin_word, depth_word, mesh_word] = words;
        Self {
            method: method(way.field),
            setting: format!("skin={skin_word}; depth={depth_word}; mesh={mesh_word}"),
            level,
            field: way.field,
            skin,
            depth,
        }
    }

    /// The project as this rung solves it.
    pub(super) fn project(&self, ground: &Ground, marked: &Project) -> Project {
        let mut project = marked.clone();
        project.settings.field = self.field;
        project.settings.skin_model = self.skin;
        project.settings.depth = self.depth;
        if self.level == Level::Thinned {
            thin(ground, &mut project);
        }
        project
    }

    /// The mesh's number of vertices.
    pub(super) fn vertices(&self, ground: &Ground) -> usize {
        self.face(ground).mesh().len()
    }

    /// Whether its region is tried: on the face's own mesh, as a membrane with the depth that skin over a skull has. Muscles are not asked of a
    /// region: points that stay tell that theirs do not pull.
    pub(super) fn has_region(&self) -> bool {
        let muscles = matches!(self.field, FieldWay::Muscles(_));
        self.level == Level::Own && self.depth == DepthRule::KeepHeight && self.skin == SkinModel::Membrane && !muscles
    }

    fn face<'a>(&self, ground: &'a Ground) -> &'a crate::face::FaceModel {
        if self.level == Level::Finer { &ground.finer.face } else { &ground.face }
    }

    /// The field that it finds in a project of [`Self::project`]; none where no muscles can be fitted.
    pub(super) fn solve(&self, ground: &Ground, project: &Project, workspace: &mut Workspace) -> Option<Answer> {
        let face = self.face(ground);
        let outcome = pipeline::solve(project, face, ground.size_px, workspace);
        if matches!(self.field, FieldWay::Muscles(_)) && outcome.muscles.is_none() {
            return None;
        }
        let coarse = ground.finer.coarse;
        let force = &outcome.field.force;
        let force = if self.level == Level::Finer { ground.finer.gathered(force) } else { force.clone() };
        Some(Answer { force, believed: (0..coarse).map(|v| is_inside(&outcome, v)).collect() })
    }
}

/// Whether a vertex is known, not on the border, and none of its springs beyond the table of the skin.
fn is_inside(outcome: &Outcome, v: usize) -> bool {
    outcome.states[v].is_known() && !outcome.border[v] && !outcome.field.outside_table[v]
}

/// Leaves out marks of the skin no two of which are neighbours, nor on the border of what is marked: what is left surrounds them.
fn thin(ground: &Ground, project: &mut Project) {
    let mesh = ground.face.mesh();
    let mut left_out: Vec<u32> = Vec::new();
    for &v in &ground.marked {
        let inner = mesh.neighbours(v as usize).iter().all(|n| project.features.contains_key(n));
        if inner && !mesh.neighbours(v as usize).iter().any(|n| left_out.contains(n)) {
            left_out.push(v);
        }
    }
    for v in left_out {
        if let Some(feature) = project.features.get_mut(&v).filter(|f| f.role == Role::Skin) {
            feature.last = None;
        }
    }
}
