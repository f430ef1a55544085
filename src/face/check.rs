//! What makes a face model fit for the chain: one clean surface with well-shaped triangles, exact symmetry, nothing unbound.

use std::collections::BTreeMap;
use std::fmt;

use nalgebra::Point3;

use super::mesh::{NONE, doubled_area_vector};
use super::{FaceModel, Mesh};

/// What a face model should have; counts that are `None` are reported, not judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectations {
    /// Number of vertices.
    pub vertices: Option<usize>,
    /// Number of triangles.
    pub triangles: Option<usize>,
    /// Number of closed border lines: the rim and each opening.
    pub borders: Option<usize>,
    /// Number of landmarks.
    pub landmarks: Option<usize>,
    /// Number of muscles.
    pub muscles: Option<usize>,
    /// Least angle of a triangle, degrees (default 15): sharper ones make stiff, noisy springs.
    pub smallest_angle_deg: f64,
    /// Largest angle of a triangle, degrees (default 140).
    pub largest_angle_deg: f64,
    /// Largest ratio of the areas of two triangles that share an edge; `None` is reported, not judged.
    pub largest_area_ratio: Option<f64>,
    /// Farthest that a vertex may lie from the mirror image of its partner, mm (default 1e-9).
    pub mirror_mm: f64,
    /// Whether the triangles must be mirrored too (default true); if not, a diagonal cut the other way is only named.
    pub mirrored_triangles: bool,
}

impl Default for Expectations {
    fn default() -> Self {
        Self {
            vertices: None,
            triangles: None,
            borders: None,
            landmarks: None,
            muscles: None,
            smallest_angle_deg: 15.0,
            largest_angle_deg: 140.0,
            largest_area_ratio: None,
            mirror_mm: 1e-9,
            mirrored_triangles: true,
        }
    }
}

impl Expectations {
    /// What the chain needs of any face: triangles that are not mere lines, and halves that look alike.
    pub fn imported() -> Self {
        Self {
            smallest_angle_deg: 0.1,
            largest_angle_deg: 179.7,
            mirror_mm: 3.0,
            mirrored_triangles: false,
            ..Self::default()
        }
    }

    /// What the generic face must have: a rim, two eyes and a mouth are its four borders.
    pub fn generic() -> Self {
        Self {
            vertices: Some(612),
            triangles: Some(1128),
            borders: Some(4),
            landmarks: Some(32),
            muscles: Some(18),
            smallest_angle_deg: 20.0,
            largest_angle_deg: 130.0,
            largest_area_ratio: Some(4.0),
            ..Self::default()
        }
    }
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// As it should be.
    Passed,
    /// The chain runs, with a loss that is named.
    Warning,
    /// Results on this face would be wrong.
    Failed,
}

/// One line of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How the check ended.
    pub severity: Severity,
    /// What was found.
    pub what: String,
    /// The place, if there is one: a triangle, a vertex.
    pub where_: String,
}

/// Everything that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Report {
    /// One a check, and one a fault.
    pub findings: Vec<Finding>,
}

impl Report {
    /// Whether nothing failed.
    pub fn ok(&self) -> bool {
        self.findings.iter().all(|f| f.severity < Severity::Failed)
    }

    fn push(&mut self, severity: Severity, what: String, where_: impl Into<String>) {
        self.findings.push(Finding { severity, what, where_: where_.into() });
    }

