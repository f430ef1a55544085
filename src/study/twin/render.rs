//! Draws a twin's two moments as photographs: painted skin under studio light, a plain background, the noise of a camera.

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::head::{Borders, Corner, Material, Shape};
use super::motion::{Between, Moment};
use super::noise::{layered, normal_pair, smooth};
use super::paint::{Light, Paint, bounds, distance_to, fall, mix};
use super::surface::Surface;
use super::{Twin, TwinSettings};
use crate::camera::RigidMotion;
use crate::draw::raster::{self, Colour, Hit, Raster};
use crate::face::FaceModel;

/// Segments that each side of a triangle of the face is cut into: about 2 mm, so that bent lines look bent.
const CUTS: u32 = 5;

/// Samples along the side of a pixel.
const SAMPLES: u32 = 3;

/// Direction to a lamp (not normalised), and its strength.
const LAMPS: [([f64; 3], f64); 3] = [([-0.6, 0.62, 0.68], 0.72), ([0.8, 0.1, 0.55], 0.2), ([0.0, -0.5, 0.6], 0.06)];
/// Light from all sides, from above and from below.
const AMBIENT: [f64; 2] = [0.3, 0.13];

/// The first and the last frame.
pub(super) fn photographs(twin: &Twin, face: &FaceModel) -> [RgbImage; 2] {
    let studio = Studio::of(twin, face);
    [(0.0, 0), (1.0, 1)].map(|(share, number)| studio.photograph(share, number))
}

/// Places and photograph when a share of the motion is done. Its camera noise is that of a frame of its own.
pub(super) fn moment(twin: &Twin, face: &FaceModel, share: f64) -> (Vec<Point2<f64>>, RgbImage) {
    let studio = Studio::of(twin, face);
    let skin = twin.skin_at(face.mesh(), share);
    let motion = twin.head_at(share);
    let seen = |v| twin.camera.image_from_face(&motion.last_from_first(&skin.vertex(&studio.surface, v)));
    let places = (0..face.mesh().len()).map(seen).collect();
    (places, studio.photograph(share, 2 + (share * 1e6) as u64))
}

/// The face's own skin, finely cut, where it is at a moment.
fn skin(face: &FaceModel, surface: &Surface, moment: &Moment) -> Shape {
    let mut shape = Shape::default();
    for t in face.mesh().triangles() {
        let t = t.map(|v| v as usize);
        let first = shape.corners.len() as u32;
        for row in 0..=CUTS {
            for k in 0..=row {
                let weights = [CUTS - row, row - k, k].map(|w| f64::from(w) / f64::from(CUTS));
                let place = Between { corners: t, weights };
                let now = moment.inside(surface, &place);
                shape.corners.push(Corner { point: now.point, normal: now.normal, paint: surface.at(&place).point });
            }
        }
        // Row r begins at corner r (r + 1) / 2.
        let at = |row: u32, k: u32| first + row * (row + 1) / 2 + k;
        for row in 0..CUTS {
            for k in 0..=row {
                shape.triangles.push(([at(row, k), at(row + 1, k), at(row + 1, k + 1)], Material::Skin));
                if k < row {
                    shape.triangles.push(([at(row, k), at(row + 1, k + 1), at(row, k + 1)], Material::Skin));
                }
            }
        }
    }
    shape
}

impl Shape {
    fn append(&mut self, other: &Self) {
        let shift = self.corners.len() as u32;
        self.corners.extend_from_slice(&other.corners);
        self.triangles.extend(other.triangles.iter().map(|&(t, material)| (t.map(|i| i + shift), material)));
    }
}

/// What does not change between the exposures.
struct Studio<'a> {
    twin: &'a Twin,
    face: &'a FaceModel,
    surface: Surface<'a>,
    around: Shape,
    borders: Borders,
    paint: Paint,
    eyes: Vec<Vec<Point2<f64>>>,
}

/// The paint on a twin's skin.
pub(super) fn paint(twin: &Twin, face: &FaceModel) -> Paint {
    let borders = Borders::of(face.mesh());
    let eyes = borders.eyes.iter().map(|eye| Borders::flat(face.mesh(), eye)).collect();
    Paint::new(&twin.settings, Borders::flat(face.mesh(), &borders.rim), eyes)
}

impl<'a> Studio<'a> {
    fn of(twin: &'a Twin, face: &'a FaceModel) -> Self {
        let mesh = face.mesh();
        let borders = Borders::of(mesh);
        Self {
            twin,
            face,
            surface: Surface::new(mesh),
            around: Shape::around(mesh.positions(), &borders),
            paint: paint(twin, face),
            eyes: borders.eyes.iter().map(|eye| Borders::flat(mesh, eye)).collect(),
            borders,
        }
    }

