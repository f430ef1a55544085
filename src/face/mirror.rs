//! The mirror table of a mesh that came without one: which vertex lies across the midline.

use std::collections::HashMap;

use nalgebra::Point3;

use super::Mesh;

/// Farthest that a vertex may lie from the mirror image of its partner, as a share of the mean edge.
const REACH: f64 = 0.25;

/// Where the plane of symmetry x = const lies, mm: the middle of the mesh's width, corrected by the pairs found from there.
///
/// 0 for a mesh whose halves do not match well enough to say.
pub fn plane_of_symmetry(mesh: &Mesh) -> f64 {
    let (low, high) = mesh
        .positions()
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.x), high.max(p.x)));
    let mut best = (0, 0.0);
    for start in [0.0, f64::midpoint(low, high)] {
        let table = table_about(mesh, start);
        let p = mesh.positions();
        let mut middles: Vec<f64> =
            table.iter().enumerate().filter_map(|(v, w)| Some(f64::midpoint(p[v].x, p[(*w)? as usize].x))).collect();
        middles.sort_unstable_by(f64::total_cmp);
        if middles.len() > best.0 {
            best = (middles.len(), middles[middles.len() / 2]);
        }
    }
    if 2 * best.0 > mesh.len() { best.1 } else { 0.0 }
}

/// For each vertex the one across x = 0 (itself on the midline), where there is one within a quarter of the mean edge.
///
/// Partners name each other, and every triangle between vertices with partners has its mirror image, or they are no partners.
pub fn detect(mesh: &Mesh) -> Vec<Option<u32>> {
    let mut table = table_about(mesh, 0.0);
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let known: std::collections::HashSet<[u32; 3]> = mesh.triangles().iter().map(|t| sorted(*t)).collect();
    // Vertices all of whose triangles lack an image are strangers; a diagonal cut the other way alone does not part a pair.
    let has_image = |t: u32, table: &[Option<u32>]| {
        let [a, b, c] = mesh.triangles()[t as usize].map(|i| table[i as usize]);
        a.zip(b).zip(c).is_some_and(|((a, b), c)| known.contains(&sorted([a, b, c])))
    };
    let strangers: Vec<usize> = (0..mesh.len())
        .filter(|&v| table[v].is_some() && !mesh.triangles_of_vertex(v).iter().any(|&t| has_image(t, &table)))
        .collect();
    for v in strangers {
        if let Some(w) = table[v].take() {
            table[w as usize] = None;
        }
    }
    table
}

/// Nearest partners about the plane x = `middle` that name each other.
fn table_about(mesh: &Mesh, middle: f64) -> Vec<Option<u32>> {
    let reach = (REACH * mesh.mean_edge_length()).max(1e-9);
    let cell = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| (c / reach).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(mesh.len());
    for (v, p) in mesh.positions().iter().enumerate() {
        cells.entry(cell(p)).or_default().push(v as u32);
    }
    let nearest: Vec<Option<u32>> = mesh
        .positions()
        .iter()
        .map(|p| {
            let image = Point3::new(2.0 * middle - p.x, p.y, p.z);
            let [x, y, z] = cell(&image);
            let around =
                (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
            let far = |w: &u32| (mesh.positions()[*w as usize] - image).norm_squared();
            around
                .filter_map(|c| cells.get(&c))
                .flatten()
                .copied()
                .filter(|w| far(w) <= reach * reach)
                .min_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)))
        })
        .collect();
    let answered = |(v, w): (usize, &Option<u32>)| w.filter(|&w| nearest[w as usize] == Some(v as u32));
    nearest.iter().enumerate().map(answered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generic_face_has_the_table_that_it_was_made_with() {
        let face = crate::face::generic();
        assert_eq!(detect(face.mesh()), face.mirror());
        assert_eq!(plane_of_symmetry(face.mesh()), 0.0);
    }

    #[test]
    fn a_shifted_and_shaken_face_is_found_again() {
        let face = crate::face::generic();
        let shaken = super::super::patches::shaken(face.mesh().positions(), 0.2, 7);
        let moved: Vec<_> = shaken.iter().map(|p| Point3::new(p.x + 31.0, p.y, p.z)).collect();
        let mesh = face.mesh().with_positions(moved).unwrap();
        assert!((plane_of_symmetry(&mesh) - 31.0).abs() < 0.1);
        let back = mesh.positions().iter().map(|p| Point3::new(p.x - 31.0, p.y, p.z)).collect();
        assert_eq!(detect(&mesh.with_positions(back).unwrap()), face.mirror());
    }

    #[test]
    fn a_mesh_without_halves_has_no_pairs() {
        let mesh = super::super::patches::triangular(6, 5, 4.0);
        assert_eq!(plane_of_symmetry(&mesh), 0.0);
        let alone = detect(&mesh).iter().flatten().count();
        assert!(alone <= mesh.len() / 4, "{alone}");
    }
}
