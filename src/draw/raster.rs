//! A small software rasteriser: depth-buffered triangles and lines, smoothed by several samples a pixel, without a graphics driver.
//!
//! Each sample first finds the triangle that is nearest to the eye; only then, once a sample, the caller's shader gives the
//! colour. Bands of rows are drawn side by side on all cores; the picture does not depend on their number.

use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// Rows of pixels drawn together by one thread.
const BAND_ROWS: u32 = 16;

/// A colour in display values (sRGB), 0 to 1 a channel.
pub type Colour = [f32; 3];

/// A corner on the picture: pixels from the top-left corner, y down; the smaller the depth, the nearer to the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// From the left edge, px.
    pub x: f64,
    /// From the top edge, px.
    pub y: f64,
    /// Distance from the eye, in any unit.
    pub depth: f64,
}

/// Where a sample meets the nearest triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle.
    pub triangle: usize,
    /// Barycentric weights of its corners, sum 1. They are those on the picture: under perspective the triangles must be
    /// small against their distance (a face's are).
    pub weights: [f64; 3],
}

/// A straight line that surfaces in front of it hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Its two ends.
    pub ends: [Corner; 2],
    /// Width, px.
    pub width_px: f64,
    /// Colour.
    pub colour: Colour,
    /// 0 clear to 1 solid.
    pub opacity: f32,
    /// How much nearer than it is the line counts, in the unit of depth, so that it shows on the surface it lies on.
    pub lift: f64,
}

/// Size and smoothness of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Samples along each side of a pixel: 1 is jagged, 3 is smooth (nine samples a pixel).
    pub samples: u32,
}

/// What one sample sees: the nearest triangle, the weights of its first two corners, and the depth.
#[derive(Clone, Copy)]
struct Sample {
    triangle: u32,
    weights: [f32; 2],
    depth: f32,
}

const NOTHING: Sample = Sample { triangle: u32::MAX, weights: [0.0; 2], depth: f32::INFINITY };

impl Raster {
    /// Draws triangles (seen from either side), then lines over them, over a background given for each pixel's middle.
    ///
    /// Corners that are not finite leave their triangle out.
    pub fn draw(
        &self,
        triangles: &[[Corner; 3]],
        shade: impl Fn(Hit) -> Colour + Sync,
        lines: &[Line],
        background: impl Fn(f64, f64) -> Colour + Sync,
    ) -> RgbImage {
        let mut picture = RgbImage::new(self.width, self.height);
        if picture.is_empty() {
            return picture;
        }
        let band_bytes = 3 * self.width as usize * BAND_ROWS as usize;
        picture.par_chunks_mut(band_bytes).enumerate().for_each(|(b, pixels)| {
            let rows = (pixels.len() / (3 * self.width as usize)) as u32;
            let band = Band::covered(self, b as u32 * BAND_ROWS, rows, triangles);
            let mut colours = band.shade(&shade, &background);
            for line in lines {
                band.stroke(line, &mut colours);
            }
            band.average(&colours, pixels);
        });
        picture
    }

    /// The nearest triangle at the middle of every pixel, row by row; none where there is none. Samples are not asked for.
    pub fn nearest(&self, triangles: &[[Corner; 3]]) -> Vec<Option<u32>> {
        let whole = Self { samples: 1, ..*self };
        let mut nearest = vec![None; self.width as usize * self.height as usize];
        if nearest.is_empty() {
            return nearest;
        }
        nearest.par_chunks_mut(self.width as usize * BAND_ROWS as usize).enumerate().for_each(|(b, pixels)| {
            let rows = (pixels.len() / self.width as usize) as u32;
            let band = Band::covered(&whole, b as u32 * BAND_ROWS, rows, triangles);
            for (pixel, sample) in pixels.iter_mut().zip(&band.samples) {
                *pixel = (sample.triangle != u32::MAX).then_some(sample.triangle);
            }
        });
        nearest
    }
}

/// Some rows of the picture, in samples.
struct Band {
    /// Samples along the side of a pixel.
    per_px: f64,
    width: usize,
    height: usize,
    /// First row of samples, in samples from the top of the picture.
    top: f64,
    samples: Vec<Sample>,
}

