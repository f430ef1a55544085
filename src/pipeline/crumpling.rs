//! Finds the landmark to blame where the fit of the face crumples: two marks swapped, one that folds triangles, one far off.

use nalgebra::{Point2, distance};

use super::{CustomizeInput, Warning};
use crate::customize::Customized;
use crate::face::{FaceModel, Landmark};

/// A mark is far off when it misses its landmark by so many times the median miss.
const FAR: f64 = 3.0;

/// Landmarks of two faces that are brought to each other lie no farther apart, mm (their standard deviations are 2 to 6 mm).
const STRANGE_MM: f64 = 20.0;

/// Adds what crumples the fit, in front of all other warnings.
pub(super) fn warn(face: &FaceModel, input: &CustomizeInput, fit: &Customized, warnings: &mut Vec<Warning>) {
    let named = |k: usize| face.landmarks().iter().find(|l| l.vertex == input.targets[k].vertex);
    let mut found = Vec::new();
    for (a, b) in swapped(input, fit) {
        if let (Some(a), Some(b)) = (named(a), named(b)) {
            found.push(Warning::Swapped { ids: [a, b].map(|l| l.id.clone()), names: [a, b].map(|l| l.name.clone()) });
        }
    }
    if found.is_empty()
        && let Some(Landmark { id, name, .. }) =
            most_blamed(fit).and_then(|v| face.landmarks().iter().find(|l| l.vertex == v))
    {
        // It says more than the plain count of folds, and stands for it.
        warnings.retain(|w| !matches!(w, Warning::Folded { frame: "first", .. }));
        found.push(Warning::Crumpled { count: fit.folded.len(), id: id.clone(), name: name.clone() });
    }
    if found.is_empty()
        && let Some((k, off_mm)) = misplaced(input, fit)
        && let Some(Landmark { id, name, .. }) = named(k)
    {
        found.push(Warning::Misplaced { id: id.clone(), name: name.clone(), off_mm });
    }
    warnings.splice(0..0, found);
}

/// The vertex of the landmark to which most folded triangles are laid.
fn most_blamed(fit: &Customized) -> Option<u32> {
    let mut counts = std::collections::BTreeMap::new();
    for v in &fit.to_blame {
        *counts.entry(*v).or_insert(0_usize) += 1;
    }
    counts.into_iter().max_by_key(|(_, n)| *n).map(|(v, _)| v)
}

/// The target that misses its landmark by far the most, and by how much, mm: no face differs so much from another.
fn misplaced(input: &CustomizeInput, fit: &Customized) -> Option<(usize, f64)> {
    let misses = &fit.residual_before_px;
    let (worst, px) = misses.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let off_mm = px / input.camera.px_per_mm;
    (off_mm > STRANGE_MM && px > 2.0 * FAR * median(misses)).then_some((worst, off_mm))
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Pairs of targets whose marks are far off, and each near where the other is expected.
fn swapped(input: &CustomizeInput, fit: &Customized) -> Vec<(usize, usize)> {
    let far = FAR * median(&fit.residual_before_px).max(0.5);
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
