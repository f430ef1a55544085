//! A face as it is painted for a picture: brows and lips on the skin, eyeballs and the dark of the mouth behind it.

use nalgebra::{Point2, Point3, Vector3};

use crate::draw::paint::{Paint, Patch, Shape};
use crate::draw::surface_picture::{Ball, Fill};
use crate::expression::openings::{IRIS_MM, PUPIL_MM, openings};
use crate::face::FaceModel;

const SKIN: [u8; 3] = [222, 193, 174];
const BROW: [u8; 3] = [86, 64, 52];
const LIPS: [u8; 3] = [182, 104, 98];
const MOUTH: [u8; 3] = [52, 24, 26];
/// White of the eye.
const WHITE: [u8; 3] = [240, 238, 232];
/// Colour of the iris.
pub const IRIS: [u8; 3] = [92, 70, 50];
const PUPIL: [u8; 3] = [20, 18, 18];
/// Radius of an eyeball, mm.
const EYE_MM: f64 = 12.0;
/// Half widths of a brow at its inner and its outer end, mm.
const BROW_HALF_MM: [f64; 2] = [2.7, 1.0];
/// Points along a curve.
const STEPS: usize = 20;

/// Eyeballs and the dark of the mouth, seen through the openings.
pub fn fills(face: &FaceModel, rest: &[Point3<f64>], positions: &[Point3<f64>]) -> Vec<Fill> {
    let fill = |opening: crate::expression::openings::Opening| {
        let corners = opening.border.iter().map(|&v| positions[v as usize]).collect();
        let Some(iris) = opening.iris else {
            return Fill { corners, colour: MOUTH, behind_mm: 6.0, ball: None };
        };
        let centre = iris - Vector3::z() * (EYE_MM * EYE_MM - IRIS_MM * IRIS_MM).sqrt();
        let ball = Ball { centre, radius_mm: EYE_MM, rings: vec![(PUPIL_MM, PUPIL), (IRIS_MM, IRIS)] };
        Fill { corners, colour: WHITE, behind_mm: 6.0, ball: Some(ball) }
    };
    openings(face, rest).into_iter().map(fill).collect()
}

/// Brows and lips by the landmarks of a face at `rest`; none where it has none of them.
pub fn paint(face: &FaceModel, rest: &[Point3<f64>]) -> Option<Paint> {
    let at = |id: &str| face.landmark(id).and_then(|l| rest.get(l.vertex as usize).copied());
    let mut patches = Vec::new();
    // Lips, from the right corner over the upper lip to the left one and back.
    let ids = ["mouth_corner_right", "upper_lip", "mouth_corner_left", "lower_lip"];
    if let [Some(right), Some(upper), Some(left), Some(lower)] = ids.map(at) {
        let mut border = vec![right.xy()];
        border.extend(at("lip_peak_right").map(|p| p.xy()));
        border.push(upper.xy());
        border.extend(at("lip_peak_left").map(|p| p.xy()));
        border.extend(curve(&left, &lower, &right));
        let all = [right, upper, left, lower];
        patches.push(Patch::new(Shape::Area(border), LIPS, 2.0, depths(&all)));
    }
    for side in ["left", "right"] {
        let ids = ["inner", "mid", "outer"].map(|k| at(&format!("brow_{k}_{side}")));
        if let [Some(inner), Some(mid), Some(outer)] = ids {
            let shape = Shape::Stroke { path: curve(&inner, &mid, &outer), half_widths_mm: BROW_HALF_MM };
            patches.push(Patch::new(shape, BROW, 1.0, depths(&[inner, mid, outer])));
        }
    }
    (!patches.is_empty()).then(|| Paint { ground: SKIN, rest: rest.to_vec(), patches })
}

fn depths(points: &[Point3<f64>]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p.z), high.max(p.z)])
}

/// The parabola through three points, seen from the front.
fn curve(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>) -> Vec<Point2<f64>> {
    let (a, b, c) = (a.xy(), b.xy(), c.xy());
    let (first, second) = ((b - a).norm(), (c - b).norm());
    let m = (first / (first + second).max(1e-9)).clamp(0.05, 0.95);
    let point = |k: usize| {
        let t = k as f64 / STEPS as f64;
        let weights = [(t - m) * (t - 1.0) / m, t * (t - 1.0) / (m * (m - 1.0)), t * (t - m) / (1.0 - m)];
        Point2::from(a.coords * weights[0] + b.coords * weights[1] + c.coords * weights[2])
    };
    (0..=STEPS).map(point).collect()
}