    /// The moment at which a share of the skin's motion, of the head's motion and of the change of light is done.
    fn photograph(&self, share: f64, number: u64) -> RgbImage {
        let moment = self.twin.skin_at(self.face.mesh(), share);
        let mut shape = skin(self.face, &self.surface, &moment);
        match &moment {
            Moment::Raise(_) => shape.append(&self.around),
            // Eyes, mouth and the turn of the jaw begin at the skin as it is now.
            Moment::Places { at, .. } => shape.append(&Shape::around(at, &self.borders)),
        }
        // The very motion of the last frame, without a turn there and back through its axis.
        let motion = if share >= 1.0 { self.twin.head_motion } else { self.twin.head_at(share) };
        self.expose(&shape, &motion, &Lamps::of(&self.twin.settings, share), number)
    }

    fn expose(&self, shape: &Shape, motion: &RigidMotion, lamps: &Lamps, number: u64) -> RgbImage {
        let camera = &self.twin.camera;
        let moved: Vec<Point3<f64>> = shape.corners.iter().map(|c| motion.last_from_first(&c.point)).collect();
        let normals: Vec<Vector3<f64>> = shape.corners.iter().map(|c| motion.rotation * c.normal).collect();
        let in_picture: Vec<raster::Corner> = moved
            .iter()
            .map(|x| {
                let p = camera.image_from_face(x);
                raster::Corner { x: p.x, y: p.y, depth: camera.z_prp_mm - x.z }
            })
            .collect();
        let triangles: Vec<[raster::Corner; 3]> =
            shape.triangles.iter().map(|(t, _)| t.map(|i| in_picture[i as usize])).collect();
        let shade = |hit: Hit| {
            let (t, material) = shape.triangles[hit.triangle];
            let blend = |of: &dyn Fn(usize) -> Vector3<f64>| {
                (0..3).map(|k| of(t[k] as usize) * hit.weights[k]).sum::<Vector3<f64>>()
            };
            let paint = Point3::from(blend(&|i| shape.corners[i].paint.coords));
            let normal = blend(&|i| normals[i]).try_normalize(1e-12).unwrap_or_else(Vector3::z);
            let to_eye = (Point3::new(0.0, 0.0, camera.z_prp_mm).coords - blend(&|i| moved[i].coords)).normalize();
            display(self.colour(material, &paint, normal, &to_eye, lamps))
        };
        let size = self.twin.settings.size_px;
        let raster = Raster { width: size, height: size, samples: SAMPLES };
        let mut picture =
            raster.draw(&triangles, shade, &[], |x, y| background(x / f64::from(size), y / f64::from(size)));
        self.add_noise(&mut picture, number);
        picture
    }

    fn colour(
        &self,
        material: Material,
        at: &Point3<f64>,
        normal: Vector3<f64>,
        to_eye: &Vector3<f64>,
        lamps: &Lamps,
    ) -> Light {
        let light = |n: &Vector3<f64>| lamps.light(n);
        let gloss = |n: &Vector3<f64>, to_eye: &Vector3<f64>, exponent: f64| lamps.gloss(n, to_eye, exponent);
        let flat = at.xy();
        match material {
            Material::Skin => {
                let [tilt_x, tilt_y] = self.paint.grain(&flat);
                let rough = (normal - Vector3::new(tilt_x, tilt_y, 0.0)).normalize();
                let open = Paint::openness(&flat);
                self.paint.at(&flat) * (light(&rough) * open)
                    + Light::repeat(gloss(&rough, to_eye, 22.0) * 0.055 * open)
            }
            Material::Underside => {
                let hair = fall(-at.y, -2.0, 14.0);
                let skin = Light::new(0.6, 0.34, 0.24) * (light(&normal) * fall(-at.z, 5.0, 75.0).max(0.25));
                mix(skin, [0.02, 0.013, 0.009], hair)
            }
            Material::Eye => self.eye(&flat, &normal, to_eye, lamps),
            Material::Mouth => Light::new(0.075, 0.02, 0.018),
            Material::Hair => {
                // Strands fall from the crown to both sides.
                let along = (at.y - 60.0).hypot(at.x) * 0.035;
                let across = at.x.atan2(at.y + 40.0) * 46.0;
                let strand = 0.75 + 0.45 * layered(across, along, 3, 21) + 0.25 * smooth(across * 4.0, along * 2.0, 22);
                Light::new(0.062, 0.038, 0.025) * (light(&normal) * strand.max(0.15))
                    + Light::new(1.0, 0.85, 0.7) * (gloss(&normal, to_eye, 9.0) * 0.018 * strand.max(0.0))
            }
            Material::Ear => {
                // The hollow of the ear, and its rim.
                let hollow = fall(((at.x.abs() - 77.0) / 7.0).hypot((at.y + 8.0) / 19.0), 0.5, 1.0);
                Light::new(0.66, 0.36, 0.27) * (light(&normal) * (0.8 - 0.38 * hollow))
            }
            Material::Neck => {
                // The chin keeps the light from the upper part.
                let shadow = 0.42 + 0.58 * fall(at.y, -152.0, -112.0);
                Light::new(0.6, 0.35, 0.25) * (light(&normal) * shadow)
            }
            Material::Shirt => {
                let weave = 1.0 + 0.08 * layered(at.x * 0.3, at.y * 0.3, 3, 23);
                Light::new(0.09, 0.12, 0.15) * (light(&normal) * weave)
            }
        }
    }

