//! The membrane against sheets worked out by hand, against springs, and against differences of its own energy.

use super::*;
use crate::face::patches::{right_angled, shaken, triangular};
use crate::forces::{SpringRule, Springs, muscle_forces};
use crate::skin::Contraction;

const MATERIALS: [Material; 2] = [Material::Fibres, Material::Principal];

fn linear() -> StressStrainCurve {
    StressStrainCurve::new(vec![[-0.5, -20.0], [0.5, 20.0]], Contraction::Fung).unwrap()
}

/// Elastic energy, mJ.
fn energy(membrane: &Membrane, x: &[Point3<f64>]) -> f64 {
    membrane.forces(x, None, &mut Vec::new())
}

fn stretched(x: &[Point3<f64>], [xx, xy, yy]: [f64; 3]) -> Vec<Point3<f64>> {
    x.iter().map(|p| Point3::new(p.x * (1.0 + xx) + p.y * xy, p.y * (1.0 + yy), p.z)).collect()
}

/// An isotropic sheet under the strains (e, 0) holds ½ E h e² / (1 − ν²) on every area, under (e, e) E h e² / (1 − ν): with ν = 1/3
/// 9/16 and 3/2, with ν = 0 1/2 and 1. E = 36.2 kPa, the table's first slope, h = 1.5 mm.
#[test]
fn small_strains_find_the_sheets_of_poisson_s_ratio_one_third_and_none() {
    let flat = triangular(7, 6, 5.0);
    let mesh =
        flat.with_positions(shaken(flat.positions(), 0.8, 5).iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect());
    let mesh = mesh.unwrap();
    let area: f64 = mesh.vertex_areas(mesh.positions()).iter().sum();
    let e = 1e-5;
    let unit = 1e-3 * 36.2 * 1.5 * e * e * area;
    for (material, along, both) in [(Material::Fibres, 9.0 / 16.0, 1.5), (Material::Principal, 0.5, 1.0)] {
        let membrane = Membrane::new(&mesh, mesh.positions(), Sheet { material, ..Sheet::default() });
        for (strain, expected) in [([e, 0.0, 0.0], along), ([0.0, 0.0, e], along), ([e, 0.0, e], both)] {
            let energy = energy(&membrane, &stretched(mesh.positions(), strain));
            assert!((energy / unit - expected).abs() < 1e-4, "{material:?} {strain:?}: {}", energy / unit);
        }
    }
}

/// The three springs of an equilateral triangle, each with the triangle's area over its length as its width, hold A h Σ w(ε) together: the sum
/// over fibres along the three sides. So forces agree at any stretch, and along twelve directions at small ones.
#[test]
fn on_equilateral_triangles_fibres_along_the_sides_are_the_springs() {
    let mesh = triangular(8, 7, 6.0);
    let force = |curve: &StressStrainCurve, directions: usize, x: &[Point3<f64>]| {
        let sheet = Sheet { curve: curve.clone(), directions, ..Sheet::default() };
        let mut out = Vec::new();
        Membrane::new(&mesh, mesh.positions(), sheet).forces(x, None, &mut out);
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        let mut by_springs = Vec::new();
        muscle_forces(&springs, curve, x, None, &mut by_springs);
        let largest = by_springs.iter().map(Vector3::norm).fold(0.0, f64::max);
        // What muscles must pull is what the skin pulls against.
        out.iter().zip(&by_springs).map(|(a, b)| (a + b).norm()).fold(0.0, f64::max) / largest
    };
    for amount in [0.3, 1.2] {
        let x = shaken(mesh.positions(), amount, 17);
        let off = force(&StressStrainCurve::default(), 3, &x);
        assert!(off < 1e-12, "{off}");
    }
    let flat: Vec<_> = shaken(mesh.positions(), 1e-5, 3).iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let off = force(&linear(), 12, &flat);
    assert!(off < 1e-5, "{off}");
    let flat: Vec<_> = shaken(mesh.positions(), 0.6, 3).iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let off = force(&linear(), 12, &flat);
    assert!(off > 1e-3, "at large strains three directions are not all: {off}");
}

#[test]
fn a_uniform_stretch_pulls_on_no_vertex_within_any_mesh() {
    let flat = right_angled(7, 6, 6.0, 5.0);
    let mesh =
        flat.with_positions(shaken(flat.positions(), 1.2, 9).iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect());
    let mesh = mesh.unwrap();
    let border = mesh.on_border();
    for material in MATERIALS {
        let membrane = Membrane::new(&mesh, mesh.positions(), Sheet { material, ..Sheet::default() });
        let mut forces = Vec::new();
        membrane.forces(&stretched(mesh.positions(), [0.15, 0.2, -0.1]), None, &mut forces);
        let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
        for (f, border) in forces.iter().zip(&border) {
            assert!(*border || f.norm() < 1e-12 * largest, "{material:?} {f}");
        }
        assert!(forces.iter().sum::<Vector3<f64>>().norm() < 1e-12 * largest);
    }
}

/// Also where triangles are pressed below the least area, and turned over.
#[test]
fn forces_are_the_slope_of_the_energy_and_stiffness_that_of_the_forces() {
    let mesh = triangular(4, 4, 6.0);
    for material in MATERIALS {
        let membrane = Membrane::new(&mesh, mesh.positions(), Sheet { material, ..Sheet::default() });
        for (amount, closed) in [(0.8, false), (4.0, true)] {
            let x = shaken(mesh.positions(), amount, 31);
            let opens = membrane.elements.iter().any(|e| e.area(&x) < LEAST_AREA);
            assert_eq!(opens, closed);
            let (mut forces, mut up, mut down) = (Vec::new(), Vec::new(), Vec::new());
            membrane.forces(&x, None, &mut forces);
            let mut whole = vec![Matrix3::zeros(); mesh.len()];
            let at = 5;
            membrane.stiffness(&x, None, true, |_, corners, k| {
                for (j, &corner) in corners.iter().enumerate() {
                    if let Some(i) = corners.iter().position(|c| *c == at) {
                        whole[corner as usize] += k[j][i];
                    }
                }
            });
            for axis in 0..3 {
                let h = 1e-6;
                let moved = |by: f64| {
                    let mut y = x.clone();
                    y[at as usize][axis] += by;
                    y
                };
                let slope = (energy(&membrane, &moved(h)) - energy(&membrane, &moved(-h))) / (2.0 * h);
                assert!((slope + forces[at as usize][axis]).abs() < 1e-7, "{material:?} {amount} {axis}");
                membrane.forces(&moved(h), None, &mut up);
                membrane.forces(&moved(-h), None, &mut down);
                for (j, k) in whole.iter().enumerate() {
                    let by_difference = (down[j] - up[j]) / (2.0 * h);
                    let off = (by_difference - k.column(axis)).norm();
                    assert!(closed || off < 1e-6, "{material:?} {j} {axis}: {off}");
                }
            }
        }
    }
}
