//! A profile: the surface of a layer cut by a plane that stands on a line in the plan, with the vertices near the cut.

use nalgebra::{Point2, Point3, Vector2};

use crate::face::Mesh;

/// A line in the plan with the band of vertices that count as near it, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where the profile's coordinate is `start`.
    pub origin: Point2<f64>,
    /// Unit vector along it.
    pub along: Vector2<f64>,
    /// Coordinate of the origin, mm: the profile of a vertical line counts y, of a lateral one x, along a fibre the distance.
    pub start: f64,
    /// Vertices as far as this to either side are shown.
    pub half_band_mm: f64,
}

impl Line {
    /// Upwards through a point; the coordinate is y.
    pub fn vertical(through: &Point3<f64>, half_band_mm: f64) -> Self {
        Self { origin: Point2::new(through.x, 0.0), along: Vector2::y(), start: 0.0, half_band_mm }
    }

    /// Across the face through a point; the coordinate is x.
    pub fn lateral(through: &Point3<f64>, half_band_mm: f64) -> Self {
        Self { origin: Point2::new(0.0, through.y), along: Vector2::x(), start: 0.0, half_band_mm }
    }

    /// From one point to another; the coordinate is the distance from the first. None where they are one above the other.
    pub fn between(from: &Point3<f64>, to: &Point3<f64>, half_band_mm: f64) -> Option<Self> {
        let along = (to.xy() - from.xy()).try_normalize(1e-9)?;
        Some(Self { origin: from.xy(), along, start: 0.0, half_band_mm })
    }

    /// Coordinate along the line, and signed distance to its left.
    pub fn place(&self, x: &Point3<f64>) -> (f64, f64) {
        let from_origin = x.xy() - self.origin;
        (self.start + from_origin.dot(&self.along), self.along.perp(&from_origin))
    }
}

/// A vertex near the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// The vertex.
    pub vertex: usize,
    /// Coordinate along the line, mm.
    pub at_mm: f64,
    /// Its value.
    pub value: f64,
    /// Standard error of it.
    pub error: Option<f64>,
}

/// What the chart shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Straight pieces of the cut surface: coordinate (mm) and value of both ends. Where nothing is known there are none.
    pub pieces: Vec<[[f64; 2]; 2]>,
    /// Vertices within the band, by coordinate.
    pub points: Vec<ProfilePoint>,
}

/// Where the line enters and leaves one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The triangle.
    pub triangle: usize,
    /// For both ends, in the line's direction: coordinate along the line (mm), the two vertices between which it lies, the share of the
    /// second one.
    pub ends: [(f64, [u32; 2], f64); 2],
}

impl Cut {
    /// Where the ends lie, mm.
    pub fn points(&self, first: &[Point3<f64>]) -> [Point3<f64>; 2] {
        self.ends.map(|(_, [a, b], share)| {
            let (a, b) = (first[a as usize], first[b as usize]);
            a + (b - a) * share
        })
    }
}

/// The triangles that a plane upright on the plan along the line goes through, by coordinate. Only those that `taken` takes.
pub fn cuts(mesh: &Mesh, first: &[Point3<f64>], line: &Line, taken: impl Fn([u32; 3]) -> bool) -> Vec<Cut> {
    let mut all = Vec::new();
    for (triangle, &t) in mesh.triangles().iter().enumerate() {
        let places = t.map(|v| line.place(&first[v as usize]));
        let side = places.map(|p| p.1);
        if side.iter().all(|s| *s < 0.0) || side.iter().all(|s| *s >= 0.0) || !taken(t) {
            continue;
        }
        let mut ends = [(0.0, [0; 2], 0.0); 2];
        let mut found = 0;
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            if (side[a] < 0.0) != (side[b] < 0.0) && found < 2 {
                let share = side[a] / (side[a] - side[b]);
                ends[found] = (places[a].0 + share * (places[b].0 - places[a].0), [t[a], t[b]], share);
                found += 1;
            }
        }
        if found == 2 {
            let [a, b] = ends;
            all.push(Cut { triangle, ends: if a.0 <= b.0 { [a, b] } else { [b, a] } });
        }
    }
    all.sort_by(|a, b| a.ends[0].0.total_cmp(&b.ends[0].0));
    all
}

