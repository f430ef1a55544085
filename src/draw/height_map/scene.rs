//! The geometry of a height map: the raised surface, its walls, the floor with its axes, and the view onto them.

use std::collections::BTreeMap;

use image::RgbImage;
use nalgebra::{Point3, Vector3};

use super::{HeightMapOptions, Heights};
use crate::draw::colour_map::{ColourMap, HATCHING, NOISE_HATCHING, NOT_MEASURED};
use crate::draw::raster::{Colour, Corner, Hit, Line, Raster, colour};
use crate::draw::ticks;

const PAPER: Colour = [0.984, 0.984, 0.988];
const FLOOR: Colour = [0.945, 0.945, 0.957];
const INK: Colour = [0.08, 0.08, 0.11];

/// Distance of the hatching's stripes on the face, and their width, mm.
const HATCH_MM: [f64; 2] = [3.4, 1.1];

/// Distance of the strokes over values below their noise, and the width of the dark and of the light one, mm.
const NOISE_HATCH_MM: [f64; 2] = [3.4, 0.45];

/// An axis on the edge of the floor.
pub(super) struct Axis {
    pub name: &'static str,
    pub name_at: (f64, f64),
    pub ticks: Vec<(String, (f64, f64))>,
}

#[derive(Clone, Copy)]
enum Surface {
    Measured,
    /// Measured, and below its noise.
    Noise,
    NotMeasured,
    Wall,
    Floor,
}

/// A height map ready to be drawn.
pub(super) struct Scene {
    pub width: u32,
    pub height: u32,
    pub axes: Vec<Axis>,
    /// Where the value to point out stands, px.
    pub peak_in_picture: Option<(f64, f64)>,
    colour_map: ColourMap,
    range: [f64; 2],
    view: View,
    points: Vec<Point3<f64>>,
    values: Vec<f64>,
    normals: Vec<Vector3<f64>>,
    triangles: Vec<([usize; 3], Surface)>,
    lines: Vec<(usize, usize, f32)>,
    floor_lines: Vec<[Point3<f64>; 2]>,
}

/// A parallel view from above: turned by the azimuth, tipped by the elevation, scaled to fit.
#[derive(Clone, Copy)]
struct View {
    turn: (f64, f64),
    tip: (f64, f64),
    px_per_mm: f64,
    centre: (f64, f64),
}

/// Heights drawn, in lengths of the colour bar, at most.
const HIGHEST: f64 = 2.0;

impl View {
    fn of(options: &HeightMapOptions) -> Self {
        Self { turn: options.azimuth.sin_cos(), tip: options.elevation.sin_cos(), px_per_mm: 1.0, centre: (0.0, 0.0) }
    }

    fn corner(&self, p: &Point3<f64>) -> Corner {
        let (sin, cos) = self.turn;
        let (right, away) = (p.x * cos - p.y * sin, p.x * sin + p.y * cos);
        let up = away * self.tip.0 + p.z * self.tip.1;
        Corner {
            x: self.centre.0 + right * self.px_per_mm,
            y: self.centre.1 - up * self.px_per_mm,
            depth: away * self.tip.1 - p.z * self.tip.0,
        }
    }

    /// Scales and centres so that all points lie within `[left, top, right, bottom]`, px.
    fn fit(&mut self, points: impl Iterator<Item = Point3<f64>>, [left, top, right, bottom]: [f64; 4]) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for c in points.map(|p| self.corner(&p)) {
            for (i, v) in [c.x, c.y].into_iter().enumerate() {
                low[i] = low[i].min(v);
                high[i] = high[i].max(v);
            }
        }
        let scale = ((right - left) / (high[0] - low[0]).max(1e-9)).min((bottom - top) / (high[1] - low[1]).max(1e-9));
        self.px_per_mm = scale;
        self.centre = (
            0.5 * (left + right) - scale * 0.5 * (low[0] + high[0]),
            0.5 * (top + bottom) - scale * 0.5 * (low[1] + high[1]),
        );
    }
}

impl Scene {
    pub(super) fn new(heights: &Heights<'_>, options: &HeightMapOptions, range: [f64; 2], exaggeration: f64) -> Self {
        let Heights { positions, values, .. } = *heights;
        let mut scene = Self {
            width: options.width_px.clamp(640, 8192),
            height: options.height_px.clamp(480, 8192),
            axes: Vec::new(),
            peak_in_picture: None,
            colour_map: options.colour_map,
            range,
            view: View::of(options),
            points: Vec::new(),
            values: Vec::new(),
            normals: Vec::new(),
            triangles: Vec::new(),
            lines: Vec::new(),
            floor_lines: Vec::new(),
        };
        let n = positions.len();
        // Vertex i raised, vertex n + i on the base.
        // A wild value must not shrink all the rest: nothing stands higher than twice the bar.
        let most = HIGHEST * range[0].abs().max(range[1].abs());
        let raised = |i: usize| values[i].map_or(0.0, |v| v.clamp(-most, most) * exaggeration);
        scene.points = (0..n).map(|i| Point3::new(positions[i].x, positions[i].y, raised(i))).collect();
        scene.points.extend(positions.iter().map(|p| Point3::new(p.x, p.y, 0.0)));
        scene.values = values.iter().map(|v| v.unwrap_or(0.0)).chain(values.iter().map(|v| v.unwrap_or(0.0))).collect();
        scene.raise(heights, n);
        scene.lay_floor();
        let peak = heights.peak.as_ref().and_then(|(v, _)| scene.points.get(*v).filter(|_| *v < n));
        scene.peak_in_picture = peak.map(|p| scene.view.corner(p)).map(|c| (c.x, c.y));
        scene
    }