    fn judge(&mut self, passed: bool, what: String, where_: impl Into<String>) {
        self.push(if passed { Severity::Passed } else { Severity::Failed }, what, where_);
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for finding in &self.findings {
            let word = match finding.severity {
                Severity::Passed => "ok     ",
                Severity::Warning => "warning",
                Severity::Failed => "FAILED ",
            };
            write!(f, "{word}  {}", finding.what)?;
            if !finding.where_.is_empty() {
                write!(f, " ({})", finding.where_)?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Checks a face model of any size.
pub fn check(face: &FaceModel) -> Report {
    check_against(face, &Expectations::default())
}

/// Checks a face model, its counts included.
pub fn check_against(face: &FaceModel, expected: &Expectations) -> Report {
    let mut report = Report::default();
    let mesh = face.mesh();
    counted(&mut report, mesh.len(), expected.vertices, "vertices");
    counted(&mut report, mesh.triangles().len(), expected.triangles, "triangles");
    surface(&mut report, mesh);
    orientation(&mut report, mesh);
    borders(&mut report, mesh, expected);
    angles(&mut report, mesh, expected);
    areas(&mut report, mesh, expected);
    symmetry(&mut report, face, expected);
    landmarks(&mut report, face, expected);
    muscles(&mut report, face, expected);
    report
}

fn counted(report: &mut Report, found: usize, expected: Option<usize>, what: &str) {
    match expected {
        Some(n) if n != found => report.judge(false, format!("{found} {what}, expected {n}"), ""),
        _ => report.judge(true, format!("{found} {what}"), ""),
    }
}

/// One piece, every vertex used, and at every vertex one fan of triangles (no two cones that touch at their tips).
fn surface(report: &mut Report, mesh: &Mesh) {
    let n = mesh.len();
    let mut piece = vec![NONE; n];
    let mut pieces = 0;
    let mut unused = None;
    for start in 0..n {
        if mesh.neighbours(start).is_empty() {
            unused = unused.or(Some(start));
        } else if piece[start] == NONE {
            let mut waiting = vec![start];
            piece[start] = pieces;
            while let Some(v) = waiting.pop() {
                for &w in mesh.neighbours(v) {
                    if piece[w as usize] == NONE {
                        piece[w as usize] = pieces;
                        waiting.push(w as usize);
                    }
                }
            }
            pieces += 1;
        }
    }
    if let Some(v) = unused {
        report.push(Severity::Failed, "a vertex belongs to no triangle".to_owned(), format!("vertex {v}"));
    }
    let euler = (n + mesh.triangles().len()).cast_signed() - mesh.edges().len().cast_signed();
    report.judge(
        pieces == 1,
        format!("{pieces} connected surface{}", if pieces == 1 { "" } else { "s" }),
        format!("{} edges, V − E + F = {euler}", mesh.edges().len()),
    );
    // At a vertex with d edges, one fan has d triangles when closed and d − 1 when it ends on a border.
    let mut ends = vec![0_usize; n];
    for (edge, sides) in mesh.edges().iter().zip(mesh.triangles_of_edge()) {
        if sides[1] == NONE {
            ends[edge[0] as usize] += 1;
            ends[edge[1] as usize] += 1;
        }
    }
    let pinched: Vec<usize> = (0..n)
        .filter(|&v| {
            let (edges, triangles) = (mesh.neighbours(v).len(), mesh.triangles_of_vertex(v).len());
            ends[v] > 2 || (ends[v] == 0 && fans(mesh, v) > 1) || edges.saturating_sub(triangles) > 1
        })
        .collect();
    match pinched.first() {
        None => report.judge(true, "a manifold: at most two triangles at an edge, one fan at a vertex".to_owned(), ""),
        Some(v) => report.judge(
            false,
            format!("{} vertices where the surface touches itself", pinched.len()),
            format!("first at vertex {v}"),
        ),
    }
}

/// Number of separate fans of triangles at a vertex.
fn fans(mesh: &Mesh, v: usize) -> usize {
    let mut left: Vec<[u32; 3]> = mesh.triangles_of_vertex(v).iter().map(|&t| mesh.triangles()[t as usize]).collect();
    let mut fans = 0;
    while let Some(first) = left.pop() {
        fans += 1;
        let mut reached: Vec<u32> = first.to_vec();
        while let Some(k) = left.iter().position(|t| t.iter().any(|&i| i as usize != v && reached.contains(&i))) {
            reached.extend(left.swap_remove(k));
        }
    }
    fans
}

/// Two triangles that share an edge must run along it in opposite directions.
fn orientation(report: &mut Report, mesh: &Mesh) {
    let runs = |t: u32, [a, b]: [u32; 2]| {
        let c = mesh.triangles()[t as usize];
        (0..3).any(|k| c[k] == a && c[(k + 1) % 3] == b)
    };
    let bad = mesh
        .edges()
        .iter()
        .zip(mesh.triangles_of_edge())
        .find(|&(&edge, sides)| sides[1] != NONE && runs(sides[0], edge) == runs(sides[1], edge));
    match bad {
        None => report.judge(true, "consistently oriented".to_owned(), ""),
        Some((_, [t, u])) => {
            report.judge(
                false,
                "neighbouring triangles face opposite ways".to_owned(),
                format!("triangles {t} and {u}"),
            );
        }
    }
}

/// A closed line of edges that have a triangle on one side only.
#[derive(Clone, Debug, PartialEq)]
pub struct Border {
    /// Its vertices in order, the surface to the left.
    pub vertices: Vec<u32>,
    /// Its length, mm.
    pub length_mm: f64,
}

/// The borders of a mesh, longest first: the rim, then the openings.
pub fn borders_of(mesh: &Mesh) -> Vec<Border> {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (&[a, b], sides) in mesh.edges().iter().zip(mesh.triangles_of_edge()) {
        if sides[1] == NONE {
            let t = mesh.triangles()[sides[0] as usize];
            let forward = (0..3).any(|k| t[k] == a && t[(k + 1) % 3] == b);
            let (from, to) = if forward { (a, b) } else { (b, a) };
            next.entry(from).or_default().push(to);
        }
    }
    let mut borders = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut vertices = vec![start];
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            if next.get(&at).is_some_and(Vec::is_empty) {
                next.remove(&at);
            }
            at = to;
            if at == start {
                break;
            }
            vertices.push(at);
        }
        // A start whose list is used up is gone; one that never had a way on must go too.
        if next.get(&start).is_some_and(Vec::is_empty) {
            next.remove(&start);
        }
        let p = |i: usize| mesh.positions()[vertices[i % vertices.len()] as usize];
        let length_mm = (0..vertices.len()).map(|i| (p(i + 1) - p(i)).norm()).sum();
        borders.push(Border { vertices, length_mm });
    }
    borders.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm));
    borders
}

