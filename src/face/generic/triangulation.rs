//! Constrained Delaunay triangulation of a few hundred points in the plane: drawn lines become edges, what is outside them goes.

/// Twice the signed area of a triangle; positive when counter-clockwise.
pub(super) fn doubled_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Triangulates `points` so that every one of `lines` is an edge, and keeps the triangles inside `outline` and outside `hole`.
///
/// Both are closed polygons of point indices whose sides are among `lines`. The order of the answer depends on the input alone.
pub(super) fn triangulate(
    points: &[[f64; 2]],
    lines: &[[usize; 2]],
    outline: &[usize],
    hole: &[usize],
) -> Vec<[usize; 3]> {
    let mut triangles = delaunay(points);
    for &line in lines {
        recover(points, &mut triangles, line);
    }
    let place = |polygon: &[usize]| polygon.iter().map(|&i| points[i]).collect::<Vec<_>>();
    let (outline, hole) = (place(outline), place(hole));
    triangles.retain(|t| {
        let middle = [0, 1].map(|axis| t.iter().map(|&i| points[i][axis]).sum::<f64>() / 3.0);
        contains(&outline, middle) && !contains(&hole, middle)
    });
    triangles
}

/// Delaunay triangulation by insertion. Source: Bowyer 1981, Watson 1981.
fn delaunay(points: &[[f64; 2]]) -> Vec<[usize; 3]> {
    let n = points.len();
    // A triangle around everything, far enough that its corners hardly bend the hull.
    let mut all = points.to_vec();
    all.extend([[-1e5, -1e5], [1e5, -1e5], [0.0, 1e5]]);
    let mut triangles = vec![[n, n + 1, n + 2]];
    for (i, &p) in points.iter().enumerate() {
        let (reached, kept): (Vec<_>, Vec<_>) = triangles.into_iter().partition(|t| in_circle(&all, *t, p));
        triangles = kept;
        let sides: Vec<_> = reached.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        triangles.extend(sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a])).map(|&[a, b]| [a, b, i]));
    }
    triangles.retain(|t| t.iter().all(|&i| i < n));
    triangles
}

/// Whether `p` lies inside the circle through the corners of a counter-clockwise triangle.
fn in_circle(points: &[[f64; 2]], t: [usize; 3], p: [f64; 2]) -> bool {
    let [a, b, c] = t.map(|i| {
        let (x, y) = (points[i][0] - p[0], points[i][1] - p[1]);
        [x, y, x * x + y * y]
    });
    let minor = |u: [f64; 3], v: [f64; 3]| u[0] * v[1] - u[1] * v[0];
    a[2] * minor(b, c) - b[2] * minor(a, c) + c[2] * minor(a, b) > 0.0
}

/// Flips the edges that cross `line` until it is an edge itself. Source: Sloan 1993.
fn recover(points: &[[f64; 2]], triangles: &mut [[usize; 3]], [from, to]: [usize; 2]) {
    // Every flip of a crossing edge brings the line nearer; the bound only guards against points that coincide.
    for _ in 0..triangles.len() * 4 {
        if triangles.iter().any(|t| t.contains(&from) && t.contains(&to)) {
            return;
        }
        let crossing = |a: usize, b: usize| {
            let cut = |p: usize, q: usize, r: usize, s: usize| {
                doubled_area(points[p], points[q], points[r]) * doubled_area(points[p], points[q], points[s]) < 0.0
            };
            cut(from, to, a, b) && cut(a, b, from, to)
        };
        let found = (0..triangles.len()).find_map(|t| {
            (0..3).find_map(|k| {
                let (a, b) = (triangles[t][k], triangles[t][(k + 1) % 3]);
                let u =
                    (0..triangles.len()).find(|&u| u != t && triangles[u].contains(&a) && triangles[u].contains(&b))?;
                crossing(a, b).then(|| flipped(points, triangles, t, k, u)).flatten().map(|new| (t, u, new))
            })
        });
        let Some((t, u, [new_t, new_u])) = found else { return };
        triangles[t] = new_t;
        triangles[u] = new_u;
    }
}

/// What replaces triangle `t` and its neighbour `u` across side `k` of `t` when the edge flips, if their union is convex.
pub(super) fn flipped(
    points: &[[f64; 2]],
    triangles: &[[usize; 3]],
    t: usize,
    k: usize,
    u: usize,
) -> Option<[[usize; 3]; 2]> {
    let [a, b, c] = [0, 1, 2].map(|j| triangles[t][(k + j) % 3]);
    let d = *triangles[u].iter().find(|&&i| i != a && i != b)?;
    let turns_left = |p: usize, q: usize, r: usize| doubled_area(points[p], points[q], points[r]) > 0.2;
    (turns_left(c, a, d) && turns_left(d, b, c)).then_some([[c, a, d], [d, b, c]])
}

/// Whether a closed polygon holds a point: an odd number of its sides lies to the right of it.
fn contains(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut inside = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) {
            inside = !inside;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_delaunay_would_not_draw_becomes_an_edge() {
        // A flat kite: the Delaunay diagonal is the short one (2–3), the line asks for the long one (0–1).
        let points = [[-3.0, 0.0], [3.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let outline = [0, 3, 1, 2];
        let free = triangulate(&points, &[], &outline, &[]);
        assert!(free.iter().all(|t| t.contains(&2) && t.contains(&3)));
        let bound = triangulate(&points, &[[0, 1]], &outline, &[]);
        assert_eq!(bound.len(), 2);
        assert!(bound.iter().all(|t| t.contains(&0) && t.contains(&1)));
        assert!(bound.iter().all(|t| doubled_area(points[t[0]], points[t[1]], points[t[2]]) > 0.0));
    }

    #[test]
    fn a_square_with_a_square_hole_keeps_its_area() {
        let points = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [1.0, 1.0], [3.0, 1.1], [3.0, 3.0], [1.0, 2.9]];
        let ring = |o: usize| (0..4).map(move |i| [o + i, o + (i + 1) % 4]);
        let lines: Vec<_> = ring(0).chain(ring(4)).collect();
        let triangles = triangulate(&points, &lines, &[0, 1, 2, 3], &[4, 5, 6, 7]);
        let area: f64 = triangles.iter().map(|t| doubled_area(points[t[0]], points[t[1]], points[t[2]]) / 2.0).sum();
        // Shoelace by hand for the hole: (1,1) (3,1.1) (3,3) (1,2.9) has area 3.8.
        assert!((area - (16.0 - 3.8)).abs() < 1e-12, "{area}");
        assert_eq!(triangles.len(), 8);
    }
}