impl Band {
    /// The rows of a raster from the first on, with the nearest triangle of each sample.
    fn covered(raster: &Raster, first_row: u32, rows: u32, triangles: &[[Corner; 3]]) -> Self {
        let per_px = raster.samples.clamp(1, 8);
        let (width, height) = ((raster.width * per_px) as usize, (rows * per_px) as usize);
        let mut band = Self {
            per_px: f64::from(per_px),
            width,
            height,
            top: f64::from(first_row * per_px),
            samples: vec![NOTHING; width * height],
        };
        for (i, corners) in triangles.iter().enumerate() {
            band.cover(i as u32, corners);
        }
        band
    }

    /// The corner in samples of this band, relative to the middle of its first sample.
    fn local(&self, c: &Corner) -> [f64; 2] {
        [c.x * self.per_px - 0.5, c.y * self.per_px - self.top - 0.5]
    }

    /// The samples whose middle lies between two values, along a side of `count` samples.
    fn between(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
        let first = low.ceil().clamp(0.0, count as f64) as usize;
        let end = (high.floor() + 1.0).clamp(0.0, count as f64) as usize;
        first..end.max(first)
    }

    fn cover(&mut self, triangle: u32, corners: &[Corner; 3]) {
        let [a, b, c] = corners.each_ref().map(|c| self.local(c));
        let ys = [a[1], b[1], c[1]];
        let (low, high) =
            (ys.into_iter().fold(f64::INFINITY, f64::min), ys.into_iter().fold(f64::NEG_INFINITY, f64::max));
        if high < 0.0 || low > self.height as f64 {
            return;
        }
        let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let depths = corners.map(|c| c.depth);
        if !(doubled_area.is_finite() && doubled_area.abs() > 1e-12 && depths.iter().all(|d| d.is_finite())) {
            return;
        }
        let xs = [a[0], b[0], c[0]];
        let columns = Self::between(
            xs.into_iter().fold(f64::INFINITY, f64::min),
            xs.into_iter().fold(f64::NEG_INFINITY, f64::max),
            self.width,
        );
        for y in Self::between(low, high, self.height) {
            let row = &mut self.samples[y * self.width..(y + 1) * self.width];
            let y = y as f64;
            for (x, sample) in row[columns.clone()].iter_mut().enumerate() {
                let x = (columns.start + x) as f64;
                let wa = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / doubled_area;
                let wb = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / doubled_area;
                let wc = 1.0 - wa - wb;
                // A hair of slack closes the seam between neighbours.
                if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                    continue;
                }
                let depth = (wa * depths[0] + wb * depths[1] + wc * depths[2]) as f32;
                if depth < sample.depth {
                    *sample = Sample { triangle, weights: [wa as f32, wb as f32], depth };
                }
            }
        }
    }

    fn shade(&self, shade: &impl Fn(Hit) -> Colour, background: &impl Fn(f64, f64) -> Colour) -> Vec<Colour> {
        let at = |i: usize| {
            let s = self.samples[i];
            if s.triangle == u32::MAX {
                let (x, y) = ((i % self.width) as f64 + 0.5, (i / self.width) as f64 + self.top + 0.5);
                return background(x / self.per_px, y / self.per_px);
            }
            let [a, b] = s.weights.map(f64::from);
            shade(Hit { triangle: s.triangle as usize, weights: [a, b, 1.0 - a - b] })
        };
        (0..self.samples.len()).map(at).collect()
    }

    fn stroke(&self, line: &Line, colours: &mut [Colour]) {
        let [a, b] = line.ends.each_ref().map(|c| self.local(c));
        let half = 0.5 * line.width_px * self.per_px;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length2 = dx * dx + dy * dy;
        if !(length2.is_finite() && half.is_finite()) {
            return;
        }
        let rows = Self::between(a[1].min(b[1]) - half, a[1].max(b[1]) + half, self.height);
        for y in rows {
            let fy = y as f64 - a[1];
            // The part of the row that the line's band can reach.
            let (low, high) = if dy.abs() > 1e-9 {
                let slope = dx / dy;
                let reach = half * (1.0 + slope * slope).sqrt();
                let middle = a[0] + slope * fy;
                let (l, h) = (a[0].min(b[0]) - half, a[0].max(b[0]) + half);
                ((middle - reach).max(l), (middle + reach).min(h))
            } else {
                (a[0].min(b[0]) - half, a[0].max(b[0]) + half)
            };
            for x in Self::between(low, high, self.width) {
                let fx = x as f64 - a[0];
                let along = if length2 > 0.0 { ((fx * dx + fy * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
                let (ex, ey) = (fx - along * dx, fy - along * dy);
                if ex * ex + ey * ey > half * half {
                    continue;
                }
                let depth = line.ends[0].depth + along * (line.ends[1].depth - line.ends[0].depth) - line.lift;
                let i = y * self.width + x;
                if depth <= f64::from(self.samples[i].depth) {
                    for (under, over) in colours[i].iter_mut().zip(line.colour) {
                        *under += (over - *under) * line.opacity;
                    }
                }
            }
        }
    }

    fn average(&self, colours: &[Colour], pixels: &mut [u8]) {
        let n = self.per_px as usize;
        let across = self.width / n;
        let scale = 255.0 / (n * n) as f32;
        for (i, pixel) in pixels.chunks_exact_mut(3).enumerate() {
            let (x, y) = (i % across * n, i / across * n);
            let mut sum = [0.0; 3];
            for row in y..y + n {
                for colour in &colours[row * self.width + x..row * self.width + x + n] {
                    for (s, c) in sum.iter_mut().zip(colour) {
                        *s += c;
                    }
                }
            }
            for (to, s) in pixel.iter_mut().zip(sum) {
                *to = (s * scale).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

/// An 8-bit colour as the rasteriser takes it.
pub fn colour(rgb: [u8; 3]) -> Colour {
    rgb.map(|c| f32::from(c) / 255.0)
}

/// A picture of one colour.
pub fn blank(width: u32, height: u32, rgb: [u8; 3]) -> RgbImage {
    RgbImage::from_pixel(width, height, Rgb(rgb))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Colour = [1.0; 3];
    const BLACK: Colour = [0.0; 3];

    fn corners(points: [[f64; 3]; 3]) -> [Corner; 3] {
        points.map(|[x, y, depth]| Corner { x, y, depth })
    }

    fn ink(picture: &RgbImage) -> f64 {
        picture.pixels().map(|p| 1.0 - f64::from(p.0[0]) / 255.0).sum()
    }

    #[test]
    fn the_ink_of_a_triangle_is_its_area() {
        // Corners (5.2, 3.1), (90.7, 20.4), (30.3, 77.9): half the cross product of two sides is 2980.9 px².
        let t = corners([[5.2, 3.1, 1.0], [90.7, 20.4, 1.0], [30.3, 77.9, 1.0]]);
        let area = 0.5 * ((90.7 - 5.2) * (77.9 - 3.1) - (20.4 - 3.1) * (30.3 - 5.2));
        let raster = Raster { width: 100, height: 80, samples: 4 };
        let picture = raster.draw(&[t], |_| BLACK, &[], |_, _| WHITE);
        assert!((ink(&picture) - area).abs() < 3.0, "{} {area}", ink(&picture));
    }

    /// A far triangle over rows 0 to 19 of which the near one hides the left part: half planes x + y < 40 and x + y < 16 at pixels' middles.
    #[test]
    fn the_nearest_triangle_of_a_pixel_is_the_one_in_front() {
        let far = corners([[0.0, 0.0, 2.0], [40.0, 0.0, 2.0], [0.0, 40.0, 2.0]]);
        let near = corners([[0.0, 0.0, 1.0], [16.0, 0.0, 1.0], [0.0, 16.0, 1.0]]);
        let raster = Raster { width: 50, height: 20, samples: 3 };
        for (k, found) in raster.nearest(&[far, near]).into_iter().enumerate() {
            // Middles on a border belong to it.
            let sum = (k % 50 + k / 50 + 1) as f64;
            let expected = if sum <= 16.0 { Some(1) } else { (sum <= 40.0).then_some(0) };
            assert_eq!(found, expected, "{} {}", k % 50, k / 50);
        }
        assert!(Raster { width: 0, ..raster }.nearest(&[far]).is_empty());
    }

    #[test]
    fn two_triangles_with_a_common_side_leave_no_seam_and_count_once() {
        let (a, b, c, d) = ([0.0, 0.0, 1.0], [40.0, 0.0, 1.0], [40.0, 40.0, 1.0], [0.0, 40.0, 1.0]);
        let raster = Raster { width: 40, height: 40, samples: 3 };
        let picture = raster.draw(&[corners([a, b, c]), corners([a, c, d])], |_| BLACK, &[], |_, _| WHITE);
        assert!(picture.pixels().all(|p| p.0 == [0; 3]));
    }

    #[test]
    fn the_nearer_of_two_crossing_triangles_is_seen_whatever_the_order() {
        // Depth falls from left to right in one and is level in the other: they cross at x = 20.
        let level = corners([[0.0, 0.0, 0.5], [80.0, 0.0, 0.5], [0.0, 80.0, 0.5]]);
        let ramp = corners([[0.0, 0.0, 1.0], [40.0, 0.0, 0.0], [0.0, 80.0, 1.0]]);
        let raster = Raster { width: 40, height: 20, samples: 1 };
        for order in [[level, ramp], [ramp, level]] {
            let red = |h: Hit| if order[h.triangle] == ramp { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
            let picture = raster.draw(&order, red, &[], |_, _| WHITE);
            assert_eq!(picture.get_pixel(5, 2).0, [0, 0, 255]);
            assert_eq!(picture.get_pixel(30, 2).0, [255, 0, 0]);
        }
    }

    #[test]
    fn weights_interpolate_the_corners() {
        // The shader paints x/40 from the corners' own x: column i shows (i + ½)/40.
        let t = corners([[0.0, 0.0, 1.0], [80.0, 0.0, 1.0], [0.0, 80.0, 1.0]]);
        let raster = Raster { width: 40, height: 10, samples: 1 };
        let picture = raster.draw(&[t], |h| [(h.weights[1] * 80.0 / 40.0) as f32; 3], &[], |_, _| BLACK);
        for i in 0..40 {
            let expected = (f64::from(i) + 0.5) / 40.0 * 255.0;
            assert!((f64::from(picture.get_pixel(i, 4).0[0]) - expected).abs() < 0.51);
        }
    }

    #[test]
    fn a_line_is_as_wide_as_it_says_and_hides_behind_surfaces() {
        let end = |x, depth| Corner { x, y: 10.0, depth };
        let line =
            Line { ends: [end(5.0, 1.0), end(35.0, 1.0)], width_px: 2.0, colour: BLACK, opacity: 1.0, lift: 0.0 };
        let raster = Raster { width: 40, height: 20, samples: 5 };
        // Length 30 and width 2, with a half disc of radius 1 at each end.
        let free = raster.draw(&[], |_| WHITE, &[line], |_, _| WHITE);
        assert!((ink(&free) - (60.0 + std::f64::consts::PI)).abs() < 2.0, "{}", ink(&free));
        let wall = corners([[20.0, -100.0, 0.5], [200.0, 0.0, 0.5], [20.0, 100.0, 0.5]]);
        let behind = raster.draw(&[wall], |_| WHITE, &[line], |_, _| WHITE);
        assert!((ink(&behind) - (30.0 + std::f64::consts::FRAC_PI_2)).abs() < 1.5, "{}", ink(&behind));
        let lifted = raster.draw(&[wall], |_| WHITE, &[Line { lift: 0.6, ..line }], |_, _| WHITE);
        assert_eq!(lifted, free);
    }

    #[test]
    fn corners_that_are_no_numbers_draw_nothing() {
        let t = corners([[f64::NAN, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, f64::INFINITY, 1.0]]);
        let raster = Raster { width: 4, height: 4, samples: 2 };
        let line = Line { ends: [t[0], t[2]], width_px: 1.0, colour: BLACK, opacity: 1.0, lift: 0.0 };
        assert_eq!(ink(&raster.draw(&[t], |_| BLACK, &[line], |_, _| WHITE)), 0.0);
    }
}
