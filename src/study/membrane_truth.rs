//! Expressions of a skin that is not the solver's: a finer mesh of membrane elements over the skull, pulled by the muscles as tractions.

use nalgebra::{Point3, Vector3};

use crate::expression::{ActuatorError, ActuatorSettings, Actuators, Expression, RefineError, Refined};
use crate::face::FaceModel;
use crate::forces::{Membrane, Sheet};
use crate::muscle::{LawKind, MuscleLaw};
use crate::simulate::{Ended, Hold, MembraneSolver, OutOfMemory, System, SystemError, SystemOptions};

/// What the skin of a truth is.
#[derive(Clone, Debug, PartialEq)]
pub struct MembraneSettings {
    /// How often every triangle is cut into four: 1 makes 2354 vertices of the generic face's 612, 2 makes 9226.
    pub levels: u32,
    /// What the skin is made of.
    pub sheet: Sheet,
    /// How a muscle's traction spreads around its fibre.
    pub law: MuscleLaw,
}

impl Default for MembraneSettings {
    /// One cut, the default skin, the anatomical law.
    fn default() -> Self {
        Self { levels: 1, sheet: Sheet::default(), law: MuscleLaw::default_of(LawKind::Anatomical) }
    }
}

/// Why a face has no such truth.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// The face cannot be refined.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// It has no actuators.
    #[error(transparent)]
    Actuators(#[from] ActuatorError),
    /// Its skin makes no system.
    #[error("the skin cannot be simulated: {0}")]
    System(#[from] SystemError),
    /// Its equilibria cannot be looked for.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// The expression names muscles that the face does not have.
    #[error("the face has no muscle called {}", .0.join(", "))]
    Unknown(Vec<String>),
}

/// A face ready to make expressions of known truth: the finer mesh, its skin, its bones and its muscles.
#[derive(Debug)]
pub struct MembraneFace {
    /// The finer face.
    pub refined: Refined,
    /// What pulls on it: every muscle's traction times the area of each vertex, summing in length to the muscle's strength.
    pub actuators: Actuators,
    /// The skin.
    pub membrane: Membrane,
    system: System,
    solver: MembraneSolver,
    areas: Vec<f64>,
}

/// An expression in equilibrium, on the vertices of the face that was refined.
#[derive(Clone, Debug, PartialEq)]
pub struct MembraneTruth {
    /// What was asked.
    pub expression: Expression,
    /// Where every vertex is, mm.
    pub last: Vec<Point3<f64>>,
    /// Where every vertex of the finer mesh is, mm.
    pub fine: Vec<Point3<f64>>,
    /// What holds the skin in this shape, N: muscles, skull and held vertices together; what F = −K X is to find.
    pub force: Vec<Vector3<f64>>,
    /// The muscles' part of it, N.
    pub muscle: Vec<Vector3<f64>>,
    /// The skull's part, N: across the surface on which the vertices slide.
    pub skull: Vec<Vector3<f64>>,
    /// Area of the skin at rest that each vertex stands for, mm²: by it a force becomes a traction.
    pub area_mm2: Vec<f64>,
    /// Why the search for the equilibrium ended. Anything but [`Ended::Converged`] is no truth.
    pub ended: Ended,
    /// Newton steps.
    pub iterations: usize,
    /// Largest force along the surface that is left on a vertex of the finer mesh, N.
    pub residual_n: f64,
    /// Triangles of the finer mesh that have turned over.
    pub folded: usize,
    /// Least and largest principal stretch.
    pub stretch: [f64; 2],
}

impl MembraneFace {
    /// Makes a face ready.
    ///
    /// # Errors
    /// A face without the landmarks that actuators are placed by, or whose skin makes no system.
    pub fn new(face: &FaceModel, settings: &MembraneSettings) -> Result<Self, TruthError> {
        let refined = Refined::new(face, settings.levels)?;
        let mesh = refined.face.mesh();
        let rest = mesh.positions();
        let areas = mesh.vertex_areas(rest);
        let mut actuators = Actuators::of(&refined.face, rest, &settings.law, ActuatorSettings::default())?;
        actuators.become_tractions(&areas);
        // Of the system only bones, skull and loads are used, not its springs.
        let options =
            SystemOptions { hold: Hold::Skull, repulsion: None, pre_tension_kpa: 0.0, ..SystemOptions::default() };
        let system = System::new(mesh, rest, &actuators.held, Some(actuators.jaw.clone()), options)?;
        let membrane = Membrane::new(mesh, rest, settings.sheet.clone());
        let solver = MembraneSolver::new(&membrane, &system)?;
        Ok(Self { refined, actuators, membrane, system, solver, areas })
    }

    /// What can pull on it.
    pub fn actuators(&self) -> &Actuators {
        &self.actuators
    }

    /// The equilibrium under an expression, looked for from rest.
    ///
    /// # Errors
    /// An expression that names muscles that the face does not have, or activations that are no numbers.
    pub fn truth(&mut self, expression: &Expression) -> Result<MembraneTruth, TruthError> {
        let loads = self.actuators.loads(expression);
        if !loads.unknown.is_empty() {
            return Err(TruthError::Unknown(loads.unknown));
        }
        self.system.open_jaw(expression.jaw_deg.to_radians());
        self.system.set_loads(loads.newton)?;
        let found = self.solver.solve(&self.membrane, &self.system, &self.system.carried());
        let mut held_by = Vec::new();
        self.membrane.forces(&found.positions, None, &mut held_by);
        for f in &mut held_by {
            *f = -*f;
        }
        // What is left across the surface, the skull holds.
        let skull: Vec<Vector3<f64>> = (0..held_by.len())
            .map(|i| {
                let left = held_by[i] - self.system.loads()[i];
                if self.system.free()[i] {
                    left - self.system.within(i, &found.positions[i], left)
                } else {
                    Vector3::zeros()
                }
            })
            .collect();
        let stretches = self.membrane.stretches(&found.positions);
        let bound = |[low, high]: [f64; 2], [large, small]: &[f64; 2]| [low.min(*small), high.max(*large)];
        Ok(MembraneTruth {
            expression: expression.clone(),
            last: found.positions[..self.refined.coarse].to_vec(),
            force: self.refined.gathered(&held_by),
            muscle: self.refined.gathered(self.system.loads()),
            skull: self.refined.gathered(&skull),
            fine: found.positions,
            area_mm2: self.refined.gathered(&self.areas),
            ended: found.ended,
            iterations: found.iterations,
            residual_n: found.residual_n,
            folded: found.folded.len(),
            stretch: stretches.iter().fold([1.0, 1.0], bound),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::refined;
    use crate::face::{self, Mesh, patches};
    use crate::forces::Material;
    use crate::skin::{Contraction, StressStrainCurve};
    use crate::study::Wish;

    /// Muscles, skull and held vertices are all that pulls on the skin, so they sum to nothing; and where nothing is held, what the skin needs is
    /// what muscles and skull give.
    #[test]
    fn forces_balance_as_a_whole_and_at_every_free_vertex() {
        let face = face::generic();
        let mut made = MembraneFace::new(&face, &MembraneSettings::default()).unwrap();
        let expression = Wish::BrowRaise.expression(&made.actuators, 0).times(0.5);
        let truth = made.truth(&expression).unwrap();
        assert_eq!((truth.ended, truth.folded), (Ended::Converged, 0));
        let lengths: f64 = truth.force.iter().map(Vector3::norm).sum();
        assert!(truth.force.iter().sum::<Vector3<f64>>().norm() < 1e-12 * lengths);
        // 3.4 N a side at full activation, shared among vertices: lengths of sums are no longer than sums of lengths.
        let pull: f64 = truth.muscle.iter().map(Vector3::norm).sum();
        assert!(pull <= 3.4 + 1e-9 && pull > 3.2, "{pull}");
        let held: Vec<bool> = made.actuators.held[..612].to_vec();
        let mesh = face.mesh();
        let free = |v: usize| !held[v] && mesh.neighbours(v).iter().all(|n| !held[*n as usize]);
        for v in (0..612).filter(|v| free(*v)) {
            let left = truth.force[v] - truth.muscle[v] - truth.skull[v];
            assert!(left.norm() < 1e-5, "{v}: {left}");
        }
        // The brow goes up by the 8 mm of a full raise.
        let brow = face.region("brows").iter().map(|v| truth.last[*v as usize].y - mesh.positions()[*v as usize].y);
        let highest = brow.fold(0.0, f64::max);
        assert!((6.0..9.5).contains(&highest), "{highest}");
        let area: f64 = mesh.vertex_areas(mesh.positions()).iter().sum();
        assert!((truth.area_mm2.iter().sum::<f64>() - area).abs() < 1e-6 * area);
        let nobody = Expression { activations: [("tongue".to_owned(), 1.0)].into(), ..expression };
        assert!(made.truth(&nobody).unwrap_err().to_string().contains("tongue"));
    }

    /// A flat square held on its border and pulled by a smooth traction: the error of linear elements is of second order, so with every cut the change
    /// of the places falls to a quarter.
    #[test]
    fn places_converge_with_the_square_of_the_mesh_size() {
        let curve = StressStrainCurve::new(vec![[-0.5, -20.0], [0.5, 20.0]], Contraction::Fung).unwrap();
        for material in [Material::Fibres, Material::Principal] {
            let mut mesh = patches::right_angled(5, 5, 8.0, 8.0);
            let mut middles: Vec<Vec<Point3<f64>>> = Vec::new();
            for _ in 0..5 {
                let places = settled(&mesh, Sheet { curve: curve.clone(), material, ..Sheet::default() });
                middles.push(places[..25].to_vec());
                mesh = refined::halved(&mesh).unwrap();
            }
            let change = |k: usize| -> f64 {
                let squares = middles[k].iter().zip(&middles[k + 1]).map(|(a, b)| (a - b).norm_squared());
                squares.sum::<f64>().sqrt()
            };
            let ratios = [change(1) / change(2), change(2) / change(3)];
            assert!(ratios.iter().all(|r| (3.4..4.6).contains(r)), "{material:?} {ratios:?}");
        }
    }

    fn settled(mesh: &Mesh, sheet: Sheet) -> Vec<Point3<f64>> {
        let rest = mesh.positions();
        let options = SystemOptions { repulsion: None, pre_tension_kpa: 0.0, ..SystemOptions::default() };
        let mut system = System::new(mesh, rest, &mesh.on_border(), None, options).unwrap();
        let areas = mesh.vertex_areas(rest);
        let wave = |t: f64| (std::f64::consts::PI * t / 32.0).sin();
        let pull =
            |(p, a): (&Point3<f64>, &f64)| Vector3::new(1.0, 0.4, 0.0) * (2e-4 * a * wave(p.x) * wave(2.0 * p.y));
        system.set_loads(rest.iter().zip(&areas).map(pull).collect()).unwrap();
        let membrane = Membrane::new(mesh, rest, sheet);
        let found = MembraneSolver::new(&membrane, &system).unwrap().solve(&membrane, &system, rest);
        assert_eq!(found.ended, Ended::Converged);
        found.positions
    }
}
