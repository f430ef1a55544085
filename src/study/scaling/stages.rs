//! The stages of the chain on a sheet of any size, each made ready to be run again and again: for the study of scaling and for the benchmark.

use std::hint::black_box;

use nalgebra::{Matrix3x2, Point2, Point3, Vector3};

use super::super::sheet;
use crate::camera::Camera;
use crate::customize::{Anchor, CustomizeSettings, LandmarkTarget, customize, nnwa};
use crate::face::{FaceModel, FaceParts, Mesh, MeshError};
use crate::forces::{ForceSlopes, Influence, MarkInfluence, SpringRule, Springs, muscle_forces, standard_errors};
use crate::pipeline::{Workspace, solve};
use crate::project::{Edit, PointId, Project};
use crate::simulate::{Ended, EquilibriumSolver, Method, Stepper, System, SystemOptions};
use crate::skin::StressStrainCurve;

const CAMERA: Camera =
    Camera { principal_point_px: Point2::new(518.0, 518.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 };
/// Pull on the middle of the sheet, N/mm².
const PULL: f64 = 4e-4;
const FRAME_S: f64 = 1.0 / 60.0;

/// A stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Rest lengths and widths of all springs.
    Springs,
    /// The field.
    Field,
    /// The field with a list of what is known.
    FieldWithMask,
    /// The loop that one would write first: not part of the chain, but what it is compared with.
    PlainLoop,
    /// Standard errors of all forces.
    Errors,
    /// The morph of §4.2.
    Nnwa,
    /// Alignment, scaling and morph.
    Customize,
    /// Everything after one dragged point.
    Chain,
    /// The skin and its skull made ready to move.
    System,
    /// Where it comes to rest.
    Equilibrium,
    /// One step of implicit Euler.
    ImplicitStep,
    /// One step of vertex block descent.
    DescentStep,
}

impl Stage {
    /// All, in the order in which data flows.
    pub const ALL: [Self; 12] = [
        Self::Customize,
        Self::Nnwa,
        Self::Springs,
        Self::Field,
        Self::FieldWithMask,
        Self::PlainLoop,
        Self::Errors,
        Self::Chain,
        Self::System,
        Self::Equilibrium,
        Self::ImplicitStep,
        Self::DescentStep,
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::Field => "field F = −KX",
            Self::FieldWithMask => "field with a mask",
            Self::PlainLoop => "field: plain edge loop",
            Self::Errors => "standard errors",
            Self::Nnwa => "NNWA, 32 landmarks",
            Self::Customize => "customise, 32 landmarks",
            Self::Chain => "chain after a dragged point",
            Self::System => "skin over a skull made ready",
            Self::Equilibrium => "static equilibrium",
            Self::ImplicitStep => "step of implicit Euler",
            Self::DescentStep => "step of vertex block descent",
        }
    }

    /// Larger sheets are not tried: the factor of Newton's matrix grows faster than the mesh.
    pub const fn largest(self) -> usize {
        match self {
            Self::Equilibrium | Self::ImplicitStep => 100_000,
            _ => usize::MAX,
        }
    }
}

/// What is done with a stage that is ready: the bytes that it must move (0: not counted), and one run of it.
pub type Act<'a> = dyn FnMut(usize, &mut dyn FnMut()) + 'a;

/// A sheet that bulges like a face, and the same sheet after a motion of some millimetres.
#[derive(Debug)]
pub struct Sheet {
    mesh: Mesh,
    moved: Vec<Point3<f64>>,
    springs: Springs,
    curve: StressStrainCurve,
}

impl Sheet {
    /// A sheet of so many columns and rows.
    ///
    /// # Errors
    /// More vertices than a mesh can have.
    pub fn new(columns: usize, rows: usize) -> Result<Self, MeshError> {
        let mesh = sheet::bulging(columns, rows)?;
        let moved = sheet::moved(mesh.positions());
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        Ok(Self { mesh, moved, springs, curve: StressStrainCurve::default() })
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.mesh.len()
    }

    /// Bytes that the field must move: of each edge two ends, 1/l and h w (24 bytes); of each vertex its position read and its force written.
    pub fn field_bytes(&self) -> usize {
        24 * self.springs.edges().len() + 48 * self.mesh.len()
    }

