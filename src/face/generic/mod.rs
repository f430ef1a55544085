//! The generic face: 612 vertices, 1128 triangles, and the generator that makes it from the proportions of adult faces.
//!
//! The generator lays the edge flow of the left half (columns along the fibres of the forehead, rings round eye, mouth and nose),
//! makes it fair on a depth map, mirrors it, and binds landmarks and muscles to vertices. What it makes is also embedded as a
//! file, so that a program start costs a parse instead of a relaxation; a test holds the two equal. Faces of other
//! [`proportions`] are the same face moved.

mod anatomy;
mod depth_map;
mod drawing;
mod fairing;
mod layout;
pub mod proportions;
mod surface;

use std::path::Path;
use std::sync::{Arc, LazyLock};

use nalgebra::Point3;

use super::{FaceError, FaceModel, FaceParts, Landmark, Mesh, Muscle, MusclePreset, Region, Side, file};
use anatomy::{MUSCLES, PLACES, PLACING_ORDER, Pair, WATERS_MUSCLES};
use drawing::{BROW, COLUMNS};
use layout::Layout;
use surface::on_surface;

/// The file that the program carries.
const EMBEDDED: &[u8] = include_bytes!("../../../assets/faces/generic.json");

/// Places that no expression of the brow moves: the saddle and the back of the nose.
const STILL_ON_MIDLINE: [[f64; 2]; 3] = [[0.0, 4.0], [0.0, -2.5], [0.0, -9.0]];
/// Beside it: the nose, the inner corner of the eye, and the skin over the cheek bone and the temple in front of the ear.
const STILL_BESIDE: [[f64; 2]; 7] =
    [[4.6, 4.2], [4.2, -9.0], [18.4, 0.0], [14.8, 0.2], [70.2, 13.0], [66.5, -3.0], [66.3, -11.0]];

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
    let mut half = Layout::new();
    fairing::fair(&mut half);
    let whole = Whole::mirrored(half);
    let mesh = Mesh::new(whole.positions.clone(), whole.triangles.clone())?;
    let parts = FaceParts {
        name: "Generic adult face".to_owned(),
        landmarks: whole.landmarks(),
        muscles: whole.muscles(&MUSCLES),
        muscle_presets: vec![MusclePreset {
            id: "waters".to_owned(),
            name: "Waters' 18 muscles of convergent fibres".to_owned(),
            muscles: whole.muscles(&WATERS_MUSCLES),
        }],
        mirror: (0..whole.positions.len()).map(|v| Some(whole.across(v) as u32)).collect(),
        regions: whole.regions(),
    };
    FaceModel::new(mesh, parts)
}

/// Both halves. Vertices: the midline from top to bottom, then the left half, then its mirror image in the same order.
struct Whole {
    half: Layout,
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
    fn mirrored(half: Layout) -> Self {
        let mut midline: Vec<usize> = (0..half.places.len()).filter(|&v| half.places[v][0] == 0.0).collect();
        midline.sort_by(|&a, &b| half.places[b][1].total_cmp(&half.places[a][1]));
        let others = (0..half.places.len()).filter(|v| !midline.contains(v));
        let order: Vec<usize> = midline.iter().copied().chain(others).collect();
        let mut number = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            number[old] = new;
        }
        let place = |v: &usize| on_surface(half.places[*v]).map(rounded);
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
                in_68: place.in_68.map(|[right, left]| if side == Some(Side::Left) { left } else { right }),
                in_468: Some(place.in_468[usize::from(side == Some(Side::Left))]),
            }
        };
        PLACING_ORDER.iter().map(landmark).collect()
    }

    fn muscles(&self, pairs: &[Pair]) -> Vec<Muscle> {
        pairs.iter().flat_map(|p| [Side::Left, Side::Right].map(|side| self.muscle(p, side))).collect()
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
            zone_half_angle_deg: pair.zone_half_angle,
        }
    }

    /// Vertices of the half by their numbers in the whole.
    fn numbers<'a>(&'a self, of_half: impl IntoIterator<Item = &'a usize>) -> Vec<usize> {
        of_half.into_iter().map(|&v| self.number[v]).collect()
    }

    /// A row of the grid, whole, from the person's right to the left, as far out as `column`.
    fn row(&self, row: usize, column: usize) -> Vec<u32> {
        let left: Vec<usize> = (0..=column).filter_map(|c| self.half.grid[c][row]).collect();
        let left = self.numbers(&left);
        let right = left.iter().skip(1).rev().map(|&v| self.across(v));
        right.chain(left.iter().copied()).map(|v| v as u32).collect()
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
        let forehead: Vec<u32> = (0..BROW).flat_map(|row| self.row(row, COLUMNS - 1)).collect();
        let brows = self.row(BROW, drawing::EYE.columns[1]);
        let lid = |ring: usize| self.half.eye.iter().rev().nth(ring).map_or(&[][..], |r| &r[..=r.len() / 2]);
        let lids = self.numbers(lid(0).iter().chain(lid(1)));
        let lips = self.numbers(self.half.mouth.iter().rev().take(2).flatten());
        let mut still: Vec<u32> = STILL_ON_MIDLINE.iter().map(|&p| self.nearest(p) as u32).collect();
        still.extend(self.both(&STILL_BESIDE.map(|p| self.nearest(p))));
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

/// A coordinate as the file holds it.
fn rounded(mm: f64) -> f64 {
    (mm * PER_MM).round() / PER_MM
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
