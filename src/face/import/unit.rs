//! Millimetres for coordinates without a unit: the unit that makes the mesh as large as a face, a head, or a person.

use super::{ImportError, Repair, Soup, axes};

/// Units that files are written in, the likelier first.
const UNITS: [(f64, &str); 5] =
    [(1.0, "millimetres"), (10.0, "centimetres"), (1000.0, "metres"), (100.0, "decimetres"), (25.4, "inches")];
/// Height of what is a face, a mask, a head or a bust, mm.
const FACE_MM: [f64; 2] = [130.0, 420.0];
/// Height of what is a whole person, mm.
const PERSON_MM: [f64; 2] = [1300.0, 2200.0];
/// A closed mesh with less depth for its height than this is a standing person: a head is deeper.
const PERSON_DEPTH: f64 = 0.27;
/// What a mesh is made as high as when no unit fits: a face with its forehead, mm.
const FACE_HEIGHT_MM: f64 = 190.0;

/// Scales the points to millimetres and gives the factor.
pub(super) fn apply(soup: &mut Soup, given: Option<f64>, repairs: &mut Vec<Repair>) -> Result<f64, ImportError> {
    let mm_per_unit = given.unwrap_or_else(|| {
        let [_, height, depth] = extents(soup);
        let standing = depth < PERSON_DEPTH * height && axes::looks(soup).is_none();
        let [low, high] = if standing { PERSON_MM } else { FACE_MM };
        let fits = |&(mm, _): &(f64, &str)| (low..=high).contains(&(mm * height));
        let unknown =
            (if height > 0.0 { FACE_HEIGHT_MM / height } else { 1.0 }, "no usual unit: made as high as a mean face");
        let (mm_per_unit, unit) = UNITS.into_iter().find(fits).unwrap_or(unknown);
        if mm_per_unit != 1.0 {
            repairs.push(Repair::GuessedUnit { mm_per_unit, unit, height_mm: mm_per_unit * height });
        }
        mm_per_unit
    });
    for p in &mut soup.positions {
        *p *= mm_per_unit;
    }
    let finite = mm_per_unit.is_finite() && mm_per_unit > 0.0;
    if !finite || soup.positions.iter().any(|p| p.coords.amax() > 1e7) {
        return Err(ImportError::Option("the mesh is larger than 10 km; give its unit by hand"));
    }
    Ok(mm_per_unit)
}

fn extents(soup: &Soup) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let bound = |f: fn(f64, f64) -> f64, from| soup.positions.iter().map(|p| p[axis]).fold(from, f);
        bound(f64::max, f64::NEG_INFINITY) - bound(f64::min, f64::INFINITY)
    })
}
