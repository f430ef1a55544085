//! Patches of neighbouring samples, to be left out together.
//!
//! Errors of neighbours are alike: they share springs, inferred places and the faults of the law. A sample left out alone is as good
//! as measured through its neighbours; a patch left out as a whole is not.

use nalgebra::Point3;

/// Rounds in which the centres move to the middle of their patches.
const ROUNDS: usize = 4;
/// Most patches.
const MOST: usize = 64;

/// The patch of each point, from 0, and their number: patches of about `radius_mm`, at least two where there are two points.
///
/// Centres are chosen one after the other, each the point farthest from those before (Gonzalez 1985), until every point lies within the
/// radius; then they move to the middles of the points nearest to them a few times (Lloyd 1982).
pub fn patches(points: &[Point3<f64>], radius_mm: f64) -> (Vec<usize>, usize) {
    if points.is_empty() {
        return (Vec::new(), 0);
    }
    let middle = points.iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / points.len() as f64;
    let far = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm_squared();
    let farthest =
        |distance: &[f64]| (0..distance.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
    let mut nearest: Vec<f64> = points.iter().map(|p| far(p, &middle.into())).collect();
    let mut centres = vec![points[farthest(&nearest)]];
    nearest = points.iter().map(|p| far(p, &centres[0])).collect();
    while centres.len() < MOST.min(points.len()) {
        let next = farthest(&nearest);
        if nearest[next] == 0.0 || (nearest[next] <= radius_mm * radius_mm && centres.len() > 1) {
            break;
        }
        centres.push(points[next]);
        for (d, p) in nearest.iter_mut().zip(points) {
            *d = d.min(far(p, &points[next]));
        }
    }
    let mut of = vec![0; points.len()];
    for round in 0..=ROUNDS {
        for (of, p) in of.iter_mut().zip(points) {
            *of = (0..centres.len()).min_by(|&a, &b| far(p, &centres[a]).total_cmp(&far(p, &centres[b]))).unwrap_or(0);
        }
        if round < ROUNDS {
            for (k, centre) in centres.iter_mut().enumerate() {
                let own: Vec<_> = points.iter().zip(&of).filter(|(_, of)| **of == k).map(|(p, _)| p.coords).collect();
                if !own.is_empty() {
                    *centre = (own.iter().sum::<nalgebra::Vector3<f64>>() / own.len() as f64).into();
                }
            }
        }
    }
    // A centre may have lost all its points: the numbers close up.
    let mut number = vec![usize::MAX; centres.len()];
    let mut count = 0;
    for of in &mut of {
        if number[*of] == usize::MAX {
            number[*of] = count;
            count += 1;
        }
        *of = number[*of];
    }
    (of, count)
}

/// Cuts patches in two, across their longest axis, as long as one holds `too_much` and has more than one member.
pub fn split_where(lists: &mut Vec<Vec<usize>>, points: &[Point3<f64>], too_much: impl Fn(&[usize]) -> bool) {
    let mut at = 0;
    while at < lists.len() {
        if lists[at].len() < 2 || !too_much(&lists[at]) {
            at += 1;
            continue;
        }
        let whole = &lists[at];
        let far = |a: usize, b: usize| (points[a] - points[b]).norm_squared();
        let from = |a: usize| whole.iter().copied().max_by(|&i, &j| far(a, i).total_cmp(&far(a, j))).unwrap_or(a);
        let one = from(whole[0]);
        let axis = points[from(one)] - points[one];
        let mut sorted = whole.clone();
        sorted.sort_by(|&i, &j| points[i].coords.dot(&axis).total_cmp(&points[j].coords.dot(&axis)));
        let half = sorted.split_off(sorted.len() / 2);
        lists[at] = sorted;
        lists.push(half);
    }
}

/// The members of each patch.
pub fn members(of: &[usize], count: usize) -> Vec<Vec<usize>> {
    let mut lists = vec![Vec::new(); count];
    for (i, &k) in of.iter().enumerate() {
        lists[k].push(i);
    }
    lists
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_heaps_are_two_patches() {
        let heap = |x: f64| (0..9).map(move |i| Point3::new(x + f64::from(i % 3), f64::from(i / 3), 0.0));
        let points: Vec<_> = heap(0.0).chain(heap(50.0)).collect();
        let (of, count) = patches(&points, 10.0);
        assert_eq!(count, 2);
        assert!(of[..9].iter().all(|k| *k == of[0]) && of[9..].iter().all(|k| *k == of[9]) && of[0] != of[9]);
    }

    #[test]
    fn patches_of_a_face_are_small_and_none_is_empty() {
        let face = crate::face::generic();
        let (of, count) = patches(face.mesh().positions(), 15.0);
        let lists = members(&of, count);
        let sizes: Vec<usize> = lists.iter().map(Vec::len).collect();
        assert!(count > 30 && count <= MOST && sizes.iter().all(|n| *n > 0 && *n < 40), "{sizes:?}");
        assert_eq!(sizes.iter().sum::<usize>(), 612);
    }

    #[test]
    fn a_patch_that_holds_too_much_is_cut_across_its_longest_axis() {
        let points: Vec<_> = (0..8).map(|i| Point3::new(f64::from(i), 0.1 * f64::from(i % 2), 0.0)).collect();
        let mut lists = vec![(0..8).rev().collect::<Vec<_>>()];
        split_where(&mut lists, &points, |members| members.len() > 3);
        for list in &mut lists {
            list.sort_unstable();
        }
        lists.sort();
        assert_eq!(lists, [[0, 1], [2, 3], [4, 5], [6, 7]]);
        split_where(&mut lists, &points, |_| true);
        assert_eq!(lists.len(), 8);
    }

    #[test]
    fn few_points_and_equal_points() {
        assert_eq!(patches(&[], 1.0).1, 0);
        assert_eq!(patches(&[Point3::origin(); 5], 1.0).1, 1);
        assert_eq!(patches(&[Point3::origin(), Point3::new(0.1, 0.0, 0.0)], 15.0).1, 2);
    }
}
