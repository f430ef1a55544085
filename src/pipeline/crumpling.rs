//! Finds the landmark to blame where the fit of the face crumples: two marks swapped, or one that folds triangles.

use nalgebra::{Point2, distance};

use super::{CustomizeInput, Warning};
use crate::customize::{self, Customized};
use crate::face::{FaceModel, Landmark, Mesh};

/// A mark is far off when it misses its landmark by so many times the median miss.
const FAR: f64 = 3.0;

/// Folded triangles that are looked at, at most: enough to find who folds them, few enough to look while a mark is dragged.
const MOST_TRIANGLES: usize = 128;

/// Adds what crumples the fit, in front of all other warnings.
pub(super) fn warn(face: &FaceModel, input: &CustomizeInput, fit: &Customized, warnings: &mut Vec<Warning>) {
    let named = |k: usize| face.landmarks().iter().find(|l| l.vertex == input.targets[k].vertex);
    let mut found = Vec::new();
    for (a, b) in swapped(input, fit) {
        if let (Some(a), Some(b)) = (named(a), named(b)) {
            found.push(Warning::Swapped { ids: [a, b].map(|l| l.id.clone()), names: [a, b].map(|l| l.name.clone()) });
        }
    }
    let to_blame = if fit.folded.is_empty() || !found.is_empty() { None } else { folding(face.mesh(), input, fit) };
    if let Some(Landmark { id, name, .. }) = to_blame.and_then(named) {
        // It says more than the plain count of folds, and stands for it.
        warnings.retain(|w| !matches!(w, Warning::Folded { frame: "first", .. }));
        found.push(Warning::Crumpled { count: fit.folded.len(), id: id.clone(), name: name.clone() });
    }
    warnings.splice(0..0, found);
}

/// Pairs of targets whose marks are far off, and each near where the other is expected.
fn swapped(input: &CustomizeInput, fit: &Customized) -> Vec<(usize, usize)> {
    let mut misses = fit.residual_before_px.clone();
    misses.sort_by(f64::total_cmp);
    let far = FAR * misses.get(misses.len() / 2).copied().unwrap_or(0.0).max(0.5);
    let expected: Vec<Point2<f64>> =
        input.targets.iter().map(|t| input.camera.image_from_face(&fit.aligned[t.vertex as usize])).collect();
    let off: Vec<usize> = (0..input.targets.len()).filter(|&k| fit.residual_before_px[k] > far).collect();
    let miss = |landmark: usize, mark: usize| distance(&expected[landmark], &input.targets[mark].at_in_image);
    let mut pairs = Vec::new();
    for (i, &a) in off.iter().enumerate() {
        for &b in &off[i + 1..] {
            if 2.0 * miss(a, b) < miss(a, a) && 2.0 * miss(b, a) < miss(b, b) {
                pairs.push((a, b));
            }
        }
    }
    pairs
}

/// The target without which fewest of the folded triangles stay folded; of equals the one that misses its mark most.
fn folding(mesh: &Mesh, input: &CustomizeInput, fit: &Customized) -> Option<usize> {
    // Only the folded triangles and the landmarks are fitted again, so that the size of the face does not matter.
    let triangles: Vec<[u32; 3]> =
        fit.folded.iter().take(MOST_TRIANGLES).map(|&t| mesh.triangles()[t as usize]).collect();
    let mut kept: Vec<u32> =
        input.targets.iter().map(|t| t.vertex).chain(triangles.iter().flatten().copied()).collect();
    kept.sort_unstable();
    kept.dedup();
    let number = |v: u32| kept.binary_search(&v).map(|i| i as u32).ok();
    let positions = kept.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let triangles = triangles.iter().filter_map(|t| Some([number(t[0])?, number(t[1])?, number(t[2])?])).collect();
    let part = Mesh::new(positions, triangles).ok()?;
    let targets: Vec<_> = input
        .targets
        .iter()
        .filter_map(|t| Some(customize::LandmarkTarget { vertex: number(t.vertex)?, ..*t }))
        .collect();
    let folds_without = |k: usize| {
        let mut others = targets.clone();
        others.remove(k);
        customize::customize(&part, &others, &input.camera, &input.settings).map_or(usize::MAX, |c| c.folded.len())
    };
    let folds: Vec<usize> = (0..targets.len()).map(folds_without).collect();
    let fewest = folds.iter().copied().min().filter(|&n| n < part.triangles().len())?;
    let miss = |k: &usize| fit.residual_before_px[*k];
    (0..folds.len()).filter(|&k| folds[k] == fewest).max_by(|a, b| miss(a).total_cmp(&miss(b)))
}