    /// White, iris and pupil, under the shadow of the upper lid.
    fn eye(&self, at: &Point2<f64>, normal: &Vector3<f64>, to_eye: &Vector3<f64>, lamps: &Lamps) -> Light {
        let nearest = self.eyes.iter().min_by(|a, b| distance_to(a, at).total_cmp(&distance_to(b, at)));
        let Some(border) = nearest else { return Light::zeros() };
        let (low, high) = bounds(border);
        let centre = Point2::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y) + 0.7);
        let (dx, dy) = (at.x - centre.x, at.y - centre.y);
        let r = dx.hypot(dy);
        let red = fall(-dx.abs(), -13.5, -8.0);
        let veins = 0.06 * layered(at.x * 0.9, at.y * 0.9, 2, 31);
        let mut colour = mix(Light::new(0.72, 0.68, 0.64) * (1.0 + veins), [0.55, 0.26, 0.22], 0.75 * red);
        let spokes = 0.5 + 0.5 * smooth(dy.atan2(dx) * 9.0, r * 0.7, 32);
        let iris = mix(Light::new(0.17, 0.1, 0.045) * (0.6 + 0.8 * spokes), [0.03, 0.02, 0.012], fall(-r, -5.7, -4.4));
        colour = mix(colour, [iris.x, iris.y, iris.z], fall(r, 5.6, 6.1));
        colour = mix(colour, [0.006, 0.005, 0.005], fall(r, 2.1, 2.5));
        let under_lid = fall(-(at.y - centre.y), -1.0, 2.0) * fall(distance_to(border, at), 0.4, 4.0);
        let round = fall(distance_to(border, at), 0.0, 1.6);
        let lit = lamps.light(normal) * (1.0 - 0.6 * under_lid) * (1.0 - 0.3 * round);
        let glint = fall((dx + 1.9).hypot(dy - 1.7), 0.5, 1.0);
        colour * (lit * 1.05) + Light::repeat(0.75 * glint + 0.05 * lamps.gloss(normal, to_eye, 40.0))
    }

    fn add_noise(&self, picture: &mut RgbImage, number: u64) {
        let sigma = self.twin.settings.sensor_noise;
        if sigma == 0.0 {
            return;
        }
        let mut random =
            Pcg64::seed_from_u64(self.twin.settings.seed.wrapping_mul(2).wrapping_add(number) ^ 0x6e6f_6973);
        for pair in picture.as_flat_samples_mut().samples.chunks_mut(2) {
            for (value, z) in pair.iter_mut().zip(normal_pair(&mut random)) {
                *value = (f64::from(*value) + sigma * z).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

/// How strong each lamp, and last the light from all sides, shines at a moment.
struct Lamps([f64; LAMPS.len() + 1]);

impl Lamps {
    fn of(settings: &TwinSettings, share: f64) -> Self {
        let mut random = Pcg64::seed_from_u64(settings.seed ^ 0x6c61_6d70);
        Self([(); LAMPS.len() + 1].map(|()| {
            let way = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            1.0 + way * share * settings.light_change
        }))
    }

    /// Diffuse light on a surface: three lamps, softened as skin does, and what comes from all sides.
    fn light(&self, normal: &Vector3<f64>) -> f64 {
        let lamps = LAMPS.iter().zip(&self.0).map(|((to, strength), change)| {
            let cos = normal.dot(&Vector3::from(*to).normalize());
            // Light enters the skin and comes out beyond the shadow's edge.
            strength * change * ((cos + 0.18) / 1.18).max(0.0)
        });
        let around = AMBIENT[1] + (AMBIENT[0] - AMBIENT[1]) * 0.5 * (1.0 + normal.y);
        lamps.sum::<f64>() + around * self.0[LAMPS.len()]
    }

    /// Mirror-like light of the first lamp (Blinn 1977): the larger the exponent, the smaller the spot.
    fn gloss(&self, normal: &Vector3<f64>, to_eye: &Vector3<f64>, exponent: f64) -> f64 {
        let half = (Vector3::from(LAMPS[0].0).normalize() + to_eye).normalize();
        self.0[0] * normal.dot(&half).max(0.0).powf(exponent)
    }
}

fn background(x: f64, y: f64) -> Colour {
    let r = ((x - 0.5).powi(2) + (y - 0.42).powi(2)).sqrt();
    let tone = 0.78 - 0.22 * r;
    [tone * 0.95, tone * 0.98, tone].map(|c| c as f32)
}

/// From linear light to display values: a soft shoulder for the highlights, then the sRGB curve (IEC 61966-2-1).
fn display(light: Light) -> Colour {
    let encode = |v: f64| {
        let v = (v * 1.12).max(0.0);
        let v = if v > 0.7 { 0.7 + 0.3 * (1.0 - (-(v - 0.7) / 0.3).exp()) } else { v };
        if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
    };
    [light.x, light.y, light.z].map(|v| encode(v) as f32)
}
