//! The twin: a scene whose truth is known to the last digit, drawn as two photographs of a painted face.
//!
//! A prescribed brow raise slides the skin along the generic face (or every vertex goes to a place that is given), the head moves a little, a camera looks at both moments. The
//! positions in millimetres and in pixels are the truth against which everything that the chain finds in the pictures is measured.

mod brow_raise;
mod crossings;
mod head;
mod motion;
mod noise;
mod paint;
mod render;
mod surface;

use image::RgbImage;
use nalgebra::{Point2, Point3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::camera::{Camera, RigidMotion};
use crate::face::{FaceModel, Mesh};
pub use brow_raise::BrowRaise;
pub use crossings::TrueCrossing;
use motion::{Moment, Motion};
pub(super) use noise::normal_pair;
use surface::Surface;

/// The smallest turn of a head that was asked to keep still, degrees.
const LEAST_TURN_DEG: f64 = 0.5;

/// The joint about which a head turns, behind and below the face, mm.
const PIVOT: [f64; 3] = [0.0, -60.0, -85.0];

/// Share of the picture's height that the face takes.
const FACE_SHARE: f64 = 0.75;

/// What is asked of a twin. The same settings give the same twin, to the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TwinSettings {
    /// Seed of the head motion, the marking noise, the skin's texture and the camera's noise (default 1).
    pub seed: u64,
    /// Side of the square frames, px (64 to 4096, default 1036).
    pub size_px: u32,
    /// Strength of the brow raise: 1 is the full raise of 10.3 mm at the middle of the brow, the default 0.8 the 8.2 mm that 81 people
    /// reached on average (7.6 to 9.0 mm). 0 to 1.2.
    pub amplitude: f64,
    /// Whether the head moves between the frames (default true).
    pub head_motion: bool,
    /// Largest turn of the head, degrees (0.5 to 10, default 2); the smallest is 0.5.
    pub head_turn_deg: f64,
    /// Largest shift of the head, mm (0 to 20, default 2).
    pub head_shift_mm: f64,
    /// Distance of the camera from the origin of face space, mm (300 to 10 000, default 1000).
    pub distance_mm: f64,
    /// Whether a grid is painted on the skin (default true).
    pub grid: bool,
    /// Distance of the painted grid's lines, mm of the first frame's x and y (3 to 40, default 8).
    pub grid_pitch_mm: f64,
    /// Width of the painted lines, mm (0.2 to 3, default 1).
    pub grid_line_mm: f64,
    /// Standard deviation along each axis of the marks of [`Twin::marks_in_image`], px (0 to 20, default 0).
    pub noise_px: f64,
    /// Standard deviation of the camera's noise in each channel, of 255 (0 to 20, default 1.2).
    pub sensor_noise: f64,
    /// Share by which each lamp, and the light from all sides, becomes stronger or weaker (by chance) in the last frame (0 to 0.5,
    /// default 0).
    pub light_change: f64,
}

impl Default for TwinSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            size_px: 1036,
            amplitude: 0.8,
            head_motion: true,
            head_turn_deg: 2.0,
            head_shift_mm: 2.0,
            distance_mm: 1000.0,
            grid: true,
            grid_pitch_mm: 8.0,
            grid_line_mm: 1.0,
            noise_px: 0.0,
            sensor_noise: 1.2,
            light_change: 0.0,
        }
    }
}

/// Why there is no twin of these settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{setting} is {value}; it must lie between {low} and {high}")]
pub struct TwinError {
    /// The setting.
    pub setting: &'static str,
    /// Its value.
    pub value: f64,
    /// Smallest accepted.
    pub low: f64,
    /// Largest accepted.
    pub high: f64,
}

