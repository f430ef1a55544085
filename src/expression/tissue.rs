//! Where the face is no plain skin: the plates and the folds of the lids, and the corners of the mouth, as factors on the stiffness of its edges.

use nalgebra::{Point2, Point3, Vector3};

use super::openings::openings;
use super::places::Carry;
use crate::draw::paint::to_segment;
use crate::face::FaceModel;

/// A part of the face that is stiffer or softer than the skin around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tissue {
    /// For people.
    pub name: &'static str,
    /// Where it lies.
    pub place: &'static str,
    /// Factor on the stiffness of the skin.
    pub factor: f64,
    /// How the factor is known.
    pub source: &'static str,
}

/// The tarsal plate: a lid's margin moves as a whole, and is not drawn out by what pulls on the brow.
pub const PLATE: Tissue = Tissue {
    name: "plate of a lid",
    place: "within 7 mm above an eye's opening and 3 mm below",
    factor: 3.0,
    source: "measured 4.5 ± 3.2: toe modulus of the tarsal plate 0.14 ± 0.10 MPa at a thickness of 1.6 mm (10 plates: Sun et al. 2015, J. Biomech. 48:3455) over the 33 kPa × 1.5 mm of the skin; within that, what the lifter of the lid can still lift by 2 mm",
};

/// The skin between plate and brow, which lies in a fold and unfolds before it stretches.
pub const FOLD: Tissue = Tissue {
    name: "fold of the upper lid",
    place: "from the plate to 20 mm above the middle of the eye",
    factor: 0.25,
    source: "0.6 is measured, as the thickness of the lid's dermis to the forehead's (0.67 to 1.17 mm and 0.58 to 0.86 mm: PMC9205051); the rest, 0.4, is assumed for the unfolding",
};

/// The corners of the mouth, where lips and cheek give way before the upper lip comes down with the jaw.
pub const CORNER: Tissue = Tissue {
    name: "corner of the mouth",
    place: "within 14 mm of it",
    factor: 0.4,
    source: "assumed; the lower lip itself is measured as stiff as the cheek (Luboz, Promayon & Payan 2014)",
};

/// All of them.
pub const ALL: [Tissue; 3] = [PLATE, FOLD, CORNER];

/// Heights of the plate above and below the opening, mm of the generic face, as all that follow.
const PLATE_MM: [f64; 2] = [7.0, 3.0];
/// Where the fold ends above the middle of the eye.
const FOLD_MM: f64 = 20.0;
/// How far from the middle of the eye plate and fold end to the sides, and to the front and back.
const BESIDE_MM: f64 = 18.0;
const DEEP_MM: f64 = 30.0;
/// Reach of a corner of the mouth.
const CORNER_MM: f64 = 14.0;

/// Factors on the stiffness of the edges of a face at rest, in the order of [`crate::face::Mesh::edges`]: an edge belongs to the part that its
/// middle lies in. Plain skin has 1; without openings for the eyes there are no lids.
pub fn of_edges(face: &FaceModel, rest: &[Point3<f64>], carry: &Carry) -> Vec<f64> {
    let generic: Vec<Point3<f64>> = rest.iter().map(|p| carry.back(p)).collect();
    let eyes: Vec<Eye> =
        openings(face, rest).iter().filter(|o| o.iris.is_some()).map(|o| Eye::of(&o.border, &generic)).collect();
    let corner = |id: &str| face.landmark(id).map(|l| generic[l.vertex as usize]);
    let corners = ["mouth_corner_left", "mouth_corner_right"].map(corner);
    let of = |&[a, b]: &[u32; 2]| {
        let middle = nalgebra::center(&generic[a as usize], &generic[b as usize]);
        let lid = eyes.iter().find_map(|eye| eye.part(&middle));
        let near = || corners.iter().flatten().any(|c| (c - middle).norm() < CORNER_MM);
        lid.map_or_else(|| if near() { CORNER.factor } else { 1.0 }, |tissue| tissue.factor)
    };
    face.mesh().edges().iter().map(of).collect()
}

/// The opening of an eye on the generic face.
struct Eye {
    border: Vec<Point2<f64>>,
    middle: Point3<f64>,
}

