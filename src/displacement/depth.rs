//! How deep a point of the last frame lies on its ray: one camera does not see depth (E23), so a rule decides.

use nalgebra::{Matrix3, Matrix3x2, Point3, Vector3};

use crate::camera::Ray;
use crate::face::mesh::NONE;
use crate::face::{Mesh, Skull};

/// A marked point brought back into face space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Where it is, mm.
    pub position: Point3<f64>,
    /// How it follows the mark: ∂x/∂p, mm per px.
    pub slope_mm_per_px: Matrix3x2<f64>,
    /// Whether it lies on the mesh; false beyond a border, where the nearest triangle's plane was continued.
    pub on_surface: bool,
    /// The triangle it was found in; [`NONE`] where no surface was asked.
    pub triangle: u32,
}

/// Where a ray meets the plane through `q` with normal `n`, and how that follows the ray's direction.
///
/// x = o + t d with t = n·(q − o) / n·d;  ∂x/∂d = t (I − d nᵀ / n·d). Absent where the ray runs along the plane.
pub fn meet_plane(ray: &Ray, slope: &Matrix3x2<f64>, q: &Point3<f64>, n: &Vector3<f64>) -> Option<Placed> {
    let along = n.dot(&ray.direction);
    if along.abs() <= 1e-9 * n.norm() * ray.direction.norm() {
        return None;
    }
    let t = n.dot(&(q - ray.origin)) / along;
    let follow = (Matrix3::identity() - ray.direction * n.transpose() / along) * t;
    Some(Placed {
        position: ray.origin + ray.direction * t,
        slope_mm_per_px: follow * slope,
        on_surface: true,
        triangle: NONE,
    })
}

/// The point keeps the depth it had in the first frame. Thesis (4.8).
///
/// `slope` is the change of the ray's direction with the pixel, in the same frame as the ray.
pub fn fixed_depth(ray: &Ray, slope: &Matrix3x2<f64>, z_mm: f64) -> Option<Placed> {
    meet_plane(ray, slope, &Point3::new(0.0, 0.0, z_mm), &Vector3::z())
}

/// The point slides on the first frame's surface: the ray meets the mesh, looked for by walking from the triangle `start`.
///
/// Started where a neighbour was found, the walk is a step or two however fine the mesh.
/// Beyond a border the plane of the last triangle is continued. Absent only for a ray that runs along that plane.
pub fn slide_on_surface(
    ray: &Ray,
    slope: &Matrix3x2<f64>,
    mesh: &Mesh,
    positions: &[Point3<f64>],
    start: u32,
) -> Option<Placed> {
    let (triangle, inside) = walk(ray, mesh, positions, start)?;
    let t = mesh.triangles()[triangle as usize];
    let normal = crate::face::mesh::doubled_area_vector(positions, t);
    let placed = meet_plane(ray, slope, &positions[t[0] as usize], &normal)?;
    Some(Placed { on_surface: inside, triangle, ..placed })
}

/// Farther from the place at the first frame's depth no level is looked for, mm.
const FARTHEST_MM: f64 = 25.0;
/// Longest step of the search along the ray, mm.
const LONGEST_MM: f64 = 5.0;
/// How far from its level a point may be left, mm.
const OFF_MM: f64 = 1e-9;

/// The point keeps the height above the surface that it had at `from` (mm): the ray meets the level set of that height, looked for from the place
/// at the depth of `from` by Newton's method.
///
/// φ(o + t d) = φ(from);  ∂x/∂d as for the plane through x with the normal ∇φ. Where no such place is found within 25 mm, the point keeps its depth,
/// and `on_surface` is false.
pub fn keep_height(ray: &Ray, slope: &Matrix3x2<f64>, surface: &Skull, from: &Point3<f64>) -> Option<Placed> {
    let fixed = fixed_depth(ray, slope, from.z)?;
    let (height, _) = surface.slope(from);
    let unit = ray.direction.norm();
    let mut x = fixed.position;
    for _ in 0..40 {
        let (value, normal) = surface.slope(&x);
        let along = normal.dot(&ray.direction) / unit;
        let off = height - value;
        if off.abs() <= OFF_MM * normal.norm() {
            return meet_plane(ray, slope, &x, &normal);
        }
        // No number where the ray runs along the level; then nothing is found.
        let step = (off / along).clamp(-LONGEST_MM, LONGEST_MM);
        x += ray.direction * (step / unit);
        let away = (x - fixed.position).norm();
        if away > FARTHEST_MM || away.is_nan() {
            break;
        }
    }
    Some(Placed { on_surface: false, ..fixed })
}