/// Cuts the piecewise linear surface of `values` along a line. Triangles with an unknown corner are left out: the curve has gaps there.
pub fn section(
    mesh: &Mesh,
    first: &[Point3<f64>],
    value_and_error: &dyn Fn(usize) -> Option<(f64, Option<f64>)>,
    line: &Line,
) -> Section {
    // Where nothing is known nothing is asked: of a large face that is most of it.
    let known: Vec<Option<f64>> = (0..first.len()).map(|v| value_and_error(v).map(|(value, _)| value)).collect();
    let value = |v: u32| known.get(v as usize).copied().flatten();
    let pieces = cuts(mesh, first, line, |t| t.iter().all(|v| value(*v).is_some()))
        .into_iter()
        .filter_map(|cut| {
            let [from, to] = cut.ends.map(|(at, [a, b], share)| {
                let (a, b) = (value(a)?, value(b)?);
                Some([at, a + share * (b - a)])
            });
            Some([from?, to?])
        })
        .collect();
    let mut points: Vec<ProfilePoint> = known
        .iter()
        .enumerate()
        .filter(|(_, value)| value.is_some())
        .map(|(vertex, _)| (vertex, line.place(&first[vertex])))
        .filter(|(_, place)| place.1.abs() <= line.half_band_mm)
        .filter_map(|(vertex, place)| {
            let (value, error) = value_and_error(vertex)?;
            Some(ProfilePoint { vertex, at_mm: place.0, value, error })
        })
        .collect();
    points.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
    Section { pieces, points }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Reading = Option<(f64, Option<f64>)>;

    /// A 5 × 5 grid, 10 mm apart, whose value is 3 + 0.2 x − 0.1 y: linear, so the cut is exact.
    fn grid() -> (Mesh, impl Fn(usize) -> Reading) {
        let p: Vec<_> =
            (0..25_u8).map(|k| Point3::new(f64::from(k % 5) * 10.0, f64::from(k / 5) * 10.0, 7.0)).collect();
        let values: Vec<f64> = p.iter().map(|p| 3.0 + 0.2 * p.x - 0.1 * p.y).collect();
        let t = (0..16)
            .flat_map(|k| {
                let i = k / 4 * 5 + k % 4;
                [[i, i + 1, i + 6], [i, i + 6, i + 5]]
            })
            .collect();
        (Mesh::new(p, t).unwrap(), move |v: usize| (v != 24).then(|| (values[v], Some(0.01))))
    }

    #[test]
    fn the_cut_of_a_plane_is_that_plane() {
        let (mesh, values) = grid();
        let line = Line::between(&Point3::new(3.0, 2.0, 0.0), &Point3::new(33.0, 28.0, 0.0), 4.0).unwrap();
        let cut = section(&mesh, mesh.positions(), &values, &line);
        // y = 0.867 x − 0.6 meets the grid at x = 10, 20, 30 and y = 10, 20, 30, no diagonal, and ends at the unknown vertex's triangle.
        assert_eq!(cut.pieces.len(), 6);
        for [at, value] in cut.pieces.iter().flatten() {
            let p = line.origin + line.along * *at;
            assert!((value - (3.0 + 0.2 * p.x - 0.1 * p.y)).abs() < 1e-9);
        }
        // Pieces join without a gap.
        for pair in cut.pieces.windows(2) {
            assert!((pair[0][1][0] - pair[1][0][0]).abs() < 1e-9);
        }
    }

    #[test]
    fn an_unknown_vertex_leaves_a_gap_and_no_point() {
        let (mesh, values) = grid();
        // Vertex 24 (40, 40) is unknown: the last square has no triangle left.
        let line = Line::lateral(&Point3::new(0.0, 35.0, 0.0), 6.0);
        let cut = section(&mesh, mesh.positions(), &values, &line);
        let most = cut.pieces.iter().map(|p| p[1][0]).fold(0.0, f64::max);
        assert!((most - 30.0).abs() < 1e-9, "ends at x = 30 mm, not at {most}");
        let vertices: Vec<usize> = cut.points.iter().map(|p| p.vertex).collect();
        assert_eq!(vertices.len(), 9, "rows y = 30 and 40, less the unknown one");
        assert!(!vertices.contains(&24) && cut.points.is_sorted_by(|a, b| a.at_mm <= b.at_mm));
    }

    #[test]
    fn coordinates_are_those_of_the_face() {
        let p = Point3::new(-12.0, 40.0, 3.0);
        assert_eq!(Line::vertical(&p, 5.0).place(&p), (40.0, 0.0));
        assert_eq!(Line::lateral(&p, 5.0).place(&p), (-12.0, 0.0));
        assert!(Line::between(&p, &Point3::new(-12.0, 40.0, 90.0), 5.0).is_none());
    }
}
