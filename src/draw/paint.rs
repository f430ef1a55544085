//! Colour laid on a surface at rest, which goes with it when it moves: brows, lips.

use nalgebra::{Point2, Point3};

use super::raster::{Colour, colour};

/// What is painted on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// Colour where nothing else is.
    pub ground: [u8; 3],
    /// The surface at rest, mm: where its vertices were when it was painted from the front.
    pub rest: Vec<Point3<f64>>,
    /// What lies on the ground, each over those before it.
    pub patches: Vec<Patch>,
}

/// A shape seen from the front at rest, mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line with a half width at its beginning and its end.
    Stroke {
        /// Its middle.
        path: Vec<Point2<f64>>,
        /// Half widths, mm.
        half_widths_mm: [f64; 2],
    },
    /// What lies within a border.
    Area(Vec<Point2<f64>>),
}

/// A shape in one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    shape: Shape,
    colour: Colour,
    soft_mm: f64,
    /// Beyond this box nothing is painted: neither beside the shape nor on skin far behind it.
    low: Point3<f64>,
    high: Point3<f64>,
}

/// How far from its marks a patch may lie in depth, mm.
const DEEP_MM: f64 = 15.0;

impl Patch {
    /// A shape whose edge fades over `soft_mm`, on skin between these depths (z, mm) and somewhat beyond.
    pub fn new(shape: Shape, rgb: [u8; 3], soft_mm: f64, depths_mm: [f64; 2]) -> Self {
        let (points, wide) = match &shape {
            Shape::Stroke { path, half_widths_mm: [a, b] } => (path, a.max(*b)),
            Shape::Area(border) => (border, 0.0),
        };
        let beyond = wide + soft_mm;
        let mut low = Point3::new(f64::INFINITY, f64::INFINITY, depths_mm[0] - DEEP_MM);
        let mut high = Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, depths_mm[1] + DEEP_MM);
        for p in points {
            low = Point3::new(low.x.min(p.x - beyond), low.y.min(p.y - beyond), low.z);
            high = Point3::new(high.x.max(p.x + beyond), high.y.max(p.y + beyond), high.z);
        }
        Self { shape, colour: colour(rgb), soft_mm: soft_mm.max(1e-9), low, high }
    }

    /// How much of it covers a point: 0 to 1.
    fn cover(&self, at: &Point3<f64>) -> f32 {
        if (0..3).any(|k| !(self.low[k]..=self.high[k]).contains(&at[k])) {
            return 0.0;
        }
        (0.5 - self.shape.outside(&at.xy()) / self.soft_mm).clamp(0.0, 1.0) as f32
    }
}

impl Shape {
    /// Distance from the shape's edge, mm, negative within.
    fn outside(&self, at: &Point2<f64>) -> f64 {
        match self {
            Self::Stroke { path, half_widths_mm: [first, last] } => {
                let pieces = path.len().saturating_sub(1).max(1) as f64;
                let from = |(i, ends): (usize, &[Point2<f64>])| {
                    let (distance, along) = to_segment(at, &ends[0], &ends[1]);
                    distance - (first + (last - first) * (i as f64 + along) / pieces)
                };
                path.windows(2).enumerate().map(from).fold(f64::INFINITY, f64::min)
            }
            Self::Area(border) => {
                let sides = || border.iter().zip(border.iter().cycle().skip(1));
                let distance = sides().map(|(a, b)| to_segment(at, a, b).0).fold(f64::INFINITY, f64::min);
                let crossed = |(a, b): &(&Point2<f64>, &Point2<f64>)| {
                    (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x)
                };
                if sides().filter(crossed).count() % 2 == 1 { -distance } else { distance }
            }
        }
    }
}

/// Distance to a segment, and where on it the nearest point lies, 0 to 1.
pub(crate) fn to_segment(p: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> (f64, f64) {
    let (ab, ap) = (b - a, p - a);
    let along = (ap.dot(&ab) / ab.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    ((ap - ab * along).norm(), along)
}

impl Paint {
    /// The colour where three vertices have these weights; the ground where one of them was not at rest.
    pub(super) fn colour(&self, triangle: [usize; 3], weights: [f64; 3]) -> Colour {
        let mut out = colour(self.ground);
        let mut at = Point3::origin();
        for (v, w) in triangle.into_iter().zip(weights) {
            let Some(p) = self.rest.get(v) else { return out };
            at += p.coords * w;
        }
        for patch in &self.patches {
            let cover = patch.cover(&at);
            for (under, over) in out.iter_mut().zip(patch.colour) {
                *under += (over - *under) * cover;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_tapers_and_an_area_has_an_inside() {
        let stroke = Shape::Stroke {
            path: vec![Point2::new(0.0, 0.0), Point2::new(5.0, 0.0), Point2::new(10.0, 0.0)],
            half_widths_mm: [3.0, 1.0],
        };
        assert!((stroke.outside(&Point2::new(5.0, 4.0)) - 2.0).abs() < 1e-9);
        assert!((stroke.outside(&Point2::new(10.0, 0.0)) + 1.0).abs() < 1e-9);
        let square = Shape::Area([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(Point2::from).to_vec());
        assert!((square.outside(&Point2::new(1.0, 2.0)) + 1.0).abs() < 1e-9);
        assert!((square.outside(&Point2::new(7.0, 8.0)) - 5.0).abs() < 1e-9);
        let patch = Patch::new(square, [255, 0, 0], 1.0, [0.0, 0.0]);
        let paint = Paint { ground: [0; 3], rest: vec![Point3::new(2.0, 2.0, 0.0); 3], patches: vec![patch] };
        assert_eq!(paint.colour([0, 1, 2], [0.5, 0.25, 0.25]), [1.0, 0.0, 0.0]);
        assert_eq!(paint.colour([0, 1, 3], [0.5, 0.25, 0.25]), [0.0; 3]);
        // The back of a head lies behind the brow, and is not painted.
        let behind = Paint { rest: vec![Point3::new(2.0, 2.0, -90.0); 3], ..paint };
        assert_eq!(behind.colour([0, 1, 2], [0.5, 0.25, 0.25]), [0.0; 3]);
    }
}
