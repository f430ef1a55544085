//! Polygons cut into triangles: by the better diagonal, and never by one that runs outside a dent.

use nalgebra::{Point3, Vector3};

/// Most corners of a polygon that is accepted; the work grows with their square.
pub(super) const MOST_CORNERS: usize = 1000;
/// Up to so many corners the best of all possible cuts is taken each time, beyond it the first.
const CHOOSY: usize = 32;

/// Cuts one polygon (at least 3 corners) and adds its triangles; false where its outline crosses itself, so that a fan had to do.
pub(super) fn cut(corners: &[u32], positions: &[Point3<f64>], triangles: &mut Vec<[u32; 3]>) -> bool {
    let p = |i: u32| positions[i as usize];
    match *corners {
        [a, b, c] => {
            triangles.push([a, b, c]);
            true
        }
        [a, b, c, d] if a != c && b != d => {
            // A quadrilateral: the diagonal on both of whose sides the triangles face the same way, or else the shorter.
            let normal = newell(corners, positions);
            let faces = |x: u32, y: u32, z: u32| (p(y) - p(x)).cross(&(p(z) - p(x))).dot(&normal) > 0.0;
            let by_ac = faces(a, b, c) && faces(a, c, d);
            let by_bd = faces(b, c, d) && faces(b, d, a);
            let shorter = (p(a) - p(c)).norm_squared() <= (p(b) - p(d)).norm_squared();
            let cut = if by_ac == by_bd { shorter } else { by_ac };
            triangles.extend(if cut { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] });
            by_ac || by_bd
        }
        _ => cut_ears(corners, positions, triangles),
    }
}

/// Sum of the cross products along the outline: across the polygon, also where it is not flat.
fn newell(corners: &[u32], positions: &[Point3<f64>]) -> Vector3<f64> {
    let Some(&first) = corners.first() else { return Vector3::zeros() };
    let origin = positions[first as usize];
    let from = |i: u32| positions[i as usize] - origin;
    corners.windows(2).map(|w| from(w[0]).cross(&from(w[1]))).sum()
}

fn cut_ears(corners: &[u32], positions: &[Point3<f64>], triangles: &mut Vec<[u32; 3]>) -> bool {
    let normal = newell(corners, positions);
    let Some(up) = normal.try_normalize(f64::MIN_POSITIVE) else {
        fan(corners, triangles);
        return false;
    };
    let across = if up.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let u = across.cross(&up).normalize();
    let v = up.cross(&u);
    let flat: Vec<[f64; 2]> =
        corners.iter().map(|&i| positions[i as usize].coords).map(|x| [x.dot(&u), x.dot(&v)]).collect();
    let doubled = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let mut left: Vec<usize> = (0..corners.len()).collect();
    while left.len() > 3 {
        let n = left.len();
        let ear = |k: usize| -> Option<f64> {
            let [i, j, l] = [left[(k + n - 1) % n], left[k], left[(k + 1) % n]];
            let (a, b, c) = (flat[i], flat[j], flat[l]);
            let area = doubled(a, b, c);
            if area <= 0.0 {
                return None;
            }
            let inside = |q: [f64; 2]| doubled(a, b, q) >= 0.0 && doubled(b, c, q) >= 0.0 && doubled(c, a, q) >= 0.0;
            let blocked =
                left.iter().any(|&m| ![i, j, l].contains(&m) && flat[m] != a && flat[m] != c && inside(flat[m]));
            let side = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
            let longest = side(a, b).max(side(b, c)).max(side(c, a));
            // Area over the longest side squared: the flatter the worse.
            (!blocked).then(|| area / (longest * longest))
        };
        let found = if n <= CHOOSY {
            (0..n)
                .filter_map(|k| ear(k).map(|quality| (quality, k)))
                .fold(None, |best: Option<(f64, usize)>, e| if best.is_none_or(|b| e.0 > b.0) { Some(e) } else { best })
        } else {
            (0..n).find_map(|k| ear(k).map(|quality| (quality, k)))
        };
        let Some((_, k)) = found else {
            let rest: Vec<u32> = left.iter().map(|&i| corners[i]).collect();
            fan(&rest, triangles);
            return false;
        };
        triangles.push([left[(k + n - 1) % n], left[k], left[(k + 1) % n]].map(|i| corners[i]));
        left.remove(k);
    }
    triangles.push([corners[left[0]], corners[left[1]], corners[left[2]]]);
    true
}

fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend(corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(t: &[[u32; 3]], p: &[Point3<f64>]) -> f64 {
        t.iter()
            .map(|&[a, b, c]| [a, b, c].map(|i| p[i as usize]))
            .map(|[a, b, c]| (b - a).cross(&(c - a)).z / 2.0)
            .sum()
    }

    fn flat(points: &[[f64; 2]]) -> Vec<Point3<f64>> {
        points.iter().map(|p| Point3::new(p[0], p[1], 0.0)).collect()
    }

    #[test]
    fn a_concave_quadrilateral_is_cut_at_its_dent() {
        // An arrow head: the corner (1, 1) is the dent; the diagonal 0–2 would run outside.
        let p = flat(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]]);
        for turn in 0..4_u32 {
            let corners = [0, 1, 2, 3].map(|i: u32| (i + turn) % 4);
            let mut t = Vec::new();
            assert!(cut(&corners, &p, &mut t));
            // Both triangles have the corner of the dent and the one opposite; 2 · ½ · 4 · 1 = 4.
            assert!(t.iter().all(|t| t.contains(&0) && t.contains(&2)), "{t:?}");
            assert!(t.iter().all(|t| area(&[*t], &p) > 0.0) && (area(&t, &p) - 4.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_convex_quadrilateral_is_cut_by_its_shorter_diagonal() {
        let p = flat(&[[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [1.0, 1.0]]);
        let mut t = Vec::new();
        assert!(cut(&[0, 1, 2, 3], &p, &mut t));
        assert_eq!(t, [[1, 2, 3], [1, 3, 0]]);
    }

    #[test]
    fn a_comb_keeps_its_area_and_no_triangle_is_turned() {
        // Six teeth of 1 × 3 on a back of 11 × 1: area 6 · 3 + 11 = 29.
        let mut outline = vec![[0.0, 0.0], [11.0, 0.0]];
        for tooth in (0..6).rev() {
            let x = 2.0 * f64::from(tooth);
            outline.extend([[x + 1.0, 4.0], [x, 4.0]]);
            if tooth > 0 {
                outline.extend([[x, 1.0], [x - 1.0, 1.0]]);
            }
        }
        let p = flat(&outline);
        let corners: Vec<u32> = (0..p.len() as u32).collect();
        let mut t = Vec::new();
        assert!(cut(&corners, &p, &mut t));
        assert_eq!(t.len(), p.len() - 2);
        assert!(t.iter().all(|t| area(&[*t], &p) >= 0.0) && (area(&t, &p) - 29.0).abs() < 1e-12);
        // The same standing on its edge, and long enough for the quick way.
        let many: Vec<Point3<f64>> = (0..200)
            .map(|i| f64::from(i) / 200.0 * std::f64::consts::TAU)
            .map(|a| Point3::new(0.0, a.cos(), a.sin() * (1.0 + 0.5 * (9.0 * a).cos())))
            .collect();
        let mut t = Vec::new();
        assert!(cut(&(0..200).collect::<Vec<u32>>(), &many, &mut t));
        assert_eq!(t.len(), 198);
    }

    #[test]
    fn an_outline_that_crosses_itself_or_has_no_area_becomes_a_fan() {
        let star = flat(&[[0.0, 1.0], [0.6, -0.8], [-0.95, 0.3], [0.95, 0.3], [-0.6, -0.8]]);
        let line = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]]);
        let mut t = Vec::new();
        cut(&[0, 1, 2, 3, 4], &star, &mut t);
        assert!(!cut(&[0, 1, 2, 3, 4], &line, &mut t));
        assert_eq!(t.len(), 6);
    }
}