fn borders(report: &mut Report, mesh: &Mesh, expected: &Expectations) {
    let borders = borders_of(mesh);
    let list: Vec<String> =
        borders.iter().map(|b| format!("{} edges, {:.0} mm", b.vertices.len(), b.length_mm)).collect();
    let n = borders.len();
    let wanted = expected.borders.filter(|&e| e != n);
    let what = wanted.map_or_else(|| format!("{n} borders"), |e| format!("{n} borders, expected {e}"));
    report.judge(wanted.is_none(), what, list.join("; "));
}

/// Angles of a triangle at its three corners, degrees.
pub fn angles_deg(positions: &[Point3<f64>], triangle: [u32; 3]) -> [f64; 3] {
    let p = triangle.map(|i| positions[i as usize]);
    [0, 1, 2].map(|k| {
        let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
        u.cross(&v).norm().atan2(u.dot(&v)).to_degrees()
    })
}

fn angles(report: &mut Report, mesh: &Mesh, expected: &Expectations) {
    let (mut smallest, mut largest) = ((f64::INFINITY, 0), (0.0, 0));
    for (t, &triangle) in mesh.triangles().iter().enumerate() {
        for angle in angles_deg(mesh.positions(), triangle) {
            if angle < smallest.0 {
                smallest = (angle, t);
            }
            if angle > largest.0 {
                largest = (angle, t);
            }
        }
    }
    for ((angle, t), word, limit, passed) in [
        (smallest, "smallest", expected.smallest_angle_deg, smallest.0 >= expected.smallest_angle_deg),
        (largest, "largest", expected.largest_angle_deg, largest.0 <= expected.largest_angle_deg),
    ] {
        report.judge(
            passed,
            format!("{word} angle {angle:.1}°, limit {limit:.0}°"),
            format!("triangle {t}: vertices {:?}", mesh.triangles()[t]),
        );
    }
}

