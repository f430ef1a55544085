//! Which pixels of a picture show skin, and which pieces of skin hang together: two lips that touch in a picture do not.

use nalgebra::Point2;

use crate::draw::raster::{Corner, Raster};
use crate::face::Mesh;

/// No triangle.
const NONE: u32 = u32::MAX;

/// The skin of a picture: the triangles of a face that it shows.
#[derive(Clone, Debug)]
pub struct Skin {
    columns: usize,
    /// The triangle that each pixel shows.
    shows: Vec<u32>,
    /// The vertices of each triangle.
    triangles: Vec<[u32; 3]>,
    /// Those across each edge that are skin, too.
    beside: Vec<[u32; 3]>,
    /// The box about each triangle that is skin, px.
    boxes: Vec<Option<[Point2<f64>; 2]>>,
    /// A triangle of skin at each vertex.
    at_vertex: Vec<u32>,
}

impl Skin {
    /// The triangles of a face, of which all corners are `seen`, where no other lies before them. `corners`: its vertices in the picture.
    pub fn of(mesh: &Mesh, seen: &[bool], corners: &[Corner], [columns, rows]: [usize; 2]) -> Self {
        let triangles = mesh.triangles();
        let is_skin = |t: u32| triangles[t as usize].iter().all(|v| seen[*v as usize]);
        let of = |t: &[u32; 3]| t.map(|v| corners[v as usize]);
        let side = |s: usize| u32::try_from(s).unwrap_or(u32::MAX);
        let raster = Raster { width: side(columns), height: side(rows), samples: 1 };
        let all: Vec<[Corner; 3]> = triangles.iter().map(of).collect();
        let shows = raster.nearest(&all).into_iter().map(|t| t.filter(|t| is_skin(*t)).unwrap_or(NONE)).collect();
        let mut beside = vec![[NONE; 3]; triangles.len()];
        for [a, b] in mesh.triangles_of_edge() {
            for (from, to) in [(*a, *b), (*b, *a)] {
                if from != NONE
                    && to != NONE
                    && is_skin(from)
                    && is_skin(to)
                    && let Some(free) = beside[from as usize].iter_mut().find(|t| **t == NONE)
                {
                    *free = to;
                }
            }
        }
        let about = |(t, corners): (usize, &[Corner; 3])| {
            let [a, b, c] = corners.each_ref().map(|c| Point2::new(c.x, c.y));
            is_skin(t as u32).then(|| [a.inf(&b).inf(&c), a.sup(&b).sup(&c)])
        };
        let boxes = all.iter().enumerate().map(about).collect();
        let skin_at = |v: usize| mesh.triangles_of_vertex(v).iter().copied().find(|t| is_skin(*t)).unwrap_or(NONE);
        let at_vertex = (0..mesh.len()).map(skin_at).collect();
        Self { columns, shows, triangles: triangles.to_vec(), beside, boxes, at_vertex }
    }

    /// The triangle that a pixel shows; none where that is no skin.
    pub(crate) fn shown(&self, x: usize, y: usize) -> Option<u32> {
        let t = *self.shows.get(y * self.columns + x).filter(|_| x < self.columns)?;
        (t != NONE).then_some(t)
    }

    /// The triangle of a place: the one that is known, or the one that shows there.
    pub fn triangle(&self, at: &Point2<f64>, known: Option<u32>) -> Option<u32> {
        known.or_else(|| self.near(at))
    }

    /// The triangle at a place: that of its pixel, or of the nearest one that shows skin, at most 2 px away.
    pub(super) fn near(&self, at: &Point2<f64>) -> Option<u32> {
        const FAR: isize = 2;
        // Before any of these is rounded: a place may be nowhere, or far outside.
        let rows = self.shows.len() / self.columns.max(1);
        let [right, bottom] = [self.columns, rows].map(|side| (side + FAR.unsigned_abs()) as f64);
        if !(0.0..right).contains(&at.x) || !(0.0..bottom).contains(&at.y) {
            return None;
        }
        let [x, y] = [at.x as usize, at.y as usize];
        let all = (-FAR..=FAR).flat_map(|dy| (-FAR..=FAR).map(move |dx| (dx * dx + dy * dy, dx, dy)));
        let shown = |(away, dx, dy): (isize, isize, isize)| {
            Some((away, self.shown(x.checked_add_signed(dx)?, y.checked_add_signed(dy)?)?))
        };
        self.shown(x, y).or_else(|| all.filter_map(shown).min().map(|(_, t)| t))
    }

    /// A triangle at a vertex of the face: where its place alone does not tell which lip it belongs to.
    pub fn at_vertex(&self, vertex: usize) -> Option<u32> {
        self.at_vertex.get(vertex).copied().filter(|t| *t != NONE)
    }

