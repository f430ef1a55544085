//! The generic face: 612 vertices, 1128 triangles, and the generator that makes it from the proportions of adult faces.
//!
//! The generator draws the left half (lines round the eye and the mouth, rows across the brow and the forehead), fills it
//! evenly, lifts it onto a depth map, mirrors it, and binds landmarks and muscles to vertices. What it makes is also embedded
//! as a file, so that a program start costs a parse instead of a relaxation; a test holds the two equal.

mod anatomy;
mod depth_map;
mod features;
mod half;
mod triangulation;

use std::path::Path;
use std::sync::{Arc, LazyLock};

use nalgebra::Point3;

use super::{FaceError, FaceModel, FaceParts, Landmark, Mesh, Muscle, Region, Side, file};
use anatomy::{MUSCLES, PLACES, PLACING_ORDER, Pair};
use features::FOREHEAD_ROWS;
use half::{Half, on_surface};

/// The file that the program carries.
const EMBEDDED: &[u8] = include_bytes!("../../../assets/faces/generic.json");

/// Positions are rounded to this fraction of a millimetre, so that the file is short and reads back to the same numbers.
const PER_MM: f64 = 1e4;

/// The generic face that the program carries, parsed once.
///
/// # Panics
/// Never in a program whose tests pass: they parse the same embedded bytes.
pub fn generic() -> Arc<FaceModel> {
    static FACE: LazyLock<Arc<FaceModel>> = LazyLock::new(|| match file::parse(EMBEDDED, Path::new("generic.json")) {
        Ok(face) => Arc::new(face),
        Err(error) => unreachable!("the embedded face is refused: {error}"),
    });
    Arc::clone(&FACE)
}

/// Makes the generic face from its drawing. The same bytes on every machine and in every run.
pub fn generate() -> Result<FaceModel, FaceError> {
    let whole = Whole::mirrored(Half::build());
    let mesh = Mesh::new(whole.positions.clone(), whole.triangles.clone())?;
    let parts = FaceParts {
        name: "Generic adult face".to_owned(),
        landmarks: whole.landmarks(),
        muscles: MUSCLES.iter().flat_map(|p| [Side::Left, Side::Right].map(|side| whole.muscle(p, side))).collect(),
        mirror: (0..whole.positions.len()).map(|v| Some(whole.across(v) as u32)).collect(),
        regions: whole.regions(),
    };
    FaceModel::new(mesh, parts)
}

/// Both halves. Vertices: the midline from top to bottom, then the left half, then its mirror image in the same order.
struct Whole {
    half: Half,
    /// Vertices on the midline.
    midline: usize,
    /// Vertices beside it, on each side.
    beside: usize,
    /// For each vertex of the half its number in the whole.
    number: Vec<usize>,
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Whole {
    fn mirrored(half: Half) -> Self {
        let midline: Vec<usize> =
            half.curve("midline_upper").iter().chain(half.curve("midline_lower")).copied().collect();
        let others = (0..half.points.len()).filter(|v| !midline.contains(v));
        let order: Vec<usize> = midline.iter().copied().chain(others).collect();
        let mut number = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            number[old] = new;
        }
        let place = |v: &usize| on_surface(half.points[*v]).map(|c| (c * PER_MM).round() / PER_MM);
        let mut positions: Vec<Point3<f64>> = order.iter().map(place).collect();
        positions.extend(order[midline.len()..].iter().map(place).map(|p| Point3::new(-p.x, p.y, p.z)));
        let (midline, beside) = (midline.len(), order.len() - midline.len());
        let mut whole = Self { half, midline, beside, number, positions, triangles: Vec::new() };
        let left: Vec<[usize; 3]> = whole.half.triangles.iter().map(|t| t.map(|v| whole.number[v])).collect();
        let right = left.iter().map(|&[a, b, c]| [c, b, a].map(|v| whole.across(v)));
        whole.triangles = left.iter().copied().chain(right).map(|t| t.map(|v| v as u32)).collect();
        whole
    }

    /// The vertex across the midline.
    fn across(&self, v: usize) -> usize {
        if v < self.midline {
            v
        } else if v < self.midline + self.beside {
            v + self.beside
        } else {
            v - self.beside
        }
    }

    fn on(&self, side: Option<Side>, v: usize) -> u32 {
        (if side == Some(Side::Right) { self.across(v) } else { v }) as u32
    }