/// Neighbour triangles of very different size make springs of very different strength side by side.
fn areas(report: &mut Report, mesh: &Mesh, expected: &Expectations) {
    let area = |t: u32| doubled_area_vector(mesh.positions(), mesh.triangles()[t as usize]).norm();
    let ratio = |sides: &[u32; 2]| {
        let (a, b) = (area(sides[0]), area(sides[1]));
        if a > b { a / b } else { b / a }
    };
    let inside = mesh.triangles_of_edge().iter().filter(|sides| sides[1] != NONE);
    let Some((sides, worst)) = inside.map(|s| (s, ratio(s))).max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let limit = expected.largest_area_ratio;
    let stated = limit.map_or_else(String::new, |l| format!(", limit {l}"));
    report.judge(
        limit.is_none_or(|l| worst <= l),
        format!("neighbour triangles differ in area by {worst:.1} times at most{stated}"),
        format!("triangles {} and {}", sides[0], sides[1]),
    );
}

fn symmetry(report: &mut Report, face: &FaceModel, expected: &Expectations) {
    let (mesh, mirror) = (face.mesh(), face.mirror());
    let alone = mirror.iter().filter(|m| m.is_none()).count();
    if alone == mirror.len() {
        report.push(Severity::Warning, "no mirror pairs: the left cannot be copied to the right".to_owned(), "");
        return;
    }
    if alone > 0 {
        report.push(Severity::Warning, format!("{alone} vertices without a mirror partner"), "");
    }
    let pairs = mirror.iter().enumerate().filter_map(|(v, m)| Some((v, (*m)? as usize)));
    if let Some((v, w)) = pairs.clone().find(|&(v, w)| mirror[w] != Some(v as u32)) {
        report.judge(
            false,
            "a mirror partner does not name its vertex back".to_owned(),
            format!("vertices {v} and {w}"),
        );
    }
    let apart = |v: usize, w: usize| {
        let (p, q) = (mesh.positions()[v], mesh.positions()[w]);
        (p - Point3::new(-q.x, q.y, q.z)).norm()
    };
    let worst = pairs.map(|(v, w)| (apart(v, w), v, w)).fold((0.0, 0, 0), |a, b| if b.0 > a.0 { b } else { a });
    report.judge(
        worst.0 <= expected.mirror_mm,
        format!("mirror pairs within {:.1e} mm, limit {:.0e} mm", worst.0, expected.mirror_mm),
        if worst.0 > 0.0 { format!("worst at vertices {} and {}", worst.1, worst.2) } else { String::new() },
    );
    let mut known: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| sorted(*t)).collect();
    known.sort_unstable();
    let image = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mirror[i as usize]);
        Some(sorted([a?, b?, c?]))
    };
    let lost = mesh.triangles().iter().position(|t| image(t).is_some_and(|m| known.binary_search(&m).is_err()));
    match lost {
        None => report.judge(true, "every triangle has its mirror image".to_owned(), ""),
        Some(t) => {
            let severity = if expected.mirrored_triangles { Severity::Failed } else { Severity::Warning };
            report.push(severity, "a triangle has no mirror image".to_owned(), format!("triangle {t}"));
        }
    }
}

