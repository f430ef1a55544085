//! Where the skin of a project comes to rest under forces, be it springs or a membrane: the way back from F = −K X.

use nalgebra::{Point3, Vector3};

use super::{
    Equilibrium, EquilibriumSolver, Jaw, MembraneSolver, OutOfMemory, SkinLaw, System, SystemError, SystemOptions,
};
use crate::face::Mesh;
use crate::forces::{Membrane, Skin, SkinSpec};

/// The skin of a face over its skull, without tension at rest, since F = −K X has none either.
#[derive(Debug)]
pub struct SkinAtRest {
    system: System,
    skin: Skin,
    solver: Solver,
}

/// The jaw is opened by this angle, rad, for what a small opening does: a tenth of a millimetre at the chin.
const OPENED_RAD: f64 = 1e-3;

/// By the model of the skin.
#[derive(Debug)]
enum Solver {
    Springs(Box<EquilibriumSolver>),
    Membrane(Box<(Membrane, MembraneSolver)>),
}

/// Why a skin cannot come to rest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RestError {
    /// It makes no system.
    #[error("the skin cannot be simulated: {0}")]
    System(#[from] SystemError),
    /// Memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

impl SkinAtRest {
    /// The skin of a mesh at rest at `rest` (mm); `fixed` vertices stay on their bone, the others slide over the skull. Without a jaw no bone moves.
    ///
    /// # Errors
    /// [`RestError`].
    pub fn new(
        mesh: &Mesh,
        rest: &[Point3<f64>],
        fixed: &[bool],
        jaw: Option<Jaw>,
        spec: &SkinSpec,
    ) -> Result<Self, RestError> {
        let options = SystemOptions {
            law: SkinLaw::Table(spec.curve.clone()),
            spring_rule: spec.rule,
            thickness_mm: spec.thickness_mm,
            pre_tension_kpa: 0.0,
            ..SystemOptions::default()
        };
        let system = System::new(mesh, rest, fixed, jaw, options)?;
        let skin = Skin::new(mesh, rest, spec);
        let solver = match skin.membrane() {
            None => Solver::Springs(Box::new(EquilibriumSolver::new(&system)?)),
            Some(membrane) => Solver::Membrane(Box::new((membrane.clone(), MembraneSolver::new(membrane, &system)?))),
        };
        Ok(Self { system, skin, solver })
    }

    /// The skin itself.
    pub fn skin(&self) -> &Skin {
        &self.skin
    }

    /// Whether each vertex slides, rather than stays on its bone.
    pub fn free(&self) -> &[bool] {
        self.system.free()
    }

    /// The length of a last Newton step that counts as none, mm.
    pub fn within(&mut self, tolerance_mm: f64) {
        match &mut self.solver {
            Solver::Springs(solver) => solver.tolerance_mm = tolerance_mm,
            Solver::Membrane(both) => both.1.tolerance_mm = tolerance_mm,
        }
    }

    /// Whether a bone of it moves.
    pub fn has_jaw(&self) -> bool {
        self.system.has_jaw()
    }

    /// Opens the jaw by an angle, rad; nothing happens without one.
    pub fn open_jaw(&mut self, angle_rad: f64) {
        self.system.open_jaw(angle_rad);
    }

    /// What an opening of the jaw does to an equilibrium `x` under these forces (N on every vertex), per rad: how far the bones carry every vertex, mm,
    /// and the forces that then are left, N, turned back with them; what these move ([`Self::moved`]) comes on top. None without a jaw.
    pub fn opening(&self, loads: &[Vector3<f64>], x: &[Point3<f64>]) -> Option<[Vec<Vector3<f64>>; 2]> {
        let carried = self.system.carried_further(OPENED_RAD)?;
        let there: Vec<Point3<f64>> = x.iter().enumerate().map(|(i, p)| carried.place(i, p)).collect();
        let all = vec![true; x.len()];
        let mut needed = [Vec::new(), Vec::new()];
        for (needed, x) in needed.iter_mut().zip([x, &there]) {
            self.skin.muscle_forces(x, &all, needed);
        }
        let [now, then] = needed;
        let left = |i: usize| (carried.back(i, &(loads[i] - then[i])) - (loads[i] - now[i])) / OPENED_RAD;
        let way = x.iter().zip(&there).map(|(p, q)| (q - p) / OPENED_RAD);
        Some([way.collect(), (0..x.len()).map(left).collect()])
    }

    /// The equilibrium under these forces (N on every vertex), looked for from a start.
    ///
    /// # Errors
    /// Forces of another number of vertices, or that are no numbers.
    pub fn solve(&mut self, loads: Vec<Vector3<f64>>, start: &[Point3<f64>]) -> Result<Equilibrium, SystemError> {
        self.system.set_loads(loads)?;
        Ok(match &mut self.solver {
            Solver::Springs(solver) => solver.solve(&self.system, start),
            Solver::Membrane(both) => both.1.solve(&both.0, &self.system, start),
        })
    }

    /// How far every vertex goes from an equilibrium `x` under these forces, mm, for each of some small changes of them, N: H⁻¹ Δf. None where
    /// the stiffness H there has no factor, or the forces are of another number of vertices.
    pub fn moved(
        &mut self,
        loads: Vec<Vector3<f64>>,
        x: &[Point3<f64>],
        changes: &[Vec<Vector3<f64>>],
    ) -> Option<Vec<Vec<Vector3<f64>>>> {
        self.system.set_loads(loads).ok()?;
        let mut all = vec![Vec::new(); changes.len()];
        let pairs = changes.iter().zip(&mut all);
        let fine = match &mut self.solver {
            Solver::Springs(solver) => {
                let mut tangent = solver.tangent(&self.system, x)?;
                pairs.fold(true, |fine, (change, out)| fine & tangent.moved(change, out))
            }
            Solver::Membrane(both) => {
                let mut tangent = both.1.tangent(&both.0, &self.system, x)?;
                pairs.fold(true, |fine, (change, out)| fine & tangent.moved(change, out))
            }
        };
        fine.then_some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use crate::forces::{SkinModel, SpringRule};
    use crate::skin::StressStrainCurve;

    /// The response to a small change of one muscle is that of two equilibria, by central differences.
    #[test]
    fn small_changes_of_the_forces_move_the_skin_as_differences_of_equilibria_do() {
        let face = face::generic();
        let rest = face.mesh().positions();
        // A pull upwards on the forehead, and one across it as the change: 0.3 N and 1 N over discs of 25 mm.
        let disc = |x: f64, pull: Vector3<f64>| -> Vec<Vector3<f64>> {
            let near = |p: &Point3<f64>| (1.0 - (p - Point3::new(x, 45.0, p.z)).norm() / 25.0).max(0.0);
            let sum: f64 = rest.iter().map(near).sum();
            rest.iter().map(|p| pull * (near(p) / sum)).collect()
        };
        let loads = disc(0.0, Vector3::new(0.0, 0.3, 0.0));
        let change = disc(20.0, Vector3::new(1.0, 0.0, 0.0));
        let spec = SkinSpec {
            model: SkinModel::Membrane,
            rule: SpringRule::default(),
            thickness_mm: 1.5,
            curve: StressStrainCurve::default(),
        };
        let mut skin = SkinAtRest::new(face.mesh(), rest, &face.mesh().on_border(), None, &spec).unwrap();
        skin.within(1e-9);
        let x = skin.solve(loads.clone(), rest).unwrap().positions;
        let moved = skin.moved(loads.clone(), &x, std::slice::from_ref(&change)).unwrap().remove(0);
        let h = 1e-4;
        let mut at = |by: f64| {
            let loads = loads.iter().zip(&change).map(|(f, c)| f + c * by).collect();
            skin.solve(loads, &x).unwrap().positions
        };
        let (up, down) = (at(h), at(-h));
        let largest = moved.iter().map(Vector3::norm).fold(0.0, f64::max);
        let off = |v: usize| ((up[v] - down[v]) / (2.0 * h) - moved[v]).norm();
        let worst = (0..rest.len()).map(off).fold(0.0, f64::max);
        assert!(largest > 1.0 && worst < 0.01 * largest, "{worst} of {largest}");
    }

    /// What an opening of the jaw does is the difference of two equilibria, by central differences, from a jaw that is open already.
    #[test]
    fn an_opening_of_the_jaw_moves_the_skin_as_differences_of_equilibria_do() {
        let face = face::generic();
        let rest = face.mesh().positions();
        // The chin goes with the jaw, the forehead stays, and between it goes in part.
        let weights = rest.iter().map(|p| ((-20.0 - p.y) / 60.0).clamp(0.0, 1.0)).collect();
        let jaw = Jaw { centre: Point3::new(0.0, -18.0, -70.0), axis: Vector3::x_axis(), weights };
        for model in SkinModel::ALL {
            let spec =
                SkinSpec { model, rule: SpringRule::default(), thickness_mm: 1.5, curve: StressStrainCurve::default() };
            let fixed = face.mesh().on_border();
            let mut skin = SkinAtRest::new(face.mesh(), rest, &fixed, Some(jaw.clone()), &spec).unwrap();
            assert!(skin.has_jaw());
            skin.within(1e-9);
            let still = vec![Vector3::zeros(); rest.len()];
            let mut at = |rad: f64, from: &[Point3<f64>]| {
                skin.open_jaw(rad);
                skin.solve(still.clone(), from).unwrap().positions
            };
            let (angle, h) = (0.1, 1e-3);
            let x = at(angle, rest);
            let (up, down) = (at(angle + h, &x), at(angle - h, &x));
            skin.open_jaw(angle);
            let [carried, left] = skin.opening(&still, &x).unwrap();
            let moved = skin.moved(still.clone(), &x, std::slice::from_ref(&left)).unwrap().remove(0);
            let off = |v: usize| ((up[v] - down[v]) / (2.0 * h) - moved[v] - carried[v]).norm();
            let worst = (0..rest.len()).map(off).fold(0.0, f64::max);
            let largest = carried.iter().map(Vector3::norm).fold(0.0, f64::max);
            let slid = moved.iter().map(Vector3::norm).fold(0.0, f64::max);
            assert!(largest > 60.0 && slid > 5.0 && worst < 0.03 * largest, "{model:?}: {worst} of {largest}, {slid}");
        }
    }
}
