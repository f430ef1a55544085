//! Perspective projection of the face onto the picture, and the way back along a ray.

use nalgebra::{Matrix2x3, Matrix3x2, Point2, Point3, Vector3};

/// A pinhole camera on the z axis of face space, looking along −z. Thesis (4.6), with `x_prp = y_prp = 0` as in (4.7).
///
/// Image space: pixels, origin at the top-left corner of the top-left pixel, y down. A millimetre on the view plane
/// `z = z_vp` is `px_per_mm` pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the z axis meets the picture, px.
    pub principal_point_px: Point2<f64>,
    /// z of the projection reference point, mm (the thesis's z_prp): the distance of the camera.
    pub z_prp_mm: f64,
    /// z of the view plane, mm (the thesis's z_vp).
    pub z_vp_mm: f64,
    /// Pixels per millimetre on the view plane.
    pub px_per_mm: f64,
}

/// A half-line `origin + t · direction`, t ≥ 0, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The projection reference point.
    pub origin: Point3<f64>,
    /// Towards the scene; not normalised, so that t = 1 on the view plane.
    pub direction: Vector3<f64>,
}

impl Camera {
    /// Perspective projection. Thesis (4.7).
    ///
    /// x_p = x (z_prp − z_vp) / (z_prp − z), y_p alike, in mm on the view plane; then to pixels with y turned down.
    ///
    /// Not finite for a point level with the camera (z = z_prp): [`Camera::sees`] tells.
    pub fn image_from_face(&self, x: &Point3<f64>) -> Point2<f64> {
        let shrink = (self.z_prp_mm - self.z_vp_mm) / (self.z_prp_mm - x.z);
        Point2::new(
            self.principal_point_px.x + self.px_per_mm * x.x * shrink,
            self.principal_point_px.y - self.px_per_mm * x.y * shrink,
        )
    }

    /// Inverse projection at a known depth. Thesis (4.8).
    ///
    /// x = x_p (z_prp − z) / (z_prp − z_vp), y alike; z stays.
    pub fn face_from_image(&self, p: &Point2<f64>, z_mm: f64) -> Point3<f64> {
        let grow = (self.z_prp_mm - z_mm) / (self.z_prp_mm - self.z_vp_mm);
        let (x_p, y_p) = self.view_plane_from_image(p);
        Point3::new(x_p * grow, y_p * grow, z_mm)
    }

    /// The ray from the projection reference point through a pixel. Thesis Fig. 4.5.
    pub fn ray(&self, p: &Point2<f64>) -> Ray {
        let (x_p, y_p) = self.view_plane_from_image(p);
        Ray {
            origin: Point3::new(0.0, 0.0, self.z_prp_mm),
            direction: Vector3::new(x_p, y_p, self.z_vp_mm - self.z_prp_mm),
        }
    }

    /// Change of a ray's direction with the pixel: ∂d/∂p, mm per px on the view plane.
    pub fn ray_slope(&self) -> Matrix3x2<f64> {
        let s = 1.0 / self.px_per_mm;
        Matrix3x2::new(s, 0.0, 0.0, -s, 0.0, 0.0)
    }

    /// Change of the pixel with the point: ∂p/∂x of [`Camera::image_from_face`], px per mm.
    pub fn image_slope(&self, x: &Point3<f64>) -> Matrix2x3<f64> {
        let depth = self.z_prp_mm - x.z;
        let s = self.px_per_mm * (self.z_prp_mm - self.z_vp_mm) / depth;
        Matrix2x3::new(s, 0.0, s * x.x / depth, 0.0, -s, -s * x.y / depth)
    }

    /// Whether a point lies in front of the camera.
    pub fn sees(&self, x: &Point3<f64>) -> bool {
        x.z < self.z_prp_mm
    }

    fn view_plane_from_image(&self, p: &Point2<f64>) -> (f64, f64) {
        ((p.x - self.principal_point_px.x) / self.px_per_mm, (self.principal_point_px.y - p.y) / self.px_per_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera { principal_point_px: Point2::new(518.0, 518.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 }
    }

    #[test]
    fn a_point_on_the_view_plane_keeps_its_size_and_a_nearer_one_grows() {
        // z = 0: 10 mm right and 20 mm up are 40 px right and 80 px up of the centre.
        let p = camera().image_from_face(&Point3::new(10.0, 20.0, 0.0));
        assert_eq!(p, Point2::new(558.0, 438.0));
        // z = 200: the factor is 1000 / 800 = 1.25.
        let p = camera().image_from_face(&Point3::new(10.0, 20.0, 200.0));
        assert_eq!(p, Point2::new(568.0, 418.0));
    }

    #[test]
    fn slopes_agree_with_central_differences() {
        let (c, x, h) = (camera(), Point3::new(31.0, -22.0, 17.0), 1e-4);
        let slope = c.image_slope(&x);
        for axis in 0..3 {
            let mut e = Vector3::zeros();
            e[axis] = h;
            let d = (c.image_from_face(&(x + e)) - c.image_from_face(&(x - e))) / (2.0 * h);
            assert!((d - slope.column(axis)).norm() < 1e-7);
        }
        let p = Point2::new(100.0, 200.0);
        for (axis, e) in [Vector2::x(), Vector2::y()].into_iter().enumerate() {
            let d = c.ray(&(p + e)).direction - c.ray(&p).direction;
            assert!((d - c.ray_slope().column(axis)).norm() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn there_and_back_again(x in -90.0..90.0, y in -130.0..100.0, z in -100.0..60.0, d in 300.0..3000.0, s in 0.5..20.0) {
            let c = Camera { z_prp_mm: d, px_per_mm: s, ..camera() };
            let x = Point3::new(x, y, z);
            let p = c.image_from_face(&x);
            prop_assert!((c.face_from_image(&p, z) - x).norm() < 1e-9);
            let r = c.ray(&p);
            let t = (z - r.origin.z) / r.direction.z;
            prop_assert!((r.origin + t * r.direction - x).norm() < 1e-9);
        }
    }
}