/// The share of the way to the kept height, and the largest change of depth for a millimetre aside.
const HALF: f64 = 0.5;

/// Half of the way in depth from that of the first frame to where the point would keep its height, never more than half as far as it went aside.
///
/// z = z₀ + ½ (z_h − z₀), |z − z₀| ≤ ½ ‖(x, y) − (x₀, y₀)‖ with (x, y) at the depth z₀.
pub fn half_way(ray: &Ray, slope: &Matrix3x2<f64>, surface: &Skull, from: &Point3<f64>) -> Option<Placed> {
    let fixed = fixed_depth(ray, slope, from.z)?;
    let kept = keep_height(ray, slope, surface, from)?;
    let deeper = HALF * (kept.position.z - from.z);
    let aside = (fixed.position - from).xy();
    let most = HALF * aside.norm();
    let (change, follows) = if deeper.abs() <= most {
        (deeper, kept.slope_mm_per_px.row(2) * HALF)
    } else {
        let way = aside.try_normalize(0.0).unwrap_or_default() * (HALF * deeper.signum());
        (most * deeper.signum(), way.transpose() * fixed.slope_mm_per_px.fixed_rows::<2>(0))
    };
    let there = fixed_depth(ray, slope, from.z + change)?;
    let slope_mm_per_px = there.slope_mm_per_px + ray.direction / ray.direction.z * follows;
    Some(Placed { slope_mm_per_px, on_surface: kept.on_surface, ..there })
}

/// The triangle that the ray passes through, and whether it does (false: the last one before a border).
///
/// Each step leaves across the side whose volume with the ray is most negative; a walk that does not end within a
/// generous number of steps (a fold in the way) gives way to a look at every triangle.
fn walk(ray: &Ray, mesh: &Mesh, positions: &[Point3<f64>], start: u32) -> Option<(u32, bool)> {
    let mut here = start;
    let longest = 64 + 4 * (mesh.triangles().len() as f64).sqrt() as usize;
    for _ in 0..longest {
        let t = mesh.triangles()[here as usize];
        let volumes = side_volumes(ray, positions, t);
        let total: f64 = volumes.iter().sum();
        // Seen from behind all signs turn; dividing by the total's sign turns them back.
        let [k, worst] = (0..3).fold([0.0, f64::INFINITY], |best, k| {
            let v = volumes[k] * total.signum();
            if v < best[1] { [k as f64, v] } else { best }
        });
        if worst >= 0.0 {
            return Some((here, true));
        }
        // Side k is opposite corner k.
        let k = k as usize;
        match across(mesh, here, t[(k + 1) % 3], t[(k + 2) % 3]) {
            NONE => return nearest_hit(ray, mesh, positions).map(|t| (t, true)).or(Some((here, false))),
            next => here = next,
        }
    }
    nearest_hit(ray, mesh, positions).map(|t| (t, true)).or(Some((here, false)))
}

/// Six times the signed volumes that the ray spans with each side; side k is opposite corner k.
fn side_volumes(ray: &Ray, positions: &[Point3<f64>], t: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = t.map(|i| positions[i as usize] - ray.origin);
    let d = -ray.direction;
    [d.dot(&b.cross(&c)), d.dot(&c.cross(&a)), d.dot(&a.cross(&b))]
}

fn across(mesh: &Mesh, here: u32, p: u32, q: u32) -> u32 {
    let of_q = mesh.triangles_of_vertex(q as usize);
    let shared = mesh.triangles_of_vertex(p as usize).iter().find(|t| **t != here && of_q.contains(t));
    shared.copied().unwrap_or(NONE)
}