fn sorted(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

fn landmarks(report: &mut Report, face: &FaceModel, expected: &Expectations) {
    counted(report, face.landmarks().len(), expected.landmarks, "landmarks bound to vertices");
    let mut taken: BTreeMap<u32, &str> = BTreeMap::new();
    for l in face.landmarks() {
        if let Some(other) = taken.insert(l.vertex, &l.id) {
            report.judge(
                false,
                format!("landmarks {other} and {} share a vertex", l.id),
                format!("vertex {}", l.vertex),
            );
        }
        if face.mesh().triangles_of_vertex(l.vertex as usize).is_empty() {
            report.judge(false, format!("landmark {} is off the surface", l.id), format!("vertex {}", l.vertex));
        }
    }
    let vertex_of = |id: &str| face.landmark(id).map(|l| l.vertex);
    for l in face.landmarks() {
        let across = l.mirror.as_deref().map_or(Some(l.vertex), vertex_of);
        let stored = face.mirror()[l.vertex as usize];
        if stored.is_some() && across != stored {
            report.judge(false, format!("landmark {} is not mirrored", l.id), format!("vertex {}", l.vertex));
        }
    }
}

fn muscles(report: &mut Report, face: &FaceModel, expected: &Expectations) {
    counted(report, face.muscles().len(), expected.muscles, "muscles bound to vertices");
    let p = face.mesh().positions();
    for m in face.muscles() {
        let length = (p[m.attachment as usize] - p[m.insertion as usize]).norm();
        let off =
            [m.attachment, m.insertion].into_iter().find(|&v| face.mesh().triangles_of_vertex(v as usize).is_empty());
        if let Some(v) = off {
            report.judge(false, format!("muscle {} is off the surface", m.id), format!("vertex {v}"));
        }
        if length <= 0.0 {
            report.judge(false, format!("muscle {} has no length", m.id), format!("vertex {}", m.attachment));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::FaceParts;

    fn face(points: &[[f64; 3]], triangles: &[[u32; 3]], mirror: Vec<Option<u32>>) -> FaceModel {
        let mesh = Mesh::new(points.iter().map(|p| Point3::from(*p)).collect(), triangles.to_vec()).unwrap();
        let mirror = if mirror.is_empty() { vec![None; points.len()] } else { mirror };
        FaceModel::new(mesh, FaceParts { mirror, ..FaceParts::default() }).unwrap()
    }

    fn faults(face: &FaceModel) -> Vec<String> {
        let report = check(face);
        report.findings.into_iter().filter(|f| f.severity == Severity::Failed).map(|f| f.what).collect()
    }

    const SQUARE: [[f64; 3]; 4] = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]];

    #[test]
    fn a_square_is_one_surface_with_one_border_of_eight_millimetres() {
        let square = face(&SQUARE, &[[0, 1, 2], [0, 2, 3]], vec![]);
        assert!(faults(&square).is_empty());
        let borders = borders_of(square.mesh());
        assert_eq!(borders.len(), 1);
        assert_eq!(borders[0].vertices, vec![0, 1, 2, 3]);
        assert!((borders[0].length_mm - 8.0).abs() < 1e-12);
        assert!(check(&square).to_string().contains("smallest angle 45.0°"));
    }

    #[test]
    fn each_fault_is_found_and_named() {
        let turned = face(&SQUARE, &[[0, 1, 2], [0, 3, 2]], vec![]);
        assert_eq!(faults(&turned), ["neighbouring triangles face opposite ways"]);
        let mut flat = SQUARE;
        flat[2] = [1.0, 0.1, 0.0];
        assert!(faults(&face(&flat, &[[0, 1, 2], [0, 2, 3]], vec![]))[0].starts_with("smallest angle 2.9°"));
        let bow = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [0.0, -1.0, 0.0]];
        assert_eq!(
            faults(&face(&bow, &[[0, 1, 2], [0, 3, 4]], vec![])),
            ["1 vertices where the surface touches itself"]
        );
        let apart = [SQUARE[0], SQUARE[1], SQUARE[2], [5.0, 0.0, 0.0], [7.0, 0.0, 0.0], [6.0, 2.0, 0.0]];
        assert_eq!(faults(&face(&apart, &[[0, 1, 2], [3, 4, 5]], vec![])), ["2 connected surfaces"]);
        let mut skew = SQUARE;
        skew[2][0] += 1e-6;
        let pairs = vec![Some(1), Some(0), Some(3), Some(2)];
        let said = faults(&face(&skew, &[[0, 1, 2], [0, 2, 3]], pairs));
        assert!(said[0].starts_with("mirror pairs within 1.0e-6 mm"), "{said:?}");
        assert_eq!(said[1], "a triangle has no mirror image");
    }

    #[test]
    fn wrong_counts_fail_only_where_they_are_asked_for() {
        let square = face(&SQUARE, &[[0, 1, 2], [0, 2, 3]], vec![]);
        assert!(check(&square).ok());
        let report = check_against(&square, &Expectations::generic());
        assert!(!report.ok());
        assert!(report.to_string().contains("FAILED   4 vertices, expected 612"), "{report}");
    }
}