    /// Makes a stage ready and hands it over once.
    ///
    /// # Errors
    /// Why the stage cannot be run on this sheet, in a line.
    pub fn run(&self, stage: Stage, act: &mut Act) -> Result<(), String> {
        let (n, edges) = (self.mesh.len(), self.springs.edges().len());
        let mut out = Vec::new();
        match stage {
            Stage::Springs => act(24 * edges + 24 * n, &mut || {
                black_box(Springs::new(&self.mesh, black_box(self.mesh.positions()), SpringRule::Strip, 1.5));
            }),
            Stage::Field => act(self.field_bytes(), &mut || {
                muscle_forces(&self.springs, &self.curve, black_box(&self.moved), None, &mut out);
            }),
            Stage::FieldWithMask => {
                let active = vec![true; n];
                act(self.field_bytes() + n, &mut || {
                    muscle_forces(&self.springs, &self.curve, black_box(&self.moved), Some(&active), &mut out);
                });
            }
            Stage::PlainLoop => act(self.field_bytes(), &mut || {
                plain_edge_loop(&self.springs, &self.curve, black_box(&self.moved), &mut out);
            }),
            Stage::Errors => {
                let influence = MarkInfluence {
                    weights: Influence::from_rows((0..n as u32).map(|i| [(i, 1.0)])),
                    slope_mm_per_px: vec![Matrix3x2::identity() * 0.25; n],
                    sigma_px: vec![0.5; n],
                    common: None,
                };
                let mut sigma = Vec::new();
                // Blocks of 72 bytes written and read from both ends, springs of a vertex, ends, slopes.
                act((72 * 3 + 24 + 16) * edges + (24 + 48 + 8 + 12 + 8) * n, &mut || {
                    let slopes = ForceSlopes::of_springs(&self.springs, &self.curve, black_box(&self.moved), None);
                    standard_errors(&slopes, &influence, &mut sigma);
                });
            }
            Stage::Nnwa => {
                let anchor = |t: &LandmarkTarget| {
                    let at = self.mesh.positions()[t.vertex as usize];
                    Anchor { at, shift: CAMERA.face_from_image(&t.at_in_image, at.z) - at }
                };
                let anchors: Vec<Anchor> = self.landmarks().iter().map(anchor).collect();
                let mut face = self.mesh.positions().to_vec();
                act(48 * n, &mut || nnwa::morph(black_box(&mut face), &anchors, 2.0, None));
            }
            Stage::Customize => {
                let targets = self.landmarks();
                act((24 * 8 + 24) * n, &mut || {
                    let fit = customize(&self.mesh, black_box(&targets), &CAMERA, &CustomizeSettings::default());
                    black_box(fit.is_ok());
                });
            }
            Stage::Chain => self.chain_after_a_drag(act)?,
            Stage::System => act(0, &mut || {
                black_box(self.pulled().is_ok());
            }),
            Stage::Equilibrium => {
                let system = self.pulled()?;
                let mut solver = EquilibriumSolver::new(&system).map_err(|e| e.to_string())?;
                let mut ended = Ok(());
                act(0, &mut || {
                    let found = solver.solve(&system, black_box(system.rest()));
                    if found.ended != Ended::Converged && found.residual_n > 1e-6 {
                        ended = Err(found.ended.label().to_owned());
                    }
                });
                ended?;
            }
            Stage::ImplicitStep | Stage::DescentStep => {
                let implicit = stage == Stage::ImplicitStep;
                let method = if implicit { Method::ImplicitEuler } else { Method::VertexBlockDescent };
                let system = self.pulled()?;
                let mut state = system.at_rest();
                let mut stepper = Stepper::new(method);
                let mut failed = Ok(());
                act(0, &mut || {
                    if let Err(e) = stepper.step(&system, &mut state, FRAME_S) {
                        failed = Err(e.to_string());
                    }
                });
                failed?;
            }
        }
        Ok(())
    }

    /// The skin over a skull, its rim fixed, pulled upwards in the middle.
    fn pulled(&self) -> Result<System, String> {
        let x = self.mesh.positions();
        let fixed = self.mesh.on_border();
        let mut system =
            System::new(&self.mesh, x, &fixed, None, SystemOptions::default()).map_err(|e| e.to_string())?;
        let areas = self.mesh.vertex_areas(x);
        let pull =
            |(p, area): (&Point3<f64>, &f64)| Vector3::y() * (PULL * area * (-(p.x * p.x + p.y * p.y) / 1500.0).exp());
        system.set_loads(x.iter().zip(&areas).map(pull).collect()).map_err(|e| e.to_string())?;
        Ok(system)
    }

    /// 32 landmarks spread over the sheet, marked up to 3 mm from where they are.
    fn landmarks(&self) -> Vec<LandmarkTarget> {
        let n = self.mesh.len() as f64;
        let landmark = |k: u32| {
            let vertex = ((f64::from(k) + 0.37 * f64::from(k % 3)) * n / 32.0) as u32;
            let at = self.mesh.positions()[vertex as usize]
                + Vector3::new(f64::from(k).sin() * 3.0, f64::from(k).cos() * 3.0, 0.0);
            LandmarkTarget { vertex, at_in_image: CAMERA.image_from_face(&at) }
        };
        (0..32).map(landmark).collect()
    }

    /// Every vertex marked in the last frame; then one mark is dragged to and fro.
    fn chain_after_a_drag(&self, act: &mut Act) -> Result<(), String> {
        let n = self.mesh.len();
        let parts = FaceParts { name: "sheet".to_owned(), mirror: vec![None; n], ..FaceParts::default() };
        let face = FaceModel::new(self.mesh.clone(), parts).map_err(|e| e.to_string())?;
        let mut project = Project::default();
        for (v, x) in self.moved.iter().enumerate() {
            let at = CAMERA.image_from_face(x);
            let put = Edit::Put(PointId::FeatureLast(v as u32), [at.x, at.y]);
            put.apply(&mut project).map_err(|e| e.to_string())?;
        }
        let middle = PointId::FeatureLast(n as u32 / 2);
        let at = CAMERA.image_from_face(&self.moved[n / 2]);
        let mut workspace = Workspace::default();
        let mut step = 0.0;
        act(0, &mut || {
            step = if step == 0.0 { 0.3 } else { 0.0 };
            let _ = Edit::Put(middle.clone(), [at.x + step, at.y]).apply(&mut project);
            black_box(solve(&project, &face, [1036, 1036], &mut workspace));
        });
        Ok(())
    }
}

/// The loop a good programmer writes first: one spring after the other, the table searched.
fn plain_edge_loop(springs: &Springs, curve: &StressStrainCurve, x: &[Point3<f64>], out: &mut Vec<Vector3<f64>>) {
    out.clear();
    out.resize(x.len(), Vector3::zeros());
    for (e, &[a, b]) in springs.edges().iter().enumerate() {
        let d = x[a as usize] - x[b as usize];
        let length = d.norm();
        let f = d * (springs.tension(e, curve, length) / length);
        out[a as usize] += f;
        out[b as usize] -= f;
    }
}