impl Eye {
    fn of(border: &[u32], generic: &[Point3<f64>]) -> Self {
        let corners: Vec<Point3<f64>> = border.iter().map(|&v| generic[v as usize]).collect();
        let sum: Vector3<f64> = corners.iter().map(|p| p.coords).sum();
        Self {
            border: corners.iter().map(Point3::xy).collect(),
            middle: Point3::from(sum / corners.len().max(1) as f64),
        }
    }

    /// The part of the lids that a place lies in.
    fn part(&self, p: &Point3<f64>) -> Option<Tissue> {
        let from = p - self.middle;
        if from.x.abs() > BESIDE_MM || from.y.abs() > 2.0 * FOLD_MM || from.z.abs() > DEEP_MM {
            return None;
        }
        let sides = self.border.iter().zip(self.border.iter().cycle().skip(1));
        let off = sides.map(|(a, b)| to_segment(&p.xy(), a, b).0).fold(f64::INFINITY, f64::min);
        let above = from.y > 0.0;
        if off < PLATE_MM[usize::from(!above)] {
            return Some(PLATE);
        }
        (above && from.y < FOLD_MM).then_some(FOLD)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;

    #[test]
    fn lids_and_corners_are_where_they_are_on_the_generic_face_and_alike_on_both_sides() {
        let face = face::generic();
        let mesh = face.mesh();
        let rest = mesh.positions();
        let factors = of_edges(&face, rest, &Carry::onto(&face, rest).unwrap());
        let mut seen = [0; 4];
        for (e, &[a, b]) in mesh.edges().iter().enumerate() {
            let [p, q] = [a, b].map(|v| rest[v as usize]);
            let (middle, factor) = (nalgebra::center(&p, &q), factors[e]);
            let kind = ALL.iter().position(|t| t.factor == factor);
            assert!(kind.is_some() || factor == 1.0, "{factor}");
            seen[kind.unwrap_or(3)] += 1;
            let place = (middle.x.abs(), middle.y);
            match kind {
                // The eye lies from x = 18.4 to 44.6 mm and y = −4.9 to 6.1 mm, the brow at y = 26 to 29 mm.
                Some(0) => assert!((13.0..51.0).contains(&place.0) && (-8.0..13.2).contains(&place.1), "{place:?}"),
                Some(1) => assert!((13.0..51.0).contains(&place.0) && (4.0..21.0).contains(&place.1), "{place:?}"),
                // The corner of the mouth lies at (25.4, −69) mm.
                Some(_) => assert!((place.0 - 25.4).hypot(place.1 + 69.0) < 14.0, "{place:?}"),
                None => {}
            }
            let across = [a, b].map(|v| face.mirror()[v as usize].unwrap_or(v));
            let across = mesh.edges().binary_search(&[across[0].min(across[1]), across[0].max(across[1])]).unwrap();
            assert_eq!(factor, factors[across], "{place:?}");
        }
        // Every edge of the lids' margins is of the plate.
        for opening in openings(&face, rest).iter().filter(|o| o.iris.is_some()) {
            for (a, b) in opening.border.iter().zip(opening.border.iter().cycle().skip(1)) {
                let e = mesh.edges().binary_search(&[*a.min(b), *a.max(b)]).unwrap();
                assert_eq!(factors[e], PLATE.factor);
            }
        }
        assert!(seen.iter().all(|n| *n >= 20), "{seen:?}");
    }

    #[test]
    fn the_same_parts_are_found_on_a_larger_face_elsewhere() {
        let face = face::generic();
        let rest = face.mesh().positions();
        let moved: Vec<_> =
            rest.iter().map(|p| Point3::new(1.2 * p.x + 5.0, 0.9 * p.y - 20.0, 1.1 * p.z + 100.0)).collect();
        let of = |at: &[Point3<f64>]| of_edges(&face, at, &Carry::onto(&face, at).unwrap());
        assert_eq!(of(rest), of(&moved));
    }

    #[test]
    fn the_document_shows_the_table() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/expressions.md")).unwrap();
        for t in ALL {
            let row = format!("| {} | {} | {} | {} |", t.name, t.place, t.factor, t.source);
            assert!(text.contains(&row), "docs/expressions.md lacks: {row}");
        }
    }
}