/// A scene of known truth. Vertices are those of the face model it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Twin {
    /// What was asked.
    pub settings: TwinSettings,
    /// The camera of both frames.
    pub camera: Camera,
    /// How the head moved, from the first frame to the last; not part of `last`.
    pub head_motion: RigidMotion,
    /// Each vertex in the first frame, mm.
    pub first: Vec<Point3<f64>>,
    /// Each vertex in the last frame as seen from the head, mm: what the expression alone did.
    pub last: Vec<Point3<f64>>,
    /// Each vertex in the picture of the first frame.
    pub first_in_image: Vec<Point2<f64>>,
    /// Each vertex in the picture of the last frame, with the motion of the head.
    pub last_in_image: Vec<Point2<f64>>,
    motion: Motion,
}

impl Twin {
    /// Makes the scene: positions and pixels, no pictures yet.
    ///
    /// The skin slides *on* the face: a vertex moves by [`BrowRaise`] in x and y and is put back onto the triangles of the first
    /// frame's face (piecewise flat, not smoothed), as the depth rule *slide on surface* assumes.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn generate(face: &FaceModel, settings: &TwinSettings) -> Result<Self, TwinError> {
        settings.check()?;
        let surface = Surface::new(face.mesh());
        let raise = Moment::Raise(BrowRaise { amplitude: settings.amplitude });
        let last = (0..face.mesh().len()).map(|v| raise.vertex(&surface, v)).collect();
        Ok(Self::of(face, last, settings, Motion::Raise))
    }

    /// A scene in which the expression takes every vertex to a given place (mm, one a vertex of the face), and the skin between as the triangles go.
    ///
    /// # Errors
    /// A setting outside its range; the amplitude is not looked at.
    pub fn displaced(face: &FaceModel, last: Vec<Point3<f64>>, settings: &TwinSettings) -> Result<Self, TwinError> {
        settings.check()?;
        Ok(Self::of(face, last, settings, Motion::Places))
    }

    fn of(face: &FaceModel, last: Vec<Point3<f64>>, settings: &TwinSettings, motion: Motion) -> Self {
        let first = face.mesh().positions().to_vec();
        let camera = camera_before(&first, settings);
        let head_motion = if settings.head_motion { head_motion(settings) } else { RigidMotion::default() };
        Self {
            first_in_image: first.iter().map(|x| camera.image_from_face(x)).collect(),
            last_in_image: last.iter().map(|x| camera.image_from_face(&head_motion.last_from_first(x))).collect(),
            settings: settings.clone(),
            camera,
            head_motion,
            first,
            last,
            motion,
        }
    }

    /// The skin when a share of the expression is done.
    fn skin_at(&self, mesh: &Mesh, share: f64) -> Moment {
        match self.motion {
            Motion::Raise => Moment::Raise(BrowRaise { amplitude: share * self.settings.amplitude }),
            Motion::Places => Moment::places(mesh, &self.first, &self.last, share),
        }
    }

    /// What a hand would mark in the first and the last frame: the true pixels with the settings' noise, each axis for itself.
    pub fn marks_in_image(&self) -> [Vec<Point2<f64>>; 2] {
        let mut random = Pcg64::seed_from_u64(self.settings.seed ^ 0x6d61_726b);
        [&self.first_in_image, &self.last_in_image].map(|truth| {
            let noisy = |p: &Point2<f64>| {
                let [a, b] = normal_pair(&mut random);
                Point2::new(p.x + self.settings.noise_px * a, p.y + self.settings.noise_px * b)
            };
            truth.iter().map(noisy).collect()
        })
    }

    /// The vertices of a list that the expression moved by no more than `within_mm`: those that may serve as still points.
    pub fn still(&self, vertices: &[u32], within_mm: f64) -> Vec<u32> {
        let moved = |v: usize| Some((self.last.get(v)? - self.first.get(v)?).norm());
        vertices.iter().copied().filter(|&v| moved(v as usize).is_some_and(|d| d <= within_mm)).collect()
    }

    /// The two photographs, first and last frame. `face` is the model that the twin was made from.
    pub fn render(&self, face: &FaceModel) -> [RgbImage; 2] {
        render::photographs(self, face)
    }

    /// The moment at which the raise has reached a share of its strength, 0 to 1, and the head's motion and the light the same share of
    /// theirs: the positions and the photograph. 0 is the first frame and 1 the last, with other noise of the camera.
    pub fn moment(&self, face: &FaceModel, share: f64) -> (Vec<Point2<f64>>, RgbImage) {
        render::moment(self, face, share.clamp(0.0, 1.0))
    }

    /// Where the lines of the painted grid cross on the skin, in the first and the last frame's picture.
    ///
    /// Only crossings on skin that faces the camera (a cosine of 0.25 and more) and where nothing is painted over (lips, brows, hair).
    pub fn crossings(&self, face: &FaceModel) -> Vec<TrueCrossing> {
        crossings::of(self, face)
    }
}

