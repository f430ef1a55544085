//! The rest of the head, which no one measures but everyone would miss: eyes, mouth, hair, the turn of the jaw, neck and shirt.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::face::Mesh;
use crate::face::mesh::NONE;

/// What a triangle of the head is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Material {
    Skin,
    Eye,
    Mouth,
    Hair,
    Ear,
    Underside,
    Neck,
    Shirt,
}

/// A corner of a drawn triangle, in the head as it stands in the first frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub point: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Where its colour is looked up, mm.
    pub paint: Point3<f64>,
}

/// Triangles with their material.
#[derive(Default)]
pub(super) struct Shape {
    pub corners: Vec<Corner>,
    pub triangles: Vec<([u32; 3], Material)>,
}

/// The rim of a face and its openings, as closed lines of vertices.
pub(super) struct Borders {
    pub rim: Vec<usize>,
    pub eyes: Vec<Vec<usize>>,
    pub mouth: Option<Vec<usize>>,
}

impl Borders {
    /// The longest border is the rim; an opening beside the midline is an eye, one across it the mouth.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut next: BTreeMap<usize, usize> = BTreeMap::new();
        for (edge, sides) in mesh.edges().iter().zip(mesh.triangles_of_edge()) {
            if sides[1] == NONE {
                let triangle = mesh.triangles()[sides[0] as usize];
                // In the order of the triangle, so that all borders run the same way round.
                let forwards = (0..3).any(|k| triangle[k] == edge[0] && triangle[(k + 1) % 3] == edge[1]);
                let (a, b) = if forwards { (edge[0], edge[1]) } else { (edge[1], edge[0]) };
                next.insert(a as usize, b as usize);
            }
        }
        let mut loops = Vec::new();
        while let Some((&start, _)) = next.iter().next() {
            let mut line = vec![start];
            while let Some(to) = line.last().and_then(|last| next.remove(last)) {
                if to == start {
                    break;
                }
                line.push(to);
            }
            loops.push(line);
        }
        let length = |line: &Vec<usize>| {
            let sides = line.iter().zip(line.iter().cycle().skip(1));
            sides.map(|(&a, &b)| (mesh.positions()[a] - mesh.positions()[b]).norm()).sum::<f64>()
        };
        loops.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let middle = |line: &Vec<usize>| line.iter().map(|&v| mesh.positions()[v].x).sum::<f64>() / line.len() as f64;
        let mut openings = loops.into_iter();
        let rim = openings.next().unwrap_or_default();
        let (eyes, others): (Vec<_>, Vec<_>) = openings.partition(|line| middle(line).abs() > 10.0);
        Self { rim, eyes, mouth: others.into_iter().next() }
    }

    /// A border in the plane of the picture.
    pub(super) fn flat(mesh: &Mesh, line: &[usize]) -> Vec<Point2<f64>> {
        line.iter().map(|&v| mesh.positions()[v].xy()).collect()
    }
}

/// Hair and skull: middle and half axes of an ellipsoid, mm.
const SKULL: ([f64; 3], [f64; 3]) = ([0.0, 12.0, -96.0], [82.0, 103.0, 84.0]);
/// The left ear; the right one mirrors it.
const EAR: ([f64; 3], [f64; 3]) = ([75.0, -9.0, -72.0], [10.0, 29.0, 15.0]);
/// Shoulders under a shirt.
const SHOULDERS: ([f64; 3], [f64; 3]) = ([0.0, -228.0, -88.0], [215.0, 96.0, 80.0]);
/// Neck: middle of the column in x and z, its half axes at the top, mm.
const NECK: ([f64; 2], [f64; 2]) = ([0.0, -72.0], [53.0, 47.0]);

impl Shape {
    /// Everything of the head but the face's own skin, whose vertices are at `positions`.
    pub(super) fn around(positions: &[Point3<f64>], borders: &Borders) -> Self {
        let mut shape = Self::default();
        for eye in &borders.eyes {
            shape.fill(positions, eye, Material::Eye, 2.4, 1.0);
        }
        if let Some(mouth) = &borders.mouth {
            shape.fill(positions, mouth, Material::Mouth, -1.0, 1.6);
        }
        shape.turn_back(positions, &borders.rim);
        shape.ellipsoid(SKULL, Material::Hair);
        for side in [-1.0, 1.0] {
            let ([x, y, z], half) = EAR;
            shape.ellipsoid(([side * x, y, z], half), Material::Ear);
        }
        shape.ellipsoid(SHOULDERS, Material::Shirt);
        shape.neck();
        shape
    }