    /// The measured surface with its walls, and the rest flat on the base.
    fn raise(&mut self, heights: &Heights<'_>, n: usize) {
        let Heights { triangles, values, below_noise, .. } = *heights;
        let mut sides: BTreeMap<(usize, usize), u32> = BTreeMap::new();
        let mut flat_edges = std::collections::BTreeSet::new();
        self.normals = vec![Vector3::zeros(); 2 * n];
        for t in triangles {
            let t = t.map(|i| i as usize);
            let edges = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| (a.min(b), a.max(b)));
            if t.iter().all(|&i| values[i].is_some()) {
                let [a, b, c] = t.map(|i| self.points[i]);
                let normal = (b - a).cross(&(c - a));
                for i in t {
                    self.normals[i] += normal;
                }
                let noise = t.iter().all(|&i| below_noise.get(i) == Some(&true));
                self.triangles.push((t, if noise { Surface::Noise } else { Surface::Measured }));
                for e in edges {
                    *sides.entry(e).or_default() += 1;
                }
            } else {
                self.triangles.push((t.map(|i| n + i), Surface::NotMeasured));
                flat_edges.extend(edges);
            }
        }
        for normal in &mut self.normals {
            *normal = normal.try_normalize(1e-12).unwrap_or_else(Vector3::z);
        }
        for (&(a, b), &count) in &sides {
            self.lines.push((a, b, 0.2));
            if count == 1 {
                self.triangles.push(([a, b, n + b], Surface::Wall));
                self.triangles.push(([a, n + b, n + a], Surface::Wall));
                self.lines.push((a, b, 0.5));
                self.lines.push((n + a, n + b, 0.35));
            }
        }
        self.lines.extend(flat_edges.iter().filter(|e| !sides.contains_key(e)).map(|&(a, b)| (n + a, n + b, 0.07)));
    }

    /// The floor: a rectangle about the face with a line every 20 mm and numbers along its two near edges.
    fn lay_floor(&mut self) {
        let bound = |pick: fn(&Point3<f64>) -> f64| {
            let low = self.points.iter().map(pick).fold(f64::INFINITY, f64::min);
            let high = self.points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
            if low <= high { [low, high] } else { [0.0, 1.0] }
        };
        let (xs, ys, zs) = (bound(|p| p.x), bound(|p| p.y), bound(|p| p.z));
        let step = ticks::nice_step((xs[1] - xs[0]).max(ys[1] - ys[0]).max(1e-6), 7);
        let out = |[low, high]: [f64; 2]| [(low / step).floor() * step, (high / step).ceil() * step];
        let (xs, ys) = (out(xs), out(ys));
        // Below the base by a hair, so that what lies on the base covers it.
        let z = zs[0].min(0.0) - 0.003 * (xs[1] - xs[0]);
        let at = |x, y| Point3::new(x, y, z);
        let first = self.points.len();
        self.points.extend([at(xs[0], ys[0]), at(xs[1], ys[0]), at(xs[1], ys[1]), at(xs[0], ys[1])]);
        self.values.extend([0.0; 4]);
        self.normals.extend([Vector3::z(); 4]);
        self.triangles.push(([first, first + 1, first + 2], Surface::Floor));
        self.triangles.push(([first, first + 2, first + 3], Surface::Floor));
        let along = |[low, high]: [f64; 2]| {
            let count = ((high - low) / step).round() as i32;
            (0..=count).map(move |i| low + f64::from(i) * step)
        };
        self.floor_lines.extend(along(xs).map(|x| [at(x, ys[0]), at(x, ys[1])]));
        self.floor_lines.extend(along(ys).map(|y| [at(xs[0], y), at(xs[1], y)]));

        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let view_box = [70.0, (0.165 * height).max(124.0), width - 200.0, height - 64.0];
        let mut view = self.view;
        view.fit(self.points.iter().copied(), view_box);
        self.view = view;

        // The edges nearest to the eye carry the numbers.
        let nearer = |a: Point3<f64>, b: Point3<f64>| self.view.corner(&a).depth < self.view.corner(&b).depth;
        let near_y = usize::from(!nearer(at(xs[0], ys[0]), at(xs[0], ys[1])));
        let near_x = usize::from(!nearer(at(xs[0], ys[0]), at(xs[1], ys[0])));
        let outwards = |i: usize| if i == 0 { -1.0 } else { 1.0 };
        let put = |p: Point3<f64>| {
            let c = self.view.corner(&p);
            (c.x, c.y)
        };
        let gap = 20.0 / self.view.px_per_mm;
        let rim_y = |x: f64, far: f64| put(at(x, ys[near_y] + outwards(near_y) * gap * far));
        let rim_x = |y: f64, far: f64| put(at(xs[near_x] + outwards(near_x) * gap * far, y));
        let labelled = |range: [f64; 2]| {
            let places: Vec<f64> = along(range).enumerate().filter(|(i, _)| i % 2 == 1).map(|(_, v)| v).collect();
            let labels = ticks::labels(&places);
            places.into_iter().zip(labels).collect::<Vec<_>>()
        };
        self.axes = vec![
            Axis {
                name: "x, mm",
                name_at: rim_y(0.5 * (xs[0] + xs[1]), 3.7),
                ticks: labelled(xs).into_iter().map(|(v, l)| (l, rim_y(v, 1.25))).collect(),
            },
            Axis {
                name: "y, mm",
                name_at: rim_x(0.5 * (ys[0] + ys[1]), 3.7),
                ticks: labelled(ys).into_iter().map(|(v, l)| (l, rim_x(v, 1.25))).collect(),
            },
        ];
    }

    pub(super) fn draw(&self) -> RgbImage {
        let corners: Vec<Corner> = self.points.iter().map(|p| self.view.corner(p)).collect();
        let triangles: Vec<[Corner; 3]> = self.triangles.iter().map(|(t, _)| t.map(|i| corners[i])).collect();
        // Lines are lifted towards the eye by a hair of the picture's depth.
        let lift = 1.6 / self.view.px_per_mm;
        let stroke = |ends: [Corner; 2], opacity: f32| Line { ends, width_px: 1.1, colour: INK, opacity, lift };
        let mut lines: Vec<Line> = self
            .floor_lines
            .iter()
            .map(|l| Line { lift: 0.1 * lift, ..stroke(l.each_ref().map(|p| self.view.corner(p)), 0.1) })
            .collect();
        lines.extend(self.lines.iter().map(|&(a, b, opacity)| stroke([corners[a], corners[b]], opacity)));
        let raster = Raster { width: self.width, height: self.height, samples: 3 };
        raster.draw(&triangles, |hit| self.shade(hit), &lines, |_, _| PAPER)
    }

    fn shade(&self, hit: Hit) -> Colour {
        let (t, surface) = self.triangles[hit.triangle];
        let blend = |of: &dyn Fn(usize) -> f64| (0..3).map(|k| hit.weights[k] * of(t[k])).sum::<f64>();
        let value_colour = || self.colour_map.of(Some(blend(&|i| self.values[i])), self.range);
        match surface {
            Surface::Floor => FLOOR,
            Surface::NotMeasured => {
                let (x, y) = (blend(&|i| self.points[i].x), blend(&|i| self.points[i].y));
                let stripe = (x + y).rem_euclid(HATCH_MM[0] * std::f64::consts::SQRT_2);
                colour(if stripe < HATCH_MM[1] * std::f64::consts::SQRT_2 { HATCHING } else { NOT_MEASURED })
            }
            // Half grey: a wall shows where the measured skin ends, it is no value of its own.
            Surface::Wall => {
                let (edge, grey) = (colour(value_colour()), colour(HATCHING));
                std::array::from_fn(|c| 0.45 * edge[c] + 0.4 * grey[c])
            }
            Surface::Measured | Surface::Noise => {
                // Across the hatching of what was not measured.
                let across = blend(&|i| self.points[i].x - self.points[i].y);
                if let (Surface::Noise, Some(stroke)) = (surface, noise_stroke(across)) {
                    return colour(stroke);
                }
                let normal = Vector3::from_fn(|axis, _| blend(&|i| self.normals[i][axis]));
                // Light from the upper left of the picture, whatever the view's turn.
                let (sin, cos) = self.view.turn;
                let to_light = Vector3::new(-0.55, 0.25, 0.8).normalize();
                let right = normal.x * cos - normal.y * sin;
                let away = normal.x * sin + normal.y * cos;
                let facing = Vector3::new(right, away, normal.z).normalize().dot(&to_light).max(0.0);
                lit(colour(value_colour()), (0.66 + 0.42 * facing) as f32)
            }
        }
    }
}

/// The stroke of the hatching of noise at a place, mm across it, if one lies there.
fn noise_stroke(across: f64) -> Option<[u8; 3]> {
    let [pitch, width] = NOISE_HATCH_MM.map(|mm| mm * std::f64::consts::SQRT_2);
    let stroke = (across.rem_euclid(pitch) / width) as usize;
    NOISE_HATCHING.get(stroke).copied()
}

/// A colour under more or less light; above 1 it goes towards white.
fn lit(colour: Colour, light: f32) -> Colour {
    colour.map(|c| if light <= 1.0 { c * light } else { c + (1.0 - c) * (light - 1.0) })
}