impl TwinSettings {
    fn check(&self) -> Result<(), TwinError> {
        let ranges = [
            ("size_px", f64::from(self.size_px), 64.0, 4096.0),
            ("amplitude", self.amplitude, 0.0, 1.2),
            ("distance_mm", self.distance_mm, 300.0, 10_000.0),
            ("grid_pitch_mm", self.grid_pitch_mm, 3.0, 40.0),
            ("grid_line_mm", self.grid_line_mm, 0.2, 3.0),
            ("noise_px", self.noise_px, 0.0, 20.0),
            ("sensor_noise", self.sensor_noise, 0.0, 20.0),
            ("head_turn_deg", self.head_turn_deg, LEAST_TURN_DEG, 10.0),
            ("head_shift_mm", self.head_shift_mm, 0.0, 20.0),
            ("light_change", self.light_change, 0.0, 0.5),
        ];
        let outside = ranges.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value));
        outside.map_or(Ok(()), |(setting, value, low, high)| Err(TwinError { setting, value, low, high }))
    }
}

/// A camera on the z axis whose picture the face fills to [`FACE_SHARE`], in the middle.
fn camera_before(positions: &[Point3<f64>], settings: &TwinSettings) -> Camera {
    let size = f64::from(settings.size_px);
    let mut camera =
        Camera { principal_point_px: Point2::origin(), z_prp_mm: settings.distance_mm, z_vp_mm: 0.0, px_per_mm: 1.0 };
    let rows = || positions.iter().map(|x| camera.image_from_face(x).y);
    let (top, bottom) = (rows().fold(f64::INFINITY, f64::min), rows().fold(f64::NEG_INFINITY, f64::max));
    camera.px_per_mm = FACE_SHARE * size / (bottom - top);
    camera.principal_point_px = Point2::new(0.5 * size, 0.5 * size - 0.5 * (top + bottom) * camera.px_per_mm);
    camera
}

impl Twin {
    /// The head's motion when a share of it is done.
    fn head_at(&self, share: f64) -> RigidMotion {
        RigidMotion {
            rotation: UnitQuaternion::from_scaled_axis(self.head_motion.rotation.scaled_axis() * share),
            translation_mm: self.head_motion.translation_mm * share,
            pivot: self.head_motion.pivot,
        }
    }
}

/// How a head moves between two frames, by the seed.
pub(super) fn head_motion(settings: &TwinSettings) -> RigidMotion {
    let mut random = Pcg64::seed_from_u64(settings.seed ^ 0x6865_6164);
    let mut direction = || loop {
        let v = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        // Only within the ball: a cube's corners would be favoured.
        if let Some(unit) = Unit::try_new(v, 0.1).filter(|_| v.norm() <= 1.0) {
            break (unit, random.random_range(0.0..1.0));
        }
    };
    let (axis, turn) = direction();
    let (way, shift): (_, f64) = direction();
    let [least, most] = [LEAST_TURN_DEG, settings.head_turn_deg].map(|deg| deg * (std::f64::consts::PI / 180.0));
    let angle = least + turn * (most - least);
    RigidMotion {
        rotation: UnitQuaternion::from_axis_angle(&axis, angle),
        translation_mm: way.into_inner() * (settings.head_shift_mm * shift.sqrt()),
        pivot: Point3::from(PIVOT),
    }
}

#[cfg(test)]
mod tests;