/// Among all triangles that the ray passes through, the one nearest to its origin.
fn nearest_hit(ray: &Ray, mesh: &Mesh, positions: &[Point3<f64>]) -> Option<u32> {
    let mut best: Option<(f64, u32)> = None;
    for (i, &t) in mesh.triangles().iter().enumerate() {
        let v = side_volumes(ray, positions, t);
        let total: f64 = v.iter().sum();
        if total == 0.0 || v.iter().any(|v| v * total < 0.0) {
            continue;
        }
        let normal = crate::face::mesh::doubled_area_vector(positions, t);
        let distance = normal.dot(&(positions[t[0] as usize] - ray.origin)) / normal.dot(&ray.direction);
        if distance > 0.0 && best.is_none_or(|b| distance < b.0) {
            best = Some((distance, i as u32));
        }
    }
    best.map(|b| b.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::face::patches::right_angled;
    use nalgebra::{Point2, Vector2};

    fn camera() -> Camera {
        Camera { principal_point_px: Point2::new(500.0, 500.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 }
    }

    /// A dome z = −r²/100 over a 9 × 9 grid of pitch 5 mm.
    fn dome() -> Mesh {
        let flat = right_angled(9, 9, 5.0, 5.0);
        let bend = |p: &Point3<f64>| {
            let (x, y) = (p.x - 20.0, p.y - 20.0);
            Point3::new(x, y, -(x * x + y * y) / 100.0)
        };
        flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap()
    }

    #[test]
    fn a_point_of_the_surface_is_found_again_from_any_start() {
        let mesh = dome();
        let x = mesh.positions();
        for target in [[0_usize, 1, 10], [40, 41, 50], [70, 71, 80], [12, 13, 22]] {
            let p = Point3::from(target.iter().map(|&i| x[i].coords).sum::<Vector3<f64>>() / 3.0);
            let ray = camera().ray(&camera().image_from_face(&p));
            for start in [0, 60, 127] {
                let hit = slide_on_surface(&ray, &camera().ray_slope(), &mesh, x, start).unwrap();
                assert!(hit.on_surface && (hit.position - p).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn beyond_the_border_the_plane_goes_on_and_says_so() {
        let mesh = dome();
        let ray = camera().ray(&Point2::new(500.0, 500.0 + 4.0 * 23.0));
        let hit = slide_on_surface(&ray, &camera().ray_slope(), &mesh, mesh.positions(), 40).unwrap();
        assert!(!hit.on_surface && (hit.position.y + 23.0).abs() < 0.5 && hit.position.z < -3.5);
    }

    #[test]
    fn slopes_agree_with_central_differences_for_both_rules() {
        let mesh = dome();
        let p = Point2::new(521.0, 467.0);
        let place = |p: Point2<f64>, fixed: bool| {
            let ray = camera().ray(&p);
            if fixed {
                fixed_depth(&ray, &camera().ray_slope(), -3.0).unwrap()
            } else {
                slide_on_surface(&ray, &camera().ray_slope(), &mesh, mesh.positions(), 40).unwrap()
            }
        };
        for fixed in [true, false] {
            for (axis, e) in [Vector2::x(), Vector2::y()].into_iter().enumerate() {
                let h = 1e-3;
                let d = (place(p + e * h, fixed).position - place(p - e * h, fixed).position) / (2.0 * h);
                assert!((d - place(p, fixed).slope_mm_per_px.column(axis)).norm() < 1e-8);
            }
        }
        // Thesis (4.8) by hand: z = −3 mm is 1003 mm from the camera: x = 21/4 · 1.003.
        let by_hand = Point3::new(21.0 / 4.0 * 1.003, 33.0 / 4.0 * 1.003, -3.0);
        assert!((place(p, true).position - by_hand).norm() < 1e-9);
    }

    /// On a ball every point that keeps its height stays at its distance from the middle. (The smooth surface bends a little with the mesh.)
    #[test]
    fn a_point_that_keeps_its_height_over_a_ball_keeps_its_radius() {
        let flat = right_angled(21, 21, 5.0, 5.0);
        let ball = |p: &Point3<f64>| {
            let (x, y) = (p.x - 50.0, p.y - 50.0);
            Point3::new(x, y, (1e4 - x * x - y * y).sqrt() - 100.0)
        };
        let mesh = flat.with_positions(flat.positions().iter().map(ball).collect()).unwrap();
        let surface = Skull::new(&mesh, mesh.positions());
        let middle = Point3::new(0.0, 0.0, -100.0);
        for (from, over) in [(220, 0.0), (200, 3.0), (268, -2.0)] {
            let rest = mesh.positions()[from];
            let rest = middle + (rest - middle) * (1.0 + 0.01 * over);
            let moved = Point3::new(rest.x + 6.0, rest.y + 8.0, 0.0);
            let z = (((rest - middle).norm_squared() - moved.x * moved.x - moved.y * moved.y).sqrt()) - 100.0;
            let truth = Point3::new(moved.x, moved.y, z);
            let ray = camera().ray(&camera().image_from_face(&truth));
            let found = keep_height(&ray, &camera().ray_slope(), &surface, &rest).unwrap();
            assert!(found.on_surface && (found.position - truth).norm() < 0.15, "{from}: {}", found.position - truth);
            assert!((surface.slope(&found.position).0 - surface.slope(&rest).0).abs() < 1e-8);
            // Half of that depth, on the same ray.
            let half = half_way(&ray, &camera().ray_slope(), &surface, &rest).unwrap().position;
            assert!((half.z - 0.5 * (found.position.z + rest.z)).abs() < 1e-9);
            assert!((camera().image_from_face(&half) - camera().image_from_face(&truth)).norm() < 1e-9);
        }
    }

    #[test]
    fn a_point_that_went_nowhere_stays_and_one_that_leaves_every_level_keeps_its_depth() {
        let mesh = dome();
        let surface = Skull::new(&mesh, mesh.positions());
        let rest = mesh.positions()[30];
        let ray = camera().ray(&camera().image_from_face(&rest));
        for rule in [keep_height, half_way] {
            let there = rule(&ray, &camera().ray_slope(), &surface, &rest).unwrap();
            assert!(there.on_surface && (there.position - rest).norm() < 1e-8);
        }
        // From the foot of a steep roof to under its ridge: the level lies 40 mm above.
        let flat = right_angled(9, 9, 5.0, 5.0);
        let bend = |p: &Point3<f64>| Point3::new(p.x - 20.0, p.y - 20.0, -(p.x - 20.0).powi(2) / 10.0);
        let roof = flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap();
        let surface = Skull::new(&roof, roof.positions());
        let rest = roof.positions()[44];
        assert!((rest - Point3::new(20.0, 0.0, -40.0)).norm() < 1e-12);
        let ray = camera().ray(&camera().image_from_face(&Point3::new(1.0, 0.0, -40.0)));
        let lost = keep_height(&ray, &camera().ray_slope(), &surface, &rest).unwrap();
        assert!(!lost.on_surface && (lost.position.z - rest.z).abs() < 1e-9);
        let half = half_way(&ray, &camera().ray_slope(), &surface, &rest).unwrap();
        assert!(!half.on_surface && (half.position.z - rest.z).abs() < 1e-9);
    }

    /// Also where the change of depth is held at half of the way aside: the dome is steep at its corner.
    #[test]
    fn slopes_over_a_smooth_surface_agree_with_central_differences() {
        let flat = right_angled(9, 9, 5.0, 5.0);
        let bend = |p: &Point3<f64>| Point3::new(p.x - 20.0, p.y - 20.0, -(p.x - 20.0).powi(2) / 10.0);
        let steep = flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap();
        for (mesh, from) in [(dome(), 31), (steep, 42)] {
            let surface = Skull::new(&mesh, mesh.positions());
            let rest = mesh.positions()[from];
            let p = camera().image_from_face(&rest) + Vector2::new(9.0, -4.0);
            for rule in [keep_height, half_way] {
                let place = |p: Point2<f64>| rule(&camera().ray(&p), &camera().ray_slope(), &surface, &rest).unwrap();
                assert!(place(p).on_surface);
                for (axis, e) in [Vector2::x(), Vector2::y()].into_iter().enumerate() {
                    let h = 1e-3;
                    let d = (place(p + e * h).position - place(p - e * h).position) / (2.0 * h);
                    assert!((d - place(p).slope_mm_per_px.column(axis)).norm() < 1e-5);
                }
            }
        }
        // The second is held: half of the way to its level is deeper than half of the way aside.
        let bent = flat.with_positions(flat.positions().iter().map(bend).collect()).unwrap();
        let surface = Skull::new(&bent, bent.positions());
        let rest = bent.positions()[42];
        let ray = camera().ray(&(camera().image_from_face(&rest) + Vector2::new(9.0, -4.0)));
        let at = |rule: fn(&Ray, &Matrix3x2<f64>, &Skull, &Point3<f64>) -> Option<Placed>| {
            rule(&ray, &camera().ray_slope(), &surface, &rest).unwrap().position
        };
        let aside = (fixed_depth(&ray, &camera().ray_slope(), rest.z).unwrap().position - rest).xy().norm();
        assert!((at(keep_height).z - rest.z).abs() > aside);
        assert!(((at(half_way).z - rest.z).abs() - 0.5 * aside).abs() < 1e-9);
    }
}
