//! Solving only the region that moved: which marks it holds, and by how much leaving out the others changes the answer.
//!
//! A mark has moved when the smoothed motion there, without the head's, is longer than a share s of the longest. The region is these marks and two rings
//! of neighbours around them. The inner ring is solved; the outer one is the rim: held where it was seen, so that what lies within has all its neighbours, and without a force
//! of its own. Marks beyond are left out. Where nothing was solved the force counts as zero.
//!
//! A spring's force depends on its two ends alone, so within the rim the direct way finds what it finds on the whole; what is missed are the forces
//! of skin that moved by less than s. Forces are differences of motion, so about that share is missed. How much exactly depends on the skin, the way and
//! the marking error, so it is not assumed but measured: s is the largest of [`SHARES`] of the tolerance with which the answer changes by less than half of
//! [`TOLERANCE`]. The other half is for what changes while marks are dragged: the change that counts is that after some marks were dragged by one marking error each. Where no
//! share is small enough everything is solved.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::ground::{FEWEST_COMPARED, Ground};
use super::rungs::{Answer, Rung, smooth_rung};
use super::twins::Truth;
use crate::pipeline::{self, Workspace};
use crate::project::Project;
use crate::study::twin::normal_pair;
use crate::study::yardstick::relative_error;

/// The answer may change by less than this share.
pub(super) const TOLERANCE: f64 = 0.1;
/// The region is chosen so that the answer changes at first by less than this share of the tolerance.
const AT_FIRST: f64 = 0.5;
/// Shares of the tolerance that are tried as the least motion, the smallest region first.
const SHARES: [f64; 4] = [4.0, 2.0, 1.0, 0.5];
/// Marks that are dragged before the change is measured.
const DRAGGED: usize = 9;
/// By their marking error, or this share of the stated one where marks are said to have none.
const LEAST_DRAG: f64 = 0.1;

/// A region of a project.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cut {
    /// Marks that are left out.
    out: Vec<u32>,
    /// Share of the marks that are kept; 1 where nothing is left out.
    pub(super) share: f64,
}

/// How long the smoothed motion of every vertex is, mm.
fn motion(ground: &Ground, smooth: &Rung, marked: &Project, workspace: &mut Workspace) -> Vec<f64> {
    let project = smooth.project(ground, marked);
    let outcome = pipeline::solve(&project, &ground.face, ground.size_px, workspace);
    super::ground::apart(&outcome.last, &outcome.first)
}

impl Cut {
    /// The region of the marks that moved by more than a share of the longest motion, and its rings.
    fn new(ground: &Ground, motion: &[f64], share: f64) -> Self {
        let marked = &ground.marked;
        let longest = marked.iter().map(|v| motion[*v as usize]).fold(0.0_f64, f64::max);
        let mut inside = vec![false; motion.len()];
        for &v in marked {
            inside[v as usize] = motion[v as usize] > share * longest;
        }
        let grown = |from: &[bool]| -> Vec<bool> {
            let mesh = ground.face.mesh();
            (0..from.len()).map(|v| from[v] || mesh.neighbours(v).iter().any(|n| from[*n as usize])).collect()
        };
        let kept = grown(&grown(&inside));
        let out: Vec<u32> = marked.iter().copied().filter(|v| !kept[*v as usize]).collect();
        Self { share: 1.0 - out.len() as f64 / marked.len().max(1) as f64, out }
    }

    /// The project with this region alone.
    pub(super) fn of(&self, project: &Project) -> Project {
        let mut project = project.clone();
        for v in &self.out {
            project.features.remove(v);
        }
        project
    }

    pub(super) fn is_whole(&self) -> bool {
        self.out.is_empty()
    }
}

/// What a region does to a rung's answer on one twin.
pub(super) struct Restricted {
    /// The region.
    pub(super) cut: Cut,
    /// Change of the answer after the drags, relative to the whole; 0 where nothing is left out.
    pub(super) change: f64,
}

/// Marks of the skin dragged by one marking error each, in directions that are always the same.
fn dragged(ground: &Ground, marked: &Project) -> Project {
    let mut random = Pcg64::seed_from_u64(DRAGGED as u64);
    let mut project = marked.clone();
    for k in 0..DRAGGED {
        let Some(v) = ground.marked.get(k * ground.marked.len() / DRAGGED) else { continue };
        let px = project.settings.marking_sigma_px.max(LEAST_DRAG * ground.sigma_px);
        if let Some(mark) = project.features.get_mut(v).and_then(|f| f.last.as_mut()) {
            let [a, b] = normal_pair(&mut random);
            let length = (a * a + b * b).sqrt().max(f64::MIN_POSITIVE);
            mark.at_px[0] += px * a / length;
            mark.at_px[1] += px * b / length;
        }
    }
    project
}

/// Chooses the region of every rung on the marks as they are, and measures the change of its answer after drags; none of a rung without an answer.
pub(super) fn restricted(ground: &Ground, truth: &Truth, rungs: &[&Rung], marked: &Project) -> Vec<Option<Restricted>> {
    let [mut whole, mut part] = <[Workspace; 2]>::default();
    let motion = motion(ground, &smooth_rung(), marked, &mut whole);
    let dragged = dragged(ground, marked);
    let compared = truth.compared(ground);
    let all = |rung: &Rung, marked: &Project, workspace: &mut Workspace| -> Option<Answer> {
        rung.solve(ground, &rung.project(ground, marked), workspace)
    };
    let mut change = |rung: &Rung, marked: &Project, all: &Answer, cut: &Cut| -> Option<f64> {
        let mut some = rung.solve(ground, &cut.of(&rung.project(ground, marked)), &mut part)?;
        for (force, _) in some.force.iter_mut().zip(&some.believed).filter(|(_, believed)| !**believed) {
            *force = Vector3::zeros();
        }
        let counted: Vec<usize> = compared.iter().copied().filter(|v| all.believed[*v]).collect();
        (counted.len() >= FEWEST_COMPARED).then(|| relative_error(&some.force, &all.force, &counted))
    };
    let wholes: Vec<Option<Answer>> = rungs.iter().map(|rung| all(rung, marked, &mut whole)).collect();
    let mut found: Vec<Option<Restricted>> = wholes.iter().map(|_| None).collect();
    let mut last: Option<Cut> = None;
    // All rungs on one region before the next: they share its plate.
    for share in SHARES {
        let cut = Cut::new(ground, &motion, share * TOLERANCE);
        if cut.is_whole() {
            break;
        }
        // Another share that keeps the same marks would only be solved again.
        if last.as_ref() == Some(&cut) {
            continue;
        }
        for ((rung, before), slot) in rungs.iter().zip(&wholes).zip(&mut found).filter(|(_, slot)| slot.is_none()) {
            let at_first = before.as_ref().and_then(|before| change(rung, marked, before, &cut));
            if at_first.is_some_and(|c| c < AT_FIRST * TOLERANCE) {
                let after = all(rung, &dragged, &mut whole).and_then(|after| change(rung, &dragged, &after, &cut));
                *slot = after.map(|change| Restricted { cut: cut.clone(), change });
            }
        }
        last = Some(cut);
    }
    let everything = || Restricted { cut: Cut { out: Vec::new(), share: 1.0 }, change: 0.0 };
    found.into_iter().zip(wholes).map(|(found, whole)| found.or_else(|| whole.map(|_| everything()))).collect()
}