    fn corner(&mut self, point: Point3<f64>, normal: Vector3<f64>) -> u32 {
        let normal = normal.try_normalize(1e-12).unwrap_or_else(Vector3::z);
        self.corners.push(Corner { point, normal, paint: point });
        self.corners.len() as u32 - 1
    }

    /// A dome (mm high) that closes an opening, sunk behind its border.
    fn fill(&mut self, positions: &[Point3<f64>], border: &[usize], material: Material, dome_mm: f64, sunk_mm: f64) {
        const RINGS: usize = 10;
        let line: Vec<Point3<f64>> = border.iter().map(|&v| positions[v]).collect();
        let centre = Point3::from(line.iter().map(|p| p.coords).sum::<Vector3<f64>>() / line.len().max(1) as f64);
        let half_width = line.iter().map(|p| (p.x - centre.x).abs()).fold(1.0, f64::max);
        let n = line.len() as u32;
        let first = self.corners.len() as u32;
        for ring in 0..=RINGS {
            // A little beyond the border, so that no gap shows at a slant.
            let r = 1.12 * ring as f64 / RINGS as f64;
            for p in &line {
                let mut at = centre + (p - centre) * r;
                at.z += dome_mm * (1.0 - (r * r).min(1.0)) - sunk_mm;
                let flat = Vector2::new(at.x - centre.x, at.y - centre.y) / half_width;
                self.corner(at, Vector3::new(0.75 * flat.x, 0.95 * flat.y, 1.0));
            }
        }
        for ring in 0..RINGS as u32 {
            for k in 0..n {
                let (a, b) = (first + ring * n + k, first + ring * n + (k + 1) % n);
                self.triangles.push(([a, b, b + n], material));
                self.triangles.push(([a, b + n, a + n], material));
            }
        }
    }

    /// The skin of the jaw and the temples turns back behind the rim.
    fn turn_back(&mut self, positions: &[Point3<f64>], rim: &[usize]) {
        const STEPS: usize = 6;
        let n = rim.len() as u32;
        let first = self.corners.len() as u32;
        for step in 0..=STEPS {
            let t = step as f64 / STEPS as f64;
            for &v in rim {
                let p = positions[v];
                let inwards = 1.0 - 0.16 * t * t;
                let at = Point3::new(p.x * inwards, p.y * (1.0 - 0.06 * t * t), p.z - 46.0 * t);
                self.corner(at, Vector3::new(p.x, p.y + 10.0, 25.0 * (1.0 - t) - 10.0));
            }
        }
        for step in 0..STEPS as u32 {
            for k in 0..n {
                let (a, b) = (first + step * n + k, first + step * n + (k + 1) % n);
                self.triangles.push(([a, b, b + n], Material::Underside));
                self.triangles.push(([a, b + n, a + n], Material::Underside));
            }
        }
    }

    fn ellipsoid(&mut self, (middle, half): ([f64; 3], [f64; 3]), material: Material) {
        const AROUND: u32 = 64;
        const ROWS: u32 = 40;
        let half = Vector3::from(half);
        let first = self.corners.len() as u32;
        for row in 0..=ROWS {
            let (sin, cos) = (PI * f64::from(row) / f64::from(ROWS)).sin_cos();
            for k in 0..AROUND {
                let (s, c) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                let direction = Vector3::new(sin * s, cos, sin * c);
                let at = Point3::from(middle) + direction.component_mul(&half);
                self.corner(at, direction.component_div(&half));
            }
        }
        self.weave(first, ROWS, AROUND, material);
    }

    fn neck(&mut self) {
        const AROUND: u32 = 48;
        const ROWS: u32 = 12;
        let (middle, half) = NECK;
        let first = self.corners.len() as u32;
        for row in 0..=ROWS {
            let y = -80.0 - 120.0 * f64::from(row) / f64::from(ROWS);
            // It widens towards the shoulders.
            let wide = 1.0 + 0.35 * ((-y - 130.0) / 70.0).max(0.0).powi(2);
            for k in 0..AROUND {
                let (s, c) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                let at = Point3::new(middle[0] + half[0] * wide * s, y, middle[1] + half[1] * wide * c);
                self.corner(at, Vector3::new(s / half[0], 0.0, c / half[1]));
            }
        }
        self.weave(first, ROWS, AROUND, Material::Neck);
    }

    /// Triangles between rows of corners that close around.
    fn weave(&mut self, first: u32, rows: u32, around: u32, material: Material) {
        for row in 0..rows {
            for k in 0..around {
                let (a, b) = (first + row * around + k, first + row * around + (k + 1) % around);
                self.triangles.push(([a, b, b + around], material));
                self.triangles.push(([a, b + around, a + around], material));
            }
        }
    }
}