    /// The vertex of the left half nearest to a place in the plane.
    fn nearest(&self, [x, y]: [f64; 2]) -> usize {
        let distance = |v: &usize| {
            let p = self.positions[*v];
            (p.x - x) * (p.x - x) + (p.y - y) * (p.y - y)
        };
        (0..self.midline + self.beside).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    fn landmarks(&self) -> Vec<Landmark> {
        let landmark = |&(place, side): &(usize, Option<Side>)| {
            let place = &PLACES[place];
            let id = |side: Side| format!("{}_{}", place.id, word(side));
            let name = place.name.replace("{}", side.map_or("", word));
            Landmark {
                id: side.map_or_else(|| place.id.to_owned(), id),
                name: capitalised(&name),
                hint: place.hint.to_owned(),
                vertex: self.on(side, self.nearest(place.at)),
                mirror: side.map(opposite).map(id),
            }
        };
        PLACING_ORDER.iter().map(landmark).collect()
    }

    fn muscle(&self, pair: &Pair, side: Side) -> Muscle {
        Muscle {
            id: format!("{}_{}", pair.id, word(side)),
            latin: pair.latin.to_owned(),
            action_unit: pair.action_unit,
            side,
            attachment: self.on(Some(side), self.nearest(pair.attachment)),
            insertion: self.on(Some(side), self.nearest(pair.insertion)),
            half_width_mm: pair.half_width,
        }
    }

    /// The vertices along drawn curves on the left half.
    fn along(&self, curve: &str) -> Vec<usize> {
        self.half.curve(curve).iter().map(|&v| self.number[v]).collect()
    }

    /// A row that starts on the midline, whole: from the right rim to the left one, without the rim itself.
    fn row(&self, curve: &str) -> Vec<u32> {
        let left = self.along(curve);
        let inner = &left[..left.len().saturating_sub(1)];
        let right = inner.iter().skip(1).rev().map(|&v| self.across(v));
        right.chain(inner.iter().copied()).map(|v| v as u32).collect()
    }

    /// Vertices of the left half, then the same of the right, each once.
    fn both(&self, left: &[usize]) -> Vec<u32> {
        let mut all: Vec<u32> = Vec::new();
        for v in left.iter().copied().chain(left.iter().map(|&v| self.across(v))) {
            if !all.contains(&(v as u32)) {
                all.push(v as u32);
            }
        }
        all
    }

    fn regions(&self) -> Vec<Region> {
        let forehead: Vec<u32> = FOREHEAD_ROWS.iter().flat_map(|row| self.row(row)).collect();
        // Beyond the tail of the brow the row runs on to the temple: those vertices do not move with it.
        let tail = PLACES.iter().find(|p| p.id == "brow_outer").map_or(0.0, |p| p.at[0]);
        let brow_row = self.row("brow");
        let (brows, temples): (Vec<u32>, Vec<u32>) =
            brow_row.iter().partition(|&&v| self.positions[v as usize].x.abs() <= tail);
        let mut lids = self.along("eye_upper");
        lids.extend(self.along("lid_fold").into_iter().filter(|&v| self.positions[v].y > 0.5));
        let lips: Vec<usize> =
            ["lip_upper", "mouth_upper", "mouth_lower", "lip_lower"].iter().flat_map(|c| self.along(c)).collect();
        let mut still: Vec<u32> =
            [[0.0, 4.0], [0.0, -2.5], [0.0, -9.0]].iter().map(|&p| self.nearest(p) as u32).collect();
        still.extend(self.both(&[[5.0, -3.5], [5.3, -11.2], [18.4, 0.0], [13.9, -0.6]].map(|p| self.nearest(p))));
        still.extend(temples);
        let region = |id: &str, vertices: Vec<u32>| Region { id: id.to_owned(), vertices };
        vec![
            region("forehead_and_brows", forehead.iter().chain(&brows).copied().collect()),
            region("forehead", forehead),
            region("brows", brows),
            region("upper_lids", self.both(&lids)),
            region("lips", self.both(&lips)),
            region("still", still),
        ]
    }
}

fn word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
    }
}

fn opposite(side: Side) -> Side {
    match side {
        Side::Left => Side::Right,
        Side::Right => Side::Left,
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests;