    /// Whether two triangles share a vertex.
    pub(super) fn touch(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|t| self.triangles[t as usize]);
        a.iter().any(|v| b.contains(v))
    }

    /// The triangles of skin with the boxes about them, px.
    pub(super) fn boxes(&self) -> impl Iterator<Item = (u32, [Point2<f64>; 2])> {
        self.boxes.iter().enumerate().filter_map(|(t, b)| Some((t as u32, (*b)?)))
    }

    /// Numbers some triangles (in ascending order) by the piece of skin that each belongs to: pieces hang together across edges.
    pub(super) fn pieces(&self, some: &[u32]) -> Vec<u32> {
        let mut pieces = vec![NONE; some.len()];
        let (mut count, mut open) = (0, Vec::new());
        for start in 0..some.len() {
            if pieces[start] != NONE {
                continue;
            }
            pieces[start] = count;
            open.push(start);
            while let Some(k) = open.pop() {
                for other in self.beside[some[k] as usize] {
                    if let Ok(n) = some.binary_search(&other)
                        && pieces[n] == NONE
                    {
                        pieces[n] = count;
                        open.push(n);
                    }
                }
            }
            count += 1;
        }
        pieces
    }

    /// Places of the skin, close by one another, with the triangle that is seen there.
    pub(super) fn places(&self) -> Vec<(Point2<f64>, u32)> {
        const STEP: usize = 4;
        let rows = self.shows.chunks_exact(self.columns.max(1)).enumerate().step_by(STEP);
        let shown = rows.flat_map(|(y, row)| row.iter().enumerate().step_by(STEP).map(move |(x, t)| (x, y, *t)));
        shown.filter(|s| s.2 != NONE).map(|(x, y, t)| (Point2::new(x as f64 + 0.5, y as f64 + 0.5), t)).collect()
    }
}

#[cfg(test)]
impl Skin {
    /// A flat face of such corners in a picture of 240 × 240 px.
    pub(super) fn flat(corners: &[[f64; 2]], triangles: &[[u32; 3]]) -> Self {
        let positions = corners.iter().map(|[x, y]| nalgebra::Point3::new(*x, *y, 0.0)).collect();
        let mesh = Mesh::new(positions, triangles.to_vec()).unwrap();
        let corners: Vec<Corner> = corners.iter().map(|[x, y]| Corner { x: *x, y: *y, depth: 1.0 }).collect();
        Self::of(&mesh, &vec![true; mesh.len()], &corners, [240, 240])
    }

    /// A square of one piece.
    pub(crate) fn square(from: f64, to: f64) -> Self {
        Self::flat(&[[from, from], [to, from], [to, to], [from, to]], &[[0, 1, 2], [0, 2, 3]])
    }

    /// A square from 20 to 220 px with a slit at y = 120 from x = 70 to 170, of which the upper side ends at the lower one's corners.
    pub(super) fn slit() -> Self {
        let columns = [20.0, 70.0, 120.0, 170.0, 220.0];
        let mut corners: Vec<[f64; 2]> = [20.0, 120.0, 220.0].iter().flat_map(|y| columns.map(|x| [x, *y])).collect();
        // The lower side has a corner of its own in the middle of the slit.
        corners.push([120.0, 120.0]);
        let lower = |v: u32| if v == 7 { 15 } else { v };
        let squares = (0..4_u32).flat_map(|c| [(c, c + 5), (c + 5, c + 10)].map(|(up, down)| (up, down, up >= 5)));
        let triangles: Vec<[u32; 3]> = squares
            .flat_map(|(up, down, below)| {
                [[up, up + 1, down + 1], [up, down + 1, down]].map(|t| if below { t.map(lower) } else { t })
            })
            .collect();
        Self::flat(&corners, &triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sheets of 60 × 60 px, of which the nearer hides a corner of the other: a place belongs to the sheet that shows there, what
    /// does not face the camera is none, and a place beside the skin belongs to the nearest within 2 px.
    #[test]
    fn a_place_belongs_to_what_shows_there() {
        let sheet = |from: f64| [[from, from], [from + 60.0, from], [from + 60.0, from + 60.0], [from, from + 60.0]];
        let corners: Vec<[f64; 2]> = sheet(10.0).into_iter().chain(sheet(50.0)).collect();
        let positions = corners.iter().map(|[x, y]| nalgebra::Point3::new(*x, *y, 0.0)).collect();
        let mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap();
        let corner = |(k, [x, y]): (usize, &[f64; 2])| Corner { x: *x, y: *y, depth: if k < 4 { 2.0 } else { 1.0 } };
        let mut all: Vec<Corner> = corners.iter().enumerate().map(corner).collect();
        let skin = Skin::of(&mesh, &[true; 8], &all, [120, 120]);
        let at = |skin: &Skin, x: f64, y: f64| skin.near(&Point2::new(x, y));
        // The diagonal from corner 0 to 2 has triangle 0 above it.
        assert_eq!([at(&skin, 30.0, 20.0), at(&skin, 20.0, 30.0)], [Some(0), Some(1)]);
        assert_eq!([at(&skin, 66.0, 55.0), at(&skin, 55.0, 66.0)], [Some(2), Some(3)]);
        assert_eq!([at(&skin, 8.5, 30.0), at(&skin, 6.0, 30.0), at(&skin, f64::NAN, 30.0)], [Some(1), None, None]);
        assert_eq!([at(&skin, 1e300, 1e300), at(&skin, 30.0, 1e18)], [None, None]);
        assert_eq!(skin.triangle(&Point2::new(30.0, 20.0), Some(3)), Some(3));
        assert_eq!([skin.at_vertex(1), skin.at_vertex(6), skin.at_vertex(99)], [Some(0), Some(2), None]);
        assert_eq!(skin.pieces(&[0, 1, 2, 3]), [0, 0, 1, 1]);
        // Where the nearer sheet is turned away it still hides the other.
        let seen = [true, true, true, true, false, false, false, false];
        let turned = Skin::of(&mesh, &seen, &all, [120, 120]);
        assert_eq!([at(&turned, 66.0, 55.0), at(&turned, 30.0, 20.0)], [None, Some(0)]);
        assert_eq!(turned.at_vertex(6), None);
        all[0].x = f64::NAN;
        all[1].y = 1e300;
        let broken = Skin::of(&mesh, &[true; 8], &all, [120, 120]);
        assert_eq!(at(&broken, 66.0, 55.0), Some(2));
    }
}
